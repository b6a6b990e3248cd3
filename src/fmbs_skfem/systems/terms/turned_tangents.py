r"""Tangents of shells in Kronecker form that turn with their body, between assemblies.

    K' = (I (x) Q) K (I (x) Q)^T,    Q the rotation nearest to H = z'^T G z,    G = sum_p w (N,1 N,1^T + N,2 N,2^T)

K is the tangent that was assembled at the vectors z (b, c), z' are those now. For an elastic law
that no rotation changes, K' is exact where z' = z Q^T: what is left is the change of shape since. A
turn costs a tenth of an assembly, whose moduli at all points have 15 rows each, while a thin plate
that turns by a hundredth of a radian needs a new tangent: it is far stiffer in its plane than
across.

Q follows by Newton's iteration X <- (X + X^-T) / 2 for the polar decomposition. Of a flat plate H
has rank 2: the cofactors of H, which hold the third direction, are added first.

Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986) 1160-1174, doi 10.1137/0907079 (polar
decomposition).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ..kernels import clear_rows, copy

# a flat plate that keeps its shape takes 5, one squeezed to a tenth or a hundredth in a direction 8
# and 11: half would do, and twice gives the same
POLAR = 30  #: iterations: the first ones halve large stretches, the last ones double the digits


def room(functions: int) -> int:
    """How many numbers are kept of a body of b = `functions`: the lower triangle of K, G z, and
    room for two matrices (c, c).
    """
    # in the space of the model: what is kept survives from factor to factor, and no step makes an
    # array
    size = 3 * functions
    return size * (size + 1) // 2 + size + 18


@jit
def kept(s: Any, P: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lower triangle of K row by row, G z (b, c), and room for two matrices (2, c, c)."""
    # three views of one stretch of numbers
    size = 3 * len(P.gram)
    triangle = size * (size + 1) // 2
    first = P.turned
    K, Gz = view(s.turned, first, (triangle,)), view(s.turned, first + triangle, (len(P.gram), 3))
    return K, Gz, view(s.turned, first + triangle + size, (2, 3, 3))


@jit
def keep(s: Any, P: Any, entries: np.ndarray) -> None:
    """Keep the lower triangle of K, in the front of `entries`, and G z (b, c).

    z are the coordinates of the cells at which K was assembled, those of the space.
    """
    K, Gz, _ = kept(s, P)
    z = view(s.cell_x, P.first, Gz.shape)
    # half of K: K' is symmetric for any rotation
    copy(entries[: len(K)], K)
    clear_rows(Gz)
    for b in range(len(Gz)):
        for d in range(len(Gz)):
            for c in range(Gz.shape[1]):
                # once an assembly, so that a turn has a product of b c c numbers alone
                Gz[b, c] += P.gram[b, d] * z[d, c]


@jit
def turned(s: Any, P: Any) -> np.ndarray:
    """The lower triangle of K' row by row, in the front of the first work vector.

        K' = (I (x) Q) K (I (x) Q)^T,    Q the rotation nearest to z'^T G z

    from what `keep` kept, at the coordinates z' (b, c) of the space.
    """
    K, Gz, matrices = kept(s, P)
    z = view(s.cell_x, P.first, Gz.shape)
    Q = matrices[0]
    clear_rows(Q)
    for b in range(len(Gz)):
        for c in range(len(Q)):
            for g in range(len(Q)):
                # the best fit to the vectors as they are: no angle is followed from step to step
                Q[c, g] += z[b, c] * Gz[b, g]
    to_rotation(Q, matrices[1])
    turn(K, Q, matrices[1], s.work[0])
    return s.work[0]


@jit
def turn(K: np.ndarray, Q: np.ndarray, block: np.ndarray, entries: np.ndarray) -> None:
    """Lower triangle of a block that is turned by a rotation Q (3, 3), row by row as K.

        (I (x) Q) K (I (x) Q)^T

    into `entries`; `block` is room for (3, 3).
    """
    b, at = 0, 0
    while at < len(K):
        size = 3 * b
        rows = at, at + size + 1, at + 2 * size + 3  # the triangle's
        for d in range(0, size, 3):
            for g in range(3):
                # block by block, in registers: an assembly takes moduli of 15 rows at a hundred
                # points, ten times as long
                x, y, z = K[rows[0] + d + g], K[rows[1] + d + g], K[rows[2] + d + g]
                for c in range(3):
                    block[c, g] = Q[c, 0] * x + Q[c, 1] * y + Q[c, 2] * z
            for c in range(3):
                for g in range(3):
                    entries[rows[c] + d + g] = (
                        block[c, 0] * Q[g, 0] + block[c, 1] * Q[g, 1] + block[c, 2] * Q[g, 2]
                    )
        turn_diagonal(K, rows, size, Q, entries)
        b, at = b + 1, rows[2] + size + 3


@jit
def turn_diagonal(
    K: np.ndarray, rows: tuple[int, int, int], first: int, Q: np.ndarray, entries: np.ndarray
) -> None:
    """The same for the half of a block on the diagonal."""
    for c in range(3):
        for g in range(c + 1):
            total = 0.0
            for i in range(3):
                for j in range(3):
                    # only the lower half of a block on the diagonal is there
                    total += Q[c, i] * K[rows[max(i, j)] + first + min(i, j)] * Q[g, j]
            entries[rows[c] + first + g] = total


@jit
def to_rotation(H: np.ndarray, other: np.ndarray) -> None:
    """H (c, c) becomes the rotation nearest to it, in place; the identity where there is none.
    `other` is room for (c, c).

        X <- (X + X^-T) / 2

    Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986) 1160-1174, doi 10.1137/0907079.
    """
    square = 0.0
    for c in range(3):
        for g in range(3):
            square += H[c, g] * H[c, g]
    # of size one, so that the first step of the iteration is neither far nor lost in round-off
    scale = 1.0 / np.sqrt(square) if square > 0.0 else 0.0
    for c in range(3):
        for g in range(3):
            H[c, g] *= scale
    # of H = R S cofactors are R cof(S), with the same rotation; of a flat plate, whose H has rank
    # two, they are the third direction
    cofactors(H, other)
    for c in range(3):
        for g in range(3):
            H[c, g] += other[c, g]
    for _ in range(POLAR):
        # H^-T is cofactors over det: no factorisation of a matrix of nine numbers
        det = cofactors(H, other)
        for c in range(3):
            for g in range(3):
                one = 1.0 if c == g else 0.0
                H[c, g] = 0.5 * (H[c, g] + other[c, g] / det) if det > 0.0 else one


@jit
def cofactors(A: np.ndarray, found: np.ndarray) -> float:
    """Cofactors of a matrix, and its determinant.

        det(A) A^-T

    in `found`, (c, c) as A.
    """
    for c in range(3):
        # cyclic, so that signs come by themselves
        i, j = (c + 1) % 3, (c + 2) % 3
        for g in range(3):
            k, l = (g + 1) % 3, (g + 2) % 3
            found[c, g] = A[i, k] * A[j, l] - A[i, l] * A[j, k]
    return A[0, 0] * found[0, 0] + A[0, 1] * found[0, 1] + A[0, 2] * found[0, 2]
