"""Reduced models where they pay: eps and eta follow from the accuracy of a scene, and reports say
first whether training pays.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from fmbs_skfem import studies
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.families import training_work, worth
from fmbs_skfem.reduction import NONE, Plan, Points, affine, full_runs, reduced_models
from fmbs_skfem.reduction.accuracy import error_budget
from fmbs_skfem.reduction.accuracy.costs import Payoff
from fmbs_skfem.reduction.full_runs import OutputMeasure
from fmbs_skfem.scenes import build
from fmbs_skfem.studies import greedy_training, plans
from fmbs_skfem.studies import job as jobs

from ..cli.calls import CANTILEVER, fmbs, scene

REDUCED = CANTILEVER + "reduction: {{snapshots: 2 ms}}\n"
SHAKEN = "{type: dynamic, duration: 0.3 s, step: auto, rho_inf: 0.8}"
RANGE = REDUCED.replace("{{load: 0.5 N}}", "{{load: {{value: 0.5 N, range: [0.4 N, 0.6 N]}}}}")
TRAINED = RANGE + "training: {{candidates: 5, samples: 3, iterations: 2}}\n"
HISTORY = "sin(60*t)"
BEAM = Plan({"beam": ("beam",)})


def reduce(
    folder: Path, *options: str | Path, text: str = REDUCED, analysis: str = SHAKEN
) -> dict[str, Any]:
    call = fmbs(
        "reduce",
        scene(folder, analysis, HISTORY, text),
        *options,
        "--out",
        folder / "model.h5",
        "--force",
        "--json",
    )
    assert call.code == 0, call.err
    return call.json


def test_a_training_pays_after_what_it_took_over_what_a_run_saves() -> None:
    payoff = Payoff(0.031, 0.7, 0.012)
    assert payoff.words == "full: 31 ms a run; training 0.7 s; reduced 12 ms: pays from 37 runs"
    assert payoff.report == {
        "pays": True,
        "pays_after_runs": pytest.approx(0.7 / 0.019),
        "speedup": pytest.approx(31 / 12),
    }
    slow = Payoff(0.031, 0.7, 0.0258)
    assert slow.words.endswith("reduced 26 ms: does not pay: 1.2 times as fast as the full model")
    assert (slow.pays, slow.runs) == (False, None)
    assert Payoff(1.5, 0.0, 1.0).pays
    failed = Payoff(0.031, 0.7, math.nan)
    assert not failed.pays
    assert failed.words.endswith("reduced -: does not pay: a run of it fails")


def test_tolerances_go_from_coarse_to_fine_until_one_is_good_enough() -> None:
    """Errors are given here: sqrt(eps), and eta beside it."""
    tried: list[tuple[float, float | None]] = []

    def error(plan: Plan) -> float:
        tried.append((plan.tolerance, plan.hyper.tolerance))
        return math.sqrt(plan.tolerance) + (plan.hyper.tolerance or 0.0)

    start = replace(BEAM, hyper=Points(0.5))
    found = error_budget.coarsest(start, error, 2e-4, True, True)
    assert (found.tolerance, found.hyper.tolerance) == (pytest.approx(1e-8), pytest.approx(1e-4))
    assert [hyper for _, hyper in tried] == [None, None, *error_budget.LADDER_ETA[:3]]
    given = error_budget.coarsest(replace(start, tolerance=1e-9), error, 2e-4, False, True)
    assert (given.tolerance, given.hyper.tolerance) == (1e-9, pytest.approx(1e-4))
    sampled = error_budget.coarsest(replace(start, hyper=Points(1e-4)), error, 2e-4, True, False)
    assert (sampled.tolerance, sampled.hyper.tolerance) == (pytest.approx(1e-8), 1e-4)
    whole = error_budget.coarsest(BEAM, error, 2e-4, True, True)
    assert (whole.tolerance, whole.hyper) == (pytest.approx(1e-8), NONE)
    best = error_budget.coarsest(
        BEAM, lambda plan: abs(math.log10(plan.tolerance) + 12.0) + 1.0, 0.5, True, True
    )
    assert best.tolerance == pytest.approx(1e-12)


@pytest.mark.parametrize(
    "wanted", ["1e-2", "1e-4"]
)  # of the tip; the clamp feels waves that snapshots miss
def test_eps_and_eta_are_the_coarsest_for_the_accuracy(tmp_path: Path, wanted: str) -> None:
    accuracy = f"tip={wanted}"
    found = reduce(tmp_path, "--accuracy", accuracy)
    assert found["error_over_accuracy"] <= plans.SHARE
    budget = found["budget"]
    assert budget.keys() == {"step", "mesh", "reduction", "together"}
    assert budget["reduction"] == found["error_over_accuracy"]
    assert budget["together"] == pytest.approx(
        sum(part for name, part in budget.items() if name != "together")
    )
    errors = [one["relative"] for one in found["output_errors"].values() if one["output"] == "tip"]
    assert found["error_over_accuracy"] == pytest.approx(max(errors) / float(wanted))
    coarser = reduce(
        tmp_path,
        "--accuracy",
        accuracy,
        "--tolerance",
        f"{100 * found['tolerance']:g}",
        "--hyper",
        "0",
    )
    assert coarser["tolerance"] == pytest.approx(100 * found["tolerance"])
    assert coarser["error_over_accuracy"] > plans.SHARE
    assert any("leave out eps and eta" in text for text in coarser["notices"])
    if found["hyper_tolerance"] < error_budget.LADDER_ETA[0]:
        hyper = 10 * found["hyper_tolerance"]
        sparser = reduce(
            tmp_path,
            "--accuracy",
            accuracy,
            "--tolerance",
            f"{found['tolerance']:g}",
            "--hyper",
            f"{hyper:g}",
        )
        assert sparser["error_over_accuracy"] > plans.SHARE


def test_what_scene_and_options_give_stays(tmp_path: Path) -> None:
    text = REDUCED.replace(
        "snapshots: 2 ms", "snapshots: 2 ms, tolerance: 1e-9, hyper_reduction: {{tolerance: 2e-3}}"
    )
    found = reduce(tmp_path, "--accuracy", "1e-2", text=text)
    assert (found["tolerance"], found["hyper_tolerance"]) == (1e-9, 2e-3)
    modes = reduce(tmp_path, "--accuracy", "1e-2", "--modes", "9")
    assert (modes["tolerance"], modes["modes"]) == (None, {"beam": 9})
    usual = reduce(tmp_path, analysis="{type: dynamic, duration: 0.3 s, step: 1 ms}")
    assert (usual["tolerance"], usual["hyper_tolerance"], usual["accuracy"]) == (1e-12, 1e-3, None)


def test_snapshots_that_are_too_few_are_told(tmp_path: Path) -> None:
    """Three states of a shaken beam are no basis of its motion, whatever eps."""
    found = reduce(
        tmp_path, "--accuracy", "1e-2", text=REDUCED.replace("snapshots: 2 ms", "snapshots: 0.15 s")
    )
    assert found["error_over_accuracy"] > plans.SHARE
    assert any(
        "0.3 of it is aimed at; take snapshots more often" in text for text in found["notices"]
    )


def test_the_first_line_says_whether_it_pays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A beam of a few cells is trained here, though no reduced model is faster."""
    monkeypatch.setattr(worth, "require_gain", lambda *seconds: None)
    monkeypatch.setattr(worth, "LARGEST", 1.0)
    path = scene(tmp_path, SHAKEN, HISTORY, TRAINED)
    call = fmbs("reduce", path, "--accuracy", "1e-2", "--out", tmp_path / "model.h5")
    assert call.code == 0, call.err
    assert call.out.startswith("full: ")
    assert "pay" in call.out.splitlines()[0]
    out = tmp_path / "out"
    call = fmbs("train", path, "--accuracy", "1e-2", "--no-plots", "--out", out)
    assert call.code == 0, call.err
    report = json.loads((out / "report.json").read_text())
    payoff = Payoff(report["cpu_s_full"], report["training_s"], report["cpu_s"])
    assert call.out.splitlines()[0] == payoff.words
    assert payoff.report == {key: report[key] for key in ("pays", "pays_after_runs", "speedup")}
    assert report["training_s"] >= report["cpu_s_full_runs"] + report["cpu_s_models"]
    assert report["tolerance"] == pytest.approx(plans.SHARE * 1e-2)
    assert report["budget"] is not None


@pytest.mark.parametrize(
    ("fast", "growth", "full"),
    [(20.0, 1.0, 1), (0.1, 100.0, 1 + training_work.CORNERS)],
    ids=["by one run", "by three"],
)
def test_a_training_that_cannot_pay_ends_before_it_begins(
    fast: float,
    growth: float,
    full: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first full run says so, or three: nothing is fitted, and no file of a model is written."""
    made, fitted = Mock(wraps=full_runs.run_case), Mock(wraps=affine.fit)
    monkeypatch.setattr(full_runs, "run_case", made)
    monkeypatch.setattr(affine, "fit", fitted)
    # one full run that something else slows down looks 1.5 times as long: the threshold has a test
    # of its own
    monkeypatch.setattr(training_work, "FAST", fast)
    monkeypatch.setattr(worth, "GROWTH", growth)
    out = tmp_path / "out"
    call = fmbs(
        "train",
        scene(tmp_path, SHAKEN, HISTORY, TRAINED),
        "--accuracy",
        "1e-2",
        "--no-plots",
        "--out",
        out,
    )
    assert call.code == 0, call.err
    first, second = call.out.splitlines()[:2]
    assert "does not pay: " in first
    assert second.startswith("No model: take the full one (accuracy 0.01 of the range: ")
    assert "--accuracy 1e-2 does; --tolerance 0.003 trains one all the same." in second
    report = json.loads((out / "report.json").read_text())
    assert (report["status"], report["pays"], report["pays_after_runs"]) == (
        "does not pay",
        False,
        None,
    )
    assert first.endswith(report["reason"])
    assert not (out / "model.h5").exists()
    assert made.call_count == full
    assert not fitted.called


def test_a_basis_of_half_the_coordinates_does_not_pay(tmp_path: Path) -> None:
    """Modes of one full run of a shaken beam."""
    task = order(scene(tmp_path, SHAKEN, HISTORY, TRAINED), "1e-1").task
    run = full_runs.full_run(replace(task, plan=replace(task.plan, tolerance=1e-20)), {"load": 0.5})
    half = int(worth.LARGEST * worth.coordinates(run))
    worth.require_small(replace(task, plan=replace(task.plan, modes=half // 2)), [run])
    with pytest.raises(
        worth.DoesNotPay,
        match=r"takes \d+ modes for one full run, where the full model has \d+ coordinates",
    ):
        worth.require_small(replace(task, plan=replace(task.plan, modes=half + 1)), [run])


def test_a_model_has_to_be_faster_by_half(tmp_path: Path) -> None:
    worth.require_gain(0.03, 0.019)
    with pytest.raises(worth.DoesNotPay, match=r"1\.43 times as fast as the full model") as found:
        worth.require_gain(0.03, 0.021)
    assert (found.value.full_s, found.value.run_s) == (0.03, 0.021)
    declined = Payoff(0.03, 0.7, math.nan, "too many modes")
    assert declined.words == "full: 30 ms a run; training 0.7 s: does not pay: too many modes"
    assert declined.report == {"pays": False, "pays_after_runs": None, "speedup": None}


@pytest.mark.parametrize(
    ("errors", "tried", "chosen"),
    [
        (
            [0.3, 7e-2, 2.4e-3, 1.7e-3, 1.5e-3, 1.5e-3, 1.4e-3],
            6,
            3,
        ),  # snapshots are the limit: what is as good, and no further
        ([0.3, 2e-3, 2e-3, 1e-3, 8e-4, 1e-5], 5, 4),  # two that are alike have the same modes
        ([0.3, 1e-4], 2, 1),
    ],
)
def test_eps_is_not_lowered_where_truncation_is_not_the_limit(
    monkeypatch: pytest.MonkeyPatch, errors: list[float], tried: int, chosen: int
) -> None:
    """A share of 9e-4 of 3e-3 is asked for."""
    known: list[float] = []

    def error(task: object, run: object, plan: Plan) -> float:
        known.append(plan.tolerance)
        return errors[len(known) - 1]

    monkeypatch.setattr(error_budget, "error_at", error)
    task: Any = SimpleNamespace(plan=replace(BEAM, hyper=NONE), measure=None)
    eps, found = error_budget.choose_eps(task, None, 3e-3, 0.3, 0)  # type: ignore[arg-type]
    assert (len(known), eps, found) == (tried, known[chosen], errors[chosen])


def order(
    path: Path, accuracy: str, tolerance: float | None = None
) -> greedy_training.TrainingOrder:
    with jobs.begin(path, accuracy=accuracy) as job:
        return greedy_training.prepare(job, jobs.read_scene(job), tolerance, None, None)


def test_a_training_aims_at_a_share_of_the_accuracy(tmp_path: Path) -> None:
    path = scene(tmp_path, SHAKEN, HISTORY, TRAINED)
    found = order(path, "1e-2")
    assert found.tolerance == pytest.approx(3e-3)
    assert found.task.measure == OutputMeasure()
    assert order(path, "1e-2", 1e-3).tolerance == 1e-3
    by_output = order(path, "tip=1 mm, clamp=5 %")
    assert by_output.tolerance == plans.SHARE
    assert isinstance(by_output.task.measure, plans.AccuracyMeasure)
    given = scene(
        tmp_path,
        SHAKEN,
        HISTORY,
        TRAINED.replace("iterations: 2", "iterations: 2, tolerance: 2e-3"),
    )
    assert order(given, "1e-2").tolerance == 2e-3


def test_families_have_the_step_and_the_cells_that_were_found(tmp_path: Path) -> None:
    """A run may have other steps: its states may lie within them, and snapshots may not."""
    with jobs.begin(scene(tmp_path, SHAKEN, HISTORY, TRAINED), accuracy="1e-2") as job:
        found = jobs.read_scene(job)
        task = greedy_training.prepare(job, found, None, None, None).task
    assert job.plan is not None
    for load in (0.4, 0.6):
        case = task.family({"load": load})
        assert case.scheme.step == job.plan.step
        assert case.system.size == build.system(found).size


def test_an_accuracy_by_output_is_the_measure_of_a_training(tmp_path: Path) -> None:
    """Where what is wanted is half, errors count twice."""
    path = scene(tmp_path, SHAKEN, HISTORY, TRAINED)
    rough, fine = order(path, "tip=1 mm, clamp=5 %"), order(path, "tip=0.5 mm, clamp=2.5 %")
    task = replace(rough.task, plan=replace(rough.task.plan, tolerance=1e-6))
    run = full_runs.full_run(task, {"load": 0.5})
    motion = full_runs.run_formed(task, reduced_models.make_model(task, [run]).cases({"load": 0.5}))
    raw = task.family(run.values).system
    assert rough.measure == "error of the outputs over the accuracy"
    values = [one.task.measure(raw, run, motion) for one in (rough, fine) if one.task.measure]
    assert values[0] > 0.0
    assert values[1] == pytest.approx(2.0 * values[0])
    found = full_runs.errors_of_outputs(raw, run, motion)
    parts = [
        one.error / 1e-3 if one.output == "tip" else one.relative / 0.05 for one in found.values()
    ]
    assert values[0] == pytest.approx(max(parts))


def test_trials_warn_of_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A basis that leaves out a hundredth of the motion would be warned of, were it not one of a
    trial.
    """
    monkeypatch.setattr(error_budget, "LADDER_EPS", (1e-4, 1e-12))
    path = scene(tmp_path, SHAKEN, HISTORY, REDUCED)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        found = studies.reduce(path, accuracy="tip=1e-3")
    assert found.report["tolerance"] == 1e-12
    assert found.report["notices"] == []
