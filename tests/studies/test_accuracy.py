"""`accuracy` of an analysis: step and cells are found, errors stand beside the numbers, what is
given stays.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, output_errors
from fmbs_skfem.dynamics.checkpoint import RunState
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes.accuracy import Accuracy, Bound
from fmbs_skfem.scenes.analyses.dynamic import LEFT_OUT
from fmbs_skfem.scenes.field_kinds import Span
from fmbs_skfem.shapes import meshes, plate_meshes
from fmbs_skfem.studies.planning import levels, planned, reduced_pilots
from fmbs_skfem.studies.planning.pilots import DIVIDED, ScenePilots, give_up, grid_of

from ..cli.calls import EXAMPLES, ROOT, fmbs, scene

SWING = "{type: dynamic, duration: 0.5 s, rho_inf: 0.8, accuracy: %s}"
RAMP = "sin(pi * t / 1.0)**2"


def true_parts(path: Path, run: studies.Run) -> dict[str, float]:
    """Errors of a run over what is wanted, beside one of four times its cells and steps."""
    pilots, plan = ScenePilots(scenes.read(path)), run.report["accuracy"]
    found, finer = (pilots.run(times * plan["cells"], times * plan["steps"]) for times in (1, 4))
    assert found is not None
    assert finer is not None
    errors = pilots.differ(found, finer)[0]
    return dict(zip(pilots.titles, errors.tolist(), strict=True))


@pytest.mark.parametrize("wanted", ["1e-2", "1e-3", "0.05 %"])
def test_errors_are_below_what_is_wanted(tmp_path: Path, wanted: str) -> None:
    path = scene(tmp_path, SWING % wanted, RAMP)
    run = studies.run(path)
    plan = run.report["accuracy"]
    assert plan["met"]
    parts = true_parts(path, run)
    assert max(parts.values()) <= 1.0
    assert run.report["steps"] == plan["steps"]
    assert plan["errors"].keys() == run.outputs.keys()


def test_pilots_are_compared_at_the_ends_of_all_steps(tmp_path: Path) -> None:
    """A force right behind a jump of a load lies between instants that many numbers of steps have
    in common.
    """
    pilots = ScenePilots(scenes.read(scene(tmp_path, SWING % "1e-2", RAMP)))
    assert (found := pilots.run(2, 1200)) is not None
    assert len(found.times) == 1201


def test_the_planned_scene_is_a_scene_with_these_cells_and_this_step(tmp_path: Path) -> None:
    path = scene(tmp_path, SWING % "1e-2", RAMP)
    found = studies.run(path)
    plan = found.report["accuracy"]
    text = (
        path.read_text()
        .replace("accuracy: 1e-2", f"step: {plan['step']!r}, tolerance: {plan['tolerance']!r}")
        .replace("line: beam", f"line: beam\n    cells: {plan['cells']}")
    )
    same = tmp_path / "same.yaml"
    same.write_text(text)
    given = studies.run(same)
    for name, values in found.outputs.items():
        np.testing.assert_array_equal(values, given.outputs[name])
    assert "accuracy" not in given.report


def test_errors_by_output_in_their_units(tmp_path: Path) -> None:
    path = scene(tmp_path, SWING % "{tip: 2 um}", RAMP)
    plan = studies.run(path).report["accuracy"]
    assert plan["met"]
    assert plan["driven_by"].startswith("tip")
    assert max(plan["errors"]["tip_x"], plan["errors"]["tip_y"]) <= 2e-6
    coarser = studies.run(scene(tmp_path, SWING % "{tip: 2 mm}", RAMP)).report["accuracy"]
    assert coarser["steps"] < plan["steps"]
    everywhere = studies.run(scene(tmp_path, SWING % "2 um", RAMP)).report["accuracy"]
    assert everywhere["steps"] == plan["steps"]


ARM = """
schema: 1
dimension: 2
bodies:
  beam:
    type: cable
    mesh: beam_20.msh
    section: {shape: rectangular, width: 20 mm, height: 3 mm}
    material: {young_modulus: 1 GPa, density: 1800 kg/m^3}
joints: {O: {type: pin, at: beam.left}}
loads: {m: {type: control_torque, at: beam.left, torque: -8 N m * (angle - 0.5) - 0.8 N m s * rate}}
outputs: {tip: {type: position, at: beam.right}}
analysis: {type: dynamic, duration: 1 s, accuracy: 1e-3}
"""


def test_no_single_number_of_steps_is_wrong_with_it() -> None:
    """An arm that starts with a jump of its torque, at numbers of steps that have failed with
    looser tolerances.
    """
    pilots = ScenePilots(scenes.loads(ARM, ROOT / "meshes"))
    pilots.run(8, 3200)
    system, analysis = pilots.system(8), build.dynamic(pilots.scene)
    for steps in (1700, 1950, 2243, 2377, 2600):
        own = pilots.tolerance(steps)
        assert own > 5e-12
        loose, tight = (
            output_errors.columns(
                replace(analysis.piloted(steps, steps // 50), tolerance=tolerance).solve(system)
            )
            for tolerance in (own, 1e-14)
        )
        errors = output_errors.between(tight, loose, system.outputs)
        assert max(error.relative for error in errors.values()) < 0.02 * 1e-3, steps


def test_pilots_that_divide_many_steps_end_early() -> None:
    """A four-bar in steps that are too large: given up where it has divided more steps than count
    as resolved.
    """
    found = scenes.read(EXAMPLES / "four_bar.yaml")
    own = replace(build.dynamic(found), step=LEFT_OUT, accuracy=Accuracy({"": Bound(1e-2)}))
    pilots, steps = ScenePilots(replace(found, analysis=own, reduction=None, compare=None)), 90
    whole = pilots.solve(40, steps)
    assert whole.statistics.halved > 2 * DIVIDED
    assert pilots.run(40, steps) is None
    seen = []

    def watch(state: RunState) -> None:
        seen.append(state.done)
        give_up(state)

    with pytest.raises(SolverError):
        pilots.solve(40, steps, watch=watch)
    assert seen[-1] < 0.7 * steps


def test_a_tolerance_of_the_scene_stays(tmp_path: Path) -> None:
    text = (SWING % "1e-2").replace("accuracy", "tolerance: 1e-11, accuracy")
    run = studies.run(scene(tmp_path, text, RAMP))
    assert run.report["accuracy"]["tolerance"] == 1e-11


def test_the_tolerance_leaves_less_in_more_steps(tmp_path: Path) -> None:
    """Errors add up with the 3/2 power of the number of steps; those that may be divided count with
    all their parts.
    """
    pilots = ScenePilots(scenes.read(scene(tmp_path, SWING % "1e-2", RAMP)))
    assert pilots.tolerance(1000) == 2e-12  # nothing is known of the outputs yet
    pilots.run(4, 200)
    assert pilots.tolerance(4000) == pytest.approx(pilots.tolerance(1000) / 8.0)
    assert pilots.tolerance(2, local_error=1e-4) == pytest.approx(pilots.tolerance(64))
    assert pilots.tolerance(1) == 1e-8
    assert pilots.tolerance(10_000_000) == 2e-12


def test_a_step_that_is_given_stays(tmp_path: Path) -> None:
    path = scene(tmp_path, "{type: dynamic, duration: 0.5 s, step: 10 ms, accuracy: 1e-3}", RAMP)
    with pytest.warns(Notice, match="not met.*mostly by the step; leave the step out to have"):
        plan = studies.run(path).report["accuracy"]
    assert plan["steps"] == 50
    assert not plan["met"]
    assert plan["of_step"] > 1.0
    assert plan["of_mesh"] < 1.0


def test_cells_that_are_given_stay(tmp_path: Path) -> None:
    path = scene(tmp_path, SWING % "1e-2", RAMP)
    path.write_text(path.read_text().replace("line: beam", "line: beam\n    cells: 2"))
    with pytest.warns(Notice, match="mostly by the mesh; leave cells and refine out"):
        run = studies.run(path)
    assert run.trajectory.system.size <= 2 * 2 * 3
    assert run.report["accuracy"]["cells"] is None
    assert run.report["accuracy"]["of_mesh"] > 0.0


def test_the_command_shows_errors(tmp_path: Path) -> None:
    path = scene(tmp_path, "{type: dynamic, duration: 0.5 s, step: auto}", RAMP)
    called = fmbs("run", path, "--accuracy", "1e-2", "--out", tmp_path / "out")
    assert called.code == 0
    assert "+-" in called.out
    assert "pilot runs" in called.out
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["accuracy"]["wanted"] == "0.01 of the range"
    assert report["pilots_cpu_s"] > 0.0
    assert f"took {report['pilots_cpu_s']:.2g} s of CPU" in " ".join(called.out.split())
    by_output = fmbs(
        "run", path, "--accuracy", "tip=1 mm, clamp=5 %", "--json", "--out", tmp_path / "other"
    )
    assert by_output.json["accuracy"]["wanted"] == "tip: 1 mm, clamp: 0.05 of the range"


def test_a_check_plans_nothing(tmp_path: Path) -> None:
    called = fmbs("check", scene(tmp_path, SWING % "1e-6", RAMP))
    assert called.code == 0
    assert (
        "accuracy 1e-06 of the range: what the scene leaves open of step and cells is found when it runs"
        in " ".join(called.out.split())
    )


@pytest.mark.parametrize(
    ("analysis", "text"),
    [
        ("{type: dynamic, duration: 1 s}", "a step, or an accuracy"),
        (SWING % "{top: 1 mm}", "did you mean 'tip'|outputs"),
        (SWING % "{tip: 1 N}", "an error in m"),
        (SWING % "2.0", "below 1"),
        (SWING % "0 mm", "above 0"),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path: Path, analysis: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        scenes.read(scene(tmp_path, analysis))


def test_an_accuracy_that_no_output_has_the_unit_of_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="an error of outputs in one of"):
        studies.run(scene(tmp_path, SWING % "1 rad", RAMP))


def test_an_accuracy_below_round_off_is_refused_with_the_floor(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least"):
        studies.run(scene(tmp_path, SWING % "1e-12", RAMP))


def test_a_resumed_run_plans_nothing_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, out = scene(tmp_path, SWING % "1e-4", RAMP), tmp_path / "out"
    whole = studies.run(path, out=tmp_path / "whole", checkpoint=0.0)
    stopped = fmbs("run", path, "--out", out, "--checkpoint", "0.001", "--time-limit", "0.001")
    assert stopped.code == 6
    monkeypatch.setattr("fmbs_skfem.studies.planning.planned.plan", None)
    gone_on = studies.resume(out)
    for name, values in whole.outputs.items():
        np.testing.assert_array_equal(values, gone_on.outputs[name])
    assert gone_on.report["accuracy"] == whole.report["accuracy"]


@pytest.mark.parametrize("name", ["double_pendulum", "four_bar", "spin_up"])
def test_the_tolerance_follows_the_accuracy(name: str) -> None:
    """Newton leaves at most 2 % of the accuracy, and a tenth of the error of the step, and makes
    fewer corrections.
    """
    found = scenes.read(EXAMPLES / f"{name}.yaml")
    own = replace(build.dynamic(found), step=LEFT_OUT, accuracy=Accuracy({"": Bound(1e-2)}))
    asked = replace(found, analysis=own, reduction=None, compare=None)
    plan = planned.find(asked)
    assert plan.tolerance is not None
    assert 2e-12 < plan.tolerance <= 1e-8
    assert f"Newton's tolerance {plan.tolerance:.2g}" in plan.words
    chosen = plan.scene(asked)
    analysis, system = build.dynamic(chosen), build.chosen_form(chosen, build.system(chosen))
    assert analysis.newton.tolerance == plan.tolerance
    loose, tight, usual, finer = (
        replace(analysis, tolerance=tolerance, step=analysis.step / n, every=n).solve(system)
        for tolerance, n in ((plan.tolerance, 1), (1e-14, 1), (2e-12, 1), (1e-14, 2))
    )
    assert loose.statistics.iterations < 0.95 * usual.statistics.iterations
    columns = [output_errors.columns(motion) for motion in (loose, tight, finer)]
    left, step = (
        output_errors.between(columns[1], other, system.outputs)
        for other in (columns[0], columns[2])
    )
    for column, error in left.items():
        assert error.relative < 0.02 * 1e-2, column
        assert error.relative <= 0.1 * step[column].relative, column


def test_times_of_outputs_ask_for_no_steps(tmp_path: Path) -> None:
    """Steps are those of the accuracy, longer than the time between outputs, which are as good
    there; resumed bit for bit.
    """
    usual = studies.run(scene(tmp_path, SWING % "1e-3", RAMP)).report["accuracy"]
    path = scene(tmp_path, (SWING % "1e-3").replace("rho_inf", "every: 0.37 ms, rho_inf"), RAMP)
    whole, out = studies.run(path, out=tmp_path / "whole", checkpoint=0.0), tmp_path / "out"
    plan = whole.report["accuracy"]
    assert plan == usual
    assert plan["step"] > 0.37e-3
    times = whole.trajectory.times
    np.testing.assert_allclose(times[:-1], 0.37e-3 * np.arange(len(times) - 1), atol=1e-12)
    assert times[-1] == pytest.approx(0.5)
    pilots = ScenePilots(scenes.read(path), within=True)
    finer = build.dynamic(scenes.read(path)).piloted(8 * plan["steps"], 8)
    with_times = replace(finer, every=build.dynamic(scenes.read(path)).every).solve(
        pilots.system(4 * plan["cells"])
    )
    errors = output_errors.between(
        output_errors.columns(with_times), whole.outputs, pilots.any_system.outputs
    )
    assert max(error.relative for error in errors.values()) < 1e-3
    assert (
        fmbs("run", path, "--out", out, "--checkpoint", "0.001", "--time-limit", "0.001").code == 6
    )
    gone_on = studies.resume(out)
    for name, values in whole.outputs.items():
        np.testing.assert_array_equal(values, gone_on.outputs[name])


def test_samples_of_controllers_ask_for_steps() -> None:
    """States may lie within steps, instants at which controllers are asked may not."""
    found = scenes.read(EXAMPLES / "sampled_arm.yaml")
    uneven = replace(
        found,
        analysis=replace(build.dynamic(found), every=(Span(3e-3),), step=LEFT_OUT),
        reduction=None,
    )
    assert grid_of(uneven, within=True) == 2000  # 2 ms in 4 s
    assert grid_of(uneven) == 4000


def test_samples_of_a_sweep_have_the_cells_and_the_step_of_the_plan(tmp_path: Path) -> None:
    path = scene(tmp_path, SWING % "1e-2", RAMP)
    path.write_text(
        path.read_text().replace("{load: 0.5 N}", "{load: {value: 0.5 N, range: [0.4 N, 0.6 N]}}")
    )
    chosen = scenes.read(path).chosen(6, 1e-3)
    again = chosen.again({"load": 0.55})
    assert again.bodies["beam"] == chosen.bodies["beam"]
    assert again.analysis == chosen.analysis
    assert again.parameters["load"] == 0.55
    case = scenes.family(chosen)[1]({"load": 0.45})
    assert case.scheme.step == 1e-3
    assert case.system.size == build.system(chosen).size
    called = fmbs(
        "sweep", path, "--samples", "2", "--workers", "1", "--no-plots", "--out", tmp_path / "sweep"
    )
    plan = json.loads((tmp_path / "sweep" / "report.json").read_text())["accuracy"]
    assert plan == studies.run(path).report["accuracy"]
    shown = " ".join(called.out.split())
    assert f"largest in {plan['driven_by']}; the pilot runs took" in shown
    assert "of CPU, at the nominal parameters" in shown
    # times of states do not count for samples, which have instants of their own
    path.write_text(path.read_text().replace("rho_inf", "every: 0.37 ms, rho_inf"))
    fmbs(
        "sweep", path, "--samples", "1", "--workers", "1", "--no-plots", "--out", tmp_path / "other"
    )
    assert json.loads((tmp_path / "other" / "report.json").read_text())["accuracy"] == plan


CHAOS = """\
schema: 1
dimension: 2
bodies:
  a: {type: rigid, mass: 1 kg, inertia: 0.01 kg m^2, center: [0.25 m, 0], points: {left: [0, 0], right: [0.5 m, 0]}}
  b: {type: rigid, mass: 1 kg, inertia: 0.01 kg m^2, center: [0.75 m, 0], points: {left: [0.5 m, 0], right: [1 m, 0]}}
joints:
  O: {type: pin, at: a.left, to: ground}
  A: {type: pin, at: a.right, to: b.left}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
analysis: {type: dynamic, duration: 30 s, accuracy: 1e-2}
outputs:
  tip: {type: position, at: b.right}
"""


def test_a_chaotic_motion_is_named_with_the_time_up_to_which_it_can_be_trusted() -> None:
    """A double pendulum of two rigid rods: what eight times as many steps say agrees up to that
    time, and not to the end.
    """
    scene = scenes.loads(CHAOS)
    with pytest.warns(
        Notice, match="more steps do not settle tip_.*agree within the accuracy up to t ="
    ):
        plan = planned.find(scene)
    assert plan.why_not == "sensitive"
    trusted = plan.trusted_until
    assert trusted is not None
    assert 0.5 < trusted < 10.0
    pilots = ScenePilots(scene)
    pilots.system(0)
    mine, sharp = pilots.run(0, plan.steps), pilots.run(0, 8 * plan.steps)
    assert mine is not None
    assert sharp is not None
    assert pilots.trusted(mine, sharp) >= 0.7 * trusted
    assert pilots.differ(mine, sharp)[0].max() > 10.0


def test_a_plan_can_be_made_again(tmp_path: Path) -> None:
    scene_ = scenes.read(scene(tmp_path, SWING % "1e-3", RAMP))
    assert planned.find(scene_) == planned.find(scene_)


def test_an_output_that_stands_still_asks_for_nothing(tmp_path: Path) -> None:
    path = scene(tmp_path, SWING % "1e-2", RAMP)
    with_still = path.read_text() + "  root: {type: position, at: beam.left}\n"
    plan = studies.run(path, plots=False).report["accuracy"]
    path.write_text(with_still)
    again = studies.run(path, plots=False).report["accuracy"]
    assert (again["cells"], again["steps"]) == (plan["cells"], plan["steps"])
    assert again["errors"]["root_x"] < 1e-15


@pytest.mark.parametrize("inner", [1, 2, 5])
def test_named_points_inside_of_a_line_stay_points_of_its_mesh(tmp_path: Path, inner: int) -> None:
    """As few cells as named points allow, however coarse a mesh the accuracy would do with."""
    path = scene(tmp_path, SWING % "5e-2", RAMP)
    line = meshes.segment(20)
    groups = line.point_groups | {f"p{k}": np.array([2 + 3 * k]) for k in range(inner)}
    meshes.write(
        replace(line, point_groups=groups, line_groups={"beam": np.arange(20)}),
        tmp_path / "beam_20.msh",
    )
    plan = studies.run(path, plots=False).report["accuracy"]
    assert plan["met"]
    assert plan["cells"] >= inner + 1


def rolled_up(folder: Path, analysis: str) -> Path:
    """The example of a strip that a moment bends into a full circle: its end comes back to its
    root.
    """
    (folder / "meshes").mkdir(exist_ok=True)
    (folder / "meshes" / "beam_50.msh").write_bytes((ROOT / "meshes" / "beam_50.msh").read_bytes())
    text = (EXAMPLES / "rolled_up.yaml").read_text().replace("../meshes", "meshes")
    path = folder / "rolled_up.yaml"
    path.write_text(text.replace("{type: static, load_steps: 12}", analysis))
    return path


@pytest.mark.parametrize("wanted", ["1e-2", "1e-4"])
def test_cells_of_equilibria_are_found(tmp_path: Path, wanted: str) -> None:
    """M = 2 pi EI / L; s M bends an arc of 2 pi s, which ends at L sin(2 pi s) / (2 pi s), L (1 -
    cos) / (2 pi s).
    """
    run = studies.run(rolled_up(tmp_path, f"{{type: static, load_steps: 12, accuracy: {wanted}}}"))
    plan = run.report["accuracy"]
    turn = 2.0 * np.pi * np.arange(1, 13) / 12
    exact = {"tip_x": np.sin(turn) / turn, "tip_y": (1.0 - np.cos(turn)) / turn}
    assert plan["met"]
    assert (plan["steps"], plan["step"], plan["of_step"]) == (None, None, 0.0)
    for name, values in exact.items():
        error = float(np.abs(run.outputs[name][1:] - values).max())
        assert (
            0.02 * plan["errors"][name]
            < error
            <= plan["errors"][name]
            <= float(wanted) * np.ptp(run.outputs[name])
        )


def test_equilibria_along_paths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="load steps, which all meshes have in common"):
        scenes.read(rolled_up(tmp_path, "{type: static, method: arc_length, accuracy: 1e-2}"))
    called = fmbs(
        "run",
        rolled_up(tmp_path, "{type: static, method: arc_length}"),
        "--accuracy",
        "1e-2",
        "--out",
        tmp_path / "out",
    )
    assert called.code == 3
    assert "--accuracy: expected load steps" in called.err


def test_equilibria_without_a_mesh_have_no_error_of_it(tmp_path: Path) -> None:
    text = """\
schema: 1
name: hung
dimension: 2
bodies:
  block: {type: point_mass, mass: 2 kg, position: [0, 0]}
joints:
  guide: {type: slider, at: block, direction: [0, 1]}
loads:
  spring: {type: spring_damper, at: block, to: [0, 1 m], stiffness: 1 kN/m}
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
analysis: {type: static, accuracy: 1e-6}
outputs:
  block: {type: position, at: block}
"""
    path = tmp_path / "hung.yaml"
    path.write_text(text)
    run = studies.run(path)
    assert run.report["accuracy"]["met"]
    assert run.outputs["block_y"][-1] == pytest.approx(-2 * 9.81 / 1000, rel=1e-9)


PLATE = """\
schema: 1
name: flag
dimension: 2
bodies:
  flag:
    type: plate
    mesh: meshes/flag.msh
    thickness: 10 mm
    material: {young_modulus: 20 MPa, density: 1200 kg/m^3, poisson_ratio: 0.3}
joints:
  hinge: {type: revolute, at: flag.b, to: ground}
loads:
  gravity: {type: gravity, acceleration: [0, -9.81 m/s^2]}
analysis: {type: dynamic, duration: 0.1 s, rho_inf: 0.8, accuracy: 4e-2}
outputs:
  tip: {type: position, at: flag.a}
"""


def flag(folder: Path, text: str) -> Path:
    """A scene with a plate of 4 x 2 quads."""
    x, y = np.meshgrid(np.linspace(0.0, 0.4, 5), np.linspace(0.0, 0.1, 3))
    points = np.column_stack([x.ravel(), y.ravel(), 0.0 * x.ravel()])
    low = np.concatenate([np.arange(4), np.arange(5, 9)])
    cells = np.column_stack([low, low + 1, low + 6, low + 5])
    (folder / "meshes").mkdir(exist_ok=True)
    named = {"a": np.array([0]), "b": np.array([4]), "c": np.array([14])}
    plate_meshes.write(plate_meshes.PlateMesh(points, cells, named), folder / "meshes" / "flag.msh")
    path = folder / "flag.yaml"
    path.write_text(text)
    return path


def test_the_mesh_of_a_plate_is_judged_by_a_finer_one(tmp_path: Path) -> None:
    path = flag(tmp_path, PLATE)
    run = studies.run(path)
    plan = run.report["accuracy"]
    finer = studies.run(
        flag(
            tmp_path,
            PLATE.replace("thickness", "refine: 4\n    thickness").replace(
                "accuracy: 4e-2", f"step: {plan['step'] / 4!r}"
            ),
        )
    )
    for name in ("tip_x", "tip_y"):
        assert np.abs(finer.outputs[name][::4] - run.outputs[name]).max() <= plan["errors"][name]
    assert 0.0 < plan["of_mesh"] < 1.0
    with pytest.warns(Notice, match="mostly by the mesh; give flag more cells"):
        tight = studies.run(
            flag(tmp_path, PLATE.replace("accuracy: 4e-2", "step: 1 ms, accuracy: 1e-4"))
        ).report["accuracy"]
    assert not tight["met"]


def test_steps_of_large_models_are_found_by_reduced_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plan of a plate by two full motions, one of them of a mesh that is finer, and by runs of
    some modes, beside the plan by full runs alone: as many steps, and an error that is met.
    """
    asked = scenes.read(flag(tmp_path, PLATE.replace("4e-2", "3e-2")))
    by_full = planned.find(asked)
    monkeypatch.setattr(reduced_pilots, "LARGE", 20)
    monkeypatch.setattr(reduced_pilots, "BEGIN", 1)
    found = reduced_pilots.reduce_pilots(ScenePilots(asked))
    assert found is not None
    assert found.pilots.system(0).size < ScenePilots(asked).system(0).size / 2
    assert 0.0 < float(found.apart[0].max()) <= 0.25
    plan = planned.find(asked)
    assert plan.met
    assert plan.steps is not None
    assert by_full.steps is not None
    assert plan.steps == pytest.approx(by_full.steps, rel=0.3)
    assert plan.of_mesh == pytest.approx(by_full.of_mesh, rel=0.3)
    pilots = ScenePilots(asked)
    runs = [pilots.run(0, times * plan.steps) for times in (1, 4)]
    assert runs[0] is not None
    assert runs[1] is not None
    assert float(pilots.differ(runs[0], runs[1])[0].max()) <= plan.of_step
    # a basis that leaves out what the accuracy asks for tells nothing
    monkeypatch.setattr(reduced_pilots, "EPS", 1e-3)
    assert reduced_pilots.reduce_pilots(ScenePilots(asked)) is None


def test_plates_beside_lines_are_judged_too(tmp_path: Path) -> None:
    line = """\
  cable:
    type: cable
    mesh: meshes/cable.msh
    section: {shape: circular, diameter: 5 mm}
    material: {young_modulus: 10 MPa, density: 1200 kg/m^3}
"""
    text = PLATE.replace(
        "joints:", line + "joints:\n  knot: {type: revolute, at: flag.a, to: cable.right}"
    )
    path = flag(tmp_path, text)
    meshes.write(
        meshes.segment(4, (-0.2, 0.0, 0.0), (0.0, 0.0, 0.0)), tmp_path / "meshes" / "cable.msh"
    )
    alone = ScenePilots(scenes.read(path))
    assert (alone.open, alone.refined, alone.unjudged) == (["cable"], ["flag"], [])
    plan = studies.run(path).report["accuracy"]
    last = plan["pilots"][-1]
    assert plan["cells"] == last["cells"]
    assert plan["of_mesh"] >= 2.0 * last["difference"]


@pytest.mark.parametrize("refine", ["3", "0"])
def test_sides_are_cut_into_a_power_of_two(tmp_path: Path, refine: str) -> None:
    with pytest.raises(
        InputError, match=r"refine: expected (1, 2, 4, 8 or another power of two|a number >= 1)"
    ):
        scenes.read(flag(tmp_path, PLATE.replace("thickness", f"refine: {refine}\n    thickness")))


def wanting(path: Path, outputs: str) -> scenes.schema.Scene:
    """An example with errors of some outputs below 1e-2 of their ranges."""
    found = scenes.read(path)
    return replace(
        found, analysis=replace(found.analysis, step=np.inf, every=1, accuracy=bounds(outputs))
    )


def bounds(outputs: str) -> Accuracy:
    return Accuracy({name: Bound(1e-2) for name in outputs.split()})


def test_what_touches_takes_steps_of_several_lengths() -> None:
    """The gripper: less than a third of the work of the equal steps that meet the accuracy, proved
    as these are, and true.
    """
    asked = wanting(EXAMPLES / "gripper.yaml", "ball tip")
    plan, pilots = planned.find(asked), ScenePilots(asked)
    equal = [one for one in plan.pilots if one["resolved"] and not one["local_error"]][-2]
    assert plan.met
    assert plan.local_error > 0.0
    found, before, finer = (
        pilots.run(*given)
        for given in (
            (plan.cells, plan.steps, plan.local_error),
            (plan.cells, equal["steps"]),
            (plan.cells, 4 * equal["steps"]),
        )
    )
    assert found is not None
    assert before is not None
    assert finer is not None
    assert pilots.differ(found, finer)[0].max() < 1.0
    assert found.work < before.work / 3
    settled = planned.Planned(**asdict(plan)).scene(asked)
    assert build.dynamic(settled).scheme == GeneralizedAlpha(
        1.0 / plan.steps, local_error=plan.local_error
    )
    assert settled.choice == (plan.cells, 1.0 / plan.steps, plan.local_error, plan.tolerance)
    assert f"{plan.steps} steps of {1 / plan.steps:.4g} s, in up to 32 parts" in plan.words


def test_equal_steps_stay_where_several_lengths_are_not_cheaper(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = wanting(EXAMPLES / "gripper.yaml", "ball tip")
    monkeypatch.setattr(levels, "PAYS", 0.01)
    plan = planned.find(asked)
    assert plan.local_error == 0.0
    assert any(one["local_error"] for one in plan.pilots)


def test_smooth_motions_try_none(tmp_path: Path) -> None:
    plan = planned.find(scenes.read(scene(tmp_path, SWING % "1e-3", RAMP)))
    assert not any(one["local_error"] for one in plan.pilots)


def test_a_scene_may_ask_for_several_lengths(tmp_path: Path) -> None:
    """`local_error` beside a step: parts of it err by less than a fifth."""
    text = "{type: dynamic, duration: 0.5 s, step: 10 ms, local_error: %s}"
    runs = [studies.run(scene(tmp_path, text % local, RAMP)) for local in ("0", "1e-6")]
    exact = studies.run(
        scene(tmp_path, "{type: dynamic, duration: 0.5 s, step: 0.2 ms, every: 50}", RAMP)
    )
    errors = [
        max(np.abs(one.outputs[name] - values).max() for name, values in exact.outputs.items())
        for one in runs
    ]
    assert errors[1] < 0.2 * errors[0]
    assert runs[0].report["steps"] == runs[1].report["steps"] == 50
