"""Plates, shells, rigid bodies and what holds and loads them in scene files: read, built, or
refused with file and line.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.bodies import body as bodies
from fmbs_skfem.bodies.body import Cells
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.bodies.plate import Rim
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.scenes import build, schema, surfaces, times
from fmbs_skfem.scenes import field_kinds as fields
from fmbs_skfem.shapes import nurbs, nurbs_file
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..shapes.test_smoothing import annulus

EXAMPLES = Path(__file__).parents[2] / "examples"

PLANAR = """\
schema: 1
dimension: 2
parameters: {M: 15 N m}
bodies:
  crank:
    type: plate
    mesh: ../meshes/plate_crank_coarse.msh
    face: plate
    arcs: [A, B]
    thickness: {plate: 10 mm}
    material: {young_modulus: 70 GPa, density: 2700, poisson_ratio: 0.25}
    rims: {A: A, B: {edges: [B], center: [0.1 m, 0]}, outer: [outer_A]}
    order: 4
  wheel: {type: rigid, mass: 2 kg, inertia: 0.5 kg m^2, center: [0.1 m, 0], points: {rod: [0.2 m, 0]}, rotation: 30 deg}
  block: {type: rigid_plate, mesh: ../meshes/plate_8x8.msh, thickness: 1 cm, density: 7800 kg/m^3, origin: [0.2 m, 0]}
  gear: {type: rigid, mass: 1, inertia: 1, center: [1 m, 1 m]}
  rod: {type: cable, mesh: ../meshes/beam_10.msh, section: {shape: circular, diameter: 1 cm},
        material: {young_modulus: 1 GPa, density: 1800}, origin: [0.2, 0]}
joints:
  A: {type: revolute, at: crank.A, to: ground}
  B: {type: revolute, at: crank.B, to: wheel}
  rail: {type: prismatic, at: gear, direction: [1, 1], to: wheel.frame}
  mesh: {type: gear, at: wheel, to: gear, teeth: [20, -40], carrier: block}
  rod: {type: weld, at: rod.left, to: wheel.rod}
  guide: {type: slider, at: rod.right, direction: [1, 0], to: block}
  drive: {type: driven_angle, at: gear, angle: t, to: wheel}
loads:
  motor: {type: torque, at: crank.A, torque: M, history: 1 + t}
  spring: {type: torsion_spring, at: crank.A, to: wheel, stiffness: 3 N m/rad, damping: 1 N m s/rad, rest_angle: 30 deg}
  weight: {type: surface_load, body: crank, force: [0, -1 kPa], faces: plate, history: t}
  pull: {type: edge_load, body: crank, edges: [outer_B], force: [2 kN/m, 0]}
  push: {type: follower, at: wheel.frame, force: [1 N, 2 N]}
analysis:
  type: dynamic
  duration: 0.1 s
  step: 1 ms
  every: [{until: 0.05 s, every: 5 ms}, {every: 2 ms}]
outputs:
  x_B: {type: position, at: crank.B, component: x}
  vy: {type: velocity, at: crank.B, component: y}
  angle: {type: angle, at: crank.A}
  speed: {type: angular_velocity, at: wheel}
reduction: {snapshots: [{until: 10 ms, every: 1 ms}, {until: 50 ms, every: 10 ms}]}
"""

SPATIAL = """\
schema: 1
bodies:
  roof:
    {type: shell, nurbs: roof.json, cells: 2, degree: 3, unit: 100 mm, thickness: 1 cm, order: 4,
     material: {young_modulus: 1 GPa, density: 1000}, rotation: {axis: [0, 0, 1], angle: 90 deg}}
  plate:
    {type: plate, mesh: ../meshes/plate_8x8.msh, interpolation: bfs, thickness: 1 cm,
     material: {young_modulus: 1 GPa, density: 1000}, rims: {left: left}, origin: [5, 5, 5]}
  tri:
    {type: plate, mesh: ../meshes/lug_tri.msh, interpolation: argyris, thickness: 1 cm,
     material: {young_modulus: 1 GPa, density: 1000}}
  box: {type: rigid, mass: 1, inertia: [1, 2, 2.5 kg m^2], center: [0, 0, 0], points: {tip: [1, 0, 0]}}
  bar: {type: rigid, mass: 1, inertia: [[1, 0, 0], [0, 2, 0], [0, 0, 2]], center: [1, 0, 0]}
joints:
  edge: {type: edge, body: roof, edges: xi2_min, fixed: xz, slope: y}
  all: {type: edge, body: plate, edges: [right, top]}
  nodes: {type: rim_nodes, body: plate, edges: bottom, to: [5, 4, 5]}
  hinge: {type: revolute, at: box, axis: [0, 0, 1]}
  cross: {type: universal, at: box.tip, to: bar, axis: [1, 0, 0], axis_to: [0, 1, 0]}
  tube: {type: cylindrical, at: bar, axis: [1, 0, 0]}
loads:
  wind: {type: pressure, body: roof, pressure: -2 kPa, history: sin(t)}
  snow: {type: surface_load, body: roof, force: [0, 0, -1 kPa]}
  motor: {type: torque, at: box, torque: [0, 0, 1 N m]}
  push: {type: follower, at: box.frame, force: [1, 2, 3]}
  spring: {type: torsion_spring, at: box, axis: [0, 0, 1], stiffness: 2}
analysis: {type: static}
outputs:
  turn: {type: angle, at: box, axis: [0, 0, 1]}
  stress: {type: stress, at: plate.c}
"""


def test_planar_bodies() -> None:
    scene = scenes.loads(PLANAR, EXAMPLES)
    crank, wheel = scene.bodies["crank"], scene.bodies["wheel"]
    assert isinstance(crank, schema.Plate)
    assert isinstance(wheel, schema.Rigid)
    assert crank.thickness == {"plate": 0.01}
    assert crank.rims["A"] == Rim(("A",))
    assert crank.rims["B"] == Rim(("B",), (0.1, 0.0))
    assert wheel.inertia == 0.5
    parts = {name: model.build(scene, None, False) for name, model in scene.bodies.items()}
    assert set(parts["crank"].frames) == {"A", "B", "outer"}
    assert parts["crank"].space is not None
    assert parts["crank"].space.order == 4
    assert parts["crank"].cells is not None
    A, nu = parts["crank"].cells.section[0, 0, 0], parts["crank"].cells.section[1, 0, 0]
    assert (A, nu) == pytest.approx((70e9 * 0.01 / (1 - 0.25**2), 0.25), rel=1e-15)
    block = parts["block"]
    assert float(block.constant @ (block.mass @ block.constant)) == pytest.approx(78.0, rel=1e-14)
    np.testing.assert_allclose(block.reference[0], [0.7, 0.5], atol=1e-14)
    tip = (
        bodies.probe(parts["wheel"], bodies.locate(parts["wheel"], "rod"))
        @ parts["wheel"].reference
    )
    np.testing.assert_allclose(tip, [[0.2, 0.0]], atol=1e-15)


def test_planar_system() -> None:
    system = build.system(scenes.loads(PLANAR, EXAMPLES))
    held: dict[str, int] = {}
    for joint, _ in system.constraints.names:
        held[joint] = held.get(joint, 0) + 1
    assert {name: held[name] for name in ("A", "B", "rail", "mesh", "rod", "guide", "drive")} == {
        "A": 2, "B": 2, "rail": 2, "mesh": 1, "rod": 3, "guide": 1, "drive": 1,
    }  # fmt: skip
    columns = [column for output in system.outputs.values() for column in output.columns]
    assert columns == ["x_B", "vy", "angle", "speed"]
    x_B = system.sensors(system.x0)[system.outputs["x_B"].rows[0]]
    assert x_B == pytest.approx(0.1, abs=1e-15)


def test_planar_rules() -> None:
    scene = scenes.loads(PLANAR, EXAMPLES)
    spring = scene.loads["spring"]
    assert isinstance(spring, loads.TorsionSpring)
    assert (spring.stiffness, spring.damping, spring.rest_angle) == (
        3.0,
        1.0,
        pytest.approx(math.pi / 6, rel=1e-15),
    )
    motor = scene.loads["motor"]
    assert isinstance(motor, loads.Torque)
    assert motor.torque == 15.0
    mesh = scene.joints["mesh"]
    assert isinstance(mesh, joints.Gear)
    assert mesh.teeth == (20, -40)
    assert isinstance(scene.outputs["speed"], probes.AngularVelocity)
    assert scene.loads["weight"] == loads.SurfaceLoad(
        "weight",
        "crank",
        (0.0, -1000.0),
        getattr(scene.loads["weight"], "history", None),
        ("plate",),
    )


def test_spatial_system() -> None:
    """The roof 1 / 10 as large and turned: its free corner is at (-y, x, z) / 10."""
    scene = scenes.loads(SPATIAL, EXAMPLES)
    parts = {name: model.build(scene, None, False) for name, model in scene.bodies.items()}
    corner = (
        bodies.probe(parts["roof"], bodies.locate(parts["roof"], "corner_11"))
        @ parts["roof"].reference
    )
    angle = math.radians(40)
    np.testing.assert_allclose(
        corner, [[-2.5, 2.5 * math.sin(angle), 2.5 * math.cos(angle)]], atol=1e-14
    )
    system = build.system(scene)
    names = {joint for joint, _ in system.constraints.names}
    assert {"edge", "all", "nodes", "hinge", "cross", "tube"} <= names
    assert [column for output in system.outputs.values() for column in output.columns] == [
        "turn",
        "stress_bottom",
        "stress_top",
    ]
    assert sum(map(len, system.loads.forces)) >= 2


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("face: plate", "face: plat", r"scene:5: bodies.crank: .*did you mean 'plate'"),
        ("arcs: [A, B]", "arcs: [A, E]", r"scene:5: bodies.crank: .*'E'"),
        (
            "arcs: [A, B]",
            "interpolation: argyris",
            r"scene:5: bodies.crank: .*triangles for argyris, got quads; .*ancf or bfs",
        ),
        ("arcs: [A, B]", "interpolation: bfs", r"scene:5: bodies.crank: .*rectangles"),
        (
            "arcs: [A, B]",
            "arcs: [A]\n    interpolation: bfs",
            "scene:9: bodies.crank.arcs: expected arcs with ancf or fvs only",
        ),
        (
            "{plate: 10 mm}",
            "{plat: 10 mm}",
            r"scene:5: bodies.crank: .*one of the faces plate.* did you mean 'plate'",
        ),
        (
            "{plate: 10 mm}",
            "{plate: 10 s}",
            r"scene:10: bodies.crank.thickness.plate: expected a length",
        ),
        (
            "{plate: 10 mm}",
            "[1 mm]",
            r"scene:10: bodies.crank.thickness: expected .*a thickness, or one a face",
        ),
        (
            "poisson_ratio: 0.25",
            "poisson_ratio: 0.6",
            "scene:11: bodies.crank.material.poisson_ratio: expected a number > -1 and < 0.5",
        ),
        (
            "poisson_ratio: 0.25",
            "poisson_ratio: -1",
            "scene:11: bodies.crank.material.poisson_ratio: expected a number > -1",
        ),
        (
            "outer: [outer_A]",
            "outer: [outer_E]",
            r"scene:5: bodies.crank: .*'outer_E'; did you mean 'outer",
        ),
        (
            "outer: [outer_A]",
            "outer: {edge: A}",
            r"scene:12: bodies.crank.rims.outer.edge: .* got 'edge'; did you mean 'edges'",
        ),
        (
            "outer: [outer_A]",
            "outer: [outer_A, outer_A]",
            r"scene:12: bodies.crank.rims.outer: expected each name once",
        ),
        (
            "outer: [outer_A]",
            "ou ter: [outer_A]",
            r"scene:12: bodies.crank.rims.ou ter: expected a name of letters",
        ),
        (
            "center: [0.1 m, 0]}, outer",
            "center: [0.1 m]}, outer",
            r"scene:12: bodies.crank.rims.B.center: expected a list of 2",
        ),
        ("order: 4", "order: 0", "scene:13: bodies.crank.order: expected a number >= 1"),
        ("inertia: 0.5 kg m^2", "inertia: [1, 1, 1]", "scene:14: bodies.wheel.inertia"),
        (
            "inertia: 0.5 kg m^2",
            "inertia: 0.5 kg",
            r"scene:14: bodies.wheel.inertia: expected a moment of inertia \[kg m\^2\]",
        ),
        (
            "points: {rod:",
            "points: {frame:",
            "scene:14: bodies.wheel.points.frame: expected another name",
        ),
        (
            "at: crank.A, to: ground",
            "at: crank.E, to: ground",
            r"scene:20: joints.A.at: .*one of its points \(A, B, outer\)",
        ),
        (
            "at: crank.A, to: ground",
            "at: crank, to: ground",
            r"scene:20: joints.A.at: expected a rim or named point of 'crank'",
        ),
        (
            "at: crank.A, to: ground",
            "at: {body: crank, s: 0}, to: ground",
            r"scene:20: joints.A.at: expected a rim or named",
        ),
        (
            "at: crank.A, to: ground",
            "at: crank.A, axis: [0, 0, 1]",
            "scene:20: joints.A.axis: expected no axis in the plane",
        ),
        (
            "to: wheel}\n  rail",
            "to: {body: wheel, s: 0}}\n  rail",
            "scene:21: joints.B.to: expected the rigid body 'wheel' or one",
        ),
        (
            "teeth: [20, -40]",
            "teeth: [20, 0]",
            "scene:23: joints.mesh.teeth: expected two whole numbers that are not zero",
        ),
        (
            "carrier: block",
            "carrier: blok",
            "scene:23: joints.mesh.carrier: .* did you mean 'block'",
        ),
        (
            "torque: M",
            "torque: 15 N",
            r"scene:28: loads.motor.torque: expected a moment \[N m\], got '15 N'",
        ),
        (
            "stiffness: 3 N m/rad",
            "stiffness: -3",
            "scene:29: loads.spring.stiffness: expected a torsional stiffness",
        ),
        (
            "body: crank, force: [0",
            "body: crnk, force: [0",
            "scene:30: loads.weight.body: .* did you mean 'crank'",
        ),
        (
            "body: crank, force: [0",
            "body: wheel, force: [0",
            r"scene:30: loads.weight.body: .*\(crank\), got 'wheel', a rigid",
        ),
        ("faces: plate", "faces: plates", "scene:30: loads.weight.faces: .*'plates'"),
        (
            "edges: [outer_B]",
            "edges: [outer_E]",
            "scene:31: loads.pull.edges: .*'outer_E'; did you mean 'outer",
        ),
        (
            "edges: [outer_B]",
            "edges: 3",
            "scene:31: loads.pull.edges: expected a name or a list of names, got 3",
        ),
        (
            "force: [2 kN/m, 0]",
            "force: [2 kN, 0]",
            r"scene:31: loads.pull.force: expected a force per length \[N/m\]",
        ),
        (
            "type: surface_load, body: crank, force: [0, -1 kPa]",
            "type: pressure, body: crank, pressure: 1",
            "scene:30: loads.weight",
        ),
        (
            "every: 5 ms}",
            "every: 1 ns}",
            r"scene:37: analysis.every\[0\].every: expected at most 10000000 states",
        ),
        (
            "until: 0.05 s, ",
            "",
            "scene:37: analysis.every: expected the key 'until' in every span but the last",
        ),
        (
            "{every: 2 ms}",
            "{until: 0.01 s, every: 2 ms}",
            "scene:37: analysis.every: expected spans that end one after the other",
        ),
        (
            "{every: 2 ms}",
            "{evry: 2 ms}",
            r"scene:37: analysis.every\[1\].evry: .* got 'evry'; did you mean 'every'",
        ),
        (
            "every: [{until: 0.05 s, every: 5 ms}, {every: 2 ms}]",
            "every: 0",
            "scene:37: analysis.every: expected a number >= 1 .a number of steps, a time such as 5 ms",
        ),
        (
            "until: 50 ms",
            "until: 50.5 ms",
            r"scene:43: reduction.snapshots\[1\].until: expected a multiple",
        ),
        (
            "component: x",
            "component: z",
            "scene:39: outputs.x_B.component: expected x or y in the plane",
        ),
        (
            "reduction:",
            "pictures: {color: von_mises}\nreductio:",
            "scene:44: reductio: .* did you mean 'reduction'",
        ),
        ("reduction:", "compare: {coarse: [5]}\nreduction: {snapshots: 0.5 s}\n#", "^$"),
    ],
)
def test_planar_problems_have_file_and_line(before: str, after: str, message: str) -> None:
    assert PLANAR.count(before) == 1
    text = PLANAR.replace(before, after)
    if message == "^$":
        build.system(scenes.loads(text, EXAMPLES))
        return
    with pytest.raises(InputError, match=message) as caught:
        build.system(scenes.loads(text, EXAMPLES))
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("nurbs: roof.json", "nurbs: rof.json", r"scene:3: bodies.roof: .*rof\.json"),
        ("nurbs: roof.json", "nurbs: ../../../etc/passwd", r"scene:3: bodies.roof: "),
        ("degree: 3", "degree: 11", "scene:4: bodies.roof.degree: expected a number <= 10"),
        ("unit: 100 mm", "unit: 0", "scene:4: bodies.roof.unit: expected a length"),
        (
            "rims: {left: left}",
            "rims: {left: lefft}",
            r"scene:6: bodies.plate: .* did you mean 'left'",
        ),
        (
            "lug_tri.msh, interpolation: argyris",
            "lug_tri.msh, interpolation: ancf",
            "scene:9: bodies.tri: .*quads for ancf, got triangles; .*argyris",
        ),
        (
            "[1, 2, 2.5 kg m^2]",
            "1 kg m^2",
            "scene:12: bodies.box.inertia: expected 3 principal moments or a 3 x 3 tensor",
        ),
        (
            "[1, 2, 2.5 kg m^2]",
            "[1, 2, 3.5]",
            "scene:12: bodies.box: .*each principal moment is at most the sum",
        ),
        (
            "fixed: xz, slope: y",
            "fixed: xx",
            "scene:15: joints.edge.fixed: expected letters of xyz",
        ),
        ("fixed: xz, slope: y", "fixed: ''", "scene:15: joints.edge.fixed: expected a component"),
        (
            "to: [5, 4, 5]",
            "to: ground",
            "scene:17: joints.nodes.to: expected a place or the coordinates of a fixed point",
        ),
        (
            "at: box, axis: [0, 0, 1]}\n  cross",
            "at: box}\n  cross",
            "scene:18: joints.hinge.axis: expected the axis of rotation in space",
        ),
        (
            "axis_to: [0, 1, 0]",
            "axis_to: [0, 0, 0]",
            r"scene:19: joints.cross.axis_to: expected an axis that is not zero, got \[0, 0, 0\]",
        ),
        (
            "at: box, axis: [0, 0, 1], stiffness",
            "at: box, to: nobody, axis: [0, 0, 1], stiffness",
            "scene:26: loads.spring.to",
        ),
        (
            "turn: {type: angle, at: box, axis: [0, 0, 1]}",
            "turn: {type: angle, at: box}",
            "scene:29: outputs.turn.axis",
        ),
        (
            "at: plate.c",
            "at: box.tip",
            r"scene:30: outputs.stress.at: expected one of the plates, shells, beams and cables",
        ),
        (
            "pressure: -2 kPa",
            "pressure: -2 kN",
            r"scene:22: loads.wind.pressure: expected a pressure \[Pa\]",
        ),
        (
            "history: sin(t)",
            "history: sin(t), follower: true",
            "scene:22: loads.wind.follower: expected a constant pressure, got a history",
        ),
        (
            "type: pressure, body: roof, pressure: -2 kPa, history: sin(t)",
            "type: normal_edge_load, body: plate, edges: right, force: 3 kN/m",
            "load 'wind': expected a planar scene, got a spatial one",
        ),
    ],
)
def test_spatial_problems_have_file_and_line(before: str, after: str, message: str) -> None:
    assert SPATIAL.count(before) == 1
    with pytest.raises(InputError, match=message):
        build.system(scenes.loads(SPATIAL.replace(before, after), EXAMPLES))


def test_rims_in_space_are_clamped_where_the_scene_says_so() -> None:
    text = SPATIAL.replace("rims: {left: left}", "rims: {left: {edges: left, slopes: true}}")
    plate = scenes.loads(text, EXAMPLES).bodies["plate"]
    assert plate.rims == {"left": Rim(("left",), slopes=True)}  # type: ignore[attr-defined]
    with pytest.raises(
        InputError, match=r"scene:\d+: bodies.crank.rims.B.slopes: expected slopes in space only"
    ):
        scenes.loads(PLANAR.replace("center: [0.1 m, 0]}, outer", "slopes: true}, outer"), EXAMPLES)


def test_loads_that_follow_have_cells_of_their_own() -> None:
    scene = scenes.loads(SPATIAL.replace("history: sin(t)", "follower: true"), EXAMPLES)
    pressure = build.system(scene).elastic[-1]
    assert pressure.name == "load 'wind'"
    assert isinstance(pressure.gather, Cells)
    assert pressure.gather.law is Law.PRESSURE
    np.testing.assert_array_equal(pressure.gather.section[0], -2000.0)
    pull = "pull: {type: normal_edge_load, body: crank, edges: outer_B, force: 3 kN/m}"
    text = PLANAR.replace("loads:\n", f"loads:\n  {pull.replace('pull', 'normal', 1)}\n")
    edge = build.system(scenes.loads(text, EXAMPLES)).elastic[-1]
    assert edge.name == "load 'normal'"
    assert isinstance(edge.gather, Cells)
    assert edge.gather.law is Law.EDGE_PRESSURE
    np.testing.assert_array_equal(edge.gather.section[0], 3000.0)


def test_only_cables_are_divided_anew_and_points_show_no_stress() -> None:
    text = (
        PLANAR[: PLANAR.index("  rod: {type: cable")]
        + "analysis: {type: static}\ncompare: {coarse: [5]}\n"
    )
    with pytest.raises(InputError, match=r"compare[.]coarse: expected a scene with cables"):
        scenes.loads(text, EXAMPLES)
    text = "schema: 1\nbodies: {m: {type: point_mass, mass: 1, position: [0, 0, 0]}}\nanalysis: {type: static}\n"
    with pytest.raises(
        InputError, match=r"pictures[.]color: expected a scene with a body of the types beam, cable"
    ):
        scenes.loads(text + "pictures: {color: von_mises}\n")


def test_thickness_of_every_cell() -> None:
    """Two patches side by side would each have a face; here the faces are made by hand."""
    scene = scenes.loads(SPATIAL, EXAMPLES)
    model = scene.bodies["roof"]
    assert isinstance(model, schema.Shell)
    shape = model.surface(EXAMPLES)
    cells = np.arange(len(shape.nodes))
    shape.faces.update({"a": cells[:1], "b": cells[1:], "c": cells[:2]})
    np.testing.assert_array_equal(
        surfaces.thickness({"a": 0.1, "b": 0.2}, shape), [0.1, 0.2, 0.2, 0.2]
    )
    assert surfaces.thickness(0.3, shape) == 0.3
    with pytest.raises(
        InputError, match="every cell in one face, got cell 1 in 'c' and another one"
    ):
        surfaces.thickness({"b": 0.2, "c": 0.1}, shape)
    with pytest.raises(InputError, match="none for 3 of 4 cells"):
        surfaces.thickness({"a": 0.1}, shape)


def test_steps_that_are_kept() -> None:
    scene = scenes.loads(PLANAR, EXAMPLES)
    steps = build.dynamic(scene).kept
    np.testing.assert_array_equal(steps, [*range(0, 51, 5), *range(52, 101, 2)])
    np.testing.assert_array_equal(build.snapshot_steps(scene), [*range(11), *range(20, 101, 10)])
    uneven = times.kept((fields.Span(3e-3, 7e-3), fields.Span(4e-3)), 1e-3, 20e-3)
    np.testing.assert_array_equal(uneven, [0, 3, 6, 11, 15, 19, 20])
    shorter = times.numbers((fields.Span(3e-3, 7e-3), fields.Span(4e-3)), 1e-3, 5e-3)
    np.testing.assert_array_equal(shorter, [0, 3])
    assert times.kept(7, 1e-3, 1.0) == 7
    spans = "every: [{until: 0.05 s, every: 5 ms}, {every: 2 ms}]"
    even = build.dynamic(scenes.loads(PLANAR.replace(spans, "every: 5 ms"), EXAMPLES)).kept
    np.testing.assert_array_equal(even, np.arange(0, 101, 5))
    np.testing.assert_array_equal(times.snapshots(5e-3, 1e-3, 12e-3), [0, 5, 10])
    with pytest.raises(InputError, match="a multiple of the step"):
        times.snapshots(5.5e-3, 1e-3, 1.0)
    with pytest.raises(InputError, match=r"analysis[.]type: expected dynamic"):
        build.dynamic(scenes.loads(SPATIAL, EXAMPLES))


def test_constraints_of_large_plates_stay_multipliers() -> None:
    """237 nodes of three functions, less the slaved ones, are more than 500; the scene's own choice
    wins.
    """
    text = PLANAR.replace("  step: 1 ms\n", "  step: 1 ms\n  constraints: FORM\n")
    full = build.system(scenes.loads(PLANAR, EXAMPLES))
    assert build.chosen_form(scenes.loads(PLANAR, EXAMPLES), full) is full
    assert (
        build.chosen_form(scenes.loads(text.replace("FORM", "eliminate"), EXAMPLES), full).size
        < full.size
    )
    assert (
        build.chosen_form(scenes.loads(text.replace("FORM", "multipliers"), EXAMPLES), full) is full
    )
    static = PLANAR[: PLANAR.index("analysis:")] + "analysis: {type: static}\n"
    assert build.chosen_form(scenes.loads(static, EXAMPLES), full).size < full.size


@pytest.mark.parametrize(("name", "size"), [("crank_slider", 31310), ("crank_slider_coarse", 3134)])
def test_crank_slider(name: str, size: int) -> None:
    """Example 3 at both sizes: 3 orthonormality rows a rim, 2 a pin, 1 of the guide; the initial
    state and 1500 snapshots, and 9 more in the first 0.3 ms.

    6 coordinates a node and a frame, 2 of the slider, less 4 for each of the 72 (24) nodes of a
    rim: 6 * 5406 + 26 - 4 * 4 * 72.
    """
    scene = scenes.read(EXAMPLES / f"{name}.yaml")
    system = build.system(scene)
    assert system.size == size
    assert len(system.constraints.names) == 4 * 3 + 3 * 2 + 1
    assert build.chosen_form(scene, system) is system
    steps = build.snapshot_steps(scene)
    assert (len(steps), steps[1], steps[15], steps[514], steps[515], steps[-1]) == (
        1515,
        2,
        30,
        15000,
        15005,
        20000,
    )
    np.testing.assert_array_equal(build.dynamic(scene).kept, steps)
    assert list(system.outputs)[:3] == ["x_C", "crank_angle", "crank_speed"]
    assert system.outputs["x_C"].columns == ("x_C",)
    first = system.sensors(system.x0)[system.outputs["x_C"].rows[0]]
    assert first == pytest.approx(0.3, abs=1e-12)


def test_crank_slider_starts() -> None:
    """50 steps of the coarse model, next to the rigid one, M t^2 / (2 J) with J = J_crank,A +
    J_linkage,C / 4 at dead centre.

    The rim A runs ahead by the elastic twist around it, at most twice the static 3.6e-5 rad;
    numerical damping takes some work.
    """
    scene = scenes.read(EXAMPLES / "crank_slider_coarse.yaml")
    analysis = scene.analysis
    assert isinstance(analysis, schema.Dynamic)
    parts = [scene.bodies[name].build(scene, None, False) for name in ("crank", "linkage")]
    J = moment_of_inertia(parts[0], (0.0, 0.0)) + 0.25 * moment_of_inertia(parts[1], (0.3, 0.0))
    system = build.chosen_form(scene, build.system(scene))
    scheme = GeneralizedAlpha(analysis.step, analysis.rho_inf)
    found = dynamics.integrate(system, scheme, 50 * analysis.step, every=np.arange(51))
    columns = dynamics.outputs(found)
    np.testing.assert_allclose(found.times, np.arange(51) * 1e-5, rtol=1e-12)
    ahead = columns["crank_angle"] - 15.0 / J * found.times**2 / 2
    assert (ahead[1:] > 0.0).all()
    assert ahead.max() < 2 * 3.6e-5
    stored = columns["energy_kinetic"][-1] + columns["energy_strain"][-1]
    assert stored == pytest.approx((15.0 * 5e-4) ** 2 / (2 * J), rel=0.03)
    assert stored < 15.0 * columns["crank_angle"][-1]
    assert 0.0 < 0.3 - columns["x_C"][-1] < 1e-7


def moment_of_inertia(part: bodies.Body, center: tuple[float, float]) -> float:
    """int r^2 dm about a centre [kg m2]."""
    r = part.reference - np.outer(part.constant, center)
    return float(sum(r[:, c] @ (part.mass @ r[:, c]) for c in range(2)))


RING = """\
schema: 1
bodies:
  ring: {type: shell, nurbs: ring.json, cells: 1, degree: 3, thickness: 3 cm, material: {young_modulus: 21 MPa, density: 1}}
joints:
  clamp: {type: edge, body: ring, edges: xi1_min, slope: z}
loads:
  lift: {type: edge_load, body: ring, edges: xi1_max, force: [0, 0, 1 mN/m]}
analysis: {type: static}
"""


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_a_ring_is_slit_where_the_scene_says_so(tmp_path: Path) -> None:
    """The file does not say whether its nine-point patch is closed; an edge that was joined away
    holds and carries nothing.
    """
    nurbs_file.write(tmp_path / "ring.json", nurbs.surface(*annulus(6.0, 10.0)))
    with pytest.raises(InputError) as caught:
        build.system(scenes.loads(RING, tmp_path))
    for line in (
        r"joints\.clamp\.edges: .* got 'xi1_min', which is joined",
        r"loads\.lift\.edges: .* got 'xi1_max', which is joined",
    ):
        assert re.search(line, str(caught.value))
    slit = build.system(scenes.loads(RING.replace("cells: 1", "cells: 1, join: false"), tmp_path))
    closed = build.system(scenes.loads(RING.replace("cells: 1", "cells: 1, join: true"), tmp_path))
    n1, n2 = 4 * 3 + 1, 4  # functions of both directions, of which inner knots tie three
    assert slit.size == 3 * (n1 - 3) * n2
    assert closed.size == 3 * (n1 - 1 - 4) * n2


@pytest.mark.parametrize("join", [True, False])
def test_a_file_says_whether_it_is_closed_and_the_scene_stands_above_it(
    tmp_path: Path, join: bool
) -> None:
    nurbs_file.write(tmp_path / "ring.json", nurbs.surface(*annulus(6.0, 10.0), join=join))
    model = scenes.loads(RING, tmp_path).bodies["ring"]
    count = model.surface(tmp_path).count
    assert count == (12 if join else 13) * 4
    assert replace(model, join=not join).surface(tmp_path).count == (13 if join else 12) * 4
