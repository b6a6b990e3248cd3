"""`fmbs run`: the full model of a scene, over time, at rest, or its vibration modes; or a saved reduced model."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, say
from . import common
from .common import Result, Session

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..scenes import Scene

MODES, PICTURE = "modes.csv", "picture.png"
INSTANTS = 7  #: configurations of a saved model in its picture
SAVED = (".h5", ".hdf5")


@common.command("run")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
@click.option("--step", type=float, metavar="SECONDS", help="Step of a saved reduced model.")
@click.option("--plots/--no-plots", default=True, help="Draw the outputs into outputs.png (default: yes).")
@click.option(
    "--picture", is_flag=True, help="Draw a saved reduced model into picture.png, lifted to its centre lines and surfaces."
)
def command(session: Session, duration: float | None, step: float | None, plots: bool, picture: bool) -> Result:
    """Solve SCENE: a motion, an equilibrium, or vibration modes, as its `analysis` says.

    Writes outputs.csv (time in column t), report.json and outputs.png into --out, or into ./fmbs-NAME where NAME.yaml is the scene.
    A solve that fails keeps what it reached, and ends with exit code 4. SCENE may also be a reduced model saved by `fmbs reduce`
    (NAME.h5), with --duration and --step.
    """
    from . import solving

    if session.path.suffix in SAVED:
        return saved(session, duration, step, picture)
    if picture:
        raise InputError(say("--picture", "a saved reduced model (.h5)", f"{session.path}", "draw a scene with fmbs render"))
    if step is not None:
        raise InputError(say("--step", "a saved reduced model (.h5)", f"{session.path}", "a scene has its own step: analysis.step"))
    scene = common.read_scene(session, duration)
    if scene.analysis.type == "modes":
        return modes(session, scene)
    solved = solving.solve(session, scene)
    _, found = solving.keep(session, solved, plots=plots)
    return solving.result(solved, found, [])


def modes(session: Session, scene: Scene) -> Result:
    """Vibration modes about the reference configuration: frequencies on stdout and in modes.csv."""
    import numpy as np

    from .. import dynamics
    from ..scenes import build
    from . import solving

    raw = solving.system(session, scene)
    reduced = build.chosen_form(scene, raw)
    omega = dynamics.vibration_modes(reduced, getattr(scene.analysis, "count", 10)).frequencies
    frequencies = omega / (2 * np.pi)
    out = solving.output_folder(session, scene, (MODES, common.REPORT))
    found: dict[str, Any] = {
        "status": "ok",
        **solving.heading(scene),
        **solving.sizes(raw, reduced),
        "frequencies_hz": frequencies,
        "fingerprint": common.fingerprint(scene),
        "versions": common.versions(),
        "files": [out / MODES, out / common.REPORT],
    }
    numbers = np.arange(1, len(omega) + 1)
    np.savetxt(
        out / MODES,
        np.column_stack([numbers, frequencies, omega]),
        delimiter=",",
        header="mode,frequency_hz,omega_rad_per_s",
        comments="",
        fmt=["%d", "%.15g", "%.15g"],
    )
    common.write_json(out / common.REPORT, {**found, "notices": session.notices})
    rows = zip(numbers.tolist(), frequencies.tolist(), omega.tolist(), strict=True)
    view = common.table(f"{found['scene']}: vibration modes", ("mode", "frequency [Hz]", "omega [rad/s]"), rows)
    return Result(found, [view, "written: " + ", ".join(map(str, found["files"]))])


def saved(session: Session, duration: float | None, step: float | None, picture: bool) -> Result:
    """Run a saved reduced model: outputs.csv, report.json and, if wanted, picture.png."""
    from .. import dynamics
    from ..reduction import study
    from . import solving

    if duration is None or step is None:
        raise InputError(say(f"{session.path}", "--duration and --step", "none", "give both in seconds"))
    if session.changes:
        raise InputError(say("--set", "a scene", "a saved reduced model", "train another one with fmbs reduce --set"))
    mark = hashlib.sha256(session.path.read_bytes() if session.path.is_file() else b"").hexdigest() + f" {duration} {step}"
    common.announce_compiling()
    trajectory = study.run_saved(session.path, duration, step)
    columns, cost = dynamics.outputs(trajectory), trajectory.statistics
    names = (solving.OUTPUTS, common.REPORT, *([PICTURE] if picture else []))
    out = common.folder(session, f"fmbs-{session.path.stem}", names, mark)
    drawn = [draw(trajectory, out, session.path.stem)] if picture else []
    found: dict[str, Any] = {
        "status": "ok",
        "model": session.path,
        "dofs": trajectory.system.size,
        "constraints": len(trajectory.system.constraints.names),
        "steps": cost.steps,
        "newton_iterations": cost.iterations,
        "cpu_s": cost.cpu_s,
        "wall_s": cost.wall_s,
        "energy_drift": dynamics.energy_drift(trajectory),
        "outputs": {name: solving.extremes(values) for name, values in columns.items()},
        "fingerprint": mark,
        "versions": common.versions(),
        "files": [solving.write_outputs(out, trajectory.times, columns), out / common.REPORT, *drawn],
    }
    common.write_json(out / common.REPORT, {**found, "notices": session.notices})
    return Result(found, [solving.table_of_outputs(columns), "written: " + ", ".join(map(str, found["files"]))])


def draw(trajectory: Trajectory, out: Path, title: str) -> Path:
    """Configurations of a reduced model, coloured by stress or curvature."""
    from ..results import pictures
    from . import picture

    chosen = picture.frames(trajectory, picture.spread(trajectory, INSTANTS))
    return pictures.render(chosen, out / PICTURE, None, pictures.Look(picture.usual_color(trajectory.system), title=title))
