"""Plates and shells as bodies: mass, rims, patch tests, thickness."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import SAMPLES, Rim, edge, plate, trace
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.shapes import nurbs, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, assemble, check_system, compile_system, compiled, eliminate
from fmbs_skfem.systems.connections import joints
from verification.plates import KINDS, SIDES, rectangle
from verification.vibration import ring

__all__ = ["KINDS", "rectangle", "ring"]

MATERIAL = Material(young_modulus=7e10, density=2700.0, poisson_ratio=0.3)


def sheet(
    shape: Surface, thickness: float | np.ndarray = 0.01, dim: int = 3, **options: object
) -> Body:
    return plate("plate", shape, thickness, options.pop("material", MATERIAL), dim=dim, **options)  # type: ignore[arg-type]


def fitted(shape: Surface, field: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Coordinates (n, c) of a field (x, c) of the reference positions (x, 2 or 3), which the
    interpolation has to hold exactly.
    """
    table = surface.tabulate(shape, 6)
    cell, xi = (
        np.repeat(np.arange(len(shape.nodes)), table.points.shape[1]),
        table.points.reshape(-1, 2),
    )
    rows = surface.sample(shape, cell, xi).toarray()
    wanted = field(rows @ shape.reference)
    found = np.linalg.lstsq(rows, wanted, rcond=1e-12)[0]
    assert_allclose(rows @ found, wanted, atol=1e-11 * np.abs(wanted).max())
    return np.asarray(found)


def inner_functions(shape: Surface) -> np.ndarray:
    """Functions that vanish with their slopes on the whole edge."""
    A = trace(shape, edge("test", shape, SIDES), normal=True)
    return np.setdiff1d(np.arange(shape.count), A.indices[np.abs(A.data) > 1e-9])


@cache
def turn(dim: int) -> np.ndarray:
    """A rotation (c, c)."""
    Q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(dim, dim)))
    Q[:, 0] *= np.sign(np.linalg.det(Q))
    return Q


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("skew", [0.0, 0.2])
def test_mass_and_moments_of_a_rectangle(kind: str, skew: float) -> None:
    """m = rho t L b, S = m (L, b)/2, int x x^T dm = m (L^2/3, b^2/3; L b/4), whatever the mesh
    inside.
    """
    length, width, t = 3.0, 2.0, 0.02
    body = sheet(rectangle(kind, 4, 3, length, width, 0.0 if kind == "bfs" else skew), t, 2)
    m = MATERIAL.density * t * length * width
    one = body.mass @ body.constant
    assert body.constant @ one == pytest.approx(m, rel=1e-13)
    if kind == "nurbs" and skew:
        return  # the area element is no constant there, and the moments are not integrated exactly
    assert_allclose(body.reference.T @ one, 0.5 * m * np.array([length, width]), rtol=1e-12)
    moments = m * np.array(
        [[length**2 / 3, length * width / 4], [length * width / 4, width**2 / 3]]
    )
    assert_allclose(body.reference.T @ body.mass @ body.reference, moments, rtol=1e-12)


def test_inertia_of_a_ring() -> None:
    """m = rho t pi (R^2 - r^2) and J = m (R^2 + r^2)/2; cubic arcs of 15 degrees are up to 5.8e-9 R
    too large.
    """
    r, R, t = 0.2, 0.5, 0.01
    body = sheet(ring(r, R), t, 2)
    m = MATERIAL.density * t * np.pi * (R**2 - r**2)
    assert body.constant @ body.mass @ body.constant == pytest.approx(m, rel=2 * 5.8e-9)
    assert np.trace(body.reference.T @ body.mass @ body.reference) == pytest.approx(
        0.5 * m * (R**2 + r**2), rel=4 * 5.8e-9
    )


def test_area_of_a_cylinder_panel() -> None:
    """A NURBS panel is an exact cylinder: m = rho t R phi L."""
    shape = nurbs.surface(*nurbs.cylinder_panel(2.0, 3.0, -0.4, 0.6, 4, 3))
    body = sheet(shape, 0.1)
    assert body.constant @ body.mass @ body.constant == pytest.approx(
        MATERIAL.density * 0.1 * 2.0 * 1.0 * 3.0, rel=1e-9
    )


def test_one_edge_is_a_name_or_a_tuple_of_one() -> None:
    shape = rectangle("bfs", 3, 2)
    np.testing.assert_array_equal(edge("test", shape, "left"), edge("test", shape, ("left",)))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_rims_are_rigid_and_the_rest_is_free(kind: str, dim: int) -> None:
    """On a rim r = c + X e1 + Y e2 whatever the other coordinates are; off it they count."""
    shape = rectangle(kind, 3, 2)
    body = sheet(shape, dim=dim, rims={"grip": Rim(("left",))})
    assert body.spread is not None
    q = np.random.default_rng(5).normal(size=body.reference.shape)
    A = trace(shape, edge("test", shape, ("left",)))
    first = body.frames["grip"]
    at = np.asarray(A @ shape.reference)
    frame = q[first] + (at - [0.0, 0.5]) @ q[first + 1 : first + 3]
    assert_allclose(A @ (body.spread @ q), frame, atol=1e-12)
    off = trace(shape, edge("test", shape, ("right",)))
    assert np.abs(off @ (body.spread @ q)).max() > 0.1


SIDE = 0.5  #: mean length of the sides on the right edge of `rectangle(kind, 3, 2)`


@pytest.mark.parametrize("kind", KINDS)
def test_rims_with_slopes_are_clamped(kind: str) -> None:
    """The derivative across the rim is that of the frame, - e1 for the inward normal of the right
    edge.
    """
    shape = rectangle(kind, 3, 2)
    body = sheet(shape, rims={"grip": Rim(("right",), slopes=True)})
    assert body.spread is not None
    q = np.random.default_rng(6).normal(size=body.reference.shape)
    A = trace(shape, edge("test", shape, ("right",)), normal=True)
    slopes = (A @ (body.spread @ q))[A.shape[0] // 2 :].reshape(-1, SAMPLES, 3)
    # between its nodes the slope depends on the opposite ones
    slopes = slopes[:, [0, -1]] if kind == "ancf" else slopes
    assert_allclose(
        slopes / SIDE, np.broadcast_to(-q[body.frames["grip"] + 1], slopes.shape), atol=1e-11
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_plate_that_a_straight_rim_clamps_is_a_cantilever(kind: str) -> None:
    """Without Poisson's effect it has the frequencies 3.5160 and 22.034 sqrt(E t^2 / 12 rho) / L^2;
    one that is hinged swings.
    """
    steel = Material(1e9, 1000.0, 0.0)
    grip = [joints.Clamp("root", At("strip", "grip"))]
    lowest = []
    for slopes in (True, False):
        body = plate(
            "strip",
            rectangle(kind, 12, 1, 1.0, 0.05),
            1e-3,
            steel,
            rims={"grip": Rim(("left",), slopes=slopes)},
        )
        lowest.append(vibration_modes(eliminate(assemble([body], grip)), 2).angular_frequencies)
    assert_allclose(lowest[0], np.array([3.5160, 22.034]) * np.sqrt(1e9 / 12e3) * 1e-3, rtol=2e-3)
    assert lowest[1][0] < 1e-2 * lowest[0][0]


def test_a_rim_in_space_says_that_it_is_a_hinge() -> None:
    with pytest.warns(
        Notice, match="body 'plate', rims A, B: the plate is hinged to its frame, not clamped"
    ):
        sheet(rectangle("bfs", 2, 2), rims={"A": Rim(("left",)), "B": Rim(("right",))})
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        sheet(rectangle("bfs", 2, 2), dim=2, rims={"A": Rim(("left",))})
        sheet(
            rectangle("bfs", 2, 2),
            rims={"A": Rim(("left",), slopes=False), "B": Rim(("right",), slopes=True)},
        )


@pytest.mark.parametrize("slopes", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_rims_follow_rigid_motions(kind: str, dim: int, slopes: bool) -> None:
    """The reference and its rigid motions are held by the reduced functions, without energy."""
    shape = rectangle(kind, 3, 2)
    body = sheet(
        shape,
        dim=dim,
        rims={
            "A": Rim(("left",), None, slopes),
            "B": Rim(("right",), (1.0, 0.25, 0.0)[:dim], slopes),
        },
    )
    assert body.spread is not None
    wide = np.zeros((shape.count, dim))
    wide[:, :2] = shape.reference
    assert_allclose(body.spread @ body.reference, wide, atol=1e-13)
    assert_allclose(body.spread @ body.constant, shape.unit, atol=1e-13)
    moved = body.reference @ turn(dim).T + np.outer(body.constant, np.arange(1.0, dim + 1))
    model = compile_system(assemble([body]))
    stretched = compiled.strain_energy(model, 1.01 * body.reference.ravel())
    assert compiled.strain_energy(model, moved.ravel()) < 1e-20 * stretched


def test_the_center_of_a_round_rim_is_found() -> None:
    body = sheet(ring(0.2, 0.5), dim=2, rims={"hub": Rim(("inner",))}, origin=np.array([3.0, -1.0]))
    assert_allclose(body.reference[body.frames["hub"]], [3.0, -1.0], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_slopes_across_an_edge_are_along_its_normal(kind: str) -> None:
    """The derivative of the position across the right edge is the inward normal (-1, 0), on cells
    of any shape.
    """
    shape = rectangle(kind, 3, 2, skew=0.0 if kind == "bfs" else 0.3)
    A = trace(shape, edge("test", shape, ("right",)), normal=True)
    slopes = (A @ shape.reference)[A.shape[0] // 2 :]
    assert_allclose(slopes / SIDE, np.tile([-1.0, 0.0], (len(slopes), 1)), atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_membrane_patch(kind: str, dim: int) -> None:
    """r = F X, a constant stress, on a distorted mesh: no force on any function inside."""
    shape = rectangle(kind, 5, 4, skew=0.0 if kind == "bfs" else 0.25)
    body = sheet(shape, dim=dim)
    F = np.eye(dim) + 0.05 * np.random.default_rng(2).normal(size=(dim, dim))
    system = assemble([body])
    f = compiled.forces(
        compile_system(system), (body.reference @ F.T).ravel(), np.zeros(system.size)
    ).reshape(-1, dim)
    inside = inner_functions(shape)
    assert len(inside) > 4
    assert np.abs(f[inside]).max() < 1e-12 * np.abs(f).max()


def bending_force(kind: str, skew: float) -> tuple[float, float]:
    """Largest linear force inside and anywhere for w = x^2 + 0.7 y^2 - 0.4 x y, a constant
    curvature.
    """
    shape = rectangle(kind, 5, 4, skew=skew)
    system = assemble([sheet(shape, 0.1)])
    w = fitted(
        shape, lambda x: (x[:, 0] ** 2 + 0.7 * x[:, 1] ** 2 - 0.4 * x[:, 0] * x[:, 1])[:, None]
    )
    K = compiled.tangent(compile_system(system), system.x0, np.zeros(0))
    f = np.abs((K @ np.kron(w, [[0.0], [0.0], [1.0]]).ravel())[2::3])
    return float(f[inner_functions(shape)].max()), float(f.max())


@pytest.mark.parametrize(
    "kind,skew", [("ancf", 0.0), ("nurbs", 0.0), ("bfs", 0.0), ("argyris", 0.0), ("argyris", 0.25)]
)
def test_bending_patch(kind: str, skew: float) -> None:
    """Constant curvature: no force inside, on regular meshes, with Argyris triangles on any."""
    inside, largest = bending_force(kind, skew)
    assert inside < 1e-10 * largest


@pytest.mark.parametrize("kind", KINDS)
def test_axes_of_the_surface_do_not_matter(kind: str) -> None:
    """An isotropic plate placed anywhere has the turned forces."""
    shape, t = rectangle(kind, 3, 2), 0.05
    R, rng = turn(3), np.random.default_rng(4)
    here, there = sheet(shape, t), sheet(shape, t, rotation=R, origin=np.array([2.0, 1.0, -3.0]))
    q = here.reference + 0.05 * rng.normal(size=here.reference.shape)
    moved = q @ R.T + np.outer(here.constant, [2.0, 1.0, -3.0])
    still = np.zeros(q.size)
    f = compiled.forces(compile_system(assemble([here])), q.ravel(), still).reshape(-1, 3)
    g = compiled.forces(compile_system(assemble([there])), moved.ravel(), still).reshape(-1, 3)
    assert_allclose(g, f @ R.T, atol=1e-11 * np.abs(f).max())


def test_orientation_of_a_curved_panel_does_not_matter() -> None:
    """The two halves of a symmetric panel, and one that starts along the other axis, have the same
    frequencies of the tangent.
    """
    spectra = []
    for angles, rotation in (((-0.5, 0.5), None), ((0.2, 1.2), None), ((-0.5, 0.5), turn(3))):
        shape = nurbs.surface(*nurbs.cylinder_panel(1.0, 1.0, *angles, 3, 3))
        system = assemble([sheet(shape, 0.02, rotation=rotation)])
        K = compiled.tangent(compile_system(system), system.x0, np.zeros(0)).toarray()
        spectra.append(np.linalg.eigvalsh(K))
    for other in spectra[1:]:
        assert_allclose(other, spectra[0], atol=1e-11 * spectra[0][-1])
    assert np.abs(spectra[0][:6]).max() < 1e-12 * spectra[0][-1] < spectra[0][6] * 1e5


@pytest.mark.parametrize("kind", KINDS)
def test_thickness_of_every_cell(kind: str) -> None:
    """m = rho sum t_e A_e; a uniform stretch by eps along x stores E/(1 - nu^2) e^2/2 sum t_e A_e
    with e = eps + eps^2/2.
    """
    shape, eps = rectangle(kind, 4, 2, 2.0, 1.0), 1e-2
    t = np.linspace(0.01, 0.03, len(shape.nodes))
    body = sheet(shape, t, 2)
    volume = t.sum() * 2.0 / len(t)
    assert body.constant @ body.mass @ body.constant == pytest.approx(
        MATERIAL.density * volume, rel=1e-12
    )
    e = eps + 0.5 * eps**2
    density = 0.5 * MATERIAL.young_modulus / (1 - MATERIAL.poisson_ratio**2) * e**2
    stretched = body.reference * [1.0 + eps, 1.0]
    energy = compiled.strain_energy(compile_system(assemble([body])), stretched.ravel())
    assert energy == pytest.approx(density * volume, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_one_thickness_for_all_cells(kind: str) -> None:
    shape = rectangle(kind, 2, 2)
    one, many = sheet(shape, 0.02), sheet(shape, np.full(len(shape.nodes), 0.02))
    assert one.cells is not None
    assert many.cells is not None
    assert np.array_equal(one.cells.section, many.cells.section)
    assert np.array_equal(one.mass.toarray(), many.mass.toarray())


@pytest.mark.parametrize("rims", [{}, {"A": Rim(("left",))}])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_system_contract(kind: str, dim: int, rims: dict[str, Rim]) -> None:
    check_system(assemble([sheet(rectangle(kind, 2, 2), 0.05, dim, rims=rims)]))


def test_wrong_input_is_refused() -> None:
    shape = rectangle("ancf", 2, 2)
    with pytest.raises(InputError, match="thickness"):
        sheet(shape, 0.0)
    with pytest.raises(InputError, match=r"rim 'A'.*one of its edges.*'lefft'.*left"):
        sheet(shape, rims={"A": Rim(("lefft",))})
    with pytest.raises(InputError, match=r"rim 'B'.*apart from those of other rims"):
        sheet(shape, rims={"A": Rim(("left",)), "B": Rim(("bottom",))})
    with pytest.raises(InputError, match="plane z = 0"):
        sheet(nurbs.surface(*nurbs.cylinder_panel(1.0, 1.0, -0.5, 0.5, 2, 2)), dim=2)
