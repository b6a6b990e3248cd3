r"""Angles of plane probe vectors in compiled code, and the law of torsional springs and dampers.

theta = arg(y0 + i y1),   theta,y = (-y1, y0) / r^2,   theta,yy = [[2 y0 y1, y1^2 - y0^2], [., -2 y0 y1]] / r^4
f = tau theta,y,          tau = - k wrap(theta_a - theta_b - theta_0) - d (theta_a - theta_b)',    wrap to [-pi, pi]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.jit import jit

if TYPE_CHECKING:
    from .kernels import Csr

ANGLE = -2  #: signal number of constraint terms that are angles


@jit
def angle(y: np.ndarray, i: int, j: int) -> float:
    """arg(y_i + i y_j) [rad]."""
    return np.arctan2(y[j], y[i])


@jit
def remainder(value: float, period: float) -> float:
    """The value nearest to zero that differs by whole periods."""
    return value - period * np.round(value / period)


@jit
def add_angle_slopes(y: np.ndarray, i: int, j: int, factor: float, H: np.ndarray, first: int) -> None:
    """H[first : first + 4] += factor d2 arg / dy2 for the pairs (i, i), (i, j), (j, i), (j, j)."""
    square = y[i] ** 2 + y[j] ** 2
    twist, rest = 2.0 * y[i] * y[j] / square**2, (y[j] ** 2 - y[i] ** 2) / square**2
    H[first] += factor * twist
    H[first + 1] += factor * rest
    H[first + 2] += factor * rest
    H[first + 3] -= factor * twist


@jit
def rate(probes: Csr, row: int, v: np.ndarray) -> float:
    """One row of probes @ v."""
    total = 0.0
    for k in range(probes.indptr[row], probes.indptr[row + 1]):
        total += probes.data[k] * v[probes.indices[k]]
    return total


@jit
def torque(
    probes: Csr, law: np.ndarray, vector: np.ndarray, y: np.ndarray, v: np.ndarray, rows: np.ndarray, slopes: np.ndarray
) -> float:
    """tau [N m] of a spring law; `rows` (4,) and `slopes` (4,) = d(theta_a - theta_b)/dy, rows of -1 for an arm on the ground."""
    turned, speed = -vector[2], 0.0
    for arm in range(2):
        first = law[1 + arm]
        rows[2 * arm] = rows[2 * arm + 1] = -1
        if first < 0:
            continue
        sign = 1.0 - 2.0 * arm
        square = y[first] ** 2 + y[first + 1] ** 2
        rows[2 * arm], rows[2 * arm + 1] = first, first + 1
        slopes[2 * arm], slopes[2 * arm + 1] = -sign * y[first + 1] / square, sign * y[first] / square
        turned += sign * angle(y, first, first + 1)
        if vector[1] != 0.0:
            speed += slopes[2 * arm] * rate(probes, first, v) + slopes[2 * arm + 1] * rate(probes, first + 1, v)
    return -vector[0] * remainder(turned, 2.0 * np.pi) - vector[1] * speed


@jit
def add_spring(probes: Csr, law: np.ndarray, vector: np.ndarray, y: np.ndarray, v: np.ndarray, s: float, g: np.ndarray) -> None:
    """g += s tau d theta/dy."""
    rows, slopes = np.zeros(4, np.int64), np.zeros(4)
    tau = s * torque(probes, law, vector, y, v, rows, slopes)
    for a in range(4):
        if rows[a] >= 0:
            g[rows[a]] += tau * slopes[a]


@jit
def spring_slopes(
    probes: Csr, law: np.ndarray, vector: np.ndarray, y: np.ndarray, v: np.ndarray, s: float, gh: float, H: np.ndarray
) -> None:
    """H[pair] += s (d force/dy + gh d force/dy'), pairs (a, b) of the rows of both arms in row order."""
    rows, slopes, bends = np.zeros(4, np.int64), np.zeros(4), np.zeros(4)
    tau = torque(probes, law, vector, y, v, rows, slopes)
    count = 2 if rows[2] < 0 else 4
    moved = np.zeros(4)
    for arm in range(count // 2):
        i = rows[2 * arm]
        bends[:] = 0.0
        add_angle_slopes(y, i, i + 1, 1.0 - 2.0 * arm, bends, 0)
        for a in range(2):
            for b in range(2):
                H[law[4] + (2 * arm + a) * count + 2 * arm + b] += s * tau * bends[2 * a + b]
                if vector[1] != 0.0:
                    moved[2 * arm + a] += bends[2 * a + b] * rate(probes, rows[2 * arm + b], v)
    for a in range(count):
        for b in range(count):
            change = (vector[0] + gh * vector[1]) * slopes[b] + vector[1] * moved[b]
            H[law[4] + a * count + b] -= s * slopes[a] * change
