r"""Curved surfaces through the nodes of structured quad meshes: one bicubic B-spline patch, one
cell a quad.

    r(u_i, v_j) = x_ij,      u_i = u_i-1 + mean_j |x_ij - x_i-1,j|,   v_j likewise       (averaged chord lengths)

at all nodes x_ij, with the end conditions "not a knot", or periodic where the mesh closes on
itself: a smooth surface is met to O(h^4). Structured: four cells at every inner node, one or two at
every border node, and the sides of the border four lines (a mapped rectangle), two closed ones (a
tube) or none (a torus). L. Piegl, W. Tiller, The NURBS Book, 2nd ed.,
doi:10.1007/978-3-642-59223-2, section 9.2.5; C. de Boor, A Practical Guide to Splines, Springer
1978, ch. 4.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..core.algebra.linalg import distinct
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from . import groups, meshes, nurbs, plate_audit
from .plate_meshes import PlateMesh
from .surface import VERTICES, Parent, Surface
from .table import Floats, Ints

DEGREE = 3
TIE = 1e-9  #: of the extent: coordinates nearer than this are alike where the first cell is chosen
REMEDY = "mesh it with mapped quads (gmsh: Transfinite Surface, Recombine Surface), each such part a face group and a body of its own"


class NoGrid(InputError):
    """A mesh whose cells are in no rows and columns."""


@dataclass(frozen=True, eq=False)
class NodeGrid:
    """The quads of a structured mesh in rows and columns."""

    cells: Ints  #: (e1, e2) cells
    turns: Ints  #: (e1, e2) the vertex of each cell that is its corner at the least u and v
    nodes: Ints  #: (n1, n2) nodes; the first row or column once more at the end where the mesh is closed


def surface(mesh: PlateMesh, cells: int = 1, degree: int | None = None) -> tuple[Surface, float]:
    """The surface through the nodes of a mesh, and the estimated distance [m] of its surface
    between nodes from the one meant.

    Every quad is split into `cells` x `cells`, the degree raised to `degree`. Groups of the mesh
    are its points, edges and faces, beside the places of `nurbs.surface`. The estimate is that of
    cubic interpolation, 1/15 of what leaving out every second line of nodes changes. NoGrid names
    cells and nodes that are in none.
    """
    found = grid(mesh)
    points = mesh.points[found.nodes]
    closed = tuple(
        bool(np.array_equal(np.take(found.nodes, 0, i), np.take(found.nodes, -1, i)))
        for i in (0, 1)
    )
    control = points
    knots = []
    for axis in (0, 1):
        u = _chords(points, axis)
        control = np.moveaxis(
            _interpolated(u, np.moveaxis(control, axis, 0), closed[axis]), 0, axis
        )
        knots.append(np.concatenate([u[:1].repeat(DEGREE), u, u[-1:].repeat(DEGREE)]))
    patch, control = nurbs.refine(
        nurbs.Patch(knots[0], knots[1], DEGREE, DEGREE), control, cells, cells, degree
    )
    for axis in (0, 1):
        if closed[axis]:
            ends = np.moveaxis(control, axis, 0)
            ends[-1] = ends[0]
    shape = nurbs.surface(patch, control, join=True)
    return _named(shape, mesh, found, cells), max(_estimate(points, i, closed[i]) for i in (0, 1))


def _chords(points: Floats, axis: int) -> Floats:
    """Averaged chord lengths (n,) along an axis of points (n1, n2, 3), from 0 to 1."""
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=2).mean(axis=1 - axis)
    u = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(u / u[-1])


def _spline(u: Floats, values: Floats, closed: bool) -> Any:
    from scipy.interpolate import CubicSpline

    return CubicSpline(u, values, bc_type="periodic" if closed else "not-a-knot")


def _interpolated(u: Floats, values: Floats, closed: bool) -> Floats:
    """Coefficients (n + 2, ...) over the open knots at u of the cubic spline through values (n,
    ...).
    """
    from scipy.interpolate import make_interp_spline

    slopes = _spline(u, values, closed)(u[[0, -1]], 1)
    return np.asarray(
        make_interp_spline(u, values, DEGREE, bc_type=([(1, slopes[0])], [(1, slopes[1])])).c
    )


def _estimate(points: Floats, axis: int, closed: bool) -> float:
    """Distance [m] of the spline from the surface meant: that of every second node from the spline
    through the others, over 15.
    """
    values = np.moveaxis(points, axis, 0)
    u = _chords(points, axis)
    coarse = distinct(np.append(np.arange(0, len(u), 2), len(u) - 1))
    if len(coarse) < (4 if closed else 3):
        return 0.0
    distance = np.linalg.norm(_spline(u[coarse], values[coarse], closed)(u) - values, axis=2)
    return float(distance.max() / 15.0)


def _named(shape: Surface, mesh: PlateMesh, found: NodeGrid, cells: int) -> Surface:
    """The surface with the groups of the mesh, whose quads are `cells` x `cells` cells of it."""
    e1, e2 = found.cells.shape
    at = np.zeros((len(mesh.cells), 2), np.int64)
    at[found.cells.ravel()] = np.indices((e1, e2)).reshape(2, -1).T
    turns = np.zeros(len(mesh.cells), np.int64)
    turns[found.cells] = found.turns
    turned = mesh.cells[np.arange(len(turns))[:, None], (turns[:, None] + np.arange(4)) % 4]
    points, edges, faces = groups.check_groups(
        turned, mesh.point_groups, mesh.edge_groups, mesh.face_groups
    )
    last = cells - 1
    inner = np.arange(cells)

    def fine(cell: Ints, i: Ints | int, j: Ints | int) -> Ints:
        return np.asarray((at[cell, 0] * cells + i) + e1 * cells * (at[cell, 1] * cells + j))

    corner = {
        name: (int(fine(np.array(c), int(x) * last, int(y) * last)), x, y)
        for name, (c, x, y) in points.items()
    }
    rows = {}
    for name, sides in edges.items():
        cell, side = sides.repeat(cells, axis=0).T
        start = VERTICES[Parent.SQUARE][side].astype(np.int64) * last
        along = np.diff(VERTICES[Parent.SQUARE][[0, 1, 2, 3, 0]], axis=0).astype(np.int64)[side]
        i, j = (start + np.tile(inner, len(sides))[:, None] * along).T
        rows[name] = np.column_stack([fine(cell, i, j), side])
    whole = {
        name: fine(ids[:, None, None], inner[:, None], inner).ravel() for name, ids in faces.items()
    }
    return replace(
        shape,
        points=shape.points | corner,
        edges=shape.edges | rows,
        faces=shape.faces | {n: np.sort(c) for n, c in whole.items()},
    )


# ------------------------------------------------------------------------------------------------------------------- grid
def grid(mesh: PlateMesh) -> NodeGrid:
    """The quads of a mesh in rows and columns; NoGrid where they are in none."""
    where = f"mesh {mesh.path or 'in memory'}"
    if mesh.cells.shape[1] != 4:
        raise NoGrid(
            say(where, "structured quads for a shell", f"{len(mesh.cells)} triangles", REMEDY)
        )
    _check_regular(mesh, where)
    beside = _neighbours(mesh.cells, len(mesh.points))
    cell, turn = _first(mesh)
    columns, closed1 = _walk(beside, cell, turn, 1)
    rows = []
    for start in columns:
        row, closed2 = _walk(beside, *start, 2)
        rows.append(row)
    lengths = {len(row) for row in rows}
    cells, turns = (
        np.array([[place[k] for place in row] for row in rows])
        if len(lengths) == 1
        else np.zeros((1, 1), int)
        for k in (0, 1)
    )
    if len(distinct(cells)) != len(mesh.cells):
        got = f"{len(distinct(cells))} cells in rows and columns"
        raise NoGrid(say(where, f"rows and columns of {len(mesh.cells)} quads", got, REMEDY))
    corners = mesh.cells[cells[..., None], (turns[..., None] + np.arange(4)) % 4]
    nodes = np.empty((cells.shape[0] + 1, cells.shape[1] + 1), np.int64)
    nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:] = np.moveaxis(corners, 2, 0)
    fits = [nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]]
    ends = (not closed1 or np.array_equal(nodes[0], nodes[-1])) and (
        not closed2 or np.array_equal(nodes[:, 0], nodes[:, -1])
    )
    if not (ends and all(np.array_equal(fit, corners[..., k]) for k, fit in enumerate(fits))):
        raise NoGrid(
            say(
                where, "rows and columns of quads", "a mesh that is twisted where it closes", REMEDY
            )
        )
    return NodeGrid(cells, turns, nodes)


def _check_regular(mesh: PlateMesh, where: str) -> None:
    """Four cells at every inner node, at most two at a border node."""
    times = np.bincount(mesh.cells.ravel(), minlength=len(mesh.points))
    rim = np.zeros(len(mesh.points), bool)
    rim[plate_audit.border(mesh.cells, len(mesh.points))[0]] = True
    wrong = np.flatnonzero(np.where(rim, times > 2, times != 4))
    if len(wrong):
        texts = [
            f"{times[i]} at the {'border' if rim[i] else 'inner'} node at {meshes.position(mesh.points[i])}"
            for i in wrong[:3]
        ]
        expected = (
            "a structured mesh, four quads at every inner node and one or two at every border node"
        )
        raise NoGrid(say(where, expected, meshes.several(texts, len(wrong)), REMEDY))


def _neighbours(cells: Ints, count: int) -> Ints:
    """Cell and side (e, 4, 2) beyond each side; -1 beyond the border."""
    keys = plate_audit.side_keys(plate_audit.sides(cells), count).ravel()
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    found = np.full((len(keys), 2), -1)
    one, two = order[same], order[same + 1]
    found[one], found[two] = np.column_stack(np.divmod(two, 4)), np.column_stack(np.divmod(one, 4))
    return found.reshape(-1, 4, 2)


def _first(mesh: PlateMesh) -> tuple[int, int]:
    """The cell and its vertex where u and v begin: the first corner, border node or node by x, y
    and z, not by its number.
    """
    times = np.bincount(mesh.cells.ravel(), minlength=len(mesh.points))
    pairs, owner = plate_audit.border(mesh.cells, len(mesh.points))
    ends = np.flatnonzero(times == 1)
    known = ends if len(ends) else distinct(pairs) if len(pairs) else np.arange(len(mesh.points))
    size = TIE * float(np.ptp(mesh.points, axis=0).max())

    def least(points: Floats) -> int:
        return int(np.lexsort(np.rint(points / size).T[::-1])[0])

    node = known[least(mesh.points[known])]
    if len(pairs):  # along the border
        cell = owner[np.flatnonzero(pairs[:, 0] == node)[0]]
    else:
        around = np.flatnonzero((mesh.cells == node).any(axis=1))
        cell = around[least(mesh.points[mesh.cells[around]].mean(axis=1))]
    return int(cell), int(np.flatnonzero(mesh.cells[cell] == node)[0])


def _walk(beside: Ints, cell: int, turn: int, direction: int) -> tuple[list[tuple[int, int]], bool]:
    """Cells and their first vertices from a cell on in direction 1 or 2, and whether they come back
    to it.
    """
    found = [(cell, turn)]
    while True:
        following, side = beside[found[-1][0], (found[-1][1] + direction) % 4]
        if following < 0:
            return found, False
        place = (int(following), int(side + 2 - direction) % 4)
        if place[0] == cell or len(found) > len(beside):
            return found, place == (cell, turn)
        found.append(place)


def unevenness(points: Floats, cells: Ints) -> float:
    """Largest change of the turns of grid lines and of their rungs [deg] from one to the next, of
    quads (e, 4) on points (n, c).

    A line ..u, v, w, z.. turns at v by the angle from u v to v w; a row of cells turns in each of
    them by the angle from a side to the one across. On images of a grid under a smooth map turns
    change by O(h^2) from one to the next, whatever the angles of the cells; on free meshes they do
    not fall. Infinite where an inner node has other than four cells.
    """
    count = len(points)
    start, end = plate_audit.sides(cells).reshape(-1, 2).T
    cell, side = _neighbours(cells, count).reshape(-1, 2).T
    twin = np.where(cell < 0, -1, 4 * cell + side)
    times = np.bincount(start, minlength=count)
    inner = np.ones(count, dtype=bool)
    inner[start[twin < 0]] = inner[end[twin < 0]] = False
    if (times[inner & (times > 0)] != 4).any():
        return np.inf
    sides = np.arange(len(twin))
    along = points[end] - points[start]
    opposite = sides - sides % 4 + (sides + 2) % 4
    shared = np.flatnonzero(twin >= 0)
    rungs = _turn(-along[opposite[shared]], along[shared]) - _turn(
        along[shared], along[opposite[twin[shared]]]
    )
    around = twin[sides - sides % 4 + (sides - 1) % 4]  # the next side that starts at the same node
    chosen = np.flatnonzero(inner[start] & inner[end])
    back, ahead = around[around[chosen]], around[around[twin[chosen]]]
    lines = _turn(-along[back], along[chosen]) - _turn(along[chosen], along[ahead])
    return float(
        np.degrees(np.linalg.norm(np.concatenate([rungs, lines]), axis=1).max(initial=0.0))
    )


def _turn(one: Floats, two: Floats) -> Floats:
    """Rotation vectors (x, 3) [rad] from the directions of vectors (x, c) to those of others."""
    one, two = (
        np.pad(v / np.linalg.norm(v, axis=1, keepdims=True), ((0, 0), (0, 3 - v.shape[1])))
        for v in (one, two)
    )
    axis = np.cross(one, two)
    size = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(size, np.sum(one * two, axis=1))
    return np.asarray(axis * (angle / np.maximum(size, np.finfo(float).tiny))[:, None])
