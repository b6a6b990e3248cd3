r"""Conforming plates with the coordinates r, r_X, r_Y of every node: cells of three or four cubic
triangles about a centre.

    r(xi) = sum_ijk B_ijk(a, b, c) z[t, ijk],    B_ijk = 3!/(i! j! k!) a^i b^j c^k,    a, b, c in the triangle t: v_t, v_t+1, centre

    quads       four triangles about the crossing of the diagonals: reduced element of Fraeijs de Veubeke and Sander, 12 functions
    triangles   three about the centre of mass: reduced element of Hsieh, Clough and Tocher, 9 functions

The Bezier ordinates z of a cell follow from its nodes. With e = v_t+1 - v_t, D_v(u) the derivative
along u that node v has:

    z_300 = r_t,   z_210 = r_t + D_t(e)/3,   z_120 = r_t+1 - D_t+1(e)/3,   z_201 = r_t + D_t(centre - v_t)/3
    z_111       so that the slope along the normal of the side is linear between its ends
    z_102       = w-  z_111[t-1] + w0 z_201[t] + w+ z_111[t],   centre = w- v_t-1 + w0 v_t + w+ v_t+1      (C1 across v_t to centre)
    z_003       likewise of the z_102 of three neighbours; all choices agree, as the diagonals are straight lines

so that r and its slopes are continuous in a cell and, where sides are straight, from cell to cell,
on any mesh of convex cells: polynomials of degree 2 are exact, w has order 2 and its curvatures
order 1.

A side on a circular arc of radius R is a cubic line with the tangents of `ancf_plate`; slopes of
the parent are those of the nodes along these, J_v (chord) = tangent for both sides at v. Linear
fields are exact there too, and across the other sides of such a cell of size h slopes differ by a
part h/R of their change along it.

G. Sander, Bull. Soc. R. Sci. Liege 33 (1964) 456-494; B. Fraeijs de Veubeke, Int. J. Solids Struct.
4 (1968) 95-108, doi:10.1016/0020-7683(68)90035-8; R. W. Clough, J. L. Tocher, Proc. Conf. Matrix
Methods in Structural Mechanics, AFFDL-TR-66-80 (1965) 515-545; orders: J. F. Ciavaldini, J. C.
Nedelec, RAIRO 8 R2 (1974) 29-45, and P. G. Ciarlet, Math. Comp. 32 (1978) 335-344,
doi:10.1090/S0025-5718-1978-0482249-1.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from . import ancf_plate, groups, plate_audit
from . import surface as surfaces
from .ancf_plate import Arc
from .groups import Groups
from .surface import DERIVATIVES, VERTICES, Parent, Surface
from .table import Floats, Ints

#: Gauss points, see `quadrature`: 3 a triangle, exact for the bending of straight-sided cells; none
#: of its modes is without energy
ORDER = 3
BLOCK = 4096  #: points evaluated together

BEZIER = np.array(
    [
        (3, 0, 0),
        (2, 1, 0),
        (1, 2, 0),
        (0, 3, 0),
        (2, 0, 1),
        (1, 1, 1),
        (0, 2, 1),
        (1, 0, 2),
        (0, 1, 2),
        (0, 0, 3),
    ]
)
MULTINOMIAL = np.array([1.0, 3.0, 3.0, 1.0, 3.0, 6.0, 3.0, 3.0, 3.0, 1.0])  #: 3!/(i! j! k!)

#: rule of degree 4 with 6 points: coordinates A +- B of two vertices, weights 1/6 +- W (G. R.
#: Cowper, Int. J. Numer. Methods Eng. 7 (1973) 405-408, doi:10.1002/nme.1620070316, in closed form)
A, B = (8.0 - np.sqrt(10.0)) / 18.0, np.sqrt(38.0 - 44.0 * np.sqrt(0.4)) / 18.0
W = np.sqrt(213125.0 - 53320.0 * np.sqrt(10.0)) / 3720.0


@storable
@dataclass(frozen=True, eq=False)
class Conforming:
    """Straight-sided cells (their chords) and what turns nodal gradients into slopes of these."""

    vertices: Floats  #: (e, v, 2) from the first vertex of each cell [m]
    slopes: Floats  #: (e, v, 2, 2) J: a direction u of the chords' cell is J u in X, Y [-]


# ----------------------------------------------------------------------------------------------------------- the triangles
def centres(vertices: Floats) -> Floats:
    """Crossing of the diagonals of quads, centre of mass of triangles (e, 2)."""
    if vertices.shape[1] == 3:
        return np.asarray(vertices.mean(axis=1))
    along, other = vertices[:, 2] - vertices[:, 0], vertices[:, 3] - vertices[:, 1]
    share = _cross(vertices[:, 1] - vertices[:, 0], other) / _cross(along, other)
    return np.asarray(vertices[:, 0] + share[:, None] * along)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def ordinates(space: Conforming, cells: Ints) -> Floats:
    """Bezier ordinates z (e, t, 10, 3 v) of the functions r, r_X, r_Y of the vertices of cells."""
    v = space.vertices[cells]
    J = space.slopes[cells]
    count = v.shape[1]
    value = np.zeros((count, 3 * count))
    value[np.arange(count), 3 * np.arange(count)] = 1.0

    def slope(shift: int, along: Floats) -> Floats:
        """Rows (e, t, 3 v) of the derivatives along (e, t, 2) at the vertices t + shift."""
        rows = np.zeros((len(v), count, 3 * count))
        at = (np.arange(count) + shift) % count
        turned = np.einsum("etij,etj->eti", J[:, at], along)
        rows[:, np.arange(count)[:, None], 3 * at[:, None] + [1, 2]] = turned
        return rows

    def following(rows: Floats) -> Floats:
        return np.roll(rows, -1, axis=1)

    centre = centres(v)[:, None] - v
    side = following(v) - v
    z = np.empty((len(v), count, len(BEZIER), 3 * count))
    z[:, :, 0], z[:, :, 3] = value, np.roll(value, -1, axis=0)
    z[:, :, 1] = z[:, :, 0] + slope(0, side) / 3.0
    z[:, :, 2] = z[:, :, 3] - slope(1, side) / 3.0
    z[:, :, 4] = z[:, :, 0] + slope(0, centre) / 3.0
    z[:, :, 6] = following(z[:, :, 4])
    # centre - v_t = s side + h normal, with a normal as long as the side: z_111 makes the slope
    # along it linear
    normal = np.stack([-side[..., 1], side[..., 0]], axis=-1)
    square = np.sum(side * side, axis=2)
    s, h = np.sum(centre * side, axis=2) / square, np.sum(centre * normal, axis=2) / square
    s = s[..., None]
    h = h[..., None]
    z[:, :, 5] = (
        h / 6.0 * (slope(0, normal) + slope(1, normal)) + (1.0 - s) * z[:, :, 1] + s * z[:, :, 2]
    )
    before = np.roll(v, 1, axis=1) - v
    after = side
    det = _cross(before, after)
    left = (_cross(centre, after) / det)[..., None]
    right = (_cross(before, centre) / det)[..., None]
    z[:, :, 7] = (
        left * np.roll(z[:, :, 5], 1, axis=1)
        + (1.0 - left - right) * z[:, :, 4]
        + right * z[:, :, 5]
    )
    z[:, :, 8] = following(z[:, :, 7])
    middle = (
        left * np.roll(z[:, :, 7], 1, axis=1)
        + (1.0 - left - right) * z[:, :, 7]
        + right * following(z[:, :, 7])
    )
    z[:, :, 9] = middle[:, :1]
    return z


def _barycentric(parent: Parent) -> tuple[Floats, Floats]:
    """Barycentric coordinates (t, 3) of xi = 0 and their gradients (t, 3, 2) in the triangles of
    the parent.
    """
    corners = VERTICES[parent]
    ends = np.stack(
        [
            corners,
            np.roll(corners, -1, axis=0),
            np.broadcast_to(corners.mean(axis=0), corners.shape),
        ],
        axis=2,
    )
    inverse = np.linalg.inv(np.concatenate([ends, np.ones((len(corners), 1, 3))], axis=1))
    return inverse[:, :, 2], inverse[:, :, :2]


BARYCENTRIC = {parent: _barycentric(parent) for parent in Parent}


def triangle_of(parent: Parent, xi: Floats) -> Ints:
    """The triangle (x,) of the parent that holds each point (x, 2), the first of several."""
    origin, gradient = BARYCENTRIC[parent]
    # round-off decides nothing: of triangles that meet at a point the first is taken in every cell
    inside = (origin + np.einsum("tvm,xm->xtv", gradient, xi)).min(axis=2).round(12)
    return np.asarray(np.argmax(inside, axis=1))


def bernstein(parent: Parent, triangle: Ints, xi: Floats) -> Floats:
    """Cubic polynomials of Bernstein and their derivatives 1, 2, 11, 22, 12 in xi (x, 6, 10) at
    points xi (x, 2) of triangles (x,) of the parent.

        B_ijk = 3! / (i! j! k!) a_1^i a_2^j a_3^k,    i + j + k = 3

    with the barycentric coordinates a.
    """
    origin, gradient = BARYCENTRIC[parent]
    G = gradient[triangle]
    a = origin[triangle] + np.einsum("xvm,xm->xv", G, xi)
    powers = np.zeros((len(xi), 3, 3, 4))  # derivative of order n of a_v^k: (x, v, n, k)
    powers[:, :, 0] = a[:, :, None] ** np.arange(4)
    for n in (1, 2):
        powers[:, :, n, 1:] = np.arange(1, 4) * powers[:, :, n - 1, :-1]
    one, two, three = (powers[:, v, :, BEZIER[:, v]].transpose(1, 2, 0) for v in range(3))

    def product(*by: int) -> Floats:
        n = np.bincount(by, minlength=3) if by else np.zeros(3, dtype=int)
        return np.asarray(MULTINOMIAL * one[:, n[0]] * two[:, n[1]] * three[:, n[2]])

    out = np.zeros((len(xi), DERIVATIVES, len(BEZIER)))
    out[:, 0] = product()
    for u in range(3):
        first = product(u)
        out[:, 1] += G[:, u, 0, None] * first
        out[:, 2] += G[:, u, 1, None] * first
        for w in range(3):
            second = product(u, w)
            for k, (m, n) in ((3, (0, 0)), (4, (1, 1)), (5, (0, 1))):
                out[:, k] += (G[:, u, m] * G[:, w, n])[:, None] * second
    return out


@surfaces.basis.register
def _(space: Conforming, cell: Ints, xi: Floats) -> Floats:
    parent = Parent(space.vertices.shape[1])
    values = np.empty((len(cell), DERIVATIVES, 3 * int(parent)))
    for start in range(0, len(cell), BLOCK):
        part = slice(start, start + BLOCK)
        triangle = triangle_of(parent, xi[part])
        own, number = np.unique(cell[part], return_inverse=True)
        values[part] = (
            bernstein(parent, triangle, xi[part]) @ ordinates(space, own)[number, triangle]
        )
    return values


@surfaces.basis_in_cells.register
def _(space: Conforming, cells: Ints, xi: Floats) -> Floats:
    parent = Parent(space.vertices.shape[1])
    triangle = triangle_of(parent, xi)
    rows = bernstein(parent, triangle, xi)
    z = ordinates(space, cells)
    values = np.empty((len(cells), len(xi), DERIVATIVES, 3 * int(parent)))
    for t in range(int(parent)):
        here = triangle == t
        values[:, here] = (rows[here].reshape(-1, len(BEZIER)) @ z[:, t]).reshape(
            len(cells), -1, DERIVATIVES, 3 * int(parent)
        )
    return values


# -------------------------------------------------------------------------------------------------------------- quadrature
def _rule(order: int) -> tuple[Floats, Floats]:
    """Barycentric points (p, 3) and weights (p,), of sum 1, on a triangle, exact to the degree
    `order - 1` at least.
    """
    if order <= 3:
        return np.full((3, 3), 1.0 / 6.0) + 0.5 * np.eye(3), np.full(3, 1.0 / 3.0)
    if order <= 5:
        near, weight = np.repeat([A + B, A - B], 3), np.repeat([1.0 / 6.0 + W, 1.0 / 6.0 - W], 3)
        return near[:, None] + (1.0 - 3.0 * near)[:, None] * np.tile(np.eye(3), (2, 1)), weight
    xi, w = surfaces.quadrature(None, Parent.TRIANGLE, (order + 2) // 2)
    return np.column_stack([1.0 - xi.sum(axis=1), xi]), 2.0 * w


@surfaces.quadrature.register
def _(space: Conforming, parent: Parent, order: int) -> tuple[Floats, Floats]:
    """The rule of every triangle of the parent, one after the other: 3, 6 or more points each, see
    `_rule`.
    """
    corners = VERTICES[parent]
    a, w = _rule(order)
    ends = np.stack(
        [
            corners,
            np.roll(corners, -1, axis=0),
            np.broadcast_to(corners.mean(axis=0), corners.shape),
        ],
        axis=1,
    )
    area = {Parent.SQUARE: 0.25, Parent.TRIANGLE: 1.0 / 6.0}[parent]
    return np.einsum("pv,tvm->tpm", a, ends).reshape(-1, 2), np.tile(area * w, len(corners))


# ------------------------------------------------------------------------------------------------------------- surfaces
@blamed
def surface(
    points: ArrayLike,
    cells: ArrayLike,
    arcs: Iterable[Arc] = (),
    point_groups: Groups | None = None,
    edge_groups: Groups | None = None,
    face_groups: Groups | None = None,
) -> Surface:
    """The plate on quads (e, 4) or triangles (e, 3) of points (n, 2) whose sides on `arcs` are
    curved; groups as in `groups`.
    """
    where = "fvs_plate.surface"
    parent = (
        Parent(np.shape(cells)[1])
        if np.ndim(cells) == 2 and np.shape(cells)[1] in (3, 4)
        else Parent.SQUARE
    )
    places, numbers = groups.flat_mesh(where, points, cells, parent)
    numbers = plate_audit.check_flat(where, places, numbers)
    space = Conforming(places[numbers] - places[numbers[:, :1]], _slopes(places, numbers, arcs))
    named = groups.check_groups(numbers, point_groups, edge_groups, face_groups)
    result = ancf_plate.of_nodes(space, parent, ORDER, places, numbers, *named)
    ancf_plate.check_folds(result, numbers)
    return result


def _slopes(points: Floats, cells: Ints, arcs: Iterable[Arc]) -> Floats:
    """J (e, v, 2, 2), which takes the chords of both sides at a vertex to their tangents."""
    ends = plate_audit.sides(cells)
    chords = points[ends[:, :, 1]] - points[ends[:, :, 0]]
    tangents = ancf_plate.side_tangents(points, cells, arcs)
    chord = np.stack([chords, np.roll(chords, 1, axis=1)], axis=3)
    tangent = np.stack([tangents[:, :, 0], np.roll(tangents[:, :, 1], 1, axis=1)], axis=3)
    J = tangent @ np.linalg.inv(chord)
    J[(tangent == chord).all(axis=(2, 3))] = np.eye(2)
    return np.asarray(J)
