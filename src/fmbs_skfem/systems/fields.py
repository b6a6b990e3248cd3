"""What fields of joints, loads and outputs take beside those of `core.values.fields`: places, sides
of joints, forces that turn.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, TypeAlias

from ..core.values import units
from ..core.values.fields import (
    AXIS,
    HISTORY,
    NAMED,
    Context,
    Takes,
    Vector,
    array_schema,
    either,
    mapping_schema,
    name_in,
    number_schema,
    quantity,
    read_quantity,
    read_vector,
    response,
    spin,
    vector,
)
from ..core.values.problems import Problem, shown
from .places import At, Ground
from .system import Signal

__all__ = [
    "quantity",
    "vector",
    "spin",
    "response",
    "Takes",
    "Place",
    "End",
    "OtherEnd",
    "Carrier",
    "Axis",
    "Direction",
    "Names",
    "BodyName",
    "Body",
    "OnSurface",
    "Stressed",
    "JointName",
    "InSection",
    "Heights",
    "Letters",
    "Teeth",
    "History",
    "FollowerForce",
]

COUNT = 1_000_000  #: most teeth


def read_place(value: object, context: Context) -> At:
    """`body.group`, `body`, or {body: ..., s: ...}."""
    form = "a place such as 'beam.right' or {body: beam, s: 0.3 m}"
    if isinstance(value, str) and value.strip():
        body, _, group = value.strip().partition(".")
        if body and (group or "." not in value):
            return At(body, group)
    if isinstance(value, dict) and set(value) == {"body", "s"} and isinstance(value["body"], str):
        return At(value["body"], read_quantity(value["s"], units.LENGTH, context, ">= 0"))
    raise Problem(
        form,
        f"a mapping of {', '.join(map(str, value)) or 'nothing'}"
        if isinstance(value, dict)
        else shown(value),
    )


def read_end(value: object, context: Context) -> At | Vector | None:
    """The other side of a joint: a place, a fixed point, or `ground` for the point where the first
    side is.
    """
    if value is None or value == "ground":
        return None
    return (
        read_vector(value, units.LENGTH, context)
        if isinstance(value, list | tuple)
        else read_place(value, context)
    )


def read_carrier(value: object, context: Context) -> At | None:
    """The other side of a joint as a place that carries directions, or `ground`."""
    return None if value is None or value == "ground" else read_place(value, context)


def read_follower(value: object, dimension: units.Dimension, context: Context) -> Vector:
    """A force in the frame of the slope, tangential and normal in the plane, tangential in space;
    or along axes of a frame.
    """
    if context.dimension == 2 or (isinstance(value, list) and len(value) == 3):
        return read_vector(value, dimension, context)
    return (
        read_quantity(
            value[0] if isinstance(value, list) and len(value) == 1 else value, dimension, context
        ),
    )


def read_pair(value: object, context: Context) -> tuple[float, float]:
    """Two lengths, y and z in a section."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise Problem("two lengths, y and z", shown(value))
    y, z = (read_quantity(one, units.LENGTH, context) for one in value)
    return y, z


def read_letters(value: object, context: Context) -> str:
    """Components by their letters, such as `xz`; none is an empty text."""
    axes = "xyz"[: context.dimension]
    if not isinstance(value, str) or not set(value) <= set(axes) or len(set(value)) < len(value):
        raise Problem(f"letters of {axes}, each at most once", shown(value))
    return value


def read_teeth(value: object, context: Context) -> tuple[int, int]:
    """Numbers of teeth of two wheels; negative for inside teeth."""
    pair = tuple(value) if isinstance(value, list | tuple) else ()
    if len(pair) != 2 or any(
        isinstance(n, bool) or not isinstance(n, int) or n == 0 or abs(n) > COUNT for n in pair
    ):
        raise Problem("two whole numbers that are not zero", shown(value))
    return int(pair[0]), int(pair[1])


def read_heights(value: object, context: Context) -> Any:
    """Lengths in a list, or in a list of lists of one length."""
    rows = value if isinstance(value, list | tuple) else None
    lists = [row for row in rows or () if isinstance(row, list | tuple)]
    if rows is None or (lists and (len(lists) < len(rows) or len({len(row) for row in lists}) > 1)):
        raise Problem("lengths in a list, or in lists of one length", shown(value))
    if not lists:
        return tuple(read_quantity(one, units.LENGTH, context) for one in rows)
    return tuple(tuple(read_quantity(one, units.LENGTH, context) for one in row) for row in lists)


_PLACES: list[dict[str, Any]] = [
    {"type": "string"},
    mapping_schema(("body", "s"), body={"type": "string"}, s=number_schema(units.LENGTH, ">= 0")),
]
_FIXED = array_schema(number_schema(units.LENGTH), 2, 3)
_NULL = {"type": "null"}
_LETTERS = {
    "type": "string",
    "pattern": "^[xyz]{0,3}$",
    "description": "letters of xyz, or an empty text",
}

PLACE = Takes(
    read_place,
    {"anyOf": _PLACES, "description": "body.frame or body.group, or {body: name, s: arc length}"},
)
END = Takes(
    read_end,
    {
        "anyOf": [*_PLACES, _FIXED, _NULL],
        "description": "a place as in `at`, a fixed point [m], or ground",
    },
)
CARRIER = Takes(
    read_carrier, {"anyOf": [*_PLACES, _NULL], "description": "a place as in `at`, or ground"}
)
IN_SECTION = Takes(read_pair, array_schema(number_schema(units.LENGTH), 2, 2))
LETTERS = Takes(read_letters, _LETTERS)
_ROW = array_schema(number_schema(units.LENGTH), 1)
HEIGHTS = Takes(
    read_heights,
    {"anyOf": [_ROW, array_schema(_ROW, 1)], "description": "lengths in a list, or in lists"},
)
TEETH = Takes(
    read_teeth, array_schema({"type": "integer"}, 2, 2) | {"description": "two whole numbers"}
)

Place: TypeAlias = Annotated[At, PLACE]  #: a point of a body
End: TypeAlias = Annotated[At | Ground | None, END]  #: a place, a fixed point, or the ground
OtherEnd: TypeAlias = Annotated[At | Ground, END]  #: where the ground alone is no side
Carrier: TypeAlias = Annotated[At | None, CARRIER]  #: a place with directions, or the ground
Axis: TypeAlias = Annotated[Ground, AXIS]  #: of rotation, in space
Direction: TypeAlias = Annotated[Ground, vector("")]
Names: TypeAlias = Annotated[tuple[str, ...], NAMED]  #: one or several
BodyName: TypeAlias = Annotated[str, name_in("bodies", "a name of a body")]
Body: TypeAlias = Annotated[str, name_in("surfaces", "a name of a body")]  #: a plate or shell
OnSurface: TypeAlias = Annotated[At, replace(PLACE, names="surfaces")]
#: a place of a plate, a shell, a beam or a cable
Stressed: TypeAlias = Annotated[At, replace(PLACE, names="stressed")]
JointName: TypeAlias = Annotated[str, name_in("joints", "a name of a joint")]
#: y and z in the section of a beam
InSection: TypeAlias = Annotated[tuple[float, float], IN_SECTION]
Heights: TypeAlias = Annotated[Any, HEIGHTS]  #: heights in a list, or in lists of one length
Letters: TypeAlias = Annotated[str, LETTERS]  #: components of a vector
Teeth: TypeAlias = Annotated[tuple[int, int], TEETH]
History: TypeAlias = Annotated[Signal, HISTORY]  #: factor over time
FollowerForce: TypeAlias = Annotated[Ground, either("N", read_follower)]
