r"""Many parameter values of one reduced structure advance together, by the compiled step of `stepping`.

    u_b = G xi_b + g,   S_b = phi(u_b; section_b),   f_b = G^T S_b,   b = 1..B

Members share the sampled gather G (the basis at the points) and differ in sections, mass, loads and signals. Side by side, the
gathers and scatters of B members are two products of matrices, for which G is read from memory once; everything else of the time
step (predictor, factors, corrections, acceptance) is that of a single run, member by member, so that both give the same motion up
to round-off below Newton's tolerance. Members that have converged leave the iteration, a step that fails is halved for that member
alone, and a member that fails for good leaves the batch with its error.

Members are taken in blocks whose factors stay in the cache; blocks run in threads, since compiled code holds no interpreter lock.
Members that share no gather (other basis, other structure, full models, polynomials) run one by one.

Source of the method: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from ..core.errors import InputError, SolverError, say
from ..core.linalg import as_dense
from ..systems import kernels
from ..systems.compiled import Compiled, compile_system
from ..systems.kernels import Arrays, Groups, Operator
from ..systems.system import Sampled, System
from . import batch_step, integration, start, stepping
from .batch_step import Members, Room
from .histories import leading_signals
from .integration import integrate
from .scheme import GeneralizedAlpha, Newton, method_of, steps_in
from .start import Start
from .stepping import Method, State, Work
from .trajectory import Statistics, Trajectory

BLOCK = 16  #: members that advance together: their factors fit into a core's cache
#: what every member needs of the work space for itself
OWN = ("pivots", "pull", "x", "v", "acceleration", "multipliers", "angles", "kind")
Result: TypeAlias = Trajectory | SolverError


@dataclass(frozen=True)
class Entry:
    """A member that is ready to start."""

    number: int  #: place in the list of the caller
    scheme: GeneralizedAlpha
    model: Compiled
    start: Start
    signals: np.ndarray  #: (s, k)


@dataclass(frozen=True)
class Block:
    """Members that advance together, their arrays stacked."""

    entries: list[Entry]
    newton: Newton
    kept: np.ndarray  #: (s,) steps after which states are kept
    arrays: Arrays
    members: Members
    state: State
    work: Work
    room: Room
    out: np.ndarray  #: (b, 3, s, n)
    multipliers: np.ndarray  #: (b, s, m)
    counters: np.ndarray  #: (b, 4)


def integrate_many(
    systems: Sequence[System],
    schemes: GeneralizedAlpha | Sequence[GeneralizedAlpha],
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[Result]:
    """Trajectories of all systems from t = 0 over `duration` [s], in their order; the SolverError of a member that failed.

    `schemes` is one for all or one a member, `every` as in `integrate`; `progress` receives the part of the members that is done.
    """
    chosen = [schemes] * len(systems) if isinstance(schemes, GeneralizedAlpha) else list(schemes)
    if len(chosen) != len(systems):
        raise InputError(say("integrate_many: schemes", f"one for all or {len(systems)}", len(chosen)))
    if threads < 1:
        raise InputError(say("integrate_many: threads", "at least 1", threads))
    found: dict[int, Result] = {}

    def work(numbers: Sequence[int]) -> dict[int, Result]:
        return block([(k, systems[k], chosen[k]) for k in numbers], duration, newton or Newton(), every)

    size = max(1, min(BLOCK, -(-len(systems) // threads)))
    blocks = [range(first, min(first + size, len(systems))) for first in range(0, len(systems), size)]
    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads) as pool:
        for part in pool.map(work, blocks):
            found |= part
            if progress:
                progress(len(found) / len(systems))
    return [found[k] for k in range(len(systems))]


def block(
    members: Iterable[tuple[int, System, GeneralizedAlpha]], duration: float, newton: Newton, every: int | np.ndarray
) -> dict[int, Result]:
    """Results of a few members: together where they share a gather and the number of steps, otherwise one by one."""
    found: dict[int, Result] = {}
    alike: dict[tuple[object, ...], list[Entry]] = {}
    alone: list[tuple[int, System, GeneralizedAlpha]] = []
    for number, system, scheme in members:
        try:
            entry = prepared(number, system, scheme, steps_in(scheme, duration))
        except SolverError as error:
            found[number] = error
            continue
        if entry is None:
            alone.append((number, system, scheme))
        else:
            alike.setdefault(signature(entry), []).append(entry)
    for entries in alike.values():
        first = entries[0]
        if len(entries) == 1:
            alone.append((first.number, first.model.system, first.scheme))
            continue
        found |= together(stacked(entries, newton, integration.kept_steps(every, len(first.signals))))
    return found | {number: single(system, scheme, duration, newton, every) for number, system, scheme in alone}


def single(system: System, scheme: GeneralizedAlpha, duration: float, newton: Newton, every: int | np.ndarray) -> Result:
    """One run, or its error."""
    try:
        return integrate(system, scheme, duration, newton, every)
    except SolverError as error:
        return error


def prepared(number: int, system: System, scheme: GeneralizedAlpha, steps: int) -> Entry | None:
    """A member with its consistent start; None where it does not fit into a block."""
    if steps < 1 or not system.elastic or not all(isinstance(part.gather, Sampled) for part in system.elastic):
        return None
    system = start.startable(system, scheme)
    model = compile_system(system)
    signals, broken = leading_signals(system, scheme.step * (1 + np.arange(steps)), scheme.step)
    if broken is not None or not model.arrays.dense:
        return None
    return Entry(number, scheme, model, start.consistent_start(model, scheme), signals)


def signature(entry: Entry) -> tuple[object, ...]:
    """Members with the same signature differ in sections, matrices, loads and coefficients only."""
    A = entry.model.arrays
    shared = A.groups.numbers.copy()
    for part in section_slices(A.groups):
        shared[part] = 0.0
    terms = (A.terms.row, A.terms.signal, A.terms.i, A.terms.j)
    arrays = (
        A.groups.table,
        shared,
        *A.probes,
        *terms,
        A.forces.row,
        A.forces.signal,
        A.forces.laws,
        A.pairs.target,
        A.turning.table,
    )
    full = (A.mass.full, A.damping.full, A.stiffness.full)
    return (entry.model.system.size, entry.signals.shape, full, *(array.tobytes() for array in arrays))


def section_slices(groups: Groups) -> list[slice]:
    """Where the sections of the groups stand in their numbers."""
    table = groups.table
    sizes = table[:, kernels.ROWS] * table[:, kernels.POINTS] * table[:, kernels.CELLS]
    return [slice(int(at), int(at + size)) for at, size in zip(table[:, kernels.SECTION], sizes, strict=True)]


def stacked(entries: list[Entry], newton: Newton, kept: np.ndarray) -> Block:
    """The block of members with the same signature at their starts."""
    models, count = [entry.model for entry in entries], len(entries)
    methods = [method_of(e.scheme, newton, e.scheme.step, e.model.system) for e in entries]
    A, n, m = models[0].arrays, models[0].system.size, models[0].constraints
    groups = A.groups._replace(numbers=A.groups.numbers.copy(), beta=A.groups.beta.copy())
    A = A._replace(groups=groups, damping=filled(A.damping), stiffness=filled(A.stiffness))
    states = [start.first_state(e.model, e.start, h.c) for e, h in zip(entries, methods, strict=True)]
    state = State(*(np.stack(parts) for parts in zip(*states, strict=True)))
    out, multipliers = np.zeros((count, 3, len(kept), n)), np.zeros((count, len(kept), m))
    velocities = np.stack([entry.start.v[entry.model.order] for entry in entries])
    out[:, :, 0] = np.stack([state.x, velocities, state.acceleration], axis=1)
    multipliers[:, 0] = np.stack([entry.start.multipliers for entry in entries])
    members = differences(entries, methods)
    space = workspace(models[0], count), room(models[0], count)
    counters = np.zeros((count, 4), np.int64)
    return Block(entries, newton, kept, A, members, state, *space, out, multipliers, counters)


def filled(matrix: Operator) -> Operator:
    """A matrix that is read from its dense storage, which differs from member to member."""
    return matrix._replace(full=bool(matrix.store.any()), offsets=matrix.offsets[:0], diagonals=matrix.diagonals[:0])


def differences(entries: list[Entry], methods: list[Method]) -> Members:
    """What differs between members, stacked."""
    all_arrays = [entry.model.arrays for entry in entries]
    return Members(
        sections=np.stack([np.concatenate([B.groups.numbers[part] for part in section_slices(B.groups)]) for B in all_arrays]),
        beta=np.stack([B.groups.beta for B in all_arrays]),
        mass=np.stack([B.mass.store for B in all_arrays]),
        lumped=np.stack([np.diagonal(B.mass.store) for B in all_arrays]),
        damping=np.stack([B.damping.store for B in all_arrays]),
        stiffness=np.stack([B.stiffness.store for B in all_arrays]),
        probes_offset=np.stack([B.probes_offset for B in all_arrays]),
        terms=np.stack([B.terms.value for B in all_arrays]),
        forces=np.stack([B.forces.value for B in all_arrays]),
        vectors=np.stack([B.forces.vectors for B in all_arrays]),
        pairs=np.stack([B.pairs.factor for B in all_arrays]),
        load=np.stack([B.load for B in all_arrays]),
        norm=np.stack([B.norm for B in all_arrays]),
        turns=np.stack([B.turning.rows for B in all_arrays]),
        turns_offset=np.stack([B.turning.offset for B in all_arrays]),
        tangents=np.stack([B.turning.numbers for B in all_arrays]),
        signals=np.stack([entry.signals for entry in entries]),
        methods=np.array(methods),
    )


def workspace(model: Compiled, count: int) -> Work:
    """Space of a block: trial states and pivots a member, all else once."""
    one = start.workspace(model)._asdict()
    return Work(**{name: np.stack([array] * count) if name in OWN else array for name, array in one.items()})


def room(model: Compiled, count: int) -> Room:
    """Space for the jets, probe rows and factors of a block."""
    A, n, m = model.arrays, model.system.size, model.constraints
    table = A.groups.table[:, [kernels.VECTORS, kernels.COMPONENTS, kernels.POINTS, kernels.CELLS]]
    u, rate, S = np.zeros((3, count * int(table.prod(axis=1).max(initial=1))))
    x, f = np.zeros((2, count * n))
    P = as_dense(model.system.probes.matrix)
    active, fresh, status, live = (np.zeros(count, np.int64) for _ in range(4))
    live[:] = 1
    factors, probes = (
        np.zeros((count, n + m, n + m)),
        (np.ascontiguousarray(P), np.ascontiguousarray(P.T), np.zeros(count * len(P))),
    )
    return Room(u, rate, S, x, f, np.zeros((count, n)), factors, *probes, active, np.zeros(count), fresh, status, live)


def together(run: Block) -> dict[int, Result]:
    """Results of a block by number of the member."""
    cpu, wall = clock.thread_time(), clock.perf_counter()
    steps, done = run.members.signals.shape[1], 0
    rows = np.full(steps + 1, -1)
    rows[run.kept] = np.arange(len(run.kept))
    failed: dict[int, tuple[int, float, int]] = {}
    while done < steps and run.room.live.any():
        done = batch_step.march(
            run.arrays, run.members, run.state, run.work, run.room, done, rows, run.out, run.multipliers, run.counters
        )
        for b in np.flatnonzero((run.room.live == 1) & (run.room.status != stepping.DONE)):
            status, reached = halved(run, int(b), done - 1, rows)
            if status != stepping.DONE:
                failed[int(b)] = status, reached, done - 1
                run.room.live[b] = 0
    seconds = clock.thread_time() - cpu, clock.perf_counter() - wall
    return {entry.number: result(run, b, seconds, steps, failed.get(b)) for b, entry in enumerate(run.entries)}


def member_space(run: Block, b: int) -> tuple[State, Work]:
    """Views of one member's motion and work space."""
    work = Work(**{name: array[b] if name in OWN else array for name, array in run.work._asdict().items()})
    return State(*(array[b] for array in run.state)), work


def halved(run: Block, b: int, done: int, rows: np.ndarray) -> tuple[int, float]:
    """One member's step after `done` steps with the step halved; status and time of the last failure."""
    entry, (state, work) = run.entries[b], member_space(run, b)
    advance, counters = integration.stepper(entry.model), run.counters[b]
    kept = int(rows[done + 1]), run.out[b], run.multipliers[b], counters
    return integration.halved_step(entry.model, advance, state, work, entry.scheme, run.newton, done, *kept)


def result(run: Block, b: int, seconds: tuple[float, float], steps: int, failed: tuple[int, float, int] | None) -> Result:
    """The trajectory of a member, or its error with the trajectory up to there; seconds are shared out by iterations."""
    entry = run.entries[b]
    share = run.counters[b, stepping.ITERATIONS] / max(1, run.counters[:, stepping.ITERATIONS].sum())
    taken, iterations, factorisations, halvings = (int(k) for k in run.counters[b])
    solver = f"dense LU, {len(run.entries)} members together"
    totals = Statistics(taken, iterations, factorisations, halvings, float(seconds[0] * share), float(seconds[1] * share), solver)
    have = int(np.searchsorted(run.kept, failed[2] if failed else steps, side="right"))
    x, v, a = run.out[b, :, :have]
    motion = Trajectory(entry.model.system, entry.scheme.step * run.kept[:have], x, v, a, run.multipliers[b, :have], totals)
    if failed is None:
        return motion
    return integration.failure(entry.model, member_space(run, b)[1], failed[0], failed[1], motion, entry.scheme)
