r"""Points on faces of a solid: the cell below, and where in its parent.

    X(xi) = P,    of all cells with a face near P that whose face is nearest

xi may lie a little outside of the cell: its functions go on there, so that what they interpolate at
P turns and moves with the cell.
"""

from __future__ import annotations

import numpy as np

from ..table import Floats, Ints
from . import elements
from .solid import Solid, face_nodes

AROUND = 1.2  #: of the radius of a face: points farther from its middle are not on it
ROUNDS = 10  #: of Newton's method
TINY = float(np.finfo(float).tiny)
FOUND = 1e-9  #: of parent coordinates, the last step
FAR = 0.5  #: parent coordinates may lie this far outside


def on_faces(solid: Solid, faces: Ints, points: Floats) -> tuple[Ints, Floats, Floats]:
    """Numbers (x,) among faces (i, 2) of those nearest to points (x, 3), -1 where none is near, the
    parent coordinates (x, 3), and the distances (x,) over the sizes of the faces, infinite there.
    """
    from scipy.spatial import cKDTree

    corners = solid.reference[face_nodes(solid, faces)[:, : elements.faces(solid.kind).shape[1]]]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    near = cKDTree(points).query_ball_point(middle, AROUND * radius)
    face = np.repeat(np.arange(len(faces)), [len(some) for some in near])
    point = np.array([p for some in near for p in some], dtype=np.int64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    margin = (AROUND - 1.0) * radius[face, None]
    inside = (points[point] > low[face] - margin) & (points[point] < high[face] + margin)
    face, point = (one[inside.all(axis=1)] for one in (face, point))
    xi, found = inverse(solid, faces[face, 0], points[point])
    face, point, xi = face[found], point[found], xi[found]
    on = clamped(solid.kind, faces[face, 1], xi)
    values = elements.basis(solid.kind, on)[:, 0]
    places = np.einsum("xb,xbc->xc", values, solid.reference[solid.nodes[faces[face, 0]]])
    apart = np.linalg.norm(places - points[point], axis=1) / radius[face]
    order = np.lexsort((apart, point))
    known, first = np.unique(point[order], return_index=True)
    best = order[first]
    number = np.full(len(points), -1)
    place = np.zeros((len(points), 3))
    distance = np.full(len(points), np.inf)
    number[known], place[known], distance[known] = face[best], xi[best], apart[best]
    return number, place, distance


def inverse(solid: Solid, cells: Ints, points: Floats) -> tuple[Floats, np.ndarray]:
    """Parent coordinates xi (x, 3) of points (x, 3) in cells (x,), and whether (x,) they are found,
    at most FAR outside.

        X(xi) = P    by Newton's method
    """
    xi = np.tile(elements.positions(solid.kind.straight).mean(axis=0), (len(cells), 1))
    left = np.arange(len(cells))
    for _ in range(ROUNDS):
        nodes = solid.reference[solid.nodes[cells[left]]]
        values = elements.basis(solid.kind, xi[left])
        miss = points[left] - np.einsum("xb,xbc->xc", values[:, 0], nodes)
        J = values[:, 1:] @ nodes
        step = np.linalg.solve(J.transpose(0, 2, 1), miss[:, :, None])[:, :, 0]
        xi[left] = np.clip(xi[left] + step, -FAR, 1.0 + FAR)
        left = left[np.abs(step).max(axis=1) > FOUND]
    known = np.ones(len(cells), dtype=bool)
    known[left] = False
    return xi, known


def clamped(kind: elements.Kind, faces: Ints, xi: Floats) -> Floats:
    """The points (x, 3) of faces (x,) of the parent nearest to points (x, 3), by coordinates."""
    loops = elements.positions(kind)[elements.faces(kind)[faces]]
    if kind.is_tetra:
        whole = np.column_stack([1.0 - xi.sum(axis=1), xi])
        corners = np.column_stack([1.0 - loops.sum(axis=2).min(axis=1), loops.max(axis=1)])
        whole = corners * np.clip(whole, 0.0, None)
        return np.asarray((whole / np.maximum(whole.sum(axis=1, keepdims=True), TINY))[:, 1:])
    return np.clip(xi, loops.min(axis=1), loops.max(axis=1))
