"""A failed time step once more, in all lengths that were tried, to see the course of Newton's
iteration.
"""

from __future__ import annotations

import numpy as np

from ...core.compiling.structs import address_of, place_of, unpacked
from ...core.errors import Reason
from ...core.storage.records import dataclass
from ...systems import evaluation
from ..compiled_step import parts, stepping
from ..compiled_step.packing import METHOD
from ..compiled_step.step import NUMBERS, Method
from ..compiled_step.touching import HALVINGS, TRIALS
from ..dividing import put
from ..integration import REASONS
from ..run import OpenRun

#: where their largest number is in a packed step
ITERATIONS = METHOD + place_of(Method, "iterations")


@dataclass(frozen=True)
class Attempt:
    """A step that was tried in one length: what every correction of Newton's iteration changed, and
    what it left.

    The k-th of `corrections` and of `residuals` are those of the k-th iteration of the step that
    failed; both are empty for one that was taken.
    """

    step: float  #: [s]
    time: float  #: at the end of the part that failed [s]
    outcome: Reason | None  #: None where it was taken
    #: root mean square of the change of positions over the size of the mechanism
    corrections: tuple[float, ...]
    residuals: tuple[float, ...]  #: norm of the force residual after the correction [N]


def replay(run: OpenRun) -> tuple[Attempt, ...]:
    """The failed step again, in all lengths that were tried; of large models in the full and the
    shortest one.

    The iteration is repeated with one correction more each time, so that its course shows without
    another copy of the step.
    """
    return tuple(attempt(run, k) for k in ((0, HALVINGS) if run.large else range(HALVINGS + 1)))


def attempt(run: OpenRun, halvings: int) -> Attempt:
    """The failed step in equal parts, up to the one that fails.

    They are not judged, as in the last tries of each length: Newton's iteration ends them, and no
    leap.
    """
    whole = run.packed
    model = run.model
    space = run.step.space
    trial = TRIALS.index((halvings, False))
    assert whole.lengths is not None  # of a step that failed in all of them
    table = whole.lengths.tables[trial].copy()
    method = unpacked(Method, address_of(table[METHOD:]))
    held = [*run.step.work, *run.step.rotations, space.W]
    before = [part.copy() for part in (*run.step.state, run.step.job.counters)]
    whole.call(parts.begin, trial)
    status = stepping.DONE
    taken = -1
    count = int(whole.lengths.found[NUMBERS])
    while status == stepping.DONE and taken + 1 < count:
        kept = [part.copy() for part in held]
        taken = taken + 1
        status = stepping.take(table, taken)
    corrections = []
    residuals = []
    last = status
    for many in range(1, method.iterations + 1 if last != stepping.DONE else 0):
        put(held, kept)
        table[ITERATIONS] = many
        status = stepping.take(table, taken)
        if status == stepping.SINGULAR or status == stepping.DONE:
            break
        corrections.append(float(np.sqrt(model.arrays.norm @ space.f**2)) / model.system.scale)
        evaluation.evaluate(run.step)
        residuals.append(float(np.linalg.norm(space.f)) / method.c)
        if status != stepping.NOT_CONVERGED:
            break
    put([*run.step.state, run.step.job.counters], before)
    whole.check()
    outcome = None if last == stepping.DONE else REASONS[last]
    return Attempt(
        method.h,
        whole.time_of((taken + 1) / 2**halvings),
        outcome,
        tuple(corrections),
        tuple(residuals),
    )
