r"""Hyper-reduction by energy-conserving sampling and weighting (ECSW), over cells or over
quadrature points.

    F_r ~ sum_e w_e U_e^T F_e(U_e xi + qbar_e),   w_e > 0                                                               (44)
    G[(s, r), e] = (U_e^T F_e(q_s))_r,            ||G w - G 1|| <= eta ||G 1||                                          (45)

Parts, and beams whose directors are held by a stiffness, measure forces by the energy of the
displacements that they make: the rows of a state are C(q_s)^(1/2) U_e^T F_e with a compliance C, so
that small forces along soft directions count as much as large ones along stiff ones. What modes of
a beam leave out strains its directors, and 1000 EA times that outweighs all forces else: a frame of
five beams (34 modes, 42 of 90 points, eta = 1e-3) errs by 0.71 of a range by its forces, by 0.004
by their energy (43 points), as with all points.

A weight multiplies the quadrature weight of its points, points without weight are left out: the
hyper-reduced system is a System with shorter arrays, and its force is still the gradient of an
energy. `Elements` and `Points` are the hyper-reductions of a plan.

Source: Farhat, Avery, Chapman, Cortial, Int. J. Numer. Meth. Engng 98 (2014) 625-662, doi
10.1002/nme.4668.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import ClassVar, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ...bodies import laws
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...systems.system import Elastic, System, multiply_out
from ...systems.terms import elastic as terms
from ...systems.terms.points import Sampled, dense_rows
from . import ecsw
from .ecsw import Gram, Level, Sample, Selection
from .hyper_reduction import USUAL, HyperReduction, Rule, TrainingRun, register

# double pendulum of 100 cells a beam: all 400 states keep 33 points, which err by 2.00e-5, 167 of
# them 32, by 2.03e-5
#: training states times points: more states than that are thinned out, down to LEAST
WORK = 400_000
LEAST = 120
START = 20  #: first training states, of the transient, which are never left out
BLOCK = 20_000_000  #: numbers in a block of training forces
ROUND = 1e-9  #: of the largest eigenvalue of a tangent: those of rigid motions are below
# 100 in its place selects the same 33 of 600 points of a double pendulum
MANY = 6000  #: points above which the cells are searched first, and then the points of the cells that were found


#: bodies of a component with their parameters, states (s, n)
Run: TypeAlias = tuple[list[Elastic], np.ndarray]
#: states (s, n) -> C^(1/2) (s, n, n) of their forces
Measure: TypeAlias = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Ecsw(HyperReduction):
    """ECSW of every component, to the relative tolerance eta.

        ||G w - G 1|| <= eta ||G 1||,    w >= 0

    over all training states. NotReached, a SolverError, where no weights keep it.
    """

    tolerance: float = USUAL

    def train(self, runs: Sequence[TrainingRun]) -> Rule:
        """The weights of all components, trained on the projected motions."""
        selections = train(
            [(run.system, run.states()) for run in runs], self.tolerance, Level(self.name)
        )
        return Rule(partial(apply, selections=selections), selections)


@register
class Elements(Ecsw):
    """ECSW over the cells of a component, to the relative tolerance eta.

        F_r ~ sum_e w_e U_e^T F_e

    Source: Farhat, Avery, Chapman, Cortial 2014, doi 10.1002/nme.4668.
    """

    name: ClassVar[str] = Level.ELEMENTS.value
    label: ClassVar[str] = "ecsw"


@register
class Points(Ecsw):
    """ECSW over the quadrature points of a component, to the relative tolerance eta.

    As `Elements`, with a weight w_p of every quadrature point p. Source as there, doi
    10.1002/nme.4668.
    """

    name: ClassVar[str] = Level.POINTS.value
    label: ClassVar[str] = "ecsw-points"


def train(
    runs: Sequence[tuple[System, np.ndarray]],
    tolerance: float = USUAL,
    level: Level = Level.ELEMENTS,
) -> tuple[Selection, ...]:
    """One sparse non-negative least-squares problem per component of a reduced system.

    A run is the system of its own parameters and training states (s, n) in its reduced unknowns.
    The rows of a run are divided by the norm of its part of b, so that runs of stiff and of soft
    systems count alike. `tolerance` is eta of (45). InputError for a system that is not reduced,
    `ecsw.NotReached` where no weights keep the tolerance.
    """
    if not runs or not all(system.components for system, _ in runs):
        raise InputError(
            say(
                "sampling.train",
                "a reduced system",
                "a full one" if runs else "none",
                "reduce it first",
            )
        )
    found = []
    runs = [(multiply_out(system), states) for system, states in runs]
    for name, first, last in runs[0][0].components:
        mine = [(members_of(system, first, last), states[:, first:last]) for system, states in runs]
        members = mine[0][0]
        if members:
            held = any(sampled_gather(one).law.fields > 1 for one in members)
            sample, training, search = solve(
                mine, first, tolerance, level, partial(by_energy, members, first) if held else None
            )
            found.append(
                Selection(
                    name, level, sample, sum(count(e, level) for e in members), training, search
                )
            )
    return tuple(found)


def members_of(system: System, first: int, last: int) -> list[Elastic]:
    """The bodies with points whose unknowns lie in the given range, these as dense rows."""
    return [
        replace(one, gather=sampled_gather(one))
        for one in system.elastic
        if owns(one, first, last) and has_points(one)
    ]


def has_points(elastic: Elastic) -> bool:
    """Whether a reduced body has points to choose among: one of matrices has none."""
    return dense_rows(elastic.gather) is not None


def owns(elastic: Elastic, first: int, last: int) -> bool:
    """Whether a body's unknowns lie in the given range."""
    mine = terms.unknowns(elastic.gather)
    if mine is None:
        raise full_body(elastic)
    return first <= mine.start and mine.stop <= last


def full_body(elastic: Elastic) -> InputError:
    """The error of a body whose points cannot be sampled."""
    return InputError(say(f"body '{elastic.name}'", "a reduced body", "a full one"))


def by_energy(members: list[Elastic], start: int, states: np.ndarray) -> np.ndarray:
    """Roots of the compliance (s, r, r), by which the forces of a component in states (s, r) count
    as energies.

        C^(1/2),    C = sum_i v_i v_i^T / (|l_i| + l),    K v_i = l_i v_i

    K is the tangent of the first run, l the least of its eigenvalues that rigid motions do not
    have. The modes are orthonormal in the mass.
    """
    found = np.empty((*states.shape, states.shape[1]))
    for root, state in zip(found, states, strict=True):
        K = np.zeros_like(root)
        for elastic in members:
            mine = slice(
                sampled_gather(elastic).columns.start - start,
                sampled_gather(elastic).columns.stop - start,
            )
            K[mine, mine] += stiffness(elastic, state[mine])
        values, vectors = np.linalg.eigh(K)
        sizes = np.abs(values)
        root[:] = compliance_root(values, vectors, float(sizes[sizes > ROUND * sizes.max()].min()))
    return found


def compliance_root(values: np.ndarray, vectors: np.ndarray, least: float) -> np.ndarray:
    """Root of a compliance (r, r), of eigenvalues l (r,) and vectors v (r, r) of a tangent.

        C^(1/2),    C = sum_i v_i v_i^T / (|l_i| + least)

    which is positive definite whatever the signs of l are.
    """
    return np.asarray((vectors / np.sqrt(np.abs(values) + least)).T)


def stiffness(elastic: Elastic, state: np.ndarray) -> np.ndarray:
    """Tangent (r, r) of a reduced body in a state (r,) of its own unknowns."""
    gather = sampled_gather(elastic)
    points = len(gather.cell)
    modes = gather.rows.shape[1]
    rows = len(gather.offset) // points
    u = (gather.rows @ state + gather.offset).reshape(rows, points, 1)
    D = np.empty((rows, rows, points, 1))
    laws.modulus(gather.law, u, 0.0, gather.section.reshape(len(gather.section), points, 1), D)
    gradients = gather.rows.reshape(rows, points, modes).transpose(1, 0, 2)
    return np.asarray(
        np.tensordot(gradients, D[..., 0].transpose(2, 0, 1) @ gradients, ((0, 1), (0, 1)))
    )


def count(elastic: Elastic, level: Level) -> int:
    """Number of cells or points of a reduced body.

    Cells count up to the largest number of one that has a point.
    """
    cells = terms.cells_of_points(elastic.gather)
    return len(cells) if level is Level.POINTS else int(cells.max()) + 1


def sampled_gather(elastic: Elastic) -> Sampled:
    """The points of a reduced body as dense rows; InputError for a body of a full model.

    A row is a component of the position gradient at a point p, over the r modes.
    """
    rows = dense_rows(elastic.gather)
    if rows is None:
        raise full_body(elastic)
    return rows


def solve(
    runs: Sequence[Run], start: int, tolerance: float, level: Level, measure: Measure | None = None
) -> tuple[Sample, float, float]:
    """Weights of one component, CPU seconds of training and search; a run is its bodies and states
    (s, n) of its own unknowns.

    The unknowns of the component begin at `start`; without a `measure` its forces count as they
    are.

    Of very many points only those in the cells of the solution by cells are searched: it is a
    solution by points, too.
    """
    ecsw.weights_from_gram(ecsw.gram(np.ones((1, 1))), 0.5)  # compiled before the clock starts
    points = sum(count(e, Level.POINTS) for e in runs[0][0])
    # neighbouring states say the same: 40 of a crank-slider were as good as 150
    runs = [(members, thin(states, len(runs) * points)) for members, states in runs]
    if level is Level.ELEMENTS or points <= MANY:
        return search(
            [(training_blocks(*run, start, level, measure), None) for run in runs], tolerance
        )
    begun = clock.process_time()
    by_cell = [list(training_blocks(*run, start, Level.ELEMENTS, measure)) for run in runs]
    totals = [np.concatenate([block.sum(axis=1) for block in blocks]) for blocks in by_cell]
    training = clock.process_time() - begun
    cells, *first = search([(blocks, None) for blocks in by_cell], tolerance)
    # cells that do are a solution by their points, too: the search among these has one from the
    # start
    few = [(*points_in(members, cells.indices), states) for members, states in runs]
    blocks_of_few = (
        training_blocks(members, states, start, level, measure) for members, _, states in few
    )
    sample, *second = search(list(zip(blocks_of_few, totals, strict=True)), tolerance)
    return (
        replace(sample, indices=few[0][1][sample.indices]),
        training + first[0] + second[0],
        first[1] + second[1],
    )


def search(
    runs: Sequence[tuple[Iterable[np.ndarray], np.ndarray | None]], tolerance: float
) -> tuple[Sample, float, float]:
    """Weights from blocks of rows of G (i, p) and b (i,) of every run, with the CPU seconds of
    equations and search.
    """
    begun = clock.process_time()
    if tolerance < ecsw.GRAM_FLOOR:
        R, y = join([ecsw.compress(blocks, b) for blocks, b in runs])
        middle = clock.process_time()
        sample = ecsw.weights(R, tolerance, b=y)
    else:
        normal = add([ecsw.gram(blocks, b) for blocks, b in runs])
        middle = clock.process_time()
        sample = ecsw.weights_from_gram(normal, tolerance)
    return sample, middle - begun, clock.process_time() - middle


def join(parts: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """The compressed form R (p, p), y (p,) of several, each divided by the norm of its b; those
    without forces are left out.
    """
    if len(parts) == 1:
        return parts[0]
    sizes = [float(np.linalg.norm(y)) for _, y in parts]
    scaled = [(R / size, y / size) for (R, y), size in zip(parts, sizes, strict=True) if size > 0.0]
    return (
        ecsw.compress(np.vstack([R for R, _ in scaled]), np.concatenate([y for _, y in scaled]))
        if scaled
        else parts[0]
    )


def add(parts: Sequence[Gram]) -> Gram:
    """The normal equations of several, each divided by the norm of its b; those without forces are
    left out.
    """
    loaded = [part for part in parts if part.bb > 0.0]
    if len(parts) == 1 or not loaded:
        return parts[0]
    A, c = (sum(getattr(part, name) / part.bb for part in loaded) for name in ("A", "c"))
    return Gram(np.asarray(A), np.asarray(c), float(len(loaded)))


def thin(states: np.ndarray, points: int) -> np.ndarray:
    """Training states (s, n), evenly fewer where there are very many, with all of the start."""
    wanted = max(LEAST, WORK // points)
    if len(states) <= wanted:
        return states
    spread = np.linspace(START, len(states) - 1, wanted - START).round().astype(np.int64)
    return states[np.union1d(np.arange(START), spread)]


def points_in(members: list[Elastic], cells: np.ndarray) -> tuple[list[Elastic], np.ndarray]:
    """The bodies with the points of some cells (i,) only, numbered through all bodies, and the
    numbers (k,) of these points.
    """
    few = []
    numbers = []
    cell = 0
    point = 0
    for elastic in members:
        mask = np.zeros(count(elastic, Level.ELEMENTS))
        mask[cells[(cells >= cell) & (cells < cell + len(mask))] - cell] = 1.0
        numbers.append(point + np.flatnonzero(mask[sampled_gather(elastic).cell]))
        few.append(weighted(elastic, mask, Level.ELEMENTS))
        cell, point = cell + len(mask), point + count(elastic, Level.POINTS)
    return few, np.concatenate(numbers)


def training_blocks(
    members: list[Elastic],
    states: np.ndarray,
    start: int,
    level: Level,
    measure: Measure | None = None,
) -> Iterator[np.ndarray]:
    """Rows (s r) of the training matrix for blocks of states (s, r).

        G_(s,i),e = (U_e^T F_e(q_s))_i

    Columns e are cells or points of all bodies of the component.
    """
    points = sum(len(sampled_gather(e).cell) for e in members)
    # blocks of states, so that forces of all points stay below BLOCK numbers
    block = max(1, min(32, BLOCK // (points * states.shape[1])))
    for first in range(0, len(states), block):
        part = states[first : first + block]
        G = np.zeros((*part.shape, sum(count(e, level) for e in members)))
        at = 0
        for elastic in members:
            columns = sampled_gather(elastic).columns
            size = count(elastic, level)
            mine = slice(columns.start - start, columns.stop - start)
            G[:, mine, at : at + size] = forces(elastic, part[:, mine], level)
            at += size
        yield (G if measure is None else measure(part) @ G).reshape(-1, at)


def forces(elastic: Elastic, states: np.ndarray, level: Level) -> np.ndarray:
    """Contributions of cells or points e to the force on the body's own unknowns.

        U_e^T F_e(q_s)    (s, r, e)

    of states (s, r).
    """
    gather = sampled_gather(elastic)
    points = len(gather.cell)
    modes = gather.rows.shape[1]
    rows = len(gather.offset) // points  # components of a position gradient, k c
    u = (gather.rows @ states.T + gather.offset[:, None]).reshape(rows, points, len(states))
    section = np.repeat(gather.section.reshape(len(gather.section), points, 1), len(states), axis=2)
    S = np.empty_like(u)
    laws.stress(gather.law, u, u, 0.0, section, S)
    out = np.matmul(
        S.transpose(1, 2, 0), gather.rows.reshape(rows, points, modes).transpose(1, 0, 2)
    ).reshape(points, -1)
    if level is Level.ELEMENTS:
        out = csr_array((np.ones(points), (gather.cell, np.arange(points)))) @ out
    return out.reshape(-1, len(states), modes).transpose(1, 2, 0)


def apply(system: System, selections: tuple[Selection, ...]) -> System:
    """The hyper-reduced system: rows of the storages, and quadrature weights times ECSW weights w.

        F_r ~ sum_e w_e U_e^T F_e

    `system` may be the reduced system of any parameters, with the components on which the
    selections were trained.
    """
    spans = {name: (first, last) for name, first, last in system.components}
    system = multiply_out(system)
    elastic = list(system.elastic)
    for selection in selections:
        start = 0
        for number, member in enumerate(system.elastic):
            if owns(member, *spans[selection.component]) and has_points(member):
                size = count(member, selection.level)
                weights = np.zeros(size)
                mine = (selection.sample.indices >= start) & (
                    selection.sample.indices < start + size
                )
                weights[selection.sample.indices[mine] - start] = selection.sample.weights[mine]
                elastic[number] = weighted(member, weights, selection.level)
                start += size
    return replace(
        system,
        elastic=tuple(
            one for one in elastic if not has_points(one) or len(terms.cells_of_points(one.gather))
        ),
    )


def weighted(elastic: Elastic, weights: np.ndarray, level: Level) -> Elastic:
    """A reduced body with quadrature weights times weights (e,) of its cells or (p,) of its points;
    zeros are left out.
    """
    point = weights if level is Level.POINTS else weights[terms.cells_of_points(elastic.gather)]
    chosen = np.flatnonzero(point > 0)
    return replace(elastic, gather=terms.choose_points(elastic.gather, chosen, point[chosen]))


def kept(system: System) -> dict[str, tuple[int, int]]:
    """Numbers of cells and of points in use, by body.

    (cells, points) of every body with points; after hyper-reduction those with a weight.
    """
    found = {elastic.name: terms.cells_of_points(elastic.gather) for elastic in system.elastic}
    return {
        name: (len(np.unique(cells)), len(cells)) for name, cells in found.items() if len(cells)
    }
