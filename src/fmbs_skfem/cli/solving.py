"""From a scene to its solved system: what `run`, `render`, `export` and `demo` share."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import dynamics
from ..core.errors import FmbsError, InputError, SolverError, say
from ..dynamics import GeneralizedAlpha, Newton, Trajectory
from ..scenes import Scene, build
from ..systems import System
from . import common
from .common import Result, Session

if TYPE_CHECKING:
    from rich.table import Table

OUTPUTS = "outputs.csv"
PLOT = "outputs.png"


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


def system(session: Session, scene: Scene) -> System:
    """The system of a scene with all multipliers."""
    return build.system(scene, allow_outside=session.allow_outside)


def solve(session: Session, scene: Scene) -> Solved:
    """Integrate the scene, or follow its loads to equilibrium; a failed solve keeps what it reached."""
    raw = system(session, scene)
    reduced = build.chosen_form(scene, raw)
    if common.announce_compiling(scene.path) and scene.analysis.type == "dynamic":
        step = scene.analysis.step
        with contextlib.suppress(FmbsError):  # the run itself will say what is wrong
            dynamics.integrate(reduced, GeneralizedAlpha(step, scene.analysis.rho_inf), step)
    cpu, wall = time.process_time(), time.perf_counter()
    trajectory, error = attempt(scene, reduced)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    return Solved(scene, raw, trajectory, dynamics.outputs(trajectory), cpu, wall, error)


def attempt(scene: Scene, reduced: System) -> tuple[Trajectory, SolverError | None]:
    """The trajectory of a dynamic or static analysis, or the part up to a failure with its error."""
    analysis = scene.analysis
    try:
        if analysis.type == "dynamic":
            scheme = GeneralizedAlpha(analysis.step, analysis.rho_inf)
            with common.progress("integrating") as advance:
                newton = Newton(tolerance=analysis.tolerance)
                return dynamics.integrate(reduced, scheme, analysis.duration, newton, build.kept_steps(scene), advance), None
        if analysis.type == "static":
            with common.progress("loading") as advance:
                newton = Newton(tolerance=analysis.tolerance)
                return dynamics.solve_statics(reduced, analysis.load_steps, newton, progress=advance), None
    except SolverError as error:
        if error.partial is None:
            raise
        return error.partial, error
    raise InputError(say("analysis.type", "dynamic or static", analysis.type, "use fmbs run for modes"))


def report(session: Session, solved: Solved) -> dict[str, Any]:
    """The JSON object of a solved scene."""
    trajectory, scene = solved.trajectory, solved.scene
    statistics = trajectory.statistics
    dynamic = scene.analysis.type == "dynamic"
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
        "energy_drift": dynamics.energy_drift(trajectory) if dynamic else None,
        "outputs": {name: extremes(values) for name, values in solved.columns.items()},
        "fingerprint": common.fingerprint(scene),
        "versions": common.versions(),
    }


def heading(scene: Scene) -> dict[str, Any]:
    """Which scene, with which parameters, and what is done with it."""
    return {
        "scene": scene.name or (scene.path.stem if scene.path else ""),
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
    return common.table("Outputs (SI units)", ("output", "min", "max", "final"), rows)


def summary(found: Mapping[str, Any]) -> str:
    """The run in one line."""
    text = f"{found['scene']}: {found['dofs']} dofs, {found['constraints']} constraints ({found['unknowns']} unknowns, "
    text += f"{found['multipliers']} multipliers), {found['steps']} steps, {found['newton_iterations']} Newton iterations, "
    text += f"{found['cpu_s']:.3g} s CPU, {found['wall_s']:.3g} s wall"
    drift = found["energy_drift"]
    return text if drift is None else f"{text}, energy drift {drift:.3g} J"


def write_outputs(out: Path, times: np.ndarray, columns: Mapping[str, np.ndarray]) -> Path:
    """outputs.csv: time (load factor of a static analysis) in column t, then every output; complete or not at all."""
    path, part = out / OUTPUTS, out / (OUTPUTS + ".part")
    header = ",".join(("t", *columns))
    np.savetxt(part, np.column_stack([times, *columns.values()]), delimiter=",", header=header, comments="", fmt="%.15g")
    return part.replace(path)


def plot_outputs(out: Path, solved: Solved) -> Path:
    """outputs.png: all outputs of one kind in one figure row each, over time."""
    from ..results import plots

    axis = solved.trajectory.times
    found = {name: {solved.scene.name or "full": values} for name, values in solved.columns.items() if np.isfinite(values).all()}
    return plots.history_grid(out / PLOT, axis, found, columns=2 if len(found) > 3 else 1, title=solved.scene.name)


def keep(session: Session, solved: Solved, names: tuple[str, ...] = (), plots: bool = True) -> tuple[Path, dict[str, Any]]:
    """Write outputs.csv, report.json and outputs.png into the output folder; the folder and the report."""
    found = report(session, solved)
    plots = plots and bool(solved.columns) and len(solved.trajectory.times) > 1
    written = (OUTPUTS, common.REPORT, *([PLOT] if plots else []))
    out = output_folder(session, solved.scene, (*written, *names))
    write_outputs(out, solved.trajectory.times, solved.columns)
    if plots:
        plot_outputs(out, solved)
    found = {**found, "files": [out / name for name in written]}
    common.write_json(out / common.REPORT, {**found, "notices": session.notices})
    return out, found


def output_folder(session: Session, scene: Scene, names: tuple[str, ...]) -> Path:
    """The folder of a run: --out, or `fmbs-<name of the scene file>` where the command was called."""
    stem = scene.path.stem if scene.path else "scene"
    return common.folder(session, f"fmbs-{stem}", names, common.fingerprint(scene))


def result(solved: Solved, found: dict[str, Any], files: list[Path], error: FmbsError | None = None) -> Result:
    """What a command that solves shows: one line, the outputs, the files."""
    listed = [*found.get("files", ()), *files]
    found = {**found, "files": listed}
    failure = error or solved.error
    if failure is not None and solved.error is None:
        found = {**found, **common.failed(failure)}
    tables = [table_of_outputs(solved.columns)] if solved.columns else []
    return Result(found, [summary(found), *tables, "written: " + ", ".join(map(str, listed))], failure)
