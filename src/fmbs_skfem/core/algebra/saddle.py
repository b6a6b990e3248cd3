r"""Saddle points: matrices bordered by constraints, built, balanced, factored and solved in one
place.

    [ K  J^T ] [ x ]   [ f ]
    [ J   0  ] [ l ] = [ g ],     D A D y = D b,   z = D y,   z <- z + A^-1 (b - A z)         D_i = 1 / sqrt(max_j |A_ij|)

Balancing by D makes pivots comparable whatever the units of equations and unknowns; one step of
refinement takes back what the choice of pivots near the diagonal (little fill) costs in digits.
Small matrices, and those of a dense K, are dense: SuperLU takes 2 ms for 8 unknowns, LAPACK 0.05
ms, and as long at some 200. Large symmetric ones have factors L D L^T of their own, of

    K' = K + G^T G,    S = G K'^-1 G^T,    x = K'^-1 (f + G^T (w g - l)),    S l = G K'^-1 (f + w G^T g) - w g,    G = w J

(a solid of 107 163 unknowns: 7.3 s, SuperLU 62 s at 40 077), since K alone may be singular where
joints hold it; w J is felt by a motion of a thousand cells. Compiled steps and large models have factors of their own.

Sources: J. R. Bunch, Equilibration of symmetric matrices in the max-norm, J. ACM 18 (1971) 566-572,
doi:10.1145/321662.321670; M. Benzi, G. H. Golub, J. Liesen, Acta Numerica 14 (2005) 1-137,
doi:10.1017/S0962492904000212, section 6 (augmented saddle points).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal, Protocol

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import block_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ..errors import SolverError
from ..storage.records import dataclass
from . import direct, supernodes
from .linalg import Array, as_dense, is_sparse, row_maxima, scaled

SMALL = 200  #: unknowns and rows up to which a sparse matrix is as fast as a dense one
PIVOT = 0.01  #: share of the largest entry of a column at which its diagonal entry serves as the pivot: little fill in thin plates
#: smallest pivot, relative to the largest, of a balanced matrix that counts as regular
SINGULAR = 1e-15
# plates of 5000 unknowns take as long by both
LARGE = 6000  #: unknowns from which symmetric matrices are factored in supernodes
# a bar that may turn where its rim shears has a pivot of -5e-9 with 1, of 1e-3 with 100
WEIGHT = 100.0  #: w of rows of joints beside K
ROWS = 400  #: rows of J up to which S is dense beside it
ALIKE = 1e-12  #: difference of an entry of a balanced matrix from that of its transpose that is round-off


def matrix(K: Array, rows: Array, columns: Array | None = None) -> Array:
    """The saddle point matrix of K (n, n) and rows J (m, n); `columns` (n, m) in place of J^T.

        [[K, J^T], [J, 0]]

    Dense where it is small, or K is.
    """
    m, n = rows.shape
    if n + m <= SMALL or not is_sparse(K):
        A = np.zeros((n + m, n + m))
        A[:n, :n], A[n:, :n], A[:n, n:] = (
            as_dense(part) for part in (K, rows, rows.T if columns is None else columns)
        )
        return A
    J = csr_array(rows)
    return csr_array(
        block_array([[csr_array(K), J.T if columns is None else csr_array(columns)], [J, None]])
        if m
        else K
    )


class LU(Protocol):
    """L U of a matrix (n, n) with its rows and columns in some order."""

    def solve(self, b: np.ndarray, trans: Literal["N", "T"] = "N") -> np.ndarray:
        """The solution (n,) or (n, i), of the transpose with "T"."""

    def pivots(self) -> np.ndarray:
        """Diagonal (n,) of U."""


@dataclass(frozen=True)
class Sparse:
    """`LU` of SuperLU."""

    found: SuperLU

    def solve(self, b: np.ndarray, trans: Literal["N", "T"] = "N") -> np.ndarray:
        return np.asarray(self.found.solve(b, trans=trans))

    def pivots(self) -> np.ndarray:
        return np.asarray(self.found.U.diagonal())


@dataclass(frozen=True)
class Dense:
    """`LU` of LAPACK."""

    found: np.ndarray  #: (n, n)
    order: np.ndarray  #: (n,) of its rows

    def solve(self, b: np.ndarray, trans: Literal["N", "T"] = "N") -> np.ndarray:
        return np.asarray(dgetrs(self.found, self.order, b, trans=int(trans == "T"))[0])

    def pivots(self) -> np.ndarray:
        return np.asarray(self.found.diagonal())


@dataclass(frozen=True)
class Bordered:
    """`LU` of a large symmetric saddle point by factors of K' and of S."""

    inside: direct.Factors  #: of K' (k, k)
    rows: csr_array  #: G (m, k)
    reach: np.ndarray  #: G K'^-1 (m, k)
    complement: np.ndarray  #: S (m, m)

    def solve(self, b: np.ndarray, trans: Literal["N", "T"] = "N") -> np.ndarray:
        f, g = np.split(b.reshape(len(b), -1), [self.rows.shape[1]])
        g = WEIGHT * g
        x = direct.solve(self.inside, np.ascontiguousarray((f + self.rows.T @ g).T)).T
        multipliers = np.linalg.solve(self.complement, self.rows @ x - g)
        found = x - self.reach.T @ multipliers, WEIGHT * multipliers
        return np.vstack(found).reshape(b.shape)

    def pivots(self) -> np.ndarray:
        """Those of K', and the eigenvalues of - S."""
        return np.append(self.inside.pivots, -np.linalg.eigvalsh(self.complement))

    @property
    def negative(self) -> int:
        """Negative eigenvalues of K on the null space of J, see `inertia`."""
        return int(
            (self.inside.pivots < 0.0).sum() - (np.linalg.eigvalsh(self.complement) < 0.0).sum()
        )


def bordered(A: csr_array, scale: np.ndarray, m: int) -> Bordered | None:
    """Factors of D A D of a matrix A (n, n) whose last m rows are J, D of `scale` (n,); None where it
    is small, not symmetric, or takes pivots beside the diagonal.
    """
    k = A.shape[0] - m
    if k < LARGE or m > ROWS or A.dtype != np.float64:
        return None
    v = scale * np.random.default_rng(0).standard_normal(len(A.indptr) - 1)
    if np.abs(scale * (A @ v - A.T @ v)).max() > ALIKE * np.sqrt(np.diff(A.indptr).max()):
        return None
    G = csr_array(scaled(A[k:, :k], WEIGHT * scale[k:], scale[:k]))
    # large ones are a gigabyte with their factors: no copy stays beside these
    K = csr_array(scaled(A[:k, :k], scale[:k], scale[:k]) + G.T @ G)
    if not K.diagonal().all():
        K.setdiag(K.diagonal())
        K.sum_duplicates()
    try:
        inside = direct.factor(K, tree=supernodes.of_pattern(K))
    except SolverError:
        return None
    reach = direct.solve(inside, G.toarray())
    return Bordered(inside, G, reach, np.asarray(G @ reach.T))


@dataclass(frozen=True, eq=False)
class Saddle:
    """A factored matrix."""

    matrix: Array  #: (n, n) A
    scale: np.ndarray  #: (n,) diagonal of D
    factors: LU  #: of D A D, rows of largest entry 1

    @property
    def regular(self) -> bool:
        """Whether no pivot is lost in round-off, as for a body free to move."""
        pivots = np.abs(self.factors.pivots())
        return bool(pivots.min() > SINGULAR * pivots.max())

    @property
    def balanced(self) -> Array:
        """D A D."""
        return balance(self.matrix, self.scale)


def scales(A: Array) -> np.ndarray:
    """Diagonal (n,) of D."""
    return np.asarray(1.0 / np.sqrt(np.maximum(row_maxima(A), 1e-300)))


def balance(A: Array, scale: np.ndarray) -> Array:
    """A matrix with scaled rows and columns.

        D A D,    D = diag(scale)

    A (n, n), scale (n,).
    """
    return scaled(A, scale, scale)


def factor(
    A: Array, shift: float = 0.0, scale: np.ndarray | None = None, rows: int = 0
) -> Saddle | None:
    """Factors of A, None where it is singular to the bit; a `shift` of the balanced diagonal lets
    them exist there.

    The last `rows` of A are J. `scale` (n,) in place of the diagonal of D, where it is to say what
    unknowns and equations are measured in.
    """
    scale = scales(A) if scale is None else scale
    shifted = A
    if shift:
        more = diags_array(shift * scale**-2)
        shifted = csr_array(A + more) if is_sparse(A) else A + more.toarray()
    if isinstance(shifted, np.ndarray):
        found, order, zero = dgetrf(balance(shifted, scale))
        return None if zero else Saddle(A, scale, Dense(found, order))
    if not (shift and rows) and (large := bordered(csr_array(shifted), scale, rows)) is not None:
        return Saddle(A, scale, large)
    options = {"SymmetricMode": True}
    try:
        factors = splu(
            csr_array(balance(shifted, scale)).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=PIVOT,
            options=options,
        )
    except RuntimeError:
        return None
    return Saddle(A, scale, Sparse(factors))


def solve(saddle: Saddle, b: np.ndarray) -> np.ndarray:
    """Solve with the factors of a saddle point, refined once.

        A^-1 b

    b (n,) or (n, i).
    """
    scale = saddle.scale if b.ndim == 1 else saddle.scale[:, None]
    z = scale * saddle.factors.solve(scale * b)
    return np.asarray(z + scale * saddle.factors.solve(scale * (b - saddle.matrix @ z)))


def inverse(A: Array, rows: int = 0) -> Callable[[np.ndarray], np.ndarray] | None:
    """What solves with a matrix, whose last `rows` are J; None where it is singular to the bit.

        b -> A^-1 b

    A (n, n), b (n,) or (n, k).
    """
    found = factor(A, rows=rows)
    return None if found is None else partial(solve, found)


def constrained(K: Array, rows: Array) -> Callable[[np.ndarray], np.ndarray] | None:
    """What solves with K (n, n) on the null space of J (m, n); None where the matrix is singular to
    the bit.

        f (n,) -> the x (n,) of K x + J^T l = f, J x = 0
    """
    (m, n) = rows.shape
    found = inverse(matrix(K, rows), m)
    return None if found is None else lambda f: found(np.append(f, np.zeros(m)))[:n]


def regular_solution(A: Array, b: np.ndarray) -> np.ndarray | None:
    """The solution (n,) or (n, i); None where a pivot is lost in round-off, as for a body free to
    move.

        A^-1 b
    """
    found = factor(A)
    if found is None or not found.regular:
        return None
    z = solve(found, b)
    return z if np.isfinite(z).all() else None
