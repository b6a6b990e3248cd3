r"""How sharp a reduced model has to be for a wanted error: eps of truncation and eta of
hyper-reduction, tried on one full run.

    e <= e(eps) + (e(eps, eta) - e(eps)),     e(eps) <= T tolerance,     e(eps, eta) <= (T + H) tolerance

The rest of the tolerance is left for parameters between the full runs. Errors fall about as
sqrt(eps), by a factor that differs from system to system: it is measured, and eps is tightened
until the reduced model at the parameters of the run keeps its share. The error of the step belongs
to full and reduced model alike and is stated beside the others.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, equations (14), (45), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from ...core.errors import FmbsError, InputError, NoModel, say
from ...core.storage.records import dataclass
from ...dynamics.trajectory import Trajectory
from .. import full_runs
from ..full_runs import FullRun, OutputMeasure, TrainingTask
from ..hyper.hyper_reduction import NONE
from ..plan import Plan
from ..reduced_models import reduced_case, train_reduction
from . import output_errors

TRUNCATION, HYPER = 0.1, 0.1  #: shares of the tolerance
# four beams at 1e-2: 2.7 to 28 times as fast as the full model, with the shares above 1.5 to 28;
# nothing is promised for more then
#: where full runs that are not in the model show its error, and none has to be promised by its band
SHOWN = (
    0.3,
    0.2,
)
LARGEST_EPS, SMALLEST_EPS = 1e-6, 1e-24
LARGEST_ETA, SMALLEST_ETA = 1e-2, 1e-6
REFINED = 3  #: halvings of an interval of eps, at most
DECADE = 10.0  #: ratio of its ends down to which it is halved
TRIALS = 8  #: of eps, and of eta
#: ratio of errors that no longer fall while eps falls by so much: by ten, modes may be the same
FLAT, FAR = (
    0.8,
    30.0,
)
SAME = 1.25  #: error over the best one that is as good
UNSTABLE = 1e-3  #: factor to eps where the reduced run fails
SAFE = 0.5  #: of the eps that just keeps its share
NAMED = 3  #: outputs that are named where none is good enough
#: coarser ones err by hundreds of per cent, or have no motion
LADDER_EPS = tuple(10.0**-k for k in range(6, 18, 2))
LADDER_ETA = tuple(10.0**-k for k in range(2, 6))


@dataclass(frozen=True)
class BudgetChoice:
    """What was chosen for a tolerance, with the errors found at one full run.

    `truncation`, `hyper_reduction` and `step` are errors in the measure of the task, as `tolerance`
    is.
    """

    tolerance: float
    eps: float
    eta: float | None  #: None where nothing is sampled
    truncation: float
    hyper_reduction: float  #: what sampling adds
    step: float | None  #: error of the full model's own step, None where it was not measured

    @property
    def statement(self) -> str:
        """The error budget in words."""
        sampled = f"eta = {self.eta:.1g}, " if self.eta is not None else ""
        text = f"for an error of {self.tolerance:.1g}: eps = {self.eps:.1g}, {sampled}chosen at the first full run; there truncation "
        text += f"makes {self.truncation:.1g}"
        text += (
            f" and hyper-reduction adds {self.hyper_reduction:.1g}" if self.eta is not None else ""
        )
        if self.step is None:
            return text
        text += f"; the time step itself makes {self.step:.1g} in full and reduced models alike"
        return text + (
            ", more than the tolerance: a smaller step comes first"
            if self.step > self.tolerance
            else ""
        )


def choose(
    task: TrainingTask,
    run: FullRun,
    tolerance: float,
    step: float | None = None,
    coarsest: bool = False,
) -> BudgetChoice:
    """eps and eta with which the reduced model of one run keeps its shares of the tolerance at the
    parameters of that run.

    `step` is the error of the full model's own step, where it is known. The `coarsest` model is
    searched for where full runs that it does not know show what it is worth: its shares are larger,
    and eps is found within a decade.
    """
    if not 0.0 < tolerance <= 1.0:
        raise InputError(
            say("tolerance", "an error between 0 and 1", tolerance, "1e-4 for instance")
        )
    shares = SHOWN if coarsest else (TRUNCATION, HYPER)
    eps, truncation = choose_eps(task, run, tolerance, shares[0], REFINED if coarsest else 0)
    eta, whole = choose_eta(task, run, shares[1] * tolerance, eps, truncation)
    return BudgetChoice(tolerance, eps, eta, truncation, max(0.0, whole - truncation), step)


def first_eps(tolerance: float) -> float:
    """The eps tried first: the square of the share.

        eps = (0.1 tolerance)^2

    from 1e-24 to 1e-6: errors fall about as sqrt(eps).
    """
    # errors go with the root of eps
    return clip((TRUNCATION * tolerance) ** 2, SMALLEST_EPS, LARGEST_EPS)


def choose_eps(
    task: TrainingTask, run: FullRun, tolerance: float, part: float, refined: int
) -> tuple[float, float]:
    """The eps that keeps this part of the tolerance, halved in size so often, and the error it
    makes without hyper-reduction.
    """
    share = part * tolerance
    hyper = task.plan.hyper
    eps = clip(share**2, SMALLEST_EPS, LARGEST_EPS)
    plain = hyper if hyper.tolerance is None else NONE
    found: dict[float, float] = {}
    for _ in range(TRIALS):
        found[eps] = error_at(task, run, replace(task.plan, tolerance=eps, modes=None, hyper=plain))
        if found[eps] <= share or eps <= SMALLEST_EPS or stays(found):
            break
        # the same law from the error that was found, with some room, since modes come one by one
        factor = SAFE * (share / found[eps]) ** 2 if math.isfinite(found[eps]) else UNSTABLE
        eps = clip(eps * max(factor, UNSTABLE), SMALLEST_EPS, LARGEST_EPS)
    least = min(found.values())
    best = max(eps for eps in found if found[eps] <= (share if least <= share else SAME * least))
    for _ in range(refined if found[best] <= share else 0):
        # coarse models err by anything, and say little of the eps that would do: the law has jumped
        # too far behind them
        if (
            rough := min((eps for eps in found if found[eps] > share and eps > best), default=best)
        ) <= DECADE * best:
            break
        middle = math.sqrt(rough * best)
        found[middle] = error_at(
            task, run, replace(task.plan, tolerance=middle, modes=None, hyper=plain)
        )
        best = middle if found[middle] <= share else best
    if not found[best] <= tolerance:
        worst = worst_outputs(
            task, run, replace(task.plan, tolerance=best, modes=None, hyper=plain), tolerance
        )
        expected = f"at least {found[best]:.1g}, the best that the reduced model reaches{worst}"
        remedy = "take snapshots more often, leave these outputs out, or lower the tolerance of Newton's method"
        raise NoModel(say("tolerance", expected, tolerance, remedy))
    return best, found[best]


def stays(found: Mapping[float, float]) -> bool:
    """Whether the last errors by eps are what other things than truncation make: snapshots too few,
    or Newton's tolerance.
    """
    if len(found) < 3:
        return False
    (first, before), _, (last, after) = [*found.items()][-3:]
    return math.isfinite(before) and after > FLAT * before and last * FAR < first


def choose_eta(
    task: TrainingTask, run: FullRun, adds: float, eps: float, truncation: float
) -> tuple[float | None, float]:
    """The largest eta that `adds` no more than this to the error of truncation, and the whole
    error.
    """
    hyper = task.plan.hyper
    share = adds + truncation
    if hyper.tolerance is None:
        return None, truncation
    eta = clip(hyper.tolerance, SMALLEST_ETA, LARGEST_ETA)
    found: dict[float, float] = {}
    for _ in range(TRIALS):
        found[eta] = error_at(
            task,
            run,
            replace(task.plan, tolerance=eps, modes=None, hyper=replace(hyper, tolerance=eta)),
        )
        if found[eta] <= share or eta <= SMALLEST_ETA:
            break
        # tenths: a few points more or less a trial, each of them a training
        eta = clip(0.1 * eta, SMALLEST_ETA, LARGEST_ETA)
    best = min(found, key=lambda eta: found[eta])
    return best, found[best]


def coarsest(
    plan: Plan, error: Callable[[Plan], float], largest: float, eps: bool, eta: bool
) -> Plan:
    """The coarsest plan whose error is at most the `largest`, with eps or eta from their ladders
    where they are free.

    eps is found first, without sampling where eta is free, then eta; the best one where none is
    good enough. `error(plan)` is infinite where a reduced model fails.
    """
    sampled = eta and plan.hyper.tolerance is not None

    def first(plans: Iterator[Plan]) -> Plan:
        tried: list[tuple[float, Plan]] = []
        for one in plans:
            tried.append((error(one), one))
            if tried[-1][0] <= largest:
                return one
        return min(tried, key=lambda pair: pair[0])[1]

    if eps:
        hyper = NONE if sampled else plan.hyper
        chosen = first(replace(plan, tolerance=one, modes=None, hyper=hyper) for one in LADDER_EPS)
        plan = replace(chosen, hyper=plan.hyper)
    if sampled:
        plan = first(replace(plan, hyper=replace(plan.hyper, tolerance=one)) for one in LADDER_ETA)
    return plan


def motion_at(task: TrainingTask, run: FullRun, plan: Plan) -> Trajectory:
    """The motion of the reduced model of one run at its own parameters."""
    with_plan = replace(task, plan=plan)
    return full_runs.run_formed(
        with_plan, reduced_case(with_plan, train_reduction(with_plan, [run]), run.values)
    )


def error_at(task: TrainingTask, run: FullRun, plan: Plan) -> float:
    """Error of the reduced model of one run at its own parameters; infinite where it fails."""
    try:
        return full_runs.wanted_error(
            task, task.family(run.values).system, run, motion_at(task, run, plan)
        )
    except FmbsError:
        return math.inf


def worst_outputs(task: TrainingTask, run: FullRun, plan: Plan, tolerance: float) -> str:
    """The outputs whose error is beyond a tolerance, the worst first, in brackets; empty where none
    can be named.
    """
    if not isinstance(task.measure, OutputMeasure):
        return ""
    try:
        found = full_runs.errors_of_outputs(
            task.family(run.values).system, run, motion_at(task, run, plan)
        )
    except FmbsError:
        return ""
    parts = output_errors.parts(found, task.measure.tolerances)
    beyond = sorted(
        (column for column in parts if parts[column] > tolerance), key=lambda column: -parts[column]
    )[:NAMED]
    return (
        f" ({', '.join(f'{column}: {parts[column]:.1g}' for column in beyond)})" if beyond else ""
    )


def clip(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


def with_choice(plan: Plan, choice: BudgetChoice) -> Plan:
    """The plan with the chosen tolerances.

    eps and eta of the choice, without a number of modes.
    """
    return replace(
        plan, tolerance=choice.eps, modes=None, hyper=replace(plan.hyper, tolerance=choice.eta)
    )
