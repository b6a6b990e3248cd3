"""`fmbs train`: one reduced model for whole ranges of a scene's parameters, by the greedy algorithm with Kriging."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("train", into="fmbs-{}-train")
@click.option(
    "--tolerance", type=float, metavar="ERROR", help="Wanted error of outputs over their ranges; chooses eps, eta and the end."
)
@click.option("--iterations", type=click.IntRange(1), metavar="N", help="Largest number of full runs, instead of the scene's.")
@click.option(
    "--holdout", type=click.IntRange(0), metavar="N", help="Number of hold-out points, instead of the scene's; 0 for none."
)
@click.option("--compare", is_flag=True, help="Also train the comparators, and check all of them at the hold-out points.")
@click.option("--resume", is_flag=True, help="Insist that the folder holds an interrupted training to go on with.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of the analysis.")
@click.option("--plots/--no-plots", default=True, help="Draw the figures (default: yes).")
def command(path: Path, **options: Any) -> studies.TrainingResult:
    """Train a reduced model over the ranges of SCENE's parameters, as its sections `training` and `reduction` say.

    Writes model.h5 (run it with fmbs rom run), report.json and figures into --out, or into ./fmbs-NAME-train where NAME.yaml is the
    scene, and every run and iteration into the folder `training` there: the same call again goes on where it was interrupted, and
    computes nothing twice.
    """
    return studies.train(path, **options)
