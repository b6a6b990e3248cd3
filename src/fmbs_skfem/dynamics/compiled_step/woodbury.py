r"""Factors of W + U V^T from those of W, by the terms of low rank of `systems.forces.low_rank`.

    (W + U V^T)^-1 = W^-1 - Z (1 + V^T Z)^-1 V^T W^-1 = (1 + Z V^T)^-1 W^-1,    Z = W^-1 U

by the smaller of the two matrices in brackets. Few pieces of beams touch at a time: their rows cost
as many solutions with W as they have columns, and the factors of W stay those of a narrow symmetric
band.

Source: Hager, SIAM Rev. 31 (1989) 221-239, doi 10.1137/1031049.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling import lapack
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ...systems import kernels
from ...systems.forces import low_rank
from .step import opened

#: rows that W^-1 is applied to: the front of the right-hand side, J, and U^T
RHS, JOINTS, COLUMNS = (
    0,
    1,
    2,
)


@jit
def rank_of(table: Any) -> int:
    """Number of columns of U."""
    # terms that act in this state: where nothing touches, corrections cost nothing
    low = opened(table).space.low
    return low.used[0] * low.left.shape[1]


@jit
def rows_of(table: Any, which: int) -> np.ndarray:
    """RHS, JOINTS or COLUMNS, shape (k, n)."""
    S = opened(table)
    n = len(S.space.x)
    # views, no copies: the routines of a storage take any of the three
    return (
        S.work.spread
        if which == JOINTS
        else view(S.space.rhs, 0, (1, n))
        if which == RHS
        else view(S.work.lows, 0, (rank_of(table), n))
    )


@routine
def fill(table: Any, _: Any) -> int:
    """The rows of `lows` become those of U^T."""
    S = opened(table)
    low = S.space.low
    Z = S.work.lows
    rank = S.space.low.left.shape[1]
    for k in range(low.used[0]):
        for i in range(rank):
            row = Z[rank * k + i]
            # rows are those of other pieces in every state
            row[:] = 0.0
            low_rank.add_column(S.arrays.probes, low.rows[k], low.left[k, i], row)
    return 0


@routine
def close(table: Any, _: Any) -> int:
    """Factors of what terms of low rank add to W.

        1 + V^T Z    or    1 + Z V^T,    Z = W^-1 U

    from the rows Z^T of `lows`; 0, or LAPACK's info.
    """
    S = opened(table)
    w = S.work
    low = S.space.low
    rank = rank_of(table)
    n = len(S.space.x)
    # the smaller one: beams that touch at very many nodes cost no more than dense factors
    size = min(rank, n)
    A = view(w.inner, 0, (size, size))
    v = np.empty(n)
    kernels.clear_rows(A)
    for a in range(rank):
        if rank <= n:
            low_rank.read_terms(low, S.arrays.probes, w.lows[a], A[a])
            continue
        k = a // low.right.shape[1]
        i = a % low.right.shape[1]
        kernels.clear(v)
        low_rank.add_column(S.arrays.probes, low.rows[k], low.right[k, i], v)
        for j in range(n):
            # columns of V have entries of two pieces alone
            if v[j] != 0.0:
                for b in range(n):
                    A[j, b] += v[j] * w.lows[a, b]
    for a in range(size):
        # U and V differ, so that neither matrix is symmetric: LU below
        A[a, a] += 1.0
    return lapack.getrf(w.addresses, A, w.inner_pivots[:size])


@routine
def correct(table: Any, which: Any) -> int:
    """Solutions with the factors of W become those with the terms of low rank, too.

        (W + U V^T)^-1

    in RHS or JOINTS, as `which` says.
    """
    S = opened(table)
    w = S.work
    n = len(S.space.x)
    rank = rank_of(table)
    if rank == 0:
        return 0
    room = np.empty(len(w.lows))
    found = view(room, 0, (1, rank))
    size = min(rank, n)
    rows = rows_of(table, which)
    A = view(w.inner, 0, (size, size))
    if rank > n:
        # here the small system is that of the unknowns: it acts on whole rows
        return lapack.getrs(w.addresses, A, w.inner_pivots[:size], rows)
    for k in range(len(rows)):
        low_rank.read_terms(S.space.low, S.arrays.probes, rows[k], found[0])
        lapack.getrs(w.addresses, A, w.inner_pivots[:rank], found)
        # Z is kept since the factors were made: r sums of length n, no further solution with W
        for a in range(rank):
            for i in range(n):
                rows[k, i] -= found[0, a] * w.lows[a, i]
    return 0
