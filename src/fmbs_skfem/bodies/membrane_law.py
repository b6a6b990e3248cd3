r"""Membrane in its own plane: a plate of a planar scene, St. Venant-Kirchhoff in plane stress.

Energy per reference area of a surface r(s1, s2) whose reference tangents r0,1 r0,2 are orthonormal:

    W = A/2 (E11^2 + E22^2 + 2 nu E11 E22 + 2 (1 - nu) E12^2),   E_ab = (r,a.r,b - delta_ab)/2,   A = E t/(1 - nu^2)

Forces N_ab per length, N11 = A (E11 + nu E22), N22 = A (E22 + nu E11), N12 = A (1 - nu) E12, act on
the tangents,

    dW/dr,a = N_ab r,b.

Stiffness-proportional damping is of Kelvin-Voigt type: N belongs to E + beta dE/dt, so that rigid
motions are not damped.

Arrays: gradients `u` (4, p, e) hold r,1 (2 rows) and r,2 (2 rows) at point p of cell e, `S` = dW/du
the same, `D` = d2W/du2 (4, 4, p, e); `section` (3, p, e) holds A [N/m], nu [-] and the weight [m2]
of each point.

Source (the membrane part of): Kiendl, Bletzinger, Linhard and Wuechner, Comput. Methods Appl. Mech.
Engrg. 198 (2009) 3902-3914, doi 10.1016/j.cma.2009.08.013.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.entries import entry
from ..core.compiling.jit import carray, inlined
from .vectors import AXIAL, Vector, combine, dot, held_product

LINES = 3  #: rows of a section
ROWS = 4  #: of gradients


@inlined
def hooke(A: float, nu: float, e11: float, e22: float, e12: float) -> tuple[float, float, float]:
    """Plane stress: the forces (or moments) 11, 22, 12 of strains (or curvatures) with e12 = e21, A
    C:e.

        A (e11 + nu e22),   A (e22 + nu e11),   A (1 - nu) e12

    A is E t / (1 - nu^2) [N/m] of strains [-], E t^3 / (12 (1 - nu^2)) [N m] of curvatures [1/m].
    """
    return A * (e11 + nu * e22), A * (e22 + nu * e11), A * (1.0 - nu) * e12


@inlined
def quadratic(A: float, nu: float, e11: float, e22: float, e12: float) -> float:
    """Energy per area [J/m2] of plane stress, e:A C:e / 2 with e12 = e21.

        A/2 (e11^2 + e22^2 + 2 nu e11 e22 + 2 (1 - nu) e12^2)

    A as of `hooke`.
    """
    return 0.5 * A * (e11 * e11 + e22 * e22 + 2.0 * nu * e11 * e22 + 2.0 * (1.0 - nu) * e12 * e12)


@inlined
def stretches(way: int, a: Vector, b: Vector, c: Vector, d: Vector) -> Vector:
    """Strains of tangents c and d that are held for a and b, see `held_product`, or of a and b
    where they are the same.

        E_ab = (r,a.r,b - delta_ab) / 2
    """
    e11, e22 = (
        0.5 * (held_product(way, a, a, c, c) - 1.0),
        0.5 * (held_product(way, b, b, d, d) - 1.0),
    )
    return e11, e22, 0.5 * held_product(way, a, b, c, d)


@inlined
def strain_rates(a: Vector, b: Vector, v: Vector, w: Vector) -> Vector:
    """Rates of the strains of tangents a and b with the rates v and w.

        dE11/dt = a.v,    dE22/dt = b.w,    dE12/dt = (a.w + b.v) / 2

    in the order 11, 22, 12.
    """
    return dot(a, v), dot(b, w), 0.5 * (dot(a, w) + dot(b, v))


@inlined
def tangents(u: np.ndarray, q: int) -> tuple[Vector, Vector]:
    """r,1 and r,2 or their rates at point q, whose third component is 0."""
    return (u[0, q], u[1, q], 0.0), (u[2, q], u[3, q], 0.0)


@entry
def energy_at(
    u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Strain energy of a membrane [J].

        sum weight A/2 (E11^2 + E22^2 + 2 nu E11 E22 + 2 (1 - nu) E12^2)

    over all points: W[0].
    """
    count = points * cells
    total = 0.0
    u, section = carray(u, (ROWS, count)), carray(section, (LINES, count))
    for q in range(count):
        a, b = tangents(u, q)
        E = stretches(AXIAL, a, b, a, b)
        total += section[2, q] * quadratic(section[0, q], section[1, q], E[0], E[1], E[2])
    carray(W, 1)[0] = total


@entry
def stress_at(
    u: Any,
    rate: Any,
    section: Any,
    S: Any,
    way: int,
    points: int,
    cells: int,
    law: int,
    beta: float,
) -> None:
    """Stress of a membrane that is damped.

        S = weight (dW/du + beta C : dE/dt : dE/du)

    (4, p, e), with the damping time `beta` [s] and gradient rates `rate`.
    """
    count = points * cells
    u, section, S = (
        carray(u, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(S, (ROWS, count)),
    )
    rate = carray(rate, (ROWS, count))
    for q in range(count):
        a, b = tangents(u, q)
        E = stretches(AXIAL, a, b, a, b)
        if beta > 0.0:
            v, w = tangents(rate, q)
            E = combine(1.0, E, beta, strain_rates(a, b, v, w))
        N11, N22, N12 = hooke(section[2, q] * section[0, q], section[1, q], E[0], E[1], E[2])
        S[0, q], S[1, q] = N11 * a[0] + N12 * b[0], N11 * a[1] + N12 * b[1]
        S[2, q], S[3, q] = N12 * a[0] + N22 * b[0], N12 * a[1] + N22 * b[1]


@entry
def dissipation_at(
    u: Any,
    rate: Any,
    section: Any,
    W: Any,
    way: int,
    points: int,
    cells: int,
    law: int,
    beta: float,
) -> None:
    """What a damping time of 1 s turns into heat [W] at every point.

        W = weight dE/dt : C : dE/dt

    (p, e), of gradient rates `rate` (4, p, e).
    """
    count = points * cells
    u, rate, section, W = (
        carray(u, (ROWS, count)),
        carray(rate, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(W, count),
    )
    for q in range(count):
        (a, b), (v, w) = tangents(u, q), tangents(rate, q)
        E = strain_rates(a, b, v, w)
        W[q] = 2.0 * section[2, q] * quadratic(section[0, q], section[1, q], E[0], E[1], E[2])


@entry
def modulus_at(
    u: Any,
    held: Any,
    section: Any,
    D: Any,
    way: int,
    points: int,
    cells: int,
    law: int,
    beta: float,
) -> None:
    """Modulus of a membrane (4, 4, p, e), symmetric; `beta` [-]: damping time times gh.

        D   = weight (d2W/du2 + beta (material part))
        D11 = N11 I + A r,1 r,1 + G r,2 r,2,    D12 = N12 I + A nu r,1 r,2 + G r,2 r,1,    G = A (1 - nu)/2

    and D22 like D11.
    """
    count = points * cells
    # steps in the plane gain nothing from stresses of the state before, and end with a larger rest
    u, before, D = (
        carray(u, (ROWS, count)),
        carray(u if way == AXIAL else held, (ROWS, count)),
        carray(D, (ROWS, ROWS, count)),
    )
    section = carray(section, (LINES, count))
    for q in range(count):
        A = section[2, q] * section[0, q]
        nu = section[1, q]
        (a, b), (c, d) = tangents(u, q), tangents(before, q)
        E = stretches(way, a, b, c, d)
        N11, N22, N12 = hooke(A, nu, E[0], E[1], E[2])
        A *= 1.0 + beta
        G, C = 0.5 * A * (1.0 - nu), A * nu
        for i in range(2):
            for j in range(i + 1):
                D[i, j, q] = D[j, i, q] = (
                    (N11 if i == j else 0.0) + A * a[i] * a[j] + G * b[i] * b[j]
                )
                D[2 + i, 2 + j, q] = D[2 + j, 2 + i, q] = (
                    (N22 if i == j else 0.0) + A * b[i] * b[j] + G * a[i] * a[j]
                )
            for j in range(2):
                D[i, 2 + j, q] = D[2 + j, i, q] = (
                    (N12 if i == j else 0.0) + C * a[i] * b[j] + G * b[i] * a[j]
                )


FUNCTIONS = {
    "energy": energy_at,
    "stress": stress_at,
    "dissipation": dissipation_at,
    "modulus": modulus_at,
}
