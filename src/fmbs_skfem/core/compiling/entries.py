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

from .jit import addressed, deferred, inlined

POINTERS, INTEGERS = 4, 4  #: pointers to numbers and integers of an entry
LANES = 32  #: points whose moduli are computed side by side
SIGNATURE = f"void({'CPointer(float64), ' * POINTERS}{'int64, ' * INTEGERS}float64)"


def entry(function: Callable[..., None]) -> Callable[[], int]:
    """The address of `function` as a function of nothing: compiled when it is first asked for, cached on disk."""

    @functools.cache
    def compiled() -> Any:
        return addressed(SIGNATURE, function, apart=True)

    return lambda: int(compiled().address)


@inlined
def unfold(T: np.ndarray, first: int, D: np.ndarray, onto: bool) -> None:
    """D[i, j, q] = D[j, i, q] for the LANES points q from `first` on, from T (i (i + 1)/2 + j, k), j <= i; += if `onto`.

    Rows of T are apart by a constant, which lets a loop that writes them all become vector instructions.
    """
    count, row = min(LANES, D.shape[2] - first), 0
    for i in range(D.shape[0]):
        for j in range(i + 1):
            for k in range(count):
                D[i, j, first + k] = D[j, i, first + k] = T[row, k] + D[i, j, first + k] if onto else T[row, k]
            row += 1


call = deferred("fmbs_skfem.core.compiling.intrinsics", "call")
view = deferred("fmbs_skfem.core.compiling.intrinsics", "view")
