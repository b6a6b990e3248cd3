r"""Tetrahedra and hexahedra of first and second order: nodes, functions and quadrature of the parent.

    tetrahedron   xi_i >= 0, sum xi <= 1,    corners (0,0,0) (1,0,0) (0,1,0) (0,0,1)
    hexahedron    [0, 1]^3,    corners (0,0,0) (1,0,0) (1,1,0) (0,1,0), then the same at xi_3 = 1

Nodes stand as in VTK: corners, middles of EDGES, then of faces (x low, x high, y.., z..) and the
cell. The functions are scikit-fem's, sorted by where their nodes are. A face is a loop of corners,
seen from outside anticlockwise; FACES have the order in which Abaqus numbers them.

Source: T. Gustafsson, G. D. McBain, scikit-fem, J. Open Source Softw. 5 (2020) 2369,
doi:10.21105/joss.02369.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cache
from typing import Any

import numpy as np

from ...core.storage.container import storable
from ..table import Floats, Ints

DERIVATIVES = 4  #: N, N,1, N,2, N,3 of the functions of a cell
FACE_DERIVATIVES = 3  #: N, N,1, N,2 of those of a face
NEAR = 1e-9  #: parent coordinates nearer than this are one


@storable
class Kind(IntEnum):
    """Of a solid cell; the value is its number of nodes."""

    TETRA = 4
    HEXAHEDRON = 8
    TETRA10 = 10
    HEXAHEDRON20 = 20
    HEXAHEDRON27 = 27

    @property
    def is_tetra(self) -> bool:
        return self in (Kind.TETRA, Kind.TETRA10)

    @property
    def corners(self) -> int:
        """How many of its nodes are corners."""
        return 4 if self.is_tetra else 8

    @property
    def straight(self) -> Kind:
        """The kind of its corners alone."""
        return Kind(self.corners)

    @property
    def order(self) -> int:
        """Degree of the polynomials that its functions hold."""
        return 1 if self is self.straight else 2


_TETRA = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
_SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
_CUBE = np.vstack([np.column_stack([_SQUARE, np.full(4, z)]) for z in (0.0, 1.0)])
_TETRA_EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
_LOOP = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
_CUBE_EDGES = np.vstack([_LOOP, _LOOP + 4, np.column_stack([np.arange(4), np.arange(4, 8)])])
_TETRA_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
_CUBE_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
_MIDDLES = np.array(
    [[0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1], [1, 1, 0], [1, 1, 2], [1, 1, 1]], dtype=float
)


def edges(kind: Kind) -> Ints:
    """Corners (i, 2) at the ends of the edges of a cell."""
    return _TETRA_EDGES if kind.is_tetra else _CUBE_EDGES


def faces(kind: Kind) -> Ints:
    """Corners (f, 3 or 4) of the faces of a cell, anticlockwise from outside."""
    return _TETRA_FACES if kind.is_tetra else _CUBE_FACES


@cache
def positions(kind: Kind) -> Floats:
    """Parent coordinates (b, 3) of the nodes of a cell."""
    corners = _TETRA if kind.is_tetra else _CUBE
    if kind.order == 1:
        return corners
    middles = corners[edges(kind)].mean(axis=1)
    inner = 0.5 * _MIDDLES if kind is Kind.HEXAHEDRON27 else np.zeros((0, 3))
    return np.vstack([corners, middles, inner])


def second_order(kind: Kind) -> Kind:
    """The kind with nodes in the middle of all edges."""
    if kind.order == 2:
        return kind
    return Kind.TETRA10 if kind.is_tetra else Kind.HEXAHEDRON20


@cache
def _element(kind: Kind) -> tuple[Any, Ints]:
    """The element of scikit-fem, and the number there of each node."""
    import skfem

    found = {
        Kind.TETRA: skfem.ElementTetP1,
        Kind.TETRA10: skfem.ElementTetP2,
        Kind.HEXAHEDRON: skfem.ElementHex1,
        Kind.HEXAHEDRON20: skfem.ElementHexS2,
        Kind.HEXAHEDRON27: skfem.ElementHex2,
    }[kind]()
    apart = np.abs(positions(kind)[:, None] - found.doflocs).max(axis=2)
    return found, np.argmin(apart, axis=1)


def basis(kind: Kind, xi: Floats) -> Floats:
    """Functions and derivatives N, N,1, N,2, N,3 (p, 4, b) at parent points xi (p, 3)."""
    element, numbers = _element(kind)
    values = np.empty((len(xi), DERIVATIVES, int(kind)))
    for b, number in enumerate(numbers):
        N, slopes = element.lbasis(np.ascontiguousarray(xi.T), int(number))
        values[:, 0, b] = N
        values[:, 1:, b] = np.asarray(slopes).T
    return values


def gauss(count: int) -> tuple[Floats, Floats]:
    """`count` Gauss points (p,) on [0, 1], and their weights."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 + 0.5 * x, 0.5 * w


@cache
def quadrature(kind: Kind, degree: int) -> tuple[Floats, Floats]:
    """Points (p, 3) and weights (p,) on the parent, exact for polynomials of a degree, on hexahedra
    of that degree a direction.
    """
    if kind.is_tetra:
        from skfem.quadrature import get_quadrature
        from skfem.refdom import RefTet

        points, weights = get_quadrature(RefTet, max(degree, 1))
        return np.ascontiguousarray(points.T), weights
    x, w = gauss(degree // 2 + 1)
    grid = np.meshgrid(x, x, x, indexing="ij")
    return np.column_stack([one.ravel() for one in grid]), np.einsum("i,j,k->ijk", w, w, w).ravel()


# hexahedra of 20 nodes with 2 x 2 x 2 points have six motions without energy; tetrahedra of 10
# nodes with 4 points have none
STIFFNESS_DEGREE = {
    Kind.TETRA: 1,
    Kind.TETRA10: 2,
    Kind.HEXAHEDRON: 3,
    Kind.HEXAHEDRON20: 5,
    Kind.HEXAHEDRON27: 5,
}  #: of the quadrature of the strain energy
MASS_DEGREE = {
    Kind.TETRA: 2,
    Kind.TETRA10: 5,
    Kind.HEXAHEDRON: 3,
    Kind.HEXAHEDRON20: 7,
    Kind.HEXAHEDRON27: 7,
}  #: of that of the mass


@cache
def face_nodes(kind: Kind) -> Ints:
    """Nodes (f, j) of every face of a cell: corners, middles of the sides in between, the middle."""
    where = positions(kind)
    loops = faces(kind)
    found = []
    for loop in loops:
        corners = where[loop]
        wanted = [
            corners,
            0.5 * (corners + np.roll(corners, -1, axis=0)),
            corners.mean(axis=0)[None],
        ]
        apart = np.abs(np.vstack(wanted)[:, None] - where).max(axis=2)
        on = np.argmin(apart, axis=1)
        found.append(on[apart.min(axis=1) < NEAR])
    return np.array(found)


def face_basis(kind: Kind, s: Floats) -> Floats:
    """Functions and derivatives N, N,1, N,2 (p, 3, j) of the nodes of a face at its points s (p, 2):
    of a triangle s_1 + s_2 <= 1, of a square [0, 1]^2, from its first corner to both neighbours.
    """
    loop = faces(kind)[0]
    corners = positions(kind)[loop]
    along = np.stack([corners[1] - corners[0], corners[-1] - corners[0]])
    values = basis(kind, corners[0] + s @ along)[:, :, face_nodes(kind)[0]]
    return np.concatenate([values[:, :1], np.einsum("ka,paj->pkj", along, values[:, 1:])], axis=1)


@cache
def face_quadrature(kind: Kind, degree: int) -> tuple[Floats, Floats]:
    """Points (p, 2) and weights (p,) on a face, exact for polynomials of a degree."""
    if kind.is_tetra:
        from skfem.quadrature import get_quadrature
        from skfem.refdom import RefTri

        points, weights = get_quadrature(RefTri, degree)
        return np.ascontiguousarray(points.T), weights
    x, w = gauss(degree // 2 + 1)
    a, b = np.meshgrid(x, x, indexing="ij")
    return np.column_stack([a.ravel(), b.ravel()]), np.outer(w, w).ravel()


@cache
def facets(kind: Kind) -> Ints:
    """Quadrilaterals (i, 4) that a face is drawn as, numbers among its nodes; triangles repeat one."""
    count = face_nodes(kind).shape[1]
    found = {
        3: [[0, 1, 2, 2]],
        4: [[0, 1, 2, 3]],
        6: [[0, 3, 5, 5], [3, 1, 4, 4], [5, 4, 2, 2], [3, 4, 5, 5]],
        8: [[0, 4, 7, 7], [4, 1, 5, 5], [5, 2, 6, 6], [6, 3, 7, 7], [4, 5, 6, 7]],
        9: [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]],
    }
    return np.array(found[count])
