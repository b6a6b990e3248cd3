"""Bodies of a scene: their keys, in SI units once read, and how files and keys become bodies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field, StrictBool, StrictInt, StrictStr

from ..bodies import body as bodies
from ..bodies import laws, rigid
from ..bodies import plate as plates
from ..bodies.sections import Material, Section
from ..core.errors import InputError, say
from ..core.fields import ANY, Density, Length, Position, Vector, quantity, word
from ..shapes import curves, meshes, nurbs_file, plate_meshes
from ..shapes.surface import Surface
from . import fields, surfaces
from .declarations import Made
from .fields import Turn
from .models import Count, MeshFile, Model

if TYPE_CHECKING:
    from .schema import Scene

CURVATURES = {law.name.lower(): law for law in laws.CABLES}


class Cable(Model):
    """A thin cable or beam along a line of a mesh file; `refine` splits every mesh cell into that many."""

    type: Literal["cable"]
    mesh: MeshFile
    line: Annotated[StrictStr | None, Field(description="a named line of the mesh; without it the whole mesh")] = None
    interpolation: Literal["bspline", "ancf"] = "bspline"
    degree: Annotated[StrictInt, Field(ge=2, le=9, description="of bspline; ancf has 3")] = 3
    continuity: Annotated[StrictInt, Field(ge=1, le=8, description="derivatives that are continuous from cell to cell")] = 1
    section: Annotated[Section, Made(Section)]
    material: Annotated[Material, Made(Material)] | None = None
    curvature: Annotated[
        Literal["exact", "material", "quadratic"],
        Field(description="geometric curvature, rotation per reference length, or the norm of the second derivative"),
    ] = "exact"
    law: Annotated[StrictStr | None, Field(description="a law of `extensions`; without it that of `curvature`")] = None
    numbers: Annotated[dict[str, Annotated[float, ANY]] | None, Field(description="numbers of the law by name, quantities")] = None
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    refine: Annotated[StrictInt, Field(ge=1, le=1000)] = 1

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        mesh = meshes.read(meshes.path(self.mesh, scene.folder, allow_outside), scene.repair)
        if cells is not None or self.refine > 1:
            mesh = remesh(mesh, self.line, cells, self.refine)
            group = None
        else:
            group = self.line
        return bodies.cable(
            name,
            mesh,
            self.section,
            self.material,
            dim=scene.dimension,
            group=group,
            degree=self.degree,
            continuity=self.continuity,
            ancf=self.interpolation == "ancf",
            law=CURVATURES[self.curvature] if self.law is None else laws.find(self.law),
            numbers=self.numbers,
            origin=array(self.origin),
            rotation=matrix(self.rotation),
        )


class PointMass(Model):
    """A mass point."""

    type: Literal["point_mass"]
    mass: Annotated[float, quantity("kg", "> 0")]
    position: Position

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        return bodies.point_mass(name, self.mass, np.array(self.position))


class Rigid(Model):
    """A rigid body of given mass and inertia about its centre of mass; its frame is `frame`, its centre `center`.

    Points are given in the frame of the scene; `rotation` turns the axes in which the inertia is given.
    """

    type: Literal["rigid"]
    mass: Annotated[float, quantity("kg", "> 0")]
    inertia: fields.Inertia
    center: Position
    points: dict[str, Position] = Field(default_factory=dict)
    rotation: fields.Rotation | None = None

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        return rigid.rigid(
            name,
            self.mass,
            np.array(self.inertia),
            self.center,
            dim=scene.dimension,
            rotation=matrix(self.rotation),
            places=self.points,
        )


class RigidPlate(Model):
    """The rigid body that a plate of a mesh file makes; single points of the mesh are its places, beside `frame` and `center`."""

    type: Literal["rigid_plate"]
    mesh: MeshFile
    thickness: Length
    density: Density
    origin: Position | None = None
    rotation: fields.Rotation | None = None

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        path = meshes.path(self.mesh, scene.folder, allow_outside)
        mesh = plate_meshes.read(path, scene.dimension == 2, repair=scene.repair)
        return rigid.rigid_from_mesh(
            name,
            mesh,
            self.thickness,
            self.density,
            dim=scene.dimension,
            origin=array(self.origin),
            rotation=matrix(self.rotation),
        )


class Plate(Model):
    """A thin plate over a mesh file, in the plane a membrane.

    `arcs` are edges that are circular arcs, for ancf; `rims` makes rigid frames of named edges, with centres in the frame of the
    scene; `order` is the number of Gauss points a direction.
    """

    type: Literal["plate"]
    mesh: MeshFile
    face: Annotated[StrictStr | None, Field(description="a named group of cells; without it the whole mesh")] = None
    interpolation: Annotated[str, word(surfaces.INTERPOLATIONS)] = "ancf"
    arcs: Annotated[list[StrictStr] | None, Field(description="a list of edges; without it arcs are found")] = None
    thickness: fields.Thickness
    material: Annotated[Material, Made(Material)]
    rims: fields.Rims = Field(default_factory=dict)
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[StrictInt, Field(ge=1, le=10)] | None = None

    def surface(self, folder: Path, allow_outside: bool = False, repair: bool = False) -> Surface:
        """The surface of its file, whose path is relative to `folder`; `repair` merges nodes that are at one place."""
        mesh = plate_meshes.read(meshes.path(self.mesh, folder, allow_outside), True, self.face, repair)
        height = float(np.abs(mesh.points[:, 2]).max())
        if height > surfaces.FLAT * float(np.ptp(mesh.points, axis=0).max()):
            raise InputError(
                say(f"mesh {mesh.path}", "a plate in the plane z = 0", f"z = {height:.6g} m", "place it with 'origin'")
            )
        chosen = surfaces.INTERPOLATIONS[self.interpolation]
        if mesh.cells.shape[1] != chosen.corners:
            wanted = f"{'triangles' if chosen.corners == 3 else 'quads'} for {self.interpolation}"
            got, remedy = ("quads", "ancf or bfs") if chosen.corners == 3 else ("triangles", "argyris")
            raise InputError(say(f"mesh {mesh.path}", wanted, got, f"mesh it again, or take the interpolation {remedy}"))
        return surfaces.set_order(chosen.make(mesh, self.arcs), self.order)

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        return of_surface(self, scene, name, self.surface(scene.folder, allow_outside, scene.repair))


class Shell(Model):
    """A thin plate or shell over the NURBS patches of a file (.json, .igs, .iges, .3dm).

    Every span of the file is split into `cells` and raised to `degree`; `unit` is the length of the file's unit. Edges, points
    and faces have the names of the file and of its patches. Sides of patches that coincide are joined, also those of one patch,
    which closes it; `join: false` leaves all of them apart, for a surface with a slit. A joined side is no edge any more: supports
    and loads there are refused, unless `join: true` says that the line inside the surface is meant.
    """

    type: Literal["shell"]
    nurbs: Annotated[StrictStr, Field(description="a file of NURBS patches, its path from the folder of the scene")]
    cells: Count = 1
    degree: Annotated[StrictInt, Field(ge=1, le=10)] | None = None
    unit: Length = 1.0
    join: Annotated[
        StrictBool | None, Field(description="true or false; without it the file says, else sides that meet are joined")
    ] = None
    thickness: fields.Thickness
    material: Annotated[Material, Made(Material)]
    rims: fields.Rims = Field(default_factory=dict)
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[StrictInt, Field(ge=1, le=12)] | None = None

    def surface(self, folder: Path, allow_outside: bool = False, repair: bool = False) -> Surface:
        """The surface of its file, whose path is relative to `folder`; `repair` merges nodes that are at one place."""
        path = meshes.path(self.nurbs, folder, allow_outside)
        shape = nurbs_file.read(path, cells=self.cells, degree=self.degree, scale=self.unit, join=self.join)
        return surfaces.set_order(shape, self.order)

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        return of_surface(self, scene, name, self.surface(scene.folder, allow_outside, scene.repair))


class PlacedPart(Model):
    """A reduced body from a file that `fmbs part train` wrote, with the places of the body that it was made of.

    It stands where it was trained, x -> origin + rotation x elsewhere, as often as wanted.
    """

    type: Literal["part"]
    file: Annotated[StrictStr, Field(description="a file of a part (.part.h5), its path from the folder of the scene")]
    origin: Position | None = None
    rotation: fields.Rotation | None = None

    def build(self, scene: Scene, name: str, cells: int | None, allow_outside: bool) -> bodies.Body:
        from ..reduction import part_files, parts

        path = meshes.path(self.file, scene.folder, allow_outside, "part")
        found = part_files.load(path).body
        if found.dim != scene.dimension:
            remedy = f"train it in a scene of dimension {scene.dimension}"
            raise InputError(say(f"{path}", f"a part of dimension {scene.dimension}", found.dim, remedy))
        return parts.placed(found, name, array(self.origin), matrix(self.rotation))


Body: TypeAlias = Annotated[Cable | PointMass | Rigid | RigidPlate | Plate | Shell | PlacedPart, Field(discriminator="type")]
FILES = ("mesh", "nurbs", "file")  #: keys of bodies that name files


def of_surface(model: Plate | Shell, scene: Scene, name: str, shape: Surface) -> bodies.Body:
    """The plate or shell over a surface."""
    return plates.plate(
        name,
        shape,
        surfaces.thickness(model.thickness, shape),
        model.material,
        dim=scene.dimension,
        rims=model.rims,
        origin=array(model.origin),
        rotation=matrix(model.rotation),
    )


def array(vector: Vector | None) -> np.ndarray | None:
    return None if vector is None else np.array(vector)


def matrix(rotation: Turn | None) -> np.ndarray | None:
    """Rotation matrix (c, c): about z in the plane, about the axis in space."""
    from scipy.spatial.transform import Rotation

    if rotation is None:
        return None
    if rotation.axis is None:
        c, s = np.cos(rotation.angle), np.sin(rotation.angle)
        return np.array([[c, -s], [s, c]])
    axis = np.array(rotation.axis)
    return np.asarray(Rotation.from_rotvec(rotation.angle * axis / np.linalg.norm(axis)).as_matrix())


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
