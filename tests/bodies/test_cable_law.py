"""The cable law keeps its contract, and the contract finds each kind of fault."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Law, cable_law, check_law, laws
from fmbs_skfem.bodies.laws import CABLES
from fmbs_skfem.core.errors import InputError


@pytest.mark.parametrize("law, dim, seed", list(product(CABLES, (2, 3), (0, 1))))
def test_contract(law: Law, dim: int, seed: int) -> None:
    check_law(law, dim, seed=seed)


@pytest.mark.parametrize("law, dim", list(product(CABLES, (2, 3))))
def test_stresses_of_outputs_are_those_of_the_law(law: Law, dim: int) -> None:
    rng = np.random.default_rng(3)
    u, section = rng.normal(size=(2 * dim, 3, 5)), rng.uniform(0.5, 2.0, size=(4, 3, 5))
    section[2, 0] = 0.0
    section[2] *= law is not Law.QUADRATIC
    S = np.zeros_like(u)
    laws.stress(law, u, 0.0 * u, 0.0, section, S)
    found = cable_law.stresses(
        law.option, dim, (section[0], section[1]), section[2], u.transpose(1, 2, 0)
    )
    assert_allclose(
        np.concatenate(found, axis=-1).transpose(2, 0, 1) * section[3], S, rtol=1e-9, atol=1e-9
    )


def stress_times(
    factor: float, fault: Callable[..., np.ndarray] = lambda S, *_: 0.0 * S
) -> Callable[..., None]:
    """The stress of the cable times a factor, and a fault added."""

    def stress(
        law: Law, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray
    ) -> None:
        laws.stress(law, u, rate, beta, section, S)
        S *= factor
        S += fault(S, u, rate, beta)

    return stress


def modulus_with(fault: Callable[[np.ndarray, float], None]) -> Callable[..., None]:
    def modulus(law: Law, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
        laws.modulus(law, u, beta, section, D)
        fault(D, beta)

    return modulus


def small_entry(D: np.ndarray, beta: float) -> None:
    D[0, 1] += 1e-6


def one_sided(D: np.ndarray, beta: float) -> None:
    D[0, 1] *= 1.0 + 1e-13


def undamped(D: np.ndarray, beta: float) -> None:
    D *= 1.0 + beta


def first_row(law: Law, u: np.ndarray, section: np.ndarray) -> float:
    """An energy that knows the direction of the x axis."""
    return laws.energy(law, u, section) + 0.5 * float(np.sum(u[0] ** 2))


def along_x(S: np.ndarray, u: np.ndarray, rate: np.ndarray, beta: float) -> np.ndarray:
    return np.concatenate([u[:1], 0.0 * u[1:]])


def with_unit_entry(D: np.ndarray, beta: float) -> None:
    D[0, 0] += 1.0


def absolute(S: np.ndarray, u: np.ndarray, rate: np.ndarray, beta: float) -> np.ndarray:
    """Damping of the gradients themselves, which damps rigid rotations too."""
    return beta * rate


def absolute_modulus(D: np.ndarray, beta: float) -> None:
    for i in range(len(D)):
        D[i, i] += beta


def driving(S: np.ndarray, u: np.ndarray, rate: np.ndarray, beta: float) -> np.ndarray:
    return -10.0 * beta * rate


def driving_modulus(D: np.ndarray, beta: float) -> None:
    for i in range(len(D)):
        D[i, i] -= 10.0 * beta


@pytest.mark.parametrize(
    "changed, found",
    [
        ({"stress": stress_times(1.0 + 1e-6)}, "stress against the energy"),
        ({"modulus": modulus_with(small_entry)}, "modulus against the stress"),
        ({"modulus": modulus_with(one_sided)}, "symmetry of the modulus"),
        (
            {
                "energy": first_row,
                "stress": stress_times(1.0, along_x),
                "modulus": modulus_with(with_unit_entry),
            },
            "energy of a rigid rotation",
        ),
        ({"modulus": modulus_with(undamped)}, "damping stress against its modulus"),
        (
            {"stress": stress_times(1.0, absolute), "modulus": modulus_with(absolute_modulus)},
            "power of the damping in a rigid",
        ),
        (
            {"stress": stress_times(1.0, driving), "modulus": modulus_with(driving_modulus)},
            "damping dissipates",
        ),
        ({"energy": lambda law, u, section: np.nan}, "stress against the energy"),
        (
            {"dissipation": lambda *given: 1.01 * laws.dissipation(*given)},
            "dissipation against the power of the damping stress",
        ),
    ],
)
def test_faults_are_named(changed: dict[str, Any], found: str) -> None:
    rules: dict[str, Any] = {
        name: getattr(laws, name) for name in ("energy", "stress", "modulus", "dissipation")
    }
    check_law(Law.EXACT, 3, SimpleNamespace(**rules))
    with pytest.raises(InputError, match=rf"check_law\(EXACT, dimension 3\): {found}"):
        check_law(Law.EXACT, 3, SimpleNamespace(**(rules | changed)))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    "law, kappa", [(Law.EXACT, 2.0), (Law.MATERIAL, 2.5), (Law.QUADRATIC, 3.125)]
)
def test_curvature_of_a_stretched_circle(law: Law, kappa: float, dim: int) -> None:
    """A circle of radius 0.4 m stretched by 1.25 to 0.5 m: 1/R geometric, |r'|/R material, |r'|^2/R
    for |r''|.
    """
    u = np.zeros(2 * dim)
    u[0], u[dim + 1] = 1.25, 1.25**2 / 0.5
    assert_allclose(cable_law.curvatures(law.option, dim, u), kappa, rtol=1e-14)
    stretched, bent = (
        laws.energy(law, u[:, None, None], np.array(row)[:, None, None])
        for row in ([2.0, 0, 0, 1], [0, 2.0, 0, 1])
    )
    assert_allclose([stretched, bent], [0.28125**2, kappa**2], rtol=1e-14)


def test_planar_curvature_has_a_sign() -> None:
    """A beam bent against its reference curvature stores (kappa + kappa0)^2, in space (kappa -
    kappa0)^2.
    """
    section = np.array([1.0, 2.0, 1.0, 1.0])[:, None, None]
    turned = laws.energy(Law.EXACT, np.array([1.0, 0.0, 0.0, -1.0])[:, None, None], section)
    spatial = laws.energy(
        Law.EXACT, np.array([1.0, 0.0, 0.0, 0.0, -1.0, 0.0])[:, None, None], section
    )
    assert_allclose([turned, spatial], [4.0, 0.0], atol=1e-11)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", CABLES)
def test_forces_and_damping_do_not_depend_on_the_unit_of_length(law: Law, dim: int) -> None:
    """All lengths 1000 times larger numbers: r' stays, r'' falls; N grows with the length, EI with
    its cube.
    """
    f, random = 1000.0, np.random.default_rng(5)
    u, rate = random.normal(size=(2, 2 * dim, 1, 1))
    section, one, two = (
        np.array([2e4, 0.5, 0.3, 0.1]).reshape(4, 1, 1),
        np.zeros_like(u),
        np.zeros_like(u),
    )
    per = np.repeat([1.0, 1.0 / f], dim)[:, None, None]
    laws.stress(law, u, rate, 0.01, section, one)
    laws.stress(
        law,
        u * per,
        rate * per,
        0.01,
        section * np.array([f, f**3, 1.0 / f, f]).reshape(4, 1, 1),
        two,
    )
    assert_allclose(two * per, one * f**2, rtol=1e-12, atol=1e-12 * f**2 * np.abs(one).max())
