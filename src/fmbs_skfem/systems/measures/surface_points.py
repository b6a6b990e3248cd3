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
    values = surface.basis(shape.space, np.array([cell]), np.array([place[1:]]))[None]
    reference = part.shape_reference[shape.nodes[[cell]]]
    local, _, curved = local_table(values, np.ones((1, 1)), reference)
    vectors = part.cells.law.vectors
    dim = part.dim
    indptr = np.arange(vectors + 1) * values.shape[3]
    size = (vectors, shape.count)
    gradients = csr_array(
        (local[0, 0, :vectors].ravel(), np.tile(shape.nodes[cell], vectors), indptr), shape=size
    )
    warn_of_rim(where, part, csr_array(own(part, gradients)[:2]))
    rows = draft.layout.spread(part, own(part, gradients))
    section = part.cells.section[:, 0, cell].copy()
    if dim == 3:
        section[3:6] = curved[0, 0]
    thickness = np.broadcast_to(part.thickness, len(shape.nodes))[cell]
    warn_of_jump(where, shape, part.thickness, cell, values[0, 0, 0])
    parameters = (
        float(laws.number(part.cells.law)),
        float(thickness),
        *(float(value) for value in section),
    )
    axes, _ = surface.local_axes(np.einsum("kb,bc->kc", values[0, 0, 1:3], reference[0]))
    return SurfacePoint(
        rows, parameters, axes, tuple(float(one) for one in values[0, 0, 0] @ reference[0])
    )


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
