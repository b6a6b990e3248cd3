r"""Saddle points: matrices bordered by constraints, built, balanced, factored and solved in one place.

    [ K  J^T ] [ x ]   [ f ]
    [ J   0  ] [ l ] = [ g ],     D A D y = D b,   z = D y,   z <- z + A^-1 (b - A z)         D_i = 1 / sqrt(max_j |A_ij|)

Balancing by D makes pivots comparable whatever the units of equations and unknowns; one step of refinement takes back what the
choice of pivots near the diagonal (little fill) costs in digits. Compiled steps and large models have factors of their own.

Source: J. R. Bunch, Equilibration of symmetric matrices in the max-norm, J. ACM 18 (1971) 566-572, doi:10.1145/321662.321670.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import block_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu

from .linalg import Array

PIVOT = 0.01  #: share of the largest entry of a column at which its diagonal entry serves as the pivot: little fill in thin plates
SINGULAR = 1e-15  #: smallest pivot, relative to the largest, of a balanced matrix that counts as regular


def matrix(K: Array, rows: Array, columns: Array | None = None) -> csr_array:
    """[[K, J^T], [J, 0]] of K (n, n) and rows J (m, n); `columns` (n, m) in place of J^T."""
    J = csr_array(rows)
    if not J.shape[0]:
        return csr_array(K)
    return csr_array(block_array([[csr_array(K), J.T if columns is None else csr_array(columns)], [J, None]]))


@dataclass(frozen=True, eq=False)
class Saddle:
    """A factored matrix."""

    matrix: csr_array  #: (n, n) A
    scale: np.ndarray  #: (n,) diagonal of D
    factors: Any  #: of D A D, rows of largest entry 1

    @property
    def regular(self) -> bool:
        """Whether no pivot is lost in round-off, as for a body free to move."""
        pivots = np.abs(self.factors.U.diagonal())
        return bool(pivots.min() > SINGULAR * pivots.max())

    @property
    def balanced(self) -> csr_array:
        """D A D."""
        return balance(self.matrix, self.scale)


def scales(A: csr_array) -> np.ndarray:
    """Diagonal (n,) of D."""
    return 1.0 / np.sqrt(np.maximum(abs(A).max(axis=1).toarray().ravel(), 1e-300))


def balance(A: csr_array, scale: np.ndarray) -> csr_array:
    """D A D, A (n, n), with D = diag(scale), scale (n,)."""
    return csr_array(diags_array(scale) @ A @ diags_array(scale))


def factor(A: csr_array, shift: float = 0.0, scale: np.ndarray | None = None) -> Saddle | None:
    """Factors of A, None where it is singular to the bit; a `shift` of the balanced diagonal lets them exist there.

    `scale` (n,) in place of the diagonal of D, where it is to say what unknowns and equations are measured in.
    """
    scale = scales(A) if scale is None else scale
    shifted = balance(A, scale) + shift * eye_array(A.shape[0]) if shift else balance(A, scale)
    options = {"SymmetricMode": True}
    try:
        factors = splu(shifted.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=PIVOT, options=options)
    except RuntimeError:
        return None
    return Saddle(A, scale, factors)


def solve(saddle: Saddle, b: np.ndarray) -> np.ndarray:
    """A^-1 b (n,) or (n, i), refined once."""
    scale = saddle.scale if b.ndim == 1 else saddle.scale[:, None]
    z = scale * saddle.factors.solve(scale * b)
    return np.asarray(z + scale * saddle.factors.solve(scale * (b - saddle.matrix @ z)))


def inverse(A: csr_array) -> Callable[[np.ndarray], np.ndarray] | None:
    """b (n,) or (n, k) -> A^-1 b, A (n, n); None where A is singular to the bit."""
    found = factor(A)
    return None if found is None else partial(solve, found)


def regular_solution(A: csr_array, b: np.ndarray) -> np.ndarray | None:
    """A^-1 b (n,) or (n, i); None where a pivot is lost in round-off, as for a body free to move."""
    found = factor(A)
    if found is None or not found.regular:
        return None
    z = solve(found, b)
    return z if np.isfinite(z).all() else None
