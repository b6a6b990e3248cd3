"""A span of time in equal parts: a step that cannot be taken at once, or what events leave of one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.notices import notify
from .compiled_step import stepping
from .compiled_step.step import HALVED, STEPS, State, Workspace
from .histories import leading_signals
from .initial import filtered_start, first_state
from .scheme import method_of

if TYPE_CHECKING:
    from .run import OpenRun

HALVINGS = 6  #: a failed step is tried with h / 2, ..., h / 2^6
#: halvings that are tried, and whether steps are judged: the shortest, or longer ones, as they are; a failure shows the shortest
TRIALS = [*((k, True) for k in range(HALVINGS)), *((k, False) for k in range(HALVINGS, -1, -1)), (HALVINGS, False)]


def divided(
    run: OpenRun, status: int, begin: float, span: float, row: int, first: int, filtered: bool = False
) -> tuple[int, float]:
    """A span [s] of time in 2^first or more equal parts, with a status that says why; status and time of the failure in the finest.

    The state at its end goes into a row of the trajectory, -1 for none. Where forces began or ended too fast for longer steps, the
    next step is tried in half as many parts, and the shortest stand. What fails at the start of a motion in all of them is tried
    once more from accelerations that are `filtered`: M^-1 f of a force that begins at once is huge in waves that no step resolves,
    and no guess of the next q''.
    """
    state, counters, full = run.step.state, run.step.job.counters, run.step.method
    # every trial begins with the same state, whatever the one before has left
    saved = [array.copy() for array in state]
    touching, reached = status == stepping.TOO_LONG, begin
    # judged ones first, from long to short; where the shortest fails as well longer ones stand as they are, so that nothing that
    # went through fails
    for halving, judging in TRIALS[first:]:
        parts = 2**halving
        method = method_of(run.scheme, run.newton, span / parts, run.model)._replace(judging=judging)
        for kept in (state.multipliers, state.past):
            # multipliers of a step have c = beta h^2 in them
            kept *= method.c / full.c
        restart(state, run.step.work)
        # what touches divides steps by plan: only failures of the iteration speak against a motion
        counters[HALVED] += status not in (stepping.TOO_LONG, stepping.DONE)
        leapt = run.step.job.done[1]
        signals, broken = leading_signals(run.model.system, begin + span * (np.arange(parts) + 1) / parts, method.h)
        status, taken = run.take(method, signals, np.append(np.full(parts - 1, -1), row))
        counters[STEPS] -= taken
        if status == stepping.DONE and broken is None:
            for kept in (state.multipliers, state.past):
                kept *= full.c / method.c
            restart(state, run.step.work)
            counters[STEPS] += 1
            # a touch takes some steps: the next one begins near what this one needed, and grows back
            state.parts[0] = max(halving - 1, 0) if touching else 0
            if leapt == 0 and run.step.job.done[1] > 0:
                warn_of_leaps(begin, begin + span, method.h)
            return status, begin + span
        reached = begin + span * taken / parts
        if status == stepping.DONE and broken is not None:
            status, reached = stepping.NOT_FINITE, broken.time
        touching = touching or status == stepping.TOO_LONG
        put(state, saved)
    # the last resort: filtered accelerations leave out what divided steps would follow
    if begin == 0.0 and status == stepping.DIVERGED and not filtered and (start := filtered_start(run.model, run.scheme)):
        put(state, first_state(run.model, start, full.c))
        return divided(run, status, begin, span, row, first, filtered=True)
    return status, reached


def warn_of_leaps(begin: float, end: float, h: float) -> None:
    """A warning where the shortest step [s] is too long for what touches."""
    where = f"what touches went through to the other side between t = {begin:.6g} and {end:.6g} s, even in steps of {h:.3g} s"
    why = "it moves too fast, or is pressed in by more than half of what is thin"
    notify(f"{where}: {why}; take a smaller step, or more stiffness")


def put(arrays: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> None:
    """Put values back into arrays, as those of a state.

    `arrays` are changed in place; both sequences have the same length, and arrays of the same shapes.
    """
    for array, value in zip(arrays, values, strict=True):
        array[:] = value


def restart(state: State, work: Workspace) -> None:
    """Forget what was known of steps of another size: earlier accelerations and factors.

    What is left is one known acceleration, order 0 of the predictor, and no factors. Both arguments are changed in place.
    """
    state.known[0], state.order[0], state.change[0], work.kind[0] = 1, 0, np.inf, 0
