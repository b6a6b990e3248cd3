r"""What controllers and events read that belongs to accepted states: reactions, energies, stresses,
what loads and contacts do.

    f(y_1, y_2, ..., z_1, z_2, ...)      y_i  values that forces keep (`responses.keep`),    z_i  columns of outputs

Positions, velocities and angles are functions of the state with compiled derivatives, which forces
read as well. A reaction follows from the balance of all forces, so that it is known once a step is
accepted: an expression that reads one is evaluated then. Values that are read have numbers: from 0
on those that forces keep, -1, -2, ... those of the readings of the system.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Reals
from ...core.values import expressions
from ...core.values.expressions import Program
from ...core.values.inputs import calls_of
from ...core.values.problems import Problem, shown
from ...core.values.responses import OfState, of_state, require
from ...core.values.tables import Table
from ..system import Output
from .probes import Probe, kind_of, units

ALONE = "a reaction, an energy or a force is known of accepted states alone"
REMEDY = (
    "read it in an event, or with a controller: {type: measurement, of: %s, unit: ..., sample: ...}"
)


@storable
@dataclass(frozen=True)
class Reading:
    """An expression that reads columns of outputs."""

    where: str  #: for messages
    text: str
    program: Program
    kept: tuple[tuple[str, int], ...]  #: names, and numbers of the kept values that they are
    columns: tuple[tuple[str, str, str], ...]  #: names, outputs and their columns
    parameters: tuple[str, ...]
    values: Annotated[np.ndarray, Reals("p")]  #: of the parameters
    tables: tuple[Table, ...] = ()  #: that it calls


class WantedReadings(NamedTuple):
    """Expressions that controllers and events read, each with the place that messages name."""

    kept: list[tuple[str, OfState]]  #: functions of the state, whose values forces keep
    #: those with columns of outputs, and numbers of kept values by name
    late: list[tuple[str, OfState, dict[str, int]]]
    numbers: list[int]  #: of all of them


def follows(name: str, outputs: Mapping[str, Probe], dim: int) -> bool:
    """Whether a name in an expression is a column of an output that is no function of the state,
    such as a reaction.

    `outputs` by name; `dim` is the number of components.
    """
    head = name.partition(".")[0]
    return head in outputs and not outputs[head].variables(dim)


def refuse(value: OfState, outputs: Mapping[str, Probe], dim: int) -> None:
    """A Problem where a force, which is needed at every trial state, reads what belongs to accepted
    ones.
    """
    for name in value.outputs:
        if follows(name, outputs, dim):
            expected = "outputs that are functions of positions and velocities"
            raise Problem(expected, f"{shown(name)}: {ALONE}", REMEDY % name)


def sort(
    wanted: Sequence[tuple[str, OfState]], outputs: Mapping[str, Probe], dim: int
) -> WantedReadings:
    """Parts expressions into those that forces keep, and those that read outputs, whose other names
    are kept behind them.

    Numbers of the first count from 0, those of the second are -1, -2, ...
    """
    late = [any(follows(name, outputs, dim) for name in value.outputs) for _, value in wanted]
    found = WantedReadings(
        [one for one, apart in zip(wanted, late, strict=True) if not apart], [], []
    )
    plain = 0
    for (where, value), apart in zip(wanted, late, strict=True):
        if not apart:
            found.numbers.append(plain)
            plain += 1
            continue
        numbers = dict[str, int]()
        for name in (*value.outputs, *(["t"] if value.clocked else [])):
            if not follows(name, outputs, dim):
                numbers[name] = len(found.kept)
                found.kept.append((where, of_state(name)))
        found.late.append((where, value, numbers))
        found.numbers.append(-len(found.late))
    return found


def collect(
    wanted: WantedReadings,
    outputs: Mapping[str, Output],
    known: Mapping[str, str],
    tables: Mapping[str, Table],
    products: Iterable[tuple[str, OfState]] = (),
) -> tuple[Reading, ...]:
    """The readings of expressions; InputError where their names or dimensions do not fit the
    outputs and what else is `known`.

    `products` of gains with such expressions, each with the place that messages name, have
    dimensions as well.
    """
    columns = dict[str, tuple[str, str]]()
    dimensions = dict(known)
    for name, output in outputs.items():
        whole = kind_of(output).of_motions
        for column, unit in zip(output.columns, units(name, output), strict=True):
            part = column.removeprefix(name).removeprefix("_")
            if part not in whole:
                columns[f"{name}.{part}" if part else name] = name, column
                dimensions.setdefault(f"{name}.{part}" if part else name, unit)
    late = {
        name for _, value, numbers in wanted.late for name in value.outputs if name not in numbers
    }
    for where, value in (*((where, value) for where, value, _ in wanted.late), *products):
        if late & set(value.outputs):
            try:
                require(value, dimensions, calls_of(tables.values()))
            except Problem as problem:
                raise InputError(problem.at(where)) from problem
    found = list[Reading]()
    for where, value, numbers in wanted.late:
        read = tuple((name, *columns[name]) for name in value.outputs if name not in numbers)
        parameters = [name for name, _ in value.parameters]
        values = [one.value for _, one in value.parameters]
        own = (
            tuple(parameters),
            np.array(values, float),
            tuple(tables[call] for call in value.calls),
        )
        found.append(Reading(where, value.text, value.program, tuple(numbers.items()), read, *own))
    return tuple(found)


def evaluate(reading: Reading, kept: Callable[[int], float], columns: Mapping[str, float]) -> float:
    """The value of a reading in the SI unit of its expression.

    `kept` gives values that forces keep by number, `columns` are those of outputs by name.
    """
    names = {"pi": np.pi} | dict(zip(reading.parameters, reading.values.tolist(), strict=True))
    names |= {name: kept(number) for name, number in reading.kept}
    names |= {name: columns[column] for name, _, column in reading.columns}
    names |= {step: one.value for step, one in expressions.quantities(reading.program).items()}
    names |= {one.call: one for one in reading.tables}
    return expressions.value_of(reading.program, names)


def outputs_of(readings: Sequence[Reading]) -> tuple[str, ...]:
    """Names of the outputs that readings read, each once, in the order in which they first come."""
    return tuple(dict.fromkeys(output for one in readings for _, output, _ in one.columns))


def require_known(reading: Reading, columns: Mapping[str, float]) -> None:
    """InputError where a column of an output that a reading reads has no value (NaN).

    So is the reaction of a joint that a reduced model has dropped.
    """
    for name, output, column in reading.columns:
        if np.isnan(columns[column]):
            remedy = "a reduced model knows the reactions of joints between its components alone"
            raise InputError(
                say(
                    reading.where,
                    "outputs that the reduced model has",
                    f"'{name}', which reads '{output}', left out of it",
                    remedy,
                )
            )
