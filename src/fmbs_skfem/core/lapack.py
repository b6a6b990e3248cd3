"""LAPACK inside compiled functions: A = L L^T and P A = L U, dense and banded, in place on preallocated arrays.

The addresses of the routines differ from process to process, so they are values and never constants of the compiled code: the
caller passes `ADDRESSES` as the first argument, from Python down to the call. A compiled function that uses `ADDRESSES` as a
global is refused, since its cached code would jump to addresses of another process.

LAPACK counts along columns, numpy along rows, hence a row of an array is a column of LAPACK's matrix:

    right-hand sides    (i, n)            row i is one right-hand side, replaced by its solution
    symmetric band      (n, d+1)          band[j, i-j] = A[i, j] for i = j..j+d, lower half, d sub-diagonals
    general band        (n, 2l+u+1)       band[j, l+u+i-j] = A[i, j] for i = j-u..j+l; the first l columns are room to pivot
    dense               (n, n)            matrix[j, i] = A[i, j], the transpose
    pivots              (n,) int32

All arrays are C-contiguous, numbers are float64. Every function returns LAPACK's `info`: 0 done; i > 0 the i-th pivot is zero or
the i-th leading minor is not positive (positions count from 1); -1 the shapes do not fit together, and nothing was done.
Source: E. Anderson et al., LAPACK Users' Guide, 3rd ed., SIAM 1999, doi:10.1137/1.9780898719604.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import get_cython_function_address, intrinsic

from fmbs_skfem.core.errors import say
from fmbs_skfem.core.jit import jit

_ROUTINES = ("dpbtrf", "dgbtrf", "dgbtrs", "dgetrf", "dgetrs")
_PBTRF, _GBTRF, _GBTRS, _GETRF, _GETRS = range(len(_ROUTINES))

#: addresses of the routines in this process, in the order of `_ROUTINES`
ADDRESSES: np.ndarray = np.array(
    [get_cython_function_address("scipy.linalg.cython_lapack", name) for name in _ROUTINES], dtype=np.int64
)

_LOWER, _PLAIN = ord("L"), ord("N")  #: the half of a symmetric band, and A x = b instead of A^T x = b


def _check(addresses: Any, arguments: Any) -> None:
    """Refuse at compilation what would crash at run time."""
    if not isinstance(addresses, types.Array) or not addresses.mutable:
        raise TypingError(
            say("lapack", "ADDRESSES as an argument", "a constant", "pass lapack.ADDRESSES from Python down to the call")
        )
    for kind in arguments:
        if isinstance(kind, types.Integer):
            continue
        fits = isinstance(kind, types.Array) and kind.layout == "C" and kind.mutable and kind.dtype in (types.float64, types.int32)
        if not fits:
            expected = "writable C-contiguous arrays of float64 (pivots: int32)"
            raise TypingError(say("lapack", expected, kind, "copy the array first"))


@intrinsic
def _call(typing: Any, addresses: Any, routine: Any, arguments: Any) -> Any:
    """Call LAPACK with pointers to `arguments` (arrays, int8 letters, integers) and to `info`, and return `info`.

    Integers are put on the stack; arrays are operands of the call, which keeps them alive until it returns.
    """
    _check(addresses, arguments)

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
        builder.call(builder.inttoptr(builder.load(builder.gep(table, [values[1]])), target), pointers)
        return builder.sext(builder.load(info), ir.IntType(64))

    return types.int64(addresses, types.int64, arguments), code


@jit
def pbtrf(addresses: np.ndarray, band: np.ndarray) -> int:
    """Factor a symmetric positive definite band (n, d+1) in place: A = L L^T."""
    n, width = band.shape
    return _call(addresses, _PBTRF, (np.int8(_LOWER), n, width - 1, band, width))


@jit
def gbtrf(addresses: np.ndarray, band: np.ndarray, lower: int, upper: int, pivots: np.ndarray) -> int:
    """Factor a general band (n, 2l+u+1) in place with partial pivoting: P A = L U; fills `pivots` (n,)."""
    n, width = band.shape
    if width != 2 * lower + upper + 1 or pivots.size != n:
        return -1
    return _call(addresses, _GBTRF, (n, n, lower, upper, band, width, pivots))


@jit
def gbtrs(addresses: np.ndarray, band: np.ndarray, lower: int, upper: int, pivots: np.ndarray, rhs: np.ndarray) -> int:
    """Solve A x = b in place for every row of `rhs` (i, n), with `band` and `pivots` from `gbtrf`."""
    n, width = band.shape
    if width != 2 * lower + upper + 1 or pivots.size != n or rhs.shape[1] != n:
        return -1
    return _call(addresses, _GBTRS, (np.int8(_PLAIN), n, lower, upper, rhs.shape[0], band, width, pivots, rhs, max(n, 1)))


@jit
def getrf(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray) -> int:
    """Factor the dense A, `matrix` (n, n) = A^T, in place with partial pivoting: P A = L U; fills `pivots` (n,)."""
    n = matrix.shape[0]
    if matrix.shape[1] != n or pivots.size != n:
        return -1
    return _call(addresses, _GETRF, (n, n, matrix, max(n, 1), pivots))


@jit
def getrs(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray, rhs: np.ndarray) -> int:
    """Solve A x = b in place for every row of `rhs` (i, n), with `matrix` = A^T and `pivots` from `getrf`."""
    n = matrix.shape[0]
    if matrix.shape[1] != n or pivots.size != n or rhs.shape[1] != n:
        return -1
    return _call(addresses, _GETRS, (np.int8(_PLAIN), n, rhs.shape[0], matrix, max(n, 1), pivots, rhs, max(n, 1)))
