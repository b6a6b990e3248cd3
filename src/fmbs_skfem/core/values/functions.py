"""Values with dimensions: a parameter of a wrong dimension is refused, plain numbers may stand for
any unit in functions of time.

    A * sin(w * t)      A [m], w [rad/s]: a length                   0.1 * t      0.1 is a speed where a length is wanted
    5 * (t - T)         5 is a rate where a number is wanted         F * sin(t)   F [N] is no number: refused as a history

Powers of kilogram and metre come from parameters. A plain number may bring powers of the second to
them, and any unit where there is no parameter; so may t by itself. Numbers beside pi bring none: 2
pi T t with a period T is refused.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from ..storage.records import dataclass
from . import expressions, units
from .expressions import Program
from .inputs import Source, calls_of, timed
from .problems import Problem, shown
from .units import EXPONENT, NUMBER, PI, TIME, Dimension, Exponents, Quantity

Rule = Callable[..., "Operand"]

REMEDY = "look at the dimensions of its parameters and tables (a force / (1 N) is a number); t is in seconds"


@dataclass(frozen=True)
class Operand:
    """Part of an expression: the dimension that parameters and t give it, and what may change that;
    nothing in quantities.
    """

    quantity: Quantity  #: its value is nan where it depends on t or the state
    number: bool = False  #: holds a plain number, which may have a unit
    bare: bool = False  #: holds no parameter with a dimension

    def fits(self, wanted: Exponents) -> bool:
        """Whether it can have a dimension; radians count as numbers."""
        own = self.quantity.exponents[:3]
        none = NUMBER.exponents
        return own in (wanted[:3], none[:3]) or (
            (self.number or self.bare) and own[:2] in (wanted[:2], none[:2])
        )

    def beside(self, other: Operand) -> bool:
        """Whether it can stand in a sum with another one: both alike, without parameters, or
        numbers among them fit.
        """
        own = self.quantity.exponents[:3]
        its = other.quantity.exponents[:3]
        if own == its or (self.bare and other.bare):
            return True
        return (self.number and own[:2] in (its[:2], (0, 0))) or (
            other.number and its[:2] in (own[:2], (0, 0))
        )


def check(
    text: str,
    dimension: Dimension,
    parameters: Mapping[str, Quantity],
    clock: bool = True,
    inputs: Iterable[Source] = (),
) -> None:
    """Raises a Problem where the function of time `text` cannot have a dimension; without `clock` t
    is a number, not a time.

    Beside parameters it may read inputs, which have units, and call tables.
    """
    told = timed(inputs)
    tables = calls_of(inputs)
    program = expressions.parse(text, parameters.keys() | told.keys() | tables.keys() | {"t"})
    names: dict[str, Any] = {
        name: constant(parameters[name])
        for name in program
        if isinstance(name, str) and name in parameters
    }
    names |= {step: Operand(one) for step, one in expressions.quantities(program).items()}
    names |= {name: variable(unit) for name, unit in told.items()}
    names |= {call: table(call, *pair) for call, pair in tables.items()}
    check_program(program, text, dimension, names, clock)


def check_program(
    program: Program,
    text: str,
    dimension: Dimension | None,
    known: Mapping[str, Any],
    clock: bool = True,
    of: str = "t",
) -> None:
    """The same of a program with its names, a function `of` what messages say; of any dimension
    where None is given.
    """
    names = {
        "pi": Operand(PI, bare=True),
        "t": Operand(Quantity(math.nan, TIME.exponents), number=not clock, bare=True),
    } | dict(known)
    try:
        found: Operand = expressions.evaluate(
            program, names, ALGEBRA, lambda number: constant(Quantity(number, NUMBER.exponents))
        )
    except Problem as problem:
        raise Problem(problem.expected, problem.got, problem.remedy or REMEDY) from None
    except (ArithmeticError, ValueError) as error:
        raise Problem("an expression of finite numbers", f"{shown(text)} ({error})") from error
    if dimension is None:
        return
    if not found.fits(dimension.exponents):
        got = f"{shown(text)} ({units.describe(found.quantity.exponents)})"
        raise Problem(f"{dimension} as a function of {of}", got, REMEDY)
    units.refuse_cycles(found.quantity, dimension, text)


def table(call: str, of: str, unit: str) -> Rule:
    """A table with the units of its argument and of its values."""
    wanted = units.find_dimension(of) if of else NUMBER

    def apply(argument: Operand) -> Operand:
        if not argument.fits(wanted.exponents):
            raise Problem(
                f"{wanted} in {call.removesuffix(')')}...)",
                units.describe(argument.quantity.exponents),
            )
        return variable(unit)

    return apply


def variable(unit: str) -> Operand:
    """What changes with time or the state and has a unit."""
    return Operand(
        Quantity(math.nan, units.find_dimension(unit).exponents if unit else NUMBER.exponents)
    )


def constant(quantity: Quantity) -> Operand:
    """A parameter or a number in a function."""
    plain = not any(quantity.exponents)
    return Operand(quantity, number=plain, bare=plain)


def _value(symbol: str, *parts: Operand) -> float:
    """The value of an operation; nan where that of a part is not known."""
    values = [part.quantity.value for part in parts]
    return math.nan if any(map(math.isnan, values)) else float(expressions.SCALAR[symbol](*values))


def _sum(symbol: str) -> Rule:
    """Both sides of one dimension, which a plain number beside a term takes over."""

    def apply(a: Operand, b: Operand) -> Operand:
        if not a.beside(b):
            got = (
                f"{units.describe(a.quantity.exponents)} and {units.describe(b.quantity.exponents)}"
            )
            raise Problem(f"all parts of '{symbol}' of one dimension", got)
        lead = min(
            (a, b), key=lambda term: (term.number, term.bare, not any(term.quantity.exponents))
        )
        bare = (a.bare and b.bare) or any(term.bare and not term.number for term in (a, b))
        cycles = max(a.quantity.cycles, b.quantity.cycles)
        value = _value(symbol, a, b) if symbol != "where" else math.nan
        return Operand(
            Quantity(value, lead.quantity.exponents, cycles),
            number=a.number and b.number,
            bare=bare,
        )

    return apply


def _compared(symbol: str) -> Rule:
    both = _sum(symbol)

    def apply(a: Operand, b: Operand) -> Operand:
        return _pure_number(both(a, b).quantity.value)

    return apply


def _pure(symbol: str) -> Rule:
    """Functions of numbers and angles."""

    def apply(a: Operand) -> Operand:
        if not a.fits(NUMBER.exponents):
            raise Problem(
                f"a number or an angle in {symbol}(...)", units.describe(a.quantity.exponents)
            )
        units.refuse_cycles(a.quantity, units.ANGLE, f"{symbol}(...)")
        return _pure_number(_value(symbol, a))

    return apply


def _arc(symbol: str) -> Rule:
    """Angles of a number, or of two of one dimension."""

    def apply(*parts: Operand) -> Operand:
        if len(parts) > 1:
            _sum("-")(*parts)
        elif not parts[0].fits(NUMBER.exponents):
            raise Problem(f"a number in {symbol}(...)", units.describe(parts[0].quantity.exponents))
        return Operand(Quantity(_value(symbol, *parts), units.ANGLE.exponents), bare=True)

    return apply


def _product(a: Operand, b: Operand) -> Operand:
    x = a.quantity
    y = b.quantity
    cycles = max(-1, min(1, x.cycles + y.cycles))
    exponents = tuple(map(operator.add, x.exponents, y.exponents))
    return _scaled(a, b, Quantity(_value("*", a, b), exponents, cycles))


def _quotient(a: Operand, b: Operand) -> Operand:
    """Turns over turns are a number."""
    x = a.quantity
    y = b.quantity
    cycles = x.cycles if y.cycles < 1 else min(0, x.cycles)
    exponents = tuple(map(operator.sub, x.exponents, y.exponents))
    return _scaled(a, b, Quantity(_value("/", a, b), exponents, cycles))


def _scaled(a: Operand, b: Operand, found: Quantity) -> Operand:
    number = (a.number and b.quantity != PI) or (b.number and a.quantity != PI)
    return Operand(found, number, a.bare and b.bare)


def _power(a: Operand, b: Operand) -> Operand:
    if not b.fits(NUMBER.exponents):
        raise Problem("a number as exponent of '**'", units.describe(b.quantity.exponents))
    exponent = b.quantity.value
    exponents = a.quantity.exponents
    cycles = a.quantity.cycles
    if any(exponents[:3]) and not math.isnan(exponent):
        power = Fraction(exponent).limit_denominator(12) if math.isfinite(exponent) else Fraction(0)
        if abs(power) > EXPONENT:
            raise Problem(f"an exponent of a quantity of at most {EXPONENT}", str(exponent))
        exponents = tuple(n * power for n in exponents)
        cycles = 0
    return Operand(Quantity(_value("**", a, b), exponents, cycles), a.number, a.bare)


def _alike(symbol: str) -> Rule:
    """Of the dimension of its argument."""
    return lambda a: replace(a, quantity=replace(a.quantity, value=_value(symbol, a)))


def _choose(condition: Operand, a: Operand, b: Operand) -> Operand:
    """Both of one dimension; where the condition is known, the one that it chooses, beside which a
    plain number may stand.
    """
    known = condition.quantity.value
    if math.isnan(known) or (any(a.quantity.exponents) and any(b.quantity.exponents)):
        both = _sum("where")(a, b)
    return both if math.isnan(known) else a if known != 0.0 else b


def _pure_number(value: float) -> Operand:
    return Operand(Quantity(value, NUMBER.exponents), bare=True)


ALGEBRA: expressions.Algebra = {
    **{symbol: _sum(symbol) for symbol in ("+", "-", "min", "max", "mod")},
    **{symbol: _compared(symbol) for symbol in ("<", "<=", ">", ">=")},
    **{
        symbol: _pure(symbol)
        for symbol in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "floor")
    },
    **{symbol: _arc(symbol) for symbol in ("asin", "acos", "atan2")},
    **{symbol: _alike(symbol) for symbol in ("abs", "neg")},
    "*": _product,
    "/": _quotient,
    "**": _power,
    "sqrt": lambda a: _power(a, constant(Quantity(0.5, NUMBER.exponents))),
    "sign": lambda a: _pure_number(_value("sign", a)),
    "where": _choose,
}
