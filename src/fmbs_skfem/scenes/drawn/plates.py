"""Plates that a scene draws, without a mesh file: quads in the plane z = 0, about the origin.

rectangle: {width: 1 m, height: 0.5 m, hole_radius: 0.1 m}
disc: {radius: 0.3 m, cells: 12}
disc: {radius: 0.3 m, hole_radius: 0.1 m}

Rings have cells of one shape, r_k = r (R/r)^(k/n); a full disc is a bulged square in a ring.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, TypeAlias

import numpy as np

from ...core.storage.records import dataclass
from ...core.values.fields import Length, quantity, whole
from ...core.values.problems import Problem
from ...shapes import plate_meshes
from ...shapes.plate_meshes import PlateMesh
from ...shapes.table import Floats

CELLS = 8  #: of a plate for which no number is given
AROUND = 32  #: cells around a hole at least
LONG = 12  #: cells along a side or around a hole at most, times those across
CORE = 0.4  #: half of the square in a disc, over the radius
BULGE = 0.15  #: of its sides, over that half
SAME = 1e-9  #: of the size: points nearer than this are one

HoleRadius: TypeAlias = Annotated[
    float | None, quantity("m", "> 0"), "of a round hole in the middle"
]
#: whether points (2, ...) are on an edge
Edges: TypeAlias = Mapping[str, Callable[[Floats], np.ndarray]]


@dataclass(frozen=True)
class Rectangle:
    """A rectangle about the origin, `width` along x and `height` along y.

    Its edges are `left`, `right`, `bottom`, `top` and, of a hole, `inner`; its points
    `left_bottom`, `right_bottom`, `right_top`, `left_top` and `center`, where a node is there: of
    even numbers of cells.
    """

    width: Length
    height: Length
    hole_radius: HoleRadius = None
    cells: Annotated[int, whole(1, 500), "along its shorter side, or from the hole to it"] = CELLS

    @property
    def room(self) -> float:
        """Radius of a hole that is too large [m]."""
        return 0.5 * min(self.width, self.height)

    def interpolation(self, dim: int) -> str | None:
        """The word of the one that fits best, where its cells are known to be rectangles."""
        return "bfs" if dim == 3 and self.hole_radius is None else None

    def mesh(self) -> PlateMesh:
        x, y = 0.5 * self.width, 0.5 * self.height
        short, long = min(x, y), max(x, y)
        if self.hole_radius is None:
            along = min(round(self.cells * long / short), LONG * self.cells)
            blocks = [
                grid(
                    np.linspace(-long, long, along + 1), np.linspace(-short, short, self.cells + 1)
                )
            ]
        else:
            count = around(self.hole_radius, short, self.cells)
            side = np.linspace(-short, short, count // 4 + 1)
            ends = np.full(count // 4, short)
            ahead, back = side[:-1], side[:0:-1]
            square = np.hstack([[ahead, -ends], [ends, ahead], [back, ends], [-ends, back]]).T
            blocks = [ring(circle(self.hole_radius, count), square, self.cells)]
            if long > short:
                rest = min(math.ceil(count * (long / short - 1.0) / 8.0), LONG * count)
                part = np.linspace(short, long, rest + 1)
                blocks += [grid(part, side), grid(-part, side)]
        if y > x:
            blocks = [one[..., ::-1] for one in blocks]
        near = SAME * long
        edges = {
            "left": lambda p: p[0] < near - x,
            "right": lambda p: p[0] > x - near,
            "bottom": lambda p: p[1] < near - y,
            "top": lambda p: p[1] > y - near,
            "inner": lambda p: np.hypot(*p) < short * (1.0 - SAME),
        }
        places = {
            f"{one}_{other}": (u, v)
            for one, u in (("left", -x), ("right", x))
            for other, v in (("bottom", -y), ("top", y))
        }
        return named(blocks, long, edges, places)


@dataclass(frozen=True)
class Disc:
    """A disc about the origin, with a hole an annulus.

    Its edges are `outer` and, of a hole, `inner`; its points `right`, `top`, `left`, `bottom` on the
    outer one, and `center` of a full disc.
    """

    radius: Length
    hole_radius: HoleRadius = None
    cells: Annotated[int, whole(1, 500), "from the center or the hole to the edge"] = CELLS

    @property
    def room(self) -> float:
        """Radius of a hole that is too large [m]."""
        return self.radius

    def interpolation(self, dim: int) -> str | None:
        """The word of the one that errs least on rings: `ancf` by twice as much."""
        return "fvs" if dim == 3 else None

    def mesh(self) -> PlateMesh:
        R, r = self.radius, self.hole_radius or 0.0
        if r:
            count = around(r, R, self.cells)
            blocks = [ring(circle(r, count), circle(R, count), self.cells)]
        else:
            # long radially: moments at a clamped edge err by the angle of a cell
            half, across = max(1, round(0.75 * self.cells)), max(2, round(0.3 * self.cells))
            core = grid(*2 * [np.linspace(-1.0, 1.0, 2 * half + 1)])
            core = CORE * R * core * (1.0 + BULGE * (1.0 - core[..., ::-1] ** 2))
            square = np.concatenate([core[:-1, 0], core[-1, :-1], core[:0:-1, -1], core[0, :0:-1]])
            outside = np.linspace(0.0, 1.0, across + 1)[:, None, None]
            blocks = [core, closed(square + outside * (circle(R, 8 * half) - square))]
        edges = {
            "inner": lambda p: np.hypot(*p) < 0.5 * (r + R),
            "outer": lambda p: np.hypot(*p) > 0.5 * (r + R),
        }
        places = {"right": (R, 0.0), "top": (0.0, R), "left": (-R, 0.0), "bottom": (0.0, -R)}
        return named(blocks, R, edges, places)


def check_hole(plate: Rectangle | Disc) -> Iterator[tuple[str, Problem]]:
    """What is wrong with the hole of a plate."""
    if plate.hole_radius is not None and plate.hole_radius >= plate.room:
        told = f"a hole inside the plate, of a radius below {plate.room:g} m"
        yield "hole_radius", Problem(told, f"{plate.hole_radius:g} m")


# --------------------------------------------------------------------------------------------------------------- blocks
def grid(x: Floats, y: Floats) -> Floats:
    """Points (i, j, 2) of a grid."""
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def circle(radius: float, count: int) -> Floats:
    """Points (n, 2) of a circle, from the direction (-1, -1) on."""
    angles = math.pi * (2.0 * np.arange(count) / count - 0.75)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def around(inner: float, outer: float, cells: int) -> int:
    """Cells around a ring that are about as long as wide, a multiple of 8."""
    count = 2.0 * math.pi / math.expm1(math.log(outer / inner) / cells)
    return 8 * math.ceil(max(min(count, LONG * cells), AROUND) / 8)


def ring(inner: Floats, outer: Floats, cells: int) -> Floats:
    """Points (n + 1, i, 2) between two closed lines (n, 2), whose distances grow as circles do."""
    growth = np.linalg.norm(outer, axis=1).min() / np.linalg.norm(inner, axis=1).max()
    shares = (growth ** np.linspace(0.0, 1.0, cells + 1) - 1.0) / (growth - 1.0)
    return closed(inner + shares[:, None, None] * (outer - inner))


def closed(points: Floats) -> Floats:
    """Points (n + 1, i, 2) around, the first ones once more at the end, of lines (i, n, 2).

    Cells then follow one another around, and arrows of loads, at cells with numbers that are evenly
    spread, stand all around.
    """
    return np.concatenate([points, points[:, :1]], axis=1).swapaxes(0, 1)


def named(
    blocks: Sequence[Floats], size: float, edges: Edges, places: Mapping[str, tuple[float, float]]
) -> PlateMesh:
    """The mesh of blocks of points (i, j, 2), joined where these are the same to `SAME` of a size [m],
    with names of those edges and places that it has.
    """
    from skfem import MeshQuad  # slow to import, and most scenes draw no plate

    corners = np.concatenate(
        [
            np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]], axis=2).reshape(-1, 2)
            for p in blocks
        ]
    )
    rounded = np.round(corners / (SAME * size))
    _, first, nodes = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    mesh = MeshQuad(np.ascontiguousarray(corners[first].T), nodes.reshape(-1, 4).T.copy())
    border = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, border]]
    found = {name: border[on(ends).all(axis=0)] for name, on in edges.items()}
    out = plate_meshes.from_skfem(
        mesh.with_boundaries({k: ids for k, ids in found.items() if len(ids)})
    )
    away = {
        name: np.linalg.norm(out.points[:, :2] - place, axis=1)
        for name, place in {**places, "center": (0.0, 0.0)}.items()
    }
    points = {name: np.array([d.argmin()]) for name, d in away.items() if d.min() < SAME * size}
    return replace(out, point_groups=points)
