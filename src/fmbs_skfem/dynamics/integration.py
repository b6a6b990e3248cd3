"""Time integration of a System: compiled steps in chunks, halving on failure, partial results on errors."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from ..core import krylov
from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import notify, remark
from ..core.structs import Routine
from ..systems import compiled, forces, responses
from ..systems.compiled import Compiled, compile_system
from ..systems.controllers import Controlled
from ..systems.events import with_locks
from ..systems.layouts import Storage
from ..systems.system import System
from . import checkpoint as checkpoints
from . import departures, stepping
from .checkpoint import Checkpoint, Moment, Record, Resumed, Rows
from .dividing import HALVINGS, divided
from .events import Watch, open_at_start
from .feed import Feed
from .histories import leading_signals, leading_values
from .initial import Instant, Start, consistent_start, first_step, startable
from .large import Large
from .measuring import Reader
from .names import row_names, told, worst
from .outputs import survey_of
from .scheme import GeneralizedAlpha, Newton, method_of, steps_in
from .step import Method, Step
from .trajectory import Statistics, Trajectory

REASONS = {
    stepping.NOT_CONVERGED: Reason.NOT_CONVERGED,
    stepping.DIVERGED: Reason.DIVERGED,
    stepping.NOT_FINITE: Reason.NOT_FINITE,
    stepping.SINGULAR: Reason.SINGULAR_TANGENT,
}
BEHIND = ("factorise", "solve", "settle")  #: doors of `stepping` behind which large models keep their factors
EQUAL = 1e-9  #: of a step, within which instants are one
WHOLE = stepping.REMEASURE  #: steps are taken in multiples of this number, so that a stop between them changes nothing
PACE = 0.2  #: time between two looks at a run that is watched [s]


@dataclass
class Run:
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


def integrate(
    system: System,
    scheme: GeneralizedAlpha,
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    progress: Callable[[float], None] | None = None,
    record: Record | None = None,
    resume: Resumed | None = None,
) -> Trajectory:
    """Integrate from t = 0 over `duration` [s]; states are stored every `every` steps and at the end, or after the steps listed.

    The trajectory holds times (s,), x, v and a (s, n) in the unknowns of the system, and multipliers (s, m). The number of steps is
    duration / step, rounded with a notice. Initial velocities are projected onto the constraints with a notice. A step that fails
    is halved; SolverError carries reason, time, worst residuals by name and the partial trajectory.

    `record` sees the run a few times a second and may keep its states and a checkpoint; `resume` goes on from those, and ends in
    the same numbers as a run that was never stopped. A warning is shown when strains of parts leave those of their training.
    """
    steps = steps_in(scheme, duration)
    fitting(system, steps, len(every) if isinstance(every, np.ndarray) else steps // max(every, 1) + 1)
    run = begun(startable(system, scheme), scheme, newton or Newton(), kept_steps(every, steps), steps, resume)
    before = forces.cost_of(run.model.forces)
    looks = [one for one in (record, departures.watch(run.model.system)) if one is not None]
    watched = progress is not None or len(looks) > 0
    chunk = WHOLE if watched else steps
    while run.done < run.steps:
        begin = clock.perf_counter()
        past = run.done % WHOLE
        march(run, min(WHOLE - past if past else chunk, run.steps - run.done))
        if watched:
            chunk = choose_chunk(chunk, clock.perf_counter() - begin)
        if progress:
            progress(run.done / run.steps)
        for look in looks:
            look(moment(run))
    motion = trajectory(run)
    warn_of_division(motion.statistics)
    tell_cost(before, forces.cost_of(run.model.forces), motion.statistics)
    for text in (*responses.beyond(run.model, run.step.state.memory), unstable_loop(run)):
        if text:
            notify(text)
    return motion


def tell_cost(before: forces.Cost, after: forces.Cost, cost: Statistics) -> None:
    """A remark of what forces that are functions of Python cost in a run."""
    if calls := after.calls - before.calls:
        seconds = after.seconds - before.seconds
        told = f"functions of Python were called {calls} times for forces, {seconds:.3g} s beside {cost.cpu_s:.3g} s of the run"
        remark(f"{told}; in symbols they are compiled (docs/extensions.md)")


def warn_of_division(cost: Statistics) -> None:
    """A notice where the iteration failed so often that the motion is hardly resolved."""
    if cost.unresolved:
        failed = f"Newton's iteration failed {cost.halved} times in {cost.steps} steps, which were divided"
        notify(f"{failed}: the motion is hardly resolved and may have left its path; take a smaller step")


def fitting(system: System, steps: int, stored: int) -> None:
    """Refuse a run whose stored states exceed the memory of the machine, before any of them is there."""
    needed = 8.0 * (steps + stored * (3 * system.size + len(system.constraints.names)))
    if needed > (there := krylov.memory()):
        got = f"{stored} of {needed / 1e9:.3g} GB"
        raise InputError(
            say("analysis.every", f"stored states that fit into the {there / 1e9:.3g} GB of this machine", got, "store fewer")
        )


def begun(
    system: System,
    scheme: GeneralizedAlpha,
    newton: Newton,
    kept: np.ndarray,
    steps: int,
    resume: Resumed | None = None,
    live: bool = False,
) -> Run:
    """A run at its start, or where it was left; a live one takes its inputs from outside."""
    facing = live or system.triggers or any(isinstance(one, Controlled) for one in system.signals)
    feed = Feed(system := with_locks(system), scheme) if facing else None
    model = compile_system(system)
    if feed:
        system, model = feed.system, replace(model, system=feed.system)
    n, m = system.size, model.constraints
    none = np.zeros(n)
    first = Instant(0.0, system.x0, system.v0, open_at_start(model))
    start = (
        consistent_start(model, scheme, first)
        if resume is None
        else Start(system.x0, system.v0, none, np.zeros(m), np.zeros((2, n)))
    )
    rows = np.full(steps + 1, -1)
    rows[kept] = np.arange(len(kept))
    step = first_step(model, start, method_of(scheme, newton, scheme.step, model), len(kept))
    step.space.off[:] = first.off
    step.job.out[:, 0] = step.state.x, start.v[model.order], start.a[model.order]
    step.job.multipliers[0], step.job.memory[0] = start.multipliers, step.state.memory
    clocks = clock.process_time(), clock.perf_counter()
    run = Run(
        model,
        scheme,
        newton,
        kept,
        scheme.step * kept,
        rows,
        step,
        Large(model, newton.solver) if model.pattern else None,
        *clocks,
        feed,
    )
    if system.triggers and feed:
        run.watch = Watch(run, feed)
    if resume is not None:
        take_up(run, resume)
    return run


def facts_of(run: Run) -> dict[str, str]:
    """What model and method are; of inputs, their starts."""
    model = replace(run.model, system=run.feed.plain) if run.feed else run.model
    run.facts = run.facts or checkpoints.facts(model, run.step.method, run.steps, run.kept)
    return run.facts


def take_up(run: Run, resume: Resumed) -> None:
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


def restore(run: Run, held: Checkpoint) -> None:
    """Put a run into the state of a checkpoint."""
    checkpoints.restore(held, facts_of(run), run.step, run.large)
    if run.feed:
        run.feed.put(held)
        run.reader.put(run, held)
    if run.watch:
        run.watch.put(run, held)
    run.done = held.done


def choose_chunk(chunk: int, seconds: float) -> int:
    """Steps to take at once, in units of WHOLE, so that they take about PACE seconds; results do not depend on it."""
    if seconds < 0.5 * PACE:
        return 2 * chunk
    return max(WHOLE, chunk // 2 // WHOLE * WHOLE) if seconds > 2.0 * PACE else chunk


def march(run: Run, many: int) -> None:
    """Take some steps, the last one possibly halved; SolverError where it cannot be taken."""
    if run.feed is not None:
        for _ in range(many):
            if not run.ended:
                march_fed(run, run.feed, {})
        return
    status = whole_steps(run, many) if run.step.state.parts[0] == 0 else stepping.TOO_LONG
    if status != stepping.DONE:
        divide(run, status)


def whole_steps(run: Run, many: int) -> int:
    """Take some steps as long as they need not be halved; the status."""
    scheme = run.scheme
    signals, broken = leading_signals(run.model.system, scheme.step * (run.done + 1 + np.arange(many)), scheme.step)
    status, taken = run.take(run.step.method, signals, run.rows[run.done + 1 :])
    run.done += taken
    if status == stepping.DONE and broken is not None:
        broken.partial = trajectory(run)
        raise broken
    return status


def march_fed(run: Run, feed: Feed, values: Mapping[str, float]) -> None:
    """Take one step with new values of inputs."""
    feed.tell(values)
    try:
        feed.sample(run)
        before = [part.copy() for part in run.step.state] if run.watch else None
        status = feed.take(run) if run.step.state.parts[0] == 0 else stepping.TOO_LONG
    except SolverError as error:
        error.partial = trajectory(run)
        raise
    if status == stepping.DONE:
        run.done += 1
    else:
        run.model.check()
        try:
            divide(run, status)
        except FailedStep as error:
            if text := unstable_loop(run):
                raise SolverError(text, Reason.GROWING, error.time, error.worst, error.partial) from error
            raise
    if run.watch and before is not None:
        attend(run, run.watch, before)


def attend(run: Run, watch: Watch, before: Sequence[np.ndarray]) -> None:
    """Let events happen in the step that was taken from an earlier state; SolverError where it cannot be taken in parts."""
    try:
        status = watch.look(run, before)
    except SolverError as error:
        error.partial = error.partial or trajectory(run)
        raise
    if status != stepping.DONE:
        raise failure(run, status, run.scheme.step * (run.done + 1))


def unstable_loop(run: Run) -> str:
    """What is said of a controller whose input grows with the energy of the motion; nothing where none does."""
    told = run.feed.growing() if run.feed else ""
    if not told:
        return ""
    motion = trajectory(run)
    energy = survey_of(motion)[0][:, :2].sum(axis=1)
    rise = f"{told}, and the energy of the motion to {energy.max():.3g} J up to t = {motion.times[-1]:.6g} s"
    return f"{Reason.GROWING.value}: {rise}; lower its gains, take a shorter sample time, or limit it"


def divide(run: Run, status: int) -> None:
    """Take the next step in parts, with a status that says why; SolverError where it cannot be taken."""
    h, state = run.scheme.step, run.step.state
    halved, reached = divided(run, status, h * run.done, h, run.row(run.done + 1), max(1, int(state.parts[0])))
    if halved != stepping.DONE:
        raise failure(run, halved, reached)
    run.done += 1


def count_stored(run: Run) -> int:
    """Number of states stored so far."""
    return int(np.searchsorted(run.kept, run.done, side="right"))


def states(run: Run, first: int, last: int) -> Rows:
    """Stored states from `first` up to `last` in the order of the system's unknowns."""
    inverse = np.argsort(run.model.order)
    out, multipliers = run.step.job.out, run.step.job.multipliers
    x, v, a = (part[first:last] if run.large else part[first:last, inverse] for part in out)
    memory = run.step.job.memory[first:last, : 0 if run.forgotten else None]
    return Rows(run.times[first:last], x, v, a, multipliers[first:last], memory, run.step.job.work[first:last])


def trajectory(run: Run) -> Trajectory:
    """The motion so far."""
    found = states(run, 0, count_stored(run))
    system = run.feed.recorded() if run.feed else run.model.system
    events = tuple(run.watch.happened) if run.watch else ()
    motion = found.times, found.x, found.v, found.a, found.multipliers
    return Trajectory(system, *motion, cost_of(run), found.memory, events, found.work if np.isfinite(found.work).all() else None)


def cost_of(run: Run) -> Statistics:
    """What the run cost so far."""
    taken, iterations, factorisations, halved = (int(k) for k in run.step.job.counters)
    seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
    return Statistics(taken, iterations, factorisations, halved, *seconds, solver_of(run))


def moment(run: Run) -> Moment:
    """What `record` sees."""

    def checkpoint() -> Checkpoint:
        facts, arrays = facts_of(run), checkpoints.arrays(run.step, run.large)
        arrays |= (run.feed.arrays() | run.reader.arrays() if run.feed else {}) | (run.watch.arrays(run) if run.watch else {})
        seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
        return Checkpoint(run.done, count_stored(run), facts, arrays, *seconds)

    size = 8 * (3 * run.model.system.size + run.model.constraints)
    return Moment(run.done, run.steps, run.scheme.step * run.done, count_stored(run), size, partial(states, run), checkpoint)


def kept_steps(every: int | np.ndarray, steps: int) -> np.ndarray:
    """Numbers of the steps after which states are kept, 0 first: those listed, or every so many and the last one."""
    if isinstance(every, np.ndarray):
        kept = np.union1d(0, every.astype(np.int64))
        if kept[0] < 0 or kept[-1] > steps:
            raise InputError(say("steps to keep", f"numbers from 0 to {steps}", f"{kept[0]} to {kept[-1]}"))
        return kept
    if every < 1:
        raise InputError(say("analysis.every", "at least 1", every))
    return np.union1d(np.arange(0, steps + 1, every), steps)


def solver_of(run: Run) -> str:
    """Name of the solver of the linear systems, for reports."""
    if run.large is not None:
        return run.large.label
    layout = run.model.layout
    if layout.storage is Storage.BLOCKS:
        return f"LDL^T of blocks, {layout.numbers} numbers"
    return "dense LU" if layout.dense else f"band Cholesky or LU, half width {layout.width}"


class FailedStep(SolverError):
    """A step that could not be taken; `run` stands before it, its work space holds the last trial (see `diagnosis.explain`)."""

    def __init__(self, error: SolverError, run: Run) -> None:
        super().__init__(str(error), error.reason, error.time, error.worst, error.partial)
        self.run = run


def failure(run: Run, status: int, time: float) -> SolverError:
    """The error of a step that failed, with the worst residuals by name: forces [N] and gaps."""
    model, partial = run.model, trajectory(run)
    _, broken = leading_values(model.system, np.array([time]))
    if broken is not None:
        broken.partial = partial
        return broken
    reason, n = REASONS[status], model.system.size
    names = row_names(model.system)
    largest = worst(names, last_residual(run, time))
    text = f"{reason.value} at t = {time:.6g} s, also with the step divided by {2**HALVINGS}; largest residuals: {told(largest)}"
    error = SolverError(f"{text}; try a smaller step, or look at loads and joints there (n = {n})", reason, time, largest, partial)
    return FailedStep(error, run)


def last_residual(run: Run, time: float) -> np.ndarray:
    """Forces [N] and gaps (n + m,) that are left at the last trial state of the shortest step that was tried."""
    s, order = run.step.space, np.argsort(run.model.order)
    c = method_of(run.scheme, run.newton, run.scheme.step / 2**HALVINGS, run.model).c
    state = (part[order] for part in (s.x, s.v, s.acceleration))
    x, v, a = state
    return np.concatenate(compiled.evaluate(run.model, x, v, time, s.memory, s.multipliers / c, a))
