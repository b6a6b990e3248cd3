"""A failed time step once more, in all lengths that were tried, to see the course of Newton's iteration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import Reason
from ...core.storage.records import dataclass
from ...systems import evaluation
from ..compiled_step import stepping
from ..compiled_step.step import State
from ..dividing import HALVINGS, put, restart
from ..histories import leading_signals
from ..integration import REASONS
from ..run import OpenRun
from ..scheme import method_of


@dataclass(frozen=True)
class Attempt:
    """A step that was tried in one length: what every correction of Newton's iteration changed, and what it left.

    The k-th of `corrections` and of `residuals` are those of the k-th iteration of the step that failed; both are empty for one
    that was taken.
    """

    step: float  #: [s]
    time: float  #: at the end of the part that failed [s]
    outcome: Reason | None  #: None where it was taken
    corrections: tuple[float, ...]  #: root mean square of the change of positions over the size of the mechanism
    residuals: tuple[float, ...]  #: norm of the force residual after the correction [N]


def replay(run: OpenRun) -> tuple[Attempt, ...]:
    """The failed step again, in all lengths that were tried; of large models in the full and the shortest one.

    The iteration is repeated with one correction more each time, so that its course shows without another copy of the step.
    """
    halvings = (0, HALVINGS) if run.large else range(HALVINGS + 1)
    return tuple(attempt(run, 2**k) for k in halvings)


def attempt(run: OpenRun, parts: int) -> Attempt:
    """The failed step in equal parts, up to the one that fails.

    They are not judged, as in the last tries of each length: Newton's iteration ends them, and no leap.
    """
    model, system, work, space = run.model, run.model.system, run.step.work, run.step.space
    method = method_of(run.scheme, run.newton, run.scheme.step / parts, model)._replace(judging=False)
    state = State(*(part.copy() for part in run.step.state))
    n = system.size
    job = run.step.job._replace(
        out=np.zeros((3, 1, n)), multipliers=np.zeros((1, model.constraints)), counters=np.zeros_like(run.step.job.counters)
    )
    apart = replace(run, step=run.step._replace(state=state, job=job))
    for part in (state.multipliers, state.past):
        part *= method.c / run.step.method.c
    work.kind[0] = 0
    if parts > 1:
        restart(state, work)
    start = [part.copy() for part in state]
    signals, _ = leading_signals(system, run.scheme.step * (run.done + (np.arange(parts) + 1) / parts), method.h)
    rows = np.full(parts, -1)
    status, taken = apart.take(method, signals, rows)
    time = run.scheme.step * (run.done + min(taken + 1, parts) / parts)
    if status == stepping.DONE:
        return Attempt(method.h, time, None, (), ())
    put(state, start)
    apart.take(method, signals[:taken], rows)
    held = [*work, space.W]
    last, kept, corrections, residuals = status, [part.copy() for part in held], [], []
    for many in range(1, method.iterations + 1):
        put(held, kept)
        status, _ = apart.take(method._replace(iterations=many), signals[taken : taken + 1], rows)
        if status == stepping.SINGULAR or status == stepping.DONE:
            break
        corrections.append(float(np.sqrt(model.arrays.norm @ space.f**2)) / system.scale)
        evaluation.evaluate(run.step)
        residuals.append(float(np.linalg.norm(space.f)) / method.c)
        if status != stepping.NOT_CONVERGED:
            break
    return Attempt(method.h, time, REASONS[last], tuple(corrections), tuple(residuals))
