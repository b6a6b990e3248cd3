"""Frames: sampled histories of lines, surfaces and joints as plain arrays, all that pictures and VTK series need.

    u(s, x) = r(s, x) - r0(x),    e(s, x) = |r(s, x) - r_full(s, x)|

Axis letters: `s` time sample, `x` sampling point of a body, `f` facet of a surface, `c` component (always three; planar scenes have
z = 0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InputError, closest, say

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Kind(StrEnum):
    """What a joint looks like in a picture."""

    PIN = "revolute joint"
    SPHERICAL = "spherical joint"
    CLAMP = "clamp"
    WELD = "weld"
    DISTANCE = "distance"
    SLIDER = "slider"
    DRIVEN_ANGLE = "driven angle"
    DRIVEN_POSITION = "driven position"
    MASS = "point mass"


@dataclass(frozen=True)
class Lines:
    """One body as a polyline at every instant."""

    points: Array  #: (s,x,3) positions [m]
    fields: Mapping[str, Array]  #: name -> (s,x) or (s,x,3), SI units
    radius: float  #: of the section [m]
    reference: Array  #: (x,3) undeformed positions [m]


@dataclass(frozen=True)
class Skins:
    """One plate or shell as quadrilaterals of its middle surface at every instant; cells need not share points."""

    points: Array  #: (s,x,3) positions [m]
    fields: Mapping[str, Array]  #: name -> (s,x) or (s,x,3), SI units
    thickness: Array  #: (x,) [m]
    reference: Array  #: (x,3) undeformed positions [m]
    quads: Indices  #: (f,4) numbers of points; triangles repeat one


Shown: TypeAlias = Lines | Skins


@dataclass(frozen=True)
class Frames:
    """All bodies and joints at the instants `times`; checked on construction."""

    times: Array  #: (s,) increasing [s]
    bodies: Mapping[str, Shown]
    joints: Mapping[str, tuple[str, Array]] = field(default_factory=dict)  #: name -> (Kind or its text, (s,3) [m])

    def __post_init__(self) -> None:
        times = np.asarray(self.times)
        if times.ndim != 1 or times.size == 0 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise InputError(say("frames: times", "finite, increasing instants (s,)", f"shape {times.shape}"))
        if not self.bodies and not self.joints:
            raise InputError(say("frames: bodies", "at least one body or joint", "none"))
        for name, body in self.bodies.items():
            _check_body(f"frames: body '{name}'", body, times.size)
        for name, (kind, points) in self.joints.items():
            if kind not in list(Kind):
                got = f"'{kind}'{closest(kind, Kind)}"
                raise InputError(say(f"frames: joint '{name}'", "one of " + ", ".join(Kind), got))
            _check_array(f"frames: joint '{name}'", points, (times.size, 3))


def _check_array(where: str, array: Array, *shapes: tuple[int, ...], finite: bool = True) -> None:
    if np.shape(array) not in shapes:
        raise InputError(say(where, "shape " + " or ".join(map(str, shapes)), f"shape {np.shape(array)}"))
    if finite and not np.isfinite(array).all():
        remedy = "leave out the instants after the solver failed"
        raise InputError(say(where, "finite numbers", "NaN or infinity", remedy))


def _check_body(where: str, body: Shown, instants: int) -> None:
    count = np.shape(body.reference)[0] if np.ndim(body.reference) == 2 else 0
    if count < 2:
        got = f"reference of shape {np.shape(body.reference)}"
        raise InputError(say(where, "at least two reference points (x,3)", got))
    if isinstance(body, Lines):
        if not 0 <= body.radius < np.inf:
            raise InputError(say(where, "a radius >= 0 [m]", body.radius))
    else:
        _check_surface(where, body, count)
    _check_array(f"{where}, reference", body.reference, (count, 3))
    _check_array(f"{where}, points", body.points, (instants, count, 3))
    for name, values in body.fields.items():
        _check_array(f"{where}, field '{name}'", values, (instants, count), (instants, count, 3), finite=False)


def _check_surface(where: str, skins: Skins, count: int) -> None:
    quads = np.asarray(skins.quads)
    if quads.ndim != 2 or quads.shape[1] != 4 or quads.size == 0 or quads.min() < 0 or quads.max() >= count:
        got = f"shape {quads.shape}" + (f" with numbers {quads.min()} to {quads.max()}" if quads.size else "")
        raise InputError(say(f"{where}, quads", f"point numbers 0 to {count - 1} of shape (f,4)", got))
    _check_array(f"{where}, thickness", skins.thickness, (count,))


def displacement(body: Shown) -> Array:
    """u = r - r0, (s,x,3) [m]."""
    return body.points - body.reference[None]


def fields(body: Shown) -> dict[str, Array]:
    """All fields of a body, its displacement first (unless the body brings its own)."""
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


def planar(frames: Frames, tolerance: float = 1e-9) -> bool:
    """True where every point of every instant has the same z, to `tolerance` of the extent."""
    places = [body.points.reshape(-1, 3) for body in frames.bodies.values()]
    extent = np.ptp(np.concatenate(places or [points for _, points in frames.joints.values()]), axis=0)
    return bool(extent[2] <= tolerance * extent.max())


def nearest(frames: Frames, times: Sequence[float]) -> Indices:
    """Indices of the samples nearest to `times` [s], sorted, each once."""
    wanted = np.asarray(times, float)
    first, last = float(frames.times[0]), float(frames.times[-1])
    slack = 1e-9 * max(abs(first), abs(last))
    if wanted.size == 0 or not ((wanted >= first - slack) & (wanted <= last + slack)).all():
        raise InputError(say("frames: instants", f"times between {first:g} and {last:g} s", list(times)))
    return np.unique(np.abs(frames.times[None, :] - wanted[:, None]).argmin(axis=1)).astype(np.int64)


def spread(frames: Frames, count: int) -> Indices:
    """Indices of `count` samples evenly spread in time (fewer where there are fewer)."""
    if count < 1:
        raise InputError(say("frames: number of instants", "at least 1", count))
    return nearest(frames, np.linspace(frames.times[0], frames.times[-1], count).tolist())


def select(frames: Frames, indices: Indices) -> Frames:
    """The frames at some samples only."""
    bodies = {
        name: replace(body, points=body.points[indices], fields={key: value[indices] for key, value in body.fields.items()})
        for name, body in frames.bodies.items()
    }
    return Frames(frames.times[indices], bodies, {name: (kind, points[indices]) for name, (kind, points) in frames.joints.items()})


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
