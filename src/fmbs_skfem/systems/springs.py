r"""Angles of plane probe vectors in compiled code.

theta = arg(y0 + i y1),   theta,y = (-y1, y0) / r^2,   theta,yy = [[2 y0 y1, y1^2 - y0^2], [., -2 y0 y1]] / r^4
"""

from __future__ import annotations

import numpy as np

from ..core.jit import jit

ANGLE = -2  #: signal number of constraint terms that are angles


@jit
def angle(y: np.ndarray, i: int, j: int) -> float:
    """arg(y_i + i y_j) [rad]."""
    return np.arctan2(y[j], y[i])


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
