"""Pressures and edge loads that follow: contract on held rims, work on the volume, exact states,
load steps, motion, reduction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    follow_path,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.reduction.hyper import polynomial, sampling
from fmbs_skfem.results import motion
from fmbs_skfem.shapes import ancf_plate, skfem_surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    check_system,
    compile_system,
    compiled,
    eliminate,
    strain_energy,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import Constraints, change_coordinates
from verification.plates import rectangle

from .rigid_parts import grid

ALL = ("left", "right", "top", "bottom")
PRESSURE = loads.Pressure("p", "plate", 200.0, follower=True)


def sheet(cells: int = 3, make: Callable[..., Surface] = skfem_surface.bfs) -> Body:
    """A soft plate of about 1 m, 5 cm thick."""
    return plate("plate", grid(cells, cells, make=make), 0.05, Material(1e5, 500.0))


def held(body: Body, load: loads.Load) -> System:
    """The plate with all its edges held."""
    sensed = {"w": probes.Position(At("plate", "middle"))} if "middle" in body.places else {}
    return eliminate(assemble([body], [joints.Edge("hold", "plate", ALL)], [load], outputs=sensed))


def force(bodies: list[Body], load: loads.Load, x: np.ndarray) -> np.ndarray:
    """Generalised force of one load (n,)."""
    bare, whole = (compile_system(assemble(bodies, loads=some)) for some in ([], [load]))
    return np.asarray(compiled.forces(bare, x, 0 * x) - compiled.forces(whole, x, 0 * x))


@pytest.mark.parametrize("kind", ["ancf", "nurbs", "bfs"])
def test_contract_where_the_rim_is_held(kind: str) -> None:
    """The tangent is exact: the rim is held."""
    check_system(held(plate("plate", rectangle(kind, 3, 2), 0.05, Material(1e5, 500.0)), PRESSURE))


def test_contract_around_a_planar_plate() -> None:
    body = plate("plate", grid(2, 2, skew=0.3), 0.05, Material(1e5, 500.0), dim=2)
    check_system(assemble([body], loads=[loads.NormalEdgeLoad("pull", "plate", ALL, 300.0)]))


@pytest.mark.parametrize("faces", [(), ("first",)])
def test_the_force_on_a_free_plate(faces: tuple[str, ...]) -> None:
    """p times the vector of the area that bounds it, turned and stretched with the plate; it does p
    dV in any motion.
    """
    body = sheet(2, ancf_plate.surface)
    turn = Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix()
    x = (body.reference @ (turn @ np.diag([1.5, 1.2, 1.0])).T).ravel()
    load = loads.Pressure("p", "plate", 2.0, faces=faces, follower=True)
    f = force([body], load, x).reshape(-1, 3)
    share = 0.25 if faces else 1.0
    assert_allclose(body.constant @ f, 2.0 * share * 1.5 * 1.2 * turn[:, 2], atol=1e-12)
    lifted = np.outer(body.constant, 0.1 * turn[:, 2]).ravel()
    assert f.ravel() @ lifted == pytest.approx(2.0 * 0.1 * share * 1.5 * 1.2, rel=1e-12)


@pytest.mark.parametrize("follower", [False, True])
def test_arrows_of_a_pressure_in_pictures(follower: bool) -> None:
    """They begin at the plate, and turn with it where the pressure does; a negative one points the
    other way.
    """
    body = sheet(2, ancf_plate.surface)
    turn = Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix()
    system = assemble([body], loads=[loads.Pressure("p", "plate", -2.0, follower=follower)])
    shown = motion.arrows(system, (body.reference @ turn.T).reshape(1, -1)).values()
    aims = np.concatenate([arrow.directions / np.linalg.norm(arrow.directions) for arrow in shown])
    assert_allclose(
        aims, np.tile(-turn[:, 2] if follower else [0.0, 0.0, -1.0], (4, 1)), atol=1e-12
    )
    assert_allclose(np.concatenate([arrow.points for arrow in shown]) @ turn[:, 2], 0.0, atol=1e-12)
    assert {arrow.kind for arrow in shown} == {"force"}


def test_arrows_of_a_load_along_the_normal_of_an_edge_in_pictures() -> None:
    """On all four edges, away from the plate, with which they turn; a negative load points inwards."""
    body, turn = (
        plate("plate", grid(2, 3), 0.02, Material(1e5, 500.0), dim=2),
        Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()[:2, :2],
    )
    for edge, normal in {
        "left": (-1.0, 0.0),
        "right": (1.0, 0.0),
        "bottom": (0.0, -1.0),
        "top": (0.0, 1.0),
    }.items():
        system = assemble([body], loads=[loads.NormalEdgeLoad("p", "plate", (edge,), -2.0)])
        shown = motion.arrows(system, (body.reference @ turn.T).reshape(1, -1)).values()
        aims = np.concatenate(
            [arrow.directions / np.linalg.norm(arrow.directions) for arrow in shown]
        )
        assert_allclose(aims[:, :2], np.tile(-turn @ normal, (len(aims), 1)), atol=1e-12)
        middle = np.concatenate([arrow.points for arrow in shown]).mean(axis=0)[:2] @ turn
        assert_allclose(middle @ normal, max(normal), atol=1e-12)


def test_tangent_of_a_free_plate_is_the_symmetric_part() -> None:
    """The force is quadratic in x: central differences are exact."""
    body = sheet(1, ancf_plate.surface)
    x = assemble([body]).x0 + 0.1 * np.random.default_rng(1).normal(size=body.reference.size)
    bare, whole = (
        compile_system(assemble([body])),
        compile_system(assemble([body], loads=[PRESSURE])),
    )
    K = as_dense(compiled.tangent(bare, x, np.zeros(0)) - compiled.tangent(whole, x, np.zeros(0)))
    steps = 0.5 * np.eye(len(x))
    slopes = np.stack(
        [force([body], PRESSURE, x + d) - force([body], PRESSURE, x - d) for d in steps], axis=1
    )
    assert_allclose(K, 0.5 * (slopes + slopes.T), atol=1e-8)


def test_a_rigid_rim_carries_its_share() -> None:
    """Functions slaved to a frame: the resultant is that of the whole plate."""
    body = plate("plate", grid(2, 2), 0.05, Material(1e5, 500.0), rims={"rim": Rim(("left",))})
    f = force([body], loads.Pressure("p", "plate", 2.0, follower=True), assemble([body]).x0)
    assert_allclose(body.constant @ f.reshape(-1, 3), [0.0, 0.0, 2.0], atol=1e-12)


def test_a_plate_pulled_on_its_edges() -> None:
    """Edge load q on the deformed length of all edges: N11 = N22 = q, so lambda^2 = 1 + 2 q/(A (1 +
    nu)) exactly.
    """
    body = plate("plate", grid(2, 3), 0.02, Material(1e5, 500.0, 0.3), dim=2)
    mirrors = [
        joints.Edge("x", "plate", ("left",), "x"),
        joints.Edge("y", "plate", ("bottom",), "y"),
    ]
    pull = loads.NormalEdgeLoad("pull", "plate", ("right", "top"), 400.0)
    sensed = {"corner": probes.Position(At("plate", "corner"))}
    found = outputs(
        solve_statics(
            eliminate(assemble([body], mirrors, [pull], outputs=sensed)), 4, Newton(tolerance=1e-12)
        )
    )
    for factor, x, y in zip(
        (0.25, 0.5, 0.75, 1.0), found["corner_x"][1:], found["corner_y"][1:], strict=True
    ):
        stretch = np.sqrt(1.0 + 2.0 * factor * 400.0 * (1.0 - 0.3) / (1e5 * 0.02))
        assert_allclose([x, y], stretch, rtol=1e-11)


def test_load_steps_of_a_plate_without_a_band() -> None:
    """The equilibrium at half the load is that of half the pressure."""
    body = sheet(8)
    both = [
        outputs(solve_statics(held(body, loads.Pressure("p", "plate", p, follower=True)), 2))["w_z"]
        for p in (200.0, 100.0)
    ]
    assert compile_system(held(body, PRESSURE)).pattern is not None
    assert both[0][1] == pytest.approx(both[1][2], rel=1e-8)
    assert both[0][2] > both[0][1] > 0.01


def test_energy_is_kept_under_a_pressure_that_follows() -> None:
    """Kinetic and strain energy less the work on a held plate; the scheme of second order without
    numerical damping.
    """
    system = held(sheet(2), PRESSURE)
    drift = []
    for step in (2e-3, 1e-3):
        found = energies(integrate(system, GeneralizedAlpha(step, 1.0), 0.1))
        assert found[:, 0].max() > 0.1
        drift.append(float(np.abs(found[:, 3] - found[0, 3]).max() / found[:, 0].max()))
    assert drift[1] < 0.02
    assert drift[0] / drift[1] > 3.0


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (40.0, -9.0, 7.0)])
@pytest.mark.parametrize("edges", [("left",), ()])
def test_energies_under_a_pressure_that_follows_a_free_rim(
    origin: tuple[float, ...], edges: tuple[str, ...]
) -> None:
    """The work is that of the force, wherever the plate stands; a free one moves as p A t / m and
    has no strain.
    """
    body = plate(
        "plate",
        grid(2, 2, make=skfem_surface.bfs),
        0.05,
        Material(1e5, 500.0),
        origin=np.array(origin),
    )
    hold = [joints.Edge("hold", "plate", edges, slope="z")] if edges else []
    bare, whole = (eliminate(assemble([body], hold, load)) for load in ([], [PRESSURE]))
    motion = integrate(whole, GeneralizedAlpha(1e-3, 1.0), 0.1)
    kinetic, strain, _, balance = energies(motion).T
    assert np.abs(balance).max() < 1e-3 * kinetic[-1]
    assert strain[-1] == pytest.approx(strain_energy(bare, motion.x[-1]), abs=1e-9)
    if not edges:
        assert_allclose(
            [kinetic[-1], strain[-1]], [(200.0 * 0.1) ** 2 / (2 * 500.0 * 0.05), 0.0], atol=1e-9
        )


def test_reduced_forces_are_the_projected_ones() -> None:
    """In dense coordinates the pressure acts on sampled points."""
    system = held(sheet(2), PRESSURE)
    V = np.linalg.qr(np.random.default_rng(2).normal(size=(system.size, 5)))[0]
    small = change_coordinates(system, V, system.x0)
    z = 0.01 * np.arange(5.0)
    full, reduced = (
        compiled.forces(compile_system(one), at, 0 * at)
        for one, at in ((system, system.x0 + V @ z), (small, z))
    )
    assert_allclose(reduced, V.T @ full, rtol=1e-10)
    check_system(small)


def test_hyper_reduced_motion() -> None:
    """Modes of the full motion carry the reduced one; few cells of the plate and of its load are as
    good as all.
    """
    raw = assemble([sheet(4)], [joints.Edge("hold", "plate", ALL)], [PRESSURE])
    scheme, q0 = GeneralizedAlpha(1e-3), raw.x0
    full = eliminate(raw)
    states = integrate(full, scheme, 0.1).x @ full.lift.matrix.T + full.lift.offset - q0
    V = np.linalg.svd(states.T, full_matrices=False)[0][:, :12]
    small = replace(
        change_coordinates(replace(raw, constraints=Constraints()), V, q0),
        components=(("plate", 0, 12),),
    )
    motion = integrate(small, scheme, 0.1)
    few = sampling.apply(small, sampling.train([(small, motion.x)]))
    for system, limit in ((small, 1e-4), (few, 1e-3)):
        found = integrate(system, scheme, 0.1).x @ V.T
        assert np.linalg.norm(found - states) < limit * np.linalg.norm(states)
    with pytest.raises(InputError, match="follow"):
        follow_path(few)
    kept = sampling.kept(few)
    assert set(kept) == {"plate", "load 'p'"}
    assert max(cells for cells, _ in kept.values()) < 16


def test_what_does_not_know_them_says_so() -> None:
    system = held(sheet(2), PRESSURE)
    with pytest.raises(
        InputError, match="loads that do not follow a surface, got load 'p'; use load steps"
    ):
        follow_path(system)
    body = plate("plate", grid(2, 2), 0.05, Material(1e5, 500.0), dim=2)
    planar = assemble([body], loads=[loads.NormalEdgeLoad("pull", "plate", ALL, 300.0)])
    small = change_coordinates(planar, np.eye(planar.size)[:, :4], planar.x0)
    assert not polynomial.possible(small)
    with pytest.raises(InputError, match="load 'pull'"):
        polynomial.exact(small)
