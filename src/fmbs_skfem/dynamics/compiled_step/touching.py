r"""Steps in which something touches: where a rope, a stop or a contact begins or ends, a part of
the step ends, and another begins.

    t_n to t* - tau,    x + tau v + tau^2 q'' / 2,    q'' + dq'' at t*,    t* to t_n + h,      tau at most a hundredth of h

t* is where a force begins or ends on the way with the accelerations of now, which the method then
takes but for a hundredth: a guess that is too late is seen, and taken back. What acts from t* on
acts in no part before it, so that an impact does not depend on where in a step it begins: errors of
a jump of forces would be of first order, and those of a kink of second order with another factor in
every step. Models in which many places touch divide steps alone, see
`scheme.touches_in_few_places`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import evaluation, kernels, work
from .parts import begin_of, copy_state, scale_multipliers
from .step import (
    BEGIN,
    HALVED,
    JOB,
    LENGTH,
    NOW,
    NUMBER,
    NUMBERS,
    PASSING,
    STEPS,
    TAKEN,
    State,
    Workspace,
    opened,
)
from .stepping import DONE, NOT_FINITE, STOPPED, TOUCHES, look_ahead, place_accepted

HALVINGS = 6  #: a failed step is tried with h / 2, ..., h / 2^6
#: halvings that are tried, and whether steps are judged: judged ones first, from long to short;
#: where the shortest fails as well longer ones stand as they are, so that nothing that went through
#: fails, and a failure shows the shortest
TRIALS = [
    *((k, True) for k in range(HALVINGS)),
    *((k, False) for k in range(HALVINGS, -1, -1)),
    (HALVINGS, False),
]
SHORTEST = TRIALS.index((HALVINGS, False))
TINY = 0.01  #: of a step, below which a piece of it is taken by the Taylor series
# parts turn what vibrates by 0.05 rad: the series over a tenth of one misses 1e-5 of its speed,
# over TINY of 64 of them 5e-4
SHORT = 0.1  #: of a part, the same on the way to a touch
MOST = 4  #: touches that are located in a step; what others leave is that of divided steps
TRIES = 8  #: pieces on the way to each of them
#: parts of a way that is known but for h^3 which end before its end, for sure
EARLY = (
    0.99,
    0.9,
    0.5,
)
#: of the change by forces that begin and end on a way, below which it is at none of them
SLIGHT = 1e-6
BISECTIONS = 40  #: of a step, to where something touches in it


def restart(state: State, work: Workspace) -> None:
    """Forget what was known of a motion that goes on otherwise: earlier accelerations and factors.

    What is left is one known acceleration, order 0 of the predictor, and no factors. Both arguments
    are changed in place.
    """
    state.known[0], state.order[0], state.change[0], work.kind[0] = 1, 0, np.inf, 0


# Python restarts without it: a wrapper would load numba
forget = jit(restart)


@routine
def take(table: Any, _: Any) -> int:
    """Take the step that a job has come to from touch to touch; the status. On failure the state is
    as it was.
    """
    S = opened(table)
    levels, job = S.levels, S.job
    number, first, row = levels.found[NUMBER], levels.spans[JOB, BEGIN], job.done[0]
    begin, span = begin_of(table), levels.spans[JOB, LENGTH]
    steps, failed = job.counters[STEPS], job.counters[HALVED]
    copy_state(levels.held, False)
    status = take_in_pieces(table, begin, span)
    # a function of Python that has failed is asked no more
    if status != DONE and status != STOPPED:
        # a piece may fail where a longer one does not: nothing that parts alone take is to fail
        copy_state(levels.held, True)
        job.counters[HALVED] = failed
        job.done[PASSING] = 1
        status = try_span(table, begin, span, 0)
    job.done[PASSING] = 0
    if status != DONE:
        copy_state(levels.held, True)
    job.counters[STEPS] = steps + (1 if status == DONE else 0)
    # steps of the job go on in their length
    levels.found[NUMBER], job.done[0] = number, row
    levels.spans[JOB, BEGIN], levels.spans[JOB, LENGTH] = first, span
    if invoke(levels.set_span, table, 0) != 0:
        return STOPPED
    return status


@jit
def take_in_pieces(table: Any, begin: float, span: float) -> int:
    """Take a span from a time on [s] from touch to touch; the status. On failure the state is that
    before the last piece.
    """
    S = opened(table)
    levels = S.levels
    done = 0.0
    touches = 0
    tries = 0
    while True:
        locating = touches < MOST and tries < TRIES * MOST
        S.job.done[PASSING] = 0 if locating else 1
        status = try_span(table, begin + done, span - done, 0)
        # the trial says in which of its parts: what is before it is known
        taken = levels.found[TAKEN]
        part = (span - done) / max(levels.found[NUMBERS], 1)
        known = done + taken * part
        end = done + (taken + 1) * part
        if status != TOUCHES:
            if status in (DONE, STOPPED) or not locating:
                return status
            # an iteration finds no solution where a damped force jumps
            seen = find_touch(table, end - done)
            if seen[1] == 0.0:
                return status
        short = min(TINY * span, SHORT * part)
        for _k in range(TRIES):
            way, beyond = known - done, np.inf
            if way <= short:
                way, beyond = find_touch(table, end - done)
            if way <= short and beyond > 0.0:
                status = meet(table, begin + done, beyond)
                if status != DONE:
                    return status
                done += beyond
                touches += 1
                rest = span - done
                # as at the end of a step, where nothing is left of it
                if rest <= short:
                    return go_by_series(table, begin + done, max(rest, 0.0))
                break
            gone = approach(table, begin + done, way if way > 0.0 else 0.5 * (end - done), part)
            if gone == 0.0:
                # without a way to go on it would be the same again
                tries = TRIES * MOST
                break
            done += gone
            tries += 1


@routine
def take_span(table: Any, _: Any) -> int:
    """Take the span JOB at once, or in parts, as a piece of a step: nothing is stored; the status,
    TOUCHES where something touches in it.
    """
    S = opened(table)
    return try_span(table, S.levels.spans[JOB, BEGIN], S.levels.spans[JOB, LENGTH], 0)


@jit
def try_span(table: Any, begin: float, span: float, halvings: int) -> int:
    """Take a span of time from a time on [s] in so many halvings or more; the status."""
    S = opened(table)
    levels = S.levels
    levels.found[NUMBER], S.job.done[0] = -1, 0
    levels.spans[JOB, BEGIN], levels.spans[JOB, LENGTH] = begin, span
    if invoke(levels.set_span, table, 0) != 0:
        return STOPPED
    # halvings of a state are those of whole steps
    shorter = 0
    length = 2.0 * span
    while length <= S.method.h and shorter < HALVINGS:
        length *= 2.0
        shorter += 1
    parts = S.state.parts
    before = parts[0]
    parts[0] = max(before - shorter if S.method.local > 0.0 else 0, min(halvings, HALVINGS - 1))
    status = invoke(S.doors.divide, table, DONE)
    if status != DONE:
        parts[0] = before
    elif parts[0] > 0:
        parts[0] = min(parts[0] + shorter, HALVINGS - 1)
    return int(status)


@jit
def find_touch(table: Any, span: float) -> tuple[float, float]:
    """Where a force begins or ends first on the way within a span [s]: times just before it and
    just behind it; zeros where none does.

        x + t v + t^2 q'' / 2

    What changes by less than SLIGHT of all that begins and ends up to the end of the way does not
    count.
    """
    most = change_ahead(table, span)
    low = 0.0
    high = span
    if not 0.0 < most < np.inf:
        return 0.0, 0.0
    for _k in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if change_ahead(table, middle) > SLIGHT * most:
            high = middle
        else:
            low = middle
    return low, high


@jit
def change_ahead(table: Any, span: float) -> float:
    """The change by forces that have begun or ended where the accepted state is after a span [s],
    with the accelerations it has.
    """
    look_ahead(table, span)
    return opened(table).space.impulse[1]


@jit
def approach(table: Any, begin: float, way: float, longest: float) -> float:
    """Go most of the way to a touch from a time on, and how far that was [s]; 0 where it touches
    before.

    In parts of a `longest` length [s] or shorter ones: in those that have come so far. Longer ones
    may touch before.
    """
    S = opened(table)
    halvings = 0
    length = way
    while length > longest and halvings < HALVINGS:
        length *= 0.5
        halvings += 1
    for part in EARLY:
        if try_span(table, begin, part * way, halvings) == DONE:
            forget(S.state, S.work)
            return part * way
    return 0.0


@jit
def meet(table: Any, begin: float, beyond: float) -> int:
    """Go from a time on [s] just beyond a touch, and begin anew with the forces there; the status."""
    status = go_by_series(table, begin, beyond)
    return status if status != DONE else jump(table, begin + beyond)


@jit
def ask(table: Any, time: float, step: float) -> int:
    """Signals at a time, derivatives those of a step that ends there [s], into the first row of the
    trials; the status.
    """
    levels = opened(table).levels
    levels.spans[NOW, BEGIN], levels.spans[NOW, LENGTH] = time, step
    if levels.histories == 0:
        return DONE
    if invoke(levels.histories, table, 0) != 0:
        return STOPPED
    return DONE if levels.found[NUMBERS] > 0 else NOT_FINITE


@routine
def take_series(table: Any, _: Any) -> int:
    """Go over the span JOB by a series; the status."""
    levels = opened(table).levels
    return go_by_series(table, levels.spans[JOB, BEGIN], levels.spans[JOB, LENGTH])


@jit
def go_by_series(table: Any, begin: float, span: float) -> int:
    """Go on from a time for a span h [s] by a series; the status.

    x + h v + h^2 q'' / 2
    """
    S = opened(table)
    s, t = S.state, S.space
    status = ask(table, begin + span, S.method.h)
    if status != DONE:
        return status
    for i in range(len(s.x)):
        t.way[i] = span * s.v[i] + 0.5 * span * span * s.acceleration[i]
        s.x[i] += t.way[i]
        s.v[i] += span * s.acceleration[i]
    place_accepted(table)
    if len(t.signals) > 0:
        kernels.copy(opened(S.levels.tables[SHORTEST]).job.signals[0], t.signals)
    evaluation.take_over(table)
    kernels.copy(t.memory, s.memory)
    work.forces(table, 0)
    s.work[0] += 0.5 * (kernels.dot(s.push, t.way) + kernels.dot(t.f, t.way))
    kernels.copy(t.f, s.push)
    kernels.copy(t.gradients[evaluation.NOW], s.gradients)
    forget(s, S.work)
    return DONE


@jit
def jump(table: Any, time: float) -> int:
    """Accelerations and reactions of the present state with the forces that have begun in it at a
    time [s]; the status. See `stepping.jump`.
    """
    S = opened(table)
    s, levels = S.state, S.levels
    h = levels.spans[JOB, LENGTH] / 2**HALVINGS
    status = ask(table, time, h)
    if status != DONE:
        return status
    # in the shortest parts: over whole steps a damper would take of the jump what it takes of the
    # speed in a step
    factor = (h / S.method.h) ** 2
    scale_multipliers(s, factor)
    forget(s, S.work)
    # by address: it opens the step of these parts anew, whose length has changed
    status = invoke(levels.jump, levels.tables[SHORTEST], 0)
    scale_multipliers(s, 1.0 / factor)
    # as at the start of a motion: of what the accelerations did before, half would be won at each
    # impact and none lost
    kernels.copy(s.acceleration, s.a)
    forget(s, S.work)
    return STOPPED if status == STOPPED else DONE
