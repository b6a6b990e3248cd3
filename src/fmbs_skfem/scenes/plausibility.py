r"""Numbers of a scene that are allowed but hardly meant: units, sizes, masses, slenderness, sag under weight, shapes of cells.

    wave speed     sqrt(E / rho),  of given sections sqrt(EA / rhoA)             50 to 20 000 m/s where masses count
    slenderness    L / i,  i = sqrt(EI / EA);   sqrt(area) / t of plates         thin enough for laws without shear
    sag            w L^4 / (8 EI) of the cantilever of that length, strain w L / EA under its weight (W. C. Young, R. G. Budynas,
                   Roark's Formulas for Stress and Strain, 7th ed., McGraw-Hill 2002, table 8.1)
    cells          aspect s_1 / s_2 and angle asin(s_1 s_2 / (|a_1| |a_2|)) of the tangents A = [a_1 a_2] with singular values s_k,
                   J_min / J_max in a cell, largest over smallest cell (P. M. Knupp, SIAM J. Sci. Comput. 23 (2001) 193-218,
                   doi:10.1137/S1064827500371499)

A slip of units changes these by factors of 1e3 to 1e12; the bounds are far from what is built. Nothing here stops a scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any

import numpy as np

from ..bodies import body as bodies
from ..bodies.body import Body
from ..bodies.plate import on_nodes
from ..shapes import line, surface
from ..shapes.surface import Parent, Surface
from ..systems.loads import Gravity
from . import schema

WAVE_SPEEDS = (50.0, 2e4)  #: where masses count [m/s]
SOLIDS = (10.0, 3e4)  #: soft rubber to diamond [m/s]
DENSITIES = (0.5, 3e4)  #: aerogel to osmium [kg/m3]
MASSES = (1e-9, 1e7)  #: of a body [kg]
LENGTHS = (1e-6, 1e3)  #: of a body [m]
THIN = (15.0, 4e6)  #: L / i of a line; a circular section has i = d / 4
PLATE_THIN = (5.0, 1e5)  #: sqrt(area) / thickness
LOCKING = 1e4  #: EA h^2 / EI of quadratic cells of lines
STRAIN, SAG = 0.01, 1e4  #: under the own weight; sag over length
WEIGHT = 500.0  #: largest plausible gravity [m/s2]
COUNTED = 2000  #: cells of a plate up to which those from edge to edge are counted
ASPECT, ANGLE, JACOBIAN, SIZES = 20.0, 15.0, 0.1, 1e3  #: of cells: largest, smallest [deg], smallest, largest
RATIO = 1e4  #: of the largest body over the smallest
TONNES = 1e12  #: 1 t/mm3 in kg/m3
USUAL = (300.0, 1.5e4)  #: wave speeds of most solids [m/s]
SLIPS = {  #: what may have been meant, and the factor it puts on E / rho
    "Young's modulus given in MPa": 1e6,
    "Young's modulus given in GPa": 1e9,
    "the density given in g/cm3": 1e-3,
    "the density given in t/mm3": 1e-12,
    "the scene given in t, mm and MPa": 1e-6,
}
IDEAL = {  #: from the parent to a square or an equilateral triangle
    Parent.SQUARE: np.eye(2),
    Parent.TRIANGLE: np.array([[1.0, -1.0 / math.sqrt(3.0)], [0.0, 2.0 / math.sqrt(3.0)]]),
}


@dataclass(frozen=True)
class Finding:
    """Something hardly meant, at a path of keys of the scene."""

    keys: tuple[str, ...]
    text: str
    meant: str = ""  #: a question that names what would explain it

    def __str__(self) -> str:
        return f"{self.text}: {self.meant}" if self.meant else self.text


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


def figures(scene: schema.Scene, parts: Mapping[str, Body]) -> dict[str, BodyFigures]:
    """The figures of every body of a scene, with the bodies made of it."""
    gravity = float(np.linalg.norm(sum((np.array(load.acceleration) for load in weights(scene).values()), np.zeros(1))))
    return {name: of_body(model, parts[name], gravity) for name, model in scene.bodies.items()}


def weights(scene: schema.Scene) -> dict[str, Gravity]:
    """The gravity loads of a scene."""
    return {name: load for name, load in scene.loads.items() if isinstance(load, Gravity)}


def mass_of(part: Body) -> float:
    return float(part.constant @ (part.mass @ part.constant))


@singledispatch
def of_body(model: Any, part: Body, gravity: float) -> BodyFigures:
    """The figures of a body under gravity [m/s2]; rigid bodies and mass points have a mass and a size."""
    return BodyFigures(part.name, mass_of(part), bodies.extent(part))


@of_body.register
def _(model: schema.Cable, part: Body, gravity: float) -> BodyFigures:
    data = model.section.stiffness(model.material)
    lengths = line_cells(part)
    length, weight = float(lengths.sum()), data.rhoA * gravity
    return BodyFigures(
        part.name,
        mass_of(part),
        bodies.extent(part),
        math.sqrt(data.EA / data.rhoA),
        length / math.sqrt(data.EI / data.EA),
        weight * length**3 / (8 * data.EI) if gravity else None,
        weight * length / data.EA if gravity else None,
        CellShapes(len(lengths), float(lengths.max() / lengths.min()), worst=int(np.argmin(lengths))),
    )


@of_body.register(schema.Plate)
@of_body.register(schema.Shell)
def _(model: schema.Plate | schema.Shell, part: Body, gravity: float) -> BodyFigures:
    speed = math.sqrt(model.material.young_modulus / model.material.density)
    cells, area = plate_cells(part)
    if isinstance(model, schema.Plate) and part.dim == 3 and model.material.poisson_ratio and cells.count <= COUNTED:
        assert isinstance(part.space, Surface)
        cells = replace(cells, across=cells_across(part.space))
    length, t = math.sqrt(float(area.sum())), float(np.mean(part.thickness))
    sag = 1.5 * length**3 / (speed**2 * t**2)
    bent = gravity and part.dim == 3
    return BodyFigures(
        part.name,
        mass_of(part),
        bodies.extent(part),
        speed,
        length / t if part.dim == 3 else None,
        sag * gravity if bent else None,
        gravity * length / speed**2 if gravity else None,
        cells,
    )


def line_cells(part: Body) -> np.ndarray:
    """Lengths (e,) of the cells of a line between their ends [m]."""
    assert isinstance(part.space, line.BSpline | line.Hermite)
    return np.diff(line.breaks(part.space))


def plate_cells(part: Body) -> tuple[CellShapes, np.ndarray]:
    """Shape of the cells of a plate at Gauss points of its reference surface, and their areas (e,) [m2]."""
    shape = part.space
    assert isinstance(shape, Surface)
    reference = part.reference if part.spread is None else np.asarray(part.spread @ part.reference)
    found = [shapes_of(shape, reference, cells) for cells in surface.parts(shape)]
    aspect, angle, jacobian, area, middle = (np.concatenate(figure) for figure in zip(*found, strict=True))
    worst, ratio = int(np.argmax(aspect)), float(area.max() / area.min())
    place = tuple(middle[worst].tolist())
    return CellShapes(len(aspect), ratio, float(aspect[worst]), float(angle.min()), float(jacobian.min()), worst, place), area


def shapes_of(shape: Surface, reference: np.ndarray, part: slice) -> tuple[np.ndarray, ...]:
    """Aspect, smallest angle [deg], J_min / J_max, area [m2] (e,) and middle (e, c) [m] of some cells."""
    table = surface.tabulate(shape, part=part)
    points, *tangents = np.moveaxis(on_nodes(table.values[:, :, :3], reference[table.nodes]), 2, 0)
    sides = [*tangents, tangents[1] - tangents[0]] if shape.parent is Parent.TRIANGLE else tangents
    gram = np.einsum("kepc,lepc->epkl", tangents, tangents)
    J = np.sqrt(np.maximum(np.linalg.det(gram), 0.0))
    cosines = [np.abs(np.einsum("epc,epc->ep", a, b)) for k, a in enumerate(sides) for b in sides[k + 1 :]]
    strong = np.linalg.eigvalsh(IDEAL[shape.parent].T @ gram @ IDEAL[shape.parent])
    aspect = np.sqrt(strong[:, :, 1] / np.maximum(strong[:, :, 0], 1e-300)).max(axis=1)
    angle = np.degrees(np.arctan2(J, np.max(cosines, axis=0))).min(axis=1)
    area = np.einsum("ep,ep->e", table.weights, J)
    return aspect, angle, J.min(axis=1) / J.max(axis=1), area, points.mean(axis=1)


def cells_across(shape: Surface) -> int:
    """Number of square cells that reach from edge to edge: neighbours at two opposite sides and none at the others."""
    if shape.parent is not Parent.SQUARE:
        return 0
    one, two, _ = surface.coincident_sides(shape)
    inner = np.zeros((len(shape.nodes), 4), dtype=bool)
    for cell, side in (one.T, two.T):
        inner[cell, side] = True
    first, second = inner[:, [0, 2]], inner[:, [1, 3]]
    return int(((first.any(axis=1) & ~second.any(axis=1)) | (second.any(axis=1) & ~first.any(axis=1))).sum())


def materials(scene: schema.Scene) -> Iterator[Finding]:
    """Wave speeds of the materials of a scene, which need no mesh."""
    for name, body in scene.bodies.items():
        if (material := getattr(body, "material", None)) is not None:
            speed = math.sqrt(material.young_modulus / material.density)
            yield from _wave_speed(("bodies", name, "material"), speed, moving(scene))


def moving(scene: schema.Scene) -> bool:
    """Whether masses count: something moves, or weighs."""
    return scene.analysis.type != "static" or bool(weights(scene))


def findings(scene: schema.Scene, known: Mapping[str, BodyFigures]) -> Iterator[Finding]:
    """What is hardly meant, in the order of the scene."""
    waves = moving(scene)
    for name, own in known.items():
        yield from _material(scene.bodies[name], name, own, waves)
        yield from _sizes(name, own)
        yield from _locking(scene.bodies[name], name, own)
        yield from _cells(name, own.cells)
    sizes = sorted((own.extent, name) for name, own in known.items() if own.extent > 0.0)
    if sizes and sizes[-1][0] > RATIO * sizes[0][0]:
        (least, small), (most, large) = sizes[0], sizes[-1]
        yield Finding(("bodies", small), f"'{large}' is {most / least:.3g} times as large as '{small}': are both meshes in metres?")
    for name, load in weights(scene).items():
        size = float(np.linalg.norm(load.acceleration))
        if size > WEIGHT:
            yield Finding(("loads", name, "acceleration"), f"gravity of {size:.4g} m/s2: write '{size:.4g} mm/s^2' if mm are meant")


def _material(model: Any, name: str, own: BodyFigures, waves: bool) -> Iterator[Finding]:
    """Density, and the wave speed where masses count, with the unit that would explain them."""
    material = getattr(model, "material", None)
    density = getattr(material or model, "density", None)
    if density is not None and not DENSITIES[0] <= density <= DENSITIES[1]:
        heavy = density * TONNES
        meant = f"is it {heavy:.4g} kg/m3, given in t/mm3?" if DENSITIES[0] <= heavy <= DENSITIES[1] else ""
        text = f"{density:.4g} kg/m3 is outside {DENSITIES[0]:g} to {DENSITIES[1]:g} kg/m3"
        yield Finding(("bodies", name, *(["material"] if material else []), "density"), text, meant)
    if own.wave_speed is not None:
        yield from _wave_speed(("bodies", name, "material" if material else "section"), own.wave_speed, waves)


def _wave_speed(keys: tuple[str, ...], speed: float, waves: bool) -> Iterator[Finding]:
    """A wave speed beyond that of solids, or where masses count of usual ones, with the unit that would explain it."""
    low, high = WAVE_SPEEDS if waves else SOLIDS
    if low <= speed <= high:
        return
    text = f"the wave speed sqrt(E / rho) = {speed:.3g} m/s is outside {low:g} to {high:g} m/s in SI units"
    slips = [unit for unit, factor in SLIPS.items() if USUAL[0] <= speed * math.sqrt(factor) <= USUAL[1]]
    yield Finding(keys, text, f"is {' or '.join(slips)}?" if slips else "are Young's modulus and density right?")


def _sizes(name: str, own: BodyFigures) -> Iterator[Finding]:
    """Mass, length, slenderness, strain and sag under the own weight."""
    key = ("bodies", name)
    if not MASSES[0] <= own.mass <= MASSES[1]:
        yield Finding(
            key, f"the mass {own.mass:.3g} kg is outside {MASSES[0]:g} to {MASSES[1]:g} kg: are density and lengths in SI units?"
        )
    if own.extent > 0.0 and not LENGTHS[0] <= own.extent <= LENGTHS[1]:
        yield Finding(key, f"the size {own.extent:.3g} m is outside {LENGTHS[0]:g} to {LENGTHS[1]:g} m", "is the mesh in metres?")
    if own.slenderness is not None:
        low, high = PLATE_THIN if own.cells is not None and own.cells.place else THIN
        what = "sqrt(area) / thickness" if own.cells is not None and own.cells.place else "length / radius of gyration"
        if own.slenderness < low:
            yield Finding(key, f"{what} = {own.slenderness:.3g} is below {low:g}: so thick a body shears, which its law leaves out")
        if own.slenderness > high:
            yield Finding(key, f"{what} = {own.slenderness:.3g} is above {high:g}", "are section and mesh in metres?")
    if own.weight_strain is not None and own.weight_strain > STRAIN:
        yield Finding(
            key, f"its own weight strains it by {100 * own.weight_strain:.3g} %: are Young's modulus and density in SI units?"
        )
    elif own.sag is not None and own.sag > SAG:
        yield Finding(key, f"as a cantilever it would sag by {own.sag:.3g} times its length: it has hardly any bending stiffness")


def _locking(model: Any, name: str, own: BodyFigures) -> Iterator[Finding]:
    """Quadratic cells of a slender line: errors of 1 % of a bent arc at EA h^2 / EI = 1e4, growing with it."""
    if not isinstance(model, schema.Cable) or model.degree > 2 or own.slenderness is None or own.cells is None:
        return
    ratio = (own.slenderness / own.cells.count) ** 2
    if ratio > LOCKING:
        text = f"quadratic cells with EA h^2 / EI = {ratio:.3g}, above {LOCKING:g}, are too stiff where they curve: take degree 3"
        yield Finding(("bodies", name, "degree"), f"{text}, or {math.ceil(own.slenderness / math.sqrt(LOCKING))} cells")


def _cells(name: str, cells: CellShapes | None) -> Iterator[Finding]:
    """Cells too long, too sharp, too crooked or too different in size."""
    if cells is None:
        return
    where = f" (cell {cells.worst} at {tuple(round(x, 6) for x in cells.place)})" if cells.place else f" (cell {cells.worst})"
    wrong = [
        (cells.aspect > ASPECT, f"an aspect ratio of {cells.aspect:.3g}, above {ASPECT:g}{where}"),
        (cells.angle < ANGLE, f"an angle of {cells.angle:.3g} deg, below {ANGLE:g} deg"),
        (cells.jacobian < JACOBIAN, f"a ratio of Jacobians in one cell of {cells.jacobian:.3g}, below {JACOBIAN:g}"),
        (cells.size_ratio > SIZES, f"sizes that differ by {cells.size_ratio:.3g}, above {SIZES:g}"),
    ]
    for found, text in wrong:
        if found:
            yield Finding(("bodies", name), f"the mesh has {text}: mesh it more evenly for full accuracy")
    if cells.across:
        text = f"{cells.across} of {cells.count} cells reach from edge to edge: "
        remedy = "bent crosswise by Poisson's ratio, one cell is up to 1 % off, take two"
        yield Finding(("bodies", name), text + remedy)
