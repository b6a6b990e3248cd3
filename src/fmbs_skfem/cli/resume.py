"""`fmbs resume`: go on with a run that was stopped or killed, bit for bit as if it had not been."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .. import studies
from . import common


@common.command("resume", scene=False)
@click.argument("path", metavar="DIR", type=common.PATH)
@common.PLOTS
@common.TIME_LIMIT
def command(path: Path, **options: Any) -> studies.Run:
    """Go on with the run whose output folder is DIR, from its last checkpoint to the end.

    The numbers are those of a run that was never stopped. Every byte that is read is verified, and a scene or mesh that has changed
    since then is refused (exit code 8).
    """
    return studies.resume(path, **options)
