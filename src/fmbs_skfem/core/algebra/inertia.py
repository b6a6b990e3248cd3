r"""Negative pivots of a tangent on what its constraints leave: how many motions an equilibrium does
not resist.

    negative(Z^T K Z) = negative([K J^T; J 0]) - m                   Z spans the null space of J (m, n), rows independent
                      = negative(K') - negative(J K'^-1 J^T),         K' = K + s J^T J

The first form counts the pivots of factors that kept to the diagonal (law of inertia of Sylvester),
as those of most equilibria do; the second one (Haynsworth) needs factors of K' alone, which has a
pivot at every place. There are none in a stable equilibrium of forces with a potential, and one
more or less where its path has passed a limit point or a branch point.

Sources: J. R. Bunch and L. Kaufman, Math. Comp. 31 (1977) 163-179, doi
10.1090/S0025-5718-1977-0428694-0; E. V. Haynsworth, Linear Algebra Appl. 1 (1968) 73-81, doi
10.1016/0024-3795(68)90050-5.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import ldl
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from . import saddle
from .linalg import Array
from .saddle import Bordered, Saddle, Sparse

ALIKE = 1e-9  #: difference of K from its transpose, over its largest entry, that is round-off
MANY = 400  #: rows beyond which the second form, whose J K'^-1 J^T is dense, costs more than a load step


def count_negative(K: Array, J: np.ndarray, found: Saddle) -> int | None:
    """Negative eigenvalues of K (n, n) on the null space of independent rows J (m, n), from factors
    of their saddle point.

    None where there is no such number: K is not symmetric, or singular there.
    """
    if not found.regular or abs(K - K.T).max() > ALIKE * abs(K).max():
        return None
    if isinstance(found.matrix, np.ndarray):
        return negative_blocks(found.balanced) - len(J)
    if isinstance(found.factors, Bordered):
        return found.factors.negative
    kept = negative_on_diagonal(found.factors)
    if kept is not None:
        return kept - len(J)
    return by_complement(csr_array(K), J) if len(J) <= MANY else None


def negative_blocks(A: Array) -> int:
    """Negative eigenvalues of a dense symmetric matrix (n, n): the blocks of two rows of Bunch and
    Kaufman have one each.
    """
    D = ldl(np.asarray(A))[1]
    two = np.abs(np.diag(D, -1)) > 0.0
    alone = ~(np.append(two, False) | np.append(False, two))
    return int(two.sum() + (np.diag(D)[alone] < 0.0).sum())


def negative_on_diagonal(factors: object) -> int | None:
    """Negative pivots of sparse factors; None where they left the diagonal."""
    if not isinstance(factors, Sparse) or (factors.found.perm_r != factors.found.perm_c).any():
        return None
    return int((factors.pivots() < 0.0).sum())


def by_complement(K: csr_array, J: np.ndarray) -> int | None:
    """The second form."""
    rows = csr_array(J)
    size = abs(K).max() / abs(rows).max() ** 2 if len(J) else 0.0
    A = csr_array(K + size * (rows.T @ rows)) if len(J) else K
    scale = saddle.scales(A)
    try:
        factors = Sparse(
            splu(
                csc_array(saddle.balance(A, scale)),
                "MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        )
    except RuntimeError:
        return None
    pivots = negative_on_diagonal(factors)
    if pivots is None or not len(J):
        return pivots
    B = np.asarray(scale[:, None] * J.T)
    return pivots - negative_blocks(B.T @ factors.solve(B))
