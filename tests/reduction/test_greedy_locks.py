"""Greedy training of a family whose bodies are caught by events: a falling beam is held at its tip."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from fmbs_skfem.bodies import cable, sections
from fmbs_skfem.control.events import Event, Latch
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.families import greedy, training
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.reduction import Elements
from fmbs_skfem.reduction import parameters as boxes
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import TrainingTask
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.systems import At, Rayleigh, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from tests import models

YOUNG = Parameter("E", 0.7e9, 1.3e9, unit="Pa")
ROOT, TIP = At("beam", "left"), At("beam", "right")


def family(values: Mapping[str, float]) -> Case:
    """A beam that falls about its pin, until its tip is 0.3 m down."""
    material = sections.Material(values["E"], models.MATERIAL.density)
    beam = cable("beam", models.segment(8), sections.Circular(0.02), material, dim=2)
    system = assemble(
        [beam],
        [joints.Pin("pin", ROOT), Latch("hold", TIP)],
        [loads.Gravity((0.0, -9.81))],
        damping=Rayleigh(stiffness=2e-3),
        outputs={"tip": probes.Position(TIP), "middle": probes.Position(At("beam", 0.5))},
        events={"catch": Event(when=of_state("tip.y + 0.3"), direction="falling", lock=("hold",))},
    )
    return Case(system, GeneralizedAlpha(2e-3), 0.3)


@pytest.fixture(scope="module")
def trained() -> FinishedTraining:
    task = TrainingTask(
        family, (YOUNG,), Plan({"beam": ("beam",)}, 1e-12, hyper=Elements(1e-4)), 4e-3
    )
    search = training.search((YOUNG,), boxes.grid((YOUNG,), 11), boxes.grid((YOUNG,), 3))
    return training.train(task, search, greedy.Options(iterations=2))


@pytest.mark.parametrize("young", [0.83e9, 1.27e9])
def test_models_of_the_family_are_caught_as_the_full_ones(
    trained: FinishedTraining, young: float
) -> None:
    case = family({"E": young})
    full = integrate(eliminate(case.system), case.scheme, case.duration)
    small = trained.model.cases({"E": young})
    found = integrate(small.system, case.scheme, case.duration)
    assert found.system.size < 0.7 * full.system.size
    (one,), (other,) = full.events, found.events
    assert other.time == pytest.approx(one.time, abs=1e-6)
    assert (
        0.0 < one.loss < other.loss
    )  # fewer unknowns have less room around a point that stops at once
    for name, values in outputs(found).items():
        error = np.abs(values - outputs(full)[name])
        assert error.max() < 5e-4  # in the waves behind the catch, which no step resolves
        assert np.sqrt(np.mean(error**2)) < 1e-4  # of 1 m
