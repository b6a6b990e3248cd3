"""Strain, curvature and stress fields of exact states."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import stress_recovery as fields
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.errors import InputError

YOUNG, NU, T = 70e9, 0.3, 0.01
A = YOUNG * T / (1.0 - NU**2)
B = YOUNG * T**3 / (12.0 * (1.0 - NU**2))


def plate(
    second: np.ndarray, b0: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> fields.RecoveredFields:
    """Fields at one point with unit tangents e_x, e_y and the second derivatives (3, 3)."""
    u = np.concatenate([np.eye(2, 3), second]).reshape(15, 1)
    return fields.recover(Law.SHELL, u, np.array([A, B, NU, *b0, 1.0])[:, None], T)


@pytest.mark.parametrize("law", [Law.MEMBRANE, Law.SHELL])
def test_uniaxial_tension(law: Law) -> None:
    """E22 = -nu E11 and S11 = E E11 on all levels, S22 = S12 = 0, von Mises E E11; several points
    in any shape.
    """
    E11 = np.array([[1e-3, 2e-3, 0.0], [-1e-3, 5e-2, 0.1]])
    dim = fields.COMPONENTS[law]
    u = np.zeros((4 if dim == 2 else 15, *E11.shape))
    u[0], u[dim + 1] = np.sqrt(1.0 + 2.0 * E11), np.sqrt(1.0 - 2.0 * NU * E11)
    rows = [A, NU, 1.0] if dim == 2 else [A, B, NU, 0.0, 0.0, 0.0, 1.0]
    section = np.array(rows)[:, None, None] * np.ones((1, *E11.shape))
    found = fields.recover(law, u, section, T)
    assert_allclose(found.strain, [E11, -NU * E11, 0.0 * E11], atol=1e-16)
    assert_allclose(found.stress, [[YOUNG * E11, 0.0 * E11, 0.0 * E11]] * 3, atol=1e-5)
    assert_allclose(found.von_mises, [YOUNG * np.abs(E11)] * 2, atol=1e-5)
    assert not found.curvature.any()


def test_cylindrical_bending() -> None:
    """r,11 = -k e_z stretches the upper face: S11 = E t k / (2 (1 - nu^2)), S22 = nu S11 there, the
    opposite below.
    """
    k = 0.2
    found = plate(np.array([[0.0, 0.0, -k], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    face = YOUNG * T * k / (2.0 * (1.0 - NU**2))
    assert_allclose(found.curvature[:, 0], [k, 0.0, 0.0], rtol=1e-14)
    assert_allclose(
        found.stress[:, :, 0], face * np.outer([-1.0, 0.0, 1.0], [1.0, NU, 0.0]), rtol=1e-13
    )
    assert_allclose(
        found.von_mises[:, 0], face * np.sqrt(1.0 - NU + NU**2) * np.ones(2), rtol=1e-13
    )


def test_torsion() -> None:
    """k12 alone: S12 = G t k12 with G = E / (2 (1 + nu)), von Mises sqrt(3) S12."""
    found = plate(np.array([[0.0] * 3, [0.0] * 3, [0.3, 0.4, -0.5]]), b0=(0.0, 0.0, -0.1))
    shear = YOUNG / (2.0 * (1.0 + NU)) * T * 0.4
    assert_allclose(found.stress[2, :, 0], [0.0, 0.0, shear], rtol=1e-13, atol=1e-6)
    assert_allclose(found.von_mises[:, 0], np.sqrt(3.0) * np.array([shear, shear]), rtol=1e-13)


def test_stretched_and_bent() -> None:
    """Faces add the membrane's and the bending stress: the lower face of k = 2 E11 / t is free of
    S11 and S22.
    """
    E11 = 1e-3
    u = np.zeros((5, 3))
    u[0, 0], u[1, 1], u[2, 2] = np.sqrt(1.0 + 2.0 * E11), 1.0, -2.0 * E11 / T
    found = fields.recover(
        Law.SHELL,
        u.reshape(15, 1),
        np.array([A, B, NU, 0.0, 0.0, 0.0, 1.0])[:, None],
        np.array([T]),
    )
    assert_allclose(found.stress[0], 0.0, atol=1e-4)
    assert_allclose(found.stress[2, 0], 2.0 * YOUNG * E11 / (1.0 - NU**2), rtol=1e-12)


@pytest.mark.parametrize(
    "law, rows, data, thickness, message",
    [
        (Law.EXACT, 4, 4, T, "the law MEMBRANE or SHELL, got EXACT"),
        (Law.SHELL, 4, 3, T, r"gradients and section with \(15, 7\) rows at the same points"),
        (Law.MEMBRANE, 4, 3, 0.0, "a positive thickness"),
    ],
)
def test_wrong_arrays_are_refused(
    law: Law, rows: int, data: int, thickness: float, message: str
) -> None:
    with pytest.raises(InputError, match=f"fields.recover: expected {message}"):
        fields.recover(law, np.ones((rows, 2)), np.ones((data, 2)), thickness)
