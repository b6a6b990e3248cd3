"""Events and controllers that read reactions, energies and forces of loads; events whose value is
beyond zero within one step.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad
from scipy.optimize import brentq

from fmbs_skfem.control import controllers
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, start
from fmbs_skfem.dynamics.checkpoint import Checkpoint, Resumed, Rows
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.forces.controls import ControlForce
from fmbs_skfem.systems.measures import probes

from ..forms import forms
from ..models import segment

TIGHT = Newton(tolerance=1e-12)
J, G, BREAKS = 1.01, 9.81, 20.0

SCENE = """
schema: 1
dimension: 2
parameters: {strength: 20 N}
bodies: {ball: {type: rigid, mass: 1 kg, inertia: 0.01 kg m^2, center: [1, 0], points: {O: [0, 0]}}}
joints: {pin: {type: pin, at: ball.O}}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  lift: {type: control_force, at: ball, direction: [0, 1], force: 0 * pull}
controllers: {pull: {type: measurement, unit: N, sample: 5 ms, of: "sqrt(pin.x**2 + pin.y**2)"}}
events: {snap: {when: "sqrt(pin.x**2 + pin.y**2) - strength", direction: rising, release: pin}}
analysis: {type: dynamic, duration: 600 ms, step: 5 ms}
outputs: {tip: {type: position, at: ball}, pin: {type: reaction, joint: pin}, E: {type: energy}, lift: {type: load, load: lift}}
"""


def reaction(phi: float) -> float:
    """Of a pendulum that fell by phi from the horizontal: m (w^2 r + g sin phi) along, m (g cos phi
    - w' r) across.
    """
    return float(np.hypot((2.0 / J + 1.0) * G * np.sin(phi), G * np.cos(phi) * (1.0 - 1.0 / J)))


def exact() -> float:
    """When the pin breaks: t = int dphi / w, w^2 = 2 g sin(phi) / J, with phi = u^2."""
    phi = brentq(lambda angle: reaction(angle) - BREAKS, 0.1, 1.5)
    return float(
        quad(lambda u: 2.0 * u / np.sqrt(2.0 * G * np.sin(u * u) / J), 0.0, np.sqrt(phi))[0]
    )


def scene(text: str = SCENE, step: float = 5e-3) -> tuple[System, GeneralizedAlpha]:
    return build.system(reading.loads(text)), GeneralizedAlpha(step)


def test_a_joint_breaks_where_its_reaction_says_so() -> None:
    """At the exact instant, of second order in the step; what the controller gives is the reaction
    at its samples.
    """
    errors = []
    for h in (5e-3, 2.5e-3):
        for form in (eliminate, lambda system: system):
            system, scheme = scene(step=h)
            motion = integrate(form(system), scheme, 0.6, TIGHT)
            errors.append(abs(motion.events[0].time - exact()))
            found = outputs(motion)
            held = (motion.times > 6e-3) & (motion.times < motion.events[0].time - h)
            signal = next(
                one
                for one in motion.system.signals
                if getattr(one, "name", "") == "pull" or hasattr(one, "values")
            )
            k = np.flatnonzero(held)[:-1]
            pull = np.hypot(found["pin_x"], found["pin_y"])
            every = round(5e-3 / h)
            assert_allclose(signal(motion.times[k + 1]), pull[k // every * every], atol=1e-9)
    assert max(errors[2:]) < 1.5e-5
    assert_allclose(np.log2(errors[0] / errors[2]), 2.0, atol=0.2)


def test_resumed_and_saved_runs(tmp_path: Path) -> None:
    """They have the same bits, and files have what is read."""
    system, scheme = scene()
    found: list[tuple[Rows, Checkpoint]] = []
    motion = integrate(
        system,
        scheme,
        0.6,
        record=lambda moment: found.append((moment.rows(0, moment.kept), moment.checkpoint())),
    )
    for rows, held in found:
        assert_array_equal(integrate(system, scheme, 0.6, resume=Resumed(held, rows)).x, motion.x)
    again = integrate(files.load(files.save(system, tmp_path / "model.h5")), scheme, 0.6)
    assert_array_equal(again.x, motion.x)


def test_energies_and_forces_of_loads() -> None:
    """A ball rises until its kinetic energy is 1 J; a potential counts from the start, a spring's
    force is that of its stretch.
    """
    text = SCENE.replace(
        "pin: {type: pin, at: ball.O}", "rail: {type: slider, at: ball, direction: [0, 1]}"
    )
    text = text.replace(
        ", pin: {type: reaction, joint: pin}", ", spring: {type: load, load: spring}"
    )
    text = text.replace(
        "  lift:",
        "  spring: {type: spring_damper, at: ball, to: [1, 5], stiffness: 4 N/m}\n  lift:",
    )
    text = text.replace(
        "controllers:", "initial: {bodies: {ball: {velocity: [0, 2]}}}\ncontrollers:"
    )
    told = {"of": '"E.potential + 0 * E.strain"', "unit": "J"}
    text = (
        text.replace('"sqrt(pin.x**2 + pin.y**2)"', told["of"], 1)
        .replace("unit: N,", "unit: J,")
        .replace("0 * pull", "0 N/J * pull")
    )
    events = "{slow: {when: E.kinetic - 1 J, release: rail}, pulled: {when: spring.force + 0.4 N, direction: falling, stop: true}}"
    text = text.replace(
        '{snap: {when: "sqrt(pin.x**2 + pin.y**2) - strength", direction: rising, release: pin}}',
        events,
    )
    system, scheme = scene(text.replace("strength: 20 N", "strength: 20 N, unused: 1"), 1e-3)
    run = start(system, scheme, TIGHT)
    while not run.ended:
        run.step()
    slow, pulled = run.events
    w, a = 2.0, -G / 4.0  # y = a (1 - cos w t) + sin(w t)
    y = lambda t: a * (1 - np.cos(w * t)) + np.sin(w * t)  # noqa: E731
    rate = lambda t: w * (a * np.sin(w * t) + np.cos(w * t))  # noqa: E731
    assert slow.time == pytest.approx(brentq(lambda t: rate(t) ** 2 / 2 - 1, 0, 0.15), abs=2e-6)
    assert pulled.time == pytest.approx(brentq(lambda t: -4 * y(t) + 0.4, 0, 0.15), abs=2e-6)
    assert run.inputs["pull"] == pytest.approx(G * y(round(pulled.time // 5e-3) * 5e-3), abs=1e-5)


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "force: 0 * pull",
            "force: 0 * pin.x",
            r"loads.lift.force: expected outputs that are functions of positions .*'pin.x'.*measurement",
        ),
        (
            "force: 0 * pull",
            "force: 0 * E.strain",
            r"loads.lift.force: expected .*'E.strain'.*type: measurement, of: E.strain",
        ),
        ("- strength", "- pin.z", r"event 'snap': expected one of .*pin.x.* got 'pin.z'"),
        (
            "- strength",
            "- 2 J",
            r"event 'snap': expected all parts of '-' of one dimension, got force and moment",
        ),
        ("- strength", "- E.balance", r"event 'snap': expected one of .* got 'E.balance'"),
        (
            'of: "sqrt(pin.x**2 + pin.y**2)"',
            'of: "pin.x * 1 m"',
            r"controller 'pull'.of: expected a force \[N\] .* got 'pin.x \* 1 m'",
        ),
    ],
)
def test_what_cannot_be_read_is_told(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build.system(reading.loads(SCENE.replace(old, new)))


def test_reduced_models(tmp_path: Path) -> None:
    """They read reactions between bodies; of a joint that they have dropped they say so."""
    from fmbs_skfem.bodies import Circular, Material, cable, point_mass

    def arm(joint: str) -> System:
        beam = cable("beam", segment(4), Circular(0.02), Material(1e9, 2300.0), dim=2)
        tip = At("beam", "right")
        told = controllers.Measurement(
            name="pull", unit="N", sample=2e-3, of=of_state(f"{joint}.y")
        )
        return assemble(
            [beam, point_mass("bob", 0.2, np.array([1.0, 0.0]))],
            [joints.Pin("root", At("beam", "left")), joints.Pin("grip", tip, At("bob", "center"))],
            [
                loads.Gravity((0.0, -G)),
                ControlForce("f", At("bob", "center"), (0.0, 1.0), of_state("-0.1 * pull", "", {})),
            ],
            outputs={
                "tip": probes.Position(tip),
                "grip": probes.Reaction("grip"),
                "root": probes.Reaction("root"),
            },
            controllers=[told],
        )

    full = integrate(eliminate(arm("grip")), GeneralizedAlpha(1e-3), 0.1, TIGHT)
    expected = outputs(full)
    for system in forms(arm("grip"), full, 1e-14, tmp_path / "model.h5"):
        assert_allclose(
            outputs(integrate(system, GeneralizedAlpha(1e-3), 0.1, TIGHT))["tip_y"],
            expected["tip_y"],
            atol=1e-4,
        )
    for system in forms(
        arm("root"),
        integrate(eliminate(arm("root")), GeneralizedAlpha(1e-3), 0.1),
        1e-14,
        tmp_path / "model.h5",
    ):
        with pytest.raises(
            InputError,
            match=r"controller 'pull': expected outputs that the reduced model has, got 'root.y'",
        ):
            integrate(system, GeneralizedAlpha(1e-3), 0.1)
        break


THROWN = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, 0]}, o: {type: point_mass, mass: 1 kg, position: [1, 0]}}
joints: {hold: {type: pin, at: o}, other: {type: latch, at: o}}
loads: {weight: {type: gravity, acceleration: [0, -10]}}
initial: {bodies: {ball: {velocity: [1, 5]}}}
events: {top: {when: ball.y - HEIGHT, direction: DIRECTION, lock: other}}
analysis: {type: dynamic, duration: 1.2 s, step: 30 ms}
outputs: {ball: {type: position, at: ball}}
"""


@pytest.mark.parametrize("height", [1.25 - 1e-5, 1.2499, 1.24, 1.2501])
@pytest.mark.parametrize("direction", ["rising", "falling", "both"])
def test_a_value_beyond_zero_within_one_step(height: float, direction: str) -> None:
    """A ball on a parabola is above a height for 3 ms, 9 ms and more, or never, in steps of 30 ms."""
    text = THROWN.replace("HEIGHT", repr(height)).replace("DIRECTION", direction)
    motion = integrate(build.system(reading.loads(text)), GeneralizedAlpha(0.03), 1.2, TIGHT)
    half = np.sqrt(max(0.0, 2 * (1.25 - height) / 10))
    expected = (
        {"rising": [0.5 - half], "falling": [0.5 + half], "both": [0.5 - half, 0.5 + half]}[
            direction
        ]
        if half
        else []
    )
    assert_allclose([one.time for one in motion.events], expected, atol=1e-9)


def test_forces_of_controllers_are_read_between_distant_samples() -> None:
    """A force that its controller changes in every step, measured in every tenth one, by a
    controller of a number as well.
    """
    text = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, 0]}}
controllers:
  ramp: {type: table, unit: N, sample: 1 ms, of: t, points: [[0 s, 0 N], [1 s, 1 N]]}
  seen: {type: measurement, unit: N, sample: 10 ms, of: push.force}
  share: {type: measurement, sample: 10 ms, of: push.force / 1 N}
loads:
  push: {type: control_force, at: ball, direction: [1, 0], force: ramp}
  echo: {type: control_force, at: ball, direction: [0, 1], force: seen - 1 N * share}
analysis: {type: dynamic, duration: 1 s, step: 1 ms}
outputs: {push: {type: load, load: push}}
"""
    run = start(*scene(text, 1e-3))
    for _ in range(95):
        run.step()
    assert run.inputs["seen"] == pytest.approx(
        0.089, abs=1e-12
    )  # that of the step before the sample at 90 ms
    assert run.inputs["share"] == run.inputs["seen"]
