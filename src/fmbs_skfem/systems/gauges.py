"""What springs, ropes and stops measure: their force, stretch and rate as an output.

    between places      s = |y| - l,    s' = y . y' / |y|,    N = - F . y / |y|        (a pull is positive)
    along a direction   s = y - l,      s' = y',              N = - F

F are the forces on the probe rows y of the load, which are its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ..core.errors import InputError, closest, listed, say
from .places import Draft
from .probes import Probe, Sensed, Sizes
from .system import Output

KINDS = ("distance", "along")
COLUMNS = ("force", "stretch", "rate")


@dataclass(frozen=True)
class LoadState(Probe, word="load"):
    """Force of a spring, rope or stop [N], a pull being positive, its stretch [m] and the rate of that [m/s]."""

    load: Annotated[str, "a name of a load"]
    known_to_all: ClassVar[bool] = True

    def sense(self, name: str, draft: Draft) -> Output:
        gauge = draft.gauges.get(self.load)
        if gauge is None:
            expected = f"one of the springs, ropes and stops {listed(draft.gauges, self.load, 'of which there are none')}"
            raise InputError(say(f"output '{name}'", expected, f"'{self.load}'") + closest(self.load, draft.gauges))
        rows, offset = draft.probes.rows_of(gauge.rows)
        first = draft.sensors.add(rows, offset - rows @ draft.layout.shift)  # sensors count from the origin of the scene
        numbers = (float(KINDS.index(gauge.kind)), gauge.free, *map(float, gauge.rows))
        columns = tuple(f"{name}_{part}" for part in COLUMNS)
        return Output(self.word, tuple(range(first, first + len(offset))), columns, parameters=numbers)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        kind, free, *rows = output.parameters
        force = sensed.pushes()[:, [int(row) for row in rows]]
        y, rate = sensed.values, sensed.rates
        if KINDS[int(kind)] == "along":
            return [-force[:, 0], y[:, 0] - free, rate[:, 0]]
        distance = np.linalg.norm(y, axis=1)
        along = y / np.maximum(distance, np.finfo(float).tiny)[:, None]
        return [-np.sum(force * along, axis=1), distance - free, np.sum(rate * along, axis=1)]

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return ("N", "m", "m/s")

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        count = (3, 1)[int(output.parameters[0])]
        return count, len(COLUMNS), 2 + count
