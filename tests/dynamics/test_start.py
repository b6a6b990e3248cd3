"""The start of a motion: velocities that joints permit, with compiled code and without."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, initial
from fmbs_skfem.systems import System
from fmbs_skfem.systems.compiled import compile_system

from .. import models
from .test_state_space import MESHES


def driven() -> System:
    """A beam at rest whose drive turns at 3 rad/s from the start."""
    system = models.spin_up(4, all_multipliers=True)
    return replace(system, signals=[lambda t: np.cos(3.0 * t), lambda t: np.sin(3.0 * t)][: len(system.signals)])


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
        start = initial.consistent_start(compile_system(system), scheme)
    assert np.abs(v - system.v0).max() > 0.1
    np.testing.assert_array_equal(x, start.x)
    np.testing.assert_allclose(v, start.v, rtol=0, atol=1e-11 * np.abs(start.v).max())


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
    """M^-1 f turns the root, which weighs next to nothing, by a radian a step; no mesh matters once waves are left to the step."""

    def tip(mesh: str, step: str) -> float:
        scene = scenes.loads(SPRUNG.replace("MESH", mesh).replace("STEP", step), MESHES)
        return float(studies.run(scene, plots=False).outputs["tip_y"][-1])

    coarse, fine, finest = (tip("beam_50.msh", f"{h} ms") for h in (0.4, 0.2, 0.1))
    assert coarse - fine == pytest.approx(3.4 * (fine - finest), rel=0.1)
    assert tip("beam_100.msh", "0.2 ms") == pytest.approx(fine, abs=1e-7)
    assert tip("beam_20.msh", "0.2 ms") == pytest.approx(fine, abs=1e-5)  # whose root is heavy enough for M^-1 f


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
    """A beam of 1 m and 3.39 kg is turned at 1 mrad/s from t = 0 on: I w^2 / 2 = 0.57 uJ, up to four times that while it swings.

    By the mass alone the first node turns at once, at rates of strain that begin the run with 0.08, 0.16 and 1e-4 J.
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
    assert all("the energy balance falls" in one and "velocities jump at the start; give bodies" in one for one in told[1:])


def test_small_steps_share_a_jump_by_the_mass() -> None:
    """Where a step resolves all waves, velocities change by the least kinetic energy, but for y^2, of fourth order undamped."""
    system = driven()
    J, gap = initial.velocity_gaps(system, GeneralizedAlpha(1e-6))
    exact = initial.change_of(initial.kkt_solver(system, system.mass, J), np.zeros(system.size), gap)
    with pytest.warns(Notice, match="drives begin"):
        off = [np.abs(initial.admissible(system, GeneralizedAlpha(h))[1] - exact).max() for h in (2e-6, 1e-6)]
    assert off[1] < 1e-3 * np.abs(exact).max()
    assert off[0] / off[1] == pytest.approx(16.0, rel=0.1)
