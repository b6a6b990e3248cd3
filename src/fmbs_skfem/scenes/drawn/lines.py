"""Lines of cables and beams that a scene draws, without a mesh file.

line: {start: [0, 0, 0], end: [1 m, 0, 0]}
line: {through: [[0, 0, 0], [0.5 m, 0, 0.1 m], [1 m, 0, 0]]}
line: {start: [0.1 m, 0, 0], center: [0, 0, 0], axis: [0, 0, 1], angle: 360 deg * 5, rise: 50 mm}
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field
from typing import Annotated

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.fields import Position, Takes, quantity, read_text, vector
from ...core.values.mappings import list_of, names, takes
from ...core.values.problems import Problem
from ...shapes import curves
from ...shapes.curves import Line
from ...shapes.table import Curve
from ..field_kinds import parts_or

FINE = 16  #: places a radian of an arc, between which it counts as straight
CELLS = 20  #: of a line for which no number is given
STRAIGHT, SPLINE, ARC = {"start", "end"}, {"through"}, {"start", "center", "angle"}
FORMS = "start and end, through, or start, center and angle, in space with an axis"


@dataclass(frozen=True)
class DrawnLine:
    """A line of `start` and `end`; or smooth `through` points; or an arc from `start` about `center`
    by an `angle`, in space about an `axis`, along which it may `rise` to be a helix. `left` and
    `right` are its ends, `points` more of its places, at fractions of its length.
    """

    start: Position | None = None
    end: Position | None = None
    through: Annotated[tuple[tuple[float, ...], ...], list_of(vector("m"), tuple)] = ()
    center: Position | None = None
    axis: Annotated[tuple[float, ...] | None, vector("")] = None
    angle: Annotated[float | None, quantity("rad")] = None
    rise: Annotated[float, quantity("m")] = 0.0
    points: Annotated[
        dict[str, float], names(Annotated[float, quantity("", "> 0", "< 1")], words=True)
    ] = field(default_factory=dict)

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        """What does not make a line in a scene of this dimension."""
        given = {
            name
            for name in ("start", "end", "through", "center", "axis", "angle")
            if getattr(self, name) not in (None, ())
        }
        wanted = ARC | {"axis"} if dim == 3 else ARC
        if given not in (STRAIGHT, SPLINE, wanted):
            yield "line", Problem(FORMS, ", ".join(sorted(given)) or "nothing")
        elif self.end is not None and self.end == self.start:
            yield "end", Problem("another point than the start", "the same")
        elif given == SPLINE and len(set(self.through)) < 2:
            yield "through", Problem("two points or more", "one")
        elif self.rise and given != wanted:
            yield "rise", Problem("that of an arc about an axis", "one of another line")

    def line(self, where: str) -> Line:
        """The line, with CELLS cells; InputError where it has no length."""
        if self.angle is not None:
            arc = self.arc(where)
            curve: Curve = arc
            breaks = np.linspace(0.0, arc.length, CELLS + 1)
            fine = np.linspace(0.0, arc.length, FINE * math.ceil(abs(arc.angle)) + 1)
            arcs = np.stack([fine, fine])
        else:
            given = self.through or [self.start, self.end]
            points = np.zeros((len(given), 3))
            points[:, : len(given[0])] = given  # type: ignore[arg-type]
            ends, curve = curves.through(points)
            breaks, arcs = np.linspace(0.0, ends[-1], CELLS + 1), None
            if not isinstance(curve, curves.Straight):
                arcs = curves.arc_lengths(ends, lambda xi: np.linalg.norm(curve(xi, 1), axis=1))
                breaks = np.interp(np.linspace(0.0, arcs[1, -1], CELLS + 1), arcs[1], arcs[0])
        length = breaks[-1] if arcs is None else arcs[1, -1]

        def at(share: float) -> float:
            return float(
                share * length if arcs is None else np.interp(share * length, arcs[1], arcs[0])
            )

        inside = {name: at(share) for name, share in self.points.items()}
        return Line(breaks, curve, {"left": 0.0, **inside, "right": float(breaks[-1])}, arcs)

    def arc(self, where: str) -> curves.Helix:
        """The arc or helix; InputError where it has no radius."""
        start, center = np.zeros(3), np.zeros(3)
        start[: len(self.start or ())], center[: len(self.center or ())] = self.start, self.center
        axis = np.array([0.0, 0.0, 1.0] if self.axis is None else self.axis)
        if not (size := np.linalg.norm(axis)):
            raise InputError(say(f"{where}.line.axis", "a direction", "zeros"))
        axis = axis / size
        center = center + ((start - center) @ axis) * axis
        radius = float(np.linalg.norm(start - center))
        if radius == 0.0 or not self.angle:
            got = f"a radius of {radius:g} m and an angle of {self.angle:g} rad"
            raise InputError(say(f"{where}.line", "an arc of some length", got))
        return curves.Helix(center, start - center, axis, self.angle, self.rise)


LINE = parts_or(
    f"a named line of the mesh, or {{...}} of {FORMS}",
    Takes(read_text, {"type": "string", "minLength": 1}),
    takes(DrawnLine),
    dict,
)
