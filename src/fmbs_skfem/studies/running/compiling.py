"""The first run compiles: a process beside it compiles what comes later, as long as the run lives."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from pathlib import Path

from ...core.compiling import jit
from ...core.compiling.machine_code import SUFFIX
from ..job import Job

_BESIDE: list[subprocess.Popen[bytes]] = []  #: processes that end with this one, whose end of their input they see


def announce(job: Job, reduces: bool = False) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said.

    What it needs last, and what reductions need, is compiled by a process beside it, one for all runs that begin meanwhile. Each
    function is compiled by one process (`jit.alone`), the others wait for it.
    """
    folder = jit.cache_folder()
    new = folder is None or cold(folder)
    if new:
        job.hear_compilation("the time step")
    if new and folder is not None and first(folder):
        command = [sys.executable, "-P", "-m", f"{__package__}.beside", *(["reduction"] if reduces else [])]
        nowhere = subprocess.DEVNULL
        _BESIDE.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere))
    return new


def cold(folder: Path) -> bool:
    """Whether no compiled step is cached in a folder."""
    return not any(folder.glob(f"stepping.advance-*{SUFFIX}"))


def first(folder: Path) -> bool:
    """Whether no other process has begun to compile into the folder."""
    with contextlib.suppress(OSError):
        (folder / "begun").touch(exist_ok=False)
        return True
    return False
