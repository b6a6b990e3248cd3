r"""Curves through points for compiled code: cubics from point to point, constant beyond the last
ones.

    f(x) = c_i0 (x - x_i)^3 + c_i1 (x - x_i)^2 + c_i2 (x - x_i) + c_i3,    x_i <= x <= x_i+1

The numbers of a curve are: whether it is meant to hold its ends, n, x_i (n,), c (n - 1, 4).
"""

from __future__ import annotations

import numpy as np

from .jit import jit

FIRST = 2  #: number of the first place
ROUND = 1e-9  #: of a curve, beyond its ends, that is round-off


@jit
def cell(x: float, T: np.ndarray) -> int:
    """The piece in which a place is, the first or last one beyond the ends."""
    low = 0
    high = int(T[1]) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x < T[FIRST + middle]:
            high = middle
        else:
            low = middle
    return low


@jit
def lookup(x: float, T: np.ndarray) -> float:
    """The value of a curve of cubics at a place.

        ((a s + b) s + c) s + d

    with the distance s from the begin of its piece.
    """
    if x != x:
        return x
    n = int(T[1])
    x = min(max(x, T[FIRST]), T[FIRST + n - 1])
    i = cell(x, T)
    k = FIRST + n + 4 * i
    s = x - T[FIRST + i]
    return T[k + 3] + s * (T[k + 2] + s * (T[k + 1] + s * T[k]))


@jit
def lookup_slope(x: float, T: np.ndarray) -> float:
    """The slope of a curve of cubics at a place.

        (3 a s + 2 b) s + c

    At a kink that behind it, 0 beyond the ends.
    """
    n = int(T[1])
    if not T[FIRST] <= x <= T[FIRST + n - 1]:
        return 0.0
    i = cell(x, T)
    k = FIRST + n + 4 * i
    s = x - T[FIRST + i]
    return T[k + 2] + s * (2.0 * T[k + 1] + s * 3.0 * T[k])


@jit
def beyond(x: float, T: np.ndarray) -> float:
    """How far a place is beyond the ends of a curve that is not meant to hold them, 0 for round-off
    as of mod(t, period).
    """
    first, last = T[FIRST], T[FIRST + int(T[1]) - 1]
    far = max(first - x, x - last)
    return far if T[0] == 0.0 and far > ROUND * (last - first) else 0.0
