"""Workers of a sweep: executors of one process each, of this machine or of a cluster of dask, or an executor that is given.

    there() -> {name: Executor}        workers at this moment; a name is never that of another process

A process that ends leaves its name out, and the call that it had raises one of `losses`. On this machine another one takes its
place at once.

M. Rocklin, Dask: parallel computation with blocked algorithms and task scheduling, Proc. 14th Python in Science Conf. (2015)
126-132, doi 10.25080/Majora-7b98e3ed-013.
"""

from __future__ import annotations

import contextlib
import itertools
import time as clock
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor

from ..core import extras
from ..core.errors import InputError, say
from ..core.processes import WorkerProcess
from ..core.storage.records import dataclass

CONNECT = 10.0  #: longest wait for a given cluster to answer [s]
SETTLED = 0.3  #: after which a worker of a cluster may end and be started again: one that ends while its nanny starts it is not [s]


@dataclass(frozen=True)
class Crew:
    """Where a sweep runs.

    An executor of workers that nobody can tell apart stands under several names, one for each member that it runs at a time.
    """

    there: Callable[[], Mapping[str, Executor]]  #: workers by name
    losses: tuple[type[Exception], ...]  #: errors of a call whose worker ended


@contextlib.contextmanager
def of_machine(count: int) -> Iterator[Crew]:
    """So many processes of this machine."""
    names = map("process {}".format, itertools.count())
    workers: dict[str, WorkerProcess] = {}

    def there() -> Mapping[str, Executor]:
        for name in [name for name, worker in workers.items() if worker.ended]:
            workers.pop(name).shutdown()
        while len(workers) < count:
            workers[next(names)] = WorkerProcess()
        return dict(workers)

    try:
        yield Crew(there, (BrokenExecutor, CancelledError))
    finally:
        for worker in workers.values():
            worker.shutdown(wait=False)
        for worker in workers.values():
            worker.wait()


@contextlib.contextmanager
def of_cluster(address: str) -> Iterator[Crew]:
    """Workers of a cluster of dask that runs; InputError where there is none."""
    extras.need("cluster", f"sweep: scheduler {address}")
    from distributed import Client, KilledWorker

    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(say(f"scheduler {address}", "the address of a running scheduler", error)) from error
    own = {"allow_other_workers": False, "pure": False}
    met: dict[str, float] = {}  #: when workers were first seen [s]

    def there() -> Mapping[str, Executor]:
        now = clock.monotonic()
        known = client.nthreads()
        for name in met.keys() - known.keys():
            del met[name]
        return {name: client.get_executor(workers=[name], **own) for name in known if now - met.setdefault(name, now) >= SETTLED}

    with client, client.as_current():
        yield Crew(there, (KilledWorker, CancelledError))


def of_executor(executor: Executor, count: int) -> Crew:
    """An executor that is given, as so many workers where it does not say how many it has."""
    given = dict.fromkeys(map(str, range(width(executor) or count)), executor)
    return Crew(lambda: given, (CancelledError,))


def width(executor: Executor) -> int:
    """How many members an executor runs at a time; 0 where it does not say."""
    return getattr(executor, "_max_workers", None) or 0
