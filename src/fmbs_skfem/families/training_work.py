r"""What a training over parameters knows so far, and how it learns more.

    extend(mu):    full run at mu -> factors -> bases and hyper-reduction of all runs so far -> reduced model
    evaluate(mu):  reduced run at mu -> I(mu) = int |R(mu)|_g dt                                                          (49)
    pairs (I, e):  the reduced model at the full runs, before and after each of them joined it -> predicted errors
    checks:        further full runs, which never join the model: (I, e) of the last model at points that it has not seen

At its own full runs a model errs less than between them, and indicators of earlier models are
proportional to their errors by other factors, of up to a hundred: with checks, the calibration is
that of the last model alone, where its own runs count as one.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ..core.errors import NoModel, SolverError
from ..core.storage.records import dataclass
from ..core.storage.store import Store
from ..dynamics.trajectory import Trajectory
from ..reduction import full_runs, reduced_models
from ..reduction import parameters as boxes
from ..reduction.accuracy import error_budget
from ..reduction.accuracy.costs import FAST
from ..reduction.accuracy.error_budget import BudgetChoice
from ..reduction.cases import Case, Family
from ..reduction.full_runs import FullRun, TrainingTask, full_run
from ..reduction.parameters import Search
from ..reduction.reduced_models import ReducedModel, indicator, make_model
from . import calibration, greedy, worth
from . import training_store as store
from .calibration import Calibration
from .training_store import Pair
from .worth import DoesNotPay

LOWER_EPS, LOWER_ETA = 1e-2, 0.3  #: factors where truncation and hyper-reduction are the limit
NEXT_EPS = 0.1  #: factor to eps where that was the coarsest that does at the first run, so that one which does elsewhere is near
LOWERINGS = 2
CORNERS = 2  #: full runs beside the first one, by which it is known whether models of several pay
LARGE = 0.75  #: unknowns of a reduced model over coordinates of the full one, whose matrices are sparse, from which it does not pay
# four-bar: 29 of 110 coordinates are 1.6 times as fast, 67 of them 0.7 to 0.95; shell: 20, 47, 105
# of 138 are 5, 2.7, 1.0 times so
CHECK = -1  #: number of the run of a pair that is a check


@dataclass
class TrainingState:
    """What a training knows so far.

    Candidates are numbers of rows of `search.candidates`. `runs`, `points` and `models` belong
    together, one model after every run.
    """

    task: TrainingTask
    fast: TrainingTask  #: the same, with full systems that are not assembled again
    search: Search
    files: Store
    tolerance: float | None
    runs: list[FullRun] = field(default_factory=list)
    points: list[int] = field(default_factory=list)
    models: list[ReducedModel] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    choice: BudgetChoice | None = None
    indicators: dict[int, float] = field(default_factory=dict)  #: of the present model by candidate
    #: of the present model by candidate
    motions: dict[int, Trajectory] = field(default_factory=dict)
    checks: dict[int, FullRun] = field(default_factory=dict)  #: by candidate
    #: of the present model: one for its full runs, one at every check
    present: list[Pair] = field(default_factory=list)
    lowered: int = 0
    discarded: int = 0
    stale: bool = False  #: whether the last model has to be made again
    savable: bool = False  #: whether a file has to be able to hold the models
    proofs: int = 0  #: full runs that are not in the model and show that it is good enough; 0: they are not asked
    aim: float = 1.0  #: part of the wanted error that it keeps there
    #: whether the training ends where no model can be faster than the full one
    must_pay: bool = False


def truncates(work: TrainingState) -> bool:
    """Whether the bases leave out anything of the full runs; where they keep all, snapshots are the
    limit, and not eps.

    A rigid component has the same modes in all runs and in the model.
    """
    for name, count in work.models[-1].modes.items():
        known = [run.factors[name].modes.shape[1] for run in work.runs]
        if count < sum(known) and set(known) != {count}:
            return True
    return False


def pays(work: TrainingState) -> bool:
    """Whether the present model has so few unknowns beside the coordinates of the full one that it
    can be faster.

    At most 0.75 of the coordinates of the components, half of them where the coarsest model is
    searched for.
    """
    full = worth.coordinates(work.runs[-1])
    return sum(work.models[-1].modes.values()) <= (worth.LARGEST if work.proofs else LARGE) * full


def known_pairs(work: TrainingState) -> list[Pair]:
    """The pairs that calibrate: with checks those of the present model, without them those of all
    models.

    There are none before the first model.
    """
    return work.present if work.checks else work.pairs


def unseen(work: TrainingState) -> dict[int, FullRun]:
    """The checks that have not joined the model, by candidate."""
    return {point: run for point, run in work.checks.items() if point not in work.points}


def calibrate(pairs: Sequence[Pair]) -> Calibration:
    """The line that makes errors of indicators, from pairs of both.

    InputError where no pair has a positive indicator and error.
    """
    return calibration.fit([pair.indicator for pair in pairs], [pair.error for pair in pairs])


def proved(work: TrainingState) -> bool:
    """Whether the model keeps its part of the wanted error at full runs that it has not seen, one
    where its indicator is largest.

    The others are as far as possible from all full runs. They are made one after the other, as long
    as the error is kept; one that shows too large an error where the indicator is largest is the
    next run of the model.
    """
    fresh = {k: value for k, value in work.indicators.items() if k not in work.points}
    if (
        not work.proofs
        or work.tolerance is None
        or not fresh
        or not all(map(math.isfinite, fresh.values()))
    ):
        return False
    worst = max(fresh, key=lambda k: fresh[k])
    while True:
        seen = unseen(work)
        errors = [
            pair.error
            for point, run in seen.items()
            for pair in pairs_at(work, [(CHECK, point, run)])
        ]
        if max(errors, default=0.0) > work.aim * work.tolerance or len(errors) < len(seen):
            return False
        if worst in seen and len(seen) >= work.proofs:
            return True
        others = [k for k in fresh if k not in seen]
        point = (
            worst
            if worst not in seen
            else greedy.farthest(unit_box(work), others, [*work.points, *seen])
            if others
            else None
        )
        if point is None or not add_check(work, point):
            return False


def add_check(work: TrainingState, point: int) -> bool:
    """Make the full run of a check; False where the full model has no motion there."""
    run = full_runs.try_run(
        work.task, functools.partial(run_check, work, point), values_at(work, point)
    )
    if isinstance(run, FullRun):
        work.checks[point] = run
        if work.models:
            recalibrate(work)
    return isinstance(run, FullRun)


def evaluate(work: TrainingState, point: int) -> float:
    """The indicator at a candidate; infinite where the reduced run fails.

        I = c int |R|_g dt    [m s]

    of the present model by (49); it is stored, and found once.
    """
    if point not in work.indicators:
        measure(work, point)
        keep_indicators(work, len(work.runs))
    return work.indicators[point]


def keep_indicators(work: TrainingState, number: int) -> None:
    """Store the indicators of the model of the first `number` runs."""
    work.files.append(store.INDICATORS, number, store.Indicators(work.indicators))


def measure(work: TrainingState, point: int) -> Trajectory | None:
    """Reduced run and indicator at a candidate with the present model; None where the run fails."""
    values = values_at(work, point)
    try:
        motion = full_runs.run_formed(work.fast, work.models[-1].cases(values))
    except SolverError:
        work.indicators[point] = math.inf
        return None
    work.motions[point] = motion
    work.indicators[point] = indicator(work.fast, motion, values)
    return motion


def values_at(work: TrainingState, point: int) -> dict[str, float]:
    """Values of the parameters at a candidate, by name [SI].

    `point` is its number among the candidates of the search.
    """
    return boxes.named(work.task.parameters, work.search.candidates[point])


def require_worth(work: TrainingState) -> None:
    """The first full run, with eps and eta chosen there: DoesNotPay where no model that knows it
    can be faster than the full one.

    Where that is not sure, nor is one that knows CORNERS other runs as well, as far as possible
    from each other: these are checks of the models that follow, or join them.
    """
    work.fast = replace(work.task, family=remember(work.task.family))
    first = work.search.first
    if work.tolerance is None or not add_check(work, first):
        return
    run = work.checks[first]
    try:
        take_choice(
            work, error_budget.choose(work.fast, run, work.tolerance, None, work.proofs > 0)
        )
    except NoModel as error:
        raise DoesNotPay(f"no reduced model keeps the wanted error ({error})", run.cpu_s) from error
    full_s, run_s = require_fast(work, [run], FAST)
    work.checks[first] = replace(run, cpu_s=full_s)
    if full_s >= worth.SURELY * run_s:
        return
    tried = [first]
    while len(tried) <= min(CORNERS, len(work.search.candidates) - 1):
        others = [k for k in range(len(work.search.candidates)) if k not in tried]
        tried.append(greedy.farthest(unit_box(work), others, tried))
        add_check(work, tried[-1])
    require_fast(work, [*work.checks.values()], worth.GROWTH * FAST)


def require_fast(work: TrainingState, runs: Sequence[FullRun], least: float) -> tuple[float, float]:
    """Seconds of the full model and of the reduced model of some full runs, at the first of these;
    DoesNotPay as of `worth`.
    """
    worth.require_small(work.fast, runs)
    case = reduced_models.reduced_case(
        work.fast, reduced_models.train_reduction(work.fast, runs), runs[0].values
    )
    return worth.require_fast(work.fast, runs[0], case, least)


def remember(family: Family) -> Family:
    """A family that assembles no instance twice, for few of them."""
    known: dict[tuple[tuple[str, float], ...], Case] = {}

    def case(values: Mapping[str, float]) -> Case:
        key = tuple(sorted(values.items()))
        if key not in known:
            known[key] = family(values)
        return known[key]

    return case


def extend(work: TrainingState, point: int) -> None:
    """The full run at a candidate, unless there is one, and the model of all runs up to it.

    The present model, its indicators and the pairs of all models are found anew, and stored where
    there is a folder. Errors of the full run are raised.
    """
    values = values_at(work, point)
    known = point in work.points
    number = work.points.index(point) if known else len(work.runs)
    if number < len(work.models) and not work.stale:
        return
    run = work.runs[number] if known else work.checks.get(point) or full_run(work.task, values)
    if not known:
        work.runs = [*work.runs, run]
        work.points = [*work.points, point]
        work.files.append(store.RUN, number + 1, store.StoredRun(run, point))
    before = (
        pairs_at(work, [(number, point, run)]) if number == len(work.models) and work.models else []
    )
    if work.tolerance is not None and work.choice is None:
        step = full_runs.step_error(work.task, values, run)
        take_choice(
            work, error_budget.choose(work.fast, run, work.tolerance, step, work.proofs > 0)
        )
    if work.must_pay:
        worth.require_small(work.fast, work.runs)
    model = make_savable(work, work.runs)
    work.models = [*work.models[:number], model]
    work.indicators = {}
    work.motions = {}
    work.stale = False
    work.pairs = [*work.pairs, *before, *recalibrate(work)]
    if work.must_pay:
        first = work.runs[0]
        motion = work.motions.get(work.points[0])
        worth.require_fast(
            work.fast,
            first,
            model.cases(first.values),
            run_s=motion.statistics.cpu_s if motion else math.inf,
        )
    notes = store.Notes(tuple(work.pairs), work.choice, work.lowered, work.discarded)
    store.keep_model(work.files, number + 1, model, notes)
    keep_indicators(work, number + 1)


def make_savable(work: TrainingState, runs: Sequence[FullRun]) -> ReducedModel:
    """The model of some runs.

    NoModel where a file has to hold it and its numbers are no polynomials of the parameters.
    """
    model = make_model(work.fast, runs, work.models[-1].obstacle if work.models else "")
    if work.savable and model.obstacle:
        raise NoModel(
            f"no file can hold the reduced model, it is no polynomial of its parameters: {model.obstacle}"
        )
    return model


def take_choice(work: TrainingState, choice: BudgetChoice) -> None:
    """Go on with the tolerances of a choice.

    eps and eta of the plan with which models are made; factors of further full runs are kept for
    the smaller eps.
    """
    work.choice = choice
    plan = error_budget.with_choice(work.task.plan, choice)
    work.fast = replace(work.fast, plan=plan)
    work.task = replace(
        work.task, plan=replace(plan, tolerance=min(plan.tolerance, work.task.plan.tolerance))
    )


def lower(work: TrainingState, last: greedy.Iteration) -> bool:
    """Lower eps and eta, as far as the factors of the runs allow it, and forget the last iteration;
    False where that is no way.

    eps times 0.01 (0.1 where the coarsest model is searched for) and eta times 0.3, twice at most;
    only of a training with a wanted error.
    """
    plan = work.fast.plan
    choice = work.choice
    old = work.fast.plan.hyper.tolerance
    eps = max((NEXT_EPS if work.proofs else LOWER_EPS) * plan.tolerance, error_budget.SMALLEST_EPS)
    eta = None if old is None else max(LOWER_ETA * old, error_budget.SMALLEST_ETA)
    if choice is None or work.lowered == LOWERINGS or (eps == plan.tolerance and eta == old):
        return False
    take_choice(work, replace(choice, eps=eps, eta=eta))
    work.lowered, work.discarded, work.stale = (
        work.lowered + 1,
        work.discarded + len(last.samples),
        True,
    )
    for name in (store.ITERATION, store.INDICATORS):
        work.files.forget(name, last.number)
    return True


def pairs_at(work: TrainingState, runs: Iterable[tuple[int, int, FullRun]]) -> list[Pair]:
    """Indicator and error of the present model at full runs, by number and candidate, where the
    reduced run succeeds.
    """
    found = []
    for number, point, run in runs:
        motion = work.motions.get(point) or measure(work, point)
        if motion is not None:
            error = full_runs.wanted_error(
                work.fast, work.fast.family(run.values).system, run, motion
            )
            found.append(Pair(number, len(work.models), work.indicators[point], error))
    return found


def unit_box(work: TrainingState) -> np.ndarray:
    """The candidates (c, d) in the unit box.

    d columns, one a parameter, from 0 to 1.
    """
    return boxes.to_box(work.task.parameters, work.search.candidates)


def check(work: TrainingState, last: greedy.Iteration, count: int) -> None:
    """Make checks at samples of the last iteration until there are so many that the model has not
    seen.

    The first one is where the indicator is largest, others are as far as possible from all full
    runs; a point at which a run fails is followed by the next one.
    """
    known = last.open
    used = [*work.points, *work.checks]
    choices = [k for k, value in known.items() if k not in used and math.isfinite(value)]
    while choices and len(unseen(work)) < count:
        point = (
            greedy.farthest(unit_box(work), choices, used)
            if work.checks
            else max(choices, key=lambda k: known[k])
        )
        choices.remove(point)
        used.append(point)
        run = full_runs.try_run(
            work.task, functools.partial(run_check, work, point), values_at(work, point)
        )
        if isinstance(run, FullRun):
            work.checks[point] = run
    if work.checks:
        recalibrate(work)


def recalibrate(work: TrainingState) -> list[Pair]:
    """The pairs of the present model, those at its own full runs as one, with the checks that it
    has not seen; all at its own.
    """
    own = pairs_at(work, zip(range(len(work.runs)), work.points, work.runs, strict=True))
    work.present = [
        *average_pairs(own),
        *pairs_at(work, ((CHECK, point, run) for point, run in unseen(work).items())),
    ]
    return own


def average_pairs(pairs: Sequence[Pair]) -> list[Pair]:
    """One pair in the middle of several, where they scatter no more than is expected of any.

    At its own full runs a model errs alike, by what truncation leaves, which says little of the
    scatter elsewhere.
    """
    known = [
        pair
        for pair in pairs
        if math.isfinite(pair.indicator) and pair.indicator > 0.0 and pair.error > 0.0
    ]
    logarithms = np.log10([(pair.indicator, pair.error) for pair in known]).reshape(-1, 2)
    if len(known) < 2 or np.std(logarithms[:, 1] - logarithms[:, 0]) > calibration.PRIOR:
        return known
    indicator, error = (float(10.0**value) for value in logarithms.mean(axis=0))
    return [replace(known[0], indicator=indicator, error=error)]


def run_check(work: TrainingState, point: int, values: Mapping[str, float]) -> FullRun:
    """The full run of a check, kept in the folder."""
    return store.read_or_make(
        work.files, store.CHECK, point, functools.partial(full_run, work.task, values)
    )
