r"""Kirchhoff-Love shell or thin plate, flat or curved: St. Venant-Kirchhoff in plane stress,
bending from the exact unit normal.

Energy per reference area of a surface r(s1, s2) whose reference tangents r0,1 r0,2 are orthonormal
at the point:

    W = A/2 E:C:E + B/2 k:C:k,   e:C:e = e11^2 + e22^2 + 2 nu e11 e22 + 2 (1 - nu) e12^2
    E_ab = (r,a.r,b - delta_ab)/2,   k_ab = -(b_ab - b0_ab),   b_ab = n.r,ab,   n = r,1 x r,2 / |r,1 x r,2|
    A = E t/(1 - nu^2),   B = E t^3/(12 (1 - nu^2))

With the dual tangents r^a (r^a.r,b = delta_ab, r^a.n = 0) the normal and its dual change by

    dn = -(n.dr,a) r^a,   dr^a = -(r^a.dr,b) r^b + (n.dr,b) (r^a.r^b) n,

so that db_i = n.(dr,i - G_i^a dr,a) with i = 11, 22, 12 and G_i^a = r,i.r^a, and

    d2 b_i = G_i^a [(r^b.dr,a)(n.dr,b) + (n.dr,b)(r^b.dr,a)] - b_i (r^a.r^b)(n.dr,a)(n.dr,b) - 2 (n.dr,a)(r^a.dr,i).

Stiffness-proportional damping is of Kelvin-Voigt type: forces and moments belong to E + beta dE/dt
and k + beta dk/dt, so that rigid motions are not damped.

Arrays: gradients `u` (15, p, e) hold r,1 r,2 r,11 r,22 r,12 (3 rows each) at point p of cell e, `S`
= dW/du the same, `D` = d2W/du2 (15, 15, p, e); `section` (7, p, e) holds A [N/m], B [N m], nu [-],
b0_11, b0_22, b0_12 [1/m] and the weight [m2] of each point.

Source (the energy): Kiendl, Bletzinger, Linhard and Wuechner, Comput. Methods Appl. Mech. Engrg.
198 (2009) 3902-3914, doi 10.1016/j.cma.2009.08.013.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.compiling.entries import LANES, entry, unfold
from ..core.compiling.jit import carray, inlined
from .membrane_law import hooke, quadratic, strain_rates, stretches
from .vectors import ALL, AXIAL, Vector, combine, cross, dot

LINES = 7  #: rows of a section
ROWS = 15  #: of gradients

#: r,1 r,2, their duals r^1 r^2, and the unit normal n
Frame = tuple[Vector, Vector, Vector, Vector, Vector]


@inlined
def vector(u: np.ndarray, k: int, q: int) -> Vector:
    """Vector k of point q: the rows 3 k, 3 k + 1 and 3 k + 2 of gradients u (i, p e), in compiled
    code.
    """
    return u[3 * k, q], u[3 * k + 1, q], u[3 * k + 2, q]


@inlined
def frame_of(u: np.ndarray, q: int) -> Frame:
    a1, a2 = vector(u, 0, q), vector(u, 1, q)
    g = cross(1.0, a1, a2)
    inverse = 1.0 / math.sqrt(dot(g, g))
    n = inverse * g[0], inverse * g[1], inverse * g[2]
    return a1, a2, cross(inverse, a2, n), cross(inverse, n, a1), n


@inlined
def strains(u: np.ndarray, section: np.ndarray, q: int, frame: Frame) -> tuple[Vector, Vector]:
    """Strains of a shell [-], and minus the changes of its curvatures [1/m].

        E_ab = (r,a.r,b - delta_ab)/2,    b_i - b0_i,  b_i = n.r,i

    at point q, each as 11, 22, 12.
    """
    a1, a2, _, _, n = frame
    b1, b2, b3 = dot(n, vector(u, 2, q)), dot(n, vector(u, 3, q)), dot(n, vector(u, 4, q))
    return stretches(AXIAL, a1, a2, a1, a2), (
        b1 - section[3, q],
        b2 - section[4, q],
        b3 - section[5, q],
    )


@inlined
def projections(u: np.ndarray, q: int, dual: Vector) -> Vector:
    """Second derivatives along a dual tangent r^a.

        G_i^a = r,i.r^a,    i = 11, 22, 12

    at point q of gradients u (15, q).
    """
    return dot(dual, vector(u, 2, q)), dot(dual, vector(u, 3, q)), dot(dual, vector(u, 4, q))


@inlined
def rates(u: np.ndarray, v: np.ndarray, q: int, frame: Frame) -> tuple[Vector, Vector]:
    """Rates of the strains and of b_i by gradient rates v.

        dE_ab/dt = (v,a.r,b + r,a.v,b)/2,    db_i/dt = n.(v,i - G_i^a v,a)

    at point q of gradients u and v (15, q).
    """
    a1, a2, c1, c2, n = frame
    v1 = vector(v, 0, q)
    v2 = vector(v, 1, q)
    G1 = projections(u, q, c1)
    G2 = projections(u, q, c2)
    w1, w2 = dot(n, v1), dot(n, v2)
    k1 = dot(n, vector(v, 2, q)) - G1[0] * w1 - G2[0] * w2
    k2 = dot(n, vector(v, 3, q)) - G1[1] * w1 - G2[1] * w2
    k3 = dot(n, vector(v, 4, q)) - G1[2] * w1 - G2[2] * w2
    return strain_rates(a1, a2, v1, v2), (k1, k2, k3)


@inlined
def moments(B: float, nu: float, k: Vector) -> Vector:
    """Moments by the changes k of curvature.

        m = dW/db_i = (M11, M22, 2 M12)

    with the bending stiffness B [N m].
    """
    M = hooke(B, nu, k[0], k[1], k[2])
    return M[0], M[1], 2.0 * M[2]


@inlined
def quadratics(section: np.ndarray, q: int, E: Vector, k: Vector) -> float:
    """Energy of a point by its strains and changes of curvature [J].

        weight (A E:C:E + B k:C:k) / 2

    with the section (7, q) of point q.
    """
    stretching = quadratic(section[0, q], section[2, q], E[0], E[1], E[2])
    return section[6, q] * (stretching + quadratic(section[1, q], section[2, q], k[0], k[1], k[2]))


@entry
def energy_at(
    u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, law: int, beta: float
) -> None:
    """Strain energy of a shell [J].

        sum weight (A E:C:E + B k:C:k) / 2

    over all points: W[0].
    """
    count = points * cells
    total = 0.0
    u, section = carray(u, (ROWS, count)), carray(section, (LINES, count))
    for q in range(count):
        frame = frame_of(u, q)
        E, k = strains(u, section, q, frame)
        total += quadratics(section, q, E, k)
    carray(W, 1)[0] = total


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

        W = weight (A dE/dt : C : dE/dt + B db/dt : C : db/dt)

    (p, e), of gradient rates `rate` (15, p, e).
    """
    count = points * cells
    u, v, section, W = (
        carray(u, (ROWS, count)),
        carray(rate, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(W, count),
    )
    for q in range(count):
        frame = frame_of(u, q)
        E, k = rates(u, v, q, frame)
        W[q] = 2.0 * quadratics(section, q, E, k)


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
    """Stress of a shell (15, p, e), of E + beta dE/dt and b + beta db/dt with a damping time `beta`
    [s].

        S = weight dW/du (+ damping)
    """
    count = points * cells
    u, section, S = (
        carray(u, (ROWS, count)),
        carray(section, (LINES, count)),
        carray(S, (ROWS, count)),
    )
    v = carray(rate, (ROWS, count))
    for q in range(count):
        frame = frame_of(u, q)
        E, k = strains(u, section, q, frame)
        if beta > 0.0:
            dE, dk = rates(u, v, q, frame)
            E, k = combine(1.0, E, beta, dE), combine(1.0, k, beta, dk)
        balance(u, section, q, frame, E, k, S)


@inlined
def balance(u: Any, section: Any, q: int, frame: Frame, E: Vector, k: Vector, S: Any) -> None:
    """Stress of a point by its strains and changes of curvature.

        dW/dr,a = N_ab r,b - m_i G_i^a n,    dW/dr,i = m_i n,    m = (M11, M22, 2 M12)

    into S (15, q) at point q.
    """
    a1, a2, c1, c2, n = frame
    weight, nu = section[6, q], section[2, q]
    N = hooke(weight * section[0, q], nu, E[0], E[1], E[2])
    m = moments(weight * section[1, q], nu, k)
    g1, g2 = dot(m, projections(u, q, c1)), dot(m, projections(u, q, c2))
    first, second = combine(N[0], a1, N[2], a2), combine(N[2], a1, N[1], a2)
    # component by component: a loop over them keeps the loop over points from vector instructions
    S[0, q], S[1, q], S[2, q] = first[0] - g1 * n[0], first[1] - g1 * n[1], first[2] - g1 * n[2]
    S[3, q], S[4, q], S[5, q] = second[0] - g2 * n[0], second[1] - g2 * n[1], second[2] - g2 * n[2]
    S[6, q], S[7, q], S[8, q] = m[0] * n[0], m[0] * n[1], m[0] * n[2]
    S[9, q], S[10, q], S[11, q] = m[1] * n[0], m[1] * n[1], m[1] * n[2]
    S[12, q], S[13, q], S[14, q] = m[2] * n[0], m[2] * n[1], m[2] * n[2]


@inlined
def put(T: np.ndarray, k: int, i: int, j: int, value: float) -> None:
    """D[i, j] = value, j <= i, in `unfold`'s order."""
    T[i * (i + 1) // 2 + j, k] = value


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
    """Modulus of a shell (15, 15, p, e), symmetric; `beta` [-]: damping time times gh.

    D = weight d2W/du2 + beta (material part)
    (r,a r,b):  N_ab I + A C:r,c r,d + f n n + g^a r^b n + g^b n r^a,  g^a = m_i G_i^a,
                f = C_ij G_i^a G_j^b - m_i b_i (r^a.r^b),  C_ij the moduli of bending
    (r,i r,a):  -(C_ij G_j^a n + m_i r^a) n        (r,i r,j):  C_ij n n
    """
    count = points * cells
    T = np.zeros((ROWS * (ROWS + 1) // 2, LANES))
    u, w, D = carray(u, (ROWS, count)), carray(held, (ROWS, count)), carray(D, (ROWS, ROWS, count))
    section = carray(section, (LINES, count))
    for start in range(0, count, LANES):
        for lane in range(min(LANES, count - start)):
            q = start + lane
            frame = frame_of(u, q)
            a1, a2, c1, c2, n = frame
            _, k = strains(u, section, q, frame)
            _, bent = strains(w, section, q, frame_of(w, q)) if way == ALL else (k, k)
            E = stretches(way, a1, a2, vector(w, 0, q), vector(w, 1, q))
            A = section[6, q] * section[0, q]
            B = section[6, q] * section[1, q]
            nu = section[2, q]
            N = hooke(A, nu, E[0], E[1], E[2])
            m = moments(B, nu, bent)
            A, B = (1.0 + beta) * A, (1.0 + beta) * B
            half = 0.5 * A * (1.0 - nu)
            G1 = projections(u, q, c1)
            G2 = projections(u, q, c2)
            h1 = moments(B, nu, G1)
            h2 = moments(B, nu, G2)
            g1 = dot(m, G1)
            g2 = dot(m, G2)
            mb = dot(m, (k[0] + section[3, q], k[1] + section[4, q], k[2] + section[5, q]))
            f11, f21, f22 = (
                dot(h1, G1) - mb * dot(c1, c1),
                dot(h2, G1) - mb * dot(c2, c1),
                dot(h2, G2) - mb * dot(c2, c2),
            )
            for i in range(3):
                for j in range(i + 1):
                    own = (
                        g1 * (c1[i] * n[j] + n[i] * c1[j])
                        + f11 * n[i] * n[j]
                        + A * a1[i] * a1[j]
                        + half * a2[i] * a2[j]
                    )
                    put(T, lane, i, j, own + N[0] if i == j else own)
                    own = (
                        g2 * (c2[i] * n[j] + n[i] * c2[j])
                        + f22 * n[i] * n[j]
                        + A * a2[i] * a2[j]
                        + half * a1[i] * a1[j]
                    )
                    put(T, lane, 3 + i, 3 + j, own + N[1] if i == j else own)
                for j in range(3):
                    own = (
                        g2 * c1[i] * n[j]
                        + g1 * n[i] * c2[j]
                        + f21 * n[i] * n[j]
                        + A * nu * a2[i] * a1[j]
                        + half * a1[i] * a2[j]
                    )
                    put(T, lane, 3 + i, j, own + N[2] if i == j else own)
                    for of in range(3):
                        put(T, lane, 6 + 3 * of + i, j, -(h1[of] * n[i] + m[of] * c1[i]) * n[j])
                        put(T, lane, 6 + 3 * of + i, 3 + j, -(h2[of] * n[i] + m[of] * c2[i]) * n[j])
                    put(T, lane, 9 + i, 6 + j, B * nu * n[i] * n[j])
                for j in range(i + 1):
                    put(T, lane, 6 + i, 6 + j, B * n[i] * n[j])
                    put(T, lane, 9 + i, 9 + j, B * n[i] * n[j])
                    put(T, lane, 12 + i, 12 + j, 2.0 * B * (1.0 - nu) * n[i] * n[j])
        unfold(T, start, D, False)


FUNCTIONS = {
    "energy": energy_at,
    "stress": stress_at,
    "dissipation": dissipation_at,
    "modulus": modulus_at,
}
