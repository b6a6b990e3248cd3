r"""Which rows are independent: the one place where ranks are decided.

    A^T P = Q R,    |R[k, k]| distance of a row to the span of those before it    rank = number of |R[k, k]| > tolerance |R[0, 0]|

by QR with column pivoting of the transpose (P. Businger, G. H. Golub, Numer. Math. 7, 1965,
doi:10.1007/BF01436084). Rows count relative to their own length, so that neither the unit of an
equation nor its number matters; columns in units of their own, where they have several (lengths
beside slopes), are given by `units`, changes of the unknowns that count alike.

A tolerance says how well rows are known, and is named by where they come from. Arrays: rows (m, n)
of m equations, n unknowns.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr
from scipy.linalg.lapack import dgeqp3
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu

from .linalg import Array, as_dense, distinct

EXACT = 1e-9  #: exact but for round-off: linear rows, traces of edges, Jacobians of a computed state; sums of some 1e6 entries
CLOSED = 1e-8  #: nonlinear rows in a position that an iteration has moved onto the joints, to some 1e-11 of its size
STATED = 1e-6  #: rows on rigid motions: scenes state places and axes to some six digits
NEAR = 1e-5  #: rows where the joints hold to some digits only: a start as it is stated, states in a trained space
NOISE = 1e-12  #: weight of an unknown in another one, in units of both, that counts as zero
CLEAR = 1e-10  #: least pivot of the normal equations, relative to the largest, of columns that are independent without doubt
BLOCK = 32  #: columns that LAPACK takes at once


def lengths(a: np.ndarray) -> np.ndarray:
    """Lengths (m,) of rows, 1 for rows of zeros."""
    found = np.linalg.norm(a, axis=1)
    return np.where(found > 0.0, found, 1.0)


def unit_rows(a: np.ndarray) -> np.ndarray:
    """Rows of a (m, n) scaled to length 1.

        a_i / |a_i|

    Rows of zeros stay.
    """
    return np.asarray(a / lengths(a)[:, None])


def pivots(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows (min(m, n),) that pivoting takes first, and their distances to the span of those
    before, falling.
    """
    if not a.size:
        return np.zeros(0, np.int64), np.zeros(0)
    room = 2 * len(a) + BLOCK * (len(a) + 1)
    triangle, order, *_ = dgeqp3(np.asarray_chkfinite(a.T), lwork=room)
    found = np.abs(np.diag(triangle))
    return order[: len(found)].astype(np.int64) - 1, found


def independent_rows(
    a: Array, tolerance: float = EXACT, units: np.ndarray | float = 1.0, alike: bool = False
) -> np.ndarray:
    """Sorted indices of a largest set of independent rows of `a` (m, n); rows that are `alike`
    count by the longest of them.
    """
    rows = as_dense(a) * units
    order, found = pivots(rows if alike else unit_rows(rows))
    return np.sort(order[found > tolerance * found.max(initial=0.0)])


def rank(a: Array, tolerance: float = EXACT) -> int:
    """Number of independent rows of `a` (m, n)."""
    return len(independent_rows(a, tolerance))


def null_space(a: Array, tolerance: float = EXACT, alike: bool = False) -> np.ndarray:
    """Orthonormal columns Z (n, n - rank) of the null space of a matrix.

        a Z = 0

    a (m, n).
    """
    rows = as_dense(a)
    rows = np.asarray(np.linalg.qr(rows, mode="r")) if alike and len(rows) > rows.shape[1] else rows
    rows = rows[independent_rows(rows, tolerance, alike=alike)]
    return (
        np.ascontiguousarray(qr(rows.T, mode="full")[0][:, len(rows) :])
        if len(rows)
        else np.eye(a.shape[1])
    )


def part(
    a: np.ndarray, tolerance: float, first: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Independent rows (i,) of a, the others (j,), and how these follow.

        a[others] = weights @ a[independent],    weights (j, i)

    Rows that are `first` (m,) are among the independent ones as far as they can be.
    """
    size = lengths(a)
    unit = left = a / size[:, None]
    chosen: list[np.ndarray] = []
    ahead = np.zeros(len(a), dtype=bool) if first is None else first
    for group in (np.flatnonzero(ahead), np.flatnonzero(~ahead)):
        order, found = pivots(left[group])
        chosen.append(group[order[found > tolerance]])
        Q = (
            qr(unit[np.concatenate(chosen)].T, mode="economic")[0]
            if len(chosen[-1])
            else np.zeros((a.shape[1], 0))
        )
        left = left - (left @ Q) @ Q.T
    base = np.sort(np.concatenate(chosen))
    rest = np.setdiff1d(np.arange(len(a)), base)
    weights = np.zeros((len(rest), len(base)))
    if weights.size:
        weights = (
            np.linalg.lstsq(unit[base].T, unit[rest].T, rcond=None)[0].T
            * size[rest, None]
            / size[base]
        )
    return base, rest, weights


def least(a: np.ndarray, b: np.ndarray, directions: int | None = None) -> np.ndarray:
    """The solution x (n,) of least norm in the strongest `directions` of a, in all that are above
    round-off by default.

        a x = b,    |x| -> min

    Of several right-hand sides b (m, k) it is x (n, k).
    """
    U, s, V = np.linalg.svd(a, full_matrices=False)
    kept = int((s > EXACT * s.max(initial=0.0)).sum())
    kept = kept if directions is None else min(directions, kept)
    return np.asarray(V[:kept].T @ ((U[:, :kept].T @ b).T / s[:kept]).T)


def determined(
    A: csr_array, first: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unknowns that A q = 0 determines by the others.

        q[first] + X q[second] = 0

    first (i,), second (j,), X (i, j). Most traces of edges have independent columns, which the
    pivots of their sparse normal equations show; others take a dense QR. Unknowns that are `first`
    (n,) are determined rather than others.
    """
    used = distinct(A.indices[A.data != 0.0])
    columns = csr_array(A[:, used])
    size = np.asarray(abs(columns).max(axis=0).todense()).ravel()
    if regular_columns(csr_array(columns @ diags_array(1.0 / size))):
        return used, used[:0], np.zeros((len(used), 0))
    some, others, weights = part(columns.toarray().T, EXACT, None if first is None else first[used])
    weights[np.abs(weights) * size[some] < NOISE * size[others, None]] = 0.0
    return used[some], used[others], weights.T


def regular_columns(columns: csr_array) -> bool:
    """Whether the columns of C (i, j) are independent: pivots of C^T C, squares of distances to
    columns before, are large.
    """
    try:
        factors = splu(
            (columns.T @ columns).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:
        return False
    pivots = factors.U.diagonal()
    return bool(pivots.min() > CLEAR * pivots.max())
