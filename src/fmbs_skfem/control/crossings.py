r"""Which events happen where their values g are what they are: the side of zero on which every
value was, and where it leaves zero.

    side s = +-1      happens where  s g <= 0                         the value comes to zero, or jumps over it
    at rest, g = 0    happens where  g leaves zero                    a comparison that becomes true, max(g, 0) that rises
    unguarded         happens nowhere until g is clearly not zero     what has just happened, and what it holds at zero

A value is zero where round-off of unknowns alone may have made it so (`noise_of`). It is at rest
where it is zero at the start, and where it is exactly zero at the end of a step in which its event
has not happened, unless the lock of that event may hold it there: a rate that an event has stopped
leaves zero when the joint is released, which is no event.

What looks for events here, in `dips` and in `locating` is in the subset that is printed
(`core.printing`): live runs call it as it stands, and programs in C are the same text. What it
looks at belongs to a run (`SearchedRun`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from ..core.compiling import structs
from ..dynamics.compiled_step.stepping import DONE
from ..dynamics.measuring import Reader
from ..systems import compiled as compilation
from ..systems.connections.redundancy import scale_of
from ..systems.system import Trigger

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

NOISY = 3.0  #: on the change of a value by a change of all unknowns with arbitrary signs
NOISE = 1e-10  #: change of unknowns, over changes that count as large, which values do not show
SMOOTH = 0.9  #: of the change by twice as much, above which a value jumps there: a comparison has no noise (1/2 where it is smooth)
LEAVING = 1e-14  #: of a value at the other end of a step, beyond which it is not zero there
STILL = 1e-6  #: of a value in its step, below which it is zero where it has just crossed zero
HUGE = 1e100  #: values beyond it, and infinite ones, count as this: what is located is their sign
#: may come to rest at zero, is at rest there, may be held there by what it locked
FREE, RESTING, HELD = 0, 1, -1
STATUS, ENDED, PAUSES, IN_PIECES = range(4)  #: places in `EventSearch.told`
BEGIN, PIECE, END = range(3)  #: states of a run that its shell keeps: of the step, and of a piece


class EventSearch(NamedTuple):
    """Events t, and values w that say when they happen: one an event, and behind these the margins
    of conditions. Flags are 0 or 1.
    """

    direction: structs.Integers  #: (t,) 1 rising, -1 falling, 0 both
    once: structs.Integers  #: (t,) whether it happens the first time alone
    stopping: structs.Integers  #: (t,) whether the run stops there
    locking: structs.Integers  #: (t,) whether it locks something
    owner: structs.Integers  #: (w,) the event that reads a value
    guarded: structs.Integers  #: (w,) whether one that is no number says nothing
    noise: structs.Vector  #: (w,) sizes up to which values are zero
    values: structs.Vector  #: (w,) in the present state
    rates: structs.Vector  #: (w,) their changes in a step, nan where they are not known
    now: structs.Vector  #: (w,) at the end of the step
    latest: structs.Vector  #: (w,) at its begin
    earlier: structs.Vector  #: (w,) one step earlier
    first: structs.Vector  #: (w,) at the begin of a piece of it, or rates there
    last: structs.Vector  #: (w,) at the end of the piece, or rates there
    signs: structs.Integers  #: (w,) of values that may dip, 0 of others
    sides: structs.Integers  #: (t,) signs of values; 0 where an event is not on guard
    rests: structs.Integers  #: (t,) FREE, RESTING or HELD
    jumped: structs.Integers  #: (t,) whether the value jumped where it happened last
    lately: structs.Integers  #: (t,) whether it has happened in the present step
    over: structs.Integers  #: (t,) whether it happens no more
    due: structs.Integers  #: (t,) whether it happens now
    acted: structs.Integers  #: (t,) whether it has happened at the present instant
    touched: structs.Integers  #: (t,) whether its value touches zero where it dips
    size: structs.Vector  #: (t,) of values in the present step
    places: structs.Vector  #: (t,) in the step where events that are due happen
    #: (3,) places of a piece's begin, of the present state, and up to which a step that pauses was to
    #: be looked at by itself
    reached: structs.Vector
    #: (4,) STATUS of what could not be taken; whether the run has ENDED; whether it PAUSES behind
    #: events; whether the step is taken IN_PIECES
    told: structs.Integers


class SearchedRun(Protocol):
    """What the search asks of a run; places are parts of the present step, from 0 to 1."""

    def read_values(self, place: float) -> None:
        """Values of the present state, at a place."""

    def find_rates(self, place: float) -> None:
        """Changes of values in a step as they are in the present state."""

    def keep_state(self, which: int) -> None:
        """Keep the present state as BEGIN, PIECE or END."""

    def put_state(self, which: int) -> None:
        """Put it back."""

    def take_part(self, place: float, to: float) -> int:
        """Go on from a place to another one; the status."""

    def let_happen(self, place: float) -> int:
        """Do what the events ask for that are due; the status."""


def watch_of(triggers: Sequence[Trigger], noise: np.ndarray) -> EventSearch:
    """What is known of events at first, with sizes (w,) of values that are zero."""
    behind = [k for k, one in enumerate(triggers) if has_margin(one)]
    owner = np.array([*range(len(triggers)), *behind], np.int64)
    guarded = np.array([*(False for _ in triggers), *(not triggers[k].alone for k in behind)])

    def flags(name: str) -> np.ndarray:
        return np.array([bool(getattr(one, name)) for one in triggers], np.int64)

    count = len(triggers)
    known = {
        "direction": np.array([one.direction for one in triggers], np.int64),
        "once": flags("once"),
        "stopping": flags("stop"),
        "locking": flags("lock"),
        "owner": owner,
        "guarded": guarded.astype(np.int64),
        "noise": np.asarray(noise, float),
        "reached": np.array([0.0, 0.0, 1.0]),
        "told": np.zeros(4, np.int64),
        "size": np.zeros(count),
        "places": np.zeros(count),
    }
    of_values = {"values", "rates", "now", "latest", "earlier", "first", "last"}
    for name in EventSearch._fields:
        if name in of_values:
            known[name] = np.zeros(len(owner))
        elif name not in known:
            known[name] = np.zeros(len(owner) if name == "signs" else count, np.int64)
    return EventSearch(**known)


def has_margin(one: Trigger) -> bool:
    """Whether an event is a condition whose margin is read behind its value."""
    return one.margin is not None and one.margin >= 0


def numbers_read(triggers: Sequence[Trigger]) -> list[int]:
    """Numbers of all values (w,) of events and of margins behind them."""
    margins = [int(one.margin or 0) for one in triggers if has_margin(one)]
    return [*(one.value for one in triggers), *margins]


def read(W: EventSearch, run: SearchedRun, place: float) -> None:
    """All values in the present state; NaN where one is no number."""
    run.read_values(place)
    for k in range(len(W.values)):
        if W.values[k] > HUGE:
            W.values[k] = HUGE
        elif W.values[k] < -HUGE:
            W.values[k] = -HUGE


def broken_event(W: EventSearch) -> int:
    """The first event that reads no number; their count where none does. One that is over reads
    nothing.
    """
    found = len(W.sides)
    for k in range(len(W.values)):
        if W.values[k] != W.values[k] and W.guarded[k] == 0 and W.over[W.owner[k]] == 0:
            found = min(found, W.owner[k])
    return found


def is_broken(W: EventSearch) -> bool:
    """Whether an event reads no number."""
    return broken_event(W) < len(W.sides)


def go(W: EventSearch, run: SearchedRun, which: int, place: float, to: float) -> None:
    """Go from a state that is kept, at a place in the step, to another place, and read values
    there.
    """
    run.put_state(which)
    status = run.take_part(place, to)
    if status != DONE:
        W.told[STATUS] = status
    read(W, run, to)


def sign_of(W: EventSearch, k: int) -> int:
    """The sign of a value, 0 where it is noise."""
    if abs(W.values[k]) > W.noise[k]:
        return 1 if W.values[k] > 0.0 else -1
    return 0


def fits(W: EventSearch, k: int, change: int) -> bool:
    """Whether the change of a value has the direction of its event."""
    return W.direction[k] == 0 or W.direction[k] == change


def has_crossed(W: EventSearch, k: int) -> bool:
    """Whether an event has happened where its value is what it is."""
    side = W.sides[k]
    if side != 0 and side * W.values[k] <= 0.0 and fits(W, k, -side):
        return True
    sign = sign_of(W, k)
    return W.rests[k] == RESTING and sign != 0 and fits(W, k, sign)


def find_due(W: EventSearch) -> int:
    """Note which events have happened; their number."""
    count = 0
    for k in range(len(W.due)):
        W.due[k] = 0
        if has_crossed(W, k):
            W.due[k] = 1
            count += 1
    return count


def begin(W: EventSearch, run: SearchedRun) -> int:
    """Take values of the present state for those at the start, where those that are zero are at
    rest; 1 where one is no number.
    """
    read(W, run, 0.0)
    for k in range(len(W.sides)):
        W.sides[k] = sign_of(W, k)
        if W.sides[k] == 0:
            W.rests[k] = RESTING
    W.earlier[:] = W.values
    W.latest[:] = W.values
    return 1 if is_broken(W) else 0


def remember(W: EventSearch, k: int) -> None:
    """Remember the side of a value, one that is exactly zero as at rest.

    What has happened lately, in the same step, is not at rest.
    """
    if W.over[k] == 1:
        return
    sign = sign_of(W, k)
    # what has touched zero where the step ends
    if W.lately[k] == 1 and abs(W.values[k]) <= STILL * W.size[k]:
        return
    if sign != 0:
        W.sides[k] = sign
        W.rests[k] = FREE
    elif W.values[k] == 0.0 and W.rests[k] != HELD and W.lately[k] == 0:
        W.sides[k] = 0
        W.rests[k] = RESTING


def take_off_guard(W: EventSearch) -> None:
    """Take events that are due off guard; those that lock are held at zero where they have come
    there without a jump.
    """
    for k in range(len(W.due)):
        if W.due[k] == 1:
            W.sides[k] = 0
            W.rests[k] = HELD if W.locking[k] == 1 and W.jumped[k] == 0 else FREE
            W.lately[k] = W.acted[k] = 1
            W.over[k] = W.once[k]
            if W.stopping[k] == 1:
                W.told[ENDED] = 1


def gap(W: EventSearch, k: int) -> float:
    """What falls through zero where an event happens in a piece of a step, in the present state.

        2 |first| + LEAVING |last| - sign(last) value

    A value that jumps to zero and stays there, a comparison that ends, is below zero there.
    """
    first = W.first[k]
    last = W.last[k]
    if W.sides[k] != 0:
        return W.sides[k] * W.values[k] - LEAVING * abs(first)
    sign = 1.0 if last > 0.0 else (-1.0 if last < 0.0 else 0.0)
    return 2.0 * abs(first) + LEAVING * abs(last) - sign * W.values[k]


def noise_of(run: OpenRun, numbers: Sequence[int]) -> np.ndarray:
    """Values (t,) that are zero: what round-off of unknowns changes, and of columns of outputs that
    are read, of their size.

    What changes by as much for half of that jumps there, `tip.y < 0` where tip.y is zero: it has no
    noise. What is no number beside the start, as a root of zero, tells none.
    """
    system = run.model.system
    random = np.random.default_rng(0)
    d = NOISE * scale_of(system) * random.choice([-1.0, 1.0], system.size)
    reader = run.find(Reader)
    reader.read(run, numbers, 0.0)
    columns = reader.last[1] if reader.last else {}
    signs = dict(zip(columns, random.choice([-1.0, 1.0], len(columns)), strict=True))

    def values(part: float) -> np.ndarray:
        memory = compilation.accepted(
            run.model, system.x0 + part * d, system.v0 + part * d / run.scheme.step
        )
        near = {
            name: value + part * NOISE * reader.size * signs[name]
            for name, value in columns.items()
        }
        return np.array([reader.value(run, k, memory, near) for k in numbers])

    here = values(0.0)
    with np.errstate(invalid="ignore"):
        whole, half = (
            np.fmax(*(np.abs(values(sign * part) - here) for sign in (1.0, -1.0)))
            for part in (1.0, 0.5)
        )
        return NOISY * np.where((half <= SMOOTH * whole) & np.isfinite(whole), whole, 0.0)
