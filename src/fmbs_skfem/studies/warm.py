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
from ..core.jit import compile_for
from ..dynamics import GeneralizedAlpha, Newton, Statistics, Trajectory, stepping
from ..dynamics.scheme import method_of
from ..dynamics.start import Start, first_state, workspace
from ..reduction import costs, ecsw
from ..scenes import build
from ..systems import kernels, turning
from ..systems.compiled import compile_system, signal_table
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
        costs.bench(system, repeat=1)(costs.STRESS)


def end_of_step(system: System) -> None:
    """Factors, solution and what follows them, then tangents."""
    model = compile_system(system)
    method = method_of(GeneralizedAlpha(costs.STEP), Newton(), costs.STEP, model)
    A, w, signals = model.arrays, workspace(model), signal_table(system, np.zeros(1))[0]
    none = 0 * system.x0
    s = first_state(model, Start(system.x0, system.v0, none, np.zeros(model.constraints), np.zeros((2, len(none)))), method.c)
    compile_for(stepping.factors, w)
    compile_for(stepping.correct, A.norm, w, method)
    compile_for(stepping.accept, A.norm, s, w, method)
    compile_for(stepping.settle, A, s, w, method, signals)
    compile_for(stepping.judge, w, method, 0.0, 0, 0.0, 0.0, 0)
    compile_for(kernels.load_slopes, A.forces, A.probes, w.y, w.v, signals, w.angles, 0.0, 0.0, w.H)
    compile_for(kernels.constraint_slopes, A.terms, w.y, signals, w.multipliers, w.H)
    compile_for(turning.add_turned_tangent, A.turning, w.x, 0.0, w.W)
    compile_for(kernels.add_elastic_tangent, A.groups, A.scatter, A.lift, A.lift_offset, w.x, w.body[0], 0.0, w.work, w.W)


if __name__ == "__main__":
    main(sys.argv[1])
