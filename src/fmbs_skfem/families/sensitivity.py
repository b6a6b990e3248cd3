r"""Sobol indices: which part of the variance of an output comes from which parameter.

    S_i  = V[E(y | p_i)] / V(y)  ~  mean(f(B) (f(A_B^i) - f(A))) / V              by p_i alone
    ST_i = E[V(y | p_~i)] / V(y) ~  mean((f(A) - f(A_B^i))^2) / (2 V)             by p_i with all others

A and B are independent samples (N, d) of the box, A_B^i is A with its column i from B: N (d + 2)
runs, which a reduced model makes cheap. Parameters are independent, and uniform in their range (in
its logarithm where its scale is that). Standard errors are those of resampled rows.

Sources: A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270, doi:10.1016/j.cpc.2009.09.018
(estimators, design); I. M. Sobol', Math. Comput. Simul. 55 (2001) 271-280,
doi:10.1016/S0378-4754(00)00270-6.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.ranges import Parameter
from ..reduction.parameters import check, check_count, from_box

ROUND = 1e-14  #: standard deviation that is round-off, over the size of the values
RESAMPLED = 200  #: sets of rows for standard errors
LEAST = 8  #: rows that are needed
LOST = 0.02  #: part of the rows from which they are missed: indices are off by about half of it where they stand together


@dataclass(frozen=True)
class SobolIndices:
    """Sobol indices of one output, with standard errors.

    S_i is the part of the variance that parameter i makes alone, ST_i that of all it takes part in.
    NaN where the output does not vary.

    Source: Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018.
    """

    first: np.ndarray  #: (d,) S_i
    total: np.ndarray  #: (d,) ST_i
    first_error: np.ndarray  #: (d,)
    total_error: np.ndarray  #: (d,)
    rows: int  #: of A, B and all A_B^i that ran


def design(parameters: Sequence[Parameter], count: int, seed: int = 0) -> np.ndarray:
    """Points (N (d + 2), d) of a scrambled Sobol sequence in 2 d, N = `count`, below each other.

        A, B, A_B^1, ..., A_B^d    A_B^i is A with the column i of B

    d parameters, values [SI] in their order. InputError for a count below 1.
    """
    from scipy.stats import qmc

    check(parameters)
    d = len(parameters)
    power = (check_count("saltelli", count) - 1).bit_length()
    both = qmc.Sobol(2 * d, scramble=True, rng=seed).random_base2(power)[:count]
    A, B = both[:, :d], both[:, d:]
    mixed = [np.where(np.arange(d) == i, B, A) for i in range(d)]
    return from_box(parameters, np.concatenate([A, B, *mixed]))


def indices(values: ArrayLike, dimensions: int, seed: int = 0, size: float = 0.0) -> SobolIndices:
    """Indices of an output whose values (N (d + 2),) are those of `design`; rows with a run that
    failed (NaN) are left out.

    NaN where the output does not vary but for round-off of its mean, or of a `size` in its unit
    that it is computed from, as from other components of a vector. A notice where more than a
    fiftieth of the rows is left out: failures stand together, and the indices are those of what is
    left of the box. InputError for another number of values, and for too few rows that ran.
    """
    given = np.asarray(values, dtype=float)
    if given.ndim != 1 or len(given) % (dimensions + 2) or not len(given):
        expected = f"a multiple of {dimensions + 2} values, those of the design"
        raise InputError(say("sensitivity.indices", expected, f"shape {given.shape}"))
    table = given.reshape(dimensions + 2, -1).T
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < LEAST:
        raise InputError(
            say(
                "sensitivity.indices",
                f"at least {LEAST} rows that ran",
                len(table),
                "take more samples",
            )
        )
    if (count := len(given) // (dimensions + 2)) - len(table) > LOST * count:
        lost = f"{count - len(table)} of {count} rows have samples that failed"
        notify(
            f"Sobol indices are those of the part of the ranges where samples ran: {lost}; narrow the ranges, or mend the samples"
        )
    random = np.random.default_rng(seed)
    picked = [
        estimate(table[random.integers(0, len(table), len(table))], size) for _ in range(RESAMPLED)
    ]
    first, total = estimate(table, size)
    errors = np.std(picked, axis=0)
    return SobolIndices(first, total, errors[0], errors[1], len(table))


def estimate(table: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Sobol indices (d,) of values (N, d + 2) in columns A, B, A_B^i, with the variance V of A and
    B.

        S_i = mean((B - m) (A_B^i - A)) / V,    ST_i = mean((A - A_B^i)^2) / (2 V)

    The mean m of A and B is subtracted, which takes noise from S_i.
    """
    a, b, mixed = table[:, 0], table[:, 1], table[:, 2:]
    both = table[:, :2]
    centre = both.mean()
    variance = both.var()
    if not variance > (ROUND * max(size, abs(centre))) ** 2:
        nothing = np.full(mixed.shape[1], np.nan)
        return nothing, nothing
    first = np.mean((b - centre)[:, None] * (mixed - a[:, None]), axis=0) / variance
    total = 0.5 * np.mean((a[:, None] - mixed) ** 2, axis=0) / variance
    return first, total
