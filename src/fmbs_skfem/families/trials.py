"""Errors of reduced models of a family at hold-out points, each model a row: full runs, modes, cost
and errors.
"""

from __future__ import annotations

import contextlib
import math
import time as clock
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ..core.errors import FmbsError, InputError, say
from ..core.notices import Notice, Progress
from ..core.storage.records import dataclass
from ..reduction import full_runs, parameters, reduced_models
from ..reduction.accuracy.output_errors import OutputError
from ..reduction.cases import Family
from ..reduction.full_runs import Full, FullRun, TrainingTask
from ..reduction.hyper import sampling
from ..systems.system import System
from .training import FinishedTraining


@dataclass(frozen=True)
class Comparator:
    """A family of reduced cases and what it took to make it.

    `family(values)` makes its reduced case at the values of the parameters; `offline_s` has the CPU
    time of the full runs in it.
    """

    name: str
    family: Family
    full_runs: int
    offline_s: float  #: CPU time of the training with its full runs [s]
    reduced_runs: int = 0  #: in the training


@dataclass(frozen=True)
class Trial:
    """A reduced run beside its full run; one that fails has a reason and the error infinity, or NaN
    where the full run fails.
    """

    error: float = math.inf  #: in the measure of the task
    states: float = math.inf  #: of the displacements, `full_runs.error`
    modes: Mapping[str, int] = field(default_factory=dict)  #: by component
    elements: int = 0  #: cells in use; 0 for the exact polynomial
    points: int = 0  #: quadrature points in use
    prepare_s: float = math.nan  #: CPU time from parameters to the reduced system [s]
    run_s: float = math.nan  #: CPU time of the reduced run [s]
    full_s: float = math.nan  #: of the full run
    reason: str = ""
    outputs: Mapping[str, OutputError] = field(default_factory=dict)  #: errors by column


@dataclass(frozen=True)
class Row:
    """A comparator at the hold-out points with a full run: sizes of its largest member, medians of
    its times.

    `trials` are in the order of the points; points without a full run count in no number of the
    row.
    """

    name: str
    full_runs: int
    reduced_runs: int
    modes: Mapping[str, int]
    elements: int
    points: int
    max_error: float
    mean_error: float
    offline_s: float
    prepare_s: float
    run_s: float
    trials: tuple[Trial, ...]


def compile_training(task: TrainingTask) -> None:
    """Compile what training and runs call, so that no comparator is charged for it.

    A task with a duration of three steps is trained and run once; what fails there is not told.
    """
    values = parameters.completed(task.parameters, {})
    case = task.family(values)
    short = replace(case, duration=3 * case.scheme.step)
    few = replace(task, family=lambda _: short, interval=case.scheme.step)
    with (
        contextlib.suppress(FmbsError),
        warnings.catch_warnings(),
    ):  # the comparators themselves say what fails
        warnings.simplefilter("ignore", Notice)
        model = reduced_models.make_model(few, [full_runs.full_run(few, values)])
        motion = full_runs.run_formed(few, model.cases(values))
        reduced_models.indicator(few, motion, values)


def stages(found: FinishedTraining) -> Iterator[Comparator]:
    """The models of a training after every full run.

    `greedy 1`, `greedy 2`, ..., each with the cost of all that came before it.
    """
    for k, model in enumerate(found.models, start=1):
        offline = sum(run.cpu_s for run in found.runs[:k]) + sum(
            one.training_s for one in found.models[:k]
        )
        evaluated = sum(len(iteration.samples) for iteration in found.outcome.iterations[:k])
        yield Comparator(f"greedy {k}", model.cases, k, offline, evaluated)


def compare(
    task: TrainingTask,
    comparators: Sequence[Comparator],
    full: Full,
    points: np.ndarray,
    progress: Progress | None = None,
) -> tuple[Row, ...]:
    """Every comparator at the hold-out points (k, d), values in the order of the parameters.

    A point at which the full model has no motion is marked, with a notice, and the others go on.
    """
    rows = parameters.table(task.parameters, points)
    if len(rows) == 0 or len(comparators) == 0:
        raise InputError(
            say(
                "trials.compare",
                "comparators and hold-out points",
                f"{len(comparators)} and {len(rows)}",
            )
        )
    tried: list[list[Trial]] = [[] for _ in comparators]
    for number, row in enumerate(rows):
        found = try_all(task, comparators, full, parameters.named(task.parameters, row))
        for trials, one in zip(tried, found, strict=True):
            trials.append(one)
        if progress:
            progress((number + 1) / len(rows))
    return tuple(
        collect(comparator, trials) for comparator, trials in zip(comparators, tried, strict=True)
    )


def try_all(
    task: TrainingTask, comparators: Sequence[Comparator], full: Full, values: Mapping[str, float]
) -> list[Trial]:
    """Every comparator at one point."""
    truth = full_runs.try_run(task, full, values)
    if isinstance(truth, str):
        return [Trial(math.nan, reason=truth)] * len(comparators)
    raw = task.family(values).system
    return [try_one(task, comparator, raw, truth) for comparator in comparators]


def try_one(task: TrainingTask, comparator: Comparator, raw: System, truth: FullRun) -> Trial:
    """The reduced member against a full run, of which `raw` is the system."""
    begun = clock.process_time()
    made = Trial()
    try:
        case = comparator.family(truth.values)
        made = replace(measure_sizes(case.system), prepare_s=clock.process_time() - begun)
        motion = full_runs.run_formed(task, case)
    except FmbsError as error:
        return replace(made, reason=str(error))
    outputs = full_runs.errors_of_outputs(raw, truth, motion)
    errors = (
        full_runs.wanted_error(task, raw, truth, motion),
        full_runs.error(task, raw, truth, motion),
    )
    return replace(
        made,
        error=errors[0],
        states=errors[1],
        outputs=outputs,
        run_s=motion.statistics.cpu_s,
        full_s=truth.cpu_s,
    )


def measure_sizes(system: System) -> Trial:
    """Modes, cells and points of a reduced system."""
    return Trial(
        modes=system.modes,
        elements=sum(cells for cells, _ in sampling.kept(system).values()),
        points=sum(points for _, points in sampling.kept(system).values()),
    )


def collect(comparator: Comparator, trials: Sequence[Trial]) -> Row:
    """All trials of a comparator in one row."""
    names = dict.fromkeys(name for one in trials for name in one.modes)
    found = np.array([one.error for one in trials if not math.isnan(one.error)])
    return Row(
        comparator.name,
        comparator.full_runs,
        comparator.reduced_runs,
        {name: max(one.modes.get(name, 0) for one in trials) for name in names},
        max(one.elements for one in trials),
        max(one.points for one in trials),
        float(found.max()) if len(found) else math.nan,
        float(found.mean()) if len(found) else math.nan,
        comparator.offline_s,
        median([one.prepare_s for one in trials]),
        median([one.run_s for one in trials]),
        tuple(trials),
    )


def median(seconds: Sequence[float]) -> float:
    """Median of the times that were taken; NaN where none was."""
    taken = [value for value in seconds if math.isfinite(value)]
    return float(np.median(taken)) if taken else math.nan
