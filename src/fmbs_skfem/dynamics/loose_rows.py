"""Constraint rows that do not hold where a motion starts, or goes on: of locks, and of loose joints
where others hold already.
"""

from __future__ import annotations

import numpy as np

from ..core.algebra import ranks
from ..systems import compiled as compilation
from ..systems.compiled import Compiled
from ..systems.connections.redundancy import scale_of
from ..systems.system import loose_rows
from .vanishing import empty, lengths, rows_of_locks


def open_at_start(model: Compiled, x: np.ndarray) -> np.ndarray:
    """Rows (m,) bool that do not hold where a motion starts, at x (n,): of locks, and of loose
    joints where others hold.
    """
    closed = ~rows_of_locks(model.system)
    return np.asarray(~closed | follows(model, x, 0.0, closed))


def follows(model: Compiled, x: np.ndarray, time: float, closed: np.ndarray) -> np.ndarray:
    """Loose rows (m,) bool among the closed ones that follow from others, or hold in the whole
    space of a reduced model.

    A row follows at x (n,) and a time [s] where it is a combination of the other closed rows, to
    the tolerance CLOSED of `ranks`.
    """
    loose = loose_rows(model.system.constraints)
    found = np.zeros(len(loose), dtype=bool)
    if not (loose & closed).any():
        return found
    J = compilation.gap(model, x, time)[1] * scale_of(model.system)
    size = lengths(model, x, time)
    noise = empty(model, size)
    rows = np.flatnonzero(closed & ~(loose & noise))
    rest = rows[ranks.part(J[rows], ranks.CLOSED, ~loose[rows])[1]]
    found[rest] = True
    return np.asarray(loose & closed & (found | noise))
