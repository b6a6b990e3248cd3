r"""Beams with directors whose axes turn so far within a cell that splines do not follow them.

    turn of a cell = int |kappa| dS,    kappa the torsion and curvatures of the state

A slender shaft that is twisted by 45 degrees a cell turns by 0.4 % too little, at 51 degrees 1.2 %,
at 60 degrees 3.2 %, at 90 degrees 10 %; one that is rolled up the same to a factor of two. An
`accuracy` chooses cells, and nothing is to be said then.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...bodies.stress_recovery import beam_strains
from ...core.algebra.linalg import evenly
from ...systems.system import System
from ...systems.terms import elastic as terms
from ..observers import judges
from ..tracing import FEW
from ..trajectory import Trajectory

#: turn of a cell from which is warned; at 40 degrees twist errs by 0.2 %, at 60 by 3 %
FAR = np.radians(50.0)
WANTED = np.radians(40.0)  #: turn of a cell with the cells that are named


def beams(system: System) -> bool:
    """Whether a full system has such beams: reduced ones have the turns that they were trained on."""
    return not system.components and any(one.gather.law.fields > 1 for one in system.elastic)


@judges
def _(motion: Trajectory) -> Iterator[str]:
    """Every beam with a cell that turns by more than FAR in one of up to 40 stored states, with the
    cells it needs.
    """
    most = dict[str, tuple[float, float]]()
    for k in evenly(0, len(motion.times) - 1, FEW) if beams(motion.system) else ():
        for name, turns in turns_of(motion.system, motion.x[k]).items():
            cells = len(turns) * float(turns.max()) / WANTED
            most[name] = max(most.get(name, (0.0, 0.0)), (float(turns.max()), cells))
    for name, (turn, cells) in most.items():
        if turn > FAR:
            text = f"body '{name}' turns by up to {np.degrees(turn):.0f} degrees in a cell, which splines do not follow"
            off = "deflections there err by 1 % at 50 degrees, 3 % at 60, 10 % at 90"
            yield f"{text}: {off}; take {int(np.ceil(cells))} cells of equal length, or an accuracy"


def turns_of(system: System, x: np.ndarray) -> dict[str, np.ndarray]:
    """By how much the axes of beams turn in each cell (e,) [rad], by their names, in a state (n,)."""
    q = system.lift(x)
    found = {}
    for elastic in system.elastic:
        if (
            elastic.gather.law.fields > 1
            and (u := terms.position_gradients(elastic.gather, x, q)) is not None
        ):
            kappa = beam_strains(u, np.zeros((elastic.gather.law.rows, 1, 1)))[3:6]
            found[elastic.name] = np.sum(
                np.linalg.norm(kappa, axis=0) * elastic.gather.section[-1], axis=0
            )
    return found
