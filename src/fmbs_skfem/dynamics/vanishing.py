"""Rows of joints that events release, in a trained space: those that hold in all motions which it
knows are noise there.

Such rows carry no multiplier, and their reactions are not known.
"""

from __future__ import annotations

import numpy as np

from ..systems import compiled as compilation
from ..systems.compiled import Compiled, compile_system
from ..systems.connections.redundancy import scale_of
from ..systems.system import System, loose_rows
from .compiled_step.impulses import VANISHING
from .trajectory import Trajectory


def lengths(model: Compiled, x: np.ndarray, time: float) -> np.ndarray:
    """Lengths of constraint rows (m,) over changes of unknowns (n,) that count as large.

        |Phi_x D|

    of every row at x (n,) and a time [s], with D the changes of unknowns that count as large: in
    the unit of the row.
    """
    return np.asarray(
        np.linalg.norm(compilation.gap(model, x, time)[1] * scale_of(model.system), axis=1)
    )


def empty(model: Compiled, size: np.ndarray) -> np.ndarray:
    """Rows (m,) bool whose lengths (m,) are noise; they may all be. In a space that is not trained
    there are none.

    Lengths of rows in metres and of those of angles are compared with each other there: one may be
    small by its unit alone.
    """
    if not model.system.components:
        return np.zeros(len(size), dtype=bool)
    return np.asarray(size < VANISHING * max(float(size.max(initial=0.0)), model.system.scale))


def unknown(trajectory: Trajectory) -> np.ndarray:
    """Loose rows (m,) bool that are noise at the start; those of locks, whose numbers are zero
    before, at the end of the run.

    Their reactions are not known. None in a space that is not trained.
    """
    system = trajectory.system
    rows = loose_rows(system.constraints)
    if not system.components or not rows.any():
        return np.zeros(len(rows), dtype=bool)
    model = compile_system(system)
    own = rows_of_locks(system)
    found = rows & ~own & empty(model, lengths(model, system.x0, 0.0))
    happened = {name for one in trajectory.events for name in one.lock}
    locked = own & [joint in happened for joint, _ in system.constraints.names]
    if locked.any():
        found |= locked & empty(
            model, lengths(model, trajectory.x[-1], float(trajectory.times[-1]))
        )
    return np.asarray(found)


def rows_of_locks(system: System) -> np.ndarray:
    """Rows of locks (m,) bool, which are open at the start.

    In the order of the constraint rows of the system; a lock is what an event closes.
    """
    held = {name for one in system.locks for name in one.rows.names}
    return np.array([name in held for name in system.constraints.names], dtype=bool)
