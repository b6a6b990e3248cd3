"""Quantities: "210 GPa" becomes 2.1e11, and only where a pressure is expected.

    0.01        10 mm        d / 2        2 * pi * f        0.5 m * w

A quantity is a plain number (SI), a number with a unit, or an expression of these and of the
scene's parameters, whose dimensions are carried through the arithmetic (`functions`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from . import expressions
from .functions import ALGEBRA, Operand
from .problems import Problem, shown
from .units import (
    ACCELERATION,
    EXPONENT,
    MASS,
    NUMBER,
    PI,
    UNITS,
    Dimension,
    Quantity,
    describe,
    finite,
    measure,
    refuse_cycles,
    starts_with_number,
)


def convert(
    value: object, dimension: Dimension, parameters: Mapping[str, Quantity] | None = None
) -> float:
    """The SI value of a number, text or expression of parameters, of the wanted dimension."""
    quantity = read(value, parameters)
    got = quantity.exponents
    wanted = dimension.exponents
    # radians are numbers: a velocity may be r * w
    if not (
        got in (wanted, NUMBER.exponents)
        or (got[:3] == wanted[:3] and (wanted[3] or _is_expression(value)))
    ):
        advice = (
            f"write a number, or a quantity in {dimension.unit}"
            if dimension.unit
            else "write a number without a unit"
        )
        grams = got == MASS.exponents and dimension == ACCELERATION
        raise Problem(
            str(dimension),
            f"{shown(value)} ({describe(got)})",
            advice + grams * "; g is a gram, 1 g is 9.80665 m/s^2",
        )
    refuse_cycles(quantity, dimension, value)
    return quantity.value


def read(value: object, parameters: Mapping[str, Quantity] | None = None) -> Quantity:
    """A number, a text with a unit or an expression of parameters as a quantity; plain numbers are
    SI.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Quantity(finite(value, value), NUMBER.exponents)
    if not isinstance(value, str):
        raise Problem("a number or a quantity", shown(value), "write for instance 0.01 or '10 mm'")
    if not starts_with_number(value):
        return _evaluate(value, parameters or {})
    try:
        found = measure(value)
    except Problem as problem:
        try:
            return _evaluate(value, parameters or {})
        except Problem as other:
            meant = {*(parameters or {}), *expressions.FUNCTIONS} & set(
                re.findall(r"[^\W\d]\w*", value)
            )
            raise (other if meant else problem) from None
    for name, one in (parameters or {}).items():
        if (
            name in UNITS
            and one.exponents == UNITS[name][1]
            and re.search(rf"[*/·]\s*{name}\b", value)
        ):
            raise expressions.Ambiguous(name, value)
    return found


def _is_expression(value: object) -> bool:
    """Whether a text is more than a number with a unit."""
    try:
        return isinstance(value, str) and not (starts_with_number(value) and measure(value))
    except Problem:
        return True


def _evaluate(text: str, parameters: Mapping[str, Quantity]) -> Quantity:
    program = expressions.parse(text, parameters.keys())
    names = {"pi": PI} | expressions.quantities(program)
    names |= {
        name: parameters[name] for name in program if isinstance(name, str) and name in parameters
    }
    known = {name: Operand(one) for name, one in names.items()}
    number = NUMBER.exponents
    try:
        found: Operand = expressions.evaluate(
            program, known, ALGEBRA, lambda value: Operand(Quantity(value, number))
        )
    except (ArithmeticError, ValueError) as error:
        raise (
            error
            if isinstance(error, Problem)
            else Problem("a quantity", f"{shown(text)} ({error})")
        ) from error
    result = found.quantity
    if abs(max(result.exponents, key=abs)) > EXPONENT:
        raise Problem("a quantity whose unit has small powers", shown(text))
    return Quantity(finite(result.value, text), result.exponents, result.cycles)
