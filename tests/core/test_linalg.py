"""Sparse and dense arrays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, csr_matrix

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
    blocks = [csr_array(np.array([[1.0, 2.0]])), csr_array((2, 0)), csr_array((0, 1)), csr_array(np.array([[3.0], [4.0]]))]
    found = linalg.diagonal(blocks).toarray()
    np.testing.assert_array_equal(found, [[1, 2, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 3], [0, 0, 0, 4]])
