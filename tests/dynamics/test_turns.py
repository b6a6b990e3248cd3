"""Torsion springs, angles and angular velocities over many turns: full, reduced, saved, large
models, batches, resumed runs.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.compiling.angles import continued
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    integrate,
    outputs,
    reactions,
    solve_statics,
    trajectory,
)
from fmbs_skfem.reduction import files
from fmbs_skfem.systems import At, Motion, System, assemble, compile_system, compiled, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import controls, loads
from fmbs_skfem.systems.measures import probes

from .. import models
from ..forms import forms
from .test_checkpoint import assert_same, stopped

Z = (0.0, 0.0, 1.0)
TIGHT = Newton(tolerance=1e-12)


def oscillator(
    rest: float = 0.0, speed: float = 10.0, dim: int = 2, moment: float = 0.0, damping: float = 0.0
) -> System:
    """A disc of inertia 0.01 on a spring of 0.01 N m/rad about z: theta'' = rest - theta."""
    inertia: Any = 0.01 if dim == 2 else (0.008, 0.009, 0.01)
    axis = {} if dim == 2 else {"axis": Z}
    at = At("disc", "frame")
    pushes = (
        [loads.Moment("push", at, moment if dim == 2 else (0.0, 0.0, moment))] if moment else []
    )
    return eliminate(
        assemble(
            [rigid("disc", 1.0, inertia, (0.0,) * dim, dim=dim)],
            [joints.Revolute("pin", at, **axis)],
            [loads.TorsionSpring("spring", at, None, 0.01, damping, rest, **axis), *pushes],
            outputs={"angle": probes.Angle(at, **axis), "rate": probes.AngularVelocity(at, **axis)},
            initial={"disc": Motion(angular_velocity=speed if dim == 2 else (0.0, 0.0, speed))},
        )
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_spring_counts_its_turns(dim: int) -> None:
    """10 sin t: more than a turn and a half to either side, with the energy k theta^2 / 2 of all of
    it.
    """
    motion = integrate(oscillator(dim=dim), GeneralizedAlpha(2e-3), 6.0, TIGHT)
    found, t = outputs(motion), motion.times
    assert_allclose(found["angle"], 10.0 * np.sin(t), atol=5e-3)
    assert_allclose(found["rate"], 10.0 * np.cos(t), atol=5e-3)
    assert_allclose(energies(motion)[:, 3], 0.5, atol=1e-4)


def test_a_rest_angle_of_more_than_half_a_turn() -> None:
    motion = integrate(oscillator(4.0, 0.0), GeneralizedAlpha(2e-3), 3.0, TIGHT)
    assert_allclose(outputs(motion)["angle"], 4.0 * (1.0 - np.cos(motion.times)), atol=1e-3)


def test_a_spring_between_two_bodies_counts_the_turns_between_them() -> None:
    """Equal discs, one of them at 20 rad/s: their mean turns at 10 rad/s, their difference is 10
    sqrt 2 sin(sqrt 2 t).
    """
    ends = [At(name, "frame") for name in ("a", "b")]
    discs = [rigid(end.body, 1.0, 0.01, (0.0, 0.0), dim=2) for end in ends]
    pins = [joints.Revolute(end.body.upper(), end) for end in ends]
    system = assemble(
        discs,
        pins,
        [loads.TorsionSpring("spring", *ends, 0.01)],
        outputs={end.body: probes.Angle(end) for end in ends},
        initial={"a": Motion(angular_velocity=20.0)},
    )
    motion = integrate(eliminate(system), GeneralizedAlpha(1e-3), 4.0, TIGHT)
    found, t = outputs(motion), motion.times
    assert_allclose(found["a"] + found["b"], 20.0 * t, atol=1e-2)
    assert_allclose(
        found["a"] - found["b"], 10.0 * np.sqrt(2.0) * np.sin(np.sqrt(2.0) * t), atol=2e-2
    )


def test_turns_of_nearly_half_a_turn_a_step() -> None:
    """The angle is followed from any step to the next by less than half a turn, to either side."""
    system = oscillator()
    model, (spring,) = compile_system(system), system.loads.forces
    memory, first = model.memory, int(spring.rows[0, 0])
    P = np.asarray(system.probes.matrix[[first, first + 1]].toarray())
    for step, theta in enumerate([3.1 * k for k in range(8)] + [3.1 * k for k in range(6, -8, -1)]):
        x = np.linalg.lstsq(
            P, np.array([np.cos(theta), np.sin(theta)]) - system.probes.offset[[first, first + 1]]
        )[0]
        memory = compiled.accepted(model, x, memory=memory)
        assert memory[0] == pytest.approx(theta, abs=1e-9), step
        torque = continued(np.arctan2(np.sin(theta), np.cos(theta)), theta - 3.0)
        assert torque == pytest.approx(theta, abs=1e-9)


def rotor(stiffness: float = 0.03, E: float = 1e9) -> System:
    """A beam that turns on a pin against a spring; about 0.06 kg m^2."""
    beam = body.cable(
        "beam", models.segment(4), sections.Circular(0.01), sections.Material(E, 2300.0), dim=2
    )
    root = At("beam", "left")
    return assemble(
        [beam],
        [joints.Pin("pin", root)],
        [loads.TorsionSpring("spring", root, stiffness=stiffness, rest_angle=0.5)],
        outputs={"angle": probes.Angle(root), "pin": probes.Reaction("pin"), "E": probes.Energy()},
        initial={"beam": Motion(angular_velocity=10.0)},
    )


def test_reduced_hyper_reduced_and_saved_models_count_turns(tmp_path: Path) -> None:
    scheme = GeneralizedAlpha(2e-3)
    raw = rotor()
    full = integrate(eliminate(raw), scheme, 2.0, TIGHT)
    every = forms(raw, full, 1e-14, tmp_path / "sampled.h5")
    files.save(every.reduced, tmp_path / "model.h5")
    expected = outputs(full)
    assert expected["angle"].max() > 4 * np.pi
    for system in (*every, files.load(tmp_path / "model.h5")):
        found = outputs(integrate(system, scheme, 2.0, TIGHT))
        assert_allclose(found["angle"], expected["angle"], atol=1e-3)
        assert_allclose(found["E_balance"], expected["E_balance"], atol=1e-3)
    assert_allclose(
        expected["E_balance"], expected["E_balance"][0], atol=1e-3 * expected["E_kinetic"].max()
    )


def test_large_models_count_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    system, scheme = rotor(), GeneralizedAlpha(2e-3)
    band = integrate(system, scheme, 1.0, TIGHT)
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 1)
    monkeypatch.setattr("fmbs_skfem.systems.layouts.DENSE", 1)
    large = integrate(system, scheme, 1.0, TIGHT)
    assert large.statistics.solver.startswith("sparse")
    found, expected = outputs(large), outputs(band)
    assert expected["angle"].max() > 2 * np.pi
    assert_allclose(found["angle"], expected["angle"], atol=1e-6)


@pytest.mark.parametrize("after", [16, 700])
def test_a_split_run_keeps_the_turns(after: int) -> None:
    """Stopped early and in the second turn, and taken up with the same bits."""
    system, scheme, steps = oscillator(damping=1e-3), GeneralizedAlpha(1e-3), 2000
    whole = integrate(system, scheme, steps * scheme.step, every=7)
    assert outputs(whole)["angle"].max() > 2.5 * np.pi
    part = stopped(system, after, scheme, steps, every=7)
    assert_same(integrate(system, scheme, steps * scheme.step, every=7, resume=part), whole)


def test_equilibria_count_turns() -> None:
    """theta = M / k: a turn and more by a moment that grows over the load factor."""
    path = solve_statics(oscillator(moment=0.09, speed=0.0), 10, TIGHT)
    assert_allclose(outputs(path)["angle"], 9.0 * path.times, atol=1e-8)
    assert_allclose(reactions(path)[("pin", "x")], 0.0, atol=1e-9)


@pytest.mark.parametrize("steps", [1, 3, 30])
def test_turns_of_a_drive_between_equilibria(steps: int) -> None:
    """A disc that is driven by 40 rad over the load factor: turns are counted on the way, not
    between equilibria that are kept.
    """
    at, angle = At("disc", "frame"), {"angle": probes.Angle(At("disc", "frame"))}
    held = [joints.Revolute("pin", at), joints.DrivenAngle("drive", at, lambda t: 40.0 * t)]
    system = eliminate(assemble([rigid("disc", 1.0, 0.01, (0.0, 0.0), dim=2)], held, outputs=angle))
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        path = solve_statics(system, steps, TIGHT)
        assert outputs(path)["angle"][-1] == pytest.approx(40.0)
    assert outputs(path.part(slice(-1, None)))["angle"] == pytest.approx([40.0])


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_a_beam_is_rolled_up_twice(steps: int) -> None:
    """M l / EI = 4 pi: the angle of the end, by which a spring there would be turned, has both of
    its turns.
    """
    beam = body.cable("beam", models.segment(20), sections.Given(1e5, 1.0, 1.0), dim=2, degree=5)
    end = At("beam", "right")
    push, angle = loads.Moment("M", end, 4.0 * np.pi), {"angle": probes.Angle(end)}
    system = eliminate(
        assemble([beam], [joints.Clamp("clamp", At("beam", "left"))], [push], outputs=angle)
    )
    assert outputs(solve_statics(system, steps))["angle"][-1] == pytest.approx(
        4.0 * np.pi, rel=5e-3
    )


def test_few_stored_states_still_tell_the_turns() -> None:
    """0.9 s at up to 10 rad/s between two states: the angle, and the energy of the spring at the
    end, are known all the same.
    """
    motion = integrate(oscillator(), GeneralizedAlpha(2e-3), 2.7, TIGHT, every=450)
    assert len(motion.times) == 4
    assert_allclose(outputs(motion)["angle"], 10.0 * np.sin(motion.times), atol=5e-3)


@pytest.mark.parametrize("every", [2, 5, 10, 20])
def test_waves_of_a_load_that_begins_are_no_turns(every: int) -> None:
    """The slope of a hinged beam under a moment from the start on, where it is held: it gained turns
    between the first two states, however small the motion was.
    """
    beam = body.cable("beam", models.segment(10), sections.Given(EA=1e7, EI=1e3, rhoA=1.0), dim=2)
    at = At("beam", "left")
    system = eliminate(
        assemble(
            [beam],
            [joints.Revolute("pin", at)],
            [loads.Moment("push", at, 10.0)],
            outputs={"angle": probes.Angle(at)},
        )
    )
    motions = [integrate(system, GeneralizedAlpha(1e-3), 0.4, every=one) for one in (1, every)]
    each, few = (outputs(motion)["angle"] for motion in motions)
    assert_allclose(few, each[::every], rtol=0.0, atol=1e-9)


def test_a_part_of_a_motion_knows_the_turns() -> None:
    """The energy of the spring, turned by 10 sin(2) = 9.1 rad, in the last state alone."""
    motion = integrate(oscillator(), GeneralizedAlpha(2e-3), 2.0, TIGHT)
    last = motion.part(slice(-1, None))
    assert (
        energies(last)[0, 1]
        == energies(motion)[-1, 1]
        == pytest.approx(0.005 * (10.0 * np.sin(2.0)) ** 2, rel=1e-3)
    )
    assert_same(trajectory.joined(motion.part(slice(-1)), last), motion)


def test_too_few_stored_states_are_told() -> None:
    motion = integrate(oscillator(), GeneralizedAlpha(2e-3), 8.0, TIGHT, every=2000)
    with pytest.warns(
        Notice, match="output 'angle': stored states are too far apart to count the turns"
    ):
        outputs(motion)


def test_angular_velocity_about_a_fixed_axis_of_a_body_that_tumbles() -> None:
    """A free body of equal moments of inertia keeps its angular velocity vector, whose components
    are its outputs.
    """
    omega, at = np.array([3.0, -2.0, 5.0]), At("ball", "frame")
    axes = {"x": (1.0, 0.0, 0.0), "y": (0.0, 2.0, 0.0), "skew": (1.0, 1.0, 1.0)}
    system = assemble(
        [rigid("ball", 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))],
        outputs={name: probes.AngularVelocity(at, axis) for name, axis in axes.items()},
        initial={"ball": Motion(angular_velocity=tuple(omega))},
    )
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(1e-3), 3.0, TIGHT))
    for name, axis in axes.items():
        assert_allclose(found[name], omega @ axis / np.linalg.norm(axis), atol=1e-3)


@pytest.mark.parametrize(("spin", "jumps"), [((0.3, -10.0, 0.0), True), ((0.0, -6.0, 8.0), False)])
def test_an_angle_that_jumps_is_told(spin: tuple[float, float, float], jumps: bool) -> None:
    """A rod that is swung through the axis of its spring turns by half a turn about it at once."""
    rod = body.cable("rod", models.segment(4), models.SECTION, models.MATERIAL)
    spring = loads.TorsionSpring("spring", At("rod", "left"), None, 1e-4, 0.0, 0.0, axis=Z)
    start = {"rod": Motion(angular_velocity=spin)}
    system = eliminate(
        assemble([rod], [joints.Pin("A", At("rod", "left"))], [spring], initial=start)
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        integrate(system, GeneralizedAlpha(2e-3), 0.2)
    assert [
        "a load on rod jumps by 1" in str(one.message)
        for one in told
        if "jumps" in str(one.message)
    ] == [True] * jumps


@pytest.mark.parametrize(("spin", "tilts"), [((0.9, 1.2, 0.0), True), ((0.0, 0.0, 2.0), False)])
def test_a_torque_about_an_axis_that_its_place_leaves_is_told(
    spin: tuple[float, float, float], tilts: bool
) -> None:
    """A free body of equal moments J under a torque about z: dL/dt has a part tan(phi) across z
    where e2 is phi above the plane.
    """
    top = rigid("top", 1.0, (2.0, 2.0, 2.0), (0.0, 0.0, 0.0), places={"e2": (0.0, 1.0, 0.0)})
    torque = controls.ControlTorque("torque", At("top", "frame"), axis=Z, torque=of_state(3.0))
    rates = {
        axis: probes.AngularVelocity(At("top", "frame"), unit)
        for axis, unit in zip("xyz", np.eye(3).tolist(), strict=True)
    }
    outs = rates | {"e2": probes.Position(At("top", "e2"))}
    start = {"top": Motion(angular_velocity=spin)}
    system = eliminate(assemble([top], [], [torque], outputs=outs, initial=start))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = outputs(integrate(system, GeneralizedAlpha(1e-3), 0.25))
    e2, w = (
        np.stack([found[name.format(axis)] for axis in "xyz"], axis=1) for name in ("e2_{}", "{}")
    )
    torques = 2.0 * np.gradient(w, 1e-3, axis=0)[1:-1]
    assert_allclose(torques[:, 2], 3.0, rtol=1e-4)
    across = 3.0 * np.abs(e2[1:-1, 2]) / np.linalg.norm(e2[1:-1, :2], axis=1)
    assert_allclose(np.linalg.norm(torques[:, :2], axis=1), across, atol=3e-3)
    part = f"up to {across[-1] / 3.0:.0%} of itself across its axis"
    assert [part in str(one.message) for one in told if one.category is Notice] == [True] * tilts
