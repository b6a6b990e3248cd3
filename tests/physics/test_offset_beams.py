"""Beams whose line is not where forces and masses act: shear centres, offset masses, slices without
inertia.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from scipy.optimize import brentq

from fmbs_skfem.bodies import CSection, Material, Matrices
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics, vibration_modes
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

ROOT, TIP = At("beam", "left"), At("beam", "right")
CHANNEL, STEEL = CSection(0.04, 0.1, 0.003, 0.005), Material(210e9, 7850.0, 0.3)


def straight(section: BeamSection, length: float = 1.0, cells: int = 8) -> Body:
    """A beam along x with the y axis of its section along y."""
    curve = curves.Straight(np.zeros(3), np.array([length, 0.0, 0.0]), length)
    line = curves.Line(
        np.linspace(0.0, length, cells + 1), curve, {"left": 0.0, "right": length}, None
    )
    return beam("beam", line, section, direction=np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("offset", ["shear_centre", "centroid"])
def test_a_force_beside_the_shear_centre_twists(offset: str) -> None:
    """A web-parallel tip force through the line: no twist at the shear centre, P e L / GJ at the
    centroid; small.
    """
    section, P = (
        CHANNEL.of_beam(STEEL, "shear_centre" if offset == "shear_centre" else "centroid"),
        1.0,
    )
    sensed = {"turn": probes.Angle(TIP, (1.0, 0.0, 0.0)), "at": probes.Position(TIP)}
    system = assemble(
        [straight(section)],
        [joints.Clamp("root", ROOT)],
        [loads.PointForce("F", TIP, (0.0, 0.0, P))],
        outputs=sensed,
    )
    found = outputs(solve_statics(eliminate(system), 1))
    flexible = np.linalg.inv(CHANNEL.of_beam(STEEL, "shear_centre").stiffness)
    e = (
        -CHANNEL.of_beam(STEEL, "centroid").stiffness[2, 3]
        / CHANNEL.of_beam(STEEL, "centroid").stiffness[2, 2]
    )
    assert e > 0.02  # m: the shear centre is that far behind the centroid
    twist = 0.0 if offset == "shear_centre" else P * e * flexible[3, 3]
    assert_allclose(found["turn"][-1], twist, atol=2e-4 * P * e * flexible[3, 3])
    rise = P * (flexible[4, 4] / 3.0 + flexible[2, 2]) + e * twist
    assert_allclose(found["at_z"][-1], rise, rtol=2e-4)


def exact_frequencies(section: BeamSection, length: float, count: int) -> np.ndarray:
    """Angular frequencies of a cantilever that bends in z and twists, a mass m at y = e: zeros of
    what its ends leave.

    w' = b + V/GA,  b' = M/EI,  M' = -V,  V' = -omega^2 m (w + e phi),  phi' = T/GJ,  T' = -omega^2
    (m e w + J phi)
    """
    (m, me, _), (_, J, _), _ = section.mass
    _, _, GA, GJ, EI, _ = section.stiffness.diagonal()

    def left(omega: float) -> float:
        A = np.zeros((6, 6))
        A[0, 1], A[0, 3], A[1, 4], A[4, 3], A[2, 5] = 1.0, 1.0 / GA, 1.0 / EI, -1.0, 1.0 / GJ
        A[3, [0, 2]], A[5, [0, 2]] = (
            -(omega**2) * np.array([m, me]),
            -(omega**2) * np.array([me, J]),
        )
        return float(np.linalg.det(expm(A * length)[3:, 3:]))

    grid = np.linspace(1.0, 1500.0, 3000)
    values = np.array([left(x) for x in grid])
    changes = np.flatnonzero(values[1:] * values[:-1] < 0.0)[:count]
    return np.array([brentq(left, grid[k], grid[k + 1]) for k in changes])


OFFSET_MASS = BeamSection(
    np.diag([1e7, 4e6, 1e5, 50.0, 80.0, 1e5]),
    np.array([[1.0, 0.05, 0.0], [0.05, 0.004, 0.0], [0.0, 0.0, 0.0]]),
)


def test_an_offset_mass_couples_bending_and_torsion() -> None:
    """Five modes of a cantilever whose mass is 50 mm beside its line, without inertia about y."""
    exact = exact_frequencies(OFFSET_MASS, 1.0, 5)
    found = vibration_modes(
        eliminate(assemble([straight(OFFSET_MASS, cells=32)], [joints.Clamp("root", ROOT)])), 5
    ).angular_frequencies
    assert_allclose(found, exact, rtol=1e-5)


SLICES = {
    "none": (0.0, 0.0, 0.0),
    "about x and z": (0.1, 0.0, 0.1),
    "along the line": (0.1, 0.1, 0.1),
}


@pytest.mark.parametrize("inertia", SLICES.values(), ids=SLICES)
def test_slices_without_inertia_move(inertia: tuple[float, ...]) -> None:
    """A cantilever that a step load bends in space keeps its energy; without inertia of slices it
    swings at Euler's frequency.
    """
    section = Matrices((1e6, 1e6, 1e6, 60.0, 80.0, 80.0), (1.0, 1.0, 1.0, *inertia)).of_beam(None)
    force = loads.PointForce("F", TIP, (0.0, 20.0, 40.0))
    system = eliminate(
        assemble(
            [straight(section)],
            [joints.Clamp("root", ROOT)],
            [force],
            outputs={"E": probes.Energy()},
        )
    )
    first = vibration_modes(system, 2).angular_frequencies
    if not any(inertia):
        assert_allclose(first, 3.51601527 * np.sqrt(80.0), rtol=5e-4)
    found = outputs(integrate(system, GeneralizedAlpha(1e-3, 0.9), 0.2))
    assert np.ptp(found["E_balance"]) < 1e-3 * found["E_strain"].max()
