"""What a training predicts of its errors holds at points that it has not seen, or it says that it
cannot promise it.

Every family is trained as `fmbs train` does without hold-out points; its prediction is held against
the errors of the outputs at ten random points of its box, and at its corners where there are
several parameters. HONESTY=30 in the environment tries all thirty families; with `-s` their bands
are printed.
"""

from __future__ import annotations

import functools
import math
import os
import sys
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from fmbs_skfem.core.errors import NoModel, SolverError
from fmbs_skfem.families import greedy, prediction, training
from fmbs_skfem.families.parametric_model import ParametricModel
from fmbs_skfem.families.prediction import Prediction
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.reduction import Points, full_runs, reduced_models
from fmbs_skfem.reduction import parameters as boxes
from fmbs_skfem.reduction.full_runs import OutputMeasure, TrainingTask
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.scenes import points
from fmbs_skfem.scenes import training_options as sections

from .families import FAMILIES

POINTS = 10
HELD = 0.9  #: part of the points whose errors lie below the upper ends of their bands
PROMISED = 2 / 3  #: part of the families whose training promises its prediction
FEW = (
    "buckling, 200 m away",
    "below buckling",
    "snap-through",
    "resonance",
    "driven crank, three parameters",
    "small beam on a large machine",
    "pendulum",
    "sudden load",
)
NAMES = tuple(FAMILIES)[: int(os.environ["HONESTY"])] if "HONESTY" in os.environ else FEW


@dataclass(frozen=True)
class Trial:
    """A trained family at points that it has not seen and at which the full model moves."""

    doubts: list[str]  #: what the training says against its prediction
    true: np.ndarray  #: (k,) errors of the outputs, infinite where the reduced model fails
    bands: tuple[Prediction, ...] = ()
    runs: int = 0  #: full ones, with checks

    @property
    def held(self) -> float:
        """Part of the true errors that lie below the upper ends of their bands."""
        return float(
            np.mean([e <= band.high for e, band in zip(self.true, self.bands, strict=True)])
        )

    @property
    def verdict(self) -> str:
        return "no promise" if self.doubts else "ok" if self.held >= HELD else "broken"

    @property
    def row(self) -> str:
        """Bands and true errors in a line of a table."""
        if not self.bands:
            return f"{self.verdict}: {self.doubts[0]}"
        high = np.array([band.high for band in self.bands])
        wide = float(np.median(np.log10([band.high / band.low for band in self.bands])))
        ends = f"true {self.true.min():.1e} to {self.true.max():.1e}, upper ends {high.min():.1e} to {high.max():.1e}"
        counts = f"{wide:.1f} decades, {self.held:.0%} held, {self.runs} full runs"
        return f"{self.verdict:10s} {ends}, {counts}  {'; '.join(self.doubts)}"


def trained(name: str) -> FinishedTraining:
    """The training of a scene whose sections `reduction` and `training` have the defaults, with
    snapshots at every step.
    """
    family, chosen = FAMILIES[name], sections.Training()
    known = family.parameters
    nominal = family(boxes.completed(known, {}))
    plan = Plan({span[0]: (span[0],) for span in nominal.system.coordinates}, hyper=Points())
    task = TrainingTask(family, known, plan, nominal.scheme.step, measure=OutputMeasure())
    where = points.of(chosen, known)
    search = training.search(known, where.candidates, where.samples, where.first)
    options = greedy.Options(
        iterations=chosen.iterations, max_samples=chosen.max_samples, seed=chosen.seed
    )
    return training.train(
        task, search, options, None, family.tolerance, savable=True, checks=training.CHECKS
    )


@functools.cache
def tried(name: str) -> Trial:
    """A family trained, and its prediction as the saved model gives it beside true errors at random
    points.
    """
    family = FAMILIES[name]
    try:
        found = trained(name)
    except NoModel as refused:
        return Trial([str(refused)], np.empty(0))
    runs = len(found.full_runs)
    doubts = prediction.doubts(
        runs,
        found.predicted,
        [],
        [],
        family.tolerance,
        sum(run.unresolved for run in found.full_runs),
    )
    predict = prediction.predictor(
        ParametricModel(found.model.parametric, {prediction.KEY: prediction.record(found)})
    )
    assert predict is not None
    box = np.random.default_rng(zlib.crc32(name.encode())).random((POINTS, len(family.parameters)))
    corners = (
        boxes.grid(family.parameters, 2)
        if len(family.parameters) > 1
        else boxes.table(family.parameters, np.empty((0, 1)))
    )
    rows = np.concatenate([boxes.from_box(family.parameters, box), corners])
    where = [boxes.named(family.parameters, row) for row in rows]
    errors = np.array([error(found, values) for values in where])
    moving = np.flatnonzero(~np.isnan(errors))
    return Trial(doubts, errors[moving], tuple(predict(where[k]) for k in moving), runs)


def error(found: FinishedTraining, values: Mapping[str, float]) -> float:
    """The largest error of an output as a part of its range; infinite where the reduced model
    fails, NaN without a full motion.
    """
    task = reduced_models.with_polynomials(found.task)
    try:
        run = full_runs.full_run(task, values)
    except SolverError:
        return math.nan
    try:
        motion = full_runs.run_formed(task, found.model.cases(values))
    except SolverError:
        return math.inf
    return full_runs.wanted_error(task, task.family(values).system, run, motion)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("name", NAMES)
def test_a_promised_band_holds(name: str) -> None:
    found = tried(name)
    sys.stdout.write(f"\n{name:38s} {found.row}\n")
    assert found.verdict != "broken"


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_most_families_get_a_promise() -> None:
    """A training that promises nothing is honest, too."""
    verdicts = [tried(name).verdict for name in NAMES]
    sys.stdout.write(f"\n{Counter(verdicts)}\n")
    assert verdicts.count("ok") >= PROMISED * len(NAMES)
