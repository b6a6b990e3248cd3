r"""Lines along which a NURBS surface may fold: where they are, derivatives across them, springs
against folding.

    jump(x) = dN/dn_a + dN/dn_b,    n outward unit normals of both sides in the reference surface

Patches that share the functions of an edge are continuous there, free to fold; so is a patch along
an inner knot that is repeated degree times, as in every circle of quadratic arcs.
`penalty_stiffness` keeps the angle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..core.errors import InputError, closest, say
from ..core.storage.records import dataclass
from . import line, nurbs, seams
from . import surface as surfaces
from .surface import VERTICES, Surface
from .table import Floats, Ints

SMOOTH = 1e-6  #: largest sum of the outward unit normals of two sides of a smooth edge
ALPHA = 1e3  #: penalty of a kink over the bending stiffness of one cell


def common_edges(shape: Surface) -> list[tuple[str, str]]:
    """Pairs of lines of cell sides that share functions and no slope: edges that are joined, and
    both sides of inner knots.

    Lines whose slopes are tied (`smoothing`) are none.
    """
    smooth = {
        nurbs.full_name(name, f"xi{axis + 1}_min")
        for name, ties in shape.space.ties.items()
        for axis in (0, 1)
        if 0 in ties[axis]
    }
    names = list(inner_lines(shape))
    edges = [pair for pair in shape.space.joined if not smooth & set(pair)]
    return edges + list(zip(names[::2], names[1::2], strict=True))


def inner_lines(shape: Surface) -> dict[str, Ints]:
    """Cells and sides (i, 2) before and after every inner knot that is repeated degree times:
    `xi1 = 0.25-`, `xi1 = 0.25+`.

    Lines whose slopes are tied are left out.
    """
    found = {}
    begin = 0
    for name, patch in shape.space.patches.items():
        cell = begin + np.arange(patch.cells[0] * patch.cells[1]).reshape(patch.cells[::-1]).T
        begin += cell.size
        for axis, (spline, sides) in enumerate(zip(patch.lines, ((1, 3), (2, 0)), strict=True)):
            for k, knot in enumerate(line.breaks(spline)[1:-1], start=1):
                function = int(np.searchsorted(spline.knots, knot)) - 1
                if (
                    np.count_nonzero(spline.knots == knot) < spline.degree
                    or function in shape.space.ties.get(name, ({}, {}))[axis]
                ):
                    continue
                for sign, place, side in zip("-+", (k - 1, k), sides, strict=True):
                    along = np.take(cell, place, axis)
                    label = nurbs.full_name(name, f"xi{axis + 1} = {float(knot)}{sign}")
                    found[label] = np.stack([along, np.full_like(along, side)], axis=1)
    return found


@dataclass(frozen=True, eq=False)
class Interface:
    """Points along a common edge: d(.)/dn are derivatives along the outward normal of the edge in
    the reference surface.
    """

    normal_a: csr_array  #: (x, n) rows that take coordinates to dr/dn on the first side
    normal_b: csr_array  #: (x, n) the same on the second side
    tangent: csr_array  #: (x, n) rows that take coordinates to the derivative along the edge, by reference length
    weights: Floats  #: (x,) quadrature weights [m]
    sizes: Floats  #: (x,) mean size of the cells of both sides across the edge [m]
    cells: Ints  #: (x, 2) cells of both sides


def between(shape: Surface, edge_a: str, edge_b: str) -> Interface:
    """Quadrature points along the line that two named edges, or both sides of an inner knot, have
    in common, cell by cell.

    InputError for edges whose cells do not meet one to one.
    """
    from scipy.spatial import cKDTree

    a, b = (_named(shape, name) for name in (edge_a, edge_b))
    middle = [_at(shape, sides, np.full(len(sides), 0.5)) for sides in (a, b)]
    touch = 1e-6 * float(np.ptp(shape.reference, axis=0).max())
    distance, partner = cKDTree(middle[1]).query(middle[0])
    ends = [
        _at(shape, sides, np.full(len(sides), value))
        for sides, value in ((a, 0.0), (b[partner], 0.0), (b[partner], 1.0))
    ]
    away = np.stack([np.linalg.norm(ends[0] - other, axis=1) for other in ends[1:]])
    if len(a) != len(b) or distance.max() > touch or away.min(axis=0).max() > touch:
        where = f"interfaces.between: '{edge_a}' and '{edge_b}'"
        got = f"a gap of {max(distance.max(), away.min(axis=0).max()):.3g} m"
        raise InputError(
            say(
                where,
                f"edges of the same cells ({len(a)} and {len(b)})",
                got,
                "refine both sides alike",
            )
        )
    s, w = np.polynomial.legendre.leggauss(shape.order + 1)
    s, w = 0.5 * (s + 1.0), 0.5 * w
    other = np.where((away[0] <= away[1])[:, None], s, 1.0 - s).ravel()
    normal_a, tangent, speed, size_a, outward_a = _frame(
        shape, np.repeat(a, len(s), axis=0), np.tile(s, len(a))
    )
    normal_b, _, _, size_b, outward_b = _frame(shape, np.repeat(b[partner], len(s), axis=0), other)
    _check_smooth(edge_a, edge_b, outward_a + outward_b, SMOOTH)
    cells = np.repeat(np.column_stack([a[:, 0], b[partner, 0]]), len(s), axis=0)
    return Interface(
        normal_a, normal_b, tangent, np.tile(w, len(a)) * speed, 0.5 * (size_a + size_b), cells
    )


def _check_smooth(edge_a: str, edge_b: str, sums: Floats, most: float) -> None:
    """Refuse a line at which the outward normals have sums (x, c) that do not vanish."""
    if (kink := float(np.abs(sums).max())) > most:
        where = f"interfaces.between: '{edge_a}' and '{edge_b}'"
        remedy = "make two bodies that are joined there"
        raise InputError(
            say(
                where,
                "a surface without a kink",
                f"outward normals that differ by {kink:.3g}",
                remedy,
            )
        )


def _named(shape: Surface, edge: str) -> Ints:
    known = {**shape.edges, **inner_lines(shape)}
    if edge not in known:
        raise InputError(
            say(
                "interfaces.between",
                f"an edge of {sorted(known)}",
                f"'{edge}'{closest(edge, known)}",
            )
        )
    return known[edge]


def _at(shape: Surface, sides: Ints, s: Floats) -> Floats:
    """Reference positions (x, c) at fractions of sides."""
    return np.asarray(
        surfaces.sample(shape, sides[:, 0], surfaces.side_points(shape.parent, sides[:, 1], s))
        @ shape.reference
    )


def _frame(
    shape: Surface, sides: Ints, s: Floats
) -> tuple[csr_array, csr_array, Floats, Floats, Floats]:
    """At fractions of sides: rows of the outward normal and tangential derivative, dl/ds, cell
    size, outward unit normal.

    With m the outward normal in the parent and G the metric: n^a = G^ac m_c / sqrt(m G^-1 m), cell
    size 1 / sqrt(m G^-1 m).
    """
    cell, side = sides.T
    xi = surfaces.side_points(shape.parent, side, s)
    rows = [surfaces.sample(shape, cell, xi, k) for k in (1, 2)]
    tangents = np.stack([row @ shape.reference for row in rows], axis=1)
    corners = VERTICES[shape.parent]
    along = np.roll(corners, -1, axis=0)[side] - corners[side]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    raised = np.linalg.solve(tangents @ tangents.swapaxes(1, 2), outward[:, :, None])[:, :, 0]
    length = np.sqrt(np.einsum("xa,xa->x", outward, raised))
    normal = raised / length[:, None]
    speed = np.linalg.norm(np.einsum("xa,xac->xc", along, tangents), axis=1)

    def directed(by: Floats) -> csr_array:
        return csr_array(sum(diags_array(by[:, k]) @ rows[k] for k in (0, 1)))

    unit = np.einsum("xa,xac->xc", normal, tangents)
    return directed(normal), directed(along / speed[:, None]), speed, 1.0 / length, unit


def penalty_stiffness(
    shape: Surface, pairs: Sequence[tuple[str, str]], bending: float | Floats, alpha: float = ALPHA
) -> csr_array:
    """Stiffness (n, n) of springs against folding along common edges, the same for every coordinate
    component.

        K = sum_x w_x alpha D / h_x (dN/dn_a + dN/dn_b)^T (dN/dn_a + dN/dn_b),     D = E t^3 / (12 (1 - nu^2)) [N m]

    `bending` D is one number or one a cell. The sum of the outward derivatives vanishes in every
    rigid motion of a smooth reference shape; alpha as in Herrema et al., Comput. Methods Appl.
    Mech. Engrg. 346 (2019), doi:10.1016/j.cma.2018.08.038. Along seams, where functions differ, its
    means over the multipliers vanish: at all points they would hold nearly all of it.
    """
    for name, value in (("bending", float(np.min(bending))), ("alpha", alpha)):
        if not (np.isfinite(value) and value > 0.0):
            where = f"interfaces.penalty_stiffness, {name}"
            raise InputError(say(where, "a positive number", value, "D = E t^3 / (12 (1 - nu^2))"))
    D = np.broadcast_to(np.asarray(bending, dtype=float), len(shape.nodes))
    total = csr_array((shape.count, shape.count))
    for pair in pairs:
        common = between(shape, *pair)
        jump = common.normal_a + common.normal_b
        total = (
            total
            + jump.T
            @ diags_array(common.weights * alpha * D[common.cells].mean(axis=1) / common.sizes)
            @ jump
        )
    for seam in seams.seams(shape):
        total = total + _weak_penalty(seam, D, alpha)
    return csr_array(total)


def _weak_penalty(seam: seams.Seam, D: Floats, alpha: float) -> csr_array:
    """K = sum_i alpha D_i m_i / h_i J_i^T J_i,  J_i = int mu_i (dN/dn_a + dN/dn_b) ds / m_i,  m_i =
    int mu_i ds.
    """
    shape = seam.a.shape
    u, v, w = seam.points(shape.order + 1)
    one = seam.a.sides(u)
    two = seam.b.sides(v)
    normal_a, _, _, size_a, outward_a = _frame(shape, *one)
    normal_b, _, _, size_b, outward_b = _frame(shape, *two)
    _check_smooth(seam.a.name, seam.b.name, outward_a + outward_b, seams.SMOOTH)
    Q = csr_array((line.sample(*seams.multipliers(seam, v)) * w[:, None]).T)
    m = np.asarray(Q.sum(axis=1)).ravel()
    J = diags_array(1.0 / m) @ Q @ (normal_a + normal_b)
    bending, sizes = (
        Q @ (0.5 * (a + b)) / m for a, b in ((D[one[0][:, 0]], D[two[0][:, 0]]), (size_a, size_b))
    )
    return csr_array(J.T @ diags_array(alpha * bending * m / sizes) @ J)
