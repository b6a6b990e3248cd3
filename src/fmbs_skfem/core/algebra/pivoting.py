r"""Which rows are independent, in compiled code: the decisions of `ranks`, by the method of Gram and
Schmidt with pivoting.

    a_i / |a_i| = sum_k L_ik q_k,    |L_kk| distance of a row to the span of those taken before it

Of all rows the farthest one is taken next, of those as far the first one, whatever round-off says;
what is left of a row is made orthogonal to all before it once more, as a near one has lost that.

Source: Bjorck, Numerical Methods for Least Squares Problems, SIAM 1996, section 2.4 (modified
Gram-Schmidt, reorthogonalisation), doi 10.1137/1.9781611971484.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling.jit import deferred, jit
from ..compiling.structs import Integers, Matrix, Vector

#: groups of rows that are left out, and of those that were taken; others are above 0
OUT, TAKEN = 0, -1
# round-off of unit rows is 1e-16: any number well above it makes compiled code of all machines take
# the same of rows that are as far
ALIKE = 1e-9  #: of the square of a distance, within which rows are as far

dot = deferred("fmbs_skfem.core.compiling.intrinsics", "dot")


class PivotedRows(NamedTuple):
    """m rows of n numbers, and what is found of them."""

    unit: Matrix  #: (m, n) a_i / |a_i| or what is left of it; q_k in rows that were taken
    lengths: Vector  #: (m,) |a_i|, 1 for rows of zeros
    group: Integers  #: (m,)
    order: Integers  #: (m,) rows in the order in which they are taken
    shares: Matrix  #: (m, m) L, a column for each row that is taken


def room_for(m: int, n: int) -> PivotedRows:
    """Room for m rows of n numbers."""
    return PivotedRows(
        unit=np.zeros((m, n)),
        lengths=np.ones(m),
        group=np.zeros(m, np.int64),
        order=np.zeros(m, np.int64),
        shares=np.zeros((m, m)),
    )


@jit
def scale_rows(rows: PivotedRows) -> None:
    """Rows a become those of length 1, and their lengths known."""
    for i in range(len(rows.unit)):
        row = rows.unit[i]
        length = np.sqrt(dot(row, row))
        rows.lengths[i] = length if length != 0.0 else 1.0
        for j in range(len(row)):
            row[j] /= rows.lengths[i]


@jit
def take_rows(rows: PivotedRows, group: int, count: int, least: float) -> int:
    """Take rows of a group that are farther than `least` from the span of the `count` that were
    taken before; how many are now.

    Those that depend on them stay in the group.
    """
    for k in range(count, len(rows.unit)):
        best = farthest(rows, group, least)
        if best < 0:
            return k
        rows.order[k], rows.group[best] = best, TAKEN
        q = rows.unit[best]
        rows.shares[best, k] = normalise(q)
        for p in range(k):
            subtract(rows.unit[rows.order[p]], q)
        normalise(q)
        for i in range(len(rows.unit)):
            # rows of later groups, too, whose turn comes behind
            if rows.group[i] > OUT:
                rows.shares[i, k] = subtract(q, rows.unit[i])
    return len(rows.unit)


@jit
def farthest(rows: PivotedRows, group: int, least: float) -> int:
    """The row of a group of which most is left, more than `least`; -1 where none is."""
    best = -1
    most = least * least
    for i in range(len(rows.unit)):
        if rows.group[i] == group:
            square = dot(rows.unit[i], rows.unit[i])
            if square > (1.0 + ALIKE) * most:
                best, most = i, square
    return best


@jit
def normalise(q: np.ndarray) -> float:
    """q (n,) becomes one of length 1; its length before."""
    length = np.sqrt(dot(q, q))
    for j in range(len(q)):
        q[j] /= length
    return float(length)


@jit
def subtract(q: np.ndarray, x: np.ndarray) -> float:
    """x (n,) loses its share of a q (n,) of length 1, which is returned."""
    share = dot(q, x)
    for j in range(len(q)):
        x[j] -= share * q[j]
    return float(share)


@jit
def find_weights(rows: PivotedRows, count: int) -> None:
    """How rows that depend on the `count` that were taken follow from them, in place of their
    shares.

        a_i = sum_k w_ik a_order[k]
    """
    for i in range(len(rows.unit)):
        if rows.group[i] > OUT:
            weights = rows.shares[i]
            for k in range(count - 1, -1, -1):
                for p in range(k + 1, count):
                    weights[k] -= weights[p] * rows.shares[rows.order[p], k]
                weights[k] /= rows.shares[rows.order[k], k]
            for k in range(count):
                weights[k] *= rows.lengths[i] / rows.lengths[rows.order[k]]
