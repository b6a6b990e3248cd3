"""Whether what comes from a file is what its types declare: kinds of fields, shapes, finite
numbers, indices that stay inside.

    x0: Annotated[np.ndarray, Reals("n")]                       rows: Annotated[np.ndarray, Reals("kcp r")]
    row: Annotated[np.ndarray, Indices("t", end="y")]           lift: Annotated[Affine, Inside("i=q j=n")]

Letters are sizes of axes, equal throughout a struct: `kcp` is a product, `x+kx` a sum. A letter
gets its value from the vectors of a struct, then from other arrays in the order of their fields.
Structs in a struct know the letters that `Inside` hands them, and give back those that they find.

Compiled code follows indices without looking, so that one of them out of range reads or writes
foreign memory. `check` raises `Misfit` with the name of the part, what was expected of it and what
was found; `also` holds what no declaration says.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from enum import EnumType
from functools import singledispatch
from types import UnionType
from typing import (
    Any,
    ClassVar,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from ..algebra.linalg import is_sparse
from ..errors import say
from .records import dataclass

T = TypeVar("T")
Sizes: TypeAlias = dict[str, int]  #: values of letters


class Misfit(ValueError):
    """A part that does not fit: its name, what was expected of it, what it is and what helps."""

    def __init__(self, name: str, expected: str, got: object, remedy: str = "") -> None:
        super().__init__(say(name, expected, got, remedy))
        self.name, self.expected, self.got, self.remedy = name, expected, got, remedy


def require(condition: bool, name: str, expected: str, got: object, remedy: str = "") -> None:
    """Refuse a part for which the condition does not hold."""
    if not condition:
        raise Misfit(name, expected, got, remedy)


def require_of(condition: bool, name: str, expected: str, value: Any) -> None:
    """As `require`, of a value that is described only where it is refused: the text of a struct
    takes longer than its check.
    """
    if not condition:
        raise Misfit(name, expected, describe(value))


def check(part: Any, name: str) -> None:
    """Refuse a struct from a file that is not as its type declares, and all structs in it."""
    if is_dataclass(part):
        types(part, name)
        fit(part, name, {})


def fit(part: Any, name: str, sizes: Sizes) -> None:
    """Refuse a struct whose numbers do not fit each other; `sizes` are the letters known from
    outside, and then all.
    """
    for key, rule in rules(cast(Any, type(part))):
        value = getattr(part, key)
        where = f"{name}.{key}"
        for place, item in (
            [(where, value)] if isinstance(rule, Attributes) else leaves(value, where)
        ):
            rule.check(item, place, sizes)
    also(part, name, sizes)


def leaves(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """What is in tuples and dicts, with its name; other values themselves."""
    if isinstance(value, tuple | list | Mapping):
        pairs = value.items() if isinstance(value, Mapping) else enumerate(value)
        for key, item in pairs:
            yield from leaves(item, f"{name}[{key}]" if isinstance(key, int) else f"{name}.{key}")
    else:
        yield name, value


@singledispatch
def also(part: Any, name: str, sizes: Sizes) -> None:
    """What holds in a struct beside the declarations of its fields; the rule by its type, with the
    letters of the struct.
    """


@functools.cache
def rules(kind: type) -> tuple[tuple[str, Rule], ...]:
    """Fields of a struct with their rules in the order of their checks."""
    hints = get_type_hints(kind, include_extras=True)
    found = [(part.name, rule_of(hints[part.name])) for part in fields(kind)]
    return tuple(sorted(found, key=lambda one: one[1].order))


def rule_of(hint: Any) -> Rule:
    """The rule in an annotation."""
    return next(
        (one for one in getattr(hint, "__metadata__", ()) if isinstance(one, Rule)), Inside()
    )


# ------------------------------------------------------------------------------------------------------------------------ types
WORDS: dict[Any, str] = {
    float: "a number",
    int: "an integer",
    str: "a text",
    bool: "true or false",
    type(None): "nothing",
}


def types(value: Any, name: str) -> None:
    """Every field holds what it is declared to hold."""
    conform(type(value), value, name, False)


def build(kind: type[T], value: Any, name: str) -> T:
    """A dataclass of this type from dicts of its fields, lists for its tuples and values for its
    enumerations.
    """
    found: T = conform(kind, value, name, True)
    return found


def conform(kind: Any, value: Any, name: str, plain: bool) -> Any:
    """A value of an annotation, made from plain data where that is allowed; raises Misfit with the
    place of what is none.
    """
    origin = get_origin(kind) or kind
    parts = get_args(kind)
    if origin is Any:
        return value
    if origin in (Union, UnionType):
        return conform_one(parts, value, name, plain)
    if origin is Literal:
        require_of(value in parts, name, " or ".join(map(repr, parts)), value)
        return value
    if plain and isinstance(value, Mapping) and is_dataclass(origin):
        return cast(Any, origin)(**conform_fields(cast(Any, origin), value, name, plain))
    if plain and isinstance(origin, EnumType) and value in {one.value for one in cast(Any, origin)}:
        return origin(value)
    known = (
        (float, int) if origin is float else (tuple, list) if plain and origin is tuple else origin
    )
    fits = isinstance(value, known) and not (isinstance(value, bool) and origin in (int, float))
    require_of(fits, name, WORDS.get(origin, f"a {origin.__name__}"), value)
    if is_dataclass(value):
        own: type = type(value)
        # some are made when read
        there = {key: getattr(value, key) for key in hints_of(own) if hasattr(value, key)}
        conform_fields(own, there, name, plain)
    elif parts and issubclass(origin, Mapping):
        return {
            conform(parts[0], key, name, plain): conform(parts[1], item, f"{name}.{key}", plain)
            for key, item in value.items()
        }
    elif parts and issubclass(origin, tuple | list):
        each = parts[:1] * len(value) if origin is list or parts[-1] is ... else parts
        require_of(len(value) == len(each), name, f"{len(each)} values", value)
        return origin(
            conform(part, item, f"{name}[{k}]", plain)
            for k, (part, item) in enumerate(zip(each, value, strict=True))
        )
    return float(value) if origin is float else value


def conform_one(kinds: Sequence[Any], value: Any, name: str, plain: bool) -> Any:
    """A value of one of several annotations; of those that it is none of, the problem that lies
    deepest is reported.
    """
    problems = []
    for kind in kinds:
        try:
            return conform(kind, value, name, plain)
        except Misfit as problem:
            problems.append(problem)
    raise max(problems, key=lambda problem: len(problem.name))


def conform_fields(kind: type, values: Mapping[str, Any], name: str, plain: bool) -> dict[str, Any]:
    """The fields of a dataclass by name; those with a default may be left out."""
    for field in fields(kind):
        needed = field.default is MISSING and field.default_factory is MISSING
        require(field.name in values or not needed, f"{name}.{field.name}", "a value", "none")
    hints = hints_of(kind)
    return {
        key: conform(hints[key], values[key], f"{name}.{key}", plain)
        for key in hints
        if key in values
    }


@functools.cache
def hints_of(kind: type) -> dict[str, Any]:
    """What the fields of a dataclass are declared to hold."""
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


# ------------------------------------------------------------------------------------------------------------------------ rules
@dataclass(frozen=True)
class Inside:
    """A struct that knows these letters, `j=n` the letter n of the struct around it by the name j;
    other values pass.

    As all rules but `Attributes`, of a tuple or dict it is that of every item.
    """

    letters: str = ""
    known: Callable[[Any], bool] | None = None  #: what a field that is declared as Any holds
    #: of the check: 0 where others read its letters, 2 where it reads those of all others
    order: ClassVar[int] = 1

    def check(self, value: Any, name: str, sizes: Sizes) -> None:
        """Raises Misfit where a value is something else."""
        if self.known is not None:
            require_of(self.known(value), name, "a struct that is known here", value)
            types(value, name)
        pairs = [(pair[0], pair[-1]) for pair in self.letters.split()]
        own = {inner: sizes[outer] for inner, outer in pairs if outer in sizes}
        if is_dataclass(value):
            fit(value, name, own)
        sizes.update({outer: own[inner] for inner, outer in pairs if inner in own})


@dataclass(frozen=True)
class Attributes:
    """A value whose attributes are sizes, `k=vectors`, or which is one itself, `c`, perhaps among a
    few, or its length.
    """

    letters: str
    among: tuple[int, ...] = ()
    order: ClassVar[int] = 0

    def check(self, value: Any, name: str, sizes: Sizes) -> None:
        """Raises Misfit where a size is another one."""
        for letter, _, attribute in (pair.partition("=") for pair in self.letters.split()):
            got = (
                getattr(value, attribute)
                if attribute
                else len(value)
                if isinstance(value, tuple)
                else value
            )
            require(
                not self.among or got in self.among, name, " or ".join(map(str, self.among)), got
            )
            require(sizes.setdefault(letter, got) == got, name, str(sizes[letter]), got)


@dataclass(frozen=True)
class Reals:
    """A dense or sparse array of finite 64-bit numbers with these axes; `*` is one of any length.
    None stands for an identity.
    """

    axes: str

    @property
    def order(self) -> int:
        return min(len(self.axes) - 1, 1)

    def check(self, value: Any, name: str, sizes: Sizes) -> None:
        """Raises Misfit where an array is another one."""
        if value is None:
            inner, outer = self.axes.split()
            sizes[inner] = sizes[outer]
            return
        check_shape(value, self.axes, np.dtype(np.float64), name, sizes)
        entries = np.ravel(value.data if is_sparse(value) else value)
        bad = np.flatnonzero(~np.isfinite(entries))
        require(not len(bad), name, "finite numbers", f"{entries[bad[:1]]} as number {bad[:1]}")


@dataclass(frozen=True)
class Indices:
    """An array of 64-bit integers i with these axes.

        low <= i,    i + reach <= end

    Without an end any above.
    """

    axes: str
    end: str = ""
    low: int = 0
    reach: str = "1"

    @property
    def order(self) -> int:
        return min(len(self.axes) - 1, 2)

    def check(self, value: Any, name: str, sizes: Sizes) -> None:
        """Raises Misfit where an array is another one."""
        check_shape(value, self.axes, np.dtype(np.int64), name, sizes)
        last = (
            size(self.end, sizes) - size(self.reach, sizes) if self.end else np.iinfo(np.int64).max
        )
        least, largest = (int(value.min()), int(value.max())) if value.size else (self.low, last)
        require(
            self.low <= least and largest <= last,
            name,
            f"indices from {self.low} to {last}",
            f"{least} to {largest}",
        )


@dataclass(frozen=True)
class Range:
    """A slice of this length within 0 to `end`."""

    length: str
    end: str

    @property
    def order(self) -> int:
        return min(len(self.length) - 1, 1)

    def check(self, value: slice, name: str, sizes: Sizes) -> None:
        """Raises Misfit where a slice is another one."""
        end = size(self.end, sizes)
        whole = type(value.start) is int and type(value.stop) is int and value.step in (None, 1)
        require(
            whole and 0 <= value.start <= value.stop <= end,
            name,
            f"a range within 0 to {end}",
            value,
        )
        length = value.stop - value.start
        wanted = size(self.length, sizes) if self.order else sizes.setdefault(self.length, length)
        require(length == wanted, name, f"a range of length {wanted}", value)


@dataclass(frozen=True)
class Number:
    """A finite number above `low`."""

    low: float = -math.inf
    order: ClassVar[int] = 1

    def check(self, value: float, name: str, sizes: Sizes) -> None:
        """Raises Misfit where a number is another one."""
        expected = "a positive number" if self.low == 0.0 else "a finite number"
        require(math.isfinite(value) and value > self.low, name, expected, value)


Rule: TypeAlias = Inside | Attributes | Reals | Indices | Range | Number


def check_shape(value: Any, text: str, dtype: np.dtype[Any], name: str, sizes: Sizes) -> None:
    """Refuse an array of other axes or another kind of numbers; letters without a value get it from
    the array.
    """
    axes = text.split()
    require_of(value.ndim == len(axes), name, f"an array of {len(axes)} axes", value)
    for axis, length in zip(axes, value.shape, strict=True):
        for letter in {letter for letter in axis if letter.isalpha()} - sizes.keys():
            sizes[letter] = length // (size(axis, {**sizes, letter: 1}) or 1)
    shape = tuple(
        length if axis == "*" else size(axis, sizes)
        for axis, length in zip(axes, value.shape, strict=True)
    )
    require_of(
        value.shape == shape and value.dtype == dtype, name, f"an array {shape} of {dtype}", value
    )


def size(axis: str, sizes: Sizes) -> int:
    """The length of an axis: a sum of products of letters and digits."""
    return sum(
        math.prod(int(sign) if sign.isdigit() else sizes[sign] for sign in product)
        for product in axis.split("+")
    )


def describe(value: Any) -> str:
    """A value in short: arrays by shape and type, structs by their names, as what is in them may
    not fit.
    """
    if isinstance(value, np.ndarray) or is_sparse(value):
        return f"{'a sparse' if is_sparse(value) else 'an'} array {value.shape} of {value.dtype}"
    text = f"a {type(value).__name__}" if is_dataclass(value) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
