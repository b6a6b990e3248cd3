"""Hold-out points of a training: true errors of the model after every full run, beside the
predicted ones.

The full runs at hold-out points are stored with the training, so that another call has them.
Figures 13 and 14 of doi 10.1016/j.cma.2019.112690 are its figure `errors`.
"""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.storage.records import dataclass
from ..core.values.display import DisplayUnits
from ..core.values.units import add_unit
from ..families import prediction, trials
from ..families import training_store as store
from ..families.trials import Row
from ..reduction import full_runs, parameters
from ..reduction.full_runs import Full, TrainingTask
from ..reduction.training_signals import Signals
from ..results import plots, training_plots
from ..results.training_plots import SurrogatePanel
from .job import Job
from .result import Figures, ReportTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..families.calibration import Prediction
    from ..families.greedy import Iteration
    from ..families.parametric_model import ParametricModel
    from ..families.training import FinishedTraining
    from ..reduction.accuracy.output_errors import OutputError
    from ..reduction.full_runs import FullRun
    from .planning.training_order import TrainingOrder

SAME = 1e-9  #: of the sides of a box, up to which two points are one
CORNERS = 3  #: parameters up to which local bases are made at all corners of the box


@dataclass(frozen=True)
class Checked:
    """Hold-out points with what was found there."""

    points: np.ndarray  #: (k, d)
    rows: tuple[Row, ...]  #: the models after every full run
    predictions: tuple[Prediction, ...]  #: of the last model

    @property
    def last(self) -> Row:
        """The last model."""
        return self.rows[-1]

    @property
    def true(self) -> np.ndarray:
        """Errors (k,) of the last model; NaN where the full model has no motion."""
        return np.array([trial.error for trial in self.last.trials])

    @property
    def known(self) -> np.ndarray:
        """Numbers (j,) of the points at which the full model has a motion."""
        return np.flatnonzero(~np.isnan(self.true))

    @property
    def full_s(self) -> float:
        """CPU time [s] of a full run, the median of the points at which the last model has a motion
        as well.
        """
        return trials.median([trial.full_s for trial in self.last.trials])

    @property
    def inside(self) -> float | None:
        """Part of the points whose true error lies in the predicted band; None where nothing is
        predicted or known.
        """
        if not self.predictions or not len(self.known):
            return None
        return float(
            np.mean(
                [
                    self.predictions[k].low <= self.true[k] <= self.predictions[k].high
                    for k in self.known
                ]
            )
        )


def check(
    job: Job, order: TrainingOrder, found: FinishedTraining, model: ParametricModel
) -> Checked:
    """The models of a training at all hold-out points.

    Inputs of a plant have signals there that no training has.
    """
    task = found.task
    points = order.points.holdout
    if isinstance(task.signals, Signals):
        task = replace(task, signals=task.signals.check)
    full = read_or_run(found, task, job.made)
    predict = prediction.predictor(model)
    rows = trials.compare(
        task, [*trials.stages(found)], full, points, job.progress("hold-out points")
    )
    predictions = (
        tuple(predict(parameters.named(task.parameters, row)) for row in points) if predict else ()
    )
    return Checked(points, rows, predictions)


def read_or_run(
    found: FinishedTraining, task: TrainingTask, out: Path | None, sharp: bool = True
) -> Full:
    """Full runs of a task, that of the training or the same with other signals.

    They are read from the training's folder where they are there, and kept there; without one in
    memory. `sharp`: iterated as snapshots need it; otherwise as the scene says, which is less work
    where nothing is trained on them.
    """
    known = list(found.full_runs) if task is found.task else []

    def full(values: Mapping[str, float]) -> FullRun:
        for run in known:
            if run.values == values:
                return run
        if out is None:
            known.append(full_runs.full_run(task, values, sharp))
            return known[-1]
        signals = () if task.signals is None else (task.signals,)
        text = repr((sorted(values.items()), task.plan.tolerance, task.plan.modes, *signals))
        name = "full-" if sharp else "own-"
        number = int(hashlib.sha256(text.encode()).hexdigest()[:16], 16)
        make = functools.partial(full_runs.full_run, task, values, sharp)
        return store.read_or_make(store.store_of(out / "training"), name, number, make)

    return full


def trained_there(order: TrainingOrder, found: FinishedTraining) -> list[str]:
    """A sentence on hold-out points that are full runs of the training as well, as few candidates
    over one parameter make them.
    """
    known = order.task.parameters
    points = order.points.holdout
    runs = parameters.to_box(
        known, [parameters.row_of(known, run.values) for run in (*found.runs, *found.checks)]
    )
    count = sum(
        bool((np.abs(runs - point).max(axis=1) < SAME).any())
        for point in parameters.to_box(known, points)
    )
    if not count:
        return []
    text = f"{count} of the {len(points)} hold-out points are full runs of the training as well"
    return [f"{text}, where errors are small: name others in training.holdout."]


def list_failed(order: TrainingOrder, checked: Checked) -> list[dict[str, Any]]:
    """The points at which the full model has no motion, with the reason."""
    known = order.task.parameters
    trials = checked.last.trials
    lost = np.flatnonzero(np.isnan(checked.true))
    return [
        {"point": parameters.named(known, checked.points[k]), "reason": trials[k].reason}
        for k in lost
    ]


def report_of(order: TrainingOrder, checked: Checked) -> dict[str, Any]:
    """Hold-out points in the report."""
    return {
        "points": checked.points,
        "true": checked.true,
        "states": [trial.states for trial in checked.last.trials],
        "predicted": [prediction._asdict() for prediction in checked.predictions],
        "inside": checked.inside,
        "max_error": checked.last.max_error,
        "failed": list_failed(order, checked),
        "outputs": largest_of_outputs(checked),
        "outputs_at_points": [
            {name: one.relative for name, one in trial.outputs.items()}
            for trial in checked.last.trials
        ],
        "rows": [
            {
                **{key: value for key, value in asdict(row).items() if key != "trials"},
                "errors": [one.error for one in row.trials],
            }
            for row in checked.rows
        ],
    }


def largest_of_outputs(checked: Checked) -> dict[str, dict[str, Any]]:
    """For every output column of the last model the error at the hold-out point where it is the
    largest part of its range.
    """
    found: dict[str, OutputError] = {}
    for trial in checked.last.trials:
        for name, one in trial.outputs.items():
            if name not in found or not weight(one) <= weight(found[name]):
                found[name] = one
    return {name: asdict(one) for name, one in found.items()}


def weight(error: OutputError) -> float:
    """What errors of one column are compared by."""
    return error.error if math.isnan(error.relative) else error.relative


def table(checked: Checked, measure: str) -> ReportTable:
    """Every model with its full and reduced runs, sizes, errors at the hold-out points and CPU
    times.
    """
    inside = (
        ""
        if checked.inside is None
        else f", {100 * checked.inside:.0f} % of true errors inside the predicted band"
    )
    points = (
        f"{len(checked.known)} of {len(checked.points)}"
        if len(checked.known) < len(checked.points)
        else f"{len(checked.points)}"
    )
    runs = ("model", "full", "reduced", "modes", "elements", "cubature points")
    costs = ("offline [s]", "prepare [ms]", "run [s]")
    rows = [
        (
            row.name,
            row.full_runs,
            row.reduced_runs,
            " + ".join(str(count) for count in row.modes.values()),
            row.elements or "-",
            row.points or "-",
            f"{row.max_error:.2e}",
            f"{row.mean_error:.2e}",
            f"{row.offline_s:.3g}",
            f"{1e3 * row.prepare_s:.3g}",
            f"{row.run_s:.3g}",
        )
        for row in checked.rows
    ]
    title = f"{measure[:1].upper()}{measure[1:]} at {points} hold-out points{inside}"
    return ReportTable(title, (*runs, "max error", "mean error", *costs), rows)


def figures(order: TrainingOrder, found: FinishedTraining, checked: Checked | None) -> Figures:
    """The surrogate; with hold-out points the errors there, and beside the predicted ones."""
    rules: dict[str, Callable[[], Figure]] = {
        "surrogate": functools.partial(surrogate, found, order.scene.display)
    }
    if checked is None or not len(checked.known):
        return Figures(rules)
    known = found.task.parameters
    true = checked.true[checked.known]
    used = checked.known
    errors = {row.name: np.array([row.trials[k].error for k in used]) for row in checked.rows}
    places = checked.points[used, 0]
    label = add_unit(known[0].name, known[0].unit)
    if len(known) > 1:
        places = np.argsort(np.argsort(true)) + 1.0
        label = "hold-out point, by its error"
    rules["errors"] = functools.partial(
        plots.errors,
        places,
        errors,
        order.measure,
        label,
        order.tolerance,
        "tolerance",
        order.scene.display,
    )
    if checked.predictions:
        bands = np.array(checked.predictions)[used].T
        rules["predicted"] = functools.partial(
            training_plots.predicted,
            true,
            bands[0],
            bands[1],
            bands[2],
            order.tolerance,
            order.measure,
        )
    return Figures(rules)


def surrogate(found: FinishedTraining, display: DisplayUnits) -> Figure:
    """The surrogate of the indicator after every iteration, with its samples."""
    columns = {}
    for own, values in zip(found.task.parameters, found.search.candidates.T, strict=True):
        label, size = display.head(add_unit(own.name, own.unit), values)
        columns[label] = values / size
    panels = [
        panel(iteration, found.outcome.points[: iteration.number])
        for iteration in found.outcome.iterations
    ]
    return training_plots.surrogate(columns, panels, "indicator (49)")


def panel(iteration: Iteration, runs: tuple[int, ...]) -> SurrogatePanel:
    """The surrogate after an iteration as a figure shows it."""
    title = f"{iteration.number} full run{'s' if iteration.number > 1 else ''}"
    samples, indicators = np.array(iteration.samples), np.array(iteration.indicators)
    return SurrogatePanel(
        title, iteration.mean, iteration.std, samples, indicators, iteration.next, runs
    )
