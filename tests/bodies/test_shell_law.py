"""The shell law keeps its contract, agrees with the membrane, and gives the exact moments of
cylinders.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.checks import check_law
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError

A, B, NU = 3.0, 2.0, 0.3
RADIUS = 0.8


def section(*b0: float, weight: float = 1.0) -> np.ndarray:
    return np.array([A, B, NU, *(b0 or (0.0, 0.0, 0.0)), weight])[:, None, None]


def bent(radius: float, angle: float = 0.4) -> np.ndarray:
    """Gradients of a plate rolled without strain about the y axis, r = (R sin(s/R), y, R - R
    cos(s/R)), at s = R angle.
    """
    sin, cos = np.sin(angle), np.cos(angle)
    u = np.zeros((5, 3))
    u[0], u[1], u[2] = (cos, 0.0, sin), (0.0, 1.0, 0.0), np.array([-sin, 0.0, cos]) / radius
    return u.reshape(15, 1, 1)


def stress(u: np.ndarray, data: np.ndarray) -> np.ndarray:
    S = np.full_like(u, np.nan)
    laws.stress(Law.SHELL, u, u, 0.0, data, S)
    return S[:, 0, 0].reshape(5, 3)


@pytest.mark.parametrize("seed", range(4))
def test_contract(seed: int) -> None:
    check_law(Law.SHELL, 3, seed=seed)


def test_contract_is_spatial() -> None:
    with pytest.raises(
        InputError,
        match=r"check_law\(SHELL, dimension 2\): expected dimension 3 for this law, got 2",
    ):
        check_law(Law.SHELL, 2)


def test_contract_finds_a_missing_coupling() -> None:
    """A tangent without the blocks (r,i r,a), as if the normal did not turn with the tangents, is
    refused.
    """

    def modulus(law: int, u: np.ndarray, beta: float, data: np.ndarray, D: np.ndarray) -> None:
        laws.modulus(law, u, beta, data, D)
        D[6:, :6] = 0.0
        D[:6, 6:] = 0.0

    rules = SimpleNamespace(energy=laws.energy, stress=laws.stress, modulus=modulus)
    with pytest.raises(
        InputError, match=r"check_law\(SHELL, dimension 3\): modulus against the stress"
    ):
        check_law(Law.SHELL, 3, rules)


def test_flat_plate_rolled_to_a_cylinder() -> None:
    """b11 = 1/R: W = B/2 R^-2 an area, M11 = B/R and M22 = nu B/R along the normal; the tangents
    stay free of force.
    """
    u, data = bent(RADIUS), section(weight=0.25)
    n = np.array([-np.sin(0.4), 0.0, np.cos(0.4)])
    assert_allclose(laws.energy(Law.SHELL, u, data), 0.25 * B / (2.0 * RADIUS**2), rtol=1e-14)
    S = stress(u, data)
    assert_allclose(S[2:], 0.25 * B / RADIUS * np.outer([1.0, NU, 0.0], n), rtol=1e-14, atol=1e-16)
    assert_allclose(S[:2], 0.0, atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5, -3.0])
def test_cylinder_turned_about_its_axis(angle: float) -> None:
    """A cylinder of radius R is free of stress wherever it is turned to; unrolled it stores B/2
    R^-2.
    """
    data = section(1.0 / RADIUS, 0.0, 0.0)
    assert laws.energy(Law.SHELL, bent(RADIUS, angle), data) < 1e-30
    assert_allclose(stress(bent(RADIUS, angle), data), 0.0, atol=1e-15)
    assert_allclose(
        laws.energy(Law.SHELL, bent(np.inf, angle), data), B / (2.0 * RADIUS**2), rtol=1e-14
    )


def test_twist() -> None:
    """r = (x, y, c x y) at the origin: b12 = c and W = B (1 - nu) c^2, the torsion of a plate."""
    u = np.zeros((5, 3))
    u[0, 0], u[1, 1], u[4, 2] = 1.0, 1.0, 0.6
    assert_allclose(
        laws.energy(Law.SHELL, u.reshape(15, 1, 1), section()), B * (1.0 - NU) * 0.6**2, rtol=1e-14
    )


def test_motion_in_the_plane_is_that_of_the_membrane() -> None:
    """In the plane z = 0 of a flat shell: the membrane's stress, without damping to the bit, its
    modulus, no force across.
    """
    random = np.random.default_rng(1)
    flat = random.normal(size=(5, 2, 3, 4))
    flat[:2] = np.eye(2)[:, :, None, None] + random.uniform(-0.3, 0.3, (2, 2, 3, 4))
    u = np.zeros((5, 3, 3, 4))
    u[:, :2] = flat
    data = np.tile(section(weight=0.25), (1, 3, 4))
    rate, S, D = (
        random.normal(size=u.shape).reshape(15, 3, 4),
        np.empty((15, 3, 4)),
        np.empty((15, 15, 3, 4)),
    )
    rate.reshape(5, 3, 3, 4)[:, 2] = 0.0
    laws.stress(Law.SHELL, u.reshape(15, 3, 4), rate, 0.2, data, S)
    laws.modulus(Law.SHELL, u.reshape(15, 3, 4), 0.2, data, D)
    plane, small = data[[0, 2, 6]], np.ascontiguousarray(flat[:2]).reshape(4, 3, 4)
    T, C = np.empty((4, 3, 4)), np.empty((4, 4, 3, 4))
    laws.stress(Law.MEMBRANE, small, np.ascontiguousarray(rate[[0, 1, 3, 4]]), 0.2, plane, T)
    laws.modulus(Law.MEMBRANE, small, 0.2, plane, C)
    inside = [0, 1, 3, 4]
    assert_allclose(S[inside], T, rtol=1e-13, atol=1e-14)
    assert not np.delete(S, inside, axis=0).any()
    assert_allclose(D[np.ix_(inside, inside)], C, rtol=1e-13, atol=1e-14)
    laws.stress(Law.SHELL, u.reshape(15, 3, 4), rate, 0.0, data, S)
    laws.stress(Law.MEMBRANE, small, small, 0.0, plane, T)
    np.testing.assert_array_equal(S[inside], T)


def test_many_cells_equal_single_cells() -> None:
    """150 cells cross the blocks of the kernel: each has the stress that it has alone, with and
    without damping.
    """
    random = np.random.default_rng(2)
    u, rate = random.normal(size=(2, 15, 2, 150))
    data = random.uniform(0.2, 0.45, (7, 2, 150))
    for beta in (0.0, 0.3):
        together, alone = np.full((2, *u.shape), np.nan)
        laws.stress(Law.SHELL, u, rate, beta, data, together)
        for e in range(u.shape[2]):
            single = np.empty((15, 2, 1))
            cut = slice(e, e + 1)
            laws.stress(
                Law.SHELL,
                *(np.ascontiguousarray(v[..., cut]) for v in (u, rate)),
                beta,
                data[..., cut].copy(),
                single,
            )
            alone[..., cut] = single
        assert_allclose(together, alone, rtol=1e-13, atol=1e-13)
