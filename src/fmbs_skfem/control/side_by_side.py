"""Live runs that take steps beside each other: one call of compiled code for many of them, in which
threads hold no interpreter lock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias

import numpy as np

from ..core.compiling.structs import address_of, packed
from ..core.errors import SolverError
from ..dynamics.compiled_step import side_by_side, stepping
from ..dynamics.compiled_step.side_by_side import Runs
from ..dynamics.measuring import RowMeter
from .live import LiveRun

Found: TypeAlias = dict[str, float] | SolverError


class SideBySide:
    """Runs p that know nothing of each other, and the outputs that are read of each by name.

    `threads` take their steps, the one that calls among them. Every run moves as alone, to the bit.
    """

    def __init__(self, runs: Sequence[LiveRun], observed: Sequence[str], threads: int) -> None:
        self.observed = (*observed,)
        self.runs = list(runs)
        count = len(self.runs)
        self.meters: list[RowMeter | None] = [None] * count
        self.shares = min(threads, count)
        self.record = Runs(
            repeat=stepping.repeat.address,
            read=side_by_side.read.address,
            steps=np.zeros(count, np.int64),
            readings=np.zeros(count, np.int64),
            chosen=np.zeros(count, np.int64),
            ends=np.zeros(self.shares + 1, np.int64),
            count=np.zeros(1, np.int64),
            status=np.zeros(count, np.int64),
        )
        self.packed = packed(self.record)
        self.address = address_of(self.packed)
        self.helpers = ThreadPoolExecutor(max(self.shares - 1, 1))
        for k, run in enumerate(self.runs):
            self.put(k, run)

    def put(self, k: int, run: LiveRun) -> None:
        """A run takes the place of the one with a number, or has been put to another state."""
        self.runs[k] = run
        meter = run.reader(self.observed)
        self.meters[k] = meter if isinstance(meter, RowMeter) else None
        self.record.steps[k] = run.run.packed.address
        self.record.readings[k] = meter.address if isinstance(meter, RowMeter) else 0

    def step(self, given: Mapping[int, Mapping[str, float]], count: int) -> dict[int, Found]:
        """Some runs by their numbers after so many steps with inputs by name: their outputs by
        column, or the error of a step that cannot be taken.

        Runs at which somebody looks step by step are taken one after the other.
        """
        found = dict[int, Found]()
        together = list[int]()
        for k, inputs in given.items():
            self.runs[k].feed.next = inputs
            if self.runs[k].is_held:
                together.append(k)
            else:
                found[k] = self.take_alone(k, count)
        while together:
            many = min(count, min(self.runs[k].reach for k in together))
            count -= many
            found |= self.take(together, many)
            together = [k for k in together if isinstance(found[k], dict)] if count else []
        return found

    def take_alone(self, k: int, count: int) -> Found:
        """The same of one run."""
        run = self.runs[k]
        try:
            run.step(run.feed.next, count)
        except SolverError as error:
            return error
        return run.outputs(self.observed)

    def take(self, chosen: Sequence[int], many: int) -> dict[int, Found]:
        """The same of runs whose steps are one call."""
        record = self.record
        for k in chosen:
            self.runs[k].begin_held()
        record.count[0] = many
        record.chosen[: len(chosen)] = chosen
        record.ends[:] = len(chosen) * np.arange(self.shares + 1) // self.shares
        call = side_by_side.take_share.call
        helping = [self.helpers.submit(call, self.address, k) for k in range(1, self.shares)]
        call(self.address, 0)
        for one in helping:
            one.result()
        status = record.status.tolist()
        return {k: self.end(k, status[k], many) for k in chosen}

    def end(self, k: int, status: int, many: int) -> Found:
        """What a run has reached that has ended with a status."""
        run, meter = self.runs[k], self.meters[k]
        try:
            run.end_held(status, many)
        except SolverError as error:
            return error
        if meter is None or status != stepping.DONE:
            return run.outputs(self.observed)
        return meter.evaluate(run.time)

    def close(self) -> None:
        """End the threads."""
        self.helpers.shutdown()
