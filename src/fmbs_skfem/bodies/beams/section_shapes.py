r"""Outlines of cross-sections, and meshes of them that are finest where stresses are singular.

Axes y (first of the section, width) and z (second, height), in the coordinates of a drawing that
each shape names. A polygon is cut into triangles between points of its sides (Delaunay), and every
triangle into three quads, each at one of its corners v:

    a piece of a side of length l:           l <= min_v (room_v + distance from v),   room_v = distance of v from sides not its own
    quads at v with the interior angle beta: layers v + q^j (quad - v),  j = 0..n,    q = 0.15

Gradients at v grow as r^(alpha - 1) with alpha = pi/beta, the energy that a quad at v misses falls
by q^(2 alpha) a layer, and n is as many layers as make that small. The error of polynomials of
degree p then falls exponentially with p until the innermost quads count. Every side of a quad leads
from a corner to a middle of a side or from there to a centre, so that both of its quads agree.

J. R. Shewchuk, Comput. Geom. 22 (2002) 21-74, doi:10.1016/S0925-7721(01)00047-5 (Delaunay triangles
along given sides); C. Schwab, p- and hp-Finite Element Methods, Oxford 1998, section 4.5 (geometric
meshes).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InputError, require_positive, say
from ...core.storage.records import dataclass
from ...shapes.table import Floats, Ints

NARROW = 3e-5  #: of the extent: sides nearer to each other are refused; at a third of it round-off is 1e-3 of the torsion constant
POINTS = 1000  #: of an outline; they take some 2 s
SPLIT = 1.01  #: a piece of a side is halved beyond this of its greatest length, not where round-off alone exceeds it
PIECES = 4000  #: of all sides; a mesh of them has some 10^5 quads
SHRINK = 0.15  #: q; the optimum of one-dimensional theory, 0.17 (Schwab): from 0.15 to 0.2 errors stay of one size
MISSED = 3e-4  #: energy that the innermost quads may miss, relative to what they hold; their polynomials leave a hundredth of that
SIDES_DRAWN = 8  #: pairs of pieces of a side as long as the section, in the outline that is drawn
#: turn of a corner of a polygon that stands for a curve, of 18 sides or more a circle
SMOOTH = math.radians(20.0)
ROUND_DRAWN = 64  #: points of a circle that is drawn; between them bending stresses exceed theirs by up to 0.1 %

Point = tuple[float, float]
Loop = tuple[Point, ...]


class Shear(Enum):
    """Which deflection a shear strain is of, see `section_constants`."""

    COWPER = "the mean deflection of the section"
    ENERGY = "the deflection on which the shear stresses work"


@dataclass(frozen=True)
class Ring:
    """A circle of an outer diameter with a wall [m], solid where that is the radius; its centre is
    the origin of the drawing.
    """

    diameter: float
    wall: float
    shear: Shear = Shear.COWPER

    def __post_init__(self) -> None:
        require_positive("section", diameter=self.diameter, wall=self.wall)
        if self.wall > self.diameter / 2:
            raise InputError(
                say(
                    "section.wall",
                    f"at most the radius, {self.diameter / 2:g} m",
                    f"{self.wall:g} m",
                )
            )

    @property
    def radii(self) -> tuple[float, float]:
        """Inner and outer radius [m]."""
        return max(0.0, self.diameter / 2 - self.wall), self.diameter / 2

    @property
    def round_as(self) -> float:
        """Radius of the circle that it is to others [m]."""
        return self.diameter / 2


@dataclass(frozen=True)
class Polygon:
    """A simple polygon with holes, each a loop of points (y, z) [m] in either direction.

    InputError names loops of fewer than three points, more than 1000 points, sides that cross or
    touch, and holes outside.
    """

    points: Loop
    holes: tuple[Loop, ...] = ()
    shear: Shear = Shear.ENERGY
    #: of the sides of `loops` in the contour that is drawn; by default by their lengths
    pieces: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        for loop in (self.points, *self.holes):
            if np.shape(loop) != (max(len(loop), 3), 2) or not np.isfinite(loop).all():
                raise InputError(
                    say("section.points", "three or more points (y, z) of finite numbers", loop)
                )
        if (count := sum(map(len, (self.points, *self.holes)))) > POINTS:
            raise InputError(
                say(
                    "section.points",
                    f"at most {POINTS} points",
                    count,
                    "leave some out where the outline is smooth",
                )
            )
        _check_simple(self)
        start, end, _ = sides((self.points,))
        for loop in self.holes:
            others = sides([one for one in self.holes if one is not loop])
            first = np.array(loop[:1], dtype=float)
            if not inside(first, start, end)[0] or inside(first, *others[:2])[0]:
                raise InputError(
                    say(
                        "section.holes",
                        "holes within the polygon, none within another",
                        f"one at {loop[0]}",
                    )
                )

    @property
    def loops(self) -> list[Floats]:
        """The polygon and its holes (n, 2) [m], with the material on the left."""
        found = [np.array(loop, dtype=float) for loop in (self.points, *self.holes)]
        return [
            loop if (_area(loop) > 0) == (k == 0) else loop[::-1] for k, loop in enumerate(found)
        ]

    @property
    def round_as(self) -> float:
        """Radius of the circle that it is to others [m], of the area of its convex hull."""
        from scipy.spatial import ConvexHull

        return math.sqrt(ConvexHull(np.array(self.points, dtype=float)).volume / math.pi)


Outline = Ring | Polygon


# ---------------------------------------------------------------------------------------------------------------- shapes
def circle(diameter: float) -> Ring:
    """A solid circle; origin of the drawing: its centre."""
    return Ring(diameter, diameter / 2)


def tube(diameter: float, wall: float) -> Ring:
    """A tube of an outer diameter and a wall [m]; origin of the drawing: its centre."""
    return Ring(diameter, wall)


def rectangle(width: float, height: float) -> Polygon:
    """Width along y, height along z [m]; origin of the drawing: the centre."""
    require_positive("section", width=width, height=height)
    y, z = width / 2, height / 2
    return Polygon(((-y, -z), (y, -z), (y, z), (-y, z)), shear=Shear.COWPER)


def i_shape(width: float, height: float, web: float, flange: float, fillet: float = 0.0) -> Polygon:
    """Two flanges of a width along y, `flange` thick, at the ends of a web along z, `web` thick, with
    a radius between them [m]; the origin is the centre.
    """
    _check_walls(width, height, web, flange, 2)
    y = width / 2
    z = height / 2
    t = web / 2
    s = height / 2 - flange
    right = rounded(
        ((y, -z), (y, -s), (t, -s), (t, s), (y, s), (y, z)), (0.0, 0.0, fillet, fillet, 0.0, 0.0)
    )
    return Polygon(right + tuple((-a, b) for a, b in reversed(right)))


def c_shape(
    width: float,
    height: float,
    web: float,
    flange: float,
    taper: float = 0.0,
    fillet: float = 0.0,
    toe: float = 0.0,
) -> Polygon:
    """A web along z, `web` thick, its back on y = 0, and two flanges of a width along y [m]; z = 0 is
    midway.

    `flange` is their thickness in the middle of the width, from where it falls by `taper` times y to
    the toes; `fillet` and `toe` are radii.
    """
    _check_walls(width, height, web, flange, 2)
    z = height / 2
    root, end = (z - flange - taper * (width / 2 - y) for y in (web, width))
    inner = ((width, -end), (web, -root), (web, root), (width, end))
    corners = ((0.0, -z), (width, -z), *inner, (width, z), (0.0, z))
    return Polygon(rounded(corners, (0.0, 0.0, toe, fillet, fillet, toe, 0.0, 0.0)))


def l_shape(
    width: float, height: float, web: float, flange: float, fillet: float = 0.0, toe: float = 0.0
) -> Polygon:
    """A leg of a width along y, `flange` thick, and one of a height along z, `web` thick, from the
    origin, their corner, with radii of the corner inside and of both toes [m].
    """
    _check_walls(width, height, web, flange, 1)
    corners = (0.0, 0.0), (width, 0.0), (width, flange), (web, flange), (web, height), (0.0, height)
    return Polygon(rounded(corners, (0.0, 0.0, toe, fillet, toe, 0.0)))


def t_shape(width: float, height: float, web: float, flange: float) -> Polygon:
    """A web along z, `web` thick, its foot at the origin, and a flange of a width along y, `flange`
    thick, on its top [m]; the height is that of both.
    """
    _check_walls(width, height, web, flange, 1)
    y, t, s = width / 2, web / 2, height - flange
    right = (t, 0.0), (t, s), (y, s), (y, height)
    return Polygon((*right, *((-a, b) for a, b in reversed(right))))


def z_shape(width: float, height: float, web: float, flange: float) -> Polygon:
    """A web along z, `web` thick, with a flange along y at its top and one along -y at its bottom,
    `flange` thick, each of a width that counts the web [m]; the origin is the centre.
    """
    _check_walls(width, height, web, flange, 2)
    z, t = height / 2, web / 2
    right = (t, -z), (t, z - flange), (width - t, z - flange), (width - t, z)
    return Polygon((*right, *((-a, -b) for a, b in right)))


def rounded(points: Sequence[Point], radii: Sequence[float]) -> Loop:
    """The loop of points with an arc of a radius [m] in place of each, 0 for a corner.

    At a corner v with unit directions u and w along its sides, and the angle 2 b between them, it
    leads from v + r/tan(b) u to v + r/tan(b) w about v + r/sin(b) (u + w)/|u + w|.
    """
    found: list[Point] = []
    corners = np.array(points, dtype=float)
    sides = zip(np.roll(corners, 1, axis=0), corners, np.roll(corners, -1, axis=0), strict=True)
    for (before, v, after), r in zip(sides, radii, strict=True):
        if not r:
            found.append(tuple(v.tolist()))
            continue
        u, w = ((one - v) / np.linalg.norm(one - v) for one in (before, after))
        b = 0.5 * math.acos(u @ w)
        turn = math.pi - 2.0 * b
        middle = r / math.sin(b) * (u + w) / np.linalg.norm(u + w)
        s = np.linspace(0.0, 1.0, math.ceil(turn / SMOOTH) + 1)[:, None]
        ends = (
            np.sin(one * turn) * (r / math.tan(b) * side - middle)
            for one, side in ((1.0 - s, u), (s, w))
        )
        found += map(tuple, (v + middle + sum(ends) / math.sin(turn)).tolist())
    return tuple(found)


def hollow(
    width: float, height: float, web: float, flange: float, outer: float = 0.0, inner: float = 0.0
) -> Polygon:
    """A box of a width along y and a height along z; its walls along z are `web` thick, those along y
    `flange`, and its corners have radii outside and inside [m]; the origin is the centre.
    """
    _check_walls(width, height, web, flange, 2, 2, "wall" if web == flange else "")
    loops = []
    for y, z, r in (
        (width / 2, height / 2, outer),
        (width / 2 - web, height / 2 - flange, inner),
    ):
        if not 0.0 <= r < min(y, z):
            expected = f"radii of corners below {min(y, z):g} m, half of the side that they round"
            remedy = "take a smaller radius, or a thinner wall"
            raise InputError(say("section.radius", expected, f"{r:g} m", remedy))
        loops.append(rounded(((-y, -z), (y, -z), (y, z), (-y, z)), [r] * 4))
    return Polygon(loops[0], (loops[1],))


def polygon(points: ArrayLike, *holes: ArrayLike) -> Polygon:
    """The polygon of points (n, 2), y and z [m], with holes (n, 2)."""
    loops = [tuple(map(tuple, np.asarray(loop, dtype=float).tolist())) for loop in (points, *holes)]
    return Polygon(loops[0], tuple(loops[1:]))


def moments(outline: Outline) -> tuple[float, Floats, Floats]:
    """Area [m2], centroid (2,) in the drawing [m] and int rho rho^T dA about it (2, 2) [m4].

    Of polygons by Green's theorem, as sums over their sides from a to b with c = a x b:

        A = sum c/2,   int rho dA = sum c (a + b)/6,   int rho rho^T dA = sum c ((a + b)(a + b)^T + a a^T + b b^T)/24
    """
    if isinstance(outline, Ring):
        inner, outer = outline.radii
        return (
            math.pi * (outer**2 - inner**2),
            np.zeros(2),
            0.25 * math.pi * (outer**4 - inner**4) * np.eye(2),
        )
    loops = outline.loops
    middle = loops[0].mean(axis=0)
    a = np.concatenate(loops) - middle
    b = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops]) - middle
    c = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * float(c.sum())
    centroid = c @ (a + b) / (6.0 * area)
    second = sum((c[:, None] * one).T @ one for one in (a + b, a, b)) / 24.0
    return area, middle + centroid, second - area * np.outer(centroid, centroid)


def _check_walls(
    width: float,
    height: float,
    web: float,
    flange: float,
    flanges: int,
    webs: int = 1,
    wall: str = "",
) -> None:
    """InputError where walls take all of a section; they have one name where they are one `wall`."""
    require_positive("section", width=width, height=height, web=web, flange=flange)
    for name, count, thick, size, whole in (
        (wall or "web", webs, web, "width", width),
        (wall or "flange", flanges, flange, "height", height),
    ):
        if count * thick >= whole:
            most = f"less than {'half ' * (count - 1)}the {size}, {whole / count:g} m"
            remedy = f"take thinner walls, or a larger {size}"
            raise InputError(say(f"section.{name}", most, f"{thick:g} m", remedy))


# ------------------------------------------------------------------------------------------------------------------ sides
def sides(loops: list[Floats] | tuple[Loop, ...] | list[Loop]) -> tuple[Floats, Floats, Ints]:
    """Starts and ends (s, 2) of all sides of loops, and the side (s,) that follows each."""
    points = [np.array(loop, dtype=float) for loop in loops]
    first = np.cumsum([0] + [len(loop) for loop in points])
    following = [first[k] + np.roll(np.arange(len(loop)), -1) for k, loop in enumerate(points)]
    start = np.concatenate([np.zeros((0, 2)), *points])
    after = np.concatenate([np.zeros(0, np.int64), *following])
    return start, start[after], after


def distances(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distances (n, s) of points (n, 2) from sides."""
    along = end - start
    place = np.einsum("nsc,sc->ns", points[:, None] - start, along) / np.sum(along**2, axis=1).clip(
        np.finfo(float).tiny
    )
    return np.asarray(
        np.linalg.norm(points[:, None] - start - place.clip(0.0, 1.0)[..., None] * along, axis=2)
    )


def inside(points: Floats, start: Floats, end: Floats) -> np.ndarray:
    """Whether points (n, 2) are within loops: a ray towards +y crosses an odd number of sides."""
    y, z = points.T[:, :, None]
    across = (start[:, 1] > z) != (end[:, 1] > z)
    rise = np.where(start[:, 1] == end[:, 1], 1.0, end[:, 1] - start[:, 1])
    crossing = start[:, 0] + (z - start[:, 1]) * (end[:, 0] - start[:, 0]) / rise
    return np.asarray(np.sum(across & (y < crossing), axis=1) % 2 == 1)


def room(start: Floats, end: Floats, following: Ints) -> Floats:
    """Distances (n, s) of the starts of sides from all sides, infinite from the two that they
    belong to.
    """
    found = distances(start, start, end)
    own = np.arange(len(start))
    found[own, own] = found[following, own] = np.inf
    return found


def _check_simple(shape: Polygon) -> None:
    start, end, following = sides((shape.points, *shape.holes))
    far = room(start, end, following)
    near = far <= NARROW * np.ptp(start, axis=0).max()

    def turns(points: Floats) -> Floats:
        """On which side (s, n) of each side points are."""
        along = (end - start)[:, None]
        to = points - start[:, None]
        return np.asarray(np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]))

    parted = turns(start) * turns(end) < 0.0
    found = np.argwhere(near | (parted & parted.T))
    if len(found):
        first, second = (
            f"{tuple(start[k].tolist())} to {tuple(end[k].tolist())}" for k in found[0]
        )
        remedy = "leave out points that repeat one, and give holes as holes"
        raise InputError(
            say(
                "section.points",
                "an outline whose sides meet at their ends alone",
                f"{first} and {second}",
                remedy,
            )
        )


def _area(loop: Floats) -> float:
    y, z = (loop - loop[0]).T
    return 0.5 * float(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1)))


# -------------------------------------------------------------------------------------------------------------- what is drawn
def unit_circle() -> Floats:
    """Points (n, 2) around the origin, at the distance 1."""
    angles = 2.0 * math.pi * np.arange(ROUND_DRAWN) / ROUND_DRAWN
    return np.column_stack([np.cos(angles), np.sin(angles)])


def pieces(loop: Floats) -> Ints:
    """Pieces (n,) of the sides of a loop that is drawn, an even number each."""
    lengths = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    return 2 * np.ceil(SIDES_DRAWN * lengths / np.ptp(loop, axis=0).max()).astype(int)


def alike(outlines: Sequence[Outline | None]) -> tuple[tuple[int, ...], ...]:
    """Pieces of the sides of polygons with the same points that resolve all of them; none of other
    outlines.
    """
    loops = [one.loops for one in outlines if isinstance(one, Polygon)]
    if len(loops) < len(outlines):
        return ()
    return tuple(
        tuple(np.max([pieces(loop) for loop in same], axis=0).tolist())
        for same in zip(*loops, strict=True)
    )


def drawn(loop: Floats, many: Ints) -> tuple[Floats, np.ndarray]:
    """Points (n, 2) along a loop with so many pieces a side, and the corners (n,) without a stress
    of their own.

    Those point inwards, where shear stresses have no bound, or turn so little that they stand for a
    curve: they vanish there in the corner alone.
    """
    along = np.roll(loop, -1, axis=0) - loop
    points = [
        p + np.arange(n)[:, None] / n * step for p, n, step in zip(loop, many, along, strict=True)
    ]
    before = np.roll(along, 1, axis=0)
    turn = np.arctan2(
        before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0], np.sum(before * along, axis=1)
    )
    corner = np.zeros(many.sum(), dtype=bool)
    corner[np.cumsum(many) - many] = turn < SMOOTH
    return np.concatenate(points), corner


# ------------------------------------------------------------------------------------------------------------------- mesh
def mesh(shape: Polygon) -> tuple[Floats, Ints]:
    """Points (n, 2) and anticlockwise quads (e, 4) of a polygon, graded towards its corners."""
    points, triangles = triangulated(*sides(shape.loops))
    return _merged(_quads(points[triangles], layers(points, triangles)[triangles]))


def triangulated(start: Floats, end: Floats, following: Ints) -> tuple[Floats, Ints]:
    """Points (n, 2) of the sides and anticlockwise triangles (e, 3) between them; sides are halved
    as often as that takes.
    """
    from scipy.spatial import Delaunay

    free = room(start, end, following).min(axis=1)
    pieces = np.stack([start, end], axis=1)
    while True:
        middle = pieces.mean(axis=1)
        length = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
        long = length > SPLIT * (free + np.linalg.norm(middle[:, None] - start, axis=2)).min(axis=1)
        if not long.any():
            points, ends = _merged(pieces)
            triangles = Delaunay(points).simplices
            long = ~np.isin(
                _keys(ends, len(points)),
                _keys(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), len(points)),
            )
            if not long.any():
                return points, _within(points, triangles, start, end)
        if len(pieces) > PIECES:
            got = f"one narrower than {free.min():g} m somewhere"
            raise InputError(
                say(
                    "section.points",
                    f"an outline that {PIECES} pieces of its sides resolve",
                    got,
                    "leave out slits",
                )
            )
        halves = np.stack(
            [pieces[long, 0], middle[long], middle[long], pieces[long, 1]], axis=1
        ).reshape(-1, 2, 2)
        pieces = np.concatenate([pieces[~long], halves])


def _within(points: Floats, triangles: Ints, start: Floats, end: Floats) -> Ints:
    """Triangles (e, 3) in loops, anticlockwise, without those between points of one side."""
    corners = points[triangles]
    (a, b), (c, d) = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0).transpose(0, 2, 1)
    twice = a * d - b * c
    kept = inside(corners.mean(axis=1), start, end) & (
        np.abs(twice) > 1e-14 * np.ptp(points, axis=0).max() ** 2
    )
    return np.where(twice[:, None] < 0.0, triangles[:, ::-1], triangles)[kept]


def layers(points: Floats, triangles: Ints) -> Ints:
    """Layers (n,) of cells at the corners of triangles, for their angles beta.

        n = log(missed / a^2) / (2 pi / beta log q)

    A corner of nearly straight sides has a small singular part, a = |beta - pi| / (pi/2) up to 1 of
    that of others.
    """
    corners = points[triangles]
    u, v = (np.roll(corners, -k, axis=1) - corners for k in (1, 2))
    angles = np.arctan2(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0], np.sum(u * v, axis=2))
    beta = np.bincount(triangles.ravel(), angles.ravel(), minlength=len(points))
    size = np.clip(np.abs(beta - math.pi) / (math.pi / 2), 1e-6, 1.0)
    wanted = np.log(MISSED / size**2) / (2.0 * math.pi / beta.clip(1e-6) * math.log(SHRINK))
    return np.rint(wanted).clip(0.0).astype(np.int64)


def _quads(corners: Floats, many: Ints) -> Floats:
    """Corners (q, 4, 2) of the quads in triangles (e, 3, 2) with `many` layers (e, 3) at their
    corners.
    """
    before, after = (0.5 * (corners + np.roll(corners, k, axis=1)) for k in (1, -1))
    centre = np.broadcast_to(corners.mean(axis=1, keepdims=True), corners.shape)
    kite = np.stack([corners, after, centre, before], axis=2).reshape(-1, 4, 2)
    many = many.ravel()
    found = []
    for j in range(many.max() + 1):
        # as weighted means, in which neighbours find the same points to the last bit
        outer, inner = (s * kite + (1.0 - s) * kite[:, :1] for s in (SHRINK**j, SHRINK ** (j + 1)))
        _, a, b, c = np.moveaxis(outer, 1, 0)
        _, d, e, f = np.moveaxis(inner, 1, 0)
        found.append(outer[many == j])
        found += [np.stack(quad, axis=1)[many > j] for quad in ((d, a, b, e), (f, e, b, c))]
    return np.concatenate(found)


def _merged(cells: Floats) -> tuple[Floats, Ints]:
    """Points (n, 2) of cells (e, b, 2), each once, and their numbers (e, b)."""
    points, numbers = np.unique(cells[..., 0] + 1j * cells[..., 1], return_inverse=True)
    return np.column_stack([points.real, points.imag]), numbers.reshape(cells.shape[:2])


def _keys(pairs: Ints, count: int) -> Ints:
    """One number (s,) a pair (s, 2) of points, whatever their order."""
    low, high = np.sort(pairs.astype(np.int64), axis=1).T
    return np.asarray(low * count + high)
