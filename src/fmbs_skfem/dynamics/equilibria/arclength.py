r"""Paths of equilibria through limit points of the load, by arc length.

    G(z) = [f(x) - Q(x, s) + Phi_x^T lambda, Phi(x, s)] = 0,  z = (x, lambda, s);    t . W (x - x_0) = ds,  t . W t = 1

The load factor s is an unknown beside the coordinates; what is prescribed is the length ds along
the unit tangent t of the path at its last point (Riks' normal plane). Lengths are measured in the
metric W, the mass and what stands for it where a coordinate has none (`lengths`), so that they
depend neither on the mesh nor on the choice of coordinates. G and the plane are solved together:
their matrix is regular at limit points, where that of G_x is singular and its determinant changes
sign. The same matrix gives the next tangent, t_old . W t > 0. Limit points are the zeros of its
load component. At each of them one negative pivot of G_x comes or goes; where one does so
elsewhere, a branch point lies between two points, or the step has left its path for another branch:
steps are shortened there until they turn with the path, or show that it goes straight on. So a path
is the same whatever its steps are.

Sources: Riks, Int. J. Solids Struct. 15 (1979) 529-551, doi 10.1016/0020-7683(79)90081-7; Keller,
in: Applications of Bifurcation Theory, Academic Press 1977, 359-384 (bordering, and branches from a
null vector); Ramm, in: Nonlinear Finite Element Analysis in Structural Mechanics, Springer 1981,
63-89, doi 10.1007/978-3-642-81589-8_5 (control of the length by the number of iterations).
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from ...core.algebra import saddle
from ...core.algebra.linalg import Array
from ...core.errors import InputError, Reason, SolverError, say
from ...core.notices import Progress, notify
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems import compiled
from ...systems.compiled import Compiled, compile_system
from ...systems.connections.mechanism import refuse_held_drives
from ...systems.connections.redundancy import without_redundant
from ...systems.forces import pressure
from ...systems.system import System
from ..observers import FoundEquilibria, reviewed
from ..scheme import STATIC, Newton
from ..trajectory import Crossing, Trajectory
from . import leaps
from .equilibrium import (
    Equilibrium,
    is_enough,
    newton_statics,
    static_failure,
    tangent_at,
    unloaded,
)
from .loading import ramp
from .statics import EquilibriumProblem, Walk, march, path

UNIT = "load factor"
# no step of a deep arch fails: 1803 iterations for 359 points with 0.25 and 0.8 as well
SHORTER = 0.5  #: factor of a length that failed
SMALLEST = 1e-4  #: part of the first length below which the path is given up
STILL = 1e-12  #: displacement over the size of the system that is none
# half and twice of it take the same iterations along a deep arch, to 1e-14 of its size
NEAR = 1e-4  #: load factors of the central difference of G with respect to s, which Newton's corrections use only
#: correction of the load factor whose square is round-off: histories are not linear in it
SURE = 1e-8
# half and twice of it find as many points (359) and crossings (2) along a deep arch
FLAT = 1e-6  #: part of a length to which a limit point is found; the error of its load is of second order
SHARP = 1e-6  #: length over the size of the system down to which steps are shortened to turn with a path near a branch point
LONGER = 4.0  #: factor of lengths that step over a branch point
BLUNT = 0.1  #: part of that at which a path is given up whose points are not found
NARROW = 1e-3  #: load factors between which a branch point is found
#: longest first step along another branch, over the size of the system, and part below which it is
#: given up
ASIDE = (
    0.02,
    1e-3,
)
# of an arch, corrections of neighbouring states within 1e-4 of its branch points are 0.1 to 3 times
# those of its last digits
SLOW = 0.5  #: contraction from which a correction may be round-off
TINY = 1e-6  #: correction over the size of the system that never is
STATES = 4  #: that differ in their last digits
AMPLE = 4.0  #: times the largest correction of these that is round-off
#: part by which tangents on both sides of a branch point differ at most in what is theirs
SAME = 0.1
MANY = 1_000_000  #: pivots that count as negative where their number is not known
#: inverse iterations to the motion that a branch point lets free: its pivot is nearly zero
TRIES = 4
#: sum of the displacements of all points, over that of their sizes, that is not zero
ONE_SIDED = 1e-6
HINT = "try shorter steps (more `load_steps`)"
Branch = Literal["straight", "other"]


@dataclass(frozen=True)
@checked
class ArcLength:
    """Steps along a path: the first one is a load increment, then the length follows the number of
    iterations.

    Behind a point that took i Newton iterations the length is multiplied by

        sqrt(wanted / i)    at least 1/2 and at most 2

    InputError for a first increment outside of 0 to 1, no points, fewer than two iterations, an
    angle outside of 0 to pi/2, another branch.

    Source: Ramm 1981, doi 10.1007/978-3-642-81589-8_5.
    """

    first: float = 0.1  #: first increment of the load factor
    points: int = 500  #: most steps along the path
    wanted: int = 5  #: Newton iterations a step
    turn: float = 0.4  #: largest angle between the tangents of neighbouring points [rad]
    branch: Branch = "straight"  #: which one is taken at branch points: that which goes straight on, or the other

    def __post_init__(self) -> None:
        if not 0 < self.first <= 1:
            raise InputError(
                say("arc length, first", "a load increment above 0 and up to 1", self.first)
            )
        if self.points < 1 or self.wanted < 2:
            raise InputError(
                say(
                    "arc length",
                    "at least one point and two iterations",
                    f"{self.points} and {self.wanted}",
                )
            )
        if not 0 < self.turn < np.pi / 2:
            raise InputError(say("arc length, turn", "an angle between 0 and pi/2", self.turn))
        if self.branch not in get_args(Branch):
            raise InputError(say("arc length, branch", " or ".join(get_args(Branch)), self.branch))


@dataclass(frozen=True)
class PathProblem:
    """What all points of a path share."""

    model: Compiled
    newton: Newton
    control: ArcLength

    def measure(self, a: np.ndarray, b: np.ndarray) -> float:
        """Product of two displacements (n,) in the metric W.

            a^T W b

        of `systems.lengths`.
        """
        return float(a @ (self.model.system.metric @ b))

    def size(self, a: np.ndarray) -> float:
        """Length of a displacement (n,).

            sqrt(a^T W a)

        see `measure`.
        """
        return float(np.sqrt(max(self.measure(a, a), 0.0)))

    @property
    def sharp(self) -> float:
        """Length of the steps that turn with the path near a branch point."""
        return SHARP * self.long

    @property
    def long(self) -> float:
        """Length of a displacement of all points by the size L of the system.

            L sqrt(w)

        with the mass w of `systems.lengths`.
        """
        return float(self.model.system.scale * np.sqrt(self.model.system.weight))


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium and the unit tangent of the path there.

    (x, multipliers, load) is d(x, lambda, s)/d length, with x of length 1 in the metric.
    """

    at: Equilibrium
    x: np.ndarray  #: (n,) tangent
    multipliers: np.ndarray  #: (m,) tangent
    load: float  #: tangent: d s / d length

    @property
    def negative(self) -> int | None:
        """Negative pivots; None where there is no such number."""
        return self.at.negative


@checked
def follow_path(
    system: System,
    control: ArcLength | None = None,
    newton: Newton | None = None,
    time: float = 1.0,
    progress: Progress | None = None,
) -> Trajectory:
    """Equilibria from no load along their path until the load factor s is 1, as a Trajectory whose
    times are load factors.

        f(x) - Q(s) + Phi_x^T lambda = 0,    Phi(x, s) = 0

    Load factors fall behind a limit point; every limit point is a point of the result
    (`limit_points`), and with the branch points among its `crossings`. The factor 1 stands for
    `time` [s]: histories and drives are followed as in `solve_statics`. Where the path cannot be
    followed to its end, SolverError carries the part that was found.
    """
    if following := pressure.present(system):
        raise InputError(
            say(
                "arc length",
                "loads that do not follow a surface",
                ", ".join(following),
                "use load steps",
            )
        )
    given = system
    system = without_redundant(ramp(system, time))
    refuse_held_drives(system)
    problem = PathProblem(compile_system(system), newton or Newton(STATIC), control or ArcLength())
    walk = Walk([unloaded(problem.model)], [], [])
    try:
        follow(problem, walk, progress or (lambda fraction: None))
    except SolverError as error:
        error.partial = whole(system, walk)
        raise
    if problem.control.branch == "other" and not any(
        one.kind == "branch point" for one in walk.crossings
    ):
        notify("no branch point lies on the way to the load: `branch: other` does nothing")
    motion = whole(system, walk)
    again = lambda other, shown: follow_path(other, control, newton, time, shown)  # noqa: E731
    return reviewed(FoundEquilibria(motion, given, again, marks, progress))


def whole(system: System, walk: Walk) -> Trajectory:
    """All points of a path.

    A Trajectory whose times (s,) are load factors, in the order of the path.
    """
    return path(system, walk._replace(kept=list(range(len(walk.states)))))


def marks(trajectory: Trajectory) -> np.ndarray:
    """Numbers (k,) of the first point of a load path, its limit points and its last one."""
    return np.array([0, *limit_points(trajectory), len(trajectory.times) - 1])


@checked
def limit_points(trajectory: Trajectory) -> np.ndarray:
    """Numbers (k,) of the points of a load path where its load factor turns, as `follow_path` finds
    it.

    The load factors there are `trajectory.times[numbers]`: maxima are loads at which a structure
    snaps through under its load.
    """
    rises = np.diff(trajectory.times) > 0
    return np.flatnonzero(rises[1:] != rises[:-1]) + 1


@checked
def at_load_factor(
    trajectory: Trajectory, factor: float, newton: Newton | None = None
) -> Trajectory:
    """The equilibria at one load factor on all branches of a load path, in the order of the path.

    Each is found by Newton's iteration from what lies between two points of the path. The result
    has a state (n,) for every passage, with the `factor` as its time. InputError where the path
    does not pass the factor, SolverError where an iteration fails.
    """
    model = compile_system(trajectory.system)
    newton = newton or Newton(STATIC)
    times = trajectory.times
    memory = compiled.memories(
        model, times, trajectory.x, trajectory.v, trajectory.a, trajectory.memory
    )
    lists = map(float, times), trajectory.x, trajectory.multipliers, [0] * len(times), memory
    states = [Equilibrium(*one) for one in zip(*lists, strict=True)]
    turns = set(limit_points(trajectory).tolist())
    found = [states[0]] if states[0].at == factor else []
    for k, (a, b) in enumerate(pairwise(states)):
        if b.at == factor:
            found.append(b)
        elif (a.at - factor) * (b.at - factor) < 0.0:
            start = interpolate(a, b, factor, k in turns, k + 1 in turns)
            found.append(newton_statics(model, start, newton, factor, UNIT))
    if not found:
        raise InputError(
            say(
                "load factor",
                f"one from {times.min():.6g} to {times.max():.6g}, which the path passes",
                factor,
            )
        )
    return whole(trajectory.system, Walk(found, [], []))


def follow(problem: PathProblem, walk: Walk, progress: Progress) -> None:
    """Append the points of the path to its first one."""
    last = begin(problem, walk)
    length = usual = problem.size(last.at.x - walk.states[0].x)
    shortest = min(SMALLEST * length, BLUNT * problem.sharp)
    steps = 0
    while walk.states[-1].at < 1.0:
        progress(max(0.0, walk.states[-1].at))
        if steps == problem.control.points:
            at = walk.states[-1].at
            text = f"load factor {at:.4g} after {steps} points of the path; allow more points, or more iterations a step"
            raise SolverError(text, Reason.NOT_CONVERGED, at)
        leg = next_leg(problem, last, length, shortest, usual)
        walk.states.extend(leg.landed)
        walk.crossings.extend(crossings(problem, last, leg))
        if leg.branches and problem.control.branch == "other" and leg.landed[-1].at < 1.0:
            last, length = take_other(problem, last, leg.point)
            walk.states.append(last.at)
        else:
            usual = max(leg.length, SHORTER * usual)  # steps grow again behind what shortened them
            # behind a branch point the path is as smooth as before
            used = usual if leg.branches else leg.length
            last = leg.point
            length = used * float(
                np.clip(np.sqrt(problem.control.wanted / leg.point.at.iterations), SHORTER, 2.0)
            )
        steps += 1


@dataclass(frozen=True)
class Leg:
    """What follows a point of a path."""

    point: PathPoint  #: the next one
    limits: list[PathPoint]  #: limit points before it
    landed: list[Equilibrium]  #: all of these up to the full load
    length: float
    branches: bool  #: whether a branch point lies between


def next_leg(
    problem: PathProblem, last: PathPoint, length: float, shortest: float, usual: float
) -> Leg:
    """The next point of a path, at a length that is shortened until the point is found and follows
    from the last one.

    Where pivots still change in the shortest steps, a branch point lies in the last of them that
    was found, or, so near to it that no tangent is left, in the first of longer ones, up to the
    `usual` length.
    """
    over: Leg | None = None
    while length >= shortest:
        try:
            leg = leg_of(problem, last, length)
        except SolverError:
            length *= SHORTER
            continue
        if not leg.branches or is_found(problem, last, leg):
            return leg
        over = leg
        length *= SHORTER
    if over is not None:
        return over
    while True:
        length = min(length * LONGER, usual)
        try:
            return leg_of(problem, last, length)
        except SolverError:
            if length >= usual:
                raise


def leg_of(problem: PathProblem, last: PathPoint, length: float) -> Leg:
    """What lies at a length from a point."""
    point = advance(problem, last, length)
    limits = locate_limits(problem, last, length, point)
    point = counted(problem, point)
    return Leg(
        point,
        limits,
        land_on_loads(problem, [last, *limits, point]),
        length,
        is_branching(last, point, limits),
    )


def is_found(problem: PathProblem, last: PathPoint, leg: Leg) -> bool:
    """Whether the place of a branch point is known well enough, and the step short enough to turn
    with the path.
    """
    return leg.length <= problem.sharp and abs(leg.point.at.at - last.at.at) <= NARROW


def counted(problem: PathProblem, point: PathPoint) -> PathPoint:
    """A point with the number of its negative pivots."""
    at = point.at
    found = tangent_at(problem.model, at.x, at.multipliers, at.at, at.memory).negative
    return replace(point, at=replace(at, negative=found))


def is_branching(last: PathPoint, point: PathPoint, limits: list[PathPoint]) -> bool:
    """Whether pivots change their signs otherwise than by one at a limit point."""
    if last.negative is None or point.negative is None:
        return False
    return abs(point.negative - last.negative) != len(limits)


def crossings(problem: PathProblem, last: PathPoint, leg: Leg) -> list[Crossing]:
    """What lies between two neighbouring points of the path, or in one."""
    pivots = last.negative, leg.point.negative
    if not leg.branches:
        return [
            Crossing("limit point", one.at.at, one.at.at, 0.0, "", pivots, "the load turns")
            for one in leg.limits
        ]
    distance, place = leaps.longest(problem.model.system, leg.point.at.x - last.at.x)
    way = (
        "the other branch is taken"
        if problem.control.branch == "other"
        else "the path goes straight on"
    )
    sign = f"negative pivots do not change by those of limit points; {way}"
    return [Crossing("branch point", last.at.at, leg.point.at.at, distance, place, pivots, sign)]


def take_other(problem: PathProblem, last: PathPoint, beyond: PathPoint) -> tuple[PathPoint, float]:
    """The first point of the other branch next to a branch point between two points, and the length
    of the way to it.

    Of its two sides that with fewer negative pivots; where they are alike, as those of symmetric
    structures, the one to which most points move in x, y or z, the first of these that is not zero.
    """
    aside = other_way(problem, last, beyond)
    size = min(ASIDE[0] * problem.long, problem.control.first / max(abs(aside.load), 1e-300))
    least = ASIDE[1] * size
    back = replace(aside, x=-aside.x, multipliers=-aside.multipliers, load=-aside.load)
    while size > least:
        found = list[PathPoint]()
        for one in (aside, back):
            with contextlib.suppress(SolverError):
                found.append(counted(problem, advance(problem, one, size)))
        if found:
            return min(
                found, key=lambda point: MANY if point.negative is None else point.negative
            ), size
        size *= SHORTER
    raise SolverError(
        f"the other branch at {UNIT} {last.at.at:.4g} is not found",
        Reason.NOT_CONVERGED,
        last.at.at,
    )


def other_way(problem: PathProblem, last: PathPoint, beyond: PathPoint) -> PathPoint:
    """A point next to a branch point with the unit direction of the other branch in place of its
    tangent.

    Both tangents there are made of the motion that nothing resists, and of the answer to more load
    without that:

        K u = 0,    K u = dQ/ds

    Then the other one is normal to the first. So near to the branch point round-off turns the first
    towards that motion; what it has of it alike on both sides of the branch point is its own.
    """
    model = problem.model
    at = last.at
    n = len(last.x)
    found = tangent_at(model, at.x, at.multipliers, at.at, at.memory)
    free = np.cos(np.arange(n + len(at.multipliers)))
    answer = found.solve(load_slope(problem, at))
    if answer is None:
        raise SolverError(f"no other branch at {UNIT} {at.at:.4g}", Reason.SINGULAR_TANGENT, at.at)
    for _ in range(TRIES):
        solved = found.solve(
            np.append(model.system.metric @ free[:n], np.zeros(len(at.multipliers)))
        )
        free = free if solved is None else solved / problem.size(solved[:n])
    answer = answer - problem.measure(free[:n], answer[:n]) * free
    length = problem.size(answer[:n])
    here, there = (problem.measure(free[:n], point.x) for point in (last, beyond))
    own = here if abs(here - there) <= SAME * abs(here) else 0.0
    along = unit(
        problem, without(problem, last, PathPoint(at, free[:n], free[n:], 0.0), here - own)
    )
    ways = [
        PathPoint(at, free[:n], free[n:], 0.0),
        PathPoint(at, answer[:n] / length, answer[n:] / length, 1.0 / length),
    ]
    normal = max(
        (without(problem, way, along) for way in ways), key=lambda way: problem.size(way.x)
    )
    return oriented(problem.model.system, unit(problem, normal))


def without(
    problem: PathProblem, way: PathPoint, other: PathPoint, part: float | None = None
) -> PathPoint:
    """A direction without its part along another one, or without that `part`."""
    part = problem.measure(way.x, other.x) if part is None else part
    return PathPoint(
        way.at,
        way.x - part * other.x,
        way.multipliers - part * other.multipliers,
        way.load - part * other.load,
    )


def unit(problem: PathProblem, way: PathPoint) -> PathPoint:
    """A direction of length 1."""
    size = problem.size(way.x)
    return PathPoint(way.at, way.x / size, way.multipliers / size, way.load / size)


def oriented(system: System, way: PathPoint) -> PathPoint:
    """A direction, turned back where most points would move against x, y or z, the first of these
    in which they move together.
    """
    base = system.full or system
    moved = np.asarray(system.lift.matrix @ way.x)
    sums = (
        (base.unit > 0.5) @ moved.reshape(-1, base.dim)
        if len(base.unit) * base.dim == len(moved)
        else moved
    )
    clear = np.flatnonzero(np.abs(sums) > ONE_SIDED * np.abs(moved).sum())
    sign = np.sign(sums[clear[0]] if len(clear) else moved[np.abs(moved).argmax()])
    return replace(
        way, x=sign * way.x, multipliers=sign * way.multipliers, load=float(sign * way.load)
    )


def begin(problem: PathProblem, walk: Walk) -> PathPoint:
    """The first equilibrium under load, found at a given load factor, with the tangent that leads
    on from there.
    """
    start = walk.states[0]
    static = EquilibriumProblem(
        problem.model.system, start.x, lambda factor: problem.model, problem.newton, UNIT
    )
    state, passed = next(march(static, start, 1.0, problem.control.first))
    walk.crossings.extend(passed)
    ahead = state.x - start.x
    if not problem.size(ahead) > STILL * problem.size(state.x):
        raise InputError(
            say(
                "loads",
                "loads that move a mass",
                "none",
                "an arc length needs a load, and bodies with mass",
            )
        )
    _, ray, _ = linearise(problem, state, ahead, 0.0)
    walk.states.append(replace(state, tangent=None, first=None))
    return tangent(problem, walk.states[-1], ray)


def advance(problem: PathProblem, last: PathPoint, length: float) -> PathPoint:
    """The point at a length along the tangent, by Newton iteration in the plane normal to it."""
    n = len(last.x)
    scale = problem.model.system.scale
    at = last.at
    x, multipliers, s = (
        at.x + length * last.x,
        at.multipliers + length * last.multipliers,
        at.at + length * last.load,
    )
    before = norm = np.inf
    for iteration in range(3 * problem.control.wanted):
        rest = length - problem.measure(last.x, x - at.x)
        step, ray, R = linearise(
            problem, Equilibrium(s, x, multipliers, 0, at.memory), last.x, rest
        )
        before = norm
        norm = compiled.size(problem.model, step[:n])
        if iteration > 1 and not norm < max(before, 1e-6 * scale):
            raise static_failure(problem.model, Reason.DIVERGED, (UNIT, s), R, HINT)
        x, multipliers, s = x + step[:n], multipliers + step[n:-1], s + step[-1]
        enough = (
            is_enough(problem.model.system, problem.newton, norm, before) and abs(step[-1]) <= SURE
        )
        stalls = iteration > 1 and norm > SLOW * before
        if enough or (
            stalls
            and is_round_off(problem, Equilibrium(s, x, multipliers, 0, at.memory), last.x, norm)
        ):
            memory = compiled.accepted(problem.model, x, memory=at.memory)
            found = tangent(
                problem, Equilibrium(float(s), x, multipliers, iteration + 1, memory), ray
            )
            if problem.measure(last.x, found.x) > np.cos(problem.control.turn):
                return found
            break
    raise static_failure(problem.model, Reason.NOT_CONVERGED, (UNIT, s), R, HINT)


def linearise(
    problem: PathProblem, at: Equilibrium, ahead: np.ndarray, rest: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Correction of (x, lambda, s) with the rest of the length along `ahead` (n,), direction of the
    path with 1 along it, and G.
    """
    R = compiled.residual(problem.model, at.x, at.multipliers, at.at, at.memory)
    bordered, size = border(problem, at, ahead)
    last = np.zeros(len(R) + 1)
    last[-1] = size
    solved = saddle.regular_solution(bordered, np.column_stack([np.append(-R, size * rest), last]))
    if solved is None:
        raise static_failure(problem.model, Reason.SINGULAR_TANGENT, (UNIT, at.at), R)
    return solved[:, 0], solved[:, 1], R


def border(problem: PathProblem, at: Equilibrium, ahead: np.ndarray) -> tuple[Array, float]:
    """Matrix of the bordered system of a path (n + m + 1, n + m + 1), and the factor c by which the
    plane counts as much as the loads.

        [G_x, G_s; c (W ahead)^T, 0]
    """
    model = problem.model
    J = compiled.gap(problem.model, at.x, at.at)[1]
    Q = load_slope(problem, at)
    plane = np.concatenate([model.system.metric @ ahead, np.zeros(len(J))])
    size = float(np.abs(Q).max() / np.abs(plane).max())
    K = saddle.matrix(compiled.tangent(model, at.x, at.multipliers, at.at, 0.0, at.memory), J)
    return saddle.matrix(K, size * plane[None, :], -Q[:, None]), size


def is_round_off(problem: PathProblem, at: Equilibrium, ahead: np.ndarray, norm: float) -> bool:
    """Whether a correction of size `norm` [m] of a state in the plane normal to `ahead` (n,) is no
    more than round-off of G.

    States that differ in their last digits have corrections as well: near a branch point hardly
    anything resists one motion, and no iteration finds it better.
    """
    if norm > TINY * problem.model.system.scale:
        return False
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (STATES, len(at.x)))
    states = [at.x, *(np.nextafter(at.x, at.x + sign) for sign in signs)]
    R = [compiled.residual(problem.model, x, at.multipliers, at.at, at.memory) for x in states]
    changes = np.stack([np.append(one - R[0], 0.0) for one in R[1:]], axis=1)
    solved = saddle.regular_solution(border(problem, at, ahead)[0], changes)
    return solved is not None and norm <= AMPLE * max(
        compiled.size(problem.model, one[: len(at.x)]) for one in solved.T
    )


def load_slope(problem: PathProblem, at: Equilibrium) -> np.ndarray:
    """Right-hand side (n + m,) of the answer to more load.

        - dG/ds

    at a point of the path.
    """
    before, after = (
        compiled.residual(problem.model, at.x, at.multipliers, at.at + s, at.memory)
        for s in (-NEAR, NEAR)
    )
    return np.asarray((before - after) / (2.0 * NEAR))


def tangent(problem: PathProblem, at: Equilibrium, ray: np.ndarray) -> PathPoint:
    """The point with the unit tangent along a direction of the path."""
    n = len(at.x)
    return unit(problem, PathPoint(at, ray[:n], ray[n:-1], float(ray[-1])))


def locate_limits(
    problem: PathProblem, last: PathPoint, length: float, after: PathPoint
) -> list[PathPoint]:
    """The limit point between two neighbouring points, if there is one."""
    from scipy.optimize import brentq

    if np.sign(last.load) == np.sign(after.load):
        return []
    at = brentq(
        lambda part: advance(problem, last, part).load if part > 0.0 else last.load,
        0.0,
        length,
        xtol=FLAT * length,
    )
    return [advance(problem, last, at)] if 0.0 < at < length else []


def land_on_loads(problem: PathProblem, points: list[PathPoint]) -> list[Equilibrium]:
    """Equilibria after the first of some neighbouring points, cut off where the load factor is 1."""
    kept: list[Equilibrium] = []
    for a, b in pairwise(points):
        if b.at.at < 1.0:
            kept.append(b.at)
            continue
        mixed = interpolate(a.at, b.at, 1.0)
        state = newton_statics(problem.model, mixed, problem.newton, 1.0, UNIT)
        if problem.size(state.x - mixed.x) > 0.5 * problem.size(b.at.x - a.at.x):
            raise SolverError(f"another branch at {UNIT} 1", Reason.NOT_CONVERGED, 1.0)
        return [*kept, replace(state, tangent=None, first=None)]
    return kept


def interpolate(
    a: Equilibrium, b: Equilibrium, factor: float, from_limit: bool = False, to_limit: bool = False
) -> Equilibrium:
    """What lies between two equilibria at a load factor, on a straight line along which loads
    change as a square from a limit.
    """
    share = (factor - a.at) / (b.at - a.at)
    if from_limit != to_limit:
        share = np.sqrt(share) if from_limit else 1.0 - np.sqrt(1.0 - share)
    return Equilibrium(
        factor,
        a.x + share * (b.x - a.x),
        a.multipliers + share * (b.multipliers - a.multipliers),
        0,
        a.memory,
    )
