r"""A zero of a function between two places of a step at which it has different signs.

    inverse quadratic interpolation through the last three places where it is sure to converge, else bisection

Source: T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a
nonlinear function without using derivatives, Adv. Eng. Softw. 28 (1997) 145-149,
doi:10.1016/S0965-9978(96)00051-8.
"""

from __future__ import annotations

from collections.abc import Callable

from ..dynamics.compiled_step.stepping import DONE
from .crossings import STATUS, EventSearch, SearchedRun

MOST = 200  #: places that are looked at: bisection of a step takes 40


def find_zero(
    W: EventSearch,
    run: SearchedRun,
    k: int,
    function: Callable[[EventSearch, SearchedRun, int, float], float],
    ends: tuple[float, float],
    values: tuple[float, float],
    exact: float,
) -> float:
    """The place between two `ends` at which the function of the number k is zero, `exact` to this
    part of a step; its values at the ends are known.
    """
    a, b = ends
    fa, fb = values
    c, fc = a, fa
    part = 0.5
    for _ in range(MOST):
        nearest, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        width = abs(b - a)
        if least == 0.0 or width <= 2.0 * exact or W.told[STATUS] != DONE:
            return nearest
        edge = exact / width
        place = a + min(max(part, edge), 1.0 - edge) * (b - a)
        value = function(W, run, k, place)
        if (value > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc = b, fb
            b, fb = a, fa
        a, fa = place, value
        part = 0.5
        if fc != fb and fc != fa:
            share = (a - b) / (c - b)
            height = (fa - fb) / (fc - fb)
            if height * height < share and (1.0 - height) * (1.0 - height) < 1.0 - share:
                part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                    fc - fb
                )
    return a
