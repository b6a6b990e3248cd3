"""`fmbs train`: one reduced model for whole ranges of a scene's parameters, by the greedy algorithm with Kriging.

The work is in `reduction.training`; here a scene becomes its input, and what it found becomes files, tables and figures.
"""

from __future__ import annotations

import functools
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, NoModel, say
from . import common, reports, screen
from .common import Result, Session
from .tables import output_errors

if TYPE_CHECKING:
    from ..reduction.candidates import Search
    from ..reduction.full_runs import TrainingTask
    from ..reduction.greedy import Options
    from ..reduction.parametric_model import ParametricModel
    from ..reduction.training import Training
    from ..scenes import Scene
    from ..scenes.points import Points
    from .checking import Checked

MODEL, STORE = "model.h5", "training"


@dataclass(frozen=True)
class Job:
    """What is trained, and where hold-out runs are made."""

    scene: Scene
    task: TrainingTask
    search: Search
    options: Options
    points: Points
    tolerance: float | None  #: wanted error in the measure of the task
    allowed: Mapping[str, float] | None = None  #: wanted largest errors of outputs, of which `tolerance` 1 is the whole

    @property
    def measure(self) -> str:
        """What errors are, in words."""
        if self.task.measure is None:
            return "error of the displacements over their size"
        return "error of the outputs over their tolerances" if self.allowed else "error of the outputs over their ranges"


@common.command("train")
@click.option(
    "--tolerance", type=float, metavar="ERROR", help="Wanted error of outputs over their ranges; chooses eps, eta and the end."
)
@click.option("--iterations", type=click.IntRange(1), metavar="N", help="Largest number of full runs, instead of the scene's.")
@click.option(
    "--holdout", type=click.IntRange(0), metavar="N", help="Number of hold-out points, instead of the scene's; 0 for none."
)
@click.option("--compare", is_flag=True, help="Also train the comparators, and check all of them at the hold-out points.")
@click.option("--resume", is_flag=True, help="Insist that the folder holds an interrupted training to go on with.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of the analysis.")
@click.option("--plots/--no-plots", default=True, help="Draw the figures (default: yes).")
def command(
    session: Session,
    tolerance: float | None,
    iterations: int | None,
    holdout: int | None,
    compare: bool,
    resume: bool,
    duration: float | None,
    plots: bool,
) -> Result:
    """Train a reduced model over the ranges of SCENE's parameters, as its sections `training` and `reduction` say.

    Writes model.h5 (run it with fmbs rom run), report.json and figures into --out, or into ./fmbs-NAME-train where NAME.yaml is the
    scene, and every run and iteration into the folder `training` there: the same call again goes on where it was interrupted, and
    computes nothing twice.
    """
    from ..reduction import comparators, parametric_model, prediction
    from . import checking

    scene = common.read_scene(session, duration)
    job = prepared(session, scene, duration, tolerance, iterations, holdout)
    if compare and not len(job.points.holdout):
        raise InputError(say("--compare", "hold-out points", "none", "give --holdout N, or training.holdout in the scene"))
    out = folder(session, scene, resume)
    with screen.compiling(scene.path) as cold:
        if cold:
            comparators.warm(job.task)
    try:
        with screen.progress("training") as advance:
            found = trained(job, out, advance)
    except NoModel as error:
        return without_model(session, job, out, error)
    model = save(job, found, out)
    checked = checking.check(job, found, model, out, compare) if len(job.points.holdout) else None
    drawn = checking.draw(job, found, checked, out) if plots else []
    doubts = promised(job, found, checked)
    parametric_model.save(replace(model, notes={**model.notes, prediction.DOUBTS: doubts}), out / MODEL)
    report = {
        **told(job, found),
        "status": "no promise" if doubts else "ok",
        "doubts": doubts,
        **({} if checked is None else {"holdout": checking.report_of(job, checked)}),
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.provenance(scene),
        "files": [out / MODEL, out / reports.REPORT, *drawn],
    }
    reports.keep(session, out, report)
    tables = [] if checked is None else [checking.table(checked, job.measure), *output_errors(checking.largest_of_outputs(checked))]
    return Result(report, [*words(report), *tables, "written: " + ", ".join(map(str, report["files"]))])


def without_model(session: Session, job: Job, out: Path, error: NoModel) -> Result:
    """The report of a training that has no model, with the reason."""
    report = {
        **common.failed(error),
        **heading(job),
        "fingerprint": reports.fingerprint(job.scene),
        "provenance": reports.provenance(job.scene),
        "files": [out / reports.REPORT],
    }
    reports.keep(session, out, report)
    return Result(report, [f"written: {out / reports.REPORT}"], error)


def prepared(
    session: Session, scene: Scene, duration: float | None, tolerance: float | None, iterations: int | None, holdout: int | None
) -> Job:
    """The input of a training from a scene and the options that replace its values."""
    from .. import scenes
    from ..reduction import candidates, greedy
    from ..reduction.full_runs import OutputMeasure, TrainingTask
    from ..scenes import build, points
    from ..scenes.training import Allowed
    from . import compare

    section = points.section(scene)
    plan = compare.plan(scene)
    known, family = scenes.family(scene, allow_outside=session.allow_outside, duration=duration)
    chosen = points.of(section, known, holdout)
    allowed = dict(section.tolerance.values) if isinstance(section.tolerance, Allowed) and tolerance is None else None
    measure = OutputMeasure(allowed or {}) if scene.outputs else None
    task = TrainingTask(family, known, plan, compare.interval(scene), functools.partial(build.chosen_form, scene), measure)
    search = candidates.search(known, chosen.candidates, chosen.samples, chosen.first)
    most = max(section.max_samples, len(search.samples))
    options = greedy.Options(iterations=iterations or section.iterations, max_samples=most, seed=section.seed)
    own = 1.0 if isinstance(section.tolerance, Allowed) else section.tolerance
    wanted = own if tolerance is None else tolerance
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(
            say("--tolerance", "an error between 0 and 1, a part of the ranges of the outputs", wanted, "1e-4 for instance")
        )
    return Job(scene, task, search, options, chosen, wanted, allowed)


def folder(session: Session, scene: Scene, resume: bool) -> Path:
    """The output folder; with --force without the runs of an earlier training.

    Where a training was stopped between its model and its report, the training itself tells whether it is this one.
    """
    from ..reduction import training_store as store

    out = session.out or Path(f"fmbs-{common.stem(scene)}-train")
    if resume and not (out / STORE).is_dir():
        raise InputError(say("--resume", f"a training in '{out}'", "none", "leave the option out to begin one"))
    if session.force and (out / STORE).is_dir():
        shutil.rmtree(out / STORE)
    unfinished = (out / STORE / store.TITLE).is_file() and not (out / reports.REPORT).exists()
    return reports.folder(session, out, () if unfinished else (MODEL, reports.REPORT), reports.fingerprint(scene))


def trained(job: Job, out: Path, advance: Callable[[float], None]) -> Training:
    """The training, stored in the folder."""
    from ..reduction import training

    return training.train(job.task, job.search, job.options, out / STORE, job.tolerance, advance, True, training.CHECKS)


def save(job: Job, found: Training, out: Path) -> ParametricModel:
    """The model as a file, with what it needs to predict its own error and a record of its training."""
    from ..reduction import parametric_model, prediction

    scene = job.scene
    notes = {
        "scene": common.title(scene),
        "hashes": parametric_model.hashes(reports.scene_files(scene)),
        "fixed": {name: value for name, value in scene.parameters.items() if name not in scene.ranges},
        "training": reports.plain(record(found, job)),
        prediction.KEY: {**prediction.record(found), "measure": job.measure},
        "provenance": reports.plain(reports.provenance(scene)),
    }
    made = parametric_model.ParametricModel(found.model.parametric, notes)
    parametric_model.save(made, out / MODEL)
    return made


def promised(job: Job, found: Training, checked: Checked | None) -> list[str]:
    """Why the predicted error cannot be promised; nothing where it can."""
    from ..reduction import prediction

    true = [] if checked is None else checked.true.tolist()
    high = [] if checked is None else [one.high for one in checked.predictions]
    return prediction.doubts(len(found.runs) + len(found.checks), found.predicted, true, high, job.tolerance)


def record(found: Training, job: Job) -> dict[str, Any]:
    """What was run, chosen and reached."""
    from ..reduction import parameters

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
            {"point": parameters.named(known, candidates[number]), "reason": reason} for number, reason in found.outcome.failed
        ],
        "modes": dict(found.model.modes),
        "kept": {selection.component: len(selection.sample.indices) for selection in found.model.selections},
        "measure": job.measure,
        "tolerance": job.allowed or job.tolerance,
        "eps": plan.tolerance if plan.modes is None else None,
        "eta": plan.hyper.tolerance,
        "level": plan.hyper.name,
        "budget": None if found.choice is None else {**asdict(found.choice), "statement": found.choice.statement},
        "largest_indicator": found.last.largest,
        "predicted_error": dict(zip(("error", "low", "high"), found.predicted, strict=True)),
        "cpu_s_full_runs": sum(run.cpu_s for run in (*found.runs, *found.checks)),
        "cpu_s_models": sum(model.training_s for model in found.models),
    }


def heading(job: Job) -> dict[str, Any]:
    """What is trained: the scene, its parameters and candidates."""
    ranges = {
        p.name: {"low": p.low, "high": p.high, "scale": p.scale.value, "unit": p.unit, "nominal": p.nominal}
        for p in job.task.parameters
    }
    return {
        "scene": common.title(job.scene),
        "file": job.scene.path,
        "parameters": ranges,
        "candidates": len(job.search.candidates),
    }


def told(job: Job, found: Training) -> dict[str, Any]:
    """The report without hold-out points."""
    return {
        **heading(job),
        **record(found, job),
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


def words(report: Mapping[str, Any]) -> list[str]:
    """What was run and chosen, what error is predicted, and why the training ended."""
    modes = " + ".join(str(count) for count in report["modes"].values())
    kept = " + ".join(str(count) for count in report["kept"].values())
    text = f"{report['scene']}: full runs: {report['full_runs']}, reduced runs: {report['reduced_runs']}, "
    text += f"sNNLS: {report['hyper_reductions']}; {modes} modes" + (f", {kept} {report['level']} kept; " if kept else "; ")
    text += f"{report['cpu_s_full_runs']:.3g} s CPU in full runs, {report['cpu_s_models']:.3g} s in bases and hyper-reduction."
    points = "; ".join(map(listed, report["points"]))
    if report["budget"] is not None:
        budget = f"Error budget {report['budget']['statement']}."
    else:
        budget = f"eps = {report['eps']}, eta = {report['eta']}, as the scene says; --tolerance chooses them for a wanted error."
    error = report["predicted_error"]
    spread = f"with its spread {error['low']:.2g} to {error['high']:.2g}"
    largest = f"Largest predicted {report['measure']}, among the candidates: {error['error']:.2g}, {spread}."
    doubts = [f"The training cannot promise its predicted error: {'; '.join(report['doubts'])}."] if report["doubts"] else []
    lost = motionless([*report["failed"], *report.get("holdout", {}).get("failed", ())])
    checks = "; ".join(map(listed, report["checks"]))
    unseen = [f"Checked by full runs that are not in the model, at {checks}."] if checks else []
    return [
        text,
        f"Full runs at {points}.",
        *unseen,
        f"The training ended because {report['stop']}.",
        *lost,
        budget,
        largest,
        *doubts,
    ]


def motionless(failed: Sequence[Mapping[str, Any]]) -> list[str]:
    """Where in the box the full model has no motion, each point with the first clause of the reason."""
    points = [f"{listed(one['point'])} ({one['reason'].split(';')[0]})" for one in failed]
    return [f"The full model has no motion at {'; '.join(points)}."] if points else []


def listed(point: Mapping[str, float]) -> str:
    """A point of the box as text."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in point.items())
