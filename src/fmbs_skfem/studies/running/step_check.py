r"""What the step of a motion makes wrong, by the same motion in half the steps.

y - y_h = 4/3 (y_{h/2} - y_h) + O(h^3)    of outputs y by a method of second order
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.errors import InputError, say
from ...core.notices import Progress
from ...dynamics import Trajectory
from ...reduction.accuracy import output_errors
from ..job import Job

RICHARDSON = 4.0 / 3.0


def compare(
    job: Job, halved: Callable[[Progress], Trajectory] | None, step: float, motion: Trajectory
) -> dict[str, Any]:
    """The errors of outputs by the step [s], as a part of a report: by column [SI], and the largest
    one as a part of its range; `halved` runs the motion in half the steps.

    They are those at the stored instants, from the first step on. SolverError where the motion
    fails in half the steps, InputError for equilibria.
    """
    if halved is None:
        raise InputError(say("--check", "a motion", "an equilibrium", "leave the option out"))
    half = halved(job.progress("half the step"))
    found = output_errors.compare(half, motion)
    parts = output_errors.parts(found)
    worst = max(parts, key=parts.__getitem__, default=None)
    return {
        "step_check": {
            "step": 0.5 * step,
            "errors": {name: RICHARDSON * one.error for name, one in found.items()},
            "largest": worst,
            "part": np.nan if worst is None else RICHARDSON * parts[worst],
        }
    }
