"""Meshes of other programs: the same mesh from every format, and files that end the reader."""

from __future__ import annotations

from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.foreign import door
from fmbs_skfem.shapes import meshes, plate_meshes

INP = """\
*HEADING
a beam of two elements
*NODE
1, 0.0, 0.0, 0.0
2, 500.0, 0.0, 0.0
3, 1000.0, 0.0, 0.0
*ELEMENT, TYPE=B31, ELSET=beam
1, 1, 2
2, 2, 3
*NSET, NSET=left
1
*NSET, NSET=right
3
"""


def test_an_abaqus_file_in_millimetres(tmp_path: Path) -> None:
    path = tmp_path / "beam.inp"
    path.write_text(INP)
    found = meshes.read(path, unit=1e-3)
    np.testing.assert_allclose(found.points, [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]])
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {
        "left": [0],
        "right": [2],
    }
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"beam": [0, 1]}


@pytest.mark.parametrize("suffix", [".vtk", ".med"])
def test_a_plate_with_an_edge_and_a_corner(suffix: str, tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]])
    cells = [("quad", np.array([[0, 1, 4, 3], [1, 2, 5, 4]])), ("line", np.array([[0, 3]]))]
    if suffix == ".med":
        mesh = meshio.Mesh(
            points,
            cells,
            {"point_tags": np.array([0, 0, 0, 0, 0, 1])},
            {"cell_tags": [np.array([-2, -2]), np.array([-1])]},
        )
        mesh.point_tags, mesh.cell_tags = {1: ["corner"]}, {-1: ["root"], -2: ["sheet"]}
    else:
        mesh = meshio.Mesh(
            points,
            cells,
            {"corner": np.array([0, 0, 0, 0, 0, 1])},
            {"root": [np.array([0, 0]), np.array([1])], "sheet": [np.array([1, 1]), np.array([0])]},
        )
    path = tmp_path / f"plate{suffix}"
    mesh.write(path)
    found = plate_meshes.read(path, planar=True)
    np.testing.assert_allclose(found.points, points)
    assert len(found.cells) == 2
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {"corner": [5]}
    assert {name: np.sort(ids).tolist() for name, ids in found.edge_groups.items()} == {
        "root": [[0, 3]]
    }
    assert {name: ids.tolist() for name, ids in found.face_groups.items()} == {"sheet": [0, 1]}


def test_a_node_set_along_the_boundary_is_an_edge(tmp_path: Path) -> None:
    """A plate of two elements of Abaqus, which knows no edges; a set of the nodes inside would have
    no side.
    """
    nodes = "".join(f"{1 + 3 * j + i}, {i}.0, {j}.0, 0.0\n" for j in range(2) for i in range(3))
    sets = "*NSET, NSET=root\n1, 4\n*NSET, NSET=top\n4, 5, 6\n*NSET, NSET=tip\n6\n*NSET, NSET=across\n2, 5\n"
    path = tmp_path / "plate.inp"
    path.write_text(
        f"*NODE\n{nodes}*ELEMENT, TYPE=S4, ELSET=sheet\n1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n{sets}"
    )
    found = plate_meshes.read(path, planar=True)
    assert {name: sorted(map(sorted, ids.tolist())) for name, ids in found.edge_groups.items()} == {
        "root": [[0, 3]],
        "top": [[3, 4], [4, 5]],
    }
    assert {"tip", "across"} <= found.point_groups.keys()
    assert len(found.cells) == 2


@pytest.mark.parametrize("suffix", [".inp", ".med", ".vtk"])
def test_what_ends_meshio_is_bad_input(suffix: str, tmp_path: Path) -> None:
    """It calls sys.exit, and raises errors of all kinds."""
    path = tmp_path / f"broken{suffix}"
    path.write_text("*NODE\n1, zero\n\x89HDF nothing")
    with pytest.raises(InputError, match="expected"):
        meshes.read(path)


def test_groups_of_points_by_point_cells(tmp_path: Path) -> None:
    """As gmsh writes them into MED: families of cells with one node."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    cells = [("vertex", np.array([[0], [2]])), ("line", np.array([[0, 1], [1, 2]]))]
    mesh = meshio.Mesh(
        points, cells, cell_data={"cell_tags": [np.array([-1, -2]), np.array([-3, -3])]}
    )
    mesh.cell_tags, mesh.point_tags = {-1: ["left"], -2: ["right"], -3: ["beam"]}, {}
    mesh.write(tmp_path / "line.med")
    found = meshes.read(tmp_path / "line.med")
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {
        "left": [0],
        "right": [2],
    }
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"beam": [0, 1]}


@pytest.mark.parametrize("binary", [True, False])
def test_an_unstructured_grid_of_pyvista(binary: bool, tmp_path: Path) -> None:
    """Version 5.1: offsets, METADATA, arrays of 8 bytes, names with blanks."""
    pv = pytest.importorskip("pyvista")
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]])
    grid = pv.UnstructuredGrid(
        np.array([4, 0, 1, 4, 3, 4, 1, 2, 5, 4, 2, 0, 3]), np.array([9, 9, 3]), points
    )
    grid.cell_data["the sheet"] = np.array([1, 1, 0])
    grid.cell_data["root"] = np.array([0, 0, 1], np.int32)
    grid.point_data["corner"] = np.array([0, 0, 0, 0, 0, 1])
    grid.point_data["temperature"] = np.linspace(0.0, 1.0, 6)
    grid.point_data["vectors"] = np.ones((6, 3))
    grid.save(tmp_path / "plate.vtk", binary=binary)
    found = plate_meshes.read(tmp_path / "plate.vtk", planar=True)
    np.testing.assert_allclose(found.points, points)
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {"corner": [5]}
    assert {name: np.sort(ids).tolist() for name, ids in found.edge_groups.items()} == {
        "root": [[0, 3]]
    }
    assert {name: ids.tolist() for name, ids in found.face_groups.items()} == {"the sheet": [0, 1]}


@pytest.mark.parametrize("binary", [True, False])
def test_polygonal_data_of_pyvista(binary: bool, tmp_path: Path) -> None:
    """One polyline of four points, and two triangles."""
    pv = pytest.importorskip("pyvista")
    line = pv.lines_from_points(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]))
    joined = pv.PolyData(line.points, lines=[4, 0, 1, 2, 3])
    joined.save(tmp_path / "line.vtk", binary=binary)
    assert meshes.read(tmp_path / "line.vtk").cells.tolist() == [[0, 1], [1, 2], [2, 3]]
    sheet = pv.PolyData(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), faces=[3, 0, 1, 2, 3, 0, 2, 3]
    )
    sheet.cell_data["half"] = np.array([0, 1])
    sheet.save(tmp_path / "sheet.vtk", binary=binary)
    found = plate_meshes.read(tmp_path / "sheet.vtk", planar=True)
    assert found.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert {name: ids.tolist() for name, ids in found.face_groups.items()} == {"half": [1]}


#: the points (0, 1, 2) x (0, 1) in three ways
GRIDS = {
    "STRUCTURED_POINTS": "DIMENSIONS 3 2 1\nORIGIN 0 0 0\nSPACING 1 1 9\n",
    "RECTILINEAR_GRID": "DIMENSIONS 3 2 1\nX_COORDINATES 3 float\n0 1 2\nY_COORDINATES 2 float\n0 1\nZ_COORDINATES 1 float\n0\n",
    "STRUCTURED_GRID": "DIMENSIONS 3 2 1\nPOINTS 6 double\n0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0\n",
}


@pytest.mark.parametrize("version", ["3.0", "5.1"])
@pytest.mark.parametrize("dataset", GRIDS)
def test_structured_grids(dataset: str, version: str, tmp_path: Path) -> None:
    """Two squares, whose arrays may be groups."""
    data = "CELL_DATA 2\nSCALARS half int 1\nLOOKUP_TABLE default\n0 1\nPOINT_DATA 6\nFIELD f 1\ncorner 1 6 int\n1 0 0 0 0 0\n"
    path = tmp_path / "grid.vtk"
    path.write_text(
        f"# vtk DataFile Version {version}\nt\nASCII\nDATASET {dataset}\n{GRIDS[dataset]}{data}"
    )
    found = plate_meshes.read(path, planar=True)
    np.testing.assert_array_equal(
        found.points, [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]]
    )
    assert found.cells.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]]
    assert {name: ids.tolist() for name, ids in found.face_groups.items()} == {"half": [1]}
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {"corner": [0]}


def test_a_row_of_structured_points_along_z_is_a_line(tmp_path: Path) -> None:
    path = tmp_path / "line.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 1 1 3\nSPACING 1 1 0.5\nORIGIN 1 0 0\n"
    )
    found = meshes.read(path)
    assert found.cells.tolist() == [[0, 1], [1, 2]]
    np.testing.assert_array_equal(found.points, [[1, 0, 0], [1, 0, 0.5], [1, 0, 1]])


@pytest.mark.parametrize(
    "text,said",
    [
        (
            "STRUCTURED_POINTS\nDIMENSIONS 99999999 99999999 1\n",
            "expected DIMENSIONS nx ny nz of 2 to 1000000 points together",
        ),
        ("STRUCTURED_POINTS\nORIGIN 0 0 0\n", "got 0 0 0"),
        ("STRUCTURED_POINTS\nDIMENSIONS 3 2 1\nSPACING 1 x\n", "expected three numbers, got '1 x"),
        ("STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n", "hexahedron"),
        (
            "STRUCTURED_GRID\nDIMENSIONS 3 2 1\nPOINTS 1 float\n0 0 0\n",
            "expected 6 points as DIMENSIONS says, got 1",
        ),
        (
            "RECTILINEAR_GRID\nDIMENSIONS 3 1 1\nX_COORDINATES 2 float\n0 1\n",
            "expected 3, 1 and 1 coordinates .*, got 2, 0, 0",
        ),
        ("FIELD\n", "expected a data set STRUCTURED_POINTS, .* or POLYDATA, got 'FIELD'"),
    ],
)
def test_structured_grids_that_are_refused(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtk"
    path.write_text(f"# vtk DataFile Version 5.1\nt\nASCII\nDATASET {text}")
    with pytest.raises(InputError, match=said):
        plate_meshes.read(path, planar=True)


def test_damaged_vtk_files_are_refused(tmp_path: Path) -> None:
    head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n0 0 0 1 0 0\n"
    for text, said in {
        "POINTS 900000000 double\n1 2\n": "2700000000 numbers as the file claims",
        "CELLS 1 3\n2 0 5\nCELL_TYPES 1\n3\n": "cells on points 0 to 1, got 0 to 5",
        "CELLS 1 3\n3 0 1\nCELL_TYPES 1\n3\n": "1 cells in 3 numbers as the file claims",
        "CELLS 2 3\nOFFSETS vtktypeint64\n0 3\nCONNECTIVITY vtktypeint64\n0 1 1\nCELL_TYPES 1\n3\n": "2 nodes of a line, got 3",
        "CELLS 1 3\n2 0 1\nCELL_TYPES 2\n3 3\n": "CELL_TYPES of as many cells",
        "SOMETHING else\n": "a section of a legacy VTK file, got 'SOMETHING'",
    }.items():
        path = tmp_path / "damaged.vtk"
        path.write_text(head + text)
        with pytest.raises(InputError, match=said):
            meshes.read(path)


def test_a_file_that_takes_all_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A compressed data set of 8 GB in a file of few bytes, within a limit that leaves the reader
    its libraries.
    """
    with h5py.File(tmp_path / "bomb.med", "w") as file:
        nodes = file.create_group("ENS_MAA/m/step/NOE")
        file["ENS_MAA/m"].attrs["ESP"] = 1
        data = nodes.create_dataset(
            "COO", shape=(10**9,), dtype="f8", chunks=(10**6,), compression="gzip"
        )
        data.attrs["NBR"] = 10**9
    assert (tmp_path / "bomb.med").stat().st_size < 10_000
    monkeypatch.setattr(door, "MEMORY_LIMIT", 2**30)
    with pytest.raises(InputError, match=r"got one that needs more than 1 GiB of memory"):
        meshes.read(tmp_path / "bomb.med")


def test_a_file_that_takes_too_long_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "beam.inp").write_text(INP)
    monkeypatch.setattr(door, "TIME_LIMIT", 0.001)
    with pytest.raises(InputError, match=r"got one that takes longer than 0\.001 s"):
        meshes.read(tmp_path / "beam.inp")
