r"""Supports and loads along named edges of plates and over their surface.

    edge         u . e_c = 0,  (u,n) . e_c = 0 along the edge        rim nodes      (|r_i - r_b|^2 - R_i^2) / 2 = 0
    surface      w_b = int N_b dA                                    edge load      w_b = int N_b ds

u is the displacement and u,n its derivative across the edge. The trace of the interpolation on an
edge determines some functions by others, q_i + X_ij q_j = 0 for a trace of zero; each such function
has one linear row, so that no row is redundant. A derivative u,n alone is held as far as the
functions across the edge reach (`edge_slopes`): where lines of the surface meet the edge at an
angle that varies, it is zero in the mean of least squares, since zero at all points would hold u
along the edge as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron, vstack

from ...bodies import edge_directions
from ...bodies.body import Body, own
from ...bodies.plate import edge, local_first, trace
from ...core.algebra import ranks
from ...core.algebra.linalg import distinct, entries, evenly
from ...core.errors import InputError, listed, say
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from ...shapes import surface
from ...shapes.nurbs import Nurbs
from ...shapes.solids.skin import surface_of
from ...shapes.surface import Surface
from .. import fields
from ..measures.resultants import Resultant
from ..places import QUARTER, At, Draft
from . import edge_slopes
from .constraint_functions import Joint, far, needs_other_side, where

SHOWN = 5  #: points of a held edge, and arrows of a load over an edge or a surface, in pictures


@dataclass(frozen=True)
class Edge(Joint):
    """Edges of a plate held to the ground: components of the displacement (`fixed`, all by
    default), and of its derivative across.

    For a plate in x, y with an edge along y: clamped is slope `z`, hinged none, a plane of symmetry
    is fixed `x`, slope `yz`. Sides that meet in one line to 1e-4 rad, or to what the digits of
    their file state, are straight. Other nodes are corners, where both slopes are held;
    `fmbs check --all` counts them.

    {type: edge, body: plate, edges: [left, right], slope: z}
    """

    name: str
    body: fields.Body
    edges: fields.Names
    fixed: fields.Letters | None = None
    slope: fields.Letters = ""

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.fixed == "" and not self.slope:
            yield (
                "fixed",
                Problem(
                    "a component of displacement or slope that is held", "none", "delete the joint"
                ),
            )

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        dim = draft.layout.dim
        part, shape = whole_shape(name, draft, self.body)
        positions = components(
            f"{name}.fixed", AXES[:dim] if self.fixed is None else self.fixed, dim
        )
        slopes = components(f"{name}.slope", self.slope, dim)
        sides = edge(name, shape, self.edges)
        kinds = {(c in positions, c in slopes) for c in range(dim)} - {(False, False)}
        rows = {kind: held(part, shape, sides, *kind) for kind in kinds}
        order = [(c, rows[c in positions, c in slopes]) for c in sorted({*positions, *slopes})]
        for c, mine in order:
            read = draft.layout.widen(self.body, kron(mine, np.eye(dim)[[c]]))
            hold(self, draft, c, read, mine @ part.reference[:, c])
        whole = csr_array(vstack([mine for _, mine in order]))
        draft.constraints.edges.append(self.name)
        show(self, draft, part, shape, sides)
        weights = edge_weights(part, shape, sides)[:, 0]
        draft.constraints.resultants[self.name] = Resultant(
            draft.layout.spread(part, whole),
            np.repeat([c for c, _ in order], [mine.shape[0] for _, mine in order]),
            np.asarray(whole @ part.constant),
            weights @ part.reference / (weights @ part.constant) + draft.layout.origin,
        )


@dataclass(frozen=True)
class RimNodes(Joint):
    """Every node on edges of a plate keeps its distance to a place or a fixed point, so that the
    rim itself may deform.

    {type: rim_nodes, body: plate, edges: hole, to: pin.center}
    """

    name: str
    body: fields.Body
    edges: fields.Names
    to: fields.OtherEnd

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_other_side(self.to)

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        part, shape = whole_shape(name, draft, self.body)
        sides = edge(name, shape, self.edges)
        show(self, draft, part, shape, sides)
        cell, side = sides.T
        ends = [surface.side_points(shape.parent, side, np.full(len(side), s)) for s in (0.0, 1.0)]
        rows = own(part, surface.sample(shape, np.tile(cell, 2), np.concatenate(ends)))
        center = layout.reference(name, self.to)
        apart = np.asarray(rows @ part.reference) - center
        size = np.ptp(apart, axis=0).max()
        if np.linalg.norm(apart, axis=1).min() <= 1e-7 * size:
            raise InputError(
                say(
                    f"{name}.to",
                    "a place away from every node",
                    center,
                    "hold a single node with a pin",
                )
            )
        grid = np.round(apart / (1e-7 * size)).astype(np.int64)
        nodes = np.sort(np.unique(grid, axis=0, return_index=True)[1])
        block = layout.spread(part, rows[nodes])
        if isinstance(self.to, At):
            pin = csr_array(kron(np.ones((len(nodes), 1)), layout.read(name, self.to)))
            first = draft.probes.add(csr_array(block - pin))
        else:
            first = draft.probes.add(block, -np.tile(center, len(nodes)))
        for k, node in enumerate(nodes):
            terms = far(first + k * layout.dim, layout.dim, float(np.linalg.norm(apart[node])))
            draft.constraints.row(self.name, f"node {k + 1}", *terms)


def hold(joint: Joint, draft: Draft, c: int, read: csr_array, values: np.ndarray) -> None:
    """Rows of a joint that keep what `read` (k, q) reads of component c at its values (k,) [m]."""
    first = draft.probes.add(read)
    for k, value in enumerate(values):
        label = f"{AXES[c]} {k + 1}"
        draft.constraints.row(
            joint.name, label, (1.0, -1, first + k, -1), (-float(value), -1, -1, -1)
        )


def show(
    joint: Edge | RimNodes, draft: Draft, part: Body, shape: Surface, sides: np.ndarray
) -> None:
    """Let pictures show a held edge at the middles of some of its sides."""
    rows = sensed(draft, part, shape, *middles(shape, sides))
    draft.markers.append((joint.name, "edge", tuple(rows.ravel().tolist())))


def outward(draft: Draft, part: Body, shape: Surface, sides: np.ndarray, size: float) -> np.ndarray:
    """Rows (x, 2) of sensors that read `size` times the outward normal where `middles` are, of a
    surface in the plane.

    The normal is as long as the slope along the side.
    """
    cell, side = thinned(sides).T
    xi = surface.side_points(shape.parent, side, np.full(len(side), 0.5))
    slopes = [surface.sample(shape, cell, xi, k) for k in (1, 2)]
    along = surface.along(
        shape, slopes[0] @ part.shape_reference, slopes[1] @ part.shape_reference, side
    )
    rows = own(part, csr_array(sum(diags_array(size * along[:, k]) @ slopes[k] for k in range(2))))
    turned = csr_array(kron(eye_array(len(side)), -QUARTER) @ draft.layout.spread(part, rows))
    return draft.sensors.add(turned) + np.arange(turned.shape[0]).reshape(-1, 2)


def middles(shape: Surface, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cells (x,) and parent points (x, 2) of the middles of some of the sides (i, 2), or of the
    cells (i,).

    They are chosen evenly, for pictures.
    """
    some = thinned(sides)
    if some.ndim == 1:
        return some, np.tile(surface.VERTICES[shape.parent].mean(axis=0), (len(some), 1))
    cell, side = some.T
    return cell, surface.side_points(shape.parent, side, np.full(len(side), 0.5))


def thinned(sides: np.ndarray) -> np.ndarray:
    """Some of the sides (i, 2) or cells (i,), evenly."""
    return np.asarray(sides[evenly(0, len(sides) - 1, SHOWN)])


def sensed(
    draft: Draft,
    part: Body,
    shape: Surface,
    cell: np.ndarray,
    xi: np.ndarray,
    derivative: int = 0,
    factor: float = 1.0,
) -> np.ndarray:
    """Rows (x, c) of sensors that read a surface at parent points xi (x, 2) of cells (x,), times a
    factor.

    With `derivative` k they read one of its derivatives by parent coordinates, numbered as in
    `surface.sample`.
    """
    rows = draft.layout.spread(
        part, own(part, factor * surface.sample(shape, cell, xi, derivative))
    )
    return draft.sensors.add(rows) + np.arange(rows.shape[0]).reshape(len(cell), -1)


def shape_of(name: str, draft: Draft, body: str) -> tuple[Body, Surface]:
    """A body with its surface, of a solid its boundary; InputError, after `name`, where it does not
    exist or has none.
    """
    part = draft.layout.body(name, At(body, ""))
    shape = surface_of(part.space)
    if shape is None:
        raise InputError(say(name, "a plate, shell or solid", f"'{body}', which is none"))
    return part, shape


def whole_shape(name: str, draft: Draft, body: str) -> tuple[Body, Surface]:
    """A body with its surface, no reduced part: a held edge is more conditions than that has
    functions, and would lock it.
    """
    part, shape = shape_of(name, draft, body)
    if part.shapes is not None:
        remedy = "hold a part at rims or at named points, which its functions know, or take the full body here"
        raise InputError(say(name, "a full body", f"'{body}', a reduced part", remedy))
    return part, shape


def components(name: str, letters: str, dim: int) -> list[int]:
    """Numbers of components by their letters."""
    if not set(letters) <= set(AXES[:dim]) or len(set(letters)) < len(letters):
        raise InputError(say(name, f"letters of {AXES[:dim]}, each once", f"'{letters}'"))
    return [AXES.index(letter) for letter in letters]


def held(part: Body, shape: Surface, sides: np.ndarray, position: bool, slope: bool) -> csr_array:
    """Rows (i, b) whose displacements vanish where those of the edge (and of the derivative across
    it) do.
    """
    if edge_directions.derivatives(shape.space) is not None:
        first, second, X = edge_directions.determined(shape, sides, position, slope)
    elif position:
        first, second, X = ranks.determined(trace(shape, sides, slope))
    else:
        first, second, X = edge_slopes.across(shape, sides)
    i, j, x = entries(X)
    values = np.concatenate([np.ones(len(first)), x])
    places = (np.concatenate([np.arange(len(first)), i]), np.concatenate([first, second[j]]))
    rows = own(part, csr_array(coo_array((values, places), shape=(len(first), shape.count))))
    # a corner of two patches is one point of the body
    tied = isinstance(shape.space, Nurbs) and shape.space.seams
    return (
        csr_array(rows[ranks.independent_rows(rows[:, distinct(rows.indices)])]) if tied else rows
    )


def surface_weights(part: Body, shape: Surface, cells: np.ndarray, normal: bool) -> np.ndarray:
    """Weights of surface loads over some cells (i,) [m2].

        int N_b dA (b, 1)    or    int N_b n dA (b, 3)

    with the unit normal n of the reference; b counts the functions of the body.
    """
    reference = part.shape_reference
    table = surface.tabulate(shape)
    nodes = shape.nodes[cells]
    values = table.values[cells]
    area = local_first(values, table.weights[cells], reference[nodes])[1]
    tangents = np.einsum("epkb,ebc->epkc", values[:, :, 1:3], reference[nodes])
    field = surface.local_axes(tangents)[1] if normal else np.ones((*area.shape, 1))
    return gathered(part, shape, nodes, np.einsum("epb,epc,ep->ebc", values[:, :, 0], field, area))


def edge_weights(part: Body, shape: Surface, sides: np.ndarray) -> np.ndarray:
    """Weights of edge loads over sides of cells, pairs (i, 2) of a cell and a side [m].

        int N_b ds (b, 1)

    b counts the functions of the body.
    """
    x, w = np.polynomial.legendre.leggauss(shape.order + 1)
    cell, side = np.repeat(sides, len(x), axis=0).T
    xi = surface.side_points(shape.parent, side, np.tile(0.5 + 0.5 * x, len(sides)))
    values = surface.basis(shape.space, cell, xi)
    corners = surface.VERTICES[shape.parent]
    along = corners[(side + 1) % int(shape.parent)] - corners[side]
    reference = part.shape_reference
    tangent = np.einsum("xa,xab,xbc->xc", along, values[:, 1:3], reference[shape.nodes[cell]])
    length = np.linalg.norm(tangent, axis=1) * np.tile(0.5 * w, len(sides))
    return gathered(part, shape, shape.nodes[cell], (values[:, 0] * length[:, None])[:, :, None])


def gathered(part: Body, shape: Surface, nodes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sum of values (e, b, c) over cells, on the functions of the body (b, c)."""
    total = np.zeros((shape.count, values.shape[2]))
    np.add.at(total, nodes, values)
    return total if part.spread is None else np.asarray(part.spread.T @ total)


def chosen(name: str, shape: Surface, faces: Iterable[str]) -> np.ndarray:
    """Cells (i,) of named faces, each once; all of them without names. InputError, after `name`,
    for a face that is not there.
    """
    names = tuple(faces)
    unknown = [face for face in names if face not in shape.faces]
    if unknown:
        raise InputError(
            say(
                name,
                f"one of its faces ({listed(sorted(shape.faces), unknown[0], 'none')})",
                f"'{unknown[0]}'",
            )
        )
    return (
        distinct(np.concatenate([shape.faces[face] for face in names]))
        if names
        else np.arange(len(shape.nodes))
    )
