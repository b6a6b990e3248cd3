r"""Thin cable or beam without torsion and shear, in two or three dimensions.

Energy per reference arc length S of a line r(S), with r' = dr/dS and |r0'| = 1:

    W = EA/2 eps^2 + EI/2 (kappa - kappa0)^2,   eps = (r'.r' - 1)/2

    exact curvature      kappa = |r' x r''| / |r'|^3     (geometric curvature of the deformed line)
    material curvature   kappa = |r' x r''| / |r'|^2     (rotation per reference length)
    quadratic            kappa = |r''|                   (straight references only; W is a polynomial)

In the plane the curvature has a sign; in space kappa >= 0 and W depends on H = kappa^2 alone, which keeps it smooth where the line
is straight. Stiffness-proportional damping is of Kelvin-Voigt type,

    N = EA (eps + beta deps/dt),   M = EI (kappa - kappa0 + beta dkappa/dt),

so that rigid motions are not damped.
In space the rate of the curvature vector k is damped by (k k' + s^2 I) / (kappa^2 + s^2), where s is a curvature that counts as
straight: along k, the one objective rate of a line without torsion, and in all directions where the line is straight. A rigid
rotation omega of a line that is bent in space dissipates at most beta EI s^2 omega^2 a length.

Arrays: jets `u` (2c, p, e) hold r' (c rows) and r'' (c rows) at point p of cell e, `S` = dW/du the same, `D` = d2W/du2
(2c, 2c, p, e); `section` (4, p, e) holds EA [N], EI [N m2], kappa0 [1/m] and the weight [m] of each point.

Source (strain and curvature of the ANCF cable): Gerstmayr and Irschik, J. Sound Vib. 318 (2008) 461-487, doi
10.1016/j.jsv.2008.04.019.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np
from numba import carray

from ..core.entries import entry
from ..core.jit import jit


class Curvature(IntEnum):
    """Measure of curvature; the value is the power of |r'| in its denominator (0: the polynomial |r''|)."""

    QUADRATIC = 0
    MATERIAL = 2
    EXACT = 3


LINES = 4  #: rows of a section
STRAIGHT = 1e-2  #: square s^2 of the curvature below which a line in space counts as straight in the damping law [1/m2]
SMALL = 1e-12  #: keeps 1 - kappa0 / kappa finite [1/m2]


@jit
def invariants(n: int, a: float, b: float, d: float) -> tuple[float, float]:
    """H = kappa^2 and h = a^-n from a = r'.r', b = r'.r'', d = r''.r''."""
    if n == 0:
        return d, 1.0
    h = 1.0 / (a * a * a) if n == 3 else 1.0 / (a * a)
    return h * max(a * d - b * b, 0.0), h


@jit
def energy(curvature: int, u: np.ndarray, section: np.ndarray) -> float:
    """Strain energy [J] summed over all points."""
    dim, total = u.shape[0] // 2, 0.0
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            total += section[3, p, e] * density(curvature, dim, u[:, p, e], section[:, p, e])
    return total


@jit
def density(curvature: int, dim: int, u: np.ndarray, section: np.ndarray) -> float:
    """W [J/m] at one point; u (2c,), section (4,)."""
    eps, kappa = strains(curvature, dim, u)
    return 0.5 * section[0] * eps**2 + 0.5 * section[1] * (kappa - section[2]) ** 2


@jit
def strains(curvature: int, dim: int, u: np.ndarray) -> tuple[float, float]:
    """Axial strain eps [-] and curvature kappa [1/m] at one point; u (2c,)."""
    a, b, d = 0.0, 0.0, 0.0
    for c in range(dim):
        a += u[c] * u[c]
        b += u[c] * u[dim + c]
        d += u[dim + c] * u[dim + c]
    if dim == 2 and curvature > 0:
        return 0.5 * (a - 1.0), (u[0] * u[3] - u[1] * u[2]) / a ** (0.5 * curvature)
    return 0.5 * (a - 1.0), math.sqrt(invariants(curvature, a, b, d)[0])


@jit
def curvatures(curvature: int, dim: int, jets: np.ndarray) -> np.ndarray:
    """kappa [1/m] (e, p) of jets (e, p, 2c)."""
    kappa = np.zeros(jets.shape[:2])
    for e in range(jets.shape[0]):
        for p in range(jets.shape[1]):
            kappa[e, p] = strains(curvature, dim, jets[e, p])[1]
    return kappa


@jit
def stress(curvature: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and jet rates `rate`), shapes (2c, p, e)."""
    if u.shape[0] == 4 and curvature > 0:
        planar_stress(curvature, u, rate, beta, section, S)
    else:
        spatial_stress(curvature, u, rate, beta, section, S)


@jit
def modulus(curvature: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight d2W/du2 + beta (material part), shape (2c, 2c, p, e), symmetric; `beta` [-]: damping time times gh."""
    if u.shape[0] == 4 and curvature > 0:
        planar_modulus(curvature, u, beta, section, D)
    else:
        spatial_modulus(curvature, u, beta, section, D)


@jit
def planar_stress(n: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """Signed curvature kappa = w a^(-n/2), w = r' x r''; dkappa = dw a^(-n/2) - n kappa/a r'.dr'."""
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            a = x1 * x1 + y1 * y1
            inverse = 1.0 / a
            g = inverse * math.sqrt(inverse) if n == 3 else inverse
            kappa = (x1 * y2 - y1 * x2) * g
            N = section[0, p, e] * 0.5 * (a - 1.0)
            M = section[1, p, e] * (kappa - section[2, p, e])
            if beta > 0.0:
                eps_rate = x1 * rate[0, p, e] + y1 * rate[1, p, e]
                w_rate = rate[0, p, e] * y2 + x1 * rate[3, p, e] - rate[1, p, e] * x2 - y1 * rate[2, p, e]
                N += beta * section[0, p, e] * eps_rate
                M += beta * section[1, p, e] * (w_rate * g - n * kappa * inverse * eps_rate)
            weight = section[3, p, e]
            axial = weight * (N - n * M * kappa * inverse)
            bending = weight * M * g
            S[0, p, e] = axial * x1 + bending * y2
            S[1, p, e] = axial * y1 - bending * x2
            S[2, p, e] = -bending * y1
            S[3, p, e] = bending * x1


@jit
def planar_modulus(n: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """EA eps_u eps_u' + N eps_uu + EI kappa_u kappa_u' + M kappa_uu with the signed curvature."""
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            x1, y1, x2, y2 = u[0, p, e], u[1, p, e], u[2, p, e], u[3, p, e]
            a = x1 * x1 + y1 * y1
            inverse = 1.0 / a
            g = inverse * math.sqrt(inverse) if n == 3 else inverse
            kappa = (x1 * y2 - y1 * x2) * g
            weight = section[3, p, e]
            N = weight * section[0, p, e] * 0.5 * (a - 1.0)
            M = weight * section[1, p, e] * (kappa - section[2, p, e])
            EA, EI = weight * section[0, p, e] * (1.0 + beta), weight * section[1, p, e] * (1.0 + beta)
            fall = -n * inverse
            k0, k1, k2, k3 = g * y2 + fall * kappa * x1, -g * x2 + fall * kappa * y1, -g * y1, g * x1
            identity = N + M * fall * kappa
            outer = EA + M * kappa * n * (n + 2) * inverse * inverse
            cross = M * g * fall
            D[0, 0, p, e] = EI * k0 * k0 + identity + outer * x1 * x1 + 2.0 * cross * x1 * y2
            D[0, 1, p, e] = D[1, 0, p, e] = EI * k0 * k1 + outer * x1 * y1 + cross * (y1 * y2 - x1 * x2)
            D[1, 1, p, e] = EI * k1 * k1 + identity + outer * y1 * y1 - 2.0 * cross * y1 * x2
            D[0, 2, p, e] = D[2, 0, p, e] = EI * k0 * k2 - cross * x1 * y1
            D[0, 3, p, e] = D[3, 0, p, e] = EI * k0 * k3 + cross * x1 * x1 + M * g
            D[1, 2, p, e] = D[2, 1, p, e] = EI * k1 * k2 - cross * y1 * y1 - M * g
            D[1, 3, p, e] = D[3, 1, p, e] = EI * k1 * k3 + cross * x1 * y1
            D[2, 2, p, e] = EI * k2 * k2
            D[2, 3, p, e] = D[3, 2, p, e] = EI * k2 * k3
            D[3, 3, p, e] = EI * k3 * k3


@jit
def spatial_stress(n: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S = N r' + phi dH/du with phi = dW/dH = EI/2 (1 - kappa0/kappa)."""
    dim = u.shape[0] // 2
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            a, b, d = 0.0, 0.0, 0.0
            for c in range(dim):
                a += u[c, p, e] * u[c, p, e]
                b += u[c, p, e] * u[dim + c, p, e]
                d += u[dim + c, p, e] * u[dim + c, p, e]
            H, h = invariants(n, a, b, d)
            p1, p2, q2 = gradient(n, a, b, d, H, h)
            N = section[0, p, e] * 0.5 * (a - 1.0)
            phi = 0.5 * section[1, p, e]
            if section[2, p, e] > 0.0:
                phi *= 1.0 - section[2, p, e] / math.sqrt(H + SMALL)
            if beta > 0.0:
                eps_rate, H_rate = 0.0, 0.0
                for c in range(dim):
                    r1, r2 = u[c, p, e], u[dim + c, p, e]
                    eps_rate += r1 * rate[c, p, e]
                    H_rate += (p1 * r1 + p2 * r2) * rate[c, p, e] + (p2 * r1 + q2 * r2) * rate[dim + c, p, e]
                N += beta * section[0, p, e] * eps_rate
                phi += beta * section[1, p, e] * H_rate / (4.0 * (H + STRAIGHT))
            weight = section[3, p, e]
            first, cross, second = weight * (N + phi * p1), weight * phi * p2, weight * phi * q2
            for c in range(dim):
                S[c, p, e] = first * u[c, p, e] + cross * u[dim + c, p, e]
                S[dim + c, p, e] = cross * u[c, p, e] + second * u[dim + c, p, e]
            if beta > 0.0:
                i1, A, B, C, i2, E, F, i3, X = bending_metric(n, a, b, d, H, h)
                v11, v21, v12, v22 = 0.0, 0.0, 0.0, 0.0
                for c in range(dim):
                    v11 += u[c, p, e] * rate[c, p, e]
                    v21 += u[dim + c, p, e] * rate[c, p, e]
                    v12 += u[c, p, e] * rate[dim + c, p, e]
                    v22 += u[dim + c, p, e] * rate[dim + c, p, e]
                straight = weight * beta * section[1, p, e] * STRAIGHT / (H + STRAIGHT)
                for c in range(dim):
                    r1, r2, v1, v2 = u[c, p, e], u[dim + c, p, e], rate[c, p, e], rate[dim + c, p, e]
                    along = A * v11 + B * v21 + E * v12 + F * v22
                    S[c, p, e] += straight * (i1 * v1 + i2 * v2 + along * r1 + (B * v11 + C * v21) * r2)
                    S[dim + c, p, e] += straight * (i2 * v1 + i3 * v2 + (E * v11 + X * v12) * r1 + F * v11 * r2)


@jit
def bending_metric(
    n: int, a: float, b: float, d: float, H: float, h: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """k_u^T k_u of the curvature vector k = (r' x r'') a^(-n/2), in the blocks of `spatial_modulus`: i1 A B C, i2 E F, i3 X."""
    if n == 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0
    fall = n * h / a
    return h * d, n * n * H / (a * a) - 2.0 * fall * d, fall * b, -h, -h * b, fall * b, h * (1.0 - n), h * a, -h


@jit
def gradient(n: int, a: float, b: float, d: float, H: float, h: float) -> tuple[float, float, float]:
    """dH/dr' = p1 r' + p2 r'',  dH/dr'' = p2 r' + q2 r''."""
    if n == 0:
        return 0.0, 0.0, 2.0
    return -2.0 * n * H / a + 2.0 * h * d, -2.0 * h * b, 2.0 * h * a


@jit
def spatial_modulus(n: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """Blocks of D as combinations of the identity and of r' r'', each with one scalar a point:

    D11 = i1 I + A r'r' + B (r'r'' + r''r') + C r''r'',  D12 = i2 I + E r'r' + F r'r'' + G r''r' + Q r''r'',  D22 likewise.
    """
    dim = u.shape[0] // 2
    for p in range(u.shape[1]):
        for e in range(u.shape[2]):
            a, b, d = 0.0, 0.0, 0.0
            for c in range(dim):
                a += u[c, p, e] * u[c, p, e]
                b += u[c, p, e] * u[dim + c, p, e]
                d += u[dim + c, p, e] * u[dim + c, p, e]
            H, h = invariants(n, a, b, d)
            p1, p2, q2 = gradient(n, a, b, d, H, h)
            weight, k0 = section[3, p, e], section[2, p, e]
            EA, EI = weight * section[0, p, e], weight * section[1, p, e]
            N = EA * 0.5 * (a - 1.0)
            phi, slope = 0.5 * EI, 0.25 * EI * beta / (H + STRAIGHT)
            if k0 > 0.0:
                kappa = math.sqrt(H + SMALL)
                phi *= 1.0 - k0 / kappa
                slope += 0.25 * EI * k0 / kappa**3
            straight = EI * beta * STRAIGHT / (H + STRAIGHT)
            m1, mA, mB, mC, m2, mE, mF, m3, mX = bending_metric(n, a, b, d, H, h)
            i1, i2, i3 = N + straight * m1, straight * m2, phi * q2 + straight * m3
            A, B, C = EA * (1.0 + beta) + slope * p1 * p1, slope * p1 * p2, slope * p2 * p2
            E, F, G, Q = slope * p1 * p2, slope * p1 * q2, slope * p2 * p2, slope * p2 * q2
            X, Y, Z = slope * p2 * p2 + straight * mX, slope * p2 * q2, slope * q2 * q2
            A, B, C, E, F = A + straight * mA, B + straight * mB, C + straight * mC, E + straight * mE, F + straight * mF
            if n > 0:
                i1 += phi * p1
                i2 += phi * p2
                A += phi * (4.0 * n * (n + 1) * H / (a * a) - 8.0 * n * h * d / a)
                B += phi * 4.0 * n * h * b / a
                C -= phi * 2.0 * h
                E += phi * 4.0 * n * h * b / a
                F += phi * 4.0 * h * (1.0 - n)
                G -= phi * 2.0 * h
                X -= phi * 2.0 * h
            for i in range(dim):
                r1, r2 = u[i, p, e], u[dim + i, p, e]
                for j in range(dim):
                    s1, s2 = u[j, p, e], u[dim + j, p, e]
                    same = 1.0 if i == j else 0.0
                    D[i, dim + j, p, e] = D[dim + j, i, p, e] = i2 * same + E * r1 * s1 + F * r1 * s2 + G * r2 * s1 + Q * r2 * s2
                    if j <= i:
                        mixed = r1 * s2 + r2 * s1
                        D[i, j, p, e] = D[j, i, p, e] = i1 * same + A * r1 * s1 + B * mixed + C * r2 * s2
                        D[dim + i, dim + j, p, e] = D[dim + j, dim + i, p, e] = i3 * same + X * r1 * s1 + Y * mixed + Z * r2 * s2


@entry
def energy_at(u: Any, _: Any, section: Any, W: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`energy` as an entry: W[0]."""
    carray(W, 1)[0] = energy(law, carray(u, (rows, points, cells)), carray(section, (LINES, points, cells)))


@entry
def stress_at(u: Any, rate: Any, section: Any, S: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`stress` as an entry."""
    shape = (rows, points, cells)
    stress(law, carray(u, shape), carray(rate, shape), beta, carray(section, (LINES, points, cells)), carray(S, shape))


@entry
def modulus_at(u: Any, _: Any, section: Any, D: Any, rows: int, points: int, cells: int, law: int, beta: float) -> None:
    """`modulus` as an entry."""
    modulus(
        law, carray(u, (rows, points, cells)), beta, carray(section, (LINES, points, cells)), carray(D, (rows, rows, points, cells))
    )
