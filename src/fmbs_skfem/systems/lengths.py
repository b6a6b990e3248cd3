r"""Lengths that displacements, errors and tolerances are measured with.

    |u| = sqrt(u^T W u / w),   W = M + D,   w = 1^T M 1

The mass norm is the root mean square of the displacement over the mass [m]: the same on every mesh,
for every interpolation and wherever the origin is. D holds the coordinates without mass, such as
the axes of thin rigid parts: those of a body count together as an average body does that moves by
the length they stand for, which is 1 for positions, the size of the body for axes and slopes. Where
nothing has a mass, as in statics, all coordinates count so.

A mechanism far from the origin of its scene has coordinates from its own middle: differences of
large numbers would cost digits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..bodies.body import Body, positions

LIGHT = 1e-12  #: mass, relative to that of the heaviest coordinate, that counts as none
# up to there coordinates lose a digit and a half (log10 30) in differences; twice of it loses 0.3
# more
FAR = 30.0  #: distance of a mechanism from the origin of its scene, over its size, from which it counts from a point of its own
#: round-off of a position, relative to the largest coordinate
DIGITS = 8.0 * float(np.finfo(np.float64).eps)


def weight(parts: Sequence[Body]) -> float:
    """Mass w [kg] of all bodies, 1 where they have none.

        |u| = sqrt(u^T W u / w)

    in which it makes sizes [m] of displacements.
    """
    return sum(part.total_mass for part in parts) or 1.0


def metric(parts: Sequence[Body], mass: csr_array) -> csr_array:
    """Metric W (q, q), the mass M (q, q) itself where all coordinates have one [kg m2 per unit2].

        W = M + D

    D is the diagonal of `massless`; `parts` are the bodies whose coordinates q are, one behind the
    other.
    """
    added = massless(parts, mass)
    return csr_array(mass + diags_array(added)) if added.any() else mass


def massless(parts: Sequence[Body], mass: csr_array) -> np.ndarray:
    """Diagonal (q,) of D, zero for coordinates with mass [kg m2 per unit2]."""
    share = weight(parts) / len(parts)
    size = extent(parts)
    dim = parts[0].reference.shape[1]
    moved = [np.where(part.constant > 0.5, 1.0, length_of(part, size)) for part in parts]
    # masses [kg], of axes and slopes as of positions
    heavy = mass.diagonal()[::dim] / np.concatenate(moved) ** 2
    none = heavy <= LIGHT * heavy.max(initial=0.0)
    found = [np.zeros(0)]
    first = 0
    for part, length in zip(parts, moved, strict=True):
        mine = none[first : first + len(length)]
        first += len(length)
        own = np.where(
            mine, share / max(1, int((mine & (part.constant > 0.5)).sum())) * length**2, 0.0
        )
        found.append(np.repeat(own, dim))
    return np.concatenate(found)


def length_of(part: Body, size: float) -> float:
    """The length [m] that coordinates of a body which are no positions stand for: its size, or that
    of all; 1 of joints' own.
    """
    return (spread(positions(part)) or size) if part.constant.any() else 1.0


def spread(places: np.ndarray) -> float:
    """Largest distance of places r (x, c) from their mean [m].

        max |r - mean r|

    0 of a single place.
    """
    return (
        float(np.linalg.norm(places - places.mean(axis=0), axis=1).max(initial=0.0))
        if len(places)
        else 0.0
    )


def origin(parts: Sequence[Body]) -> np.ndarray:
    """The point (c,) [m] from which coordinates count: the middle of the bodies if that is far
    away, else the origin of the scene.

    Far is more than `FAR` times the largest distance of positions from their middle.
    """
    places = np.concatenate([positions(part) for part in parts])
    middle = places.mean(axis=0)
    return (
        middle if np.linalg.norm(middle) > FAR * (spread(places) or 1.0) else np.zeros_like(middle)
    )


def extent(parts: Sequence[Body], probes: np.ndarray | None = None) -> float:
    """Size L of a mechanism [m].

        L = max |r - mean r|

    over its points r.

    Of a single point the largest of its probe rows (j,), as the length of a link that holds it; 1 m
    where nothing has a size.
    """
    found = spread(np.concatenate([positions(part) for part in parts]))
    return found or float(np.abs(probes).max(initial=0.0) if probes is not None else 0.0) or 1.0
