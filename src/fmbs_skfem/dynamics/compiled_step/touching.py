r"""Steps in which something touches: where a rope, a stop or a contact begins or ends, a part of the step ends, and another begins.

    t_n to t* - tau,    x + tau v + tau^2 q'' / 2,    q'' + dq'' at t*,    t* to t_n + h,      tau at most a hundredth of h

t* is where a force begins or ends on the way with the accelerations of now, which the method then takes but for a hundredth: a
guess that is too late is seen, and taken back. What acts from t* on acts in no part before it, so that an impact does not depend on
where in a step it begins: errors of a jump of forces would be of first order, and those of a kink of second order with another
factor in every step. Models in which many places touch divide steps alone, see `scheme.touches_in_few_places`.
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
from .step import NUMBERS, STEPS, TAKEN

if TYPE_CHECKING:
    from .packing import PackedStep

HALVINGS = 6  #: a failed step is tried with h / 2, ..., h / 2^6
#: halvings that are tried, and whether steps are judged: judged ones first, from long to short; where the shortest fails as well
#: longer ones stand as they are, so that nothing that went through fails, and a failure shows the shortest
TRIALS = [*((k, True) for k in range(HALVINGS)), *((k, False) for k in range(HALVINGS, -1, -1)), (HALVINGS, False)]
SHORTEST = TRIALS.index((HALVINGS, False))
TINY = 0.01  #: of a step, below which a piece of it is taken by the Taylor series
MOST = 4  #: touches that are located in a step; what others leave is that of divided steps
TRIES = 8  #: pieces on the way to each of them
EARLY = (0.99, 0.9, 0.5)  #: parts of a way that is known but for h^3 which end before its end, for sure


def take(packed: PackedStep, begin: float, span: float) -> int:
    """Take a span from a time on [s] from touch to touch; the status. On failure the state is as it was."""
    state, counters = packed.step.state, packed.step.job.counters
    before, steps = [part.copy() for part in state], int(counters[STEPS])
    done, touches, tries = 0.0, 0, 0
    try:
        while True:
            packed.locate(touches < MOST and tries < TRIES * MOST)
            status = packed.try_span(begin + done, span - done)
            if status != stepping.TOUCHES:
                break
            # the trial says in which of its parts: what is before it is known, and on the way in it acts what acts at its begin
            taken, parts = (int(k) for k in packed.lengths.found[[TAKEN, NUMBERS]]) if packed.lengths else (0, 1)
            part = (span - done) / parts
            way, beyond = (taken * part, math.inf) if taken else find_touch(packed, part)
            if beyond == 0.0:
                tries += 1
                done += approach(packed, begin + done, 0.5 * part)
            elif way > TINY * span:
                tries += 1
                done += approach(packed, begin + done, way)
            else:
                go_by_series(packed, begin + done, beyond)
                jump(packed, begin + done + beyond)
                done, touches = done + beyond, touches + 1
    finally:
        packed.locate(True)
    if status != stepping.DONE:
        put(state, before)
    counters[STEPS] = steps + (status == stepping.DONE)
    return status


def find_touch(packed: PackedStep, span: float) -> tuple[float, float]:
    """Times from now on, within a span [s], just before something touches and just behind it; zeros where that is not seen."""
    touch = packed.step.job.touch
    touch[0] = span
    found = packed.call(stepping.find_touch)
    return (float(touch[0]), float(touch[1])) if found == stepping.DONE else (0.0, 0.0)


def approach(packed: PackedStep, begin: float, way: float) -> float:
    """Go most of the way to a touch from a time on, and how far that was [s]; 0 where it touches before."""
    for part in EARLY:
        if packed.try_span(begin, part * way) == stepping.DONE:
            restart(packed.step.state, packed.step.work)
            return part * way
    return 0.0


def go_by_series(packed: PackedStep, begin: float, span: float) -> None:
    """Go on from a time for a span [s] by x + h v + h^2 q'' / 2."""
    model, state = packed.model, packed.step.state
    way = span * state.v + 0.5 * span**2 * state.acceleration
    state.x[:] += way
    state.v[:] += span * state.acceleration
    back = np.argsort(model.order)
    state.memory[:] = compilation.accepted(model, state.x[back], state.v[back], state.memory.copy(), begin + span)
    push, gradients = compilation.working(model, state.x[back], state.v[back], begin + span, state.memory)
    state.work[0] += 0.5 * (state.push + push) @ way
    state.push[:], state.gradients[:] = push, gradients
    restart(state, packed.step.work)


def jump(packed: PackedStep, time: float) -> None:
    """Accelerations and reactions of the present state with the forces that have begun in it at a time [s]; see `stepping.jump`."""
    lengths, state, h = packed.lengths, packed.step.state, packed.span / 2**HALVINGS
    assert lengths is not None  # of the span in which it touches
    signals, _ = leading_signals(packed.model.system, np.array([time]), h)
    lengths.signals[: len(signals)] = signals
    # in the shortest parts: over whole steps a damper would take of the jump what it takes of the speed in a step
    factor = (h / packed.step.method.h) ** 2
    for part in (state.multipliers, state.past):
        part *= factor
    restart(state, packed.step.work)
    if stepping.jump.call(address_of(lengths.tables[SHORTEST]), 0) != stepping.DONE:
        packed.check()
    for part in (state.multipliers, state.past):
        part /= factor
    restart(state, packed.step.work)
