"""A mesh on its way from the process that reads a foreign file to the one that asked for it: arrays
in a `.npz`.
"""

from __future__ import annotations

import json
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.storage.records import dataclass

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Groups = dict[str, Ints]


@dataclass(frozen=True, eq=False)
class Mesh:
    """What a file says; kinds of cells have meshio's names (`line`, `triangle`, `quad`, `line3`,
    ...).
    """

    points: Floats  #: (n,3) in the file's unit
    numbers: Ints  #: (n,) node numbers of the file, or places where those come twice
    cells: dict[str, Ints]  #: kind -> (e,b) rows of `points`
    cell_numbers: dict[str, Ints]  #: kind -> (e,) cell numbers of the file
    point_groups: Groups = field(default_factory=dict)  #: name -> (i,) rows of `points`
    #: kind -> name -> (i,) rows of its cells
    cell_groups: dict[str, Groups] = field(default_factory=dict)
    #: Young's modulus, Poisson's ratio and density of groups of solid cells
    materials: dict[str, list[float]] = field(default_factory=dict)


def save(mesh: Mesh, path: Path) -> None:
    """Write a mesh; names are JSON, since those of files may hold any letter."""
    arrays: dict[str, NDArray[Any]] = {"points": mesh.points, "numbers": mesh.numbers}
    named = [("point", name, ids) for name, ids in mesh.point_groups.items()]
    named += [
        (kind, name, ids)
        for kind, groups in mesh.cell_groups.items()
        for name, ids in groups.items()
    ]
    for i, kind in enumerate(mesh.cells):
        arrays |= {f"cells{i}": mesh.cells[kind], f"cell_numbers{i}": mesh.cell_numbers[kind]}
    arrays |= {f"group{i}": ids for i, (_, _, ids) in enumerate(named)}
    head = json.dumps(
        {
            "kinds": list(mesh.cells),
            "groups": [[kind, name] for kind, name, _ in named],
            "materials": mesh.materials,
        }
    )
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, head=np.frombuffer(head.encode(), np.uint8), **arrays)


def load(path: Path) -> Mesh:
    """The mesh that `save` wrote."""
    with np.load(path, allow_pickle=False) as data:
        head = json.loads(data["head"].tobytes())
        kinds: list[str] = head["kinds"]
        found: dict[str, Groups] = {kind: {} for kind in ("point", *kinds)}
        for i, (kind, name) in enumerate(head["groups"]):
            found[kind][name] = data[f"group{i}"]
        cells = {kind: data[f"cells{i}"] for i, kind in enumerate(kinds)}
        numbers = {kind: data[f"cell_numbers{i}"] for i, kind in enumerate(kinds)}
        points = found.pop("point")
        return Mesh(
            data["points"], data["numbers"], cells, numbers, points, found, head["materials"]
        )


def gathered(
    points: Floats,
    numbers: Ints,
    cells: list[tuple[str, Ints, Ints]],
    point_groups: Groups,
    cell_groups: Groups,
) -> Mesh:
    """A mesh of blocks (kind, rows of points (e,b), numbers (e,)) and groups of cells counted
    through all blocks.

    A group of cells belongs to the kinds that it has members of, one without members to all kinds.
    """
    kinds = list(dict.fromkeys(kind for kind, _, _ in cells))
    starts = np.cumsum([0, *(len(rows) for _, rows, _ in cells)])
    place = np.zeros(starts[-1], np.int64)  # of a cell among those of its kind
    of = np.zeros(starts[-1], np.int64)  # its kind
    counted = dict.fromkeys(kinds, 0)
    for (kind, rows, _), start in zip(cells, starts, strict=False):
        place[start : start + len(rows)] = counted[kind] + np.arange(len(rows))
        of[start : start + len(rows)] = kinds.index(kind)
        counted[kind] += len(rows)
    groups: dict[str, Groups] = {kind: {} for kind in kinds}
    for name, ids in cell_groups.items():
        for i, kind in enumerate(kinds):
            members = place[ids[of[ids] == i]]
            if len(members) or not len(ids):
                groups[kind][name] = members
    return Mesh(
        points,
        numbers if len(np.unique(numbers)) == len(numbers) else np.arange(1, len(points) + 1),
        {kind: np.concatenate([rows for k, rows, _ in cells if k == kind]) for kind in kinds},
        {kind: np.concatenate([ids for k, _, ids in cells if k == kind]) for kind in kinds},
        point_groups,
        groups,
    )
