"""Ranks: repeated rows are found whatever their lengths, units, order; what follows is said with
its weights.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from fmbs_skfem.core.algebra import ranks


@given(st.integers(1, 6), st.integers(0, 4), st.integers(0, 1000))
def test_rank_and_null_space_of_repeated_rows(independent: int, repeated: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    rows = np.eye(independent, 8) + 0.1 * random.normal(size=(independent, 8))
    a = np.vstack([rows, random.normal(size=(repeated, independent)) @ rows])[
        random.permutation(independent + repeated)
    ]
    assert ranks.rank(a) == ranks.rank(csr_array(a)) == independent
    kept = a[ranks.independent_rows(a)]
    assert np.linalg.matrix_rank(kept) == len(kept) == independent
    z = ranks.null_space(a)
    assert z.shape == (8, 8 - independent)
    np.testing.assert_allclose(a @ z, 0.0, atol=1e-12)
    np.testing.assert_allclose(z.T @ z, np.eye(8 - independent), atol=1e-14)


def test_short_rows_count_as_much_as_long_ones() -> None:
    assert ranks.rank(np.diag([1e9, 1e-9])) == 2
    assert ranks.rank(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-13]])) == 1


@pytest.mark.parametrize("a", [np.zeros((0, 3)), np.zeros((2, 3))])
def test_nothing_constrains_nothing(a: np.ndarray) -> None:
    assert ranks.rank(a) == 0
    np.testing.assert_allclose(np.abs(ranks.null_space(a)), np.eye(3))


@given(st.integers(2, 5), st.integers(1, 4), st.integers(0, 1000))
def test_rows_are_parted_whatever_their_order_and_lengths(
    independent: int, repeated: int, seed: int
) -> None:
    random = np.random.default_rng(seed)
    rows = np.eye(independent, 7) + 0.1 * random.normal(size=(independent, 7))
    a = np.vstack(
        [rows, random.normal(size=(repeated, independent)) @ rows]
    ) * 10.0 ** random.integers(-6, 7, (independent + repeated, 1))
    first = np.zeros(len(a), dtype=bool)
    first[independent : independent + 2] = True
    order = random.permutation(len(a))
    base, rest, weights = ranks.part(a[order], ranks.EXACT, first[order])
    assert len(base) == independent
    assert first[order][base].sum() == min(2, repeated)
    scale = ranks.lengths(a[order][rest])[:, None]
    np.testing.assert_allclose(weights @ a[order][base] / scale, a[order][rest] / scale, atol=1e-8)


def test_columns_count_in_their_units() -> None:
    a = np.array([[1.0, 0.0], [1.0, 1e-12]])
    assert ranks.rank(a) == 1
    assert len(ranks.independent_rows(a, units=np.array([1.0, 1e12]))) == 2


def test_rows_that_are_alike_count_by_the_longest() -> None:
    noise = np.diag([1.0, 1e-13])
    assert ranks.null_space(noise).shape == (2, 0)
    np.testing.assert_allclose(np.abs(ranks.null_space(noise, alike=True)), [[0.0], [1.0]])


def test_least_norm_in_the_strongest_directions() -> None:
    a = np.diag([2.0, 1.0, 0.0])
    np.testing.assert_allclose(ranks.least(a, np.ones(3)), [0.5, 1.0, 0.0])
    np.testing.assert_allclose(ranks.least(a, np.ones(3), 1), [0.5, 0.0, 0.0])
    np.testing.assert_allclose(ranks.least(np.zeros((0, 3)), np.zeros(0)), np.zeros(3))
