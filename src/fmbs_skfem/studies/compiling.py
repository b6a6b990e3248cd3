"""The first run compiles: it says so, one process at a time does it, and another one beside it compiles what comes later."""

from __future__ import annotations

import contextlib
import fcntl
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from ..core import jit
from .job import Job


@contextlib.contextmanager
def alone(job: Job) -> Iterator[bool]:
    """Whether what is done inside compiles the time step, which the cache has not: one process at a time.

    First runs that begin together would compile the same in each other's way; those that wait find it in the cache.
    """
    folder = jit.cache_folder()
    if folder is None or not cold(folder):
        yield announce(job)
        return
    with (folder / "compiling").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            job.listener.tell("waiting for another process that compiles (first runs only)")
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(file, fcntl.LOCK_EX)
        yield announce(job)


def announce(job: Job) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said.

    What a run of a scene needs after its time steps is compiled by a process beside it, one for all runs that begin meanwhile.
    """
    folder = jit.cache_folder()
    new = folder is None or cold(folder)
    if new:
        job.listener.tell("compiling (first run only)")
    if new and folder is not None and job.path.suffix in (".yaml", ".yml") and first(folder):
        command = [sys.executable, "-m", f"{__package__}.warm", str(job.path)]
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return new


def cold(folder: Path) -> bool:
    """Whether no compiled step is cached in a folder."""
    return not any(folder.rglob("stepping.advance-*.nbc"))


def first(folder: Path) -> bool:
    """Whether no other process has begun to compile into the folder."""
    try:
        (folder / "begun").touch(exist_ok=False)
    except OSError:
        return False
    return True
