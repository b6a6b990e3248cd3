"""Plane meshes of plates with every side halved, by scikit-fem: four cells in place of one, on arcs too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from . import plate_audit, plate_meshes
from .ancf_plate import Arc
from .plate_meshes import PlateMesh


def halve(mesh: PlateMesh, arcs: Iterable[Arc] = ()) -> PlateMesh:
    """The mesh with a node in the middle of every side and quad, behind its own nodes; groups keep their names.

    Nodes in the middle of sides on arcs lie on them.
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
