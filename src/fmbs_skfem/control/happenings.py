r"""The events of a run: what they do to joints, and what the search for them asks of the run.

    lock         x+ = x-,        M (v+ - v-) + Phi_q^T p = 0,  Phi_q v+ + Phi_t = 0      loses  v-^T M v- / 2 - v+^T M v+ / 2
    release                      v+ = v-

Accelerations and reactions start anew behind an event, as at the start of a run, so that all stays
of second order. Very short pieces of a step are too short for the method, whose reactions are noise
there: they follow x + h v + h^2 q'' / 2.

Source (impulses on constraints): Brogliato, Nonsmooth Mechanics, 3rd ed., Springer 2016, section
4.2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import Reason, SolverError
from ..core.notices import notify, remark
from ..dynamics import checkpoint as checkpoints
from ..dynamics.compiled_step import stepping
from ..dynamics.compiled_step.packing import UNSTORED
from ..dynamics.compiled_step.pieces import EXACT, Unreached, take_piece
from ..dynamics.compiled_step.step import STEPS
from ..dynamics.dividing import put
from ..dynamics.histories import leading_signals
from ..dynamics.initial import balance, begin_anew
from ..dynamics.integration import failure
from ..dynamics.measuring import Reader
from ..dynamics.observers import Observer
from ..dynamics.trajectory import Gap, Happening
from ..dynamics.vanishing import empty, lengths, rows_of_locks
from ..systems.compiled import Compiled
from .crossings import (
    BEGIN,
    ENDED,
    begin,
    broken_event,
    is_broken,
    noise_of,
    numbers_read,
    read,
    watch_of,
)
from .events import gap_of
from .locating import BROKEN, LATE, MANY, REPEATED, look
from .row_changes import change, changes_of, signals_of

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun
    from ..systems.system import System

FAR = 0.02  #: distance of places that a latch locks, over the size of the mechanism, which is not meant to stay
#: in checkpoints: distances and angles, what rests at zero, values of the last two steps
GAPS, RESTS, TRAIL = "event gaps", "events at rest", "event values"


class EventObserver(Observer):
    """The events of a run, and the shell of their search.

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
        self.joints = np.array([joint for joint, _ in system.constraints.names], dtype=object)
        self.changes = changes_of(system)
        self.signals = signals_of(system.locks)
        self.numbers = numbers_read(self.triggers)
        self.idle = set[str]()  #: remarks on what changes nothing, each made once
        self.kept = list[list[np.ndarray]]([[], [], []])  #: states BEGIN, PIECE, and END

    def begin(self, run: OpenRun) -> None:
        """What round-off makes zero at the start."""
        self.run, self.happened, self.reader = run, run.happened, run.find(Reader)
        self.watch = watch_of(self.triggers, noise_of(run, self.numbers))
        self.first = run.done
        read(self.watch, self, 0.0)
        self.require_numbers(0.0)

    def before(self, run: OpenRun) -> None:
        """Remember the state that a step begins with."""
        self.first = run.done
        self.keep_state(BEGIN)
        if run.done == 0:
            begin(self.watch, self)
            self.reader.keep()

    def after(self, run: OpenRun) -> None:
        """Let events happen in the step; SolverError where it cannot be taken in parts."""
        steps = int(run.step.job.counters[STEPS])
        # pieces are those of the step that begins there
        run.done = self.first
        status = look(self.watch, self)
        place = self.watch.reached[1]
        if status == BROKEN:
            self.require_numbers(place)
        if status == REPEATED:
            names = [self.triggers[k].name for k in np.flatnonzero(self.watch.due)]
            raise endless(names, run.scheme.step * (run.done + place))
        if status != stepping.DONE:
            raise failure(run, status, run.scheme.step * (run.done + 1))
        run.step.job.counters[STEPS] = steps
        run.done = self.first + 1
        self.reader.keep()
        if self.watch.lately.any() or run.ended:
            if run.end_time is not None:
                run.end(run.end_time)
            run.store()

    def read_values(self, place: float) -> None:
        time = self.run.scheme.step * (self.first + place)
        self.watch.values[:] = self.reader.read(
            self.run, self.numbers, time, within=0.0 < place < 1.0
        )

    def find_rates(self, place: float) -> None:
        """Changes of values; nan of those that forces do not keep.

        (g(q + d h q', q' + d h q'', t + d h) - g(q - d h q', ...)) / 2 d
        """
        run = self.run
        h = run.scheme.step
        found = []
        for side in (-1, 1):
            time = h * (self.first + place + side * stepping.BESIDE)
            row, _ = leading_signals(run.model.system, np.array([time]), h)
            if not len(row):
                self.watch.rates[:] = np.nan
                return
            run.packed.give(row, UNSTORED)
            run.packed.call(stepping.accept_beside, side)
            run.packed.check()
            found.append(run.step.space.memory.copy())
        change = (found[1] - found[0]) / (2.0 * stepping.BESIDE)
        self.watch.rates[:] = [
            np.nan if k < 0 else change[run.kept_values[k]] for k in self.numbers
        ]

    def keep_state(self, which: int) -> None:
        self.kept[which] = [part.copy() for part in self.run.step.state]

    def put_state(self, which: int) -> None:
        put(self.run.step.state, self.kept[which])

    def take_part(self, place: float, to: float) -> int:
        try:
            take_piece(self.run, place, to)
        except Unreached as failed:
            return failed.status
        return stepping.DONE

    def require_numbers(self, place: float) -> None:
        """SolverError for a value that is no number, at a place in the step."""
        time = self.run.scheme.step * (self.first + place)
        if is_broken(self.watch):
            name = self.triggers[broken_event(self.watch)].name
            text = f"event '{name}': 'when' is no number (nan) at t = {time:.6g} s"
            raise SolverError(
                f"{text}; guard it with where(...)",
                Reason.NOT_FINITE,
                time,
                ((f"event {name}", np.nan),),
            )

    def let_happen(self, place: float) -> int:
        run = self.run
        due = np.flatnonzero(self.watch.due)
        model = run.model
        h = run.scheme.step
        time = h * (self.first + place)
        x = run.step.state.x[np.argsort(model.order)]
        late = max(time, h * (self.first + LATE))
        # the state at the begin of the step is that before it
        told = max(time, np.nextafter(h * self.first, np.inf) if self.first else EXACT * h)
        before, _ = balance(run.packed, run.scheme, time)
        self.warn_of_conflict(due, time)
        gaps = list[tuple[Gap, ...]]()
        C = self.changes
        C.probes[:-1] = model.system.probes(x)
        for k in due.tolist():
            one = self.triggers[k]
            self.tell_release(model, one.name, one.release, x, late)
            gaps.append(tuple(self.tell_lock(model, one.name, name, late) for name in one.lock))
            change(C, k)
        for signal, value in zip(self.signals, C.numbers, strict=True):
            self.set_input(self.plain.signals[signal], float(value))
        run.step.space.off[:] = C.closed == 0
        loss = float(begin_anew(run.packed, run.scheme, late, before).loss[0])
        for one, gap in zip((self.triggers[k] for k in due), gaps, strict=True):
            self.happened.append(
                Happening(
                    one.name, told, one.stop, one.release, one.lock, loss if one.lock else 0.0, gap
                )
            )
            loss = 0.0 if one.lock else loss
        return stepping.DONE

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

    def tell_lock(self, model: Compiled, event: str, name: str, time: float) -> Gap:
        """The gap between the places of a joint that is locked, with a notice where a latch is far
        open.
        """
        system = model.system
        lock = self.locks[name]
        mine = self.joints == name
        own = rows_of_locks(system)[mine]
        gap = Gap(name, *gap_of(lock, self.changes.probes[:-1]))
        far = f"latch '{name}' is far open"
        if (self.changes.closed[mine][own] == 1).any():
            self.remark_no_effect(event, "locks", "locked", name, time)
        elif (
            own.all()
            and gap.distance is not None
            and gap.distance > FAR * system.scale
            and far not in self.idle
        ):
            self.idle.add(far)
            text = f"event '{event}', t = {time:.6g} s: latch '{name}' locks its places {gap.distance:.3g} m apart and keeps them so"
            notify(f"{text}; let 'when' watch their distance, or name places that meet")
        return gap

    def tell_release(
        self, model: Compiled, event: str, joints: Sequence[str], x: np.ndarray, time: float
    ) -> None:
        """A remark of joints that are free already; SolverError where a trained space knows no
        motion in which they do not hold.
        """
        size = lengths(model, x, time)
        for name in joints:
            held = (self.joints == name) & (self.changes.closed == 1)
            if held.any() and empty(model, size)[held].all():
                text = f"event '{event}' releases joint '{name}', which holds in all motions that the reduced model knows"
                remedy = "train it with a run in which the event happens"
                raise SolverError(
                    f"{text}; {remedy}", Reason.INCONSISTENT, time, ((f"joint {name}", 0.0),)
                )
            if not held.any():
                self.remark_no_effect(event, "releases", "free", name, time)

    def arrays(self, run: OpenRun) -> dict[str, np.ndarray]:
        numbers = {one.name: k for k, one in enumerate(self.triggers)}
        own = [one for one in self.happened if one.name in numbers]
        rows = [(numbers[one.name], one.time, one.loss) for one in own]
        found: dict[str, np.ndarray] = {
            "events on guard": self.watch.sides,
            "rows closed": self.changes.closed == 1,
            "rows off": run.step.space.off,
        }
        gaps = [(gap.distance, gap.angle) for one in own for gap in one.gaps]
        told: dict[str, np.ndarray] = {
            "events": np.array(rows, dtype=float).reshape(-1, 3),
            GAPS: np.array(gaps, dtype=float).reshape(-1, 2),
        }
        trail = np.array([self.watch.earlier, self.watch.latest])
        told |= {RESTS: self.watch.rests, TRAIL: trail}
        return {name: array.copy() for name, array in (found | told).items()}

    def put(self, run: OpenRun, arrays: Mapping[str, np.ndarray]) -> None:
        W = self.watch
        for name, array in list(self.arrays(run).items())[:3]:
            found = checkpoints.fitting(arrays, name, array)
            places = {"events on guard": W.sides, "rows closed": self.changes.closed}
            places.get(name, run.step.space.off)[:] = found
        W.rests[:] = arrays[RESTS]
        W.earlier[:], W.latest[:] = arrays[TRAIL]
        gaps = iter(arrays[GAPS])
        W.over[:] = W.told[:] = 0
        self.happened.clear()
        for number, time, loss in arrays["events"].tolist():
            one = self.triggers[int(number)]
            W.over[int(number)] = one.once
            W.told[ENDED] = one.stop
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
