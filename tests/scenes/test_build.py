"""Scenes become systems: the examples' sizes, places, remeshing, and problems with file and line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Circular, Given, Material
from fmbs_skfem.bodies import body as bodies
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.scenes import build, schema
from fmbs_skfem.scenes import field_kinds as fields
from fmbs_skfem.shapes import curves, meshes
from fmbs_skfem.systems import assembly
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
SECTION = Given(1.0, 1.0, 1.0, 0.01)


@pytest.mark.parametrize(
    ("name", "dofs", "constraints", "free"),
    [
        ("spin_up", 404, 3, 402),
        ("double_pendulum", 1212, 6, 1206),
        ("hanging_mass", 249, 9, 243),
        ("four_bar", 232, 9, 224),
    ],
)
def test_examples(name: str, dofs: int, constraints: int, free: int) -> None:
    """Sizes of the paper for the first two: 404 and 1212 coordinates, 2 linear + 1 driven and 6
    linear constraints.
    """
    system = build.system(scenes.read(EXAMPLES / f"{name}.yaml"))
    assert (system.size, len(system.constraints.names)) == (dofs, constraints)
    assert assembly.eliminate(system).size == free
    gaps = system.probes(system.x0)
    assert np.isfinite(gaps).all()


def test_paper_scenes_say_what_the_paper_says() -> None:
    spin, pendulum = (
        scenes.read(EXAMPLES / "spin_up.yaml"),
        scenes.read(EXAMPLES / "double_pendulum.yaml"),
    )
    for scene in (spin, pendulum):
        assert scene.analysis == schema.Dynamic(duration=3.0, step=5e-4, rho_inf=0.8)
        assert scene.reduction is not None
        assert (scene.reduction.snapshots, scene.reduction.tolerance) == (0.005, 1e-12)
        assert scene.reduction.hyper_reduction == schema.HyperReductionChoice(
            tolerance=1e-3, sample="elements"
        )
        for body in scene.bodies.values():
            assert isinstance(body, schema.Cable)
            assert body.material == Material(young_modulus=1e9, density=1800.0)
            assert body.section == Circular(0.01)
    drive = spin.joints["drive"]
    assert isinstance(drive, joints.DrivenAngle)
    t = np.linspace(0.0, 3.0, 61)
    Ts, ws = 1.5, 2 * np.pi
    ramp = ws / Ts * (t**2 / 2 + (Ts / (2 * np.pi)) ** 2 * (np.cos(2 * np.pi * t / Ts) - 1))
    np.testing.assert_allclose(
        drive.angle(t), np.where(t <= Ts, ramp, ws * (t - Ts / 2)), rtol=1e-14, atol=1e-15
    )
    assert "tip_deflection" in spin.outputs
    assert {"B", "C"} <= set(pendulum.outputs)
    assert pendulum.loads == {"weight": loads.Gravity((0.0, 0.0, -9.81), "weight")}


def test_total_mass_of_the_pendulum() -> None:
    """Two beams of rho pi d^2/4 L = 1800 pi 1e-4/4 kg."""
    system = build.system(scenes.read(EXAMPLES / "double_pendulum.yaml"), cells=10)
    z = np.zeros((system.size // 3, 3))
    z[:, 2] = 1.0
    assert z.ravel() @ (system.mass @ z.ravel()) == pytest.approx(
        2 * 1800 * np.pi * 1e-4 / 4, rel=1e-12
    )


def test_linkage_closes() -> None:
    """The coupler of the four-bar ends on the rocker, at (0.5, 0.4) m."""
    scene = scenes.read(EXAMPLES / "four_bar.yaml")
    for name in ("coupler", "rocker"):
        part = scene.bodies[name].build(scene, None, False)
        end = bodies.probe(part, bodies.locate(part, "right")) @ part.reference
        np.testing.assert_allclose(end, [[0.5, 0.4]], atol=1e-14)


@pytest.mark.parametrize(
    ("cells", "refine", "count"),
    [(20, 1, 20), (7, 1, 7), (100, 1, 100), (None, 3, 120), (None, 1, 40)],
)
def test_remeshed_cable(cells: int | None, refine: int, count: int) -> None:
    """Named points stay where they are, the ends included."""
    mesh = meshes.read(ROOT / "meshes" / "cable_40.msh")
    new = curves.cut(curves.follow(mesh, "cable"), cells, refine)
    assert len(new.breaks) == count + 1
    for name, ids in mesh.point_groups.items():
        np.testing.assert_allclose(
            new.curve(np.array([new.names[name]])), mesh.points[ids], atol=1e-14
        )
        assert new.names[name] in new.breaks
    assert (np.diff(new.curve(new.breaks)[:, 0]) > 0).all()


@pytest.mark.parametrize("cells", [2, 33])
def test_remeshed_arc_stays_an_arc(cells: int) -> None:
    """Points of a coarser mesh lie on the circle, not on the old chords (sagitta 2e-4 m), and
    slopes are along it.
    """
    new = curves.cut(curves.follow(meshes.read(ROOT / "meshes" / "arc_40.msh"), None), cells)
    spokes = new.curve(new.breaks) - [0.0, 1.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(spokes, axis=1), 1.0, atol=2e-6)
    np.testing.assert_allclose(np.sum(spokes * new.curve(new.breaks, 1), axis=1), 0.0, atol=1e-4)


def length_of(part: bodies.Body) -> float:
    """Length of the reference [m]."""
    weights = bodies.arc_length_table(part.space, part.reference, 8)[2]
    return float(weights.sum())


def test_an_arc_of_few_cells_errs_by_the_fourth_order() -> None:
    """Cells follow the curve of the mesh, not one through their ends: the length of a quarter of a
    circle.
    """
    arc = curves.follow(meshes.read(ROOT / "meshes" / "arc_40.msh"), None)
    parts = [bodies.cable("arc", curves.cut(arc, cells), SECTION, dim=2) for cells in (2, 4)]
    errors = [abs(length_of(part) - np.pi / 2) for part in parts]
    assert errors[0] < 2e-3 * np.pi / 2
    assert np.log2(errors[0] / errors[1]) > 3.5
    assert arc.fewest == 2


def test_a_closed_line_has_cells_enough_to_go_round() -> None:
    """Places by arc length are those of the mesh, its end among them, however short the reference
    of a few cells is.
    """
    hoop = curves.follow(meshes.read(ROOT / "meshes" / "hoop_60.msh"), None)
    assert hoop.fewest == 6
    coarse, fine = (
        bodies.cable("hoop", curves.cut(hoop, cells), SECTION, dim=2) for cells in (6, 48)
    )
    length = float(bodies.arc_lengths(fine)[1][-1])
    assert length == pytest.approx(0.4 * np.pi, rel=1e-6)
    assert length_of(coarse) == pytest.approx(length, rel=2e-3)
    for s in (0.3, 0.5 * length, length):
        ends = [
            bodies.probe(part, bodies.locate(part, s)) @ part.reference for part in (coarse, fine)
        ]
        np.testing.assert_allclose(*ends, atol=1e-3)


def test_remeshed_needs_cells_for_named_points() -> None:
    with pytest.raises(InputError, match="at least 2 cells"):
        curves.cut(curves.follow(meshes.read(ROOT / "meshes" / "cable_40.msh"), None), 1)


def test_rotation_about_an_axis() -> None:
    scene = scenes.read(EXAMPLES / "double_pendulum.yaml")
    turned = replace(
        scene.bodies["I"], rotation=fields.Turn(np.pi / 2, (0.0, -2.0, 0.0)), origin=(0.0, 0.0, 1.0)
    )
    part = turned.build(scene, 10, False)
    end = bodies.probe(part, bodies.locate(part, "B")) @ part.reference
    np.testing.assert_allclose(end, [[0.0, 0.0, 2.0]], atol=1e-14)


SCENE = """\
schema: 1
dimension: 2
bodies:
  beam:
    type: cable
    mesh: ../meshes/beam_10.msh
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 1 GPa, density: 1800}
  other: {type: cable, mesh: ../meshes/beam_10.msh, section: {shape: rectangular, width: 1 cm, height: 1 cm},
          material: {young_modulus: 1 GPa, density: 1800}, origin: [1 m, 0], rotation: 90 deg}
  mass: {type: point_mass, mass: 1 kg, position: [1 m, 1 m]}
joints:
  root: {type: clamp, at: beam.left}
  knee: {type: weld, at: beam.right, to: other.left}
  rail: {type: slider, at: mass, direction: [1, 1]}
  rod: {type: distance, at: beam.right, to: mass, length: 1 m}
  drive: {type: driven_position, at: other.right, displacement: [sin(t), 0]}
loads:
  pull: {type: point_force, at: {body: beam, s: 0.3 m}, force: [1, 0], history: 1 + t}
  follow: {type: follower, at: other.right, force: [0, 1 N]}
  twist: {type: moment, at: other.right, moment: 1 N m}
initial:
  bodies: {mass: {velocity: [1, 1]}, other: {angular_velocity: 2 rad/s}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs:
  speed: {type: velocity, at: mass}
  slope: {type: slope, at: beam.right}
  energy: {type: energy}
  force: {type: reaction, joint: root}
"""


def test_every_kind_of_joint_load_and_output() -> None:
    system = build.system(scenes.loads(SCENE, EXAMPLES))
    held: dict[str, int] = {}
    for joint, _ in system.constraints.names:
        held[joint] = held.get(joint, 0) + 1
    assert held == {"root": 3, "knee": 3, "rail": 1, "rod": 1, "drive": 2}
    assert system.outputs["force"].joint == "root"
    velocity = system.v0[-2:]
    np.testing.assert_array_equal(velocity, [1.0, 1.0])
    first, last = next((first, last) for name, first, last in system.coordinates if name == "other")
    np.testing.assert_allclose(
        system.v0[first:last].reshape(-1, 2)[[0, -1]], [[0.0, 2.0], [-2.0, 2.0]], atol=1e-13
    )


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "at: beam.left",
            "at: beam.leftt",
            r"scene:13: joints.root.at: .*left, right.* did you mean 'left'",
        ),
        ("s: 0.3 m", "s: 3 m", r"scene:19: loads.pull.at: .*an arc length between 0 and 1 m"),
        ("../meshes/beam_10.msh\n", "../meshes/beam_11.msh\n", r"scene:4: bodies.beam: "),
        ("../meshes/beam_10.msh\n", "../../../../etc/passwd\n", r"scene:4: bodies.beam: "),
        (
            "    section: {shape: c",
            "    line: bem\n    section: {shape: c",
            r"scene:4: bodies.beam: .*beam",
        ),
    ],
)
def test_problems_have_file_and_line(before: str, after: str, message: str) -> None:
    assert before in SCENE
    with pytest.raises(InputError, match=message) as caught:
        build.system(scenes.loads(SCENE.replace(before, after, 1), EXAMPLES))
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("1 + t", "1 / (t - 0.5)", "load 'pull' at t = 0.5 s"),
        ("sin(t)", "log(t)", "joint 'drive' at t = 0 s"),
    ],
)
def test_functions_that_are_not_finite(before: str, after: str, message: str) -> None:
    with pytest.raises(SolverError, match=message) as caught:
        build.system(scenes.loads(SCENE.replace(before, after, 1), EXAMPLES))
    assert caught.value.exit_code == 4
