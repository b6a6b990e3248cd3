"""Matrices of a system in the storage that compiled code reads, in an order of the unknowns of
small bandwidth.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from ..core.algebra.linalg import Array, as_csr, entries, rows_at
from .kernels import Csr, Operator


def constant(A: Array, store: np.ndarray, dense: bool, by_rows: bool, dim: int) -> Operator:
    """A constant matrix A (n, n) in the storage of its product.

    `store` is A in the storage of the iteration matrix. The product reads rows where `by_rows`, or
    where the storage is `dense` and A = B (x) I over vectors of `dim` components; `store` of other
    dense ones that are not diagonal; else diagonals.
    """
    i, j, values = nonzeros(A)
    none = Csr(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0))
    alone = bool((i == j).all())
    used = len(values) > 0
    if by_rows or (dense and not alone) or not used:
        rows, components = vectorwise(A, dim) if used else (none, 1)
        full = bool(dense and used and components == 1)
        return Operator(
            np.zeros(0, np.int64),
            np.zeros((0, len(store))),
            none if full else rows,
            components,
            store,
            full,
        )
    offsets, k = np.unique(j.astype(np.int64) - i, return_inverse=True)
    data = np.zeros((len(offsets), A.shape[0]))
    np.add.at(data, (k, i), values)
    return Operator(offsets, data, none, 1, store, False)


def nonzeros(A: Array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and values (z,) of what is not zero in A (m, n), row by row of a dense one."""
    if isinstance(A, np.ndarray):
        i, j = np.nonzero(A)
        return i, j, A[i, j]
    row, column, values = entries(A)
    used = values != 0.0
    return row[used], column[used], values[used]


def vectorwise(A: Array, dim: int) -> tuple[Csr, int]:
    """A (n, n), or B with A = B (x) I over vectors of `dim` components where it has that form.

    Beside it stands the number of components that a row serves, 1 or `dim`.
    """
    if A.shape[0] % dim == 0:
        if not isinstance(A, np.ndarray):
            A.sum_duplicates()
        i, j, values = nonzeros(A)  # row by row, each from its first column on
        axis = i % dim
        found = [(i[axis == c] // dim, j[axis == c] // dim, values[axis == c]) for c in range(dim)]
        if (j % dim == axis).all() and all(
            np.array_equal(a, b) for one in found[1:] for a, b in zip(found[0], one, strict=True)
        ):
            row, column, values = found[0]
            indptr = np.append(0, np.cumsum(np.bincount(row, minlength=A.shape[0] // dim)))
            return Csr(indptr, column.astype(np.int64), values), dim
    return triple(A), 1


def triple(A: Array) -> Csr:
    """A matrix (m, n) as compiled code reads it, sparse or dense: without zeros of a dense one.

    Entries of a sparse one that stand more than once are added.
    """
    if isinstance(A, np.ndarray):  # what scipy's constructor finds, in a tenth of its time
        i, j, values = nonzeros(A)
        return Csr(np.searchsorted(i, np.arange(len(A) + 1)), np.ascontiguousarray(j), values)
    A = as_csr(A)
    A.sum_duplicates()
    return Csr(A.indptr.astype(np.int64), A.indices.astype(np.int64), A.data.astype(float))


def permuted(A: Array, order: np.ndarray, rows: bool = False) -> Array:
    """Columns (and rows) of A (m, n) in the new order (n,): A[:, order] (and A[order])."""
    if (np.diff(order) == 1).all():
        return A
    if isinstance(A, np.ndarray):
        A = A[:, order]
        return A[order] if rows else A
    place = np.argsort(order)
    A = as_csr(A)
    # numbers of its own: its rows are sorted in place later
    A = csr_array(
        (A.data.copy(), place[A.indices], A.indptr.copy()), shape=(A.shape[0], len(order))
    )
    return rows_at(A, order) if rows else A


def band_order(pattern: csr_array) -> tuple[np.ndarray, int]:
    """The better of the natural and the reverse Cuthill-McKee order (n,) of a symmetric pattern (n,
    n), and its half bandwidth.
    """

    def width(order: np.ndarray) -> int:
        place = np.argsort(order)
        return int(np.abs(place[row] - place[column]).max(initial=0))

    row, column, _ = entries(pattern)

    natural = np.arange(pattern.shape[0])
    # for compiled routines
    packed = np.ascontiguousarray(reverse_cuthill_mckee(pattern, symmetric_mode=True), np.int64)
    return (natural, width(natural)) if width(natural) <= width(packed) else (packed, width(packed))


def lower_band(A: csr_array | np.ndarray, place: np.ndarray, width: int) -> np.ndarray:
    """Lower band (n, width + 1) of a symmetric A (n, n), whose unknown k is at place[k].

        band[j, i - j] = A[i, j] for i >= j, places of unknowns

    Entries above the diagonal are not read.
    """
    row, column, values = entries(A)
    i, j = place[row], place[column]
    band = np.zeros((len(place), width + 1))
    low = (i >= j) & (values != 0.0)
    np.add.at(band, (j[low], (i - j)[low]), values[low])
    return band


def from_lower_band(band: np.ndarray, order: np.ndarray) -> csr_array:
    """The symmetric sparse array (n, n) of a lower band (n, d + 1), whose place k is unknown
    order[k].

        band[j, i - j] = A[i, j]

    i >= j.
    """
    n = len(band)
    j, below = np.nonzero(band)
    on = j + below < n
    j = j[on]
    below = below[on]
    i = order[j + below]
    values = band[j, below]
    off = below > 0
    j = order[j]
    places = np.concatenate([i, j[off]]), np.concatenate([j, i[off]])
    return csr_array((np.concatenate([values, values[off]]), places), shape=(n, n))
