r"""Events in a run: found by the sign of their values after every step, located within it, and what
they do to joints.

    g(t_n) g(t_n + h) < 0        t* = t_n + theta h,  g(t*) = 0  by steps of theta h;  then on from t* to t_n + h
    lock         x+ = x-,        M (v+ - v-) + Phi_q^T p = 0,  Phi_q v+ + Phi_t = 0      loses  v-^T M v- / 2 - v+^T M v+ / 2
    release                      v+ = v-

Accelerations and reactions start anew behind an event, as at the start of a run, so that all stays
of second order. Very short pieces of a step are too short for the method, whose reactions are noise
there: they follow x + h v + h^2 q'' / 2. A value that is at rest at zero, from the start on or
later, crosses it where it leaves it (`crossings`). A value that is on the same side at both ends of
a step may have been at zero or beyond it between them (`dips`). An event that has happened is on
guard again once its value is clearly not zero: neither its own action nor round-off make it happen
twice at one instant. One that is to happen once is not. A value that is no number ends the run, at
the last instant at which it is one; what crosses zero up to there happens.

Source (events by the sign of functions, and starts after them): Hairer, Norsett, Wanner, Solving
ordinary differential equations I, 2nd ed., Springer 1993, section II.6; impulses on constraints:
Brogliato, Nonsmooth Mechanics, 3rd ed., Springer 2016, section 4.2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import Reason, SolverError
from ..core.notices import notify, remark
from ..dynamics import checkpoint as checkpoints
from ..dynamics.compiled_step import stepping
from ..dynamics.compiled_step.pieces import EXACT, Unreached, last_place, take_piece
from ..dynamics.compiled_step.step import STEPS
from ..dynamics.compiled_step.touching import TINY
from ..dynamics.dividing import put
from ..dynamics.initial import balance, begin_anew
from ..dynamics.integration import failure
from ..dynamics.measuring import Reader
from ..dynamics.observers import Observer
from ..dynamics.trajectory import Gap, Happening
from ..dynamics.vanishing import empty, lengths, rows_of_locks
from ..systems.compiled import Compiled
from . import dips
from .crossings import Crossings, noise_of
from .events import gap_of, numbers_of

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun
    from ..systems.system import System

LATE = 1e-6  #: of a step after its begin where inputs of the step count
TOGETHER = 1e-8  #: of a step, within which events happen at once
HUGE = 1e100  #: values beyond it, and infinite ones, count as this: what is located is their sign
NONE = np.zeros(0, np.int64)  #: no events
STILL = 1e-6  #: of a value in its step, below which it is zero where it has just crossed zero
MANY = 100  #: events in one step
FAR = 0.02  #: distance of places that a latch locks, over the size of the mechanism, which is not meant to stay
#: in checkpoints: distances and angles, what rests at zero, values of the last two steps
GAPS, RESTS, TRAIL = "event gaps", "events at rest", "event values"


class EventObserver(Observer):
    """The events of a run.

    After every step it looks for values that have crossed zero, finds the instant, takes the step
    up to there, changes the joints, and takes the rest of it. SolverError where a piece cannot be
    taken, and where events happen again and again.
    """

    reads_states = False

    def __init__(
        self, system: System, plain: System, set_input: Callable[[Any, float], None]
    ) -> None:
        self.plain = plain  #: with the inputs of latches as signals
        self.set_input = set_input
        self.triggers = system.triggers
        self.locks = {one.joint: one for one in system.locks}
        self.parks = {one.parks: one.joint for one in system.locks if one.parks}
        self.joints = np.array([joint for joint, _ in system.constraints.names], dtype=object)
        #: rows that are to hold, whether or not others make them hold already
        self.closed = ~rows_of_locks(system)
        #: of values, and of the margins of those that are conditions behind them
        self.margins = [
            k for k, one in enumerate(self.triggers) if one.margin is not None and one.margin >= 0
        ]
        self.numbers = [one.value for one in self.triggers] + [
            int(self.triggers[k].margin or 0) for k in self.margins
        ]
        self.size = np.zeros(len(self.triggers))  #: of the values in the last step with an event
        #: which values jumped where they happened last
        self.jumps = np.zeros(len(self.triggers), dtype=bool)
        self.lately = set[int]()  #: events that have happened in the present step
        self.idle = set[str]()  #: remarks on what changes nothing, each made once
        self.trail = (
            np.full(len(self.numbers), np.nan),
        ) * 2  #: values and margins (t + b,) of the last two steps
        self.saved: list[np.ndarray] = []  #: the state before the present step

    def begin(self, run: OpenRun) -> None:
        """What round-off makes zero at the start."""
        self.happened, self.reader = run.happened, run.find(Reader)
        self.noise = noise_of(run, self.numbers)
        self.crossings = Crossings(self.triggers, self.noise[: len(self.triggers)])
        self.require_numbers(self.read(run, 0.0), 0.0)

    def before(self, run: OpenRun) -> None:
        """Remember the state that a step begins with."""
        self.saved = [part.copy() for part in run.step.state]

    def after(self, run: OpenRun) -> None:
        """Let events happen in the step; SolverError where it cannot be taken in parts."""
        status = self.look(run, self.saved)
        if status != stepping.DONE:
            raise failure(run, status, run.scheme.step * (run.done + 1))

    def read(self, run: OpenRun, place: float) -> np.ndarray:
        """All values and margins (t + b,) in the present state, at a place in the step; NaN where
        one is no number.
        """
        time = run.scheme.step * (run.done + place)
        return np.clip(
            self.reader.read(run, self.numbers, time, within=0.0 < place < 1.0), -HUGE, HUGE
        )

    def values(self, run: OpenRun, place: float) -> np.ndarray:
        """The values of all events (t,)."""
        return self.read(run, place)[: len(self.triggers)]

    def look(self, run: OpenRun, before: Sequence[np.ndarray]) -> int:
        """Let happen what happens in the step that was taken from the state `before`; the status of
        a piece that failed.
        """
        self.lately = set()
        if run.done == 1:
            self.take_start(run, before)
        read = self.read(run, 0.0)
        now = read[: len(self.triggers)]
        dip = 1.0
        touched = NONE
        begun = bool(self.crossings.crossed(now).any() or self.broken(read).any())
        if not begun:
            dip, touched = self.dip(run, before, read)
        self.trail = self.trail[1], read
        if not begun and dip == 1.0:
            self.remember(now)
            self.reader.keep()
            return stepping.DONE
        put(run.step.state, before)
        run.done -= 1
        steps = int(run.step.job.counters[STEPS])
        try:
            self.take_in_pieces(run, dip, touched)
        except Unreached as failed:
            return failed.status
        run.step.job.counters[STEPS] = steps
        run.done += 1
        self.reader.keep()
        if run.end_time is not None:
            run.end(run.end_time)
        run.store()
        return stepping.DONE

    def take_start(self, run: OpenRun, before: Sequence[np.ndarray]) -> None:
        """Take the values of the start, the state `before` the first step."""
        after = [part.copy() for part in run.step.state]
        put(run.step.state, before)
        then = self.read(run, -1.0)
        self.reader.keep()
        put(run.step.state, after)
        self.crossings.begin(then[: len(self.triggers)])
        self.trail = then, then

    def broken(self, read: np.ndarray) -> np.ndarray:
        """Which events (t,) read no number, of all values and margins (t + b,); one that is over
        reads nothing.
        """
        found = np.isnan(read[: len(self.triggers)])
        for k, margin in zip(self.margins, read[len(self.triggers) :], strict=True):
            found[k] |= np.isnan(margin) & self.triggers[k].alone
        found[self.over] = False
        return found

    def require_numbers(self, read: np.ndarray, time: float) -> np.ndarray:
        """Values (t,) of what was read (t + b,) at this time [s]; SolverError where one is no
        number.
        """
        for one in (self.triggers[k] for k in np.flatnonzero(self.broken(read))):
            text = f"event '{one.name}': 'when' is no number (nan) at t = {time:.6g} s"
            raise SolverError(
                f"{text}; guard it with where(...)",
                Reason.NOT_FINITE,
                time,
                ((f"event {one.name}", np.nan),),
            )
        return read[: len(self.triggers)]

    @property
    def over(self) -> list[int]:
        """Events that happen once and have."""
        names = {one.name for one in self.happened}
        return [k for k, one in enumerate(self.triggers) if one.once and one.name in names]

    def dip(
        self, run: OpenRun, before: Sequence[np.ndarray], read: np.ndarray
    ) -> tuple[float, np.ndarray]:
        """Where in the step that was taken from the state `before` a value is beyond zero that is
        not so at its end; 1 for none.

        With numbers of events whose values touch zero there and go back.
        """
        count = len(self.triggers)
        sides = self.crossings.sides
        trail = (*self.trail, read)
        signs = np.concatenate(
            [sides, np.nan_to_num(np.sign(self.trail[1][count:])).astype(np.int64)]
        )
        found = list(dips.search(run, self.numbers, before, trail, signs, self.noise))
        touching = [one.number < count and one.value > 0.0 for one in found]
        fits = self.crossings.fits(-sides)
        kept = [
            (one, touches)
            for one, touches in zip(found, touching, strict=True)
            if one.value <= 0.0 or (touches and fits[one.number])
        ]
        first = min((one.place for one, _ in kept), default=1.0)
        return first, np.array(
            [one.number for one, touches in kept if touches and one.place == first], np.int64
        )

    def remember(self, values: np.ndarray, but: Sequence[int] = ()) -> None:
        """Remember on which side of zero values (t,) are, `but` those of some events, and of those
        that are over.
        """
        self.crossings.remember(values, [*but, *self.over], self.lately)

    def take_in_pieces(self, run: OpenRun, dip: float, touched: np.ndarray) -> None:
        """Take a step from event to event, to its end or to that of the run.

        Up to a `dip` values are looked at by themselves; some have `touched` zero there.
        """
        place = 0.0
        acted = set[int]()
        count = 0
        due = NONE
        while not run.ended:
            if not len(due):
                end = dip if place < dip else 1.0
                reached, due = self.go_on(run, place, end)
                due = np.union1d(due, touched if reached == dip else NONE)
                if not len(due):
                    if end == 1.0:
                        return
                    place = end
                    continue
                acted = acted if reached - place < TOGETHER else set()
                place = reached
            count += len(due)
            if count > MANY:
                raise endless(
                    [self.triggers[k].name for k in due], run.scheme.step * (run.done + place)
                )
            self.act(run, due, place)
            acted = acted | set(due.tolist())
            touched = NONE
            now = self.require_numbers(self.read(run, place), run.scheme.step * (run.done + place))
            due = np.setdiff1d(np.flatnonzero(self.crossings.crossed(now)), list(acted))
            self.remember(now, [*due, *(k for k in acted if abs(now[k]) <= STILL * self.size[k])])

    def go_on(self, run: OpenRun, place: float, end: float) -> tuple[float, np.ndarray]:
        """Go from a place in the step, a part of it, to the next event or to the `end`: the place
        there, and the events.

        Where a value is no number at the end, as log(x) beyond its root, it goes to the last
        instant at which all are numbers.
        """
        before = [part.copy() for part in run.step.state]
        count = len(self.triggers)
        known = {place: self.read(run, place)}

        def move(to: float) -> np.ndarray:
            put(run.step.state, before)
            take_piece(run, place, to)
            known[to] = self.read(run, to)
            return known[to]

        last = move(end) if place < end else known[place]
        beyond = end
        if self.broken(last).any():
            end, beyond = last_place(lambda to: bool(self.broken(move(to)).any()), place, end)
            last = move(end)
        self.size = np.maximum(np.abs(known[place][:count]), np.abs(last[:count]))
        due = np.flatnonzero(self.crossings.crossed(last[:count]))
        if not len(due):
            self.require_numbers(known[beyond], run.scheme.step * (run.done + beyond))
            self.remember(last[:count])
            return end, due
        found = self.locate(
            due, (place, end), lambda to, k: float((known[to] if to in known else move(to))[k])
        )
        reached = float(found.min())
        due = due[found - found.min() < TOGETHER]
        self.remember(move(reached)[:count], due.tolist())
        return reached, due

    def locate(
        self, due: np.ndarray, span: tuple[float, float], value: Callable[[float, int], float]
    ) -> np.ndarray:
        """Places (d,) in a span of the step where events `due` happen, of their values at a place."""
        from scipy.optimize import brentq  # which imports all of scipy.optimize: here alone

        place, end = span
        ends = {k: (value(place, k), value(end, k)) for k in due.tolist()}

        def gap(to: float, k: int) -> float:
            return self.crossings.gap(k, *ends[k], value(to, k))

        def is_early(to: float, k: int) -> bool:
            return gap(to, k) > STILL * self.size[k]

        found = np.array([brentq(gap, place, end, args=(k,), xtol=EXACT) for k in ends])
        at_rest = self.crossings.sides[due] == 0
        each = list(zip(found.tolist(), ends, strict=True))
        self.jumps[due] = [is_early(max(to - 4 * EXACT, place), k) for to, k in each]
        early = np.array([is_early(to, k) for to, k in each]) | at_rest
        apart = found - place
        found = np.minimum(found + 4 * EXACT * early, end)  # jumps stand behind
        # the Taylor series of the shortest pieces does not know what begins at their begin
        return np.where(
            at_rest & ((apart < LATE) | (np.abs(apart - TINY) < TOGETHER)), place, found
        )

    def act(self, run: OpenRun, due: np.ndarray, place: float) -> None:
        """Do what events ask for at a place in the step, and start anew from there."""
        model = run.model
        h = run.scheme.step
        time = h * (run.done + place)
        x = run.step.state.x[np.argsort(model.order)]
        late = max(time, h * (run.done + LATE))
        before, _ = balance(run.packed, run.scheme, time)
        self.warn_of_conflict(due, time)
        gaps = list[tuple[Gap, ...]]()
        for one in (self.triggers[k] for k in due):
            self.release(model, one.name, one.release, x, late)
            gaps.append(tuple(self.lock(model, one.name, name, x, late) for name in one.lock))
        run.step.space.off[:] = ~self.closed
        loss = float(begin_anew(run.packed, run.scheme, late, before).loss[0])
        self.crossings.happen(due, self.jumps[due])
        self.lately |= set(due.tolist())
        for one, gap in zip((self.triggers[k] for k in due), gaps, strict=True):
            self.happened.append(
                Happening(
                    one.name, time, one.stop, one.release, one.lock, loss if one.lock else 0.0, gap
                )
            )
            loss = 0.0 if one.lock else loss

    def warn_of_conflict(self, due: np.ndarray, time: float) -> None:
        """A notice of joints that some events lock and others release at one instant: in order, as
        if the last were alone.
        """
        last: dict[str, str] = {}
        for one in (self.triggers[k] for k in due):
            for name, act in [
                *dict.fromkeys(one.release, "releases").items(),
                *dict.fromkeys(one.lock, "locks").items(),
            ]:
                if last.get(name, act) != act:
                    which = f"joint '{name}' is locked and released by events at one instant, t = {time:.6g} s"
                    notify(
                        f"{which}, and event '{one.name}' alone, which {act} it, counts as the last of the scene; let them be apart"
                    )
                last[name] = act

    def remark_no_effect(self, event: str, act: str, state: str, name: str, time: float) -> None:
        """A remark, made once, of a joint that an event locks or releases and that is so already."""
        text = f"event '{event}' {act} joint '{name}', which is {state} already"
        if text not in self.idle:
            self.idle.add(text)
            again = (
                "; say 'once: true' if it is to happen once"
                if any(one.name == event for one in self.happened)
                else ""
            )
            remark(f"{text}, at t = {time:.6g} s{again}")

    def lock(self, model: Compiled, event: str, name: str, x: np.ndarray, time: float) -> Gap:
        """Lock a joint in the state x (n,); the gap between its places, with a notice where a latch
        is far open.
        """
        system = model.system
        lock = self.locks[name]
        mine = self.joints == name
        own = rows_of_locks(system)[mine]
        y = system.probes(x)
        already = bool(self.closed[mine][own].any())
        self.closed[mine] = own
        for signal, value in zip(lock.signals, numbers_of(lock, y), strict=True):
            self.set_input(self.plain.signals[signal], float(value))
        gap = Gap(name, *gap_of(lock, y))
        if already:
            self.remark_no_effect(event, "locks", "locked", name, time)
        elif own.all() and gap.distance is not None and gap.distance > FAR * system.scale:
            text = f"event '{event}', t = {time:.6g} s: latch '{name}' locks its places {gap.distance:.3g} m apart and keeps them so"
            notify(f"{text}; let 'when' watch their distance, or name places that meet")
        return gap

    def release(
        self, model: Compiled, event: str, joints: Sequence[str], x: np.ndarray, time: float
    ) -> None:
        """Release rows of joints; SolverError where a trained space knows no motion in which they
        do not hold.
        """
        size = lengths(model, x, time)
        for name in joints:
            mine = self.joints == name
            if self.closed[mine].any() and empty(model, size)[mine & self.closed].all():
                text = f"event '{event}' releases joint '{name}', which holds in all motions that the reduced model knows"
                remedy = "train it with a run in which the event happens"
                raise SolverError(
                    f"{text}; {remedy}", Reason.INCONSISTENT, time, ((f"joint {name}", 0.0),)
                )
            if not self.closed[mine].any():
                self.remark_no_effect(event, "releases", "free", name, time)
            elif name in self.parks:
                self.lock(model, event, self.parks[name], x, time)
            self.closed[mine] = False

    def arrays(self, run: OpenRun) -> dict[str, np.ndarray]:
        numbers = {one.name: k for k, one in enumerate(self.triggers)}
        own = [one for one in self.happened if one.name in numbers]
        rows = [(numbers[one.name], one.time, one.loss) for one in own]
        found: dict[str, np.ndarray] = {
            "events on guard": self.crossings.sides,
            "rows closed": self.closed,
            "rows off": run.step.space.off,
        }
        gaps = [(gap.distance, gap.angle) for one in own for gap in one.gaps]
        told: dict[str, np.ndarray] = {
            "events": np.array(rows, dtype=float).reshape(-1, 3),
            GAPS: np.array(gaps, dtype=float).reshape(-1, 2),
        }
        told |= {RESTS: self.crossings.rests, TRAIL: np.array(self.trail)}
        return {name: array.copy() for name, array in (found | told).items()}

    def put(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        self.crossings.sides, self.closed, run.step.space.off[:] = (
            checkpoints.fitting(arrays, name, array).copy()
            for name, array in list(self.arrays(run).items())[:3]
        )
        self.crossings.rests = arrays[RESTS].copy()
        self.trail = (*arrays[TRAIL],)
        gaps = iter(arrays[GAPS])
        self.happened.clear()
        for number, time, loss in arrays["events"].tolist():
            one = self.triggers[int(number)]
            known = [(name, next(gaps)) for name in one.lock]
            gap = tuple(
                Gap(name, *(None if np.isnan(part) else float(part) for part in parts))
                for name, parts in known
            )
            self.happened.append(
                Happening(one.name, time, one.stop, one.release, one.lock, loss, gap)
            )


def endless(names: Sequence[str], time: float) -> SolverError:
    """The error of events that happen again and again.

    It is returned, not raised.
    """
    told = ", ".join(f"'{name}'" for name in names)
    text = f"events happen more than {MANY} times in the step from t = {time:.6g} s, the last of them {told}"
    return SolverError(
        f"{text}; let them stop the run, or give them a direction", Reason.INCONSISTENT, time, ()
    )
