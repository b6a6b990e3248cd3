"""What a run gives: the motion at stored times, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..systems.system import System


@dataclass(frozen=True)
class Statistics:
    """What a run cost."""

    steps: int
    iterations: int
    factorisations: int
    halved: int
    cpu_s: float
    wall_s: float
    solver: str = ""  #: of the linear systems


@dataclass(frozen=True)
class Trajectory:
    """Motion of a system at stored times."""

    system: System
    times: np.ndarray  #: (s,) [s]
    x: np.ndarray  #: (s, n)
    v: np.ndarray  #: (s, n)
    a: np.ndarray  #: (s, n), accelerations q''
    multipliers: np.ndarray  #: (s, m), physical
    statistics: Statistics
