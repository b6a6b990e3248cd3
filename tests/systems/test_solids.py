"""Solids as bodies of systems: loads on faces, rims and averages, stresses, motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.from_matrices import Coupling, from_matrices, rigidity
from fmbs_skfem.bodies.solids.solid_body import solid_body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.dynamics.compiled_step import large
from fmbs_skfem.dynamics.near_state.linear import linearise
from fmbs_skfem.systems import At, Motion, System, assemble, check_system, compile_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.recovered import RecoveredStress
from fmbs_skfem.systems.measures.stresses import StrainTensor, StressTensor
from fmbs_skfem.systems.system import reads

from ..solids import HEXA, SOFT, TETRA, bar, box, coupling

KINDS = [TETRA, HEXA]
SYMMETRY = [("x", "left"), ("y", "front"), ("z", "bottom")]


def supports(name: str = "bar") -> list[joints.Joint]:
    """Three planes of symmetry."""
    return [joints.HeldFace(axis, name, (face,), axis) for axis, face in SYMMETRY]


def solved(system: System, steps: int = 1) -> dict[str, float]:
    """Outputs under the whole load."""
    found = dynamics.outputs(dynamics.solve_statics(eliminate(system), steps))
    return {name: float(values[-1]) for name, values in found.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_mass_and_inertia_are_those_of_a_box(kind: type) -> None:
    turn = Rotation.from_rotvec([0.2, 0.5, -1.0]).as_matrix()
    origin = np.array([100.0, -20.0, 3.0])
    body = bar(box((4, 2, 1), (1.0, 0.3, 0.2), kind), "left", origin=origin, rotation=turn)
    center, inertia = rigidity(body)
    m = 1000.0 * 0.06
    assert body.total_mass == pytest.approx(m, rel=1e-12)
    assert_allclose(center, origin + turn @ [0.5, 0.15, 0.1], atol=1e-11)
    a, b, c = 1.0, 0.09, 0.04
    wanted = m / 12.0 * np.diag([b + c, a + c, a + b])
    assert_allclose(turn.T @ inertia @ turn, wanted, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_a_traction_makes_the_stress_of_a_bar(kind: type) -> None:
    """sigma_xx = p, e_yy = -nu p / E, and nothing else; lengths change by p L / E."""
    mesh = replace(box((3, 2, 2), kind=kind), sets={"tip": np.array([11])})
    force = loads.SurfaceLoad("pull", "bar", (200.0, 0.0, 0.0), faces=("right",))
    out = {
        "s": StressTensor(At("bar", "tip")),
        "e": StrainTensor(At("bar", "tip")),
        "most": RecoveredStress("bar", "right"),
    }
    found = solved(assemble([bar(mesh)], supports(), [force], outputs=out))
    stress = [found[f"s_{one}"] for one in ("xx", "yy", "zz", "xy", "yz", "zx", "1", "2", "3")]
    assert_allclose(stress, [200.0, 0, 0, 0, 0, 0, 200.0, 0, 0], atol=2e-3)
    assert found["e_yy"] == pytest.approx(-0.3 * 1e-6, rel=1e-5)
    assert_allclose([found["most_von_mises"], found["most_1"]], 200.0, rtol=1e-5)
    assert found["most_3"] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("follower", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_a_pressure_presses(kind: type, follower: bool) -> None:
    mesh = replace(box((2, 2, 2), kind=kind), sets={"tip": np.array([0])})
    faces = ("right", "back", "top")
    load = loads.Pressure("p", "bar", 100.0, faces=faces, follower=follower)
    out = {"s": StressTensor(At("bar", "tip"))}
    found = solved(assemble([bar(mesh)], supports(), [load], outputs=out))
    assert_allclose([found[f"s_{k}"] for k in ("1", "2", "3")], -100.0, rtol=1e-5)


def test_stresses_turn_with_the_mesh_and_know_no_origin() -> None:
    mesh = replace(box((3, 1, 1)), sets={"tip": np.array([5])})
    turn = Rotation.from_rotvec([1.0, 0.4, -0.7]).as_matrix()
    force = np.array([40.0, -3.0, 2.0])

    def answer(turn: np.ndarray, origin: np.ndarray) -> dict[str, float]:
        body = bar(mesh, "left", "right", rotation=turn, origin=origin)
        held = joints.Clamp("hold", At("bar", "left"))
        push = loads.PointForce("push", At("bar", "right"), tuple(turn @ force))
        out = {"s": StressTensor(At("bar", "tip")), "r": probes.Position(At("bar", "right"))}
        return solved(assemble([body], [held], [push], outputs=out))

    here = answer(np.eye(3), np.zeros(3))
    there = answer(turn, np.array([50.0, -70.0, 20.0]))
    for name in here:
        if name.startswith("s_"):
            assert there[name] == pytest.approx(here[name], rel=1e-6, abs=1e-3)
    moved = turn @ [here[f"r_{k}"] for k in "xyz"] + [50.0, -70.0, 20.0]
    assert_allclose([there[f"r_{k}"] for k in "xyz"], moved, atol=1e-9)


def test_its_own_matrices_move_as_it_does_but_for_the_square_of_the_amplitude() -> None:
    mesh = box((4, 1, 1), (1.0, 0.2, 0.2))
    body = bar(mesh, "left", "right")
    whole = bar(mesh)
    K = linearise(assemble([whole], pictures=False)).stiffness
    sets = {"left": coupling(mesh, "left"), "right": coupling(mesh, "right", False)}
    twin = from_matrices("bar", mesh.reference, K, whole.mass, interfaces=sets)
    out = {"r": probes.Position(At("bar", "right"))}
    held = [joints.Clamp("hold", At("bar", "left"))]

    def apart(size: float) -> float:
        push = [loads.PointForce("push", At("bar", "right"), (0.0, 0.3 * size, size))]
        one, two = (solved(assemble([b], held, push, outputs=out)) for b in (body, twin))
        return max(abs(one[k] - two[k]) for k in one)

    small, large = apart(2.0), apart(4.0)
    assert large < 1e-4
    assert 3.5 < large / small < 9.0


def test_a_mean_of_many_nodes_is_three_rows_of_the_interface() -> None:
    """Place and axes of both ends: unknowns of the frames and means, and none of 600 of the faces."""
    body = bar(box((2, 5, 5), kind=HEXA), "", "left right")
    hinge = joints.Revolute("hinge", At("bar", "left"), axis=(0.0, 1.0, 0.0))
    model = compile_system(assemble([body], [hinge]))
    found = large.interface(model, True)
    assert len(found.alone) < 60
    x = np.random.default_rng(0).standard_normal(model.system.size)
    read = sorted(reads(model.system.constraints, len(found.probes)).indices)
    y = model.system.probes.matrix @ x
    assert_allclose((found.probes @ (found.rows @ x))[read], y[read], atol=1e-12)


def flying(step: float, kind: type = TETRA) -> dynamics.Trajectory:
    """A free bar that turns and vibrates."""
    body = bar(box((3, 1, 1), (1.0, 0.2, 0.2), kind), "left")
    start = {"bar": Motion((0.1, 0.2, -0.3), (1.0, 4.0, 2.0), (0.5, 0.1, 0.1))}
    system = assemble([body], [], [], initial=start)
    return dynamics.integrate(system, GeneralizedAlpha(step, 1.0), 0.1)


def test_free_flight_keeps_momentum_and_energy() -> None:
    """Linear momentum to round-off; the energy that a step loses falls with its square."""
    errors = []
    for step in (2e-3, 1e-3):
        motion = flying(step)
        M, unit = motion.system.mass, motion.system.unit
        p = np.stack([np.kron(unit, axis) @ M for axis in np.eye(3)]) @ motion.v.T
        size = 40.0 * np.linalg.norm((0.1, 0.2, -0.3))
        assert np.abs(p - p[:, :1]).max() < 1e-10 * size
        energy = dynamics.energies(motion)[:, :2].sum(axis=1)
        errors.append(np.abs(energy - energy[0]).max())
    assert errors[0] / errors[1] > 3.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_contract_of_systems_holds(kind: type) -> None:
    body = bar(box((2, 1, 1), kind=kind), "left", "right")
    held = [joints.Revolute("hinge", At("bar", "left"), axis=(0.0, 1.0, 0.0))]
    push = [loads.PointForce("push", At("bar", "right"), (1.0, 2.0, 3.0))]
    check_system(assemble([body], held, push))


def test_frequencies_converge_with_the_fourth_power_of_the_cells() -> None:
    """Of the first torsion mode of a free bar of hexahedra, whose solution is smooth, against cells
    half as large.
    """
    found = []
    for n in (1, 2, 4):
        body = bar(box((2 * n, n, n), (0.2, 0.1, 0.1), HEXA))
        modes = dynamics.vibration_modes(assemble([body], pictures=False), 7)
        found.append(float(modes.squares[6]))
    first, second = found[0] - found[1], found[1] - found[2]
    assert 3.2 < np.log2(first / second) < 5.0


def hinged(body: Body) -> System:
    return assemble([body], [joints.Clamp("hold", At("bar", "left"))])


@pytest.mark.parametrize(
    "rims, text",
    [
        ({"a": ("left", True), "b": ("bottom", True)}, "nodes of one rigid interface each"),
        ({"a": ((0, 1), True)}, "three or more nodes that are not on a line"),
    ],
)
def test_rims_that_cannot_be(rims: dict[str, tuple[object, bool]], text: str) -> None:
    mesh = box((2, 1, 1), order=1)
    found = {
        key: coupling(mesh, name, rigid) if isinstance(name, str) else Coupling(name)  # type: ignore[arg-type]
        for key, (name, rigid) in rims.items()
    }
    with pytest.raises(InputError, match=text):
        solid_body("bar", mesh, SOFT, rims=found)


def test_a_rim_of_three_nodes_holds() -> None:
    mesh = box((2, 1, 1), order=1)
    ends = np.flatnonzero(mesh.reference[:, 0] == 0.0)[:3]
    body = solid_body("bar", mesh, SOFT, rims={"left": Coupling(tuple(ends.tolist()))})
    modes = dynamics.vibration_modes(eliminate(hinged(body)), 3)
    assert modes.squares.min() > 0.0


def test_nearly_incompressible_is_told() -> None:
    with pytest.warns(Notice, match=r"Poisson's ratio 0.4999 lies above 0.49"):
        bar(box((2, 1, 1)), material=Material(1e6, 1000.0, 0.4999))


@pytest.mark.parametrize("nu", [0.3, 0.49])
@pytest.mark.parametrize("kind", KINDS)
def test_bending_beside_a_beam(kind: type, nu: float) -> None:
    """F L^3 / (3 E I) + F L / (k G A) within 1 %, two cells over the height, held so that it may
    contract.
    """
    mesh = box((10, 2, 2), kind=kind)
    middle = (mesh.reference[:, 0] == 0.0) & (np.abs(mesh.reference[:, 2] - 0.05) < 1e-9)
    center = middle & (np.abs(mesh.reference[:, 1] - 0.05) < 1e-9)
    sets = {"middle": np.flatnonzero(middle), "center": np.flatnonzero(center)}
    body = bar(replace(mesh, sets=sets), "", "right", Material(200e6, 1000.0, nu))
    held = [
        joints.HeldFace("x", "bar", ("left",), "x"),
        joints.HeldFace("z", "bar", ("middle",), "z"),
        joints.HeldFace("y", "bar", ("center",), "y"),
    ]
    out = {"r": probes.Position(At("bar", "right"))}
    push = [loads.PointForce("push", At("bar", "right"), (0.0, 0.0, 1e-2))]
    deflection = solved(assemble([body], held, push, outputs=out))["r_z"] - 0.05
    G = 200e6 / (2.0 * (1.0 + nu))
    wanted = 1e-2 / (3 * 200e6 * 0.1**4 / 12) + 1e-2 / (5 / 6 * G * 0.01)
    assert deflection == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("rigid", [True, False])
def test_a_moment_bends_an_end(rigid: bool) -> None:
    """M L^2 / (2 E I) within 1.5 %: clamped ends do not contract."""
    body = bar(box((10, 2, 2)), *(("left right", "") if rigid else ("left", "right")))
    held = [joints.Clamp("hold", At("bar", "left"))]
    twist = loads.Torque("push", At("bar", "right"), (0.0, 1e-2, 0.0))
    out = {"r": probes.Position(At("bar", "right"))}
    found = solved(assemble([body], held, [twist], outputs=out))
    wanted = -1e-2 / (2 * 200e6 * 0.1**4 / 12)
    assert found["r_z"] - 0.05 == pytest.approx(wanted, rel=0.015)
