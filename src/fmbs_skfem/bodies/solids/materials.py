r"""Elastic materials of solids: isotropic, or with three planes of symmetry.

    isotropic      C = lambda 1 1^T + mu diag(2, 2, 2, 1, 1, 1),    lambda = E nu / ((1 + nu) (1 - 2 nu)),  mu = E / (2 (1 + nu))
    orthotropic    C^-1 = ( 1/E_1  -nu_12/E_1  -nu_31/E_3 ;  .. 1/E_2  -nu_23/E_2 ;  .. 1/E_3 )  and  1/G_12, 1/G_23, 1/G_31

of strains 11, 22, 33, and the angles of shear 12, 23, 31.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from ...core.errors import InputError, require_positive, say
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...core.values.fields import Density, vector
from ..sections import Material
from .solid_law import PAIRS

Triple = tuple[float, float, float]


@dataclass(frozen=True)
@checked
class Orthotropic:
    """A material with three planes of symmetry: Young's moduli along its axes 1, 2, 3 [Pa], and
    Poisson's ratios and shear moduli [Pa] of 12, 23 and 31.

        nu_12 = - e_22 / e_11   under a stress along 1
    """

    young_moduli: Annotated[Triple, vector("Pa")]
    poisson_ratios: Annotated[Triple, vector("")]
    shear_moduli: Annotated[Triple, vector("Pa")]
    density: Density

    def __post_init__(self) -> None:
        require_positive("material", density=self.density)
        for name in ("young_moduli", "shear_moduli"):
            require_positive("material", **{name: min(getattr(self, name))})
        if np.linalg.eigvalsh(compliance(self))[0] <= 0.0:
            got = f"Poisson's ratios {self.poisson_ratios}"
            remedy = "nu_ij counts the contraction along j under a stress along i"
            raise InputError(say("material", "a stiffness that is positive", got, remedy))


def compliance(material: Orthotropic) -> np.ndarray:
    """C^-1 (6, 6) [1/Pa] in the axes of the material."""
    E, nu, G = material.young_moduli, material.poisson_ratios, material.shear_moduli
    S = np.diag([*(1.0 / one for one in E), *(1.0 / one for one in G)])
    for k, (i, j) in enumerate(PAIRS[3:]):
        S[i, j] = S[j, i] = -nu[k] / E[i]
    return S


def stiffness(material: Material | Orthotropic, axes: np.ndarray | None = None) -> np.ndarray:
    """C (6, 6) [Pa] in the axes of a mesh, of a material whose own `axes` are the columns of a
    rotation (3, 3) in it.
    """
    if isinstance(material, Material):
        E, nu = material.young_modulus, material.poisson_ratio
        mu = E / (2.0 * (1.0 + nu))
        C = np.diag([2.0 * mu] * 3 + [mu] * 3)
        C[:3, :3] += E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        return C
    C = np.linalg.inv(compliance(material))
    if axes is None:
        return C
    T = turned(axes)
    return np.asarray(T.T @ C @ T)


def turned(axes: np.ndarray) -> np.ndarray:
    """T (6, 6) of strains in the axes of a material from those of the mesh, e' = T e.

    e'_ab = q_ai e_ij q_bj,    rows q_a the axes
    """
    Q = np.asarray(axes, dtype=float).T
    T = np.empty((6, 6))
    for k, (a, b) in enumerate(PAIRS):
        for m, (i, j) in enumerate(PAIRS):
            both = Q[a, i] * Q[b, j] + (Q[a, j] * Q[b, i] if i != j else 0.0)
            # of an angle, twice the component: a column has half of it, a row all
            T[k, m] = both * (0.5 if i != j else 1.0) * (2.0 if a != b else 1.0)
    return T
