"""Surfaces of plates and shells: mesh and NURBS files become the interpolation that the scene
names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.sparse import csr_array

from ..core import own_words
from ..core.errors import InputError, closest, say
from ..core.notices import notify, remark
from ..core.storage.records import dataclass
from ..shapes import ancf_plate, fvs_plate, fvs_shell, plate_meshes, skfem_surface, structured
from ..shapes.plate_meshes import PlateMesh
from ..shapes.surface import Surface

Make = TypeVar("Make", bound=Callable[[PlateMesh, "list[str] | None"], Surface])
SMOOTH = 0.4  #: part of their functions that cells share across a line if slopes are among them, and do not share otherwise
JUMP = 0.1  #: of a thickness between such cells, that is worth a notice
DENTED = 0.02  #: distance of such a surface over what digits resolve, from which these make it
ROUGH = 0.05  #: of the thickness: distance of a surface through nodes from the one meant that is worth a notice
#: change of the turns of grid lines [deg] beyond which quads are no even grid, see
#: `structured.unevenness`: stresses of `ancf` stay off by 1 % at 8 degrees (nodes moved by 0.02 of
#: a side) and by 10 % at 45, those of `fvs` fall with the cells; splines through curved ones give a
#: roof that is too stiff by 0.3 % at 8 degrees, by 30 % at 45
UNEVEN = 6.0
FLAT = 1e-12  #: height of a mesh over the plane z = 0, relative to its extent, that is round-off


def set_order(surface: Surface, order: int | None) -> Surface:
    """A surface with other Gauss points."""
    return surface if order is None else replace(surface, order=order)


@dataclass(frozen=True)
class PlateInterpolation:
    """How plates of meshes are interpolated."""

    #: of its cells; a mesh of quads and triangles is split into the first kind
    corners: tuple[int, ...]
    #: of a mesh, and the names of edges that are arcs, None to find them
    make: Callable[[PlateMesh, list[str] | None], Surface]
    arcs: bool  #: whether it has curved sides


INTERPOLATIONS: dict[str, PlateInterpolation] = {}  #: by the word of scenes


def interpolation(
    word: str, corners: int | tuple[int, ...], arcs: bool = False
) -> Callable[[Make], Make]:
    """Declare a function of a mesh and the names of arcs as an interpolation of plates:
    `interpolation: word` in a scene.

    `corners` of its cells are 3, 4 or both; of both, a mesh of quads and triangles is split into
    cells of the first.
    """

    def declare(make: Make) -> Make:
        own = own_words.free(INTERPOLATIONS, word, make.__module__, lambda one: one.make.__module__)
        INTERPOLATIONS[own] = PlateInterpolation(
            (corners,) if isinstance(corners, int) else corners, make, arcs
        )
        return make

    return declare


def choose(mesh: PlateMesh, dim: int) -> str:
    """The interpolation of a plate that names none: `ancf` where it converges, on even grids of
    quads and in the plane.
    """
    if mesh.cells.shape[1] == 3 or (
        dim == 3 and structured.unevenness(mesh.points, mesh.cells) > UNEVEN
    ):
        return "fvs"
    return "ancf"


@interpolation("ancf", 4, arcs=True)
def ancf(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    points = mesh.points[:, :2]
    found = ancf_plate.arcs_of(points, mesh.edge_groups, arcs, mesh.resolution)
    found = ancf_plate.fitting(points, mesh.cells, found) if arcs is None else found
    return ancf_plate.surface(
        points, mesh.cells, found, mesh.point_groups, mesh.edge_groups, mesh.face_groups
    )


@interpolation("fvs", (3, 4), arcs=True)
def fvs(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    points = mesh.points[:, :2]
    found = ancf_plate.arcs_of(points, mesh.edge_groups, arcs, mesh.resolution)
    found = ancf_plate.fitting(points, mesh.cells, found) if arcs is None else found
    return fvs_plate.surface(
        points, mesh.cells, found, mesh.point_groups, mesh.edge_groups, mesh.face_groups
    )


@interpolation("bfs", 4)
def bfs(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    return skfem_surface.bfs(
        mesh.points[:, :2], mesh.cells, mesh.point_groups, mesh.edge_groups, mesh.face_groups
    )


@interpolation("argyris", 3)
def argyris(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    return skfem_surface.argyris(
        mesh.points[:, :2], mesh.cells, mesh.point_groups, mesh.edge_groups, mesh.face_groups
    )


def refined(mesh: PlateMesh, times: int, arcs: list[str] | None) -> PlateMesh:
    """The mesh with every side cut into `times`, a power of two; new nodes lie on `arcs`, None to
    find these.
    """
    for _ in range(times.bit_length() - 1):
        mesh = plate_meshes.halve(
            mesh, ancf_plate.arcs_of(mesh.points[:, :2], mesh.edge_groups, arcs, mesh.resolution)
        )
    return mesh


def curved(mesh: PlateMesh, cells: int, degree: int | None) -> tuple[Surface, float]:
    """The surface through the nodes of a mesh, and the distance [m] to which they define it.

    On even grids of quads it is a spline, split into `cells` or raised to `degree`, which other
    meshes cannot be; else `fvs_shell`, whose sides are cut into `cells`, a power of two.
    """
    where = f"mesh {mesh.path or 'in memory'}"
    try:
        found = structured.surface(mesh, cells, degree)
    except structured.NoGrid as reason:
        if degree is not None:
            raise InputError(f"{reason}; without `degree` any mesh will do") from None
    else:
        if structured.unevenness(mesh.points, mesh.cells) <= UNEVEN:
            return found
        if degree is not None:
            notify(
                f"{where}: a spline through an uneven grid does not converge: leave out `degree`, or mesh it evenly"
            )
            return found
    if cells.bit_count() > 1:
        raise InputError(
            say(
                f"{where}: cells",
                "1, 2, 4, 8 or another power of two where quads are in no even grid",
                cells,
            )
        )
    if mesh.cells.shape[1] == 4:
        remark(
            f"{where}: {len(mesh.cells)} quads in no even grid: every quad is cut along its shorter diagonal"
        )
    shape, error = fvs_shell.surface(mesh)
    for _ in range(cells.bit_length() - 1):
        mesh = fvs_shell.halve(mesh, shape)
        shape = fvs_shell.surface(mesh)[0]
    return shape, error


def tell_rough(
    where: str, error: float, thickness: float | Mapping[str, float], resolution: float
) -> None:
    """A notice where nodes, or the digits of their file, define a surface to more than a part of its
    thickness [m] only.

    `resolution` is that of the digits [m]; nodes that stand exactly where they say make no error.
    """
    thin = min(thickness.values()) if isinstance(thickness, Mapping) else thickness
    if resolution > ROUGH * thin and error > DENTED * resolution:
        part = f"{100.0 * resolution / thin:.0f} % of the thickness"
        text = f"its digits place nodes to about {resolution:.2g} m, {part}, which dents a smooth surface"
        remedy = "write more digits, or export the body near the origin"
    elif error > ROUGH * thin:
        text = f"the smooth surface through the nodes is defined to about {error:.2g} m, {100 * error / thin:.2g} % of its thickness"
        remedy = "mesh it finer; where it has a kink, make two bodies that are joined there"
    else:
        return
    notify(f"{where}: {text}: {remedy}")


def thickness(value: float | Mapping[str, float], surface: Surface) -> float | np.ndarray:
    """One thickness, or one for each cell by the faces that hold it: every cell in exactly one."""
    if not isinstance(value, Mapping):
        return value
    found = np.zeros(len(surface.nodes))
    for name, part in value.items():
        if name not in surface.faces:
            known = f"one of the faces {', '.join(sorted(surface.faces)) or '(there are none)'}"
            raise InputError(say("thickness", known, f"'{name}'") + closest(name, surface.faces))
        if found[surface.faces[name]].any():
            cell = surface.faces[name][np.argmax(found[surface.faces[name]] > 0)]
            raise InputError(
                say(
                    "thickness",
                    "every cell in one face",
                    f"cell {cell} in '{name}' and another one",
                )
            )
        found[surface.faces[name]] = part
    if not found.all():
        bare = f"none for {int((found == 0).sum())} of {len(found)} cells"
        raise InputError(
            say("thickness", "a thickness of every cell", bare, "name the other faces too")
        )
    tell_jumps(found, surface)
    return found


def tell_jumps(thickness: np.ndarray, surface: Surface) -> None:
    """A remark on a thickness (e,) [m] that jumps between cells which share their slopes, so that
    strains cannot jump with it.

    Curvatures can: what is bent alone is as exact as elsewhere, which is known of the solution
    only.
    """
    functions = surface.nodes.shape[1]
    uses = csr_array(
        (
            np.ones(surface.nodes.size),
            surface.nodes.ravel(),
            np.arange(0, surface.nodes.size + 1, functions),
        )
    )
    shared = (uses @ uses.T).tocoo()
    smooth = shared.data > SMOOTH * functions
    pairs = np.sort(thickness[np.array([shared.row[smooth], shared.col[smooth]])], axis=0)
    ratio = pairs[0] / pairs[1]
    if ratio.min() < 1.0 - JUMP:
        low, high = pairs[:, np.argmin(ratio)]
        text = f"jumps from {high:g} m to {low:g} m inside a surface whose strains are continuous from cell to cell"
        remark(
            f"thickness: {text}: where it is stretched, errors fall in proportion to the cells near that line; mesh it finely there"
        )
