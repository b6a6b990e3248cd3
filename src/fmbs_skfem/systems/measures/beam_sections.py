r"""Strains, forces and stresses of a beam with torsion and shear at places, as outputs and pictures
read them.

    F = int psi' n_i d_i dS,    Gamma = A^-1 (F - B kappa),    M = B^T Gamma + D kappa,    C = (A, B; B^T, D)

with components along the directors at the place. F is what the beam beyond it carries, n =
dW/dGamma: psi is a step of its own splines, and moving all that is beyond is one of the motions for
which the equations hold, see `cable_sections`. M has the error of the curvatures at the place, and
none of shear strains, which are not known between the points that do not lock.

Beams in the plane are read as those in space that stay there, see `bodies.beams.planar`: N, V and M
are N, V_z and -M_y.

Stresses are those of Saint-Venant at the contour of the section, linear in S = (N, V_y, V_z, T,
M_y, M_z), see `section_constants`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from ...bodies.beams import planar
from ...bodies.beams.beam import FIELDS, LAWS, beam_numbers
from ...bodies.beams.profiles import Profile
from ...bodies.body import Body, director, directors, locate, read_by_cells
from ...bodies.laws import Law, number
from ...bodies.strain_law import strains
from ...core.algebra.linalg import as_csr
from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Inside, Reals
from ...shapes import line
from ..places import At
from .cable_sections import step_shares
from .packed import pack, unpack

#: components of S and their units
FORCES = {
    "N": "N",
    "Vy": "N",
    "Vz": "N",
    "T": "N m",
    "My": "N m",
    "Mz": "N m",
}
BIMOMENT = {"B": "N m^2"}  #: of beams that warp
STRAINS = {
    "axial": "",
    "shear_y": "",
    "shear_z": "",
    "torsion": "1/m",
    "curvature_y": "1/m",
    "curvature_z": "1/m",
}
OF_BEAMS = (*LAWS.values(), Law.WARPED_BEAM)
#: strains of a beam by the rows of its section
SIZES = {Law.PLANAR_BEAM.rows: 3, Law.BEAM.rows: 6, Law.WARPED_BEAM.rows: 8}
#: in the plane, of all six by their words
PLANE = {"N": "N", "V": "N", "M": "N m"}
PLANE_STRAINS = {"axial": "", "shear": "", "curvature": "1/m"}
SWEPT = 101  #: places of a beam at which its section is drawn
OFF = 0.05  #: part of the size of a contour by which a point may miss it


@storable
@dataclass(frozen=True)
class Sections:
    """Numbers of x places of a beam and of the p points whose stresses carry their forces."""

    stiffness: Annotated[np.ndarray, Reals("x f f")]  #: C
    curvature: Annotated[np.ndarray, Reals("x *")]  #: kappa in the reference [1/m]
    shares: Annotated[csr_array, Reals("x p")]  #: weight times psi' [-]
    coupled: Annotated[np.ndarray, Reals("p 3 f")]  #: A and B
    known: Annotated[np.ndarray, Reals("p f")]  #: Gamma and kappa in the reference

    @property
    def orders(self) -> tuple[int, int]:
        """Derivatives of r and d_i that it reads at places and at points."""
        return (4, 3) if self.stiffness.shape[-1] > 6 else (2, 2)

    def read(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strains (f, s, x) and forces S (f, s, x) of rows u (s, 3 (8 x + 8 p)), in the plane (s, 2 (4
        x + 4 p)), see `sections`; f = 6, or 8 of beams that warp, whose T is that of Saint-Venant.
        """
        count, places = len(u), len(self.stiffness)
        many = self.stiffness.shape[-1]
        here, there = (one.transpose(0, 3, 1, 2) for one in gradients(self, u))
        change = strains(there)[:many] - self.known.T[:, None]
        stress = np.einsum("pij,jsp->isp", self.coupled, change)
        carried = np.einsum("isp,icsp->csp", stress, there[1:4])
        push = (carried.reshape(3 * count, -1) @ self.shares.T).reshape(3, count, places)
        axes = here[1:4] / np.linalg.norm(here[1:4], axis=1, keepdims=True)
        F = np.einsum("kcsx,csx->ksx", axes, push)
        kappa = strains(here[: 4 * self.orders[1]])[3:many] - self.curvature.T[:, None]
        A, B, D = self.stiffness[:, :3, :3], self.stiffness[:, :3, 3:], self.stiffness[:, 3:, 3:]
        gamma = np.einsum("xij,jsx->isx", np.linalg.inv(A), F - np.einsum("xij,jsx->isx", B, kappa))
        M = np.einsum("xji,jsx->isx", B, gamma) + np.einsum("xij,jsx->isx", D, kappa)
        return np.concatenate([gamma, kappa]), np.concatenate([F, M])

    def all_forces(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `read`, with the whole torque."""
        strain, force = self.read(u)
        force[3] += self.torques(u, force)
        return strain, force

    def torques(self, u: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """What B and W of forces (f, s, x) add to Saint-Venant's torque at the places (s, x).

            2 kappa_1 W - dB/dS

        where products of slopes stand in the second derivative of kappa_1.
        """
        if len(forces) == 6:
            return np.zeros(forces.shape[1:])
        here = gradients(self, u)[0]
        _, _, b, c, _, _, b1, c1, _, _, b2, c2, _, _, b3, c3 = here
        dot = lambda one, other: np.einsum("sxc,sxc->sx", one, other)  # noqa: E731
        twist, rate = 0.5 * (dot(c, b1) - dot(b, c1)), 0.5 * (dot(c, b2) - dot(b, c2))
        change = 0.5 * (dot(c, b3) - dot(b, c3) + dot(c1, b2) - dot(b1, c2))
        slope = self.stiffness[:, 6, 6] * change + 2.0 * self.stiffness[:, 6, 7] * twist * rate
        return np.asarray(2.0 * twist * forces[7] - slope)


def gradients(found: Sections, u: np.ndarray, rates: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """r, d_i and their derivatives (4 k, s, ..., 3) at places and at points, of rows u (s, ...) of
    `sections`, or their `rates`; those of beams in the plane lifted into space.
    """
    sizes = len(found.stiffness), len(found.known)
    space = 12 * sum(order * size for order, size in zip(found.orders, sizes, strict=True))
    dim = 3 if u.shape[1] == space else 2
    vectors = u.reshape(len(u), -1, dim)
    rows = [FIELDS[dim] * order for order in found.orders]
    parts = (
        one.reshape(len(u), count, -1, dim).transpose(1, 0, 2, 3)
        for count, one in zip(rows, np.split(vectors, [rows[0] * sizes[0]], axis=1), strict=True)
    )
    here, there = (planar.lifted(one, rates) if dim == 2 else one for one in parts)
    return here, there


def sections(part: Body, xi: np.ndarray) -> tuple[csr_array, Sections]:
    """Rows (8 x + 8 p, b) of r, directors and their slopes at parameters (x,) of a beam and at p
    points; their numbers.
    """
    assert part.cells is not None
    assert part.profile is not None
    section = part.cells.section
    (shares,), (e, p) = step_shares(part, xi, (1,), 1)
    there = line.tabulate(part.space, section.shape[1]).points[e, p]
    stiffness = part.profile.at(xi)[0]
    many = stiffness.shape[-1]
    known = section[:, p, e]
    C = matrices(known)
    first = C.shape[-1] * (C.shape[-1] + 1) // 2 + 1
    start = known[first : first + C.shape[-1]]
    if part.dim == 2:
        C, start = planar.TAKEN @ C @ planar.TAKEN.T, planar.TAKEN @ start
    numbers = Sections(stiffness, np.zeros((len(xi), many - 3)), shares, C[:, :3], start.T)
    orders = numbers.orders
    here, far = vectors(part, xi, orders[0]), vectors(part, there, orders[1])
    rows = as_csr(vstack([here, far]))
    rest, _ = gradients(numbers, np.asarray(rows @ part.reference).reshape(1, -1))
    curvature = strains(rest[: 4 * orders[1]].transpose(0, 3, 1, 2))[3:many, 0].T
    return rows, replace(numbers, curvature=curvature)


def with_all_points(part: Body) -> Body:
    """A part of a beam with the quadrature points of its full body, which its section and its
    reference tell.
    """
    read = read_by_cells(part)
    assert part.cells is not None
    assert part.profile is not None
    assert isinstance(part.space, line.BSpline)
    assert read is not None
    table, section = beam_numbers(part.space, np.asarray(read @ part.reference), part.profile)
    return replace(part, cells=replace(part.cells, table=table, section=section), shapes=None)


@storable
@dataclass(frozen=True)
class SweptLine:
    """What a picture needs of a beam beside its line: the section at x places."""

    rows: Annotated[csr_array, Reals("r q")]  #: 3 (8 x + 8 p) of `sections` on all coordinates
    places: Annotated[np.ndarray, Reals("x")]  #: parameters xi
    sections: Annotated[Sections, Inside("x")]
    profile: Annotated[Profile, Inside()]


def swept_line(part: Body, spread: Callable[[csr_array], csr_array]) -> SweptLine:
    """Sections along all of a beam; `spread` takes rows (x, b) on its functions to rows (3 x, q)."""
    assert part.profile is not None
    breaks = line.breaks(part.space)
    xi = np.linspace(breaks[0], breaks[-1], SWEPT)
    rows, numbers = sections(part, xi)
    return SweptLine(spread(rows), xi, numbers, part.profile)


def matrices(section: np.ndarray) -> np.ndarray:
    """Section matrices (..., f, f) of beams at sections (i, ...) of their law.

        S = C e

    with e = (Gamma, kappa), in the plane (Gamma_1, Gamma_2, kappa).
    """
    size = SIZES[len(section)]
    upper = np.triu_indices(size)
    C = np.zeros((*section.shape[1:], size, size))
    C[..., upper[0], upper[1]] = C[..., upper[1], upper[0]] = np.moveaxis(
        section[: len(upper[0])], 0, -1
    )
    return C


def vectors(part: Body, xi: np.ndarray, orders: int = 2) -> csr_array:
    """Rows (4 k x, b) of r, d_1, d_2, d_3 at parameters (x,) of a beam, then of their derivatives by
    arc length, k = `orders` in all; in the plane (2 k x, b) of r and d_1.
    """
    assert part.spread is not None
    size = 1.0 / np.linalg.norm(line.sample(part.space, xi, 1) @ part.shape_reference, axis=1)
    tables = [diags_array(size**k) @ line.sample(part.space, xi, k) for k in range(orders)]
    fields = [part.spread, *(director(part, k + 1) for k in range(directors(part)))]
    return as_csr(vstack([table @ own for table in tables for own in fields]))


# ----------------------------------------------------------------------------------------------------- one place, of outputs
def reads_beam(parameters: tuple[float, ...]) -> bool:
    """Whether an output reads a beam: its first parameter is the number of its law."""
    return int(parameters[0]) in [number(law) for law in OF_BEAMS]


def beam_point(
    part: Body, xi: np.ndarray, functionals: np.ndarray | None = None
) -> tuple[csr_array, tuple[float, ...]]:
    """Rows (8 x + 8 p, b) of `sections` at parameters (x,) of a beam; the parameters of an output,
    with `functionals` of S, (m, 6) or others at each place (x, m, 6).

    Those of a part are read from its shape functions at the points of its full body.
    """
    rows, found = sections(part if part.shapes is None else with_all_points(part), xi)
    own = np.zeros((0, found.stiffness.shape[-1])) if functionals is None else functionals
    arrays = (found.stiffness, found.curvature, found.shares, found.coupled, found.known, own)
    assert part.cells is not None
    return rows, (float(number(part.cells.law)), *pack(*arrays))


def place_of(where: str, part: Body, at: At) -> float:
    """The parameter xi of a place of a beam in full; InputError, after `where`, for another one."""
    if part.directors is None:
        raise InputError(
            say(
                where,
                "a place of a beam (type: beam)",
                f"{at}, of another body",
                "take section_forces there",
            )
        )
    if part.shapes is not None:
        got = f"{at} of a trained part"
        raise InputError(say(where, "a place of a beam in full", got, "read it in the full model"))
    return float(locate(part, at.place))  # type: ignore[arg-type]


def sections_of(parameters: tuple[float, ...]) -> tuple[Sections, np.ndarray]:
    """The numbers of the places of an output of a beam, and its functionals of S."""
    *numbers, own = unpack(parameters[1:])
    return Sections(*numbers), own


def read_places(
    parameters: tuple[float, ...], u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strains (f, s, x), S (f, s, x) [N, N m] and functionals of S (m, s, x) of rows u (s, ...) that
    `beam_point` gives.
    """
    found, own = sections_of(parameters)
    strain, force = found.read(u)
    functionals = (
        np.tensordot(own, force, 1) if own.ndim == 2 else np.einsum("xmf,fsx->msx", own, force)
    )
    force[3] += found.torques(u, force)
    return strain, force, functionals


def rows_of(parameters: tuple[float, ...], dim: int) -> int:
    """How many rows the output of a beam has."""
    found, _ = sections_of(parameters)
    here, there = found.orders
    return dim * FIELDS[dim] * (here * len(found.stiffness) + there * len(found.known))


def forces_of(parameters: tuple[float, ...], dim: int) -> dict[str, str]:
    """Words of the section forces of a beam with their units, in `dim` components."""
    if dim == 2:
        return PLANE
    warps = int(parameters[0]) == number(Law.WARPED_BEAM)
    return FORCES | BIMOMENT if warps else FORCES


def in_plane(values: np.ndarray) -> np.ndarray:
    """N, V and M, or their strains (3, ...), of all six (6, ...)."""
    return np.asarray(np.tensordot(planar.TAKEN.T, values, 1))


# ---------------------------------------------------------------------------------------------------- stresses at the contour
def contour(where: str, part: Body) -> Profile:
    """The contour of a beam; InputError, after `where`, where its section is known by its matrices
    alone.
    """
    assert part.profile is not None
    if not part.profile.points.size:
        got = f"'{part.name}', whose section is known by its stiffness alone"
        raise InputError(
            say(
                where,
                "a beam whose contour is known",
                got,
                "give it a shape and a material, or read section_forces",
            )
        )
    return part.profile


@dataclass(frozen=True)
class ContourPoint:
    """A point of a contour."""

    stresses: np.ndarray  #: (2, 6) sigma_x and tau_xs of S = 1 [1/m2, 1/m3], s along the contour, anticlockwise about the beam
    place: tuple[float, float]  #: y and z [m]


def contour_point(
    where: str, profile: Profile, xi: float, wanted: tuple[float, ...]
) -> ContourPoint:
    """The point of the contour that is nearest to y and z [m]; InputError where it is farther than
    `OFF` of the size.
    """
    _, (points,), (unit,) = profile.at(np.array([xi]))
    start = np.concatenate([np.arange(len(points))[loop] for loop in profile.loops])
    end = np.concatenate([np.roll(np.arange(len(points))[loop], -1) for loop in profile.loops])
    along = points[end] - points[start]
    aim = np.asarray(wanted, dtype=float)
    share = (np.sum((aim - points[start]) * along, axis=1) / np.sum(along**2, axis=1)).clip(
        0.0, 1.0
    )
    nearest = points[start] + share[:, None] * along
    k = int(np.linalg.norm(nearest - aim, axis=1).argmin())
    y, z = nearest[k].tolist()
    if np.linalg.norm(nearest[k] - aim) > OFF * float(np.ptp(points, axis=0).max()):
        shown = f"({aim[0]:.4g}, {aim[1]:.4g}) m"
        raise InputError(
            say(
                f"{where}.point",
                "a point of the contour",
                shown,
                f"the nearest one is ({y:.4g}, {z:.4g}) m",
            )
        )
    there = (1.0 - share[k]) * unit[..., start[k]] + share[k] * unit[..., end[k]]
    tangent = along[k] / np.linalg.norm(along[k])
    return ContourPoint(np.stack([there[0], tangent @ there[1:]]), (y, z))
