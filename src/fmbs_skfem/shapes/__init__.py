"""Lines and surfaces: files become points and cells, cells become interpolations, interpolations
become tabulated basis functions.

meshes.read -> LineMesh -> curves.through -> curve -> line.fit in a line.BSpline or line.Hermite
    -> line.tabulate -> table.BasisTable
plate_meshes.read -> PlateMesh -> ancf_plate.surface, fvs_plate.surface, skfem_surface.bfs,
    skfem_surface.argyris -> surface.Surface
plate_meshes.read -> PlateMesh -> structured.surface, fvs_shell.surface (curved) -> surface.Surface
nurbs.surface, nurbs_file.read -> surface.Surface -> surface.tabulate -> table.BasisTable
table.check_table: the contract of all
"""

from . import (  # isort: skip
    meshes,
    plate_meshes,
    curves,
    line,
    nurbs,
    nurbs_file,
    interfaces,
    ancf_plate,
    fvs_plate,
    skfem_surface,
)
from . import surface, table  # isort: skip

__all__ = [
    "meshes",
    "plate_meshes",
    "curves",
    "line",
    "nurbs",
    "nurbs_file",
    "interfaces",
    "ancf_plate",
    "fvs_plate",
    "skfem_surface",
    "surface",
    "table",
]
