"""Whether the steps of a run are short enough for what they read of time, of angles and of tables,
and for Newton's iteration.

Observers that look at a motion when its run has ended, each with one warning: histories that change
inside of steps, drives that jump, angles that jump or tilt, tables that were left, failed
iterations, what functions of Python cost.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ...core.notices import CoarseStep, Notice, notify, remark
from ...core.values import expressions
from ...core.values.expressions import Expression, of_time
from ...core.values.tables import Table
from ...systems.compiled import Compiled, signal_table
from ...systems.forces import on_rows as forces
from ...systems.forces import responses
from ...systems.forces.force_laws import ForceLaw, LawForces, evaluate
from ...systems.measures.angles import DOUBT
from ...systems.signals import Cosine, Sine, exact_path, jet, read_inputs
from ...systems.system import Signal, System, driving
from ..histories import SIDE, of_histories, pushed_body, signal_names
from ..observers import Judge, Looks, Observer, RunSetting, offered
from ..run import OpenRun
from ..trajectory import Statistics, Trajectory

#: of the largest slope of a table, by which those of two of its lines differ by round-off
STRAIGHT = 1e-9
# twice as many cost twice as much, 8 ms in a run of 6000 steps, and say the same of what a step
# misses
INSIDE = 4  #: instants inside of a step at which histories are looked at
# a pulse between two ends gives nothing, one that begins at an end up to 25 times its impulse: what
# is resolved misses far less
MISSED = 0.05  #: of what a history gives over time, by the ends of steps alone, above which a warning is shown
#: steps from where a history begins to the end of a run, up to which it may have only begun: after
#: n steps t^2 is missed by 1 / (2 n^2), t^6 by 3.5 / n^2, however short the steps are; and how far
#: it leaves the range of the ends of a step, of its size, where they do not see it
BRIEF = 10
UNSEEN = 0.1
AT_ONCE = 10_000  #: steps
#: what a drive changes in a step, of its range and of the change in the steps beside, above which
#: it jumps; its rate alike
LEAP = 1e-3, 10.0
#: in units of the last place of the largest value of a drive, which its differences have
ROUND_OFF = 8.0
TILT = 0.1  #: of the place of a torque out of the plane of its angle, above which a warning is shown [rad]
#: of coordinates and laws about axes in space
ROWS_OF_ANGLES = {
    "torque": 2,
    "torsion_spring": 2,
    "torque in space": 9,
}


class Tables(Observer):
    """Looks at tables of forces: a live run has no end."""

    reads_states = False

    def __init__(self, live: bool) -> None:
        self.looks: Looks = "step" if live else "end"
        self.told = False

    def after(self, run: OpenRun) -> None:
        if not self.told:
            texts = list(responses.beyond(run.model, run.step.state.memory))
            self.told = bool(texts)
            notify(*texts)

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        self.after(run)
        return motion


class PythonCost(Observer):
    """A remark of what forces that are functions of Python cost in a run."""

    looks = "end"
    reads_states = False

    def begin(self, run: OpenRun) -> None:
        self.before_run = forces.cost_of(run.model.forces)

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        now = forces.cost_of(run.model.forces)
        if calls := now.calls - self.before_run.calls:
            seconds = now.seconds - self.before_run.seconds
            beside = f"{seconds:.3g} s beside {motion.statistics.cpu_s:.3g} s of the run"
            told = f"functions of Python were called {calls} times for forces, {beside}"
            remark(f"{told}; in symbols they run in compiled code (docs/extensions.md)")
        return motion


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    laws = [one for one in setting.system.loads.forces if isinstance(one, LawForces)]
    if not setting.live:
        yield Judge(lambda run, motion: judge_iteration(motion.statistics), reads_states=False)
        if setting.system.signals:
            yield Judge(
                lambda run, motion: judge_histories(run, motion, setting.steps),
                any(one.law.maker for one in laws),
            )
        if any(one.law.memory or coordinate_of(one.law.name) in ROWS_OF_ANGLES for one in laws):
            yield Judge(judge_angles)
        if any(isinstance(one, forces.OfPython) for one in setting.system.loads.forces):
            yield PythonCost()
    if any(one.law.tables for one in laws):
        yield Tables(setting.live)


def judge_iteration(cost: Statistics) -> Iterator[str]:
    """An iteration that failed so often that the motion is hardly resolved."""
    if cost.unresolved:
        failed = f"Newton's iteration failed {cost.halved} times in {cost.steps} steps, which were divided"
        yield f"{failed}: the steps do not resolve the motion, which may be wrong; take a smaller step"


def judge_histories(run: OpenRun, motion: Trajectory, steps: int) -> Iterator[str | Notice]:
    """What is read of time, of so many steps that were to be taken."""
    yield from find_coarse_steps(motion, run.plain, run.scheme.step, steps, run.jumps)
    yield from find_jumping_drives(run.plain, run.scheme.step, steps)


def judge_angles(run: OpenRun, motion: Trajectory) -> Iterable[str]:
    """Angles of loads."""
    return [*find_jumps(run.model, motion, run.scheme.step)] or find_tilts(motion)


def find_coarse_steps(
    motion: Trajectory, plain: System, step: float, steps: int, whole: Collection[int]
) -> Iterator[Notice]:
    """Histories and forces by expressions of t that change inside of steps [s], which read them at
    their ends alone.

    `plain` is the system before it was told its inputs; what reads inputs, which are held from step
    to step, is left out. Nothing is missed in steps that end where loads jump in them, `whole` by
    their numbers.

    The integral S(t) of a history s, for a load its impulse, is off by

        max |S - S_h| / max |S|

    where S_h is that of the straight lines between the ends of the steps.
    """
    wrong = dict[str, float]()
    found = of_histories(
        plain, "coarse", step, steps, lambda: list(coarse_histories(plain, step, steps, whole))
    )
    coarse = [(signal_names(plain)[k], share) for k, share in found]
    for owner, share in (*coarse, *coarse_forces(motion, plain, step, steps, whole)):
        wrong[owner] = max(wrong.get(owner, 0.0), share)
    for owner, share in wrong.items():
        text = f"{owner} changes faster than the step of {step:g} s"
        yield CoarseStep(
            f"{text}: its integral over time is wrong by up to {share:.0%}; take a smaller step"
        )


def find_jumping_drives(plain: System, step: float, steps: int) -> Iterator[str]:
    """Functions of time that drive a joint, or their rates, that jump from one step [s] to the
    next: an impulse.
    """
    corners = yield from find_cornered_drives(plain, step * np.arange(steps + 1))
    found = of_histories(plain, "jumps", step, steps, lambda: drives_that_jump(plain, step, steps))
    for name, (what, t) in {
        signal_names(plain)[k]: jump for k, jump in reversed(found.items()) if k not in corners
    }.items():
        text = f"{name} is driven by a function{what} jumps within one step, at t = {t:.4g} s"
        yield f"{text}: forces there are impulses that depend on the step; let it change over many steps"


def find_cornered_drives(plain: System, times: np.ndarray) -> Generator[str, None, set[int]]:
    """Tables of straight lines that drive joints, at the first of the times (s,) [s] at which their
    rates jump.

    Returns the numbers of the signals that read them.
    """
    found = dict[str, str]()
    signals = dict[int, dict[Table, float]]()
    if any(
        straight_tables(signal) for signal in plain.signals
    ):  # rows are many, and few systems read tables
        signals = {
            k: corners(plain.signals[k], times)
            for k in sorted({k for _, k in driving(plain.constraints)})
        }
    for k, tables in signals.items():
        for table, at in tables.items():
            text = f"{signal_names(plain)[k]} is driven by the straight lines of table '{table.call[:-2]}', whose rate jumps"
            found.setdefault(text, f"{text} at each point, first at t = {at:.4g} s")
    for text in found.values():
        yield f"{text}: forces there are impulses that depend on the step; `smooth: true` makes it a smooth curve"
    return {k for k, tables in signals.items() if tables}


def straight_tables(signal: Signal) -> list[Table]:
    """Tables of straight lines that a function of time reads."""
    read: Any = signal.angle if isinstance(signal, Cosine | Sine) else signal
    tables = read.inputs if isinstance(read, Expression) else (read,)
    return [one for one in tables if isinstance(one, Table) and not one.smooth]


def corners(signal: Signal, times: np.ndarray) -> dict[Table, float]:
    """Tables of straight lines that a function of time reads, and the first of the times (s,) [s]
    behind a corner of theirs.

    A corner counts where the value changes the function: not in the branch of `where` that is not
    taken.
    """
    read: Any = signal.angle if isinstance(signal, Cosine | Sine) else signal
    read = of_time(read.name, inputs={read.name: read}) if isinstance(read, Table) else read
    found = dict[Table, float]()
    for table in straight_tables(read):
        slopes = np.diff(table.values) / np.diff(table.times)
        bent = np.abs(np.diff(slopes)) > STRAIGHT * np.abs(slopes).max()
        places = np.array(table.times)[1:-1][bent]

        def behind(x: np.ndarray, table: Table = table, places: np.ndarray = places) -> np.ndarray:
            piece = np.searchsorted(places, np.broadcast_to(x, times.shape))
            return np.where(np.diff(piece, prepend=piece[:1]) != 0, np.nan, table(x))

        names = {one.call: one for one in read.inputs if one.call} | {table.call: behind}
        values = {one.name: one(times) for one in read.inputs} | {
            table.name: behind(times),
            "t": times,
        }
        with np.errstate(all="ignore"):
            marked = np.zeros(times.shape) + expressions.evaluate(
                read.program, values | names, expressions.ARRAY
            )
        at = times[np.isnan(marked) & ~np.isnan(read(times))]
        if len(at):
            found[table] = float(at[0])
    return found


def drives_that_jump(plain: System, step: float, steps: int) -> dict[int, tuple[str, float]]:
    """Numbers of the signals that drive joints and jump, or whose rates do: which of both, and when
    [s].

    A joint that jumps by u, or whose rate jumps by w, moves a mass with

        m u / h^2    and    m w / h

    which no smaller step makes right. A corner between two steps shows in the second differences of
    both. Angles are looked at themselves, as second differences of their cosines vanish at every
    half turn.
    """
    times = step * np.arange(steps + 1)
    held = {signal for one in plain.locks for signal in one.signals}  # gaps that latches keep
    driven = {signal for _, signal in driving(plain.constraints)} - held
    jumps = dict[int, tuple[str, float]]()
    for k in (k for k in driven if steps > 2 and not read_inputs(plain.signals[k])):
        signal = plain.signals[k]
        path = signal.angle if isinstance(signal, Cosine | Sine) else signal
        values = path(times) + np.zeros(len(times))
        noise = ROUND_OFF * np.finfo(float).eps * np.abs(values).max()
        changes, bends = np.abs(np.diff(values)), np.abs(np.diff(values, 2))
        for order, (what, found, size, apart) in enumerate(
            (
                (" that", changes, np.ptp(values), 1),
                (" whose rate", bends, changes.max(), 2),
            ),
            1,
        ):
            limit = np.maximum(LEAP[0] * size, LEAP[1] * beside(found, apart))
            for at in np.flatnonzero(found > limit + noise):
                # a motion that begins in the last step of a run is none
                if found[at] > size_by_rates(path, times[at : at + order + 1], order):
                    jumps.setdefault(k, (what, times[at + 1]))
                    break
    return jumps


def size_by_rates(path: Signal, times: np.ndarray, order: int) -> float:
    """What derivatives of an order make of a difference between times (s,) [s] of equal steps, on
    both sides of corners; 0 where they are not known exactly.
    """
    if exact_path(path) is None:
        return 0.0
    h = float(times[1] - times[0])
    sides = (jet(path, times, side * SIDE * h)[order] for side in (-1.0, 1.0))
    return float(h**order * np.abs(list(sides)).max() * (1.0 + SIDE))


def beside(found: np.ndarray, apart: int) -> np.ndarray:
    """The larger one (s,) of the values `apart` before and behind every value (s,); near the ends
    the largest of three inside.

    A smooth function may vanish at the one that there is.
    """
    before, behind = np.zeros(len(found)), np.zeros(len(found))
    before[apart:], behind[:-apart] = found[:-apart], found[apart:]
    largest = np.maximum(before, behind)
    for k in range(min(apart, len(found))):
        inside = (
            found[k + apart : k + apart + 3],
            found[max(len(found) - k - apart - 3, 0) : max(len(found) - k - apart, 0)],
        )
        largest[k], largest[-1 - k] = (part.max(initial=0.0) for part in inside)
    return largest


def find_jumps(model: Compiled, motion: Trajectory, step: float) -> Iterator[str]:
    """Angles of loads that jump from one step [s] to the next: a slope goes through its axis, or
    turns too fast.
    """
    if motion.memory is None or len(motion.times) < 2:
        return
    apart = np.diff(motion.times)
    near = (apart > 0.0) & (apart < 1.5 * step)
    for source, force, held in model.remembering:
        if not isinstance(source, LawForces) or not force.turns.any():
            continue
        with np.errstate(invalid="ignore"):  # values of events may be infinite beside
            jumps = np.where(
                force.turns * near[:, None] > 0.0,
                np.abs(np.diff(motion.memory[:, held], axis=0)),
                0.0,
            )
        s, k = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[s, k] > DOUBT:
            name = pushed_body(
                motion.system, int(source.rows[k * len(source) // len(force.memory), 0])
            )
            at = f"by {np.degrees(jumps[s, k]):.0f} degrees in one step, at t = {motion.times[s + 1]:.4g} s"
            why = "its place tilts into the axis there, or turns too fast"
            yield f"the angle of {name} jumps {at}: {why}; take a smaller step, or hold the place so that it cannot tilt"


def find_tilts(motion: Trajectory) -> Iterator[str]:
    """A place of a torque about an axis in space that tilts: the direction u whose angle it counts
    leaves its plane.

    The torque does the work of that angle, tau theta', so that at a tilt phi it has a part tau
    tan(phi) across the axis.
    """
    system = motion.system
    worst = dict[int, float]()
    for source in system.loads.forces if system.dim == 3 else ():
        if isinstance(source, LawForces) and (
            size := ROWS_OF_ANGLES.get(coordinate_of(source.law.name))
        ):
            for rows in source.rows[:, :size]:
                y = (
                    np.asarray(csr_array(system.probes.matrix)[rows] @ motion.x.T).T
                    + system.probes.offset[rows]
                )
                u = y[:, :3]
                normals = y[:, 3:].reshape(len(y), -1, 3)
                inside = np.linalg.norm(
                    y if size == 2 else np.einsum("sc,skc->sk", u, normals), axis=1
                )
                length = 1.0 if size == 2 else np.linalg.norm(u, axis=1)
                worst[int(rows[0])] = float(np.arccos(np.clip(inside / length, 0.0, 1.0)).max())
    row = max(worst, key=worst.__getitem__, default=-1)
    if row >= 0 and worst[row] > TILT:
        tilt = f"tilts out of the plane of its angle by up to {np.degrees(worst[row]):.0f} degrees"
        across = f"the torque does the work of that angle, and has up to {np.tan(worst[row]):.0%} of itself across its axis"
        remedy = "hold the place by a revolute joint where that matters"
        yield f"the place of {pushed_body(system, row)} {tilt}: {across}; {remedy}"


def coordinate_of(law: str) -> str:
    """What a force with this law acts along: a coordinate of `responses`, or the law's own name."""
    kind, _, rest = law.partition("|")
    return rest.partition("|")[0] if kind == responses.WORD else kind


def coarse_histories(
    system: System, step: float, steps: int, whole: Collection[int]
) -> Iterator[tuple[int, float]]:
    """Numbers of the signals that are too far off, and the share that is missed."""
    known = [k for k, signal in enumerate(system.signals) if not read_inputs(signal)]
    size, missed = integrals(
        lambda times: signal_table(system, times.ravel())[:, known], step, steps, whole
    )
    for k in np.flatnonzero(missed > MISSED * size):
        yield known[k], missed[k] / size[k]


def coarse_forces(
    motion: Trajectory, plain: System, step: float, steps: int, whole: Collection[int]
) -> Iterator[tuple[str, float]]:
    """The same of forces that read histories by a law of one's own.

    |S| is at least what it is with the state of the start: of a force that follows a history little is left in the motion. That is
    looked at where the motion alone does not clear a force.
    """
    for found in (
        one for one in plain.loads.forces if isinstance(one, LawForces) and one.law.maker
    ):
        for rows, numbers, signals in zip(found.rows, found.numbers, found.signals, strict=True):
            read = [plain.signals[k] for k in signals if k >= 0]
            size = 0.0
            missed = 0.0
            if not len(rows) or not read or any(read_inputs(one) for one in read):
                continue
            for moves in (True, False):
                summed, off = integrals(
                    pushes(motion, found.law, rows, numbers, signals, moves), step, steps, whole
                )
                size, missed = max(size, summed.max()), max(missed, off.max())
                if missed <= MISSED * size:
                    break
            else:
                yield pushed_body(plain, int(rows[0])), missed / size


def pushes(
    motion: Trajectory,
    law: ForceLaw,
    rows: np.ndarray,
    numbers: np.ndarray,
    signals: np.ndarray,
    moves: bool,
) -> Callable[[np.ndarray], np.ndarray]:
    """Forces (s i, r) by times (s, i) in s steps, with the state of the middle of a step, or of the
    start where nothing `moves`.
    """
    system = motion.system
    matrix = csr_array(system.probes.matrix)[rows]
    states = (matrix @ motion.x.T).T + system.probes.offset[rows], (matrix @ motion.v.T).T

    def pushed(times: np.ndarray) -> np.ndarray:
        middle = times.mean(axis=1)
        (steps, count) = times.shape
        table = signal_table(system, times.ravel())
        histories = np.where(signals < 0, 1.0, table[:, signals])
        many = np.repeat(numbers[None], steps * count, axis=0)
        if moves:
            between = (
                np.stack([np.interp(middle, motion.times, row) for row in part.T], axis=1)
                for part in states
            )
            y, rates = (np.repeat(part, count, axis=0) for part in between)
        else:
            y, rates = (np.repeat(part[:1], steps * count, axis=0) for part in states)
        return evaluate(law, y, rates, many, histories)

    return pushed


def integrals(
    values: Callable[[np.ndarray], np.ndarray], step: float, steps: int, whole: Collection[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Integrals S of functions of times (s, i) in s steps with values (s i, k), and how far those
    of straight lines are off.

        max |S|,    max |S - S_h|    (k,) each

    Zero for the latter where a function has only BRIEF steps since it began, in which it stays
    between the ends of its steps. Steps with the numbers `whole` miss nothing.
    """
    inside = np.array([0.0, *(np.arange(INSIDE) + 0.5) / INSIDE, 1.0])
    carried = np.zeros(1)
    size = np.zeros(1)
    missed = np.zeros(1)
    began = np.array([steps])
    most, beyond = np.zeros(1), np.zeros(1)
    for first in range(0, steps, AT_ONCE):
        numbers = np.arange(first, min(first + AT_ONCE, steps))
        times = step * (numbers[:, None] + inside)
        with np.errstate(all="ignore"):
            found = values(times).reshape(*times.shape, -1)
            found = np.where(np.isfinite(found), found, 0.0)
            means = np.stack([found[:, 1:-1].mean(axis=1), 0.5 * (found[:, 0] + found[:, -1])])
            means[1] = np.where(np.isin(numbers, list(whole))[:, None], *means)
            sums = carried + np.cumsum(means, axis=1)
        carried = sums[:, -1:]
        size = np.maximum(size, np.abs(sums).max(axis=(0, 1)))
        missed = np.maximum(missed, np.abs(sums[1] - sums[0]).max(axis=0))
        began = np.minimum(
            began, np.where((found != 0.0).any(axis=1), numbers[:, None], steps).min(axis=0)
        )
        low, high = (
            choose(found[:, 0], found[:, -1])[:, None] for choose in (np.minimum, np.maximum)
        )
        most = np.maximum(most, np.abs(found).max(axis=(0, 1)))
        beyond = np.maximum(beyond, np.maximum(low - found, found - high).max(axis=(0, 1)))
    return size, np.where((steps - began <= BRIEF) & (beyond <= UNSEEN * most), 0.0, missed)
