"""Sections and materials of slender bodies: axial stiffness EA [N], bending stiffness EI [N m2], mass per length rhoA [kg/m]."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import singledispatch

from ..core.errors import InputError, say


def positive(where: str, **values: float) -> None:
    """Refuse values that are not finite and positive."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise InputError(say(f"{where}.{name}", "a positive and finite number", value))


@dataclass(frozen=True)
class Material:
    """Linear elastic material."""

    young_modulus: float  #: E [Pa]
    density: float  #: rho [kg/m3]
    poisson_ratio: float = 0.3  #: nu [-], of plates and shells

    def __post_init__(self) -> None:
        positive("material", young_modulus=self.young_modulus, density=self.density)
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(say("material.poisson_ratio", "a number above -1 and up to 0.5", self.poisson_ratio))


@dataclass(frozen=True)
class Circular:
    """Solid circular section, A = pi d^2/4, I = pi d^4/64."""

    diameter: float  #: d [m]

    def __post_init__(self) -> None:
        positive("section", diameter=self.diameter)


@dataclass(frozen=True)
class Rectangular:
    """Rectangular section bent about the axis along its width, A = w h, I = w h^3/12."""

    width: float  #: w [m]
    height: float  #: h, in the plane of bending [m]

    def __post_init__(self) -> None:
        positive("section", width=self.width, height=self.height)


@dataclass(frozen=True)
class Given:
    """Section stiffnesses given directly; a material is not needed."""

    EA: float  #: axial stiffness [N]
    EI: float  #: bending stiffness [N m2]
    rhoA: float  #: mass per length [kg/m]
    radius: float = 0.01  #: drawn radius [m]

    def __post_init__(self) -> None:
        positive("section", EA=self.EA, EI=self.EI, rhoA=self.rhoA, radius=self.radius)


@singledispatch
def bends_alike(section: object) -> bool:
    """Whether a section has the same bending stiffness about all axes, as a cable in space needs; a rule where it may not."""
    return True


@bends_alike.register
def _(section: Rectangular) -> bool:
    return math.isclose(section.width, section.height, rel_tol=1e-9)


@singledispatch
def stiffness(section: object, material: Material | None) -> Given:
    """EA, EI and rhoA of a section made of a material; a rule for every section type."""
    raise InputError(say("section", "Circular, Rectangular or Given", type(section).__name__))


@stiffness.register
def _(section: Given, material: Material | None) -> Given:
    return section


@stiffness.register
def _(section: Circular, material: Material | None) -> Given:
    area = math.pi / 4 * section.diameter * section.diameter  # a product of floats becomes infinite, a power of one raises
    inertia = area * section.diameter * section.diameter / 16
    return _solid(area, inertia, section.diameter / 2, material)


@stiffness.register
def _(section: Rectangular, material: Material | None) -> Given:
    area = section.width * section.height
    inertia = area * section.height * section.height / 12
    return _solid(area, inertia, section.height / 2, material)


def _solid(area: float, inertia: float, radius: float, material: Material | None) -> Given:
    if material is None:
        raise InputError(say("material", "a Material for a solid section", "nothing", "or give EA, EI and rhoA"))
    return Given(material.young_modulus * area, material.young_modulus * inertia, material.density * area, radius)
