r"""The contract of a strain energy W(u) of gradients u = (r,1 ... r,k): the laws of cable, membrane
and shell, or a user's own.

    S = dW/du,   D = d2W/du2 = D^T,   W(R u) = W(u),   S(R u) = R S(u)                 for rotations R
    W = 0 and S = 0                                                                    where u = R u0
    S_d(u, v) = S(u, v, beta) - S(u, 0, 0) = (D(u, beta) - D(u, 0)) v,   v . S_d >= 0,   S_d = 0 for v = omega x u

with gradients u and rates v (k c, p, e), stresses S (k c, p, e) and moduli D (k c, k c, p, e) as in
`laws`.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.random import Generator

from ..core.errors import InputError, require, say
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from . import laws, strain_law
from .beams import planar
from .cable_law import STRAIGHT
from .laws import STIFFNESS, Law

STEP = 3e-4  #: of the difference quotients, in units of the gradients
POINTS, CELLS = 2, 6  #: tested gradients
BETA = 0.3  #: tested damping time [s]
ROUND = 4 * float(np.finfo(np.float64).eps)  #: of a stress


class Rules(Protocol):
    """Energy, stress, modulus and dissipation of gradients u (k c, p, e) with the section data (i,
    p, e) of a law; see `laws`.
    """

    def energy(self, law: Law, u: np.ndarray, section: np.ndarray, /) -> float: ...

    def stress(
        self,
        law: Law,
        u: np.ndarray,
        rate: np.ndarray,
        beta: float,
        section: np.ndarray,
        S: np.ndarray,
        /,
    ) -> None: ...

    def modulus(
        self, law: Law, u: np.ndarray, beta: float, section: np.ndarray, D: np.ndarray, /
    ) -> None: ...

    def dissipation(
        self, law: Law, u: np.ndarray, rate: np.ndarray, section: np.ndarray, /
    ) -> float: ...


@dataclass(frozen=True)
class LawCase:
    """A law with random sections and gradients, on which the contract is tested."""

    rules: Rules
    law: Law
    dim: int
    section: np.ndarray  #: (i, p, e)
    reference: np.ndarray | None  #: (k c, p, e) gradients free of stress
    gradients: np.ndarray  #: (k c, p, e) deformed gradients
    where: str  #: place in messages
    tolerance: float

    def require(self, name: str, error: float, tolerance: float | None = None) -> None:
        """Refuse an error beyond the tolerance, or one that is not a number."""
        require(self.where, name, error, self.tolerance if tolerance is None else tolerance)

    def energy(self, u: np.ndarray) -> float:
        """[J] of gradients u (k c, p, e), summed over all points."""
        return self.rules.energy(self.law, u, self.section)

    def stress(
        self, u: np.ndarray, rate: np.ndarray | None = None, beta: float = 0.0
    ) -> np.ndarray:
        """S (k c, p, e) of gradients u (k c, p, e) and their rates, with the damping time beta [s]."""
        S = np.zeros_like(u)
        self.rules.stress(self.law, u, u if rate is None else rate, beta, self.section, S)
        return S

    def modulus(self, u: np.ndarray, beta: float = 0.0) -> np.ndarray:
        """D (k c, k c, p, e) of gradients u (k c, p, e), with `beta` [-]."""
        D = np.zeros((len(u), *u.shape))
        self.rules.modulus(self.law, u, beta, self.section, D)
        return D


@checked
def check_law(
    law: Law, dim: int, rules: Rules = laws, tolerance: float = 1e-8, seed: int = 0
) -> None:
    """The contract of a law in 2 or 3 dimensions (`dim`); raises an InputError that names what
    fails.

        S = dW/du,   D = d2W/du2 = D^T,   W(R u) = W(u),   S(R u) = R S(u),   v . S_d >= 0

    `rules` replace those of `laws`. Tested are straight and curved references (straight ones only
    for the quadratic curvature and the membrane) at random gradients. Stiffnesses and weights are
    of order one, so that no part of the energy hides behind another. Errors are relative, up to the
    `tolerance`. InputError, too, where the law does not serve the dimension.

        >>> from fmbs_skfem.bodies import Law, check_law
        >>> check_law(Law.EXACT, dim=2)  # silent: it holds
    """
    where = f"check_law({law.name}, dimension {dim})"
    random = np.random.default_rng(seed)
    if dim not in law.dims:
        raise InputError(say(where, f"dimension {law.dims[0]} for this law", dim))
    for bent in (False,) if law in (Law.QUADRATIC, Law.MEMBRANE) else (False, True):
        section, reference, gradients = samples(law, dim, bent, random)
        case = LawCase(rules, law, dim, section, reference, gradients, where, tolerance)
        check_derivatives(case, random)
        check_rotation(case, random)
        check_damping(case, random)
        check_dissipation(case, random)


def samples(
    law: Law, dim: int, bent: bool, random: Generator
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Random sections (i, p, e) of a law, reference gradients, where they are known, and deformed
    ones (k c, p, e).

    `bent` ones have curvatures in the reference.
    """
    if law in (Law.MEMBRANE, Law.SHELL):
        section = surface_sections(random, law, bent)
        return (
            section,
            surface_reference(random, section, dim),
            surface_gradients(random, law.vectors, dim),
        )
    if law.fields > 1:
        return *beam_samples(random, law, dim), surface_gradients(random, law.vectors, dim)
    if law.bends:
        section = cable_sections(random, dim, bent)
        return section, cable_reference(section, dim), cable_gradients(random, dim)
    section = random.uniform(0.5, 2.0, (law.rows, POINTS, CELLS))
    if law is Law.SOLID:
        section[: len(STIFFNESS)] = stiffnesses(random)
    return section, None, surface_gradients(random, law.vectors, dim)


def stiffnesses(random: Generator, count: int = 6) -> np.ndarray:
    """Upper triangles (i, p, e) of positive stiffnesses between so many strains."""
    A = random.normal(size=(count, count, POINTS, CELLS))
    return np.asarray(np.einsum("ikpe,jkpe->ijpe", A, A)[np.triu_indices(count)])


def beam_samples(random: Generator, law: Law, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Sections (i, p, e) of beams with coupled strains, and their random reference gradients (k c,
    p, e), curved and sheared.
    """
    reference = random.normal(size=(law.vectors * dim, POINTS, CELLS))
    section = random.uniform(0.5, 2.0, (law.rows, POINTS, CELLS))
    counts = {Law.BEAM: 6, Law.WARPED_BEAM: 8, Law.PLANAR_BEAM: 3}
    stiffness = stiffnesses(random, counts[law])
    section[: len(stiffness)] = stiffness
    measure = strain_law.strains if dim == 3 else planar.strains
    start = measure(reference.reshape(law.vectors, dim, POINTS, CELLS))
    first = law.section.index("gamma1")
    section[first : first + len(start)] = start
    return section, reference


def cable_sections(random: Generator, dim: int, bent: bool) -> np.ndarray:
    """EA, EI, kappa0 and weight, (4, p, e); kappa0 has both signs in the plane."""
    section = random.uniform(0.5, 2.0, (4, POINTS, CELLS))
    section[2] *= random.choice([-1.0, 1.0], (POINTS, CELLS)) if dim == 2 else 1.0
    section[2] *= bent
    return section


def cable_reference(section: np.ndarray, dim: int) -> np.ndarray:
    """References of a cable with the curvature of a section.

        r0' = e_x,    r0'' = kappa0 e_y

    (2c, p, e).
    """
    u = np.zeros((2 * dim, *section.shape[1:]))
    u[0], u[dim + 1] = 1.0, section[2]
    return u


def cable_gradients(random: Generator, dim: int) -> np.ndarray:
    """Random gradients of a cable.

        0.7 <= |r'| <= 1.3

    (2c, p, e).
    """
    u = random.normal(size=(2 * dim, POINTS, CELLS))
    u[:dim] *= random.uniform(0.7, 1.3, (POINTS, CELLS)) / np.linalg.norm(u[:dim], axis=0)
    return u


def surface_sections(random: Generator, law: Law, bent: bool) -> np.ndarray:
    """A, nu, weight (3, p, e) of a membrane; A, B, nu, b0_11, b0_22, b0_12, weight (7, p, e) of a
    shell.
    """
    section = random.uniform(0.5, 2.0, (law.rows, POINTS, CELLS))
    section[1 if law is Law.MEMBRANE else 2] = random.uniform(0.0, 0.45, (POINTS, CELLS))
    if law is Law.SHELL:
        section[3:6] = bent * random.uniform(-1.0, 1.0, (3, POINTS, CELLS))
    return section


def surface_reference(random: Generator, section: np.ndarray, dim: int) -> np.ndarray:
    """References of a shell (k c, p, e), with the normal parts b0_ij of a section and any
    tangential parts.

        r0,1 = e_x,    r0,2 = e_y,    n.r0,ij = b0_ij
    """
    tangents = np.zeros((2, dim, *section.shape[1:]))
    tangents[0, 0], tangents[1, 1] = 1.0, 1.0
    if dim == 2:
        return tangents.reshape(4, *section.shape[1:])
    second = random.normal(size=(3, dim, *section.shape[1:]))
    second[:, 2] = section[3:6]
    return np.concatenate([tangents, second]).reshape(15, *section.shape[1:])


def surface_gradients(random: Generator, vectors: int, dim: int) -> np.ndarray:
    """Random gradients with strains up to about one half, (k c, p, e)."""
    u = random.normal(size=(vectors, dim, POINTS, CELLS))
    u[:2] = np.eye(2, dim)[:, :, None, None] + random.uniform(-0.3, 0.3, (2, dim, POINTS, CELLS))
    return rotate(turn(random, dim), u.reshape(-1, POINTS, CELLS))


def check_derivatives(case: LawCase, random: Generator) -> None:
    """S . w and D w against fourth-order differences of W and S along random directions w; D
    symmetric.
    """
    u = case.gradients
    S = case.stress(u)
    D = case.modulus(u)
    for w in random.normal(size=(4, *u.shape)):
        ahead = {k: u + k * STEP * w for k in (-2, -1, 1, 2)}
        W = {k: case.energy(v) for k, v in ahead.items()}
        slope = (8 * (W[1] - W[-1]) - (W[2] - W[-2])) / (12 * STEP)
        case.require(
            "stress against the energy",
            abs(float(np.sum(S * w)) - slope) / float(np.abs(S * w).sum()),
        )
        T = {k: case.stress(v) for k, v in ahead.items()}
        change = (8 * (T[1] - T[-1]) - (T[2] - T[-2])) / (12 * STEP)
        error = np.abs(np.einsum("ijpe,jpe->ipe", D, w) - change).max() / np.abs(change).max()
        case.require("modulus against the stress", float(error))
    case.require("symmetry of the modulus", float(np.abs(D - D.transpose(1, 0, 2, 3)).max()), 0.0)


def check_rotation(case: LawCase, random: Generator) -> None:
    """A rotation of the reference costs no energy and gives no stress; a rotation of any gradients
    turns their stress.
    """
    R = turn(random, case.dim)
    if case.reference is not None:
        rigid = rotate(R, case.reference)
        case.require("energy of a rigid rotation", abs(case.energy(rigid)))
        case.require("stress of a rigid rotation", float(np.abs(case.stress(rigid)).max()))
    turned = rotate(R, case.gradients)
    S = case.stress(case.gradients)
    case.require(
        "energy of rotated gradients", abs(case.energy(turned) / case.energy(case.gradients) - 1.0)
    )
    error = np.abs(case.stress(turned) - rotate(R, S)).max() / np.abs(S).max()
    case.require("stress of rotated gradients", float(error))


def turn(random: Generator, dim: int) -> np.ndarray:
    """A random rotation (c, c)."""
    from scipy.spatial.transform import Rotation

    if dim == 3:
        return np.asarray(Rotation.random(rng=random).as_matrix())
    angle = random.uniform(-np.pi, np.pi)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def rotate(R: np.ndarray, u: np.ndarray) -> np.ndarray:
    """R applied to every vector of gradients (k c, p, e)."""
    vectors = u.reshape(-1, len(R), *u.shape[1:])
    return np.ascontiguousarray(np.einsum("cd,kdpe->kcpe", R, vectors).reshape(u.shape))


def check_damping(case: LawCase, random: Generator) -> None:
    """Damping stress: linear in the rate with its modulus, dissipates, vanishes (cable in space: is
    bounded) for rigid rates.
    """
    u = case.gradients
    rates = random.normal(size=(4, *u.shape))
    S = case.stress(u)
    C = case.modulus(u, BETA) - case.modulus(u)
    if not C.any() and not (case.stress(u, rates[0], BETA) - S).any():
        return  # a law without damping
    for rate in rates:
        damped = case.stress(u, rate, BETA) - S
        error = np.abs(damped - np.einsum("ijpe,jpe->ipe", C, rate)).max() / np.abs(damped).max()
        case.require("damping stress against its modulus", float(error))
        power = np.sum(damped * rate, axis=0)
        case.require(
            "damping dissipates (largest gain of energy)", float(-power.min() / np.abs(power).max())
        )
    spin = random.normal(size=(case.dim, case.dim))
    turning = rotate(spin - spin.T, u)
    still = case.stress(u, turning, BETA) - S
    if not case.law.bends or (case.dim == 2 and case.law is not Law.QUADRATIC):
        case.require("damping of a rigid rotation", float(np.abs(still).max() / np.abs(S).max()))
        return
    bound = (
        BETA
        * case.section[0]
        * case.section[3]
        * STRAIGHT
        * float(np.sum((spin - spin.T) ** 2))
        / 2.0
    )
    # of the stress without damping, from which little is left
    rounding = ROUND * np.sum(np.abs(S * turning), axis=0)
    excess = (np.sum(still * turning, axis=0) - rounding) / bound - 1.0
    case.require(
        "power of the damping in a rigid rotation over its bound beta EI s^2 omega^2",
        float(excess.max()),
    )


def check_dissipation(case: LawCase, random: Generator) -> None:
    """The dissipation is the power of the damping stress."""
    u = case.gradients
    rate = random.normal(size=case.gradients.shape)
    power = float(np.sum((case.stress(u, rate, BETA) - case.stress(u)) * rate))
    heat = BETA * case.rules.dissipation(case.law, u, rate, case.section)
    case.require(
        "dissipation against the power of the damping stress",
        abs(heat - power) / (abs(power) or 1.0),
    )
