"""Rotation matrices against those of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fmbs_skfem.core.rotations import rotation


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi, 7.0])
def test_rotations_are_those_of_scipy(angle: float) -> None:
    vector = angle * np.array([2.0, -1.0, 2.0]) / 3.0
    np.testing.assert_allclose(rotation(vector), Rotation.from_rotvec(vector).as_matrix(), rtol=0.0, atol=1e-15)
