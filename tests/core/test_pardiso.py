"""PARDISO against the factors of this package; what is said where the package is not installed."""

from __future__ import annotations

import gc
import importlib.util
import weakref

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array, diags_array, kron

from fmbs_skfem.core.algebra import direct, pardiso
from fmbs_skfem.core.errors import InputError, MissingFeature, Reason, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate

from ..dynamics.test_large import hanging

HERE = importlib.util.find_spec("pypardiso") is not None
needed = pytest.mark.skipif(not HERE, reason="the extra pardiso is not installed")


def grid(n: int, shift: float = 0.0) -> csr_array:
    """The five-point Laplacian on n x n points, less a shift."""
    line = diags_array(
        [np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], offsets=[-1, 0, 1]
    )
    one = diags_array(np.ones(n))
    return csr_array(kron(line, one) + kron(one, line) - shift * diags_array(np.ones(n * n)))


@needed
@pytest.mark.parametrize("shift", [0.0, 1.3])
def test_solutions_of_definite_and_indefinite_matrices(shift: float) -> None:
    A, b = grid(30, shift), np.random.default_rng(0).normal(size=(3, 900))
    factors = pardiso.factor(A)
    assert_allclose(
        pardiso.solve(factors, b), direct.solve(direct.factor(A), b.copy()), rtol=1e-9, atol=1e-11
    )
    assert factors.numbers > A.nnz / 2


@needed
def test_a_matrix_without_an_inverse_is_refused() -> None:
    A = csr_array(grid(3) * 0.0 + diags_array([*np.ones(8), 0.0]))
    with pytest.raises(SolverError, match="pardiso") as caught:
        pardiso.factor(A)
    assert caught.value.reason is Reason.SINGULAR_TANGENT


@needed
def test_factors_are_freed_and_others_stay() -> None:
    A, b = grid(20), np.ones((1, 400))
    first, second = pardiso.factor(A), pardiso.factor(2.0 * A)
    gone, expected = weakref.ref(first), pardiso.solve(second, b)
    del first
    gc.collect()
    assert gone() is None
    assert_allclose(pardiso.solve(second, b), expected, rtol=0)


@needed
def test_a_large_model_moves_as_with_own_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    system, scheme = hanging(), GeneralizedAlpha(2e-4)
    own, other = (
        integrate(system, scheme, 4e-3, Newton(tolerance=1e-12, solver=name))
        for name in ("own", "pardiso")
    )
    assert other.statistics.solver.startswith("PARDISO LDL^T")
    assert_allclose(other.x, own.x, atol=1e-10 * system.scale)


@pytest.mark.skipif(HERE, reason="the extra pardiso is installed")
def test_the_missing_package_is_named() -> None:
    with pytest.raises(
        MissingFeature,
        match=r"the package pypardiso, got none; pip install 'fmbs_skfem\[pardiso\]'",
    ) as caught:
        Newton(solver="pardiso")
    assert caught.value.exit_code == 7


def test_solvers_are_known_by_name() -> None:
    with pytest.raises(InputError, match=r"newton.solver: expected own or pardiso, got mumps"):
        Newton(solver="mumps")  # type: ignore[arg-type]
