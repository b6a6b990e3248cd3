"""`dir(module)` lists what a module of the package offers, and not what it imports: notebooks
complete by it.

A module with `__all__` lists that, any other one what it defines: functions, classes, constants.
One finder in front of those of Python gives every module its `__dir__` when it is imported; a
module with one of its own keeps that.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from types import ModuleType

from . import imports


def install(package: str) -> None:
    """Let `dir` of the modules of a package that are imported from now on list public names."""
    sys.meta_path.insert(
        0, imports.InterceptingFinder(lambda name: name.startswith(f"{package}."), listed)
    )


def listed(execute: Callable[[ModuleType], None], module: ModuleType) -> None:
    """Run a module, and give it its `__dir__`."""
    execute(module)
    module.__dict__.setdefault("__dir__", partial(names, module))


def names(module: ModuleType) -> list[str]:
    """The public names of a module."""
    listed = module.__dict__.get("__all__")
    if listed is not None:
        return sorted(listed)
    own = {
        name: value
        for name, value in vars(module).items()
        if name[0] != "_" and name != "TYPE_CHECKING"
    }
    owners = (None, module.__name__)  # plain constants, and what says so itself
    return sorted(
        k
        for k, one in own.items()
        if not isinstance(one, ModuleType) and getattr(one, "__module__", None) in owners
    )
