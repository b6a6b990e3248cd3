"""Springs, ropes and stops between two places against exact motions, and where they are hard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import cable, point_mass, sections
from fmbs_skfem.contact.contacts import ContactPlane
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    integrate,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.results import motion as pictures
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes import reading as scenes
from fmbs_skfem.systems import At, Motion, System, assemble, check_force, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import gauges, loads
from fmbs_skfem.systems.forces.springs import ConstantForce, Rope, SpringDamper, Stop
from fmbs_skfem.systems.measures import probes

from .. import models
from ..forms import forms
from .parts import A1, B1, BOB, beams

TIGHT = Newton(tolerance=1e-12)
BALL = At("ball", "center")
G = 9.81


def every_spring(dim: int) -> list[loads.Load]:
    """Of every kind, to places and points, some of them at work in the reference, some not."""
    point = (0.3, 0.4, 0.5)[:dim]
    return [
        SpringDamper("between", A1, BOB, 10.0, 0.3, 0.1),
        SpringDamper("to a point", A1, point, 10.0, 0.2),
        SpringDamper("without length", A1, (0.8, 0.1, 0.0)[:dim], 10.0, 0.2, 0.0),
        Rope("rope", B1, point, 20.0, 0.4, 0.3),
        Rope("smooth rope", B1, point, 20.0, 0.4, 1.6, 0.3),
        Rope("slack rope", B1, point, 20.0, 0.4, 9.0),
        Stop("stop", B1, BOB, 20.0, 0.4, 5.0, smoothing=0.1),
        Stop("stop along", B1, BOB, 20.0, 0.4, 1.0, (0.0, 1.0, 0.2)[:dim], 3.0),
        Stop("stop that pulls", B1, point, 20.0, 4.0, 5.0, cut=False),
        ConstantForce("pull", B1, BOB, 3.0, np.cos),
    ]


@pytest.mark.parametrize(
    "dim, load",
    [
        pytest.param(dim, load, id=f"{dim}-{load.name}")
        for dim in (2, 3)
        for load in every_spring(dim)
    ],
)
def test_contract(dim: int, load: loads.Load) -> None:
    check_force(beams(dim), load)


@pytest.mark.parametrize("dim", [2, 3])
def test_systems_with_springs(dim: int) -> None:
    check_system(assemble(beams(dim), loads=every_spring(dim)))


def ball(
    dim: int,
    *forces: loads.Load,
    at: Any = (0.0, 0.0, 0.0),
    speed: Any = (0.0, 0.0, 0.0),
    mass: float = 1.0,
) -> System:
    """A point that moves freely, with what its loads measure."""
    known = {f.name: gauges.LoadState(f.name) for f in forces if not isinstance(f, loads.Gravity)}
    return assemble(
        [point_mass("ball", mass, np.array(at[:dim], float))],
        loads=forces,
        outputs={"x": probes.Position(BALL), "E": probes.Energy(), **known},
        initial={"ball": Motion(velocity=tuple(speed[:dim]))},
    )


def run(
    system: System, step: float, duration: float, rho_inf: float = 1.0
) -> tuple[Trajectory, dict[str, np.ndarray]]:
    motion = integrate(system, GeneralizedAlpha(step, rho_inf), duration, TIGHT)
    return motion, outputs(motion)


@pytest.mark.parametrize("far", [0.0, 1e4])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_damped_oscillator(dim: int, far: float) -> None:
    """x'' + 2 zeta w x' + w^2 x = 0 with w = 3, zeta = 0.1 about the free length, also 10 km from
    the origin.
    """
    spring = SpringDamper("spring", BALL, (far, 0.0, 0.0)[:dim], 18.0, 1.2, 1.0)
    motion, found = run(
        ball(dim, spring, at=(far + 1.0, 0.0, 0.0), speed=(0.5, 0.0, 0.0), mass=2.0), 1e-3, 3.0
    )
    t, wd = motion.times, 3.0 * np.sqrt(1 - 0.01)
    assert_allclose(
        found["x_x"] - 1.0 - far, 0.5 / wd * np.exp(-0.3 * t) * np.sin(wd * t), atol=2e-6
    )
    assert_allclose(found["E_balance"], 0.25, rtol=4e-6)
    assert_allclose(found["E_strain"], 9.0 * found["spring_stretch"] ** 2, atol=1e-9)
    assert_allclose(found["spring_stretch"], found["x_x"] - 1.0 - far, atol=1e-11)
    assert_allclose(
        found["spring_force"],
        18.0 * found["spring_stretch"] + 1.2 * found["spring_rate"],
        atol=1e-9,
    )


def test_order_of_places_does_not_matter() -> None:
    """Two masses of 1 and 3 kg on 12 N/m: w = 4 rad/s, whichever end is named first."""
    ends = At("a", "center"), At("b", "center")
    bodies = [point_mass("a", 1.0, np.zeros(2)), point_mass("b", 3.0, np.array([1.0, 0.0]))]
    start = {"a": Motion(velocity=(-0.3, 0.0)), "b": Motion(velocity=(0.1, 0.0))}
    found = []
    for at, to in (ends, ends[::-1]):
        system = assemble(
            bodies,
            [],
            [SpringDamper("s", at, to, 12.0)],
            outputs={"s": gauges.LoadState("s")},
            initial=start,
        )
        found.append(run(system, 1e-3, 2.0)[1])
    for name in found[0]:
        assert_allclose(found[0][name], found[1][name], atol=1e-12)
    t = np.linspace(0.0, 2.0, len(found[0]["s_stretch"]))
    assert_allclose(found[0]["s_stretch"], 0.1 * np.sin(4.0 * t), atol=1e-6)


def test_a_spring_pendulum() -> None:
    """m r'' of a mass on a spring of free length 1 m, by the equations in polar coordinates to
    1e-10 (scipy).
    """
    from scipy.integrate import solve_ivp

    def rates(t: float, y: np.ndarray) -> list[float]:
        r, phi, dr, dphi = y
        return [
            dr,
            dphi,
            r * dphi**2 + G * np.cos(phi) - 40.0 * (r - 1.0),
            (-G * np.sin(phi) - 2 * dr * dphi) / r,
        ]

    exact = solve_ivp(
        rates,
        (0.0, 2.0),
        [1.1, 0.8, 0.0, 0.0],
        rtol=1e-11,
        atol=1e-12,
        t_eval=np.linspace(0, 2, 2001),
    ).y
    start = (1.1 * np.sin(0.8), -1.1 * np.cos(0.8), 0.0)
    _, found = run(
        ball(
            2,
            SpringDamper("s", BALL, (0.0, 0.0), 40.0, 0.0, 1.0),
            loads.Gravity((0.0, -G)),
            at=start,
        ),
        1e-3,
        2.0,
    )
    assert_allclose(found["x_x"], exact[0] * np.sin(exact[1]), atol=2e-5)
    assert_allclose(found["x_y"], -exact[0] * np.cos(exact[1]), atol=2e-5)
    assert_allclose(found["s_stretch"], exact[0] - 1.0, atol=2e-5)
    assert np.ptp(found["E_balance"]) < 2e-5


def crossings(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Times at which y changes its sign, between samples along a cubic."""
    i = np.flatnonzero(y[:-1] * y[1:] < 0)
    return np.asarray(t[i] - y[i] * (t[i + 1] - t[i]) / (y[i + 1] - y[i]))


def test_a_mass_dropped_on_a_stop() -> None:
    """1 kg from 1 m on 1e5 N/m: sqrt(2 h / g), 2 (pi - atan(w v / g)) / w, m g / k (1 + sqrt(1 + 2
    k h / m g)), to 1e-4.
    """
    floor = Stop("floor", BALL, (0.0, 0.0), 1e5, direction=(0.0, 1.0))
    motion, found = run(ball(2, floor, loads.Gravity((0.0, -G)), at=(0.0, 1.0, 0.0)), 2e-5, 1.4)
    touch, leave, again = crossings(motion.times, found["x_y"])[:3]
    assert touch == pytest.approx(0.45152364, rel=1e-4)
    assert leave - touch == pytest.approx(0.00997888, rel=1e-4)
    assert -found["x_y"].min() == pytest.approx(0.01410558, rel=1e-4)
    assert again - touch == pytest.approx(0.91302617, rel=1e-4)
    assert found["floor_force"].max() < 1e-9 < -found["floor_force"].min()
    assert np.ptp(found["E_balance"]) < 2e-4


@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_an_impact_is_resolved_as_that_on_a_contact(step: float) -> None:
    """Steps of half of the contact time, and of a tenth: steps are divided alike, and the mass
    comes as high as it fell.
    """
    law: dict[str, Any] = {"stiffness": 1e5, "resolution": 0.02}
    floors = (
        Stop("floor", BALL, (0.0, 0.0), direction=(0.0, 1.0), **law),
        ContactPlane("floor", at=BALL, point=(0.0, 0.0), normal=(0.0, 1.0), **law),
        Stop("floor", BALL, (0.0, -1.0), gap=1.0, **law),
    )
    ways = []
    for one in floors:
        mass, start = point_mass("ball", 1.0, np.array([0.0, 1.0])), {"x": probes.Position(BALL)}
        ways.append(
            run(assemble([mass], loads=[one, loads.Gravity((0.0, -G))], outputs=start), step, 1.4)[
                1
            ]["x_y"]
        )
        assert ways[-1][round(0.9 / step) :].max() == pytest.approx(1.0, abs=2e-3)
        assert_allclose(ways[-1], ways[0], atol=1e-9)


def fall(stiffness: float, damping: float, duration: float) -> float:
    """Height of 1 kg that falls 0.3 m onto a damped stop and bounces, after a time [s]: exact for
    each of its phases (scipy).
    """
    from scipy.integrate import solve_ivp

    def push(y: np.ndarray) -> float:
        return -stiffness * y[0] - damping * y[1] if y[0] < 0.0 else 0.0

    def meet(t: float, y: np.ndarray) -> float:
        return float(y[0])

    def leave(t: float, y: np.ndarray) -> float:
        return float(stiffness * y[0] + damping * y[1])

    meet.terminal, meet.direction = True, -1.0  # type: ignore[attr-defined]
    leave.terminal, leave.direction = True, 1.0  # type: ignore[attr-defined]
    begin, state, touches = 0.0, np.array([0.3, 0.0]), False
    while True:
        rates = lambda t, y, on=touches: [y[1], on * max(push(y), 0.0) - G]  # noqa: E731
        found = solve_ivp(
            rates,
            (begin, duration),
            state,
            "DOP853",
            events=leave if touches else meet,
            rtol=1e-12,
            atol=1e-13,
        )
        begin, state, touches = found.t[-1], found.y[:, -1], not touches
        if begin == duration:
            return float(state[0])


FLOORS: dict[str, Any] = {
    "stop": lambda d: Stop("f", BALL, (0.0, 0.0), 4e3, d, 0.0, (0.0, 1.0)),
    "rope": lambda d: Rope("f", BALL, (0.0, 3.0), 4e3, d, 3.0),
    "contact": lambda d: ContactPlane(
        "f", at=BALL, point=(0.0, 0.0), normal=(0.0, 1.0), stiffness=4e3, damping=d
    ),
}


@pytest.mark.parametrize("floor", FLOORS)
@pytest.mark.parametrize("damping", [0.0, 8.0])
def test_errors_of_impacts_fall_with_the_step(floor: str, damping: float) -> None:
    """Of first order at least from 100 to 1600 steps: three bounces on a rope, a stop, a plane,
    where steps touch in any phase.
    """
    ends = (0.9, 1.0, 1.1)
    exact = np.array([fall(4e3, damping, end) for end in ends])
    errors = []
    for steps in (100, 1600):
        system = assemble(
            [point_mass("ball", 1.0, np.array([0.0, 0.3]))],
            loads=[FLOORS[floor](damping), loads.Gravity((0.0, -G))],
        )
        motion = integrate(system, GeneralizedAlpha(1.1 / steps), 1.1)
        found = [np.interp(end, motion.times, motion.x[:, 1]) for end in ends]
        errors.append(max(abs(found[k] - exact[k]) for k in range(len(ends))))
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 16.0


def test_a_damped_stop_is_met_where_it_is() -> None:
    """Steps of 2 ms, begun earlier by parts of one: the bounce differs by what is left of the step,
    and not by its phase.
    """
    heights = []
    for part in (0.0, 0.2, 0.4, 0.6, 0.8):
        drop = 0.3 - 0.5 * G * (0.002 * part) ** 2
        start = {"at": (0.0, drop, 0.0), "speed": (0.0, -G * 0.002 * part, 0.0)}
        _, found = run(
            ball(
                2,
                Stop("f", BALL, (0.0, 0.0), 4e3, 8.0, 0.0, (0.0, 1.0)),
                loads.Gravity((0.0, -G)),
                **start,
            ),
            2e-3,
            0.6,
        )
        heights.append(found["x_y"].max(initial=0.0, where=np.arange(len(found["x_y"])) > 150))
    assert np.ptp(heights) < 1e-4


@pytest.mark.parametrize("rho_inf", [0.5, 0.8, 1.0])
def test_a_hard_stop_wins_and_loses_nothing(rho_inf: float) -> None:
    """1e6 N/m, half a swing of which takes about one step of 2.75 ms: accelerations begin anew
    behind it, whatever the method.
    """
    stop = Stop("f", BALL, (0.0, 0.0), 1e6, 0.0, 0.0, (0.0, 1.0))
    motion, found = run(
        ball(2, stop, loads.Gravity((0.0, -G)), at=(0.0, 0.3, 0.0)), 2.75e-3, 0.9, rho_inf
    )
    # before the first bounce, behind it and behind the second one
    assert_allclose(found["E_balance"], found["E_balance"][0], atol=5e-4 * G * 0.3)
    assert motion.x[-1, 1] == pytest.approx(fall(1e6, 0.0, motion.times[-1]), abs=5e-4)


@pytest.mark.parametrize("late", [-1e-3, -1e-9, 0.0, 1e-16, 1e-9, 1e-3])
def test_a_stop_is_met_at_the_end_of_a_step(late: float) -> None:
    """Or by a part of one earlier or later; half a swing behind it the ball leaves with its speed."""
    stop = Stop("s", BALL, (0.0, 0.0), 1e3, direction=(1.0, 0.0))
    motion, _ = run(
        ball(2, stop, at=(0.5 + 0.01 * late, 0.0, 0.0), speed=(-1.0, 0.0, 0.0)), 0.01, 1.0
    )
    assert motion.x[-1, 0] == pytest.approx(0.5 - 0.01 * late - np.pi / np.sqrt(1e3), abs=2e-5)


def test_a_rope_that_snaps_taut_in_coarse_steps_loses_nothing() -> None:
    """A mass of 1 kg falls 1 m onto its rope of 1e4 N/m, half a swing of which takes six steps."""
    rope = Rope("rope", BALL, (0.0, 0.0), 1e4, length=1.0)
    found = run(ball(2, rope, loads.Gravity((0.0, -G)), at=(0.0, -1e-3, 0.0)), 5e-3, 1.2)[1]
    assert found["x_y"][round(0.6 / 5e-3) :].max() == pytest.approx(0.0, abs=2e-2)
    assert found["x_y"].min() == pytest.approx(-1.0 - (G + np.sqrt(G**2 + 2e4 * G)) / 1e4, rel=2e-3)


@pytest.mark.parametrize("zeta", [0.05, 0.2, 0.5])
def test_restitution_of_kelvin_and_voigt(zeta: float) -> None:
    stop = Stop(
        "stop", BALL, (0.0, 0.0), 1e5, 2 * zeta * np.sqrt(1e5), 0.0, (0.0, 1.0), 1e-7, cut=False
    )
    motion, _ = run(ball(2, stop, at=(0.0, 1e-3, 0.0), speed=(0.0, -1.0, 0.0)), 2e-6, 0.016)
    assert motion.v[-1, 1] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3)


@pytest.mark.parametrize("damping, smoothing", [(0.0, 0.0), (60.0, 0.0), (60.0, 1e-6)])
@pytest.mark.parametrize("height", [0.0, 1e-3])
def test_rest_on_a_stiff_stop(damping: float, smoothing: float, height: float) -> None:
    """Ten seconds under weight: m g / k below the plane, by half of the smoothing more; without
    damping in undivided steps.
    """
    rough = 0.05 if damping else 0.0
    floor = Stop(
        "floor", BALL, (0.0, 0.0), 1e5, damping, 0.0, (0.0, 1.0), smoothing, resolution=rough
    )
    _, found = run(ball(2, floor, loads.Gravity((0.0, -G)), at=(0.0, height, 0.0)), 1e-2, 10.0, 0.8)
    assert_allclose(found["x_y"][-100:], -G / 1e5 - smoothing / 2, atol=2e-8)


def test_a_rope_goes_slack_and_taut() -> None:
    """Thrown up on its rope of 1 m and 1e4 N/m: free flight, then half a swing about m g / k, speed
    kept.
    """
    system = ball(
        2,
        Rope("rope", BALL, (0.0, 0.0), 1e4),
        loads.Gravity((0.0, -G)),
        at=(0.0, -1.0, 0.0),
        speed=(0.0, 4.0, 0.0),
    )
    motion, found = run(system, 2e-5, 2.0)
    t = motion.times
    first, second = crossings(t[1:], found["rope_stretch"][1:])[:2]
    slack = found["rope_stretch"] < 0
    assert first == pytest.approx(8.0 / G, rel=1e-5)
    assert second - first == pytest.approx((np.pi - np.arctan(400.0 / G)) / 100 * 2, rel=1e-3)
    assert_allclose(found["rope_force"][slack], 0.0)
    assert found["rope_force"].min() >= 0.0
    assert_allclose(found["x_y"][t < first], (4.0 * t - 0.5 * G * t**2 - 1.0)[t < first], atol=1e-8)
    assert np.ptp(found["E_balance"]) < 1e-4


def test_a_constant_force_between_bodies_and_statics() -> None:
    """10 N along x on a mass on 50 N/m: 0.2 m at rest, and w = sqrt(k / m) about it."""
    spring = SpringDamper("s", BALL, (0.0, 0.0), 50.0)
    system = ball(2, spring, ConstantForce("f", BALL, (5.0, 0.0), 10.0), at=(1.0, 0.0, 0.0))
    assert outputs(solve_statics(system, 2, TIGHT))["x_x"][-1] == pytest.approx(1.2, rel=1e-9)
    modes = vibration_modes(
        ball(2, SpringDamper("s", BALL, (0.0, 0.0), 50.0), at=(1.0, 0.0, 0.0), mass=2.0), 2
    )
    assert modes.angular_frequencies[-1] == pytest.approx(5.0, rel=1e-9)


def test_places_at_one_point() -> None:
    """Without a direction nothing can act, but a spring of no length can, and swings through the
    point.
    """
    for load in (
        SpringDamper("s", BALL, (0.0, 0.0), 1.0, length=0.5),
        ConstantForce("s", BALL, (0.0, 0.0), 1.0),
    ):
        with pytest.raises(
            InputError,
            match="load 's': expected places apart, which give its force a direction, got both at one",
        ):
            ball(2, load)
    w = np.sqrt(4.0 - 0.05**2)
    motion, found = run(
        ball(2, SpringDamper("s", BALL, (0.0, 0.0), 4.0, 0.1, length=0.0), speed=(1.0, 0.0, 0.0)),
        1e-3,
        3.0,
    )
    assert_allclose(
        found["x_x"], np.exp(-0.05 * motion.times) * np.sin(w * motion.times) / w, atol=5e-5
    )


def swinging(dim: int) -> System:
    """A beam on a pin, held by a spring, a rope and a stop."""
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.01), sections.Material(1e9, 2300.0), dim=dim
    )
    tip = At("beam", "right")
    springs = [
        SpringDamper("spring", tip, (1.2, 0.4, 0.3)[:dim], 60.0, 0.5, 0.2),
        # divided steps would follow axial waves, which a basis leaves out
        Rope("rope", tip, (0.9, -0.3, 0.0)[:dim], 100.0, 0.3, 0.3, resolution=0.0),
        Stop(
            "stop",
            At("beam", 0.5),
            (0.5, 0.05, 0.0)[:dim],
            200.0,
            0.3,
            0.03,
            (0.0, -1.0, 0.0)[:dim],
            0.05,
            resolution=0.0,
        ),
    ]
    return assemble(
        [beam],
        [joints.Pin("pin", At("beam", "left"))],
        [loads.Gravity((0.0, -9.81, 0.0)[:dim]), *springs],
        outputs={
            "tip": probes.Position(tip),
            "far": probes.Distance(tip, springs[0].to),
            **{one.name: gauges.LoadState(one.name) for one in springs},
        },
        initial={"beam": Motion(angular_velocity=3.0 if dim == 2 else (0.0, 0.3, 3.0))},
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_reduced_hyper_reduced_and_saved_models(dim: int, tmp_path: Path) -> None:
    raw, scheme = swinging(dim), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.3, TIGHT)
    expected = outputs(full)
    for system in forms(raw, full, 1e-14, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.3, TIGHT))
        for name in expected:
            # the fastest axial waves are left out of the basis
            part = 2e-2 if name.endswith("_rate") else 4e-3
            assert_allclose(
                found[name],
                expected[name],
                atol=part * max(float(np.abs(expected[name]).max()), 0.1),
            )


@pytest.mark.parametrize("far", [0.0, 1e4])
def test_distances(far: float) -> None:
    """Of two points that fly apart, of one from a fixed point that it passes, and of two that stay
    at one point: exact motions.
    """
    places = {"ball": (far, far + 3.0), "other": (far + 4.0, far)}
    ball, other = (At(name, "center") for name in places)
    system = assemble(
        [point_mass(name, 1.0, np.array(place)) for name, place in places.items()]
        + [point_mass("twin", 2.0, np.array(places["ball"]))],
        outputs={
            "apart": probes.Distance(ball, other),
            "back": probes.Distance(other, ball),
            "fixed": probes.Distance(ball, (far + 1.0, far + 3.0)),
            "none": probes.Distance(ball, At("twin", "center")),
        },
        initial={
            name: Motion(velocity=(2.0 if name != "other" else 0.0, 0.0))
            for name in ("ball", "other", "twin")
        },
    )
    motion = integrate(system, GeneralizedAlpha(0.1), 1.0, TIGHT)
    t, found = motion.times, outputs(motion)
    apart = np.hypot(4.0 - 2.0 * t, 3.0)
    assert_allclose(found["apart"], apart, rtol=1e-11)
    assert_allclose(found["apart_rate"], -2.0 * (4.0 - 2.0 * t) / apart, atol=1e-11)
    assert_allclose(found["back"], found["apart"], rtol=1e-14)
    before = np.abs(1.0 - 2.0 * t) > 1e-6
    assert_allclose(found["fixed"], np.abs(1.0 - 2.0 * t), atol=1e-11)
    assert_allclose(found["fixed_rate"][before], -2.0 * np.sign(1.0 - 2.0 * t)[before], atol=1e-11)
    assert np.abs(found["none"]).max() < 1e-11
    assert np.isfinite(found["none_rate"]).all()


def test_a_distance_is_that_of_a_spring() -> None:
    found = outputs(integrate(eliminate(swinging(3)), GeneralizedAlpha(1e-3), 0.05, TIGHT))
    assert_allclose(found["far"] - 0.2, found["spring_stretch"], atol=1e-13)
    assert_allclose(found["far_rate"], found["spring_rate"], atol=1e-12)


@pytest.mark.parametrize(
    "to, expected", [(B1, "another place"), (None, "a place or the coordinates of a fixed point")]
)
def test_distances_to_nothing(to: Any, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        assemble(beams(2), outputs={"d": probes.Distance(B1, to)})


def test_pictures_show_them_between_their_places() -> None:
    motion = integrate(eliminate(swinging(2)), GeneralizedAlpha(1e-3), 0.01, TIGHT)
    shown = pictures.frames(motion).bodies
    assert set(shown) == {"beam", "spring", "rope", "stop"}
    for name, end in (
        ("spring", (1.2, 0.4, 0.0)),
        ("rope", (0.9, -0.3, 0.0)),
        ("stop", (0.5, 0.05, 0.0)),
    ):
        assert_allclose(shown[name].points[-1, -1], end, atol=1e-12)
    assert_allclose(
        shown["spring"].points[-1, 0, :2],
        [outputs(motion)[f"tip_{axis}"][-1] for axis in "xy"],
        atol=1e-12,
    )


MILLIMETRES = """
schema: 1
dimension: 2
bodies:
  ball: {type: point_mass, mass: 500 g, position: [300 mm, 0 mm]}
loads:
  weight: {type: gravity, acceleration: [0, -9810 mm/s^2]}
  spring: {type: spring_damper, at: ball, to: [300 mm, 250 mm], stiffness: 0.05 N/mm, damping: 0.2 g/ms, length: 200 mm}
  net: {type: stop, at: ball, to: [300 mm, -60 mm], direction: [0, 1], stiffness: 2 N/mm}
  cord: {type: rope, at: ball, to: [0, 250 mm], stiffness: 1 N/mm, length: 1 m}
analysis: {type: dynamic, duration: 0.5 s, step: 1 ms}
outputs:
  x: {type: position, at: ball}
  spring: {type: load, load: spring}
  E: {type: energy}
"""


def test_scenes_in_millimetres() -> None:
    scene = scenes.loads(MILLIMETRES)
    found = run(build.system(scene), scene.analysis.step, scene.analysis.duration)[1]
    w, zeta, fall = 10.0, 0.2 / (2 * 0.5 * 10.0), 9.81 / 100.0 - 0.05
    t, wd = np.linspace(0.0, 0.5, 501), w * np.sqrt(1 - zeta**2)
    y = -fall * (
        1 - np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * t))
    )
    free = (y > -0.06) & (t < 0.2)
    assert_allclose(found["x_y"][free], y[free], atol=1e-6)
    assert found["x_y"].min() == pytest.approx(-0.066, abs=2e-3)
    assert_allclose(found["spring_stretch"], 0.05 - found["x_y"], atol=1e-12)
    assert np.ptp(found["E_balance"]) < 1e-4


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "load: spring}",
            "load: sprin}",
            "output 'spring': expected one of the loads that measure spring, net, cord.*did you mean 'spring'",
        ),
        (
            "to: [0, 250 mm]",
            "to: ground",
            "loads.cord.to: expected a place or the coordinates of a fixed point, got ground",
        ),
        (", direction: [0, 1]", "", "loads.net.gap: expected a length > 0 without a direction"),
        (
            "stiffness: 1 N/mm",
            "stiffness: 1 N",
            "loads.cord.stiffness: expected a force per length",
        ),
        ("stiffness: 1 N/mm", "stiffness: -1", "loads.cord.stiffness: expected a force per length"),
    ],
)
def test_wrong_scenes_are_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build.system(scenes.loads(MILLIMETRES.replace(old, new)))
