"""A failed time step once more, in all lengths that were tried, to see the course of Newton's iteration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import Reason
from . import stepping
from .histories import leading_signals
from .integration import HALVINGS, REASONS, Run, restart
from .scheme import method_of


@dataclass(frozen=True)
class Attempt:
    """A step that was tried in one length: what every correction of Newton's iteration changed, and what it left."""

    step: float  #: [s]
    time: float  #: at the end of the part that failed [s]
    outcome: Reason | None  #: None where it was taken
    corrections: tuple[float, ...]  #: root mean square of the change of positions over the size of the mechanism
    residuals: tuple[float, ...]  #: norm of the force residual after the correction [N]


def attempts(run: Run) -> tuple[Attempt, ...]:
    """The failed step again, in all lengths that were tried; of large models in the full and the shortest one.

    The iteration is repeated with one correction more each time, so that its course shows without another copy of the step.
    """
    halvings = (0, HALVINGS) if run.model.plan else range(HALVINGS + 1)
    return tuple(attempt(run, 2**k) for k in halvings)


def attempt(run: Run, parts: int) -> Attempt:
    """The failed step in equal parts, up to the one that fails."""
    model, system = run.model, run.model.system
    n, method = system.size, method_of(run.scheme, run.newton, run.scheme.step / parts, run.model)
    state, counters = type(run.state)(*(part.copy() for part in run.state)), np.zeros_like(run.counters)
    for part in (state.multipliers, state.past):
        part *= method.c / run.method.c
    run.work.kind[0] = 0
    if parts > 1:
        restart(state, run.work)
    start = [part.copy() for part in state]
    signals, _ = leading_signals(system, run.scheme.step * (run.done + (np.arange(parts) + 1) / parts), method.h)
    rows, out, multipliers = np.full(parts, -1), np.zeros((3, 1, n)), np.zeros((1, model.constraints))
    status, taken = run.advance(state, run.work, method, signals, rows, out, multipliers, counters)
    time = run.scheme.step * (run.done + min(taken + 1, parts) / parts)
    if status == stepping.DONE:
        return Attempt(method.h, time, None, (), ())
    restore(state, start)
    run.advance(state, run.work, method, signals[:taken], rows, out, multipliers, counters)
    last, space, corrections, residuals = status, [part.copy() for part in run.work], [], []
    for many in range(1, method.iterations + 1):
        restore(run.work, space)
        short = method._replace(iterations=many)
        status, _ = run.advance(state, run.work, short, signals[taken : taken + 1], rows, out, multipliers, counters)
        if status == stepping.SINGULAR or status == stepping.DONE:
            break
        corrections.append(float(np.sqrt(model.arrays.norm @ run.work.rhs[0, :n] ** 2)) / system.scale)
        stepping.residual(model.arrays, run.work, method.c, signals[taken])
        residuals.append(float(np.linalg.norm(run.work.rhs[0, :n])) / method.c)
        if status != stepping.NOT_CONVERGED:
            break
    return Attempt(method.h, time, REASONS[last], tuple(corrections), tuple(residuals))


def restore(arrays: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> None:
    """Put values back into arrays."""
    for array, value in zip(arrays, values, strict=True):
        array[:] = value
