"""Observed order of the flexible systems in all unknowns, velocities and multipliers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.systems import Rayleigh, System

from .. import models


def example_1() -> System:
    return models.spin_up(5, all_multipliers=True)


def example_2() -> System:
    """Damped a little: the axial waves of the sudden start die out, so that steps of this size resolve what is left."""
    return models.double_pendulum(5, damping=Rayleigh(stiffness=1e-4), all_multipliers=True)


def states(make: Callable[[], System], h: float, coarsest: float, duration: float) -> list[np.ndarray]:
    """x, v and multipliers after 0.2 s at the times of the coarsest run."""
    found = integrate(make(), GeneralizedAlpha(h), duration, Newton(tolerance=1e-12))
    every = round(coarsest / h)
    late = found.times[::every] >= 0.2
    return [part[::every][late] for part in (found.x, found.v, found.multipliers)]


@pytest.mark.parametrize("make,h,duration", [(example_1, 2e-3, 1.0), (example_2, 5e-4, 0.5)])
def test_second_order_in_position_velocity_and_multipliers(make: Callable[[], System], h: float, duration: float) -> None:
    coarse, fine, reference = (states(make, step, h, duration) for step in (h, h / 2, h / 16))
    for a, b, exact in zip(coarse, fine, reference, strict=True):
        order = np.log2(np.abs(a - exact).max() / np.abs(b - exact).max())
        assert order == pytest.approx(2.0, abs=0.1)
