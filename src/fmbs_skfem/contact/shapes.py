r"""Shapes that contact meets: signed distances g(z) with their normals n = dg/dz, in the axes of
the shape.

    plane          g = z_d                                     d the last axis, which is its normal
    sphere         g = |z| - R,                                from inside R - |z|
    cylinder       g = |z - z_d e_d| - R,                      about the last axis; from outside one with ends is a box in
                                                               (|z - z_d e_d|, z_d), from inside a tube that ends
    box            g = |max(|z| - h, 0)|, in it max(|z| - h),  h its half sides: edges and corners are round from outside
    heights        g = n . (z - p),  p the nearest point,      of f, a smooth cubic through heights on a grid, in the cells at its
                                                               border a parabola

In the plane a sphere is a circle, and so is a cylinder; a height field is a profile. Beyond the
ends of a tube and the edges of a height field nothing is touched. All numbers may be complex, which
is how contact finds its derivatives.

Source of the cubic: Catmull and Rom, Computer Aided Geometric Design (1974) 317-326, doi
10.1016/B978-0-12-079050-0.50020-5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from .law import Scalar

PLANE, SPHERE, CYLINDER, BOX, HEIGHTS = range(5)
#: how many sizes they have
NUMBERS = {dim: {PLANE: 0, SPHERE: 2, CYLINDER: 3, BOX: dim, HEIGHTS: dim - 1} for dim in (2, 3)}
FAR = 1e300  #: distance where a shape has ended [m]
FEET, HALVES = 20, 10  #: steps to the nearest point of a height field at most, and halves of each
SINGULAR = 1e-6  #: of the square of a distance: curvature below which a nearest point is none
#: by how much the cubic rises above all heights at most, over their range: 9 / 32 in space
OVER = 0.3


@jit
def measure(
    shape: int, sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray
) -> Scalar:
    """The distance of z (c,) from a shape with its sizes (i,) and heights (i, j) [m]; n (c,)
    becomes the normal there.
    """
    last = dim - 1
    for c in range(dim):
        n[c] = 0.0 * z[c]
    if shape == PLANE:
        n[last] += 1.0
        return z[last]
    if shape == BOX:
        return box(sizes, dim, z, n)
    if shape == HEIGHTS:
        return field(sizes, heights, dim, z, n)
    around = last if shape == CYLINDER and dim == 3 else dim
    beyond = abs(z[last].real) - sizes[2] if around < dim else -FAR
    if beyond > 0.0 and sizes[1] < 0.0:
        return FAR + 0.0 * z[last]
    square = 0.0 * z[0]
    for c in range(around):
        square += z[c] * z[c]
    distance = np.sqrt(square)
    side = sizes[1]
    if side > 0.0 and beyond > min(distance.real - sizes[0], 0.0):
        return capped(sizes, distance, z, n)
    if distance.real == 0.0:
        n[around - 1] += side
        return -side * sizes[0] + distance
    for c in range(around):
        n[c] = side * z[c] / distance
    return side * (distance - sizes[0])


@jit
def capped(sizes: np.ndarray, radius: Scalar, z: np.ndarray, n: np.ndarray) -> Scalar:
    """Distance and normal of the end of a cylinder at a point z (3,) beyond its end, or below its
    end and deeper below its side.
    """
    up = 1.0 if z[2].real > 0.0 else -1.0
    over = radius - sizes[0]
    high = up * z[2] - sizes[2]
    if over.real <= 0.0:
        n[2] += up
        return high
    distance = np.sqrt(over * over + high * high)
    for c in range(2):
        n[c] = over * z[c] / (radius * distance)
    n[2] = up * high / distance
    return distance


@jit
def distances(
    shape: int, sizes: np.ndarray, heights: np.ndarray, z: np.ndarray, n: np.ndarray
) -> np.ndarray:
    """Distances (x,) of points z (x, c) in the axes of a shape; n (x, c) becomes their normals."""
    found = np.empty(len(z))
    for k in range(len(z)):
        found[k] = measure(shape, sizes, heights, z.shape[1], z[k], n[k])
    return found


@jit
def clearance(
    shape: int, sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray
) -> float:
    """How far z is away at least [m], which no motion changes by more than its length; n (c,) is
    room.
    """
    if shape == HEIGHTS:
        low = high = heights[0, 0]
        for row in heights:
            for height in row:
                low, high = min(low, height), max(high, height)
        return z[dim - 1] - high - OVER * (high - low)
    if shape == CYLINDER and dim == 3:
        return sizes[1] * (np.sqrt(z[0] * z[0] + z[1] * z[1]) - sizes[0])
    return measure(shape, sizes, heights, dim, z, n)


@jit
def box(half: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> Scalar:
    """Distance and normal of a box of half edges (c,)."""
    deepest = 0
    outside = 0
    square = 0.0 * z[0]
    for c in range(dim):
        over = abs(z[c].real) - half[c]
        deepest = c if over > abs(z[deepest].real) - half[deepest] else deepest
        if over > 0.0:
            sign = 1.0 if z[c].real > 0.0 else -1.0
            n[c] = z[c] - sign * half[c]
            square += n[c] * n[c]
            outside += 1
    if outside == 0:
        sign = 1.0 if z[deepest].real >= 0.0 else -1.0
        n[deepest] += sign
        return sign * z[deepest] - half[deepest]
    distance = np.sqrt(square)
    for c in range(dim):
        n[c] = n[c] / distance
    return distance


@jit
def shares(u: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Shares of four heights in the cubic between the middle two (Catmull and Rom).

        (-u + 2 u^2 - u^3) / 2,  (2 - 5 u^2 + 3 u^3) / 2,  (u + 4 u^2 - 3 u^3) / 2,  (u^3 - u^2) / 2

    u runs from 0 to 1.
    """
    return (
        0.5 * u * (u * (2.0 - u) - 1.0),
        0.5 * (u * u * (3.0 * u - 5.0) + 2.0),
        0.5 * u * (u * (4.0 - 3.0 * u) + 1.0),
        0.5 * u * u * (u - 1.0),
    )


@jit
def slopes(u: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Derivatives of these by u."""
    return (
        0.5 * (u * (4.0 - 3.0 * u) - 1.0),
        0.5 * u * (9.0 * u - 10.0),
        0.5 * (u * (8.0 - 9.0 * u) + 1.0),
        0.5 * u * (3.0 * u - 2.0),
    )


@jit
def bends(u: Scalar) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Second derivatives of these by u."""
    return 2.0 - 3.0 * u, 9.0 * u - 5.0, 4.0 - 9.0 * u, 3.0 * u - 1.0


@jit
def fold(
    a: tuple[Scalar, Scalar, Scalar, Scalar], i: int, count: int
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Of shares of the heights i - 1 to i + 2 out of so many, those beyond the ends put onto the
    ones inside.

    Beyond an end the parabola through the last three heights goes on, the line through two, so that
    the cubic holds parabolas and lines up to its border. A single height has all shares.
    """
    b, c, d, e = a
    if count == 2:
        return 0.0 * b, c + 2.0 * b - e, d + 2.0 * e - b, 0.0 * e
    if i == 0 and count > 2:
        b, c, d, e = 0.0 * b, c + 3.0 * b, d - 3.0 * b, e + b
    if i == count - 2 and count > 2:
        b = b + e
        c = c - 3.0 * e
        d = d + 3.0 * e
        e = 0.0 * e
    return b, c, d, e


@jit
def height(
    sizes: np.ndarray, heights: np.ndarray, x: Scalar, y: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar, Scalar]:
    """f, f,x, f,y, f,xx, f,xy, f,yy of heights (i, j) at steps of sizes (d,) from 0; the last cells
    go on beyond the edges.

    A profile is one column, whose shares sum to one and their derivatives to zero.
    """
    many, across = heights.shape
    i = min(max(int(np.floor(x.real / sizes[0])), 0), many - 2)
    j = min(max(int(np.floor(y.real / sizes[-1])), 0), across - 2)
    wide = sizes[0]
    deep = sizes[-1]
    u = x / sizes[0] - i
    v = y / sizes[-1] - j
    a, da, dda = fold(shares(u), i, many), fold(slopes(u), i, many), fold(bends(u), i, many)
    b, db, ddb = fold(shares(v), j, across), fold(slopes(v), j, across), fold(bends(v), j, across)
    f, fx, fy, fxx, fxy, fyy = 0.0 * u, 0.0 * u, 0.0 * u, 0.0 * u, 0.0 * u, 0.0 * u
    for k in range(4):
        for l in range(4):
            h = heights[min(max(i + k - 1, 0), many - 1), min(max(j + l - 1, 0), across - 1)]
            f += a[k] * b[l] * h
            fx += da[k] * b[l] * h / wide
            fy += a[k] * db[l] * h / deep
            fxx += dda[k] * b[l] * h / wide**2
            fxy += da[k] * db[l] * h / (wide * deep)
            fyy += a[k] * ddb[l] * h / deep**2
    return f, fx, fy, fxx, fxy, fyy


@jit
def curvature(over: float, F: Any) -> tuple[Scalar, Scalar, Scalar]:
    """Second derivatives, xx, xy and yy, of half the square of the distance from a point `over`
    heights f with derivatives F.

        1 + f,x^2 - over f,xx,    f,x f,y - over f,xy,    1 + f,y^2 - over f,yy
    """
    _, fx, fy, fxx, fxy, fyy = F
    return 1.0 + fx * fx - over * fxx, fx * fy - over * fxy, 1.0 + fy * fy - over * fyy


@jit
def toward(
    q: Scalar, p: Scalar, z: Scalar, x: float, y: float, F: Any, bent: float
) -> tuple[Scalar, Scalar]:
    """Newton's step from (x, y) to where the way to (q, p, z) is normal to heights with derivatives
    F there; bent 0: Gauss's.

        (x - q, y - p) + (f - z) (f,x, f,y) = 0
    """
    over = z - F[0]
    r, s = q - x + over * F[1], p - y + over * F[2]
    xx, xy, yy = curvature(bent * over.real, F)
    det = xx * yy - xy * xy
    return (yy * r - xy * s) / det, (xx * s - xy * r) / det


@jit
def convex(z: float, F: Any) -> float:
    """1 where half the square of the distance from a point at a height z is convex in its foot with
    F, else 0.
    """
    xx, xy, yy = curvature(z - F[0], F)
    least = SINGULAR * (1.0 + F[1] * F[1] + F[2] * F[2])
    return 1.0 if xx > least and xx * yy - xy * xy > least else 0.0


@jit
def field(sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> Scalar:
    """Distance and normal of heights (i, j) at steps of sizes[0] along the first and sizes[1] along
    the second axis, from z = 0.

    Newton's iteration goes from the point below to the nearest one around; its last step carries
    derivatives.
    """
    last = dim - 1
    for c in range(last):
        if not 0.0 <= z[c].real < sizes[c] * (heights.shape[c] - 1):
            return FAR + 0.0 * z[0]
    q = z[0].real
    p = z[1].real if dim == 3 else 0.0
    up = z[last].real
    x, y = q, p
    F = height(sizes, heights, x, y)
    way = (up - F[0]) ** 2
    for _ in range(FEET):
        dx, dy = toward(q, p, up, x, y, F, convex(up, F))
        part = 1.0
        found = x
        G = F
        shorter = False
        for _ in range(HALVES):
            G = height(sizes, heights, x + part * dx, y + part * dy)
            found = (q - x - part * dx) ** 2 + (p - y - part * dy) ** 2 + (up - G[0]) ** 2
            shorter = found < way
            if shorter:
                break
            part *= 0.5
        if not shorter:
            break
        x = x + part * dx
        y = y + part * dy
        F = G
        way = found
    own = z[1] if dim == 3 else 0.0 * z[0]
    by, across = toward(z[0], own, z[last], x, y, F, convex(up, F))
    f, fx, fy, _, _, _ = height(sizes, heights, x + by, y + across)
    long = np.sqrt(1.0 + fx * fx + fy * fy)
    n[0], n[last] = -fx / long, 1.0 / long
    gap = (z[0] - x - by) * n[0] + (z[last] - f) * n[last]
    if dim == 3:
        n[1] = -fy / long
        gap += (z[1] - y - across) * n[1]
    return gap


def roundness(
    shape: int, sizes: Sequence[float], heights: np.ndarray, dim: int
) -> tuple[float, float]:
    """Smallest radius with which a shape meets bodies, and that of gaps through which it passes
    [m]; infinite for what is flat.

    A box has edges, but passes only where half of its smallest side does; a ridge of heights where
    it stands between two points.
    """
    if shape == BOX:
        return 0.0, float(min(sizes))
    if shape == HEIGHTS:
        ridge = bend_of(np.asarray(sizes), heights)
        return ridge, max(ridge, 0.5 * min(sizes))
    if shape == PLANE or sizes[1] < 0.0:
        return np.inf, np.inf
    return sizes[0], min(sizes[0], sizes[2]) if shape == CYLINDER and dim == 3 else sizes[0]


def bend_of(steps: np.ndarray, heights: np.ndarray) -> float:
    """Smallest radius of the ridges of heights (i, j) [m], at nodes and half way between."""
    least = 0.0
    for i, j in np.ndindex(2 * heights.shape[0] - 1, 2 * heights.shape[1] - 1):
        _, _, _, xx, xy, yy = height(steps, heights, 0.5 * i * steps[0], 0.5 * j * steps[-1])
        least = min(least, 0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy))
    return -1.0 / least if least < 0.0 else np.inf
