r"""Events in a run: found by the sign of their values after every step, located within it, and what they do to joints.

    g(t_n) g(t_n + h) < 0        t* = t_n + theta h,  g(t*) = 0  by steps of theta h;  then on from t* to t_n + h
    lock         x+ = x-,        M (v+ - v-) + Phi_q^T p = 0,  Phi_q v+ + Phi_t = 0      loses  v-^T M v- / 2 - v+^T M v+ / 2
    release                      v+ = v-

Accelerations and reactions start anew behind an event, as at the start of a run, so that all stays of second order. Pieces below
TINY of a step are too short for the method, whose reactions are noise there: they follow x + h v + h^2 q'' / 2. A value that is
zero at the start counts as crossing zero there where it leaves in the direction of its event. A value that is on
the same side at both ends of a step may have been beyond zero between them (`dips`). An event that has happened is on
guard again once its value is clearly not zero: neither its own action nor round-off make it happen twice at one instant.
One that is to happen once is not.

Source (events by the sign of functions, and starts after them): Hairer, Norsett, Wanner, Solving ordinary differential equations I,
2nd ed., Springer 1993, section II.6; impulses on constraints: Brogliato, Nonsmooth Mechanics, 3rd ed., Springer 2016, section 4.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core import ranks
from ..core.errors import Reason, SolverError
from ..core.notices import notify, remark
from ..systems import compiled as compilation
from ..systems.compiled import Compiled
from ..systems.events import gap_of, numbers_of
from ..systems.redundancy import scale_of
from ..systems.system import loose_rows
from . import checkpoint as checkpoints
from . import dips, stepping
from .checkpoint import Checkpoint
from .dividing import divided, put, restart
from .initial import Instant, consistent_start, first_state
from .step import STEPS
from .trajectory import Gap, Happening
from .vanishing import empty, lengths, rows_of_locks

if TYPE_CHECKING:
    from .feed import Feed
    from .run import OpenRun

TINY = 0.01  #: of a step, below which a piece of it is taken by the Taylor series
LATE = 1e-6  #: of a step after its begin where inputs of the step count
EXACT = 1e-12  #: of a step, to which events are located
TOGETHER = 1e-8  #: of a step, within which events happen at once
NOISY = 3.0  #: on the change of a value by a change of all unknowns with arbitrary signs
NOISE = 1e-10  #: change of unknowns, over changes that count as large, which values do not show
STILL = 1e-6  #: of a value in its step, below which it is zero where it has just crossed zero
MANY = 100  #: events in one step
FAR = 0.02  #: distance of places that a latch locks, over the size of the mechanism, which is not meant to stay
GAPS, NOT_KNOWN = "event gaps", (np.nan, np.nan)  #: distances and angles in checkpoints, which those of earlier versions lack


class Unreached(Exception):
    """A piece of a step that cannot be taken, with its status."""

    def __init__(self, status: int) -> None:
        super().__init__(status)
        self.status = status


class Watch:
    """The events of a run."""

    def __init__(self, run: OpenRun, feed: Feed) -> None:
        system, self.feed = run.model.system, feed
        self.triggers, self.locks = system.triggers, {one.joint: one for one in system.locks}
        self.joints = np.array([joint for joint, _ in system.constraints.names], dtype=object)
        self.closed = ~rows_of_locks(system)  #: rows that are to hold, whether or not others make them hold already
        self.sides = np.zeros(len(self.triggers), np.int64)  #: signs of values; 0 where an event is not on guard
        self.numbers = [one.value for one in self.triggers]
        self.noise = self.noise_of(run)  #: values (t,) below which they are zero
        self.size = np.zeros(len(self.triggers))  #: of the values in the last step with an event
        self.happened: list[Happening] = []
        self.idle = set[str]()  #: remarks on what changes nothing, each made once
        self.trail = (np.full(len(self.triggers), np.nan),) * 2  #: values (t,) of the last two steps

    def noise_of(self, run: OpenRun) -> np.ndarray:
        """Values (t,) that are zero: what round-off of unknowns changes, and of columns of outputs that are read, of their size."""
        system, random = run.model.system, np.random.default_rng(0)
        d = NOISE * scale_of(system) * random.choice([-1.0, 1.0], system.size)
        states = ((system.x0, system.v0), (system.x0 + d, system.v0 + d / run.scheme.step))
        first, last = (compilation.accepted(run.model, *state) for state in states)
        self.values(run, 0.0)
        kept = [NOISE * run.reader.size if k < 0 else last[run.kept_values[k]] - first[run.kept_values[k]] for k in self.numbers]
        return NOISY * np.abs(np.array(kept))

    def values(self, run: OpenRun, place: float) -> np.ndarray:
        """The values of all events (t,) in the present state, at a place in the step."""
        time = run.scheme.step * (run.done + place)
        return np.array(run.reader.read(run, self.numbers, time, within=0.0 < place < 1.0))

    @property
    def ended(self) -> float | None:
        """When an event has stopped the run [s]."""
        return self.happened[-1].time if self.happened and self.happened[-1].stop else None

    def look(self, run: OpenRun, before: Sequence[np.ndarray]) -> int:
        """Let happen what happens in the step that was taken from the state `before`; the status of a piece that failed."""
        due = np.zeros(0, np.int64)
        if run.done == 1:
            after = [part.copy() for part in run.step.state]
            put(run.step.state, before)
            then = self.values(run, -1.0)
            run.reader.keep()
            put(run.step.state, after)
            self.guard(then)
            self.trail = then, then
        now = self.values(run, 0.0)
        if run.done == 1:
            change = now - then
            due = np.flatnonzero((self.sides == 0) & (self.signs(change) != 0) & self.fits(np.sign(change)))
        dip = 1.0 if len(due) or self.crossed(now).any() else self.dip(run, before, now)
        self.trail = self.trail[1], now
        if not len(due) and not self.crossed(now).any() and dip == 1.0:
            self.guard(now)
            run.reader.keep()
            return stepping.DONE
        put(run.step.state, before)
        run.done -= 1
        steps = int(run.step.job.counters[STEPS])
        try:
            self.take_in_pieces(run, due, dip)
        except Unreached as failed:
            return failed.status
        run.step.job.counters[STEPS] = steps
        run.done += 1
        run.reader.keep()
        if self.ended is not None:
            run.end(self.ended)
        run.store()
        return stepping.DONE

    def signs(self, values: np.ndarray) -> np.ndarray:
        """Signs of values (t,), 0 for those that are noise."""
        return np.asarray(np.where(np.abs(values) > self.noise, np.sign(values), 0.0).astype(np.int64))

    def fits(self, change: np.ndarray) -> np.ndarray:
        """Whether changes (t,) of values have the direction of their events."""
        return np.array([one.direction in (0, int(sign)) for one, sign in zip(self.triggers, change, strict=True)], dtype=bool)

    def crossed(self, values: np.ndarray) -> np.ndarray:
        """Which events have happened where their values are these (t,)."""
        return np.asarray((self.sides != 0) & (self.sides * values <= 0.0) & self.fits(-self.sides))

    def guard(self, values: np.ndarray, but: Sequence[int] = ()) -> None:
        """Remember the signs of values (t,) that are clearly not zero, `but` those of some events."""
        found, names = self.signs(values), {one.name for one in self.happened}
        found[[*but, *(k for k, one in enumerate(self.triggers) if one.once and one.name in names)]] = 0
        self.sides = np.where(found != 0, found, self.sides)

    def dip(self, run: OpenRun, before: Sequence[np.ndarray], now: np.ndarray) -> float:
        """Where in the step that was taken from the state `before` a value is beyond zero that is not so at its end; 1 for none."""
        last, h = self.trail[1], run.scheme.step
        some = np.flatnonzero((self.sides != 0) & dips.near(self.trail[0], last, now))
        if not len(some):
            return 1.0
        after, late = [part.copy() for part in run.step.state], dips.rates(run, self.numbers, h * run.done)
        put(run.step.state, before)
        early, found = dips.rates(run, self.numbers, h * (run.done - 1)), 1.0
        for k in some.tolist():
            s = self.sides[k]
            if not (s * early[k] < 0.0 < s * late[k]):
                continue
            place, value = dips.deepest((s * last[k], s * now[k]), (s * early[k], s * late[k]))
            if value <= self.noise[k]:
                put(run.step.state, before)
                run.done -= 1
                take_piece(run, 0.0, place)
                found = min(found, place) if s * self.values(run, place)[k] <= 0.0 else found
                run.done += 1
        put(run.step.state, after)
        return found

    def take_in_pieces(self, run: OpenRun, due: np.ndarray, dip: float = 1.0) -> None:
        """Take a step from event to event, those that are due at its begin first, to its end or to that of the run.

        Up to a `dip` values are looked at by themselves.
        """
        place, acted, count = 0.0, set[int](), 0
        while self.ended is None:
            if not len(due):
                end = dip if place < dip else 1.0
                reached, due = self.go_on(run, place, end)
                if not len(due):
                    if end == 1.0:
                        return
                    place = end
                    continue
                acted = acted if reached - place < TOGETHER else set()
                place = reached
            count += len(due)
            if count > MANY:
                raise endless([self.triggers[k].name for k in due], run.scheme.step * (run.done + place))
            self.act(run, due, place)
            acted |= set(due.tolist())
            now = self.values(run, place)
            due = np.setdiff1d(np.flatnonzero(self.crossed(now)), list(acted))
            self.guard(now, [*due, *(k for k in acted if abs(now[k]) <= STILL * self.size[k])])

    def go_on(self, run: OpenRun, place: float, end: float) -> tuple[float, np.ndarray]:
        """Go from a place in the step, a part of it, to the next event or to the `end`: the place there, and the events."""
        before, first = [part.copy() for part in run.step.state], self.values(run, place)

        def move(to: float) -> np.ndarray:
            put(run.step.state, before)
            take_piece(run, place, to)
            return self.values(run, to)

        last = move(end) if place < end else first
        self.size = np.maximum(np.abs(first), np.abs(last))
        due = np.flatnonzero(self.crossed(last))
        if not len(due):
            self.guard(last)
            return end, due
        from scipy.optimize import brentq  # which imports all of scipy.optimize: here alone

        known = {place: first, end: last}

        def value(to: float, k: int) -> float:
            if to not in known:
                known[to] = move(to)
            return float(known[to][k])

        found = np.array([brentq(value, place, end, args=(k,), xtol=EXACT) for k in due])
        for number, k in enumerate(due.tolist()):  # jumps stand behind
            early = self.sides[k] * value(found[number], k) > STILL * self.size[k]
            found[number] = min(found[number] + 4 * EXACT * early, end)
        reached, due = float(found.min()), due[found - found.min() < TOGETHER]
        self.guard(move(reached), due.tolist())
        return reached, due

    def act(self, run: OpenRun, due: np.ndarray, place: float) -> None:
        """Do what events ask for at a place in the step, and start anew from there."""
        model, state, h = run.model, run.step.state, run.scheme.step
        system, back = model.system, np.argsort(model.order)
        time, x, v = h * (run.done + place), state.x[back], state.v[back]
        late = max(time, h * (run.done + LATE))
        self.tell_of_both(due, time)
        gaps = list[tuple[Gap, ...]]()
        for one in (self.triggers[k] for k in due):
            self.let_go(model, one.name, one.release, x, late)
            gaps.append(tuple(self.hold(model, one.name, name, x, late) for name in one.lock))
        off = run.step.space.off
        off[:] = ~self.closed | follows(model, x, late, self.closed)
        at = Instant(late, x, v, off > 0.0, state.memory)
        start = consistent_start(model, run.scheme, at, (1.0 - place) * h if place < 1.0 else h)
        kept = compilation.accepted(model, x, start.v, state.memory, late)
        held = state.speed.copy(), state.parts.copy(), state.work.copy()
        put(state, first_state(model, start, run.step.method.c, kept, late))
        state.speed[:], state.parts[:], state.work[:] = held
        restart(state, run.step.work)
        self.sides[due] = 0
        loss = 0.5 * float(v @ (system.mass @ v) - start.v @ (system.mass @ start.v))
        for one, gap in zip((self.triggers[k] for k in due), gaps, strict=True):
            self.happened.append(Happening(one.name, time, one.stop, one.release, one.lock, loss if one.lock else 0.0, gap))
            loss = 0.0 if one.lock else loss

    def tell_of_both(self, due: np.ndarray, time: float) -> None:
        """A notice of joints that some events lock and others release at one instant: in order, as if the last were alone."""
        last: dict[str, str] = {}
        for one in (self.triggers[k] for k in due):
            for name, act in [*dict.fromkeys(one.release, "releases").items(), *dict.fromkeys(one.lock, "locks").items()]:
                if last.get(name, act) != act:
                    which = f"joint '{name}' is locked and released by events at one instant, t = {time:.6g} s"
                    notify(
                        f"{which}, and event '{one.name}' alone, which {act} it, counts as the last of the scene; let them be apart"
                    )
                last[name] = act

    def tell_of_nothing(self, event: str, act: str, state: str, name: str, time: float) -> None:
        """A remark, made once, of a joint that an event locks or releases and that is so already."""
        text = f"event '{event}' {act} joint '{name}', which is {state} already"
        if text not in self.idle:
            self.idle.add(text)
            again = "; say 'once: true' if it is to happen once" if any(one.name == event for one in self.happened) else ""
            remark(f"{text}, at t = {time:.6g} s{again}")

    def hold(self, model: Compiled, event: str, name: str, x: np.ndarray, time: float) -> Gap:
        """Let the rows of a lock hold in the state x (n,); the gap between its places, with a notice where a latch is far open."""
        system, lock, mine = model.system, self.locks[name], self.joints == name
        own, y = rows_of_locks(system)[mine], system.probes(x)
        already = bool(self.closed[mine][own].any())
        self.closed[mine] = own
        for signal, value in zip(lock.signals, numbers_of(lock, y), strict=True):
            self.feed.hold(self.feed.plain.signals[signal], float(value))
        gap = Gap(name, *gap_of(lock, y))
        if already:
            self.tell_of_nothing(event, "locks", "locked", name, time)
        elif own.all() and gap.distance is not None and gap.distance > FAR * system.scale:
            text = (
                f"event '{event}', t = {time:.6g} s: latch '{name}' locks its places {gap.distance:.3g} m apart and keeps them so"
            )
            notify(f"{text}; let 'when' watch their distance, or name places that meet")
        return gap

    def let_go(self, model: Compiled, event: str, joints: Sequence[str], x: np.ndarray, time: float) -> None:
        """Let rows of joints go; SolverError where a trained space knows no motion in which they do not hold."""
        size = lengths(model, x, time)
        for name in joints:
            mine = self.joints == name
            if self.closed[mine].any() and empty(model, size)[mine & self.closed].all():
                text = f"event '{event}' releases joint '{name}', which holds in all motions that the reduced model knows"
                remedy = "train it with a run in which the event happens"
                raise SolverError(f"{text}; {remedy}", Reason.INCONSISTENT, time, ((f"joint {name}", 0.0),))
            if not self.closed[mine].any():
                self.tell_of_nothing(event, "releases", "free", name, time)
            self.closed[mine] = False

    def arrays(self, run: OpenRun) -> dict[str, np.ndarray]:
        """What is to be kept of it, by name."""
        numbers = {one.name: k for k, one in enumerate(self.triggers)}
        rows = [(numbers[one.name], one.time, one.loss) for one in self.happened]
        found = {"events on guard": self.sides, "rows closed": self.closed, "rows off": run.step.space.off}
        gaps = [(gap.distance, gap.angle) for one in self.happened for gap in one.gaps]
        told = {"events": np.array(rows, dtype=float).reshape(-1, 3), GAPS: np.array(gaps, dtype=float).reshape(-1, 2)}
        return {name: array.copy() for name, array in found.items()} | told

    def put(self, run: OpenRun, held: Checkpoint) -> None:
        """Put back what was kept."""
        self.sides, self.closed, run.step.space.off[:] = (
            checkpoints.fitting(held.arrays, name, array).copy() for name, array in list(self.arrays(run).items())[:3]
        )
        gaps = iter(held.arrays.get(GAPS, ()))
        self.happened = []
        for number, time, loss in held.arrays["events"].tolist():
            one = self.triggers[int(number)]
            known = [(name, next(gaps, NOT_KNOWN)) for name in one.lock]
            gap = tuple(Gap(name, *(None if np.isnan(part) else float(part) for part in parts)) for name, parts in known)
            self.happened.append(Happening(one.name, time, one.stop, one.release, one.lock, loss, gap))


def open_at_start(model: Compiled, x: np.ndarray) -> np.ndarray:
    """Rows (m,) bool that do not hold where a motion starts, at x (n,): of locks, and of loose joints where others hold."""
    closed = ~rows_of_locks(model.system)
    return np.asarray(~closed | follows(model, x, 0.0, closed))


def follows(model: Compiled, x: np.ndarray, time: float, closed: np.ndarray) -> np.ndarray:
    """Loose rows (m,) bool among the closed ones that follow from others, or hold in the whole space of a reduced model."""
    loose = loose_rows(model.system.constraints)
    found = np.zeros(len(loose), dtype=bool)
    if not (loose & closed).any():
        return found
    J, size = compilation.gap(model, x, time)[1] * scale_of(model.system), lengths(model, x, time)
    noise = empty(model, size)
    rows = np.flatnonzero(closed & ~(loose & noise))
    rest = rows[ranks.part(J[rows], ranks.CLOSED, ~loose[rows])[1]]
    found[rest] = True
    return np.asarray(loose & closed & (found | noise))


def take_piece(run: OpenRun, place: float, to: float) -> None:
    """Go from a place in the present step to another one, both parts of it."""
    h, state = run.scheme.step, run.step.state
    begin, span = h * (run.done + place), h * (to - place)
    if span >= TINY * h:
        status, _ = divided(run, stepping.DONE, begin, span, -1, 0)
        if status != stepping.DONE:
            raise Unreached(status)
        return
    way = span * state.v + 0.5 * span**2 * state.acceleration
    state.x[:] += way
    state.v[:] += span * state.acceleration
    back = np.argsort(run.model.order)
    state.memory[:] = compilation.accepted(run.model, state.x[back], state.v[back], state.memory.copy(), begin + span)
    push, gradients = compilation.working(run.model, state.x[back], state.v[back], begin + span, state.memory)
    state.work[0] += 0.5 * (state.push + push) @ way
    state.push[:], state.gradients[:] = push, gradients
    restart(state, run.step.work)


def endless(names: Sequence[str], time: float) -> SolverError:
    """The error of events that happen again and again."""
    told = ", ".join(f"'{name}'" for name in names)
    text = f"events happen more than {MANY} times in the step from t = {time:.6g} s, the last of them {told}"
    return SolverError(f"{text}; let them stop the run, or give them a direction", Reason.INCONSISTENT, time, ())
