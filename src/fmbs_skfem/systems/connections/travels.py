r"""Travel in proportion to a turn, of a screw in its nut or of a rack by its pinion, as a
constraint function by a law.

    phi = n . d - l - p arg w,    w = u . e_1 + i u . e_2                                                              (1)

u turns with one body; n, e_1 and e_2, and the place from which d counts, are of the other one or of
the ground. phi is reduced to its remainder nearest to zero in units of 2 pi p, the travel of a
whole turn, so that turns need no counting. Derivatives are those of the logarithm of w, as in
`gears`, and of products of rows.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.compiling.angles import remainder
from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ..evaluation import evaluation
from .constraint_laws import ConstraintLaw, ConstraintRecord, ConstraintRoutines, opened
from .gears import inverse

WORD = "travel"
#: vectors of a law, one behind the other, and their number
D, N, U, FIRST, SECOND, VECTORS = range(6)


@jit
def product(a: np.ndarray, b: np.ndarray, F: ConstraintRecord, k: int, i: int, j: int) -> float:
    """Product of two vectors i and j of row k.

        a_i . b_j

    whose components stand in a and b.
    """
    dim = F.rows.shape[1] // VECTORS
    total = 0.0
    for c in range(dim):
        total += a[F.rows[k, i * dim + c]] * b[F.rows[k, j * dim + c]]
    return total


@jit
def arm(a: np.ndarray, b: np.ndarray, F: ConstraintRecord, k: int) -> complex:
    """The direction u of a place a in axes e of another one, as a complex number.

        w = u . e_1 + i u . e_2

    of 3 c components a and b.
    """
    return complex(product(a, b, F, k, U, FIRST), product(a, b, F, k, U, SECOND))


@jit
def slope(y: np.ndarray, F: ConstraintRecord, k: int, part: int) -> complex:
    """Derivative of `arm` by one of its 3 c components.

        dw/dy

    by the component `part` of u, e_1, e_2.
    """
    dim = F.rows.shape[1] // VECTORS
    which = part // dim
    c = part % dim
    u = y[F.rows[k, U * dim + c]]
    if which == 0:
        return complex(y[F.rows[k, FIRST * dim + c]], y[F.rows[k, SECOND * dim + c]])
    return complex(u, 0.0) if which == 1 else complex(0.0, u)


@routine
def constrain(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    dim = F.rows.shape[1] // VECTORS
    for k in range(len(F.rows)):
        row = F.row[k]
        p = F.numbers[k, 1]
        w = arm(s.y, s.y, F, k)
        travel = product(s.y, s.y, F, k, N, D) - F.numbers[k, 0]
        gap[row] += remainder(travel - p * math.atan2(w.imag, w.real), 2.0 * np.pi * p)
        for c in range(dim):
            s.Jy[row, F.rows[k, D * dim + c]] += s.y[F.rows[k, N * dim + c]]
            s.Jy[row, F.rows[k, N * dim + c]] += s.y[F.rows[k, D * dim + c]]
        for part in range(3 * dim):
            s.Jy[row, F.rows[k, U * dim + part]] -= p * (slope(s.y, F, k, part) * inverse(w)).imag
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    dim = F.rows.shape[1] // VECTORS
    place = F.pair
    for k in range(len(F.rows)):
        q = s.multipliers[F.row[k]]
        p = F.numbers[k, 1]
        i = inverse(arm(s.y, s.y, F, k))
        for _ in range(2 * dim):
            s.H[place] += q
            place += 1
        for a in range(3 * dim):
            for b in range(3 * dim):
                found = -slope(s.y, F, k, a) * slope(s.y, F, k, b) * i * i
                # u beside the same component of e_1 or e_2, whichever comes first
                if a != b and a % dim == b % dim and min(a, b) < dim:
                    found += i if max(a, b) < 2 * dim else complex(0.0, 1.0) * i
                s.H[place] -= q * p * found.imag
                place += 1
    return 0


@routine
def drift(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    y = s.paths[0]
    z = s.paths[1]
    v = s.paths[2]
    a = s.paths[3]
    for k in range(len(F.rows)):
        p = F.numbers[k, 1]
        i = inverse(arm(y, y, F, k))
        lead, speed = (
            (arm(z, y, F, k) + arm(y, z, F, k)) * i,
            (arm(v, y, F, k) + arm(y, v, F, k)) * i,
        )
        twice, late = 2.0 * arm(v, v, F, k) * i, (arm(a, y, F, k) + arm(y, a, F, k)) * i
        mixed = 3.0 * (arm(a, v, F, k) + arm(v, a, F, k)) * i
        D2 = 2.0 * product(v, v, F, k, N, D) - p * (twice - speed * speed).imag
        D3 = 3.0 * (product(a, v, F, k, N, D) + product(v, a, F, k, N, D))
        D3 -= p * (mixed - 3.0 * speed * (late + twice) + 2.0 * speed * speed * speed).imag
        found = product(z, y, F, k, N, D) + product(y, z, F, k, N, D) - p * lead.imag
        gap[F.row[k]] += found + s.leads[0] * D2 + s.leads[1] * D3
    return 0


def travel(name: str) -> ConstraintLaw:
    """The law `travel|c` of c components: rows d, n, u, e_1, e_2 of (1), numbers l [m] and p
    [m/rad].
    """
    dim = int(name.partition("|")[2])
    pairs = [
        pair
        for c in range(dim)
        for pair in ((D * dim + c, N * dim + c), (N * dim + c, D * dim + c))
    ]
    pairs += [(U * dim + a, U * dim + b) for a in range(3 * dim) for b in range(3 * dim)]
    routines = ConstraintRoutines(constrain, slopes, drift)
    return ConstraintLaw(name, VECTORS * dim, 2, 0, tuple(pairs), routines, maker=travel)


ConstraintLaw.makers[WORD] = travel
