"""`fmbs export`: the motion of a scene as a VTK series."""

from __future__ import annotations

import click

from . import common, reports
from .common import Result, Session

SERIES = "motion"


@common.command("export")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
@click.option("--frames", "count", type=click.IntRange(1, 100_000), default=201, help="Instants of the series (default: 201).")
def command(session: Session, duration: float | None, count: int) -> Result:
    """Solve SCENE and write motion.pvd with one .vtu an instant: displacement, velocity, strain, curvature, stress of plates.

    Writes what `fmbs run` writes, too.
    """
    from ..results import series
    from . import picture, solving

    scene = common.read_scene(session, duration)
    name = f"{SERIES}.pvd"
    with solving.place(session, scene, (solving.OUTPUTS, reports.REPORT, name)):
        solved = solving.solve(session, scene)
        out, found = solving.keep(session, solved, (name,))
    path = series.write_each(picture.pieces(solved.trajectory, picture.spread(solved.trajectory, count)), out, SERIES)
    return solving.result(solved, found, [path])
