"""Members of a sweep: what a worker process does with them, and what they leave.

    task -> work: prepare, once a worker, then one member after the other -> results

A member is computed by itself: its numbers do not depend on which others ran in its process. Tasks:
members of any family, of a reduced model that was saved, and paths of equilibria.
"""

from __future__ import annotations

import contextlib
import faulthandler
import math
import os
import threading
import time as clock
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from ..core.algebra.linalg import evenly
from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import Notice, notify
from ..core.storage.records import dataclass

if TYPE_CHECKING:
    from ..dynamics.trajectory import Trajectory
    from ..reduction.cases import Case, Family
    from ..systems.system import System

INSTANTS = 601  #: of the histories that a member leaves, at most
#: most numbers of states of a member, so that extremes are those of as many steps
NUMBERS = 4_000_000
OUTSIDE = "parts outside training"  #: of the numbers of a member
MEMORY = "out of memory"  #: why a member failed
NEAR = 1e-6  #: part of a step that is round-off


class Status(Enum):
    """How a member ended.

    OK and FAILED are what the member itself made of it; TIMEOUT and KILLED are told of a member
    whose worker process ended.
    """

    OK = "ok"
    FAILED = "failed"
    TIMEOUT = "timeout"
    KILLED = "killed"


@dataclass(frozen=True)
class Member:
    """A point of a sweep.

    `number` is that of the row of points of the sweep, from 0.
    """

    number: int
    values: dict[str, float]  #: of the parameters, SI


@dataclass(frozen=True)
class MemberResult:
    """What a member that ran gives.

    Histories are at s instants, of a motion 601 at most unless the task says otherwise; its
    `extremes` are those of all steps, or of as many as memory holds.
    """

    times: np.ndarray  #: (s,) [s]
    columns: dict[str, np.ndarray]  #: output -> (s,)
    units: dict[str, str] = field(default_factory=dict)  #: output -> SI unit, where it is known
    #: further results, such as the predicted error
    numbers: dict[str, float] = field(default_factory=dict)
    #: output -> smallest and largest value (2,) of all steps
    extremes: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class Record:
    """A member that is settled.

    One for every member of a sweep, whatever became of it: `result` is None unless its status is
    OK.
    """

    number: int
    values: dict[str, float]
    status: Status
    reason: str = ""  #: of a member that is not ok, as one word or two
    message: str = ""
    cpu_s: float = 0.0
    wall_s: float = 0.0
    result: MemberResult | None = None
    notices: tuple[str, ...] = ()

    @property
    def final(self) -> bool:
        """Whether the same member ends alike in another try, with more time or memory."""
        return self.status is Status.OK or (self.status is Status.FAILED and self.reason != MEMORY)


Work: TypeAlias = Callable[[Mapping[str, float]], MemberResult]


class Task(Protocol):
    """What a sweep runs; it is pickled and sent to the workers.

    `prepare()` is called once in a worker and gives a function of the values of the parameters by
    name [SI], which gives a MemberResult.
    """

    def prepare(self) -> Work:
        """Read and compile what all members share; the function that runs one of them."""


READY: dict[str, Work] = {}  #: the task that this worker process has prepared, by token
PREPARING = threading.Lock()  #: threads of a worker prepare once


def prepare(token: str, task: Task) -> tuple[type[FmbsError], str, Any] | None:
    """Prepare a task in this worker; None, or class, message and reason of the error (errors with
    more cannot be pickled).

    It limits the libraries of linear algebra to one thread. Errors of the package are given back,
    all others are raised.
    """
    import scipy.linalg  # noqa: F401  (limits reach only libraries that are loaded)
    from threadpoolctl import threadpool_limits

    threadpool_limits(limits=1, user_api="blas")
    READY.clear()
    try:
        READY[token] = task.prepare()
    except FmbsError as error:
        return type(error), str(error), getattr(error, "reason", None)
    return None


def work(
    token: str, task: Task, batch: Sequence[Member], timeout: float | None, at_once: bool
) -> list[Record] | tuple[type[FmbsError], str, Any] | None:
    """Run a batch in this worker; what `prepare` gives where that fails.

    A worker that has not prepared the task does so first, and gives its batch back as None unless
    it is to run `at_once`. A member that takes longer than `timeout` [s] ends the process.
    """
    with PREPARING:
        if token not in READY:
            failed = prepare(token, task)
            if failed or not at_once:
                return failed
        ready = READY[token]
    return [run_member(ready, member, timeout) for member in batch]


def run_member(function: Work, member: Member, timeout: float | None) -> Record:
    """The record of a member."""
    cpu = clock.process_time()
    wall = clock.perf_counter()
    with limit_time(timeout), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        try:
            found = Record(member.number, member.values, Status.OK, result=function(member.values))
        except (Exception, SystemExit) as error:
            found = Record(
                member.number, member.values, Status.FAILED, name_error(error), str(error)
            )
    cpu, wall = clock.process_time() - cpu, clock.perf_counter() - wall
    notices = tuple(
        dict.fromkeys(str(item.message) for item in caught if issubclass(item.category, Notice))
    )
    return replace(found, cpu_s=cpu, wall_s=wall, notices=notices)


@contextlib.contextmanager
def limit_time(timeout: float | None) -> Iterator[None]:
    """End this process when it takes longer, whatever it does: the timer needs no interpreter lock."""
    if timeout is None:
        yield
        return
    with open(os.devnull, "w") as nowhere:
        limit = min(timeout, threading.TIMEOUT_MAX)
        faulthandler.dump_traceback_later(limit, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def name_error(error: BaseException) -> str:
    """What kind of error, in a word or two."""
    if isinstance(error, SolverError):
        return error.reason.name.lower().replace("_", " ")
    if isinstance(error, MemoryError):
        return MEMORY
    return "bad input" if isinstance(error, InputError) else type(error).__name__


@dataclass(frozen=True)
class FamilyTask:
    """Members of a family, full or reduced.

    Each member is one run of `family(values)`; `instants` of its steps are kept, 2 at least.
    """

    family: Family
    nominal: Mapping[str, float]  #: values at which the compiled code is made ready
    form: Callable[[System], System] | None = None  #: of the system that is solved
    instants: int = INSTANTS

    def prepare(self) -> Work:
        first = self.case(self.nominal)
        with warm_up():
            run_case(replace(first, duration=first.scheme.step), self.instants)
        return lambda values: run_case(self.case(values), self.instants)

    def case(self, values: Mapping[str, float]) -> Case:
        found = self.family(values)
        return found if self.form is None else replace(found, system=self.form(found.system))


@dataclass(frozen=True)
class ModelTask:
    """Members of a reduced model that was saved.

    Parameters that neither `fixed` nor a member names are nominal. CorruptFile where the file is
    not as it was written.
    """

    path: str  #: of the file, as the workers see it
    fixed: Mapping[str, float] = field(default_factory=dict)  #: parameters that no member changes
    instants: int = INSTANTS

    def prepare(self) -> Work:
        from ..reduction import parameters as boxes
        from . import parametric_model

        model = parametric_model.load(self.path).model

        def family(values: Mapping[str, float]) -> Case:
            return model(boxes.completed(model.parameters, {**self.fixed, **values}))

        return FamilyTask(family, {}, instants=self.instants).prepare()


@dataclass(frozen=True)
class PathTask:
    """Paths of equilibria, which are solved as they are read.

    Each member is one path, all points of which are kept.
    """

    path: Callable[[Mapping[str, float]], Trajectory]  #: of values of the parameters
    nominal: Mapping[str, float]  #: values at which the compiled code is made ready

    def prepare(self) -> Work:
        with warm_up():
            self.path(self.nominal)
        return lambda values: keep_outputs(self.path(values))


@contextlib.contextmanager
def warm_up() -> Iterator[None]:
    """A first run before time counts, so that all is compiled; what fails or is worth a notice, the
    members say themselves.
    """
    with contextlib.suppress(SolverError), warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        yield


def run_case(case: Case, instants: int) -> MemberResult:
    """What a case gives; other threads of the worker get their turn now and then."""
    from ..reduction import cases

    shown = choose_steps(case, instants)
    watched = watch_steps(case)
    # sets of numpy, of all steps, took 4 % of a sample of 1000 steps
    every = 1 if len(watched) > watched[-1] else np.union1d(shown, watched)
    motion = cases.run(case, every, lambda fraction: None)
    found = keep_outputs(motion)
    steps = motion.times / case.scheme.step
    numbers = np.round(steps)
    last = len(steps) - 1
    rows = np.minimum(np.searchsorted(numbers, shown), last)
    rows = rows[(numbers[rows] == shown) & (np.abs(steps[rows] - shown) < NEAR)]
    kept = rows if rows[-1] == last else np.append(rows, last)  # where an event has stopped the run
    columns = {name: values[kept] for name, values in found.columns.items()}
    ends = {name: np.array([values.min(), values.max()]) for name, values in found.columns.items()}
    return replace(found, times=found.times[kept], columns=columns, extremes=ends)


def keep_outputs(motion: Trajectory) -> MemberResult:
    """The outputs at all stored states, and how many parts leave their training in them."""
    from ..dynamics import outputs
    from ..parts import departures
    from ..systems.measures import probes

    outside = departures.count_parts(motion)
    numbers = {} if outside is None else {OUTSIDE: float(outside)}
    return MemberResult(
        motion.times, outputs(motion), probes.column_units(motion.system.outputs), numbers
    )


def choose_steps(case: Case, instants: int) -> np.ndarray:
    """Numbers of the steps that are stored: all, or `instants` of them over the duration."""
    if instants < 2:
        raise InputError(say("sweep: instants", "at least 2", instants))
    steps = round(case.duration / case.scheme.step)
    return evenly(0, steps, min(instants, steps + 1))


def watch_steps(case: Case) -> np.ndarray:
    """Numbers of the steps whose outputs count for extremes: all, or as many as memory has room
    for, with a notice.
    """
    steps = round(case.duration / case.scheme.step)
    size = 3 * case.system.size + len(case.system.constraints.names)
    stride = max(1, math.ceil(steps * size / NUMBERS))
    if stride > 1:
        notify(
            f"smallest and largest values are those of one step in {stride} or of the stored instants, where these are more"
        )
    return np.arange(0, steps + 1, stride)
