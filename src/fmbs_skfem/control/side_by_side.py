"""Live runs that take steps beside each other: one call of compiled code for all of them, in which
threads hold no interpreter lock.

What Python knows of a run beside its state (number of steps, inputs, turns) is kept in arrays over
all runs, and told to the run when somebody asks for it (`sync`): a call for each of 64 runs would
take three times as long as their steps.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..core.errors import SolverError
from ..core.values.inputs import KEPT
from ..dynamics.compiled_step import side_by_side, stepping
from ..dynamics.compiled_step.side_by_side import Runs
from ..dynamics.measuring import RowMeter, count_turns, due, warn_of_turns
from ..systems.measures.probes import formula_of
from .live import FEW, OFTEN, LiveRun


class SideBySide:
    """p runs of systems of one structure that know nothing of each other, their inputs by name, and
    the columns (c, p) of outputs that are read of them.

    Every run moves as alone, to the bit. Those at which somebody looks step by step, or of another
    structure than the first one, are taken one after the other.
    """

    def __init__(
        self, runs: Sequence[LiveRun], names: Sequence[str], observed: Sequence[str], threads: int
    ) -> None:
        self.runs, self.names, self.observed = list(runs), (*names,), (*observed,)
        first, count = self.runs[0], len(self.runs)
        self.h = first.run.scheme.step  #: [s]
        outputs = first.run.model.system.outputs
        self.outputs = {name: outputs[name] for name in self.observed} | {
            name: outputs[name] for name in first.turns.angles
        }
        self.known = [
            (name, one, formula)
            for name, one in self.outputs.items()
            if (formula := formula_of(one, first.run.model.system.dim)) is not None
        ]
        self.shown = sum(len(outputs[name].columns) for name in self.observed)
        self.columns = np.zeros((self.shown, count))
        self.number = np.zeros(count, np.int64)  #: steps taken
        self.time = np.zeros(count)  #: [s]
        self.stopped = np.zeros(count, bool)  #: by an event
        self.fast = np.zeros(count, bool)  #: which take their steps in one call
        self.rows = np.zeros((count, first.feed.row.shape[1]))  #: of signals
        self.inputs = first.feed.columns or []  #: columns of these by name
        self.meters: list[RowMeter | None] = [None] * count
        self.read = np.zeros((count, 3, sum(len(one.rows) for _, one, _ in self.known)))
        #: as `RowMeter.angles`
        self.angles = {name: np.zeros((4, count)) for name in first.turns.angles}
        #: values of inputs (p, j) in the last blocks of steps, and how many steps these have
        self.given: deque[tuple[np.ndarray, int]] = deque(maxlen=KEPT)
        self.since = np.zeros(count, np.int64)  #: blocks that a run has not been told of
        self.fresh = set[int]()  #: runs that have taken no step in a block so far
        self.shares = min(threads, count)
        self.record = Runs(
            repeat=stepping.repeat.address,
            read=side_by_side.read.address,
            steps=np.zeros(count, np.int64),
            readings=np.zeros(count, np.int64),
            chosen=np.zeros(count, np.int64),
            ends=np.zeros(self.shares + 1, np.int64),
            many=np.zeros(1, np.int64),
            status=np.zeros(count, np.int64),
        )
        self.packed, self.address = side_by_side.placed(self.record)
        self.helpers = ThreadPoolExecutor(max(self.shares - 1, 1))
        for k, run in enumerate(self.runs):
            self.put(k, run)

    def put(self, k: int, run: LiveRun) -> None:
        """A run takes the place of the one with a number, or was put to another state."""
        if run is not self.runs[k] or self.meters[k] is None:
            self.runs[k] = run
            self.meters[k] = self.meter(k) if self.is_alike(run) else None
        self.fast[k] = run.is_held and self.meters[k] is not None
        # parts of steps ask Python for histories: an episode begins without those of the last one
        if self.fast[k] and run.run.packed.lengths is not None:
            run.run.__dict__.pop("packed")
            self.record.steps[k] = run.run.packed.address
            self.fast[k] = run.run.packed.lengths is None
        self.show(k)

    def is_alike(self, run: LiveRun) -> bool:
        """Whether a run has signals and outputs as the first one."""
        model, outputs = run.run.model, run.run.model.system.outputs
        return (
            len(self.known) == len(self.outputs)
            and not model.callbacks  # whose errors are looked for behind every call
            and run.feed.columns == self.inputs
            and run.feed.row.shape[1] == self.rows.shape[1]
            and all(outputs.get(name) == one for name, one in self.outputs.items())
            and run.turns.angles.keys() == self.angles.keys()
        )

    def meter(self, k: int) -> RowMeter:
        """What reads a run, which gets its signals from `rows`."""
        run = self.runs[k]
        meter = RowMeter(run.run, self.known, run.turns, self.read[k])
        run.feed.row = self.rows[k : k + 1]
        self.record.steps[k], self.record.readings[k] = run.run.packed.address, meter.address
        return meter

    def show(self, k: int) -> None:
        """Take up what a run has reached."""
        run = self.runs[k]
        self.number[k], self.since[k] = run.run.done, 0
        self.time[k], self.stopped[k] = run.time, run.ended
        self.columns[:, k] = list(run.outputs(self.observed).values())
        for name, one in run.turns.angles.items():
            self.angles[name][:, k] = one
        self.fresh.add(k)

    def sync(self, k: int) -> None:
        """Tell a run what it has done."""
        run = self.runs[k]
        if taken := int(self.number[k]) - run.run.done:
            run.run.done += taken
            blocks = list(self.given)[-int(self.since[k]) :]
            later = [many for _, many in blocks[1:]]
            for (values, _), many in zip(blocks, [taken - sum(later), *later], strict=True):
                run.feed.keep(self.by_name(values[k]), many)
            for name, one in self.angles.items():
                run.turns.angles[name] = (*one[:, k].tolist(),)
            run.plan_count()
        self.since[k] = 0

    def by_name(self, values: np.ndarray) -> dict[str, float]:
        """Values (j,) of inputs."""
        return dict(zip(self.names, values.tolist(), strict=True))

    def step(self, values: np.ndarray, moved: np.ndarray, count: int) -> dict[int, SolverError]:
        """Take so many steps of the runs that are `moved` (p,), with `values` (p, j) of their inputs,
        fewer where an event stops one; the errors of steps that cannot be taken, by run.
        """
        failed = dict[int, SolverError]()
        for k in np.flatnonzero(moved & ~self.fast).tolist():
            self.take_alone(k, values[k], count, failed)
        fast = moved & self.fast
        for k in [k for k in self.fresh if fast[k]]:
            self.runs[k].begin_held()
            self.fresh.remove(k)
        for column, name in self.inputs:
            if name in self.names:
                self.rows[fast, column] = values[fast, self.names.index(name)]
        # rates change with inputs
        many = min(count, FEW) if self.angles else count
        while count and fast.any():
            count -= many
            self.take(np.flatnonzero(fast), many, values, failed)
            for k in np.flatnonzero(fast & ~self.fast).tolist():
                if count and k not in failed:
                    self.take_alone(k, values[k], count, failed)
            fast &= self.fast
            self.evaluate(fast)
            if count and fast.any():
                many = min(count, self.reach(fast))
        return failed

    def take_alone(
        self, k: int, values: np.ndarray, count: int, failed: dict[int, SolverError]
    ) -> None:
        """The same of one run."""
        try:
            self.runs[k].step(self.by_name(values), count)
            self.show(k)
        except SolverError as error:
            failed[k] = error

    def reach(self, fast: np.ndarray) -> int:
        """Steps that may be taken before turns are counted again."""
        ends = [due(one, OFTEN * self.h) for one in self.angles.values()]
        if not ends:
            return sys.maxsize
        left = np.min(ends, axis=0) / self.h - self.number
        return max(int(left[fast].min() + 1e-6), 1)

    def take(
        self, chosen: np.ndarray, many: int, values: np.ndarray, failed: dict[int, SolverError]
    ) -> None:
        """Take so many steps of some runs in one call."""
        record = self.record
        record.many[0] = many
        record.chosen[: len(chosen)] = chosen
        record.ends[:] = len(chosen) * np.arange(self.shares + 1) // self.shares
        call = side_by_side.take_share.call
        helping = [self.helpers.submit(call, self.address, k) for k in range(1, self.shares)]
        call(self.address, 0)
        for one in helping:
            one.result()
        status = record.status[chosen]
        for k in chosen[status != stepping.DONE].tolist():
            self.go_on(k, many, values[k], failed)
        taken = chosen[status == stepping.DONE]
        self.number[taken] += many
        self.time[taken] = self.h * self.number[taken]
        self.since[taken] += 1
        self.given.append((values, many))

    def go_on(self, k: int, many: int, values: np.ndarray, failed: dict[int, SolverError]) -> None:
        """Go on with a run one of whose steps has failed."""
        run = self.runs[k]
        self.sync(k)
        # histories of parts read what was told
        run.feed.keep(self.by_name(values), 1)
        # steps in parts ask Python for histories
        self.fast[k] = False
        try:
            run.end_held(int(self.record.status[k]), many)
            self.show(k)
        except SolverError as error:
            failed[k] = error

    def evaluate(self, fast: np.ndarray) -> None:
        """Columns of the runs whose rows were read, and their turns."""
        y, rate, change = np.ascontiguousarray(self.read[fast].transpose(1, 2, 0))
        row = column = 0
        for name, output, formula in self.known:
            rows = slice(row, row := row + len(output.rows))
            values = formula(y[rows], rate[rows], change[rows])
            if name in self.angles:
                angle, doubt = count_turns(self.angles[name][:, fast], (self.time[fast], *values))
                if doubt.any():
                    warn_of_turns(name)
                self.angles[name][:, fast] = self.time[fast], angle, *values[1:]
                values = angle, *values[1:]
            for one, _ in zip(values, output.columns, strict=False):
                if column < self.shown:
                    self.columns[column, fast] = one
                column += 1

    def close(self) -> None:
        """End the threads."""
        self.helpers.shutdown()
