r"""Contact of points, as corners of boxes and points along their edges, with all of a flexible
plate or shell.

    d = p - X(u, v),    n = +- the normal of the surface at its closest place, or d / |d| beyond its rim,    g = d . n - R
    d = c1 X,u + c2 X,v + c3 m,   m the unit normal,    v = p' - X' - c1 X,u' - c2 X,v' - c3 m',    m' = - sum_a X^a (m . X,a')
    N of s = - g and s' = - n . (p' - X'),    T of N, v_T and b = (b0 + change of the material points since then), across n

on p: F = N n + T, on X: - F, on X,a: - c_a T + c3 (T . X^a) m. Forces on both are equal, along one
line, and friction acts where p is, so that momentum and its moment stay. Forces are those of
`contact_law`, the surface is that of `contact_facets`.

A point keeps the side of the surface from which it came, in the middle of it, too: where it is
beyond, g = - |d| - R. Since the last accepted state material points have moved by

    M0 - p0,    M0 = X0 + c1 X0,u + c2 X0,v + c3 m0 at the u, v of now with the rows of then

which is turned, as the bristle b0 is, as the tangents and the normal there are. The memory holds
the rows and, of a point, the last normal force, whether it was ever free, the bristle, n and g + R.
Derivatives are those of a complex step through one correction of the closest place, exact to
round-off, along d, X,u and X,v: of rank 9, on the rows of a triangle and of the point.

Source: Wriggers, Computational Contact Mechanics, Springer 2006, doi 10.1007/978-3-540-32609-0,
chapters 4 and 5 (closest point projection onto surfaces).
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import IntegerMatrix, Integers, Matrix, Vector, opener
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Indices, Number, Reals, Sizes, also, require
from ..systems import kernels
from ..systems.evaluation import evaluation
from ..systems.forces.on_rows import Place
from .facets import INSIDE, NINE, dot, extents, meet_flat, meet_triangle, trace
from .law import BEFORE, MU, Scalar, normal_force, require_law, resist

POINT = 9  #: numbers of a point in the memory: normal force, whether it was ever free, bristle, n, g + R
DISTANCE = 8  #: the last of them
OVER = 0.7  #: cosine of the angle to the normal up to which a point is over the surface, not beside its rim
READ = 3 * NINE + 3  #: rows that a point and a triangle have
ROOM = 27  #: vectors of work
D, NORMAL, SPEED, PULL, RATES, BEFORE_NOW, UNIT, BRISTLE, POINT_RATE, POINT_BEFORE, DUAL = (
    6,
    7,
    8,
    9,
    10,
    13,
    16,
    17,
    18,
    19,
    20,
)


@storable
@dataclass(frozen=True)
class FacetContacts:
    """Contact of t points with a surface of h triangles between i vertices."""

    corners: Annotated[np.ndarray, Indices("h 3", end="i")]  #: vertices of the triangles
    at: Annotated[np.ndarray, Reals("i 2")]  #: places of the vertices in the parents of their cells
    #: x, x,1, x,2 of every vertex, then of every point
    rows: Annotated[np.ndarray, Indices("f", end="y")]
    radius: Annotated[np.ndarray, Reals("t")]  #: half thickness [m], less what overlaps are kept
    law: Annotated[np.ndarray, Reals("l")]  #: numbers in the order of LAW
    #: change of speed that a change of force makes in a second, over the one allowed a step
    share: Annotated[float, Number()]
    power: Annotated[np.ndarray, Reals("p")]  #: numbers in the order of POWER
    weights: Annotated[np.ndarray, Reals("t")]  #: factors of the forces of a point

    def __len__(self) -> int:
        return len(self.radius)


@also.register(FacetContacts)
def check_facets(term: FacetContacts, name: str, sizes: Sizes) -> None:
    """Numbers that compiled code reads without looking are there."""
    require(len(term.corners) > 0, f"{name}.corners", "a triangle or more", len(term.corners))
    expected = NINE * len(term.at) + 3 * len(term)
    require(len(term.rows) == expected, f"{name}.rows", f"{expected} rows", len(term.rows))
    require_law(term.law, term.power, name)


class FacetsRecord(NamedTuple):
    """The same for compiled code."""

    corners: IntegerMatrix
    at: Matrix
    rows: Integers
    radius: Vector
    weights: Vector
    law: Vector
    share: float
    memory: int  #: first place in the memory: the rows, then POINT numbers a point
    room: int  #: first place in the room: clearances of the points, then bounds of ways


opened = opener(FacetsRecord)


@jit
def place_of(F: Any, f: int, k: int, j: int) -> int:
    """The place in y of the row j < READ of the triangle f and the point k."""
    if j < 3 * NINE:
        return int(NINE * F.corners[f, j // NINE] + j % NINE)
    return NINE * len(F.at) + 3 * k + j - 3 * NINE


@jit
def read_rates(table: Any, F: Any, f: int, k: int, v: np.ndarray) -> None:
    """v (f,) = rates of the rows of a triangle and a point."""
    E = evaluation(table)
    for j in range(READ):
        i = place_of(F, f, k, j)
        v[i] = kernels.row_value(E.arrays.probes, F.rows[i], E.space.v)


@jit
def measure_extents(F: Any, y: np.ndarray) -> tuple[float, float]:
    """As `contact_facets.extents`."""
    return extents(y, F.corners, F.at)


@jit
def point(F: Any, k: int, y: np.ndarray) -> np.ndarray:
    """The place (3,) of a point."""
    first = NINE * len(F.at) + 3 * k
    return y[first : first + 3]


@jit
def find_flat(F: Any, k: int, y: np.ndarray, long: float, limit: float) -> float:
    """Distance of a point from the closest flat triangle, or the limit."""
    p = point(F, k, y)
    for f in range(len(F.corners)):
        if away_from_vertex(F, f, p, y) - long < limit:
            limit = min(limit, meet_flat(y, F.corners[f], p)[0])
    return limit


@jit
def away_from_vertex(F: Any, f: int, p: np.ndarray, y: np.ndarray) -> float:
    """Distance of p from the first vertex of a triangle."""
    a = NINE * F.corners[f, 0]
    square = 0.0
    for c in range(3):
        square += (p[c] - y[a + c]) ** 2
    return np.sqrt(square)


@jit
def find(
    F: Any,
    k: int,
    y: np.ndarray,
    within: tuple[float, float],
    limit: float,
    w: np.ndarray,
    W: np.ndarray,
) -> tuple[float, int, float, float, int]:
    """Distance, triangle, u, v of the closest place of a point, and where that is held; w[0:7] and
    W are current.

    The distance is infinite where it is more than the limit.
    """
    long, bulge = within
    near = find_flat(F, k, y, long, limit + bulge) + 2.0 * bulge
    p = point(F, k, y)
    best = np.inf
    found = -1
    at_u = 0.0
    at_v = 0.0
    held = INSIDE
    for f in range(len(F.corners)):
        if away_from_vertex(F, f, p, y) - long >= near:
            continue
        flat, u, v = meet_flat(y, F.corners[f], p)
        if flat > near or flat - bulge >= best:
            continue
        u, v, stays = meet_triangle(y, F.corners[f], at_corners(F, f), p, u, v, w, W)
        away = np.sqrt(dot(w[D], w[D]))
        if away < best:
            best, found, at_u, at_v, held = away, f, u, v, stays
    if not best <= limit:
        return np.inf, found, at_u, at_v, held
    at_u, at_v, held = meet_triangle(y, F.corners[found], at_corners(F, found), p, at_u, at_v, w, W)
    return best, found, at_u, at_v, held


@jit
def at_corners(F: Any, f: int) -> np.ndarray:
    """Places (3, 2) of the vertices of a triangle in the parent of its cell."""
    found = np.empty((3, 2))
    for i in range(3):
        for c in range(2):
            found[i, c] = F.at[F.corners[f, i], c]
    return found


@jit
def lay_normal(w: np.ndarray, first: int, out: int, duals: int) -> None:
    """Unit normal of the tangents a, b in w[first], w[first + 1], and their dual vectors.

        n = a x b / |a x b|,    a^1 = b x n / |a x b|,    a^2 = n x a / |a x b|

    into w[out], w[duals] and w[duals + 1].
    """
    a, b, m = w[first], w[first + 1], w[out]
    cross(a, b, m)
    long = np.sqrt(dot(m, m))
    for c in range(3):
        m[c] = m[c] / long
    cross(b, m, w[duals])
    cross(m, a, w[duals + 1])
    for c in range(3):
        w[duals, c] = w[duals, c] / long
        w[duals + 1, c] = w[duals + 1, c] / long


@jit
def cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """out = a x b."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@jit
def overlapped(F: Any, k: int, last: np.ndarray) -> bool:
    """Whether a point overlapped the surface in the last accepted state.

    Its normal force does not say so: it is zero where what is damped leaves faster than it is
    pushed.
    """
    return bool(last[DISTANCE] < F.radius[k])


@jit
def passed(F: Any, k: int, last: np.ndarray, w: np.ndarray, way: float) -> bool:
    """Whether a point is beyond the middle of the surface as seen from where it was, with distances
    that can have changed by `way`.

    One that did not overlap is only where it is over the surface and the way is as long as that
    through it.
    """
    if not last[5] * w[D, 0] + last[6] * w[D, 1] + last[7] * w[D, 2] < 0.0:
        return False
    if overlapped(F, k, last):
        return True
    lay_normal(w, 1, UNIT, DUAL)
    away = np.sqrt(dot(w[D], w[D]))
    return last[DISTANCE] + away <= way and abs(dot(w[D], w[UNIT])) > OVER * away


@jit
def gap_of(radius: float, held: int, beyond: bool, w: np.ndarray) -> Scalar:
    """The gap of a point from w[1:7]; w[NORMAL] becomes n, w[UNIT] the normal of the surface,
    w[DUAL] its dual vectors.
    """
    lay_normal(w, 1, UNIT, DUAL)
    over = dot(w[D], w[UNIT])
    sign = -1.0 if beyond else 1.0
    if held == INSIDE:
        sign = sign if over.real >= 0.0 else -sign
        for c in range(3):
            w[NORMAL, c] = sign * w[UNIT, c]
        return sign * over - radius
    long = np.sqrt(dot(w[D], w[D]))
    for c in range(3):
        w[NORMAL, c] = sign * w[D, c] / long
    return sign * long - radius


@jit
def limit_of(F: Any, k: int, last: np.ndarray, way: float) -> float:
    """Distance up to which a point may touch."""
    if overlapped(F, k, last):
        return np.inf
    return max(F.radius[k], way if last[DISTANCE] <= way < np.inf else 0.0)


@jit
def follow(
    F: Any, f: int, k: int, v: np.ndarray, before: np.ndarray, w: np.ndarray, W: np.ndarray
) -> None:
    """w[RATES], w[BEFORE_NOW] = X, X,u, X,v of the rates v (f,) and of the rows `before` (f,), and
    those of the point.
    """
    trace(v, F.corners[f], W, 3, w, RATES)
    trace(before, F.corners[f], W, 3, w, BEFORE_NOW)
    first = NINE * len(F.at) + 3 * k
    for c in range(3):
        w[POINT_RATE, c], w[POINT_BEFORE, c] = (
            v[first + c] + 0.0 * W[0, 0],
            before[first + c] + 0.0 * W[0, 0],
        )


@jit
def press(
    F: Any,
    k: int,
    held: int,
    beyond: bool,
    last: np.ndarray,
    w: np.ndarray,
    W: np.ndarray,
    out: np.ndarray,
) -> Scalar:
    """out (READ,) = forces of a point on the rows of its triangle and on its own; its normal force
    times its weight.

    `last` is its memory. w[0:7], W and, by `follow`, what that says must be current; w[BRISTLE]
    becomes the bristle, w[SPEED] the speed of sliding.
    """
    gap = gap_of(F.radius[k], held, beyond, w)
    rate = 0.0 * w[0, 0]
    parts = dot(w[D], w[DUAL]), dot(w[D], w[DUAL + 1]), dot(w[D], w[UNIT])
    for c in range(3):
        rate -= w[NORMAL, c] * (w[POINT_RATE, c] - w[RATES, c])
    N = normal_force(F.law, -gap, rate)
    one, other = dot(w[UNIT], w[RATES + 1]), dot(w[UNIT], w[RATES + 2])
    for c in range(3):
        turned = parts[2] * (w[DUAL, c] * one + w[DUAL + 1, c] * other)
        w[SPEED, c] = (
            w[POINT_RATE, c]
            - w[RATES, c]
            - parts[0] * w[RATES + 1, c]
            - parts[1] * w[RATES + 2, c]
            + turned
        )
        w[PULL, c] = w[BRISTLE, c] = 0.0 * rate
    across(w, SPEED)
    if N.real > 0.0 and F.law[MU] > 0.0:
        if last[0] >= 0.0:
            slip(parts, last, w)
        else:
            for c in range(3):
                w[BRISTLE, c] = BEFORE * w[SPEED, c]
        across(w, BRISTLE)
        resist(F.law, N, w[BRISTLE], w[SPEED], w[PULL], 3)
    share_out(parts, F.weights[k], N, w, W, out)
    return F.weights[k] * N


@jit
def across(w: np.ndarray, row: int) -> None:
    """w[row] without its part along the normal."""
    along = dot(w[NORMAL], w[row])
    for c in range(3):
        w[row, c] = w[row, c] - along * w[NORMAL, c]


@jit
def slip(parts: tuple[Scalar, Scalar, Scalar], last: np.ndarray, w: np.ndarray) -> None:
    """w[BRISTLE] = the last bristle and the change of the material points since then, turned to the
    state of now.
    """
    first = BEFORE_NOW
    unit = DUAL + 2
    dual = DUAL + 3
    vector = DUAL + 5
    lay_normal(w, first + 1, unit, dual)
    for c in range(3):
        there = (
            w[first, c]
            + parts[0] * w[first + 1, c]
            + parts[1] * w[first + 2, c]
            + parts[2] * w[unit, c]
        )
        w[vector, c] = last[2 + c] + there - w[POINT_BEFORE, c]
    one, other, over = dot(w[vector], w[dual]), dot(w[vector], w[dual + 1]), dot(w[vector], w[unit])
    for c in range(3):
        w[BRISTLE, c] = one * w[1, c] + other * w[2, c] + over * w[UNIT, c]


@jit
def share_out(
    parts: tuple[Scalar, Scalar, Scalar],
    weight: float,
    N: Scalar,
    w: np.ndarray,
    W: np.ndarray,
    out: np.ndarray,
) -> None:
    """out (READ,) = the normal force N and friction w[PULL], times the weight of a point, on all
    rows.
    """
    pulls = dot(w[PULL], w[DUAL]), dot(w[PULL], w[DUAL + 1])
    for c in range(3):
        force = N * w[NORMAL, c] + w[PULL, c]
        one = parts[2] * pulls[0] * w[UNIT, c] - parts[0] * w[PULL, c]
        other = parts[2] * pulls[1] * w[UNIT, c] - parts[1] * w[PULL, c]
        for j in range(NINE):
            out[3 * j + c] = weight * (W[1, j] * one + W[2, j] * other - W[0, j] * force)
        out[3 * NINE + c] = weight * force


def record_of(found: FacetContacts, place: Place) -> FacetsRecord:
    """A contact for compiled code."""
    numbers = (
        found.at,
        found.rows,
        found.radius,
        found.weights,
        np.concatenate([found.law, found.power]),
    )
    arrays = [np.ascontiguousarray(part) for part in (found.corners, *numbers)]
    return FacetsRecord._make((*arrays, found.share, place.memory, place.room))
