"""One reduced model for whole ranges of a scene's parameters, by the greedy algorithm with Kriging.

The work is in `families.training`; here a scene becomes its input, and what it found becomes files,
tables and figures.
"""

from __future__ import annotations

import functools
import math
import shutil
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import scenes
from ..core.errors import FmbsError, InputError, NoModel, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..families import greedy, parametric_model, prediction, trials
from ..families import training as trainings
from ..families import training_store as store
from ..families.worth import DoesNotPay
from ..reduction import files, full_runs, parameters, training_signals
from ..reduction.accuracy.costs import FAST, Payoff
from ..reduction.full_runs import Measure, OutputMeasure, TrainingTask
from ..scenes import build, points
from ..scenes.training_options import Allowed
from . import holdouts, kinds, models, plans, reports
from . import job as jobs
from .job import Job
from .planning.training_order import TrainingOrder
from .result import ReportTable, Result, describe_error, list_files
from .running import compiling, exportable, viewing

if TYPE_CHECKING:
    from ..families.parametric_model import ParametricModel
    from ..families.training import FinishedTraining
    from ..scenes import Scene
    from .holdouts import Checked

HALF = 0.5  #: of the wanted error, which a model is to keep at hold-out points: it may err by more between them
MODEL, STORE = "model.h5", "training"


@dataclass(frozen=True, repr=False, kw_only=True)
class TrainingResult(Result):
    """A reduced model of a box of parameters."""

    model: ParametricModel | None  #: None where none can pay
    training: FinishedTraining | None
    holdout: Checked | None  #: what was found at hold-out points


def train_order(
    job: Job, order: TrainingOrder, out: Path | None, html: bool = False
) -> TrainingResult:
    """The training, its hold-out points, figures, report and page (`html`); without a model the
    error that says why.
    """
    raw = order.task.family({}).system
    exportable.announce(job, order.scene, raw, ranged=True)
    if out is not None:
        files.require_savable(raw)
    if compiling.announce(job, reduces=True):
        trials.compile_training(order.task)
    made = {
        "fingerprint": reports.fingerprint(order.scene),
        "provenance": reports.provenance(order.scene),
        "notices": job.notices,
    }
    try:
        advance = job.progress("training")
        place = out / STORE if out else None
        begun = clock.process_time()
        found = trainings.train(
            order.task,
            order.search,
            order.options,
            place,
            order.tolerance,
            advance,
            True,
            **order.proof,
        )
    except DoesNotPay as error:
        return decline(job, order, error, clock.process_time() - begun, made)
    except NoModel as error:
        report = {**describe_error(error), **heading(order), **made}
        jobs.deliver(job, report)
        error.result = Result(about=str(error), report=report, lines=list_files(report))
        raise
    model = make_product(order, found)
    spent = clock.process_time() - begun
    if out is not None:
        save_model(model, out)
    checked = holdouts.check(job, order, found, model) if len(order.points.holdout) else None
    doubts = find_doubts(order, found, checked)
    payoff = find_payoff(found, checked, spent)
    warn_of_cost(order, payoff, checked)
    model = replace(model, notes={**model.notes, prediction.DOUBTS: doubts})
    figures = holdouts.figures(order, found, checked)
    report = {
        **report_of(order, found),
        "status": "no promise" if doubts else "ok" if payoff.pays else "does not pay",
        "doubts": doubts,
        **payoff.report,
        "cpu_s_full": payoff.full_s,
        "cpu_s": payoff.run_s,
        "training_s": payoff.training_s,
        **({} if checked is None else {"holdout": holdouts.report_of(order, checked)}),
        **made,
    }
    page = functools.partial(viewing.of_model, job, MODEL) if html else None
    jobs.deliver(job, report, functools.partial(save_model, model), figures, page)
    view: list[ReportTable | str] = [payoff.words, *summarise(report)]
    shown = {key: report[key] for key in ("training_signals",) if key in report}
    if checked is not None:
        view += [holdouts.table(checked, order.measure), *holdouts.trained_there(order, found)]
        shown["output_errors"] = holdouts.largest_of_outputs(checked)
    about = f"{report['scene']}: {report['full_runs']} full runs, largest predicted error {found.predicted.error:.1e}"
    view += [*kinds.views(shown, order.scene.display), *list_files(report)]
    return TrainingResult(
        about=about,
        report=report,
        lines=view,
        figures=figures,
        model=model,
        training=found,
        holdout=checked,
    )


def decline(
    job: Job, order: TrainingOrder, error: DoesNotPay, spent: float, made: Mapping[str, Any]
) -> TrainingResult:
    """No model, since none can be faster than the full one of the accuracy: what was found, and
    what to do instead.
    """
    payoff = Payoff(error.full_s, spent, error.run_s, error.reason)
    report = {
        **heading(order),
        "status": "does not pay",
        **payoff.report,
        "reason": error.reason,
        "cpu_s_full": payoff.full_s,
        "cpu_s": None if math.isnan(payoff.run_s) else payoff.run_s,
        "training_s": payoff.training_s,
        "accuracy": str(job.wanted),
        "tolerance": order.tolerance,
        **made,
    }
    jobs.deliver(job, report)
    option = "" if job.accuracy is None else f" --accuracy {job.accuracy}"
    sweep = f"fmbs sweep {order.scene.path or 'SCENE'}{option}"
    plan = "" if job.plan is None else f" ({job.plan.words})"
    remedy = f"No model: take the full one{plan}, as {sweep} does; --tolerance {order.tolerance:g} trains one all the same."
    lines = [payoff.words, remedy, *list_files(report)]
    about = f"{report['scene']}: {payoff.words}"
    return TrainingResult(
        about=about, report=report, lines=lines, model=None, training=None, holdout=None
    )


def save_model(model: ParametricModel, out: Path) -> list[Path]:
    """The model in its folder."""
    parametric_model.save(model, out / MODEL)
    return [out / MODEL]


def prepare(
    job: Job, scene: Scene, tolerance: float | None, iterations: int | None, holdout: int | None
) -> TrainingOrder:
    """The input of a training from a scene and the options that replace its values."""
    section = points.section(scene)
    plan = plans.plan(scene)
    interval = plans.interval(scene)
    known, family = scenes.family(scene, allow_outside=job.allow_outside, duration=job.duration)
    chosen = points.of(section, known, holdout)
    allowed = (
        dict(section.tolerance.values)
        if isinstance(section.tolerance, Allowed) and tolerance is None
        else None
    )
    measure: Measure | None = OutputMeasure(allowed or {}) if scene.outputs else None
    aim = HALF
    own = 1.0 if isinstance(section.tolerance, Allowed) else section.tolerance
    if (
        must_pay := own is None
        and tolerance is None
        and job.wanted is not None
        and bool(scene.outputs)
    ):
        aim = 1.0
        (own, measure) = plans.tolerance_for(job.wanted)  # which is a share of the accuracy
    wanted = own if tolerance is None else tolerance
    form = functools.partial(build.chosen_form, scene)
    task = TrainingTask(family, known, plan, interval, form, measure, reports.hash_of_code(scene))
    task = replace(task, signals=training_signals.of_box(task, plans.sections(scene)[1].signals))
    search = parameters.search(known, chosen.candidates, chosen.samples, chosen.first)
    most = max(section.max_samples, len(search.samples))
    options = greedy.Options(
        iterations=iterations or section.iterations, max_samples=most, seed=section.seed
    )
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(
            say(
                "--tolerance",
                "an error between 0 and 1, a part of the ranges of the outputs",
                wanted,
                "1e-4 for instance",
            )
        )
    return TrainingOrder(scene, task, search, options, chosen, wanted, aim, must_pay, allowed)


def folder(job: Job, scene: Scene, resume: bool) -> Path | None:
    """The output folder; with --force without the runs of an earlier training.

    Where a training was stopped between its model and its report, the training itself tells whether
    it is this one.
    """
    out = job.out
    if resume and (out is None or not (out / STORE).is_dir()):
        raise InputError(
            say("--resume", f"a training in '{out}'", "none", "leave the option out to begin one")
        )
    if out is None:
        return None
    if job.force and (out / STORE).is_dir():
        shutil.rmtree(out / STORE)
    unfinished = (
        store.store_of(out / STORE).there(store.TITLE, None) and not (out / reports.REPORT).exists()
    )
    return jobs.settle_folder(
        job, () if unfinished else (MODEL, reports.REPORT), reports.fingerprint(scene)
    )


def make_product(order: TrainingOrder, found: FinishedTraining) -> ParametricModel:
    """The model with what it needs to predict its own error and a record of its training."""
    scene = order.scene
    notes = {
        "scene": jobs.title(scene),
        "hashes": parametric_model.hashes(reports.scene_files(scene)),
        "fixed": {
            name: value for name, value in scene.parameters.items() if name not in scene.ranges
        },
        "training": reports.plain(record(order, found)),
        prediction.KEY: {**prediction.record(found), "measure": order.measure},
        "provenance": reports.provenance_to_keep(reports.provenance(scene), scene),
        **scene.display.note,
    }
    return parametric_model.ParametricModel(found.model.parametric, notes)


def find_doubts(
    order: TrainingOrder, found: FinishedTraining, checked: Checked | None
) -> list[str]:
    """Why the predicted error cannot be promised; nothing where it can."""
    true = [] if checked is None else checked.true.tolist()
    high = [] if checked is None else [one.high for one in checked.predictions]
    unresolved = sum(run.unresolved for run in found.full_runs)
    off = max(run.part_error for run in found.full_runs)
    return prediction.doubts(
        len(found.full_runs),
        found.predicted,
        true,
        high,
        order.tolerance,
        unresolved,
        off,
        order.aim,
    )


def find_payoff(found: FinishedTraining, checked: Checked | None, spent: float) -> Payoff:
    """Whether the model pays beside full runs at the same points; `spent` is the CPU time of the
    training in this process [s].

    Of a training that went on in its folder that is a part: what its stored runs and models have
    taken counts at least.
    """
    full = [run.cpu_s for run in found.full_runs]
    training_s = max(spent, sum(full) + sum(model.training_s for model in found.models))
    if checked is not None:
        return Payoff(checked.full_s, training_s, checked.last.run_s)
    run = found.runs[-1]
    try:
        run_s = full_runs.run_formed(found.task, found.model.cases(run.values)).statistics.cpu_s
    except FmbsError:
        run_s = math.nan
    return Payoff(run.cpu_s, training_s, run_s)


def warn_of_cost(order: TrainingOrder, payoff: Payoff, checked: Checked | None) -> None:
    """Say that a reduced model does not pay, and which one of the training does at the error that
    is wanted.
    """
    if payoff.pays:
        return
    remedy = "sweep with the full model (fmbs sweep SCENE)"
    stages = checked.rows if checked else ()
    for number, row in enumerate(stages, start=1):
        times = payoff.speedup * stages[-1].run_s / row.run_s
        if times >= FAST and row.max_error <= (order.tolerance or math.inf):
            remedy += (
                f", or train with --iterations {number}, whose model is {times:.2g} times as fast"
            )
            remedy += f" and errs by {row.max_error:.2g} at the hold-out points"
            break
    notify(f"the reduced model does not pay: {payoff.reason}; {remedy}")


def record(order: TrainingOrder, found: FinishedTraining) -> dict[str, Any]:
    """What was run, chosen and reached."""
    plan, known = found.task.plan, found.task.parameters
    candidates = found.search.candidates
    return {
        "full_runs": len(found.runs),
        "checks": [run.values for run in found.checks],
        "reduced_runs": found.reduced_runs,
        "hyper_reductions": sum(bool(model.selections) for model in found.models),
        "stop": found.outcome.stop.value,
        "points": [run.values for run in found.runs],
        "failed": [
            {"point": parameters.named(known, candidates[number]), "reason": reason}
            for number, reason in found.outcome.failed
        ],
        "modes": dict(found.model.modes),
        "left_out": dict(found.model.left_out),
        "kept": {
            selection.component: len(selection.sample.indices)
            for selection in found.model.selections
        },
        **({"training_signals": excitation(order.task)} if order.task.signals else {}),
        "measure": order.measure,
        "tolerance": order.allowed or order.tolerance,
        "eps": plan.tolerance if plan.modes is None else None,
        "eta": plan.hyper.tolerance,
        "level": plan.hyper.name,
        "budget": None
        if found.choice is None
        else {**asdict(found.choice), "statement": found.choice.statement},
        "largest_indicator": found.last.largest,
        "predicted_error": found.predicted._asdict(),
        "cpu_s_full_runs": sum(run.cpu_s for run in found.full_runs),
        "cpu_s_models": sum(model.training_s for model in found.models),
    }


def excitation(task: TrainingTask) -> dict[str, Any]:
    """What the inputs of a plant have in all runs of its training."""
    assert isinstance(task.signals, training_signals.Signals)
    return task.signals.facts(task.family(parameters.completed(task.parameters, {})).system)


def heading(order: TrainingOrder) -> dict[str, Any]:
    """What is trained: the scene, its parameters and candidates."""
    return {
        "scene": jobs.title(order.scene),
        "file": order.scene.path,
        "parameters": parameters.described(order.task.parameters),
        "candidates": len(order.search.candidates),
    }


def report_of(order: TrainingOrder, found: FinishedTraining) -> dict[str, Any]:
    """The report without hold-out points."""
    return {
        **heading(order),
        **record(order, found),
        "iterations": [
            {
                "point": found.runs[k].values,
                "samples": len(iteration.samples),
                "largest_indicator": iteration.largest,
                "modes": dict(found.models[k].modes),
            }
            for k, iteration in enumerate(found.outcome.iterations)
        ],
    }


def summarise(report: Mapping[str, Any]) -> list[str]:
    """What was run and chosen, what error is predicted, and why the training ended."""
    modes = " + ".join(str(count) for count in report["modes"].values())
    kept = " + ".join(str(count) for count in report["kept"].values())
    text = f"{report['scene']}: full runs: {report['full_runs']}, reduced runs: {report['reduced_runs']}, "
    text += f"sNNLS: {report['hyper_reductions']}; {modes} modes" + (
        f", {kept} {report['level']} kept; " if kept else "; "
    )
    text += f"{report['cpu_s_full_runs']:.3g} s CPU in full runs, {report['cpu_s_models']:.3g} s in bases and hyper-reduction."
    points = "; ".join(map(format_point, report["points"]))
    if report["budget"] is not None:
        budget = f"Error budget {report['budget']['statement']}."
    else:
        budget = f"eps = {report['eps']}, eta = {report['eta']}, as the scene says; --tolerance chooses them for a wanted error."
    error = report["predicted_error"]
    band = f"with the band {error['low']:.2g} to {error['high']:.2g}"
    largest = f"Largest predicted {report['measure']}, among the candidates: {error['error']:.2g}, {band}."
    lost = name_failed([*report["failed"], *report.get("holdout", {}).get("failed", ())])
    left = [
        f"The equation {name} is left out: it {why}."
        for name, why in report["left_out"].items()
        if why.startswith("locks")
    ]
    checks = "; ".join(map(format_point, report["checks"]))
    unseen = [f"Checked by full runs that are not in the model, at {checks}."] if checks else []
    return [
        text,
        f"Full runs at {points}.",
        *unseen,
        f"Training stopped: {report['stop']}.",
        *lost,
        *left,
        budget,
        largest,
        *models.say_doubts(report["doubts"]),
    ]


def name_failed(failed: Sequence[Mapping[str, Any]]) -> list[str]:
    """Where in the box the full model has no motion, each point with the first clause of the
    reason.
    """
    points = [f"{format_point(one['point'])} ({one['reason'].split(';')[0]})" for one in failed]
    return [f"The full model has no motion at {'; '.join(points)}."] if points else []


def format_point(point: Mapping[str, float]) -> str:
    """A point of the box as text."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in point.items())
