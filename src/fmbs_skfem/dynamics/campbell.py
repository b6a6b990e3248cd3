r"""Frequencies over a parameter, each along one motion: a Campbell diagram where that is a speed.

    motions a and b of neighbouring values belong together where  1 - |a^H M b| / (|a| |b|) + |omega_a' - omega_b| / gap  is least,

with omega_a' extrapolated from the values before, in the mass norm, M being that of b, and gap the usual distance of frequencies.
A motion of which the conjugate complex fits better has passed the frequency zero, as backward whirl does in a turning frame.

Source of the correlation: R. J. Allemang, The modal assurance criterion: twenty years of use and abuse, Sound and Vibration 37
(2003) 14-23.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.linalg import Array, squares
from ..core.records import dataclass
from .modes import grows

MORE = 4  #: motions beyond those asked for, among which each goes on


@dataclass(frozen=True)
class Found:
    """Motions at one value of the parameter."""

    omega: np.ndarray  #: (i,) [rad/s]
    growth: np.ndarray  #: (i,) [1/s]
    vectors: np.ndarray  #: (n, i)
    mass: Array  #: (n, n)


@dataclass(frozen=True)
class Campbell:
    """Frequencies and growth over a parameter, a column for each motion, in their order at the first value."""

    values: np.ndarray  #: (s,) of the parameter, SI
    omega: np.ndarray  #: (s, i) [rad/s]
    growth: np.ndarray  #: (s, i) [1/s], positive where a motion is unstable

    @property
    def unstable(self) -> np.ndarray:
        """Where motions grow, (s, i) bool."""
        return grows(self.omega, self.growth)

    def crossings(self, order: float) -> list[tuple[int, float]]:
        """Motions and values at which a frequency [rad/s] is `order` times the parameter, by interpolation between two values."""
        apart, found = self.omega - order * self.values[:, None], []
        for s, k in zip(*np.nonzero(apart[:-1] * apart[1:] < 0.0), strict=True):
            part = apart[s, k] / (apart[s, k] - apart[s + 1, k])
            found.append((int(k), float(self.values[s] + part * (self.values[s + 1] - self.values[s]))))
        return sorted(found, key=lambda pair: pair[1])


def campbell(values: np.ndarray, find: Callable[[float, int], Found], count: int = 6) -> Campbell:
    """The `count` slowest motions at the first of the values (s,), followed over all; `find` gives so many at a value."""
    before, omega, growth = None, [], []
    for number, value in enumerate(values):
        found = find(float(value), count + MORE)
        if before is None:
            chosen = np.arange(min(count, len(found.omega)))
        else:
            ahead = omega[-1] if number < 2 else 2.0 * omega[-1] - omega[-2]
            chosen = followers(before, found, np.abs(ahead))
        before = Found(found.omega[chosen], found.growth[chosen], found.vectors[:, chosen], found.mass)
        omega.append(before.omega)
        growth.append(before.growth)
    return Campbell(np.asarray(values, dtype=float), np.array(omega), np.array(growth))


def followers(before: Found, after: Found, ahead: np.ndarray) -> np.ndarray:
    """Which motion (i,) of `after` continues each of `before`, whose frequencies are expected `ahead` (i,)."""
    gap = max(float(np.ptp(after.omega)) / max(len(after.omega) - 1, 1), 1e-300)
    distance = np.abs(ahead[:, None] - after.omega[None, :]) / gap
    if len(before.vectors) == len(after.vectors):
        a, b = (part / np.sqrt(np.maximum(squares(part, after.mass), 1e-300)) for part in (before.vectors, after.vectors))
        distance = distance + 1.0 - np.maximum(np.abs(np.conj(a).T @ (after.mass @ b)), np.abs(a.T @ (after.mass @ b)))
    from scipy.optimize import linear_sum_assignment  # which imports all of scipy.optimize: here alone

    return np.asarray(linear_sum_assignment(distance)[1])
