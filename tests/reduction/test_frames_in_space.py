"""Rigid frames of a plate in space: rows of their axes that a basis cannot meet would lock the reduced motion."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from fmbs_skfem import reduction, scenes
from fmbs_skfem.core.errors import SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate
from fmbs_skfem.reduction import body_level, galerkin
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


def error(eps: float) -> tuple[int, float]:
    """Constraint rows and largest error of the reduced model by components."""
    raw, motion = full()
    data, parts = reduction.snapshots(motion, 1.2e-3), body_level(raw)
    small = reduction.reduce_system(raw, parts, reduction.bases(raw, data, parts, eps), True, data.q)
    try:
        found = integrate(small, STEP, 0.1, NEWTON)
    except SolverError:
        return len(small.constraints.names), np.inf
    return len(small.constraints.names), reduction.compare(motion, found).maximum


@pytest.mark.parametrize("eps,bound", [(1e-11, 1e-3), (1e-13, 3e-5), (1e-14, 1e-5)])
def test_rows_out_of_reach_are_left_out(eps: float, bound: float) -> None:
    assert error(eps)[1] < bound


def test_with_all_rows_the_motion_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few modes of the link hardly move some rows of its frames: closing their gaps takes far more than the basis errs."""
    few = error(1e-11)
    monkeypatch.setattr(galerkin, "REACH", float("inf"))
    every = error(1e-11)
    assert every[0] > few[0]
    assert every[1] > 100 * few[1]
