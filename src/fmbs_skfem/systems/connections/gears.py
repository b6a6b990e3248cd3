r"""Gears as constraint functions by a law: angles of arms w = y_0 + i y_1 in fixed ratios, of two
wheels, or of two and a carrier.

    phi = sum_k p_k arg w_k,     phi' = sum_k p_k Im(w'/w),     phi'' = sum_k p_k Im(w''/w - (w'/w)^2)

reduced to its remainder nearest to zero in units of the last number, the turn of a tooth. An angle
is the imaginary part of log w, so that all its derivatives are those of the logarithm: 1/w and i/w
by the two rows of an arm, -1/w^2, -i/w^2 and 1/w^2 by pairs of them, and by time what
`kernels.drift` adds.
"""

from __future__ import annotations

import math
from typing import Any

from ...core.compiling.angles import remainder
from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ..evaluation import evaluation
from .constraint_laws import ConstraintLaw, ConstraintRecord, ConstraintRoutines, opened

WHEELS = (2, 3)  #: numbers of arms


@jit
def arm(rows: Any, F: ConstraintRecord, k: int, wheel: int) -> complex:
    """Rows (j,), or their rates, of the arm of a wheel of gear k as a complex number."""
    return complex(rows[F.rows[k, 2 * wheel]], rows[F.rows[k, 2 * wheel + 1]])


@jit
def inverse(w: complex) -> complex:
    """1 / w of a complex number w that is not zero."""
    return w.conjugate() / (w.real * w.real + w.imag * w.imag)


@routine
def constrain(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    last = F.numbers.shape[1] - 1
    for k in range(len(F.rows)):
        angle = 0.0
        for wheel in range(last):
            p = F.numbers[k, wheel]
            w = arm(s.y, F, k, wheel)
            angle += p * math.atan2(w.imag, w.real)
            s.Jy[F.row[k], F.rows[k, 2 * wheel]] += p * inverse(w).imag
            s.Jy[F.row[k], F.rows[k, 2 * wheel + 1]] += p * inverse(w).real
        gap[F.row[k]] += remainder(angle, F.numbers[k, last])
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    place = F.pair
    for k in range(len(F.rows)):
        for wheel in range(F.numbers.shape[1] - 1):
            q = s.multipliers[F.row[k]] * F.numbers[k, wheel] * inverse(arm(s.y, F, k, wheel)) ** 2
            s.H[place] -= q.imag
            s.H[place + 1] -= q.real
            s.H[place + 2] -= q.real
            s.H[place + 3] += q.imag
            place += 4
    return 0


@routine
def drift(table: Any, record: Any) -> int:
    s = evaluation(table).space
    F = opened(record)
    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]
    second = s.leads[0]
    third = s.leads[1]
    for k in range(len(F.rows)):
        for wheel in range(F.numbers.shape[1] - 1):
            i = inverse(arm(s.paths[0], F, k, wheel))
            z, v, a = (
                i * arm(s.paths[1], F, k, wheel),
                i * arm(s.paths[2], F, k, wheel),
                i * arm(s.paths[3], F, k, wheel),
            )
            found = z - second * v * v + third * (2.0 * v * v * v - 3.0 * v * a)
            gap[F.row[k]] += F.numbers[k, wheel] * found.imag
    return 0


def gear(wheels: int) -> ConstraintLaw:
    """The law `gear_N` of a number N of wheels: 2 N probe rows, N ratios and the turn of a tooth
    [rad] as numbers.
    """
    pairs = [
        (2 * wheel + i, 2 * wheel + j)
        for wheel in range(wheels)
        for i in range(2)
        for j in range(2)
    ]
    return ConstraintLaw(
        f"gear_{wheels}",
        2 * wheels,
        wheels + 1,
        0,
        tuple(pairs),
        ConstraintRoutines(constrain, slopes, drift),
    )


LAWS = {law.name: law for law in map(gear, WHEELS)}
