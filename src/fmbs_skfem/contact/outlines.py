"""Outlines of the shapes that contact meets, for pictures: one line a shape, in its own axes."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..systems.places import Draft
from .forces import ContactForces
from .shapes import BOX, CYLINDER, FAR, HEIGHTS, PLANE

AROUND = np.linspace(0.0, 2 * np.pi, 49)
SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=float)
WIDER = 1.5  #: half width of a plane over the span of the scene in the reference, at least


def mark_outline(name: str, draft: Draft, term: ContactForces) -> None:
    """Let pictures show the shape of a contact."""
    layout = draft.layout
    dim = term.placed.shape[1]
    points = np.concatenate(
        [part.reference[part.constant > 0.5] for part in layout.bodies.values()]
    )
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    span = float(np.linalg.norm(np.ptp(points, axis=0)))
    local = outline(term, dim, WIDER * span, term.placed[1:] @ (middle - term.placed[0]))
    rows, offset = read_shape(draft, term, local)
    if not len(term.frame):
        offset = offset + np.tile(layout.origin, len(local))
    first = draft.sensors.add(rows, offset)
    kind = "plane" if term.shape == PLANE else "outline"
    draft.markers.append((name, kind, tuple(range(first, first + len(offset)))))


def read_shape(
    draft: Draft, term: ContactForces, local: np.ndarray
) -> tuple[csr_array, np.ndarray]:
    """Rows (x c, q) and constants (x c,) of points (x, c) in the axes of a shape; of one that
    stands still from the origin of q.
    """
    dim = term.placed.shape[1]
    if not len(term.frame):
        return csr_array((local.size, draft.layout.size)), (
            term.placed[0] + local @ term.placed[1:]
        ).ravel()
    own, away = draft.probes.rows_of(term.frame.tolist())
    turned = len(term.frame) > dim
    shares = np.hstack([np.ones((len(local), 1)), local]) if turned else np.ones((len(local), 1))
    spread = csr_array(np.kron(shares, np.eye(dim)))
    return csr_array(spread @ own), spread @ away + (
        0.0 if turned else (local @ term.placed[1:]).ravel()
    )


def outline(term: ContactForces, dim: int, wide: float, middle: np.ndarray) -> np.ndarray:
    """Points (x, c) along one line; planes and what has no end reach `wide` from `middle`, both in
    the axes of the shape.
    """
    sizes = term.sizes
    circle = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
    if term.shape == PLANE:
        across = wide * (SQUARE if dim == 3 else np.array([[-1.0], [1.0]])) + middle[: dim - 1]
        return np.column_stack([across, np.zeros(len(across))])
    if term.shape == BOX:
        if dim == 2:
            return SQUARE * sizes
        low, high = (np.column_stack([SQUARE, np.full(5, z)]) for z in (-1.0, 1.0))
        return (
            np.concatenate(
                [low, high[:2], low[1:2], high[1:3], low[2:3], high[2:4], low[3:4], high[3:]]
            )
            * sizes
        )
    if term.shape == HEIGHTS:
        return field(sizes, term.heights, dim)
    if dim == 2:
        return sizes[0] * circle
    if term.shape == CYLINDER:
        ends = (middle[2] - wide, middle[2] + wide) if sizes[2] == FAR else (-sizes[2], sizes[2])
        return np.concatenate(
            [np.column_stack([sizes[0] * circle, np.full(len(circle), z)]) for z in ends]
        )
    flat = 0.0 * AROUND
    return sizes[0] * np.concatenate(
        [np.column_stack([circle, flat]), np.column_stack([circle[:, 0], flat, circle[:, 1]])]
    )


def field(steps: np.ndarray, heights: np.ndarray, dim: int) -> np.ndarray:
    """A profile, or one way through a grid."""
    x = steps[0] * np.arange(len(heights))
    if dim == 2:
        return np.column_stack([x, heights[:, 0]])
    nodes = np.array(
        [(i, j if i % 2 == 0 else heights.shape[1] - 1 - j) for i, j in np.ndindex(*heights.shape)]
    )
    return np.column_stack(
        [x[nodes[:, 0]], steps[1] * nodes[:, 1], heights[nodes[:, 0], nodes[:, 1]]]
    )
