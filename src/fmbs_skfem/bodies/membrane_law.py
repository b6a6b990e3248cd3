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

from ..core.compiling.entries import entry
from ..core.compiling.jit import carray, inlined, jit
from .vectors import AXIAL, held_product

LINES = 3  #: rows of a section
ROWS = 4  #: of gradients


@inlined
def hooke(A: float, nu: float, e11: float, e22: float, e12: float) -> tuple[float, float, float]:
    """Plane stress: the forces (or moments) 11, 22, 12 of strains (or curvatures) with e12 = e21, A C:e.

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


@jit
def strains(x1: float, y1: float, x2: float, y2: float) -> tuple[float, float, float]:
    """E11, E22, E12 of r,1 = (x1, y1) and r,2 = (x2, y2)."""
    return 0.5 * (x1 * x1 + y1 * y1 - 1.0), 0.5 * (x2 * x2 + y2 * y2 - 1.0), 0.5 * (x1 * x2 + y1 * y2)


@entry
def energy_at(u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float) -> None:
    """Strain energy [J] summed over all points: W[0]."""
    count, total = points * cells, 0.0
    u, section = carray(u, (ROWS, count)), carray(section, (LINES, count))
    for q in range(count):
        E = strains(u[0, q], u[1, q], u[2, q], u[3, q])
        total += section[2, q] * quadratic(section[0, q], section[1, q], E[0], E[1], E[2])
    carray(W, 1)[0] = total


@entry
def stress_at(u: Any, rate: Any, section: Any, S: Any, way: int, points: int, cells: int, law: int, beta: float) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and gradient rates `rate`, C : dE/dt : dE/du), shapes (4, p, e).

    Damping has a loop of its own, which keeps the first one short enough for vector instructions.
    """
    count = points * cells
    u, rate, section, S = (
        carray(u, (ROWS, count)),
        carray(rate, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(S, (ROWS, count)),
    )
    for q in range(count):
        x1, y1, x2, y2 = u[0, q], u[1, q], u[2, q], u[3, q]
        E = strains(x1, y1, x2, y2)
        N11, N22, N12 = hooke(section[2, q] * section[0, q], section[1, q], E[0], E[1], E[2])
        S[0, q] = N11 * x1 + N12 * x2
        S[1, q] = N11 * y1 + N12 * y2
        S[2, q] = N12 * x1 + N22 * x2
        S[3, q] = N12 * y1 + N22 * y2
    for q in range(count if beta > 0.0 else 0):
        x1, y1, x2, y2 = u[0, q], u[1, q], u[2, q], u[3, q]
        v1, w1, v2, w2 = rate[0, q], rate[1, q], rate[2, q], rate[3, q]
        e11, e22, e12 = x1 * v1 + y1 * w1, x2 * v2 + y2 * w2, 0.5 * (x1 * v2 + y1 * w2 + x2 * v1 + y2 * w1)
        N11, N22, N12 = hooke(beta * section[2, q] * section[0, q], section[1, q], e11, e22, e12)
        S[0, q] += N11 * x1 + N12 * x2
        S[1, q] += N11 * y1 + N12 * y2
        S[2, q] += N12 * x1 + N22 * x2
        S[3, q] += N12 * y1 + N22 * y2


@entry
def dissipation_at(u: Any, rate: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float) -> None:
    """W (p, e) = weight dE/dt : C : dE/dt of gradient rates, what a damping time of 1 s turns into heat [W]."""
    count = points * cells
    u, rate, section, W = carray(u, (ROWS, count)), carray(rate, (ROWS, count)), carray(section, (LINES, count)), carray(W, count)
    for q in range(count):
        x1, y1, x2, y2 = u[0, q], u[1, q], u[2, q], u[3, q]
        v1, w1, v2, w2 = rate[0, q], rate[1, q], rate[2, q], rate[3, q]
        e11, e22, e12 = x1 * v1 + y1 * w1, x2 * v2 + y2 * w2, 0.5 * (x1 * v2 + y1 * w2 + x2 * v1 + y2 * w1)
        W[q] = 2.0 * section[2, q] * quadratic(section[0, q], section[1, q], e11, e22, e12)


@entry
def modulus_at(u: Any, held: Any, section: Any, D: Any, way: int, points: int, cells: int, law: int, beta: float) -> None:
    """D = weight d2W/du2 + beta (material part), shape (4, 4, p, e), symmetric; `beta` [-]: damping time times gh.

    D11 = N11 I + A r,1 r,1 + G r,2 r,2,  D12 = N12 I + A nu r,1 r,2 + G r,2 r,1,  D22 like D11,  G = A (1 - nu)/2.
    """
    count = points * cells
    # steps in the plane gain nothing from stresses of the state before, and end with a larger rest
    u, w, D = carray(u, (ROWS, count)), carray(u if way == AXIAL else held, (ROWS, count)), carray(D, (ROWS, ROWS, count))
    section = carray(section, (LINES, count))
    for q in range(count):
        x1, y1, x2, y2 = u[0, q], u[1, q], u[2, q], u[3, q]
        A, nu = section[2, q] * section[0, q], section[1, q]
        a, b, c, d = (x1, y1, 0.0), (x2, y2, 0.0), (w[0, q], w[1, q], 0.0), (w[2, q], w[3, q], 0.0)
        e11, e22 = 0.5 * (held_product(way, a, a, c, c) - 1.0), 0.5 * (held_product(way, b, b, d, d) - 1.0)
        N11, N22, N12 = hooke(A, nu, e11, e22, 0.5 * held_product(way, a, b, c, d))
        A *= 1.0 + beta
        G, C = 0.5 * A * (1.0 - nu), A * nu
        D[0, 0, q] = N11 + A * x1 * x1 + G * x2 * x2
        D[1, 1, q] = N11 + A * y1 * y1 + G * y2 * y2
        D[2, 2, q] = N22 + A * x2 * x2 + G * x1 * x1
        D[3, 3, q] = N22 + A * y2 * y2 + G * y1 * y1
        D[0, 1, q] = D[1, 0, q] = A * x1 * y1 + G * x2 * y2
        D[2, 3, q] = D[3, 2, q] = A * x2 * y2 + G * x1 * y1
        D[0, 2, q] = D[2, 0, q] = N12 + C * x1 * x2 + G * x2 * x1
        D[1, 3, q] = D[3, 1, q] = N12 + C * y1 * y2 + G * y2 * y1
        D[0, 3, q] = D[3, 0, q] = C * x1 * y2 + G * x2 * y1
        D[1, 2, q] = D[2, 1, q] = C * y1 * x2 + G * y2 * x1
