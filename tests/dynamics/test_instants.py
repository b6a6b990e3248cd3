"""States between the steps of a run: of the order of the method, not across what jumps, and the
same where steps end there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import sections
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_drift,
    instants,
    integrate,
    outputs,
    reactions,
)
from fmbs_skfem.dynamics.instants import Instants
from fmbs_skfem.scenes import build
from fmbs_skfem.systems.compiled import compile_system, constraints_at
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import System

from .. import models

TIGHT = Newton(1e-13)
STIFF = sections.Given(EA=1e6, EI=1e2, rhoA=1.0)


def motion_at(system: System, steps: int, duration: float, times: np.ndarray) -> Trajectory:
    scheme = GeneralizedAlpha(duration / steps)
    found = Instants(times, scheme, duration)
    return integrate(system, scheme, duration, TIGHT, found.steps, observers=[found])


def order(errors: list[float]) -> float:
    return float(np.log2(errors[-2] / errors[-1]))


@pytest.mark.parametrize(("name", "expected"), [("x", 6), ("v", 4), ("a", 4), ("multipliers", 4)])
def test_orders_of_what_is_interpolated(name: str, expected: int) -> None:
    """Of a motion that is exact at its steps."""
    errors = []
    times = np.linspace(0.0, 2.0, 301)
    exact = {
        "x": np.sin(3 * times),
        "v": 3 * np.cos(3 * times),
        "a": -9 * np.sin(3 * times),
        "multipliers": np.cos(5 * times),
    }
    for steps in (20, 40):
        t = np.linspace(0.0, 2.0, steps + 1)
        parts = [np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t), np.cos(5 * t)]
        motion = Trajectory(models.double_pendulum(2), t, *(part[:, None] for part in parts))
        found = instants.at(motion, times, np.arange(steps + 1), np.zeros(0), False, 1e-9)
        errors.append(float(np.abs(getattr(found, name)[:, 0] - exact[name]).max()))
    assert order(errors) > expected - 0.3


def synthetic(times: np.ndarray, late: float = np.inf) -> dict[str, np.ndarray]:
    """x, v, a and multipliers (s, 1) of q'' = 6 t + 1 up to `late` [s], and of another motion
    behind it.
    """
    t = times[:, None]
    before = {"x": t**3 + t**2 / 2, "v": 3 * t**2 + t, "a": 6 * t + 1, "multipliers": 2 - 5 * t}
    behind = {"x": 7 - 2 * t**3, "v": -6 * t**2, "a": -12 * t, "multipliers": 40 * t}
    return {name: np.where(t <= late, before[name], behind[name]) for name in before}


def test_instants_that_are_ends_of_steps_have_all_of_these_states() -> None:
    """To the bit, of states that no polynomial meets; memory is that of the end of the step, work
    lies on the line.
    """
    random, near = np.random.default_rng(3), 1e-3
    t = np.arange(6.0)
    states = {name: random.normal(size=(6, 2)) for name in ("x", "v", "a", "multipliers", "memory")}
    motion = Trajectory(models.double_pendulum(2), t, **states, work=random.normal(size=6))
    asked = np.array(
        [
            0.0,
            0.5 * near,
            1.25,
            2.0 - 0.5 * near,
            2.0 + 0.9 * near,
            2.5,
            4.75,
            5.0 - 0.9 * near,
            5.0,
        ]
    )
    state = np.array([0, 0, -1, 2, 2, -1, -1, 5, 5])
    for rough in (False, True):
        found = instants.at(motion, asked, np.arange(6), np.zeros(0), rough, near)
        on = state >= 0
        for name, values in states.items():
            np.testing.assert_array_equal(getattr(found, name)[on], values[state[on]], err_msg=name)
        assert motion.memory is not None
        assert found.memory is not None
        np.testing.assert_array_equal(found.memory[~on], motion.memory[[2, 3, 5]])
        np.testing.assert_array_equal(found.work[on], motion.work[state[on]])
        np.testing.assert_allclose(found.work[~on], np.interp(asked[~on], t, motion.work))
        assert np.abs(found.x[~on] - states["x"][[2, 3, 5]]).min() > 1e-3


@pytest.mark.parametrize("cut", [0.0, 0.35, 0.55])
def test_both_sides_of_a_cut_are_those_of_their_own_steps(cut: float) -> None:
    """Exact for accelerations that are linear on either side; the instant of the cut is before it,
    one right behind it is not.
    """
    t = np.linspace(0.0, 1.0, 11)
    motion = Trajectory(models.double_pendulum(2), t, **synthetic(t, cut))
    asked = np.sort(np.append(np.linspace(0.013, 0.987, 21), [cut, cut + 1e-6, cut + 0.04]))
    found = instants.at(motion, asked, np.arange(11), np.array([cut]), False, 1e-9)
    for name, values in synthetic(asked, cut).items():
        np.testing.assert_allclose(getattr(found, name), values, atol=1e-11, err_msg=name)


def test_what_is_before_the_first_and_behind_the_last_of_two_cuts() -> None:
    t = np.linspace(0.0, 1.0, 11)
    motion = Trajectory(models.double_pendulum(2), t, **synthetic(t, 0.35))
    asked = np.array([0.31, 0.33, 0.37, 0.39])
    found = instants.at(motion, asked, np.arange(11), np.array([0.33, 0.36]), False, 1e-9)
    for name, values in synthetic(asked, 0.35).items():
        np.testing.assert_allclose(getattr(found, name), values, atol=1e-11, err_msg=name)


def test_instants_at_ends_of_steps_have_their_states() -> None:
    system = models.double_pendulum(2)
    usual = integrate(system, GeneralizedAlpha(1e-2), 0.5, TIGHT, every=5)
    found = motion_at(system, 50, 0.5, usual.times)
    for name in ("times", "x", "v", "a", "multipliers", "work"):
        np.testing.assert_array_equal(getattr(found, name), getattr(usual, name))


def test_errors_within_steps_are_those_of_the_method() -> None:
    """A rigid pendulum: of second order in positions, speeds and reactions, and hardly larger than
    at the ends of steps.
    """
    system, duration = build.system(scenes.loads(PENDULUM)), 1.0
    times = np.append(np.arange(0.0, duration, 7.3e-3), duration)
    truth = motion_at(system, 6400, duration, times)
    true_ends = integrate(system, GeneralizedAlpha(duration / 6400), duration, TIGHT, every=32)
    errors: dict[str, list[float]] = {}
    for steps in (200, 400):
        found = motion_at(system, steps, duration, times)
        ends = integrate(
            system, GeneralizedAlpha(duration / steps), duration, TIGHT, every=steps // 200
        )
        for name in ("x", "v", "a", "multipliers"):
            within, late = (
                np.abs(getattr(a, name) - getattr(b, name)).max()
                for a, b in ((found, truth), (ends, true_ends))
            )
            errors.setdefault(name, []).append(float(within))
            assert within < 1.2 * late, name
    for name, some in errors.items():
        assert order(some) > 1.7, name


def test_joints_hold_within_steps() -> None:
    """A rigid pendulum and a driven beam: what joints and rigid bodies gape between steps is small,
    and falls with h^4 at least.
    """
    for system, duration, coarse in (
        (build.system(scenes.loads(PENDULUM)), 1.0, 40),
        (models.spin_up(4, all_multipliers=True), 1.0, 100),
    ):
        found = []
        for steps in (coarse, 2 * coarse):
            motion = motion_at(system, steps, duration, duration / steps * (np.arange(steps) + 0.5))
            gaps, _ = constraints_at(compile_system(system), motion.x, motion.times)
            found.append(float(np.abs(gaps).max()))
        assert order(found) > 3.7
        assert found[-1] < 1e-6


def exact(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, speed and acceleration of a mass of 2 kg under a force of 4 N t up to the instant OFF,
    and of - 4 N behind it.
    """
    late = np.maximum(t - OFF, 0.0)
    soon = np.minimum(t, OFF)
    return soon**3 / 3 + OFF**2 * late - late**2, soon**2 - 2 * late, np.where(t < OFF, 2 * t, -2.0)


def test_nothing_is_interpolated_across_a_jump_of_a_load() -> None:
    """Speeds at instants within the step of the jump err by h^2, not by h: 1e-4 and not 4e-3 m/s."""
    chosen = scenes.loads(SWITCHED)
    motion = build.dynamic(chosen).solve(build.chosen_form(chosen, build.system(chosen)))
    near = np.abs(motion.times - OFF) < 0.01
    assert near.sum() >= 4
    columns = outputs(motion)
    place, speed, acceleration = exact(motion.times)
    assert np.abs(columns["place"] - place).max() < 1e-4
    assert np.abs(columns["speed"] - speed).max() < 1e-4
    assert np.abs(motion.a[:, 0] - acceleration).max() < 1e-6


def test_nothing_is_interpolated_across_an_event() -> None:
    """A pendulum that is let go: beside the instant its reaction is that of before, or none."""
    chosen = scenes.loads(LET_GO)
    motion = build.dynamic(chosen).solve(build.chosen_form(chosen, build.system(chosen)))
    (event,) = motion.events
    held = np.hypot(*list(reactions(motion).values())[:2])
    before, behind = motion.times < event.time - 1e-9, motion.times > event.time + 1e-9
    assert np.nanmin(held[before]) > 1.0
    assert np.nanmax(np.nan_to_num(held[behind])) < 1e-9
    fall = motion.v[behind, 1]
    assert np.abs(np.diff(fall) / np.diff(motion.times[behind]) + 9.81).max() < 1e-3


def test_speeds_of_what_bounces_stay_between_those_of_the_ends() -> None:
    """Where forces begin and end, polynomials of higher degree would swing beyond."""
    chosen = scenes.loads(BALL)
    analysis, system = build.dynamic(chosen), build.chosen_form(chosen, build.system(chosen))
    motion, ends = analysis.solve(system), replace(analysis, every=1).solve(system)
    row = np.minimum(np.searchsorted(ends.times, motion.times + 1e-9) - 1, len(ends.times) - 2)
    speed, known = outputs(motion)["v"], outputs(ends)["v"]
    assert known.max() > 2.0  # it has bounced
    low, high = np.minimum(known[row], known[row + 1]), np.maximum(known[row], known[row + 1])
    assert ((speed >= low - 1e-12) & (speed <= high + 1e-12)).all()
    place, level = outputs(motion)["y"], outputs(ends)["y"]
    assert np.abs(place - np.interp(motion.times, ends.times, level)).max() < 0.5 * 0.5e-3 * 6.0


def test_a_scene_asks_for_instants_within_steps() -> None:
    chosen = scenes.loads(PENDULUM)
    analysis, system = build.dynamic(chosen), build.chosen_form(chosen, build.system(chosen))
    motion = analysis.solve_for_outputs(system)
    np.testing.assert_allclose(motion.times, [*np.arange(0.0, 1.0, 0.0305), 1.0], atol=1e-12)
    finer = replace(analysis, step=1e-3, every=10).solve(system)
    error = np.abs(
        outputs(motion)["tip_x"] - np.interp(motion.times, finer.times, outputs(finer)["tip_x"])
    )
    assert error.max() < 2e-3


def test_energies_balance_within_steps() -> None:
    """A driven beam: the work at instants between steps is that of the motion there, and feigns no
    energy.
    """
    system, duration = models.spin_up(4), 1.5
    within = motion_at(system, 150, duration, np.append(np.arange(0.0, duration, 2.3e-3), duration))
    ends = integrate(system, GeneralizedAlpha(duration / 150), duration, TIGHT)
    assert energy_drift(within) < 1.05 * energy_drift(ends)


def test_a_run_that_stops_within_a_step_ends_there() -> None:
    chosen = scenes.loads(LET_GO.replace("release: hinge", "stop: true"))
    motion = build.dynamic(chosen).solve(build.chosen_form(chosen, build.system(chosen)))
    assert motion.times[-1] == motion.events[0].time
    assert np.diff(motion.times)[:-1] == pytest.approx(0.003)


OFF = 0.4037
SWITCHED = """
schema: 1
dimension: 2
bodies:
  box: {type: point_mass, mass: 2 kg, position: [0 m, 0 m]}
joints:
  guide: {type: slider, at: box, direction: [1, 0]}
loads:
  f: {type: point_force, at: box, force: [4 N, 0 N], history: "where(t < 0.4037, t, -1)"}
analysis: {type: dynamic, duration: 1 s, step: 10 ms, every: 3.7 ms}
outputs:
  place: {type: position, at: box, component: x}
  speed: {type: velocity, at: box, component: x}
"""
PENDULUM = """
schema: 1
dimension: 2
bodies:
  rod: {type: rigid, mass: 1 kg, inertia: 0.1 kg m^2, center: [0.5 m, 0 m], points: {root: [0 m, 0 m], tip: [1 m, 0 m]}}
joints:
  hinge: {type: pin, at: rod.root}
loads:
  weight: {type: gravity, acceleration: [0 m/s^2, -9.81 m/s^2]}
analysis: {type: dynamic, duration: 1 s, step: 10 ms, every: 30.5 ms}
outputs:
  tip: {type: position, at: rod.tip}
"""
LET_GO = (
    PENDULUM.replace("every: 30.5 ms", "every: 3 ms")
    + """
events:
  go: {when: tip.y + 0.7 m, direction: falling, release: hinge, once: true}
"""
)
BALL = """
schema: 1
dimension: 2
bodies:
  ball: {type: rigid, mass: 0.1 kg, inertia: 1e-5 kg m^2, center: [0, 0.5 m]}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
  floor: {type: contact_plane, at: ball.center, radius: 30 mm, point: [0, 0], normal: [0, 1], stiffness: 20 kN/m}
analysis: {type: dynamic, duration: 1 s, step: 0.5 ms, every: 0.37 ms}
outputs:
  y: {type: position, at: ball.center, component: y}
  v: {type: velocity, at: ball.center, component: y}
"""


def test_waves_of_a_load_that_begins_are_none_of_the_first_step() -> None:
    """The strain energy of a beam under a force from the start on, within the first step: 60 times
    that at its end with the accelerations that balance the force there.
    """
    system = models.cantilever(
        8, lambda tip: [loads.PointForce("P", tip, (1.0, 1.0))], section=STIFF
    )
    step, steps = 1e-3, 20
    times = np.append(np.linspace(0.0, step, 6), steps * step)
    ends = energies(integrate(system, GeneralizedAlpha(step), steps * step))
    within = energies(motion_at(system, steps, steps * step, times))
    for kind in (0, 1):  # kinetic, strain
        assert within[:6, kind].max() <= 2.0 * ends[:4, kind].max()
