"""Fields of bodies and analyses in a scene: thicknesses, rims, inertias, rotations, numbers of
modes, spans of time.
"""

from __future__ import annotations

import itertools
from typing import Annotated, Any, TypeAlias, TypeGuard

import numpy as np

from ..bodies.beams.drawn_sections import POINT
from ..bodies.plate import Rim
from ..bodies.sections import Material
from ..core.algebra.rotations import rotation
from ..core.errors import closest
from ..core.storage.records import dataclass
from ..core.values import display, units
from ..core.values.fields import (
    NAMES,
    Context,
    Length,
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
    vector,
    whole,
)
from ..core.values.mappings import at_fractions, inline, list_of, names, one_of, takes
from ..core.values.problems import Problem, shown
from .known_materials import KNOWN

COUNT = 1_000_000  #: largest number of steps between stored states, and of modes


@dataclass(frozen=True)
class Turn:
    """A rotation by an angle [rad], about `axis` in space."""

    angle: float
    axis: Vector | None = None

    @property
    def matrix(self) -> np.ndarray:
        """(c, c), about z in the plane."""
        if self.axis is None:
            c = np.cos(self.angle)
            s = np.sin(self.angle)
            return np.array([[c, -s], [s, c]])
        return rotation(self.angle * np.array(self.axis) / np.linalg.norm(self.axis))


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
        what, remedy = (
            "a rotation in space such as {axis: [0, 0, 1], angle: 30 deg}",
            "say it by axis and angle",
        )
        if not is_matrix(value):
            raise Problem(what, shown(value))
        if np.linalg.det(value) > 0.0:
            raise Problem(what, "a matrix", remedy)
        raise Problem(
            what,
            "a matrix that mirrors",
            "a mirrored body is another one: mirror its mesh, of a part train it anew",
        )
    return Turn(
        read_quantity(value["angle"], units.ANGLE, context), read_axis(value["axis"], context)
    )


def is_matrix(value: object) -> TypeGuard[list[list[float]]]:
    """Whether it is a list of 3 lists of 3 numbers."""
    rows = value if isinstance(value, list) and len(value) == 3 else []
    return bool(rows) and all(
        isinstance(row, list) and len(row) == 3 and all(isinstance(x, int | float) for x in row)
        for row in rows
    )


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
    """A list of {until: ..., every: ...} with times that increase; the last one may leave `until`
    out.
    """
    if (
        not isinstance(value, list)
        or not value
        or not all(isinstance(part, dict) for part in value)
    ):
        raise Problem("a list such as [{until: 0.1 s, every: 1 ms}, {every: 5 ms}]", shown(value))
    found: Spans = SPAN_LIST.read(value, context)
    ends = [part.until for part in found]
    if None in ends[:-1]:
        raise Problem("the key 'until' in every span but the last", "no such key")
    known = [end for end in ends if end is not None]
    if any(b <= a for a, b in itertools.pairwise(known)):
        raise Problem(
            "spans that end one after the other", ", ".join(f"{end:g} s" for end in known)
        )
    return found


def every(value: object, context: Context) -> int | Spans:
    """A number of steps; a time between states with its unit, which is one span; or spans."""
    if isinstance(value, str):
        return (Span(TIME.read(value, context)),)
    return STEPS_OR_SPANS.read(value, context)


def read_display_units(value: object, context: Context) -> tuple[str, ...]:
    """Units in which results are read, one a dimension."""
    found: dict[str, str] = {}
    for one in read_names(value, context):
        base = display.describe(one)[0]
        if not base:
            raise Problem(
                "a unit such as mm, MPa or rpm",
                shown(one),
                "one that a quantity may have in a scene",
            )
        if base in found:
            raise Problem("one unit of each dimension", f"{shown(found[base])} and {shown(one)}")
        found[base] = one
    return tuple(found.values())


def parts_or(told: str, single: Takes, parts: Takes, kind: type) -> Takes:
    """One value for everything, or parts in a mapping or a list."""

    def read(value: object, context: Context) -> Any:
        if isinstance(value, kind):
            return parts.read(value, context)
        try:
            return single.read(value, context)
        except Problem as problem:
            raise Problem(f"{problem.expected} ({told})", problem.got, problem.remedy) from problem

    return Takes(read, lambda: _options(told, single.schema, parts.schema))


def _options(told: str, *options: dict[str, Any]) -> dict[str, Any]:
    return {"anyOf": list(options), "description": told}


EDGES = Takes(lambda value, context: Rim(read_names(value, context)), NAMES)
SPAN_LIST = list_of(inline(Span), tuple)
SPANS = Takes(spans, SPAN_LIST.schema | {"minItems": 1})
NUMBER_OF = whole(1, COUNT)
_INERTIA = number_schema(units.INERTIA)
_ROW = array_schema(_INERTIA, 3, 3)
_AXIS = {"type": "array", "items": {"type": "number"}}
_TURNS = [
    number_schema(units.ANGLE),
    mapping_schema(("axis", "angle"), axis=_AXIS, angle=number_schema(units.ANGLE)),
]

THICKNESS = parts_or("a thickness, or one a face", quantity("m", "> 0"), names(Length, 1), dict)
RIM = parts_or(
    "an edge, a list of edges, or {edges: ..., center: [...], slopes: true or false}",
    EDGES,
    inline(Rim),
    dict,
)
INERTIA = Takes(
    inertia,
    _options(
        "a moment of inertia [kg m^2], in space 3 principal ones or a tensor",
        _INERTIA,
        _ROW,
        array_schema(_ROW, 3, 3),
    ),
)


def material(value: object, context: Context) -> Material:
    """A material that is known by its name."""
    if not isinstance(value, str) or value not in KNOWN:
        hint = closest(value, KNOWN) if isinstance(value, str) else ""
        remedy = "or write young_modulus, density and poisson_ratio"
        raise Problem(f"one of {', '.join(KNOWN)}", shown(value) + hint, remedy)
    return KNOWN[value]


MATERIAL = parts_or(
    "a material by its name, or {young_modulus: ..., density: ..., poisson_ratio: ...}",
    Takes(material, {"type": "string", "enum": list(KNOWN)}),
    takes(Material),
    dict,
)
ROTATION = Takes(
    turn,
    _options("an angle [rad], in space {axis: [x, y, z], angle: an angle [rad]}", *_TURNS),
    angle=lambda value: None if value is None else float(value.angle),
)
COUNTS = parts_or(
    "a number of modes, for all components or by their names",
    NUMBER_OF,
    names(Annotated[int, NUMBER_OF], 1),
    dict,
)
TIME = quantity("s", "> 0")
STEPS_OR_SPANS = parts_or(
    "a number of steps, a time such as 5 ms, or spans of time", NUMBER_OF, SPANS, list
)
EVERY = Takes(
    every, STEPS_OR_SPANS.schema | {"anyOf": [NUMBER_OF.schema, TIME.schema, SPANS.schema]}
)
SNAPSHOTS = parts_or("a time between snapshots, or spans of time", TIME, SPANS, list)

DIRECTION = parts_or(
    "a direction, or directions at fractions of the length",
    vector(""),
    at_fractions(vector("")),
    dict,
)
TWIST = parts_or(
    "an angle, or angles at fractions of the length",
    quantity("rad"),
    at_fractions(quantity("rad")),
    dict,
)
OFFSET = parts_or(
    "centroid, shear_centre, or a point [y, z]", one_of(("centroid", "shear_centre")), POINT, list
)

Thickness = Annotated[float | dict[str, float], THICKNESS]
Rims = Annotated[dict[str, Rim], names(Annotated[Rim, RIM], words=True)]
Inertia = Annotated[float | Vector | tuple[Vector, ...], INERTIA]
Rotation = Annotated[Turn, ROTATION]
Counts = Annotated[int | dict[str, int], COUNTS]
Every = Annotated[int | Spans, EVERY]
Snapshots = Annotated[float | Spans, SNAPSHOTS]
DisplayUnits = Annotated[
    tuple[str, ...],
    Takes(read_display_units, NAMES | {"description": "units of results, such as [mm, MPa, rpm]"}),
]
Instant = Annotated[float, quantity("s", ">= 0")]
MeshFile = Annotated[
    str,
    "a mesh file (.msh, .vtu, .inp, .bdf, .nas, .med, .vtk), its path from the folder of the scene",
]
NewtonTolerance = Annotated[float, quantity("", "> 0", "< 0.01")]
