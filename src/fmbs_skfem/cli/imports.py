"""Imports that cost a command less time."""

from __future__ import annotations

import gc
import importlib
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

UNUSED = (
    "f2py",
    "testing",
)  #: parts of numpy that scipy would load by listing names of numpy, which loads them: a tenth of all imports
YOUNG = 20_000  #: new objects between two searches for garbage; imports make a million that stay


class Undocumented:
    """Finds matplotlib's base class, and lets it write no documentation for its hundred others: a sixth of a plot, read by none."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname == "matplotlib.artist" else None
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def undocumented(module: ModuleType) -> None:
                execute(module)
                if hasattr(module.Artist, "_update_set_signature_and_docstring"):
                    module.Artist._update_set_signature_and_docstring = classmethod(lambda kind: None)

            spec.loader.exec_module = undocumented  # type: ignore[method-assign]
        return spec


def prepare() -> None:
    """Search for garbage less often, and import scipy without UNUSED parts of numpy, which stay as they are for all others."""
    gc.set_threshold(YOUNG)
    sys.meta_path.insert(0, Undocumented())
    numpy = importlib.import_module("numpy")
    hidden = [name for name in UNUSED if name not in vars(numpy)]
    for name in hidden:
        setattr(numpy, name, None)
    importlib.import_module("scipy.sparse")
    for name in hidden:
        if getattr(numpy, name) is None:
            delattr(numpy, name)
