r"""Numbers of a section along a line, known at stations: polynomials through `degree` + 1 of them
in turn,

    f(x) = sum_k L_k(x) f_k,    L_k(x) = prod_{m != k} (x - x_m) / (x_k - x_m)                                                (1)

of a line whose section changes from one given section to the next. Between two of them the stations
are Chebyshev's, at (1 - cos(pi j / d)) / 2, where polynomials converge exponentially: a degree is
taken when that of half of it is right to `NEAR`, and it is right to about the square of that.

L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM 2013,
doi:10.1137/1.9781611975949, ch. 8.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from ..core.errors import InputError, say
from ..shapes.table import Floats
from .sections import Section

DEGREES = (1, 2, 4, 8, 16, 32)
NEAR = 1e-3  #: a rectangle that tapers to a tenth of its height: 4.8e-3 with degree 4, 9.9e-5 with 8, 2.5e-7 with 16


def choose(
    section: Section, numbers: Callable[[Section], Floats]
) -> tuple[Floats, list[Section], int]:
    """Fractions (k,) of the length, the sections there, and the degree; one station of a section
    that does not change.

    `numbers` gives a symmetric matrix (n, n) of a section, whose entries have the size of the root
    of both diagonals. InputError where even the highest degree does not give them in between.
    """
    given = section.stations
    if not given:
        return np.zeros(1), [section], 0
    known = dict[float, Floats]()

    def fractions(degree: int) -> list[float]:
        steps = 0.5 - 0.5 * np.cos(np.pi * np.arange(degree) / degree)
        found = [float(a + s * (b - a)) for a, b in itertools.pairwise(given) for s in steps] + [
            given[-1]
        ]
        known.update({x: numbers(section.at(x)) for x in found if x not in known})
        return found

    for degree, finer in itertools.pairwise(DEGREES):
        stations, between = fractions(degree), fractions(finer)
        found = np.tensordot(
            shares(np.array(stations), degree, np.array(between)),
            np.stack([known[x] for x in stations]),
            1,
        )
        exact = np.stack([known[x] for x in between])
        size = np.sqrt(np.abs(np.diagonal(exact, axis1=1, axis2=2)).max(axis=0))
        if np.all(np.abs(found - exact) <= NEAR * np.outer(size, size)):
            return np.array(between), [section.at(x) for x in between], finer
    remedy = "give more sections in between"
    raise InputError(
        say(
            "section.sections",
            "sections that change smoothly in between",
            "numbers that leap",
            remedy,
        )
    )


def shares(stations: Floats, degree: int, x: Floats) -> Floats:
    """L (..., k) of (1) at places x (...); beyond the stations those of the nearest."""
    if degree == 0:
        return np.ones((*np.shape(x), 1))
    at = np.clip(np.ravel(x), stations[0], stations[-1])
    piece = np.clip(
        np.searchsorted(stations[::degree], at, side="right") - 1,
        0,
        (len(stations) - 1) // degree - 1,
    )
    near = piece[:, None] * degree + np.arange(degree + 1)
    ends = stations[near]
    found = np.zeros((len(at), len(stations)))
    for k in range(degree + 1):
        others = np.delete(ends, k, axis=1)
        found[np.arange(len(at)), near[:, k]] = np.prod(
            (at[:, None] - others) / (ends[:, [k]] - others), axis=1
        )
    return found.reshape(*np.shape(x), len(stations))
