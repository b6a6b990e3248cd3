r"""What the step of a motion makes wrong, by the same motion in half the steps.

y - y_h = 4/3 (y_{h/2} - y_h) + O(h^3)    of outputs y by a method of second order
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...dynamics import Trajectory
from ...reduction.accuracy import output_errors

RICHARDSON = 4.0 / 3.0


def compare(motion: Trajectory, half: Trajectory, step: float) -> dict[str, Any]:
    """The errors of outputs by a step [s], from the same motion in half the steps, as a part of a
    report: by column [SI], and the largest one as a part of its range.

    They are those at the stored instants, from the first step on, and at the end that an event
    makes.
    """
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
