"""What is asked of a motion is read while it runs, block by block, and its states go, but for a
few.

    states of a block  ->  sensor rows, energies, reactions and forces that outputs ask for, sizes of the motion  ->  Trace
                       ->  states that are kept: the first, some evenly spread, the last, and that before the energy rises

6000 steps of 1206 unknowns keep 2 MB, and a block of 6, in place of 174. What looks at the states
of a motion that has ended has all of them kept, see `Observer.reads_states`. Every row of a trace
is that of its state alone, so that blocks may begin anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from ..core.algebra.linalg import evenly
from ..core.storage.records import dataclass
from ..systems.compiled import Compiled
from ..systems.measures.probes import calls_of
from ..systems.system import System, sizes
from .outputs import (
    fastest,
    lost,
    pushes,
    reactions,
    read_sensors,
    rest_of,
    rows_read,
    survey,
    survey_of,
)
from .scheme import GeneralizedAlpha, acceleration_noise
from .trajectory import OF_STATES, Trace, Trajectory, joined_traces

#: numbers of x in a block, 2 MB, and the fewest and most states: with a quarter calls cost 5 % of a
#: run, four times as many are not faster
BLOCK = 2**18
FEWEST = 8
MOST = 4096
FEW = 40  #: states that are kept where only those are asked for that are looked at when a motion has ended
SOUND = 0.05  #: rise of the energy balance over the known energy up to which a state is believed, see `diagnoses.stability`
#: size of accelerations over their noise by round-off, from which a motion is clear of it
CLEAR = 1e3


@dataclass
class Rise:
    """Finds where the energy balance of a motion rises, part by part as its trace is read."""

    start: float | None = None  #: the balance then [J]
    known: float = 0.0  #: T(0) + U(0) [J]
    potential: float = 0.0  #: max |V| so far [J]
    work: float = 0.0  #: max |W|
    sound: int | None = None  #: number of the last state before it rises, once it does

    def find(self, part: Trajectory, first: int, end: float) -> None:
        """Look at a part, of which the first state has this number, of a motion up to `end` [s];
        see `last_sound`.
        """
        if self.sound is not None or part.work is None or not np.isfinite(part.work).all():
            return
        stored, _ = survey_of(part)
        rise = self.over_known(
            stored,
            part.work,
            stored.sum(axis=1) - part.work + lost(part),
            rest_of(part.system, end),
        )
        wrong = np.flatnonzero(rise > SOUND)
        if len(wrong):
            self.sound = max(first + int(wrong[0]) - 1, 0)

    def over_known(
        self,
        stored: np.ndarray,
        work: np.ndarray,
        balance: np.ndarray,
        rest: float,
        doubt: np.ndarray | float = 0.0,
    ) -> np.ndarray:
        """Rise of the balance of a part (s,) over the known energy, with that of the parts before,
        not less than `rest`.

        Of `stored` (s, 3), `work`, `balance` and the `doubt` about them (s,) [J], see
        `outputs.Balance`; infinite where it is no number.
        """
        if self.start is None:
            self.start, self.known = float(balance[0]), float(stored[0, :2].sum())
        potential = np.maximum(np.maximum.accumulate(np.abs(stored[:, 2])), self.potential)
        largest = np.maximum(np.maximum.accumulate(np.abs(work)), self.work)
        self.potential, self.work = float(potential[-1]), float(largest[-1])
        with np.errstate(all="ignore"):
            found = (balance - self.start - doubt) / np.maximum(
                self.known + potential + largest, max(rest, 1e-300)
            )
        return np.where(np.isfinite(found), found, np.inf)


@dataclass
class Tracer:
    """Reads the states of a run."""

    chosen: np.ndarray  #: (c,) numbers of the stored states that are kept
    end: float  #: of the run [s]
    noise: float  #: of accelerations by round-off [m/s2]
    parts: list[Trajectory] = field(default_factory=list)  #: what was read
    last: Trajectory | None = None  #: the last state of these
    start: np.ndarray = field(default_factory=lambda: np.empty(0))  #: x of the first
    rise: Rise = field(default_factory=Rise)
    clear: bool = False  #: whether the motion was clear of its noise

    def take(self, model: Compiled, block: Trajectory, first: int) -> None:
        """Read a block of states, of which the first has this number, and keep few of them."""
        self.begin(block)
        found = self.read(model, block, first, self.rise)
        self.parts.append(found)
        self.last = block.part(np.array([-1]))
        self.clear = self.clear or self.is_clear(found)

    def begin(self, block: Trajectory) -> None:
        """The first state."""
        if self.last is None:
            self.start = block.x[0].copy()

    def go_on(self, motion: Trajectory) -> None:
        """Go on from what was read before."""
        self.parts, self.start, self.last = (
            [motion],
            motion.x[0].copy(),
            motion.states.part(np.array([-1])),
        )
        self.rise.find(motion, 0, self.end)
        self.clear = self.is_clear(motion)

    def is_clear(self, part: Trajectory) -> bool:
        """Whether accelerations of what was read are clear of their noise."""
        assert part.trace is not None
        return float(part.trace.sizes[:, 1].max()) > CLEAR * self.noise

    def motion(self, model: Compiled, block: Trajectory, first: int) -> Trajectory:
        """The motion up to the end of a block that is not taken, with the states that are to be
        kept, and the last one.
        """
        count = first + len(block.times)
        rise = replace(self.rise)
        parts = list[Trajectory]()
        if len(block.times):
            self.begin(block)
            parts.append(self.read(model, block, first, rise, last=True))
        found = joined_parts([*self.parts, *parts], block)
        wanted = np.isin(
            np.asarray(found.kept),
            [*self.chosen, count - 1, *([] if rise.sound is None else [rise.sound])],
        )
        return with_states(found, np.flatnonzero(wanted))

    def read(
        self, model: Compiled, block: Trajectory, first: int, rise: Rise, last: bool = False
    ) -> Trajectory:
        """A block with what was read of it and few of its states."""
        # of the arrays of the run
        read = replace(block, trace=self.trace(model, block), work=np.array(block.work))
        rise.find(read, first, self.end)
        wanted = [
            *self.chosen,
            *([first + len(block.times) - 1] if last else []),
            *([] if rise.sound is None else [rise.sound]),
        ]
        if rise.sound == first - 1 and self.last is not None:
            self.parts[-1] = with_last(self.parts[-1], self.last)
        numbers = np.flatnonzero(np.isin(first + np.arange(len(block.times)), wanted))
        return with_states(replace(read, kept=np.arange(len(block.times))), numbers)

    def width(self, system: System) -> int:
        """How many numbers are read of a state."""
        found = 3 * len(rows_read(system)) + 7
        calls = calls_of(system.outputs)
        found += len((system.full or system).constraints.names) if "reactions" in calls else 0
        return found + (len(system.probes.offset) if "pushes" in calls else 0)

    def trace(self, model: Compiled, block: Trajectory) -> Trace:
        """What is read of a block."""
        system = model.system
        calls = calls_of(model.system.outputs)
        none = np.zeros((len(block.times), 0))
        forces = (
            np.column_stack([none, *reactions(block).values()]) if "reactions" in calls else none
        )
        pushed = pushes(block) if "pushes" in calls else none
        found = survey(model, block, self.start, self.end)
        return Trace(*read_sensors(block), found, self.sizes(system, block), forces, pushed)

    def sizes(self, system: System, block: Trajectory) -> np.ndarray:
        """As `outputs.sizes_of`; of a motion that is clear of its noise, velocities alone: others
        would take 12 % of a run.
        """
        found = np.column_stack([fastest(block.v), np.zeros((len(block.times), 2))])
        if not self.clear:
            before = block.part(slice(0, 1)) if self.last is None else self.last
            v = np.concatenate([before.v, block.v])
            times = np.append(before.times, block.times)
            with np.errstate(invalid="ignore"):  # the first state has none before it
                changes = sizes(system, np.nan_to_num(np.diff(v, axis=0) / np.diff(times)[:, None]))
            found[:, 1], found[:, 2] = changes, sizes(system, block.x - self.start)
        return found


def with_states(part: Trajectory, rows: np.ndarray) -> Trajectory:
    """A motion with some of the states that it has, by their rows (k,)."""
    columns: dict[str, Any] = {name: getattr(part, name)[rows] for name in OF_STATES}
    return replace(part, kept=np.asarray(part.kept)[rows], **columns)


def with_last(part: Trajectory, last: Trajectory) -> Trajectory:
    """What was read of a block, with its last state."""
    end = len(part.times) - 1
    if end in np.asarray(part.kept):
        return part
    more: dict[str, Any] = {
        name: np.concatenate([getattr(one, name) for one in (part, last)]) for name in OF_STATES
    }
    return replace(part, kept=np.append(np.asarray(part.kept), end), **more)


def joined_parts(parts: Sequence[Trajectory], like: Trajectory) -> Trajectory:
    """What was read, behind each other; system, events and cost are those of `like`."""
    starts = np.cumsum([0, *(len(part.times) for part in parts)])
    names = ("times", "work", *OF_STATES)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in names
    }
    kept = np.concatenate(
        [np.asarray(part.kept) + first for part, first in zip(parts, starts, strict=False)]
    )
    return replace(
        like,
        kept=kept,
        trace=joined_traces([part.trace for part in parts if part.trace is not None]),
        **columns,
    )


def tracer_of(
    model: Compiled, scheme: GeneralizedAlpha, steps: int, stored: int, states: int
) -> tuple[Tracer, int]:
    """What reads a run that keeps so many of its stored states, and how many it reads at a time."""
    block = min(max(BLOCK // max(model.system.size, 1), FEWEST), MOST, stored)
    return Tracer(
        evenly(0, stored - 1, states), scheme.step * steps, acceleration_noise(scheme, model.system)
    ), block
