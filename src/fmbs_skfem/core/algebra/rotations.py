"""Rotation matrices, R = I + sin(a)/a W + (1 - cos a)/a^2 W^2 for a vector w of length a with W x =
w x x (Rodrigues).

scipy.spatial.transform has them too; its import takes a tenth of the time of `fmbs check`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def rotation(vector: ArrayLike) -> np.ndarray:
    """Rotation matrix (3, 3) of a rotation vector w (3,), whose length a is the angle [rad].

        R = 1 + sin(a) / a W + (sin(a/2) / (a/2))^2 / 2 W^2,    W u = w x u

    by Rodrigues.
    """
    x, y, z = np.asarray(vector, dtype=float)
    angle = float(np.linalg.norm([x, y, z]))
    W = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sinc(angle / np.pi) * W + 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2 * (W @ W)
    )


def nearest(A: np.ndarray) -> np.ndarray:
    """Rotations (..., c, c) nearest to matrices (polar decomposition).

        A = U diag(s) V,    U diag(1, .., det) V

    with the determinant of U V.
    """
    U, _, V = np.linalg.svd(A)
    U[..., -1] *= np.sign(np.linalg.det(U @ V))[..., None]
    return np.asarray(U @ V)
