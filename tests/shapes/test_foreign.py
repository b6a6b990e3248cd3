"""Meshes of other programs: the same mesh from every format, and files that end the reader."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import foreign, meshes, plate_meshes

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
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {"left": [0], "right": [2]}
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"beam": [0, 1]}


@pytest.mark.parametrize("suffix", [".vtk", ".med"])
def test_a_plate_with_an_edge_and_a_corner(suffix: str, tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]])
    cells = [("quad", np.array([[0, 1, 4, 3], [1, 2, 5, 4]])), ("line", np.array([[0, 3]]))]
    if suffix == ".med":
        mesh = meshio.Mesh(
            points, cells, {"point_tags": np.array([0, 0, 0, 0, 0, 1])}, {"cell_tags": [np.array([-2, -2]), np.array([-1])]}
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
    assert {name: np.sort(ids).tolist() for name, ids in found.edge_groups.items()} == {"root": [[0, 3]]}
    assert {name: ids.tolist() for name, ids in found.face_groups.items()} == {"sheet": [0, 1]}


def test_a_node_set_along_the_boundary_is_an_edge(tmp_path: Path) -> None:
    """A plate of two elements of Abaqus, which knows no edges; a set of the nodes inside would have no side."""
    nodes = "".join(f"{1 + 3 * j + i}, {i}.0, {j}.0, 0.0\n" for j in range(2) for i in range(3))
    sets = "*NSET, NSET=root\n1, 4\n*NSET, NSET=top\n4, 5, 6\n*NSET, NSET=tip\n6\n*NSET, NSET=across\n2, 5\n"
    path = tmp_path / "plate.inp"
    path.write_text(f"*NODE\n{nodes}*ELEMENT, TYPE=S4, ELSET=sheet\n1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n{sets}")
    found = plate_meshes.read(path, planar=True)
    assert {name: sorted(map(sorted, ids.tolist())) for name, ids in found.edge_groups.items()} == {
        "root": [[0, 3]],
        "top": [[3, 4], [4, 5]],
    }
    assert {"tip", "across"} <= found.point_groups.keys()
    assert len(found.cells) == 2


@pytest.mark.parametrize("suffix", foreign.SUFFIXES)
def test_what_ends_meshio_is_bad_input(suffix: str, tmp_path: Path) -> None:
    """It calls sys.exit, and raises errors of all kinds."""
    path = tmp_path / f"broken{suffix}"
    path.write_text("*NODE\n1, zero\n\x89HDF nothing")
    with pytest.raises(InputError, match="expected a file that meshio reads, got"):
        meshes.read(path)
