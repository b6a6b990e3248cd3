"""Dataclasses whose methods are written when they are first asked for.

    from ..core.records import dataclass            in place of that of `dataclasses`, with its options

Python writes and compiles up to six methods for each dataclass, in a millisecond; a command uses few of the hundreds that it has.
Until one of its generated attributes is read, by a call, by `fields`, by a class that inherits, a class holds `Pending` ones.
"""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass

ALWAYS = ("__dataclass_fields__", "__dataclass_params__", "__match_args__")
METHODS = {  #: what an option of `dataclasses.dataclass` makes
    "init": ("__init__",),
    "repr": ("__repr__",),
    "eq": ("__eq__", "__hash__"),
    "frozen": ("__setattr__", "__delattr__"),
}
DEFAULTS = {"init": True, "repr": True, "eq": True, "frozen": False}
KNOWN = {*DEFAULTS, "kw_only"}
LOCK = threading.RLock()


class Pending:
    """Stands for an attribute of a class that is no dataclass yet; who reads it makes the class one."""

    def __init__(self, kind: type, name: str, make: Callable[[], None]) -> None:
        self.kind, self.name, self.make = kind, name, make

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        with LOCK:
            if vars(self.kind).get(self.name) is self:
                self.make()
        found = vars(self.kind)[self.name]
        return found.__get__(instance, owner) if hasattr(found, "__get__") else found


def generated(kind: type, options: dict[str, bool]) -> list[str]:
    """Names of the attributes that `dataclasses.dataclass` adds to a class."""
    chosen = [name for option, names in METHODS.items() if options.get(option, DEFAULTS[option]) for name in names]
    return [name for name in (*ALWAYS, *chosen) if name not in vars(kind)]


def defer(kind: type, options: dict[str, bool]) -> type:
    """`kind`, which becomes a dataclass when one asks."""
    declared = {name: value for name, value in vars(kind).items() if isinstance(value, dataclasses.Field)}
    names = generated(kind, options)

    def make() -> None:
        for name in names:
            delattr(kind, name)
        for name, value in declared.items():
            setattr(kind, name, value)
        dataclasses.dataclass(**options)(kind)

    for name, value in declared.items():  # as of a dataclass: the default, or nothing
        delattr(kind, name)
        if value.default is not dataclasses.MISSING:
            setattr(kind, name, value.default)
    for name in names:
        setattr(kind, name, Pending(kind, name, make))
    return kind


if not TYPE_CHECKING:

    def dataclass(kind: type | None = None, **options: bool) -> Any:
        """As `dataclasses.dataclass`; other options than those here, or an `__init__` that it replaces, make a class at once."""

        def decorate(kind: type) -> type:
            if options.keys() <= KNOWN and "__init__" not in vars(kind):
                return defer(kind, options)
            return dataclasses.dataclass(**options)(kind)

        return decorate if kind is None else decorate(kind)
