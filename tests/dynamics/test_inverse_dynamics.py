"""Torques of drives for motions that are given, against closed forms, and drives with corners."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.algebra.rotations import rotation
from fmbs_skfem.core.errors import InputError, SolverError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.profiles import MotionLimits, Move, motion
from fmbs_skfem.core.values.tables import Table
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, solve_inverse_dynamics
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes, sensors
from fmbs_skfem.systems.signals import jet
from tests import models

G = 9.81
LENGTH = 1.5  #: of motions [s]
PATHS = (
    motion("minimum_jerk", [Move(np.pi / 2, LENGTH)]),
    motion("minimum_jerk", [Move(-np.pi / 3, LENGTH)]),
)


def arm(paths: Any = PATHS, turn: float = 0.0, shift: Any = (0.0, 0.0)) -> System:
    """Two uniform bars of 1 m and 1 kg under gravity, turned and shifted as a whole."""
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    parts = []
    for k, name in enumerate(("one", "two")):
        places = {"begin": R @ (k, 0.0) + shift, "end": R @ (k + 1.0, 0.0) + shift}
        parts.append(rigid(name, 1.0, 1 / 12, R @ (k + 0.5, 0.0) + shift, dim=2, places=places))
    first, second = At("one", "frame"), At("two", "frame")
    held = [
        joints.Pin("A", At("one", "begin")),
        joints.Pin("B", At("one", "end"), At("two", "begin")),
        joints.DrivenAngle("shoulder", first, paths[0]),
        joints.DrivenAngle("elbow", second, paths[1], to=first),
    ]
    outputs = {"shoulder": probes.Reaction("shoulder"), "elbow": probes.Reaction("elbow"), "power": sensors.Power("elbow")}  # fmt: skip
    weight = loads.Gravity(tuple(R @ (0.0, -G)))
    return eliminate(assemble(parts, held, [weight], outputs=outputs))


def torques(times: np.ndarray, paths: Any = PATHS) -> np.ndarray:
    """Of both drives (2, s): M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot modeling and control
    (2006), (7.87), with m = l = 1, lc = 1/2, I = 1/12.
    """
    (q1, v1, a1), (q2, v2, a2) = (jet(one, times, 1e-9) for one in paths)
    h = -0.5 * np.sin(q2)
    d12 = 1 / 3 + 0.5 * np.cos(q2)
    d11 = 5 / 3 + np.cos(q2)
    far = 0.5 * G * np.cos(q1 + q2)
    shoulder = d11 * a1 + d12 * a2 + h * v2 * (2 * v1 + v2) + 1.5 * G * np.cos(q1) + far
    return np.stack([shoulder, d12 * a1 + a2 / 3 - h * v1**2 + far])


def errors(found: dynamics.Trajectory, exact: np.ndarray) -> np.ndarray:
    """Largest errors of both torques, over their ranges."""
    got = dynamics.outputs(found)
    both = np.stack([got["shoulder_torque"], got["elbow_torque"]])
    return np.asarray(np.abs(both - exact).max(axis=1) / np.ptp(exact, axis=1))


def of_points(path: Any, name: str) -> Any:
    """A path by 201 of its points, as a table that drives."""
    t = np.linspace(0.0, LENGTH, 201)
    return Table(name, "rad", tuple(t), tuple(path(t)), smooth=True)


@pytest.mark.parametrize("turn, shift", [(0.0, (0.0, 0.0)), (2.1, (30.0, -7.0))])
def test_torques_of_an_arm(turn: float, shift: tuple[float, float]) -> None:
    """Exact by profiles, to 1e-4 by tables of 201 points; the power is torque times rate."""
    times = np.linspace(0.0, LENGTH, 101)
    exact = torques(times)
    found = solve_inverse_dynamics(arm(PATHS, turn, shift), times)
    assert errors(found, exact).max() < 1e-12
    rate = jet(PATHS[1], times, 1e-9)[1]
    assert_allclose(dynamics.outputs(found)["power"], exact[1] * rate, atol=1e-11)
    tables = [of_points(path, f"q{k}") for k, path in enumerate(PATHS)]
    assert errors(solve_inverse_dynamics(arm(tables, turn, shift), times), exact).max() < 1e-4
    python = [lambda t, path=path: path(t) for path in PATHS]  # derivatives are differences
    assert errors(solve_inverse_dynamics(arm(python, turn, shift), times), exact).max() < 1e-5


def test_few_instants_are_as_exact_as_many() -> None:
    """Half a turn and more between two instants, in parts: nothing is integrated."""
    paths = (of_time("2 * pi * t"), of_time("sin(7 * t)"))
    times = np.array([0.0, 0.6, 1.9, 2.0])
    assert errors(solve_inverse_dynamics(arm(paths), times), torques(times, paths)).max() < 1e-12


def newton_euler(R: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> list[float]:
    """Torques of three drives, from the base on: J. J. Craig, Introduction to robotics (2005),
    6.5, in the axes of the scene.
    """
    axes = ((0, 0, 1.0), (0, 1.0, 0), (0, 1.0, 0))
    hubs = np.array([(0, 0, 0), (0, 0, 0.5), (1.0, 0, 0.5)])
    turned, w, dw = R, np.zeros(3), np.zeros(3)
    hub, up = np.zeros(3), R @ (0, 0, G)
    known = []
    for k in range(3):
        if k:
            arm = turned @ (hubs[k] - hubs[k - 1])
            up = up + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
            hub = hub + arm
        axis = turned @ axes[k]
        dw = dw + a[k] * axis + np.cross(w, v[k] * axis)
        w = w + v[k] * axis
        turned = turned @ rotation(q[k] * np.array(axes[k]))
        c = turned @ (CENTERS[k] - hubs[k])
        force = MASSES[k] * (up + np.cross(dw, c) + np.cross(w, np.cross(w, c)))
        I = turned @ np.diag(INERTIAS[k]) @ turned.T
        known.append((hub, axis, hub + c, force, I @ dw + np.cross(w, I @ w)))
    return [
        float(axis @ sum(m + np.cross(c - hub, f) for _, _, c, f, m in known[k:]))
        for k, (hub, axis, *_) in enumerate(known)
    ]


MASSES = (2.0, 1.0, 0.5)
CENTERS = np.array([(0, 0, 0.25), (0.5, 0, 0.5), (1.4, 0, 0.5)])
INERTIAS = ((0.02, 0.02, 0.01), (0.001, 0.08, 0.08), (0.012, 0.03, 0.04))


@pytest.mark.parametrize("turn, shift", [(0.0, 0.0), (1.2, 8.0)])
def test_torques_of_an_arm_in_space(turn: float, shift: float) -> None:
    """A base, a shoulder and an elbow; turned about a slanted axis and shifted as well."""
    R = rotation(turn * np.array([2.0, -1.0, 2.0]) / 3.0)
    o = shift * np.array([1.0, -0.3, 0.5])
    names = ("base", "one", "two")
    ends = ({"a": (0, 0, 0), "b": (0, 0, 0.5)}, {"b": (0, 0, 0.5), "c": (1, 0, 0.5)}, {"c": (1, 0, 0.5)})  # fmt: skip
    parts = [
        rigid(name, MASSES[k], INERTIAS[k], R @ CENTERS[k] + o, rotation=R, places={key: R @ place + o for key, place in ends[k].items()})
        for k, name in enumerate(names)
    ]  # fmt: skip
    paths = (
        motion("minimum_jerk", [Move(2.0, 1.0)]),
        motion("minimum_jerk", [Move(-0.9, 0.5), Move(0.3, 0.5)]),
        motion("trapezoidal", [Move(1.0)], start=0.1, limits=MotionLimits(1.5, 6.0, 60.0)),
    )
    z, y = R @ (0, 0, 1.0), R @ (0, 1.0, 0)
    frames = [At(name, "frame") for name in names]
    held = [
        joints.Revolute("A", At("base", "a"), axis=z),
        joints.Revolute("B", At("base", "b"), At("one", "b"), axis=y),
        joints.Revolute("C", At("one", "c"), At("two", "c"), axis=y),
        joints.DrivenAngle("m0", frames[0], paths[0], axis=z),
        joints.DrivenAngle("m1", frames[1], paths[1], axis=y, to=frames[0]),
        joints.DrivenAngle("m2", frames[2], paths[2], axis=y, to=frames[1]),
    ]
    outputs = {f"m{k}": probes.Reaction(f"m{k}") for k in range(3)}
    weight = loads.Gravity(tuple(R @ (0, 0, -G)))
    system = eliminate(assemble(parts, held, [weight], outputs=outputs))
    times = np.linspace(0.0, 1.0, 12) + 1e-3
    got = dynamics.outputs(solve_inverse_dynamics(system, times))
    q, v, a = np.stack([jet(one, times, 1e-9) for one in paths], axis=2)
    exact = np.array([newton_euler(R, *each) for each in zip(q, v, a, strict=True)])
    for k in range(3):
        assert_allclose(got[f"m{k}_torque"], exact[:, k], atol=1e-11)


DRIVE = '  motor: {type: driven_angle, at: crank.frame, angle: "SPIN * t"}\n'
SLIDER = """
schema: 1
dimension: 2
bodies:
  crank: {type: rigid, mass: 1000 g, inertia: 0.01 / 12, center: [50 mm, 0], points: {A: [0, 0], B: [100 mm, 0]}}
  rod: {type: rigid, mass: 2 kg, inertia: 150 kg cm^2, center: [25 cm, 0], points: {B: [100 mm, 0], C: [40 cm, 0]}}
  slider: {type: point_mass, mass: 3 kg, position: [400 mm, 0]}
joints:
  A: {type: revolute, at: crank.A}
  B: {type: revolute, at: crank.B, to: rod.B}
  C: {type: revolute, at: rod.C, to: slider}
  guide: {type: slider, at: slider, direction: [1, 0]}
  motor: {type: driven_angle, at: crank.frame, angle: "SPIN * t"}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
outputs:
  motor: {type: reaction, joint: motor}
analysis: {type: inverse_dynamics, duration: 0.5 s, step: 5 ms}
"""


@pytest.mark.parametrize("spin", ["20 rad/s", "1145.915590261646 deg/s"])
def test_a_crank_slider_at_constant_speed(spin: str) -> None:
    """The torque is w^2 / 2 dI/dphi + dV/dphi, I the inertia that the crank feels: virtual work."""
    scene = scenes.loads(SLIDER.replace("SPIN", spin))
    found = scene.analysis.solve(build.chosen_form(scene, build.system(scene)))
    r, l, w = 0.1, 0.3, 20.0
    phi = w * found.times

    def energies(phi: Any) -> tuple[Any, Any]:
        """I and V; exact derivatives by complex steps."""
        s, c = np.sin(phi), np.cos(phi)
        rod = np.sqrt(l**2 - (r * s) ** 2)
        turn = -r * c / rod  # of the rod over that of the crank
        slide = -r * s + r * s * turn
        middle = (-r * s + 0.5 * r * s * turn) ** 2 + (0.5 * r * c) ** 2
        inertia = 1.0 * r**2 / 3 + 2.0 * middle + 0.015 * turn**2 + 3.0 * slide**2
        return inertia, G * (1.0 * 0.5 * r * s + 2.0 * 0.5 * r * s)

    inertia, height = (one.imag / 1e-30 for one in energies(phi + 1e-30j))
    exact = 0.5 * w**2 * inertia + height
    assert_allclose(dynamics.outputs(found)["motor_torque"], exact, atol=1e-11 * np.ptp(exact))


def pushed(crank: float, way: str) -> dynamics.Trajectory:
    """The crank-slider driven at its slider, from an angle of the crank on [rad]."""
    b = np.array([0.1 * np.cos(crank), 0.1 * np.sin(crank)])
    c = np.array([b[0] + np.sqrt(0.09 - b[1] ** 2), 0.0])
    parts = [
        rigid("crank", 1.0, 0.01 / 12, b / 2, dim=2, places={"A": (0, 0), "B": b}),
        rigid("rod", 2.0, 0.015, (b + c) / 2, dim=2, places={"B": b, "C": c}),
    ]
    held = [
        joints.Pin("A", At("crank", "A")),
        joints.Pin("B", At("crank", "B"), At("rod", "B")),
        joints.DrivenPosition("pusher", At("rod", "C"), (of_time(way), of_time("0"))),
    ]
    outputs = {"pusher": probes.Reaction("pusher")}
    return solve_inverse_dynamics(assemble(parts, held, outputs=outputs), np.linspace(0.0, 1.0, 21))


def test_what_drives_cannot_do_is_said() -> None:
    """A motion left free, a body that bends, a dead centre, a place out of reach: with what was
    found before.
    """
    text = SLIDER.replace(DRIVE, "").replace("{type: reaction, joint: motor}", "{type: energy}")
    scene = scenes.loads(text)
    wanted = r"analysis: .*1 left free: .*crank turns about \(0, 0\).*type: dynamic"
    with pytest.raises(InputError, match=wanted):
        scene.analysis.require(scene, build.system(scene))
    with pytest.raises(InputError, match=r"bodies that bend \(beam\).*`type: dynamic`"):
        solve_inverse_dynamics(models.spin_up(4), np.array([0.0]))
    with pytest.raises(
        InputError, match=r"start .*a dead centre .*turns about \(0, 0\); rod turns"
    ):
        pushed(0.0, "-0.1 * t")
    with pytest.raises(SolverError, match=r"t = 0.7 s: expected a position .* can take") as beyond:
        pushed(np.pi / 2, "0.17 * t")  # 0.117 m are left to the dead centre
    assert len(beyond.value.partial.times) == 14
    reach = dynamics.outputs(pushed(np.pi / 2, "0.1 * t"))["pusher_x"]
    assert np.isfinite(reach).all()


@pytest.mark.parametrize("start", [0.1005, 0.0004, 0.0])
def test_steps_over_corners_of_drives_are_of_second_order(start: float) -> None:
    """The acceleration of a drive jumps within steps. Passed over, the jump goes on in the torque
    for ten steps, by a third of its range and more, whatever the step.
    """
    paths = (
        motion("trapezoidal", [Move(np.pi / 2)], start=start, limits=MotionLimits(3.0, 15.0)),
        motion("minimum_jerk", [Move(-np.pi / 3, 0.9)], start=start + 0.1),
    )
    found = []
    for h in (4e-3, 2e-3):
        run = integrate(arm(paths), GeneralizedAlpha(h), 1.0)
        found.append(errors(run, torques(run.times, paths)))
    assert found[1].max() < 5e-3
    assert (found[0] / found[1]).min() > 3.2
