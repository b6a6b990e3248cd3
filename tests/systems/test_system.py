"""Systems keep their contract in every form; eliminations and changes of coordinates transform them
exactly.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import block_diag
from scipy.sparse import csr_array, random_array

from fmbs_skfem.bodies import Body, Cells, Law, body, point_mass
from fmbs_skfem.bodies.laws import CABLES
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    change_coordinates,
    check_system,
    compile_system,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import multiply_out
from fmbs_skfem.systems.terms.points import Sampled

from .. import models
from .parts import A0, A1, B0, B1, BOB, C0, C1, beams, every_load

TIME = 0.37


def everything(dim: int, **options: Any) -> System:
    """A frame of three beams and a mass with linear, quadratic and driven joints, every load,
    damping and outputs.
    """
    held: list[joints.Joint] = [
        joints.Pin("pin", A0),
        joints.Weld("weld", A1, B0),
        joints.Pin("branch", A1, C0),
        joints.RigidLink("link", C1, BOB),
        joints.DrivenPosition("drive", B1, (np.sin, *(lambda t: 0.0 * t,) * (dim - 1))),
    ]
    damping = Rayleigh(mass=0.3, stiffness=2e-3)
    return assemble(
        beams(dim, **options), held, every_load(dim, np.cos), damping, {"tip": probes.Position(C1)}
    )


def energy(system: System, x: np.ndarray) -> float:
    return compiled.strain_energy(compile_system(system), x)


def forces(system: System, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    return compiled.forces(compile_system(system), x, v, TIME)


@pytest.mark.parametrize(
    "space", [{"ancf": True}, {"degree": 2}, {"degree": 3}, {"degree": 4, "continuity": 3}]
)
@pytest.mark.parametrize("law", CABLES)
@pytest.mark.parametrize("dim", [2, 3])
def test_contract(dim: int, law: Law, space: dict[str, Any]) -> None:
    check_system(everything(dim, law=law, **space))


@pytest.mark.parametrize("cells", [1, 30])
@pytest.mark.parametrize("dim", [2, 3])
def test_contract_in_dense_and_banded_storage(dim: int, cells: int) -> None:
    system = everything(dim, cells=cells)
    assert compile_system(system).arrays.dense == (cells == 1)
    check_system(system)
    check_system(eliminate(system))


def indefinite(system: System) -> System:
    return replace(system, mass=system.mass - 0.02 * csr_array(np.eye(system.size)))


def crooked(system: System) -> System:
    mass = system.mass.tolil()
    mass[0, 5] += 1e-3
    return replace(system, mass=csr_array(mass))


def driven(system: System) -> System:
    undamped = tuple(replace(part, beta=0.0) for part in system.elastic)
    return replace(system, damping=-system.damping, elastic=undamped)


def one_sided(system: System) -> System:
    """A spring that pulls x_0 when x_5 moves, and not the other way round: no energy has such
    forces.
    """
    return replace(system, stiffness=csr_array(([10.0], ([0], [5])), shape=system.mass.shape))


@pytest.mark.parametrize(
    "spoil, found",
    [
        (crooked, "symmetry of the mass"),
        (indefinite, "positive mass"),
        (one_sided, "elastic forces against the strain energy"),
        (driven, "damping takes energy out"),
    ],
)
def test_faults_of_a_system_are_named(spoil: Callable[[System], System], found: str) -> None:
    with pytest.raises(InputError, match=f"check_system: {found}"):
        check_system(spoil(everything(2, cells=2)))


@pytest.mark.parametrize("part", ["the elastic forces", "loads and joints"])
def test_faults_of_the_tangent_are_named(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tangent of one part that is wrong by 1e-5, and exact for all others."""
    exact = compiled.tangent

    def tangent(model: compiled.Compiled, *state: Any, **more: Any) -> csr_array:
        mine = bool(model.system.elastic) == (part == "the elastic forces")
        return (1.0 + 1e-5 * mine) * exact(model, *state, **more)

    monkeypatch.setattr(compiled, "tangent", tangent)
    with pytest.raises(InputError, match=f"check_system: tangent of {part}"):
        check_system(everything(2, cells=2))


def test_the_order_of_the_band_does_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same forces, gap and tangent from banded storage in another order as from dense storage."""
    ring = [joints.RigidLink("link", A0, C1)]
    system, rng = (
        assemble(beams(3, cells=20), ring, every_load(3), Rayleigh(0.1, 1e-3)),
        np.random.default_rng(4),
    )
    banded = compile_system(system)
    monkeypatch.setattr("fmbs_skfem.systems.layouts.DENSE", 10**6)
    dense = compile_system(system)
    assert dense.arrays.dense
    assert not banded.arrays.dense
    assert np.any(banded.order != np.arange(system.size))
    x, v = system.x0 + 1e-3 * rng.normal(size=system.size), rng.normal(size=system.size)
    multipliers = rng.normal(size=banded.constraints)
    f = compiled.forces(dense, x, v, TIME)
    assert_allclose(compiled.forces(banded, x, v, TIME), f, atol=1e-12 * np.abs(f).max())
    for one, other in zip(compiled.gap(banded, x, TIME), compiled.gap(dense, x, TIME), strict=True):
        assert_allclose(one, other, atol=1e-13)
    K = compiled.tangent(dense, x, multipliers, TIME, 5.0)
    assert abs(compiled.tangent(banded, x, multipliers, TIME, 5.0) - K).max() < 1e-12 * abs(K).max()


def transformed(system: System, V: Any, d: np.ndarray, seed: int = 0) -> System:
    """System in z, x = V z + d, compared with the original, also with its cells multiplied out."""
    new = change_coordinates(system, V, d)
    compare(system, new, V, d, seed)
    compare(system, multiply_out(new), V, d, seed)
    return new


def compare(system: System, new: System, V: Any, d: np.ndarray, seed: int) -> None:
    """Forces, gap, tangent, energy, mass, sensors of a system in z, x = V z + d, and of the
    original.
    """
    rng = np.random.default_rng(seed)
    z, w = new.x0 + 1e-3 * rng.normal(size=new.size), rng.normal(size=new.size)
    x, v, multipliers = V @ z + d, V @ w, rng.normal(size=len(system.constraints.names))
    dense = as_dense(V)
    f = dense.T @ forces(system, x, v)
    assert_allclose(forces(new, z, w), f, atol=1e-11 * np.abs(f).max())
    assert energy(new, z) == pytest.approx(energy(system, x), rel=1e-10)
    old, model = compile_system(system), compile_system(new)
    (phi, J), (gap, slope) = compiled.gap(old, x, TIME), compiled.gap(model, z, TIME)
    assert_allclose(gap, phi, atol=1e-12)
    assert_allclose(slope, J @ dense, atol=1e-12)
    K = dense.T @ (compiled.tangent(old, x, multipliers, TIME, 5.0) @ dense)
    assert_allclose(
        compiled.tangent(model, z, multipliers, TIME, 5.0).toarray(),
        K,
        atol=1e-11 * np.abs(K).max(),
    )
    M = dense.T @ (system.mass @ dense)
    assert_allclose(as_dense(new.mass), M, atol=1e-14)
    assert_allclose(new.sensors(z), system.sensors(x), atol=1e-12)
    assert_allclose(new.lift(z), system.lift(x), atol=1e-12)


def basis(system: System, r: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A random orthonormal basis (n, r), and d such that the initial state lies in x = V z + d."""
    V = np.linalg.qr(np.random.default_rng(seed).normal(size=(system.size, r)))[0]
    return V, system.x0 - V @ (V.T @ system.x0)


def sparse_map(n: int, r: int, seed: int = 1) -> csr_array:
    """A sparse array (n, r) of full rank with several entries in a row."""
    rng = np.random.default_rng(seed)
    return csr_array(random_array((n, r), density=0.05, rng=rng) + csr_array(np.eye(n, r)))


@pytest.mark.parametrize("dim", [2, 3])
def test_dense_change_of_coordinates(dim: int) -> None:
    system = everything(dim)
    new = transformed(system, *basis(system, 17))
    assert all(isinstance(part.gather, Cells) for part in new.elastic)
    assert all(isinstance(part.gather, Sampled) for part in multiply_out(new).elastic)
    check_system(new)
    check_system(multiply_out(new))


@pytest.mark.parametrize("dim", [2, 3])
def test_sparse_change_of_coordinates(dim: int) -> None:
    system = everything(dim)
    new = transformed(
        system,
        sparse_map(system.size, system.size - 9),
        1e-2 * np.random.default_rng(8).normal(size=system.size),
    )
    assert new.elastic is system.elastic or not any(
        isinstance(part.gather, Sampled) for part in new.elastic
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_full_orthogonal_basis_keeps_everything(dim: int) -> None:
    """V (n, n): norms of forces and the initial energy are those of the original."""
    system = everything(dim)
    V, d = basis(system, system.size)
    new = transformed(system, V, d)
    assert_allclose(V @ new.x0 + d, system.x0, atol=1e-12)
    assert np.linalg.norm(forces(new, new.x0, new.v0)) == pytest.approx(
        np.linalg.norm(forces(system, system.x0, system.v0))
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_changes_of_coordinates_follow_each_other(dim: int) -> None:
    """Sparse then dense, dense then sparse, dense then dense: the last two act on a lift, or on
    points, that are dense already.
    """
    system = everything(dim)
    sparse, shift = (
        sparse_map(system.size, system.size - 9),
        1e-2 * np.random.default_rng(8).normal(size=system.size),
    )
    first = change_coordinates(system, sparse, shift)
    transformed(first, *basis(first, 15))
    V, d = basis(system, 19)
    reduced = change_coordinates(system, V, d)
    for known in (reduced, multiply_out(reduced)):
        transformed(known, sparse_map(19, 16), np.zeros(19))
        transformed(known, *basis(known, 12, seed=5))


def test_components_touch_only_their_own_columns() -> None:
    """A block-diagonal basis: every body's gradients hold the columns of its own block."""
    system = assemble(beams(3), [joints.Weld("weld", A1, B0)])
    rng, sizes = np.random.default_rng(3), [last - first for _, first, last in system.coordinates]
    V = block_diag(*(np.linalg.qr(rng.normal(size=(size, min(size, 4))))[0] for size in sizes))
    new = multiply_out(transformed(system, V, system.x0))
    assert [
        (part.gather.columns.start, part.gather.columns.stop)
        for part in new.elastic
        if isinstance(part.gather, Sampled)
    ] == [
        (0, 4),
        (4, 8),
        (8, 12),
    ]


@pytest.mark.parametrize("dim", [2, 3])
def test_elimination_solves_the_linear_constraints(dim: int) -> None:
    """x = T y + d satisfies every linear row for every y; T^T (f + Phi_x^T lambda) needs no
    multiplier of theirs.
    """
    system = everything(dim)
    new = eliminate(system)
    linear = 3 * dim + dim
    assert len(system.constraints.names) - len(new.constraints.names) == linear
    assert new.size == system.size - linear
    assert {joint for joint, _ in new.constraints.names} == {"link", "drive"}
    assert new.full is system
    assert_allclose(new.lift(new.x0), system.x0, atol=1e-13)
    rng = np.random.default_rng(6)
    y, w = new.x0 + 1e-2 * rng.normal(size=new.size), rng.normal(size=new.size)
    x, v = new.lift(y), new.lift.matrix @ w
    phi, J = compiled.gap(compile_system(system), x, TIME)
    rest, slope = compiled.gap(compile_system(new), y, TIME)
    kept = [system.constraints.names.index(name) for name in new.constraints.names]
    assert_allclose(np.delete(phi, kept), 0.0, atol=1e-14)
    assert_allclose(phi[kept], rest, atol=1e-13)
    multipliers = rng.normal(size=len(phi))
    total = new.lift.matrix.T @ (forces(system, x, v) + J.T @ multipliers)
    assert_allclose(
        forces(new, y, w) + slope.T @ multipliers[kept], total, atol=1e-11 * np.abs(total).max()
    )


def test_elimination_without_linear_joints_keeps_the_system() -> None:
    system = assemble(beams(2), [joints.RigidLink("link", A0, C1)])
    new = eliminate(system)
    assert new.lift is system.lift
    assert new.constraints is system.constraints


def test_mass_of_a_system_is_that_of_its_bodies() -> None:
    """Three beams of 1 m and 0.5 kg/m and a point mass of 0.7 kg move as one: T = 2.2 kg |v|^2 / 2."""
    system = assemble(
        beams(3), initial={part.name: Motion(velocity=(1.0, 2.0, -2.0)) for part in beams(3)}
    )
    assert 0.5 * system.v0 @ (system.mass @ system.v0) == pytest.approx(0.5 * 2.2 * 9.0, rel=1e-12)
    assert_allclose((system.mass @ system.v0)[-3:], 0.7 * np.array([1.0, 2.0, -2.0]))


@pytest.mark.parametrize("dim", [2, 3])
def test_initial_motion_is_a_rigid_velocity_field(dim: int) -> None:
    """v = v0 + omega x r at every point of the bodies that move, zero elsewhere."""
    velocity, omega = np.array([1.0, 2.0, 3.0])[:dim], np.array([0.3, -0.4, 2.0])
    motion = Motion(tuple(velocity), 2.0 if dim == 2 else tuple(omega))
    seen = {
        name: probes.Position(at)
        for name, at in (("tip", C1), ("inside", At("c", 0.3)), ("mass", BOB), ("rest", A1))
    }
    system = assemble(beams(dim), outputs=seen, initial={"c": motion, "bob": motion})
    v, r = (
        values.reshape(4, dim)
        for values in (system.sensors.matrix @ system.v0, system.sensors(system.x0))
    )
    spin = np.array([[0.0, -2.0], [2.0, 0.0]]) if dim == 2 else np.cross(omega, np.eye(3)).T
    assert_allclose(v[:3], velocity + r[:3] @ spin.T, atol=1e-13)
    assert_allclose(v[3], 0.0)


def test_outputs_read_the_reference() -> None:
    """Columns and sensor rows: positions, slopes of unit length."""
    wanted = {
        "B": probes.Position(C1),
        "s": probes.Slope(C1),
        "v": probes.Velocity(BOB),
        "E": probes.Energy(),
    }
    system = assemble(
        beams(3), [joints.Pin("hinge", A0)], outputs={**wanted, "R": probes.Reaction("hinge")}
    )
    y = system.sensors(system.x0)
    assert system.outputs["B"].columns == ("B_x", "B_y", "B_z")
    assert system.outputs["R"].columns == ("R_x", "R_y", "R_z")
    assert system.outputs["E"].columns == ("E_kinetic", "E_strain", "E_potential", "E_balance")
    assert_allclose(y[list(system.outputs["B"].rows)], [1.8, 0.6, 0.0], atol=1e-14)
    assert_allclose(y[list(system.outputs["s"].rows)], [0.8, 0.6, 0.0], atol=1e-14)


def first(dim: int) -> Body:
    return beams(dim)[0]


@pytest.mark.parametrize(
    "make, named",
    [
        (lambda: assemble([]), "bodies: expected at least one body, got none"),
        (
            lambda: assemble([first(2), first(2)]),
            "bodies: expected different names, got 'a' more than once",
        ),
        (
            lambda: assemble([first(2), point_mass("bob", 1.0, np.zeros(3))]),
            r"bodies: expected one dimension for all, got \[2, 3\]",
        ),
        (
            lambda: assemble([first(2)], [joints.Pin("p", A0), joints.Pin("p", A1)]),
            "joints: expected different names, got 'p'",
        ),
        (
            lambda: assemble([first(2)], [joints.Pin("p", C0)]),
            "joint 'p': expected one of the bodies a, got 'c'",
        ),
        (
            lambda: assemble([first(2)], loads=[loads.PointForce("f", C0, (0, 1))]),
            "load 'f': expected one of the bodies a, got 'c'",
        ),
        (
            lambda: assemble([first(2)], outputs={"y": probes.Position(C0)}),
            "output 'y': expected one of the bodies a, got 'c'",
        ),
        (
            lambda: assemble(
                [first(2)], [joints.Pin("hinge", A0)], outputs={"R": probes.Reaction("hing")}
            ),
            "output 'R': expected one of the joints hinge, got 'hing'; did you mean 'hinge'",
        ),
        (
            lambda: assemble([first(2)], outputs={"y": "position"}),
            "output 'y': expected a probe, got str",
        ),
        (
            lambda: assemble([first(2)], initial={"b": Motion()}),
            "initial: expected one of the bodies a, got 'b'",
        ),
        (
            lambda: assemble([first(3)], initial={"a": Motion((1.0, 2.0))}),
            "initial 'a': expected 3 finite numbers",
        ),
        (
            lambda: assemble(beams(2), damping={"mass": 0.1}),  # type: ignore[arg-type]
            r"damping: expected a Rayleigh of systems, got a mapping; write systems.Rayleigh\(mass=...\)",
        ),
        (
            lambda: assemble(beams(2), initial={"a": (1.0, 0.0)}),  # type: ignore[dict-item]
            r"initial 'a': expected a Motion of systems, got a list of 2; write systems.Motion\(velocity=..., angular_velocity",
        ),
        (lambda: Rayleigh(mass=-1.0), "damping: expected non-negative factors"),
        (lambda: Rayleigh(stiffness=float("nan")), "damping: expected non-negative factors"),
    ],
)
def test_wrong_systems_are_named(make: Callable[[], object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        make()


def test_lines_of_pictures_are_made_when_they_are_read_and_go_with_copies() -> None:
    """Runs draw nothing: samples of centre lines are made for those who look, once for all of them."""
    known = models.double_pendulum(5)
    line, again = known.lines[0], pickle.loads(pickle.dumps(known.lines[0]))
    assert "make" not in line.__dict__
    fresh = models.double_pendulum(5).lines[0]
    assert "samples" not in fresh.__dict__
    assert fresh.samples is fresh.samples
    assert_array_equal(fresh.samples.toarray(), again.samples.toarray())
    with pytest.raises(AttributeError, match="no attribute 'sample'"):
        fresh.sample  # noqa: B018


def test_cells_in_other_coordinates_share_what_is_made_later() -> None:
    part = body.cable("beam", segment(4), models.SECTION, models.MATERIAL, dim=2)
    assert part.cells is not None
    first, second = part.cells.moved(3), part.cells.moved(8)
    assert first.table is second.table
    assert part.cells.section is first.section
