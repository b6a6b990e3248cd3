"""Discrete controllers: motions under held inputs are exact, integrals stand still at limits,
reduced and saved models, scenes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from fmbs_skfem.bodies import cable, point_mass, rigid, sections
from fmbs_skfem.control import sampled_loops
from fmbs_skfem.control.controllers import Controller, LookupTable, Pid, Program, StateFeedback
from fmbs_skfem.control.feed import Feed
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.inputs import Input
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, integration, outputs, start
from fmbs_skfem.dynamics.checkpoint import Checkpoint, Resumed, Rows, RunState
from fmbs_skfem.dynamics.diagnoses import diagnosis
from fmbs_skfem.dynamics.observers import RunSetting
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlForce, ControlTorque
from fmbs_skfem.systems.measures import probes

from .. import models
from ..forms import forms

TIGHT = Newton(tolerance=1e-12)
SAMPLE, GOAL, J = 0.02, 0.8, 0.01
HINGE, SPIN = of_state("hinge.angle"), of_state("spin")
ERROR = of_state("goal - hinge.angle", "", {"goal": GOAL})
PID = Pid(
    name="servo",
    unit="N m",
    sample=SAMPLE,
    error=ERROR,
    kp=0.5,
    ki=2.0,
    kd=0.02,
    limits=(-0.45, 0.45),
)


def disc(controller: Controller, weight: float = 0.0, dim: int = 2) -> System:
    """A disc on a hinge, turned by a controller against a weight."""
    at, axis = At("disc", "frame"), {} if dim == 2 else {"axis": (0.0, 0.0, 1.0)}
    torque = of_state("servo - k*sin(angle)", "N m", {"k": weight})
    return eliminate(
        assemble(
            [rigid.rigid("disc", 1.0, J if dim == 2 else J * np.eye(3), (0.0,) * dim, dim=dim)],
            [joints.Revolute("pin", at, **axis)],
            [ControlTorque("m", at, torque=torque, axis=axis.get("axis"))],
            outputs={
                "hinge": probes.Angle(at, axis.get("axis")),
                "spin": probes.AngularVelocity(at, axis.get("axis")),
            },
            controllers=[controller],
        )
    )


def moved(rule: Callable[[float, float], float], count: int, weight: float = 0.0) -> np.ndarray:
    """Angles (s,) at the samples of a disc under a torque that is held between them."""
    angle, rate, found = 0.0, 0.0, [0.0]
    for _ in range(count):
        u = rule(angle, rate)
        if weight:
            path = solve_ivp(
                lambda t, y, u=u: [y[1], (u - weight * np.sin(y[0])) / J],
                (0, SAMPLE),
                [angle, rate],
                rtol=1e-11,
                atol=1e-12,
            )
            angle, rate = path.y[:, -1]
        else:
            angle, rate = angle + rate * SAMPLE + u / J * SAMPLE**2 / 2, rate + u / J * SAMPLE
        found.append(angle)
    return np.array(found)


def pid_rule() -> Callable[[float, float], float]:
    """The textbook's, written anew."""
    held = {"I": 0.0, "e": None}

    def rule(angle: float, rate: float) -> float:
        e = GOAL - angle
        u = (
            0.5 * e
            + (held["I"] + 2.0 * SAMPLE * e)
            + 0.02 * (0.0 if held["e"] is None else (e - held["e"]) / SAMPLE)
        )
        if abs(u) <= 0.45 or u * e < 0:
            held["I"] += 2.0 * SAMPLE * e
        held["e"] = e
        return float(np.clip(u, -0.45, 0.45))

    return rule


CASES = {
    "pid": (PID, pid_rule()),
    "feedback": (
        StateFeedback(name="servo", sample=SAMPLE, states=[ERROR, SPIN], gains=[-0.4, 0.06], offset=0.01),
        lambda angle, rate: 0.01 + 0.4 * (GOAL - angle) - 0.06 * rate,
    ),
    "table": (
        LookupTable(name="servo", sample=SAMPLE, of=of_state("hinge.angle + 0.2 * spin"), points=[(0.0, 0.3), (0.5, 0.0), (1.0, -0.9)]),
        lambda angle, rate: np.interp(angle + 0.2 * rate, [0.0, 0.5, 1.0], [0.3, 0.0, -0.9]),
    ),
    "program": (
        Program(name="servo", sample=SAMPLE, states=[HINGE, SPIN], function=lambda t, a, w: np.cos(3 * a) - 0.1 * w),
        lambda angle, rate: np.cos(3 * angle) - 0.1 * rate,
    ),
}  # fmt: skip


def ball(controller: Controller) -> System:
    """A mass of as many kilogram on a line; what it reads are x for the angle and x' for its rate."""
    at = At("ball", "center")
    return assemble(
        [point_mass("ball", J, np.zeros(2))],
        loads=[ControlForce("f", at, (1.0, 0.0), of_state("servo"))],
        outputs={"x": probes.Position(at)},
        controllers=[controller],
    )


@pytest.mark.parametrize("name", CASES)
def test_a_held_force_moves_a_mass_exactly(name: str) -> None:
    """Accelerations are constant from sample to sample: steps that begin with the jump make no
    error.
    """
    controller, rule = CASES[name]
    told = {
        part: on_a_line(getattr(controller, part))
        for part in ("error", "states", "of")
        if hasattr(controller, part)
    }
    motion = integrate(ball(replace(controller, **told)), GeneralizedAlpha(5e-3), 1.0, TIGHT)
    assert_allclose(outputs(motion)["x_x"][::4], moved(rule, 50), atol=1e-9)


def on_a_line(value: Any) -> Any:
    """Expressions of the disc as those of the mass."""
    if isinstance(value, list):
        return [on_a_line(one) for one in value]
    return of_state(
        value.text.replace("hinge.angle", "x.x").replace("spin", "x.vx"), "", {"goal": GOAL}
    )


def test_second_order_between_samples() -> None:
    """Against a weight; in space the same as in the plane."""
    exact = moved(pid_rule(), 50, 0.3)
    errors = []
    for h in (5e-3, 2.5e-3):
        found = outputs(integrate(disc(PID, 0.3), GeneralizedAlpha(h), 1.0, TIGHT))["hinge"][
            :: round(SAMPLE / h)
        ]
        errors.append(np.abs(found - exact).max())
    assert errors[1] < 3e-4
    assert 3.6 < errors[0] / errors[1] < 4.4
    space = outputs(integrate(disc(PID, 0.3, 3), GeneralizedAlpha(2.5e-3), 0.2, TIGHT))["hinge"]
    assert_allclose(space[::8], exact[:11], atol=3e-4)


def test_integrals_stand_still_at_limits() -> None:
    """A goal out of reach for a second winds nothing up: the disc leaves the limit as soon as the
    goal is back.
    """
    error = of_state("where(t < 1, 100, -1) - 0 * hinge")
    wound = Pid(name="servo", sample=SAMPLE, error=error, ki=5.0, limits=(-0.45, 0.45))
    run = start(disc(wound), GeneralizedAlpha(5e-3))
    while run.time < 1.0 - 1e-9:
        run.step()
    assert run.inputs["servo"] == 0.45
    for _ in range(round(0.1 / 5e-3) + 4):
        run.step()
    assert run.inputs["servo"] == pytest.approx(
        -0.45
    )  # one second of 500 N m/s would take minutes to unwind


def test_the_run_that_is_stepped_is_that_of_integrate() -> None:
    """Bit for bit, resumed and put back as well; recorded inputs are in the trajectory."""
    system, scheme = disc(PID, 0.3), GeneralizedAlpha(5e-3)
    found: list[tuple[Rows, Checkpoint]] = []

    def record(moment: RunState) -> None:
        found.append((moment.rows(0, moment.kept), moment.checkpoint()))

    motion = integrate(system, scheme, 0.5, record=record)
    rows, held = found[0]
    assert 0 < held.done < 100
    again = integrate(system, scheme, 0.5, resume=Resumed(held, rows))
    assert_array_equal(again.x, motion.x)
    run = start(system, scheme)
    for _ in range(60):
        run.step()
    state = run.state
    for _ in range(40):
        run.step()
    assert_array_equal(run.motion().x[0], motion.x[-1])
    run.state = state
    for _ in range(40):
        run.step()
    assert_array_equal(run.motion().x[0], motion.x[-1])
    served = motion.system.signals[0](motion.times)
    assert served[-1] == run.inputs["servo"]
    assert len(np.unique(served)) > 10


def arm() -> System:
    """A flexible arm whose hinge a PID brings to its goal."""
    beam = cable(
        "beam", models.segment(4), sections.Circular(0.02), sections.Material(1e9, 2300.0), dim=2
    )
    root, tip = At("beam", "left"), At("beam", "right")
    error = of_state("0.15 * (1 - cos(4 * min(t, pi / 4))) - hinge.angle")
    rate = of_state("-hinge.rate")
    servo = Pid(
        name="servo", unit="N m", sample=2e-3, error=error, rate=rate, kp=20.0, ki=40.0, kd=0.5
    )
    return assemble(
        [beam],
        [joints.Pin("hinge", root)],
        [ControlTorque("drive", root, torque=of_state("servo")), loads.Gravity((0.0, -1.0))],
        damping=Rayleigh(stiffness=5e-3),
        outputs={"hinge": probes.Angle(root), "tip": probes.Position(tip)},
        controllers=[servo],
    )


def test_an_unstable_loop_is_told_as_growth() -> None:
    """A rate that is fed back with the wrong sign: no word of the iteration, which fails at last;
    nor where the run ends before.
    """
    unstable = disc(
        StateFeedback(name="servo", sample=SAMPLE, states=[of_state("spin + 1e-3")], gains=[-0.4])
    )
    with pytest.raises(
        SolverError,
        match=r"the output of controller 'servo' rose from .* and the energy of the motion to",
    ) as caught:
        integrate(unstable, GeneralizedAlpha(2e-2), 3.0, Newton(iterations=5))
    assert caught.value.reason is Reason.GROWING
    assert "Newton" not in str(caught.value)
    with pytest.warns(Notice, match=r"the closed loop is unstable: .* up to t = 0.4 s"):
        integrate(unstable, GeneralizedAlpha(5e-3), 0.4)


def test_reduced_hyper_reduced_and_saved_models(tmp_path: Path) -> None:
    raw, scheme = arm(), GeneralizedAlpha(1e-3)
    full = integrate(eliminate(raw), scheme, 0.6, TIGHT)
    expected = outputs(full)
    for system in forms(raw, full, 1e-13, tmp_path / "model.h5"):
        found = outputs(integrate(system, scheme, 0.6, TIGHT))
        for name in expected:
            assert_allclose(found[name], expected[name], atol=1e-3)
    program = Program(name="servo", sample=4e-3, function=lambda t: 0.0)
    with pytest.raises(InputError, match="Python function"):
        files.save(disc(program), tmp_path / "other.h5")


SCENE = """
schema: 1
dimension: 2
parameters: {Kp: 50 N/m, Ki: 20 N/m/s, Kd: 9 N s/m, goal: 100 mm}
bodies: {ball: {type: point_mass, mass: 2 kg, position: [0, 0]}}
controllers:
  servo: {type: pid, unit: N, sample: 5 ms, error: "goal - tip.x", rate: -tip.vx, kp: Kp, ki: Ki, kd: Kd, limits: [-20 N, 20 N]}
  hold: {type: state_feedback, unit: N, sample: 10 ms, states: [tip.y - 1 m, tip.vy], gains: [50 N/m, 9 N s/m]}
  look: {type: table, unit: N, sample: 10 ms, of: tip.x, points: [[0 mm, 1 N], [10 mm, 2 N]]}
loads:
  f: {type: control_force, at: ball, direction: [1, 0], force: servo}
  g: {type: point_force, at: ball, force: [0, 1], history: "0 * t + thrust"}
  h: {type: control_force, at: ball, direction: [0, 1], force: hold}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {tip: {type: position, at: ball}}
""".replace('"0 * t + thrust"', '"0 * t"')


def test_scenes() -> None:
    """The linear sampled system by its matrix exponential."""
    motion = integrate(build.system(reading.loads(SCENE)), GeneralizedAlpha(1e-3), 1.0, TIGHT)
    found = outputs(motion)
    y = np.zeros(2)
    for k in range(100):
        assert found["tip_y"][10 * k] == pytest.approx(y[0], abs=1e-9)
        u = -50 * (y[0] - 1) - 9 * y[1]
        y = np.array([y[0] + 0.01 * y[1] + u / 2 * 0.01**2 / 2, y[1] + u / 2 * 0.01])


def test_state_feedback_stays_within_both_limits() -> None:
    """What starts at 50 N and brakes with - 9 N s/m, cut to 12 N and - 2 N: the linear sampled
    system in between.
    """
    limited = SCENE.replace(
        "gains: [50 N/m, 9 N s/m]}", "gains: [50 N/m, 9 N s/m], limits: [-2 N, 12 N]}"
    )
    found = outputs(
        integrate(build.system(reading.loads(limited)), GeneralizedAlpha(1e-3), 1.0, TIGHT)
    )
    y, met = np.zeros(2), set()
    for k in range(100):
        assert found["tip_y"][10 * k] == pytest.approx(y[0], abs=1e-9)
        wanted = -50 * (y[0] - 1) - 9 * y[1]
        u = min(max(wanted, -2.0), 12.0)
        met.add(float(np.sign(wanted - u)))
        y = np.array([y[0] + 0.01 * y[1] + u / 2 * 0.01**2 / 2, y[1] + u / 2 * 0.01])
    assert met == {-1.0, 0.0, 1.0}


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "kp: Kp",
            "kp: Kd",
            r"controllers.servo.kp: expected a force \[N\] .* got 'kp \* \(goal - tip.x\)'",
        ),
        ("ki: Ki", "ki: Kp", r"controllers.servo.ki: expected a force"),
        ("[50 N/m,", "[50 N,", r"controllers.hold.gains: expected a force"),
        (
            "gains: [50 N/m, 9 N s/m]",
            "gains: [50 N/m]",
            r"controllers.hold.gains: expected one for each of the 2 states, got 1",
        ),
        (
            "9 N s/m]}",
            "9 N s/m], offset: 1 m}",
            r"controllers.hold.offset: expected offset in N, got length",
        ),
        (
            "ki: Ki",
            "ki: Ki, start: 1 m",
            r"controllers.servo.start: expected start in N, got length",
        ),
        ("1 N], [10", "1 Pa], [10", r"controllers.look.points: expected points in N, got pressure"),
        (
            "[[0 mm",
            "[[-1 s",
            r"controllers.look.points: expected a number .* got '\(tip.x\) / point' \(velocity\)",
        ),
        ("20 N]", "20 m]", r"controllers.servo.limits: expected limits in N, got length"),
        ("[-20 N", "[30 N", r"controllers.servo.limits: expected the smaller limit first"),
        (
            "goal - tip.x",
            "goal - top.x",
            r"controllers.servo.error: expected one of .* got 'top.x'",
        ),
        ("servo: {", "tip: {", r"controllers.tip: expected another name"),
        ("sample: 5 ms", "sample: 0 s", r"controllers.servo.sample: expected a time \[s\] > 0"),
    ],
)
def test_what_does_not_fit_is_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading.loads(SCENE.replace(old, new))


def test_errors_of_runs() -> None:
    with pytest.raises(
        InputError,
        match=r"controller 'servo'.sample: expected a whole number of steps of 0.003 s, got 0.02 s",
    ):
        integrate(disc(PID), GeneralizedAlpha(3e-3), 0.3)
    broken = Program(
        name="servo",
        sample=SAMPLE,
        states=[of_state("1 / (0.1 - t)")],
        function=lambda t, x: 1e-3 * x,
    )
    with pytest.raises(SolverError, match=r"controller 'servo' gives inf at t = 0.1 s") as caught:
        integrate(disc(broken), GeneralizedAlpha(5e-3), 0.3)
    assert caught.value.partial is not None
    assert caught.value.partial.times[-1] == pytest.approx(0.1)
    with pytest.raises(InputError, match=r"got 'servo', which its controller sets"):
        start(disc(PID), GeneralizedAlpha(5e-3)).step({"servo": 1.0})
    states = [of_state(f"{k} * k", "", {"k": k}) for k in (1.0, 2.0)]
    with pytest.raises(InputError, match=r"one value of the parameter 'k'"):
        disc(StateFeedback(name="servo", sample=1.0, states=states, gains=[1, 1]))


def test_inputs_of_controllers_are_read_by_others() -> None:
    """A controller reads an input and what another one gives."""
    first = Program(name="a", sample=0.01, states=[of_state("u")], function=lambda t, u: 2 * u)
    second = Program(name="b", sample=0.01, states=[of_state("a + u")], function=lambda t, x: x)
    ball = At("ball", "center")
    system = assemble(
        [point_mass("ball", 1.0, np.zeros(2))],
        loads=[ControlForce("f", ball, (1.0, 0.0), of_state("b"))],
        inputs=[Input("u")],
        controllers=[first, second],
    )
    run = start(system, GeneralizedAlpha(0.01))
    seen = []
    for u in (1.0, 1.0, 1.0, 1.0):
        run.step({"u": u})
        seen.append((run.inputs["a"], run.inputs["b"]))
    assert seen == [(0.0, 0.0), (2.0, 1.0), (2.0, 3.0), (2.0, 3.0)]


def loop(kd: float, beam: bool, sample: float = SAMPLE) -> System:
    """A rod, or a beam, whose rate at a hinge is fed back at once."""
    part = cable(
        "rod",
        models.segment(8),
        sections.Rectangular(0.02, 0.008),
        sections.Material(2e9, 1500.0),
        dim=2,
    )
    places = {"root": (0.0, 0.0)}
    rod = part if beam else rigid.rigid("rod", 2.0, 0.1, (0.5, 0.0), dim=2, places=places)
    root = At("rod", "left" if beam else "root")
    goal = of_state("0.5 - a.angle")
    servo = Pid(
        name="servo", unit="N m", sample=sample, error=goal, rate=of_state("-a.rate"), kp=kd, kd=kd
    )
    return eliminate(
        assemble(
            [rod],
            [joints.Pin("hinge", root)],
            [ControlTorque("drive", root, torque=of_state("servo"))],
            damping=Rayleigh(stiffness=2e-4),
            outputs={"a": probes.Angle(root)},
            controllers=[servo],
        )
    )


@pytest.mark.parametrize("sample", [SAMPLE, 0.1 * SAMPLE])
def test_the_gain_of_a_sampled_loop_is_exact_for_a_rigid_body(sample: float) -> None:
    """-(kd + kp T) T / J with the moment of inertia about the hinge, as the angle changes by T
    times the rate.
    """
    system, scheme = loop(0.3, False, sample), GeneralizedAlpha(sample)
    run = integration.begun(RunSetting(system, scheme, Newton(), 10, system), np.array([0]))
    feed = run.find(Feed)
    found = sampled_loops.gain(run, feed.samplers[0].of, sample)
    assert found == pytest.approx(-0.3 * (1.0 + sample) * sample / (0.1 + 2.0 * 0.5**2), rel=1e-6)
    assert feed.diverging(run) == ""


@pytest.mark.parametrize("kd", [4.0, 40.0])
def test_a_loop_that_diverges_from_sample_to_sample_is_named(kd: float) -> None:
    """With gains that run, where the iteration fails in the first steps: the end of the beam is
    light.
    """
    with pytest.raises(
        SolverError,
        match=r"^the closed loop is unstable: a change in the output of controller 'servo' returns .* times",
    ) as caught:
        integrate(loop(kd, True, 2e-3), GeneralizedAlpha(1e-3), 1.0)
    assert caught.value.reason is Reason.GROWING
    assert [one.name for one in diagnosis.explain(caught.value).causes] == ["unstable loop"]
    share = float(str(caught.value).partition("its gains, to ")[2].partition(" ")[0])
    assert 0.0 < share < 0.1
    integrate(loop(share * kd, True, 2e-3), GeneralizedAlpha(1e-3), 1.0)


def test_what_fails_for_another_reason_is_not_called_an_unstable_loop() -> None:
    """A load beyond all bounds beside a loop that is stable: from 0.09 to 0.12 s on, as it rounds,
    it is no number.
    """
    system = loop(0.01, True, 2e-3)
    with pytest.raises(SolverError) as caught:
        integrate(
            replace(system, loads=replace(system.loads, constant=system.loads.constant + 1e12)),
            GeneralizedAlpha(1e-3),
            0.3,
        )
    assert caught.value.reason is not Reason.GROWING
