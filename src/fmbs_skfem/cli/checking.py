"""Hold-out points of a training: true errors of the model after every full run and of comparators, beside the predicted ones.

The full runs at hold-out points are stored with the training, so that another call has them. Figures 13 and 14 of
doi 10.1016/j.cma.2019.112690 are `errors.png`.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import FmbsError
from ..core.notices import notify
from ..reduction import comparators, full_runs, parameters, prediction, reduced_models
from ..reduction import training_store as store
from ..reduction.comparators import Comparator, Row
from ..reduction.full_runs import Full
from . import screen

if TYPE_CHECKING:
    from rich.table import Table

    from ..reduction.full_runs import FullRun
    from ..reduction.greedy import Iteration
    from ..reduction.output_errors import OutputError
    from ..reduction.parametric_model import ParametricModel
    from ..reduction.prediction import Prediction
    from ..reduction.training import Training
    from ..results.training_plots import Panel
    from .train import Job

SURROGATE, ERRORS, PREDICTED = "surrogate.png", "errors.png", "predicted.png"
CORNERS = 3  #: parameters up to which local bases are made at all corners of the box


@dataclass(frozen=True)
class Checked:
    """Hold-out points with what was found there."""

    points: np.ndarray  #: (k, d)
    rows: tuple[Row, ...]  #: the models after every full run, then comparators
    models: int  #: how many of the rows are models of this training
    predictions: tuple[Prediction, ...]  #: of the last model

    @property
    def last(self) -> Row:
        """The last model."""
        return self.rows[self.models - 1]

    @property
    def true(self) -> np.ndarray:
        """Errors (k,) of the last model; NaN where the full model has no motion."""
        return np.array([trial.error for trial in self.last.trials])

    @property
    def known(self) -> np.ndarray:
        """Numbers (j,) of the points at which the full model has a motion."""
        return np.flatnonzero(~np.isnan(self.true))

    @property
    def inside(self) -> float | None:
        """Part of the points whose true error lies in the predicted band; None where nothing is predicted or known."""
        if not self.predictions or not len(self.known):
            return None
        return float(np.mean([self.predictions[k].low <= self.true[k] <= self.predictions[k].high for k in self.known]))


def check(job: Job, found: Training, model: ParametricModel, out: Path, compare: bool) -> Checked:
    """All hold-out points; comparators are trained where they are wanted."""
    task, points = found.task, job.points.holdout
    full, predict = stored(found, out), prediction.predictor(model)
    everyone = [*stages(found), *(others(job, found, full) if compare else ())]
    with screen.progress("hold-out points") as advance:
        rows = comparators.compare(task, everyone, full, points, advance)
    predictions = tuple(predict(parameters.named(task.parameters, row)) for row in points) if predict else ()
    return Checked(points, rows, len(found.models), predictions)


def stored(found: Training, out: Path, sharp: bool = True) -> Full:
    """Full runs that are read from the training's folder where they are there, and kept there.

    `sharp`: iterated as snapshots need it; otherwise as the scene says, which is less work where nothing is trained on them.
    """
    folder = out / "training"

    def full(values: Mapping[str, float]) -> FullRun:
        for run in (*found.runs, *found.checks):
            if run.values == values:
                return run
        text = repr((sorted(values.items()), found.task.plan.tolerance, found.task.plan.modes))
        path = folder / f"{'full' if sharp else 'own'}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.h5"
        return store.made(path, functools.partial(full_runs.full_run, found.task, values, sharp))

    return full


def stages(found: Training) -> Iterator[Comparator]:
    """The model after every full run."""
    for k, model in enumerate(found.models, start=1):
        offline = sum(run.cpu_s for run in found.runs[:k]) + sum(one.training_s for one in found.models[:k])
        evaluated = sum(len(iteration.samples) for iteration in found.outcome.iterations[:k])
        family = functools.partial(reduced_models.case_at, model)
        yield Comparator(f"greedy {k}", family, k, offline, evaluated)


def others(job: Job, found: Training, full: Full) -> Iterator[Comparator]:
    """The comparators; one that cannot be trained is told and left out."""
    task, d = found.task, len(found.task.parameters)
    counts = (max(2, len(found.runs)),) if d == 1 else (2,) * d
    makers: dict[str, Callable[[], Comparator]] = {
        "fast to slow": lambda: comparators.fast_to_slow(task, full, fastest(found)),
        "uniform grid": lambda: comparators.uniform(task, full, counts),
        "nearest basis": lambda: comparators.nearest(task, full, counts),
        "Grassmann": lambda: comparators.interpolated(task, full, counts),
        "greedy, system level": lambda: comparators.greedy(
            comparators.at_system_level(task), job.search, job.options, "greedy, system level"
        ),
    }
    for name, make in makers.items():
        if d > CORNERS and name in ("uniform grid", "nearest basis", "Grassmann"):
            continue
        try:
            with screen.progress(name):
                yield make()
        except FmbsError as error:
            notify(f"comparator '{name}': {error}")


def fastest(found: Training) -> dict[str, float]:
    """The corner of the box at which the reduced model moves fastest."""
    from ..dynamics.outputs import lifted

    known = found.task.parameters
    speeds: list[tuple[float, dict[str, float]]] = []
    for ends in itertools.product(*((p.low, p.high) for p in known)):
        values = parameters.named(known, ends)
        motion = reduced_models.reduced_run(found.task, reduced_models.case_at(found.model, values))
        speeds.append((float(np.linalg.norm(lifted(motion)[1], axis=1).max()), values))
    return max(speeds, key=lambda pair: pair[0])[1]


def failed(job: Job, checked: Checked) -> list[dict[str, Any]]:
    """The points at which the full model has no motion, with the reason."""
    known, trials = job.task.parameters, checked.last.trials
    lost = np.flatnonzero(np.isnan(checked.true))
    return [{"point": parameters.named(known, checked.points[k]), "reason": trials[k].reason} for k in lost]


def report_of(job: Job, checked: Checked) -> dict[str, Any]:
    """Hold-out points in the report."""
    return {
        "points": checked.points,
        "true": checked.true,
        "states": [trial.states for trial in checked.last.trials],
        "predicted": [asdict(prediction) for prediction in checked.predictions],
        "inside": checked.inside,
        "max_error": checked.last.max_error,
        "failed": failed(job, checked),
        "outputs": largest_of_outputs(checked),
        "outputs_at_points": [{name: one.relative for name, one in trial.outputs.items()} for trial in checked.last.trials],
        "rows": [
            {**{key: value for key, value in asdict(row).items() if key != "trials"}, "errors": [one.error for one in row.trials]}
            for row in checked.rows
        ],
    }


def largest_of_outputs(checked: Checked) -> dict[str, dict[str, Any]]:
    """For every output column of the last model the error at the hold-out point where it is the largest part of its range."""
    found: dict[str, OutputError] = {}
    for trial in checked.last.trials:
        for name, one in trial.outputs.items():
            if name not in found or not weight(one) <= weight(found[name]):
                found[name] = one
    return {name: asdict(one) for name, one in found.items()}


def weight(error: OutputError) -> float:
    """What errors of one column are compared by."""
    return error.error if math.isnan(error.relative) else error.relative


def table(checked: Checked, measure: str) -> Table:
    """Every model with its full and reduced runs, sizes, errors at the hold-out points and CPU times."""
    inside = "" if checked.inside is None else f", {100 * checked.inside:.0f} % of true errors inside the predicted band"
    points = (
        f"{len(checked.known)} of {len(checked.points)}" if len(checked.known) < len(checked.points) else f"{len(checked.points)}"
    )
    runs, costs = ("model", "full", "reduced", "modes", "elements", "points"), ("offline [s]", "prepare [ms]", "run [s]")
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
    return screen.table(title, (*runs, "max error", "mean error", *costs), rows)


def draw(job: Job, found: Training, checked: Checked | None, out: Path) -> list[Path]:
    """surrogate.png; with hold-out points errors.png and predicted.png."""
    from ..results import sweep_files
    from ..results import training_plots as plots

    known = found.task.parameters
    labels = [sweep_files.headed(p.name, p.unit) for p in known]
    columns = {label: found.search.candidates[:, k] for k, label in enumerate(labels)}
    panels = [panel(iteration, found.outcome.points[: iteration.number]) for iteration in found.outcome.iterations]
    files = [plots.surrogate(out / SURROGATE, columns, panels, "indicator (49)")]
    if checked is None or not len(checked.known):
        return files
    true, used = checked.true[checked.known], checked.known
    errors = {row.name: np.array([row.trials[k].error for k in used]) for row in checked.rows}
    places, label = checked.points[used, 0], labels[0]
    if len(known) > 1:
        places, label = np.argsort(np.argsort(true)) + 1.0, "hold-out point, by its error"
    files.append(plots.errors_over(out / ERRORS, places, errors, label, job.measure, job.tolerance))
    if checked.predictions:
        predicted, low, high = np.array([(p.error, p.low, p.high) for p in checked.predictions])[used].T
        files.append(plots.predicted(out / PREDICTED, true, predicted, low, high, job.tolerance, job.measure))
    return files


def panel(iteration: Iteration, runs: tuple[int, ...]) -> Panel:
    """The surrogate after an iteration as a figure shows it."""
    from ..results.training_plots import Panel

    title = f"{iteration.number} full run{'s' if iteration.number > 1 else ''}"
    samples, indicators = np.array(iteration.samples), np.array(iteration.indicators)
    return Panel(title, iteration.mean, iteration.std, samples, indicators, iteration.next, runs)
