r"""The elastic laws behind one door: strain energy W(u) of jets u (k c, p, e), by number.

    S = dW/du,   D = d2W/du2,   u = (r,1, ... r,k)

    law                            vectors                    section rows
    QUADRATIC, MATERIAL, EXACT     r' r''                     EA, EI, kappa0, weight                       `cable_law`
    MEMBRANE                       r,1 r,2                    A, nu, weight                                `membrane_law`
    SHELL                          r,1 r,2 r,11 r,22 r,12     A, B, nu, b0_11, b0_22, b0_12, weight        `shell_law`

The numbers of the cable laws are those of their `Curvature`. `checks.check_law` tests every law.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from ..core.jit import jit
from . import cable_law, membrane_law, shell_law


class Law(IntEnum):
    """Number of an elastic law."""

    QUADRATIC = 0
    MATERIAL = 2
    EXACT = 3
    MEMBRANE = 4
    SHELL = 5


VECTORS = {Law.QUADRATIC: 2, Law.MATERIAL: 2, Law.EXACT: 2, Law.MEMBRANE: 2, Law.SHELL: 5}  #: derivatives of r that a law reads
ROWS = {Law.QUADRATIC: 4, Law.MATERIAL: 4, Law.EXACT: 4, Law.MEMBRANE: 3, Law.SHELL: 7}  #: rows of its section
MEMBRANE, SHELL = int(Law.MEMBRANE), int(Law.SHELL)  #: plain numbers for compiled functions


def vectors(law: int) -> int:
    """Number k of derivatives of r that a law reads."""
    return VECTORS[Law(law)]


def rows(law: int) -> int:
    """Number of rows of the section of a law; the last one is the quadrature weight."""
    return ROWS[Law(law)]


@jit
def energy(law: int, u: np.ndarray, section: np.ndarray) -> float:
    """Strain energy [J] summed over all points."""
    if law == MEMBRANE:
        return membrane_law.energy(u, section)
    if law == SHELL:
        return shell_law.energy(u, section)
    return cable_law.energy(law, u, section)


@jit
def stress(law: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and jet rates `rate`), shapes (k c, p, e)."""
    if law == MEMBRANE:
        membrane_law.stress(u, rate, beta, section, S)
    elif law == SHELL:
        shell_law.stress(u, rate, beta, section, S)
    else:
        cable_law.stress(law, u, rate, beta, section, S)


@jit
def modulus(law: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight d2W/du2 + beta (material part), shape (k c, k c, p, e), symmetric; `beta` [-]: damping time times gh."""
    if law == MEMBRANE:
        membrane_law.modulus(u, beta, section, D)
    elif law == SHELL:
        shell_law.modulus(u, beta, section, D)
    else:
        cable_law.modulus(law, u, beta, section, D)
