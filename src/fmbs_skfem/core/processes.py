"""Processes of this machine that run calls: an executor of so many, each of which may die without
hurting the others.

    call -> a process that is free -> what it gives, or BrokenExecutor where the process ends before

They start as new interpreters (nothing is forked), have one thread for linear algebra, import
nothing from the current folder, and run the Python files of scenes where this call may. What they
read and write goes over a pair of sockets without an address, which nobody else can open. Each has
its own, and this process keeps no copy of the far end, so that reading ends with the process:
`ProcessPoolExecutor` keeps one, and waits for ever for a process that is killed while it sends.
"""

from __future__ import annotations

import contextlib
import importlib
import math
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from . import consents
from .errors import InputError, say

LEAVE = 5.0  #: longest wait for the end of a process that has closed its line [s]
#: part of memory, in thousandths, by which Linux takes them for larger where memory is short: they
#: have to go before this process
FIRST_TO_GO = 500
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
ENVIRONMENT = {**dict.fromkeys(ONE_THREAD, "1"), "PYTHONSAFEPATH": "1"}


class Processes(Executor):
    """So many processes of this machine, each of which runs one call after the other.

    A process that ends by itself loses its own call alone (BrokenExecutor), and another one takes
    its place; a `ProcessPoolExecutor` loses all calls and ends. InputError where no process can
    start, as in a script that it would run again.
    """

    def __init__(self, count: int) -> None:
        self._max_workers = count  # as those of concurrent.futures call it
        self.threads = ThreadPoolExecutor(count)  # one a process: it waits for the answers
        self.consent = consents.current()  # of this call: threads have none
        #: by thread, each with the end of its line
        self.running: dict[int, tuple[SpawnProcess, Any]] = {}
        self.lock = threading.Lock()
        self.closed = False

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **more: Any) -> Future[Any]:
        return self.threads.submit(self.ask, function, arguments, more)

    def ask(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], more: Mapping[str, Any]
    ) -> Any:
        """What a call gives in the process of this thread."""
        sent = dumps((function, arguments, more))
        thread = threading.get_ident()
        with self.lock:  # one starts after the other: they are given an environment
            if self.closed:
                raise BrokenExecutor("the worker processes are shut down")
            begun = thread in self.running and self.running[thread][0].is_alive()
            if not begun:
                self.running[thread] = start(self.consent)
        process, line = self.running[thread]
        try:
            if not begun:
                line.recv_bytes()
                begun = True
            line.send_bytes(sent)
            found = line.recv_bytes()
        except (EOFError, OSError) as error:
            process.join(LEAVE)  # its exit code is known a moment later than its end
            process.kill()
            process.join()
            if not begun and (process.exitcode or 0) > 0:
                raise unguarded() from None
            raise BrokenExecutor("a worker process ended") from error
        value, failed = pickle.loads(found)
        if failed is not None:
            raise failed
        return value

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes at once, also where they work on a call or still start, which may take
        long; all calls are lost.
        """
        with self.lock:
            self.closed = True
        for process, _ in self.running.values():
            process.kill()
        self.threads.shutdown(wait, cancel_futures=True)
        for process, _ in self.running.values():
            process.join()


def start(consent: str) -> tuple[SpawnProcess, Any]:
    """A process, and this end of its line, on which it says when it is there."""
    context = multiprocessing.get_context("spawn")
    line, far = context.Pipe()
    process = context.Process(target=serve, args=(far,), daemon=True)
    try:
        # holding interrupts may start a process as well
        with environment(ENVIRONMENT | {consents.SWITCH: consent}), interrupts_held():
            process.start()
    except RuntimeError:  # this is such a process, on its way through the script
        raise unguarded() from None
    far.close()
    return process, line


def unguarded() -> InputError:
    """Of scripts that start processes wherever they are run."""
    return InputError(
        say(
            "processes of this machine",
            'a script that starts them below `if __name__ == "__main__":`',
            "some that cannot start, as where they would run the whole script again",
            "put what the script does below that line",
        )
    )


@contextlib.contextmanager
def environment(more: Mapping[str, str]) -> Iterator[None]:
    """Processes that start inside have these variables."""
    before = {name: os.environ.get(name) for name in more}
    os.environ.update(more)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Processes that start inside get no Ctrl-C, which reaches all those of a terminal: this one
    decides what becomes of them.
    """
    if sys.platform == "win32":
        yield
    else:
        resource_tracker.ensure_running()  # it lets interrupts through when it starts
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def dumps(value: Any) -> bytes:
    """A pickle; what is defined in a notebook or a terminal, and functions without a name, go by
    value.
    """
    try:
        found = pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        found = b""
    typed = b"__main__" in found and not hasattr(sys.modules["__main__"], "__file__")
    if found and not typed:
        return found
    return bytes(importlib.import_module("numba.cloudpickle").dumps(value))


def serve(line: Connection) -> None:
    """Run calls in this process until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Windows has not held it
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(FIRST_TO_GO))
    threading.Thread(target=end_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        line.send_bytes(b"here")
        while True:
            line.send_bytes(answer(line.recv_bytes()))


def end_with_parent() -> None:
    """A call that takes hours ends with the process that waits for it, however that ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def answer(sent: bytes) -> bytes:
    """What a call gives, or its error with the traceback of this process; exits and interrupts are
    errors here.
    """
    try:
        function, arguments, more = pickle.loads(sent)
        return dumps((function(*arguments, **more), None))
    except BaseException as error:
        text = f"in a worker process:\n{traceback.format_exc()}"
        error.add_note(text)
        with contextlib.suppress(Exception):
            found = dumps((None, error))
            # errors that want more than a message are written, but cannot be read
            pickle.loads(found)
            if isinstance(error, Exception):
                return found
        return dumps((None, RuntimeError(text)))


def cores(quotas: Path = Path("/sys/fs/cgroup")) -> int:
    """How many cores this process may use: those of its affinity, or fewer by the quota of its
    container.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    found = len(affinity(0)) if affinity else os.cpu_count() or 1
    for files in (
        ("cpu.max",),
        ("cpu/cpu.cfs_quota_us", "cpu/cpu.cfs_period_us"),
    ):  # second and first version
        with contextlib.suppress(
            OSError, ValueError
        ):  # without a quota there is a word for it, or -1
            quota, period = map(
                int, " ".join((quotas / name).read_text() for name in files).split()
            )
            found = min(found, math.ceil(quota / period)) if quota > 0 else found
    return found
