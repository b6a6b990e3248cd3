r"""Pilot runs of large models, by a model that is reduced from the first motion that is resolved.

    y_r(n) - y_r(2n) = y(n) - y(2n) within some per cent

Differences between numbers of steps hardly depend on the mesh, nor on the basis, as long as the
basis holds the waves that steps err by: two plates of 3134 unknowns in 800 steps make 11 unknowns,
whose differences are those of the full model within 3 % from 800 to 3200 steps, in a hundredth of
its time. What they differ by from the full motion, in the steps that they were made of, has to be
a small part of the accuracy, and is a part of the error: waves that the basis misses have 0.2 % of
the range of a speed there, and were 0.45 % in 14500 steps.
"""

from __future__ import annotations

import copy
import warnings
from functools import partial
from typing import NamedTuple

import numpy as np

from ...core.errors import FmbsError, Reason, SolverError
from ...core.notices import Notice
from ...dynamics import Trajectory
from ...dynamics.checkpoint import RunState
from ...reduction import full_runs
from ...reduction.cases import Case
from ...reduction.hyper import hyper_reduction
from ...reduction.plan import Plan
from ...reduction.reduced_models import reduced_case, train_reduction
from ...scenes import build
from ...systems import finer_systems
from .pilots import DIVIDED, INSTANTS, ScenePilots, give_up, outputs_of
from .planner import SURE, size

LARGE = 1000  #: unknowns of a full model, from which training costs less than its runs
#: times the steps with which chains of small models begin: in 200 steps it takes 10 s to see that
#: they are too few
BEGIN = 2
# crank-slider of 3134 unknowns: 0.89 a step and 12 s in 400 steps, 0.001 and 2 s in 800; a plate that
# is bent: 0.005 in 200
DEAR = 0.2  #: factorisations a step, from which twice as many steps cost less
SOON = 4  #: steps after which that is looked at
HALVINGS = 5  #: of these steps, down to which a full motion is sought
# crank-slider of 3134 unknowns: 1e-8 and 1e-12 tell the same differences within 5 %
EPS = 1e-10  #: of its bases


class ReducedPilots(NamedTuple):
    """Pilots of a reduced model."""

    pilots: ScenePilots
    steps: int  #: of the full motion that it is made of
    apart: np.ndarray  #: (2, k) what it differs by from that, see `ScenePilots.differ`


def reduce_pilots(pilots: ScenePilots) -> ReducedPilots | None:
    """The same pilots with a reduced model.

    None for small models, for forces that jump, and where the reduced model errs by too much.
    """
    if pilots.system(0).size < LARGE or pilots.rough or pilots.scene.events:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        found = coarse_motion(pilots)
        try:
            return None if found is None else reduced_from(pilots, *found)
        except FmbsError:
            return None


def coarse_motion(pilots: ScenePilots) -> tuple[Trajectory, int] | None:
    """The full motion in the fewest steps, from BEGIN times the usual ones by doubling, that
    resolve it and do not ask for factors all the time, with INSTANTS states.
    """
    asked = build.dynamic(pilots.scene)
    for halving in range(HALVINGS):
        steps = BEGIN * pilots.usual * 2**halving
        analysis = asked.piloted(steps, 1, tolerance=pilots.tolerance(steps))
        try:
            motion = analysis.integrate(
                pilots.system(0), record=give_up_early, judged=False, states=INSTANTS + 1
            )
        except SolverError:
            continue
        if motion.statistics.halved <= DIVIDED:
            return motion, steps
    return None


def give_up_early(state: RunState) -> None:
    """SolverError of a run that divides too many of its steps, or needs new factors in most."""
    give_up(state)
    if state.factorisations > DEAR * state.done >= DEAR * SOON:
        raise SolverError(
            f"{state.factorisations} factorisations up to t = {state.time:.6g} s",
            Reason.NOT_CONVERGED,
        )


def reduced_from(pilots: ScenePilots, motion: Trajectory, steps: int) -> ReducedPilots | None:
    """The pilots of a reduced model of a motion in some steps; None where it differs from that
    motion by more than SURE of the accuracy.
    """
    scene = pilots.scene.chosen(None, motion.times[-1] / steps)
    raw = build.system(scene, None, pilots.allow_outside)
    analysis = build.dynamic(scene)
    joints = {name: [name] for joint in scene.joints.values() for name in joint.coordinates}
    components = {name: [name] for name in scene.bodies} | joints
    plan = Plan(components, EPS, hyper=hyper_reduction.named("points"))
    case = Case(raw, analysis.scheme, analysis.duration, analysis.newton)
    form = partial(build.chosen_form, scene)
    states = motion.states
    task = full_runs.task_of(case, plan, states.times, form)
    trained = train_reduction(task, [full_runs.run_of_motion(task, states)])
    found = copy.copy(pilots)
    found.systems = {0: finer_systems.unchecked(reduced_case(task, trained, {}).system)}
    own = found.run(0, steps)
    if own is None:
        return None
    apart = pilots.differ(own, outputs_of(motion))
    return ReducedPilots(found, steps, apart) if size(apart) <= SURE else None
