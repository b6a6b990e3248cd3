"""A step of a run as integers, packed once, and with its parts once one of them is wanted.

Packing finds some hundred addresses, which takes as long as twenty small steps. Calls put what
differs into the integers: signals and rows of the trajectory, and for what events leave of a step
the method of another span.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...core.compiling.structs import Callback, Routine, address_of, packed, place_of
from ...core.errors import SolverError
from ...core.notices import notify
from ...systems.compiled import Compiled
from ...systems.system import driven_rows
from ..histories import leading_signals
from ..scheme import allowed_change, of_length
from . import parts, stepping, touching
from .large import Large
from .step import LEAP, LENGTH, NUMBERS, TAKEN, Doors, JobStart, Kept, Levels, Method, State, Step
from .touching import HALVINGS, TRIALS

#: doors of `stepping` behind which large models keep their factors
BEHIND = (
    "factorise",
    "solve",
    "settle",
)
NONE = np.zeros(0, np.int64)


class PackedStep:
    """A step at an address; `signals` and `rows` of its job are those of the last call."""

    def __init__(self, model: Compiled, step: Step, large: Large | None) -> None:
        self.model, self.step = model, step
        self.begin = 0.0
        self.span = step.method.h  #: of the first step of a call, and the length of each [s]
        self.number: int | None = 0  #: of this step in the run; None for a piece of one
        self.doors = large.doors(step) if large else ()
        behind = {
            name: door.address
            for name, door in zip(BEHIND, self.doors, strict=False)
            if getattr(step.doors, name)
        }
        self.table = packed(step._replace(doors=step.doors._replace(**behind)))
        self.address = address_of(self.table)
        self.given = (step.job.signals, step.job.rows)
        #: of parts; few runs need them, and they take as long as ten small steps
        self.lengths = Lengths(self) if step.method.local else None

    def advance(self, signals: np.ndarray, rows: np.ndarray, begin: float) -> int:
        """Take a step for every row of `signals`, from a time `begin` [s] on, to be stored in
        `rows` of the trajectory; the status.

        The job has the number of steps that were taken; it may be smaller although none failed.
        """
        self.give(signals, rows)
        if self.lengths is not None and self.span != self.step.method.h:
            self.lengths.set_span(self.step.method.h)
        self.begin, self.span, self.number = (
            begin,
            self.step.method.h,
            round(begin / self.step.method.h),
        )
        done = self.step.job.done
        done[0] = 0
        while (status := self.call(stepping.advance)) != stepping.DONE:
            if status != stepping.TOUCHES and self.lengths is None:
                status = self.divide(status)
            # of what fails as well: an iteration finds no solution where a damped force jumps
            if status not in (stepping.DONE, stepping.STOPPED) and self.step.method.locating:
                status = self.take_touching()
            if status != stepping.DONE:
                return status
            if rows[done[0]] >= 0:
                stepping.keep(self.step, rows[done[0]])
            done[0] += 1
        return status

    def take_touching(self) -> int:
        """Take the step of a call in which something touches; the status."""
        number = self.number
        begin = self.begin
        row = int(self.step.job.done[0])
        whole = self.span
        status = touching.take(self, self.begin_of(row), whole)
        self.number, self.begin, self.span, self.step.job.done[0] = number, begin, whole, row
        self.set_span(whole)
        return status

    def take_span(self, begin: float, span: float) -> int:
        """Take a span of time [s] at once, or in parts, as a piece of a step: nothing is stored;
        the status.
        """
        status = self.try_span(begin, span)
        return touching.take(self, begin, span) if status == stepping.TOUCHES else status

    def try_span(self, begin: float, span: float, halvings: int = 0) -> int:
        """The same, in so many halvings or more, or TOUCHES where something touches in it."""
        self.begin = begin
        self.span = span
        self.number = None
        self.step.job.done[0] = 0
        self.set_span(span)
        # halvings of a state are those of whole steps
        parts = self.step.state.parts
        before = int(parts[0])
        shorter = max(0, math.floor(math.log2(self.step.method.h / span)))
        parts[0] = max(
            before - shorter if self.step.method.local else 0, min(halvings, HALVINGS - 1)
        )
        status = self.divide(stepping.DONE)
        if status != stepping.DONE:
            parts[0] = before
        elif parts[0] > 0:
            parts[0] = min(parts[0] + shorter, HALVINGS - 1)
        return status

    def locate(self, wanted: bool) -> None:
        """Whether steps end where something touches in them."""
        self.table[LOCATING] = wanted
        if self.lengths is not None:
            self.lengths.tables[:, LOCATING] = wanted

    def set_span(self, span: float) -> None:
        """Parts of a step of this length [s], where there are parts."""
        if self.lengths is not None:
            self.lengths.set_span(span)

    def divide(self, status: int) -> int:
        """Take the step that failed with a status in parts; the status."""
        if self.lengths is None:
            self.lengths = Lengths(self)
        return self.call(parts.divide, status)

    def give(self, signals: np.ndarray, rows: np.ndarray) -> None:
        """What the next calls take: a row of signals for every step, and where its state is stored."""
        if self.given[0] is not signals or self.given[1] is not rows:
            put(self.table, JOB, packed(JobStart(signals, rows)))
            # the integers hold no array
            self.given = signals, rows

    def call(self, routine: Routine, more: int = 0) -> int:
        """What a routine of `stepping` returns for what was given; a warning where the shortest
        parts go through what touches.
        """
        status = int(routine.call(self.address, more))
        if status != stepping.DONE:
            self.check()
        if self.lengths is not None and self.lengths.found[LEAP] >= 0:
            self.warn_of_leaps(self.lengths.found)
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
            self.lengths.door.check()

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
        return self.begin_of(int(self.step.job.done[0])) + self.span * place

    def begin_of(self, row: int) -> float:
        """When a step of a call begins [s], to the bit the same in whatever call it is."""
        return self.begin if self.number is None else self.span * (self.number + row)

    def warn_of_leaps(self, found: np.ndarray) -> None:
        """A warning where the shortest step is too long for what touches."""
        begin = self.begin_of(int(found[LEAP]))
        h = self.span / 2 ** int(found[LENGTH])
        found[LEAP] = -1
        where = f"what touches went through to the other side between t = {begin:.6g} and {begin + self.span:.6g} s"
        why = "it moves too fast, or is pressed in by more than half of what is thin"
        notify(
            f"{where}, even in steps of {h:.3g} s: {why}; take a smaller step, or more stiffness"
        )


class Lengths:
    """The step of a run in all lengths of its parts, and what `Levels` has addresses of."""

    def __init__(self, whole: PackedStep) -> None:
        self.whole = whole
        self.system = whole.model.system
        state = whole.step.state
        count = len(self.system.signals) * (4 if driven_rows(self.system.constraints).any() else 1)
        self.signals = np.zeros((2**HALVINGS, count))  #: of all trials, one at a time
        self.broken: SolverError | None = None  #: why the histories of the last trial end before it
        self.before = State(*(part.copy() for part in state))
        pairs = [
            (part.view(np.int64).reshape(-1) for part in pair)
            for pair in zip(state, self.before, strict=True)
        ]
        self.kept, self.copy = [packed(Kept(*pair)) for pair in pairs], packed(self.before)
        self.door = Callback(self.find_signals)
        self.found = np.array([0, 0, -1, 0, 0])
        self.tables = np.tile(whole.table, (len(TRIALS), 1))
        self.addresses = (
            addresses(list(self.tables)),
            np.array([halvings for halvings, _ in TRIALS]),
            addresses(self.kept),
        )
        histories = self.door.address if count else 0
        whole.table[DIVIDE] = parts.divide.address
        levels = packed(Levels(*self.addresses, address_of(self.copy), histories, self.found))
        for table in (whole.table, *self.tables):
            put(table, LEVELS, levels)
        for table, (halvings, judging) in zip(self.tables, TRIALS, strict=True):
            put(table, JOB, packed(JobStart(self.signals[: 2**halvings], NONE)))
            table[JUDGING], table[AGAIN] = judging, False
        self.set_span(whole.span)

    def set_span(self, span: float) -> None:
        """Parts of a step of this length [s]."""
        # all lengths at once, and what differs alone: touches take some spans each
        whole = self.whole.step.method
        h = span / 2.0 ** self.addresses[1]
        each = of_length(whole, h)
        for name, place in OF_LENGTH:
            self.tables[:, place] = getattr(each, name).view(np.int64)
        if whole.locating:
            self.tables[:, ALLOWED] = allowed_change(h, whole.h).view(np.int64)

    def find_signals(self, _: int, place: int) -> None:
        """Signals at the ends of all parts of a trial in a row of the job."""
        row, trial = divmod(place, len(TRIALS))
        count = 2 ** TRIALS[trial][0]
        begin = self.whole.begin_of(row)
        span = self.whole.span
        found, self.broken = leading_signals(
            self.system, begin + span * (np.arange(count) + 1) / count, span / count
        )
        self.signals[: len(found)], self.found[NUMBERS] = found, len(found)


def put(table: np.ndarray, first: int, integers: np.ndarray) -> None:
    """Replace some integers of a packed struct."""
    table[first : first + len(integers)] = integers


def addresses(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Where the numbers of arrays are, (k,)."""
    return np.array([address_of(one) for one in arrays], np.int64)


METHOD, JOB, LEVELS = (place_of(Step, name) for name in ("method", "job", "levels"))
DIVIDE = place_of(Step, "doors") + place_of(Doors, "divide")
JUDGING, AGAIN, ALLOWED, LOCATING = (
    METHOD + place_of(Method, name) for name in ("judging", "again", "allowed", "locating")
)
#: what differs
OF_LENGTH = [(name, METHOD + place_of(Method, name)) for name in ("h", "bh", "gh", "c", "sharp")]
