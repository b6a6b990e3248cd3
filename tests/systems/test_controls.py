"""Forces by expressions of the state: exact motions, tangents, reduced and saved models, what is
refused.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import cable, point_mass, rigid, sections
from fmbs_skfem.core.errors import CorruptFile, InputError, SolverError
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Motion, System, assemble, check_force, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import gauges, loads, responses
from fmbs_skfem.systems.forces.controls import Actuator, ControlForce, ControlTorque, Motor
from fmbs_skfem.systems.measures import probes

from .. import models
from ..forms import forms
from .parts import A1, B1, BOB, beams

TIGHT = Newton(tolerance=1e-12)
BALL, DISC = At("ball", "center"), At("disc", "frame")
NUMBERS = {"k": 18.0, "c": 1.2, "h": 0.7}
EVERY = [
    "-k * stretch - c * rate",
    "-k * stretch**3 - c * rate * abs(rate)",
    "where(stretch < 0, 0, k * stretch**2) + max(rate, 0) - min(stretch, 2 * stretch)",
    "k * tanh(stretch / h) + sinh(h * rate) + cosh(stretch) * sin(3 * t)",
    "interp(stretch, -1, -5, 0, 0, 0.4, 1, 3, 2) + mod(7 + stretch, 2) + floor(9.5 + stretch) + sign(2 + stretch)",
    "asin(stretch / 9) + acos(stretch / 9) + atan2(1 + stretch, 3 + rate) + sqrt(9 + stretch) + log(9 + rate) + exp(-stretch)",
]


@pytest.mark.parametrize("text", EVERY)
@pytest.mark.parametrize("dim", [2, 3])
def test_derivatives(dim: int, text: str) -> None:
    """Of every function, against differences; a force of any law is not bound to take energy out."""
    check_force(beams(dim), Actuator("a", B1, BOB, of_state(text, "", NUMBERS), 0.3))


def observed(dim: int) -> dict[str, probes.Probe]:
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    return {
        "tip": probes.Position(A1),
        "high": probes.Position(B1, "y"),
        "speed": probes.Velocity(BOB),
        "slope": probes.Slope(A1),
        "angle": probes.Angle(A1, axis),
        "spin": probes.AngularVelocity(B1, axis),
        "bend": probes.Deflection(B1, A1),
        "far": probes.Distance(B1, BOB),
        "near": probes.Distance(A1, (0.3, 0.4, 0.5)[:dim]),
    }


WHOLE = "k*(tip.x + tip.y**2) - c*tip.vx*high + high.rate*speed.y + sin(angle) + angle.rate*slope.x + spin*slope.vy + bend**2 + t"
WHOLE += " + far*near.rate + near*far.rate"


@pytest.mark.parametrize("dim", [2, 3])
def test_every_output_is_a_variable(dim: int) -> None:
    """The value that the force has on a motion is that of the outputs, and its tangent the one of
    differences.
    """
    load = ControlForce("f", A1, (0.0, 1.0, 0.0)[:dim], of_state(WHOLE, "", {"k": 2.0, "c": 0.3}))
    check_system(assemble(beams(dim), loads=[load], outputs=observed(dim)))
    system = assemble(
        beams(dim),
        [joints.Clamp("clamp", At("a", "left")), joints.Weld("weld", A1, At("b", "left"))],
        [load],
        outputs=observed(dim) | {"f": gauges.LoadState("f")},
        initial={
            name: Motion(angular_velocity=0.5 if dim == 2 else (0.0, 0.0, 0.5))
            for name in ("bob", "c")
        },
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(1e-3), 0.05, TIGHT)
    o, t = outputs(motion), motion.times
    sensors = motion.system.sensors
    rate, place = (
        np.asarray(sensors.matrix @ motion.v.T).T,
        np.asarray(sensors.matrix @ motion.x.T).T + sensors.offset,
    )
    row = {name: rate[:, list(one.rows)] for name, one in motion.system.outputs.items()}
    arm = place[:, list(motion.system.outputs["angle"].rows)]
    expected = (
        2.0 * (o["tip_x"] + o["tip_y"] ** 2)
        - 0.3 * row["tip"][:, 0] * o["high"]
        + row["high"][:, 0] * o["speed_y"]
    )
    turn = (arm[:, 0] * row["angle"][:, 1] - arm[:, 1] * row["angle"][:, 0]) / np.sum(
        arm**2, axis=1
    )
    expected = (
        expected
        + np.sin(o["angle"])
        + turn * o["slope_x"]
        + o["spin"] * row["slope"][:, 1]
        + o["bend"] ** 2
        + t
    )
    expected = expected + o["far"] * o["near_rate"] + o["near"] * o["far_rate"]
    assert_allclose(o["f_force"], expected, atol=1e-9)


def ball(*forces: loads.Load, at: float = 1.3, speed: float = 0.0) -> System:
    return assemble(
        [point_mass("ball", 2.0, np.array([at, 0.0]))],
        loads=forces,
        outputs={"ball": probes.Position(BALL), "E": probes.Energy()},
        initial={"ball": Motion(velocity=(speed, 0.0))},
    )


def test_a_spring_written_as_feedback() -> None:
    """- k (x - 0.3 m) - c x', whose motion is that of the damped oscillator."""
    force = ControlForce(
        "f", BALL, (1.0, 0.0), of_state("-k*(ball.x - 300 mm) - c*ball.vx", "", NUMBERS)
    )
    motion = integrate(ball(force), GeneralizedAlpha(1e-3), 3.0, TIGHT)
    t, wd = motion.times, 3.0 * np.sqrt(0.99)
    found = outputs(motion)
    assert_allclose(
        found["ball_x"] - 0.3,
        np.exp(-0.3 * t) * (np.cos(wd * t) + 0.3 / wd * np.sin(wd * t)),
        atol=6e-6,
    )
    assert np.ptp(found["E_balance"]) < 1e-4


def test_division_by_zero_at_one_state() -> None:
    """It ends the run with its reason, and `where` guards it."""
    bad = ControlForce("f", BALL, (1.0, 0.0), of_state("1e-6 / ball.x", "", {}))
    with pytest.raises(SolverError) as caught:
        integrate(ball(bad, at=0.0), GeneralizedAlpha(1e-2), 1.0)
    assert caught.value.time is not None
    guarded = ControlForce(
        "f", BALL, (1.0, 0.0), of_state("where(abs(ball.x) < 0.1, 0, 1 / ball.x)", "", {})
    )
    motion = integrate(ball(guarded, at=0.0, speed=0.05), GeneralizedAlpha(1e-2), 1.0, TIGHT)
    assert_allclose(outputs(motion)["ball_x"], 0.05 * motion.times, atol=1e-12)


def disc(dim: int, *forces: loads.Load, speed: float = 0.0) -> System:
    axis: dict[str, Any] = {} if dim == 2 else {"axis": (0.0, 0.0, 1.0)}
    inertia: Any = 0.01 if dim == 2 else 0.01 * np.eye(3)
    system = assemble(
        [rigid.rigid("disc", 1.0, inertia, (0.0,) * dim, dim=dim)],
        [joints.Revolute("pin", DISC, **axis)],
        forces,
        outputs={
            "hinge": probes.Angle(DISC, **axis),
            "E": probes.Energy(),
            **{f.name: gauges.LoadState(f.name) for f in forces},
        },
        initial={"disc": Motion(angular_velocity=speed if dim == 2 else (0.0, 0.0, speed))},
    )
    return eliminate(system)


@pytest.mark.parametrize("text", ["-k * angle", "-k * hinge", "-k * hinge.angle"])
@pytest.mark.parametrize("dim", [2, 3])
def test_angles_count_their_turns(dim: int, text: str) -> None:
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    load = ControlTorque("m", DISC, axis=axis, torque=of_state(text, "N m", {"k": 0.01}))
    motion = integrate(disc(dim, load, speed=10.0), GeneralizedAlpha(2e-3), 6.0, TIGHT)
    found = outputs(motion)
    assert_allclose(found["hinge"], 10.0 * np.sin(motion.times), atol=5e-3)
    assert_allclose(found["m_angle"], found["hinge"], atol=1e-9)
    assert_allclose(found["m_torque"], -0.01 * found["hinge"], atol=1e-9)
    assert np.ptp(found["E_balance"]) < 1e-4


@pytest.mark.parametrize("dim", [2, 3])
def test_a_motor_runs_up(dim: int) -> None:
    """w = w0 (1 - exp(- T t / (J w0)))."""
    motor = Motor(
        "m", DISC, axis=None if dim == 2 else (0.0, 0.0, 1.0), stall_torque=0.1, no_load_speed=5.0
    )
    check_force(
        [rigid.rigid("disc", 1.0, 0.01 if dim == 2 else 0.01 * np.eye(3), (0.0,) * dim, dim=dim)],
        motor,
    )
    motion = integrate(disc(dim, motor), GeneralizedAlpha(2e-3), 3.0, TIGHT)
    assert_allclose(outputs(motion)["m_rate"], 5.0 * (1 - np.exp(-motion.times / 0.5)), atol=2e-4)


def test_a_torsion_spring_between_bodies_in_space() -> None:
    """Two discs of 0.01 and 0.02 kg m^2 on a tilted axis, on 0.06 N m/rad: w = 3 rad/s, 5 sin 3t
    over one and a half turns.
    """
    a = np.array([0.6, 0.0, 0.8])
    parts = [
        rigid.rigid(name, 1.0, J * np.eye(3), (0.0, 0.0, 0.0))
        for name, J in (("a", 0.01), ("b", 0.02))
    ]
    ends = At("a", "frame"), At("b", "frame")
    spring = loads.TorsionSpring("spring", *ends, 0.06, axis=tuple(a))
    system = assemble(
        parts,
        [joints.Revolute("pin", ends[0], ends[1], axis=tuple(a)), joints.Pin("hold", ends[1])],
        [spring],
        outputs={"spring": gauges.LoadState("spring"), "E": probes.Energy()},
        initial={
            "a": Motion(angular_velocity=tuple(20.0 * a)),
            "b": Motion(angular_velocity=tuple(-10.0 * a)),
        },
    )
    check_force(parts, spring)
    motion = integrate(eliminate(system), GeneralizedAlpha(5e-4), 3.0, TIGHT)
    found = outputs(motion)
    assert_allclose(found["spring_angle"], 10.0 * np.sin(3.0 * motion.times), atol=2e-3)
    assert_allclose(found["spring_torque"], -0.06 * found["spring_angle"], atol=1e-7)
    assert np.ptp(found["E_balance"]) < 1e-4


def arm(dim: int) -> System:
    """A beam on a hinge whose angle is held at a goal that moves."""
    axis = None if dim == 2 else (0.0, 0.0, 1.0)
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.02), sections.Material(1e9, 2300.0), dim=dim
    )
    root, tip = At("beam", "left"), At("beam", "right")
    torque = of_state(
        "Kp * (0.3 * (1 - cos(4 * t)) - hinge.angle) - Kd * hinge.rate - 0.1 * tip.vy",
        "",
        {"Kp": 60.0, "Kd": 8.0},
    )
    return assemble(
        [beam],
        [joints.Revolute("hinge", root, **({} if axis is None else {"axis": axis}))]
        if dim == 2
        else [joints.Pin("hinge", root)],
        [
            ControlTorque("drive", root, axis=axis, torque=torque),
            loads.Gravity((0.0, -1.0, 0.0)[:dim]),
        ],
        outputs={"hinge": probes.Angle(root, axis), "tip": probes.Position(tip)},
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_reduced_hyper_reduced_and_saved_models(dim: int, tmp_path: Path) -> None:
    raw, scheme = arm(dim), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.5, TIGHT)
    expected = outputs(full)
    for system in forms(raw, full, 1e-13, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.5, TIGHT))
        for name in expected:
            assert_allclose(found[name], expected[name], atol=1e-3)


SCENE = """
schema: 1
dimension: 2
parameters: {k: 18 N/m, c: 1.2 N s/m, far: 300 mm}
bodies: {ball: {type: point_mass, mass: 2 kg, position: [1.3, 0]}}
loads: {f: {type: control_force, at: ball, direction: [1, 0], force: "-k*(tip.x - far) - c*tip.vx"}}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {tip: {type: position, at: ball}}
"""


def test_scenes() -> None:
    scene = reading.loads(SCENE)
    assert scene.used == {"k", "c", "far"}
    motion = integrate(build.system(scene), GeneralizedAlpha(1e-3), 1.0, TIGHT)
    t, wd = motion.times, 3.0 * np.sqrt(0.99)
    assert_allclose(
        outputs(motion)["tip_x"] - 0.3,
        np.exp(-0.3 * t) * (np.cos(wd * t) + 0.3 / wd * np.sin(wd * t)),
        atol=6e-6,
    )


@pytest.mark.parametrize(
    "text, message",
    [
        (
            "-k*(tip.z - far)",
            r"loads.f.force: expected one of tip.x, .*, got 'tip.z'; did you mean 'tip.[xy]'",
        ),
        (
            "-k*(top.x - far)",
            r"loads.f.force: expected one of tip.x.* got 'top.x'; did you mean 'tip.x'",
        ),
        ("-kk*(tip.x - far)", r"loads.f.force: expected one of .* got 'kk'; did you mean 'k'"),
        (
            "-k*(tip.x - 2 s)",
            r"loads.f.force: expected all parts of '-' of one dimension, got length and time",
        ),
        (
            "-k*tip.vx",
            r"loads.f.force: expected a force \[N\] as a function of the state, got '-k\*tip.vx'",
        ),
        ("-k*(tip.x - far", r"loads.f.force: expected '\)'"),
        ("-k*(tip.x - 0.3 m/s)", r"of one dimension, got length and velocity"),
        ("interp(tip.x, 0 m, 0 N, 1 m, 2 m)", r"of one dimension, got length and force"),
    ],
)
def test_what_does_not_fit_is_named(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace("-k*(tip.x - far) - c*tip.vx", text))


def test_names_of_parameters_come_first() -> None:
    """A parameter may have the name of what the load measures, or of an output."""
    names = {"rate": 3.0, "ball": 2.0}
    system = ball(
        ControlForce("f", BALL, (1.0, 0.0), of_state("rate * ball - stretch", "", names)), at=0.0
    )
    motion = integrate(system, GeneralizedAlpha(1e-2), 0.1, TIGHT)
    assert motion.a[0, 0] == pytest.approx(3.0, rel=1e-9)


def test_files_name_the_output_that_they_need(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    load = ControlForce("f", BALL, (1.0, 0.0), of_state("-ball.x", "", {}))
    path = files.save(eliminate(ball(load)), tmp_path / "model.h5")
    monkeypatch.setattr(probes.Probe, "known", {"energy": probes.Energy})
    responses.made.cache_clear()
    with pytest.raises(CorruptFile, match="'position'; import the file that declares it first"):
        files.load(path)
