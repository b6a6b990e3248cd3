"""From trajectories to frames: fields of cables and plates, points, joints."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, systems
from fmbs_skfem.bodies import plate, rigid, sections
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory
from fmbs_skfem.dynamics.outputs import distances
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.spaces import component, galerkin, pod
from fmbs_skfem.results import frames
from fmbs_skfem.results import motion as drawn
from fmbs_skfem.results.marks import MARKERS
from fmbs_skfem.results.rendering import drawing
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import ancf_plate
from fmbs_skfem.systems import At
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from ..cli.calls import EXAMPLES
from ..models import cantilever, spin_up


def test_fields_of_a_stretched_beam_and_of_an_arc() -> None:
    """A stretch of 1 + e has the strain ((1 + e)^2 - 1) / 2, an arc of radius R the curvature 1 /
    R; a beam at rest has none.
    """
    system = cantilever(cells=20, dim=3)
    motion = dynamics.integrate(systems.eliminate(system), GeneralizedAlpha(1e-3), 2e-3)
    start = drawn.frames(motion).bodies["beam"]
    assert start.points.shape == (3, 201, 3)
    assert np.abs(start.fields["strain"]).max() < 1e-10
    assert np.abs(start.fields["velocity"]).max() < 1e-8
    gradients = np.zeros((1, 3, 201, 2))
    angle = np.linspace(0, 1, 201) / 0.5
    gradients[0, 0] = 0.5 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    gradients[0, 1] = 1.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    gradients[0, 2] = 1.21 / 0.5 * np.column_stack([-np.sin(angle), np.cos(angle)])
    arc = drawn.lines(gradients, gradients, gradients, 0.01)
    assert arc.fields["curvature"] == pytest.approx(np.full((1, 201), 2.0), rel=1e-12)
    assert arc.fields["strain"] == pytest.approx(np.full((1, 201), 0.5 * (1.21 - 1)), rel=1e-12)
    assert np.all(arc.points[..., 2] == 0)


@pytest.mark.parametrize("dim", [2, 3])
def test_loads_gravity_and_axes_are_arrows_that_turn_with_what_carries_them(dim: int) -> None:
    """Bodies turned by 90 degrees about z: the follower and the axis of the hinge turn with them,
    force and gravity do not.
    """
    one, two = (
        rigid.rigid(name, 1.0, 0.1 if dim == 2 else np.eye(3), np.zeros(dim), dim=dim)
        for name in ("one", "two")
    )
    x, y, z = np.eye(3)
    loaded = [
        loads.Gravity(tuple(-9.81 * y[:dim])),
        loads.PointForce("push", At("one", "frame"), tuple(2.0 * x[:dim])),
        loads.Follower("jet", At("one", "frame"), tuple(-3.0 * x[:dim])),
        loads.Torque("turn", At("one", "frame"), -5.0 if dim == 2 else tuple(-5.0 * z)),
    ]
    hinge = joints.Revolute(
        "hinge", At("two", "frame"), At("one", "frame"), axis=None if dim == 2 else tuple(x)
    )
    system = systems.assemble([one, two], [hinge], loaded)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]
    states = np.stack([system.x0, (system.x0.reshape(-1, dim) @ turn.T).ravel()])
    none = np.zeros((2, 0))
    marks = drawn.frames(
        Trajectory(system, np.array([0.0, 1.0]), states, 0 * states, 0 * states, none)
    ).marks.values()
    found: dict[str, list[np.ndarray]] = {}
    for arrow in (mark for mark in marks if not mark.is_joint):
        unit = arrow.directions / np.linalg.norm(arrow.directions, axis=1)[:, None]
        found.setdefault(arrow.kind, []).append(unit)
        assert arrow.points.shape == ((2, 0) if arrow.kind == "gravity" else (2, 3))
    assert found.keys() == {"gravity", "force", "moment"} | ({"joint axis"} if dim == 3 else set())
    np.testing.assert_allclose(found["gravity"], [[-y, -y]], atol=1e-14)
    np.testing.assert_allclose(found["force"], [[x, x], [-x, -y]], atol=1e-14)
    np.testing.assert_allclose(found["moment"], [[-z, -z]], atol=1e-14)
    np.testing.assert_allclose(found.get("joint axis", [[x, y]]), [[x, y]], atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_section_forces_of_a_cantilever_are_those_of_equilibrium(dim: int, tmp_path: Path) -> None:
    """P at the tip far within small displacements: M = P (L - x), also in the reduced and the saved
    form; N = F along the beam.
    """
    P, F = 1e-5, 1e-3
    force = np.array([0.0, P, 0.0][:dim])
    raw = cantilever(
        20, lambda tip: [loads.PointForce("tip", tip, tuple(force))], dim=dim, all_multipliers=True
    )
    found = dynamics.solve_statics(systems.eliminate(raw), 4)
    level = component.body_level(raw)
    data = galerkin.snapshots(found)
    reduced = galerkin.reduce_system(
        raw, level, {"beam": pod.basis(data.q.T, 1e-14, keep=data.q[0])}
    )
    saved = files.load(files.save(reduced, tmp_path / "model.h5"))
    for motion in (found, dynamics.solve_statics(reduced, 4), dynamics.solve_statics(saved, 4)):
        body = drawn.frames(motion).bodies["beam"]
        exact = P * (1.0 - body.reference[:, 0])
        assert body.fields["bending_moment"][-1] == pytest.approx(exact, abs=5e-3 * P)
    pulled = cantilever(
        20, lambda tip: [loads.PointForce("tip", tip, (F, *[0.0] * (dim - 1)))], dim=dim
    )
    body = drawn.frames(dynamics.solve_statics(pulled, 2)).bodies["beam"]
    assert body.fields["axial_force"][-1] == pytest.approx(
        np.full(len(body.reference), F), rel=1e-4
    )


def test_displacements_are_magnified_from_the_reference() -> None:
    """Ten times the deflection of a bent cantilever, its clamp in place, the arrow at its tip."""
    system = cantilever(4, lambda tip: [loads.PointForce("tip", tip, (0.0, 0.1))])
    motion = drawn.frames(dynamics.solve_statics(system, 2))
    large = frames.magnify(motion, motion, 10.0)
    moved, ten = (frames.displacement(one.bodies["beam"])[-1] for one in (motion, large))
    assert np.abs(moved).max() > 1e-2
    np.testing.assert_allclose(ten, 10.0 * moved, atol=1e-14)
    (arrow,) = (mark for mark in large.marks.values() if not mark.is_joint)
    np.testing.assert_allclose(arrow.points[-1], large.bodies["beam"].points[-1, -1], atol=1e-12)
    assert np.ptp(large.marks["clamp"].points, axis=0).max() < 1e-12


def plate_motion(dim: int, states: np.ndarray, rates: np.ndarray) -> Trajectory:
    """A steel plate of 2 m x 1 m x 1 cm and 4 x 2 cells, whose reference is moved by the linear
    maps `states` (s, c, c).
    """
    x, y = np.meshgrid(np.linspace(0, 2, 5), np.linspace(0, 1, 3), indexing="ij")
    number = np.arange(15).reshape(5, 3)
    quads = np.stack(
        [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1
    ).reshape(-1, 4)
    shape = ancf_plate.surface(np.column_stack([x.ravel(), y.ravel()]), quads)
    system = systems.assemble(
        [plate.plate("plate", shape, 0.01, sections.Material(*STEEL), dim=dim)]
    )
    reference = system.x0.reshape(-1, dim)
    moved, moving = (
        np.stack([reference @ A.T for A in part]).reshape(len(part), -1) for part in (states, rates)
    )
    times = np.arange(len(moved), dtype=float)
    return Trajectory(system, times, moved, moving, 0 * moved, np.zeros((len(moved), 0)))


STEEL = (200e9, 7800.0, 0.3)  #: E [Pa], rho [kg/m3], nu


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_of_a_stretched_plate(dim: int) -> None:
    """r = F r0 with F = diag(1 + e, 1): E11 = e + e^2/2, S11 = E E11 / (1 - nu^2), S22 = nu S11,
    turned by 30 degrees at t = 1.
    """
    e, nu = 1e-3, 0.3
    stretch = np.diag([1 + e, 1.0, 1.0])[:dim, :dim]
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]]
    motion = plate_motion(
        dim,
        np.stack([stretch, turn[:dim, :dim] @ stretch]),
        np.stack([0 * stretch, 3.0 * np.eye(dim)]),
    )
    body = drawn.frames(motion).bodies["plate"]
    assert body.is_surface
    green = e + e**2 / 2
    stress = 200e9 * green / (1 - nu**2) * np.sqrt(1 - nu + nu**2)
    assert body.points.shape == (2, 8 * 9, 3)
    assert body.fields["strain"] == pytest.approx(np.full((2, 72), green), rel=1e-9)
    assert body.fields["membrane_strain"][1] == pytest.approx(
        np.tile([green, 0, 0], (72, 1)), abs=1e-12
    )
    for name in ("von_mises", "von_mises_top", "von_mises_bottom"):
        assert body.fields[name] == pytest.approx(np.full((2, 72), stress), rel=1e-7), name
    S11 = 200e9 * green / (1 - nu**2)
    for face in ("top", "bottom"):
        assert body.fields[f"stress_{face}"][1] == pytest.approx(
            np.tile([S11, nu * S11, 0.0], (72, 1)), rel=1e-7, abs=1.0
        )
        assert body.fields[f"principal_{face}"][1] == pytest.approx(
            np.tile([S11, nu * S11, 0.0], (72, 1)), rel=1e-7, abs=1.0
        )
    assert body.fields["membrane_forces"][1] == pytest.approx(
        np.tile([0.01 * S11, 0.01 * nu * S11, 0.0], (72, 1)), rel=1e-7, abs=1.0
    )
    assert np.abs(body.fields["bending_moments"]).max() < 1e-4 * 0.01**2 * S11
    assert body.fields["axis_1"][1] == pytest.approx(np.tile(turn[:, 0], (72, 1)), abs=1e-9)
    assert body.fields["axis_2"][1] == pytest.approx(np.tile(turn[:, 1], (72, 1)), abs=1e-9)
    assert np.abs(body.fields["curvature"]).max() < 1e-9
    assert body.fields["velocity"][1] == pytest.approx(3.0 * body.reference, abs=1e-12)
    assert body.reference[:, 0].max() == pytest.approx(2.0)
    assert np.all(body.size == 0.01)
    assert drawn.usual_color(motion.system) == "von_mises"


def test_only_wanted_fields_are_kept_and_instants_come_one_by_one() -> None:
    motion = plate_motion(
        3, np.stack([(1 + 0.1 * s) * np.eye(3) for s in range(3)]), np.zeros((3, 3, 3))
    )
    some = drawn.frames(motion, np.array([0, 2]), ("von_mises",))
    assert list(some.bodies["plate"].fields) == ["von_mises"]
    assert [piece.times.tolist() for piece in drawn.pieces(motion, np.array([0, 2]))] == [
        [0.0],
        [2.0],
    ]
    whole = drawn.frames(motion).bodies["plate"]
    assert np.array_equal(
        whole.points[[2]], next(drawn.pieces(motion, np.array([2]))).bodies["plate"].points
    )


def test_distance_of_two_motions_of_a_plate() -> None:
    """A plate 0.1 % larger is farthest away at its corner, 1e-3 sqrt(5) m."""
    one, other = (
        plate_motion(2, (1 + e) * np.stack([np.eye(2)] * 2), np.zeros((2, 2, 2)))
        for e in (0.0, 1e-3)
    )
    found = drawn.errors(one, other, [1.0]).bodies["plate"].fields["error"]
    assert found.max() == pytest.approx(1e-3 * np.sqrt(5), rel=1e-9)
    assert distances(one.system, one.x, other.system, other.x) == pytest.approx(
        [1e-3 * np.sqrt(5)] * 2, rel=1e-9
    )


def test_points_follow_the_outputs_of_a_planar_system() -> None:
    motion = dynamics.integrate(spin_up(cells=10), GeneralizedAlpha(1e-3), 0.05)
    found, outputs = drawn.frames(motion), dynamics.outputs(motion)
    tip = found.bodies["beam"].points[:, -1]
    assert tip[:, 0] == pytest.approx(outputs["tip_x"], abs=1e-12)
    assert tip[:, 1] == pytest.approx(outputs["tip_y"], abs=1e-12)
    rate = np.gradient(tip[:, 1], found.times)
    assert found.bodies["beam"].fields["velocity"][1:-1, -1, 1] == pytest.approx(
        rate[1:-1], abs=1e-4
    )
    assert found.marks["hinge"].kind == "revolute joint"
    assert found.marks["drive"].kind == "driven angle"
    assert drawn.frames(motion, frames.spread(motion.times, 3)).times == pytest.approx(
        [0, 0.025, 0.05]
    )


def test_masses_and_driven_supports_are_told_apart() -> None:
    system = systems.eliminate(build.system(scenes.read(EXAMPLES / "hanging_mass.yaml")))
    found = drawn.frames(dynamics.integrate(system, GeneralizedAlpha(1e-3), 2e-3))
    kinds = {name: mark.kind for name, mark in found.marks.items() if mark.is_joint}
    assert kinds == {
        "left": "driven position",
        "right": "spherical joint",
        "hook": "spherical joint",
        "mass": "point mass",
    }
    assert found.marks["mass"].points[0] == pytest.approx([1, 0, 0])


def test_every_joint_has_its_own_name_in_pictures() -> None:
    """Two rigid bodies with one joint of every kind: what the key calls it."""
    text = """
schema: 1
bodies:
  a: &body {type: rigid, mass: 1 kg, inertia: [1, 1, 1], center: [0, 0, 0]}
  b: *body
joints:
  clamp: {type: clamp, at: a.frame}
  weld: {type: weld, at: b.frame, to: a.frame}
  revolute-joint: {type: revolute, at: b.frame, to: a.frame, axis: [0, 0, 1]}
  spherical-joint: {type: spherical, at: b.frame, to: a.frame}
  universal-joint: {type: universal, at: b.frame, to: a.frame, axis: [1, 0, 0], axis_to: [0, 1, 0]}
  prismatic-joint: {type: prismatic, at: b.frame, to: a.frame, direction: [1, 0, 0]}
  cylindrical-joint: {type: cylindrical, at: b.frame, to: a.frame, axis: [1, 0, 0]}
  slider: {type: slider, at: b.frame, to: a.frame, direction: [1, 0, 0]}
  latch: {type: latch, at: b.frame, to: a.frame}
loads: {bushing: {type: bushing, at: b.frame, to: a.frame, stiffness: [1 N/m, 0, 0]}}
analysis: {type: static}
"""
    system = build.system(scenes.loads(text))
    kinds = {
        name: drawn.shown(system, name, kind)
        for name, kind, _ in system.markers
        if kind not in ("axis", "line")
    }
    assert kinds == {name: name.replace("-", " ") for name in kinds}
    assert len(kinds) == 10


def test_no_two_kinds_of_joints_look_alike() -> None:
    """In the key by marker or by colours that differ by a fifth of their range, in the scene by
    shape, size or colour.
    """
    joints = [symbol for symbol in MARKERS.values() if symbol.sizes]
    assert len(joints) == 17
    tints = [np.array([int(symbol.colour[i : i + 2], 16) for i in (1, 3, 5)]) for symbol in joints]
    meshes = [drawing.glyph(symbol, np.zeros(3), 1.0) for symbol in joints]
    shapes = [np.array([*mesh.bounds, mesh.volume, *mesh.points.mean(axis=0)]) for mesh in meshes]
    for one, other in itertools.combinations(range(17), 2):
        apart = np.abs(tints[one] - tints[other]).max() > 51
        assert apart or joints[one].marker != joints[other].marker, (one, other)
        assert apart or not np.allclose(shapes[one], shapes[other], rtol=0.2), (one, other)
