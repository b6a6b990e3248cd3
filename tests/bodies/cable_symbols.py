"""The cable of `bodies.cable_law` in symbols."""

from __future__ import annotations

from typing import Any

import sympy

from fmbs_skfem.bodies.cable_law import NEXT_TO_NOTHING, SMALL, STRAIGHT
from fmbs_skfem.bodies.symbolic import LawSymbols, Vectors, quadratic_dissipation, rate
from fmbs_skfem.core.compiling.symbols import Expression

OPTION = sympy.Symbol("option", integer=True)  #: n of |r'|^n in the curvature
SECTION = ("EA", "EI", "kappa0")


class fall(sympy.Function):
    """a^(-n/2)."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> Expression:
        a, n = self.args
        return -n / 2 * fall(a, n) / a


def stretch(r: Vectors) -> Expression:
    """eps = (r'.r' - 1)/2."""
    return (r[0].dot(r[0]) - 1) / 2


def planar_strains(r: Vectors, *_: Any) -> list[Expression]:
    """eps and the signed curvature r' x r'' / |r'|^n."""
    return [stretch(r), (r[0][0] * r[1][1] - r[0][1] * r[1][0]) * fall(r[0].dot(r[0]), OPTION)]


def stiffness(EA: Expression, EI: Expression, kappa0: Expression) -> list[list[Expression]]:
    return [[EA, 0], [0, EI]]


def planar_energy(r: Vectors, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    eps, kappa = planar_strains(r)
    return EA / 2 * eps**2 + EI / 2 * (kappa - kappa0) ** 2


def curvature_vector(r: Vectors) -> Expression:
    """k = r' x r'' / |r'|^n, or r'' itself for the polynomial."""
    return r[0].cross(r[1]) * fall(r[0].dot(r[0]), OPTION)


def bent(r: Vectors, H: Expression, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    """EA/2 eps^2 + EI/2 (kappa - kappa0)^2 with H = kappa^2; kappa is kept from nothing, where its derivative is none."""
    kappa = sympy.sqrt(H + (SMALL * kappa0) ** 2 + NEXT_TO_NOTHING)
    return EA / 2 * stretch(r) ** 2 + EI / 2 * (H - 2 * kappa0 * kappa + kappa0**2)


def spatial_energy(r: Vectors, *section: Expression) -> Expression:
    k = curvature_vector(r)
    return bent(r, k.dot(k), *section)


def quadratic_energy(r: Vectors, *section: Expression) -> Expression:
    return bent(r, r[1].dot(r[1]), *section)


def dissipation(k: Expression, r: Vectors, v: Vectors, EA: Expression, EI: Expression) -> Expression:
    """R with (k k' + s^2 I) / (kappa^2 + s^2) between the rates of the curvature vector k."""
    straight = STRAIGHT * EA / EI
    dk = sympy.Matrix([rate(one, r, v) for one in k])
    return EA / 2 * rate(stretch(r), r, v) ** 2 + EI / 2 * (k.dot(dk) ** 2 + straight * dk.dot(dk)) / (k.dot(k) + straight)


def spatial_dissipation(r: Vectors, v: Vectors, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    return dissipation(curvature_vector(r), r, v, EA, EI)


def quadratic_dissipation_of(r: Vectors, v: Vectors, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    return dissipation(r[1], r, v, EA, EI)


PLANAR = LawSymbols(2, SECTION, planar_energy, quadratic_dissipation(planar_strains, stiffness))
SPATIAL = LawSymbols(2, SECTION, spatial_energy, spatial_dissipation)
QUADRATIC = LawSymbols(2, SECTION, quadratic_energy, quadratic_dissipation_of)
