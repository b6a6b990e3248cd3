r"""What a model costs: products of matrices by count, and the pieces of its time step by the clock.

    p = sum_b N_b (w r_b + r_b^2),    s = p_system / p                                                          (46), (47)

Scalar multiplications p of the products U^T K U in the reduced tangent K_r, for components b with r_b modes and N_b coordinates
that the kept cells touch, where K has at most w non-zeros a row.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690, section 3.4.2 and Table 1.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ..bodies import laws
from ..bodies.body import Cells
from ..core.jit import jit
from ..dynamics import stepping
from ..dynamics.large import Large
from ..dynamics.scheme import GeneralizedAlpha, Newton, method_of
from ..dynamics.start import workspace
from ..dynamics.stepping import Method, Work
from ..dynamics.trajectory import Trajectory
from ..systems import kernels, quartic
from ..systems.compiled import Compiled, compile_system, signal_table
from ..systems.kernels import Arrays
from ..systems.system import Sampled, System

BURST = 0.005  #: CPU time of one measurement [s]
STEP = 1e-3  #: of measurements that do not depend on it [s]
FORCE, TANGENT, FACTOR, SOLUTION, GATHER, PRODUCT, STRESS, MODULUS = range(8)  #: pieces of the time step


def bandwidth(full: System) -> int:
    """w: most non-zeros in a row of the elastic tangent of a body."""
    return max((_row_width(e.gather) for e in full.elastic if isinstance(e.gather, Cells)), default=0)


def _row_width(cells: Cells) -> int:
    basis, count = cells.nodes.shape
    rows, nodes = np.repeat(np.arange(count), basis), cells.nodes.T.ravel() // cells.dim
    incidence = csr_array((np.ones(nodes.size), (rows, nodes)), shape=(count, width_of(cells) // cells.dim))
    if cells.spread is not None:
        incidence = csr_array(incidence @ abs(csr_array(cells.spread)[:: cells.dim, :: cells.dim]))
    return int(np.diff((incidence.T @ incidence).tocsr().indptr).max()) * cells.dim


def width_of(cells: Cells) -> int:
    """Number of coordinates that the cells read, before they are slaved to others."""
    return int(cells.nodes.max()) + cells.dim if cells.spread is None else int(cells.spread.shape[0])


def touched(full: System, kept: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Coordinates touched by the kept cells (i,) of every body."""
    gathers = {e.name: e.gather for e in full.elastic}
    return {name: _touched(gathers[name], numbers) for name, numbers in kept.items()}


def _touched(cells: object, numbers: np.ndarray) -> int:
    if not isinstance(cells, Cells):
        return 0
    rows = (np.unique(cells.nodes[:, numbers])[:, None] + np.arange(cells.dim)).ravel()
    return len(rows) if cells.spread is None else len(np.unique(csr_array(cells.spread)[rows].indices))


def kept_cells(reduced: System) -> dict[str, np.ndarray]:
    """Numbers (i,) of the cells with points in use, by body."""
    return {e.name: np.unique(e.gather.cell) for e in reduced.elastic if isinstance(e.gather, Sampled)}


def kept_points(reduced: System) -> dict[str, int]:
    """Points in use, by body."""
    return {e.name: len(e.gather.cell) for e in reduced.elastic if isinstance(e.gather, Sampled)}


def by_component(values: Mapping[str, int], components: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Sums over the bodies of every component."""
    return {name: sum(values.get(body, 0) for body in members) for name, members in components.items()}


def multiplications(dofs: Mapping[str, int], modes: Mapping[str, int], width: int) -> int:
    """p from the coordinates touched and the modes of every component."""
    return sum(dofs[name] * (width * modes[name] + modes[name] ** 2) for name in modes if name in dofs)


def tangent_seconds(system: System, repeat: int = 5) -> float:
    """CPU time [s] of one evaluation of the elastic tangent in the unknowns of the system at x0, the best of several bursts."""
    return bench(system, repeat=repeat)(TANGENT) if len(system.elastic) else 0.0


@dataclass(frozen=True)
class Shares:
    """CPU seconds of a run by kind of work."""

    force_s: float  #: elastic forces and tangents of cells, points or polynomials
    solve_s: float  #: factors of the iteration matrix and solutions
    product_s: float  #: products with the modes: jets = U x, U^T S, U^T D U


def shares(motion: Trajectory, scheme: GeneralizedAlpha, repeat: int = 3) -> Shares:
    """What the calls of a run cost: the time of one call at x0, measured apart, times the calls that the run counted.

    Every iteration has one force, one solution and the products of gather and scatter, every factorisation one tangent with its
    products, unless tangents are turned (`turning`): then it has none, and the turn is part of its own cost.
    """
    system, cost = motion.system, motion.statistics
    calls, factored = cost.iterations, cost.factorisations
    model = compile_system(system)
    if not len(system.elastic):
        return Shares(0.0, 0.0, 0.0)
    one = bench(system, scheme, repeat)
    if model.plan is not None:
        factor, solution = sparse_seconds(model, scheme)
        return Shares(calls * one(FORCE), factored * factor + calls * solution, 0.0)
    turned = len(model.arrays.turning.table) > 0
    tangents = 0 if turned else factored
    solving = calls * one(SOLUTION) + factored * max(one(FACTOR) - (0.0 if turned else one(TANGENT)), 0.0)
    if not any(isinstance(e.gather, Sampled) for e in system.elastic):
        return Shares(calls * one(FORCE) + tangents * one(TANGENT), solving, 0.0)
    gather = one(GATHER)
    products = calls * 2 * gather + tangents * (gather + one(PRODUCT))
    return Shares(calls * one(STRESS) + tangents * one(MODULUS), solving, products)


def sparse_seconds(model: Compiled, scheme: GeneralizedAlpha, times: int = 5) -> tuple[float, float]:
    """CPU time [s] of a factorisation and of a solution of a large model."""
    work, method, signals = prepared(model, scheme)
    solver = Large(model)
    start = clock.process_time()
    solver.factorise(work, method)
    middle = clock.process_time()
    for _ in range(times):
        solver.solve(work, method, signals)
    return middle - start, (clock.process_time() - middle) / times


def prepared(model: Compiled, scheme: GeneralizedAlpha) -> tuple[Work, Method, np.ndarray]:
    """Work space at x0 with a current residual, the method of a step, and the signals at t = 0."""
    work = workspace(model)
    work.x[:] = model.system.x0[model.order]
    method = method_of(scheme, Newton(), scheme.step, model)
    signals = signal_table(model.system, np.zeros(1))[0]
    stepping.residual(model.arrays, work, method.c, signals)
    return work, method, signals


def bench(system: System, scheme: GeneralizedAlpha | None = None, repeat: int = 5) -> Callable[[int], float]:
    """Seconds of one call of a piece of the time step: CPU time, the best of several bursts."""
    model = compile_system(system)
    work, method, signals = prepared(model, scheme or GeneralizedAlpha(STEP))
    W = np.zeros_like(model.arrays.mass.store)

    def burst(what: int, times: int) -> float:
        start = clock.process_time()
        if what in (STRESS, MODULUS):
            _repeat_laws(model.arrays, work, W, what == MODULUS, times)
        else:
            _repeat(what, model.arrays, work, method, signals, W, times)
        return clock.process_time() - start

    def seconds(what: int) -> float:
        burst(what, 1)
        times = max(2, int(2 * BURST / max(burst(what, 2), 1e-6)))
        return min(burst(what, times) for _ in range(repeat)) / times

    if model.plan is None:
        seconds(FACTOR)  # factors for the solutions
    return seconds


@jit
def _repeat(what: int, A: Arrays, w: Work, method: Method, signals: np.ndarray, W: np.ndarray, times: int) -> None:
    """One piece of the time step, again and again."""
    for _ in range(times):
        if what == FORCE:
            kernels.clear(w.acceleration)
            kernels.add_elastic_force(A.groups, A.lift, A.lift_offset, w.x, w.v, w.body, w.work, w.acceleration)
        elif what == TANGENT:
            kernels.clear(W.reshape(-1))
            kernels.add_elastic_tangent(A.groups, A.scatter, A.lift, A.lift_offset, w.x, w.body[0], 0.0, w.work, W)
        elif what == FACTOR:
            stepping.factorise(A, w, method, signals)
        elif what == SOLUTION:
            w.rhs[:] = 1.0
            stepping.solve(w)
        else:
            _products(A, w, W, what == PRODUCT)


@jit
def _repeat_laws(A: Arrays, w: Work, W: np.ndarray, tangents: bool, times: int) -> None:
    """Laws at jets that are there, stresses or moduli, and polynomials, again and again."""
    for g in range(len(A.groups.table)):
        row = A.groups.table[g]
        if row[kernels.SAMPLED] == kernels.QUARTIC:
            x = w.x[row[kernels.FIRST] : row[kernels.FIRST] + row[kernels.COUNT]]
            for _ in range(times):
                if tangents:
                    quartic.call_tangent(A.groups.quartics, kernels.coefficients(A.groups, g), x, w.work[0], row[kernels.FIRST], W)
                else:
                    quartic.call_force(A.groups.quartics, kernels.coefficients(A.groups, g), x, w.work[0], w.work[2][: len(x)])
            continue
        u, section = kernels.gather(A.groups, g, w.x, w.body[0], 1.0, w.work[0]), kernels.section_view(A.groups, g)
        S = w.work[2][: u.size].reshape(u.shape)
        D = w.work[1][: u.shape[0] * u.size].reshape(u.shape[0], u.shape[0], u.shape[1], u.shape[2])
        for _ in range(times):
            if tangents:
                laws.call_modulus(A.groups.laws, row[kernels.LAW], u, 0.0, section, D)
            else:
                laws.call_stress(A.groups.laws, row[kernels.LAW], u, u, 0.0, section, S)


@jit
def _products(A: Arrays, w: Work, W: np.ndarray, tangents: bool) -> None:
    """Products with the modes of sampled points: U x, or U^T D U of a tangent."""
    for g in range(len(A.groups.table)):
        row = A.groups.table[g]
        if row[kernels.SAMPLED] != kernels.SAMPLE:
            continue
        if not tangents:
            kernels.gather(A.groups, g, w.x, w.body[0], 1.0, w.work[0])
            continue
        rows, points = row[kernels.VECTORS] * row[kernels.COMPONENTS], row[kernels.POINTS] * row[kernels.CELLS]
        D = w.work[1][: rows * rows * points].reshape(rows, rows, row[kernels.POINTS], row[kernels.CELLS])
        kernels.add_sampled_tangent(A.groups, g, D, w.work[2], W)
