r"""Forces and moments of a beam with torsion and shear at a place, as outputs read them.

    F = int psi' n_i d_i dS,    M = B^T A^-1 F + (D - B^T A^-1 B) kappa,    C = (A, B; B^T, D)

with components along the directors at the place. F is what the beam beyond it carries, n = dW/dGamma: psi is a step of its own
splines, and moving all that is beyond is one of the motions for which the equations hold, see `cable_sections`. M has the error of
the curvatures at the place, and none of shear strains, which are not known between the points that do not lock.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from ...bodies.beams.beam import FIELDS, UPPER
from ...bodies.body import Body, director, locate
from ...bodies.laws import Law, number
from ...bodies.strain_law import strains
from ...core.algebra.linalg import as_csr
from ...core.errors import InputError, say
from ...shapes import line
from ..places import At
from .cable_sections import NOISE, between, steps_near

WORDS = ("N", "Vy", "Vz", "T", "My", "Mz")
FIRST = Law.BEAM.section.index("gamma1")  #: row of the section with the first strain of the reference
ROWS = 2 * FIELDS  #: vectors of a point: r, d_i and their slopes
HEAD = 1 + 9 + 9 + 3  #: parameters of the place: law, B^T A^-1, D - B^T A^-1 B, kappa in the reference
EACH = 18 + 6 + 1  #: and of every quadrature point: (A, B), Gamma and kappa in the reference, weight times psi' [-]


def reads_beam(parameters: tuple[float, ...]) -> bool:
    """Whether an output reads a beam: its first parameter is the number of its law."""
    return int(parameters[0]) == number(Law.BEAM)


def counts(parameters: tuple[float, ...]) -> tuple[int, int]:
    """How many rows and parameters the output of a beam has in a file."""
    points = max(0, len(parameters) - HEAD) // EACH
    return 3 * ROWS * (1 + points), HEAD + EACH * points


def matrices(section: np.ndarray) -> np.ndarray:
    """C (..., 6, 6) of sections (i, ...)."""
    C = np.zeros((*section.shape[1:], 6, 6))
    C[..., UPPER[0], UPPER[1]] = C[..., UPPER[1], UPPER[0]] = np.moveaxis(section[: len(UPPER[0])], 0, -1)
    return C


def beam_point(where: str, part: Body, at: At) -> tuple[csr_array, tuple[float, ...]]:
    """Rows (8 + 8 p, b) of r, directors and their slopes at a place of a beam and at p points; parameters.

    InputError, after `where`, for a part, whose functions reach over all of it.
    """
    if part.shapes is not None or part.cells is None:
        raise InputError(say(where, "a place of a beam in full", f"{at} of a trained part", "read it in the full model"))
    xi, section, breaks = float(locate(part, at.place)), part.cells.section, line.breaks(part.space)  # type: ignore[arg-type]
    cell = int(np.clip(np.searchsorted(breaks, xi, side="right") - 1, 0, section.shape[2] - 1))
    cells, steps, centers = steps_near(part, cell, 1)
    psi = np.einsum("k,kep->ep", between(centers, xi), steps[:, 1])
    e, p = np.nonzero(np.abs(psi) > NOISE * np.abs(psi).max())
    there = line.tabulate(part.space, section.shape[1]).points[cells][e, p]
    here, known = vectors(part, np.array([xi])), section[:, p, cells[e]]
    C = matrices(section[:, section.shape[1] // 2, cell])  # where stretch and shear have a share
    across = np.linalg.solve(C[:3, :3], C[:3, 3:]).T
    kappa0 = strains((here @ part.reference).reshape(ROWS, 3))[3:6]
    head = (float(number(Law.BEAM)), *across.ravel(), *(C[3:, 3:] - across @ C[:3, 3:]).ravel(), *kappa0)
    each = np.column_stack([matrices(known)[:, :3].reshape(len(e), 18), known[FIRST : FIRST + 6].T, known[-1] * psi[e, p]])
    return as_csr(vstack([here, vectors(part, there)])), (*map(float, head), *each.ravel().tolist())


def vectors(part: Body, xi: np.ndarray) -> csr_array:
    """Rows (8 x, b) of r, d_1, d_2, d_3 at parameters (x,) of a beam, then of their derivatives by arc length."""
    assert part.spread is not None
    values, slopes = line.sample(part.space, xi), line.sample(part.space, xi, 1)
    slopes = diags_array(1.0 / np.linalg.norm(slopes @ part.shape_reference, axis=1)) @ slopes
    fields = [part.spread, *(director(part, k) for k in (1, 2, 3))]
    return as_csr(vstack([table @ own for table in (values, slopes) for own in fields]))


def beam_forces(parameters: tuple[float, ...], u: np.ndarray) -> list[np.ndarray]:
    """N, Vy, Vz [N], T, My, Mz [N m], (s,) each, of rows u (s, 3 (8 + 8 p)) that `beam_point` gives."""
    across, alone = np.reshape(parameters[1:19], (2, 3, 3))
    known, count = np.reshape(parameters[HEAD:], (-1, EACH)), len(u)
    place = u[:, : 3 * ROWS].reshape(count, ROWS, 3)
    there = u[:, 3 * ROWS :].reshape(count, ROWS, -1, 3).transpose(1, 3, 0, 2)  # (8, c, s, p)
    C = known[:, :18].reshape(-1, 3, 6)
    stress = np.einsum("pij,jsp->isp", C, strains(there)[:6] - known[:, 18:24].T[:, None])
    push = np.einsum("isp,icsp,p->sc", stress, there[1:4], known[:, -1])
    axes = place[:, 1:FIELDS] / np.linalg.norm(place[:, 1:FIELDS], axis=2, keepdims=True)
    force = np.einsum("skc,sc->ks", axes, push)
    kappa = strains(place.transpose(1, 2, 0))[3:6] - np.array(parameters[19:HEAD])[:, None]
    return [*force, *(across @ force + alone @ kappa)]
