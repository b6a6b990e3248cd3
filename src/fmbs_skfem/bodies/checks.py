r"""The contract of a strain energy W(u) of jets u = (r', r''), here the cable law of every curvature measure, or a user's own.

    S = dW/du,   D = d2W/du2 = D^T,   W(R u) = W(u),   S(R u) = R S(u)                 for rotations R
    W = 0 and S = 0                                                                    where u = R u0
    S_d(u, v) = S(u, v, beta) - S(u, 0, 0) = (D(u, beta) - D(u, 0)) v,   v . S_d >= 0,   S_d = 0 for v = omega x u

with jets u and rates v (2c, p, e), stresses S (2c, p, e) and moduli D (2c, 2c, p, e) as in `cable_law`.
"""

from __future__ import annotations

from typing import Protocol, cast

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ..core.errors import InputError, say
from . import cable_law
from .cable_law import STRAIGHT, Curvature

STEP = 3e-4  #: of the difference quotients, in units of the jets
POINTS, CELLS = 2, 6  #: tested jets


class Law(Protocol):
    """Energy, stress and modulus of jets u (2c, p, e) with the section data (4, p, e); see `cable_law`."""

    def energy(self, curvature: int, u: np.ndarray, section: np.ndarray, /) -> float: ...

    def stress(
        self, curvature: int, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray, S: np.ndarray, /
    ) -> None: ...

    def modulus(self, curvature: int, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray, /) -> None: ...


CABLE = cast(Law, cable_law)


def check_law(curvature: Curvature, dim: int, law: Law = CABLE, tolerance: float = 1e-8, seed: int = 0) -> None:
    """The contract of a law with a curvature measure in 2 or 3 dimensions; raises an InputError that names what fails.

    Tested are straight and curved references (straight ones only for the quadratic curvature) at random jets. EA, EI and weights
    are of order one, so that no part of the energy hides behind another.
    """
    where, random = f"check_law({curvature.name}, dimension {dim})", np.random.default_rng(seed)
    for bent in (False, True) if curvature is not Curvature.QUADRATIC else (False,):
        section = sections(random, dim, bent)
        u0, u = reference_jets(section, dim), deformed_jets(random, dim)
        check_derivatives(where, law, curvature, u, section, random, tolerance)
        check_rotation(where, law, curvature, u0, u, section, random, tolerance)
        check_damping(where, law, curvature, u, section, random, tolerance)


def require(where: str, name: str, error: float, tolerance: float) -> None:
    """Refuse an error beyond the tolerance, or one that is not a number."""
    if not error <= tolerance:
        remedy = "correct the rules of this type"
        raise InputError(say(f"{where}: {name}", f"an error of at most {tolerance:.1e}", f"{error:.3e}", remedy))


def sections(random: Generator, dim: int, bent: bool) -> np.ndarray:
    """EA, EI, kappa0 and weight of random sections, (4, p, e); kappa0 has both signs in the plane."""
    section = random.uniform(0.5, 2.0, (4, POINTS, CELLS))
    section[2] *= random.choice([-1.0, 1.0], (POINTS, CELLS)) if dim == 2 else 1.0
    section[2] *= bent
    return section


def reference_jets(section: np.ndarray, dim: int) -> np.ndarray:
    """r0' = e_x, r0'' = kappa0 e_y, (2c, p, e)."""
    u = np.zeros((2 * dim, *section.shape[1:]))
    u[0], u[dim + 1] = 1.0, section[2]
    return u


def deformed_jets(random: Generator, dim: int) -> np.ndarray:
    """Random jets with |r'| between 0.7 and 1.3, (2c, p, e)."""
    u = random.normal(size=(2 * dim, POINTS, CELLS))
    u[:dim] *= random.uniform(0.7, 1.3, (POINTS, CELLS)) / np.linalg.norm(u[:dim], axis=0)
    return u


def stress_of(law: Law, curvature: Curvature, u: np.ndarray, rate: np.ndarray, beta: float, section: np.ndarray) -> np.ndarray:
    S = np.zeros_like(u)
    law.stress(int(curvature), u, rate, beta, section, S)
    return S


def modulus_of(law: Law, curvature: Curvature, u: np.ndarray, beta: float, section: np.ndarray) -> np.ndarray:
    D = np.zeros((len(u), *u.shape))
    law.modulus(int(curvature), u, beta, section, D)
    return D


def check_derivatives(
    where: str, law: Law, curvature: Curvature, u: np.ndarray, section: np.ndarray, random: Generator, tolerance: float
) -> None:
    """S . w and D w against fourth-order differences of W and S along random directions w; D symmetric."""
    S, D = stress_of(law, curvature, u, u, 0.0, section), modulus_of(law, curvature, u, 0.0, section)
    for w in random.normal(size=(4, *u.shape)):
        ahead = {k: u + k * STEP * w for k in (-2, -1, 1, 2)}
        W = {k: law.energy(int(curvature), v, section) for k, v in ahead.items()}
        slope = (8 * (W[1] - W[-1]) - (W[2] - W[-2])) / (12 * STEP)
        require(where, "stress against the energy", abs(float(np.sum(S * w)) - slope) / float(np.abs(S * w).sum()), tolerance)
        T = {k: stress_of(law, curvature, v, v, 0.0, section) for k, v in ahead.items()}
        change = (8 * (T[1] - T[-1]) - (T[2] - T[-2])) / (12 * STEP)
        error = np.abs(np.einsum("ijpe,jpe->ipe", D, w) - change).max() / np.abs(change).max()
        require(where, "modulus against the stress", float(error), tolerance)
    require(where, "symmetry of the modulus", float(np.abs(D - D.transpose(1, 0, 2, 3)).max()), 0.0)


def check_rotation(
    where: str,
    law: Law,
    curvature: Curvature,
    u0: np.ndarray,
    u: np.ndarray,
    section: np.ndarray,
    random: Generator,
    tolerance: float,
) -> None:
    """A rotation of the reference costs no energy and gives no stress; a rotation of any jets turns their stress."""
    dim = len(u) // 2
    R = turn(random, dim)
    rigid = rotated(R, u0)
    require(where, "energy of a rigid rotation", abs(law.energy(int(curvature), rigid, section)), tolerance)
    S = stress_of(law, curvature, rigid, rigid, 0.0, section)
    require(where, "stress of a rigid rotation", float(np.abs(S).max()), tolerance)
    W, turned = law.energy(int(curvature), u, section), rotated(R, u)
    require(where, "energy of rotated jets", abs(law.energy(int(curvature), turned, section) / W - 1.0), tolerance)
    S = stress_of(law, curvature, u, u, 0.0, section)
    error = np.abs(stress_of(law, curvature, turned, turned, 0.0, section) - rotated(R, S)).max() / np.abs(S).max()
    require(where, "stress of rotated jets", float(error), tolerance)


def turn(random: Generator, dim: int) -> np.ndarray:
    """A random rotation (c, c)."""
    if dim == 3:
        return np.asarray(Rotation.random(rng=random).as_matrix())
    angle = random.uniform(-np.pi, np.pi)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def rotated(R: np.ndarray, u: np.ndarray) -> np.ndarray:
    """R applied to both halves of jets (2c, p, e)."""
    halves = u.reshape(2, len(R), *u.shape[1:])
    return np.ascontiguousarray(np.einsum("cd,kdpe->kcpe", R, halves).reshape(u.shape))


def check_damping(
    where: str, law: Law, curvature: Curvature, u: np.ndarray, section: np.ndarray, random: Generator, tolerance: float
) -> None:
    """Damping stress: linear in the rate with its modulus, dissipates, vanishes (in space: is bounded) for rigid rates."""
    dim, beta = len(u) // 2, 0.3
    rates, S = random.normal(size=(4, *u.shape)), stress_of(law, curvature, u, u, 0.0, section)
    C = modulus_of(law, curvature, u, beta, section) - modulus_of(law, curvature, u, 0.0, section)
    for rate in rates:
        damped = stress_of(law, curvature, u, rate, beta, section) - S
        error = np.abs(damped - np.einsum("ijpe,jpe->ipe", C, rate)).max() / np.abs(damped).max()
        require(where, "damping stress against its modulus", float(error), tolerance)
        power = np.sum(damped * rate, axis=0)
        require(where, "damping dissipates (largest gain of energy)", float(-power.min() / np.abs(power).max()), tolerance)
    spin = random.normal(size=(dim, dim))
    turning = rotated(spin - spin.T, u)
    still = stress_of(law, curvature, u, turning, beta, section) - S
    if dim == 2 and curvature is not Curvature.QUADRATIC:
        require(where, "damping of a rigid rotation", float(np.abs(still).max() / np.abs(S).max()), tolerance)
        return
    bound = beta * section[1] * section[3] * STRAIGHT * float(np.sum((spin - spin.T) ** 2)) / 2.0
    excess = np.sum(still * turning, axis=0) / bound - 1.0
    require(where, "power of the damping in a rigid rotation over its bound beta EI s^2 omega^2", float(excess.max()), tolerance)
