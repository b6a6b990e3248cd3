"""Files that are complete under their name or not there at all, and that are on the disk before
they have it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError, NoRoom, say

#: errors of a full disk, and of a limit of file sizes
FULL = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
)
AGAIN = "make room, then call the same again"


@contextlib.contextmanager
def place(path: Path) -> Iterator[Path]:
    """Another name to write a file under; what was written is flushed to the disk, renamed to
    `path`, and its folder flushed.

    An error on the way leaves the place as it was.
    """
    if not path.name:
        raise InputError(say("path", "the name of a file", f"'{path}'"))
    part = path.with_name(path.name + ".part")
    try:
        yield part
        flush(part)
        part.replace(path)
        flush(path.parent)
    finally:
        part.unlink(missing_ok=True)


@contextlib.contextmanager
def room(path: Path, remedy: str = AGAIN) -> Iterator[None]:
    """A full disk as an error that says so; other errors of the file system pass."""
    try:
        yield
    except OSError as problem:
        if problem.errno not in FULL or isinstance(problem, NoRoom):
            raise
        got = os.strerror(problem.errno or 0).lower()
        raise NoRoom(say(f"{path}", "room on the disk", got, remedy)) from problem


@contextlib.contextmanager
def writing(path: Path, remedy: str = AGAIN) -> Iterator[None]:
    """What keeps a file or folder from being written as an error that says so: NoRoom on a full
    disk, otherwise InputError.
    """
    try:
        with room(path, remedy):
            yield
    except NoRoom:
        raise
    except OSError as problem:
        raise InputError(say(str(path), "a place that can be written", problem)) from problem


def write(path: str | Path, data: bytes | memoryview, remedy: str = AGAIN) -> Path:
    """A file of these bytes, complete under its name or not there; NoRoom and InputError as of
    `writing`.
    """
    target = Path(path)
    with writing(target, remedy), place(target) as part:
        part.write_bytes(data)
    return target


def flush(path: Path) -> None:
    """A file, or the names in a folder, reach the disk; Windows takes care of folders by itself."""
    if os.name == "nt" and path.is_dir():
        return
    handle = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sha256(path: Path) -> str:
    """Checksum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
