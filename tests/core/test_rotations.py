"""Rotation matrices against those of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fmbs_skfem.core.algebra.rotations import nearest, rotation


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi, 7.0])
def test_rotations_are_those_of_scipy(angle: float) -> None:
    vector = angle * np.array([2.0, -1.0, 2.0]) / 3.0
    np.testing.assert_allclose(
        rotation(vector), Rotation.from_rotvec(vector).as_matrix(), rtol=0.0, atol=1e-15
    )


def test_the_rotation_nearest_to_a_matrix_is_that_of_its_polar_decomposition() -> None:
    """Of many at once; of a reflection, too, where it is a proper rotation."""
    turns = np.stack([rotation([0.3 * k, 1.0, -k]) for k in range(4)])
    stretch = np.diag([3.0, 1.0, 0.5]) + 0.1
    np.testing.assert_allclose(nearest(turns @ stretch), turns, atol=1e-14)
    np.testing.assert_allclose(nearest(np.diag([2.0, 3.0, -1.0])), np.eye(3), atol=1e-14)
    np.testing.assert_allclose(
        nearest(np.array([[0.0, -2.0], [1.0, 0.0]])), [[0.0, -1.0], [1.0, 0.0]], atol=1e-14
    )
