r"""Strains, forces and stresses of a beam with torsion and shear at places, as outputs and pictures
read them.

    F = int psi' n_i d_i dS,    Gamma = A^-1 (F - B kappa),    M = B^T Gamma + D kappa,    C = (A, B; B^T, D)

with components along the directors at the place. F is what the beam beyond it carries, n =
dW/dGamma: psi is a step of its own splines, and moving all that is beyond is one of the motions for
which the equations hold, see `cable_sections`. M has the error of the curvatures at the place, and
none of shear strains, which are not known between the points that do not lock.

Stresses are those of Saint-Venant at the contour of the section, linear in S = (N, V_y, V_z, T,
M_y, M_z), see `section_constants`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from ...bodies.beams.beam import FIELDS, UPPER, beam_numbers
from ...bodies.beams.profiles import Profile
from ...bodies.body import Body, director, locate, read_by_cells
from ...bodies.laws import Law, number
from ...bodies.strain_law import FIRST, strains
from ...core.algebra.linalg import as_csr
from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Inside, Reals
from ...shapes import line
from ..places import At
from .cable_sections import NOISE, between, steps_near

#: components of S and their units
FORCES = {
    "N": "N",
    "Vy": "N",
    "Vz": "N",
    "T": "N m",
    "My": "N m",
    "Mz": "N m",
}
STRAINS = {
    "axial": "",
    "shear_y": "",
    "shear_z": "",
    "torsion": "1/m",
    "curvature_y": "1/m",
    "curvature_z": "1/m",
}
ROWS = 2 * FIELDS  #: vectors of a point: r, d_i and their slopes
#: numbers of a place: law, how many functionals of S it has, C, kappa in the reference
HEAD = 2 + 36 + 3
#: and of every quadrature point: (A, B), Gamma and kappa in the reference, weight times psi' [-]
EACH = 18 + 6 + 1
SWEPT = 101  #: places of a beam at which its section is drawn
OFF = 0.05  #: part of the size of a contour by which a point may miss it


@storable
@dataclass(frozen=True)
class Sections:
    """Numbers of x places of a beam and of the p points whose stresses carry their forces."""

    stiffness: Annotated[np.ndarray, Reals("x 6 6")]  #: C
    curvature: Annotated[np.ndarray, Reals("x 3")]  #: kappa in the reference [1/m]
    shares: Annotated[csr_array, Reals("x p")]  #: weight times psi' [-]
    coupled: Annotated[np.ndarray, Reals("p 3 6")]  #: A and B
    known: Annotated[np.ndarray, Reals("p 6")]  #: Gamma and kappa in the reference

    def read(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strains (6, s, x) and forces S (6, s, x) of rows u (s, 3 (8 x + 8 p)), see `sections`."""
        count, places = len(u), len(self.stiffness)
        vectors = u.reshape(count, -1, 3)
        here, there = (
            part.reshape(count, ROWS, -1, 3).transpose(1, 3, 0, 2)
            for part in np.split(vectors, [ROWS * places], axis=1)
        )
        stress = np.einsum("pij,jsp->isp", self.coupled, strains(there)[:6] - self.known.T[:, None])
        carried = np.einsum("isp,icsp->csp", stress, there[1:FIELDS])
        push = (carried.reshape(3 * count, -1) @ self.shares.T).reshape(3, count, places)
        axes = here[1:FIELDS] / np.linalg.norm(here[1:FIELDS], axis=1, keepdims=True)
        F = np.einsum("kcsx,csx->ksx", axes, push)
        kappa = strains(here)[3:6] - self.curvature.T[:, None]
        A, B, D = self.stiffness[:, :3, :3], self.stiffness[:, :3, 3:], self.stiffness[:, 3:, 3:]
        gamma = np.einsum("xij,jsx->isx", np.linalg.inv(A), F - np.einsum("xij,jsx->isx", B, kappa))
        M = np.einsum("xji,jsx->isx", B, gamma) + np.einsum("xij,jsx->isx", D, kappa)
        return np.concatenate([gamma, kappa]), np.concatenate([F, M])


def sections(part: Body, xi: np.ndarray) -> tuple[csr_array, Sections]:
    """Rows (8 x + 8 p, b) of r, directors and their slopes at parameters (x,) of a beam and at p
    points; their numbers.
    """
    assert part.cells is not None
    assert part.profile is not None
    section = part.cells.section
    breaks = line.breaks(part.space)
    _, points, count = section.shape
    cell = np.clip(np.searchsorted(breaks, xi, side="right") - 1, 0, count - 1)
    near = lru_cache(maxsize=2)(partial(steps_near, part, slope=1))  # places come in a row
    found = []
    for at, k in zip(xi, cell, strict=True):
        cells, steps, centers = near(int(k))
        psi = np.zeros((count, points))
        psi[cells] = np.einsum("k,kep->ep", between(centers, float(at)), steps[:, 1])
        psi[np.abs(psi) <= NOISE * np.abs(psi).max()] = 0.0
        found.append(csr_array((section[-1].T * psi).reshape(1, -1)))
    shares = as_csr(vstack(found))
    used = np.unique(shares.indices)
    e, p = np.divmod(used, points)
    there = line.tabulate(part.space, points).points[e, p]
    here = vectors(part, xi)
    known = section[:, p, e]
    curvature = strains((here @ part.reference).reshape(ROWS, -1, 3).transpose(0, 2, 1))[3:6].T
    numbers = Sections(
        part.profile.at(xi)[0],
        curvature,
        as_csr(shares[:, used]),
        matrices(known)[:, :3],
        known[FIRST : FIRST + 6].T,
    )
    return as_csr(vstack([here, vectors(part, there)])), numbers


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
    """Section matrices of beams at sections (i, ...).

        S = C e,    C (..., 6, 6)

    with e = (Gamma, kappa).
    """
    C = np.zeros((*section.shape[1:], 6, 6))
    C[..., UPPER[0], UPPER[1]] = C[..., UPPER[1], UPPER[0]] = np.moveaxis(
        section[: len(UPPER[0])], 0, -1
    )
    return C


def vectors(part: Body, xi: np.ndarray) -> csr_array:
    """Rows (8 x, b) of r, d_1, d_2, d_3 at parameters (x,) of a beam, then of their derivatives by
    arc length.
    """
    assert part.spread is not None
    values, slopes = line.sample(part.space, xi), line.sample(part.space, xi, 1)
    slopes = diags_array(1.0 / np.linalg.norm(slopes @ part.shape_reference, axis=1)) @ slopes
    fields = [part.spread, *(director(part, k) for k in (1, 2, 3))]
    return as_csr(vstack([table @ own for table in (values, slopes) for own in fields]))


# ----------------------------------------------------------------------------------------------------- one place, of outputs
def reads_beam(parameters: tuple[float, ...]) -> bool:
    """Whether an output reads a beam: its first parameter is the number of its law."""
    return int(parameters[0]) == number(Law.BEAM)


def counts(parameters: tuple[float, ...]) -> tuple[int, int]:
    """How many rows and parameters the output of a beam has in a file."""
    numbers = HEAD + 6 * int(parameters[1])
    points = max(0, len(parameters) - numbers) // EACH
    return 3 * ROWS * (1 + points), numbers + EACH * points


def beam_point(
    part: Body, at: At, functionals: np.ndarray | None = None
) -> tuple[csr_array, tuple[float, ...]]:
    """Rows (8 + 8 p, b) of `sections` at a place of a beam; its parameters, with `functionals` (m,
    6) of S.

    Those of a part are read from its shape functions at the points of its full body.
    """
    xi = np.array([float(locate(part, at.place))])  # type: ignore[arg-type]
    rows, one = sections(part if part.shapes is None else with_all_points(part), xi)
    own = np.zeros((0, 6)) if functionals is None else functionals
    shares = np.zeros(len(one.known))
    shares[one.shares.indices] = one.shares.data
    each = np.column_stack([one.coupled.reshape(-1, 18), one.known, shares])
    head = (own, one.stiffness, one.curvature, each)
    return rows, (
        float(number(Law.BEAM)),
        float(len(own)),
        *(value for part in head for value in part.ravel().tolist()),
    )


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
    require_full(where, part, str(at))
    return float(locate(part, at.place))  # type: ignore[arg-type]


def require_full(where: str, part: Body, what: str) -> None:
    """InputError, after `where`, where a beam is a trained part."""
    if part.shapes is not None:
        got = f"{what} of a trained part"
        raise InputError(say(where, "a place of a beam in full", got, "read it in the full model"))


def read_place(
    parameters: tuple[float, ...], u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strains (6, s), S (6, s) [N, N m] and functionals of S (m, s) of rows u (s, 3 (8 + 8 p)) that
    `beam_point` gives.
    """
    many = 6 * int(parameters[1])
    own, C, curvature, rest = np.split(np.array(parameters[2:]), [many, many + 36, many + 39])
    each = rest.reshape(-1, EACH)
    shares = csr_array(each[:, -1][None])
    found = Sections(
        C.reshape(1, 6, 6), curvature[None], shares, each[:, :18].reshape(-1, 3, 6), each[:, 18:24]
    ).read(u)
    strain, force = (part[..., 0] for part in found)
    return strain, force, own.reshape(-1, 6) @ force


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
