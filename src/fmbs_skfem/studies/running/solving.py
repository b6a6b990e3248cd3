"""Solve what a study runs with what it reaches kept, then outputs, report, plots and pictures.

    RunTask -> Trajectory, with the error that ended it early -> Run -> outputs.csv, outputs.png, report.json

What is run is a `RunTask`: full models over time and equilibria from `runs.scene_task`, saved models from `models.task`.
"""

from __future__ import annotations

import contextlib
import math
import time
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import dynamics
from ...core.errors import FmbsError, SolverError, Warned
from ...core.notices import Notice, Progress
from ...core.storage.records import dataclass
from ...core.values.display import DisplayUnits
from ...dynamics import GeneralizedAlpha, Trajectory
from ...dynamics.diagnoses import large_strains
from ...parts import departures
from ...results import stress_errors
from ...results.colour_scales import SILENT
from ...results.segments import Recorder
from ...systems.measures import probes
from .. import job as jobs
from .. import reports
from ..job import Job
from ..result import ReportTable, conclude, describe_error, list_files
from . import compiling, failures, panels, recording
from .outcome import OUTPUTS, UNITS, Run, write_outputs

if TYPE_CHECKING:
    from ...dynamics.checkpoint import Resumed
    from ...dynamics.trajectory import Gap
    from ...systems import System

DIGITS = float(np.finfo(np.float64).eps)  #: of a value beside the largest of its column, below which it is shown as zero
Draw = Callable[[Trajectory, Path], Sequence[Callable[[], Path]]]  #: pictures and series in a folder, each drawn when called


@dataclass(frozen=True)
class RunTask:
    """What is run, and what its report says of it."""

    title: str
    facts: Mapping[str, Any]  #: of the report: what it is, at which parameters, its sizes, fingerprint and provenance
    words: str  #: the same at the begin of a line
    system: System
    solve: Callable[[Progress, recording.Watch | None, Resumed | None], Trajectory]
    judge: Callable[[Trajectory], dict[str, Any]]  #: energy error and noise of the motion, with warnings
    scheme: GeneralizedAlpha | None = None  #: None of equilibria
    request: Mapping[str, Any] | None = None  #: what `resume` needs to know; None of what runs anew
    label: str = "integrating"
    remarks: Sequence[ReportTable | str] = ()  #: sentences and tables on the result

    @property
    def display(self) -> DisplayUnits:
        """Units in which people read its numbers."""
        return DisplayUnits.of(self.facts)


def solve(job: Job, mark: str, make: Callable[[], RunTask], draw: Draw | None = None, names: Sequence[str] = ()) -> Run:
    """Run a task into the output folder, settled before the task is made, where nothing of another run is touched."""
    wanted = (OUTPUTS, UNITS, reports.REPORT, *(["outputs.png"] if job.plots else []), *names)
    with recording.place(job, wanted, mark) as out:
        cold = compiling.announce(job)
        task = make()
        warm_up(task, cold)
        record = Recorder(out, task.request, task.request["checkpoint"]) if out and task.request else None
        return finish(job, task, draw, record)


def finish(job: Job, task: RunTask, draw: Draw | None = None, record: Recorder | None = None, resume: Resumed | None = None) -> Run:
    """Solve a task, or go on with it; its outputs, report, plots and pictures."""
    cpu, wall = time.process_time(), time.perf_counter()
    job.trajectory, error = attempt(job, task, record, resume)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    trajectory = job.trajectory
    beyond = departures.find(trajectory)
    with jobs.keep_results():
        if isinstance(error, SolverError):
            departures.warn(beyond)  # what a run sees that ends early may be older
        strained = large_strains.find(trajectory)
        large_strains.warn(strained)
        outputs, cost, judged = dynamics.outputs(trajectory), trajectory.statistics, task.judge(trajectory)
        uncertain = stress_errors.of_outputs(trajectory, outputs)
        stress_errors.warn(uncertain)
    error = error or jobs.refused(job)
    failure, files = failures.write_failure(job.made, error, task.facts["provenance"], job.plots)
    report: dict[str, Any] = {
        **describe_error(error),
        **task.facts,
        "end": float(trajectory.times[-1]),
        "steps": cost.steps,
        "newton_iterations": cost.iterations,
        "factorisations": cost.factorisations,
        "halved_steps": cost.halved,
        "solver": cost.solver,
        "cpu_s": cost.cpu_s if task.scheme else cpu,
        "wall_s": cost.wall_s if task.scheme else wall,
        **judged,
        **({"events": [asdict(one) for one in trajectory.events]} if trajectory.events else {}),
        **(path_report(trajectory) if trajectory.negative is not None else {}),
        **({"large_strains": [asdict(one) for one in strained]} if strained else {}),
        **({"beyond_training": [asdict(one) for one in beyond]} if beyond else {}),
        **({} if trajectory.part_errors is None else {"part_errors": trajectory.part_errors}),
        **({} if trajectory.part_check is None else {"part_check": trajectory.part_check}),
        **({} if job.plan is None else {"accuracy": asdict(job.plan)}),
        "outputs": {name: extremes(values) for name, values in outputs.items()},
        **({"stress_errors": uncertain} if uncertain else {}),
        "units": probes.column_units(task.system.outputs),
        "labels": probes.column_labels(task.system.outputs),
        "segments": len(record.manifest.segments) if record else 0,
        "notices": job.notices,
        **failure,
    }
    across, marks = "time [s]" if task.scheme else "load factor", [(one.time, one.name) for one in trajectory.events]
    noise = (report.get("acceleration_noise") or 0.0) * trajectory.system.weight
    silent = panels.find_noise(task.system.outputs, outputs, trajectory.system.scale, noise)
    errors = job.plan.errors if job.plan else {}
    figures = panels.figures_of(
        task.system.outputs, trajectory.times, outputs, task.title, across, marks, silent, errors, task.display
    )

    def write(out: Path) -> list[Path]:
        return [*write_outputs(out, trajectory.times, outputs, report, job.units), *files]

    missing = jobs.deliver(job, report, write, figures, draw and partial(draw, trajectory))
    view: list[ReportTable | str] = [summary(task, report), *([job.plan.words] if job.plan else []), *task.remarks]
    view += [*([table_of_events(trajectory, task.display)] if trajectory.events else [])]
    view += describe_path(trajectory, task.display)
    view += [*([table_of_outputs(report, task, silent)] if outputs else []), *errors_of_stresses(report)]
    view += [*failures.views(report), *list_files(report)]
    about = f"{task.title}: {len(trajectory.times)} instants, {', '.join(outputs) or 'no outputs'}"
    return conclude(
        Run(
            about=about,
            report=report,
            lines=view,
            figures=figures,
            error=error or missing,
            motion=trajectory,
            outputs=outputs,
        )
    )


def warm_up(task: RunTask, cold: bool) -> None:
    """Compile what a motion needs before it is timed and recorded."""
    with contextlib.suppress(FmbsError), warnings.catch_warnings():  # the run itself will say what is wrong
        warnings.simplefilter("ignore", Notice)
        if cold and task.scheme is not None:
            dynamics.integrate(task.system, task.scheme, task.scheme.step)


def attempt(
    job: Job, task: RunTask, record: Recorder | None = None, resume: Resumed | None = None
) -> tuple[Trajectory, SolverError | Warned | None]:
    """The trajectory of a task, or the part up to a failure with its error; a task that never starts is explained.

    Where warnings are to be errors, a run ends with one that it gives, and keeps what there is as well.
    """
    try:
        with recording.stoppable(record, job.time_limit) as watch:
            trajectory = task.solve(job.progress(task.label), watch, resume)
        broken = dynamics.unstable(trajectory, task.scheme.step) if task.scheme else None
        if broken is None:
            return trajectory, None
        raise broken
    except Notice as notice:
        if notice.partial is None:
            raise
        return notice.partial, jobs.refused(job, str(notice))
    except SolverError as error:
        if record is not None:
            record.fail()
        if error.partial is None:
            failures.write_failed_start(job, error, task.facts["provenance"])
            raise
        return error.partial, error


def extremes(values: np.ndarray) -> dict[str, float]:
    """Smallest, largest and last value of an output."""
    return {"min": float(values.min()), "max": float(values.max()), "final": float(values[-1])}


def table_of_outputs(report: Mapping[str, Any], task: RunTask, silent: Collection[str] = ()) -> ReportTable:
    """Smallest, largest and last value of every column; zero where they are round-off, in all that is `silent` or beside others.

    Beside them stand errors, where a run was asked for an accuracy. Columns of one output and unit are read in the same one.
    """
    rows, errors, units = [], report.get("accuracy", {}).get("errors", {}), report["units"]
    for output in task.system.outputs.values():
        for name in output.columns:
            ends = report["outputs"][name]
            alike = [value for one in output.columns if units[one] == units[name] for value in report["outputs"][one].values()]
            heading, size = task.display.head(panels.heading_of(units, report["labels"], name), alike)
            least = np.inf if name in silent else DIGITS * max(abs(value) for value in ends.values())
            shown = [0.0 if abs(value) < least else value / size for value in ends.values()]
            error = [errors.get(name, math.nan) / size] if errors else []
            rows.append((heading + SILENT * (name in silent), *shown, *error))
    return ReportTable("Outputs", ("output", "min", "max", "final", *(["+-"] if errors else [])), rows)


def errors_of_stresses(report: Mapping[str, Any]) -> list[str]:
    """The line that says how far stresses are off by those recovered from cells around; none without stresses."""
    texts = [f"{name} {100.0 * part:.2g} %" for name, part in report.get("stress_errors", {}).items()]
    return (
        [f"error of stresses by those of cells around, as a part of the largest of the body: {', '.join(texts)}"] if texts else []
    )


def table_of_events(trajectory: Trajectory, units: DisplayUnits) -> ReportTable:
    """When events happened, what they did, and the kinetic energy that they took."""
    rows = []
    for one in trajectory.events:
        done = [
            *(f"releases {name}" for name in one.release),
            *(f"locks {name}{apart(gap)}" for name, gap in zip(one.lock, one.gaps, strict=True)),
        ]
        rows.append((one.name, one.time, ", ".join([*done, *(["stops the run"] if one.stop else [])]), one.loss))
    return ReportTable("Events", *units.columns(("event", "time [s]", "what it does", "energy lost [J]"), rows))


def path_report(trajectory: Trajectory) -> dict[str, Any]:
    """Of every equilibrium the negative pivots of its tangent and whether it is stable, and what its path has passed."""
    negative = [None if np.isnan(one) else int(one) for one in np.asarray(trajectory.negative)]
    stable = [None if one is None else one == 0 for one in negative]
    listed = zip(trajectory.times.tolist(), negative, stable, strict=True)
    states = [{"at": at, "negative_pivots": pivots, "stable": good} for at, pivots, good in listed]
    return {"equilibria": states, "crossings": [asdict(one) for one in trajectory.crossings]}


def describe_path(trajectory: Trajectory, units: DisplayUnits) -> list[ReportTable | str]:
    """Whether equilibria are stable, in a line, and a table of what their path has passed; nothing of motions."""
    if trajectory.negative is None:
        return []
    known = trajectory.negative[np.isfinite(trajectory.negative)]
    wrong = int(np.sum(known > 0))
    count = f"{len(known)} of {len(trajectory.negative)} equilibria" if len(known) < len(trajectory.negative) else "all equilibria"
    text = f"stability (no negative pivots): {count} judged, {f'{wrong} unstable' if wrong else 'all stable'}"
    lines: list[ReportTable | str] = [text] if len(known) else []
    heads = ("passed", "from", "to", "way [m]", "negative pivots", "known by")
    rows = [
        (one.kind, one.before, one.after, one.distance, " -> ".join("?" if n is None else str(n) for n in one.negative), one.sign)
        for one in trajectory.crossings
    ]
    return [*lines, *([ReportTable("On the path", *units.columns(heads, rows))] if rows else [])]


def apart(gap: Gap) -> str:
    """How far apart the places of a joint are where it is locked; nothing where there is no second place."""
    parts = [(gap.distance, "m"), (gap.angle, "rad")]
    found = " and ".join(f"{value:.3g} {unit}" for value, unit in parts if value is not None)
    return f" {found} apart" if found else ""


def summary(task: RunTask, report: Mapping[str, Any]) -> str:
    """The run in one line."""
    text = f"{task.words}, {report['steps']} steps, {report['newton_iterations']} Newton iterations, "
    text += f"{report['cpu_s']:.3g} s CPU, {report['wall_s']:.3g} s wall"
    drift = report["energy_drift"]
    return text if drift is None else f"{text}, energy error {drift:.3g} J"
