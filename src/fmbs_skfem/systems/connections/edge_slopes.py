r"""Derivatives across edges that vanish while the edge itself moves: planes of symmetry.

    u,n = a u,s + b u,m = 0,      q_i + X_ij q_j = 0 for the functions i that are zero on the edge

u,s is the derivative along the edge and u,m that along the lines which cross it. Where a / b or the
weights of NURBS vary, u,n = 0 at all points is more than there are functions i, and would hold u,s
as well. They follow the others by least squares then, min |u,n|^2. At an end where lines meet at a
right angle (to 3 degrees), u,m of the two functions i next to it vanishes, so that an edge held
there says the same. Interpolations whose nodes have slopes are left to `edge_directions`.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ...bodies.edge_directions import UPRIGHT
from ...bodies.plate import trace
from ...core.algebra import ranks
from ...core.algebra.linalg import distinct
from ...shapes import surface as surfaces
from ...shapes.surface import Surface


def across(shape: Surface, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Functions that u,n = 0 on sides (i, 2) determines, by the others.

        q[first] + X q[second] = 0

    first (i,), second (j,), X (i, j). u,n is the derivative of the displacement across the sides,
    pairs of a cell and a number of its side. Exact where functions off the edge alone can make it
    vanish, else in the mean of least squares, see the module; at ends where lines meet at a right
    angle, the derivative along the lines that cross the edge vanishes.
    """
    values, slopes = halves(trace(shape, sides, normal=True))
    exact = ranks.determined(slopes)
    on_edge = read(values)
    first = np.setdiff1d(read(slopes), on_edge)
    if len(exact[0]) <= len(first) or not len(first):
        return exact
    second = np.setdiff1d(read(slopes), first)
    X = np.zeros((len(first), len(second)))
    near = pairs(shape, sides)
    near = near[np.isin(near[:, 0], first) & np.isin(near[:, 1], second)]
    X[np.searchsorted(first, near[:, 0]), np.searchsorted(second, near[:, 1])] = -1.0
    rest = ~np.isin(first, near[:, 0])
    A = slopes[:, first].toarray()
    B = slopes[:, second].toarray()
    sizes = np.abs(A).max(axis=0)
    X[rest] = (
        np.linalg.lstsq(A[:, rest] / sizes[rest], B - A[:, ~rest] @ X[~rest], rcond=None)[0]
        / sizes[rest, None]
    )
    X[np.abs(X) * sizes[:, None] < ranks.NOISE * np.abs(B).max(axis=0)] = 0.0
    return first, second, X


def halves(whole: csr_array) -> tuple[csr_array, csr_array]:
    """Values and derivatives across of a trace."""
    half = whole.shape[0] // 2
    return csr_array(whole[:half]), csr_array(whole[half:])


def read(rows: csr_array) -> np.ndarray:
    """Sorted functions (i,) that some rows read."""
    return distinct(rows.indices[rows.data != 0.0])


def pairs(shape: Surface, sides: np.ndarray) -> np.ndarray:
    """Functions (i, 2) beside the ends of an edge where lines meet at a right angle: off the edge,
    and its neighbour on it.
    """
    cell, side = np.repeat(sides, 2, axis=0).T
    xi = surfaces.side_points(shape.parent, side, np.tile([0.0, 1.0], len(sides)))
    values = surfaces.basis(shape.space, cell, xi)
    tangents = np.einsum("xab,xbc->xac", values[:, 1:3], shape.reference[shape.nodes[cell]])
    dot = np.einsum("xc,xc->x", tangents[:, 0], tangents[:, 1])
    size = np.linalg.norm(tangents, axis=2).prod(axis=1)
    found: list[tuple[int, int]] = []
    alone: list[int] = []
    for k in range(len(cell)):
        nodes = shape.nodes[cell[k]]
        seen = np.abs(values[k]) > ranks.NOISE * np.abs(values[k]).max(axis=1, keepdims=True)
        along, over = (seen[1], seen[2]) if side[k] % 2 == 0 else (seen[2], seen[1])
        corner = nodes[seen[0]]
        if len(corner) != 1 or along.sum() != 2 or over.sum() != 2 or seen[5].sum() != 4:
            continue
        alone.append(int(corner[0]))
        if abs(dot[k]) <= UPRIGHT * size[k]:
            next_to, off = np.setdiff1d(nodes[along], corner), np.setdiff1d(nodes[over], corner)
            both = np.setdiff1d(nodes[seen[5]], [*corner, *next_to, *off])
            found += (
                [(int(off[0]), int(corner[0])), (int(both[0]), int(next_to[0]))]
                if len(both) == 1
                else []
            )
    ends = {corner for corner in alone if alone.count(corner) == 1}
    kept = [k for k in range(0, len(found), 2) if found[k][1] in ends]
    return np.array([pair for k in kept for pair in found[k : k + 2]], dtype=np.int64).reshape(
        -1, 2
    )
