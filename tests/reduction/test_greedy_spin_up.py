"""Example 1 over Young's modulus: two full runs serve the range from 0.7 to 1.3 GPa.

Figures of an independent implementation at eps = 1e-12: 2 full runs bring the error (48) below 1e-4
at 26 values, 1.1e-5 with 100 elements. Example 1 of Hou, Liu, Hu, CMAME 361 (2020) 112690, doi
10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.core.values import expressions
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.families import greedy, training
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.reduction import Elements
from fmbs_skfem.reduction import parameters as boxes
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.full_runs import TrainingTask
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.systems import At, assemble
from fmbs_skfem.systems.connections import joints
from tests import models
from tests.reduction.hold_out import HeldOut, hold_out, share_runs

YOUNG = Parameter("E", 0.7e9, 1.3e9, unit="Pa")
ANGLE = expressions.of_time(
    "where(t < Ts, ws/Ts*(t**2/2 + (Ts/(2*pi))**2*(cos(2*pi*t/Ts) - 1)), ws*(t - Ts/2))",
    {"Ts": models.SPIN_TIME, "ws": models.SPIN_RATE},
)


def family(values: Mapping[str, float]) -> Case:
    """Example 1 with 20 elements; its response depends on the mesh by less than 1e-6 m from 25
    elements on.
    """
    material = sections.Material(values["E"], models.MATERIAL.density)
    root = At("beam", "left")
    drives = [joints.Pin("hinge", root), joints.DrivenAngle("drive", root, ANGLE)]
    beam = body.cable("beam", models.segment(20), models.SECTION, material, dim=2)
    return Case(assemble([beam], drives), GeneralizedAlpha(5e-4), 3.0)


@pytest.fixture(scope="module")
def trained() -> FinishedTraining:
    task = TrainingTask(
        family, (YOUNG,), Plan({"beam": ("beam",)}, 1e-12, hyper=Elements(1e-3)), 5e-3
    )
    search = training.search((YOUNG,), boxes.grid((YOUNG,), 101), boxes.grid((YOUNG,), 5))
    return training.train(task, search, greedy.Options(iterations=4))


@pytest.fixture(scope="module")
def checked(trained: FinishedTraining) -> tuple[HeldOut, HeldOut]:
    """26 values with the model after one and after two full runs."""
    points, full = boxes.grid((YOUNG,), 26), share_runs(trained.task)
    return hold_out(trained, points, trained.models[0], full), hold_out(trained, points, full=full)


def test_two_full_runs_are_enough(
    trained: FinishedTraining, checked: tuple[HeldOut, HeldOut]
) -> None:
    assert len(trained.runs) == 2
    assert trained.reduced_runs <= 12
    assert [len(model.selections) for model in trained.models] == [1, 1]
    assert checked[1].largest < 1e-4


def test_truncation_is_told_as_the_limit(trained: FinishedTraining) -> None:
    assert trained.outcome.stop in (greedy.StopReason.FLOOR, greedy.StopReason.REPEATED)
    assert "eps (truncation)" in trained.outcome.stop.value


def test_the_second_run_is_needed(checked: tuple[HeldOut, HeldOut]) -> None:
    one, both = checked
    assert one.largest > 1e-3
    assert both.largest < 0.05 * one.largest


def test_true_errors_lie_in_the_predicted_band(checked: tuple[HeldOut, HeldOut]) -> None:
    assert checked[1].inside >= 0.9


def test_the_indicator_orders_the_models(checked: tuple[HeldOut, HeldOut]) -> None:
    one, both = checked
    assert both.indicators.max() < 0.1 * one.indicators.max()
