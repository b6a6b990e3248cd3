"""`fmbs render`: deformed configurations of a scene as pictures and as an animation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..core.errors import MissingFeature
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..scenes import Scene

PICTURE, ANIMATION = "picture.png", "animation.gif"
FRAMES, INSTANTS = 60, 6  #: of the animation and of the picture


@common.command("render")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
@click.option("--frames", "count", type=click.IntRange(1, 1000), default=FRAMES, show_default=True, help="Frames of the animation.")
@click.option("--gif/--no-gif", default=True, help="Draw the animation (default: yes).")
def command(session: Session, duration: float | None, count: int, gif: bool) -> Result:
    """Solve SCENE and draw it: picture.png at the instants of its `pictures`, and animation.gif.

    Writes what `fmbs run` writes, too. Without OpenGL these numbers are kept, and the exit code is 7.
    """
    from . import solving

    scene = common.read_scene(session, duration)
    names = (PICTURE, *([ANIMATION] if gif else []))
    with solving.place(session, scene, (solving.OUTPUTS, reports.REPORT, *names)):
        solved = solving.solve(session, scene)
        out, found = solving.keep(session, solved, names)
    try:
        drawn = draw(scene, solved.trajectory, out, count if gif else 0)
    except MissingFeature as error:
        return solving.result(solved, found, [], error)
    return solving.result(solved, found, drawn)


def draw(scene: Scene, trajectory: Trajectory, out: Path, count: int) -> list[Path]:
    """The picture of a trajectory, and its animation with `count` frames (none for 0)."""
    from ..results import pictures
    from ..results.pictures import Look
    from . import picture

    color = picture.color(scene, trajectory.system)
    rows = picture.spread(trajectory, max(count, INSTANTS))
    fields = (color,) if color else ()
    moving = picture.frames(trajectory, rows, fields)
    limits = pictures.limits(moving, color) if color else None
    wanted = picture.instants(scene, trajectory)
    chosen = moving if wanted is None else picture.frames(trajectory, picture.nearest(trajectory, wanted), fields)
    written = [pictures.render(chosen, out / PICTURE, wanted, Look(color, title=scene.name))]
    if count:
        look = Look(color, limits=limits, title=scene.name, size=(800, 600))
        with screen.progress("drawing"):
            written.append(pictures.animate(moving, out / ANIMATION, count=count, look=look))
    return written
