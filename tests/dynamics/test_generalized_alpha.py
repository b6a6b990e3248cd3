"""Controls of the time integrator and what it stores; its accuracy is in `verification.integrator`
and `verification.rigid`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate

from .. import models


def test_stored_states_are_every_kth_step() -> None:
    scheme, duration = GeneralizedAlpha(1e-3), 0.1
    seen: list[float] = []
    every = integrate(models.mass_pendulum((-1, 0)), scheme, duration)
    tenth = integrate(
        models.mass_pendulum((-1, 0)), scheme, duration, every=10, progress=seen.append
    )
    np.testing.assert_array_equal(tenth.times, every.times[::10])
    np.testing.assert_array_equal(tenth.x, every.x[::10])
    np.testing.assert_array_equal(tenth.multipliers, every.multipliers[::10])
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert every.statistics.steps == tenth.statistics.steps == 100


@pytest.mark.parametrize(
    "step,rho_inf,place",
    [(0.0, 0.8, "step"), (np.nan, 0.8, "step"), (1e-3, 1.2, "rho_inf"), (1e-3, -0.1, "rho_inf")],
)
def test_bad_schemes_are_refused(step: float, rho_inf: float, place: str) -> None:
    with pytest.raises(InputError, match=place):
        GeneralizedAlpha(step, rho_inf)


def test_bad_controls_are_refused() -> None:
    with pytest.raises(InputError, match="tolerance"):
        Newton(tolerance=0.0)
    with pytest.raises(InputError, match="duration"):
        integrate(models.mass_pendulum((-1, 0)), GeneralizedAlpha(1e-3), 1e-4)
