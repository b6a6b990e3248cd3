"""Run a scene or a saved reduced model: solve it with what it reaches kept, then outputs, report, plots and pictures.

    source -> RunTask -> Trajectory, with the error that ended it early -> Run -> outputs.csv, outputs.png, report.json

What is run is a `RunTask`: full models over time and equilibria from `scene_task`, saved models from `models.task`.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import dynamics
from ..core.errors import FmbsError, InputError, MissingFeature, SolverError, say
from ..dynamics import GeneralizedAlpha, Trajectory, departures
from ..results import frames as frames_
from ..results import motion, segments, series, temporal
from ..results.segments import Recorder
from ..scenes import build
from ..scenes.analyses import Analysis, History, States
from ..systems import probes
from . import compiling, failures, judging, panels, recording, reports
from . import job as jobs
from .job import Job
from .outcome import OUTPUTS, UNITS, Run, write_outputs
from .result import Table, conclude, describe_error, list_files

if TYPE_CHECKING:
    from ..dynamics.checkpoint import Resumed
    from ..scenes import Scene
    from ..systems import System

SERIES = "motion"

Draw = Callable[[Trajectory, Path], Sequence[Callable[[], Path]]]  #: pictures and series in a folder, each drawn when called


@dataclass(frozen=True)
class RunTask:
    """What is run, and what its report says of it."""

    title: str
    mark: str  #: fingerprint of what is computed
    origin: Mapping[str, Any]  #: provenance
    facts: Mapping[str, Any]  #: of the report: what it is, at which parameters, its sizes
    words: str  #: the same at the begin of a line
    system: System
    solve: Callable[[Callable[[float], None], recording.Watch | None, Resumed | None], Trajectory]
    judge: Callable[[Trajectory], dict[str, Any]]  #: energy error and noise of the motion, with warnings
    scheme: GeneralizedAlpha | None = None  #: None of equilibria
    request: Mapping[str, Any] | None = None  #: what `resume` needs to know; None of what runs anew
    label: str = "integrating"
    remarks: Sequence[str] = ()  #: sentences on the result


def run_source(
    job: Job, duration: float | None, step: float | None, plots: bool, picture: bool, checkpoint: float | None, time_limit: float
) -> Run:
    """A scene or a saved model, as its file says; options that are not for it are refused."""
    from . import models

    limits = {"--checkpoint": checkpoint is not None, "--time-limit": isfinite(time_limit)}
    given = " and ".join(name for name, used in limits.items() if used)
    if models.is_model(job):
        if given:
            raise InputError(say(given, "a scene", f"{job.path}", "a reduced model runs anew in seconds"))
        return models.run_saved(job, duration, step, plots, picture)
    if picture:
        raise InputError(say("--picture", "a saved reduced model (.h5)", f"{job.path}", "draw a scene with fmbs render"))
    if step is not None:
        raise InputError(say("--step", "a saved reduced model (.h5)", f"{job.path}", "a scene has its own step: analysis.step"))
    scene = jobs.read_scene(job, duration)
    if given and not scene.analysis.moves:
        raise InputError(say(given, "a scene with a dynamic analysis", scene.analysis.word, "leave the option out"))
    if given and job.out is None:
        raise InputError(say(given, "a folder for the results", "none", "give one: out"))
    if isinstance(scene.analysis, States):
        from . import near_states

        return near_states.solve_states(job, scene, scene.analysis, plots=plots)
    make = partial(scene_task, job, scene, duration, checkpoint)
    return conclude(solve(job, reports.fingerprint(scene), make, plots, limit=time_limit))


def render_scene(job: Job, duration: float | None, frames: int, ending: str, scale: float) -> Run:
    """A scene, with its picture and its animation of `frames` instants (none for 0), `.gif` or `.mp4`."""
    from . import pictures

    scene = jobs.read_scene(job, duration)
    if isinstance(scene.analysis, States):
        from . import near_states

        if scale != 1.0:
            raise InputError(say("--scale", "a motion or an equilibrium", scene.analysis.word, "shapes have a size of their own"))
        draw = partial(near_states.pictures, scene.name, frames, ending)
        return near_states.solve_states(job, scene, scene.analysis, draw, [near_states.PICTURE])
    names = [pictures.PICTURE, *([Path(pictures.ANIMATION).stem + ending] if frames else [])]
    make = partial(scene_task, job, scene, duration)
    draw = partial(pictures.scene, scene, count=frames, names=(names[0], names[-1]), scale=scale)
    return conclude(solve(job, reports.fingerprint(scene), make, True, draw, names))


def export_scene(job: Job, duration: float | None, frames: int) -> Run:
    """A scene, with its VTK series."""

    def draw(trajectory: Trajectory, out: Path) -> Sequence[Callable[[], Path]]:
        rows = frames_.spread(trajectory.times, frames)
        one = out / f"{SERIES}{temporal.SUFFIX}"
        return [
            partial(series.write_each, motion.pieces(trajectory, rows), out, SERIES),
            partial(temporal.write, motion.pieces(trajectory, rows), one),
        ]

    scene = jobs.read_scene(job, duration)
    if isinstance(scene.analysis, States):
        from . import near_states

        return near_states.solve_states(job, scene, scene.analysis, near_states.write_series, [f"{near_states.SERIES}.pvd"])
    make = partial(scene_task, job, scene, duration)
    return conclude(solve(job, reports.fingerprint(scene), make, True, draw, [f"{SERIES}.pvd", f"{SERIES}{temporal.SUFFIX}"]))


def scene_task(job: Job, scene: Scene, duration: float | None = None, checkpoint: float | None = None) -> RunTask:
    """The full model of a scene, over time or at rest."""
    analysis = scene.analysis
    if not isinstance(analysis, History):
        known = " or ".join(sorted(word for word, kind in Analysis.known.items() if issubclass(kind, History)))
        raise InputError(say("analysis.type", known, analysis.word, f"use fmbs run for {analysis.word}"))
    raw = build.system(scene, allow_outside=job.allow_outside)
    reduced = build.chosen_form(scene, raw)
    mark, origin = reports.fingerprint(scene), reports.provenance(scene)
    facts = {**heading(scene), **sizes(raw, reduced)}
    words = f"{facts['scene']}: {facts['dofs']} dofs, {facts['constraints']} constraints ({facts['unknowns']} unknowns, "
    request = {
        "scene": str(job.path.absolute()),
        "changes": dict(job.changes),
        "duration": duration,
        "allow_outside": job.allow_outside,
        "repair": job.repair,
        "checkpoint": checkpoint,
        "fingerprint": mark,
        "provenance": reports.plain(origin),
    }
    return RunTask(
        scene.name,
        mark,
        origin,
        facts,
        f"{words}{facts['multipliers']} multipliers)",
        reduced,
        partial(analysis.solve, reduced),
        partial(judging.balances, analysis.scheme),
        analysis.scheme,
        request if analysis.moves and job.scene is None else None,
        analysis.label,
    )


def solve(
    job: Job,
    mark: str,
    make: Callable[[], RunTask],
    plots: bool = True,
    draw: Draw | None = None,
    names: Sequence[str] = (),
    limit: float = np.inf,
) -> Run:
    """Run a task into the output folder, settled before the task is made, where nothing of another run is touched."""
    wanted = (OUTPUTS, UNITS, reports.REPORT, *(["outputs.png"] if plots else []), *names)
    with recording.place(job, wanted, mark) as out:
        cold = compiling.announce(job)
        task = make()
        warm_up(task, cold)
        record = Recorder(out, task.request, task.request["checkpoint"]) if out and task.request else None
        return finish(job, task, plots, draw, record, None, limit)


def finish(
    job: Job,
    task: RunTask,
    plots: bool,
    draw: Draw | None = None,
    record: Recorder | None = None,
    resume: Resumed | None = None,
    limit: float = np.inf,
) -> Run:
    """Solve a task, or go on with it; its outputs, report, plots and pictures."""
    cpu, wall = time.process_time(), time.perf_counter()
    job.trajectory, error = attempt(job, task, record, resume, limit)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    trajectory, out = job.trajectory, job.made
    beyond = departures.find(trajectory)
    if error is not None:
        departures.warn(beyond)  # what a run sees that ends early may be older
    outputs, cost = dynamics.outputs(trajectory), trajectory.statistics
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
        **task.judge(trajectory),
        **({"events": [asdict(one) for one in trajectory.events]} if trajectory.events else {}),
        **({"beyond_training": [asdict(one) for one in beyond]} if beyond else {}),
        "outputs": {name: extremes(values) for name, values in outputs.items()},
        "units": probes.column_units(task.system.outputs),
        "labels": probes.column_labels(task.system.outputs),
        "segments": len(record.manifest.segments) if record else 0,
        "fingerprint": task.mark,
        "provenance": task.origin,
        "notices": job.notices,
    }
    figures = panels.figures_of(task, trajectory.times, outputs, [(one.time, one.name) for one in trajectory.events])
    missing = None
    if out is not None:
        with segments.room(out, out):
            files = [*write_outputs(out, trajectory.times, outputs, report), out / reports.REPORT]
            report["files"] = files + (figures.save(out) if plots else [])
            report = failures.write_failure(out, report, error, plots)
            reports.write_report(out, report)
            if draw is not None:
                try:
                    report["files"] = [*report["files"], *(order() for order in draw(trajectory, out))]
                except MissingFeature as problem:
                    missing, report = problem, report | describe_error(problem) if error is None else report
                reports.write_report(out, report)
    view: list[Table | str] = [summary(task, report), *task.remarks]
    view += [*([table_of_events(trajectory)] if trajectory.events else [])]
    view += [*([table_of_outputs(report)] if outputs else []), *failures.views(report), *list_files(report)]
    about = f"{report.get('scene') or task.title}: {len(trajectory.times)} instants, {', '.join(outputs) or 'no outputs'}"
    return Run(
        about=about,
        report=report,
        lines=view,
        figures=figures,
        error=error or missing,
        motion=trajectory,
        outputs=outputs,
    )


def warm_up(task: RunTask, cold: bool) -> None:
    """Compile what a motion needs before it is timed and recorded."""
    with contextlib.suppress(FmbsError):  # the run itself will say what is wrong
        if cold and task.scheme is not None:
            dynamics.integrate(task.system, task.scheme, task.scheme.step)


def attempt(
    job: Job, task: RunTask, record: Recorder | None = None, resume: Resumed | None = None, limit: float = np.inf
) -> tuple[Trajectory, SolverError | None]:
    """The trajectory of a task, or the part up to a failure with its error; a task that never starts is explained."""
    try:
        with recording.stoppable(record, limit) as watch:
            trajectory = task.solve(job.progress(task.label), watch, resume)
        broken = dynamics.unstable(trajectory, task.scheme.step) if task.scheme else None
        if broken is None:
            return trajectory, None
        raise broken
    except SolverError as error:
        if record is not None:
            record.fail()
        if error.partial is None:
            failures.write_failed_start(job, error, task.origin)
            raise
        return error.partial, error


def heading(scene: Scene) -> dict[str, Any]:
    """Which scene, with which parameters, and what is done with it."""
    return {
        "scene": jobs.title(scene),
        "file": scene.path,
        "parameters": dict(scene.parameters),
        "analysis": scene.analysis.word,
    }


def sizes(raw: System, reduced: System) -> dict[str, int]:
    """Coordinates and constraint rows with all multipliers, and what is left to solve for."""
    return {
        "dofs": raw.size,
        "constraints": len(raw.constraints.names),
        "unknowns": reduced.size,
        "multipliers": len(reduced.constraints.names),
    }


def extremes(values: np.ndarray) -> dict[str, float]:
    """Smallest, largest and last value of an output."""
    return {"min": float(values.min()), "max": float(values.max()), "final": float(values[-1])}


def table_of_outputs(report: Mapping[str, Any]) -> Table:
    """Smallest, largest and last value of every column."""
    rows = [
        (panels.heading_of(report["units"], report["labels"], name), *ends.values()) for name, ends in report["outputs"].items()
    ]
    return Table("Outputs (SI units)", ("output", "min", "max", "final"), rows)


def table_of_events(trajectory: Trajectory) -> Table:
    """When events happened, what they did, and the kinetic energy that they took."""
    rows = []
    for one in trajectory.events:
        done = [*(f"releases {name}" for name in one.release), *(f"locks {name}" for name in one.lock)]
        rows.append((one.name, one.time, ", ".join([*done, *(["stops the run"] if one.stop else [])]), one.loss))
    return Table("Events", ("event", "time [s]", "what it does", "energy lost [J]"), rows)


def summary(task: RunTask, report: Mapping[str, Any]) -> str:
    """The run in one line."""
    text = f"{task.words}, {report['steps']} steps, {report['newton_iterations']} Newton iterations, "
    text += f"{report['cpu_s']:.3g} s CPU, {report['wall_s']:.3g} s wall"
    drift = report["energy_drift"]
    return text if drift is None else f"{text}, energy error {drift:.3g} J"
