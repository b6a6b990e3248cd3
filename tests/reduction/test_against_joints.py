"""Reactions of joints inside a component of reduced models, against those of the full model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body
from fmbs_skfem.core.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.reduction import Plan, Points, cases, output_errors, task_of
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.hyper_reduction import NONE, HyperReduction
from fmbs_skfem.reduction.reduced_models import ReducedModel
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate, joints, loads, probes

from .. import models

STEP, TIGHT = GeneralizedAlpha(1e-3), Newton(tolerance=2e-12)


def arm(joint: joints.Joint, read: bool = True) -> System:
    """A beam that a joint holds on its left, under its weight that rises within 0.1 s."""
    beam = body.cable("arm", models.straight(16), models.SECTION, models.MATERIAL, dim=2)
    seen = {"wall": probes.Reaction("wall")} if read else {}
    end = {"tip": probes.Position(At("arm", "right")), **seen}
    push = loads.PointForce("push", At("arm", "right"), (0.0, -0.2), of_time("where(t < 0.1, 1 - cos(10*pi*t), 2)"))
    return assemble([beam], [joint], [push, loads.Gravity((0.0, -1e-3))], outputs=end, damping=Rayleigh(0.0, 1e-3))


def trained(raw: System, eps: float, hyper: HyperReduction = NONE, eliminate_rows: bool = False) -> tuple[ReducedModel, Trajectory]:
    """The reduced model, and the full motion over 0.3 s."""
    full = integrate(eliminate(raw), STEP, 0.3, TIGHT)
    plan = Plan({"arm": ("arm",)}, eps, hyper=hyper, eliminate=eliminate_rows)
    return reduction.train(task_of(Case(raw, STEP, 0.3, TIGHT), plan, 2e-3), motion=full).model, full


@pytest.mark.parametrize("held", [joints.Pin("wall", At("arm", "left")), joints.Clamp("wall", At("arm", "left"))])
@pytest.mark.parametrize("hyper", [NONE, Points(1e-4)])
@pytest.mark.parametrize("by_elimination", [False, True])
def test_reactions_are_those_of_the_full_model(held: joints.Joint, hyper: HyperReduction, by_elimination: bool) -> None:
    model, full = trained(arm(held), 1e-14, hyper, by_elimination)
    found = output_errors.compare(full, cases.run(model.cases({})))
    rows = [one for one in found.values() if one.output == "wall"]
    assert len(rows) == (2 if isinstance(held, joints.Pin) else 3)
    assert max(one.relative for one in rows) < 0.02
    assert model.left_out == {}


def test_they_fall_with_the_tolerance() -> None:
    errors = []
    for eps in (1e-8, 1e-11, 1e-14):
        model, full = trained(arm(joints.Clamp("wall", At("arm", "left"))), eps)
        found = output_errors.compare(full, cases.run(model.cases({})))
        errors.append(max(one.relative for one in found.values() if one.output == "wall"))
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.3 * errors[1]


def test_the_motion_is_that_without_them() -> None:
    """The directions stay at zero; they are none of the modes that are counted."""
    held = joints.Clamp("wall", At("arm", "left"))
    (with_them, _), (without, _) = (trained(arm(held, read), 1e-12) for read in (True, False))
    assert with_them.modes == without.modes
    assert with_them.system.size == without.system.size + 3
    one, other = (outputs(cases.run(replace(model.cases({}), newton=TIGHT))) for model in (with_them, without))
    np.testing.assert_allclose(one["tip_y"], other["tip_y"], rtol=0.0, atol=1e-9)
