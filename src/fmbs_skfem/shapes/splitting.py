"""Mixed surface meshes made into ones of one kind of cells, before the audit.

    to triangles    every quad along its shorter diagonal; of two equal ones the one that rises with x
    to quads        every cell at its centre and the middles of its sides: three quads of a triangle, four of a quad

Both keep side to side what was so, and all groups. Middles of sides in a group that lies on a
circle are put on the circle, so that a round edge stays one (`ancf_plate.arcs_of`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core import errors
from ..core.notices import remark
from . import ancf_plate, meshes, plate_audit
from .msh import Floats, Ints, MshCells, Raw

EQUAL = 1e-9  #: relative difference of diagonals that are equally long


def uniform(raw: Raw, where: str, corners: int | None, face: str | None) -> Raw:
    """A mesh of quads alone or triangles alone: as it is, the kind that `face` is made of, or split
    into cells of `corners`.
    """
    if not (len(raw.triangles.nodes) and len(raw.quads.nodes)):
        return raw
    if face is not None and (only := _without_others(raw, face)):
        return only
    quads, triangles = len(raw.quads.nodes), len(raw.triangles.nodes)
    if corners is None:
        few = min(raw.triangles, raw.quads, key=lambda part: len(part.nodes))
        got = (
            f"{quads} quads and {triangles} triangles, among them cells {few.numbers[:4].tolist()}"
        )
        raise errors.InputError(
            errors.say(
                where, "all quads or all triangles", got, "recombine or split them before export"
            )
        )
    meshes.check_points(raw, where)
    made = _quads(raw, where) if corners == 4 else _triangles(raw, where)
    kind, count = (
        ("quads", len(made.quads.nodes))
        if corners == 4
        else ("triangles", len(made.triangles.nodes))
    )
    how = (
        "every cell is divided at its centre into"
        if corners == 4
        else "every quad is cut along its shorter diagonal, which makes"
    )
    remark(f"{where}: {quads} quads and {triangles} triangles: {how} {count} {kind}")
    return made


def _without_others(raw: Raw, face: str) -> Raw | None:
    """The mesh without its quads or without its triangles, where the cells of a face are all of the
    other kind.
    """
    quads, triangles = (len(part.groups.get(face, ())) > 0 for part in (raw.quads, raw.triangles))
    if quads == triangles:
        return None
    return replace(raw, triangles=_no_cells(3)) if quads else replace(raw, quads=_no_cells(4))


def _no_cells(corners: int) -> MshCells:
    return MshCells(np.zeros((0, corners), np.int64), np.zeros(0, np.int64), {})


def _triangles(raw: Raw, where: str) -> Raw:
    quads = meshes.rows(raw, raw.quads.nodes, where, "cells", raw.quads.numbers)
    plate_audit.check_corners(
        plate_audit.Subject(where, raw.points, quads, raw.numbers, raw.quads.numbers)
    )
    cut = np.take_along_axis(
        raw.quads.nodes[:, None, :], _corners(raw.points, quads), axis=2
    ).reshape(-1, 3)
    made = _together(raw.triangles, _children(raw.quads, cut, 2))
    return replace(raw, triangles=made, quads=_no_cells(4), kinds=raw.kinds | {"quad": 0})


def halves(points: Floats, quads: Ints) -> Ints:
    """Both triangles (e, 2, 3) of quads (e, 4), cut along the shorter diagonal."""
    return np.take_along_axis(quads[:, None, :], _corners(points, quads), axis=2)


def _corners(points: Floats, quads: Ints) -> Ints:
    """Vertices (e, 2, 3) of both triangles of quads; of two equal diagonals the one that rises with
    x cuts.
    """
    diagonals = points[quads[:, [2, 3]]] - points[quads[:, [0, 1]]]
    length = np.linalg.norm(diagonals, axis=2)
    rising = diagonals[..., 0] * diagonals[..., 1]
    equal = np.abs(length[:, 0] - length[:, 1]) <= EQUAL * length[:, 0]
    second = np.where(equal, rising[:, 1] > rising[:, 0], length[:, 1] < length[:, 0])
    return np.where(second[:, None, None], [[1, 2, 3], [1, 3, 0]], [[0, 1, 2], [0, 2, 3]])


def _quads(raw: Raw, where: str) -> Raw:
    parts = (raw.quads, raw.triangles)
    cells = [meshes.rows(raw, part.nodes, where, "cells", part.numbers) for part in parts]
    for part, own in zip(parts, cells, strict=True):
        plate_audit.check_corners(
            plate_audit.Subject(where, raw.points, own, raw.numbers, part.numbers)
        )
    lines = meshes.rows(raw, raw.lines.nodes, where, "lines", raw.lines.numbers)
    count = len(raw.points)
    sides = np.concatenate([plate_audit.sides(own).reshape(-1, 2) for own in cells])
    keys, first = np.unique(plate_audit.side_keys(sides, count), return_index=True)
    middles = _middles(raw, sides[first], keys, lines)
    centres, nodes = [], []
    begin = count + len(keys)
    for own in cells:
        _, one, same = np.unique(
            np.sort(own, axis=1), axis=0, return_index=True, return_inverse=True
        )
        centres.append(raw.points[own[one]].mean(axis=1))
        middle = count + np.searchsorted(keys, plate_audit.side_keys(plate_audit.sides(own), count))
        centre = np.broadcast_to((begin + same.ravel())[:, None], own.shape)
        nodes.append(
            np.stack([own, middle, centre, np.roll(middle, 1, axis=1)], axis=2).reshape(-1, 4)
        )
        begin += len(one)
    points = np.concatenate([raw.points, middles, *centres])
    numbers = np.concatenate([raw.numbers, raw.numbers.max() + 1 + np.arange(len(points) - count)])
    made = _together(
        *(
            _children(part, numbers[own], part.nodes.shape[1])
            for part, own in zip(parts, nodes, strict=True)
        )
    )
    return replace(
        raw,
        points=points,
        numbers=numbers,
        lines=_halves(raw.lines, lines, keys, count, numbers),
        triangles=_no_cells(3),
        quads=made,
        kinds=raw.kinds | {"triangle": 0},
    )


def _middles(raw: Raw, sides: Ints, keys: Ints, lines: Ints) -> Floats:
    """Middles (i, 3) of sides (i, 2), on the circle where a group of sides lies on one."""
    middles = raw.points[sides].mean(axis=1)
    wanted = plate_audit.side_keys(lines, len(raw.points))
    known = {
        name: lines[rows[np.isin(wanted[rows], keys)]] for name, rows in raw.lines.groups.items()
    }
    planar = raw.points[:, :2]
    for arc in ancf_plate.arcs_of(
        planar, {name: pairs for name, pairs in known.items() if len(pairs)}
    ):
        at = np.searchsorted(keys, plate_audit.side_keys(arc.edges, len(raw.points)))
        out = middles[at, :2] - arc.center
        middles[at, :2] = arc.center + arc.radius * out / np.linalg.norm(out, axis=1, keepdims=True)
    return middles


def _halves(part: MshCells, lines: Ints, keys: Ints, count: int, numbers: Ints) -> MshCells:
    """Both halves of every line that is a side of a cell; others are left for the audit."""
    wanted = plate_audit.side_keys(lines, count)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    split = keys[at] == wanted
    middle = np.where(split, numbers[count + at], part.nodes[:, 1])
    halves = np.stack([part.nodes[:, 0], middle, middle, part.nodes[:, 1]], axis=1).reshape(-1, 2)
    kept = np.column_stack([np.ones(len(split), bool), split]).ravel()
    place = np.cumsum(kept) - 1
    groups = {
        name: np.concatenate([place[2 * rows], place[2 * rows[split[rows]] + 1]])
        for name, rows in part.groups.items()
    }
    return MshCells(halves[kept], np.repeat(part.numbers, 2)[kept], groups)


def _children(part: MshCells, nodes: Ints, each: int) -> MshCells:
    """Cells (each e, b) made of the cells (e, .) of a part, in their groups and under their
    numbers.
    """
    groups = {
        name: (each * rows[:, None] + np.arange(each)).ravel() for name, rows in part.groups.items()
    }
    return MshCells(nodes, np.repeat(part.numbers, each), groups)


def _together(one: MshCells, two: MshCells) -> MshCells:
    groups = dict(one.groups)
    for name, rows in two.groups.items():
        groups[name] = np.concatenate(
            [groups.get(name, np.zeros(0, np.int64)), len(one.nodes) + rows]
        )
    return MshCells(
        np.concatenate([one.nodes, two.nodes]), np.concatenate([one.numbers, two.numbers]), groups
    )
