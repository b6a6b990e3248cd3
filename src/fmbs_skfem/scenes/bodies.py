"""Models of sections, materials and bodies in a scene, in SI units once read."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, StrictBool, StrictInt, StrictStr

from . import fields, plate_fields
from .models import Count, MeshFile, Model


class Circular(Model):
    """Solid circular section."""

    shape: Literal["circular"]
    diameter: fields.Length


class Rectangular(Model):
    """Solid rectangular section, `height` in the plane of bending."""

    shape: Literal["rectangular"]
    width: fields.Length
    height: fields.Length


class Given(Model):
    """Stiffnesses and mass per length given directly."""

    shape: Literal["given"]
    EA: fields.AxialStiffness
    EI: fields.BendingStiffness
    rhoA: fields.LineDensity


class Material(Model):
    """Linear elastic material."""

    young_modulus: fields.Pressure
    density: fields.Density
    poisson_ratio: Annotated[fields.Number, Field(gt=-1.0, lt=0.5, description="a number > -1 and < 0.5")] = 0.3


class Cable(Model):
    """A thin cable or beam along a line of a mesh file; `refine` splits every mesh cell into that many."""

    type: Literal["cable"]
    mesh: MeshFile
    line: Annotated[StrictStr | None, Field(description="a named line of the mesh; without it the whole mesh")] = None
    interpolation: Literal["bspline", "ancf"] = "bspline"
    degree: Annotated[StrictInt, Field(ge=2, le=9, description="of bspline; ancf has 3")] = 3
    continuity: Annotated[StrictInt, Field(ge=1, le=8, description="derivatives that are continuous from cell to cell")] = 1
    section: Annotated[Circular | Rectangular | Given, Field(discriminator="shape")]
    material: Material | None = None
    curvature: Annotated[
        Literal["exact", "material", "quadratic"],
        Field(description="geometric curvature, rotation per reference length, or the norm of the second derivative"),
    ] = "exact"
    origin: fields.Position | None = None
    rotation: fields.Rotation | None = None
    refine: Annotated[StrictInt, Field(ge=1, le=1000)] = 1


class PointMass(Model):
    """A mass point."""

    type: Literal["point_mass"]
    mass: fields.Mass
    position: fields.Position


class Rigid(Model):
    """A rigid body of given mass and inertia about its centre of mass; its frame is `frame`, its centre `center`.

    Points are given in the frame of the scene; `rotation` turns the axes in which the inertia is given.
    """

    type: Literal["rigid"]
    mass: fields.Mass
    inertia: plate_fields.Inertia
    center: fields.Position
    points: dict[str, fields.Position] = Field(default_factory=dict)
    rotation: fields.Rotation | None = None


class RigidPlate(Model):
    """The rigid body that a plate of a mesh file makes; single points of the mesh are its places, beside `frame` and `center`."""

    type: Literal["rigid_plate"]
    mesh: MeshFile
    thickness: fields.Length
    density: fields.Density
    origin: fields.Position | None = None
    rotation: fields.Rotation | None = None


class Plate(Model):
    """A thin plate over a mesh file, in the plane a membrane.

    `arcs` are edges that are circular arcs, for ancf; `rims` makes rigid frames of named edges, with centres in the frame of the
    scene; `order` is the number of Gauss points a direction.
    """

    type: Literal["plate"]
    mesh: MeshFile
    face: Annotated[StrictStr | None, Field(description="a named group of cells; without it the whole mesh")] = None
    interpolation: Literal["ancf", "bfs", "argyris"] = "ancf"
    arcs: Annotated[list[StrictStr] | None, Field(description="a list of edges; without it arcs are found")] = None
    thickness: plate_fields.Thickness
    material: Material
    rims: dict[str, plate_fields.Rim] = Field(default_factory=dict)
    origin: fields.Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[StrictInt, Field(ge=1, le=10)] | None = None


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
    unit: fields.Length = 1.0
    join: Annotated[
        StrictBool | None, Field(description="true or false; without it the file says, else sides that meet are joined")
    ] = None
    thickness: plate_fields.Thickness
    material: Material
    rims: dict[str, plate_fields.Rim] = Field(default_factory=dict)
    origin: fields.Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[StrictInt, Field(ge=1, le=12)] | None = None


Body: TypeAlias = Annotated[Cable | PointMass | Rigid | RigidPlate | Plate | Shell, Field(discriminator="type")]
