"""What touches: places, nodes and points of bodies with their radii, as probe rows; and the rows of
places that carry shapes.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron, vstack

from ..bodies.body import Body, arc_lengths, director, locate, own
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..shapes import line, surface
from ..shapes.surface import Surface
from ..systems.connections.constraint_functions import basis
from ..systems.places import QUARTER, At, Coordinates, Draft
from .forces import ContactForces
from .shapes import distances

#: points along a beam where none are asked for and nothing is so thin that it needs more
MOST = 101
SIDE = 2  #: parts into which points divide each side of a plate's cell
# a gap of FINE of a radius is missed by 3 % of it, of COARSE by 13 %; through one of twice of that
# all passes
#: radius of gaps between points over that of what meets them: by default, and that is refused
FINE, COARSE = (
    0.25,
    0.5,
)
#: points up to which gaps are as FINE, and up to which they are not COARSE
ENOUGH, LIMIT = (
    501,
    5001,
)
SAME = 1e-7  #: numbers of points that differ by less are those of one point


@dataclass(frozen=True)
class Touching:
    """Points that may touch."""

    body: str
    rows: np.ndarray  #: (t, r) probe rows of the points, then of the axes that carry them
    places: np.ndarray  #: (t, c) in the reference [m]
    radius: np.ndarray  #: (t,) [m]
    mass: float  #: of the body [kg]
    shares: np.ndarray  #: (t,) of the length or area of the body, none of places
    beside: np.ndarray  #: (t, b) pairs of points on tangents of the body: none of places, one of lines, two of surfaces


def find_points(
    name: str,
    draft: Draft,
    at: At | None,
    body: str | None,
    count: int | None,
    radius: float | None,
    round_as: tuple[float, float] = (np.inf, np.inf),
    rubs: bool = False,
) -> Touching:
    """One place, or points all over a body; their radius is that of its section or half its
    thickness, 0 for rigid bodies.

    A planar plate touches with its edges, as it has no thickness in the plane. Points are so many
    that what meets them, `round_as` radii of `contact_shapes.roundness` [m], does not pass between
    them. Friction (`rubs`) turns the sections of a beam.
    """
    layout = draft.layout
    part = layout.body(name, At(str(body)) if at is None else at)
    thin = part.space is None or (layout.dim == 2 and isinstance(part.space, Surface))
    half = (0.0 if thin else part.radius) if radius is None else radius
    shares = np.zeros(0)
    beside = None
    changes = radius is None and part.profile is not None and part.profile.degree > 0
    tapers = part.profile if changes else None
    along = np.zeros(0)
    if at is not None or part.space is None:
        places = [At(part.name, place) for place in part.places] if at is None else [at]
        along = (
            np.array([locate(part, place.place) for place in places])
            if tapers is not None
            else along
        )
        axes = [axes_of(name, draft, place) if half > 0.0 else [] for place in places]
        read = vstack(
            [
                row
                for place, own_axes in zip(places, axes, strict=True)
                for row in (layout.read(name, place), *own_axes)
            ]
        )
        found = len(places)
    else:
        if isinstance(part.space, Surface):
            widest, cells = gap_of_surface(part, part.space, thin)
            most = tuple(int((many / cells) ** (1.0 if thin else 0.5)) for many in (ENOUGH, LIMIT))
            parts = enough(
                name, count, SIDE, widest, (round_as[0] + half, round_as[1] + half), most
            )
            functions, shares, beside = once(
                *(edge_points if thin else surface_points)(part, part.space, parts)
            )
            read = layout.spread(part, functions)
        else:
            least = half if tapers is None else float(tapers.radius.min())
            # edges come in between points of beams no deeper than what is round does
            met = min(round_as) + least
            along = line_points(name, part, count, (met, met or round_as[1]))
            read = line_rows(layout, part, along, half > 0.0, rubs)
            shares = line_shares(part, along)
            beside = neighbours(np.arange(len(along)), len(along) - 1)
        found = len(shares)
    read = csr_array(read)
    rows = draft.probes.add(read) + np.arange(read.shape[0]).reshape(found, -1)
    reference = np.concatenate([one.reference.ravel() for one in layout.bodies.values()])
    radii = np.full(found, half) if tapers is None else tapers.radii(along)
    places_there = (read @ reference).reshape(found, -1)[:, : layout.dim]
    beside = np.zeros((found, 0), np.int64) if beside is None else beside.astype(np.int64)
    return Touching(
        part.name, rows.astype(np.int64), places_there, radii, part.total_mass, shares, beside
    )


def line_points(name: str, part: Body, count: int | None, met: tuple[float, float]) -> np.ndarray:
    """Parameters (x,) of points along a line, whose gaps are as `enough` has them."""
    breaks = line.breaks(part.space)
    fine, arc = arc_lengths(part)
    # the length if all were as long by xi
    whole = float((np.diff(arc) / np.diff(fine)).max()) * (breaks[-1] - breaks[0])
    given = None if count is None else max(count - 1, 1)
    base = min(2 * len(breaks) - 2, MOST - 1)
    return np.linspace(
        breaks[0], breaks[-1], enough(name, given, base, 0.5 * whole, met, (ENOUGH, LIMIT)) + 1
    )


def enough(
    name: str,
    parts: int | None,
    base: int,
    widest: float,
    met: tuple[float, float],
    most: tuple[int, ...],
) -> int:
    """Into how many parts points divide what has gaps of a radius `widest` [m] in one part;
    InputError where that is too coarse.

    Where nothing is said `base`, or a multiple of it, so that gaps are FINE of the first radius
    `met` if `most` allows it, and not COARSE of the second: a gap of FINE of a radius is missed by
    3 % of it, one of COARSE by 13 %, at twice of that all passes.
    """
    needed = int(np.ceil(widest / (COARSE * met[1]))) if met[1] > 0.0 else 0
    if parts is None:
        wanted = int(np.ceil(widest / (FINE * (met[0] or COARSE * met[1])))) if met[1] > 0.0 else 0
        parts = base * int(np.ceil(max(min(wanted, most[0]), min(needed, most[1]), base) / base))
    if parts < needed:
        gap = f"gaps of a radius of {widest / parts:.3g} m between {parts} parts"
        expected = f"gaps that nothing of a radius of {met[1]:.3g} m passes: {needed} parts or more"
        raise InputError(
            say(
                f"{name}.points",
                expected,
                gap,
                "take more points, or name the places that touch (at)",
            )
        )
    return parts


def gap_of_surface(part: Body, shape: Surface, edges: bool) -> tuple[float, int]:
    """Radius of the widest gap [m] between the corners of a cell of a surface, or of an edge of its
    rim, and how many there are.
    """
    if edges:
        sides = surface.free_sides(shape)
        cell, side = np.repeat(sides, 2, axis=0).T
        xi = surface.side_points(shape.parent, side, np.tile([0.0, 1.0], len(sides)))
        share = 0.5
    else:
        square = shape.parent is surface.Parent.SQUARE
        corners = np.array(
            [[0, 0], [1, 0], [1, 1], [0, 1]] if square else [[0, 0], [1, 0], [0, 1]], dtype=float
        )
        cell = np.repeat(np.arange(len(shape.nodes)), len(corners))
        share = 0.5 if square else 1.0 / np.sqrt(3.0)
        xi = np.tile(corners, (len(shape.nodes), 1))
    at = (own(part, surface.sample(shape, cell, xi, 0)) @ part.reference).reshape(
        -1, 2 if edges else len(corners), part.dim
    )
    return share * float(np.linalg.norm(at[:, :, None] - at[:, None, :], axis=3).max()), len(at)


def line_shares(part: Body, xi: np.ndarray) -> np.ndarray:
    """Shares (x,) of points at xi in the length of a line: half of the ways to both neighbours."""
    fine, arc = arc_lengths(part)
    ways = np.diff(np.interp(xi, fine, arc))
    return (np.append(ways, 0.0) + np.append(0.0, ways)) / (2.0 * ways.sum())


def line_rows(
    layout: Coordinates, part: Body, xi: np.ndarray, thick: bool, rubs: bool
) -> csr_array:
    """Rows (x r, q) of points at xi along a line: positions, and vectors that turn with its
    sections where it is `thick`.

    In the plane these are slope and normal, in space the directors, which friction alone turns
    (`rubs`).
    """
    assert isinstance(part.space, line.BSpline | line.Hermite)
    at = line.sample(part.space, xi, 0)
    n = len(xi)
    read = [layout.spread(part, own(part, at))]
    if thick and part.dim == 2:
        slopes = (
            own(part, line.sample(part.space, xi, 1))
            if part.directors is None
            else csr_array(at @ director(part, 1))
        )
        slope = layout.spread(
            part, diags_array(1.0 / np.linalg.norm(slopes @ part.reference, axis=1)) @ slopes
        )
        read += [slope, kron(eye_array(n), QUARTER) @ slope]
    elif thick and rubs and part.directors is not None:
        read += [layout.spread(part, csr_array(at @ director(part, k))) for k in (1, 2, 3)]
    shape = len(read), n, part.dim
    return csr_array(
        csr_array(vstack(read))[np.arange(np.prod(shape)).reshape(shape).swapaxes(0, 1).ravel()]
    )


def neighbours(i: np.ndarray, last: np.ndarray | int) -> np.ndarray:
    """Numbers (x, 2) before and behind those of points i (x,) on a line from 0 to `last`."""
    return np.stack(np.broadcast_arrays(np.maximum(i - 1, 0), np.minimum(i + 1, last)), axis=-1)


def edge_points(part: Body, shape: Surface, count: int) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Points that divide the sides on the boundary of a planar plate into `count` parts, for
    `once`.

    Rows (x, b), lengths (x,), and numbers (x, 2) of points beside each on its side.
    """
    sides = surface.free_sides(shape)
    s = np.linspace(0.0, 1.0, count + 1)
    cell, side = np.repeat(sides, len(s), axis=0).T
    xi = surface.side_points(shape.parent, side, np.tile(s, len(sides)))
    rows, a, b = (own(part, surface.sample(shape, cell, xi, k)) for k in range(3))
    first, second = a @ part.reference, b @ part.reference
    along = surface.along(shape, first, second, side)
    tangents = along[:, :1] * first + along[:, 1:] * second
    parts = np.pad(np.full(count - 1, 2.0), 1, constant_values=1.0)
    beside = len(s) * np.arange(len(sides))[:, None, None] + neighbours(np.arange(len(s)), count)
    return (
        rows,
        np.tile(parts, len(sides)) * np.linalg.norm(tangents, axis=1),
        beside.reshape(-1, 2),
    )


def surface_points(
    part: Body, shape: Surface, count: int
) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Points that divide every cell of a surface into `count` parts a side, for `once`.

    Rows (x, b), areas (x,), and numbers (x, 4) of points beside each in its cell along two
    directions.
    """
    i, j = np.indices((count + 1, count + 1)).reshape(2, -1)
    if shape.parent is surface.Parent.SQUARE:
        parts = np.where(i % count == 0, 1.0, 2.0) * np.where(j % count == 0, 1.0, 2.0)
    else:
        i, j = np.array([i, j])[:, i + j <= count]
        parts = np.array([6.0, 3.0, 1.0])[(i == 0) * 1 + (j == 0) * 1 + (i + j == count) * 1]
    cells = np.arange(len(shape.nodes))
    number = np.zeros((count + 1, count + 1), np.int64)
    number[i, j] = np.arange(len(i))
    last = (count - j, count - i) if shape.parent is surface.Parent.TRIANGLE else (count, count)
    one, other = neighbours(i, last[0]), neighbours(j, last[1])
    beside = np.column_stack([number[one, j[:, None]], number[i[:, None], other]])
    # at two vertices of a triangle a direction has no point but that itself: the third side takes
    # its place
    for k, (p, q) in ((0, (1, count - 1)), (2, (count - 1, 1))):
        alone = beside[:, k] == beside[:, k + 1]
        beside[alone, k] = number[p, q]
    xi = np.tile(np.column_stack([i, j]) / count, (len(cells), 1))
    rows, a, b = (
        own(part, surface.sample(shape, np.repeat(cells, len(i)), xi, k)) for k in range(3)
    )
    normals = np.cross(a @ part.reference, b @ part.reference)
    whole = (len(i) * cells[:, None, None] + beside).reshape(-1, 4)
    return rows, np.tile(parts, len(cells)) * np.linalg.norm(normals, axis=1), whole


def once(
    rows: csr_array, sizes: np.ndarray, beside: np.ndarray
) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Rows (x, b) of points, each once, their shares (x,) in all sizes, and the numbers (x, k) of
    those beside.
    """
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    # by distance, not by rounding: cells on both sides of a border give numbers that differ by
    # round-off
    marks = rows @ np.random.default_rng(0).random((rows.shape[1], 2))
    pairs = cKDTree(marks).query_pairs(SAME, output_type="ndarray")
    alike = csr_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(marks), len(marks)))
    number = connected_components(alike, directed=False)[1]
    first = np.unique(number, return_index=True)[1]
    shares = np.bincount(number, sizes)
    return csr_array(rows[first]), shares / shares.sum(), number[beside[first]]


def axes_of(name: str, draft: Draft, place: At) -> list[csr_array]:
    """Rows (c, q) of the axes that turn with a place, none where fewer than there are dimensions
    do.
    """
    found = draft.layout.vectors(name, place)
    return found if len(found) == draft.layout.dim else []


def carrier_rows(name: str, draft: Draft, on: At | None, placed: np.ndarray) -> np.ndarray:
    """Probe rows of the origin and, where the place carries axes, of the axes of a shape that is
    `placed` (1 + c, c); or none.
    """
    if on is None:
        return np.zeros(0, np.int64)
    layout = draft.layout
    position = layout.read(name, on)
    away = placed[0] - layout.reference(name, on)
    if not axes_of(name, draft, on):
        first = draft.probes.add(position, away)
        return np.arange(first, first + layout.dim)
    rows, reference = basis(name, layout, on)
    if np.abs(reference @ reference.T - np.eye(layout.dim)).max() > 1e-9:
        raise InputError(
            say(name, "a place with unit axes at right angles to carry the shape", str(on))
        )
    blocks = [
        csr_array(
            sum(
                (float(share) * row for share, row in zip(reference @ p, rows, strict=True)),
                0.0 * rows[0],
            )
        )
        for p in (away, *placed[1:])
    ]
    first = draft.probes.add(csr_array(vstack([position + blocks[0], *blocks[1:]])))
    return np.arange(first, first + layout.dim * (1 + layout.dim))


def overlaps(term: ContactForces, places: np.ndarray, placed: np.ndarray) -> np.ndarray:
    """Gaps (t,) of points at places (t, c) to a shape that is `placed`."""
    z = np.ascontiguousarray((places - placed[0]) @ placed[1:].T)
    found: np.ndarray = distances(term.shape, term.sizes, term.heights, z, np.zeros_like(z))
    return found - term.radius
