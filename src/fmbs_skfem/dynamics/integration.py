"""Time integration of a System: compiled steps in chunks, halving on failure, partial results on
errors.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from ..core import machine_memory
from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import Notice, Progress
from ..core.values.arguments import checked
from ..systems.compiled import compile_system
from ..systems.system import System, loose_rows
from . import rest
from .checkpoint import Record, Resumed
from .compiled_step import stepping
from .compiled_step.jumps import jumps_of_loads
from .compiled_step.pieces import Unreached, take_piece
from .compiled_step.single_steps import SingleSteps
from .compiled_step.step import STEPS
from .compiled_step.touching import HALVINGS
from .dividing import retry_filtered
from .histories import leading_values, signals_of_steps
from .initial import (
    Instant,
    begin_steps,
    first_step,
    large_of,
    start_step,
    startable,
)
from .loose_rows import open_at_start
from .names import as_text, row_names, worst
from .observers import HistorySource, Observer, PauseCall, RunSetting, observers_of
from .run import OpenRun, last_residual, moment, take_up, trajectory
from .scheme import GeneralizedAlpha, Newton, method_of, steps_in
from .tracing import FEW, tracer_of
from .trajectory import Trajectory

REASONS = {
    stepping.NOT_CONVERGED: Reason.NOT_CONVERGED,
    stepping.DIVERGED: Reason.DIVERGED,
    stepping.NOT_FINITE: Reason.NOT_FINITE,
    stepping.SINGULAR: Reason.SINGULAR_TANGENT,
}
# what `judge` measures again counts steps of the run: a stop between two of these would shift it
#: steps are taken in multiples of this number, so that a stop between them changes nothing
WHOLE = stepping.REMEASURE
PACE = 0.2  #: time between two looks at a run that is watched [s]


@checked
def integrate(
    system: System,
    scheme: GeneralizedAlpha,
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    progress: Progress | None = None,
    record: Record | None = None,
    resume: Resumed | None = None,
    observers: Sequence[Observer] = (),
    states: int | None = None,
    judged: bool = True,
) -> Trajectory:
    """Integrate from t = 0 over `duration` [s]; states are stored every `every` steps and at the
    end, or after the steps listed.

        M q'' + f(q, q', t) - Q(t) + Phi_q^T lambda = 0,    Phi(q, t) = 0

    It starts in the reference, or in the equilibrium of the loads:
    `GeneralizedAlpha(step, start="equilibrium")`.

    The trajectory holds times (s,), x, v and a (s, n) in the unknowns of the system, and
    multipliers (s, m). The number of steps is duration / step, rounded with a notice. Initial
    velocities are projected onto the constraints with a notice. A step that fails is halved;
    SolverError carries reason, time, worst residuals by name and the partial trajectory.

    `record` sees the run a few times a second and may keep its states and a checkpoint; `resume`
    goes on from those, and ends in the same numbers as a run that was never stopped. `observers`
    look at the run beside those that the system offers, see `observers`.

    With a number of `states`, outputs and energies are read while the run goes, at all stored
    times, and so many states are kept, evenly spread, the first and the last one among them:
    `Trajectory.kept`. Where an observer reads states, all are kept. A motion that is not `judged` is
    one among others that are compared: rules of motions say nothing of it.

        >>> import numpy as np
        >>> from fmbs_skfem import dynamics, systems
        >>> from fmbs_skfem.bodies import point_mass
        >>> ball = point_mass("ball", 2.0, np.zeros(2))
        >>> place = {"ball": systems.probes.Position(systems.At("ball"))}
        >>> falling = systems.assemble([ball], [], [systems.loads.Gravity((0.0, -9.81))], outputs=place)
        >>> motion = dynamics.integrate(falling, dynamics.GeneralizedAlpha(step=0.01), 1.0)
        >>> motion
        <Trajectory 101 instants from 0 to 1, 2 unknowns>
        >>> f"{dynamics.outputs(motion)['ball_y'][-1]:.3f} m"  # - g t^2 / 2
        '-4.905 m'
    """
    steps = steps_in(scheme, duration)
    stored = len(every) if isinstance(every, np.ndarray) else steps // max(every, 1) + 1
    if states is not None and states < 1:
        raise InputError(say("integrate: states", "at least 1", states))
    fitting(system, steps, stored if states is None else min(stored, states))

    def repeat(other: System, shown: Progress | None) -> Trajectory:
        return integrate(other, scheme, duration, newton, every, shown)

    watching = (
        [PauseCall(lambda run: progress(run.done / run.steps), reads_states=False)]
        if progress
        else []
    )
    watching += [PauseCall(lambda run: record(moment(run)), reads_states=False)] if record else []
    setting = RunSetting(
        system,
        scheme,
        newton or Newton(),
        steps,
        system,
        repeat=repeat,
        progress=progress,
        judged=judged,
    )
    run = begun(setting, kept_steps(every, steps), [*watching, *observers], resume, states)
    try:
        advance(run)
        return finished(run)
    except Notice as notice:
        notice.partial = notice.partial or trajectory(run)
        raise


def advance(run: OpenRun) -> None:
    """Take all steps of a run, with pauses where it is watched."""
    watching = [one for one in run.observers if one.looks == "pause"]
    # a run that nobody watches is one call of compiled code
    chunk = WHOLE if watching else run.steps
    while run.done < run.steps:
        begin = clock.perf_counter()
        # resumed runs and stops begin within a multiple: the next chunk ends on one again
        past = run.done % WHOLE
        march(run, min(WHOLE - past if past else chunk, run.steps - run.done))
        if watching:
            chunk = choose_chunk(chunk, clock.perf_counter() - begin)
        for one in watching:
            one.after(run)


def finished(run: OpenRun) -> Trajectory:
    """The motion of a run that has ended, as its observers leave it."""
    motion = trajectory(run)
    for one in run.observers:
        motion = one.finish(run, motion)
    return motion


def fitting(system: System, steps: int, stored: int) -> None:
    """Refuse a run whose stored states exceed the memory of the machine, before any of them is
    there.
    """
    needed = 8.0 * (steps + stored * (3 * system.size + len(system.constraints.names)))
    if needed > (there := machine_memory.built_in()):
        got = f"{stored} of {needed / 1e9:.3g} GB"
        raise InputError(
            say(
                "analysis.every",
                f"stored states that fit into the {there / 1e9:.3g} GB of this machine",
                got,
                "store fewer",
            )
        )


def begun(
    setting: RunSetting,
    kept: np.ndarray,
    more: Sequence[Observer] = (),
    resume: Resumed | None = None,
    states: int | None = None,
) -> OpenRun:
    """A run at its start, or where it was left, with more observers than are offered. Progress is 0
    on the way to a start.
    """
    scheme, newton, steps = setting.scheme, setting.newton, setting.steps
    system = startable(setting.system, scheme)
    at_rest = scheme.start == "equilibrium" and resume is None
    x, v, memory = (
        rest.in_equilibrium(system, newton, setting.progress)
        if at_rest
        else (system.x0, system.v0, None)
    )
    observers = [*observers_of(replace(setting, system=system)), *more]
    # what is given between steps needs them one by one, from one source
    source = next((one for one in observers if isinstance(one, HistorySource)), None)
    if source is None and any(one.looks == "step" for one in observers):
        source = SingleSteps(system, scheme)
    model = compile_system(source.plain if source else system)
    if source:
        system = source.system
        model = replace(model, system=source.system)
    first = Instant(0.0, x, v, open_at_start(model, x), memory)
    # a place a step, so that compiled steps store without a search
    rows = np.full(steps + 1, -1)
    rows[kept] = np.arange(len(kept))
    few = keeps_few(model.system, observers, len(kept), states, resume)
    tracer, room = tracer_of(model, scheme, steps, len(kept), few) if few else (None, len(kept))
    step = first_step(model, x, v, method_of(scheme, newton, scheme.step, model), room)
    step.space.off[:] = first.off
    run = OpenRun(
        model=model,
        scheme=scheme,
        newton=newton,
        kept=kept,
        times=scheme.step * kept,
        rows=rows,
        step=step,
        # factors of sparse models live here, outside of the packed step
        large=large_of(model, newton.solver),
        cpu=clock.process_time(),
        wall=clock.perf_counter(),
        observers=observers,
        source=source,
        tracer=tracer,
        jumps=jumps_of_loads(setting.system, scheme.step, steps),
    )
    if resume is None:
        v = start_step(run.packed, scheme, first)
        step.job.out[0, 0, model.order], step.job.out[1, 0] = step.state.x, v
        step.job.out[2, 0, model.order] = step.state.acceleration
        step.job.multipliers[0] = step.state.multipliers / step.method.c
        step.job.memory[0] = step.state.memory
    for one in observers:
        one.begin(run)
    if resume is not None:
        take_up(run, resume)
    return run


def restart(run: OpenRun, x: np.ndarray, v: np.ndarray) -> None:
    """Put a run that is at its start to another one, x and v (n,), consistent with the joints."""
    first = Instant(0.0, x, v, open_at_start(run.model, x))
    start_step(run.packed, run.scheme, first)


def keeps_few(
    system: System,
    observers: Sequence[Observer],
    stored: int,
    states: int | None,
    resume: Resumed | None,
) -> int:
    """How many states a run keeps of those stored, 0 for all: as it began, where it goes on."""
    if resume is not None and resume.checkpoint.kept:
        return min(states or FEW, stored) if resume.rows.trace is not None else 0
    # whose reactions the last state tells
    trained = bool(system.components) and bool(loose_rows(system.constraints).any())
    asked = (
        states is None or states >= stored or trained or any(one.reads_states for one in observers)
    )
    return 0 if asked else int(states or 0)


def choose_chunk(chunk: int, seconds: float) -> int:
    """Steps to take at once, in units of WHOLE, so that they take about PACE seconds; results do
    not depend on it.
    """
    if seconds < 0.5 * PACE:
        # doubled and halved: after some ten pauses they are PACE apart, whatever a step costs
        return 2 * chunk
    return max(WHOLE, chunk // 2 // WHOLE * WHOLE) if seconds > 2.0 * PACE else chunk


def march(run: OpenRun, many: int) -> None:
    """Take some steps, the last one possibly halved; SolverError where it cannot be taken."""
    # observers of every step: some 14 us a step in Python
    if run.close:
        for _ in range(many):
            if not run.ended:
                take_step(run)
        return
    end = run.done + many
    begin_steps(run.step.state)
    while run.done < end:
        run.make_room(run.done + 1)
        if run.done in run.jumps:
            take_between_jumps(run)
        elif (status := take_steps(run, run.next_jump(end) - run.done)) != stepping.DONE:
            take_filtered(run, status)


def take_steps(run: OpenRun, many: int) -> int:
    """Take some steps, or fewer; the status."""
    scheme = run.scheme
    many = run.last_stored(run.done + many) - run.done
    signals, broken = signals_of_steps(run.model.system, scheme.step, run.steps, run.done, many)
    status, taken = run.take(signals, run.rows_from(run.done + 1))
    run.done += taken
    if status == stepping.DONE and taken == len(signals) and broken is not None:
        broken.partial = trajectory(run)
        raise broken
    return status


def take_step(run: OpenRun) -> None:
    """Take one step, at which observers look; SolverError where it cannot be taken."""
    try:
        # observers read what balances all forces, where a motion starts
        for one in run.close:
            one.before(run)
        begin_steps(run.step.state)
        assert run.source is not None
        run.make_room(run.done + 1)
        if run.done in run.jumps:
            take_between_jumps(run)
        elif (status := run.source.take(run)) == stepping.DONE:
            run.done += 1
        else:
            take_filtered(run, status)
        for one in run.close:
            one.after(run)
    except SolverError as error:
        error.partial = error.partial or trajectory(run)
        raise


def take_filtered(run: OpenRun, status: int) -> None:
    """Take the first step from filtered accelerations; SolverError where it cannot be taken, and of
    any other step that failed.
    """
    status = retry_filtered(run, status, run.scheme.step * run.done)
    if status != stepping.DONE:
        give_up(run, status)
    run.done += 1
    run.store()


def take_between_jumps(run: OpenRun) -> None:
    """Take a step in which loads jump, from jump to jump; SolverError where a piece of it cannot be
    taken.
    """
    steps = int(run.step.job.counters[STEPS])
    try:
        take_piece(run, 0.0, 1.0)
    except Unreached as failed:
        give_up(run, failed.status)
    run.step.job.counters[STEPS] = steps + 1
    run.done += 1
    run.store()


def give_up(run: OpenRun, status: int) -> NoReturn:
    """Raise the SolverError of a step that failed, in the words of an observer that knows why."""
    failed = failure(run, status, run.packed.reached)
    if text := next((text for one in run.observers if (text := one.explain(run))), ""):
        raise SolverError(
            text, Reason.GROWING, failed.time, failed.worst, failed.partial
        ) from failed
    raise failed


def kept_steps(every: int | np.ndarray, steps: int) -> np.ndarray:
    """Numbers of the steps after which states are kept, 0 first: those listed, or every so many and
    the last one.
    """
    if isinstance(every, np.ndarray):
        if every.ndim != 1 or every.dtype.kind not in "iu":
            raise InputError(
                say(
                    "steps to keep",
                    "a list of whole numbers",
                    f"an array {every.shape} of {every.dtype}",
                )
            )
        kept = np.union1d(0, every.astype(np.int64))
        if kept[0] < 0 or kept[-1] > steps:
            raise InputError(
                say("steps to keep", f"numbers from 0 to {steps}", f"{kept[0]} to {kept[-1]}")
            )
        return kept
    if every < 1:
        raise InputError(say("analysis.every", "at least 1", every))
    return np.append(np.arange(0, steps, every), steps)


class FailedStep(SolverError):
    """A step that could not be taken; `run` stands before it, its work space holds the last trial
    (see `diagnosis.explain`).
    """

    def __init__(self, error: SolverError, run: OpenRun) -> None:
        super().__init__(str(error), error.reason, error.time, error.worst, error.partial)
        self.run = run


def failure(run: OpenRun, status: int, time: float) -> SolverError:
    """The error of a step that failed, with the worst residuals by name: forces [N] and gaps."""
    model = run.model
    partial = trajectory(run)
    _, broken = leading_values(model.system, np.array([time]))
    if broken is not None:
        broken.partial = partial
        return broken
    reason = REASONS[status]
    n = model.system.size
    names = row_names(model.system)
    largest = worst(names, last_residual(run, time))
    text = f"{reason.value} at t = {time:.6g} s, also with the step divided by {2**HALVINGS}; largest residuals: {as_text(largest)}"
    error = SolverError(
        f"{text}; try a smaller step, or look at loads and joints there (n = {n})",
        reason,
        time,
        largest,
        partial,
    )
    return FailedStep(error, run)
