"""What fields of declarations take: quantities with a unit, vectors, functions of time, names; read
from a scene, shown to editors.

    stiffness: Annotated[float, fields.quantity("N m/rad", ">= 0"), "of the spring"] = 0.0

A dataclass that is declared with such fields is a struct of SI numbers in Python. In a scene its
fields are keys: `Takes` reads the value of one, which raises `Problem` where it does not fit, and
has the JSON schema that a text editor sees. What reading has to know of the scene, its dimension
and its parameters, is the `Context`.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from dataclasses import field
from typing import Annotated, Any, TypeAlias

from .. import own_words
from ..errors import closest
from ..storage.records import dataclass
from . import expressions, functions, quantities, units
from .expressions import Expression
from .inputs import Source
from .problems import Problem, shown
from .ranges import Parameter
from .responses import OfState, of_state

Vector: TypeAlias = tuple[float, ...]
Schema: TypeAlias = dict[str, Any]
AXES = "xyz"  #: letters of the coordinates
#: signs in JSON schemas
BOUNDS = {
    ">": "exclusiveMinimum",
    ">=": "minimum",
    "<": "exclusiveMaximum",
    "<=": "maximum",
}


@dataclass(frozen=True)
class Context:
    """What fields need of the scene around them."""

    dimension: int = 3
    parameters: Mapping[str, units.Quantity] = field(default_factory=dict)
    ranges: Mapping[str, Parameter] = field(default_factory=dict)
    clock: bool = True  #: whether t is a time; in statics it stands for the load factor
    inputs: Mapping[str, Source] = field(default_factory=dict)
    modules: tuple[str, ...] = ()  #: of the Python files that the scene lists


@dataclass(frozen=True, eq=False)
class Takes:
    """What a field takes: `read` makes its value of that of a scene."""

    read: Callable[[object, Context], Any]
    #: its schema; a function where that is not the same all the time
    describe: Schema | Callable[[], Schema]
    names: str = ""  #: the section of a scene, or the kind of bodies, one of which it names
    #: angle [rad] that a value of it is, None where that changes with time
    angle: Callable[[Any], float | None] | None = None
    #: how its default stands in the schema, where that is not as it is in a report
    show: Callable[[Any], Any] | None = None
    #: what was expected instead of a number that is not within its bounds, nothing where it is
    misfit: Callable[[float], str] | None = None

    @property
    def schema(self) -> Schema:
        """The schema as it is now."""
        return copy.deepcopy(self.describe() if callable(self.describe) else self.describe)


# ------------------------------------------------------------------------------------------------------------------ values
#: size in SI units, whose products in a model, such as E d^4, are still finite numbers; its inverse
#: where one is divided by. Not of times, which the number of steps bounds
LARGEST = 1e50


def read_quantity(
    value: object, dimension: units.Dimension, context: Context, *bounds: str
) -> float:
    """The SI value of a field; bounds such as "> 0" and "< 1"."""
    number = quantities.convert(value, dimension, context.parameters)
    if wanted := outside(number, dimension, *bounds):
        raise Problem(wanted, shown(value))
    if wanted := oversized(number, dimension, *bounds):
        raise Problem(wanted, shown(value), "look at its unit")
    return number


def outside(number: float, dimension: units.Dimension, *bounds: str) -> str:
    """What was expected instead of a number beyond its bounds; nothing where it is within."""
    fits = all(within(number, bound) for bound in bounds)
    return "" if fits else f"{dimension} {' and '.join(bounds)}"


def oversized(number: float, dimension: units.Dimension, *bounds: str) -> str:
    """The same of a number that is too large or too small to be computed with."""
    small = "> 0" in bounds and number < 1.0 / LARGEST
    if dimension == units.TIME or not (small or abs(number) > LARGEST):
        return ""
    return f"{dimension} of a size from {1.0 / LARGEST:g} to {LARGEST:g}"


def within(number: float, bound: str) -> bool:
    sign, limit = bound.split()
    return bool(expressions.SCALAR[sign](number, float(limit)))


def read_vector(value: object, dimension: units.Dimension, context: Context) -> Vector:
    """A list of as many quantities as the scene has dimensions."""
    size = context.dimension
    if not isinstance(value, list | tuple) or len(value) != size:
        axes = ", ".join(AXES[:size])
        raise Problem(
            f"a list of {size} ({axes}), each {dimension}, in a scene of dimension {size}",
            shown(value),
        )
    return tuple(read_quantity(entry, dimension, context) for entry in value)


def read_spin(value: object, dimension: units.Dimension, context: Context) -> float | Vector:
    """A moment or an angular velocity: a number about z in the plane, a vector in space."""
    return (
        read_quantity(value, dimension, context)
        if context.dimension == 2
        else read_vector(value, dimension, context)
    )


def read_axis(value: object, context: Context) -> Vector:
    """A direction in space that is not zero; in the plane everything turns about z."""
    if context.dimension == 2:
        raise Problem(
            "no axis in the plane, where everything turns about z",
            shown(value),
            "delete it, or write a scene of dimension 3",
        )
    direction = read_vector(value, units.NUMBER, context)
    if not any(direction):
        raise Problem(
            "an axis that is not zero", f"[{', '.join(f'{entry:g}' for entry in direction)}]"
        )
    return direction


def read_names(value: object, context: Context) -> tuple[str, ...]:
    """A name or a list of different ones."""
    found = (
        (value,)
        if isinstance(value, str)
        else tuple(value)
        if isinstance(value, list | tuple)
        else ()
    )
    texts = tuple(name for name in found if isinstance(name, str) and name.strip())
    if not texts or len(texts) < len(found):
        raise Problem("a name or a list of names", shown(value))
    if len(set(texts)) < len(texts):
        raise Problem("each name once", ", ".join(texts))
    return texts


def of_time(
    value: object, context: Context, dimension: units.Dimension = units.NUMBER
) -> Expression:
    """An expression of t [s] and of the scene's parameters (in SI units) of a dimension, a number,
    or a profile.
    """
    if isinstance(value, Expression):
        return value
    if isinstance(value, dict):
        from . import profiles  # which is made of fields

        return expressions.of_time(profiles.read(value, context, dimension))
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise Problem("an expression of t", shown(value), expressions.GRAMMAR)
    found = expressions.of_time(
        value,
        {name: quantity.value for name, quantity in context.parameters.items()},
        context.inputs,
    )
    if isinstance(value, str):
        functions.check(value, dimension, context.parameters, context.clock, found.inputs)
    return found


def read_response(value: object, unit: str, context: Context) -> OfState:
    """An expression of the state of a dimension; whoever knows the outputs checks it
    (`responses.require`).
    """
    return value if isinstance(value, OfState) else of_state(value, unit, context.parameters, True)  # type: ignore[arg-type]


def angle_of_time(value: object, context: Context) -> Expression:
    """An angle [rad] as an expression of t, or as a constant quantity such as '90 deg'."""
    try:
        return of_time(value, context, units.ANGLE)
    except Problem:
        try:
            return expressions.of_time(quantities.convert(value, units.ANGLE, context.parameters))
        except Problem:
            pass
        raise


# ------------------------------------------------------------------------------------------------------------------- takes
def number_schema(dimension: units.Dimension, *bounds: str) -> Schema:
    limits = {
        BOUNDS[sign]: int(limit) if limit.lstrip("-").isdigit() else float(limit)
        for sign, limit in map(str.split, bounds)
    }
    told = f"{dimension} {' and '.join(bounds)}".strip()
    return {"anyOf": [{"type": "number", **limits}, {"type": "string"}], "description": told}


def array_schema(items: Schema, least: int, most: int | None = None) -> Schema:
    return {
        "type": "array",
        "items": items,
        "minItems": least,
        **({} if most is None else {"maxItems": most}),
    }


def mapping_schema(required: tuple[str, ...] = (), **keys: Schema) -> Schema:
    found = {"type": "object", "properties": keys, "additionalProperties": False}
    return found | ({"required": list(required)} if required else {})


def word(known: Collection[str]) -> Takes:
    """One of the words that are known when a scene is read."""

    def read(value: object, context: Context) -> str:
        if not isinstance(value, str) or value not in known:
            hint = closest(value, known) if isinstance(value, str) else ""
            raise Problem(f"one of {', '.join(known)}", shown(value) + hint)
        return own_words.meant(value, known, context.modules)

    return Takes(read, lambda: {"enum": list(known), "type": "string"})


def quantity(unit: str, *bounds: str) -> Takes:
    """A number with a unit, "" for none, within bounds such as "> 0" and "< 1"."""
    dimension = units.find_dimension(unit)
    return Takes(
        lambda value, context: read_quantity(value, dimension, context, *bounds),
        number_schema(dimension, *bounds),
        angle=float if dimension == units.ANGLE else None,
        misfit=lambda number: (
            outside(number, dimension, *bounds) or oversized(number, dimension, *bounds)
        ),
    )


def read_file_unit(value: object, context: Context) -> float:
    """The length of the unit of a file [m]: `mm`, or a length."""
    named = isinstance(value, str) and value in units.UNITS
    return read_quantity(
        f"1 {value}" if named else value, units.find_dimension("m"), context, "> 0"
    )


def whole(least: int | None = None, most: int | None = None) -> Takes:
    """A whole number from `least` to `most`."""

    def read(value: object, context: Context) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise Problem("a whole number", shown(value))
        if wanted := misfit(value):
            raise Problem(wanted, shown(value))
        return value

    def misfit(number: float) -> str:
        if least is not None and number < least:
            return f"a number >= {least:g}"
        return f"a number <= {most:g}" if most is not None and number > most else ""

    limits = {"minimum": least, "maximum": most}
    return Takes(
        read,
        {"type": "integer", **{key: limit for key, limit in limits.items() if limit is not None}},
        misfit=misfit,
    )


def name_in(section: str, told: str) -> Takes:
    """A name of something in a section of the scene."""
    return Takes(read_text, {"type": "string", "description": told}, section)


def vector(unit: str) -> Takes:
    """A quantity a coordinate of the scene."""
    dimension = units.find_dimension(unit)
    schema = array_schema(number_schema(dimension), 2, 3) | {
        "description": f"{dimension} per coordinate"
    }
    return Takes(lambda value, context: read_vector(value, dimension, context), schema)


def either(unit: str, read: Callable[[object, units.Dimension, Context], Any]) -> Takes:
    """A quantity or a vector, as `read` decides by the dimension of the scene."""
    dimension = units.find_dimension(unit)
    options = [number_schema(dimension), array_schema(number_schema(dimension), 2, 3)]
    return Takes(
        lambda value, context: read(value, dimension, context),
        {"anyOf": options, "description": f"{dimension} per coordinate"},
    )


def response(unit: str) -> Takes:
    """An expression of outputs, of t and parameters."""
    told = f"{units.find_dimension(unit)}, expression of outputs, t and parameters"
    return Takes(
        lambda value, context: read_response(value, unit, context),
        _EXPRESSION | {"description": told},
    )


def spin(unit: str) -> Takes:
    """A quantity about z in the plane, a vector of them in space."""
    return either(unit, read_spin)


NUMBER = units.NUMBER
_ANY: Schema = number_schema(NUMBER) | {"description": "a quantity"}
_EXPRESSION: Schema = {
    "anyOf": [{"type": "number"}, {"type": "string", "maxLength": expressions.LENGTH}]
}
_NAME: Schema = {"type": "string", "minLength": 1}
NAMES: Schema = {"anyOf": [_NAME, array_schema(_NAME, 1)]}
_THREE = array_schema(number_schema(NUMBER), 3, 3)


def _history(told: str, many: bool = False) -> Callable[[], Schema]:
    """The schema of a function of time, or of one a coordinate."""

    def schema() -> Schema:
        from . import mappings, profiles

        each = {"anyOf": [*_EXPRESSION["anyOf"], mappings.refer(profiles.MotionProfile)]}
        whole = array_schema(each, 2, 3) if many else each
        profile = (
            "[motion_profiles](#motion_profile)" if many else "a [motion_profile](#motion_profile)"
        )
        return whole | {"description": f"{told}, or {profile}"}

    return schema


def read_text(value: object, context: Context) -> str:
    if not isinstance(value, str):
        raise Problem("a text", shown(value))
    return value


def constant_angle(value: object) -> float | None:
    """The angle of a function of time that is constant."""
    return value(0.0) if isinstance(value, Expression) and len(value.program) == 1 else None


def read_motion(value: object, context: Context) -> tuple[Expression, ...]:
    """One expression of t a coordinate."""
    if not isinstance(value, list | tuple) or len(value) != context.dimension:
        raise Problem(f"a list of {context.dimension} expressions of t", shown(value))
    return tuple(of_time(entry, context, units.LENGTH) for entry in value)


ANY = Takes(lambda value, context: quantities.read(value, context.parameters).value, _ANY)
NAMED = Takes(read_names, NAMES | {"description": "a name or a list of names"})
AXIS = Takes(read_axis, _THREE | {"description": "an axis in space"})
HISTORY = Takes(of_time, _history("expression of t"))
ANGLE = Takes(angle_of_time, _history("angle [rad], expression of t"), angle=constant_angle)
MOTION = Takes(read_motion, _history("expressions of t [m]", many=True))
WAY = Takes(
    lambda value, context: of_time(value, context, units.LENGTH),
    _history("expression of t [m]"),
)

Length = Annotated[float, quantity("m", "> 0")]
FileUnit = Annotated[
    float,
    Takes(read_file_unit, number_schema(units.find_dimension("m"), "> 0")),
    "unit of the file, such as mm",
]
Time = Annotated[float, quantity("s", "> 0")]
Density = Annotated[float, quantity("kg/m^3", "> 0")]
Tolerance = Annotated[float, quantity("", "> 0", "< 1")]
Position = Annotated[Vector, vector("m")]
Names = Annotated[tuple[str, ...], NAMED]
Count = Annotated[int, whole(1, 1_000_000)]
