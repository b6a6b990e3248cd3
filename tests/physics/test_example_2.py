"""Example 2 of Hou, Liu and Hu (2020): the spatial double pendulum. CMAME 361, 112690, doi
10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

from fmbs_skfem.bodies.laws import Law
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
CELLS = 20

# stored figures of this package: 100 cells a beam, h = 5e-4 / 8, Newton tolerance 1e-11
STORED = {
    1.0: (-1.39851319, -0.31859187, -1.17197751),
    2.0: (0.7392188, -0.14986117, -1.42123747),
    3.0: (0.12059877, 0.41965712, -0.95365035),
}


@functools.cache
def run(h: float) -> Trajectory:
    return integrate(
        models.double_pendulum(CELLS), GeneralizedAlpha(h), 3.0, Newton(tolerance=1e-10)
    )


def free_end(trajectory: Trajectory) -> np.ndarray:
    """C(t), (s, 3)."""
    columns = outputs(trajectory)
    return np.stack([columns[f"C_{axis}"] for axis in "xyz"], axis=1)


def difference(h: float) -> float:
    """Largest distance of C(t) from the run with STEP / 8 [m]."""
    exact = free_end(run(STEP / 8))[:: round(8 * h / STEP)]
    return float(np.linalg.norm(free_end(run(h)) - exact, axis=1).max())


def test_stored_figures() -> None:
    """A fifth of the cells moves C by 3e-6 m."""
    found = free_end(run(STEP / 8))
    for time, position in STORED.items():
        np.testing.assert_allclose(found[round(8 * time / STEP)], position, atol=5e-6)


def test_published_solver_at_the_same_step() -> None:
    """C at 1 s and 2 s of Exudyn 1.13.6 (100 ANCF cable elements a beam, curvature |r' x
    r''|/|r'|^2, h = 5e-4, rho_inf = 0.8).
    """
    system = models.double_pendulum(100, law=Law.MATERIAL)
    found = free_end(integrate(system, GeneralizedAlpha(STEP), 2.0))
    np.testing.assert_allclose(found[2000], [-1.39851478, -0.31858691, -1.17197463], atol=2e-6)
    np.testing.assert_allclose(found[4000], [0.73923065, -0.14984121, -1.42125200], atol=2e-6)


def test_error_of_the_step() -> None:
    assert difference(STEP) < 4e-4
    assert np.log2(difference(2 * STEP) / difference(STEP)) == pytest.approx(2.0, abs=0.1)


def test_energy_drift_falls_with_the_square_of_the_step() -> None:
    drifts = [energy_drift(run(h)) for h in (4 * STEP, 2 * STEP, STEP)]
    np.testing.assert_allclose(np.log2(np.divide(drifts[:-1], drifts[1:])), 2.0, atol=0.05)
    assert drifts[-1] < 1.5e-4
    kinetic, strain, potential, balance = energies(run(STEP)).T
    assert potential.min() < -1.5
    assert strain.max() > 0.01
    # gravity is in the potential
    np.testing.assert_allclose(kinetic + strain + potential, balance, atol=1e-14)


def test_joints_stay_closed() -> None:
    found = run(STEP)
    q = found.x @ found.system.lift.matrix.T + found.system.lift.offset
    half = q.shape[1] // 2
    assert np.abs(q[:, :3]).max() < 1e-12
    assert np.abs(q[:, half - 3 : half] - q[:, half : half + 3]).max() < 1e-12
