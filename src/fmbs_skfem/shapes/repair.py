"""Meshes whose parts were exported side by side: nodes at one place become one, and cells that this
leaves no size are dropped.

nodes i, j with |x_i - x_j| <= CLOSE extent, or linked by a chain of such pairs  ->  the first of
them in the file
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csgraph

from ..core.algebra.linalg import distinct
from ..core.notices import remark
from .msh import Ints, MshCells, Raw

CLOSE = 1e-9  #: of the extent: nodes nearer than this are at one place


def merge_points(raw: Raw, where: str) -> Raw:
    """The mesh with one node a place; notices say how many nodes and cells are gone, the audit what
    is still wrong.
    """
    from scipy.spatial import cKDTree

    finite = np.flatnonzero(np.isfinite(raw.points).all(axis=1))
    points = raw.points[finite]
    if len(distinct(raw.numbers)) < len(raw.numbers) or len(points) < 2:
        return raw
    with np.errstate(over="ignore"):
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    pairs = (
        cKDTree(points).query_pairs(CLOSE * extent, output_type="ndarray")
        if np.isfinite(extent)
        else np.zeros((0, 2), int)
    )
    if not len(pairs):
        return raw
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    _, same = csgraph.connected_components(links, directed=False)
    _, first = np.unique(same, return_index=True)
    stays = raw.numbers.copy()
    stays[finite] = raw.numbers[finite[first[same]]]
    order = np.argsort(raw.numbers, kind="stable")

    def renamed(numbers: Ints) -> Ints:
        at = order[np.minimum(np.searchsorted(raw.numbers, numbers, sorter=order), len(order) - 1)]
        return np.where(raw.numbers[at] == numbers, stays[at], numbers)

    remark(
        f"{where}: {int((stays != raw.numbers).sum())} nodes at the place of another one are merged with it"
    )
    return replace(
        raw,
        points=raw.points[stays == raw.numbers],
        numbers=raw.numbers[stays == raw.numbers],
        point_groups={name: distinct(renamed(ids)) for name, ids in raw.point_groups.items()},
        lines=_without_collapsed(raw.lines, renamed(raw.lines.nodes), where),
        triangles=_without_collapsed(raw.triangles, renamed(raw.triangles.nodes), where),
        quads=_without_collapsed(raw.quads, renamed(raw.quads.nodes), where),
        others={
            kind: replace(part, nodes=renamed(part.nodes)) for kind, part in raw.others.items()
        },
    )


def _without_collapsed(part: MshCells, nodes: Ints, where: str) -> MshCells:
    """Cells with new nodes, without those of which fewer vertices are left than a line or a
    triangle has.
    """
    ordered = np.sort(nodes, axis=1)
    left = 1 + np.count_nonzero(np.diff(ordered, axis=1), axis=1)
    kept = left >= min(nodes.shape[1], 3)
    if not kept.all():
        remark(
            f"{where}: {int((~kept).sum())} cells without size are dropped, the first is cell {part.numbers[~kept][0]}"
        )
    place = np.cumsum(kept) - 1
    groups = {name: place[rows[kept[rows]]] for name, rows in part.groups.items()}
    return MshCells(nodes[kept], part.numbers[kept], groups)
