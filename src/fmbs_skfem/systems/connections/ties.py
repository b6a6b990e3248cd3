r"""Faces of solids tied to those of others, whatever the meshes of both.

    int psi_i (r_a - r_b) dA = 0    of every node i on the face of a, the finer one                                    (1)

r_b is the position in the cell of b that has the same place in the reference, by the functions of
this cell, which go on where a curved face of one mesh lies a little off that of the other: (1)
holds at any rotation, and a constant stress passes. psi_i are dual to functions n_j of a whose means are positive,
so that (1) solves for nodes one by one:

    int psi_i n_j dA = delta_ij int n_j dA,    n_c = N_c + alpha sum N_m,    n_m = (1 - 2 alpha) N_m

of corners c and the middles m of the sides there. A face is tied that meets the other with half of
its points.

Source: B. Wohlmuth, A. Popp, M. W. Gee, W. A. Wall, Comput. Mech. 49 (2012) 735-747,
doi:10.1007/s00466-012-0704-z (dual quadratic multipliers).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, kron

from ...bodies.body import Body, own
from ...bodies.solids.solid_body import node_rows
from ...core.algebra.linalg import evenly
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from ...shapes import meshes
from ...shapes.solids import elements, facing, solid
from ...shapes.solids.solid import Solid
from .. import fields
from ..measures.resultants import Resultant
from ..places import At, Draft
from .constraint_functions import Joint, where
from .edges import SHOWN, hold
from .faces import whole_solid

DEGREE = 4  #: of the quadrature over a face, times the order: cells of the other side end within it
ALPHA = 0.2  #: by which functions of corners have parts of those of middles
TOUCH = 1e-3  #: of the size of a face: surfaces that are nearer touch
GAP = (
    0.1  #: of the size of a face: named faces of one surface, by two meshes, may be this far apart
)
ALL = 1e-6  #: part of an area that counts as none


class Meeting(NamedTuple):
    """What (1) reads of two solids a and b."""

    nodes: np.ndarray  #: (i,) of a
    other: csr_array  #: (i, m) r_a = other @ r_b of nodes of a
    missed: float  #: part of the area of the faces of a that meets none of b
    cut: float  #: the same of those faces that meet b in part
    place: np.ndarray  #: (3,) of the point of a that is nearest to b [m]
    apart: float  #: its distance over the size of a face there, infinite where none is near


@dataclass(frozen=True)
class Tie(Joint, word="tie"):
    """Faces of two solids tied together, whatever their meshes: what one face does, the other does in
    the mean that its functions weigh. What lies outside of the other face stays free.

        int N_i (r_body - r_to) dA = 0

    Without `faces` and `to_faces` all of the boundary that touches the other body is tied: volumes
    of one mesh, each with its material, are bodies that are tied.

    {type: tie, body: plate, to: block, faces: bottom, to_faces: top}
    """

    name: str
    body: fields.Body
    to: fields.Body
    faces: fields.Names = ()
    to_faces: fields.Names = ()

    @property
    def share_basis(self) -> tuple[str, ...]:
        return self.body, self.to

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.body == self.to:
            yield "to", Problem("another body", f"'{self.to}' itself")

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        part, other = (
            whole_solid(name, layout.body(name, At(body, "")))[0] for body in (self.body, self.to)
        )
        found, turned = self.meeting(part, other)
        one = node_rows(other if turned else part, found.nodes)
        two = own(part if turned else other, found.other)
        rows, of_other = (-two, one) if turned else (one, -two)
        count = len(found.nodes)
        for c in range(3):
            across = np.eye(3)[[c]]
            read = layout.widen(self.body, kron(rows, across))
            read += layout.widen(self.to, kron(of_other, across))
            hold(self, draft, c, read, np.zeros(count))
        draft.constraints.edges.append(self.name)
        shown = one[evenly(0, count - 1, SHOWN)]
        sensors = draft.sensors.add(layout.spread(other if turned else part, shown))
        draft.markers.append(
            (self.name, "edge", tuple(range(sensors, sensors + 3 * shown.shape[0])))
        )
        whole = csr_array(kron(np.ones((3, 1)), rows))
        weights = np.asarray(whole @ part.constant)
        place = weights @ (whole @ part.reference) / (weights @ weights)
        draft.constraints.resultants[self.name] = Resultant(
            layout.spread(part, whole),
            np.repeat(np.arange(3), count),
            weights,
            place + layout.origin,
        )

    def meeting(self, part: Body, other: Body) -> tuple[Meeting, bool]:
        """How the faces meet, by the nodes of the finer one or of that which lies on the other, and
        whether this is that of `to`; InputError where they do not.
        """
        name = where(self)
        one, two = at_place(part), at_place(other)
        ours = faces_of(name, one, self.faces, two)
        theirs = faces_of(name, two, self.to_faces, one)
        near = GAP if self.faces and self.to_faces else TOUCH
        found = meet(one, ours, two, theirs, near), meet(two, theirs, one, ours, near)
        if not any(len(side.nodes) for side in found):
            nearest = min(found, key=lambda side: side.apart)
            got = f"'{self.body}' and '{self.to}'"
            if nearest.apart < near:
                got = f"{got}, no face with half of it"
            elif np.isfinite(nearest.apart):
                at = meshes.position(nearest.place)
                got = f"{got}, apart by {nearest.apart:.2g} of the size of a face at {at}"
            remedy = "name the faces of both, which may be 0.1 of their size apart, or weld rims"
            raise InputError(say(name, "faces that touch", got, remedy))
        missed = min(side.missed for side in found)
        if self.faces and self.to_faces and missed > ALL:
            text = f"{missed:.1%} of the area of its smaller face lies on no face of the other"
            notify(f"{name}: {text}: that part stays free")
        whole = [side.cut < ALL for side in found]
        turned = whole[1] if whole[0] != whole[1] else len(found[1].nodes) > len(found[0].nodes)
        return found[turned], turned


def at_place(part: Body) -> Solid:
    """The mesh of a body where this stands."""
    shape = part.space
    assert isinstance(shape, Solid)
    return replace(shape, reference=node_rows(part, np.arange(shape.count)) @ part.reference)


def faces_of(where: str, shape: Solid, names: tuple[str, ...], other: Solid) -> np.ndarray:
    """Named faces (i, 2) of a solid, without names those of its boundary about another one."""
    if names:
        return solid.face(where, shape, names)
    outer = solid.boundary(shape.kind, shape.nodes)
    places = shape.reference[solid.face_nodes(shape, outer)]
    low, high = places.min(axis=1), places.max(axis=1)
    margin = GAP * (high - low).max(axis=1, keepdims=True)
    box = other.reference.min(axis=0) - margin, other.reference.max(axis=0) + margin
    return np.asarray(outer[np.all((low <= box[1]) & (high >= box[0]), axis=1)])


def meet(a: Solid, faces: np.ndarray, b: Solid, others: np.ndarray, near: float) -> Meeting:
    """Nodes of faces (i, 2) of a solid by those on faces (j, 2) of another one, at points that are
    nearer than `near` times the size of a face.
    """
    N, area, points = solid.face_points(a, faces, DEGREE * a.kind.order)
    face, xi, apart = facing.on_faces(b, others, points.reshape(-1, 3))
    closest = int(np.argmin(apart)) if len(apart) else -1
    place = points.reshape(-1, 3)[closest] if len(apart) else np.zeros(3)
    distance = float(apart[closest]) if len(apart) else np.inf
    on = area * (apart < near).reshape(area.shape)
    tied = (on.sum(axis=1) > 0.5 * area.sum(axis=1)) & np.all(face.reshape(area.shape) >= 0, axis=1)
    met = on.sum(axis=1) > 0.0
    missed = left_over(on, area)
    cut = left_over(on[met], area[met])
    chosen = np.repeat(tied, area.shape[1])
    first = solid.face_nodes(a, faces[tied])
    second = b.nodes[others[face[chosen], 0]].reshape(*area[tied].shape, int(b.kind))
    theirs = elements.basis(b.kind, xi[chosen])[:, 0].reshape(second.shape)
    n = N @ positive(a.kind)
    psi = dual(n, area[tied])
    nodes, same = np.unique(first, return_inverse=True)
    total = np.bincount(same.ravel(), np.einsum("pj,fp->fj", n, area[tied]).ravel())
    values = np.einsum("fp,fpj,fpk->fpjk", area[tied], psi, theirs)
    row, column = np.broadcast_arrays(
        same.reshape(first.shape)[:, None, :, None], second[:, :, None, :]
    )
    entries = (values.ravel(), (row.ravel(), column.ravel()))
    means = diags_array(1.0 / total) @ coo_array(entries, shape=(len(nodes), b.count)).tocsr()
    other = csr_array(at_nodes(a.kind, same.reshape(first.shape), len(nodes)) @ means)
    return Meeting(nodes, other, missed, cut, place, distance)


def left_over(on: np.ndarray, area: np.ndarray) -> float:
    """The part of an area (f, p) that is not `on` (f, p); all of none."""
    return float(1.0 - on.sum() / area.sum()) if len(area) else 1.0


def positive(kind: elements.Kind) -> np.ndarray:
    """T (j, j) of functions n = N T of a face whose means are positive."""
    count = elements.face_nodes(kind).shape[1]
    corners = elements.faces(kind).shape[1]
    T = np.eye(count)
    if kind.order == 2:
        for c in range(corners):
            T[corners + c, corners + c] = 1.0 - 2.0 * ALPHA
            T[[corners + c, corners + (c - 1) % corners], c] = ALPHA
    return T


def dual(n: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Functions psi (f, p, j) of faces dual to n (p, j) at points with weights (f, p).

    int psi_i n_j dA = delta_ij int n_j dA
    """
    square = np.einsum("fp,pi,pj->fij", weights, n, n)
    total = np.einsum("fp,pj->fj", weights, n)
    return np.asarray((n @ np.linalg.inv(square)) * total[:, None, :])


def at_nodes(kind: elements.Kind, faces: np.ndarray, count: int) -> csr_array:
    """T (i, i) of the values at nodes by those of the functions n, of faces of nodes (f, j)."""
    T = positive(kind)
    j, k = np.nonzero(T)
    row, column = faces[:, j].ravel(), faces[:, k].ravel()
    pairs, once = np.unique(np.column_stack([row, column]), axis=0, return_index=True)
    values = np.tile(T[j, k], len(faces))[once]
    return csr_array((values, tuple(pairs.T)), shape=(count, count))
