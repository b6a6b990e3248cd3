"""Sparse or dense? The one module where that is asked, and the rank of a set of linear constraints.

    A P = Q R,    rank = number of |R[i, i]| > tolerance |R[0, 0]|

by QR with column pivoting (P. Businger, G. H. Golub, Numer. Math. 7, 1965, doi:10.1007/BF01436084).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import scipy.linalg
import scipy.sparse
from scipy.sparse import csr_array

Array: TypeAlias = np.ndarray | csr_array

TOLERANCE = 1e-10  #: relative size of a pivot that counts as zero [-]


def is_sparse(a: Any) -> bool:
    """Whether `a` is one of scipy's sparse arrays or matrices."""
    return bool(scipy.sparse.issparse(a))


def as_dense(a: Any) -> np.ndarray:
    """`a` as a numpy array of float64; no copy where it is one already."""
    return np.asarray(a.toarray() if is_sparse(a) else a, dtype=np.float64)


def as_sparse(a: Any) -> csr_array:
    """`a` as a csr_array of float64, equal entries summed and sorted by column; matrices of other libraries become arrays here."""
    sparse = csr_array(a, dtype=np.float64)
    sparse.sum_duplicates()
    return sparse


def is_identity(a: Any) -> bool:
    """Whether a sparse matrix is the identity to the bit."""
    return a.shape[0] == a.shape[1] and a.nnz == a.shape[0] and bool((a.diagonal() == 1.0).all())


def mirrored(low: csr_array) -> csr_array:
    """The symmetric matrix of a lower triangle."""
    above = low.T.tocsr()
    above.setdiag(0.0)
    return csr_array(low + above)


def block_diag(blocks: Sequence[Array]) -> Array:
    """Blocks along the diagonal: dense where all are dense, sparse otherwise; blocks without rows or without columns count too."""
    if any(is_sparse(block) for block in blocks):
        return csr_array(scipy.sparse.block_diag([as_sparse(block) for block in blocks], format="csr"))
    return np.asarray(scipy.linalg.block_diag(*blocks))


def independent_rows(a: Array, tolerance: float = TOLERANCE) -> np.ndarray:
    """Sorted indices of a largest set of linearly independent rows of `a` (m, n); every row counts relative to its own length."""
    rows = as_dense(a)
    length = np.linalg.norm(rows, axis=1)
    used = np.flatnonzero(length > 0.0)
    if used.size == 0:
        return used
    triangle, order = scipy.linalg.qr((rows[used] / length[used, None]).T, mode="r", pivoting=True)
    pivots = np.abs(np.diag(triangle))
    return np.sort(used[order[: np.count_nonzero(pivots > tolerance * pivots[0])]])


def rank(a: Array, tolerance: float = TOLERANCE) -> int:
    """Number of linearly independent rows of `a` (m, n)."""
    return int(independent_rows(a, tolerance).size)


def null_space(a: Array, tolerance: float = TOLERANCE) -> np.ndarray:
    """Orthonormal columns Z (n, n - rank) with a Z = 0."""
    rows = as_dense(a)[independent_rows(a, tolerance)]
    q, _ = scipy.linalg.qr(rows.T, mode="full")
    return np.ascontiguousarray(q[:, len(rows) :])
