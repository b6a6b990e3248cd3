"""Saddle points: built, balanced and solved whatever their units; what has no solution is told."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from fmbs_skfem.core.algebra import saddle
from fmbs_skfem.core.algebra.linalg import as_dense


def parts(n: int = 12, m: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(0)
    root = random.normal(size=(n, n))
    return root @ root.T, random.normal(size=(m, n)), random.normal(size=n + m)


@pytest.mark.parametrize("unit", [1.0, 1e8, 1e-8])
def test_solutions_do_not_depend_on_units(unit: float) -> None:
    K, J, b = parts()
    units = np.where(np.arange(len(b)) % 2, unit, 1.0)
    A = saddle.matrix(units[:12, None] * K * units[:12], units[12:, None] * J * units[:12])
    found = saddle.regular_solution(A, units * b)
    assert found is not None
    exact = np.linalg.solve(np.block([[K, J.T], [J, np.zeros((3, 3))]]), b)
    np.testing.assert_allclose(found * units, exact, rtol=1e-10)


def test_borders_may_differ_and_several_right_hand_sides_share_factors() -> None:
    K, J, b = parts()
    A = saddle.matrix(csr_array(K), J, 2.0 * J.T)
    np.testing.assert_array_equal(as_dense(A), np.block([[K, 2.0 * J.T], [J, np.zeros((3, 3))]]))
    factors = saddle.factor(A)
    assert factors is not None
    both = saddle.solve(factors, np.column_stack([b, -2.0 * b]))
    np.testing.assert_allclose(A @ both, np.column_stack([b, -2.0 * b]), atol=1e-12)


def test_without_rows_the_matrix_stays() -> None:
    K = parts()[0]
    np.testing.assert_array_equal(saddle.matrix(K, np.zeros((0, 12))), K)


def test_what_is_singular_has_no_solution_but_shifted_factors() -> None:
    free = csr_array(np.diag([1.0, 2.0, 0.0]))
    assert saddle.factor(free) is None
    assert saddle.inverse(free) is None
    assert saddle.factor(free, 1e-13) is not None
    chain = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0 + 1e-16]]))
    assert saddle.regular_solution(chain, np.ones(2)) is None


def test_small_matrices_are_dense_and_solved_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """LAPACK and SuperLU: solutions, those of the transpose, and what has none."""
    K, J, b = parts()
    found = []
    for small in (saddle.SMALL, 0):
        monkeypatch.setattr(saddle, "SMALL", small)
        A = saddle.matrix(csr_array(K), csr_array(J), 2.0 * J.T)
        assert isinstance(A, np.ndarray) == (small > 0)
        factors = saddle.factor(A)
        assert factors is not None
        assert factors.regular
        found.append(
            [
                saddle.solve(factors, b),
                factors.factors.solve(b, trans="T"),
                as_dense(factors.balanced) @ b,
            ]
        )
        assert saddle.factor(saddle.matrix(csr_array(K), np.zeros((1, 12)))) is None
    for dense, sparse in zip(*found, strict=True):
        np.testing.assert_allclose(dense, sparse, rtol=1e-9)
