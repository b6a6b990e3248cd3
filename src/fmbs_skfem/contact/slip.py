r"""How far the material points slip that meet in a contact with a shape, over a step: Simpson's
rule of weights times changes.

    r' + sum_j s_j a_j' - o' - sum_k w_k E_k',    s_j = - R n . a_j / |a_j|^2,    w_k = z_k - R dg/dz_k

over a step is the sum of <weights> times changes of places and axes, with <s> = (s_0 + 4 s_1/2 +
s_1) / 6 of both ends and half way. Weights of one end alone err by R spin yaw h / 2 a second where
what spins also yaws, which fills a bristle up to mu N. Half way the rows are taken to be means of
both ends: what turns by an angle a slips by R a^5 / 120 then, with weights of one end by R a^3 / 6.
Symbols are those of `contact_forces`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from .law import MU, Scalar
from .shapes import measure

WORK = 21  #: vectors of work: 8 of the state, weights before, then rows and vectors of another state with its axes


@jit
def component(F: Any, y: np.ndarray, i: int, c: int) -> Scalar:
    """The component c of the axis i of the shape, or of its origin for i = -1."""
    own = F.rows.shape[1]
    dim = F.placed.shape[1]
    # one function for shapes that stand still and those that bodies carry
    if (i + 1) * dim < len(F.frame):
        return y[own + dim * (i + 1) + c]
    return F.placed[i + 1, c] + 0.0 * y[0]


@jit
def place(F: Any, k: int, y: np.ndarray, w: np.ndarray) -> Scalar:
    """The gap of a point with the rows y (r + f,); w[0] becomes its place and w[1] the normal, both
    in the axes of the shape.
    """
    dim = F.placed.shape[1]
    for i in range(dim):
        w[0, i] = 0.0 * y[0]
        for c in range(dim):
            # in the axes of the shape, where its formula is
            w[0, i] += (y[c] - component(F, y, -1, c)) * component(F, y, i, c)
    return measure(F.shape, F.sizes, F.heights, dim, w[0], w[1]) - F.radius[k]


@jit
def normal_of(F: Any, y: np.ndarray, w: np.ndarray) -> None:
    """The normal in the axes of the scene.

        n = sum_k dg/dz_k E_k

    of w[1] into w[2].
    """
    dim = F.placed.shape[1]
    for c in range(dim):
        w[2, c] = 0.0 * y[0]
        for i in range(dim):
            w[2, c] += w[1, i] * component(F, y, i, c)


@jit
def weigh(F: Any, k: int, y: np.ndarray, w: np.ndarray) -> Scalar:
    """The gap of a point with the rows y; w[2] becomes the normal, w[7] by how much each place and
    axis moves the point.
    """
    dim = F.placed.shape[1]
    arms = F.rows.shape[1] // F.placed.shape[1]
    blocks = len(y) // F.placed.shape[1]
    gap = place(F, k, y, w)
    normal_of(F, y, w)
    for b in range(blocks):
        # 0 y: real or complex as the rows are
        w[7, b] = 0.0 * y[0] + (1.0 if b == 0 else -1.0)
        if 0 < b < arms:
            along, square = 0.0 * y[0], 0.0 * y[0]
            for c in range(dim):
                along += w[2, c] * y[dim * b + c]
                square += y[dim * b + c] * y[dim * b + c]
            w[7, b] = -F.radius[k] * along / square
        elif b > arms:
            w[7, b] = F.radius[k] * w[1, b - arms - 1] - w[0, b - arms - 1]
    return gap


@jit
def recall(F: Any, k: int, last: np.ndarray, w: np.ndarray) -> None:
    """w[8] = the weights w[7] in the last accepted state, for `press`; w[9:18] are room."""
    # without friction nobody asks for the weights before
    if F.law[MU] > 0.0 and last[0] >= 0.0:
        for j in range(w.shape[1]):
            w[9, j] = last[2 + F.placed.shape[1] + j]
        weigh(F, k, w[9], w[10:])
        w[8] = w[17]


@jit
def resolve(axes: np.ndarray, d: np.ndarray, dim: int) -> None:
    """Components of d (c,), which they replace, along axes that may be neither at right angles nor
    of length one.

        sum_j x_j axes_j = d
    """
    if dim == 2:
        a = axes[0]
        b = axes[1]
        x = d[0]
        y = d[1]
        # means of two sets of axes are no axes: their inverse is not their transposed
        det = a[0] * b[1] - a[1] * b[0]
        d[0], d[1] = (x * b[1] - y * b[0]) / det, (a[0] * y - a[1] * x) / det
        return
    det = 0.0 * d[0]
    x = d[0]
    y = d[1]
    z = d[2]
    for j in range(3):
        a, b, c = axes[j], axes[(j + 1) % 3], axes[(j + 2) % 3]
        across = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
        if j == 0:
            det += a[0] * across[0] + a[1] * across[1] + a[2] * across[2]
        d[j] = (x * across[0] + y * across[1] + z * across[2]) / det


@jit
def weigh_between(F: Any, k: int, y: np.ndarray, w: np.ndarray) -> None:
    """As `weigh` for rows y that are means of two states, whose axes are no longer at right angles
    and of length one.
    """
    dim = F.placed.shape[1]
    arms = F.rows.shape[1] // F.placed.shape[1]
    blocks = len(y) // F.placed.shape[1]
    for i in range(dim):
        w[0, i] = y[i] - component(F, y, -1, i)
        for c in range(dim):
            w[8 + i, c] = component(F, y, i, c)
    # half way between two states: by the mean of rows, whose path is that of the step to second
    # order
    resolve(w[8:], w[0], dim)
    measure(F.shape, F.sizes, F.heights, dim, w[0], w[1])
    normal_of(F, y, w)
    w[7, 0] = 1.0 + 0.0 * y[0]
    if blocks > arms:
        w[7, arms] = -1.0 + 0.0 * y[0]
    for i in range(blocks - arms - 1):
        w[7, arms + 1 + i] = F.radius[k] * w[1, i] - w[0, i]
    if arms > 1:
        for i in range(dim):
            for c in range(dim):
                w[8 + i, c] = y[dim * (1 + i) + c]
        resolve(w[8:], w[2], dim)
        for i in range(dim):
            w[7, 1 + i] = -F.radius[k] * w[2, i]


@jit
def slip(F: Any, k: int, y: np.ndarray, last: np.ndarray, w: np.ndarray) -> None:
    """Change of the material points that meet since the last accepted state, into w[6].

        (r1 - r0) + sum_j <s_j> (a_j1 - a_j0) - (o1 - o0) - sum_k <w_k> (E_k1 - E_k0)

    w[7] and w[8] must be current.
    """
    dim = F.placed.shape[1]
    first = 2 + F.placed.shape[1]
    for j in range(len(y)):
        w[9, j] = 0.5 * (y[j] + last[first + j])
    weigh_between(F, k, w[9], w[10:])
    for c in range(dim):
        w[6, c] = 0.0 * y[0]
    for j in range(len(y)):
        b = j // dim
        # Simpson's rule: weights of the end alone err by R spin yaw h / 2 a second, which fills the
        # bristle of a wheel at any step
        w[6, j % dim] += (w[8, b] + 4.0 * w[17, b] + w[7, b]) / 6.0 * (y[j] - last[first + j])
