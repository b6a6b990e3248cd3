"""Corners and edges of boxes against all of a plate or shell in space: the triangles of its cells,
and the points of the box.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.sparse import csr_array, kron, vstack

from ..bodies.body import Body, own
from ..core.notices import notify
from ..shapes import surface
from ..shapes.surface import Surface
from ..systems.places import At, Draft
from . import facet_forces as facet_forces  # which says how these contacts are compiled
from .facet_forces import measures
from .facet_pairs import FacetContacts
from .forces import ContactForces
from .outlines import read_shape
from .points import ENOUGH, LIMIT, SIDE, gap_of_surface
from .shapes import BOX

# a strip on an edge rests on two points or more: with one it tilts about it, with twice as many its
# sag changes by less than 1 %
ACROSS = 2.0  #: points of an edge of a box over the narrowest part of a plate
# sides about a corner of more than 18 degrees lie across nothing, however short they are
#: least cosines of angles to the normal of a side: of the way across, of the side on the other end
STRAIGHT, FACING = (
    0.7,
    0.95,
)


def facets(name: str, draft: Draft, body: str | None, term: ContactForces) -> list[FacetContacts]:
    """The contact of the corners and edges of the box of a contact with all of its plate in space;
    none of others.

    Points of a plate stand against the faces, and corners and edges come in between them. Both
    push, where both overlap: each has a potential of its own, so that nothing jumps where a point
    leaves a face, and a corner right at a point is as stiff as both.
    """
    layout = draft.layout
    if body is None or term.shape != BOX or layout.dim != 3:
        return []
    part = layout.body(name, At(body))
    if not isinstance(part.space, Surface):
        return []
    rows, at, corners = triangles(part, part.space)
    width = narrowest(part, part.space)
    local, apart = box_points(
        term.sizes, 2.0 * gap_of_surface(part, part.space, False)[0], width / ACROSS
    )
    if apart > width:
        between = f"points {apart:.3g} m apart on the edges of the box, between which '{body}' may be, which is {width:.3g} m narrow"
        notify(f"{name}: {between}; divide the box, or take a plane")
    points, offset = read_shape(draft, term, local)
    first = draft.probes.add(
        csr_array(vstack([layout.widen(part.name, rows), points])),
        np.append(np.zeros(rows.shape[0]), offset),
    )
    count = len(local)
    share = float(term.weights.mean())
    numbers = np.arange(first, first + rows.shape[0] + len(offset))
    radius, weights = np.full(count, term.radius[0]), np.full(count, share)
    return [FacetContacts(corners, at, numbers, radius, term.law, term.share, term.power, weights)]


def facet_gaps(draft: Draft, term: FacetContacts) -> np.ndarray:
    """Gaps (t,) of all points in the reference."""
    matrix, offset = draft.probes.rows_of(term.rows.tolist())
    reference = np.concatenate([one.reference.ravel() for one in draft.layout.bodies.values()])
    y = (matrix @ reference + offset)[None]
    return np.asarray(measures(term, y, 0.0 * y)[0, :, 0])


def narrowest(part: Body, shape: Surface) -> float:
    """Width of the narrowest part of a surface [m]: shortest way across it from the middle of a
    side of its rim to another side.

    Infinite where it has no rim, or one that nothing lies across.
    """
    cell, side = surface.free_sides(shape).T
    if len(cell) == 0:
        return np.inf
    middle = surface.VERTICES[shape.parent].mean(axis=0)
    inner = np.tile(middle, (len(cell), 1))
    start, end = (
        surface.side_points(shape.parent, side, np.full(len(cell), s)) for s in (0.0, 1.0)
    )
    a, b, c = (
        own(part, surface.sample(shape, cell, xi, 0)) @ part.reference for xi in (start, end, inner)
    )
    along = b - a
    at = 0.5 * (a + b)
    least = np.inf
    square = np.sum(along**2, axis=1)
    inward = c - at - (np.sum((c - at) * along, axis=1) / square)[:, None] * along
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    for p, n in zip(at, inward, strict=True):
        u = np.clip(np.sum((p - a) * along, axis=1) / square, 0.0, 1.0)
        ways = a + u[:, None] * along - p
        long = np.linalg.norm(ways, axis=1)
        across = (ways @ n > STRAIGHT * long) & (inward @ n < -FACING)
        least = min(least, long[across].min(initial=np.inf))
    return float(least)


def box_points(half: np.ndarray, apart: float, narrow: float) -> tuple[np.ndarray, float]:
    """Corners (t, c) of a box of half sides (c,), points that divide its edges, and the longest way
    between two of them [m].

    That is no more than `apart` where ENOUGH points do, and no more than `narrow` where LIMIT do.
    """
    found = [np.array(list(product((-1.0, 1.0), repeat=3)))]
    longest = 0.0
    for c in range(3):
        wanted, needed = (
            int(np.ceil(2.0 * half[c] / way)) if way < np.inf else 1 for way in (apart, narrow)
        )
        parts = max(min(wanted, ENOUGH // 12), min(needed, LIMIT // 12), 1)
        longest = max(longest, 2.0 * half[c] / parts)
        s = np.linspace(-1.0, 1.0, parts + 1)[1:-1]
        for ends in product((-1.0, 1.0), repeat=2):
            found.append(np.insert(np.tile(ends, (len(s), 1)), c, s, axis=1))
    return np.concatenate(found) * half, longest


def triangles(part: Body, shape: Surface) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Rows (9 i, b c) of x, x,1, x,2 of the vertices of SIDE x SIDE parts of all cells, their
    places (i, 2), and triangles (h, 3).

    Diagonals of the parts lead to the middle of a square cell, as those of its macro-elements do.
    """
    grid = [
        (i, j)
        for i, j in np.ndindex(SIDE + 1, SIDE + 1)
        if shape.parent is surface.Parent.SQUARE or i + j <= SIDE
    ]
    number = {one: k for k, one in enumerate(grid)}
    found = list[tuple[int, ...]]()
    for i, j in np.ndindex(SIDE, SIDE):
        a = (i, j)
        b = (i + 1, j)
        c = (i + 1, j + 1)
        d = (i, j + 1)
        halves = (
            [(a, b, c), (a, c, d)]
            if shape.parent is surface.Parent.SQUARE and (i + j) % 2 == 0
            else [(a, b, d), (b, c, d)]
        )
        found += [
            tuple(number[one] for one in half)
            for half in halves
            if all(one in number for one in half)
        ]
    cells = np.arange(len(shape.nodes))
    xi = np.array(grid) / SIDE
    at = np.tile(xi, (len(cells), 1))
    of = np.repeat(cells, len(xi))
    read = csr_array(vstack([own(part, surface.sample(shape, of, at, k)) for k in range(3)]))
    ordered = read[np.arange(3 * len(at)).reshape(3, -1).T.ravel()]
    corners = (len(xi) * cells[:, None, None] + np.array(found)).reshape(-1, 3)
    return csr_array(kron(ordered, np.eye(3))), at, corners.astype(np.int64)
