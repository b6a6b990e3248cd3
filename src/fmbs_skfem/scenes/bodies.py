"""Bodies of a scene: each a declaration that says what its keys are and how they become a body.

    beam: {type: cable, mesh: beam.msh, ...}      class Cable(SceneBody), made by its `build`

An own one is a class of the family `SceneBody` in a file that the scene names.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Protocol, Self

import numpy as np

from ..bodies import body as bodies
from ..bodies import laws, rigid
from ..bodies import plate as plates
from ..bodies.beams import beam as beams
from ..bodies.beams.orientation import Orientation
from ..bodies.body import BENDS_ALIKE, BENDS_ALIKE_REMEDY, Body
from ..bodies.sections import BEAMS_NEED, Material, Section
from ..core import own_words
from ..core.declared import Declared
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.fields import (
    ANY,
    Context,
    Count,
    Density,
    FileUnit,
    Length,
    Position,
    Takes,
    Tolerance,
    Vector,
    quantity,
    read_text,
    whole,
    word,
)
from ..core.values.problems import Problem, shown, unknown
from ..shapes import curves, meshes, nurbs_file, plate_meshes, structured
from ..shapes.surface import Surface
from ..systems.places import At
from . import field_kinds as fields
from . import figures, surfaces
from .drawn.lines import LINE, DrawnLine
from .drawn.plates import Disc, Rectangle, check_hole
from .field_kinds import MeshFile

if TYPE_CHECKING:
    from .figures import BodyFigures
    from .schema import Scene


CURVATURES = {law.name.lower(): law for law in laws.CABLES}
Mass = Annotated[float, quantity("kg", "> 0")]
LeadingModes = Annotated[
    int | None,
    whole(1, 1000),
    "number of shape functions, rigid motions included, in place of a tolerance",
]
#: numbers that a part takes, see `bodies.values`
SCALES = (
    "young_modulus",
    "density",
    "diameter",
    "width",
    "height",
    "thickness",
)


def read_law(value: object, context: Context) -> str:
    """The name of a law; one of the scene's own files goes before that of the package."""
    return own_words.meant(read_text(value, context), laws.KNOWN, context.modules)


OWN_LAW = Takes(read_law, {"type": "string"})
STRESSES = ("von_mises", "von_mises_recovered")
CABLE_FIELDS = ("axial_force", "bending_moment")  #: that colour bodies


class SceneBody(Declared, ABC):
    """A body of a scene: a frozen dataclass with a name, see `core.declared`."""

    name: str
    made_of: ClassVar[str] = ""  #: the key that names its file
    #: whether it may be a plate or shell, with edges, faces and stresses
    has_surface: ClassVar[bool] = False
    divisible: ClassVar[bool] = False  #: whether it can be made of other numbers of cells
    #: fields that colour it in pictures, beside those of all bodies
    shows: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        """The body; `cells` replaces the cells of one that is divisible, `allow_outside` permits
        files outside the project.
        """

    @property
    def open(self) -> bool:
        """Whether an accuracy may choose its cells."""
        return False

    def fewest(self, scene: Scene, allow_outside: bool) -> int:
        """The fewest cells that it can be made of, of one that is `open`."""
        return 1

    def with_cells(self, cells: int) -> Self:
        """The body with that many cells, of one that is `open`."""
        return self

    def finer(self, times: int) -> Self | None:
        """The body with so many times its cells a direction, itself where it has none; None where
        nobody knows how.
        """
        return self

    def files(self) -> dict[str, str]:
        """Keys of the files that it is made of, and what stands there."""
        path = getattr(self, self.made_of) if self.made_of else None
        return {} if path is None else {self.made_of: path}

    def figures(self, part: Body, gravity: float) -> BodyFigures:
        """What it is in numbers, under gravity [m/s2]."""
        return figures.of_any(part)

    def misplaced(self, place: At) -> Problem | None:
        """What is wrong with a place on it, as far as that is known without its mesh."""
        return None

    def idle(self) -> Iterator[tuple[str, str]]:
        """Names of fields that do nothing, and why."""
        return iter(())


@dataclass(frozen=True, kw_only=True)
class OfLine(SceneBody, ABC):
    """A body along a line of a mesh file, or one that its scene draws; `refine` splits every mesh
    cell into that many.
    """

    name: str
    mesh: MeshFile | None = None
    unit: FileUnit = 1.0
    line: Annotated[str | DrawnLine | None, LINE] = None
    section: Section
    material: Annotated[Material | None, fields.MATERIAL] = None
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    refine: Annotated[int, whole(1, 1000)] = 1
    cells: Annotated[
        Count | None, "of equal length in place of those of the mesh, or more of them by `refine`"
    ] = None
    made_of: ClassVar[str] = "mesh"
    divisible: ClassVar[bool] = True
    without_material: ClassVar[str] = ""  #: what needs none

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        drawn = isinstance(self.line, DrawnLine)
        if drawn == (self.mesh is not None):
            got = "both" if drawn else "none"
            yield "mesh", Problem("a mesh file, or a line that is drawn", got)
        if isinstance(self.line, DrawnLine):
            for key, problem in self.line.problems(dim):
                yield ("line", key) if key != "line" else "line", problem
        if self.cells is not None and self.refine > 1:
            yield (
                "refine",
                Problem("no refine beside cells", str(self.refine), "delete one of the two"),
            )
        if self.section.needs_material and self.material is None:
            yield (
                "material",
                Problem("a material for a solid section", "nothing", self.without_material),
            )

    def idle(self) -> Iterator[tuple[str, str]]:
        if not self.section.needs_material and self.material is not None:
            yield (
                "material",
                "does nothing beside a given section, whose stiffness and mass are complete",
            )

    def misplaced(self, place: At) -> Problem | None:
        if place.place != "":
            return None
        remedy = f"write {self.name}.group with a point group of its mesh, or {{body: {self.name}, s: 0.3 m}}"
        return Problem(f"a point of the body '{self.name}'", f"'{self.name}'", remedy)

    @property
    def open(self) -> bool:
        return self.cells is None and self.refine == 1

    def fewest(self, scene: Scene, allow_outside: bool) -> int:
        return self.followed(scene, allow_outside).fewest

    def with_cells(self, cells: int) -> Self:
        return replace(self, cells=cells)

    def finer(self, times: int) -> Self:
        return (
            replace(self, refine=times * self.refine)
            if self.cells is None
            else replace(self, cells=times * self.cells)
        )

    def followed(self, scene: Scene, allow_outside: bool) -> curves.Line:
        """Its line, whatever its cells will be."""
        if isinstance(self.line, DrawnLine):
            return self.line.line(f"body '{self.name}'")
        assert self.mesh is not None
        path = meshes.path(self.mesh, scene.folder, allow_outside)
        return curves.read(path, self.line, scene.repair, self.unit)


@dataclass(frozen=True, kw_only=True)
class Cable(OfLine):
    """A thin cable or beam without torsion and shear along a line of a mesh file; `refine` splits
    every mesh cell into that many.

    {type: cable, mesh: beam.msh, section: {shape: circular, diameter: 10 mm}, material: {young_modulus: 1 GPa, density: 1800}}
    """

    shows: ClassVar[tuple[str, ...]] = (*CABLE_FIELDS, "von_mises")
    interpolation: Literal["bspline", "ancf"] = "bspline"
    degree: Annotated[int, whole(2, 9), "of bspline; ancf has 3"] = 3
    continuity: Annotated[int, whole(1, 8), "derivatives that are continuous from cell to cell"] = 1
    curvature: Annotated[
        Literal["exact", "material", "quadratic"],
        "geometric curvature, rotation per reference length, or the norm of the second derivative",
    ] = "exact"
    law: Annotated[str | None, OWN_LAW, "a law of `extensions`; without it that of `curvature`"] = (
        None
    )
    numbers: Annotated[
        dict[str, Annotated[float, ANY]] | None, "numbers of the law by name, quantities"
    ] = None
    without_material: ClassVar[str] = "or give EA, EI and rhoA (shape: given)"

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        yield from super().problems(dim)
        if not self.section.serves_cables:
            yield (
                "section",
                Problem(
                    "EA, EI and rhoA (shape: given)",
                    f"one that is {self.section.word}",
                    "or take type: beam",
                ),
            )
        elif dim == 3 and not self.section.bends_alike:
            yield (
                "section",
                Problem(BENDS_ALIKE, f"one that is {self.section.word}", BENDS_ALIKE_REMEDY),
            )
        if self.continuity >= self.degree:
            yield (
                "continuity",
                Problem(f"a continuity below the degree {self.degree}", str(self.continuity)),
            )
        if self.law is not None and self.law not in laws.KNOWN:
            yield "law", unknown("law", "laws", self.law, laws.KNOWN)
        if self.law is not None and self.curvature != "exact":
            yield (
                "curvature",
                Problem(
                    "no curvature beside a law", f"'{self.curvature}'", "delete one of the two"
                ),
            )
        if self.interpolation == "ancf" and (self.degree, self.continuity) != (3, 1):
            got = f"degree {self.degree}, continuity {self.continuity}"
            yield (
                "interpolation",
                Problem(
                    "degree 3 and continuity 1 with ancf", got, "leave them out, or use bspline"
                ),
            )

    def figures(self, part: Body, gravity: float) -> BodyFigures:
        return figures.of_line(part, self.section.of_cable(self.material), self.degree, gravity)

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        cells = self.cells if cells is None else cells
        group = None
        along: curves.Line | meshes.LineMesh
        if cells is not None or self.refine > 1 or self.mesh is None:
            along = curves.cut(self.followed(scene, allow_outside), cells, self.refine)
        else:
            assert not isinstance(self.line, DrawnLine)
            group = self.line
            path = meshes.path(self.mesh, scene.folder, allow_outside)
            along = meshes.read(path, scene.repair, self.unit)
        return bodies.cable(
            self.name,
            along,
            self.section,
            self.material,
            dim=scene.dimension,
            group=group,
            degree=self.degree,
            continuity=self.continuity,
            ancf=self.interpolation == "ancf",
            law=CURVATURES[self.curvature] if self.law is None else laws.find(self.law),
            numbers=self.numbers,
            **placed(self),
        )


@dataclass(frozen=True, kw_only=True)
class Beam(OfLine):
    """A beam with torsion and shear along a line of a mesh file; in the plane with shear alone.

    In the plane z of the section is to the left of the line. In space `direction` is the y axis of
    its section, made normal to the line, one or several at fractions of the length;
    by default the axis of the mesh that the line begins most across, of a helix its own. In its place
    the axis may point `towards` a point. Both are given where the mesh is: `origin` and `rotation`
    move them with it, so that a beam that is turned has its section turned as well, as a part has.
    `twist` turns the section about the line, right-handed from its start on, evenly to that angle
    at its end or as it is given at fractions. With `warping` open sections warp with the torsion, held
    by clamps, and tension stiffens that. `offset` says where the line passes through the
    section: its centroid by default, the shear centre, or a point [y, z] of its drawing; of
    matrices a point in their axes, by default [0, 0].

    {type: beam, mesh: arm.msh, section: {shape: circular, diameter: 10 mm}, material: {young_modulus: 210 GPa, density: 7850}}
    """

    shows: ClassVar[tuple[str, ...]] = (
        *CABLE_FIELDS,
        "shear_force",
        "torque",
        "torsion",
        "normal_stress",
        "von_mises",
    )
    direction: Annotated[Vector | dict[float, Vector] | None, fields.DIRECTION] = None
    towards: Position | None = None
    twist: Annotated[float | dict[float, float], fields.TWIST] = 0.0
    offset: Annotated[
        Literal["centroid", "shear_centre"] | tuple[float, float] | None, fields.OFFSET
    ] = None
    warping: Annotated[
        bool, "torsion with bimoments (Vlasov), and stiffer under tension (the trapeze effect)"
    ] = False
    without_material: ClassVar[str] = "or give matrices of stiffness and mass (shape: matrices)"

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        yield from super().problems(dim)
        for key in ("direction", "towards", "twist", "warping") if dim == 2 else ():
            if getattr(self, key):
                got = "one in the plane, where z of the section is to the left of the line"
                if key == "warping":
                    got = "warping in the plane, where nothing twists"
                yield key, Problem("none", got, "delete it, or write dimension: 3")
        if self.cells is not None and self.cells < beams.FEWEST:
            yield "cells", Problem(f"at least {beams.FEWEST}", str(self.cells))
        if self.direction is not None and self.towards is not None:
            yield "towards", Problem("a direction or a point", "both", "delete one of the two")
        if not self.section.serves_beams:
            yield (
                "section",
                Problem(BEAMS_NEED, f"one that is {self.section.word}", "or take type: cable"),
            )

    def figures(self, part: Body, gravity: float) -> BodyFigures:
        return figures.of_beam(part)

    def fewest(self, scene: Scene, allow_outside: bool) -> int:
        turns = Orientation(self.direction, self.towards, self.twist).turns
        return max(
            super().fewest(scene, allow_outside), beams.FEWEST, math.ceil(turns / curves.BEND)
        )

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        cells = self.cells if cells is None else cells
        line = curves.cut(self.followed(scene, allow_outside), cells, self.refine)
        direction = self.direction
        if (
            scene.dimension == 3
            and direction is None
            and self.towards is None
            and isinstance(self.line, DrawnLine)
        ):
            direction = self.line.axis  # any other one a helix would run along somewhere
        axes: dict[str, Any] = {
            "direction": direction,
            "towards": self.towards,
            "twist": self.twist,
            "offset": self.offset,
            "dim": scene.dimension,
            "warping": self.warping,
        }
        return beams.beam(self.name, line, self.section, self.material, **axes, **placed(self))


@dataclass(frozen=True, kw_only=True)
class PointMass(SceneBody):
    """A mass point.

    {type: point_mass, mass: 1 kg, position: [1 m, 0, 0]}
    """

    name: str
    mass: Mass
    position: Position

    def misplaced(self, place: At) -> Problem | None:
        if place.place in ("", "center"):
            return None
        return Problem(
            f"the point mass '{self.name}' as a whole", shown(place.place), f"write {self.name}"
        )

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        return bodies.point_mass(self.name, self.mass, np.array(self.position))


class RigidBody(SceneBody, ABC):
    """A body that is a frame with points."""

    def misplaced(self, place: At) -> Problem | None:
        if isinstance(place.place, str):
            return None
        remedy = f"write {self.name}.frame or {self.name}.point"
        return Problem(
            f"the rigid body '{self.name}' or one of its points", shown(place.place), remedy
        )


@dataclass(frozen=True, kw_only=True)
class Rigid(RigidBody):
    """A rigid body of given mass and inertia about its centre of mass; its frame is `frame`, its
    centre `center`.

    Points are given in the frame of the scene; `rotation` turns the axes in which the inertia is
    given.

    {type: rigid, mass: 8 kg, inertia: [0.4 kg m^2, 0.2 kg m^2, 0.2 kg m^2], center: [1 m, 0, 0]}
    """

    name: str
    mass: Mass
    inertia: fields.Inertia
    center: Position
    points: dict[str, Position] = field(default_factory=dict)
    rotation: fields.Rotation | None = None

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        for point in {"center", "frame"} & self.points.keys():
            expected = "another name than 'center' and 'frame', which every rigid body has"
            yield ("points", point), Problem(expected, shown(point))

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        inertia = np.array(self.inertia)
        turned = self.rotation.matrix if self.rotation else None
        return rigid.rigid(
            self.name,
            self.mass,
            inertia,
            self.center,
            dim=scene.dimension,
            rotation=turned,
            places=self.points,
        )


@dataclass(frozen=True, kw_only=True)
class RigidPlate(RigidBody):
    """The rigid body that a plate of a mesh file makes; single points of the mesh are its places,
    beside `frame` and `center`.

    {type: rigid_plate, mesh: crank.msh, thickness: 10 mm, density: 2700 kg/m^3}
    """

    name: str
    mesh: MeshFile
    unit: FileUnit = 1.0
    thickness: Length
    density: Density
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    made_of: ClassVar[str] = "mesh"

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        path = meshes.path(self.mesh, scene.folder, allow_outside)
        mesh = plate_meshes.read(
            path, scene.dimension == 2, None, scene.repair, self.unit, corners=3
        )
        return rigid.rigid_from_mesh(
            self.name, mesh, self.thickness, self.density, dim=scene.dimension, **placed(self)
        )


def planar_slopes(rims: fields.Rims, dim: int) -> Iterator[tuple[tuple[str, ...], Problem]]:
    """Rims that clamp what does not bend."""
    for name, rim in rims.items():
        if rim.slopes and dim == 2:
            yield (
                ("rims", name, "slopes"),
                Problem(
                    "slopes in space only", "true in the plane, where nothing bends", "delete it"
                ),
            )


class ThinBody(SceneBody, ABC):
    """A thin body over a surface."""

    thickness: fields.Thickness
    material: Annotated[Material, fields.MATERIAL]
    rims: fields.Rims
    origin: Position | None
    rotation: fields.Rotation | None
    has_surface: ClassVar[bool] = True
    shows: ClassVar[tuple[str, ...]] = STRESSES
    flat: ClassVar[bool] = False

    @abstractmethod
    def surface(
        self, folder: Path, allow_outside: bool = False, repair: bool = False, dim: int = 3
    ) -> Surface:
        """The surface of its file, whose path is relative to `folder`, in `dim` dimensions;
        `repair` merges nodes at one place.
        """

    def misplaced(self, place: At) -> Problem | None:
        measured = not isinstance(place.place, str)
        if place.place and not measured:
            return None
        got = shown(place.place) if measured else f"'{self.name}'"
        remedy = f"write {self.name}.name with one of its rims ({', '.join(self.rims) or 'none yet'}) or named points"
        return Problem(f"a rim or named point of '{self.name}'", got, remedy)

    def figures(self, part: Body, gravity: float) -> BodyFigures:
        return figures.of_plate(part, self.material, gravity, self.flat)

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        dim = scene.dimension
        shape = self.surface(scene.folder, allow_outside, scene.repair, dim)
        thickness = surfaces.thickness(self.thickness, shape)
        return plates.plate(
            self.name, shape, thickness, self.material, dim=dim, rims=self.rims, **placed(self)
        )


@dataclass(frozen=True, kw_only=True)
class Plate(ThinBody):
    """A thin plate over a mesh file, or one that its scene draws, a `rectangle` or a `disc`; in the
    plane a membrane.

    Without an `interpolation` it is `bfs` on a rectangle that is drawn without a hole in space,
    `ancf` in the plane and on even grids of quads, where that converges (four cells at every inner
    node, lines that turn alike from node to node), else `fvs`, which converges on any quads or
    triangles. `arcs` are edges that are circular arcs, for these
    two; `rims` makes rigid frames of named edges, with centres in the frame of the scene; in space
    the plate is clamped to those with `slopes: true`, and hinged to others. `order` is the number
    of Gauss points a direction, `refine` (2, 4, 8, ..) cuts every side of the cells into that many,
    new nodes on arcs lie on them.

    {type: plate, mesh: lug.msh, thickness: 5 mm, material: {young_modulus: 70 GPa, density: 2700}, rims: {hole: hole}}
    """

    name: str
    mesh: MeshFile | None = None
    rectangle: Rectangle | None = None
    disc: Disc | None = None
    unit: FileUnit = 1.0
    face: Annotated[str | None, "a named group of cells; without it the whole mesh"] = None
    interpolation: Annotated[str | None, word(surfaces.INTERPOLATIONS)] = None
    arcs: Annotated[list[str] | None, "a list of edges; without it arcs are found"] = None
    thickness: fields.Thickness
    material: Annotated[Material, fields.MATERIAL]
    rims: fields.Rims = field(default_factory=dict)
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[int, whole(1, 10)] | None = None
    refine: Annotated[int, whole(1, 1024)] = 1
    made_of: ClassVar[str] = "mesh"
    flat: ClassVar[bool] = True

    def finer(self, times: int) -> Self:
        return replace(self, refine=times * self.refine)

    def idle(self) -> Iterator[tuple[str, str]]:
        for key, default in (("unit", 1.0), ("face", None)):
            if self.mesh is None and getattr(self, key) != default:
                yield key, "does nothing beside a plate that is drawn"

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        yield from planar_slopes(self.rims, dim)
        given = {key: one for key in ("mesh", "rectangle", "disc") if (one := getattr(self, key))}
        if len(given) != 1:
            got = ", ".join(given) or "none of them"
            yield "mesh", Problem("a mesh file, a rectangle or a disc", got)
        for key, one in given.items():
            if isinstance(one, Rectangle | Disc):
                yield from (((key, field), problem) for field, problem in check_hole(one))
        if self.refine.bit_count() > 1:
            yield "refine", Problem("1, 2, 4, 8 or another power of two", str(self.refine))
        if (
            self.arcs is not None
            and self.interpolation
            and not surfaces.INTERPOLATIONS[self.interpolation].arcs
        ):
            got = f"arcs with {self.interpolation}, whose sides are straight"
            yield "arcs", Problem("arcs with ancf or fvs only", got, "delete them")

    def surface(
        self, folder: Path, allow_outside: bool = False, repair: bool = False, dim: int = 3
    ) -> Surface:
        corners = (
            surfaces.INTERPOLATIONS[self.interpolation].corners
            if self.interpolation
            else ((4,) if dim == 2 else (3, 4))
        )
        drawn = self.rectangle or self.disc
        if drawn is None:
            path = meshes.path(self.mesh or "", folder, allow_outside)
            mesh = plate_meshes.read(path, True, self.face, repair, self.unit, corners[0])
        else:
            mesh = drawn.mesh()
        height = float(np.abs(mesh.points[:, 2]).max())
        if height > surfaces.FLAT * float(np.ptp(mesh.points, axis=0).max()):
            raise InputError(
                say(
                    f"mesh {mesh.path}",
                    "a plate in the plane z = 0",
                    f"z = {height:.6g} m",
                    "place it with 'origin'",
                )
            )
        chosen = self.interpolation or (drawn and drawn.interpolation(dim))
        chosen = chosen or surfaces.choose(mesh, dim)
        if mesh.cells.shape[1] not in surfaces.INTERPOLATIONS[chosen].corners:
            wanted, got = (
                ("quads", "triangles") if mesh.cells.shape[1] == 3 else ("triangles", "quads")
            )
            other = "argyris" if mesh.cells.shape[1] == 3 else "ancf or bfs"
            remedy = f"take the interpolation fvs or {other}, or mesh it again"
            where = f"mesh {mesh.path or 'that is drawn'}"
            raise InputError(say(where, f"{wanted} for {chosen}", got, remedy))
        mesh = surfaces.refined(
            mesh, self.refine, self.arcs if surfaces.INTERPOLATIONS[chosen].arcs else []
        )
        found = replace(
            surfaces.INTERPOLATIONS[chosen].make(mesh, self.arcs), resolution=mesh.resolution
        )
        return surfaces.set_order(found, self.order)


@dataclass(frozen=True, kw_only=True)
class Shell(ThinBody):
    """A thin plate or shell over the NURBS patches of a file (.json, .igs, .iges, .3dm), or through
    the nodes of a mesh file.

    Every span of the file is split into `cells` and raised to `degree`. Edges, points and faces
    have the names of the file and of its patches. Sides of patches that lie on one another, or
    parts of them, are joined, also those of one patch, which closes it; `join: false` leaves all of
    them apart, for a surface with a slit. A joined side is no edge any more: supports and loads
    there are refused, unless `join: true` says that the line inside the surface is meant.

    IGES and 3dm files name their unit, which `unit` may repeat; surfaces that they trim are
    refused.

    A `mesh`, or the part of it that `face` names, is curved in space or flat; its groups are
    points, edges and faces. Structured quads make a bicubic spline through all nodes, one cell a
    quad; on other quads, which are cut, on triangles and on both the shell is `fvs`, conforming
    triangles with normals fitted to the nodes, whose sides are cut into `cells` (2, 4, 8, ..).

    {type: shell, nurbs: roof.json, cells: 16, thickness: 0.25 m, material: {young_modulus: 432 MPa, density: 360}}
    """

    name: str
    nurbs: Annotated[
        str | None, "a file of NURBS patches, its path from the folder of the scene"
    ] = None
    mesh: Annotated[str | None, "a mesh file of quads or triangles, in place of `nurbs`"] = None
    face: Annotated[str | None, "a named group of cells of the mesh; without it the whole mesh"] = (
        None
    )
    cells: Count = 1
    degree: Annotated[int, whole(1, 10)] | None = None
    unit: FileUnit | None = None
    join: Annotated[
        bool | None, "true or false; without it the file says, else sides that meet are joined"
    ] = None
    thickness: fields.Thickness
    material: Annotated[Material, fields.MATERIAL]
    rims: fields.Rims = field(default_factory=dict)
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    order: Annotated[int, whole(1, 12)] | None = None

    def files(self) -> dict[str, str]:
        return {
            key: name
            for key, name in (("nurbs", self.nurbs), ("mesh", self.mesh))
            if name is not None
        }

    def finer(self, times: int) -> Self:
        return replace(self, cells=times * self.cells)

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        yield from planar_slopes(self.rims, dim)
        if (self.nurbs is None) == (self.mesh is None):
            got, remedy = (
                ("neither", "add one of the two")
                if self.mesh is None
                else ("both", "delete one of the two")
            )
            yield "nurbs", Problem("a file of NURBS patches or a mesh", got, remedy)
        if self.mesh is not None and self.degree is not None and self.degree < structured.DEGREE:
            yield (
                "degree",
                Problem(
                    "degree 3 or more of the spline through a mesh", str(self.degree), "delete it"
                ),
            )

    def idle(self) -> Iterator[tuple[str, str]]:
        if self.mesh is not None and self.join is not None:
            yield "join", "does nothing beside a mesh, which is closed where its nodes are"
        if self.nurbs is not None and self.face is not None:
            yield "face", "does nothing beside NURBS patches"

    def surface(
        self, folder: Path, allow_outside: bool = False, repair: bool = False, dim: int = 3
    ) -> Surface:
        if self.mesh is None:
            path = meshes.path(self.nurbs or "", folder, allow_outside)
            found = nurbs_file.read(
                path, cells=self.cells, degree=self.degree, scale=self.unit, join=self.join
            )
            return surfaces.set_order(found, self.order)
        mesh = plate_meshes.read(
            meshes.path(self.mesh, folder, allow_outside),
            False,
            self.face,
            repair,
            self.unit or 1.0,
            3,
        )
        found, error = surfaces.curved(mesh, self.cells, self.degree)
        surfaces.tell_rough(f"mesh {mesh.path}", error, self.thickness, mesh.resolution)
        return surfaces.set_order(found, self.order)


@dataclass(frozen=True, kw_only=True)
class PlacedPart(SceneBody, word="part"):
    """A reduced body from a file that `fmbs part train` wrote, with the places of the body that it
    was made of.

    It stands where it was trained, x -> origin + rotation x elsewhere, as often as wanted. With a
    `tolerance` or a number of `modes` it has the leading ones of its shape functions alone, and
    fewer points: it is faster, and errs more. Numbers of material and section are those of its
    training where they are not given; `fmbs part info` lists those that can be. With `check: false`
    nothing is found once more with the shapes that it lacks: runs take a third to a half of the
    time, and do not know how far the part is off.

    {type: part, file: arm.part.h5, origin: [1 m, 0, 0]}
    """

    name: str
    file: Annotated[str, "a file of a part (.part.h5), its path from the folder of the scene"]
    tolerance: Annotated[
        Tolerance | None,
        "eps of the shape functions, see `fmbs part train`; without it all of them",
    ] = None
    modes: LeadingModes = None
    hyper: Annotated[Tolerance | None, "eta of the points; without it by the shape functions"] = (
        None
    )
    young_modulus: Annotated[float | None, quantity("Pa", "> 0")] = None
    density: Annotated[float | None, quantity("kg/m^3", "> 0")] = None
    diameter: Annotated[float | None, quantity("m", "> 0")] = None
    width: Annotated[float | None, quantity("m", "> 0")] = None
    height: Annotated[float | None, quantity("m", "> 0")] = None
    thickness: Annotated[float | None, quantity("m", "> 0")] = None
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    check: bool = True
    made_of: ClassVar[str] = "file"
    has_surface: ClassVar[bool] = True
    shows: ClassVar[tuple[str, ...]] = (*STRESSES, *CABLE_FIELDS)

    def finer(self, times: int) -> None:
        return None

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        if self.tolerance is not None and self.modes is not None:
            yield (
                "modes",
                Problem("a tolerance or a number of modes", "both", "delete one of the two"),
            )

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        from ..parts import bodies as parts
        from ..parts import files as part_files
        from ..parts import rescaling

        path = meshes.path(self.file, scene.folder, allow_outside, "part")
        found = part_files.used(path, self.tolerance, self.modes, self.hyper).body
        if found.dim != scene.dimension:
            remedy = f"train it in a scene of dimension {scene.dimension}"
            raise InputError(
                say(f"{path}", f"a part of dimension {scene.dimension}", found.dim, remedy)
            )
        given = {name: getattr(self, name) for name in SCALES if getattr(self, name) is not None}
        return rescaling.rescale(
            parts.placed(found, self.name, check=self.check, **placed(self)), given
        )


class Placed(Protocol):
    """What a scene moves from where its file has it."""

    @property
    def origin(self) -> Position | None: ...

    @property
    def rotation(self) -> fields.Rotation | None: ...


def placed(model: Placed) -> dict[str, Any]:
    """Where a body stands: its origin (c,) [m] and rotation (c, c)."""
    origin, rotation = model.origin, model.rotation
    return {
        "origin": None if origin is None else np.array(origin),
        "rotation": rotation.matrix if rotation else None,
    }
