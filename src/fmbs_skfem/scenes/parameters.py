"""Parameters of a scene: values, and the ranges over which reduced models are trained and sweeps run.

    E: 70 GPa                                                       a value
    E: {value: 70 GPa, range: [40 GPa, 70 GPa], scale: linear}      a value and its range

Without a value it is the middle of the range on its scale, (low + high) / 2 or sqrt(low high). A parameter may use those before it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from ..core import expressions, units
from ..core.errors import closest, listed
from ..core.fields import Range
from ..core.problems import Found, Problem, shown
from ..core.units import Quantity

Changes: TypeAlias = Mapping[str, float | str]

KEYS = ("range", "scale", "value")
SCALES = ("linear", "log")

_QUANTITY = {"anyOf": [{"type": "number"}, {"type": "string"}], "description": "a quantity"}
SCHEMA: dict[str, Any] = {
    "anyOf": [
        *_QUANTITY["anyOf"],
        {
            "type": "object",
            "properties": {
                "value": _QUANTITY,
                "range": {"type": "array", "items": _QUANTITY, "minItems": 2, "maxItems": 2},
                "scale": {"enum": list(SCALES), "default": SCALES[0]},
            },
            "required": ["range"],
            "additionalProperties": False,
        },
    ],
    "description": "a quantity, or {value: ..., range: [low, high], scale: linear or log}",
}  #: JSON schema of a parameter


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
    """The parameters of a scene in file order, those that have a range, what is wrong with them, and which ones each is made of."""

    values: ParameterValues
    ranges: dict[str, Range]
    found: list[Found]
    parts: dict[str, frozenset[str]] = field(default_factory=dict)

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
        return Resolved(ParameterValues(), {}, [(("parameters",), Problem("a mapping of names and quantities", shown(raw)))])
    known = Resolved(ParameterValues(), {}, [])
    for name, entry in raw.items():
        key = ("parameters", name)
        try:
            _check_name(name)
            own, limits, wrong = (
                _read_range(key, entry, known.values) if isinstance(entry, dict) else _read_value(entry, known.values)
            )
            known.found.extend(wrong)
            if own is not None:
                known.values[name] = _change(own, changed[name], known.values) if name in changed else own
            if limits is not None:
                known.ranges[name] = limits
        except Problem as problem:
            known.found.append((key, problem))
        known.parts[name] = frozenset(known.values.read)
        known.values.read.clear()
    for name in changed:
        if name not in raw:
            got = f"{shown(name)}{closest(name, raw)}"
            known.found.append((("parameters",), Problem(f"one of the parameters {listed(raw, name)}", got)))
    return known


def _check_name(name: str) -> None:
    if not name.isascii() or not name.isidentifier() or name in expressions.RESERVED:
        taken = ", ".join(sorted(expressions.RESERVED))
        raise Problem(f"a name of letters, digits and _ that is not taken ({taken})", shown(name))


def _read_value(entry: Any, values: Mapping[str, Quantity]) -> tuple[Quantity, None, list[Found]]:
    return units.read(entry, values), None, []


def _read_range(
    key: tuple[str, str], entry: dict[str, Any], values: Mapping[str, Quantity]
) -> tuple[Quantity | None, Range | None, list[Found]]:
    """Value and range of a mapping, or what is wrong with it."""
    found: list[Found] = [
        ((*key, word), Problem(f"one of the keys {', '.join(KEYS)}", f"{shown(word)}{closest(word, KEYS)}"))
        for word in entry
        if word not in KEYS
    ]
    scale = entry.get("scale", SCALES[0])
    if scale not in SCALES:
        hint = closest(scale, SCALES) if isinstance(scale, str) else ""
        found.append(((*key, "scale"), Problem(f"one of {', '.join(SCALES)}", shown(scale) + hint)))
    ends = entry.get("range")
    if "range" not in entry:
        remedy = "write 'range: [low, high]', or the value alone for a parameter without range"
        found.append((key, Problem("the key 'range'", "no such key", remedy)))
    elif not isinstance(ends, list) or len(ends) != 2:
        found.append(((*key, "range"), Problem("a list of two quantities, the smaller first", shown(ends))))
    if found:
        return None, None, found
    return _read_limits(key, entry, values, scale == "log")


def _read_limits(
    key: tuple[str, str], entry: dict[str, Any], values: Mapping[str, Quantity], log: bool
) -> tuple[Quantity | None, Range | None, list[Found]]:
    """Value and range, all of one dimension."""
    low, high = entry["range"]
    texts: list[tuple[tuple[str | int, ...], Any]] = [((*key, "range", 0), low), ((*key, "range", 1), high)]
    texts += [((*key, "value"), entry["value"])] if "value" in entry else []
    found: list[Found] = []
    read: list[Quantity] = []
    for place, text in texts:
        try:
            read.append(_alike(units.read(text, values), read, text))
        except Problem as problem:
            found.append((place, problem))
    if found:
        return None, None, found
    exponents = next((quantity.exponents for quantity in read if quantity.exponents != units.NUMBER.exponents), read[0].exponents)
    try:
        _same_form(read[0], read[1], f"[{low}, {high}]")
        limits = _range(read[0].value, read[1].value, log, units.unit(exponents), f"[{low}, {high}]")
    except Problem as problem:
        return None, None, [((*key, "range"), problem)]
    value = read[2].value if len(read) > 2 else middle(limits)
    return Quantity(value, exponents, max(quantity.cycles for quantity in read)), limits, []


def _alike(quantity: Quantity, others: list[Quantity], text: Any) -> Quantity:
    """A quantity of the dimension of those before it, where both have one."""
    known = next((other.exponents for other in others if other.exponents != units.NUMBER.exponents), units.NUMBER.exponents)
    if units.NUMBER.exponents not in (known, quantity.exponents) and known != quantity.exponents:
        got = f"{shown(text)} ({units.describe(quantity.exponents)})"
        raise Problem(f"value and range of one dimension ({units.describe(known)})", got)
    return quantity


def _same_form(low: Quantity, high: Quantity, text: str) -> None:
    """Both ends with a unit, or both plain: [40, 70 GPa] would begin at 40 Pa. Zero needs no unit."""
    if low.exponents != high.exponents and low.value and high.value:
        raise Problem("both ends of a range with a unit, or both without", text, "write the unit at both")


def _range(low: float, high: float, log: bool, unit: str, text: str) -> Range:
    if not low < high:
        raise Problem("a range whose first value is smaller than its second", text)
    if log and low <= 0.0:
        raise Problem("a range above zero for the scale log", text, "write 'scale: linear', or a larger first value")
    return Range(low, high, log, unit)


def middle(limits: Range) -> float:
    """The middle of a range on its scale."""
    return math.sqrt(limits.low) * math.sqrt(limits.high) if limits.log else 0.5 * limits.low + 0.5 * limits.high


def _change(own: Quantity, text: float | str, values: Mapping[str, Quantity]) -> Quantity:
    """A new value of a parameter; a plain number has the dimension of the old one."""
    new = units.read(text, values)
    if new.exponents == units.NUMBER.exponents:
        return replace(own, value=new.value)
    if units.NUMBER.exponents != own.exponents != new.exponents:
        raise Problem(f"a value of the dimension of the parameter ({units.describe(own.exponents)})", shown(text))
    return new
