"""Whether what comes from a file is what it is declared to be: types of fields, shapes, finite numbers, indices that stay inside.

Compiled code follows indices without looking, so that one of them out of range reads or writes foreign memory. `check` raises
`Misfit` with the name of the part, what was expected of it and what was found; types add their rules to it.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import is_dataclass
from functools import singledispatch
from typing import Any, TypeVar, cast

import numpy as np

from .errors import say
from .linalg import is_sparse

T = TypeVar("T")


class Misfit(ValueError):
    """A part that does not fit: its name, what was expected of it, what it is and what helps."""

    def __init__(self, name: str, expected: str, got: object, remedy: str = "") -> None:
        super().__init__(say(name, expected, got, remedy))
        self.name, self.expected, self.got, self.remedy = name, expected, got, remedy


def require(condition: bool, name: str, expected: str, got: object, remedy: str = "") -> None:
    """Refuse a part for which the condition does not hold."""
    if not condition:
        raise Misfit(name, expected, got, remedy)


@singledispatch
def check(part: Any, name: str) -> None:
    """Refuse a part of a file whose numbers do not fit each other; the rule by its type, and for any dataclass its declarations."""
    if is_dataclass(part):
        types(part, name)


# ------------------------------------------------------------------------------------------------------------------------ types
@functools.cache
def declared(kind: Any, strict: bool) -> Any:
    """The fields of a type, and of all types in them, as a validator of {name: value}."""
    from pydantic import ConfigDict, TypeAdapter

    config = ConfigDict(arbitrary_types_allowed=True, strict=strict, revalidate_instances="always")
    return TypeAdapter(dict[str, kind], config=config)


def types(value: Any, name: str) -> None:
    """Every field holds what it is declared to hold."""
    build(type(value), value, name, strict=True)


def build(kind: type[T], value: Any, name: str, strict: bool = False) -> T:
    """A dataclass of this type from dicts of its fields, lists for its tuples and values for its enumerations."""
    from pydantic import ValidationError

    try:
        found: T = declared(cast(Any, kind), strict).validate_python({name: value})[name]
    except ValidationError as problem:
        first = problem.errors(include_url=False)[0]
        raise Misfit(label(tuple(first["loc"])), first["msg"].removeprefix("Input should be "), shown(first["input"])) from None
    return found


def label(place: Sequence[str | int]) -> str:
    """A place as a text, `system.elastic[0].gather.section`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).lstrip(".")


# ----------------------------------------------------------------------------------------------------------------------- arrays
def shown(value: Any) -> str:
    """A value in short: arrays by shape and type."""
    if isinstance(value, np.ndarray) or is_sparse(value):
        return f"{'a sparse' if is_sparse(value) else 'an'} array {value.shape} of {value.dtype}"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def numbers(value: Any, name: str, *shape: int) -> None:
    """A dense or sparse array of finite 64-bit numbers."""
    sizes = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
    require(value.shape == shape and value.dtype == np.float64, name, f"an array ({sizes}) of float64", shown(value))
    entries = value.data if is_sparse(value) else value
    bad = np.flatnonzero(~np.isfinite(np.ravel(entries)))
    require(not len(bad), name, "finite numbers", f"{np.ravel(entries)[bad[:1]]} as number {bad[:1]}")


def indices(value: np.ndarray, name: str, low: int, end: int, *shape: int) -> None:
    """An array of 64-bit integers from `low` to `end` - 1."""
    sizes = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
    require(value.shape == shape and value.dtype == np.int64, name, f"an array ({sizes}) of int64", shown(value))
    if value.size:
        least, largest = int(value.min()), int(value.max())
        require(low <= least and largest < end, name, f"indices from {low} to {end - 1}", f"{least} to {largest}")


def rank(value: np.ndarray, name: str, axes: int) -> tuple[int, ...]:
    """The shape of an array of so many axes."""
    require(value.ndim == axes, name, f"an array of {axes} axes", shown(value))
    return tuple(value.shape)


def span(value: slice, name: str, end: int) -> int:
    """The length of a range from 0 to `end`."""
    whole = type(value.start) is int and type(value.stop) is int and value.step in (None, 1)
    require(whole and 0 <= value.start <= value.stop <= end, name, f"a range within 0 to {end}", value)
    return int(value.stop - value.start)


def listed(rows: Sequence[int], name: str, end: int) -> None:
    require(all(0 <= row < end for row in rows), name, f"indices from 0 to {end - 1}", shown(tuple(rows)))
