"""Moduli take stresses of other gradients: D(u, held) - D(u) = sum_k (s_k(held) - s_k(u))
d2e_k/du2, in three ways.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import laws
from fmbs_skfem.bodies.laws import CABLES, Law
from fmbs_skfem.bodies.strain_law import strains
from fmbs_skfem.bodies.vectors import ALL, AXIAL, LINEAR

Strains = Callable[[np.ndarray], np.ndarray]


def of_cable(
    law: Law, dim: int, section: np.ndarray
) -> tuple[Strains, Callable[[np.ndarray], np.ndarray], int]:
    """Axial strain and the vector of the curvature."""
    EA, EI, kappa0 = section[:3]

    def strain(u: np.ndarray) -> np.ndarray:
        r, b = (np.append(v, 0.0)[:3] for v in u.reshape(2, dim))
        k = (
            np.cross(r, b) / np.linalg.norm(r) ** law.option
            if law is not Law.QUADRATIC
            else np.zeros(3)
        )
        return np.append(0.5 * (r @ r - 1.0), k)

    def stress(e: np.ndarray) -> np.ndarray:
        straight = e[1:] - kappa0 * (
            np.array([0.0, 0.0, 1.0]) if dim == 2 else e[1:] / max(np.linalg.norm(e[1:]), 1e-300)
        )
        return np.append(EA * e[0], EI * straight)

    return strain, stress, 1


def plane_stress(nu: float) -> np.ndarray:
    return np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 2.0 * (1.0 - nu)]])


def of_surface(
    law: Law, dim: int, section: np.ndarray
) -> tuple[Strains, Callable[[np.ndarray], np.ndarray], int]:
    """E11, E22, E12, and of shells b_i - b0_i."""
    shell = law is Law.SHELL
    A, B, nu = section[:3] if shell else (section[0], 0.0, section[1])

    def strain(u: np.ndarray) -> np.ndarray:
        r = u.reshape(-1, dim)
        E = [0.5 * (r[0] @ r[0] - 1.0), 0.5 * (r[1] @ r[1] - 1.0), 0.5 * r[0] @ r[1]]
        if not shell:
            return np.array(E)
        n = np.cross(r[0], r[1])
        return np.append(E, r[2:] @ n / np.linalg.norm(n) - section[3:6])

    def stress(e: np.ndarray) -> np.ndarray:
        return np.append(
            A * plane_stress(nu) @ e[:3], B * plane_stress(nu) @ e[3:] if shell else []
        )

    return strain, stress, 3


def of_beam(
    law: Law, dim: int, section: np.ndarray
) -> tuple[Strains, Callable[[np.ndarray], np.ndarray], int]:
    C = np.zeros((12, 12))
    i, j = np.triu_indices(6)
    C[i, j] = C[j, i] = section[:21]
    C[range(6, 12), range(6, 12)] = section[21] * np.array([0.25] * 3 + [0.5] * 3)
    return lambda u: strains(u.reshape(8, 3)) - section[22:34], lambda e: C @ e, 12


CASES = [(law, dim, of_cable) for law in CABLES for dim in (2, 3)]
CASES += [(Law.MEMBRANE, 2, of_surface), (Law.SHELL, 3, of_surface), (Law.BEAM, 3, of_beam)]


def hessian(of: Callable[[np.ndarray], float], u: np.ndarray, h: float = 1e-3) -> np.ndarray:
    """Second derivatives by differences of fourth order."""
    n = len(u)
    found, step = np.zeros((n, n)), h * np.eye(n)
    for i in range(n):
        for j in range(i + 1):
            parts = [
                of(u + f * (step[i] + step[j]))
                - of(u + f * (step[i] - step[j]))
                - of(u - f * (step[i] - step[j]))
                + of(u - f * (step[i] + step[j]))
                for f in (1.0, 2.0)
            ]
            found[i, j] = found[j, i] = (
                (16.0 * parts[0] - parts[1]) / (12.0 * 4.0 * h * h) if i != j else 0.0
            )
            if i == j:
                f = [of(u + k * step[i]) for k in (-2, -1, 0, 1, 2)]
                found[i, i] = (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12.0 * h * h)
    return found


@pytest.mark.parametrize("way", [AXIAL, LINEAR, ALL])
@pytest.mark.parametrize(("law", "dim", "of"), CASES)
def test_a_modulus_takes_stresses_of_other_gradients(
    law: Law, dim: int, of: Callable[..., tuple], way: int
) -> None:
    assert law.holds
    rng = np.random.default_rng(4)
    size = law.vectors * dim
    # slopes near unit length, so that no vector vanishes
    start = np.zeros((law.vectors, dim))
    start[0, 0] = start[-1 if law is Law.BEAM else 1, 1] = 1.0
    u, held = (start.ravel() + rng.normal(scale=0.2, size=size) for _ in range(2))
    section = rng.uniform(0.3, 0.5, law.rows)
    strain, stress, axial = of(law, dim, section)

    d = u - held
    expected = (
        strain(held)
        if way != LINEAR
        else strain(held) + 0.5 * (strain(held + d) - strain(held - d))
    )
    change = stress(expected) - stress(strain(u))
    if way != ALL:
        change[axial:] = 0.0
    if way == AXIAL and law is Law.MEMBRANE:
        change[:] = 0.0  # steps in the plane take their own
    else:
        assert np.abs(change).max() > 1e-4
    wanted = section[-1] * hessian(lambda v: float(change @ strain(v)), u)

    calls, found = laws.addresses(law, dim, False), []
    # a second point shows that points are kept apart
    ones = [np.ascontiguousarray(np.stack([v, start.ravel()], axis=1)[:, None]) for v in (u, held)]
    rows = np.ascontiguousarray(np.stack([section, section], axis=1)[:, None])
    for other in ones[::-1], ones[:1] * 2:
        D = np.zeros((size, size, 1, 2))
        laws.call_modulus(calls, ones[0], other[0], way, 0.0, rows, D)
        found.append(D[:, :, 0, 0])
    assert_allclose(found[0] - found[1], wanted, atol=1e-7 * np.abs(found[1]).max())
