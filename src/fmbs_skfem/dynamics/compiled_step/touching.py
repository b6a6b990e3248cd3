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

import math
from typing import TYPE_CHECKING

import numpy as np

from ...core.compiling.structs import address_of
from ...systems import compiled as compilation
from ..dividing import put, restart
from ..histories import leading_signals
from . import stepping
from .step import HALVED, NUMBERS, STEPS, TAKEN

if TYPE_CHECKING:
    from .packing import PackedStep

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


def take(packed: PackedStep, begin: float, span: float) -> int:
    """Take a span from a time on [s] from touch to touch; the status. On failure the state is as it
    was.
    """
    state = packed.step.state
    counters = packed.step.job.counters
    before = [part.copy() for part in state]
    steps = int(counters[STEPS])
    failed = int(counters[HALVED])
    try:
        status = take_in_pieces(packed, begin, span)
        if status != stepping.DONE:
            # a piece may fail where a longer one does not: nothing that parts alone take is to fail
            put(state, before)
            counters[HALVED] = failed
            packed.locate(False)
            status = packed.try_span(begin, span)
    finally:
        packed.locate(True)
    if status != stepping.DONE:
        put(state, before)
    counters[STEPS] = steps + (status == stepping.DONE)
    return status


def take_in_pieces(packed: PackedStep, begin: float, span: float) -> int:
    """The same; on failure the state is that before the last piece."""
    done = 0.0
    touches = 0
    tries = 0
    while True:
        locating = touches < MOST and tries < TRIES * MOST
        packed.locate(locating)
        status = packed.try_span(begin + done, span - done)
        # the trial says in which of its parts: what is before it is known
        assert packed.lengths is not None
        taken, parts = packed.lengths.found[[TAKEN, NUMBERS]].tolist()
        part = (span - done) / max(parts, 1)
        known, end = done + taken * part, done + (taken + 1) * part
        fails = status not in (stepping.DONE, stepping.TOUCHES, stepping.STOPPED)
        # an iteration finds no solution where a damped force jumps
        if status != stepping.TOUCHES and not (
            locating and fails and find_touch(packed, end - done)[1] > 0.0
        ):
            return status
        short = min(TINY * span, SHORT * part)
        for _ in range(TRIES):
            way, beyond = (
                (known - done, math.inf) if known - done > short else find_touch(packed, end - done)
            )
            if way <= short and beyond > 0.0:
                go_by_series(packed, begin + done, beyond)
                jump(packed, begin + done + beyond)
                done, touches = done + beyond, touches + 1
                # as at the end of a step, where nothing is left of it
                if (rest := span - done) <= short:
                    go_by_series(packed, begin + done, max(rest, 0.0))
                    return stepping.DONE
                break
            gone = approach(packed, begin + done, way or 0.5 * (end - done), part)
            done += gone
            # without a way to go on it would be the same again
            tries = tries + 1 if gone else TRIES * MOST
            if not gone:
                break


def find_touch(packed: PackedStep, span: float) -> tuple[float, float]:
    """Times from now on, within a span [s], just before something touches and just behind it; zeros
    where that is not seen.
    """
    touch = packed.step.job.touch
    touch[0] = span
    found = packed.call(stepping.find_touch)
    return (float(touch[0]), float(touch[1])) if found == stepping.DONE else (0.0, 0.0)


def approach(packed: PackedStep, begin: float, way: float, longest: float) -> float:
    """Go most of the way to a touch from a time on, and how far that was [s]; 0 where it touches
    before.

    In parts of a `longest` length [s] or shorter ones: in those that have come so far. Longer ones
    may touch before.
    """
    parts = max(0, math.ceil(math.log2(way / longest)))
    for part in EARLY:
        if packed.try_span(begin, part * way, parts) == stepping.DONE:
            restart(packed.step.state, packed.step.work)
            return part * way
    return 0.0


def go_by_series(packed: PackedStep, begin: float, span: float) -> None:
    """Go on from a time for a span h [s] by a series.

        x + h v + h^2 q'' / 2

    for both entries of `packed`.
    """
    model = packed.model
    state = packed.step.state
    way = span * state.v + 0.5 * span**2 * state.acceleration
    state.x[:] += way
    state.v[:] += span * state.acceleration
    back = np.argsort(model.order)
    state.memory[:] = compilation.accepted(
        model, state.x[back], state.v[back], state.memory.copy(), begin + span
    )
    push, gradients = compilation.working(
        model, state.x[back], state.v[back], begin + span, state.memory
    )
    state.work[0] += 0.5 * (state.push + push) @ way
    state.push[:], state.gradients[:] = push, gradients
    restart(state, packed.step.work)


def jump(packed: PackedStep, time: float) -> None:
    """Accelerations and reactions of the present state with the forces that have begun in it at a
    time [s]; see `stepping.jump`.
    """
    lengths = packed.lengths
    state = packed.step.state
    h = packed.span / 2**HALVINGS
    assert lengths is not None  # of the span in which it touches
    signals, _ = leading_signals(packed.model.system, np.array([time]), h)
    lengths.signals[: len(signals)] = signals
    # in the shortest parts: over whole steps a damper would take of the jump what it takes of the
    # speed in a step
    factor = (h / packed.step.method.h) ** 2
    for part in (state.multipliers, state.past):
        part *= factor
    restart(state, packed.step.work)
    if stepping.jump.call(address_of(lengths.tables[SHORTEST]), 0) != stepping.DONE:
        packed.check()
    for part in (state.multipliers, state.past):
        part /= factor
    # as at the start of a motion: of what the accelerations did before, half would be won at each
    # impact and none lost
    state.a[:] = state.acceleration
    restart(state, packed.step.work)
