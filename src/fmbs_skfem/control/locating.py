r"""The search for events in a step: by the sign of their values at its end, and located within it.

    g(t_n) g(t_n + h) < 0        t* = t_n + theta h,  g(t*) = 0  by steps of theta h;  then on from t* to t_n + h

A value that is at rest at zero, from the start on or later, crosses it where it leaves it
(`crossings`). A value that is on the same side at both ends of a step may have been at zero or
beyond it between them (`dips`). An event that has happened is on guard again once its value is
clearly not zero: neither its own action nor round-off make it happen twice at one instant. One that
is to happen once is not. A value that is no number ends the run, at the last instant at which it is
one; what crosses zero up to there happens.

Source (events by the sign of functions, and starts after them): Hairer, Norsett, Wanner, Solving
ordinary differential equations I, 2nd ed., Springer 1993, section II.6.
"""

from __future__ import annotations

from ..dynamics.compiled_step.pieces import EXACT
from ..dynamics.compiled_step.stepping import DONE
from ..dynamics.compiled_step.touching import TINY
from .crossings import (
    BEGIN,
    ENDED,
    IN_PIECES,
    PAUSES,
    PIECE,
    STATUS,
    STILL,
    EventSearch,
    SearchedRun,
    find_due,
    gap,
    go,
    has_crossed,
    is_broken,
    read,
    remember,
    take_off_guard,
)
from .dips import ends_at_zero, find_dip
from .zeros import find_zero

LATE = 1e-6  #: of a step after its begin where inputs of the step count
TOGETHER = 1e-8  #: of a step, within which events happen at once
MANY = 100  #: events in one step
#: statuses beside those of `dynamics.compiled_step.stepping`: a value is no number, events happen
#: again and again, what they lock contradicts what moves
BROKEN, REPEATED, CONTRADICTED = -1, -2, -3


def look(W: EventSearch, run: SearchedRun) -> int:
    """Let happen what happens in the step that was taken last, whose BEGIN is kept; the status.

    The step goes to the place reached: all of it, or up to an event at which the run ends or
    pauses.
    """
    # what is left of a step that has paused is the same step
    if W.reached[2] == 1.0:
        W.lately[:] = 0
    W.told[STATUS] = DONE
    W.told[IN_PIECES] = 0
    W.reached[1] = 1.0
    read(W, run, 1.0)
    W.now[:] = W.values
    dip = 1.0
    begun = find_due(W) > 0 or is_broken(W)
    if not begun:
        dip = find_dip(W, run)
        begun = dip == 1.0 and ends_at_zero(W)
    for k in range(len(W.size)):
        W.size[k] = max(abs(W.latest[k]), abs(W.now[k]))
    dip = min(dip, W.reached[2])
    W.reached[2] = 1.0
    W.earlier[:] = W.latest
    W.latest[:] = W.now
    if begun or dip < 1.0:
        run.put_state(BEGIN)
        W.due[:] = 0
        return take_in_pieces(W, run, dip)
    W.values[:] = W.now
    for k in range(len(W.sides)):
        remember(W, k)
    return int(W.told[STATUS])


def take_in_pieces(W: EventSearch, run: SearchedRun, dip: float) -> int:
    """Take a step from event to event, to its end or to that of the run; the status.

    Up to a `dip` values are looked at by themselves; some have touched zero there.
    """
    place = 0.0
    count = 0
    W.acted[:] = 0
    while W.told[ENDED] == 0:
        if count_due(W) == 0:
            if count > 0 and W.told[PAUSES] == 1:
                W.reached[2] = dip if dip > place else 1.0
                break
            end = dip if place < dip else 1.0
            reached = go_on(W, run, place, end)
            if W.told[STATUS] != DONE:
                return int(W.told[STATUS])
            if reached == dip:
                for k in range(len(W.due)):
                    W.due[k] = max(W.due[k], W.touched[k])
            if count_due(W) == 0:
                if end == 1.0:
                    W.reached[1] = end
                    break
                place = end
                continue
            if reached - place >= TOGETHER:
                W.acted[:] = 0
            place = reached
        count += count_due(W)
        if count > MANY:
            return REPEATED
        status = run.let_happen(place)
        if status != DONE:
            return status
        W.reached[1] = place
        take_off_guard(W)
        W.touched[:] = 0
        read(W, run, place)
        if is_broken(W):
            return BROKEN
        for k in range(len(W.due)):
            W.due[k] = 1 if has_crossed(W, k) and W.acted[k] == 0 else 0
            held = W.acted[k] == 1 and abs(W.values[k]) <= STILL * W.size[k]
            if W.due[k] == 0 and not held:
                remember(W, k)
    return DONE


def count_due(W: EventSearch) -> int:
    """How many events are due."""
    count = 0
    for k in range(len(W.due)):
        count += W.due[k]
    return count


def go_on(W: EventSearch, run: SearchedRun, place: float, end: float) -> float:
    """Go from a place in the step, a part of it, to the next events, which are due then, or to the
    `end`: the place there.

    Where a value is no number at the end, as log(x) beyond its root, it goes to the last instant at
    which all are numbers.
    """
    run.keep_state(PIECE)
    W.told[IN_PIECES] = 1
    W.reached[0] = place
    read(W, run, place)
    W.first[:] = W.values
    beyond = end
    if place < end:
        move(W, run, end)
        if is_broken(W):
            end, beyond = last_place(W, run, place, end)
            move(W, run, end)
    W.last[:] = W.values
    for k in range(len(W.due)):
        W.size[k] = max(W.size[k], abs(W.first[k]), abs(W.last[k]))
    if find_due(W) == 0:
        if beyond > end:
            move(W, run, beyond)
            W.reached[1] = beyond
            W.told[STATUS] = BROKEN
            return beyond
        for k in range(len(W.due)):
            remember(W, k)
        return end
    reached = locate(W, run, place, end)
    move(W, run, reached)
    for k in range(len(W.due)):
        if W.due[k] == 1 and W.places[k] - reached >= TOGETHER:
            W.due[k] = 0
        if W.due[k] == 0:
            remember(W, k)
    return reached


def move(W: EventSearch, run: SearchedRun, to: float) -> None:
    """Go from the begin of the piece to a place in the step."""
    go(W, run, PIECE, W.reached[0], to)


def last_place(W: EventSearch, run: SearchedRun, place: float, end: float) -> tuple[float, float]:
    """The last place from `place` to `end` to which values are numbers, and the first one where one
    is none, by bisection.
    """
    while end - place > EXACT:
        middle = 0.5 * (place + end)
        move(W, run, middle)
        if is_broken(W):
            end = middle
        else:
            place = middle
    return place, end


def locate(W: EventSearch, run: SearchedRun, place: float, end: float) -> float:
    """The place from `place` to `end` of the first one of the events that are due; those of all are
    kept.
    """
    nearest = end
    for k in range(len(W.due)):
        if W.due[k] == 1:
            W.places[k] = place_of(W, run, k, (place, end))
            nearest = min(nearest, W.places[k])
    return nearest


def place_of(W: EventSearch, run: SearchedRun, k: int, span: tuple[float, float]) -> float:
    """The place in a span of the step where an event happens."""
    place, end = span
    W.values[:] = W.first
    first = gap(W, k)
    W.values[:] = W.last
    last = gap(W, k)
    found = find_zero(W, run, k, gap_at, span, (first, last), EXACT)
    still = STILL * W.size[k]
    W.jumped[k] = 1 if gap_at(W, run, k, max(found - 4.0 * EXACT, place)) > still else 0
    at_rest = W.sides[k] == 0
    apart = found - place
    # the Taylor series of the shortest pieces does not know what begins at their begin
    if at_rest and (apart < LATE or abs(apart - TINY) < TOGETHER):
        return place
    # jumps stand behind
    if at_rest or gap_at(W, run, k, found) > still:
        return min(found + 4.0 * EXACT, end)
    return found


def gap_at(W: EventSearch, run: SearchedRun, k: int, place: float) -> float:
    """What falls through zero where an event happens, at a place in the step."""
    move(W, run, place)
    return gap(W, k)
