"""Which unknowns and which rows of linear constraints to use, by QR with column pivoting.

    D x + d = 0,   x = (x_d, x_f):   x_d = -D_d^-1 (D_f y + d),   x_f = y,   so that   x = T y + x0

Arrays: D (m,r), d (m,), T (r,r-m), x0 (r,). The columns D_d (m,m) are the m well-conditioned ones
that pivoting finds first.

Source: Y. Hou, C. Liu, H. Hu, Comput. Methods Appl. Mech. Engrg. 361 (2020) 112690, equations (29)
to (36), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.algebra import ranks
from ...core.errors import InputError, say
from ...core.values.arrays import finite

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def eliminate(D: ArrayLike, d: ArrayLike) -> tuple[Array, Array]:
    """T (r,r-m) and x0 (r,) by which linear constraints are eliminated; y are entries of x: their
    rows of T are the identity.

        D (T y + x0) + d = 0    for every y

    Equations (33) to (36), D (m,r), d (m,). InputError where there are as many constraints as
    modes, or dependent ones.

        >>> import numpy as np
        >>> from fmbs_skfem.reduction import pivots
        >>> T, x0 = pivots.eliminate(np.array([[2.0, 1.0]]), np.array([-4.0]))  # 2 x_0 + x_1 = 4
        >>> T.T.tolist(), x0.tolist()
        ([[-0.5, 1.0]], [2.0, 0.0])
    """
    where = "pivots.eliminate"
    matrix = _matrix(D, "pivots.eliminate")
    m, r = matrix.shape
    constant = finite(d, where, f"d as {m} finite numbers, one a row of D", m)
    if r <= m:
        remedy = "the basis is too small for the interface constraints: keep more modes (a smaller eps) or keep the multipliers"
        raise InputError(
            say(where, f"more than {m} modes for {m} constraints", f"{r} modes", remedy)
        )
    dependent = ranks.independent_rows(matrix.T, alike=True)  # of columns
    if len(dependent) < m:
        remedy = "drop repeated constraints and those that hold for every mode, or keep more modes"
        raise InputError(
            say(where, f"{m} independent constraints", f"rank {len(dependent)}", remedy)
        )
    free = np.setdiff1d(np.arange(r), dependent)
    T, x0 = np.zeros((r, r - m)), np.zeros(r)
    T[free, np.arange(r - m)] = 1.0
    solved = -np.linalg.solve(matrix[:, dependent], np.column_stack([matrix[:, free], constant]))
    T[dependent], x0[dependent] = solved[:, :-1], solved[:, -1]
    return T, x0


def independent_rows(
    stack: Sequence[ArrayLike],
    tolerance: float = ranks.NEAR,
    first: NDArray[np.bool_] | None = None,
) -> Indices:
    """Indices, rising, of the rows to keep of Jacobians (m,r) in several configurations.

    A row is left out when one and the same combination of the rows kept gives it in all
    configurations, to `tolerance` relative to the largest row; of rows that depend on each other
    those that are `first` (m,) are kept.
    """
    where = "pivots.independent_rows"
    jacobians = [_matrix(jacobian, where) for jacobian in stack]
    if not jacobians or len({jacobian.shape[0] for jacobian in jacobians}) > 1:
        got = f"{[jacobian.shape for jacobian in jacobians]}"
        raise InputError(say(where, "one Jacobian or more, all with the same constraints", got))
    if not 0.0 < tolerance < 1.0:
        raise InputError(say(where, "0 < tolerance < 1", tolerance))
    rows = np.hstack(jacobians)
    least = tolerance * np.linalg.norm(rows, axis=1).max(initial=0.0)
    found = np.zeros(0, dtype=np.intp)
    ahead = np.zeros(len(rows), dtype=bool) if first is None else first
    for group in (np.flatnonzero(ahead), np.flatnonzero(~ahead)):
        base = np.linalg.qr(rows[found].T)[0]
        left = rows[group]
        for _ in range(2):  # once more, because what is left may be round-off of the first time
            left = left - (left @ base) @ base.T
        order, sizes = ranks.pivots(left)
        found = np.concatenate([found, group[order[sizes > least]]])
    return np.sort(found)


def _matrix(x: ArrayLike, where: str) -> Array:
    """x as a finite matrix."""
    return finite(
        x, where, "a matrix (constraints, modes) of finite entries", None, None, empty=True
    )
