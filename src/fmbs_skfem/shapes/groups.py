"""Named groups of nodes, sides and cells of a flat mesh as the named places of a `Surface`.

point group    node ids (i,)          cell and parent coordinates of a vertex; several nodes are called `name[0]`, `name[1]`, ..
edge group     node pairs (i, 2)      cell and side; a side between two cells belongs to the first
face group     cell ids (i,)
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from . import plate_audit
from .surface import VERTICES, Parent
from .table import Floats, Ints

Groups = Mapping[str, ArrayLike]
Named = tuple[dict[str, tuple[int, float, float]], dict[str, Ints], dict[str, Ints]]


def ids(where: str, values: ArrayLike, count: int, columns: int = 0) -> Ints:
    """Whole numbers from 0 to count - 1, (i,) or (i, columns), at least one."""
    array = np.asarray(values)
    shape = (len(array), columns) if columns and array.ndim else (array.size,)
    if not array.size or not np.issubdtype(array.dtype, np.integer) or array.shape != shape:
        wanted = (
            f"whole numbers of shape (i, {columns})" if columns else "whole numbers of shape (i,)"
        )
        raise InputError(
            say(where, wanted, f"{array.dtype} of shape {array.shape}", "look into the mesh")
        )
    wrong = (array < 0) | (array >= count)
    if wrong.any():
        raise InputError(
            say(where, f"numbers from 0 to {count - 1}", f"{array[wrong][0]}", "look into the mesh")
        )
    return array.astype(np.int64)


def list_numbers(numbers: Ints) -> str:
    """The first numbers of a list."""
    return ", ".join(map(str, numbers[:5])) + (
        f", .. ({len(numbers)} in all)" if len(numbers) > 5 else ""
    )


def flat_mesh(
    where: str, points: ArrayLike, cells: ArrayLike, parent: Parent
) -> tuple[Floats, Ints]:
    """Finite points (n, 2), each of them a vertex of a cell, and cells (e, 3 or 4)."""
    places = np.asarray(points, dtype=float)
    if places.ndim != 2 or places.shape[1] != 2 or not np.isfinite(places).all():
        got = f"shape {places.shape}" + (
            "" if np.isfinite(places).all() else " with NaN or infinity"
        )
        raise InputError(
            say(
                f"{where}: points",
                "finite points (n, 2)",
                got,
                "a flat plate has no third coordinate",
            )
        )
    numbers = ids(f"{where}: cells", cells, len(places), columns=int(parent))
    unused = np.setdiff1d(np.arange(len(places)), numbers)
    if unused.size:
        raise InputError(
            say(
                f"{where}: points",
                "nodes that belong to cells",
                f"unused nodes {list_numbers(unused)}",
                "remove them",
            )
        )
    return places, numbers


def require_sides(where: str, pairs: Ints, found: np.ndarray) -> None:
    """Refuse pairs of nodes (i, 2) that are not `found` (i,) among the sides of cells."""
    if not found.all():
        a, b = pairs[np.argmin(found)]
        remedy = "give pairs of neighbouring nodes of one mesh"
        raise InputError(say(where, "edges of cells", f"no cell with the side {a}, {b}", remedy))


def check_groups(
    cells: Ints, points: Groups | None, edges: Groups | None, faces: Groups | None
) -> Named:
    """Points, edges and faces of a `Surface` on cells whose nodes are numbered from 0 on without
    gaps.
    """
    count = int(cells.max()) + 1
    corners = VERTICES[Parent(cells.shape[1])]
    named_points, named_edges = {}, {}
    _, first = np.unique(cells, return_index=True)
    for name, values in (points or {}).items():
        at = first[ids(f"point group {name!r}", values, count)]
        for i, (cell, vertex) in enumerate(zip(*np.divmod(at, cells.shape[1]), strict=True)):
            x, y = corners[vertex]
            named_points[name if len(at) == 1 else f"{name}[{i}]"] = (int(cell), float(x), float(y))
    keys, first = np.unique(
        plate_audit.side_keys(plate_audit.sides(cells), count), return_index=True
    )
    for name, values in (edges or {}).items():
        where = f"edge group {name!r}"
        pairs = ids(where, values, count, columns=2)
        wanted = plate_audit.side_keys(pairs, count)
        require_sides(where, pairs, np.isin(wanted, keys))
        named_edges[name] = np.column_stack(
            np.divmod(first[np.searchsorted(keys, wanted)], cells.shape[1])
        )
    return (
        named_points,
        named_edges,
        {n: ids(f"face group {n!r}", v, len(cells)) for n, v in (faces or {}).items()},
    )
