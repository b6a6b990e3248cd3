"""Factors of dense and band matrices against SciPy's, and motions that need both kinds of dense
ones.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from fmbs_skfem.core.compiling import lapack
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.dynamics.compiled_step import factors
from fmbs_skfem.systems.forces import loads

from .. import models
from .test_checkpoint import all_modes, stopped


def positive(n: int, width: int) -> np.ndarray:
    """A symmetric positive definite band matrix with `width` diagonals on and below the main one."""
    root = np.tril(
        np.triu(np.random.default_rng(n).normal(size=(n, n)), 1 - width), 0
    ) + 4.0 * np.eye(n)
    return root @ root.T


@pytest.mark.parametrize(
    ("n", "width"),
    [(1, 1), (3, 2), (9, 4), (9, 5), (23, 6), (24, 9), (25, 17), (26, 25), (27, 27), (8, 12)],
)
def test_solutions_with_bands(n: int, width: int) -> None:
    """Bands of all widths, those that reach the last unknown early among them; (8, 12) has rows
    that are longer than the matrix.
    """
    matrix, b = positive(n, width), np.random.default_rng(1).normal(size=n)
    band = np.full((n, width), np.nan)
    for j in range(n):
        band[j, : min(width, n - j)] = matrix[j : j + width, j]
    inside = band[:, : min(width, n)].copy()
    assert lapack.pbtrf(lapack.ADDRESSES, inside) == 0
    band[:, : min(width, n)] = inside
    band[:, 0] = 1.0 / band[:, 0]
    x = b.copy()
    factors.substitute(band, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize(("first", "last"), [(0, 13), (0, 5), (5, 13), (3, 4)])
def test_solutions_with_dense_blocks(first: int, last: int) -> None:
    """A block of a dense matrix is factored in place by its lower half; nothing else of the matrix
    is touched.
    """
    n = 13
    matrix, b = positive(n, n), np.random.default_rng(2).normal(size=last - first)
    room = np.append(matrix.ravel(), np.zeros(n + 1))
    half = room[first * (n + 1) : last * (n + 1)].reshape(last - first, n + 1)
    assert lapack.potrf(lapack.ADDRESSES, half) == 0
    after = room[: n * n].reshape(n, n)
    block = np.s_[first:last, first:last]
    np.testing.assert_allclose(
        np.triu(after[block]).T, linalg.cholesky(matrix[block], lower=True), rtol=1e-12, atol=1e-13
    )
    changed = after != matrix
    changed[block] &= ~np.triu(np.ones((last - first, last - first), bool))
    assert not changed.any()
    half[:, 0] = 1.0 / half[:, 0]
    factors.substitute(half, b)
    np.testing.assert_allclose(
        matrix[block] @ b, np.random.default_rng(2).normal(size=last - first), atol=1e-12
    )


@pytest.mark.parametrize(
    ("force", "step", "steps", "kind"),
    [(5.0, 1e-4, 300, factors.DENSE_CHOLESKY), (-60.0, 0.15, 12, factors.DENSE_LU)],
)
def test_dense_matrices_that_are_indefinite_are_factored_as_well(
    force: float, step: float, steps: int, kind: int
) -> None:
    """A column that is pulled, and one that stands under 24 times its critical load: motions are
    those of the band.
    """
    system = models.cantilever(
        4, lambda tip: [loads.PointForce("push", tip, (force, 0.0), lambda t: 1.0 + t)]
    )
    dense, scheme = all_modes(system), GeneralizedAlpha(step, start="equilibrium")
    part = stopped(dense, 1, scheme, steps)
    assert part.checkpoint.arrays["kind"][2] == kind
    run, band = (integrate(one, scheme, steps * step) for one in (dense, system))
    np.testing.assert_allclose(run.x, band.x, atol=1e-9)
    assert np.abs(run.x - run.x[0]).max() > 1e-7
