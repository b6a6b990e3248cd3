"""Compile in a process beside a first run what that run needs later: training, the end of its time step, then outputs.

    python -m fmbs_skfem.studies.warm SCENE

The parent compiles the time step from its beginning meanwhile and finds the rest in the cache: two processes that compile the same
function at one time gain nothing. What fails here is told by the parent's own run.
"""

from __future__ import annotations

import contextlib
import sys

import numpy as np

from .. import dynamics, scenes
from ..core.errors import FmbsError
from ..dynamics import GeneralizedAlpha, Statistics, Trajectory, stepping
from ..reduction import costs, ecsw
from ..scenes import build
from ..systems.compiled import compile_system
from ..systems.system import System


def main(path: str) -> None:
    """Compile for the scene in a file."""
    ecsw.weights_from_gram(ecsw.gram(np.ones((1, 1))), 0.5)
    ecsw.weights(np.eye(2), 0.5)
    with contextlib.suppress(FmbsError):
        scene = scenes.read(path)
        system = build.chosen_form(scene, build.system(scene, allow_outside=True))
        end_of_step(system)
        x, rows = np.tile(system.x0, (2, 1)), np.zeros((2, len(system.constraints.names)))
        still = Trajectory(system, np.array([0.0, 1.0]), x, 0 * x, 0 * x, rows, Statistics(1, 1, 1, 0, 0.0, 0.0))
        dynamics.outputs(still)
        dynamics.energy_drift(still)
        dynamics.reactions(still)
        costs.shares(still, GeneralizedAlpha(costs.STEP), 1)


def end_of_step(system: System) -> None:
    """Solution and what follows it, then tangents and factors: a step is compiled from its other end."""
    model = compile_system(system)
    step = stepping.advance, stepping.settle, stepping.solve, stepping.factorise
    for one in (*step, *(term.routines.tangent for term in model.terms)):
        int(one.address)


if __name__ == "__main__":
    main(sys.argv[1])
