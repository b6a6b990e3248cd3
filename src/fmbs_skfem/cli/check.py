"""`fmbs check`: a scene and its meshes, read, assembled and judged before any run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import studies
from . import common


@common.command("check")
@common.DURATION
def command(path: Path, **options: Any) -> studies.Result:
    """Read SCENE and its meshes, assemble it in the form it is solved in, check the initial state, and say what it is.

    Told are: masses, units, slenderness and cells that are hardly meant, joints that are redundant or contradict each other,
    degrees of freedom, bodies that no joint ties to the ground, initial motion that joints forbid, solver, memory and time. Notices
    stop nothing unless --strict is given. Nothing is solved; --out writes check.json. SCENE may also be a folder with results:
    every file in it that a report or a history vouches for is held against its checksum (exit code 8).
    """
    if path.is_dir():
        return studies.checksums(path, listener=options["listener"])
    return studies.check(path, **options)
