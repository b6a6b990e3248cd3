"""Locks of files that end with the process which holds them: `flock`, and on Windows one byte of the file."""

from __future__ import annotations

import errno
import importlib
import os
from typing import IO, Any

BYTE = 2**30  #: which is locked on Windows: beyond all text, so that others can read who holds the lock


def take(file: IO[str], wait: bool = False) -> None:
    """Lock an open file for this process; BlockingIOError where another one has it, unless this one is to `wait`."""
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
