"""Compiled functions that others call by address, so that only what a model needs is compiled.

    @entry
    def stress_at(u, rate, section, S, rows, points, cells, law, beta) -> None      four pointers, four integers, one number
    call(address, (u, rate, section, S), (rows, points, cells, law), beta)          inside compiled code

    A = view(x, at, (m, n))     the m n numbers of the array x from x[at] on, counted row by row, as a matrix that owns nothing

A function that is called by name becomes part of its caller and is compiled again with every caller. One that is called by address
is compiled once, when its address is asked for. Addresses differ from process to process: they are values, never constants.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, compiler
from numba.core.errors import TypingError
from numba.extending import intrinsic

from .errors import say
from .jit import addressed, inlined
from .structs import array_at

POINTERS, INTEGERS = 4, 4
LANES = 32  #: points whose moduli are computed side by side
SIGNATURE = types.void(*POINTERS * (types.CPointer(types.float64),), *INTEGERS * (types.int64,), types.float64)


class Apart(compiler.Compiler):
    """Compiles functions whose pointers do not overlap where one is written: loops become vector instructions without checks."""

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()


def entry(function: Callable[..., None]) -> Callable[[], int]:
    """The address of `function` as a function of nothing: compiled when it is first asked for, cached on disk."""

    @functools.cache
    def compiled() -> Any:
        return addressed(SIGNATURE, function, pipeline_class=Apart)

    return lambda: int(compiled().address)


@inlined
def unfold(T: np.ndarray, first: int, D: np.ndarray) -> None:
    """D[i, j, q] = D[j, i, q] for the LANES points q from `first` on, from T (i (i + 1)/2 + j, k), j <= i.

    Rows of T are apart by a constant, which lets a loop that writes them all become vector instructions.
    """
    count, row = min(LANES, D.shape[2] - first), 0
    for i in range(D.shape[0]):
        for j in range(i + 1):
            for k in range(count):
                D[i, j, first + k] = T[row, k]
                D[j, i, first + k] = T[row, k]
            row += 1


@intrinsic
def call(typing: Any, address: Any, arrays: Any, integers: Any, number: Any) -> Any:
    """Call the entry at an address with the data of four arrays of float64, four integers and a number."""
    numbers = [kind for kind in arrays if isinstance(kind, types.Array) and kind.dtype == types.float64 and kind.layout == "C"]
    if len(numbers) != POINTERS or len(arrays) != POINTERS or len(integers) != INTEGERS:
        expected = f"{POINTERS} C-contiguous arrays of float64 and {INTEGERS} integers"
        raise TypingError(say("entries.call", expected, f"{arrays} and {integers}"))

    def code(context: Any, builder: Any, signature: Any, values: Any) -> None:
        pointers = [
            builder.bitcast(context.make_array(kind)(context, builder, value).data, ir.DoubleType().as_pointer())
            for kind, value in zip(arrays, cgutils.unpack_tuple(builder, values[1]), strict=True)
        ]
        counts = cgutils.unpack_tuple(builder, values[2])
        kinds = [value.type for value in (*pointers, *counts, values[3])]
        target = ir.FunctionType(ir.VoidType(), kinds).as_pointer()
        builder.call(builder.inttoptr(values[0], target), [*pointers, *counts, values[3]])
        return context.get_dummy_value()

    return types.void(types.int64, arrays, types.UniTuple(types.int64, INTEGERS), types.float64), code


@intrinsic
def view(typing: Any, flat: Any, start: Any, shape: Any) -> Any:
    """Numbers of an array from `start` on in a shape (a tuple of integers), C order, without count and check: it has to fit.

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
