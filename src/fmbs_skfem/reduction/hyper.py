r"""Hyper-reduction by energy-conserving sampling and weighting (ECSW), over cells or over quadrature points.

    F_r ~ sum_e w_e U_e^T F_e(U_e xi + qbar_e),  w_e > 0,      G[(s, i), e] = (U_e^T F_e(q_s))_i,  ||G w - G 1|| <= eta ||G 1||  (44), (45)

A weight multiplies the quadrature weight of its points, points without weight are left out: the hyper-reduced system is a System with
shorter arrays, and its force is still the gradient of an energy.

Source: Farhat, Avery, Chapman, Cortial, Int. J. Numer. Meth. Engng 98 (2014) 625-662, doi 10.1002/nme.4668.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..bodies import cable_law
from ..core.errors import InputError, say
from ..systems.system import Elastic, Sampled, System
from . import ecsw
from .ecsw import Sample


class Level(Enum):
    """What is sampled."""

    ELEMENTS = "elements"
    POINTS = "points"


@dataclass(frozen=True)
class Selection:
    """Sampled cells or points of one component, numbered through all its bodies."""

    component: str
    level: Level
    sample: Sample
    total: int  #: number of candidates
    seconds: float  #: of the sparse non-negative least squares (CPU)


def train(system: System, states: np.ndarray, tolerance: float = 1e-3, level: Level = Level.ELEMENTS) -> tuple[Selection, ...]:
    """One sparse non-negative least-squares problem per component of a reduced system.

    `states` (s, n) are training states in the reduced unknowns: the projected snapshots.
    """
    if not system.components:
        raise InputError(say("hyper.train", "a reduced system", "a full one", "reduce it first"))
    found = []
    for name, first, last in system.components:
        members = [e for e in system.elastic if owned(e, first, last)]
        if members:
            start = clock.process_time()
            sample = solve(members, states, tolerance, level)
            total = sum(count(e, level) for e in members)
            found.append(Selection(name, level, sample, total, clock.process_time() - start))
    return tuple(found)


def owned(elastic: Elastic, first: int, last: int) -> bool:
    """Whether a body's unknowns lie in the given range."""
    gather = elastic.gather
    return isinstance(gather, Sampled) and first <= gather.columns.start and gather.columns.stop <= last


def count(elastic: Elastic, level: Level) -> int:
    gather = sampled_gather(elastic)
    return len(gather.cell) if level is Level.POINTS else int(gather.cell.max()) + 1


def sampled_gather(elastic: Elastic) -> Sampled:
    if not isinstance(elastic.gather, Sampled):
        raise InputError(say(f"body '{elastic.name}'", "a reduced body", "a full one"))
    return elastic.gather


def solve(members: list[Elastic], states: np.ndarray, tolerance: float, level: Level) -> Sample:
    """Weights of one component."""
    if tolerance < ecsw.GRAM_FLOOR:
        R, y = ecsw.compress(training_blocks(members, states, level))
        return ecsw.weights(R, tolerance, b=y)
    return ecsw.weights_from_gram(ecsw.gram(training_blocks(members, states, level)), tolerance)


def training_blocks(members: list[Elastic], states: np.ndarray, level: Level, block: int = 32) -> Iterator[np.ndarray]:
    """Rows (s, i) of G for blocks of states; columns are cells or points of all bodies of the component."""
    for first in range(0, len(states), block):
        yield np.concatenate([forces(e, states[first : first + block], level) for e in members], axis=1)


def forces(elastic: Elastic, states: np.ndarray, level: Level) -> np.ndarray:
    """Contribution of every cell or point to the reduced force, (s i, e)."""
    gather = sampled_gather(elastic)
    rows, points, modes = 2 * system_dim(gather), len(gather.cell), gather.jets.shape[1]
    jets = gather.jets.reshape(rows, points, modes)
    S, out = np.zeros((rows, 1, points)), np.zeros((len(states), modes, points))
    for s, x in enumerate(states):
        u = (gather.jets @ x[gather.columns] + gather.offset).reshape(rows, 1, points)
        cable_law.stress(int(gather.curvature), u, u, 0.0, gather.section, S)
        out[s] = np.einsum("kpr,kp->rp", jets, S[:, 0])
    flat = out.reshape(-1, points)
    if level is Level.POINTS:
        return flat
    cells = np.zeros((len(flat), int(gather.cell.max()) + 1))
    np.add.at(cells.T, gather.cell, flat.T)
    return cells


def system_dim(gather: Sampled) -> int:
    return len(gather.offset) // (2 * len(gather.cell))


def apply(system: System, selections: tuple[Selection, ...]) -> System:
    """The hyper-reduced system: rows of the gathers and slices of the sections, quadrature weights times ECSW weights."""
    spans = {name: (first, last) for name, first, last in system.components}
    elastic = list(system.elastic)
    for selection in selections:
        start = 0
        for number, member in enumerate(system.elastic):
            if owned(member, *spans[selection.component]):
                size = count(member, selection.level)
                weights = np.zeros(size)
                mine = (selection.sample.indices >= start) & (selection.sample.indices < start + size)
                weights[selection.sample.indices[mine] - start] = selection.sample.weights[mine]
                elastic[number] = weighted(member, weights, selection.level)
                start += size
    return replace(system, elastic=tuple(e for e in elastic if len(sampled_gather(e).cell)))


def weighted(elastic: Elastic, weights: np.ndarray, level: Level) -> Elastic:
    """A body with weights (e,) on its cells or (p,) on its points."""
    gather = sampled_gather(elastic)
    point = weights if level is Level.POINTS else weights[gather.cell]
    kept = np.flatnonzero(point > 0)
    rows, points = 2 * system_dim(gather), len(gather.cell)
    section = gather.section[:, :, kept].copy()
    section[3] *= point[kept]
    return replace(
        elastic,
        gather=replace(
            gather,
            jets=np.ascontiguousarray(gather.jets.reshape(rows, points, -1)[:, kept].reshape(rows * len(kept), -1)),
            offset=np.ascontiguousarray(gather.offset.reshape(rows, points)[:, kept].ravel()),
            section=np.ascontiguousarray(section),
            cell=gather.cell[kept],
        ),
    )


def kept(system: System) -> dict[str, tuple[int, int]]:
    """Cells and points in use, by body."""
    return {e.name: (len(np.unique(sampled_gather(e).cell)), len(sampled_gather(e).cell)) for e in system.elastic}
