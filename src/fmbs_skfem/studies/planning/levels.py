r"""Steps of several lengths in place of equal ones, where forces jump and the same error is then
cheaper.

The error of a motion is about in proportion to that of each step, theta. A run with some theta,
held against equal steps that meet the accuracy, foretells the theta that does so as well,

    theta* = AIM g theta / |y(theta) - y(N)|,      g what the step may use of the accuracy,

and the larger one of two differences proves it, as it does where forces jump: from a run with four
times of it, and from that with equal steps. Smooth motions gain nothing by that, and are not tried.
What counts is work: corrections, and factorisations as FACTOR of these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .pilots import PilotOutputs, ScenePilots
from .planner import SAFETY, SHARE, AccuracyPlan, Limits, Pilot, size

# 10 to 200 in twelve runs of a rolling hoop, a gripper, a stop and a four-bar
AMPLIFIED = 50.0  #: error of a motion over that of a step: what the first run counts with
AIM = 0.25  #: of the error that the step may have: the difference from a run with four times of it is three times as large
#: ratios of a better error of steps to one that was tried, within which that one is taken
NEAR = (
    0.5,
    3.0,
)
FALL = 4.0  #: ratio of the errors of steps whose runs prove each other
LONGER = 8  #: times as long as equal steps are undivided ones; parts are up to 32 times as short
PROOFS = 2  #: that are tried, each with a quarter of the error of steps
PAYS = 0.8  #: work over that of equal steps, from which these are kept
LEAST, MOST = 1e-9, 1e-2  #: errors of steps that are tried


def with_levels(
    pilots: ScenePilots,
    found: AccuracyPlan,
    limits: Limits,
    fewest: int,
    see: Callable[[Pilot], None],
) -> AccuracyPlan:
    """A plan of a motion in which forces jump, with steps of several lengths where that takes less
    than PAYS of its work.

    `fewest` are the fewest steps of a run. The plan stays as it is where that is not cheaper, or
    cannot be proved.
    """
    equal = found.run
    resolved = min(one.steps for one in found.pilots if one.resolved)
    steps = limits.rounded(max(found.steps / LONGER, resolved, fewest))
    goal = SAFETY * (SHARE if size(found.mesh) > 0.0 else 1.0)
    if equal is None or 2 * steps > found.steps:
        return found
    log = list(found.pilots)

    def run(local: float) -> PilotOutputs | None:
        other = pilots.run(found.cells, steps, local)
        apart = None if other is None else size(pilots.differ(other, equal))
        log.append(Pilot(found.cells, steps, other is not None, apart, local))
        see(log[-1])
        return other

    local = float(np.clip(goal * pilots.finest / AMPLIFIED, LEAST, MOST))
    if (chosen := run(local)) is not None:
        apart = size(pilots.differ(chosen, equal))
        better = float(np.clip(AIM * goal * local / max(apart, 1e-3 * goal), LEAST, MOST))
        # one that is nearly as good needs no other run; errors fall as work grows with its square
        # root
        if not NEAR[0] < better / local < NEAR[1]:
            cheap = chosen.work * np.sqrt(local / better) < equal.work
            local = better
            chosen = run(better) if cheap else None
    other = run(FALL * local) if chosen is not None and chosen.work <= PAYS * equal.work else None
    for _ in range(PROOFS):
        if chosen is None or other is None or chosen.work > PAYS * equal.work:
            break
        time = np.maximum(pilots.differ(other, chosen), pilots.differ(chosen, equal))
        if size(time) <= max(goal, size(found.time)) and size(time + found.mesh) <= 1.0:
            return replace(found, steps=steps, time=time, local_error=local, pilots=tuple(log))
        local, other, chosen = local / FALL, chosen, run(local / FALL)
    return replace(found, pilots=tuple(log))
