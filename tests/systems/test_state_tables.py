"""Tables of the state: a force by a table of a stretch, a torque by one of an angle or a rate;
exact motions, ends.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import cable, point_mass, rigid, sections
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.core.values.tables import Table
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    LiveRun,
    Newton,
    integrate,
    outputs,
    solve_statics,
    start,
)
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, Motion, System, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import Actuator, ControlTorque
from fmbs_skfem.systems.measures import probes

from ..forms import forms
from ..models import segment
from .parts import B1, BOB, beams

TIGHT = Newton(tolerance=1e-12)
KINKED = Table("pull", "N", (-0.5, 0.0, 0.5), (-1.0, 0.0, 4.0), of="m")  # 2 N/m and 8 N/m
CSV = "stretch [mm], force [N]\n-500, -1\n0, 0\n500, 4\n"

SCENE = """
schema: 1
dimension: 2
tables: {pull: {file: pull.csv, unit: N, of: m}}
bodies: {ball: {type: point_mass, mass: 2 kg, position: [1, 0]}}
loads: {spring: {type: actuator, at: ball, to: [0, 0], force: pull(stretch)}}
initial: {bodies: {ball: {velocity: [0.4, 0]}}}
events:
  far: {when: "pull(ball.x - 1 m) - 1.2 N", direction: rising, lock: latch}
  low: {when: "pull(ball.x - 1 m) + 0 * load.force", direction: falling, lock: latch}
joints: {latch: {type: latch, at: other}}
analysis: {type: dynamic, duration: 6 s, step: 5 ms}
outputs: {ball: {type: position, at: ball}, load: {type: load, load: spring}}
""".replace("bodies: {", "bodies: {other: {type: point_mass, mass: 1 kg, position: [3, 3]}, ", 1)


def scene(tmp_path: Path, text: str = SCENE) -> System:
    (tmp_path / "pull.csv").write_text(CSV, encoding="utf-8")
    return build.system(reading.loads(text, tmp_path))


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_derivatives(dim: int, smooth: bool) -> None:
    """Of lines and of a smooth curve, against differences, within the points and beyond them."""
    table = Table(
        "law",
        "N",
        (-2.0, -0.3, 0.1, 0.4, 3.0),
        (-2.0, -1.0, 0.5, 4.0, 4.5),
        smooth,
        of="m",
        hold=True,
    )
    force = of_state("k * law(stretch) + law(2 * rate * t) * law(9)", "", {"k": 3.0})
    check_system(assemble(beams(dim), loads=[Actuator("a", B1, BOB, force, 0.3)], inputs=[table]))


def test_a_spring_of_two_stiffnesses(tmp_path: Path) -> None:
    """Half a period pi sqrt(m / k) on either side; events read the table, also beside the force of
    the load.
    """
    motion = integrate(scene(tmp_path), GeneralizedAlpha(5e-3), 6.0, TIGHT)
    stiff, soft = np.pi * np.sqrt(2.0 / 8.0), np.pi * np.sqrt(2.0 / 2.0)
    assert [one.name for one in motion.events] == ["far", "low", "far"]
    far, low, again = (one.time for one in motion.events)
    assert low == pytest.approx(stiff, abs=5e-5)
    assert again - far == pytest.approx(stiff + soft, abs=2e-4)
    assert far == pytest.approx(
        0.5 * np.arcsin(1.2 / 8.0 / 0.2), abs=5e-5
    )  # x = v / w sin(w t), w = 2 rad/s
    assert outputs(motion)["ball_x"].max() - 1 == pytest.approx(0.2, abs=1e-5)
    assert 1 - outputs(motion)["ball_x"].min() == pytest.approx(0.4, abs=1e-4)


def step_on(run: LiveRun, count: int) -> None:
    for _ in range(count):
        run.step()


def test_what_is_beyond_a_table_is_told(tmp_path: Path) -> None:
    """Its ends hold, with a warning of how far, unless that is meant."""
    text = SCENE.replace("[0.4, 0]", "[1.2, 0]")
    with pytest.warns(
        Notice,
        match=r"table 'pull' was read up to 0\.\d+ \(SI units\) outside of its range, .*; extend it, or say 'hold: true'",
    ) as told:
        motion = integrate(scene(tmp_path, text), GeneralizedAlpha(5e-3), 2.0, TIGHT)
    stretch = outputs(motion)["ball_x"] - 1
    far = max(stretch.max() - 0.5, -0.5 - stretch.min())
    assert far > 0.05
    (table,) = [str(one.message) for one in told if "table 'pull'" in str(one.message)]
    assert f"{far:.3g}" in table
    run = start(scene(tmp_path, text), GeneralizedAlpha(5e-3), TIGHT)
    with pytest.warns(Notice, match="table 'pull' was read up to") as told:
        step_on(run, 400)
    assert sum("table 'pull'" in str(one.message) for one in told) == 1
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*table 'pull'")
        integrate(
            scene(tmp_path, text.replace("of: m", "of: m, hold: true")),
            GeneralizedAlpha(5e-3),
            2.0,
            TIGHT,
        )


def test_equilibria() -> None:
    """1 N a load step on 8 N/m up to 4 N, and on 360 N/m then."""
    load = Actuator("f", At("ball", "center"), (0.0, 0.0), of_state("law(stretch)"), 1.0)
    law = Table("law", "N", (-0.5, 0.0, 0.5, 0.6), (-1.0, 0.0, 4.0, 40.0), of="m")
    system = assemble(
        [point_mass("ball", 1.0, np.array([1.0, 0.0]))],
        [joints.Slider("rail", At("ball", "center"), direction=(1.0, 0.0))],
        [load, loads.PointForce("push", At("ball", "center"), (5.0, 0.0))],
        outputs={"ball": probes.Position(At("ball", "center"))},
        inputs=[law],
    )
    found = outputs(solve_statics(eliminate(system), 5))["ball_x"]
    assert_allclose(found, 1 + np.array([0.0, 0.125, 0.25, 0.375, 0.5, 0.5 + 1 / 360]), atol=1e-9)


def test_a_motor_by_its_curve() -> None:
    """w' = T(w) / J: a constant torque up to 4 rad/s, falling to zero at 8; over a table of the
    angle it is a spring.
    """
    at = At("disc", "frame")
    curve = Table("motor", "N m", (0.0, 4.0, 8.0), (0.1, 0.1, 0.0), of="rad/s")
    spring = Table("coil", "N m", (-40.0, 40.0), (40.0, -40.0), of="rad")

    def disc(text: str, speed: float) -> System:
        return eliminate(
            assemble(
                [rigid.rigid("disc", 1.0, 0.01, (0.0, 0.0), dim=2)],
                [joints.Revolute("pin", at)],
                [ControlTorque("m", at, torque=of_state(text, "N m"))],
                outputs={"spin": probes.AngularVelocity(at), "hinge": probes.Angle(at)},
                initial={"disc": Motion(angular_velocity=speed)},
                inputs=[curve, spring],
            )
        )

    motion = integrate(disc("motor(rate)", 0.0), GeneralizedAlpha(1e-3), 2.0, TIGHT)
    t = motion.times
    assert_allclose(
        outputs(motion)["spin"],
        np.where(t < 0.4, 10 * t, 8 - 4 * np.exp(-2.5 * (t - 0.4))),
        atol=1e-4,
    )
    motion = integrate(disc("0.01 * coil(hinge)", 10.0), GeneralizedAlpha(1e-3), 3.0, TIGHT)
    assert_allclose(outputs(motion)["hinge"], 10.0 * np.sin(motion.times), atol=5e-4)


def test_reduced_hyper_reduced_and_saved_models(tmp_path: Path) -> None:
    beam = cable("beam", segment(4), sections.Circular(0.02), sections.Material(1e9, 2300.0), dim=2)
    root, tip = At("beam", "left"), At("beam", "right")
    table = Table("hold", "N m", (-1.0, -0.1, 0.1, 1.0), (90.0, 40.0, -40.0, -90.0), True, of="rad")
    raw = assemble(
        [beam],
        [joints.Pin("hinge", root)],
        [
            ControlTorque("drive", root, torque=of_state("hold(hinge.angle) - 2 * hinge.rate")),
            loads.Gravity((0.0, -1.0)),
        ],
        outputs={"hinge": probes.Angle(root), "tip": probes.Position(tip)},
        inputs=[table],
    )
    full = integrate(eliminate(raw), GeneralizedAlpha(1e-3), 0.3, TIGHT)
    for system in forms(raw, full, 1e-13, tmp_path / "model.h5"):
        found = outputs(integrate(system, GeneralizedAlpha(1e-3), 0.3, TIGHT))
        for name, expected in outputs(full).items():
            assert_allclose(found[name], expected, atol=1e-3)


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "force: pull(stretch)",
            "force: pull(rate)",
            r"loads.spring.force: expected a length \[m\] in pull\(...\), got velocity",
        ),
        (
            "force: pull(stretch)",
            "force: pull(t)",
            r"loads.spring.force: expected one of .* got 'pull\(t\)'",
        ),
        (
            "force: pull(stretch)",
            "force: pul(stretch)",
            r"expected one of the functions and tables .*, got 'pul'; did you mean 'pull'",
        ),
        (
            "force: pull(stretch)",
            "force: 1 m * pull(stretch)",
            r"loads.spring.force: expected a force \[N\]",
        ),
        ("force: pull(stretch)", "force: pull(stretch, 2 m)", r"expected '\)'"),
        ("of: m}", "of: s}", r"tables.pull: .*expected a time \[s\], got '1 mm'"),
        ("- 1.2 N", "- 1.2 m", r"of one dimension, got force and length"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scene(tmp_path, SCENE.replace(old, new))


def test_functions_of_time_take_other_arguments() -> None:
    """A table of one period, again and again."""
    from fmbs_skfem.core.values.expressions import of_time

    wave = Table("wave", "", (0.0, 0.5, 1.0), (0.0, 1.0, 0.0))
    found = of_time("2 * wave(mod(t, 1)) + wave(t)", {}, {wave.name: wave})
    t = np.array([0.25, 0.75, 1.25, 3.5])
    assert_allclose(found(t), [1.5, 1.5, 1.0, 2.0], atol=1e-15)
    assert_allclose([found(one) for one in t.tolist()], found(t))


def test_points_far_apart() -> None:
    """A mass on a table of 1001 points of a hardening spring moves as on the spring itself."""
    x = np.linspace(-1.0, 1.0, 1001)
    table = Table("law", "N", tuple(x), tuple(4 * x + 30 * x**3), True, of="m")
    motions = []
    for text in ("law(stretch)", "4 * stretch + 30 * stretch**3"):
        load = Actuator("f", At("ball", "center"), (0.0, 0.0), of_state(text), 1.0)
        system = assemble(
            [point_mass("ball", 1.0, np.array([1.5, 0.0]))],
            loads=[load],
            outputs={"ball": probes.Position(At("ball", "center"))},
            inputs=[table],
        )
        motions.append(outputs(integrate(system, GeneralizedAlpha(2e-3), 2.0, TIGHT))["ball_x"])
    assert_allclose(motions[0], motions[1], atol=2e-5)
