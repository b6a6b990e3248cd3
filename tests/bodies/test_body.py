"""Bodies from meshes: mass, reference curvature, places, and energies against closed forms."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Given, Law, Material, cable, point_mass
from fmbs_skfem.bodies.body import Body, Cells, locate, probe
from fmbs_skfem.bodies.laws import CABLES
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.shapes import line
from fmbs_skfem.systems import At, System, assemble, compile_system, compiled, eliminate
from fmbs_skfem.systems.connections.joints import Clamp
from verification.plates import rectangle

from ..models import polyline, segment

SECTION = Given(EA=2000.0, EI=3.0, rhoA=0.5)
SPACES: list[dict[str, Any]] = [
    {"ancf": True},
    *({"degree": p, "continuity": k} for p in range(2, 6) for k in range(1, p)),
]
ROTATION = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()


def arc(cells: int, radius: float = 0.8) -> Any:
    """A quarter circle about the origin from the x axis to the y axis."""
    angle = np.linspace(0.0, np.pi / 2, cells + 1)
    return polyline(radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))


def wave(cells: int) -> Any:
    """A line that curves in space without an inflection in its plane of bending."""
    s = np.linspace(0.0, 1.0, cells + 1)
    return polyline(np.stack([np.cos(2 * s), np.sin(2 * s), 0.5 * s**2], axis=1))


def energy(system: System, q: np.ndarray) -> float:
    return compiled.strain_energy(compile_system(system), q.ravel())


def force(system: System, q: np.ndarray) -> np.ndarray:
    return compiled.forces(compile_system(system), q.ravel(), np.zeros(q.size)).reshape(q.shape)


def moments(body: Body) -> tuple[float, np.ndarray]:
    """Mass [kg] and centre of mass [m]."""
    mass = body.constant @ (body.mass @ body.constant)
    return float(mass), np.asarray(body.constant @ (body.mass @ body.reference)) / mass


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("space", SPACES)
def test_mass_of_a_straight_beam_is_exact(space: dict[str, Any], dim: int) -> None:
    """m = rhoA L, centre in the middle, and int rhoA (x - a)^2 dS = rhoA L^3 / 3, from unequal
    cells.
    """
    mesh = polyline(np.outer([0.0, 0.5, 0.7, 2.0], [0.6, 0.8, 0.0]) + np.array([1.0, 0.0, 0.0]))
    body = cable("beam", mesh, SECTION, dim=dim, **space)
    mass, centre = moments(body)
    assert_allclose(mass, 1.0, rtol=1e-12)
    assert_allclose(centre, [1.6, 0.8, 0.0][:dim], atol=1e-12)
    away = body.reference - np.outer(body.constant, [1.0, 0.0, 0.0][:dim])
    assert_allclose(np.sum(away * (body.mass @ away)), 0.5 * 2.0**3 / 3, rtol=1e-12)
    assert abs(body.mass - body.mass.T).max() < 1e-15
    assert np.linalg.eigvalsh(body.mass.toarray())[0] > 0.0


def orders(error: Callable[[int], float], cells: tuple[int, ...]) -> list[float]:
    errors = [error(n) for n in cells]
    return [float(np.log2(a / b)) for a, b in pairwise(errors)]


@pytest.mark.parametrize("ancf", [False, True])
def test_an_arc_converges_with_order_four(ancf: bool) -> None:
    """Distance from the circle; m = rhoA R pi / 2 and the centre at 2 R / pi in x and y are closer
    than that.
    """

    def distance(cells: int) -> float:
        body = cable("arc", arc(cells), SECTION, dim=2, ancf=ancf)
        assert body.space is not None
        r = (
            line.sample(body.space, np.linspace(0.0, line.breaks(body.space)[-1], 20 * cells))
            @ body.reference
        )
        largest = float(np.abs(np.linalg.norm(r, axis=1) - 0.8).max())
        mass, centre = moments(body)
        assert abs(mass - 0.2 * np.pi) < 0.1 * largest
        assert np.abs(centre - 1.6 / np.pi).max() < 0.1 * largest
        return largest

    assert min(orders(distance, (8, 16, 32))) > 3.9
    assert distance(32) < 2e-7


def test_reference_curvature_of_an_arc_converges_with_order_two() -> None:
    """kappa0 = 1 / R inside; planar curvature keeps the sense of the turn."""

    def curvature(cells: int, dim: int = 2) -> np.ndarray:
        body = cable("arc", arc(cells), SECTION, dim=dim)
        assert body.cells is not None
        return np.asarray(body.cells.section[2, :, cells // 4 : -cells // 4])

    assert (
        min(orders(lambda cells: float(np.abs(curvature(cells) - 1.25).max()), (8, 16, 32))) > 1.8
    )
    assert_allclose(curvature(16, 3), curvature(16, 2), rtol=1e-12)
    backwards = cable("arc", polyline(arc(16).points[::-1]), SECTION, dim=2)
    assert backwards.cells is not None
    assert backwards.cells.section[2].max() < 0.0


@pytest.mark.parametrize("law", [Law.EXACT, Law.MATERIAL])
@pytest.mark.parametrize("make", [arc, wave])
def test_ancf_and_splines_of_one_mesh_are_the_same_body(
    make: Callable[[int], Any], law: Law
) -> None:
    """With q_spline = T q_ancf: equal energies, f_ancf = T^T f_spline, m_ancf = T^T m_spline T."""
    ancf = cable("body", make(6), SECTION, ancf=True, law=law)
    spline = cable("body", make(6), SECTION, law=law)
    assert isinstance(ancf.space, line.Hermite)
    T = line.hermite_to_bspline(ancf.space)
    assert_allclose(T @ ancf.reference, spline.reference, atol=1e-14)
    assert_allclose((T.T @ spline.mass @ T).toarray(), ancf.mass.toarray(), atol=1e-15)
    q = ancf.reference + 0.02 * np.random.default_rng(3).normal(size=ancf.reference.shape)
    first, second = assemble([ancf]), assemble([spline])
    assert energy(second, T @ q) == pytest.approx(energy(first, q), rel=1e-12)
    f = force(first, q)
    assert_allclose(T.T @ force(second, T @ q), f, atol=1e-11 * np.abs(f).max())


@pytest.mark.parametrize("law", CABLES)
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("space", SPACES)
def test_rigid_motions_cost_nothing(space: dict[str, Any], dim: int, law: Law) -> None:
    mesh = segment(4) if law is Law.QUADRATIC else arc(4)
    body = cable("beam", mesh, SECTION, dim=dim, law=law, **space)
    system = assemble([body])
    turn = ROTATION if dim == 3 else np.array([[0.6, -0.8], [0.8, 0.6]])
    moved = body.reference @ turn.T + np.outer(body.constant, [3.0, -2.0, 1.0][:dim])
    stretched = 1.01 * body.reference
    assert abs(energy(system, moved)) < 1e-10 * energy(system, stretched)
    assert np.abs(force(system, moved)).max() < 1e-9 * np.abs(force(system, stretched)).max()


@pytest.mark.parametrize("space", SPACES)
def test_energy_of_a_stretched_beam_is_exact(space: dict[str, Any]) -> None:
    """U = EA/2 ((l^2 - 1) / 2)^2 L at a uniform stretch l."""
    body = cable("beam", segment(3, end=(0.0, 2.0, 0.0)), SECTION, **space)
    assert energy(assemble([body]), 1.2 * body.reference) == pytest.approx(
        1000.0 * 0.22**2 * 2.0, rel=1e-12
    )


def test_energy_of_a_bent_beam_converges_with_order_four() -> None:
    """A straight beam of 1 m laid on a full circle: U = EI/2 (2 pi)^2, and no stretch."""

    def circle(s: np.ndarray, derivative: int = 0) -> np.ndarray:
        """r(s) = (sin 2 pi s, 1 - cos 2 pi s) / (2 pi) and its derivatives."""
        phase = 2 * np.pi * s + derivative * np.pi / 2
        values = np.stack([np.sin(phase), -np.cos(phase)], axis=1) * (2 * np.pi) ** (derivative - 1)
        return values + np.array([0.0, 1 / (2 * np.pi)]) if derivative == 0 else values

    def error(cells: int) -> float:
        body = cable("beam", segment(cells), Given(EA=1.0, EI=3.0, rhoA=1.0), dim=2)
        assert body.space is not None
        return abs(energy(assemble([body]), line.fit(body.space, circle)) / (6 * np.pi**2) - 1.0)

    assert min(orders(error, (8, 16, 32))) > 3.7


@pytest.mark.parametrize("law", [Law.EXACT, Law.MATERIAL])
def test_planar_and_spatial_bodies_agree(law: Law) -> None:
    """A planar motion in space: the same energy and forces as in the plane, and forces normal to it
    that are exactly zero.
    """
    planar = cable("body", arc(6), SECTION, dim=2, law=law)
    spatial = cable("body", arc(6), SECTION, dim=3, law=law)
    assert abs(planar.mass - spatial.mass).max() == 0.0
    q = planar.reference + 0.002 * np.random.default_rng(5).normal(size=planar.reference.shape)
    flat = np.column_stack([q, np.zeros(len(q))])
    first, second = assemble([planar]), assemble([spatial])
    assert energy(second, flat) == pytest.approx(energy(first, q), rel=1e-11)
    f, g = force(first, q), force(second, flat)
    assert_allclose(g[:, :2], f, atol=1e-9 * np.abs(f).max())
    assert np.all(g[:, 2] == 0.0)


def test_placement_moves_and_turns_the_mesh() -> None:
    still = cable("beam", wave(5), SECTION)
    placed = cable("beam", wave(5), SECTION, origin=np.array([1.0, 2.0, 3.0]), rotation=ROTATION)
    assert_allclose(
        placed.reference,
        still.reference @ ROTATION.T + np.outer(still.constant, [1.0, 2.0, 3.0]),
        atol=1e-13,
    )
    assert still.cells is not None
    assert placed.cells is not None
    assert_allclose(placed.cells.section, still.cells.section, rtol=1e-10)


def test_a_group_of_lines_makes_a_body() -> None:
    mesh = replace(segment(4), line_groups={"half": np.array([0, 1])})
    body = cable("half", mesh, SECTION, group="half")
    assert_allclose(moments(body)[1], [0.25, 0.0, 0.0], atol=1e-15)
    assert body.places == {"left": 0.0}


def test_places_by_name_and_by_arc_length() -> None:
    body = cable("beam", arc(12), SECTION, dim=2)
    assert_allclose(probe(body, locate(body, "right")) @ body.reference, [[0.0, 0.8]], atol=1e-14)
    assert_allclose(probe(body, locate(body, 0.0)) @ body.reference, [[0.8, 0.0]], atol=1e-14)
    for angle in (0.2, 0.777, 1.4):
        xi = locate(body, 0.8 * angle)
        assert_allclose(
            probe(body, xi) @ body.reference,
            [[0.8 * np.cos(angle), 0.8 * np.sin(angle)]],
            atol=2e-5,
        )
        assert_allclose(
            probe(body, xi, 1) @ body.reference, [[-np.sin(angle), np.cos(angle)]], atol=5e-4
        )
        assert np.linalg.norm(probe(body, xi, 1) @ body.reference) == pytest.approx(1.0, abs=1e-14)


def test_arc_length_on_a_straight_beam_is_exact() -> None:
    body = cable("beam", polyline(np.outer([0.0, 0.1, 0.7, 2.0], [0.0, 0.0, 1.0])), SECTION)
    for s in (0.0, 0.05, 1.234, 2.0):
        assert_allclose(probe(body, locate(body, s)) @ body.reference, [[0.0, 0.0, s]], atol=1e-14)


def test_point_mass() -> None:
    body = point_mass("bob", 2.5, np.array([1.0, 2.0, 3.0]))
    mass, centre = moments(body)
    assert mass == 2.5
    assert_allclose(centre, [1.0, 2.0, 3.0])
    assert_allclose(probe(body, locate(body, "center")) @ body.reference, [[1.0, 2.0, 3.0]])
    assert assemble([body]).elastic == ()


@pytest.mark.parametrize(
    "make, named",
    [
        (
            lambda: locate(cable("beam", segment(2), SECTION), "rigth"),
            r"\(left, right\), got 'rigth'; did you mean 'right'",
        ),
        (lambda: locate(cable("beam", segment(2), SECTION), 1.5), "between 0 and 1 m, got 1.5 m"),
        (
            lambda: locate(cable("beam", segment(2), SECTION), float("nan")),
            "between 0 and 1 m, got nan m",
        ),
        (
            lambda: locate(point_mass("bob", 1.0, np.zeros(3)), 0.0),
            r"'bob': expected one of its points \(center\), got 0\.0",
        ),
        (lambda: locate(point_mass("bob", 1.0, np.zeros(3)), "centre"), "did you mean 'center'"),
        (
            lambda: locate(
                plate("lug", rectangle("ancf", 2, 1), 1e-3, Material(1e9, 1e3), dim=2), "right"
            ),
            "got the edge 'right'; name a point of the mesh, or take what has `edges`: .*edge, edge_load",
        ),
        (
            lambda: probe(point_mass("bob", 1.0, np.zeros(3)), 0.0, 1),
            "expected a body with a slope",
        ),
        (
            lambda: point_mass("bob", -1.0, np.zeros(3)),
            r"'bob'\.mass: expected a positive and finite number",
        ),
        (lambda: cable("beam", wave(4), SECTION, dim=2), "plane z = 0, got z up to 0.5 m"),
        (
            lambda: cable("beam", arc(4), SECTION, law=Law.QUADRATIC),
            "a straight line for quadratic curvature",
        ),
        (lambda: cable("beam", segment(4), SECTION, group="upper"), "upper"),
        (lambda: cable("beam", segment(4), SECTION, degree=2, continuity=2), "continuity"),
    ],
)
def test_bad_bodies_are_refused_by_name(make: Callable[[], object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        make()


@pytest.mark.parametrize("degree,continuity", [(1, 0), (3, 0), (3, 3)])
def test_a_slope_with_jumps_is_refused(degree: int, continuity: int) -> None:
    with pytest.raises(InputError, match="continuity between 1 and degree - 1"):
        cable("beam", segment(3), Given(1.0, 1.0, 1.0), degree=degree, continuity=continuity)


# ------------------------------------------------------------------------------------------------------- curved in space
def test_bending_a_planar_arc_out_of_its_plane_costs_nothing_without_tension() -> None:
    """The tangent of the reference is zero there; a hoop strain of 1 % gives it the stiffness of a
    string, N |w'|^2.
    """
    with pytest.warns(Notice, match=r"body 'beam' is curved in space.*take dimension 2"):
        body = cable("beam", arc(12), SECTION)
    model = compile_system(assemble([body]))
    out = np.zeros((len(body.reference), 3))
    out[:, 2] = body.reference[:, 0] * body.reference[:, 1]

    def stiffness(stretch: float) -> float:
        K = compiled.tangent(model, (stretch * body.reference).ravel(), np.zeros(0))
        return float(out.ravel() @ (K @ out.ravel())) / float(abs(K).max() * np.sum(out**2))

    assert abs(stiffness(1.0)) < 1e-12
    assert stiffness(1.01) > 1e-5


def test_straight_cables_in_space_and_curved_ones_in_the_plane_are_not_told() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        cable("beam", segment(4, end=(1.0, 2.0, 3.0)), SECTION)
        cable("beam", arc(8), SECTION, dim=2)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_modes_about_a_limp_reference_are_refused() -> None:
    """About a given state they are not: there a cable may be under tension."""
    body = cable("beam", arc(8), SECTION)
    system = eliminate(assemble([body], [Clamp("clamp", At("beam", "left"))]))
    with pytest.raises(
        InputError,
        match=r"straight cables, or a planar scene.*got 'beam', which is curved in space",
    ):
        vibration_modes(system, 4)
    assert vibration_modes(system, 4, system.x0).angular_frequencies.max() < 1e-2
    flat = cable("beam", arc(8), SECTION, dim=2)
    assert (
        vibration_modes(
            eliminate(assemble([flat], [Clamp("clamp", At("beam", "left"))])), 1
        ).angular_frequencies[0]
        > 1.0
    )


def test_threads_that_read_the_same_cells_first_make_their_numbers_once() -> None:
    made: list[int] = []

    def numbers() -> tuple[np.ndarray, np.ndarray]:
        made.append(len(made))
        time.sleep(0.05)
        return np.ones((2, 3, 4, 1)), np.ones((4, 3, 1))

    cells = Cells.later(Law.EXACT, np.zeros((4, 1), np.int64), 2, 3, numbers)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: cells.table, range(4)))
    assert made == [0]
    assert all(table is cells.table for table in found)
