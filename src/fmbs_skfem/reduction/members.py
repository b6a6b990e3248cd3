"""Members of a sweep: what a worker process does with them, and what they leave.

    task -> prepare, once a worker -> work, on a few members at a time -> results

Tasks: members of any family, and of a reduced model that was saved.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import time as clock
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import Notice

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..systems.system import System
    from .cases import Case, Family

INSTANTS = 601  #: of the histories that a member leaves, at most
BLOCK = 16  #: members of a saved model that advance together
#: kind of output -> SI unit; slopes are numbers
UNITS = {
    "position": "m",
    "velocity": "m/s",
    "angle": "rad",
    "angular velocity": "rad/s",
    "stress": "Pa",
    "deflection": "m",
    "energy": "J",
}


class Status(Enum):
    """How a member ended."""

    OK = "ok"
    FAILED = "failed"
    TIMEOUT = "timeout"
    KILLED = "killed"


@dataclass(frozen=True)
class Member:
    """A point of a sweep."""

    number: int
    values: dict[str, float]  #: of the parameters, SI


@dataclass(frozen=True)
class Result:
    """What a member that ran gives."""

    times: np.ndarray  #: (s,) [s]
    columns: dict[str, np.ndarray]  #: output -> (s,)
    units: dict[str, str] = field(default_factory=dict)  #: output -> SI unit, where it is known
    numbers: dict[str, float] = field(default_factory=dict)  #: further results, such as the predicted error


@dataclass(frozen=True)
class Record:
    """A member that is settled."""

    number: int
    values: dict[str, float]
    status: Status
    reason: str = ""  #: of a member that is not ok, as one word or two
    message: str = ""
    cpu_s: float = 0.0
    wall_s: float = 0.0
    result: Result | None = None
    notices: tuple[str, ...] = ()


Work: TypeAlias = Callable[[Sequence[Mapping[str, float]]], Sequence[Result | FmbsError]]


class Task(Protocol):
    """What a sweep runs; it is pickled and sent to the workers."""

    @property
    def block(self) -> int:
        """Members that advance together."""

    def prepare(self) -> Work:
        """Read and compile what all members share; the function that runs up to `block` of them."""


READY: dict[str, tuple[int, Work]] = {}  #: the task that this worker process has prepared, by token


def prepare(token: str, task: Task) -> tuple[type[FmbsError], str, Any] | None:
    """Prepare a task in this worker; None, or class, message and reason of the error (errors with more cannot be pickled)."""
    import scipy.linalg  # noqa: F401  (limits reach only libraries that are loaded)
    from threadpoolctl import threadpool_limits

    threadpool_limits(limits=1, user_api="blas")
    READY.clear()
    try:
        READY[token] = task.block, task.prepare()
    except FmbsError as error:
        return type(error), str(error), getattr(error, "reason", None)
    return None


def work(token: str, batch: Sequence[Member], timeout: float | None) -> list[Record]:
    """Run a batch in this worker, a block at a time."""
    block, function = READY[token]
    found: list[Record] = []
    for first in range(0, len(batch), block):
        found += together(function, batch[first : first + block], timeout)
    return found


def together(function: Work, some: Sequence[Member], timeout: float | None) -> list[Record]:
    """Records of members that advance together; where they cannot, one by one."""
    cpu, wall = clock.process_time(), clock.perf_counter()
    with limited(timeout, len(some)), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", Notice)
        try:
            results: Sequence[Result | BaseException] = function([member.values for member in some])
        except (Exception, SystemExit) as error:
            results = [error] * len(some)
    cpu, wall = (clock.process_time() - cpu) / len(some), (clock.perf_counter() - wall) / len(some)
    if len(some) > 1 and any(isinstance(result, BaseException) for result in results):
        return [record for member in some for record in together(function, [member], timeout)]
    notices = tuple(dict.fromkeys(str(item.message) for item in caught if issubclass(item.category, Notice)))
    records = (entry(member, result) for member, result in zip(some, results, strict=True))
    return [replace(record, cpu_s=cpu, wall_s=wall, notices=notices) for record in records]


@contextlib.contextmanager
def limited(timeout: float | None, count: int) -> Iterator[None]:
    """End this process when it takes longer, whatever it does: the timer needs no interpreter lock."""
    if timeout is None:
        yield
        return
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(timeout * count, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def entry(member: Member, result: Result | BaseException) -> Record:
    """The record of a member that ran or raised."""
    if isinstance(result, Result):
        return Record(member.number, member.values, Status.OK, result=result)
    return Record(member.number, member.values, Status.FAILED, word(result), str(result))


def word(error: BaseException) -> str:
    """What kind of error, in a word or two."""
    if isinstance(error, SolverError):
        return error.reason.name.lower().replace("_", " ")
    return "bad input" if isinstance(error, InputError) else type(error).__name__


@dataclass(frozen=True)
class FamilyTask:
    """Members of a family, full or reduced, one by one."""

    family: Family
    nominal: Mapping[str, float]  #: values at which the compiled code is made ready
    form: Callable[[System], System] | None = None  #: of the system that is solved
    instants: int = INSTANTS
    block: int = 1

    def prepare(self) -> Work:
        first = self.case(self.nominal)
        with warming():
            integrated(replace(first, duration=first.scheme.step), self.instants)
        return lambda several: [integrated(self.case(values), self.instants) for values in several]

    def case(self, values: Mapping[str, float]) -> Case:
        found = self.family(values)
        return found if self.form is None else replace(found, system=self.form(found.system))


@dataclass(frozen=True)
class ProductTask:
    """Members of a reduced model that was saved, some at a time."""

    path: str  #: of the file, as the workers see it
    fixed: Mapping[str, float] = field(default_factory=dict)  #: parameters that no member changes
    instants: int = INSTANTS
    block: int = BLOCK

    def prepare(self) -> Work:
        from . import affine, product
        from . import parameters as boxes

        model = product.load(self.path).model
        short = replace(model.nominal, duration=model.nominal.scheme.step)
        with warming():
            advanced([short, short], self.instants)
        return lambda several: advanced(
            [affine.at(model, boxes.completed(model.parameters, {**self.fixed, **values})) for values in several], self.instants
        )


@contextlib.contextmanager
def warming() -> Iterator[None]:
    """A step before time counts, so that everything is compiled; what fails or is worth a notice, the members say themselves."""
    with contextlib.suppress(SolverError), warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        yield


def integrated(case: Case, instants: int) -> Result:
    """What a case gives; other threads of the worker get their turn now and then."""
    from ..dynamics import integrate

    kept = stored(case, instants)
    return measured(integrate(case.system, case.scheme, case.duration, case.newton, kept, lambda fraction: None))


def advanced(cases: Sequence[Case], instants: int) -> list[Result | FmbsError]:
    """What cases of one structure give that advance together; those of other steps or durations one by one."""
    from ..dynamics.batch import integrate_many

    first = cases[0]
    if any((case.duration, case.scheme.step, case.newton) != (first.duration, first.scheme.step, first.newton) for case in cases):
        return [found for case in cases for found in advanced([case], instants)]
    systems, schemes = [case.system for case in cases], [case.scheme for case in cases]
    motions = integrate_many(systems, schemes, first.duration, first.newton, stored(first, instants))
    return [motion if isinstance(motion, FmbsError) else measured(motion) for motion in motions]


def stored(case: Case, instants: int) -> np.ndarray:
    """Numbers of the steps that are stored: all, or `instants` of them over the duration."""
    if instants < 2:
        raise InputError(say("sweep: instants", "at least 2", instants))
    steps = round(case.duration / case.scheme.step)
    return np.unique(np.round(np.linspace(0, steps, min(instants, steps + 1))).astype(np.int64))


def measured(motion: Trajectory) -> Result:
    """The outputs of a motion."""
    from ..dynamics import outputs

    units = {name: UNITS.get(output.kind, "") for output in motion.system.outputs.values() for name in output.columns}
    return Result(motion.times, outputs(motion), units)
