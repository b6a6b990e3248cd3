"""A run between two steps: its arrays, which are filled in place, and what is read of them."""

from __future__ import annotations

import time as clock
from dataclasses import field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import SolverError
from ..core.records import dataclass
from ..core.structs import Routine
from ..systems import compiled, responses
from ..systems.compiled import Compiled
from ..systems.layouts import Storage
from . import checkpoint as checkpoints
from . import stepping
from .checkpoint import Checkpoint, Resumed, Rows, RunState
from .dividing import HALVINGS
from .large import Large
from .measuring import Reader
from .scheme import GeneralizedAlpha, Newton, method_of
from .step import Method, Step
from .trajectory import Statistics, Trajectory

if TYPE_CHECKING:
    from .events import Watch
    from .feed import Feed

BEHIND = ("factorise", "solve", "settle")  #: doors of `stepping` behind which large models keep their factors
EQUAL = 1e-9  #: of a step, within which instants are one


@dataclass
class OpenRun:
    """A run between two steps; its arrays are filled in place."""

    model: Compiled
    scheme: GeneralizedAlpha
    newton: Newton
    kept: np.ndarray  #: (s,) numbers of the steps whose states are stored
    times: np.ndarray  #: (s,) of these [s]
    rows: np.ndarray  #: (steps + 1,) row of every step in the trajectory, -1 for none
    step: Step  #: of the full size; states in the order of the model
    large: Large | None  #: factors of a large model
    cpu: float  #: process time at the start, less what the run took before it was resumed [s]
    wall: float
    feed: Feed | None = None  #: of what has inputs
    done: int = 0  #: steps
    forgotten: bool = False  #: whether the memory of states before a checkpoint is not known
    watch: Watch | None = None  #: of what has events
    facts: dict[str, str] = field(default_factory=dict)  #: of model and method, found when they are needed

    @property
    def ended(self) -> bool:
        """Whether an event has stopped it."""
        return self.watch is not None and self.watch.ended is not None

    def end(self, time: float) -> None:
        """End the run within the step that was taken last; its last state is stored."""
        if self.steps:
            facts_of(self)
            row = int(np.searchsorted(self.times, time - EQUAL * self.scheme.step))
            self.kept, self.times = np.append(self.kept[:row], self.done), np.append(self.times[:row], time)
            self.rows = np.append(self.rows[: self.done], row)

    def store(self) -> None:
        """Store the present state, if it is to be."""
        if (row := self.row(self.done)) >= 0:
            stepping.store(self.step.state, self.step.method.c, row, self.step.job)

    @property
    def steps(self) -> int:
        return len(self.rows) - 1

    def row(self, number: int) -> int:
        """Where the state after so many steps is stored, -1 for nowhere."""
        return int(self.rows[number]) if number < len(self.rows) else -1

    @cached_property
    def kept_values(self) -> list[int]:
        """Places of kept values in the memory of forces."""
        return [int(k) for k in responses.kept(self.model)]

    @cached_property
    def reader(self) -> Reader:
        """What reads values for controllers and events."""
        return Reader(self)

    def take(self, method: Method, signals: np.ndarray, rows: np.ndarray) -> tuple[int, int]:
        """Take a step for every row of `signals`, to be stored in `rows` of the trajectory: the status and the steps done."""
        status = self.call(stepping.advance, method, signals, np.ascontiguousarray(rows[: len(signals)]))
        return status, int(self.step.job.done[0])

    def call(self, routine: Routine, method: Method, signals: np.ndarray, rows: np.ndarray) -> int:
        """What a routine of `stepping` returns for rows of `signals`."""
        now = self.step._replace(method=method, job=self.step.job._replace(signals=signals, rows=rows))
        doors = self.large.doors(lambda: now) if self.large else ()
        behind = {name: door.address for name, door in zip(BEHIND, doors, strict=False)}
        found = routine(now._replace(doors=now.doors._replace(**behind)))
        self.model.check()
        for name, door in zip(BEHIND, doors, strict=False):
            try:
                door.check()
            except SolverError:
                if name != "factorise":  # whose status says that there are no factors
                    raise
        return found


def facts_of(run: OpenRun) -> dict[str, str]:
    """What model and method are; of inputs, their starts."""
    model = replace(run.model, system=run.feed.plain) if run.feed else run.model
    run.facts = run.facts or checkpoints.facts(model, run.step.method, run.steps, run.kept)
    return run.facts


def take_up(run: OpenRun, resume: Resumed) -> None:
    """Put a run where it was left."""
    held, model = resume.checkpoint, run.model
    restore(run, held)
    for k, part in enumerate((resume.rows.x, resume.rows.v, resume.rows.a)):
        run.step.job.out[k, : held.kept] = part[: held.kept, model.order]
    run.step.job.multipliers[: held.kept] = resume.rows.multipliers[: held.kept]
    run.forgotten = resume.rows.memory.shape[1] < len(model.memory)
    if not run.forgotten:
        run.step.job.memory[: held.kept] = resume.rows.memory[: held.kept]
    run.step.job.work[: held.kept] = resume.rows.work[: held.kept]
    run.cpu, run.wall = run.cpu - held.cpu_s, run.wall - held.wall_s


def restore(run: OpenRun, held: Checkpoint) -> None:
    """Put a run into the state of a checkpoint."""
    checkpoints.restore(held, facts_of(run), run.step, run.large)
    if run.feed:
        run.feed.put(held)
        run.reader.put(run, held)
    if run.watch:
        run.watch.put(run, held)
    run.done = held.done
    if run.watch and run.watch.ended is not None:
        run.end(run.watch.ended)


def count_stored(run: OpenRun) -> int:
    """Number of states stored so far."""
    return int(np.searchsorted(run.kept, run.done, side="right"))


def states(run: OpenRun, first: int, last: int) -> Rows:
    """Stored states from `first` up to `last` in the order of the system's unknowns."""
    inverse = np.argsort(run.model.order)
    out, multipliers = run.step.job.out, run.step.job.multipliers
    x, v, a = (part[first:last] if run.large else part[first:last, inverse] for part in out)
    memory = run.step.job.memory[first:last, : 0 if run.forgotten else None]
    return Rows(run.times[first:last], x, v, a, multipliers[first:last], memory, run.step.job.work[first:last])


def trajectory(run: OpenRun) -> Trajectory:
    """The motion so far."""
    found = states(run, 0, count_stored(run))
    system = run.feed.recorded() if run.feed else run.model.system
    events = tuple(run.watch.happened) if run.watch else ()
    motion = found.times, found.x, found.v, found.a, found.multipliers
    return Trajectory(system, *motion, cost_of(run), found.memory, events, found.work if np.isfinite(found.work).all() else None)


def cost_of(run: OpenRun) -> Statistics:
    """What the run cost so far."""
    taken, iterations, factorisations, halved = (int(k) for k in run.step.job.counters)
    seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
    return Statistics(taken, iterations, factorisations, halved, *seconds, solver_of(run))


def moment(run: OpenRun) -> RunState:
    """What `record` sees."""

    def checkpoint() -> Checkpoint:
        facts, arrays = facts_of(run), checkpoints.arrays(run.step, run.large)
        arrays |= (run.feed.arrays() | run.reader.arrays() if run.feed else {}) | (run.watch.arrays(run) if run.watch else {})
        seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
        return Checkpoint(run.done, count_stored(run), facts, arrays, *seconds)

    size = 8 * (3 * run.model.system.size + run.model.constraints)
    return RunState(run.done, run.steps, run.scheme.step * run.done, count_stored(run), size, partial(states, run), checkpoint)


def solver_of(run: OpenRun) -> str:
    """Name of the solver of the linear systems, for reports."""
    if run.large is not None:
        return run.large.label
    layout = run.model.layout
    if layout.storage is Storage.BLOCKS:
        return f"LDL^T of blocks, {layout.numbers} numbers"
    return "dense Cholesky or LU" if layout.dense else f"band Cholesky or LU, half width {layout.width}"


def last_residual(run: OpenRun, time: float) -> np.ndarray:
    """Forces [N] and gaps (n + m,) that are left at the last trial state of the shortest step that was tried."""
    s, order = run.step.space, np.argsort(run.model.order)
    c = method_of(run.scheme, run.newton, run.scheme.step / 2**HALVINGS, run.model).c
    state = (part[order] for part in (s.x, s.v, s.acceleration))
    x, v, a = state
    return np.concatenate(compiled.evaluate(run.model, x, v, time, s.memory, s.multipliers / c, a))
