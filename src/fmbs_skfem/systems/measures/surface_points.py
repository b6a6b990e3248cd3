"""What outputs read at a point of a plate or shell: derivatives of which `stress_recovery` makes
strains and stresses.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ...bodies import laws
from ...bodies.body import Body, locate, own
from ...bodies.plate import local_table
from ...bodies.stress_recovery import RecoveredFields, recover
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...shapes import surface
from ..connections import edges
from ..places import At, Draft

NOISE = 1e-12  #: value of a function at a point that counts as zero, over the largest
# the curvature there is the mean of both sides: the moment of one is 85 % off in a cylinder of two
# thicknesses
JUMP = 0.1  #: part of the thickness by which it differs in cells that meet


@dataclass(frozen=True)
class SurfacePoint:
    """A point of a surface with the vectors u (k c,) of its law."""

    rows: csr_array  #: (k c, q)
    parameters: tuple[float, ...]  #: number of the law, thickness [m], rows of the section
    axes: np.ndarray  #: (2, c) of the reference, to which components 1 and 2 refer
    place: tuple[float, ...]  #: in the reference (c,) [m]

    def facts(self, body: str) -> dict[str, Any]:
        """What an output keeps of it."""
        return {"parameters": self.parameters, "body": body, "place": self.place}


def surface_point(where: str, draft: Draft, at: At) -> SurfacePoint:
    """What is read at a named point of a plate or shell, by the derivatives of which
    `stress_recovery` makes strains and stresses.

    InputError, after `where`, where it is no such point; notices where a rim holds its strains, or
    the thickness jumps.
    """
    part, shape = edges.shape_of(where, draft, at.body)
    place = locate(part, at.place)
    if not isinstance(place, tuple) or part.cells is None:
        raise InputError(say(where, "a named point of a plate", at))
    cell = int(place[0])
    found = vectors_at(where, part, shape, np.array([cell]), np.array([place[1:]]))
    warn_of_rim(where, part, csr_array(found.rows[:2]))
    rows = draft.layout.spread(part, found.rows)
    values, reference = found.values[0], part.shape_reference[shape.nodes[cell]]
    warn_of_jump(where, shape, part.thickness, cell, values[0])
    axes, _ = surface.local_axes(values[1:3] @ reference)
    return SurfacePoint(
        rows,
        tuple(found.parameters[0].tolist()),
        axes,
        tuple(float(one) for one in values[0] @ reference),
    )


@dataclass(frozen=True)
class SurfaceVectors:
    """Vectors of the law of a surface at x points, one after the other."""

    rows: csr_array  #: (x k, b) on the functions of the body
    parameters: np.ndarray  #: (x, 2 + i) number of the law, thickness [m], rows of the section
    values: np.ndarray  #: (x, 6, b) of the functions of the cells, and derivatives in the parent


def vectors_at(
    where: str, part: Body, shape: surface.Surface, cells: np.ndarray, xi: np.ndarray
) -> SurfaceVectors:
    """What is read of a plate or shell at parent points xi (x, 2) of cells (x,); InputError, after
    `where`, for a body that does not know its cells.
    """
    if part.cells is None:
        raise InputError(say(where, "a plate or shell that knows its cells", f"'{part.name}'"))
    law = part.cells.law
    values = surface.basis(shape.space, cells, xi)
    reference = part.shape_reference[shape.nodes[cells]]
    local, _, curved = local_table(values[:, None], np.ones((len(cells), 1)), reference)
    nodes = np.repeat(shape.nodes[cells], law.vectors, axis=0)
    indptr = np.arange(len(nodes) + 1) * nodes.shape[1]
    data = local[:, 0, : law.vectors].ravel()
    gradients = csr_array((data, nodes.ravel(), indptr), shape=(len(nodes), shape.count))
    section = part.cells.section[:, 0, cells].copy()
    if part.dim == 3:
        section[3:6] = curved[:, 0].T
    thickness = np.broadcast_to(part.thickness, len(shape.nodes))[cells]
    law_number = np.full(len(cells), float(laws.number(law)))
    parameters = np.vstack([law_number, thickness, section]).T
    return SurfaceVectors(own(part, gradients), parameters, values)


def warn_of_rim(where: str, part: Body, slopes: csr_array) -> None:
    """A notice of a point whose slopes (2, b) are those of the frame of a rim, which hold the
    stretch and the shear across it.
    """
    frames = np.zeros(len(part.reference), dtype=bool)
    for start in part.frames.values():
        frames[start : start + 1 + part.dim] = True
    if part.shapes is None and frames.any() and frames[slopes.indices].all():
        text = "the rim at this point holds stretch and shear across its edge, so that membrane strains and forces read zero"
        notify(f"{where}: {text}; read them a cell beside it")


def warn_of_jump(
    where: str, shape: surface.Surface, thickness: float | np.ndarray, cell: int, values: np.ndarray
) -> None:
    """A notice of a point in a cell, with values (b,) of its functions there, at which the
    thickness [m] jumps.

    Cells meet at the point where they share all functions that are not zero there. Strains are
    continuous in it, so that neither stresses nor moments of the two sides are right there.
    """
    if np.ndim(thickness) == 0:
        return
    here = shape.nodes[cell][np.abs(values) > NOISE * np.abs(values).max()]
    meeting = np.flatnonzero(np.isin(shape.nodes, here).sum(axis=1) == len(here))
    others = np.asarray(thickness)[meeting]
    if np.ptp(others) > JUMP * others.max():
        sides = f"from {others.max():g} m to {others.min():g} m"
        mine = float(np.asarray(thickness)[cell])
        text = f"the thickness jumps at this point, {sides}: what is shown is of the side of {mine:g} m, and does not converge there"
        notify(f"{where}: {text}; read a point beside it")


def recovered(parameters: tuple[float, ...], values: np.ndarray) -> RecoveredFields:
    """RecoveredFields (.., s) of what the rows of a surface point read over time, values (s, k c),
    by the parameters of the point.
    """
    law, thickness, *section = parameters
    data = np.tile(np.array(section)[:, None], (1, len(values)))
    return recover(laws.NUMBERS[int(law)], values.T, data, thickness)


def counts(number: float, dim: int) -> tuple[int, int]:
    """How many rows (k c) and parameters (2 + i) a surface point of a law, by its number, has in a
    file.

    KeyError, which is a LookupError, for a number that no law has.
    """
    law = laws.NUMBERS[int(number)]
    return law.vectors * dim, 2 + law.rows
