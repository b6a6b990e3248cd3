r"""Derivatives of forces on few probe rows, others in every state: the sum of L_k^T R_k on the rows
of a term k.

    H = - c (dF/dy + gh dF/dy'),    W += sum U_k V_k^T,    U_k = P_k^T L_k^T,    V_k = P_k^T R_k^T                            (6)

Forces between places that travel, as of beams that meet anywhere, have no pairs of rows that are
known beforehand, and all of them would make W dense. In a dense W they are added; bands and blocks
are factored without them, see `dynamics.compiled_step.woodbury`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import Cube, IntegerMatrix, Integers
from .. import kernels
from ..kernels import Csr


class LowRank(NamedTuple):
    """Terms of the derivatives of a state, k of them.

        H = L^T R

    on q probe rows each and of rank r.
    """

    used: Integers  #: (1,) how many there are
    rows: IntegerMatrix  #: (k, q)
    left: Cube  #: (k, r, q)
    right: Cube  #: (k, r, q)


class Size(NamedTuple):
    """What a force needs at most: terms k, probe rows q of a term, and its rank r."""

    terms: int
    rows: int
    rank: int


NONE = Size(0, 0, 0)


def room(sizes: list[Size]) -> LowRank:
    """Space for the terms of all forces, of which none are used yet.

    It has the sum of their terms, each with as many rows and ranks as the largest of them.
    """
    terms = sum(one.terms for one in sizes)
    rows, rank = (max((one[k] for one in sizes), default=0) for k in (1, 2))
    return LowRank(
        np.zeros(1, np.int64), np.zeros((terms, rows), np.int64), *np.zeros((2, terms, rank, rows))
    )


@jit
def add_column(P: Csr, rows: np.ndarray, values: np.ndarray, x: np.ndarray) -> None:
    """Add values (q,) on some `rows` (q,) of the probe matrix P (j, n) to unknowns.

        x += P^T values

    x (n,).
    """
    for j in range(len(rows)):
        # rows of two pieces, most of whose weights are zero in one of d, A_p and B_q
        if values[j] != 0.0:
            for p in range(P.indptr[rows[j]], P.indptr[rows[j] + 1]):
                x[P.indices[p]] += values[j] * P.data[p]


@jit
def read_terms(low: LowRank, P: Csr, x: np.ndarray, out: np.ndarray) -> None:
    """Products of all terms with unknowns x (n,).

        out = V^T x,    V_k = P_k^T R_k^T    (n, r)

    out (k r,).
    """
    rank, many = low.right.shape[1], low.right.shape[2]
    y = np.empty(many)
    for k in range(low.used[0]):
        for j in range(many):
            # rows of a term are read once for all of its ranks
            y[j] = kernels.row_value(P, low.rows[k, j], x)
        for i in range(rank):
            out[rank * k + i] = kernels.dot(low.right[k, i], y)


@jit
def add_dense(low: LowRank, P: Csr, W: np.ndarray) -> None:
    """Add all terms to a dense matrix.

        W += sum U_k V_k^T,    U_k = P_k^T L_k^T,    V_k = P_k^T R_k^T

    W (n, n), U_k and V_k (n, r).
    """
    u, v = np.empty(len(W)), np.empty(len(W))
    for k in range(low.used[0]):
        for i in range(low.left.shape[1]):
            kernels.clear(u)
            kernels.clear(v)
            add_column(P, low.rows[k], low.left[k, i], u)
            add_column(P, low.rows[k], low.right[k, i], v)
            for a in range(len(W)):
                # columns have entries of two pieces: most rows of W are not touched
                if u[a] != 0.0:
                    for b in range(len(W)):
                        W[a, b] += u[a] * v[b]


def entries(low: LowRank) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (h, 2) of probe rows and H (h,) of all terms that are used, q^2 a term; pairs come more
    than once and add up.
    """
    count = int(low.used[0])
    many = low.rows.shape[1]
    rows = low.rows[:count]
    # for Python, as modes and reports: a step never forms U V^T
    pairs = np.stack([np.repeat(rows, many, axis=1), np.tile(rows, (1, many))], axis=2).reshape(
        -1, 2
    )
    return pairs, np.einsum("kri,krj->kij", low.left[:count], low.right[:count]).ravel()
