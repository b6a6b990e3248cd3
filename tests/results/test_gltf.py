"""Bodies as binary glTF: files are read back by a reader of their own here, and by VTK."""

from __future__ import annotations

import json
import struct
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.results import frames, gltf
from fmbs_skfem.results.frames import Shown

TYPES = {5126: np.dtype("<f4"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4")}
POLYGON = 0.5 * gltf.SIDES * np.sin(2.0 * np.pi / gltf.SIDES)  #: area of the section over r^2


class Part(NamedTuple):
    """A body of a file."""

    points: np.ndarray  #: (v, 3) as they are stored
    seen: np.ndarray  #: (v, 3) in the axes of glTF
    moved_by: np.ndarray  #: (v,)
    normals: np.ndarray  #: (v, 3)
    cells: np.ndarray  #: (f, 3)
    mode: int
    extras: dict[str, Any]

    @property
    def areas(self) -> np.ndarray:
        """Vectors (f, 3) along normals, as long as the area of triangles."""
        a, b, c = self.points[self.cells].transpose(1, 0, 2).astype(float)
        return 0.5 * np.cross(b - a, c - a)

    @property
    def volume(self) -> float:
        """Enclosed by triangles that look outwards."""
        return float(np.einsum("fc,fc->", self.points[self.cells[:, 0]], self.areas)) / 3.0

    def centres(self) -> np.ndarray:
        """Mean (x, 3) of the vertices that move with each point, in ascending order."""
        return np.stack([self.points[self.moved_by == k].mean(axis=0) for k in self.numbers()])

    def numbers(self) -> np.ndarray:
        return np.unique(self.moved_by)


def read(content: bytes) -> dict[str, Part]:
    """The bodies of a file, which is checked against the standard."""
    magic, version, size = struct.unpack_from("<4sII", content)
    assert (magic, version, size) == (b"glTF", 2, len(content))
    length, kind = struct.unpack_from("<I4s", content, 12)
    assert kind == b"JSON"
    assert length % 4 == 0
    known = json.loads(content[20 : 20 + length])
    rest, kind = struct.unpack_from("<I4s", content, 20 + length)
    assert kind == b"BIN\0"
    data = content[28 + length :]
    assert len(data) == rest == known["buffers"][0]["byteLength"]
    assert known["asset"]["version"] == "2.0"
    (root,) = known["scenes"][known["scene"]]["nodes"]
    top = known["nodes"][root]
    assert sorted([root, *top["children"]]) == list(range(len(known["nodes"])))

    def values(number: int) -> np.ndarray:
        one = known["accessors"][number]
        view = known["bufferViews"][one["bufferView"]]
        type_ = TYPES[one["componentType"]]
        width = {"VEC3": 3, "SCALAR": 1}[one["type"]]
        start = view["byteOffset"] + one["byteOffset"]
        assert start % 4 == 0 or (view["target"] == 34963 and start % type_.itemsize == 0)
        assert view["byteOffset"] + view["byteLength"] <= len(data)
        assert one["byteOffset"] + one["count"] * width * type_.itemsize <= view["byteLength"]
        assert view.get("byteStride", width * type_.itemsize) == width * type_.itemsize
        found = np.frombuffer(data, type_, one["count"] * width, start).reshape(-1, width)
        if "min" in one:
            assert_array_equal(found.min(axis=0), np.float32(one["min"]))
            assert_array_equal(found.max(axis=0), np.float32(one["max"]))
        return found

    parts = {}
    for node in (known["nodes"][k] for k in top["children"]):
        mesh = known["meshes"][node["mesh"]]
        assert mesh["name"] == node["name"]
        (one,) = mesh["primitives"]
        assert known["materials"][one["material"]]["doubleSided"]
        names = one["attributes"]
        assert "min" in known["accessors"][names["POSITION"]]
        points, moved_by = values(names["POSITION"]), values(names["_POINT"])[:, 0].astype(int)
        normals, cells = np.empty((0, 3)), np.empty((0, 3), int)
        if one["mode"] == 4:
            normals, cells = values(names["NORMAL"]), values(one["indices"]).reshape(-1, 3)
            assert cells.max() < len(points)
            assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-6)
        x, y, z, w = top.get("rotation", [0.0, 0.0, 0.0, 1.0])
        axis = np.array([x, y, z])
        across = np.cross(axis, points)
        seen = points + 2.0 * (w * across + np.cross(axis, across))
        parts[node["name"]] = Part(
            points, seen, moved_by, normals, cells, one["mode"], node["extras"]
        )
        # facets look where their vertices look
        if len(cells):
            sides = parts[node["name"]].areas
            assert np.linalg.norm(sides, axis=1).min() > 0.0
            assert np.einsum("fic,fc->fi", normals[cells], sides).min() > 0.0
    return parts


def written(body: Shown, count: int | None = None, planar: bool = False, first: int = 0) -> Part:
    count = len(body.reference) if count is None else count
    extras: Mapping[str, Any] = {"first": first, "points": count}
    return read(gltf.write({"one": gltf.make_mesh(body, count)}, {"one": extras}, planar))["one"]


def line(points: list[list[float]], radius: float) -> Shown:
    found = np.array(points)
    return frames.line(found[None], {}, radius, found)


def test_a_line_becomes_a_closed_tube() -> None:
    """Of the volume of its section; at a corner of 90 degrees and one of 60 it is mitred, so that
    the volume stays area times length.
    """
    r = 0.02
    for points, length in (
        ([[0, 0, 0], [1, 2, 2]], 3.0),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 2], [3, 1, 2]], 6.0),
        ([[0, 0, 1], [1, 0, 1], [1.5, 0.75**0.5, 1]], 2.0),
        ([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]], 2.0),
    ):
        one = written(line(points, r), first=7)
        assert one.volume == pytest.approx(POLYGON * r**2 * length, rel=1e-5)
        assert_array_equal(one.numbers(), np.arange(len(points)) + 7)
        assert_allclose(one.centres(), points, atol=1e-6)
        assert one.extras == {"first": 7, "points": len(points)}


def test_a_tube_is_round_and_its_ends_are_flat() -> None:
    """Ten sides 36 degrees apart are shaded as one, end faces apart: no vertex is there twice."""
    one = written(line([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 0.1))
    assert len(one.points) == 3 * gltf.SIDES + 2 * gltf.SIDES
    flat = np.abs(one.normals[:, 0]) > 0.5
    assert flat.sum() == 2 * gltf.SIDES
    assert_allclose(one.normals[~flat], one.points[~flat] * [0, 10, 10], atol=1e-6)


@pytest.mark.parametrize("aside", [0.0, 1e-12, 1e-3])
def test_a_line_that_folds_back_has_a_tube(aside: float) -> None:
    """Its mitre, which would reach to infinity, ends at two radii."""
    points = [[0.0, 0, 0], [1, 0, 0], [0, aside, 0], [0, 1, 0]]
    one = gltf.make_mesh(line(points, 0.01), 4)
    assert np.isfinite(one.points).all()
    assert np.isfinite(one.normals).all()
    assert 1.0 < one.points[:, 0].max() < 1.0201
    assert one.points[:, 0].min() > -0.0201


def test_a_closed_line_is_mitred_where_it_closes() -> None:
    r = 0.01
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]]
    one = written(line(square, r))
    assert one.volume == pytest.approx(POLYGON * r**2 * 4.0, rel=1e-5)
    assert one.points.min() == pytest.approx(-r, rel=0.06)


def test_a_line_without_a_section_stays_a_line() -> None:
    points = [[0, 0, 0], [3, 4, 0], [3, 4, 2]]
    one = written(line(points, 0.0))
    assert one.mode == gltf.LINE_STRIP
    assert_array_equal(one.points, np.float32(points))
    assert np.linalg.norm(np.diff(one.points, axis=0), axis=1).sum() == pytest.approx(7.0)
    assert written(line(points[1:2], 0.0)).mode == gltf.POINTS


def test_a_point_is_an_octahedron() -> None:
    one = written(line([[1, 2, 3]], 0.03))
    assert one.volume == pytest.approx(4.0 / 3.0 * 0.03**3, rel=1e-4)
    assert len(one.cells) == 8
    assert set(one.moved_by) == {0}


def test_facets_in_a_crease_are_shaded_apart() -> None:
    """Two quadrilaterals at 90 degrees have six vertices that are points, and two more."""
    points = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [1, 0, 1], [1, 1, 1]], float)
    cells = np.array([[0, 2, 3, 1], [2, 4, 5, 3]])
    folded = Shown(points[None], {}, np.full(6, 1e-3), points, cells)
    one = written(folded)
    assert len(one.points) == 8
    assert_allclose(np.linalg.norm(one.areas, axis=1).sum(), 2.0)
    slight = points.copy()
    slight[4:] = [[2, 0, 0.1], [2, 1, 0.1]]
    assert len(written(Shown(slight[None], {}, np.full(6, 1e-3), slight, cells)).points) == 6


def test_collapsed_facets_are_left_out() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0, 0]], float)
    cells = np.array([[0, 1, 2, 2], [1, 3, 1, 3]])
    one = written(Shown(points[None], {}, np.full(4, 1e-3), points, cells))
    assert len(one.cells) == 1


def test_z_is_up_in_space_and_y_in_the_plane() -> None:
    body = line([[1, 2, 3], [1, 2, 4]], 0.0)
    assert_allclose(written(body).seen, [[1, 3, -2], [1, 4, -2]], atol=1e-6)
    assert_allclose(written(body, planar=True).seen, [[1, 2, 3], [1, 2, 4]])


def test_many_vertices_have_longer_numbers() -> None:
    points = np.zeros((2**16 + 1, 3))
    points[-2:] = [[1, 0, 0], [0, 1, 0]]
    cells = np.array([[0, 2**16 - 1, 2**16]])
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    mesh = gltf.SkinMesh(points, np.zeros(len(points), np.int64), normals, cells)
    one = read(gltf.write({"one": mesh}, {"one": {"first": 0}}, False))["one"]
    assert_array_equal(one.cells, cells)


def test_vtk_reads_the_file(tmp_path: Path) -> None:
    """Positions in the axes of glTF, normals, and with which point a vertex moves."""
    pyvista = pytest.importorskip("pyvista")
    bodies = {"I": line([[0, 0, 0], [0, 0, 2]], 0.1), "<&> ü": line([[1, 0, 0], [1, 3, 0]], 0.1)}
    meshes = {name: gltf.make_mesh(one, 2) for name, one in bodies.items()}
    extras = {"I": {"first": 0}, "<&> ü": {"first": 2}}
    content = gltf.write(meshes, extras, False)
    (tmp_path / "two.glb").write_bytes(content)
    own = read(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [*pyvista.read(tmp_path / "two.glb").recursive_iterator()]
    assert len(found) == 2
    for one, known in zip(found, own.values(), strict=True):
        assert_allclose(one.points, known.seen, atol=1e-6)
        assert_array_equal(one.point_data["_POINT"], known.moved_by)
        assert_array_equal(one.faces.reshape(-1, 4)[:, 1:], known.cells)
        assert one.volume == pytest.approx(known.volume, rel=1e-4)
