r"""What a beam with torsion and shear needs of its cross-section: Saint-Venant's torsion and
flexure on a mesh of it.

    area, centroid, I = int rho rho^T dA,    J,    shear centre c,    shear area k A

With the functions f_a, h_a of `saint_venant`, the shear centre is Trefftz's: c x V = int rho x tau
at nu = 0, so that torsion and shear do no work on each other. The shear flexibility F = (k A)^-1 in
G gamma = F V is, by the choice of `Shear`,

    ENERGY    4 F = I^-1 [int grad f_a . grad f_b] I^-1
    COWPER    4 F = I^-1 [int grad f_a . grad f_b + nu/(1 + nu) int grad f_a . (h_b - mean h_b)] I^-1

COWPER is of the mean deflection and the mean rotation of a section: k = (6 + 6 nu)/(7 + 6 nu) of
circles and (10 + 10 nu)/(12 + 11 nu) of all rectangles. ENERGY is of the deflection weighted by the
shear stress of nu = 0, whose energy is V.F V / (2 G): k = 6/7 of circles, 5/6 of rectangles, and F
is symmetric and positive for all sections. Cowper's is neither: it is no symmetric matrix without
an axis of symmetry, and negative on tall I-sections, whose webs bulge between the flanges. What nu
adds to the energy, that of the self-equilibrated stresses of g_a, is in stresses, but in neither F:
at nu = 0.3 it would make a strip 100 times as wide as thick 436 times softer in shear, by an
anticlastic bending whose change along the beam most ends and neighbours prevent.

Forces S = (N, V_y, V_z, T, M_y, M_z) at the origin, where the beam's line passes, and strains
(gamma_x, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z) with the axial strain gamma_x + z kappa_y - y
kappa_z at a point and gamma_y - z kappa_x, gamma_z + y kappa_x.

Of a beam that warps (B, W) stand behind S, and the change of torsion and its square, less those of
the reference, behind the strains: the axial strain at a point is

    gamma_x + z kappa_y - y kappa_z + omega kappa_x' + s^2/2 kappa_x^2

with the warping omega and the distance s from the shear centre: B is the bimoment, W what tension adds
to torsion (N I_p / A: the trapeze effect). V. Z. Vlasov, Thin-Walled Elastic Beams, 2nd ed., Israel
Program for Scientific Translations 1961 (B); D. H. Hodges, Nonlinear Composite Beam Theory, AIAA 2006,
doi:10.2514/4.866821, ch. 4 (W).

G. R. Cowper, J. Appl. Mech. 33 (1966) 335-340, doi:10.1115/1.3625046; E. Trefftz, Z. angew. Math.
Mech. 15 (1935) 220-225, doi:10.1002/zamm.19350150405; F. Gruttmann, W. Wagner, Comput. Mech. 27
(2001) 199-207, doi:10.1007/s004660100239 (the energy, with its part of nu).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...shapes.table import Floats
from .. import stress_recovery
from . import saint_venant
from .saint_venant import Integrals, Solution
from .section_shapes import Outline, Shear

SYMMETRIC = 1e-3  #: relative asymmetry of Cowper's matrix that is an error of the mesh
AXIAL = [0, 4, 5]  #: places of N, M_y, M_z in S
WARPED = [*AXIAL, 6, 7]  #: of these, B and W
ROUND = 1e-9  #: int omega^2 dA over J A of a section that does not warp
SHEAR = [1, 2, 3]  #: of V_y, V_z, T


@dataclass(frozen=True, eq=False)
class SectionConstants:
    """Constants of a section about an origin, with y and z from there; see the module."""

    poisson_ratio: float
    area: float  #: A [m2]
    centroid: Floats  #: (2,) y, z [m]
    inertia: Floats  #: (2, 2) int rho rho^T dA about the centroid: Izz, Iyz; Iyz, Iyy [m4]
    torsion: float  #: J [m4]
    shear_centre: Floats  #: (2,) y, z [m]
    shear_area: (
        Floats  #: (2, 2) F^-1 = kA [m2]: forces G kA (gamma_y, gamma_z) through the shear centre
    )
    #: (n, 2) loops, the outer one first, with the material on the left [m]
    outline: tuple[Floats, ...]
    unit_stresses: Floats  #: (3, 6, n) sigma_x, tau_xy, tau_xz of each of S = 1 at all points of the outline [1/m2, 1/m3]
    fibres: Floats  #: (5, 5) int g g^T dA of g = (1, z, -y, omega, s^2/2) [m2 to m6]
    warped_stresses: Floats  #: (3, 8, n) unit_stresses of a beam that warps
    error: float  #: estimated relative error of J, the shear centre and the shear area

    @property
    def Iyy(self) -> float:
        """Second moment of the area about y [m4].

            Iyy = int z^2 dA

        y and z from the centroid.
        """
        return float(self.inertia[1, 1])

    @property
    def Izz(self) -> float:
        """Second moment of the area about z [m4].

            Izz = int y^2 dA

        y and z from the centroid.
        """
        return float(self.inertia[0, 0])

    @property
    def Iyz(self) -> float:
        """Product moment of the area [m4].

            Iyz = int y z dA

        y and z from the centroid.
        """
        return float(self.inertia[0, 1])


def constants(
    outline: Outline, poisson_ratio: float, origin: ArrayLike | None = None
) -> SectionConstants:
    """The constants of a section about a point (2,) of its drawing [m], by default its centroid.

    An outline is solved once in a process. InputError: a ratio outside -1 to 0.5, and Cowper's
    definition on an outline that it does not fit.
    """
    nu = float(poisson_ratio)
    if not -1.0 < nu <= 0.5:
        raise InputError(say("section.poisson_ratio", "a number above -1 and up to 0.5", nu))
    solved = saint_venant.solve(outline)
    over = solved.over
    about = over.centroid if origin is None else np.asarray(origin, dtype=float)
    if about.shape != (2,) or not np.isfinite(about).all():
        raise InputError(say("section.origin", "a point (y, z) of finite numbers", origin))
    u, v = np.linalg.solve(over.inertia, over.torque[0]) / 2.0
    centroid = over.centroid - about
    turn = np.eye(5)
    turn[1:3, :3] = [[centroid[1], 0.0, 1.0], [-centroid[0], -1.0, 0.0]]
    unit = _unit_stresses(solved, nu, centroid)
    return SectionConstants(
        nu,
        over.area,
        centroid,
        over.inertia,
        over.torsion,
        centroid + np.array([v, -u]),
        np.asarray(np.linalg.inv(_flexibility(over, nu, outline.shear))),
        tuple(loop - about for loop in solved.loops),
        unit,
        turn @ over.fibres @ turn.T,
        _warped_stresses(solved, unit, turn),
        solved.error,
    )


def stiffness(section: SectionConstants, young_modulus: float) -> Floats:
    """The matrix (6, 6) that takes strains to forces S, of a Young's modulus E [Pa].

        (N, M_y, M_z) = E int g g^T dA (gamma_x, kappa_y, kappa_z),    g = (1, z, -y)

    V and T follow from the shear strains at the shear centre (y_c, z_c):

        gamma_y - z_c kappa_x,    gamma_z + y_c kappa_x
    """
    y, z = section.shear_centre
    at_centre = np.array([[1.0, 0.0, -z], [0.0, 1.0, y], [0.0, 0.0, 1.0]])
    own = np.zeros((3, 3))
    own[:2, :2], own[2, 2] = section.shear_area, section.torsion
    found = np.zeros((6, 6))
    found[np.ix_(AXIAL, AXIAL)] = young_modulus * _bending(
        section.area, section.centroid, section.inertia
    )
    found[np.ix_(SHEAR, SHEAR)] = (
        young_modulus / (2.0 * (1.0 + section.poisson_ratio)) * at_centre.T @ own @ at_centre
    )
    return found


def warped(section: SectionConstants, young_modulus: float) -> Floats:
    """The matrix (8, 8) of a beam that warps, that of `stiffness` with B and W behind it.

    InputError of sections that do not warp.
    """
    if section.fibres[3, 3] <= ROUND * section.torsion * section.area:
        remedy = "delete `warping`"
        raise InputError(say("section", "one that warps, for `warping`", "a round one", remedy))
    found = np.zeros((8, 8))
    found[:6, :6] = stiffness(section, young_modulus)
    found[np.ix_(WARPED, WARPED)] = young_modulus * section.fibres
    return found


def mass(section: SectionConstants, density: float) -> Floats:
    """Mass matrix (3, 3) of a section.

        int rho (1, y, z)^T (1, y, z) dA

    [kg/m, kg, kg m], of a density rho [kg/m3].
    """
    return density * _moments(section.area, section.centroid, section.inertia)


def stresses(section: SectionConstants, forces: ArrayLike) -> Floats:
    """Stresses [Pa] at all n points of the outline, of forces S (6, ...) [N, N m] at the origin.

        sigma_x, tau_xy, tau_xz    (3, n, ...)

    Shear stresses have no bound at corners that point inwards, which real sections round off: there
    they are the mean of those at both neighbours, as at the corners of a polygon that stands for a
    curve. Warping is free: no bimoments.
    """
    return np.asarray(
        np.einsum("xfn,f...->xn...", section.unit_stresses, np.asarray(forces, dtype=float))
    )


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress (...) [Pa] of the stresses in a section.

        sqrt(sigma_x^2 + 3 (tau_xy^2 + tau_xz^2))

    `stress` holds sigma_x, tau_xy, tau_xz (3, ...).
    """
    return stress_recovery.von_mises(
        np.stack([stress[0], np.zeros_like(stress[0]), np.hypot(stress[1], stress[2])])
    )


# ------------------------------------------------------------------------------------------- what follows from the solutions
def _moments(area: float, centroid: Floats, inertia: Floats) -> Floats:
    """Int (1, y, z)^T (1, y, z) dA (3, 3)."""
    first = np.append(1.0, centroid)
    found = area * np.outer(first, first)
    found[1:, 1:] += inertia
    return found


def _bending(area: float, centroid: Floats, inertia: Floats) -> Floats:
    """Int g g^T dA (3, 3), g = (1, z, -y)."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return turn @ _moments(area, centroid, inertia) @ turn.T


def _flexibility(over: Integrals, nu: float, choice: Shear) -> Floats:
    """F (2, 2) [1/m2]."""
    inverse = np.linalg.inv(over.inertia)
    if choice is Shear.ENERGY:
        return 0.25 * inverse @ over.energy @ inverse
    cowper = 0.25 * inverse @ (over.energy + nu / (1.0 + nu) * over.bulge) @ inverse
    remedy = "take Shear.ENERGY"
    if abs(cowper[0, 1] - cowper[1, 0]) > SYMMETRIC * np.abs(cowper).max():
        raise InputError(
            say(
                "section.shear",
                "an axis of symmetry for Cowper's shear coefficients",
                "a section without",
                remedy,
            )
        )
    cowper = 0.5 * (cowper + cowper.T)
    least = np.linalg.eigvalsh(cowper)[0]
    if least <= 0.0:
        got = f"{1.0 / (least * over.area):.3g} of a section whose walls bulge more than they shear"
        raise InputError(say("section.shear", "positive shear coefficients by Cowper", got, remedy))
    return cowper


def _warped_stresses(solved: Solution, unit: Floats, turn: Floats) -> Floats:
    """`unit` stresses (3, 6, n) with those of B and W behind them, (3, 8, n); `turn` (5, 5) is that
    from the functions of `Integrals.fibres` to g.
    """
    found = np.concatenate([unit, np.zeros((3, 2, unit.shape[2]))], axis=1)
    rho = np.concatenate(solved.loops).T - solved.over.centroid[:, None]
    functions = turn @ np.stack([np.ones(rho.shape[1]), *rho, *solved.warped])
    found[0, WARPED] = np.linalg.pinv(turn @ solved.over.fibres @ turn.T) @ functions
    return found


def _unit_stresses(solved: Solution, nu: float, centroid: Floats) -> Floats:
    """sigma_x, tau_xy, tau_xz of each of S = 1 at the points of the outline (3, 6, n), with the
    centroid (2,) from the origin.
    """
    over = solved.over
    rho = np.concatenate(solved.loops).T - over.centroid[:, None]
    y, z = rho + centroid[:, None]
    found = np.zeros((3, 6, rho.shape[1]))
    bending = _bending(over.area, centroid, over.inertia)
    found[0, AXIAL] = np.linalg.solve(bending, np.stack([np.ones_like(y), z, -y]))
    parts = 0.5 * np.array([1.0, nu / (1.0 + nu)])
    inverse = np.linalg.inv(over.inertia)
    flow = np.einsum("k,kacn,ab->cbn", parts, solved.flexed, inverse)
    # a force through the origin has the torque -(centroid x V) about the centroid, of which the
    # flexure has its own part
    missing = np.array([centroid[1], -centroid[0]]) - parts @ over.torque @ inverse
    twist = solved.twisted / over.torsion
    found[1:, 1:3] = flow + twist[:, None] * missing[:, None]
    found[1:, 3] = twist
    return found
