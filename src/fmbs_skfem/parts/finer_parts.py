r"""Whether parts stand for their bodies: everything is found once more with all shapes that they
know, and held against that.

    e = max_t |y_part(t) - y_finer(t)| / range of the output,    e = |s_part| / |s_finer| - 1 of frequencies and load factors   (1)

A finer part has the next shapes of its training, those by which joints, loads and inertia bend the
body, and the strain energy at all points (`bodies.finer`): it errs by a small part of what the part
errs by, so that e is the error of the part. One rule serves motions, equilibria, live runs, modes,
buckling and linear systems: e is told where it is more than TOLD, with the training that would have
covered what was met. The finer system costs as much again as one or two runs with the parts.

Where an output jumps, as velocities do in impacts, the instants of both differ a little: within
BESIDE samples of a jump the nearest value counts.

Source: errors by a finer space: R. E. Bank, A. Weiser, Math. Comp. 44 (1985) 283-301, doi
10.1090/S0025-5718-1985-0777265-X.
"""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from ..core.errors import FmbsError
from ..core.notices import Notice, Progress, follow_up, notify, remark
from ..dynamics.observers import FoundEquilibria, Observer, RunSetting, offered, reviews
from ..dynamics.output_errors import TOLD, between, columns, common_times, largest, smallest_ranges
from ..dynamics.run import OpenRun
from ..dynamics.trajectory import Trajectory
from ..systems import finer_systems
from ..systems.assembly import eliminate
from ..systems.prepared import remembered
from ..systems.system import Elastic, System
from ..systems.terms.corotated import Corotated
from . import departures, loads_met

#: least part of the range of its output that a column counts with: a small motion across a large
#: one hardly counts
QUIET = 0.3
ROUND = 1e-6  #: part of what a mechanism of this size and mass does in its time that counts as none
JUMP = 0.2  #: change between two samples that is a jump, over the range
SUDDEN = 4.0  #: and over the changes around
BESIDE = 2  #: samples beside a jump
MORE = "take more of their `modes`"
HOLD = "hold the mechanism once against full bodies (fmbs part check)"
WHY = "they know no others (`fmbs part info` says why)"


def warn_unknown(system: System) -> None:
    """A remark of parts of which nothing can be said.

    Parts that are not to be checked (`bodies.placed`) are not named.
    """
    if names := [f"'{one.name}'" for one in departures.unknown_parts(system) if one.gather.checked]:
        remark(
            f"parts {departures.first_of(names)}: nothing can be said of shapes that they lack, as {WHY}; {HOLD}"
        )


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """Without the notices of what is done a second time.

    A context in which the notices of this package are not shown.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        yield


def finer(system: System) -> System | None:
    """The finer system of one with parts, in the same form; None where no part knows more.

    It is found once, and kept with the system. Its unknowns are more, its outputs have the same
    names.
    """
    whole = system.full or system
    make = finer_systems.maker(whole)
    if make is None:
        return None

    def made() -> System:
        with quietly():
            return make() if whole is system else eliminate(make())

    return remembered(system, "finer", made)


class HeldAgainst(Observer):
    """Holds the motion of a run against that of finer parts."""

    looks = "end"

    def __init__(self, setting: RunSetting) -> None:
        self.setting = setting

    def finish(self, run: OpenRun, motion: Trajectory) -> Trajectory:
        told = self.setting
        assert told.repeat is not None
        return hold_against(motion, told.given, told.repeat, watched=True, progress=told.progress)


def held_bodies(system: System) -> list[Elastic]:
    """Parts, and bodies of matrices that are held against more modes."""
    return [*departures.trained_parts(system), *of_matrices(system)]


def of_matrices(system: System) -> list[Elastic]:
    """Bodies of matrices that are held against more modes."""
    return [
        one for one in system.elastic if isinstance(one.gather, Corotated) and one.gather.checked
    ]


@offered
def _(setting: RunSetting) -> Iterator[Observer]:
    if setting.repeat is not None and held_bodies(setting.system):
        yield HeldAgainst(setting)


@reviews
def _(found: FoundEquilibria) -> Trajectory:
    return hold_against(
        found.motion, found.given, found.again, found.marks, progress=found.progress
    )


def hold_against(
    motion: Trajectory,
    system: System,
    again: Callable[[System, Progress | None], Trajectory],
    marks: Callable[[Trajectory], np.ndarray] | None = None,
    watched: bool = False,
    progress: Progress | None = None,
) -> Trajectory:
    """A motion, or equilibria, with the errors (1) of its outputs; a warning is shown where they
    are large.

    `again` finds those of the finer system, with its progress. States are compared at the same
    times, or at numbers `marks` (k,) of paths that have other ones. Strains that have left their
    training are told where the errors are large; where they are not known, too, unless the motion
    was `watched` for that.
    """
    try:
        warn_unknown(system)
        cpu = time.process_time()
        wall = time.perf_counter()
        other = finer(system)
        if other is None:
            departures.warn([] if watched else departures.find(motion))
            return motion
        try:
            with quietly():
                reference = again(other, follow_up(progress, "checking parts"))
        except FmbsError as error:
            notify(
                f"with the shapes that parts lack it fails ({str(error).partition(';')[0]}): their error is not known; {HOLD}"
            )
            departures.warn(departures.find(motion))
            return motion
        motion = replace(motion, part_errors=errors(reference, motion, marks))
        spent = {"cpu_s": time.process_time() - cpu, "wall_s": time.perf_counter() - wall}
        motion = replace(motion, part_check={"unknowns": other.size, **spent})
        notify(*find_doubts(motion.part_errors or {}, motion))
    except Notice as notice:
        notice.partial = motion
        raise
    return motion


def errors(
    reference: Trajectory,
    motion: Trajectory,
    marks: Callable[[Trajectory], np.ndarray] | None = None,
) -> dict[str, float]:
    """Errors (1) of all outputs by column; of the places of parts where there are none.

    `reference` is the motion with finer parts; errors that are small beside what a mechanism of
    this size and mass does are left out. With `marks` states are compared by their numbers on a
    path.
    """
    if marks is None:
        i, j = common_times("finer parts", reference.times, motion.times)
    else:
        i, j = marks(reference), marks(motion)
        if len(i) != len(j):
            i = i[[0, -1]]
            j = j[[0, -1]]
    outputs = motion.system.outputs
    if not outputs:
        return errors_of_places(reference.part(i), motion.part(j))
    mine, others = (
        {name: values[k] for name, values in columns(one).items()}
        for one, k in ((reference, i), (motion, j))
    )
    if motion.v.any():
        mine = {name: settled(values, others[name]) for name, values in mine.items()}
    found = between(mine, others, outputs, QUIET)
    least = smallest_ranges(motion.system, float(np.ptp(motion.times)), ROUND)
    for one in found.values():
        least[one.unit] = max(least.get(one.unit, 0.0), ROUND * one.range)
    return {
        name: float(one.relative)
        for name, one in found.items()
        if np.isfinite(one.relative) and one.error > TOLD * least.get(one.unit, 0.0)
    }


def settled(reference: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A column (s,) of the reference, by whatever is nearest to the other one within a few samples
    of its jumps.
    """
    change = np.abs(np.diff(reference))
    around = np.pad(change, BESIDE + 1, mode="edge")
    calm = SUDDEN * np.maximum(around[: -2 * BESIDE - 2], around[2 * BESIDE + 2 :])
    found = reference.copy()
    for at in np.flatnonzero((change > JUMP * np.ptp(reference)) & (change > calm)).tolist():
        for k in range(max(0, at - BESIDE), min(len(found), at + BESIDE + 2)):
            near = reference[max(0, k - BESIDE) : k + BESIDE + 1]
            found[k] = np.clip(other[k], near.min(), near.max())
    return found


def errors_of_places(reference: Trajectory, motion: Trajectory) -> dict[str, float]:
    """Largest distances of the places of parts from those of finer ones over the size of their
    motion, by the part.
    """
    found = {}
    for one, own in zip(reference.system.elastic, motion.system.elastic, strict=True):
        if (points := departures.shape_points(own)) is None or points.missing is None:
            continue
        rows = points.missing.rows[np.unique(points.missing.place, return_index=True)[1]]
        f, b = (
            np.einsum("jb,sbc->sjc", rows[:, : z.shape[1]], z)
            for z in (states(reference, one), states(motion, own))
        )
        moved = float(np.linalg.norm(f - f[0], axis=2).max(initial=0.0))
        apart = float(np.linalg.norm(f - b, axis=2).max(initial=0.0))
        found[f"{own.name} places"] = apart / moved if moved > ROUND * motion.system.scale else 0.0
    return found


def states(motion: Trajectory, part: Elastic) -> np.ndarray:
    """Coordinates (s, b, c) of a part in a motion."""
    lift = motion.system.lift
    columns = part.gather.columns
    q = np.asarray(lift.matrix[columns] @ motion.x.T).T + lift.offset[columns]
    return np.asarray(q.reshape(len(motion.times), -1, part.gather.dim))


def find_doubts(found: Mapping[str, float], motion: Trajectory) -> Iterator[Notice]:
    """Which outputs are off, where strains have left their training, and the training that
    covers what was met.

    `found` are the errors (1) by column; nothing where all are at most 1 %.
    """
    if not (listed := largest(found)):
        return
    departed = departures.find(motion)
    where = f"; {departures.summarise(departed)}" if departed else ""
    names = departures.first_of([f"'{one.name}'" for one in held_bodies(motion.system)])
    about = f"parts {names} do not stand for their bodies here"
    yield Notice(f"{about}, {listed} of the range{where}; {remedy(motion)}", about)


def remedy(motion: Trajectory) -> str:
    """The training that covers what parts have met, and more modes of bodies of matrices."""
    if not departures.trained_parts(motion.system):
        return MORE
    line = f"fmbs part train ... --alone {loads_met.find(motion)} --continue ..."
    return f"train on such motions ({line}), or take more of their shape functions (a smaller tolerance)"


def of_finer(system: System, again: Callable[[System], np.ndarray]) -> np.ndarray | None:
    """What `again` finds of the finer system; None where there is none.

    `again(system)` gives an array, such as frequencies (i,) [rad/s]; its notices are not shown.
    """
    other = finer(system)
    if other is None:
        return None
    with quietly():
        return again(other)


def too_high(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """How much sizes (i,) in their order are above others.

        found / wanted - 1

    Zero where a motion is free, or not found of both.

    Positive where a part is too stiff; i motions or load factors.
    """
    error = np.zeros(len(found))
    count = min(len(found), len(wanted))
    moves = (found[:count] > 0.0) & (wanted[:count] > 0.0)
    error[:count][moves] = found[:count][moves] / wanted[:count][moves] - 1.0
    return error


def by_mode(errors: np.ndarray) -> dict[str, float]:
    """Errors (i,) by the number of their mode.

    `mode 1`, `mode 2`, ..., for messages.
    """
    return {f"mode {k + 1}": error for k, error in enumerate(errors.tolist())}


def find_off(what: str, found: Mapping[str, float]) -> Iterator[str]:
    """Which values are off, by their names.

    Nothing where all errors are at most 1 %.
    """
    if listed := [
        f"{name} by {100.0 * error:+.2g} %" for name, error in found.items() if abs(error) > TOLD
    ]:
        line = "--alone --fastest .. for faster motions, --moment .. where they are clamped"
        text = f"{what} of parts are off from those of their bodies: {departures.first_of(listed)}"
        yield f"{text}; go on with their training (fmbs part train {line}), or take more of their shape functions or `modes`"
