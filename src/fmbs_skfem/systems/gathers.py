"""Gathers of elastic parts as flat arrays: which coordinates every cell reads, and where its matrix goes.

    p = S (lift x),   u = B p[nodes],   f = lift^T S^T B^T S_u

p are the coordinates of the cells: those of the bodies, or their images S q where a body slaves functions to a frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import csr_array, vstack

from ..bodies.body import Cells
from ..bodies.laws import Law
from . import kernels, quartic
from .quartic import Quartic
from .system import Affine, Sampled, System

BLOCK = 64  #: cells that a kernel handles at once, so that their jets stay in the cache
ROOM = 20_000  #: numbers of sampled jets that stay in the cache from gather to scatter
Map: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]  #: source, target, factor
NOWHERE: Map = (np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))


@dataclass(frozen=True)
class Collected:
    """Elastic groups of a system, wide bodies in blocks of cells, with the coordinates p of all cells."""

    lift: Affine  #: p from the unknowns
    groups: tuple[tuple[int, Cells | Sampled | Quartic], ...]  #: number of the elastic part, and a block of it; nodes refer to p

    @property
    def owners(self) -> np.ndarray:
        """Number of the elastic part of every group, (g,)."""
        return np.array([number for number, _ in self.groups], dtype=np.int64)

    @property
    def cells(self) -> list[Cells]:
        """The groups that are cells."""
        return [part for _, part in self.groups if isinstance(part, Cells)]


def collect(system: System) -> Collected:
    """All elastic groups of a system."""
    rows: list[csr_array] = []
    offsets, groups = [np.zeros(0)], list[tuple[int, Cells | Sampled | Quartic]]()
    first, shared = 0, -1
    for number, elastic in enumerate(system.elastic):
        part = elastic.gather
        if isinstance(part, Quartic):
            groups.append((number, part))
            continue
        if isinstance(part, Sampled):
            groups += [(number, block) for block in point_blocks(part)]
            continue
        if part.spread is None and shared >= 0:
            start = shared
        else:
            own = system.lift if part.spread is None else Affine(part.spread @ system.lift.matrix, part.spread @ system.lift.offset)
            rows.append(csr_array(own.matrix))
            offsets.append(own.offset)
            start, first = first, first + len(own.offset)
            shared = start if part.spread is None else shared
        groups += [(number, block) for block in blocks(replace(part, nodes=part.nodes + start, spread=None))]
    matrix = csr_array(vstack(rows)) if rows else csr_array((0, system.size))
    return Collected(Affine(matrix, np.ascontiguousarray(np.concatenate(offsets))), tuple(groups))


def blocks(cells: Cells) -> list[Cells]:
    """A body's cells in blocks of about BLOCK, all in one where they are few."""
    count = cells.nodes.shape[1]
    pieces = max(1, round(count / BLOCK)) if count > 4 * BLOCK else 1
    parts = np.array_split(np.arange(count), pieces)
    return [replace(cells, table=cells.table[..., k], nodes=cells.nodes[:, k], section=cells.section[..., k]) for k in parts]


def point_blocks(part: Sampled) -> list[Sampled]:
    """Sampled points in blocks of about ROOM jets, all in one where they are few."""
    count = part.section.shape[2]
    rows, modes = len(part.offset) // count, part.jets.shape[1]
    jets, offset = part.jets.reshape(rows, count, modes), part.offset.reshape(rows, count)
    pieces = max(1, round(part.jets.size / ROOM))
    return [
        replace(
            part,
            jets=np.ascontiguousarray(jets[:, k]).reshape(-1, modes),
            offset=np.ascontiguousarray(offset[:, k]).ravel(),
            section=np.ascontiguousarray(part.section[..., k]),
            cell=part.cell[k],
        )
        for k in np.array_split(np.arange(count), pieces)
    ]


def cell_coordinates(cells: Cells) -> np.ndarray:
    """Coordinates q of every cell, (b c, e)."""
    return (cells.nodes[:, None, :] + np.arange(cells.dim)[None, :, None]).reshape(-1, cells.nodes.shape[1])


class Tape:
    """Integers, numbers and scatter entries of all groups behind each other, while they are written."""

    def __init__(self) -> None:
        self.rows: list[list[int]] = []
        self.integers = [np.zeros(0, np.int64)]
        self.numbers = [np.zeros(0)]
        self.scatters = [NOWHERE]
        self.at_integer = self.at_number = self.at_scatter = 0
        self.work = 1  #: length of a work vector
        self.laws: list[Law] = []  #: those in use; groups know them by their place here

    def put(self, *arrays: np.ndarray) -> int:
        """Append numbers; where they begin."""
        start = self.at_number
        self.numbers += [array.ravel() for array in arrays]
        self.at_number += sum(array.size for array in arrays)
        return start

    def law(self, law: Law) -> int:
        """The place of a law among those in use."""
        if law not in self.laws:
            self.laws.append(law)
        return self.laws.index(law)

    def group(self, **columns: int) -> None:
        """A row of the table of groups, columns of `kernels` by name."""
        row = [0] * 16
        for name, value in columns.items():
            row[getattr(kernels, name)] = value
        self.rows.append(row)

    def jets(self, part: Cells | Sampled, dim: int, **columns: int) -> None:
        """A group whose law acts on jets; its section is written last."""
        lines, points, count = part.section.shape
        vectors = part.law.vectors
        self.work = max(self.work, (vectors * dim) ** 2 * points * count)
        sizes = {"LAW": self.law(part.law), "VECTORS": vectors, "COMPONENTS": dim, "ROWS": lines, "POINTS": points, "CELLS": count}
        self.group(**sizes, **columns, SECTION=self.put(part.section))


class Flat(NamedTuple):
    """Tables of all groups behind each other."""

    table: np.ndarray  #: (g, 16)
    integers: np.ndarray
    numbers: np.ndarray
    scatter: Map
    work: int  #: length of the work vector
    laws: tuple[Law, ...]  #: in use


def flatten(dim: int, collected: Collected, scatter: Callable[[Cells], Map]) -> Flat:
    """The tables of all groups."""
    tape = Tape()
    for _, part in collected.groups:
        if isinstance(part, Quartic):
            flatten_quartic(tape, part)
        elif isinstance(part, Sampled):
            flatten_sampled(tape, part, dim)
        else:
            flatten_cells(tape, part, dim, scatter(part))
    source, target, factor = (np.concatenate(part) for part in zip(*tape.scatters, strict=True))
    groups = np.array(tape.rows, dtype=np.int64).reshape(-1, 16)
    numbers = quartic.aligned(tape.at_number)
    np.concatenate(tape.numbers, out=numbers)
    integers = np.concatenate(tape.integers).astype(np.int64)
    return Flat(groups, integers, numbers, (source, target, factor), tape.work, tuple(tape.laws))


def flatten_cells(tape: Tape, part: Cells, dim: int, targets: Map) -> None:
    basis, count = part.nodes.shape
    size, jets = basis * dim, part.law.vectors * dim * part.section[0].size
    tape.work = max(tape.work, jets + size * count, (size * (size + 1) // 2 + part.law.vectors) * count)
    places = {"NODES": tape.at_integer, "TABLE": tape.put(part.table), "PAIR": tape.at_scatter, "COUNT": len(targets[0])}
    tape.jets(part, dim, BASIS=basis, **places)
    tape.integers.append(part.nodes.ravel())
    tape.at_integer += part.nodes.size
    tape.scatters.append(targets)
    tape.at_scatter += len(targets[0])


def flatten_sampled(tape: Tape, part: Sampled, dim: int) -> None:
    first, modes = part.columns.start, part.columns.stop - part.columns.start
    tape.work = max(tape.work, part.jets.size)
    places = {"TABLE": tape.put(part.jets), "OFFSET": tape.put(part.offset), "TURNED": tape.put(part.jets.T)}
    tape.jets(part, dim, SAMPLED=kernels.SAMPLE, FIRST=first, COUNT=modes, **places)


def flatten_quartic(tape: Tape, part: Quartic) -> None:
    tape.put(np.zeros(-tape.at_number % quartic.LANES))
    tape.work = max(tape.work, int(quartic.work_length(part.modes)))
    tape.group(SAMPLED=kernels.QUARTIC, FIRST=part.columns.start, COUNT=part.modes, TABLE=tape.put(part.coefficients))


def nowhere(cells: Cells) -> Map:
    """The map of systems whose matrix is assembled elsewhere."""
    return NOWHERE


def scatter_map(cells: Cells, T: csr_array, place: np.ndarray, dense: bool, width: int) -> Map:
    """Where entries of the cells' lower triangles go in the flat band or dense matrix, W += T^T K_e T with p = T x."""
    local = cell_coordinates(cells)
    size, count = local.shape
    deep = int(np.diff(T.indptr).max(initial=1))
    target, factor = np.full((T.shape[0], deep), -1), np.zeros((T.shape[0], deep))
    for k in range(deep):
        has = np.diff(T.indptr) > k
        target[has, k], factor[has, k] = place[T.indices[T.indptr[:-1][has] + k]], T.data[T.indptr[:-1][has] + k]
    low, column = np.tril_indices(size)
    sources, targets, factors = [], [], []
    for k in range(deep):
        for m in range(deep):
            i, j = target[local[low], k], target[local[column], m]
            value = factor[local[low], k] * factor[local[column], m]
            source = (low * (low + 1) // 2 + column)[:, None] * count + np.arange(count)[None, :]
            for a, b, on in ((i, j, np.ones(len(low), bool)), (j, i, low != column)):
                valid = (i >= 0) & (j >= 0) & on[:, None] & (dense | (a >= b))
                sources.append(source[valid])
                flat = a * len(place) + b if dense else b * (width + 1) + a - b
                targets.append(flat[valid])
                factors.append(value[valid])
    source, flat, value = np.concatenate(sources), np.concatenate(targets), np.concatenate(factors)
    order = np.argsort(source, kind="stable")
    return source[order].astype(np.int64), flat[order].astype(np.int64), value[order]
