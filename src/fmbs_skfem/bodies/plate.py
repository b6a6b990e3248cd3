r"""Thin plates and shells: an interpolated surface with the membrane law in the plane, the
Kirchhoff-Love law in space.

At every quadrature point the derivatives of the basis are turned into local coordinates s in which
the reference tangents are
orthonormal,  N,i = (A^-1)_ia N,a,   N,ij = (A^-1)_ia (A^-1)_jb N,ab,   A_ai = r0,a . t_i,  so that the laws see a unit metric (the
term of A's own derivative is tangential and drops out of n . r,ij). The mass m_ij = int rho t N_i
N_j dA is constant.

A rim is slaved to a rigid frame (c, e1, e2 [, e3]): positions along named edges follow r = c + X e1
+ Y e2 [+ Z e3] exactly, and so does the derivative across the edge if that is asked for. The slaved
functions are q = spread @ (free functions, frames): no multiplier is needed.

NURBS patches with a common edge share its functions, and a patch may be continuous only across an
inner knot. In space slopes are tied there, exactly where that is possible (`smoothing.tied`), else
by constant springs (`interfaces.penalty_stiffness`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np
from scipy.sparse import block_array, coo_array, csr_array, diags_array, vstack

from ..core.algebra import ranks
from ..core.algebra.linalg import distinct, entries, is_identity
from ..core.errors import InputError, closest, listed, require_positive, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.fields import Names, Position
from ..shapes import nurbs, smoothing
from ..shapes import surface as surfaces
from ..shapes.surface import Surface
from . import edge_directions, patches
from .body import Body, Cells, place, scatter_blocks
from .laws import Law
from .sections import Material
from .values import of_plate

ROUND_OFF = 1e-15  #: coordinate in a frame, over the largest, that is zero: what is left out of 1e-12 strains a plate at rest
SAMPLES = 8  #: points along a cell's side at which functions of an edge are distinguished
UNSEEN = 1e-9  #: trace of a function, over its values beside the edge, that counts as zero


@dataclass(frozen=True)
@checked
class Rim:
    """Edges that move as one rigid frame: names of edge groups, and its origin (the centre of a
    circle, or the middle) [m].

    With `slopes` the derivative across the edge follows the frame too: the plate is clamped to it.
    Without, it is hinged there, with a notice in space unless that is said (False).
    """

    edges: Names
    center: Position | None = None
    slopes: bool | None = None


def plate(
    name: str,
    shape: Surface,
    thickness: float | np.ndarray,
    material: Material,
    *,
    dim: int = 3,
    rims: Mapping[str, Rim] | None = None,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
) -> Body:
    """Plate or shell of a surface; planar (dim 2) ones carry membrane forces only.

    `thickness` [m] is one number or one a cell (e,); `rims` makes rigid frames of named edges;
    `origin` (c,) [m] and `rotation` (c, c) place the reference shape:

        x <- origin + rotation x

    InputError where a thickness is not positive, a rim has the name of a point of the mesh or an
    edge that the surface does not have, edges of two rims share a side, patches are in several
    pieces, or points of a planar body are out of the plane.

        >>> from fmbs_skfem.bodies import Material, plate
        >>> from fmbs_skfem.shapes import nurbs
        >>> shape = nurbs.surface(*nurbs.rectangle(2.0, 1.0, 4, 2))
        >>> sheet = plate.plate("sheet", shape, 0.01, Material(70e9, 2700.0, 0.3))
        >>> f"{sheet.total_mass:.1f} kg"
        '54.0 kg'
    """
    where = f"body '{name}'"
    require_positive(where, thickness=float(np.min(thickness)))
    if both := sorted(set(rims or {}) & set(shape.points)):
        got = f"the rim '{both[0]}' beside a point of the mesh of that name"
        raise InputError(say(where, "names of rims and points that differ", got, "rename the rim"))
    patches.tell_closed(where, shape)
    if dim == 3:
        tell_hinged(where, rims or {})
    shape = (
        smoothing.tie_slopes(shape) if dim == 3 and isinstance(shape.space, nurbs.Nurbs) else shape
    )
    shape, seams = patches.tie(shape)
    # about the shape's own origin: far from it digits are lost
    turned = place(where, shape.reference, dim, None, rotation)
    reference = (
        turned if origin is None else turned + np.outer(shape.unit, np.asarray(origin, dtype=float))
    )
    spread, free, centers = tie_rims(where, shape, reference, rims or {}, seams)
    patches.check_one_piece(where, shape, spread)
    own_reference = np.concatenate(
        [reference[free], *(np.vstack([c, np.eye(dim)]) for c in centers)]
    )
    zero = np.zeros((dim + 1) * len(centers))
    zero[:: dim + 1] = 1.0
    # derivatives of positions far from the origin of a file would have lost their digits: strains
    # of nothing
    near = turned - np.outer(shape.unit, turned[np.argmax(shape.unit)])
    mass = mass_matrix(shape, near, thickness, material.density)
    springs = patches.fold_springs(where, shape, thickness, material) if dim == 3 else None
    return Body(
        name=name,
        reference=own_reference,
        mass=csr_array(spread.T @ mass @ spread),
        constant=np.concatenate([shape.unit[free], zero]),
        places=dict(shape.points),
        space=shape,
        cells=cells(shape, near, thickness, material),
        radius=0.5 * float(np.mean(thickness)),
        frames={rim: len(free) + k * (dim + 1) for k, rim in enumerate(rims or {})},
        thickness=thickness,
        spread=None if is_identity(spread) else spread,
        stiffness=None if springs is None else csr_array(spread.T @ springs @ spread),
        values=of_plate(material, thickness),
        yield_strength=material.yield_strength or 0.0,
    )


def tell_hinged(where: str, rims: Mapping[str, Rim]) -> None:
    """A notice of rims in space about which the plate turns without having been asked to."""
    if names := [name for name, rim in rims.items() if rim.slopes is None]:
        text = (
            "the plate is hinged to its frame, not clamped: nothing holds its slope across the edge"
        )
        remedy = "say {edges: ..., slopes: true} to clamp it, 'slopes: false' if that is meant"
        notify(f"{where}, {'rims' if names[1:] else 'rim'} {listed(names)}: {text}; {remedy}")


def local_table(
    values: np.ndarray, weights: np.ndarray, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives 1, 2, 11, 22, 12 in local coordinates (e, p, 5, b), area weights (e, p) [m2], and
    n . r0,ij (e, p, 3) [1/m].

        N,i = (A^-1)_ia N,a,   N,ij = (A^-1)_ia (A^-1)_jb N,ab,   A_ai = r0,a . t_i,   dA = |det A| dxi

    Of a table (e, p, 6, b) of values and derivatives 1, 2, 11, 22, 12 by parent coordinates, its
    weights (e, p), and reference coordinates (e, b, c) of the cells [m]; t_i are orthonormal
    tangents, n is the unit normal. In the plane n . r0,ij is zero.
    """
    first, area, inverse, normal = local_first(values, weights, reference)
    second = values[:, :, [3, 5, 5, 4]].reshape(*values.shape[:2], 2, 2, -1)
    second = np.einsum("epia,epjd,epadb->epijb", inverse, inverse, second)
    local = np.concatenate(
        [first, np.stack([second[:, :, 0, 0], second[:, :, 1, 1], second[:, :, 0, 1]], axis=2)],
        axis=2,
    )
    if reference.shape[2] == 2:
        return local, area, np.zeros((*weights.shape, 3))
    return local, area, np.einsum("epkc,epc->epk", on_nodes(local[:, :, 2:], reference), normal)


def local_first(
    values: np.ndarray, weights: np.ndarray, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives 1, 2 in local coordinates (e, p, 2, b), area weights (e, p) [m2], A^-1 (e, p, 2,
    2), normals (e, p, c).

    Of a table (e, p, 3 or more, b) as in `local_table`, of which values and first derivatives are
    read, its weights (e, p), and reference coordinates (e, b, c) [m].
    """
    tangents = on_nodes(values[:, :, 1:3], reference)
    axes, normal = surfaces.local_axes(tangents)
    inverse = np.linalg.inv(tangents @ np.swapaxes(axes, 2, 3))
    return inverse @ values[:, :, 1:3], weights / np.abs(np.linalg.det(inverse)), inverse, normal


def on_nodes(rows: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
    """Rows (e, p, k, b) times the coordinates (e, b, c) of every cell: (e, p, k, c).

        sum_b rows[e, p, k, b] coordinates[e, b, c]

    By one product of matrices a cell.
    """
    cells, points, count, basis = rows.shape
    return np.asarray(
        (rows.reshape(cells, points * count, basis) @ coordinates).reshape(cells, points, count, -1)
    )


def cells(
    shape: Surface, reference: np.ndarray, thickness: float | np.ndarray, material: Material
) -> Cells:
    """Cells of the membrane (two components) or shell law, with numbers that are made when they are
    needed.

    `reference` (j, c) are the coordinates of the functions of the surface [m], `thickness` is that
    of all cells or of every one (e,) [m].
    """
    dim = reference.shape[1]
    points = len(surfaces.quadrature(shape.space, shape.parent, shape.order)[1])
    numbers = partial(numbers_of, shape, reference, thickness, material)
    return Cells.later(
        Law.MEMBRANE if dim == 2 else Law.SHELL,
        np.ascontiguousarray(shape.nodes.T * dim),
        dim,
        points,
        numbers,
    )


def numbers_of(
    shape: Surface, reference: np.ndarray, thickness: float | np.ndarray, material: Material
) -> tuple[np.ndarray, np.ndarray]:
    """Table (k, p, b, e) and section (i, p, e) of the cells of a plate or shell with the reference
    (j, c) [m].

        k = 2, section A, nu, weight in the plane;    k = 5, section A, B, nu, b0_11, b0_22, b0_12, weight in space
        A = E t / (1 - nu^2) [N/m],    B = A t^2 / 12 [N m],    b0_ij = n . r0,ij [1/m],    weight [m2]

    `thickness` t [m] is a number or one a cell (e,).
    """
    (count, basis) = shape.nodes.shape
    dim = reference.shape[1]
    points = len(surfaces.quadrature(shape.space, shape.parent, shape.order)[1])
    table = np.empty((2 if dim == 2 else 5, points, basis, count))
    area, curved = np.empty((points, count)), np.empty((3, points, count))
    for part in surfaces.parts(shape):
        found = surfaces.tabulate(shape, part=part)
        if dim == 2:
            local, weights = local_first(found.values, found.weights, reference[found.nodes])[:2]
        else:
            local, weights, bend = local_table(found.values, found.weights, reference[found.nodes])
            curved[..., part] = bend.transpose(2, 1, 0)
        table[..., part], area[..., part] = local.transpose(2, 1, 3, 0), weights.T
    t = np.broadcast_to(np.asarray(thickness, dtype=float), count) + 0 * area
    nu = material.poisson_ratio
    A = material.young_modulus * t / (1 - nu**2)
    rows = [A, nu + 0 * A, area] if dim == 2 else [A, A * t**2 / 12, nu + 0 * A, *curved, area]
    return table, np.stack(rows)


def mass_matrix(
    shape: Surface, reference: np.ndarray, thickness: float | np.ndarray, density: float
) -> csr_array:
    """Mass matrix (b, b) [kg] over the functions of a surface with the reference (b, c) [m].

        m_ij = int rho t N_i N_j dA

    `thickness` t [m] is a number or one a cell (e,), `density` rho [kg/m3]. The quadrature is of
    one order more than that of the stiffness.
    """
    count, basis = shape.nodes.shape
    blocks = np.empty((count, basis, basis))
    heavy = density * np.broadcast_to(np.asarray(thickness, dtype=float), count)
    for part in surfaces.parts(shape):
        table = surfaces.tabulate(shape, shape.order + 1, part)
        area = local_first(table.values, table.weights, reference[table.nodes])[1]
        N = table.values[:, :, 0]
        blocks[part] = np.swapaxes(N, 1, 2) @ ((heavy[part, None] * area)[:, :, None] * N)
    return scatter_blocks(blocks, shape.nodes.astype(np.int32), shape.count)


def edge(where: str, shape: Surface, names: str | Iterable[str]) -> np.ndarray:
    """Cells and sides (i, 2) of a named edge or several.

    `where` is the place in messages. InputError for a name that is no edge, with the nearest known
    one, and for an edge that was joined to another one although `join` was not said: it is a line
    inside the surface.
    """
    sides = []
    for name in (names,) if isinstance(names, str) else names:
        if name not in shape.edges:
            expected = f"one of its edges ({listed(sorted(shape.edges), name, 'none')})"
            if any(point.partition("[")[0] == name for point in shape.points):
                raise InputError(
                    say(
                        where,
                        expected,
                        f"the points '{name}'",
                        "an edge is a group of lines in the file",
                    )
                )
            raise InputError(say(where, expected, f"'{name}'") + closest(name, shape.edges))
        sides.append(shape.edges[name])
    found = np.concatenate(sides)
    for pair in patches.joined_edges(shape):
        if shape.space.join is not None:
            break
        for own, other in (pair, pair[::-1]):
            if (found[:, None] == shape.edges[own]).all(axis=2).any():
                got = f"'{own}', which is joined to '{other}' and no edge any more"
                remedy = "say 'join: false' if the surface is slit there, 'join: true' if the line inside it is meant"
                raise InputError(say(where, "an edge", got, remedy))
    return found


def trace(shape: Surface, sides: np.ndarray, normal: bool = False) -> csr_array:
    """Values of the basis at points along sides (and, if asked, its derivatives across them times a
    length), (x, n).

    The length is that of a side, so that both parts count alike whatever the unit; what is
    round-off beside the values of a function in the cells is zero.
    """
    s = 0.5 - 0.5 * np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
    cell, side = np.repeat(sides, SAMPLES, axis=0).T
    xi = surfaces.side_points(shape.parent, side, np.tile(s, len(sides)))
    rows = surfaces.sample(shape, cell, xi)
    if not normal:
        return seen(rows, shape, sides)
    parts = [surfaces.sample(shape, cell, xi, k) for k in (1, 2)]
    tangents = np.stack([part @ shape.reference for part in parts], axis=1)
    along = np.diff(surfaces.VERTICES[shape.parent][[*range(int(shape.parent)), 0]], axis=0)[side]
    gram = np.einsum("xac,xbc->xab", tangents, tangents)
    if (
        shape.parent is surfaces.Parent.SQUARE
    ):  # lines that digits of a file turn cross the edge at right angles all the same
        upright = np.abs(gram[:, 0, 1]) <= ranks.STATED * np.sqrt(gram[:, 0, 0] * gram[:, 1, 1])
        gram[upright, [[0], [1]], [[1], [0]]] = 0.0
    covariant = np.einsum("xab,xb->xa", gram, along)
    across = np.stack([-covariant[:, 1], covariant[:, 0]], axis=1)
    size = np.sqrt(np.einsum("xa,xab,xb->x", across, gram, across))
    length = np.sqrt(np.einsum("xa,xa->x", covariant, along)).mean()
    weights = (across / size[:, None] * length).T
    return seen(
        vstack([rows, diags_array(weights[0]) @ parts[0] + diags_array(weights[1]) @ parts[1]]),
        shape,
        sides,
    )


def seen(rows: csr_array, shape: Surface, sides: np.ndarray) -> csr_array:
    """Rows (x, n) of functions beside sides without what is round-off of these."""
    cells = distinct(sides[:, 0])
    corners = surfaces.VERTICES[shape.parent]
    places = np.concatenate([0.5 * (corners + corners.mean(axis=0)), corners.mean(axis=0)[None]])
    values = np.abs(surfaces.basis_in_cells(shape.space, cells, places)[:, :, 0]).max(axis=1)
    sizes = np.zeros(shape.count)
    np.maximum.at(sizes, shape.nodes[cells], values)
    found = csr_array(rows)
    found.data[np.abs(found.data) <= UNSEEN * sizes[found.indices]] = 0.0
    found.eliminate_zeros()
    return found


def middle(ends: np.ndarray) -> np.ndarray:
    """Centre (c,) [m] of the circle through the ends of sides (i, 2, c), or the middle of a line.

        |x|^2 - 2 x . c = const

    by least squares of least norm about the mean of the sides.
    """
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    mean = np.einsum("i,iec->c", length, ends) / (2.0 * length.sum())
    x = ends.reshape(-1, ends.shape[2]) - mean
    square = np.sum(x * x, axis=1)
    A = np.column_stack([2.0 * x, np.ones(len(x))])
    size = float(np.abs(x).max())
    return mean + ranks.least(A / size, square / size)[: ends.shape[2]]


def side_ends(shape: Surface, sides: np.ndarray) -> csr_array:
    """Rows (2 i, n) of both ends of sides (i, 2), one side after the other."""
    cell, side = np.repeat(sides, 2, axis=0).T
    return surfaces.sample(
        shape, cell, surfaces.side_points(shape.parent, side, np.tile([0.0, 1.0], len(sides)))
    )


def tie_rims(
    where: str, shape: Surface, reference: np.ndarray, rims: Mapping[str, Rim], seams: csr_array
) -> tuple[csr_array, np.ndarray, list[np.ndarray]]:
    """Functions of the surface from free functions and frames: spread (n, b), free functions (i,),
    centres (c,) of the frames [m].

        q = spread @ (free functions, frames),    r = c + X e1 + Y e2 [+ Z e3] along the edges of a rim

    `seams` (n, n) are those that follow from others along seams, whose columns are zero, see
    `patches.tie`. InputError for edges that do not exist, or share a cell side with those of
    another rim.
    """
    dim = reference.shape[1]
    n = shape.count
    taken = seams.diagonal() == 0.0
    follow, links, centers = [], [], []
    for name, rim in rims.items():
        sides = edge(f"{where}, rim '{name}'", shape, rim.edges)
        if edge_directions.derivatives(shape.space) is not None:
            first, second, X = edge_directions.determined(shape, sides, True, bool(rim.slopes))
        else:
            first, second, X = ranks.determined(
                csr_array(trace(shape, sides, bool(rim.slopes)) @ seams)
            )
        if taken[first].any() or taken[second].any():
            raise InputError(
                say(
                    f"{where}, rim '{name}'",
                    "edges apart from those of other rims",
                    "a shared cell side",
                    "refine between them",
                )
            )
        taken[first] = True
        ends = np.asarray(side_ends(shape, sides) @ reference).reshape(-1, 2, dim)
        center = middle(ends) if rim.center is None else np.asarray(rim.center, dtype=float)
        rigid = np.column_stack([shape.unit, reference - np.outer(shape.unit, center)])
        follow.append(np.asarray(rigid[first] + X @ rigid[second]))
        links.append((first, second, X))
        centers.append(center)
    free = np.flatnonzero(~taken)
    place = np.cumsum(~taken) - 1
    base = coo_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(n, len(free)))
    blocks = [base]
    for first, second, X in links:
        i, j, x = entries(X)
        blocks[0] = blocks[0] + coo_array((-x, (first[i], place[second[j]])), shape=(n, len(free)))
    for (first, _, _), rows in zip(links, follow, strict=True):
        i, j = np.nonzero(np.abs(rows) > ROUND_OFF * np.abs(rows).max())
        blocks.append(coo_array((rows[i, j], (first[i], j)), shape=(n, dim + 1)))
    return csr_array(seams @ block_array([blocks])), free, centers
