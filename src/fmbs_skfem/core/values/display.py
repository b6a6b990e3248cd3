"""Units in which people read numbers: those that they typed, else SI units with prefixes; files and
Python keep SI units.

    number that is read = value [SI] / size of its unit,        tip_x [m] 0.0123   ->   tip_x [mm] 12.3

One rule for tables, plots and pages: of the units that a scene types for the dimension of a number,
the first one in which the largest number beside it is between 1 and 1000, else between 0.1 and 10
000, which is read without a power of ten. Where there is none, the prefix that puts the largest
number between 1 and 1000; where the unit has no prefixes (angles), or the scene types none of SI
(psi, inches, rpm), the first that was typed. Units that are asked for stand before all of these,
whatever the number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from ..storage.records import dataclass
from . import expressions
from .problems import Problem
from .responses import Names
from .units import measure, unit_of_text
from .units import unit as si_unit

#: a typed unit is taken where the largest number is in between, the first one first
WINDOWS = (
    (1.0, 1000.0),
    (0.1, 10_000.0),
)
#: units that have prefixes, with the largest power of ten: nobody reads kiloseconds
LARGEST = {"m": 3, "s": 0, "N": 9, "Pa": 9, "J": 9, "W": 9, "Hz": 9}
LEAST = -9  #: the least power of ten; what is smaller is round-off, and stays in the unit itself
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
KEY = "display_units"  #: in reports and notes
ALIKE = ("J", "Hz")  #: units whose dimension has another name: N m is a moment, 1/s a rate
_HEAD = re.compile(r"(.*) \[([^\[\]]+)\](.*)", re.DOTALL)  #: `NAME [UNIT]`, and what is said behind
#: the part of a unit that takes a prefix; that of m^2 is squared
_FIRST = re.compile(rf"({'|'.join(LARGEST)})(?![\w^])(.*)", re.ASCII)


@dataclass(frozen=True)
class DisplayUnits:
    """Units that were asked for, which go first, and those that a scene types, in its order."""

    asked: tuple[str, ...] = ()
    typed: tuple[str, ...] = ()

    def find(self, unit: str, largest: float, prefixes: bool = True) -> tuple[str, float]:
        """The unit in which numbers of an SI unit are read, and its size; `largest` is the largest
        of them. Others stay.
        """
        base, scale = describe(unit)
        if not base or scale != 1.0:
            return unit, 1.0
        for one in self.asked:
            if describe(one)[0] == base:
                return one, describe(one)[1]
        own = [(one, size) for one in self.typed for kind, size in [describe(one)] if kind == base]
        known = 0.0 < largest < math.inf
        fitting = [
            (one, size)
            for low, high in WINDOWS
            for one, size in own
            if low <= largest / size < high
        ]
        if fitting or (own and not (known and is_metric(own[0][1]))):
            return (fitting or own)[0]
        return with_prefix(unit, largest) if known and prefixes else (unit, 1.0)

    def head(
        self, text: str, values: Iterable[Any] | npt.NDArray[np.float64], prefixes: bool = True
    ) -> tuple[str, float]:
        """The head `NAME [UNIT]` of numbers in SI units as they are read, and the size of the unit
        that it has then.
        """
        match = _HEAD.fullmatch(text)
        if match is None:
            return text, 1.0
        unit, size = self.find(match[2], largest_of(values), prefixes)
        return f"{match[1]} [{unit}]{match[3]}", size

    def row(self, text: str, values: Sequence[float]) -> tuple[str, list[float]]:
        """A head and the numbers behind it, as they are read."""
        head, size = self.head(text, values)
        return head, [value / size for value in values]

    def text(self, name: str, value: float, unit: str) -> str:
        """A value in words: `E = 70 GPa`."""
        return f"{name} = {self.quantity(value, unit)}"

    def quantity(self, value: float, unit: str) -> str:
        """A value with its unit: `70 GPa`."""
        read, size = self.find(unit, abs(value))
        return f"{value / size:.6g} {read}".rstrip()

    def columns(
        self, heads: Sequence[str], rows: Sequence[Sequence[Any]]
    ) -> tuple[list[str], list[list[Any]]]:
        """A table whose columns of numbers are read in the units that were typed; what is no number
        stays.

        Without prefixes, as a column has numbers of several orders.
        """
        found = []
        for head, *cells in zip(heads, *rows, strict=True):
            numbers = [one for one in cells if is_number(one)]
            whole = len(numbers) == sum(one is not None and one != "" for one in cells)
            text, size = (
                self.head(head, numbers, prefixes=False) if whole and numbers else (head, 1.0)
            )
            found.append(
                [text, *(one / size if is_number(one) and size != 1.0 else one for one in cells)]
            )
        heads, *shown = map(list, zip(*found, strict=True)) if found else [[]]
        return list(heads), shown

    @property
    def note(self) -> dict[str, Any]:
        """They as an entry of a report, or of the notes of a saved model."""
        return {KEY: {"asked": self.asked, "typed": self.typed}}

    @classmethod
    def of(cls, holder: Mapping[str, Any]) -> DisplayUnits:
        """Those that a report or the notes of a saved model hold; none of earlier ones."""
        stored = holder.get(KEY)
        found = stored if isinstance(stored, Mapping) else {}
        return cls(
            *(
                tuple(map(str, one)) if isinstance(one, list | tuple) else ()
                for one in map(found.get, ("asked", "typed"))
            )
        )


SI = DisplayUnits()  #: with prefixes


def typed_in(value: Any) -> Iterator[str]:
    """The units of all quantities in the texts of a scene, in its order."""
    if isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from typed_in(one)
    elif isinstance(value, str):
        for text in quantities_in(value):
            if unit := unit_of_text(text):
                yield unit


def quantities_in(text: str) -> list[str]:
    """The quantities of a text that is one, or an expression of some:
    `300 rpm * (1 - exp(-t / 2 ms))` has two.
    """
    try:
        measure(text)
        return [text]
    except Problem:
        try:
            return [
                step for step in expressions.parse(text, Names(())) if expressions.is_quantity(step)
            ]
        except Problem:
            return []


@cache
def describe(unit: str) -> tuple[str, float]:
    """The SI unit of what is measured in a unit, and the size of that in SI; no unit where it is
    none, or of numbers.
    """
    try:
        found = measure(f"1 {unit}")
    except Problem:
        return "", 1.0
    special = next(
        (
            one
            for one in ALIKE
            if unit.endswith(one) and unit.removesuffix(one) in {*PREFIXES.values(), "u", "μ"}
        ),
        None,
    )
    return special or si_unit(found.exponents), found.value


def is_metric(size: float) -> bool:
    """Whether a unit differs from an SI unit by a prefix: by a power of 1000."""
    return any(math.isclose(size, 10.0**power, rel_tol=1e-12) for power in range(-12, 13, 3))


def with_prefix(unit: str, largest: float) -> tuple[str, float]:
    """An SI unit with the prefix that puts the largest number between 1 and 1000, and its size; as
    it is where it takes none.
    """
    match = _FIRST.fullmatch(unit)
    if match is None:
        return unit, 1.0
    power = min(int(f"{largest:.9e}".partition("e")[2]) // 3 * 3, LARGEST[match[1]])
    power = power if power >= LEAST else 0
    return PREFIXES[power] + unit, 10.0**power


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def largest_of(values: Iterable[Any] | npt.NDArray[np.float64]) -> float:
    """The largest of the sizes of numbers that are finite, 0 for none."""
    found = np.abs(
        np.asarray(values if isinstance(values, np.ndarray) else list(values), dtype=float)
    )
    return float(found[np.isfinite(found)].max(initial=0.0))
