"""Motions of `verification.dynamics` are no rigid ones: what they conserve is shared by strain and
motion.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.dynamics import energies
from verification.dynamics import FLYING, flown, hub_angle, momenta, spin_up


@pytest.mark.parametrize("name", FLYING)
def test_the_flying_rod_bends(name: str) -> None:
    """Strain energy takes and gives more than 1 % of the whole after the pulse, while the momentum
    stays.
    """
    stiffness, moment, _, energy = FLYING[name]
    found, rod = flown(stiffness, moment, 1e-3)
    after = found.times > 2.5 + 0.5e-3
    assert np.ptp(energies(found)[after, 1]) > 0.01 * energy
    np.testing.assert_allclose(
        momenta(found, rod)[0][after], np.broadcast_to([20.0, 0.0], (after.sum(), 2)), atol=1e-10
    )


def test_the_hub_turns_at_six_radians_a_second_in_the_end() -> None:
    """Angle and rate are continuous at 15 s, and the beam is at rest in the rotating frame before
    it starts.
    """
    t = np.array([15.0 - 1e-6, 15.0, 15.0 + 1e-6])
    np.testing.assert_allclose(np.diff(hub_angle(t)) / 1e-6, 6.0, rtol=1e-6)
    times, tip = spin_up(2.5e-3)
    assert times[-1] == pytest.approx(20.0)
    np.testing.assert_allclose(tip[0], 0.0, atol=1e-12)
