"""Loads that jump, on and off the ends of steps: these end there, and motions keep their second
order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fmbs_skfem.bodies import point_mass
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.core.values.tables import Table
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, energies, integrate
from fmbs_skfem.dynamics.checkpoint import Resumed
from fmbs_skfem.dynamics.compiled_step import jumps
from fmbs_skfem.systems import At, System, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlForce
from fmbs_skfem.systems.measures import probes

ENDS = 20  #: instants at which motions are compared


def rod(*pushes: Any, **more: Any) -> System:
    """A mass on a rod under its weight and other loads."""
    mass, rod = (
        point_mass("m", 1.0, np.array([0.6, -0.8])),
        joints.RigidLink("rod", At("m"), (0.0, 0.0)),
    )
    return assemble(
        [mass],
        [rod],
        [loads.Gravity((0.0, -9.81)), *pushes],
        outputs={"m": probes.Position(At("m"))},
        **more,
    )


def pushed(history: str | Callable[[np.ndarray], np.ndarray]) -> loads.Load:
    return loads.PointForce(
        "push", At("m"), (3.0, 1.0), of_time(history) if isinstance(history, str) else history
    )


def controlled(history: str) -> loads.Load:
    """The same as an expression of the state, which changes it a little."""
    return ControlForce("push", At("m"), (3.0, 1.0), of_state(f"({history}) * (1 + 0.1 * stretch)"))


def errors(system: System, counts: tuple[int, ...] = (200, 400)) -> np.ndarray:
    """Largest errors of x, v and multipliers (c, 3) of some numbers of steps over 0.8 s."""
    found = [
        integrate(system, GeneralizedAlpha(0.8 / steps), 0.8, every=steps // ENDS)
        for steps in (*counts, 12_800)
    ]
    # waves in the multipliers behind a short piece of a step die out by rho_inf a step
    parts = [(one.x, one.v, one.multipliers[3 * ENDS // 4 :]) for one in found]
    return np.array(
        [[np.abs(a - b).max() for a, b in zip(one, parts[-1], strict=True)] for one in parts[:-1]]
    )


@pytest.mark.parametrize(
    "push",
    [
        pushed("where(t < 0.41237, 1, 0)"),  # within a step
        pushed("where(t < 0.4, 1, 0)"),  # at the end of one, which is read behind the jump
        pushed("where(t <= 0.4, 1, 0)"),  # and before it
        pushed("where(t > 0, 1, 0)"),  # behind the start
        pushed("sin(9 * t) + 0.3 * floor(t / 0.27) + mod(t, 0.13)"),  # several of several kinds
        pushed("where(t < 0.4, 0, where(t < 0.4001, 3000, 0))"),  # a blow within one step
        pushed(lambda t: np.where(t < 0.41237, np.cos(9.0 * t), -1.0)),
        controlled("where(t < 0.41237 s, 1, 0)"),
        controlled("where(t < 0.4, 1, where(stretch > 9, 2, 0))"),
    ],
)
def test_loads_that_jump_are_of_second_order(push: loads.Load) -> None:
    coarse, fine = errors(rod(push))
    assert np.log2(coarse / fine).min() > 1.9


def test_without_ends_at_jumps_the_order_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same on the end of a step: ratios of errors 2, which are 25 times as large."""
    system = rod(pushed("where(t < 0.4, 1, 0)"))
    exact = errors(system)
    monkeypatch.setattr(jumps, "MANY", 0.0)
    coarse, fine = errors(rod(pushed("where(t < 0.4, 1, 0)")))
    assert np.log2(coarse / fine)[:2] == pytest.approx(1.0, abs=0.2)
    assert (fine[:2] > 10.0 * exact[1, :2]).all()


@pytest.mark.parametrize(
    "history",
    [
        "where(t < 0.31237, 2, 0)",
        "where(t < 0.3, 2, 0)",
        "where(t > 0, 2, -1) * where(t < 0.5, 1, 3)",
    ],
)
def test_a_free_mass_takes_up_the_impulse(history: str) -> None:
    """v = S / m at the end, to round-off, where the load is constant between its jumps."""
    motion = integrate(
        assemble([point_mass("m", 2.0, np.zeros(2))], [], [pushed(history)]),
        GeneralizedAlpha(0.01),
        1.0,
    )
    fine = (np.arange(1_000_000) + 0.5) / 1_000_000
    assert motion.v[-1] == pytest.approx(
        np.array([3.0, 1.0]) / 2.0 * of_time(history)(fine).mean(), rel=1e-9
    )


def test_accelerations_behind_a_jump_are_those_of_its_loads() -> None:
    system = assemble([point_mass("m", 2.0, np.zeros(2))], [], [pushed("where(t < 0.3, 2, 0)")])
    motion = integrate(system, GeneralizedAlpha(0.01), 0.5)
    assert motion.a[[29, 30, 31], 0] == pytest.approx([3.0, 0.0, 0.0], abs=1e-9)


def test_energy_and_work_go_over_a_jump() -> None:
    motion = integrate(rod(pushed("where(t < 0.41237, 5, -3)")), GeneralizedAlpha(1e-3), 0.8)
    total = energies(motion).sum(axis=1)
    assert motion.work is not None
    assert total - motion.work == pytest.approx(total[0], abs=1e-3 * np.ptp(total))


@pytest.mark.parametrize(
    "history",
    [
        "sin(90 * t)",
        "where(t < 0.4, t, 0.4)",  # bends, and parts of it jump
        "exp(-((t - 0.4) / 0.003)**2)",  # steep beside the step
        "abs(t - 0.3) + max(t, 0.5) + t * (t > 0)",
    ],
)
def test_what_does_not_jump_is_left_alone(history: str) -> None:
    known = of_time(history)
    for push in (pushed(history), pushed(lambda t: known(t))):
        assert jumps.jumps_of_loads(rod(push), 0.01, 80) == {}


def test_noise_has_too_many_jumps() -> None:
    """Steps that end at each of them would cost ten times as much, and mean no more."""
    push = pushed(lambda t: np.sin(1e6 * np.floor(t / 0.01)))
    assert len(jumps.jumps_of_signals(rod(push), 0.01, 80)) > 70
    assert jumps.jumps_of_loads(rod(push), 0.01, 80) == {}


def test_instants_are_found_to_round_off() -> None:
    """At the end of a step, of the one before; at the start, of the first; places within a step."""
    found = jumps.jumps_of_loads(
        rod(pushed("where(t > 0, 1, 0) + floor(t / 0.2) + where(t < 0.317, 1, 0)")), 0.01, 80
    )
    assert [(number, round(place, 9)) for number, here in found.items() for place, *_ in here] == [
        (0, 0.0), (19, 1.0), (31, 0.7), (39, 1.0), (59, 1.0), (79, 1.0)
    ]  # fmt: skip
    for _, before, behind, _ in (one for here in found.values() for one in here):
        assert 0.0 < behind - before < 1e-13


def test_a_table_does_not_jump() -> None:
    load = Table("load", "N", (0.0, 0.3, 0.31, 0.8), (0.0, 0.0, 1.0, 1.0))
    assert (
        jumps.jumps_of_loads(rod(pushed(of_time("load(t)", inputs={load.name: load}))), 0.01, 80)
        == {}
    )


class Kept:
    """Keeps a run as it is after some steps."""

    def __init__(self, done: int) -> None:
        self.done, self.found = done, list[Resumed]()

    def __call__(self, state: Any) -> None:
        if state.done >= self.done and not self.found:
            self.found.append(Resumed(state.checkpoint(), state.rows(0, state.kept)))


@pytest.mark.parametrize("done", [0, 200, 320])
def test_a_run_that_is_resumed_has_the_same_bits(done: int) -> None:
    system = rod(pushed("where(t < 0.41237, 1, 0) + floor(t / 0.2)"))
    keep = Kept(done)
    whole: Trajectory = integrate(system, GeneralizedAlpha(1e-3), 0.8, record=keep)
    again = integrate(system, GeneralizedAlpha(1e-3), 0.8, resume=keep.found[0])
    for name in ("x", "v", "a", "multipliers", "work"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(again, name))
    assert whole.statistics.steps == again.statistics.steps == 800


@pytest.mark.parametrize("width", [1e-5, 1e-8])
@pytest.mark.parametrize("steps", [100, 400])
def test_a_pulse_that_no_step_sees_gives_its_impulse(width: float, steps: int) -> None:
    """F of 1 / (2 w) N for 2 w = 20 us and less: m v = 1 N s."""
    pulse = loads.PointForce(
        "push",
        At("m"),
        (1.0, 0.0),
        of_time(f"where(abs(t - 0.3333) < {width}, {0.5 / width!r}, 0)"),
    )
    free = assemble([point_mass("m", 2.0, np.zeros(2))], [], [pulse])
    motion = integrate(free, GeneralizedAlpha(1.0 / steps), 1.0)
    assert motion.v[-1, 0] == pytest.approx(0.5, rel=1e-4)
    assert motion.x[-1, 0] == pytest.approx(0.5 * (1.0 - 0.3333), rel=1e-4)


def test_a_load_that_jumps_at_the_start_and_too_often_starts_right() -> None:
    """A square wave of 16 jumps in 100 steps: what its first value at t = 0 alone says is not taken
    for the first step.
    """
    square = loads.PointForce("push", At("m"), (1.0, 0.0), of_time("where(sin(50 * t) > 0, 1, -1)"))
    free = assemble([point_mass("m", 2.0, np.zeros(2))], [], [square])
    assert list(jumps.jumps_of_loads(free, 0.01, 100)) == [0]
    motion = integrate(free, GeneralizedAlpha(0.01), 0.05)
    np.testing.assert_allclose(motion.v[:, 0], 0.5 * motion.times, atol=1e-12)


@pytest.mark.parametrize("place", [1e3 + 3.0e-4, 1e3 + 4.5e-4, 1e3 + 7.7e-4])
def test_margins_that_come_near_to_zero_late_in_a_motion_are_left(place: float) -> None:
    """Times lie farther apart there than the width to which instants are found."""
    times = 1e3 + 1e-3 * np.arange(-2, 4)
    assert not len(jumps.crossings(lambda t: np.abs(t - place)[:, None] + 1e-9, times, 1e-15))
    found = jumps.crossings(lambda t: np.abs(t - place)[:, None] - 1e-9, times, 1e-15)
    np.testing.assert_allclose(found, place, atol=1e-9)
