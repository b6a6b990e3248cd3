r"""One equilibrium by Newton's iteration, and how the system answers there to forces.

    f(x) - Q(s) + Phi_x^T lambda = 0,  Phi(x, s) = 0

Corrections solve the saddle point of the exact tangent; where it is singular and its equations have
solutions, the least of them is taken. Behind the end of a path, what was in a stable equilibrium
goes downhill to another one (`settle`):

    (K + k W) u + J^T l = - R,  J u = - Phi,  |u| <= DOWNHILL L,  no negative pivots

with the least shift k of the stiffness by the metric W (a trust region: J. J. More, D. C. Sorensen,
SIAM J. Sci. Stat. Comput. 4 (1983) 553-572, doi:10.1137/0904038). It is the way of a slow motion
with friction: signs of pivots say which branch is taken behind a limit point, where corrections
that are cut to a length end in one equilibrium, in another one or in none by their last digit. The
factors of the last one stay at hand: they say what the state before would have expected, see
`leaps`, and how many motions the equilibrium does not resist.
"""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np
from scipy.sparse import csr_array, diags_array

from ...bodies.vectors import LINEAR
from ...core.algebra import inertia, ranks, saddle
from ...core.algebra.linalg import Array, row_maxima, scaled
from ...core.errors import Reason, SolverError
from ...core.storage.records import dataclass
from ...systems import compiled
from ...systems.compiled import Compiled
from ...systems.connections.redundancy import scale_of
from ...systems.system import System
from ..names import as_text, row_names, worst
from ..scheme import Newton, round_off

# with FAR from the first correction on a cable that hardly bends fell into another equilibrium,
# with a fold; a roll-up in 12 load steps takes 267 corrections, 264 at half of NEAR, 200 at twice,
# and as many with any FAR from 0.1 to 5
NEAR, FAR = 0.02, 0.2  #: longest corrections over the size of the mechanism, at first and at most
AHEAD = 5.0  #: times as far where stresses are expected: a beam rolls up in 118 corrections, 346 with as far
# a roll-up takes the same corrections with half and twice of it
FLOOR = 50.0  #: corrections up to this times the round-off of positions are round-off: thin bodies amplify it
# a ring that a tilt of its plane hardly bends takes 35 corrections with anything from 0.2 to 0.5,
# 72 with 0.1, 87 with 1
DOWNHILL = 0.2  #: longest corrections downhill over the size of the mechanism
STEEPER = 4.0  #: factor between shifts of the stiffness
SHIFTS = 20  #: of them, at most
#: of the metric beside a singular tangent, and the rest of the residual that it may leave
LITTLE, SOLVES = 1e-9, 1e-3
AGAIN = 4  #: solutions of what is left, each of which leaves a thousandth
STALE = 1e-9  #: change of multipliers in the last correction, over their size, from which its tangent is not that of the state
STRAIGHT = 1e-6  #: correction over the size of the mechanism above which strains that were expected are not those of the state
CLEAR = 1e-9  #: smallest pivot of a balanced tangent over the largest from which no motion is free
FREE = "a body may be free to move: hold it by joints, or let contact that holds it overlap from the start"
LIMIT = "no equilibrium may be near beyond a limit or branch point of the load: follow the path by `method: arc_length`"


@dataclass(frozen=True, eq=False)
class Tangent:
    """Factors of the tangent and the rows of joints in a state.

        [K, J^T; J, 0],    K = d(f - Q + Phi_x^T lambda)/dx,    J = Phi_x

    both scaled so that unknowns and rows count alike.
    """

    stiffness: csr_array  #: (n, n) K in units of their own
    rows: np.ndarray  #: (m, n) J in units of their own
    unit: np.ndarray  #: (n + m,) the units
    factors: saddle.Saddle | None  #: None where the tangent is singular

    def solve(self, R: np.ndarray) -> np.ndarray | None:
        """Displacements and multipliers (n + m,) by which forces and gaps R (n + m,) are answered;
        None where that is not known.
        """
        if self.factors is None:
            return None
        found = saddle.solve(self.factors, self.unit * R)
        return self.unit * found if np.isfinite(found).all() else None

    @property
    def holds(self) -> bool:
        """Whether all motions are resisted without doubt: no row is round-off, which balancing
        would raise, and no pivot.
        """
        if self.factors is None:
            return False
        K = row_maxima(self.stiffness)
        J = np.abs(self.rows).max(axis=0, initial=0.0)
        rows = np.maximum(K / max(K.max(initial=0.0), 1e-300), J)
        pivots = np.abs(self.factors.factors.pivots())
        return bool(min(rows.min(), pivots.min() / pivots.max()) > CLEAR)

    @property
    def negative(self) -> int | None:
        """Negative pivots on what joints leave; None where the tangent is singular or not
        symmetric.
        """
        return (
            None
            if self.factors is None
            else inertia.count_negative(self.stiffness, self.rows, self.factors)
        )


@dataclass(frozen=True)
class Equilibrium:
    """State at one load factor or time.

        f(x) - Q(s) + Phi_x^T lambda = 0,    Phi(x, s) = 0

    hold in it to the tolerance of the iteration.
    """

    at: float  #: load factor, or time [s]
    x: np.ndarray  #: (n,)
    multipliers: np.ndarray  #: (m,)
    iterations: int
    #: (l,) what forces keep of it; None: nothing but what they start with
    memory: np.ndarray | None = None
    #: negative pivots of its tangent; None where there is no such number
    negative: int | None = None
    held: bool = False  #: whether it resists all motions without doubt
    #: (n,) the first correction on the way to it; None: least of many
    first: np.ndarray | None = field(default=None, repr=False)
    #: None where it is not wanted any more
    tangent: Tangent | None = field(default=None, repr=False)
    #: whether it was found by stresses that corrections expected, see `tangent_at`
    expects: bool = False
    #: iterations over the root of the change of load factor or time on the way to it
    pace: float = 0.0


def unloaded(model: Compiled) -> Equilibrium:
    """The reference, where load steps start.

    x0 of the system, with multipliers (m,) of zero, at load factor 0. It need not be an
    equilibrium, as where springs are under tension.
    """
    return Equilibrium(0.0, model.system.x0, np.zeros(model.constraints), 0)


def newton_statics(
    model: Compiled,
    start: Equilibrium,
    newton: Newton,
    time: float,
    unit: str,
    few: int | None = None,
) -> Equilibrium:
    """The equilibrium at a load factor or time by Newton's iteration, with tangents of its own or
    of expected stresses.

    What found the state before comes first. Tangents of expected stresses find equilibria of what
    is slender in a tenth of the corrections, those of the state itself are the first to leave a
    branch that is no longer stable: one with other negative pivots is taken from them alone, if
    they find any. `unit` says what `time` is, for messages; `few` iterations at most of either, by
    default Newton's, then 4 times as many where that left anything to find.
    """
    failures = dict[bool, SolverError]()
    other = None
    trying = [start.expects, not start.expects]
    for most in (few,) if few else (newton.iterations, 4 * newton.iterations):
        for expects in list(trying):
            try:
                found = iterate(model, start, newton, time, unit, most, expects)
            except SolverError as error:
                failures[expects] = error
                if error.reason is not Reason.NOT_CONVERGED:
                    trying.remove(expects)
                continue
            if not expects or (found.negative is not None and found.negative == start.negative):
                return found
            other = found
            trying.remove(expects)
        # without a number of pivots there is nothing to wait for: a roll-up by a dead moment takes
        # 351 corrections, else 951
        if other is not None and other.negative is None:
            break
    if other is None or (few and failures):
        raise next(iter(failures.values()))
    return other


def settle(
    model: Compiled, start: Equilibrium, newton: Newton, time: float, unit: str
) -> Equilibrium | None:
    """The stable equilibrium at a load factor or time that lies downhill of a stable one; None
    where none is found.
    """
    if start.negative != 0:
        return None
    try:
        return iterate(model, start, newton, time, unit, 4 * newton.iterations, True, True)
    except SolverError:
        return None


def iterate(
    model: Compiled,
    start: Equilibrium,
    newton: Newton,
    time: float,
    unit: str,
    most: int,
    expects: bool,
    downhill: bool = False,
) -> Equilibrium:
    """Full Newton iteration; corrections are shortened where they would leave the basin of
    attraction.

    The longest one allowed is doubled while corrections become smaller, and halved where they grow:
    what hardly bends has other equilibria nearby, with folds. With `expects` the first tangent is
    exact, the others are those of expected stresses. Those that go `downhill` are not cut, but
    sought within their length, see the module.
    """
    place = (unit, time)
    near = (AHEAD if expects else 1.0) * NEAR * model.system.scale
    x = start.x
    multipliers = start.multipliers
    memory = start.memory
    n = len(start.x)
    before = None
    last = np.inf
    norm = np.inf
    reach = near
    first = None
    shift = 0.0
    for iteration in range(most):
        R = compiled.residual(model, x, multipliers, time, memory)
        tangent = tangent_at(model, x, multipliers, time, memory, before)
        step = correction(model, tangent, R)
        if iteration == 0 and tangent.factors is not None and step is not None:
            first = -step[:n]
        if downhill:
            step, shift = downwards(model, tangent, R, step, shift)
        if step is None:
            raise static_failure(model, Reason.SINGULAR_TANGENT, place, R)
        last = norm
        norm = compiled.size(model, step[:n])
        if iteration > 8 and norm > 1e3 * model.system.scale:
            raise static_failure(model, Reason.DIVERGED, place, R)
        reach = min(2.0 * reach, FAR / NEAR * near) if norm < last else max(0.5 * reach, near)
        short = 1.0 if downhill else min(1.0, reach / max(norm, 1e-300))
        before = x if expects else None
        x, multipliers = x - short * step[:n], multipliers - short * step[n:]
        if not shift and is_enough(model.system, newton, norm, last):
            # as of rigid bodies that stay; and strains that were expected are off by the square of
            # a correction
            stale = np.abs(step[n:]).max(initial=0.0) > STALE * np.abs(multipliers).max(initial=0.0)
            if stale or (expects and iteration > 0 and last > STRAIGHT * model.system.scale):
                del tangent
                tangent = tangent_at(model, x, multipliers, time, memory)
            kept = compiled.accepted(model, x, memory=memory)
            pivots = tangent.negative
            pace = (iteration + 1) / np.sqrt(max(abs(time - start.at), 1e-300))
            return Equilibrium(
                time,
                x,
                multipliers,
                iteration + 1,
                kept,
                pivots,
                tangent.holds,
                first,
                tangent,
                expects,
                pace,
            )
        del tangent  # large ones are gigabytes, the next one needs their place
    raise static_failure(model, Reason.NOT_CONVERGED, place, R)


def downwards(
    model: Compiled, tangent: Tangent, R: np.ndarray, step: np.ndarray | None, shift: float
) -> tuple[np.ndarray | None, float]:
    """A correction (n + m,) downhill that is not too long, and the shift of the stiffness that it
    takes, from that of the last one.

    `step` is that of the tangent. None where no shift of SHIFTS gives one, as where forces have no
    potential.
    """
    system = model.system
    n = model.system.size
    reach = DOWNHILL * system.scale
    weights = system.metric.diagonal() / system.weight
    trial = tangent
    W = diags_array(weights * tangent.unit[:n] ** 2)
    if step is not None:
        # what is too long goes where hardly anything resists, with the stiffness |R u| / |u|^2
        # there
        along = abs(float(R @ step)) / max(float(weights @ step[:n] ** 2), 1e-300)
    else:
        along = LITTLE * float(abs(tangent.stiffness).max()) / W.diagonal().max()
    shift = shift / STEEPER or along
    used = 0.0
    for _ in range(SHIFTS):
        if step is not None and compiled.size(model, step[:n]) <= reach and trial.negative == 0:
            return step, used
        used = shift
        shift = STEEPER * shift
        trial = shifted(tangent, used * W)
        step = trial.solve(R)
    return None, used


def shifted(tangent: Tangent, W: Array) -> Tangent:
    """A tangent with W (n, n), in its units, added to the stiffness."""
    K = csr_array(tangent.stiffness + W)
    found = saddle.factor(saddle.matrix(K, tangent.rows), rows=len(tangent.rows))
    return replace(
        tangent, stiffness=K, factors=found if found is not None and found.regular else None
    )


def is_enough(system: System, newton: Newton, norm: float, last: float) -> bool:
    """Whether a correction of size `norm` [m] after one of size `last` ends the iteration: the
    faster it contracts, the earlier.

        norm <= tolerance L min(1, last / (100 norm))

    with L the size of the system, or norm is at most 50 times the round-off of positions [m].
    """
    enough = newton.tolerance * system.scale * min(1.0, 1e-2 * last / max(norm, 1e-300))
    return norm <= max(enough, FLOOR * round_off(system))


def tangent_at(
    model: Compiled,
    x: np.ndarray,
    multipliers: np.ndarray,
    time: float,
    memory: np.ndarray | None,
    before: np.ndarray | None = None,
) -> Tangent:
    """Factors of the tangent and the rows of joints in a state.

    Unknowns count by how far they move points, rows of J by their lengths: a soft spring turns a
    small body as a large one. With the state (n,) `before` a correction, stresses are those that it
    expected: turns stretch by their square what is slender, and its forces then are of no solution
    (Magisano, Leonetti, Garcea, Comput. Methods Appl. Mech. Eng. 313 (2017) 986-1005,
    doi:10.1016/j.cma.2016.10.023).
    """
    held = None if before is None else (before, LINEAR)
    K = compiled.tangent(model, x, multipliers, time, 0.0, memory, held=held)
    J = compiled.gap(model, x, time)[1]
    large = scale_of(model.system) / model.system.scale
    unit = np.append(large, 1.0 / ranks.lengths(J * large))
    K, J = scaled(K, large, large), scaled(J, unit[len(large) :], large)
    found = saddle.factor(saddle.matrix(K, J), rows=len(J))
    return Tangent(K, J, unit, found if found is not None and found.regular else None)


def correction(model: Compiled, tangent: Tangent, R: np.ndarray) -> np.ndarray | None:
    """The correction (n + m,) of a state, None where there is none.

    Where the tangent is singular but its equations have solutions, as of a chain that hangs
    straight and is not yet under tension, it is that of least size, by a little of the metric
    beside it.
    """
    if (step := tangent.solve(R)) is not None:
        return step
    system = model.system
    K = tangent.stiffness
    J = tangent.rows
    unit = tangent.unit
    large = unit[: system.size]
    R = unit * R
    W = scaled(csr_array(system.metric), large, large)
    # rigid bodies have no stiffness but that of what pulls at them
    size = abs(K).max() or np.abs(R).max() / system.scale
    factors = saddle.factor(saddle.matrix(csr_array(K + LITTLE * size / abs(W).max() * W), J))
    if factors is None or not factors.regular:
        return None
    # what is soft beside the stiffest motion feels the metric: it is taken out again
    A = saddle.matrix(K, J)
    step = np.zeros(len(R))
    for _ in range(AGAIN):
        step += saddle.solve(factors, R - A @ step)
    solves = np.linalg.norm(R - A @ step) <= SOLVES * np.linalg.norm(R)
    return unit * step if solves else None


def static_failure(
    model: Compiled,
    reason: Reason,
    place: tuple[str, float],
    R: np.ndarray,
    hint: str = f"{LIMIT}, or try more load steps",
) -> SolverError:
    """The error of a step at a load factor or time, with the worst residuals by name.

    `place` is what the number is, and the load factor or time; `R` (n + m,) are the residuals,
    forces and gaps. The error is returned, not raised; a singular tangent has a hint of its own.
    """
    largest = worst(row_names(model.system), R)
    hint = FREE if reason is Reason.SINGULAR_TANGENT else hint
    text = f"{reason.value} at {place[0]} {place[1]:.4g}; largest residuals: {as_text(largest)}; {hint}"
    return SolverError(text, reason, place[1], largest)
