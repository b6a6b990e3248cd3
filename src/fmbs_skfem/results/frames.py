"""Frames: sampled histories of lines, surfaces and joints as plain arrays, all that pictures and
VTK series need.

    u(s, x) = r(s, x) - r0(x),    e(s, x) = |r(s, x) - r_full(s, x)|

Axis letters: `s` time sample, `x` sampling point of a body, `f` facet of a surface, `c` component
(always three; planar scenes have z = 0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from ..core import extras
from ..core.algebra.linalg import evenly
from ..core.errors import InputError, closest, say
from ..core.storage import validation
from ..core.storage.records import dataclass
from ..core.storage.validation import Misfit, Reals, require
from ..core.values.arrays import finite
from .marks import SYMBOLS

if TYPE_CHECKING:
    from pyvista import MultiBlock, PolyData

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Shown:
    """One body as segments or facets between sampled points: a line, its skin, or the middle
    surface of a plate or shell.

    Cells need not share points; triangles repeat one. A skin has the points of sections, one
    section after the other, then those of its ends, half of them of the first one.
    """

    points: Annotated[Array, Reals("s x 3")]  #: positions at every instant [m]
    fields: Mapping[str, Array]  #: name -> (s,x) or (s,x,3), SI units
    size: Annotated[Array, Reals("x")]  #: radius of a line or its skin, thickness of a surface [m]
    reference: Annotated[Array, Reals("x 3")]  #: undeformed positions [m]
    #: numbers of the two points of a segment, or the four of a facet
    cells: Annotated[Indices, validation.Indices("f i", end="x")]

    sections: tuple[int, int] = (0, 0)  #: of a skin: how many, and the points of each

    @property
    def is_surface(self) -> bool:
        """Whether its cells are facets."""
        return self.cells.shape[1] == 4

    @property
    def is_shell(self) -> bool:
        """Whether it is the middle surface of a plate or shell."""
        return self.is_surface and not self.sections[0]


def line(points: Array, fields: Mapping[str, Array], radius: float, reference: Array) -> Shown:
    """One body as a polyline (s,x,3) of a section with this radius [m]."""
    along = np.arange(len(reference))
    return Shown(
        points,
        fields,
        np.full(len(reference), float(radius)),
        reference,
        np.column_stack([along[:-1], along[1:]]),
    )


@dataclass(frozen=True)
class Mark:
    """A joint, or a direction at a place: a force, a moment about it, the axis of a joint; gravity
    is at no place.
    """

    kind: str  #: one of `marks.SYMBOLS`
    points: Array  #: (s,3) [m]; (s,0) of gravity
    directions: Array  #: (s,3), of any length; (s,0) of a joint

    @property
    def is_joint(self) -> bool:
        """Whether it has no direction."""
        return not self.directions.shape[1]


def joint(kind: str, points: Array) -> Mark:
    """The mark of a joint at points (s,3) [m]."""
    return Mark(kind, points, np.empty((len(points), 0)))


@dataclass(frozen=True)
class Frames:
    """All bodies and marks at the instants `times`, or at the load factors along a path; checked on
    construction.
    """

    times: Array  #: (s,) [s]; load factors may turn
    bodies: Mapping[str, Shown]
    #: joints, loads, gravity, axes of joints
    marks: Mapping[str, Mark] = field(default_factory=dict)

    def __post_init__(self) -> None:
        times = np.asarray(self.times)
        if (
            times.ndim != 1
            or times.size == 0
            or not np.isfinite(times).all()
            or (np.diff(times) == 0).any()
        ):
            raise InputError(
                say("frames: times", "finite instants (s,), each once", f"shape {times.shape}")
            )
        if not self.bodies and not self.marks:
            raise InputError(say("frames: bodies", "at least one body or joint", "none"))
        try:
            for name, body in self.bodies.items():
                check(f"frames: body '{name}'", body, times.size)
        except Misfit as problem:
            raise InputError(str(problem)) from problem
        for name, mark in self.marks.items():
            where = f"frames: mark '{name}'"
            if mark.kind not in SYMBOLS:
                raise InputError(
                    say(
                        where,
                        "one of " + ", ".join(SYMBOLS),
                        f"'{mark.kind}'{closest(mark.kind, SYMBOLS)}",
                    )
                )
            for values in (mark.points, mark.directions):
                finite(
                    values,
                    where,
                    "finite numbers at all instants",
                    times.size,
                    3 if values.shape[1] else 0,
                )


def check(where: str, body: Shown, instants: int) -> None:
    """Misfit for a body whose arrays do not fit."""
    require(
        len(body.reference) > 1,
        where,
        "at least two reference points (x,3)",
        f"{len(body.reference)}",
    )
    validation.fit(body, where, {"s": instants})
    require(
        bool((body.size >= 0.0).all()),
        f"{where}.size",
        "a radius or thickness >= 0 [m]",
        body.size.min(),
    )
    shape = body.points.shape
    for name, values in body.fields.items():
        require(
            np.shape(values) in (shape[:2], shape),
            f"{where}, field '{name}'",
            f"shape {shape[:2]} or {shape}",
            np.shape(values),
        )


def displacement(body: Shown) -> Array:
    """Displacement of a body from its reference.

        u = r - r0

    (s, x, 3) [m].
    """
    return body.points - body.reference[None]


def fields(body: Shown) -> dict[str, Array]:
    """All fields of a body, (s, x) or (s, x, 3), its displacement [m] first, unless the body brings
    its own.
    """
    return {"displacement": displacement(body)} | {
        name: np.asarray(values, float) for name, values in body.fields.items()
    }


def magnitude(body: Shown, name: str) -> Array:
    """A scalar field as it is, a vector field as its length: (s,x); NaN where the body does not
    have the field.
    """
    values = displacement(body) if name == "displacement" else body.fields.get(name)
    if values is None:
        return np.full(body.points.shape[:2], np.nan)
    values = np.asarray(values, float)
    return values if values.ndim == 2 else np.linalg.norm(values, axis=2)


def names(frames: Frames) -> tuple[str, ...]:
    """Names of all fields of all bodies, each once."""
    return tuple(
        dict.fromkeys(
            name for body in frames.bodies.values() for name in ("displacement", *body.fields)
        )
    )


def planar(frames: Frames) -> bool:
    """True where every point of every instant has the same z, to 1e-9 of the extent."""
    extent = np.ptp(points(frames), axis=0)
    return bool(extent[2] <= 1e-9 * extent.max())


def places(frames: Frames) -> list[Array]:
    """Points (s, x, 3) [m] of every body and joint."""
    return [body.points for body in frames.bodies.values()] + [
        mark.points[:, None] for mark in frames.marks.values() if mark.is_joint
    ]


def points(frames: Frames) -> Array:
    """All of them at all instants, (i, 3) [m]."""
    return np.concatenate([one.reshape(-1, 3) for one in places(frames)])


def acting(frames: Frames) -> dict[str, Mark]:
    """All marks without loads that never act."""
    return {
        name: mark for name, mark in frames.marks.items() if mark.is_joint or mark.directions.any()
    }


def nearest(times: Array, wanted: Sequence[float]) -> Indices:
    """Indices of the instants (s,) [s] nearest to the `wanted` ones, sorted, each once."""
    apart = np.abs(times[None, :] - np.asarray(wanted, float)[:, None])
    return np.unique(apart.argmin(axis=1)).astype(np.int64)


def spread(times: Array, count: int) -> Indices:
    """Indices of `count` of the instants (s,), evenly spread (fewer where there are fewer); of a
    path that turns, its points.

    InputError for a `count` below 1.
    """
    if count < 1:
        raise InputError(say("frames: number of instants", "at least 1", count))
    if (np.diff(times) <= 0.0).any():
        return evenly(0, len(times) - 1, count)
    return nearest(times, np.linspace(times[0], times[-1], count).tolist())


def choose(times: Array, wanted: Sequence[float]) -> Indices:
    """As `nearest`, numbers (k,); InputError for no instant, and for one before the first of
    `times` or after the last.
    """
    first, last = float(np.min(times)), float(np.max(times))
    slack = 1e-9 * max(abs(first), abs(last))
    if not len(wanted) or not all(first - slack <= one <= last + slack for one in wanted):
        raise InputError(
            say("frames: instants", f"times between {first:g} and {last:g} s", list(wanted))
        )
    return nearest(times, wanted)


def select(frames: Frames, indices: Indices) -> Frames:
    """The frames at some samples only."""
    bodies = {
        name: replace(
            body,
            points=body.points[indices],
            fields={key: value[indices] for key, value in body.fields.items()},
        )
        for name, body in frames.bodies.items()
    }
    marks = {
        name: replace(mark, points=mark.points[indices], directions=mark.directions[indices])
        for name, mark in frames.marks.items()
    }
    return Frames(frames.times[indices], bodies, marks)


def magnify(frames: Frames, start: Frames, factor: float) -> Frames:
    """Displacements `factor` times as large: of bodies from their reference, of marks from their
    place at `start`.
    """
    bodies = {
        name: replace(body, points=body.reference + factor * (body.points - body.reference))
        for name, body in frames.bodies.items()
    }
    places = {name: mark.points[:1] for name, mark in start.marks.items()}
    marks = {
        name: replace(mark, points=places[name] + factor * (mark.points - places[name]))
        for name, mark in frames.marks.items()
    }
    return replace(frames, bodies=bodies, marks=marks)


def with_error(frames: Frames, full: Frames) -> Frames:
    """`frames` with the field 'error'.

        e = |r - r_full|    [m]

    Both have the same instants, bodies and sampling points.
    """
    if frames.times.shape != full.times.shape or not np.allclose(
        frames.times, full.times, rtol=0, atol=1e-9 * np.ptp(full.times)
    ):
        remedy = "sample both at the same instants"
        raise InputError(
            say(
                "frames: error",
                "the instants of the full model",
                f"{frames.times.size} others",
                remedy,
            )
        )
    bodies: dict[str, Shown] = {}
    for name, body in frames.bodies.items():
        other = full.bodies.get(name)
        if other is None or other.points.shape != body.points.shape:
            got = (
                "no such body"
                if other is None
                else f"points of shape {other.points.shape}, not {body.points.shape}"
            )
            raise InputError(
                say(f"frames: error of body '{name}'", "the same body in the full model", got)
            )
        error = np.linalg.norm(body.points - other.points, axis=2)
        bodies[name] = replace(body, fields={**body.fields, "error": error})
    return replace(frames, bodies=bodies)


def blocks(frames: Frames) -> MultiBlock:
    """The bodies at the first instant, each a block with its name, its fields and its displacement."""
    extras.need("viz", "view")
    import pyvista

    found = pyvista.MultiBlock()
    for name, body in frames.bodies.items():
        found.append(
            mesh(
                body.points[0], body.cells, {key: values[0] for key, values in fields(body).items()}
            ),
            name,
        )
    return found


def mesh(points: Array, cells: Indices, data: Mapping[str, Array]) -> PolyData:
    """Points (x, 3) with segments (f, 2) or facets (f, 4), and data (x, ...) of the points."""
    import pyvista

    kind = "lines" if cells.shape[1] == 2 else "faces"
    found = pyvista.PolyData(points, **{kind: np.insert(cells, 0, cells.shape[1], axis=1).ravel()})
    found.point_data.update(data)
    return found
