"""Expressions of the state: what a force is as a text in outputs, t and parameters, with its
dimension checked.

-k * (tip.x - 0.3 m) - c * tip.vx            an output and its parts, numbers with a unit, parameters
Kp * (goal - hinge.angle) - Kd * hinge.rate
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from ..errors import closest, listed
from ..storage.records import dataclass
from . import expressions, functions, units
from .expressions import Program
from .functions import Operand
from .problems import Problem, shown
from .units import NUMBER, Dimension, Quantity


class Names(Collection[str]):
    """Every name that is no unit, beside those of known parameters and t."""

    def __init__(self, known: Collection[str]) -> None:
        self.known = known

    def __contains__(self, name: object) -> bool:
        return name not in units.UNITS or name in self.known or name == "t"

    def __iter__(self) -> Iterator[str]:
        return iter(self.known)

    def __len__(self) -> int:
        return len(self.known)


@dataclass(frozen=True)
class OfState:
    """A function of the state: a program whose names are parameters, units, t, pi and outputs."""

    text: str
    program: Program
    parameters: tuple[tuple[str, Quantity], ...] = ()
    known: tuple[str, ...] = ()  #: names of all parameters, for messages
    dimension: Dimension | None = None  #: that it has to have, None for any
    strict: bool = False  #: whether dimensions have to fit; else plain numbers stand for quantities in SI units

    @property
    def calls(self) -> tuple[str, ...]:
        """Tables that it calls with an argument of its own, `pull()`, each once."""
        return tuple(dict.fromkeys(step for step in self.program if expressions.is_call(step)))

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names that it reads of a scene, each once."""
        known = {name for name, _ in self.parameters} | {"t", "pi", *self.calls}
        names = (
            step for step in self.program if isinstance(step, str) and step not in expressions.ARITY
        )
        return tuple(
            dict.fromkeys(
                name for name in names if name not in known and not expressions.is_quantity(name)
            )
        )

    @property
    def clocked(self) -> bool:
        """Whether it reads t."""
        return "t" in self.program


def of_state(
    value: str | float,
    unit: str = "",
    parameters: Mapping[str, Quantity | float] | None = None,
    strict: bool = False,
) -> OfState:
    """The function of the state written as a text, with parameters by name.

    Its dimensions are checked where a unit is given, or it is to be `strict`, and parameters are
    quantities: plain numbers may have any unit.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise Problem(
            "an expression of outputs, t and parameters", shown(value), expressions.GRAMMAR
        )
    known = parameters or {}
    text = value if isinstance(value, str) else repr(float(value))
    program = expressions.parse(text, Names(known))
    given = {
        name: known[name]
        for name in dict.fromkeys(program)
        if isinstance(name, str) and name in known
    }
    fixed = {
        name: float(one.value if isinstance(one, Quantity) else one) for name, one in given.items()
    }
    fixed |= {"pi": math.pi} | {
        step: one.value for step, one in expressions.quantities(program).items()
    }
    expressions.require_defined(program, fixed, text)
    strict = (strict or bool(unit)) and all(isinstance(one, Quantity) for one in given.values())
    values = tuple(
        (name, one if isinstance(one, Quantity) else Quantity(float(one), NUMBER.exponents))
        for name, one in given.items()
    )
    return OfState(
        text,
        program,
        values,
        tuple(known),
        units.find_dimension(unit) if strict and unit else None,
        strict,
    )


def require(
    found: OfState,
    variables: Mapping[str, str],
    tables: Mapping[str, tuple[str, str]] | None = None,
) -> None:
    """Raises a Problem for a name that is none of the variables, which have units, and for a
    dimension that does not fit.

    Tables have the units of their argument and of their values.
    """
    tables = tables or {}
    for call in found.calls:
        if call not in tables:
            there = [
                *(one.removesuffix("()") for one in tables),
                *sorted(expressions.FUNCTIONS),
                expressions.TABLE,
            ]
            name = call.removesuffix("()")
            expected = f"one of the functions and tables {listed(there, name)}"
            raise Problem(expected, shown(name), closest(name, there).removeprefix("; "))
    for number in expressions.quantities(found.program):
        for name in re.findall(r"[*/] *([A-Za-z]\w*)", number):
            if name in variables:
                raise expressions.Ambiguous(name, number, "a name of the scene")
    for name in found.outputs:
        if name not in variables:
            known = [*variables, *found.known, "t", "pi"]
            near = closest(name, known).removeprefix("; ")
            raise Problem(f"one of {listed(known, name)}", shown(name), near)
    if not found.strict:
        return
    names: dict[str, Any] = {name: functions.variable(unit) for name, unit in variables.items()}
    names |= {call: functions.table(call, *tables[call]) for call in found.calls}
    names |= {name: functions.constant(value) for name, value in found.parameters}
    names |= {step: Operand(one) for step, one in expressions.quantities(found.program).items()}
    functions.check_program(found.program, found.text, found.dimension, names, of="the state")
