"""Pieces of a step, between events and jumps of loads: by the method, or by the Taylor series where
they are too short for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..dividing import retry_filtered
from ..histories import leading_signals
from ..initial import begin_steps
from . import stepping
from .packing import UNSTORED
from .touching import TINY, restart

if TYPE_CHECKING:
    from ..run import OpenRun

EXACT = 1e-12  #: of a step, to which places in it are found
# round-off of second derivatives is 1e-16 over the square of a third of it
AHEAD = 0.1  #: of a step, from which derivatives of drives behind a corner are taken


class Unreached(Exception):
    """A piece of a step that cannot be taken, with its status.

    `status` is one of `dynamics.compiled_step.stepping`.
    """

    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


def take_piece(run: OpenRun, place: float, to: float) -> None:
    """Go from a place in the present step to another one, both parts of it, and over the loads that
    jump between them.

    Places are from 0 to 1 in the step. Pieces shorter than a hundredth of it go by

        x + h v + h^2 q'' / 2

    Unreached where a piece cannot be taken.
    """
    begin = run.scheme.step * (run.done + place)
    h = run.scheme.step
    first = place == 0.0
    begin_steps(run.step.state)
    for jump in run.jumps.get(run.done, ()):
        if place < jump.place <= to or (first and jump.place == 0.0):
            go_on(run, begin, jump.before - begin)
            jump_over(run, jump.behind, jump.bends)
            place, begin = jump.place, jump.behind
    go_on(run, begin, h * (run.done + to) - begin)


def jump_over(run: OpenRun, behind: float, bends: bool = False) -> int:
    """Accelerations and reactions of the present state with loads as they are behind a jump [s], or
    with drives that bend there; the status of `stepping.jump`.
    """
    # what drives do behind a corner is known by what comes: over little of the step, as another
    # corner may follow
    span = (-AHEAD if bends else 1.0) * run.scheme.step
    signals, _ = leading_signals(run.model.system, np.array([behind]), span)
    if not len(signals):
        raise Unreached(stepping.NOT_FINITE)
    run.packed.give(signals, UNSTORED)
    if (status := run.packed.call(stepping.jump, int(bends))) != stepping.DONE:
        run.model.check()
    restart(run.step.state, run.step.work)
    return status


def go_on(run: OpenRun, begin: float, span: float) -> None:
    """Go on from a time for a span [s] in which no load jumps."""
    state = run.step.state
    if span >= TINY * run.scheme.step:
        status = retry_filtered(run, run.packed.take_span(begin, span), begin)
        if status != stepping.DONE:
            raise Unreached(status)
        restart(state, run.step.work)
        return
    if span > 0.0 and (status := run.packed.take_series(begin, span)) != stepping.DONE:
        raise Unreached(status)
