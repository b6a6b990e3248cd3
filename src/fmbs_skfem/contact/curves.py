r"""Closest points of two curves of cubic pieces.

    A(p), B(q) = sum of (1 - 3 u^2 + 2 u^3) r_0 + (u - 2 u^2 + u^3) h t_0 + (3 u^2 - 2 u^3) r_1 + (u^3 - u^2) h t_1

on pieces j to j + 1 with u = p - j, from nodes with rows r and t = dr/dxi, h the length of the
piece in xi. About node i of A

    |A(p) - B(q)| -> min    with p = i,    or with |p - i| < 1,    q on B from `begin` to `end`                               (5)

Cells of the search are the pieces: a walk along B leaps over those that are too far by the distance
found so far.
"""

from __future__ import annotations

import numpy as np

from ..core.compiling.jit import jit
from .law import Scalar

# half and twice of it take the same corrections of two beams that cross: they end by NEAR
LIMIT = 30  #: corrections of a closest point
# corrections of Newton double their digits: one of 1e-11 leaves less than round-off; of 14 700
# corrections of beams that cross 1e-8 saves 1000, 1e-13 adds 500, and the motion has the same
# digits
NEAR = 1e-11  #: correction that is the last but one
# beams that cross, 70 steps: 14 700 corrections, 20 600 at half and 11 800 at twice of it, to the
# same digits; a long correction leaves the piece that it was made on
AHEAD = 0.5  #: largest correction
# a tenth and ten times of it are never met by beams that cross; without it beams that lie along one
# another have no closest points
PARALLEL = 1e-6  #: smallest curvature along A, over that along B, that is believed


@jit
def shares(u: Scalar, k: int, h: float) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Shares of the rows r_0, t_0, r_1, t_1 of a piece, or their derivatives by u, the k-th ones.

        1 - 3 u^2 + 2 u^3,  h (u - 2 u^2 + u^3),  3 u^2 - 2 u^3,  h (u^3 - u^2)

    with the length h of the piece in xi.
    """
    if k == 0:
        a = u * u * (3.0 - 2.0 * u)
        return 1.0 - a, h * u * (1.0 - u) * (1.0 - u), a, h * u * u * (u - 1.0)
    if k == 1:
        a = 6.0 * u * (1.0 - u)
        return -a, h * (1.0 - u) * (1.0 - 3.0 * u), a, h * u * (3.0 * u - 2.0)
    a = 6.0 - 12.0 * u
    return -a, h * (6.0 * u - 4.0), a, h * (6.0 * u - 2.0)


@jit
def piece(p: Scalar, spans: np.ndarray) -> int:
    """The piece on which p is."""
    return min(max(int(np.floor(p.real)), 0), len(spans) - 1)


@jit
def trace(
    y: np.ndarray,
    first: int,
    spans: np.ndarray,
    p: Scalar,
    many: int,
    dim: int,
    w: np.ndarray,
    row: int,
) -> None:
    """w[row + k] = the derivatives k < `many` by p of the curve whose nodes stand in y from `first`
    on.
    """
    j = piece(p, spans)
    start = first + 2 * dim * j
    for k in range(many):
        a, b, c, d = shares(p - j, k, spans[j])
        for i in range(dim):
            w[row + k, i] = (
                a * y[start + i]
                + b * y[start + dim + i]
                + c * y[start + 2 * dim + i]
                + d * y[start + 3 * dim + i]
            )


@jit
def separate(dim: int, w: np.ndarray) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar]:
    """Derivatives of half the squared distance of two curves by p, q, pp, pq, qq, from w[0:3] of A
    and w[3:6] of B.

        d.A_p,  - d.B_q,  A_p.A_p + d.A_pp,  - A_p.B_q,  B_q.B_q - d.B_qq,    d = A - B
    """
    one, other, pp, pq, qq = (
        0.0 * w[0, 0],
        0.0 * w[0, 0],
        0.0 * w[0, 0],
        0.0 * w[0, 0],
        0.0 * w[0, 0],
    )
    for i in range(dim):
        d = w[0, i] - w[3, i]
        one += d * w[1, i]
        other -= d * w[4, i]
        pp += w[1, i] * w[1, i] + d * w[2, i]
        pq -= w[1, i] * w[4, i]
        qq += w[4, i] * w[4, i] - d * w[5, i]
    return one, other, pp, pq, qq


@jit
def correction(
    dim: int, w: np.ndarray, held: tuple[bool, bool], exact: bool
) -> tuple[Scalar, Scalar]:
    """Newton's correction of (p, q) for (5), of those which are not held; the way down where it is
    no minimum.

        (f_pp f_pq; f_pq f_qq) (dp, dq) = - (f_p, f_q),    f = |A - B|^2 / 2

    as of `separate`.
    """
    one, other, pp, pq, qq = separate(dim, w)
    # Gauss's matrix, which is never negative, where the curve bends away; the derivative of what
    # was found takes the exact one
    if not exact and qq.real <= 0.0:
        qq = 0.0 * one
        for i in range(dim):
            qq += w[4, i] * w[4, i]
    if held[0]:
        return 0.0 * one, (0.0 * other if held[1] else -other / qq)
    if held[1]:
        return -one / (pp if exact or pp.real > 0.0 else abs(pp) + 1e-12 * qq), 0.0 * one
    low = pp - pq * pq / qq
    least = PARALLEL * qq.real
    if not exact and low.real < least:
        low = max(-low.real, least) + 0.0 * one
    dp = -(one - other * pq / qq) / low
    return dp, -(other + pq * dp) / qq


@jit
def meet_curves(
    y: np.ndarray,
    second: int,
    spans: np.ndarray,
    others: np.ndarray,
    limits: tuple[float, float],
    own: int,
    q: float,
    fixed: bool,
    dim: int,
    w: np.ndarray,
) -> tuple[float, float, tuple[bool, bool]]:
    """p, q of (5) about the node `own` from a start at q, and which of them are held; w[0:6] are
    current.

    p is held at i where it is `fixed`, and at i + 1 or i - 1 where the closest point is none of
    this node.
    """
    low = max(own - 1.0, 0.0)
    high = min(own + 1.0, float(len(spans)))
    begin, end = limits
    p = float(own)
    held = (False, False)
    for k in range(LIMIT):
        trace(y, 0, spans, p, 3, dim, w, 0)
        trace(y, second, others, q, 3, dim, w, 3)
        one, other, _, _, _ = separate(dim, w)
        stays = fixed or (p <= low and one >= 0.0) or (p >= high and one <= 0.0)
        held = stays, (q <= begin and other >= 0.0) or (q >= end and other <= 0.0)
        dp, dq = correction(dim, w, held, False)
        most = max(abs(dp), abs(dq))
        if k == LIMIT - 1 or most == 0.0:
            break
        # a long correction leaves the piece that it was made on
        part = min(1.0, AHEAD / most)
        p, q = min(max(p + part * dp, low), high), min(max(q + part * dq, begin), end)
        # traced once more, so that what is current is that of p and q as they are given back
        if most < NEAR:
            trace(y, 0, spans, p, 3, dim, w, 0)
            trace(y, second, others, q, 3, dim, w, 3)
            break
    return p, q, held


@jit
def chord(
    y: np.ndarray, own: int, start: int, low: float, high: float, dim: int
) -> tuple[float, float]:
    """Distance of a node, whose rows begin at `own`, from the chord of a piece that begins at
    `start`, and where on it.

    Of the chord only the part from `low` to `high` counts.
    """
    along, square, away = 0.0, 0.0, 0.0
    for c in range(dim):
        side = y[start + 2 * dim + c] - y[start + c]
        along += side * (y[own + c] - y[start + c])
        square += side * side
    u = min(max(along / square, low), high) if square > 0.0 else low
    for c in range(dim):
        d = y[own + c] - y[start + c] - u * (y[start + 2 * dim + c] - y[start + c])
        away += d * d
    return np.sqrt(away), u


@jit
def longest(y: np.ndarray, first: int, count: int, dim: int) -> float:
    """Length of the longest chord of a curve."""
    most = 0.0
    for j in range(count):
        square = 0.0
        start = first + 2 * dim * j
        for c in range(dim):
            square += (y[start + 2 * dim + c] - y[start + c]) ** 2
        most = max(most, square)
    return np.sqrt(most)


@jit
def find_chord(
    y: np.ndarray, own: int, second: int, limits: tuple[float, float], far: float, dim: int
) -> tuple[float, float]:
    """Distance and place q of the closest chord of B to a node of A, infinite where the limits of q
    leave none.

    Pieces that a chord of length `far` each cannot bring near are leapt over.
    """
    begin, end = limits
    best = np.inf
    q = begin
    j = int(begin)
    while j < end:
        away, u = chord(y, own, second + 2 * dim * j, max(begin - j, 0.0), min(end - j, 1.0), dim)
        if away < best:
            best = away
            q = j + u
        # a chord of length `far` brings a node nearer by no more than that: far pieces are leapt
        # over
        j += max(1, int((away - best) / far)) if far > 0.0 else 1
    return best, q


@jit
def bulge(y: np.ndarray, first: int, spans: np.ndarray, dim: int) -> float:
    """How far a curve can be from its chords, by the longest difference of a tangent from its
    chord.

        8 / 27 max |h t - chord|
    """
    most = 0.0
    for j in range(len(spans)):
        start = first + 2 * dim * j
        for end in range(2):
            square = 0.0
            for c in range(dim):
                side = y[start + 2 * dim + c] - y[start + c]
                square += (spans[j] * y[start + (2 * end + 1) * dim + c] - side) ** 2
            most = max(most, square)
    return 8.0 / 27.0 * np.sqrt(most)
