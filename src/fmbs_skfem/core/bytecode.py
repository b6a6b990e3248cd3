"""Bytecode in a folder of our own where Python neither finds it nor may write it.

    <user's cache>/numba/bytecode-<hash of the installed versions>/<path of the source>.cpython-311.pyc

With PYTHONDONTWRITEBYTECODE=1, as in most containers, and where the packages are installed for
reading only, every command compiles the text of a thousand modules: 1 to 2 seconds. The command
`fmbs` then keeps their bytecode beside its compiled kernels, and that of the processes that it
starts. Where bytecode is found or written as usual, and where `-B` or PYTHONPYCACHEPREFIX say what
is wanted, nothing changes; neither does it for programs that import the package.

Python itself decides by time and size of the source whether bytecode is old; versions are in the
folder's name, since files of two versions in images of containers may be alike in both.
`jit.remove_old` removes folders that nobody uses.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from importlib.machinery import PathFinder
from pathlib import Path

from . import caches, installed

#: packages that stand for all: the first is installed like this one, the other two come with Python
#: and with its libraries
WITNESSES = (__name__.partition(".")[0], "logging", "numpy")
ROOM = 256e6  #: free space below which nothing is written: some versions of Python keep half a file where a disk is full [bytes]
FORBIDS = "PYTHONDONTWRITEBYTECODE"
PREFIX = "PYTHONPYCACHEPREFIX"


def keep() -> None:
    """Let Python keep bytecode in a folder of our own from now on, here and in child processes, if
    it would not otherwise.
    """
    asked = sys.dont_write_bytecode and not os.environ.get(FORBIDS)
    if asked or sys.pycache_prefix is not None or has_bytecode(WITNESSES):
        return
    folder = prepare()
    if folder is not None:
        sys.pycache_prefix = os.environ[PREFIX] = folder
        sys.dont_write_bytecode = False
        os.environ.pop(FORBIDS, None)


def has_bytecode(packages: Iterable[str]) -> bool:
    """Whether bytecode of all packages is there, or will be once they are imported."""
    for package in packages:
        spec = PathFinder.find_spec(package)
        if spec is not None and spec.cached is not None and not os.path.exists(spec.cached):
            folder = os.path.dirname(spec.cached)
            if not os.path.isdir(folder):
                folder = os.path.dirname(folder)
            if sys.dont_write_bytecode or not os.access(folder, os.W_OK):
                return False
    return True


def prepare() -> str | None:
    """The folder, made and marked as used now; None where it cannot be written, and on a disk that
    is almost full.
    """
    import hashlib

    versions = sorted(installed.found(tuple(sys.path)).items())
    stamp = hashlib.sha256(repr(versions).encode()).hexdigest()[:16]
    try:
        folder = caches.parent() / f"bytecode-{stamp}"
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        usable = os.access(folder, os.W_OK) and room(folder) > ROOM
    except OSError:
        return None
    return str(folder) if usable else None


def room(folder: Path) -> float:
    """Free space on the disk of a folder [bytes]; `shutil`, which other systems need, loads what
    would have no bytecode yet.
    """
    if sys.platform != "win32":
        disk = os.statvfs(folder)
        return disk.f_bavail * disk.f_frsize
    import shutil

    return shutil.disk_usage(folder).free
