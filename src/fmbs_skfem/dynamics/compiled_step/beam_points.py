"""Which vectors of full beams rotate with them, for the factors of `rotated`.

Unknowns of which every coordinate is a vector in space, as positions and directors are, stand in
the lift as S (x) 1: an unknown vector, one column of S, rotates with the point whose vectors it
moves. A point is a function of a beam with its directors, which say how it has rotated, or one of a
cable between its neighbours. Beams that are welded share directors, and rotate alike there; where
they are hinged they share a position, which rotates with none of them. Rigid bodies are isotropic
in mass: whatever they share rotates with the beam. Beams that are slaved otherwise have no rotated
factors, nor has what is stored or coupled in another way than beams alone. Beams that nothing holds
keep their momenta to round-off with factors of their own, and to the tolerance with rotated ones:
theirs do not rotate.
"""

from __future__ import annotations

from collections import Counter
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array

from ...bodies.body import Cells
from ...bodies.laws import Law
from ...core.algebra.linalg import is_sparse
from ...systems.compiled import Compiled
from ...systems.layouts import Storage
from ...systems.prepared import prepare
from ...systems.system import System
from .rotated import FIRST
from .step import Rotations

LINES = (Law.QUADRATIC, Law.MATERIAL, Law.EXACT, Law.BEAM, Law.WARPED_BEAM)
# factors of a double pendulum with one take 1.1 times as long, those of a chain of nine beams twice
# as long
SHARED = 8  #: positions that several beams share, at most: each costs solutions with every factor
DIGITS = 12  #: to which factors of the components of a vector agree

Point = tuple[int, int]  #: number of a beam, and of a point of it


class BeamPoints(NamedTuple):
    """A beam in b points of f vectors each, the position first."""

    first: int  #: number of its first vector
    fields: int
    near: np.ndarray  #: (b, b) whether two points belong to one cell


class Vectors(NamedTuple):
    """Unknown vectors u, and the vectors V of all bodies that they move.

        V = S u

    with S by rows.
    """

    unknowns: np.ndarray  #: (u, c), -1 for components that are no unknowns
    S: csc_array  #: (V, u)


def rotations_of(model: Compiled) -> Rotations:
    """Tables of what rotates, and room of this run; empty where nothing does."""
    system, layout = model.system, model.layout
    none = nothing(system.dim, system.size)
    small = (
        layout.storage in (Storage.DENSE, Storage.BAND)
        and not layout.loose
        and model.pattern is None
    )
    if (
        not small
        or not is_sparse(system.lift.matrix)
        or model.arrays.pairs.skew
        or any(one.low.terms for one in model.forces)
    ):
        return none
    # as long as some hundred steps of a fine mesh: found once, whatever runs follow
    parts = system.lift, system.elastic, layout.order
    tables = prepare(system).find("beam points", parts, lambda: find_tables(system, layout.place))
    return (
        none if tables is None else none._replace(**tables, **room(tables, system.dim, system.size))
    )


def find_tables(system: System, place: np.ndarray) -> dict[str, np.ndarray] | None:
    """Constant fields of `Rotations` by name, of unknowns at places (n,); None where nothing
    rotates.
    """
    beams = beams_of(system)
    vectors = vectors_of(system, place)
    return None if not beams or vectors is None else Joined(beams, vectors).tables(system.dim)


def beams_of(system: System) -> list[BeamPoints]:
    """All beams of a full system that consists of beams, rigid bodies and points; none where
    something else is in the way.
    """
    spans = {name: (first, last) for name, first, last in system.coordinates}
    found = []
    lift = csr_array(system.lift.matrix)
    # a cable that is slaved to several unknowns, or to a multiple of one, has no points of its own;
    # whether it is slaved to a rigid body or that to the cable is a matter of the unit
    slaved = bool((np.diff(lift.indptr) > 1).any() or (lift.data != 1.0).any())
    for name in dict.fromkeys(elastic.name for elastic in system.elastic):
        gathers = [elastic.gather for elastic in system.elastic if elastic.name == name]
        if name not in spans or not all(
            isinstance(one, Cells) and one.law in LINES and one.spread is None for one in gathers
        ):
            return []
        if slaved and gathers[0].law.fields == 1:
            return []
        (first, last) = spans[name]
        size = gathers[0].dim
        near = np.zeros(((last - first) // size,) * 2, bool)
        for nodes in (((one.nodes - first) // size).T for one in gathers):
            for cell in nodes:
                near[np.ix_(cell, cell)] = True
        found.append(BeamPoints(first // system.dim, size // system.dim, near))
    return found


def vectors_of(system: System, place: np.ndarray) -> Vectors | None:
    """The unknown vectors of a lift S (x) 1, held components aside; None where a component follows
    another one.
    """
    lift = csc_array(system.lift.matrix)
    dim = system.dim
    found: dict[tuple[tuple[int, ...], tuple[float, ...]], np.ndarray] = {}
    for j, (first, last) in enumerate(zip(lift.indptr[:-1], lift.indptr[1:], strict=True)):
        vectors, components = np.divmod(lift.indices[first:last], dim)
        if np.ptp(components) > 0:
            return None
        key = tuple(vectors.tolist()), tuple(lift.data[first:last].round(DIGITS).tolist())
        found.setdefault(key, np.full(dim, -1))[components[0]] = place[j]
    columns = [len(rows) for rows, _ in found]
    S = (
        np.concatenate([values for _, values in found]),
        np.concatenate([rows for rows, _ in found]),
        np.cumsum([0, *columns]),
    )
    return Vectors(
        np.array(list(found.values())), csc_array(S, shape=(lift.shape[0] // dim, len(found)))
    )


class Joined:
    """Beams with the unknown vectors that move their points."""

    def __init__(self, beams: list[BeamPoints], vectors: Vectors) -> None:
        self.beams, self.unknowns, self.S = beams, vectors.unknowns, csr_array(vectors.S)
        self.whole = np.asarray((vectors.unknowns >= 0).all(axis=1))
        at: dict[int, tuple[Point, int]] = {}
        for number, beam in enumerate(beams):
            for vector in range(len(beam.near) * beam.fields):
                at[beam.first + vector] = (number, vector // beam.fields), vector % beam.fields
        #: (u) points that a vector moves, with fields and factors
        self.moved: list[list[tuple[Point, int, float]]] = []
        for first, last in zip(vectors.S.indptr[:-1], vectors.S.indptr[1:], strict=True):
            rows = vectors.S.indices[first:last].tolist()
            values = vectors.S.data[first:last].tolist()
            self.moved.append(
                [(*at[row], value) for row, value in zip(rows, values, strict=True) if row in at]
            )
        self.like: dict[Point, Point] = {}  #: points that rotate as another one
        self.group = list(range(len(beams)))  #: of welded beams: the number of one of them
        self.weld()

    def weld(self) -> None:
        """Points that share two directors or more rotate alike, and their beams are one."""
        shared: Counter[tuple[Point, Point]] = Counter()
        for moved in self.moved:
            shared.update(
                combinations(sorted({point for point, field, _ in moved if field > 0}), 2)
            )
        for (one, other), count in sorted(shared.items()):
            if count > 1:
                self.like[other] = self.like.get(one, one)
                old, new = self.group[other[0]], self.group[one[0]]
                self.group = [new if number == old else number for number in self.group]

    def points(self, vector: int) -> list[Point]:
        """The points that an unknown vector moves, without those that rotate as another one of
        them.
        """
        return sorted({self.like.get(point, point) for point, _, _ in self.moved[vector]})

    def held(self) -> set[int]:
        """Groups of beams with held vectors, and those that share positions with them, and so on."""
        held = set()
        for number, beam in enumerate(self.beams):
            rows = slice(beam.first, beam.first + len(beam.near) * beam.fields)
            if (np.diff(self.S.indptr)[rows] == 0).any():
                held.add(self.group[number])
            columns = self.S[rows].indices
            if not self.whole[columns].all():
                held.add(self.group[number])
        known = -1
        while known < len(held):
            known = len(held)
            for vector in range(len(self.moved)):
                joined = {self.group[number] for number, _ in self.points(vector)}
                held |= joined if held & joined else set()
        return held

    def is_alone(self, point: Point) -> bool:
        """Whether the share of a beam in the tangent of a position follows from the positions near
        it, which have to be whole.
        """
        beam = self.beams[point[0]]
        rows = beam.first + beam.fields * np.flatnonzero(beam.near[point[1]])
        near = self.S[rows]
        return bool(
            (np.diff(near.indptr) == 1).all()
            and (near.data == 1.0).all()
            and self.whole[near.indices].all()
        )

    def sides(self) -> dict[int, list[Point]] | None:
        """Points by the position that several beams share there; None where these cannot be told
        apart.
        """
        found = {
            vector: points
            for vector in range(len(self.moved))
            if len(points := self.points(vector)) > 1
        }
        for vector, points in found.items():
            positions = all(field == 0 and value == 1.0 for _, field, value in self.moved[vector])
            if not positions or not self.whole[vector] or not all(map(self.is_alone, points)):
                return None
        groups = [sorted(self.group[number] for number, _ in points) for points in found.values()]
        pairs = [pair for one in groups for pair in combinations(one, 2)]
        # of two positions that the same beams share, or one that a beam has twice, shares cannot be
        # told apart
        apart = len(pairs) == len(set(pairs)) and all(one != other for one, other in pairs)
        return found if apart and len(found) <= SHARED else None

    def tables(self, dim: int) -> dict[str, np.ndarray] | None:
        """See `find_tables`."""
        sides = self.sides()
        held = self.held()
        if sides is None:
            return None
        kept = {
            vector: points
            for vector, points in sides.items()
            if all(self.group[number] in held for number, _ in points)
        }
        free = [
            v
            for v in range(len(self.moved))
            if v not in sides and self.rotates(v) and self.owner(v) in held
        ]
        if not free:
            return None
        own = [v for v in range(len(self.moved)) if v not in sides and self.moved[v]]
        groups = sorted(set(self.group))
        members = [
            np.concatenate(
                [np.zeros(0, int), *(self.unknowns[v] for v in own if self.owner(v) == one)]
            )
            for one in groups
        ]
        members = [one[one >= 0] for one in members]
        first = dict(zip(groups, np.cumsum([0, *map(len, members)]), strict=False))
        numbers: dict[Point, int] = {}
        turned = [numbers.setdefault(self.points(v)[0], len(numbers)) for v in free]
        table = []
        for k, points in enumerate(kept.values()):
            for point in points:
                one = self.group[point[0]]
                end = first[one] + len(members[groups.index(one)])
                table.append((k, one, first[one], end, numbers.setdefault(point, len(numbers))))
        return {
            "groups": self.unknowns[free],
            "turned": np.array(turned),
            "owners": np.array([self.owner(v) if self.moves(v) else -1 for v in free]),
            "shared": self.unknowns[list(kept)].reshape(-1, dim),
            "sides": np.array(table, np.int64).reshape(-1, 5),
            "members": np.concatenate(members),
            "ends": np.array([self.ends(point, dim) for point in numbers]),
        }

    def owner(self, vector: int) -> int:
        """The group of beams that a vector moves."""
        return self.group[self.moved[vector][0][0][0]]

    def moves(self, vector: int) -> bool:
        """Whether an unknown vector is moved by a translation of its beam."""
        return all(field == 0 and value == 1.0 for _, field, value in self.moved[vector])

    def rotates(self, vector: int) -> bool:
        """Whether an unknown vector rotates with a point; of directors that a hinge holds two
        components do, in its plane.
        """
        directors = any(field > 0 for _, field, _ in self.moved[vector])
        return bool(self.moved[vector]) and bool(
            self.whole[vector] or (directors and (self.unknowns[vector] >= 0).sum() == 2)
        )

    def ends(self, point: Point, dim: int) -> tuple[int, int, int]:
        """First coordinates of its directors, or of the points after and before it, and -1."""
        beam = self.beams[point[0]]
        at = point[1]
        if beam.fields > 1:
            first = dim * (beam.first + beam.fields * at)
            return first + dim, first + 2 * dim, first + 3 * dim
        after, before = (
            k if 0 <= k < len(beam.near) and beam.near[at, k] else at for k in (at + 1, at - 1)
        )
        return dim * (beam.first + after), dim * (beam.first + before), -1


def room(tables: dict[str, np.ndarray], dim: int, size: int) -> dict[str, np.ndarray]:
    """The other arrays of `Rotations`, for tables of `size` unknowns."""
    points = len(tables["ends"])
    count = tables["shared"].size
    many = len(tables["sides"])
    return {
        "start": np.zeros((points, dim * dim)),
        "turns": np.zeros((points, dim * dim)),
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
    groups, shared, sides, ends = (np.zeros((0, width), np.int64) for width in (dim, dim, 5, 3))
    none, rows, matrix, turns = (
        np.zeros(0, np.int64),
        np.zeros((0, size)),
        np.zeros((0, 0)),
        np.zeros((0, dim * dim)),
    )
    return Rotations(
        groups=groups,
        turned=none,
        owners=none,
        shared=shared,
        sides=sides,
        members=none,
        ends=ends,
        start=turns,
        turns=turns,
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
