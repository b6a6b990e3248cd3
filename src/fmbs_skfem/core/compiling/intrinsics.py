"""What compiled functions of this package can do beside Python: open structs, call by address,
LAPACK, products in any order.

    opener, invoke      structs at an address, routines by their address: `structs`
    call, view          entries by their address, arrays inside of arrays: `entries`
    call_lapack         LAPACK: `lapack`
    add_product         a sum that may be taken in any order: `direct`
    dot                 a sum of eight ones side by side: `kernels`

This module loads numba: the names there stand for these functions, which are made when the first
one is compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numba.np.arrayobj import populate_array

from ..errors import say
from .entries import INTEGERS, POINTERS
from .structs import ArrayKind, fields, width

SCALARS = {int: types.int64, float: types.float64, bool: types.boolean}


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
        if kind is None:
            return None
        if isinstance(kind, ArrayKind):
            return array_type(kind)
        return SCALARS[kind] if kind in SCALARS else Opened(kind)


def array_type(kind: ArrayKind) -> types.Array:
    """Numba's type of an array."""
    return types.Array(getattr(types, kind.item), kind.ndim, "C")


def array_at(context: Any, builder: Any, kind: types.Array, data: Any, sizes: Sequence[Any]) -> Any:
    """Code that makes an array, C order, of numbers that are there. It owns nothing and is not
    counted.
    """
    item = context.get_constant(
        types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype))
    )
    strides = [item]
    for size in reversed(sizes[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    array = context.make_array(kind)(context, builder)
    populate_array(
        array,
        data,
        cgutils.pack_array(builder, sizes),
        cgutils.pack_array(builder, strides),
        item,
        None,
    )
    return array._getvalue()


@lower_getattr_generic(Opened)
def read_field(context: Any, builder: Any, struct: Opened, start: Any, name: str) -> Any:
    """Code that reads a field. Integers of a struct never change while it is open, so that reads
    may leave their loops.
    """
    names = [field for field, _ in fields(struct.kind)]
    kinds = dict(fields(struct.kind))
    first = sum(width(kinds[before]) for before in names[: names.index(name)])

    def slot(k: int) -> Any:
        found = builder.load(builder.gep(start, [ir.Constant(ir.IntType(64), first + k)]))
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    kind = kinds[name]
    if isinstance(kind, ArrayKind):
        array = array_type(kind)
        data = builder.inttoptr(slot(0), context.get_data_type(array.dtype).as_pointer())
        return array_at(context, builder, array, data, [slot(1 + k) for k in range(kind.ndim)])
    if kind is float:
        return builder.bitcast(slot(0), ir.DoubleType())
    if kind is bool:
        return builder.trunc(slot(0), ir.IntType(1))
    return slot(0) if kind is int else builder.gep(start, [ir.Constant(ir.IntType(64), first)])


def opener(kind: type) -> Callable[[Any], Any]:
    """A function for compiled code: the struct at an address, a pointer or a number. Its arrays own
    nothing.
    """

    @intrinsic
    def opened(typing: Any, table: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return (
                values[0]
                if isinstance(table, types.CPointer)
                else builder.inttoptr(values[0], ir.IntType(64).as_pointer())
            )

        return Opened(kind)(table), code

    found: Callable[[Any], Any] = opened
    return found


@intrinsic
def invoke(typing: Any, address: Any, table: Any, more: Any) -> Any:
    """Call the routine at an address inside compiled code on a table, a pointer or a number; what
    it returns.
    """
    pointed = isinstance(table, types.CPointer)

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        integer = ir.IntType(64)
        target = ir.FunctionType(integer, [integer.as_pointer(), integer]).as_pointer()
        start = values[1] if pointed else builder.inttoptr(values[1], integer.as_pointer())
        return builder.call(builder.inttoptr(values[0], target), [start, values[2]])

    return types.int64(types.int64, table if pointed else types.int64, types.int64), code


@intrinsic
def call(typing: Any, address: Any, arrays: Any, integers: Any, number: Any) -> Any:
    """Call the entry at an address with the data of four arrays of float64, four integers and a
    number.
    """
    numbers = [
        kind
        for kind in arrays
        if isinstance(kind, types.Array) and kind.dtype == types.float64 and kind.layout == "C"
    ]
    if len(numbers) != POINTERS or len(arrays) != POINTERS or len(integers) != INTEGERS:
        expected = f"{POINTERS} C-contiguous arrays of float64 and {INTEGERS} integers"
        raise TypingError(say("entries.call", expected, f"{arrays} and {integers}"))

    def code(context: Any, builder: Any, signature: Any, values: Any) -> None:
        pointers = [
            builder.bitcast(
                context.make_array(kind)(context, builder, value).data, ir.DoubleType().as_pointer()
            )
            for kind, value in zip(arrays, cgutils.unpack_tuple(builder, values[1]), strict=True)
        ]
        counts = cgutils.unpack_tuple(builder, values[2])
        kinds = [value.type for value in (*pointers, *counts, values[3])]
        target = ir.FunctionType(ir.VoidType(), kinds).as_pointer()
        builder.call(builder.inttoptr(values[0], target), [*pointers, *counts, values[3]])
        return context.get_dummy_value()

    return types.void(
        types.int64, arrays, types.UniTuple(types.int64, INTEGERS), types.float64
    ), code


@intrinsic
def view(typing: Any, flat: Any, start: Any, shape: Any) -> Any:
    """Numbers of an array from `start` on in a shape (a tuple of integers), C order, without count
    and check: it has to fit.

    What numpy's `reshape` does, for a tenth of the compilation.
    """
    if not (isinstance(flat, types.Array) and flat.layout == "C"):
        raise TypingError(say("entries.view", "a C-contiguous array", flat))
    kind = types.Array(flat.dtype, len(shape), "C")

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        source = context.make_array(flat)(context, builder, values[0])
        data = builder.gep(source.data, [values[1]])
        return array_at(context, builder, kind, data, cgutils.unpack_tuple(builder, values[2]))

    return kind(flat, types.intp, types.UniTuple(types.intp, len(shape))), code


def check_lapack(addresses: Any, arguments: Any) -> None:
    """Refuse at compilation what would crash at run time."""
    if not isinstance(addresses, types.Array) or not addresses.mutable:
        raise TypingError(
            say(
                "lapack",
                "ADDRESSES as an argument",
                "a constant",
                "pass lapack.ADDRESSES from Python down to the call",
            )
        )
    for kind in arguments:
        if isinstance(kind, types.Integer):
            continue
        fits = (
            isinstance(kind, types.Array)
            and kind.layout == "C"
            and kind.mutable
            and kind.dtype in (types.float64, types.int32)
        )
        if not fits:
            expected = "writable C-contiguous arrays of float64 (pivots: int32)"
            raise TypingError(say("lapack", expected, kind, "copy the array first"))


@intrinsic
def call_lapack(typing: Any, addresses: Any, routine: Any, arguments: Any) -> Any:
    """Call LAPACK with pointers to `arguments` (arrays, int8 letters, integers) and to `info`, and
    return `info`.

    Integers are put on the stack; arrays are operands of the call, which keeps them alive until it
    returns.
    """
    check_lapack(addresses, arguments)

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        byte = cgutils.voidptr_t
        pointers = []
        for kind, value in zip(arguments, cgutils.unpack_tuple(builder, values[2]), strict=True):
            if isinstance(kind, types.Array):
                pointer = context.make_array(kind)(context, builder, value).data
            else:
                width = ir.IntType(8 if kind.bitwidth == 8 else 32)
                number = builder.trunc(value, width) if kind.bitwidth > width.width else value
                pointer = cgutils.alloca_once_value(builder, number)
            pointers.append(builder.bitcast(pointer, byte))
        info = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(32), 0))
        pointers.append(builder.bitcast(info, byte))
        table = context.make_array(addresses)(context, builder, values[0]).data
        target = ir.FunctionType(ir.VoidType(), [byte] * len(pointers)).as_pointer()
        builder.call(
            builder.inttoptr(builder.load(builder.gep(table, [values[1]])), target), pointers
        )
        return builder.sext(builder.load(info), ir.IntType(64))

    return types.int64(addresses, types.int64, arguments), code


@intrinsic
def add_product(typing: Any, total: Any, a: Any, b: Any) -> Any:
    """A product added to a sum of which the order does not count.

        total + a b

    It lets the compiler use all lanes; NaN and infinity survive.
    """

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        product = builder.fmul(values[1], values[2], flags=("contract",))
        return builder.fadd(values[0], product, flags=("reassoc", "contract"))

    return (
        (total(total, a, b), code) if isinstance(total, types.Float) and total == a == b else None
    )


LANES = 8  #: sums side by side of a dot product, whatever vectors a processor has


def add_products(
    context: Any, builder: Any, kinds: Sequence[Any], values: Sequence[Any]
) -> list[Any]:
    """Code of dot products of vectors of float64 of one length with the last one of them, which is
    read once for all.

        s_l = sum_k a_(8 k + l) b_(8 k + l),    ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7)) + rest
    """
    integer = ir.IntType(64)
    vector = ir.VectorType(ir.DoubleType(), LANES)
    arrays = [
        context.make_array(kind)(context, builder, value)
        for kind, value in zip(kinds, values, strict=True)
    ]
    count = cgutils.unpack_tuple(builder, arrays[-1].shape)[0]
    full = builder.and_(count, ir.Constant(integer, -LANES))

    def add(totals: Sequence[Any], first: Any, last: Any, by: int, kind: Any) -> None:
        step = ir.Constant(integer, by)
        with cgutils.for_range_slice(builder, first, last, step, inc=True) as (k, _):
            places = (builder.gep(one.data, [k]) for one in arrays)
            numbers = [
                builder.load(builder.bitcast(place, kind.as_pointer()), align=8) for place in places
            ]
            for total, number in zip(totals, numbers[:-1], strict=True):
                product = builder.fmul(number, numbers[-1])
                builder.store(builder.fadd(builder.load(total), product), total)

    def fold(total: Any) -> Any:
        found = builder.load(total)
        s = [builder.extract_element(found, ir.Constant(ir.IntType(32), k)) for k in range(LANES)]
        halves = [builder.fadd(s[k], s[k + 4]) for k in range(4)]
        pairs = [builder.fadd(halves[k], halves[k + 1]) for k in (0, 2)]
        return cgutils.alloca_once_value(builder, builder.fadd(*pairs))

    none = ir.Constant(vector, [0.0] * LANES)
    sums = [cgutils.alloca_once_value(builder, none) for _ in arrays[:-1]]
    add(sums, ir.Constant(integer, 0), full, LANES, vector)
    totals = [fold(one) for one in sums]
    add(totals, full, count, 1, ir.DoubleType())
    return [builder.load(one) for one in totals]


@intrinsic
def dot(typing: Any, a: Any, b: Any) -> Any:
    """a . b of two vectors of float64 side by side in memory, of one length, to the bit the same on
    every processor.
    """

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return add_products(context, builder, signature.args, values)[0]

    return types.float64(a, b), code


@intrinsic
def dot_four(typing: Any, a: Any, b: Any, c: Any, d: Any, x: Any) -> Any:
    """a . x, b . x, c . x and d . x, each as `dot`, of which x is read once."""

    def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        found = add_products(context, builder, signature.args, values)
        return context.make_tuple(builder, signature.return_type, found)

    return types.UniTuple(types.float64, 4)(a, b, c, d, x), code
