"""Frames: sampled histories of lines and joints as plain arrays, all that pictures and VTK series need.

    u(s, x) = r(s, x) - r0(x),    e(s, x) = |r(s, x) - r_full(s, x)|

Axis letters: `s` time sample, `x` sampling point along a body, `c` component (always three; planar scenes have z = 0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ..core import errors

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Kind(StrEnum):
    """What a joint looks like in a picture."""

    PIN = "pin"
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
class Frames:
    """All bodies and joints at the instants `times`; checked on construction."""

    times: Array  #: (s,) increasing [s]
    bodies: Mapping[str, Lines]
    joints: Mapping[str, tuple[str, Array]] = field(default_factory=dict)  #: name -> (Kind or its text, (s,3) [m])

    def __post_init__(self) -> None:
        times = np.asarray(self.times)
        if times.ndim != 1 or times.size == 0 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise errors.InputError(errors.say("frames: times", "finite, increasing instants (s,)", f"shape {times.shape}"))
        if not self.bodies:
            raise errors.InputError(errors.say("frames: bodies", "at least one body", "none"))
        for name, lines in self.bodies.items():
            _check_lines(f"frames: body '{name}'", lines, times.size)
        for name, (kind, points) in self.joints.items():
            if kind not in list(Kind):
                got = f"'{kind}'{errors.closest(kind, Kind)}"
                raise errors.InputError(errors.say(f"frames: joint '{name}'", "one of " + ", ".join(Kind), got))
            _check_array(f"frames: joint '{name}'", points, (times.size, 3))


def _check_array(where: str, array: Array, *shapes: tuple[int, ...], finite: bool = True) -> None:
    if np.shape(array) not in shapes:
        raise errors.InputError(errors.say(where, "shape " + " or ".join(map(str, shapes)), f"shape {np.shape(array)}"))
    if finite and not np.isfinite(array).all():
        remedy = "leave out the instants after the solver failed"
        raise errors.InputError(errors.say(where, "finite numbers", "NaN or infinity", remedy))


def _check_lines(where: str, lines: Lines, instants: int) -> None:
    count = np.shape(lines.reference)[0] if np.ndim(lines.reference) == 2 else 0
    if count < 2:
        got = f"reference of shape {np.shape(lines.reference)}"
        raise errors.InputError(errors.say(where, "at least two reference points (x,3)", got))
    if not 0 <= lines.radius < np.inf:
        raise errors.InputError(errors.say(where, "a radius >= 0 [m]", lines.radius))
    _check_array(f"{where}, reference", lines.reference, (count, 3))
    _check_array(f"{where}, points", lines.points, (instants, count, 3))
    for name, values in lines.fields.items():
        _check_array(f"{where}, field '{name}'", values, (instants, count), (instants, count, 3), finite=False)


def displacement(lines: Lines) -> Array:
    """u = r - r0, (s,x,3) [m]."""
    return lines.points - lines.reference[None]


def fields(lines: Lines) -> dict[str, Array]:
    """All fields of a body, its displacement first (unless the body brings its own)."""
    return {"displacement": displacement(lines)} | {name: np.asarray(values, float) for name, values in lines.fields.items()}


def magnitude(lines: Lines, name: str) -> Array:
    """A scalar field as it is, a vector field as its length: (s,x); NaN where the body does not have the field."""
    values = fields(lines).get(name)
    if values is None:
        return np.full(lines.points.shape[:2], np.nan)
    return values if values.ndim == 2 else np.linalg.norm(values, axis=2)


def names(frames: Frames) -> tuple[str, ...]:
    """Names of all fields of all bodies, each once."""
    return tuple(dict.fromkeys(name for lines in frames.bodies.values() for name in fields(lines)))


def planar(frames: Frames, tolerance: float = 1e-9) -> bool:
    """True where every point of every instant has the same z, to `tolerance` of the extent."""
    points = np.concatenate([lines.points.reshape(-1, 3) for lines in frames.bodies.values()])
    extent = np.ptp(points, axis=0)
    return bool(extent[2] <= tolerance * extent.max())


def nearest(frames: Frames, times: Sequence[float]) -> Indices:
    """Indices of the samples nearest to `times` [s], sorted, each once."""
    wanted = np.asarray(times, float)
    first, last = float(frames.times[0]), float(frames.times[-1])
    slack = 1e-9 * max(abs(first), abs(last))
    if wanted.size == 0 or not ((wanted >= first - slack) & (wanted <= last + slack)).all():
        raise errors.InputError(errors.say("frames: instants", f"times between {first:g} and {last:g} s", list(times)))
    return np.unique(np.abs(frames.times[None, :] - wanted[:, None]).argmin(axis=1)).astype(np.int64)


def spread(frames: Frames, count: int) -> Indices:
    """Indices of `count` samples evenly spread in time (fewer where there are fewer)."""
    if count < 1:
        raise errors.InputError(errors.say("frames: number of instants", "at least 1", count))
    return nearest(frames, np.linspace(frames.times[0], frames.times[-1], count).tolist())


def select(frames: Frames, indices: Indices) -> Frames:
    """The frames at some samples only."""
    bodies = {
        name: replace(lines, points=lines.points[indices], fields={key: value[indices] for key, value in lines.fields.items()})
        for name, lines in frames.bodies.items()
    }
    return Frames(frames.times[indices], bodies, {name: (kind, points[indices]) for name, (kind, points) in frames.joints.items()})


def with_error(frames: Frames, full: Frames) -> Frames:
    """`frames` with the field 'error', e = |r - r_full| [m]; same instants, bodies and sampling points in both."""
    if frames.times.shape != full.times.shape or not np.allclose(frames.times, full.times, rtol=0, atol=1e-9 * np.ptp(full.times)):
        remedy = "sample both at the same instants"
        raise errors.InputError(
            errors.say("frames: error", "the instants of the full model", f"{frames.times.size} others", remedy)
        )
    bodies = {}
    for name, lines in frames.bodies.items():
        other = full.bodies.get(name)
        if other is None or other.points.shape != lines.points.shape:
            got = "no such body" if other is None else f"points of shape {other.points.shape}, not {lines.points.shape}"
            raise errors.InputError(errors.say(f"frames: error of body '{name}'", "the same body in the full model", got))
        error = np.linalg.norm(lines.points - other.points, axis=2)
        bodies[name] = replace(lines, fields={**lines.fields, "error": error})
    return replace(frames, bodies=bodies)
