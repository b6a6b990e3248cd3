"""Structs of arrays and numbers that compiled code opens from one address, and routines that know
nothing but such addresses.

    class Point(NamedTuple):                                 numbers, arrays and structs, by their annotations
        x: Vector
        matrix: Matrix
        step: float

    table = packed(Point(x, A, 0.1))                         integers: addresses, shapes, bits of numbers
    opened = opener(Point)                                   for compiled code

    @routine
    def scale(table, more):                                  compiled when its address is first asked for
        p = opened(table)                                    a Point: nothing is copied
        ...
        return invoke(another, table, more)                  another routine by its address

    scale(Point(x, A, 0.1))                                  from Python, without the interpreter lock

A function that is called by name becomes part of its caller and is compiled again with every
caller; arguments of many arrays make that long and every call slow. A routine is compiled once,
whoever calls it, and a call costs a jump. Its callers need not know what it is: storages of elastic
terms, laws, solvers, and functions of Python (`callback`) stand behind the same door. Addresses
differ from process to process: they are values, never constants.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, TypeAlias, get_type_hints

import numpy as np

from ..errors import say
from .jit import PLAIN, Deferred, addressed, deferred, jit, taken


class ArrayKind(NamedTuple):
    """An array in C order: of what, and with how many axes."""

    item: str
    ndim: int

    def __str__(self) -> str:
        return f"array({self.item}, {self.ndim}d, C)"


Vector: TypeAlias = Annotated[np.ndarray, ArrayKind("float64", 1)]
Matrix: TypeAlias = Annotated[np.ndarray, ArrayKind("float64", 2)]
Cube: TypeAlias = Annotated[np.ndarray, ArrayKind("float64", 3)]
Tensor: TypeAlias = Annotated[np.ndarray, ArrayKind("float64", 4)]
Integers: TypeAlias = Annotated[np.ndarray, ArrayKind("int64", 1)]
IntegerMatrix: TypeAlias = Annotated[np.ndarray, ArrayKind("int64", 2)]
Shorts: TypeAlias = Annotated[np.ndarray, ArrayKind("int32", 1)]
SCALARS = (int, float, bool)
SIGNATURE = "int64(CPointer(int64), int64)"
FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)


@functools.cache
def fields(kind: type) -> tuple[tuple[str, Any], ...]:
    """Names of a struct with their kinds: ArrayKind of an array, one of SCALARS, or a struct."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(
        (name, hints[name].__metadata__[0] if hasattr(hints[name], "__metadata__") else hints[name])
        for name in hints
    )


@functools.cache
def parts(kind: type) -> tuple[tuple[str, Any, np.dtype | None], ...]:
    """Name and kind of every field of a struct, and what its arrays consist of; None where a field
    is no array.
    """
    return tuple(
        (name, part, np.dtype(part.item) if isinstance(part, ArrayKind) else None)
        for name, part in fields(kind)
    )


def packed(value: Any) -> np.ndarray:
    """A struct as integers: for every array its address and shape, for every number its bits. The
    caller keeps the struct alive.
    """
    found: list[int] = []
    write(value, found)
    return np.array(found, dtype=np.int64)


def address_of(array: np.ndarray) -> int:
    """Where the numbers of an array are, as the integers of a packed struct."""
    if (
        array.size and array.flags.writeable
    ):  # in a quarter of the time; a step has a hundred arrays
        return ctypes.addressof(first_byte(array))
    return int(array.__array_interface__["data"][0])


first_byte: Any = ctypes.c_char.from_buffer
NOTHING = np.zeros(1)
ANYWHERE = address_of(NOTHING)  #: where empty arrays are


def write(value: Any, found: list[int]) -> None:
    """Append the integers of a struct."""
    struct: Any = type(value)
    for (name, kind, item), part in zip(parts(struct), value, strict=True):
        if item is not None:
            flags = part.flags
            if (
                part.ndim != kind.ndim
                or (part.dtype is not item and part.dtype != item)
                or not flags.c_contiguous
            ):
                got = f"{part.dtype} {part.shape}, {'' if flags.c_contiguous else 'not '}contiguous"
                raise TypeError(say(f"{type(value).__name__}.{name}", kind, got))
            found += (address_of(part) if part.size else ANYWHERE, *part.shape)
        elif kind is float:
            found.append(int(np.float64(part).view(np.int64)))
        elif kind in SCALARS:
            found.append(int(part))
        else:
            write(part, found)


def width(kind: Any) -> int:
    """The number of integers of an entry of `fields`."""
    if isinstance(kind, ArrayKind):
        return 1 + int(kind.ndim)
    return 1 if kind in SCALARS else sum(width(part) for _, part in fields(kind))


def place_of(kind: type, name: str) -> int:
    """Where the integers of a field begin among those of a struct."""
    names = [field for field, _ in fields(kind)]
    return sum(width(part) for _, part in fields(kind)[: names.index(name)])


def opener(kind: type) -> Callable[[Any], Any]:
    """A function for compiled code: the struct at an address, a pointer or a number. Its arrays own
    nothing.
    """
    return Deferred(functools.partial(make_opener, kind))


def make_opener(kind: type) -> Any:
    """The intrinsic behind `opener`."""
    return taken("fmbs_skfem.core.compiling.intrinsics", "opener")(kind)


invoke = deferred("fmbs_skfem.core.compiling.intrinsics", "invoke")


class Routine:
    """A compiled function of an address of integers and an integer, by default 0; it returns an
    integer.

    Compiled code may call it by name as well: then it becomes part of its caller, as what `jit`
    compiles does.
    """

    def __init__(self, function: Callable[[Any, Any], int]) -> None:
        self.function = function
        self.__doc__, self.__name__ = function.__doc__, function.__name__

    @functools.cached_property
    def compiled(self) -> Any:
        """Compiled when it is first asked for, cached on disk."""
        return addressed(SIGNATURE, self.function)

    @functools.cached_property
    def part(self) -> Any:
        """What compiled code calls by name."""
        return jit(self.function)

    @property
    def _numba_type_(self) -> Any:
        return self.part._numba_type_

    @functools.cached_property
    def address(self) -> int:
        return int(self.compiled.address)

    @functools.cached_property
    def call(self) -> Any:
        """What Python calls: the function itself where nothing is compiled, so that its exceptions
        are seen.
        """
        return self.function if PLAIN else FUNCTION(self.address)

    def __call__(self, struct: Any, more: int = 0) -> int:
        """Call it on a struct, or on one that was packed and is still there, given by its integers
        or by their address.
        """
        if isinstance(struct, int):
            return int(self.call(struct, more))
        table = struct if isinstance(struct, np.ndarray) else packed(struct)
        if table.dtype != np.int64:
            raise TypeError(
                say(
                    f"routine {self.__name__}",
                    "a struct, or the integers of a packed one",
                    f"an array of {table.dtype}",
                )
            )
        return int(self.call(address_of(table), more))


def routine(function: Callable[[Any, Any], int]) -> Routine:
    """`function` as a Routine."""
    return Routine(function)


def unpacked(kind: Any, address: int) -> Any:
    """What is at an address, a struct or an entry of `fields`, in Python, its arrays those in the
    memory.
    """
    return read((ctypes.c_int64 * width(kind)).from_address(address), kind)


def read(integers: Any, kind: Any, first: int = 0) -> Any:
    """An array, a number or a struct from its integers."""
    if isinstance(kind, ArrayKind):
        shape = tuple(integers[first + 1 : first + 1 + kind.ndim])
        item = np.dtype(kind.item)
        memory: Any = (ctypes.c_char * (int(np.prod(shape)) * item.itemsize)).from_address(
            integers[first]
        )
        return np.ndarray(shape, item, memory)
    if kind is float:
        return np.int64(integers[first]).view(np.float64)  # whose divisions by zero follow IEEE
    if kind in SCALARS:
        return kind(integers[first])
    found: list[Any] = []
    for _, part in fields(kind):
        found.append(read(integers, part, first))
        first += width(part)
    return kind(*found)


class Callback:
    """A Python function of an address and an integer behind an address, in place of a Routine.

    The first exception is kept, and 1 is returned in its place; the function itself returns
    nothing, which stands for 0.
    """

    def __init__(self, function: Callable[[int, int], None]) -> None:
        self.error: BaseException | None = None

        def guarded(table: int, more: int) -> int:
            try:
                function(table, more)
            except BaseException as error:
                self.error = self.error or error
                return 1
            return 0

        self.pointer = FUNCTION(guarded)
        self.address = int(ctypes.cast(self.pointer, ctypes.c_void_p).value or 0)

    def __call__(self, table: np.ndarray, more: int = 0) -> int:
        """Call it as compiled code does, with the integers of a packed struct."""
        return int(self.pointer(address_of(table), more))

    def check(self) -> None:
        """Raise the exception that was kept."""
        if self.error is not None:
            error = self.error
            self.error = None
            raise error
