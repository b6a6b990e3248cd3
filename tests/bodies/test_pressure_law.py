"""Pressures that follow: their force is exact, their moduli are its symmetric part, and their
energy is that of the volume.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.laws import Law

SIZES = {Law.PRESSURE: 9, Law.EDGE_PRESSURE: 4}


def sample(law: Law) -> tuple[np.ndarray, np.ndarray]:
    """Random gradients and sections at 2 points of 3 cells."""
    random = np.random.default_rng(3)
    return random.normal(size=(SIZES[law], 2, 3)), random.uniform(0.5, 2.0, (3, 2, 3))


def stress(law: Law, u: np.ndarray, section: np.ndarray) -> np.ndarray:
    S = np.full_like(u, np.nan)
    laws.stress(law, u, u, 0.0, section, S)
    return S


def test_force_of_a_surface() -> None:
    """-p r,1 x r,2 times the weight on r, nothing on its derivatives."""
    u, section = sample(Law.PRESSURE)
    S = stress(Law.PRESSURE, u, section)
    normal = np.cross(u[3:6], u[6:9], axis=0)
    assert_allclose(S[:3], -section[0] * section[2] * normal, rtol=1e-14)
    assert not S[3:].any()


def test_force_of_an_edge() -> None:
    """An edge along x, passed with the plate on its left, has its normal along -y."""
    u = np.array([0.3, 0.2, 2.0, 0.0]).reshape(4, 1, 1)
    S = stress(Law.EDGE_PRESSURE, u, np.array([3.0, 0.0, 0.5]).reshape(3, 1, 1))
    assert_allclose(-S[:, 0, 0], [0.0, -3.0 * 0.5 * 2.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("law", SIZES)
def test_moduli_are_the_symmetric_part_of_the_slopes(law: Law) -> None:
    """The force is a polynomial of second degree: central differences are exact."""
    u, section = sample(law)
    D, slopes = np.full((len(u), *u.shape), np.nan), np.zeros((len(u), *u.shape))
    laws.modulus(law, u, 0.0, section, D)
    for j in range(len(u)):
        step = np.zeros_like(u)
        step[j] = 0.5
        slopes[:, j] = stress(law, u + step, section) - stress(law, u - step, section)
    assert_allclose(D, 0.5 * (slopes + slopes.transpose(1, 0, 2, 3)), atol=1e-13)
    assert np.abs(slopes - D).max() > 0.1


def test_energy_of_a_sphere_and_of_a_circle() -> None:
    """r = R n, |r,1 x r,2| = R^2 over the unit sphere: -p (V - V0) with V = 4/3 pi R^3; of the
    circle with V = pi R^2.
    """
    u = np.array([[2.0, 0, 0], [0, 2.0, 0], [0, 0, 2.0]]).reshape(9, 1, 1)
    section = np.array([5.0, 1.0, 4.0 * np.pi]).reshape(3, 1, 1)
    assert laws.energy(Law.PRESSURE, u, section) == pytest.approx(
        -5.0 * 4.0 / 3.0 * np.pi * (8.0 - 1.0), rel=1e-14
    )
    u, section = (
        np.array([2.0, 0, 0, 2.0]).reshape(4, 1, 1),
        np.array([5.0, 1.0, 2.0 * np.pi]).reshape(3, 1, 1),
    )
    assert laws.energy(Law.EDGE_PRESSURE, u, section) == pytest.approx(
        -5.0 * np.pi * (4.0 - 1.0), rel=1e-14
    )
