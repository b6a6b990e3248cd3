"""Constraint rows that do not hold where a motion starts: of locks, and of loose joints where others
hold already.
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
    """Rows (m,) bool that do not hold where a motion starts, at x (n,): of locks, and loose ones that
    follow from others, or hold in the whole space of a reduced model.

    A row follows where it is a combination of the other closed rows, to the tolerance CLOSED of
    `ranks`; behind the start `compiled_step.impulses` finds them.
    """
    closed = ~rows_of_locks(model.system)
    loose = loose_rows(model.system.constraints)
    if not (loose & closed).any():
        return ~closed
    J = compilation.gap(model, x, 0.0)[1] * scale_of(model.system)
    noise = empty(model, lengths(model, x, 0.0))
    rows = np.flatnonzero(closed & ~(loose & noise))
    found = ~closed | (loose & noise)
    follows = rows[ranks.part(J[rows], ranks.CLOSED, ~loose[rows])[1]]
    found[follows] |= loose[follows]
    return np.asarray(found)
