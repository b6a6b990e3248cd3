r"""What an edge holds at its nodes, decided by directions: the line of the edge, its normal, or
everything at a corner.

    u = 0 along a side           u = 0,  u,d = 0  [, u,dd = 0]  at its ends,      d along the side
    u,n = 0 along a side         u,n = 0 [, u,nd = 0]           at its ends,      n across it    [, u,n = 0 in its middle]

for interpolations whose nodes have u and its derivatives (`derivatives`): those say what u and u,n
are along a side. Sides that meet at a node in one line to ANGLE, or to what the digits of their
coordinates can state, have one direction there, the mean; directions at right angles to so much are
at right angles. Any other pair of directions is a corner. So a straight edge that the digits of a
file bend stays one line, whatever its direction, and edges held by several joints say the same
where they meet.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..core.algebra import ranks
from ..core.algebra.linalg import distinct
from ..shapes import ancf_plate, fvs_plate, plate_audit, skfem_surface
from ..shapes import surface as surfaces
from ..shapes.surface import Parent, Surface
from ..shapes.table import Floats, Ints

#: angle of sides that are one line [rad]: 6 digits bend sides of a 32nd by 3e-5. A hinged square
#: whose sides are bent at every node by half of it, with alternating signs, deflects by less than
#: 1e-6 of the exact deflection differently
ANGLE = 1e-4
COARSE = 1e-2  #: angle [rad] that is a corner whatever the digits
UPRIGHT = 0.05  #: cosine of the angle between lines at the end of an edge below which they meet at a right angle

#: fractions of a side, whose values say the slopes (2, 6) at its ends: polynomials up to degree 5
PLACES = np.linspace(0.0, 1.0, 6)
RATES = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0], np.arange(6.0)]) @ np.linalg.inv(
    np.vander(PLACES, increasing=True)
)

FIRST = np.array([(0, 0), (1, 0), (0, 1)])  #: r and its slopes
MIXED = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
SECOND = np.array([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)])


class SideEnds(NamedTuple):
    """Ends of sides, two a side."""

    functions: Ints  #: (x, k) of the node of every end
    along: Floats  #: (x, 2) derivative along the side, on the two slopes of the node


class NodeLines(NamedTuple):
    """The lines of the surface at a node, those of its border and of named edges."""

    turn: Floats  #: (2, 2) L^T of the metric L L^T of the slopes: L^T d has the length and angles of d
    lines: Floats  #: (j, 2) unit directions L^T d
    angle: float  #: to which directions are known [rad]


@singledispatch
def derivatives(space: Any) -> Ints | None:
    """Orders (k, 2) of the derivatives of r that every node has, r first; None for other
    interpolations.

    Functions of cells are numbered node by node, and behind them one slope across every side, in
    its middle, where there are any.
    """
    return None


@derivatives.register(ancf_plate.PlateTangents)
@derivatives.register(fvs_plate.Conforming)
def _(space: Any) -> Ints:
    return FIRST


@derivatives.register
def _(space: skfem_surface.Global) -> Ints:
    return MIXED if space.coefficients.shape[2] == len(MIXED) * int(Parent.SQUARE) else SECOND


# ------------------------------------------------------------------------------------------------------------------ what is held
def determined(
    shape: Surface, sides: Ints, position: bool, slope: bool
) -> tuple[Ints, Ints, csr_array]:
    """Functions that conditions along sides (i, 2) determine by the others, pairs of a cell and a
    number of its side.

        q[first] + X q[second] = 0    where u = 0 (`position`), u,n = 0 (`slope`)

    first (i,), second (j,), X (i, j).
    """
    orders = derivatives(shape.space)
    assert orders is not None
    found = []
    size = len(orders)
    for functions, mine, node in nodes_of(shape, sides):
        rows = conditions(orders, node, mine, position, slope)
        found += [(functions[i], functions[j], x) for i, j, x in solved(rows)]
    if slope and shape.nodes.shape[1] > size * int(shape.parent):
        cell, side = sides.T
        found += [
            (middle, np.zeros(0, np.int64), np.zeros(0))
            for middle in distinct(shape.nodes[cell, size * int(shape.parent) + side])
        ]
    found.sort(key=lambda row: int(row[0]))
    first = np.array([row for row, _, _ in found], dtype=np.int64)
    columns = np.concatenate([np.zeros(0, np.int64), *(others for _, others, _ in found)])
    second = distinct(columns)
    values = np.concatenate([np.zeros(0), *(x for _, _, x in found)])
    indptr = np.append(0, np.cumsum([len(x) for _, _, x in found]))
    return (
        first,
        second,
        csr_array(
            (values, np.searchsorted(second, columns), indptr), shape=(len(first), len(second))
        ),
    )


def corners(shape: Surface, sides: Ints) -> tuple[int, int]:
    """Nodes of sides (i, 2), and how many of them are corners, where sides have several directions."""
    found = [len(mine) for _, mine, _ in nodes_of(shape, sides)]
    return len(found), sum(count > 1 for count in found)


def conditions(orders: Ints, node: NodeLines, mine: Ints, position: bool, slope: bool) -> Floats:
    """Rows (i, k) on the functions of a node that vanish where u, u,n do along its lines `mine`
    (j,), each of which may end there.

    A number in `mine` below zero, ~k, is line k that ends there.
    """
    rows = [derivative(orders)] if position else []
    for k in mine:
        d = node.lines[max(k, ~k)]
        n = across(node, d, k < 0)
        rows += (
            [derivative(orders, on_slopes(node, d)), derivative(orders, *[on_slopes(node, d)] * 2)]
            if position
            else []
        )
        rows += (
            [
                derivative(orders, on_slopes(node, n)),
                derivative(orders, on_slopes(node, n), on_slopes(node, d)),
            ]
            if slope
            else []
        )
    return np.array(rows)


def across(node: NodeLines, d: Floats, ends: bool) -> Floats:
    """The direction L^T n across a line L^T d; where the line ends, another line that is upright on
    it says which.
    """
    n = np.array([-d[1], d[0]])
    cosine = np.abs(node.lines @ d)
    best = int(np.argmin(cosine))
    return node.lines[best] if ends and cosine[best] <= UPRIGHT else n


def on_slopes(node: NodeLines, d: Floats) -> Floats:
    """A unit direction L^T d on the slopes of the node, without round-off."""
    found = np.linalg.solve(node.turn, d)
    return np.where(np.abs(found) < ranks.NOISE, 0.0, found)


def derivative(orders: Ints, *along: Floats) -> Floats:
    """The derivative of r along none, one or two directions.

        u,d  = d_1 u,1 + d_2 u,2
        u,dn = d_1 n_1 u,11 + (d_1 n_2 + d_2 n_1) u,12 + d_2 n_2 u,22

    on the functions (k,) of a node, of directions (2,).
    """
    if not along:
        return np.asarray((orders.sum(axis=1) == 0).astype(float))
    table = along[0] if len(along) == 1 else np.outer(*along)
    row = np.zeros(len(orders))
    for at, value in np.ndenumerate(table):
        order = np.bincount(at, minlength=2)
        row[(orders == order).all(axis=1)] += value
    return row


def solved(rows: Floats) -> list[tuple[int, Ints, Floats]]:
    """Functions (i) of a node that rows (r, k) determine, by others (j,).

        q_i + x q[j] = 0

    Directions of a node differ by ANGLE at least or not at all, so that ranks are clear.
    """
    order, found = ranks.pivots(rows.T)
    count = int((found > 0.25 * ANGLE).sum())
    first = np.sort(order[:count])
    rest = np.setdiff1d(np.flatnonzero(rows.any(axis=0)), first)
    X = np.linalg.lstsq(rows[:, first], rows[:, rest])[0]
    return [
        (int(i), rest[kept := np.abs(x) > ranks.EXACT], x[kept])
        for i, x in zip(first, X, strict=True)
    ]


# -------------------------------------------------------------------------------------------------------------------- directions
def nodes_of(shape: Surface, sides: Ints) -> list[tuple[Ints, Ints, NodeLines]]:
    """Functions (k,) of every node on sides (i, 2), the numbers (j,) of its lines that sides have,
    and all of its lines.

    A line that one side alone has ends at the node; its number is ~k.
    """
    known = np.unique(np.concatenate([border(shape), *shape.edges.values(), sides]), axis=0)
    every = ends_of(shape, known)
    mine = np.repeat(is_among(known, sides), 2)
    order = np.argsort(every.functions[:, 0], kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(every.functions[order, 0])) + 1)
    found = []
    for group in groups:
        if not mine[group].any():
            continue
        functions = every.functions[group[0]]
        node, label = node_of(shape.reference[functions[1:3]], every.along[group], shape.resolution)
        lines, times = np.unique(label[mine[group]], return_counts=True)
        found.append((functions, np.where(times == 1, ~lines, lines), node))
    return found


def is_among(rows: Ints, some: Ints) -> np.ndarray:
    """Whether rows (x, 2) are among some (i, 2)."""
    width = int(max(rows[:, 1].max(), some[:, 1].max())) + 1
    return np.isin(rows @ [width, 1], some @ [width, 1])


def border(shape: Surface) -> Ints:
    """Cells and sides (i, 2) whose nodes no other cell has."""
    count = int(shape.parent)
    corners = functions_of(shape)[:, :, 0]
    keys = plate_audit.side_keys(plate_audit.sides(corners), shape.count).ravel()
    _, first, times = np.unique(keys, return_index=True, return_counts=True)
    return np.column_stack(np.divmod(first[times == 1], count))


def functions_of(shape: Surface) -> Ints:
    """Functions (e, v, k) of the nodes of every cell."""
    orders = derivatives(shape.space)
    assert orders is not None
    count = int(shape.parent)
    return shape.nodes[:, : count * len(orders)].reshape(len(shape.nodes), count, len(orders))


def ends_of(shape: Surface, sides: Ints) -> SideEnds:
    """The ends of sides (i, 2), two of each."""
    count = int(shape.parent)
    cell, side = np.repeat(sides, 2, axis=0).T
    vertex = (side + np.tile([0, 1], len(sides))) % count
    functions = functions_of(shape)
    # by values along the side: derivatives in a corner are those of one of the parts of a cell,
    # which differ in the parent
    at = np.repeat(sides, len(PLACES), axis=0).T
    xi = surfaces.side_points(shape.parent, at[1], np.tile(PLACES, len(sides)))
    values = surfaces.basis(shape.space, at[0], xi)[:, 0].reshape(len(sides), len(PLACES), -1)
    rates = np.einsum("is,xsb->xib", RATES, values).reshape(2 * len(sides), -1)
    slopes = vertex[:, None] * functions.shape[2] + [1, 2]
    return SideEnds(functions[cell, vertex], np.take_along_axis(rates, slopes, axis=1))


def node_of(slopes: Floats, along: Floats, resolution: float) -> tuple[NodeLines, Ints]:
    """The lines of a node whose slopes are (2, c) in the reference, of the ends of sides (x, 2)
    there; and the line (x,) of each.

    `resolution` is that of the coordinates [m].
    """
    turn = np.asarray(np.linalg.cholesky(slopes @ slopes.T).T)
    given = along @ turn.T
    length = np.linalg.norm(given, axis=1)
    # both ends of a side are off by sqrt(3) times the resolution at most
    stated = 2.0 * np.sqrt(3.0) * resolution * float(np.sum(np.sort(1.0 / length)[-2:]))
    angle = max(ANGLE, min(COARSE, stated))
    sums: list[Floats] = []
    label = np.zeros(len(given), np.int64)
    for k, d in enumerate(given):
        near = [j for j, line in enumerate(sums) if abs(sine(d, line)) <= angle]
        if near:
            label[k] = near[0]
            sums[near[0]] = sums[near[0]] + d * np.sign(d @ sums[near[0]])
        else:
            label[k] = len(sums)
            sums.append(d)
    lines: list[Floats] = []
    for total in sums:
        others = [
            *lines,
            *(np.array([-d[1], d[0]]) for d in lines),
            *(turn.T / np.linalg.norm(turn.T, axis=1)[:, None]),
        ]
        same = [one for one in others if abs(sine(total, one)) <= angle]
        lines.append(same[0] if same else total / np.linalg.norm(total))
    return NodeLines(turn, np.asarray(lines), angle), label


def sine(a: Floats, b: Floats) -> float:
    """Sine of the angle between two directions (2,).

        (a x b) / (|a| |b|)

    with the sign of a turn from a to b.
    """
    return float((a[0] * b[1] - a[1] * b[0]) / (np.linalg.norm(a) * np.linalg.norm(b)))
