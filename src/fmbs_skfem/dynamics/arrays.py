r"""Many parameter values of one reduced structure advance together, written over an array namespace: NumPy, CuPy or jax.numpy.

    u_b = G xi_b + g,   S_b = phi(u_b; section_b),   y_b = P xi_b + y0_b,   f_b = G^T S_b,   b = 1..B
    dz_b = - K_b^-1 (c (M q'' + f) + Phi_q^T lambda, Phi)_b

The method is that of `stepping`: generalized-alpha, extrapolated accelerations, the same judgement of corrections. What differs is
the form: all members are rows of arrays, a member that has converged is masked, and the factors are explicit inverses, renewed
where the iteration contracts slowly. No function assigns to parts of arrays. `integrate_many` is faster on processors; this form is
for accelerators:

    integrate_arrays(systems, scheme, 3.0, xp=cupy, host=cupy.asnumpy)
    integrate_arrays(systems, scheme, 3.0, xp=jax.numpy, compiled=jax.jit)        with jax_enable_x64

Laws: cables and planar membranes at sampled points, without stiffness damping; constraints up to products of two probe rows; loads
with a history. Others are refused. A member whose iteration fails runs again alone, with halved steps.

Source: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..bodies.laws import Law
from ..core.errors import InputError, SolverError, say
from ..core.linalg import as_dense
from ..systems import kernels
from ..systems.system import Elastic, Sampled, System
from . import array_laws, array_step, integration, stepping
from .array_step import Array, Data, Group, State, Structure, Trial
from .batch import Entry, Result, prepared, signature, single
from .scheme import GeneralizedAlpha, Newton, method_of, steps_in
from .stepping import Method
from .trajectory import Statistics, Trajectory

REMEDY = "use integrate_many"


def integrate_arrays(
    systems: Sequence[System],
    schemes: GeneralizedAlpha | Sequence[GeneralizedAlpha],
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    xp: Any = np,
    host: Callable[[Array], np.ndarray] = np.asarray,
    compiled: Callable[[Callable[..., Any]], Callable[..., Any]] = lambda function: function,
) -> list[Result]:
    """As `integrate_many`, over the namespace `xp`; `host` copies an array to NumPy, `compiled` may compile pure functions."""
    chosen = [schemes] * len(systems) if isinstance(schemes, GeneralizedAlpha) else list(schemes)
    if len(chosen) != len(systems):
        raise InputError(say("integrate_arrays: schemes", f"one for all or {len(systems)}", len(chosen)))
    found: dict[int, Result] = {}
    entries = []
    for number, (system, scheme) in enumerate(zip(systems, chosen, strict=True)):
        check(system)
        try:
            entry = prepared(number, system, scheme, steps_in(scheme, duration))
        except SolverError as error:
            found[number] = error
            continue
        entries.append(entry)
    members = alike(entries)
    if members:
        found |= march(members, newton or Newton(), every, xp, host, compiled)
    for k in set(range(len(systems))) - set(found):
        found[k] = single(systems[k], chosen[k], duration, newton or Newton(), every)
    return [found[k] for k in range(len(systems))]


def check(system: System) -> None:
    """Refuse what is not written over arrays."""
    for part in system.elastic:
        array_laws.check(sampled(part), part.name)
        if part.beta > 0.0:
            raise InputError(say(f"body '{part.name}'", "no stiffness-proportional damping", f"{part.beta} s", REMEDY))
    if system.loads.laws:
        raise InputError(say("loads", "terms on probe rows", system.loads.laws[0].kind.name.lower(), REMEDY))
    if (system.constraints.signal < -1).any():
        raise InputError(say("joints", "products of probe rows", "an angle", REMEDY))


def alike(entries: Sequence[Entry | None]) -> list[Entry]:
    """Members that are ready, all of the same signature."""
    ready = [entry for entry in entries if entry is not None]
    if len({signature(entry) for entry in ready}) > 1:
        raise InputError(say("integrate_arrays", "systems with the same basis and structure", "different ones", REMEDY))
    return ready


def flattened(entries: list[Entry], newton: Newton, xp: Any) -> tuple[Structure, Data]:
    """Structure and arrays of all members."""
    systems = [entry.model.system for entry in entries]
    first, arrays = systems[0], [entry.model.arrays for entry in entries]
    gathers = [[sampled(part) for part in system.elastic] for system in systems]
    shapes = tuple((len(g.offset) // (first.dim * len(g.cell)), first.dim, len(g.cell)) for g in gathers[0])
    structure = Structure(xp, tuple(Law(g.law) for g in gathers[0]), tuple(g.columns for g in gathers[0]), shapes)
    stack = partial(stacked, xp)
    groups = tuple(
        Group(stack(g.jets), stack(g.offset), stack([part[k].section[:, 0] for part in gathers])) for k, g in enumerate(gathers[0])
    )
    methods = [method_of(e.scheme, newton, e.scheme.step, e.model.system)[:8] for e in entries]
    terms, loads, j = first.constraints, first.loads, len(first.probes.offset)
    data = Data(
        method=stack([np.array(method)[:, None] for method in methods]),
        mass=stack([as_dense(s.mass) for s in systems]),
        damping=stack([as_dense(s.damping) for s in systems]),
        stiffness=stack([as_dense(s.stiffness) for s in systems]),
        load=stack([s.loads.constant for s in systems]),
        norm=stack([A.norm for A in arrays]),
        groups=groups,
        P=stack(as_dense(first.probes.matrix)),
        offset=stack([s.probes.offset for s in systems]),
        terms=stack([A.terms.value for A in arrays]),
        term_rows=stack(incidence(terms.row, len(terms.names))),
        first=stack(incidence(terms.i, j)),
        second=stack(incidence(terms.j, j)),
        quadratic=stack(terms.j >= 0),
        loads=stack([A.forces.value for A in arrays]),
        load_rows=stack(incidence(loads.row, j)),
    )
    return structure, data


def sampled(part: Elastic) -> Sampled:
    """The gather of a body that may be written over arrays."""
    if not isinstance(part.gather, Sampled):
        raise InputError(say(f"body '{part.name}'", "sampled points", type(part.gather).__name__, REMEDY))
    return part.gather


def stacked(xp: Any, parts: Any) -> Array:
    """Numbers as an array of float64 of the namespace."""
    array = xp.asarray(np.asarray(parts, dtype=np.float64))
    if array.dtype != np.float64:
        raise InputError(say("integrate_arrays", "arrays of float64", array.dtype, "set jax_enable_x64"))
    return array


def incidence(places: np.ndarray, count: int) -> np.ndarray:
    """One row a term with 1 at its place, zeros for places below 0."""
    rows = np.zeros((len(places), count))
    on = np.flatnonzero(places >= 0)
    rows[on, places[on]] = 1.0
    return rows


def picked(d: Data, rows: Array) -> Data:
    """The data of some members."""
    shared = ("groups", "P", "term_rows", "first", "second", "quadratic", "load_rows")
    own = {name: array[rows] for name, array in d._asdict().items() if name not in shared}
    return d._replace(groups=tuple(g._replace(section=g.section[rows]) for g in d.groups), **own)


class Functions(NamedTuple):
    """The pure functions of a step, compiled where the namespace can."""

    predict: Callable[..., Any]
    correction: Callable[..., Any]
    inverses: Callable[..., Any]
    accept: Callable[..., Any]
    settle: Callable[..., Any]
    chosen: Callable[..., Any]


RULES = (
    array_step.predict,
    array_step.correction,
    array_step.inverses,
    array_step.accept,
    array_step.settle,
    array_step.chosen,
)


def renewed(f: Functions, xp: Any, d: Data, inverse: Array, q: Trial, signals: Array, need: np.ndarray) -> Array:
    """Inverses anew for the members that need it; their number is rounded up to a power of two, to compile few shapes."""
    rows = np.flatnonzero(need)
    place = np.zeros(len(need), dtype=np.int64)
    place[rows] = np.arange(len(rows))
    padded = xp.asarray(np.resize(rows, 1 << int(len(rows) - 1).bit_length()))
    try:
        fresh = f.inverses(picked(d, padded), Trial(*(part[padded] for part in q)), signals[padded])
    except np.linalg.LinAlgError:
        if len(rows) == 1:
            return xp.where(xp.asarray(need)[:, None, None], xp.nan, inverse)
        for half in np.array_split(rows, 2):
            inverse = renewed(f, xp, d, inverse, q, signals, np.isin(np.arange(len(need)), half))
        return inverse
    return xp.where(xp.asarray(need)[:, None, None], fresh[xp.asarray(place)], inverse)


def verdicts(
    run: Run, change: np.ndarray, iteration: int, norm: np.ndarray, last: np.ndarray, fresh: np.ndarray, grown: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `stepping.judge`: which members have converged, which have failed, and whose inverses are slow, (b,) each.

    `grown`: whose corrections of the multipliers grow, as in `stepping.apply`.
    """
    rate = np.divide(norm, last, out=np.ones_like(norm), where=last > 0.0)
    finite = np.isfinite(norm)
    sure = fresh | (iteration > 0)
    enough = np.array([stepping.goal(method, size, iteration) for method, size in zip(run.methods, change, strict=True)])
    floor = np.array([method.floor for method in run.methods])
    small = sure & (norm <= np.maximum(stepping.FLOOR * enough, floor))
    done = finite & (small | ((rate < 1.0) & (norm * rate <= enough * (1.0 - rate)))) & (fresh | ~grown)
    lost = ~finite | (~done & fresh & (rate > 2.0) & (iteration > 3))
    return done, lost, grown | (rate > np.where(done, 1.0, 5.0) * run.newton.slow) & (iteration > 0)


@dataclass(frozen=True)
class Run:
    """What the steps share."""

    f: Functions
    data: Data
    newton: Newton
    methods: list[Method]  #: (b,)
    mass: np.ndarray  #: (b,) largest of every member [kg]
    xp: Any
    host: Callable[[Array], np.ndarray]
    stale: np.ndarray  #: (b,) bool: inverses to be renewed before their next use
    counters: np.ndarray  #: (2, b) iterations and inversions


def solved(
    run: Run, q: Trial, inverse: Array, live: np.ndarray, signals: tuple[Array, Array], change: np.ndarray
) -> tuple[Trial, Array, np.ndarray]:
    """Newton's iteration of one step from the prediction `q`: the state, the inverses, and which members have converged."""
    active, good, fresh = live.copy(), np.zeros_like(live), np.zeros_like(live)
    last, pulled = np.zeros(len(live)), np.full(len(live), np.inf)
    for iteration in range(run.newton.iterations):
        need = active & run.stale
        if need.any():
            inverse = renewed(run.f, run.xp, run.data, inverse, q, signals[0], need)
            run.stale[need], fresh[need] = False, True
        run.counters[:] += np.stack([active, need])
        moved, size, force = run.f.correction(run.data, inverse, q, *signals)
        q = run.f.chosen(run.xp.asarray(active), moved, q)
        norm, pull = run.host(size), run.host(force)
        grown = (pull > pulled) & (pull > np.array([method.tolerance for method in run.methods]) * run.mass)
        done, lost, slow = verdicts(run, change, iteration, norm, last, fresh, grown)
        run.stale[active & slow] = True
        fresh &= ~run.stale
        good |= active & done
        active &= ~done & ~lost
        last, pulled = norm, pull
        if not active.any():
            break
    return q, inverse, good


def march(
    entries: list[Entry], newton: Newton, every: int | np.ndarray, xp: Any, host: Callable[[Array], np.ndarray], compiled: Any
) -> dict[int, Result]:
    """Trajectories of the members that take all steps in full, by number."""
    cpu, wall = clock.process_time(), clock.perf_counter()
    structure, data = flattened(entries, newton, xp)
    f = Functions(*(compiled(partial(rule, structure)) for rule in RULES))
    steps, count = len(entries[0].signals), len(entries)
    kept, rows = integration.kept_steps(every, steps), np.full(steps + 1, -1)
    rows[kept] = np.arange(len(kept))
    methods = [method_of(e.scheme, newton, e.scheme.step, e.model.system) for e in entries]
    stale, counters = np.ones(count, dtype=bool), np.zeros((2, count), dtype=np.int64)
    mass = np.array([entry.model.system.mass.diagonal().max(initial=0.0) for entry in entries])
    run = Run(f, data, newton, methods, mass, xp, host, stale, counters)
    state, histories, live = start(entries, data, xp), signals_of(entries, xp), np.ones(count, dtype=bool)
    size = data.mass.shape[1] + data.term_rows.shape[1]
    steady = kernels.steady(entries[0].model.arrays.terms)
    inverse, out = xp.zeros((count, size, size)), [snapshot(state._replace(v=stacked(xp, [e.start.v for e in entries])), host)]
    for step in range(steps):
        on_joints, on_loads = histories[0][:, step], histories[1][:, step]
        now = on_joints[:, 0], on_loads
        q, inverse, good = solved(run, f.predict(data, state), inverse, live, now, host(state.change))
        live &= good
        state = f.accept(data, state, q, min(step + 1, stepping.HISTORY), xp.asarray(live))
        if not steady:
            state, old = f.settle(data, state, inverse, on_joints, xp.asarray(live))
            run.stale[host(old)] = True
        if not live.any():
            return {}
        if rows[step + 1] >= 0:
            out.append(snapshot(state, host))
    seconds = clock.process_time() - cpu, clock.perf_counter() - wall
    motions = [np.stack(parts, axis=1) for parts in zip(*out, strict=True)]
    motions[3] = motions[3] / host(data.method[:, 7])[:, None]
    return {entries[b].number: trajectory(entries, int(b), kept, motions, run, seconds) for b in np.flatnonzero(live)}


def start(entries: list[Entry], d: Data, xp: Any) -> State:
    """Consistent initial states."""
    x, v, a, multipliers = (stacked(xp, [entry.start[k] for entry in entries]) for k in range(4))
    early, late = (stacked(xp, [entry.start.shift[k] for entry in entries]) for k in range(2))
    multipliers = multipliers * d.method[:, 7]
    history, past = (xp.stack([part, xp.zeros_like(part), xp.zeros_like(part)], axis=1) for part in (a, multipliers))
    known = xp.zeros(len(entries), dtype=int), xp.full(len(entries), xp.inf)
    return State(x, v + early, a + late, a, multipliers, history, past, *known)


def signals_of(entries: list[Entry], xp: Any) -> tuple[Array, Array]:
    """Histories of the terms of constraints (b, s, 4, t), with three derivatives, and of loads (b, s, l); 1 where there is none."""
    system, signals = entries[0].model.system, np.stack([entry.signals for entry in entries])
    many = len(system.signals)
    found = np.zeros((*signals.shape[:2], 4, many + 1))
    found[:, :, 0, -1] = 1.0
    for k in range(signals.shape[2] // max(many, 1)):
        found[:, :, k, :many] = signals[:, :, k * many : (k + 1) * many]
    return stacked(xp, found[:, :, :, system.constraints.signal]), stacked(xp, found[:, :, 0, system.loads.signal])


def snapshot(state: State, host: Callable[[Array], np.ndarray]) -> tuple[np.ndarray, ...]:
    """x, v, q'' and multipliers of all members, on the host."""
    return tuple(np.array(host(part)) for part in (state.x, state.v, state.acceleration, state.multipliers))


def trajectory(
    entries: list[Entry], b: int, kept: np.ndarray, motions: list[np.ndarray], run: Run, seconds: tuple[float, float]
) -> Trajectory:
    """The motion of a member; seconds are shared out evenly."""
    entry, count = entries[b], len(entries)
    iterations, inversions = (int(k) for k in run.counters[:, b])
    totals = Statistics(
        len(entry.signals), iterations, inversions, 0, seconds[0] / count, seconds[1] / count, f"inverses, {count} members together"
    )
    x, v, a, multipliers = (part[b] for part in motions)
    return Trajectory(entry.model.system, entry.scheme.step * kept, x, v, a, multipliers, totals)
