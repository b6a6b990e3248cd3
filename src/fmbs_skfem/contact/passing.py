r"""Whether what touched a shape, or another beam, has gone through it, rather than around it or
back.

    n0, n1           unit normals of the shape where a point went in and where it came out, without their parts along its body
    c = n1 - n0,  m = n1 + n0,  D = R (1 - |m| / 2)          (at right angles; the deepest place of the straight way between both)

The point, which moves with v, has gone through where all of these hold:

    n0 . v < - min(3 / 10, |c| / 4) |v|          it goes on inward, by half of what is straight: nothing has thrown it back
    |m| m . v > - |c| c . v / 2,  c . v > 0      it has not followed the surface, along which - |c| c . v would stand there
    D / 4 <= deepest <= 4 D,  R / 50 <= deepest  it was about as deep as the straight way; of boxes, whose sides are flat, D / 4
                                                 does not count

A rope that is drawn over a thin support stays on its side of it, although each of its points goes
in on one side and comes out on the other: what lies along the body does not count. Of a line in the
plane, or a surface in space, one direction is left, and n1 is n0 or - n0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from .nearness import read
from .shapes import BOX, CYLINDER, SPHERE
from .slip import component, place

# a ball of 1 cm that a mass meets 0.2 mm off its rim turns it aside by 16 degrees, if it is hard;
# half of that goes unsaid
DEEP = 0.02  #: depth over the radius below which a shape is grazed
# what follows the surface is less deep than the way that cuts it off, what rests and is moved on
# much deeper; a mass that is thrown out sideways from near the middle has 1.7
LEAST, MOST = 0.25, 4.0  #: depth over that of the straight way
STRAIGHT = 0.5  #: of the angle between a straight way and one along the surface
#: sine of the angle to the surface where a point went in, below which it is thrown aside
INWARD = 0.3
# (2/3)^16 = 1.5e-3 of the way: what is thinner than that is grazed; half of them leave 4 %, twice
# 2e-6
THIRDS = 16  #: times that a way is cut by a third where a point may have passed a shape
# the straight way between two places outside of a round shape cuts off a nanometre: without it such
# a step is divided by 64 for nothing
GRAZED = 0.999  #: cosine of the angle between normals before and behind a shape that is grazed: 1e-4 of its radius deep
HALVES = 12  #: of the step in which a point came in or out: 2e-4 of its way
FLAT = 0.3  #: part of a normal across a body below which it has no side


@jit
def strip(x: np.ndarray, tangents: np.ndarray, count: int) -> None:
    """x (c,) without its parts along `count` tangents (2, c) of length one at right angles."""
    for j in range(count):
        along = 0.0
        for c in range(len(x)):
            along += x[c] * tangents[j, c]
        for c in range(len(x)):
            x[c] -= along * tangents[j, c]


@jit
def make_unit(x: np.ndarray, least: float) -> bool:
    """Whether x (c,) is longer than `least`; it is then made a unit vector."""
    square = 0.0
    for c in range(len(x)):
        square += x[c] * x[c]
    if not square > least * least:
        return False
    for c in range(len(x)):
        x[c] /= np.sqrt(square)
    return True


@jit
def lay_across(n0: np.ndarray, n1: np.ndarray, tangents: np.ndarray, count: int) -> bool:
    """Whether two normals (c,) have sides across a body with `count` tangents (2, c); they become
    unit vectors across it.
    """
    laid = 0
    for j in range(count):
        long = make_unit(tangents[j], 0.0)
        strip(tangents[j], tangents, laid)
        # one that is nearly along the first one has no direction of its own
        if long and make_unit(tangents[j], FLAT):
            for c in range(len(n0)):
                tangents[laid, c] = tangents[j, c]
            laid += 1
    strip(n0, tangents, laid)
    strip(n1, tangents, laid)
    return make_unit(n0, FLAT) and make_unit(n1, FLAT)


@jit
def cosine_across(n0: np.ndarray, n1: np.ndarray, tangents: np.ndarray, count: int) -> float:
    """Cosine of the angle between two normals as `lay_across` makes them, 1 where they have no
    sides.
    """
    along = 0.0
    if not lay_across(n0, n1, tangents, count):
        return 1.0
    for c in range(len(n0)):
        along += n0[c] * n1[c]
    return along


@jit
def goes_through(
    n0: np.ndarray, n1: np.ndarray, v: np.ndarray, deepest: float, radius: float, least: float
) -> bool:
    """Whether a point that moves with v (c,) has gone through a shape of a radius, from a normal n0
    to n1, and how deep.

    `least`: depth over that of the straight way.
    """
    inward, ahead, out, cc, mm = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(v)):
        c = n1[i] - n0[i]
        m = n1[i] + n0[i]
        inward -= n0[i] * v[i]
        ahead, out = ahead + c * v[i], out + m * v[i]
        cc, mm = cc + c * c, mm + m * m
    long, wide = np.sqrt(cc), np.sqrt(mm)
    way = radius * (1.0 - 0.5 * wide)
    deep = deepest >= max(least * way, DEEP * radius) and deepest <= MOST * way
    if not deep or not ahead > 0.0:
        return False
    square = (ahead / long) ** 2 + ((out / wide) ** 2 if wide > 0.0 else 0.0)
    return (
        inward > min(INWARD, 0.25 * long) * np.sqrt(square)
        and wide * out > -STRAIGHT * long * ahead
    )


@jit
def deepest(F: Any) -> int:
    """Where the memory of a point holds how deep it has been since it came in; behind it stands the
    normal there.
    """
    return 2 + F.placed.shape[1] + F.rows.shape[1] + len(F.frame)


@jit
def size_of(F: Any, k: int) -> float:
    """Smallest radius of a shape and a point together that one can go through [m]; 0 of shapes
    without a side behind.
    """
    if F.shape == BOX:
        least = F.sizes[0]
        for c in range(1, len(F.sizes)):
            least = min(least, F.sizes[c])
        return least + F.radius[k]
    if F.shape not in (SPHERE, CYLINDER) or F.sizes[1] < 0.0:
        return 0.0
    thin = F.shape == CYLINDER and F.placed.shape[1] == 3
    return (min(F.sizes[0], F.sizes[2]) if thin else F.sizes[0]) + F.radius[k]


@jit
def remember_entry(F: Any, k: int, last: np.ndarray, y: np.ndarray, w: np.ndarray) -> float:
    """How deep a point with rows y has been since it came in; the memory `last` of it takes the
    normal where it did.
    """
    dim = F.placed.shape[1]
    first = deepest(F)
    deep = -place(F, k, y, w)
    if last[first] == 0.0:
        # a normal of what is not a box is in the axes of the scene: a roller turns below what it
        # carries
        if last[0] >= 0.0:
            meet_surface(F, k, last[2 + dim : first], y, w)
        for c in range(dim):
            last[first + 1 + c] = w[1, c]
            if F.shape != BOX:
                last[first + 1 + c] = 0.0
                for i in range(dim):
                    last[first + 1 + c] += w[1, i] * component(F, y, i, c)
    return max(deep, last[first])


@jit
def meet_surface(F: Any, k: int, outside: np.ndarray, inside: np.ndarray, w: np.ndarray) -> None:
    """w[0], w[1] = where the way between two rows meets a shape, as of `place`."""
    low = 0.0
    high = 1.0
    between = np.empty(len(inside))
    for _ in range(HALVES):
        t = 0.5 * (low + high)
        for j in range(len(between)):
            between[j] = outside[j] + t * (inside[j] - outside[j])
        if place(F, k, between, w) < 0.0:
            high = t
        else:
            low = t


@jit
def find_tangents(table: Any, F: Any, k: int, y: np.ndarray, tangents: np.ndarray) -> int:
    """tangents (2, c) = those of the body at a point with rows y, in the axes of the shape; how
    many there are.
    """
    dim = F.placed.shape[1]
    count = F.beside.shape[1] // 2
    one, other = np.empty(dim), np.empty(dim)
    for j in range(count):
        read(table, F.rows[F.beside[k, 2 * j], :dim], one)
        read(table, F.rows[F.beside[k, 2 * j + 1], :dim], other)
        for i in range(dim):
            tangents[j, i] = 0.0
            for c in range(dim):
                tangents[j, i] += (other[c] - one[c]) * component(F, y, i, c)
    return count


@jit
def came_through(
    table: Any, F: Any, k: int, last: np.ndarray, y: np.ndarray, w: np.ndarray
) -> bool:
    """Whether a point with rows y, which is out of a shape again, has gone through it since it came
    in.
    """
    dim = F.placed.shape[1]
    first = deepest(F)
    radius = size_of(F, k)
    if last[first] < DEEP * radius or radius == 0.0:
        return False
    n0 = np.empty(dim)
    n1 = np.empty(dim)
    v = np.empty(dim)
    before = last[2 + dim : first]
    place(F, k, y, w)
    for i in range(dim):
        n0[i], v[i] = last[first + 1 + i], w[0, i]
    place(F, k, before, w)
    for i in range(dim):
        v[i] -= w[0, i]
        if F.shape != BOX:
            n0[i], v[i] = 0.0, 0.0
            for c in range(dim):
                way = y[c] - component(F, y, -1, c) - before[c] + component(F, before, -1, c)
                n0[i] += last[first + 1 + c] * component(F, y, i, c)
                v[i] += way * component(F, y, i, c)
    meet_surface(F, k, y, before, w)
    for i in range(dim):
        n1[i] = w[1, i]
    tangents = np.zeros((2, dim))
    sided = lay_across(n0, n1, tangents, find_tangents(table, F, k, y, tangents))
    return sided and goes_through(n0, n1, v, last[first], radius, DEEP if F.shape == BOX else LEAST)


@jit
def turned(table: Any, F: Any, k: int, before: np.ndarray, y: np.ndarray, w: np.ndarray) -> float:
    """Cosine of the angle between the normals of a point with the rows y and with those of
    `before`, in the axes of the shape.

    Of points of a body it is that of their parts across it, 1 where they have none.
    """
    # in the axes of the shape, so that its own motion does not count
    dim = F.placed.shape[1]
    place(F, k, y, w)
    for c in range(dim):
        w[2, c] = w[1, c]
    place(F, k, before, w)
    along = 0.0
    for c in range(dim):
        along += w[1, c] * w[2, c]
    if along > GRAZED or F.beside.shape[1] == 0:
        return along
    # what is drawn along over a thin shape leaps from side to side of it, and stays over it
    n0, n1, tangents = np.empty(dim), np.empty(dim), np.empty((2, dim))
    for c in range(dim):
        n0[c], n1[c] = w[1, c], w[2, c]
    return cosine_across(n0, n1, tangents, find_tangents(table, F, k, y, tangents))


@jit
def passed(table: Any, F: Any, k: int, before: np.ndarray, y: np.ndarray, w: np.ndarray) -> bool:
    """Whether a point with rows y that touches neither now nor `before` was in the shape between:
    gaps along lines are convex.

    What is grazed alone, where normals hardly turn, does not count.
    """
    if turned(table, F, k, before, y, w) > GRAZED:
        return False
    low = 0.0
    high = 1.0
    between = np.empty(len(y))
    far = place(F, k, before, w)
    way = 0.0
    dim = F.placed.shape[1]
    if far < 0.0:  # it leaves, without a force
        return False
    far = min(far, place(F, k, y, w))
    for c in range(dim):
        way += (y[c] - before[c] - (component(F, y, -1, c) - component(F, before, -1, c))) ** 2
    # a way shorter than the gap at its ends cannot have met the shape
    if far * far > way:
        return False
    # gaps along a straight line are convex for convex shapes: thirds close in on the least one
    for _ in range(THIRDS):
        gaps = (0.0, 0.0)
        for part in range(2):
            t = low + (1.0 + part) / 3.0 * (high - low)
            for j in range(len(y)):
                between[j] = before[j] + t * (y[j] - before[j])
            gap = place(F, k, between, w)
            if gap < 0.0:
                return True
            gaps = (gap, 0.0) if part == 0 else (gaps[0], gap)
        if gaps[0] < gaps[1]:
            high -= (high - low) / 3.0
        else:
            low += (high - low) / 3.0
    return False
