r"""Comparators: the known ways to a reduced model of a whole family, each a row of full runs, modes, cost and errors.

    q(t; mu) = q0(mu) + V(mu) xi(t)                q0: initial state of the sample,   X_j = q(t_s; mu_j) - q0(mu_j)
    fast to slow     V = POD of X at the fastest parameter
    uniform grid     V = POD of [X_1, X_2, ...]
    greedy           the same, mu_j where the indicator (49) is largest                                   (`training`)
    nearest basis    V = POD of X_j,   j = argmin |mu - mu_j| in the unit box
    Grassmann        span V(mu) = exp_V0( sum_j l_j(mu) log_V0 span V_j )                                 (`grassmann`)

A comparator is a family of reduced cases. The initial state is the origin of every basis and all modes keep the linear constraints
inside their component at every parameter, so that neither is interpolated. Sampled weights belong to one basis: a basis that is
interpolated runs with all cells, or with the exact polynomial where the plan asks for it, and is projected anew for every
parameter. The others are polynomials of the parameters (`affine`) where the members are.

Sources: K. Luo, H. Hu, C. Liu, Q. Tian, CMAME 324 (2017) 573-594, doi 10.1016/j.cma.2017.06.029 (fast to slow); D. Amsallem,
C. Farhat, AIAA J. 46 (2008) 1803-1813, doi 10.2514/1.35374; Y. Hou, C. Liu, H. Hu, CMAME 361 (2020) 112690,
doi 10.1016/j.cma.2019.112690, Figs. 13 and 14.
"""

from __future__ import annotations

import contextlib
import functools
import math
import time as clock
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ..core.errors import FmbsError, InputError, say
from ..core.notices import Notice, Progress
from ..core.storage.records import dataclass
from ..reduction import affine, full_runs, parameters, reduced_models
from ..reduction.accuracy.output_errors import OutputError
from ..reduction.cases import Case, Family
from ..reduction.full_runs import Full, FullRun, TrainingTask
from ..reduction.hyper import hyper_reduction, sampling
from ..reduction.hyper.hyper_reduction import NONE
from ..reduction.parameters import Search
from ..reduction.plan import with_components
from ..reduction.reduced_models import TrainedReduction
from ..reduction.spaces import component
from ..reduction.spaces.pod import Basis
from ..systems.system import System
from . import grassmann, training
from .greedy import Options
from .training import FinishedTraining


@dataclass(frozen=True)
class Comparator:
    """A family of reduced cases and what it took to make it.

    `family(values)` makes its reduced case at the values of the parameters; `offline_s` has the CPU time of the full runs in it.
    """

    name: str
    family: Family
    full_runs: int
    offline_s: float  #: CPU time of the training with its full runs [s]
    reduced_runs: int = 0  #: in the training


@dataclass(frozen=True)
class Trial:
    """A reduced run beside its full run; one that fails has a reason and the error infinity, or NaN where the full run fails."""

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
    """A comparator at the hold-out points with a full run: sizes of its largest member, medians of its times.

    `trials` are in the order of the points; points without a full run count in no number of the row.
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
    with contextlib.suppress(FmbsError), warnings.catch_warnings():  # the comparators themselves say what fails
        warnings.simplefilter("ignore", Notice)
        model = reduced_models.make_model(few, [full_runs.full_run(few, values)])
        motion = full_runs.run_formed(few, model.cases(values))
        reduced_models.indicator(few, motion, values)


def fast_to_slow(task: TrainingTask, full: Full, fastest: Mapping[str, float]) -> Comparator:
    """The basis of one full run at the parameters of the fastest motion, for all others.

    Source: Luo, Hu, Liu, Tian 2017, doi 10.1016/j.cma.2017.06.029.
    """
    return fixed(task, "fast to slow", [full(fastest)])


def uniform(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """One basis from all runs of a uniform grid of the box, both ends included.

    `counts` (d,) are the numbers of values a parameter; one value is the middle of its range.
    """
    return fixed(task, f"uniform grid {shape(counts)}", run_at_nodes(task, full, counts)[1])


def fixed(task: TrainingTask, name: str, given: Sequence[FullRun]) -> Comparator:
    """One basis from several full runs."""
    begun = clock.process_time()
    family: Family = functools.partial(reduced_models.reduced_case, task, reduced_models.train_reduction(task, given))
    with contextlib.suppress(InputError):  # what is no polynomial of the parameters is projected anew for each of them
        family = affine.fit(family, task.parameters)
    return Comparator(name, family, len(given), clock.process_time() - begun + sum(run.cpu_s for run in given))


def nearest(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """Of the bases of single runs on a uniform grid the one nearest to the parameters.

    V = POD of X_j with j = argmin |mu - mu_j| in the unit box; `counts` (d,) as of `uniform`.
    """
    places, given = run_at_nodes(task, full, counts)
    local = [fixed(task, "", [run]) for run in given]

    def family(values: Mapping[str, float]) -> Case:
        return local[find_closest(places, in_box(task, values))].family(values)

    return Comparator(f"nearest basis {shape(counts)}", family, len(given), sum(part.offline_s for part in local))


def interpolated(task: TrainingTask, full: Full, counts: Sequence[int]) -> Comparator:
    """Local bases of a uniform grid interpolated on the Grassmann manifold, all with as many modes as the largest needs.

    span V(mu) = exp_V0(sum_j l_j(mu) log_V0 span V_j), see `grassmann`. InputError where bases are a right angle apart.

    Source: Amsallem and Farhat 2008, doi 10.2514/1.35374.
    """
    places, given = run_at_nodes(task, full, counts)
    begun = clock.process_time()
    systems = [task.family(run.values).system for run in given]
    local = local_bases(task, systems, given)
    axes = [np.unique(column.round(12)) for column in places.T]
    charts = {name: grassmann.chart(axes, [basis[name].modes for basis in local]) for name in task.plan.components}
    rows = [
        reduced_models.find_kept_rows(task, [system], [run], [reduced_models.project(task, basis, system)]).rows
        for system, run, basis in zip(systems, given, local, strict=True)
    ]
    hyper = NONE if task.plan.hyper.tolerance else task.plan.hyper
    offline = clock.process_time() - begun + sum(run.cpu_s for run in given)

    def family(values: Mapping[str, float]) -> Case:
        here = in_box(task, values)
        modes = {name: np.ascontiguousarray(grassmann.interpolate(chart, here)) for name, chart in charts.items()}
        found = {name: Basis(one, np.zeros(len(one)), np.zeros(0)) for name, one in modes.items()}  # about the initial state
        rule = hyper_reduction.train(hyper, [])
        return reduced_models.reduced_case(task, TrainedReduction(found, rows[find_closest(places, here)], rule), values)

    return Comparator(f"Grassmann {shape(counts)}", family, len(given), offline)


def local_bases(task: TrainingTask, systems: Sequence[System], given: Sequence[FullRun]) -> list[dict[str, Basis]]:
    """The basis of every run alone, all with as many modes as the largest needs, by component."""
    own = [reduced_models.bases(task, system, [run]) for system, run in zip(systems, given, strict=True)]
    sizes = {name: max(basis[name].modes.shape[1] - basis[name].against for basis in own) for name in task.plan.components}
    equal = replace(task, plan=replace(task.plan, modes=sizes))
    found = [reduced_models.bases(equal, system, [run]) for system, run in zip(systems, given, strict=True)]
    return [{name: without_directions(one) for name, one in local.items()} for local in found]


def without_directions(basis: Basis) -> Basis:
    """The basis without directions against joints, which are no points of a manifold of motions."""
    return replace(basis, modes=basis.modes[:, : basis.modes.shape[1] - basis.against], against=0)


def greedy(task: TrainingTask, search: Search, options: Options | None = None, name: str = "greedy") -> Comparator:
    """Algorithm 1, by component or, with the task `at_system_level`, for the system as a whole; it makes its own full runs.

    `offline_s` is the CPU time of the whole training in this process.
    """
    begun = clock.process_time()
    found = training.train(task, search, options)
    family = found.model.cases
    return Comparator(name, family, len(found.runs), clock.process_time() - begun, found.reduced_runs)


def stages(found: FinishedTraining) -> Iterator[Comparator]:
    """The models of a training after every full run.

    `greedy 1`, `greedy 2`, ..., each with the cost of all that came before it.
    """
    for k, model in enumerate(found.models, start=1):
        offline = sum(run.cpu_s for run in found.runs[:k]) + sum(one.training_s for one in found.models[:k])
        evaluated = sum(len(iteration.samples) for iteration in found.outcome.iterations[:k])
        yield Comparator(f"greedy {k}", model.cases, k, offline, evaluated)


def at_system_level(task: TrainingTask) -> TrainingTask:
    """The same with all bodies in one component.

    Numbers of modes by name are left out of the plan, as components have other names.
    """
    raw, plan = task.family(parameters.completed(task.parameters, {})).system, task.plan
    return replace(task, plan=with_components(plan, component.system_level(raw)))


def compare(
    task: TrainingTask, comparators: Sequence[Comparator], full: Full, points: np.ndarray, progress: Progress | None = None
) -> tuple[Row, ...]:
    """Every comparator at the hold-out points (k, d), values in the order of the parameters.

    A point at which the full model has no motion is marked, with a notice, and the others go on.
    """
    rows = parameters.table(task.parameters, points)
    if len(rows) == 0 or len(comparators) == 0:
        raise InputError(say("comparators.compare", "comparators and hold-out points", f"{len(comparators)} and {len(rows)}"))
    tried: list[list[Trial]] = [[] for _ in comparators]
    for number, row in enumerate(rows):
        found = try_all(task, comparators, full, parameters.named(task.parameters, row))
        for trials, one in zip(tried, found, strict=True):
            trials.append(one)
        if progress:
            progress((number + 1) / len(rows))
    return tuple(collect(comparator, trials) for comparator, trials in zip(comparators, tried, strict=True))


def try_all(task: TrainingTask, comparators: Sequence[Comparator], full: Full, values: Mapping[str, float]) -> list[Trial]:
    """Every comparator at one point."""
    truth = full_runs.try_run(task, full, values)
    if isinstance(truth, str):
        return [Trial(math.nan, reason=truth)] * len(comparators)
    raw = task.family(values).system
    return [try_one(task, comparator, raw, truth) for comparator in comparators]


def try_one(task: TrainingTask, comparator: Comparator, raw: System, truth: FullRun) -> Trial:
    """The reduced member against a full run, of which `raw` is the system."""
    begun, made = clock.process_time(), Trial()
    try:
        case = comparator.family(truth.values)
        made = replace(measure_sizes(case.system), prepare_s=clock.process_time() - begun)
        motion = full_runs.run_formed(task, case)
    except FmbsError as error:
        return replace(made, reason=str(error))
    outputs = full_runs.errors_of_outputs(raw, truth, motion)
    errors = (full_runs.wanted_error(task, raw, truth, motion), full_runs.error(task, raw, truth, motion))
    return replace(made, error=errors[0], states=errors[1], outputs=outputs, run_s=motion.statistics.cpu_s, full_s=truth.cpu_s)


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


def run_at_nodes(task: TrainingTask, full: Full, counts: Sequence[int]) -> tuple[np.ndarray, list[FullRun]]:
    """Points (j, d) of a uniform grid of the unit box, the last parameter fastest, and the full runs there."""
    rows = parameters.grid(task.parameters, counts)
    runs = [full(parameters.named(task.parameters, row)) for row in rows]
    return parameters.to_box(task.parameters, rows), runs


def find_closest(places: np.ndarray, here: np.ndarray) -> int:
    """Number of the place (j, d) nearest to a point (d,) of the unit box."""
    return int(np.argmin(np.linalg.norm(places - here, axis=1)))


def in_box(task: TrainingTask, values: Mapping[str, float]) -> np.ndarray:
    """Values as a point (d,) of the unit box."""
    return np.asarray(parameters.to_box(task.parameters, parameters.row_of(task.parameters, values)[None])[0])


def shape(counts: Sequence[int]) -> str:
    return " x ".join(str(count) for count in counts)
