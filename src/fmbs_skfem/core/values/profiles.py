r"""Motions by a word: from value to value, each as fast as its limits allow, or as long as is said.

    angle: {profile: minimum_jerk, to: 90 deg, start: 0.2 s, duration: 1 s}
    angle: {profile: trapezoidal, moves: [{to: 90 deg, dwell: 0.1 s}, {to: 0}], speed: 2 rad/s, acceleration: 8 rad/s^2}

A profile is a text of `expressions`, a sum of `minimum_jerk(t, ...)` or `trapezoidal(t, ...)`. A way D
takes with the least jerk, and with a trapezoid of the rate v, whose sides take r,

    T >= 15 D / (8 v),  (10 D / (3^(1/2) a))^(1/2),  (60 D / j)^(1/3)        T = D / v + r,  r = v / a + a / j

by limits v, a, j of rate, acceleration and jerk; r = 2 (v / j)^(1/2) where a is not reached.
Sources: T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688-1703, doi 10.1523/JNEUROSCI.05-07-01688.1985;
L. Biagiotti, C. Melchiorri, Trajectory planning for automatic machines and robots, Springer 2008,
sections 3.2 and 3.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

from ..storage.records import dataclass
from . import expressions, quantities, units
from .expressions import Expression
from .fields import ANY, Context, Takes, quantity
from .mappings import read_struct
from .problems import Keys, Problem, Problems, read_all

ROUND = 1e-9  #: part of a duration by which it may be missed
RAW = Takes(lambda value, context: value, ANY.schema)  #: until its unit is known
Clock = Annotated[float, quantity("s")]
Duration = Annotated[float, quantity("s", ">= 0")]
Word: TypeAlias = Literal["minimum_jerk", "trapezoidal"]


@dataclass(frozen=True)
class Move:
    """One motion of several: to a value, in a `duration`, or as fast as the limits allow.

    It begins where the one before ends and has rested for its `dwell`, or at a `start` behind that.
    """

    to: Annotated[Any, RAW]
    duration: Duration | None = None
    dwell: Duration = 0.0
    start: Clock | None = None


@dataclass(frozen=True)
class MotionProfile:
    """A function of time that goes from value to value, `from` one (0 by default) `to` another one,
    or by several `moves`, and rests before and behind.

    `minimum_jerk` has continuous accelerations; `trapezoidal` is a trapezoid of the rate, and with
    a limit of the jerk an S-curve. Values and limits have the unit of what is driven. Without a
    duration a motion is as fast as its limits allow, with one it may be slower. The acceleration
    of a trapezoid is its limit.

    {profile: minimum_jerk, to: 90 deg, start: 0.2 s, duration: 1 s}
    """

    profile: Word
    to: Annotated[Any, RAW, "where it ends"] | None = None
    moves: tuple[Move, ...] = ()
    from_: Annotated[Any, RAW, "where it begins"] = 0.0
    start: Clock = 0.0
    duration: Duration | None = None
    speed: Annotated[Any, RAW, "largest rate"] | None = None
    acceleration: Annotated[Any, RAW, "largest acceleration"] | None = None
    jerk: Annotated[Any, RAW, "largest jerk"] | None = None


class MotionLimits(NamedTuple):
    """Largest derivatives of a motion, in its unit and seconds."""

    speed: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf


def motion(
    profile: Word,
    moves: Sequence[Move],
    begin: float = 0.0,
    start: float = 0.0,
    limits: MotionLimits = MotionLimits(),  # noqa: B008
) -> Expression:
    """The function of time of a profile, in SI units, which begins at a value and a time [s].

    `Problems` where a move is faster than its limits, or begins before the one before it ends.

        >>> from fmbs_skfem.core.values.profiles import Move, motion
        >>> turn = motion("minimum_jerk", [Move(to=1.0, duration=2.0)], start=0.5)
        >>> turn(0.5), turn(1.5), turn(9.0)
        (0.0, 0.5, 1.0)
    """
    return expressions.of_time(write(profile, moves, begin, start, limits))


def read(value: object, context: Context, dimension: units.Dimension) -> str:
    """The text of a profile of a scene, of a dimension."""
    given: MotionProfile = read_struct(MotionProfile, value, context)
    if (given.to is None) == (not given.moves):
        got = "neither" if given.to is None else "both"
        raise Problem("one of the keys 'to' and 'moves'", got, "write `to: 90 deg`")
    if given.moves and given.duration is not None:
        got = "one of all moves"
        raise Problems([(("duration",), Problem("a duration in each of the moves", got))])
    moves = given.moves or (Move(given.to, given.duration),)
    convert = partial(read_number, context=context, dimension=dimension)
    bounds = {
        name: one for name in MotionLimits._fields if (one := getattr(given, name)) is not None
    }
    ends = [(k, partial(convert, one.to)) for k, one in enumerate(moves)]
    orders = {name: order for order, name in enumerate(MotionLimits._fields, 1)}
    begin, to, *found = read_all(
        [
            ("from", lambda: convert(given.from_)),
            ("moves", lambda: read_all(ends)) if given.moves else ("to", lambda: [ends[0][1]()]),
            *((name, partial(convert, one, order=orders[name])) for name, one in bounds.items()),
        ]
    )
    limits = MotionLimits(**dict(zip(bounds, found, strict=True)))
    moves = tuple(replace(one, to=end) for one, end in zip(moves, to, strict=True))
    return write(given.profile, moves, begin, given.start, limits, bool(given.moves))


def read_number(
    value: object, context: Context, dimension: units.Dimension, order: int = 0
) -> float:
    """A value of a dimension, or a limit above 0 of one of its derivatives by time."""
    if not order:
        return quantities.convert(value, dimension, context.parameters)
    kg, m, s, rad = dimension.exponents
    unit = units.unit((kg, m, s - order, rad))
    found: float = quantity(unit, "> 0").read(value, context)
    return found


def write(
    profile: Word,
    moves: Sequence[Move],
    begin: float,
    start: float,
    limits: MotionLimits,
    several: bool = True,
) -> str:
    """The text of a profile; `several` for keys of moves in messages."""
    texts = list[str]()
    value = begin
    end = start
    for k, move in enumerate(moves):
        at: Keys = ("moves", k) if several else ()
        first = end if move.start is None else move.start
        if first < end - ROUND * max(abs(end), abs(first)):
            expected = f"a start at {end:.6g} s or later, when the move before it has ended"
            raise Problems([((*at, "start"), Problem(expected, f"{first:.6g} s"))])
        rise = float(move.to) - value
        try:
            length, *more = (
                TIMES[profile](abs(rise), move.duration, limits)
                if rise
                else (move.duration or 0.0,)
            )
        except Problem as problem:
            raise Problems([((*at, "duration"), problem)]) from None
        end = first + length
        if rise:
            # a sum of motions, all but the first of which begin at 0
            low = 0.0 if texts else begin
            numbers = first, low, end, low + rise, *more
            texts.append(f"{profile}(t, {', '.join(map(repr, numbers))})")
        value = float(move.to)
        end += move.dwell
    return " + ".join(texts) or repr(begin)


def require_time(least: float, duration: float | None) -> float:
    """The duration of a motion that takes `least` [s] by its limits; a Problem where it is
    shorter.
    """
    if duration is None and least == 0.0:
        remedy = "add `duration: 1 s`, or limits `speed`, `acceleration`"
        raise Problem("a duration, or limits that it follows from", "neither", remedy)
    if duration is None:
        return least
    if duration == 0.0:
        remedy = f"the shortest one is {least:.6g} s" if least else "no motion is that fast"
        raise Problem("a duration > 0 of a motion from a value to another one", "0 s", remedy)
    if duration < least * (1.0 - ROUND):
        # rounded up, so that the number of the message does
        digits = 5 - math.floor(math.log10(least))
        shortest = math.ceil(least * 10.0**digits) / 10.0**digits
        remedy = "lengthen it, or leave it out for the shortest one"
        expected = f"a duration of {shortest:.6g} s at least, by the limits"
        raise Problem(expected, f"{duration:.6g} s", remedy)
    return max(duration, least)


def time_smooth(way: float, duration: float | None, limits: MotionLimits) -> tuple[float, ...]:
    """The duration [s] of a motion of the least jerk over a way."""
    v, a, j = limits
    least = max(
        1.875 * way / v, (10.0 / math.sqrt(3.0) * way / a) ** 0.5, (60.0 * way / j) ** (1 / 3)
    )
    return (require_time(least, duration),)


def time_trapezoid(way: float, duration: float | None, limits: MotionLimits) -> tuple[float, ...]:
    """The duration [s] of a trapezoid over a way, with the time of its sides and of their
    rounding.
    """
    v, a, j = limits
    if math.isinf(a):
        expected = "a limit of the acceleration of a trapezoid"
        raise Problems([(("acceleration",), Problem(expected, "none", "add it"))])
    # the rate that is reached where the sides take all of the way
    peak = 0.5 * a * (math.sqrt((a / j) ** 2 + 4.0 * way / a) - a / j)
    if peak * j < a * a:
        peak = (0.5 * way * math.sqrt(j)) ** (2.0 / 3.0)
    v = min(v, peak)
    whole = require_time(way / v + sides(v, a, j)[0], duration)
    if duration is not None:
        from scipy.optimize import brentq

        late = lambda rate: way / rate + sides(rate, a, j)[0] - whole  # noqa: E731
        # falls with the rate, down to the shortest time at v
        v = float(brentq(late, way / whole, v, xtol=1e-300, rtol=1e-15)) if late(v) < 0.0 else v
    return whole, *sides(v, a, j, whole)


def sides(v: float, a: float, j: float, whole: float = math.inf) -> tuple[float, ...]:
    """The time of the sides of a trapezoid [s], half of the `whole` one at most, and with a limit
    of the jerk that of their rounding.
    """
    if math.isinf(j):
        return (min(v / a, 0.5 * whole),)
    r = min(a / j, math.sqrt(v / j))
    ramp = min(r + max(v / a, r), 0.5 * whole)
    return ramp, min(r, 0.5 * ramp)


Times: TypeAlias = Callable[[float, float | None, MotionLimits], tuple[float, ...]]
#: how long a motion takes, and what its function takes behind its ends
TIMES: Mapping[Word, Times] = {"minimum_jerk": time_smooth, "trapezoidal": time_trapezoid}
