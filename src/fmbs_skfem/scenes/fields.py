"""Types of scene fields: quantities, vectors, places and functions of time, resolved while a scene is read.

Each type is a pydantic annotation: a validator, which raises `Problem`, and the JSON schema a text editor sees. What a validator
has to know of the scene, its dimension and its parameters, comes in the validation context.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema

from ..core import expressions
from ..core.expressions import Expression
from ..core.problems import Problem, shown
from . import functions, units
from .parameters import SCHEMA as PARAMETER
from .parameters import Range

Vector: TypeAlias = tuple[float, ...]


@dataclass(frozen=True)
class Context:
    """What fields need of the scene around them."""

    dimension: int = 3
    parameters: Mapping[str, units.Quantity] = field(default_factory=dict)
    ranges: Mapping[str, Range] = field(default_factory=dict)
    clock: bool = True  #: whether t is a time; in statics it stands for the load factor


@dataclass(frozen=True)
class Place:
    """A point of a body: a frame or point group, or an arc length s [m] from the start of a line; neither for one with a centre."""

    body: str
    group: str | None = None
    s: float | None = None


@dataclass(frozen=True)
class Turn:
    """A rotation by an angle [rad], about `axis` in space."""

    angle: float
    axis: Vector | None = None


def _context(info: ValidationInfo) -> Context:
    return info.context if isinstance(info.context, Context) else Context()


def quantity(value: object, dimension: units.Dimension, context: Context, sign: str = "") -> float:
    """The SI value of a field; `sign` is "", "> 0" or ">= 0"."""
    number = units.convert(value, dimension, context.parameters)
    if (sign == "> 0" and number <= 0.0) or (sign == ">= 0" and number < 0.0):
        raise Problem(f"{dimension} {sign}", shown(value))
    return number


def tolerance(value: object, limit: float, context: Context) -> float:
    """A number above zero and below a limit."""
    number = quantity(value, units.NUMBER, context)
    if not 0.0 < number < limit:
        raise Problem(f"a number > 0 and < {limit:g}", shown(value))
    return number


def vector(value: object, dimension: units.Dimension, context: Context, size: int | None = None) -> Vector:
    """A list of `size` quantities, by default as many as the scene has dimensions."""
    size = size or context.dimension
    if not isinstance(value, list | tuple) or len(value) != size:
        axes = ", ".join("xyz"[:size]) if size == context.dimension else f"{size} entries"
        raise Problem(f"a list of {size} ({axes}), each {dimension}, in a scene of dimension {context.dimension}", shown(value))
    return tuple(quantity(entry, dimension, context) for entry in value)


def spin(value: object, dimension: units.Dimension, context: Context) -> float | Vector:
    """A moment or an angular velocity: a number about z in the plane, a vector in space."""
    return quantity(value, dimension, context) if context.dimension == 2 else vector(value, dimension, context)


def follower(value: object, dimension: units.Dimension, context: Context) -> Vector:
    """A force in the frame of the slope, tangential and normal in the plane, tangential in space; or along axes of a frame."""
    if context.dimension == 2 or (isinstance(value, list) and len(value) == 3):
        return vector(value, dimension, context)
    return (quantity(value[0] if isinstance(value, list) and len(value) == 1 else value, dimension, context),)


def place(value: object, context: Context) -> Place:
    """`body.group`, `body`, or {body: ..., s: ...}."""
    form = "a place such as 'beam.right' or {body: beam, s: 0.3 m}"
    if isinstance(value, Place):
        return value
    if isinstance(value, str) and value.strip():
        body, _, group = value.strip().partition(".")
        if body and (group or "." not in value):
            return Place(body, group or None)
    if isinstance(value, dict) and set(value) == {"body", "s"} and isinstance(value["body"], str):
        return Place(value["body"], s=quantity(value["s"], units.LENGTH, context, ">= 0"))
    raise Problem(form, f"a mapping of {', '.join(map(str, value)) or 'nothing'}" if isinstance(value, dict) else shown(value))


def target(value: object, context: Context) -> Place | Vector | None:
    """The other side of a joint: a place, a fixed point, or `ground` for the point where the first side is."""
    if value is None or value == "ground":
        return None
    return vector(value, units.LENGTH, context) if isinstance(value, list | tuple) else place(value, context)


def carrier(value: object, context: Context) -> Place | None:
    """The other side of a joint as a place that carries directions, or `ground`."""
    return None if value is None or value == "ground" else place(value, context)


def axis(value: object, context: Context) -> Vector:
    """A direction in space that is not zero; in the plane everything turns about z."""
    if context.dimension == 2:
        raise Problem(
            "no axis in the plane, where everything turns about z", shown(value), "delete it, or write a scene of dimension 3"
        )
    direction = vector(value, units.NUMBER, context)
    if not any(direction):
        raise Problem("an axis that is not zero", shown(value))
    return direction


def turn(value: object, context: Context) -> Turn:
    """An angle in the plane, {axis: [x, y, z], angle: ...} in space."""
    if isinstance(value, Turn):
        return value
    if context.dimension == 2:
        return Turn(quantity(value, units.ANGLE, context))
    if not isinstance(value, dict) or set(value) != {"axis", "angle"}:
        raise Problem("a rotation in space such as {axis: [0, 0, 1], angle: 30 deg}", shown(value))
    return Turn(quantity(value["angle"], units.ANGLE, context), axis(value["axis"], context))


def of_time(value: object, context: Context, dimension: units.Dimension = units.NUMBER) -> Expression:
    """An expression of t [s] and of the scene's parameters (in SI units) of a dimension, or a number."""
    if isinstance(value, Expression):
        return value
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise Problem("an expression of t", shown(value), expressions.GRAMMAR)
    found = expressions.of_time(value, {name: quantity.value for name, quantity in context.parameters.items()})
    if isinstance(value, str):
        functions.check(value, dimension, context.parameters, context.clock)
    return found


def angle_of_time(value: object, context: Context) -> Expression:
    """An angle [rad] as an expression of t, or as a constant quantity such as '90 deg'."""
    try:
        return of_time(value, context, units.ANGLE)
    except Problem:
        try:
            return expressions.of_time(units.convert(value, units.ANGLE, context.parameters))
        except Problem:
            pass
        raise


def motions(value: object, context: Context) -> tuple[Expression, ...]:
    """One expression of t a coordinate."""
    if not isinstance(value, list | tuple) or len(value) != context.dimension:
        raise Problem(f"a list of {context.dimension} expressions of t", shown(value))
    return tuple(of_time(entry, context, units.LENGTH) for entry in value)


def counts(value: object, context: Context) -> int | dict[str, int]:
    """A number of modes, for all components or by their names."""
    if isinstance(value, dict) and value:
        return {str(name): _count(count) for name, count in value.items()}
    return _count(value)


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 1_000_000:
        raise Problem("a whole number >= 1, or a mapping of names and such numbers", shown(value))
    return value


def _before(law: Callable[..., Any], *arguments: object) -> BeforeValidator:
    def validate(value: object, info: ValidationInfo) -> Any:
        context = _context(info)
        return law(value, *arguments[:1], context, *arguments[1:])

    return BeforeValidator(validate)


def plain(law: Callable[[object, Context], Any]) -> PlainValidator:
    def validate(value: object, info: ValidationInfo) -> Any:
        return law(value, _context(info))

    return PlainValidator(validate)


def number_schema(dimension: units.Dimension, sign: str = "") -> dict[str, Any]:
    bound = {"> 0": {"exclusiveMinimum": 0}, ">= 0": {"minimum": 0}}.get(sign, {})
    return {"anyOf": [{"type": "number", **bound}, {"type": "string"}], "description": f"{dimension} {sign}".strip()}


def _quantity(dimension: units.Dimension, sign: str = "") -> tuple[BeforeValidator, WithJsonSchema]:
    return _before(quantity, dimension, sign), WithJsonSchema(number_schema(dimension, sign))


def _below(limit: float) -> tuple[BeforeValidator, WithJsonSchema]:
    """A tolerance: a number between zero and a limit."""
    number = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": limit}
    schema = {"anyOf": [number, {"type": "string"}], "description": f"a number > 0 and < {limit:g}"}
    return _before(tolerance, limit), WithJsonSchema(schema)


def _vector(dimension: units.Dimension, law: Callable[..., Any] = vector) -> tuple[BeforeValidator, WithJsonSchema]:
    schema = {"type": "array", "items": number_schema(dimension), "minItems": 2, "maxItems": 3}
    text = f"{dimension} per coordinate"
    if law is not vector:
        return _before(law, dimension), WithJsonSchema({"anyOf": [number_schema(dimension), schema], "description": text})
    return _before(law, dimension), WithJsonSchema(schema | {"description": text})


_EXPRESSION = {"anyOf": [{"type": "number"}, {"type": "string", "maxLength": expressions.LENGTH}]}
_PLACE: dict[str, Any] = {
    "anyOf": [
        {"type": "string"},
        {
            "type": "object",
            "properties": {"body": {"type": "string"}, "s": number_schema(units.LENGTH, ">= 0")},
            "required": ["body", "s"],
            "additionalProperties": False,
        },
    ],
    "description": "body.frame or body.group, or {body: name, s: arc length}",
}
_FIXED = {"type": "array", "items": number_schema(units.LENGTH), "minItems": 2, "maxItems": 3}
_text = PlainSerializer(lambda expression: expression.text, return_type=str)

Length = Annotated[float, *_quantity(units.LENGTH, "> 0")]
Time = Annotated[float, *_quantity(units.TIME, "> 0")]
Instant = Annotated[float, *_quantity(units.TIME, ">= 0")]
Mass = Annotated[float, *_quantity(units.MASS, "> 0")]
Density = Annotated[float, *_quantity(units.DENSITY, "> 0")]
Pressure = Annotated[float, *_quantity(units.PRESSURE, "> 0")]
SignedPressure = Annotated[float, *_quantity(units.PRESSURE)]
LineForce = Annotated[float, *_quantity(units.LINE_FORCE)]
AxialStiffness = Annotated[float, *_quantity(units.FORCE, "> 0")]
BendingStiffness = Annotated[float, *_quantity(units.BENDING_STIFFNESS, "> 0")]
LineDensity = Annotated[float, *_quantity(units.LINE_DENSITY, "> 0")]
Rate = Annotated[float, *_quantity(units.RATE, ">= 0")]
Delay = Annotated[float, *_quantity(units.TIME, ">= 0")]
Tolerance = Annotated[float, *_below(1.0)]
NewtonTolerance = Annotated[float, *_below(0.01)]
Number = Annotated[float, *_quantity(units.NUMBER)]
Parameter = Annotated[float, WithJsonSchema(PARAMETER)]

TorsionalStiffness = Annotated[float, *_quantity(units.TORSIONAL_STIFFNESS, ">= 0")]
TorsionalDamping = Annotated[float, *_quantity(units.TORSIONAL_DAMPING, ">= 0")]
FixedAngle = Annotated[float, *_quantity(units.ANGLE)]

Position = Annotated[Vector, *_vector(units.LENGTH)]
Velocity = Annotated[Vector, *_vector(units.VELOCITY)]
Acceleration = Annotated[Vector, *_vector(units.ACCELERATION)]
Force = Annotated[Vector, *_vector(units.FORCE)]
Traction = Annotated[Vector, *_vector(units.PRESSURE)]
EdgeForce = Annotated[Vector, *_vector(units.LINE_FORCE)]
Direction = Annotated[Vector, *_vector(units.NUMBER)]
Moment = Annotated[float | Vector, *_vector(units.MOMENT, spin)]
AngularVelocity = Annotated[float | Vector, *_vector(units.ANGULAR_VELOCITY, spin)]
Axis = Annotated[
    Vector,
    plain(axis),
    WithJsonSchema(
        {"type": "array", "items": number_schema(units.NUMBER), "minItems": 3, "maxItems": 3, "description": "an axis in space"}
    ),
]
FollowerForce = Annotated[Vector, *_vector(units.FORCE, follower)]

At = Annotated[Place, plain(place), WithJsonSchema(_PLACE)]
To = Annotated[
    Place | Vector | None,
    plain(target),
    WithJsonSchema(
        {"anyOf": [*_PLACE["anyOf"], _FIXED, {"type": "null"}], "description": "a place as in `at`, a fixed point [m], or ground"}
    ),
]
Carrier = Annotated[
    Place | None,
    plain(carrier),
    WithJsonSchema({"anyOf": [*_PLACE["anyOf"], {"type": "null"}], "description": "a place as in `at`, or ground"}),
]
Rotation = Annotated[
    Turn | None,
    plain(turn),
    WithJsonSchema(
        {
            "anyOf": [
                number_schema(units.ANGLE),
                {
                    "type": "object",
                    "properties": {"axis": {"type": "array", "items": {"type": "number"}}, "angle": number_schema(units.ANGLE)},
                    "required": ["axis", "angle"],
                    "additionalProperties": False,
                },
            ],
            "description": "an angle [rad], in space {axis: [x, y, z], angle: an angle [rad]}",
        }
    ),
]
Counts = Annotated[
    int | dict[str, int],
    plain(counts),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "integer", "minimum": 1},
                {"type": "object", "additionalProperties": {"type": "integer", "minimum": 1}},
            ],
            "description": "a number of modes, for all components or by their names",
        }
    ),
]
History = Annotated[Expression, plain(of_time), WithJsonSchema(_EXPRESSION | {"description": "expression of t"}), _text]
Angle = Annotated[
    Expression, plain(angle_of_time), WithJsonSchema(_EXPRESSION | {"description": "angle [rad], expression of t"}), _text
]
Motion = Annotated[
    tuple[Expression, ...],
    plain(motions),
    WithJsonSchema({"type": "array", "items": _EXPRESSION, "minItems": 2, "maxItems": 3, "description": "expressions of t [m]"}),
    PlainSerializer(lambda motion: [expression.text for expression in motion], return_type=list[str]),
]
