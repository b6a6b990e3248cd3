r"""Sweeps: many members of a family computed by worker processes, which may fail, hang or die without hurting the others.

    points (k, d) -> batches -> workers -> records, one a member, as they finish

A task is prepared once in every worker and then runs members. Workers (`workers`) are processes of this machine that live as long
as the sweep, or those of a cluster of dask. Every worker has one batch at a time, long enough that sending it costs next to
nothing. A worker that ends takes its batch with it: its members are tried again one by one, and the member with which a worker
ends again is listed as killed. A member that takes longer than the time limit ends its worker by a timer outside of the
interpreter (so that compiled code cannot hold it up) and is listed as timeout.

Whoever may hand tasks to a worker runs code as its user: workers of this machine have no ports, a cluster is secured by those who
run it.
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
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import AbstractContextManager
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
from .members import Member, Record, Result, Status, Task, Work
from .workers import Crew

__all__ = ["Task", "Work", "Member", "Result", "Record", "Status", "SweepOptions", "SweepOutcome", "run"]

BATCH = 1.0  #: time that a batch should take [s]
SHORTEST = 1e-4  #: time of a member, at least [s]
TICK = 0.5  #: longest time between two looks at the workers [s]
GRACE = 2.0  #: after which a batch on a worker that is not there is taken for lost [s]
PATIENCE = 60.0  #: after which a sweep without any worker is given up [s]
ATTEMPTS = 3  #: workers in a row that may end while they prepare
LISTED = 10  #: members that a notice lists
NUMBER = re.compile(r"(?<![\w'])-?\d+(\.\d*)?(e[-+]?\d+)?")  #: in a notice; not in names

Keep: TypeAlias = Callable[[Record], object]
Heard: TypeAlias = dict[str, tuple[str, list[int]]]  #: notices without their numbers: the first, and members with other numbers


@dataclass(frozen=True)
class SweepOptions:
    """Where a sweep runs and how long it waits.

    InputError for fewer than one worker, for workers beside a given cluster, for workers, a cluster or a time limit beside an
    executor, and for times that are not positive.
    """

    workers: int | None = None  #: processes on this machine; None for one a core
    scheduler: str | None = None  #: address of a cluster, tcp://host:port, instead of processes on this machine
    timeout: float | None = None  #: longest time of one member [s]
    batch: float = BATCH  #: [s]
    first_alone: bool = False  #: one worker prepares before the others, which find its compiled code
    executor: Executor | None = None  #: of threads, MPI, ..., instead of both; a worker that ends ends the sweep

    def __post_init__(self) -> None:
        if self.workers is not None and (self.workers < 1 or self.scheduler):
            expected = "none for a given cluster" if self.scheduler else "at least 1"
            raise InputError(say("sweep: workers", expected, self.workers))
        if self.executor is not None and (self.workers or self.scheduler or self.timeout):
            remedy = "the executor has its own; a time limit would end its processes"
            raise InputError(say("sweep: executor", "no workers, scheduler and timeout beside it", "one of them", remedy))
        for name, value in (("timeout", self.timeout), ("batch", self.batch)):
            if value is not None and not 0 < value < math.inf:
                raise InputError(say(f"sweep: {name}", "a positive time [s]", value))


@dataclass(frozen=True)
class SweepOutcome:
    """How a sweep went.

    Members that were skipped count nowhere. `busy_s` over `wall_s` times `workers` is how well the workers were used.
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
        """Part of the workers' time, after the start, that was spent on no member."""
        there = self.workers * (self.wall_s - self.start_s)
        return 1.0 - self.busy_s / there if there > 0 else 0.0


@dataclass(frozen=True)
class Sent:
    """Members that went to a worker together; none where it prepares."""

    members: tuple[Member, ...]
    worker: str
    since: float  #: [s]
    again: bool  #: whether its only member was with a worker that ended


@dataclass
class Desk:
    """A sweep on its way. A worker is an executor of one process, and an executor that is given stands for any number of them."""

    crew: Crew
    work: Callable[..., Any]  #: `members.work` of the task
    options: SweepOptions
    queue: deque[Member]
    keep: Keep
    alone: deque[Member] = field(default_factory=deque)  #: members of lost batches, one by one
    busy: dict[Future[Any], Sent] = field(default_factory=dict)
    done: SimpleQueue[Future[Any]] = field(default_factory=SimpleQueue)
    ready: set[str] = field(default_factory=set)  #: workers that have prepared the task
    counts: Counter[Status] = field(default_factory=Counter)
    heard: Heard = field(default_factory=dict)  #: notices of members
    late: list[Record] = field(default_factory=list)  #: whose notices are given when all are settled
    most: int = 0  #: workers at a time
    deaths: int = 0
    unprepared: int = 0  #: workers in a row that ended while they prepared
    busy_s: float = 0.0
    cpu_s: float = 0.0
    began: float | None = None  #: when the first member was sent [s]
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
    """Run the members at `points` (k, d), whose columns are `names`, except the numbers in `skip`; each record goes to `keep`.

    Records come in any order. An error of `keep` (a full disk) ends the sweep, as does a task that cannot be prepared; whatever
    happens to a member does not. Scripts that call this with processes of this machine need `if __name__ == "__main__":`.
    """
    options, table = options or SweepOptions(), np.asarray(points, dtype=float)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise InputError(say("sweep: points", f"an array (k, {len(names)})", f"shape {table.shape}"))
    todo = [Member(k, dict(zip(names, row.tolist(), strict=True))) for k, row in enumerate(table) if k not in set(skip)]
    start, asked = clock.monotonic(), list[int]()
    if not todo:
        return SweepOutcome({}, 0, 0.0, 0.0, 0.0, 0.0, 0)
    # an interrupt that is raised inside of a callback, as dask has many, would be lost
    with endings.noted(asked.append), crew(options, len(todo)) as found:
        desk = Desk(found, partial(members.work, uuid.uuid4().hex, task), options, deque(todo), keep)
        try:
            with warnings.catch_warnings():  # as they were, whatever threads leave of theirs
                serve(desk, len(todo), asked, progress)
        finally:
            for future in desk.busy:
                future.cancel()
            for record in desk.late:
                hear(desk.heard, record)
            show_others(desk.heard)
    end = clock.monotonic()
    begun = (desk.began or end) - start
    count = desk.most if options.executor is None else workers.width(options.executor) or 1
    return SweepOutcome(dict(desk.counts), count, begun, end - start, desk.busy_s, desk.cpu_s, desk.deaths)


class Stopped(KeyboardInterrupt):
    """A signal ended a sweep; the records so far are kept.

    As of Ctrl-C: `number` is that of the signal, `settled` how many members have a record.
    """

    def __init__(self, number: int, settled: int) -> None:
        super().__init__(f"{signal.Signals(number).name} after {settled} members")
        self.number, self.settled = number, settled


def serve(desk: Desk, total: int, asked: Sequence[int], progress: Progress | None) -> None:
    """Send batches and take their records until all members are settled, or until someone asks for an end."""
    while sum(desk.counts.values()) < total and not asked:
        send(desk)
        with contextlib.suppress(Empty):
            future = desk.done.get(timeout=TICK)
            if future in desk.busy:
                settle(desk, future, desk.busy.pop(future))
        if progress:
            progress(sum(desk.counts.values()) / total)
    if asked:
        raise Stopped(asked[0], sum(desk.counts.values()))


def crew(options: SweepOptions, count: int) -> AbstractContextManager[Crew]:
    """Where so many members run."""
    if options.executor is not None:
        return contextlib.nullcontext(workers.of_executor(options.executor, count))
    if options.scheduler:
        return workers.of_cluster(options.scheduler)
    return workers.of_machine(min(options.workers or processes.cores(), count))


def send(desk: Desk) -> None:
    """A batch for every worker that is free; those that came prepare the task, batches of those that went are given up."""
    now, there = clock.monotonic(), desk.crew.there()
    for future, sent in list(desk.busy.items()):
        if sent.worker not in there and now - sent.since > GRACE and not future.done():
            del desk.busy[future]
            future.cancel()
            bury(desk, sent)
    desk.ready &= there.keys()
    occupied = {sent.worker for sent in desk.busy.values()}
    for worker in [worker for worker in there if worker not in occupied]:
        prepared = worker in desk.ready or desk.options.executor is not None
        if not prepared:
            if not (desk.options.first_alone and not desk.most and desk.busy):
                post(desk, there[worker], Sent((), worker, now, False))
        elif desk.alone:
            post(desk, there[worker], Sent((desk.alone.popleft(),), worker, now, True))
        elif desk.queue:
            batch = tuple(desk.queue.popleft() for _ in range(choose_length(desk)))
            post(desk, there[worker], Sent(batch, worker, now, False))
    desk.most = max(desk.most, len(desk.ready))
    desk.seen = now if there else desk.seen
    if now - desk.seen > PATIENCE:
        raise InputError(say("sweep", "a worker", f"none for {PATIENCE:g} s", "start workers; the records so far are kept"))


def choose_length(desk: Desk) -> int:
    """Members of the next batch: one at first, then as many as take the wanted time, fewer towards the end."""
    settled = desk.counts[Status.OK] + desk.counts[Status.FAILED]
    if not settled:
        return 1
    mean = max(desk.busy_s / settled, SHORTEST)
    return max(1, min(round(desk.options.batch / mean), math.ceil(len(desk.queue) / (2 * max(1, len(desk.ready))))))


def post(desk: Desk, worker: Executor, sent: Sent) -> None:
    """Send members to a worker, and nowhere else."""
    if sent.members:
        desk.began = desk.began or sent.since
    future = worker.submit(desk.work, sent.members, desk.options.timeout)
    desk.busy[future] = sent
    future.add_done_callback(desk.done.put)


def settle(desk: Desk, future: Future[Any], sent: Sent) -> None:
    """Take what a worker gives back."""
    try:
        found = future.result()
    except desk.crew.losses:
        bury(desk, sent)
        return
    except BrokenExecutor as error:
        got, remedy = f"one that lost its workers ({error})", "the records so far are kept: go on with resume"
        raise InputError(say("sweep: executor", "an executor that runs", got, remedy)) from error
    if isinstance(found, tuple):  # of a task that cannot be prepared
        kind, message, reason = found
        raise kind(message) if reason is None else SolverError(message, reason)
    desk.ready.add(sent.worker)
    desk.unprepared = 0
    for record in found:
        enter(desk, record)


def show(records: Iterable[Record]) -> None:
    """Notices of members that are settled."""
    heard: Heard = {}
    for record in records:
        hear(heard, record)
    show_others(heard)


def hear(heard: Heard, record: Record) -> None:
    """Show notices of a member that are the first of their kind: those that differ in numbers alone are of one."""
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
            some = ", ".join(map(str, sorted(others)[:LISTED])) + (", ..." if len(others) > LISTED else "")
            notify(f"in {len(others)} more samples ({some}), with other numbers: {text}")


def enter(desk: Desk, record: Record) -> None:
    """A member is settled; threads of this process, which catch the notices of their own, would catch its notices as well."""
    if desk.options.executor is None:
        hear(desk.heard, record)
    else:
        desk.late.append(replace(record, result=None))
    desk.keep(record)
    desk.counts[record.status] += 1
    desk.busy_s += record.wall_s
    desk.cpu_s += record.cpu_s


def bury(desk: Desk, sent: Sent) -> None:
    """A worker ended: its members are tried alone; one that was alone and has ended a worker before is listed."""
    took, limit = clock.monotonic() - sent.since, desk.options.timeout
    desk.ready.discard(sent.worker)
    if not sent.members:
        desk.unprepared += 1
        if desk.unprepared >= ATTEMPTS:
            got = f"{ATTEMPTS} that ended while they prepared it"
            raise InputError(say("sweep", "workers that can run the task", got, "run one sample with fmbs run to see why"))
        return
    desk.deaths += 1
    late = len(sent.members) == 1 and limit is not None and took >= limit
    if not late and not sent.again:
        desk.alone.extend(sent.members)
        return
    status, text = Status.KILLED, "its worker process ended twice: crash, kill or lack of memory"
    if late:
        status, text = Status.TIMEOUT, f"took longer than {limit:g} s"
    member = sent.members[0]
    enter(desk, Record(member.number, member.values, status, status.value, text, wall_s=took))
