"""The matrix of bad input, row by row: `fmbs` refuses with place, expectation, value and remedy, or
goes on with a notice.

Every refusal has exit code 3 (4 where only the solver can tell, 8 for damaged files), leaves every
file as it was, executes nothing and shows no traceback. Rows of bad meshes and NURBS files are in
`test_bad_meshes`, bombs in `test_bombs`; rows 38 to 41 (killed runs, full disks, sweeps) are tests
of those commands.
"""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.families import parametric_model
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.hyper import ecsw
from fmbs_skfem.results.rendering import painter
from tests.cli import test_check, test_run
from tests.cli.calls import fmbs
from tests.dynamics import test_diagnosis, test_failures
from tests.reduction import test_ecsw

from .inputs import BEAM, beam, changed, noticed, refused


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a text of a file could run would leave its mark in the folder that is compared."""
    monkeypatch.chdir(tmp_path)


def test_the_right_scene_is_right(tmp_path: Path) -> None:
    done = fmbs("check", beam(tmp_path), "--json")
    assert (done.code, done.json["notices"]) == (0, [])


# ----------------------------------------------------------------------------------------------------- 1 to 5: texts and keys
@pytest.mark.parametrize(
    ("text", "value"), [("1e3", 1e3), ("2.1e11", 2.1e11), ("2.1E+11", 2.1e11), ("1_000", None)]
)
def test_row_1_numbers_with_exponents_are_numbers(
    text: str, value: float | None, tmp_path: Path
) -> None:
    path = beam(tmp_path, changed(BEAM, "1 GPa", "E").replace("{load", f"{{E: {text}, load"))
    if value is None:
        refused(path, "scene.yaml:3: parameters.E")
    else:
        found = fmbs("check", path, "--json").json["parameters"]["E"]
        assert (found, type(found)) == (value, float)


KEYS = {
    "2 duplicate key": (
        "      density: 1800 kg/m^3",
        "      density: 1800 kg/m^3\n      young_modulus: 2 GPa",
        [
            "scene.yaml:13: expected the key 'young_modulus' once, got twice, in lines 11 and 13; delete one"
        ],
    ),
    "2 duplicate name": (
        "joints:",
        "  beam: {type: point_mass}\njoints:",
        ["twice, in lines 5 and 13"],
    ),
    "3 unknown key": (
        "young_modulus",
        "yong_modulus",
        [
            "scene.yaml:11: bodies.beam.material.yong_modulus: expected one of the keys",
            "did you mean 'young_modulus'?",
        ],
    ),
    "3 unknown section": (
        "joints:",
        "joint:",
        ["scene.yaml:13: joint: ", "did you mean 'joints'?"],
    ),
    "3 unknown type": (
        "type: cable",
        "type: cabel",
        ["scene.yaml:6: bodies.beam.type: ", "'cabel'; did you mean 'cable'?"],
    ),
    "4 no version": (
        "schema: 1\n",
        "",
        ["the key 'schema' (schema version 1), got no such key", "add 'schema: 1'"],
    ),
    "4 newer version": (
        "schema: 1",
        "schema: 2",
        ["scene.yaml:1: schema: expected schema version 1, got 2", "newer fmbs_skfem"],
    ),
    "4 version before the first": (
        "schema: 1",
        "schema: 0",
        ["expected schema version 1, got 0; write 'schema: 1'"],
    ),
    "4 version in words": ("schema: 1", "schema: one", ["expected schema version 1, got 'one'"]),
    "5 object": (
        "schema: 1",
        "schema: 1\nname: !!python/object/apply:os.system ['touch executed']",
        [
            "scene.yaml:2: expected a value without a tag",
            "python/object/apply:os.system",
            "plain values only",
        ],
    ),
    "5 name": (
        "schema: 1",
        "schema: 1\nname: !!python/name:os.system",
        ["scene.yaml:2", "a value without a tag"],
    ),
    "5 own tag": ("circular, ", "!x circular, ", ["scene.yaml:9", "a value without a tag", "'!x'"]),
    "5 tag of YAML": ("schema: 1", "schema: !!int 1", ["scene.yaml:1", "a value without a tag"]),
    "5 tag on a key": (
        "schema: 1",
        "!!str schema: 1",
        ["scene.yaml:1", "a key that is plain text"],
    ),
    "5 merge key": (
        "    line: beam",
        "    <<: beam",
        ["scene.yaml:8: expected a mapping, or a list of mappings, behind <<"],
    ),
}


@pytest.mark.parametrize("row", KEYS)
def test_rows_2_to_5_keys(row: str, tmp_path: Path) -> None:
    before, after, words = KEYS[row]
    refused(beam(tmp_path, changed(BEAM, before, after)), *words)


def test_all_problems_are_told_at_once_also_as_json(tmp_path: Path) -> None:
    text = changed(
        changed(changed(BEAM, "yo", "Yo"), "1 ms", "1 mm"), "at: beam.left", "at: bema.left"
    )
    done = refused(beam(tmp_path, text), options=("--json",))
    found = done.json
    assert (found["status"], found["reason"]) == ("error", "bad input")
    told = found["message"].splitlines()
    assert [line.split(": ")[0].rsplit(":", 1)[1] for line in told] == sorted(["11", "10", "17"])
    assert f"error: {found['message']}\n" in done.err


def test_names_cannot_write_to_the_terminal(tmp_path: Path) -> None:
    for before in ("joints:", "    line: beam", "  clamp:"):
        key = before.replace(before.strip(" "), r'"\e[2J\nerror"') + ": 1\n"
        done = refused(
            beam(tmp_path, changed(BEAM, before, key + before)),
            r"expected text without control characters, got '\x1b'",
        )
        assert "\x1b" not in done.err
    lines = beam(tmp_path, changed(BEAM, "joints:", '"a\\nb": 1\njoints:'))
    assert "'a\nb'" not in refused(lines, r"a\nb").err


# ------------------------------------------------------------------------------------------- 7, 9: expressions; 6 and 8: bombs
PROGRAMS = [
    "().__class__.__bases__[0].__subclasses__()",
    "__import__('os').system('touch executed')",
    "lambda: 1",
    "exec('import os')",
    "t.real",
    "open('executed', 'w')",
    "[1 for x in (1,)][0]",
    "f'{t}'",
    "t := 1",
    "t if t else 1",
    "1; import os",
]


@pytest.mark.parametrize("text", PROGRAMS)
@pytest.mark.parametrize(
    ("before", "place"),
    [('"1"', "scene.yaml:16: loads.tip.history: "), ("10 mm", "scene.yaml:9: bodies.beam.")],
)
def test_row_7_only_the_grammar_is_read(text: str, before: str, place: str, tmp_path: Path) -> None:
    path = beam(tmp_path, changed(BEAM, before, f'"{text}"'))
    refused(
        path,
        place,
        "allowed are numbers, pi, the scene's parameters",
        "sqrt, tan, tanh, where(condition, then, else)",
    )


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(
    ("history", "time"),
    [("1 / (t - 0.005)", "0.005"), ("log(t)", "0"), ("sqrt(0.0075 - t)", "0.008")],
)
def test_row_9_values_that_are_not_finite(
    command: str, history: str, time: str, tmp_path: Path
) -> None:
    path = beam(tmp_path, changed(BEAM, 'history: "1"', f'history: "{history}"'))
    done = refused(
        path,
        f"load 'tip' at t = {time} s",
        history,
        "guard it with where(...)",
        code=4,
        command=(command,),
        options=("--json",),
    )
    assert done.json["reason"] == "a residual or increment is not finite"
    assert done.json["time"] == float(time)


UNDEFINED = [
    "mod(t, 0)",
    "t / 0",
    "1 - 0 * mod(t, zero)",
    "t / (2 * zero)",
    "min(t / zero, 1)",
    "sqrt(zero - 1) * t",
]


@pytest.mark.parametrize("text", [*UNDEFINED, "mod(swing.angle, 0)", "swing.angle / zero"])
def test_what_is_undefined_for_constants_is_no_expression(text: str, tmp_path: Path) -> None:
    """Wherever it is read, of time and of the state; not where a condition keeps it from being
    read.
    """
    swing = changed(BEAM, "outputs:", "outputs:\n  swing: {type: angle, at: beam.left}").replace(
        "{load:", "{zero: 0, load:"
    )
    torque = "{type: control_torque, at: beam.left, torque: "
    of_time, of_state = f'history: "{text}"', f'{torque}"1 N m * ({text})"}}'
    if "swing" not in text:
        path = beam(tmp_path, changed(swing, 'history: "1"', of_time))
        refused(path, "scene.yaml:16: loads.tip.history: expected ", ", got ", text)
    path = beam(
        tmp_path,
        changed(swing, "  tip: {type: point", f"  motor: {of_state}\n  tip: {{type: point"),
    )
    refused(path, "scene.yaml:16: loads.motor.torque: expected ", ", got ", text)


@pytest.mark.parametrize(
    "text", ["where(t < zero, t / zero, 1)", "where(zero > 0, mod(t, zero), 1)"]
)
def test_a_divisor_that_no_instant_reads_is_free(text: str, tmp_path: Path) -> None:
    path = beam(
        tmp_path,
        changed(BEAM, 'history: "1"', f'history: "{text}"').replace("{load:", "{zero: 0, load:"),
    )
    assert fmbs("check", path, "--strict").code == 0


ARM = """\
schema: 1
dimension: 2
bodies:
  arm: {type: rigid, mass: 1 kg, inertia: 1 kg m^2, center: [0, 0], points: {tip: [1 m, 0], end: [1 m, 0]}}
joints: {hinge: {type: revolute, at: arm}}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
"""
ITSELF = {
    "  ball: {type: contact_sphere, at: arm.tip, on: arm.end, diameter: 1 m}": "load 'ball': on",
    "  rope: {type: rope, at: arm.tip, to: arm.end, stiffness: 1 N/m}": "load 'rope': to",
    "  d: {type: distance, at: arm.tip, to: arm.end}": "output 'd': to",
}


@pytest.mark.parametrize("line", ITSELF)
def test_nothing_is_between_a_place_and_itself(line: str, tmp_path: Path) -> None:
    section = "outputs" if "distance" in line else "loads"
    refused(
        beam(tmp_path, f"{ARM}{section}:\n{line}\n"),
        f"{ITSELF[line]}: expected another place, got 'arm.end', which is 'arm.tip'",
    )


def test_contact_of_a_rigid_body_with_its_own_shape_is_told(tmp_path: Path) -> None:
    line = "loads: {ball: {type: contact_sphere, body: arm, on: arm.end, diameter: 1 m, overlap: keep}}\n"
    done = fmbs("check", beam(tmp_path, ARM + line), "--json")
    assert "loads.ball: does nothing, as both of its places are on the rigid body 'arm'" in "".join(
        done.json["notices"]
    )


TWICE = {
    ("--accuracy", "tip=1 mm, tip=2 mm"): (
        3,
        "--accuracy: expected every output once, got 'tip' twice",
    ),
    ("--accuracy", "=1 mm"): (3, "--accuracy: expected errors by output"),
    ("--set", "load=1 N", "--set", "load=2 N"): (2, "expected every name once, got 'load' twice"),
    ("--set", "=1 N"): (2, "expected NAME=VALUE, got '=1 N'"),
}


@pytest.mark.parametrize("options", TWICE)
def test_options_name_everything_once(options: tuple[str, ...], tmp_path: Path) -> None:
    code, words = TWICE[options]
    done = fmbs("check", beam(tmp_path), *options)
    assert (done.code, words in done.err) == (code, True), done.err


def test_ranges_and_points_are_given_once(tmp_path: Path) -> None:
    done = fmbs("sweep", beam(tmp_path), "--range", "load=1 N:2 N", "--range", "load=1 N:3 N")
    assert (done.code, "expected every name once, got 'load' twice" in done.err) == (2, True)
    more = "reduction: {snapshots: 1 ms, components: {a: [beam], b: []}}\ntraining: {samples: [1 N, 0.5 N, 1 N]}\n"
    text = changed(BEAM, "{load: 0.5 N}", "{load: {value: 1 N, range: [0.5 N, 2 N]}}") + more
    refused(
        beam(tmp_path, text),
        "training.samples: expected points that differ, got one twice, as points 1 and 3; delete one",
    )
    text = text.replace(", 1 N]}", "]}")
    refused(
        beam(tmp_path, text),
        "scene.yaml:20: reduction.components.b: expected a list of bodies, got an empty one",
    )


# --------------------------------------------------------------------------------------------------------- 10, 11: other files
@pytest.mark.parametrize("command", ["check", "run", "reduce", "compare", "export"])
def test_row_10_meshes_outside_of_the_project(command: str, tmp_path: Path) -> None:
    folder, outside = tmp_path / "project" / "scenes", tmp_path / "beam_5.msh"
    folder.mkdir(parents=True)
    path = beam(folder)
    (folder / "beam_5.msh").rename(outside)
    (folder / "link.msh").symlink_to(outside)
    for text in (
        "../../beam_5.msh",
        "../../../../../../etc/passwd",
        str(outside),
        "link.msh",
        "/etc/passwd",
        "a/../../../beam_5.msh",
    ):
        path.write_text(changed(BEAM, "beam_5.msh", text) + "reduction: {snapshots: 1 ms}\n")
        refused(
            path,
            "scene.yaml:5: bodies.beam: mesh path",
            "stays in its parent folder",
            "allow",
            command=(command,),
        )


def test_row_10_with_permission(tmp_path: Path) -> None:
    folder, outside = tmp_path / "project" / "scenes", tmp_path / "beam_5.msh"
    folder.mkdir(parents=True)
    path = beam(folder)
    (folder / "beam_5.msh").rename(outside)
    for text in ("../../beam_5.msh", str(outside)):
        path.write_text(changed(BEAM, "beam_5.msh", text))
        assert fmbs("check", path, "--allow-outside").code == 0


test_row_11_another_run = test_run.test_results_of_another_run_are_kept
test_row_11_files_of_the_user = test_run.test_files_of_the_user_are_kept

# ----------------------------------------------------------------------------------------------------------- 12 to 15: numbers
NUMBERS = {
    "12 E negative": (
        "1 GPa",
        "-1 GPa",
        "11: bodies.beam.material.young_modulus",
        "a pressure [Pa] > 0, got '-1 GPa'",
    ),
    "12 E zero": (
        "1 GPa",
        "0",
        "11: bodies.beam.material.young_modulus",
        "a pressure [Pa] > 0, got 0",
    ),
    "12 E infinite": (
        "1 GPa",
        ".inf",
        "11: bodies.beam.material.young_modulus",
        "a finite number, got inf",
    ),
    "12 E not a number": (
        "1 GPa",
        ".nan",
        "11: bodies.beam.material.young_modulus",
        "a finite number, got nan",
    ),
    "12 rho negative": (
        "1800 kg/m^3",
        "-1800",
        "12: bodies.beam.material.density",
        "a density [kg/m^3] > 0, got -1800",
    ),
    "12 rho zero": (
        "1800 kg/m^3",
        "0",
        "12: bodies.beam.material.density",
        "a density [kg/m^3] > 0, got 0",
    ),
    "12 diameter zero": (
        "10 mm",
        "0 mm",
        "9: bodies.beam.section.diameter",
        "a length [m] > 0, got '0 mm'",
    ),
    "12 nu of one half": (
        "density: 1800 kg/m^3",
        "poisson_ratio: 0.5",
        "12: bodies.beam.material.poisson_ratio",
        "a number > -1 and < 0.5, got 0.5",
    ),
    "12 nu of minus one": (
        "density: 1800 kg/m^3",
        "poisson_ratio: -1",
        "12: bodies.beam.material.poisson_ratio",
        "a number > -1 and < 0.5, got -1",
    ),
    "12 step negative": (
        "step: 1 ms",
        "step: -1 ms",
        "17: analysis.step",
        "a time [s] > 0, got '-1 ms'",
    ),
    "12 step above the duration": (
        "step: 1 ms",
        "step: 1 s",
        "17: analysis.step",
        "a step of at most the duration 0.01 s, got 1 s",
    ),
    "14 pressure for a length": (
        "10 mm",
        "210 GPa",
        "9: bodies.beam.section.diameter",
        "a length [m], got '210 GPa' (pressure); write a number, or a quantity in m",
    ),
    "14 length for a force": (
        "0.5 N",
        "0.5 m",
        "16: loads.tip.force",
        "a force [N], got 'load' (length)",
    ),
    "14 sum of two dimensions": (
        "load]",
        "load + 1 m]",
        "16: loads.tip.force",
        "all parts of '+' of one dimension, got force and length",
    ),
    "14 sum of two parameters": (
        "load: 0.5 N}",
        "a: 1 m, load: a + 1 / a}",
        "3: parameters.load",
        "all parts of '+' of one dimension",
    ),
    "14 unknown unit": ("10 mm", "10 furlongs", "9: bodies.beam.section.diameter", "a known unit"),
}


@pytest.mark.parametrize("row", NUMBERS)
def test_rows_12_and_14_numbers(row: str, tmp_path: Path) -> None:
    before, after, place, found = NUMBERS[row]
    refused(beam(tmp_path, changed(BEAM, before, after)), f"scene.yaml:{place}: expected {found}")


def test_row_13_units_that_are_mixed(tmp_path: Path) -> None:
    """Steel in tonnes per mm3 and Pa: sqrt(2.1e11 / 7.85e-9) = 5.17e9 m/s."""
    text = changed(changed(BEAM, "1 GPa", "2.1e11"), "1800 kg/m^3", "7.85e-9")
    noticed(
        beam(tmp_path, text),
        "scene.yaml:10: bodies.beam.material: ",
        "5.17e+09 m/s",
        "is the density given in t/mm3?",
    )


def test_row_15_degrees_for_radians(tmp_path: Path) -> None:
    drive = "  motor: {type: driven_angle, at: beam.left, angle: 90}\n"
    text = changed(
        BEAM,
        "  clamp: {type: clamp, at: beam.left}\n",
        "  pin: {type: pin, at: beam.left}\n" + drive,
    )
    told = "an angle of 90 rad is more than one turn: write '90 deg' if degrees are meant"
    turned = changed(BEAM, "    line: beam", "    line: beam\n    rotation: 90")
    noticed(beam(tmp_path, turned), "scene.yaml:9: bodies.beam.rotation: " + told)
    assert "joints.motor.angle: " + told in fmbs("check", beam(tmp_path, text)).err


# -------------------------------------------------------------------------------------------------- 31 to 35: what hangs together
PLACES = {
    "27 missing line": (
        "line: beam",
        "line: baem",
        "5: bodies.beam",
        "line groups present: beam; did you mean 'beam'?",
    ),
    "31 missing body": (
        "at: beam.left",
        "at: bema.left",
        "14: joints.clamp.at",
        "expected one of the bodies beam, got the body 'bema'",
    ),
    "31 missing point": (
        "at: beam.left",
        "at: beam.lefft",
        "14: joints.clamp.at",
        "(left, right), got 'lefft'; did you mean 'left'?",
    ),
    "31 no point": (
        "at: beam.left",
        "at: beam",
        "14: joints.clamp.at",
        "expected a point of the body 'beam', got 'beam'; write beam.group",
    ),
    "31 beyond the end": (
        "at: beam.left",
        "at: {body: beam, s: 1.25 m}",
        "14: joints.clamp.at",
        "an arc length between 0 and 1 m, got 1.25 m; the nearest point is the end at 1 m, 0.25 m away",
    ),
    "31 missing joint": (
        "tip: {type: position, at: beam.right}",
        "tip: {type: reaction, joint: clmp}",
        "19: outputs.tip.joint",
        "expected one of the joints clamp, got the joint 'clmp'; did you mean 'clamp'?",
    ),
}


@pytest.mark.parametrize("row", PLACES)
def test_rows_27_and_31_names(row: str, tmp_path: Path) -> None:
    before, after, place, found = PLACES[row]
    refused(beam(tmp_path, changed(BEAM, before, after)), f"scene.yaml:{place}: ", found)


test_row_32_redundant_rows = test_check.test_redundant_rows_are_counted_and_named
test_row_33_contradicting_joints = test_check.test_contradicting_joints_stop_the_check_by_name


def test_row_33_a_closure_that_is_impossible_ends_a_run_at_its_start(tmp_path: Path) -> None:
    """The far end of a rod of 1 m clamped at x = 0 cannot be at x = 1.2 m."""
    text = changed(
        BEAM,
        "joints:\n",
        "joints:\n  bar: {type: distance, at: beam.right, to: [1.5, 0], length: 0.2 m}\n",
    )
    done = refused(beam(tmp_path, text), "joints.bar: ", command=("run",), options=("--json",))
    assert done.json["time"] == 0.0
    worst = done.json["worst"]
    assert worst[0]["name"].startswith("bar")
    assert abs(worst[0]["residual"]) >= abs(worst[-1]["residual"])


FREE = changed(BEAM, "joints:\n  clamp: {type: clamp, at: beam.left}\n", "")


def test_row_34_static_without_joints(tmp_path: Path) -> None:
    text = changed(FREE, "{type: dynamic, duration: 10 ms, step: 1 ms}", "{type: static}")
    words = (
        "scene.yaml:15: analysis: ",
        "3 rigid motions",
        "beam moves along",
        "beam turns about",
        "hold them by joints",
    )
    refused(beam(tmp_path, text), *words)


def test_row_34_motion_without_joints(tmp_path: Path) -> None:
    noticed(beam(tmp_path, FREE), "scene.yaml:5: bodies.beam: no joint ties 'beam' to the ground")


test_row_34_no_equilibrium_without_joints = test_failures.test_a_free_body_has_no_equilibrium


def test_row_35_velocities_against_joints(tmp_path: Path) -> None:
    """The clamped end may not move at 1 m/s: the start keeps what the joints allow."""
    text = changed(
        BEAM, "analysis:", "initial: {bodies: {beam: {velocity: [0, 1 m/s]}}}\nanalysis:"
    )
    noticed(beam(tmp_path, text), "velocit")


test_row_35_projected = test_failures.test_initial_velocities_are_projected_alike_in_both_forms

# --------------------------------------------------------------------------------------------------------- 36, 37, 43: solvers
test_row_36_a_failed_solve = test_run.test_a_failed_solve_keeps_what_it_reached


def test_row_37_a_singular_tangent_names_the_body_that_moves(tmp_path: Path) -> None:
    """A beam that nothing holds; its null vector stands in the report as well."""
    path = beam(
        tmp_path,
        changed(
            FREE, "{type: dynamic, duration: 10 ms, step: 1 ms}", "{type: static, load_steps: 1}"
        ),
    )
    refused(path, "the tangent is singular", "hold it by joints", code=4, command=("run",))
    found = json.loads((tmp_path / "fmbs-scene" / "failure.json").read_text())
    assert found["reason"] == "the tangent is singular"
    assert found["null"] == [{"name": "beam", "value": pytest.approx(1.0)}]
    assert found["causes"][0]["name"] == "free"
    assert found["causes"][0]["what"].startswith("beam can move freely")


test_row_37_a_locked_pose_names_its_joints = (
    test_diagnosis.test_the_locked_links_stop_when_they_are_stretched_out
)


def test_row_43_nothing_moves(tmp_path: Path) -> None:
    """A beam at rest that no force moves has snapshots that are all the same."""
    text = changed(BEAM, "load: 0.5 N", "load: 0 N") + "reduction: {snapshots: 1 ms}\n"
    refused(
        beam(tmp_path, text),
        "expected a motion, got none: nothing moves in the training run",
        command=("reduce",),
    )


def test_row_43_a_residual_that_is_not_reached_is_told() -> None:
    """The column (1, 1) cannot make b = (1, 0): least residual sqrt(1/2); the set that was found is
    counted in the message.
    """
    with pytest.raises(
        SolverError, match=r"relative residual of 0\.001, got 0\.707 with 1"
    ) as caught:
        ecsw.weights(np.ones((2, 1)), 1e-3, b=np.array([1.0, 0.0]))
    assert caught.value.exit_code == 4


test_row_43_no_training_forces = test_ecsw.test_bad_input_is_refused


# ------------------------------------------------------------------------------------------------- 42, 44, 45: files and drawing
def test_row_44_no_opengl_keeps_the_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The interpreter that draws dies of a segmentation fault, as it does where VTK finds no
    OpenGL.
    """
    dying = tmp_path / "python"
    dying.write_text("#!/bin/sh\nkill -SEGV $$\n")
    dying.chmod(0o755)
    monkeypatch.setattr(painter, "COMMAND", (str(dying), *painter.COMMAND[1:]))
    monkeypatch.setattr(painter, "AT_HAND", [])
    done = fmbs("render", beam(tmp_path), "--out", tmp_path / "out", "--json")
    assert done.code == 7, done.err
    assert (done.json["status"], done.json["reason"]) == ("error", "missing feature")
    assert len((tmp_path / "out" / "outputs.csv").read_text().splitlines()) == 12
    assert not (tmp_path / "out" / "picture.png").exists()
    assert "Traceback" not in done.err


def test_row_42_outside_of_the_training_is_told(model: Path) -> None:
    """The single-set model keeps its parameters with it; asked for others it says which file to
    make.
    """
    refused(
        model,
        "--set: expected a model of a whole range of parameters",
        "fmbs reduce --set",
        command=("run",),
        options=("--set", "load=1"),
    )


def test_row_42_outside_of_the_box_with_its_distance(ranged: Path) -> None:
    """(1.6 - 1.5) / (1.5 - 0.5) GPa = 10 %."""
    words = (
        "E = 1.6e+09, trained from 5e+08 to 1.5e+09, 10% of that range outside",
        "check its error against a full run",
    )
    for code, options in ((0, ()), (3, ("--strict",))):
        done = fmbs("rom", "run", ranged, "--set", "E=1.6 GPa", "--no-plots", *options)
        assert done.code == code, done.err
        assert all(word in done.err for word in words), done.err


def test_row_42_a_basis_of_another_mesh(model: Path, ranged: Path, tmp_path: Path) -> None:
    """A model of five cells whose basis is that of ten; its checksum is right."""
    own, other = files.load(model), parametric_model.load(ranged).model.nominal.system
    mixed = files.save(
        replace(own, lift=other.lift),
        tmp_path / "mixed.h5",
        report={"duration": 0.01, "step": 1e-3},
    )
    found = (
        f"system.lift.matrix: expected an array ({len(other.lift.offset)}, {own.size}) of float64"
    )
    for command in (("rom", "info"), ("rom", "run"), ("run",)):
        refused(
            mixed,
            found,
            f"got an array {other.lift.matrix.shape} of float64",
            code=8,
            command=command,
        )


class Trap:
    """An object whose pickle, loaded, makes the file `executed`."""

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        return open, ("executed", "w")


def test_row_45_pickles_are_not_loaded(tmp_path: Path) -> None:
    array = np.empty(1, dtype=object)
    array[0] = Trap()
    np.save(tmp_path / "model.npy", array, allow_pickle=True)
    for name in ("model.h5", "model.hdf5"):
        path = tmp_path / name
        path.write_bytes((tmp_path / "model.npy").read_bytes())
        for words in (("rom", "info"), ("rom", "run"), ("run",)):
            refused(
                path,
                "'fmbs_skfem reduced model'",
                "train and save the model anew",
                code=8,
                command=words,
            )
        path.write_bytes(pickle.dumps(Trap()))
        refused(path, code=8, command=("rom", "info"))
    for mesh in ("beam_5.msh", "beam_5.vtu"):
        path = beam(
            tmp_path, changed(BEAM, "beam_5.msh", mesh), (tmp_path / "model.npy").read_bytes()
        )
        (tmp_path / mesh).write_bytes((tmp_path / "model.npy").read_bytes())
        refused(path, mesh)
    assert not (tmp_path / "executed").exists()


# ---------------------------------------------------------------------------------------------------- what once ended in code 1
@pytest.mark.parametrize("heights", ["5 mm", "[[0, 0], [0]]", "[0, [0]]", "{a: 1}"])
def test_heights_that_are_no_lists(heights: str, tmp_path: Path) -> None:
    floor = f"  floor: {{type: contact_heights, body: beam, corner: [-1, -1], step: [1 m], heights: {heights}}}\n"
    path = beam(tmp_path, changed(BEAM, "analysis:", f"{floor}analysis:"))
    refused(
        path, "loads.floor.heights: expected lengths in a list, or in lists of one length, got "
    )


@pytest.mark.parametrize(
    ("before", "after"),
    [("1800 kg/m^3", "1e-300"), ("diameter: 10 mm", "diameter: 1e200"), ("0.5 N", "1e300 N")],
)
def test_sizes_whose_products_are_no_numbers(before: str, after: str, tmp_path: Path) -> None:
    refused(
        beam(tmp_path, changed(BEAM, before, after)),
        "of a size from 1e-50 to 1e+50, got ",
        "; look at its unit",
    )


def test_joints_that_leave_nothing_to_move(tmp_path: Path) -> None:
    """All rows of the joints of a mass at rest follow from each other: its component has no modes
    in a reduced model.
    """
    text = """\
schema: 1
dimension: 2
bodies:
  held: {type: point_mass, mass: 1 kg, position: [0, 0]}
  free: {type: point_mass, mass: 1 kg, position: [1, 0]}
joints:
  a: {type: pin, at: held.center}
  d: {type: distance, at: held.center, to: [1, 0]}
loads: {g: {type: gravity, acceleration: [0, -9.81]}}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
outputs: {p: {type: position, at: free.center}}
reduction: {snapshots: 1 ms}
"""
    done = fmbs("reduce", beam(tmp_path, text), "--out", tmp_path / "model.h5")
    assert done.code == 0, done.err
