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

The energy stands in `law_symbols`, of which stress and modulus are made; here are the numbers of
it, and what outputs read.

Source (strain and curvature of the ANCF cable): Gerstmayr and Irschik, J. Sound Vib. 318 (2008)
461-487, doi 10.1016/j.jsv.2008.04.019.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.compiling.jit import jit

STRAIGHT = 6.25e-8  #: square s^2 EI / EA of the strain below which a line in space counts as straight in the damping law [-]
SMALL = 1e-6  #: part of kappa0 that curvatures in space do not fall below
NEXT_TO_NOTHING = 1e-60  #: keeps kappa0 / kappa finite where there is none [1/m2]


@jit
def fall(a: float, n: int) -> float:
    """a^(-n/2) for n = 2 and 3."""
    # a floating power took two thirds of the time of the force
    return 1.0 / (a * math.sqrt(a)) if n == 3 else 1.0 / a


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
