r"""Strain, curvature and stress fields of membranes and shells, from gradients at any points.

    E_ab = (r,a.r,b - delta_ab)/2,   k_ab = -(n.r,ab - b0_ab),   E(z) = E + z k,   z in [-t/2, t/2] along n
    N = A C:E,   M = B C:k,   S(z) = N/t + 12 z M/t^3,   sigma_v^2 = S11^2 - S11 S22 + S22^2 + 3 S12^2

S is the second Piola-Kirchhoff stress in the orthonormal reference tangents of the point; sigma_v
is the von Mises stress of plane stress, which is that of the Cauchy stress where strains are small.
Tensors are stored by their components 11, 22, 12.

Arrays: gradients `u` (4 or 15, ...) of `laws.Law.MEMBRANE` or `SHELL`, `section` (3 or 7, ...) with
the same points, in any shape, behind.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from . import strain_law
from .beams import planar
from .cable_law import curvatures as curvatures_of_lines
from .laws import Law
from .solids import solid_law

COMPONENTS = {Law.MEMBRANE: 2, Law.SHELL: 3}  #: c of the laws with fields
NU = {Law.MEMBRANE: 1, Law.SHELL: 2}  #: row of the section that holds Poisson's ratio


@dataclass(frozen=True)
class RecoveredFields:
    """RecoveredFields of a membrane or shell at points of any shape (...), the last axes of all
    arrays.

    Components of tensors are 11, 22, 12 in the orthonormal reference tangents of the point.
    """

    strain: np.ndarray  #: (3, ...) Green-Lagrange strain of the middle surface [-]
    curvature: np.ndarray  #: (3, ...) change of curvature [1/m]; zero for a membrane
    #: (3, 3, ...) second Piola-Kirchhoff stress [Pa]: level z = -t/2, 0, t/2, then component
    stress: np.ndarray
    von_mises: np.ndarray  #: (2, ...) von Mises stress [Pa] on the faces z = -t/2 and t/2


def recover(
    law: Law, u: np.ndarray, section: np.ndarray, thickness: float | np.ndarray
) -> RecoveredFields:
    """All fields (.., ...) at points of any shape (...), from gradients u (k c, ...), section (i,
    ...) and thickness [m].

        E = (r,a.r,b - delta_ab)/2,   k_ab = -(n.r,ab - b0_ab),   S(z) = N/t + 12 z M/t^3,   z = -t/2, 0, t/2

    The law is MEMBRANE (k c = 4, i = 3) or SHELL (15, 7). The thickness is a number or one for
    every point; InputError names other laws and shapes that do not fit. Sources as of the module.
    """
    check_shapes(law, u, section, thickness)
    strain = strains(u, COMPONENTS[law])
    change = curvatures(law, u, section)
    levels = stresses(law, strain, change, section, thickness)
    return RecoveredFields(strain, change, levels, von_mises(levels[[0, 2]].swapaxes(0, 1)))


def check_shapes(
    law: Law, u: np.ndarray, section: np.ndarray, thickness: float | np.ndarray
) -> None:
    """InputError for other laws, other shapes than u (k c, ...) and section (i, ...), and a
    thickness that is not positive.
    """
    where = "fields.recover"
    if law not in COMPONENTS:
        raise InputError(say(where, "the law MEMBRANE or SHELL", law.name))
    expected = (law.vectors * COMPONENTS[law], law.rows)
    if (len(u), len(section)) != expected or u.shape[1:] != section.shape[1:]:
        wanted = f"gradients and section with {expected} rows at the same points"
        raise InputError(say(where, wanted, f"{u.shape}, {section.shape}"))
    if not np.all(np.asarray(thickness) > 0.0):
        raise InputError(say(where, "a positive thickness [m]", thickness))


def strains(u: np.ndarray, dim: int) -> np.ndarray:
    """Green-Lagrange strain (3, ...) as 11, 22, 12 [-] of gradients u (k c, ...).

        E_ab = (r,a.r,b - delta_ab)/2

    `dim` is c; of the vectors of u the first two are read.
    """
    a, b = u[:dim], u[dim : 2 * dim]
    return 0.5 * np.stack(
        [np.sum(a * a, axis=0) - 1.0, np.sum(b * b, axis=0) - 1.0, np.sum(a * b, axis=0)]
    )


def principal(tensor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal values s1 >= s2 (...) of symmetric tensors 11, 22, 12 (3, ...).

        s = (s11 + s22)/2 +- sqrt((s11 - s22)^2/4 + s12^2)

    They have the unit of the tensor.
    """
    middle = 0.5 * (tensor[0] + tensor[1])
    radius = np.hypot(0.5 * (tensor[0] - tensor[1]), tensor[2])
    return middle + radius, middle - radius


def principal_strains(law: Law, u: np.ndarray, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """The largest and the smallest principal value (...) of Green's strain of a surface or solid [-],
    of gradients u (k c, ...).
    """
    if solid_law.is_solid(law):
        values = solid_law.principal(solid_law.strains(u))
        return values[0], values[2]
    return principal(strains(u, dim))


def extreme_strains(law: Law, section: np.ndarray, u: np.ndarray, dim: int) -> np.ndarray:
    """Axial strains (r'.r' - 1)/2 of a line at the points that carry its axial force, or principal
    strains.

    Principal ones are those of a surface, and of r' and the section of a beam, at the points that
    carry its axial force:

        E = ((r'.r' - 1)/2, gamma/2; gamma/2, 0),    r' = (1 + Gamma_1) d_1 + Gamma_2 d_2 + Gamma_3 d_3,    gamma = |Gamma_2,3|

    These are all smaller ones and then all larger ones, of gradients u (k c, ...) at points with
    the section (i, ...), `dim` = c.
    """
    if law.tangents:
        largest, smallest = principal_strains(law, u, dim)
    elif law.fields > 1:
        axial, *across = beam_strains(u, section)[:3, carrying(law, section)]
        shear = np.hypot(*across)
        largest, smallest = principal(
            0.5 * np.stack([(1.0 + axial) ** 2 + shear**2 - 1.0, np.zeros_like(axial), shear])
        )
    else:
        return np.asarray(0.5 * (np.sum(u[:dim] ** 2, axis=0) - 1.0))[carrying(law, section)]
    return np.concatenate([smallest, largest])


def carrying(law: Law, section: np.ndarray) -> np.ndarray:
    """Which points (...) of a line with the section (i, ...) carry its axial force, see
    `shapes.locking`.

    Where the section changes, EA is held against sqrt(EI), as which it falls with the thickness.
    """
    axial = np.abs(section[0])
    if {"EA", "EI"} <= set(law.section):
        axial = np.abs(section[law.section.index("EA")]) / np.sqrt(
            np.abs(section[law.section.index("EI")])
        )
    return np.asarray(axial >= 0.5 * axial.mean())


def fibre_strains(
    law: Law, u: np.ndarray, start: np.ndarray, section: np.ndarray, depth: float | np.ndarray
) -> np.ndarray:
    """Largest size of the strains along fibres (e, s) in the cells of a line or surface, of
    gradients u (k c, p, e, s).

        lines       max_p |(r'.r' - 1)/2| + h max_p |kappa - kappa0|,     kappa0 of the gradients `start` (k c, p, e, 1)
        beams       max_p |Gamma_1| + h max_p |kappa|,                    torsion and curvatures
        surfaces    max_p of the principal values of E +- h k
        solids      max_p of those of E

    `depth` h [m] is the distance of the outer fibres, a number or one a cell (e,); section (i, p,
    e).
    """
    h = np.broadcast_to(np.asarray(depth, dtype=float), section.shape[2:])[:, None]
    if solid_law.is_solid(law):
        return np.abs(principal_strains(law, u, 3)).max(axis=(0, 1))
    if law in COMPONENTS:
        E = strains(u, COMPONENTS[law])
        k = curvatures(law, u, section[..., None])
        faces = [principal(E + side * h * k) for side in (-1.0, 1.0)]
        return np.asarray(np.abs(faces).max(axis=(0, 1, 2)))
    if law.fields > 1:
        e = beam_strains(u, section[..., None])
        stretch = np.where(carrying(law, section)[..., None], np.abs(e[0]), 0.0)
        return np.asarray(stretch.max(axis=0) + h * np.linalg.norm(e[3:], axis=0).max(axis=0))
    dim = len(u) // law.vectors
    option = (law if law.bends else Law.EXACT).option
    axial = np.where(
        carrying(law, section)[..., None], 0.5 * (np.sum(u[:dim] ** 2, axis=0) - 1.0), 0.0
    )
    bent, straight = (
        curvatures_of_lines(option, dim, np.moveaxis(one[: 2 * dim], 0, -1)) for one in (u, start)
    )
    return np.asarray(np.abs(axial).max(axis=0) + h * np.abs(bent - straight).max(axis=0))


def beam_strains(u: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Strains (6, ...) of a beam from its reference, Gamma [-] and kappa [1/m].

        Gamma_i = d_i . r',    kappa_1 = 1/2 (d_3 . d_2' - d_2 . d_3')  (cyclic)

    of gradients u (24, ...), less those in its `section` (i, ...); in the plane of u (8, ...), where
    only Gamma_1, Gamma_3 and kappa_2 are not zero.
    """
    if len(u) == 8:
        first = Law.PLANAR_BEAM.section.index("gamma1")
        found = planar.strains(u.reshape(-1, 2, *u.shape[1:]))[:3] - section[first : first + 3]
        return np.asarray(np.tensordot(planar.TAKEN, found, 1))
    first = strain_law.first_strain(section)
    return np.asarray(
        strain_law.strains(u.reshape(-1, 3, *u.shape[1:]))[:6] - section[first : first + 6]
    )


def normals(u: np.ndarray) -> np.ndarray:
    """Unit normals (3, ...) of a shell.

        n = r,1 x r,2 / |r,1 x r,2|

    of the gradients u (15, ...).
    """
    n = np.cross(u[:3], u[3:6], axis=0)
    return np.asarray(n / np.linalg.norm(n, axis=0))


def strain_errors(law: Law, u: np.ndarray, v: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Largest errors (2,) of gradients v in place of u (k c, p, s), of axial or membrane strains,
    and of curvatures.

    Over them stand the largest values in u: (2, 2). `section` (i, p).
    """

    def both(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if solid_law.is_solid(law):
            return solid_law.strains(w), np.zeros(1)
        if law in COMPONENTS:
            return strains(w, COMPONENTS[law]), curvatures(law, w, section[..., None])
        if law.fields > 1:
            e = beam_strains(w, section[..., None])
            return e[:3, carrying(law, section)], e[3:]
        dim = len(w) // law.vectors
        option = (law if law.bends else Law.EXACT).option
        return 0.5 * (np.sum(w[:dim] ** 2, axis=0) - 1.0), curvatures_of_lines(
            option, dim, np.moveaxis(w[: 2 * dim], 0, -1)
        )

    found = [
        (np.abs(a).max(initial=0.0), np.abs(b - a).max(initial=0.0))
        for a, b in zip(both(u), both(v), strict=True)
    ]
    return np.array(found).T


def curvatures(law: Law, u: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Change of curvature (3, ...) as 11, 22, 12 [1/m] of the gradients u (15, ...) of a shell.

        k_ab = b0_ab - n.r,ab

    b0 are the rows 3 to 5 of the section (7, ...). Where k is positive, it stretches the face z =
    t/2; zeros of a membrane.
    """
    if law is not Law.SHELL:
        return np.zeros((3, *u.shape[1:]))
    second = u[6:].reshape(3, 3, *u.shape[1:])
    return section[3:6] - np.einsum("c...,ic...->i...", normals(u), second)


def hooke(stiffness: np.ndarray, nu: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Forces [N/m] or moments [N] (3, ...) of strains or curvatures e (3, ...) in plane stress.

        11: A (e11 + nu e22),   22: A (e22 + nu e11),   12: A (1 - nu) e12

    `stiffness` A (...) is E t / (1 - nu^2) [N/m] or E t^3 / (12 (1 - nu^2)) [N m], nu (...)
    Poisson's ratio [-].
    """
    return stiffness * np.stack([e[0] + nu * e[1], e[1] + nu * e[0], (1.0 - nu) * e[2]])


def stresses(
    law: Law,
    strain: np.ndarray,
    change: np.ndarray,
    section: np.ndarray,
    thickness: float | np.ndarray,
) -> np.ndarray:
    """Second Piola-Kirchhoff stress (3, 3, ...) [Pa], level by component, at z = -t/2, 0, t/2.

        S(z) = N/t + 12 z M/t^3

    Of strains (3, ...) [-] and changes of curvature (3, ...) [1/m], with the section (i, ...) of
    the law and the thickness t [m], a number or (...). A membrane has the same stress at all
    levels.
    """
    t = np.asarray(thickness)
    middle = hooke(section[0], section[NU[law]], strain) / t
    if law is Law.MEMBRANE:
        return np.stack([middle, middle, middle])
    bending = 6.0 * hooke(section[1], section[2], change) / t**2
    return np.stack([middle - bending, middle, middle + bending])


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (...) [Pa] of plane stress S (3, ...) [Pa].

        sigma_v^2 = S11^2 - S11 S22 + S22^2 + 3 S12^2

    The components of S are 11, 22, 12.
    """
    return np.asarray(
        np.sqrt(stress[0] ** 2 - stress[0] * stress[1] + stress[1] ** 2 + 3.0 * stress[2] ** 2)
    )
