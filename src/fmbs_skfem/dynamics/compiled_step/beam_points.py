"""Which points of full beams rotate with them, for the factors of `rotated`.

A point rotates where all of its coordinates are unknowns. Where points are held, or slaved to other unknowns, only some of them
are; beams that are slaved otherwise have no rotated factors, nor has what is stored or coupled in another way than beams alone.
Beams that nothing holds keep their momenta to round-off with factors of their own, and to the tolerance with rotated ones: theirs
do not rotate.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...bodies.body import Cells
from ...bodies.laws import Law
from ...core.algebra.linalg import is_sparse
from ...systems.compiled import Compiled
from ...systems.layouts import Storage
from ...systems.prepared import prepare
from .rotated import FIRST
from .step import Rotations

LINES = (Law.QUADRATIC, Law.MATERIAL, Law.EXACT)
# factors of a double pendulum with one take 1.1 times as long, those of a chain of nine beams twice as long
SHARED = 8  #: points that several beams share, at most: each costs solutions with every factor


class Beam(NamedTuple):
    """A beam in b points of c coordinates each."""

    unknowns: np.ndarray  #: (b, c), -1 for what is held
    held: np.ndarray  #: (b, c) where all unknowns are zero [m]
    near: np.ndarray  #: (b, b) whether two points belong to one cell

    @property
    def whole(self) -> np.ndarray:
        """(b,) whether all coordinates of a point are unknowns."""
        return np.asarray((self.unknowns >= 0).all(axis=1))


def rotations_of(model: Compiled) -> Rotations:
    """Tables of the points that rotate, and room of this run; empty where none do."""
    system, layout = model.system, model.layout
    none = nothing(system.dim, system.size)
    small = layout.storage in (Storage.DENSE, Storage.BAND) and not layout.loose and model.pattern is None
    if not small or not is_sparse(system.lift.matrix) or model.arrays.pairs.skew or any(one.low.terms for one in model.forces):
        return none
    # as long as some hundred steps of a fine mesh: found once, whatever runs follow
    parts = system.lift, system.elastic, layout.order
    tables = prepare(system).find("beam points", parts, lambda: find_tables(model))
    return none if tables is None else none._replace(**tables, **room(tables, system.size))


def find_tables(model: Compiled) -> dict[str, np.ndarray] | None:
    """Constant fields of `Rotations` by name; None where no point rotates."""
    beams = beams_of(model)
    sides = sides_of(beams) if beams else None
    return None if sides is None else filled(beams, sides, model.system.dim)


def beams_of(model: Compiled) -> list[Beam]:
    """All beams of a full system that consists of beams, rigid bodies and points; none where something else is in the way."""
    system, layout = model.system, model.layout
    spans = {name: (first, last) for name, first, last in system.coordinates}
    found, lift = [], csr_array(system.lift.matrix)
    # whatever is slaved to several unknowns, or to a multiple of one, is no point of its own; whether a beam is slaved to a rigid
    # body or that to the beam is a matter of the unit
    if (np.diff(lift.indptr) > 1).any() or (lift.data != 1.0).any():
        return []
    for name in dict.fromkeys(elastic.name for elastic in system.elastic):
        gathers = [elastic.gather for elastic in system.elastic if elastic.name == name]
        if name not in spans or not all(isinstance(one, Cells) and one.law in LINES and one.spread is None for one in gathers):
            return []
        rows, offset = lift[slice(*spans[name])], system.lift.offset[slice(*spans[name])]
        unknowns = np.full(rows.shape[0], -1)
        unknowns[np.diff(rows.indptr) == 1] = layout.place[rows.indices]
        count = len(unknowns) // system.dim
        near = np.zeros((count, count), bool)
        for nodes in (((one.nodes - spans[name][0]) // system.dim).T for one in gathers):
            for cell in nodes:
                near[np.ix_(cell, cell)] = True
        found.append(Beam(unknowns.reshape(count, -1), offset.reshape(count, -1), near))
    return found


def sides_of(beams: list[Beam]) -> dict[tuple[int, ...], list[tuple[int, int]]] | None:
    """Beams and their points by the unknowns of a point that several of them share; None where these cannot be told apart.

    A beam's share in the tangent of such a point follows from its other points near it, which have to be whole.
    """
    at: dict[int, set[tuple[int, int]]] = {}
    for number, point, unknowns in points(beams):
        for unknown in unknowns[unknowns >= 0]:
            at.setdefault(int(unknown), set()).add((number, point))
    found = {}
    for places in at.values():
        if len({number for number, _ in places}) == 1:
            continue
        keys = {tuple(beams[number].unknowns[point]) for number, point in places}
        alone = all(beams[number].whole[beams[number].near[point]].all() for number, point in places)
        if len(keys) > 1 or len(places) > len({number for number, _ in places}) or not alone:
            return None
        found[keys.pop()] = sorted(places)
    pairs = [(number, other) for places in found.values() for number, _ in places for other, _ in places if number < other]
    return found if len(found) <= SHARED and len(pairs) == len(set(pairs)) else None


def points(beams: list[Beam]) -> Iterator[tuple[int, int, np.ndarray]]:
    """Number of the beam, number of the point in it, and its unknowns (c,)."""
    for number, beam in enumerate(beams):
        for point, unknowns in enumerate(beam.unknowns):
            yield number, point, unknowns


def ends(beam: Beam, point: int) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns (2 c,) of the points after and before one, and their distance (c,) where all unknowns are zero."""
    after, before = (
        other if 0 <= other < len(beam.near) and beam.near[point, other] else point for other in (point + 1, point - 1)
    )
    return np.concatenate([beam.unknowns[after], beam.unknowns[before]]), beam.held[after] - beam.held[before]


def filled(beams: list[Beam], sides: dict[tuple[int, ...], list[tuple[int, int]]], dim: int) -> dict[str, np.ndarray] | None:
    """Tables of beams with sides at the points that they share; None without points that rotate."""
    shared = {unknown for key in sides for unknown in key}
    held = held_ones(beams, sides)
    sides = {key: places for key, places in sides.items() if held.issuperset(number for number, _ in places)}
    free = [one for one in points(beams) if one[0] in held and (one[2] >= 0).all() and not shared.intersection(one[2])]
    if not free:
        return None
    members = [np.setdiff1d(beam.unknowns, [-1, *shared]) for beam in beams]
    first = np.cumsum([0, *(len(one) for one in members)])
    places = [(number, *one) for number, key in enumerate(sides) for one in sides[key]]
    directions = [ends(beams[body], point) for body, point in [one[:2] for one in free] + [one[1:] for one in places]]
    return {
        "groups": np.array([one[2] for one in free]),
        "owners": np.array([one[0] for one in free]),
        "shared": np.array(list(sides), np.int64).reshape(-1, dim),
        "sides": np.array([(p, body, first[body], first[body + 1]) for p, body, _ in places], np.int64).reshape(-1, 4),
        "members": np.concatenate(members),
        "ends": np.array([one[0] for one in directions]),
        "held": np.array([one[1] for one in directions]),
    }


def held_ones(beams: list[Beam], sides: dict[tuple[int, ...], list[tuple[int, int]]]) -> set[int]:
    """Numbers of the beams with held points, and of those that share points with them, and so on."""
    held, known = {number for number, beam in enumerate(beams) if (beam.unknowns < 0).any()}, -1
    while known < len(held):
        known = len(held)
        for places in sides.values():
            joined = {number for number, _ in places}
            held |= joined if held & joined else set()
    return held


def room(tables: dict[str, np.ndarray], size: int) -> dict[str, np.ndarray]:
    """The other arrays of `Rotations`, for tables of `size` unknowns."""
    (directed, dim), count, many = tables["held"].shape, tables["shared"].size, len(tables["sides"])
    return {
        "start": np.zeros((directed, dim)),
        "turns": np.zeros((directed, dim * dim)),
        "columns": np.zeros((count, size)),
        "reach": np.zeros((count, size)),
        "shares": np.zeros((dim * many, dim * many)),
        "rest": np.zeros((count, count)),
        "border": np.zeros((count, count)),
        "pivots": np.zeros(count, np.int32),
        "pull": np.zeros(count),
    }


def nothing(dim: int, size: int) -> Rotations:
    """The tables of no point."""
    tables = [np.zeros((0, width), np.int64) for width in (dim, dim, 4, 2 * dim)]
    groups, shared, sides, directed = tables
    none, rows, matrix = np.zeros(0, np.int64), np.zeros((0, size)), np.zeros((0, 0))
    return Rotations(
        groups=groups,
        owners=none,
        shared=shared,
        sides=sides,
        members=none,
        ends=directed,
        held=np.zeros((0, dim)),
        start=np.zeros((0, dim)),
        turns=np.zeros((0, dim * dim)),
        columns=rows,
        reach=rows,
        shares=matrix,
        rest=matrix,
        border=matrix,
        pivots=np.zeros(0, np.int32),
        pull=np.zeros(0),
        lives=np.array([1.0, FIRST]),
        on=np.zeros(2, np.int64),
    )
