"""Arguments of public functions are what their annotations declare: the door at which others are
bad input.

    @checked
    def integrate(system: System, scheme: GeneralizedAlpha, duration: float, ...) -> Trajectory: ...

    integrate("a.yaml", ...)        InputError: integrate: system: expected a System, got 'a.yaml'

Without it a wrong argument is an AttributeError or a TypeError of whatever uses it first, or
nothing at all. What a declaration does not say (signs, shapes, names) is checked by whoever knows
it, but for bounds of quantities, as in scenes (`fields.quantity`). Numbers are finite, and may be
those of NumPy; a sequence is all that can be gone through but a text, an array what NumPy makes
finite numbers of. A class that only type checkers import is known by its name. What an iterator
gives is not looked at.
"""

from __future__ import annotations

import functools
import inspect
import itertools
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    NamedTuple,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, say
from .problems import shown

T = TypeVar("T", bound=Callable[..., Any])
#: says what was expected of a value, and nothing of one that is right
Rule: TypeAlias = Callable[[Any], str]
LIKE_ARRAYS = set(get_args(ArrayLike))


class ClassName(NamedTuple):
    """A class that only a type checker imports."""

    name: str


def checked(one: T) -> T:
    """A function that takes only what its annotations declare, or a dataclass that holds only that.

    InputError names the argument or field that is something else. Of a dataclass it stands below
    `@dataclass`.
    """
    return cast(T, checked_dataclass(one) if isinstance(one, type) else checked_function(one))


def checked_function(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function whose arguments are checked before it is called."""

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        placed, rest = taken(function, given, named)
        return function(*placed, **rest)

    return call


def blamed(function: T) -> T:
    """A function with better words of its own: its arguments are checked once it cannot stand them."""

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        with blaming(lambda: taken(function, given, named)):
            return function(*given, **named)

    return cast(T, call)


@contextmanager
def blaming(check: Callable[[], object]) -> Iterator[None]:
    """What may not stand values that are not what they are declared to be: its error is then that
    of a check, which says so.
    """
    try:
        yield
    except InputError:
        raise
    except (AttributeError, TypeError, ValueError):
        check()
        raise


def taken(
    function: Callable[..., Any], given: tuple[Any, ...], named: dict[str, Any]
) -> tuple[list[Any], dict[str, Any]]:
    """Arguments of a function by their place and by name, as it takes them; InputError for one that
    is not what it is declared to be.
    """
    title = function.__qualname__.rpartition("<locals>.")[2].removesuffix(".__init__")

    def take(name: str, value: Any) -> Any:
        rule, default, array = parameters_of(function).get(name, (None, value, False))
        if is_default(value, default) or rule is None:
            return value
        if wanted := rule(value):
            raise InputError(say(f"{title}: {name}", wanted, shown(value)))
        return np.asarray(value) if array and isinstance(value, list | tuple) else value

    names = [*parameters_of(function), *len(given) * [""]]
    placed = [take(name, value) for name, value in zip(names, given, strict=False)]
    return placed, {name: take(name, value) for name, value in named.items()}


def checked_dataclass(kind: type) -> type:
    """A dataclass, before it is one, whose fields are checked when an item is made.

    Its own `__post_init__`, whose words are better, goes first.
    """
    then = getattr(kind, "__post_init__", None)

    def __post_init__(self: Any) -> None:
        if then is not None:
            with blaming(lambda: check_fields(self)):
                then(self)
        check_fields(self)

    setattr(kind, "__post_init__", __post_init__)  # noqa: B010
    return kind


def check_fields(item: Any, where: str = "") -> None:
    """InputError for a field of a dataclass that is not what it is declared to be; `where` names
    the item, its class by default.
    """
    for name, rule, default in fields_of(cast(Any, type(item))):
        value = getattr(item, name)
        if not is_default(value, default) and (wanted := rule(value)):
            raise InputError(say(f"{where or type(item).__name__}.{name}", wanted, shown(value)))


@functools.cache
def parameters_of(function: Callable[..., Any]) -> dict[str, tuple[Rule, Any, bool]]:
    """Rule and default of the parameters of a function, and whether it wants an array, by name, in
    their order.
    """
    known = hints_of(function)
    single = [
        one
        for one in inspect.signature(function).parameters.values()
        if one.kind != one.VAR_POSITIONAL
    ]
    kinds = {one.name: (known.get(one.name, Any), one.default) for one in single}
    return {
        name: (rule_of(kind), default, np.ndarray in (kind, *get_args(kind)))
        for name, (kind, default) in kinds.items()
    }


@functools.cache
def fields_of(kind: type) -> tuple[tuple[str, Rule, Any], ...]:
    """Names, rules and defaults of the fields of a dataclass, also of those that it inherits."""
    known = {name: hint for base in reversed(kind.__mro__) for name, hint in hints_of(base).items()}
    names = [one.name for one in fields(cast(Any, kind)) if one.name in known]
    return tuple(
        (name, rule_of(known[name]), getattr(kind, name, inspect.Parameter.empty)) for name in names
    )


def hints_of(owner: Any) -> dict[str, Any]:
    """What annotations stand for: of a class that only a type checker imports its name, Any of
    what else only that knows.
    """
    found: dict[str, Any] = {}
    for name, hint in inspect.get_annotations(owner).items():
        alone = type("Alone", (), {"__annotations__": {name: hint}})
        try:
            known = vars(sys.modules[owner.__module__])
            found[name] = get_type_hints(alone, known, include_extras=True)[name]
        except (NameError, TypeError):
            named = isinstance(hint, str) and hint.isidentifier()
            found[name] = ClassName(hint) if named else Any
    return found


# ------------------------------------------------------------------------------------------------------------------------ kinds
def is_default(value: object, default: object) -> bool:
    """Whether a value is the default, which says itself what else may be there: infinity, or None."""
    return value is default or (
        type(value) is float and type(default) is float and value == default
    )


def is_number(value: object) -> bool:
    """Whether a value is a finite real number, perhaps as an array without axes."""
    if type(value) is float:
        return -np.inf < value < np.inf
    single: Any = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(single, bool) or not isinstance(single, Real):
        return False
    number: Any = single
    return bool(abs(number) < np.inf)


def is_whole(value: object) -> bool:
    """Whether a value is a whole number."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def is_text(value: object) -> bool:
    """Whether a value is a text, or a path, that can be the name of a file: without zeros and
    halves of letters.
    """
    try:
        return isinstance(value, str | Path) and b"\0" not in os.fsencode(value)
    except UnicodeEncodeError:
        return False


def is_array(value: object) -> bool:
    """Whether NumPy makes an array of finite real numbers of a value, or such a number."""
    try:
        found = np.asarray(value)
    except (TypeError, ValueError):
        return False
    return found.dtype.kind in "biuf" and bool(np.isfinite(found).all())


def is_many(value: object) -> bool:
    """Whether a value can be gone through: a text and an array without axes are one."""
    single = isinstance(value, str | bytes) or getattr(value, "ndim", 1) == 0
    return isinstance(value, Iterable) and not single


#: kind -> whether a value is of it, and how it is called
RULES: dict[Any, tuple[Callable[[Any], bool], str]] = {
    float: (is_number, "a finite number"),
    int: (is_whole, "a whole number"),
    bool: (lambda value: isinstance(value, bool | np.bool_), "true or false"),
    str: (lambda value: isinstance(value, str) and is_text(value), "a text"),
    Path: (lambda value: isinstance(value, Path) and is_text(value), "a path"),
    NoneType: (lambda value: value is None, "None"),
    np.ndarray: (
        lambda value: is_array(value) and np.ndim(value) > 0,
        "an array of finite numbers",
    ),
    ArrayLike: (is_array, "finite numbers"),
    Callable: (callable, "a function"),
    Mapping: (lambda value: isinstance(value, Mapping), "a mapping"),
    Iterable: (is_many, "a sequence"),
    Sequence: (lambda value: is_many(value) and not isinstance(value, Mapping), "a sequence"),
}
#: kinds that have the rule of another one
SAME = {
    dict: Mapping,
    Collection: Iterable,
    tuple: Sequence,
    list: Sequence,
}


def require(where: str, value: Any, kind: Any) -> None:
    """InputError where a value is not of a kind, an annotation."""
    if wanted := rule_of(kind)(value):
        raise InputError(say(where, wanted, shown(value)))


@functools.cache
def rule_of(kind: Any) -> Rule:
    """What says of a value what was expected where it is not of a kind, an annotation, and nothing
    where it is.
    """
    if get_origin(kind) is Annotated:
        return rule_of_noted(kind.__origin__, kind.__metadata__)
    if isinstance(kind, ClassName):
        return rule_of_named(kind.name)
    origin = get_origin(kind) or kind
    parts = get_args(kind)
    if origin in (Union, UnionType) and kind != ArrayLike:
        return rule_of_union(parts)
    if origin is Literal:
        return lambda value: (
            "" if isinstance(value, str | int) and value in parts else " or ".join(map(repr, parts))
        )
    rule = ArrayLike if kind == ArrayLike else SAME.get(origin, origin)
    if rule not in RULES and (
        not isinstance(rule, type) or rule is Any or getattr(rule, "_is_protocol", False)
    ):
        return lambda value: ""
    fits, word = RULES.get(
        rule, (lambda one: isinstance(one, rule), called(getattr(rule, "__name__", "")))
    )
    if rule in (Mapping, Iterable, Sequence) and parts:
        return rule_of_many(fits, word, rule, parts)
    return lambda value: "" if fits(value) else word


def rule_of_noted(kind: Any, notes: tuple[Any, ...]) -> Rule:
    """The same of a kind with notes, where those of numbers know bounds (`fields.quantity`)."""
    rule = rule_of(kind)
    bounds = [one.misfit for one in notes if getattr(one, "misfit", None) is not None]
    if not bounds:
        return rule
    return lambda value: rule(value) or next(filter(None, (one(value) for one in bounds)), "")


def rule_of_named(name: str) -> Rule:
    """The same of a class that is not loaded here, whose items are known by its name."""
    return lambda value: (
        "" if name in [one.__name__ for one in type(value).__mro__] else called(name)
    )


def rule_of_many(fits: Callable[[Any], bool], word: str, rule: Any, parts: tuple[Any, ...]) -> Rule:
    """The same of what holds others: of a mapping or sequence that is there as a whole all items
    are looked at.
    """
    rules = [rule_of(part) for part in parts]
    fixed = len(parts) > 1 and parts[-1] is not ...

    def misfit(value: Any) -> str:
        if not fits(value):
            return word
        found: Iterator[str] = iter(())
        if rule is Mapping:
            found = (
                each(one) for item in value.items() for each, one in zip(rules, item, strict=False)
            )
        elif isinstance(value, list | tuple | Mapping | np.ndarray):
            if fixed and rule is Sequence and len(value) != len(parts):
                return f"{len(parts)} values"
            items = value.tolist() if isinstance(value, np.ndarray) else value
            each_of = rules if fixed else itertools.repeat(rules[0])
            found = (each(one) for each, one in zip(each_of, items, strict=False))
        wanted = next(filter(None, found), "")
        return f"{word}, in it {wanted}" if wanted else ""

    return misfit


def rule_of_union(parts: tuple[Any, ...]) -> Rule:
    """The same of several kinds, one of which may be whatever NumPy takes for an array."""
    if set(parts) >= LIKE_ARRAYS:
        parts = (ArrayLike, *(part for part in parts if part not in LIKE_ARRAYS))
    rules = [rule_of(part) for part in parts]

    def misfit(value: Any) -> str:
        wanted = []
        for each in rules:
            if not (text := each(value)):
                return ""
            wanted.append(text)
        return " or ".join(dict.fromkeys(one for one in wanted if one != "None"))

    return misfit


def called(name: str) -> str:
    """A class with its article."""
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"
