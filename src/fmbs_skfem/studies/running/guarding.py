"""A guarded run of a saved reduced model: the full model of a scene takes over where the reduced one is not to be trusted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError, say
from ...core.storage import container
from ...core.storage.validation import check
from ...core.values.display import DisplayUnits
from ...dynamics.output_errors import OutputError
from ...dynamics.tracing import FEW
from ...reduction import files, guarded
from ...reduction.full_runs import TrainingTask
from ...reduction.guarded import Guarded, Known
from ...reduction.hyper import hyper_reduction
from ...reduction.plan import USUAL, Plan
from ...scenes import build, where
from .. import job as jobs
from .. import models, plans, reports
from ..job import Job
from ..result import ReportTable
from . import judging
from .outcome import Run
from .solving import RunTask, solve

YES = "no", "yes"
EXACT = 1e-3 * guarded.SHARE  #: error over the accuracy that is as good as none

if TYPE_CHECKING:
    from ...core.notices import Progress
    from ...dynamics import Trajectory
    from ...reduction.files import Saved
    from ...scenes import Scene
    from ...scenes.accuracy import Accuracy
    from ...systems import System


def refuse(step: float | None, picture: bool, html: bool) -> None:
    """InputError for options of a saved model that a guarded run has not."""
    if step is not None:
        raise InputError(say("--step", "the step of the scene beside --guard", f"{step:g} s", "change analysis.step of the scene"))
    if picture:
        raise InputError(say("--picture", "no picture beside --guard", "it", "leave it out; fmbs render draws the scene"))
    if html:
        raise InputError(say("--html", "no page beside --guard", "it", "leave it out; fmbs view shows the scene"))


def read_scene(job: Job, path: Path, choice: object) -> tuple[Scene, Accuracy | None]:
    """The scene that guards a model, and its accuracy; it has the cells and the step that were chosen for the training, if any."""
    own = replace(job, path=path)
    scene = jobs.read_scene(own, plans=False)
    if not scene.analysis.moves:
        raise InputError(say(f"--guard {path}", "a dynamic analysis", scene.analysis.word, "give the scene of the training"))
    return scene.chosen(*choice) if isinstance(choice, tuple) else scene, own.wanted


def read_known(saved: Saved, where: Path) -> Known:
    """What a file knows of its training; InputError where it is one of an earlier version."""
    found = saved.notes.get(guarded.NOTE)
    if not isinstance(found, Known):
        raise InputError(say(f"--guard: {where}", "a model that knows its own indicator", "none", "make it anew with fmbs reduce"))
    with container.reading(where, files.KIND):
        check(found, f"notes.{guarded.NOTE}")
    return found


def budget_of(known: Known, report: Mapping[str, Any], accuracy: Accuracy | None) -> tuple[float, str]:
    """The largest integral of the indicator [m s], and for which accuracy; twice that of its training where none is known."""
    part, words = guarded.SHARE / 2.0, "an indicator of at most twice that of its training"
    if accuracy is not None:
        found = {name: error_of(one) for name, one in report.get("output_errors", {}).items()}
        part, words = max(accuracy.parts(found).values(), default=part), f"accuracy {accuracy}"
    elif report.get("accuracy"):
        part, words = float(report["error_over_accuracy"] or part), f"accuracy {report['accuracy']}, that of its training"
    return guarded.SHARE * known.indicator / max(part, EXACT), words


def error_of(noted: Mapping[str, Any]) -> OutputError:
    """The error of a column as a file notes it, with None where it stands still."""
    error, span, relative = (math.nan if noted[key] is None else float(noted[key]) for key in ("error", "range", "relative"))
    return OutputError(noted["output"], noted["unit"], error, span, relative)


def task_of_scene(scene: Scene, raw: System, known: Known, report: Mapping[str, Any]) -> TrainingTask:
    """The full model of a scene, and how a model was trained that is to stand for it."""
    hyper = hyper_reduction.named(str(report["hyper_reduction"]), report["hyper_tolerance"])
    plan = Plan(known.components, report["tolerance"] or USUAL, None, hyper, known.eliminate, known.invariant)
    return plans.task(scene, raw, plan, build.stepped(scene).step)


def run(job: Job, path: Path) -> Run:
    """The model of a job, guarded by the scene in a file."""
    if models.parametric(job.path):
        remedy = "make one of this scene with fmbs reduce"
        raise InputError(say(f"--guard: {job.path}", "a model at one set of parameters", "one of a range of them", remedy))
    saved = files.read(job.path)
    known, report = read_known(saved, job.path), saved.notes["report"]
    if known.invariant:
        remedy = "train it with modes of coordinates: fmbs reduce without --basis invariant"
        raise InputError(say(f"--guard: {job.path}", "modes of coordinates", "invariant ones, which take no states", remedy))
    scene, accuracy = read_scene(job, path, saved.notes.get("choice"))
    made = task(job, path, scene, saved.system, known, budget_of(known, report, accuracy), report)
    return solve(job, made.facts["fingerprint"], lambda: made)


def task(
    job: Job, path: Path, scene: Scene, system: System, known: Known, promise: tuple[float, str], report: Mapping[str, Any]
) -> RunTask:
    """The guarded run of a reduced system, and what is to be said of it."""
    raw, analysis = build.system(scene, allow_outside=job.allow_outside), build.dynamic(scene)
    if analysis.within is not None:
        expected = f"multiples of the step {analysis.step:g} s in a guarded run"
        raise InputError(say(f"{where(scene, 'analysis')}: every", expected, "times within steps", "choose others"))
    own, (budget, words) = task_of_scene(scene, raw, known, report), promise
    reduced = guarded.reduction_of(own, system, known)
    facts = {"model": job.path, "guard": path, **jobs.facts(scene, raw, own.form(raw)), "promise": words}
    facts["fingerprint"] = f"{models.mark(job.path)} {reports.fingerprint(scene)} {analysis.duration} {words}"
    remarks = list[ReportTable | str]()

    def integrate(advance: Progress, *_: object) -> Trajectory:
        states = None if job.states else FEW
        found = guarded.run(own, reduced, known, budget, analysis.kept, states, advance)
        facts.update(guarded=facts_of(found))
        remarks.extend(views(found, words, scene.display))
        return found.motion

    title = f"{job.path}, guarded by {path}"
    judge = partial(judging.balances, analysis.scheme)
    return RunTask(
        facts["scene"], facts, title, own.form(raw), integrate, judge, analysis.scheme, label="guarded run", remarks=remarks
    )


def facts_of(found: Guarded) -> dict[str, Any]:
    """A guarded run in a report."""
    return {
        "windows": [asdict(one) for one in found.windows],
        "enrichments": [asdict(one) for one in found.enrichments],
        "full": asdict(found.full),
        "reduced": asdict(found.reduced),
        "indicator": found.indicator,
        "indicator_allowed": found.budget,
        "growth": found.growth,
        "indicator_cpu_s": found.looking_s,
    }


def views(found: Guarded, words: str, display: DisplayUnits) -> list[ReportTable | str]:
    """A guarded run in a sentence, and its windows and what was added in tables."""
    counts = {name: sum(one.steps for one in found.windows if one.model == name) for name in ("reduced", "full")}
    part = counts["reduced"] / max(sum(counts.values()), 1)
    text = f"For {words}: the reduced model holds for {part:.0%} of the motion; the full one takes {counts['full']} steps"
    text += f" ({found.full.cpu_s:.2g} s CPU, the reduced ones {found.reduced.cpu_s:.2g} s); the indicator uses up"
    lines: list[ReportTable | str] = [f"{text} {found.indicator / found.budget if found.budget else 0.0:.0%} of what is allowed."]
    rows = [(one.model, one.begin, one.end, one.steps, one.unknowns, one.why) for one in found.windows]
    heads: tuple[str, ...] = ("model", "from [s]", "to [s]", "steps", "unknowns", "ends since")
    lines.append(ReportTable("Windows", *display.columns(heads, rows)))
    if found.enrichments:
        more = [
            (one.time, ", ".join(f"{name} {count}" for name, count in one.modes.items()), one.unknowns, YES[one.taken])
            for one in found.enrichments
        ]
        heads = ("at [s]", "modes added", "unknowns", "follows")
        lines.append(ReportTable("States taken into the basis", *display.columns(heads, more)))
    return lines
