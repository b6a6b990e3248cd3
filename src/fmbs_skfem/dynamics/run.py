"""A run between two steps: its arrays, which are filled in place, and what is read of them."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from ..core.storage.records import dataclass
from ..systems import compiled
from ..systems.compiled import Compiled
from ..systems.forces import responses
from ..systems.layouts import Storage
from ..systems.system import System
from . import checkpoint as checkpoints
from .checkpoint import Checkpoint, Resumed, Rows, RunState
from .compiled_step import stepping
from .compiled_step.jumps import Jumps
from .compiled_step.large import Large
from .compiled_step.packing import PackedStep
from .compiled_step.step import Step
from .compiled_step.touching import HALVINGS
from .measuring import Meter, motion_of
from .observers import HistorySource, Observer
from .scheme import GeneralizedAlpha, Newton, method_of
from .tracing import Tracer
from .trajectory import COLUMNS, Happening, Statistics, Trajectory

Found = TypeVar("Found", bound=Observer)
EQUAL = 1e-9  #: of a step, within which instants are one
#: in checkpoints: when an observer has stopped the run [s], and its name in bytes
STOPPED, BY = (
    "stopped",
    "stopped by",
)


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
    observers: list[Observer] = field(default_factory=list)
    source: HistorySource | None = None  #: the one of them that gives the histories of every step
    jumps: Jumps = field(default_factory=dict)  #: of loads, within steps or at their ends
    done: int = 0  #: steps
    forgotten: bool = False  #: whether the memory of states before a checkpoint is not known
    happened: list[Happening] = field(default_factory=list)
    stopped: Happening | None = None  #: by an observer
    #: by the outputs that they read
    meters: dict[tuple[str, ...], Meter] = field(default_factory=dict)
    tracer: Tracer | None = None  #: of a run that keeps few of its states
    base: int = 0  #: number of the stored state in the first row of the arrays: those before were read, and have gone
    #: arrays of the checkpoint that it goes on from
    resumed: Mapping[str, np.ndarray] = field(default_factory=dict)
    #: of model and method, found when they are needed
    facts: dict[str, str] = field(default_factory=dict)

    @cached_property
    def close(self) -> list[Observer]:
        """Those that look at every step."""
        return [one for one in self.observers if one.looks == "step"]

    def find(self, kind: type[Found]) -> Found:
        """The observer of a kind."""
        return next(one for one in self.observers if isinstance(one, kind))

    @property
    def plain(self) -> System:
        """The system without what is given while it runs."""
        return self.source.plain if self.source else self.model.system

    @property
    def ended(self) -> bool:
        """Whether it was stopped."""
        return self.end_time is not None

    @property
    def end_time(self) -> float | None:
        """When it was stopped [s]."""
        return self.happened[-1].time if self.happened and self.happened[-1].stop else None

    @property
    def time(self) -> float:
        """Of the present state [s]."""
        return self.scheme.step * self.done if self.end_time is None else self.end_time

    def outputs(self, *names: str) -> dict[str, float]:
        """Columns of outputs in the present state; angles count their turns, and energies their
        changes, from call to call.
        """
        if names not in self.meters:
            self.meters[names] = Meter(names)
            self.meters[names].word = f"outputs {', '.join(names)}:"
            self.meters[names].take_up(self, self.resumed)
        found = self.meters[names].columns(motion_of(self, self.time))
        self.meters[names].keep()
        return found

    def stop(self, by: Observer) -> None:
        """End the run behind the step that was taken last."""
        self.put_stop(by.name or type(by).__name__, self.time)
        self.end(self.time)
        self.store()

    def put_stop(self, name: str, time: float) -> None:
        """Note that an observer of this name has stopped it [s]."""
        self.stopped = Happening(name, time, True, (), (), 0.0)
        self.happened.append(self.stopped)

    def shorten(self, halvings: int) -> None:
        """Take the next step in 2^halvings parts, or more where these fail."""
        self.step.state.parts[0] = max(self.step.state.parts[0], halvings)

    def end(self, time: float) -> None:
        """End the run within the step that was taken last; its last state is stored."""
        if self.steps:
            facts_of(self)
            row = int(np.searchsorted(self.times, time - EQUAL * self.scheme.step))
            self.kept, self.times = (
                np.append(self.kept[:row], self.done),
                np.append(self.times[:row], time),
            )
            self.rows = np.append(self.rows[: self.done], row)

    def store(self) -> None:
        """Store the present state, if it is to be."""
        self.make_room(self.done)
        if (row := self.row(self.done)) >= 0:
            stepping.keep(self.step, row)

    def make_room(self, number: int) -> None:
        """Let states be read and go, where the one after so many steps finds no row."""
        if self.tracer is not None and self.row(number) >= self.capacity:
            self.tracer.take(given(self), block(self, self.base + self.capacity), self.base)
            self.base += self.capacity

    @property
    def capacity(self) -> int:
        """Number of states for which there are rows."""
        return len(self.step.job.work)

    def last_stored(self, number: int) -> int:
        """The last step, up to this one, whose states up to it find rows."""
        beyond = self.base + self.capacity
        return min(number, int(self.kept[beyond]) - 1) if beyond < len(self.kept) else number

    def next_jump(self, number: int) -> int:
        """The first step from the present one on in which loads jump, at most this one."""
        return next((jump for jump in self.jumps if self.done <= jump < number), number)

    @property
    def steps(self) -> int:
        return len(self.rows) - 1

    def row(self, number: int) -> int:
        """The row for the state after so many steps, -1 for none."""
        row = int(self.rows[number]) if number < len(self.rows) else -1
        return row - self.base if row >= 0 else row

    def rows_from(self, number: int) -> np.ndarray:
        """The same of all steps from one on."""
        rows = self.rows[number:]
        return np.where(rows >= 0, rows - self.base, rows) if self.base else rows

    @cached_property
    def kept_values(self) -> list[int]:
        """Places of kept values in the memory of forces."""
        return [int(k) for k in responses.kept(self.model)]

    @cached_property
    def packed(self) -> PackedStep:
        """The step as compiled code takes it; its arrays stay those of `step`."""
        return PackedStep(self.model, self.step, self.large)

    def take(self, signals: np.ndarray, rows: np.ndarray) -> tuple[int, int]:
        """Take a step for every row of `signals`, to be stored in `rows` of the trajectory: the
        status and the steps done.
        """
        status = self.packed.advance(signals, rows[: len(signals)], self.scheme.step * self.done)
        self.packed.check()
        return status, int(self.step.job.done[0])


def facts_of(run: OpenRun) -> dict[str, str]:
    """What model and method are; of what is given while it runs, its start."""
    model = replace(run.model, system=run.plain)
    run.facts = run.facts or checkpoints.facts(model, run.step.method, run.steps, run.kept)
    return run.facts


def take_up(run: OpenRun, resume: Resumed) -> None:
    """Put a run where it was left."""
    held = resume.checkpoint
    restore(run, held)
    run.cpu, run.wall = run.cpu - held.cpu_s, run.wall - held.wall_s
    if run.tracer is not None:
        run.tracer.go_on(motion_of_rows(run, resume.rows))
        run.base = held.kept
        return
    for k, part in enumerate((resume.rows.x, resume.rows.v, resume.rows.a)):
        run.step.job.out[k, : held.kept] = part[: held.kept]
    run.step.job.multipliers[: held.kept] = resume.rows.multipliers[: held.kept]
    run.forgotten = resume.rows.memory.shape[1] < len(run.model.memory)
    if not run.forgotten:
        run.step.job.memory[: held.kept] = resume.rows.memory[: held.kept]
    run.step.job.work[: held.kept] = resume.rows.work[: held.kept]


def restore(run: OpenRun, held: Checkpoint) -> None:
    """Put a run into the state of a checkpoint."""
    checkpoints.restore(held, facts_of(run), run.step, run.large)
    run.done, run.resumed = held.done, held.arrays
    run.meters.clear()
    for one in run.observers:
        begin = prefix(one)
        one.put(
            run,
            {
                name.removeprefix(begin): array
                for name, array in held.arrays.items()
                if name.startswith(begin)
            },
        )
    if STOPPED in held.arrays:
        run.put_stop(held.arrays[BY].tobytes().decode(), float(held.arrays[STOPPED][0]))
    if run.end_time is not None:
        run.end(run.end_time)


def prefix(one: Observer) -> str:
    """How the names of what an observer keeps in checkpoints begin."""
    return f"observer {one.name}: " if one.name else ""


def count_stored(run: OpenRun) -> int:
    """Number of states stored so far."""
    return int(np.searchsorted(run.kept, run.done, side="right"))


def states(run: OpenRun, first: int, last: int) -> Rows:
    """Stored states from `first` up to `last` in the order of the system; of a run that keeps few,
    what was read of them.
    """
    if run.tracer is not None:
        found = traced(run, run.tracer).part(slice(first, last))
        columns = {
            name: getattr(found, name) for name in (*COLUMNS, "memory", "work", "trace", "kept")
        }
        return Rows(**columns)
    return rows_of(run, first, last)


def rows_of(run: OpenRun, first: int, last: int) -> Rows:
    """Stored states from `first` up to `last` that have rows."""
    begin, end = first - run.base, last - run.base
    x, v, a = run.step.job.out[:, begin:end]
    memory = run.step.job.memory[begin:end, : 0 if run.forgotten else None]
    return Rows(
        run.times[first:last],
        x,
        v,
        a,
        run.step.job.multipliers[begin:end],
        memory,
        run.step.job.work[begin:end],
    )


def given(run: OpenRun) -> Compiled:
    """The model with what was given so far as histories."""
    system = run.source.recorded() if run.source else run.model.system
    return run.model if system is run.model.system else replace(run.model, system=system)


def motion_of_rows(run: OpenRun, rows: Rows) -> Trajectory:
    """Stored states as a motion, of which some may be gone."""
    motion = rows.times, rows.x, rows.v, rows.a, rows.multipliers
    found = Trajectory(
        given(run).system, *motion, memory=rows.memory, events=tuple(run.happened), work=rows.work
    )
    return replace(found, trace=rows.trace, kept=rows.kept)


def block(run: OpenRun, last: int) -> Trajectory:
    """States that have rows, up to the one of a number."""
    return motion_of_rows(run, rows_of(run, run.base, last))


def traced(run: OpenRun, tracer: Tracer) -> Trajectory:
    """The motion so far of a run that keeps few of its states."""
    return tracer.motion(given(run), block(run, count_stored(run)), run.base)


def trajectory(run: OpenRun) -> Trajectory:
    """The motion so far."""
    found = block(run, count_stored(run)) if run.tracer is None else traced(run, run.tracer)
    work = found.work if np.isfinite(np.asarray(found.work)).all() else None
    return replace(found, statistics=cost_of(run), work=work, heat=float(run.step.state.work[1]))


def cost_of(run: OpenRun) -> Statistics:
    """What the run cost so far."""
    taken, iterations, factorisations, halved = (int(k) for k in run.step.job.counters)
    seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
    return Statistics(taken, iterations, factorisations, halved, *seconds, solver_of(run))


def moment(run: OpenRun) -> RunState:
    """What `record` sees."""

    def checkpoint() -> Checkpoint:
        facts = facts_of(run)
        arrays = checkpoints.arrays(run.step, run.large)
        for one in run.observers:
            arrays |= {prefix(one) + name: array for name, array in one.arrays(run).items()}
        for meter in run.meters.values():
            arrays |= meter.kept()
        if by := run.stopped:
            arrays |= {STOPPED: np.array([by.time]), BY: np.frombuffer(by.name.encode(), np.uint8)}
        seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
        return Checkpoint(run.done, count_stored(run), facts, arrays, *seconds)

    numbers = (
        3 * run.model.system.size + run.model.constraints
        if run.tracer is None
        else run.tracer.width(run.model.system)
    )
    size = 8 * numbers
    calls = partial(states, run), checkpoint
    cost = cost_of(run)
    return RunState(
        run.done,
        run.steps,
        run.scheme.step * run.done,
        count_stored(run),
        size,
        *calls,
        cost.halved,
        cost.factorisations,
    )


def solver_of(run: OpenRun) -> str:
    """Name of the solver of the linear systems, for reports."""
    if run.large is not None:
        return run.large.label
    layout = run.model.layout
    if layout.storage is Storage.BLOCKS:
        return f"LDL^T of blocks, {layout.numbers} numbers"
    return (
        "dense Cholesky or LU"
        if layout.dense
        else f"band Cholesky or LU, half width {layout.width}"
    )


def last_residual(run: OpenRun, time: float) -> np.ndarray:
    """Forces [N] and gaps (n + m,) that are left at the last trial state of the shortest step that
    was tried.
    """
    s = run.step.space
    order = np.argsort(run.model.order)
    c = method_of(run.scheme, run.newton, run.scheme.step / 2**HALVINGS, run.model).c
    state = (part[order] for part in (s.x, s.v, s.acceleration))
    x, v, a = state
    return np.concatenate(compiled.evaluate(run.model, x, v, time, s.memory, s.multipliers / c, a))
