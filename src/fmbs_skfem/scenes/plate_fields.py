"""Types of scene fields for plates, rigid bodies and instants: names, thicknesses, rims, inertias, teeth, spans of time."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from pydantic import WithJsonSchema

from ..core.problems import Problem, shown
from . import units
from .fields import Context, Vector, number_schema, plain, quantity, vector

COUNT = 1_000_000  #: largest number of steps between stored states


@dataclass(frozen=True)
class RimEdges:
    """Edges that move as one rigid frame, and its origin in the frame of the scene [m]: by default the middle of the edges."""

    edges: tuple[str, ...]
    center: Vector | None = None


@dataclass(frozen=True)
class Span:
    """States every so many seconds, until a time [s]; the last span may last to the end."""

    every: float
    until: float | None = None


Spans: TypeAlias = tuple[Span, ...]


def names(value: object, context: Context) -> tuple[str, ...]:
    """A name or a list of different ones."""
    found = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list | tuple) else ()
    texts = tuple(name for name in found if isinstance(name, str) and name.strip())
    if not texts or len(texts) < len(found):
        raise Problem("a name or a list of names", shown(value))
    if len(set(texts)) < len(texts):
        raise Problem("each name once", ", ".join(texts))
    return texts


def letters(value: object, context: Context) -> str:
    """Components by their letters, such as `xz`; none is an empty text."""
    axes = "xyz"[: context.dimension]
    if not isinstance(value, str) or not set(value) <= set(axes) or len(set(value)) < len(value):
        raise Problem(f"letters of {axes}, each at most once", shown(value))
    return value


def thickness(value: object, context: Context) -> float | dict[str, float]:
    """One thickness [m], or one for each named face."""
    if isinstance(value, dict) and value:
        return {str(name): quantity(part, units.LENGTH, context, "> 0") for name, part in value.items()}
    if isinstance(value, dict | list):
        raise Problem("a thickness, or a mapping of faces and thicknesses", shown(value))
    return quantity(value, units.LENGTH, context, "> 0")


def rim(value: object, context: Context) -> RimEdges:
    """An edge, a list of edges, or {edges: ..., center: [...]}."""
    if isinstance(value, RimEdges):
        return value
    if not isinstance(value, dict):
        return RimEdges(names(value, context))
    if "edges" not in value or not set(value) <= {"edges", "center"}:
        raise Problem("an edge, a list of edges, or {edges: [...], center: [...]}", f"a mapping of {', '.join(map(str, value))}")
    center = value.get("center")
    return RimEdges(names(value["edges"], context), None if center is None else vector(center, units.LENGTH, context))


def inertia(value: object, context: Context) -> float | Vector | tuple[Vector, ...]:
    """Moment of inertia about z in the plane; 3 principal moments or a 3 x 3 tensor in space."""
    if context.dimension == 2:
        return quantity(value, units.INERTIA, context, "> 0")
    if isinstance(value, list) and len(value) == 3 and all(isinstance(row, list) for row in value):
        return tuple(vector(row, units.INERTIA, context) for row in value)
    if not isinstance(value, list) or len(value) != 3:
        raise Problem("3 principal moments or a 3 x 3 tensor [kg m^2] in space", shown(value))
    return vector(value, units.INERTIA, context)


def teeth(value: object, context: Context) -> tuple[int, int]:
    """Numbers of teeth of two wheels; negative for inside teeth."""
    pair = tuple(value) if isinstance(value, list | tuple) else ()
    if len(pair) != 2 or any(isinstance(n, bool) or not isinstance(n, int) or n == 0 or abs(n) > COUNT for n in pair):
        raise Problem("two whole numbers that are not zero", shown(value))
    return int(pair[0]), int(pair[1])


def spans(value: object, context: Context) -> Spans:
    """A list of {until: ..., every: ...} with times that increase; the last one may leave `until` out."""
    form = "a list such as [{until: 0.1 s, every: 1 ms}, {every: 5 ms}]"
    if not isinstance(value, list | tuple) or not value:
        raise Problem(form, shown(value))
    found = tuple(part if isinstance(part, Span) else _span(part, context, form) for part in value)
    ends = [part.until for part in found]
    if None in ends[:-1]:
        raise Problem("the key 'until' in every span but the last", "no such key")
    known = [end for end in ends if end is not None]
    if any(b <= a for a, b in itertools.pairwise(known)):
        raise Problem("spans that end one after the other", ", ".join(f"{end:g} s" for end in known))
    return found


def _span(value: object, context: Context, form: str) -> Span:
    if not isinstance(value, dict) or "every" not in value or not set(value) <= {"until", "every"}:
        raise Problem(form, f"a mapping of {', '.join(map(str, value))}" if isinstance(value, dict) else shown(value))
    until = value.get("until")
    end = None if until is None else quantity(until, units.TIME, context, "> 0")
    return Span(quantity(value["every"], units.TIME, context, "> 0"), end)


def every(value: object, context: Context) -> int | Spans:
    """A number of steps, or spans."""
    if isinstance(value, list | tuple):
        return spans(value, context)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= COUNT:
        raise Problem("a number of steps >= 1, or a list of {until: ..., every: ...}", shown(value))
    return value


def snapshots(value: object, context: Context) -> float | Spans:
    """A time [s], or spans."""
    return spans(value, context) if isinstance(value, list | tuple) else quantity(value, units.TIME, context, "> 0")


_NAME: dict[str, Any] = {"type": "string", "minLength": 1}
_NAMES: dict[str, Any] = {"anyOf": [_NAME, {"type": "array", "items": _NAME, "minItems": 1}]}
_LENGTH = number_schema(units.LENGTH, "> 0")
_POINT = {"type": "array", "items": number_schema(units.LENGTH), "minItems": 2, "maxItems": 3}
_INERTIA = number_schema(units.INERTIA)
_ROW = {"type": "array", "items": _INERTIA, "minItems": 3, "maxItems": 3}
_TIME = number_schema(units.TIME, "> 0")
_SPANS = {
    "type": "array",
    "minItems": 1,
    "items": {
        "type": "object",
        "properties": {"until": _TIME, "every": _TIME},
        "required": ["every"],
        "additionalProperties": False,
    },
}

Names = Annotated[tuple[str, ...], plain(names), WithJsonSchema(_NAMES | {"description": "a name or a list of names"})]
Letters = Annotated[
    str,
    plain(letters),
    WithJsonSchema({"type": "string", "pattern": "^[xyz]{0,3}$", "description": "letters of xyz, or an empty text"}),
]
Thickness = Annotated[
    float | dict[str, float],
    plain(thickness),
    WithJsonSchema(
        {"anyOf": [_LENGTH, {"type": "object", "additionalProperties": _LENGTH}], "description": "a thickness, or one a face"}
    ),
]
Rim = Annotated[
    RimEdges,
    plain(rim),
    WithJsonSchema(
        {
            "anyOf": [
                *_NAMES["anyOf"],
                {
                    "type": "object",
                    "properties": {"edges": _NAMES, "center": _POINT},
                    "required": ["edges"],
                    "additionalProperties": False,
                },
            ],
            "description": "an edge, a list of edges, or {edges: ..., center: [...]}",
        }
    ),
]
Inertia = Annotated[
    float | Vector | tuple[Vector, ...],
    plain(inertia),
    WithJsonSchema(
        {
            "anyOf": [_INERTIA, _ROW, {"type": "array", "items": _ROW, "minItems": 3, "maxItems": 3}],
            "description": "a moment of inertia [kg m^2], in space 3 principal ones or a tensor",
        }
    ),
]
Teeth = Annotated[
    tuple[int, int],
    plain(teeth),
    WithJsonSchema(
        {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2, "description": "two whole numbers"}
    ),
]
Every = Annotated[
    int | Spans,
    plain(every),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1}, _SPANS], "description": "a number of steps, or spans of time"}),
]
Snapshots = Annotated[
    float | Spans,
    plain(snapshots),
    WithJsonSchema({"anyOf": [_TIME, _SPANS], "description": "a time between snapshots, or spans of time"}),
]
