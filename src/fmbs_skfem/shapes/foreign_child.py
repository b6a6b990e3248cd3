"""The process that reads a mesh by meshio: `python -P foreign_child.py SOURCE TARGET.vtu`; it imports nothing of this package.

Named sets, and the families of MED, become integer arrays of zeros and ones, which are the groups of `vtu`. A set of nodes along
the boundary of a surface, by which Abaqus names an edge, also becomes line cells.
"""

from __future__ import annotations

import sys
from typing import Any

import meshio
import numpy as np


def main(source: str, target: str) -> None:
    """Read one file and write the other."""
    mesh = meshio.read(source)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    cells, marks = with_edges(mesh, cell_marks(mesh))
    out = meshio.Mesh(points, cells, point_marks(mesh), marks)
    meshio.write(target, out, file_format="vtu")


def point_marks(mesh: Any) -> dict[str, np.ndarray]:
    """Sets of points and integer arrays."""
    found = {name: values for name, values in mesh.point_data.items() if wanted(name, values)}
    for name, ids in mesh.point_sets.items():
        if ":" not in name:
            found[name] = np.zeros(len(mesh.points), dtype=np.int8)
            found[name][np.asarray(ids, dtype=np.int64)] = 1
    tags = mesh.point_data.get("point_tags")
    for name, numbers in families(mesh, "point_tags") if tags is not None else ():
        found[name] = np.isin(tags, numbers).astype(np.int8)
    return found


def cell_marks(mesh: Any) -> dict[str, list[np.ndarray]]:
    """Sets of cells and integer arrays, by block of cells."""
    found = {name: values for name, values in mesh.cell_data.items() if all(wanted(name, one) for one in values)}
    for name, blocks in mesh.cell_sets.items():
        if ":" not in name:
            found[name] = [mark(len(block.data), ids) for block, ids in zip(mesh.cells, blocks, strict=True)]
    tags = mesh.cell_data.get("cell_tags")
    for name, numbers in families(mesh, "cell_tags") if tags is not None else ():
        found[name] = [np.isin(one, numbers).astype(np.int8) for one in tags]
    return found


def with_edges(mesh: Any, marks: dict[str, list[np.ndarray]]) -> tuple[list[Any], dict[str, list[np.ndarray]]]:
    """Cells and their marks, with line cells between nodes of a set that are neighbours on the boundary of the surface."""
    cells, outline = [(block.type, block.data) for block in mesh.cells], boundary(mesh)
    for name, ids in mesh.point_sets.items():
        sides = outline[np.isin(outline, np.asarray(ids, dtype=np.int64)).all(axis=1)]
        if len(sides) and ":" not in name:
            own = marks.get(name) or [np.zeros(len(data), dtype=np.int8) for _, data in cells]
            marks = {other: [*blocks, np.zeros(len(sides), dtype=np.int8)] for other, blocks in marks.items()}
            marks[name] = [*own, np.ones(len(sides), dtype=np.int8)]
            cells = [*cells, ("line", sides)]
    return cells, marks


def boundary(mesh: Any) -> np.ndarray:
    """Sides (i, 2) of triangles and quadrilaterals that have one cell only."""
    corners = [block.data[:, : 3 if block.type.startswith("tri") else 4] for block in mesh.cells if block.dim == 2]
    sides = [np.stack([each, np.roll(each, -1, axis=1)], axis=2).reshape(-1, 2) for each in corners]
    found, count = np.unique(np.sort(np.concatenate([np.empty((0, 2), int), *sides]), axis=1), axis=0, return_counts=True)
    return np.asarray(found[count == 1])


def families(mesh: Any, kind: str) -> list[tuple[str, list[int]]]:
    """Names of the groups of MED, each with the numbers of its families."""
    known: dict[str, list[int]] = {}
    for number, names in getattr(mesh, kind, {}).items():
        for name in names:
            known.setdefault(name, []).append(number)
    return list(known.items())


def mark(count: int, ids: Any) -> np.ndarray:
    """Ones at some of `count` places."""
    found = np.zeros(count, dtype=np.int8)
    if ids is not None:
        found[np.asarray(ids, dtype=np.int64)] = 1
    return found


def wanted(name: str, values: Any) -> bool:
    """Whether an array may be a group: whole numbers, and none of meshio's own."""
    return bool(np.issubdtype(np.asarray(values).dtype, np.integer)) and ":" not in name and not name.endswith("_tags")


if __name__ == "__main__":
    main(*sys.argv[1:])
