"""Time integration of a System: compiled steps in chunks, halving on failure, partial results on errors."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..core import machine_memory
from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import Notice, Progress, notify, remark
from ..systems import forces, responses
from ..systems.compiled import accepted, compile_system
from ..systems.controllers import Controlled
from ..systems.events import with_locks
from ..systems.system import System
from . import departures, finer_parts, rest, sampled_loops, stepping
from .checkpoint import Record, Resumed
from .dividing import HALVINGS, divided
from .events import Watch, open_at_start
from .fast_wheels import warn_of_fast_wheels
from .feed import Feed
from .histories import (
    leading_signals,
    leading_values,
    warn_of_coarse_steps,
    warn_of_drives_that_jump,
    warn_of_jumps,
    warn_of_tilts,
)
from .initial import Instant, Start, consistent_start, first_step, startable
from .large import Large
from .names import as_text, row_names, worst
from .outputs import survey_of
from .run import OpenRun, last_residual, moment, take_up, trajectory
from .scheme import GeneralizedAlpha, Newton, method_of, steps_in
from .trajectory import Statistics, Trajectory

REASONS = {
    stepping.NOT_CONVERGED: Reason.NOT_CONVERGED,
    stepping.DIVERGED: Reason.DIVERGED,
    stepping.NOT_FINITE: Reason.NOT_FINITE,
    stepping.SINGULAR: Reason.SINGULAR_TANGENT,
}
WHOLE = stepping.REMEASURE  #: steps are taken in multiples of this number, so that a stop between them changes nothing
PACE = 0.2  #: time between two looks at a run that is watched [s]


def integrate(
    system: System,
    scheme: GeneralizedAlpha,
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    progress: Progress | None = None,
    record: Record | None = None,
    resume: Resumed | None = None,
) -> Trajectory:
    """Integrate from t = 0 over `duration` [s]; states are stored every `every` steps and at the end, or after the steps listed.

    It starts in the reference, or in the equilibrium of the loads: `GeneralizedAlpha(step, start="equilibrium")`.

    The trajectory holds times (s,), x, v and a (s, n) in the unknowns of the system, and multipliers (s, m). The number of steps is
    duration / step, rounded with a notice. Initial velocities are projected onto the constraints with a notice. A step that fails
    is halved; SolverError carries reason, time, worst residuals by name and the partial trajectory.

    `record` sees the run a few times a second and may keep its states and a checkpoint; `resume` goes on from those, and ends in
    the same numbers as a run that was never stopped. Parts are held against finer ones in
    a second run, see `finer_parts`: a warning is shown where outputs differ.
    """
    steps = steps_in(scheme, duration)
    fitting(system, steps, len(every) if isinstance(every, np.ndarray) else steps // max(every, 1) + 1)
    run = begun(startable(system, scheme), scheme, newton or Newton(), kept_steps(every, steps), steps, resume, progress=progress)
    before = forces.cost_of(run.model.forces)
    looks = [one for one in (record, departures.watch(run.model.system, departures.unknown_parts(system))) if one is not None]
    try:
        follow(run, looks, progress)
        motion = trajectory(run)
        again = lambda other, shown: integrate(other, scheme, duration, newton, every, shown)  # noqa: E731
        motion = finer_parts.hold_against(motion, system, again, watched=True, progress=progress)
        warn_of_division(motion.statistics)
        plain = run.feed.plain if run.feed else motion.system
        warn_of_coarse_steps(motion, plain, scheme.step, steps)
        warn_of_drives_that_jump(plain, scheme.step, steps)
        if not warn_of_jumps(run.model, motion, scheme.step):
            warn_of_tilts(motion)
        warn_of_fast_wheels(run.model, motion, scheme.step)
        tell_cost(before, forces.cost_of(run.model.forces), motion.statistics)
        for text in (*responses.beyond(run.model, run.step.state.memory), unstable_loop(run)):
            if text:
                notify(text)
    except Notice as notice:
        notice.partial = notice.partial or trajectory(run)
        raise
    return motion


def follow(run: OpenRun, looks: Sequence[Record], progress: Progress | None = None) -> None:
    """Take all steps of a run, which is looked at between some of them."""
    watched = progress is not None or len(looks) > 0
    chunk = WHOLE if watched else run.steps
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
    if needed > (there := machine_memory.built_in()):
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
    progress: Progress | None = None,
) -> OpenRun:
    """A run at its start, or where it was left; a live one takes its inputs from outside. Progress is 0 on the way to a start."""
    at_rest = scheme.start == "equilibrium" and resume is None
    x, v, memory = rest.in_equilibrium(system, newton, progress) if at_rest else (system.x0, system.v0, None)
    facing = live or system.triggers or any(isinstance(one, Controlled) for one in system.signals)
    feed = Feed(system := with_locks(system), scheme) if facing else None
    model = compile_system(system)
    if feed:
        system, model = feed.system, replace(model, system=feed.system)
    n, m = system.size, model.constraints
    none = np.zeros(n)
    first = Instant(0.0, x, v, open_at_start(model, x), memory, first=True)
    start = (
        consistent_start(model, scheme, first)
        if resume is None
        else Start(system.x0, system.v0, none, np.zeros(m), np.zeros((2, n)))
    )
    rows = np.full(steps + 1, -1)
    rows[kept] = np.arange(len(kept))
    kept_by_forces = None if memory is None else accepted(model, x, start.v, memory)
    step = first_step(model, start, method_of(scheme, newton, scheme.step, model), len(kept), kept_by_forces)
    step.space.off[:] = first.off
    step.job.out[:, 0] = step.state.x, start.v[model.order], start.a[model.order]
    step.job.multipliers[0], step.job.memory[0] = start.multipliers, step.state.memory
    clocks = clock.process_time(), clock.perf_counter()
    run = OpenRun(
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


def choose_chunk(chunk: int, seconds: float) -> int:
    """Steps to take at once, in units of WHOLE, so that they take about PACE seconds; results do not depend on it."""
    if seconds < 0.5 * PACE:
        return 2 * chunk
    return max(WHOLE, chunk // 2 // WHOLE * WHOLE) if seconds > 2.0 * PACE else chunk


def march(run: OpenRun, many: int) -> None:
    """Take some steps, the last one possibly halved; SolverError where it cannot be taken."""
    if run.feed is not None:
        for _ in range(many):
            if not run.ended:
                march_fed(run, run.feed, {})
        return
    status = whole_steps(run, many) if run.step.state.parts[0] == 0 else stepping.TOO_LONG
    if status != stepping.DONE:
        divide(run, status)


def whole_steps(run: OpenRun, many: int) -> int:
    """Take some steps as long as they need not be halved; the status."""
    scheme = run.scheme
    signals, broken = leading_signals(run.model.system, scheme.step * (run.done + 1 + np.arange(many)), scheme.step)
    status, taken = run.take(run.step.method, signals, run.rows[run.done + 1 :])
    run.done += taken
    if status == stepping.DONE and broken is not None:
        broken.partial = trajectory(run)
        raise broken
    return status


def march_fed(run: OpenRun, feed: Feed, values: Mapping[str, float]) -> None:
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
            if text := unstable_loop(run) or diverging_loop(run):
                raise SolverError(text, Reason.GROWING, error.time, error.worst, error.partial) from error
            raise
    if run.watch and before is not None:
        attend(run, run.watch, before)


def attend(run: OpenRun, watch: Watch, before: Sequence[np.ndarray]) -> None:
    """Let events happen in the step that was taken from an earlier state; SolverError where it cannot be taken in parts."""
    try:
        status = watch.look(run, before)
    except SolverError as error:
        error.partial = error.partial or trajectory(run)
        raise
    if status != stepping.DONE:
        raise failure(run, status, run.scheme.step * (run.done + 1))


def unstable_loop(run: OpenRun) -> str:
    """What is said of a controller whose input grows with the energy of the motion; nothing where none does."""
    told = run.feed.growing() if run.feed else ""
    if not told:
        return ""
    motion = trajectory(run)
    energy = survey_of(motion)[0][:, :2].sum(axis=1)
    rise = f"{told}, and the energy of the motion to {energy.max():.3g} J up to t = {motion.times[-1]:.6g} s"
    return f"{Reason.GROWING.value}: {rise}; lower its gains, take a shorter sample time, or limit it"


def diverging_loop(run: OpenRun) -> str:
    """What is said of a controller whose loop diverges from one sample to the next, where a step could not be taken."""
    told = sampled_loops.tell_diverging(run)
    return f"{Reason.GROWING.value}: {told}" if told else ""


def divide(run: OpenRun, status: int) -> None:
    """Take the next step in parts, with a status that says why; SolverError where it cannot be taken."""
    h, state = run.scheme.step, run.step.state
    halved, reached = divided(run, status, h * run.done, h, run.row(run.done + 1), max(1, int(state.parts[0])))
    if halved != stepping.DONE:
        raise failure(run, halved, reached)
    run.done += 1


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


class FailedStep(SolverError):
    """A step that could not be taken; `run` stands before it, its work space holds the last trial (see `diagnosis.explain`)."""

    def __init__(self, error: SolverError, run: OpenRun) -> None:
        super().__init__(str(error), error.reason, error.time, error.worst, error.partial)
        self.run = run


def failure(run: OpenRun, status: int, time: float) -> SolverError:
    """The error of a step that failed, with the worst residuals by name: forces [N] and gaps."""
    model, partial = run.model, trajectory(run)
    _, broken = leading_values(model.system, np.array([time]))
    if broken is not None:
        broken.partial = partial
        return broken
    reason, n = REASONS[status], model.system.size
    names = row_names(model.system)
    largest = worst(names, last_residual(run, time))
    text = f"{reason.value} at t = {time:.6g} s, also with the step divided by {2**HALVINGS}; largest residuals: {as_text(largest)}"
    error = SolverError(f"{text}; try a smaller step, or look at loads and joints there (n = {n})", reason, time, largest, partial)
    return FailedStep(error, run)
