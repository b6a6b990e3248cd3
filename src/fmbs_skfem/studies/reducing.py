"""Train a reduced model of one scene and save it to a file that runs without mesh and full model."""

from __future__ import annotations

import math
import time as clock
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import reduction
from ..core.errors import FmbsError
from ..core.notices import Notice, notify
from ..core.storage.records import dataclass
from ..families import trials
from ..reduction import cases, files, full_runs, reduced_models, training_signals
from ..reduction.accuracy import costs, error_budget, output_errors
from ..reduction.accuracy.costs import Payoff
from ..reduction.accuracy.runs import PATIENCE, kept_steps, run_fastest
from ..reduction.plan import newton_for
from ..scenes import build
from . import job as jobs
from . import kinds, plans, reports
from .job import Job
from .result import ReportTable, Result, format_value
from .running import compiling, exportable

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..reduction.accuracy.output_errors import OutputError
    from ..reduction.cases import Case
    from ..reduction.full_runs import FullRun, TrainingTask
    from ..reduction.plan import Plan
    from ..scenes import Scene
    from ..systems import System
    from .plans import Goal


REPEAT = 2  #: runs of which the fastest counts
ROUGH = 0.01  #: error over the largest displacement, above which a warning is shown


@dataclass(frozen=True, repr=False, kw_only=True)
class ReductionResult(Result):
    """A reduced model, and the motions of both models over the training, or of a plant under
    signals that it was not trained on.
    """

    system: System
    full: Trajectory
    reduced: Trajectory
    case: Case  #: of the reduced motion
    payoff: Payoff


def reduce_scene(
    job: Job, scene: Scene, path: Path | None, plan: Plan, goal: Goal | None = None
) -> ReductionResult:
    """A reduced model of a scene by a plan, made coarser or finer for a goal, saved in a file."""
    raw = build.system(scene, allow_outside=job.allow_outside)
    exportable.announce(job, scene, raw)
    if path is not None:
        files.require_savable(raw)
    compiling.announce(job, reduces=True)
    found = train(job, scene, raw, plan, goal)
    report = found.report
    origin = reports.plain(reports.provenance(scene))
    facts = [
        (key, format_value(value))
        for key, value in report.items()
        if key not in ("budget", *kinds.KINDS, *found.payoff.report)
    ]
    view: list[ReportTable | str] = [found.payoff.words]
    view += [plans.budget_words(report["budget"])] if report["budget"] else []
    view += [ReportTable(f"Reduced model of {report['scene']}", ("", "value"), facts)]
    view += kinds.views(report, scene.display)
    if path is not None:
        training = dict(scene.parameters)
        plain = reports.plain(report)
        kept = reports.provenance_to_keep(origin, scene)
        how = {"scheme": found.case.scheme, "newton": found.case.newton}
        notes = {"training": training, "report": plain, "provenance": kept, "choice": scene.choice}
        files.save(found.system, path, scene=report["scene"], **notes, **how, **scene.display.note)
        view.append(f"written: {path}")
    more = {"file": path, "provenance": origin, "notices": job.notices}
    return replace(found, report={**report, **more}, lines=view)


def train(job: Job, scene: Scene, raw: System, plan: Plan, goal: Goal | None) -> ReductionResult:
    """The reduced system of a full one, and its sizes, cost and errors against it over the training
    time.

    A plant, whose inputs have ranges, is trained on runs with signals within them, and its errors
    are those under other ones.
    """
    task = plans.task(scene, raw, plan)
    excited = training_signals.excite(task, plans.sections(scene)[1].signals)
    if excited:
        task = excited.task
    own = task.family(excited.check if excited else {})
    kept = kept_steps(own, task.interval)
    own_form = replace(own, system=task.form(own.system))
    trials.compile_training(task)
    finest = min(error_budget.LADDER_EPS) if goal and goal.eps else plan.tolerance
    sharp = replace(own_form, newton=newton_for(own.newton, finest))
    full = job.trajectory = cases.run(sharp, kept, job.progress("full model"))
    # snapshots are sharper than the scene asks for, and their run takes longer than its own
    timed = full if full.statistics.cpu_s > PATIENCE else run_fastest(own_form, kept, REPEAT)
    begun = clock.process_time()
    runs = (
        excited.runs(job.progress("training signals"))
        if excited
        else [full_runs.run_of_motion(task, full)]
    )
    if goal:
        plan = plan_for(goal, task, runs, None if excited else full, kept)
        task = replace(task, plan=plan)
    model = reduced_models.make_model(task, runs)
    training_s = clock.process_time() - begun + (0.0 if excited else full.statistics.cpu_s)
    case = excited.checked(model.cases({})) if excited else model.cases({})
    job.progress("reduced model")
    motion = run_fastest(case, kept, REPEAT)
    payoff = Payoff(timed.statistics.cpu_s, training_s, motion.statistics.cpu_s)
    errors = reduction.compare(full, motion)
    if errors.maximum > ROUGH:
        size = f"{errors.maximum:.1%} of the largest displacement"
        where = "under signals that it was not trained on" if excited else "over its own training"
        notify(
            f"the reduced model errs by {size} {where}: take a smaller eps or eta, or more modes"
        )
    wrong = output_errors.compare(full, motion)
    relative = {name: one.relative for name, one in wrong.items()}
    output_errors.warn_of_wrong(relative, {name: one.unit for name, one in wrong.items()})
    judged = goal.accuracy.parts(wrong) if goal else {}
    if goal and judged:
        warn_of_share(goal, judged)
    report = {
        "status": "ok",
        "scene": jobs.title(scene),
        "dofs_full": raw.size,
        "dofs": model.system.size,
        "modes": dict(model.modes),
        **costs.kept_by_component(model.system, model.components),
        "tolerance": plan.tolerance if plan.modes is None else None,
        "left_out": dict(model.left_out),
        "hyper_tolerance": plan.hyper.tolerance,
        "hyper_reduction": plan.hyper.name,
        **({"training_signals": excited.facts} if excited else {}),
        **errors.summary,
        "output_errors": {column: asdict(one) for column, one in wrong.items()},
        "accuracy": str(goal.accuracy) if goal else None,
        "error_over_accuracy": max(judged.values(), default=None),
        "budget": plans.budget(job.plan, max(judged.values())) if judged else {},
        **payoff.report,
        "cpu_s_full": payoff.full_s,
        "cpu_s": payoff.run_s,
        "training_s": payoff.training_s,
        "snnls_s": {selection.component: selection.snnls_s for selection in model.selections},
        "scheme": repr(own.scheme),
        "step": own.scheme.step,
        "rho_inf": own.scheme.rho_inf,
        "start": own.scheme.start,
        "duration": own.duration,
    }
    about = f"{report['scene']}: {model.system.size} coordinates for {raw.size}, largest relative error {errors.maximum:.1e}"
    found: dict[str, Any] = {
        "system": model.system,
        "full": full,
        "reduced": motion,
        "case": case,
        "payoff": payoff,
    }
    return ReductionResult(about=about, report=report, **found)


def plan_for(
    goal: Goal,
    task: TrainingTask,
    runs: Sequence[FullRun],
    full: Trajectory | None,
    kept: np.ndarray,
) -> Plan:
    """The coarsest plan whose outputs err by at most a share of the accuracy over the full motion,
    stored after `kept` steps.

    Without it, of a plant, over all runs of the training, at their snapshots.
    """
    known = output_errors.columns(full) if full else {}

    def errors(mine: TrainingTask, run: FullRun, case: Case) -> dict[str, OutputError]:
        if full:
            return output_errors.compare(full, cases.run(case, kept), known)
        return full_runs.errors_of_outputs(
            task.family(run.values).system, run, full_runs.run_formed(mine, case)
        )

    def error(plan: Plan) -> float:
        """The largest error over what is wanted; what is told of a trial would be of a model that
        nobody gets.
        """
        mine = replace(task, plan=plan)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            try:
                trained = reduced_models.train_reduction(mine, runs)
                found = [
                    errors(mine, run, reduced_models.reduced_case(mine, trained, run.values))
                    for run in runs
                ]
            except FmbsError:
                return math.inf
        return max(
            (part for one in found for part in goal.accuracy.parts(one).values()), default=0.0
        )

    return error_budget.coarsest(task.plan, error, plans.SHARE, goal.eps, goal.eta)


def warn_of_share(goal: Goal, parts: Mapping[str, float]) -> None:
    """A warning where outputs err by more than their share of the accuracy; `parts` are errors over
    it, by column.
    """
    worst = max(parts, key=lambda column: parts[column])
    if parts[worst] > plans.SHARE:
        given = [name for name, free in (("eps", goal.eps), ("eta", goal.eta)) if not free]
        remedy = (
            f"leave out {' and '.join(given)} to have them found"
            if given
            else "take snapshots more often, or ask for less"
        )
        text = f"the reduced model errs by {parts[worst]:.2g} times the accuracy {goal.accuracy} in {worst}"
        notify(f"{text}, where {plans.SHARE:g} of it is aimed at; {remedy}")
