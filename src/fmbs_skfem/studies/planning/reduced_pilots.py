r"""Pilot runs of large models, by a model that is reduced from the first motion that is resolved.

    y_r(n) - y_r(2n) = y(n) - y(2n) within some per cent

Differences between numbers of steps hardly depend on the mesh, nor on the basis, as long as the
basis holds the waves that steps err by: two plates of 3134 unknowns in 800 steps make 11 unknowns,
whose differences, of the worst output, are those of the full model within 3 % from 800 to 3200
steps, in a hundredth of its time. What they differ by from the full motion, in the steps that they
were made of, has to be a small part of the accuracy, and is a part of the error: waves that the
basis misses have 0.2 % of the range of a speed there, and were 0.45 % in 14500 steps.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from ...core.errors import FmbsError, Reason, SolverError
from ...core.notices import Notice
from ...dynamics import Trajectory
from ...dynamics.checkpoint import RunState
from ...reduction import full_runs
from ...reduction.hyper import hyper_reduction
from ...reduction.plan import Plan
from ...reduction.reduced_models import reduced_case, train_reduction
from ...scenes import build
from .. import plans
from .pilots import INSTANTS, ScenePilots, give_up
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
# crank-slider of 3134 unknowns: speeds differ by 0.19 % of their range in 800 steps and 0.29 % in
# 6400, with 1e-16 by 0.07 and 0.20 %
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
        try:
            return next((reduced_from(pilots, *one) for one in coarse_motions(pilots)), None)
        except FmbsError:
            return None


def coarse_motions(pilots: ScenePilots) -> Iterator[tuple[Trajectory, int]]:
    """Full motions in BEGIN times the usual steps, and in twice as many, and so on, as far as these
    resolve them and do not ask for factors all the time, with INSTANTS states.
    """
    asked = build.stepped(pilots.scene)
    for halving in range(HALVINGS):
        steps = BEGIN * pilots.usual * 2**halving
        analysis = asked.piloted(steps, 1, tolerance=pilots.tolerance(steps))
        solve = partial(analysis.integrate, pilots.system(0), record=give_up_early, judged=False)
        if (tried := pilots.attempt(partial(solve, states=INSTANTS + 1))) is not None:
            motion, pilots.made[pilots.level_of(0), steps] = tried
            yield motion, steps


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
    plan = Plan(plans.components(scene), EPS, hyper=hyper_reduction.named("points"))
    states = motion.states
    task = plans.task(scene, raw, plan, states.times)
    trained = train_reduction(task, [full_runs.run_of_motion(task, states)])
    found = pilots.with_system(0, reduced_case(task, trained, {}).system)
    own = found.run(0, steps)
    full = pilots.run(0, steps)
    if own is None or full is None:
        return None
    apart = pilots.differ(own, full)
    return ReducedPilots(found, steps, apart) if size(apart) <= SURE else None
