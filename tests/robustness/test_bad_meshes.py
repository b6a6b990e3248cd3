"""Rows 16 to 30 of the matrix of bad input: meshes and NURBS files that `fmbs check` refuses, or
takes with a notice.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import meshes, plate_meshes
from tests.cli.calls import fmbs

from .inputs import (
    BEAM,
    MESHES,
    PLATE,
    STRIP,
    beam,
    changed,
    lines,
    msh,
    plate,
    quads,
    refused,
    shell,
    strip,
)

NOISE = np.random.default_rng(1).bytes(3000)
LINE = [(0, 0), (0.5, 0), (1, 0)]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
TWO = [*SQUARE, (2, 0), (2, 1)]
NAMES = '$PhysicalNames\n3\n0 1 "left"\n0 2 "right"\n1 7 "beam"\n$EndPhysicalNames\n'
LEFT = '$PhysicalNames\n1\n1 9 "left"\n$EndPhysicalNames\n'
POINTS = ["15 2 1 1 1", "15 2 2 2 3"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


# --------------------------------------------------------------------------------------------------------- 16, 17: unreadable files
@pytest.mark.parametrize("name", ["beam.msh", "beam.vtu", "beam.stl", "beam"])
@pytest.mark.parametrize(
    "content", [b"", b"\0", NOISE, b"$MeshFormat\n2.2 1 8\n", b"<VTKFile", b"solid x\n"]
)
def test_row_16_no_meshes(name: str, content: bytes, tmp_path: Path) -> None:
    path = beam(tmp_path, changed(BEAM, "beam_5.msh", name), content)
    (tmp_path / "beam_5.msh").rename(tmp_path / name)
    refused(path, "scene.yaml:5: bodies.beam: mesh", name)


@pytest.mark.parametrize("content", [b"", b"\0", NOISE, b"[", b'{"format": NaN}', b"\xff\xfe"])
def test_row_16_no_nurbs(content: bytes, tmp_path: Path) -> None:
    path = shell(tmp_path, STRIP)
    (tmp_path / "roof.json").write_bytes(content)
    refused(path, "scene.yaml:3: bodies.roof: ", "roof.json")


@pytest.mark.parametrize(
    "command", ["check", "run", "reduce", "compare", "export", "render", "train", "sweep"]
)
def test_row_16_every_command_names_a_missing_mesh(command: str, tmp_path: Path) -> None:
    """With its place in the scene, before files are hashed or a folder is made."""
    path = beam(
        tmp_path, changed(BEAM, "beam_5.msh", "beam_6.msh") + "reduction: {snapshots: 1 ms}\n"
    )
    refused(
        path,
        "scene.yaml:5: bodies.beam: mesh",
        "no such file; did you mean 'beam_5.msh'?",
        command=(command,),
    )


def test_row_16_no_files(tmp_path: Path) -> None:
    refused(
        beam(tmp_path, changed(BEAM, "beam_5.msh", "beam_6.msh")),
        "no such file; did you mean 'beam_5.msh'?",
    )
    refused(
        beam(tmp_path, changed(BEAM, "beam_5.msh", "meshes/none.msh")),
        "no such file; paths count from the folder of the scene",
    )
    refused(beam(tmp_path, changed(BEAM, "beam_5.msh", ".")), "expected a file, got a folder")
    refused(
        tmp_path / "no.yaml", "no.yaml: expected a readable file, got No such file or directory"
    )
    (tmp_path / "folder.yaml").mkdir()
    refused(
        tmp_path / "folder.yaml",
        "expected a scene, or a folder with results, got a folder without a report",
    )


HUGE = 2 * 10**9


@pytest.mark.parametrize("count", [HUGE, 10**18, -1])
def test_row_17_claims_of_a_header(count: int, tmp_path: Path) -> None:
    text, binary = msh(LINE, lines((1, 2), (2, 3))), (MESHES / "beam_5.msh").read_bytes()
    for before, after in (
        ("$Nodes\n3", f"$Nodes\n{count}"),
        ("$Elements\n2", f"$Elements\n{count}"),
    ):
        refused(
            beam(tmp_path, BEAM, changed(text, before, after)), "scene.yaml:5: bodies.beam: mesh"
        )
    refused(
        beam(tmp_path, BEAM, binary.replace(b"$Nodes\n6", b"$Nodes\n%d" % count)),
        "at most 1000000 nodes",
    )
    vtu = (
        (MESHES / "beam_100.vtu")
        .read_text()
        .replace('NumberOfPoints="101"', f'NumberOfPoints="{count}"')
    )
    path = beam(tmp_path, changed(BEAM, "beam_5.msh", "beam.vtu"))
    (tmp_path / "beam.vtu").write_text(vtu)
    refused(path, "NumberOfPoints of at most 1000000")


# ------------------------------------------------------------------------------------------------------------- 18, 21: numbers
@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e400"])
def test_row_18_coordinates(value: str, tmp_path: Path) -> None:
    text = msh([(0, 0), (0.5, 0), (1, 0)], lines((1, 2), (2, 3))).replace(
        "2 0.5 0 0", f"2 0.5 {value} 0"
    )
    refused(
        beam(tmp_path, BEAM, text),
        "finite coordinates, got node 2 at (0.5, ",
        "export the mesh again",
    )
    text = msh(SQUARE, quads((1, 2, 3, 4))).replace("3 1 1 0", f"3 1 {value} 0")
    refused(plate(tmp_path, text), "finite coordinates, got node 3 at (1, ")
    refused(
        shell(tmp_path, strip("control/2/1/0", "value")),
        "patches[0].control[2][1][0]: expected a finite number",
    )


@pytest.mark.parametrize("node", [0, 9, -1])
def test_row_21_node_numbers(node: int, tmp_path: Path) -> None:
    refused(
        beam(tmp_path, BEAM, msh(LINE, lines((1, 2), (2, node)))),
        "cells on the nodes 1 to 3 of the file",
        f"node {node} in cell 2",
    )
    refused(
        plate(tmp_path, msh(SQUARE, quads((1, 2, 3, node)))),
        "cells on the nodes 1 to 4 of the file",
        f"node {node} in cell 1",
    )


# ------------------------------------------------------------------------------------------------------ 19 to 26: cells of plates
CELLS: dict[str, tuple[list[str], list[tuple[float, ...]], list[str]]] = {
    "19 mixed order": (
        ["1 of 2 clockwise: cell 2 at (1.5, 0.5, 0)"],
        TWO,
        quads((1, 2, 3, 4), (2, 3, 6, 5)),
    ),
    "20 bow-tie": (
        ["do not cross, got cell 2 at (1.5, 0.5, 0)"],
        TWO,
        quads((1, 2, 3, 4), (2, 5, 3, 6)),
    ),
    "20 concave": (
        ["below 180 degrees, got cell 1 at (0.8, 0.55, 0)"],
        [(0, 0), (2, 0), (0.2, 0.2), (1, 2)],
        quads((1, 2, 3, 4)),
    ),
    "22 duplicate nodes": (
        ["one node a place", "node 2 at (1, 0, 0), node 5 at (1, 0, 0)", "merge the nodes"],
        [*SQUARE, (1, 0), (2, 0), (2, 1), (1, 1)],
        quads((1, 2, 3, 4), (5, 6, 7, 8)),
    ),
    "22 zero area": (
        ["cells with an area, got cell 1 at (1.5, 1.5, 0)"],
        [(i, i) for i in range(4)],
        quads((1, 2, 3, 4)),
    ),
    "22 zero side": (
        ["longer than zero, got cell 1 at (0.5, 0.25, 0)"],
        [(0, 0), (1, 0), (1, 1), (0, 0)],
        quads((1, 2, 3, 4)),
    ),
    "22 repeated vertex": (
        ["different vertices, got cell 1 with nodes [1, 2, 3, 3]"],
        SQUARE,
        quads((1, 2, 3, 3)),
    ),
    "22 cell twice": (
        ["each cell once, got repeated cell 1"],
        SQUARE,
        quads((1, 2, 3, 4), (2, 3, 4, 1)),
    ),
    "24 hanging node": (
        ["side to side, got node 8 at (1, 0.5, 0) inside a side of cell 1 at (0.5, 0.5, 0)"],
        [*TWO, (2, 0.5), (1, 0.5)],
        quads((1, 2, 3, 4), (2, 5, 7, 8), (8, 7, 6, 3)),
    ),
    "24 three cells at a side": (
        [
            "at most two cells at a side",
            "3 cells at the side between node 2 at (1, 0, 0) and node 3 at (1, 1, 0)",
        ],
        [*TWO, (1.5, 0.2), (1.5, 0.8)],
        quads((1, 2, 3, 4), (2, 5, 6, 3), (2, 7, 8, 3)),
    ),
    "25 two parts": (
        [
            "one piece, got 2 parts: 1 cells from cell 1 at (0.5, 0.5, 0), 1 cells from cell 2 at (3.5, 0.5, 0)"
        ],
        [*SQUARE, (3, 0), (4, 0), (4, 1), (3, 1)],
        quads((1, 2, 3, 4), (5, 6, 7, 8)),
    ),
    "26 triangles and quads": (
        ["cells that hang together by sides, got parts that touch only at node 2"],
        TWO,
        ["2 2 7 7 2 5 6", *quads((1, 2, 3, 4))],
    ),
    "26 quads of 8 nodes": (
        ["cells of type quad or triangle, got 1 quad8", "first order"],
        [*SQUARE, (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)],
        ["16 2 7 7 1 2 3 4 5 6 7 8"],
    ),
    "26 quads of 4 and of 8 nodes": (
        ["all cells of type quad, of first order, got 1 quad8 among them"],
        [*TWO, (1.5, 0), (2, 0.5), (1.5, 1), (1, 0.5)],
        [*quads((1, 2, 3, 4)), "16 2 7 7 2 5 6 3 7 8 9 10"],
    ),
    "26 not flat": (
        ["a plane z = constant for a planar body, got node 3 at (1, 1, 0.2)"],
        [(0, 0), (1, 0), (1, 1, 0.2), (0, 1)],
        quads((1, 2, 3, 4)),
    ),
    "26 triangles for quads": (
        ["quads for ancf", "argyris"],
        SQUARE,
        ["2 2 7 7 1 2 3", "2 2 7 7 1 3 4"],
    ),
}


@pytest.mark.parametrize("row", CELLS)
def test_rows_19_to_26_cells(row: str, tmp_path: Path) -> None:
    words, points, cells = CELLS[row]
    points = [(*point, 0)[:3] for point in points]
    text = msh(points, cells)
    scene = PLATE.replace("type: plate\n", "type: plate\n    interpolation: ancf\n")
    refused(
        plate(tmp_path, text, scene), "scene.yaml:4: bodies.plate: mesh", "a.msh: expected ", *words
    )


def test_row_19_all_clockwise_is_turned(tmp_path: Path) -> None:
    text = msh(TWO, [*quads((4, 3, 2, 1), (3, 6, 5, 2)), "1 2 9 9 1 4"], LEFT)
    assert fmbs("check", plate(tmp_path, text), "--json").json["notices"] == []


def test_row_20_folded_patch(tmp_path: Path) -> None:
    """Control points whose order along the strip is reversed in its middle: the surface runs back
    over itself.
    """
    control = [[[x, y, 0] for y in (0, 1)] for x in (0, 1.8, -0.2, 2)]
    refused(
        shell(tmp_path, strip("control", control)),
        "scene.yaml:3: bodies.roof: ",
        "patch: expected cells that do not fold back",
        "cell 0",
    )


def test_row_22_lines(tmp_path: Path) -> None:
    points = [(0, 0), (0.5, 0), (0.5, 0), (1, 0)]
    refused(
        beam(tmp_path, BEAM, msh(points, lines((1, 2), (3, 4)), NAMES)),
        "one piece",
        "merge nodes at one place (1, 2)",
    )
    refused(
        beam(tmp_path, BEAM, msh(points, lines((1, 2), (2, 3), (3, 4)), NAMES)),
        "cells longer than zero, got length 0 in cell 2",
    )


def test_row_23_unused_nodes(tmp_path: Path) -> None:
    text = msh([*LINE, (5, 5)], [*POINTS, *lines((1, 2), (2, 3))], NAMES)
    assert fmbs("check", beam(tmp_path, BEAM, text)).code == 0
    text = msh([*SQUARE, (9, 9)], [*quads((1, 2, 3, 4)), "1 2 9 9 1 4"], LEFT)
    assert fmbs("check", plate(tmp_path, text)).code == 0


BRANCHES = {
    "24 branch": (
        [*LINE, (0.5, 1)],
        lines((1, 2), (2, 3), (2, 4)),
        ["one line without branches", "node 1 at (0.5, 0, 0)"],
    ),
    "25 two lines": ([*LINE, (2, 0)], lines((1, 2), (3, 4)), ["one piece, got 2 pieces"]),
    "25 closed": (
        [(0, 0), (1, 0), (0, 1)],
        lines((1, 2), (2, 3), (3, 1)),
        ["an open line with two ends, got a closed loop"],
    ),
    "26 curved lines": (LINE, ["8 2 7 7 1 3 2"], ["cells of type line, got 1 line3"]),
    "26 quads": (SQUARE, quads((1, 2, 3, 4)), ["cells of type line, got 1 quad", "two-node lines"]),
}


@pytest.mark.parametrize("row", BRANCHES)
def test_rows_24_to_26_lines(row: str, tmp_path: Path) -> None:
    points, cells, words = BRANCHES[row]
    text = msh(points, cells, '$PhysicalNames\n1\n1 7 "beam"\n$EndPhysicalNames\n')
    refused(beam(tmp_path, BEAM, text), "scene.yaml:5: bodies.beam: mesh", *words)


# ----------------------------------------------------------------------------------------------------------- 27, 28: named groups
def test_row_27_named_places(tmp_path: Path) -> None:
    text = msh(SQUARE, [*quads((1, 2, 3, 4)), "1 2 9 9 1 4"], LEFT)
    refused(
        plate(tmp_path, text, changed(PLATE, "edges: left", "edges: lefft")),
        "scene.yaml:10: joints.left.edges",
        "left",
        "lefft",
    )
    empty = changed(LEFT, "1\n1 9", '2\n1 8 "right"\n1 9')
    text = msh(SQUARE, [*quads((1, 2, 3, 4)), "1 2 9 9 1 4"], empty)
    done = refused(
        plate(tmp_path, text, changed(PLATE, "edges: left", "edges: right")),
        "scene.yaml:10: joints.left.edges",
        "left",
    )
    assert "warning: mesh" in done.err
    assert "group 'right' is named but has no members in the mesh, and is dropped" in done.err


def test_row_28_groups_without_names(tmp_path: Path) -> None:
    text = changed(
        changed(BEAM, "line: beam", "line: tag_7"), "at: beam.left", "at: beam.tag_1"
    ).replace("beam.right", "beam.tag_2")
    path = beam(tmp_path, text, msh(LINE, [*POINTS, *lines((1, 2), (2, 3))]))
    found = meshes.read(tmp_path / "beam_5.msh")
    assert (sorted(found.point_groups), sorted(found.line_groups)) == (
        ["tag_1", "tag_2"],
        ["tag_7"],
    )
    path.write_text(changed(text, "tag_7", "tag_8"))
    refused(path, "line groups present: tag_7; did you mean 'tag_7'?")
    path.write_text(text)


# ------------------------------------------------------------------------------------------------------------------ 29, 30: NURBS
PATCHES: dict[str, tuple[str, Any, str]] = {
    "29 decreasing": (
        "knots/0/4",
        -1,
        "patches[0]: Patch, direction 1: BSpline.knots[4]: expected a knot of at least 0.5, got -1",
    ),
    "29 too long": (
        "knots/1",
        [0, 0, 0.5, 1, 1],
        "patches[0].control: expected 4 rows of 3 points",
    ),
    "29 too short": ("knots/1", [0, 0, 1], "patches[0]: Patch, direction 2: "),
    "29 inner multiplicity": (
        "knots/0",
        [0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1],
        "patches[0]: Patch, direction 1: ",
    ),
    "29 not open": ("knots/1", [0, 0.5, 1, 2], "patches[0]: Patch.knots2: expected open knots"),
    "30 weight zero": (
        "weights",
        [[1, 1], [1, 0], [1, 1], [1, 1]],
        "patches[0]: Patch.weights[1, 1]: expected a positive number, got 0",
    ),
    "30 weight negative": (
        "weights",
        [[1, -1], [1, 1], [1, 1], [1, 1]],
        "patches[0]: Patch.weights[0, 1]: expected a positive number",
    ),
    "30 too few weights": (
        "weights",
        [[1, 1]],
        "patches[0]: Patch.weights: expected shape (4, 2), one for each function",
    ),
    "30 a side in one point": (
        "control",
        [[[x, y * x / 2, 0] for y in (0, 1)] for x in (0, 0.5, 1.5, 2)],
        "roof.json: patch: expected sides longer than zero, got xi1_min, which is the point (0, 0, 0)",
    ),
    "30 all in one point": (
        "control",
        [[[0, 0, 0]] * 2] * 4,
        "roof.json: patch: expected cells with an area, got cell 0 about (0, 0, 0)",
    ),
    "30 all on one line": (
        "control",
        [[[x, 0, 0]] * 2 for x in range(4)],
        "roof.json: patch: expected cells with an area, got cell 0 about",
    ),
}


@pytest.mark.parametrize("row", PATCHES)
def test_rows_29_and_30_patches(row: str, tmp_path: Path) -> None:
    key, value, found = PATCHES[row]
    refused(shell(tmp_path, strip(key, value)), "scene.yaml:3: bodies.roof: ", "roof.json", found)


# ------------------------------------------------------------------------------------------------------------------ 22: repair
def test_row_22_repair_of_a_plate(tmp_path: Path) -> None:
    """Two squares exported side by side become one plate of two cells; a cell whose ends coincide
    is dropped; rho t A stays.
    """
    points = [*SQUARE, (1, 0), (2, 0), (2, 1), (1, 1), (2, 0), (2, 1)]
    text = msh(points, [*quads((1, 2, 3, 4), (5, 6, 7, 8), (6, 9, 10, 7)), "1 2 9 9 1 4"], LEFT)
    path = plate(tmp_path, text)
    refused(path, "cells with sides longer than zero")
    with pytest.warns(Notice) as told:
        part = build.system(scenes.read(path, repair=True))
    assert [str(notice.message).split("a.msh: ")[1] for notice in told] == [
        "4 nodes at the place of another one are merged with it",
        "1 cells without size are dropped, the first is cell 3",
    ]
    assert part.size == 6 * 3 * 2
    field = np.tile([1.0, 0, 0, 0, 0, 0], 6)
    assert field @ (part.mass @ field) == pytest.approx(2700 * 0.01 * 2.0, rel=1e-12)


def test_row_22_repair_of_a_line(tmp_path: Path) -> None:
    text = msh(
        [(0, 0), (0.5, 0), (0.5, 1e-12), (1, 0)],
        [*POINTS[:1], "15 2 2 2 4", *lines((1, 2), (2, 3), (3, 4))],
        NAMES,
    )
    path = beam(tmp_path, BEAM, text)
    refused(path, "cells longer than zero")
    scene = scenes.read(path, repair=True)
    with pytest.warns(Notice) as told:
        repaired = build.system(scene)
    assert [str(notice.message).split(": ")[1][:8] for notice in told] == ["1 nodes ", "1 cells "]
    beam(tmp_path, BEAM, msh(LINE, [*POINTS, *lines((1, 2), (2, 3))], NAMES))
    assert np.array_equal(repaired.x0, build.system(scenes.read(path)).x0)
    assert scene.again({"load": 1.0}).repair


def test_row_22_repair_by_the_command(tmp_path: Path) -> None:
    text = msh(
        [(0, 0), (0.5, 0), (0.5, 1e-12), (1, 0)],
        [*POINTS[:1], "15 2 2 2 4", *lines((1, 2), (2, 3), (3, 4))],
        NAMES,
    )
    path = beam(tmp_path, BEAM, text)
    assert fmbs("check", path).code == 3
    done = fmbs("check", path, "--repair", "--json")
    assert done.code == 0
    assert [text.split(": ")[-1][:8] for text in done.json["notices"]] == ["1 nodes ", "1 cells "]


def test_row_22_what_repair_leaves(tmp_path: Path) -> None:
    """Meshes without nodes at one place come out as they are; a quad that becomes a triangle is
    still refused.
    """
    text = msh(SQUARE, quads((1, 2, 3, 4)))
    file = tmp_path / "a.msh"
    file.write_text(text)
    assert plate_meshes.read(file, planar=True, repair=True).cells.tolist() == [[0, 1, 2, 3]]
    file.write_text(msh([*SQUARE[:3], (1, 1)], quads((1, 2, 3, 4))))
    with (
        pytest.warns(Notice),
        pytest.raises(
            InputError, match=r"different vertices, got cell 1 with nodes \[1, 2, 3, 3\]"
        ),
    ):
        plate_meshes.read(file, planar=True, repair=True)
