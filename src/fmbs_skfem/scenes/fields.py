"""Fields of bodies and analyses in a scene: thicknesses, rims, inertias, rotations, numbers of modes, spans of time."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from ..bodies.plate import Rim
from ..core import units
from ..core.fields import (
    NAMES,
    Context,
    Takes,
    Time,
    Vector,
    array_schema,
    mapping_schema,
    number_schema,
    quantity,
    read_axis,
    read_names,
    read_quantity,
    read_vector,
)
from ..core.mappings import inline, list_of, names
from ..core.problems import Problem, shown

COUNT = 1_000_000  #: largest number of steps between stored states, and of modes


@dataclass(frozen=True)
class Turn:
    """A rotation by an angle [rad], about `axis` in space."""

    angle: float
    axis: Vector | None = None


@dataclass(frozen=True)
class Span:
    """States every so many seconds, until a time [s]; the last span may last to the end."""

    every: Time
    until: Time | None = None


Spans: TypeAlias = tuple[Span, ...]


def turn(value: object, context: Context) -> Turn:
    """An angle in the plane, {axis: [x, y, z], angle: ...} in space."""
    if context.dimension == 2:
        return Turn(read_quantity(value, units.ANGLE, context))
    if not isinstance(value, dict) or set(value) != {"axis", "angle"}:
        raise Problem("a rotation in space such as {axis: [0, 0, 1], angle: 30 deg}", shown(value))
    return Turn(read_quantity(value["angle"], units.ANGLE, context), read_axis(value["axis"], context))


def counts(value: object, context: Context) -> int | dict[str, int]:
    """A number of modes, for all components or by their names."""
    if isinstance(value, dict) and value:
        return {str(name): _count(count) for name, count in value.items()}
    return _count(value)


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= COUNT:
        raise Problem("a whole number >= 1, or a mapping of names and such numbers", shown(value))
    return value


def thickness(value: object, context: Context) -> float | dict[str, float]:
    """One thickness [m], or one for each named face."""
    if isinstance(value, dict) and value:
        return {str(name): read_quantity(part, units.LENGTH, context, "> 0") for name, part in value.items()}
    if isinstance(value, dict | list):
        raise Problem("a thickness, or a mapping of faces and thicknesses", shown(value))
    return read_quantity(value, units.LENGTH, context, "> 0")


def rim(value: object, context: Context) -> Rim:
    """An edge, a list of edges, or {edges: ..., center: [...]}."""
    found: Rim = RIM_KEYS.read(value, context) if isinstance(value, dict) else Rim(read_names(value, context))
    return found


def inertia(value: object, context: Context) -> float | Vector | tuple[Vector, ...]:
    """Moment of inertia about z in the plane; 3 principal moments or a 3 x 3 tensor in space."""
    if context.dimension == 2:
        return read_quantity(value, units.INERTIA, context, "> 0")
    if isinstance(value, list) and len(value) == 3 and all(isinstance(row, list) for row in value):
        return tuple(read_vector(row, units.INERTIA, context) for row in value)
    if not isinstance(value, list) or len(value) != 3:
        raise Problem("3 principal moments or a 3 x 3 tensor [kg m^2] in space", shown(value))
    return read_vector(value, units.INERTIA, context)


def spans(value: object, context: Context) -> Spans:
    """A list of {until: ..., every: ...} with times that increase; the last one may leave `until` out."""
    if not isinstance(value, list | tuple) or not value or not all(isinstance(part, dict) for part in value):
        raise Problem("a list such as [{until: 0.1 s, every: 1 ms}, {every: 5 ms}]", shown(value))
    found: Spans = SPANS.read(value, context)
    ends = [part.until for part in found]
    if None in ends[:-1]:
        raise Problem("the key 'until' in every span but the last", "no such key")
    known = [end for end in ends if end is not None]
    if any(b <= a for a, b in itertools.pairwise(known)):
        raise Problem("spans that end one after the other", ", ".join(f"{end:g} s" for end in known))
    return found


def every(value: object, context: Context) -> int | Spans:
    """A number of steps, or spans."""
    if isinstance(value, list | tuple):
        return spans(value, context)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= COUNT:
        raise Problem("a number of steps >= 1, or a list of {until: ..., every: ...}", shown(value))
    return value


def snapshots(value: object, context: Context) -> float | Spans:
    """A time [s], or spans."""
    return spans(value, context) if isinstance(value, list | tuple) else read_quantity(value, units.TIME, context, "> 0")


_LENGTH = number_schema(units.LENGTH, "> 0")
_INERTIA = number_schema(units.INERTIA)
_ROW = array_schema(_INERTIA, 3, 3)
_TIME = number_schema(units.TIME, "> 0")
SPANS, RIM_KEYS = list_of(inline(Span), tuple), inline(Rim)
_SPANS = SPANS.told | {"minItems": 1}
_AXIS = {"type": "array", "items": {"type": "number"}}
_TURNS = [number_schema(units.ANGLE), mapping_schema(("axis", "angle"), axis=_AXIS, angle=number_schema(units.ANGLE))]
_WHOLE = {"type": "integer", "minimum": 1}


def _options(told: str, *options: dict[str, Any]) -> dict[str, Any]:
    return {"anyOf": list(options), "description": told}


def _each(value: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": value}


THICKNESS = Takes(thickness, _options("a thickness, or one a face", _LENGTH, _each(_LENGTH)))
RIM = Takes(
    rim,
    _options(
        "an edge, a list of edges, or {edges: ..., center: [...]}",
        *NAMES["anyOf"],
        RIM_KEYS.told,
    ),
)
INERTIA = Takes(
    inertia,
    _options("a moment of inertia [kg m^2], in space 3 principal ones or a tensor", _INERTIA, _ROW, array_schema(_ROW, 3, 3)),
)
ROTATION = Takes(
    turn,
    _options("an angle [rad], in space {axis: [x, y, z], angle: an angle [rad]}", *_TURNS),
    angle=lambda value: None if value is None else float(value.angle),
)
COUNTS = Takes(counts, _options("a number of modes, for all components or by their names", _WHOLE, _each(_WHOLE)))
EVERY = Takes(every, _options("a number of steps, or spans of time", _WHOLE, _SPANS))
SNAPSHOTS = Takes(snapshots, _options("a time between snapshots, or spans of time", _TIME, _SPANS))

Thickness = Annotated[float | dict[str, float], THICKNESS]
Rims = Annotated[dict[str, Rim], names(Annotated[Rim, RIM], words=True)]
Inertia = Annotated[float | Vector | tuple[Vector, ...], INERTIA]
Rotation = Annotated[Turn, ROTATION]
Counts = Annotated[int | dict[str, int], COUNTS]
Every = Annotated[int | Spans, EVERY]
Snapshots = Annotated[float | Spans, SNAPSHOTS]
Instant = Annotated[float, quantity("s", ">= 0")]
MeshFile = Annotated[str, "a mesh file (.msh, .vtu), its path from the folder of the scene"]
NewtonTolerance = Annotated[float, quantity("", "> 0", "< 0.01")]
