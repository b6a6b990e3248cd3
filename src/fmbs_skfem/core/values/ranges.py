"""Parameters: numbers with a range, over which reduced models are trained and sweeps run."""

from __future__ import annotations

import math
from enum import Enum

from ..errors import InputError, say
from ..storage.container import storable
from ..storage.records import dataclass
from .arguments import checked


@storable
class Scale(Enum):
    """How a range is divided."""

    LINEAR = "linear"
    LOG = "log"


@storable
@dataclass(frozen=True)
@checked
class Parameter:
    """A number of a case with its range in SI units."""

    name: str
    low: float
    high: float
    scale: Scale = Scale.LINEAR
    unit: str = ""  #: for the headers of tables, "Pa"
    value: float | None = None  #: nominal; None for the middle of the range on its scale

    def __post_init__(self) -> None:
        where = f"parameter '{self.name}'"
        ends = f"{self.low:g} to {self.high:g}"
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise InputError(say(where, "a finite range, its lower end first", ends))
        if self.scale is Scale.LOG and self.low <= 0.0:
            raise InputError(
                say(where, "a positive range on a logarithmic scale", ends, "take a linear scale")
            )
        if self.value is not None and not self.low <= self.value <= self.high:
            raise InputError(say(where, f"a nominal value from {ends}", f"{self.value:g}"))

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g} {self.unit}".strip()

    @property
    def nominal(self) -> float:
        """The value where no other is given, the middle of the range.

            (low + high) / 2    or    sqrt(low high)

        the latter on a logarithmic scale.
        """
        if self.value is not None:
            return float(self.value)
        return (
            math.sqrt(self.low) * math.sqrt(self.high)
            if self.scale is Scale.LOG
            else 0.5 * self.low + 0.5 * self.high
        )
