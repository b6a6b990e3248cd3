"""Compile what a first run needs after its time steps, in a process beside it: training, outputs, reactions, measurements.

    python -m fmbs_skfem.cli.warm SCENE

The parent compiles the time step meanwhile and finds the rest in the cache. What fails here is told by the parent's own run.
"""

from __future__ import annotations

import contextlib
import sys

import numpy as np

from .. import dynamics, scenes
from ..core.errors import FmbsError
from ..dynamics import GeneralizedAlpha, Statistics, Trajectory
from ..reduction import costs, ecsw
from ..scenes import build


def main(path: str) -> None:
    """Compile for the scene in a file."""
    ecsw.weights_from_gram(ecsw.gram(np.ones((1, 1))), 0.5)
    ecsw.weights(np.eye(2), 0.5)
    with contextlib.suppress(FmbsError):
        scene = scenes.read(path)
        system = build.chosen_form(scene, build.system(scene, allow_outside=True))
        x, rows = np.tile(system.x0, (2, 1)), np.zeros((2, len(system.constraints.names)))
        still = Trajectory(system, np.array([0.0, 1.0]), x, 0 * x, 0 * x, rows, Statistics(1, 1, 1, 0, 0.0, 0.0))
        costs.shares(still, GeneralizedAlpha(costs.STEP), 1)
        dynamics.outputs(still)
        dynamics.energy_drift(still)
        dynamics.reactions(still)


if __name__ == "__main__":
    main(sys.argv[1])
