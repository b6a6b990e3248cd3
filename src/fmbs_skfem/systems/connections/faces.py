"""Faces of solids held to the ground."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_array, kron

from ...bodies.body import Body
from ...bodies.solids.solid_body import node_rows
from ...core.algebra.linalg import evenly
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from ...shapes.solids import solid
from ...shapes.solids.solid import Solid
from .. import fields
from ..measures.resultants import Resultant
from ..places import At, Draft
from .constraint_functions import Joint, where
from .edges import SHOWN, components, hold


@dataclass(frozen=True)
class HeldFace(Joint, word="face"):
    """Nodes of faces, or of sets of nodes, of a solid held to the ground: components of their
    displacement (`fixed`), all by default.

    A plane of symmetry normal to x has fixed `x`. A rigid face is a rim, with a clamp.

    {type: face, body: bracket, faces: bottom, fixed: z}
    """

    name: str
    body: fields.Body
    faces: fields.Names
    fixed: fields.Letters | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.fixed == "":
            yield "fixed", Problem("a component that is held", "none", "delete the joint")

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        part, shape = whole_solid(name, layout.body(name, At(self.body, "")))
        letters = components(f"{name}.fixed", AXES[:3] if self.fixed is None else self.fixed, 3)
        nodes = solid.nodes_of(name, shape, self.faces)
        rows = node_rows(part, nodes)
        places = np.asarray(rows @ part.reference)
        for c in letters:
            hold(self, draft, c, layout.widen(self.body, kron(rows, np.eye(3)[[c]])), places[:, c])
        draft.constraints.edges.append(self.name)
        shown = rows[evenly(0, len(nodes) - 1, SHOWN)]
        sensors = draft.sensors.add(layout.spread(part, shown)) + np.arange(3 * shown.shape[0])
        draft.markers.append((self.name, "edge", tuple(sensors.tolist())))
        whole = csr_array(kron(np.ones((len(letters), 1)), rows))
        draft.constraints.resultants[self.name] = Resultant(
            layout.spread(part, whole),
            np.repeat(letters, len(nodes)),
            np.asarray(whole @ part.constant),
            places.mean(axis=0) + layout.origin,
        )


def whole_solid(where: str, part: Body) -> tuple[Body, Solid]:
    """A body with its mesh; InputError where it is no solid, or a reduced part: a held face is more
    conditions than that has functions, and would lock it.
    """
    shape = part.space
    if not isinstance(shape, Solid) or part.shapes is not None:
        got = f"'{part.name}', a {'reduced part' if isinstance(shape, Solid) else 'body of another type'}"
        raise InputError(say(where, "a solid in full", got, "hold a part at its rims"))
    return part, shape
