"""Sparse and dense arrays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, csr_matrix, random_array

from fmbs_skfem.core.algebra import linalg


def test_dense_arrays_are_not_copied() -> None:
    a = np.eye(3)
    assert linalg.as_dense(a) is a
    assert linalg.as_dense(np.eye(2, dtype=int)).dtype == np.float64
    assert [linalg.is_sparse(b) for b in (a, csr_array(a), csr_matrix(a))] == [False, True, True]


@pytest.mark.parametrize("values", [[], [3], [[5, -1, 5], [0, -1, 7]], [2.5, -0.5, 2.5]])
def test_distinct_numbers_are_those_of_numpy(values: list[object]) -> None:
    found, expected = linalg.distinct(values), np.unique(values)
    np.testing.assert_array_equal(found, expected)
    assert found.dtype == expected.dtype


@pytest.mark.parametrize("count", [1, 2, 3])
def test_alike_is_the_product_with_the_identity(count: int) -> None:
    a = csr_array(np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [3.0, -1.0, 4.0], [0.0, 0.0, 5.0]]))
    found = linalg.alike(a, count)
    np.testing.assert_array_equal(found.toarray(), np.kron(a.toarray(), np.eye(count)))
    assert found.nnz == count * a.nnz


def test_blocks_along_a_diagonal_of_sparse_arrays() -> None:
    blocks = [
        csr_array(np.array([[1.0, 2.0]])),
        csr_array((2, 0)),
        csr_array((0, 1)),
        csr_array(np.array([[3.0], [4.0]])),
    ]
    found = linalg.diagonal(blocks).toarray()
    np.testing.assert_array_equal(
        found, [[1, 2, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 3], [0, 0, 0, 4]]
    )


def test_short_ways_to_entries_and_rows_give_what_scipy_gives() -> None:
    """Also where rows are empty, unsorted, or asked for twice."""
    rng = np.random.default_rng(3)
    A = csr_array(random_array((7, 5), density=0.4, rng=rng))
    A = csr_array((A.data[::-1].copy(), A.indices, A.indptr), shape=A.shape)
    i, j, values = linalg.entries(A)
    found = np.zeros(A.shape)
    np.add.at(found, (i, j), values)
    np.testing.assert_array_equal(found, A.toarray())
    i, j, values = linalg.entries(A.toarray())
    np.testing.assert_array_equal(values.reshape(A.shape), A.toarray()[i, j].reshape(A.shape))
    numbers = np.array([6, 0, 3, 3, 1])
    np.testing.assert_array_equal(linalg.rows_at(A, numbers).toarray(), A.toarray()[numbers])
    np.testing.assert_array_equal(linalg.rows_at(A, numbers[:0]).toarray(), np.zeros((0, 5)))
    np.testing.assert_array_equal(
        linalg.stacked([A, A[:0], A[2:3]]).toarray(), np.vstack([A.toarray(), A.toarray()[2:3]])
    )
    np.testing.assert_array_equal(linalg.others(6, np.array([5, 0, 0, 2])), [1, 3, 4])
    assert linalg.as_csr(A) is A
    np.testing.assert_array_equal(linalg.as_csr(A.toarray()).toarray(), A.toarray())
