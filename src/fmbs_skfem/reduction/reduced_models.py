r"""Reduced models: one basis a component for all parameters, trained on one full run or on several.

    U^b = left singular vectors of [U_1 S_1, U_2 S_2, ...],   truncated to eps                                            (50), (14)
    q^b(t; mu) = q0^b(mu) + m^b + U^b xi^b,    m^b = 0;  for one system, whose parameters are fixed, the mean deviation   (9), (18)

Which constraint rows are dropped is decided once for all parameters. The reduced systems of all
parameters are polynomials of them (`affine`), so that a new value neither assembles nor projects
anything; where they are none, as where a length turns the modes, the full system of every value is
assembled and projected.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import contextlib
import math
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import partial

import numpy as np

from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.ranges import Parameter
from ..dynamics.outputs import body_coordinates
from ..dynamics.trajectory import Trajectory
from ..systems.system import System, keep_constraints, sizes
from . import affine, full_runs
from .accuracy import errors
from .affine import ParametricCase
from .cases import Case, Family
from .full_runs import FullRun, TrainingTask, snapshot_steps, states
from .hyper import hyper_reduction
from .hyper.ecsw import Selection
from .hyper.hyper_reduction import NONE, HyperReduction, Rule, TrainingRun
from .plan import Components, modes_of, newton_of_reduced
from .spaces import against_joints, component, galerkin, invariant, kept_rows, pod
from .spaces.component import (
    all_directions,
    inner_constraints,
    is_rigid,
    mass_of,
    metric_of,
    rows_of,
    satisfy,
)
from .spaces.galerkin import Snapshots
from .spaces.kept_rows import FEW, KeptRows, Names
from .spaces.pod import Basis

Bases = Mapping[str, Basis]

PLAIN = NONE.train([])
TRIED = 2000  #: steps of a reduced run without hyper-reduction that says which rows lock: a tenth of those of example 3
ROUGH = 3e-3  #: part of a motion outside of its basis, eps = 1e-5: errors of reduced motions are 10 to 1000 times larger
KEEPS = 1e-10  #: modes that violate a linear constraint by less keep it to round-off


@dataclass(frozen=True)
class ReducedModel:
    """A reduced model for all parameters, or of one system, and what it took to make it.

    `cases(values)` is the reduced case at values of the parameters, `cases({})` of one without any.
    `left_out` names the constraint rows that it has not, as joint.row.
    """

    cases: Family  #: reduced cases: polynomials of the parameters, in milliseconds, or made from the full ones
    modes: Mapping[str, int]  #: by component
    selections: tuple[Selection, ...] = ()
    training_s: float = 0.0  #: CPU time of bases, projection, hyper-reduction and polynomials [s]
    #: about the initial state; empty where the model was read from a file
    bases: Bases = field(default_factory=dict)
    components: Components = field(default_factory=dict)  #: their bodies; the same
    obstacle: str = ""  #: why the cases are no polynomials of the parameters
    #: constraint rows, and what leaving them out does
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def parametric(self) -> ParametricCase:
        """The polynomials, of which a file can be made; refused where there are none."""
        if isinstance(self.cases, ParametricCase):
            return self.cases
        remedy = "run its samples in this process"
        raise InputError(
            say("reduced model", "numbers that are polynomials of the parameters", "others", remedy)
        )

    @property
    def system(self) -> System:
        """The reduced system, at the nominal values of parameters."""
        return (
            self.cases.nominal.system
            if isinstance(self.cases, ParametricCase)
            else self.cases({}).system
        )


@dataclass(frozen=True)
class TrainedReduction:
    """What makes a reduced system of the full system at any parameters.

        q^b = q0^b(mu) + m^b + U^b xi^b

    One basis a component for all parameters.
    """

    bases: Bases  #: of deviations from the initial state
    rows: Names  #: constraint rows that are kept
    rule: Rule = PLAIN
    runs: tuple[TrainingRun, ...] = ()  #: what it was made of
    #: (r,) from x0 to the start of the first run, where runs start in their equilibrium
    rest: np.ndarray | None = None
    training_s: float = 0.0  #: CPU time [s]
    #: constraint rows, and what leaving them out does
    left_out: Mapping[str, str] = field(default_factory=dict)


def with_polynomials(task: TrainingTask) -> TrainingTask:
    """The task with a family that assembles nothing, where its full systems are polynomials of the
    parameters.

    As it is where they are none.
    """
    with contextlib.suppress(InputError):
        return replace(task, family=affine.fit(task.family, task.parameters))
    return task


def make_model(task: TrainingTask, runs: Sequence[FullRun], obstacle: str = "") -> ReducedModel:
    """The reduced model of all runs, as the task's plan says; with the obstacle of an earlier one
    no polynomials are sought.

    InputError where nothing moves in the runs, or a component has too few modes for its joints;
    SolverError where the hyper-reduction does not reach its tolerance. An obstacle is told by a
    notice.
    """
    return finish(task, train_reduction(task, runs), obstacle)


def train_reduction(task: TrainingTask, runs: Sequence[FullRun]) -> TrainedReduction:
    """Bases, constraint rows and hyper-reduction of all runs.

    `project_runs`, then `hyper_reduce` with the plan's own hyper-reduction.
    """
    return hyper_reduce(project_runs(task, runs), task.plan.hyper)


def project_runs(task: TrainingTask, runs: Sequence[FullRun]) -> TrainedReduction:
    """Bases and constraint rows of all runs, without hyper-reduction.

    `runs` are full runs of the task, one at least; their bases serve all parameters, see the
    module.
    """
    begun = clock.process_time()
    systems = [task.family(run.values).system for run in runs]
    found = bases(task, systems[0], runs)
    plain = [project(task, found, raw) for raw in systems]
    kept = find_kept_rows(task, systems, runs, plain)
    used = tuple(
        TrainingRun(raw, with_rows(system, kept.rows), partial(states, task, raw, run))
        for raw, run, system in zip(systems, runs, plain, strict=True)
    )
    rest = find_rest(task, systems[0], runs[0], plain[0])
    spent = clock.process_time() - begun
    return TrainedReduction(
        found, kept.rows, runs=used, rest=rest, training_s=spent, left_out=kept.left_out
    )


def find_rest(task: TrainingTask, raw: System, run: FullRun, system: System) -> np.ndarray | None:
    """The deviation (r,) from x0 with which a full run starts, in the unknowns of the reduced
    system; None of a start at x0.
    """
    if task.family(run.values).scheme.start == "reference":
        return None
    return np.asarray(
        component.projected(system, states(task, raw, run, slice(0, 1)))[0] - system.x0
    )


def near_rest(rest: np.ndarray | None, system: System) -> System:
    """The reduced system with what its training knows of the equilibrium, (r,) from x0."""
    return system if rest is None else replace(system, near=system.x0 + rest)


def hyper_reduce(reduction: TrainedReduction, hyper: HyperReduction) -> TrainedReduction:
    """The reduction with another hyper-reduction, trained on its runs.

    Bases and constraint rows stay; the CPU time [s] of the training is added.
    """
    begun = clock.process_time()
    rule = hyper_reduction.train(hyper, reduction.runs)
    return replace(
        reduction, rule=rule, training_s=reduction.training_s + clock.process_time() - begun
    )


def finish(task: TrainingTask, reduction: TrainedReduction, obstacle: str = "") -> ReducedModel:
    """The model of a reduction: polynomials of the parameters, unless an obstacle to them is known,
    or one reduced system.

    The CPU time [s] of the polynomials is added to that of the training. A notice says what is in
    the way of them.
    """
    begun = clock.process_time()
    modes = {name: basis.modes.shape[1] - basis.against for name, basis in reduction.bases.items()}
    found: Family
    if task.parameters:
        found = partial(reduced_case, task, replace(reduction, runs=()))
        found, obstacle = (found, obstacle) if obstacle else fit_polynomials(found, task.parameters)
    else:
        first = reduction.runs[0]
        own = task.family({})
        if first.full is own.system:
            only = with_system(
                task, own, near_rest(reduction.rest, reduction.rule.apply(first.system))
            )
        else:  # inputs were excited in all of them
            only = reduced_case(task, reduction, {})
        found = lambda values: only  # noqa: E731
    spent = reduction.training_s + clock.process_time() - begun
    known = reduction.bases, task.plan.components, obstacle, reduction.left_out
    return ReducedModel(found, modes, reduction.rule.selections, spent, *known)


def fit_polynomials(family: Family, parameters: Sequence[Parameter]) -> tuple[Family, str]:
    """The polynomials of a family; or the family where it has none, with a notice, and the reason."""
    try:
        return affine.fit(family, parameters), ""
    except InputError as problem:
        notify(
            f"the reduced model is no polynomial of its parameters, every value assembles the full system: {problem}"
        )
        return family, str(problem)


def bases(task: TrainingTask, raw: System, runs: Sequence[FullRun]) -> dict[str, Basis]:
    """Modes of every component from what is kept of all runs, of deviations from the initial state.

        [U_1 S_1, U_2 S_2, ...]    (50)

    Modes (n, r) are their left singular vectors, truncated to the plan's eps or number of modes;
    `raw` is a full system of the family. InputError where nothing moves.
    """
    plan = task.plan
    found = {}
    if runs[0].q is not None:
        data = Snapshots(
            *(np.concatenate([getattr(run, part) for run in runs]) for part in ("times", "q"))
        )
        start = raw.lift(raw.x0)
        alone = galerkin.bases(
            raw, data, plan.components, plan.tolerance, plan.modes, plan.invariant
        )
        found = {
            name: replace(one, mean=one.mean - start[rows_of(raw, plan.components[name])])
            for name, one in alone.items()
        }
        tell_truncated(found, raw, plan.components)
        return (
            found
            if plan.invariant
            else against_joints.add_directions(
                raw, plan.components, found, few_states(task, raw, runs)
            )
        )
    moved = {
        name: max(run.factors[name].values.max(initial=0.0) for run in runs)
        for name in plan.components
    }
    component.refuse_rest(raw, plan.components, moved)
    for name, members in plan.components.items():
        rows = rows_of(raw, members)
        count = modes_of(plan.modes, name)
        wanted = (plan.tolerance if count is None else None, count)
        W = metric_of(raw, rows)
        A = inner_constraints(raw, rows)[0]
        if is_rigid(raw, members):
            values = np.concatenate([run.factors[name].values for run in runs])
            found[name] = Basis(all_directions(W, A), np.zeros(len(rows)), np.sort(values)[::-1])
            continue
        known = [
            (run.factors[name].modes, run.factors[name].values)
            for run in runs
            if len(run.factors[name].values)
        ]
        if component.is_resting(raw, moved[name]):
            known = [(component.any_motion(A), np.ones(1))]
            wanted = (galerkin.COARSEST, None)
        if plan.invariant:
            basis = invariant.basis(raw, rows, np.hstack([U * s for U, s in known]), *wanted)
            found[name] = replace(basis, mean=np.zeros(len(rows)))
            continue
        basis = pod.update(known, np.zeros(len(rows)), *wanted, metric=W, second=mass_of(raw, rows))
        found[name] = galerkin.keeping(raw, rows, A, basis)
    tell_truncated(found, raw, plan.components)
    return (
        found
        if plan.invariant
        else against_joints.add_directions(raw, plan.components, found, few_states(task, raw, runs))
    )


def few_states(
    task: TrainingTask, raw: System, runs: Sequence[FullRun]
) -> Iterator[against_joints.State]:
    """Some states of every run, (q,), and their times [s]."""
    for run in runs:
        few = np.arange(0, len(run.times), max(1, len(run.times) // FEW))
        yield from zip(states(task, raw, run, few), run.times[few].tolist(), strict=True)


def tell_truncated(found: Bases, raw: System, components: Components) -> None:
    """A notice where bases leave out so much of the motion that its reduced model is a rough one."""
    for name, members in components.items():
        s = found[name].singular_values
        left = (
            math.sqrt(float(np.sum(s[found[name].modes.shape[1] :] ** 2) / np.sum(s**2)))
            if s.any()
            else 0.0
        )
        if (
            left > ROUGH
            and not is_rigid(raw, members)
            and not component.is_resting(raw, float(s[0]))
        ):
            text = f"component '{name}': its {found[name].modes.shape[1]} modes leave out {left:.1%} of the motion (root mean square)"
            notify(
                f"{text}, and the reduced motion may miss it by far more: take a smaller eps, 1e-12 for instance, or more modes"
            )


def about_start(task: TrainingTask, raw: System, found: Bases) -> dict[str, Basis]:
    """The bases of one sample: its own initial state, and modes that keep its linear constraints
    inside components.
    """
    mine = {}
    start = raw.lift(raw.x0)
    for name, members in task.plan.components.items():
        rows = rows_of(raw, members)
        own = found[name]
        A, a = inner_constraints(raw, rows)
        count = own.modes.shape[1] - own.against
        if (
            len(a) and np.abs(A @ own.modes[:, :count]).max(initial=0.0) > KEEPS * np.abs(A).max()
        ):  # one at rest has no modes
            kept = satisfy(own.modes[:, :count].T, A, 0 * a).T
            own = replace(
                own,
                modes=np.ascontiguousarray(np.hstack([kept, own.modes[:, count:]])),
                factors=None,
            )
        mine[name] = replace(own, mean=start[rows] + own.mean)
    return mine


def project(task: TrainingTask, found: Bases, raw: System) -> System:
    """The reduced system of a full one, with all constraint rows that are not inside of components.

    All linear constraints between components keep multipliers unless the plan eliminates them;
    `found` are bases of deviations from the initial state.
    """
    return galerkin.reduce_system(
        raw, task.plan.components, about_start(task, raw, found), task.plan.eliminate
    )


def with_rows(system: System, rows: Names) -> System:
    """The reduced system with the constraint rows of these names."""
    kept = [k for k, name in enumerate(system.constraints.names) if name in rows]
    return keep_constraints(system, np.array(kept, dtype=np.int64))


def find_kept_rows(
    task: TrainingTask, systems: Sequence[System], runs: Sequence[FullRun], plain: Sequence[System]
) -> KeptRows:
    """The constraint rows that the reduced systems `plain` of some runs keep.

    Of rows that depend on each other some are left out, and those that lock the motion, see
    `spaces.kept_rows`. The reduced systems are run for that.
    """
    names = plain[0].constraints.names
    if not names:
        return KeptRows(frozenset(), {})
    samples = []
    for raw, run, reduced_system in zip(systems, runs, plain, strict=True):
        few = np.arange(0, len(run.times), max(1, len(run.times) // FEW))
        samples.append(
            kept_rows.sample_rows(raw, reduced_system, states(task, raw, run, few), run.times[few])
        )
    known = frozenset(names[k] for k in kept_rows.independent_rows(samples))
    trials = [
        partial(
            run_without,
            short_run(task, run),
            raw,
            run,
            near_rest(find_rest(task, raw, run, system), system),
            known,
        )
        for raw, run, system in list(zip(systems, runs, plain, strict=True))[
            :: max(1, len(runs) - 1)
        ]
    ]
    error = kept_rows.try_rows(lambda out: max(trial(out) for trial in trials))
    return kept_rows.choose(
        names, samples, error, partial(missed_part, task, systems[0], runs[0], plain[0])
    )


def short_run(task: TrainingTask, run: FullRun) -> TrainingTask:
    """The task with the motion of a run as long as it takes to see which rows lock: TRIED steps and
    FEW snapshots at most.
    """
    case = task.family(run.values)
    steps = min(
        round(case.duration / case.scheme.step),
        max(TRIED, int(snapshot_steps(case, task.interval)[:FEW][-1])),
    )
    return replace(
        task, family=lambda values: replace(case, duration=steps * case.scheme.step), parameters=()
    )


def run_without(
    task: TrainingTask, raw: System, run: FullRun, system: System, known: Names, out: Names
) -> float:
    """Error of the motion of a reduced system with the `known` constraint rows but for some."""
    case = with_system(task, task.family({}), with_rows(system, known - out))
    known_run, motion = full_runs.while_both_run(run, full_runs.run_formed(task, case))
    q = states(task, raw, known_run)
    apart, size = sizes(raw, q - body_coordinates(motion)), sizes(raw, q - raw.lift(raw.x0))
    return errors.over(float(apart.max()), float(size.max()))


def missed_part(task: TrainingTask, raw: System, run: FullRun, system: System) -> float:
    """What the space of a reduced system misses of a run, the least error that there can be.

        int |q - P q|_M dt / int |q - q0|_M dt

    P takes states q to the nearest ones of the space.
    """
    q = states(task, raw, run)
    nearest = (system.lift.matrix @ component.projected(system, q).T).T + system.lift.offset
    return errors.mean_error(run.times, sizes(raw, q - nearest), sizes(raw, q - raw.lift(raw.x0)))


def reduced_case(
    task: TrainingTask, reduction: TrainedReduction, values: Mapping[str, float]
) -> Case:
    """The reduced case at some parameters, made from the full one.

    The full system is assembled and projected anew, rows are chosen by name and the trained rule is
    applied.
    """
    case = task.family(values)
    system = reduction.rule.apply(
        with_rows(project(task, reduction.bases, case.system), reduction.rows)
    )
    return with_system(task, case, near_rest(reduction.rest, system))


def with_system(task: TrainingTask, case: Case, system: System) -> Case:
    """The case of a reduced system in place of the full one."""
    return replace(case, system=system, newton=newton_of_reduced(case.newton, task.plan.tolerance))


def indicator(task: TrainingTask, motion: Trajectory, values: Mapping[str, float]) -> float:
    """Error indicator [m s] of a reduced motion; `task.family` gives the full system whose residual
    is taken.

        I = c int |R|_g dt    (49)

    See `errors.indicator`; `motion` is that of the reduced case at `values`.
    """
    case = task.driven(task.family(values))
    return errors.indicator(case.system, motion, case.scheme)
