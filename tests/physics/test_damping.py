"""Rayleigh damping: decay of a mode with ratio (alpha/omega + beta omega)/2, rigid rotation,
balance of energy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import reduction
from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    complex_modes,
    energies,
    energy_drift,
    energy_errors,
    integrate,
    linearise,
    outputs,
    vibration_modes,
)
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, Motion, Rayleigh, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .. import models

TIGHT = Newton(tolerance=1e-11)
SECTION = sections.Given(EA=1e5, EI=1.0, rhoA=1.0)


def decay_rate(damping: Rayleigh, dim: int) -> tuple[float, float]:
    """Measured decay rate of the first mode of a cantilever over eight periods, and its angular
    frequency.
    """
    system = models.cantilever(8, section=SECTION, dim=dim, damping=damping)
    modes = vibration_modes(system, 1)
    omega = float(modes.angular_frequencies[0])
    scheme = GeneralizedAlpha(2 * np.pi / omega / 200, rho_inf=1.0)  # no damping of its own
    found = integrate(
        replace(system, v0=1e-3 * modes.shapes[:, 0]), scheme, 8 * 2 * np.pi / omega, TIGHT
    )
    tip = outputs(found)
    y = tip["tip_y"] if dim == 2 else np.hypot(tip["tip_y"], tip["tip_z"])
    peaks = np.flatnonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])) + 1
    left, middle, right = y[peaks - 1], y[peaks], y[peaks + 1]
    heights = middle + (left - right) ** 2 / (8 * (2 * middle - left - right))
    return -float(np.polyfit(found.times[peaks], np.log(heights), 1)[0]), omega


@pytest.mark.parametrize(
    "mass,stiffness,dim", [(0.3, 0.0, 2), (0.3, 0.0, 3), (0.0, 0.02, 2), (0.2, 0.01, 2)]
)
def test_decay_of_the_first_mode(mass: float, stiffness: float, dim: int) -> None:
    rate, omega = decay_rate(Rayleigh(mass, stiffness), dim)
    assert rate == pytest.approx(mass / 2 + stiffness * omega**2 / 2, rel=5e-3)


def test_no_decay_without_damping() -> None:
    assert abs(decay_rate(Rayleigh(), 2)[0]) < 1e-6


def spinning(damping: Rayleigh) -> np.ndarray:
    """Kinetic energy (s,) over 1 s of a beam with EI = 1 that turns about its pinned end at 1
    rad/s.
    """
    beam = body.cable("beam", models.segment(8), SECTION, dim=2)
    turn = {"beam": Motion(angular_velocity=1.0)}
    system = assemble(
        [beam], [joints.Pin("pin", At("beam", "left"))], damping=damping, initial=turn
    )
    return energies(integrate(eliminate(system), GeneralizedAlpha(1e-3), 1.0, TIGHT))[:, 0]


def test_stiffness_damping_leaves_rotation_alone() -> None:
    """1/6 J stays, but for the 1e-5 that the stretch by the centrifugal force takes; mass damping
    takes exp(-2 alpha t).
    """
    np.testing.assert_allclose(spinning(Rayleigh(stiffness=0.1)), 1 / 6, rtol=3e-5)
    assert spinning(Rayleigh(mass=1.0))[-1] == pytest.approx(np.exp(-2) / 6, rel=1e-4)


def test_energy_balance_with_damping() -> None:
    """Kinetic, strain and potential energy plus what damping took: the drift falls with h^2."""
    damping = Rayleigh(mass=0.2, stiffness=1e-3)
    runs = [
        integrate(models.double_pendulum(8, damping=damping), GeneralizedAlpha(h), 1.0, TIGHT)
        for h in (1e-3, 5e-4)
    ]
    coarse, fine = (energy_drift(run) for run in runs)
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.05)
    total = energies(runs[1])[:, :3].sum(axis=1)
    assert total[-1] < -0.05  # damping takes far more than the drift
    assert fine < 1e-4


def test_few_stored_states_feign_no_gain_of_energy() -> None:
    """A force of 20 rad/s: every step sums its work, so that the balance is that of all states
    where 100, 20 and 10 are stored.

    Of a motion whose steps did not, the balance of ten states is off by a tenth, and what every
    second one shows is no gain.
    """
    beam = body.cable("beam", models.segment(8), SECTION, dim=2)
    force = loads.PointForce("push", At("beam", "right"), (0.0, 1e-3), lambda t: np.sin(20 * t))
    system = eliminate(assemble([beam], [joints.Clamp("clamp", At("beam", "left"))], [force]))
    drifts = []
    for every in (1, 10, 50, 100):
        motion = integrate(system, GeneralizedAlpha(1e-3), 1.0, TIGHT, every)
        size = np.ptp(energies(motion)[:, :3], axis=0).max()
        assert energy_errors(motion).drift < 2e-5 * size
        drift, gain, _ = energy_errors(replace(motion, work=None))
        drifts.append(drift / size)
        assert gain < 1e-5
    assert drifts[1] < 0.02
    assert drifts[-1] > 0.1


@pytest.mark.parametrize("damping", [Rayleigh(mass=0.5), Rayleigh(stiffness=1e-3)])
def test_the_work_of_damping_is_that_of_all_steps(damping: Rayleigh) -> None:
    """A wave of many periods between two stored states: what it has lost is what damping took,
    whichever states are stored.
    """
    system = models.cantilever(8, section=SECTION, damping=damping)
    modes = vibration_modes(system, 3)
    omega = float(modes.angular_frequencies[2])
    start = replace(system, v0=1e-3 * modes.shapes[:, 2])
    runs = [
        integrate(
            start, GeneralizedAlpha(2 * np.pi / omega / 50, 1.0), 10 * 2 * np.pi / omega, TIGHT, k
        )
        for k in (1, 35)
    ]
    for motion in runs:
        found = energies(motion)
        assert found[-1, :3].sum() < 0.95 * found[0, :3].sum()
        assert np.ptp(found[:, 3]) < 5e-4 * found[0, 0]
    assert runs[1].work is not None
    assert runs[0].work is not None
    np.testing.assert_array_equal(runs[1].work[:-1], runs[0].work[::35][: len(runs[1].work) - 1])
    assert runs[1].work[-1] == runs[0].work[-1]


@pytest.mark.parametrize("hyper", [reduction.NONE, reduction.Points(1e-6)])
def test_reduced_models_know_what_damping_takes(hyper: reduction.HyperReduction) -> None:
    """Cells, modes and sampled points sum the same work of damping, and balance as the full model
    does.
    """
    raw, scheme = (
        models.double_pendulum(8, damping=Rayleigh(stiffness=1e-3), all_multipliers=True),
        GeneralizedAlpha(1e-3),
    )
    full = integrate(eliminate(raw), scheme, 0.5, TIGHT)
    plan = reduction.Plan(reduction.body_level(raw), 1e-12, hyper=hyper)
    task = reduction.task_of(reduction.Case(raw, scheme, 0.5), plan, 1e-3)
    reduced = integrate(reduction.train(task, motion=full).model.system, scheme, 0.5, TIGHT)
    assert full.work is not None
    assert reduced.work is not None
    np.testing.assert_allclose(reduced.work, full.work, atol=1e-3 * abs(full.work[-1]))
    assert energy_drift(reduced) == pytest.approx(energy_drift(full), rel=0.05)


@pytest.mark.parametrize("speed,gain", [(1e-12, 0.0), (1.0, 1.0)])
def test_round_off_at_rest_is_no_gain_of_energy(speed: float, gain: float) -> None:
    """A free body in whose stored velocities a speed grows from nothing: an error of the method, or
    round-off at 1e-12 m/s.
    """
    crank = rigid("crank", 1.0, 1e-3, (0.1, 0.0), dim=2)
    motion = integrate(assemble([crank]), GeneralizedAlpha(1e-3), 0.1)
    grown = np.outer(motion.times / motion.times[-1], [speed, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert energy_errors(replace(motion, v=grown)).rise == pytest.approx(gain)


@pytest.mark.parametrize("mass,stiffness", [(0.0, 2e-4), (3.0, 0.0)])
def test_modes_of_beams_with_torsion_decay(mass: float, stiffness: float) -> None:
    """(alpha / omega + beta omega) / 2 of bending, torsion and tension alike."""
    section = BeamSection(np.diag([1e4, 4e3, 4e3, 6.0, 9.0, 12.0]), np.diag([1.0, 1e-2, 1e-2]))
    curve = curves.Straight(np.zeros(3), np.array([1.0, 0.0, 0.0]), 1.0)
    part = beam(
        "beam",
        curves.Line(np.linspace(0.0, 1.0, 7), curve, {"left": 0.0, "right": 1.0}, None),
        section,
    )
    system = eliminate(
        assemble(
            [part], [joints.Clamp("root", At("beam", "left"))], damping=Rayleigh(mass, stiffness)
        )
    )
    found = complex_modes(linearise(system), 12)
    omega = np.abs(found.eigenvalues)
    assert_allclose(
        -found.eigenvalues.real / omega, 0.5 * (mass / omega + stiffness * omega), rtol=1e-6
    )
    torsion = 0.5 * np.pi * np.sqrt(6.0 / 2e-2)
    assert np.abs(omega / torsion - 1.0).min() < 1e-5
