r"""Paths of equilibria through limit points of the load, by arc length.

    G(z) = [f(x) - Q(x, s) + Phi_x^T lambda, Phi(x, s)] = 0,  z = (x, lambda, s);    t . M (x - x_0) = ds,  t . M t = 1

The load factor s is an unknown beside the coordinates; what is prescribed is the length ds along the unit tangent t of the path at
its last point (Riks' normal plane). Lengths are measured by the mass matrix M, so that they depend neither on the mesh nor on the
choice of coordinates. G and the plane are solved together: their matrix is regular at limit points, where that of G_x is singular
and its determinant changes sign. The same matrix gives the next tangent, t_old . M t > 0. Limit points are the zeros of its load
component.

Sources: Riks, Int. J. Solids Struct. 15 (1979) 529-551, doi 10.1016/0020-7683(79)90081-7; Keller, in: Applications of Bifurcation
Theory, Academic Press 1977, 359-384 (bordering); Ramm, in: Nonlinear Finite Element Analysis in Structural Mechanics, Springer
1981, 63-89, doi 10.1007/978-3-642-81589-8_5 (control of the length by the number of iterations).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..core import saddle
from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import Progress
from ..core.records import dataclass
from ..systems import compiled, pressure
from ..systems.compiled import Compiled, compile_system
from ..systems.redundancy import without_redundant
from ..systems.system import System
from .loading import ramp
from .scheme import STATIC, Newton
from .statics import Equilibrium, is_enough, march, newton_statics, path, static_failure, unloaded
from .trajectory import Trajectory

UNIT = "load factor"
SHORTER = 0.5  #: factor of a length that failed
SMALLEST = 1e-4  #: part of the first length below which the path is given up
STILL = 1e-12  #: displacement over the size of the system that is none
NEAR = 1e-4  #: load factors of the central difference of G with respect to s, which Newton's corrections use only
SURE = 1e-8  #: correction of the load factor whose square is round-off: histories are not linear in it
FLAT = 1e-6  #: part of a length to which a limit point is found; the error of its load is of second order


@dataclass(frozen=True)
class ArcLength:
    """Steps along a path: the first one is a load increment, then the length follows the number of iterations."""

    first: float = 0.1  #: first increment of the load factor
    points: int = 500  #: most steps along the path
    wanted: int = 5  #: Newton iterations a step
    turn: float = 0.4  #: largest angle between the tangents of neighbouring points [rad]

    def __post_init__(self) -> None:
        if not 0 < self.first <= 1:
            raise InputError(say("arc length, first", "a load increment above 0 and up to 1", self.first))
        if self.points < 1 or self.wanted < 2:
            raise InputError(say("arc length", "at least one point and two iterations", f"{self.points} and {self.wanted}"))
        if not 0 < self.turn < np.pi / 2:
            raise InputError(say("arc length, turn", "an angle between 0 and pi/2", self.turn))


@dataclass(frozen=True)
class PathProblem:
    """What all points of a path share."""

    model: Compiled
    newton: Newton
    control: ArcLength

    def measure(self, a: np.ndarray, b: np.ndarray) -> float:
        """Product of two displacements in the metric of the mass matrix."""
        return float(a @ (self.model.system.metric @ b))

    def size(self, a: np.ndarray) -> float:
        """Length of a displacement."""
        return float(np.sqrt(max(self.measure(a, a), 0.0)))


@dataclass(frozen=True)
class PathPoint:
    """An equilibrium and the unit tangent of the path there."""

    at: Equilibrium
    x: np.ndarray  #: (n,) tangent
    multipliers: np.ndarray  #: (m,) tangent
    load: float  #: tangent: d s / d length


def follow_path(
    system: System,
    control: ArcLength | None = None,
    newton: Newton | None = None,
    time: float = 1.0,
    progress: Progress | None = None,
) -> Trajectory:
    """Equilibria from no load along their path until the load factor is 1 or -1, as a Trajectory whose times are load factors.

    Load factors fall behind a limit point; every limit point is a point of the result (`limit_points`). The factor 1 stands for
    `time` [s]: histories and drives are followed as in `solve_statics`. Where the path cannot be followed to its end, SolverError
    carries the part that was found.
    """
    if following := pressure.present(system):
        raise InputError(say("arc length", "loads that do not follow a surface", ", ".join(following), "use load steps"))
    system = without_redundant(ramp(system, time))
    problem = PathProblem(compile_system(system), newton or Newton(STATIC), control or ArcLength())
    found = [unloaded(problem.model)]
    try:
        follow(problem, found, progress or (lambda fraction: None))
    except SolverError as error:
        error.partial = path(system, found)
        raise
    return path(system, found)


def limit_points(trajectory: Trajectory) -> np.ndarray:
    """Numbers (k,) of the points of a load path where its load factor turns."""
    rises = np.diff(trajectory.times) > 0
    return np.flatnonzero(rises[1:] != rises[:-1]) + 1


def at_load_factor(trajectory: Trajectory, factor: float, newton: Newton | None = None) -> Trajectory:
    """The equilibria at one load factor on all branches of a load path, in the order of the path."""
    model, newton, times = compile_system(trajectory.system), newton or Newton(STATIC), trajectory.times
    memory = compiled.memories(model, times, trajectory.x, trajectory.v, trajectory.a, trajectory.memory)
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
        raise InputError(say("load factor", f"one from {times.min():.6g} to {times.max():.6g}, which the path passes", factor))
    return path(trajectory.system, found)


def follow(problem: PathProblem, found: list[Equilibrium], progress: Progress) -> None:
    """Append the points of the path to its first one."""
    last = begin(problem, found[0])
    found.append(last.at)
    first = length = problem.size(last.at.x - found[0].x)
    steps = 0
    while abs(found[-1].at) < 1.0:
        progress(max(0.0, found[-1].at))
        if steps == problem.control.points:
            text = f"load factor {found[-1].at:.4g} after {steps} points of the path; allow more points, or more iterations a step"
            raise SolverError(text, Reason.NOT_CONVERGED, found[-1].at)
        try:
            after = [*locate_limits(problem, last, length, point := advance(problem, last, length)), point]
            found.extend(land_on_loads(problem, [last, *after]))
        except SolverError:
            length *= SHORTER
            if length < SMALLEST * first:
                raise
            continue
        last, steps = point, steps + 1
        length *= float(np.clip(np.sqrt(problem.control.wanted / point.at.iterations), SHORTER, 2.0))


def begin(problem: PathProblem, start: Equilibrium) -> PathPoint:
    """The first equilibrium under load, found at a given load factor, with the tangent that leads on from there."""

    def solve(factor: float, last: Equilibrium) -> Equilibrium:
        return newton_statics(problem.model, last, problem.newton, factor, UNIT)

    state = next(march(solve, start, 1.0, problem.control.first))
    ahead = state.x - start.x
    if not problem.size(ahead) > STILL * problem.size(state.x):
        raise InputError(say("loads", "loads that move a mass", "none", "an arc length needs a load, and bodies with mass"))
    _, ray, _ = linearise(problem, state, ahead, 0.0)
    return tangent(problem, state, ray)


def advance(problem: PathProblem, last: PathPoint, length: float) -> PathPoint:
    """The point at a length along the tangent, by Newton iteration in the plane normal to it."""
    n, scale = len(last.x), problem.model.system.scale
    at = last.at
    x, multipliers, s = at.x + length * last.x, at.multipliers + length * last.multipliers, at.at + length * last.load
    before = norm = np.inf
    for iteration in range(3 * problem.control.wanted):
        rest = length - problem.measure(last.x, x - at.x)
        step, ray, R = linearise(problem, Equilibrium(s, x, multipliers, 0, at.memory), last.x, rest)
        before, norm = norm, compiled.size(problem.model, step[:n])
        if iteration > 1 and not norm < max(before, 1e-6 * scale):
            raise static_failure(problem.model, Reason.DIVERGED, (UNIT, s), R)
        x, multipliers, s = x + step[:n], multipliers + step[n:-1], s + step[-1]
        if is_enough(problem.model.system, problem.newton, norm, before) and abs(step[-1]) <= SURE:
            memory = compiled.accepted(problem.model, x, memory=at.memory)
            found = tangent(problem, Equilibrium(float(s), x, multipliers, iteration + 1, memory), ray)
            if problem.measure(last.x, found.x) > np.cos(problem.control.turn):
                return found
            break
    raise static_failure(problem.model, Reason.NOT_CONVERGED, (UNIT, s), R)


def linearise(problem: PathProblem, at: Equilibrium, ahead: np.ndarray, rest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Correction of (x, lambda, s) with the rest of the length along `ahead` (n,), direction of the path with 1 along it, and G."""
    model, J = problem.model, compiled.gap(problem.model, at.x, at.at)[1]
    before, R, after = (compiled.residual(model, at.x, at.multipliers, at.at + s, at.memory) for s in (-NEAR, 0.0, NEAR))
    Q = (before - after) / (2.0 * NEAR)
    plane = np.concatenate([problem.model.system.mass @ ahead, np.zeros(len(J))])
    size = np.abs(Q).max() / np.abs(plane).max()
    K = saddle.matrix(compiled.tangent(model, at.x, at.multipliers, at.at, 0.0, at.memory), J)
    bordered = saddle.matrix(K, size * plane[None, :], -Q[:, None])
    last = np.zeros(len(R) + 1)
    last[-1] = size
    solved = saddle.regular_solution(bordered, np.column_stack([np.append(-R, size * rest), last]))
    if solved is None:
        raise static_failure(model, Reason.SINGULAR_TANGENT, (UNIT, at.at), R)
    return solved[:, 0], solved[:, 1], R


def tangent(problem: PathProblem, at: Equilibrium, ray: np.ndarray) -> PathPoint:
    """The point with the unit tangent along a direction of the path."""
    n = len(at.x)
    unit = ray / problem.size(ray[:n])
    return PathPoint(at, unit[:n], unit[n:-1], float(unit[-1]))


def locate_limits(problem: PathProblem, last: PathPoint, length: float, after: PathPoint) -> list[PathPoint]:
    """The limit point between two neighbouring points, if there is one."""
    from scipy.optimize import brentq

    if np.sign(last.load) == np.sign(after.load):
        return []
    at = brentq(lambda part: advance(problem, last, part).load if part > 0.0 else last.load, 0.0, length, xtol=FLAT * length)
    return [advance(problem, last, at)] if 0.0 < at < length else []


def land_on_loads(problem: PathProblem, points: list[PathPoint]) -> list[Equilibrium]:
    """Equilibria after the first of some neighbouring points, cut off where the load factor is 1 or -1."""
    kept: list[Equilibrium] = []
    for a, b in pairwise(points):
        if abs(b.at.at) < 1.0:
            kept.append(b.at)
            continue
        end = float(np.copysign(1.0, b.at.at))
        mixed = interpolate(a.at, b.at, end)
        state = newton_statics(problem.model, mixed, problem.newton, end, UNIT)
        if problem.size(state.x - mixed.x) > 0.5 * problem.size(b.at.x - a.at.x):
            raise SolverError(f"another branch at {UNIT} {end:.4g}", Reason.NOT_CONVERGED, end)
        return [*kept, state]
    return kept


def interpolate(a: Equilibrium, b: Equilibrium, factor: float, from_limit: bool = False, to_limit: bool = False) -> Equilibrium:
    """What lies between two equilibria at a load factor, on a straight line along which loads change as a square from a limit."""
    share = (factor - a.at) / (b.at - a.at)
    if from_limit != to_limit:
        share = np.sqrt(share) if from_limit else 1.0 - np.sqrt(1.0 - share)
    return Equilibrium(factor, a.x + share * (b.x - a.x), a.multipliers + share * (b.multipliers - a.multipliers), 0, a.memory)
