r"""What bodies are, in numbers that an engineer knows.

cells          aspect s_1 / s_2 and angle asin(s_1 s_2 / (|a_1| |a_2|)) of the tangents A = [a_1 a_2] with singular values s_k,
               J_min / J_max in a cell, largest over smallest cell (P. M. Knupp, SIAM J. Sci. Comput. 23 (2001) 193-218,
               doi:10.1137/S1064827500371499)
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..bodies import body as bodies
from ..bodies.body import Body
from ..bodies.plate import on_nodes
from ..bodies.sections import Given, Material
from ..bodies.solids.materials import Orthotropic
from ..core.storage.records import dataclass
from ..shapes import line, surface
from ..shapes.solids import solid
from ..shapes.solids.solid import Solid
from ..shapes.surface import Parent, Surface

COUNTED = 2000  #: cells of a plate up to which those from edge to edge are counted
IDEAL = {  #: from the parent to a square or an equilateral triangle
    Parent.SQUARE: np.eye(2),
    Parent.TRIANGLE: np.array([[1.0, -1.0 / math.sqrt(3.0)], [0.0, 2.0 / math.sqrt(3.0)]]),
}


@dataclass(frozen=True)
class CellShapes:
    """Shape of the cells of a body: the worst of each kind, and where the worst angle or aspect is."""

    count: int
    size_ratio: float  #: length or area of the largest cell over that of the smallest
    aspect: float = 1.0
    angle: float = 90.0  #: smallest [deg]
    jacobian: float = 1.0  #: smallest ratio J_min / J_max in a cell
    worst: int = 0  #: number of the cell of the largest aspect
    place: tuple[float, ...] = ()  #: its middle [m]
    across: int = 0  #: cells from edge to edge of a plate that Poisson's ratio bends crosswise
    remedy: str = "mesh it more evenly for full accuracy"


@dataclass(frozen=True)
class BodyFigures:
    """What a body is, in numbers that an engineer knows; None where it does not apply."""

    name: str
    mass: float  #: [kg]
    extent: float  #: diagonal of the box around its positions [m]
    wave_speed: float | None = None  #: [m/s]
    slenderness: float | None = None
    sag: float | None = None  #: of the cantilever of its length under gravity, over that length
    weight_strain: float | None = None
    cells: CellShapes | None = None
    degree: int | None = None  #: of the cells of a line
    length: float | None = None  #: of a line [m]
    area: float | None = None  #: of a plate or shell [m2]


def of_any(part: Body) -> BodyFigures:
    """A body with a mass and a size."""
    return BodyFigures(part.name, part.total_mass, bodies.extent(part))


def of_beam(part: Body) -> BodyFigures:
    """A beam with torsion, whose sections have no single stiffness."""
    lengths = line_cells(part)
    shape = CellShapes(
        len(lengths), float(lengths.max() / lengths.min()), worst=int(np.argmin(lengths))
    )
    return replace(of_any(part), length=float(lengths.sum()), cells=shape)


def of_line(part: Body, data: Given, degree: int, gravity: float) -> BodyFigures:
    """A line with a section, under gravity [m/s2]."""
    found = of_beam(part)
    length = found.length
    assert length is not None
    weight = data.rhoA * gravity
    return replace(
        found,
        wave_speed=math.sqrt(data.EA / data.rhoA),
        slenderness=length / math.sqrt(data.EI / data.EA),
        sag=weight * length**3 / (8 * data.EI) if gravity else None,
        weight_strain=weight * length / data.EA if gravity else None,
        degree=degree,
    )


def of_plate(part: Body, material: Material, gravity: float, flat: bool) -> BodyFigures:
    """A plate or shell under gravity [m/s2]; where it is `flat`, cells from edge to edge are
    counted.
    """
    speed = math.sqrt(material.young_modulus / material.density)
    cells, area = plate_cells(part)
    if flat and part.dim == 3 and material.poisson_ratio and cells.count <= COUNTED:
        assert isinstance(part.space, Surface)
        cells = replace(cells, across=cells_across(part.space))
    length = math.sqrt(float(area.sum()))
    t = float(np.mean(part.thickness))
    sag = 1.5 * length**3 / (speed**2 * t**2)
    bent = gravity and part.dim == 3
    return replace(
        of_any(part),
        area=float(area.sum()),
        wave_speed=speed,
        slenderness=length / t if part.dim == 3 else None,
        sag=sag * gravity if bent else None,
        weight_strain=gravity * length / speed**2 if gravity else None,
        cells=cells,
    )


def of_solid(part: Body, material: Material | Orthotropic, gravity: float) -> BodyFigures:
    """A solid under gravity [m/s2]; its aspect is that of the longest edge of a cell over its
    least height, the angle is left out.
    """
    shape = part.space
    assert isinstance(shape, Solid)
    E = material.young_modulus if isinstance(material, Material) else max(material.young_moduli)
    speed = math.sqrt(E / material.density)
    found = of_any(part)
    height, volume = solid.heights(shape)
    size = np.ptp(shape.reference[shape.nodes], axis=1).max(axis=1)
    worst = int(np.argmax(size / height))
    return replace(
        found,
        wave_speed=speed,
        weight_strain=gravity * found.extent / speed**2 if gravity else None,
        cells=CellShapes(
            len(size),
            float(volume.max() / volume.min()),
            float(size[worst] / height[worst]),
            worst=worst,
            place=tuple(solid.corner_rows(shape, np.array([worst]))[0].tolist()),
            remedy="mesh it more evenly, or take a plate or shell for thin walls",
        ),
    )


def line_cells(part: Body) -> np.ndarray:
    """Lengths (e,) of the cells of a line between their ends [m]."""
    assert isinstance(part.space, line.BSpline | line.Hermite)
    return np.diff(line.breaks(part.space))


def plate_cells(part: Body) -> tuple[CellShapes, np.ndarray]:
    """Shape of the cells of a plate at Gauss points of its reference surface, and their areas (e,)
    [m2].
    """
    shape = part.space
    assert isinstance(shape, Surface)
    found = [shapes_of(shape, part.shape_reference, cells) for cells in surface.parts(shape)]
    aspect, angle, jacobian, area, middle = (
        np.concatenate(figure) for figure in zip(*found, strict=True)
    )
    worst = int(np.argmax(aspect))
    ratio = float(area.max() / area.min())
    place = tuple(middle[worst].tolist())
    return CellShapes(
        len(aspect),
        ratio,
        float(aspect[worst]),
        float(angle.min()),
        float(jacobian.min()),
        worst,
        place,
    ), area


def shapes_of(shape: Surface, reference: np.ndarray, part: slice) -> tuple[np.ndarray, ...]:
    """Aspect, smallest angle [deg], J_min / J_max, area [m2] (e,) and middle (e, c) [m] of some
    cells.
    """
    table = surface.tabulate(shape, part=part)
    points, *tangents = np.moveaxis(on_nodes(table.values[:, :, :3], reference[table.nodes]), 2, 0)
    sides = [*tangents, tangents[1] - tangents[0]] if shape.parent is Parent.TRIANGLE else tangents
    gram = np.einsum("kepc,lepc->epkl", tangents, tangents)
    J = np.sqrt(np.maximum(np.linalg.det(gram), 0.0))
    cosines = [
        np.abs(np.einsum("epc,epc->ep", a, b)) for k, a in enumerate(sides) for b in sides[k + 1 :]
    ]
    strong = np.linalg.eigvalsh(IDEAL[shape.parent].T @ gram @ IDEAL[shape.parent])
    aspect = np.sqrt(strong[:, :, 1] / np.maximum(strong[:, :, 0], 1e-300)).max(axis=1)
    angle = np.degrees(np.arctan2(J, np.max(cosines, axis=0))).min(axis=1)
    area = np.einsum("ep,ep->e", table.weights, J)
    return aspect, angle, J.min(axis=1) / J.max(axis=1), area, points.mean(axis=1)


def cells_across(shape: Surface) -> int:
    """Number of square cells that reach from edge to edge: neighbours at two opposite sides and
    none at the others.
    """
    if shape.parent is not Parent.SQUARE:
        return 0
    one, two, _ = surface.coincident_sides(shape)
    inner = np.zeros((len(shape.nodes), 4), dtype=bool)
    for cell, side in (one.T, two.T):
        inner[cell, side] = True
    first, second = inner[:, [0, 2]], inner[:, [1, 3]]
    return int(
        (
            (first.any(axis=1) & ~second.any(axis=1)) | (second.any(axis=1) & ~first.any(axis=1))
        ).sum()
    )
