r"""Bogner-Fox-Schmit rectangles and Argyris triangles: C1 plates from the global elements of
scikit-fem.

    r(xi) = sum_b N_b(xi) c_b,    N_b = sum_m C[e, m, b] (xi1 - c1)^i_m (xi2 - c2)^j_m,    C[e] = inv(D[e]) diag(s[e])

    D[e, b, m]      functional b of scikit-fem (`ElementGlobal.gdof`), in units of the cell's size h_e, of the monomial m
    BFS, 16         1, x, .., x^3 y^3;    at vertices r, r_x, r_y, l r_xy
    Argyris, 21     1, x, .., y^5;        at vertices r, r_x, r_y, l r_xx, l r_xy, l r_yy; in the middle of sides r_n

with l the root of the mean area of the cells: r has metres and every other coordinate no unit, as
in ANCF plates. The monomials are those of the parent about its centre c; size, shape and place of a
cell enter by the constant map X = x_0 + J xi only, so that D is well conditioned on slender cells
and far from the origin.

r_n is the slope along the unit normal on the right of the side when it runs from its lower to its
higher node number: both cells agree on it. In BFS, x and y are the directions of the sides, turned
from the global axes by at most 45 degrees.

F. K. Bogner, R. L. Fox, L. A. Schmit, Proc. Conf. Matrix Methods in Structural Mechanics,
AFFDL-TR-66-80 (1965) 397-444; J. H. Argyris, I. Fried, D. W. Scharpf, Aeronaut. J. 72 (1968)
701-709, doi:10.1017/S000192400008489X; T. Gustafsson, G. D. McBain, scikit-fem, J. Open Source
Softw. 5 (2020) 2369, doi:10.21105/joss.02369.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from . import groups, plate_audit
from . import surface as surfaces
from .groups import Groups, Named
from .surface import DERIVATIVES, VERTICES, Parent, Surface
from .table import Floats, Ints

BFS_ORDER = 4  #: Gauss points a direction: mass, linear membrane and bending are exact
ARGYRIS_ORDER = 5  #: Gauss points a direction: linear membrane and bending are exact; 4 suffice for bending alone
#: deviation of a cell from a rectangle, relative to its diagonal, that is round-off [-]
SQUARE_CORNER = 1e-7
BLOCK = 4096  #: points evaluated together

#: derivative k of a surface as scikit-fem writes it
KEYS: tuple[tuple[int, ...], ...] = ((), (0,), (1,), (0, 0), (1, 1), (0, 1))


@storable
@dataclass(frozen=True, eq=False)
class Global:
    """Polynomials of every cell in monomials of its parent."""

    powers: Ints  #: (m, 2) exponents of the monomials
    center: Floats  #: (2,) point of the parent about which they are taken
    coefficients: Floats  #: (e, m, b)
    length: float  #: the l of the coordinates l r_xx, l r_xy, l r_yy [m]


@surfaces.basis.register
def _(space: Global, cell: Ints, xi: Floats) -> Floats:
    values = np.empty((len(cell), DERIVATIVES, space.coefficients.shape[2]))
    for start in range(0, len(cell), BLOCK):
        part = slice(start, start + BLOCK)
        values[part] = (
            surfaces.monomials(space.powers, xi[part] - space.center)
            @ space.coefficients[cell[part]]
        )
    return values


@surfaces.basis_in_cells.register
def _(space: Global, cells: Ints, xi: Floats) -> Floats:
    rows = surfaces.monomials(space.powers, xi - space.center).reshape(len(xi) * DERIVATIVES, -1)
    return np.asarray(rows @ space.coefficients[cells]).reshape(
        len(cells), len(xi), DERIVATIVES, -1
    )


# ------------------------------------------------------------------------------------------------------------- surfaces
@blamed
def bfs(
    points: ArrayLike,
    quads: ArrayLike,
    point_groups: Groups | None = None,
    edge_groups: Groups | None = None,
    face_groups: Groups | None = None,
) -> Surface:
    """The Bogner-Fox-Schmit plate on rectangles (e, 4) of the points (n, 2), sides in two
    directions; groups as in `groups`.
    """
    import skfem

    places, cells = _audited("skfem_surface.bfs", points, quads, Parent.SQUARE)
    axes = _axes(places, cells)
    _check_rectangles(places, cells, axes)
    named = groups.check_groups(cells, point_groups, edge_groups, face_groups)
    return _surface(skfem.ElementQuadBFS(), Parent.SQUARE, BFS_ORDER, places, cells, axes, named)


@blamed
def argyris(
    points: ArrayLike,
    triangles: ArrayLike,
    point_groups: Groups | None = None,
    edge_groups: Groups | None = None,
    face_groups: Groups | None = None,
) -> Surface:
    """The Argyris plate on the triangles (e, 3) of the points (n, 2); groups as in `groups`."""
    import skfem

    places, cells = _audited("skfem_surface.argyris", points, triangles, Parent.TRIANGLE)
    named = groups.check_groups(cells, point_groups, edge_groups, face_groups)
    return _surface(
        skfem.ElementTriArgyris(), Parent.TRIANGLE, ARGYRIS_ORDER, places, cells, np.eye(2), named
    )


def _surface(
    element: Any,
    parent: Parent,
    order: int,
    points: Floats,
    cells: Ints,
    axes: Floats,
    named: Named,
) -> Surface:
    """The surface of an `ElementGlobal` whose x and y are the rows of `axes`."""
    corners = points[cells]
    jacobian = axes @ (corners[:, [1, -1]] - corners[:, :1]).transpose(0, 2, 1)
    size = np.sqrt(np.linalg.det(jacobian))
    length = float(np.sqrt(np.mean(size**2)))
    names = _names(element, parent)
    powers = _powers(element)
    normals = _normals(points, cells)
    functionals = _functionals(
        element, parent, powers, _chain(jacobian / size[:, None, None]), normals
    )
    units = (np.ones_like(size), size, size**2 / length)
    scale = np.column_stack([units[len(name)] for name in names])
    space = Global(
        powers,
        VERTICES[parent].mean(axis=0),
        np.linalg.inv(functionals) * scale[:, None, :],
        length,
    )
    nodes, count = _numbers(element, parent, points, cells)
    reference, unit = np.zeros((count, 2)), np.zeros(count)
    slopes = {"x": axes[0], "y": axes[1]}
    for b, name in enumerate(names):
        if name == "":
            reference[nodes[:, b]], unit[nodes[:, b]] = corners[:, b // element.nodal_dofs], 1.0
        elif name == "n":
            reference[nodes[:, b]] = normals[:, b - element.nodal_dofs * int(parent)]
        else:
            reference[nodes[:, b]] = slopes.get(name, 0.0)
    return Surface(space, parent, nodes, reference, unit, order, *named)


# -------------------------------------------------------------------------------------------------- scikit-fem's elements
def _names(element: Any, parent: Parent) -> list[str]:
    """What the functional of every function differentiates by: "", "x", "xy", .. or the normal "n"."""
    names = [name.removeprefix("u").removeprefix("_") for name in element.dofnames]
    at = element.nodal_dofs
    return names[:at] * int(parent) + names[at:] * int(parent)


def _powers(element: Any) -> Ints:
    """Exponents (m, 2) of the polynomials of an element."""
    degree = element.maxdeg // 2 if element.tensorial_basis else element.maxdeg
    powers = np.indices((degree + 1, degree + 1)).reshape(2, -1).T
    return powers if element.tensorial_basis else powers[powers.sum(axis=1) <= degree]


def _numbers(element: Any, parent: Parent, points: Floats, cells: Ints) -> tuple[Ints, int]:
    """Functions (e, b) of the cells and their count, with the vertices of a cell in the order
    given.
    """
    import skfem

    p, t = np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)
    mesh = skfem.MeshQuad1(p, t) if parent is Parent.SQUARE else skfem.MeshTri1(p, t, sort_t=False)
    dofs = skfem.Dofs(mesh, element)
    return np.ascontiguousarray(dofs.element_dofs.T, dtype=np.int64), int(dofs.N)


def _functionals(
    element: Any, parent: Parent, powers: Ints, chain: Floats, normals: Floats
) -> Floats:
    """The functionals (e, b, m) of the monomials, in units of the cell's size, with scikit-fem's
    arguments of `gdof`.
    """
    corners = VERTICES[parent] - VERTICES[parent].mean(axis=0)

    def derivative(k: int) -> Callable[[float, float], Floats]:
        return lambda x, y: chain[:, k] @ surfaces.monomials(powers, np.array([[x, y]]))[0]

    monomials = {key: derivative(k) for k, key in enumerate(KEYS)}
    places = {
        "v": corners,
        "e": 0.5 * (corners + np.roll(corners, -1, axis=0)),
        "n": normals.transpose(1, 2, 0)[..., None],
    }
    return np.stack([element.gdof(monomials, places, b) for b in range(len(powers))], axis=1)


def _chain(jacobian: Floats) -> Floats:
    """Factors (e, 6, 6) that take the derivatives in xi to those in X = J xi."""
    g = np.linalg.inv(jacobian)
    chain = np.zeros((len(g), DERIVATIVES, DERIVATIVES))
    chain[:, 0, 0] = 1.0
    chain[:, 1:3, 1:3] = g.transpose(0, 2, 1)
    for k, (c, d) in enumerate(((0, 0), (1, 1), (0, 1)), start=3):
        u, v = g[:, :, c], g[:, :, d]
        chain[:, k, 3], chain[:, k, 4] = u[:, 0] * v[:, 0], u[:, 1] * v[:, 1]
        chain[:, k, 5] = u[:, 0] * v[:, 1] + u[:, 1] * v[:, 0]
    return chain


def _normals(points: Floats, cells: Ints) -> Floats:
    """Unit normals (e, side, 2) on the right of the sides from the lower to the higher node number."""
    ends = points[np.sort(plate_audit.sides(cells), axis=2)]
    along = ends[:, :, 1] - ends[:, :, 0]
    normals = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))


# ----------------------------------------------------------------------------------------------------- what is refused
def _audited(
    where: str, points: ArrayLike, cells: ArrayLike, parent: Parent
) -> tuple[Floats, Ints]:
    """Points (n, 2) and cells (e, 3 or 4), anticlockwise, that make one plate."""
    places, numbers = groups.flat_mesh(where, points, cells, parent)
    return places, plate_audit.check_flat(where, places, numbers)


def _axes(points: Floats, quads: Ints) -> Floats:
    """Rows x and y along the sides of the first quad, turned from the global axes by at most 45
    degrees.
    """
    a, b = points[quads[0, 1]] - points[quads[0, 0]]
    turn = np.arctan2(b, a)
    turn -= 0.5 * np.pi * np.round(turn / (0.5 * np.pi))
    c, s = (1.0, 0.0) if abs(turn) <= SQUARE_CORNER else (np.cos(turn), np.sin(turn))
    return np.array([[c, s], [-s, c]])


def _check_rectangles(points: Floats, quads: Ints, axes: Floats) -> None:
    """Sides along the axes to SQUARE_CORNER of the diagonal."""
    sides = np.abs(np.diff(points[plate_audit.sides(quads)], axis=2)[:, :, 0] @ axes.T)
    off = sides.min(axis=2).max(axis=1) / np.linalg.norm(sides[:, :2], axis=(1, 2))
    if off.max() > SQUARE_CORNER:
        cell = int(np.argmax(off))
        x, y = points[quads[cell]].mean(axis=0)
        got = f"cell {cell} at ({x:g}, {y:g}), off by {off[cell]:.1e} of its diagonal"
        remedy = "take fvs for quads of any shape, or argyris on triangles"
        raise InputError(
            say(
                "skfem_surface.bfs",
                "rectangles whose sides have two directions in all",
                got,
                remedy,
            )
        )
