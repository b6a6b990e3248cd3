"""Angles that count their turns: arguments of plane vectors on a motion, and the turns made between
its stored states.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from ...core.notices import notify

Part: TypeAlias = Any  #: a number or a history (s,)
Parts: TypeAlias = Sequence[Any] | np.ndarray  #: components of a vector

# a turn is lost at a change of pi: half of that is left to what the expected change errs by
TURN = 2.0 * np.pi  #: [rad]
DOUBT = 1.5  #: change of an angle from one stored state to the next beside the expected one, above which a turn may be lost [rad]

#: part of what a guess with accelerations is off, up to which one without them is better
CLEARER = 0.1


def angle_and_rates(y: Parts, rate: Parts, change: Parts) -> tuple[Part, Part, Part]:
    """Argument of a plane vector, in (-pi, pi] [rad], and its first and second derivative [rad/s,
    rad/s2].

        theta' = (z_0 z_1' - z_1 z_0') / |z|^2,    theta'' = (z_0 z_1'' - z_1 z_0'' - 2 (z . z') theta') / |z|^2

    `rate` and `change` are y' and y'', the components of each numbers or histories (s,), of which
    the vector is made as of y.
    """
    (z0, z1), (r0, r1), (c0, c1) = (
        (y, rate, change) if len(y) == 2 else plane_vectors(y, rate, change)
    )
    square, along = z0 * z0 + z1 * z1, z0 * r0 + z1 * r1
    speed = (z0 * r1 - z1 * r0) / square
    # of numpy for numbers as well, so that runs side by side have the bits of one
    value = float(np.arctan2(z1, z0)) if isinstance(z0, float) else np.arctan2(z1, z0)
    return value, speed, (z0 * c1 - z1 * c0 - 2.0 * along * speed) / square


def plane_vectors(y: Parts, rate: Parts, change: Parts) -> tuple[Parts, Parts, Parts]:
    """The plane vector z whose argument is an angle, and its two derivatives, of rows y with these
    derivatives.

        (a . b, b x a) of two plane vectors a and b;    (u . p, u . q) of vectors in space

    There are 4 rows of two arms a and b, from the second of which the angle counts; or 9 of u, and
    of p and q normal to the axis, which another place carries.
    """
    parts: list[tuple[Parts, tuple[Parts, Parts]]]
    if len(y) == 4:
        parts = [(part[:2], (part[2:], (-part[3], part[2]))) for part in (y, rate, change)]
    else:
        parts = [(part[:3], (part[3:6], part[6:])) for part in (y, rate, change)]
    (u, w), (du, dw), (ddu, ddw) = parts
    return (
        [product(u, p) for p in w],
        [product(du, p) + product(u, dp) for p, dp in zip(w, dw, strict=True)],
        [
            product(ddu, p) + 2.0 * product(du, dp) + product(u, ddp)
            for p, dp, ddp in zip(w, dw, ddw, strict=True)
        ],
    )


def product(a: Parts, b: Parts) -> Part:
    """a . b of vectors by their components."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def turns_between(
    h: Part, step: Part, speed: tuple[Part, Part], acceleration: tuple[Part, Part]
) -> tuple[Part, Part]:
    """How many whole turns an angle has made beside its change `step` [rad] in times h [s], and
    what that is off a guess by [rad].

        h / 2 (w0 + w1) + h^2 / 12 (w0' - w1')

    up to h^5 w'''' / 720, from its rates and accelerations before and behind; or the first summand
    alone, where it fits much better. Accelerations of elastic bodies under a load that begins are
    those of waves: a crank whose states were stored every millisecond gained a turn in the first.
    """
    number = isinstance(step, float)
    whole = round if number else np.rint
    guesses = [0.5 * h * (speed[1] + speed[0])]
    guesses.append(guesses[0] + h * h / 12.0 * (acceleration[0] - acceleration[1]))
    turns = [whole((guess - step) / TURN) for guess in guesses]
    off = [abs(step + TURN * one - guess) for one, guess in zip(turns, guesses, strict=True)]
    smooth = off[0] >= CLEARER * off[1]
    if number:
        return (turns[1], off[1]) if smooth else (turns[0], off[0])
    return np.where(smooth, turns[1], turns[0]), np.where(smooth, off[1], off[0])


def warn_of_doubt(name: str) -> None:
    """A notice of an angle whose change errs by more than DOUBT beside the expected one."""
    notify(
        f"{name}: stored states are too far apart to count the turns of the angle for certain; store more of them"
    )


def continuous(
    name: str, times: np.ndarray, angle: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> np.ndarray:
    """An angle (s,) known but for whole turns, with the turns that its angular velocity makes
    between the stored states.

    They are those of `turns_between`, so that states may be far apart. A notice where that leaves a
    doubt.
    """
    turns, off = turns_between(
        np.diff(times),
        np.diff(angle),
        (speed[:-1], speed[1:]),
        (acceleration[:-1], acceleration[1:]),
    )
    found = angle + TURN * np.append(0.0, np.cumsum(turns))
    if off.max(initial=0.0) > DOUBT:
        warn_of_doubt(name)
    return found
