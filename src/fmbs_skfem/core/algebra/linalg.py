"""Sparse or dense? The one module where that is asked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import scipy.linalg
import scipy.sparse
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

Array: TypeAlias = np.ndarray | csr_array


def is_sparse(a: Any) -> bool:
    """Whether `a` is one of scipy's sparse arrays or matrices."""
    return bool(scipy.sparse.issparse(a))


def as_csr(a: Any) -> csr_array:
    """`a` (i, j), sparse or dense, as a csr_array: itself where it is one already, which saves 6 us
    a call.
    """
    return a if isinstance(a, csr_array) else csr_array(a)


def as_dense(a: Any) -> np.ndarray:
    """`a` (i, j), sparse or dense, as a numpy array (i, j) of float64; no copy where it is one
    already.
    """
    return np.asarray(a.toarray() if is_sparse(a) else a, dtype=np.float64)


def distinct(values: ArrayLike) -> np.ndarray:
    """Numbers (i,) that occur in an array of any shape, ascending, as `np.unique` has them, which
    hashes integers since numpy 2.3.

    Sorting 4e6 keys of matrix entries takes an eighth of the time, and arrays of any size less.
    """
    array = np.sort(np.asarray(values), axis=None)
    return array[np.append(True, array[1:] != array[:-1])] if len(array) else array


def evenly(first: int, last: int, count: int) -> np.ndarray:
    """At most `count` whole numbers (i,) from `first` to `last`, evenly spread, ascending."""
    return distinct(np.linspace(first, last, count).round().astype(np.int64))


def scaled(A: Array, rows: np.ndarray, columns: np.ndarray) -> Array:
    """A (i, j), sparse or dense as it is, with scaled rows and columns.

        rows_i A_ij columns_j

    rows (i,), columns (j,).
    """
    if is_sparse(A):
        A = csr_array(A)
        if not A.has_canonical_format:
            A = A.copy()  # what is scaled has the same indices, which nothing may order then
            A.sum_duplicates()
        data = np.repeat(rows, np.diff(A.indptr))
        data *= A.data
        data *= columns[A.indices]
        return csr_array((data, A.indices, A.indptr), shape=A.shape)
    return np.asarray(rows[:, None] * A * columns)


def row_maxima(A: Array) -> np.ndarray:
    """max_j |A_ij| (m,) of A (m, n); 0 of rows without an entry."""
    if not is_sparse(A):
        return np.asarray(np.abs(A).max(axis=1, initial=0.0))
    A = csr_array(A)
    found = np.zeros(A.shape[0])
    used = np.flatnonzero(np.diff(A.indptr))
    if len(used):
        starts = A.indptr[used]
        found[used] = np.maximum(
            np.maximum.reduceat(A.data, starts), -np.minimum.reduceat(A.data, starts)
        )
    return found


def support(A: np.ndarray) -> slice:
    """Smallest range of columns of A (i, j) that holds all non-zeros."""
    used = np.flatnonzero(np.abs(A).max(axis=0) > 0)
    return slice(int(used[0]), int(used[-1]) + 1) if len(used) else slice(0, 0)


def is_zero(A: Array) -> bool:
    """Whether A (i, j) is zero: sparse without entries, or dense without others than zeros."""
    return A.nnz == 0 if isinstance(A, csr_array) else not as_dense(A).any()


def narrowed(A: Array) -> tuple[Array, np.ndarray | slice]:
    """A (i, j) without its columns that have no entries, and the others (k,); all of a dense one.

    A few rows that read a few numbers of long vectors (s, j) are the faster for it: a product with
    all of these turns them first.
    """
    if not is_sparse(A):
        return A, slice(None)
    A = as_csr(A)
    used = distinct(A.indices)
    return csr_array(
        (A.data.copy(), np.searchsorted(used, A.indices), A.indptr.copy()),
        shape=(A.shape[0], len(used)),
    ), used


def is_identity(a: Any) -> bool:
    """Whether a sparse matrix is the identity to the bit."""
    return a.shape[0] == a.shape[1] and a.nnz == a.shape[0] and bool((a.diagonal() == 1.0).all())


def alike(a: csr_array, count: int) -> csr_array:
    """A matrix that acts on every one of `count` components of vectors alike.

        a (x) I

    a (n, n), the result (n c, n c).
    """
    a = as_csr(a)
    a.sum_duplicates()
    long = np.diff(a.indptr)
    kind = np.int32 if count * max(a.nnz, a.shape[1]) < 2**31 else np.int64
    first = np.arange(a.nnz, dtype=kind) + np.repeat(
        ((count - 1) * a.indptr[:-1]).astype(kind), long
    )
    step = np.repeat(long.astype(kind), long)
    data = np.empty(count * a.nnz)
    indices = np.empty(count * a.nnz, kind)
    for component in range(count):
        place = first + kind(component) * step
        data[place], indices[place] = a.data, kind(count) * a.indices.astype(kind) + kind(component)
    indptr = np.concatenate([[0], np.cumsum(np.repeat(long, count))]).astype(kind)
    return csr_array((data, indices, indptr), shape=(count * a.shape[0], count * a.shape[1]))


def mirrored(low: csr_array) -> csr_array:
    """The symmetric matrix (n, n) of a lower triangle (n, n)."""
    above = low.T.tocsr()
    above.setdiag(0.0)
    return csr_array(low + above)


def diagonal(blocks: Sequence[csr_array]) -> csr_array:
    """Sparse blocks (i, j) along the diagonal, row by row, without a list of all rows and columns;
    a single one as it is.
    """
    if len(blocks) == 1:
        return blocks[0]
    rows, columns = (
        np.concatenate([[0], np.cumsum([block.shape[k] for block in blocks])]) for k in range(2)
    )
    entries = np.concatenate([[0], np.cumsum([block.nnz for block in blocks])])
    indices = np.concatenate(
        [block.indices + first for block, first in zip(blocks, columns, strict=False)]
    )
    indptr = np.concatenate(
        [[0], *(block.indptr[1:] + first for block, first in zip(blocks, entries, strict=False))]
    )
    return csr_array(
        (np.concatenate([block.data for block in blocks]), indices, indptr),
        shape=(int(rows[-1]), int(columns[-1])),
    )


def stacked(blocks: Sequence[csr_array]) -> csr_array:
    """Sparse blocks (i, j) of equal width one below the other, in a third of the time of `vstack`;
    a single one as it is.
    """
    if len(blocks) == 1:
        return blocks[0]
    entries = np.cumsum([0, *(len(block.indices) for block in blocks)])
    indptr = np.concatenate(
        [[0], *(block.indptr[1:] + first for block, first in zip(blocks, entries, strict=False))]
    )
    data, indices = (
        np.concatenate([getattr(block, name) for block in blocks]) for name in ("data", "indices")
    )
    return csr_array((data, indices, indptr), shape=(len(indptr) - 1, blocks[0].shape[1]))


def entries(A: Array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and values (z,) of the entries of a sparse A (m, n), row by row, or of all
    numbers of a dense one.

    In a fifth of the time of `tocoo`; the arrays may be those of A.
    """
    if isinstance(A, np.ndarray):
        i, j = np.indices(A.shape).reshape(2, -1)
        return i, j, A.ravel()
    A = as_csr(A)
    return np.repeat(np.arange(A.shape[0]), np.diff(A.indptr)), A.indices, A.data


def rows_at(A: Array, numbers: np.ndarray) -> Array:
    """Rows (i,) of A (m, n) in any order, A[numbers]; of a sparse one in half of the time."""
    if isinstance(A, np.ndarray):
        return A[numbers]
    long = np.diff(A.indptr)[numbers]
    starts = np.append(0, np.cumsum(long))
    entry = np.arange(starts[-1]) + np.repeat(A.indptr[numbers] - starts[:-1], long)
    return csr_array((A.data[entry], A.indices[entry], starts), shape=(len(numbers), A.shape[1]))


def selection(numbers: ArrayLike, size: int) -> csr_array:
    """Rows (i, size) that read the entries `numbers` (i,) of a vector."""
    columns = np.asarray(numbers, dtype=np.int64)
    starts = np.arange(len(columns) + 1)
    return csr_array((np.ones(len(columns)), columns, starts), shape=(len(columns), size))


def others(count: int, some: np.ndarray) -> np.ndarray:
    """Numbers (i,) from 0 to `count` - 1 that are not among `some` (k,), ascending."""
    free = np.ones(count, dtype=bool)
    free[some] = False
    return np.flatnonzero(free)


def squares(v: np.ndarray, M: Array) -> np.ndarray:
    """Squared norms (i,) of columns v (n, i), which may be complex.

        v_i^H M v_i

    in a symmetric matrix M (n, n).
    """
    return np.asarray(np.real(np.sum(np.conj(v) * (M @ v), axis=0)))
