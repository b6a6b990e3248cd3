"""Solve what a study runs with what it reaches kept, then outputs, report, plots and pictures.

    RunTask -> Trajectory, with the error that ended it early -> Run -> outputs.csv, outputs.png, report.json

What is run is a `RunTask`: full models over time and equilibria from `runs.scene_task`, saved
models from `models.task`.
"""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import dynamics
from ...core.errors import Contradiction, FmbsError, SolverError, Warned
from ...core.notices import Notice, Progress, notify
from ...core.storage.records import dataclass
from ...core.values.display import DisplayUnits
from ...dynamics import GeneralizedAlpha, Trajectory
from ...dynamics.diagnoses import large_strains, limit_cycles
from ...parts import departures
from ...results import stress_errors
from ...results.segments import Recorder
from ...systems.measures import probes, utilisation
from .. import job as jobs
from .. import kinds, reports
from ..job import Job
from ..result import ReportTable, conclude, describe_error, list_files
from . import compiling, failures, panels, recording, step_check
from .outcome import OUTPUTS, UNITS, Run, write_outputs

if TYPE_CHECKING:
    from ...dynamics.checkpoint import Resumed
    from ...systems import System

#: pictures and series in a folder, each drawn when called
Draw = Callable[[Trajectory, Path], Sequence[Callable[[], Path]]]


@dataclass(frozen=True)
class RunTask:
    """What is run, and what its report says of it."""

    title: str
    #: of the report: what it is, at which parameters, its sizes, fingerprint and provenance
    facts: Mapping[str, Any]
    words: str  #: the same at the begin of a line
    system: System
    solve: Callable[[Progress, recording.Watch | None, Resumed | None], Trajectory]
    #: energy error and noise of the motion, with warnings
    judge: Callable[[Trajectory], dict[str, Any]]
    scheme: GeneralizedAlpha | None = None  #: None of equilibria
    request: Mapping[str, Any] | None = None  #: what `resume` needs to know; None of what runs anew
    #: the same motion in half the steps, with its outputs alone; None of equilibria
    halved: Callable[[Progress], Trajectory] | None = None
    label: str = "integrating"
    across: str = "time [s]"  #: what its states are at
    remarks: Sequence[ReportTable | str] = ()  #: sentences and tables on the result

    @property
    def display(self) -> DisplayUnits:
        """Units in which people read its numbers."""
        return DisplayUnits.of(self.facts)


def solve(
    job: Job,
    mark: str,
    make: Callable[[], RunTask],
    draw: Draw | None = None,
    names: Sequence[str] = (),
) -> Run:
    """Run a task into the output folder, settled before the task is made, where nothing of another
    run is touched.
    """
    wanted = (OUTPUTS, UNITS, reports.REPORT, *(["outputs.png"] if job.plots else []), *names)
    with recording.place(job, wanted, mark) as out:
        cold = compiling.announce(job)
        task = make()
        warm_up(task, cold)
        record = (
            Recorder(out, task.request, task.request["checkpoint"])
            if out and task.request
            else None
        )
        return finish(job, task, draw, record)


def finish(
    job: Job,
    task: RunTask,
    draw: Draw | None = None,
    record: Recorder | None = None,
    resume: Resumed | None = None,
) -> Run:
    """Solve a task, or go on with it; its outputs, report, plots and pictures."""
    cpu = time.process_time()
    wall = time.perf_counter()
    job.trajectory, error = attempt(job, task, record, resume)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    trajectory = job.trajectory
    beyond = departures.find(trajectory)
    with jobs.keep_results():
        if isinstance(error, SolverError):
            departures.warn(beyond)  # what a run sees that ends early may be older
        strained = large_strains.find(trajectory)
        outputs = dynamics.outputs(trajectory)
        cost = trajectory.statistics
        judged = task.judge(trajectory)
        uncertain = stress_errors.of_outputs(trajectory, outputs)
        notify(
            *large_strains.summarise(strained),
            *stress_errors.summarise(uncertain, trajectory.system),
            *utilisation.beyond_yield(trajectory.system.outputs, outputs),
        )
    error = error or jobs.refused(job)
    cycle = limit_cycles.find(trajectory, outputs) if task.scheme and error is None else None
    checked: dict[str, Any] = {}
    if job.check and error is None and task.halved and task.scheme:
        half = task.halved(job.progress("half the step"))
        checked = step_check.compare(trajectory, half, task.scheme.step)
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
        **({"limit_cycle": asdict(cycle)} if cycle else {}),
        **({"large_strains": [asdict(one) for one in strained]} if strained else {}),
        **({"beyond_training": [asdict(one) for one in beyond]} if beyond else {}),
        **({} if trajectory.part_errors is None else {"part_errors": trajectory.part_errors}),
        **({} if trajectory.part_check is None else {"part_check": trajectory.part_check}),
        **jobs.planned_report(job),
        **checked,
        "outputs": {name: extremes(values) for name, values in outputs.items()},
        **({"stress_errors": uncertain} if uncertain else {}),
        "units": probes.column_units(task.system.outputs),
        "labels": probes.column_labels(task.system.outputs),
        "output_columns": {
            name: list(output.columns) for name, output in task.system.outputs.items()
        },
        "segments": len(record.manifest.segments) if record else 0,
        "notices": job.notices,
        **failure,
    }
    marks = [(one.time, one.name) for one in trajectory.events]
    noise = (report.get("acceleration_noise") or 0.0) * trajectory.system.weight
    silent = panels.find_noise(task.system.outputs, outputs, trajectory.system.scale, noise)
    report["round_off"] = sorted(silent)
    errors = kinds.errors_of(report)
    figures = panels.figures_of(
        task.system.outputs,
        trajectory.times,
        outputs,
        task.title,
        task.across,
        marks,
        silent,
        errors,
        task.display,
    )

    def write(out: Path) -> list[Path]:
        return [*write_outputs(out, trajectory.times, outputs, report, job.units), *files]

    missing = jobs.deliver(job, report, write, figures, draw and partial(draw, trajectory))
    view: list[ReportTable | str] = [
        summary(task, report),
        *jobs.planned_lines(job),
        *task.remarks,
    ]
    view += [*kinds.views(report, task.display), *list_files(report)]
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
    with (
        contextlib.suppress(FmbsError),
        warnings.catch_warnings(),
    ):  # the run itself will say what is wrong
        warnings.simplefilter("ignore", Notice)
        if cold and task.scheme is not None:
            dynamics.integrate(task.system, task.scheme, task.scheme.step)


def attempt(
    job: Job, task: RunTask, record: Recorder | None = None, resume: Resumed | None = None
) -> tuple[Trajectory, SolverError | Warned | None]:
    """The trajectory of a task, or the part up to a failure with its error; a task that never
    starts is explained.

    Where warnings are to be errors, a run ends with one that it gives, and keeps what there is as
    well.
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
            if not isinstance(error, Contradiction):  # of bad input no folder is left
                failures.write_failed_start(job, error, task.facts["provenance"])
            raise
        return error.partial, error


def extremes(values: np.ndarray) -> dict[str, float]:
    """Smallest, largest and last value of an output."""
    return {"min": float(values.min()), "max": float(values.max()), "final": float(values[-1])}


def path_report(trajectory: Trajectory) -> dict[str, Any]:
    """Of every equilibrium the negative pivots of its tangent and whether it is stable, and what
    its path has passed.
    """
    negative = [None if np.isnan(one) else int(one) for one in np.asarray(trajectory.negative)]
    stable = [None if one is None else one == 0 for one in negative]
    listed = zip(trajectory.times.tolist(), negative, stable, strict=True)
    states = [{"at": at, "negative_pivots": pivots, "stable": good} for at, pivots, good in listed]
    return {"equilibria": states, "crossings": [asdict(one) for one in trajectory.crossings]}


def summary(task: RunTask, report: Mapping[str, Any]) -> str:
    """The run in one line."""
    text = (
        f"{task.words}, {report['steps']} steps, {report['newton_iterations']} Newton iterations, "
    )
    text += f"{report['cpu_s']:.3g} s CPU, {report['wall_s']:.3g} s wall"
    drift = report["energy_drift"]
    return text if drift is None else f"{text}, energy error {drift:.3g} J"
