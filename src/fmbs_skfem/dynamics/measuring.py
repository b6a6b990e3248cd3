"""Outputs of single states of a run, and what controllers and events read of them.

Angles count their turns, and potential energies, works and losses their changes, from the last
state that was kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.algebra.linalg import as_dense, narrowed, rows_at
from ..core.notices import notify
from ..systems.measures import readings
from ..systems.measures.angles import DOUBT, TURN, turns_between
from ..systems.measures.probes import Formula, kind_of
from ..systems.system import Output, System
from . import checkpoint as checkpoints
from .compiled_step import side_by_side
from .compiled_step.side_by_side import SensorReading
from .initial import balance
from .observers import Observer
from .outputs import outputs
from .trajectory import COLUMNS, Trajectory, joined

if TYPE_CHECKING:
    from .run import OpenRun


TINY = 1e-30  #: rate [rad/s] that turns nothing
TURNED = 0.25  #: change of an angle [rad] after which its turns are counted again


class Meter:
    """Columns of some outputs, or of all, state by state."""

    word = "shown"  #: before what is kept of it

    def __init__(self, names: Sequence[str] | None = None) -> None:
        self.names = names
        self.seen: tuple[Trajectory, dict[str, float]] | None = None  #: what is counted from
        self.last: tuple[Trajectory, dict[str, float]] | None = None

    def columns(self, now: Trajectory) -> dict[str, float]:
        """Columns of outputs of one instant."""
        if self.seen is None:
            # what was done before is as little known as the potential at the start
            alone = replace(now, work=None, events=())
            found = {name: float(column[0]) for name, column in outputs(alone, self.names).items()}
        else:
            before, values = self.seen
            columns = outputs(joined(before, now), self.names)
            counted = counted_columns(now.system.outputs)
            found = {
                name: float(
                    values[name] + (b - a) if name in counted and values[name] != a else b
                )  # inputs may differ before
                for name, (a, b) in columns.items()
            }
        self.last = now, found
        return dict(found)

    def keep(self) -> None:
        """Count from the last instant on."""
        self.seen = self.last

    def kept(self) -> dict[str, np.ndarray]:
        """What is to be kept of it, by name."""
        if self.seen is None:
            return {}
        motion, values = self.seen
        found = {f"{self.word} {key}": getattr(motion, key) for key in COLUMNS}
        found |= {
            f"{self.word} memory": motion.memory,
            f"{self.word} values": np.array(list(values.values())),
        }
        return found if motion.work is None else found | {f"{self.word} work": motion.work}

    def take_up(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        """Put back what was kept."""
        self.seen = self.last = None
        if f"{self.word} values" not in arrays:
            return
        now = motion_of(run, 0.0)
        kept: dict[str, Any] = {
            key: checkpoints.fitting(arrays, f"{self.word} {key}", getattr(now, key))
            for key in (*COLUMNS, "memory")
        }
        outputs = run.model.system.outputs
        names = [
            column
            for name in (outputs if self.names is None else self.names)
            for column in outputs[name].columns
        ]
        values = checkpoints.fitting(arrays, f"{self.word} values", np.zeros(len(names)))
        kept["work"] = arrays.get(f"{self.word} work")
        self.seen = replace(now, **kept), dict(zip(names, values.tolist(), strict=True))


class RowMeter:
    """Columns of outputs that are formulas of their sensor rows, state by state, as a `Meter` finds
    them; rows go to `found` (3, i).

    Rows of the present state of a run are read by a compiled product, and formulas are evaluated
    for numbers.
    """

    def __init__(
        self,
        run: OpenRun,
        known: Sequence[tuple[str, Output, Formula]],
        turns: RowMeter | None = None,
        found: np.ndarray | None = None,
    ) -> None:
        system = run.model.system
        state = run.step.state
        rows = np.array([row for _, output, _ in known for row in output.rows], dtype=np.int64)
        matrix, used = narrowed(rows_at(system.sensors.matrix, rows)[:, run.model.order])
        self.reading = SensorReading(
            x=state.x,
            v=state.v,
            acceleration=state.acceleration,
            used=np.arange(system.size)[used],
            matrix=np.ascontiguousarray(as_dense(matrix), dtype=np.float64),
            offset=system.sensors.offset[rows],
            part=np.zeros(matrix.shape[1]),
            found=np.zeros((3, len(rows))) if found is None else found,
        )
        self.packed, self.address = side_by_side.placed(self.reading)
        ends = np.cumsum([0, *(len(output.rows) for _, output, _ in known)]).tolist()
        self.known = [
            (name, output.columns, formula, slice(first, last), bool(kind_of(output).counted))
            for (name, output, formula), first, last in zip(known, ends, ends[1:], strict=False)
        ]
        self.word = f"columns of {', '.join(name for name, *_ in self.known)}:"  #: before what is kept of it
        #: by output, as it was read last: time [s], angle with its turns [rad], rate [rad/s] and
        #: acceleration [rad/s2]
        self.angles: dict[str, tuple[float, float, float, float]] = {}
        if turns is not None:
            self.angles = turns.angles  # counted from whoever has read them last
        else:
            self.columns(0.0)

    def columns(self, time: float) -> dict[str, float]:
        """Columns in the present state [s]; turns are counted from the one before."""
        side_by_side.read(self.address)
        y, rate, change = self.reading.found.tolist()
        found: dict[str, float] = {}
        for name, columns, formula, rows, counted in self.known:
            values = formula(y[rows], rate[rows], change[rows])
            if counted:
                values = self.continued(name, time, *values)
            found.update(zip(columns, values, strict=False))
        return found

    def continued(
        self, name: str, time: float, angle: float, speed: float, acceleration: float
    ) -> tuple[float, float]:
        """An angle with the turns that it has made since the state before, and its rate."""
        if (before := self.angles.get(name)) is not None:
            angle, doubt = count_turns(before, (time, angle, speed, acceleration))
            if doubt:
                warn_of_turns(name)
        self.angles[name] = time, angle, speed, acceleration
        return angle, speed

    def due(self, longest: float) -> float:
        """The time [s] by which an angle may have changed by TURNED at its rate and acceleration,
        `longest` after it was read.
        """
        return min(float(due(one, longest)) for one in self.angles.values())

    def kept(self) -> dict[str, np.ndarray]:
        """What is to be kept of it, by name."""
        return {f"{self.word} {name}": np.array(one) for name, one in self.angles.items()}

    def take_up(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Put back what was kept."""
        for name in self.angles:
            if (key := f"{self.word} {name}") in arrays:
                time, angle, speed, acceleration = checkpoints.fitting(
                    arrays, key, np.zeros(4)
                ).tolist()
                self.angles[name] = time, angle, speed, acceleration


class Reader(Meter, Observer):
    """Values that controllers and events of a run read, by number; see `systems.measures.readings`."""

    word = "read"
    looks = "end"
    reads_states = False

    def __init__(self, system: System) -> None:
        self.readings = system.readings
        super().__init__(readings.outputs_of(self.readings))
        self.checked = False

    def arrays(self, run: OpenRun) -> Mapping[str, np.ndarray]:
        return self.kept()

    def put(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        self.take_up(run, arrays)

    def read(
        self, run: OpenRun, numbers: Sequence[int], time: float, within: bool = False
    ) -> list[float]:
        """Their values in the present state, at this time [s]; `within` a step with reactions that
        are found anew.
        """
        memory = run.step.state.memory
        found = dict[str, float]()
        if any(number < 0 for number in numbers):
            found = self.columns(balanced(run, time) if within else motion_of(run, time))
            if not self.checked:
                for one in self.readings:
                    readings.require_known(one, found)
                self.checked = True

        return [self.value(run, k, memory, found) for k in numbers]

    def value(
        self, run: OpenRun, number: int, memory: np.ndarray, columns: Mapping[str, float]
    ) -> float:
        """A value of what forces keep (l,), and of columns of outputs by name."""

        def kept(k: int) -> float:
            return float(memory[run.kept_values[k]])

        return (
            kept(number)
            if number >= 0
            else readings.evaluate(self.readings[-1 - number], kept, columns)
        )

    @property
    def size(self) -> float:
        """The largest column of what was read last."""
        return max(map(abs, self.last[1].values()), default=0.0) if self.last else 0.0


def count_turns(before: Any, now: Any) -> tuple[Any, Any]:
    """An angle with the turns that it has made since it was read last, and whether these are in
    doubt.

    `before` and `now`: time [s], angle, rate and acceleration, numbers or those of many runs (p,).
    """
    (t, value, w, change), (time, angle, speed, acceleration) = before, now
    turns, off = turns_between(time - t, angle - value, (w, speed), (change, acceleration))
    return angle + TURN * turns, off > DOUBT


def warn_of_turns(name: str) -> None:
    """A warning of an output whose turns are in doubt."""
    notify(
        f"output '{name}': the angle turns too far in a step to count its turns for certain; take smaller steps"
    )


def due(angle: Any, longest: float) -> Any:
    """The time [s] by which an angle may have changed by TURNED, `longest` after it was read.

        w t + a t^2 / 2 = TURNED,    t > 0

    with the sizes of its rate w and its acceleration a; `angle` as in `count_turns`.
    """
    t, _, w, change = angle
    rate, square = abs(w), w * w + 2.0 * abs(change) * TURNED
    # numpy takes ten times as long for a number
    if isinstance(w, float):
        return t + min(2.0 * TURNED / max(rate + math.sqrt(square), TINY), longest)
    return t + np.minimum(2.0 * TURNED / np.maximum(rate + np.sqrt(square), TINY), longest)


def counted_columns(found: Mapping[str, Output]) -> set[str]:
    """Columns that count from the first state of a motion."""
    return {one.columns[k] for one in found.values() for k in kind_of(one).counted}


def motion_of(run: OpenRun, time: float) -> Trajectory:
    """The present state of a run as a trajectory of one instant [s], with the work and the events
    so far.
    """
    state = run.step.state
    back = np.argsort(run.model.order)
    x, v, a = (part[back][None] for part in (state.x, state.v, state.acceleration))
    held = state.multipliers[None] / run.step.method.c
    work = state.work[:1].copy() if np.isfinite(state.work[0]) else None
    now = np.array([time]), x, v, a, held
    return Trajectory(
        run.model.system,
        *now,
        memory=state.memory[None].copy(),
        events=tuple(run.happened),
        work=work,
    )


def balanced(run: OpenRun, time: float) -> Trajectory:
    """The same with the accelerations and reactions that balance its forces: those of a short piece
    of a step are noise.
    """
    a, multipliers = balance(run.packed, run.scheme, time)
    back = np.argsort(run.model.order)
    return replace(motion_of(run, time), a=a[back][None], multipliers=multipliers[None])
