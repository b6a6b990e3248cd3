"""Rigid frames of a plate in space: rows of their axes that a basis cannot meet would lock the
reduced motion.
"""

from __future__ import annotations

import functools
from functools import partial

import numpy as np
import pytest

from fmbs_skfem import reduction, scenes
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.reduction import Plan, body_level, task_of
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.reduced_models import ReducedModel
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System

from ..cli.calls import EXAMPLES

SCENE = """\
schema: 1
name: link and rod
dimension: 3
bodies:
  link:
    type: plate
    mesh: ../meshes/plate_crank_coarse.msh
    interpolation: ancf
    thickness: 3 mm
    material: {young_modulus: 70 GPa, density: 2700 kg/m^3, poisson_ratio: 0.3}
    rims: {A: A, B: B}
  rod:
    type: cable
    mesh: ../meshes/beam_10.msh
    section: {shape: circular, diameter: 6 mm}
    material: {young_modulus: 70 GPa, density: 2700 kg/m^3}
    origin: [0.1 m, 0, 0]
  tip: {type: point_mass, mass: 0.05 kg, position: [1.1 m, 0, 0]}
joints:
  A: {type: revolute, at: link.A, axis: [0, 0, 1], to: ground}
  B: {type: spherical, at: link.B, to: rod.left}
  C: {type: spherical, at: rod.right, to: tip}
loads:
  weight: {type: gravity, acceleration: [0, 0, -9.81]}
  motor: {type: torque, at: link.A, torque: [0, 0, 0.2 N m]}
analysis: {type: dynamic, duration: 0.1 s, step: 4e-4 s, rho_inf: 0.7}
"""
STEP, NEWTON = GeneralizedAlpha(4e-4, 0.7), Newton(tolerance=1e-12)


@functools.cache
def full() -> tuple[System, Trajectory]:
    """The link turns by the motor and sags by the weight of the rod; 250 steps."""
    scene = scenes.loads(SCENE, EXAMPLES)
    raw = build.system(scene)
    return raw, integrate(build.chosen_form(scene, raw), STEP, 0.1, NEWTON)


@functools.cache
def trained(eps: float) -> tuple[ReducedModel, float]:
    """The reduced model by components, and its largest error."""
    raw, motion = full()
    plan = Plan(body_level(raw), eps, eliminate=True)
    case = Case(raw, STEP, 0.1, NEWTON)
    model = reduction.train(
        task_of(case, plan, 1.2e-3, partial(build.chosen_form, scenes.loads(SCENE, EXAMPLES))),
        motion=motion,
    ).model
    return model, reduction.compare(motion, integrate(model.system, STEP, 0.1, NEWTON)).maximum


@pytest.mark.parametrize("eps,bound", [(1e-11, 1e-3), (1e-13, 3e-5), (1e-14, 1e-5)])
def test_rows_that_lock_are_left_out(eps: float, bound: float) -> None:
    assert trained(eps)[1] < bound


def test_with_all_rows_the_motion_locks() -> None:
    """Few modes of the link hardly move some rows of its frames: those are named, with the error
    that they would make.
    """
    raw, motion = full()
    model, error = trained(1e-11)
    left = {name for name, why in model.left_out.items() if why.startswith("locks the motion")}
    assert left
    assert all(name.startswith("link.") for name in left)
    data, parts = reduction.snapshots(motion, 1.2e-3), body_level(raw)
    every = reduction.reduce_system(
        raw, parts, reduction.bases(raw, data, parts, 1e-11), True, data.q
    )
    assert {".".join(name) for name in every.constraints.names} == left | {
        ".".join(name) for name in model.system.constraints.names
    }
    try:
        locked = reduction.compare(motion, integrate(every, STEP, 0.1, NEWTON)).maximum
    except SolverError:
        locked = np.inf
    assert locked > 100 * error
