"""Sampled controllers in C: what they read at their instants, their laws, and what they give.

What they give stands in the memory of the program behind the inputs of the caller.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import sympy

from ..control.controllers import Controlled
from ..control.feed import sampler
from ..control.laws import NumberLaw
from ..core.compiling import symbols
from ..core.errors import listed
from ..core.printing.memory import PackedMemory
from ..core.printing.printer import KernelPrinter
from ..core.printing.values import Array, Base, Const
from ..core.values import expressions
from ..core.values.problems import Problem
from ..core.values.tables import Table
from ..dynamics.scheme import GeneralizedAlpha
from ..systems import compiled
from ..systems.forces import responses
from ..systems.measures.readings import Reading
from ..systems.signals import driving_inputs, inputs_of
from ..systems.system import System
from .outputs import Column, columns_of
from .signals import written_lines
from .text import replaced, template

NO_LIMIT = 1e300  #: in place of infinite ones, whose differences between cases are no numbers


def controlled_of(system: System) -> list[Controlled]:
    """The inputs that controllers set."""
    return [one for one in inputs_of(system).values() if isinstance(one, Controlled)]


def refuse(system: System, one: Controlled) -> Problem | None:
    """What speaks against a controller in C: a function of Python, or outputs without C that it
    reads.
    """
    if not isinstance(one.law, NumberLaw):
        got = f"'{one.name}', a function of Python"
        remedy = "write it as a `laws.NumberLaw`, whose kernel has C"
        return Problem("a controller with a law in numbers", got, remedy)
    return refuse_reading(system, one.reads, "a controller")


def refuse_reading(system: System, numbers: Sequence[int], reader: str) -> Problem | None:
    """What speaks against values, by their numbers, that a `reader` in C reads: outputs without C."""
    known = {
        column.name
        for name, output in system.outputs.items()
        for column in columns_of(system, name, output)
    }
    for reading in (system.readings[-1 - number] for number in numbers if number < 0):
        for name, _, column in reading.columns:
            if column not in known:
                there = listed(sorted(known), name, "of which there are none")
                expected = f"{reader} that reads outputs with C, {there}"
                remedy = "let it read places, velocities, angles or reactions"
                return Problem(expected, f"'{name}'", remedy)
    return None


class ControllersInC(NamedTuple):
    """All controllers of a model in C."""

    text: str  #: functions of the program
    rooms: dict[str, np.ndarray]  #: of the program, which it writes: what they read, and keep
    curves: dict[str, Table]  #: that they read, by the names of their numbers
    columns: tuple[Column, ...]  #: what they give, as outputs


def numbers_of(system: System) -> dict[str, np.ndarray]:
    """Numbers of laws, of what is given at the start, and of expressions of outputs, by the names
    that the program has for them.

    Each is the mean of those of all signals that are the same controller, so that it follows a
    parameter that changes them one after the other.
    """
    copies = [
        [
            signal
            for signal in system.signals
            if isinstance(signal, Controlled) and signal.name == one.name
        ]
        for one in controlled_of(system)
    ]
    laws = (np.mean([one.law.numbers for one in same], axis=0) for same in copies)
    found = {f"law_{k}": np.clip(law, -NO_LIMIT, NO_LIMIT) for k, law in enumerate(laws)}
    found |= {
        f"reading_{k}": one.values for k, one in enumerate(system.readings) if len(one.values)
    }
    starts = [np.mean([one.start for one in same]) for same in copies]
    return found | ({"given": np.array(starts)} if starts else {})


def calls(
    printer: KernelPrinter,
    memory: PackedMemory,
    system: System,
    own: Mapping[str, np.ndarray],
) -> dict[str, str]:
    """Calls in C of the laws of all controllers, which are printed, by the words that stand for
    them; `own` are arrays of the program.
    """
    found = {}
    for k, one in enumerate(controlled_of(system)):
        names = [f"{word}_{k}" for word in ("law", "reads", "kept")]
        arrays = [
            memory.enclose(own[name], f"own_{name}") if own[name].size else NONE for name in names
        ]
        law = printer.entry(type(one.law).kernel, arrays)
        places = (f"@own_{name}@" if own[name].size else "0" for name in names)
        found[f"LAW_{k}"] = f"{law.name}({', '.join(places)})"
    return found


NONE = Array(Base(), "0", "double", (Const(0),))


def write(
    system: System, scheme: GeneralizedAlpha, inputs: int, known: Collection[str]
) -> ControllersInC:
    """All controllers, behind so many `inputs` of the caller.

    What they give becomes an output where neither an output has its name nor what is `known`.
    """
    taken = {*known, *(column for one in system.outputs.values() for column in one.columns)}
    controlled = controlled_of(system)
    kept = [int(k) for k in responses.kept(compiled.compile_system(system))]
    rooms: dict[str, np.ndarray] = {}
    curves: dict[str, Table] = {}
    blocks, columns = [], []
    for k, one in enumerate(controlled):
        rooms[f"reads_{k}"] = np.zeros(len(one.reads))
        rooms[f"kept_{k}"] = np.array(one.law.memory, dtype=float)
        lines = [
            *read(system, one.reads, kept, f"@own_reads_{k}@", curves),
            f"found = CALL_LAW_{k};",
            "if (!is_finite(found))",
            "    return NAME_CONTROLLER_NOT_FINITE;",
            f"*changed |= give(m, {k}, found);",
        ]
        blocks += [f"    if (is_due(m, {k})) {{", *(f"        {line}" for line in lines), "    }"]
        if one.name not in taken:
            columns.append(Column(one.name, one.unit, f"m->inputs[{inputs + k}]"))
    words = {
        "EVERY_SAMPLE": ", ".join(str(sampler(one, scheme).every) for one in controlled),
        "    ACT": "\n".join(blocks),
    }
    text = replaced(template("control.c"), words) if controlled else ""
    return ControllersInC(text, rooms, curves, tuple(columns))


def counts_of(system: System) -> dict[str, int]:
    """What the program counts of controllers."""
    names = {one.name for one in controlled_of(system)}
    drives = bool(names & driving_inputs(system))
    return {"CONTROLLED": len(names), "STEERING": int(drives)}


def read(
    system: System,
    numbers: Sequence[int],
    kept: Sequence[int],
    target: str,
    curves: dict[str, Table],
) -> Iterator[str]:
    """Lines that give a controller what it reads, values by their numbers; see `readings`.

    `kept` are places in the memory of forces; curves are added.
    """
    places = [kept[k] if k >= 0 else -1 for k in numbers]
    if places and places == list(range(places[0], places[0] + len(places))) and places[0] >= 0:
        yield f"EACH (i, {len(places)})"
        yield f"    {target}[i] = @state_memory@[{places[0]} + i];"
        return
    for i, (number, place) in enumerate(zip(numbers, places, strict=True)):
        if number >= 0:
            yield f"{target}[{i}] = @state_memory@[{place}];"
            continue
        lines, text = value_of(system, -1 - number, kept, curves)
        yield from ("{", *(f"    {line}" for line in lines), f"    {target}[{i}] = {text};", "}")


def value_of(
    system: System, number: int, kept: Sequence[int], curves: dict[str, Table]
) -> tuple[list[str], str]:
    """The value of a reading in C, and lines before it."""
    reading: Reading = system.readings[number]
    places: dict[Any, str] = {}

    def named(text: str, word: str = "read") -> Any:
        symbol = sympy.Symbol(f"{word}{len(places)}", real=True)
        places[symbol] = text
        return symbol

    names: dict[str, Any] = {"pi": sympy.pi}
    for k, name in enumerate(reading.parameters):
        names[name] = named(f"@own_reading_{number}@[{k}]")
    for name, k in reading.kept:
        names[name] = named(f"@state_memory@[{kept[k]}]")
    before = list[str]()
    for name, output, column in reading.columns:
        found = next(
            one for one in columns_of(system, output, system.outputs[output]) if one.name == column
        )
        before += found.lines
        names[name] = named(found.value)
    for table in reading.tables:
        word = f"READ_CURVE_{len(curves)}"
        curves[word] = table
        names[table.call] = partial(responses.curve, table=named(word, "T"))
    for step, one in expressions.quantities(reading.program).items():
        names[step] = symbols.number(one.value)
    value = expressions.evaluate(reading.program, names, symbols.ALGEBRA, symbols.number)
    lines, (text,) = written_lines([sympy.sympify(value)], places)
    return [*before, *lines], text
