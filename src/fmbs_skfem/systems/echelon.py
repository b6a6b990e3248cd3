r"""Linear constraints solved for some of their unknowns: A x + a = 0 becomes x_d = S x_rest + s.

Rows that share no unknown are solved apart: an edge of a plate has as many small systems as it has nodes. Each one is eliminated by
Gauss and Jordan with full pivoting, which finds the same pivots as the elimination of all rows together would.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, vstack
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True)
class Echelon:
    """x[dependent] = solution @ x + fixed; `solution` has no entries in the columns of dependent unknowns."""

    dependent: np.ndarray  #: (i,) unknowns
    solution: csr_array  #: (i, n)
    fixed: np.ndarray  #: (i,)
    left: np.ndarray  #: (k,) rows that are combinations of the others
    gap: np.ndarray  #: (k,) what those rows miss: zero, or they contradict the others


def solve(A: csr_array, a: np.ndarray, tolerance: float) -> Echelon:
    """Echelon form of A x + a = 0; pivots are larger than `tolerance` times the largest entry, entries of S larger than it."""
    limit = tolerance * max(float(abs(A).max()), 1e-300)
    labels = connected_components(csr_array(abs(A) @ abs(A).T), directed=False)[1]
    order = np.argsort(labels, kind="stable")
    blocks = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    parts = [solve_block(A, a, rows, limit, tolerance) for rows in blocks]
    return Echelon(
        np.concatenate([part.dependent for part in parts]),
        csr_array(vstack([part.solution for part in parts])),
        np.concatenate([part.fixed for part in parts]),
        np.concatenate([part.left for part in parts]),
        np.concatenate([part.gap for part in parts]),
    )


def solve_block(A: csr_array, a: np.ndarray, rows: np.ndarray, limit: float, tolerance: float) -> Echelon:
    """Echelon form of some rows that share no unknown with the others."""
    used, work = dense(A, rows)
    pivots, left, right = eliminated(work, -a[rows], limit)
    first, mine = np.array(pivots, dtype=np.int64).reshape(-1, 2).T
    others = np.setdiff1d(np.arange(len(used)), mine)
    S = -work[np.ix_(first, others)]
    S[np.abs(S) <= tolerance] = 0.0
    i, j = np.nonzero(S)
    solution = csr_array((S[i, j], (i, used[others[j]])), shape=(len(mine), A.shape[1]))
    return Echelon(used[mine], solution, right[first], rows[left], right[left])


def dense(A: csr_array, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The columns that some rows use, and the block of those rows and columns."""
    spans = [slice(A.indptr[row], A.indptr[row + 1]) for row in rows]
    used = np.unique(np.concatenate([A.indices[span] for span in spans]))
    block = np.zeros((len(rows), len(used)))
    for k, span in enumerate(spans):
        np.add.at(block[k], np.searchsorted(used, A.indices[span]), A.data[span])
    return used, block


def eliminated(work: np.ndarray, right: np.ndarray, limit: float) -> tuple[list[tuple[int, int]], list[int], np.ndarray]:
    """Gauss and Jordan's elimination with full pivoting in place: pivots (row, column), rows without one, right-hand side."""
    pivots: list[tuple[int, int]] = []
    left = [*range(len(work))]
    while left and work.size:
        i, j = np.unravel_index(np.argmax(np.abs(work[left])), (len(left), work.shape[1]))
        row = left[i]
        if abs(work[row, j]) <= limit:
            break
        left.remove(row)
        pivots.append((row, int(j)))
        right[row] /= work[row, j]
        work[row] /= work[row, j]
        hit = np.flatnonzero(work[:, j])
        hit = hit[hit != row]
        right[hit] -= work[hit, j] * right[row]
        work[hit] -= np.outer(work[hit, j], work[row])
    return pivots, left, right
