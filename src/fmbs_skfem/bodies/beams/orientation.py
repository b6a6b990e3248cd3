r"""Where the axes of a beam's section point along its line: tangent d_1, and d_2 across it,

    d_2 = cos a n + sin a (d_1 x n),    n = (w - (w . d_1) d_1) / |..|,    d_3 = d_1 x d_2

of a wanted direction w, and a pre-twist a about the line. Both may change along the line: what is
given at fractions of its length is joined by a cubic spline (two values by a straight line, three
by a parabola).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...shapes.table import Floats

ALONG = 1e-6  #: sine of the angle between a direction and the line that is none

Everywhere: TypeAlias = Mapping[float, ArrayLike]  #: by fractions of the length


@dataclass(frozen=True, eq=False)
class Orientation:
    """The y axis of a section along a line: a direction, directions at fractions of the length, or
    the point to which it points.

    All are given in the frame of the mesh, and placed with it. By default it is the axis of the
    mesh that the line begins most across; `twist` [rad] is the turn of the section about the line
    at its end, linear, or turns at fractions.
    """

    direction: ArrayLike | Everywhere | None = None
    towards: ArrayLike | None = None  #: (3,) [m]
    twist: float | Mapping[float, float] = 0.0

    def __post_init__(self) -> None:
        if self.direction is not None and self.towards is not None:
            raise InputError(
                say("towards", "a direction or a point", "both", "delete one of the two")
            )
        for what, given in (("direction", self.direction), ("twist", self.twist)):
            if isinstance(given, Mapping) and (
                len(given) < 2 or not all(0.0 <= x <= 1.0 for x in given)
            ):
                raise InputError(
                    say(what, "two or more at fractions of the length, 0 to 1", sorted(given))
                )

    @property
    def turns(self) -> float:
        """How far it twists in all [rad]."""
        if not isinstance(self.twist, Mapping):
            return abs(self.twist)
        return sum(
            abs(self.twist[b] - self.twist[a]) for a, b in itertools.pairwise(sorted(self.twist))
        )

    def wanted(self, points: Floats, tangents: Floats, fractions: Floats) -> Floats:
        """w (x, 3) at points (x, 3) of a line with unit tangents (x, 3)."""
        if self.towards is not None:
            return np.asarray(self.towards, dtype=float) - points
        if isinstance(self.direction, Mapping):
            return spline(self.direction, fractions)
        one = (
            np.eye(3)[np.abs(tangents[0]).argmin()]
            if self.direction is None
            else np.asarray(self.direction, dtype=float)
        )
        return np.broadcast_to(one, points.shape)

    def axes(self, name: str, points: Floats, tangents: Floats, fractions: Floats) -> Floats:
        """d_1, d_2, d_3 in one row (x, 9); InputError where w is along the line."""
        wanted = self.wanted(points, tangents, fractions)
        across = wanted - np.einsum("xc,xc->x", tangents, wanted)[:, None] * tangents
        size, whole = np.linalg.norm(across, axis=1), np.linalg.norm(wanted, axis=1)
        if not (size > ALONG * np.maximum(whole, 1e-300)).all():
            where = f"({', '.join(f'{x:.4g}' for x in points[(size / np.maximum(whole, 1e-300)).argmin()])}) m"
            key, what = (
                ("direction", "a direction") if self.towards is None else ("towards", "a point")
            )
            got = f"one along it at {where}"
            raise InputError(
                say(
                    f"body '{name}'.{key}",
                    f"{what} across the line",
                    got,
                    "turn it" if key == "direction" else "move it",
                )
            )
        normal = across / size[:, None]
        angle = (
            spline(self.twist, fractions)
            if isinstance(self.twist, Mapping)
            else self.twist * fractions
        )[:, None]
        second = np.cos(angle) * normal + np.sin(angle) * np.cross(tangents, normal)
        return np.concatenate([tangents, second, np.cross(tangents, second)], axis=1)


def spline(given: Everywhere, x: Floats) -> Floats:
    """Values (x, ...) at fractions (x,) of a spline through those given; beyond the first and the
    last they are held.
    """
    from scipy.interpolate import CubicSpline

    places = sorted(given)
    return np.asarray(
        CubicSpline(places, [given[place] for place in places])(np.clip(x, places[0], places[-1]))
    )
