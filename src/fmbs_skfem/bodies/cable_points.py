r"""Gauss points a cell that integrate the strain energy of a line.

    p - 1    on B-splines of degree p >= 5 that are as smooth as they can be, C^(p-1), where these hold every motion, see below
    p        on all others: of C1 cubics three points differ from exact integration by 6e-11 of the response

p - 1 points integrate the bending of straight cells exactly, a polynomial of degree 2 (p - 2) <= 2
(p - 1) - 1, and keep the order 2 (p - 1) of displacements and frequencies; p points a cell do no
more, as the axial strain energy, of degree 4 (p - 1), is exact with neither.

A straight line has no motions without energy beside rigid ones, where the points determine its
axial strain, which is a spline: by the theorem of Schoenberg and Whitney, where n cells with m
points each have as many points as that has functions,

    n m >= N - 1        of a line of N functions

C. de Boor, A Practical Guide to Splines, rev. ed., Springer 2001, ISBN 978-0387953663, ch. XIII.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError, say
from ..shapes import line, locking

#: Degree from which smooth splines take a point less. On 366 meshes and problems (frequencies,
#: elastica, slender arcs; 2 to 24 cells, even and uneven) errors of quintics are 0.92 of those with
#: five points in the mean; six exceed 1.2, to 1.9, where errors change sign. A step takes 5 to 13 %
#: less. Quartics keep four points: with three, errors grow by 1.4 to 2 where cells are fine. With
#: p/2 + 1 points motions of slender mechanisms are as good, but frequencies and stout beams are
#: not: of order p + 1 or p + 2, off by 10 to 100 times as much from 8 cells on.
LEAST = 5


def points_of(where: str, space: line.BSpline | line.Hermite, points: int | None = None) -> int:
    """Gauss points a cell of a line; InputError, with the place `where`, for given `points` that do
    not serve it.

    Those are points that leave motions without energy, and other than three where cubics lock, see
    `shapes.locking`.
    """
    cells = len(line.breaks(space)) - 1
    degree = degree_of(space)
    enough = -(-(space.count - 1) // cells)
    if points is None:
        return max(degree - 1, enough) if degree >= LEAST and line.is_smooth(space) else degree
    if not isinstance(points, int | np.integer) or points < enough:
        expected = f"a whole number of at least {enough} points a cell, as {cells} cells have {space.count} functions"
        raise InputError(
            say(where, expected, points, "leave it out; fewer leave motions without energy")
        )
    if locking.locks(space) and points != locking.POINTS:
        expected = f"{locking.POINTS} points a cell, with which smooth cubics do not lock"
        raise InputError(say(where, expected, points, "leave it out, or take continuity 1"))
    return int(points)


def degree_of(space: line.BSpline | line.Hermite) -> int:
    """Polynomial degree of a line."""
    return space.degree if isinstance(space, line.BSpline) else 3
