"""Functions of time in C: their values, and where joints read them their first three derivatives.

An input that drives a joint is a cubic through the values at the ends of the last four spans, as in
`core.values.inputs`. Derivatives of what reads inputs, and of what bends or jumps, such as straight
lines through points, are those of the cubic through four values of a step, as in
`dynamics.histories`; those of other texts are exact, and have no round-off of a late time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial, singledispatch
from typing import Any, NamedTuple

import sympy

from ..core.compiling import symbols
from ..core.values import expressions
from ..core.values.expressions import Expression
from ..core.values.inputs import Held, Input
from ..core.values.problems import Problem
from ..core.values.tables import Table
from ..reduction.cases import Place
from ..systems.forces import force_symbols as written
from ..systems.forces import responses
from ..systems.signals import Cosine, Sine, driving_inputs, read_inputs
from ..systems.system import System, driving
from .numbers import Numbers
from .text import block, replaced, statements, template

ORDERS = 3  #: derivatives that velocities on driven joints need
T = sympy.Symbol("t", real=True)
#: what bends or jumps
BENT = written.lookup, symbols.less, symbols.not_more, symbols.sign_of, symbols.floor_of
# a spline and its derivatives, of which forces read the first one alone: functions of `maths.c`
spline = symbols.function(
    "lookup",
    symbols.function(
        "lookup_slope",
        symbols.function("lookup_bend", symbols.function("lookup_third", symbols.constant)),
    ),
)


def input_symbol(name: str) -> Any:
    """The symbol of an input, which C can read: other than letters and digits as their numbers."""
    plain = re.sub(r"\W", lambda found: f"_{ord(found[0]):x}_", name, flags=re.ASCII)
    return sympy.Symbol(f"input_{plain}", real=True)


class KnownSymbols(NamedTuple):
    """Symbols in functions of time: of numbers that parameters change, by their places in the case,
    and of curves of tables.
    """

    varied: dict[Any, Place]
    curves: dict[Any, Table]

    def curve(self, table: Table) -> Any:
        """The symbol of a table, which is added."""
        for symbol, other in self.curves.items():
            if other == table:
                return symbol
        self.curves[symbol := written.table(len(self.curves))] = table
        return symbol


def read_spline(x: Any, table: Any) -> Any:
    """The value of a table that drives a joint, in symbols, which can be differentiated as often as
    joints need.
    """
    return spline(x, table)


@singledispatch
def in_symbols(signal: Any, leaf: Place, known: KnownSymbols) -> Any:
    """A function of time in symbols. Types register here; Problem for one that has not, as a
    function of Python.

    `leaf` is its place in the case. Curves of tables are added to those that are known.
    """
    raise Problem("expressions of t and of inputs", type(signal).__name__)


def refuse(signal: Any) -> Problem | None:
    """What speaks against a function of time in C."""
    try:
        in_symbols(signal, (), KnownSymbols({}, {}))
    except Problem as problem:
        return problem
    return None


@in_symbols.register
def _(signal: Input, leaf: Place, known: KnownSymbols) -> Any:
    return input_symbol(signal.name)


@in_symbols.register
def _(signal: Expression, leaf: Place, known: KnownSymbols) -> Any:
    names: dict[str, Any] = {"t": T, "pi": sympy.pi}
    for one in signal.inputs:
        if isinstance(one, Table):
            table = known.curve(one)
            call = partial(
                read_spline if one.smooth and one.drives else responses.curve, table=table
            )
            names |= {one.name: call(T), one.call: call}
            continue
        names[one.name] = in_symbols(one, leaf, known)
    program: list[Any] = list(signal.program)
    for k, step in enumerate(program):
        if isinstance(step, float) and (*leaf, "program", k) in known.varied.values():
            symbol = next(
                one for one, place in known.varied.items() if place == (*leaf, "program", k)
            )
            program[k], names[symbol.name] = symbol.name, symbol
    return expressions.evaluate(tuple(program), names, symbols.ALGEBRA, symbols.number)


@in_symbols.register
def _(signal: Cosine, leaf: Place, known: KnownSymbols) -> Any:
    return sympy.cos(in_symbols(signal.angle, (*leaf, "angle"), known))


@in_symbols.register
def _(signal: Sine, leaf: Place, known: KnownSymbols) -> Any:
    return sympy.sin(in_symbols(signal.angle, (*leaf, "angle"), known))


class Timed(NamedTuple):
    """All functions of time in C: statements that fill a row of values."""

    lines: tuple[str, ...]
    rough: tuple[str, ...]  #: functions of those whose derivatives are differences
    curves: dict[str, Table]  #: that they read, by the names of their numbers
    changed: tuple[Place, ...]  #: numbers that parameters change, in the case


def write_signals(system: System, inputs: Mapping[str, int], given: Numbers) -> Timed:
    """All functions of time at a time t, with the derivatives that joints need."""
    driven = {k for _, k in driving(system.constraints)}
    count = len(system.signals)
    changed = [place for place in given.varying if place[:2] == ("system", "signals")]
    found = {sympy.Symbol(f"varied{k}", real=True): place for k, place in enumerate(changed)}
    known = KnownSymbols(found, {})
    smooth = {
        input_symbol(name): sympy.Function(str(input_symbol(name)))(T)
        for name in sorted(driving_inputs(system))
    }
    values, targets, rough = [], [], dict[int, Any]()
    for k, signal in enumerate(system.signals):
        value = sympy.sympify(in_symbols(signal, ("system", "signals", k), known)).xreplace(smooth)
        follows = read_inputs(signal) and not isinstance(signal, Held)
        if k in driven and (value.atoms(*BENT) or follows):
            rough[k] = value.xreplace(derivatives_of(smooth.values()))
        for order in range(ORDERS + 1 if k in driven else 1):
            values.append(value.doit().xreplace(derivatives_of(smooth.values())))
            targets.append(f"row[{order * count + k}] = {{}};")
            value = sympy.diff(value, T)
    places: dict[Any, str] = {input_symbol(name): f"m->acting[{k}]" for name, k in inputs.items()}
    for one, path in smooth.items():
        name = next(name for name in inputs if input_symbol(name) == one)
        symbols_of = derivatives_of([path])
        places |= {
            symbol: f"m->smooth[{order}][{inputs[name]}]"
            for order, symbol in enumerate(symbols_of.values())
        }
    # what no text reads is followed by other numbers, or by none, which is refused
    read = set().union(*(one.free_symbols for one in (*values, *rough.values())))
    found = {symbol: place for symbol, place in found.items() if symbol in read}
    places |= {symbol: f"@own_varied_{k}@[0]" for k, symbol in enumerate(found)}
    curves = {
        f"CURVE_{k}": (symbol, table) for k, (symbol, table) in enumerate(known.curves.items())
    }
    places |= {symbol: name for name, (symbol, _) in curves.items()}
    lines, texts = written_lines(values, places)
    calls = [*lines, *(target.format(one) for target, one in zip(targets, texts, strict=True))]
    functions = []
    for k, value in rough.items():
        inside, (text,) = written_lines([value], places)
        functions.append(
            replaced(template("rough.c"), {"NUMBER": k, "    LINES": block(inside), "VALUE": text})
        )
        rows = ", ".join(f"row + {order * count + k}" for order in range(1, ORDERS + 1))
        calls.append("if (h != 0.0)")
        calls.append(f"    follow_{k}(m, t, h, {rows});")
    tables = {name: table for name, (_, table) in curves.items()}
    return Timed(tuple(calls), tuple(functions), tables, tuple(found.values()))


def written_lines(values: Sequence[Any], places: Mapping[Any, str]) -> tuple[list[str], list[str]]:
    """Lines and texts of `statements`, with curves as pointers to their numbers."""
    lines, texts = statements(values, places)
    return [line.replace("const double T", "const double *const T") for line in lines], texts


def derivatives_of(paths: Iterable[Any]) -> dict[Any, Any]:
    """Symbols of some functions of time and of their derivatives, by these."""
    return {
        path.diff(T, order): sympy.Symbol(f"{path.func}_{order}", real=True)
        for path in paths
        for order in range(ORDERS + 1)
    }
