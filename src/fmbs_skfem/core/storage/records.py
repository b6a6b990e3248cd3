"""Dataclasses whose methods are written when they are first asked for.

    from ..core.records import dataclass            in place of that of `dataclasses`, with its options

Python writes and compiles up to six methods for each dataclass, in a millisecond; a command uses
few of the hundreds that it has. Until one of its generated attributes is read, by a call, by
`fields`, by a class that inherits, a class holds `Pending` ones. Its text, comparison and hash wait
until they are asked for themselves (`LATER`), and compile nothing: of the 95 classes of a check few
have any, which saves 0.02 s.
"""

from __future__ import annotations

import copy
import dataclasses
import reprlib
import threading
from collections.abc import Callable
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass

ALWAYS = ("__dataclass_fields__", "__dataclass_params__", "__match_args__")
#: what an option of `dataclasses.dataclass` makes
METHODS = {
    "init": ("__init__",),
    "frozen": ("__setattr__", "__delattr__"),
}
WRITTEN_OVER = ("__dataclass_fields__", "__dataclass_params__", "__init__")
DEFAULTS = {"init": True, "repr": True, "eq": True, "frozen": False}
KNOWN = {*DEFAULTS, "kw_only"}
LOCK = threading.RLock()


class Pending:
    """Stands for an attribute of a class that is no dataclass yet; who reads it makes the class
    one.
    """

    def __init__(self, kind: type, name: str, make: Callable[[], None]) -> None:
        self.kind, self.name, self.make = kind, name, make

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        with LOCK:
            if vars(self.kind).get(self.name) is self:
                self.make()
        found = vars(self.kind)[self.name]
        return found.__get__(instance, owner) if hasattr(found, "__get__") else found


def text_of(kind: type) -> Callable[..., Any]:
    """`__repr__` of a dataclass."""
    names = [one.name for one in dataclasses.fields(kind) if one.repr]

    @reprlib.recursive_repr()
    def __repr__(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def equality_of(kind: type) -> Callable[..., Any]:
    """`__eq__` of a dataclass."""
    values = values_of([one.name for one in dataclasses.fields(kind) if one.compare])

    def __eq__(self: Any, other: object) -> bool:
        return bool(values(self) == values(other)) if type(other) is type(self) else NotImplemented

    return __eq__


def hash_of(kind: type) -> Callable[..., Any]:
    """`__hash__` of a frozen dataclass."""
    values = values_of(
        [
            one.name
            for one in dataclasses.fields(kind)
            if (one.compare if one.hash is None else one.hash)
        ]
    )

    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__


def initialiser_of(kind: type, frozen: bool) -> Callable[..., None]:
    """`__init__` of a dataclass that has none: that of one with the same fields."""
    own = [(one.name, one.type, copy.copy(one)) for one in dataclasses.fields(kind)]
    then = getattr(kind, "__post_init__", None)
    known = {"__doc__": kind.__doc__} | ({} if then is None else {"__post_init__": then})
    alike: Any = dataclasses.make_dataclass(
        kind.__name__,
        own,
        namespace=known,
        repr=False,
        eq=False,
        frozen=frozen,
    )
    found: Callable[..., None] = alike.__init__
    found.__qualname__ = f"{kind.__qualname__}.__init__"
    return found


def values_of(names: list[str]) -> Callable[[Any], Any]:
    """A function that gives the values of fields as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


LATER = {"__repr__": text_of, "__eq__": equality_of, "__hash__": hash_of}


def write(kind: type, name: str) -> None:
    """Give a class the method that `LATER` makes."""
    setattr(kind, name, LATER[name](kind))


def generated(kind: type, chosen: dict[str, bool]) -> list[str]:
    """Names of the attributes that `dataclasses.dataclass` adds to a class, but for those of
    `LATER`.
    """
    names = [name for option, made in METHODS.items() if chosen[option] for name in made]
    return [name for name in (*ALWAYS, *names) if name not in vars(kind)]


def written_later(kind: type, chosen: dict[str, bool]) -> list[str]:
    """Names of `LATER` that a class gets, after the rules of `dataclasses`; one that compares and
    is not frozen has no hash.
    """
    own = vars(kind)
    names = ["__repr__"] if chosen["repr"] and "__repr__" not in own else []
    if not chosen["eq"]:
        return names
    if "__eq__" not in own:
        names.append("__eq__")
    # Python gives a class that says how it compares a hash of None, which is none of its own
    if "__hash__" not in own or (own["__hash__"] is None and "__eq__" in own):
        if chosen["frozen"]:
            names.append("__hash__")
        else:
            setattr(kind, "__hash__", None)  # noqa: B010
    return names


def complete(
    kind: type,
    options: dict[str, bool],
    declared: dict[str, dataclasses.Field[Any]],
    names: list[str],
) -> None:
    """Make a class a dataclass, with its `declared` fields; `names` are those of the attributes
    that wait for it.
    """
    chosen = DEFAULTS | options
    # of other threads, who makes an item meanwhile waits at `__init__`, which stays until the new
    # one is there: it takes half as long again
    alone = threading.active_count() == 1
    for name in names:
        if alone or name not in WRITTEN_OVER:
            delattr(kind, name)
    for name, value in declared.items():
        setattr(kind, name, value)
    own = {} if alone else {"init": False}
    if not alone:
        kind.__doc__ = kind.__doc__ or kind.__name__  # else it would be made of `__init__`
    made: Any = dataclasses.dataclass(**{**options, **own, "repr": False, "eq": False})(kind)
    for name in ("init", "repr", "eq"):
        setattr(made.__dataclass_params__, name, chosen[name])
    if chosen["init"] and not alone:
        setattr(kind, "__init__", initialiser_of(made, chosen["frozen"]))  # noqa: B010


def defer(kind: type, options: dict[str, bool]) -> type:
    """`kind`, which becomes a dataclass when one asks."""
    declared = {
        name: value for name, value in vars(kind).items() if isinstance(value, dataclasses.Field)
    }
    chosen = DEFAULTS | options
    names = generated(kind, chosen)
    later = written_later(kind, chosen)
    make = partial(complete, kind, options, declared, names)
    for name, value in declared.items():  # as of a dataclass: the default, or nothing
        delattr(kind, name)
        if value.default is not dataclasses.MISSING:
            setattr(kind, name, value.default)
    for name in names:
        setattr(kind, name, Pending(kind, name, make))
    for name in later:
        setattr(kind, name, Pending(kind, name, partial(write, kind, name)))
    return kind


if not TYPE_CHECKING:

    def dataclass(kind: type | None = None, **options: bool) -> Any:
        """As `dataclasses.dataclass`; other options than those here, or an `__init__` that it
        replaces, make a class at once.
        """

        def decorate(kind: type) -> type:
            if options.keys() <= KNOWN and "__init__" not in vars(kind):
                return defer(kind, options)
            return dataclasses.dataclass(**options)(kind)

        return decorate if kind is None else decorate(kind)
