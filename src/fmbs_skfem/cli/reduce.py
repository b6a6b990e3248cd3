"""`fmbs reduce`: train a reduced model of a scene and save it to a file that runs without mesh and full model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


def known(context: click.Context, option: click.Parameter, name: str | None) -> str | None:
    """A name of a hyper-reduction."""
    from ..reduction import hyper_reduction

    if name is not None and name not in hyper_reduction.KNOWN:
        raise click.BadParameter(f"expected one of {', '.join(hyper_reduction.KNOWN)}, got '{name}'", context, option)
    return name


@common.command("reduce", into="{}.h5")
@click.option(
    "--level", type=click.Choice(["component", "system"]), default="component", help="A basis a component, or one for all."
)
@click.option("--tolerance", type=float, metavar="EPS", help="Truncation of the bases, instead of the scene's.")
@click.option("--modes", type=click.IntRange(1), metavar="R", help="Number of modes a component, instead of a tolerance.")
@click.option("--hyper", type=float, metavar="ETA", help="Tolerance of the hyper-reduction, instead of the scene's; 0 for none.")
@click.option(
    "--sample",
    metavar="NAME",
    callback=known,
    help="Hyper-reduction instead of the scene's: elements, points, none, or exact, the polynomial of planar plates.",
)
@click.option("--duration", type=float, metavar="SECONDS", help="Train on a run of this duration.")
def command(path: Path, **options: Any) -> studies.ReductionResult:
    """Train a reduced model of SCENE and save it.

    --out is a file ending in .h5, or a folder for NAME.h5 where NAME.yaml is the scene. The reduced model is run over the training
    time, and its error against the full model is printed and saved with it.
    """
    return studies.reduce(path, **options)
