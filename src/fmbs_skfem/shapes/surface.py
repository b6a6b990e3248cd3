r"""Surfaces of tabulated basis functions: what a plate or shell needs of its interpolation.

    r(xi) = sum_b N_b(xi) c[nodes[e, b]],      xi = (xi1, xi2) in the parent of cell e

    parents     SQUARE [0, 1]^2, vertices (0,0) (1,0) (1,1) (0,1);   TRIANGLE, vertices (0,0) (1,0) (0,1)
    sides       side i runs from vertex i to vertex i + 1
    derivatives k = 0..5:  N, N,1, N,2, N,11, N,22, N,12 in xi

An interpolation is a struct of its own with one rule, `basis`; a `Surface` carries it with its
cells, reference shape and named places. `check_table` tests any surface, a user's own too.
"""

from __future__ import annotations

from dataclasses import field
from enum import IntEnum
from functools import singledispatch
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from . import table
from .table import BasisTable, Floats, Ints

DERIVATIVES = 6
#: of the derivatives k in xi1 and xi2
ORDERS = np.array([(0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1)])
BLOCK = 2048  #: cells that are tabulated together


@storable
class Parent(IntEnum):
    """Shape of the parent cell; the value is its number of sides."""

    TRIANGLE = 3
    SQUARE = 4


VERTICES = {
    Parent.TRIANGLE: np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    Parent.SQUARE: np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
}


@storable
@dataclass(frozen=True, eq=False)
class Surface:
    """An interpolated surface with its reference shape and named places."""

    space: Any  #: the interpolation, for which `basis` is registered
    parent: Parent
    nodes: Ints  #: (e, b) numbers of the functions of every cell
    reference: Floats  #: (n, 2 or 3) coordinates of the reference shape [m]
    unit: Floats  #: (n,) coordinates of the field 1
    order: int  #: Gauss points a direction that integrate the strain energy
    #: named points: cell, xi1, xi2
    points: dict[str, tuple[int, float, float]] = field(default_factory=dict)
    edges: dict[str, Ints] = field(default_factory=dict)  #: named edges: (i, 2) cell and side
    faces: dict[str, Ints] = field(default_factory=dict)  #: named faces: (i,) cells
    resolution: float = 0.0  #: half a unit of the last digit of the file's coordinates [m], 0 where they have all digits

    def __post_init__(self) -> None:
        if (
            self.nodes.min() < 0
            or self.nodes.max() >= len(self.reference)
            or len(self.unit) != len(self.reference)
        ):
            got = f"nodes {self.nodes.min()} to {self.nodes.max()}, {len(self.reference)} references, {len(self.unit)} units"
            raise InputError(say("Surface", "nodes, reference and unit of the same functions", got))

    @property
    def count(self) -> int:
        return len(self.reference)


@singledispatch
def basis(space: Any, cell: Ints, xi: Floats) -> Floats:
    """Basis functions and derivatives (x, 6, b) at the parent points xi (x, 2) of the cells (x,):
    the rule of an interpolation.
    """
    remedy = "register a rule with surface.basis.register for your type"
    raise InputError(
        say("surface.basis", "an interpolation of surfaces", type(space).__name__, remedy)
    )


@singledispatch
def basis_in_cells(space: Any, cells: Ints, xi: Floats) -> Floats:
    """Basis functions and derivatives (e, p, 6, b) at the same parent points xi (p, 2) in all of
    the cells (e,).
    """
    values = basis(space, np.repeat(cells, len(xi)), np.tile(xi, (len(cells), 1)))
    return values.reshape(len(cells), len(xi), DERIVATIVES, -1)


@singledispatch
def quadrature(space: Any, parent: Parent, order: int) -> tuple[Floats, Floats]:
    """Points (p, 2) and weights (p,) on the parent of an interpolation: Gauss points, on triangles
    collapsed to one vertex.

    An interpolation that is a polynomial in parts of its cells only registers a rule of its own.
    """
    x, w = np.polynomial.legendre.leggauss(order)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    a, b = (part.ravel() for part in np.meshgrid(x, x, indexing="ij"))
    weights = np.outer(w, w).ravel()
    if parent is Parent.SQUARE:
        return np.column_stack([a, b]), weights
    return np.column_stack([a, b * (1.0 - a)]), weights * (1.0 - a)


def monomials(powers: Ints, xi: Floats) -> Floats:
    """Derivatives (x, 6, m) of the monomials of the exponents `powers` (m, 2), at the points xi (x,
    2).

        x^i y^j    and its derivatives 1, 2, 11, 22, 12
    """
    degree = int(powers.max())
    table = np.zeros((len(xi), 2, 3, degree + 1))
    table[:, :, 0] = xi[:, :, None] ** np.arange(degree + 1)
    for n in (1, 2):
        table[:, :, n, 1:] = np.arange(1, degree + 1) * table[:, :, n - 1, :-1]
    (i, j) = powers.T
    (n, m) = ORDERS.T[:, :, None]
    return np.asarray(table[:, 0, n, i] * table[:, 1, m, j])


def side_points(parent: Parent, side: Ints, s: Floats) -> Floats:
    """Parent points (x, 2) at the fractions s (x,) of the sides (x,).

        start + s (end - start)

    s from 0 to 1.
    """
    corners = VERTICES[parent]
    start, end = corners[side], corners[(side + 1) % int(parent)]
    return start + np.asarray(s)[:, None] * (end - start)


def tabulate(surface: Surface, order: int | None = None, part: slice = slice(None)) -> BasisTable:
    """Basis functions and derivatives at the Gauss points: values (e, p, 6, b), weights (e, p) in
    xi, points (e, p, 2).

    `part`: of these cells only; tables of all cells of a large surface, with all derivatives, are
    larger than what is made of them.
    """
    xi, weights = quadrature(surface.space, surface.parent, order or surface.order)
    numbers = np.arange(len(surface.nodes))[part]
    cells, points = len(numbers), len(xi)
    return BasisTable(
        basis_in_cells(surface.space, numbers, xi),
        surface.nodes[part],
        np.tile(weights, (cells, 1)),
        np.tile(xi, (cells, 1)).reshape(cells, points, 2),
        surface.count,
    )


def parts(surface: Surface) -> list[slice]:
    """The cells in runs of at most BLOCK."""
    return [slice(start, start + BLOCK) for start in range(0, len(surface.nodes), BLOCK)]


def sample(surface: Surface, cell: Ints, xi: Floats, derivative: int = 0) -> csr_array:
    """Rows (x, n) that take coordinates to the surface or one of its derivatives at parent points,
    as a csr_array.
    """
    cell = np.atleast_1d(cell)
    values = basis(surface.space, cell, np.atleast_2d(xi))[:, derivative]
    return table.rows(values, surface.nodes[cell], surface.count)


def along(surface: Surface, first: Floats, second: Floats, side: Ints) -> Floats:
    """Directions (x, 2) in the parent along sides (x,), with the planar surface on their left,
    where its tangents are (x, 2).
    """
    corners = VERTICES[surface.parent]
    # a cell may be numbered clockwise
    counted = np.sign(np.linalg.det(np.stack([first, second], axis=1)))
    return np.asarray(
        counted[:, None] * (corners[(side + 1) % int(surface.parent)] - corners[side])
    )


def local_axes(tangents: Floats) -> tuple[Floats, Floats]:
    """Orthonormal vectors (..., 2, c) in the plane of tangents (..., 2, c), and the normal (...,
    c).

    The first is along the x-axis as far as the surface allows.
    """
    dim = tangents.shape[-1]
    if dim == 2:
        return np.broadcast_to(np.eye(2), tangents.shape), np.zeros((*tangents.shape[:-2], 2))
    normal = np.cross(tangents[..., 0, :], tangents[..., 1, :])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    steep = np.abs(normal[..., :1]) > 0.9
    axis = np.where(steep, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    first = axis - normal * np.sum(axis * normal, axis=-1, keepdims=True)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=-2), normal


TOUCH = 1e-8  #: of the extent: sides nearer than this coincide
CONTACTS = 4  #: points of a side at which two cells are compared
STENCILS = ((1, (1, -8, 0, 8, -1)), (2, (-1, 16, -30, 16, -1)))


@table.check_table.register
def _(space: Surface, tolerance: float = 1e-9) -> None:
    """Partition of unity; quadrature; derivatives against differences; cells with an area; values
    that agree on sides in common.

    Differences are taken over 0.002 of the parent and met to the square root of the tolerance.
    Slopes across sides are not compared, because interpolations whose slopes agree at nodes only
    are of use too.
    """
    values = tabulate(space)
    one = np.einsum("epkb,eb->epk", values.values, space.unit[space.nodes])
    table.require(
        space.space, "partition of unity", float(np.abs(one[:, :, 0] - 1.0).max()), tolerance
    )
    table.require(
        space.space, "derivatives of the field 1", float(np.abs(one[:, :, 1:]).max()), tolerance
    )
    area = values.weights.sum(axis=1) / {Parent.SQUARE: 1.0, Parent.TRIANGLE: 0.5}[space.parent]
    table.require(
        space.space,
        "quadrature weights sum to the parent's area",
        float(np.abs(area - 1.0).max()),
        tolerance,
    )
    _check_derivatives(space, values, np.sqrt(tolerance))
    tangents = np.einsum("epkb,ebc->epkc", values.values[:, :, 1:3], space.reference[space.nodes])
    gram = np.einsum("epic,epjc->epij", tangents, tangents)
    folded = np.linalg.det(gram) <= 1e-12 * np.trace(gram, axis1=2, axis2=3) ** 2
    table.require(
        space.space,
        "tangent vectors that span a plane (share that do not)",
        float(folded.mean()),
        0.0,
    )
    _check_continuity(space, tolerance)


def _check_derivatives(space: Surface, values: BasisTable, tolerance: float) -> None:
    """Every derivative against differences, in units of the largest value of its function or of
    that derivative.
    """
    step = 2e-3
    points = values.points.reshape(-1, 2)
    cell = np.repeat(np.arange(len(space.nodes)), values.points.shape[1])

    def at(shift: Floats) -> Floats:
        return basis(space.space, cell, points + shift)

    exact = at(np.zeros(2))
    size = np.abs(exact).max(axis=0)
    size = np.maximum(np.maximum(size, size[0]), np.finfo(float).tiny)
    for axis, first, second in ((0, 1, 3), (1, 2, 4)):
        shifts = [(i - 2) * step * np.eye(2)[axis] for i in range(5)]
        for (order, stencil), of, k in (
            (STENCILS[0], 0, first),
            (STENCILS[1], 0, second),
            (STENCILS[0], 2 - axis, 5),
        ):
            estimate = sum(w * at(s)[:, of] for w, s in zip(stencil, shifts, strict=True)) / (
                12 * step**order
            )
            error = float((np.abs(estimate - exact[:, k]) / size[k]).max())
            table.require(space.space, f"derivative {k} against differences", error, tolerance)


def _check_continuity(space: Surface, tolerance: float) -> None:
    """All functions agree along sides of two cells that coincide in the reference shape."""
    a, b, turned = coincident_sides(space)
    s = np.tile((np.arange(CONTACTS) + 0.5) / CONTACTS, len(a))
    here = _side_rows(space, np.repeat(a, CONTACTS, axis=0), s)
    there = _side_rows(
        space, np.repeat(b, CONTACTS, axis=0), np.where(np.repeat(turned, CONTACTS), 1.0 - s, s)
    )
    jump = float(abs(here - there).max()) if len(a) else 0.0
    table.require(
        space.space,
        "continuity over shared sides",
        jump / (float(abs(here).max()) if len(a) else 1.0),
        tolerance,
    )


def coincident_sides(space: Surface) -> tuple[Ints, Ints, np.ndarray]:
    """Cells and sides (i, 2) of pairs with the same ends and middle, and whether they run against
    each other (i,).
    """
    from scipy.spatial import cKDTree

    count = int(space.parent)
    sides = np.indices((len(space.nodes), count)).reshape(2, -1).T
    start, middle, end = (
        _side_rows(space, sides, np.full(len(sides), s)) @ space.reference for s in (0.0, 0.5, 1.0)
    )
    touch = TOUCH * float(np.ptp(middle, axis=0).max(initial=0.0))
    length = np.linalg.norm(end - middle, axis=1) + np.linalg.norm(middle - start, axis=1)
    sides, start, middle, end = (rows[length > touch] for rows in (sides, start, middle, end))
    i, j = cKDTree(middle).query_pairs(touch, output_type="ndarray").T
    along = (
        np.maximum(
            np.linalg.norm(start[i] - start[j], axis=1), np.linalg.norm(end[i] - end[j], axis=1)
        )
        <= touch
    )
    against = (
        np.maximum(
            np.linalg.norm(start[i] - end[j], axis=1), np.linalg.norm(end[i] - start[j], axis=1)
        )
        <= touch
    )
    found = along | against
    return sides[i[found]], sides[j[found]], against[found]


def free_sides(space: Surface) -> Ints:
    """Cells and sides (i, 2) that coincide with no other: the boundary of the surface."""
    sides = np.indices((len(space.nodes), int(space.parent))).reshape(2, -1).T
    a, b, _ = coincident_sides(space)
    inside = np.zeros((len(space.nodes), int(space.parent)), dtype=bool)
    inside[tuple(np.concatenate([a, b]).T)] = True
    return sides[~inside.ravel()]


def _side_rows(space: Surface, sides: Ints, s: Floats) -> csr_array:
    """Rows (x, n) at fractions of sides."""
    return sample(space, sides[:, 0], side_points(space.parent, sides[:, 1], s))
