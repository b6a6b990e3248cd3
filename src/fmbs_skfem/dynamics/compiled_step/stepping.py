r"""The compiled time step: generalized-alpha for index-3 DAEs with a modified Newton iteration.

    (1 - am) a1 + am a0 = (1 - af) q1'' + af q0''
    q1  = q0 + h q0' + h^2 (1/2 - beta) a0 + h^2 beta a1,    q1' = q0' + h (1 - gamma) a0 + h gamma a1
    [ c W      Phi_q^T ] [ dq ]     [ c (M q'' + f) + Phi_q^T lambda ]
    [ Phi_q    0       ] [ dl ] = - [ Phi                            ],   W = bh M + gh C + K,   c = h^2 beta                   (3)

Then the velocities settle on the joints, equation (4) in `settling`.

Here lambda is c times the physical multiplier, which makes the condition number independent of h.
The predictor extrapolates q'' by the order (constant, linear, quadratic) that was best in the step
before. A factorisation serves until the iteration contracts slowly; those of reduced models take up
secants of late corrections, so that they contract well for longer (`add_secants`). The iteration
stops on the estimated remaining error |dq| rate / (1 - rate) with the rate measured in the same
step: a good predictor makes the first correction small without making q'' accurate, so there are at
least two. |dq| is a root mean square displacement (`systems.lengths`).

An error d of q is one of d / (beta h^2) in q'' and in the reactions, which grows as h falls. Beside
the tolerance the remaining error has therefore to be a small part of beta h^2 |second difference of
q''|: the method's own error of q'' is of that size. Where round-off is in the way the tolerance
alone decides.

The first tangents of a step take the axial forces of cables in the accepted state: a guess that
turns by phi stretches by phi^2 / 2, and EA times that is a force that neither end of the step has,
which may make the tangent indefinite. Forces of the residual are those of the trial state, so that
the solution is the same.

What an iteration leaves comes back in the guess of the next step, 7 times as large where it
alternates and the guess is quadratic. Where more than some 0.01 (1 - rho_inf)^2 of the guess's
error is left (`scheme.largest_share`), stiff waves grow from step to step until the tolerance stops
them. Beside a tolerance looser than the default, the remaining error is therefore kept below a part
of the first correction, which is the error of the guess.

Sources: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0
(method); Bottasso, Bauchau and Cardona, SIAM J. Sci. Comput. 29 (2007) 397-414, doi
10.1137/050638503 (scaling); Brown, Hindmarsh and Walker, SIAM J. Sci. Stat. Comput. 6 (1985)
297-313, doi 10.1137/0906022 (secants that live as long as factors); Deuflhard, Newton Methods for
Nonlinear Problems, Springer 2004, doi 10.1007/978-3-642-23899-4 (contraction); Magisano, Leonetti
and Garcea, Comput. Methods Appl. Mech. Engrg. 313 (2017) 986-1005, doi 10.1016/j.cma.2016.10.023
(stresses of their own in tangents).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...bodies.vectors import AXIAL
from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import evaluation, kernels, work
from . import settling
from .step import (
    BEGIN,
    FACTORISATIONS,
    ITERATIONS,
    JOB,
    LEAST,
    NUMBER,
    PASSING,
    STEPS,
    Method,
    State,
    Step,
    StepJob,
    opened,
)

DONE, NOT_CONVERGED, DIVERGED, NOT_FINITE, SINGULAR, STOPPED, TOO_LONG, COARSE, TOUCHES, TOO_FEW = (
    range(10)
)
# spin-up in 8 cells, 20 s in 800 steps: none is divided, nor at twice of it; of 30 runs in 120 to
# 300 steps 2 fail, at twice 4
NEAR = 0.05  #: part of the way of a step by which constant q'' may miss its end where the step is taken after a second trial
# the same in 300 to 810 steps: none of 34 fails; where parts were tried twice as well none did at
# half of it, 1 of 20 at twice
MANY = 6  #: corrections after which the energy of a solution is looked at
# solutions that are none of the motion have 100 to 1000 times of it: 1 and 4 let the same through
GAIN = 2.0  #: energy of strains after a step, over that before it, beside that of the motion
# for new factors that leave next to nothing at once; half, twice and a hundred times of it take the
# same corrections of a double pendulum (60 unknowns, h of 0.5 and 4 ms)
FLOOR = 1e-4  #: a correction below this part of the tolerance needs no second one
# steps of 0.5 ms take 2 corrections, of 4 ms 3 to 4: half and twice of it change none in a double
# pendulum
PATIENT = 6  #: corrections after which the tolerance alone decides
# spin-up in 10 modes, 120 steps of 5 ms: 53 factorisations, 55 at half and 50 at twice of it, with
# 248 corrections each
CHEAP = 0.2  #: part of `slow` where tangents are turned: new factors cost little then
# quadratic at most: see `predict`
HISTORY = 3  #: accelerations kept for the predictor
# double pendulum in 30 modes, 80 steps of 1 ms: 264 corrections leave 1.1e-10 of its size, 246 at
# half 4.2e-10, 281 at twice 0.8e-10
SURELY = 2.0  #: on the remaining error where secants are taken up: contraction is no longer even
# the same in steps of 4 ms: 255 corrections and 33 factorisations, 253 and 29 at half, 256 and 34
# at twice
CLEAR = 0.3  #: part of a correction along which the next one may lie to be a secant
# sheet of 52 unknowns with sparse factors, 80 steps of 20 us: 96 corrections, 91 at half, 102 at
# twice, 160 where no contraction is relied on
MARGIN = 10.0  #: on a contraction that was not measured in the same step
# the same sheet: 101 corrections at half, 96 at twice, as a contraction that is falling is measured
# too late to be used
REMEASURE = 8  #: steps after which a contraction that is relied on is measured again
# double pendulum of 10 cells, 3000 steps: 0.9e-7 m are left with new factors in every step, 1.7e-7
# m with rotated ones, 2.6e-6 m with ten times of it the same: 2.99 corrections and 0.08
# factorisations a step, 2.9 and 0.11 at a third, 3.7 and 0.05 at twice
FAITHFUL = 6.0  #: times `slow` where factors rotate: they contract slower and slower, those that do not are lost at once
# double pendulum of 8 cells in space, 50 steps: 2274 corrections and 79 divided steps with their
# own stresses, 387 and 3 with those held for four corrections, 393 and 3 throughout; two bodies
# that lock on impact in 100: 1367, 721, 2603
HELD = 4  #: corrections of a step whose tangents take the stresses of the accepted state
LAGGING = 0.1  #: of the tolerance, with factors that rotate
# a planar arm of two links under random torques, 3 corrections a step: 0.5 and 0.03 at most, where
# its tip is off by 2 mm, else 3e-3 and 0.1 mm; what does not shrink is on its way to numbers that
# are none
SHRINKS = 0.9  #: size of the last of a fixed number of corrections over that of the one before, above which they do not shrink
UNCERTAIN = 0.02  #: the same over the way of the step, above which the step is not known
BESIDE = 1e-3  #: of a step, over which rates of what forces keep are differences


@jit
def predict(table: Any) -> None:
    """Trial state from extrapolated q'' and multipliers."""
    S = opened(table)
    s, t, method = S.state, S.space, S.method
    # spin-up of 14 cells, h = 5 ms: 2.25 corrections a step from constant q'', 2.14 from linear,
    # 2.0 from quadratic; at 0.5 ms 2 from each
    order = min(s.order[0], s.known[0] - 1)
    h = method.h
    extrapolate(s.history, order, t.acceleration)
    # with (4) multipliers are smooth enough for it: both together save rigid rods a tenth of the
    # corrections and nine of ten factorisations (2.0 and 0.05 a step for 2.2 and 0.6)
    extrapolate(s.past, order, t.multipliers)
    # no correction of this step has been made yet, so that the first one of the multipliers never
    # counts as growth
    S.work.pull[0] = np.inf
    # x and v follow from the guess of q'' by the method itself: a correction d of q then is gh d in
    # v and bh d in q''
    for i in range(len(s.x)):
        a1 = algorithmic(method, t.acceleration[i], s.acceleration[i], s.a[i])
        t.x[i] = s.x[i] + h * s.v[i] + h * h * ((0.5 - method.beta) * s.a[i] + method.beta * a1)
        t.v[i] = s.v[i] + h * ((1.0 - method.gamma) * s.a[i] + method.gamma * a1)
    for k in range(len(s.memory)):
        t.memory[k] = s.memory[k]


@jit
def algorithmic(method: Method, new: float, old: float, a: float) -> float:
    """Algorithmic acceleration at the end of a step, from that at its begin.

        a1 = ((1 - alpha_f) q1'' + alpha_f q0'' - alpha_m a0) / (1 - alpha_m)

    of one unknown.
    """
    # a product with the inverse: the divisor is one for all unknowns, and a division costs several
    # products
    return ((1.0 - method.af) * new + method.af * old - method.am * a) * (1.0 / (1.0 - method.am))


@jit
def extrapolate(history: np.ndarray, order: int, guess: np.ndarray) -> None:
    """Polynomial extrapolation by one step."""
    # values at equal steps alone: `parts` finds those of another distance
    latest, before, first = history[0], history[1], history[2]
    if order <= 0:
        for i in range(len(guess)):
            guess[i] = latest[i]
    elif order == 1:
        for i in range(len(guess)):
            guess[i] = 2.0 * latest[i] - before[i]
    else:
        for i in range(len(guess)):
            guess[i] = 3.0 * (latest[i] - before[i]) + first[i]


@jit
def best_order(
    norm: np.ndarray, history: np.ndarray, known: int, true: np.ndarray
) -> tuple[int, float]:
    """Order of the extrapolation that came closest to what is `true` now, and the size of the
    second difference.
    """
    # all three in one pass, known or not: those that are not known are left out below
    latest, before, first = history[0], history[1], history[2]
    constant, linear, quadratic = 0.0, 0.0, 0.0
    for i in range(len(true)):
        a, b, c = (
            latest[i] - true[i],
            2.0 * latest[i] - before[i] - true[i],
            3.0 * (latest[i] - before[i]) + first[i] - true[i],
        )
        constant += norm[i] * a * a
        linear += norm[i] * b * b
        quadratic += norm[i] * c * c
    # a tie keeps the lower order, which carries less noise on
    order = 1 if known > 1 and linear < constant else 0
    order = 2 if known > 2 and quadratic < min(constant, linear) else order
    # what linear extrapolation misses is the second difference of q'', of the size of the method's
    # own error of q''
    return order, np.sqrt(linear) if known > 1 else np.inf


@jit
def remember(history: np.ndarray, new: np.ndarray) -> None:
    """Put the newest values before the earlier ones."""
    # rows move, so that all readers find the latest first; an index that turns would be in every
    # loop
    for i in range(len(new)):
        history[2, i], history[1, i], history[0, i] = history[1, i], history[0, i], new[i]


@jit
def add_known(
    s: State, norm: np.ndarray, acceleration: np.ndarray, multipliers: np.ndarray
) -> None:
    """Put q'' and multipliers of a step that is done before the earlier ones, and choose the
    predictor of the next step.
    """
    # before the history is moved on: the guesses of this step are judged by what it has found
    s.order[0], s.change[0] = best_order(norm, s.history, s.known[0], acceleration)
    remember(s.history, acceleration)
    remember(s.past, multipliers)
    # an order that was not known before has not been judged: it is tried once, and judged by the
    # next step
    if s.known[0] < HISTORY:
        s.known[0] += 1
        s.order[0] = min(s.order[0] + 1, s.known[0] - 1)


@jit
def accept(table: Any) -> None:
    """Take over the converged trial state."""
    S = opened(table)
    s, t = S.state, S.space
    for i in range(len(s.x)):
        # of the old q'', which is overwritten below
        s.a[i] = algorithmic(S.method, t.acceleration[i], s.acceleration[i], s.a[i])
        t.way[i] = t.x[i] - s.x[i]
        s.x[i], s.v[i], s.acceleration[i] = t.x[i], t.v[i], t.acceleration[i]
    add_known(s, S.arrays.norm, t.acceleration, t.multipliers)
    for k in range(len(s.multipliers)):
        s.multipliers[k] = t.multipliers[k]
    # forces read the trial state here: what touches and sticks is that of the converged iteration
    evaluation.take_over(table)
    for k in range(len(s.memory)):
        s.memory[k] = t.memory[k]


@jit
def place_accepted(table: Any) -> None:
    """The trial state is the accepted one."""
    S = opened(table)
    s, t = S.state, S.space
    # forces are evaluated in the space, where settling has left other velocities
    kernels.copy(s.x, t.x)
    kernels.copy(s.v, t.v)
    kernels.copy(s.multipliers, t.multipliers)
    kernels.copy(s.memory, t.memory)
    t.c[0] = S.method.c


@jit
def change_signals(table: Any, signals: np.ndarray) -> float:
    """Work [J] of a change of signals in the accepted state, which are the first of `signals`."""
    S = opened(table)
    count = len(S.state.signals)
    if count == 0 or len(S.job.work) == 0:
        return 0.0
    # histories of potentials and drives do work at a standstill, of which the sum over the way sees
    # nothing
    place_accepted(table)
    return work.changed(table, S.state.signals, signals[:count])


@jit
def add_work(table: Any, begun: float, signals: np.ndarray) -> None:
    """Add the work of the step that was accepted, `begun` that of its signals at its begin, by the
    trapezoidal rule; where the job has room for it.
    """
    S = opened(table)
    s = S.state
    t = S.space
    count = len(S.state.signals)
    wanted = len(S.job.work) > 0
    # strains and rates of the last evaluation give the heat of damping; forces evaluated again for
    # it took 10 to 90 % of a step
    if wanted and S.arrays.elastic.damped:
        heat = work.find_heat(table, S.method.h)
        s.work[0] -= heat
        s.work[1] += heat
    # stresses that the next tangents hold are those of the accepted state, too
    kernels.copy(t.gradients[0], s.gradients)
    if not wanted or (count == 0 and work.idle(table)):
        return
    place_accepted(table)
    # the same way under the forces of both ends: of second order, and no matter which states are
    # stored
    begun += kernels.dot(s.push, t.way)
    work.find_forces(table)
    kernels.copy(t.f, s.push)
    begun += kernels.dot(s.push, t.way)
    if count > 0:
        begun += work.changed(table, s.signals, signals[:count])
        kernels.copy(signals[:count], s.signals)
    s.work[0] += 0.5 * begun


@jit
def judge_changes(table: Any) -> int:
    """TOO_LONG where forces that begin or end would change speeds too much, beside the largest so
    far, in the step that converged.

    TOUCHES where one begins from nothing, or ends, and its place in the step counts: a step ends
    there. Others that are not divided any further are taken, and those counted in which something
    passed through what it touches.
    """
    S = opened(table)
    if len(S.arrays.forces.judged) == 0:
        return DONE
    # beside the largest speed so far: what comes to rest would divide its steps for touches that
    # change nothing
    square = 0.0
    for i in range(len(S.state.v)):
        square += S.arrays.norm[i] * S.state.v[i] * S.state.v[i]
    S.state.speed[0] = max(S.state.speed[0], np.sqrt(square))
    impulse = evaluation.find_impulse(table)
    # in trials that are not judged as well: what is left of a touch in the shortest parts has one
    # sign at all impacts
    if (
        S.method.locating
        and S.job.done[PASSING] == 0
        and impulse < np.inf
        and S.method.h * S.space.impulse[1] > LEAST * S.state.speed[0]
    ):
        return TOUCHES
    # an infinite impulse stands for something that has passed through what it touches
    if not S.method.judging:
        S.job.done[1] += impulse == np.inf
        return DONE
    return TOO_LONG if S.method.h * impulse > S.method.allowed * S.state.speed[0] else DONE


@jit
def look_ahead(table: Any, span: float) -> None:
    """The impulse where the accepted state is after a span [s], with the accelerations it has."""
    S = opened(table)
    s, t = S.state, S.space
    for i in range(len(s.x)):
        t.x[i] = s.x[i] + span * (s.v[i] + 0.5 * span * s.acceleration[i])
        t.v[i] = s.v[i] + span * s.acceleration[i]
    kernels.copy(s.memory, t.memory)
    evaluation.find_impulse(table)


@routine
def accept_beside(table: Any, side: Any) -> int:
    """What forces keep beside the accepted state, in the memory of the space, with the signals of
    the first row of the job; 0.

        q + d h q',    q' + d h q''

    d is `side` times BESIDE.
    """
    S = opened(table)
    s, t = S.state, S.space
    span = side * BESIDE * S.method.h
    place_accepted(table)
    kernels.copy(S.job.signals[0, : len(t.signals)], t.signals)
    for i in range(len(s.x)):
        t.x[i] = s.x[i] + span * s.v[i]
        t.v[i] = s.v[i] + span * s.acceleration[i]
    evaluation.take_over(table)
    return 0


@jit
def add_secants(table: Any, repeated: bool) -> None:
    """rhs, a solution d with the factors, becomes one with the factors and the secants of the
    corrections made with them.

    Where the factors have served in this step before, for the correction s, d is what they have
    left of it: Broyden's update

        K^-1 <- (1 + u g^T) K^-1,    u = d / (1 - g d),    g = <s, .> / <s, s>

    with the scalar product of displacements makes u of d, and holds for the corrections after it.
    """
    S = opened(table)
    w = S.work
    d = S.space.rhs[0]
    norm = S.arrays.norm
    kept, n = len(w.updates), len(w.moved)
    if kept == 0:
        return
    # latest last, each on what those before have made of d; of more than there is room for the
    # oldest are overwritten
    for k in range(max(0, w.secants[0] - kept), w.secants[0]):
        add_update(w.updates[k % kept], kernels.dot(w.shares[k % kept], d[:n]), d)
    if repeated:
        square, part = 0.0, 0.0
        for i in range(n):
            square += norm[i] * w.moved[i] * w.moved[i]
            part += norm[i] * w.moved[i] * d[i]
        # 1 - g d is the divisor: a correction far along the one before asks for new factors rather
        # than for a secant
        if abs(part) < CLEAR * square:
            place = w.secants[0] % kept
            for i in range(len(d)):
                d[i] *= square / (square - part)
                w.updates[place, i] = d[i]
            for i in range(n):
                w.shares[place, i] = norm[i] * w.moved[i] / square
            w.secants[0] += 1
    for i in range(n):
        # with the secants in it: the next one corrects what all of them have left
        w.moved[i] = d[i]


@jit
def add_update(u: np.ndarray, factor: float, d: np.ndarray) -> None:
    """d += factor u."""
    # multipliers as well: u is of all unknowns, its share is that of displacements
    for i in range(len(d)):
        d[i] += factor * u[i]


@jit
def correction_size(table: Any) -> float:
    """Size of the correction in rhs [m].

        |dq| = sqrt(sum_n norm_n dq_n^2)

    with the weights of `evaluation.Arrays`.
    """
    S = opened(table)
    norm = S.arrays.norm
    square = 0.0
    # f is the front of rhs, where the solution is
    for i in range(len(S.space.f)):
        square += norm[i] * S.space.f[i] * S.space.f[i]
    return np.sqrt(square)


@jit
def apply(table: Any) -> None:
    """Add the correction in rhs to the trial state.

    Factors with which the multipliers' corrections grow are discarded: near singular positions |dq|
    does not show it. What a displacement of the tolerance stands for, |dlambda| = tolerance times
    mass, does not count.
    """
    S = opened(table)
    t, w, method = S.space, S.work, S.method
    pull = 0.0
    for i in range(len(t.x)):
        # x, v and q'' move in one pass
        d = t.f[i]
        t.x[i] -= d
        t.v[i] -= method.gh * d
        t.acceleration[i] -= method.bh * d
    for k in range(len(t.multipliers)):
        d = t.rhs[0, len(t.x) + k]
        pull += d * d
        t.multipliers[k] -= d
    pull = np.sqrt(pull)
    # new factors from the next correction on, not a failure: the step may still converge
    if pull > w.pull[0] and pull > method.tolerance * w.pull[1]:
        w.kind[0] = 0
    w.pull[0] = pull


@jit
def goal(method: Method, change: float, iteration: int, begun: float, rotated: bool) -> float:
    """Remaining error of q [m] at which the iteration may stop.

        max(min(tolerance, sharp change), floor)

    The tolerance is that of the method, or less beside `begun`. `change` is the second difference
    of q'' in the step before [m/s2], `begun` the first correction of this one [m].
    """
    # the sharper goal is beta h^2 beside q'': below the round-off of forces over c it would never
    # be met
    if iteration >= PATIENT:
        return method.tolerance
    # what factors leave that lag behind a rotation has one sign for long, and adds up with the
    # square of the steps
    tolerance = LAGGING * method.tolerance if rotated else method.tolerance
    # what is left of guesses must not grow from step to step, but for what adds up to nothing in a
    # run
    tolerance = min(tolerance, max(method.share * begun, method.unseen))
    # never looser than the tolerance, never below the round-off of positions
    return max(min(tolerance, method.sharp * change), method.floor)


@jit
def judge(
    table: Any,
    step: int,
    iteration: int,
    norm: float,
    last: float,
    fresh: int,
    exact: float,
    growing: bool,
    begun: float,
) -> int:
    """Go on, accept or give up after a correction of size `norm`, `last` the one before; a slow
    iteration discards its factors.

    `begun` is the first correction of the step, which is the error of its guess.

    `fresh` counts the corrections with factors of this step, 0 where they are older: with old
    directions of the joints a correction of the multipliers leaves forces behind, however small
    that of q is, so the first one is not believed, unless directions are current and MARGIN times
    the contraction of steps before promises enough. Turned tangents that contract slowly when they
    are new are given up for the exact ones.

    `exact` is the last correction of this step with an exact tangent, 0 for none or where this one
    has another. Near a solution the next one is smaller; where it is not, another solution, far
    from the path, is as likely as the one wanted, and a shorter step is the way to that
    (Deuflhard); but where derivatives of forces jump, corrections may grow on the way to the right
    one, and where it says `growing`. A tangent with the forces of the accepted state contracts by
    0.9 where those change by as much as a slender beam carries: the first correction with an exact
    one behind it is larger, and near the solution.
    """
    S = opened(table)
    w, method = S.work, S.method
    enough = goal(method, S.state.change[0], iteration, begun, S.rotations.on[0] == 1)
    # one correction a step in place of two where a solution is the dearest part of a step: those of
    # large models
    if method.trusting:
        if iteration == 1 and last > 0.0:
            # falls slowly and rises at once: one step that contracts well by chance is not believed
            w.rate[0] = max(0.9 * w.rate[0], norm / last)
        if (
            iteration == 0
            and fresh == 0
            and step % REMEASURE != 0
            and norm * MARGIN * w.rate[0] <= enough
        ):
            return DONE
    # a first correction has nothing to be compared with: it counts as no contraction at all
    rate = norm / last if iteration > 0 and last > 0.0 else 1.0
    slow = CHEAP * method.slow if w.kind[1] == 1 else method.slow
    slow = FAITHFUL * slow if S.rotations.on[0] == 1 else slow
    # the second correction with new factors tells what the turned tangent that they are made of is
    # worth
    if fresh > 1 and rate > method.slow:
        w.kind[1] = 0
    if not np.isfinite(norm):
        return NOT_FINITE
    # `apply` has discarded old factors: nothing that they say is believed
    if w.kind[0] == 0 and fresh == 0:
        return NOT_CONVERGED
    # the geometric series of what is left; secants make single corrections short, so that what is
    # left counts more
    sure = iteration > 0 or fresh > 0
    rest = norm * rate * (SURELY if len(w.updates) > 0 else 1.0)
    if (sure and norm <= max(FLOOR * enough, method.floor)) or (
        rate < 1.0 and rest <= enough * (1.0 - rate)
    ):
        # the step is done, and the next one begins with new factors: as cheap as now, and fresh for
        # longer
        if rate > slow and iteration > 0:
            w.kind[0] = 0
        return DONE
    # a soft arm of 1 J had 4.7 J after one step of 1 ms that had converged to another solution
    if (
        method.judging
        and S.arrays.forces.smooth
        and fresh == 1
        and not growing
        and exact > 0.0
        and norm > max(exact, method.tolerance)
    ):
        return DIVERGED
    # four corrections and new factors have not helped: a shorter step costs less than the 25 that
    # are allowed
    if (
        iteration > 3
        and rate > 2.0
        and norm > method.tolerance
        and (fresh > 1 or (fresh == 1 and exact == last))
    ):
        return DIVERGED
    # slow contraction alone is not worth new factors within a step: one more correction is cheaper
    if iteration > 0 and rate > 5.0 * slow:
        w.kind[0] = 0
    return NOT_CONVERGED


@jit
def iterate(table: Any, step: int, growing: bool) -> int:
    """Newton's iteration from the predicted state of a step; status. Corrections may grow if it
    says so.
    """
    S = opened(table)
    w = S.work
    last = 0.0
    fresh = 0
    exact = 0.0
    brief = False
    turned = False
    held = False
    begun = 0.0
    for iteration in range(S.method.iterations):
        S.space.c[0] = S.method.c
        if invoke(S.doors.residual, table, 0) != 0:
            return STOPPED
        if w.kind[0] == 0:
            # factors that last one step only are made anew at the begin of the next one: renewed in
            # its middle, each would cost a correction with old ones before
            brief = iteration > 0 and w.kind[3] < 2
            turned = w.kind[1] == 1
            S.job.counters[FACTORISATIONS] += 1
            held = iteration < HELD and S.arrays.elastic.holds
            S.space.holding[0] = AXIAL if held else evaluation.EXACT
            failed = invoke(S.doors.factorise, table, 0)
            S.space.holding[0] = evaluation.EXACT
            if failed != 0:
                return SINGULAR
            w.kind[3], fresh = 0, 1
        elif iteration == 0 and S.doors.follow != 0:
            invoke(S.doors.follow, table, 0)
        if invoke(S.doors.solve, table, 0) != 0:
            return STOPPED
        # a first correction with new factors has no one before it to be a secant of
        add_secants(table, iteration > 0 and fresh != 1)
        norm = correction_size(table)
        S.job.counters[ITERATIONS] += 1
        if iteration > 0 and fresh != 1 and S.arrays.forces.smooth and not norm <= last:
            # what factors of another state make grow is none of the solution: a thin shaft went
            # from a guess with an error of 6 um to corrections of 88 um and 75 m with factors of
            # the step before, and in 20 more to no solution at all
            w.kind[0] = 0
            if fresh == 0:
                predict(table)
                last, exact = 0.0, 0.0
            fresh = 0
            continue
        apply(table)
        begun = norm if last == 0.0 else begun
        status = judge(
            table,
            step,
            iteration,
            norm,
            last,
            fresh,
            0.0 if turned or held else exact,
            growing,
            begun,
        )
        if status == DONE:
            w.kind[0], w.kind[3] = 0 if brief else w.kind[0], w.kind[3] + 1
        if status != NOT_CONVERGED:
            return status
        # between two factorisations corrections say little of how near the solution is
        exact = norm if fresh == 1 and not turned and not held else exact
        last = norm
        fresh = fresh + 1 if fresh > 0 and w.kind[0] > 0 else 0
    return NOT_CONVERGED


@jit
def solve(table: Any, growing: bool) -> int:
    """Newton's iteration, and whether what it found after many corrections that may grow is on the
    path; the status.
    """
    S = opened(table)
    before = S.job.counters[ITERATIONS]
    status = iterate(table, S.job.counters[STEPS], growing)
    # corrections that must not grow stay on the path; loads may well give a body at rest more
    # energy than it had
    if (
        status == DONE
        and growing
        and S.method.judging
        and S.job.counters[ITERATIONS] - before > MANY
        and gains_energy(table)
    ):
        status = DIVERGED
    return status


@jit
def gains_energy(table: Any) -> bool:
    """Whether strains have more energy in the trial state than strains and motion had at the begin
    of the step.

    A beam that is spun up, h a tenth of a turn, had 274 J of 1 J after a step in which a cell had
    turned over.
    """
    S = opened(table)
    s, t = S.state, S.space
    kernels.copy(t.x, t.way)
    kernels.copy(s.x, t.x)
    evaluation.sum_energies(table)
    kernels.clear(t.f)
    kernels.add_operator(S.arrays.mass, s.v, t.f)
    bound = GAIN * t.energy[0] + 0.5 * kernels.dot(s.v, t.f)
    kernels.copy(t.way, t.x)
    evaluation.sum_energies(table)
    return t.energy[0] > bound


@jit
def is_near(table: Any) -> bool:
    """Whether the trial state is where constant q'' leads, but for a small part of the way from the
    accepted state.
    """
    S = opened(table)
    s = S.state
    t = S.space
    norm = S.arrays.norm
    off, way = 0.0, 0.0
    for i in range(len(s.x)):
        # a change of q'' is bh times that of q
        change = (t.acceleration[i] - s.acceleration[i]) / S.method.bh
        d = t.x[i] - s.x[i]
        off += norm[i] * change * change
        way += norm[i] * d * d
    return off <= NEAR * NEAR * way


@jit
def try_straight(table: Any) -> int:
    """The step that failed once more, from constant q''; the status.

        first factors at x + h v

    Where steps are large guesses compress what is stiff along its axis, and there tangents are
    indefinite: corrections of 25 mm are followed by one of 14 m. On a straight way nothing that
    turns becomes shorter, so that stresses hold what is slender.
    """
    S = opened(table)
    s = S.state
    t = S.space
    order = S.state.order[0]
    place_accepted(table)
    for i in range(len(s.x)):
        t.x[i] += S.method.h * s.v[i]
    S.work.kind[:] = 0
    if invoke(S.doors.residual, table, 0) != 0:
        return STOPPED
    S.job.counters[FACTORISATIONS] += 1
    if invoke(S.doors.factorise, table, 0) != 0:
        return SINGULAR
    s.order[0] = 0
    predict(table)
    status = solve(table, True)
    if status == DONE and not is_near(table):
        status = DIVERGED
    if status != DONE:
        s.order[0] = order
    return status


@routine
def take(table: Any, row: Any) -> int:
    """Take a step with a row of signals at its end; the status. On failure the space keeps the
    trial state.
    """
    S = opened(table)
    signals = S.job.signals[row]
    # in the state before the step, with signals of both its ends
    begun = change_signals(table, signals)
    for i in range(len(signals)):
        S.space.signals[i] = signals[i]
    predict(table)
    status = solve(table, False)
    # of smooth forces alone: where forces jump constant q'' is no better guess
    if status != DONE and status != STOPPED and S.method.again and S.arrays.forces.smooth:
        status = try_straight(table)
    if status == DONE:
        status = judge_changes(table)
    if status != DONE:
        # shorter steps begin with factors of their own, of exact tangents
        S.work.kind[:] = 0
        return status
    accept(table)
    if S.doors.settle != 0 and invoke(S.doors.settle, table, 0) != 0:
        return STOPPED
    # behind the settled velocities, which dampers and friction read
    add_work(table, begun, signals)
    S.job.counters[STEPS] += 1
    return DONE


@routine
def take_fixed(table: Any, many: Any) -> int:
    """Take a step with the first row of signals at its end, by new factors and so many corrections:
    the same operations in every step; the status.

    TOO_FEW where what they leave does not shrink. Its size [m], and how many corrections leave less
    than the tolerance (0 where none do), are in `StepJob.left`.
    """
    S = opened(table)
    signals = S.job.signals[0]
    begun = change_signals(table, signals)
    kernels.copy(signals, S.space.signals)
    predict(table)
    status = iterate_fixed(table, many)
    if status != DONE:
        S.work.kind[:] = 0
        return status
    accept(table)
    # with the factors of the guess, whatever they are worth
    if S.doors.settle != 0:
        settling.try_to_settle(table)
    add_work(table, begun, signals)
    S.job.counters[STEPS] += 1
    return DONE


@jit
def iterate_fixed(table: Any, many: int) -> int:
    """New factors at the predicted state and so many corrections; the status."""
    S = opened(table)
    w = S.work
    left = S.job.left
    norm, last = 0.0, 0.0
    for iteration in range(many):
        S.space.c[0] = S.method.c
        if invoke(S.doors.residual, table, 0) != 0:
            return STOPPED
        if iteration == 0:
            # turned tangents contract by 0.8 beside fast motions, and what three corrections leave
            # then grows from step to step until it is the motion
            w.kind[1] = 0
            S.job.counters[FACTORISATIONS] += 1
            if invoke(S.doors.factorise, table, 0) != 0:
                return SINGULAR
        if invoke(S.doors.solve, table, 0) != 0:
            return STOPPED
        last = norm
        norm = correction_size(table)
        apply(table)
        S.job.counters[ITERATIONS] += 1
    # factors serve to the end of the step, however the multipliers have moved
    w.kind[0], w.kind[3] = w.kind[2], 0
    way = 0.0
    for i in range(len(S.space.x)):
        d = S.space.x[i] - S.state.x[i]
        way += S.arrays.norm[i] * d * d
    left[0], left[1] = norm, many
    if not np.isfinite(norm) or not np.isfinite(way):
        return NOT_FINITE
    # below the round-off of positions nothing shrinks
    least = max(S.method.tolerance, S.method.floor)
    if norm > least and (norm > UNCERTAIN * np.sqrt(way) or (many > 1 and norm > SHRINKS * last)):
        left[1] = count_corrections(many, norm, norm / last, least) if many > 1 else 0.0
        return TOO_FEW
    return DONE


@jit
def count_corrections(many: int, norm: float, rate: float, least: float) -> float:
    """How many corrections leave at most `least`, where the last of `many` left `norm` and each is
    `rate` of the one before; 0 where they do not shrink.
    """
    if not rate < SHRINKS:
        return 0.0
    total = float(many)
    while norm > least:
        norm *= rate
        total += 1.0
    return total


@routine
def advance(table: Any, _: Any) -> int:
    """Take the steps of the job, one that fails or is too coarse in parts; the status, and the
    number of steps done in the job.

    On failure the state stays at the last good step, and the space keeps the trial state. Those
    that the job has done already are left out.
    """
    S = opened(table)
    job = S.job
    for k in range(job.done[0], len(job.signals)):
        job.done[0] = k
        status = take_row(table, k)
        if status != DONE:
            return status
        if job.rows[k] >= 0:
            store(S.state, S.method.c, job.rows[k], job)
    job.done[0] = len(job.signals)
    return DONE


@routine
def repeat(table: Any, many: Any) -> int:
    """Take so many steps, each with the first row of signals at its end, of which none is stored;
    the status, and the number of steps done in the job.
    """
    S = opened(table)
    job, levels = S.job, S.levels
    taken = 0
    status = DONE
    while status == DONE and taken < many:
        # each is the first one of a job, as are steps that are taken one by one
        job.done[0] = 0
        if taken > 0 and len(levels.found) > 0:
            levels.found[NUMBER] += 1
            levels.spans[JOB, BEGIN] = S.method.h * levels.found[NUMBER]
        status = take_row(table, 0)
        if status == DONE:
            taken += 1
    job.done[0] = taken
    return status


@jit
def take_row(table: Any, row: int) -> int:
    """Take a step of a job, whole, in parts or from touch to touch; the status."""
    S = opened(table)
    status = COARSE
    if S.method.local == 0.0:
        # what begins in parts touches still, and is not tried whole
        status = invoke(S.doors.take, table, row) if S.state.parts[0] == 0 else TOO_LONG
    return status if status == DONE else retake(table, status)


@routine
def retake(table: Any, status: Any) -> int:
    """Take the step of a job that failed with a status in parts, or from touch to touch; the status."""
    S = opened(table)
    if status != TOUCHES and S.doors.divide != 0:
        status = invoke(S.doors.divide, table, status)
    # of what fails as well: an iteration finds no solution where a damped force jumps
    if S.doors.touch != 0 and status != DONE and status != STOPPED:
        status = invoke(S.doors.touch, table, 0)
    return int(status)


@jit
def place_paths(table: Any) -> None:
    """Probe rows of the accepted state and their rates."""
    S = opened(table)
    s = S.state
    A = S.arrays
    kernels.probe_paths(A.shown, A.probes_offset, s.x, s.v, s.v, s.acceleration, S.space.paths)


@jit
def add_drift(table: Any, second: float, third: float) -> None:
    """Rates of the joints on these, D1 + second D2 + third D3 behind the forces in rhs."""
    t = opened(table).space
    t.leads[0], t.leads[1] = second, third
    evaluation.find_drift(table)


@jit
def swap_signals(table: Any) -> None:
    """Signals of the trial state and of the first row of the job, one for the other."""
    S = opened(table)
    for i in range(S.job.signals.shape[1]):
        other = S.job.signals[0, i]
        S.job.signals[0, i] = S.space.signals[i]
        S.space.signals[i] = other


@jit
def find_bend(table: Any) -> None:
    """dD2 / bh behind the forces in rhs, from the signals in the job to those of the trial state."""
    S = opened(table)
    t = S.space
    n = len(t.x)
    place_paths(table)
    add_drift(table, 1.0, 0.0)
    kernels.copy(t.rhs[0, n:], t.multipliers)
    swap_signals(table)
    add_drift(table, 1.0, 0.0)
    # what the job had is given to both from now on
    for i in range(S.job.signals.shape[1]):
        t.signals[i] = S.job.signals[0, i]
    for k in range(len(t.multipliers)):
        t.rhs[0, n + k] = (t.multipliers[k] - t.rhs[0, n + k]) / S.method.bh
    kernels.copy(S.state.multipliers, t.multipliers)


@routine
def jump(table: Any, bends: Any) -> int:
    """Put q'', the algorithmic acceleration and multipliers of the accepted state onto histories
    that jump there; the status.

        (M + (gh C + K) / bh) dq'' + Phi_q^T dlambda = dQ,    Phi_q dq'' = -dD2

    as loads that begin with a step, see `initial`; dD2 is 0 but for drives of which `bends` (1)
    says that their accelerations jump. What predicts the next step jumps as well, so that steps on
    both sides are of second order.
    """
    S = opened(table)
    s = S.state
    t = S.space
    w = S.work
    n = len(S.state.x)
    if S.doors.settle != 0 and bends != 0:
        swap_signals(table)
    else:
        for i in range(S.job.signals.shape[1]):
            t.signals[i] = S.job.signals[0, i]
    kernels.copy(s.x, t.x)
    kernels.copy(s.v, t.v)
    kernels.copy(s.acceleration, t.acceleration)
    kernels.copy(s.multipliers, t.multipliers)
    kernels.copy(s.memory, t.memory)
    t.c[0] = S.method.c
    if invoke(S.doors.residual, table, 0) != 0:
        return STOPPED
    made = w.kind[0] == 0
    if made:
        S.job.counters[FACTORISATIONS] += 1
        if invoke(S.doors.factorise, table, 0) != 0:
            return SINGULAR
    # gaps of positions are none of a jump of accelerations
    kernels.clear(t.rhs[0, n:])
    # no drive bends where all joints are steady
    if S.doors.settle != 0 and bends != 0:
        find_bend(table)
    if invoke(S.doors.solve, table, 0) != 0:
        return STOPPED
    for i in range(n):
        d = S.method.bh * t.f[i]
        s.acceleration[i] -= d
        s.a[i] -= d
        # a history that jumped between its rows would be extrapolated as a slope
        for k in range(len(s.history)):
            s.history[k, i] -= d
    for m in range(len(s.multipliers)):
        d = t.rhs[0, n + m]
        s.multipliers[m] -= d
        for k in range(len(s.past)):
            s.past[k, m] -= d
    # a step begins with factors of its guess: an arm whose torque changes in every step took 5.4
    # corrections and 3.3 factorisations a step with those of its begin, and 3.7 and 1.7 with its own
    if made:
        w.kind[0] = 0
    if len(S.job.work) == 0:
        return DONE
    s.work[0] += change_signals(table, S.job.signals[0])
    kernels.copy(S.job.signals[0, : len(s.signals)], s.signals)
    work.find_forces(table)
    kernels.copy(t.f, s.push)
    return DONE


def keep(step: Step, row: int) -> None:
    """`store` as Python calls it: that of compiled code takes half a second to load, as much as a
    small run.
    """
    s, job = step.state, step.job
    job.out[:, row, job.order] = s.x, s.v, s.acceleration
    job.multipliers[row], job.memory[row], job.work[row] = (
        s.multipliers / step.method.c,
        s.memory,
        s.work[0],
    )


@jit
def store(s: State, c: float, row: int, job: StepJob) -> None:
    """Row of the trajectory; multipliers become physical."""
    out, order = job.out, job.order
    for i in range(len(s.x)):
        k = order[i]
        out[0, row, k], out[1, row, k], out[2, row, k] = s.x[i], s.v[i], s.acceleration[i]
    for m in range(len(s.multipliers)):
        # parts of a divided step have another c
        job.multipliers[row, m] = s.multipliers[m] / c
    kernels.copy(s.memory, job.memory[row])
    job.work[row] = s.work[0]
