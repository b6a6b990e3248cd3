r"""The law of solids: strains that are quadratic in the deformation gradient, any stiffness between them.

    e = 1/2 (F^T F - 1),    W = 1/2 e^T C e,    F = (r,1 r,2 r,3)

Strains stand as 11, 22, 33, 12, 23, 31, shear as the angle (twice the tensor's), a quarter of a
quartic in F: St. Venant-Kirchhoff. With other energies of F a solid takes a law of its author's own.

Source: T. Belytschko, W. K. Liu, B. Moran, Nonlinear Finite Elements for Continua and Structures,
Wiley 2000, section 5.4.
"""

from __future__ import annotations

import numpy as np

from .. import laws, strain_law
from ..laws import Law

PAIRS = (
    (0, 0),
    (1, 1),
    (2, 2),
    (0, 1),
    (1, 2),
    (2, 0),
)  #: of a tensor that stands as six components
NORMAL = tuple(((a, a, 0.5),) for a, _ in PAIRS[:3])
SHEAR = tuple(((a, b, 1.0),) for a, b in PAIRS[3:])
STRAINS = (*NORMAL, *SHEAR)
REFERENCE = np.array([0.5, 0.5, 0.5, 0.0, 0.0, 0.0])  #: of the products where F is a rotation
FUNCTIONS = strain_law.functions("solid", 3, STRAINS, ())


def is_solid(law: Law) -> bool:
    """Whether a law is one of the deformation gradient."""
    return law.tangents == len(NORMAL)


def stresses(law: Law, numbers: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Cauchy stress (6, ...) [Pa] of a law at gradients u (9, ...), see `cauchy`.

    `numbers` (i, ...) are those of its section, without the weight.
    """
    section = np.ones((law.rows, *u.shape[1:]))
    section[:-1] = numbers
    P = np.empty_like(u)
    laws.stress(law, u, np.zeros_like(u), 0.0, section, P)
    return cauchy(u, P)


def cauchy(u: np.ndarray, piola: np.ndarray) -> np.ndarray:
    """Cauchy stress (6, ...) as xx, yy, zz, xy, yz, zx in axes that turn with the material.

        sigma = R^T P F^T R / det F,    F = R U

    of gradients u (9, ...) and the stress dW/dF of a law (9, ...), its volume that of the reference.
    R is the rotation nearest to F.
    """
    F, P = (one.reshape(3, 3, -1).transpose(2, 1, 0) for one in (u, piola))
    left, _, right = np.linalg.svd(F)
    left[:, :, -1] *= np.sign(np.linalg.det(left @ right))[:, None]
    R = left @ right
    sigma = R.transpose(0, 2, 1) @ P @ F.transpose(0, 2, 1) @ R / np.linalg.det(F)[:, None, None]
    rows = [sigma[:, a, b] for a, b in PAIRS]
    return np.stack(rows).reshape(6, *u.shape[1:])


def strains(u: np.ndarray) -> np.ndarray:
    """Green-Lagrange strain (6, ...) as xx, yy, zz, xy, yz, zx [-] of gradients u (9, ...).

        E = 1/2 (F^T F - 1)

    Shear strains are components of the tensor, half of the angles.
    """
    F = u.reshape(3, 3, *u.shape[1:])
    return np.stack([0.5 * ((F[a] * F[b]).sum(axis=0) - float(a == b)) for a, b in PAIRS])


def principal(tensor: np.ndarray) -> np.ndarray:
    """Principal values (3, ...), the largest first, of symmetric tensors xx, yy, zz, xy, yz, zx (6,
    ...).
    """
    xx, yy, zz, xy, yz, zx = tensor
    matrix = np.stack([np.stack([xx, xy, zx]), np.stack([xy, yy, yz]), np.stack([zx, yz, zz])])
    return np.moveaxis(np.linalg.eigvalsh(np.moveaxis(matrix, (0, 1), (-2, -1)))[..., ::-1], -1, 0)


def von_mises(tensor: np.ndarray) -> np.ndarray:
    """The von Mises stress (...) of tensors xx, yy, zz, xy, yz, zx (6, ...).

    s_v^2 = ((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2) / 2 + 3 (xy^2 + yz^2 + zx^2)
    """
    xx, yy, zz, *shear = tensor
    normal = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    return np.asarray(np.sqrt(normal + 3.0 * sum(one**2 for one in shear)))
