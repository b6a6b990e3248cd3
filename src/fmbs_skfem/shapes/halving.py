"""Meshes of plates and shells with every side halved: four cells in place of one, on arcs and curved surfaces too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from . import fvs_shell, plate_audit, plate_meshes, surface
from .ancf_plate import Arc
from .plate_meshes import PlateMesh
from .surface import Parent
from .table import Floats


def halve(mesh: PlateMesh, arcs: Iterable[Arc] = ()) -> PlateMesh:
    """A plane mesh with a node in the middle of every side and quad, behind its own nodes; groups keep their names.

    Nodes in the middle of sides on arcs lie on them. By scikit-fem.
    """
    coarse = plate_meshes.to_skfem(mesh)
    fine = coarse.refined()
    count = len(mesh.points)
    keys = plate_audit.side_keys(coarse.facets.T, count)
    order = np.argsort(keys)  # the node in the middle of facet k is count + k
    for arc in arcs:
        middles = count + order[np.searchsorted(keys[order], plate_audit.side_keys(arc.edges, count))]
        radii = fine.p[:, middles].T - arc.center
        fine.p[:, middles] = (arc.center + arc.radius * radii / np.linalg.norm(radii, axis=1, keepdims=True)).T
    found = plate_meshes.from_skfem(fine)
    return replace(found, point_groups=mesh.point_groups, path=mesh.path)


def halve_curved(mesh: PlateMesh) -> PlateMesh:
    """A mesh of triangles or quads in space with a node in the middle of every side, on the smooth surface through its nodes.

    Quads are cut, and nodes placed, as `fvs_shell` does, which goes through all nodes; groups keep their names.
    """
    mesh = fvs_shell.triangles(mesh)
    count, corners = len(mesh.points), mesh.cells
    ends = plate_audit.sides(corners)
    keys, first, side = np.unique(plate_audit.side_keys(ends, count), return_index=True, return_inverse=True)
    a, b, c = corners.T
    ab, bc, ca = (count + side.reshape(-1, 3)).T
    cells = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]).transpose(2, 0, 1).reshape(-1, 3)

    def halves(pairs: np.ndarray) -> np.ndarray:
        middle = count + np.searchsorted(keys, plate_audit.side_keys(pairs, count))
        return np.stack([pairs[:, 0], middle, middle, pairs[:, 1]], axis=1).reshape(-1, 2)

    return replace(
        mesh,
        points=np.concatenate([mesh.points, middles(mesh, first // 3, first % 3)]),
        cells=cells,
        edge_groups={name: halves(pairs) for name, pairs in mesh.edge_groups.items()},
        face_groups={name: (4 * ids[:, None] + np.arange(4)).ravel() for name, ids in mesh.face_groups.items()},
    )


def middles(mesh: PlateMesh, cell: np.ndarray, side: np.ndarray) -> Floats:
    """Points (x, 3) in the middle of sides (x,) of triangles (x,), on the smooth surface through the nodes of a mesh."""
    shape = fvs_shell.surface(mesh)[0]
    rows = surface.sample(shape, cell, surface.side_points(Parent.TRIANGLE, side, np.full(len(side), 0.5)))
    return np.asarray(rows @ shape.reference)
