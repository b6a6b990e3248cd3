"""The energy balance is judged against the energies of the motion, and the work of drives is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    energies,
    energy_errors,
    integrate,
    outputs,
    solve_statics,
)
from fmbs_skfem.dynamics.outputs import survey_of
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .. import models


def test_a_steady_motion_is_judged_by_its_kinetic_energy() -> None:
    """A free top keeps its energy of 2.01 J to 1e-8 J: nothing is exchanged, and the drift is none."""
    top = rigid("top", 1.0, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    system = assemble([top], initial={"top": Motion(angular_velocity=(1.0, 0.1, 1.0))})
    motion = integrate(
        system, GeneralizedAlpha(1e-3, 0.9), 20.0, Newton(tolerance=1e-13), every=500
    )
    drift, gain, _ = energy_errors(motion)
    assert energies(motion)[0, 0] == pytest.approx(2.01, abs=1e-12)
    assert 0.0 < drift < 1e-7
    assert gain < 1e-6


def driven(angle: object) -> System:
    """A rod of 1 kg under gravity that a motor turns about its end."""
    rod = rigid("rod", 1.0, 0.1, (0.5, 0.0), dim=2, places={"end": (0.0, 0.0)})
    held = [
        joints.Revolute("pin", At("rod", "end")),
        joints.DrivenAngle("motor", At("rod", "frame"), angle),
    ]  # type: ignore[arg-type]
    sensed = {"centre": probes.Position(At("rod", "center")), "E": probes.Energy()}
    return eliminate(assemble([rod], held, [loads.Gravity((0.0, -9.81))], outputs=sensed))


@pytest.mark.parametrize("every", [1, 10])
def test_a_drive_without_damping_has_no_noise_in_its_multipliers(every: int) -> None:
    """A drive at rho_inf = 1 from rest: at most 5.255 N m are needed, at the start, and the balance
    closes.
    """
    motion = integrate(driven(lambda t: 0.5 * t**2), GeneralizedAlpha(1e-3, 1.0), 3.0, every=every)
    found, angle = outputs(motion), 0.5 * motion.times**2
    assert_allclose(found["centre_y"], 0.5 * np.sin(angle), atol=1e-6)
    drift, gain, _ = energy_errors(motion)
    motor = motion.system.constraints.names.index(("motor", "angle"))
    needed = (0.1 + 0.25) * 1.0 + 9.81 * 0.5 * np.cos(angle)
    assert_allclose(np.abs(motion.multipliers[:, motor]), np.abs(needed), atol=1e-4)
    assert drift < 1e-3
    assert gain < 1e-3
    kinetic = 0.5 * (0.1 + 0.25) * motion.times**2
    assert_allclose(found["E_kinetic"], kinetic, atol=1e-4)
    assert_allclose(found["E_balance"], 0.0, atol=1e-3)


def test_a_gain_beside_a_drive_is_still_seen() -> None:
    """A beam that goes 20 % faster from half time on has gained 0.44 of its energy: the drive of a
    rod explains none of it.
    """
    beam = body.cable("beam", models.segment(10), sections.Given(1e4, 1.0, 1.0), dim=2)
    rod = rigid("rod", 1.0, 0.1, (0.5, 0.0), dim=2, places={"end": (0.0, 0.0)})
    motor = joints.DrivenAngle("motor", At("rod", "frame"), lambda t: 1e-3 * t**2)
    held = [joints.Pin("hub", At("beam", "left")), joints.Revolute("pin", At("rod", "end")), motor]
    system = eliminate(assemble([beam, rod], held, initial={"beam": Motion(angular_velocity=1.0)}))
    motion = integrate(system, GeneralizedAlpha(1e-3, 1.0), 0.1)
    assert energy_errors(motion).rise < 1e-4
    gained = replace(motion, v=motion.v * np.where(motion.times > 0.05, 1.2, 1.0)[:, None])
    assert energy_errors(gained).rise == pytest.approx(0.44 / 1.44, rel=1e-3)


def test_energies_are_the_same_with_and_without_the_power() -> None:
    """To the bit; the power is that of a motion whose work its steps have not summed."""
    motion = integrate(driven(lambda t: 0.5 * t**2), GeneralizedAlpha(1e-3), 0.5)
    stored, power = survey_of(motion)
    alike, other = survey_of(replace(motion, work=None))
    np.testing.assert_array_equal(stored, alike)
    assert np.isnan(power).all()
    angle = 0.5 * motion.times**2
    torque = 0.35 + 9.81 * 0.5 * np.cos(angle)
    assert_allclose(other[1:], (torque * motion.times)[1:], rtol=2e-3)


def test_equilibria_have_energies_and_no_balance() -> None:
    """A rod driven up in five equilibria: its weight is lifted, and no balance is claimed of a way
    that nothing went.
    """
    path = solve_statics(driven(lambda t: 0.5 * np.pi * t), 5)
    found = outputs(path)
    assert_allclose(found["E_potential"], 9.81 * 0.5 * np.sin(0.5 * np.pi * path.times), atol=1e-9)
    assert not found["E_kinetic"].any()
    assert np.isnan(found["E_balance"]).all()
