"""Reactions of joints inside a component of reduced models, against those of the full model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.reduction import Plan, Points, cases, task_of
from fmbs_skfem.reduction.accuracy import output_errors
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.hyper.hyper_reduction import NONE, HyperReduction
from fmbs_skfem.reduction.reduced_models import ReducedModel
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models
from .test_kept_rows import Helix

STEP, TIGHT = GeneralizedAlpha(1e-3), Newton(tolerance=2e-12)


def arm(joint: joints.Joint, read: bool = True) -> System:
    """A beam that a joint holds on its left, under its weight that rises within 0.1 s."""
    beam = body.cable("arm", models.segment(16), models.SECTION, models.MATERIAL, dim=2)
    seen = {"wall": probes.Reaction("wall")} if read else {}
    end = {"tip": probes.Position(At("arm", "right")), **seen}
    push = loads.PointForce(
        "push", At("arm", "right"), (0.0, -0.2), of_time("where(t < 0.1, 1 - cos(10*pi*t), 2)")
    )
    return assemble(
        [beam],
        [joint],
        [push, loads.Gravity((0.0, -1e-3))],
        outputs=end,
        damping=Rayleigh(0.0, 1e-3),
    )


def trained(
    raw: System, eps: float, hyper: HyperReduction = NONE, eliminate_rows: bool = False
) -> tuple[ReducedModel, Trajectory]:
    """The reduced model, and the full motion over 0.3 s."""
    full = integrate(eliminate(raw), STEP, 0.3, TIGHT)
    plan = Plan({"arm": ("arm",)}, eps, hyper=hyper, eliminate=eliminate_rows)
    return reduction.train(
        task_of(Case(raw, STEP, 0.3, TIGHT), plan, 2e-3), motion=full
    ).model, full


@pytest.mark.parametrize(
    "held", [joints.Pin("wall", At("arm", "left")), joints.Clamp("wall", At("arm", "left"))]
)
@pytest.mark.parametrize("hyper", [NONE, Points(1e-4)])
@pytest.mark.parametrize("by_elimination", [False, True])
def test_reactions_are_those_of_the_full_model(
    held: joints.Joint, hyper: HyperReduction, by_elimination: bool
) -> None:
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
    one, other = (
        outputs(cases.run(replace(model.cases({}), newton=TIGHT))) for model in (with_them, without)
    )
    np.testing.assert_allclose(one["tip_y"], other["tip_y"], rtol=0.0, atol=1e-9)


def linked(*joint: joints.Joint) -> System:
    """A clamped beam, and a softer one that a joint and a pin at its far end hold, above one
    another or in line.
    """
    first = body.cable("a", models.segment(10), models.SECTION, models.MATERIAL, dim=2)
    second = body.cable(
        "b",
        models.segment(10, (1, 0), (2, 0)),
        models.SECTION,
        sections.Material(2e8, 1000.0),
        dim=2,
    )
    held = [joints.Clamp("wall", At("a", "left")), joints.Pin("foot", At("b", "right")), *joint]
    read = {name: probes.Reaction(name) for name in ("wall", "link")}
    return assemble([first, second], held, [loads.Gravity((0.0, -9.81))], outputs=read)


def on_a_wire() -> System:
    """A free beam whose left end slides along a helix under its weight: nothing holds it beside."""
    beam = body.cable(
        "a", models.segment(12, (0.5, 0, 0), (1.5, 0, 0)), models.SECTION, models.MATERIAL
    )
    rail = Helix("link", At("a", "left"), 0.5, 0.8)
    return assemble(
        [beam],
        [rail],
        [loads.Gravity((0.0, 0.0, -9.81))],
        outputs={"link": probes.Reaction("link")},
    )


@pytest.mark.parametrize("hyper", [NONE, Points(1e-4)])
@pytest.mark.parametrize(
    "raw",
    [linked(joints.Prismatic("link", At("b", "left"), (1.0, 0.0), At("a", "right"))), on_a_wire()],
    ids=["prismatic", "wire"],
)
def test_nonlinear_joints_inside_a_component_give_their_reactions(
    raw: System, hyper: HyperReduction
) -> None:
    """The modes move along the joint: without directions against it, moments err by 10 and forces
    by 1.4 times their range.
    """
    full = integrate(eliminate(raw), STEP, 0.4, TIGHT)
    components = {"all": tuple(name for name, _, _ in raw.coordinates)}
    task = task_of(Case(raw, STEP, 0.4, TIGHT), Plan(components, 1e-12, hyper=hyper), 2e-3)
    model = reduction.train(task, motion=full).model
    found = output_errors.compare(full, cases.run(model.cases({})))
    assert max(one.relative for one in found.values() if one.output == "link") < 0.06
    assert model.left_out == {}
