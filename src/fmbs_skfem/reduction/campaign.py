r"""Training of a reduced model over a box of parameters: full runs, bases and indicators of a family, in the order greedy asks for.

    extend(mu):    full run at mu -> factors -> bases and hyper-reduction of all runs so far -> reduced family
    evaluate(mu):  reduced run at mu -> I(mu) = int |R(mu)|_g dt                                                          (49)
    pairs (I, e):  the reduced model at the full runs, before and after each of them joined it -> predicted errors
    checks:        further full runs, which never join the model: (I, e) of the last model at points that it has not seen

At its own full runs a model errs less than between them, and indicators of earlier models are proportional to their errors by
other factors, of up to a hundred: with checks, the calibration is that of the last model alone, where its own runs count as one.
Before them a survey fills the samples of the last iteration up to `max_samples`, each as far as possible from the others: greedy
looks for the maximum of I, and a surrogate of what it has seen there is too sure elsewhere. Where a wanted error is not reached
after all, greedy goes on.
A wanted error chooses eps and eta at the first full run (`budget`); training then ends when the predicted error, with its spread,
is below it. Where truncation is the limit before that, eps is lowered and the runs that exist serve once more.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..core import durable
from ..core.errors import InputError, NoModel, NoRoom, SolverError, say
from ..dynamics.trajectory import Trajectory
from . import budget, calibration, full_runs, greedy
from . import parameters as boxes
from . import training_store as store
from .budget import Choice
from .calibration import Calibration
from .family_model import FamilyModel, indicator, model_of, quick, reduced_case, reduced_run
from .full_runs import FullRun, Setting, full_run
from .greedy import Options, Outcome, Stop
from .parameters import Parameter
from .training import Plan
from .training_store import Pair

LOWER_EPS, LOWER_ETA = 1e-2, 0.3  #: factors where truncation and hyper-reduction are the limit
LOWERINGS = 2
NEAR = 1e-9  #: distance in the unit box at which points are the same
LIMITS = (Stop.FLOOR, Stop.REPEATED)
CHECKS = 2  #: that trainings of scenes make
CHECK = -1  #: number of the run of a pair that is a check


@dataclass(frozen=True)
class Search:
    """Where runs may be made."""

    candidates: np.ndarray  #: (c, d) values of the parameters
    samples: tuple[int, ...]  #: candidates with a reduced run in every iteration
    first: int  #: candidate of the first full run


@dataclass(frozen=True)
class Campaign:
    """A training that has ended."""

    setting: Setting  #: with the plan of the model
    search: Search
    outcome: Outcome
    last: greedy.Iteration  #: of the outcome, with the samples of the survey
    runs: tuple[FullRun, ...]
    models: tuple[FamilyModel, ...]  #: after every full run
    pairs: tuple[Pair, ...]
    calibration: Calibration
    choice: Choice | None  #: of a wanted error
    lowered: int = 0  #: how often eps was lowered because it was the limit
    discarded: int = 0  #: reduced runs of iterations before that
    checks: tuple[FullRun, ...] = ()  #: full runs that calibrate the last model without being in it

    @property
    def model(self) -> FamilyModel:
        return self.models[-1]

    @property
    def model_plan(self) -> Plan:
        """How the model was made: components, eps, eta."""
        return self.setting.plan

    @property
    def reduced_runs(self) -> int:
        """Reduced runs of the greedy loop; those of the survey and at full runs serve the prediction and are not among them."""
        return self.outcome.evaluations + self.discarded

    @property
    def predicted(self) -> tuple[float, float, float]:
        """Predicted largest error over the candidates, with its band."""
        error, low, high = calibration.predict(self.calibration, self.last.largest)
        return float(error), float(low), float(high)


@dataclass
class Work:
    """What a training knows so far."""

    setting: Setting
    fast: Setting  #: the same, with full systems that are not assembled again
    search: Search
    folder: Path | None
    tolerance: float | None
    runs: list[FullRun] = field(default_factory=list)
    points: list[int] = field(default_factory=list)
    models: list[FamilyModel] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    choice: Choice | None = None
    indicators: dict[int, float] = field(default_factory=dict)  #: of the present model by candidate
    motions: dict[int, Trajectory] = field(default_factory=dict)  #: of the present model by candidate
    checks: dict[int, FullRun] = field(default_factory=dict)  #: by candidate
    present: list[Pair] = field(default_factory=list)  #: of the present model: one for its full runs, one at every check
    lowered: int = 0
    discarded: int = 0
    stale: bool = False  #: whether the last model has to be made again
    savable: bool = False  #: whether a file has to be able to hold the models


class Enough(Exception):
    """The predicted error is as small as it was wanted."""


class Unsavable(Exception):
    """A file cannot hold the model; this ends the training, where a full run that fails does not."""


def search(parameters: Sequence[Parameter], candidates: ArrayLike, samples: ArrayLike, first: ArrayLike | None = None) -> Search:
    """Candidates (c, d), the samples (k, d) among them and the first point (d,), by default the candidate nearest to the middle.

    Samples and first point that are no candidates become some.
    """
    rows = boxes.table(parameters, candidates)
    wanted = boxes.table(parameters, samples)
    start = None if first is None else boxes.table(parameters, np.reshape(np.asarray(first, dtype=float), (1, -1)))
    for extra in (wanted, start):
        if extra is not None:
            away = distances(parameters, rows, extra).min(axis=1)
            rows = np.concatenate([rows, extra[away > NEAR]])
    if start is None:
        middle = np.full((1, len(parameters)), 0.5)
        start = rows[[int(np.argmin(np.linalg.norm(boxes.to_box(parameters, rows) - middle, axis=1)))]]
    numbers = distances(parameters, rows, wanted).argmin(axis=1)
    return Search(rows, tuple(dict.fromkeys(int(k) for k in numbers)), int(distances(parameters, rows, start).argmin(axis=1)[0]))


def distances(parameters: Sequence[Parameter], rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances (k, c) in the unit box."""
    a, b = boxes.to_box(parameters, rows), boxes.to_box(parameters, points)
    return np.asarray(np.linalg.norm(b[:, None] - a[None], axis=2))


def train(
    setting: Setting,
    search: Search,
    options: Options | None = None,
    folder: Path | str | None = None,
    tolerance: float | None = None,
    progress: Callable[[float], None] | None = None,
    savable: bool = False,
    checks: int = 0,
) -> Campaign:
    """Train a reduced model over the candidates of a search.

    With a `folder` every run, model and iteration is stored, and a training that was interrupted, or is given more iterations, goes
    on from there. `tolerance` is the wanted error in the measure of the setting: it replaces eps and eta of the plan and ends the
    training. With `savable` it ends with NoModel at the first full run where the model is no polynomial of the parameters: a file
    holds nothing else. After the last iteration so many `checks` calibrate the error that is predicted.
    """
    options = options or Options()
    work = replace(prepared(setting, search, options, folder, tolerance), savable=savable)
    try:
        with durable.room(Path(folder or ""), "make room, then train again with this folder: what is complete is not run again"):
            done = resumed(work) if work.folder else ()
            outcome, last = loop(work, options, done, checks, progress)
    except Unsavable as problem:
        raise NoModel(str(problem)) from None
    except NoRoom:
        raise
    except OSError as problem:
        remedy = "make room, then train again with this folder: what is complete is not run again"
        raise InputError(say(str(work.folder), "a folder that can be written", problem, remedy)) from problem
    found = replace(work.setting, plan=work.fast.plan)
    pairs, seen = tuple(known_pairs(work)), tuple(unseen(work).values())
    known = (tuple(work.runs), tuple(work.models), pairs, calibrated(pairs))
    return Campaign(found, search, outcome, last, *known, work.choice, work.lowered, work.discarded, seen)


def prepared(setting: Setting, search: Search, options: Options, folder: Path | str | None, tolerance: float | None) -> Work:
    """The start of a training; a wanted error replaces the tolerances of the plan by those tried first."""
    place = None
    if folder is not None:
        mark = store.fingerprint(setting, search, replace(options, iterations=1), tolerance)
        try:
            with durable.room(Path(folder)):
                place = store.opened(folder, mark)
        except NoRoom:
            raise
        except OSError as problem:
            raise InputError(say(str(folder), "a folder that can be written", problem)) from problem
    if tolerance is not None:
        lowest = budget.first_eps(tolerance) * LOWER_EPS**LOWERINGS
        setting = replace(setting, plan=replace(setting.plan, tolerance=lowest, modes=None))
    return Work(setting, quick(setting), search, place, tolerance)


def resumed(work: Work) -> tuple[greedy.Iteration, ...]:
    """Take over what the folder holds; its complete iterations."""
    assert work.folder is not None
    known = store.read(work.folder)
    work.runs, work.points = list(known.runs), list(known.points)
    for number in range(1, len(work.runs) + 1):
        if (notes := store.notes_of(work.folder, number)) is None:
            break
        work.pairs, work.lowered, work.discarded = list(notes.pairs), notes.lowered, notes.discarded
        if notes.choice is not None:
            settle(work, notes.choice)
        work.models.append(store.model(work.folder, number) or made(work, work.runs[:number]))
    work.checks = store.checks(work.folder)
    if len(work.models) == len(work.runs):
        work.indicators = dict(known.indicators)
        recalibrate(work)
    return known.iterations[: len(work.models)]


def loop(
    work: Work, options: Options, done: Sequence[greedy.Iteration], checks: int, progress: Callable[[float], None] | None
) -> tuple[Outcome, greedy.Iteration]:
    """Algorithm 1, and its last iteration with the samples of the survey.

    Where the wanted error is not reached, it goes on with a lower eps if that is the limit, or with what survey and checks tell.
    """
    while True:
        outcome = searched(work, options, done, progress)
        *before, last = outcome.iterations
        if checks:
            last = surveyed(work, last, options)
            check(work, last, checks)
        if work.tolerance is None or small_enough(work, [last]):
            return outcome, last
        if outcome.stop is Stop.TOLERANCE and options.tolerance is None and len(work.runs) < options.iterations:
            if work.folder:
                store.keep_iteration(work.folder, last)
            done = [*before, last]
        elif outcome.stop in LIMITS and lower(work, last):
            done = before
        else:
            return outcome, last


def searched(work: Work, options: Options, done: Sequence[greedy.Iteration], progress: Callable[[float], None] | None) -> Outcome:
    """Algorithm 1 with the runs and indicators of this training, until the predicted error is small enough."""
    complete = list(done)
    unit = boxes.to_box(work.setting.parameters, work.search.candidates)

    def keep(iteration: greedy.Iteration) -> None:
        complete[iteration.number - 1 :] = [iteration]
        if work.folder:
            store.keep_iteration(work.folder, iteration)
        if small_enough(work, complete):
            raise Enough

    def evaluate(point: int) -> float:
        value = evaluated(work, point)
        if progress:
            part = min(1.0, len(work.indicators) / options.max_samples)
            progress(min(1.0, (len(work.runs) - 1 + part) / options.iterations))
        return value

    def extend(point: int) -> None:
        extended(work, point)

    def name(point: int) -> str:
        return boxes.text(work.setting.parameters, values_at(work, point))

    arguments = (evaluate, extend, unit, work.search.samples, work.search.first)
    try:
        if small_enough(work, complete):
            raise Enough
        return greedy.run(*arguments, options, done, keep, functools.partial(truncates, work), name)
    except Enough:
        small = replace(options, tolerance=complete[-1].largest)
        return greedy.run(*arguments, small, [*complete[:-1], replace(complete[-1], next=None)])


def truncates(work: Work) -> bool:
    """Whether the bases leave out anything of the full runs; where they keep all, snapshots are the limit, and not eps.

    A rigid component has the same modes in all runs and in the model.
    """
    for name, count in work.models[-1].modes.items():
        known = [run.factors[name].modes.shape[1] for run in work.runs]
        if count < sum(known) and set(known) != {count}:
            return True
    return False


def small_enough(work: Work, iterations: Sequence[greedy.Iteration]) -> bool:
    """Whether the largest error predicted after the last iteration, with its spread, is below the wanted one."""
    largest = iterations[-1].largest if iterations else math.inf
    if work.tolerance is None or not math.isfinite(largest):
        return False
    return calibration.predict(calibrated(known_pairs(work)), largest)[2] <= work.tolerance


def known_pairs(work: Work) -> list[Pair]:
    """The pairs that calibrate: with checks those of the present model, without them those of all models."""
    return work.present if work.checks else work.pairs


def unseen(work: Work) -> dict[int, FullRun]:
    """The checks that have not joined the model, by candidate."""
    return {point: run for point, run in work.checks.items() if point not in work.points}


def calibrated(pairs: Sequence[Pair]) -> Calibration:
    known = usable(pairs)
    return calibration.fit([pair.indicator for pair in known], [pair.error for pair in known])


def usable(pairs: Sequence[Pair]) -> list[Pair]:
    """Those with a finite indicator and an error."""
    return [pair for pair in pairs if math.isfinite(pair.indicator) and pair.indicator > 0.0 and pair.error > 0.0]


def evaluated(work: Work, point: int) -> float:
    """The indicator at a candidate; infinite where the reduced run fails."""
    if point not in work.indicators:
        measure(work, point)
        if work.folder:
            store.keep_indicators(work.folder, len(work.runs), work.indicators)
    return work.indicators[point]


def measure(work: Work, point: int) -> Trajectory | None:
    """Reduced run and indicator at a candidate with the present model; None where the run fails."""
    values = values_at(work, point)
    try:
        motion = reduced_run(work.fast, reduced_case(work.models[-1], values))
    except SolverError:
        work.indicators[point] = math.inf
        return None
    work.motions[point] = motion
    work.indicators[point] = indicator(work.fast, motion, values)
    return motion


def values_at(work: Work, point: int) -> dict[str, float]:
    return boxes.named(work.setting.parameters, work.search.candidates[point])


def extended(work: Work, point: int) -> None:
    """The full run at a candidate, unless there is one, and the model of all runs up to it."""
    values, known = values_at(work, point), point in work.points
    number = work.points.index(point) if known else len(work.runs)
    if number < len(work.models) and not work.stale:
        return
    run = work.runs[number] if known else work.checks.get(point) or full_run(work.setting, values)
    if not known:
        work.runs, work.points = [*work.runs, run], [*work.points, point]
        if work.folder:
            store.keep_run(work.folder, number + 1, run, point)
    before = pairs_at(work, [number]) if number == len(work.models) and work.models else []
    if work.tolerance is not None and work.choice is None:
        settle(work, budget.choose(work.fast, run, work.tolerance, full_runs.step_error(work.setting, values, run)))
    model = made(work, work.runs)
    work.models, work.indicators, work.motions, work.stale = [*work.models[:number], model], {}, {}, False
    work.pairs = [*work.pairs, *before]
    own = pairs_at(work, range(len(work.runs)))
    work.pairs, work.present = [*work.pairs, *own], [*middle(own), *checked(work)]
    if work.folder:
        notes = store.Notes(tuple(work.pairs), work.choice, work.lowered, work.discarded)
        store.keep_model(work.folder, number + 1, model, notes)
        store.keep_indicators(work.folder, number + 1, work.indicators)


def made(work: Work, runs: Sequence[FullRun]) -> FamilyModel:
    """The model of some runs."""
    model = model_of(work.fast, runs)
    if work.savable and model.obstacle:
        raise Unsavable(f"no file can hold the reduced model, it is no polynomial of its parameters: {model.obstacle}")
    return model


def settle(work: Work, choice: Choice) -> None:
    """Go on with the tolerances of a choice."""
    work.choice = choice
    plan = budget.with_choice(work.setting.plan, choice)
    work.fast = replace(work.fast, plan=plan)
    work.setting = replace(work.setting, plan=replace(plan, tolerance=min(plan.tolerance, work.setting.plan.tolerance)))


def lower(work: Work, last: greedy.Iteration) -> bool:
    """Lower eps and eta, as far as the factors of the runs allow it, and forget the last iteration; False where that is no way."""
    plan, choice, old = work.fast.plan, work.choice, work.fast.plan.hyper.tolerance
    eps = max(LOWER_EPS * plan.tolerance, budget.SMALLEST_EPS)
    eta = None if old is None else max(LOWER_ETA * old, budget.SMALLEST_ETA)
    if choice is None or work.lowered == LOWERINGS or (eps == plan.tolerance and eta == old):
        return False
    settle(work, replace(choice, eps=eps, eta=eta))
    work.lowered, work.discarded, work.stale = work.lowered + 1, work.discarded + len(last.samples), True
    if work.folder:
        store.forget(work.folder, last.number)
    return True


def pairs_at(work: Work, numbers: Iterable[int]) -> list[Pair]:
    """Indicator and error of the present model at full runs, where the reduced run succeeds."""
    found = (pair_at(work, work.runs[number], work.points[number], number) for number in numbers)
    return [pair for pair in found if pair is not None]


def pair_at(work: Work, run: FullRun, point: int, number: int) -> Pair | None:
    """Indicator and error of the present model at a full run; None where the reduced run fails."""
    motion = work.motions.get(point) or measure(work, point)
    if motion is None:
        return None
    error = full_runs.wanted_error(work.fast, work.fast.family(run.values).system, run, motion)
    return Pair(number, len(work.models), work.indicators[point], error)


def surveyed(work: Work, last: greedy.Iteration, options: Options) -> greedy.Iteration:
    """The last iteration with as many samples as there may be: the candidates farthest from those that it has."""
    known = dict(zip(last.samples, last.indicators, strict=True))
    closed = {*work.points, *dict(last.failed)}
    while len(known) < options.max_samples:
        choices = [k for k in range(len(work.search.candidates)) if k not in known and k not in closed]
        if not choices:
            break
        point = farthest(work, choices, [*known, *work.points])
        known[point] = evaluated(work, point)
    return replace(last, samples=tuple(known), indicators=tuple(known.values()))


def farthest(work: Work, choices: Sequence[int], used: Sequence[int]) -> int:
    """The candidate among `choices` that is farthest from all `used` ones."""
    rows = work.search.candidates
    away = distances(work.setting.parameters, rows[list(used)], rows[list(choices)]).min(axis=1)
    return choices[int(np.argmax(away))]


def check(work: Work, last: greedy.Iteration, count: int) -> None:
    """Make checks at samples of the last iteration until there are so many that the model has not seen.

    The first one is where the indicator is largest, others are as far as possible from all full runs; a point at which a run
    fails is followed by the next one.
    """
    lost, known = dict(last.failed), dict(zip(last.samples, last.indicators, strict=True))
    used = [*work.points, *work.checks]
    choices = [k for k, value in known.items() if k not in lost and k not in used and math.isfinite(value)]
    while choices and len(unseen(work)) < count:
        point = farthest(work, choices, used) if work.checks else max(choices, key=lambda k: known[k])
        choices.remove(point)
        used.append(point)
        run = full_runs.reached(work.setting, functools.partial(kept_check, work, point), values_at(work, point))
        if isinstance(run, FullRun):
            work.checks[point] = run
    recalibrate(work)


def recalibrate(work: Work) -> None:
    """The pairs of the present model, where there are checks."""
    work.present = [*middle(pairs_at(work, range(len(work.runs)))), *checked(work)] if work.checks else []


def middle(pairs: Sequence[Pair]) -> list[Pair]:
    """One pair in the middle of several, where they scatter no more than is expected of any.

    At its own full runs a model errs alike, by what truncation leaves, which tells little of the scatter elsewhere.
    """
    known = usable(pairs)
    logarithms = np.log10([(pair.indicator, pair.error) for pair in known]).reshape(-1, 2)
    if len(known) < 2 or np.std(logarithms[:, 1] - logarithms[:, 0]) > calibration.PRIOR:
        return known
    indicator, error = (float(10.0**value) for value in logarithms.mean(axis=0))
    return [replace(known[0], indicator=indicator, error=error)]


def checked(work: Work) -> list[Pair]:
    """Indicator and error of the present model at the checks that it has not seen."""
    found = (pair_at(work, run, point, CHECK) for point, run in unseen(work).items())
    return [pair for pair in found if pair is not None]


def kept_check(work: Work, point: int, values: Mapping[str, float]) -> FullRun:
    """The full run of a check, kept in the folder."""
    make = functools.partial(full_run, work.setting, values)
    return make() if work.folder is None else store.made(store.check_file(work.folder, point), make)
