r"""What a model costs: products of matrices by count, the pieces of its time step by the clock, and
whether training it pays.

    p = sum_b N_b (w r_b + r_b^2),    s = p_system / p                                                          (46), (47)
    a training pays after  t_training / (t_full - t_reduced)  runs

Scalar multiplications p of the products U^T K U in the reduced tangent K_r, for components b with
r_b modes and N_b coordinates that the kept cells touch, where K has at most w non-zeros a row.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690, section 3.4.2 and
Table 1.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...core.algebra.linalg import distinct
from ...core.compiling.structs import Callback, Routine, address_of, invoke, opener, packed, routine
from ...core.storage.records import dataclass
from ...dynamics.compiled_step import factors
from ...dynamics.compiled_step.large import Large
from ...dynamics.compiled_step.step import Step
from ...dynamics.initial import first_step
from ...dynamics.scheme import GeneralizedAlpha, Newton, method_of
from ...dynamics.trajectory import Trajectory
from ...systems import evaluation
from ...systems.compiled import Compiled, compile_system, signal_table
from ...systems.system import Elastic, System
from ...systems.terms import elastic as terms
from ..hyper import sampling

BURST = 0.005  #: CPU time of one measurement [s]
# on an idle core two or three measurements agree so; a set number of fifteen takes 12 of the 16 s
# of a comparison of the spin-up
CLOSE = 0.02  #: difference of the two best measurements that agree
SOLUTIONS = 5  #: of which one is timed
TRIES = 5  #: of measurements that contradict each other
STEP = 1e-3  #: of measurements that do not depend on it [s]
FAST = 1.5  #: times as fast as the full model, from which a reduced model pays: below that one more full model is no worse
#: pieces of the time step
FORCE_PRODUCTS, TANGENT_PRODUCTS, FORCE, TANGENT, FACTOR, SOLUTION = range(6)


@dataclass(frozen=True)
class Payoff:
    """Whether a reduced model pays, by CPU times [s]: of a full run, of the training with its full
    runs, of a reduced run.

    The time of a reduced run that fails is NaN.
    """

    full_s: float
    training_s: float
    run_s: float
    doubt: str = ""  #: why no model was made

    @property
    def speedup(self) -> float:
        """How many times as fast as the full model the reduced one is.

            full_s / run_s

        of one run each.
        """
        return self.full_s / self.run_s

    @property
    def pays(self) -> bool:
        """Whether it is so much faster that its training is worth while for many runs."""
        return not self.doubt and self.speedup >= FAST

    @property
    def runs(self) -> float | None:
        """Runs after which the training has paid.

            training_s / (full_s - run_s)

        None where it does not pay.
        """
        return self.training_s / (self.full_s - self.run_s) if self.pays else None

    @property
    def reason(self) -> str:
        """Why it does not pay; nothing where it does."""
        if self.doubt:
            return self.doubt
        if math.isnan(self.speedup):
            return "a run of it fails"
        return "" if self.pays else f"{self.speedup:.2g} times as fast as the full model"

    @property
    def words(self) -> str:
        """All of that in a line."""
        full, training, run = map(seconds_in_words, (self.full_s, self.training_s, self.run_s))
        told = (
            f"does not pay: {self.reason}"
            if self.runs is None
            else f"pays from {math.ceil(self.runs)} runs"
        )
        reduced = "" if math.isnan(self.run_s) and self.doubt else f"; reduced {run}"
        return f"full: {full} a run; training {training}{reduced}: {told}"

    @property
    def report(self) -> dict[str, Any]:
        """The same for reports."""
        speedup = None if math.isnan(self.speedup) and self.doubt else self.speedup
        return {"pays": self.pays, "pays_after_runs": self.runs, "speedup": speedup}


def seconds_in_words(seconds: float) -> str:
    """A time [s] with two digits, in milliseconds below a tenth of a second."""
    return (
        "-"
        if math.isnan(seconds)
        else f"{1e3 * seconds:.2g} ms"
        if seconds < 0.1
        else f"{float(f'{seconds:.2g}'):g} s"
    )


def bandwidth(full: System) -> int:
    """w: most non-zeros in a row of the elastic tangent of a body: functions that its cells couple
    with one.

    In coordinates: functions times space dimensions; 0 without elastic bodies.
    """
    reads = (_reads(full, elastic) for elastic in full.elastic)
    return (
        max(
            (int(np.diff(csr_array(one.T @ one).indptr).max(initial=0)) for one in reads), default=0
        )
        * full.dim
    )


def _reads(full: System, elastic: Elastic) -> csr_array:
    """Functions (e, b) of the cells of a body."""
    return terms.functions_read(elastic.gather, len(full.lift.offset) // full.dim)


def touched(full: System, kept: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Coordinates touched by the kept cells (i,) of every body.

    `kept` are numbers (i,) of cells by body; every function that they read has as many coordinates
    as space dimensions.
    """
    known = {elastic.name: elastic for elastic in full.elastic}
    return {
        name: len(distinct(_reads(full, known[name])[cells].indices)) * full.dim
        for name, cells in kept.items()
    }


def kept_cells(reduced: System) -> dict[str, np.ndarray]:
    """Numbers (i,) of the cells with points in use, by body.

    A body without any point, as of a polynomial, is left out.
    """
    found = {
        elastic.name: distinct(terms.cells_of_points(elastic.gather)) for elastic in reduced.elastic
    }
    return {name: cells for name, cells in found.items() if len(cells)}


def kept_by_component(reduced: System, components: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """`elements`, cells with points in use, and `points` in use, by component.

    Counts by component: {"elements": {component: cells}, "points": {component: points}}.
    """
    known = sampling.kept(reduced).items()
    return {
        key: by_component({name: counts[k] for name, counts in known}, components)
        for k, key in enumerate(("elements", "points"))
    }


def by_component(
    values: Mapping[str, int], components: Mapping[str, Sequence[str]]
) -> dict[str, int]:
    """Sums over the bodies of every component.

    Bodies without a value count as 0.
    """
    return {
        name: sum(values.get(body, 0) for body in members) for name, members in components.items()
    }


def multiplications(dofs: Mapping[str, int], modes: Mapping[str, int], width: int) -> int:
    """p from the coordinates touched and the modes of every component.

        p = sum_b N_b (w r_b + r_b^2)    (46)

    with w = `width`, N_b = `dofs`, r_b = `modes`. Source: Hou, Liu, Hu 2020, doi
    10.1016/j.cma.2019.112690.
    """
    return sum(
        dofs[name] * (width * modes[name] + modes[name] ** 2) for name in modes if name in dofs
    )


def tangent_seconds(system: System) -> float:
    """CPU time [s] of one evaluation of the elastic tangent in the unknowns of the system at x0,
    the best of several bursts.
    """
    return bench(compile_system(system))(TANGENT) if len(system.elastic) else 0.0


@dataclass(frozen=True)
class Shares:
    """CPU seconds of a run by kind of work."""

    force_s: float  #: elastic forces and tangents of cells, points or polynomials
    solve_s: float  #: factors of the iteration matrix and solutions
    product_s: float  #: products with the modes: gradients = U x, U^T S, U^T D U


def shares(motion: Trajectory, scheme: GeneralizedAlpha, repeat: int = 15) -> Shares:
    """What the calls of a run cost: the time of one call at x0, measured apart, times the calls
    that the run counted.

    Every iteration has one force, one solution and the products of gather and scatter, every
    factorisation one tangent with its products, unless tangents are turned (`corotation`,
    `turned_tangents`): then it has hardly any, and the turn is part of its own cost.
    """
    system, cost = motion.system, motion.statistics
    calls, factored = cost.iterations, cost.factorisations
    model = compile_system(system)
    if not len(system.elastic):
        return Shares(0.0, 0.0, 0.0)
    one = bench(model, scheme, repeat)
    if model.pattern is not None:
        factor, solution = sparse_seconds(model, scheme)
        return Shares(calls * one(FORCE), factored * factor + calls * solution, 0.0)
    turned = len(model.arrays.corotation.table) > 0 or any(term.turned for term in model.terms)
    tangents = 0 if turned else factored
    solving = calls * one(SOLUTION) + factored * max(
        one(FACTOR) - (0.0 if turned else one(TANGENT)), 0.0
    )
    for _ in range(TRIES):
        moves = one(FORCE_PRODUCTS)
        products = calls * moves + tangents * (0.5 * moves + one(TANGENT_PRODUCTS))
        forces = calls * one(FORCE) + tangents * one(TANGENT)
        if forces > products:
            break  # else another process took the core while one of them was measured
    return Shares(max(forces - products, 0.0), solving, products)


def sparse_seconds(model: Compiled, scheme: GeneralizedAlpha) -> tuple[float, float]:
    """CPU time [s] of a factorisation and of a solution of a large model."""
    step = prepare_step(model, scheme)
    solver = Large(model)
    table = packed(step)
    start = clock.process_time()
    solver.factorise(step)
    middle = clock.process_time()
    for _ in range(SOLUTIONS):
        solver.solve(step, address_of(table))
    return middle - start, (clock.process_time() - middle) / SOLUTIONS


def prepare_step(model: Compiled, scheme: GeneralizedAlpha) -> Step:
    """A step at x0 with a current residual, and the signals at t = 0."""
    system = model.system
    method = method_of(scheme, Newton(), scheme.step, model)
    step = first_step(model, system.x0, np.zeros(system.size), method)
    step.space.x[:], step.space.c[0] = system.x0[model.order], step.method.c
    step.space.signals[: len(system.signals)] = signal_table(system, np.zeros(1))[0]
    evaluation.evaluate(step)
    return step


class Burst(NamedTuple):
    """Calls of one routine, again and again."""

    step: Step
    routine: int
    more: int
    times: int


opened = opener(Burst)


@routine
def repeat_calls(table: Any, _: Any) -> int:
    """The routine of a burst so many times, on a right-hand side that stays as it is."""
    B = opened(table)
    for _ in range(B.times):
        B.step.space.rhs[:] = 1.0
        invoke(B.routine, table, B.more)
    return 0


def bench(
    model: Compiled, scheme: GeneralizedAlpha | None = None, repeat: int = 5
) -> Callable[[int], float]:
    """Seconds of one call of a piece of the time step: CPU time, the best of `repeat` bursts, or of
    fewer where two agree.
    """
    step = prepare_step(model, scheme or GeneralizedAlpha(STEP))
    factorise, solve, _ = factors.doors(model.layout.storage)
    whole = {
        FORCE: evaluation.elastic_forces,
        TANGENT: evaluation.sum_tangents,
        FACTOR: factorise,
        SOLUTION: solve,
    }

    def burst(one: Routine | Callback, more: int, times: int) -> float:
        table = packed(Burst(step, one.address, more, times))
        start = clock.process_time()
        repeat_calls(table)
        return clock.process_time() - start

    def measured(one: Routine | Callback, more: int) -> float:
        burst(one, more, 1)
        times = max(2, int(2 * BURST / max(burst(one, more, 2), 1e-6)))
        found = sorted([burst(one, more, times), burst(one, more, times)])
        while len(found) < repeat and found[1] > (1.0 + CLOSE) * found[0]:
            found = sorted([*found, burst(one, more, times)])
        return found[0] / times

    def seconds(what: int) -> float:
        if what in whole:
            return measured(whole[what], 0)
        name = "force_products" if what == FORCE_PRODUCTS else "tangent_products"
        pieces = [piece for piece in (*model.terms, model.lift) if piece]
        return float(
            sum(
                measured(one, piece.address)
                for piece in pieces
                for one in getattr(piece.routines, name)
            )
        )

    if model.pattern is None:
        factorise(step)  # factors for the solutions
    return seconds
