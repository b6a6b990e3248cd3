"""A step of a run as integers, packed once, and with its parts once one of them is wanted.

Packing finds some hundred addresses, which takes as long as twenty small steps. Calls put what
differs into the integers: signals and rows of the trajectory, and for what events leave of a step
the method of another span.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.compiling.structs import Callback, Routine, address_of, packed, place_of
from ...core.errors import SolverError
from ...core.notices import notify
from ...systems.compiled import Compiled
from ...systems.system import driven_rows
from ..histories import leading_signals
from ..scheme import OF_LENGTH, allowed_change, coefficients
from . import parts, stepping, touching
from .impulses import Impulse
from .large import Large
from .step import (
    JOB,
    LEAP,
    LEAPT,
    LENGTH,
    NOW,
    NUMBER,
    NUMBERS,
    TAKEN,
    Doors,
    JobStart,
    Kept,
    Levels,
    Method,
    State,
    Step,
)
from .touching import HALVINGS, TRIALS

#: doors of `stepping` behind which large models keep their factors
BEHIND = (
    "factorise",
    "solve",
    "settle",
)
NONE = np.zeros(0, np.int64)
UNSTORED = np.array([-1])  #: rows of a step whose state is not stored


class PackedStep:
    """A step at an address; `signals` and `rows` of its job are those of the last call."""

    def __init__(self, model: Compiled, step: Step, large: Large | None) -> None:
        self.model, self.step = model, step
        self.begin = 0.0  #: of the first step of a call [s]
        self.doors = large.doors(step) if large else ()
        behind = {
            name: door.address
            for name, door in zip(BEHIND, self.doors, strict=False)
            if getattr(step.doors, name)
        }
        self.table = packed(step._replace(doors=step.doors._replace(**behind)))
        self.address = address_of(self.table)
        self.given = (step.job.signals, step.job.rows)
        self.impulse: Impulse | None = None  #: where a motion changes at once, as few do
        self.beside = 0  #: its address
        #: of parts; few runs need them, and they take as long as ten small steps
        self.lengths = Lengths(self) if step.method.local else None

    def advance(self, signals: np.ndarray, rows: np.ndarray, begin: float) -> int:
        """Take a step for every row of `signals`, from a time `begin` [s] on, to be stored in
        `rows` of the trajectory; the status.

        The job has the number of steps that were taken; it may be smaller although none failed.
        """
        self.give(signals, rows)
        self.start(begin)
        done = self.step.job.done
        status = self.call(stepping.advance)
        if status == stepping.DONE or self.lengths is not None:
            return status
        # the first step that fails: those behind it find its parts
        self.lengths = Lengths(self)
        if (status := self.call(stepping.retake, status)) != stepping.DONE:
            return status
        if rows[done[0]] >= 0:
            stepping.keep(self.step, rows[done[0]])
        done[0] += 1
        return self.call(stepping.advance)

    def repeat(self, number: int, many: int) -> int:
        """Take steps from the one of a number in the run on, each with the row of signals that was
        given last; the status, and their number in the job.
        """
        self.start(self.step.method.h * number)
        return self.go_on(self.call(stepping.repeat, many), number, many)

    def go_on(self, status: int, number: int, many: int) -> int:
        """Go on where `stepping.repeat` has ended with a status: with the first step that failed,
        in parts; the status.
        """
        if status == stepping.DONE or self.lengths is not None:
            return status
        done = self.step.job.done
        taken = int(done[0])
        self.start(self.step.method.h * (number + taken))
        self.lengths = Lengths(self)
        if (status := self.call(stepping.retake, status)) == stepping.DONE:
            taken += 1
            if taken < many:
                status = self.repeat(number + taken, many - taken)
                taken += int(done[0])
        done[0] = taken
        return status

    def start(self, begin: float) -> None:
        """Steps of the run from a time on [s] are what is taken next."""
        self.begin = begin
        if self.lengths is not None:
            self.lengths.give(begin, self.step.method.h)
        self.step.job.done[0] = 0

    def take_span(self, begin: float, span: float) -> int:
        """Take a span of time [s] at once, in parts, or from touch to touch, as a piece of a step:
        nothing is stored; the status.
        """
        self.place(begin, span)
        status = self.call(touching.take_span)
        return self.call(touching.take) if status == stepping.TOUCHES else status

    def take_series(self, begin: float, span: float) -> int:
        """Go on from a time for a span [s] by a series; the status."""
        self.place(begin, span)
        return self.call(touching.take_series)

    def place(self, begin: float, span: float) -> None:
        """A piece of a step is what is taken next, from a time for a span [s]."""
        if self.lengths is None:
            self.lengths = Lengths(self)
        self.lengths.spans[JOB], self.lengths.found[NUMBER] = (begin, span), -1
        self.step.job.done[0] = 0

    def divide(self, status: int) -> int:
        """Take the step that failed with a status in parts; the status."""
        if self.lengths is None:
            self.lengths = Lengths(self)
        return self.call(parts.divide, status)

    def give(self, signals: np.ndarray, rows: np.ndarray) -> None:
        """What the next calls take: a row of signals for every step, and where its state is stored."""
        if self.given[0] is not signals or self.given[1] is not rows:
            put(self.table, JOB_PLACE, packed(JobStart(signals, rows)))
            # the integers hold no array
            self.given = signals, rows

    def put_beside(self, impulse: Impulse) -> None:
        """Keep what the step needs where its motion changes at once."""
        self.impulse, self.integers = impulse, packed(impulse)
        self.beside = address_of(self.integers)

    def call(self, routine: Routine, more: int = 0) -> int:
        """What a routine of `stepping` returns for what was given; a warning where the shortest
        parts go through what touches.
        """
        status = int(routine.call(self.address, more))
        if status != stepping.DONE:
            self.check()
        if self.lengths is not None and self.lengths.found[LEAP] >= 0:
            self.lengths.warn_of_leaps()
        return status

    def check(self) -> None:
        """Raise what went wrong in functions of Python."""
        self.model.check()
        for name, door in zip(BEHIND, self.doors, strict=False):
            try:
                door.check()
            except SolverError:
                if name != "factorise":  # whose status says that there are no factors
                    raise
        if self.lengths is not None:
            self.lengths.check()

    @property
    def reached(self) -> float:
        """How far the last trial of a step that failed has come [s]."""
        assert self.lengths is not None
        found, broken = self.lengths.found, self.lengths.broken
        if broken is not None and found[TAKEN] == found[NUMBERS]:
            return broken.time
        return self.time_of(int(found[TAKEN]) / 2**HALVINGS)

    def time_of(self, place: float) -> float:
        """Of a place in the step that was taken last, 0 to 1 [s]."""
        assert self.lengths is not None
        begin, span = self.lengths.spans[NOW].tolist()
        return float(begin + span * place)


class Lengths:
    """The step of a run in all lengths of its parts, and what `Levels` has addresses of."""

    def __init__(self, whole: PackedStep) -> None:
        self.whole = whole.step.method
        self.system = whole.model.system
        state = whole.step.state
        count = len(self.system.signals) * (4 if driven_rows(self.system.constraints).any() else 1)
        self.signals = np.zeros((2**HALVINGS, count))  #: of all trials, one at a time
        self.broken: SolverError | None = None  #: why the histories of the last trial end before it
        self.before = Copy(state)
        self.held = Copy(state) if self.whole.locating else None
        self.doors = Callback(self.find_signals), Callback(self.set_span)
        self.tables = np.empty((len(TRIALS), len(whole.table)), np.int64)
        self.levels = Levels(
            tables=addresses(list(self.tables)),
            halvings=np.array([halvings for halvings, _ in TRIALS]),
            kept=self.before.addresses,
            before=address_of(self.before.packed),
            held=NONE if self.held is None else self.held.addresses,
            histories=self.doors[0].address if count else 0,
            set_span=self.doors[1].address,
            jump=stepping.jump.address if self.held else 0,
            spans=np.zeros((3, 2)),
            found=np.array([0, 0, -1, 0, -1]),
        )
        self.spans, self.found = self.levels.spans, self.levels.found
        whole.table[DIVIDE] = parts.divide.address
        whole.table[TOUCH] = touching.take.address if self.held else 0
        put(whole.table, LEVELS, packed(self.levels))
        # steps of all lengths are alike but for what is put into them below
        self.tables[:] = whole.table
        for table, (halvings, judging) in zip(self.tables, TRIALS, strict=True):
            put(table, JOB_PLACE, packed(JobStart(self.signals[: 2**halvings], NONE)))
            table[JUDGING], table[AGAIN] = judging, False
        self.give(whole.begin, self.whole.h)

    def give(self, begin: float, h: float) -> None:
        """Steps of a length [s], from a time on [s], are what is taken next."""
        same = self.spans[JOB, LENGTH] == h
        self.spans[JOB], self.found[NUMBER] = (begin, h), round(begin / h)
        if not same:
            self.set_span(0, 0)

    def set_span(self, _: int, __: int) -> None:
        """Coefficients of all parts of the span JOB."""
        # all lengths at once, and what differs alone: touches take some spans each
        h = self.spans[JOB, LENGTH] / 2.0**self.levels.halvings
        for place, each in zip(PLACES, coefficients(self.whole, h), strict=True):
            self.tables[:, place] = each.view(np.int64)
        if self.whole.locating:
            self.tables[:, ALLOWED] = allowed_change(h, self.whole.h).view(np.int64)

    def find_signals(self, _: int, count: int) -> None:
        """Signals at the ends of so many parts of the span NOW, or at its begin."""
        begin, span = self.spans[NOW].tolist()
        places = (np.arange(count) + 1) / count if count else np.zeros(1)
        found, self.broken = leading_signals(
            self.system, begin + span * places, span / max(count, 1)
        )
        self.signals[: len(found)], self.found[NUMBERS] = found, len(found)

    def check(self) -> None:
        """Raise what went wrong in histories."""
        for door in self.doors:
            door.check()

    def warn_of_leaps(self) -> None:
        """A warning where the shortest step is too long for what touches."""
        begin, span = self.spans[LEAPT].tolist()
        h = span / 2 ** int(self.found[LEAP])
        self.found[LEAP] = -1
        where = f"what touches went through to the other side between t = {begin:.6g} and {begin + span:.6g} s"
        why = "it moves too fast, or is pressed in by more than half of what is thin"
        notify(
            f"{where}, even in steps of {h:.3g} s: {why}; take a smaller step, or more stiffness"
        )


class Copy:
    """Room for a copy of a state."""

    def __init__(self, state: State) -> None:
        self.state = State(*(part.copy() for part in state))
        pairs = [
            (part.view(np.int64).reshape(-1) for part in pair)
            for pair in zip(state, self.state, strict=True)
        ]
        self.kept, self.packed = [packed(Kept(*pair)) for pair in pairs], packed(self.state)
        self.addresses = addresses(self.kept)


def put(table: np.ndarray, first: int, integers: np.ndarray) -> None:
    """Replace some integers of a packed struct."""
    table[first : first + len(integers)] = integers


def addresses(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Where the numbers of arrays are, (k,)."""
    return np.array([address_of(one) for one in arrays], np.int64)


METHOD, JOB_PLACE, LEVELS = (place_of(Step, name) for name in ("method", "job", "levels"))
DIVIDE, TOUCH = (place_of(Step, "doors") + place_of(Doors, name) for name in ("divide", "touch"))
JUDGING, AGAIN, ALLOWED = (
    METHOD + place_of(Method, name) for name in ("judging", "again", "allowed")
)
PLACES = [METHOD + place_of(Method, name) for name in OF_LENGTH]
