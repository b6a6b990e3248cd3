"""Build the plate meshes of this folder: scikit-fem makes them (gmsh the unstructured ones), meshio exports them.

    links      a ring of cells around each hole, a web between: hole, circular outer end, straight flanks
    flanks     lines between the highest points of the ends, phi = 90 degrees;
               or their common external tangents, cos(phi) = (R1 - R2) / L; phi: polar angle of both points of contact

Usage: python meshes/build_plates.py [folder]. Lengths in metres. Without the package gmsh its files are left out.
"""

from __future__ import annotations

import importlib.util
import sys
import tempfile
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from skfem import MeshQuad

from fmbs_skfem.shapes import plate_meshes
from fmbs_skfem.shapes.plate_meshes import PlateMesh


@dataclass(frozen=True)
class End:
    """One end of a link: a hole in a circular end of the plate."""

    name: str
    x: float  #: [m]
    outer: float  #: radius of the end [m]
    hole: float  #: radius of the hole [m]


@dataclass(frozen=True)
class Link:
    """A plate with two holes."""

    ends: tuple[End, End]
    tangent: bool = False  #: flanks touch the ends as tangents, else they join their highest points

    @property
    def contact(self) -> float:
        """Polar angle of the flank's points of contact with both ends."""
        first, second = self.ends
        if not self.tangent:
            return 0.5 * np.pi
        return float(np.arccos((first.outer - second.outer) / (second.x - first.x)))

    def flank(self, x: np.ndarray) -> np.ndarray:
        """Height of the upper flank."""
        (first, second), phi = self.ends, self.contact
        if not self.tangent:
            return np.asarray(
                first.outer + (second.outer - first.outer) * (x - first.x) / (second.x - first.x)
            )
        return np.asarray((first.outer - (x - first.x) * np.cos(phi)) / np.sin(phi))

    def area(self) -> float:
        """Area of the plate [m^2]: two sectors, two kites between flanks and axis, less the holes."""
        (first, second), phi = self.ends, self.contact
        sectors = (np.pi - phi) * first.outer**2 + phi * second.outer**2
        kites = (first.outer + second.outer) * (second.x - first.x) * np.sin(phi)
        return float(sectors + kites - np.pi * (first.hole**2 + second.hole**2))


@dataclass(frozen=True)
class Cuts:
    """Numbers of cells: 2 * (row + flank + end) around a hole, `ring` across it; the web has 2 * row by `web`."""

    row: int  #: from the axis up to the flank
    flank: int  #: along the flank, from the web to the point of contact
    end: int  #: from the point of contact to the tip
    ring: int
    web: int


CRANK = Link((End("A", 0.0, 0.040, 0.015), End("B", 0.1, 0.035, 0.010)))
LINKAGE = Link((End("B", 0.0, 0.035, 0.010), End("C", 0.2, 0.035, 0.010)))
LINKS = {
    "plate_crank_coarse.msh": (CRANK, Cuts(4, 3, 5, 3, 6)),
    "plate_crank_coarse.vtu": (CRANK, Cuts(4, 3, 5, 3, 6)),
    "plate_crank_fine.msh": (CRANK, Cuts(12, 8, 16, 11, 14)),
    "plate_linkage_coarse.msh": (LINKAGE, Cuts(4, 3, 5, 3, 18)),
    "plate_linkage_fine.msh": (LINKAGE, Cuts(12, 8, 16, 11, 66)),
}
REACH = 0.95  #: of the end's radius: where the ring meets the web
LEAN = 0.7  #: 0: cells of a rim all as long; 1: lines of the ring point to the hole's centre


def half_ring(link: Link, end: End, cuts: Cuts) -> tuple[np.ndarray, np.ndarray]:
    """Outer points (n, 2) of the upper half of a ring, from the web to the tip, and their angles (n,) on the rim.

    Both count from the axis on the side of the web and are as for an end on the left; the other end is its mirror image.
    """
    facing = 1.0 if end is link.ends[0] else -1.0
    phi = link.contact if facing > 0 else np.pi - link.contact
    x = np.linspace(REACH * end.outer, end.outer * np.cos(phi), cuts.flank + 1)
    corner = float(link.flank(np.array(end.x + facing * x[0])))
    angle = np.linspace(phi, np.pi, cuts.end + 1)[1:]
    arc = end.outer * np.column_stack([np.cos(angle), np.sin(angle)])
    arc[-1] = -end.outer, 0.0
    column = np.column_stack([np.full(cuts.row, x[0]), np.linspace(0.0, corner, cuts.row + 1)[:-1]])
    outer = np.concatenate([column, np.column_stack([x, link.flank(end.x + facing * x)]), arc])
    polar = np.arctan2(outer[:, 1], outer[:, 0])
    return outer, LEAN * polar + (1.0 - LEAN) * np.linspace(0.0, np.pi, len(outer))


def ring(link: Link, end: End, cuts: Cuts) -> np.ndarray:
    """Points (around, across, 2) of a ring, counter-clockwise, first and last the same; symmetric about the axis to the bit.

    Cells grow outwards as circles do, r_i = r (R / r)^(i / n), and so keep their shape.
    """
    outer, angle = half_ring(link, end, cuts)
    rim = end.hole * np.column_stack([np.cos(angle), np.sin(angle)])
    rim[-1] = -end.hole, 0.0
    growth = end.outer / end.hole
    across = ((growth ** np.linspace(0.0, 1.0, cuts.ring + 1) - 1.0) / (growth - 1.0))[
        None, :, None
    ]
    upper = (1.0 - across) * rim[:, None] + across * outer[:, None]
    if end is not link.ends[0]:
        upper = (upper * [-1.0, 1.0])[::-1]
    around = np.concatenate([upper, (upper * [1.0, -1.0])[-2::-1]])
    return np.asarray(around + np.array([end.x, 0.0]))


def web(left: np.ndarray, right: np.ndarray, count: int) -> np.ndarray:
    """Points (along, up, 2) between two columns of points (up, 2)."""
    along = np.linspace(0.0, 1.0, count + 1)[:, None, None]
    return np.asarray((1.0 - along) * left + along * right)


def block(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and cells (e, 4) of a structured block (i, j, 2)."""
    i, j = (np.arange(count, dtype=float) for count in points.shape[:2])
    grid: Any = MeshQuad.init_tensor(i, j)
    at = grid.p.astype(int)
    return points[at[0], at[1]], grid.t.T


def joined(blocks: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and cells (e, 4) of blocks that share points (nearer than 1e-9 m)."""
    parts = [block(points) for points in blocks]
    points = np.concatenate([part for part, _ in parts])
    first = np.cumsum([0, *(len(part) for part, _ in parts)])
    cells = np.concatenate([cells + start for (_, cells), start in zip(parts, first, strict=False)])
    _, kept, same = np.unique(np.rint(points * 1e9), axis=0, return_index=True, return_inverse=True)
    return points[kept], same.ravel()[cells]


def link(shape: Link, cuts: Cuts) -> PlateMesh:
    """A link of quads with the groups of `named`."""
    rings = [ring(shape, end, cuts) for end in shape.ends]
    up = np.arange(-cuts.row, cuts.row + 1)
    turn = cuts.row + cuts.flank + cuts.end
    left, right = rings[0][up % (2 * turn), -1], rings[1][turn - up, -1]
    points, cells = joined([*(part[:, ::-1] for part in rings), web(left, right, cuts.web)])
    return plate_meshes.from_skfem(named(MeshQuad(points.T.copy(), cells.T.copy()), shape))


def named(mesh: Any, shape: Link) -> Any:
    """Face `plate`; edges `A` (rim of the hole A), `outer_A` (circular end at A), ..., `outer` (all but the rims)."""
    facets = mesh.boundary_facets()

    def circle(x: float, radius: float) -> np.ndarray:
        on = np.abs(np.hypot(mesh.p[0] - x, mesh.p[1]) - radius) < 1e-9
        return np.asarray(facets[on[mesh.facets[:, facets]].all(axis=0)])

    rims = {end.name: circle(end.x, end.hole) for end in shape.ends}
    arcs = {f"outer_{end.name}": circle(end.x, end.outer) for end in shape.ends}
    outer = np.setdiff1d(facets, np.concatenate(list(rims.values())))
    return mesh.with_boundaries(rims | {"outer": outer} | arcs).with_subdomains(
        {"plate": np.arange(mesh.nelements)}
    )


def rectangle(length: float, width: float, along: int, across: int) -> PlateMesh:
    """A rectangle from the origin: edges `left`, `right`, `bottom`, `top`, corners `a` to `d` counter-clockwise, face `plate`."""
    grid: Any = MeshQuad.init_tensor(
        np.linspace(0.0, length, along + 1), np.linspace(0.0, width, across + 1)
    )
    tests = {"left": (0, 0.0), "right": (0, length), "bottom": (1, 0.0), "top": (1, width)}
    edges = {
        name: grid.facets_satisfying(lambda x, k=k, at=at: np.isclose(x[k], at), True)
        for name, (k, at) in tests.items()
    }
    mesh = plate_meshes.from_skfem(
        grid.with_boundaries(edges).with_subdomains({"plate": np.arange(grid.nelements)})
    )
    corners = {"a": (0.0, 0.0), "b": (length, 0.0), "c": (length, width), "d": (0.0, width)}
    at = {
        name: np.flatnonzero(np.all(mesh.points[:, :2] == corner, axis=1))
        for name, corner in corners.items()
    }
    return replace(mesh, point_groups=at)


def outline(shape: Link, size: float) -> None:
    """The link in the current gmsh model, with cells of about `size`, smaller at the rims, and the groups of `named`."""
    import gmsh

    geo, phi = gmsh.model.geo, shape.contact
    curves: dict[str, list[int]] = {}

    def arcs(end: End, radius: float, angles: list[float]) -> tuple[list[int], list[int]]:
        """Points at polar angles and the arcs between them."""
        centre = geo.addPoint(end.x, 0.0, 0.0)
        points = [
            geo.addPoint(
                end.x + radius * np.cos(a), radius * np.sin(a), 0.0, min(size, 0.4 * radius)
            )
            for a in angles
        ]
        return points, [geo.addCircleArc(a, centre, b) for a, b in pairwise(points)]

    first, second = shape.ends
    left, curves[f"outer_{first.name}"] = arcs(first, first.outer, [phi, np.pi, 2 * np.pi - phi])
    right, curves[f"outer_{second.name}"] = arcs(second, second.outer, [-phi, 0.0, phi])
    flanks = [geo.addLine(left[-1], right[0]), geo.addLine(right[-1], left[0])]
    outer = [*curves[f"outer_{first.name}"], flanks[0], *curves[f"outer_{second.name}"], flanks[1]]
    for end in shape.ends:
        points, quarters = arcs(end, end.hole, [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi])
        curves[end.name] = [
            *quarters,
            geo.addCircleArc(points[-1], geo.addPoint(end.x, 0.0, 0.0), points[0]),
        ]
    loops = [geo.addCurveLoop(ids) for ids in (outer, *(curves[end.name] for end in shape.ends))]
    plate = geo.addPlaneSurface(loops)
    geo.synchronize()
    for name, ids in (curves | {"outer": outer}).items():
        gmsh.model.addPhysicalGroup(1, ids, name=name)
    gmsh.model.addPhysicalGroup(2, [plate], name="plate")


def unstructured(shape: Link, size: float, quads: bool) -> PlateMesh:
    """The link as gmsh meshes it: frontal-Delaunay triangles, or quads by recombination (blossom)."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        outline(shape, size)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.option.setNumber("Mesh.RecombineAll", int(quads))
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1)
        gmsh.model.mesh.generate(2)
        with tempfile.TemporaryDirectory() as folder:
            gmsh.write(f"{folder}/link.msh")
            mesh = plate_meshes.read(f"{folder}/link.msh", planar=True)
    finally:
        gmsh.finalize()
    return replace(mesh, path=None)


def everything() -> dict[str, PlateMesh]:
    """File name -> mesh."""
    out = {name: link(shape, cuts) for name, (shape, cuts) in LINKS.items()}
    out["plate_16x1.msh"] = rectangle(10.0, 1.0, 16, 1)
    out["plate_8x8.msh"] = rectangle(1.0, 1.0, 8, 8)
    if importlib.util.find_spec("gmsh"):
        out |= {
            "lug_quad.msh": unstructured(CRANK, 0.0076, True),
            "lug_tri.msh": unstructured(CRANK, 0.0076, False),
        }
    return out


def main(folder: Path = Path(__file__).parent) -> list[Path]:
    """Write every mesh; the paths written."""
    paths = []
    for name, mesh in everything().items():
        paths.append(folder / name)
        plate_meshes.write(mesh, paths[-1])
    return paths


if __name__ == "__main__":
    for written in main(*(Path(folder) for folder in sys.argv[1:2])):
        print(written)
