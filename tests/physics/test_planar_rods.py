"""Planar motions of slender rods against an independent solver, and what a free rod conserves.

The reference is a single global Legendre-spectral rod without shear and rotary inertia, integrated by Gauss's method of order 6 and
converged to the digits given. Its strain is |r'| - 1; the cable here has (r'.r' - 1)/2, which differs by eps^2/2.

Spin-up: Simo and Vu-Quoc, J. Appl. Mech. 53 (1986) 855-863, doi 10.1115/1.3171871.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.cable_law import Curvature
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, energies, energy_drift, integrate, outputs
from fmbs_skfem.systems import At, Motion, assemble, eliminate, joints, loads, probes

from .. import models

TIGHT = Newton(tolerance=1e-11)

SPIN_UP = {  # t: tip displacement relative to the rotating undeformed beam, along and across it
    2.0: (-0.0006058201, -0.10237244),
    5.0: (-0.012653128, -0.46844198),
    7.0: (-0.018615576, -0.57126171),
    10.0: (-0.0070706628, -0.36276537),
    13.0: (0.00023348777, -0.069196943),
    15.0: (0.00051399181, 0.0012902676),
    18.0: (0.00051387204, -0.0020769846),
    20.0: (0.00051453029, 0.00074332282),
}


def hub_angle(time: np.ndarray) -> np.ndarray:
    rising = 6 / 15 * (time**2 / 2 + (15 / (2 * np.pi)) ** 2 * (np.cos(2 * np.pi * time / 15) - 1))
    return np.where(time < 15, rising, 6 * time - 45)


@functools.cache
def spin_up(h: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (s,) and tip displacement in the rotating frame (s, 2): L = 10, EA = 2.8e7, EI = 1.4e4, rhoA = 1.2."""
    section = sections.Given(2.8e7, 1.4e4, 1.2)
    rod = body.cable("rod", models.straight(16, end=(10, 0, 0)), section, dim=2, curvature=Curvature.MATERIAL)
    root = At("rod", "left")
    driven: list[joints.Joint] = [joints.Pin("hub", root), joints.DrivenAngle("motor", root, hub_angle)]
    system = eliminate(assemble([rod], driven, outputs={"tip": probes.Position(At("rod", "right"))}))
    found = integrate(system, GeneralizedAlpha(h), 20.0, TIGHT)
    columns, c, s = outputs(found), np.cos(hub_angle(found.times)), np.sin(hub_angle(found.times))
    x, y = columns["tip_x"], columns["tip_y"]
    return found.times, np.stack([c * x + s * y - 10, c * y - s * x], axis=1)


def spin_up_error(h: float) -> float:
    return max(float(np.abs(spin_up(h)[1][round(t / h)] - values).max()) for t, values in SPIN_UP.items())


def test_spin_up_of_simo_and_vu_quoc() -> None:
    assert spin_up_error(1.25e-3) < 2e-5
    assert np.log2(spin_up_error(2.5e-3) / spin_up_error(1.25e-3)) == pytest.approx(2.0, abs=0.1)


def test_spin_up_extremes() -> None:
    """Largest lag 0.5737868; steady extension tan(kL)/(kL) - 1 = 5.143175e-4 with k^2 = rhoA w^2/EA, times L."""
    times, tip = spin_up(1.25e-3)
    assert tip[:, 1].min() == pytest.approx(-0.5737868, abs=1e-5)
    assert times[tip[:, 1].argmin()] == pytest.approx(6.761849, abs=1.3e-3)
    k = 6.0 * np.sqrt(1.2 / 2.8e7) * 10
    late = tip[times > 16, 0].mean()
    assert late == pytest.approx(10 * (np.tan(k) / k - 1), rel=1e-3)
    assert late == pytest.approx(0.00051395446, rel=5e-4)


PENDULUM = {  # t: tip, middle, energies (kinetic, strain, potential)
    0.3: ((0.79648727, -0.60606829), (0.39579868, -0.30649088), (2.986872, 0.0079792796, -2.9948513)),
    0.6: ((-0.58428658, -0.81153564), (-0.27452156, -0.41859674), (4.0379857, 0.022424234, -4.06041)),
    1.0: ((-0.98763551, 0.051959316), (-0.4968163, -0.04010132), (0.044490407, 0.1125422, -0.15703261)),
    1.5: ((0.27824094, -0.95948662), (0.10971517, -0.48843154), (4.7249607, 0.03507268, -4.7600334)),
    2.0: ((0.99894057, -0.011816383), (0.49917082, -0.026752179), (0.17630737, 0.011771113, -0.18807848)),
}


@pytest.mark.parametrize("ancf", [False, True])
def test_medium_pendulum(ancf: bool) -> None:
    """Flexible pendulum L = rhoA = EI = 1, EA = 1e4, released from the horizontal."""
    section = sections.Given(1e4, 1.0, 1.0)
    rod = body.cable("rod", models.straight(20), section, dim=2, curvature=Curvature.MATERIAL, ancf=ancf)
    system = assemble(
        [rod],
        [joints.Pin("hinge", At("rod", "left"))],
        [loads.Gravity((0.0, -9.81))],
        outputs={"tip": probes.Position(At("rod", "right")), "middle": probes.Position(At("rod", 0.5)), "E": probes.Energy()},
    )
    h = 2.5e-4
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(h), 2.0, TIGHT))
    for t, (tip, middle, energy) in PENDULUM.items():
        k = round(t / h)
        np.testing.assert_allclose([found["tip_x"][k], found["tip_y"][k]], tip, atol=4e-5)
        np.testing.assert_allclose([found["middle_x"][k], found["middle_y"][k]], middle, atol=4e-5)
        np.testing.assert_allclose([found[f"E_{part}"][k] for part in ("kinetic", "strain", "potential")], energy, atol=3e-4)


def momenta(found: Trajectory, rod: Body) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum (s, c) and angular momentum about the origin (s, 1 or 3) of a system of one body."""
    shape = (len(found.times), -1, rod.dim)
    x, p = found.x.reshape(shape), np.einsum("bd,sdc->sbc", rod.mass.toarray(), found.v.reshape(shape))
    if rod.dim == 2:
        spin = (x[:, :, 0] * p[:, :, 1] - x[:, :, 1] * p[:, :, 0]).sum(axis=1)[:, None]
    else:
        spin = np.cross(x, p).sum(axis=1)
    return np.einsum("b,sbc->sc", rod.constant, p), spin


FLYING = {  # EI, M0: end points at t = 2.5 and 5, angular momentum and energy after the pulse
    (500.0, 80.0): (
        (1.9659226, 7.5656396, 8.88621, 0.28939675),
        (9.5255607, 8.8972606, 12.186863, -0.69896401),
        114.20885,
        252.4104,
    ),
    (100.0, 30.0): ((9.5086032, 6.3190078, 2.6544354, 0.066119597), None, 1.2999822, 108.2132),
}


@functools.cache
def flown(stiffness: float, moment: float, h: float) -> tuple[Trajectory, Body]:
    """Free rod L = 10, EA = 1e4, rhoA = 1 from (6, 0) to (0, 8): force 8 and a moment at its first end, a smooth pulse of 2.5 s."""

    def pulse(time: np.ndarray) -> np.ndarray:
        return np.where(time < 2.5, 2 * np.sin(np.pi * time / 2.5) ** 2, 0.0)

    section = sections.Given(1e4, stiffness, 1.0)
    rod = body.cable("rod", models.straight(20, (6, 0, 0), (0, 8, 0)), section, dim=2, curvature=Curvature.MATERIAL)
    end = At("rod", "left")
    pushes: list[loads.Load] = [loads.PointForce("F", end, (8.0, 0.0), pulse), loads.Moment("M", end, moment, pulse)]
    system = assemble([rod], [], pushes, outputs={"a": probes.Position(end), "b": probes.Position(At("rod", "right"))})
    return integrate(system, GeneralizedAlpha(h), 5.0, TIGHT), rod


@pytest.mark.parametrize("case", FLYING)
def test_flying_rod(case: tuple[float, float]) -> None:
    """Momentum 20 along x after the pulse, centre of mass at 3 + 2 (t - 1.25), 4; strains of 1 % limit the match of positions."""
    h = 1e-3
    found, rod = flown(*case, h)
    after = found.times > 2.5 + 0.5 * h
    linear, spin = momenta(found, rod)
    np.testing.assert_allclose(linear[after], np.broadcast_to([20.0, 0.0], linear[after].shape), atol=1e-10)
    centre = np.einsum("b,sbc->sc", rod.constant @ rod.mass.toarray(), found.x.reshape(len(found.times), -1, 2)) / 10
    np.testing.assert_allclose(centre[after, 0], 3 + 2 * (found.times[after] - 1.25), atol=2e-6)
    np.testing.assert_allclose(centre[after, 1], 4.0, atol=1e-10)
    early, late, momentum, energy = FLYING[case]
    columns = outputs(found)
    ends = np.stack([columns[name] for name in ("a_x", "a_y", "b_x", "b_y")], axis=1)
    np.testing.assert_allclose(ends[2500], early, atol=2e-3)
    if late is not None:
        np.testing.assert_allclose(ends[5000], late, atol=5e-3)
    np.testing.assert_allclose(spin[after], momentum, atol=1e-3)
    total = energies(found)[:, :2].sum(axis=1)
    np.testing.assert_allclose(total[after], energy, rtol=1e-3)


def test_angular_momentum_and_energy_of_the_flying_rod() -> None:
    """Constant after the pulse up to an error of second order in the step."""

    def drift(h: float) -> np.ndarray:
        found, rod = flown(500.0, 80.0, h)
        after = found.times > 2.5 + 0.5 * h
        total = energies(found)[:, :2].sum(axis=1)
        return np.array([np.ptp(momenta(found, rod)[1][after]), np.ptp(total[after])])

    coarse, fine = drift(2e-3), drift(1e-3)
    np.testing.assert_allclose(np.log2(coarse / fine), 2.0, atol=0.1)
    assert fine[0] < 1e-4


def test_free_flight_in_space() -> None:
    """A bent rod thrown with spin: linear momentum to round-off, angular momentum with order 2, energy as resolved."""
    arc = np.linspace(0.0, np.pi / 2, 7)
    mesh = models.polyline(np.stack([np.sin(arc), 1 - np.cos(arc), 0.2 * arc], axis=1))
    rod = body.cable("rod", mesh, sections.Given(1e3, 1.0, 1.0))
    system = assemble([rod], initial={"rod": Motion(velocity=(1.0, -2.0, 0.5), angular_velocity=(0.5, 1.0, 3.0))})

    def drift(h: float) -> np.ndarray:
        found = integrate(system, GeneralizedAlpha(h), 1.0, TIGHT)
        linear, spin = momenta(found, rod)
        np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-11)
        assert energies(found)[:, 1].max() > 1e-3  # it bends
        return np.array([np.abs(spin - spin[0]).max(), energy_drift(found)])

    coarse, fine = drift(1e-3), drift(5e-4)
    assert np.log2(coarse[0] / fine[0]) == pytest.approx(2.0, abs=0.1)
    assert fine[0] < 2e-6
    assert coarse[1] > 2.5 * fine[1]
    assert fine[1] < 5e-4
