r"""Exact hyper-reduction of planar membranes: the strain energy of all points as one polynomial of
the reduced coordinates.

    r,a = J_a x + o_a,   E_ab = (r,a . r,b - delta_ab)/2,   W = sum_p w A/2 (E11^2 + E22^2 + 2 nu E11 E22 + 2 (1 - nu) E12^2)

Strains are quadratic in x, so with z = (1, x) and the products y = (z_a z_b), a <= b, every point
contributes three squares:

    W = 1/2 sum_p |s_p . y|^2 = 1/2 y^T P y,    P = sum_p s_p s_p^T
    s = sqrt(w A (1 + nu)/2) (E11 + E22),   sqrt(w A (1 - nu)/2) (E11 - E22),   sqrt(2 w A (1 - nu)) E12

Entries of P that belong to the same monomial are added (terms.quartic). Nothing is sampled or
trained: forces agree with those of all points up to round-off, at a cost that depends on the number
of modes alone. W is proportional to E and t.

Rotations cancel between monomials, so that the round-off of a force is that of its largest
monomials, about 1e-16 A times the norm of the modes, however small the strains are: `floor`
estimates it. `Exact` is the hyper-reduction of a plan: at other parameters, energies that differ by
a factor are made once. Tensors of a polynomial energy: J. Barbic, D. L. James, ACM Trans. Graph. 24
(2005) 982-990, doi 10.1145/1073204.1073300.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
from scipy.linalg.blas import dsyrk

from ...bodies.laws import Law
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...systems.system import Elastic, System, multiply_out
from ...systems.terms import quartic
from ...systems.terms.points import Sampled
from ...systems.terms.quartic import Quartic
from .hyper_reduction import HyperReduction, Rule, TrainingRun, register
from .sampling import sampled_gather

BLOCK = 256  #: points whose strains are formed at once


@register
@dataclass(frozen=True)
class Exact(HyperReduction):
    """The exact polynomial of planar membranes: nothing is sampled or trained.

        W(x) = 1/2 y^T P y

    as in the module, at a cost of the number of modes alone. Its rule raises InputError for bodies
    of other laws, in space, or with stiffness damping.

    Source: Barbic and James 2005, doi 10.1145/1073204.1073300.
    """

    name: ClassVar[str] = "exact"
    label: ClassVar[str] = "exact"

    def train(self, runs: Sequence[TrainingRun]) -> Rule:
        return Rule(Polynomials().of)


class Polynomials:
    """Exact polynomials of reduced membranes; those whose energies differ by a factor are made
    once.

    `of` is the rule of `Exact`: at other values of Young's modulus or the thickness a known
    polynomial is multiplied by a number.
    """

    def __init__(self) -> None:
        self.known: list[tuple[tuple[Elastic, ...], System]] = []

    def of(self, system: System) -> System:
        """The reduced system with polynomials in place of its points."""
        system = multiply_out(system)
        for elastic, made in self.known:
            factors = {ratio(old, new) for old, new in zip(elastic, system.elastic, strict=True)}
            # another Young's modulus or thickness is a factor: no polynomial of r^4 / 24 numbers is
            # made anew
            if len(factors) == 1 and (factor := factors.pop()) is not None:
                scaled = (
                    part if factor == 1.0 else replace(part, gather=scale(part.gather, factor))
                    for part in made.elastic
                )
                return replace(system, elastic=tuple(scaled))
        made = exact(system)
        self.known.append((system.elastic, made))
        return made


def ratio(old: Elastic, new: Elastic) -> float | None:
    """Factor between the energies of one sampled membrane at two parameters, None where there is
    none.
    """
    a, b = sampled_gather(old), sampled_gather(new)
    same = (
        np.array_equal(a.rows, b.rows)
        and np.array_equal(a.offset, b.offset)
        and np.array_equal(a.section[1], b.section[1])
    )
    before, now = (gather.section[0] * gather.section[-1] for gather in (a, b))
    factors = now / before
    middle = float(np.median(factors))
    return middle if same and np.abs(factors - middle).max() <= 1e-14 * abs(middle) else None


def exact(system: System) -> System:
    """The reduced system with the strain energy of its planar membranes as polynomials of the
    modes: no point is evaluated.

    Bodies that share their unknowns share one polynomial, the sum of theirs. InputError names a
    body whose energy is no quartic polynomial: another law, damping in proportion to stiffness, or
    three coordinates.
    """
    found: dict[tuple[int, int], Elastic] = {}
    for elastic in multiply_out(system).elastic:
        energy = build(sampled_gather(elastic), elastic.beta, elastic.name)
        span = (energy.columns.start, energy.columns.stop)
        if span in found:
            energy.coefficients[:] += found[span].gather.coefficients
            elastic = replace(elastic, name=f"{found[span].name}+{elastic.name}")
        found[span] = replace(elastic, gather=energy)
    return replace(system, elastic=tuple(found.values()))


def possible(system: System) -> bool:
    """Whether every elastic body is a planar membrane without stiffness damping, so that `exact` is
    possible.

    False for a system without elastic bodies, and in space.
    """
    planar = system.dim == 2 and len(system.elastic) > 0
    return planar and all(
        elastic.gather.law is Law.MEMBRANE and elastic.beta == 0.0 for elastic in system.elastic
    )


def build(sampled: Sampled, beta: float = 0.0, name: str = "membrane") -> Quartic:
    """The polynomial of all points of a reduced planar membrane; `name` is the body's in messages,
    `beta` its damping time [s].
    """
    check(sampled, beta, name)
    return Quartic(fold(energy_matrix(sampled)), sampled.columns)


def check(sampled: Sampled, beta: float, name: str) -> None:
    """Only elastic membranes with two coordinates have a quartic energy."""
    where = f"exact polynomial of body '{name}'"
    if sampled.law is not Law.MEMBRANE:
        raise InputError(
            say(where, "the planar membrane law", f"the law {sampled.law.name}", "take ECSW")
        )
    if beta > 0.0:
        raise InputError(
            say(
                where,
                "no stiffness-proportional damping",
                f"beta = {beta:.3g} s",
                "take ECSW, or beta = 0",
            )
        )
    if len(sampled.offset) != 4 * sampled.section.shape[2]:
        got = f"{len(sampled.offset)} for {sampled.section.shape[2]} points"
        raise InputError(say(where, "4 rows a point", got, "spatial membranes have 6"))
    if (
        np.abs(sampled.section[1]).max() >= 1.0
        or min(sampled.section[0].min(), sampled.section[2].min()) < 0.0
    ):
        remedy = "check material and quadrature"
        raise InputError(
            say(where, "|nu| < 1, stiffness and weights not negative", "others", remedy)
        )


def energy_matrix(sampled: Sampled) -> np.ndarray:
    """The lower triangle of P (m, m) of all points.

        P = sum_p s_p s_p^T

    Blocks of points are summed with compensation, so that P is as good as one block.
    """
    points = sampled.section.shape[2]
    fields = np.concatenate([sampled.offset[:, None], sampled.rows], axis=1).reshape(4, points, -1)
    size = fields.shape[2]
    P = np.zeros((size * (size + 1) // 2,) * 2, order="F")
    lost = np.zeros_like(P)
    # blocks of points as products of matrices; sums of many lose digits, which are carried on
    # beside them
    for first in range(0, points, BLOCK):
        part = slice(first, first + BLOCK)
        lost = dsyrk(
            1.0,
            strain_rows(fields[:, part], sampled.section[:, 0, part]).T,
            beta=-1.0,
            c=lost,
            lower=1,
            overwrite_c=1,
        )
        total = P + lost
        lost = (total - P) - lost
        P = total
    return P


def strain_rows(fields: np.ndarray, section: np.ndarray) -> np.ndarray:
    """The three rows s of every point (3 p, m), by which its energy is half the sum of their
    squares.

        sqrt(w A (1 + nu) / 2) (E11 + E22),  sqrt(w A (1 - nu) / 2) (E11 - E22),  sqrt(2 w A (1 - nu)) E12

    from z -> r,1x r,1y r,2x r,2y (4, p, n) and A, nu, weight w (3, p).
    """
    a, b = pairs(fields.shape[2])
    half = np.where(a == b, 0.5, 1.0)

    def product(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(u z)(v z)/2 as a row in y."""
        return half * 0.5 * (u[:, a] * v[:, b] + u[:, b] * v[:, a])

    x1, y1, x2, y2 = fields
    E11, E22, E12 = (
        product(x1, x1) + product(y1, y1),
        product(x2, x2) + product(y2, y2),
        product(x1, x2) + product(y1, y2),
    )
    E11[:, 0] -= 0.5
    E22[:, 0] -= 0.5
    A, nu, weight = section
    scale = weight * A
    return np.concatenate(
        [
            np.sqrt(0.5 * scale * (1.0 + nu))[:, None] * (E11 + E22),
            np.sqrt(0.5 * scale * (1.0 - nu))[:, None] * (E11 - E22),
            np.sqrt(2.0 * scale * (1.0 - nu))[:, None] * E12,
        ]
    )


def pairs(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices a <= b of the products y (m,) of z (size,)."""
    b, a = np.tril_indices(size)
    return a, b


def fold(P: np.ndarray) -> np.ndarray:
    """Coefficients (t,) of the monomials of an energy, from the lower triangle of P (m, m).

        y^T P y / 2

    in the order of `starts`.
    """
    size = (int(np.sqrt(8 * len(P) + 1)) - 1) // 2
    a, b = pairs(size)
    place = starts(size)
    out = quartic.aligned(quartic.length(size - 1))
    for k in range(len(P)):
        one = np.broadcast_to([[a[k]], [b[k]]], (2, k + 1))
        i0, i1, c, d = np.sort(np.concatenate([one, [a[: k + 1], b[: k + 1]]]), axis=0)
        values = P[k, : k + 1].copy()
        values[k] *= 0.5
        np.add.at(out, place[c, d] + i1 * (i1 + 1) // 2 + i0, values)
    return out


def starts(size: int) -> np.ndarray:
    """Where the row (c, d) of the coefficients starts, (size, size) for c <= d."""
    width = [int(quartic.padded((c + 1) * (c + 2) // 2)) for c in range(size)]
    first = np.concatenate([[0], np.cumsum([(size - c) * width[c] for c in range(size)])])
    return np.array([[first[c] + (d - c) * width[c] for d in range(size)] for c in range(size)])


def scale(polynomial: Quartic, factor: float) -> Quartic:
    """The polynomial of another Young's modulus or thickness: energies and forces times `factor`."""
    out = quartic.aligned(len(polynomial.coefficients))
    out[:] = factor * polynomial.coefficients
    return replace(polynomial, coefficients=out)
