"""The membrane law keeps its contract and gives the exact forces of homogeneous states."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.checks import check_law
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError

A, NU, WEIGHT = 3.0, 0.3, 0.7
SECTION = np.array([A, NU, WEIGHT])[:, None, None]


def gradients(*rows: float) -> np.ndarray:
    return np.array(rows)[:, None, None]


def stress(u: np.ndarray, rate: np.ndarray | None = None, beta: float = 0.0) -> np.ndarray:
    S = np.full_like(u, np.nan)
    laws.stress(Law.MEMBRANE, u, u if rate is None else rate, beta, SECTION, S)
    return S[:, 0, 0]


@pytest.mark.parametrize("seed", range(4))
def test_contract(seed: int) -> None:
    check_law(Law.MEMBRANE, 2, seed=seed)


def test_contract_is_planar() -> None:
    with pytest.raises(
        InputError,
        match=r"check_law\(MEMBRANE, dimension 3\): expected dimension 2 for this law, got 3",
    ):
        check_law(Law.MEMBRANE, 3)


def test_uniaxial_tension() -> None:
    """E22 = -nu E11 leaves N22 = 0 and N11 = A (1 - nu^2) E11 = E t E11, W = E t E11^2 / 2 an area."""
    E11 = 0.11
    u = gradients(np.sqrt(1.0 + 2.0 * E11), 0.0, 0.0, np.sqrt(1.0 - 2.0 * NU * E11))
    Et = A * (1.0 - NU**2)
    assert_allclose(
        stress(u), [WEIGHT * Et * E11 * u[0, 0, 0], 0.0, 0.0, 0.0], rtol=1e-14, atol=1e-16
    )
    assert_allclose(laws.energy(Law.MEMBRANE, u, SECTION), WEIGHT * Et * E11**2 / 2.0, rtol=1e-14)


def test_simple_shear() -> None:
    """r,2 = e_y + g e_x: E12 = g/2, E22 = g^2/2, so that W = A/2 (g^4/4 + (1 - nu) g^2/2)."""
    g = 0.2
    energy = WEIGHT * A / 2.0 * (g**4 / 4.0 + (1.0 - NU) * g**2 / 2.0)
    assert_allclose(
        laws.energy(Law.MEMBRANE, gradients(1.0, 0.0, g, 1.0), SECTION), energy, rtol=1e-14
    )


def test_damping_of_a_stretching_membrane() -> None:
    """dE11/dt = x' v adds the force beta A (1, nu) x' v to N."""
    u, rate, beta = gradients(1.1, 0.0, 0.0, 1.0), gradients(0.5, 0.0, 0.0, 0.0), 0.4
    speed = 1.1 * 0.5
    assert_allclose(
        stress(u, rate, beta) - stress(u),
        WEIGHT * beta * A * speed * np.array([1.1, 0.0, 0.0, NU]),
        rtol=1e-13,
    )


def test_numbers_of_the_laws() -> None:
    assert [law.vectors for law in laws.NUMBERS.values()] == [2, 2, 2, 2, 5, 3, 2, 8, 0, 3, 4, 12]
    assert [law.rows for law in laws.NUMBERS.values()] == [4, 4, 4, 3, 7, 3, 3, 35, 0, 29, 12, 52]
