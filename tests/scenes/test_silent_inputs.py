"""Scenes that used to be taken for others without a word: every one is refused, or a notice says
what is made of it.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.bodies import body, plate, rigid, sections
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values import ranges
from fmbs_skfem.reduction import parameters
from fmbs_skfem.results import sweep_files
from fmbs_skfem.scenes import build, times
from fmbs_skfem.scenes import field_kinds as fields
from fmbs_skfem.shapes import meshes, plate_meshes
from fmbs_skfem.systems import System

from ..systems.rigid_parts import grid

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

PLANAR = """\
schema: 1
dimension: 2
parameters: {L: 10 mm, f: 1 Hz, w: 3 rad/s, T: 2 s, F: 4 N, n: 3}
bodies:
  beam:
    type: cable
    mesh: ../meshes/beam_10.msh
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 1 GPa, density: 1800}
  disc: {type: rigid, mass: 1 kg, inertia: 0.01, center: [2, 0]}
joints:
  clamp: {type: clamp, at: beam.left}
  hub: {type: revolute, at: disc.frame, to: ground}
loads:
  push: {type: point_force, at: beam.right, force: [0, 1 N], history: "1"}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
outputs:
  tip: {type: position, at: beam.right}
"""

SPATIAL = """\
schema: 1
bodies:
  beam:
    type: cable
    mesh: ../meshes/beam_10.msh
    section: {shape: rectangular, width: 20 mm, height: 2 mm}
    material: {young_modulus: 1 GPa, density: 1800}
joints:
  clamp: {type: clamp, at: beam.left}
analysis: {type: static}
"""


def system(text: str) -> System:
    return build.system(scenes.loads(text, EXAMPLES))


def changed(text: str, *pairs: tuple[str, str]) -> str:
    for before, after in pairs:
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    return text


def test_a_flat_section_in_space_is_refused() -> None:
    """A cable in space has one bending stiffness: 20 x 2 mm bends ten times as far one way as the
    other.
    """
    with pytest.raises(
        InputError,
        match=r"scene:6: bodies\.beam\.section: .*same bending stiffness.* give EA, EI and rhoA",
    ):
        scenes.loads(SPATIAL, EXAMPLES)
    for allowed in (
        "{shape: rectangular, width: 2 mm, height: 2 mm}",
        "{shape: given, EA: 1 kN, EI: 2 N m^2, rhoA: 0.1}",
    ):
        system(SPATIAL.replace("{shape: rectangular, width: 20 mm, height: 2 mm}", allowed))
    system(changed(SPATIAL, ("schema: 1", "schema: 1\ndimension: 2")))


def test_a_flat_section_in_space_is_refused_in_python() -> None:
    flat, mesh = (
        sections.Rectangular(0.02, 0.002),
        meshes.read(EXAMPLES.parent / "meshes" / "beam_10.msh"),
    )
    steel = sections.Material(2e11, 7800.0)
    assert body.cable("strip", mesh, flat, steel, dim=2).cells is not None
    with pytest.raises(
        InputError, match="body 'strip': expected a section of the same bending stiffness"
    ):
        body.cable("strip", mesh, flat, steel, dim=3)


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        (
            "  tip_x: {type: position, at: beam.left, component: x}\n",
            r"scene:19: .*'tip_x'.*'tip_x', which is also one of 'tip'",
        ),
        (
            "  e: {type: energy}\n  e_strain: {type: angle, at: disc.frame}\n",
            "'e_strain'.*'e_strain', which is also one of 'e'",
        ),
        ("  t: {type: angle, at: disc.frame}\n", "output 't': .* got 't', which is also the time"),
        (
            "  hub: {type: reaction, joint: hub}\n  hub_y: {type: angle, at: disc.frame}\n",
            "'hub_y': .* got 'hub_y', which is also one of 'hub'",
        ),
    ],
)
def test_columns_of_equal_name_are_refused(outputs: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        system(PLANAR + outputs)


def test_one_component_takes_no_column_of_another_output() -> None:
    """`end` alone is the column of the component y: a column `end_x` of another output is free."""
    found = system(
        PLANAR
        + "  end: {type: position, at: beam.right, component: y}\n  end_x: {type: angle, at: disc.frame}\n"
    )
    assert found.outputs["end"].columns == ("end",)
    assert found.outputs["end_x"].columns == ("end_x",)


def test_columns_of_equal_name_are_refused_in_python() -> None:
    found = system(PLANAR)
    twice = replace(found, outputs={"tip": found.outputs["tip"], "other": found.outputs["tip"]})
    motion = dynamics.integrate(
        build.assembly.eliminate(twice), dynamics.GeneralizedAlpha(1e-3), 1e-3
    )
    with pytest.raises(
        InputError,
        match="output 'other': expected columns of its own, got 'tip_x', which is also one of 'tip'",
    ):
        dynamics.outputs(motion)


def drive(motion: str, key: str = "displacement") -> str:
    """The planar scene with a function of time in it."""
    if key == "history":
        return changed(PLANAR, ('history: "1"', f'history: "{motion}"'))
    joint = f'{{type: driven_angle, at: beam.left, angle: "{motion}"}}'
    if key == "displacement":
        joint = f'{{type: driven_position, at: beam.left, displacement: ["{motion}", 0]}}'
    return changed(PLANAR, ("{type: clamp, at: beam.left}", joint))


@pytest.mark.parametrize(
    "value",
    [
        "1 Hz",
        "f",
        "2 * f",
        "f + 1 / T",
        "f * n",
        "sqrt(4) * f",
        "where(f > 2 / T, f, f)",
        "5 kHz",
        "max(f, 1 / T)",
    ],
)
def test_turns_are_no_radians(value: str) -> None:
    """1 Hz is 2 pi rad/s and not 1 rad/s."""
    value = value if value[0].isdigit() else f'"{value}"'
    with pytest.raises(
        InputError,
        match=r"expected an angular velocity \[rad/s\], got .*hertz; 1 Hz is 6\.283185307 rad/s",
    ):
        scenes.loads(
            PLANAR + f"initial: {{bodies: {{disc: {{angular_velocity: {value}}}}}}}\n", EXAMPLES
        )


@pytest.mark.parametrize(
    ("value", "number"),
    [
        ("2 * pi * f", 2 * np.pi),
        ("f * 2 * pi", 2 * np.pi),
        ("w", 3.0),
        ("1 / T", 0.5),
        ("1 1/s", 1.0),
        ("60 rpm", 2 * np.pi),
        ("2 * pi / T", np.pi),
        ("10 / pi", 10 / np.pi),
        ("w * (f / (2 * f))", 1.5),
    ],
)
def test_angular_velocities(value: str, number: float) -> None:
    scene = scenes.loads(
        PLANAR + f"initial: {{bodies: {{disc: {{angular_velocity: {value}}}}}}}\n", EXAMPLES
    )
    assert scene.initial.bodies["disc"].angular_velocity == pytest.approx(number, rel=1e-15)


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("displacement", "T * sin(w * t)", "expected a length .* as a function of t, got .*time"),
        ("displacement", "F", "force"),
        ("displacement", "0.5 * F * sin(w * t)", "force"),
        ("displacement", "L * t", r"m s"),
        ("displacement", "L * sin(L * t)", r"a number or an angle in sin\(...\)"),
        ("displacement", "L * sin(2 * pi * T * t)", r"a number or an angle in sin\(...\)"),
        ("displacement", "L * sin(f * t)", "hertz; 1 Hz is"),
        ("displacement", "where(t < L, 0, L)", "all parts of '<' of one dimension"),
        ("displacement", "L + T", "of one dimension"),
        ("displacement", "L * 2**T", "a number as exponent"),
        ("angle", "L * t", "expected an angle"),
        ("angle", "f * t", "hertz; 1 Hz is"),
        ("angle", "w", r"expected an angle .* got 'w' \(angular velocity\)"),
        ("history", "F * sin(w * t)", "expected a number as a function of t, got .*force"),
        ("history", "exp(-T * t)", r"a number or an angle in exp\(...\)"),
        ("history", "T", "time"),
        ("history", "min(t / T, L)", "of one dimension"),
    ],
)
def test_a_parameter_of_a_wrong_dimension_in_a_function_of_time(
    key: str, text: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        scenes.loads(drive(text, key), EXAMPLES)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("displacement", "0.1 * t"),
        ("displacement", "t"),
        ("displacement", "L * sin(5 * t)"),
        ("displacement", "L * sin(2 * pi * f * t)"),
        ("displacement", "L * (1 - cos(w * t)) / 2"),
        ("displacement", "L * sin(2 * pi * t / T)"),
        ("displacement", "L * sin(2 * pi * 5 * T)"),
        ("displacement", "where(t < T, L * (t / T - sin(2 * pi * t / T) / (2 * pi)), L)"),
        ("displacement", "0.5 * L * t"),
        ("displacement", "0.01 + L * t / T"),
        ("displacement", "n * L * (t / T)**2"),
        ("displacement", "L * exp(-t / T) * sqrt(t / T)"),
        ("displacement", "max(0, t - T)"),
        ("angle", "w * t"),
        ("angle", "2 * pi * f * t"),
        ("angle", "0.8 * (1 - cos(pi * t))"),
        ("angle", "90 deg"),
        ("angle", "0.5 * t**2"),
        ("history", "where(t < T, t / T, 1)"),
        ("history", "where(t < 0.1, sin(pi * t / 0.2)**2, 1)"),
        ("history", "5 * (t - T)"),
        ("history", "exp(-t)"),
        ("history", "n * t"),
        ("history", "1 + t"),
        ("history", "(t / 0.5)**n"),
    ],
)
def test_functions_of_time_of_right_dimensions(key: str, text: str) -> None:
    assert scenes.loads(drive(text, key), EXAMPLES).joints


def test_the_load_factor_of_statics_is_no_time() -> None:
    text = changed(
        drive("L * t"), ("{type: dynamic, duration: 10 ms, step: 1 ms}", "{type: static}")
    )
    assert scenes.loads(text, EXAMPLES).joints


GIVEN = "section: {shape: given, EA: 1 kN, EI: 2 N m^2, rhoA: 0.1}"
SPRING = "  spring: {type: torsion_spring, at: disc.frame, stiffness: 1, damping: 0.1}\n"
STATIC, MODES = "{type: static}", "{type: modes, about: reference}"


def told(text: str, parameters: dict[str, float | str] | None = None) -> list[str]:
    """The notices of a scene."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scenes.loads(text, EXAMPLES, parameters)
    return [str(one.message) for one in caught if issubclass(one.category, Notice)]


def with_analysis(analysis: str) -> str:
    return changed(
        PLANAR,
        ("{type: dynamic, duration: 10 ms, step: 1 ms}", analysis),
        ("loads:\n", "loads:\n" + SPRING),
    )


@pytest.mark.parametrize(
    ("text", "notice"),
    [
        (
            changed(PLANAR, ("section: {shape: circular, diameter: 10 mm}", GIVEN)),
            "scene:9: bodies.beam.material: does nothing",
        ),
        (
            with_analysis(STATIC) + "initial: {bodies: {disc: {velocity: [1, 0]}}}\n",
            "initial: does nothing, an equilibrium has no",
        ),
        (
            with_analysis(STATIC) + "damping: {mass: 1 1/s}\n",
            "scene:20: damping: does nothing, an equilibrium is not damped",
        ),
        (
            with_analysis(STATIC),
            "scene:15: loads.spring.damping: does nothing, an equilibrium is not damped",
        ),
        (
            with_analysis(MODES),
            "loads: modes are those of the unloaded reference, in which these do nothing: push",
        ),
        (
            with_analysis(MODES) + "damping: {stiffness: 1 ms}\n",
            "scene:20: damping: does nothing, a vibration mode is not damped",
        ),
        (
            with_analysis(MODES) + "initial: {bodies: {disc: {velocity: [1, 0]}}}\n",
            "initial: does nothing, a vibration mode has no",
        ),
        (with_analysis(MODES), "outputs: do nothing, an analysis of modes has none: tip"),
    ],
)
def test_keys_without_effect_are_told(text: str, notice: str) -> None:
    assert sum(notice in one for one in told(text)) == 1, told(text)


def test_keys_with_effect_are_not_told() -> None:
    assert (
        told(PLANAR + "damping: {mass: 1 1/s}\ninitial: {bodies: {disc: {velocity: [1, 0]}}}\n")
        == []
    )
    assert (
        told(changed(PLANAR, ("type: dynamic, duration: 10 ms, step: 1 ms", "type: static"))) == []
    )


def test_a_changed_parameter_that_nothing_uses_is_told() -> None:
    text = changed(
        PLANAR, ("n: 3}", "n: 3, a: 2 * n, b: 3 * a, c: 4 * n}"), ("inertia: 0.01", "inertia: b")
    )
    unused = "nothing in the scene uses this parameter"
    for name in ("n", "a", "b"):
        assert told(text, {name: 2.0}) == []
    (notice,) = told(text, {"c": 1.0})
    assert notice.startswith(f"scene:3: parameters.c: {unused}")
    assert told(text) == []
    ranged = changed(text, ("w: 3 rad/s", "w: {value: 3 rad/s, range: [1 rad/s, 4 rad/s]}"))
    assert [one.split(": ", 2)[1] for one in told(ranged)] == ["parameters.w"]
    assert told(changed(ranged, ('history: "1"', 'history: "sin(w * t)"'))) == []


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "step: 1 ms}",
            "step: 1 ms, tolerance: 0.1}",
            r"scene:16: analysis\.tolerance: expected a number > 0 and < 0\.01, got 0\.1",
        ),
        (
            "type: dynamic, duration: 10 ms, step: 1 ms",
            "type: static, tolerance: 2",
            r"analysis\.tolerance: expected a number > 0",
        ),
        (
            "outputs:",
            "reduction: {snapshots: 1 ms, tolerance: 1}\noutputs:",
            r"scene:17: reduction\.tolerance: .* < 1, got 1",
        ),
        (
            "outputs:",
            "reduction: {snapshots: 1 ms, hyper_reduction: {tolerance: 5}}\noutputs:",
            r"scene:17: reduction\.hyper_reduction\.tolerance: .* < 1, got 5",
        ),
        (
            "outputs:",
            "compare: {tolerances: [1e-8, 3]}\noutputs:",
            r"scene:17: compare\.tolerances\[1\]: .* < 1, got 3",
        ),
    ],
)
def test_tolerances_out_of_range_are_refused_with_their_line(
    before: str, after: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        scenes.loads(changed(PLANAR, (before, after)), EXAMPLES)


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        (
            "bodies: {}",
            r"scene:3: bodies: expected at least 1 entry, got none; write 'name: \{\.\.\.\}' for each",
        ),
        (
            "bodies: []",
            "scene:3: bodies: expected a mapping of names, got a list of 0; write 'name: ...' for each",
        ),
        (
            "bodies:",
            "scene:3: bodies: expected a mapping of names, got nothing; write 'name: ...' for each",
        ),
    ],
)
def test_a_scene_without_bodies_is_told_so(bodies: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scenes.loads(f"schema: 1\ndimension: 2\n{bodies}\nanalysis: {{type: modes}}\n", EXAMPLES)


def test_of_many_names_the_closest_are_listed() -> None:
    """Names of one series are no guess at what was meant."""
    points = "".join(
        f"  b{k}: {{type: point_mass, mass: 1, position: [{k}, 0]}}\n" for k in range(50)
    )
    text = f"schema: 1\ndimension: 2\nbodies:\n{points}  frame: {{type: point_mass, mass: 1, position: [-1, 0]}}\n"
    with pytest.raises(InputError) as caught:
        scenes.loads(
            text + "joints: {j: {type: pin, at: b51}}\nanalysis: {type: modes}\n", EXAMPLES
        )
    assert str(caught.value).count(" b") == 7  # the bodies, five names, the body
    assert "... (51 in all), got the body 'b51'" in str(caught.value)
    assert "did you mean" not in str(caught.value)
    with pytest.raises(InputError, match="did you mean 'frame'"):
        scenes.loads(
            text + "joints: {j: {type: pin, at: frmae}}\nanalysis: {type: modes}\n", EXAMPLES
        )


def test_snapshots_hold_both_ends() -> None:
    """The last instant of a motion is a snapshot where the interval divides the duration, in
    numbers and in spans.
    """
    np.testing.assert_array_equal(times.snapshots(5e-3, 1e-3, 20e-3), [0, 5, 10, 15, 20])
    np.testing.assert_array_equal(times.snapshots(20e-3, 1e-3, 20e-3), [0, 20])
    np.testing.assert_array_equal(times.snapshots(1e-3, 1e-3, 3e-3), [0, 1, 2, 3])
    spans = (fields.Span(2e-3, 4e-3), fields.Span(8e-3))
    np.testing.assert_array_equal(times.snapshots(spans, 1e-3, 20e-3), [0, 2, 4, 12, 20])
    scene = scenes.loads(PLANAR + "reduction: {snapshots: 2 ms}\n", EXAMPLES)
    np.testing.assert_array_equal(build.snapshot_steps(scene), [0, 2, 4, 6, 8, 10])


def test_snapshots_between_steps_are_refused_with_their_line() -> None:
    text = changed(PLANAR, ("outputs:", "reduction: {snapshots: 1.5 ms}\noutputs:"))
    with pytest.raises(
        InputError,
        match=r"scene:17: reduction\.snapshots: .* a multiple of the step 0\.001 s, got 0\.0015 s",
    ):
        scenes.loads(text, EXAMPLES)


@pytest.mark.parametrize(
    ("text", "notice"),
    [
        (
            changed(PLANAR, ("[0, 1 N]", '[0, "10 * sin(30)"]')),
            r"scene:15: loads.push.force.1: sin(30) takes radians",
        ),
        (
            drive("0.01 * cos(-90.0) * t"),
            "scene:12: joints.clamp.displacement.0: cos(-90.0) takes radians",
        ),
        (
            changed(PLANAR, ("n: 3}", "n: 3, a: tan(45)}")),
            "scene:3: parameters.a: tan(45) takes radians",
        ),
        (
            PLANAR + "reduction: {snapshots: 50 ms}\n",
            "reduction.snapshots: 0.05 s leave no snapshot but the start of a motion of",
        ),
        (
            changed(PLANAR, ("loads:\n", "loads:\n  s: {type: torsion_spring, at: disc.frame}\n")),
            "loads.s: does nothing without stiffness or",
        ),
        (
            changed(PLANAR, ("step: 1 ms", "step: 1 ms, every: [{until: 5 ms, every: 1 ms}]")),
            "analysis.every: 'until: 0.005 s' of the last span does nothing, it lasts to the end at 0.01 s",
        ),
    ],
)
def test_hardly_meant(text: str, notice: str) -> None:
    assert [one for one in told(text) if notice in one.replace("[1]", ".1").replace("[0]", ".0")], (
        told(text)
    )


def test_a_drive_of_what_a_point_holds_may_tilt() -> None:
    """A planar hinge made of a pin is a spherical joint in space."""
    drive = "  motor: {type: driven_angle, at: beam.left, axis: [0, 0, 1], angle: t}\n"
    text = changed(
        SPATIAL,
        ("rectangular, width: 20 mm, height: 2 mm", "circular, diameter: 2 mm"),
        ("{type: static}", "{type: dynamic, duration: 1 ms, step: 1 ms}"),
    )
    pinned = changed(
        text,
        (
            "clamp: {type: clamp, at: beam.left}",
            "hinge: {type: pin, at: beam.left, to: ground}\n" + drive,
        ),
    )
    (notice,) = told(pinned)
    assert "joints.motor: drives one angle of 'beam', which 'hinge' holds at a point only" in notice
    assert (
        told(
            changed(
                pinned,
                ("type: pin, at: beam.left", "type: revolute, axis: [0, 0, 1], at: beam.left"),
            )
        )
        == []
    )


def test_sines_of_less_than_a_turn_are_not_told() -> None:
    assert (
        told(
            changed(
                PLANAR,
                ("[0, 1 N]", '[0, "10 * sin(1.5) + cos(6)"]'),
                ('history: "1"', 'history: "sin(30 * t)"'),
            )
        )
        == []
    )


def test_a_point_of_a_mesh_does_not_stand_for_the_centre_of_mass(tmp_path: Path) -> None:
    """A group `center` elsewhere on the plate took the place of the centre of mass."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    for name, refused in (("center", True), ("frame", True), ("corner", False)):
        mesh = plate_meshes.PlateMesh(
            square, np.array([[0, 1, 2, 3]]), {name: np.array([2])}, {}, {}
        )
        if refused:
            with pytest.raises(
                InputError,
                match=f"no other place than the centre of mass .* got '{name}' 0.707107 m away",
            ):
                rigid.rigid_from_mesh("wheel", mesh, 0.01, 1000.0, dim=2)
        else:
            assert "corner" in rigid.rigid_from_mesh("wheel", mesh, 0.01, 1000.0, dim=2).places


def test_a_rim_does_not_hide_a_point_of_its_name() -> None:
    shape = grid(2, 2)
    assert "corner" in shape.points
    with pytest.raises(
        InputError,
        match="names of rims and points that differ, got the rim 'corner' beside a point",
    ):
        plate.plate(
            "sheet",
            shape,
            0.01,
            sections.Material(1e5, 500.0),
            dim=2,
            rims={"corner": plate.Rim(("left",))},
        )


def test_a_parameter_with_the_header_of_another_column_is_refused() -> None:
    """A range of `status` was replaced by the status of the members in sweep.csv."""
    plain = parameters.Parameter("status", 0.0, 1.0, parameters.Scale.LINEAR, "", None)
    with pytest.raises(
        InputError,
        match="parameter 'status': expected another name than member, status, reason, message",
    ):
        sweep_files.check_names([plain])
    sweep_files.check_names([replace(plain, name="E"), replace(plain, unit="Pa")])


def test_a_body_that_moves_and_turns_needs_its_center() -> None:
    """Far from the origin of the scene its centre would get velocity + angular_velocity x r: 5 m/s
    and not 1 m/s here.
    """
    text = """
schema: 1
dimension: 2
bodies: {disc: {type: rigid, mass: 1 kg, inertia: 1 kg m^2, center: [0, -2 m]}}
initial: {bodies: {disc: {velocity: [1 m/s, 0], angular_velocity: 2 rad/s%s}}}
analysis: {type: dynamic, duration: 0.1 s, step: 1 ms}
outputs: {disc: {type: velocity, at: disc}}
"""
    with pytest.warns(
        Notice,
        match="initial.bodies.disc: the velocity is that of the body's point at the origin .* write .center.",
    ):
        adrift = scenes.loads(text % "").run()
    assert dynamics.outputs(adrift.motion)["disc_x"][0] == pytest.approx(5.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        at_origin = scenes.loads(text.replace("[0, -2 m]", "[0, 0]") % "").run()
        meant = scenes.loads(text % ", center: [0, -2 m]")
    assert dynamics.outputs(at_origin.motion)["disc_x"][0] == pytest.approx(1.0)
    assert dynamics.outputs(meant.run().motion)["disc_x"][0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "word",
    ["motor", "spring_damper", "constant_force", "rope", "stop", "torsion_spring", "bushing"],
)
def test_loads_without_strength_are_named(word: str) -> None:
    """All of their strengths are optional, one at least is meant."""
    between = (
        ""
        if word in ("motor", "torsion_spring")
        else ", to: far" + ", direction: [1, 0]" * (word == "stop")
    )
    text = f"""
schema: 1
dimension: 2
bodies:
  disc: {{type: rigid, mass: 1 kg, inertia: 1 kg m^2, center: [0, 0]}}
  far: {{type: rigid, mass: 1 kg, inertia: 1 kg m^2, center: [1, 0]}}
loads: {{idle: {{type: {word}, at: disc{between}}}}}
analysis: {{type: dynamic, duration: 0.1 s, step: 1 ms}}
"""
    with pytest.warns(Notice, match="loads.idle: does nothing without"):
        scenes.loads(text)


def test_tables_without_units_in_their_titles_are_in_those_of_the_scene(tmp_path: Path) -> None:
    """`unit: kN, of: ms`: numbers are not taken for N and s."""
    (tmp_path / "wave.csv").write_text("time, force\n0, 0\n10, 2\n")
    text = """\
schema: 1
dimension: 2
tables: {wave: {file: wave.csv, unit: kN, of: ms, hold: true}}
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, 0]}}
loads: {push: {type: control_force, at: ball, direction: [1, 0], force: wave(t)}}
analysis: {type: dynamic, duration: 20 ms, step: 1 ms}
"""
    table = scenes.loads(text, tmp_path).tables["wave"].table
    assert table is not None
    assert (table.times, table.values) == ((0.0, 0.01), (0.0, 2000.0))
    with pytest.raises(InputError, match=r"expected a table from 0 to 0\.02 s"):
        scenes.loads(text.replace(", hold: true", ""), tmp_path)


def test_inputs_in_other_than_si_units_are_told() -> None:
    with pytest.warns(
        Notice, match=r"inputs\.u: plain numbers are in N, not in kN: write `unit: N`"
    ):
        scenes.loads(PLANAR + "inputs: {u: {unit: kN, start: 5}}\n", EXAMPLES)


@pytest.mark.parametrize(
    "moment, lost", [("[0.1, 0, 0]", "0.1"), ("[0.1, 0.05, 0]", "0.1"), ("[0, 0.05, 0.02]", None)]
)
def test_moments_about_the_line_of_a_cable_are_named(moment: str, lost: str | None) -> None:
    text = f"""
schema: 1
bodies:
  beam:
    type: cable
    mesh: beam_10.msh
    section: {{shape: circular, diameter: 10 mm}}
    material: {{young_modulus: 1 GPa, density: 1800}}
joints: {{root: {{type: clamp, at: beam.left}}}}
loads: {{turn: {{type: moment, at: beam.right, moment: {moment}}}}}
analysis: {{type: static, load_steps: 2}}
"""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        build.system(scenes.loads(text, EXAMPLES.parent / "meshes"))
    told = [
        str(one.message)
        for one in caught
        if "about the line itself and do nothing" in str(one.message)
    ]
    text = f"load 'turn': {lost} N m of the moment are about the line itself and do nothing: a cable has no torsion"
    assert told == ([text] if lost else [])


CYLINDER = "contact_cylinder, body: beam, center: [0, -1], diameter: 1 m"


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            f"loads: {{k: {{type: {CYLINDER}, length: 1 m}}}}",
            "loads.k.length: does nothing in the plane",
        ),
        (
            "loads: {k: {type: contact_box, body: beam, center: [0, -1], sides: [1, 1], along: [1, 0], across: [0, 1]}}",
            "loads.k.across: does nothing in the plane",
        ),
        (
            f"loads: {{k: {{type: {CYLINDER}, sticking: 1 kN/m}}}}",
            "loads.k.sticking: does nothing without friction",
        ),
        (
            f"loads: {{k: {{type: {CYLINDER}, sticking_damping: 1 N s/m}}}}",
            "loads.k.sticking_damping: does nothing without friction",
        ),
        (
            f"loads: {{k: {{type: {CYLINDER}, depth: 1 mm}}}}",
            "loads.k.depth: does nothing without an exponent",
        ),
        (
            "loads: {b: {type: bushing, at: disc.frame, to: disc.center, stiffness: [1, 1]}}",
            "loads.b: does nothing, as both of its places are on the rigid body 'disc'",
        ),
        (
            "controllers: {c: {type: measurement, sample: 20 ms, of: tip.y / (1 m)}}",
            "controllers.c.sample: is longer than the motion",
        ),
    ],
)
def test_keys_and_loads_of_no_effect_are_told(section: str, message: str) -> None:
    text = changed(
        PLANAR,
        (
            'loads:\n  push: {type: point_force, at: beam.right, force: [0, 1 N], history: "1"}\n',
            f"{section}\n",
        ),
    )
    with pytest.warns(Notice, match=message):
        scenes.loads(text, EXAMPLES)


def test_keys_with_an_effect_are_not_told() -> None:
    keys = "friction: 0.2, sticking: 1 kN/m, sticking_damping: 1 N s/m, exponent: 1.5, depth: 1 mm"
    held = "b: {type: spring_damper, at: beam.right, to: beam.left, stiffness: 1}"
    text = changed(PLANAR, ("loads:\n", f"loads:\n  k: {{type: {CYLINDER}, {keys}}}\n  {held}\n"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        scenes.loads(text, EXAMPLES)


@pytest.mark.parametrize("name", [r"a\nb", "=1+1", "../a", "a b", "1"])
def test_names_of_events_are_names(name: str) -> None:
    text = PLANAR + f'events:\n  "{name}": {{when: tip.y + 1 mm, release: clamp}}\n'
    with pytest.raises(
        InputError,
        match=r"events.*: expected a name of letters, digits, _ and -, beginning with a letter, got ",
    ):
        scenes.loads(text, EXAMPLES)


def test_points_of_a_sweep_have_points_in_numbers(tmp_path: Path) -> None:
    """1,5 under one title is two cells; so is a file without titles refused, whose first row would
    be one.
    """
    path = tmp_path / "de.csv"
    own = (ranges.Parameter("E", 0.5e9, 2e9, unit="Pa"),)
    for text, message in (
        (
            "E [GPa]\n1,5\n0,8\n",
            r"row 2: expected 1 cells, one under each title, got 2; numbers are written with points",
        ),
        ("1.5\n0.8\n", "expected a first line of titles"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=message):
            sweep_files.read_points(path, own)
