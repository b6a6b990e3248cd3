r"""The elastic laws behind one door: strain energy W(u) of jets u (k c, p, e), by number.

    S = dW/du,   D = d2W/du2,   u = (r,1, ... r,k)

    law                            vectors                    section rows
    QUADRATIC, MATERIAL, EXACT     r' r''                     EA, EI, kappa0, weight                       `cable_law`
    MEMBRANE                       r,1 r,2                    A, nu, weight                                `membrane_law`
    SHELL                          r,1 r,2 r,11 r,22 r,12     A, B, nu, b0_11, b0_22, b0_12, weight        `shell_law`
    PRESSURE, EDGE_PRESSURE        r r,1 r,2 | r r,1          p, v0, weight                                `pressure_law`

The numbers of the cable laws are those of their `Curvature`. The last two are loads that follow a surface, not elastic. Laws are
called by address, so that a model compiles only its own. `checks.check_law` tests every elastic law.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import IntEnum

import numpy as np

from ..core.entries import call
from ..core.jit import jit
from . import cable_law, membrane_law, pressure_law, shell_law


class Law(IntEnum):
    """Number of an elastic law."""

    QUADRATIC = 0
    MATERIAL = 2
    EXACT = 3
    MEMBRANE = 4
    SHELL = 5
    PRESSURE = 6
    EDGE_PRESSURE = 7


LOADS = (Law.PRESSURE, Law.EDGE_PRESSURE)  #: laws of loads on surfaces and edges, which have no strains
VECTORS = {
    **dict.fromkeys((Law.QUADRATIC, Law.MATERIAL, Law.EXACT, Law.MEMBRANE, Law.EDGE_PRESSURE), 2),
    Law.SHELL: 5,
    Law.PRESSURE: 3,
}  #: derivatives of r that a law reads
ROWS = {
    **dict.fromkeys((Law.QUADRATIC, Law.MATERIAL, Law.EXACT), cable_law.LINES),
    Law.MEMBRANE: membrane_law.LINES,
    Law.SHELL: shell_law.LINES,
    **dict.fromkeys(LOADS, pressure_law.LINES),
}  #: rows of its section


def vectors(law: int) -> int:
    """Number k of derivatives of r that a law reads."""
    return VECTORS[Law(law)]


def rows(law: int) -> int:
    """Number of rows of the section of a law; the last one is the quadrature weight."""
    return ROWS[Law(law)]


KINDS = 3  #: functions of a law
ENERGY, STRESS, MODULUS = range(KINDS)
ENTRIES: dict[Law, tuple[Callable[[], int], ...]] = {
    **dict.fromkeys((Law.QUADRATIC, Law.MATERIAL, Law.EXACT), (cable_law.energy_at, cable_law.stress_at, cable_law.modulus_at)),
    Law.MEMBRANE: (membrane_law.energy_at, membrane_law.stress_at, membrane_law.modulus_at),
    Law.SHELL: (shell_law.energy_at, shell_law.stress_at, shell_law.modulus_at),
    Law.PRESSURE: (pressure_law.energy_at, pressure_law.stress_at, pressure_law.modulus_at),
    Law.EDGE_PRESSURE: (pressure_law.edge_energy_at, pressure_law.edge_stress_at, pressure_law.edge_modulus_at),
}


def addresses(used: Iterable[int]) -> np.ndarray:
    """Where the functions of the laws in use are, (law, kind) flat; zeros for the others, which are not compiled."""
    table = np.zeros((max(Law) + 1, KINDS), dtype=np.int64)
    for law in {Law(number) for number in used}:
        table[law] = [entry() for entry in ENTRIES[law]]
    return table.ravel()


@jit
def call_energy(calls: np.ndarray, law: int, u: np.ndarray, section: np.ndarray) -> float:
    """`energy` in compiled code, with the `addresses` of the laws."""
    W = np.zeros(1)
    call(calls[KINDS * law + ENERGY], (u, u, section, W), (u.shape[0], u.shape[1], u.shape[2], law), 0.0)
    return W[0]


@jit
def call_stress(
    calls: np.ndarray, law: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray
) -> None:
    """`stress` in compiled code, with the `addresses` of the laws."""
    call(calls[KINDS * law + STRESS], (u, rate, section, S), (u.shape[0], u.shape[1], u.shape[2], law), beta)


@jit
def call_modulus(calls: np.ndarray, law: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """`modulus` in compiled code, with the `addresses` of the laws."""
    call(calls[KINDS * law + MODULUS], (u, u, section, D), (u.shape[0], u.shape[1], u.shape[2], law), beta)


def energy(law: int, u: np.ndarray, section: np.ndarray) -> float:
    """Strain energy [J] summed over all points."""
    return float(call_energy(addresses([law]), law, u, section))


def stress(law: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray) -> None:
    """S = weight dW/du (+ damping with time `beta` [s] and jet rates `rate`), shapes (k c, p, e)."""
    call_stress(addresses([law]), law, u, rate, beta, section, S)


def modulus(law: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray) -> None:
    """D = weight d2W/du2 + beta (material part), shape (k c, k c, p, e), symmetric; `beta` [-]: damping time times gh."""
    call_modulus(addresses([law]), law, u, beta, section, D)
