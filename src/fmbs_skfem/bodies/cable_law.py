r"""Thin cable or beam without torsion and shear, in two or three dimensions.

Energy per reference arc length S of a line r(S), with r' = dr/dS and |r0'| = 1:

    W = EA/2 eps^2 + EI/2 (kappa - kappa0)^2,   eps = (r'.r' - 1)/2

    exact curvature      kappa = |r' x r''| / |r'|^3     (geometric curvature of the deformed line)
    material curvature   kappa = |r' x r''| / |r'|^2     (rotation per reference length)
    quadratic            kappa = |r''|                   (straight references only; W is a polynomial)

In the plane the curvature has a sign; in space kappa >= 0 and W depends on H = kappa^2 alone, which
keeps it smooth where the line is straight. Stiffness-proportional damping is of Kelvin-Voigt type,

    N = EA (eps + beta deps/dt),   M = EI (kappa - kappa0 + beta dkappa/dt),

so that rigid motions are not damped. What balances the loads on a part of a line are the forces
that belong to the stretch l = |r'| and to the rotation theta' per reference length, of which kappa
= theta' l^(2 - m):

    F.t = dW/dl = l EA eps - (m - 2) EI (kappa - kappa0) kappa / l,   M = dW/dtheta' = l^(2 - m) EI (kappa - kappa0)

with m = 3 (exact), 2 (material) and 1 (quadratic, of constant stretch): (m - 2) M kappa apart,
which is small beside stresses, and not beside the axial force of a slender line that is bent far.

In space the rate of the curvature vector k is damped by (k k' + s^2 I) / (kappa^2 + s^2), where s
is a curvature that counts as straight, with a strain s sqrt(EI / EA) of 2.5e-4: along k, the one
objective rate of a line without torsion, and in all directions where the line is straight. A rigid
rotation omega of a line that is bent in space dissipates at most beta EI s^2 omega^2 a length.

Arrays: gradients `u` (2c, p, e) hold r' (c rows) and r'' (c rows) at point p of cell e, `S` = dW/du
the same, `D` = d2W/du2 (2c, 2c, p, e); `section` (4, p, e) holds EA [N], EI [N m2], kappa0 [1/m]
and the weight [m] of each point.

All three are one form in the gradient of the curvature (in the plane) or of H/2, see `Bending`. The
modulus takes the axial strain eps in alpha from gradients of its own, see `laws.call_modulus`.

Source (strain and curvature of the ANCF cable): Gerstmayr and Irschik, J. Sound Vib. 318 (2008)
461-487, doi 10.1016/j.jsv.2008.04.019.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..core.compiling.entries import LANES, entry, unfold
from ..core.compiling.jit import carray, inlined, jit
from .vectors import ALL, Vector, combine, cross, dot, held_product

STRAIGHT = 6.25e-8  #: square s^2 EI / EA of the strain below which a line in space counts as straight in the damping law [-]
SMALL = 1e-6  #: part of kappa0 that curvatures in space do not fall below
NEXT_TO_NOTHING = 1e-60  #: keeps kappa0 / kappa finite where there is none [1/m2]
LINES = 4  #: rows of a section


class Bending(NamedTuple):
    """Energy of bending at a point, its gradient, and coefficients of its second derivatives and of
    those of its dissipation.

        S = EA eps (r', 0) + pull g,    D and d2R/dv2 = [A, B; B^T, C]
        A = alpha I + beta r'r' + gamma g1 g1 - tau (g1 r' + r' g1) - sigma r'' r''
        B = gamma g1 g2 - tau r' g2 + (sigma + omega) r' r'' - omega r'' r' - sigma (r'.r'') I + skew J
        C = zeta I + gamma g2 g2 - sigma r' r'

    with the gradient g = (g1, g2) of the curvature (in the plane) or of H/2, J = (0, 1; -1, 0), and
    EA eps in alpha and EA in beta beside what is here.
    """

    energy: float
    pull: float
    g1: Vector
    g2: Vector
    elastic: tuple[float, float, float, float, float, float]  #: alpha, beta, gamma, tau, zeta, skew
    viscous: tuple[float, float, float, float, float]  #: alpha, beta, gamma, tau, zeta
    sigma: tuple[float, float]  #: elastic, where omega is the same, and viscous


@jit
def fall(a: float, n: int) -> float:
    """a^(-n/2) for n = 2 and 3."""
    # a floating power took two thirds of the time of the force
    return 1.0 / (a * math.sqrt(a)) if n == 3 else 1.0 / a


@jit
def read(u: np.ndarray, dim: int, q: int) -> tuple[Vector, Vector]:
    """r' and r'' or their rates at point q, whose third component is 0 in the plane."""
    # tuples and no arrays: the compiler keeps them in registers
    if dim == 2:
        return (u[0, q], u[1, q], 0.0), (u[2, q], u[3, q], 0.0)
    return (u[0, q], u[1, q], u[2, q]), (u[3, q], u[4, q], u[5, q])


@inlined
def planar(r: Vector, b: Vector, n: int, EA: float, EI: float, kappa0: float) -> Bending:
    """Bending in the plane, where the curvature has a sign.

        kappa = (r' x r'')_z / |r'|^n,    W = EI/2 (kappa - kappa0)^2

    of r = r' and b = r'' (3,); n is 3 (EXACT) or 2 (MATERIAL).
    """
    # kappa has a sign here, so that kappa0 does: W is smooth where the line is straight
    a = dot(r, r)
    power = fall(a, n)
    by = n / a
    kappa = (r[0] * b[1] - r[1] * b[0]) * power
    M = EI * (kappa - kappa0)
    g1 = (power * b[1] - by * kappa * r[0], -power * b[0] - by * kappa * r[1], 0.0)
    g2 = (-power * r[1], power * r[0], 0.0)
    elastic = -M * by * kappa, M * by * (2.0 - n) * kappa / a, EI, M * by, 0.0, M * power
    return Bending(
        0.5 * M * (kappa - kappa0), M, g1, g2, elastic, (0.0, 0.0, EI, 0.0, 0.0), (0.0, 0.0)
    )


@inlined
def bent(H: float, EA: float, EI: float, kappa0: float) -> tuple[float, float, float, float, float]:
    """Energy of bending a length of H = kappa^2, and coefficients of its derivatives and of the
    damping.

        EI (kappa - kappa0)^2 / 2,  EI (1 - kappa0 / kappa),  EI kappa0 / kappa^3,  EI / (H + s^2),  EI s^2 / (H + s^2)

    with s^2 EI / EA = STRAIGHT.
    """
    # the root is never zero: W depends on H alone where kappa0 is 0, and has to be smooth there
    kappa = math.sqrt(H + (SMALL * kappa0) ** 2 + NEXT_TO_NOTHING)
    straight = STRAIGHT * EA / EI
    part, rho = EI * kappa0 / kappa, EI / (H + straight)
    return (
        0.5 * EI * (H - 2.0 * kappa0 * kappa + kappa0 * kappa0),
        EI - part,
        part / (kappa * kappa),
        rho,
        straight * rho,
    )


@inlined
def spatial(r: Vector, b: Vector, n: int, EA: float, EI: float, kappa0: float) -> Bending:
    """Bending in space by the square of the curvature, which is smooth where the line is straight.

        H = |r' x r''|^2 / |r'|^(2 n)

    of r = r' and b = r'' (3,); n is 3 (EXACT) or 2 (MATERIAL).
    """
    # H and no kappa: the derivative of a root is infinite where the line is straight
    a = dot(r, r)
    d = dot(b, b)
    across = cross(1.0, r, b)
    power = fall(a, n)
    by = n / a
    h = power * power
    H = h * dot(across, across)
    W, c, gamma, rho, mu = bent(H, EA, EI, kappa0)
    elastic = (
        c * (h * d - by * H),
        2.0 * c * by * (1.0 - n) * H / a,
        gamma,
        2.0 * by * c,
        c * h * a,
        0.0,
    )
    viscous = mu * h * d, -mu * by * by * H, rho, mu * by, mu * h * a
    return Bending(
        W,
        c,
        combine(1.0, cross(h, b, across), -by * H, r),
        cross(h, across, r),
        elastic,
        viscous,
        (c * h, mu * h),
    )


@inlined
def quadratic(r: Vector, b: Vector, n: int, EA: float, EI: float, kappa0: float) -> Bending:
    """Bending by the second derivative alone, of straight references.

        H = r''.r''

    of b = r'' (3,) [1/m]; r' is not read.
    """
    # without r': mass and bending stiffness of a straight line are constant
    W, c, gamma, rho, mu = bent(dot(b, b), EA, EI, kappa0)
    return Bending(
        W,
        c,
        (0.0, 0.0, 0.0),
        b,
        (0.0, 0.0, gamma, 0.0, c, 0.0),
        (0.0, 0.0, rho, 0.0, mu),
        (0.0, 0.0),
    )


@inlined
def drag(
    r: Vector, b: Vector, v: Vector, w: Vector, EA: float, B: Bending, whole: bool
) -> tuple[Vector, Vector]:
    """Damping forces of a damping time of 1 s, by the rates v of r' and w of r''.

        dR/dv,    dR/dw

    B has alpha, beta, tau and sigma where it is `whole`.
    """
    alpha, beta, gamma, tau, zeta = B.viscous
    rv = dot(r, v)
    gv = dot(B.g1, v) + dot(B.g2, w)
    # `whole` is known when this is compiled: in the plane and for the quadratic curvature four of
    # the terms below are no code
    if not whole:
        return combine(EA * rv, r, gamma * gv, B.g1), combine(gamma * gv, B.g2, zeta, w)
    sigma = B.sigma[1]
    along = gamma * gv - tau * rv
    mixed = sigma * dot(r, b)
    first = combine((EA + beta) * rv - tau * gv + sigma * dot(b, w), r, along, B.g1)
    second = combine(along, B.g2, zeta, w)
    first = combine(
        1.0, first, 1.0, combine(-sigma * dot(b, v), b, 1.0, combine(alpha, v, -mixed, w))
    )
    return first, combine(
        1.0, second, 1.0, combine(sigma * rv, b, 1.0, combine(-sigma * dot(r, w), r, -mixed, v))
    )


@inlined
def moment(r: Vector, b: Vector, n: int, dim: int, EI: float, kappa0: float) -> Vector:
    """Moment (3,) [N m] of the curvature vector k; kappa0 is about z in the plane, along k in
    space.

        EI (k - kappa0),    k = r' x r'' / |r'|^n
    """
    k = cross(dot(r, r) ** (-0.5 * n), r, b)
    if dim == 2:
        return 0.0, 0.0, EI * (k[2] - kappa0)
    part = EI - EI * kappa0 / math.sqrt(dot(k, k) + (SMALL * kappa0) ** 2 + NEXT_TO_NOTHING)
    return part * k[0], part * k[1], part * k[2]


@inlined
def add_moment(D: np.ndarray, dim: int, q: int, r: Vector, b: Vector, n: int, m: Vector) -> None:
    """Add to D (2c, 2c, q) the second derivatives of the work of a constant moment.

        D += d2(m.k)/du2,    k = r' x r'' / |r'|^n

    at point q, of a moment m (3,) [N m].
    """
    by = n / dot(r, r)
    power = dot(r, r) ** (-0.5 * n)
    work = power * dot(m, cross(1.0, r, b))
    g1 = combine(1.0, cross(power, b, m), -by * work, r)
    g2 = cross(power, m, r)
    turn = (power * m[0], power * m[1], power * m[2])
    for i in range(dim):
        for j in range(dim):
            own = by * ((2.0 - n) * work / dot(r, r) * r[i] * r[j] - g1[i] * r[j] - r[i] * g1[j])
            D[i, j, q] += own - by * work if i == j else own
            # e_ijk m_k
            own = 0.0 if i == j else turn[3 - i - j] * (1.0 if (j - i) % 3 == 1 else -1.0)
            D[i, dim + j, q] += own - by * r[i] * g2[j]
            D[dim + j, i, q] += own - by * r[i] * g2[j]


@inlined
def write(S: np.ndarray, dim: int, q: int, f: float, first: Vector, second: Vector) -> None:
    """S = f (first, second) at point q."""
    S[0, q], S[1, q], S[dim, q], S[dim + 1, q] = (
        f * first[0],
        f * first[1],
        f * second[0],
        f * second[1],
    )
    # decided when it is compiled: one source for plane and space
    if dim == 3:
        S[2, q], S[5, q] = f * first[2], f * second[2]


@inlined
def put(
    D: np.ndarray, T: np.ndarray, dim: int, i: int, j: int, q: int, k: int, value: float
) -> None:
    """D[i, j, q] = D[j, i, q] = value, j <= i: in space by way of T, see `unfold`."""
    # in the plane entries are written at once, in space LANES points at a time by way of T
    if dim == 2:
        D[i, j, q] = D[j, i, q] = value
    else:
        T[i * (i + 1) // 2 + j, k] = value


def functions(name: str, dim: int, bend: Any) -> dict[str, Callable[[], int]]:
    """Functions of a law by how it bends; the modulus has the viscosity in it."""
    # constants of the compiled functions: branches on them are no code
    leans = name != "quadratic"
    whole = leans and dim == 3

    found: dict[str, Callable[[], int]] = {}

    def named(function: Callable[..., None]) -> None:
        function.__qualname__ = f"{name}_{dim}_{function.__name__}"
        found[function.__qualname__] = entry(function)

    @named
    def energy(
        u: Any, _: Any, section: Any, W: Any, way: int, points: int, cells: int, n: int, beta: float
    ) -> None:
        count = points * cells
        total = 0.0
        u, s = carray(u, (2 * dim, count)), carray(section, (LINES, count))
        for q in range(count):
            r, b = read(u, dim, q)
            # all of the law in one loop over points, which becomes vector instructions: 2 us a
            # stress at 500 points in space, 6 us without
            eps = 0.5 * (dot(r, r) - 1.0)
            B = bend(r, b, n, s[0, q], s[1, q], s[2, q])
            total += s[3, q] * (0.5 * s[0, q] * eps * eps + B.energy)
        carray(W, 1)[0] = total

    @named
    def stress(
        u: Any, _: Any, section: Any, S: Any, way: int, points: int, cells: int, n: int, beta: float
    ) -> None:
        count = points * cells
        u, s, S = (
            carray(u, (2 * dim, count)),
            carray(section, (LINES, count)),
            carray(S, (2 * dim, count)),
        )
        for q in range(count):
            r, b = read(u, dim, q)
            B = bend(r, b, n, s[0, q], s[1, q], s[2, q])
            N = 0.5 * s[0, q] * (dot(r, r) - 1.0)
            write(S, dim, q, s[3, q], combine(N, r, B.pull, B.g1), combine(B.pull, B.g2, 0.0, B.g2))

    @named
    def damped_stress(
        u: Any,
        rate: Any,
        section: Any,
        S: Any,
        way: int,
        points: int,
        cells: int,
        n: int,
        beta: float,
    ) -> None:
        count = points * cells
        u, s, S = (
            carray(u, (2 * dim, count)),
            carray(section, (LINES, count)),
            carray(S, (2 * dim, count)),
        )
        rates = carray(rate, (2 * dim, count))
        for q in range(count):
            r, b = read(u, dim, q)
            v, w = read(rates, dim, q)
            B = bend(r, b, n, s[0, q], s[1, q], s[2, q])
            N = 0.5 * s[0, q] * (dot(r, r) - 1.0)
            first, second = drag(r, b, v, w, s[0, q], B, whole)
            first = combine(1.0, combine(N, r, B.pull, B.g1), beta, first)
            write(S, dim, q, s[3, q], first, combine(B.pull, B.g2, beta, second))

    @named
    def dissipation(
        u: Any,
        rate: Any,
        section: Any,
        W: Any,
        way: int,
        points: int,
        cells: int,
        n: int,
        beta: float,
    ) -> None:
        count = points * cells
        u, s, rates = (
            carray(u, (2 * dim, count)),
            carray(section, (LINES, count)),
            carray(rate, (2 * dim, count)),
        )
        W = carray(W, count)
        for q in range(count):
            r, b = read(u, dim, q)
            v, w = read(rates, dim, q)
            B = bend(r, b, n, s[0, q], s[1, q], s[2, q])
            rv = dot(r, v)
            alpha, stretch, gamma, tau, zeta = B.viscous
            gv = dot(B.g1, v) + dot(B.g2, w)
            twice = (s[0, q] + stretch) * rv * rv + gamma * gv * gv + zeta * dot(w, w)
            if whole:
                across = (
                    2.0 * (rv * dot(b, w) - dot(r, b) * dot(v, w)) - dot(b, v) ** 2 - dot(r, w) ** 2
                )
                twice += alpha * dot(v, v) - 2.0 * tau * rv * gv + B.sigma[1] * across
            W[q] = s[3, q] * twice

    @named
    def modulus(
        u: Any,
        held: Any,
        section: Any,
        D: Any,
        way: int,
        points: int,
        cells: int,
        n: int,
        beta: float,
    ) -> None:
        count = points * cells
        before = carray(held, (2 * dim, count))
        u, s, D = (
            carray(u, (2 * dim, count)),
            carray(section, (LINES, count)),
            carray(D, (2 * dim, 2 * dim, count)),
        )
        # 21 entries a point in space: a modulus takes 13 us at 500 points as vector instructions,
        # 24 us without
        lanes = LANES if dim == 3 else count
        T = np.empty((dim * (2 * dim + 1), LANES))
        for start in range(0, count, lanes):
            for k in range(min(lanes, count - start)):
                q = start + k
                r, b = read(u, dim, q)
                EA = s[0, q]
                f = s[3, q]
                slope = read(before, dim, q)[0]
                eps = 0.5 * (held_product(way, r, r, slope, slope) - 1.0)
                B = bend(r, b, n, EA, s[1, q], s[2, q])
                g1, g2, elastic, viscous = B.g1, B.g2, B.elastic, B.viscous
                alpha = f * (EA * eps + elastic[0] + beta * viscous[0])
                stretch = f * (EA * (1.0 + beta) + elastic[1] + beta * viscous[1])
                gamma, tau = (
                    f * (elastic[2] + beta * viscous[2]),
                    f * (elastic[3] + beta * viscous[3]),
                )
                zeta, skew = f * (elastic[4] + beta * viscous[4]), f * elastic[5]
                omega, sigma = f * B.sigma[0], f * (B.sigma[0] + beta * B.sigma[1])
                p = combine(stretch, r, -tau, g1)
                g = combine(gamma, g1, -tau, r)
                mixed = sigma * dot(r, b)
                for i in range(dim):
                    for j in range(i + 1):
                        own = p[i] * r[j] + g[i] * g1[j] if leans else stretch * r[i] * r[j]
                        own -= sigma * b[i] * b[j] if whole else 0.0
                        put(D, T, dim, i, j, q, k, own + alpha if i == j else own)
                        own = gamma * g2[i] * g2[j] - (sigma * r[i] * r[j] if whole else 0.0)
                        put(D, T, dim, dim + i, dim + j, q, k, own + zeta if i == j else own)
                    for j in range(dim):
                        own = g[i] * g2[j] if leans else 0.0
                        if whole:
                            own += (
                                (sigma + omega) * r[i] * b[j]
                                - omega * b[i] * r[j]
                                - (mixed if i == j else 0.0)
                            )
                        put(
                            D,
                            T,
                            dim,
                            dim + j,
                            i,
                            q,
                            k,
                            own + (j - i) * skew if dim == 2 and leans else own,
                        )
            if dim == 3:
                unfold(T, start, D, False)
        # the moment of the quadratic curvature has no part in it
        for q in range(count if way == ALL and leans else 0):
            (r, b), (a, c) = read(u, dim, q), read(before, dim, q)
            m = combine(
                s[3, q],
                moment(a, c, n, dim, s[1, q], s[2, q]),
                -s[3, q],
                moment(r, b, n, dim, s[1, q], s[2, q]),
            )
            add_moment(D, dim, q, r, b, n, m)

    return found


FUNCTIONS = functions("curved", 2, planar) | functions("curved", 3, spatial)
FUNCTIONS |= functions("quadratic", 2, quadratic) | functions("quadratic", 3, quadratic)


def curvatures(n: int, dim: int, gradients: np.ndarray) -> np.ndarray:
    """Curvature kappa [1/m] of lines, (...) of gradients r' and r'' in one row (..., 2c).

        n = 3, 2    kappa = |r' x r''| / |r'|^n, in the plane (dim 2) with its sign          n = 0    kappa = |r''|

    n is `Law.option`: 3 of EXACT, 2 of MATERIAL, 0 of QUADRATIC.
    """
    slope, bend = gradients[..., :dim], gradients[..., dim:]
    a, b, d = (
        (one * other).sum(axis=-1) for one, other in ((slope, slope), (slope, bend), (bend, bend))
    )
    # outputs, not the step: arrays of any shape, by numpy
    if n == 0:
        return np.asarray(np.sqrt(d))
    if dim == 2:
        return np.asarray(
            (slope[..., 0] * bend[..., 1] - slope[..., 1] * bend[..., 0]) * a ** (-0.5 * n)
        )
    return np.asarray(np.sqrt(np.maximum(a * d - b * b, 0.0)) * a ** (-0.5 * n))


def section_forces(
    n: int,
    dim: int,
    numbers: tuple[float | np.ndarray, float | np.ndarray],
    kappa0: np.ndarray | float,
    gradients: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Axial force F.t [N] and bending moment M [N m], both (...), of a cable at gradients (...,
    2c).

        F.t = l EA (l^2 - 1) / 2 - (m - 2) EI (kappa - kappa0) kappa / l,    M = l^(2 - m) EI (kappa - kappa0),    l = |r'|

    with m = n, or 1 where n is 0, n as in `curvatures`; `numbers` are EA [N] and EI [N m2], kappa0
    [1/m], each a number or (...).
    """
    EA, EI = numbers
    stretch = np.linalg.norm(gradients[..., :dim], axis=-1)
    kappa = curvatures(n, dim, gradients)
    # n = 0 stands for the quadratic curvature, whose moment is that of m = 1
    above = (n or 1) - 2
    change = EI * (kappa - kappa0)
    return EA * 0.5 * (
        stretch**2 - 1.0
    ) * stretch - above * change * kappa / stretch, change * stretch**-above


def stresses(
    n: int,
    dim: int,
    numbers: tuple[np.ndarray, np.ndarray],
    kappa0: np.ndarray,
    gradients: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the energy (..., c) each of a cable at gradients (..., 2c), per reference
    length and without weights.

        dW/dr' [N],    dW/dr'' [N m]

    `numbers` are EA [N] and EI [N m2], (...,) each, kappa0 (...,) [1/m]; n as in `curvatures`. With
    n = 0 the reference is straight: kappa0 is not read.
    """
    EA, EI = numbers
    slope, bend = gradients[..., :dim], gradients[..., dim:]
    a = (slope**2).sum(axis=-1)
    N = EA * 0.5 * (a - 1.0)
    if n == 0:
        return N[..., None] * slope, np.broadcast_to(EI, N.shape)[..., None] * bend
    r1, r2 = (
        np.concatenate([one, np.zeros((*N.shape, 3 - dim))], axis=-1) for one in (slope, bend)
    )
    fall = a ** (-0.5 * n)
    k = fall[..., None] * np.cross(r1, r2)
    kappa = k[..., 2] if dim == 2 else np.linalg.norm(k, axis=-1)
    along = np.divide(kappa0, kappa, out=np.zeros_like(kappa), where=kappa != 0.0)
    m = EI[..., None] * (
        k - np.array([0.0, 0.0, 1.0]) * kappa0[..., None]
        if dim == 2
        else (1.0 - along)[..., None] * k
    )
    first = (N - n * (m * k).sum(axis=-1) / a)[..., None] * r1 + fall[..., None] * np.cross(r2, m)
    return first[..., :dim], (fall[..., None] * np.cross(m, r1))[..., :dim]
