"""Imports that cost a process less time: that of a command, and that which draws pictures."""

from __future__ import annotations

import atexit
import gc
import importlib
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

UNUSED = (
    "f2py",
    "testing",
)  #: parts of numpy that scipy would load by listing names of numpy, which loads them: a tenth of all imports
#: module -> its class and method that write: of matplotlib's hundred artists, a sixth of a plot; of scipy's functions for stacks of
#: matrices, which are then documented as by `python -OO`, a third of the import of scipy.linalg
WRITERS: dict[str, tuple[str, str, Any]] = {
    "matplotlib.artist": ("Artist", "_update_set_signature_and_docstring", classmethod(lambda kind: None)),
    "scipy._lib._docscrape": ("NumpyDocString", "_parse", lambda self: None),
}
YOUNG = 20_000  #: new objects between two searches for garbage; imports make a million that stay


class Undocumented:
    """Finds modules that write documentation while they are imported, which nobody reads here, and keeps them from it."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname in WRITERS else None
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def undocumented(module: ModuleType) -> None:
                execute(module)
                kind, method, nothing = WRITERS[fullname]
                if hasattr(getattr(module, kind, None), method):
                    setattr(getattr(module, kind), method, nothing)

            spec.loader.exec_module = undocumented  # type: ignore[method-assign]
        return spec


def prepare() -> None:
    """Search for garbage less often, not at the end; import scipy without UNUSED parts of numpy, which others find as ever."""
    gc.set_threshold(YOUNG)
    atexit.register(gc.freeze)  # Python would search all that was imported before it ends: a tenth of a short command
    sys.meta_path.insert(0, Undocumented())
    numpy = importlib.import_module("numpy")
    hidden = [name for name in UNUSED if name not in vars(numpy)]
    for name in hidden:
        setattr(numpy, name, None)
    importlib.import_module("scipy.sparse")
    for name in hidden:
        if getattr(numpy, name) is None:
            delattr(numpy, name)


def without_pyplot() -> None:
    """A stand-in for matplotlib.pyplot, which pyvista imports to draw: half of its time, for the colours of curves alone."""
    if "matplotlib.pyplot" not in sys.modules:
        pyplot: Any = ModuleType("matplotlib.pyplot")
        pyplot.rcParams = importlib.import_module("matplotlib").rcParams
        sys.modules["matplotlib.pyplot"] = pyplot
