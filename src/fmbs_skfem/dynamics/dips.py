r"""Values that cross zero twice within a step: their sign is that of before at its end, and their rates show it.

    s g > 0,  s g' < 0 at the begin,  s g > 0,  s g' > 0 at the end:    g dips, the cubic through the four says where

Rates are differences along q' and q''. Of what is read of reactions and energies there are none: it is looked at at the ends alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..systems import compiled as compilation

if TYPE_CHECKING:
    from .run import OpenRun

NEAR = 1e-3  #: of a step, over which rates are differences
AGAIN = 1e-6  #: of a step, next to whose ends nothing is looked for


def near(before: np.ndarray, last: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Which values (t,) may have dipped to zero in the step from `last` to `now`, as they changed in that and the one before it."""
    return np.asarray(np.minimum(np.abs(last), np.abs(now)) <= np.abs(now - last) + np.abs(last - before))


def rates(run: OpenRun, numbers: Sequence[int], time: float) -> np.ndarray:
    """Changes (t,) of values in a step as they are in the present state, at this time [s]; nan of those that forces do not keep."""
    model, state, h = run.model, run.step.state, run.scheme.step
    back, found = np.argsort(model.order), []
    x, v, a = (part[back] for part in (state.x, state.v, state.acceleration))
    for d in (-NEAR * h, NEAR * h):
        found.append(compilation.accepted(model, x + d * v, v + d * a, state.memory, time + d))
    change = (found[1] - found[0]) / (2 * NEAR)
    return np.array([np.nan if k < 0 else change[run.kept_values[k]] for k in numbers])


def deepest(values: tuple[float, float], slopes: tuple[float, float]) -> tuple[float, float]:
    """Place in (0, 1) and value of the smallest value of a cubic with these values and slopes at 0 and 1, which first falls."""
    (a, b), (da, db) = values, slopes
    c, d = 3 * (b - a) - 2 * da - db, da + db - 2 * (b - a)
    places = [r.real for r in np.roots([3 * d, 2 * c, da]) if abs(r.imag) < AGAIN and AGAIN < r.real < 1 - AGAIN]
    return min(((s, a + s * (da + s * (c + s * d))) for s in places), key=lambda one: one[1], default=(0.5, np.inf))
