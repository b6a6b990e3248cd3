"""Pieces of a step: what events leave of one, by the method, or by the Taylor series where they are too short for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.compiled_step import stepping
from ..dynamics.dividing import restart, retry_filtered
from ..systems import compiled as compilation

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

TINY = 0.01  #: of a step, below which a piece of it is taken by the Taylor series
EXACT = 1e-12  #: of a step, to which places in it are found


class Unreached(Exception):
    """A piece of a step that cannot be taken, with its status.

    `status` is one of `dynamics.compiled_step.stepping`.
    """

    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


def take_piece(run: OpenRun, place: float, to: float) -> None:
    """Go from a place in the present step to another one, both parts of it.

    Places are from 0 to 1 in the step. Pieces shorter than a hundredth of it go by x + h v + h^2 q'' / 2. Unreached where a piece
    cannot be taken.
    """
    h, state = run.scheme.step, run.step.state
    begin, span = h * (run.done + place), h * (to - place)
    if span >= TINY * h:
        status = retry_filtered(run, run.packed.take_span(begin, span), begin)
        if status != stepping.DONE:
            raise Unreached(status)
        restart(state, run.step.work)
        return
    way = span * state.v + 0.5 * span**2 * state.acceleration
    state.x[:] += way
    state.v[:] += span * state.acceleration
    back = np.argsort(run.model.order)
    state.memory[:] = compilation.accepted(run.model, state.x[back], state.v[back], state.memory.copy(), begin + span)
    push, gradients = compilation.working(run.model, state.x[back], state.v[back], begin + span, state.memory)
    state.work[0] += 0.5 * (state.push + push) @ way
    state.push[:], state.gradients[:] = push, gradients
    restart(state, run.step.work)


def last_place(broken: Callable[[float], bool], place: float, end: float) -> tuple[float, float]:
    """The last place of a step, from `place` to `end`, to which values are numbers, and the first one where they are `broken`.

    By bisection, to 1e-12 of the step; places are from 0 to 1.
    """
    while end - place > EXACT:
        middle = 0.5 * (place + end)
        place, end = (place, middle) if broken(middle) else (middle, end)
    return place, end
