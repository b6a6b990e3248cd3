"""What can be wrong with the cells of a plate, each with the numbers and positions of the first few
places.

    corner of a cell    sine of its angle, s_i = (e_{i-1} x e_i) . n / (|e_{i-1}| |e_i|),   e_i = x_{i+1} - x_i
    s > 0 at all corners    convex;    s < 0 at one: concave, at two of four: bow-tie;    s = 0: a corner of 0 or 180 degrees

A plate that passes is one piece of convex cells that meet side to side, two at most at a side, all
turning the same way, with one node a place and no node inside a side. In a planar body the cells
turn counter-clockwise in the x, y plane. P. M. Knupp, SIAM J. Sci. Comput. 23 (2001) 193-218, doi
10.1137/S1064827500371499 (angles and Jacobians of quadrilaterals).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csgraph

from ..core import errors
from ..core.algebra.linalg import distinct
from ..core.storage.records import dataclass
from . import surface
from .meshes import position, several
from .msh import Floats, Ints
from .surface import Surface

CLOSE = 1e-9  #: of the extent: nodes nearer than this are at one place, and a planar mesh is flat to this
FLAT = 1e-8  #: sine of an angle that counts as 0 or 180 degrees
ON_SIDE = 1e-6  #: of the length of a side: a node nearer than this lies on it
LARGEST = 1e100  #: coordinates whose products are far from overflow [m]
BLOCK = 1024  #: cells of a surface looked at together


@dataclass(frozen=True, eq=False)
class Subject:
    """Points and cells under audit, with the numbers that the file gives them."""

    where: str  #: opens every error message
    points: Floats  #: (n,3) [m]
    cells: Ints  #: (e,3) or (e,4) rows of points
    numbers: Ints  #: (n,) node numbers
    cell_numbers: Ints  #: (e,) cell numbers

    def node(self, i: int) -> str:
        return f"node {self.numbers[i]} at {position(self.points[i])}"

    def cell(self, e: int) -> str:
        return f"cell {self.cell_numbers[e]} at {position(self.points[self.cells[e]].mean(axis=0))}"

    def nodes(self, ids: Ints) -> str:
        return several([self.node(i) for i in ids[:3]], len(ids))

    def listed(self, cells: Ints) -> str:
        return several([self.cell(e) for e in cells[:3]], len(cells))

    def bad(self, expected: str, got: str, remedy: str) -> errors.InputError:
        return errors.InputError(errors.say(self.where, expected, got, remedy))


def check(mesh: Subject, planar: bool) -> Ints:
    """The cells of a plate that has nothing wrong, counter-clockwise in a planar body; else
    InputError.
    """
    size = _check_extent(mesh, planar)
    up = check_corners(mesh)
    cells = _turned(mesh, up) if planar else mesh.cells
    mesh = Subject(mesh.where, mesh.points, cells, mesh.numbers, mesh.cell_numbers)
    _check_manifold(mesh)
    _check_places(mesh, CLOSE * size)
    _check_hanging(mesh)
    _check_one_piece(mesh)
    return cells


def check_flat(where: str, points: Floats, cells: Ints) -> Ints:
    """The cells of a plate of points (n, 2) that has nothing wrong, anticlockwise; else InputError."""
    flat = np.column_stack([points, np.zeros(len(points))])
    return check(
        Subject(where, flat, cells, np.arange(len(points)), np.arange(len(cells))), planar=True
    )


def sides(cells: Ints) -> Ints:
    """Node pairs (e, b, 2) of the sides of cells; side i runs from vertex i to vertex i + 1."""
    return np.stack([cells, np.roll(cells, -1, axis=1)], axis=2)


def side_keys(pairs: Ints, count: int) -> Ints:
    """One number a side, the same both ways; pairs (..., 2) of `count` nodes."""
    low = pairs.min(axis=-1)
    high = pairs.max(axis=-1)
    return low * np.int64(count) + high


def border(cells: Ints, count: int) -> tuple[Ints, Ints]:
    """Sides (i, 2) that belong to one cell only, along that cell, and the cells (i,); `count` nodes
    in all.
    """
    pairs = sides(cells).reshape(-1, 2)
    _, same, times = np.unique(side_keys(pairs, count), return_inverse=True, return_counts=True)
    alone = np.flatnonzero(times[same] == 1)
    return pairs[alone], alone // cells.shape[1]


def corner_sines(points: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """Sines (e, b) of the corner angles about the normal of the widest corner, and that unit normal
    (e, 3).
    """
    side = np.diff(points[sides(cells)], axis=2)[:, :, 0]
    before = np.roll(side, 1, axis=1)
    corner = np.cross(before, side)
    widest = np.argmax(np.linalg.norm(corner, axis=2), axis=1)
    normal = corner[np.arange(len(cells)), widest]
    length = np.linalg.norm(side, axis=2)
    tiny = np.finfo(float).tiny
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), tiny)[:, None]
    return np.einsum("ebc,ec->eb", corner, normal) / np.maximum(
        length * np.roll(length, 1, axis=1), tiny
    ), normal


def _check_extent(mesh: Subject, planar: bool) -> float:
    """The extent of the mesh, which is finite and, for a planar body, in a plane z = constant."""
    with np.errstate(over="ignore"):
        size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    if not np.isfinite(size) or np.abs(mesh.points).max() > LARGEST:
        raise mesh.bad(
            "coordinates in metres",
            f"an extent of {np.abs(mesh.points).max():.3g}",
            "check the unit of the export",
        )
    if planar:
        z = mesh.points[:, 2]
        off = np.flatnonzero(np.abs(z - np.median(z)) > CLOSE * size)
        if len(off):
            remedy = "export a flat mesh in x and y; a curved surface in space is a shell (type: shell, mesh: or nurbs:)"
            raise mesh.bad(
                "a mesh in a plane z = constant for a planar body", mesh.nodes(off), remedy
            )
    return size


def check_corners(mesh: Subject) -> Floats:
    """Refuse cells without area, bow-ties and angles of 180 degrees or more; the normals (e, 3) of
    the others.
    """
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    length = np.linalg.norm(np.diff(mesh.points[sides(mesh.cells)], axis=2)[:, :, 0], axis=2)
    short = np.flatnonzero((length <= 1e-12 * size).any(axis=1))
    if len(short):
        raise mesh.bad(
            "cells with sides longer than zero",
            mesh.listed(short),
            "remove them and merge nodes that coincide",
        )
    sines, normal = corner_sines(mesh.points, mesh.cells)
    flat = np.abs(sines) <= FLAT
    inward = np.count_nonzero(sines < -FLAT, axis=1)
    for expected, wrong, remedy in (
        ("cells with an area", flat.all(axis=1), "remove them and merge nodes that coincide"),
        ("cells whose sides do not cross", inward >= 2, "swap two nodes of each bow-tie"),
        (
            "cells with angles below 180 degrees",
            (inward == 1) | flat.any(axis=1),
            "move their nodes, or split them",
        ),
    ):
        bad = np.flatnonzero(wrong)
        if len(bad):
            raise mesh.bad(expected, mesh.listed(bad), remedy)
    return normal


def _turned(mesh: Subject, normal: Floats) -> Ints:
    """Counter-clockwise cells; all clockwise ones are turned, a part of them is an error."""
    clockwise = np.flatnonzero(normal[:, 2] < 0)
    if 0 < len(clockwise) < len(mesh.cells):
        other = np.flatnonzero(normal[:, 2] > 0)
        few, word = (
            (clockwise, "clockwise")
            if len(clockwise) <= len(other)
            else (other, "counter-clockwise")
        )
        got = f"{len(few)} of {len(mesh.cells)} {word}: {mesh.listed(few)}"
        raise mesh.bad(
            "cells that all turn the same way", got, "reverse the node order of these cells"
        )
    return reversed_cells(mesh.cells) if len(clockwise) else mesh.cells


def reversed_cells(cells: Ints) -> Ints:
    """The same cells from below; the first vertex stays."""
    return np.roll(cells[:, ::-1], 1, axis=1)


def _check_manifold(mesh: Subject) -> None:
    """At most two cells a side, which run along it in opposite directions."""
    pairs = sides(mesh.cells).reshape(-1, 2)
    owner = np.repeat(np.arange(len(mesh.cells)), mesh.cells.shape[1])
    _, same, times = np.unique(
        side_keys(pairs, len(mesh.points)), return_inverse=True, return_counts=True
    )
    crowded = np.flatnonzero(times > 2)
    if len(crowded):
        at = np.flatnonzero(same == crowded[0])
        got = f"{times[crowded[0]]} cells at the side between {mesh.node(pairs[at[0], 0])} and {mesh.node(pairs[at[0], 1])}"
        more = f" and {len(crowded) - 1} more sides" if len(crowded) > 1 else ""
        remedy = "make it two bodies joined there, or remove cells"
        raise mesh.bad(
            "at most two cells at a side", f"{got}: {mesh.listed(owner[at])}{more}", remedy
        )
    _, again, number = np.unique(
        pairs @ [len(mesh.points), 1], return_inverse=True, return_counts=True
    )
    against = distinct(owner[number[again] > 1])
    if len(against):
        remedy = "reverse the node order of one part; in a planar mesh, remove cells that overlap"
        raise mesh.bad(
            "neighbours that turn the same way",
            f"a side run twice in one direction by {mesh.listed(against)}",
            remedy,
        )


def _check_places(mesh: Subject, close: float) -> None:
    """One node a place: two would be a crack that nobody sees."""
    from scipy.spatial import cKDTree

    _, same, times = np.unique(
        np.rint(mesh.points / close), axis=0, return_inverse=True, return_counts=True
    )
    double = np.flatnonzero(times[same.ravel()] > 1)
    double = double[np.argsort(same.ravel()[double], kind="stable")]
    if not len(double):
        double = np.flatnonzero(cKDTree(mesh.points).query(mesh.points, k=2)[0][:, 1] <= close)
    if len(double):
        remedy = "merge the nodes, or move the two sides of a slit apart"
        raise mesh.bad("one node a place", f"nodes that coincide: {mesh.nodes(double)}", remedy)


def _check_hanging(mesh: Subject) -> None:
    """No border node inside a border side of another cell."""
    from scipy.spatial import cKDTree

    pairs, owner = border(mesh.cells, len(mesh.points))
    nodes = distinct(pairs)
    start, end = mesh.points[pairs[:, 0]], mesh.points[pairs[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    near = cKDTree(mesh.points[nodes]).query_ball_point(0.5 * (start + end), 0.5 * length)
    side = np.repeat(np.arange(len(pairs)), [len(ids) for ids in near])
    node = nodes[
        np.concatenate([np.zeros(0, np.int64), *(np.array(ids, np.int64) for ids in near)])
    ]
    other = (node != pairs[side, 0]) & (node != pairs[side, 1])
    side = side[other]
    node = node[other]
    along = (end - start)[side] / length[side, None]
    offset = mesh.points[node] - start[side]
    offset -= np.einsum("ic,ic->i", offset, along)[:, None] * along
    on = np.flatnonzero(np.linalg.norm(offset, axis=1) <= ON_SIDE * length[side])
    if len(on):
        texts = [
            f"{mesh.node(node[i])} inside a side of {mesh.cell(owner[side[i]])}" for i in on[:3]
        ]
        remedy = "split the cell there, or merge the node into a vertex"
        raise mesh.bad("cells that meet side to side", several(texts, len(on)), remedy)


def _check_one_piece(mesh: Subject) -> None:
    """All cells connected, and by more than a node."""
    start, end = border(mesh.cells, len(mesh.points))[0].T
    pinched = np.flatnonzero(np.bincount(np.concatenate([start, end])) > 2)
    if len(pinched):
        remedy = "close the gap, or make two bodies joined there"
        raise mesh.bad(
            "cells that hang together by sides",
            f"parts that touch only at {mesh.nodes(pinched)}",
            remedy,
        )
    start, end = sides(mesh.cells).reshape(-1, 2).T
    count = len(mesh.points)
    links = coo_array((np.ones(len(start)), (start, end)), shape=(count, count)).tocsr()
    parts, label = csgraph.connected_components(links, directed=False)
    if parts > 1:
        label = label[mesh.cells[:, 0]]
        counts = np.bincount(label)
        (_, first) = np.unique(label, return_index=True)
        texts = [f"{counts[i]} cells from {mesh.cell(first[i])}" for i in range(min(parts, 3))]
        remedy = "read the face group of one body, or merge nodes that should be one"
        raise mesh.bad("one piece", f"{parts} parts: {several(texts, parts)}", remedy)


def check_regular(where: str, shape: Surface) -> None:
    """Refuse curved cells whose area element r,1 x r,2 vanishes at a Gauss point, or turns back
    from one to the next in a cell.

    A named edge that is a point, the pole of a sphere, is refused too: there the surface has no
    tangents.
    """
    largest = float(np.abs(shape.reference).max())
    if not largest <= LARGEST:
        raise errors.InputError(
            errors.say(
                where, "coordinates in metres", f"{largest:.3g}", "check the unit of the export"
            )
        )
    xi, _ = surface.quadrature(shape.space, shape.parent, shape.order + 1)
    for start in range(0, len(shape.nodes), BLOCK):
        part = np.arange(start, min(start + BLOCK, len(shape.nodes)))
        rows = surface.basis(shape.space, np.repeat(part, len(xi)), np.tile(xi, (len(part), 1)))[
            :, :3
        ]
        x, one, two = np.einsum(
            "xkb,xbc->kxc", rows, shape.reference[shape.nodes[part]].repeat(len(xi), axis=0)
        )
        flat, folded = _irregular(one, two, len(part))
        for expected, wrong in (
            ("cells with an area", flat),
            ("cells that do not fold back over themselves", folded),
        ):
            if wrong.any():
                middle = x.reshape(len(part), len(xi), -1).mean(axis=1)
                texts = [
                    f"cell {part[e]} about {position(middle[e])}" for e in np.flatnonzero(wrong)[:3]
                ]
                got = several(texts, int(wrong.sum()))
                remedy = "move its control points apart"
                raise errors.InputError(errors.say(where, expected, got, remedy))
    _check_edges(where, shape)


def _irregular(one: Floats, two: Floats, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Cells (e,) without area at a Gauss point, and cells that fold, by tangents (e p p, c) at a
    square of Gauss points a cell.
    """
    flat_too = ((0, 0), (0, 3 - one.shape[1]))
    normal = np.cross(np.pad(one, flat_too), np.pad(two, flat_too))
    order = int(np.sqrt(len(one) // cells))
    grid = normal.reshape(cells, order, order, -1)
    turns = [
        np.einsum("eijc,eijc->eij", a, b)
        for a, b in ((grid[:, 1:], grid[:, :-1]), (grid[:, :, 1:], grid[:, :, :-1]))
    ]
    size = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
    flat = (np.linalg.norm(normal, axis=1) <= FLAT * size).reshape(cells, -1).any(axis=1)
    return flat, np.any([(turn <= 0.0).any(axis=(1, 2)) for turn in turns], axis=0)


def _check_edges(where: str, shape: Surface) -> None:
    """Refuse named edges that are points."""
    extent = np.ptp(shape.reference, axis=0).max()
    for name, edge in shape.edges.items():
        cell, side = np.repeat(edge, 2, axis=0).T
        xi = surface.side_points(shape.parent, side, np.tile([0.25, 0.75], len(edge)))
        places = surface.sample(shape, cell, xi) @ shape.reference
        if np.ptp(places, axis=0).max() <= CLOSE * extent:
            got = f"{name}, which is the point {position(places[0])}"
            remedy = "cut a small hole there, or take another patch"
            raise errors.InputError(errors.say(where, "sides longer than zero", got, remedy))
