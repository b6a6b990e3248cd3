"""Sections and materials of slender bodies: axial stiffness EA [N], bending stiffness EI [N m2], mass per length rhoA [kg/m]."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, ClassVar

from ..core.declared import Declared
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.fields import Density, Length, quantity


def positive(where: str, **values: float) -> None:
    """Refuse values that are not finite and positive: InputError with the place `where` and the name of the value."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise InputError(say(f"{where}.{name}", "a positive and finite number", value))


@dataclass(frozen=True)
class Material:
    """Linear elastic material."""

    young_modulus: Annotated[float, quantity("Pa", "> 0")]
    density: Density
    poisson_ratio: Annotated[float, quantity("", "> -1", "< 0.5")] = 0.3  #: of plates and shells

    def __post_init__(self) -> None:
        positive("material", young_modulus=self.young_modulus, density=self.density)
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(say("material.poisson_ratio", "a number above -1 and up to 0.5", self.poisson_ratio))


class Section(Declared, ABC):
    """A section of a slender body, see `core.declared`: it gives the stiffnesses and the mass per length.

    `bends_alike` says whether a cable in space may have it.
    """

    tag: ClassVar[str] = "shape"

    @abstractmethod
    def stiffness(self, material: Material | None) -> Given:
        """EA [N], EI [N m2] and rhoA [kg/m] of the section made of a material; InputError where it needs one and has none."""

    @property
    def bends_alike(self) -> bool:
        """Whether it has the same bending stiffness about all axes, as a cable in space needs."""
        return True


@dataclass(frozen=True)
class Circular(Section):
    """Solid circular section, A = pi d^2/4, I = pi d^4/64.

    {shape: circular, diameter: 10 mm}
    """

    diameter: Length

    def __post_init__(self) -> None:
        positive("section", diameter=self.diameter)

    def stiffness(self, material: Material | None) -> Given:
        area = math.pi / 4 * self.diameter * self.diameter  # a product of floats becomes infinite, a power of one raises
        inertia = area * self.diameter * self.diameter / 16
        return _solid(area, inertia, self.diameter / 2, material)


@dataclass(frozen=True)
class Rectangular(Section):
    """Solid rectangular section, `height` in the plane of bending: A = w h, I = w h^3/12.

    {shape: rectangular, width: 20 mm, height: 3 mm}
    """

    width: Length
    height: Length

    def __post_init__(self) -> None:
        positive("section", width=self.width, height=self.height)

    @property
    def bends_alike(self) -> bool:
        return math.isclose(self.width, self.height, rel_tol=1e-9)

    def stiffness(self, material: Material | None) -> Given:
        area = self.width * self.height
        inertia = area * self.height * self.height / 12
        return _solid(area, inertia, self.height / 2, material)


@dataclass(frozen=True)
class Given(Section):
    """Stiffnesses and mass per length given directly; a material is not needed.

    {shape: given, EA: 20 kN, EI: 5 mN m^2, rhoA: 50 g/m}
    """

    EA: Annotated[float, quantity("N", "> 0")]
    EI: Annotated[float, quantity("N m^2", "> 0")]
    rhoA: Annotated[float, quantity("kg/m", "> 0")]
    radius: Annotated[float, quantity("m", "> 0"), "as it is drawn, and touches others"] = 0.01

    def __post_init__(self) -> None:
        positive("section", EA=self.EA, EI=self.EI, rhoA=self.rhoA, radius=self.radius)

    def stiffness(self, material: Material | None) -> Given:
        return self


def _solid(area: float, inertia: float, radius: float, material: Material | None) -> Given:
    if material is None:
        raise InputError(say("material", "a Material for a solid section", "nothing", "or give EA, EI and rhoA"))
    return Given(material.young_modulus * area, material.young_modulus * inertia, material.density * area, radius)
