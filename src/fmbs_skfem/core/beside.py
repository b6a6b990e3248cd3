"""Packages beside the engine, which register with it and which it never names, and other names of
modules.

The root of the package tells which there are (`tell`). They are loaded with the engine (`load`), so
that files and systems with what is theirs are understood; what users look for in a package of the
engine is found there (`names_of`), and so is a module under the name by which scripts and
extensions know it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

_PACKAGES: list[str] = []
_NAMES: dict[str, str] = {}


def tell(packages: Iterable[str], names: Mapping[str, str]) -> None:
    """Packages to load, and names of the package by where they are: a module, or
    `module:attribute`.
    """
    _PACKAGES.extend(packages)
    _NAMES.update(names)
    sys.meta_path.append(Finder())


def load() -> None:
    """Load all that stands beside the engine."""
    for package in _PACKAGES:
        import_module(package)


def names_of(package: str, later: Mapping[str, str] | None = None) -> Callable[[str], Any]:
    """`__getattr__` of a package of the engine; `later`: its modules -> names that are taken from
    them when they are first used.

    Such a name is that of something in the module, or, of a folder, of one of its modules.
    """
    own = {name: module for module, names in (later or {}).items() for name in names.split()}

    def look_up(name: str) -> Any:
        if name in own:
            owner = f"{package}.{own[name]}".rstrip(".")
            found = vars(import_module(owner)).get(name)
            return import_module(f"{owner}.{name}") if found is None else found
        if (place := _NAMES.get(f"{package}.{name}")) is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, _, attribute = place.partition(":")
        found = import_module(module)
        return getattr(found, attribute) if attribute else found

    return look_up


class Finder:
    """Finds a module under its other name, once Python has found none."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        place = _NAMES.get(fullname)
        if place is None or ":" in place:
            return None
        return ModuleSpec(fullname, OtherName(place))  # type: ignore[arg-type]  # has what is called of a loader


class OtherName:
    """Loads the module itself, which keeps its own name.

    It is no `importlib.abc.Loader`, which loads a dozen modules that `fmbs --help` has no use for.
    """

    def __init__(self, place: str) -> None:
        self.module = import_module(place)
        self.spec = self.module.__spec__

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return self.module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self.spec
