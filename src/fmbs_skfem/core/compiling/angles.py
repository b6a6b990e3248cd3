"""Angles that are known but for whole turns, in compiled code."""

from __future__ import annotations

import numpy as np

from .jit import jit


@jit
def remainder(value: float, period: float) -> float:
    """The value nearest to zero that differs by whole periods.

        value - period rint(value / period)

    between - period/2 and period/2.
    """
    # np.rint and no loop: an angle may be many turns away
    return value - period * np.rint(value / period)


@jit
def continued(value: float, last: float) -> float:
    """An angle [rad] known but for whole turns, the one nearest to its last value [rad].

        last + remainder(value - last, 2 pi)

    see `remainder`.
    """
    return last + remainder(value - last, 2.0 * np.pi)
