"""Motions by a word, exact derivatives of functions of time, and how scenes ask for both."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values import jets, units
from fmbs_skfem.core.values.expressions import Expression, of_time
from fmbs_skfem.core.values.fields import Context
from fmbs_skfem.core.values.problems import Problems
from fmbs_skfem.core.values.profiles import MotionLimits, Move, motion, read
from fmbs_skfem.core.values.tables import Table

SPLINE = Table("goal", "", (0.0, 0.3, 0.6, 1.0), (0.0, 1.0, -1.0, 2.0), smooth=True, drives=True)


def derivatives(f: Expression, t: np.ndarray, near: float = 1e-9) -> np.ndarray:
    """f, f', f'' and the third derivative, as a difference, (4, s)."""
    step = 1e-6
    late, early = (jets.of_expression(f, t + d, near)[2] for d in (step, -step))
    return np.concatenate([jets.of_expression(f, t, near), [(late - early) / (2 * step)]])


@pytest.mark.parametrize(
    "text",
    [
        "sin(3*t)*exp(-t)/(1 + t**2) - cosh(t)*sinh(t)*tanh(t)",
        "tan(t) + asin(t/2) - acos(t/3) + atan2(t, 1 - t**2)",
        "sqrt(t)*log(1 + t) + t**t + 2**t + t**-2",
        "t**3 + abs(t - 0.43) + mod(5*t, 0.7) + floor(3*t) + sign(t - 0.2)",
        "min(t, 0.45)*max(t**2, 0.3) + where(t < 0.45, cos(t), 2*t)",
        "goal(sin(t)) + goal(t)*interp(t, 0.15, 1, 0.4, 2, 0.7, -1)",
    ],
)
def test_derivatives_are_those_of_differences(text: str) -> None:
    """Fourth-order differences of all functions that a text may name, away from corners."""
    f = of_time(text, inputs={"goal": SPLINE})
    t, d = np.linspace(0.11, 0.89, 7), 1e-3
    a, b, c, e = (f(t + k * d) for k in (-2, -1, 1, 2))
    first = (8 * (c - b) - (e - a)) / (12 * d)
    second = (16 * (b + c) - a - e - 30 * f(t)) / (12 * d**2)
    found = jets.of_expression(f, t, 1e-9)
    assert_allclose(found[0], f(t), rtol=1e-14)
    assert_allclose(found[1:], [first, second], rtol=1e-6, atol=1e-6)


def test_least_jerk() -> None:
    """T. Flash, N. Hogan, J. Neurosci. 5 (1985) 1688-1703: the largest rate is 15 D / (8 T) in the
    middle, the jerk 60 D / T^3 at the ends; the path is 10 s^3 - 15 s^4 + 6 s^5.
    """
    f = motion("minimum_jerk", [Move(3.0, 0.8)], begin=1.0, start=-0.2)
    s = np.array([0.0, 0.25, 0.5, 1.0])
    found = derivatives(f, -0.2 + 0.8 * s)
    assert_allclose(found[0], 1.0 + 2.0 * (10 * s**3 - 15 * s**4 + 6 * s**5), rtol=1e-15)
    assert found[1, 2] == pytest.approx(1.875 * 2.0 / 0.8, rel=1e-14)
    assert_allclose(found[1:3, [0, 3]], 0.0, atol=1e-12)
    assert f(-9.0) == 1.0
    assert f(9.0) == 3.0
    # by limits alone the fastest: each of them is reached, in turn
    at = np.linspace(0.0, 1.0, 20001)
    for order, limits in enumerate((MotionLimits(speed=4.0), MotionLimits(acceleration=30.0)), 1):
        fastest = motion("minimum_jerk", [Move(2.0)], limits=limits)
        assert np.abs(jets.of_expression(fastest, at, 1e-9)[order]).max() == pytest.approx(
            limits[order - 1], rel=1e-6
        )
    assert derivatives(
        motion("minimum_jerk", [Move(2.0)], limits=MotionLimits(jerk=300.0)), np.array([1e-5])
    )[3, 0] == pytest.approx(300.0, rel=1e-3)


@pytest.mark.parametrize("way", [0.3, 2.0])
@pytest.mark.parametrize(
    "limits",
    [
        MotionLimits(2.0, 8.0),
        MotionLimits(2.0, 8.0, 90.0),
        MotionLimits(2.0, 8.0, 20.0),
        MotionLimits(acceleration=8.0, jerk=90.0),
    ],
)
def test_trapezoids_reach_their_limits_and_keep_them(way: float, limits: MotionLimits) -> None:
    """L. Biagiotti, C. Melchiorri, Trajectory planning for automatic machines and robots (2008),
    3.2 and 3.4: the shortest time of a double S is D / v + v / a + a / j where all are reached.
    """
    f = motion("trapezoidal", [Move(-way)], limits=limits)
    t = np.linspace(-0.1, 3.0, 62001) + 1e-7
    found = np.abs(derivatives(f, t)[1:])
    # differences over corners of the acceleration are no jerk
    largest = [
        *found[:2].max(axis=1),
        np.median(found[2][found[2] > 1.0]) if np.isfinite(limits.jerk) else 0.0,
    ]
    for size, most in zip(largest, limits, strict=True):
        assert size <= most * (1.0 + 1e-6)
    end = float(t[np.flatnonzero(found[0] > 1e-9)[-1]])
    v, a, j = largest[0], largest[1], limits.jerk
    ramp = v / a + (a / j if np.isfinite(j) else 0.0)
    assert end == pytest.approx(way / v + ramp, abs=1e-3)
    assert f(9.0) == pytest.approx(-way, rel=1e-14)
    assert max(v / limits.speed, a / limits.acceleration, largest[2] / j) == pytest.approx(
        1.0, rel=1e-4
    )
    slow = motion("trapezoidal", [Move(-way, 2.5)], limits=limits)
    assert slow(2.5 - 1e-3) > slow(2.5) == slow(2.6)
    assert np.abs(derivatives(slow, t)[2]).max() <= limits.acceleration * (1.0 + 1e-6)


def test_several_moves_rest_between_each_other() -> None:
    """One function of all: it dwells, comes back, and may begin before the run."""
    moves = [Move(1.0, 0.5, dwell=0.2), Move(1.0, 0.1), Move(-0.5, 0.4, start=1.0)]
    for f in (
        motion("minimum_jerk", moves, start=-0.1),
        motion("trapezoidal", moves, start=-0.1, limits=MotionLimits(acceleration=90.0)),
    ):
        t = np.array([-0.2, -0.1, 0.4, 0.7, 1.0, 1.4, 2.0])
        assert_allclose(f(t), [0.0, 0.0, 1.0, 1.0, 1.0, -0.5, -0.5], atol=1e-15)
        assert_allclose(of_time(f.text)(t), f(t))


def test_a_way_of_nothing_rests() -> None:
    assert motion("minimum_jerk", [Move(0.3, 0.0)], begin=0.3).text == "0.3"
    assert motion("trapezoidal", [Move(0.3)], begin=0.3)(1.0) == 0.3


def test_units_and_parameters() -> None:
    """Values and limits in units of what is driven, and in expressions of parameters."""
    parameters = {"w": units.measure("30 deg")}
    given = {
        "profile": "trapezoidal",
        "to": "3 * w",
        "start": "100 ms",
        "speed": "180 deg/s",
        "acceleration": "w / (10 ms)**2",
    }
    found = read(given, Context(2, parameters), units.ANGLE)
    limits = MotionLimits(np.pi, np.pi / 6 / 1e-4)
    assert_allclose(
        of_time(found)(np.linspace(0.0, 1.0, 9)),
        motion("trapezoidal", [Move(np.pi / 2)], start=0.1, limits=limits)(np.linspace(0, 1, 9)),
        rtol=1e-13,
    )


FAST = {"speed": 2, "acceleration": 8}
WRONG = {
    "duration: expected a duration of 1.25 s at least": {"to": 2, "duration": 1, **FAST},
    "duration: expected a duration, or limits that it follows from": {"to": 2},
    "duration: expected a duration > 0": {"to": 2, "duration": 0},
    "expected one of the keys 'to' and 'moves', got both": {"to": 2, "moves": [{"to": 1}]},
    "expected one of the keys 'to' and 'moves', got neither": {},
    "duration: expected a duration in each": {"moves": [{"to": 1}], "duration": 1},
    r"moves.1.start: expected a start at 0.5 s or later": {"moves": [{"to": 1, "duration": 0.5}, {"to": 2, "start": 0.4}]},
    r"moves.0: expected a length": {"moves": [{"to": "1 kg", "duration": 0.5}]},
    "speed: expected a velocity": {"to": 1, "speed": "1 rad/s"},
    "speed: expected a velocity .* > 0": {"to": 1, "speed": 0},
    "stop: expected one of the keys": {"to": 1, "stop": 0},
}  # fmt: skip


@pytest.mark.parametrize("message", WRONG)
def test_what_is_wrong_says_where_and_what_to_do(message: str) -> None:
    word = "trapezoidal" if "1.25" in message else "minimum_jerk"
    with pytest.raises(InputError, match=message):
        read({"profile": word, **WRONG[message]}, Context(2), units.LENGTH)


def test_a_trapezoid_needs_a_limit_of_its_acceleration() -> None:
    with pytest.raises(Problems, match="acceleration: expected a limit of the acceleration"):
        motion("trapezoidal", [Move(1.0, 2.0)])


@pytest.mark.parametrize(
    "text",
    [
        "0, 0, 1, 1, 0.6",
        "0 s, 0, 1 s, 1, 0",
        "0, 0, 1, 1, 400 ms, 0.3",
        "1, 0, 1, 1, 0.4",
        "0, 0, 1, 1",
    ],
)
def test_sides_that_do_not_fit(text: str) -> None:
    """Sides of more than half of the time, or of none, roundings of more than half of a side."""
    with pytest.raises(InputError, match=r"of trapezoidal|trapezoidal\(x"):
        of_time(f"trapezoidal(t, {text})")
