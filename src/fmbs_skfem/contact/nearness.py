"""Who can have come near since contacts with forces of low rank were looked at last, and the rows
that they read.

The room of such a contact holds a clearance of each of its nodes or points, and behind these four
bounds of ways: of both sides, a unit of |dx| and of max |dx_n|. What has come nearer by less than
its clearance is not looked at.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from ..systems import kernels
from ..systems.evaluation import evaluation

WAYS = 4  #: bounds of ways in the room of a contact


@jit
def ahead(s: Any, ways: int) -> float:
    """By how much both sides may have come nearer since the room was filled.

        min(w_0 |dx|, w_1 max |dx_n|) + min(w_2 |dx|, w_3 max |dx_n|)

    with the bounds w that begin at `ways`.
    """
    return min(s.room[ways] * s.moved[0], s.room[ways + 1] * s.moved[1]) + min(
        s.room[ways + 2] * s.moved[0], s.room[ways + 3] * s.moved[1]
    )


@jit
def is_active(s: Any, first: int, count: int, way: float) -> bool:
    """Whether one of so many, whose clearances begin at `first`, may have come near by a way."""
    found = False
    # not >: in the first step the way is not a number
    for k in range(count):
        found = found or not s.room[first + k] > way
    return found


@jit
def read(table: Any, rows: np.ndarray, y: np.ndarray) -> None:
    """y (f,) = the values of probe rows (f,)."""
    E = evaluation(table)
    for j in range(len(y)):
        y[j] = E.arrays.probes_offset[rows[j]] + kernels.row_value(
            E.arrays.probes, rows[j], E.space.x
        )
