"""Dimensions of functions of time: a parameter of a wrong dimension is refused, plain numbers may stand for any unit.

    A * sin(w * t)      A [m], w [rad/s]: a length                   0.1 * t      0.1 is a speed where a length is wanted
    5 * (t - T)         5 is a rate where a number is wanted         F * sin(t)   F [N] is no number: refused as a history

Powers of kilogram and metre come from parameters. A plain number may bring powers of the second to them, and any unit where
there is no parameter; so may t by itself. Numbers beside pi bring none: 2 pi T t with a period T is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from . import expressions, quantities, units
from .expressions import Program
from .inputs import Source, calls_of, timed
from .problems import Problem, shown
from .records import dataclass
from .units import NUMBER, PI, TIME, Dimension, Quantity

Rule = Callable[..., "Term"]

REMEDY = "look at the dimensions of its parameters; t is in seconds"


@dataclass(frozen=True)
class Term:
    """Part of a function of time: the dimension that parameters and t give it, and what may change that."""

    quantity: Quantity  #: its value is nan where it depends on t
    number: bool = False  #: holds a plain number, which may have a unit
    bare: bool = False  #: holds no parameter with a dimension

    def fits(self, wanted: units.Exponents) -> bool:
        """Whether the term can have a dimension; radians count as numbers."""
        own, none = self.quantity.exponents[:3], NUMBER.exponents
        return own in (wanted[:3], none[:3]) or ((self.number or self.bare) and own[:2] in (wanted[:2], none[:2]))

    def beside(self, other: Term) -> bool:
        """Whether the term can stand in a sum with another one: both alike, without parameters, or numbers among them fit."""
        own, its = self.quantity.exponents[:3], other.quantity.exponents[:3]
        if own == its or (self.bare and other.bare):
            return True
        return (self.number and own[:2] in (its[:2], (0, 0))) or (other.number and its[:2] in (own[:2], (0, 0)))


def check(
    text: str,
    dimension: Dimension,
    parameters: Mapping[str, Quantity],
    clock: bool = True,
    inputs: Iterable[Source] = (),
) -> None:
    """Raises a Problem where the function of time `text` cannot have a dimension; without `clock` t is a number, not a time.

    Beside parameters it may read inputs, which have units, and call tables.
    """
    told, tables = timed(inputs), calls_of(inputs)
    program = expressions.parse(text, parameters.keys() | told.keys() | tables.keys() | {"t"})
    names: dict[str, Any] = {name: _constant(parameters[name]) for name in program if isinstance(name, str) and name in parameters}
    names |= {step: Term(one) for step, one in expressions.quantities(program).items()}
    names |= {name: variable(unit) for name, unit in told.items()}
    names |= {call: table(call, *pair) for call, pair in tables.items()}
    check_program(program, text, dimension, names, clock)


def check_program(
    program: Program, text: str, dimension: Dimension | None, known: Mapping[str, Any], clock: bool = True, of: str = "t"
) -> None:
    """The same of a program with its names, a function `of` what messages say; of any dimension where None is given."""
    names = {"pi": Term(PI, bare=True), "t": Term(Quantity(math.nan, TIME.exponents), number=not clock, bare=True)} | dict(known)
    found: Term = expressions.evaluate(program, names, _ALGEBRA, lambda number: _constant(Quantity(number, NUMBER.exponents)))
    if dimension is None:
        return
    if not found.fits(dimension.exponents):
        got = f"{shown(text)} ({units.describe(found.quantity.exponents)})"
        raise Problem(f"{dimension} as a function of {of}", got, REMEDY)
    units.refuse_cycles(found.quantity, dimension, text)


def table(call: str, of: str, unit: str) -> Rule:
    """A table with the units of its argument and of its values."""
    wanted = units.find_dimension(of) if of else NUMBER

    def apply(argument: Term) -> Term:
        if not argument.fits(wanted.exponents):
            raise Problem(f"{wanted} in {call.removesuffix(')')}...)", units.describe(argument.quantity.exponents), REMEDY)
        return variable(unit)

    return apply


def variable(unit: str) -> Term:
    """What changes with time or the state and has a unit."""
    return Term(Quantity(math.nan, units.find_dimension(unit).exponents if unit else NUMBER.exponents))


def _constant(quantity: Quantity) -> Term:
    plain = not any(quantity.exponents)
    return Term(quantity, number=plain, bare=plain)


def _sum(symbol: str) -> Rule:
    """Both sides of one dimension, which a plain number beside a term takes over."""

    def apply(a: Term, b: Term) -> Term:
        if not a.beside(b):
            got = f"{units.describe(a.quantity.exponents)} and {units.describe(b.quantity.exponents)}"
            raise Problem(f"all parts of '{symbol}' of one dimension", got, REMEDY)
        lead = min((a, b), key=lambda term: (term.number, term.bare, not any(term.quantity.exponents)))
        bare = (a.bare and b.bare) or any(term.bare and not term.number for term in (a, b))
        return Term(replace(lead.quantity, value=math.nan), number=a.number and b.number, bare=bare)

    return apply


def _compared(symbol: str) -> Rule:
    both = _sum(symbol)

    def apply(a: Term, b: Term) -> Term:
        both(a, b)
        return _PURE

    return apply


def _pure(symbol: str) -> Rule:
    """Functions of numbers and angles."""

    def apply(a: Term) -> Term:
        if not a.fits(NUMBER.exponents):
            raise Problem(f"a number or an angle in {symbol}(...)", units.describe(a.quantity.exponents), REMEDY)
        units.refuse_cycles(a.quantity, units.ANGLE, f"{symbol}(...)")
        return _PURE

    return apply


def _arc(symbol: str) -> Rule:
    """Angles of a number, or of two of one dimension."""

    def apply(*parts: Term) -> Term:
        if len(parts) > 1:
            _sum(symbol)(*parts)
        elif not parts[0].fits(NUMBER.exponents):
            raise Problem(f"a number in {symbol}(...)", units.describe(parts[0].quantity.exponents), REMEDY)
        return _PURE

    return apply


def _product(law: Callable[[Quantity, Quantity], Quantity]) -> Rule:
    def apply(a: Term, b: Term) -> Term:
        number = (a.number and b.quantity != PI) or (b.number and a.quantity != PI)
        return Term(law(a.quantity, b.quantity), number, a.bare and b.bare)

    return apply


def _power(a: Term, b: Term) -> Term:
    if not b.fits(NUMBER.exponents):
        raise Problem("a number as exponent of '**'", units.describe(b.quantity.exponents), REMEDY)
    if not any(a.quantity.exponents) or math.isnan(b.quantity.value):
        return Term(replace(a.quantity, value=math.nan), a.number, a.bare)
    exponent = Quantity(b.quantity.value, NUMBER.exponents)
    return Term(quantities.power(replace(a.quantity, value=1.0), exponent), a.number, a.bare)


def _same(a: Term) -> Term:
    return Term(replace(a.quantity, value=-a.quantity.value), a.number, a.bare)


_PURE = Term(Quantity(math.nan, NUMBER.exponents), bare=True)
_ALGEBRA: expressions.Algebra = {
    **{symbol: _sum(symbol) for symbol in ("+", "-", "min", "max", "mod")},
    **{symbol: _compared(symbol) for symbol in ("<", "<=", ">", ">=")},
    **{symbol: _pure(symbol) for symbol in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "floor")},
    **{symbol: _arc(symbol) for symbol in ("asin", "acos", "atan2")},
    "*": _product(quantities.product),
    "/": _product(quantities.quotient),
    "**": _power,
    "sqrt": lambda a: _power(a, _constant(Quantity(0.5, NUMBER.exponents))),
    "abs": lambda a: a,
    "sign": lambda a: _PURE,
    "neg": _same,
    "where": lambda condition, a, b: _sum("where")(a, b),
}
