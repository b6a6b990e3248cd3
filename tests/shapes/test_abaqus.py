"""Abaqus files: instances, sets, element types, and what is refused, in small files of our own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import meshes, plate_meshes

PART = """\
*Part, name=Rod
*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
** a comment, and a line without its last coordinates
 3, 3.
*Element, type=B31, elset=All
 10, 1, 2
 20, 2, 3
*Nset, nset=Left
 1,
*End Part
"""
FLAT = "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 2., 0.\n4, 3., 0.\n*ELEMENT, TYPE=T3D2\n1, 1, 2\n2, 2, 3\n3, 3, 4\n"


def read(folder: Path, text: str) -> meshes.LineMesh:
    path = folder / "rod.inp"
    path.write_text(text)
    return meshes.read(path)


def test_an_instance_is_moved_and_then_turned(tmp_path: Path) -> None:
    """By 90 degrees about an axis parallel to z through (5, 0, 0), after a translation: x -> R (x +
    t - a) + a.
    """
    text = "*Assembly, name=A\n*Instance, name=Rod-1, part=ROD\n 5., 2., 1.\n 5., 0., 0., 5., 0., 7., 90.\n*End Instance\n"
    found = read(
        tmp_path,
        PART
        + text
        + "*Nset, nset=Tip, instance=rod-1\n 3,\n*Nset, nset=Both\n Rod-1.2, Tip\n*End Assembly\n",
    )
    np.testing.assert_allclose(found.points, [[3, 0, 1], [3, 1, 1], [3, 3, 1]], atol=1e-15)
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {
        "Left": [0],
        "Tip": [2],
        "Both": [1, 2],
    }
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"All": [0, 1]}


def test_instances_of_one_part_each_have_its_sets(tmp_path: Path) -> None:
    text = "*Assembly, name=A\n*Instance, name=I, part=Rod\n*End Instance\n*Instance, name=J, part=Rod\n0., 4.\n*End Instance\n"
    found = read(tmp_path, PART + text + "*Nset, nset=Ends\n I.Left, J.Left\n*End Assembly\n")
    np.testing.assert_allclose(found.points[:, 0], [0, 1, 3, 0, 1, 3])
    np.testing.assert_allclose(found.points[:, 1], [0, 0, 0, 4, 4, 4])
    assert {name: ids.tolist() for name, ids in found.point_groups.items()} == {
        "Ends": [0, 3],
        "I.Left": [0],
        "J.Left": [3],
    }
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {
        "I.All": [0, 1],
        "J.All": [2, 3],
    }


def test_parts_without_an_assembly_stand_where_their_nodes_are(tmp_path: Path) -> None:
    np.testing.assert_allclose(read(tmp_path, PART).points[:, 0], [0, 1, 3])


def test_a_part_without_an_instance_is_not_there(tmp_path: Path) -> None:
    text = (
        PART.replace("name=Rod", "name=Other")
        + PART
        + "*Assembly\n*Instance, name=I, part=Rod\n*End Instance\n*End Assembly\n"
    )
    with pytest.warns(Notice, match="part OTHER has no instance in the assembly, and is left out"):
        assert len(read(tmp_path, text).points) == 3


def test_sets_add_up(tmp_path: Path) -> None:
    """Given twice, as ranges, of sets in any case, on the cards of nodes and elements, and of the
    nodes of elements.
    """
    cards = {
        "*NSET, NSET=a\n1\n*NSET, NSET=A\n3, 4\n": {"a": [0, 2, 3]},
        "*NSET, NSET=a, GENERATE\n1, 4, 2\n4, 9\n": {"a": [0, 2, 3]},
        "*NSET, NSET=a\n1\n*NSET, NSET=b\n3\n*NSET, NSET=c\nA, b, 4\n": {
            "a": [0],
            "b": [2],
            "c": [0, 2, 3],
        },
        "*ELSET, ELSET=e\n1\n*ELSET, ELSET=e\n2\n*NSET, NSET=n, ELSET=E\n": {"n": [0, 1, 2]},
        "*NODE, NSET=more\n5, 4., 0.\n*ELEMENT, TYPE=B31, ELSET=x\n4, 4, 5\n*NSET, NSET=more,\nUNSORTED\n1,\n": {
            "more": [0, 4]
        },
    }
    for text, wanted in cards.items():
        found = read(tmp_path, FLAT + text)
        assert {name: ids.tolist() for name, ids in found.point_groups.items()} == wanted, text
    found = read(
        tmp_path,
        FLAT
        + "*ELSET, ELSET=one, GENERATE\n1, 2, 1\n*ELSET, ELSET=two\n3,\n*ELSET, ELSET=all\none, two\n",
    )
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {
        "one": [0, 1],
        "two": [2],
        "all": [0, 1, 2],
    }


def test_elements_of_other_kinds_are_left_out(tmp_path: Path) -> None:
    """A mass and a spring, whose sets may be named; a beam with a node that gives its direction; a
    row over two lines.
    """
    text = (
        FLAT
        + "*NODE\n9, 0., 5.\n*ELEMENT, TYPE=MASS, ELSET=m\n7, 3\n*ELEMENT, TYPE=SPRINGA\n8, 1, 2\n*ELSET, ELSET=s\n8, 1\n"
    )
    with pytest.warns(Notice) as said:
        found = read(tmp_path, text + "*NODE\n5, 4., 0.\n*ELEMENT, TYPE=B31\n4, 4,\n5, 9\n")
    assert any(
        "no lines, plates or solids are left out: 1 of type MASS, 1 of type SPRINGA"
        in str(one.message)
        for one in said
    )
    assert found.cells.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]
    assert {name: ids.tolist() for name, ids in found.line_groups.items()} == {"s": [0]}


@pytest.mark.parametrize(
    "kind,corners",
    [("S4R", 4), ("CPS4", 4), ("S4R5", 4), ("M3D4R", 4), ("S3", 3), ("STRI3", 3), ("CPE3", 3)],
)
def test_elements_of_surfaces(kind: str, corners: int, tmp_path: Path) -> None:
    cells = "1, 1, 2, 3, 4\n" if corners == 4 else "1, 1, 2, 3\n2, 1, 3, 4\n"
    path = tmp_path / "plate.inp"
    path.write_text(
        f"*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n*ELEMENT, TYPE={kind}, ELSET=all\n{cells}"
    )
    found = plate_meshes.read(path, planar=True)
    assert found.cells.shape == (5 - corners, corners)
    assert list(found.face_groups) == ["all"]


#: two squares side by side, numbered so that their first sides differ
SHEET = (
    "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 2., 0.\n4, 0., 1.\n5, 1., 1.\n6, 2., 1.\n"
    "*ELEMENT, TYPE={kind}, ELSET=all\n7, 1, 2, 5, 4\n8, 3, 6, 5, 2\n*ELSET, ELSET=first\n7\n"
)


@pytest.mark.parametrize(
    "kind,cards,edges",
    [
        ("S4R", "*SURFACE, NAME=s\nfirst, E4\n", [[0, 3]]),
        ("S4R", "*SURFACE, NAME=s, TYPE=ELEMENT\n7, e1\n8, E4\n", [[0, 1], [1, 2]]),
        ("M3D4", "*SURFACE, NAME=s\nall, E1\n", [[0, 1], [2, 5]]),
        ("S4", "*SURFACE, NAME=s\nall, E3\n", [[3, 4]]),  # the other one is inside
        ("CPS4", "*SURFACE, NAME=s\nfirst, S4\n*SURFACE, NAME=S\n8, S1\n", [[0, 3], [2, 5]]),
        ("CPE4", "*SURFACE, NAME=s\nfirst\n", [[0, 1], [0, 3], [3, 4]]),
        ("CPS4", "*SURFACE, NAME=s\nlater, S4\n*ELSET, ELSET=later\n7\n", [[0, 3]]),
        ("S4", "*NSET, NSET=s\n3, 6\n*SURFACE, NAME=s\n7, E4\n", [[0, 3], [2, 5]]),
        ("S4", "*SURFACE, NAME=s\nall, SPOS\n", []),
    ],
)
def test_sides_of_elements_are_edges(
    kind: str, cards: str, edges: list[list[int]], tmp_path: Path
) -> None:
    """Of shells, membranes and plane elements; faces of shells are no edges."""
    path = tmp_path / "plate.inp"
    path.write_text(SHEET.format(kind=kind) + cards)
    found = plate_meshes.read(path, planar=True).edge_groups
    assert sorted(np.sort(found.pop("s", np.zeros((0, 2), int))).tolist()) == edges
    assert not found


def test_sides_of_instances_are_edges(tmp_path: Path) -> None:
    """As Abaqus/CAE writes them: an internal set of an instance, and its surface in the assembly."""
    text = f"*Part, name=P\n{SHEET.format(kind='S4R')}*End Part\n*Assembly, name=A\n*Instance, name=P-1, part=P\n*End Instance\n"
    text += "*Elset, elset=_Surf-1_E1, internal, instance=P-1\n 8,\n*Surface, type=ELEMENT, name=Surf-1\n_Surf-1_E1, E1\n"
    path = tmp_path / "plate.inp"
    path.write_text(text + "*End Assembly\n")
    assert np.sort(plate_meshes.read(path, planar=True).edge_groups["Surf-1"]).tolist() == [[2, 5]]


@pytest.mark.parametrize(
    "kind,card,said",
    [
        (
            "S4",
            "NAME=s\nall, S4\n",
            "line 14: surface 's' is read without S4 of elements of type S4 (sides are E1 to E4)",
        ),
        (
            "CPS4",
            "NAME=s\nall, E1\n",
            "line 14: surface 's' is read without E1 of elements of type CPS4 (sides are S1 to S4)",
        ),
        ("S4", "NAME=s, TYPE=NODE\n1\n", "line 13: surface 's' is left out: NAME=s, TYPE=NODE"),
    ],
)
def test_surfaces_that_are_not_read_are_named(
    kind: str, card: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "plate.inp"
    path.write_text(SHEET.format(kind=kind) + "*SURFACE, " + card)
    with pytest.warns(Notice) as notices:
        plate_meshes.read(path, planar=True)
    assert any(said in str(one.message) for one in notices)


@pytest.mark.parametrize(
    "text,said",
    [
        (
            "*SURFACE, NAME=s\nnone, E1\n",
            "line 11: expected numbers and sets .* in the set 's', got 'none'",
        ),
        (
            "*INCLUDE, INPUT=more.inp\n",
            "line 10: expected nodes, elements and sets written out, got .INCLUDE INPUT=more.inp",
        ),
        ("*NGEN\n1, 4, 1\n", "line 10: expected nodes, elements and sets written out, got .NGEN"),
        ("*SYSTEM\n0, 0, 0\n", "got .SYSTEM"),
        (
            "*NODE, SYSTEM=C\n5, 1., 90.\n",
            "line 10: expected nodes in rectangular coordinates, got SYSTEM=C",
        ),
        ("*NODE\n4, 1., 90.\n", "line 11: expected each node once, got node 4 again"),
        (
            "*NODE\n99999999999999999999, 1.\n",
            "line 11: expected a whole number, got '99999999999999999999'",
        ),
        (
            "*ELEMENT, TYPE=B31\n3, 1, 3\n",
            "line 11: expected each element once, got element 3 again",
        ),
        (
            "*ELEMENT, TYPE=B31\n4, 1\n",
            "line 11: expected a number and 2 nodes of an element of type B31, got 2 numbers",
        ),
        (
            "*ELEMENT, TYPE=B31\n4, 1, 8\n",
            "expected elements on nodes of their part or instance, got node 8 in element 4",
        ),
        ("*NSET, NSET=a\n7\n", "line 10: expected nodes of the part in the set 'a', got 7"),
        (
            "*NSET, NSET=a\nb\n",
            "line 10: expected numbers and sets that stand before it in the set 'a', got 'b'",
        ),
        (
            "*NSET, NSET=a, GENERATE\n4, 1\n",
            "line 11: expected a first number, a last one and a step, got 4, 1",
        ),
        (
            "*NSET, NSET=a, INSTANCE=I\n1\n",
            "line 10: expected an instance of the assembly, got 'I'",
        ),
        (
            "*INSTANCE, NAME=I, PART=P\n",
            "line 10: expected an instance of a part of the file, got 'P'",
        ),
        (
            "*PART, NAME=P\n*END PART\n*INSTANCE, NAME=I, PART=P\n0, 0, 0, 0, 0, 1, 90\n",
            "line 13: expected a translation of 3",
        ),
        (
            "*INSTANCE, NAME=I, LIBRARY=old\n",
            "line 10: expected an instance of a part in the file, got one of NAME=I, LIBRARY=old",
        ),
    ],
)
def test_what_cannot_be_read_right_is_refused(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        read(tmp_path, FLAT + text)


def test_a_file_of_solids_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected cells of type line, got 1 tetra"):
        read(
            tmp_path,
            "*NODE\n1, 0.\n2, 1.\n3, 0., 1.\n4, 0., 0., 1.\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n",
        )
