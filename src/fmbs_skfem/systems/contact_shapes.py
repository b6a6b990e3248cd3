r"""Shapes that contact meets: signed distances g(z) with their normals n = dg/dz, in the axes of the shape.

    plane          g = z_d                                     d the last axis, which is its normal
    sphere         g = |z| - R,                                from inside R - |z|
    cylinder       g = |z - z_d e_d| - R,                      about the last axis; from outside one with ends is a box in
                                                               (|z - z_d e_d|, z_d), from inside a tube that ends
    box            g = |max(|z| - h, 0)|, in it max(|z| - h),  h its half sides: edges and corners are round from outside
    heights        g = (z_d - f) / sqrt(1 + |grad f|^2),       f a smooth cubic through heights on a grid

In the plane a sphere is a circle, and so is a cylinder; a height field is a profile. Beyond the ends of a tube and the edges of a
height field nothing is touched. All numbers may be complex, which is how contact finds its derivatives.

Source of the cubic: Catmull and Rom, Computer Aided Geometric Design (1974) 317-326, doi 10.1016/B978-0-12-079050-0.50020-5.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import jit
from .contact_law import Scalar

PLANE, SPHERE, CYLINDER, BOX, HEIGHTS = range(5)
NUMBERS = {dim: {PLANE: 0, SPHERE: 2, CYLINDER: 3, BOX: dim, HEIGHTS: dim - 1} for dim in (2, 3)}  #: how many sizes they have
FAR = 1e300  #: distance where a shape has ended [m]
OVER = 0.3  #: by how much the cubic rises above all heights at most, over their range: 9 / 32 in space


@jit
def measure(shape: int, sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> Scalar:
    """The distance of z (c,) from a shape with its sizes (i,) and heights (i, j) [m]; n (c,) becomes the normal there."""
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
    distance, side = np.sqrt(square), sizes[1]
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
    """Distance and normal of the end of a cylinder at a point z (3,) beyond its end, or below its end and deeper below its side."""
    up, over = (1.0 if z[2].real > 0.0 else -1.0), radius - sizes[0]
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
def distances(shape: int, sizes: np.ndarray, heights: np.ndarray, z: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Distances (x,) of points z (x, c) in the axes of a shape; n (x, c) becomes their normals."""
    found = np.empty(len(z))
    for k in range(len(z)):
        found[k] = measure(shape, sizes, heights, z.shape[1], z[k], n[k])
    return found


@jit
def clearance(shape: int, sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> float:
    """How far z is away at least [m], which no motion changes by more than its length; n (c,) is room."""
    if shape == HEIGHTS:
        low, high = heights.min(), heights.max()
        return z[dim - 1] - high - OVER * (high - low)
    if shape == CYLINDER and dim == 3:
        return sizes[1] * (np.sqrt(z[0] * z[0] + z[1] * z[1]) - sizes[0])
    return measure(shape, sizes, heights, dim, z, n)


@jit
def box(half: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> Scalar:
    """Distance and normal of a box of half edges (c,)."""
    deepest, outside, square = 0, 0, 0.0 * z[0]
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
    """Of four heights in the cubic between the middle two, u from 0 to 1."""
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
def field(sizes: np.ndarray, heights: np.ndarray, dim: int, z: np.ndarray, n: np.ndarray) -> Scalar:
    """Distance and normal of heights (i, j) at steps of sizes[0] along the first and sizes[1] along the second axis, from z = 0."""
    many, across = heights.shape
    i = int(np.floor(z[0].real / sizes[0]))
    if i < 0 or i >= many - 1:
        return FAR + 0.0 * z[0]
    u = z[0] / sizes[0] - i
    a, da = shares(u), slopes(u)
    f, fx, fy = 0.0 * u, 0.0 * u, 0.0 * u
    if dim == 2:
        for k in range(4):
            height = heights[min(max(i + k - 1, 0), many - 1), 0]
            f += a[k] * height
            fx += da[k] * height
    else:
        j = int(np.floor(z[1].real / sizes[1]))
        if j < 0 or j >= across - 1:
            return FAR + 0.0 * z[0]
        v = z[1] / sizes[1] - j
        b, db = shares(v), slopes(v)
        for k in range(4):
            for l in range(4):
                height = heights[min(max(i + k - 1, 0), many - 1), min(max(j + l - 1, 0), across - 1)]
                f += a[k] * b[l] * height
                fx += da[k] * b[l] * height
                fy += a[k] * db[l] * height
        n[1] = -fy / sizes[1]
    n[0] = -fx / sizes[0]
    long = np.sqrt(1.0 + n[0] * n[0] + (n[1] * n[1] if dim == 3 else 0.0 * u))
    gap = (z[dim - 1] - f) / long
    for c in range(dim - 1):
        n[c] = n[c] / long
    n[dim - 1] = 1.0 / long
    return gap
