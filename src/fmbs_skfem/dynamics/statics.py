r"""Equilibrium of constrained systems by load stepping or over time.

    f(x) - Q(s) + Phi_x^T lambda = 0,  Phi(x, s) = 0,  s = s1 .. 1

What grows with the load factor s and what follows its history: `loading`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array

from ..core import ranks, saddle
from ..core.errors import InputError, Reason, SolverError, say
from ..core.linalg import scaled
from ..core.notices import Notice, Progress, notify
from ..core.records import dataclass
from ..systems import compiled, pressure, probes, responses
from ..systems.compiled import Compiled, compile_system
from ..systems.redundancy import scale_of, without_redundant
from ..systems.system import System
from . import departures, missing_shapes
from .histories import finite_signals
from .linear import linearise
from .loading import RADIAN, parts, ramp
from .names import as_text, row_names, worst
from .scheme import STATIC, Newton, round_off
from .shapes import find_free
from .trajectory import Statistics, Trajectory

SHORTER = 0.55  #: factor of a load step that failed; not 1/2, which would come back to the same load factor
NEAR, FAR = 0.02, 0.2  #: longest corrections over the size of the mechanism, at first and at most
FLOOR = 50.0  #: corrections up to this times the round-off of positions are round-off: thin bodies amplify it
LITTLE, SOLVES = 1e-9, 1e-3  #: of the metric beside a singular tangent, and the rest of the residual that it may leave
SHORTEST = 0.02  #: part of the load step asked for below which the solution is given up


@dataclass(frozen=True)
class Equilibrium:
    """State at one load factor or time."""

    at: float  #: load factor, or time [s]
    x: np.ndarray  #: (n,)
    multipliers: np.ndarray  #: (m,)
    iterations: int
    memory: np.ndarray | None = None  #: (l,) what forces keep of it; None: nothing but what they start with


def unloaded(model: Compiled) -> Equilibrium:
    """The reference, where load steps start."""
    return Equilibrium(0.0, model.system.x0, np.zeros(model.constraints), 0)


def solve_statics(
    system: System,
    steps: int = 10,
    newton: Newton | None = None,
    time: float = 1.0,
    progress: Progress | None = None,
    begin: np.ndarray | None = None,
) -> Trajectory:
    """Equilibria at the load factors 0, 1/steps, ..., 1, as a Trajectory over them; the factor 1 stands for `time` [s].

    Loads without a history and constant displacements grow with the load factor, histories and drives are followed.
    A load step that does not converge is taken in shorter ones, several times if need be; then SolverError carries the equilibria
    found so far. The first iteration begins at `begin` (n,), or at x0.
    """
    newton = newton or Newton(STATIC)
    if steps < 1:
        raise InputError(say("analysis.load_steps", "at least one", steps))
    system = without_redundant(ramp(system, time))
    model = compile_system(system)

    def solve(factor: float, last: Equilibrium) -> Equilibrium:
        return newton_statics(pressure.at_load_factor(model, factor), last, newton, factor, "load factor")

    start = unloaded(model)
    start = start if begin is None else replace(start, x=begin)
    return reach_targets(system, solve, start, np.arange(1, steps + 1) / steps, progress)


def solve_equilibria(system: System, times: np.ndarray, newton: Newton | None = None) -> Trajectory:
    """Equilibria x (s, n) at increasing times (s,) [s]: histories of loads and driven joints move on, without inertia.

    Driven positions make a path of prescribed displacements, which passes limit points of the load. A step between two times that
    does not converge is shortened as in `solve_statics`.
    """
    system = without_redundant(system)
    newton, model = newton or Newton(STATIC), compile_system(system)
    targets = np.asarray(times, dtype=float)
    if targets.ndim != 1 or len(targets) < 1 or not (np.diff(targets) > 0).all():
        raise InputError(say("analysis.times", "increasing times", times))

    def solve(time: float, last: Equilibrium) -> Equilibrium:
        finite_signals(system, np.array([time]))
        return newton_statics(model, last, newton, time, "time [s]")

    start = solve(targets[0], unloaded(model))
    return reach_targets(system, solve, start, targets[1:])


def reach_targets(
    system: System,
    solve: Callable[[float, Equilibrium], Equilibrium],
    start: Equilibrium,
    targets: np.ndarray,
    progress: Progress | None = None,
) -> Trajectory:
    """Equilibria at `start` and at the targets (s,) behind it; a SolverError carries them as far as they are found."""
    found, latest = [start], start
    try:
        for target in targets:
            size = (target - latest.at) / parts(system, latest.at, target)
            for state in march(solve, latest, float(target), size):
                latest = state
                if progress:
                    progress(latest.at)
            found.append(latest)
    except SolverError as error:
        error.partial = path(system, found if latest is found[-1] else [*found, latest])
        raise
    return path(system, found)


def march(solve: Callable[[float, Equilibrium], Equilibrium], state: Equilibrium, end: float, step: float) -> Iterator[Equilibrium]:
    """Equilibria from that of `state` to `end` by steps, which are shortened where the iteration fails."""
    size = step
    while state.at < end - 1e-12 * step:
        target = min(end, state.at + size)
        try:
            state = solve(target, state)
        except SolverError:
            size *= SHORTER
            if size < SHORTEST * step:
                raise
            continue
        yield state


def path(system: System, found: list[Equilibrium]) -> Trajectory:
    """Equilibria as a Trajectory over load factor or time; a warning is shown for strains of parts beyond their training."""
    x, count = np.array([state.x for state in found]), sum(state.iterations for state in found)
    multipliers = np.array([state.multipliers for state in found]).reshape(len(found), -1)
    statistics = Statistics(len(found) - 1, count, count, 0, 0.0, 0.0)
    none, start = np.zeros_like(x), compile_system(system).memory
    memory = np.array([start if state.memory is None else state.memory for state in found])
    unknown = np.full(len(found), np.nan)  # the work on the way from one equilibrium to the next
    states = Trajectory(system, np.array([s.at for s in found]), x, none, none, multipliers, statistics, memory, work=unknown)
    try:
        warn(states, memory[-1])
    except Notice as notice:
        notice.partial = states
        raise
    return states


def warn(states: Trajectory, last: np.ndarray) -> None:
    """Say what speaks against equilibria: parts beyond their training or too stiff, tables beyond their ends, bodies that are free.

    `last` (l,) is what forces keep of the last one.
    """
    times, seen = departures.looks(states)
    beyond = departures.find_in(states.system, states.times, states.x)
    departures.warn(beyond + departures.find_missing(states.system, times, seen))
    missing_shapes.warn_of_stiffness(seen)
    missing_shapes.tell_unknown(states.system)
    for text in responses.beyond(compile_system(states.system), last):
        notify(text)
    warn_of_turns(states)
    if states.statistics.iterations == 0:  # no equilibrium was found
        return
    linear = linearise(states.system, states.x[-1], states.multipliers[-1], float(states.times[-1]), last)
    if free := find_free(states.system, linear).names:
        notify(f"nothing resists that {'; '.join(free)}: where the bodies are along that is arbitrary; hold them by joints")


def warn_of_turns(states: Trajectory) -> None:
    """A warning where an angle is an output and a drive turns it by half a turn or more from one equilibrium to the next."""
    told = [name for name, one in states.system.outputs.items() if probes.kind_of(one) is probes.Angle]
    if told and any(parts(states.system, a, b) > np.pi / RADIAN for a, b in pairwise(states.times)):
        text = "a drive turns by half a turn or more from one equilibrium to the next, so that these angles may lack whole turns"
        notify(f"{text}: {', '.join(told)}; take more load steps")


def newton_statics(model: Compiled, start: Equilibrium, newton: Newton, time: float, unit: str) -> Equilibrium:
    """Full Newton iteration with the exact tangent; corrections are shortened where they would leave the basin of attraction.

    The longest one allowed is doubled while corrections become smaller, and halved where they grow: what hardly bends has other
    equilibria nearby, with folds. `unit` says what `time` is, for messages.
    """
    place = unit, time
    x, multipliers, memory, n = start.x, start.multipliers, start.memory, len(start.x)
    last, norm, reach = np.inf, np.inf, NEAR * model.system.scale
    for iteration in range(4 * newton.iterations):
        R, J = compiled.residual(model, x, multipliers, time, memory), compiled.gap(model, x, time)[1]
        step = correction(model, compiled.tangent(model, x, multipliers, time, 0.0, memory), J, R)
        if step is None:
            raise static_failure(model, Reason.SINGULAR_TANGENT, place, R)
        last, norm = norm, compiled.size(model, step[:n])
        if iteration > 8 and norm > 1e3 * model.system.scale:
            raise static_failure(model, Reason.DIVERGED, place, R)
        reach = min(2.0 * reach, FAR * model.system.scale) if norm < last else max(0.5 * reach, NEAR * model.system.scale)
        short = min(1.0, reach / max(norm, 1e-300))
        x, multipliers = x - short * step[:n], multipliers - short * step[n:]
        if is_enough(model.system, newton, norm, last):
            return Equilibrium(time, x, multipliers, iteration + 1, compiled.accepted(model, x, memory=memory))
    raise static_failure(model, Reason.NOT_CONVERGED, place, R)


def is_enough(system: System, newton: Newton, norm: float, last: float) -> bool:
    """Whether a correction of size `norm` [m] after one of size `last` ends the iteration: the faster it contracts, the earlier."""
    enough = newton.tolerance * system.scale * min(1.0, 1e-2 * last / max(norm, 1e-300))
    return norm <= max(enough, FLOOR * round_off(system))


def correction(model: Compiled, K: csr_array, J: np.ndarray, R: np.ndarray) -> np.ndarray | None:
    """The correction (n + m,) of a state with the tangent K and constraint rows J; None where there is none.

    Where K is singular but its equations have solutions, as of a chain that hangs straight and is not yet under tension, it is that
    of least size, by a little of the metric beside K. Unknowns count by how far they move points, rows of J by their lengths: a
    soft spring turns a small body as it turns a large one.
    """
    system = model.system
    large = scale_of(system) / system.scale
    unit = np.append(large, 1.0 / ranks.lengths(J * large))
    K, J, R = scaled(K, large, large), scaled(J, unit[len(large) :], large), unit * R
    A = saddle.matrix(K, J)
    step = saddle.regular_solution(A, R)
    if step is not None:
        return unit * step
    W = scaled(csr_array(system.metric), large, large)
    size = abs(K).max() or np.abs(R).max() / system.scale  # rigid bodies have no stiffness but that of what pulls at them
    step = saddle.regular_solution(saddle.matrix(csr_array(K + LITTLE * size / abs(W).max() * W), J), R)
    return unit * step if step is not None and np.linalg.norm(A @ step - R) <= SOLVES * np.linalg.norm(R) else None


def static_failure(model: Compiled, reason: Reason, place: tuple[str, float], R: np.ndarray) -> SolverError:
    """The error of a step at a load factor or time, with the worst residuals by name."""
    largest = worst(row_names(model.system), R)
    free = "a body may be free to move: hold it by joints, or let contact that holds it overlap from the start"
    hint = free if reason is Reason.SINGULAR_TANGENT else "try more load steps"
    text = f"{reason.value} at {place[0]} {place[1]:.4g}; largest residuals: {as_text(largest)}; {hint}"
    return SolverError(text, reason, place[1], largest)
