"""Words that Python files of one's own share with the package: in the scenes that list such a file
its own goes first.

A scene says `type: latch`, a class of its author's file; a later release has a latch as well. The
class of the file is known as `latch_of_my_joints` beside the package's, and a scene that lists
my_joints.py is read as if that was written. All other scenes get the package's.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import TypeVar

PREFIX = "fmbs_extension_"  #: of names of modules of such files; the path of the file follows as hexadecimal digits
SHARED: dict[str, set[str]] = {}  #: words that the package has as well, by module
EVERYWHERE: set[str] = set()  #: modules that every scene is read as if it listed

T = TypeVar("T")


def file_of(module: str) -> str:
    """The path in the name of a module."""
    return bytes.fromhex(module.removeprefix(PREFIX)).decode()


def own(module: str, word: str) -> str:
    """The word of a module's own beside the same word of the package."""
    return re.sub(r"\W", "_", f"{word}_of_{Path(file_of(module)).stem}")


def free(known: dict[str, T], word: str, module: str, module_of: Callable[[T], str]) -> str:
    """The word under which a module can enter what has this one among what is known: another one
    where the package has it.

    `module_of` gives the module of what is known; that of the package is there before any file is
    run.
    """
    if (
        not module.startswith(PREFIX)
        or word not in known
        or module_of(known[word]).startswith(PREFIX)
    ):
        return word
    SHARED.setdefault(module, set()).add(word)
    return own(module, word)


def meant(word: str, known: Collection[str], modules: Iterable[str]) -> str:
    """The word that a scene which lists these modules means: their own, where they have it as well
    as the package.
    """
    return next(
        (
            other
            for one in modules
            if word in SHARED.get(one, ()) and (other := own(one, word)) in known
        ),
        word,
    )
