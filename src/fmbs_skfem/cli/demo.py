"""`fmbs demo`: the flexible double pendulum in full and with all reduced models: tables, plots, pictures, a VTK series."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import studies
from . import common

FOLDER = Path("fmbs-demo")


@common.command("demo", scene=False)
def command(out: Path | None, force: bool, **options: Any) -> studies.ComparisonResult:
    """Compute a flexible double pendulum in full and with all reduced models.

    Shows time beside error, and writes report, plots, pictures, an animation and a VTK series into ./fmbs-demo (or --out). Files of
    an earlier demo in ./fmbs-demo are replaced.
    """
    return studies.demo(out=out or FOLDER, force=force or out is None, **options)
