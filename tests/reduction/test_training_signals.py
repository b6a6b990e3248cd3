"""Plants: inputs that are excited within their ranges, and reduced models that follow signals which
they have never seen.
"""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import studies
from fmbs_skfem.control.live import start
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.inputs import Input
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.reduction import files, training_signals
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.training_signals import TrainingSignals, excite, signals
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.studies import greedy_training, plans
from fmbs_skfem.studies.job import Job
from fmbs_skfem.systems.signals import inputs_of, with_inputs

ROOT = Path(__file__).parents[2]
SCENE = """
schema: 1
name: plant
dimension: 2
inputs: {u: {range: [-1 N m, 2 N m]}, push: {unit: N, range: [-3, 3]}}
bodies:
  arm:
    type: cable
    mesh: meshes/beam_20.msh
    section: {shape: circular, diameter: 20 mm}
    material: {young_modulus: 3 GPa, density: 1800 kg/m^3}
joints:
  hinge: {type: pin, at: arm.left}
loads:
  drive: {type: control_torque, at: arm.left, torque: u}
  tip: {type: control_force, at: arm.right, direction: [0, 1], force: push}
damping: {stiffness: 0.2 ms}
analysis: {type: dynamic, duration: 0.4 s, step: 1 ms}
outputs:
  hinge: {type: angle, at: arm.left}
  tip: {type: position, at: arm.right}
reduction: {snapshots: 2 ms, hyper_reduction: {tolerance: 1e-4}}
"""
DRIVEN = (
    SCENE.replace("u: {range: [-1 N m, 2 N m]}", "u: {range: [-0.3 rad, 0.5 rad]}")
    .replace("joints:\n", "joints:\n  turn: {type: driven_angle, at: arm.left, angle: u}\n")
    .replace("  drive: {type: control_torque, at: arm.left, torque: u}\n", "")
)


def write(folder: Path, name: str, text: str) -> Path:
    """The scene in a folder, with its mesh."""
    (folder / "meshes").mkdir(exist_ok=True)
    shutil.copy(ROOT / "meshes" / "beam_20.msh", folder / "meshes")
    (folder / f"{name}.yaml").write_text(text)
    return folder / f"{name}.yaml"


def case_of(text: str) -> Case:
    scene = reading.loads(text, ROOT)
    return plans.task(scene, build.system(scene), plans.plan(scene)).family({})


def shapes(text: str, seed: int = 0, run: int = 0) -> dict[str, np.ndarray]:
    """Signals of a scene in a run."""
    wanted, case = TrainingSignals(seed=seed), case_of(text)
    return {
        name: np.array(one.values)
        for name, one in signals(case, wanted, training_signals.band(case, wanted), run).items()
    }


@pytest.mark.parametrize("run", range(4))
@pytest.mark.parametrize("text", [SCENE, DRIVEN], ids=["torque", "drive"])
def test_signals_stay_in_their_ranges_and_begin_at_the_start(text: str, run: int) -> None:
    found, ranges = (
        shapes(text, run=run),
        {name: one.range for name, one in inputs_of(case_of(text).system).items()},
    )
    for name, values in found.items():
        low, high = ranges[name]
        assert values[0] == 0.0
        assert low <= values.min() < values.max() <= high
        assert values.max() - values.min() > 0.3 * (high - low)
    both = [(one - one.mean()) / one.std() for one in found.values()]
    assert abs(both[0] @ both[1]) / len(both[0]) < 0.9  # different signals at once


def test_signals_follow_from_the_seed_and_not_from_other_inputs() -> None:
    alone = SCENE.replace(", push: {unit: N, range: [-3, 3]}", ", push: {unit: N}")
    first, again, other = shapes(SCENE), shapes(SCENE), shapes(SCENE, seed=1)
    np.testing.assert_array_equal(first["push"], again["push"])
    np.testing.assert_array_equal(first["u"], shapes(alone)["u"])
    assert np.abs(first["u"] - other["u"]).max() > 0.1
    assert list(shapes(alone)) == ["u"]


def test_what_drives_a_joint_has_no_jump_in_its_rate() -> None:
    """Acceleration of a sine of half of the range at the corner of 2 periods in the run, 0.4 rad (2
    pi 5 Hz)^2, twice at most.
    """
    for run in range(4):
        u = shapes(DRIVEN, run=run)["u"]
        assert np.abs(np.diff(u, 2)).max() / 1e-6 < 2.0 * 0.4 * (2.0 * np.pi * 5.0) ** 2


def test_frequencies_reach_the_third_mode_as_far_as_the_step_follows() -> None:
    """Of a pinned and free beam: f_k = (beta_k L)^2 / (2 pi L^2) sqrt(EI / rhoA), beta_k L =
    3.9266, 7.0686, 10.2102.
    """
    rate = np.sqrt(3e9 * 0.01**2 / 4 / 1800)
    case, wanted = case_of(SCENE.replace("step: 1 ms", "step: 0.1 ms")), TrainingSignals()
    found = training_signals.band(case, wanted)
    assert found.fast == pytest.approx(10.2102**2 * rate / (2 * np.pi), rel=2e-3)
    assert found.slow == 1 / 0.4
    assert training_signals.band(case_of(SCENE), wanted).fast == pytest.approx(1 / (20 * 1e-3))
    assert training_signals.band(case_of(SCENE), TrainingSignals(fastest=7.0)).fast == 7.0


def test_a_training_run_is_a_live_run_with_the_same_values() -> None:
    """To the bit: signals are held from step to step, as `run.step` holds inputs."""
    for text in (SCENE, DRIVEN):
        scene = reading.loads(text, ROOT)
        task = plans.task(scene, build.system(scene), plans.plan(scene))
        excited = excite(task, TrainingSignals())
        assert excited is not None
        system, scheme = task.form(task.family({}).system), GeneralizedAlpha(1e-3)
        told = signals(task.family({}), excited.signals.wanted, excited.signals.band, 1)
        motion = integrate(with_inputs(system, told), scheme, 0.05)
        run = start(system, scheme)
        for k in range(1, 51):
            run.step({name: one.values[k] for name, one in told.items()})
        np.testing.assert_array_equal(run.motion().x[0], motion.x[-1])


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> dict[str, studies.ReductionResult]:
    folder, found = tmp_path_factory.mktemp("plants"), {}
    for name, text in (("torque", SCENE), ("drive", DRIVEN)):
        found[name] = studies.reduce(write(folder, name, text), out=folder / f"{name}.h5")
    return found


@pytest.mark.parametrize("name", ["torque", "drive"])
def test_a_plant_at_rest_follows_signals_that_it_has_never_seen(
    reduced: dict[str, studies.ReductionResult], name: str
) -> None:
    """Sines of other frequencies: the error is of the size of that of the report, which was found
    under a random signal.
    """
    result = reduced[name]
    report, scene = result.report, reading.loads({"torque": SCENE, "drive": DRIVEN}[name], ROOT)
    full, scheme = build.chosen_form(scene, build.system(scene)), GeneralizedAlpha(1e-3)
    assert report["dofs"] < 0.5 * full.size
    u = (
        (lambda t: 0.8 * np.sin(11.0 * t))
        if name == "torque"
        else (lambda t: 0.2 * (1.0 - np.cos(9.0 * t)))
    )
    told = {"u": u, "push": lambda t: 2.0 * np.sin(31.0 * t)}
    motions = [
        outputs(integrate(with_inputs(one, told), scheme, 0.4))
        for one in (full, files.load(str(report["file"])))
    ]
    for column, values in motions[0].items():
        stated = report["output_errors"][column]["relative"]
        assert np.abs(values - motions[1][column]).max() < max(3.0 * stated, 1e-6) * np.ptp(values)
        assert stated < 5e-3


def test_what_the_report_says(reduced: dict[str, studies.ReductionResult]) -> None:
    report = reduced["torque"].report
    told = report["training_signals"]
    assert (told["runs"], told["seed"], told["slowest"], told["fastest"]) == (3, 0, 2.5, 50.0)
    assert told["ranges"] == {"u": (-1.0, 2.0), "push": (-3.0, 3.0)}
    assert any("not trained on" in str(line) for line in reduced["torque"].lines)


def test_models_keep_ranges_and_runs_that_leave_them_say_so_once(
    reduced: dict[str, studies.ReductionResult],
) -> None:
    system = files.load(str(reduced["torque"].report["file"]))
    assert inputs_of(system)["u"] == Input("u", "N m", 0.0, range=(-1.0, 2.0))
    run = start(system, GeneralizedAlpha(1e-3))
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        run.step({"u": 2.0, "push": -3.0})
    with pytest.warns(
        Notice,
        match=r"run.step: input 'u' is set to 2.5, outside of its range from -1 to 2 N m: .* not trained",
    ):
        run.step({"u": 2.5})
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        run.step({"u": 3.0})


def test_seeds_make_the_same_model(
    reduced: dict[str, studies.ReductionResult], tmp_path: Path
) -> None:
    again = studies.reduce(write(tmp_path, "plant", SCENE), out=tmp_path / "model.h5")
    np.testing.assert_array_equal(again.reduced.x, reduced["torque"].reduced.x)


U = "{range: [-1 N m, 2 N m]}"


@pytest.mark.parametrize(
    "new, message",
    [
        (
            "{range: [2 N m, -1 N m]}",
            r"inputs.u.range: expected the lower end before the higher one, got 2 to -1 N m",
        ),
        (
            "{range: [-1 N m, -1 N m]}",
            r"inputs.u.range: expected the lower end before the higher one",
        ),
        (
            "{range: [1 N m, 2 N m]}",
            r"inputs.u.range: .* got a start of 0; give the input a `start` in its range",
        ),
        (
            "{start: 3 N m, range: [-1 N m, 2 N m]}",
            r"inputs.u.start: expected a start from -1 to 2 N m, got 3",
        ),
        (
            "{unit: N, range: [-1 m, 2 N]}",
            r"inputs.u.range: expected a force \[N\], got '-1 m' \(length\)",
        ),
        (
            "{range: [-1 N m, 2 N]}",
            r"inputs.u.range: expected a moment \[N m\], got '2 N' \(force\)",
        ),
        (
            "{range: [1 N m]}",
            r"inputs.u.range: expected a list of two quantities, the lower one first, got a list of 1",
        ),
        (
            "{ranges: [-1 N m, 2 N m]}",
            r"inputs.u.ranges: expected one of the keys .* did you mean 'range'",
        ),
    ],
)
def test_wrong_ranges_are_refused(new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace(U, new))


@pytest.mark.parametrize(
    "given, message",
    [
        ("{runs: 0}", r"reduction.signals.runs: expected a number >= 1, got 0"),
        ("{fastest: 0 Hz}", r"reduction.signals.fastest: expected a quantity \[Hz\] > 0"),
        ("{seeds: 1}", r"reduction.signals.seeds: expected one of the keys .* did you mean 'seed'"),
    ],
)
def test_wrong_signals_are_refused(given: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace("snapshots: 2 ms", f"snapshots: 2 ms, signals: {given}"))


def test_ranges_may_follow_parameters() -> None:
    text = SCENE.replace("inputs:", "parameters: {most: 2 N m}\ninputs:").replace(
        "[-1 N m, 2 N m]", "[-most, most]"
    )
    assert reading.loads(text, parameters={"most": 4.0}).inputs["u"].range == (-4.0, 4.0)


BOX = SCENE.replace(
    "bodies:", "parameters: {E: {value: 3 GPa, range: [2 GPa, 4 GPa]}}\nbodies:"
).replace("modulus: 3 GPa", "modulus: E")
TRAINING = "training: {candidates: 5, samples: 3, iterations: 2, holdout: 2}\n"


def test_a_box_is_trained_under_signals_and_checked_under_others(tmp_path: Path) -> None:
    """Its model is at rest until it is driven, and then follows the full one at a modulus and a
    signal that no run has had.
    """
    place = write(tmp_path, "box", BOX + TRAINING)
    found = studies.train(place, out=tmp_path / "out", plots=False)
    assert found.model is not None
    report = found.report
    assert report["training_signals"]["ranges"] == {"u": (-1.0, 2.0), "push": (-3.0, 3.0)}
    scene = reading.loads(BOX, ROOT, {"E": "2.3 GPa"})
    full, reduced = (
        build.chosen_form(scene, build.system(scene)),
        found.model.model({"E": 2.3e9}).system,
    )
    told = {"u": lambda t: 0.8 * np.sin(11.0 * t), "push": lambda t: 2.0 * np.sin(31.0 * t)}
    motions = [
        outputs(integrate(with_inputs(one, told), GeneralizedAlpha(1e-3), 0.4))
        for one in (full, reduced)
    ]
    for column, values in motions[0].items():
        stated = report["holdout"]["outputs"][column]["relative"]
        assert np.abs(motions[1][column] - values).max() <= max(3.0 * stated, 1e-4) * np.ptp(
            values
        ), column
    assert 0.0 < report["holdout"]["max_error"] < 0.02
    trained = (
        {run.values["E"] for run in (*found.training.runs, *found.training.checks)}
        if found.training
        else set()
    )
    both = sum(any(abs(row[0] - E) < 1.0 for E in trained) for row in report["holdout"]["points"])
    assert (f"{both} of the 2 hold-out points are full runs" in str(found)) == (both > 0)
    still = outputs(integrate(reduced, GeneralizedAlpha(1e-3), 0.1))
    assert max(np.ptp(values) for values in still.values()) < 1e-9
    again = studies.train(place, out=tmp_path / "out", plots=False, resume=True)
    np.testing.assert_array_equal(again.report["holdout"]["true"], report["holdout"]["true"])


def test_runs_of_a_box_have_the_same_signals_and_its_checks_others() -> None:
    task = greedy_training.prepare(
        Job(), reading.loads(BOX + TRAINING, ROOT), None, None, None
    ).task
    assert isinstance(task.signals, training_signals.Signals)
    cases = [task.family({"E": E}) for E in (2e9, 4e9)]
    soft, stiff = (task.signals.histories(case) for case in cases)
    check = task.signals.check.histories(cases[0])
    for name in ("u", "push"):
        assert soft[name].values == stiff[name].values
        assert np.abs(np.subtract(soft[name].values, check[name].values)).max() > 0.5
        assert inputs_of(task.driven(cases[0]).system).keys().isdisjoint(("u", "push"))


def test_a_plant_at_rest_is_compared_under_signals(tmp_path: Path) -> None:
    """All models, also one of fewer cells, have the same: the coarse one is not off by a motion of
    its own.
    """
    scene = write(tmp_path, "plant", SCENE + "compare: {coarse: [5], steps: [2 ms]}\n")
    study = studies.compare(scene, picture=False).study
    rows = {record.name: record for record in study.records}
    assert np.ptp(outputs(study.full)["hinge"]) > 0.1
    assert rows["component+ecsw-points"].max_error < 1e-3
    assert (
        0.0 < next(record.max_error for record in study.records if record.family == "coarse") < 0.05
    )
    assert study.signals["ranges"] == {"u": (-1.0, 2.0), "push": (-3.0, 3.0)}
    with pytest.raises(InputError, match="a motion of its own"):
        studies.compare(scene, picture=False, true=True)
