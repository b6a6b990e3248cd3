"""Train a reduced model of one scene and save it to a file that runs without mesh and full model."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import reduction
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..reduction import cases, files
from ..reduction.accuracy import costs, output_errors
from ..reduction.accuracy.runs import kept_steps
from ..reduction.plan import newton_for
from ..scenes import build
from . import job as jobs
from . import plans, reports, tables
from .job import Job
from .result import ReportTable, Result, format_value
from .running import compiling

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..reduction.cases import Case
    from ..reduction.plan import Plan
    from ..scenes import Scene
    from ..systems import System


ROUGH = 0.01  #: error over the largest displacement, above which a warning is shown


@dataclass(frozen=True, repr=False, kw_only=True)
class ReductionResult(Result):
    """A reduced model, and the motions of both models over the training."""

    system: System
    full: Trajectory
    reduced: Trajectory
    case: Case  #: of the reduced motion


def reduce_scene(job: Job, scene: Scene, path: Path | None, plan: Plan) -> ReductionResult:
    """A reduced model of a scene by a plan, saved in a file."""
    raw = build.system(scene, allow_outside=job.allow_outside)
    if path is not None:
        files.require_savable(raw)
    compiling.announce(job, reduces=True)
    found = train(job, scene, raw, plan)
    report = found.report
    origin = reports.plain(reports.provenance(scene))
    facts = [(key, format_value(value)) for key, value in report.items() if key not in ("output_errors", "left_out")]
    view: list[ReportTable | str] = [ReportTable(f"Reduced model of {report['scene']}", ("", "value"), facts)]
    view += tables.left_out(report["left_out"])
    view += tables.output_errors(report["output_errors"])
    if path is not None:
        training, plain = dict(scene.parameters), reports.plain(report)
        kept, how = reports.provenance_to_keep(origin, scene), {"scheme": found.case.scheme, "newton": found.case.newton}
        files.save(found.system, path, scene=report["scene"], training=training, report=plain, provenance=kept, **how)
        view.append(f"written: {path}")
    more = {"file": path, "provenance": origin, "notices": job.notices}
    return replace(found, report={**report, **more}, lines=view)


def train(job: Job, scene: Scene, raw: System, plan: Plan) -> ReductionResult:
    """The reduced system of a full one, and its sizes, cost and errors against it over the training time."""
    task = plans.task(scene, raw, plan)
    own = task.family({})
    kept = kept_steps(own, task.interval)
    sharp = replace(own, system=task.form(raw), newton=newton_for(own.newton, plan.tolerance))
    full = job.trajectory = cases.run(sharp, kept, job.progress("full model"))
    model = reduction.train(task, motion=full).model
    case = model.cases({})
    motion = cases.run(case, kept, job.progress("reduced model"))
    errors = reduction.compare(full, motion)
    if errors.maximum > ROUGH:
        size = f"{errors.maximum:.1%} of the largest displacement"
        notify(f"the reduced model errs by {size} over its own training: take a smaller eps or eta, or more modes")
    wrong = output_errors.compare(full, motion)
    output_errors.warn_of_wrong({name: one.relative for name, one in wrong.items()})
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
        **errors.summary,
        "output_errors": {column: asdict(one) for column, one in wrong.items()},
        "cpu_s_full": full.statistics.cpu_s,
        "cpu_s": motion.statistics.cpu_s,
        "training_s": model.training_s,
        "snnls_s": {selection.component: selection.snnls_s for selection in model.selections},
        "scheme": repr(own.scheme),
        "step": own.scheme.step,
        "rho_inf": own.scheme.rho_inf,
        "start": own.scheme.start,
        "duration": own.duration,
    }
    about = f"{report['scene']}: {model.system.size} coordinates for {raw.size}, largest relative error {errors.maximum:.1e}"
    return ReductionResult(about=about, report=report, system=model.system, full=full, reduced=motion, case=case)
