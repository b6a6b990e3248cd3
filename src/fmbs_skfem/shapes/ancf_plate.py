r"""Gradient-deficient ANCF plates of 36 coordinates on quads whose edges are straight or circular
arcs.

    r(xi) = sum_v Phi_v0 r_v + Phi_v1 r_v,xi + Phi_v2 r_v,eta,        r_v,xi = x_xi r_v,X + y_xi r_v,Y,   likewise eta

with the nodal coordinates r, r_X, r_Y (functions 3 i, 3 i + 1, 3 i + 2 of node i), the tangents
(x_xi, y_xi), (x_eta, y_eta) of the reference shape at vertex v and the twelve functions Phi of {1,
x, y, .., y^3, x^3 y, x y^3} on the parent square (A. Adini, R. W. Clough, NSF report G7337, 1961;
ANCF: K. Dufva, A. A. Shabana, Proc. IMechE K 219, 2005, doi:10.1243/146441905X50678).

Edges are cubic Hermite lines of their end coordinates, so r is continuous and r = X, r_X = e_x, r_Y
= e_y is the curved reference shape itself: constant membrane strains are exact on any mesh. Slopes
across edges agree at nodes only.

An edge of angle theta on a circle about c has the tangents 4 tan(theta / 4) z x (X_v - c); the
radius is exact at both ends and in the middle and elsewhere too large by at most 2/27 R
sin^6(theta/4) / cos^2(theta/4), 3.3e-8 R at 20 degrees (M. Goldapp, Comput. Aided Geom. Des. 8,
1991, doi:10.1016/0167-8396(91)90007-X). Tangents as long as the arc would err by R theta^4 / 384.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra.linalg import distinct
from ..core.errors import InputError, closest, say
from ..core.notices import notify
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from . import groups, plate_audit
from . import surface as surfaces
from .groups import Groups
from .surface import DERIVATIVES, VERTICES, Parent, Surface
from .table import Floats, Ints

ORDER = 3  #: Gauss points a direction; two leave modes without energy
#: distance from a circle, relative to its radius, below which a node lies on it [-]
ON_CIRCLE = 1e-6
ROUNDED = 3.0  #: distance from a circle through rounded nodes, in halves of a unit of their last digit: sqrt(2), and of the circle
#: width of a set of nodes, relative to its length, below which it is a straight line [-]
STRAIGHT = 1e-9
WIDEST = 5.0 / 6.0 * np.pi  #: largest angle of one edge on a circle [rad]
#: largest angle of one edge on a circle that is found without being named [rad]
ROUND = 5.0 / 18.0 * np.pi
BLUNT = 0.1  #: sine of the angle between edges on arcs at a corner, 174 degrees, below which they stay straight [-]
FLAT = 1e-9  #: sine of the smallest angle between the two tangents at a vertex [-]
BLOCK = 4096  #: points evaluated together

POWERS = np.array(
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)]
)
#: side and end (0 first, 1 last vertex of the side) that give the tangents in xi and eta at every
#: vertex, and their signs
TANGENT_SIDE = np.array([[0, 3], [0, 1], [2, 1], [2, 3]])
TANGENT_END = np.array([[0, 1], [1, 0], [0, 1], [1, 0]])
TANGENT_SIGN = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])


@storable
@dataclass(frozen=True, eq=False)
class PlateTangents:
    """The tangents of the reference shape, which turn nodal gradients into slopes of the parent
    square.
    """

    tangents: Floats  #: (e, 4, 2, 2) vertex, direction xi or eta, component [m]


@dataclass(frozen=True, eq=False)
class Arc:
    """Edges on a circle."""

    center: Floats  #: (2,) [m]
    radius: float  #: [m]
    edges: Ints  #: (i, 2) node ids
    slack: float = 0.0  #: distance of nodes from the circle that is allowed beside ON_CIRCLE, by the digits of their file [m]


#: (12 monomials, 12 functions) of the parent square, vertex by vertex Phi_v0, Phi_v1, Phi_v2: whole
#: numbers
COEFFICIENTS = np.round(
    np.linalg.inv(surfaces.monomials(POWERS, VERTICES[Parent.SQUARE])[:, :3].reshape(12, 12))
)


@surfaces.basis.register
def _(space: PlateTangents, cell: Ints, xi: Floats) -> Floats:
    values = np.empty((len(cell), DERIVATIVES, 4, 3))
    for start in range(0, len(cell), BLOCK):
        part = slice(start, start + BLOCK)
        parent = (surfaces.monomials(POWERS, xi[part]) @ COEFFICIENTS).reshape(
            -1, DERIVATIVES, 4, 3
        )
        values[part, :, :, 0] = parent[..., 0]
        slopes = parent[..., 1:].transpose(0, 2, 1, 3) @ space.tangents[cell[part]]
        values[part, :, :, 1:] = slopes.transpose(0, 2, 1, 3)
    return values.reshape(len(cell), DERIVATIVES, 12)


# ------------------------------------------------------------------------------------------------------------- surfaces
@blamed
def surface(
    points: ArrayLike,
    quads: ArrayLike,
    arcs: Iterable[Arc] = (),
    point_groups: Groups | None = None,
    edge_groups: Groups | None = None,
    face_groups: Groups | None = None,
) -> Surface:
    """The plate on anticlockwise quads (e, 4) of the points (n, 2) whose edges on `arcs` are
    curved; groups as in `groups`.
    """
    places, cells = groups.flat_mesh("ancf_plate.surface", points, quads, Parent.SQUARE)
    tangents = side_tangents(places, cells, arcs)
    _check_corners(places, cells, tangents)
    named = groups.check_groups(cells, point_groups, edge_groups, face_groups)
    result = of_nodes(
        PlateTangents(_tangents(tangents)), Parent.SQUARE, ORDER, places, cells, *named
    )
    check_folds(result, cells)
    return result


def of_nodes(
    space: Any, parent: Parent, order: int, places: Floats, cells: Ints, *named: Any
) -> Surface:
    """The flat surface whose coordinates are r, r_X, r_Y of every node, of cells (e, v), with named
    points, edges, faces.
    """
    count = len(places)
    reference = np.empty((count, 3, 2))
    reference[:, 0], reference[:, 1:] = places, np.eye(2)
    return Surface(
        space,
        parent,
        (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1),
        reference.reshape(3 * count, 2),
        np.tile([1.0, 0.0, 0.0], count),
        order,
        *named,
    )


def fitting(points: ArrayLike, cells: ArrayLike, arcs: Iterable[Arc]) -> list[Arc]:
    """Arcs without the edges of cells that they would fold or flatten at a corner, as where a cell
    has two edges on one circle.

    These stay straight, which clamps a hinged edge at its corners; a warning says where. There they
    err by

        R theta^2 / 8
    """
    places = np.asarray(points, dtype=float)
    numbers = np.asarray(cells)
    found = list(arcs)
    kept = list[Arc]()
    chords, tangents = (side_tangents(places, numbers, some) for some in ((), found))
    straight, curved = (_sines(some).min(axis=1) for some in (chords, tangents))
    bad = (curved < BLUNT) & (curved < straight)
    if numbers.shape[1] == int(Parent.SQUARE):
        bad |= _folded(
            of_nodes(PlateTangents(_tangents(tangents)), Parent.SQUARE, ORDER, places, numbers)
        )
    bent = plate_audit.sides(numbers)[bad].reshape(-1, 2)
    gone = plate_audit.side_keys(bent, len(places))
    left = list[Ints]()
    for arc in found:
        stays = ~np.isin(plate_audit.side_keys(arc.edges, len(places)), gone)
        left += list(arc.edges[~stays])
        kept.append(replace(arc, edges=arc.edges[stays]))
    if left:
        near = _place(places[left[0]].mean(axis=0))
        text = f"{len(left)} edges on arcs stay straight, because their cells would fold or have a flat corner, as near {near}"
        notify(
            f"{text}; an edge that is hinged there is held too stiffly: mesh no cell with two edges on one arc"
        )
    return kept


# ------------------------------------------------------------------------------------------------------------- tangents
def _tangents(along: Floats) -> Floats:
    """Tangents (e, 4, 2, 2) in xi and eta at every vertex of quads, of those along their sides (e,
    side, 2 ends, 2).
    """
    return np.asarray(TANGENT_SIGN[..., None] * along[:, TANGENT_SIDE, TANGENT_END])


def side_tangents(points: Floats, cells: Ints, arcs: Iterable[Arc]) -> Floats:
    """Tangents (e, side, 2 ends, 2) along the sides of cells: of the chord, or of the arc that the
    side lies on.

    InputError for an arc along what is no side of a cell.
    """
    ends = plate_audit.sides(cells)
    chords = points[ends[:, :, 1]] - points[ends[:, :, 0]]
    along = np.stack([chords, chords], axis=2)
    keys = plate_audit.side_keys(ends, len(points))
    for arc in arcs:
        edges = groups.ids("ancf_plate.Arc.edges", arc.edges, len(points), columns=2)
        wanted = plate_audit.side_keys(edges, len(points))
        groups.require_sides("ancf_plate.Arc.edges", edges, np.isin(wanted, keys))
        found = np.isin(keys, wanted)
        along[found] = _arc_tangents(points, ends[found], arc)
    return along


def _angles(radii: Floats) -> Floats:
    """Signed angle between the radius vectors (i, 2 ends, 2) of edges on a circle."""
    a, b = radii[:, 0], radii[:, 1]
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.sum(a * b, axis=1))


def _arc_tangents(points: Floats, ends: Ints, arc: Arc) -> Floats:
    """4 tan(theta / 4) z x (X - c) at both ends (i, 2, 2) of edges given by their nodes (i, 2)."""
    radii = points[ends] - arc.center
    error = np.abs(np.linalg.norm(radii, axis=2) / arc.radius - 1.0)
    if error.max() > max(ON_CIRCLE, arc.slack / arc.radius):
        node = ends.ravel()[np.argmax(error)]
        got = f"node {node} at {_place(points[node])}, {error.max():.1e} of the radius away"
        circle = f"nodes on the circle of radius {arc.radius:g} about {_place(arc.center)}"
        raise InputError(say("ancf_plate.Arc", circle, got, "fit the circle with circle_through"))
    angles = _angles(radii)
    if np.abs(angles).max() > WIDEST:
        a, b = ends[np.argmax(np.abs(angles))]
        got = f"{np.degrees(np.abs(angles).max()):.0f} degrees between the nodes {a} and {b}"
        raise InputError(
            say(
                "ancf_plate.Arc",
                f"edges of at most {np.degrees(WIDEST):.0f} degrees",
                got,
                "refine the mesh",
            )
        )
    turned = np.stack([-radii[..., 1], radii[..., 0]], axis=-1)
    return np.asarray(4.0 * np.tan(angles / 4.0)[:, None, None] * turned)


def _place(point: Floats) -> str:
    return f"({point[0]:g}, {point[1]:g})"


def _check_corners(points: Floats, cells: Ints, tangents: Floats) -> None:
    """Every corner turns left by more than nothing and less than 180 degrees."""
    wrong = _sines(tangents) <= FLAT
    if not wrong.any():
        return
    bad = np.flatnonzero(wrong.any(axis=1))
    cell = bad[0]
    straight = _sines(side_tangents(points, cells[[cell]], ()))[0]
    kinds = (
        (
            (straight > FLAT).all(),
            "with two edges on one arc",
            "set 'arcs: []' for straight edges, or use triangles",
        ),
        ((straight < -FLAT).all(), "that is clockwise", "reverse its nodes"),
        (
            (np.abs(straight) <= FLAT).any(),
            "that is degenerate",
            "its corners need angles between 0 and 180 degrees",
        ),
        (((straight < 0).sum() == 2), "that is a bow-tie", "order its nodes around the cell"),
        (True, "that is concave", "move its nodes"),
    )
    kind, remedy = next((kind, remedy) for found, kind, remedy in kinds if found)
    nodes = ", ".join(f"{node} {_place(points[node])}" for node in cells[cell])
    got = f"cell {cell} {kind}, nodes {nodes}; cells {groups.list_numbers(bad)}"
    raise InputError(say("ancf_plate.surface: cells", "convex anticlockwise cells", got, remedy))


def _sines(tangents: Floats) -> Floats:
    """Sine (e, v) of the angle at every vertex of cells with tangents (e, side, 2 ends, 2)."""
    out = tangents[:, :, 0]
    back = -np.roll(tangents[:, :, 1], 1, axis=1)
    area = out[..., 0] * back[..., 1] - out[..., 1] * back[..., 0]
    return np.asarray(
        area
        / np.maximum(
            np.linalg.norm(out, axis=2) * np.linalg.norm(back, axis=2), np.finfo(float).tiny
        )
    )


def _folded(result: Surface) -> np.ndarray:
    """Cells (e,) whose area element is not positive at a quadrature point."""
    found = np.zeros(len(result.nodes), dtype=bool)
    xi, _ = surfaces.quadrature(result.space, result.parent, ORDER)
    for start in range(0, len(found), BLOCK):
        part = np.arange(start, min(start + BLOCK, len(found)))
        rows = surfaces.basis(result.space, np.repeat(part, len(xi)), np.tile(xi, (len(part), 1)))[
            :, 1:3
        ]
        nodal = result.reference[result.nodes[part]].repeat(len(xi), axis=0)
        found[part] = (np.linalg.det(rows @ nodal) <= 0.0).reshape(len(part), -1).any(axis=1)
    return found


def check_folds(result: Surface, cells: Ints) -> None:
    """The area element is positive at every quadrature point.

    InputError that names the first cell where it is not, with its nodes.
    """
    folded = _folded(result)
    if folded.any():
        got = f"the folded cell {int(np.argmax(folded))} with the nodes {groups.list_numbers(cells[np.argmax(folded)])}"
        raise InputError(
            say(
                "arcs",
                "arcs that leave every cell its area",
                got,
                "take 'arcs: []', or refine the mesh there",
            )
        )


# -------------------------------------------------------------------------------------------------------------- circles
def circle_through(points: ArrayLike, slack: float = 0.0) -> tuple[Floats, float]:
    """Center c (2,) and radius R of the circle through the points x (i, 2), by least squares.

        |x|^2 - 2 c.x = R^2 - |c|^2

    InputError where they are farther from it than ON_CIRCLE of its radius, or of their extent where
    that is less, and than `slack` [m]: a line that is bent at a node is near to circles of any
    large radius.
    """
    where = "ancf_plate.circle_through"
    places = np.asarray(points, dtype=float)
    if places.ndim != 2 or places.shape[1] != 2 or len(places) < 3 or not np.isfinite(places).all():
        raise InputError(
            say(
                where,
                "at least three finite points (i, 2)",
                f"shape {places.shape}",
                "give the nodes of an arc",
            )
        )
    mean = places.mean(axis=0)
    size = np.abs(places - mean).max()
    local = (places - mean) / (size or 1.0)
    spread = np.linalg.svd(local, compute_uv=False)
    if spread[1] <= max(STRAIGHT, slack / (size or 1.0)) * spread[0] or size == 0.0:
        raise InputError(
            say(
                where,
                "points on a circle",
                "points on a straight line",
                "leave their edges straight",
            )
        )
    (a, b, c), *_ = np.linalg.lstsq(
        np.column_stack([2.0 * local, np.ones(len(local))]), np.sum(local**2, axis=1)
    )
    center = mean + size * np.array([a, b])
    radius = float(size * np.sqrt(c + a**2 + b**2))
    distance = np.abs(np.linalg.norm(places - center, axis=1) - radius)
    if distance.max() > max(ON_CIRCLE * min(radius, 2.0 * size), slack):
        worst = int(np.argmax(distance))
        got = f"point {worst} at {_place(places[worst])}, {distance[worst] / radius:.1e} of the radius {radius:g} m away from it"
        raise InputError(say(where, "points on a circle", got, "name the nodes of one arc only"))
    return center, radius


def arcs_of(
    points: ArrayLike,
    edge_groups: Groups,
    names: Iterable[str] | None = None,
    resolution: float = 0.0,
) -> list[Arc]:
    """An arc for each named group of edges; without names, for each group whose nodes lie on one
    circle.

    Without names a group needs at least four nodes and no edge beyond 50 degrees, so that the
    corners of a rectangle or hexagon, which lie on a circle too, stay corners. `resolution` is that
    of the coordinates [m], see `meshes.resolution`.
    """
    places = np.asarray(points, dtype=float)
    slack = ROUNDED * resolution
    arcs = []
    for name in edge_groups if names is None else names:
        if name not in edge_groups:
            known = ", ".join(sorted(edge_groups)) or "none"
            remedy = f"use one of the groups {known}{closest(name, edge_groups)}"
            raise InputError(say("ancf_plate.arcs_of", "a group of edges", repr(name), remedy))
        edges = groups.ids(f"edge group {name!r}", edge_groups[name], len(places), columns=2)
        try:
            center, radius = circle_through(places[distinct(edges)], slack)
        except InputError as error:
            if names is None:
                continue
            raise InputError(f"edge group {name!r}: {error}") from None
        if names is not None or _is_round(places[edges] - center, len(distinct(edges))):
            arcs.append(Arc(center, radius, edges, slack))
    return arcs


def _is_round(radii: Floats, nodes: int) -> bool:
    return nodes >= 4 and bool(np.abs(_angles(radii)).max() <= ROUND)
