"""Forces of fixed direction: g_row += coefficient s(t), whatever the state is.

They have no derivatives and no memory; point forces, and loads on surfaces and edges of the reference, are such forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..core.container import storable
from ..core.records import dataclass
from ..core.structs import Integers, Vector, opener, routine
from ..core.validation import Indices, Reals
from . import forces
from .evaluation import evaluation
from .forces import Force, Place, Routines
from .kernels import factor


@storable
@dataclass(frozen=True)
class DeadLoads:
    """Forces of t probe rows."""

    row: Annotated[np.ndarray, Indices("t", end="y")]
    coefficient: Annotated[np.ndarray, Reals("t")]  #: [N per unit of the row]
    signal: Annotated[np.ndarray, Indices("t", end="k", low=-1)]  #: history, -1 for the constant 1

    def __len__(self) -> int:
        return len(self.row)


class Record(NamedTuple):
    """Dead loads for compiled code."""

    row: Integers
    coefficient: Vector
    signal: Integers


opened = opener(Record)


@routine
def push(table: Any, record: Any) -> int:
    """g += coefficient s(t)."""
    s, F = evaluation(table).space, opened(record)
    for k in range(len(F.row)):
        s.g[F.row[k]] += F.coefficient[k] * factor(s.signals, F.signal[k])
    return 0


@forces.compile_force.register
def _(loads: DeadLoads, place: Place) -> Force:
    return Force(Record(loads.row, np.ascontiguousarray(loads.coefficient), loads.signal), Routines(push))


@forces.histories.register
def _(loads: DeadLoads) -> Sequence[tuple[int, int]]:
    return [(int(signal), int(row)) for signal, row in zip(loads.signal, loads.row, strict=True) if signal >= 0]


@forces.grow.register
def _(loads: DeadLoads, signal: int) -> DeadLoads:
    return replace(loads, signal=np.where(loads.signal < 0, signal, loads.signal))


@forces.join.register
def _(loads: DeadLoads, others: Sequence[DeadLoads]) -> Sequence[DeadLoads]:
    every = (loads, *others)
    return [DeadLoads(*(np.concatenate([getattr(one, name) for one in every]) for name in ("row", "coefficient", "signal")))]
