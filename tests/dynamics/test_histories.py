"""Histories that change inside of steps: what the ends of the steps give is wrong, and a warning says so."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fmbs_skfem.bodies import point_mass
from fmbs_skfem.core.expressions import of_time
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.systems import At, assemble, loads

STEP = 0.01  #: [s]


def velocity(history: str) -> float:
    """Velocity at t = 1 s of 1 kg at rest, pushed by 1 N times a history: its integral."""
    push = loads.PointForce("push", At("m"), (1.0, 0.0), of_time(history))
    motion = integrate(assemble([point_mass("m", 1.0, np.zeros(2))], [], [push]), GeneralizedAlpha(STEP), 1.0)
    return float(motion.v[-1, 0])


@pytest.mark.parametrize(
    ("history", "exact"),
    [
        ("where(t < 0.5, 0, where(t < 0.5004, 2500, 0))", 1.0),  # begins at the end of a step: 25 times too much
        ("where(t < 0.503, 0, where(t < 0.508, 200, 0))", 1.0),  # between the ends: nothing
        ("10 * sin(2 * pi * t / 0.01)**2", 5.0),  # zero at all of them
        ("where(t < 0.02, 100 * sin(pi * t / 0.02), 0)", 4.0 / np.pi),  # two steps long
    ],
)
def test_what_the_ends_of_steps_do_not_see_is_warned_of(history: str, exact: float) -> None:
    with pytest.warns(Notice, match="a load on m changes inside of steps of 0.01 s"):
        found = velocity(history)
    assert abs(found - exact) > 0.05 * exact


@pytest.mark.parametrize(
    "history",
    ["1", "where(t < 0.5, 0, 1)", "sin(2 * pi * t / 0.1)", "where(t < 0.1, sin(pi * t / 0.1)**2, 0)", "1 + sin(t / 1e-3)"],
)
def test_what_they_see_is_not(history: str) -> None:
    """Steps and pulses of some steps, and what averages out beside the rest: the velocity is right to some percent."""
    fine = (np.arange(100_000) + 0.5) / 100_000
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*inside of steps")
        found = velocity(history)
    assert found == pytest.approx(of_time(history)(fine).mean(), abs=0.02)
