"""A start that fails in the shortest steps once more, and what puts a state back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .compiled_step import stepping
from .initial import begin_steps, is_filtered, start_of, start_step

if TYPE_CHECKING:
    from .run import OpenRun


def retry_filtered(run: OpenRun, status: int, begin: float) -> int:
    """What diverged in parts of all lengths once more, from filtered accelerations if the motion
    starts at `begin` [s]; the status.

    M^-1 f of a force that begins at once is huge in waves that no step resolves, and no guess of
    the next q''. The last resort: filtered accelerations leave out what divided steps would follow.
    """
    if begin != 0.0 or status != stepping.DIVERGED or is_filtered(run.model.system):
        return status
    state = run.step.state
    before = [part.copy() for part in state]
    start_step(run.packed, run.scheme, start_of(run.model), filtered=True)
    # where nothing holds what begins to move it begins with what balances all forces
    if np.array_equal(state.acceleration, state.history[0]):
        put(state, before)
        return status
    begin_steps(state)
    return run.packed.divide(status)


def put(arrays: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> None:
    """Put values back into arrays, as those of a state.

    `arrays` are changed in place; both sequences have the same length, and arrays of the same
    shapes.
    """
    for array, value in zip(arrays, values, strict=True):
        array[:] = value
