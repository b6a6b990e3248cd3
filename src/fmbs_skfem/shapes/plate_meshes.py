"""Meshes of plates and shells: read and audited, written, exchanged with scikit-fem.

    read: file -> points (n,3) [m], cells (e,4) or (e,3), groups of points, edges and faces by name

Files are gmsh `.msh` (2.2 or 4.1; groups are its physical groups of points, curves and surfaces,
unnamed ones are called `tag_n`) or VTK `.vtu` (groups are arrays of zeros and ones, see `vtu`: on
points a point group, on line cells an edge group, on triangles or quads a face group). What comes
out of `read` is one piece of convex cells, all quads or all triangles (`splitting`), that meet side
to side and turn the same way (`plate_audit`); a `Notice` says what is dropped or turned on the way.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..core import errors
from ..core.algebra.linalg import distinct
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from . import meshes, plate_audit, splitting
from .msh import Floats, Ints, MshCells, Raw

if TYPE_CHECKING:
    from skfem import Mesh

    from .ancf_plate import Arc

Kind = Literal["point", "edge", "face"]

_NAMES = {3: "triangle", 4: "quad"}  #: nodes of a cell -> meshio's name


@dataclass(frozen=True, eq=False)
class PlateMesh:
    """Straight-sided cells, all quads or all triangles."""

    points: Floats  #: (n,3) [m]
    cells: Ints  #: (e,4) or (e,3) node ids, counter-clockwise seen from above
    point_groups: dict[str, Ints] = field(default_factory=dict)  #: name -> (i,) node ids
    #: name -> (i,2) node pairs, border ones along their cell
    edge_groups: dict[str, Ints] = field(default_factory=dict)
    face_groups: dict[str, Ints] = field(default_factory=dict)  #: name -> (i,) cell ids
    path: Path | None = None  #: the file it was read from
    #: half a unit of the last digit of the file's coordinates [m], see `meshes.resolution`
    resolution: float = 0.0


@checked
def read(
    path: Path | str,
    planar: bool,
    face: str | None = None,
    repair: bool = False,
    unit: float = 1.0,
    corners: int | None = None,
) -> PlateMesh:
    """The audited mesh in a file, or the part of it that a face group names.

    A planar body asks for a mesh in a plane z = constant. InputError names the file, and the ids
    and positions of what is wrong. `repair` merges nodes at one place, see `repair`; `unit` is the
    length of the file's unit [m]. A mesh of quads and triangles is split into cells of `corners`
    with a notice, see `splitting`; without `corners` it is refused.

        >>> from fmbs_skfem.shapes import plate_meshes
        >>> mesh = plate_meshes.read("meshes/plate_8x8.msh", planar=True)
        >>> mesh.points.shape, mesh.cells.shape, sorted(mesh.edge_groups)
        ((81, 3), (64, 4), ['bottom', 'left', 'right', 'top'])
    """
    path = Path(path)
    where = f"mesh {path}"
    raw = splitting.uniform(meshes.load(path, where, repair, unit), where, corners, face)
    return _audited(raw, where, path, planar, face)


@checked
def write(mesh: PlateMesh, path: Path | str) -> None:
    """Write a `.msh` file (gmsh 2.2, binary; cells ordered by group) or a `.vtu` file; `read`
    returns the same mesh.
    """
    meshes.export(Path(path), mesh.points, _NAMES[mesh.cells.shape[1]], mesh.cells, _groups(mesh))


@checked
def from_skfem(mesh: Mesh, planar: bool = True) -> PlateMesh:
    """The audited mesh of a scikit-fem MeshQuad or MeshTri: its boundaries are edge groups, its
    subdomains face groups.

    The order of nodes in scikit-fem says nothing about sides up and down: cells are turned
    counter-clockwise without a notice.
    """
    cells = np.asarray(mesh.t, np.int64).T
    if cells.shape[1] not in _NAMES or mesh.p.shape[0] != 2:
        got = f"a {type(mesh).__name__} in {mesh.p.shape[0]} dimensions"
        raise errors.InputError(
            errors.say("from_skfem", "a planar MeshQuad or MeshTri of first order", got)
        )
    points = np.column_stack([mesh.p.T, np.zeros(mesh.p.shape[1])])
    _, normal = plate_audit.corner_sines(points, cells)
    cells = np.where(normal[:, 2:] < 0, plate_audit.reversed_cells(cells), cells)
    edges = {
        name: mesh.facets[:, np.asarray(ids)].T.astype(np.int64)
        for name, ids in (mesh.boundaries or {}).items()
    }
    faces = {name: np.asarray(ids, np.int64) for name, ids in (mesh.subdomains or {}).items()}
    return audit(PlateMesh(points, cells, {}, edges, faces), planar)


@checked
def to_skfem(mesh: PlateMesh) -> Any:
    """A scikit-fem MeshQuad or MeshTri in x and y with the edge groups as boundaries and the face
    groups as subdomains.

    scikit-fem has no groups of points.
    """
    import skfem

    z = mesh.points[:, 2]
    if np.ptp(z) > plate_audit.CLOSE * np.ptp(mesh.points, axis=0).max():
        where = f"mesh {mesh.path or 'in memory'}"
        got = f"z from {z.min():.6g} to {z.max():.6g}"
        raise errors.InputError(errors.say(where, "a plane mesh for scikit-fem", got))
    kind = skfem.MeshQuad if mesh.cells.shape[1] == 4 else skfem.MeshTri
    out = kind(np.ascontiguousarray(mesh.points[:, :2].T), np.ascontiguousarray(mesh.cells.T))
    keys = plate_audit.side_keys(out.facets.T, len(mesh.points))
    order = np.argsort(keys)
    edges = {
        name: order[np.searchsorted(keys[order], plate_audit.side_keys(pairs, len(mesh.points)))]
        for name, pairs in mesh.edge_groups.items()
    }
    return out.with_boundaries(edges).with_subdomains(mesh.face_groups)


@checked
def halve(mesh: PlateMesh, arcs: Iterable[Arc] = ()) -> PlateMesh:
    """A plane mesh with a node in the middle of every side and quad, behind its own nodes; groups
    keep their names.

    Nodes in the middle of sides on arcs lie on them. By scikit-fem.
    """
    coarse = to_skfem(mesh)
    fine = coarse.refined()
    count = len(mesh.points)
    keys = plate_audit.side_keys(coarse.facets.T, count)
    order = np.argsort(keys)  # the node in the middle of facet k is count + k
    for arc in arcs:
        middles = (
            count + order[np.searchsorted(keys[order], plate_audit.side_keys(arc.edges, count))]
        )
        radii = fine.p[:, middles].T - arc.center
        fine.p[:, middles] = (
            arc.center + arc.radius * radii / np.linalg.norm(radii, axis=1, keepdims=True)
        ).T
    found = from_skfem(fine)
    return replace(
        found, point_groups=mesh.point_groups, path=mesh.path, resolution=mesh.resolution
    )


def audit(mesh: PlateMesh, planar: bool) -> PlateMesh:
    """A mesh made in memory, checked as if it came from a file."""
    where = f"mesh {mesh.path or 'in memory'}"
    if (
        mesh.cells.ndim != 2
        or mesh.cells.shape[1] not in _NAMES
        or mesh.points.ndim != 2
        or mesh.points.shape[1] != 3
    ):
        got = f"points {mesh.points.shape}, cells {mesh.cells.shape}"
        raise errors.InputError(errors.say(where, "points (n, 3) and cells (e, 3) or (e, 4)", got))
    lines = np.concatenate([np.zeros((0, 2), np.int64), *mesh.edge_groups.values()])
    ends = np.cumsum([0, *(len(pairs) for pairs in mesh.edge_groups.values())])
    edges = {
        name: np.arange(a, b) for name, a, b in zip(mesh.edge_groups, ends, ends[1:], strict=False)
    }
    cells = {
        width: MshCells(np.zeros((0, width), np.int64), np.zeros(0, np.int64), {})
        for width in _NAMES
    }
    cells[mesh.cells.shape[1]] = MshCells(mesh.cells, np.arange(len(mesh.cells)), mesh.face_groups)
    raw = Raw(
        points=mesh.points,
        numbers=np.arange(len(mesh.points)),
        point_groups=mesh.point_groups,
        lines=MshCells(lines, np.arange(len(lines)), edges),
        triangles=cells[3],
        quads=cells[4],
        kinds={_NAMES[width]: len(part.nodes) for width, part in cells.items()},
    )
    return _audited(raw, where, mesh.path, planar, None)


def _groups(mesh: PlateMesh) -> dict[str, dict[str, Ints]]:
    return {"point": mesh.point_groups, "edge": mesh.edge_groups, "face": mesh.face_groups}


def group(mesh: PlateMesh, name: str, kind: Kind) -> Ints:
    """A group: node ids (i,) of points, node pairs (i,2) of edges, cell ids (i,) of faces."""
    return meshes.member(mesh.path, name, kind, _groups(mesh))


def _audited(raw: Raw, where: str, path: Path | None, planar: bool, face: str | None) -> PlateMesh:
    """Check what the file says; keep each cell once, and the points that cells use."""
    part = _faces(raw, where)
    meshes.check_points(raw, where)
    cells = meshes.rows(raw, part.nodes, where, "cells", part.numbers)
    _check_vertices(part, cells, where)
    kept, faces = meshes.once(raw, part, cells, where)
    whole = PlateMesh(raw.points, cells[kept], face_groups=faces, path=path)
    if face is not None:
        chosen = group(whole, face, "face")
        faces = {name: np.flatnonzero(np.isin(chosen, ids)) for name, ids in faces.items()}
        faces = {name: ids for name, ids in faces.items() if len(ids)}
        kept = kept[chosen]
    used, compact = np.unique(cells[kept], return_inverse=True)
    compact = compact.reshape(len(kept), -1).astype(np.int64)
    subject = plate_audit.Subject(
        where, raw.points[used], compact, raw.numbers[used], part.numbers[kept]
    )
    compact = plate_audit.check(subject, planar)
    edges = _edges(raw, where, used, compact, strict=face is None)
    points, edges, faces = meshes.without_empty(
        where, meshes.points_of(raw, used, where), edges, faces, tell=face is None
    )
    return PlateMesh(raw.points[used], compact, points, edges, faces, path, raw.resolution)


def _faces(raw: Raw, where: str) -> MshCells:
    """The triangles or the quads of a file, whichever there are."""
    used = "triangles, quads and their edges"
    meshes.require_cells(
        raw, where, ("quad", "triangle"), "export a surface mesh of first order", used
    )
    part, other = (raw.quads, raw.triangles) if len(raw.quads.nodes) else (raw.triangles, raw.quads)
    return MshCells(part.nodes, part.numbers, other.groups | part.groups)


def _check_vertices(part: MshCells, cells: Ints, where: str) -> None:
    ordered = np.sort(cells, axis=1)
    bad = np.flatnonzero(np.any(ordered[:, 1:] == ordered[:, :-1], axis=1))
    if len(bad):
        found = [f"cell {part.numbers[i]} with nodes {part.nodes[i].tolist()}" for i in bad[:3]]
        got = meshes.several(found, len(bad))
        remedy = "remove them, or export them as triangles"
        raise errors.InputError(errors.say(where, "cells with different vertices", got, remedy))


def _edges(raw: Raw, where: str, used: Ints, cells: Ints, strict: bool) -> dict[str, Ints]:
    """Edge groups as node pairs (i,2), each a side of a cell and once; strict: others are an error,
    else they are left out.
    """
    pairs = meshes.rows(raw, raw.lines.nodes, where, "lines", raw.lines.numbers)
    local = np.minimum(np.searchsorted(used, pairs), len(used) - 1)
    sides = plate_audit.sides(cells).reshape(-1, 2)
    keys, first = np.unique(plate_audit.side_keys(sides, len(used)), return_index=True)
    wanted = plate_audit.side_keys(local, len(used))
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    good = np.all(used[local] == pairs, axis=1) & (keys[at] == wanted)
    grouped = distinct(np.concatenate([np.zeros(0, np.int64), *raw.lines.groups.values()]))
    bad = grouped[~good[grouped]]
    if strict and len(bad):
        ends = [
            (meshes.list_ids(raw, pairs[i, :1]), meshes.list_ids(raw, pairs[i, 1:]))
            for i in bad[:3]
        ]
        found = [
            f"line {raw.lines.numbers[i]} from {a} to {b}"
            for i, (a, b) in zip(bad, ends, strict=False)
        ]
        remedy = "mesh the curve together with the surface"
        raise errors.InputError(
            errors.say(
                where, "edge groups on sides of cells", meshes.several(found, len(bad)), remedy
            )
        )
    out = {}
    for name, ids in raw.lines.groups.items():
        _, once = np.unique(at[ids[good[ids]]], return_index=True)
        out[name] = sides[first[at[ids[good[ids]]][np.sort(once)]]]
    return out
