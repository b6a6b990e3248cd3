"""Sweeps: every member is settled, whatever the others do; what is lost, listed and tried again."""

from __future__ import annotations

import contextlib
import faulthandler
import logging
import multiprocessing
import os
import re
import signal
import time as clock
import warnings
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice, notify
from fmbs_skfem.families import members, sweeps, workers
from fmbs_skfem.families.sweeps import MemberResult, Record, Status, SweepOptions, SweepOutcome

from ..hard_cases import child, ended

TIMES = np.linspace(0.0, 1.0, 5)
LIMIT = 0.5  #: of members that hang [s]


def hold_the_lock() -> None:
    """Keep the interpreter lock for ages."""
    re.match(r"(a+)+$", "a" * 60 + "b")


@dataclass(frozen=True)
class Squares:
    """Member x gives x^2 t, unless it is among those that misbehave."""

    kills: tuple[float, ...] = ()
    hangs: tuple[float, ...] = ()
    diverges: tuple[float, ...] = ()
    breaks: tuple[float, ...] = ()
    exits: tuple[float, ...] = ()
    notices: tuple[float, ...] = ()
    waits: tuple[float, ...] = ()
    #: the first member to see that this file is missing makes it and kills its worker
    once: Path | None = None
    unprepared: str = ""  #: what happens when it is prepared

    def prepare(self) -> sweeps.Work:
        if self.hangs:  # in a process of the sweep: its clock runs for those that hang alone, however busy the machine is
            never = SimpleNamespace(
                dump_traceback_later=lambda *_, **__: None, cancel_dump_traceback_later=lambda: None
            )
            members.faulthandler = never  # type: ignore[assignment]
        if self.unprepared == "refuses":
            raise InputError("mesh: expected a file, got none")
        if self.unprepared == "dies":
            os.kill(os.getpid(), signal.SIGKILL)
        return lambda values: self.square(values["x"])

    def square(self, x: float) -> MemberResult:
        if x in self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        if self.once is not None and not self.once.exists():
            self.once.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if x in self.hangs:
            faulthandler.dump_traceback_later(LIMIT, exit=True)
            hold_the_lock()
        if x in self.diverges:
            raise SolverError("t = 0.5: expected convergence, got none", Reason.DIVERGED, 0.5)
        if x in self.breaks:
            raise ZeroDivisionError("x")
        if x in self.exits:
            raise SystemExit(1)
        if x in self.waits:
            clock.sleep(3600.0)
        if x in self.notices:
            notify("outside the trained box")
        return MemberResult(TIMES, {"y": x**2 * TIMES}, {"y": "m"}, {"predicted error": 1e-3 * x})


def points(count: int) -> np.ndarray:
    return np.arange(float(count))[:, None]


def swept(
    task: Squares, count: int, options: SweepOptions, skip: Sequence[int] = ()
) -> tuple[dict[int, Record], SweepOutcome]:
    """Records by number; no member is settled twice."""
    found: list[Record] = []
    outcome = sweeps.run(task, ("x",), points(count), found.append, options, skip)
    records = {record.number: record for record in found}
    assert len(records) == len(found)
    return records, outcome


def check_squares(records: Mapping[int, Record], numbers: Sequence[int]) -> None:
    """These members are right to the bit."""
    for k in numbers:
        record = records[k]
        assert (record.status, record.values) == (Status.OK, {"x": float(k)})
        assert record.result is not None
        np.testing.assert_array_equal(record.result.columns["y"], float(k) ** 2 * TIMES)
        assert record.result.numbers == {"predicted error": 1e-3 * k}


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster that was there before, for tasks that leave its workers alive."""
    yield from start_cluster()


@pytest.fixture
def fragile() -> Iterator[str]:
    """A cluster for tasks that kill workers: dask may start them again or not."""
    yield from start_cluster()


def start_cluster() -> Iterator[str]:
    """Two workers, with the usual settings of dask."""
    from distributed import LocalCluster  # not for workers that read this module

    with LocalCluster(
        2, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster.scheduler_address


def test_guilty_members_are_listed_and_the_rest_finishes() -> None:
    """Killed, diverging, broken and exiting members among 60, on processes of this machine."""
    task = Squares(kills=(20.0,), diverges=(5.0,), breaks=(6.0,), exits=(7.0,), notices=(8.0, 9.0))
    with pytest.warns(Notice, match="outside the trained box") as given:
        records, outcome = swept(task, 60, SweepOptions(workers=2))
    assert sorted(records) == list(range(60))
    check_squares(records, [k for k in range(60) if k not in (5, 6, 7, 20)])
    ends = {k: (records[k].status, records[k].reason) for k in (5, 6, 7, 20)}
    assert ends == {
        5: (Status.FAILED, "diverged"),
        6: (Status.FAILED, "ZeroDivisionError"),
        7: (Status.FAILED, "SystemExit"),
        20: (Status.KILLED, "killed"),
    }
    assert records[5].message == "t = 0.5: expected convergence, got none"
    assert records[20].values == {"x": 20.0}
    assert outcome.counts == {Status.OK: 56, Status.FAILED: 3, Status.KILLED: 1}
    assert outcome.deaths >= 2
    assert len([warning for warning in given if issubclass(warning.category, Notice)]) == 1


def test_a_member_that_takes_too_long_is_listed_and_the_rest_finishes() -> None:
    records, outcome = swept(Squares(hangs=(41.0,)), 60, SweepOptions(workers=2, timeout=LIMIT))
    check_squares(records, [k for k in range(60) if k != 41])
    assert (records[41].status, records[41].reason) == (Status.TIMEOUT, "timeout")
    assert records[41].wall_s >= LIMIT
    assert outcome.counts == {Status.OK: 59, Status.TIMEOUT: 1}


def test_the_time_of_a_member_needs_no_interpreter_lock() -> None:
    def hang() -> None:
        with members.limit_time(LIMIT):
            hold_the_lock()

    assert ended(child(hang)) == 1
    with members.limit_time(3600.0):
        pass


def test_notices_that_differ_in_numbers_alone_are_given_once_more_with_the_members() -> None:
    texts = [f"part 'arm2': strain {k}.5e-3 at (-{k}, 0) m" for k in range(13)]
    told = [Record(k, {}, Status.OK, notices=(text, "the same")) for k, text in enumerate(texts)]
    with pytest.warns(Notice) as given:
        sweeps.show(
            [*told, Record(13, {}, Status.OK, notices=("part 'arm3': strain 1.5e-3 at (-1, 0) m",))]
        )
    assert [str(one.message) for one in given] == [
        texts[0],
        "the same",
        "part 'arm3': strain 1.5e-3 at (-1, 0) m",
        f"in 12 more samples (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, ...), with other numbers: {texts[0]}",
    ]


def test_a_given_cluster_is_used_and_left_running(address: str) -> None:
    for _ in range(2):
        records, outcome = swept(Squares(), 200, SweepOptions(scheduler=address))
        check_squares(records, range(200))
        assert outcome.counts == {Status.OK: 200}


def test_a_given_cluster_that_loses_workers(fragile: str, tmp_path: Path) -> None:
    """One member kills its worker always, another one's worker dies once: that one is no member's
    fault.
    """
    records, outcome = swept(Squares(kills=(3.0,)), 12, SweepOptions(scheduler=fragile))
    assert records[3].status is Status.KILLED
    check_squares(records, [k for k in range(12) if k != 3])
    records, outcome = swept(Squares(once=tmp_path / "died"), 12, SweepOptions(scheduler=fragile))
    check_squares(records, range(12))
    assert outcome.deaths == 1


def test_members_that_are_there_are_skipped(address: str) -> None:
    records, outcome = swept(
        Squares(kills=(0.0, 2.0)), 6, SweepOptions(scheduler=address), skip=[0, 2, 5]
    )
    check_squares(records, [1, 3, 4])
    assert outcome.counts == {Status.OK: 3}
    records, outcome = swept(Squares(), 3, SweepOptions(scheduler=address), skip=range(3))
    assert (records, outcome.counts) == ({}, {})


def test_a_task_that_refuses_to_be_prepared_ends_the_sweep(address: str) -> None:
    with pytest.raises(InputError, match="mesh: expected a file"):
        swept(Squares(unprepared="refuses"), 4, SweepOptions(scheduler=address))


def test_a_task_whose_preparation_kills_its_workers_ends_the_sweep(fragile: str) -> None:
    with pytest.raises(InputError, match="ended while they prepared"):
        swept(Squares(unprepared="dies"), 4, SweepOptions(scheduler=fragile))


def test_an_error_of_the_keeper_ends_the_sweep(address: str) -> None:
    def full(record: Record) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        sweeps.run(Squares(), ("x",), points(40), full, SweepOptions(scheduler=address))


def test_an_interrupt_ends_the_sweep_wherever_it_arrives(address: str) -> None:
    """Python loses a KeyboardInterrupt that is raised inside of a weak reference's callback; the
    records so far are kept.
    """
    found: list[Record] = []

    def keep(record: Record) -> None:
        found.append(record)
        if len(found) == 3:
            thing = Squares()
            watch = weakref.ref(thing, lambda gone: os.kill(os.getpid(), signal.SIGINT))
            del thing
            assert watch() is None

    # shells start background jobs that ignore it
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            sweeps.run(Squares(), ("x",), points(500), keep, SweepOptions(scheduler=address))
        assert 3 <= len(found) < 500
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, usual)


def test_an_interrupt_ends_a_sweep_of_this_machine_at_once() -> None:
    """Whatever its processes do; none is left, and what is done is kept."""
    found: list[Record] = []

    def keep(record: Record) -> None:
        found.append(record)
        os.kill(os.getpid(), signal.SIGTERM)

    begin, before = clock.monotonic(), multiprocessing.active_children()
    with pytest.raises(sweeps.Stopped) as stopped:
        sweeps.run(
            Squares(waits=(1.0, 2.0)), ("x",), points(9), keep, SweepOptions(workers=1, batch=1e-9)
        )
    assert (stopped.value.number, stopped.value.settled) == (signal.SIGTERM, 1)
    assert clock.monotonic() - begin < 60.0
    assert set(multiprocessing.active_children()) == set(before)
    check_squares({record.number: record for record in found}, [0])


class Stage(Executor):
    """Stands for one worker that dies, by `script`: for each call the seconds that it takes, and
    whether the worker ends.
    """

    def __init__(self, clock: SimpleNamespace, script: Sequence[tuple[float, bool]]) -> None:
        self.clock, self.script, self.sent = clock, list(script), list[int]()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **more: Any) -> Future[Any]:
        future: Future[Any] = Future()
        took, ends = self.script.pop(0) if self.script else (0.0, False)
        self.sent.append(len(arguments[0]))
        self.clock.now += took
        if ends:
            members.READY.clear()
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(function(*arguments, **more))
        return future


def staged(
    script: Sequence[tuple[float, bool]],
    count: int,
    monkeypatch: pytest.MonkeyPatch,
    **options: Any,
) -> tuple[dict[int, Record], SweepOutcome, Stage]:
    """A sweep whose only worker follows a script, with a clock of its own."""
    clock = SimpleNamespace(now=0.0)
    stage = Stage(clock, script)
    monkeypatch.setattr(sweeps, "clock", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(members, "limit_time", lambda timeout: contextlib.nullcontext())
    known = workers.Workers(stage, lambda: 1, (BrokenExecutor,))
    monkeypatch.setattr(sweeps, "find_workers", lambda *_: contextlib.nullcontext(known))
    return *swept(Squares(), count, SweepOptions(**options)), stage


def test_time_to_prepare_is_not_that_of_a_member(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker prepares for 5 s, its successor as well; the member ends both after 0.1 s: killed,
    though 1 s is the limit.
    """
    script = [(5.0, False), (0.1, True), (5.0, False), (0.1, True), (5.0, False)]
    records, outcome, stage = staged(script, 3, monkeypatch, timeout=1.0)
    assert (records[0].status, records[0].wall_s) == (Status.KILLED, pytest.approx(0.1))
    check_squares(records, [1, 2])
    assert (outcome.deaths, outcome.start_s, outcome.workers) == (2, 5.0, 1)
    assert stage.sent == [1, 1, 1, 1, 1, 1, 1]
    records, outcome, _ = staged([(5.0, False), (1.0, True)], 3, monkeypatch, timeout=1.0)
    assert (records[0].status, records[0].wall_s, outcome.deaths) == (Status.TIMEOUT, 1.0, 1)
    check_squares(records, [1, 2])


def test_a_lost_batch_is_tried_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The batch is lost, and of its members the second one again; the next batches are as long as
    before.
    """
    script = [(0.0, False), (0.0, False), (0.0, True), *[(0.0, False)] * 2, (0.0, True)]
    records, outcome, stage = staged(script, 9, monkeypatch)
    assert stage.sent[:8] == [1, 1, 4, 1, 1, 1, 1, 1]
    assert [k for k in range(9) if records[k].status is Status.KILLED] == [2]
    assert outcome.deaths == 2
    check_squares(records, [0, 1, *range(3, 9)])


def test_workers_that_end_while_they_prepare_end_the_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        InputError,
        match="expected workers that can run the task, got 3 that ended while they prepared it",
    ):
        staged([(1.0, True)] * 3, 3, monkeypatch)
    records, outcome, _ = staged([(1.0, True)] * 2, 3, monkeypatch)
    check_squares(records, range(3))
    assert outcome.deaths == 0


def test_an_interrupt_ends_a_sweep_on_an_executor() -> None:
    """As that of processes: the records so far are kept, and what is waiting is not begun."""
    found: list[Record] = []

    def keep(record: Record) -> None:
        found.append(record)
        if len(found) == 3:
            os.kill(os.getpid(), signal.SIGTERM)

    usual = signal.getsignal(signal.SIGTERM)
    with ThreadPoolExecutor(2) as pool, pytest.raises(sweeps.Stopped) as stopped:
        sweeps.run(Squares(), ("x",), points(500), keep, SweepOptions(executor=pool, batch=1e-9))
    assert (stopped.value.number, stopped.value.settled) == (signal.SIGTERM, len(found))
    assert 3 <= len(found) < 500
    assert signal.getsignal(signal.SIGTERM) is usual


def test_members_travel_together_on_an_executor() -> None:
    """The first ones by themselves, of which one comes back from whoever prepares; then as many as
    take the time of a batch.
    """
    sent: list[int] = []

    class Counting(ThreadPoolExecutor):
        def submit(
            self, function: Callable[..., Any], /, *arguments: Any, **more: Any
        ) -> Future[Any]:
            sent.append(len(arguments[0]))
            return super().submit(function, *arguments, **more)

    with Counting(2) as pool:
        records, outcome = swept(Squares(), 200, SweepOptions(executor=pool))
    check_squares(records, range(200))
    assert (sent[:3], sum(sent), outcome.workers) == ([1, 1, 1], 201, 2)
    assert len(sent) < 50


def test_workers_have_their_next_batch_before_records_are_kept() -> None:
    """What a full disk takes to write, no worker waits for."""
    sent: list[int] = []

    class Counting(ThreadPoolExecutor):
        def submit(
            self, function: Callable[..., Any], /, *arguments: Any, **more: Any
        ) -> Future[Any]:
            sent.append(len(sent))
            return super().submit(function, *arguments, **more)

    kept = dict[int, int]()
    with Counting(1) as pool:
        keep = lambda record: kept.__setitem__(record.number, len(sent))  # noqa: E731
        sweeps.run(Squares(), ["x"], [[1.0], [2.0]], keep, SweepOptions(executor=pool))
    # the first batch went out twice, as its worker has prepared with it
    assert kept[0] == 3


def test_progress_ends_at_one(address: str) -> None:
    told: list[float] = []
    sweeps.run(
        Squares(),
        ("x",),
        points(9),
        lambda record: None,
        SweepOptions(scheduler=address),
        progress=told.append,
    )
    assert told[-1] == 1.0
    assert told == sorted(told)


def test_options_and_points_are_checked() -> None:
    for bad in (
        {"workers": 0},
        {"workers": 2, "scheduler": "tcp://x:1"},
        {"timeout": 0.0},
        {"timeout": float("inf")},
        {"batch": -1.0},
    ):
        with pytest.raises(InputError, match="sweep: "):
            SweepOptions(**bad)
    with pytest.raises(InputError, match="points"):
        sweeps.run(Squares(), ("x", "y"), points(3), print)


def test_an_address_without_a_scheduler_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "CONNECT", 0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of dask, which goes on trying for a moment
        with pytest.raises(InputError, match="the address of a running scheduler"):
            swept(Squares(), 2, SweepOptions(scheduler="tcp://127.0.0.1:9"))
