"""Locks of files that end with the process which holds them: `flock`, and on Windows one byte of
the file.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from ..errors import InputError, say
from . import durable, endings

LOCK = "run.lock"
#: which is locked on Windows: beyond all text, so that others can read who holds the lock
BYTE = 2**30


def take(file: IO[str], wait: bool = False) -> None:
    """Lock an open file for this process; BlockingIOError where another one has it, unless this one
    is to `wait`.
    """
    if os.name == "nt":
        take_byte(file, wait)
        return
    fcntl: Any = importlib.import_module("fcntl")
    fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def take_byte(file: IO[str], wait: bool) -> None:
    """The lock of Windows, which gives up by itself after some seconds."""
    windows: Any = importlib.import_module("msvcrt")
    before = file.tell()
    try:
        while True:
            file.seek(BYTE)
            try:
                windows.locking(file.fileno(), windows.LK_LOCK if wait else windows.LK_NBLCK, 1)
                return
            except OSError as problem:
                if problem.errno not in (errno.EACCES, errno.EDEADLK):
                    raise
                if not wait:
                    raise BlockingIOError(errno.EAGAIN, "another process has the lock") from problem
    finally:
        file.seek(before)


@contextlib.contextmanager
def own(folder: Path) -> Iterator[None]:
    """The folder belongs to this process; a lock left by one that is gone is taken over.

    The lock is that of the system on `run.lock`, which ends with the process; the file says who
    holds it, and goes with it, also where a signal ends the process that can be taken.
    """
    with endings.raised(), held(folder / LOCK):
        yield


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """The lock of a file."""
    with durable.room(path):
        file = grab(path)
    try:
        file.truncate(0)
        with durable.room(path):
            file.write(f"process {os.getpid()}\n")
            file.flush()
        yield
    finally:
        with contextlib.suppress(
            PermissionError
        ):  # Windows keeps the name of an open file, which is left empty
            file.truncate(0)
            path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            file.close()


def grab(path: Path) -> IO[str]:
    """The lock file, opened and locked; InputError where another process has it."""
    while True:
        file = path.open("a+", encoding="utf-8")
        try:
            take(file)
        except BlockingIOError as problem:
            file.seek(0)
            holder = file.read().strip() or "another process"
            file.close()
            remedy = "wait for it, or choose another folder"
            raise InputError(
                say(f"{path.parent}", "a folder no other run writes into", holder, remedy)
            ) from problem
        file.seek(0)
        with contextlib.suppress(FileNotFoundError):
            if os.fstat(file.fileno()).st_ino == path.stat().st_ino:
                return file
        file.close()  # its holder removed it between opening and locking
