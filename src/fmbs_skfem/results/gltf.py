r"""Bodies at one instant as binary glTF 2.0 (Khronos Group, registry.khronos.org/glTF/specs/2.0),
one node with one mesh each.

    glTF = R scene,    R (x, y, z) = (x, z, -y) in space, R = 1 in the plane

as y is up in glTF, and z in space. R is the rotation of the node above all bodies, so that vertices
have the coordinates of the scene [m]. Lines become tubes of their radius, single points octahedra;
skins and middle surfaces stay as they are. Morph targets are none: viewers need to mix eight only,
and leave out further ones, where a model has dozens of unknowns. Vertices follow points instead.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from .. import __version__
from . import palette, surfaces, swept
from .frames import Array, Indices, Shown

SIDES = 10  #: of a tube: 36 degrees apart, smooth beside `surfaces.CREASE`, which 8 are not
FOLDED = 0.5  #: inverse of the longest mitre of a tube, over its radius: of a corner of 60 degrees
FLAT = 1e-9  #: area of a triangle, over that of its facet, that is none
POINTS, LINE_STRIP, TRIANGLES = 0, 3, 4  #: modes
NUMBERS = {"<f4": 5126, "<u2": 5123, "<u4": 5125}  #: types
#: of vectors, of numbers of points, and of indices: what they are for, and bytes from one to the next
VIEWS = ({"target": 34962, "byteStride": 12}, {"target": 34962, "byteStride": 4}, {"target": 34963})
BUFFER = {"POSITION": 0, "NORMAL": 0, "_POINT": 1, "indices": 2}  #: numbers of their views
GAMMA = 2.2  #: from colours of screens to those of glTF, which are linear


class SkinMesh(NamedTuple):
    """v vertices, of which each moves with one of the points of its body."""

    points: Array  #: (v, 3) [m]
    moved_by: Indices  #: (v,)
    normals: Array = np.empty((0, 3))  #: (v, 3) of triangles
    cells: Indices | None = None  #: (f, 3) triangles; a line, or one point, has none


def make_mesh(body: Shown, count: int) -> SkinMesh:
    """The mesh of a body at its first instant, which has so many points for viewers: as many as are
    shown, or sections.
    """
    if not body.is_surface:
        if not body.size.all():
            return SkinMesh(body.points[0], follow(body, count))
        body = tube(body) if len(body.points[0]) > 1 else octahedron(body)
    points = body.points[0]
    place = surfaces.places(body.reference) if body.is_shell else np.arange(len(points))
    of, normals, triangles = split(points, body.cells, place)
    return SkinMesh(points[of], follow(body, count)[of], normals, triangles)


def follow(body: Shown, count: int) -> Indices:
    """Numbers (x,) of the `count` points along a line or of a surface with which those of a body
    move.
    """
    sections, around = body.sections if body.sections[0] else (len(body.reference), 1)
    ends = len(body.reference) - sections * around
    found = np.append(
        np.repeat(np.arange(sections), around), np.repeat([0, sections - 1], ends // 2)
    )
    return found * ((count - 1) // max(sections - 1, 1))


def split(points: Array, quads: Indices, place: Indices) -> tuple[Indices, Array, Indices]:
    """Vertices as numbers (v,) of points (x, 3), their normals (v, 3) and triangles (f, 3).

    A point is several vertices where facets meet in a crease.
    """
    area = surfaces.facet_normals(points, quads)
    size = np.linalg.norm(area, axis=1)
    quads, area, size = (one[size > 0.0] for one in (quads, area, size))
    unit = area / size[:, None]
    corner, facet = quads.ravel(), np.repeat(np.arange(len(quads)), 4)
    at = csr_array((np.ones(len(corner)), (place[corner], np.arange(len(corner)))))
    i, j = (at.T @ at).nonzero()
    smooth = np.einsum("fc,fc->f", unit[facet[i]], unit[facet[j]]) > surfaces.CREASE
    graph = coo_array(
        (np.ones(smooth.sum()), (i[smooth], j[smooth])), shape=(len(corner), len(corner))
    )
    count, group = connected_components(graph, directed=False)
    normals = np.zeros((count, 3))
    np.add.at(normals, group, area[facet])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    pairs, number = np.unique(np.column_stack([corner, group]), axis=0, return_inverse=True)
    halves = [[0, 1, 2], [0, 2, 3]]
    ends, triangles = (one.reshape(-1, 4)[:, halves].reshape(-1, 3) for one in (corner, number))
    a, b, c = points[ends].transpose(1, 0, 2)
    # where cells are triangles, some facets have corners at one place
    real = np.linalg.norm(np.cross(b - a, c - a), axis=1) > FLAT * np.repeat(size, 2)
    return pairs[:, 0], normals[pairs[:, 1]], triangles[real]


def tube(line: Shown) -> Shown:
    """A line at its first instant as a tube of its radius, mitred at corners, closed at its ends."""
    points = line.points[0]
    along = directions(points)
    # across the line without a twist: by the least rotation from segment to segment
    across = np.empty_like(along)
    across[0] = np.cross(along[0], np.eye(3)[np.abs(along[0]).argmin()])
    across[0] /= np.linalg.norm(across[0])
    for k, (a, b) in enumerate(pairwise(along)):
        turned = across[k] - across[k] @ b / max(1.0 + a @ b, 1e-12) * (a + b)
        across[k + 1] = turned / np.linalg.norm(turned)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    contour = np.column_stack([np.cos(angles), np.sin(angles)])
    # every point has the segment behind it, the last one that before it
    own = np.append(along, along[-1:], axis=0)
    e = np.stack([across, np.cross(along, across)])
    e = np.append(e, e[:, -1:], axis=1)
    ring = np.einsum("na,axc->xnc", contour, e)
    # a closed line goes on with its other end
    is_closed = (points[0] == points[-1]).all()
    before, after = (along[-1:], along[:1]) if is_closed else (along[:1], along[-1:])
    middle = np.append(before, along, axis=0) + np.append(along, after, axis=0)
    size = np.linalg.norm(middle, axis=1, keepdims=True)
    middle = np.where(size > 1e-9, middle / np.maximum(size, 1e-9), e[1])
    # into the plane of the mitre along the segment, and back in it as far as that is too long
    cosine = np.einsum("xc,xc->x", own, middle)[:, None]
    least = np.maximum(cosine, FOLDED)
    back = (1.0 - cosine / least) / np.maximum(1.0 - cosine**2, 1e-300) * (middle - cosine * own)
    ring -= np.einsum("xnc,xc->xn", ring, middle)[:, :, None] * (own / least + back)[:, None]
    mesh = swept.closed(contour, np.zeros(1, np.int64), len(points))
    found = mesh.spread((points[:, None] + line.size[0] * ring)[None])
    radius = np.full(found.shape[1], line.size[0])
    return Shown(found, {}, radius, found[0], mesh.cells, (len(points), SIDES))


def directions(points: Array) -> Array:
    """Unit vectors (x - 1, 3) along segments between points (x, 3); those without a length have the
    one of a neighbour.
    """
    apart = np.diff(points, axis=0)
    length = np.linalg.norm(apart, axis=1)
    known = np.maximum.accumulate(np.where(length > 0.0, np.arange(len(length)), 0))
    known = np.where(length[known] > 0.0, known, length.argmax())
    return np.asarray(apart[known] / length[known, None])


def octahedron(point: Shown) -> Shown:
    """A body of one point at its first instant, with its radius from there to the corners."""
    radius = float(point.size[0])
    corners = point.points[0] + radius * np.concatenate([np.eye(3), -np.eye(3)])
    facets = []
    for k in range(8):
        x, y, z = (axis + 3 * (k >> axis & 1) for axis in range(3))
        # outwards: every reflection changes the sense
        facets.append([x, z, y, y] if k.bit_count() % 2 else [x, y, z, z])
    return Shown(corners[None], {}, np.full(6, radius), corners, np.array(facets), (1, 6))


def write(
    meshes: Mapping[str, SkinMesh], extras: Mapping[str, Mapping[str, Any]], planar: bool
) -> bytes:
    """A file of named bodies with `extras` of their nodes, each in a colour of its own.

    Vertices have the attribute `_POINT`, the number of the point that moves them: of `moved_by`,
    counted from `first` of the extras. Nothing in it says when it was made.
    """
    small = all(len(one.points) < 2**16 for one in meshes.values())
    accessors: list[dict[str, Any]] = []
    buffers = [b""] * len(VIEWS)
    made = []
    for k, (name, mesh) in enumerate(meshes.items()):
        numbers = {}
        for key, values in arrays_of(mesh, extras[name]["first"], "<u2" if small else "<u4"):
            numbers[key] = len(accessors)
            accessors.append(describe(key, values, len(buffers[BUFFER[key]])))
            buffers[BUFFER[key]] += values.tobytes()
        indices = {"indices": numbers.pop("indices")} if mesh.cells is not None else {}
        line = LINE_STRIP if len(mesh.points) > 1 else POINTS
        mode = {"mode": TRIANGLES if indices else line, "material": k}
        made.append({"name": name, "primitives": [{"attributes": numbers} | indices | mode]})
    # z of space becomes y by -90 degrees about x
    up = {} if planar else {"rotation": [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]}
    bodies = [{"name": name, "mesh": k, "extras": extras[name]} for k, name in enumerate(meshes)]
    # the last one is empty where all bodies are lines
    parts = [pad(one, b"\0") for one in buffers if one]
    described = {
        "asset": {"version": "2.0", "generator": f"fmbs_skfem {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": list(range(1, len(bodies) + 1)), **up}, *bodies],
        "meshes": made,
        "materials": [material(palette.colour(k)) for k in range(len(meshes))],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteOffset": end - len(one), "byteLength": len(one), **view}
            for end, one, view in zip(accumulate(map(len, parts)), parts, VIEWS, strict=False)
        ],
        "buffers": [{"byteLength": sum(map(len, parts))}],
    }
    return pack(json.dumps(described, separators=(",", ":")).encode(), b"".join(parts))


def arrays_of(mesh: SkinMesh, first: int, index: str) -> Iterator[tuple[str, np.ndarray]]:
    """What a file has of a mesh, whose points are counted from the `first` one."""
    yield "POSITION", mesh.points.astype("<f4")
    # floats, as VTK reads no others here; numbers of two bytes would begin at every fourth one, too
    yield "_POINT", (mesh.moved_by + first).astype("<f4")
    if mesh.cells is not None:
        yield "NORMAL", mesh.normals.astype("<f4")
        yield "indices", mesh.cells.astype(index).ravel()


def describe(key: str, values: np.ndarray, offset: int) -> dict[str, Any]:
    """The accessor of an array of a mesh, so many bytes behind the begin of its buffer."""
    limits = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
    return {
        "bufferView": BUFFER[key],
        "byteOffset": offset,
        "componentType": NUMBERS[values.dtype.str],
        "type": "VEC3" if values.ndim == 2 else "SCALAR",
        "count": len(values),
        **(limits if key == "POSITION" else {}),
    }


def material(colour: str) -> dict[str, Any]:
    """A matt material, seen from both sides, of a colour #rrggbb."""
    shares = [round((int(colour[k : k + 2], 16) / 255.0) ** GAMMA, 4) for k in (1, 3, 5)]
    matt = {"metallicFactor": 0, "roughnessFactor": 0.7}
    return {
        "pbrMetallicRoughness": {"baseColorFactor": [*shares, 1], **matt},
        "doubleSided": True,
    }


def pack(text: bytes, buffer: bytes) -> bytes:
    """A file of a JSON text and a buffer of whole words of four bytes."""
    body = b"".join(
        struct.pack("<I4s", len(one), kind) + one
        for one, kind in ((pad(text, b" "), b"JSON"), (buffer, b"BIN\0"))
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def pad(data: bytes, filler: bytes) -> bytes:
    """Data filled up to whole words of four bytes."""
    return data + filler * (-len(data) % 4)
