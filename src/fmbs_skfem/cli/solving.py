"""From a scene to its solved system: what `run`, `resume`, `render`, `export` and `demo` share."""

from __future__ import annotations

import contextlib
import shutil
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import dynamics
from ..core import durable
from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import notify
from ..dynamics import GeneralizedAlpha, Newton, Trajectory
from ..dynamics.checkpoint import Moment, Record, Resumed
from ..results import segments
from ..results.segments import Recorder
from ..scenes import Scene, build
from ..systems import System
from ..systems.system import sizes as root_mean_squares
from . import common, failure_report, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from rich.table import Table

OUTPUTS = "outputs.csv"
PLOT = "outputs.png"
NOISE = 1e-3  #: noise of accelerations, relative to the largest, that is told
GAIN = 0.05  #: rise of the energy balance, relative to the largest energy, that is told


@dataclass(frozen=True)
class Solved:
    """A solved scene: the motion (or load path) as far as it went, its outputs, and the error that ended it early."""

    scene: Scene
    raw: System  #: with all multipliers
    trajectory: Trajectory
    columns: dict[str, np.ndarray]  #: output column -> (s,)
    cpu_s: float
    wall_s: float
    error: SolverError | None = None
    segments: int = 0  #: closed on the disk while it ran


class Interrupted(FmbsError):
    """A signal ended a run, which is kept; the exit code is 128 + its number."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(text)
        self.exit_code = 128 + number


class TimeOver(FmbsError):
    """The time that a run was given is over; the run is kept."""

    exit_code = 6


def system(session: Session, scene: Scene) -> System:
    """The system of a scene with all multipliers."""
    return build.system(scene, allow_outside=session.allow_outside)


def solve(
    session: Session, scene: Scene, record: Recorder | None = None, resume: Resumed | None = None, limit: float = np.inf
) -> Solved:
    """Integrate the scene, or follow its loads to equilibrium; a failed solve keeps what it reached.

    `record` keeps a motion on the disk while it runs, and stops it after `limit` seconds; `resume` goes on with one.
    """
    raw = system(session, scene)
    reduced = build.chosen_form(scene, raw)
    with screen.compiling(scene.path) as cold, contextlib.suppress(FmbsError):  # the run itself will say what is wrong
        if cold and scene.analysis.type == "dynamic":
            step = scene.analysis.step
            dynamics.integrate(reduced, GeneralizedAlpha(step, scene.analysis.rho_inf), step)
    cpu, wall = time.process_time(), time.perf_counter()
    trajectory, error = attempt(scene, reduced, record, resume, limit)
    session.work.trajectory = trajectory
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    closed = len(record.manifest.segments) if record else 0
    return Solved(scene, raw, trajectory, dynamics.outputs(trajectory), cpu, wall, error, closed)


def attempt(
    scene: Scene, reduced: System, record: Recorder | None = None, resume: Resumed | None = None, limit: float = np.inf
) -> tuple[Trajectory, SolverError | None]:
    """The trajectory of a dynamic or static analysis, or the part up to a failure with its error."""
    analysis = scene.analysis
    try:
        if analysis.type == "dynamic":
            scheme = GeneralizedAlpha(analysis.step, analysis.rho_inf)
            newton, every = Newton(tolerance=analysis.tolerance, solver=analysis.solver), build.kept_steps(scene)
            with screen.progress("integrating") as advance, stoppable(record, limit) as watch:
                motion = dynamics.integrate(reduced, scheme, analysis.duration, newton, every, advance, watch, resume)
            broken = dynamics.unstable(motion, analysis.step)
            if broken is None:
                return motion, None
            raise broken
        if analysis.type == "static":
            with screen.progress("loading") as advance:
                newton = Newton(tolerance=analysis.tolerance)
                if analysis.method == "arc_length":
                    control = dynamics.ArcLength(1.0 / analysis.load_steps)
                    return dynamics.follow_path(reduced, control, newton, analysis.time, advance), None
                return dynamics.solve_statics(reduced, analysis.load_steps, newton, analysis.time, advance), None
    except SolverError as error:
        if record is not None:
            record.fail()
        if error.partial is None:
            raise
        return error.partial, error
    raise InputError(say("analysis.type", "dynamic or static", analysis.type, "use fmbs run for modes"))


@contextlib.contextmanager
def stoppable(record: Recorder | None, limit: float) -> Iterator[Record | None]:
    """A record that ends its run at SIGINT and SIGTERM, or after `limit` seconds, with a segment and a checkpoint.

    A second signal acts as usual.
    """
    end = time.perf_counter() + limit
    arrived: list[int] = []
    before: dict[int, Any] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)

    def note(number: int, frame: Any) -> None:
        arrived.append(number)
        restore()

    def watch(moment: Moment) -> None:
        assert record is not None
        over = time.perf_counter() >= end and moment.done < moment.steps
        if not arrived and not over:
            return record(moment)
        record.write(moment)
        place = f"at t = {moment.time:.6g} s, after {moment.done} of {moment.steps} steps"
        remedy = f"go on with: fmbs resume {record.folder.parent}"
        if arrived:
            raise Interrupted(arrived[0], f"stopped by {signal.Signals(arrived[0]).name} {place}; {remedy}")
        raise TimeOver(f"stopped by --time-limit {limit:g} {place}; {remedy}")

    if record is None:
        yield None
        return
    if threading.current_thread() is threading.main_thread():
        before |= {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield watch
    finally:
        restore()


@contextlib.contextmanager
def kept(session: Session, scene: Scene, names: tuple[str, ...], job: Mapping[str, Any], every: float | None) -> Iterator[Recorder]:
    """The output folder of a run for `names`, made and locked, and what keeps the run there.

    A history that ended is removed, and so is any with --force; a run that can go on is not.
    """
    with place(session, scene, names) as out, segments.locked(out):
        if (out / segments.FOLDER).exists():
            clear(session, out, reports.fingerprint(scene))
        yield Recorder(out, job, every)


@contextlib.contextmanager
def place(session: Session, scene: Scene, names: tuple[str, ...]) -> Iterator[Path]:
    """The output folder for `names`, settled before anything is solved; removed where it is new and stays empty."""
    new = not default_folder(session, scene).exists()
    out = output_folder(session, scene, names)
    try:
        yield out
    except SolverError as error:
        failure_report.keep_start(out, error, reports.provenance(scene))
        raise
    finally:
        if new:
            with contextlib.suppress(OSError):  # it is not empty
                out.rmdir()


def clear(session: Session, out: Path, mark: str) -> None:
    """Remove the history in a folder, unless it is another run's or one that can go on."""
    if not session.force and segments.exists(out):
        found = segments.manifest(out)
        where = f"--out {out}"
        if found.state is segments.State.RUNNING:
            got = f"a run that was stopped at t = {found.time:.6g} s"
            raise InputError(say(where, "an empty folder", got, f"go on with: fmbs resume {out}; or begin anew with --force"))
        if found.job.get("fingerprint") != mark:
            got, remedy = "the history of another run", "choose another folder, or --force"
            raise InputError(say(where, "an empty folder or one of the same run", got, remedy))
    shutil.rmtree(out / segments.FOLDER)


def report(session: Session, solved: Solved) -> dict[str, Any]:
    """The JSON object of a solved scene."""
    trajectory, scene = solved.trajectory, solved.scene
    statistics = trajectory.statistics
    dynamic = scene.analysis.type == "dynamic"
    drift = energy_drift(trajectory, f"a step of {scene.analysis.step:g} s") if scene.analysis.type == "dynamic" else None
    return {
        **({"status": "ok"} if solved.error is None else common.failed(solved.error)),
        **heading(scene),
        **sizes(solved.raw, trajectory.system),
        "end": float(trajectory.times[-1]),
        "steps": statistics.steps,
        "newton_iterations": statistics.iterations,
        "factorisations": statistics.factorisations,
        "halved_steps": statistics.halved,
        "solver": statistics.solver,
        "cpu_s": statistics.cpu_s if dynamic else solved.cpu_s,
        "wall_s": statistics.wall_s if dynamic else solved.wall_s,
        "energy_drift": drift,
        "acceleration_noise": acceleration_noise(scene, trajectory) if dynamic else None,
        "outputs": {name: extremes(values) for name, values in solved.columns.items()},
        "segments": solved.segments,
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.provenance(scene),
    }


def energy_drift(trajectory: Trajectory, step: str) -> float:
    """Largest change of the energy balance [J], with a notice where the motion gains energy from nowhere."""
    drift, gain = dynamics.energy_errors(trajectory)
    if gain > GAIN:
        remedy = "halve it and compare, or take a smaller rho_inf"
        notify(f"the energy balance rises by {gain:.0%} of the largest energy: {step} is too large for this motion; {remedy}")
    return drift


def acceleration_noise(scene: Scene, trajectory: Trajectory) -> float:
    """Noise of accelerations by round-off [m/s2], with a notice where reactions show it."""
    analysis = build.dynamic(scene)
    scheme = GeneralizedAlpha(analysis.step, analysis.rho_inf)
    noise = dynamics.acceleration_noise(scheme, trajectory.system)
    changes = np.diff(trajectory.v, axis=0) / np.diff(trajectory.times)[:, None]  # what noise hardly reaches
    largest = float(root_mean_squares(trajectory.system, changes).max(initial=0.0))
    if 0.0 < NOISE * largest < noise:
        text = (
            f"round-off makes about {noise:.2g} m/s2 of noise in accelerations and reactions, {noise / largest:.1%} of the largest"
        )
        notify(f"{text}: take a larger step, or a smaller rho_inf")
    return noise


def energy_of_reduced(motion: Trajectory) -> dict[str, float]:
    """Largest change of the energy balance of a reduced model [J], and that over the largest change of an energy.

    A rise is told as that of a full run. A fall is told, too: a full run loses energy to its step alone, a reduced one also where
    its basis does not hold the motion.
    """
    drift = energy_drift(motion, "the step, or the distance from the training,")
    kinds = dynamics.energies(motion)
    balance, scale = kinds[:, 3] - kinds[0, 3], float(np.ptp(kinds[:, :3], axis=0).max())
    change = float(np.abs(balance).max()) / scale if scale > 0.0 else 0.0
    fall = float(-balance.min()) / scale if scale > 0.0 else 0.0
    if fall > GAIN:
        cause = "the step, or the distance from the training, is too large"
        notify(f"the energy balance falls by {fall:.0%} of the largest energy: {cause}; compare with a full run")
    return {"energy_drift": drift, "energy_change": change}


def heading(scene: Scene) -> dict[str, Any]:
    """Which scene, with which parameters, and what is done with it."""
    return {
        "scene": common.title(scene),
        "file": scene.path,
        "parameters": dict(scene.parameters),
        "analysis": scene.analysis.type,
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


def table_of_outputs(columns: Mapping[str, np.ndarray]) -> Table:
    """Smallest, largest and last value of every output."""
    rows = [(name, *extremes(values).values()) for name, values in columns.items()]
    return screen.table("Outputs (SI units)", ("output", "min", "max", "final"), rows)


def summary(found: Mapping[str, Any]) -> str:
    """The run in one line."""
    text = f"{found['scene']}: {found['dofs']} dofs, {found['constraints']} constraints ({found['unknowns']} unknowns, "
    text += f"{found['multipliers']} multipliers), {found['steps']} steps, {found['newton_iterations']} Newton iterations, "
    text += f"{found['cpu_s']:.3g} s CPU, {found['wall_s']:.3g} s wall"
    drift = found["energy_drift"]
    return text if drift is None else f"{text}, energy drift {drift:.3g} J"


def write_outputs(out: Path, times: np.ndarray, columns: Mapping[str, np.ndarray]) -> Path:
    """outputs.csv: time (load factor of a static analysis) in column t, then every output; complete or not at all."""
    header = ",".join(("t", *columns))
    with durable.place(out / OUTPUTS) as part:
        np.savetxt(part, np.column_stack([times, *columns.values()]), delimiter=",", header=header, comments="", fmt="%.15g")
    return out / OUTPUTS


def plot_outputs(out: Path, solved: Solved) -> Path:
    """outputs.png: all outputs of one kind in one figure row each, over time."""
    from ..results import plots

    axis = solved.trajectory.times
    found = {name: {solved.scene.name or "full": values} for name, values in solved.columns.items() if np.isfinite(values).all()}
    return plots.history_grid(out / PLOT, axis, found, columns=2 if len(found) > 3 else 1, title=solved.scene.name)


def keep(session: Session, solved: Solved, names: tuple[str, ...] = (), plots: bool = True) -> tuple[Path, dict[str, Any]]:
    """Write outputs.csv, report.json and outputs.png into the output folder; the folder and the report."""
    found = report(session, solved)
    plots = plots and plottable(solved.trajectory, solved.columns)
    written = (OUTPUTS, reports.REPORT, *([PLOT] if plots else []))
    out = output_folder(session, solved.scene, (*written, *names))
    found = {**found, "files": [out / name for name in written]}
    with segments.room(out, out):
        write_outputs(out, solved.trajectory.times, solved.columns)
        if plots:
            plot_outputs(out, solved)
        found = failure_report.keep(out, found, solved.error, plots)
        reports.keep(session, out, found)
    return out, found


def plottable(trajectory: Trajectory, columns: Mapping[str, np.ndarray]) -> bool:
    """Whether there are curves to draw: several instants, and an output that is finite at all of them."""
    return len(trajectory.times) > 1 and any(np.isfinite(values).all() for values in columns.values())


def output_folder(session: Session, scene: Scene, names: tuple[str, ...]) -> Path:
    """The folder of a run, made; files of another run in it are kept."""
    return reports.folder(session, default_folder(session, scene), names, reports.fingerprint(scene))


def default_folder(session: Session, scene: Scene) -> Path:
    """--out, or `fmbs-<name of the scene file>` where the command was called."""
    return session.out or Path(f"fmbs-{common.stem(scene)}")


def result(solved: Solved, found: dict[str, Any], files: list[Path], error: FmbsError | None = None) -> Result:
    """What a command that solves shows: one line, the outputs, the files."""
    listed = [*found.get("files", ()), *files]
    found = {**found, "files": listed}
    failure = error or solved.error
    if failure is not None and solved.error is None:
        found = {**found, **common.failed(failure)}
    tables = [table_of_outputs(solved.columns)] if solved.columns else []
    tables += failure_report.views(found)
    return Result(found, [summary(found), *tables, "written: " + ", ".join(map(str, listed))], failure)
