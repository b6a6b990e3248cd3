"""Structs of arrays and numbers that compiled code opens from one address, and routines that know nothing but such addresses.

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

A function that is called by name becomes part of its caller and is compiled again with every caller; arguments of many arrays make
that long and every call slow. A routine is compiled once, whoever calls it, and a call costs a jump. Its callers need not know what
it is: storages of elastic terms, laws, solvers, and functions of Python (`callback`) stand behind the same door. Addresses differ
from process to process: they are values, never constants.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Sequence
from typing import Annotated, Any, TypeAlias, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numba.np.arrayobj import populate_array

from .errors import say
from .jit import addressed, jit

Vector: TypeAlias = Annotated[np.ndarray, types.Array(types.float64, 1, "C")]
Matrix: TypeAlias = Annotated[np.ndarray, types.Array(types.float64, 2, "C")]
Cube: TypeAlias = Annotated[np.ndarray, types.Array(types.float64, 3, "C")]
Tensor: TypeAlias = Annotated[np.ndarray, types.Array(types.float64, 4, "C")]
Integers: TypeAlias = Annotated[np.ndarray, types.Array(types.int64, 1, "C")]
IntegerMatrix: TypeAlias = Annotated[np.ndarray, types.Array(types.int64, 2, "C")]
Shorts: TypeAlias = Annotated[np.ndarray, types.Array(types.int32, 1, "C")]
SCALARS = {int: types.int64, float: types.float64, bool: types.boolean}
SIGNATURE = types.int64(types.CPointer(types.int64), types.int64)
FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)


@functools.cache
def fields(kind: type) -> tuple[tuple[str, Any], ...]:
    """Names of a struct with their kinds: numba's type of an array, a type of SCALARS, or a struct."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple((name, hints[name].__metadata__[0] if hasattr(hints[name], "__metadata__") else hints[name]) for name in hints)


@functools.cache
def items(kind: type) -> tuple[np.dtype | None, ...]:
    """What the arrays of a struct consist of, by field; None where a field is no array."""
    return tuple(np.dtype(str(part.dtype)) if isinstance(part, types.Array) else None for _, part in fields(kind))


def packed(value: Any) -> np.ndarray:
    """A struct as integers: for every array its address and shape, for every number its bits. The caller keeps the struct alive."""
    found: list[int] = []
    write(value, found)
    return np.array(found, dtype=np.int64)


def address_of(table: np.ndarray) -> int:
    """Where the integers of a packed struct are."""
    return int(table.__array_interface__["data"][0])


def write(value: Any, found: list[int]) -> None:
    """Append the integers of a struct."""
    struct: Any = type(value)
    for (name, kind), item, part in zip(fields(struct), items(struct), value, strict=True):
        if item is not None:
            if part.ndim != kind.ndim or part.dtype != item or not part.flags.c_contiguous:
                got = f"{part.dtype} {part.shape}, {'' if part.flags.c_contiguous else 'not '}contiguous"
                raise TypeError(say(f"{type(value).__name__}.{name}", kind, got))
            found += [part.__array_interface__["data"][0], *part.shape]
        elif kind is float:
            found.append(int(np.float64(part).view(np.int64)))
        elif kind in SCALARS:
            found.append(int(part))
        else:
            write(part, found)


def width(kind: Any) -> int:
    """The number of integers of an entry of `fields`."""
    if isinstance(kind, types.Array):
        return 1 + int(kind.ndim)
    return 1 if kind in SCALARS else sum(width(part) for _, part in fields(kind))


class Opened(types.Type):
    """A struct in compiled code: an address, from which fields are read where they are used."""

    def __init__(self, kind: type) -> None:
        self.kind = kind
        super().__init__(f"Opened({kind.__module__}.{kind.__qualname__})")


@register_model(Opened)
class OpenedModel(models.PrimitiveModel):
    """A pointer to integers."""

    def __init__(self, manager: Any, kind: Opened) -> None:
        super().__init__(manager, kind, ir.IntType(64).as_pointer())


@infer_getattr
class OpenedFields(AttributeTemplate):
    """Types of fields."""

    key = Opened

    def generic_resolve(self, struct: Opened, name: str) -> Any:
        kind = dict(fields(struct.kind)).get(name)
        if kind is None or isinstance(kind, types.Array):
            return kind
        return SCALARS[kind] if kind in SCALARS else Opened(kind)


def array_at(context: Any, builder: Any, kind: types.Array, data: Any, sizes: Sequence[Any]) -> Any:
    """Code that makes an array, C order, of numbers that are there. It owns nothing and is not counted."""
    item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    strides = [item]
    for size in reversed(sizes[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    array = context.make_array(kind)(context, builder)
    populate_array(array, data, cgutils.pack_array(builder, sizes), cgutils.pack_array(builder, strides), item, None)
    return array._getvalue()


@lower_getattr_generic(Opened)
def read_field(context: Any, builder: Any, struct: Opened, start: Any, name: str) -> Any:
    """Code that reads a field. Integers of a struct never change while it is open, so that reads may leave their loops."""
    names = [field for field, _ in fields(struct.kind)]
    kinds = dict(fields(struct.kind))
    first = sum(width(kinds[before]) for before in names[: names.index(name)])

    def slot(k: int) -> Any:
        found = builder.load(builder.gep(start, [ir.Constant(ir.IntType(64), first + k)]))
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    kind = kinds[name]
    if isinstance(kind, types.Array):
        data = builder.inttoptr(slot(0), context.get_data_type(kind.dtype).as_pointer())
        return array_at(context, builder, kind, data, [slot(1 + k) for k in range(kind.ndim)])
    if kind is float:
        return builder.bitcast(slot(0), ir.DoubleType())
    if kind is bool:
        return builder.trunc(slot(0), ir.IntType(1))
    return slot(0) if kind is int else builder.gep(start, [ir.Constant(ir.IntType(64), first)])


def opener(kind: type) -> Callable[[Any], Any]:
    """A function for compiled code: the struct at an address, a pointer or a number. Its arrays own nothing."""

    @intrinsic
    def opened(typing: Any, table: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return values[0] if isinstance(table, types.CPointer) else builder.inttoptr(values[0], ir.IntType(64).as_pointer())

        return Opened(kind)(table), code

    found: Callable[[Any], Any] = opened
    return found


@intrinsic
def invoke(typing: Any, address: Any, table: Any, more: Any) -> Any:
    """Call the routine at an address inside compiled code; what it returns."""

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        integer = ir.IntType(64)
        target = ir.FunctionType(integer, [integer.as_pointer(), integer]).as_pointer()
        return builder.call(builder.inttoptr(values[0], target), [values[1], values[2]])

    return types.int64(types.int64, types.CPointer(types.int64), types.int64), code


class Routine:
    """A compiled function of an address of integers and an integer, by default 0; it returns an integer.

    Compiled code may call it by name as well: then it becomes part of its caller, as what `jit` compiles does.
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
        return FUNCTION(self.address)

    def __call__(self, struct: Any, more: int = 0) -> int:
        """Call it on a struct, or on one that was packed and is still there, given by its integers or by their address."""
        if isinstance(struct, int):
            return int(self.call(struct, more))
        table = struct if isinstance(struct, np.ndarray) else packed(struct)
        if table.dtype != np.int64:
            raise TypeError(
                say(f"routine {self.__name__}", "a struct, or the integers of a packed one", f"an array of {table.dtype}")
            )
        return int(self.call(address_of(table), more))


def routine(function: Callable[[Any, Any], int]) -> Routine:
    """`function` as a Routine."""
    return Routine(function)


def unpacked(kind: type, address: int) -> Any:
    """The struct at an address in Python, its arrays those in the memory: where functions of Python stand behind an address."""
    return read_struct(kind, (ctypes.c_int64 * width(kind)).from_address(address))


def read_struct(kind: type, integers: Any, first: int = 0) -> Any:
    """A struct from its integers."""
    found: list[Any] = []
    for _, part in fields(kind):
        if isinstance(part, types.Array):
            shape, item = tuple(integers[first + 1 : first + 1 + part.ndim]), np.dtype(str(part.dtype))
            memory: Any = (ctypes.c_char * (int(np.prod(shape)) * item.itemsize)).from_address(integers[first])
            found.append(np.ndarray(shape, item, memory))
        elif part is float:
            found.append(float(np.int64(integers[first]).view(np.float64)))
        else:
            found.append(part(integers[first]) if part in SCALARS else read_struct(part, integers, first))
        first += width(part)
    return kind(*found)


class Callback:
    """A Python function of an address and an integer behind an address, in place of a Routine.

    The first exception is kept, and 1 is returned in its place; the function itself returns nothing, which stands for 0.
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

    def check(self) -> None:
        """Raise the exception that was kept."""
        if self.error is not None:
            error, self.error = self.error, None
            raise error
