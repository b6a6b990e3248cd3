"""What was read of files, remembered within a process while they stay as they are.

    once(path, ("line", unit), read)         what `read` gives of a file, or gave before

A file is known by its name, its number on the disk, its size and the times of its last changes.
File systems count these times in steps: a file that was changed just now may be changed again
within the same one, and is not remembered yet. Notices that reading shows are shown again.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar

from .notices import Notice, recorded, show

Found = TypeVar("Found")
# FAT counts times in 2 s, others in 10 ms or less: half of it would miss a change there, twice
# reads young files a little longer
SETTLED = 2.0  #: age of the last change from which a file is remembered [s]
MOST = 32  #: files, each as one reader has it, that are remembered

KNOWN: OrderedDict[Hashable, tuple[Any, tuple[Notice, ...]]] = OrderedDict()
LOCK = Lock()


def once(path: Path, kind: Hashable, read: Callable[[], Found]) -> Found:
    """What `read` makes of a file, the first time; `kind` says which reader it is, with all its
    options.

    What is found belongs to all who ask: who hands it out copies what others could write to. Errors
    are not remembered, nor is a file that is not there, of which `read` says so.
    """
    try:
        state = path.stat()
    except (OSError, ValueError):
        return read()
    key = (
        kind,
        str(path),
        state.st_dev,
        state.st_ino,
        state.st_size,
        state.st_mtime_ns,
        state.st_ctime_ns,
    )
    with LOCK:
        known = KNOWN.get(key)
        if known is not None:
            KNOWN.move_to_end(key)
    if known is not None:
        for notice in known[1]:
            show(notice)
        found: Found = known[0]
        return found
    with recorded() as notices:
        found = read()
    if time.time() - max(state.st_mtime, state.st_ctime) > SETTLED:
        with LOCK:
            KNOWN[key] = found, tuple(notices)
            while len(KNOWN) > MOST:
                KNOWN.popitem(last=False)
    return found
