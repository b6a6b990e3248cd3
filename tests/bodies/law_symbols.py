"""Energies of the laws of this package in symbols, as `bodies` has them in compiled code.

The cable is that of `bodies.cable_law`, whose docstring has its equations, the membrane that of
`bodies.membrane_law`, the shell that of `bodies.shell_law`.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import sympy

from fmbs_skfem.bodies.cable_law import NEXT_TO_NOTHING, SMALL, STRAIGHT
from fmbs_skfem.bodies.laws import CABLE, Law
from fmbs_skfem.bodies.symbolic import LawSymbols, Vectors, quadratic_dissipation, rate
from fmbs_skfem.core.compiling.symbols import Expression


def stretch(r: Vectors) -> Expression:
    """Axial strain of a line [-].

        eps = (r'.r' - 1)/2

    of r = (r', r'') in symbols.
    """
    return (r[0].dot(r[0]) - 1) / 2


def planar_strains(n: int, r: Vectors, *_: Any) -> list[Expression]:
    """Axial strain and the curvature with its sign.

        (r'.r' - 1)/2,    r' x r'' / |r'|^n

    of r = (r', r'') in symbols.
    """
    return [
        stretch(r),
        (r[0][0] * r[1][1] - r[0][1] * r[1][0]) * r[0].dot(r[0]) ** sympy.Rational(-n, 2),
    ]


def planar_energy(
    n: int, r: Vectors, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    eps, kappa = planar_strains(n, r)
    return EA / 2 * eps**2 + EI / 2 * (kappa - kappa0) ** 2


def square_of_curvature(n: int, r: Vectors) -> Expression:
    """Square of the curvature of a line.

        H = |r' x r''|^2 / |r'|^(2 n)    or    r''.r''

    the latter of the quadratic curvature (n = 0).
    """
    a, b = r
    across = a.dot(a) * b.dot(b) - a.dot(b) ** 2
    return (
        b.dot(b)
        if n == 0
        else (a.cross(b).dot(a.cross(b)) if len(a) == 3 else across) / a.dot(a) ** n
    )


def spatial_energy(
    n: int, r: Vectors, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    """Energy of a line in space, per length.

        EA/2 eps^2 + EI/2 (kappa - kappa0)^2,    kappa^2 = H

    kappa is kept from nothing, where its derivative is none.
    """
    H = square_of_curvature(n, r)
    axial = EA / 2 * stretch(r) ** 2
    if kappa0 == 0:
        return axial + EI / 2 * H
    kappa = sympy.sqrt(H + (SMALL * kappa0) ** 2 + NEXT_TO_NOTHING)
    return axial + EI / 2 * (H - 2 * kappa0 * kappa + kappa0**2)


def spatial_dissipation(
    n: int, r: Vectors, v: Vectors, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    """Dissipation of a line in space, half of the power at a damping time of 1 s.

        R = EA/2 eps'^2 + EI/2 ((k . k')^2 + s^2 k'.k') / (kappa^2 + s^2)

    with the rate k' of the curvature vector k, and s of `cable_law`.
    """
    k = r[1] if n == 0 else r[0].cross(r[1]) * r[0].dot(r[0]) ** sympy.Rational(-n, 2)
    straight = STRAIGHT * EA / EI
    dk = sympy.Matrix([rate(one, r, v) for one in k])
    return EA / 2 * rate(stretch(r), r, v) ** 2 + EI / 2 * (
        k.dot(dk) ** 2 + straight * dk.dot(dk)
    ) / (k.dot(k) + straight)


def hooke(A: Expression, nu: Expression) -> list[list[Expression]]:
    """Stiffness of plane stress for e11, e22, e12 = e21.

        [[A, A nu, 0], [A nu, A, 0], [0, 0, 2 A (1 - nu)]]

    in symbols.
    """
    return [[A, A * nu, 0], [A * nu, A, 0], [0, 0, 2 * A * (1 - nu)]]


def half_square(e: list[Expression], C: list[list[Expression]]) -> Expression:
    """Energy of strains e with the stiffness C.

        e^T C e / 2

    in symbols.
    """
    v = sympy.Matrix(e)
    return (v.T * sympy.Matrix(C) * v)[0] / 2


def membrane_strains(r: Vectors, *_: Any) -> list[Expression]:
    """Strains of a membrane.

        E_ab = (r,a.r,b - delta_ab)/2

    as 11, 22, 12.
    """
    a, b = r[:2]
    return [(a.dot(a) - 1) / 2, (b.dot(b) - 1) / 2, a.dot(b) / 2]


def membrane_energy(r: Vectors, A: Expression, nu: Expression) -> Expression:
    return half_square(membrane_strains(r), hooke(A, nu))


def shell_strains(
    r: Vectors, A: Expression, B: Expression, nu: Expression, *b0: Expression
) -> list[Expression]:
    """Strains of a shell, and minus the changes of its curvatures.

        E_ab = (r,a.r,b - delta_ab)/2,    n.r,i - b0_i

    each as 11, 22, 12.
    """
    normal = r[0].cross(r[1])
    length = sympy.sqrt(normal.dot(normal))
    return [
        *membrane_strains(r),
        *(normal.dot(one) / length - own for one, own in zip(r[2:], b0, strict=True)),
    ]


def shell_stiffness(
    A: Expression, B: Expression, nu: Expression, *_: Expression
) -> list[list[Expression]]:
    return sympy.diag(sympy.Matrix(hooke(A, nu)), sympy.Matrix(hooke(B, nu))).tolist()


def shell_energy(r: Vectors, *section: Expression) -> Expression:
    return half_square(shell_strains(r, *section), shell_stiffness(*section))


def symbols_of(law: Law, dim: int) -> LawSymbols | None:
    """The energy and dissipation of a law of this package in `dim` components; None of one that has
    none here.
    """
    n = law.option
    if law.section == CABLE:
        names = CABLE[:-1]
        if dim == 2 and n > 0:
            strains = partial(planar_strains, n)
            return LawSymbols(
                2,
                names,
                partial(planar_energy, n),
                quadratic_dissipation(strains, lambda EA, EI, _: [[EA, 0], [0, EI]]),
            )
        return LawSymbols(2, names, partial(spatial_energy, n), partial(spatial_dissipation, n))
    if law is Law.MEMBRANE:
        return LawSymbols(
            2, ("A", "nu"), membrane_energy, quadratic_dissipation(membrane_strains, hooke)
        )
    if law is Law.SHELL:
        return LawSymbols(
            5, law.section[:-1], shell_energy, quadratic_dissipation(shell_strains, shell_stiffness)
        )
    return None
