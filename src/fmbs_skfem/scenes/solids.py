"""Bodies of a scene that are solids of tetrahedra or hexahedra.

rod: {type: solid, mesh: rod.inp, unit: mm, material: {...}, rims: {big: big_eye, small: small_eye}}
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np

from ..bodies import laws
from ..bodies.body import Body
from ..bodies.from_matrices import Coupling
from ..bodies.laws import Law
from ..bodies.sections import Material
from ..bodies.solids.materials import Orthotropic
from ..bodies.solids.solid_body import solid_body
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.fields import ANY, NAMES, FileUnit, Names, Position, Takes, read_names, whole
from ..core.values.mappings import inline, names
from ..core.values.problems import Problem, unknown
from ..shapes import meshes
from ..shapes.solids import solid, solid_meshes
from ..shapes.solids.solid import Solid
from ..systems.places import At
from . import field_kinds as fields
from . import figures
from .bodies import OWN_LAW, SceneBody, placed
from .field_kinds import MeshFile

if TYPE_CHECKING:
    from .figures import BodyFigures
    from .schema import Scene

FAR = 1.0  #: sizes of a body: a center of a rim is hardly meant farther away
NEAR = 1e-6  #: of the extent: a point nearer than this to a node is that node


@dataclass(frozen=True)
class SolidRim:
    """Nodes of faces, or of sets of nodes, with a frame of their own; joints and loads act at
    `center`, by default the mean of the nodes, in the axes of the mesh.
    """

    faces: Names
    center: Position | None = None


RIM = fields.parts_or(
    "a face, a list of faces or sets of nodes, or {faces: ..., center: [...]}",
    Takes(lambda value, context: SolidRim(read_names(value, context)), NAMES),
    inline(SolidRim),
    dict,
)
SolidRims = Annotated[dict[str, SolidRim], names(Annotated[SolidRim, RIM], words=True)]


@dataclass(frozen=True, kw_only=True)
class SolidBody(SceneBody, word="solid"):
    """An elastic solid of tetrahedra or hexahedra from a mesh file, at any rotation.

    `volume` names a part of the file. With `order: 2`, the default, cells of first order get nodes
    in the middle of their edges: without these they are far too stiff in bending. `refine` (2, 4,
    ..) cuts every edge into that many. The material is isotropic, by default that of the file
    (*SOLID SECTION, in N, s and the unit of the file), or `orthotropic` with its axes 1, 2, 3 turned
    by `axes` from those of the mesh; in its place a `law` of `extensions` has an energy
    of the deformation gradient, W(r,1, r,2, r,3), with its `numbers`.

    Joints and loads act at `rims`, faces or sets of nodes that move as one rigid frame (RBE2), at
    `averages`, whose frame follows the mean motion of their nodes and leaves them their own (RBE3),
    and at `points`: places of nodes, beside sets of one node in the file. A joint of the type
    `face` holds components of nodes, `tie` glues faces to those of another solid; `pressure` and `surface_load` act on faces.

    {type: solid, mesh: rod.inp, unit: mm, material: {young_modulus: 210 GPa, density: 7850}, rims: {big: big_eye}}
    """

    name: str
    mesh: MeshFile
    unit: FileUnit = 1.0
    volume: Annotated[str | None, "a named group of cells; without it the whole mesh"] = None
    order: Literal[1, 2] = 2
    refine: Annotated[int, whole(1, 64)] = 1
    material: Annotated[Material | None, fields.MATERIAL] = None
    orthotropic: Orthotropic | None = None
    axes: fields.Rotation | None = None
    law: Annotated[str | None, OWN_LAW, "a law of `extensions`"] = None
    numbers: Annotated[
        dict[str, Annotated[float, ANY]] | None, "numbers of the law by name, quantities"
    ] = None
    rims: SolidRims = field(default_factory=dict)
    averages: SolidRims = field(default_factory=dict)
    points: Annotated[dict[str, Position], "places of nodes in the axes of the mesh [m]"] = field(
        default_factory=dict
    )
    origin: Position | None = None
    rotation: fields.Rotation | None = None
    made_of: ClassVar[str] = "mesh"
    has_surface: ClassVar[bool] = True
    shows: ClassVar[tuple[str, ...]] = ("von_mises",)

    def finer(self, times: int) -> Self:
        return replace(self, refine=times * self.refine)

    def problems(self, dim: int) -> Iterator[tuple[str | tuple[str, ...], Problem]]:
        if dim == 2:
            yield "type", Problem("dimension 3", "2", "solids are bodies in space")
        if self.material is not None and self.orthotropic is not None:
            yield "material", Problem("a material, or one that is orthotropic", "both")
        if self.axes is not None and self.orthotropic is None:
            yield "axes", Problem("axes of an orthotropic material", "those of another one")
        if self.law is not None and self.law not in laws.KNOWN:
            yield "law", unknown("law", "laws", self.law, laws.KNOWN)
        if self.refine.bit_count() > 1:
            yield "refine", Problem("1, 2, 4, 8 or another power of two", str(self.refine))
        for key in ("averages", "points"):
            if shared := getattr(self, key).keys() & self.rims.keys():
                yield (key, min(shared)), Problem("a name of its own", "that of a rim")

    def misplaced(self, place: At) -> Problem | None:
        if isinstance(place.place, str) and place.place:
            return None
        known = ", ".join([*self.rims, *self.averages, *self.points]) or "none yet"
        remedy = f"write {self.name}.name with one of its rims, averages and points ({known})"
        return Problem(f"a place of '{self.name}'", f"'{self.name}'", remedy)

    def figures(self, part: Body, gravity: float) -> BodyFigures:
        shape = part.space
        assert isinstance(shape, Solid)
        material = self.material_of(f"body '{self.name}'", shape)
        return figures.of_solid(part, material, gravity)

    def material_of(self, where: str, shape: Solid) -> Material | Orthotropic:
        """The material that is given, else that of the file."""
        return self.material or self.orthotropic or of_file(where, shape, self.unit)

    def shape(self, scene: Scene, allow_outside: bool) -> Solid:
        """The mesh of its file."""
        path = meshes.path(self.mesh, scene.folder, allow_outside)
        found = solid_meshes.read(path, self.volume, self.order, scene.repair, self.unit)
        for _ in range(self.refine.bit_length() - 1):
            found = solid_meshes.halve(found)
        return found

    def build(self, scene: Scene, cells: int | None, allow_outside: bool) -> Body:
        where = f"body '{self.name}'"
        shape = self.shape(scene, allow_outside)
        size = float(np.linalg.norm(np.ptp(shape.reference, axis=0)))

        def coupling(key: str, rim: SolidRim, rigid: bool) -> Coupling:
            center = None if rim.center is None else tuple(rim.center)
            name = f"{where}: rim '{key}'"
            nodes, weights = solid.coupled(name, shape, rim.faces)
            if center is not None:
                tell_far(name, np.array(center), shape.reference[nodes], size)
            return Coupling(tuple(nodes.tolist()), rigid, center, tuple(weights.tolist()))  # type: ignore[arg-type]

        return solid_body(
            self.name,
            shape,
            self.material_of(where, shape),
            axes=self.axes.matrix if self.axes else None,
            law=Law.SOLID if self.law is None else laws.find(self.law),
            numbers=self.numbers,
            rims={
                **{key: coupling(key, rim, True) for key, rim in self.rims.items()},
                **{key: coupling(key, rim, False) for key, rim in self.averages.items()},
            },
            places={
                key: nearest(f"{where}: point '{key}'", shape, np.array(place))
                for key, place in self.points.items()
            },
            **placed(self),
        )


def of_file(where: str, shape: Solid, unit: float) -> Material:
    """The only material of a mesh, in N, s and the unit of its file [m]; InputError where there are
    none or several, and where cells have none.
    """
    known = shape.materials
    different = {tuple(numbers) for numbers in known.values()}
    cells = [shape.volumes[group] for group in known]
    count = len(np.unique(np.concatenate(cells))) if cells else 0
    remedy = "give `material`"
    if not known:
        got = "none"
    elif len(different) > 1:
        got = f"{len(different)}, of {', '.join(known)}"
        remedy = f"{remedy}, or make a body of each `volume`, and `tie` these"
    elif count < len(shape.nodes):
        got = f"one of {count} cells of {len(shape.nodes)}"
        remedy = f"{remedy}, or name these by `volume`"
    else:
        ((E, nu, rho),) = different
        if rho:
            return Material(E / unit**2, rho / unit**4, nu)
        got = f"one of E = {E:g} and no density"
    raise InputError(say(f"{where}.material", "a material", got, remedy))


def tell_far(where: str, center: np.ndarray, places: np.ndarray, size: float) -> None:
    """A notice of a center (3,) far away from the nodes (i, 3) of its rim, by the size of the body [m]."""
    away = float(np.linalg.norm(places - center, axis=1).min())
    if away > FAR * size:
        text = f"its center lies {away:.3g} m away from its nodes, {away / size:.3g} times the size of the body"
        notify(f"{where}: {text}: is it in the unit that is meant?")


def nearest(where: str, shape: Solid, place: np.ndarray) -> int:
    """The node at a place (3,) [m]; InputError where there is none, with the nearest one."""
    away = np.linalg.norm(shape.reference - place, axis=1)
    node = int(np.argmin(away))
    if away[node] > max(
        NEAR * float(np.ptp(shape.reference, axis=0).max()), 2.0 * shape.resolution
    ):
        got = meshes.position(place)
        remedy = f"the nearest one is at {meshes.position(shape.reference[node])}"
        raise InputError(say(where, "the place of a node in the axes of the mesh [m]", got, remedy))
    return node
