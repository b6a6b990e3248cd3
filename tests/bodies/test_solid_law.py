"""Laws and materials of solids."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Law, Material, check_law, laws, own_laws
from fmbs_skfem.bodies.solids import materials, solid_law
from fmbs_skfem.bodies.solids.materials import Orthotropic
from fmbs_skfem.core.errors import InputError

WOOD = Orthotropic((10e9, 0.8e9, 0.4e9), (0.35, 0.45, 0.03), (0.6e9, 0.05e9, 0.5e9), 450.0)


def neo_hooke(r: Any, mu: Any, k: Any) -> Any:
    """mu/2 (tr F^T F - 3) - mu (J - 1) + k/2 (J - 1)^2, of small strains with lambda = k - mu.

    B. Smith, F. De Goes, T. Kim, ACM Trans. Graph. 37 (2018) 12, doi:10.1145/3180491.
    """
    a, b, c = r
    J = a.dot(b.cross(c))
    square = a.dot(a) + b.dot(b) + c.dot(c)
    return mu / 2 * (square - 3) - mu * (J - 1) + k / 2 * (J - 1) ** 2


NEO_HOOKE = own_laws.define("test_neo_hooke", 3, ("mu", "k"), neo_hooke, dims=(3,))


@pytest.mark.parametrize("seed", [0, 1])
def test_contract(seed: int) -> None:
    check_law(Law.SOLID, 3, seed=seed)


def gradients(strain: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Gradients (9, 1, 1) of a small symmetric displacement gradient (3, 3), turned."""
    return (turn @ (np.eye(3) + strain)).T.reshape(9, 1, 1)


def stress(law: Law, numbers: list[float], u: np.ndarray) -> np.ndarray:
    """Cauchy's, (6,)."""
    P = np.empty_like(u)
    section = np.array([*numbers, 1.0]).reshape(-1, 1, 1)
    laws.stress(law, u, np.zeros_like(u), 0.0, section, P)
    return solid_law.cauchy(u, P)[:, 0, 0]


@pytest.mark.parametrize("law", ["hooke", "neo"])
def test_small_strains_make_the_stress_of_hooke_in_axes_that_turn(law: str) -> None:
    E, nu = 3.0, 0.25
    mu, lame = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    e = 1e-6 * np.array([[1.0, 0.3, -0.2], [0.3, -0.7, 0.4], [-0.2, 0.4, 0.5]])
    turn = Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix()
    C = materials.stiffness(Material(E, 1.0, nu))
    rows = [*C[np.triu_indices(6)], 0.0, *solid_law.REFERENCE]
    one = (Law.SOLID, rows) if law == "hooke" else (NEO_HOOKE, [mu, lame + mu])
    sigma = 2 * mu * e + lame * np.trace(e) * np.eye(3)
    wanted = [sigma[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    assert_allclose(stress(*one, gradients(e, turn)), wanted, atol=1e-4 * np.abs(sigma).max())


def test_a_law_of_ones_own_keeps_its_contract() -> None:
    check_law(NEO_HOOKE, 3)


def test_stress_of_a_large_stretch() -> None:
    """A bar free to the side: Piola's second stress E e along it is true stress / stretch here."""
    C = materials.stiffness(Material(2.0, 1.0, 0.0))
    rows = [*C[np.triu_indices(6)], 0.0, *solid_law.REFERENCE]
    u = gradients(np.diag([0.5, 0.0, 0.0]), np.eye(3))
    assert_allclose(stress(Law.SOLID, rows, u), [2.0 * 0.625 * 1.5, 0, 0, 0, 0, 0], atol=1e-14)


def test_the_stiffness_of_a_turned_material() -> None:
    """Energies of a strain in both axes are alike; a turn of an isotropic one changes nothing."""
    turn = Rotation.from_rotvec([0.3, 0.7, -0.4]).as_matrix()
    e = np.array([[1.0, 0.3, -0.2], [0.3, -0.7, 0.4], [-0.2, 0.4, 0.5]])
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    angles = lambda e: np.array([e[i, j] * (1.0 + (i != j)) for i, j in pairs])  # noqa: E731
    own, mesh = materials.stiffness(WOOD), materials.stiffness(WOOD, turn)
    there, here = angles(turn.T @ e @ turn), angles(e)
    assert here @ mesh @ here == pytest.approx(there @ own @ there, rel=1e-12)
    E, nu = 7.0, 0.3
    alike = Orthotropic((E,) * 3, (nu,) * 3, (E / (2 * (1 + nu)),) * 3, 1.0)
    isotropic = materials.stiffness(Material(E, 1.0, nu))
    assert_allclose(materials.stiffness(alike, turn), isotropic, atol=1e-12)


def test_moduli_of_an_orthotropic_material() -> None:
    S = np.linalg.inv(materials.stiffness(WOOD))
    assert_allclose(1.0 / np.diag(S)[:3], WOOD.young_moduli)
    assert_allclose(
        [-S[1, 0] / S[0, 0], -S[2, 1] / S[1, 1], -S[0, 2] / S[2, 2]], WOOD.poisson_ratios
    )


def test_ratios_that_make_no_stiffness_are_refused() -> None:
    with pytest.raises(InputError, match="a stiffness that is positive"):
        Orthotropic((1.0, 1.0, 1.0), (0.9, 0.9, 0.9), (1.0, 1.0, 1.0), 1.0)


def test_principal_values_and_von_mises() -> None:
    tensor = np.array([3.0, -1.0, 2.0, 0.5, -0.7, 0.2])
    xx, yy, zz, xy, yz, zx = tensor
    values = np.linalg.eigvalsh([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])[::-1]
    assert_allclose(solid_law.principal(tensor), values)
    a, b, c = values
    wanted = np.sqrt(0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2))
    assert solid_law.von_mises(tensor) == pytest.approx(wanted)
