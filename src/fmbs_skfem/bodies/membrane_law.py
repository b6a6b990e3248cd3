r"""Membrane in its own plane: a plate of a planar scene, St. Venant-Kirchhoff in plane stress.

Energy per reference area of a surface r(s1, s2) whose reference tangents r0,1 r0,2 are orthonormal:

    W = A/2 (E11^2 + E22^2 + 2 nu E11 E22 + 2 (1 - nu) E12^2),   E_ab = (r,a.r,b - delta_ab)/2,   A = E t/(1 - nu^2)

Forces N_ab per length, N11 = A (E11 + nu E22), N22 = A (E22 + nu E11), N12 = A (1 - nu) E12, act on the tangents,

    dW/dr,a = N_ab r,b.

Stiffness-proportional damping is of Kelvin-Voigt type: N belongs to E + beta dE/dt, so that rigid motions are not damped.

Arrays: gradients `u` (4, p, e) hold r,1 (2 rows) and r,2 (2 rows) at point p of cell e, `S` = dW/du the same, `D` = d2W/du2
(4, 4, p, e); `section` (3, p, e) holds A [N/m], nu [-] and the weight [m2] of each point.

Source (the membrane part of): Kiendl, Bletzinger, Linhard and Wuechner, Comput. Methods Appl. Mech. Engrg. 198 (2009) 3902-3914,
doi 10.1016/j.cma.2009.08.013.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray

from ..core.entries import entry
from ..core.jit import jit

LINES = 3  #: rows of a section


@jit
def hooke(A: float, nu: float, e11: float, e22: float, e12: float) -> tuple[float, float, float]:
    """Plane stress: the forces (or moments) 11, 22, 12 of strains (or curvatures) with e12 = e21."""
    return A * (e11 + nu * e22), A * (e22 + nu * e11), A * (1.0 - nu) * e12


@jit
def quadratic(A: float, nu: float, e11: float, e22: float, e12: float) -> float:
    """A/2 (e11^2 + e22^2 + 2 nu e11 e22 + 2 (1 - nu) e12^2)."""
    return 0.5 * A * (e11 * e11 + e22 * e22 + 2.0 * nu * e11 * e22 + 2.0 * (1.0 - nu) * e12 * e12)


@jit
def energy(u: np.ndarray, section: np.ndarray) -> float:
    """Strain energy [J] summed over all points."""
    total = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            e11, e22, e12 = 0.5 * (x1 * x1 + y1 * y1 - 1.0), 0.5 * (x2 * x2 + y2 * y2 - 1.0), 0.5 * (x1 * x2 + y1 * y2)
            total += section[2, p, e] * quadratic(section[0, p, e], section[1, p, e], e11, e22, e12)
    return total


@jit
def stress(u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and gradient rates `rate`), shapes (4, p, e)."""
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            e11, e22, e12 = 0.5 * (x1 * x1 + y1 * y1 - 1.0), 0.5 * (x2 * x2 + y2 * y2 - 1.0), 0.5 * (x1 * x2 + y1 * y2)
            N11, N22, N12 = hooke(section[2, p, e] * section[0, p, e], section[1, p, e], e11, e22, e12)
            S[0, p, e] = N11 * x1 + N12 * x2
            S[1, p, e] = N11 * y1 + N12 * y2
            S[2, p, e] = N12 * x1 + N22 * x2
            S[3, p, e] = N12 * y1 + N22 * y2
    if beta > 0.0:
        add_damping(u, rate, beta, section, S)


@jit
def add_damping(u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S += weight beta C : dE/dt : dE/du; a loop of its own, which keeps that of `stress` short enough for vector instructions."""
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            v1, w1, v2, w2 = rate[0, p, e], rate[1, p, e], rate[2, p, e], rate[3, p, e]
            e11, e22, e12 = x1 * v1 + y1 * w1, x2 * v2 + y2 * w2, 0.5 * (x1 * v2 + y1 * w2 + x2 * v1 + y2 * w1)
            N11, N22, N12 = hooke(beta * section[2, p, e] * section[0, p, e], section[1, p, e], e11, e22, e12)
            S[0, p, e] += N11 * x1 + N12 * x2
            S[1, p, e] += N11 * y1 + N12 * y2
            S[2, p, e] += N12 * x1 + N22 * x2
            S[3, p, e] += N12 * y1 + N22 * y2


@jit
def modulus(u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight d2W/du2 + beta (material part), shape (4, 4, p, e), symmetric; `beta` [-]: damping time times gh.

    D11 = N11 I + A r,1 r,1 + G r,2 r,2,  D12 = N12 I + A nu r,1 r,2 + G r,2 r,1,  D22 like D11,  G = A (1 - nu)/2.
    """
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            e11, e22, e12 = 0.5 * (x1 * x1 + y1 * y1 - 1.0), 0.5 * (x2 * x2 + y2 * y2 - 1.0), 0.5 * (x1 * x2 + y1 * y2)
            A, nu = section[2, p, e] * section[0, p, e], section[1, p, e]
            N11, N22, N12 = hooke(A, nu, e11, e22, e12)
            A *= 1.0 + beta
            G, C = 0.5 * A * (1.0 - nu), A * nu
            D[0, 0, p, e] = N11 + A * x1 * x1 + G * x2 * x2
            D[1, 1, p, e] = N11 + A * y1 * y1 + G * y2 * y2
            D[2, 2, p, e] = N22 + A * x2 * x2 + G * x1 * x1
            D[3, 3, p, e] = N22 + A * y2 * y2 + G * y1 * y1
            D[0, 1, p, e] = D[1, 0, p, e] = A * x1 * y1 + G * x2 * y2
            D[2, 3, p, e] = D[3, 2, p, e] = A * x2 * y2 + G * x1 * y1
            D[0, 2, p, e] = D[2, 0, p, e] = N12 + C * x1 * x2 + G * x2 * x1
            D[1, 3, p, e] = D[3, 1, p, e] = N12 + C * y1 * y2 + G * y2 * y1
            D[0, 3, p, e] = D[3, 0, p, e] = C * x1 * y2 + G * x2 * y1
            D[1, 2, p, e] = D[2, 1, p, e] = C * y1 * x2 + G * y2 * x1


@entry
def energy_at(u: Any, _: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`energy` as an entry: W[0]."""
    carray(W, 1)[0] = energy(carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)))


@entry
def stress_at(u: Any, rate: Any, section: Any, S: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`stress` as an entry."""
    shape = (rows, points, cells)
    stress(carray(u, shape), carray(rate, shape), beta, carray(section, (LINES, points, cells)), carray(S, shape))


@entry
def modulus_at(u: Any, _: Any, section: Any, D: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`modulus` as an entry."""
    modulus(carray(u, (rows, points, cells)), beta, carray(section, (LINES, points, cells)), carray(D, (rows, rows, points, cells)))
