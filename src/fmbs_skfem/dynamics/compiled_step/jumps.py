r"""Instants at which loads jump: a step ends before each of them, and another one begins behind it.

    s(t*-) != s(t*+),  t_n < t* <= t_n + h:      from t_n to t*-,   q'' and multipliers jump (`stepping.jump`),   t*+ to t_n + h

A step reads loads at its end. One that jumps in it, or there, is on the wrong side for up to h, an
impulse of F h, so that the motion would be of first order. Jumps of drives are impulses, and no
step is right there.

A jump is in a part of an expression, a comparison or a whole number, or in any other function from
the end of a step to the next: a change that stays as large as it is in ever shorter intervals.

Drives whose acceleration alone jumps, as at the corners of a trapezoid of the rate, bend there, and
q'' with them: a step over such a corner would pass the jump on to those behind it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, singledispatch
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...core.values.expressions import Expression
from ...core.values.inputs import GivenInput, Input
from ...systems.forces import responses
from ...systems.forces.force_laws import LawForces
from ...systems.signals import BoundExpression, exact_path, jet, read_inputs
from ...systems.system import System, driving
from ..histories import SIDE, of_histories

#: (s, k) of k functions at times (s,) [s], one of which jumps where a load does; or, with
#: `margins`, of what changes its sign there
Traces: TypeAlias = Callable[..., np.ndarray]
# 4 and 64 take as long; with 2 an expression takes four times as long
PARTS = 16  #: of an interval that is narrowed
SMOOTH = 2.0  #: times its mean slope, from which a change in a part of an interval may be a jump; such ones are looked at further
LEFT = 0.01  #: of a change, in the last interval, from which it is a jump; smooth ones leave 1e-12
SMALL = 1e-6  #: of the range of a load, up to which a jump is round-off
EXACT = 1e-12  #: of a step, to which instants are found
ULPS = 8.0  #: units of the last place of an instant, which sums of times do not leave
SAME = 1e-9  #: of a step, within which an instant is the end of one
#: jumps over steps up to which steps end there: each costs as much as some ten of them, and noise
#: has one in every step
MANY = 0.1
AT_ONCE = 10_000  #: steps

RATE = 1e-3  #: of a step: what an acceleration makes in it is no jump of a rate, nor of a value


class Jump(NamedTuple):
    """An instant at which loads jump, or drives bend, in a step."""

    place: float  #: in the step, 0 to 1
    before: float  #: the last instant before [s]
    behind: float  #: the first one behind it [s]
    bends: bool  #: whether the acceleration of a drive jumps there


Jumps: TypeAlias = dict[int, list[Jump]]  #: by numbers of steps


@singledispatch
def traces(signal: Any) -> Traces | None:
    """Functions that jump where a history does; None for one that is given step by step. Types of
    histories register here.
    """
    return lambda times, margins=False: (
        np.asarray(signal(times))[:, None] if not margins else np.zeros((len(times), 0))
    )


@traces.register
def _(signal: Expression) -> Traces | None:
    return None if read_inputs(signal) else signal.switches


@traces.register
def _(signal: Input | GivenInput | BoundExpression) -> Traces | None:
    return None


def jumps_of_loads(system: System, step: float, steps: int) -> Jumps:
    """Where the loads of a system jump, and drives bend, in so many steps [s]; at the start alone
    where they do so in more than MANY of them.
    """
    found = of_histories(
        system, "load jumps", step, steps, lambda: jumps_of_signals(system, step, steps)
    )
    start = [one for one in found.get(0, []) if one.place == 0.0]
    return found if len(found) <= MANY * steps else {0: start} if start else {}


def jumps_of_signals(system: System, step: float, steps: int) -> Jumps:
    """The same, however many there are."""
    driven = {signal for _, signal in driving(system.constraints)}
    instants = list[tuple[float, float, bool]]()
    for k, signal in enumerate(system.signals):
        if k in driven:
            found_here = corners(signal, step, steps)
        elif (functions := traces(signal)) is not None:
            found_here = [at for at in found_in(functions, step, steps) if is_jump(signal, at)]
        else:
            continue
        instants += [(*at, k in driven) for at in found_here]
    laws = [one for one in system.loads.forces if isinstance(one, LawForces)]
    instants += [
        (*at, False)
        for law in laws
        for functions in responses.switches(law)
        for at in found_in(functions, step, steps)
    ]
    found: Jumps = {}
    for before, behind, bends in sorted(instants):
        number = max(int(np.ceil(behind / step - SAME)) - 1, 0)
        place = min(behind / step - number, 1.0)
        place = 1.0 if place > 1.0 - SAME else place if place > SAME else 0.0
        here = found.setdefault(number, [])
        if not here or place > here[-1].place + SAME:
            here.append(Jump(place, before, behind, bends))
        elif bends:
            here[-1] = here[-1]._replace(bends=True)
    return found


def corners(signal: Any, step: float, steps: int) -> list[tuple[float, float]]:
    """Instants before and behind which the acceleration of a drive differs, and its rate does not.

    Those of texts; nothing is known of functions of Python, and of what is given step by step.
    """
    path = exact_path(signal)
    if not isinstance(path, Expression):
        return []
    found = list[tuple[float, float]]()
    for before, behind in found_in(partial(path.switches, bends=True), step, steps):
        sides = zip((before, behind), (-SIDE * step, SIDE * step), strict=True)
        (y, v, a), (y1, v1, a1) = (jet(path, np.array([t]), near)[:, 0] for t, near in sides)
        size = max(abs(a), abs(a1))
        least = RATE * size * step
        same = abs(v1 - v) <= least and abs(y1 - y) <= least * step + SMALL * abs(y)
        if same and abs(a1 - a) > SMALL * size:
            found.append((before, behind))
    return found


def is_jump(signal: Callable[[np.ndarray], np.ndarray], instant: tuple[float, float]) -> bool:
    """Whether a function of time has different values before and behind an instant: parts of it may
    jump where it does not.
    """
    before, behind = signal(np.array(instant))
    return bool(abs(behind - before) > SMALL * max(abs(before), abs(behind)))


def found_in(functions: Traces, step: float, steps: int) -> list[tuple[float, float]]:
    """The last instant before each jump, and the first one behind it [s]."""
    found = list[tuple[float, float]]()
    for first in range(0, steps, AT_ONCE):
        times = step * np.arange(first, min(first + AT_ONCE, steps) + 1)
        times = np.unique(
            np.concatenate(
                [times, crossings(partial(functions, margins=True), times, EXACT * step)]
            )
        )
        low, high = narrowed(functions, times, functions(times), EXACT * step)
        found += zip(low.tolist(), high.tolist(), strict=True)
    return found


def crossings(margins: Traces, times: np.ndarray, width: float) -> np.ndarray:
    """Times (j,) between given ones (s,), at which margins have the other sign than at those
    around, as in a short pulse.

    They come nearest to zero there: again and again the two of PARTS parts about the nearest time
    are kept, to a width [s].
    """
    values = margins(times)
    size = np.abs(values)
    same = (values[:-2] * values[1:-1] > 0.0) & (values[1:-1] * values[2:] > 0.0)
    rows, columns = np.nonzero(same & (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]))
    low = times[rows]
    high = times[rows + 2]
    signs = np.sign(values[rows + 1, columns])
    found = list[np.ndarray]()
    while len(low) and (high - low > np.maximum(width, ULPS * np.spacing(high))).any():
        inside, mine = sampled(margins, low, high, columns)
        mine = signs[:, None] * mine
        nearest = np.clip(mine.argmin(axis=1), 1, PARTS - 1)[:, None]
        beyond = mine.min(axis=1) <= 0.0
        found.append(np.take_along_axis(inside, mine.argmin(axis=1)[:, None], 1)[beyond, 0])
        low, high = (np.take_along_axis(inside, nearest + k, 1)[~beyond, 0] for k in (-1, 1))
        columns = columns[~beyond]
        signs = signs[~beyond]
    return np.concatenate([np.zeros(0), *found])


def sampled(
    functions: Traces, low: np.ndarray, high: np.ndarray, columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Times (j, PARTS + 1) from `low` to `high` (j,), and what the functions of these numbers (j,)
    are there.
    """
    inside = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, PARTS + 1)
    inside[:, -1] = high
    return inside, functions(inside.ravel()).reshape(*inside.shape, -1)[
        np.arange(len(low)), :, columns
    ]


def narrowed(
    functions: Traces, times: np.ndarray, values: np.ndarray, width: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (j,) of jumps of functions, from the intervals of times (s,) with values (s, k), to a
    width [s].

    Again and again the one of PARTS parts of an interval is kept in which a function changes most.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        changes = np.nan_to_num(np.abs(np.diff(values, axis=0)))
        rows, columns = np.nonzero(
            changes > SMALL * np.nan_to_num(np.abs(values)).max(axis=0, initial=0.0)
        )
        low = times[rows]
        high = times[rows + 1]
        last = changes[rows, columns]
        whole = changes[rows, columns]
        end = np.maximum(width, ULPS * np.spacing(high))
        first = True
        while len(low) and (high - low > end).any():
            inside, found = sampled(functions, low, high, columns)
            changes = np.nan_to_num(np.abs(np.diff(found, axis=1)))
            part = changes.argmax(axis=1)[:, None]
            low, high, last = (
                np.take_along_axis(one, at, 1)[:, 0]
                for one, at in ((inside, part), (inside, part + 1), (changes, part))
            )
            kept = (last > SMOOTH / PARTS * whole) | (not first)
            columns, low, high, end, last, whole = (
                one[kept] for one in (columns, low, high, end, last, whole)
            )
            first = False
        jumped = last > LEFT * whole
    # away from the jump by what sums of times may err
    return np.maximum(low - end, 0.0)[jumped], (high + end)[jumped]
