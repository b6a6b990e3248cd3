r"""Sweeps: many members of a family computed by worker processes, which may fail, hang or die
without hurting the others.

    points (k, d) -> batches -> workers -> records, one a member, as they finish

Workers (`workers`) are those of an executor: processes of this machine that live as long as the
sweep, a cluster of dask, or any other. There are as many batches on their way as workers, each long
enough that sending it costs next to nothing. A worker prepares the task once: with its first batch,
which it gives back, so that what happens to a batch later is its members' own. A worker that ends
takes its batch with it: its members are tried again one by one, and the member with which a worker
ends again is listed as killed. A member that takes longer than the time limit ends its worker by a
timer outside of the interpreter (so that compiled code cannot hold it up) and is listed as timeout.

Whoever may hand tasks to a worker runs code as its user: workers of this machine have no ports, a
cluster is secured by those who run it.
"""

from __future__ import annotations

import contextlib
import math
import re
import signal
import time as clock
import uuid
import warnings
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import field, replace
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..core import processes
from ..core.errors import InputError, SolverError, say
from ..core.notices import Progress, notify
from ..core.storage import endings
from ..core.storage.records import dataclass
from . import members, workers
from .members import Member, MemberResult, Record, Status, Task, Work
from .workers import Workers

__all__ = [
    "Task",
    "Work",
    "Member",
    "MemberResult",
    "Record",
    "Status",
    "SweepOptions",
    "SweepOutcome",
    "run",
]

BATCH = 1.0  #: time that a batch should take [s]
SHORTEST = 1e-4  #: time of a member, at least [s]
TICK = 0.5  #: longest time between two looks at the workers [s]
PATIENCE = 60.0  #: after which a sweep without any worker is given up [s]
ATTEMPTS = 3  #: workers in a row that may end while they prepare
LISTED = 10  #: members that a notice lists
NUMBER = re.compile(r"(?<![\w'])-?\d+(\.\d*)?(e[-+]?\d+)?")  #: in a notice; not in names

Keep: TypeAlias = Callable[[Record], object]
#: notices without their numbers: the first, and members with other numbers
Heard: TypeAlias = dict[str, tuple[str, list[int]]]


@dataclass(frozen=True)
class SweepOptions:
    """Where a sweep runs and how long it waits.

    InputError for fewer than one worker, for workers beside a given cluster, for workers, a cluster
    or a time limit beside an executor, and for times that are not positive.
    """

    workers: int | None = None  #: processes on this machine; None for one a core
    #: address of a cluster, tcp://host:port, instead of processes on this machine
    scheduler: str | None = None
    timeout: float | None = None  #: longest time of one member [s]
    batch: float = BATCH  #: [s]
    #: one worker prepares before the others, which find its compiled code
    first_alone: bool = False
    #: of threads, MPI, ..., instead of both; a worker that ends ends the sweep
    executor: Executor | None = None

    def __post_init__(self) -> None:
        if self.workers is not None and (self.workers < 1 or self.scheduler):
            expected = "none for a given cluster" if self.scheduler else "at least 1"
            raise InputError(say("sweep: workers", expected, self.workers))
        if self.executor is not None and (self.workers or self.scheduler or self.timeout):
            remedy = "the executor has its own; a time limit would end its processes"
            raise InputError(
                say(
                    "sweep: executor",
                    "no workers, scheduler and timeout beside it",
                    "one of them",
                    remedy,
                )
            )
        for name, value in (("timeout", self.timeout), ("batch", self.batch)):
            if value is not None and not 0 < value < math.inf:
                raise InputError(say(f"sweep: {name}", "a positive time [s]", value))


@dataclass(frozen=True)
class SweepOutcome:
    """How a sweep went.

    Members that were skipped count nowhere. `busy_s` over `wall_s` times `workers` is how well the
    workers were used.
    """

    counts: dict[Status, int]  #: members of this run
    workers: int
    start_s: float  #: wall time until the first member began [s]
    wall_s: float  #: [s]
    busy_s: float  #: wall time of all members [s]
    cpu_s: float  #: CPU time of all members [s]
    deaths: int  #: workers that ended before their batch

    @property
    def overhead(self) -> float:
        """Part of the workers' time, after the start, that was spent on no member.

            1 - busy_s / (workers' time)

        0 where none was there.
        """
        there = self.workers * (self.wall_s - self.start_s)
        return 1.0 - self.busy_s / there if there > 0 else 0.0


@dataclass(frozen=True)
class Batch:
    """Members that go to a worker together."""

    members: tuple[Member, ...]
    again: bool = False  #: whether its only member was with a worker that ended
    at_once: bool = False  #: whether a worker has given it back to be sent anew
    since: float = 0.0  #: when it was sent [s]


@dataclass
class Desk:
    """A sweep on its way."""

    workers: Workers
    work: Callable[..., Any]  #: `members.work` of the task
    options: SweepOptions
    queue: deque[Member]
    keep: Keep
    #: members of lost batches, one by one, and batches that were given back
    back: deque[Batch] = field(default_factory=deque)
    busy: dict[Future[Any], Batch] = field(default_factory=dict)
    done: SimpleQueue[Future[Any]] = field(default_factory=SimpleQueue)
    waiting: deque[Record] = field(default_factory=deque)  #: that are to be kept
    settled: list[Record] = field(default_factory=list)  #: without results
    heard: Heard = field(default_factory=dict)  #: notices of members
    prepared: int = 0  #: workers that have given a batch back
    most: int = 0  #: workers at a time
    deaths: int = 0
    unprepared: int = 0  #: workers that ended before any was prepared
    busy_s: float = 0.0  #: of all members that are back
    ready: int = 0  #: their number
    began: float | None = None  #: when the first member was sent to a worker that is prepared [s]
    seen: float = field(default_factory=clock.monotonic)  #: when there was a worker [s]


def run(
    task: Task,
    names: Sequence[str],
    points: ArrayLike,
    keep: Keep,
    options: SweepOptions | None = None,
    skip: Collection[int] = (),
    progress: Progress | None = None,
) -> SweepOutcome:
    """Run the members at `points` (k, d), whose columns are `names`, except the numbers in `skip`;
    each record goes to `keep`.

    Records come in any order. An error of `keep` (a full disk) ends the sweep, as does a task that
    cannot be prepared; whatever happens to a member does not. Scripts that call this with processes
    of this machine need `if __name__ == "__main__":`.
    """
    options = options or SweepOptions()
    table = np.asarray(points, dtype=float)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise InputError(
            say("sweep: points", f"an array (k, {len(names)})", f"shape {table.shape}")
        )
    todo = [
        Member(k, dict(zip(names, row.tolist(), strict=True)))
        for k, row in enumerate(table)
        if k not in set(skip)
    ]
    start = clock.monotonic()
    asked = list[int]()
    if not todo:
        return SweepOutcome({}, 0, 0.0, 0.0, 0.0, 0.0, 0)
    # an interrupt that is raised inside of a callback, as dask has many, would be lost
    with endings.noted(asked.append), find_workers(options, len(todo)) as found:
        desk = Desk(
            found, partial(members.work, uuid.uuid4().hex, task), options, deque(todo), keep
        )
        try:
            with warnings.catch_warnings():  # as they were, whatever threads leave of theirs
                serve(desk, len(todo), asked, progress)
        finally:
            for future in desk.busy:
                future.cancel()
            if options.executor is not None:  # its threads would have caught them as well
                for record in desk.settled:
                    hear(desk.heard, record)
            show_others(desk.heard)
    end = clock.monotonic()
    begun = (desk.began or end) - start
    count = desk.most if options.executor is None else width(options.executor) or 1
    counts = Counter(one.status for one in desk.settled)
    cpu_s = sum(one.cpu_s for one in desk.settled)
    return SweepOutcome(dict(counts), count, begun, end - start, desk.busy_s, cpu_s, desk.deaths)


class Stopped(KeyboardInterrupt):
    """A signal ended a sweep; the records so far are kept.

    As of Ctrl-C: `number` is that of the signal, `settled` how many members have a record.
    """

    def __init__(self, number: int, settled: int) -> None:
        super().__init__(f"{signal.Signals(number).name} after {settled} members")
        self.number, self.settled = number, settled


def serve(desk: Desk, total: int, asked: Sequence[int], progress: Progress | None) -> None:
    """Send batches and take their records until all members are settled, or until someone asks for
    an end.
    """
    while len(desk.settled) < total and not asked:
        send(desk)
        with contextlib.suppress(Empty):
            # a worker gets its next batch before the records of the last one are kept
            future = desk.done.get(not desk.waiting, TICK)
            if future in desk.busy:
                settle(desk, future, desk.busy.pop(future))
                continue
        if desk.waiting:
            enter(desk, desk.waiting.popleft())
        if progress:
            progress(len(desk.settled) / total)
    while desk.waiting:
        enter(desk, desk.waiting.popleft())
    if asked:
        raise Stopped(asked[0], len(desk.settled))


@contextlib.contextmanager
def find_workers(options: SweepOptions, count: int) -> Iterator[Workers]:
    """Where so many members run."""
    if options.scheduler:
        with workers.of_cluster(options.scheduler) as found:
            yield found
        return
    given = options.executor
    most = min(options.workers or processes.cores(), count)
    with (
        contextlib.nullcontext(given)
        if given is not None
        else processes.Processes(most) as executor
    ):
        there = width(executor) or count  # one that does not say how many it has gets all
        yield Workers(executor, lambda: there)


def width(executor: Executor) -> int:
    """How many members an executor runs at a time; 0 where it does not say."""
    return getattr(executor, "_max_workers", None) or 0


def send(desk: Desk) -> None:
    """As many batches as there are workers: those that came back first."""
    now = clock.monotonic()
    there = desk.workers.count()
    desk.most = max(desk.most, min(there, desk.prepared))
    desk.seen = now if there else desk.seen
    if now - desk.seen > PATIENCE:
        raise InputError(
            say(
                "sweep",
                "a worker",
                f"none for {PATIENCE:g} s",
                "start workers; the records so far are kept",
            )
        )
    if desk.options.first_alone and not desk.prepared:
        there = min(there, 1)
    while len(desk.busy) < there and (desk.back or desk.queue):
        if desk.back:
            batch = desk.back.popleft()
        else:
            batch = Batch(tuple(desk.queue.popleft() for _ in range(choose_length(desk, there))))
        if desk.prepared:
            desk.began = desk.began or now
        try:
            future = desk.workers.executor.submit(
                desk.work, batch.members, desk.options.timeout, batch.at_once
            )
        except BrokenExecutor as error:
            got = f"one that lost its workers ({error})"
            remedy = "the records so far are kept: go on with resume"
            raise InputError(
                say("sweep: executor", "an executor that runs", got, remedy)
            ) from error
        desk.busy[future] = replace(batch, since=now)
        future.add_done_callback(desk.done.put)


def choose_length(desk: Desk, there: int) -> int:
    """Members of the next batch: one at first, then as many as take the wanted time, fewer towards
    the end.
    """
    if not desk.ready:
        return 1
    mean = max(desk.busy_s / desk.ready, SHORTEST)
    return max(1, min(round(desk.options.batch / mean), math.ceil(len(desk.queue) / (2 * there))))


def settle(desk: Desk, future: Future[Any], batch: Batch) -> None:
    """Take what a worker gives back."""
    try:
        found = future.result()
    except desk.workers.losses:
        bury(desk, batch)
        return
    if isinstance(found, tuple):  # of a task that cannot be prepared
        kind, message, reason = found
        raise kind(message) if reason is None else SolverError(message, reason)
    if found is None:
        desk.prepared += 1
        desk.back.appendleft(replace(batch, at_once=True))
        return
    for record in found:
        wait(desk, record)


def show(records: Iterable[Record]) -> None:
    """Notices of members that are settled."""
    heard: Heard = {}
    for record in records:
        hear(heard, record)
    show_others(heard)


def hear(heard: Heard, record: Record) -> None:
    """Show notices of a member that are the first of their kind: those that differ in numbers alone
    are of one.
    """
    for text in record.notices:
        kind = NUMBER.sub("", text)
        if kind not in heard:
            heard[kind] = text, []
            notify(text)
        elif text != heard[kind][0]:
            heard[kind][1].append(record.number)


def show_others(heard: Heard) -> None:
    """Say which members had a notice with other numbers, when all are settled."""
    for text, others in heard.values():
        if others:
            some = ", ".join(map(str, sorted(others)[:LISTED])) + (
                ", ..." if len(others) > LISTED else ""
            )
            notify(f"in {len(others)} more samples ({some}), with other numbers: {text}")


def wait(desk: Desk, record: Record) -> None:
    """A member is back, whose record is to be kept."""
    desk.waiting.append(record)
    desk.busy_s += record.wall_s
    desk.ready += 1


def enter(desk: Desk, record: Record) -> None:
    """A member is settled."""
    if desk.options.executor is None:
        hear(desk.heard, record)
    desk.keep(record)
    desk.settled.append(replace(record, result=None))


def bury(desk: Desk, batch: Batch) -> None:
    """A worker ended: its members are tried alone; one that was alone and has ended a worker before
    is listed.
    """
    took = clock.monotonic() - batch.since
    limit = desk.options.timeout
    if not desk.prepared:
        desk.back.append(batch)
        desk.unprepared += 1
        if desk.unprepared >= ATTEMPTS:
            got = f"{ATTEMPTS} that ended while they prepared it"
            raise InputError(
                say(
                    "sweep",
                    "workers that can run the task",
                    got,
                    "run one sample with fmbs run to see why",
                )
            )
        return
    desk.deaths += 1
    late = len(batch.members) == 1 and limit is not None and took >= limit
    if not late and not batch.again:
        desk.back.extend(Batch((member,), again=True) for member in batch.members)
        return
    status = Status.KILLED
    text = "its worker process ended twice: crash, kill or lack of memory"
    if late:
        status = Status.TIMEOUT
        text = f"took longer than {limit:g} s"
    member = batch.members[0]
    wait(desk, Record(member.number, member.values, status, status.value, text, wall_s=took))
