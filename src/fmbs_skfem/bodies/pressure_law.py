r"""Pressure that follows a surface in space, or an edge in the plane: a force along the normal of the deformed configuration.

    surface   f = p r,1 x r,2          edge   f = p J^T r,1,   J^T (x, y) = (y, -x)          force per reference area or length

The force acts on r alone, S = -weight (f, 0, 0). Its moduli are the symmetric part of -weight df/du,

    D(r r,1) = weight p/2 [r,2 x],   D(r r,2) = -weight p/2 [r,1 x]                     edge   D(r r,1) = -weight p/2 J^T

What is left out of the tangent is an integral along the rim alone: it vanishes where the surface is closed or the rim is held, and
the matrix is exact there. So does the work that is not the change of -p V,

    V = 1/3 int r . (r,1 x r,2) dA         edge   V = 1/2 int r . J^T r,1 ds

which serves as the energy, counted from its value v0 in the reference. At a rim that is free to move the force is exact as well;
Newton's iteration converges linearly, and the energy is none.

Arrays: jets `u` (9, p, e) hold r, r,1, r,2 (3 rows each), those of an edge (4, p, e) r and r,1 (2 rows each); `S` the same, `D`
with one more axis; `section` (3, p, e) holds p [Pa] (of an edge [N/m]), v0 (integrand of 3 V, 2 V) and the weight of each point.

Source of the load stiffness: Abaqus Theory Manual 6.6, section 6.5.1, Pressure load stiffness (Dassault Systemes).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray

from ..core.entries import entry
from ..core.jit import jit
from .shell_law import cross, dot, vector

LINES = 3  #: rows of a section


@jit
def energy(u: np.ndarray, section: np.ndarray) -> float:
    """-p (V - V0) [J] summed over all points."""
    total = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            volume = dot(vector(u, 0, p, e), cross(vector(u, 1, p, e), vector(u, 2, p, e), 1.0))
            total -= section[2, p, e] * section[0, p, e] * (volume - section[1, p, e]) / 3.0
    return total


@jit
def stress(u: np.ndarray, section: np.ndarray, S: np.ndarray) -> None:
    """S = -weight (p r,1 x r,2, 0, 0), shapes (9, p, e)."""
    S[3:] = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            f = cross(vector(u, 1, p, e), vector(u, 2, p, e), -section[2, p, e] * section[0, p, e])
            S[0, p, e], S[1, p, e], S[2, p, e] = f


@jit
def modulus(u: np.ndarray, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight sym(-df/du), shape (9, 9, p, e)."""
    D[:] = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            half = 0.5 * section[2, p, e] * section[0, p, e]
            for k in range(2):
                sign = half if k == 0 else -half
                a, row = vector(u, 2 - k, p, e), 3 + 3 * k
                for i in range(3):
                    j, l = (i + 1) % 3, (i + 2) % 3
                    D[i, row + j, p, e] = D[row + j, i, p, e] = -sign * a[l]
                    D[i, row + l, p, e] = D[row + l, i, p, e] = sign * a[j]


@jit
def edge_energy(u: np.ndarray, section: np.ndarray) -> float:
    """-p (V - V0) [J] summed over all points, V the area beside the edge."""
    total = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            area = u[0, p, e] * u[3, p, e] - u[1, p, e] * u[2, p, e]
            total -= 0.5 * section[2, p, e] * section[0, p, e] * (area - section[1, p, e])
    return total


@jit
def edge_stress(u: np.ndarray, section: np.ndarray, S: np.ndarray) -> None:
    """S = -weight (p J^T r,1, 0), shapes (4, p, e)."""
    S[2:] = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            load = section[2, p, e] * section[0, p, e]
            S[0, p, e], S[1, p, e] = -load * u[3, p, e], load * u[2, p, e]


@jit
def edge_modulus(u: np.ndarray, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight sym(-df/du), shape (4, 4, p, e)."""
    D[:] = 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            half = 0.5 * section[2, p, e] * section[0, p, e]
            D[0, 3, p, e] = D[3, 0, p, e] = -half
            D[1, 2, p, e] = D[2, 1, p, e] = half


@entry
def energy_at(u: Any, _: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`energy` as an entry: W[0]."""
    carray(W, 1)[0] = energy(carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)))


@entry
def stress_at(u: Any, _: Any, section: Any, S: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`stress` as an entry."""
    shape = (rows, points, cells)
    stress(carray(u, shape), carray(section, (LINES, points, cells)), carray(S, shape))


@entry
def modulus_at(u: Any, _: Any, section: Any, D: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`modulus` as an entry."""
    modulus(carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)), carray(D, (rows, rows, points, cells)))


@entry
def edge_energy_at(u: Any, _: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`edge_energy` as an entry: W[0]."""
    carray(W, 1)[0] = edge_energy(carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)))


@entry
def edge_stress_at(u: Any, _: Any, section: Any, S: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`edge_stress` as an entry."""
    shape = (rows, points, cells)
    edge_stress(carray(u, shape), carray(section, (LINES, points, cells)), carray(S, shape))


@entry
def edge_modulus_at(u: Any, _: Any, section: Any, D: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`edge_modulus` as an entry."""
    edge_modulus(carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)), carray(D, (rows, rows, points, cells)))
