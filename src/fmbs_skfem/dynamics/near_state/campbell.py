r"""Frequencies over a parameter, each along one motion: a Campbell diagram where that is a speed.

    motions a and b of neighbouring values belong together where  1 - |a^H M b| / (|a| |b|) + |s_a' - s_b| / gap  is least,

with s_a', s = growth + i omega, extrapolated from the values before, in the mass norm, M being that
of b, and gap the usual distance of frequencies. A motion of which the conjugate complex fits better
has passed the frequency zero, as backward whirl does in a rotating frame; one that parts there into
two that do not vibrate, as in buckling, goes on as the one that grows.

Source of the correlation: R. J. Allemang, The modal assurance criterion: twenty years of use and
abuse, Sound and Vibration 37 (2003) 14-23.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.algebra.linalg import Array, squares
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values import arrays
from ...core.values.arguments import checked, require
from .modes import grows

MORE = 4  #: motions beyond those asked for, among which each goes on
# of a pair with one frequency one grows and one decays: without it lines take either, and a buckled
# column is stable at every other load
UPWARD = 1e-3  #: by which one that grows is nearer than one that decays as much, relative to both


@dataclass(frozen=True)
class MotionsAt:
    """Motions at one value of the parameter.

        s = growth + i omega

    Eigenvalues s with their shapes, complex where bodies do not move in phase, and the mass M that
    measures these.
    """

    omega: np.ndarray  #: (i,) [rad/s]
    growth: np.ndarray  #: (i,) [1/s]
    vectors: np.ndarray  #: (n, i)
    mass: Array  #: (n, n)


@dataclass(frozen=True)
class CampbellDiagram:
    """Frequencies and growth over a parameter, a column for each motion, in their order at the
    first value.

    Column i of all arrays is the same motion at every value. `omega` is |Im s|, whichever way a
    shaft whirls.
    """

    values: np.ndarray  #: (s,) of the parameter, SI
    omega: np.ndarray  #: (s, i) [rad/s]
    growth: np.ndarray  #: (s, i) [1/s], positive where a motion is unstable
    others: np.ndarray  #: (s,) largest growth of motions that are found beside these [1/s], 0 where none of them is unstable

    @property
    def unstable(self) -> np.ndarray:
        """Where motions grow, (s, i) bool."""
        return grows(self.omega, self.growth)

    def crossings(self, order: float) -> list[tuple[int, float]]:
        """Motions and values at which a frequency [rad/s] is `order` times the parameter, by
        interpolation between two values.
        """
        apart = self.omega - order * self.values[:, None]
        found = []
        for s, k in zip(*np.nonzero(apart[:-1] * apart[1:] < 0.0), strict=True):
            part = apart[s, k] / (apart[s, k] - apart[s + 1, k])
            found.append(
                (int(k), float(self.values[s] + part * (self.values[s + 1] - self.values[s])))
            )
        return sorted(found, key=lambda pair: pair[1])


@checked
def campbell(
    values: np.ndarray, find: Callable[[float, int], MotionsAt], count: int = 6
) -> CampbellDiagram:
    """The `count` slowest motions at the first of the values (s,), followed over all; `find` gives
    so many at a value.

    `find(value, number)` gives the `number` slowest motions at a value; it is called with four more
    than are followed, so that a motion is found again that has become faster than others. Motions
    of neighbouring values belong together as the module says.
    """
    values = arrays.finite(values, "campbell: values", "numbers (s,)", None, empty=True)
    if count < 1:
        raise InputError(say("campbell: count", "at least 1", count))
    before = None
    omega = []
    growth = []
    others = []
    for number, value in enumerate(values):
        found = find(float(value), count + MORE)
        require("campbell: find, what it gives", found, MotionsAt)
        if before is None:
            chosen = np.arange(min(count, len(found.omega)))
        else:
            here, past = (growth[-k] + 1j * omega[-k] for k in (1, min(number, 2)))
            ahead = 2.0 * here - past
            chosen = followers(before, found, ahead.real + 1j * np.abs(ahead.imag))
        rest = np.setdiff1d(np.flatnonzero(grows(found.omega, found.growth)), chosen)
        others.append(found.growth[rest].max(initial=0.0))
        before = MotionsAt(
            found.omega[chosen], found.growth[chosen], found.vectors[:, chosen], found.mass
        )
        omega.append(before.omega)
        growth.append(before.growth)
    return CampbellDiagram(
        np.asarray(values, dtype=float), np.array(omega), np.array(growth), np.array(others)
    )


def followers(before: MotionsAt, after: MotionsAt, ahead: np.ndarray) -> np.ndarray:
    """Which motion (i,) of `after` continues each of `before`, whose eigenvalues growth + i omega
    are expected `ahead` (i,).
    """
    gap = max(float(np.ptp(after.omega)) / max(len(after.omega) - 1, 1), 1e-300)
    distance = (
        np.abs(ahead[:, None] - (after.growth + 1j * after.omega)[None, :]) / gap
        - UPWARD * after.growth / gap
    )
    if len(before.vectors) == len(after.vectors):
        a, b = (
            part / np.sqrt(np.maximum(squares(part, after.mass), 1e-300))
            for part in (before.vectors, after.vectors)
        )
        distance = (
            distance
            + 1.0
            - np.maximum(np.abs(np.conj(a).T @ (after.mass @ b)), np.abs(a.T @ (after.mass @ b)))
        )
    # which imports all of scipy.optimize: here alone
    from scipy.optimize import linear_sum_assignment

    return np.asarray(linear_sum_assignment(distance)[1])
