r"""Greedy choice of full runs over candidate parameters, with a Kriging surrogate of the error
indicator.

    mu* = argmax I(mu) over the samples;   full run at mu*, the basis grows;   again, until mu* is known or I(mu*) is small

One iteration is: a full run at `point` and a larger basis (`extend`), then the reduced run and its
indicator (`evaluate`) at the samples given, then at candidates that Kriging adds one by one until
those most likely to hold the maximum are samples already, or add nothing worth a run, or there are
`max_samples`. Indicators belong to one basis: every iteration starts from the given samples again,
and from others where most of those have full runs. An iteration has one full run and, a component,
one sparse least-squares problem.

The published counts, 2 full with 12 or 21 reduced runs, are read so: two iterations of 5 given
samples are 2 x 5 reduced runs, and Kriging added 2 or 11 in both together. (21 exceeds the 15 of
one iteration; samples carried over would explain both as well.)

Added to the published algorithm: a reduced run that fails is infinite, and the next full run is
made there; a candidate whose full run fails is excluded and the next worst taken; truncation is
recognised as the floor when the largest indicator is not above ABOVE_FLOOR times that at full runs,
where only truncation is left. The floor is the largest indicator at any full run: from the second
one on, the reduced model runs at all of them where the maximum is elsewhere. A basis that leaves
nothing out (`truncates`) has no floor. Nothing here knows what a run is.

Source: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, Algorithm 1, doi
10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..core import extras
from ..core.errors import FmbsError, InputError, NoModel, NoRoom, say
from ..core.storage.records import dataclass
from . import kriging

Array = NDArray[np.float64]
T = TypeVar("T")

WORTH = 0.01  #: smallest expected gain for which Kriging adds a sample [decades]
ABOVE_FLOOR = 3.0  #: indicators up to this times those at full runs are truncation, whose floor itself follows the loads
ENDING = (NoRoom, NoModel)  #: what ends the loop, whatever raises it
#: what a run that fails raises
FAILURES = (
    FmbsError,
    RuntimeError,
    ArithmeticError,
    np.linalg.LinAlgError,
)


@dataclass(frozen=True)
class Options:
    """When the loops end, and how the surrogate is made.

    InputError for numbers below 1, and for a tolerance that is not positive. `tolerance` is one of
    the indicator I of (49), not of an error.
    """

    iterations: int = 5  #: full runs that succeed; as many may fail
    max_samples: int = 15  #: reduced runs of one iteration; given samples and full runs come on top
    tolerance: float | None = None  #: indicator below which the reduced model is good enough
    seed: int = 0  #: of the surrogate's search for the greatest likelihood

    def __post_init__(self) -> None:
        for name in ("iterations", "max_samples"):
            if getattr(self, name) < 1:
                raise InputError(say(f"greedy.Options: {name}", "at least 1", getattr(self, name)))
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise InputError(
                say("greedy.Options: tolerance", "a positive indicator, or None", self.tolerance)
            )


class StopReason(Enum):
    """Why the loop ended.

    Its value is a sentence for people. FLOOR and REPEATED mean that truncation or hyper-reduction
    is the limit, and not the full runs.
    """

    TOLERANCE = "the largest indicator is below the tolerance"
    REPEATED = "more full runs no longer help: the worst sample has one already; lower eps (truncation) or eta (hyper-reduction)"
    FLOOR = "more full runs no longer help: no sample is worse than those with one; lower eps (truncation) or eta (hyper-reduction)"
    LARGE = "the reduced model has nearly as many unknowns as the full one, and would only grow with more full runs"
    ITERATIONS = "the number of full runs is used up"
    ALONE = "there are no parameters, and nothing to choose"
    FAILED = "no sample is left whose full run succeeds, or too many have failed"


@dataclass(frozen=True)
class Iteration:
    """One full run, and the indicators of the basis it led to.

    c candidates; `largest` is the largest indicator of the reduced model of so many full runs.
    """

    number: int  #: from 1
    point: int  #: candidate of the full run
    samples: tuple[int, ...]  #: candidates of the reduced runs, in their order
    indicators: tuple[float, ...]  #: theirs; infinite where the reduced run failed
    mean: Array  #: (c,) surrogate's mean of log10 I at the candidates, apart from its dips at full runs
    std: Array  #: (c,) standard deviation of a further sample from it
    next: int | None  #: candidate of the next full run; None where the loop ends
    #: all candidates known to have no full run, with the reason
    failed: tuple[tuple[int, str], ...] = ()

    @property
    def found(self) -> dict[int, float]:
        """Indicators by sample."""
        return dict(zip(self.samples, self.indicators, strict=True))

    @property
    def open(self) -> dict[int, float]:
        """Indicators of the samples that have a full run or may have one."""
        return {k: indicator for k, indicator in self.found.items() if k not in dict(self.failed)}

    @property
    def largest(self) -> float:
        """Largest indicator of candidates that have a full run or may have one."""
        return max(self.open.values(), default=math.nan)


@dataclass(frozen=True)
class Enrichment:
    """What the loop did.

    `iterations` are all that were completed, one full run each; `stop` says why there are no more.
    """

    iterations: tuple[Iteration, ...]
    stop: StopReason

    @property
    def evaluations(self) -> int:
        """Reduced runs."""
        return sum(len(iteration.samples) for iteration in self.iterations)

    @property
    def extensions(self) -> int:
        """Full runs that succeeded."""
        return len(self.iterations)

    @property
    def points(self) -> tuple[int, ...]:
        """Candidates of the full runs, in their order."""
        return tuple(iteration.point for iteration in self.iterations)

    @property
    def failed(self) -> tuple[tuple[int, str], ...]:
        """Candidates whose full run failed, with the reason."""
        return self.iterations[-1].failed


@dataclass(frozen=True)
class GreedyProblem:
    """What is run, and where: candidates (c,d) in the unit box, of which copies stand for the first
    of them.

    InputError for other candidates, and for samples or a first one that are none of them.
    """

    evaluate: Callable[[int], float]  #: the indicator of the present reduced model at a candidate
    extend: Callable[[int], None]  #: makes the full run at a candidate and enlarges the basis
    candidates: Array  #: (c,d)
    samples: tuple[int, ...]  #: candidates that are evaluated first in every iteration
    first: int  #: candidate of the first full run
    options: Options = Options()
    #: is given every complete iteration
    keep: Callable[[Iteration], object] = lambda iteration: None
    #: whether the present basis leaves out anything of its full runs
    truncates: Callable[[], bool] = lambda: True
    name: Callable[[int], str] = "candidate {}".format  #: what a candidate is called
    #: ends the loop at a largest indicator, as the tolerance does
    enough: Callable[[float], bool] = lambda largest: False
    #: whether the present basis is smaller than what it stands for
    pays: Callable[[], bool] = lambda: True

    def __post_init__(self) -> None:
        where = "greedy.GreedyProblem"
        x = np.asarray(self.candidates, dtype=np.float64)
        if x.ndim != 2 or x.size == 0 or not np.all((x >= 0.0) & (x <= 1.0)):
            raise InputError(
                say(
                    where,
                    "candidates as a matrix (c,d) in the unit box",
                    f"shape {x.shape}",
                    "use parameters.to_box",
                )
            )
        if not self.samples:
            raise InputError(
                say(
                    where,
                    "at least one sample",
                    "none",
                    "give the candidates to be evaluated first",
                )
            )
        for k in (self.first, *self.samples):
            if not 0 <= k < len(x):
                raise InputError(
                    say(f"{where}: samples and first", f"candidates, 0 to {len(x) - 1}", k)
                )

    @functools.cached_property
    def same(self) -> tuple[int, ...]:
        """For every candidate (c,) the first one with its coordinates."""
        _, original, copies = np.unique(
            self.candidates, axis=0, return_index=True, return_inverse=True
        )
        return tuple(int(k) for k in original[copies.ravel()])


def run(given: GreedyProblem, done: Sequence[Iteration] = ()) -> Enrichment:
    """Algorithm 1; iterations that are `done` continue an interrupted loop.

    Nothing of them is run again, the caller restores their basis. The last iteration is kept again
    when later full runs fail. NoModel where every full run that is tried first fails; NoModel of
    `extend` and NoRoom, of a full disk, pass. MissingFeature without the packages of the surrogate.
    """
    extras.need("families", "greedy training")
    problem = replace(
        given,
        samples=tuple(dict.fromkeys(given.same[k] for k in given.samples)),
        first=given.same[given.first],
    )
    history = _checked(done, problem)
    while True:
        failed = history[-1].failed if history else ()
        following, stop = decide(history, problem)
        while following is not None and isinstance(
            error := _attempt(problem.extend, following), Exception
        ):
            failed = (*failed, (following, str(error) or type(error).__name__))
            following, stop = decide(history, problem, failed)
        if following is None:
            return _finished(problem, history, stop, failed)
        history = (*history, _iteration(problem, history, following, failed))
        history = (*history[:-1], replace(history[-1], next=decide(history, problem)[0]))
        problem.keep(history[-1])


def decide(
    history: Sequence[Iteration],
    problem: GreedyProblem,
    failed: Sequence[tuple[int, str]] | None = None,
) -> tuple[int | None, StopReason | None]:
    """Candidate of the next full run, or None and the reason why there is none."""
    options = problem.options
    lost = dict(failed if failed is not None else history[-1].failed if history else ())
    if len(lost) > options.iterations:
        return None, StopReason.FAILED
    if not history:
        choice = _nearest(problem, lost)
        return choice, None if choice is not None else StopReason.FAILED
    used = {iteration.point for iteration in history}
    open_ = {k: i for k, i in history[-1].found.items() if k not in lost}
    if not open_:
        return None, StopReason.FAILED
    largest = max(open_.values())
    if (options.tolerance is not None and largest <= options.tolerance) or problem.enough(largest):
        return None, StopReason.TOLERANCE
    if not problem.pays():
        return None, StopReason.LARGE
    fresh = [k for k, i in open_.items() if i == largest and k not in used]
    if not fresh:
        return None, StopReason.REPEATED
    known = [i for k, i in open_.items() if k in used]
    if (
        math.isfinite(largest)
        and known
        and largest <= ABOVE_FLOOR * max(known)
        and problem.truncates()
    ):
        return None, StopReason.FLOOR
    if len(history) >= options.iterations:
        return None, StopReason.ITERATIONS
    return farthest(problem.candidates, fresh, sorted(used)), None


def _iteration(
    problem: GreedyProblem,
    history: Sequence[Iteration],
    point: int,
    failed: tuple[tuple[int, str], ...],
) -> Iteration:
    """The inner loop, after the full run at `point`."""
    options = problem.options
    used = [*(iteration.point for iteration in history), point]
    closed = {*used, *dict(failed)}
    found = {k: _indicator(problem, k) for k in _samples(problem, closed)}
    surrogate = _surrogate(problem, found, closed)
    choices = _open(problem, closed)
    while len(found) < options.max_samples and not _unstable(found, closed):
        best = (
            kriging.likely_maximum(surrogate, problem.candidates[choices], WORTH)
            if choices
            else None
        )
        if best is None or choices[best] in found:
            break
        found[choices[best]] = _indicator(problem, choices[best])
        surrogate = _surrogate(problem, found, closed)
    if history and not _unstable(found, closed) and max(found, key=lambda k: found[k]) not in used:
        # the floor: what more full runs can reach
        found |= {k: _indicator(problem, k) for k in used if k not in found}
    (mean, _) = kriging.predict(surrogate, problem.candidates)
    std = kriging.deviation(surrogate, problem.candidates)
    return Iteration(
        len(history) + 1, point, tuple(found), tuple(found.values()), mean, std, None, failed
    )


def _samples(problem: GreedyProblem, closed: set[int]) -> list[int]:
    """The given samples; when most of them have their full runs, also the candidates farthest from
    all that is known.

    At full runs the indicator says nothing of the candidates between them, so that half as many
    samples as given are to be others.
    """
    samples = list(problem.samples)
    least = (len(samples) + 1) // 2
    while (
        sum(k not in closed for k in samples) < least and len(samples) < problem.options.max_samples
    ):
        others = [k for k in _open(problem, closed) if k not in samples]
        if not others:
            break
        samples.append(farthest(problem.candidates, others, sorted({*samples, *closed})))
    return samples


def _open(problem: GreedyProblem, closed: set[int]) -> list[int]:
    """Candidates, different from each other, where a full run may follow."""
    return [k for k, original in enumerate(problem.same) if k == original and k not in closed]


def _surrogate(
    problem: GreedyProblem, found: dict[int, float], closed: set[int]
) -> kriging.Surrogate:
    """Of the samples where a full run may follow, or of all where there are none.

    At full runs the indicator dips to what truncation leaves, which a smooth surrogate would take
    for roughness everywhere.
    """
    points = [k for k in found if k not in closed] or list(found)
    return kriging.fit(problem.candidates[points], [found[k] for k in points], problem.options.seed)


def _unstable(found: dict[int, float], closed: set[int]) -> bool:
    """Whether a reduced run has failed where a full run can help: the maximum is found."""
    return any(math.isinf(i) for k, i in found.items() if k not in closed)


def _indicator(problem: GreedyProblem, candidate: int) -> float:
    """The indicator, infinite where the reduced run fails."""
    found = _attempt(problem.evaluate, candidate)
    value = math.inf if isinstance(found, Exception) else float(found)
    if value < 0.0:
        raise InputError(say(f"indicator of candidate {candidate}", "a norm, not negative", value))
    return math.inf if math.isnan(value) else value


def _attempt(function: Callable[[int], T], candidate: int) -> T | Exception:
    """What a function gives at a candidate, or the error of a run that fails."""
    try:
        return function(candidate)
    except ENDING:
        raise
    except FAILURES as error:
        return error


def _finished(
    problem: GreedyProblem,
    history: tuple[Iteration, ...],
    stop: StopReason | None,
    failed: tuple[tuple[int, str], ...],
) -> Enrichment:
    """The outcome; full runs that failed since the last iteration are added to it."""
    if not history:
        tried = "; ".join(f"{problem.name(k)}: {reason.split(';')[0]}" for k, reason in failed)
        raise NoModel(
            say(
                "training",
                "a first full run that succeeds",
                tried,
                "narrow the ranges of the parameters",
            )
        )
    if failed != history[-1].failed:
        history = (*history[:-1], replace(history[-1], next=None, failed=failed))
        problem.keep(history[-1])
    return Enrichment(history, stop or StopReason.FAILED)


def _nearest(problem: GreedyProblem, lost: dict[int, str]) -> int | None:
    """The first candidate, or after failures the sample next to it."""
    choices = [k for k in (problem.first, *problem.samples) if k not in lost]
    if not choices:
        return None
    return choices[
        int(
            np.argmin(
                np.linalg.norm(
                    problem.candidates[choices] - problem.candidates[problem.first], axis=1
                )
            )
        )
    ]


def farthest(candidates: Array, choices: Sequence[int], used: Sequence[int]) -> int:
    """The one of several candidates (k, d), by number, that is farthest from all used ones.

        max_u min_v |u - v|

    over the used ones v, numbers of candidates as well; the first of several.
    """
    from scipy.spatial.distance import cdist

    return choices[
        int(np.argmax(cdist(candidates[list(choices)], candidates[list(used)]).min(axis=1)))
    ]


def _checked(done: Sequence[Iteration], problem: GreedyProblem) -> tuple[Iteration, ...]:
    """Stored iterations, refused where they belong to other candidates."""
    for number, iteration in enumerate(done, 1):
        known = {iteration.point, *iteration.samples, *dict(iteration.failed)}
        fits = iteration.number == number and len(iteration.mean) == len(problem.candidates)
        if not fits or not all(0 <= k < len(problem.same) and problem.same[k] == k for k in known):
            remedy = "train in an empty folder"
            raise InputError(
                say(
                    "greedy.run",
                    f"iteration {number} of the same candidates",
                    f"number {iteration.number}",
                    remedy,
                )
            )
    return tuple(done)
