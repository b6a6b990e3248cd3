"""A line with other cells, along the smooth curve through its points."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError, say
from ..shapes import curves, meshes


def remesh(mesh: meshes.LineMesh, group: str | None, cells: int | None = None, refine: int = 1) -> meshes.LineMesh:
    """One body of a mesh with other cells: `cells` of equal length, or every cell split into `refine`.

    Points lie on the smooth curve through the old ones. Named points stay points of the mesh: the nearest inner cut moves to them,
    and the cells beside them differ in length where they do not divide the line evenly.
    """
    order = meshes.chain(mesh, group)
    breaks, curve = curves.through(mesh.points[order])
    where = {int(node): float(xi) for node, xi in zip(order, breaks, strict=True)}
    names = {name: where[int(ids[0])] for name, ids in mesh.point_groups.items() if len(ids) == 1 and int(ids[0]) in where}
    if cells is None:
        steps = np.arange(refine) / refine
        cuts = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).ravel(), breaks[-1])
    else:
        cuts = _cuts(breaks[-1], cells, sorted(set(names.values())))
    nodes = np.arange(len(cuts))
    groups = {name: np.array([np.argmin(np.abs(cuts - xi))]) for name, xi in names.items()}
    return meshes.LineMesh(curve(cuts, 0), np.column_stack([nodes[:-1], nodes[1:]]), groups, {}, mesh.path)


def _cuts(length: float, cells: int, kept: list[float]) -> np.ndarray:
    """Equal cuts of [0, length] of which the nearest move to the values to be kept."""
    inner = [xi for xi in kept if 1e-9 * length < xi < (1 - 1e-9) * length]
    if len(inner) >= cells:
        raise InputError(say("mesh", f"at least {len(inner) + 1} cells, one more than named inner points", cells))
    cuts = np.linspace(0.0, length, cells + 1)
    free = np.arange(1, cells)
    for xi in inner:
        nearest = free[np.argmin(np.abs(cuts[free] - xi))]
        cuts[nearest] = xi
        free = free[free != nearest]
    return np.sort(cuts)
