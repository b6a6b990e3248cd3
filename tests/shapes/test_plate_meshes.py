"""Plate mesh files: the ones delivered, the formats, scikit-fem, and everything that can be wrong
with a plate.
"""

from __future__ import annotations

import importlib.util
import runpy
import struct
import tracemalloc
import warnings
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import skfem
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import ancf_plate, fvs_plate, groups, plate_audit, plate_meshes, surface
from fmbs_skfem.shapes.plate_meshes import PlateMesh

FOLDER = Path(__file__).parents[2] / "meshes"
SCRIPT = runpy.run_path(str(FOLDER / "build_plates.py"))
LINES = runpy.run_path(str(FOLDER / "build.py"))["everything"]()
FILES = sorted(
    path
    for path in FOLDER.iterdir()
    if path.suffix in (".msh", ".vtu") and path.name not in (*LINES, "con_rod_solid.msh")
)

#: name -> cells, nodes, rim and end: (group, centre, radius, sides)
LINKS = {
    "plate_crank_coarse.msh": (
        192,
        237,
        [("A", 0.0, 0.015, 24), ("outer_A", 0.0, 0.04, 10), ("outer_B", 0.1, 0.035, 10)],
    ),
    "plate_crank_coarse.vtu": (192, 237, [("B", 0.1, 0.01, 24)]),
    "plate_crank_fine.msh": (
        1920,
        2053,
        [("A", 0.0, 0.015, 72), ("B", 0.1, 0.01, 72), ("outer_B", 0.1, 0.035, 32)],
    ),
    "plate_linkage_coarse.msh": (
        288,
        345,
        [("B", 0.0, 0.01, 24), ("outer_B", 0.0, 0.035, 10), ("outer_C", 0.2, 0.035, 10)],
    ),
    "plate_linkage_fine.msh": (
        3168,
        3353,
        [("B", 0.0, 0.01, 72), ("C", 0.2, 0.01, 72), ("outer_C", 0.2, 0.035, 32)],
    ),
    "lug_quad.msh": (
        370,
        417,
        [
            ("A", 0.0, 0.015, 16),
            ("B", 0.1, 0.01, 16),
            ("outer_A", 0.0, 0.04, 20),
            ("outer_B", 0.1, 0.035, 16),
        ],
    ),
    "lug_tri.msh": (
        740,
        416,
        [
            ("A", 0.0, 0.015, 16),
            ("B", 0.1, 0.01, 16),
            ("outer_A", 0.0, 0.04, 18),
            ("outer_B", 0.1, 0.035, 16),
        ],
    ),
}
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
#: with cells 1 2 3 4 and 2 5 6 3 of the file: two squares side by side
STRIP = [
    *SQUARE,
    (2, 0),
    (2, 1),
]


def text_22(points: list[tuple[float, ...]], cells: list[str], names: str = "") -> str:
    """A gmsh 2.2 text file; cells are rows without their number: code tags ... nodes."""
    nodes = "\n".join(
        f"{i} {' '.join(str(x) for x in (*p, 0)[:3])}" for i, p in enumerate(points, 1)
    )
    rows = "\n".join(f"{i} {cell}" for i, cell in enumerate(cells, 1))
    counts = f"$Nodes\n{len(points)}\n{nodes}\n$EndNodes\n$Elements\n{len(cells)}\n{rows}\n$EndElements\n"
    return f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}{counts}"


def quads(*cells: tuple[int, ...], tag: int = 7) -> list[str]:
    return [f"3 2 {tag} {tag} {' '.join(map(str, cell))}" for cell in cells]


def triangles(*cells: tuple[int, ...], tag: int = 7) -> list[str]:
    return [f"2 2 {tag} {tag} {' '.join(map(str, cell))}" for cell in cells]


def saved(tmp_path: Path, content: str | bytes, name: str = "a.msh") -> Path:
    file = tmp_path / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return file


def areas(mesh: PlateMesh) -> np.ndarray:
    """Areas (e,) [m^2] of the cells: half the length of the sum of x_i x x_{i+1} about the first
    vertex.
    """
    x = mesh.points[mesh.cells] - mesh.points[mesh.cells[:, :1]]
    return np.asarray(0.5 * np.linalg.norm(np.cross(x[:, 1:-1], x[:, 2:]).sum(axis=1), axis=1))


def refused(file: Path, *words: str, planar: bool = True) -> None:
    """The file is refused with exit code 3, and the message holds its name and the words."""
    with pytest.raises(InputError) as caught:
        plate_meshes.read(file, planar)
    assert caught.value.exit_code == 3
    for word in (file.name, *words):
        assert word in str(caught.value), f"{word!r} not in {caught.value}"


def same(a: PlateMesh, b: PlateMesh) -> None:
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.cells, b.cells)
    for of in ("point_groups", "face_groups"):
        one, two = getattr(a, of), getattr(b, of)
        assert {k: v.tolist() for k, v in one.items()} == {k: v.tolist() for k, v in two.items()}
    one, two = a.edge_groups, b.edge_groups
    assert {k: set(map(tuple, v.tolist())) for k, v in one.items()} == {
        k: set(map(tuple, v.tolist())) for k, v in two.items()
    }


# The files of the project


def test_the_script_builds_the_files_in_the_folder(tmp_path: Path) -> None:
    built = SCRIPT["main"](tmp_path)
    missing = (
        {FOLDER / "lug_quad.msh", FOLDER / "lug_tri.msh"}
        if importlib.util.find_spec("gmsh") is None
        else set()
    )
    assert sorted(path.name for path in built) == [
        path.name for path in FILES if path not in missing
    ]
    for path in built:
        again, kept = (
            plate_meshes.read(path, planar=True),
            plate_meshes.read(FOLDER / path.name, planar=True),
        )
        np.testing.assert_allclose(
            again.points, kept.points, rtol=0, atol=1e-15 if "plate" in path.name else 1e-9
        )
        same(replace(again, points=kept.points), kept)  # processors round cosines otherwise
        assert path.stat().st_size < 300_000


@pytest.mark.parametrize("name", LINKS)
def test_links(name: str) -> None:
    cells, nodes, circles = LINKS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        mesh = plate_meshes.read(FOLDER / name, planar=True)
    assert (len(mesh.cells), len(mesh.points)) == (cells, nodes)
    assert mesh.path == FOLDER / name
    assert plate_meshes.group(mesh, "plate", "face").tolist() == list(range(cells))
    for group, centre, radius, sides in circles:
        pairs = plate_meshes.group(mesh, group, "edge")
        assert len(pairs) == sides
        np.testing.assert_allclose(
            np.hypot(*(mesh.points[pairs, :2] - [centre, 0.0]).T), radius, rtol=0, atol=1e-12
        )
    rims = {
        tuple(pair)
        for key in mesh.edge_groups
        if "outer" not in key
        for pair in mesh.edge_groups[key].tolist()
    }
    outer = {tuple(pair) for pair in mesh.edge_groups["outer"].tolist()}
    assert not rims & outer
    assert rims | outer == {
        tuple(pair) for pair in plate_audit.border(mesh.cells, len(mesh.points))[0].tolist()
    }
    assert plate_audit.corner_sines(mesh.points, mesh.cells)[0].min() > 0.62


@pytest.mark.parametrize("name", LINKS)
def test_areas_of_links(name: str) -> None:
    """The polygon of a mesh lacks the segments of its outer arcs and has those of its holes: R^2
    (alpha - sin alpha) / 2 a side.
    """
    mesh = plate_meshes.read(FOLDER / name, planar=True)
    shape = SCRIPT["LINKAGE"] if "linkage" in name else SCRIPT["CRANK"]
    missing = 0.0
    for end in shape.ends:
        for group, radius, sign in (
            (f"outer_{end.name}", end.outer, 1.0),
            (end.name, end.hole, -1.0),
        ):
            start, stop = (mesh.points[mesh.edge_groups[group][:, i]] for i in (0, 1))
            angle = 2 * np.arcsin(np.linalg.norm(stop - start, axis=1) / (2 * radius))
            missing += sign * 0.5 * radius**2 * (angle - np.sin(angle)).sum()
    assert areas(mesh).sum() + missing == pytest.approx(shape.area(), rel=1e-12)


def test_area_of_the_linkage() -> None:
    """The linkage: two half discs, a rectangle 0.2 by 0.07, two holes."""
    assert SCRIPT["LINKAGE"].area() == pytest.approx(
        np.pi * 0.035**2 + 0.2 * 0.07 - 2 * np.pi * 0.01**2, rel=1e-14
    )


@pytest.mark.parametrize("name", [name for name in LINKS if "plate" in name])
def test_structured_links_are_symmetric_to_the_bit(name: str) -> None:
    points = plate_meshes.read(FOLDER / name, planar=True).points
    assert {tuple(p) for p in points.tolist()} == {(x, -y, z) for x, y, z in points.tolist()}


def test_twins_agree() -> None:
    same(
        *(
            plate_meshes.read(FOLDER / f"plate_crank_coarse.{suffix}", planar=True)
            for suffix in ("msh", "vtu")
        )
    )


@pytest.mark.parametrize(
    "name,length,width,cells", [("plate_16x1.msh", 10.0, 1.0, 16), ("plate_8x8.msh", 1.0, 1.0, 64)]
)
def test_rectangles(name: str, length: float, width: float, cells: int) -> None:
    mesh = plate_meshes.read(FOLDER / name, planar=True)
    assert len(mesh.cells) == cells
    np.testing.assert_allclose(
        plate_audit.corner_sines(mesh.points, mesh.cells)[0], 1.0, rtol=1e-14
    )
    np.testing.assert_allclose(areas(mesh), length * width / cells, rtol=1e-13)
    for group, axis, at in (
        ("left", 0, 0.0),
        ("right", 0, length),
        ("bottom", 1, 0.0),
        ("top", 1, width),
    ):
        assert np.all(mesh.points[mesh.edge_groups[group], axis] == at)
    corners = [
        mesh.points[plate_meshes.group(mesh, name, "point")[0], :2].tolist() for name in "abcd"
    ]
    assert corners == [[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]]


def test_sides_of_cells() -> None:
    mesh = plate_meshes.read(FOLDER / "plate_crank_coarse.msh", planar=True)
    pairs = mesh.edge_groups["A"]
    _, edges, _ = groups.check_groups(
        mesh.cells, None, {"A": pairs, "turned": pairs[:, ::-1]}, None
    )
    cell, side = edges["A"].T
    np.testing.assert_array_equal(mesh.cells[cell, side], pairs[:, 0])
    np.testing.assert_array_equal(mesh.cells[cell, (side + 1) % 4], pairs[:, 1])
    np.testing.assert_array_equal(edges["turned"], edges["A"])
    start, stop = mesh.points[pairs[:, 0]], mesh.points[pairs[:, 1]]
    assert np.all(np.cross(start, stop)[:, 2] < 0)  # around a hole the border runs clockwise


# Formats


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
@pytest.mark.parametrize("name", ["lug_tri.msh", "plate_8x8.msh"])
def test_write_then_read(tmp_path: Path, suffix: str, name: str) -> None:
    mesh = plate_meshes.read(FOLDER / name, planar=True)
    faces = {"plate": np.arange(len(mesh.cells)), "some": np.array([1, 5])}
    mesh = replace(mesh, face_groups=faces, point_groups={"a b": np.array([3, 8])})
    plate_meshes.write(mesh, tmp_path / f"a{suffix}")
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        same(mesh, plate_meshes.read(tmp_path / f"a{suffix}", planar=True))


def test_faces_of_no_group_are_written_too(tmp_path: Path) -> None:
    mesh = replace(
        plate_meshes.read(FOLDER / "plate_8x8.msh", planar=True),
        face_groups={"first": np.array([0, 1, 2])},
    )
    plate_meshes.write(mesh, tmp_path / "a.msh")
    same(mesh, plate_meshes.read(tmp_path / "a.msh", planar=True))


def test_write_refuses_what_cannot_be_read_back(tmp_path: Path) -> None:
    mesh = plate_meshes.read(FOLDER / "plate_8x8.msh", planar=True)
    with pytest.raises(InputError, match=r"\.msh or \.vtu"):
        plate_meshes.write(mesh, tmp_path / "a.obj")
    with pytest.raises(
        InputError, match=r"different names for point, edge and face groups, got \['left'\]"
    ):
        plate_meshes.write(replace(mesh, point_groups={"left": np.array([0])}), tmp_path / "a.vtu")
    with pytest.raises(InputError, match="group names without quotes"):
        plate_meshes.write(replace(mesh, point_groups={'a"b': np.array([0])}), tmp_path / "a.msh")
    with pytest.raises(InputError, match="can be written"):
        plate_meshes.write(mesh, tmp_path / "nowhere" / "a.msh")


def test_meshio_reads_the_same() -> None:
    theirs, ours = (
        meshio.read(FOLDER / "lug_tri.msh"),
        plate_meshes.read(FOLDER / "lug_tri.msh", planar=True),
    )
    np.testing.assert_array_equal(theirs.points, ours.points)
    np.testing.assert_array_equal(theirs.cells_dict["triangle"], ours.cells)


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_files_of_gmsh(tmp_path: Path, version: float, binary: int) -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        SCRIPT["outline"](SCRIPT["CRANK"], 0.01)
        gmsh.model.addPhysicalGroup(0, [2], name="contact")
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(tmp_path / "a.msh"))
        kinds, _, nodes = gmsh.model.mesh.getElements(2)
    finally:
        gmsh.finalize()
    mesh = plate_meshes.read(tmp_path / "a.msh", planar=True)
    assert mesh.cells.shape == (len(nodes[0]) // 3, 3)
    assert kinds.tolist() == [2]
    assert sorted(mesh.edge_groups) == ["A", "B", "outer", "outer_A", "outer_B"]
    sides, _ = plate_audit.border(mesh.cells, len(mesh.points))
    assert len(sides) == sum(len(mesh.edge_groups[name]) for name in ("A", "B", "outer"))
    phi = SCRIPT["CRANK"].contact
    contact = mesh.points[plate_meshes.group(mesh, "contact", "point")]
    np.testing.assert_allclose(contact, [[0.04 * np.cos(phi), 0.04 * np.sin(phi), 0.0]], atol=1e-12)


def test_text_22_with_tagged_groups(tmp_path: Path) -> None:
    cells = [
        *quads((1, 2, 3, 4), (2, 5, 6, 3)),
        *quads((2, 5, 6, 3), tag=9),
        "1 2 4 4 4 1",
        "15 2 5 5 6",
        "1 2 0 0 1 3",
    ]
    mesh = plate_meshes.read(saved(tmp_path, text_22(STRIP, cells)), planar=True)
    np.testing.assert_array_equal(mesh.cells, [[0, 1, 2, 3], [1, 4, 5, 2]])
    assert {name: ids.tolist() for name, ids in mesh.face_groups.items()} == {
        "tag_7": [0, 1],
        "tag_9": [1],
    }
    assert {name: ids.tolist() for name, ids in mesh.edge_groups.items()} == {"tag_4": [[3, 0]]}
    assert {name: ids.tolist() for name, ids in mesh.point_groups.items()} == {"tag_5": [5]}


def test_two_bodies_in_one_file_at_the_same_place(tmp_path: Path) -> None:
    cells = [
        *quads((1, 2, 3, 4), tag=1),
        *quads((5, 6, 7, 8), tag=2),
        "1 2 3 3 1 2",
        "1 2 4 4 5 6",
        "15 2 5 5 5",
    ]
    file = saved(tmp_path, text_22(SQUARE + SQUARE, cells))
    refused(
        file,
        "one node a place",
        "node 1 at (0, 0, 0), node 5 at (0, 0, 0), node 4 at (0, 1, 0) and 5 more",
    )
    mesh = plate_meshes.read(file, planar=True, face="tag_2")
    assert len(mesh.points) == 4
    assert list(mesh.face_groups) == ["tag_2"]
    assert {name: ids.tolist() for name, ids in mesh.edge_groups.items()} == {"tag_4": [[0, 1]]}
    assert {name: ids.tolist() for name, ids in mesh.point_groups.items()} == {"tag_5": [0]}
    with pytest.raises(InputError, match="got 'tag_3'; face groups present: tag_1, tag_2"):
        plate_meshes.read(file, planar=True, face="tag_3")


# scikit-fem


@pytest.mark.parametrize("name", ["lug_tri.msh", "plate_crank_coarse.msh"])
def test_through_scikit_fem_and_back(name: str) -> None:
    mesh = plate_meshes.read(FOLDER / name, planar=True)
    there = plate_meshes.to_skfem(mesh)
    assert there.boundaries.keys() == mesh.edge_groups.keys()
    back = plate_meshes.from_skfem(there)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(np.sort(back.cells), np.sort(mesh.cells))
    same(replace(back, cells=mesh.cells), mesh)
    basis = skfem.Basis(there, skfem.ElementTriP1() if "tri" in name else skfem.ElementQuad1())
    assert basis.dx.sum() == pytest.approx(areas(mesh).sum(), rel=1e-13)


def test_scikit_fem_meshes_that_are_no_plates() -> None:
    with pytest.raises(
        InputError, match="planar MeshQuad or MeshTri of first order, got a MeshTet1"
    ):
        plate_meshes.from_skfem(skfem.MeshTet())
    points = np.array([[0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
    with pytest.raises(InputError, match=r"sides do not cross, got cell 0 at \(0.5, 0.5, 0\)"):
        plate_meshes.from_skfem(skfem.MeshQuad(points, np.array([[0, 1, 3, 2]]).T))
    points[0, 0] = np.nan
    with pytest.raises(InputError, match="finite coordinates, got node 0"):
        plate_meshes.from_skfem(skfem.MeshQuad(points, np.array([[0, 1, 2, 3]]).T))
    dome = plate_meshes.read(FOLDER / "plate_8x8.msh", planar=True)
    with pytest.raises(InputError, match="a plane mesh for scikit-fem, got z from 0 to 1"):
        plate_meshes.to_skfem(replace(dome, points=dome.points[:, [0, 1, 0]]))


def test_meshes_made_in_memory() -> None:
    mesh = PlateMesh(
        np.array([(*p, 0.0) for p in SQUARE]),
        np.array([[0, 1, 2, 3]]),
        edge_groups={"low": np.array([[1, 0]])},
    )
    assert plate_meshes.audit(mesh, planar=True).edge_groups["low"].tolist() == [[0, 1]]
    with pytest.raises(
        InputError, match=r"cells on the nodes 0 to 3 of the file, got node 4 in cell 0"
    ):
        plate_meshes.audit(replace(mesh, cells=np.array([[0, 1, 2, 4]])), planar=True)
    with pytest.raises(
        InputError,
        match=r"points \(n, 3\) and cells \(e, 3\) or \(e, 4\), got points \(4, 3\), cells \(1, 2\)",
    ):
        plate_meshes.audit(replace(mesh, cells=np.array([[0, 1]])), planar=True)


# Broken files


@pytest.mark.parametrize("name", ["a.msh", "a.vtu"])
def test_files_that_are_no_mesh(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    refused(saved(tmp_path, b"", name), "an empty file")
    refused(saved(tmp_path, np.random.default_rng(1).bytes(4096), name))
    refused(saved(tmp_path, "hello\nworld\n", name))
    refused(tmp_path / "missing.msh", "no such file")
    assert capfd.readouterr() == ("", "")


def test_no_points_no_cells_no_faces(tmp_path: Path) -> None:
    refused(saved(tmp_path, text_22([], [])), "expected points")
    refused(saved(tmp_path, text_22(SQUARE, [])), "quad or triangle, got no cells at all")
    refused(FOLDER / "beam_5.msh", "quad or triangle, got 5 line, 2 vertex")
    second_order = "9 2 0 0 1 2 3 4 5 6"
    refused(saved(tmp_path, text_22(STRIP, [second_order])), "1 triangle6", "first order")


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_points_that_are_none(tmp_path: Path, value: str) -> None:
    content = text_22(SQUARE, quads((1, 2, 3, 4))).replace("3 1 1 0\n", f"3 1 {value} 0\n")
    refused(saved(tmp_path, content), "finite coordinates", f"node 3 at (1, {value}, 0)")


def test_huge_coordinates(tmp_path: Path) -> None:
    refused(
        saved(tmp_path, text_22([(0, 0), (1e300, 0), (1e300, 1e300), (0, 1)], quads((1, 2, 3, 4)))),
        "an extent of 1e+300",
    )


def test_indices_out_of_range(tmp_path: Path) -> None:
    refused(
        saved(tmp_path, text_22(SQUARE, quads((1, 2, 3, 9)))),
        "cells on the nodes 1 to 4",
        "node 9 in cell 1",
    )
    refused(
        saved(tmp_path, text_22(SQUARE, [*quads((1, 2, 3, 4)), "1 2 3 3 1 8"])),
        "lines on the nodes 1 to 4",
        "node 8 in cell 2",
    )
    content = (FOLDER / "plate_crank_coarse.vtu").read_text()
    refused(
        saved(tmp_path, content.replace('NumberOfPoints="237"', 'NumberOfPoints="236"'), "a.vtu"),
        "Points of 708 numbers",
    )


#: words of the message, points, cells
WRONG = {
    "repeated vertex": (
        ["different vertices", "cell 1 with nodes [1, 2, 3, 3]"],
        SQUARE,
        quads((1, 2, 3, 3)),
    ),
    "repeated cell": (
        ["each cell once", "cell 1 at (0.5, 0.5, 0)"],
        SQUARE,
        quads((1, 2, 3, 4), (2, 3, 4, 1)),
    ),
    "zero side": (
        ["longer than zero", "cell 1 at (0.5, 0.25, 0)"],
        [(0, 0), (1, 0), (1, 1), (0, 0)],
        quads((1, 2, 3, 4)),
    ),
    "zero area": (
        ["with an area", "cell 1 at (1.5, 1.5, 0)"],
        [(i, i) for i in range(4)],
        quads((1, 2, 3, 4)),
    ),
    "flat triangle": (
        ["with an area", "cell 1 at (1, 0, 0)"],
        [(0, 0), (1, 0), (2, 0)],
        triangles((1, 2, 3)),
    ),
    "bow-tie": (
        ["do not cross", "cell 2 at (1.5, 0.5, 0)", "bow-tie"],
        STRIP,
        quads((1, 2, 3, 4), (2, 5, 3, 6)),
    ),
    "symmetric bow-tie": (["do not cross", "cell 1"], SQUARE, quads((1, 3, 2, 4))),
    "concave": (
        ["below 180", "cell 1 at (0.8, 0.55, 0)"],
        [(0, 0), (2, 0), (0.2, 0.2), (1, 2)],
        quads((1, 2, 3, 4)),
    ),
    "180 degrees": (["below 180", "cell 1"], [(0, 0), (1, 0), (2, 0), (0, 1)], quads((1, 2, 3, 4))),
    "one clockwise": (
        ["turn the same way", "1 of 2 clockwise: cell 2 at (1.5, 0.5, 0)"],
        STRIP,
        quads((1, 2, 3, 4), (2, 3, 6, 5)),
    ),
    "mixed": (
        ["all quads or all triangles", "1 quads and 1 triangles", "cells [1]"],
        STRIP,
        [*triangles((2, 5, 6)), *quads((1, 2, 3, 4))],
    ),
    "hanging node": (
        ["side to side", "node 8 at (1, 0.5, 0) inside a side of cell 1 at (0.5, 0.5, 0)", "split"],
        [*STRIP, (2, 0.5), (1, 0.5)],
        quads((1, 2, 3, 4), (2, 5, 7, 8), (8, 7, 6, 3)),
    ),
    "three cells at a side": (
        [
            "at most two cells",
            "3 cells at the side between node 2 at (1, 0, 0) and node 3 at (1, 1, 0)",
            "cell 3 at",
        ],
        [*STRIP, (1.5, 0.2), (1.5, 0.8)],
        quads((1, 2, 3, 4), (2, 5, 6, 3), (2, 7, 8, 3)),
    ),
    "overlap": (
        [
            "neighbours that turn the same way",
            "cell 1 at (0.5, 0.5, 0), cell 2 at (0.4, 0.5, 0)",
            "overlap",
        ],
        [*SQUARE, (0.8, 0.2), (0.8, 0.8)],
        quads((1, 2, 3, 4), (1, 5, 6, 4)),
    ),
    "doubled nodes": (
        [
            "one node a place",
            "node 2 at (1, 0, 0), node 5 at (1, 0, 0), node 3 at (1, 1, 0) and 1 more",
            "merge",
        ],
        [*SQUARE, (1, 0), (2, 0), (2, 1), (1, 1)],
        quads((1, 2, 3, 4), (5, 6, 7, 8)),
    ),
    "nearly doubled nodes": (
        ["one node a place", "node 2 at", "node 5 at"],
        [(0, 0), (1 + 0.4999e-9, 0), (1, 1), (0, 1), (1 + 1.6e-9, 0), (2, 0), (2, 1), (1.1, 1)],
        quads((1, 2, 3, 4), (5, 6, 7, 8)),
    ),
    "parts": (
        [
            "one piece",
            "2 parts: 1 cells from cell 1 at (0.5, 0.5, 0), 1 cells from cell 2 at (3.5, 0.5, 0)",
            "face group",
        ],
        [*SQUARE, (3, 0), (4, 0), (4, 1), (3, 1)],
        quads((1, 2, 3, 4), (5, 6, 7, 8)),
    ),
    "hinge": (
        ["hang together by sides", "parts that touch only at node 3 at (1, 1, 0)"],
        [*SQUARE, (2, 1), (2, 2), (1, 2)],
        quads((1, 2, 3, 4), (3, 5, 6, 7)),
    ),
    "stray line": (
        ["edge groups on sides", "line 2 from node 1 at (0, 0, 0) to node 3 at (1, 1, 0)"],
        SQUARE,
        [*quads((1, 2, 3, 4)), "1 2 3 3 1 3"],
    ),
    "doubled node number": (
        ["one point a node number", "node 2 at (1, 0, 0), node 2 at (1, 1, 0)"],
        SQUARE,
        quads((1, 2, 3, 4)),
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, case: str) -> None:
    words, points, cells = WRONG[case]
    content = text_22(points, cells)
    if case == "doubled node number":
        content = content.replace("3 1 1 0\n", "2 1 1 0\n")
    refused(saved(tmp_path, content), *words)


def test_bodies_that_are_not_flat(tmp_path: Path) -> None:
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0.2), (0, 1, 0)]
    file = saved(tmp_path, text_22(points, quads((1, 2, 3, 4))))
    refused(file, "z = constant for a planar body", "node 3 at (1, 1, 0.2)", "type: shell")
    assert plate_meshes.read(file, planar=False).points[2, 2] == 0.2
    upright = [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)]
    file = saved(tmp_path, text_22(upright, quads((1, 2, 3, 4))))
    refused(file, "z = constant")
    assert len(plate_meshes.read(file, planar=False).cells) == 1
    high = saved(tmp_path, text_22([(*p, 2.5) for p in SQUARE], quads((1, 2, 3, 4))))
    assert plate_meshes.read(high, planar=True).points[0, 2] == 2.5


def test_shells_turn_one_way(tmp_path: Path) -> None:
    """A closed tube of four squares; a Moebius strip of the same cells is refused."""
    ring = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]
    points = [*ring, *((x, y, 1) for x, y, _ in ring)]
    tube = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7)]
    assert (
        len(
            plate_meshes.read(
                saved(tmp_path, text_22(points, quads(*tube, (4, 1, 5, 8)))), planar=False
            ).cells
        )
        == 4
    )
    reversed_cell = saved(tmp_path, text_22(points, quads(*tube, (4, 8, 5, 1))))
    refused(reversed_cell, "neighbours that turn the same way", "cell 4 at", planar=False)
    twisted = saved(tmp_path, text_22(points, quads(*tube, (4, 5, 1, 8))))
    refused(twisted, planar=False)


# What is turned or dropped with a notice


def test_clockwise_plates_are_turned(tmp_path: Path) -> None:
    cells = [*quads((1, 4, 3, 2), (2, 3, 6, 5)), "1 2 3 3 1 2"]
    mesh = plate_meshes.read(saved(tmp_path, text_22(STRIP, cells)), planar=True)
    assert mesh.cells.tolist() == [[0, 1, 2, 3], [1, 4, 5, 2]]
    assert mesh.edge_groups["tag_3"].tolist() == [[0, 1]]


def test_points_and_cells_that_are_dropped(tmp_path: Path) -> None:
    names = '$PhysicalNames\n2\n1 9 "never"\n2 8 "nowhere"\n$EndPhysicalNames\n'
    cells = [*quads((2, 5, 6, 3)), "4 2 0 0 1 2 3 4", "15 2 5 5 1"]
    with pytest.warns(Notice) as caught:
        mesh = plate_meshes.read(saved(tmp_path, text_22(STRIP, cells, names)), planar=True)
    text = "\n".join(str(w.message) for w in caught)
    assert "1 tetra cells ignored" in text
    for name in ("never", "nowhere", "tag_5"):
        assert f"group '{name}' is named but has no members" in text
    assert mesh.cells.tolist() == [[0, 2, 3, 1]]
    assert (mesh.point_groups, mesh.edge_groups, list(mesh.face_groups)) == ({}, {}, ["tag_7"])


# Groups


def test_missing_groups_list_those_present() -> None:
    mesh = plate_meshes.read(FOLDER / "plate_crank_coarse.msh", planar=True)
    with pytest.raises(
        InputError,
        match=r"got 'outer_C'; edge groups present: A, B, outer, outer_A, outer_B; did you mean 'outer_",
    ):
        plate_meshes.group(mesh, "outer_C", "edge")
    with pytest.raises(
        InputError,
        match="a point group, got 'A', which is an edge group; point groups present: none",
    ):
        plate_meshes.group(mesh, "A", "point")
    with pytest.raises(InputError, match=r"plate_crank_coarse.msh.*did you mean 'plate'\?"):
        plate_meshes.group(mesh, "plat", "face")


# Damaged files


def test_claims_that_the_file_cannot_hold(tmp_path: Path) -> None:
    head = (
        b"$MeshFormat\n2.2 1 8\n"
        + struct.pack("<i", 1)
        + b"\n$EndMeshFormat\n$Nodes\n%d\n\n$EndNodes\n$Elements\n%d\n$EndElements\n"
    )
    tracemalloc.start()
    refused(saved(tmp_path, head % (10**9, 0)))
    refused(saved(tmp_path, head % (0, 10**6)))
    vtu = (FOLDER / "plate_crank_coarse.vtu").read_text()
    refused(
        saved(
            tmp_path, vtu.replace('NumberOfPoints="237"', 'NumberOfPoints="999999999999"'), "a.vtu"
        ),
        "NumberOfPoints",
    )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


@pytest.mark.parametrize("name", ["plate_16x1.msh", "plate_crank_coarse.vtu", "text"])
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_give_a_plate_or_an_input_error(
    tmp_path: Path, name: str, data: st.DataObject
) -> None:
    text = text_22(STRIP, [*quads((1, 2, 3, 4), (2, 5, 6, 3)), "1 2 4 4 4 1", "15 2 5 5 6"])
    content = bytearray(text.encode() if name == "text" else (FOLDER / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file = saved(tmp_path, bytes(content), f"a{Path(name).suffix or '.msh'}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            mesh = plate_meshes.read(file, planar=True)
        except InputError:
            return
    assert np.isfinite(mesh.points).all()
    assert set(np.unique(mesh.cells)) == set(range(len(mesh.points)))
    assert plate_audit.corner_sines(mesh.points, mesh.cells)[0].min() > 0


def test_a_large_mesh_passes() -> None:
    mesh = plate_meshes.from_skfem(
        skfem.MeshQuad.init_tensor(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    )
    assert len(mesh.cells) == 40_000
    assert np.all(plate_audit.corner_sines(mesh.points, mesh.cells)[1] == [0, 0, 1])


# halving


@pytest.mark.parametrize("name", ["lug_tri.msh", "lug_quad.msh", "plate_crank_coarse.msh"])
def test_halved_meshes_keep_groups_and_arcs(name: str) -> None:
    """Holes stay round: the area of curved cells falls to the exact one by the fourth order."""
    mesh = plate_meshes.read(FOLDER / name, planar=True)
    found = [mesh]
    for _ in range(2):
        arcs = ancf_plate.arcs_of(found[-1].points[:, :2], found[-1].edge_groups)
        found.append(plate_meshes.halve(found[-1], arcs))
    assert [len(one.cells) for one in found] == [4**k * len(mesh.cells) for k in range(3)]
    np.testing.assert_array_equal(found[1].points[: len(mesh.points)], mesh.points)
    for group, edges in mesh.edge_groups.items():
        assert len(found[2].edge_groups[group]) == 4 * len(edges)
    np.testing.assert_array_equal(found[1].face_groups["plate"], np.arange(4 * len(mesh.cells)))
    areas = []
    for one in found:
        arcs = ancf_plate.arcs_of(one.points[:, :2], one.edge_groups)
        shape = fvs_plate.surface(one.points[:, :2], one.cells, arcs)
        table = surface.tabulate(shape)
        tangents = np.einsum(
            "epab,ebc->epac", table.values[:, :, 1:3], shape.reference[table.nodes]
        )
        areas.append(float((np.linalg.det(tangents) * table.weights).sum()))
    assert np.log2((areas[1] - areas[0]) / (areas[2] - areas[1])) > 3.7


def test_halved_meshes_keep_points() -> None:
    mesh = plate_meshes.read(FOLDER / "plate_8x8.msh", planar=True)
    fine = plate_meshes.halve(mesh)
    assert fine.point_groups.keys() == {"a", "b", "c", "d"}
    for name, ids in mesh.point_groups.items():
        np.testing.assert_array_equal(fine.points[fine.point_groups[name]], mesh.points[ids])
