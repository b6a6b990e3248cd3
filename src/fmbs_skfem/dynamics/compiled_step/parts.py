r"""A step in equal parts, inside of the compiled step: h / 2, h / 4, ... until one of these lengths
takes it.

Nothing that is known is lost on the way. Earlier q'' and multipliers at the new distance are those
of the parabola through the three that are known,

    q''(t - d h) = (1 - d) (2 - d) / 2 q''_0 + d (2 - d) q''_1 - d (1 - d) / 2 q''_2,

multipliers and the second difference of q'' grow with c and with h^2, and the algorithmic
acceleration, which is q'' at the time t + (am - af) h, moves on by

    (am - af) (h_new - h_old) q''',    q''' = (q''_0 - q''_1) / h,

both ways by the difference of whole steps: where a force begins in the last part, that of two parts
would be 64 times as large, and two divided steps behind each other move it there and back by the
same. Where the last step says that q'' goes on better as it is than along that difference (order 0
of the predictor), a stays.

Source (changes of the step in generalized-alpha): Bruels and Arnold, The generalized-alpha scheme
as a linear multistep integrator, J. Comput. Nonlinear Dyn. 3 (2008) 041007, doi 10.1115/1.2960475.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import kernels
from . import rotated
from .step import (
    BEGIN,
    HALVED,
    JOB,
    LEAP,
    LEAPT,
    LENGTH,
    LEVEL,
    NOW,
    NUMBER,
    NUMBERS,
    STEPS,
    TAKEN,
    Method,
    State,
    opened,
    opened_kept,
    opened_state,
)
from .stepping import COARSE, DONE, NOT_FINITE, STOPPED, TOO_LONG, TOUCHES, add_known, look_ahead

# a rolling hoop and a gripper take as many steps at 0.2 and at 0.7
ROOM = 0.35  #: of the error that a step may have, up to which the next one is taken in half as many parts
FINEST = 5  #: halvings by the error of a step


@routine
def divide(table: Any, status: Any) -> int:
    """A step that failed with a status in two or more equal parts, or a piece of one (DONE) in
    those it begins with; the status.

    A step whose error is controlled (COARSE) is taken in as few parts as keep it small.
    """
    S = opened(table)
    # once a division: whole steps save nothing
    copy_state(S.levels.kept, False)
    if S.method.local > 0.0 and status in (COARSE, DONE):
        return control(table, status == DONE)
    if status == DONE:
        return take_divided(table, status, S.state.parts[0])
    return take_divided(table, status, max(1, S.state.parts[0]))


@jit
def control(table: Any, piece: bool) -> int:
    """A step in as many parts as the one before, once more in shorter ones where its error asks for
    a quarter of their length.

    A piece of a step has the length of the first trial.

    Errors fall by 4 where parts are half as long. The next step has half as many parts where its
    error leaves ROOM for that.
    """
    S = opened(table)
    s, job, levels = S.state, S.job, S.levels
    steps = job.counters[STEPS]
    leapt = job.done[1]
    for again in range(2):
        parts = s.parts[0]
        status = COARSE
        levels.found[LEVEL] = 0
        if parts == 0 and not piece:
            status = invoke(S.doors.take, table, job.done[0])
        if status != DONE and status != TOUCHES:
            status = take_divided(table, status, parts if piece else max(1, parts))
        if status != DONE:
            return status
        level = levels.found[LEVEL]
        error = local_error(table, levels.found[LEVEL])
        if error < 0.0:
            return STOPPED
        wanted = level
        while error > S.method.local and wanted < FINEST:
            error = 0.25 * error
            wanted = wanted + 1
        if again == 0 and wanted > level + 1:
            copy_state(levels.kept, True)
            s.parts[0], job.counters[STEPS], job.done[1] = wanted, steps, leapt
            continue
        if wanted == level and 4.0 * error < ROOM * S.method.local:
            wanted = max(level - 1, 0)
        # what touches asks for its own length
        s.parts[0] = max(s.parts[0], wanted)
        return DONE
    return DONE


@jit
def local_error(table: Any, halvings: int) -> float:
    """The error of the step that was taken in 2^halvings parts, root mean square [m]; -1 where it
    cannot be found.

    The part of a change of q'' that the method does not follow in a step, h^2 dq'', through the
    factors,

        e = |(bh M + gh C + K, Phi_q^T; Phi_q, 0)^-1 bh M dq''| H^2 / 4^k,    H the step, dq'' its change over it

    so that waves which no step resolves count with their own size, and not with that of their
    accelerations.
    """
    S = opened(table)
    s = S.state
    t = S.space
    before = opened_state(S.levels.before)
    H = opened(S.levels.tables[0]).method.h
    for i in range(len(t.way)):
        t.way[i] = s.acceleration[i] - before.acceleration[i]
    kernels.clear(t.f)
    kernels.add_operator(S.arrays.mass, t.way, t.f)
    factor = S.method.bh * S.method.c * H**2 / 4.0**halvings
    for i in range(len(t.f)):
        t.f[i] *= factor
    for m in range(len(s.multipliers)):
        t.rhs[0, len(t.f) + m] = 0.0
    if invoke(S.doors.solve, table, 0) != 0:
        return -1.0
    square = 0.0
    for i in range(len(t.f)):
        square += S.arrays.norm[i] * t.f[i] * t.f[i]
    return np.sqrt(square)


@jit
def take_divided(table: Any, status: int, first: int) -> int:
    """A step in parts, from the trial `first` on; `status` says why.

    The trials of `Levels` follow each other. Where forces began or ended too fast for longer steps,
    the next step begins in half as many parts, and the shortest stand. On failure the state is that
    before the step, and the space keeps the last trial state.
    """
    S = opened(table)
    s, job, levels = S.state, S.job, S.levels
    touching = status == TOO_LONG
    steps = job.counters[STEPS]
    leapt = job.done[1]
    failed = job.counters[HALVED]
    foreseen = parts_ahead(table, first) if S.method.allowed < 1.0 else first
    if foreseen > first:
        # what touches asks for shorter parts anyway: that longer ones fail says nothing
        touching = True
        status = TOO_LONG
    for trial in range(foreseen, len(levels.tables)):
        # what touches divides steps by plan, and so do errors: only failures of the iteration speak
        # against a motion
        job.counters[HALVED] += status != TOO_LONG and status != DONE and status != COARSE
        forget = may_touch(table) and status != COARSE
        status = take_parts(table, trial, forget)
        job.counters[STEPS] = steps
        if status == DONE:
            join(table, trial, forget)
            job.counters[STEPS] += 1
            levels.found[LEVEL] = levels.halvings[trial]
            # a touch takes some steps: the next one begins near what this one needed, and grows
            # back
            s.parts[0] = max(levels.halvings[trial] - 1, 0) if touching else 0
            if leapt == 0 and job.done[1] > 0:
                levels.found[LEAP] = levels.halvings[trial]
                kernels.copy(levels.spans[NOW], levels.spans[LEAPT])
            return DONE
        # every trial begins with the same state, whatever the one before has left
        copy_state(levels.kept, True)
        job.done[1] = leapt
        if status in (STOPPED, TOUCHES):
            # pieces between touches are judged by themselves
            job.counters[HALVED] = failed if status == TOUCHES else job.counters[HALVED]
            return int(status)
        touching = touching or status == TOO_LONG
    return int(status)


@jit
def parts_ahead(table: Any, first: int) -> int:
    """The first judged trial, from `first` on, whose parts are not too long for what touches, with
    the accelerations of now.
    """
    S = opened(table)
    tables = S.levels.tables
    trial = first
    while opened(tables[trial + 1]).method.judging:
        method = opened(tables[trial]).method
        look_ahead(table, method.h)
        if method.h * S.space.impulse[0] <= method.allowed * S.state.speed[0]:
            break
        trial += 1
    return trial


@routine
def begin(table: Any, trial: Any) -> int:
    """What a trial begins with, from the state before the step: what is known, no factors, and
    histories.
    """
    return begin_parts(table, trial, may_touch(table))


@jit
def begin_parts(table: Any, trial: int, forget: bool) -> int:
    """The same; earlier accelerations may be forgotten."""
    S = opened(table)
    levels = S.levels
    P = opened(levels.tables[trial])
    part(S.state, S.method, P.method, forget)
    rotated.forget(table)
    levels.found[NUMBERS] = len(P.job.signals)
    levels.spans[NOW, BEGIN] = begin_of(table)
    levels.spans[NOW, LENGTH] = levels.spans[JOB, LENGTH]
    if levels.histories == 0:
        return DONE
    # histories are functions of Python: asked for once a trial, and of models that have some
    return STOPPED if invoke(levels.histories, table, len(P.job.signals)) != 0 else DONE


@jit
def begin_of(table: Any) -> float:
    """When the step that a job has come to begins [s], to the bit the same in whatever call it is."""
    S = opened(table)
    levels = S.levels
    if levels.found[NUMBER] < 0:
        return levels.spans[JOB, BEGIN]
    return levels.spans[JOB, LENGTH] * (levels.found[NUMBER] + S.job.done[0])


@jit
def take_parts(table: Any, trial: int, forget: bool) -> int:
    """The parts of a trial; the status, and the number of those that were taken."""
    S = opened(table)
    levels = S.levels
    P = opened(levels.tables[trial])
    if begin_parts(table, trial, forget) != DONE:
        return STOPPED
    for k in range(levels.found[NUMBERS]):
        levels.found[TAKEN] = k
        status = invoke(S.doors.take, levels.tables[trial], k)
        if status != DONE:
            return status
    levels.found[TAKEN] = levels.found[NUMBERS]
    return DONE if levels.found[NUMBERS] == len(P.job.signals) else NOT_FINITE


@jit
def copy_state(rooms: np.ndarray, back: bool) -> None:
    """Copy a state into the rooms for it, or back."""
    for place in rooms:
        kept = opened_kept(place)
        for i in range(len(kept.now)):
            if back:
                kept.now[i] = kept.before[i]
            else:
                kept.before[i] = kept.now[i]


@jit
def may_touch(table: Any) -> bool:
    """Whether forces may begin or end within a step."""
    return len(opened(table).arrays.forces.judged) > 0


@jit
def part(s: State, whole: Method, short: Method, forget: bool) -> None:
    """What is known of whole steps becomes that of shorter ones; where forces begin or end earlier
    ones are to be forgotten.
    """
    ratio = short.h / whole.h
    scale_multipliers(s, short.c / whole.c)
    if forget:
        # a mass that meets what is thin was guessed, and found, on its other side
        s.known[0], s.order[0], s.change[0] = 1, 0, np.inf
        return
    if s.known[0] == 1:
        # as at the start of a motion, where the joints give a its place
        for i in range(len(s.a)):
            s.a[i] = s.acceleration[i] + ratio * (s.a[i] - s.acceleration[i])
    move_algorithmic(s, whole, short.h - whole.h)
    resample(s.history, s.known[0], ratio)
    resample(s.past, s.known[0], ratio)
    s.change[0] *= ratio * ratio


@jit
def join(table: Any, trial: int, forget: bool) -> None:
    """Parts of the step are one: what was known before it goes on with its end."""
    S = opened(table)
    P = opened(S.levels.tables[trial])
    s = S.state
    before = opened_state(S.levels.before)
    whole = S.method
    short = P.method
    scale_multipliers(s, whole.c / short.c)
    for k in range(len(s.history)):
        kernels.copy(before.history[k], s.history[k])
        kernels.copy(before.past[k], s.past[k])
    s.known[0] = before.known[0]
    add_known(s, S.arrays.norm, s.acceleration, s.multipliers)
    if not forget:
        move_algorithmic(s, whole, whole.h - short.h)
    # factors are those of parts
    S.work.kind[0] = 0


@jit
def move_algorithmic(s: State, whole: Method, longer: float) -> None:
    """The algorithmic acceleration for steps that are `longer` [s], where differences of q'' say
    how it goes on.
    """
    # by an order of the predictor that has been judged: differences of what no step resolves say
    # nothing
    if s.order[0] == 0 or s.known[0] < 3:
        return
    factor = (whole.am - whole.af) * longer / whole.h
    for i in range(len(s.a)):
        s.a[i] += factor * (s.history[0, i] - s.history[1, i])


@jit
def scale_multipliers(s: State, factor: float) -> None:
    """Multipliers, which have c in them, for another c."""
    for k in range(len(s.multipliers)):
        s.multipliers[k] *= factor
        for row in range(len(s.past)):
            s.past[row, k] *= factor


@jit
def resample(rows: np.ndarray, known: int, ratio: float) -> None:
    """The latest of three rows stays, the earlier ones move to a distance of `ratio` and of twice
    of it.
    """
    for i in range(rows.shape[1]):
        latest, before, first = rows[0, i], rows[1, i], rows[2, i]
        # one that is not known is on the line of the others
        first = first if known > 2 else 2.0 * before - latest
        for k in range(1, known):
            d = k * ratio
            rows[k, i] = (
                0.5 * (1.0 - d) * (2.0 - d) * latest
                + d * (2.0 - d) * before
                - 0.5 * d * (1.0 - d) * first
            )
