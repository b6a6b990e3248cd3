"""`fmbs render`: deformed configurations of a scene as pictures and as an animation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("render", into="fmbs-{}")
@common.DURATION
@click.option("--frames", type=click.IntRange(1, 1000), default=60, show_default=True, help="Frames of the animation.")
@click.option("--gif/--no-gif", default=True, help="Draw the animation (default: yes).")
def command(path: Path, **options: Any) -> studies.Run:
    """Solve SCENE and draw it: picture.png at the instants of its `pictures`, and animation.gif.

    Writes what `fmbs run` writes, too. Without OpenGL these numbers are kept, and the exit code is 7.
    """
    return studies.render(path, **options)
