r"""Gradients at the nodes of a solid: means of those of the cells there, on the boundary of those
whose faces meet.

    (dr/dX)*_n = 1/m sum_e (dr/dX)_e(X_n)    of m cells at node n

Fits of polynomials to patches (Zienkiewicz and Zhu 1992, Zhang and Naga 2005) were 1.1 to 6 times
worse on the boundary, where stresses are largest: there they extrapolate. How far the cells differ
is the error of a stress, see `results.solid_fields`. A rotation stays one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from ...core.algebra.linalg import others
from ..table import Ints
from . import elements
from .solid import Solid, boundary, face_nodes


def mean_gradients(solid: Solid, wanted: Ints) -> csr_array:
    """Rows (3 x, n) of the derivatives by X, Y, Z at nodes (x,), three rows a node."""
    outer, _, cells = boundary_nodes(solid)
    inner = np.isin(solid.nodes, others(solid.count, np.unique(outer)))
    nodes = np.concatenate([outer, solid.nodes[inner]])
    cells = np.concatenate([cells, np.nonzero(inner)[0]])
    chosen = np.isin(nodes, wanted)
    nodes, cells = nodes[chosen], cells[chosen]
    order = np.argsort(wanted)
    place = order[np.searchsorted(wanted, nodes, sorter=order)]
    local = (solid.nodes[cells] == nodes[:, None]).argmax(axis=1)
    slopes = node_gradients(solid, cells, local)
    slopes /= np.bincount(place, minlength=len(wanted))[place, None, None]
    rows = np.broadcast_to((3 * place[:, None] + np.arange(3))[..., None], slopes.shape)
    columns = np.broadcast_to(solid.nodes[cells][:, None], slopes.shape)
    entries = (slopes.ravel(), (rows.ravel(), columns.ravel()))
    return csr_array(coo_array(entries, shape=(3 * len(wanted), solid.count)))


def boundary_nodes(solid: Solid) -> tuple[Ints, Ints, Ints]:
    """Nodes (i,) of all faces of the boundary, one face after the other, their numbers (i,) in the
    cells, and these (i,).
    """
    outer = boundary(solid.kind, solid.nodes)
    local = elements.face_nodes(solid.kind)[outer[:, 1]]
    cells = np.repeat(outer[:, 0], local.shape[1])
    return face_nodes(solid, outer).ravel(), local.ravel(), cells


def node_gradients(solid: Solid, cells: Ints, local: Ints) -> np.ndarray:
    """Derivatives by X, Y, Z (i, 3, b) of the functions of cells (i,) at their nodes `local` (i,)."""
    kind = solid.kind
    slopes = elements.basis(kind, elements.positions(kind))[local, 1:]
    J = slopes @ solid.reference[solid.nodes[cells]]
    return np.asarray(np.linalg.inv(J) @ slopes)
