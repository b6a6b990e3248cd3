r"""Energies of the laws of cables, membranes and shells, of which `symbolic` makes the loops in
`law_loops.py`.

    python -m fmbs_skfem.bodies.law_symbols          writes them anew

Per length of a line, whose equations are in `cable_law`:

    W = EA/2 eps^2 + EI/2 (kappa - kappa0)^2

Of a planar beam with shear, a director d along it, Jd across, and C between N, V and M:

    W = 1/2 sum_kl C_kl e_k e_l + E/8 (d.d - 1)^2,   e = (d.r', Jd.r', Jd.d')    less their values in the reference

Per area of a surface r(s1, s2) whose reference tangents r0,1 r0,2 are orthonormal at the point,
St. Venant-Kirchhoff in plane stress, where a membrane in its own plane has no B, and a
Kirchhoff-Love shell bends by its exact unit normal n:

    W = A/2 E:C:E + B/2 k:C:k,   e:C:e = e11^2 + e22^2 + 2 nu e11 e22 + 2 (1 - nu) e12^2
    E_ab = (r,a.r,b - delta_ab)/2,   k_ab = -(b_ab - b0_ab),   b_ab = n.r,ab,   n = r,1 x r,2 / |r,1 x r,2|
    A = E t/(1 - nu^2),   B = E t^3/(12 (1 - nu^2))

Stiffness-proportional damping is of Kelvin-Voigt type: forces and moments belong to E + beta dE/dt
and k + beta dk/dt, so that rigid motions are not damped.

Arrays of a surface: gradients `u` (k c, p, e) hold r,1 r,2 and of a shell r,11 r,22 r,12 (c rows
each) at point p of cell e, `S` = dW/du the same, `D` = d2W/du2 (k c, k c, p, e); `section` (i, p, e)
holds A [N/m], of a shell B [N m], nu [-], of a shell b0_11, b0_22, b0_12 [1/m], and the weight [m2]
of each point.

Source (the energy of surfaces): Kiendl, Bletzinger, Linhard and Wuechner, Comput. Methods Appl. Mech.
Engrg. 198 (2009) 3902-3914, doi 10.1016/j.cma.2009.08.013.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import sympy

from ..core.compiling.symbols import Expression
from . import symbolic
from .cable_law import NEXT_TO_NOTHING, SMALL, STRAIGHT
from .laws import Law
from .symbolic import LawSymbols, Vectors

Strains = Sequence[Expression]
Keep = Callable[[Any], Any]  #: see `symbolic.DerivativeChain.keep`

N = sympy.Symbol("n")  #: 3 of the exact curvature, 2 of the material one
LOOPS = Path(__file__).with_name("law_loops.py")


class fall(sympy.Function):
    """a^(-n/2), see `cable_law.fall`."""

    def fdiff(self, argindex: int = 1) -> Expression:
        a, n = self.args
        return -n / 2 * fall(a, n) / a

    def _pythoncode(self, printer: Any) -> str:
        return f"fall({', '.join(map(printer.doprint, self.args))})"


def stretch(r: Vectors) -> Expression:
    """eps = (r'.r' - 1) / 2."""
    return (r[0].dot(r[0]) - 1) / 2


def planar_strains(keep: Keep, r: Vectors, *_: Expression) -> Strains:
    """eps, and the curvature with its sign, (r' x r'')_z / |r'|^n."""
    across = r[0][0] * r[1][1] - r[0][1] * r[1][0]
    return keep([stretch(r), across * fall(r[0].dot(r[0]), N)])


def planar_energy(e: Strains, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    return EA / 2 * e[0] ** 2 + EI / 2 * (e[1] - kappa0) ** 2


def planar_dissipation(
    e: Strains, rates: Strains, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    return EA / 2 * rates[0] ** 2 + EI / 2 * rates[1] ** 2


def bending(H: Expression, EI: Expression, kappa0: Expression) -> Expression:
    """EI (kappa - kappa0)^2 / 2 of H = kappa^2, in which it is smooth where a line is straight."""
    # the root is never zero: its derivative would be none
    kappa = sympy.sqrt(H + (SMALL * kappa0) ** 2 + NEXT_TO_NOTHING)
    return EI / 2 * (H - 2 * kappa0 * kappa + kappa0**2)


def vector_energy(e: Strains, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    """Of eps and the vector k of the curvature."""
    return EA / 2 * e[0] ** 2 + bending(square(e[1:]), EI, kappa0)


def damping_of_bending(
    H: Expression, along: Expression, rates: Expression, EA: Expression, EI: Expression
) -> Expression:
    """EI/2 ((k.k')^2 + s^2 k'.k') / (kappa^2 + s^2), of k.k' and k'.k'."""
    straight = STRAIGHT * EA / EI
    return EI / 2 * (along**2 + straight * rates) / (H + straight)


def square(vector: Strains) -> Expression:
    return sum(one * one for one in vector)


def quadratic_strains(keep: Keep, r: Vectors, *_: Expression) -> Strains:
    """eps and k = r''."""
    return keep([stretch(r), *r[1]])


def quadratic_dissipation(
    e: Strains, rates: Strains, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    k, of_k = e[1:], rates[1:]
    along = sum(one * rate for one, rate in zip(k, of_k, strict=True))
    return EA / 2 * rates[0] ** 2 + damping_of_bending(square(k), along, square(of_k), EA, EI)


def vector_strains(keep: Keep, r: Vectors, *_: Expression) -> Strains:
    """eps and k = r' x r'' / |r'|^n."""
    return keep([stretch(r), *(fall(r[0].dot(r[0]), N) * r[0].cross(r[1]))])


def spatial_strains(keep: Keep, r: Vectors, *_: Expression) -> Strains:
    """eps, p = |r'|^-n, X = c.c and c = r' x r'', of which k = p c."""
    # of k itself a modulus takes 1.2 times as long: dk/du has twice as many numbers as dc/du
    p = keep(fall(keep(r[0].dot(r[0])), N))
    c = keep(r[0].cross(r[1]))
    return [keep(stretch(r)), p, keep(square(c)), *c]


def spatial_energy(e: Strains, EA: Expression, EI: Expression, kappa0: Expression) -> Expression:
    eps, p, X = e[:3]
    return EA / 2 * eps**2 + bending(p * p * X, EI, kappa0)


def spatial_dissipation(
    e: Strains, rates: Strains, EA: Expression, EI: Expression, kappa0: Expression
) -> Expression:
    """With k' = p' c + p c', of which c.c' = X'/2."""
    p, X = e[1:3]
    of_eps, of_p, of_X, *of_c = rates
    along = p * of_p * X + p * p * of_X / 2
    rate = of_p**2 * X + p * of_p * of_X + p * p * square(of_c)
    return EA / 2 * of_eps**2 + damping_of_bending(p * p * X, along, rate, EA, EI)


def plane_stress(A: Expression, nu: Expression, e: Strains, share: Expression) -> Expression:
    """A/2 e:C:e of e11, e22 and a shear with its share of the stiffness A."""
    return A / 2 * (e[0] ** 2 + e[1] ** 2 + 2 * nu * e[0] * e[1] + share * e[2] ** 2)


def membrane_strains(keep: Keep, r: Vectors, A: Expression, nu: Expression) -> Strains:
    """E11, E22, 2 E12, and the share (1 - nu) / 2 of the last one."""
    a, b = r[:2]
    # the share by a name of its own: shells in a plane round as membranes do
    return keep([(a.dot(a) - 1) / 2, (b.dot(b) - 1) / 2, a.dot(b), (1 - nu) / 2])


def membrane_energy(e: Strains, A: Expression, nu: Expression) -> Expression:
    return plane_stress(A, nu, e, e[3])


def membrane_dissipation(e: Strains, rates: Strains, A: Expression, nu: Expression) -> Expression:
    return plane_stress(A, nu, rates, e[3])


def shell_strains(
    keep: Keep, r: Vectors, A: Expression, B: Expression, nu: Expression, *b0: Expression
) -> Strains:
    """Those of a membrane, and b_i - b0_i as 11, 22, 12."""
    across = keep(r[0].cross(r[1]))
    inverse = keep(1 / sympy.sqrt(square(across)))
    n = sympy.Matrix(keep([inverse * one for one in across]))
    change = [n.dot(one) - own for one, own in zip(r[2:], b0, strict=True)]
    return [*membrane_strains(keep, r, A, nu), *keep(change)]


def shell_energy(
    e: Strains, A: Expression, B: Expression, nu: Expression, *b0: Expression
) -> Expression:
    return plane_stress(A, nu, e, e[3]) + plane_stress(B, nu, e[4:], 4 * e[3])


def shell_dissipation(
    e: Strains, rates: Strains, A: Expression, B: Expression, nu: Expression, *b0: Expression
) -> Expression:
    return plane_stress(A, nu, rates, e[3]) + plane_stress(B, nu, rates[4:], 4 * e[3])


def beam_strains(keep: Keep, r: Vectors, *section: Expression) -> Strains:
    """Gamma_1 = d . r', Gamma_2 = Jd . r', kappa = Jd . d' and d . d, less those of the reference,
    of r, d, r' and d'.
    """
    _, d, slope, turn = r
    J = sympy.Matrix([-d[1], d[0]])
    measures = (d.dot(slope), J.dot(slope), J.dot(turn), d.dot(d))
    return keep([one - own for one, own in zip(measures, section[7:], strict=True)])


def quadratic_form(e: Strains, *section: Expression) -> Expression:
    """1/2 sum_kl C_kl e_k e_l + E/8 e_4^2 of three strains, and of d . d that E holds."""
    (a, b, c, last), (C11, C12, C13, C22, C23, C33, E) = e, section[:7]
    coupled = C12 * a * b + C13 * a * c + C23 * b * c
    return (C11 * a**2 + C22 * b**2 + C33 * c**2) / 2 + coupled + E / 8 * last**2


def beam_dissipation(e: Strains, rates: Strains, *section: Expression) -> Expression:
    return quadratic_form(rates, *section)


LINE = Law.EXACT.section[:-1]
VECTOR = LawSymbols(2, LINE, vector_energy, strains=vector_strains, held=1)
SPATIAL = LawSymbols(
    2, LINE, spatial_energy, spatial_dissipation, spatial_strains, 1, bending=VECTOR
)
PLANAR = LawSymbols(2, LINE, planar_energy, planar_dissipation, planar_strains, 1)
QUADRATIC = LawSymbols(2, LINE, vector_energy, quadratic_dissipation, quadratic_strains, 1)
MEMBRANE = LawSymbols(
    2,
    Law.MEMBRANE.section[:-1],
    membrane_energy,
    membrane_dissipation,
    membrane_strains,
    3,
    plane=True,
)
SHELL = LawSymbols(5, Law.SHELL.section[:-1], shell_energy, shell_dissipation, shell_strains, 3)
BEAM = LawSymbols(
    4, Law.PLANAR_BEAM.section[:-1], quadratic_form, beam_dissipation, beam_strains, 4
)
#: laws and numbers of components by the first words of their loops, see `laws.compiled`
KNOWN = {
    "quadratic_2_": (QUADRATIC, 2),
    "quadratic_3_": (QUADRATIC, 3),
    "curved_2_": (PLANAR, 2),
    "curved_3_": (SPATIAL, 3),
    "membrane_": (MEMBRANE, 2),
    "shell_": (SHELL, 3),
    "planar_beam_": (BEAM, 2),
}


def text() -> str:
    """The text of `law_loops.py`."""
    parts = dict[str, str]()
    for word, (law, dim) in KNOWN.items():
        parts |= symbolic.loops(law, dim, word)
    return symbolic.source(
        "Loops of the laws of cables, membranes, shells and planar beams, which `python -m fmbs_skfem.bodies.law_symbols` writes.",
        parts,
        ["from fmbs_skfem.bodies.cable_law import fall"],
    )


if __name__ == "__main__":
    LOOPS.write_text(text(), encoding="utf-8")
