"""Accelerations, angles between places and powers against exact motions; read by events, in reduced
models and after a resume.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from fmbs_skfem import studies
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body, point_mass
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.bodies.sections import Circular, Material
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.systems import At, Motion, assemble, eliminate, joints, loads, probes
from fmbs_skfem.systems.forces.controls import ControlTorque, Motor
from fmbs_skfem.systems.forces.springs import SpringDamper
from fmbs_skfem.systems.measures.sensors import Acceleration, Power

from ..models import segment

MESHES = Path(__file__).parents[2] / "meshes"
TIP, ROOT, FRAME = At("arm", "tip"), At("arm", "root"), At("arm", "frame")


def arm(dim: int, mass: float = 2.0) -> Body:
    """A rod of a metre along x that turns about z at the origin."""
    inertia = mass / 12.0 if dim == 2 else (1e-3, mass / 12.0, mass / 12.0)
    center = (0.5, 0.0, 0.0)[:dim]
    ends = {"root": (0.0, 0.0, 0.0)[:dim], "tip": (1.0, 0.0, 0.0)[:dim]}
    return rigid("arm", mass, inertia, center, dim=dim, places=ends)


def hinge(dim: int) -> joints.Joint:
    return (
        joints.Pin("hinge", ROOT)
        if dim == 2
        else joints.Revolute("hinge", ROOT, axis=(0.0, 0.0, 1.0))
    )


def test_a_displacement_counts_from_the_reference_wherever_that_is() -> None:
    """Also where coordinates count from the bodies, as far from the origin of the scene."""
    ball = point_mass("ball", 2.0, (7e3, -3.0))
    sensed = {
        "r": probes.Position(At("ball")),
        "u": probes.Displacement(At("ball")),
        "y": probes.Displacement(At("ball"), "y"),
    }
    system = assemble([ball], [], [loads.Gravity((0.0, -10.0))], outputs=sensed)
    found = outputs(integrate(system, GeneralizedAlpha(1e-2), 0.5))
    assert found["u_y"][-1] == pytest.approx(-1.25, rel=1e-6)
    assert_allclose(found["y"], found["u_y"])
    assert_allclose(found["r_x"], 7e3)
    assert_allclose(found["u_x"], 0.0, atol=1e-9)
    assert_allclose(found["r_y"] - found["u_y"], -3.0)


@pytest.mark.parametrize("axes", ["scene", "place"])
def test_an_arm_that_is_driven_has_the_acceleration_of_its_motion(axes: str) -> None:
    """Theta = t + t^2/2: - omega^2 r along the arm and alpha r across it; in the axes of the scene
    these turned.
    """
    drive = joints.DrivenAngle("drive", FRAME, of_time("t + t**2/2"))
    sensed = {"a": Acceleration(TIP if axes == "scene" else FRAME, axes=axes)}  # type: ignore[arg-type]
    system = eliminate(assemble([arm(2)], [hinge(2), drive], outputs=sensed))
    motion = integrate(system, GeneralizedAlpha(2e-3), 1.0)
    t, found = motion.times, outputs(motion)
    theta, omega, r = t + t**2 / 2, 1.0 + t, 1.0 if axes == "scene" else 0.5
    along, across = -(omega**2) * r, np.full_like(t, r)
    if axes == "scene":
        wanted = [
            along * np.cos(theta) - across * np.sin(theta),
            along * np.sin(theta) + across * np.cos(theta),
        ]
        assert_allclose([found["a_x"], found["a_y"]], wanted, atol=4e-5)
    else:
        assert_allclose([found["a_e1"], found["a_e2"]], [along, across], atol=2e-5)


def test_accelerations_of_a_pendulum_are_of_second_order() -> None:
    """Against theta'' = - 3 g / (2 L) sin theta of a rod: tangential and radial at its tip, largest
    errors at three steps.
    """
    g = 9.81
    exact = solve_ivp(
        lambda t, y: [y[1], -1.5 * g * np.cos(y[0])],
        (0.0, 1.0),
        [0.0, 0.0],
        rtol=1e-11,
        atol=1e-12,
        dense_output=True,
    )
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        sensed = {"a": Acceleration(TIP)}
        system = eliminate(
            assemble([arm(2)], [hinge(2)], [loads.Gravity((0.0, -g))], outputs=sensed)
        )
        motion = integrate(system, GeneralizedAlpha(h), 1.0)
        theta, omega = exact.sol(motion.times)
        alpha, c, s = -1.5 * g * np.cos(theta), np.cos(theta), np.sin(theta)
        found = outputs(motion)
        wanted = np.array([-alpha * s - omega**2 * c, alpha * c - omega**2 * s])
        errors.append(np.abs(np.array([found["a_x"], found["a_y"]]) - wanted).max())
    assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.15)
    assert errors[-1] < 1e-3 * 3.0 * g


@pytest.mark.parametrize("dim", [2, 3])
def test_an_accelerometer_reads_nothing_in_free_fall_and_gravity_at_rest(dim: int) -> None:
    gravity, axes = (0.0, -9.81, 0.0)[:dim], [f"a_e{k + 1}" for k in range(dim)]
    sensed = {
        "a": Acceleration(FRAME, axes="place", accelerometer=True),
        "up": Acceleration(FRAME, "y", accelerometer=True),
    }
    falling = eliminate(assemble([arm(dim)], [], [loads.Gravity(gravity)], outputs=sensed))
    found = outputs(integrate(falling, GeneralizedAlpha(1e-2), 0.1))
    assert_allclose([found[word] for word in axes], 0.0, atol=1e-9)
    held = eliminate(
        assemble(
            [arm(dim)], [joints.Clamp("root", FRAME)], [loads.Gravity(gravity)], outputs=sensed
        )
    )
    found = outputs(solve_statics(held, 1))
    assert_allclose(
        [found[word][-1] for word in (*axes, "up")], [*[0.0, 9.81, 0.0][:dim], 9.81], atol=1e-9
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_angles_between_places_count_their_turns(dim: int) -> None:
    """A wheel that is driven on an arm which turns as well: the angle of the drive, over more than
    two turns, and its rate.
    """
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    inertia = 0.1 if dim == 2 else (0.1, 0.1, 0.2)
    wheel = rigid("wheel", 1.0, inertia, (1.0, 0.0, 0.0)[:dim], dim=dim)
    on = (
        joints.Pin("on", At("wheel"), TIP)
        if dim == 2
        else joints.Revolute("on", At("wheel"), TIP, (0.0, 0.0, 1.0))
    )
    turning = [
        joints.DrivenAngle("carry", FRAME, of_time("-2*t"), axis),
        joints.DrivenAngle("spin", At("wheel", "frame"), of_time("7*t + t**2"), axis, FRAME),
    ]
    sensed = {
        "turn": probes.Angle(At("wheel", "frame"), axis, FRAME),
        "back": probes.Angle(FRAME, axis, At("wheel", "frame")),
    }
    system = eliminate(assemble([arm(dim), wheel], [hinge(dim), on, *turning], outputs=sensed))
    motion = integrate(system, GeneralizedAlpha(5e-3), 2.0)
    found, t = outputs(motion), motion.times
    assert_allclose(found["turn"], 7 * t + t**2, atol=1e-7)
    assert_allclose(found["back"], -found["turn"], atol=1e-9)
    assert_allclose(found["turn_rate"], 7 + 2 * t, atol=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_read_angles_between_places(dim: int) -> None:
    """A torque by an output of the angle and its rate is that of a torsion spring, to the bit of
    round-off.
    """
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    wheel = rigid(
        "wheel", 1.0, 0.1 if dim == 2 else (0.1, 0.1, 0.2), (1.0, 0.0, 0.0)[:dim], dim=dim
    )
    on = (
        joints.Pin("on", At("wheel"), TIP)
        if dim == 2
        else joints.Revolute("on", At("wheel"), TIP, (0.0, 0.0, 1.0))
    )
    hand = At("wheel", "frame")
    torque = of_state("-4 * turn - 0.1 * turn.rate", "N m")
    ways = [
        loads.TorsionSpring("k", hand, FRAME, 4.0, 0.1, axis=axis),
        ControlTorque("k", hand, FRAME, axis, torque=torque),
    ]
    found = []
    for way in ways:
        spin = {"wheel": Motion(None, 5.0 if dim == 2 else (0.0, 0.0, 5.0), (1.0, 0.0, 0.0)[:dim])}
        sensed = {"turn": probes.Angle(hand, axis, FRAME)}
        system = eliminate(
            assemble([arm(dim), wheel], [hinge(dim), on], [way], outputs=sensed, initial=spin)
        )
        found.append(outputs(integrate(system, GeneralizedAlpha(5e-3), 0.5))["turn"])
    assert np.ptp(found[0]) > 0.5
    assert_allclose(found[1], found[0], atol=1e-9)


def test_powers_are_what_changes_the_energy() -> None:
    """Of a motor, a damped spring and a force, over time: the change of kinetic energy of a rod
    without gravity, with h^2.
    """
    errors = []
    for h in (4e-3, 2e-3):
        pushing = [
            Motor("motor", FRAME, stall_torque=3.0, no_load_speed=20.0),
            SpringDamper("spring", TIP, (1.0, 0.4), stiffness=20.0, damping=0.5),
            loads.PointForce("force", TIP, (0.5, -1.0), of_time("cos(5*t)")),
        ]
        sensed = {one.name: Power(one.name) for one in pushing} | {"E": probes.Energy()}
        system = eliminate(assemble([arm(2)], [hinge(2)], pushing, outputs=sensed))
        motion = integrate(system, GeneralizedAlpha(h, 1.0), 1.0)
        found = outputs(motion)
        total = sum(found[one.name] for one in pushing)
        work = np.append(0.0, np.cumsum(0.5 * (total[1:] + total[:-1]) * np.diff(motion.times)))
        errors.append(np.abs(work - found["E_kinetic"]).max() / found["E_kinetic"].max())
    assert errors[1] < 1e-4
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_the_power_of_a_drive_is_torque_times_rate(dim: int) -> None:
    """I theta'' theta' of a rod about its end, and F . v of a point that is driven."""
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    drive = joints.DrivenAngle("drive", FRAME, of_time("t**3"), axis)
    system = eliminate(assemble([arm(dim)], [hinge(dim), drive], outputs={"P": Power("drive")}))
    motion = integrate(system, GeneralizedAlpha(2e-3), 1.0)
    t = motion.times
    assert_allclose(outputs(motion)["P"], 2.0 / 3.0 * 6 * t * 3 * t**2, atol=2e-3)


def test_the_power_of_a_driven_position() -> None:
    block = rigid("block", 2.0, 0.1, (0.0, 0.0), dim=2)
    drive = joints.DrivenPosition("drive", At("block"), (of_time("sin(3*t)"), of_time("t**2")))
    system = eliminate(assemble([block], [drive], outputs={"P": Power("drive")}))
    motion = integrate(system, GeneralizedAlpha(2e-3), 1.0)
    t = motion.times
    wanted = 2.0 * (-9 * np.sin(3 * t) * 3 * np.cos(3 * t) + 2 * 2 * t)
    assert_allclose(outputs(motion)["P"], wanted, atol=2e-3 * np.abs(wanted).max())


def shaft(cells: int) -> tuple[Body, float]:
    """A round bar of a metre along x, and its GJ."""
    section = Circular(0.02).of_beam(Material(1e9, 1000.0, 0.25))
    return beam("bar", segment(cells, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), section), float(
        section.stiffness[3, 3]
    )


def test_the_angle_between_the_ends_of_a_beam_that_is_twisted_twice() -> None:
    """T L / GJ = 4 pi, counted on the way, and as much back."""
    part, GJ = shaft(24)
    ends, axis = (At("bar", "right"), At("bar", "left")), (1.0, 0.0, 0.0)
    sensed = {
        "on": probes.Angle(ends[0], axis, ends[1]),
        "back": probes.Angle(ends[1], axis, ends[0]),
    }
    twist = loads.Moment("T", ends[0], (4.0 * np.pi * GJ, 0.0, 0.0))
    found = outputs(
        solve_statics(
            eliminate(assemble([part], [joints.Clamp("root", ends[1])], [twist], outputs=sensed)),
            10,
        )
    )
    assert_allclose(found["on"], 4.0 * np.pi * np.linspace(0.0, 1.0, 11), rtol=2e-3, atol=1e-9)
    assert_allclose(found["back"], -found["on"], atol=1e-9)


def test_sections_of_a_beam_have_an_angular_velocity() -> None:
    part, _ = shaft(4)
    sensed = {
        f"w{axis}": probes.AngularVelocity(At("bar", 0.3), tuple(np.eye(3)[k]))
        for k, axis in enumerate("xyz")
    }
    start = {"bar": Motion((0.0, 0.0, 0.0), (7.0, 0.0, 0.0), (0.5, 0.0, 0.0))}
    found = outputs(
        integrate(
            eliminate(assemble([part], initial=start, outputs=sensed)), GeneralizedAlpha(2e-4), 0.02
        )
    )
    assert_allclose(
        [found[f"w{axis}"] for axis in "xyz"], np.outer([7.0, 0.0, 0.0], np.ones(101)), atol=2e-4
    )


def test_what_has_no_power_is_refused() -> None:
    for name in ("hinge", "weight", "nothing"):
        with pytest.raises(InputError, match="loads at places, or of the driven joints"):
            assemble(
                [arm(2)],
                [hinge(2)],
                [loads.Gravity((0.0, -9.81), "weight")],
                outputs={"P": Power(name)},
            )


def test_a_point_has_no_axes() -> None:
    parts = [rigid("rod", 1.0, (0.0, 1.0, 1.0), (0.0, 0.0, 0.0)), point_mass("m", 1.0, np.zeros(3))]
    with pytest.raises(InputError, match="a place with 3 vectors"):
        assemble(parts, outputs={"a": Acceleration(At("m"), axes="place")})


SCENE = """\
schema: 1
dimension: 2
bodies:
  beam: {{type: cable, mesh: {mesh}, cells: 8, section: {{shape: circular, diameter: 10 mm}},
         material: {{young_modulus: 1 GPa, density: 1800}}}}
  bob: {{type: rigid, mass: 0.05 kg, inertia: 1e-5 kg m^2, center: [1 m, 0]}}
joints:
  root: {{type: pin, at: beam.left}}
  swing: {{type: driven_angle, at: beam.left, angle: "-0.6 * (1 - cos(4*t))"}}
  end: {{type: weld, at: bob.frame, to: beam.right}}
loads:
  weight: {{type: gravity, acceleration: [0, -9.81]}}
  pull: {{type: spring_damper, at: beam.right, to: [1 m, 0.5 m], stiffness: 2 N/m, damping: 0.1 N s/m}}
analysis: {{type: dynamic, duration: 0.4 s, step: 1 ms}}
events: {{jolt: {{when: "felt.e1 + 6 m/s**2", direction: falling, stop: true}}}}
outputs:
  a: {{type: acceleration, at: beam.right}}
  felt: {{type: acceleration, at: bob.frame, axes: place, accelerometer: true}}
  bend: {{type: angle, at: beam.right, to: beam.left}}
  P: {{type: power, of: pull}}
  Q: {{type: power, of: swing}}
reduction: {{snapshots: 2 ms, tolerance: 1e-14}}
"""


def test_reduced_models_read_them_too(tmp_path: Path) -> None:
    """Full, reduced and hyper-reduced: the same columns, read by the same event."""
    path = tmp_path / "pendulum.yaml"
    path.write_text(SCENE.format(mesh=MESHES / "beam_20.msh"))
    full = studies.run(path, allow_outside=True).table()
    studies.reduce(path, out=tmp_path / "p.h5", allow_outside=True)
    small = studies.run(tmp_path / "p.h5").table()
    assert full["t [s]"][-1] == pytest.approx(small["t [s]"][-1], abs=1e-4)
    assert full["t [s]"][-1] < 0.39
    assert full["felt_e1 [m/s^2]"][-1] == pytest.approx(-6.0, abs=1e-6)
    for column in (
        "a_y [m/s^2]",
        "felt_e2 [m/s^2]",
        "bend [rad]",
        "bend_rate [rad/s]",
        "P [W]",
        "Q [W]",
    ):
        assert np.abs(
            small[column][:-1] - full[column][: len(small["t [s]"]) - 1]
        ).max() < 0.02 * np.ptp(full[column]), column
