"""The start of a motion: velocities that joints permit, with compiled code and without."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.control import live
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial, integrate, outputs
from fmbs_skfem.dynamics.compiled_step.packing import PackedStep
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.systems import At, Rayleigh, System, assemble, eliminate
from fmbs_skfem.systems.compiled import compile_system, evaluate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models
from .test_state_space import MESHES


def packed_step(system: System, scheme: GeneralizedAlpha) -> PackedStep:
    """A step before its start."""
    model = compile_system(system)
    method = method_of(scheme, Newton(), scheme.step, model)
    step = initial.first_step(model, system.x0, system.v0, method)
    return PackedStep(model, step, initial.large_of(model))


def driven() -> System:
    """A beam at rest whose drive turns at 3 rad/s from the start."""
    system = models.spin_up(4, all_multipliers=True)
    return replace(
        system,
        signals=[lambda t: np.cos(3.0 * t), lambda t: np.sin(3.0 * t)][: len(system.signals)],
    )


def thrown() -> System:
    system = models.double_pendulum(4, all_multipliers=True)
    return replace(system, v0=np.random.default_rng(3).normal(size=system.size))


@pytest.mark.parametrize("make", [driven, thrown])
def test_velocities_without_compiled_code_are_those_of_a_run(make: Callable[[], System]) -> None:
    system, scheme = make(), GeneralizedAlpha(1e-3)
    assert not system.loads.forces  # then nothing of it is compiled
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        x, v = initial.admissible(system, scheme)
        packed = packed_step(system, scheme)
        exact = initial.start_step(packed, scheme, initial.start_of(packed.model))
    assert np.abs(v - system.v0).max() > 0.1
    np.testing.assert_array_equal(x[packed.model.order], packed.step.state.x)
    np.testing.assert_allclose(v, exact, rtol=0, atol=1e-11 * np.abs(exact).max())


SPRUNG = """
schema: 1
dimension: 2
bodies:
  arm:
    {type: cable, mesh: MESH, degree: 5, continuity: 3, section: {shape: rectangular, width: 20 mm, height: 6 mm},
     material: {young_modulus: 70 GPa, density: 2700}}
joints: {shoulder: {type: pin, at: arm.left}}
loads: {spring: {type: torsion_spring, at: arm.left, stiffness: 60, damping: 8, rest_angle: 1.0}}
analysis: {type: dynamic, duration: 20 ms, step: STEP}
outputs: {tip: {type: position, at: arm.right}}
"""


def test_a_damped_spring_far_off_its_rest() -> None:
    """M^-1 f turns the root, which weighs next to nothing, by a radian a step; no mesh matters once
    waves are left to the step.
    """

    def tip(mesh: str, step: str) -> float:
        scene = scenes.loads(SPRUNG.replace("MESH", mesh).replace("STEP", step), MESHES)
        found = studies.run(scene, plots=False)
        assert found.trajectory.statistics.halved == 0
        return float(found.outputs["tip_y"][-1])

    coarse, fine, finest = (tip("beam_50.msh", f"{h} ms") for h in (0.4, 0.2, 0.1))
    assert coarse - fine == pytest.approx(2.57 * (fine - finest), rel=0.1)
    for mesh in ("beam_20.msh", "beam_100.msh"):
        assert tip(mesh, "0.2 ms") == pytest.approx(fine, abs=1e-9)


def kicked(cells: int) -> System:
    """A damped strip of 1 m on a pin, turned by 20 mN m from t = 0 on."""
    strip, material = sections.Rectangular(20e-3, 3e-3), sections.Material(2e9, 1200.0)
    arm, root = body.cable("arm", models.segment(cells), strip, material, dim=2), At("arm", "left")
    outputs = {
        "a": probes.Angle(root),
        "pin": probes.Reaction("pin"),
        "rate": probes.AngularVelocity(root),
    }
    turn = loads.Moment("turn", root, 0.02)
    return eliminate(
        assemble([arm], [joints.Pin("pin", root)], [turn], Rayleigh(stiffness=3e-3), outputs)
    )


def test_a_torque_that_begins_at_once_turns_what_the_step_resolves() -> None:
    """By M^-1 f one end of 128 cells begins with -0.021 rad in 0.2 ms; 0.0002 rad are right, as
    smaller steps tell.
    """
    scheme = GeneralizedAlpha(2e-4)
    coarse, fine = (outputs(integrate(kicked(cells), scheme, 1e-2))["a"] for cells in (16, 128))
    exact = outputs(integrate(kicked(16), GeneralizedAlpha(2e-5), 1e-2))["a"][::10]
    np.testing.assert_allclose(coarse, fine, atol=2e-6)
    np.testing.assert_allclose(coarse, exact, atol=2e-4)


BRAKED = """
schema: 1
dimension: 2
bodies:
  arm:
    {type: cable, mesh: MESH, section: {shape: rectangular, width: 20 mm, height: 3 mm},
     material: {young_modulus: 2 GPa, density: 1200}}
joints: {pin: {type: pin, at: arm.left}, brake: {type: clamp, at: arm.left}}
loads: {turn: {type: torque, at: arm.left, torque: 20 mN m}}
damping: {stiffness: 3 ms}
events: {go: {when: t - 0.001 s, release: brake}}
analysis: {type: dynamic, duration: 3 ms, step: 0.2 ms}
outputs: {a: {type: angle, at: arm.left}}
"""


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_a_torque_that_an_event_lets_act_turns_what_the_step_resolves() -> None:
    """By M^-1 f one end of 100 cells turned back by 0.0043 rad in 0.4 ms; 0.0005 rad are right."""
    coarse, fine = (
        studies.run(
            scenes.loads(BRAKED.replace("MESH", f"beam_{cells}.msh"), MESHES), plots=False
        ).outputs["a"]
        for cells in (20, 100)
    )
    np.testing.assert_allclose(coarse, fine, atol=1e-6)
    assert fine[7] == pytest.approx(5e-4, rel=0.05)


def test_what_is_shown_of_a_start_balances_all_forces() -> None:
    """Stored, of a run that is taken step by step, and where forces are balanced; steps begin alike
    there and at an event.
    """
    system, scheme = kicked(16), GeneralizedAlpha(2e-4)
    model, motion = compile_system(system), integrate(system, scheme, 1e-2)
    gap = evaluate(model, motion.x[0], motion.v[0], 0.0, None, motion.multipliers[0], motion.a[0])[
        0
    ]
    assert np.abs(gap).max() < 1e-12
    begun, columns = live.start(system, scheme), outputs(motion)
    assert begun.outputs() == pytest.approx(
        {name: values[0] for name, values in columns.items()}, abs=1e-12
    )
    state, back = begun.run.step.state, np.argsort(model.order)
    steps_begin_with = state.history[0][back].copy()
    begun.step(count=50)
    assert begun.outputs() == pytest.approx(
        {name: values[-1] for name, values in columns.items()}, abs=1e-12
    )
    packed = packed_step(system, scheme)
    now = packed.step.state
    initial.start_step(packed, scheme, initial.start_of(model))
    np.testing.assert_array_equal(steps_begin_with, now.history[0][back])
    np.testing.assert_array_equal(motion.a[0], now.acceleration[back])
    assert np.abs(steps_begin_with).max() < 0.1 * np.abs(motion.a[0]).max()
    now.x[:], now.v[:] = system.x0[model.order], system.v0[model.order]
    initial.begin_anew(packed, scheme, 0.0, np.zeros(system.size))
    np.testing.assert_array_equal(steps_begin_with, now.history[0][back])


TURNED = """
schema: 1
dimension: 2
bodies:
  arm: {type: cable, mesh: MESH, section: {shape: circular, diameter: 40 mm}, material: {young_modulus: 70 GPa, density: 2700}}
joints: {pin: {type: pin, at: arm.left}, drive: {type: driven_angle, at: arm.left, angle: "0.02 * sin(0.05 * t)"}}
damping: {stiffness: 1 ms}
analysis: {type: dynamic, duration: 1 s, step: STEP}
outputs: {tip: {type: position, at: arm.right}, energy: {type: energy}}
"""


@pytest.mark.parametrize("step", ["50 ms", "5 ms", "0.5 ms"])
def test_a_drive_that_begins_with_a_rate_turns_what_the_step_resolves(step: str) -> None:
    """A beam of 1 m and 3.39 kg is turned at 1 mrad/s from t = 0 on: I w^2 / 2 = 0.57 uJ, up to
    four times that while it swings.

    By the mass alone the first node turns at once, at rates of strain that begin the run with 0.08,
    0.16 and 1e-4 J.
    """
    scene = scenes.loads(TURNED.replace("MESH", "beam_10.msh").replace("STEP", step), MESHES)
    with pytest.warns(Notice) as shown:
        out = studies.run(scene, plots=False).outputs
    rigid = 0.5 * (2700 * np.pi * 0.02**2 / 3) * 1e-6
    assert max(out["energy_kinetic"].max(), out["energy_strain"].max()) < 4.0 * rigid
    assert np.abs(out["energy_balance"] - out["energy_balance"][0]).max() < 0.05 * rigid
    assert out["tip_y"][-1] == pytest.approx(0.02 * np.sin(0.05), rel=2e-3)
    told = [str(one.message) for one in shown if one.category is Notice]
    assert "drives begin with rates that their bodies do not have" in told[0]
    assert all(
        "the energy balance falls" in one and "velocities jump at the start; give bodies" in one
        for one in told[1:]
    )


def test_small_steps_share_a_jump_by_the_mass() -> None:
    """Where a step resolves all waves, velocities change by the least kinetic energy, but for y^2,
    of fourth order undamped.
    """
    system = driven()
    J, gap = initial.velocity_gaps(system, GeneralizedAlpha(1e-6))
    exact = initial.change_of(
        initial.kkt_solver(system, system.mass, J), np.zeros(system.size), gap
    )
    with pytest.warns(Notice, match="drives begin"):
        off = [
            np.abs(initial.admissible(system, GeneralizedAlpha(h))[1] - exact).max()
            for h in (2e-6, 1e-6)
        ]
    assert off[1] < 1e-3 * np.abs(exact).max()
    assert off[0] / off[1] == pytest.approx(16.0, rel=0.1)


SWING = """
schema: 1
dimension: 3
bodies:
  arm: {type: TYPE, mesh: MESH, section: {shape: circular, diameter: 10 mm}, cells: 6,
        material: {young_modulus: 2 GPa, density: 1500 POISSON}}
  bob: {type: point_mass, mass: 50 g, position: [1, 0, 0]}
  far: {type: point_mass, mass: 10 g, position: [3, 0, 0]}
joints:
  root: {type: spherical, at: arm.left}
  end: {type: spherical, at: bob, to: arm.right}
  rest: {type: spherical, at: far}
loads: {weight: {type: gravity, acceleration: [0, 0, -9.81]}}
EVENTS
analysis: {type: dynamic, duration: 0.24 s, step: 1 ms}
outputs:
  a: {type: acceleration, at: bob}
  root: {type: reaction, joint: root}
"""


@pytest.mark.parametrize(("kind", "poisson"), [("cable", ""), ("beam", ", poisson_ratio: 0.3")])
def test_an_event_beside_a_motion_leaves_it_as_it_is(kind: str, poisson: str) -> None:
    """What is let go stands apart: filtered as a whole, accelerations of what swings changed by a
    fifth.
    """

    def found(events: str) -> Mapping[str, np.ndarray]:
        text = SWING.replace("TYPE", kind).replace(" POISSON", poisson).replace("EVENTS", events)
        return studies.run(
            scenes.loads(text.replace("MESH", "beam_20.msh"), MESHES), plots=False
        ).outputs

    alone = found("")
    other = found("events: {go: {when: t - 0.2003 s, release: rest}}")
    for column, values in alone.items():
        np.testing.assert_allclose(other[column], values, atol=5e-3 * np.ptp(values) + 1e-6)


HEAD = """
schema: 1
dimension: 3
bodies:
  arm: {type: beam, mesh: MESH, section: {shape: circular, diameter: 10 mm}, cells: 6,
        material: {young_modulus: 2 GPa, density: 1500, poisson_ratio: 0.3}}
  head: {type: rigid, mass: 0.2, inertia: [1e-4, 1e-4, 1e-4], center: [1, 0, 0]}
joints: {root: {type: clamp, at: arm.left}, end: {type: weld, at: head.frame, to: arm.right}}
loads: {push: {type: point_force, at: head.frame, force: [0, 0, -1 N]}}
analysis: {type: dynamic, duration: STEP, step: STEP}
outputs: {a: {type: acceleration, at: head.frame}, w: {type: reaction, joint: end}}
"""


def test_forces_of_the_start_balance_at_the_end_of_a_beam() -> None:
    """M a = F + w in the first row, whatever the step is: directors alone have no mass."""
    first = []
    for step in ("1 ms", "10 us"):
        text = HEAD.replace("MESH", "beam_20.msh").replace("STEP", step)
        out = studies.run(scenes.loads(text, MESHES), plots=False).outputs
        first.append((out["a_z"][0], out["w_z"][0]))
        assert abs(0.2 * out["a_z"][0]) == pytest.approx(1.0 - abs(out["w_z"][0]), abs=1e-6)
    assert first[0] == pytest.approx(first[1], abs=1e-5)


TOUCHING = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, -0.1 mm]}}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  floor: {type: contact_plane, at: ball, point: [0, 0], normal: [0, 1], stiffness: 1e6 N/m,
          damping: 20 N s/m}
initial: {bodies: {ball: {velocity: [0, -0.05]}}}
analysis: {type: dynamic, duration: 2 ms, step: 1 ms}
outputs: {a: {type: acceleration, at: ball}}
"""


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_what_touches_at_the_start_is_pushed_by_all_of_its_force() -> None:
    """m a = k d - c v - m g, of whatever the step makes."""
    out = studies.run(scenes.loads(TOUCHING), plots=False).outputs
    assert out["a_y"][0] == pytest.approx(1e6 * 1e-4 + 20.0 * 0.05 - 9.81, rel=1e-9)
