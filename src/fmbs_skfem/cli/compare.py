"""`fmbs compare`: full, reduced, coarser and larger-step models of one scene, the error beside the time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("compare", into="fmbs-{}-compare")
@click.option("--quick", is_flag=True, help="Only the main models, coarser meshes and larger steps; every model runs once.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of the analysis.")
@click.option(
    "--picture/--no-picture", default=True, help="Draw the bodies, moving, and the error of a reduced model (default: yes)."
)
def command(path: Path, **options: Any) -> studies.ComparisonResult:
    """Compare reduced models of SCENE with its full model and with cheaper full models.

    Writes compare.json and figures into --out, or into ./fmbs-NAME-compare where NAME.yaml is the scene.
    """
    return studies.compare(path, **options)
