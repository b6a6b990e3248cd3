r"""Forces by an expression of the state: f(outputs, t, parameters) along a coordinate of probe
rows.

    F = f dc/dy,      c = - |y|,  y,  p . d,  angle(y)        a pull, a push along a row or a carried vector p, a torque

f is a text whose names are parts of outputs (`tip.x`), the coordinate's own (`stretch`, `rate`,
`angle`), t and parameters; its derivatives by all of them are those of symbols. Tables that it
calls are curves of its numbers (`curves`). Along none, values of expressions are kept of every
accepted state, for what acts on them between steps. A law is known by its texts, so that files hold
it: `response|coordinate|f|parameters|outputs|inputs`, an output being
`name:word:rows:numbers:parts...`. Inputs, and t, are its histories.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...core import extras
from ...core.errors import InputError, listed, say
from ...core.values import expressions, responses
from ...core.values.expressions import of_time
from ...core.values.inputs import calls_of, timed
from ...core.values.problems import Problem
from ...core.values.responses import OfState
from ...core.values.tables import Table
from ..connections.constraint_functions import arm, rows_of
from ..measures import readings
from ..measures.probes import Probe
from ..own_symbols import norm, turned
from ..places import At, Draft, Gauge, ProbeRows
from .force_laws import ForceLaw, LawForces

if TYPE_CHECKING:
    from ..compiled import Compiled
    from .force_symbols import ForceSymbols

WORD = "response"  #: of the names of these laws
READING = "reading"  #: in place of a coordinate where nothing is pushed, and values are kept


class Coordinate(NamedTuple):
    """What a force acts along."""

    rows: int
    own: Mapping[str, str]  #: names in expressions, with their units
    #: y, v, free length or angle -> c, values of its own names
    write: Callable[..., tuple[Any, Sequence[Any]]]


def pull(y: Any, v: Any, free: Any) -> tuple[Any, Sequence[Any]]:
    d = norm(y)
    return -d, [d - free, y.dot(v) / d]


def push(y: Any, v: Any, free: Any) -> tuple[Any, Sequence[Any]]:
    return y[0], [y[0] - free, v[0]]


def torque(y: Any, v: Any, free: Any) -> tuple[Any, Sequence[Any]]:
    """Of an arm (2,), the difference of two, or that of a vector u from another one p and q normal
    to it, (9,).
    """
    import sympy

    if len(y) == 9:
        u, p, q = (y[k : k + 3, :] for k in (0, 3, 6))
        theta = sympy.atan2(u.dot(q), u.dot(p))
    else:
        theta = sum((1 - k) * sympy.atan2(y[k + 1], y[k]) for k in range(0, len(y), 2))
    return theta, [
        turned(theta) - free,
        sum(sympy.diff(theta, a) * b for a, b in zip(y, v, strict=True)),
    ]


LENGTHS = {"stretch": "m", "rate": "m/s"}
ANGLES = {"angle": "rad", "rate": "rad/s"}
PLACES = {"place": "m", "rate": "m/s"}
COORDINATES = {
    "pull": Coordinate(3, LENGTHS, pull),
    "push": Coordinate(1, LENGTHS, push),
    "along a line": Coordinate(1, PLACES, push),
    "torque": Coordinate(2, ANGLES, torque),
    "relative torque": Coordinate(4, ANGLES, torque),
    "torque in space": Coordinate(9, ANGLES, torque),
    READING: Coordinate(0, {}, lambda y, v, free: (0, [])),
}


def act(draft: Draft, where: str, gauge: Gauge, coordinate: str, value: OfState) -> None:
    """Add the force of an expression along a coordinate, one of `COORDINATES`, of the rows of a
    gauge.

        F = f dc/dy

    Its stretch or angle counts from the gauge's free length [m] or angle [rad]. InputError, after
    `where`, for names that nothing has, for outputs that only accepted states have, and for units
    that do not fit.
    """
    add(draft, where, coordinate, (value,), gauge.rows, gauge.free)


def keep(draft: Draft, wanted: Sequence[tuple[str, OfState]]) -> None:
    """Keep the values of expressions of every accepted state, each with the place that messages
    name: see `kept`.

    InputError where parameters of one name have different values, and as of `act`.
    """
    known = dict[str, Any]()
    for where, value in wanted:
        require(draft, where, value, {})
        for name, one in value.parameters:
            if known.setdefault(name, one.value) != one.value:
                expected = (
                    f"one value of the parameter '{name}' in all that controllers and events read"
                )
                raise InputError(
                    say(
                        where,
                        expected,
                        f"{known[name]:g} and {one.value:g}",
                        "give one of them another name",
                    )
                )
    if wanted:
        add(draft, "", READING, [value for _, value in wanted], (), 0.0)


def kept(model: Compiled) -> np.ndarray:
    """Places (i,) in the memory of forces of the values that `keep` was asked for, in the order of
    the expressions.
    """
    found = list[int]()
    for source, _, held in model.remembering:
        if isinstance(source, LawForces) and source.law.kept:
            first = held.start + source.law.memory
            found += range(first, first + source.law.kept)
    return np.array(found, dtype=np.int64)


def beyond(model: Compiled, memory: np.ndarray) -> Iterator[str]:
    """Texts about tables that accepted states have left, up to those with the memory (l,); none
    where all stayed inside.
    """
    far = dict[str, float]()
    for source, _, held in model.remembering:
        if isinstance(source, LawForces) and source.law.tables:
            each = memory[held].reshape(len(source), -1)
            for name, part in zip(
                source.law.tables, each[:, source.law.memory + source.law.kept :].T, strict=True
            ):
                far[name] = max(far.get(name, 0.0), float(part.max()))
    for name in (name for name, most in far.items() if most > 0.0):
        text = f"table '{name.removesuffix('()')}' was read up to {far[name]:.3g} (SI units) outside of its range"
        yield f"{text}, where its last value is used; extend it, or say 'hold: true' if that is meant"


def add(
    draft: Draft,
    where: str,
    coordinate: str,
    values: Sequence[OfState],
    rows: Sequence[int],
    free: float,
) -> None:
    """Add a law of expressions on rows of a coordinate and of outputs."""
    own = COORDINATES[coordinate].own
    told = list[str]()
    numbers = [free]
    wanted = dict.fromkeys(name for value in values for name in value.outputs if name not in own)
    inputs = [draft.inputs[name] for name in wanted if name in draft.inputs]
    for value in values:
        require(draft, where, value, own)
    given = dict(one for value in values for one in value.parameters)
    numbers += [one.value for one in given.values()]
    curves = {
        call: tables_of(draft)[call].numbers
        for call in dict.fromkeys(call for value in values for call in value.calls)
    }
    read = list(rows)
    for name in dict.fromkeys(one.partition(".")[0] for one in wanted if one not in draft.inputs):
        word, found, parameters = sense(draft, name)
        read += found
        numbers += parameters
        told.append(
            ":".join(
                [
                    name,
                    word,
                    str(len(found)),
                    str(len(parameters)),
                    *draft.outputs[name].variables(draft.layout.dim),
                ]
            )
        )
    numbers += [float(number) for curve in curves.values() for number in curve]
    texts = ";".join(value.text for value in values)
    listed = [*given, *(f"{call}:{len(curve)}" for call, curve in curves.items())]
    named = [
        WORD,
        coordinate,
        texts,
        ",".join(listed),
        ",".join(told),
        *(one.name for one in inputs),
    ]
    law, used = made("|".join(named))
    signals = [draft.signal(of_time("t"))] if any(value.clocked for value in values) else []
    draft.forces.act(law, [read[k] for k in used], numbers, [*signals, *map(draft.signal, inputs)])


def require(draft: Draft, where: str, value: OfState, own: Mapping[str, str]) -> None:
    """InputError, after `where`, where an expression does not fit the outputs and inputs there are:
    names, units, calls of tables.

    `own` are names, with their units, that it may read beside them.
    """
    try:
        readings.refuse(value, draft.outputs, draft.layout.dim)
        responses.require(value, known(draft) | dict(own), calls_of(draft.inputs.values()))
    except Problem as problem:
        raise InputError(problem.at(where)) from problem


def known(draft: Draft) -> dict[str, str]:
    """Names of functions of the state and of inputs that expressions may read, with their SI units."""
    return variables(draft.outputs, draft.layout.dim) | timed(draft.inputs.values())


def tables_of(draft: Draft) -> dict[str, Table]:
    """Tables among the inputs of a draft by how expressions call them, such as `NAME()`."""
    return {one.call: one for one in draft.inputs.values() if isinstance(one, Table)}


def variables(outputs: Mapping[str, Probe], dim: int) -> dict[str, str]:
    """Names that forces may read of outputs, OUTPUT or OUTPUT.PART, with their SI units."""
    return {
        named(name, part): unit
        for name, one in outputs.items()
        for part, unit in one.variables(dim).items()
    }


def named(output: str, part: str) -> str:
    return f"{output}.{part}" if part else output


def sense(draft: Draft, name: str) -> tuple[str, list[int], list[float]]:
    """Word, probe rows and numbers of an output."""
    alone = replace(draft, sensors=ProbeRows(draft.layout.size))
    output = draft.outputs[name].sense(name, alone)
    rows = alone.sensors.affine()
    chosen = csr_array(csr_array(rows.matrix)[list(output.rows)])
    first = draft.probes.add(chosen, rows.offset[list(output.rows)] + chosen @ draft.layout.shift)
    return (
        draft.outputs[name].word,
        list(range(first, first + len(output.rows))),
        list(output.parameters),
    )


def switches(force: LawForces) -> Iterator[Callable[..., np.ndarray]]:
    """Parts (s, k) at times (s,) [s] of the expressions of forces that jump with time alone, see
    `expressions.switches`.
    """
    word, _, rest = force.law.name.partition("|")
    if word != WORD:
        return
    _, texts, given, *_ = rest.split("|")
    known = [one for one in given.split(",") if one and ":" not in one]
    for text in texts.split(";"):
        program = expressions.parse(text, responses.Names(known))
        for numbers in force.numbers if "t" in program else ():
            told = dict(zip(known, numbers[1:].tolist(), strict=False))
            told |= {"pi": np.pi} | {
                step: one.value for step, one in expressions.quantities(program).items()
            }
            yield partial(clocked, program, told)


def clocked(
    program: expressions.Program,
    told: Mapping[str, float],
    times: np.ndarray,
    margins: bool = False,
) -> np.ndarray:
    """The same of a program at times (s,), or `margins`; what is of the state, and not `told`, is
    nan.
    """
    of_state = {
        step: _nan if expressions.is_call(step) else np.nan
        for step in program
        if isinstance(step, str)
    }
    return expressions.switches(program, {**of_state, **told, "t": times}, times, margins)


def _nan(argument: np.ndarray) -> np.ndarray:
    return np.full(np.shape(argument), np.nan)


def law_of(name: str) -> ForceLaw:
    """The law of this name."""
    return made(name)[0]


@cache
def made(name: str) -> tuple[ForceLaw, tuple[int, ...]]:
    """The law of this name, see the module, and which (i,) of the rows that it is given it reads or
    pushes.

    InputError for an output whose class has not been declared.
    """
    law, used = written_as(name)  # first of all: it says which extra is missing
    from . import force_symbols as written

    return written.law(name, law, law_of), used


def written_as(name: str) -> tuple[ForceSymbols, tuple[int, ...]]:
    """The law of this name in symbols, of those rows alone that it reads or pushes, and which (i,)
    of the rows that it is given these are.
    """
    extras.need("symbols", "expression of the state")
    import sympy

    from ...core.compiling import symbols
    from . import force_symbols as written

    _, kind, text, given, told, *inputs = name.split("|")
    coordinate = COORDINATES[kind]
    outputs = [part.split(":") for part in told.split(",") if part]
    listed = [part.split(":") for part in given.split(",") if part]
    parameters = [part[0] for part in listed if len(part) == 1]
    curves = [part for part in listed if len(part) == 2]
    known = responses.Names(parameters)
    clocked = int(any("t" in expressions.parse(one, known) for one in text.split(";")))
    total = coordinate.rows + sum(int(one[2]) for one in outputs)
    count = 1 + len(parameters) + sum(int(one[3]) for one in outputs)
    ends = np.cumsum([count, *(int(size) for _, size in curves)]).tolist()
    tables = {
        call: (first, last) for (call, _), first, last in zip(curves, ends, ends[1:], strict=False)
    }
    y = written.rows(total)
    v = written.rates(total)
    p = written.numbers(count)
    along, own = coordinate.write(y[: coordinate.rows, :], v[: coordinate.rows, :], p[0])
    names = {"t": written.history(), "pi": sympy.pi}
    row = coordinate.rows
    first = 1 + len(parameters)
    for output, word, rows, numbers, *parts in outputs:
        last, final = row + int(rows), first + int(numbers)
        values = probe_of(name, word).write(y[row:last, :], v[row:last, :], p[first:final, :])
        names |= {named(output, part): value for part, value in zip(parts, values, strict=True)}
        row, first = last, final
    names |= zip(coordinate.own, own, strict=True)  # before outputs, and parameters before both
    names |= {one: written.history(clocked + k) for k, one in enumerate(inputs)}
    names |= {parameter: p[1 + k] for k, parameter in enumerate(parameters)}
    names |= {call: partial(curve, table=written.table(k)) for k, call in enumerate(tables)}

    def value(text: str) -> Any:
        program = expressions.parse(text, known)
        scales = {
            step: symbols.number(one.value) for step, one in expressions.quantities(program).items()
        }
        return expressions.evaluate(program, names | scales, symbols.ALGEBRA, symbols.number)

    values = [value(one) for one in text.split(";")]
    F = [values[0] * sympy.diff(along, one) for one in y]
    read = tuple(values) if kind == READING else ()
    return written.pruned(
        written.ForceSymbols(F, ends[-1], clocked + len(inputs), kept=read, tables=tables)
    )


def curve(x: Any, table: Any) -> Any:
    """The value of a table in symbols."""
    from . import force_symbols as written

    return written.lookup(x, table)


def probe_of(law: str, word: str) -> type[Probe]:
    """The class of an output."""
    if word not in Probe.known:
        expected = f"outputs of known types {listed(Probe.known, word)}"
        raise InputError(
            say(
                f"force law '{law}'",
                expected,
                f"'{word}'",
                "import the file that declares it first",
            )
        )
    return Probe.known[word]


ForceLaw.makers[WORD] = law_of


def angle_between(
    draft: Draft,
    where: str,
    at: At,
    to: At | None,
    axis: Sequence[float] | None,
    u: np.ndarray | None = None,
) -> tuple[Gauge, str]:
    """The angle that a place has turned about an axis since the reference, or has against another
    place, which carries the axis.

    It is that of a direction u (3,) of a frame in space, by default any one normal to the axis.
    """
    layout = draft.layout
    if to is None or layout.dim == 2:
        ends = [at] if to is None else [at, to]
        arms = [draft.probes.add(arm(where, layout, end, axis, u)[0]) for end in ends]
        gauge = Gauge("angle", tuple(first + c for first in arms for c in range(2)), 0.0)
        return gauge, "torque" if to is None else "relative torque"
    _, u, normal = arm(where, layout, at, axis, u)
    vectors = [
        rows_of(where, layout, end, vector) for end, vector in ((at, u), (to, u), (to, normal))
    ]
    first = [draft.probes.add(rows) for rows in vectors]
    return Gauge("angle", tuple(row + c for row in first for c in range(3)), 0.0), "torque in space"
