"""Imports that cost a process less time: that of a command, and that which draws pictures.

SciPy's array_api_compat copies all names of NumPy, which loads parts that NumPy itself loads when
they are first used: `f2py` and `testing` alone take an eighth of `fmbs check`. Here the copy gets
stand-ins, which load them when something is taken from them (`copy_later`); NumPy has its own again
behind it.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

#: new objects between two searches for garbage: imports make some that stay (a check: 110 000; five
#: searches took 22 ms)
YOUNG = 150_000
COPY = ".array_api_compat.numpy"  #: how names of modules end that copy all names of NumPy


def prepare() -> None:
    """Search for garbage less often, and not at the end, when Python would go through all that was
    imported before it stops.
    """
    gc.set_threshold(YOUNG)
    atexit.register(gc.freeze)


class InterceptingFinder:
    """Finds modules as Python does, and lets `run` run those whose names it wants, given how Python
    does.
    """

    def __init__(
        self,
        wants: Callable[[str], bool],
        run: Callable[[Callable[[ModuleType], None], ModuleType], None],
    ) -> None:
        self.wants, self.run = wants, run

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not self.wants(fullname):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module
            spec.loader.exec_module = lambda module: self.run(execute, module)  # type: ignore[method-assign]
        return spec


class Later(ModuleType):
    """Stands in a copy for a part of NumPy that nobody has used."""

    def __getattr__(self, name: str) -> Any:
        return getattr(importlib.import_module(self.__name__), name)


def install() -> None:
    """Let copies of NumPy that are imported from now on load its parts when they are used."""
    sys.meta_path.insert(0, InterceptingFinder(lambda name: name.endswith(COPY), copy_later))


def copy_later(execute: Callable[[ModuleType], None], module: ModuleType) -> None:
    """Run a module that copies all names of NumPy."""
    import numpy

    names = vars(numpy)
    given = {name: Later(f"numpy.{name}") for name in numpy.__all__ if name not in names}
    names.update(given)
    try:
        execute(module)
    finally:
        for name, part in given.items():
            if names[name] is part:  # what the copy has imported itself stays
                del names[name]
