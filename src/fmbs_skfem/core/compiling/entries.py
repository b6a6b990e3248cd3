"""Compiled functions that others call by address, so that only what a model needs is compiled.

    @entry
    def stress_at(u, rate, section, S, way, points, cells, law, beta) -> None      four pointers, four integers, one number
    call(address, (u, rate, section, S), (0, points, cells, law), beta)          inside compiled code

    A = view(x, at, (m, n))     the m n numbers of the array x from x[at] on, counted row by row, as a matrix that owns nothing

A function that is called by name becomes part of its caller and is compiled again with every
caller. One that is called by address is compiled once, when its address is asked for. Addresses
differ from process to process: they are values, never constants.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import say
from .jit import PLAIN, addressed, deferred, inlined

POINTERS, INTEGERS = 4, 4  #: pointers to numbers and integers of an entry
ENTRY = ctypes.CFUNCTYPE(
    None, *[ctypes.c_void_p] * POINTERS, *[ctypes.c_int64] * INTEGERS, ctypes.c_double
)
LANES = 32  #: points whose moduli are computed side by side
SIGNATURE = f"void({'CPointer(float64), ' * POINTERS}{'int64, ' * INTEGERS}float64)"


def entry(function: Callable[..., None]) -> Callable[[], int]:
    """The address of `function` as a function of nothing: compiled when it is first asked for,
    cached on disk.
    """

    @functools.cache
    def compiled() -> Any:
        return addressed(SIGNATURE, function, apart=True)

    return lambda: int(compiled().address)


def call_now(
    address: int, arrays: tuple[np.ndarray, ...], integers: tuple[int, ...], number: float
) -> None:
    """`call` from Python, without numba, which takes 0.3 s to load: arrays of float64, contiguous,
    the last one is written.
    """
    if PLAIN:
        call(address, arrays, integers, number)
        return
    for array in arrays:
        if array.dtype != np.float64 or not array.flags.c_contiguous:
            raise TypeError(
                say(
                    "entry",
                    "contiguous arrays of float64",
                    f"{array.dtype} {array.shape}, strides {array.strides}",
                )
            )
    ENTRY(address)(*(array.ctypes.data for array in arrays), *integers, number)


@inlined
def unfold(T: np.ndarray, first: int, D: np.ndarray, onto: bool) -> None:
    """Write symmetric entries for the LANES points q from `first` on, from T (i (i + 1)/2 + j, k);
    add them if `onto`.

        D[i, j, q] = D[j, i, q] = T[i (i + 1)/2 + j, q - first],    j <= i

    Rows of T are apart by a constant, which lets a loop that writes them all become vector
    instructions.
    """
    count = min(LANES, D.shape[2] - first)
    row = 0
    for i in range(D.shape[0]):
        for j in range(i + 1):
            for k in range(count):
                D[i, j, first + k] = D[j, i, first + k] = (
                    T[row, k] + D[i, j, first + k] if onto else T[row, k]
                )
            row += 1


call = deferred("fmbs_skfem.core.compiling.intrinsics", "call")
view = deferred("fmbs_skfem.core.compiling.intrinsics", "view")
