"""The section `training` of a scene: over which points of the parameters' ranges a reduced model is
trained, and how far.

candidates: 101                                      evenly spaced with one parameter, Sobol points with several, and corners
candidates: {E: 21, d: 11}                           a grid
candidates: {design: latin_hypercube, count: 200}    grid, sobol or latin_hypercube
candidates: [40 GPa, 55 GPa]                         points; with several parameters [{E: 40 GPa, d: 8 mm}, ...]
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from ..core.errors import closest
from ..core.storage.records import dataclass
from ..core.values import quantities, units
from ..core.values.fields import Context, Count, Takes, array_schema, read_quantity, whole, word
from ..core.values.mappings import inline
from ..core.values.problems import Problem, shown

Row: TypeAlias = tuple[float, ...]

DESIGNS = ("sobol", "latin_hypercube")
LARGEST = 1_000_000  #: most points of a design


def _points(value: object, context: Context) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= LARGEST:
        raise Problem(f"a number of points from 1 to {LARGEST}", shown(value))
    return value


POINTS = Takes(_points, whole(1, LARGEST).schema)


@dataclass(frozen=True)
class Spread:
    """So many points: evenly spaced with one parameter, by `design` with several, a default where
    that is empty.
    """

    count: Annotated[int, POINTS]
    design: Annotated[str, word(DESIGNS)] = ""


@dataclass(frozen=True)
class Grid:
    """So many values a parameter, in the order of the scene's ranges, and all their combinations."""

    counts: tuple[int, ...]


@dataclass(frozen=True)
class Listed:
    """Points one by one, their values in the order of the scene's ranges."""

    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Allowed:
    """Largest errors of outputs by name, each in SI units with the unit that was written."""

    values: dict[str, float]
    units: dict[str, str]


Design: TypeAlias = Spread | Grid | Listed


def design(value: object, context: Context) -> Design:
    """Points over the ranges: a number of them, a grid, a named design, or a list."""
    _need_ranges(context)
    if isinstance(value, list):
        return (
            Listed(_distinct(tuple(point(entry, context) for entry in value)))
            if value
            else _refuse(value)
        )
    if isinstance(value, dict):
        return (
            DESIGN.read(value, context)
            if "design" in value and "design" not in context.ranges
            else _grid(value, context)
        )
    return Spread(POINTS.read(value, context))


def _distinct(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    """Points one by one; Problem for one that is there twice, of which nothing new is learned."""
    for k, row in enumerate(rows):
        if row in rows[:k]:
            raise Problem(
                "points that differ",
                f"one twice, as points {rows.index(row) + 1} and {k + 1}",
                "delete one",
            )
    return rows


def point(value: object, context: Context) -> Row:
    """One point over the ranges: a quantity with one parameter, or a mapping of names and
    quantities.
    """
    names = list(context.ranges)
    _need_ranges(context)
    if not isinstance(value, dict):
        if len(names) > 1:
            raise Problem(f"a mapping of {', '.join(names)} and their values", shown(value))
        value = {names[0]: value}
    _same_names(value, names)
    wanted = {name: units.find_dimension(one.unit) for name, one in context.ranges.items()}
    row = tuple(quantities.convert(value[name], wanted[name], context.parameters) for name in names)
    for name, entry in zip(names, row, strict=True):
        limits = context.ranges[name]
        if not limits.low <= entry <= limits.high:
            raise Problem(f"{name} within its range of {limits}", shown(value[name]))
    return row


def _need_ranges(context: Context) -> None:
    if not context.ranges:
        raise without_ranges()


def without_ranges() -> Problem:
    """The problem of a training without parameters that have ranges."""
    remedy = "give one a range, for instance 'E: {value: 70 GPa, range: [40 GPa, 70 GPa]}'"
    return Problem("parameters with ranges to train over", "none", remedy)


def _same_names(value: Mapping[Any, Any], names: list[str]) -> None:
    for name in value:
        if name not in names:
            raise Problem(
                f"the parameters with ranges {', '.join(names)}",
                f"{shown(name)}{closest(str(name), names)}",
            )
    missing = [name for name in names if name not in value]
    if missing:
        raise Problem(
            f"all parameters with ranges ({', '.join(names)})", f"none for {', '.join(missing)}"
        )


def _grid(value: dict[str, Any], context: Context) -> Grid:
    _same_names(value, list(context.ranges))
    return Grid(tuple(POINTS.read(value[name], context) for name in context.ranges))


def tolerance(value: object, context: Context) -> float | Allowed:
    """An error between 0 and 1 as a part of the ranges of the outputs, or errors of outputs by
    name: quantities.
    """
    if not isinstance(value, dict):
        found = read_quantity(value, units.NUMBER, context, "> 0")
        if not found < 1.0:
            raise Problem(
                "a part of the ranges of the outputs below 1, or errors of outputs by name",
                shown(value),
                "1e-4 for instance",
            )
        return found
    if not value:
        raise Problem("errors of outputs by name", "none", "write {C: 0.1 mm} for instance")
    read = {str(name): quantities.read(entry, context.parameters) for name, entry in value.items()}
    for name, entry in read.items():
        if not entry.value > 0.0:
            raise Problem(f"a largest error of {name} above 0", shown(value[name]))
    named = {name: units.unit(entry.exponents) for name, entry in read.items()}
    return Allowed({name: entry.value for name, entry in read.items()}, named)


def _refuse(value: object) -> Listed:
    raise Problem("a number of points, a grid, a design or a list of points", shown(value))


DESIGN = inline(Spread)
_COUNT = POINTS.schema
_VALUE = {"anyOf": [{"type": "number"}, {"type": "string"}]}
_POINT: dict[str, Any] = {
    "anyOf": [*_VALUE["anyOf"], {"type": "object", "additionalProperties": _VALUE}]
}
_DESIGN: dict[str, Any] = {
    "anyOf": [
        _COUNT,
        array_schema(_POINT, 1),
        DESIGN.schema,
        {"type": "object", "additionalProperties": _COUNT},
    ],
    "description": "a number of points, counts by parameter, {design: ..., count: ...}, or a list of points",
}

_WANTED = {
    "anyOf": [
        {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1},
        {"type": "string"},
        {"type": "object", "additionalProperties": _VALUE, "minProperties": 1},
    ],
    "description": "an error of outputs as a part of their ranges, or largest errors by output",
}

Points = Annotated[Design, Takes(design, _DESIGN, show=lambda value: getattr(value, "count", None))]
Wanted = Annotated[float | Allowed, Takes(tolerance, _WANTED)]
Point = Annotated[
    tuple[float, ...],
    Takes(point, _POINT | {"description": "a value, or a mapping of parameters and values"}),
]


@dataclass(frozen=True)
class Training:
    """Greedy training over the ranges of the parameters.

    Full runs are made at `first` (by default the candidate in the middle) and where the error
    indicator over the `candidates` is largest, at most `iterations` of them; Sobol points and Latin
    hypercubes have the corners of the ranges beside them, unless these are more. The surrogate of
    the indicator starts from `samples` and takes at most `max_samples` an iteration. Two more full
    runs, which are not in the model, calibrate the error that it predicts. Errors are those of the
    outputs, the largest of any column as a part of its range; without outputs those of all
    coordinates. A `tolerance` is the wanted error, or `{C: 0.1 mm}` the wanted largest errors of
    some outputs: eps and eta are chosen for it, instead of those of `reduction`, and training ends
    when the predicted error is below it. Errors are checked at the points `holdout`. Where the
    training cannot promise its predicted error, its report says so, with the reasons.
    """

    candidates: Points = Spread(101)
    samples: Points = Spread(5)
    first: Point | None = None
    iterations: Count = 5
    max_samples: Count = 15
    tolerance: Wanted | None = None
    holdout: Points | None = None
    seed: Annotated[int, whole(0, 2**31 - 1)] = 0
