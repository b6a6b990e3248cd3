r"""The boundary of a solid as a surface, for what acts on it: its faces are cells of their own.

Its normal points into the solid, so that a pressure, which acts along it, presses.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ...core.storage.container import storable
from ...core.storage.records import dataclass
from .. import surface
from ..surface import DERIVATIVES, Parent, Surface
from ..table import Floats, Ints
from . import elements, solid
from .elements import Kind
from .solid import Solid


@storable
@dataclass(frozen=True)
class Faces:
    """Functions of the nodes of faces of a kind of cells."""

    kind: Kind


@surface.basis.register
def _(space: Faces, cell: Ints, xi: Floats) -> Floats:
    """Second derivatives are first ones of the first ones, which are polynomials of the faces."""
    kind = space.kind
    values = elements.face_basis(kind, xi)
    at_nodes = elements.face_basis(kind, positions(kind))[:, 1:]
    found = np.empty((len(xi), DERIVATIVES, values.shape[2]))
    found[:, :3] = values
    for k, (first, second) in enumerate(((0, 0), (1, 1), (0, 1))):
        found[:, 3 + k] = values[:, 1 + first] @ at_nodes[:, second]
    return found


def positions(kind: Kind) -> Floats:
    """Places (j, 2) of the nodes of a face on it, from its first corner to both neighbours."""
    corners = (
        np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        if kind.is_tetra
        else np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    )
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    every = np.vstack([corners, middles, corners.mean(axis=0)[None]])
    return every[: elements.face_nodes(kind).shape[1]]


@lru_cache(maxsize=8)
def of(body: Solid) -> tuple[Surface, Ints]:
    """The boundary of a solid, and its faces (i, 2), cell and face, in the order of its cells.

    A face stands from its first corner to the last one first, so that its normal points inwards.
    """
    outer = solid.boundary(body.kind, body.nodes)
    width = elements.faces(body.kind).shape[1]
    nodes = solid.face_nodes(body, outer)
    count = nodes.shape[1]
    turned = np.concatenate(
        [-np.arange(width) % width, width + np.arange(width)[::-1], [2 * width]]
    )
    table = {pair: k for k, pair in enumerate(map(tuple, outer.tolist()))}
    faces = {
        name: np.array(
            [table[pair] for pair in map(tuple, ids.tolist()) if pair in table], np.int64
        )
        for name, ids in body.faces.items()
    }
    shape = Surface(
        Faces(body.kind),
        Parent.TRIANGLE if body.kind.is_tetra else Parent.SQUARE,
        nodes[:, turned[:count]],
        body.reference,
        np.ones(body.count),
        body.kind.order + 1,
        faces={name: ids for name, ids in faces.items() if len(ids)},
    )
    return shape, outer


def surface_of(space: Any) -> Surface | None:
    """The surface of a plate or shell, or the boundary of a solid; None of others."""
    if isinstance(space, Solid):
        return of(space)[0]
    return space if isinstance(space, Surface) else None
