"""Nastran bulk data `.bdf` and `.nas`: nodes, solid and surface cells, their properties as groups.

Cells with the property 7 are the group `pid_7`. MAT1 materials that PSOLID names come along, in the
units of the file. Fields are of 8 or 16 letters or parted by commas; a card goes on where a line
begins with a blank field, `+` or `*`. Nodes in coordinate systems of their own are refused. Source:
MSC Nastran Quick Reference Guide, GRID, CTETRA, CHEXA, CPENTA, PSOLID, MAT1.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..core.errors import InputError, say
from . import exchange
from .matrices import fields_of, real

#: card -> cells by their number of nodes
_KINDS = {
    "CTETRA": {4: "tetra", 10: "tetra10"},
    "CHEXA": {8: "hexahedron", 20: "hexahedron20"},
    "CPENTA": {6: "wedge", 15: "wedge15"},
    "CPYRAM": {5: "pyramid", 13: "pyramid13"},
    "CTRIA3": {3: "triangle"},
    "CTRIA6": {6: "triangle6"},
    "CQUAD4": {4: "quad"},
    "CQUAD8": {8: "quad8"},
}
_SURFACES = {"CTRIA3": 3, "CQUAD4": 4, "CTRIA6": 6, "CQUAD8": 8}  #: behind whose nodes stand angles


def read(path: Path, target: Path, where: str) -> None:
    """Write the mesh of a file for `exchange.load`."""
    nodes: dict[int, list[float]] = {}
    cells: dict[str, list[tuple[int, int, list[int]]]] = {}
    solids: dict[int, int] = {}
    materials: dict[int, list[float]] = {}
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, card, fields in cards(file):
            try:
                if card == "GRID":
                    if (fields[1] or "0") != "0" or (fields[5:6] or [""])[0] not in ("", "0"):
                        remedy = "export nodes in the basic coordinate system"
                        got = f"coordinate system {fields[1]} of node {fields[0]}"
                        raise InputError(say(f"{where}: line {number}", "none", got, remedy))
                    nodes[int(fields[0])] = [real(one) if one else 0.0 for one in fields[2:5]]
                elif card in _KINDS:
                    corners = [int(one) for one in fields[2 : 2 + _SURFACES.get(card, 99)] if one]
                    kind = _KINDS[card].get(len(corners))
                    if kind is None:
                        expected = f"{' or '.join(map(str, _KINDS[card]))} nodes of a {card}"
                        raise InputError(
                            say(f"{where}: line {number}", expected, f"{len(corners)}")
                        )
                    cells.setdefault(kind, []).append((int(fields[0]), int(fields[1]), corners))
                elif card == "PSOLID":
                    solids[int(fields[0])] = int(fields[1])
                elif card == "MAT1":
                    E, _, nu, rho = (real(one) if one else 0.0 for one in [*fields, "", ""][1:5])
                    materials[int(fields[0])] = [E, nu, rho]
            except (ValueError, IndexError) as problem:
                got = f"{card} {', '.join(fields)} ({problem})"
                raise InputError(say(f"{where}: line {number}", "numbers of a card", got)) from None
    if not nodes or not cells:
        raise InputError(say(where, "GRID and CTETRA, CHEXA or other cells", "none"))
    exchange.save(_mesh(nodes, cells, solids, materials, where), target)


def _mesh(
    nodes: dict[int, list[float]],
    cells: dict[str, list[tuple[int, int, list[int]]]],
    solids: dict[int, int],
    materials: dict[int, list[float]],
    where: str,
) -> exchange.Mesh:
    """The mesh of what cards say."""
    place = {number: k for k, number in enumerate(nodes)}
    blocks = []
    properties: list[int] = []
    for kind, found in cells.items():
        for number, _, corners in found:
            if missing := [one for one in corners if one not in place]:
                got = f"node {missing[0]} of cell {number}"
                raise InputError(say(where, "cells on nodes of the file", got, "export it again"))
        rows = np.array([[place[one] for one in corners] for *_, corners in found], np.int64)
        blocks.append((kind, rows, np.array([number for number, *_ in found], np.int64)))
        properties += [of for _, of, _ in found]
    of = np.array(properties)
    groups = {f"pid_{one}": np.flatnonzero(of == one) for one in np.unique(of).tolist()}
    points = np.array(list(nodes.values()))
    mesh = exchange.gathered(points, np.array(list(nodes), np.int64), blocks, {}, groups)
    for one in np.unique(of).tolist():
        if solids.get(one) in materials:
            mesh.materials[f"pid_{one}"] = materials[solids[one]]
    return mesh


def cards(lines: Iterator[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Line number, name and fields of every card."""
    open_card: tuple[int, str, list[str]] | None = None
    for number, line in enumerate(lines, 1):
        text = line.split("$")[0].rstrip("\n")
        if not text.strip():
            continue
        more = text[0] in " +*,\t" and open_card is not None
        wide = "*" in text[:8]
        fields = fields_of(text)[: 4 if wide else 8]
        fields += [""] * ((4 if wide else 8) - len(fields))  # a card may go on behind them
        if more and open_card is not None:
            open_card[2].extend(fields)
            continue
        if open_card is not None:
            yield open_card
        name = text.split(",")[0][:8].rstrip("* ").upper()
        open_card = (number, name, fields)
    if open_card is not None:
        yield open_card
