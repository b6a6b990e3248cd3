r"""Values that cross zero twice within a step, or touch it: their sign is that of before at its
end, and their rates show it.

    s g > 0,  s g' < 0 at the begin,  s g > 0,  s g' > 0 at the end:    g dips, the cubic through the four says where;
    |x| and x^2 touch zero where the rate is zero

Rates are differences along q' and q''. Of what is read of reactions and energies there are none: it
is looked at at the ends alone. Comparisons have none either: it is their margins that dip.
"""

from __future__ import annotations

import math

from ..dynamics.compiled_step.pieces import EXACT
from ..dynamics.compiled_step.stepping import DONE
from .crossings import BEGIN, END, HUGE, STATUS, EventSearch, SearchedRun, fits, go
from .zeros import find_zero

AT_END = 2e-9  #: of a value at the begin of a step, below which it touches zero at its end
NEAR = 1e-3  #: of a step, next to whose ends rates are compared
AGAIN = 1e-9  #: of a step, next to whose ends nothing is looked for
TOUCHING = 1e-9  #: of a value at the ends of a step, below which it touches zero within it
BENT = 0.1  #: of values at the ends of a step, by which tangents may meet above zero where it is touched
GOLDEN = 0.6180339887498949  #: of a span, that is left of it in a step of its search
NOWHERE = 1e300  #: in place of the value of a dip that there is not


def find_dip(W: EventSearch, run: SearchedRun) -> float:
    """Where in the step that was taken a value is first beyond zero that is not so at its end, or
    touches it; 1 where none is.

    Events whose values touch zero there and go back are those `touched`. The present state is that
    at the end of the step, before and afterwards.
    """
    place = 1.0
    W.touched[:] = 0
    if find_near(W) == 0:
        return place
    run.keep_state(END)
    run.find_rates(1.0)
    W.last[:] = W.rates
    run.put_state(BEGIN)
    run.find_rates(0.0)
    W.first[:] = W.rates
    for k in range(len(W.signs)):
        if W.signs[k] != 0 and W.told[STATUS] == DONE:
            place = min(place, look_at(W, run, k, place))
    run.put_state(END)
    return place


def find_near(W: EventSearch) -> int:
    """Note signs of those values that may have dipped to zero in the step, as they changed in it
    and in the one before; their number.

        min(|latest|, |now|) <= |now - latest| + |latest - earlier|
    """
    count = 0
    for k in range(len(W.signs)):
        latest = W.latest[k]
        now = W.now[k]
        W.signs[k] = 0
        if min(abs(latest), abs(now)) <= abs(now - latest) + abs(latest - W.earlier[k]):
            if k < len(W.sides):
                W.signs[k] = W.sides[k]
            elif latest != 0.0:
                W.signs[k] = 1 if latest > 0.0 else -1
        if W.signs[k] != 0:
            count += 1
    return count


def ends_at_zero(W: EventSearch) -> bool:
    """Whether values touch zero where the step ends, as |x| and x^2 may; they are noted."""
    count = 0
    for k in range(len(W.sides)):
        side = W.sides[k]
        small = side * W.now[k] <= AT_END * abs(W.latest[k]) and abs(W.latest[k]) < HUGE
        if side != 0 and small and fits(W, k, -side):
            W.touched[k] = 1
            count += 1
    return count > 0


def look_at(W: EventSearch, run: SearchedRun, k: int, before: float) -> float:
    """Where a value dips to zero, or beyond it; 1 where it does not.

    It is noted as touched if no other one dips `before`.
    """
    floor = W.noise[k] + TOUCHING * (abs(W.latest[k]) + abs(W.now[k]))
    place, value = deepest(W, run, k, floor)
    if value > floor:
        return 1.0
    if value <= 0.0:
        if place < before:
            W.touched[:] = 0
        return place
    # margins say where a condition is true: one that touches is none
    if k >= len(W.sides) or not fits(W, k, -W.sides[k]):
        return 1.0
    if place < before:
        W.touched[:] = 0
    if place <= before:
        W.touched[k] = 1
    return place


def deepest(W: EventSearch, run: SearchedRun, k: int, floor: float) -> tuple[float, float]:
    """Where in (0, 1) a value is smallest beside zero, and that value, as far as it may be at a
    `floor` or below it; else NOWHERE.

    Where the cubic goes below the floor one look decides. Else the tangents of both ends bound what
    is convex from below: where they meet above the floor nothing touches it. Below it, the rate's
    zero says where.
    """
    sign = W.signs[k]
    first = sign * W.latest[k]
    last = sign * W.now[k]
    early = sign * W.first[k]
    late = sign * W.last[k]
    if not (early < 0.0 and late > 0.0):
        return beside_ends(W, run, k, (first, last), (early, late))
    place, value = cubic(first, last, early, late)
    if value <= floor:
        value = value_at(W, run, k, place)
        if value <= 0.0:
            return place, value
    meeting = (last - first - late) / (early - late)
    # |x| is not convex where x bends
    above = first + early * meeting > floor + BENT * (first + last)
    if not AGAIN < meeting < 1.0 - AGAIN or above:
        return 1.0, NOWHERE
    early = rate_at(W, run, k, NEAR)
    if not early < 0.0:
        return lowest(W, run, k, (0.0, 2.0 * NEAR))
    late = rate_at(W, run, k, 1.0 - NEAR)
    if not late > 0.0:
        return lowest(W, run, k, (1.0 - 2.0 * NEAR, 1.0))
    place = find_zero(W, run, k, rate_at, (NEAR, 1.0 - NEAR), (early, late), EXACT)
    value = value_at(W, run, k, place)
    # where a rate jumps, differences of values see it from NEAR on
    if floor < value <= NEAR * (first + last):
        return lowest(W, run, k, (place - 2.0 * NEAR, place + 2.0 * NEAR))
    return place, value


def beside_ends(
    W: EventSearch,
    run: SearchedRun,
    k: int,
    values: tuple[float, float],
    rates: tuple[float, float],
) -> tuple[float, float]:
    """The same of a value that is small at an end of a step, where its rate jumps beside it."""
    first, last = values
    early, late = rates
    if early >= 0.0 and first <= 4.0 * NEAR * last:
        ahead = (value_at(W, run, k, NEAR) - first) / NEAR
        if abs(ahead - early) > BENT * early:
            return lowest(W, run, k, (0.0, 2.0 * NEAR))
    if late <= 0.0 and last <= 4.0 * NEAR * first:
        behind = (last - value_at(W, run, k, 1.0 - NEAR)) / NEAR
        if abs(behind - late) > -BENT * late:
            return lowest(W, run, k, (1.0 - 2.0 * NEAR, 1.0))
    return 1.0, NOWHERE


def lowest(
    W: EventSearch, run: SearchedRun, k: int, span: tuple[float, float]
) -> tuple[float, float]:
    """Where a value that falls and rises is smallest in a span of the step, and that value, by
    golden sections.
    """
    low, high = max(span[0], 0.0), min(span[1], 1.0)
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    before = value_at(W, run, k, left)
    behind = value_at(W, run, k, right)
    while high - low > EXACT:
        if before < behind:
            high, right, behind = right, left, before
            left = high - GOLDEN * (high - low)
            before = value_at(W, run, k, left)
        else:
            low, left, before = left, right, behind
            right = low + GOLDEN * (high - low)
            behind = value_at(W, run, k, right)
    return left, min(before, behind)


def value_at(W: EventSearch, run: SearchedRun, k: int, place: float) -> float:
    """A value at a place in the step, with the sign that makes it positive at its begin."""
    go(W, run, BEGIN, 0.0, place)
    return W.signs[k] * W.values[k]


def rate_at(W: EventSearch, run: SearchedRun, k: int, place: float) -> float:
    """The change of it in a step, there."""
    value_at(W, run, k, place)
    run.find_rates(place)
    return W.signs[k] * W.rates[k]


def cubic(first: float, last: float, early: float, late: float) -> tuple[float, float]:
    """Place in (0, 1) and value of the smallest value of the cubic with these values and rates at
    its ends, which first falls and rises at last.
    """
    c = 3.0 * (last - first) - 2.0 * early - late
    d = early + late - 2.0 * (last - first)
    # the zero of early + 2 c s + 3 d s^2 at which it rises, without differences of what is alike
    root = math.sqrt(max(c * c - 3.0 * d * early, 0.0))
    place = -early / (c + root) if c > 0.0 else (root - c) / (3.0 * d)
    if not AGAIN < place < 1.0 - AGAIN:
        return 0.5, NOWHERE
    return place, first + place * (early + place * (c + place * d))
