"""What expressions of kernels are while they are printed: what is known, text of C, arrays, structs."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ..errors import FmbsError

#: kinds of numbers, each of which holds those before it: whole ones, those of floating point, and
#: complex ones
KINDS = "whole", "double", "pair"
#: of arrays
ITEMS = {"float64": "double", "int64": "whole", "int32": "int", "complex128": "pair"}


class OutsideError(FmbsError):
    """A kernel is outside of the subset that can be printed, see `docs/architecture.md`."""


class UnknownError(OutsideError):
    """What has to be known when a kernel is printed is not."""


class ChoiceError(OutsideError):
    """What one side of a choice does can only be done by statements."""


@dataclass(frozen=True)
class Const:
    """A number, or anything else of Python, that is known."""

    value: Any


@dataclass(frozen=True)
class Scalar:
    """A number that the program finds."""

    text: str  #: in C
    kind: str
    element: Any = None  #: the array and the place in it that it is read from


Number: TypeAlias = Const | Scalar


class Base:
    """A memory that arrays are in."""

    def __init__(self) -> None:
        self.written = False  #: whether a kernel writes to it


@dataclass(frozen=True)
class Array:
    """Numbers in a memory, row by row or by strides."""

    base: Base
    text: str  #: pointer to the first one
    item: str
    shape: tuple[Number, ...]
    strides: tuple[Number, ...] | None = None
    place: Const | None = None  #: of the first one in the base, where it is known


@dataclass(frozen=True)
class Pointer:
    """An address: one of several structs that are alike but for some numbers."""

    starts: tuple[int, ...]
    number: Number  #: which one


@dataclass(frozen=True)
class Struct:
    """A struct that was opened."""

    kind: type
    starts: tuple[int, ...]
    number: Number


@dataclass(frozen=True)
class Several:
    """A tuple."""

    parts: tuple[Any, ...]
    kind: Any = None  #: class of a named one


@dataclass(frozen=True)
class Callee:
    """A function, a class or a module."""

    value: Any


@dataclass(frozen=True)
class HostFunctions:
    """What a kernel asks of the program: kinds of what its functions return, "" of nothing."""

    kinds: tuple[tuple[str, str], ...]


Value: TypeAlias = Const | Scalar | Array | Pointer | Struct | Several | Callee | HostFunctions

TRUE, FALSE, NONE, ZERO, ONE = Const(True), Const(False), Const(None), Const(0), Const(1)


def kind_of(one: Any) -> str:
    """The kind of a number."""
    if isinstance(one, Scalar):
        return one.kind
    if isinstance(one, Const):
        if isinstance(one.value, bool | int):
            return "whole"
        if isinstance(one.value, float):
            return "double"
    raise OutsideError(f"a number in place of {type(one).__name__.lower()}")


def widest(*kinds: str) -> str:
    """The kind that holds numbers of all of these."""
    return max(kinds, key=KINDS.index)


def text_of(one: Any, kind: str = "") -> str:
    """A number in C, as one of a kind."""
    own = kind_of(one)
    text = one.text if isinstance(one, Scalar) else written(one.value, kind or own)
    if kind in ("", own) or (isinstance(one, Const) and kind != "pair"):
        return text
    if kind == "pair":
        return f"pair_of({bare(text)}, 0.0)"
    return f"({kind}){text}"


def written(value: Any, kind: str) -> str:
    """A known number in C, in brackets below zero."""
    if kind == "whole":
        text = str(int(value))
    elif math.isnan(value):
        text = "NO_NUMBER"
    elif math.isinf(value):
        text = "-ENDLESS" if value < 0 else "ENDLESS"
    else:
        text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def bare(text: str) -> str:
    """A text without brackets around all of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for letter in text[:-1]:
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return text
    return text[1:-1]


def is_simple(one: Any) -> bool:
    """Whether a number may be written several times: it is known, or has a name."""
    return isinstance(one, Const) or re.fullmatch(r"[\w.]+", one.text) is not None


def plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    return value.item() if isinstance(value, np.generic) else value
