r"""Kirchhoff-Love shell or thin plate, flat or curved: St. Venant-Kirchhoff in plane stress, bending from the exact unit normal.

Energy per reference area of a surface r(s1, s2) whose reference tangents r0,1 r0,2 are orthonormal at the point:

    W = A/2 E:C:E + B/2 k:C:k,   e:C:e = e11^2 + e22^2 + 2 nu e11 e22 + 2 (1 - nu) e12^2
    E_ab = (r,a.r,b - delta_ab)/2,   k_ab = -(b_ab - b0_ab),   b_ab = n.r,ab,   n = r,1 x r,2 / |r,1 x r,2|
    A = E t/(1 - nu^2),   B = E t^3/(12 (1 - nu^2))

With the dual tangents r^a (r^a.r,b = delta_ab, r^a.n = 0) the normal and its dual change by

    dn = -(n.dr,a) r^a,   dr^a = -(r^a.dr,b) r^b + (n.dr,b) (r^a.r^b) n,

so that db_i = n.(dr,i - G_i^a dr,a) with i = 11, 22, 12 and G_i^a = r,i.r^a, and

    d2 b_i = G_i^a [(r^b.dr,a)(n.dr,b) + (n.dr,b)(r^b.dr,a)] - b_i (r^a.r^b)(n.dr,a)(n.dr,b) - 2 (n.dr,a)(r^a.dr,i).

Stiffness-proportional damping is of Kelvin-Voigt type: forces and moments belong to E + beta dE/dt and k + beta dk/dt, so that
rigid motions are not damped.

Arrays: gradients `u` (15, p, e) hold r,1 r,2 r,11 r,22 r,12 (3 rows each) at point p of cell e, `S` = dW/du the same, `D` = d2W/du2
(15, 15, p, e); `section` (7, p, e) holds A [N/m], B [N m], nu [-], b0_11, b0_22, b0_12 [1/m] and the weight [m2] of each point.

Source (the energy): Kiendl, Bletzinger, Linhard and Wuechner, Comput. Methods Appl. Mech. Engrg. 198 (2009) 3902-3914, doi
10.1016/j.cma.2009.08.013.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.entries import entry
from ..core.jit import carray, jit
from .membrane_law import hooke, quadratic

Vector = tuple[float, float, float]

LINES = 7  #: rows of a section
WIDTH = 64  #: cells of a block
DUAL, NORMAL, SECOND = 2, 4, 5  #: first rows of r^1 r^2, n and r,11 r,22 r,12 in a frame


@jit
def vector(u: np.ndarray, k: int, p: int, e: int) -> Vector:
    return u[3 * k, p, e], u[3 * k + 1, p, e], u[3 * k + 2, p, e]


@jit
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def cross(a: Vector, b: Vector, factor: float) -> Vector:
    """factor a x b."""
    return (
        factor * (a[1] * b[2] - a[2] * b[1]),
        factor * (a[2] * b[0] - a[0] * b[2]),
        factor * (a[0] * b[1] - a[1] * b[0]),
    )


@jit
def normal(a1: Vector, a2: Vector) -> tuple[Vector, float]:
    """Unit normal n and 1 / |r,1 x r,2|."""
    g = cross(a1, a2, 1.0)
    inverse = 1.0 / math.sqrt(dot(g, g))
    return (inverse * g[0], inverse * g[1], inverse * g[2]), inverse


@jit
def membrane_strains(a1: Vector, a2: Vector) -> Vector:
    """E11, E22, E12."""
    return 0.5 * (dot(a1, a1) - 1.0), 0.5 * (dot(a2, a2) - 1.0), 0.5 * dot(a1, a2)


@jit
def bending_strains(u: np.ndarray, n: Vector, section: np.ndarray, p: int, e: int) -> Vector:
    """b_i - b0_i, i = 11, 22, 12: minus the curvatures [1/m]."""
    d1, d2, d3 = vector(u, 2, p, e), vector(u, 3, p, e), vector(u, 4, p, e)
    return dot(n, d1) - section[3, p, e], dot(n, d2) - section[4, p, e], dot(n, d3) - section[5, p, e]


@entry
def energy_at(u: Any, _: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """Strain energy [J] summed over all points: W[0]."""
    u, section, total = carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)), 0.0
    for p in range(points):
        for e in range(cells):
            a1, a2 = vector(u, 0, p, e), vector(u, 1, p, e)
            n, _ = normal(a1, a2)
            E, k, nu = membrane_strains(a1, a2), bending_strains(u, n, section, p, e), section[2, p, e]
            stretching, bending = (
                quadratic(section[0, p, e], nu, E[0], E[1], E[2]),
                quadratic(section[1, p, e], nu, k[0], k[1], k[2]),
            )
            total += section[6, p, e] * (stretching + bending)
    carray(W, 1)[0] = total


@entry
def stress_at(u: Any, rate: Any, section: Any, S: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and gradient rates `rate`), shapes (15, p, e).

    dW/dr,a = N_ab r,b - m_i G_i^a n,  dW/dr,i = m_i n,  with m = (M11, M22, 2 M12).

    Cells go through a block in which all rows have fixed places: so the compiler sees that they do not overlap, and vectorises.
    """
    shape, block = (rows, points, cells), np.empty(15 * WIDTH)
    u, rate, section, S = carray(u, shape), carray(rate, shape), carray(section, (LINES, points, cells)), carray(S, shape)
    for p in range(points):
        for first in range(0, cells, WIDTH):
            count = min(WIDTH, cells - first)
            set_elastic(u, section, p, first, count, block)
            for row in range(15):
                target = S[row, p, first : first + count]
                for i in range(count):
                    target[i] = block[row * WIDTH + i]
            if beta > 0.0:
                set_damping(u, rate, beta, section, p, first, count, block)
                for row in range(15):
                    target = S[row, p, first : first + count]
                    for i in range(count):
                        target[i] += block[row * WIDTH + i]


@jit
def set_elastic(u: np.ndarray, section: np.ndarray, p: int, first: int, cells: int, block: np.ndarray) -> None:
    """Stress without damping of the cells from `first` on."""
    if p < 0 or first < 0:
        return  # never: where the compiler knows the sign of the indices, the loop is four times as fast
    for i in range(cells):
        e = first + i
        a1, a2 = vector(u, 0, p, e), vector(u, 1, p, e)
        n, inverse = normal(a1, a2)
        c1, c2 = cross(a2, n, inverse), cross(n, a1, inverse)
        E1, E2, E3 = membrane_strains(a1, a2)
        k1, k2, k3 = bending_strains(u, n, section, p, e)
        weight, nu = section[6, p, e], section[2, p, e]
        N = hooke(weight * section[0, p, e], nu, E1, E2, E3)
        m = moments(weight * section[1, p, e], nu, k1, k2, k3)
        put(block, i, a1, a2, n, N, m, moments_along(u, p, e, c1, c2, m))


@jit
def set_damping(
    u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, p: int, first: int, cells: int, block: np.ndarray
) -> None:
    """Stress of the damping of the cells from `first` on, from dE/dt and db/dt = n.(v,i - G_i^a v,a) of the gradient rates v."""
    if p < 0 or first < 0:
        return  # as in `set_elastic`
    for i in range(cells):
        e = first + i
        a1, a2, v1, v2 = vector(u, 0, p, e), vector(u, 1, p, e), vector(rate, 0, p, e), vector(rate, 1, p, e)
        n, inverse = normal(a1, a2)
        c1, c2 = cross(a2, n, inverse), cross(n, a1, inverse)
        k1, k2, k3 = bending_rates(u, rate, n, c1, c2, p, e)
        weight, nu = beta * section[6, p, e], section[2, p, e]
        N = hooke(weight * section[0, p, e], nu, dot(a1, v1), dot(a2, v2), 0.5 * (dot(a1, v2) + dot(a2, v1)))
        m = moments(weight * section[1, p, e], nu, k1, k2, k3)
        put(block, i, a1, a2, n, N, m, moments_along(u, p, e, c1, c2, m))


@entry
def dissipation_at(u: Any, rate: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """W (p, e) = weight (A dE/dt : C : dE/dt + B db/dt : C : db/dt) of gradient rates, as `set_damping` has them [W]."""
    shape = (rows, points, cells)
    u, rate, W = carray(u, shape), carray(rate, shape), carray(W, (points, cells))
    section = carray(section, (LINES, points, cells))
    for p in range(points):
        for e in range(cells):
            a1, a2, v1, v2 = vector(u, 0, p, e), vector(u, 1, p, e), vector(rate, 0, p, e), vector(rate, 1, p, e)
            n, inverse = normal(a1, a2)
            k1, k2, k3 = bending_rates(u, rate, n, cross(a2, n, inverse), cross(n, a1, inverse), p, e)
            nu = section[2, p, e]
            stretched = quadratic(section[0, p, e], nu, dot(a1, v1), dot(a2, v2), 0.5 * (dot(a1, v2) + dot(a2, v1)))
            W[p, e] = 2.0 * section[6, p, e] * (stretched + quadratic(section[1, p, e], nu, k1, k2, k3))


@jit
def bending_rates(u: np.ndarray, rate: np.ndarray, n: Vector, c1: Vector, c2: Vector, p: int, e: int) -> Vector:
    """db_i/dt = n.(v,i - G_i^a v,a), i = 11, 22, 12."""
    turn1, turn2 = dot(n, vector(rate, 0, p, e)), dot(n, vector(rate, 1, p, e))
    d, w = vector(u, 2, p, e), vector(rate, 2, p, e)
    k1 = dot(n, w) - dot(c1, d) * turn1 - dot(c2, d) * turn2
    d, w = vector(u, 3, p, e), vector(rate, 3, p, e)
    k2 = dot(n, w) - dot(c1, d) * turn1 - dot(c2, d) * turn2
    d, w = vector(u, 4, p, e), vector(rate, 4, p, e)
    k3 = dot(n, w) - dot(c1, d) * turn1 - dot(c2, d) * turn2
    return k1, k2, k3


@jit
def put(block: np.ndarray, i: int, a1: Vector, a2: Vector, n: Vector, N: Vector, m: Vector, g: tuple[float, float]) -> None:
    """Cell i of a block: N_ab r,b - g^a n in the rows of r,a, and m_i n in those of r,i."""
    put_vector(block, 0, i, combine(N[0], a1, N[2], a2, -g[0], n))
    put_vector(block, 1, i, combine(N[2], a1, N[1], a2, -g[1], n))
    put_vector(block, 2, i, (m[0] * n[0], m[0] * n[1], m[0] * n[2]))
    put_vector(block, 3, i, (m[1] * n[0], m[1] * n[1], m[1] * n[2]))
    put_vector(block, 4, i, (m[2] * n[0], m[2] * n[1], m[2] * n[2]))


@jit
def moments(B: float, nu: float, k1: float, k2: float, k3: float) -> Vector:
    """m = dW/db_i = (M11, M22, 2 M12)."""
    M = hooke(B, nu, k1, k2, k3)
    return M[0], M[1], 2.0 * M[2]


@jit
def moments_along(u: np.ndarray, p: int, e: int, c1: Vector, c2: Vector, m: Vector) -> tuple[float, float]:
    """g^a = m_i G_i^a."""
    d1, d2, d3 = vector(u, 2, p, e), vector(u, 3, p, e), vector(u, 4, p, e)
    g1 = m[0] * dot(c1, d1) + m[1] * dot(c1, d2) + m[2] * dot(c1, d3)
    return g1, m[0] * dot(c2, d1) + m[1] * dot(c2, d2) + m[2] * dot(c2, d3)


@jit
def combine(f: float, a: Vector, g: float, b: Vector, h: float, c: Vector) -> Vector:
    """f a + g b + h c."""
    return f * a[0] + g * b[0] + h * c[0], f * a[1] + g * b[1] + h * c[1], f * a[2] + g * b[2] + h * c[2]


@jit
def put_vector(block: np.ndarray, k: int, i: int, a: Vector) -> None:
    """Cell i of vector k of a block."""
    block[3 * k * WIDTH + i] = a[0]
    block[(3 * k + 1) * WIDTH + i] = a[1]
    block[(3 * k + 2) * WIDTH + i] = a[2]


@entry
def modulus_at(u: Any, _: Any, section: Any, D: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """D = weight d2W/du2 + beta (material part), shape (15, 15, p, e), symmetric; `beta` [-]: damping time times gh."""
    shape, frame, force, C, G = (rows, points, cells), np.empty((8, 3)), np.empty((2, 3)), np.zeros((3, 3)), np.empty((2, 3))
    u, section, D = carray(u, shape), carray(section, (LINES, points, cells)), carray(D, (rows, rows, points, cells))
    for p in range(points):
        for e in range(cells):
            set_frame(u, p, e, frame)
            set_forces(u, section, p, e, force)
            factor, nu = (1.0 + beta) * section[6, p, e], section[2, p, e]
            B = factor * section[1, p, e]
            C[0, 0], C[1, 1], C[2, 2] = B, B, 2.0 * B * (1.0 - nu)
            C[0, 1] = C[1, 0] = B * nu
            for al in range(2):
                for i in range(3):
                    G[al, i] = 0.0
                    for c in range(3):
                        G[al, i] += frame[DUAL + al, c] * frame[SECOND + i, c]
            set_tangent_blocks(p, e, factor * section[0, p, e], nu, frame, force, C, G, D)
            set_curvature_blocks(p, e, frame, force, C, G, D)


@jit
def set_frame(u: np.ndarray, p: int, e: int, frame: np.ndarray) -> None:
    """Rows r,1 r,2, r^1 r^2, n, r,11 r,22 r,12 (8, 3)."""
    a1, a2 = vector(u, 0, p, e), vector(u, 1, p, e)
    n, inverse = normal(a1, a2)
    c1, c2 = cross(a2, n, inverse), cross(n, a1, inverse)
    frame[DUAL, 0], frame[DUAL, 1], frame[DUAL, 2] = c1
    frame[DUAL + 1, 0], frame[DUAL + 1, 1], frame[DUAL + 1, 2] = c2
    frame[NORMAL, 0], frame[NORMAL, 1], frame[NORMAL, 2] = n
    for c in range(3):
        frame[0, c], frame[1, c] = a1[c], a2[c]
        for i in range(3):
            frame[SECOND + i, c] = u[6 + 3 * i + c, p, e]


@jit
def set_forces(u: np.ndarray, section: np.ndarray, p: int, e: int, force: np.ndarray) -> None:
    """Rows N11 N22 N12 and m = M11 M22 2M12 times the weight (2, 3)."""
    a1, a2 = vector(u, 0, p, e), vector(u, 1, p, e)
    n, _ = normal(a1, a2)
    E, k = membrane_strains(a1, a2), bending_strains(u, n, section, p, e)
    weight, nu = section[6, p, e], section[2, p, e]
    force[0, 0], force[0, 1], force[0, 2] = hooke(weight * section[0, p, e], nu, E[0], E[1], E[2])
    force[1, 0], force[1, 1], force[1, 2] = moments(weight * section[1, p, e], nu, k[0], k[1], k[2])


@jit
def set_tangent_blocks(
    p: int, e: int, A: float, nu: float, frame: np.ndarray, force: np.ndarray, C: np.ndarray, G: np.ndarray, D: np.ndarray
) -> None:
    """Blocks (r,a r,b) of D: N_ab I + A C:r,c r,d + f n n + g^a r^b n + g^b n r^a,  g^a = m_i G_i^a,

    f = C_ij G_i^a G_j^b - m_i b_i (r^a.r^b),  C_ij the moduli of bending.
    """
    a, dual, n, d, N, m = frame[:DUAL], frame[DUAL:NORMAL], frame[NORMAL], frame[SECOND:], force[0], force[1]
    mb = 0.0
    for i in range(3):
        mb += m[i] * (n[0] * d[i, 0] + n[1] * d[i, 1] + n[2] * d[i, 2])
    for al in range(2):
        for be in range(al + 1):
            f, ga, gb = 0.0, 0.0, 0.0
            for i in range(3):
                f -= mb * dual[al, i] * dual[be, i]
                ga += m[i] * G[al, i]
                gb += m[i] * G[be, i]
                for j in range(3):
                    f += C[i, j] * G[al, i] * G[be, j]
            same = al == be
            N_ab, along, left, right = (N[al], A, 1 - al, 1 - al) if same else (N[2], A * nu, be, al)
            for i in range(3):
                for j in range(i + 1 if same else 3):
                    value = along * a[al, i] * a[be, j] + 0.5 * A * (1.0 - nu) * a[left, i] * a[right, j]
                    value += f * n[i] * n[j] + ga * dual[be, i] * n[j] + gb * n[i] * dual[al, j]
                    value += N_ab if i == j else 0.0
                    D[3 * al + i, 3 * be + j, p, e] = D[3 * be + j, 3 * al + i, p, e] = value


@jit
def set_curvature_blocks(p: int, e: int, frame: np.ndarray, force: np.ndarray, C: np.ndarray, G: np.ndarray, D: np.ndarray) -> None:
    """Blocks (r,i r,a) of D: -(C_ij G_j^a n + m_i r^a) n, and (r,i r,j): C_ij n n."""
    dual, n, m = frame[DUAL:NORMAL], frame[NORMAL], force[1]
    for i in range(3):
        for c in range(3):
            row = 6 + 3 * i + c
            for al in range(2):
                g = C[i, 0] * G[al, 0] + C[i, 1] * G[al, 1] + C[i, 2] * G[al, 2]
                for k in range(3):
                    D[row, 3 * al + k, p, e] = D[3 * al + k, row, p, e] = -(g * n[c] + m[i] * dual[al, c]) * n[k]
            for j in range(i + 1):
                for k in range(3 if j < i else c + 1):
                    D[row, 6 + 3 * j + k, p, e] = D[6 + 3 * j + k, row, p, e] = C[i, j] * n[c] * n[k]
