"""Which unknowns and which rows of linear constraints to use, by QR with column pivoting.

    D x + d = 0,   x = (x_d, x_f):   x_d = -D_d^-1 (D_f y + d),   x_f = y,   so that   x = T y + x0

Arrays: D (m,r), d (m,), T (r,r-m), x0 (r,). The columns D_d (m,m) are the m well-conditioned ones that pivoting finds first.

Source: Y. Hou, C. Liu, H. Hu, Comput. Methods Appl. Mech. Engrg. 361 (2020) 112690, equations (29) to (36),
doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core import ranks
from ..core.arrays import finite
from ..core.errors import InputError, say

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def eliminate(D: ArrayLike, d: ArrayLike) -> tuple[Array, Array]:
    """T (r,r-m) and x0 (r,) with D (T y + x0) + d = 0 for every y; y are entries of x: their rows of T are the identity.

    Equations (33) to (36), D (m,r), d (m,). InputError where there are as many constraints as modes, or dependent ones.
    """
    where, matrix = "pivots.eliminate", _matrix(D, "pivots.eliminate")
    m, r = matrix.shape
    constant = finite(d, where, f"d as {m} finite numbers, one a row of D", m)
    if r <= m:
        remedy = "the basis is too small for the interface constraints: keep more modes (a smaller eps) or keep the multipliers"
        raise InputError(say(where, f"more than {m} modes for {m} constraints", f"{r} modes", remedy))
    dependent = ranks.independent_rows(matrix.T, alike=True)  # of columns
    if len(dependent) < m:
        remedy = "drop repeated constraints and those that hold for every mode, or keep more modes"
        raise InputError(say(where, f"{m} independent constraints", f"rank {len(dependent)}", remedy))
    free = np.setdiff1d(np.arange(r), dependent)
    T, x0 = np.zeros((r, r - m)), np.zeros(r)
    T[free, np.arange(r - m)] = 1.0
    solved = -np.linalg.solve(matrix[:, dependent], np.column_stack([matrix[:, free], constant]))
    T[dependent], x0[dependent] = solved[:, :-1], solved[:, -1]
    return T, x0


def independent_rows(
    stack: Sequence[ArrayLike], tolerance: float = ranks.NEAR, gaps: ArrayLike | None = None, reach: float = np.inf
) -> Indices:
    """Indices, rising, of the rows to keep of Jacobians (m,r) in several configurations.

    A row is left out when one and the same combination of the rows kept gives it in all configurations, to `tolerance` relative to
    the largest row; and when closing its gap (s,m) takes a change of the unknowns beyond `reach`, root mean square over the
    configurations, after those of the rows kept are closed.
    """
    where = "pivots.independent_rows"
    jacobians = [_matrix(jacobian, where) for jacobian in stack]
    if not jacobians or len({jacobian.shape[0] for jacobian in jacobians}) > 1:
        got = f"{[jacobian.shape for jacobian in jacobians]}"
        raise InputError(say(where, "one Jacobian or more, all with the same constraints", got))
    if not 0.0 < tolerance < 1.0:
        raise InputError(say(where, "0 < tolerance < 1", tolerance))
    side_by_side = np.hstack(jacobians)
    order, pivots = ranks.pivots(side_by_side)
    found = order[pivots > tolerance * pivots.max(initial=0.0)]
    if gaps is not None:
        found = _within(np.stack(jacobians), np.asarray(gaps, dtype=np.float64), found, reach)
    return np.sort(found).astype(np.intp)


def _within(jacobians: Array, gaps: Array, candidates: Indices, reach: float) -> Indices:
    """The candidates whose gaps (s,m) are closed by small changes of the unknowns, one after the other; jacobians (s,m,r).

    What a row adds to the rows before it in each configuration is a direction g (r,) and a gap h: it takes the change h / |g|.
    """
    kept: list[int] = []
    directions: list[Array] = []  # (s,r), of unit length
    changes: list[Array] = []  # (s,) along them
    for row in candidates:
        g, h = jacobians[:, row].copy(), gaps[:, row].copy()
        for direction, change in zip(directions, changes, strict=True):
            along = np.sum(jacobians[:, row] * direction, axis=1)
            g -= along[:, None] * direction
            h -= along * change
        size = np.linalg.norm(g, axis=1)
        if np.linalg.norm(h) > reach * np.linalg.norm(size):
            continue
        seen = size > ranks.EXACT * size.max()
        safe = np.where(seen, size, 1.0)
        kept.append(int(row))
        directions.append(np.where(seen[:, None], g / safe[:, None], 0.0))
        changes.append(np.where(seen, h / safe, 0.0))
    return np.array(kept, dtype=np.intp)


def _matrix(x: ArrayLike, where: str) -> Array:
    """x as a finite matrix."""
    return finite(x, where, "a matrix (constraints, modes) of finite entries", None, None, empty=True)
