"""Example 1 of Hou, Liu and Hu (2020): the beam spun up by a driven hinge. CMAME 361, 112690, doi
10.1016/j.cma.2019.112690.

Published: largest tip deflection 0.3176 m. The longer digits are stored figures of this package,
converged in mesh and step.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    energies,
    energy_drift,
    integrate,
    outputs,
)

from .. import models

STEP = 5e-4
TIGHT = Newton(tolerance=1e-11)


@functools.cache
def run(cells: int, h: float, duration: float = 0.9) -> Trajectory:
    return integrate(models.spin_up(cells), GeneralizedAlpha(h), duration, TIGHT)


def deflection(cells: int, h: float, duration: float = 0.9) -> np.ndarray:
    return outputs(run(cells, h, duration))["tip_deflection"]


def test_largest_deflection() -> None:
    found = deflection(100, STEP)
    assert found.min() == pytest.approx(-0.3176, abs=5e-5)  # published
    assert found.min() == pytest.approx(-0.3176261, abs=1e-7)
    assert run(100, STEP).times[found.argmin()] == pytest.approx(0.8315, abs=1e-9)
    assert found[round(0.83 / STEP)] == pytest.approx(-0.3176193, abs=1e-7)


def test_converged_in_time() -> None:
    assert deflection(25, STEP / 8)[round(0.83 / STEP * 8)] == pytest.approx(-0.3176188, abs=2e-7)


@pytest.mark.parametrize("cells", [25, 50, 200])
def test_independent_of_the_mesh(cells: int) -> None:
    np.testing.assert_allclose(deflection(cells, STEP), deflection(100, STEP), atol=1e-6)


def test_ancf_cable_is_the_same_model() -> None:
    """C1 cubic B-splines and the cubic Hermite cable span the same functions."""
    found = integrate(models.spin_up(25, ancf=True), GeneralizedAlpha(STEP), 0.9, TIGHT)
    np.testing.assert_allclose(outputs(found)["tip_deflection"], deflection(25, STEP), atol=1e-8)


def test_error_of_the_step_over_the_whole_run() -> None:
    exact = deflection(25, STEP / 8, 3.0)
    coarse, fine = (
        np.abs(deflection(25, h, 3.0) - exact[:: round(8 * h / STEP)]).max()
        for h in (2 * STEP, STEP)
    )
    assert fine < 2e-5
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_energy_balance_with_the_work_of_the_drive() -> None:
    """Kinetic and strain energy minus the work of the drive: the drift is of second order in the
    step.
    """
    coarse, fine = (energy_drift(run(10, h, 3.0)) for h in (2 * STEP, STEP))
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.05)
    assert fine < 6e-6
    kinetic, strain, _, balance = energies(run(10, STEP, 3.0)).T
    assert kinetic[-1] > 0.9  # the drive has done work: the balance is no tautology
    np.testing.assert_allclose(balance, 0.0, atol=6e-6)
    assert strain.max() > 0.01


def test_steady_rotation() -> None:
    """After the spin-up a rigid beam would have rhoA L^3 ws^2/6; the flexible one swings about it."""
    found = run(25, STEP, 3.0)
    late = found.times > models.SPIN_TIME
    density = 1800.0 * np.pi * 0.01**2 / 4
    assert energies(found)[late, 0].mean() == pytest.approx(
        density * models.SPIN_RATE**2 / 6, rel=0.02
    )
