"""Hold-out points: full runs that no training has seen, beside what the reduced model and its calibration say there.

The error is that of the displacements (`full_runs.error`), predicted from the indicator (49) of the reduced run itself, doi
10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, SolverError, say
from . import calibration, full_runs
from . import parameters as boxes
from .full_runs import FullRun, TrainingTask, full_run
from .reduced_models import ReducedModel, case_at, indicator, quick, reduced_run
from .training import Training


@dataclass(frozen=True)
class Holdout:
    """True and predicted errors of a reduced model; infinite where the reduced run fails."""

    points: np.ndarray  #: (k, d) values of the parameters
    indicators: np.ndarray  #: (k,)
    errors: np.ndarray  #: (k,)
    predicted: np.ndarray  #: (k,)
    low: np.ndarray  #: (k,) ends of the band
    high: np.ndarray  #: (k,)
    run_s: np.ndarray  #: (k,) CPU time of the reduced runs [s]

    @property
    def largest(self) -> float:
        """Largest true error."""
        return float(self.errors.max())

    @property
    def inside(self) -> float:
        """Part of the points whose true error lies in the band."""
        return float(np.mean((self.low <= self.errors) & (self.errors <= self.high)))


def truths(task: TrainingTask, points: ArrayLike, progress: Callable[[float], None] | None = None) -> tuple[FullRun, ...]:
    """Full runs at points (k, d); a point at which the full model has no motion is left out with a notice."""
    found: list[FullRun] = []
    rows, full = boxes.table(task.parameters, points), functools.partial(full_run, task)
    for number, row in enumerate(rows):
        run = full_runs.reached(task, full, boxes.named(task.parameters, row))
        found += [run] if isinstance(run, FullRun) else []
        if progress:
            progress((number + 1) / len(rows))
    return tuple(found)


def holdout(training: Training, runs: Sequence[FullRun], model: ReducedModel | None = None) -> Holdout:
    """The last model of a training, or another one of it, at full runs."""
    if not runs:
        raise InputError(say("holdout", "at least one full run", "none", "make them with holdout.truths"))
    task = quick(training.task)
    found = np.array([measured(task, model or training.model, run) for run in runs])
    if training.calibration is None:
        raise InputError(say("holdout", "a training over parameters", "one without"))
    bands = np.array([calibration.predict(training.calibration, value) for value in found[:, 0]])
    points = np.array([boxes.row_of(task.parameters, run.values) for run in runs])
    predicted, low, high = bands.T
    return Holdout(points, found[:, 0], found[:, 1], predicted, low, high, found[:, 2])


def measured(task: TrainingTask, model: ReducedModel, run: FullRun) -> tuple[float, float, float]:
    """Indicator, error and CPU time of a reduced model at a full run."""
    try:
        motion = reduced_run(task, case_at(model, run.values))
    except SolverError:
        return math.inf, math.inf, math.nan
    raw = task.family(run.values).system
    error = full_runs.wanted_error(task, raw, run, motion)
    return indicator(task, motion, run.values), error, motion.statistics.cpu_s
