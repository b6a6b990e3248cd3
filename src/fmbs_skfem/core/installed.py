"""Versions of installed packages, as the names of their folders of metadata say.

    numpy-2.4.6.dist-info          numpy 2.4.6

`importlib.metadata` reads a page of text as an e-mail for each of them: a tenth of a short command.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from functools import cache

SUFFIX = ".dist-info"


def version(name: str) -> str:
    """The version of a package, by the name under which it is installed; empty where it is not
    there.
    """
    return found(tuple(sys.path)).get(normalise(name), "")


@cache
def found(path: tuple[str, ...]) -> dict[str, str]:
    """Normalised name -> version of all packages in folders, of which the first counts."""
    known: dict[str, str] = {}
    for folder in path:
        with contextlib.suppress(OSError):  # zip files, folders that are gone
            for entry in os.listdir(folder or "."):
                name, _, number = entry.removesuffix(SUFFIX).rpartition("-")
                if entry.endswith(SUFFIX) and name:
                    known.setdefault(normalise(name), number)
    return known


def normalise(name: str) -> str:
    """Names that differ in case, dots, dashes and underscores alone are one."""
    return re.sub(r"[-_.]+", "-", name).lower()
