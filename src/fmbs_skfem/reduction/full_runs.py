r"""What is trained, its full runs, and what is kept of them: bases and training states are made of
that.

    q(t; mu) = q0(mu) + X,   X = U S W^T,   what is kept of a run is U, S and S W^T                                            (50)

q0(mu) is the initial state of the sample itself, so that every sample starts in its reduced space,
also where its shape depends on parameters. X satisfies the linear constraints inside a component
without their constant parts. Factors are truncated far below the modes that a reduced model keeps.
Of a task without parameters the snapshots themselves are kept.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equation (50), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import TypeAlias

import numpy as np

from ..core.errors import InputError, SolverError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.ranges import Parameter
from ..dynamics.output_errors import common_times
from ..dynamics.outputs import body_coordinates
from ..dynamics.trajectory import Trajectory
from ..systems.assembly import eliminate
from ..systems.system import System, sizes
from . import cases
from . import parameters as boxes
from .accuracy import output_errors
from .accuracy.errors import BLOCK, mean_error, notify_other_end
from .accuracy.output_errors import OutputError
from .cases import Case, Family
from .plan import Plan, newton_for
from .spaces import pod
from .spaces.component import (
    all_directions,
    inner_constraints,
    is_resting,
    is_rigid,
    mass_of,
    metric_of,
    rows_of,
    satisfy,
)
from .spaces.galerkin import snapshots

FINER = 1e-4  #: eps of the factors over that of the bases
ALL = 1e-20  #: eps of the factors where bases have a given number of modes


Measure: TypeAlias = Callable[[System, "FullRun", Trajectory], float]


@dataclass(frozen=True)
class TrainingTask:
    """What is trained: a family of full systems, one of them where there are no parameters, and how
    its runs are reduced.

    `train` makes a reduced model of it. `family(values)` is the full case at values of the
    parameters, with all multipliers; `form` changes its system into the one that is run, `interval`
    [s] says which states are snapshots.
    """

    family: Family  #: full systems with all multipliers
    parameters: tuple[Parameter, ...]  #: empty for one system
    plan: Plan
    interval: float | np.ndarray  #: between snapshots, or their times (s,) [s]
    form: Callable[[System], System] = eliminate  #: of the full system that is run
    measure: Measure | None = None  #: e(mu), what is predicted; None for the error of the states
    code: str = ""  #: hash of the files whose functions the family takes by their names, as laws of one's own
    #: gives the inputs of a case, full or reduced, what they have while it runs
    signals: Callable[[Case], Case] | None = None

    def driven(self, case: Case) -> Case:
        """A case as it runs."""
        return self.signals(case) if self.signals else case


@dataclass(frozen=True)
class Factor:
    """Deviations X of one component from its initial state, modes @ coefficients.

        X ~ U S W^T,    U^T W_b U = 1

    with X (n, s), U (n, r) orthonormal in the mass of the component over that of all bodies; S [m].
    """

    modes: np.ndarray  #: (n, r) U, orthonormal in the mass
    values: np.ndarray  #: (r,) S
    coefficients: np.ndarray  #: (r, s) S W^T


@dataclass(frozen=True)
class FullRun:
    """The full model at one point.

    What a training keeps of a full motion: factors of every component, or the snapshots of a task
    without parameters, with times, outputs and cost.
    """

    values: dict[str, float]
    times: np.ndarray  #: (s,) [s]
    factors: dict[str, Factor]
    cpu_s: float
    #: columns (s,); none where they were not kept
    outputs: Mapping[str, np.ndarray] = field(default_factory=dict)
    #: (s, q) the snapshots, in place of factors, of a task without parameters
    q: np.ndarray | None = None
    unresolved: bool = False  #: its time step is too large for the motion
    #: largest error of an output that reduced parts in it make, over its range
    part_error: float = 0.0


Full: TypeAlias = Callable[[Mapping[str, float]], FullRun]


@checked
def task_of(
    case: Case,
    plan: Plan,
    interval: float | np.ndarray,
    form: Callable[[System], System] = eliminate,
) -> TrainingTask:
    """The task without parameters: one full case with all multipliers, snapshots every `interval`
    [s] or at its times (s,) [s].

    `form` makes the system that is run of it, by default without the linear constraints.
    """
    return TrainingTask(lambda values: case, (), plan, interval, form)


def full_run(task: TrainingTask, values: Mapping[str, float], sharp: bool = True) -> FullRun:
    """The full model at a point, sharp enough for its snapshots, or with the Newton iteration of
    its scene.

    Newton's tolerance is, where it is `sharp`, at most

        1e-6 sqrt(eps)

    SolverError where it fails, InputError where fewer than two snapshots lie in its duration.
    """
    case = task.family(values)
    return keep_factors(task, values, case.system, run_case(task, case, sharp))


def run_of_motion(task: TrainingTask, motion: Trajectory) -> FullRun:
    """The run of a task without parameters from a motion of its full system, with the snapshots
    among its stored states.

    `motion` has to be that of the task's own case. InputError where its snapshots are not among the
    stored states.
    """
    data = snapshots(motion, task.interval)
    return FullRun(
        {},
        data.times,
        {},
        motion.statistics.cpu_s,
        q=data.q,
        unresolved=motion.statistics.unresolved,
    )


def run_case(task: TrainingTask, case: Case, sharp: bool = True) -> Trajectory:
    """The motion of a full case, stored at the snapshots."""
    newton = newton_for(case.newton, task.plan.tolerance) if sharp else case.newton
    return run_formed(task, replace(case, system=task.form(case.system), newton=newton))


def run_formed(task: TrainingTask, case: Case) -> Trajectory:
    """The motion of a case in its form, full or reduced, stored at the snapshots.

    SolverError where the motion fails.
    """
    return cases.run(task.driven(case), snapshot_steps(case, task.interval))


def keep_factors(
    task: TrainingTask, values: Mapping[str, float], raw: System, motion: Trajectory
) -> FullRun:
    """What is kept of a motion of the full system `raw`, stored at the snapshots."""
    q = body_coordinates(motion)
    unresolved = motion.statistics.unresolved
    off = max((motion.part_errors or {}).values(), default=0.0)
    known = dict(values), motion.times
    cost = motion.statistics.cpu_s
    columns = output_errors.columns(motion)
    if not task.parameters:
        return FullRun(*known, {}, cost, columns, q, unresolved, off)
    found = {
        name: factorise(task.plan, raw, q, members)
        for name, members in task.plan.components.items()
    }
    return FullRun(*known, found, cost, columns, unresolved=unresolved, part_error=off)


def factorise(plan: Plan, raw: System, q: np.ndarray, members: Sequence[str]) -> Factor:
    """Truncated factors of a component's deviations X from its initial state, for snapshots q (s,
    q).

        X ~ U S W^T,    sum_{i>r} s_i^2 / sum_i s_i^2 <= 1e-4 eps

    Rigid components keep all directions, components at rest have none. eps is that of the plan;
    where it has a number of modes, the bound is 1e-20.
    """
    rows = rows_of(raw, members)
    W = metric_of(raw, rows)
    (A, a) = inner_constraints(raw, rows)
    X = satisfy(q[:, rows] - raw.lift(raw.x0)[rows], A, 0 * a).T
    if is_rigid(raw, members):
        modes = all_directions(W, A)
        return Factor(modes, pod.left_singular(W, X)[1][: modes.shape[1]], modes.T @ (W @ X))
    if is_resting(raw, float(np.sqrt(np.maximum(np.sum(X * (W @ X), axis=0), 0.0)).max())):
        return Factor(np.zeros((len(rows), 0)), np.zeros(0), np.zeros((0, len(q))))
    eps = ALL if plan.modes is not None else FINER * plan.tolerance
    basis = pod.basis(X, eps, mean=np.zeros(len(rows)), metric=W, second=mass_of(raw, rows))
    return Factor(
        basis.modes, basis.singular_values[: basis.modes.shape[1]], basis.modes.T @ (W @ X)
    )


def snapshot_steps(case: Case, interval: float | np.ndarray) -> np.ndarray:
    """Numbers of the steps whose states are snapshots, 0 first; the last step is one where an
    interval reaches it.

    Rising numbers (s,); InputError for fewer than two.
    """
    last = round(case.duration / case.scheme.step)
    h = case.scheme.step
    if isinstance(interval, np.ndarray):
        numbers = np.round(interval / h).astype(np.int64)
        numbers = np.union1d(0, numbers[(numbers >= 0) & (numbers <= last)])
    else:
        numbers = np.arange(0, last + 1, max(1, round(interval / h)))
    if len(numbers) < 2:
        raise InputError(
            say(
                "snapshots",
                f"times within the duration of {case.duration:g} s",
                interval,
                "store more states",
            )
        )
    return numbers


def states(
    task: TrainingTask, raw: System, run: FullRun, samples: slice | np.ndarray = slice(None)
) -> np.ndarray:
    """Body coordinates (s, q) of some samples of a run; `raw` is the full system at its parameters.

        q = q0 + sum_b U^b S W^T

    for all components b; the snapshots themselves of a task without parameters.
    """
    if run.q is not None:
        return run.q[samples]
    start = raw.lift(raw.x0)
    q = np.tile(start, (len(run.times[samples]), 1))
    for name, members in task.plan.components.items():
        known = run.factors[name]
        q[:, rows_of(raw, members)] += (known.modes @ known.coefficients[:, samples]).T
    return q


def error(task: TrainingTask, raw: System, run: FullRun, motion: Trajectory) -> float:
    """Error of the displacements of a reduced motion at the samples of a full run.

        int |q - p|_M dt / int |q - q0|_M dt

    of the full states q and the reduced ones p. The norm is the root mean square over the mass [m].
    InputError where they have not the same snapshots; a notice where one ends earlier.
    """
    run, motion = while_both_run(run, motion)
    block = max(1, BLOCK // raw.size)
    apart = []
    size = []
    for first in range(0, len(run.times), block):
        samples = slice(first, first + block)
        q = states(task, raw, run, samples)
        apart.append(sizes(raw, q - body_coordinates(motion.part(samples))))
        size.append(sizes(raw, q - raw.lift(raw.x0)))
    return mean_error(run.times, np.concatenate(apart), np.concatenate(size))


def while_both_run(run: FullRun, motion: Trajectory) -> tuple[FullRun, Trajectory]:
    """Both at their common samples: all of them, unless an event stops one earlier than the other.

    InputError where their times are not those of the same snapshots.
    """
    shorter = min(len(run.times), len(motion.times))
    mine, others = common_times("error of a reduced run", run.times, motion.times)
    if len(mine) < shorter - 1 or mine[-1] != len(mine) - 1 or others[-1] != len(mine) - 1:
        got = f"{len(mine)} of {shorter} samples that both have"
        raise InputError(
            say(
                "error of a reduced run",
                "the times of the full run",
                got,
                "take the same snapshots and step",
            )
        )
    notify_other_end(run.times, motion.times)
    return thin(run, mine), motion.part(slice(len(mine)))


def wanted_error(task: TrainingTask, raw: System, run: FullRun, motion: Trajectory) -> float:
    """e(mu) of the task at a full run; the error of the states where it has no measure, or one that
    says nothing.

    `raw` is the full system at the parameters of `run`, `motion` the reduced motion at the same
    snapshots.
    """
    found = math.nan if task.measure is None else task.measure(raw, run, motion)
    return error(task, raw, run, motion) if math.isnan(found) else found


@dataclass(frozen=True)
class OutputMeasure:
    """e(mu) of the outputs: the largest part of a range, or where there are tolerances [their unit]
    the largest part of them.

        max_c error_c / range_c    or    max_c error_c / tolerance

    over all columns c. InputError where a reduced model does not know an output that has a
    tolerance.
    """

    tolerances: Mapping[str, float] = field(default_factory=dict)  #: by output

    def __call__(self, raw: System, run: FullRun, motion: Trajectory) -> float:
        found = errors_of_outputs(raw, run, motion)
        lost = sorted(
            {
                one.output
                for one in found.values()
                if one.output in self.tolerances and math.isnan(one.error)
            }
        )
        if lost:
            got = f"{', '.join(lost)}, which the reduced model does not know"
            raise InputError(
                say("training.tolerance", "outputs of the reduced model", got, "leave them out")
            )
        return output_errors.measure(found, self.tolerances)


def errors_of_outputs(raw: System, run: FullRun, motion: Trajectory) -> dict[str, OutputError]:
    """Errors of the outputs of a reduced motion at the samples of a full run; none where those of
    the run were not kept.

    By column, at the samples that both have; `raw` is the full system at the parameters of the run.
    """
    if not run.outputs:
        return {}
    run, motion = while_both_run(run, motion)
    nothing = output_errors.round_off(raw, run.times)
    found = output_errors.from_first_step(motion, run.outputs, output_errors.columns(motion))
    return output_errors.between(run.outputs, found, raw.outputs, nothing=nothing)


def step_error(task: TrainingTask, values: Mapping[str, float], run: FullRun) -> float:
    """Error of the full model's own step in the measure of the task, for a method of second order.

        |q_h - q_2h| / 3

    One more full run is made, with steps of 2 h, h that of the case. Samples of odd steps are left
    out.
    """
    case = task.family(values)
    mine = np.round(run.times / case.scheme.step).astype(np.int64)
    pairs = round(case.duration / case.scheme.step) // 2
    # not where an event has stopped the run
    stored = np.abs(mine * case.scheme.step - run.times) <= 1e-9 * run.times[-1]
    even = np.flatnonzero((mine % 2 == 0) & (mine <= 2 * pairs) & stored)
    doubled = cases.with_step(
        task.driven(replace(case, system=task.form(case.system))), 2.0 * case.scheme.step
    )
    rough = cases.run(
        replace(cases.unchecked(doubled), duration=pairs * doubled.scheme.step), mine[even] // 2
    )
    return wanted_error(task, case.system, thin(run, even), rough) / 3.0


def thin(run: FullRun, samples: np.ndarray) -> FullRun:
    """A full run at some of its samples."""
    factors = {
        name: replace(one, coefficients=one.coefficients[:, samples])
        for name, one in run.factors.items()
    }
    outputs = {name: values[samples] for name, values in run.outputs.items()}
    q = None if run.q is None else run.q[samples]
    return replace(run, times=run.times[samples], factors=factors, outputs=outputs, q=q)


def try_run(task: TrainingTask, full: Full, values: Mapping[str, float]) -> FullRun | str:
    """The full run at a point, or the reason why the full model has no motion there, with a notice.

    `values` by name [SI]; a text for InputError and SolverError, all other errors pass.
    """
    try:
        return full(values)
    except (SolverError, InputError) as error:
        notify(
            f"the full model has no motion at {boxes.text(task.parameters, values)}, the point is left out: {error}"
        )
        return str(error)
