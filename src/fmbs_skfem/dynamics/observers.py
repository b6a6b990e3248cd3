"""What looks at a run: between its steps, and at its motion once it has ended.

    integrate:   observers begin,   then  before - step - after  until the end,   then  finish

The driver knows arrays and observers, and nothing of what they are for: events, controllers, parts,
records, progress and warnings are observers. Whatever has one of its own offers it for a
`RunSetting`, by `@offered`; those of a caller are arguments of `integrate` and `start`, those of a
scene its `monitors`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from ..core.notices import Notice, Progress, notify
from ..core.storage.records import dataclass
from ..systems.system import System
from .scheme import GeneralizedAlpha, Newton
from .trajectory import Trajectory

if TYPE_CHECKING:
    from .run import OpenRun

Looks: TypeAlias = Literal["step", "pause", "end"]
Texts: TypeAlias = Iterable[str | Notice]


class Observer:
    """Looks at a run; every method may be left out.

    `looks` says when `before` and `after` are called: about every "step", where the run makes a
    "pause" (`after` alone: a few times a second, always after a multiple of 8 steps), or not at all
    until its "end".
    """

    looks: Looks = "step"
    name: str = ""  #: of the one of several of a kind; what it keeps in checkpoints goes by it
    #: whether it reads states of the motion that a run leaves, or of its stored ones: all are kept
    #: then
    reads_states: bool = True

    def begin(self, run: OpenRun) -> None:
        """The run is at its start."""

    def before(self, run: OpenRun) -> None:
        """A step is to be taken."""

    def after(self, run: OpenRun) -> None:
        """A step was taken: `run.stop(self)` ends the run there, `run.shorten(k)` takes the next
        step in 2^k parts.
        """

    def explain(self, run: OpenRun) -> str:
        """What is known of a step that could not be taken, which stands in the place of its error;
        nothing by default.
        """
        return ""

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        """The motion of a run that has ended, with what is to be said of it."""
        return motion

    def arrays(self, run: OpenRun) -> Mapping[str, np.ndarray]:
        """What a checkpoint keeps of it, by name."""
        return {}

    def put(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        """Put back what a checkpoint kept of it after `run.done` steps."""


class HistorySource(Observer):
    """An observer that gives the histories of every step, and takes it.

    A run takes its steps by the first one. `system` has its inputs as signals, which `take` sets
    before a step; `recorded` replaces them by the histories that they had, so that the motion can
    be computed again without it.
    """

    plain: System  #: as it is compiled, with what it gives at its start
    system: System  #: which reads what it gives

    def take(self, run: OpenRun) -> int:
        """Take a step; the status."""
        raise NotImplementedError

    def recorded(self) -> System:
        """The system with what it gave so far as histories."""
        raise NotImplementedError


@dataclass(frozen=True)
class RunSetting:
    """What is known of a run before it begins.

    An offer looks at it and gives its observers, or none.
    """

    system: System
    scheme: GeneralizedAlpha
    newton: Newton
    steps: int
    given: System  #: as the caller gave it, which remembers what was found of it
    live: bool = False  #: whether steps are taken one by one, with inputs from outside and no end
    #: the motion of another system in the same run
    repeat: Callable[[System, Progress | None], Trajectory] | None = None
    progress: Progress | None = None
    judged: bool = True  #: whether rules of motions look at it


Offer: TypeAlias = Callable[[RunSetting], Iterable[Observer]]
_OFFERS: list[Offer] = []


def offered(offer: Offer) -> Offer:
    """Register what offers observers of every run, of those that it is for.

    A decorator of a function of a `RunSetting` that gives observers; it is asked before every run
    of `integrate` and of live runs, in the order of registration.
    """
    _OFFERS.append(offer)
    return offer


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    for monitor in setting.system.monitors:
        observer = monitor.observer()
        observer.name = monitor.name
        yield observer


def observers_of(setting: RunSetting) -> list[Observer]:
    """All that is offered for a run.

    In the order in which they were offered; those of a caller stand behind them.
    """
    return [one for offer in _OFFERS for one in offer(setting)]


@dataclass(frozen=True)
class FoundEquilibria:
    """Equilibria, or a path of them, with what finds those of another system, and numbers (k,) that
    both have in common.

    What registers with `reviews` gets it, and gives the motion back, with what is to be said of it.
    """

    motion: Trajectory
    given: System  #: as the caller gave it
    again: Callable[[System, Progress | None], Trajectory]
    marks: Callable[[Trajectory], np.ndarray] | None = None  #: None where these are its times
    progress: Progress | None = None


Review: TypeAlias = Callable[[FoundEquilibria], Trajectory]
_REVIEWS: list[Review] = []


def reviews(review: Review) -> Review:
    """Register what looks at equilibria once they are found, as `finish` of an observer does at
    motions.

    A decorator of a function of a `FoundEquilibria` that gives its motion, changed or as it was;
    several are called in the order of registration.
    """
    _REVIEWS.append(review)
    return review


def reviewed(found: FoundEquilibria) -> Trajectory:
    """Equilibria with what is to be said of them.

    Every review that is registered looks at them in turn, and may give them back changed.
    """
    for review in _REVIEWS:
        found = replace(found, motion=review(found))
    return found.motion


class PauseCall(Observer):
    """Calls a function at every pause of a run.

    `call(run)` is called a few times a second, see `Observer.looks`.
    """

    looks: Looks = "pause"

    def __init__(self, call: Callable[[OpenRun], object], reads_states: bool = True) -> None:
        self.call, self.reads_states = call, reads_states

    def after(self, run: OpenRun) -> None:
        self.call(run)


class Judge(Observer):
    """Shows as warnings what a rule says of the motion of a run that has ended.

    `rule(run, motion)` gets the finished run and its Trajectory, and gives the texts of warnings.
    All stored states are kept for it unless `reads_states` is false.
    """

    looks: Looks = "end"

    def __init__(
        self, rule: Callable[[OpenRun, Trajectory], Texts], reads_states: bool = True
    ) -> None:
        self.rule, self.reads_states = rule, reads_states

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        notify(*self.rule(run, motion))
        return motion


def judges(rule: Callable[[Trajectory], Texts]) -> None:
    """Register a rule of motions, by up to 40 of their states, and of equilibria.

    A decorator of a function that gives the texts of warnings.
    """

    def review(found: FoundEquilibria) -> Trajectory:
        notify(*rule(found.motion.states))
        return found.motion

    judge = Judge(lambda run, motion: rule(motion.states), reads_states=False)
    offered(lambda setting: () if setting.live or not setting.judged else (judge,))
    reviews(review)
