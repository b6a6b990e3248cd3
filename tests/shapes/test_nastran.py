"""Nastran files of solids: cards in all forms, cells by property, one material."""

from __future__ import annotations

from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes.solids import solid, solid_meshes
from fmbs_skfem.shapes.solids.elements import Kind

from ..solids import HEXA, TETRA, box

#: of VTK, where Nastran has the nodes in the middle of the upright edges before those above
BRICK = [*range(12), *range(16, 20), *range(12, 16)]


def lines_of(kind: type, form: str) -> str:
    """A box with a triangle or square on its left end, in free, small or large fields."""
    mesh = box((2, 1, 1), kind=kind)
    out = ["$ a box", "BEGIN BULK"]

    def card(name: str, *values: object) -> None:
        texts = [
            f"{value:.9g}".replace("e-", "-") if isinstance(value, float) else str(value)
            for value in values
        ]
        if form == "free":
            rows = [texts[k : k + 8] for k in range(0, len(texts), 8)]
            out.extend(",".join([name if k == 0 else "+", *row]) for k, row in enumerate(rows))
            return
        width, count = (16, 4) if form == "large" else (8, 8)
        star = "*" if form == "large" else ""
        rows = [texts[k : k + count] for k in range(0, len(texts), count)]
        for k, row in enumerate(rows):
            first = (name + star if k == 0 else star or "+").ljust(8)
            out.append(first + "".join(text.ljust(width) for text in row).rstrip())

    for k, x in enumerate(mesh.reference.tolist()):
        card("GRID", k + 10, "", *(float(f"{one:.4g}") for one in x))
    order = BRICK if mesh.kind is Kind.HEXAHEDRON20 else range(10)
    for e, nodes in enumerate(mesh.nodes.tolist()):
        card("CTETRA" if kind is TETRA else "CHEXA", e + 1, 7, *(nodes[k] + 10 for k in order))
    face = solid.face_nodes(mesh, mesh.faces["left"][:1])[0].tolist()
    corners = 3 if kind is TETRA else 4
    name = "CTRIA3" if kind is TETRA else "CQUAD4"
    card(name, 900, 8, *(one + 10 for one in face[:corners]))
    card("PSOLID", 7, 3)
    card("MAT1", 3, 210e9, "", 0.3, 7850.0)
    return "\n".join([*out, "ENDDATA", ""])


@pytest.mark.parametrize("form", ["free", "small", "large"])
@pytest.mark.parametrize("kind", [TETRA, HEXA])
def test_cards_in_all_forms(tmp_path: Path, kind: type, form: str) -> None:
    path = tmp_path / "box.bdf"
    path.write_text(lines_of(kind, form), encoding="utf-8")
    mesh, found = box((2, 1, 1), kind=kind), solid_meshes.read(path)
    assert found.nodes.tolist() == mesh.nodes.tolist()
    assert_allclose(found.reference, mesh.reference, atol=1e-12)
    assert len(found.faces["pid_8"]) == 1
    assert sorted(found.volumes) == ["pid_7"]
    assert found.materials == {"pid_7": [210e9, 0.3, 7850.0]}


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("GRID,10,,", "GRID,10,4,", r"line 3: expected none, got coordinate system 4 of node 10"),
        ("CTETRA,1,7,", "CTETRA,1,7,,", "4 or 10 nodes of a CTETRA, got 9"),
        ("GRID,10,", "GRID,9999,", "cells on nodes of the file, got node 10"),
        ("MAT1,3,", "MAT1,x,", "numbers of a card, got MAT1 x"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, before: str, after: str, message: str) -> None:
    path = tmp_path / "box.bdf"
    text = lines_of(TETRA, "free")
    assert before in text
    path.write_text(text.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        solid_meshes.read(path)
