"""Quantities: "210 GPa" becomes 2.1e11, and only where a pressure is expected.

    0.01        10 mm        d / 2        2 * pi * f        0.5 m * w

A quantity is a plain number (SI), a number with a unit, or an expression of these and of the scene's parameters, whose dimensions
are carried through the arithmetic.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction

from . import expressions
from .problems import Problem, shown
from .units import (
    ANGLE,
    EXPONENT,
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


def convert(value: object, dimension: Dimension, parameters: Mapping[str, Quantity] | None = None) -> float:
    """The SI value of a number, text or expression of parameters, of the wanted dimension."""
    quantity = read(value, parameters)
    got, wanted = quantity.exponents, dimension.exponents
    # radians are numbers: a velocity may be r * w
    if not (got in (wanted, NUMBER.exponents) or (got[:3] == wanted[:3] and (wanted[3] or _is_expression(value)))):
        advice = f"write a number, or a quantity in {dimension.unit}" if dimension.unit else "write a number without a unit"
        raise Problem(str(dimension), f"{shown(value)} ({describe(got)})", advice)
    refuse_cycles(quantity, dimension, value)
    return quantity.value


def read(value: object, parameters: Mapping[str, Quantity] | None = None) -> Quantity:
    """A number, a text with a unit or an expression of parameters as a quantity; plain numbers are SI."""
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
            meant = {*(parameters or {}), *expressions.FUNCTIONS} & set(re.findall(r"[^\W\d]\w*", value))
            raise (other if meant else problem) from None
    for name, one in (parameters or {}).items():
        if name in UNITS and one.exponents == UNITS[name][1] and re.search(rf"[*/·]\s*{name}\b", value):
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
    names |= {name: parameters[name] for name in program if isinstance(name, str) and name in parameters}
    try:
        result: Quantity = expressions.evaluate(program, names, _ALGEBRA, lambda number: Quantity(number, NUMBER.exponents))
    except (ArithmeticError, ValueError) as error:
        raise error if isinstance(error, Problem) else Problem("a quantity", f"{shown(text)} ({error})") from error
    if abs(max(result.exponents, key=abs)) > EXPONENT:
        raise Problem("a quantity whose unit has small powers", shown(text))
    return Quantity(finite(result.value, text), result.exponents, result.cycles)


def _same(symbol: str) -> Callable[[Quantity, Quantity], Quantity]:
    """Sums, comparisons and extremes: both sides of one dimension, radians counting as numbers."""
    law = expressions.SCALAR[symbol]

    def apply(a: Quantity, b: Quantity) -> Quantity:
        if a.exponents[:3] != b.exponents[:3]:
            raise Problem(f"both sides of '{symbol}' of one dimension", f"{describe(a.exponents)} and {describe(b.exponents)}")
        value = law(a.value, b.value)
        return Quantity(value, NUMBER.exponents) if symbol[0] in "<>" else Quantity(value, a.exponents, max(a.cycles, b.cycles))

    return apply


def _pure(symbol: str) -> Callable[[Quantity], Quantity]:
    """Functions of numbers and angles."""
    law = expressions.SCALAR[symbol]

    def apply(a: Quantity) -> Quantity:
        if any(a.exponents[:3]):
            raise Problem(f"a number or an angle in {symbol}(...)", describe(a.exponents))
        refuse_cycles(a, ANGLE, f"{symbol}(...)")
        return Quantity(law(a.value), NUMBER.exponents)

    return apply


def _arc(symbol: str) -> Callable[..., Quantity]:
    """Angles of a number, or of two of one dimension."""
    law = expressions.SCALAR[symbol]

    def apply(*parts: Quantity) -> Quantity:
        if len(parts) > 1:
            _same("-")(*parts)
        elif any(parts[0].exponents):
            raise Problem(f"a number in {symbol}(...)", describe(parts[0].exponents))
        return Quantity(law(*(part.value for part in parts)), ANGLE.exponents)

    return apply


def product(a: Quantity, b: Quantity) -> Quantity:
    """a b."""
    cycles = max(-1, min(1, a.cycles + b.cycles))
    return Quantity(a.value * b.value, tuple(map(operator.add, a.exponents, b.exponents)), cycles)


def quotient(a: Quantity, b: Quantity) -> Quantity:
    """a / b; turns over turns are a number."""
    cycles = a.cycles if b.cycles < 1 else min(0, a.cycles)
    return Quantity(a.value / b.value, tuple(map(operator.sub, a.exponents, b.exponents)), cycles)


def power(a: Quantity, b: Quantity) -> Quantity:
    """a to the power of a number."""
    if any(b.exponents):
        raise Problem("a number as exponent of '**'", describe(b.exponents))
    power = Fraction(b.value).limit_denominator(12) if math.isfinite(b.value) and any(a.exponents) else Fraction(0)
    if abs(power) > EXPONENT:
        raise Problem(f"an exponent of a quantity of at most {EXPONENT}", str(b.value))
    return Quantity(math.pow(a.value, b.value), tuple(n * power for n in a.exponents))


_ALGEBRA: expressions.Algebra = {
    **{symbol: _same(symbol) for symbol in ("+", "-", "min", "max", "mod", "<", "<=", ">", ">=")},
    **{symbol: _pure(symbol) for symbol in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "floor")},
    **{symbol: _arc(symbol) for symbol in ("asin", "acos", "atan2")},
    "*": product,
    "/": quotient,
    "**": power,
    "sqrt": lambda a: power(a, Quantity(0.5, NUMBER.exponents)),
    "abs": lambda a: replace(a, value=abs(a.value)),
    "sign": lambda a: Quantity(expressions.SCALAR["sign"](a.value), NUMBER.exponents),
    "neg": lambda a: replace(a, value=-a.value),
    "where": lambda condition, a, b: a if condition.value != 0.0 else b,
}
