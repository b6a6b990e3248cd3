r"""Curved shells on free meshes: the triangles of `fvs_plate`, each over its own plane, with the
coordinates r, r_1, r_2 of nodes.

    D_v(u) = J_v u,     J_v e = |e| 2 / (1 + cos phi) t_e     for both sides e of a triangle at its vertex v

t_e is the direction of a side in the tangent plane of node v (its projection, or the tangent of the
border), phi the angle between side and t_e: the side is the cubic line that is nearest to an arc of
a circle (`ancf_plate`), the same for both triangles at it, so that r is continuous. Quads are cut,
because a warped one has no plane in which its sides keep their lengths. With unit normals n that
meet those of a smooth surface to O(h^2), as `normals` gives them, slopes across sides agree to
O(h^2) of their change, w has order 2 and its curvatures order 1, as on flat plates.

    normals     z = p(x, y), cubic and zero at the node, fitted by least squares to the nodes around it: n = (-p_x, -p_y, 1)
    border      n is normal to the tangent of the border, that of the polynomial through five of its nodes

Coordinates 1 and 2 run along and across the border at its nodes, along both of its sides at
corners, so that what holds an edge there holds r_1 or r_2 alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array, eye_array

from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from . import fvs_plate, groups, meshes, plate_audit, splitting
from . import surface as surfaces
from .plate_meshes import PlateMesh
from .surface import Parent, Surface
from .table import Floats, Ints

CREASE = 50.0  #: angle between neighbouring facets [deg] beyond which nothing smooth is meant, as of edges on arcs
SHARP = 50.0  #: turn of the border at a node [deg] beyond which it is a corner, as of edges on arcs
#: turn [deg], and times those of its neighbours, beyond which it is a corner too: smooth ones
#: change slowly
BREAK = (
    10.0,
    3.0,
)
AROUND = 1.6  #: nodes of a fit, in terms of the polynomial
RINGS = 4  #: sides between a node and the farthest of its fit
FACING = 0.5  #: cosine between normals of a node and of one in its fit: height over the plane is no function far beyond
#: Terms of degree d count as DAMPING^(1 - d) in the least norm that decides where nodes do not, as
#: on strips of one or two cells; what they determine to more than 0.01 is theirs: at 0.1 cubics
#: would be damped on good meshes, at 0.001 fitted to noise
DAMPING, CUT = 1e-2, 1e-6
HERMITE = 4.0 / 27.0  #: largest value of a cubic function of slope 1 at one end of the side 1
REMEDY = "mesh it finer; at a kink, make two bodies of two face groups, and join them there"


@dataclass(frozen=True, eq=False)
class Border:
    """The node before and after every one on the border, -1 elsewhere, and its corners."""

    before: Ints  #: (n,)
    after: Ints  #: (n,)
    corner: np.ndarray  #: (n,) flags


def surface(mesh: PlateMesh) -> tuple[Surface, float]:
    """The shell through the nodes of a mesh of triangles or quads, and the distance [m] to which
    they define it.

    Quads are cut along their shorter diagonals. The distance is that of sides with normals of cubic
    fits from those of quadratic ones. InputError names facets that meet in a crease.
    """
    mesh = triangles(mesh)
    cells, faces = mesh.cells, mesh.face_groups
    _check_creases(mesh, cells)
    points = mesh.points
    rough = _mean_normals(points, cells)
    border = _border(points, cells, rough)
    along = _border_tangents(points, border)
    fine, coarse = (_across(normals(points, cells, rough, degree), along) for degree in (3, 2))
    tangents = _bases(points, border, along, fine)
    space = _space(points, cells, border, tangents, fine)
    named = groups.check_groups(cells, mesh.point_groups, mesh.edge_groups, faces)
    count = len(points)
    nodes = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), -1)
    reference = np.concatenate([points[:, None], tangents], axis=1).reshape(3 * count, 3)
    shape = Surface(
        space,
        Parent.TRIANGLE,
        nodes,
        reference,
        np.tile([1.0, 0.0, 0.0], count),
        fvs_plate.ORDER,
        *named,
        mesh.resolution,
    )
    ends = plate_audit.sides(cells)
    sides = (points[ends[..., 1]] - points[ends[..., 0]])[:, :, None]
    return shape, float(HERMITE * np.abs(np.sum((fine - coarse)[ends] * sides, axis=3)).max())


def triangles(mesh: PlateMesh) -> PlateMesh:
    """A mesh whose quads are cut along their shorter diagonals; one of triangles itself."""
    if mesh.cells.shape[1] == 3:
        return mesh
    cells = splitting.halves(mesh.points, mesh.cells).reshape(-1, 3)
    faces = {
        name: (2 * rows[:, None] + np.arange(2)).ravel() for name, rows in mesh.face_groups.items()
    }
    return replace(mesh, cells=cells, face_groups=faces)


def halve(mesh: PlateMesh, shape: Surface) -> PlateMesh:
    """A mesh of triangles or quads in space with a node in the middle of every side, on the `shape`
    through its nodes.

    Quads are cut as `surface` does, which gives that shape; groups keep their names.
    """
    mesh = triangles(mesh)
    count = len(mesh.points)
    corners = mesh.cells
    ends = plate_audit.sides(corners)
    keys, first, side = np.unique(
        plate_audit.side_keys(ends, count), return_index=True, return_inverse=True
    )
    a, b, c = corners.T
    ab, bc, ca = (count + side.reshape(-1, 3)).T
    cells = (
        np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]])
        .transpose(2, 0, 1)
        .reshape(-1, 3)
    )

    def halves(pairs: np.ndarray) -> np.ndarray:
        middle = count + np.searchsorted(keys, plate_audit.side_keys(pairs, count))
        return np.stack([pairs[:, 0], middle, middle, pairs[:, 1]], axis=1).reshape(-1, 2)

    return replace(
        mesh,
        points=np.concatenate([mesh.points, middles(shape, first // 3, first % 3)]),
        cells=cells,
        edge_groups={name: halves(pairs) for name, pairs in mesh.edge_groups.items()},
        face_groups={
            name: (4 * ids[:, None] + np.arange(4)).ravel()
            for name, ids in mesh.face_groups.items()
        },
    )


def middles(shape: Surface, cell: np.ndarray, side: np.ndarray) -> Floats:
    """Points (x, 3) of a shape in the middle of sides (x,) of triangles (x,)."""
    rows = surfaces.sample(
        shape, cell, surfaces.side_points(Parent.TRIANGLE, side, np.full(len(side), 0.5))
    )
    return np.asarray(rows @ shape.reference)


# ---------------------------------------------------------------------------------------------------------------- normals
def normals(points: Floats, cells: Ints, rough: Floats, degree: int) -> Floats:
    """Unit normals (n, 3) of the smooth surface through the vertices (n, 3) of triangles (e, 3),
    near `rough` ones (n, 3).
    """
    powers = np.array([(d - j, j) for d in range(1, degree + 1) for j in range(d + 1)])
    damping = DAMPING ** (powers.sum(axis=1) - 1.0)
    near, known = _around(cells, rough, int(AROUND * len(powers)))
    frames = _frames(rough)
    local = np.einsum("nic,nac->nia", points[near] - points[:, None], frames)
    size = np.linalg.norm(local, axis=2).max(axis=1, initial=0.0, where=known)
    local /= size[:, None, None]
    x, y, z = np.moveaxis(local, 2, 0)
    weight = known / np.maximum(np.hypot(x, y), np.finfo(float).tiny)
    weight[~known] = 0.0
    terms = (
        weight[..., None] * x[..., None] ** powers[:, 0] * y[..., None] ** powers[:, 1] * damping
    )
    slopes = np.einsum("nmi,ni->nm", np.linalg.pinv(terms, rcond=CUT), weight * z)[:, :2]
    found = np.einsum("na,nac->nc", np.column_stack([-slopes, np.ones(len(points))]), frames)
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _around(cells: Ints, rough: Floats, wanted: int) -> tuple[Ints, np.ndarray]:
    """Nodes (n, i) about every node, as many rings as hold `wanted`, and flags (n, i) of those that
    are any.
    """
    count = len(rough)
    pairs = np.concatenate(
        [plate_audit.sides(cells).reshape(-1, 2), np.column_stack([np.arange(count)] * 2)]
    )
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    ring = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    reach = csr_array(eye_array(count))
    lists = [np.zeros(0, np.int64)] * count
    for _ in range(RINGS):
        reach = csr_array(reach @ ring)
        for v in np.flatnonzero([len(ids) < wanted for ids in lists]):
            ids = reach.indices[reach.indptr[v] : reach.indptr[v + 1]]
            lists[v] = ids[(ids != v) & (rough[ids] @ rough[v] > FACING)]
    known = np.arange(max(map(len, lists))) < np.array([len(ids) for ids in lists])[:, None]
    near = np.zeros(known.shape, np.int64)
    near[known] = np.concatenate(lists)
    return near, known


def _facet_normals(points: Floats, cells: Ints) -> Floats:
    found = np.cross(
        points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]]
    )
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _mean_normals(points: Floats, cells: Ints) -> Floats:
    """Unit normals (n, 3), those of the facets weighted by their angles."""
    ahead = points[np.roll(cells, -1, axis=1)] - points[cells]
    back = points[np.roll(cells, 1, axis=1)] - points[cells]
    angle = np.arctan2(np.linalg.norm(np.cross(ahead, back), axis=2), np.sum(ahead * back, axis=2))
    total = np.zeros_like(points)
    np.add.at(total, cells, angle[..., None] * _facet_normals(points, cells)[:, None])
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))


def _frames(normal: Floats) -> Floats:
    """Orthonormal rows (n, 3, 3), the last one along the normals (n, 3)."""
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


# ----------------------------------------------------------------------------------------------------------------- border
def _border(points: Floats, cells: Ints, normal: Floats) -> Border:
    pairs, _ = plate_audit.border(cells, len(points))
    before, after = np.full(len(points), -1), np.full(len(points), -1)
    before[pairs[:, 1]], after[pairs[:, 0]] = pairs[:, 0], pairs[:, 1]
    on = np.flatnonzero(after >= 0)
    back, ahead = (
        _unit(_flattened(step, normal[on]))
        for step in (points[on] - points[before[on]], points[after[on]] - points[on])
    )
    turn = np.zeros(len(points))
    turn[on] = np.degrees(np.arccos(np.clip(np.sum(back * ahead, axis=1), -1.0, 1.0)))
    beside = np.maximum(turn[before], turn[after])
    corner = (turn > SHARP) | ((turn > BREAK[0]) & (turn > BREAK[1] * beside))
    return Border(before, after, corner & (after >= 0))


def _border_tangents(points: Floats, border: Border) -> Floats:
    """Unit tangents (n, 3) of the border at its nodes but for corners, zero elsewhere."""
    found = np.zeros_like(points)
    for v in np.flatnonzero((border.after >= 0) & ~border.corner):
        chain = [int(v)]
        for onward, at in ((border.before, 0), (border.after, -1)):
            for _ in range(2):
                if not border.corner[chain[at]]:
                    chain.insert(0 if at == 0 else len(chain), int(onward[chain[at]]))
        places = points[chain]
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
        s = (s - s[chain.index(int(v))]) / s[-1]
        found[v] = np.linalg.solve(np.vander(s, increasing=True), places)[1]
    return np.divide(
        found, np.linalg.norm(found, axis=1, keepdims=True), out=found, where=found != 0.0
    )


def _across(normal: Floats, along: Floats) -> Floats:
    """Normals (n, 3) without their parts along the border."""
    return _unit(_flattened(normal, along))


def _flattened(vectors: Floats, normal: Floats) -> Floats:
    """Vectors (..., 3) without their parts along unit vectors, or zero ones."""
    return np.asarray(vectors - np.sum(vectors * normal, axis=-1, keepdims=True) * normal)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


# ------------------------------------------------------------------------------------------------------------- the charts
def _bases(points: Floats, border: Border, along: Floats, normal: Floats) -> Floats:
    """Unit tangents r_1, r_2 (n, 2, 3) of the nodes."""
    found = _frames(normal)[:, :2]
    smooth = along.any(axis=1)
    found[smooth] = np.stack([along[smooth], np.cross(normal[smooth], along[smooth])], axis=1)
    corner = np.flatnonzero(border.corner)
    for k, onward in enumerate((border.after, border.before)):
        found[corner, k] = _unit(
            _flattened(points[onward[corner]] - points[corner], normal[corner])
        )
    return found


def _space(
    points: Floats, cells: Ints, border: Border, bases: Floats, normal: Floats
) -> fvs_plate.Conforming:
    """The triangles in their planes, with J of every vertex in terms of r_1 and r_2 there."""
    ends = plate_audit.sides(cells)
    sides = points[ends[..., 1]] - points[ends[..., 0]]
    first = _unit(sides[:, 0])
    plane = np.stack([first, np.cross(_facet_normals(points, cells), first)], axis=1)
    outside = (border.after[ends[..., 0]] == ends[..., 1])[..., None]
    tangents, chords = [], []
    for k, shift in ((0, 0), (1, 1)):  # of the side after a vertex, and of the one before it
        node = ends[..., k]
        follows = outside & ~border.corner[node][..., None]
        direction = np.where(follows, bases[node, 0], _unit(_flattened(sides, normal[node])))
        length = np.linalg.norm(sides, axis=2, keepdims=True)
        cosine = np.sum(direction * sides, axis=2, keepdims=True) / length
        tangent = 2.0 * length / (1.0 + cosine) * direction
        parts = np.einsum("etc,etci->eti", tangent, np.linalg.pinv(bases)[node])
        tangents.append(np.roll(parts, shift, axis=1))
        chords.append(np.roll(np.einsum("etc,eic->eti", sides, plane), shift, axis=1))
    J = np.stack(tangents, axis=3) @ np.linalg.inv(np.stack(chords, axis=3))
    return fvs_plate.Conforming(
        np.einsum("evc,eic->evi", points[cells] - points[cells[:, :1]], plane), J
    )


# -------------------------------------------------------------------------------------------------------- what is refused
def _check_creases(mesh: PlateMesh, cells: Ints) -> None:
    """Refuse cells that turn by more than CREASE at a side, and tell of those that turn more than
    all around, by BREAK.
    """
    points = mesh.points
    where = f"mesh {mesh.path or 'in memory'}"
    sides = plate_audit.sides(cells).reshape(-1, 2)
    keys = plate_audit.side_keys(sides, len(points))
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    one, two = order[same], order[same + 1]
    normal = _facet_normals(points, cells)
    turn = np.degrees(
        np.arccos(np.clip(np.sum(normal[one // 3] * normal[two // 3], axis=1), -1.0, 1.0))
    )
    at_nodes = np.zeros(len(points))
    np.maximum.at(at_nodes, sides[one], turn[:, None])
    # of the vertices across from the side
    beside = [at_nodes[cells[side // 3, (side % 3 + 2) % 3]] for side in (one, two)]
    kink = (turn > BREAK[0]) & (turn > BREAK[1] * np.maximum(*beside))
    for found in (turn > CREASE, kink):
        if found.any():
            middles = points[sides[one[found]][:3]].mean(axis=1)
            got = f"{turn[found].max():.0f} degrees, at {meshes.several([meshes.position(x) for x in middles], int(found.sum()))}"
            if found is not kink:
                raise InputError(
                    say(
                        where,
                        f"cells that meet at an angle of at most {CREASE:g} degrees",
                        got,
                        REMEDY,
                    )
                )
            notify(f"{where}: a kink is made smooth, where cells meet at {got}: {REMEDY}")
