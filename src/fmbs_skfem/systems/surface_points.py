"""What outputs read at a point of a plate or shell: the derivatives of which `bodies.fields` makes strains and stresses."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..bodies import laws
from ..bodies.body import locate, own
from ..bodies.fields import Fields, recover
from ..bodies.plate import local_table
from ..core.errors import InputError, say
from ..core.records import dataclass
from ..shapes import surface
from . import edges
from .places import At, Draft


@dataclass(frozen=True)
class SurfacePoint:
    """A point of a surface with the vectors u (k c,) of its law."""

    rows: csr_array  #: (k c, q)
    parameters: tuple[float, ...]  #: number of the law, thickness [m], rows of the section
    axes: np.ndarray  #: (2, c) of the reference, to which components 1 and 2 refer


def surface_point(where: str, draft: Draft, at: At) -> SurfacePoint:
    """What is read at a named point of a plate or shell; InputError where it is none."""
    part, shape = edges.shape_of(where, draft, at.body)
    place = locate(part, at.place)
    if not isinstance(place, tuple) or part.cells is None:
        raise InputError(say(where, "a named point of a plate", at))
    cell = int(place[0])
    values = surface.basis(shape.space, np.array([cell]), np.array([place[1:]]))[None]
    reference = part.shape_reference[shape.nodes[[cell]]]
    local, _, curved = local_table(values, np.ones((1, 1)), reference)
    vectors, dim = part.cells.law.vectors, part.dim
    indptr = np.arange(vectors + 1) * values.shape[3]
    size = (vectors, shape.count)
    gradients = csr_array((local[0, 0, :vectors].ravel(), np.tile(shape.nodes[cell], vectors), indptr), shape=size)
    rows = draft.layout.spread(part, own(part, gradients))
    section = part.cells.section[:, 0, cell].copy()
    if dim == 3:
        section[3:6] = curved[0, 0]
    thickness = np.broadcast_to(part.thickness, len(shape.nodes))[cell]
    parameters = (float(laws.number(part.cells.law)), float(thickness), *(float(value) for value in section))
    axes, _ = surface.local_axes(np.einsum("kb,bc->kc", values[0, 0, 1:3], reference[0]))
    return SurfacePoint(rows, parameters, axes)


def recovered(parameters: tuple[float, ...], values: np.ndarray) -> Fields:
    """Fields (.., s) of what the rows of a surface point read over time (s, k c)."""
    law, thickness, *section = parameters
    data = np.tile(np.array(section)[:, None], (1, len(values)))
    return recover(laws.NUMBERS[int(law)], values.T, data, thickness)


def counts(number: float, dim: int) -> tuple[int, int]:
    """How many rows and parameters a surface point of a law has in a file; LookupError of a law that has none."""
    law = laws.NUMBERS[int(number)]
    return law.vectors * dim, 2 + law.rows
