"""Trainings that do not pay say so, and families of parts promise nothing for bodies that their
parts do not stand for.
"""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fmbs_skfem.core.notices import Notice
from fmbs_skfem.reduction.accuracy.costs import Payoff
from fmbs_skfem.studies import greedy_training as training

from .calls import fmbs
from .test_train import kept

BEAM = """\
schema: 1
name: beam
dimension: 2
parameters: {F: {value: 20 mN, range: [10 mN, 40 mN]}, f: {value: 70, range: [60, 80]}}
bodies:
  arm: BODY
joints: {root: {type: clamp, at: arm.left}}
loads: {f: {type: point_force, at: arm.right, force: [0, F], history: "sin(2*pi*f*t)"}}
damping: {stiffness: 0.02 ms}
outputs: {tip: {type: position, at: arm.right}}
analysis: {type: dynamic, duration: 0.1 s, step: 0.5 ms}
reduction: {snapshots: 1 ms}
training: {candidates: 9, samples: 3, iterations: 2, tolerance: 1e-2, holdout: 1}
"""
FULL = "{type: cable, mesh: beam_10.msh, section: {shape: circular, diameter: 12 mm}, material: {young_modulus: 3 GPa, density: 1150}}"
PART = "{type: part, file: arm.part.h5}"


def test_a_family_of_parts_that_do_not_stand_for_their_bodies_promises_nothing(
    tmp_path: Path,
) -> None:
    """With a function beside those of its rigid motions, trained to a few hertz, the arm is shaken
    with 60 to 80.
    """
    scene = kept(tmp_path / "full.yaml", BEAM.replace("BODY", FULL))
    more = ("--modes", "3", "--runs", "1", "--samples", "100", "--out", tmp_path)
    done = fmbs("part", "train", scene, "--body", "arm", "--alone", *more)
    assert done.code == 0, done.err
    family = kept(tmp_path / "family.yaml", BEAM.replace("BODY", PART))
    found = fmbs("train", family, "--json", "--no-plots", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert found.json["status"] == "no promise"
    assert (
        len([text for text in found.json["notices"] if "parts 'arm' do not stand for" in text]) == 1
    )  # of three full runs
    assert any(
        "it is one against the mechanism with its parts, which err by up to" in text
        for text in found.json["doubts"]
    )


def rows(*pairs: tuple[float, float]) -> Any:
    """Models of a training by the time of a run and the largest error at hold-out points."""
    made = tuple(SimpleNamespace(run_s=spent, max_error=error) for spent, error in pairs)
    return SimpleNamespace(rows=made, models=len(made), last=made[-1], full_s=0.05)


def test_a_model_that_is_slower_than_the_full_one_is_told_with_what_pays() -> None:
    """Times are given here: 0.05 s of the full model, 0.02 s and 0.1 s of those of the first and
    the second full run.
    """
    order: Any = SimpleNamespace(tolerance=1e-2)
    found: Any = SimpleNamespace(
        full_runs=(SimpleNamespace(cpu_s=0.05), SimpleNamespace(cpu_s=0.07))
    )
    found.models = (SimpleNamespace(training_s=0.01),)
    checked = rows((0.02, 3.5e-3), (0.1, 1e-6))
    payoff = training.find_payoff(found, checked, 0.3)
    assert payoff.speedup == pytest.approx(0.5)
    assert payoff.training_s == 0.3
    assert training.find_payoff(found, checked, 0.1).training_s == pytest.approx(
        0.05 + 0.07 + 0.01
    )  # of a training that went on
    told = r"0\.5 times as fast .*\(fmbs sweep SCENE\), or train with --iterations 1, whose model is 2\.5 times as fast"
    with pytest.warns(Notice, match=told):
        training.warn_of_cost(order, payoff, checked)
    for other in ((0.02, 3.5e-2), (0.04, 3.5e-3)):  # too rough, too slow
        with pytest.warns(Notice, match=r"fmbs sweep SCENE\)$"):
            training.warn_of_cost(order, payoff, rows(other, (0.1, 1e-6)))
    with pytest.warns(Notice, match="a run of it fails"):
        training.warn_of_cost(order, Payoff(0.05, 0.3, math.nan), checked)
    training.warn_of_cost(order, Payoff(0.05, 0.3, 0.03), checked)
