"""Parameters of a scene: values, and the ranges over which reduced models are trained and sweeps
run.

    E: 70 GPa                                                       a value
    E: {value: 70 GPa, range: [40 GPa, 70 GPa], scale: linear}      a value and its range

Without a value it is the middle of the range on its scale, (low + high) / 2 or sqrt(low high). A
parameter may use those before it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import partial
from typing import Annotated, Any, NamedTuple, TypeAlias

from ..core.errors import InputError, closest, listed
from ..core.storage.records import dataclass
from ..core.values import expressions, quantities, units
from ..core.values.fields import Context, Schema, Takes, array_schema, word
from ..core.values.mappings import inline
from ..core.values.problems import Found, Problem, Problems, located, read_all, shown
from ..core.values.ranges import Parameter, Scale
from ..core.values.units import Quantity

Changes: TypeAlias = Mapping[str, float | str]
_QUANTITY: Schema = {"anyOf": [{"type": "number"}, {"type": "string"}], "description": "a quantity"}


class Written(NamedTuple):
    """A quantity and how it is written."""

    quantity: Quantity
    text: object


def read_quantity(value: object, context: Context) -> Written:
    return Written(quantities.read(value, context.parameters), value)


def read_ends(value: object, context: Context) -> list[Written]:
    """The ends of a range."""
    if not isinstance(value, list) or len(value) != 2:
        raise Problem("a list of two quantities, the smaller first", shown(value))
    return read_all((k, partial(read_quantity, one, context)) for k, one in enumerate(value))


@dataclass(frozen=True)
class Ranged:
    """A range with its scale, and the value."""

    range: Annotated[
        list[Written],
        Takes(read_ends, array_schema(_QUANTITY, 2, 2)),
        "its ends, or write the value alone",
    ]
    scale: Annotated[str, word([one.value for one in Scale])] = Scale.LINEAR.value
    value: Annotated[Written, Takes(read_quantity, _QUANTITY)] | None = None


RANGED = inline(Ranged)
#: JSON schema of a parameter
SCHEMA: Schema = {
    "anyOf": [*_QUANTITY["anyOf"], RANGED.schema],
    "description": "a quantity, or {value: ..., range: [low, high], scale: linear or log}",
}


class ParameterValues(dict[str, Quantity]):
    """Parameters by name, which remember those that were read."""

    def __init__(self) -> None:
        super().__init__()
        self.read: set[str] = set()

    def __getitem__(self, name: str) -> Quantity:
        self.read.add(name)
        return super().__getitem__(name)


@dataclass(frozen=True)
class Resolved:
    """The parameters of a scene in file order, those that have a range, what is wrong with them,
    and which ones each is made of.
    """

    values: ParameterValues
    ranges: dict[str, Parameter]
    found: list[Found]
    parts: dict[str, frozenset[str]] = field(default_factory=dict)

    def si_units(self) -> dict[str, str]:
        """The SI units of the parameters."""
        return {name: units.unit(one.exponents) for name, one in self.values.items()}

    def used(self) -> frozenset[str]:
        """Parameters that were read, and those that they are made of."""
        used = set(self.values.read)
        for name in reversed(self.parts):
            used |= self.parts[name] if name in used else frozenset()
        return frozenset(used)


def resolve(raw: Any, changed: Changes) -> Resolved:
    """The section `parameters`; `changed` replaces values."""
    raw = {} if raw is None else raw
    if not isinstance(raw, dict):
        return Resolved(
            ParameterValues(),
            {},
            [(("parameters",), Problem("a mapping of names and quantities", shown(raw)))],
        )
    known = Resolved(ParameterValues(), {}, [])
    for name, entry in raw.items():
        key = ("parameters", name)
        try:
            check_name(name)
            own, limits = (
                read_range(name, entry, known.values)
                if isinstance(entry, dict)
                else (quantities.read(entry, known.values), None)
            )
            known.values[name] = (
                _change(own, changed[name], known.values) if name in changed else own
            )
            if limits is not None:
                known.ranges[name] = limits
        except InputError as error:
            known.found.extend(((*key, *keys), problem) for keys, problem in located(error))
        known.parts[name] = frozenset(known.values.read)
        known.values.read.clear()
    for name in changed:
        if name not in raw:
            got = f"{shown(name)}{closest(name, raw)}"
            known.found.append(
                (("parameters",), Problem(f"one of the parameters {listed(raw, name)}", got))
            )
    return known


def check_name(name: str) -> None:
    """A name of a parameter."""
    if not name.isascii() or not name.isidentifier() or name in expressions.RESERVED:
        taken = ", ".join(sorted(expressions.RESERVED))
        raise Problem(f"a name of letters, digits and _ that is not taken ({taken})", shown(name))


def read_range(
    name: str, entry: dict[str, Any], values: Mapping[str, Quantity]
) -> tuple[Quantity, Parameter]:
    """Value and range, all of one dimension."""
    given: Ranged = RANGED.read(entry, Context(parameters=values))
    written = [*given.range, *([given.value] if given.value else [])]
    exponents = next(
        (one.quantity.exponents for one in written if has_unit(one)), units.NUMBER.exponents
    )
    for place, one in zip((("range", 0), ("range", 1), ("value",)), written, strict=False):
        if has_unit(one) and one.quantity.exponents != exponents:
            got = f"{shown(one.text)} ({units.describe(one.quantity.exponents)})"
            raise Problems(
                [
                    (
                        place,
                        Problem(
                            f"value and range of one dimension ({units.describe(exponents)})", got
                        ),
                    )
                ]
            )
    low, high = given.range
    if problem := wrong_ends(low, high, given.scale == Scale.LOG.value):
        raise Problems([(("range",), problem)])
    limits = Parameter(
        name, low.quantity.value, high.quantity.value, Scale(given.scale), units.unit(exponents)
    )
    value = given.value.quantity.value if given.value else limits.nominal
    return Quantity(value, exponents, max(one.quantity.cycles for one in written)), limits


def has_unit(one: Written) -> bool:
    return one.quantity.exponents != units.NUMBER.exponents


def wrong_ends(first: Written, last: Written, log: bool) -> Problem | None:
    """What is wrong with two ends; [40, 70 GPa] would begin at 40 Pa, where zero needs no unit."""
    low = first.quantity.value
    high = last.quantity.value
    text = f"[{first.text}, {last.text}]"
    if has_unit(first) != has_unit(last) and low and high:
        return Problem(
            "both ends of a range with a unit, or both without", text, "write the unit at both"
        )
    if not low < high:
        return Problem("a range whose first value is smaller than its second", text)
    if log and low <= 0.0:
        return Problem(
            "a range above zero for the scale log",
            text,
            "write 'scale: linear', or a larger first value",
        )
    if not math.isfinite(high / low if log else high - low):
        return Problem("a range whose width is a finite number", text)
    return None


def _change(own: Quantity, text: float | str, values: Mapping[str, Quantity]) -> Quantity:
    """A new value of a parameter; a plain number has the dimension of the old one."""
    new = quantities.read(text, values)
    if new.exponents == units.NUMBER.exponents:
        return replace(own, value=new.value)
    if units.NUMBER.exponents != own.exponents != new.exponents:
        raise Problem(
            f"a value of the dimension of the parameter ({units.describe(own.exponents)})",
            shown(text),
        )
    return new
