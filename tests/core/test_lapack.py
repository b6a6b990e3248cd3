"""The compiled LAPACK against scipy's own wrappers, and its cache against a second process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import TypingError
from scipy import linalg

from fmbs_skfem.core.compiling import lapack
from fmbs_skfem.core.compiling.jit import jit

A = lapack.ADDRESSES


def lower_band(matrix: np.ndarray, d: int) -> np.ndarray:
    """(n, d+1) with band[j, i-j] = A[i, j]."""
    n = len(matrix)
    band = np.zeros((n, d + 1))
    for j in range(n):
        for i in range(j, min(j + d + 1, n)):
            band[j, i - j] = matrix[i, j]
    return band


def general_band(matrix: np.ndarray, lower: int, upper: int) -> np.ndarray:
    """(n, 2l+u+1) with band[j, l+u+i-j] = A[i, j]."""
    n = len(matrix)
    band = np.zeros((n, 2 * lower + upper + 1))
    for j in range(n):
        for i in range(max(j - upper, 0), min(j + lower + 1, n)):
            band[j, lower + upper + i - j] = matrix[i, j]
    return band


def banded(n: int, lower: int, upper: int, seed: int) -> np.ndarray:
    """A nonsymmetric band matrix without diagonal dominance, so that rows are exchanged."""
    return np.triu(np.tril(np.random.default_rng(seed).normal(size=(n, n)), upper), -lower)


@pytest.mark.parametrize(("n", "d"), [(1, 0), (7, 0), (40, 5), (6, 5)])
def test_symmetric_band(n: int, d: int) -> None:
    root = banded(n, d, 0, seed=n) + 5.0 * np.eye(n)
    matrix = root @ root.T
    band = lower_band(matrix, d)
    assert lapack.pbtrf(A, band) == 0
    np.testing.assert_allclose(
        band, linalg.cholesky_banded(lower_band(matrix, d).T, lower=True).T, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(("n", "lower", "upper"), [(1, 0, 0), (30, 2, 5), (30, 4, 1), (25, 24, 24)])
def test_general_band(n: int, lower: int, upper: int) -> None:
    matrix, rhs = banded(n, lower, upper, seed=3), np.random.default_rng(2).normal(size=(2, n))
    band, pivots = general_band(matrix, lower, upper), np.zeros(n, np.int32)
    expected = linalg.solve_banded((lower, upper), np.ascontiguousarray(band[:, lower:].T), rhs.T).T
    assert lapack.gbtrf(A, band, lower, upper, pivots) == 0
    assert lapack.gbtrs(A, band, lower, upper, pivots, rhs) == 0
    scale = np.linalg.cond(matrix)
    np.testing.assert_allclose(rhs, expected, rtol=0, atol=1e-14 * scale * abs(expected).max())


def test_dense() -> None:
    n = 20
    stored, rhs = (
        np.random.default_rng(4).normal(size=(n, n)),
        np.random.default_rng(5).normal(size=(4, n)),
    )
    matrix, pivots = stored.copy(), np.zeros(n, np.int32)
    assert lapack.getrf(A, matrix, pivots) == 0
    factor, exchanged = linalg.lu_factor(stored.T)
    np.testing.assert_allclose(matrix.T, factor, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(pivots - 1, exchanged)
    plain = rhs.copy()
    assert lapack.getrs(A, matrix, pivots, plain) == 0
    np.testing.assert_allclose(plain, np.linalg.solve(stored.T, rhs.T).T, rtol=1e-10, atol=1e-12)


def test_info_names_the_first_bad_pivot() -> None:
    pivots = np.zeros(3, np.int32)
    assert lapack.pbtrf(A, lower_band(np.diag([1.0, 2.0, -1.0]), 0)) == 3
    assert lapack.gbtrf(A, general_band(np.diag([1.0, 0.0, 1.0]), 1, 1), 1, 1, pivots) == 2
    assert lapack.getrf(A, np.diag([1.0, 1.0, 0.0]), pivots) == 3


def test_shapes_that_do_not_fit_are_refused() -> None:
    pivots, short = np.zeros(3, np.int32), np.zeros((1, 2))
    assert lapack.gbtrf(A, np.ones((3, 3)), 1, 1, pivots) == -1
    assert lapack.gbtrs(A, np.ones((3, 4)), 1, 1, pivots, short) == -1
    assert lapack.getrf(A, np.ones((3, 3)), pivots[:2]) == -1
    assert lapack.getrs(A, np.ones((3, 3)), pivots, short) == -1


def test_nothing_to_solve() -> None:
    assert lapack.getrf(A, np.zeros((0, 0)), np.zeros(0, np.int32)) == 0
    assert lapack.getrs(A, np.eye(3), np.arange(1, 4, dtype=np.int32), np.zeros((0, 3))) == 0


WRONG = {
    "columns": np.ones((4, 4)).T,
    "strided": np.ones((4, 8))[:, ::2],
    "single": np.ones((4, 4), np.float32),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG.keys())
def test_arrays_that_lapack_would_misread_are_refused(wrong: np.ndarray) -> None:
    with pytest.raises(TypingError, match="C-contiguous arrays of float64"):
        lapack.getrf(A, wrong, np.zeros(4, np.int32))


def test_addresses_as_a_constant_are_refused() -> None:
    @jit
    def frozen(band: np.ndarray) -> int:
        return lapack.pbtrf(A, band)

    with pytest.raises(TypingError, match=r"pass lapack\.ADDRESSES from Python"):
        frozen(np.ones((3, 1)))


def test_local_arrays_live_until_the_call_returns() -> None:
    @jit
    def residual(addresses: np.ndarray, matrix: np.ndarray, rhs: np.ndarray) -> float:
        worst = 0.0
        for _ in range(200):
            x, lu = rhs.copy(), matrix.copy()
            pivots = np.empty(len(matrix), np.int32)
            info = lapack.getrf(addresses, lu, pivots) + lapack.getrs(addresses, lu, pivots, x)
            worst = max(worst, abs(info) + np.abs(x @ matrix - rhs).max())
        return worst

    matrix = np.random.default_rng(6).normal(size=(12, 12)) + 6.0 * np.eye(12)
    assert residual(A, matrix, np.ones((2, 12))) < 1e-13


USER = """
import numpy as np
from fmbs_skfem.core.compiling import lapack
from fmbs_skfem.core.compiling.jit import jit

@jit
def factor(addresses, band):
    return lapack.pbtrf(addresses, band)

band = np.full((4, 1), 4.0)
assert factor(lapack.ADDRESSES, band) == 0 and np.all(band == 2.0)
print(sum(factor.whole.stats.cache_hits.values()), sum(factor.whole.stats.cache_misses.values()))
"""


def test_a_second_process_loads_from_the_cache(tmp_path: Path) -> None:
    script = tmp_path / "user.py"
    script.write_text(USER)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run() -> str:
        return subprocess.run(
            [sys.executable, script], env=environment, capture_output=True, text=True, check=True
        ).stdout.strip()

    assert [run(), run()] == ["0 1", "1 0"]
