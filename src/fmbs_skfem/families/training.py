r"""Training of a reduced model: of one system, or of a box of parameters by greedy choice of its
full runs.

    full run at mu -> model of all runs so far -> I(mu) of reduced runs -> the next mu, where it is largest               (49)

Before the checks a survey fills the samples of the last iteration up to `max_samples`, each as far
as possible from the others: greedy looks for the maximum of I, and a surrogate of what it has seen
there is too sure elsewhere. Where a wanted error is not reached after all, greedy goes on. A wanted
error chooses eps and eta at the first full run (`error_budget`); training then ends when the
predicted error, with its band, is below it, or with the first model that keeps a part of it at full
runs which are not in the model, one of them where the indicator is largest. Where truncation is the
limit before that, eps is lowered and the runs that exist serve once more. A model with nearly as
many unknowns as the full one ends the training: it does not pay. One system is the task without
parameters: one full run, and nothing to choose.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import Progress
from ..core.storage import durable
from ..core.storage.records import dataclass
from ..dynamics.trajectory import Trajectory
from ..reduction import full_runs
from ..reduction import parameters as boxes
from ..reduction.accuracy import error_budget
from ..reduction.accuracy.error_budget import BudgetChoice
from ..reduction.full_runs import FullRun, TrainingTask
from ..reduction.parameters import Search, search
from ..reduction.reduced_models import ReducedModel, make_model, with_polynomials
from . import calibration, greedy
from . import training_store as store
from .calibration import NOTHING, Calibration, Prediction
from .greedy import Enrichment, GreedyProblem, Iteration, Options, StopReason
from .training_store import Pair
from .training_work import (
    LOWER_EPS,
    LOWERINGS,
    TrainingState,
    calibrate,
    check,
    evaluate,
    extend,
    known_pairs,
    lower,
    make_savable,
    pays,
    proved,
    recalibrate,
    require_worth,
    take_choice,
    truncates,
    unit_box,
    unseen,
    values_at,
)

__all__ = ["CHECKS", "Options", "Search", "FinishedTraining", "search", "train"]

LIMITS = (StopReason.FLOOR, StopReason.REPEATED)
CHECKS = 2  #: that trainings of scenes make
ROOM = "make room, then train again with this folder: what is complete is not run again"
NOWHERE = Search(np.zeros((1, 0)), (), 0)


@dataclass(frozen=True)
class FinishedTraining:
    """A training that has ended.

    `model` is what it was made for, `outcome` the greedy choice of its full runs, `predicted` the
    largest error over all candidates with its band.
    """

    task: TrainingTask  #: with the plan of the model
    search: Search
    outcome: Enrichment
    last: Iteration  #: of the outcome, with the samples of the survey
    runs: tuple[FullRun, ...]
    models: tuple[ReducedModel, ...]  #: after every full run
    choice: BudgetChoice | None = None  #: of a wanted error
    pairs: tuple[Pair, ...] = ()
    calibration: Calibration | None = None  #: None where there are no parameters
    lowered: int = 0  #: how often eps was lowered because it was the limit
    discarded: int = 0  #: reduced runs of iterations before that
    checks: tuple[FullRun, ...] = ()  #: full runs that calibrate the last model without being in it

    @property
    def model(self) -> ReducedModel:
        return self.models[-1]

    @property
    def reduced_runs(self) -> int:
        """Reduced runs of the greedy loop; those of the survey and at full runs serve the
        prediction and are not among them.
        """
        return self.outcome.evaluations + self.discarded

    @property
    def full_runs(self) -> tuple[FullRun, ...]:
        """Those of the model, and those that calibrate it."""
        return (*self.runs, *self.checks)

    @property
    def predicted(self) -> Prediction:
        """Predicted largest error over the candidates, with its band; NaN where there are no
        parameters.
        """
        return (
            NOTHING
            if self.calibration is None
            else calibration.predict(self.calibration, self.last.largest)
        )


def train(
    task: TrainingTask,
    search: Search | None = None,
    options: Options | None = None,
    folder: Path | str | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
    savable: bool = False,
    checks: int = 0,
    proofs: int = 0,
    aim: float = 1.0,
    motion: Trajectory | None = None,
    must_pay: bool = False,
) -> FinishedTraining:
    """Train a reduced model of one system, or over the candidates of a search.

    A task without parameters has one full run: its `motion`, where that is there already, with the
    snapshots among its states.

    With a `folder` every run, model and iteration is stored, and a training that was interrupted,
    or is given more iterations, goes on from there. `tolerance` is the wanted error in the measure
    of the task: it replaces eps and eta of the plan and ends the training. With `savable` it ends
    with NoModel at the first full run where the model is no polynomial of the parameters: a file
    holds nothing else. After the last iteration so many `checks` calibrate the error that is
    predicted. With `proofs` a training to a `tolerance` ends with the first model that errs by at
    most `aim` of it at so many full runs that are not in it, one of them where its indicator is
    largest. One that `must_pay` ends with DoesNotPay as soon as it is known that no model can be
    faster than the full one, see `worth`.
    """
    if not task.parameters:
        return train_alone(task, tolerance, motion)
    if search is None:
        raise InputError(
            say("train", "candidates of the parameters", "none", "make them with reduction.search")
        )
    options = options or Options()
    work = replace(
        begin(task, search, options, folder, tolerance), savable=savable, proofs=proofs, aim=aim
    )
    with durable.writing(Path(folder or ""), ROOM):
        work.must_pay = must_pay
        if must_pay and not work.files.numbers(store.RUN):
            require_worth(work)
        work.fast = replace(work.fast, family=with_polynomials(work.task).family)
        done = resume(work)
        outcome, last = loop(work, options, done, checks, progress)
    found = replace(work.task, plan=work.fast.plan)
    pairs, seen = tuple(known_pairs(work)), tuple(unseen(work).values())
    known = (tuple(work.runs), tuple(work.models), work.choice, pairs, calibrate(pairs))
    return FinishedTraining(
        found, search, outcome, last, *known, work.lowered, work.discarded, seen
    )


def train_alone(
    task: TrainingTask, tolerance: float | None, motion: Trajectory | None
) -> FinishedTraining:
    """The model of one system, from its only full run."""
    if tolerance is not None:
        task = replace(
            task, plan=replace(task.plan, tolerance=error_budget.first_eps(tolerance), modes=None)
        )
    run = full_runs.full_run(task, {}) if motion is None else full_runs.run_of_motion(task, motion)
    choice = None
    if tolerance is not None:
        choice = error_budget.choose(task, run, tolerance, full_runs.step_error(task, {}, run))
        task = replace(task, plan=error_budget.with_choice(task.plan, choice))
    last = Iteration(1, 0, (), (), np.zeros(0), np.zeros(0), None)
    return FinishedTraining(
        task,
        NOWHERE,
        Enrichment((last,), StopReason.ALONE),
        last,
        (run,),
        (make_model(task, [run]),),
        choice,
    )


def begin(
    task: TrainingTask,
    search: Search,
    options: Options,
    folder: Path | str | None,
    tolerance: float | None,
) -> TrainingState:
    """The start of a training; a wanted error replaces the tolerances of the plan by those tried
    first.
    """
    files = store.store_of(None)
    if folder is not None:
        mark = store.fingerprint(task, search, replace(options, iterations=1), tolerance)
        with durable.writing(Path(folder)):
            files = store.open_folder(folder, mark)
    if tolerance is not None:
        lowest = error_budget.first_eps(tolerance) * LOWER_EPS**LOWERINGS
        task = replace(task, plan=replace(task.plan, tolerance=lowest, modes=None))
    return TrainingState(task, task, search, files, tolerance)


def resume(work: TrainingState) -> tuple[Iteration, ...]:
    """Take over what the folder holds; its complete iterations."""
    known = work.files.series(store.RUN, store.StoredRun)
    work.runs = [one.run for one in known]
    work.points = [one.point for one in known]
    for number in range(1, len(work.runs) + 1):
        if (notes := work.files.read(store.NOTES, number, store.Notes)) is None:
            break
        work.pairs = list(notes.pairs)
        work.lowered = notes.lowered
        work.discarded = notes.discarded
        if notes.choice is not None:
            take_choice(work, notes.choice)
        work.models.append(
            store.read_model(work.files, number) or make_savable(work, work.runs[:number])
        )
    work.checks |= store.read_checks(work.files)
    if len(work.models) == len(work.runs):
        work.indicators = (
            work.files.read(store.INDICATORS, len(known), store.Indicators) or store.Indicators({})
        ).values
        if work.models and work.checks:
            recalibrate(work)
    return work.files.series(store.ITERATION, Iteration)[: len(work.models)]


def loop(
    work: TrainingState,
    options: Options,
    done: Sequence[Iteration],
    checks: int,
    progress: Progress | None,
) -> tuple[Enrichment, Iteration]:
    """Algorithm 1, and its last iteration with the samples of the survey.

    Where the wanted error is not reached, it goes on with a lower eps if that is the limit, or with
    what survey and checks show.
    """
    while True:
        outcome = run_greedy(work, options, done, progress)
        *before, last = outcome.iterations
        if outcome.stop is StopReason.LARGE:
            return outcome, last
        if checks:
            last = survey(work, last, options)
            check(work, last, checks)
        if work.tolerance is None or good_enough(work, last.largest):
            return outcome, last
        if (
            outcome.stop is StopReason.TOLERANCE
            and options.tolerance is None
            and len(work.runs) < options.iterations
        ):
            keep_iteration(work, last)
            done = [*before, last]
        elif outcome.stop in LIMITS and lower(work, last):
            done = before
        else:
            return outcome, last


def run_greedy(
    work: TrainingState, options: Options, done: Sequence[Iteration], progress: Progress | None
) -> Enrichment:
    """Algorithm 1 with the runs and indicators of this training, until the predicted error is small
    enough.
    """

    def indicator_at(point: int) -> float:
        value = evaluate(work, point)
        if progress:
            part = min(1.0, len(work.indicators) / options.max_samples)
            progress(min(1.0, (len(work.runs) - 1 + part) / options.iterations))
        return value

    problem = GreedyProblem(
        indicator_at,
        functools.partial(extend, work),
        unit_box(work),
        work.search.samples,
        work.search.first,
        options,
        keep=functools.partial(keep_iteration, work),
        truncates=functools.partial(truncates, work),
        name=lambda point: boxes.text(work.task.parameters, values_at(work, point)),
        enough=functools.partial(good_enough, work),
        pays=functools.partial(pays, work),
    )
    return greedy.run(problem, done)


def keep_iteration(work: TrainingState, iteration: Iteration) -> None:
    """Store a complete iteration."""
    work.files.append(store.ITERATION, iteration.number, iteration)


def good_enough(work: TrainingState, largest: float) -> bool:
    """Whether the predicted error is small enough, or full runs that the model has not seen show
    that it is.
    """
    return small_enough(work, largest) or (math.isfinite(largest) and proved(work))


def small_enough(work: TrainingState, largest: float) -> bool:
    """Whether the error predicted from the largest indicator, with its band, is below the wanted
    one.
    """
    if work.tolerance is None or not math.isfinite(largest):
        return False
    return calibration.predict(calibrate(known_pairs(work)), largest).high <= work.tolerance


def survey(work: TrainingState, last: Iteration, options: Options) -> Iteration:
    """The last iteration with as many samples as there may be: the candidates farthest from those
    that it has.

    Indicators that are missing are found by reduced runs.
    """
    known = last.found
    closed = {*work.points, *dict(last.failed)}
    while len(known) < options.max_samples:
        choices = [
            k for k in range(len(work.search.candidates)) if k not in known and k not in closed
        ]
        if not choices:
            break
        point = greedy.farthest(unit_box(work), choices, [*known, *work.points])
        known[point] = evaluate(work, point)
    return replace(last, samples=tuple(known), indicators=tuple(known.values()))
