"""Histories that change inside of steps: what the ends of the steps give is wrong, and a warning
says so.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest

from fmbs_skfem.bodies import point_mass
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.control.controllers import Pid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.dynamics.diagnoses import step_size
from fmbs_skfem.systems import At, Motion, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlForce
from fmbs_skfem.systems.measures import probes

STEP = 0.01  #: [s]
Push: TypeAlias = Callable[[str], loads.Load]


def pushed(history: str) -> loads.Load:
    """1 N times a history."""
    return loads.PointForce("push", At("m"), (1.0, 0.0), of_time(history))


def controlled(history: str) -> loads.Load:
    """The same as an expression of the state, which changes it by less than 1e-6."""
    return ControlForce(
        "push", At("m"), (1.0, 0.0), of_state(f"({history}) * (1 + 1e-9 * stretch * rate)")
    )


PUSHES = pytest.mark.parametrize("push", [pushed, controlled])


def velocity(push: loads.Load) -> float:
    """Velocity at t = 1 s of 1 kg at rest under a load: its impulse."""
    motion = integrate(
        assemble([point_mass("m", 1.0, np.zeros(2))], [], [push]), GeneralizedAlpha(STEP), 1.0
    )
    return float(motion.v[-1, 0])


@PUSHES
@pytest.mark.parametrize(
    ("history", "exact"),
    [
        (
            "where(sin(2 * pi * t / 0.01 + 0.3) < 0, 2, 0)",
            1.0,
        ),  # there and back between the ends of every step: nothing
        ("10 * sin(2 * pi * t / 0.01)**2", 5.0),  # zero at all of them
        ("where(t < 0.02, 100 * sin(pi * t / 0.02), 0)", 4.0 / np.pi),  # two steps long
    ],
)
def test_what_the_ends_of_steps_do_not_see_is_warned_of(
    push: Push, history: str, exact: float
) -> None:
    with pytest.warns(
        Notice,
        match="a load on m changes faster than the step of 0.01 s: its integral over time is wrong by up to",
    ):
        found = velocity(push(history))
    assert abs(found - exact) > 0.05 * exact


@PUSHES
@pytest.mark.parametrize(
    "history",
    [
        "1",
        "where(t < 0.5, 0, 1)",
        "sin(2 * pi * t / 0.1)",
        "where(t < 0.1, sin(pi * t / 0.1)**2, 0)",
        "1 + sin(t / 1e-3)",
    ],
)
def test_what_they_see_is_not(push: Push, history: str) -> None:
    """Steps and pulses of some steps, and what averages out beside the rest: the velocity is right
    to some percent.
    """
    fine = (np.arange(100_000) + 0.5) / 100_000
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*faster than the step")
        found = velocity(push(history))
    assert found == pytest.approx(of_time(history)(fine).mean(), abs=0.02)


def test_a_force_that_follows_a_history_is_measured_by_all_of_it() -> None:
    """Of a stiff servo little is left: the trapezoid of its goal, 0.8 % off, is many times what it
    pushes with.
    """
    servo = ControlForce(
        "servo", At("m"), (1.0, 0.0), of_state("1e6 * (sin(2 * pi * 5 * t) - stretch) - 2e3 * rate")
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*faster than the step")
        velocity(servo)


def test_what_is_missed_is_said_once_for_a_drive() -> None:
    """A driven joint reads the cosine and the sine of its angle."""
    wheel = rigid("wheel", 1.0, 0.1, (0.0, 0.0), dim=2)
    spin = joints.DrivenAngle(
        "drive", At("wheel", "frame"), of_time("pi / 2 * sin(2 * pi * t / 0.01)**2")
    )
    system = assemble([wheel], [joints.Pin("hub", At("wheel", "center")), spin], [])
    with pytest.warns(Notice, match="faster than the step") as told:
        integrate(system, GeneralizedAlpha(STEP), 0.1)
    assert len([one for one in told if "faster than the step" in str(one.message)]) == 1


def test_what_a_controller_holds_is_no_history_that_is_missed() -> None:
    """A sampled brake beyond its limit of stability, v <- (1 - k h / m) v: what it holds changes at
    its samples alone.
    """
    at, brake = (
        At("m"),
        Pid(name="brake", unit="N", sample=0.05, error=of_state("- x.vx", "m/s"), kp=41.0),
    )
    push = ControlForce("push", at, (1.0, 0.0), of_state("brake"))
    start, out = {"m": Motion(velocity=(1.0, 0.0))}, {"x": probes.Position(at)}
    system = assemble(
        [point_mass("m", 1.0, np.zeros(2))],
        [],
        [push],
        outputs=out,
        initial=start,
        controllers=[brake],
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*faster than the step")
        motion = integrate(system, GeneralizedAlpha(STEP), 1.0)
    assert motion.v[::5, 0] == pytest.approx((-1.05) ** np.arange(21), rel=1e-9)


@pytest.mark.parametrize(
    "history",
    ["where(t < 0.503, 0, 0.01)", "0.01 * floor(2 * t)", "0.01 * sin(t) + where(t < 0.5, 0, 1e-3)"],
)
def test_drives_that_jump_are_warned_of(history: str) -> None:
    with pytest.warns(
        Notice, match=r"joint d is driven by a function that jumps within one step, at t = 0\.5"
    ) as told:
        driven(history)
    assert len([one for one in told if "jumps" in str(one.message)]) == 1


@pytest.mark.parametrize("corner", [0.5, 0.503, 0.507])
def test_drives_whose_rate_jumps_are_warned_of(corner: float) -> None:
    """A mass that begins to move at 1 m/s: the impulse of its drive is 1 N s, of which a step makes
    what it likes.
    """
    with pytest.warns(
        Notice,
        match=r"joint d is driven by a function whose rate jumps within one step, at t = 0\.5",
    ) as told:
        driven(f"where(t < {corner}, 0, t - {corner})")
    assert len([one for one in told if "jumps" in str(one.message)]) == 1


@pytest.mark.parametrize(
    "history",
    [
        "0.01 * t",
        "trapezoidal(t, 0.5995, 0, 0.9, 0.01, 0.1)",
        "0.01 * t**4",
        "0.01 * sin(9 * t)",
        "0.01 * where(t < 0.5, 0, t - 0.5)**2",
    ],
)
def test_drives_that_change_over_steps_are_not(history: str) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "joint d is driven")
        driven(history)


def driven(history: str) -> None:
    """A mass that is driven along a function of time."""
    drive = joints.DrivenPosition("d", At("m"), (of_time(history), of_time("0")))
    integrate(
        assemble([point_mass("m", 1.0, np.zeros(2))], [drive]), GeneralizedAlpha(STEP, 1.0), 0.6
    )


@PUSHES
@pytest.mark.parametrize("history", ["sin(6 * t)**2", "t**6", "where(t < 0.97, 0, (t - 0.97)**2)"])
@pytest.mark.parametrize("duration", [0.01, 0.02, 0.03, 1.0])
def test_what_has_only_begun_is_not_missed(push: Push, history: str, duration: float) -> None:
    """The ends of the first steps give t^2 by up to a half wrong, whatever the step is: its motion
    is as small then.
    """
    system = assemble([point_mass("m", 1.0, np.zeros(2))], [], [push(history)])
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*faster than the step")
        integrate(system, GeneralizedAlpha(STEP), duration)


@pytest.mark.parametrize(
    "history",
    ["10 * sin(2 * pi * (t - 0.003) / 0.01)**2 * (t > 0.003)", "10 * sin(2 * pi * t / 0.01)**2"],
)
def test_what_few_steps_do_not_see_is_warned_of(history: str) -> None:
    with pytest.warns(
        Notice,
        match="a load on m changes faster than the step of 0.01 s: its integral over time is wrong by up to",
    ):
        integrate(
            assemble([point_mass("m", 1.0, np.zeros(2))], [], [pushed(history)]),
            GeneralizedAlpha(STEP),
            0.03,
        )


@pytest.mark.parametrize("turns", [0.3, 1.0, 7.3, 50.0])
@pytest.mark.parametrize("end", [0.497, 0.5, 0.6])
def test_angles_that_turn_smoothly_do_not_jump(turns: float, end: float) -> None:
    """A start over 0.5 s, then a constant rate: second differences of the cosine vanish at every
    half turn, and at the end.
    """
    wheel = rigid("wheel", 1.0, 0.1, (0.0, 0.0), dim=2)
    angle = f"{turns} * where(t < 0.5, t**2 + 0.5 / (4 * pi**2) * (cos(4 * pi * t) - 1), 0.25 + (t - 0.5))"
    system = assemble(
        [wheel],
        [
            joints.Pin("hub", At("wheel", "center")),
            joints.DrivenAngle("d", At("wheel", "frame"), of_time(angle)),
        ],
    )
    for step in (1e-3, 1e-4):
        assert not step_size.drives_that_jump(system, step, round(end / step))


@pytest.mark.parametrize("history", ["sin(9 * t)", "cos(9 * t)", "1000 + 1e-9 * t", "3 * t"])
def test_drives_that_vanish_at_their_end_do_not_jump(history: str) -> None:
    system = assemble(
        [point_mass("m", 1.0, np.zeros(2))],
        [joints.DrivenPosition("d", At("m"), (of_time(history), of_time("0")))],
    )
    for steps in range(30, 80):
        assert not step_size.drives_that_jump(system, STEP, steps), steps
