r"""Bodies: a line of an interpolation space with its law, or a mass point.

A body has b basis functions and coordinates q (b, c). Derivatives are taken with respect to the
reference arc length S,

    d/dS = (1/J) d/dxi,   d2/dS2 = (1/J^2) d2/dxi2 - (J'/J^3) d/dxi,   J = |dr0/dxi|,

so that |r0'| = 1. The mass matrix m_ij = int rhoA N_i N_j dS is constant and the same for every
component.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import field
from functools import cache, partial
from pathlib import Path
from threading import Lock
from typing import Annotated, Any, TypeAlias

import numpy as np
from scipy.sparse import coo_array, csr_array, vstack

from ..core.algebra.linalg import as_csr, selection
from ..core.declared import words_with
from ..core.errors import InputError, closest, listed, require_positive, say
from ..core.notices import notify
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import (
    Attributes,
    Indices,
    Inside,
    Range,
    Reals,
    Sizes,
    also,
    require,
)
from ..core.values import arrays
from ..core.values.arguments import checked
from ..core.values.fields import Length
from ..shapes import curves, line, locking, meshes, surface
from ..shapes.solids.solid import Solid
from ..shapes.surface import Surface
from ..shapes.table import BasisTable, Curve, Nodes
from . import stations
from .beams import profiles
from .beams.planar import tell_of_plane
from .beams.profiles import Profile
from .cable_law import curvatures
from .cable_points import degree_of, points_of
from .laws import Law
from .sections import Given, Material, Section
from .spare_shapes import MissingShapes
from .values import Value, of_line

BENDS_ALIKE = "a section of the same bending stiffness about all its axes"  #: of a cable in space, which has one bending stiffness
BENDS_ALIKE_REMEDY = "a cable has one bending stiffness: take `type: beam`, a circular section, give EA, EI and rhoA, or stay in the plane"


ROUND_OFF = 1e-12  #: entry of a row over the largest that is no part of it

MAKING = Lock()
#: table (k, p, b, e) and section (i, p, e) of cells
Numbers: TypeAlias = Callable[[], tuple[np.ndarray, np.ndarray]]

LIMP = "is curved in space, where a cable without torsion bends out of its plane at no cost and only tension holds it"
STIFF = "take dimension 2 if it moves in its plane, a straight mesh that loads and joints bend, or a shell"


@storable
@dataclass(frozen=True)
class Cells:
    """Gather and law data of the cells of a body; the cell axis is last, so that kernels run along
    it.

    BasisTable and section of `later` cells are made when one of them is first read.
    """

    law: Annotated[Law, Attributes("k=orders i=rows")]
    #: derivatives of the basis that the law reads [1/m, 1/m2]
    table: Annotated[np.ndarray, Reals("k p b e")]
    #: first component of each basis function in the coordinates
    nodes: Annotated[np.ndarray, Indices("b e", end="w", reach="d")]
    #: number of components of a function, those of all fields of the law
    dim: Annotated[int, Attributes("d")]
    #: rows of the law, the last one the quadrature weight
    section: Annotated[np.ndarray, Reals("i p e")]
    #: coordinates of the cells from the body's, where others
    spread: Annotated[csr_array | None, Reals("w q")] = None

    @classmethod
    def later(cls, law: Law, nodes: np.ndarray, dim: int, points: int, numbers: Numbers) -> Cells:
        """Cells with p = `points` whose table (k, p, b, e) and section (i, p, e) `numbers` makes
        when one of them is first read.

        `nodes` (b, e) are the first components of the functions in the coordinates, `dim` is c.
        """
        cells = object.__new__(cls)
        # copies in other coordinates share what is made
        cells.__dict__.update(
            law=law, nodes=nodes, dim=dim, spread=None, points=points, numbers=cache(numbers)
        )
        return cells

    def __getattr__(self, name: str) -> Any:
        if name not in ("table", "section"):
            raise AttributeError(f"'Cells' has no attribute '{name}'")
        with MAKING:  # threads that run one model read its cells at the same time
            if "numbers" in self.__dict__:
                table, section = self.__dict__["numbers"]()
                self.__dict__.update(table=table, section=section)
                del self.__dict__["numbers"]
        return self.__dict__[name]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(k, p, b, e) of the table."""
        points = self.points if "numbers" in self.__dict__ else self.table.shape[1]
        return (self.law.orders, points, *self.nodes.shape)

    def moved(self, first: int, spread: csr_array | None = None) -> Cells:
        """The cells in coordinates where theirs begin at `first`, or are `spread` (w, q) from all:
        w the coordinates of the cells.

        BasisTable and section are shared, not copied.
        """
        cells = copy(self)
        cells.__dict__.update(nodes=self.nodes + first if first else self.nodes, spread=spread)
        return cells


@also.register(Cells)
def check_cells(cells: Cells, name: str, sizes: Sizes) -> None:
    """A function has the components of all fields of the law."""
    wanted = sizes.get("c", cells.dim // cells.law.fields) * cells.law.fields
    require(cells.dim == wanted, f"{name}.dim", f"{wanted} components", cells.dim)


@storable
@dataclass(frozen=True)
class ShapePoints:
    """A law at points of a reduced body, by shape functions over all of it.

        u[(k, c), p] = sum_b table[k, p, b] z[b, c],    z = q[columns]

    or z = matrix @ x + offset of the unknowns x where there is such a matrix.
    """

    law: Annotated[Law, Attributes("k=vectors i=rows")]
    #: derivatives of the shape functions that the law reads [1/m, 1/m2]
    table: Annotated[np.ndarray, Reals("k p b")]
    #: coordinates of the body; of its own, from 0 on, where there is a matrix
    columns: Annotated[slice, Range("bc", end="q")]
    dim: Annotated[int, Attributes("c")]  #: number of components
    #: rows of the law, the last one the weight of a point
    section: Annotated[np.ndarray, Reals("i 1 p")]
    cell: Annotated[np.ndarray, Indices("p")]  #: number of the cell of every point
    #: lowest and highest strains of its training, see `parts.bodies.strains`; no columns where it
    #: has none
    trained: Annotated[np.ndarray, Reals("2 *")] = field(default_factory=lambda: np.zeros((2, 0)))
    matrix: csr_array | None = None  #: (b c, n) of the coordinates z in the unknowns
    #: (b c,) of the coordinates z, where there is a matrix
    offset: np.ndarray = field(default_factory=lambda: np.zeros(0))
    #: (p, c) in the reference, where they are known [m]
    positions: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    #: shapes that it lacks, where it knows some
    missing: Annotated[MissingShapes | None, Inside("k i b c")] = None
    #: (2,) largest errors of axial or membrane strains and of curvatures in its training, over the
    #: largest ones; none where unknown
    strain_errors: Annotated[np.ndarray, Reals("*")] = field(default_factory=lambda: np.zeros(0))
    checked: bool = True  #: whether what it takes part in is held against the shapes that it lacks


@also.register(ShapePoints)
def check_points(points: ShapePoints, name: str, sizes: Sizes) -> None:
    """The matrix of points that have one gives all coordinates of the body from the unknowns;
    positions are those of all points.
    """
    if points.positions.size:
        wanted = (points.table.shape[1], points.dim)
        require(
            points.positions.shape == wanted,
            f"{name}.positions",
            f"an array {wanted}",
            points.positions.shape,
        )
    if points.matrix is not None:
        wanted = (points.table.shape[2] * points.dim, sizes.get("n", points.matrix.shape[1]))
        require(
            points.matrix.shape == wanted,
            f"{name}.matrix",
            f"an array {wanted}",
            points.matrix.shape,
        )
        require(
            points.offset.shape == wanted[:1],
            f"{name}.offset",
            f"an array {wanted[:1]}",
            points.offset.shape,
        )


@storable
@dataclass(frozen=True)
class LinearElasticity:
    """Stiffness and damping of a body in its reference, for small strains, its b functions with
    three components each.

        K R = 0    of all rigid motions R of the reference
    """

    stiffness: csr_array | np.ndarray  #: K (b c, b c) [N/m]
    damping: csr_array | np.ndarray | None = None  #: C (b c, b c) [N s/m]
    #: K_g (b c, b c), what stresses of a steady spin add to K [N/m]
    prestress: csr_array | np.ndarray | None = None
    slowest: float = 0.0  #: lowest angular frequency of the free body [rad/s], 0 where not known


@storable
@dataclass(frozen=True)
class Body:
    """A part whose points are linear in its coordinates q (b, c) [m], so that its mass is constant.

        r = sum_b N_b(xi) q_b,    T = 1/2 sum_c v_c^T mass v_c

    with the kinetic energy T over the components c. The b functions are those of the space, or
    combinations of them by `spread`: where frames slave some, and in reduced bodies.
    """

    name: str
    reference: np.ndarray  #: (b, c) coordinates of the reference configuration [m]
    mass: csr_array  #: (b, b) [kg]
    constant: np.ndarray  #: (b,) coordinates of the field 1
    #: named points: xi on a line, (cell, xi1, xi2) on a surface, rows (1, n) over nodes
    places: dict[str, Any] = field(default_factory=dict)
    space: line.BSpline | line.Hermite | Surface | Solid | Nodes | None = None
    cells: Cells | None = None
    radius: float = 0.01  #: drawn radius [m]
    #: named rigid frames: first of their functions c, e1, e2 (, e3)
    frames: dict[str, int] = field(default_factory=dict)
    #: (i, b) functions that `frames` counts, where they are combinations of the body's
    axes: csr_array | None = None
    #: of a reduced body: its elastic energy, in place of that of its cells
    shapes: ShapePoints | None = None
    thickness: np.ndarray | float = 0.0  #: of plates and shells, one number or one a cell (e,) [m]
    #: (functions of the space, b) where the body's functions are not those of the space
    spread: csr_array | None = None
    #: (b, b) constant springs between the functions, the same for every component [N/m]
    stiffness: csr_array | None = None
    #: (x, b) points of the line that a picture shows of a rigid body, over its functions
    outline: np.ndarray | None = None
    #: numbers that scale its energy and mass, see `values`
    values: dict[str, Value] = field(default_factory=dict)
    #: (3 n, b) d_1, d_2, d_3 over the n functions of the space, of a beam; in the plane (n, b) d_1
    directors: csr_array | None = None
    profile: Profile | None = None  #: the section along the line of a beam
    #: of a cable whose outermost fibres are `radius` away on both sides wherever it bends, as its
    #: stresses need it; 0 of others [Pa]
    fibre_modulus: float = 0.0
    #: (2, x) parameters and arc lengths [m] of the curved line that its cells follow
    arcs: np.ndarray | None = None
    #: its elastic energy, in place of that of cells
    linear: LinearElasticity | None = None
    #: (3, n) mean axes a_k of the nodes that a frame follows, by its name, see `from_matrices`
    fits: dict[str, csr_array] = field(default_factory=dict)
    #: rows (6 k, b c) of stresses at k points by name, xx, yy, zz, xy, yz, zx in its axes [Pa/m]
    recovery: dict[str, Any] = field(default_factory=dict)
    #: the same body with more functions behind its own, against which it is held
    spare: Body | None = None
    yield_strength: float = 0.0  #: of its material [Pa], 0 where it is not known

    @property
    def dim(self) -> int:
        """Number of components c, 2 or 3."""
        return int(self.reference.shape[1])

    @property
    def is_elastic(self) -> bool:
        """Whether it has a strain energy."""
        return self.cells is not None or self.linear is not None

    @property
    def total_mass(self) -> float:
        """Mass of the body [kg].

            1^T M 1

        with the coordinates `constant` (b,) of the field 1.
        """
        return float(self.constant @ (self.mass @ self.constant))

    @property
    def shape_reference(self) -> np.ndarray:
        """Coordinates of the functions of its space in the reference (n, c) [m]."""
        return self.reference if self.spread is None else np.asarray(self.spread @ self.reference)


@checked
def cable(
    name: str,
    mesh: meshes.LineMesh | curves.Line | str | Path,
    section: Section,
    material: Material | None = None,
    *,
    dim: int = 3,
    group: str | None = None,
    degree: int = 3,
    continuity: int = 1,
    ancf: bool = False,
    law: Law = Law.EXACT,
    numbers: Mapping[str, float] | None = None,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
    points: int | None = None,
) -> Body:
    """Thin cable or beam along the polyline of a mesh file, one cell of the interpolation per mesh
    cell, or along a line.

    `group` picks a named group of lines; `origin` (c,) [m] and `rotation` (c, c) place the mesh:

        x <- origin + rotation x

    Straight polylines stay straight, others become a smooth spline through the mesh points; one
    that is curved in space is `limp`, and said to be. `points` is the number of quadrature points a
    cell, see `cable_points` for that by default and those that are refused. `law` is one of r' and
    r''; `numbers` are those of its section beside EA, EI and kappa0.

        >>> from fmbs_skfem.bodies import Circular, Material, cable
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> arm = cable("arm", segment(10), Circular(0.01), Material(1e9, 1800.0), dim=2)
        >>> f"{arm.total_mass:.4f} kg", sorted(arm.places)
        ('0.1414 kg', ['left', 'right'])
    """
    if not ancf and (degree < 2 or not 1 <= continuity < degree):
        got = f"degree {degree}, continuity {continuity}"
        remedy = "bending needs a slope without jumps"
        raise InputError(
            say(
                f"body '{name}'",
                "degree 2 or more and continuity between 1 and degree - 1",
                got,
                remedy,
            )
        )
    if not isinstance(section, Section):
        raise InputError(
            say(
                f"body '{name}'",
                "a Section such as Circular, Rectangular or Given",
                type(section).__name__,
            )
        )
    if dim == 3 and not section.bends_alike:
        raise InputError(say(f"body '{name}'", BENDS_ALIKE, section, BENDS_ALIKE_REMEDY))
    if dim == 2 and any(section.at(x).is_skew for x in section.stations or (0.0,)):
        tell_of_plane(name)
    curve, breaks, places, arcs = placed_line(name, mesh, group, dim, origin, rotation)
    space = line.Hermite(breaks) if ancf else line.uniform(breaks, degree, continuity)
    reference = line.fit(space, curve)
    fractions, sections, degree = stations.choose(
        section, lambda one: np.diag(cable_data(one.of_cable(material)))
    )
    lengths = along_curve(curve, breaks)
    places_of = np.interp(fractions, lengths[1], lengths[0])
    given = [one.of_cable(material) for one in sections]
    data = partial(cable_along, places_of, degree, np.stack([cable_data(one) for one in given]))
    points = points_of(f"body '{name}'.points", space, points)
    numbers = numbers or {}
    require_line_law(name, law, dim, numbers)
    made = partial(cable_numbers, space, reference, data, law, numbers, points)
    cells = Cells.later(law, np.ascontiguousarray(line.functions(space).T * dim), dim, points, made)
    if law is Law.QUADRATIC and cells.section[2].any():
        raise InputError(
            say(
                f"body '{name}'",
                "a straight line for quadratic curvature",
                "a curved one",
                "use exact curvature",
            )
        )
    if limp(cells, dim):
        notify(f"body '{name}' {LIMP}; {STIFF}")
    return Body(
        name=name,
        reference=reference,
        mass=mass_matrix(space, reference, (lambda xi: data(xi)[2]) if degree else given[0].rhoA),
        constant=line.fit(space, unit_field)[:, 0],
        places=places,
        arcs=arcs,
        space=space,
        cells=cells,
        radius=max(one.radius for one in given),
        profile=profiles.of_cable(places_of, degree, given) if degree else None,
        yield_strength=0.0 if material is None else material.yield_strength or 0.0,
        fibre_modulus=0.0
        if material is None or not all(one.has_fibres(dim) for one in sections)
        else material.young_modulus,
        values=of_line(section, material, dim, locking.locks(space)),
    )


@checked
def point_mass(name: str, mass: float, position: np.ndarray, radius: Length = 0.03) -> Body:
    """A mass point at a position (c,) [m]; its only place is `center`.

    `mass` [kg] is positive and finite, else InputError; `radius` [m] is that of its picture.

        >>> import numpy as np
        >>> from fmbs_skfem.bodies import point_mass
        >>> point_mass("ball", 0.5, np.array([0.0, 2.0])).total_mass
        0.5
    """
    require_positive(f"body '{name}'", mass=mass)
    at = arrays.finite(position, f"body '{name}': position", "2 or 3 finite numbers [m]", None)[
        None, :
    ]
    if at.size not in (2, 3):
        raise InputError(
            say(f"body '{name}': position", "2 or 3 finite numbers [m]", f"{at.size} of them")
        )
    return Body(name, at, csr_array(np.array([[mass]])), np.ones(1), {"center": 0.0}, radius=radius)


def positions(part: Body) -> np.ndarray:
    """Positions (x, c) [m] of a body in the reference, which say where it is and how large.

    Of a rigid body those of its places, of any other the coordinates of functions that are
    positions: their `constant` is 1, that of slopes and axes 0. Those of a reduced body are the
    coordinates of its space.
    """
    if part.space is None and part.frames:
        return part.reference[0] + np.array(list(part.places.values())) @ part.reference[1:]
    if part.spread is not None and (part.shapes is not None or part.linear is not None):
        return part.shape_reference[part.spread @ part.constant > 0.5]
    return part.reference[part.constant > 0.5]


def extent(part: Body) -> float:
    """Diagonal of the box around the points of a body [m], parallel to the axes of the scene; 0 of
    a mass point.
    """
    points = positions(part)
    # coordinates that a joint brings have none
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def place(
    where: str, points: np.ndarray, dim: int, origin: np.ndarray | None, rotation: np.ndarray | None
) -> np.ndarray:
    """Points (j, 2 or 3) of a mesh or shape in the frame of the scene, (j, c) [m].

        x <- origin + rotation x

    `origin` (c,) [m] and `rotation` (c, c) are 0 and 1 by default; `where` is the place in
    messages. InputError where points of a planar scene (`dim` 2) are out of the plane z = 0 by more
    than 1e-12 of their extent.
    """
    if dim == 2 and points.shape[1] == 3 and np.abs(points[:, 2]).max() > 1e-12 * np.ptp(points):
        raise InputError(
            say(
                where,
                "points in the plane z = 0",
                f"z up to {np.abs(points[:, 2]).max():.3g} m",
                "use dimension 3",
            )
        )
    wide = np.pad(points[:, :dim], ((0, 0), (0, max(0, dim - points.shape[1]))))
    moved = (
        wide
        if rotation is None
        else wide
        @ arrays.finite(rotation, f"{where}.rotation", f"a matrix ({dim}, {dim})", dim, dim).T
    )
    return (
        moved
        if origin is None
        else moved + arrays.finite(origin, f"{where}.origin", f"{dim} finite numbers [m]", dim)
    )


def placed_line(
    name: str,
    mesh: meshes.LineMesh | curves.Line | str | Path,
    group: str | None,
    dim: int,
    origin: np.ndarray | None,
    rotation: np.ndarray | None,
) -> tuple[Curve, np.ndarray, dict[str, Any], np.ndarray | None]:
    """The curve of a body in the frame of the scene, parameters (n,) where its cells meet, its
    named points, and `Body.arcs`.
    """
    mesh = meshes.read(mesh) if isinstance(mesh, (str, Path)) else mesh
    if isinstance(mesh, curves.Line):
        return (
            partial(placed_curve, name, mesh.curve, dim, origin, rotation),
            mesh.breaks,
            dict(mesh.names),
            mesh.arcs,
        )
    order = meshes.chain(mesh, group)
    breaks, curve = curves.through(
        place(f"body '{name}'", mesh.points[order], dim, origin, rotation)
    )
    return curve, breaks, dict(curves.named_points(mesh, order, breaks)), None


def placed_curve(
    name: str,
    curve: Curve,
    dim: int,
    origin: np.ndarray | None,
    rotation: np.ndarray | None,
    xi: np.ndarray,
    derivative: int = 0,
) -> np.ndarray:
    """A curve in the frame of the scene, or its derivative, at parameters xi (x,), (x, c), see
    `place`.
    """
    return place(
        f"body '{name}'", curve(xi, derivative), dim, None if derivative else origin, rotation
    )


def along_curve(curve: Curve, breaks: np.ndarray) -> np.ndarray:
    """Parameters close to one another along a curve with cells that meet at breaks (n,), and
    fractions of its length, (2, x).
    """
    found = curves.arc_lengths(breaks, lambda xi: np.linalg.norm(curve(xi, 1), axis=1))
    found[1] /= found[1, -1]
    return found


def unit_field(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    """The field 1 at parameters xi (x,), as a curve with one component (x, 1); its derivatives are
    0.
    """
    return np.full((len(xi), 1), 1.0 if derivative == 0 else 0.0)


def arc_length_table(
    space: line.BSpline | line.Hermite, reference: np.ndarray, points: int, derivatives: int = 2
) -> tuple[BasisTable, np.ndarray, np.ndarray]:
    """BasisTable in xi; basis and derivatives in S, (e, p, k, b); weights in S [m], (e, p).

        d/dS = (1/J) d/dxi,   d2/dS2 = (1/J^2) d2/dxi2 - (J'/J^3) d/dxi,   J = |dr0/dxi|

    of a line with reference coordinates (b, c) [m] at `points` Gauss points p a cell. Only the
    first two derivatives are converted.
    """
    table = line.gauss_table(space, points, derivatives)
    gradients = np.einsum("epkb,ebc->epkc", table.values, reference[table.nodes])
    first, second = gradients[:, :, 1], gradients[:, :, 2]
    J = np.linalg.norm(first, axis=2)
    slope = np.einsum("epc,epc->ep", first, second) / J
    values = table.values.copy()
    values[:, :, 1] = table.values[:, :, 1] / J[..., None]
    values[:, :, 2] = (
        table.values[:, :, 2] / J[..., None] ** 2
        - table.values[:, :, 1] * (slope / J**3)[..., None]
    )
    return table, values, table.weights * J


def mass_matrix(
    space: line.BSpline | line.Hermite,
    reference: np.ndarray,
    density: float | Callable[[np.ndarray], np.ndarray],
) -> csr_array:
    """Mass matrix (b, b) [kg] of a line with reference coordinates (b, c) [m] and `density` rhoA
    [kg/m].

        m_ij = int rhoA N_i N_j dS

    A density that changes is a function of the parameters (e, p). One Gauss point a cell more than
    the degree has: exact where |dr0/dxi| and the density are constant in a cell.
    """
    table, values, weights = arc_length_table(space, reference, degree_of(space) + 1, 1)
    scale, weights = (
        (1.0, weights * density(table.points)) if callable(density) else (density, weights)
    )
    blocks = scale * np.einsum("epb,epd,ep->ebd", values[:, :, 0], values[:, :, 0], weights)
    return scatter_blocks(blocks, table.nodes, table.count)


def scatter_blocks(blocks: np.ndarray, nodes: np.ndarray, count: int) -> csr_array:
    """The sum A (count, count) of blocks (e, b, b) on the functions `nodes` (e, b) of cells.

        A[nodes[e, i], nodes[e, j]] += blocks[e, i, j]

    Blocks that meet in an entry are added.
    """
    rows = np.repeat(nodes, nodes.shape[1], axis=1).ravel()
    columns = np.tile(nodes, (1, nodes.shape[1])).ravel()
    return csr_array(coo_array((blocks.ravel(), (rows, columns)), shape=(count, count)))


def require_line_law(name: str, law: Law, dim: int, numbers: Mapping[str, float]) -> None:
    """Refuse a law that does not act on lines of `dim` components, or whose section is not known."""
    if law.vectors != 2 or law.follows or dim not in law.dims:
        raise InputError(
            say(f"body '{name}'.law", f"a law of r' and r'' in {dim} dimensions", law.name)
        )
    missing = [row for row in law.section if row not in ("EA", "EI", "kappa0", "weight", *numbers)]
    if missing:
        raise InputError(
            say(
                f"body '{name}'.numbers",
                f"the numbers of the law: {', '.join(missing)}",
                sorted(numbers),
            )
        )
    if unread := [row for row in numbers if row not in law.section]:
        expected = f"numbers of the law {law.name} ({', '.join(law.section)})"
        raise InputError(
            say(f"body '{name}'.numbers", expected, f"'{unread[0]}'")
            + closest(unread[0], law.section)
        )


def cable_data(one: Given) -> np.ndarray:
    """EA [N], EI [N m2] and rhoA [kg/m]."""
    return np.array([one.EA, one.EI, one.rhoA])


def cable_along(places: np.ndarray, degree: int, data: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """EA, EI and rhoA (3, ...) at parameters xi (...), of those (k, 3) at the stations `places`
    (k,), see `stations`.
    """
    return np.moveaxis(stations.shares(places, degree, xi) @ data, -1, 0)


def cable_numbers(
    space: line.BSpline | line.Hermite,
    reference: np.ndarray,
    data: Callable[[np.ndarray], np.ndarray],
    law: Law,
    numbers: Mapping[str, float],
    points: int,
) -> tuple[np.ndarray, np.ndarray]:
    """BasisTable (k, p, b, e) and section (i, p, e) of a cable at `points` quadrature points a
    cell; the reference is free of stress.

    `data` gives EA, EI and rhoA (3, ...) at parameters (...). Rows of the section are those of the
    law: EA [N], EI [N m2], kappa0 [1/m], weight [m], and its own `numbers`. Where the cubics lock,
    EA has shares at the points that differ, see `shapes.locking`. `reference` (b, c) [m].
    """
    table, values, weights = arc_length_table(space, reference, points)
    gradients = np.einsum("epkb,ebc->epkc", values[:, :, 1:], reference[table.nodes])
    measure = law if law.bends else Law.EXACT
    kappa = curvatures(
        measure.option,
        reference.shape[1],
        gradients.reshape(gradients.shape[0], gradients.shape[1], -1),
    )
    # of rounded positions
    noise = 64.0 * np.finfo(float).eps * np.abs(reference).max() / weights.sum(axis=1).min() ** 2
    kappa[np.abs(kappa) < 1e-9 / weights.sum() + noise] = 0.0
    EA, EI, _ = data(table.points)
    shares = locking.axial_shares(
        space, table, float((EA * weights.sum(axis=1).max() ** 2 / EI).max())
    )
    rows: dict[str, Any] = {"EA": EA * shares, "EI": EI, "kappa0": kappa, "weight": weights} | dict(
        numbers
    )
    section = np.stack([np.broadcast_to(rows[row], weights.shape) for row in law.section])
    return np.ascontiguousarray(values[:, :, 1:].transpose(2, 1, 3, 0)), np.ascontiguousarray(
        section.transpose(0, 2, 1)
    )


def limp(cells: Any, dim: int) -> bool:
    """Whether cells, or points sampled from them, are those of a cable which is curved in space.

    W depends on the size of the curvature alone: to first order it does not change where the line
    bends out of its plane, and as there is no torsion, no energy holds that motion; the tension N
    r' does, once there is one.
    """
    return cells.law.bends and dim == 3 and bool(cells.section[2].any())


#: xi on a line, (cell, xi1, xi2) on a surface, a row (1, n) over nodes, name of a frame
Place: TypeAlias = float | tuple[int, float, float] | str | csr_array


def locate(body: Body, place: str | float) -> Place:
    """A named point or frame, by default the centre, or the parameter xi at an arc length from the
    start of a line [m].

    The arc length is that of the reference; lengths up to 1e-9 beyond an end, relative, are taken
    for the end. InputError for a name that the body does not have, with the nearest known one; for
    a number where the body is no line; and for a length beyond its ends.
    """
    if isinstance(place, str):
        place = place or "center"
        known = {**body.frames, **body.places}
        if place not in known:
            expected = f"one of its points ({listed(sorted(known), place, 'none')})"
            got, remedy = f"'{place}'", closest(place, known)[2:]
            if isinstance(body.space, Surface) and place in body.space.edges:
                got = f"the edge '{place}'"
                remedy = f"name a point of the mesh, or take what has `edges`: {', '.join(words_with('edges'))}"
            elif isinstance(body.space, Solid) and place in {*body.space.faces, *body.space.sets}:
                got = f"'{place}', faces or a set of nodes"
                remedy = "name it among the `rims` or `averages` of the body"
            elif not remedy and isinstance(body.space, line.BSpline | line.Hermite):
                remedy = "a group of several nodes is no point"
            raise InputError(say(f"body '{body.name}'", expected, got, remedy))
        return place if place in body.frames else body.places[place]
    if not isinstance(body.space, line.BSpline | line.Hermite):
        names = ", ".join(sorted({**body.frames, **body.places})) or "none"
        raise InputError(say(f"body '{body.name}'", f"one of its points ({names})", place))
    fine, arc = arc_lengths(body)
    if not -1e-9 * arc[-1] <= place <= arc[-1] * (1 + 1e-9):
        end = arc[-1] if place > 0.0 else 0.0
        nearest = f"the nearest point is the end at {end:.6g} m, {abs(place - end):.6g} m away"
        raise InputError(
            say(
                f"body '{body.name}'",
                f"an arc length between 0 and {arc[-1]:.6g} m",
                f"{place} m",
                nearest,
            )
        )
    return float(np.interp(place, arc, fine))


def arc_lengths(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Parameters xi (x,) close to one another along a line, and the arc lengths (x,) to them [m].

    Those of the line that its cells follow, so that a place lies there on every mesh, or else of
    the reference.
    """
    if body.arcs is None:

        def speed(xi: np.ndarray) -> np.ndarray:
            tangents = own(body, line.sample(body.space, xi, 1)) @ body.reference
            return np.asarray(np.linalg.norm(tangents, axis=1))

        fine, arc = curves.arc_lengths(line.breaks(body.space), speed)
    else:
        fine, arc = body.arcs
    return fine, arc


def reference_at(body: Body, place: str | float) -> np.ndarray:
    """Position (c,) of a place in the reference [m]; the place, and InputError, as of `locate`."""
    return np.asarray(probe(body, locate(body, place)) @ body.reference)[0]


def probe(body: Body, place: Place, derivative: int = 0) -> csr_array:
    """Row (1, b) that takes coordinates to the position (derivative 0) or to a vector (derivative
    1, 2, 3) at a place.

    Vectors are the slope dr/dS of a line, the unit tangents of a surface in local coordinates, the
    axes e1, e2 (, e3) of a frame. InputError where the place has no vector of that number.
    """
    if isinstance(place, str):
        axes = body.dim if derivative else 0
        number = body.frames[place] + derivative
        if body.axes is not None:
            return vector_row(body, derivative, axes, csr_array(body.axes[[number]]))
        unit = selection([number], len(body.reference))
        return vector_row(body, derivative, axes, unit)
    if isinstance(body.space, Surface):
        cell, xi = np.array([place[0]]), np.array([place[1:]])  # type: ignore[index]
        rows = [own(body, surface.sample(body.space, cell, xi, k)) for k in range(3)]
        tangents = np.stack([row @ body.reference for row in rows[1:]], axis=1)
        inverse = np.linalg.inv(
            np.einsum("xac,xic->xai", tangents, surface.local_axes(tangents)[0])
        )[0]
        local = (
            csr_array(inverse[derivative - 1, 0] * rows[1] + inverse[derivative - 1, 1] * rows[2])
            if derivative in (1, 2)
            else rows[0]
        )
        return vector_row(body, derivative, 2, local)
    if isinstance(body.space, Nodes | Solid):
        return vector_row(body, derivative, 0, own(body, place))
    if body.space is None and body.frames:
        if derivative:
            return probe(body, next(iter(body.frames)), derivative)
        return csr_array(np.array([[1.0, *place]]))  # type: ignore[misc]
    if body.space is None:
        return vector_row(body, derivative, 0, selection([0], len(body.reference)))
    xi = np.array([place])
    if body.directors is not None and 0 < derivative <= directors(body):
        row = as_csr(line.sample(body.space, xi) @ director(body, derivative))
        return vector_row(body, derivative, directors(body), row)
    row = own(body, line.sample(body.space, xi, min(derivative, 1)))
    size = np.linalg.norm(row @ body.reference) if derivative else 1.0
    return vector_row(body, derivative, 1, as_csr(row / size) if derivative else row)


def director(body: Body, number: int) -> csr_array:
    """Rows (n, b) that take coordinates of a beam to the coefficients of its director d_1, d_2 or
    d_3 in its space.
    """
    assert body.directors is not None
    count = body.directors.shape[0] // directors(body)
    return as_csr(body.directors[(number - 1) * count : number * count])


def directors(body: Body) -> int:
    """How many directors a beam has, 3 in space and 1 in the plane; 0 of other bodies."""
    return 0 if body.directors is None else 3 if body.dim == 3 else 1


def over_space(body: Body) -> csr_array | None:
    """Functions of a body over those of its space (w, b), behind each other of r, d_1, d_2, d_3 of
    a beam; None where the same.
    """
    return body.spread if body.directors is None else as_csr(vstack([body.spread, body.directors]))


def read_by_cells(body: Body) -> csr_array | None:
    """What the cells of a body read (w, b) over its functions; None where they read these."""
    if body.directors is None:
        return body.spread
    if body.shapes is None:
        return None
    found = over_space(body)
    fields = 1 + directors(body)
    assert found is not None
    return as_csr(found[np.arange(found.shape[0]).reshape(fields, -1).T.ravel()])


def own(body: Body, rows: csr_array) -> csr_array:
    """Rows (x, n) on the functions of the space as rows (x, b) on the functions of the body: rows @
    spread, or themselves.
    """
    return as_csr(rows) if body.spread is None else as_csr(rows @ body.spread)


def vector_row(body: Body, derivative: int, known: int, row: csr_array) -> csr_array:
    """The row (1, b), where the place has a vector of that number, which is at most `known`; else
    InputError.
    """
    if derivative > known:
        expected = (
            "a body with a slope" if derivative == 1 else f"a place with {derivative} vectors"
        )
        remedy = "take a place of a line for a slope, a frame for axes"
        raise InputError(
            say(
                f"body '{body.name}'",
                expected,
                f"one with {known}" if known else "a mere point",
                remedy,
            )
        )
    return row if body.shapes is None and body.linear is None else without_round_off(row)


def without_round_off(row: csr_array) -> csr_array:
    """A row (1, b) of a reduced body: places that are coordinates of their own are read by exact
    numbers.
    """
    row.data[np.abs(row.data) <= ROUND_OFF * np.abs(row.data).max(initial=0.0)] = 0.0
    row.data[np.abs(row.data - 1.0) <= ROUND_OFF] = 1.0
    row.eliminate_zeros()
    return row
