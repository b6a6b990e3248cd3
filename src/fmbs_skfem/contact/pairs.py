r"""Contact of beams with beams at their closest points, as forces on probe rows of both center
lines.

    d = A(p) - B(q),    n = d / |d|,    g = |d| - R_A - R_B,    s = - g
    W = w_i at p = i,    or    1 - 3 e^2 + 2 |e|^3,  e = p - i,  at the closest p,                             (of a node i of A)
    a = R_A + g / 2,    b = R_B + g / 2                                       (distances of the point where they touch)
    v = A' - B' + a turn(A_p, A_p') + b turn(B_q, B_q'),    turn(t, t') = [t (n . t') - (n . t) t'] / |t|^2
    N of s and s' = - n . v,    T of N, v_T and b = (b0 + change of the material points since the last accepted state), across n

on A: W (N n + T), on its slope A_p: W a [n (T . t) - T (n . t)] / |t|^2 with t = A_p, on B and B_q
alike with - N n - T and W b. Forces are those of `contact_law`. Beams that cross touch at their
closest points (`contact_curves`), which all nodes beside find, and of which the weights W add up to
one; those that lie along one another touch at all nodes of A. Forces on both are equal, along one
line, and friction acts where they touch, so that momentum and its moment stay; but beams have no
rotation about their own axis, so that friction along the circumference finds no resistance in it,
and they do not roll.

Every node of A meets B at one place, the nearest one. Where B is the same beam, it is the nearest
one between `limits`, beyond the node, so that every pair of places meets once; where that is a
limit which is no end of the beam, nothing meets.

The memory holds the rows, and of a node the last normal force, whether it was ever free, the
bristle along n x t_B x n and n x t_B, where it met, and, where all nodes touch, how deep it has
been since it came in with which normal. Where no node can have come near since the last accepted
state, no row is read. Derivatives are those of a complex step through one correction of the closest
points, exact to round-off. Forces depend on the rows by d, A_p and B_q alone: their derivatives are
of rank 3 c, on the rows of two pieces.

Sources: Wriggers and Zavarise, Commun. Numer. Methods Eng. 13 (1997) 429-438, doi
10.1002/(SICI)1099-0887(199706)13:6<429::AID-CNM70>3.0.CO;2-X (closest points of beams); Zavarise
and Wriggers, Int. J. Numer. Methods Eng. 49 (2000) 977-1006, doi
10.1002/1097-0207(20001120)49:8<977::AID-NME986>3.0.CO;2-C (friction); Meier, Wall and Popp, Comput.
Methods Appl. Mech. Eng. 315 (2017) 972-1010, doi 10.1016/j.cma.2016.11.028 (points and lines of
contact for all angles).
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import Integers, Matrix, Vector, opener
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Indices, Number, Reals, Sizes, also, require
from ..systems import kernels
from ..systems.evaluation import evaluation
from ..systems.forces.on_rows import Place
from .curves import bulge, find_chord, longest, meet_curves, piece, shares, trace
from .law import BEFORE, MU, Scalar, normal_force, require_law, resist, size

NODE = 10  #: numbers of a node in the memory: normal force, whether it was ever free, bristle, p and q, how deep it is, n0
DEEPEST = 6  #: how deep a node has been since it came in; behind it stands the normal there (`contact_passing`)
ROOM = 29  #: vectors of work


@storable
@dataclass(frozen=True)
class BeamContacts:
    """Contact of two center lines, a and b pieces long."""

    dim: Annotated[int, Number()]
    #: 1 where every node of A touches, 0 where the closest points do
    along: Annotated[int, Number()]
    #: position and slope by xi of every node of A, then of B
    rows: Annotated[np.ndarray, Indices("f", end="y")]
    spans: Annotated[np.ndarray, Reals("a")]  #: lengths in xi
    others: Annotated[np.ndarray, Reals("b")]
    radii: Annotated[np.ndarray, Reals("r")]  #: of A and of B [m]
    law: Annotated[np.ndarray, Reals("l")]  #: numbers in the order of LAW
    #: change of speed that a change of force makes in a second, over the one allowed a step
    share: Annotated[float, Number()]
    power: Annotated[np.ndarray, Reals("p")]  #: numbers in the order of POWER
    #: 0 where B is another beam, 1 where it is the same one, 2 where that is closed
    itself: Annotated[int, Number()]
    limits: Annotated[np.ndarray, Reals("t 2")]  #: between which q is that a node meets
    #: factors of the forces of a node where every one touches
    weights: Annotated[np.ndarray, Reals("t")]

    def __len__(self) -> int:
        return len(self.spans) + 1


def whole_line(count: int, last: int) -> np.ndarray:
    """Limits (t, 2) of so many nodes that meet all of another beam."""
    return np.tile([0.0, float(last)], (count, 1))


@also.register(BeamContacts)
def check_beams(term: BeamContacts, name: str, sizes: Sizes) -> None:
    """Numbers that compiled code reads without looking are there."""
    pieces = len(term.spans), len(term.others)
    require(term.dim in (2, 3), f"{name}.dim", "2 or 3", term.dim)
    require(min(pieces) > 0, f"{name}.spans", "a piece or more of both beams", pieces)
    require(
        len(term.rows) == 2 * term.dim * (sum(pieces) + 2),
        f"{name}.rows",
        "rows of all nodes",
        len(term.rows),
    )
    require(len(term.radii) == 2, f"{name}.radii", "two radii", len(term.radii))
    require_law(term.law, term.power, name)
    require(
        term.limits.shape == (pieces[0] + 1, 2),
        f"{name}.limits",
        "two of every node",
        term.limits.shape,
    )
    require(
        len(term.weights) == pieces[0] + 1,
        f"{name}.weights",
        "one of every node",
        len(term.weights),
    )
    between = bool(np.all((term.limits >= 0.0) & (term.limits <= pieces[1])))
    require(between, f"{name}.limits", "places on the other beam", "others")


class PairsRecord(NamedTuple):
    """The same for compiled code."""

    dim: int
    along: bool
    rows: Integers
    spans: Vector
    others: Vector
    radii: Vector
    law: Vector
    share: float
    itself: int
    limits: Matrix
    weights: Vector
    memory: int  #: first place in the memory: the rows, then NODE numbers a node
    room: int  #: first place in the room: clearances of the nodes, then bounds of ways


opened = opener(PairsRecord)


@jit
def read_rates(table: Any, F: Any, places: tuple[int, int], v: np.ndarray) -> None:
    """v (f,) = rates of the rows of two pieces that begin at `places`."""
    E = evaluation(table)
    for start in places:
        for j in range(start, start + 4 * F.dim):
            v[j] = kernels.row_value(E.arrays.probes, F.rows[j], E.space.v)


@jit
def pieces(F: Any, p: float, q: float) -> tuple[int, int]:
    """Where the rows of the pieces begin on which p and q are."""
    return 2 * F.dim * piece(p, F.spans), 2 * F.dim * (len(F.spans) + 1 + piece(q, F.others))


@jit
def extents(F: Any, y: np.ndarray) -> tuple[float, float]:
    """Length of the longest chord of B, and the largest distance from a node to its closest chord
    with which it may touch.
    """
    dim = F.dim
    second = 2 * F.dim * (len(F.spans) + 1)
    reach = F.radii[0] + F.radii[1] + bulge(y, second, F.others, dim)
    if not F.along:
        reach += longest(y, 0, len(F.spans), dim) + bulge(y, 0, F.spans, dim)
    return longest(y, second, len(F.others), dim), reach


@jit
def find(
    F: Any, k: int, y: np.ndarray, within: tuple[float, float], w: np.ndarray
) -> tuple[float, float, float, tuple[bool, bool]]:
    """Gap, p, q of a contact, and which of these are held; w[0:6] are current where the gap is
    finite.

    It is infinite where its weight is 0, and where B is too far by its `extents`.
    """
    dim = F.dim
    second = 2 * F.dim * (len(F.spans) + 1)
    limits = limits_of(F, k)
    near, q = find_chord(y, 2 * dim * k, second, limits, within[0], dim)
    if near > within[1] or near == np.inf:
        return np.inf, float(k), q, (True, True)
    p, q, held = meet_curves(y, second, F.spans, F.others, limits, k, q, F.along, dim, w)
    if abs(p - k) >= 1.0 or passes(F, limits, p, q, held):
        return np.inf, p, q, held
    return away(F, w), p, q, held


@jit
def away(F: Any, w: np.ndarray) -> float:
    """The gap of the places in w[0:6] [m].

        |A - B| - R_A - R_B

    with the radii of both beams.
    """
    square = 0.0
    for c in range(F.dim):
        square += (w[0, c] - w[3, c]) ** 2
    return np.sqrt(square) - F.radii[0] - F.radii[1]


@jit
def limits_of(F: Any, k: int) -> tuple[float, float]:
    """Of q that node k meets."""
    return F.limits[k, 0], F.limits[k, 1]


@jit
def passes(
    F: Any, limits: tuple[float, float], p: float, q: float, held: tuple[bool, bool]
) -> bool:
    """Whether the closest places of a beam to itself are beyond limits that are no ends of it."""
    if F.itself == 0:
        return False
    if held[1] and (q <= limits[0] or F.itself == 2 or limits[1] < len(F.others)):
        return True
    return F.itself == 2 and not F.along and held[0] and p <= 0.0


@jit
def weigh(F: Any, k: int, p: Scalar) -> Scalar:
    """The weight of the node k where p on A touches.

        w_k    or    1 - 3 e^2 + 2 |e|^3,  e = p - k

    The former where all nodes touch, the latter where the closest points do.
    """
    e = p - k if p.real >= k else k - p
    return F.weights[k] + 0.0 * e if F.along else 1.0 - e * e * (3.0 - 2.0 * e)


@jit
def turn(
    w: np.ndarray, n: int, slope: int, change: int, out: int, factor: Scalar, dim: int
) -> None:
    """Add the turn of the slope t in w[slope] by its change t' in w[change], about the normal n in
    w[n].

        w[out] += factor [t (n . t') - (n . t) t'] / |t|^2
    """
    along, turned, square = 0.0 * w[n, 0], 0.0 * w[n, 0], 0.0 * w[n, 0]
    for c in range(dim):
        along += w[n, c] * w[slope, c]
        turned += w[n, c] * w[change, c]
        square += w[slope, c] * w[slope, c]
    for c in range(dim):
        w[out, c] += factor * (w[slope, c] * turned - along * w[change, c]) / square


@jit
def follow(F: Any, v: np.ndarray, before: np.ndarray, p: Scalar, q: Scalar, w: np.ndarray) -> None:
    """Points and slopes of both curves by the rates v (f,) of the rows, and by the rows `before`
    (f,).

        A, A_p, B, B_q

    into w[14:18] and w[18:22].
    """
    second = 2 * F.dim * (len(F.spans) + 1)
    trace(v, 0, F.spans, p, 2, F.dim, w, 14)
    trace(v, second, F.others, q, 2, F.dim, w, 16)
    trace(before, 0, F.spans, p, 2, F.dim, w, 18)
    trace(before, second, F.others, q, 2, F.dim, w, 20)


@jit
def change(w: np.ndarray, first: int, arms: tuple[Scalar, Scalar], out: int, dim: int) -> None:
    """Change of the material points that meet, with A, A_p, B, B_q of it from w[first] on and both
    `arms` a and b.

        w[out] = A' - B' + a turn(A_p, A_p') + b turn(B_q, B_q')
    """
    for c in range(dim):
        w[out, c] = w[first, c] - w[first + 2, c]
    turn(w, 6, 1, first + 1, out, arms[0], dim)
    turn(w, 6, 4, first + 3, out, arms[1], dim)


@jit
def slip(
    F: Any,
    before: np.ndarray,
    p: Scalar,
    q: Scalar,
    last: np.ndarray,
    arms: tuple[Scalar, Scalar],
    w: np.ndarray,
) -> None:
    """w[13] = change of the material points that meet since the last accepted state with the rows
    `before` (f,).

        d1 - d0 - (A_p0 + A_p1) (p1 - p0) / 2 + (B_q0 + B_q1) (q1 - q0) / 2 + a <turn(A_p)> A_p' + b <turn(B_q)> B_q'

    in which <turn> is Simpson's rule of the turn in both states and half way between, where n, A_p
    and B_q are taken to be means. Places that were others by a piece or more, or are not known, are
    taken to be those of now.
    """
    dim = F.dim
    second = 2 * F.dim * (len(F.spans) + 1)
    near = abs(last[4] - p.real) < 1.0 and abs(last[5] - q.real) < 1.0
    p0, q0 = (last[4] + 0.0 * p, last[5] + 0.0 * q) if near else (p, q)
    trace(before, 0, F.spans, p0, 2, dim, w, 22)
    trace(before, second, F.others, q0, 2, dim, w, 24)
    square = 0.0 * p
    for c in range(dim):
        w[26, c] = w[22, c] - w[24, c]
        square += w[26, c] * w[26, c]
    long = np.sqrt(square)
    for c in range(dim):
        w[13, c] = (
            w[7, c]
            - w[26, c]
            - 0.5 * (w[1, c] + w[23, c]) * (p - p0)
            + 0.5 * (w[4, c] + w[25, c]) * (q - q0)
        )
        w[26, c] /= long
        w[27, c], w[28, c] = w[1, c] - w[19, c], w[4, c] - w[21, c]
    half = 0.5 * (long - F.radii[0] - F.radii[1])
    turn_both(w, 6, (1, 4), 1.0 / 6.0, arms, dim)
    turn_both(w, 26, (23, 25), 1.0 / 6.0, (F.radii[0] + half, F.radii[1] + half), dim)
    square = 0.0 * p
    for c in range(dim):
        w[26, c] = 0.5 * (w[26, c] + w[6, c])
        square += w[26, c] * w[26, c]
        w[23, c], w[25, c] = 0.5 * (w[23, c] + w[1, c]), 0.5 * (w[25, c] + w[4, c])
    for c in range(dim):
        w[26, c] /= np.sqrt(square)
    middle = 0.5 * (arms[0] + F.radii[0] + half), 0.5 * (arms[1] + F.radii[1] + half)
    turn_both(w, 26, (23, 25), 4.0 / 6.0, middle, dim)


@jit
def turn_both(
    w: np.ndarray,
    n: int,
    slopes: tuple[int, int],
    share: float,
    arms: tuple[Scalar, Scalar],
    dim: int,
) -> None:
    """w[13] += share of the turns of both slopes by their changes w[27] and w[28], about the normal
    w[n].
    """
    turn(w, n, slopes[0], 27, 13, share * arms[0], dim)
    turn(w, n, slopes[1], 28, 13, share * arms[1], dim)


@jit
def cross(a: np.ndarray, b: np.ndarray, out: np.ndarray, dim: int) -> None:
    """out = a x b in space; in the plane nothing."""
    if dim == 3:
        out[0] = a[1] * b[2] - a[2] * b[1]
        out[1] = a[2] * b[0] - a[0] * b[2]
        out[2] = a[0] * b[1] - a[1] * b[0]
    else:
        out[0] = out[1] = 0.0 * a[0]


@jit
def lay_axes(w: np.ndarray, dim: int) -> None:
    """w[10], w[11] = unit vectors across the normal w[6]: along B, or along A where B ends in it,
    and across; in the plane one.
    """
    if dim == 2:
        w[10, 0], w[10, 1] = -w[6, 1], w[6, 0]
        w[11, 0], w[11, 1] = 0.0 * w[6, 0], 0.0 * w[6, 0]
        return
    slope = 4
    for _ in range(2):
        along = 0.0 * w[6, 0]
        whole = size(w[slope], 3)
        for c in range(3):
            along += w[6, c] * w[slope, c] / whole
        if slope == 4 and abs(along) > 0.9:
            slope = 1
    for c in range(3):
        w[10, c] = w[slope, c] / whole - along * w[6, c]
    whole = size(w[10], 3)
    for c in range(3):
        w[10, c] = w[10, c] / whole
    cross(w[6], w[10], w[11], 3)


@jit
def press(
    F: Any,
    k: int,
    before: np.ndarray,
    last: np.ndarray,
    p: Scalar,
    q: Scalar,
    w: np.ndarray,
    out: np.ndarray,
) -> Scalar:
    """out (8 c,) = forces of a node on the rows of the pieces where it meets; its normal force
    times its weight.

    `last` is its memory, `before` (f,) that of the rows. w[0:6] and, by `follow`, w[14:22] must be
    current; w[12, :2] becomes the bristle, w[8] the speed of sliding.
    """
    dim = F.dim
    for c in range(dim):
        w[7, c] = w[0, c] - w[3, c]
    long = size(w[7], dim)
    gap = long - F.radii[0] - F.radii[1]
    rate = 0.0 * long
    for c in range(dim):
        w[6, c] = w[7, c] / long
    arms = F.radii[0] + 0.5 * gap, F.radii[1] + 0.5 * gap
    change(w, 14, arms, 8, dim)
    for c in range(dim):
        rate -= w[6, c] * w[8, c]
    N = normal_force(F.law, -gap, rate)
    for c in range(dim):
        w[8, c] += w[6, c] * rate
        w[9, c] = 0.0 * long
    w[12, 0] = w[12, 1] = 0.0 * long
    if N.real > 0.0 and F.law[MU] > 0.0:
        if last[0] >= 0.0:
            slip(F, before, p, q, last, arms, w)
        else:
            for c in range(dim):
                w[13, c] = BEFORE * w[8, c]
        stick(F, N, last, w)
    weight = weigh(F, k, p)
    share_out(F.spans, p, 1, weight, arms[0] * weight, N * weight, w, out[: 4 * dim], dim)
    share_out(F.others, q, 4, -weight, arms[1] * weight, -N * weight, w, out[4 * dim :], dim)
    return N * weight


@jit
def stick(F: Any, N: Scalar, last: np.ndarray, w: np.ndarray) -> None:
    """w[9] = T of the slip w[13], w[12, :2] the bristle in the axes across the normal."""
    dim = F.dim
    along = 0.0 * N
    lay_axes(w, dim)
    for c in range(dim):
        w[13, c] += last[2] * w[10, c] + last[3] * w[11, c]
        along += w[6, c] * w[13, c]
    for c in range(dim):
        w[13, c] -= along * w[6, c]
    resist(F.law, N, w[13], w[8], w[9], dim)
    for c in range(dim):
        w[12, 0] += w[13, c] * w[10, c]
        w[12, 1] += w[13, c] * w[11, c]


@jit
def share_out(
    spans: np.ndarray,
    p: Scalar,
    slope: int,
    weight: Scalar,
    arm: Scalar,
    N: Scalar,
    w: np.ndarray,
    out: np.ndarray,
    dim: int,
) -> None:
    """Forces of a contact on the rows of a piece of a line.

        N n + weight T at p,    arm [n (T . t) - T (n . t)] / |t|^2 on the slope t

    into out (4 c,).
    """
    j = piece(p, spans)
    at, by = shares(p - j, 0, spans[j]), shares(p - j, 1, spans[j])
    along, pull, square = 0.0 * N, 0.0 * N, 0.0 * N
    for c in range(dim):
        along += w[6, c] * w[slope, c]
        pull += w[9, c] * w[slope, c]
        square += w[slope, c] * w[slope, c]
    for c in range(dim):
        force = N * w[6, c] + weight * w[9, c]
        moment = arm * (w[6, c] * pull - w[9, c] * along) / square
        for k in range(4):
            out[dim * k + c] = at[k] * force + by[k] * moment


@jit
def row_of(k: int, places: tuple[int, int], dim: int) -> int:
    """The row of the force k of a node."""
    return places[0] + k if k < 4 * dim else places[1] + k - 4 * dim


def record_of(found: BeamContacts, place: Place) -> PairsRecord:
    """A contact for compiled code."""
    numbers = (
        found.rows,
        found.spans,
        found.others,
        found.radii,
        np.concatenate([found.law, found.power]),
    )
    arrays = [np.ascontiguousarray(part) for part in numbers]
    limits, weights = (
        np.ascontiguousarray(part, dtype=float) for part in (found.limits, found.weights)
    )
    return PairsRecord._make(
        (
            found.dim,
            bool(found.along),
            *arrays,
            found.share,
            found.itself,
            limits,
            weights,
            place.memory,
            place.room,
        )
    )
