r"""Solids: cells of tetrahedra or hexahedra between nodes, curved as these are.

    X(xi) = sum_b N_b(xi) X[nodes[e, b]],    N_b,X = J^-1 N_b,xi,    J_ac = X_c,a,    dV = det J dxi

Functions belong to nodes, so that a value at a node is a coordinate.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np
from scipy.sparse import csr_array

from ...core.errors import InputError, closest, listed, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ..table import Floats, Ints
from . import elements
from .elements import Kind

BLOCK = 4096  #: cells that are tabulated together


@storable
@dataclass(frozen=True, eq=False)
class Solid:
    """A mesh of one kind of solid cells with its named places."""

    kind: Kind
    nodes: Ints  #: (e, b) nodes of every cell
    reference: Floats  #: (n, 3) nodes in the axes of the mesh [m]
    sets: dict[str, Ints] = field(default_factory=dict)  #: named sets of nodes (i,)
    faces: dict[str, Ints] = field(default_factory=dict)  #: named faces (i, 2), cell and face
    volumes: dict[str, Ints] = field(default_factory=dict)  #: named cells (i,)
    resolution: float = 0.0  #: half a unit of the last digit of the file's coordinates [m]
    #: Young's modulus, Poisson's ratio and density of its groups of cells, in units of the file
    materials: dict[str, list[float]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        return len(self.reference)


def parts(solid: Solid) -> list[slice]:
    """The cells in runs of at most BLOCK."""
    return [slice(start, start + BLOCK) for start in range(0, len(solid.nodes), BLOCK)]


def tabulate(solid: Solid, degree: int, part: slice = slice(None)) -> tuple[Floats, Floats, Floats]:
    """Functions N (p, b) of every cell, their gradients (e, p, 3, b) in the axes of the mesh [1/m],
    and weights (e, p) [m3], at the points of a quadrature.

    `part`: of these cells only. Weights are negative where a cell is turned inside out.
    """
    xi, weights = elements.quadrature(solid.kind, degree)
    values = elements.basis(solid.kind, xi)
    jacobian = jacobians(solid, values, part)
    gradients = np.linalg.inv(jacobian) @ values[:, 1:]
    return values[:, 0], gradients, weights * np.linalg.det(jacobian)


def jacobians(solid: Solid, values: Floats, part: slice | Ints = slice(None)) -> Floats:
    """J (e, p, 3, 3) = dX_c/dxi_a of cells at points with functions and derivatives (p, 4, b)."""
    return np.asarray(values[None, :, 1:] @ solid.reference[solid.nodes[part]][:, None])


def quality(solid: Solid, part: slice = slice(None)) -> Floats:
    """Least det J of every cell (e,) at its nodes and quadrature points, over the largest size of
    the products that make it: 1 of a cube, 0 where a cell is flat, negative where it is turned.
    """
    xi, _ = elements.quadrature(solid.kind, elements.STIFFNESS_DEGREE[solid.kind])
    values = elements.basis(solid.kind, np.vstack([elements.positions(solid.kind), xi]))
    J = jacobians(solid, values, part)
    size = np.linalg.norm(J, axis=3).prod(axis=2).max(axis=1)
    return np.asarray(np.linalg.det(J).min(axis=1) / np.maximum(size, np.finfo(float).tiny))


def heights(solid: Solid) -> tuple[Floats, Floats]:
    """Least height (e,) [m] and volume (e,) [m3] of every cell by its corners.

    The volume over the largest face, of a tetrahedron three times that.
    """
    kind = solid.kind
    straight = kind.straight
    corners = solid.reference[solid.nodes[:, : kind.corners]]
    xi, weights = elements.quadrature(straight, elements.STIFFNESS_DEGREE[straight])
    J = elements.basis(straight, xi)[None, :, 1:] @ corners[:, None]
    volume = np.linalg.det(J) @ weights
    loops = corners[:, elements.faces(kind)]
    across = np.cross(loops[:, :, 2] - loops[:, :, 0], loops[:, :, -1] - loops[:, :, 1])
    if kind.is_tetra:
        across = np.cross(loops[:, :, 1] - loops[:, :, 0], loops[:, :, 2] - loops[:, :, 0])
    area = 0.5 * np.linalg.norm(across, axis=2).max(axis=1)
    return np.asarray(volume / area * (3.0 if kind.is_tetra else 1.0)), np.asarray(volume)


def boundary(kind: Kind, nodes: Ints) -> Ints:
    """Faces (i, 2), cell and face, that belong to one cell alone."""
    corners = np.sort(nodes[:, elements.faces(kind)], axis=2)
    flat = corners.reshape(-1, corners.shape[2])
    _, first, uses = np.unique(flat, axis=0, return_index=True, return_counts=True)
    return np.column_stack(np.divmod(np.sort(first[uses == 1]), corners.shape[1]))


def face_nodes(solid: Solid, faces: Ints) -> Ints:
    """Nodes (i, j) of faces (i, 2), as of `elements.face_nodes`."""
    cell, face = faces.T
    return np.asarray(solid.nodes[cell[:, None], elements.face_nodes(solid.kind)[face]])


def face(where: str, solid: Solid, names: str | tuple[str, ...]) -> Ints:
    """Faces (i, 2) of a named group or several, each once; InputError for a name that has none."""
    found = []
    for name in (names,) if isinstance(names, str) else names:
        if name not in solid.faces:
            expected = f"one of its faces ({listed(sorted(solid.faces), name, 'none')})"
            remedy = (
                "its nodes make no whole face of the boundary"
                if name in solid.sets
                else closest(name, solid.faces)[2:]
            )
            raise InputError(say(where, expected, f"'{name}'", remedy))
        found.append(solid.faces[name])
    return np.unique(np.concatenate(found), axis=0)


def nodes_of(where: str, solid: Solid, names: str | tuple[str, ...]) -> Ints:
    """Nodes (i,) of named faces or sets; InputError for a name that is neither."""
    found = []
    for name in (names,) if isinstance(names, str) else names:
        if name in solid.faces:
            found.append(face_nodes(solid, solid.faces[name]).ravel())
        elif name in solid.sets:
            found.append(solid.sets[name])
        else:
            known = sorted({*solid.faces, *solid.sets})
            expected = f"one of its faces and sets ({listed(known, name, 'none')})"
            raise InputError(say(where, expected, f"'{name}'") + closest(name, known))
    return np.unique(np.concatenate(found))


def face_points(solid: Solid, faces: Ints, degree: int) -> tuple[Floats, Floats, Floats]:
    """Functions N (p, j) of the nodes of faces (i, 2), weights (i, p) [m2] and places (i, p, 3), at
    the points of a quadrature.
    """
    s, weights = elements.face_quadrature(solid.kind, degree)
    values = elements.face_basis(solid.kind, s)
    found = np.einsum("pkj,fjc->kfpc", values, solid.reference[face_nodes(solid, faces)])
    area = np.linalg.norm(np.cross(found[1], found[2]), axis=2) * weights
    return values[:, 0], np.asarray(area), found[0]


def face_weights(solid: Solid, faces: Ints) -> tuple[Ints, Floats]:
    """Nodes (i,) of faces (i, 2), and int N_i dA of each (i,) [m2]."""
    N, area, _ = face_points(solid, faces, 2 * solid.kind.order)
    ids, same = np.unique(face_nodes(solid, faces), return_inverse=True)
    shares = np.einsum("pj,fp->fj", N, area)
    return ids, np.asarray(np.bincount(same.ravel(), shares.ravel()), dtype=float)


def coupled(where: str, solid: Solid, names: str | tuple[str, ...]) -> tuple[Ints, Floats]:
    """Nodes (i,) of named faces and sets and their parts in a mean (i,): by area where all are faces,
    else alike.
    """
    nodes = nodes_of(where, solid, names)
    each = (names,) if isinstance(names, str) else names
    if all(name in solid.faces for name in each):
        return face_weights(solid, face(where, solid, each))
    return nodes, np.ones(len(nodes))


def centres(solid: Solid) -> csr_array:
    """Rows (e, n) of the middles of cells, the means of their corners."""
    corners = solid.kind.corners
    count = len(solid.nodes)
    data = np.full(count * corners, 1.0 / corners)
    indptr = corners * np.arange(count + 1)
    return csr_array((data, solid.nodes[:, :corners].ravel(), indptr), shape=(count, solid.count))


def corner_rows(solid: Solid, cells: Ints) -> Floats:
    """Middles (i, 3) of cells by their corners, for messages [m]."""
    return np.asarray(solid.reference[solid.nodes[cells, : solid.kind.corners]].mean(axis=1))
