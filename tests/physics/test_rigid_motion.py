"""Rigid motions cost no energy, and stiff chains of beams move like rigid bodies."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.bodies import body, sections
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, energies, integrate, outputs
from fmbs_skfem.systems import At, assemble, compile_system, eliminate, joints, loads, probes
from fmbs_skfem.systems.compiled import forces

from .. import models


@pytest.mark.parametrize("ancf", [False, True])
def test_no_force_in_a_rotated_and_shifted_beam(ancf: bool) -> None:
    beam = body.cable("beam", models.straight(8), models.SECTION, models.MATERIAL, ancf=ancf)
    system = assemble([beam])
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    q = beam.reference @ turn.T + np.outer(beam.constant, [3.0, -2.0, 1.0])
    model = compile_system(system)
    largest = np.abs(forces(model, 1.001 * system.x0, np.zeros(system.size))).max()  # of a stretch by 0.1 %
    assert np.abs(forces(model, q.ravel(), np.zeros(system.size))).max() < 1e-9 * largest


def test_stiff_rod_is_a_compound_pendulum() -> None:
    """A stiff pinned rod released from the horizontal passes the vertical at a quarter of T = 4 sqrt(2 L/(3 g)) K(sin 45 deg)."""
    quarter = np.sqrt(2 / (3 * 9.81)) * 1.8540746773013719
    rod = body.cable("rod", models.straight(4), sections.Given(1e6, 1e4, 1.0), dim=2)
    tip = {"tip": probes.Position(At("rod", "right"))}
    system = eliminate(assemble([rod], [joints.Pin("pin", At("rod", "left"))], [loads.Gravity((0.0, -9.81))], outputs=tip))
    found = integrate(system, GeneralizedAlpha(5e-4), 0.6)
    x = outputs(found)["tip_x"]
    first = int(np.argmax(x < 0))
    crossing = found.times[first - 1] + 5e-4 * x[first - 1] / (x[first - 1] - x[first])
    assert crossing == pytest.approx(quarter, rel=2e-5)
    kinetic = energies(found)[first, 0]
    assert kinetic == pytest.approx(9.81 / 2, rel=1e-3)  # the drop of the centre of mass


def test_stiff_double_pendulum_of_rods() -> None:
    """Two stiff rods, m = L = 1, released from the horizontal, against the rigid double pendulum (exact equations, recomputed)."""
    exact = {
        0.25: (0.930452473866, -0.366412600597, 1.92682057643, -0.281262120918),
        0.5: (0.433292317695, -0.901253442394, 1.29668853623, -1.40577992319),
        0.75: (-0.0958536899307, -0.99539543405, -0.742604235944, -1.75809703444),
        1.0: (-0.934807350144, -0.355155202857, -1.66211513582, -1.04146663719),
    }
    section = sections.Given(1e6, 1e5, 1.0)
    first = body.cable("I", models.straight(3), section, dim=2)
    second = body.cable("II", models.straight(3, (1, 0, 0), (2, 0, 0)), section, dim=2)
    system = assemble(
        [first, second],
        [joints.Pin("A", At("I", "left")), joints.Pin("B", At("I", "right"), At("II", "left"))],
        [loads.Gravity((0.0, -9.81))],
        outputs={"B": probes.Position(At("I", "right")), "C": probes.Position(At("II", "right"))},
    )
    h = 2.5e-4
    found = outputs(integrate(eliminate(system), GeneralizedAlpha(h), 1.0, Newton(tolerance=1e-10)))
    for time, values in exact.items():
        got = [found[name][round(time / h)] for name in ("B_x", "B_y", "C_x", "C_y")]
        np.testing.assert_allclose(got, values, atol=2e-4)
