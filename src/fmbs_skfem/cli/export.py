"""`fmbs export`: the motion of a scene as a VTK series."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("export", into="fmbs-{}")
@common.DURATION
@click.option("--frames", type=click.IntRange(1, 100_000), default=201, help="Instants of the series (default: 201).")
def command(path: Path, **options: Any) -> studies.Run:
    """Solve SCENE and write motion.pvd with one .vtu an instant: displacement, velocity, strain, curvature, stress of plates.

    Writes what `fmbs run` writes, too.
    """
    return studies.export(path, **options)
