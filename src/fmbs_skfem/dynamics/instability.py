r"""Whether an equilibrium stands: K v = -s^2 M v on the null space of Phi_x has no real s > 0 where it is a minimum of the energy.

A structure that is loaded beyond its buckling load without imperfections keeps its straight state, as does a pendulum that stands
on its head: Newton's iteration finds such states as it finds others.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import ArpackError

from ..core.errors import InputError
from .linear import is_symmetric, linearise
from .modes import STILL, fastest, real_modes
from .trajectory import Trajectory

FEW = 6  #: modes next to zero, of which one would have passed it
LARGE = 6000  #: unknowns beyond which nothing is said: factors of their stiffness cost as much as a load step
WIDE = 1_000_000  #: numbers of the rows of constraints beyond which nothing is said, either: they are dense


def growth(path: Trajectory) -> float:
    """Largest s [1/s] of the last state of a load path (`solve_statics`), 0 where it is stable.

    Nothing is said of forces without a potential, such as follower forces and friction, and of more than `LARGE` unknowns.
    """
    if path.system.size > LARGE or path.system.size * path.multipliers.shape[1] > WIDE:
        return 0.0
    kept = None if path.memory is None else path.memory[-1]
    linear = linearise(path.system, path.x[-1], path.multipliers[-1], float(path.times[-1]), kept)
    if len(linear.x) <= len(linear.rows) or not is_symmetric(linear):
        return 0.0
    try:
        least = float(real_modes(linear, FEW).squares.min())
    except (InputError, np.linalg.LinAlgError, ArpackError):  # no modes, as without a mass: the equilibrium is one all the same
        return 0.0
    return float(np.sqrt(-least)) if least < -((STILL * fastest(linear)) ** 2) else 0.0
