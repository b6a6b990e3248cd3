r"""Values that cross zero twice within a step, or touch it: their sign is that of before at its
end, and their rates show it.

    s g > 0,  s g' < 0 at the begin,  s g > 0,  s g' > 0 at the end:    g dips, the cubic through the four says where;
    |x| and x^2 touch zero where the rate is zero

Rates are differences along q' and q''. Of what is read of reactions and energies there are none: it
is looked at at the ends alone. Comparisons have none either: it is their margins that dip.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..dynamics.compiled_step.pieces import EXACT, take_piece
from ..dynamics.dividing import put
from ..dynamics.measuring import Reader
from ..systems import compiled as compilation

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

NEAR = 1e-3  #: of a step, over which rates are differences
AGAIN = 1e-6  #: of a step, next to whose ends nothing is looked for
TOUCHING = 1e-9  #: of a value at the ends of a step, below which it touches zero within it


class Ends(NamedTuple):
    """A value at both ends of a step and its rates over the step, with the sign that makes it
    positive at its begin.
    """

    first: float
    last: float
    early: float
    late: float


class Dip(NamedTuple):
    """Where in a step a value is smallest beside zero, and what it is there."""

    place: float
    value: float
    number: int  #: of the value


def near(before: np.ndarray, last: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Which values (t,) may have dipped to zero in the step from `last` to `now`, as they changed
    in that and the one before it.

        min(|last|, |now|) <= |now - last| + |last - before|
    """
    return np.asarray(
        np.minimum(np.abs(last), np.abs(now)) <= np.abs(now - last) + np.abs(last - before)
    )


def rates(run: OpenRun, numbers: Sequence[int], time: float) -> np.ndarray:
    """Changes (t,) of values in a step as they are in the present state, at this time [s]; nan of
    those that forces do not keep.
    """
    model = run.model
    state = run.step.state
    h = run.scheme.step
    back = np.argsort(model.order)
    found = []
    x, v, a = (part[back] for part in (state.x, state.v, state.acceleration))
    for d in (-NEAR * h, NEAR * h):
        found.append(compilation.accepted(model, x + d * v, v + d * a, state.memory, time + d))
    change = (found[1] - found[0]) / (2 * NEAR)
    return np.array([np.nan if k < 0 else change[run.kept_values[k]] for k in numbers])


def search(
    run: OpenRun,
    numbers: Sequence[int],
    before: Sequence[np.ndarray],
    trail: Sequence[np.ndarray],
    signs: np.ndarray,
    noise: np.ndarray,
) -> Iterable[Dip]:
    """Dips to zero or beyond it in the step that was taken from the state `before`, which is put
    back afterwards.

    `trail` has the values (t,) one step earlier, at the begin, and at the end; `signs` (t,) are 0
    for those that are not looked at.
    """
    early_values, last, now = trail
    some = np.flatnonzero((signs != 0) & near(early_values, last, now))
    h = run.scheme.step
    state = run.step.state
    if not len(some):
        return
    after = [part.copy() for part in state]
    late = rates(run, numbers, h * run.done)
    put(state, before)
    run.done -= 1
    early = rates(run, numbers, h * run.done)
    reader = run.find(Reader)

    def look(k: int, place: float) -> tuple[float, float]:
        put(state, before)
        take_piece(run, 0.0, place)
        time = h * (run.done + place)
        return signs[k] * reader.read(run, [numbers[k]], time)[0], signs[k] * rates(
            run, [numbers[k]], time
        )[0]

    for k in some.tolist():
        ends = Ends(*(float(signs[k] * part[k]) for part in (last, now, early, late)))
        floor = float(noise[k]) + TOUCHING * (abs(ends.first) + abs(ends.last))
        place, value = deepest(ends, partial(look, k), floor)
        if value <= floor:
            yield Dip(place, value, k)
    run.done += 1
    put(state, after)


def deepest(
    ends: Ends, look: Callable[[float], tuple[float, float]], floor: float
) -> tuple[float, float]:
    """Where in (0, 1) a value of these `ends` is smallest, and that value, as far as it may be at a
    `floor` or below it; else inf.

    `look` gives value and rate at a place. Where the cubic goes below the floor one look decides.
    Else the tangents of both ends bound what is convex from below: where they meet above the floor
    nothing touches it. Below it, the rate's zero says where.
    """
    if not (ends.early < 0.0 < ends.late):
        return 1.0, np.inf
    place, value = cubic(ends)
    if value <= floor and (value := look(place)[0]) <= 0.0:
        return place, value
    meeting = (ends.last - ends.first - ends.late) / (ends.early - ends.late)
    if not (AGAIN < meeting < 1 - AGAIN) or ends.first + ends.early * meeting > floor:
        return 1.0, np.inf
    from scipy.optimize import brentq  # which imports all of scipy.optimize: here alone

    if not (look(NEAR)[1] < 0.0 < look(1.0 - NEAR)[1]):
        return 1.0, np.inf
    place = brentq(lambda s: look(s)[1], NEAR, 1.0 - NEAR, xtol=EXACT)
    return place, look(place)[0]


def cubic(ends: Ends) -> tuple[float, float]:
    """Place in (0, 1) and value of the smallest value of the cubic with these ends, which first
    falls.
    """
    a, b, da, db = ends
    c, d = 3 * (b - a) - 2 * da - db, da + db - 2 * (b - a)
    places = [
        r.real
        for r in np.roots([3 * d, 2 * c, da])
        if abs(r.imag) < AGAIN and AGAIN < r.real < 1 - AGAIN
    ]
    return min(
        ((s, a + s * (da + s * (c + s * d))) for s in places),
        key=lambda one: one[1],
        default=(0.5, np.inf),
    )
