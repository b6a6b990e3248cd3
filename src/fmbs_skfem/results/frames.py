"""Frames: sampled histories of lines, surfaces and joints as plain arrays, all that pictures and VTK series need.

    u(s, x) = r(s, x) - r0(x),    e(s, x) = |r(s, x) - r_full(s, x)|

Axis letters: `s` time sample, `x` sampling point of a body, `f` facet of a surface, `c` component (always three; planar scenes have
z = 0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
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

if TYPE_CHECKING:
    from pyvista import MultiBlock

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


SILENT = ", round-off"  #: said of what is drawn as zero
ARROWS = ("force", "moment", "gravity", "axis")


class MarkKind(StrEnum):
    """What a joint looks like in a picture; the markers of a system have these names."""

    PIN = "revolute joint"
    SPHERICAL = "spherical joint"
    CLAMP = "clamp"
    WELD = "weld"
    EDGE = "held edge"
    UNIVERSAL = "universal joint"
    PRISMATIC = "prismatic joint"
    CYLINDRICAL = "cylindrical joint"
    GEAR = "gear"
    BUSHING = "bushing"
    LATCH = "latch"
    OWN = "joint"
    DISTANCE = "distance"
    SLIDER = "slider"
    DRIVEN_ANGLE = "driven angle"
    DRIVEN_POSITION = "driven position"
    MASS = "point mass"


@dataclass(frozen=True)
class Shown:
    """One body as segments or facets between sampled points: a line, its skin, or the middle surface of a plate or shell.

    Cells need not share points; triangles repeat one. A skin has the points of sections, one section after the other, then those of
    its ends, half of them of the first one.
    """

    points: Annotated[Array, Reals("s x 3")]  #: positions at every instant [m]
    fields: Mapping[str, Array]  #: name -> (s,x) or (s,x,3), SI units
    size: Annotated[Array, Reals("x")]  #: radius of a line or its skin, thickness of a surface [m]
    reference: Annotated[Array, Reals("x 3")]  #: undeformed positions [m]
    cells: Annotated[Indices, validation.Indices("f i", end="x")]  #: numbers of the two points of a segment, or the four of a facet

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
    return Shown(points, fields, np.full(len(reference), float(radius)), reference, np.column_stack([along[:-1], along[1:]]))


@dataclass(frozen=True)
class Arrow:
    """A direction at a place: a force, a moment about it, the axis of a joint; gravity is at no place."""

    kind: str  #: one of `ARROWS`
    points: Array  #: (s,3) [m]; (s,0) of gravity
    directions: Array  #: (s,3), of any length


@dataclass(frozen=True)
class Frames:
    """All bodies and joints at the instants `times`, or at the load factors along a path; checked on construction."""

    times: Array  #: (s,) [s]; load factors may turn
    bodies: Mapping[str, Shown]
    joints: Mapping[str, tuple[str, Array]] = field(default_factory=dict)  #: name -> (MarkKind or its text, (s,3) [m])
    arrows: Mapping[str, Arrow] = field(default_factory=dict)  #: loads, gravity, axes of joints

    def __post_init__(self) -> None:
        times = np.asarray(self.times)
        if times.ndim != 1 or times.size == 0 or not np.isfinite(times).all() or (np.diff(times) == 0).any():
            raise InputError(say("frames: times", "finite instants (s,), each once", f"shape {times.shape}"))
        if not self.bodies and not self.joints:
            raise InputError(say("frames: bodies", "at least one body or joint", "none"))
        try:
            for name, body in self.bodies.items():
                check(f"frames: body '{name}'", body, times.size)
        except Misfit as problem:
            raise InputError(str(problem)) from problem
        for name, (kind, points) in self.joints.items():
            where = f"frames: joint '{name}'"
            if kind not in list(MarkKind):
                raise InputError(say(where, "one of " + ", ".join(MarkKind), f"'{kind}'{closest(kind, MarkKind)}"))
            finite(points, where, "finite positions at all instants", times.size, 3)
        for name, arrow in self.arrows.items():
            if arrow.kind not in ARROWS:
                raise InputError(say(f"frames: arrow '{name}'", "one of " + ", ".join(ARROWS), f"'{arrow.kind}'"))
            finite(arrow.directions, f"frames: arrow '{name}'", "finite directions at all instants", times.size, 3)


def check(where: str, body: Shown, instants: int) -> None:
    """Misfit for a body whose arrays do not fit."""
    require(len(body.reference) > 1, where, "at least two reference points (x,3)", f"{len(body.reference)}")
    validation.fit(body, where, {"s": instants})
    require(bool((body.size >= 0.0).all()), f"{where}.size", "a radius or thickness >= 0 [m]", body.size.min())
    shape = body.points.shape
    for name, values in body.fields.items():
        require(
            np.shape(values) in (shape[:2], shape), f"{where}, field '{name}'", f"shape {shape[:2]} or {shape}", np.shape(values)
        )


def displacement(body: Shown) -> Array:
    """u = r - r0, (s,x,3) [m]."""
    return body.points - body.reference[None]


def fields(body: Shown) -> dict[str, Array]:
    """All fields of a body, (s, x) or (s, x, 3), its displacement [m] first, unless the body brings its own."""
    return {"displacement": displacement(body)} | {name: np.asarray(values, float) for name, values in body.fields.items()}


def magnitude(body: Shown, name: str) -> Array:
    """A scalar field as it is, a vector field as its length: (s,x); NaN where the body does not have the field."""
    values = displacement(body) if name == "displacement" else body.fields.get(name)
    if values is None:
        return np.full(body.points.shape[:2], np.nan)
    values = np.asarray(values, float)
    return values if values.ndim == 2 else np.linalg.norm(values, axis=2)


def names(frames: Frames) -> tuple[str, ...]:
    """Names of all fields of all bodies, each once."""
    return tuple(dict.fromkeys(name for body in frames.bodies.values() for name in ("displacement", *body.fields)))


def planar(frames: Frames) -> bool:
    """True where every point of every instant has the same z, to 1e-9 of the extent."""
    places = [body.points.reshape(-1, 3) for body in frames.bodies.values()]
    extent = np.ptp(np.concatenate(places or [points for _, points in frames.joints.values()]), axis=0)
    return bool(extent[2] <= 1e-9 * extent.max())


def nearest(times: Array, wanted: Sequence[float]) -> Indices:
    """Indices of the instants (s,) [s] nearest to the `wanted` ones, sorted, each once."""
    apart = np.abs(times[None, :] - np.asarray(wanted, float)[:, None])
    return np.unique(apart.argmin(axis=1)).astype(np.int64)


def spread(times: Array, count: int) -> Indices:
    """Indices of `count` of the instants (s,), evenly spread (fewer where there are fewer); of a path that turns, its points."""
    if count < 1:
        raise InputError(say("frames: number of instants", "at least 1", count))
    if (np.diff(times) <= 0.0).any():
        return evenly(0, len(times) - 1, count)
    return nearest(times, np.linspace(times[0], times[-1], count).tolist())


def choose(times: Array, wanted: Sequence[float]) -> Indices:
    """As `nearest`, numbers (k,); InputError for no instant, and for one before the first of `times` or after the last."""
    first, last = float(np.min(times)), float(np.max(times))
    slack = 1e-9 * max(abs(first), abs(last))
    if not len(wanted) or not all(first - slack <= one <= last + slack for one in wanted):
        raise InputError(say("frames: instants", f"times between {first:g} and {last:g} s", list(wanted)))
    return nearest(times, wanted)


def select(frames: Frames, indices: Indices) -> Frames:
    """The frames at some samples only."""
    bodies = {
        name: replace(body, points=body.points[indices], fields={key: value[indices] for key, value in body.fields.items()})
        for name, body in frames.bodies.items()
    }
    joints = {name: (kind, points[indices]) for name, (kind, points) in frames.joints.items()}
    arrows = {
        name: replace(arrow, points=arrow.points[indices], directions=arrow.directions[indices])
        for name, arrow in frames.arrows.items()
    }
    return Frames(frames.times[indices], bodies, joints, arrows)


def magnify(frames: Frames, start: Frames, factor: float) -> Frames:
    """Displacements `factor` times as large: of bodies from their reference, of joints and arrows from their place at `start`."""
    bodies = {
        name: replace(body, points=body.reference + factor * (body.points - body.reference)) for name, body in frames.bodies.items()
    }
    joints = {
        name: (kind, start.joints[name][1][:1] + factor * (points - start.joints[name][1][:1]))
        for name, (kind, points) in frames.joints.items()
    }
    arrows = {
        name: replace(arrow, points=start.arrows[name].points[:1] + factor * (arrow.points - start.arrows[name].points[:1]))
        for name, arrow in frames.arrows.items()
    }
    return replace(frames, bodies=bodies, joints=joints, arrows=arrows)


def with_error(frames: Frames, full: Frames) -> Frames:
    """`frames` with the field 'error', e = |r - r_full| [m]; same instants, bodies and sampling points in both."""
    if frames.times.shape != full.times.shape or not np.allclose(frames.times, full.times, rtol=0, atol=1e-9 * np.ptp(full.times)):
        remedy = "sample both at the same instants"
        raise InputError(say("frames: error", "the instants of the full model", f"{frames.times.size} others", remedy))
    bodies: dict[str, Shown] = {}
    for name, body in frames.bodies.items():
        other = full.bodies.get(name)
        if other is None or other.points.shape != body.points.shape:
            got = "no such body" if other is None else f"points of shape {other.points.shape}, not {body.points.shape}"
            raise InputError(say(f"frames: error of body '{name}'", "the same body in the full model", got))
        error = np.linalg.norm(body.points - other.points, axis=2)
        bodies[name] = replace(body, fields={**body.fields, "error": error})
    return replace(frames, bodies=bodies)


def blocks(frames: Frames) -> MultiBlock:
    """The bodies at the first instant, each a block with its name, its fields and its displacement."""
    extras.need("viz", "view")
    import pyvista

    found = pyvista.MultiBlock()
    for name, body in frames.bodies.items():
        cells = np.column_stack([np.full(len(body.cells), body.cells.shape[1]), body.cells]).ravel()
        mesh = pyvista.PolyData(body.points[0], **{"faces" if body.is_surface else "lines": cells})
        for key, values in fields(body).items():
            mesh.point_data[key] = values[0]
        found.append(mesh, name)
    return found
