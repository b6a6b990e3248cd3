"""Where a sweep runs: on an executor of any kind, among them a cluster of dask.

M. Rocklin, Dask: parallel computation with blocked algorithms and task scheduling, Proc. 14th
Python in Science Conf. (2015) 126-132, doi 10.25080/Majora-7b98e3ed-013.
"""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from typing import TYPE_CHECKING, Any

from ..core import extras
from ..core.errors import InputError, say
from ..core.storage.records import dataclass

if TYPE_CHECKING:
    from distributed import Client

CONNECT = 10.0  #: longest wait for a given cluster to answer [s]
SETTLED = 0.3  #: after which a worker of a cluster may end and be started again: one that ends while its nanny starts it is not [s]


@dataclass(frozen=True)
class Workers:
    """Where a sweep runs."""

    executor: Executor
    count: Callable[[], int]  #: how many there are at this moment
    #: errors of a call whose worker ended
    losses: tuple[type[Exception], ...] = (
        BrokenExecutor,
        CancelledError,
    )


@contextlib.contextmanager
def of_cluster(address: str) -> Iterator[Workers]:
    """Workers of a cluster of dask that runs; InputError where there is none."""
    extras.need("cluster", f"sweep: scheduler {address}")
    from distributed import Client, KilledWorker

    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            say(f"scheduler {address}", "the address of a running scheduler", error)
        ) from error
    met: dict[str, float] = {}  #: when workers were first seen [s]

    def count() -> int:
        now = clock.monotonic()
        known = client.nthreads()
        for name in met.keys() - known.keys():
            del met[name]
        return sum(now - met.setdefault(name, now) >= SETTLED for name in known)

    with client, client.as_current(), tried_once(client):
        yield Workers(client.get_executor(pure=False), count, (KilledWorker, CancelledError))


@contextlib.contextmanager
def tried_once(client: Client) -> Iterator[None]:
    """Calls of this client fail with their worker: dask would run them on three other ones, which
    may end as well.
    """
    from distributed.diagnostics.plugin import SchedulerPlugin

    class TriedOnce(SchedulerPlugin):  # goes to the scheduler by value
        def __init__(self, client: str) -> None:
            self.client = client
            self.name = f"fmbs {client}"

        def update_graph(self, scheduler: Any, *, client: str, keys: set[Any], **_: Any) -> None:
            for key in keys if client == self.client else ():
                scheduler.tasks[key].suspicious = scheduler.allowed_failures

    plugin = TriedOnce(client.id)
    client.register_plugin(plugin)
    try:
        yield
    finally:
        client.unregister_scheduler_plugin(plugin.name)
