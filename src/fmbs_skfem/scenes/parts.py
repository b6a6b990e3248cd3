"""Bodies of a scene: files and models become bodies; a rule for every body type of the schema."""

from __future__ import annotations

from functools import singledispatch

import numpy as np
from scipy.spatial.transform import Rotation

from ..bodies import body as bodies
from ..bodies import plate as plates
from ..bodies import rigid, sections
from ..bodies.body import Body
from ..bodies.laws import CABLES
from ..core.errors import InputError, say
from ..shapes import curves, meshes, plate_meshes
from . import schema, surfaces
from .fields import Turn, Vector

CURVATURES = {law.name.lower(): law for law in CABLES}


@singledispatch
def part(model: object, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    """The body of a model; a rule for every body type of the schema."""
    raise InputError(say(f"body '{name}'", "a body", type(model).__name__))


@part.register
def _(model: schema.Cable, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    mesh = meshes.read(meshes.path(model.mesh, scene.folder, allow_outside), scene.repair)
    if cells is not None or model.refine > 1:
        mesh = remeshed(mesh, model.line, cells, model.refine)
        group = None
    else:
        group = model.line
    return bodies.cable(
        name,
        mesh,
        section(model.section),
        None if model.material is None else material(model.material),
        dim=scene.dimension,
        group=group,
        degree=model.degree,
        continuity=model.continuity,
        ancf=model.interpolation == "ancf",
        law=CURVATURES[model.curvature],
        origin=array(model.origin),
        rotation=matrix(model.rotation),
    )


@part.register
def _(model: schema.PointMass, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    return bodies.point_mass(name, model.mass, np.array(model.position))


@part.register
def _(model: schema.Rigid, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    return rigid.rigid(
        name,
        model.mass,
        np.array(model.inertia),
        model.center,
        dim=scene.dimension,
        rotation=matrix(model.rotation),
        places=model.points,
    )


@part.register
def _(model: schema.RigidPlate, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    path = meshes.path(model.mesh, scene.folder, allow_outside)
    mesh = plate_meshes.read(path, scene.dimension == 2, repair=scene.repair)
    return rigid.rigid_from_mesh(
        name,
        mesh,
        model.thickness,
        model.density,
        dim=scene.dimension,
        origin=array(model.origin),
        rotation=matrix(model.rotation),
    )


@part.register(schema.Plate)
@part.register(schema.Shell)
def _(model: schema.Plate | schema.Shell, scene: schema.Scene, name: str, cells: int | None, allow_outside: bool) -> Body:
    shape = surfaces.shape(model, scene.folder, allow_outside, scene.repair)
    return plates.plate(
        name,
        shape,
        surfaces.thickness(model.thickness, shape),
        material(model.material),
        dim=scene.dimension,
        rims={frame: plates.Rim(rim.edges, rim.center) for frame, rim in model.rims.items()},
        origin=array(model.origin),
        rotation=matrix(model.rotation),
    )


def material(model: schema.Material) -> sections.Material:
    """The material of a model."""
    return sections.Material(model.young_modulus, model.density, model.poisson_ratio)


@singledispatch
def section(model: object) -> sections.Given | sections.Circular | sections.Rectangular:
    """The section of a model; a rule for every shape."""
    raise InputError(say("section", "a section", type(model).__name__))


@section.register
def _(model: schema.Circular) -> sections.Circular:
    return sections.Circular(model.diameter)


@section.register
def _(model: schema.Rectangular) -> sections.Rectangular:
    return sections.Rectangular(model.width, model.height)


@section.register
def _(model: schema.Given) -> sections.Given:
    return sections.Given(model.EA, model.EI, model.rhoA)


def array(vector: Vector | None) -> np.ndarray | None:
    return None if vector is None else np.array(vector)


def matrix(rotation: Turn | None) -> np.ndarray | None:
    """Rotation matrix (c, c): about z in the plane, about the axis in space."""
    if rotation is None:
        return None
    if rotation.axis is None:
        c, s = np.cos(rotation.angle), np.sin(rotation.angle)
        return np.array([[c, -s], [s, c]])
    axis = np.array(rotation.axis)
    return np.asarray(Rotation.from_rotvec(rotation.angle * axis / np.linalg.norm(axis)).as_matrix())


def remeshed(mesh: meshes.LineMesh, group: str | None, cells: int | None = None, refine: int = 1) -> meshes.LineMesh:
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
