"""What outputs read at nodes of a solid: gradients, the means of those of the cells there, of which
its law makes stresses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ...bodies.body import Body, locate, own
from ...bodies.solids import solid_law
from ...bodies.solids.solid_body import node_rows
from ...core.errors import InputError, say
from ...shapes.solids import recovery, solid
from ...shapes.solids.solid import Solid
from ..places import Draft
from ..system import Output
from .probes import Sensed

TENSOR = ("xx", "yy", "zz", "xy", "yz", "zx")
VALUES = ("1", "2", "3")  #: principal ones
MEASURE = "von_mises"
AXES = "in the axes of the mesh, which turn with the material"
LABELS = (*(f"{one}, {AXES}" for one in TENSOR), *(f"principal value {one}" for one in VALUES))


def facts(where: str, draft: Draft, part: Body, nodes: np.ndarray) -> dict[str, Any]:
    """What an output keeps of nodes (m,) of a solid: rows of its gradients (9 m, q), nine a node, its
    law with the numbers of its section, and the places (3 m,) in the reference [m].
    """
    shape = part.space
    assert isinstance(shape, Solid)
    cells = part.cells
    if cells is None:
        raise InputError(say(where, "a body that knows its material", f"'{part.name}'"))
    rows = own(part, recovery.mean_gradients(shape, nodes))
    return {
        "rows": [draft.layout.spread(part, rows)],
        "law": cells.law,
        "parameters": tuple(cells.section[:-1, 0, 0].tolist()),
        "body": part.name,
        "place": tuple(np.asarray(node_rows(part, nodes) @ part.reference).ravel().tolist()),
    }


def node_of(where: str, part: Body, place: str | float) -> np.ndarray:
    """The node (1,) of a named point of a solid; InputError for other places."""
    row = locate(part, place)
    if not isinstance(row, csr_array) or row.nnz != 1:
        raise InputError(say(where, "a named point of a solid", f"'{part.name}.{place}'"))
    return row.indices.astype(np.int64)


def group(where: str, part: Body, name: str) -> np.ndarray:
    """Nodes (m,) of a set, of faces or of a point of a solid."""
    shape = part.space
    assert isinstance(shape, Solid)
    if name in part.places:
        return node_of(where, part, name)
    return solid.nodes_of(where, shape, name)


def gradients(sensed: Sensed) -> np.ndarray:
    """Gradients (9, m, s) of m nodes at s instants."""
    return np.ascontiguousarray(
        sensed.values.T.reshape(-1, 9, len(sensed.values)).transpose(1, 0, 2)
    )


def stresses(output: Output, u: np.ndarray) -> np.ndarray:
    """Cauchy stresses (6, m, s) [Pa] in the axes of the mesh, which turn with the material, of
    gradients (9, m, s).
    """
    law = output.law
    assert law is not None
    return solid_law.stresses(law, np.array(output.parameters)[:, None, None], u)


def tensor_columns(stress: np.ndarray) -> list[np.ndarray]:
    """Components (s,) of tensors (6, 1, s), then their principal values."""
    return [*stress[:, 0], *solid_law.principal(stress[:, 0])]


def largest(stress: np.ndarray) -> Sequence[np.ndarray]:
    """Of tensors (6, m, s) the largest von Mises stress, the largest and the smallest principal one,
    (s,) each.
    """
    values = solid_law.principal(stress)
    return [solid_law.von_mises(stress).max(axis=0), values[0].max(axis=0), values[2].min(axis=0)]
