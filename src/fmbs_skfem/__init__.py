"""Flexible multibody systems with large deformation, and their model reduction.

The floors in the order of the data flow: `shapes`, `bodies`, `systems`, `dynamics`, `reduction`,
and on top of them `scenes`, `results`, `studies` and the command `fmbs`. Floors are loaded when
they are first used, because compiled kernels take a second to import.
"""

import os
import sys

# `python -m` begins its path with the current folder, where files have names of modules: nothing of
# it is run, as by `fmbs`. That of a script is kept. Python itself has looked for `importlib` and
# what that needs there by now, and for this package.
if (
    sys.argv[:1] == ["-m"]
    and not sys.flags.safe_path
    and os.path.dirname(os.path.dirname(__file__)) != sys.path[0]
):
    del sys.path[0]

import importlib
from types import ModuleType

from . import wings
from .core import imports, listing

__version__ = "0.2.0"
__all__ = ["shapes", "bodies", "systems", "dynamics", "reduction", "scenes", "results", "studies"]

listing.install(__name__)
imports.install()
wings.tell(__name__)


def __getattr__(name: str) -> ModuleType:
    if name in __all__:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
