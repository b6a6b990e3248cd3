"""Inputs of a scene: names of numbers that a run from Python sets from step to step, and tables of
time.

    inputs: {u: {unit: N m, start: 0, range: [-5 N m, 5 N m]}}
    tables: {goal: {file: goal.csv, value: angle, unit: rad, smooth: true}}          goal(t) in expressions

They are known before all else of a scene is read: expressions of loads and joints use them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np

from ..control.controllers import UNIT
from ..core.errors import InputError
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values import expressions, quantities, units
from ..core.values.expressions import Expression
from ..core.values.fields import ANY, Context, Takes, array_schema
from ..core.values.inputs import ROUND, Input
from ..core.values.mappings import HIDDEN, inline
from ..core.values.problems import Found, Problem, Problems, located, read_all, shown
from ..core.values.responses import OfState
from ..core.values.tables import Ends, Table, read_columns
from ..shapes import meshes

T = TypeVar("T")
SAMPLES = 1001  #: instants at which functions of time are looked at


def read_written(value: object, context: Context) -> str:
    """A unit as it is written."""
    UNIT.read(value, context)
    return str(value)


WRITTEN = Takes(read_written, UNIT.describe)
AS_WRITTEN = Takes(lambda value, context: value, ANY.schema)  #: until its unit is known


def read_ends(value: object, context: Context) -> tuple[Any, ...]:
    """Both ends of a range as they are written."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise Problem(
            "a list of two quantities, the lower one first",
            shown(value),
            "write for instance [-5 N m, 5 N m]",
        )
    return tuple(value)


ENDS = Takes(read_ends, array_schema(ANY.schema, 2, 2))


@dataclass(frozen=True)
class InputModel:
    """A number that a run from Python sets from step to step; a run from the command holds it at
    its start.

    Trainings of reduced models excite it within its `range`, and runs that leave it end with a
    warning. Without `unit` the range says it.
    """

    unit: Annotated[str, WRITTEN] = ""
    start: Annotated[Any, AS_WRITTEN] = 0.0
    range: Annotated[tuple[Any, ...], ENDS, "what it is set to, lowest and highest"] | None = None


MODEL = inline(InputModel)


def resolve(
    section: str, entry: str, raw: Any, context: Context, read: Callable[[str, Any, Context], T]
) -> tuple[dict[str, T], list[Found]]:
    """A section of names that expressions use, each read from its `entry`, and what is wrong with
    it.
    """
    if not isinstance(raw, dict | None):
        return {}, [((section,), Problem(f"a mapping of names, each {entry}", shown(raw)))]
    known = dict[str, T]()
    found = list[Found]()
    for name, value in (raw or {}).items():
        try:
            check_name(name, context.parameters)
            known[name] = read(name, value, context)
        except InputError as error:
            found += [((section, name, *keys), problem) for keys, problem in located(error)]
    return known, found


def inputs(raw: Any, context: Context) -> tuple[dict[str, Input], list[Found]]:
    """The section `inputs`, and what is wrong with it."""
    return resolve("inputs", "{unit: ..., start: ...}", raw, context, read_input)


def read_input(name: str, entry: object, context: Context) -> Input:
    """An input in SI units."""
    given: InputModel = MODEL.read(entry, context)
    if given.range is None or given.unit:
        unit, dimension = unit_of(f"inputs.{name}", given.unit, context)
    else:
        found = read_all(
            ("range", partial(quantities.read, one, context.parameters)) for one in given.range
        )
        unit = next((units.unit(one.exponents) for one in found if any(one.exponents)), "")
        dimension = units.find_dimension(unit) if unit else units.NUMBER
    convert = partial(quantities.convert, dimension=dimension, parameters=context.parameters)
    start, *ends = read_all(
        (key, partial(convert, one)) for key, one in (("start", given.start), *ends_of(given))
    )
    if not ends:
        return Input(name, unit, start)
    low, high = ends
    if not low < high:
        raise Problems(
            [
                (
                    ("range",),
                    Problem(
                        "the lower end before the higher one",
                        f"{low:g} to {high:g} {unit}".rstrip(),
                    ),
                )
            ]
        )
    if not low <= start <= high:
        where, got = ("start", f"{start:g}") if given.start else ("range", f"a start of {start:g}")
        remedy = (
            "give the input a `start` in its range"
            if where == "range"
            else "give it another one, or a wider range"
        )
        raise Problems(
            [((where,), Problem(f"a start from {low:g} to {high:g} {unit}".rstrip(), got, remedy))]
        )
    return Input(name, unit, start, range=(low, high))


def ends_of(given: InputModel) -> list[tuple[str, Any]]:
    """Both ends of a range with their key; none of an input without one."""
    return [("range", one) for one in given.range or ()]


def unit_of(where: str, written: object, context: Context) -> tuple[str, units.Dimension]:
    """The SI unit of a unit and its dimension, with a notice where numbers might be taken for those
    of another unit.
    """
    unit = str(UNIT.read(written, context))
    dimension = units.find_dimension(unit) if unit else units.NUMBER
    if unit and quantities.convert(f"1 {written}", dimension) != 1.0:
        notify(f"{where}: plain numbers are in {unit}, not in {written}: write `unit: {unit}`")
    return unit, dimension


def steered(raw: Any, context: Context) -> tuple[dict[str, Input], list[Found]]:
    """What controllers will give, before they are read, and names that do not do."""
    return resolve(
        "controllers", "{unit: ...}", raw if isinstance(raw, dict) else None, context, read_steered
    )


def read_steered(name: str, entry: object, context: Context) -> Input:
    """What a controller will give."""
    return Input(
        name,
        unit_of(f"controllers.{name}", entry.get("unit", ""), context)[0]
        if isinstance(entry, dict)
        else "",
    )


@dataclass(frozen=True)
class TableModel:
    """A function by the points of a file of comma-separated numbers, under titles with units:
    `time [ms], angle [deg]`.

    Under titles without units, numbers are in the units `of` and `unit`.

    Expressions call it `name(t)` or, of another argument with the unit `of`, `name(stretch)`.
    Between points are straight lines, or a `smooth` curve: a monotone cubic, which overshoots
    nowhere, or where it drives a joint a cubic spline with these `ends`, whose second derivative is
    continuous. Beyond the last points it is constant. A run whose functions of time leave a table
    that is shorter than it is refused, one that leaves other places ends with a warning, unless the
    table is to `hold` its values there.
    """

    file: str
    unit: Annotated[str, WRITTEN] = ""
    of: Annotated[str, WRITTEN, "of its argument"] = "s"
    argument: Annotated[str, "title of the column of arguments, the first one by default"] = ""
    time: Annotated[str, "the same, of times"] = ""
    value: Annotated[str, "title of the column of values, the second one by default"] = ""
    smooth: bool = False
    ends: Annotated[
        Ends, "of a spline that drives: clamped where it begins and ends at rest, else not-a-knot"
    ] = "automatic"
    hold: bool = False
    table: Table | None = field(default=None, metadata=HIDDEN)


TABLE_MODEL = inline(TableModel)


def tables(raw: Any, context: Context, folder: Path) -> tuple[dict[str, TableModel], list[Found]]:
    """The section `tables` with what is in their files, and what is wrong with it."""
    return resolve("tables", "{file: ..., unit: ...}", raw, context, partial(read_table, folder))


def read_table(folder: Path, name: str, entry: object, context: Context) -> TableModel:
    """A table with what is in its file."""
    given: TableModel = TABLE_MODEL.read(entry, context)
    columns = read_columns(
        meshes.path(given.file, folder, what="table"),
        (given.argument or given.time, given.value),
        given.unit,
        given.of,
    )
    unit, of = (str(UNIT.read(one, context)) for one in (given.unit, given.of))
    return replace(
        given, table=Table(name, unit, *columns, given.smooth, of, given.hold, given.ends)
    )


def ends_early(
    given: TableModel, instants: np.ndarray, read: Iterable[Expression | OfState]
) -> Problem | None:
    """What is wrong with a table of times that does not reach over all instants, where one of the
    functions `read` leaves it.

    Those of the state leave it by t alone; by another argument they do as they move, which ends
    with a warning.
    """
    if given.table is None or given.hold or given.table.of != "s":
        return None
    table = given.table
    begin = float(instants.min())
    end = float(instants.max())
    first, last = table.times[0], table.times[-1]
    if first <= begin and end <= last * (1.0 + ROUND):
        return None
    if not any(
        table.name in one.program if isinstance(one, OfState) else left(one, table, instants).size
        for one in read
    ):
        return None
    repeat = f", {table.call[:-1]}mod(t, {last:g} s)) repeats them" if first <= begin else ""
    remedy = f"'hold: true' keeps the values at its ends{repeat}"
    return Problem(
        f"a table from {begin:g} to {end:g} s, over all of the analysis",
        f"one from {first:g} to {last:g} s",
        remedy,
    )


def leaves(given: Expression, instants: np.ndarray) -> str:
    """What is said of a function of time that reads a table, by an argument such as 2 * t, beyond
    its ends, or nothing.
    """
    for table in given.inputs:
        if not isinstance(table, Table) or table.hold or table.call not in given.program:
            continue
        if (beyond := left(given, table, instants)).size:
            where = f"reads {table.call[:-1]}...) outside of its table, from {table.times[0]:g} to {table.times[-1]:g} s"
            since = f"from t = {beyond[0]:.3g} s on: the table keeps its last value there"
            return f"{where}, {since}; write 'hold: true' beside it if that is meant"
    return ""


def left(given: Expression, table: Table, instants: np.ndarray) -> np.ndarray:
    """Times (i,), of the instants (n,) and some between, at which a function of time reads a table
    beyond its ends.

    The value there counts where it changes the function: not in the branch of `where` that is not
    taken.
    """
    times = np.union1d(np.linspace(float(instants.min()), float(instants.max()), SAMPLES), instants)
    first, last = table.times[0], table.times[-1]
    room = ROUND * (last - first)

    def inside(x: np.ndarray) -> np.ndarray:
        return np.where((x < first - room) | (x > last + room), np.nan, table(x))

    names = {one.call: one for one in given.inputs if one.call} | {table.call: inside}
    with np.errstate(all="ignore"):
        values = {one.name: one(times) for one in given.inputs} | {table.name: inside(times)}
        found = np.zeros(times.shape) + expressions.evaluate(
            given.program, {"t": times, **values, **names}, expressions.ARRAY
        )
    return np.asarray(times[np.isnan(found) & ~np.isnan(given(times))])


def check_name(name: str, parameters: Mapping[str, Any]) -> None:
    """A name that stands for nothing else in expressions."""
    if (
        not name.isascii()
        or not name.isidentifier()
        or name in expressions.RESERVED
        or name in units.UNITS
        or name in parameters
    ):
        raise Problem(
            "a name of letters, digits and _ that is no function, unit or parameter", shown(name)
        )


INPUT = Takes(lambda value, context: value, MODEL.schema)  #: one that has been resolved
TABLE = Takes(lambda value, context: value, TABLE_MODEL.schema)
