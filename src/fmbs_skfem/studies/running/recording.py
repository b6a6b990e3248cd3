"""The folder of a run while it runs: settled and locked before anything is solved, and a motion
that can be stopped and resumed.
"""

from __future__ import annotations

import contextlib
import shutil
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ...core.errors import FmbsError, InputError, say
from ...core.storage import endings, locks
from ...dynamics.checkpoint import RunState
from ...results import segments
from ...results.segments import Recorder
from .. import job as jobs
from ..job import Job

Watch = Callable[[RunState], None]


class Interrupted(FmbsError):
    """A signal ended a run, which is kept; the exit code is 128 + its number."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(text)
        self.exit_code = 128 + number


class TimeOver(FmbsError):
    """The time that a run was given is over; the run is kept."""

    exit_code = 6


@contextlib.contextmanager
def place(job: Job, names: Iterable[str], mark: str) -> Iterator[Path | None]:
    """The output folder for `names`, made and locked; None where nothing is written.

    A history that ended is removed, and so is any with --force; a run that can go on is not.
    """
    out = jobs.settle_folder(job, names, mark)
    if out is None:
        yield None
        return
    with locks.own(out):
        if (out / segments.FOLDER).exists():
            clear(job, out, mark)
        yield out


def clear(job: Job, out: Path, mark: str) -> None:
    """Remove the history in a folder, unless it is another run's or one that can go on."""
    if not job.force and segments.exists(out):
        found = segments.manifest(out)
        where = f"--out {out}"
        if found.state is segments.HistoryState.RUNNING:
            got = f"a run that was stopped at t = {found.time:.6g} s"
            raise InputError(
                say(
                    where,
                    "an empty folder",
                    got,
                    f"go on with: fmbs resume {out}; or begin anew with --force",
                )
            )
        if found.job.get("fingerprint") != mark:
            got, remedy = "the history of another run", "choose another folder, or --force"
            raise InputError(say(where, "an empty folder or one of the same run", got, remedy))
    shutil.rmtree(out / segments.FOLDER)


@contextlib.contextmanager
def stoppable(record: Recorder | None, limit: float) -> Iterator[Watch | None]:
    """A record that ends its run at SIGINT, SIGTERM and SIGHUP, or after `limit` seconds, with a
    segment and a checkpoint.

    A second signal acts as usual, and so does one that comes before the run has shown any state:
    there is nothing to keep.
    """
    if record is None:
        yield None
        return
    end = time.perf_counter() + limit
    arrived: list[int] = []
    shown = False

    def note(number: int) -> None:
        arrived.append(number)
        restore()
        if not shown:
            signal.raise_signal(number)

    def watch(moment: RunState) -> None:
        nonlocal shown
        shown = True
        over = time.perf_counter() >= end and moment.done < moment.steps
        if not arrived and not over:
            return record(moment)
        record.write(moment)
        at = f"at t = {moment.time:.6g} s, after {moment.done} of {moment.steps} steps"
        remedy = f"go on with: fmbs resume {record.folder}"
        if arrived:
            raise Interrupted(
                arrived[0], f"stopped by {signal.Signals(arrived[0]).name} {at}; {remedy}"
            )
        raise TimeOver(f"stopped by --time-limit {limit:g} {at}; {remedy}")

    with endings.noted(note) as restore:
        yield watch
