"""A trained model at points that its training has not seen."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from fmbs_skfem.families import calibration, trials
from fmbs_skfem.families.training import FinishedTraining
from fmbs_skfem.families.trials import Comparator
from fmbs_skfem.reduction import full_runs, parameters, reduced_models
from fmbs_skfem.reduction.full_runs import Full, TrainingTask
from fmbs_skfem.reduction.reduced_models import ReducedModel


class HeldOut(NamedTuple):
    """Largest true error, indicators (k,), and the part of the true errors in the band that their
    indicators predict.
    """

    largest: float
    indicators: np.ndarray
    inside: float


def hold_out(
    found: FinishedTraining,
    points: np.ndarray,
    model: ReducedModel | None = None,
    full: Full | None = None,
) -> HeldOut:
    """The last model of a training, or another one of it, at points (k, d) with full runs, which
    several may share.
    """
    task, used = reduced_models.with_polynomials(found.task), model or found.model
    one = Comparator("model", used.cases, len(found.runs), 0.0)
    (row,) = trials.compare(
        task, [one], full or functools.partial(full_runs.full_run, found.task), points
    )
    indicators, inside = [], []
    assert found.calibration is not None
    for values, trial in zip(
        (parameters.named(task.parameters, point) for point in points), row.trials, strict=True
    ):
        motion = full_runs.run_formed(task, used.cases(values))
        indicators.append(reduced_models.indicator(task, motion, values))
        _, low, high = calibration.predict(found.calibration, indicators[-1])
        inside.append(low <= trial.error <= high)
    return HeldOut(row.max_error, np.array(indicators), float(np.mean(inside)))


def share_runs(task: TrainingTask) -> Full:
    """Full runs that are made once however often they are asked for."""
    cached = functools.cache(
        lambda row: full_runs.full_run(task, parameters.named(task.parameters, row))
    )
    return lambda values: cached(tuple(parameters.row_of(task.parameters, values).tolist()))
