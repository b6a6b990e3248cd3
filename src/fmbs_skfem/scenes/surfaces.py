"""Surfaces of plates and shells: mesh and NURBS files become the interpolation that the scene names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import singledispatch
from pathlib import Path

import numpy as np

from ..core.errors import InputError, closest, say
from ..shapes import ancf_plate, meshes, nurbs_file, plate_meshes, skfem_surface
from ..shapes.plate_meshes import PlateMesh
from ..shapes.surface import Surface
from . import schema

FLAT = 1e-12  #: height of a mesh over the plane z = 0, relative to its extent, that is round-off


@singledispatch
def shape(model: object, folder: Path, allow_outside: bool = False, repair: bool = False) -> Surface:
    """The surface of a model whose files are relative to `folder`; `repair` merges nodes of a mesh that are at one place."""
    raise InputError(say("body", "a plate or shell", type(model).__name__))


@shape.register
def _(model: schema.Plate, folder: Path, allow_outside: bool = False, repair: bool = False) -> Surface:
    mesh = plate_meshes.read(meshes.path(model.mesh, folder, allow_outside), True, model.face, repair)
    height = float(np.abs(mesh.points[:, 2]).max())
    if height > FLAT * float(np.ptp(mesh.points, axis=0).max()):
        raise InputError(say(f"mesh {mesh.path}", "a plate in the plane z = 0", f"z = {height:.6g} m", "place it with 'origin'"))
    corners = 3 if model.interpolation == "argyris" else 4
    if mesh.cells.shape[1] != corners:
        wanted = "triangles for argyris" if corners == 3 else f"quads for {model.interpolation}"
        got, remedy = ("quads", "ancf or bfs") if corners == 3 else ("triangles", "argyris")
        raise InputError(say(f"mesh {mesh.path}", wanted, got, f"mesh it again, or take the interpolation {remedy}"))
    return ordered(INTERPOLATIONS[model.interpolation](mesh, model.arcs), model.order)


@shape.register
def _(model: schema.Shell, folder: Path, allow_outside: bool = False, repair: bool = False) -> Surface:
    path = meshes.path(model.nurbs, folder, allow_outside)
    shape = nurbs_file.read(path, cells=model.cells, degree=model.degree, scale=model.unit, join=model.join)
    return ordered(shape, model.order)


def ordered(surface: Surface, order: int | None) -> Surface:
    """A surface with other Gauss points."""
    return surface if order is None else replace(surface, order=order)


def ancf(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    points = mesh.points[:, :2]
    found = ancf_plate.arcs_of(points, mesh.edge_groups, arcs)
    return ancf_plate.surface(points, mesh.cells, found, mesh.point_groups, mesh.edge_groups, mesh.face_groups)


def bfs(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    return skfem_surface.bfs(mesh.points[:, :2], mesh.cells, mesh.point_groups, mesh.edge_groups, mesh.face_groups)


def argyris(mesh: PlateMesh, arcs: list[str] | None) -> Surface:
    return skfem_surface.argyris(mesh.points[:, :2], mesh.cells, mesh.point_groups, mesh.edge_groups, mesh.face_groups)


INTERPOLATIONS: dict[str, Callable[[PlateMesh, list[str] | None], Surface]] = {"ancf": ancf, "bfs": bfs, "argyris": argyris}


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
            raise InputError(say("thickness", "every cell in one face", f"cell {cell} in '{name}' and another one"))
        found[surface.faces[name]] = part
    if not found.all():
        bare = f"none for {int((found == 0).sum())} of {len(found)} cells"
        raise InputError(say("thickness", "a thickness of every cell", bare, "name the other faces too"))
    return found
