"""`fmbs run`: the full model of a scene, over time, at rest, or its vibration modes; or a saved reduced model."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, say
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from ..scenes import Scene

MODES = "modes.csv"
SAVED = (".h5", ".hdf5")


@common.command("run")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
@click.option("--step", type=float, metavar="SECONDS", help="Step of a saved reduced model.")
@click.option("--plots/--no-plots", default=True, help="Draw the outputs into outputs.png (default: yes).")
@click.option(
    "--picture", is_flag=True, help="Draw a saved reduced model into picture.png, lifted to its centre lines and surfaces."
)
@click.option(
    "--checkpoint",
    type=click.FloatRange(0.0),
    metavar="SECONDS",
    help="Keep the motion and a checkpoint every so many seconds and at the end (default: every 10, of runs that take longer).",
)
@common.TIME_LIMIT
def command(
    session: Session,
    duration: float | None,
    step: float | None,
    plots: bool,
    picture: bool,
    checkpoint: float | None,
    limit: float,
) -> Result:
    """Solve SCENE: a motion, an equilibrium, or vibration modes, as its `analysis` says.

    Writes outputs.csv (time in column t), report.json and outputs.png into --out, or into ./fmbs-NAME where NAME.yaml is the scene.
    A solve that fails keeps what it reached, and ends with exit code 4. A motion that takes long is kept in the folder `history`
    there while it runs: `fmbs resume` goes on with one that was stopped, by --time-limit too. SCENE may also be a reduced model
    saved by `fmbs reduce` or `fmbs train` (NAME.h5): that is `fmbs rom run`.
    """
    from . import rom, solving

    of_motions = {"--checkpoint": checkpoint is not None, "--time-limit": isfinite(limit)}
    given = " and ".join(name for name, used in of_motions.items() if used)
    if session.path.suffix in SAVED:
        if given:
            raise InputError(say(given, "a scene", f"{session.path}", "a reduced model runs anew in seconds"))
        return rom.solve(session, duration, step, plots, picture)
    if picture:
        raise InputError(say("--picture", "a saved reduced model (.h5)", f"{session.path}", "draw a scene with fmbs render"))
    if step is not None:
        raise InputError(say("--step", "a saved reduced model (.h5)", f"{session.path}", "a scene has its own step: analysis.step"))
    scene = common.read_scene(session, duration)
    dynamic = scene.analysis.type == "dynamic"
    if given and not dynamic:
        raise InputError(say(given, "a scene with a dynamic analysis", scene.analysis.type, "leave the option out"))
    names = (MODES if scene.analysis.type == "modes" else solving.OUTPUTS, reports.REPORT)
    job = {
        "scene": str(session.path.absolute()),
        "changes": dict(session.changes),
        "duration": duration,
        "allow_outside": session.allow_outside,
        "repair": session.repair,
        "checkpoint": checkpoint,
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.plain(reports.provenance(scene)),
    }
    with solving.kept(session, scene, names, job, checkpoint) as record:
        if scene.analysis.type == "modes":
            return modes(session, scene)
        solved = solving.solve(session, scene, record if dynamic else None, limit=limit)
        _, found = solving.keep(session, solved, plots=plots)
    return solving.result(solved, found, [])


def modes(session: Session, scene: Scene) -> Result:
    """Vibration modes about the unloaded reference: frequencies on stdout and in modes.csv."""
    import numpy as np

    from .. import dynamics
    from ..core import durable
    from ..results import segments
    from ..scenes import build, where
    from ..systems import free_motions
    from ..systems.loads import TorsionSpring
    from . import solving

    acting = {name: load for name, load in scene.loads.items() if isinstance(load, TorsionSpring)}
    raw = solving.system(session, scene.model_copy(update={"loads": acting}))
    free_motions.refuse_limp(where(scene, "analysis"), raw)
    reduced = build.chosen_form(scene, raw)
    omega = dynamics.vibration_modes(reduced, getattr(scene.analysis, "count", 10)).frequencies
    frequencies = omega / (2 * np.pi)
    out = solving.output_folder(session, scene, (MODES, reports.REPORT))
    found: dict[str, Any] = {
        "status": "ok",
        **solving.heading(scene),
        **solving.sizes(raw, reduced),
        "frequencies_hz": frequencies,
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.provenance(scene),
        "files": [out / MODES, out / reports.REPORT],
    }
    numbers = np.arange(1, len(omega) + 1)
    with segments.room(out), durable.place(out / MODES) as part:
        np.savetxt(
            part,
            np.column_stack([numbers, frequencies, omega]),
            delimiter=",",
            header="mode,frequency_hz,omega_rad_per_s",
            comments="",
            fmt=["%d", "%.15g", "%.15g"],
        )
    reports.keep(session, out, found)
    rows = zip(numbers.tolist(), frequencies.tolist(), omega.tolist(), strict=True)
    view = screen.table(f"{found['scene']}: vibration modes", ("mode", "frequency [Hz]", "omega [rad/s]"), rows)
    return Result(found, [view, "written: " + ", ".join(map(str, found["files"]))])
