r"""Geometry of sampled surfaces for pictures: points that cells share, the outline, and normals for
shading.

    n_f = (p2 - p0) x (p3 - p1),    n_i = sum of n_f over the facets around point i, normalised

Cells bring their own points, so that stresses may jump; points that coincide in the reference are
one `place`.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .frames import Array, Indices, Shown

TOLERANCE = 1e-6  #: distance of points that coincide, over the extent of the body
CREASE = 0.75  #: cosine of the angle between facets from which their common edge is drawn


def places(reference: Array) -> Indices:
    """Number of the place of every point (x,); coinciding points share one."""
    from scipy.spatial import cKDTree

    count = len(reference)
    reach = TOLERANCE * float(np.ptp(reference, axis=0).max())
    i, j = cKDTree(reference).query_pairs(reach, output_type="ndarray").T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def facet_normals(points: Array, quads: Indices) -> Array:
    """Normals of quadrilaterals (f,3), as long as twice their area."""
    corners = points[quads]
    return np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])


def outline(reference: Array, quads: Indices, place: Indices) -> Indices:
    """Edges (i,2), as numbers of points, that belong to one facet only or where facets meet in a
    crease.
    """
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    facet = np.repeat(np.arange(len(quads)), 4)
    ends = np.sort(place[edges], axis=1)
    real = ends[:, 0] != ends[:, 1]
    edges = edges[real]
    facet = facet[real]
    ends = ends[real]
    _, first, same, uses = np.unique(
        ends, axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    normals = facet_normals(reference, quads)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    along = np.abs(np.einsum("fc,fc->f", normals[facet], normals[facet[first[same.ravel()]]]))
    flattest = np.ones(len(first))
    np.minimum.at(flattest, same.ravel(), along)
    return edges[first[(uses == 1) | (flattest < CREASE)]]


def edges(body: Shown) -> Indices:
    """Edges (i,2) of a body that are drawn as lines: the outline of a surface, the segments of a
    line.
    """
    return (
        outline(body.reference, body.cells, places(body.reference))
        if body.is_surface
        else body.cells
    )


def normals(points: Array, quads: Indices, place: Indices) -> Array:
    """Unit normals of the points (x,3), equal for all points of one place."""
    facets = np.repeat(facet_normals(points, quads), 4, axis=0)
    total = np.zeros((place.max() + 1, 3))
    np.add.at(total, place[quads].ravel(), facets)
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
    return total[place]
