r"""Reduced elastic tangents of planar bodies that turn, without assembly.

    K(theta) = c^2 K_a + s^2 K_b + c s K_c,     c = cos theta, s = sin theta

For an elastic law that no rotation changes, this is the exact tangent at the reference shape turned
by theta, as R D R^T is quadratic in c and s. K_a and K_b are the tangents at 0 and 90 degrees, K_c
follows from 45 degrees. The turn of a body is that of the best fit of its coordinates to the
reference shape; translations drop out. Bodies that deform little need no other tangent; where the
Newton iteration contracts slowly with it, the exact one takes its place.

Only for planar systems in dense coordinates whose space holds the turned reference shapes, see
`turning`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import Cube, IntegerMatrix, Matrix, Vector


class CorotationalTangent(NamedTuple):
    """Tangents of the t elastic parts of a planar reduced system, flattened; no rows where they do
    not apply.

        K(theta) = c^2 K_a + s^2 K_b + c s K_c,     c = cos theta, s = sin theta

    K_a, K_b are tangents at 0 and 90 degrees, K_c follows from 45 degrees; (r, r) each for the r
    unknowns of a part.
    """

    table: IntegerMatrix  #: (t, 3) first unknown, number of unknowns, place of K_a, K_b, K_c in `numbers`
    rows: Cube  #: (t, 2, n) with offset (t, 2): multiples of c and s
    offset: Matrix
    places: Cube  #: (t, n, 3) multiples of c, s and 1 of the unknowns in which a part is turned
    beta: Vector  #: (t,) stiffness-proportional damping times [s]
    numbers: Vector


def nothing(size: int) -> CorotationalTangent:
    """The tangents of no part, for `size` unknowns n."""
    # tables without rows: the step asks for their length, and compiles the same code
    return CorotationalTangent(
        np.zeros((0, 3), np.int64),
        np.zeros((0, 2, size)),
        np.zeros((0, 2)),
        np.zeros((0, size, 3)),
        np.zeros(0),
        np.zeros(0),
    )


@jit
def add_rotated_tangent(T: CorotationalTangent, x: np.ndarray, gh: float, W: np.ndarray) -> None:
    """Add the co-rotational tangent of all parts, theta their turns in the state x (n,).

        W += (1 + gh beta) K(theta)

    W (n, n), gh [1/s].
    """
    for t in range(len(T.table)):
        c, s = T.offset[t, 0], T.offset[t, 1]
        # two sums over the unknowns: c and s are linear in them, up to one size
        for i in range(len(x)):
            c += T.rows[t, 0, i] * x[i]
            s += T.rows[t, 1, i] * x[i]
        # c and s of a body that is stretched are not of length one
        size = (1.0 + gh * T.beta[t]) / (c * c + s * s)
        first, count, at = T.table[t]
        Ka, Kb, Kc = (
            view(T.numbers, at, (count, count)),
            view(T.numbers, at + count * count, (count, count)),
            view(T.numbers, at + 2 * count * count, (count, count)),
        )
        a, b, d = size * c * c, size * s * s, size * c * s
        for i in range(count):
            target = W[first + i, first : first + count]
            row_a = Ka[i]
            row_b = Kb[i]
            row_c = Kc[i]
            # three products an entry, where an assembly has a product with all modes at every point
            for j in range(count):
                target[j] += a * row_a[j] + b * row_b[j] + d * row_c[j]
