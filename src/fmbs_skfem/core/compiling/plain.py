"""What kernels call beside each other, in Python: in place of numba and of `intrinsics`, whose
names these are, under FMBS_PLAIN=1.

    opener, invoke      structs at an address, routines by their address
    call, view          entries by their address, arrays inside of arrays
    call_lapack         LAPACK, the same routines as those of compiled code
    add_product         a sum
    carray              an array at a pointer, which is an array here

An address is a number that is known here (`register`); what else stands behind one, a function of
`structs.Callback`, is called through ctypes. Kernels are the same functions as those that numba
compiles. They differ from these in the last digits, since a compiler may add in another order, and
where a number of Python, not of an array, is divided by zero, which raises an error.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .machine_code import Code
from .structs import FUNCTION, SCALARS, ArrayKind, fields, unpacked, width

KNOWN: dict[int, Callable[..., Any]] = {}  #: functions by their addresses


def register(function: Callable[..., Any]) -> Code:
    """A function of Python behind an address, as long as the process lives."""
    KNOWN[id(function)] = function  # nothing else of the process has this number
    return Code(id(function))


class OpenedStruct:
    """A struct at an address. As in compiled code a field is read where it is first used: those
    behind may not be there.
    """

    def __init__(self, kind: type, start: int) -> None:
        self._kind, self._start = kind, start

    def __getattr__(self, name: str) -> Any:
        places = places_of(self._kind)
        if name not in places:
            raise AttributeError(
                f"{self._kind.__name__} has no field {name}, but {', '.join(places)}"
            )
        kind, first = places[name]
        start = self._start + 8 * first
        found = (
            unpacked(kind, start)
            if isinstance(kind, ArrayKind) or kind in SCALARS
            else OpenedStruct(kind, start)
        )
        self.__dict__[name] = found  # integers of a struct never change while it is open
        return found

    def __repr__(self) -> str:
        return f"{self._kind.__name__} with {', '.join(places_of(self._kind))}"


@functools.cache
def places_of(kind: type) -> dict[str, tuple[Any, int]]:
    """Fields of a struct with their kinds, and where their integers begin."""
    widths = [width(part) for _, part in fields(kind)]
    return {name: (part, sum(widths[:k])) for k, (name, part) in enumerate(fields(kind))}


def opener(kind: type) -> Callable[[Any], OpenedStruct]:
    """The struct at an address."""
    return lambda table: OpenedStruct(kind, int(table))


def dot(a: np.ndarray, b: np.ndarray) -> float:
    """a . b by eight sums side by side."""
    full = len(a) // 8 * 8
    s = [0.0] * 8
    for k in range(full):
        s[k % 8] += a[k] * b[k]
    total = ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]))
    for k in range(full, len(a)):
        total += a[k] * b[k]
    return total


def dot_four(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, x: np.ndarray
) -> tuple[float, ...]:
    """Four dot products with x."""
    return dot(a, x), dot(b, x), dot(c, x), dot(d, x)


def invoke(address: int, table: int, more: int) -> int:
    """Call the routine at an address; what it returns."""
    table, more = int(table), int(more)  # those read from arrays are numbers of numpy
    return int(
        KNOWN[address](table, more) if address in KNOWN else FUNCTION(int(address))(table, more)
    )


def call(
    address: int, arrays: Sequence[np.ndarray], integers: Sequence[int], number: float
) -> None:
    """Call the entry at an address with four arrays, four integers and a number."""
    KNOWN[address](*arrays, *integers, number)


def carray(pointer: np.ndarray, shape: Any) -> np.ndarray:
    """The numbers of an array in another shape."""
    return view(pointer, 0, shape if isinstance(shape, tuple) else (shape,))


def view(flat: np.ndarray, start: int, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of an array from `start` on in a shape, without check: the last row may end beyond,
    where nobody reads.
    """
    strides = flat.itemsize * np.cumprod((1, *shape[:0:-1]))[::-1]
    return np.lib.stride_tricks.as_strided(flat.reshape(-1)[start:], shape, strides)


def call_lapack(addresses: np.ndarray, routine: int, arguments: Sequence[Any]) -> int:
    """Call LAPACK with pointers to `arguments` (arrays, int8 letters, integers) and to `info`, and
    return `info`.
    """
    info = ctypes.c_int32(0)
    numbers = [None if isinstance(one, np.ndarray) else letter(one) for one in arguments]
    pointers = [
        ctypes.c_void_p(one.ctypes.data) if number is None else ctypes.byref(number)
        for one, number in zip(arguments, numbers, strict=True)
    ]
    ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(pointers) + 1))(int(addresses[routine]))(
        *pointers, ctypes.byref(info)
    )
    return info.value


def letter(number: Any) -> Any:
    """An argument of LAPACK that is no array."""
    return ctypes.c_int8(int(number)) if isinstance(number, np.int8) else ctypes.c_int32(number)


def add_product(total: float, a: float, b: float) -> float:
    """total + a b."""
    return total + a * b
