r"""Equilibrium of constrained systems by load stepping or over time.

    f(x) - Q(s) + Phi_x^T lambda = 0,  Phi(x, s) = 0,  s = s1 .. 1

What grows with the load factor s and what follows its history: `loading`; one equilibrium:
`equilibrium`. Every step is held against its path (`leaps`), and shortened where it leaves it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core.errors import InputError, SolverError, say
from ...core.notices import Notice, Progress, notify
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems import compiled, operators
from ...systems.compiled import Compiled, compile_system
from ...systems.connections.mechanism import refuse_held_drives
from ...systems.connections.redundancy import without_redundant
from ...systems.forces import pressure, responses
from ...systems.measures import probes
from ...systems.system import System
from ..histories import finite_signals
from ..near_state.linear import linearise
from ..near_state.shapes import find_free
from ..observers import FoundEquilibria, reviewed
from ..scheme import STATIC, Newton, round_off
from ..trajectory import Crossing, Statistics, Trajectory, Way
from . import leaps
from .equilibrium import FLOOR, Equilibrium, newton_statics, settle, tangent_at, unloaded
from .leaps import Verdict
from .loading import parts, ramp

SHORTER = 0.55  #: factor of a load step that failed; not 1/2, which would come back to the same load factor
SHORTEST = 0.02  #: part of the load step asked for below which the solution is given up
FINEST = 1e-3  #: part down to which a step that leaves its path is shortened
# a clamped semi-cylinder with two leaps takes 98 s where the branch behind is followed back, 211 s
# by ever shorter steps
CLOSE = 1e-2  #: part of a load step behind which a branch is taken that the path leaps to
FINER = 1e-8  #: part down to which one is that starts where hardly anything resists: what bends before it is stretched
ONE_BRANCH = 0.05  #: part down to which a step is shortened over which a pivot changes its sign
# with FEW alone a thin roll-up of 4 strips takes 9730 factorisations in place of 1926, a pinched
# semi-cylinder 891 in place of 722
FEW = 8
MORE = 1.5  #: iterations within which a path that goes on is found, or over those that the step before took for its length
ATTEMPTS = 150  #: steps on the way over one load step, beyond which they are not shortened any more for the path's sake


@dataclass(frozen=True)
class EquilibriumProblem:
    """What all equilibria of a path share.

    `model` may differ from load factor to load factor, as with pressures that follow a surface.
    """

    system: System
    start: np.ndarray  #: (n,) where it begins
    model: Callable[[float], Compiled]  #: at a load factor or time
    newton: Newton
    unit: str  #: what these are, for messages
    #: whether it begins in an equilibrium, so that steps can be held against the path
    judged: bool = True

    def solve(self, at: float, last: Equilibrium, few: int | None = None) -> Equilibrium:
        """The equilibrium at a load factor or time, from the last one; with `few`, in so many
        iterations at most.
        """
        return newton_statics(self.model(at), last, self.newton, at, self.unit, few)

    def settle(self, at: float, last: Equilibrium) -> Equilibrium | None:
        """The stable equilibrium at a load factor or time to which a stable one goes downhill; None
        where none is found.
        """
        return settle(self.model(at), last, self.newton, at, self.unit)

    def judge(self, before: Equilibrium, after: Equilibrium) -> Verdict:
        """What is to be said of a step."""
        if not self.judged:
            return Verdict(True, False, False, False)
        found = leaps.judge(self.model(before.at), before, after, self.start)
        return (
            found
            if probes.largest_turn(self.system, before.x, after.x) < leaps.WIDE
            else found._replace(resolved=False)
        )


class Passed(NamedTuple):
    """The next equilibrium on a path, and what lies on the way to it."""

    state: Equilibrium
    crossings: tuple[Crossing, ...]


@checked
def solve_statics(
    system: System,
    steps: int = 10,
    newton: Newton | None = None,
    time: float = 1.0,
    progress: Progress | None = None,
    begin: np.ndarray | None = None,
) -> Trajectory:
    """Equilibria at the load factors s = 0, 1/steps, ..., 1, as a Trajectory over them; the factor
    1 stands for `time` [s].

        f(x) - Q(s) + Phi_x^T lambda = 0,    Phi(x, s) = 0

    Loads without a history and constant displacements grow with the load factor, histories and
    drives are followed. A load step that does not converge, or leaves the path of equilibria, is
    taken in shorter ones, several times if need be; what stays a leap is a warning, and is among
    the `crossings`. SolverError carries the equilibria found so far. The first iteration begins at
    `begin` (n,), or at x0.

        >>> from fmbs_skfem import bodies, dynamics, systems
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> from fmbs_skfem.systems import At, joints, loads, probes
        >>> beam = bodies.cable("beam", segment(4), bodies.Given(1e5, 0.5, 0.1), dim=2)
        >>> clamp = joints.Clamp("clamp", At("beam", "left"))
        >>> force = loads.PointForce("force", At("beam", "right"), (0.0, -0.03))
        >>> tip = {"tip": probes.Position(At("beam", "right"))}
        >>> bent = systems.eliminate(systems.assemble([beam], [clamp], [force], outputs=tip))
        >>> path = dynamics.solve_statics(bent, steps=2)
        >>> path.times.tolist(), dynamics.outputs(path)["tip_y"].round(4).tolist()  # F L^3 / (3 EI) = 0.02 m
        ([0.0, 0.5, 1.0], [0.0, -0.01, -0.02])
    """
    newton = newton or Newton(STATIC)
    if steps < 1:
        raise InputError(say("analysis.load_steps", "at least one", steps))
    given = system
    system = without_redundant(ramp(system, time))
    refuse_held_drives(system)
    model = compile_system(system)
    start = unloaded(model)
    start = start if begin is None else replace(start, x=operators.read(system, "begin", begin))

    def at(factor: float) -> Compiled:
        return pressure.at_load_factor(model, factor)

    problem = EquilibriumProblem(system, start.x, at, newton, "load factor", False)
    first = start if begin is not None else at_rest(problem, start)
    problem = replace(problem, judged=first is not None and begin is None)
    found = reach_targets(problem, start, np.arange(1, steps + 1) / steps, progress, first)
    again = lambda other, shown: solve_statics(other, steps, newton, time, shown)  # noqa: E731
    return reviewed(FoundEquilibria(found, given, again, progress=progress))


def at_rest(problem: EquilibriumProblem, start: Equilibrium) -> Equilibrium | None:
    """The equilibrium without loads, from which a path is followed: the reference, unless springs
    act there that do not grow.

    None where there is none, or one that is unstable, as of bodies in a frame that turns, which the
    loads hold: what lies between that and the loads is no path of a structure.
    """
    model = problem.model(0.0)
    tangent = tangent_at(model, start.x, start.multipliers, 0.0, start.memory)
    step = tangent.solve(compiled.residual(model, start.x, start.multipliers, 0.0, start.memory))
    found = replace(start, negative=tangent.negative)
    if step is not None and compiled.size(model, step[: len(start.x)]) > FLOOR * round_off(
        problem.system
    ):
        try:
            found = problem.solve(0.0, start)
        except SolverError:
            return None
        # what is held on one side only ends at a gap of round-off, open or closed
        if not found.held:
            return None
    return None if found.negative else found


@checked
def solve_equilibria(system: System, times: np.ndarray, newton: Newton | None = None) -> Trajectory:
    """Equilibria x (s, n) at increasing times (s,) [s]: histories of loads and driven joints move
    on, without inertia.

    Driven positions make a path of prescribed displacements, which passes limit points of the load.
    A step between two times that does not converge, or leaves the path, is shortened as in
    `solve_statics`.
    """
    given = system
    system = without_redundant(system)
    refuse_held_drives(system)
    newton = newton or Newton(STATIC)
    model = compile_system(system)
    targets = np.asarray(times, dtype=float)
    if targets.ndim != 1 or len(targets) < 1 or not (np.diff(targets) > 0).all():
        raise InputError(say("analysis.times", "increasing times", times))

    def at(time: float) -> Compiled:
        finite_signals(system, np.array([time]))
        return model

    problem = EquilibriumProblem(system, system.x0, at, newton, "time [s]")
    found = reach_targets(problem, problem.solve(float(targets[0]), unloaded(model)), targets[1:])
    return reviewed(
        FoundEquilibria(found, given, lambda other, shown: solve_equilibria(other, times, newton))
    )


def reach_targets(
    problem: EquilibriumProblem,
    start: Equilibrium,
    targets: np.ndarray,
    progress: Progress | None = None,
    first: Equilibrium | None = None,
) -> Trajectory:
    """Equilibria at `start` and at the targets (s,) behind it; a SolverError carries them as far as
    they are found.

    What follows is sought from `first`, by default `start` as well.
    """
    latest = first or start
    walk = Walk([replace(start, tangent=None, negative=latest.negative)], [0], [])
    try:
        for target in targets:
            size = float(target - latest.at) / parts(problem.system, latest.at, target)
            for passed in march(problem, latest, float(target), size):
                latest = passed.state
                walk.states.append(replace(latest, tangent=None, first=None))
                walk.crossings.extend(passed.crossings)
                if progress:
                    progress(latest.at)
            walk.kept.append(len(walk.states) - 1)
    except SolverError as error:
        if walk.kept[-1] != len(walk.states) - 1:
            walk.kept.append(len(walk.states) - 1)
        error.partial = path(problem.system, walk)
        raise
    return path(problem.system, walk)


def march(
    problem: EquilibriumProblem, state: Equilibrium, end: float, step: float
) -> Iterator[Passed]:
    """Equilibria from that of `state` to `end` by steps, which are shortened where the iteration
    fails, or leaves the path.

    Where it fails in all shorter steps, as close behind a limit point, that is taken which lies
    downhill, or the branch of the next of those that it found before. Once one is known, shorter
    steps only ask in a few iterations whether the path goes on; the shortest is solved fully. Few
    are FEW, or MORE times those of the step before by the root of the lengths, as thin bodies take
    them: with FEW alone a strip that is rolled up took five times as many in all, in steps as short
    as the first. A step grows behind one that was taken at once only: behind a shortened one it
    mostly failed, and was shortened again.
    """
    size = step
    found = list[Equilibrium]()
    attempts = 0
    growth = 1.0 / SHORTER
    while state.at < end - 1e-12 * step:
        attempts += 1
        target = min(end, state.at + size)
        behind = min(
            (one for one in found if one.at > state.at), key=lambda one: one.at, default=None
        )
        few = (
            max(FEW, int(MORE * state.pace * np.sqrt(target - state.at)))
            if behind and size >= FINEST * step
            else None
        )
        try:
            after = problem.solve(target, state, few)
            verdict = problem.judge(state, after)
        except SolverError:
            if size >= FINEST * step if behind else SHORTER * size >= SHORTEST * step:
                size = SHORTER * size
                growth = 1.0
                continue
            if behind is None:
                if (settled := problem.settle(target, state)) is None:
                    raise
                found.append(settled)
                size = SHORTER * size
                growth = 1.0
                continue
            after = branch_at(problem, state.at + CLOSE * step, state, behind)
            verdict = Verdict(False, False, False, True)
        else:
            if target - state.at > least(verdict) * step and attempts < ATTEMPTS:
                found.append(after)
                size = SHORTER * (target - state.at)
                growth = 1.0
                continue
        yield Passed(after, leaps.crossing(problem.system, state, after, verdict))
        state = after
        size = min(step, growth * size)
        growth = 1.0 / SHORTER


def branch_at(
    problem: EquilibriumProblem, at: float, before: Equilibrium, behind: Equilibrium
) -> Equilibrium:
    """Where a path that ends in `before` goes on at a load factor or time: downhill, or to the
    branch of `behind`.

    That of `behind` is followed back; it is `behind` itself where it does not reach so far.
    """
    at = min(at, behind.at)
    if (found := problem.settle(at, before)) is not None:
        return found
    if at == behind.at:
        return behind
    try:
        found = problem.solve(at, behind)
    except SolverError:
        return behind
    w = problem.system.metric.diagonal()
    return (
        found if leaps.norm(w, found.x - behind.x) < leaps.norm(w, found.x - before.x) else behind
    )


def least(verdict: Verdict) -> float:
    """Part of the load step down to which a step is to be shortened; infinite where it need not be."""
    if not verdict.resolved:
        return FINER if verdict.soft else FINEST
    return ONE_BRANCH if verdict.crossed else np.inf


class Walk(NamedTuple):
    """All equilibria on the way along a path, which of them are kept, and what lies between them.

    `kept` are numbers among `states`, rising; the others lie between them, where steps were
    shortened.
    """

    states: list[Equilibrium]
    kept: list[int]
    crossings: list[Crossing]


def path(system: System, walk: Walk) -> Trajectory:
    """Equilibria as a Trajectory over load factor or time; warnings are shown of what speaks
    against them.

    States (s, n) of the kept equilibria, without velocities, and what sensors read on the whole
    way. Where a notice is raised as an error, its `partial` is this trajectory.
    """
    found = [walk.states[k] for k in walk.kept]
    x = np.array([state.x for state in found])
    count = sum(state.iterations for state in walk.states)
    multipliers = np.array([state.multipliers for state in found]).reshape(len(found), -1)
    statistics = Statistics(len(found) - 1, count, count, 0, 0.0, 0.0)
    none = np.zeros_like(x)
    start = compile_system(system).memory
    memory = np.array([start if state.memory is None else state.memory for state in found])
    unknown = np.full(len(found), np.nan)  # the work on the way from one equilibrium to the next
    negative = np.array([np.nan if state.negative is None else state.negative for state in found])
    sensors = system.sensors
    values = np.array([sensors.matrix @ state.x + sensors.offset for state in walk.states])
    states = Trajectory(
        system,
        np.array([state.at for state in found]),
        x,
        none,
        none,
        multipliers,
        statistics,
        memory,
        work=unknown,
        negative=negative,
        crossings=tuple(walk.crossings),
        way=Way(values, np.array(walk.kept)),
    )
    try:
        notify(*find_doubts(states, memory[-1], found[-1].held))
    except Notice as notice:
        notice.partial = states
        raise
    return states


def find_doubts(states: Trajectory, last: np.ndarray, held: bool) -> Iterator[str]:
    """What speaks against equilibria: leaps, tables beyond their ends, free bodies.

    `last` (l,) is what forces keep of the last one. Where its tangent has `held` all motions, none
    is free: to look for them takes dense factors of the joints, minutes for a chain of 300 bodies.
    """
    yield from leaps.summarise(states)
    yield from responses.beyond(compile_system(states.system), last)
    if held or states.statistics.iterations == 0:  # no equilibrium was found
        return
    linear = linearise(
        states.system, states.x[-1], states.multipliers[-1], float(states.times[-1]), last
    )
    if free := find_free(states.system, linear).names:
        yield f"free motions without stiffness: {'; '.join(free)}; positions along them are arbitrary, hold the bodies by joints"
