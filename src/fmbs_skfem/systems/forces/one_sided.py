r"""One-sided laws: what acts where s > 0 only, at once or over a length e of transition, and what
never becomes negative.

    ramp(s) = 0,  s^2 / 2e,  s - e/2    for    s <= 0,  0 < s < e,  s >= e

`lift` is its integral, `touch` its derivative. With e = 0 the ramp has a corner.
"""

from __future__ import annotations

from ...core.compiling.jit import jit


@jit
def lift(s: float, e: float) -> float:
    """Integral of the ramp from 0 to s.

        0,    s^3 / 6e,    (s - e/2)^2 / 2 + e^2 / 24

    for s <= 0, 0 < s < e, s >= e.
    """
    if s <= 0.0:
        return 0.0
    return s * s * s / (6.0 * e) if s < e else 0.5 * (s - 0.5 * e) ** 2 + e * e / 24.0


@jit
def ramp(s: float, e: float) -> float:
    """The ramp: s with a transition of the length e.

        0,    s^2 / 2e,    s - e/2

    for s <= 0, 0 < s < e, s >= e.
    """
    if s <= 0.0:
        return 0.0
    return 0.5 * s * s / e if s < e else s - 0.5 * e


@jit
def touch(s: float, e: float) -> float:
    """Derivative of the ramp, between 0 and 1.

        0,    s / e,    1

    for s <= 0, 0 < s < e, s >= e.
    """
    if s <= 0.0:
        return 0.0
    return s / e if s < e else 1.0


@jit
def closing(s: float, e: float) -> float:
    """Second derivative of the ramp.

        1 / e

    for 0 < s < e, else 0.
    """
    return 1.0 / e if 0.0 < s < e else 0.0


@jit
def kept(x: float, cut: float) -> float:
    """x, but 0 where x < 0 and `cut` is not 0."""
    return 0.0 if x < 0.0 and cut != 0.0 else x


@jit
def keeps(x: float, cut: float) -> float:
    """Derivative of `kept`."""
    return 0.0 if x < 0.0 and cut != 0.0 else 1.0
