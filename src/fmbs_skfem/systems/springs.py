r"""Angles of plane probe vectors in compiled code, and the law of torsional springs and dampers.

theta = arg(y0 + i y1),   theta,y = (-y1, y0) / r^2,   theta,yy = [[2 y0 y1, y1^2 - y0^2], [., -2 y0 y1]] / r^4
f = tau theta,y,          tau = - k (theta - theta_0) - d theta',    theta = theta_a - theta_b

The angle counts its turns: arg gives it but for whole ones, and theta is the value nearest to that of the last accepted step, so
that a spring may turn by up to half a turn in a step. `angles` (l,) holds these values of all laws of a system, 0 for other loads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..core.jit import jit

if TYPE_CHECKING:
    from .kernels import Csr

ANGLE = -2  #: signal number of constraint terms that are angles
SPRING = 2  #: kind of the law, see system.LoadKind


@jit
def angle(y: np.ndarray, i: int, j: int) -> float:
    """arg(y_i + i y_j) [rad]."""
    return np.arctan2(y[j], y[i])


@jit
def remainder(value: float, period: float) -> float:
    """The value nearest to zero that differs by whole periods."""
    return value - period * np.rint(value / period)


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
def angle_drift(paths: np.ndarray, i: int, j: int, second: float, third: float) -> float:
    """theta,y z + second D2 + third D3 of an angle, as in `kernels.drift`.

    With Y = y_i + i y_j, u = Y1/Y and w = Y2/Y of its derivatives by time: D2 = - Im u^2, D3 = Im(2 u^3 - 3 u w).
    """
    y, z = complex(paths[0, i], paths[0, j]), complex(paths[1, i], paths[1, j])
    u, w = complex(paths[2, i], paths[2, j]) / y, complex(paths[3, i], paths[3, j]) / y
    return (z / y - second * u * u + third * (2.0 * u * u * u - 3.0 * u * w)).imag


@jit
def rate(probes: Csr, row: int, v: np.ndarray) -> float:
    """One row of probes @ v."""
    total = 0.0
    for k in range(probes.indptr[row], probes.indptr[row + 1]):
        total += probes.data[k] * v[probes.indices[k]]
    return total


@jit
def continued(value: float, last: float) -> float:
    """An angle known but for whole turns, nearest to its last value."""
    return last + remainder(value - last, 2.0 * np.pi)


@jit
def torque(
    probes: Csr,
    law: np.ndarray,
    vector: np.ndarray,
    y: np.ndarray,
    v: np.ndarray,
    last: float,
    rows: np.ndarray,
    slopes: np.ndarray,
) -> float:
    """tau [N m] of a spring law whose angle was `last`; `rows` (4,) and `slopes` (4,) = d theta/dy, rows of -1 for the ground."""
    turned, speed = 0.0, 0.0
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
    return -vector[0] * (continued(turned, last) - vector[2]) - vector[1] * speed


@jit
def follow(laws: np.ndarray, probes: Csr, offset: np.ndarray, x: np.ndarray, angles: np.ndarray) -> None:
    """Angles of all springs at an accepted x (n,), from those before."""
    for k in range(len(laws)):
        if laws[k, 0] != SPRING:
            continue
        turned = 0.0
        for arm in range(2):
            first = laws[k, 1 + arm]
            if first >= 0:
                along = rate(probes, first, x) + offset[first]
                across = rate(probes, first + 1, x) + offset[first + 1]
                turned += (1.0 - 2.0 * arm) * np.arctan2(across, along)
        angles[k] = continued(turned, angles[k])


@jit
def add_spring(
    probes: Csr, law: np.ndarray, vector: np.ndarray, y: np.ndarray, v: np.ndarray, last: float, s: float, g: np.ndarray
) -> None:
    """g += s tau d theta/dy."""
    rows, slopes = np.zeros(4, np.int64), np.zeros(4)
    tau = s * torque(probes, law, vector, y, v, last, rows, slopes)
    for a in range(4):
        if rows[a] >= 0:
            g[rows[a]] += tau * slopes[a]


@jit
def spring_slopes(
    probes: Csr,
    law: np.ndarray,
    vector: np.ndarray,
    y: np.ndarray,
    v: np.ndarray,
    last: float,
    s: float,
    gh: float,
    H: np.ndarray,
) -> None:
    """H[pair] += s (d force/dy + gh d force/dy'), pairs (a, b) of the rows of both arms in row order."""
    rows, slopes, bends = np.zeros(4, np.int64), np.zeros(4), np.zeros(4)
    tau = torque(probes, law, vector, y, v, last, rows, slopes)
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
