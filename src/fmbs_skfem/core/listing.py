"""`dir(module)` lists what a module of the package offers, and not what it imports: notebooks complete by it.

A module with `__all__` lists that, any other one what it defines: functions, classes, constants. One finder in front of those of
Python gives every module its `__dir__` when it is imported; a module with one of its own keeps that.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType


class PackageFinder:
    """Finds the modules of one package as Python does."""

    def __init__(self, package: str) -> None:
        self.prefix = f"{package}."

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        if not fullname.startswith(self.prefix):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def listed(module: ModuleType) -> None:
                execute(module)
                module.__dict__.setdefault("__dir__", partial(names, module))

            spec.loader.exec_module = listed  # type: ignore[method-assign]
        return spec


def install(package: str) -> None:
    """Let `dir` of the modules of a package that are imported from now on list public names."""
    sys.meta_path.insert(0, PackageFinder(package))


def names(module: ModuleType) -> list[str]:
    """The public names of a module."""
    listed = module.__dict__.get("__all__")
    if listed is not None:
        return sorted(listed)
    own = {name: value for name, value in vars(module).items() if name[0] != "_" and name != "TYPE_CHECKING"}
    owners = (None, module.__name__)  # plain constants, and what says so itself
    return sorted(k for k, one in own.items() if not isinstance(one, ModuleType) and getattr(one, "__module__", None) in owners)
