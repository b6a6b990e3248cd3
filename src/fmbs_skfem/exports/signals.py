"""Functions of time in C: their values, and where joints read them their first three derivatives."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import sympy

from ..core.compiling import symbols
from ..core.errors import InputError, say
from ..core.values import expressions
from ..core.values.expressions import Expression
from ..core.values.inputs import Input
from ..core.values.tables import Table
from ..systems.signals import Cosine, Sine
from ..systems.system import System, driving
from .text import block, statements

ORDERS = 3  #: derivatives that velocities on driven joints need
T = sympy.Symbol("t", real=True)


def input_symbol(name: str) -> Any:
    """The symbol of an input."""
    return sympy.Symbol(f"input_{name}", real=True)


@singledispatch
def in_symbols(signal: Any, where: str) -> Any:
    """A function of time in symbols. Types register here; InputError for one that has not, as a function of Python."""
    raise InputError(say(where, "expressions of t and of inputs", type(signal).__name__))


@in_symbols.register
def _(signal: Input, where: str) -> Any:
    return input_symbol(signal.name)


@in_symbols.register
def _(signal: Expression, where: str) -> Any:
    names: dict[str, Any] = {"t": T, "pi": sympy.pi}
    for one in signal.inputs:
        if isinstance(one, Table) or one.call:
            raise InputError(say(where, "expressions of t and of inputs", f"the table '{one.name}'", "write it as interp(...)"))
        names[one.name] = in_symbols(one, where)
    return expressions.evaluate(signal.program, names, symbols.ALGEBRA, symbols.number)


@in_symbols.register
def _(signal: Cosine, where: str) -> Any:
    return sympy.cos(in_symbols(signal.angle, where))


@in_symbols.register
def _(signal: Sine, where: str) -> Any:
    return sympy.sin(in_symbols(signal.angle, where))


def write_signals(system: System, inputs: dict[str, int]) -> str:
    """`read_signals` in C, which sets all signals and their derivatives at a time."""
    driven, count = {k for _, k in driving(system.constraints)}, len(system.signals)
    values, targets = [], []
    for k, signal in enumerate(system.signals):
        value = sympy.sympify(in_symbols(signal, f"function of time {k}"))
        if k in driven and any(input_symbol(name) in value.free_symbols for name in inputs):
            raise InputError(
                say("inputs", "inputs that act as forces", "one that drives a joint", "drive it by a force or a torque")
            )
        for order in range(ORDERS + 1 if k in driven else 1):
            values.append(value)
            targets.append(f"m->signals[{order * count + k}] = {{}};")
            value = sympy.diff(value, T)
    places = {input_symbol(name): f"m->inputs[{k}]" for name, k in inputs.items()}
    lines, found = statements(values, places)
    body = block([*lines, *(target.format(one) for target, one in zip(targets, found, strict=True))])
    unread = "" if any("t" in str(value.free_symbols) and T in value.free_symbols for value in values) else "    (void)t;\n"
    if not count:
        unread += "    (void)m;\n"
    return f"static void read_signals(NAME_memory *m, double t)\n{{\n{unread}{body}{chr(10) if body else ''}}}\n"
