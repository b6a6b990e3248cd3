"""Mesh files: the ones delivered, the formats, and everything that can be wrong with a file."""

from __future__ import annotations

import base64
import runpy
import struct
import tracemalloc
import warnings
import zlib
from pathlib import Path

import meshio
import numpy as np
import pytest
import skfem
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import meshes, msh

FOLDER = Path(__file__).parents[2] / "meshes"
FILES = sorted(FOLDER / name for name in runpy.run_path(str(FOLDER / "build.py"))["everything"]())

SQUARE_ENDS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0)]

TEXT_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
0 1 "left end"
1 2 "beam"
$EndPhysicalNames
$Entities
1 2 0 0
1 0 0 0 1 1
1 0 0 0 1 0 0 2 2 7 0
2 1 0 0 1 2 0 1 -2 0
$EndEntities
$Nodes
2 4 10 40
0 1 0 1
10
0 0 0
1 1 0 3
40
20
30
3 0 0
1 0 0
2 0 0
$EndNodes
$Elements
3 4 1 4
0 1 15 1
1 10
1 1 1 2
2 10 20
3 20 30
1 2 1 1
4 30 40
$EndElements
"""


def text_22(points: list[tuple[float, ...]], cells: list[str], names: str = "") -> str:
    """A gmsh 2.2 text file; cells are rows without their number: code tags ... nodes."""
    nodes = "\n".join(f"{i} {' '.join(str(x) for x in p)}" for i, p in enumerate(points, 1))
    rows = "\n".join(f"{i} {cell}" for i, cell in enumerate(cells, 1))
    counts = f"$Nodes\n{len(points)}\n{nodes}\n$EndNodes\n$Elements\n{len(cells)}\n{rows}\n$EndElements\n"
    return f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}{counts}"


def lines(*pairs: tuple[int, int], tag: int = 0) -> list[str]:
    return [f"1 2 {tag} {tag} {a} {b}" for a, b in pairs]


def saved(tmp_path: Path, content: str | bytes, name: str = "a.msh") -> Path:
    file = tmp_path / name
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    return file


def binary_22(nodes: int, cells: int, points: bytes = b"", elements: bytes = b"") -> bytes:
    head = b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n"
    body = b"$Nodes\n%d\n" % nodes + points + b"\n$EndNodes\n$Elements\n%d\n" % cells + elements
    return head + body + b"\n$EndElements\n"


def refused(file: Path, *words: str) -> None:
    """The file is refused with exit code 3, and the message holds its name and the words."""
    with pytest.raises(InputError) as caught:
        meshes.read(file)
    assert caught.value.exit_code == 3
    for word in (file.name, *words):
        assert word in str(caught.value), f"{word!r} not in {caught.value}"


def same(a: meshes.LineMesh, b: meshes.LineMesh) -> None:
    """Same points, cells as node pairs, and groups as sets of nodes or node pairs."""

    def pairs(mesh: meshes.LineMesh, ids: np.ndarray) -> set[tuple[int, ...]]:
        return {tuple(int(n) for n in sorted(cell)) for cell in mesh.cells[ids]}

    np.testing.assert_array_equal(a.points, b.points)
    assert len(a.cells) == len(b.cells)
    assert pairs(a, np.arange(len(a.cells))) == pairs(b, np.arange(len(b.cells)))
    assert {k: set(v.tolist()) for k, v in a.point_groups.items()} == {
        k: set(v.tolist()) for k, v in b.point_groups.items()
    }
    assert {k: pairs(a, v) for k, v in a.line_groups.items()} == {
        k: pairs(b, v) for k, v in b.line_groups.items()
    }


# The files of the project


def test_the_script_builds_the_files_in_the_folder(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        built = runpy.run_path(str(FOLDER / "build.py"))["main"](tmp_path)
        assert sorted(path.name for path in built) == [path.name for path in FILES]
        for path in FILES:
            again, kept = meshes.read(tmp_path / path.name), meshes.read(path)
            np.testing.assert_allclose(again.points, kept.points, rtol=0, atol=1e-15)
            np.testing.assert_array_equal(again.cells, kept.cells)
            assert again.point_groups.keys() == kept.point_groups.keys()
            assert again.line_groups.keys() == kept.line_groups.keys()
            assert kept.points.dtype == np.float64
            assert kept.points.shape[1] == 3


@pytest.mark.parametrize("cells", [5, 10, 20, 50, 100])
def test_beams(cells: int) -> None:
    mesh = meshes.read(FOLDER / f"beam_{cells}.msh")
    assert mesh.path == FOLDER / f"beam_{cells}.msh"
    nodes = meshes.chain(mesh, "beam")
    np.testing.assert_allclose(
        mesh.points[nodes], np.linspace([0, 0, 0], [1, 0, 0], cells + 1), atol=1e-16
    )
    assert meshes.group(mesh, "left").tolist() == [nodes[0]]
    assert meshes.group(mesh, "right").tolist() == [nodes[-1]]
    assert meshes.line_group(mesh, "beam").tolist() == list(range(cells))
    np.testing.assert_array_equal(nodes, meshes.chain(mesh))


def test_double_pendulum_follows_each_group_across_the_common_node() -> None:
    mesh = meshes.read(FOLDER / "double_pendulum_100.msh")
    first, second = meshes.chain(mesh, "I"), meshes.chain(mesh, "II")
    assert (len(first), len(second)) == (101, 101)
    assert meshes.group(mesh, "B").tolist() == [first[-1]] == [second[0]]
    np.testing.assert_allclose(
        mesh.points[first], np.linspace([0, 0, 0], [1, 0, 0], 101), atol=1e-15
    )
    np.testing.assert_allclose(
        mesh.points[second], np.linspace([1, 0, 0], [1, 1, 0], 101), atol=1e-15
    )
    np.testing.assert_allclose(mesh.points[meshes.group(mesh, "C")], [[1, 1, 0]])
    assert len(meshes.chain(mesh)) == 201


def test_arc_cable_and_four_bar() -> None:
    arc = meshes.read(FOLDER / "arc_40.msh")
    nodes = meshes.chain(arc)
    np.testing.assert_allclose(np.linalg.norm(arc.points - [0, 1, 0], axis=1), 1, rtol=1e-15)
    length = np.linalg.norm(np.diff(arc.points[nodes], axis=0), axis=1).sum()
    assert length == pytest.approx(
        80 * np.sin(np.pi / 160), rel=1e-14
    )  # 40 chords of a quarter circle
    cable = meshes.read(FOLDER / "cable_40.msh")
    np.testing.assert_allclose(cable.points[meshes.group(cable, "middle")], [[1, 0, 0]])
    for name, length in {"crank": 0.2, "coupler": 0.5, "rocker": 0.4}.items():
        bar = meshes.read(FOLDER / f"{name}.msh")
        assert bar.points[meshes.group(bar, "right")[0]].tolist() == [length, 0, 0]


@pytest.mark.parametrize("name", ["beam_100", "arc_40"])
def test_twins_agree(name: str) -> None:
    same(meshes.read(FOLDER / f"{name}.msh"), meshes.read(FOLDER / f"{name}.vtu"))


@pytest.mark.parametrize(
    "path", [path for path in FILES if path.suffix == ".msh"], ids=lambda path: path.stem
)
def test_meshio_reads_the_same_from_our_msh_files(path: Path) -> None:
    theirs, ours = meshio.read(path), meshes.read(path)
    np.testing.assert_array_equal(theirs.points, ours.points)
    for name, (tag, dimension) in theirs.field_data.items():
        kind = ("vertex", "line")[dimension]
        cells = np.concatenate([block.data for block in theirs.cells if block.type == kind])
        marked = cells[
            np.concatenate(
                [
                    d
                    for d, b in zip(theirs.cell_data["gmsh:physical"], theirs.cells, strict=True)
                    if b.type == kind
                ]
            )
            == tag
        ]
        expected = marked[:, 0] if dimension == 0 else marked
        np.testing.assert_array_equal(
            expected,
            ours.point_groups[name] if dimension == 0 else ours.cells[ours.line_groups[name]],
        )


# Formats


def test_text_41_sparse_numbers_unnamed_groups_and_reversed_physicals(tmp_path: Path) -> None:
    mesh = meshes.read(saved(tmp_path, TEXT_41))
    nodes = meshes.chain(mesh)
    np.testing.assert_array_equal(mesh.points[nodes][:, 0], [0, 1, 2, 3])
    np.testing.assert_array_equal(mesh.points[meshes.group(mesh, "left end")], [[0, 0, 0]])
    assert meshes.line_group(mesh, "beam").tolist() == [0, 1, 2]
    assert meshes.line_group(mesh, "tag_7").tolist() == [0, 1]


def test_binary_41_of_meshio(tmp_path: Path) -> None:
    points = np.array(SQUARE_ENDS)
    cells = [("vertex", np.array([[0]])), ("line", np.array([[0, 1], [1, 2], [2, 3]]))]
    tags = [np.array([1]), np.array([2, 2, 2])]
    out = meshio.Mesh(
        points,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": [np.array([1]), np.array([1, 1, 1])]},
    )
    out.point_data["gmsh:dim_tags"] = np.array([[0, 1], [1, 1], [1, 1], [1, 1]])
    out.field_data = {"start": np.array([1, 0]), "beam": np.array([2, 1])}
    meshio.write(tmp_path / "a.msh", out, file_format="gmsh")
    mesh = meshes.read(tmp_path / "a.msh")
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, cells[1][1])
    assert mesh.point_groups["start"].tolist() == [0]
    assert mesh.line_groups["beam"].tolist() == [0, 1, 2]


def test_big_endian_22(tmp_path: Path) -> None:
    nodes = b"".join(struct.pack(">iddd", i, *p) for i, p in enumerate(SQUARE_ENDS, 1))
    cells = struct.pack(">iii", 1, 3, 2) + b"".join(
        struct.pack(">iiiii", i, 4, 1, i, i + 1) for i in (1, 2, 3)
    )
    content = binary_22(4, 3, nodes, cells).replace(
        struct.pack("<i", 1) + b"\n$EndMesh", struct.pack(">i", 1) + b"\n$EndMesh"
    )
    mesh = meshes.read(saved(tmp_path, content))
    np.testing.assert_array_equal(mesh.points, SQUARE_ENDS)
    assert mesh.line_groups["tag_4"].tolist() == [0, 1, 2]


def test_text_22_cell_in_two_groups_is_one_cell(tmp_path: Path) -> None:
    names = '$PhysicalNames\n2\n1 1 "all"\n1 2 "half"\n$EndPhysicalNames\n'
    cells = lines((1, 2), (2, 3), (3, 4), tag=1) + lines((2, 1), tag=2)
    mesh = meshes.read(saved(tmp_path, text_22(SQUARE_ENDS, cells, names)))
    np.testing.assert_array_equal(mesh.cells, [[0, 1], [1, 2], [2, 3]])
    assert mesh.line_groups["all"].tolist() == [0, 1, 2]
    assert mesh.line_groups["half"].tolist() == [0]


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
def test_write_then_read(tmp_path: Path, suffix: str) -> None:
    cells = np.array([[0, 1], [2, 1], [2, 3]])
    groups = {"upper half": np.array([1, 2]), "middle": np.array([1])}
    mesh = meshes.LineMesh(np.array(SQUARE_ENDS) / 3, cells, {"a b": np.array([0, 3])}, groups)
    meshes.write(mesh, tmp_path / f"a{suffix}")
    same(mesh, meshes.read(tmp_path / f"a{suffix}"))


def test_write_refuses_what_cannot_be_read_back(tmp_path: Path) -> None:
    mesh = meshes.read(FOLDER / "beam_5.msh")
    with pytest.raises(InputError, match=r"\.msh or \.vtu"):
        meshes.write(mesh, tmp_path / "a.obj")
    with pytest.raises(InputError, match="different names"):
        meshes.write(
            meshes.LineMesh(mesh.points, mesh.cells, {"x": np.array([0])}, {"x": np.array([0])}),
            tmp_path / "a.msh",
        )
    with pytest.raises(InputError, match="group names without quotes"):
        meshes.write(
            meshes.LineMesh(mesh.points, mesh.cells, {'a"b': np.array([0])}), tmp_path / "a.msh"
        )
    with pytest.raises(InputError, match="can be written"):
        meshes.write(mesh, tmp_path / "nowhere" / "a.msh")


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended base64", "Appended raw"])
@pytest.mark.parametrize("header", ["UInt32", "UInt64"])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
@pytest.mark.parametrize("packed", [True, False])
def test_vtu_as_vtk_writes_it(
    tmp_path: Path, kind: type, mode: str, header: str, order: str, packed: bool
) -> None:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    x = np.linspace(0, 1, 3000)
    points, grid = vtkPoints(), vtkUnstructuredGrid()
    points.SetData(numpy_to_vtk(np.column_stack([x, x**2, 0 * x]).astype(kind), deep=True))
    grid.SetPoints(points)
    grid.InsertNextCell(1, 1, [2999])
    for i in range(2999):
        grid.InsertNextCell(3, 2, [i, i + 1])
    fields = {
        "left": (x == 0).astype(np.int64),
        "count": np.arange(3000),
        "height": (x > 0.5).astype(float),
    }
    for name, values in fields.items():
        grid.GetPointData().AddArray(array := numpy_to_vtk(values, deep=True))
        array.SetName(name)
    grid.GetCellData().AddArray(
        array := numpy_to_vtk((np.arange(3000) > 1000).astype(np.int8), deep=True)
    )
    array.SetName("beam")
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetInputData(grid)
    getattr(writer, f"SetDataModeTo{mode.split()[0]}")()
    writer.SetEncodeAppendedData("base64" in mode)
    getattr(writer, f"SetHeaderTypeTo{header}")()
    getattr(writer, f"SetByteOrderTo{order}")()
    getattr(writer, f"SetCompressorTypeTo{'ZLib' if packed else 'None'}")()
    assert writer.Write()
    mesh = meshes.read(tmp_path / "a.vtu")
    tolerance = 1e-7 if kind is np.float32 else 1e-6 if mode == "Ascii" else 0
    np.testing.assert_allclose(
        mesh.points, np.column_stack([x, x**2, 0 * x]), rtol=0, atol=tolerance
    )
    np.testing.assert_array_equal(meshes.chain(mesh), np.arange(3000))
    assert {name: ids.tolist() for name, ids in mesh.point_groups.items()} == {"left": [0]}
    assert {name: ids.tolist() for name, ids in mesh.line_groups.items()} == {
        "beam": list(range(1000, 2999))
    }


def test_vtu_of_pyvista_with_fields_that_are_no_groups(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.UnstructuredGrid(
        {3: np.array([[0, 1], [1, 2], [2, 3]])}, np.array(SQUARE_ENDS, np.float32)
    )
    grid.point_data["left"] = np.array([1, 0, 0, 0])
    grid.cell_data["beam"] = np.array([True, True, False])
    grid.save(tmp_path / "a.vtu")
    mesh = meshes.read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(mesh.points, SQUARE_ENDS)
    assert {name: ids.tolist() for name, ids in mesh.point_groups.items()} == {"left": [0]}
    assert {name: ids.tolist() for name, ids in mesh.line_groups.items()} == {"beam": [0, 1]}


# Broken files


def test_missing_file_names_its_neighbour() -> None:
    refused(FOLDER / "beam_1000.msh", "no such file", "did you mean 'beam_100.msh'?")
    refused(FOLDER.parent / "meshes", "a .msh, .vtu, .inp, .bdf, .nas, .med or .vtk file")


@pytest.mark.parametrize("name", ["a.msh", "a.vtu"])
def test_files_that_are_no_mesh(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    refused(saved(tmp_path, b"", name), "an empty file")
    refused(saved(tmp_path, np.random.default_rng(1).bytes(4096), name))
    refused(saved(tmp_path, "hello\nworld\n", name))
    (tmp_path / "b" / name).mkdir(parents=True)
    refused(tmp_path / "b" / name, "a folder")
    assert capfd.readouterr() == ("", "")


def test_unknown_formats(tmp_path: Path) -> None:
    refused(saved(tmp_path, "v 0 0 0\n", "a.obj"), ".msh, .vtu", "'.obj'")
    refused(saved(tmp_path, TEXT_41.replace("4.1 0 8", "4.0 0 8")), "gmsh format 2.2 or 4.1", "4.0")
    refused(saved(tmp_path, TEXT_41.replace("4.1 0 8", "3 0 8")), "gmsh format 2.2 or 4.1")
    refused(saved(tmp_path, '<VTKFile type="PolyData"><PolyData/></VTKFile>', "a.vtu"), "PolyData")


def test_too_large_a_file_is_not_opened(tmp_path: Path) -> None:
    file = tmp_path / "a.msh"
    with file.open("wb") as out:
        out.truncate(meshes.MAX_FILE + 1)  # sparse: takes no space
    refused(file, "at most 268435456 bytes")


def test_no_points_no_cells_no_lines(tmp_path: Path) -> None:
    refused(saved(tmp_path, text_22([], [])), "expected points")
    refused(saved(tmp_path, text_22(SQUARE_ENDS, [])), "cells of type line", "no cells at all")
    refused(
        saved(tmp_path, text_22(SQUARE_ENDS, ["2 2 0 0 1 2 3", "15 2 0 0 1"])),
        "got 1 triangle, 1 vertex",
    )
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(np.array(SQUARE_ENDS), [("quad", [[0, 1, 2, 3]])]))
    refused(tmp_path / "a.vtu", "got 1 quad")
    refused(saved(tmp_path, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"), "expected points")


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_coordinates_that_are_not_finite(tmp_path: Path, value: str) -> None:
    content = text_22(SQUARE_ENDS, lines((1, 2), (2, 3), (3, 4))).replace(
        "3 2.0 0.0", f"3 2.0 {value}"
    )
    refused(saved(tmp_path, content), "finite coordinates", f"node 3 at (2, {value}, 0)")
    points = np.array(SQUARE_ENDS)
    points[2, 1] = float(value)
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("line", [[0, 1], [1, 2]])]))
    refused(tmp_path / "a.vtu", "finite coordinates", f"node 2 at (2, {value}, 0)")


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("node", [0, -1, 5, 77])
def test_node_number_out_of_range(tmp_path: Path, node: int) -> None:
    expected = ("on the nodes 1 to 4", f"node {node} in cell 2")
    refused(saved(tmp_path, text_22(SQUARE_ENDS, lines((1, 2), (2, node)))), *expected)
    nodes = b"".join(struct.pack("<iddd", i, *p) for i, p in enumerate(SQUARE_ENDS, 1))
    cells = (
        struct.pack("<iii", 1, 2, 0)
        + struct.pack("<iii", 1, 1, 2)
        + struct.pack("<iii", 2, 2, node)
    )
    refused(saved(tmp_path, binary_22(4, 2, nodes, cells)), *expected)
    refused(
        saved(tmp_path, text_22(SQUARE_ENDS, [*lines((1, 2)), f"15 2 1 1 {node}"])),
        "point group 'tag_1'",
        f"node {node}",
    )


def test_node_index_out_of_range_in_vtu(tmp_path: Path) -> None:
    meshio.write(
        tmp_path / "a.vtu", meshio.Mesh(np.array(SQUARE_ENDS), [("line", [[0, 1], [1, 4]])])
    )
    refused(tmp_path / "a.vtu", "on the nodes 0 to 3", "node 4 in cell 1")


def test_node_numbers_twice(tmp_path: Path) -> None:
    content = text_22(SQUARE_ENDS, lines((1, 2))).replace("\n2 1.0", "\n1 1.0")
    refused(saved(tmp_path, content), "one point a node number", "node 1 at (1, 0, 0)")


def test_cells_of_zero_length(tmp_path: Path) -> None:
    refused(saved(tmp_path, text_22(SQUARE_ENDS, lines((1, 2), (3, 3)))), "cell 2 at (2, 0, 0)")
    refused(
        saved(tmp_path, text_22([*SQUARE_ENDS, (1.0, 1e-14, 0.0)], lines((1, 2), (2, 5)))),
        "cell 2 at (1, 0, 0)",
    )
    refused(saved(tmp_path, text_22([(1, 1, 1), (1, 1, 1)], lines((1, 2)))), "cell 1 at (1, 1, 1)")


def test_short_cells_of_a_small_mesh_are_fine(tmp_path: Path) -> None:
    mesh = meshes.read(
        saved(tmp_path, text_22([(0, 0, 0), (1e-9, 0, 0), (1e-3, 0, 0)], lines((1, 2), (2, 3))))
    )
    assert len(mesh.cells) == 2


@pytest.mark.parametrize("tag", [0, 3])
def test_cells_twice(tmp_path: Path, tag: int) -> None:
    cells = lines((1, 2), (2, 3), (2, 1), tag=tag)
    refused(
        saved(tmp_path, text_22(SQUARE_ENDS, cells)),
        "each cell once",
        "cell 1 at (0.5, 0, 0), cell 3 at (0.5, 0, 0)",
    )


@pytest.mark.parametrize(
    "content",
    [
        binary_22(10**9, 1),
        binary_22(
            2,
            10**9,
            struct.pack("<iddd", 1, 0, 0, 0) + struct.pack("<iddd", 2, 1, 0, 0),
            struct.pack("<iii", 1, 10**9, 2),
        ),
        binary_22(100_000, 1, b"x" * 200_000),
        text_22(SQUARE_ENDS, lines((1, 2))).replace("$Nodes\n4", "$Nodes\n900000000000").encode(),
        text_22(SQUARE_ENDS, lines((1, 2))).replace("$Elements\n1", "$Elements\n100").encode(),
        text_22(SQUARE_ENDS, lines((1, 2))).replace("$Nodes\n4", "$Nodes\n-4").encode(),
        text_22(SQUARE_ENDS, lines((1, 2))).replace("$Nodes\n4", "$Nodes\nfour").encode(),
        TEXT_41.replace("1 1 0 3", "1 1 0 3000000000000000").encode(),
        TEXT_41.replace("2 4 10 40", "2 1e300 10 40").encode(),
        TEXT_41.replace("2 4 10 40", "2 5 10 40").encode(),
        TEXT_41.replace("3 4 1 4", "2000000 4 1 4").encode(),
        TEXT_41.replace("1 2 0 0\n", "1 999999999 0 0\n").encode(),
        TEXT_41.replace("1 2 0 0\n", "1 2 0.5 0\n").encode(),
        TEXT_41.replace("$PhysicalNames\n2", "$PhysicalNames\n" + "9" * 5000).encode(),
        TEXT_41[: TEXT_41.index("$EndElements")].encode(),
        TEXT_41[: TEXT_41.index("$EndNodes")].encode(),
    ],
)
def test_claims_that_the_file_cannot_hold(tmp_path: Path, content: bytes) -> None:
    file = saved(tmp_path, content)
    tracemalloc.start()
    refused(file)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


def test_sparse_node_numbers_cost_nothing(tmp_path: Path) -> None:
    content = TEXT_41.replace("\n40\n", "\n4000000000000\n").replace(
        "4 30 40\n", "4 30 4000000000000\n"
    )
    assert len(meshes.chain(meshes.read(saved(tmp_path, content)))) == 4


def test_claims_of_vtu(tmp_path: Path) -> None:
    good = (FOLDER / "beam_100.vtu").read_text()
    refused(
        saved(
            tmp_path, good.replace('NumberOfPoints="101"', 'NumberOfPoints="999999999999"'), "a.vtu"
        ),
        "NumberOfPoints",
    )
    refused(
        saved(tmp_path, good.replace('NumberOfPoints="101"', 'NumberOfPoints="102"'), "a.vtu"),
        "Points of 306 numbers",
    )
    refused(
        saved(
            tmp_path, good.replace('NumberOfCells="100"', f'NumberOfCells="{"9" * 5000}"'), "a.vtu"
        ),
        "NumberOfCells",
    )
    refused(
        saved(
            tmp_path,
            good.replace("<Piece", "<Piece NumberOfPoints='0' NumberOfCells='0'/><Piece"),
            "a.vtu",
        ),
        "one Piece",
    )
    entity = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">]>' + good
    refused(saved(tmp_path, entity, "a.vtu"), "entity declaration")
    refused(saved(tmp_path, good[: len(good) // 2], "a.vtu"))


def test_vtu_that_unpacks_to_too_much(tmp_path: Path) -> None:
    meshio.write(
        tmp_path / "a.vtu", meshio.Mesh(np.array(SQUARE_ENDS), [("line", [[0, 1], [1, 2], [2, 3]])])
    )
    content = (tmp_path / "a.vtu").read_text()
    packed = zlib.compress(bytes(2**27), 9)
    header = base64.b64encode(
        np.array([1, 2**27, 2**27, len(packed)], np.uint32).tobytes()
    ).decode()
    text = header + base64.b64encode(packed).decode()
    array = (
        f'<PointData><DataArray type="Int8" Name="x" format="binary">{text}</DataArray></PointData>'
    )
    refused(
        saved(tmp_path, content.replace("</Piece>", array + "</Piece>"), "b.vtu"),
        "readable array 'x'",
        "above 67108864",
    )
    lying = base64.b64encode(np.array([1, 32, 32, len(packed)], np.uint32).tobytes()).decode()
    refused(
        saved(
            tmp_path,
            content.replace("</Piece>", array.replace(header, lying) + "</Piece>"),
            "c.vtu",
        ),
        "more than the 32 bytes a block",
    )


@pytest.mark.parametrize("name", ["beam_5.msh", "beam_100.vtu", "text"])
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_give_a_mesh_or_an_input_error(
    tmp_path: Path, name: str, data: st.DataObject
) -> None:
    content = bytearray(TEXT_41.encode() if name == "text" else (FOLDER / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    content = content[: data.draw(st.integers(1, len(content)) | st.just(len(content)))]
    file = saved(tmp_path, bytes(content), f"a{Path(name).suffix or '.msh'}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            mesh = meshes.read(file)
        except InputError:
            return
    assert np.isfinite(mesh.points).all()
    assert set(np.unique(mesh.cells)) == set(range(len(mesh.points)))


# What is dropped with a notice


def test_points_and_cells_that_are_dropped(tmp_path: Path) -> None:
    cells = [*lines((3, 4), (2, 3)), "15 2 5 5 1", "15 2 6 6 4", "2 2 0 0 1 2 3"]
    file = saved(
        tmp_path, text_22(SQUARE_ENDS, cells, '$PhysicalNames\n1\n0 9 "never"\n$EndPhysicalNames\n')
    )
    with pytest.warns(Notice) as caught:
        mesh = meshes.read(file)
    text = "\n".join(str(w.message) for w in caught)
    assert "1 triangle cells ignored" in text
    assert "'tag_5' is named but has no members" in text
    assert "'never' is named but has no members" in text
    np.testing.assert_array_equal(mesh.points, SQUARE_ENDS[1:])
    np.testing.assert_array_equal(mesh.cells, [[1, 2], [0, 1]])
    assert {name: ids.tolist() for name, ids in mesh.point_groups.items()} == {"tag_6": [2]}


# Groups and chains


def test_missing_groups_list_those_present() -> None:
    mesh = meshes.read(FOLDER / "double_pendulum_100.msh")
    with pytest.raises(InputError, match=r"got 'D'; point groups present: A, B, C") as caught:
        meshes.group(mesh, "D")
    assert "double_pendulum_100.msh" in str(caught.value)
    with pytest.raises(
        InputError, match="got 'A', which is a point group; line groups present: I, II"
    ):
        meshes.chain(mesh, "A")
    with pytest.raises(InputError, match=r"did you mean 'left'\?"):
        meshes.group(meshes.read(FOLDER / "beam_5.msh"), "lft")


@given(
    st.permutations(range(7)),
    st.permutations(range(6)),
    st.lists(st.booleans(), min_size=6, max_size=6),
)
def test_chain_of_shuffled_cells(nodes: list[int], order: list[int], turned: list[bool]) -> None:
    points = np.zeros((7, 3))
    points[nodes, 0] = np.arange(7)
    cells = np.array([[nodes[i], nodes[i + 1]][:: -1 if turned[i] else 1] for i in order])
    chain = meshes.chain(meshes.LineMesh(points, cells))
    forward = nodes if sum(turned) < 3 else nodes[::-1]
    if sum(turned) == 3:
        forward = nodes if nodes[0] < nodes[-1] else nodes[::-1]
    assert chain.tolist() == list(forward)


def test_chains_that_are_no_open_line() -> None:
    points = np.array([*SQUARE_ENDS, (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)])

    def chain(*cells: tuple[int, int]) -> None:
        meshes.chain(meshes.LineMesh(points, np.array(cells), line_groups={"g": np.array([0, 1])}))

    with pytest.raises(
        InputError, match=r"without branches, got three or more cells at node 1 at \(1, 0, 0\)"
    ):
        chain((0, 1), (1, 2), (1, 3))
    with pytest.raises(
        InputError,
        match=r"one piece, got 2 pieces, with node 0 at \(0, 0, 0\), node 3 at \(2, 1, 0\)",
    ):
        chain((0, 1), (3, 5))
    with pytest.raises(InputError, match=r"merge nodes at one place \(2, 4\)"):
        chain((0, 1), (1, 2), (4, 5))
    with pytest.raises(InputError, match="a closed loop through node 1"):
        chain((1, 2), (2, 3), (3, 1))
    with pytest.raises(InputError, match="2 pieces"):
        chain((1, 2), (2, 3), (3, 1), (4, 5))


# Paths of scenes


def test_path_stays_in_the_project(tmp_path: Path) -> None:
    folder = tmp_path / "project" / "examples"
    (tmp_path / "project" / "meshes").mkdir(parents=True)
    folder.mkdir()
    (tmp_path / "outside.msh").touch()
    (folder / "link.msh").symlink_to(tmp_path / "outside.msh")
    (folder / "inner.msh").symlink_to(tmp_path / "project" / "meshes" / "b.msh")
    meshes_folder = (tmp_path / "project" / "meshes").resolve()
    assert meshes.path("a.msh", folder) == folder.resolve() / "a.msh"
    assert meshes.path("../meshes/b.msh", folder) == meshes_folder / "b.msh"
    assert meshes.path("inner.msh", folder) == meshes_folder / "b.msh"
    assert meshes.path("../../project/meshes/b.msh", folder) == meshes_folder / "b.msh"
    for text in ("../../outside.msh", "link.msh", str(tmp_path / "outside.msh")):
        with pytest.raises(InputError, match="stays in its parent folder"):
            meshes.path(text, folder)
        assert meshes.path(text, folder, allow_outside=True) == (tmp_path / "outside.msh").resolve()
    with pytest.raises(InputError, match="stays in its parent folder"):
        meshes.path(str(folder / "a.msh"), folder)
    for text in ("", "  ", "a\0b.msh"):
        with pytest.raises(InputError, match="a path to a file"):
            meshes.path(text, folder)


def test_path_at_the_root_of_the_file_system() -> None:
    with pytest.raises(InputError, match="stays in its parent folder"):
        meshes.path("../etc/passwd.msh", Path("/fmbs-scenes"))


def test_limit_of_counts_is_what_the_readme_says() -> None:
    assert msh.MAX_COUNT == 10**6
    assert "a million points and cells" in (FOLDER / "README.md").read_text()


def test_lines_of_scikit_fem() -> None:
    """Boundaries are point groups, subdomains line groups; along a curve nodes lie where it says."""
    grid = skfem.MeshLine(np.linspace(0.0, 2.0, 5)).with_boundaries({"middle": np.array([2])})
    grid = grid.with_subdomains({"far": lambda x: x[0] > 1.0})
    mesh = meshes.from_skfem(grid, lambda s: np.column_stack([np.cos(s), np.sin(s), 0 * s]))
    assert mesh.point_groups["middle"].tolist() == [2]
    assert mesh.line_groups["far"].tolist() == [2, 3]
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 1.0, rtol=1e-15)
    assert meshes.from_skfem(grid).points[2].tolist() == [1.0, 0.0, 0.0]
    with pytest.raises(
        InputError, match="expected a MeshLine of first order, got a MeshTri1 in 2 dimensions"
    ):
        meshes.from_skfem(skfem.MeshTri())


PARTITIONED = """\
$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
0 1 "left"
1 2 "beam"
$EndPhysicalNames
$Entities
2 1 0 0
1 0 0 0 1 1
2 2 0 0 0
1 0 0 0 2 0 0 1 2 2 1 -2
$EndEntities
$PartitionedEntities
2
2
5 1
6 2
3 2 0 0
3 0 1 1 1 0 0 0 1 1
4 0 2 1 2 2 0 0 0
5 0 1 2 1 2 1 0 0 0
2 1 1 1 1 0 0 0 1 0 0 1 2 2 3 -5
3 1 1 1 2 1 0 0 2 0 0 1 2 2 5 -4
$EndPartitionedEntities
$Nodes
3 3 1 3
0 3 0 1
1
0 0 0
0 4 0 1
3
2 0 0
0 5 0 1
2
1 0 0
$EndNodes
$Elements
3 3 1 3
0 3 15 1
1 1
1 2 1 1
2 1 2
1 3 1 1
3 2 3
$EndElements
"""


def test_pieces_of_a_partitioned_mesh_have_the_groups_of_their_entities(tmp_path: Path) -> None:
    (tmp_path / "a.msh").write_text(PARTITIONED)
    found = meshes.read(tmp_path / "a.msh")
    assert found.cells.tolist() == [[0, 2], [2, 1]]
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {"left": [0]}
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"beam": [0, 1]}


@pytest.mark.parametrize("binary", [False, True])
def test_nodes_with_parameters(binary: bool, tmp_path: Path) -> None:
    """Format 2.2: of a point none, of a curve one, of a surface two, of a volume or of nothing
    none.
    """
    nodes = [
        (1, [0.0, 0, 0], 0, []),
        (2, [1.0, 0, 0], 1, [0.5]),
        (3, [2.0, 0, 0], 2, [0.1, 0.2]),
        (4, [3.0, 0, 0], 3, []),
        (5, [4.0, 0, 0], -1, []),
    ]
    lines = [(i, i, i + 1) for i in range(1, 5)]
    if binary:
        data = b"".join(
            struct.pack(f"<i3d2i{len(p)}d", n, *x, dim, 1, *p) for n, x, dim, p in nodes
        )
        cells = struct.pack("<3i", 1, 4, 2) + b"".join(
            struct.pack("<5i", i, 7, 1, a, b) for i, a, b in lines
        )
        head = b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n"
    else:
        data = "".join(
            f"{n} {' '.join(map(str, [*x, dim, 1, *p]))}\n" for n, x, dim, p in nodes
        ).encode()
        cells = "".join(f"{i} 1 2 7 1 {a} {b}\n" for i, a, b in lines).encode()
        head = b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    body = (
        b"$ParametricNodes\n5\n"
        + data
        + b"\n$EndParametricNodes\n$Elements\n4\n"
        + cells
        + b"\n$EndElements\n"
    )
    (tmp_path / "a.msh").write_bytes(head + body)
    found = meshes.read(tmp_path / "a.msh")
    np.testing.assert_allclose(found.points, [x for _, x, _, _ in nodes])
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {
        "tag_7": [0, 1, 2, 3]
    }
