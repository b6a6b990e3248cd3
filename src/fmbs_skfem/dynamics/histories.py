"""Histories of loads and driven joints over time: their values, their names, and the error where one is no number."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import Reason, SolverError
from ..core.linalg import as_dense
from ..core.notices import notify
from ..systems import forces, responses
from ..systems.angles import DOUBT
from ..systems.compiled import Compiled, signal_table
from ..systems.force_laws import ForceLaw, LawForces, evaluate
from ..systems.signals import Cosine, Sine, read_inputs
from ..systems.system import System, driven_rows, driving
from .names import owners
from .trajectory import Trajectory

INSIDE = 4  #: instants inside of a step at which histories are looked at
MISSED = 0.05  #: of what a history gives over time, by the ends of steps alone, above which a warning is shown
#: steps from where a history begins to the end of a run, up to which it may have only begun: after n steps t^2 is missed by
#: 1 / (2 n^2), t^6 by 3.5 / n^2, however short the steps are; and how far it leaves the range of the ends of a step, of its size,
#: where they do not see it
BRIEF, UNSEEN = 10, 0.1
AT_ONCE = 10_000  #: steps
#: what a drive changes in a step, of its range and of the change in the steps beside, above which it jumps; its rate alike
LEAP = 1e-3, 10.0
ROUND_OFF = 8.0  #: in units of the last place of the largest value of a drive, which its differences have
TILT = 0.1  #: of the place of a torque out of the plane of its angle, above which a warning is shown [rad]
ROWS_OF_ANGLES = {"torque": 2, "torsion_spring": 2, "torque in space": 9}  #: of coordinates and laws about axes in space


def signal_names(system: System) -> list[str]:
    """What every signal drives: joints by name, loads by the body that they act on."""
    names: list[list[str]] = [[] for _ in system.signals]
    for row, signal in driving(system.constraints):
        names[signal].append(f"joint {system.constraints.names[row][0]}")
    for signal, row in (pushed for force in system.loads.forces for pushed in forces.histories(force)):
        names[signal].append(pushed_body(system, row))
    return [", ".join(dict.fromkeys(found)) or f"signal {k}" for k, found in enumerate(names)]


def pushed_body(system: System, row: int) -> str:
    """The load on a probe row, by the body or component that it acts on."""
    weights = np.abs(as_dense(csr_array(system.probes.matrix)[[row]])[0])
    return f"a load on {owners(system)[int(weights.argmax())]}" if weights.any() else "a load"


def leading_signals(system: System, times: np.ndarray, step: float) -> tuple[np.ndarray, SolverError | None]:
    """Signals at the ends of steps of length `step` [s] up to the first one where a value is not finite, and the error of it.

    Where constraints read signals their first three derivatives stand beside the values, (s, 4 k).
    """
    table, broken = leading_values(system, times)
    if not driven_rows(system.constraints).any():
        return table, broken
    return np.hstack([table, *derivatives(system, times[: len(table)], table, step)]), broken


def derivatives(system: System, times: np.ndarray, table: np.ndarray, step: float) -> list[np.ndarray]:
    """First three derivatives (s, k) of the cubics through the values at the ends and at two points inside of every step.

    They read the step alone, so that what a history does before and after it is left out; 0 where a value inside is not finite.
    """
    d = step / 3
    a, b, c = (signal_table(system, times - k * d) for k in (1, 2, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        first = (11 * table - 18 * a + 9 * b - 2 * c) / (6 * d)
        second = (2 * table - 5 * a + 4 * b - c) / d**2
        third = (table - 3 * a + 3 * b - c) / d**3
    return [np.where(np.isfinite(part), part, 0.0) for part in (first, second, third)]


def leading_values(system: System, times: np.ndarray) -> tuple[np.ndarray, SolverError | None]:
    """Values of all signals (s, k) at the given times up to the first one where one is not finite, and the error of it."""
    table = signal_table(system, times)
    bad = np.argwhere(~np.isfinite(table))
    if len(bad) == 0:
        return table, None
    s, time = int(bad[0, 0]), float(times[bad[0, 0]])
    broken = {name: float(value) for name, value in zip(signal_names(system), table[s], strict=True) if not np.isfinite(value)}
    listed = ", ".join(f"{name} is {value}" for name, value in broken.items())
    text = f"the history of {listed} at t = {time:.6g} s; guard it with where(...)"
    return table[:s], SolverError(text, Reason.NOT_FINITE, time, tuple(broken.items()))


def finite_signals(system: System, times: np.ndarray) -> np.ndarray:
    """Signals at the given times; a value that is not finite stops the run with its place."""
    table, broken = leading_values(system, times)
    if broken is not None:
        raise broken
    return table


def warn_of_coarse_steps(motion: Trajectory, plain: System, step: float, steps: int) -> None:
    """A warning where histories and forces by expressions of t change inside of steps [s], which read them at their ends alone.

    `plain` is the system before it was told its inputs; what reads inputs, which are held from step to step, is left out.

    The integral S(t) of a history s, for a load its impulse, is max |S - S_h| / max |S| off where S_h is that of the straight lines
    between the ends of the steps.
    """
    wrong = dict[str, float]()
    for owner, share in (*coarse_histories(plain, step, steps), *coarse_forces(motion, plain, step, steps)):
        wrong[owner] = max(wrong.get(owner, 0.0), share)
    for owner, share in wrong.items():
        text = f"{owner} changes faster than the step of {step:g} s"
        notify(f"{text}: its integral over time is wrong by up to {share:.0%}; take a smaller step")


def warn_of_drives_that_jump(plain: System, step: float, steps: int) -> None:
    """A warning where a function of time that drives a joint, or its rate, jumps from one step [s] to the next: an impulse."""
    for name, (what, t) in drives_that_jump(plain, step, steps).items():
        text = f"{name} is driven by a function{what} jumps within one step, at t = {t:.4g} s"
        notify(f"{text}: forces there are impulses that depend on the step; let it change over many steps")


def drives_that_jump(plain: System, step: float, steps: int) -> dict[str, tuple[str, float]]:
    """What is driven by functions of time that jump, or whose rates do: which of both, and when [s].

    A joint that jumps by u moves a mass with m u / h^2, and one whose rate jumps by w with m w / h, which no smaller step makes
    right. A corner between two steps shows in the second differences of both. Angles are looked at themselves, as second
    differences of their cosines vanish at every half turn.
    """
    times, driven = step * np.arange(steps + 1), {signal for _, signal in driving(plain.constraints)}
    jumps = dict[str, tuple[str, float]]()
    for k in (k for k in driven if steps > 2 and not read_inputs(plain.signals[k])):
        signal = plain.signals[k]
        values = (signal.angle if isinstance(signal, Cosine | Sine) else signal)(times) + np.zeros(len(times))
        noise = ROUND_OFF * np.finfo(float).eps * np.abs(values).max()
        changes, bends = np.abs(np.diff(values)), np.abs(np.diff(values, 2))
        for what, found, size, apart in ((" that", changes, np.ptp(values), 1), (" whose rate", bends, changes.max(), 2)):
            limit = np.maximum(LEAP[0] * size, LEAP[1] * beside(found, apart))
            for at in np.flatnonzero(found > limit + noise)[:1]:
                jumps.setdefault(signal_names(plain)[k], (what, times[at + 1]))
    return jumps


def beside(found: np.ndarray, apart: int) -> np.ndarray:
    """The larger one (s,) of the values `apart` before and behind every value (s,); near the ends the largest of three inside.

    A smooth function may vanish at the one that there is.
    """
    before, behind = np.zeros(len(found)), np.zeros(len(found))
    before[apart:], behind[:-apart] = found[:-apart], found[apart:]
    largest = np.maximum(before, behind)
    for k in range(min(apart, len(found))):
        inside = found[k + apart : k + apart + 3], found[max(len(found) - k - apart - 3, 0) : max(len(found) - k - apart, 0)]
        largest[k], largest[-1 - k] = (part.max(initial=0.0) for part in inside)
    return largest


def warn_of_jumps(model: Compiled, motion: Trajectory, step: float) -> bool:
    """A warning where the angle of a load jumps from one step [s] to the next: a slope goes through its axis, or turns too fast."""
    found = False
    if motion.memory is None or len(motion.times) < 2:
        return found
    apart = np.diff(motion.times)
    near = (apart > 0.0) & (apart < 1.5 * step)
    for source, force, held in model.remembering:
        if not isinstance(source, LawForces) or not force.turns.any():
            continue
        with np.errstate(invalid="ignore"):  # values of events may be infinite beside
            jumps = np.where(force.turns * near[:, None] > 0.0, np.abs(np.diff(motion.memory[:, held], axis=0)), 0.0)
        s, k = np.unravel_index(int(jumps.argmax()), jumps.shape)
        if jumps[s, k] > DOUBT:
            name = pushed_body(motion.system, int(source.rows[k * len(source) // len(force.memory), 0]))
            at = f"by {np.degrees(jumps[s, k]):.0f} degrees in one step, at t = {motion.times[s + 1]:.4g} s"
            why = "its place tilts into the axis there, or turns too fast"
            notify(f"the angle of {name} jumps {at}: {why}; take a smaller step, or hold the place so that it cannot tilt")
            found = True
    return found


def warn_of_tilts(motion: Trajectory) -> None:
    """A warning where the place of a torque about an axis in space tilts: the direction u whose angle it counts leaves its plane.

    The torque does the work of that angle, tau theta', so that at a tilt phi it has a part tau tan(phi) across the axis.
    """
    system, worst = motion.system, dict[int, float]()
    for source in system.loads.forces if system.dim == 3 else ():
        if isinstance(source, LawForces) and (size := ROWS_OF_ANGLES.get(coordinate_of(source.law.name))):
            for rows in source.rows[:, :size]:
                y = np.asarray(csr_array(system.probes.matrix)[rows] @ motion.x.T).T + system.probes.offset[rows]
                u, normals = y[:, :3], y[:, 3:].reshape(len(y), -1, 3)
                inside = np.linalg.norm(y if size == 2 else np.einsum("sc,skc->sk", u, normals), axis=1)
                length = 1.0 if size == 2 else np.linalg.norm(u, axis=1)
                worst[int(rows[0])] = float(np.arccos(np.clip(inside / length, 0.0, 1.0)).max())
    row = max(worst, key=worst.__getitem__, default=-1)
    if row >= 0 and worst[row] > TILT:
        tilt = f"tilts out of the plane of its angle by up to {np.degrees(worst[row]):.0f} degrees"
        across = f"the torque does the work of that angle, and has up to {np.tan(worst[row]):.0%} of itself across its axis"
        remedy = "hold the place by a revolute joint where that matters"
        notify(f"the place of {pushed_body(system, row)} {tilt}: {across}; {remedy}")


def coordinate_of(law: str) -> str:
    """What a force with this law acts along: a coordinate of `responses`, or the law's own name."""
    kind, _, rest = law.partition("|")
    return rest.partition("|")[0] if kind == responses.WORD else kind


def coarse_histories(system: System, step: float, steps: int) -> Iterator[tuple[str, float]]:
    """What is driven by histories that are too far off, and the share that is missed."""
    known = [k for k, signal in enumerate(system.signals) if not read_inputs(signal)]
    size, missed = integrals(lambda times: signal_table(system, times.ravel())[:, known], step, steps)
    for k in np.flatnonzero(missed > MISSED * size):
        yield signal_names(system)[known[k]], missed[k] / size[k]


def coarse_forces(motion: Trajectory, plain: System, step: float, steps: int) -> Iterator[tuple[str, float]]:
    """The same of forces that read histories by a law of one's own.

    |S| is at least what it is with the state of the start: of a force that follows a history little is left in the motion. That is
    looked at where the motion alone does not clear a force.
    """
    for found in (one for one in plain.loads.forces if isinstance(one, LawForces) and one.law.maker):
        for rows, numbers, signals in zip(found.rows, found.numbers, found.signals, strict=True):
            read, size, missed = [plain.signals[k] for k in signals if k >= 0], 0.0, 0.0
            if not len(rows) or not read or any(read_inputs(one) for one in read):
                continue
            for moves in (True, False):
                whole, off = integrals(pushes(motion, found.law, rows, numbers, signals, moves), step, steps)
                size, missed = max(size, whole.max()), max(missed, off.max())
                if missed <= MISSED * size:
                    break
            else:
                yield pushed_body(plain, int(rows[0])), missed / size


def pushes(
    motion: Trajectory, law: ForceLaw, rows: np.ndarray, numbers: np.ndarray, signals: np.ndarray, moves: bool
) -> Callable[[np.ndarray], np.ndarray]:
    """Forces (s i, r) by times (s, i) in s steps, with the state of the middle of a step, or of the start where nothing `moves`."""
    system = motion.system
    matrix = csr_array(system.probes.matrix)[rows]
    states = (matrix @ motion.x.T).T + system.probes.offset[rows], (matrix @ motion.v.T).T

    def pushed(times: np.ndarray) -> np.ndarray:
        middle, (steps, count), table = times.mean(axis=1), times.shape, signal_table(system, times.ravel())
        histories = np.where(signals < 0, 1.0, table[:, signals])
        many = np.repeat(numbers[None], steps * count, axis=0)
        if moves:
            between = (np.stack([np.interp(middle, motion.times, row) for row in part.T], axis=1) for part in states)
            y, rates = (np.repeat(part, count, axis=0) for part in between)
        else:
            y, rates = (np.repeat(part[:1], steps * count, axis=0) for part in states)
        return evaluate(law, y, rates, many, histories)

    return pushed


def integrals(values: Callable[[np.ndarray], np.ndarray], step: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """max |S| (k,) and max |S - S_h| (k,) of functions of times (s, i) in s steps, with values (s i, k).

    Zero for the latter where a function has only BRIEF steps since it began, in which it stays between the ends of its steps.
    """
    inside = np.array([0.0, *(np.arange(INSIDE) + 0.5) / INSIDE, 1.0])
    carried, size, missed, began = np.zeros(1), np.zeros(1), np.zeros(1), np.array([steps])
    most, beyond = np.zeros(1), np.zeros(1)
    for first in range(0, steps, AT_ONCE):
        numbers = np.arange(first, min(first + AT_ONCE, steps))
        times = step * (numbers[:, None] + inside)
        with np.errstate(all="ignore"):
            found = values(times).reshape(*times.shape, -1)
            found = np.where(np.isfinite(found), found, 0.0)
            means = np.stack([found[:, 1:-1].mean(axis=1), 0.5 * (found[:, 0] + found[:, -1])])
            sums = carried + np.cumsum(means, axis=1)
        carried = sums[:, -1:]
        size = np.maximum(size, np.abs(sums).max(axis=(0, 1)))
        missed = np.maximum(missed, np.abs(sums[1] - sums[0]).max(axis=0))
        began = np.minimum(began, np.where((found != 0.0).any(axis=1), numbers[:, None], steps).min(axis=0))
        low, high = (choose(found[:, 0], found[:, -1])[:, None] for choose in (np.minimum, np.maximum))
        most = np.maximum(most, np.abs(found).max(axis=(0, 1)))
        beyond = np.maximum(beyond, np.maximum(low - found, found - high).max(axis=(0, 1)))
    return size, np.where((steps - began <= BRIEF) & (beyond <= UNSEEN * most), 0.0, missed)
