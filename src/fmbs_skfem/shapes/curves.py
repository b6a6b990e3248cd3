"""Reference curves through given points.

    r(xi_i) = p_i,    xi_i = sum_{j<i} |p_{j+1} - p_j|        (chord-length parameter, |r'| close to 1)

Points on one straight line give the straight line; others a C2 cubic spline with the not-a-knot end
condition, three points a parabola. de Boor, A Practical Guide to Splines, rev. ed., ISBN
978-0-387-95366-3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..core import remembered_files
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.arguments import blamed
from . import meshes
from .table import Curve, Floats, Ints, inside

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

#: Distance from the chord, relative to its length, below which points count as straight.
STRAIGHT = 1e-12
#: Angle between neighbouring chords above which a notice says that the spline rounds a corner
#: [degrees].
CORNER = 60.0
#: [rad], which a cell of a coarse mesh turns by at most: a cubic on an arc of it is shorter by 2e-3
BEND = np.pi / 3
ALMOST = 0.05  #: cells that a turn may miss for a bend a little larger


@dataclass(frozen=True, eq=False)
class Straight:
    """A straight line from a to b of the length l [m].

        r(xi) = (1 - xi / l) a + (xi / l) b

    a and b (c,).
    """

    start: Floats
    end: Floats
    length: float  #: [m]

    def __call__(self, xi: Floats, derivative: int = 0, /) -> Floats:
        share = inside("curve", xi, 0.0, self.length)[:, None] / self.length
        if derivative == 0:
            return (1.0 - share) * self.start + share * self.end
        slope = (
            (self.end - self.start) / self.length if derivative == 1 else np.zeros_like(self.start)
        )
        return np.tile(slope, (len(share), 1))


@dataclass(frozen=True, eq=False)
class Smooth:
    """A piecewise cubic curve, twice continuously differentiable."""

    spline: CubicSpline

    def __call__(self, xi: Floats, derivative: int = 0, /) -> Floats:
        return np.asarray(self.spline(inside("curve", xi, *self.spline.x[[0, -1]]), derivative))


@dataclass(frozen=True, eq=False)
class Helix:
    """A helix by its arc length, without a rise an arc.

        r(s) = c + cos(phi) a + sin(phi) k x a + rise s / l k,    phi = angle s / l

    with the vector a from its center c to its start, normal to the unit axis k, all (3,).
    """

    center: Floats
    arm: Floats
    axis: Floats
    angle: float  #: [rad]
    rise: float  #: [m]

    @property
    def length(self) -> float:
        """l [m]."""
        return float(np.hypot(self.angle * np.linalg.norm(self.arm), self.rise))

    def __call__(self, xi: Floats, derivative: int = 0, /) -> Floats:
        s = inside("curve", xi, 0.0, self.length)[:, None]
        rate, pitch = self.angle / self.length, self.rise / self.length
        phase = rate * s + 0.5 * np.pi * derivative
        round_ = np.cos(phase) * self.arm + np.sin(phase) * np.cross(self.axis, self.arm)
        if derivative == 0:
            return np.asarray(self.center + round_ + pitch * s * self.axis)
        return np.asarray(
            rate**derivative * round_ + (pitch * self.axis if derivative == 1 else 0.0)
        )


@blamed
def through(points: ArrayLike) -> tuple[Floats, Curve]:
    """Breakpoints (n,) and curve(xi, derivative) -> (x, c) through the points (n, c) of an open
    polyline.

    Straight ones stay straight. InputError for fewer than two points, neighbours at one place,
    points that are not finite, and lines that turn back.
    """
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or len(array) < 2 or array.shape[1] < 1 or not np.isfinite(array).all():
        got = f"shape {array.shape}" + ("" if np.isfinite(array).all() else " with NaN or infinity")
        raise InputError(
            say("curves.through", "at least two finite points (n, c)", got, "look into the mesh")
        )
    chords = np.diff(array, axis=0)
    lengths = np.linalg.norm(chords, axis=1)
    if np.any(lengths <= STRAIGHT * lengths.sum()):
        i = int(np.argmin(lengths))
        got = f"points {i} and {i + 1} both at {array[i]}"
        raise InputError(
            say("curves.through", "neighbouring points apart", got, "remove one of them")
        )
    if _straight(array):
        _check_forward(array)
        breaks = np.linalg.norm(array - array[0], axis=1)
        return breaks, Straight(array[0], array[-1], float(breaks[-1]))
    from scipy.interpolate import CubicSpline

    _check_corners(chords / lengths[:, None])
    breaks = np.concatenate([[0.0], np.cumsum(lengths)])
    return breaks, Smooth(CubicSpline(breaks, array, bc_type="not-a-knot"))


def _straight(points: Floats) -> bool:
    """Whether all points lie, to round-off, on the line from the first to the one farthest from it."""
    offsets = points - points[0]
    reach = np.linalg.norm(offsets, axis=1)
    far = int(np.argmax(reach))
    direction = offsets[far] / reach[far]
    distances = np.linalg.norm(offsets - np.outer(offsets @ direction, direction), axis=1)
    return bool(
        np.max(distances)
        <= STRAIGHT * reach[far] + 4.0 * np.finfo(float).eps * np.max(np.abs(points))
    )


def _check_forward(points: Floats) -> None:
    """Points of a straight line have to lie in order along it."""
    steps = np.diff(points, axis=0) @ (points[1] - points[0])
    if np.any(steps <= 0.0):
        i = int(np.argmax(steps <= 0.0))
        got = f"a turn back at point {i}"
        raise InputError(
            say(
                "curves.through",
                "points in order along their line",
                got,
                "order the cells of the mesh",
            )
        )


def _check_corners(directions: Floats) -> None:
    cosines = np.sum(directions[1:] * directions[:-1], axis=1)
    turn = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    if turn.size and turn.max() > CORNER:
        i = int(np.argmax(turn)) + 1
        angle = f"the polyline turns by {turn.max():.0f} degrees at point {i}"
        notify(
            f"curves.through: {angle} and the spline rounds it; make two bodies joined by a weld to keep the corner"
        )


def named_points(mesh: meshes.LineMesh, order: Ints, breaks: Floats) -> dict[str, float]:
    """Where the named points of a mesh are on the curve through its nodes `order` (i,), which has
    them at `breaks` (i,).
    """
    where = {int(node): float(xi) for node, xi in zip(order, breaks, strict=True)}
    return {
        name: where[int(ids[0])]
        for name, ids in mesh.point_groups.items()
        if len(ids) == 1 and int(ids[0]) in where
    }


@dataclass(frozen=True, eq=False)
class Line:
    """A smooth curve with the parameters where cells meet: it belongs to all who cut it, and nobody
    changes it.
    """

    breaks: Floats  #: (n,) parameters of the points
    curve: Curve
    names: dict[str, float]  #: parameters of the named points
    #: (2, x) parameters close to one another and the arc lengths [m] to them; None of a straight
    #: one
    arcs: Floats | None

    @property
    def inner(self) -> list[float]:
        """Parameters of the named points between its ends, in their order, each once."""
        length = self.breaks[-1]
        return [
            xi
            for xi in sorted(set(self.names.values()))
            if 1e-9 * length < xi < (1 - 1e-9) * length
        ]

    @property
    def fewest(self) -> int:
        """The fewest cells that follow it: one more than named points inside, each turning by
        `BEND` at most.
        """
        slopes = self.curve(self.breaks, 1)
        slopes /= np.linalg.norm(slopes, axis=1, keepdims=True)
        turns = 2.0 * np.arcsin(
            np.clip(0.5 * np.linalg.norm(np.diff(slopes, axis=0), axis=1), 0.0, 1.0)
        )
        return max(len(self.inner) + 1, int(np.ceil(turns.sum() / BEND - ALMOST)))


def follow(mesh: meshes.LineMesh, group: str | None) -> Line:
    """The smooth curve through the points of one body of a mesh, see `meshes.chain`."""
    order = meshes.chain(mesh, group)
    breaks, curve = through(mesh.points[order])
    arcs = (
        None
        if isinstance(curve, Straight)
        else arc_lengths(breaks, lambda xi: np.linalg.norm(curve(xi, 1), axis=1))
    )
    return Line(breaks, curve, named_points(mesh, order, breaks), arcs)


def arc_lengths(breaks: Floats, speed: Callable[[Floats], Floats]) -> Floats:
    """Parameters close to one another along a line with cells at the breaks (n,), and the arc
    lengths to them [m], (2, x).

        S = int |dr/dxi| dxi

    by Simpson's rule on eight intervals a cell, of the speed at parameters (x,).
    """
    fine = np.append(np.linspace(breaks[:-1], breaks[1:], 9)[:-1].T, breaks[-1])
    ends, middle = speed(fine), speed(0.5 * (fine[1:] + fine[:-1]))
    return np.stack(
        [fine, np.append(0.0, np.cumsum(np.diff(fine) * (ends[1:] + 4 * middle + ends[:-1]) / 6))]
    )


def read(path: Path, group: str | None, repair: bool = False, unit: float = 1.0) -> Line:
    """The line of one body in a mesh file, see `meshes.read`; found once while the file does not
    change.
    """
    return remembered_files.once(
        path, ("line", group, repair, unit), lambda: follow(meshes.read(path, repair, unit), group)
    )


@blamed
def cut(line: Line, cells: int | None = None, refine: int = 1) -> Line:
    """The same line with other cells: `cells` of equal length, or every cell split into `refine`.

    Named points stay points where cells meet: the nearest inner cut moves to them, and the cells
    beside them differ in length where they do not divide the line evenly.
    """
    breaks = line.breaks
    if cells is None:
        steps = np.arange(refine) / refine
        cuts = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])
    else:
        if cells <= len(line.inner):
            raise InputError(
                say(
                    "mesh",
                    f"at least {len(line.inner) + 1} cells, one more than named inner points",
                    cells,
                )
            )
        cuts = _cuts(breaks[-1], cells, line.inner)
    return replace(line, breaks=cuts)


def _cuts(length: float, cells: int, inner: list[float]) -> np.ndarray:
    """Equal cuts of [0, length] of which the nearest move to the values inside."""
    cuts = np.linspace(0.0, length, cells + 1)
    free = np.arange(1, cells)
    for xi in inner:
        nearest = free[np.argmin(np.abs(cuts[free] - xi))]
        cuts[nearest] = xi
        free = free[free != nearest]
    return np.sort(cuts)
