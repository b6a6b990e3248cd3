r"""Whether a training may promise its predicted error: what speaks against it, in words.

    one full run                   nothing shows how the error depends on the parameters
    high > WIDE low                indicator and error do not go together, or nothing tells how they do
    hold-out e(mu) > high(mu)      the band has been seen to fail
    high > tolerance, e > tolerance, e >= 1,  no full motion

A band of 95 % is left by one hold-out point in twenty: it is held to have failed where more than LEFT of them lie above it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

WIDE = 2.5  #: widest band that tells anything [decades]
LEFT = 0.1  #: part of the hold-out points that may lie above their bands
WHOLE = 1.0  #: error of the size of what is predicted


def doubts(
    full_runs: int,
    predicted: tuple[float, float, float],
    true: Sequence[float] | np.ndarray,
    high: Sequence[float] | np.ndarray,
    tolerance: float | None = None,
) -> list[str]:
    """Why the predicted error of a training cannot be promised; empty where it can.

    `full_runs` counts checks, too. `predicted` is the largest error over the candidates with its band, `true` (k,) are errors at
    hold-out points, NaN where the full model has no motion, `high` (k,) the upper ends of their bands.
    """
    e, top = np.asarray(true, dtype=float), np.asarray(high, dtype=float)
    known, found = ~np.isnan(e), list[str]()
    if full_runs == 1:
        found.append("there is one full run only, which does not show how the error depends on the parameters")
    if math.isfinite(predicted[2]) and predicted[2] > 10.0**WIDE * predicted[1] > 0.0:
        found.append(f"the predicted band spans a factor of {predicted[2] / predicted[1]:.2g}, too wide to tell anything")
    above = int(np.sum(e[known] > top[known])) if len(top) else 0
    if above > LEFT * known.sum():
        found.append(f"{above} of {int(known.sum())} hold-out points lie above the predicted band")
    if len(e) > known.sum():
        found.append(f"the full model has no motion at {int(len(e) - known.sum())} of {len(e)} hold-out points")
    worst = max([value for value in (predicted[0], *e[known]) if not math.isnan(value)], default=math.nan)
    if tolerance is not None:
        if not predicted[2] <= tolerance:
            found.append(f"the predicted error, with its spread, reaches {predicted[2]:.2g}, the wanted one is {tolerance:.2g}")
        missed = int(np.sum(e[known] > tolerance))
        if missed:
            found.append(f"{missed} of {int(known.sum())} hold-out points are above the wanted error {tolerance:.2g}")
    elif worst >= WHOLE:
        found.append(f"errors reach {worst:.2g} of what is predicted")
    return found
