"""Scene files: what is read, and every problem with file, line and key path."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Circular, Material
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values import units
from fmbs_skfem.core.values.mappings import entries
from fmbs_skfem.scenes import schema
from fmbs_skfem.systems import At, Rayleigh
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

SCENE = """\
schema: 1
name: small
dimension: 2
parameters: {E: 1 GPa, d: 10 mm, Ts: 1.5 s}
bodies:
  beam:
    type: cable
    mesh: ../meshes/beam_10.msh
    section: {shape: circular, diameter: d}
    material:
      young_modulus: 2 * E
      density: 1800 kg/m^3
    rotation: 30 deg
  mass: {type: point_mass, mass: 2 kg, position: [1 m, 0]}
joints:
  hinge: {type: pin, at: beam.left, to: ground}
  hook: {type: pin, at: mass, to: {body: beam, s: 300 mm}}
  link: {type: distance, at: beam.right, to: [2 m, 0]}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
  push: {type: point_force, at: beam.right, force: [1 kN, 0], history: "where(t < Ts, t / Ts, 1)"}
  twist: {type: moment, at: beam.right, moment: 3 N m}
damping: {mass: 0.1 1/s, stiffness: 1 ms}
initial:
  bodies: {mass: {velocity: [0, 1 m/s]}}
analysis: {type: dynamic, duration: 2 * Ts, step: 1 ms, rho_inf: 0.8}
outputs:
  tip: {type: position, at: beam.right}
  force: {type: reaction, joint: hinge}
reduction: {snapshots: 5 ms, components: {one: [beam], two: [mass]}, modes: {one: 5}}
compare: {coarse: [5], steps: [1 ms], tolerances: [1e-8], ffrf_modes: 4}
pictures: {instants: [0, 1 s], color: strain}
"""


def changed(before: str, after: str) -> str:
    assert SCENE.count(before) >= 1
    return SCENE.replace(before, after, 1)


def refused(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        scenes.loads(text)
    assert caught.value.exit_code == 3
    return str(caught.value).splitlines()


def test_quantities_are_si() -> None:
    scene = scenes.loads(SCENE)
    beam, mass = scene.bodies["beam"], scene.bodies["mass"]
    assert isinstance(beam, schema.Cable)
    assert isinstance(mass, schema.PointMass)
    assert isinstance(beam.section, Circular)
    assert beam.material == Material(young_modulus=2e9, density=1800.0)
    assert beam.section.diameter == 0.01
    assert beam.rotation is not None
    assert beam.rotation.angle == pytest.approx(math.pi / 6, rel=1e-15)
    assert mass.position == (1.0, 0.0)
    assert scene.damping == Rayleigh(mass=0.1, stiffness=1e-3)
    assert scene.analysis == schema.Dynamic(duration=3.0, step=1e-3)
    assert scene.parameters == {"E": 1e9, "d": 0.01, "Ts": 1.5}
    push, link, hook = scene.loads["push"], scene.joints["link"], scene.joints["hook"]
    assert isinstance(push, loads.PointForce)
    assert isinstance(link, joints.RigidLink)
    assert isinstance(hook, joints.Pin)
    assert push.force == (1000.0, 0.0)
    assert push.history is not None
    assert push.history(0.75) == 0.5
    assert link.to == (2.0, 0.0)
    assert hook.to == At("beam", 0.3)
    assert scenes.where(scene, "loads", "push", "history").startswith(
        "scene:21: loads.push.history"
    )


def test_file_knows_its_folder(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(SCENE, encoding="utf-8")
    scene = scenes.read(tmp_path / "a.yaml")
    assert (scene.path, scene.folder) == (tmp_path / "a.yaml", tmp_path)
    (tmp_path / "b.yaml").write_text(changed("shape: circular", "shape: circle"), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"b\.yaml:9: bodies\.beam\.section\.shape: .* did you mean 'circular'\?"
    ):
        scenes.read(tmp_path / "b.yaml")


def test_parameters_of_a_sweep() -> None:
    scene = scenes.loads(SCENE, parameters={"E": "3 GPa", "Ts": 1.0})
    beam = scene.bodies["beam"]
    assert isinstance(beam, schema.Cable)
    assert beam.material is not None
    assert (beam.material.young_modulus, getattr(scene.analysis, "duration", None)) == (6e9, 2.0)
    for parameters, message in (
        ({"e": 1.0}, "did you mean 'E'|one of the parameters"),
        ({"E": "3 mm"}, r"\(pressure\), got '3 mm'"),
    ):
        with pytest.raises(InputError, match=message):
            scenes.loads(SCENE, parameters=parameters)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        # keys and types
        (
            "young_modulus",
            "yong_modulus",
            "scene:11: bodies.beam.material.yong_modulus: .* did you mean 'young_modulus'",
        ),
        ("joints:", "joint:", "scene:15: joint: expected one of the keys .* did you mean 'joints'"),
        (
            "type: cable",
            "type: cabel",
            "scene:7: bodies.beam.type: expected one of beam, cable, matrices, part, plate, point_mass, "
            "rigid, rigid_plate, shell, solid, got "
            "'cabel'; did you mean 'cable'",
        ),
        (
            "type: cable",
            "type: beam\n    twist: 1",
            "twist: expected none, got one in the plane, where z of the section is to the left of the line; delete it",
        ),
        (
            "    type: cable\n",
            "",
            "scene:6: bodies.beam: expected the key 'type', got no such key; write one of beam, cable, matrices, part, plate, point_mass",
        ),
        ("type: pin", "type: pni", "scene:16: joints.hinge.type: .* did you mean 'pin'"),
        (
            "moment: 3 N m",
            "mom: 3 N m",
            "scene:22: loads.twist.moment: expected the key 'moment', got no such key; add a moment",
        ),
        ("color: strain", "color: strian", "scene:32: pictures.color: .* did you mean 'strain'"),
        ("dimension: 2", "dimension: 4", "scene:3: dimension: expected 2 or 3, got 4"),
        (
            "dimension: 2",
            "dimension: 3",
            r"scene:13: bodies.beam.rotation: expected a rotation in space",
        ),
        (
            "coarse: [5]",
            "coarse: [5, x, 0]",
            r"scene:31: compare.coarse\[1\]: expected a whole number, got 'x'",
        ),
        (
            "coarse: [5]",
            "coarse: [5, x, 0]",
            r"scene:31: compare.coarse\[2\]: expected a number >= 1, got 0",
        ),
        (
            "pictures: {",
            "pictures: 3 # {",
            "scene:32: pictures: expected a mapping of instants, color, got 3",
        ),
        ("bodies:", "units: mm\nbodies:", "scene:5: units: expected 'SI', got 'mm'"),
        # versions
        (
            "schema: 1",
            "schema: 2",
            "scene:1: schema: expected schema version 1, got 2; install a newer fmbs_skfem",
        ),
        ("schema: 1", "schema: one", "scene:1: schema: expected schema version 1, got 'one'"),
        ("schema: 1\n", "", "scene:1: expected the key 'schema' .* add 'schema: 1'"),
        # quantities
        (
            "diameter: d",
            "diameter: 210 GPa",
            r"scene:9: .*diameter: expected a length \[m\], got '210 GPa' \(pressure\)",
        ),
        ("diameter: d", "diameter: E", r"expected a length \[m\], got 'E' \(pressure\)"),
        (
            "diameter: d",
            "diameter: -1 mm",
            r"scene:9: bodies.beam.section.diameter: expected a length \[m\] > 0, got '-1 mm'",
        ),
        (
            "2 * E",
            "0",
            r"scene:11: bodies.beam.material.young_modulus: expected a pressure \[Pa\] > 0, got 0",
        ),
        (
            "1800 kg/m^3",
            "-1800",
            r"scene:12: bodies.beam.material.density: expected a density \[kg/m\^3\] > 0, got -1800",
        ),
        (
            "mass: 2 kg",
            "mass: .nan",
            "scene:14: bodies.mass.mass: expected a finite number, got nan",
        ),
        (
            "rho_inf: 0.8",
            "rho_inf: 1.8",
            "scene:26: analysis.rho_inf: expected a number >= 0 and <= 1, got 1.8",
        ),
        (
            "[1 m, 0]",
            "[1 m, 0, 0]",
            r"scene:14: bodies.mass.position: expected a list of 2 \(x, y\)",
        ),
        ("1 GPa,", "2 * Q,", "scene:4: parameters.E: expected one of the names pi, got 'Q'"),
        (
            "1 GPa,",
            "2 * tip.x,",
            "scene:4: parameters.E: expected one of the names pi, got 'tip.x'; outputs are read by loads such as",
        ),
        ("Ts: 1.5 s", "t: 1.5 s", "scene:4: parameters.t: expected a name"),
        # expressions
        (
            "where(t < Ts, t / Ts, 1)",
            "t.__class__",
            r"scene:21: loads.push.history: .* where\(condition, then, else\)",
        ),
        ("where(t < Ts, t / Ts, 1)", "lambda: 1", r"where\(condition, then, else\)"),
        ("where(t < Ts, t / Ts, 1)", "9**9**9**9", "finite"),
        ("where(t < Ts, t / Ts, 1)", "t / (Ts - 1.5) * (1 / (Ts - 1.5))", "finite"),
        # references
        (
            "at: beam.left",
            "at: beem.left",
            "scene:16: joints.hinge.at: .* got the body 'beem'; did you mean 'beam'",
        ),
        (
            "at: beam.right, to",
            "at: beam, to",
            "scene:18: joints.link.at: expected a point of the body 'beam'",
        ),
        (
            "at: mass",
            "at: mass.left",
            "scene:17: joints.hook.at: expected the point mass 'mass' as a whole",
        ),
        ("s: 300 mm", "s: 300 N", "scene:17: joints.hook.to: expected a length"),
        (
            "to: [2 m, 0]",
            "to: ground",
            "scene:18: joints.link.to: expected a place or the coordinates",
        ),
        ("joint: hinge", "joint: hing", "scene:29: outputs.force.joint: .* did you mean 'hinge'"),
        (
            "{mass: {velocity",
            "{mas: {velocity",
            "scene:25: initial.bodies.mas: .* did you mean 'mass'",
        ),
        (
            "two: [mass]",
            "two: [beam]",
            r"scene:30: reduction.components.two\[0\]: expected every body in one component",
        ),
        (
            "two: [mass]",
            "two: []",
            "scene:30: reduction.components: expected every body in a component, got none for mass",
        ),
        ("modes: {one: 5}", "modes: {three: 5}", "scene:30: reduction.modes.three"),
        (
            "modes: {one: 5}",
            "modes: {one: 0}",
            "scene:30: reduction.modes.one: expected a number >= 1, got 0",
        ),
        (
            "step: 1 ms, rho",
            "step: 9 s, rho",
            "scene:26: analysis.step: expected a step of at most the duration 3 s, got 9 s",
        ),
        (
            "  mass: {type",
            "  ground: {type",
            "scene:14: bodies.ground: .* it stands for the fixed frame",
        ),
        ("  tip: {", "  tip x: {", "scene:28: outputs.tip x: expected a name of letters"),
        (
            "mesh: ../",
            "degree: 2\n    continuity: 2\n    mesh: ../",
            "scene:9: bodies.beam.continuity: expected a continuity below",
        ),
        (
            "mesh: ../",
            "degree: 4\n    interpolation: ancf\n    mesh: ../",
            "scene:9: bodies.beam.interpolation: expected degree 3",
        ),
    ],
)
def test_refused_with_place(before: str, after: str, message: str) -> None:
    lines = refused(changed(before, after))
    expected = pytest.RaisesExc(InputError, match=message)
    assert any(expected.matches(InputError(line)) for line in lines), lines


def test_all_problems_at_once_in_the_order_of_the_file() -> None:
    text = (
        changed("diameter: d", "diameter: 3 s")
        .replace("mass: 2 kg", "mass: -2 kg")
        .replace("rho_inf: 0.8", "rho: 0.8")
    )
    assert [line.split(": expected")[0] for line in refused(text)] == [
        "scene:9: bodies.beam.section.diameter",
        "scene:14: bodies.mass.mass",
        "scene:26: analysis.rho",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "3",
        "[1, 2]",
        "schema: 1",
        "{schema: 1, bodies: {}, analysis: {type: modes}}",
        "schema: 1\nbodies:\nanalysis:\n",
    ],
)
def test_incomplete_scenes(text: str) -> None:
    assert refused(text)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("1800 kg/m^3", "7.85e-9", "bodies.beam.material: the wave speed .* SI units"),
        (
            "rotation: 30 deg",
            "rotation: 90",
            "bodies.beam.rotation: an angle of 90 rad is more than one turn: write '90 deg'",
        ),
        (
            "hinge: {type: pin, at: beam.left, to: ground}",
            "hinge: {type: driven_angle, at: beam.left, angle: 90}",
            "joints.hinge.angle: an angle of 90 rad",
        ),
    ],
)
def test_hardly_meant(before: str, after: str, message: str) -> None:
    with pytest.warns(Notice, match=message):
        scenes.loads(changed(before, after))


def test_plausible_values_give_no_notice() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scenes.loads(SCENE)
        scenes.loads(changed("rotation: 30 deg", "rotation: 360 deg"))
        turn = "hinge: {type: driven_angle, at: beam.left, angle: 90 deg}"
        scene = scenes.loads(changed("hinge: {type: pin, at: beam.left, to: ground}", turn))
    drive = scene.joints["hinge"]
    assert isinstance(drive, joints.DrivenAngle)
    assert drive.angle(1.0) == math.pi / 2


ROTATION = "{axis: [0, 0, 1], angle: 90 deg}"


def test_space_needs_vectors() -> None:
    text = """\
schema: 1
bodies:
  I:
    {type: cable, mesh: m.msh, section: {shape: given, EA: 1 kN, EI: 2 N m^2, rhoA: 0.1 kg/m},
     rotation: {axis: [0, 0, 1], angle: 90 deg}}
joints: {A: {type: driven_angle, at: I.A, angle: t, axis: [0, 1, 0]}}
loads: {f: {type: follower, at: I.A, force: 3 N}, m: {type: moment, at: I.A, moment: [0, 0, 1 N m]}}
analysis: {type: static}
"""
    scene = scenes.loads(text)
    assert getattr(scene.loads["f"], "force", None) == (3.0,)
    assert getattr(scene.loads["m"], "moment", None) == (0.0, 0.0, 1.0)
    for before, after, message in (
        ("axis: [0, 1, 0]", "", "axis"),
        ("[0, 0, 1 N m]", "1 N m", "a list of 3"),
        ("axis: [0, 0, 1]", "axis: [0, 0, 0]", "not zero"),
        (ROTATION, "[[0, -1, 0], [1, 0, 0], [0, 0, 1]]", "got a matrix; say it by axis and angle"),
        (
            ROTATION,
            "[[0, 1, 0], [1, 0, 0], [0, 0, 1]]",
            "got a matrix that mirrors; a mirrored body is another one",
        ),
        (ROTATION, "[[0, 1, 0], [1, 0, 0]]", "rotation in space such as .*, got a list of 2"),
        (
            "EI: 2 N m^2",
            "EI: 2 N m",
            r"expected a bending stiffness \[N m\^2\], got '2 N m' \(moment\)",
        ),
    ):
        with pytest.raises(InputError, match=message):
            scenes.loads(text.replace(before, after))


def test_published_schema() -> None:
    """The JSON schema names every key of the examples, and quantities with their dimension."""
    published = scenes.json_schema()
    assert json.loads(json.dumps(published)) == published
    assert set(published["required"]) == {"schema", "bodies", "analysis"}
    assert published["additionalProperties"] is False
    section = published["$defs"]["Circular"]["properties"]["diameter"]
    assert section["anyOf"] == [{"type": "number", "exclusiveMinimum": 0}, {"type": "string"}]
    assert str(units.LENGTH) in section["description"]
    assert set(published["$defs"]["Cable"]["properties"]) == {"type", *entries(schema.Cable)}
