"""Elimination of linear constraints and selection of independent rows by pivoting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.algebra import ranks
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction.spaces import pivots


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), m=st.integers(1, 6), more=st.integers(1, 10))
def test_elimination_solves_the_constraints_for_every_y(seed: int, m: int, more: int) -> None:
    rng = np.random.default_rng(seed)
    D, d = rng.standard_normal((m, m + more)), rng.standard_normal(m)
    T, x0 = pivots.eliminate(D, d)
    assert T.shape == (m + more, more)
    scale = np.linalg.norm(D) * max(np.linalg.norm(T), 1.0)
    assert np.linalg.norm(D @ T) < 1e-13 * scale
    assert np.linalg.norm(D @ x0 + d) < 1e-13 * (
        np.linalg.norm(D) * np.linalg.norm(x0) + np.linalg.norm(d)
    )
    free = np.setdiff1d(np.arange(m + more), ranks.independent_rows(D.T, alike=True))
    assert np.array_equal(T[free], np.eye(more))
    assert np.array_equal(x0[free], np.zeros(more))


def test_a_solution_is_recovered_from_its_kept_entries() -> None:
    rng = np.random.default_rng(4)
    D, x = rng.standard_normal((3, 8)), rng.standard_normal(8)
    T, x0 = pivots.eliminate(D, -D @ x)
    free = np.setdiff1d(np.arange(8), ranks.independent_rows(D.T, alike=True))
    assert np.allclose(T @ x[free] + x0, x, atol=1e-12)


def test_columns_that_nearly_vanish_are_not_chosen() -> None:
    D = np.array([[1e-12, 1.0, 0.0, 0.5, 0.0], [1e-12, 0.0, 1e-9, 0.0, 2.0]])
    indices = ranks.independent_rows(D.T, alike=True)
    assert indices.tolist() == [1, 4]
    assert np.linalg.cond(D[:, indices]) == pytest.approx(2.0)


def test_a_large_coupled_system_stays_well_conditioned() -> None:
    # two bases of falling weight at a joint: the pivots must come from the leading modes
    rng = np.random.default_rng(6)
    D = np.hstack(
        [
            rng.standard_normal((3, 20)) * 0.4 ** np.arange(20.0),
            rng.standard_normal((3, 20)) * 0.4 ** np.arange(20.0),
        ]
    )
    indices = ranks.independent_rows(D.T, alike=True)
    assert np.linalg.cond(D[:, indices]) < 20.0
    assert np.all(indices % 20 < 5)


def test_no_constraint_eliminates_nothing() -> None:
    T, x0 = pivots.eliminate(np.zeros((0, 4)), np.zeros(0))
    assert np.array_equal(T, np.eye(4))
    assert np.array_equal(x0, np.zeros(4))


@pytest.mark.parametrize("r", [2, 3])
def test_a_basis_too_small_for_the_constraints_is_refused(r: int) -> None:
    with pytest.raises(
        InputError,
        match=rf"more than 3 modes for 3 constraints, got {r} modes; the basis is too small",
    ):
        pivots.eliminate(np.eye(3, r), np.zeros(3))


def test_dependent_constraints_are_refused() -> None:
    D = np.random.default_rng(5).standard_normal((4, 9))
    D[3] = D[0] - 2.0 * D[1]
    with pytest.raises(InputError, match="4 independent constraints, got rank 3"):
        pivots.eliminate(D, np.zeros(4))
    with pytest.raises(InputError, match="rank 0"):
        pivots.eliminate(np.zeros((2, 5)), np.zeros(2))


def test_a_row_of_noise_is_refused() -> None:
    D = np.random.default_rng(5).standard_normal((3, 9))
    D[1] *= 1e-12
    with pytest.raises(InputError, match="rank 2"):
        pivots.eliminate(D, np.zeros(3))


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="NaN"):
        pivots.eliminate(np.full((1, 3), np.nan), np.zeros(1))
    with pytest.raises(InputError, match="d as 2 finite numbers"):
        pivots.eliminate(np.eye(2, 4), np.zeros(3))
    with pytest.raises(InputError, match="a matrix"):
        pivots.eliminate(np.ones(3), np.zeros(1))
    with pytest.raises(InputError, match="same constraints"):
        pivots.independent_rows([])
    with pytest.raises(InputError, match="same constraints"):
        pivots.independent_rows([np.ones((2, 3)), np.ones((3, 3))])
    with pytest.raises(InputError, match="0 < tolerance < 1"):
        pivots.independent_rows([np.eye(2)], tolerance=0.0)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rank=st.integers(1, 5),
    more=st.integers(0, 5),
    configurations=st.integers(1, 4),
)
def test_rows_kept_span_all_rows_in_every_configuration(
    seed: int, rank: int, more: int, configurations: int
) -> None:
    rng = np.random.default_rng(seed)
    mix = np.vstack([np.eye(rank), rng.uniform(-1.0, 1.0, (more, rank))])[
        rng.permutation(rank + more)
    ]
    stack = [mix @ rng.standard_normal((rank, 12)) for _ in range(configurations)]
    rows = pivots.independent_rows(stack)
    assert rows.size == rank
    assert np.all(np.diff(rows) > 0)
    whole = np.hstack(stack)
    combination = whole @ np.linalg.pinv(whole[rows])
    for jacobian in stack:
        assert np.allclose(combination @ jacobian[rows], jacobian, atol=1e-9)


def test_rows_dependent_in_one_configuration_only_are_kept() -> None:
    first = np.array([[1.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    second = np.array([[1.0, 0.0], [0.0, 1.0], [2.0, 0.0]])
    assert pivots.independent_rows([first]).tolist() == [2]
    rows = pivots.independent_rows([first, second])
    assert rows.tolist() == [1, 2]


def test_noise_below_the_threshold_is_dropped_and_above_it_kept() -> None:
    rows = np.diag([1.0, 1e-4, 1e-6])
    assert pivots.independent_rows([rows]).tolist() == [0, 1]
    assert pivots.independent_rows([rows], tolerance=1e-7).tolist() == [0, 1, 2]
    assert pivots.independent_rows([rows], tolerance=1e-3).tolist() == [0]
    assert pivots.independent_rows([np.zeros((3, 4))]).size == 0


def test_rows_that_are_first_are_kept() -> None:
    """Of two rows that are alike, and of three of which one is the sum of the others."""
    alike = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0]])
    assert pivots.independent_rows([alike]).tolist() == [1, 2]
    assert pivots.independent_rows(
        [alike], first=np.array([True, False, False, True])
    ).tolist() == [0, 3]
    assert pivots.independent_rows([alike], first=np.array([True, True, True, True])).tolist() == [
        1,
        2,
    ]
