"""`fmbs run`: the full model of a scene, over time, at rest, or its vibration modes; or a saved reduced model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("run", into="fmbs-{}")
@common.DURATION
@click.option("--step", type=float, metavar="SECONDS", help="Step of a saved reduced model.")
@common.PLOTS
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
def command(path: Path, **options: Any) -> studies.Run:
    """Solve SCENE: a motion, an equilibrium, or vibration modes, as its `analysis` says.

    Writes outputs.csv (time in column t), report.json and outputs.png into --out, or into ./fmbs-NAME where NAME.yaml is the scene.
    A solve that fails keeps what it reached, and ends with exit code 4. A motion that takes long is kept in the folder `history`
    there while it runs: `fmbs resume` goes on with one that was stopped, by --time-limit too. SCENE may also be a reduced model
    saved by `fmbs reduce` or `fmbs train` (NAME.h5): that is `fmbs rom run`.
    """
    return studies.run(path, **options)
