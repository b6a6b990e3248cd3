r"""Numbers of a scene that are allowed but hardly meant: units, sizes, masses, slenderness, sag
under weight, shapes of cells.

    wave speed     sqrt(E / rho),  of given sections sqrt(EA / rhoA)             50 to 20 000 m/s where masses count
    slenderness    L / i,  i = sqrt(EI / EA);   sqrt(area) / t of plates         thin enough for laws without shear
    sag            w L^4 / (8 EI) of the cantilever of that length, strain w L / EA under its weight (W. C. Young, R. G. Budynas,
                   Roark's Formulas for Stress and Strain, 7th ed., McGraw-Hill 2002, table 8.1)

A slip of units changes these by factors of 1e3 to 1e12; the bounds are far from what is built.
Nothing here stops a scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..bodies.body import Body, extent
from ..bodies.rigid import CENTERED
from ..core.storage.records import dataclass
from ..shapes.solids.solid import Solid
from ..systems.forces.loads import Gravity
from .figures import BodyFigures, CellShapes

if TYPE_CHECKING:
    from .schema import Scene

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
#: of cells: largest, smallest [deg], smallest, largest
ASPECT, ANGLE, JACOBIAN, SIZES = (
    20.0,
    15.0,
    0.1,
    1e3,
)
RATIO = 1e4  #: of the largest body over the smallest
#: size [m], also over the thickness, from which a file without a unit may be one in mm
LARGE, THINNEST = (
    50.0,
    5e3,
)
TONNES = 1e12  #: 1 t/mm3 in kg/m3
OF_FILE = "is the file in N, s and the `unit` of the body?"
USUAL = (300.0, 1.5e4)  #: wave speeds of most solids [m/s]
SLIPS = {  #: what may have been meant, and the factor it puts on E / rho
    "Young's modulus given in MPa": 1e6,
    "Young's modulus given in GPa": 1e9,
    "the density given in g/cm3": 1e-3,
    "the density given in t/mm3": 1e-12,
    "the scene given in t, mm and MPa": 1e-6,
}


@dataclass(frozen=True)
class Finding:
    """Something hardly meant, at a path of keys of the scene."""

    keys: tuple[str, ...]
    text: str
    meant: str = ""  #: a question that names what would explain it

    def __str__(self) -> str:
        return f"{self.text}: {self.meant}" if self.meant else self.text


def figures(scene: Scene, parts: Mapping[str, Body]) -> dict[str, BodyFigures]:
    """The figures of every body of a scene, with the bodies made of it."""
    gravity = float(
        np.linalg.norm(
            sum((np.array(load.acceleration) for load in weights(scene).values()), np.zeros(1))
        )
    )
    return {name: model.figures(parts[name], gravity) for name, model in scene.bodies.items()}


def weights(scene: Scene) -> dict[str, Gravity]:
    """The gravity loads of a scene."""
    return {name: load for name, load in scene.loads.items() if isinstance(load, Gravity)}


def of_text(scene: Scene) -> Iterator[Finding]:
    """What needs no mesh: wave speeds of the materials of a scene, and its weights."""
    yield from gravities(scene)
    for name, body in scene.bodies.items():
        if (material := getattr(body, "material", None)) is not None:
            speed = math.sqrt(material.young_modulus / material.density)
            yield from _wave_speed(("bodies", name, "material"), speed, moving(scene))


def gravities(scene: Scene) -> Iterator[Finding]:
    """Weights of a size that no place has."""
    for name, load in weights(scene).items():
        size = float(np.linalg.norm(load.acceleration))
        if size > WEIGHT:
            text = f"gravity of {size:.4g} m/s2: write '{size:.4g} mm/s^2' if mm are meant"
            yield Finding(("loads", name, "acceleration"), text)


def moving(scene: Scene) -> bool:
    """Whether masses count: something moves, or weighs."""
    return scene.analysis.masses or bool(weights(scene))


def findings(scene: Scene, known: Mapping[str, BodyFigures]) -> Iterator[Finding]:
    """What is hardly meant, in the order of the scene."""
    waves = moving(scene)
    for name, own in known.items():
        if not has_material_of_file(scene.bodies[name]):  # told when the body is made
            yield from _material(scene.bodies[name], name, own.wave_speed, waves)
        yield from _sizes(name, own)
        yield from _locking(name, own)
        yield from _cells(name, own.cells)
    sizes = sorted((own.extent, name) for name, own in known.items() if own.extent > 0.0)
    if sizes and sizes[-1][0] > RATIO * sizes[0][0]:
        (least, small), (most, large) = sizes[0], sizes[-1]
        yield Finding(
            ("bodies", small),
            f"'{large}' is {most / least:.3g} times as large as '{small}': are both meshes in metres?",
        )


def file_unit(scene: Scene, name: str, part: Body) -> Finding | None:
    """A body as large and thin as those whose file is in mm, where the scene does not say in which
    unit it is.
    """
    model = scene.bodies[name]
    size = extent(part)
    section = getattr(model, "section", None)
    drawn = 0.0 if section is not None and not section.needs_material else 2.0 * part.radius
    thickness = float(np.mean(part.thickness)) or getattr(model, "thickness", drawn)
    silent = hasattr(model, "unit") and not said(scene, "bodies", name, "unit")
    is_solid = isinstance(part.space, Solid)
    if not silent or not (thickness or is_solid) or size < max(LARGE, THINNEST * thickness):
        return None
    text = f"its size is {size:.4g} m"
    if not is_solid:
        text = f"{text}, {size / thickness:.2g} times its thickness"
    return Finding(
        ("bodies", name),
        text,
        "is the file in mm? write unit: mm, or unit: m where it is in metres",
    )


def file_material(scene: Scene, name: str, part: Body) -> Finding | None:
    """Density and wave speed of a solid whose material is that of its file, as of materials that a
    scene states.
    """
    model: Any = scene.bodies[name]
    if not has_material_of_file(model):
        return None
    material = model.material_of(f"body '{name}'", part.space)
    speed = math.sqrt(material.young_modulus / material.density)
    keys = ("bodies", name, "mesh")
    found = [*_density(keys, material.density), *_wave_speed(keys, speed, moving(scene))]
    return replace(found[0], meant=OF_FILE) if found else None


def has_material_of_file(model: Any) -> bool:
    """Whether a body of a scene takes the material of its mesh."""
    return hasattr(model, "material_of") and model.material is None and model.orthotropic is None


def without_center(scene: Scene, name: str, part: Body) -> Finding | None:
    """A body that moves and turns at the start about the origin of the scene for want of a center,
    and is not centred there.
    """
    motion = scene.initial.bodies.get(name)
    if (
        motion is None
        or motion.center is not None
        or not (np.any(motion.velocity) and np.any(motion.angular_velocity))
    ):
        return None
    shares = part.mass @ part.constant
    if np.linalg.norm(shares @ part.reference) <= CENTERED * extent(part) * (
        shares @ part.constant
    ):
        return None
    text = "the velocity is that of the body's point at the origin of the scene, and turning adds to it elsewhere"
    return Finding(
        ("initial", "bodies", name), f"{text}; write `center`, the point that has the velocity"
    )


def said(scene: Scene, *keys: str) -> bool:
    """Whether a path of keys stands in the file of a scene."""
    node = scene.node
    for key in keys:
        if node is None or not isinstance(node.value, dict):
            return False
        node = node.value.get(key)
    return node is not None


def _material(model: Any, name: str, speed: float | None, waves: bool) -> Iterator[Finding]:
    """Density, and the wave speed [m/s] where masses count, with the unit that would explain them."""
    material = getattr(model, "material", None)
    keys = ("bodies", name, *(["material"] if material else []))
    density = getattr(material or model, "density", None)
    if density is not None:
        yield from _density((*keys, "density"), density)
    if speed is not None:
        yield from _wave_speed(keys if material else (*keys, "section"), speed, waves)


def _density(keys: tuple[str, ...], density: float) -> Iterator[Finding]:
    """A density [kg/m3] beyond that of solids."""
    low, high = DENSITIES
    if not low <= density <= high:
        heavy = density * TONNES
        meant = f"is it {heavy:.4g} kg/m3, given in t/mm3?" if low <= heavy <= high else ""
        yield Finding(keys, f"{density:.4g} kg/m3 is outside {low:g} to {high:g} kg/m3", meant)


def _wave_speed(keys: tuple[str, ...], speed: float, waves: bool) -> Iterator[Finding]:
    """A wave speed beyond that of solids, or where masses count of usual ones, with the unit that
    would explain it.
    """
    low, high = WAVE_SPEEDS if waves else SOLIDS
    if low <= speed <= high:
        return
    text = f"the wave speed sqrt(E / rho) = {speed:.3g} m/s is outside {low:g} to {high:g} m/s in SI units"
    slips = [
        unit for unit, factor in SLIPS.items() if USUAL[0] <= speed * math.sqrt(factor) <= USUAL[1]
    ]
    yield Finding(
        keys,
        text,
        f"is {' or '.join(slips)}?" if slips else "are Young's modulus and density right?",
    )


def _sizes(name: str, own: BodyFigures) -> Iterator[Finding]:
    """Mass, length, slenderness, strain and sag under the own weight."""
    key = ("bodies", name)
    if not MASSES[0] <= own.mass <= MASSES[1]:
        yield Finding(
            key,
            f"the mass {own.mass:.3g} kg is outside {MASSES[0]:g} to {MASSES[1]:g} kg: are density and lengths in SI units?",
        )
    if own.extent > 0.0 and not LENGTHS[0] <= own.extent <= LENGTHS[1]:
        yield Finding(
            key,
            f"the size {own.extent:.3g} m is outside {LENGTHS[0]:g} to {LENGTHS[1]:g} m",
            "is the mesh in metres? if it is in mm: unit: mm",
        )
    if own.slenderness is not None:
        low, high = PLATE_THIN if own.cells is not None and own.cells.place else THIN
        what = (
            "sqrt(area) / thickness"
            if own.cells is not None and own.cells.place
            else "length / radius of gyration"
        )
        if own.slenderness < low:
            yield Finding(
                key,
                f"{what} = {own.slenderness:.3g} is below {low:g}: so thick a body shears, which its law leaves out",
            )
        if own.slenderness > high:
            yield Finding(
                key,
                f"{what} = {own.slenderness:.3g} is above {high:g}",
                "are section and mesh in metres?",
            )
    if own.weight_strain is not None and own.weight_strain > STRAIN:
        yield Finding(
            key,
            f"its own weight strains it by {100 * own.weight_strain:.3g} %: are Young's modulus and density in SI units?",
        )
    elif own.sag is not None and own.sag > SAG:
        yield Finding(
            key,
            f"as a cantilever it would sag by {own.sag:.3g} times its length: it has hardly any bending stiffness",
        )


def _locking(name: str, own: BodyFigures) -> Iterator[Finding]:
    """Quadratic cells of a slender line: errors of 1 % of a bent arc at EA h^2 / EI = 1e4, growing
    with it.
    """
    if own.degree != 2 or own.slenderness is None or own.cells is None:
        return
    ratio = (own.slenderness / own.cells.count) ** 2
    if ratio > LOCKING:
        text = f"quadratic cells with EA h^2 / EI = {ratio:.3g}, above {LOCKING:g}, are too stiff where they curve: take degree 3"
        yield Finding(
            ("bodies", name, "degree"),
            f"{text}, or {math.ceil(own.slenderness / math.sqrt(LOCKING))} cells",
        )


def _cells(name: str, cells: CellShapes | None) -> Iterator[Finding]:
    """Cells too long, too sharp, too crooked or too different in size."""
    if cells is None:
        return
    where = (
        f" (cell {cells.worst} at {tuple(round(x, 6) for x in cells.place)})"
        if cells.place
        else f" (cell {cells.worst})"
    )
    wrong = [
        (cells.aspect > ASPECT, f"an aspect ratio of {cells.aspect:.3g}, above {ASPECT:g}{where}"),
        (cells.angle < ANGLE, f"an angle of {cells.angle:.3g} deg, below {ANGLE:g} deg"),
        (
            cells.jacobian < JACOBIAN,
            f"a ratio of Jacobians in one cell of {cells.jacobian:.3g}, below {JACOBIAN:g}",
        ),
        (cells.size_ratio > SIZES, f"sizes that differ by {cells.size_ratio:.3g}, above {SIZES:g}"),
    ]
    for found, text in wrong:
        if found:
            yield Finding(("bodies", name), f"the mesh has {text}: {cells.remedy}")
    if cells.across:
        text = f"{cells.across} of {cells.count} cells reach from edge to edge: "
        remedy = "bent crosswise by Poisson's ratio, one cell is up to 5 % off, two are 1.5 %, take two or more"
        yield Finding(("bodies", name), text + remedy)
