"""Meshes of solids in files: read, checked, with nodes in the middle of their edges.

    read: file -> Solid, its cells all tetrahedra or all hexahedra, right way round, in one piece

Files are those of `meshes`. Cells of surfaces name faces, groups of nodes are sets, and a set that
holds all nodes of faces of the boundary names these too. Nodes on edges, faces and in cells stand
in other orders in every program: which is which is read from where they are.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csgraph

from ...core.algebra.linalg import distinct
from ...core.errors import InputError, closest, listed, say
from ...core.notices import notify, remark
from ...core.values.arguments import checked
from .. import meshes
from ..msh import CURVED, SOLID, MshCells, Raw
from ..plate_audit import LARGEST, Subject
from ..table import Floats, Ints
from . import elements, solid
from .elements import Kind
from .solid import Solid

KINDS = {
    "tetra": Kind.TETRA,
    "tetra10": Kind.TETRA10,
    "hexahedron": Kind.HEXAHEDRON,
    "hexahedron20": Kind.HEXAHEDRON20,
    "hexahedron27": Kind.HEXAHEDRON27,
}
#: det J over the product of its rows, the sine of a solid angle, below which a cell is flat: 0.01
#: is a tetrahedron whose height is a hundredth of its sides
FLAT = 1e-6
CLOSE = 1e-9  #: of the extent: nodes nearer than this are at one place
CUTS = 4  #: intervals of a side of a parent on which nodes of its eight parts lie
_OF_TETRA = np.array(
    [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 6, 7, 8],
        [4, 5, 6, 8],
        [6, 7, 8, 9],
        [5, 6, 8, 9],
    ]
)  #: of the parts of a tetrahedron, among its nodes of second order


@checked
def read(
    path: Path | str,
    volume: str | None = None,
    order: int = 2,
    repair: bool = False,
    unit: float = 1.0,
) -> Solid:
    """The checked mesh of solid cells in a file, or the part of it that a group of cells names.

    With `order` 2 cells of first order get nodes in the middle of their edges, which a remark says;
    with 1 they stay. `repair` merges nodes at one place, `unit` is the length of the file's unit
    [m]. InputError names the file, and the ids and positions of what is wrong.
    """
    path = Path(path)
    where = f"mesh {path}"
    return made(meshes.load(path, where, repair, unit), where, volume, order)


@checked
def from_skfem(mesh: Any, order: int = 2) -> Solid:
    """The checked mesh of a scikit-fem MeshTet or MeshHex, of first or second order.

    Its boundaries are faces, its subdomains volumes.
    """
    where = f"from_skfem: {type(mesh).__name__}"
    if mesh.p.shape[0] != 3 or mesh.t.shape[0] not in (4, 8):
        got = f"one in {mesh.p.shape[0]} dimensions"
        raise InputError(say(where, "a MeshTet or MeshHex", got))
    numbers = mesh.dofs.element_dofs.T.astype(np.int64)
    kind = Kind(numbers.shape[1])
    apart = np.abs(elements.positions(kind)[:, None] - mesh.elem().doflocs).max(axis=2)
    word = next(word for word, one in KINDS.items() if one is kind)
    volumes = {name: np.asarray(ids, np.int64) for name, ids in (mesh.subdomains or {}).items()}
    part = MshCells(numbers[:, np.argmin(apart, axis=1)], np.arange(len(numbers)), volumes)
    sides = mesh.facets.T.astype(np.int64)
    boundaries = {name: np.asarray(ids, np.int64) for name, ids in (mesh.boundaries or {}).items()}
    named = MshCells(sides, np.arange(len(sides)), boundaries)
    none = MshCells(sides[:0], sides[:0, 0], {})
    points = np.ascontiguousarray(mesh.doflocs.T)
    surfaces = (named, none) if kind.is_tetra else (none, named)
    raw = Raw(
        points, np.arange(len(points)), {}, none, *surfaces, {word: len(numbers)}, 0.0, {word: part}
    )
    return made(raw, where, None, order)


@checked
def write(body: Solid, path: Path | str) -> None:
    """Write a `.msh` file (gmsh 2.2, binary) or a `.vtu` file; `read` with the same order returns the
    same mesh.

    Sets that are all nodes of faces of their name are not written twice.
    """
    word = next(word for word, one in KINDS.items() if one is body.kind)
    faces = {name: solid.face_nodes(body, ids) for name, ids in body.faces.items()}
    groups = {
        "set": {name: ids for name, ids in body.sets.items() if name not in faces},
        "face": faces,
        "volume": body.volumes,
    }
    sides = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
    width = elements.face_nodes(body.kind).shape[1]
    meshes.export(Path(path), body.reference, word, body.nodes, groups, sides[width])


def made(raw: Raw, where: str, volume: str | None, order: int) -> Solid:
    """A checked solid of what a file says."""
    meshes.check_points(raw, where)
    kind, part = chosen(raw, where, volume)
    rows = meshes.rows(raw, part.nodes, where, "cells", part.numbers)
    kept, volumes = meshes.once(raw, part, rows, where)
    if volume is not None:
        mine = volumes[volume]
        kept = kept[mine]
        volumes = {name: np.flatnonzero(np.isin(mine, ids)) for name, ids in volumes.items()}
    cells = rows[kept]
    used, compact = np.unique(cells, return_inverse=True)
    cells = compact.reshape(len(kept), -1).astype(np.int64)
    subject = Subject(where, raw.points[used], cells, raw.numbers[used], part.numbers[kept])
    check_places(subject)
    cells = upright(subject, kind, ordered(subject, kind))
    check_pieces(subject, kind, cells)
    sets, volumes = meshes.without_empty(
        where, meshes.points_of(raw, used, where), volumes, tell=volume is None
    )
    materials = {name: raw.materials[name] for name in volumes if name in raw.materials}
    found = Solid(kind, cells, subject.points, sets, {}, volumes, raw.resolution, materials)
    found = replace(found, faces=named_faces(raw, where, used, found, tell=volume is None))
    if order == 2 and kind.order == 1:
        fine = second_order(found)
        text = f"{len(cells)} cells of first order, far too stiff in bending, get nodes in the middle of their edges"
        remark(
            f"{where}: {text}: {3 * fine.count} unknowns in place of {3 * found.count} (`order: 1` keeps them)"
        )
        return fine
    if order == 1:
        few = "with few of them over its height a body bends by a tenth to a half too little"
        of_first = f"{len(cells)} cells of first order are kept: {few}"
        remark(f"{where}: {of_first if kind.order == 1 else 'its cells stay of second order'}")
    return found


def chosen(raw: Raw, where: str, volume: str | None) -> tuple[Kind, MshCells]:
    """The solid cells of a file, or of a group: all of one kind, else InputError with a place."""
    parts = {kind: part for kind, part in raw.others.items() if kind in SOLID and len(part.nodes)}
    if volume is not None:
        known = sorted({name for part in parts.values() for name in part.groups})
        parts = {kind: one for kind, one in parts.items() if len(one.groups.get(volume, ()))}
        if not parts:
            expected = f"one of its groups of solid cells ({listed(known, volume, 'none')})"
            raise InputError(say(where, expected, f"'{volume}'") + closest(volume, known))
    if not parts:
        got = ", ".join(f"{count} {kind}" for kind, count in sorted(raw.kinds.items()) if count)
        remedy = "export the volume mesh; surfaces are `type: plate` or `shell`"
        raise InputError(say(where, "tetrahedra or hexahedra", got or "no cells at all", remedy))
    if len(parts) > 1 or next(iter(parts)) not in KINDS:
        few = min(parts, key=lambda kind: (kind in KINDS, len(parts[kind].nodes)))
        one = parts[few]
        first = meshes.rows(raw, one.nodes[:1], where, "cells", one.numbers[:1])[0]
        place = meshes.position(raw.points[first].mean(axis=0))
        counts = ", ".join(f"{len(part.nodes)} {kind}" for kind, part in parts.items())
        remedy = "mesh it with tetrahedra alone, or name a part of it by `volume`"
        got = f"{counts}, the first {few} is cell {one.numbers[0]} at {place}"
        raise InputError(say(where, "all tetrahedra or all hexahedra of one order", got, remedy))
    ((word, part),) = parts.items()
    return KINDS[word], part


def check_places(mesh: Subject) -> None:
    """InputError for coordinates that are no lengths, and for two nodes at one place: a crack that
    nobody sees.
    """
    from scipy.spatial import cKDTree

    with np.errstate(over="ignore"):
        size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    if not np.isfinite(size) or np.abs(mesh.points).max() > LARGEST:
        got = f"an extent of {np.abs(mesh.points).max():.3g}"
        raise mesh.bad("coordinates in metres", got, "check the unit of the export")
    pairs = cKDTree(mesh.points).query_pairs(CLOSE * size, output_type="ndarray")
    if len(pairs):
        got = f"nodes that coincide: {mesh.nodes(pairs.ravel())}"
        remedy = "merge them (`repair: true` of the scene), or move the sides of a slit apart"
        raise mesh.bad("one node a place", got, remedy)


def ordered(mesh: Subject, kind: Kind) -> Ints:
    """The nodes of cells (e, b) in the order of `elements`: those that are no corners by where they
    are.

    One order serves all cells: that of the least sum of squares of the distances from where nodes
    of straight cells would be.
    """
    from scipy.optimize import linear_sum_assignment

    cells = mesh.cells
    first = kind.corners
    if kind.order == 1:
        return cells
    straight = elements.basis(kind.straight, elements.positions(kind)[first:])[:, 0]
    corners = mesh.points[cells[:, :first]]
    size = np.ptp(corners, axis=1).max(axis=1)[:, None, None]
    wanted = np.einsum("pb,ebc->epc", straight, corners) / size
    given = mesh.points[cells[:, first:]] / size
    count = len(straight)
    cost = np.empty((count, count))
    for p in range(count):
        cost[p] = ((given - wanted[:, [p]]) ** 2).sum(axis=(0, 2))
    _, order = linear_sum_assignment(cost)
    return np.column_stack([cells[:, :first], cells[:, first:][:, order]])


def mirrored(kind: Kind) -> Ints:
    """The order of nodes (b,) of a cell that is turned inside out."""
    where = elements.positions(kind)
    apart = np.abs(where[:, None, [1, 0, 2]] - where).max(axis=2)
    return np.asarray(np.argmin(apart, axis=1))


def upright(mesh: Subject, kind: Kind, cells: Ints) -> Ints:
    """Cells (e, b) whose det J is positive; those that are turned inside out are turned back, others
    of no volume are an InputError.
    """

    def measured(cells: Ints) -> tuple[Floats, Floats]:
        body = Solid(kind, cells, mesh.points)
        runs = solid.parts(body)
        worst = np.concatenate([solid.quality(body, part) for part in runs])
        plain = Solid(kind.straight, cells[:, : kind.corners], mesh.points)
        return worst, np.concatenate([solid.quality(plain, part) for part in runs])

    turned = signed_volumes(mesh.points, cells[:, : kind.corners]) < 0.0
    if turned.any():
        cells = np.where(turned[:, None], cells[:, mirrored(kind)], cells)
    worst, straight = measured(cells)
    for expected, wrong, remedy in (
        ("cells with a volume", straight <= FLAT, "mesh it again, or remove them"),
        (
            "cells that are nowhere turned inside out",
            worst <= FLAT,
            "move the nodes in the middle of their edges, or mesh it finer there",
        ),
    ):
        bad = np.flatnonzero(wrong)
        if len(bad):
            raise mesh.bad(expected, f"{len(bad)} of {len(cells)}: {mesh.listed(bad)}", remedy)
    return cells


def signed_volumes(points: Floats, corners: Ints) -> Floats:
    """Volumes (e,) of cells by their corners (e, 4 or 8), of hexahedra of a part of them."""
    sides = points[
        corners[:, [1, 2 if corners.shape[1] == 4 else 3, 4 if corners.shape[1] == 8 else 3]]
    ]
    return np.asarray(np.linalg.det(sides - points[corners[:, :1]]))


def check_pieces(mesh: Subject, kind: Kind, cells: Ints) -> None:
    """InputError where cells do not hang together by faces: in several pieces, or by an edge or a
    node, about which a part would turn.
    """
    loops = np.sort(cells[:, elements.faces(kind)], axis=2)
    flat = loops.reshape(-1, loops.shape[2])
    _, same, uses = np.unique(flat, axis=0, return_inverse=True, return_counts=True)
    same = same.ravel()
    owner = np.repeat(np.arange(len(cells)), loops.shape[1])
    crowded = np.flatnonzero(uses > 2)
    if len(crowded):
        at = np.flatnonzero(same == crowded[0])
        remedy = "remove cells that overlap"
        got = f"{uses[crowded[0]]} cells at a face: {mesh.listed(owner[at])}"
        raise mesh.bad("at most two cells at a face", got, remedy)
    shape = (len(cells), len(uses))
    links = coo_array((np.ones(len(same)), (owner, same)), shape=shape).tocsr()
    count, label = csgraph.connected_components(links @ links.T, directed=False)
    if count == 1:
        return
    _, first, sizes = np.unique(label, return_index=True, return_counts=True)
    texts = [f"{n} cells from {mesh.cell(e)}" for n, e in zip(sizes[:3], first[:3], strict=True)]
    got = f"{count} parts: {meshes.several(texts, count)}"
    touching = len(distinct(cells)) < sum(len(distinct(cells[label == k])) for k in range(count))
    remedy = "name one of them by `volume`, merge nodes that should be one, or make two bodies"
    if touching:
        got += ", which share nodes but no face"
    raise mesh.bad("one piece that hangs together by faces", got, remedy)


def named_faces(raw: Raw, where: str, used: Ints, body: Solid, tell: bool) -> dict[str, Ints]:
    """Faces (i, 2) by the surface cells of a file, and by sets of nodes that hold whole faces of the
    boundary; a notice of those that are elsewhere if one is to `tell`.
    """
    outer = solid.boundary(body.kind, body.nodes)
    corners = elements.faces(body.kind)
    loops = np.sort(body.nodes[outer[:, :1], corners[outer[:, 1]]], axis=1)
    table = {tuple(loop): k for k, loop in enumerate(loops.tolist())}
    found: dict[str, Ints] = {}
    surfaces = [raw.triangles, raw.quads, *(raw.others[k] for k in CURVED if k in raw.others)]
    width = corners.shape[1]
    for part in surfaces:
        rows = meshes.rows(raw, part.nodes, where, "cells", part.numbers)[:, :width]
        local = np.minimum(np.searchsorted(used, rows), len(used) - 1)
        there = (used[local] == rows).all(axis=1)
        for name, ids in part.groups.items():
            keys = map(tuple, np.sort(local[ids[there[ids]]], axis=1).tolist())
            mine = [k for key in keys if (k := table.get(key)) is not None]
            if mine:
                before = found.get(name, np.zeros((0, 2), np.int64))
                found[name] = np.unique(np.vstack([before, outer[mine]]), axis=0)
    named = {name for part in surfaces for name, ids in part.groups.items() if len(ids)}
    if tell and (lost := sorted(named - found.keys())):
        notify(f"{where}: faces {', '.join(lost)} are none of the boundary, and are dropped")
    for name, ids in body.sets.items():
        inside = np.isin(loops, ids).all(axis=1)
        if name not in found and inside.any():
            found[name] = outer[inside]
    return found


def second_order(body: Solid) -> Solid:
    """The solid with nodes in the middle of its edges, behind its own; faces and cells keep their
    names, and sets take the nodes between two of theirs.
    """
    kind = elements.second_order(body.kind)
    if kind is body.kind:
        return body
    ends = np.sort(body.nodes[:, elements.edges(kind)], axis=2)
    pairs, same = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = body.count + same.reshape(len(ends), -1)
    sets = {
        name: np.concatenate([ids, body.count + np.flatnonzero(np.isin(pairs, ids).all(axis=1))])
        if len(ids) > 1
        else ids
        for name, ids in body.sets.items()
    }
    return replace(
        body,
        kind=kind,
        nodes=np.column_stack([body.nodes, middles]),
        reference=np.vstack([body.reference, body.reference[pairs].mean(axis=1)]),
        sets=sets,
    )


def halve(body: Solid) -> Solid:
    """The solid with every cell cut into eight, curved as it is; faces, volumes and sets keep their
    names.

    A node of the fine mesh is known by its weights over the corners of its cell, so that cells
    share it where these are shared, and no distance decides.
    """
    kind = body.kind
    points, children = pattern(kind)
    weights = corner_weights(kind, points)
    mark = np.random.default_rng(0).integers(0, 2**63, body.count, dtype=np.uint64)
    corners = body.nodes[:, : kind.corners]
    keys = (weights * mark[corners[:, None]]).sum(axis=2, dtype=np.uint64)
    _, first, same = np.unique(keys, return_index=True, return_inverse=True)
    cell, point = np.divmod(first, len(points))
    values = elements.basis(kind, points)[:, 0]
    reference = np.einsum("xb,xbc->xc", values[point], body.reference[body.nodes[cell]])
    numbers = same.reshape(keys.shape)
    at_nodes = np.abs(points - elements.positions(kind)[:, None]).max(axis=2).argmin(axis=1)
    image = np.empty(body.count, np.int64)
    image[body.nodes] = numbers[:, at_nodes]

    def fine_set(ids: Ints) -> Ints:
        if len(ids) == 1:
            return image[ids]
        inside = (weights == 0) | np.isin(corners, ids)[:, None]
        return np.unique(np.concatenate([image[ids], numbers[inside.all(axis=2)]]))

    parts = child_faces(kind)
    pieces = np.arange(len(children))
    return replace(
        body,
        nodes=numbers[:, children].reshape(-1, children.shape[1]),
        reference=reference,
        sets={name: fine_set(ids) for name, ids in body.sets.items()},
        faces={
            name: np.vstack([[len(children), 0] * face[:1] + parts[face[1]] for face in ids])
            for name, ids in body.faces.items()
        },
        volumes={
            name: (len(children) * ids[:, None] + pieces).ravel()
            for name, ids in body.volumes.items()
        },
    )


def corner_weights(kind: Kind, points: Floats) -> NDArray[np.uint64]:
    """Functions (p, corners) of straight cells at the points of a `pattern`, times CUTS^3, whole
    numbers.
    """
    return np.rint(elements.basis(kind.straight, points)[:, 0] * CUTS**3).astype(np.uint64)


@cache
def pattern(kind: Kind) -> tuple[Floats, Ints]:
    """Parent points (p, 3) of the nodes of the eight parts of a cell, and these parts (8, b).

    A tetrahedron has four at its corners, and four about the edge between the middles of 0-2 and
    1-3.
    """
    where = elements.positions(kind)
    if kind.is_tetra:
        nodes = elements.positions(Kind.TETRA10)
        corners = nodes[_OF_TETRA]
        sides = corners[:, 1:] - corners[:, :1]
        parts = corners[:, :1] + where @ sides
    else:
        corner = elements.positions(Kind.HEXAHEDRON)
        parts = 0.5 * (corner[:, None] + where)
    flat = np.rint(parts * CUTS).reshape(-1, 3)
    points, numbers = np.unique(flat, axis=0, return_inverse=True)
    return points / CUTS, numbers.reshape(8, -1)


@cache
def child_faces(kind: Kind) -> list[Ints]:
    """Of every face of a cell the parts (4, 2) that make it: a child and its face."""
    points, children = pattern(kind)
    inside = corner_weights(kind, points) > 0
    loops = children[:, elements.faces(kind)]
    found = []
    for face in elements.faces(kind):
        off = np.ones(kind.corners, bool)
        off[face] = False
        on = np.logical_not(inside[:, off].any(axis=1))
        found.append(np.argwhere(on[loops].all(axis=2)))
    return found
