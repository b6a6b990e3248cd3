"""The accuracy of an analysis: which errors of its outputs the user can live with.

accuracy: 1e-3                        a part of the range of every output; 0.1 % is the same
accuracy: 1 mm                        of every output in this unit
accuracy: {C: 1 mm, motor: 2 %}       of these outputs
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any

from ..core.storage.records import dataclass
from ..core.values import quantities, units
from ..core.values.fields import Context, Takes
from ..core.values.problems import Found, Keys, Problem, shown, unknown
from ..dynamics.output_errors import OutputError
from ..systems.measures.probes import Probe

ALL = ""  #: the name of all outputs


@dataclass(frozen=True)
class Bound:
    """A largest error: in SI units, with its unit; without one as a part of the range of its
    output.
    """

    value: float
    unit: str = ""
    text: str = field(default="", repr=False, compare=False)  #: as it was typed, with its unit

    def __str__(self) -> str:
        return (
            (self.text or f"{self.value:g} {self.unit}")
            if self.unit
            else f"{self.value:g} of the range"
        )

    def holds(self, unit: str) -> bool:
        """Whether it bounds what has a unit."""
        return not self.unit or self.unit == unit_of(unit)

    def part(self, error: OutputError) -> float:
        """An error over the bound; 0 for one that has no range to be a part of."""
        found = error.error if self.unit else error.relative
        return found / self.value if found == found else 0.0


@dataclass(frozen=True)
class Accuracy:
    """Largest errors of outputs by name, `ALL` for those that are not named."""

    bounds: Mapping[str, Bound]

    def __str__(self) -> str:
        return ", ".join(
            f"{name}: {bound}" if name else str(bound) for name, bound in self.bounds.items()
        )

    def parts(self, errors: Mapping[str, OutputError]) -> dict[str, float]:
        """Errors of columns over what is wanted of them, of those of which anything is."""
        return {
            column: bound.part(one)
            for column, one in errors.items()
            if (bound := self.bound(one)) is not None
        }

    def bound(self, error: OutputError) -> Bound | None:
        """What is wanted of a column, None where nothing is."""
        found = self.bounds.get(error.output) or self.bounds.get(ALL)
        return found if found is not None and found.holds(error.unit) else None


def of_outputs(wanted: Accuracy, outputs: Mapping[str, Probe], keys: Keys) -> Iterator[Found]:
    """Bounds are of outputs that there are, in their units as far as these are known before the
    system is made.
    """
    if not outputs:
        yield (
            keys,
            Problem("outputs, whose errors are bounded", "a scene without any", "add outputs"),
        )
    for name, one in wanted.bounds.items():
        if name not in (ALL, *outputs):
            yield (*keys, name), unknown("output", "outputs", name, outputs)
        elif name and outputs[name].unit and not one.holds(outputs[name].unit):
            got = f"output '{name}' is of the type {outputs[name].word}"
            yield (
                (*keys, name),
                Problem(
                    f"an error in {outputs[name].unit}, or a part of the range",
                    f"one in {one.unit}",
                    got,
                ),
            )


def unit_of(unit: str) -> str:
    """The name of a unit that all its spellings share."""
    return units.unit(units.find_dimension(unit).exponents) if unit else ""


def bound(value: object, context: Context) -> Bound:
    """A quantity, or a part of a range."""
    number = value.strip().removesuffix("%") if isinstance(value, str) else value
    found = quantities.read(number, context.parameters)
    percent = isinstance(value, str) and value.strip().endswith("%")
    typed = value.strip() if isinstance(value, str) and units.unit_of_text(value) else ""
    wanted = Bound(
        found.value / 100.0 if percent else found.value, units.unit(found.exponents), typed
    )
    if not wanted.value > 0.0:
        raise Problem("an error above 0", shown(value))
    if not wanted.unit and wanted.value >= 1.0:
        remedy = "1e-3 for instance, or a quantity with its unit, such as 1 mm"
        raise Problem(
            "a part of the range below 1, or an error with its unit", shown(value), remedy
        )
    return wanted


def accuracy(value: object, context: Context) -> Accuracy:
    """One for all outputs, or one by output."""
    if isinstance(value, Accuracy):
        return value
    if not isinstance(value, dict):
        return Accuracy({ALL: bound(value, context)})
    if not value:
        raise Problem("errors of outputs by name", "none", "write {C: 0.1 mm} for instance")
    return Accuracy({str(name): bound(entry, context) for name, entry in value.items()})


_BOUND: dict[str, Any] = {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"type": "string"}]}
_SCHEMA = {
    "anyOf": [
        *_BOUND["anyOf"],
        {"type": "object", "additionalProperties": _BOUND, "minProperties": 1},
    ],
    "description": "an error of outputs as a part of their ranges, as a quantity, or by output",
}
Wanted = Annotated[Accuracy, Takes(accuracy, _SCHEMA)]
