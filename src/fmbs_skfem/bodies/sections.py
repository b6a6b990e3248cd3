"""Sections and materials of slender bodies: axial stiffness EA [N], bending stiffness EI [N m2],
mass per length rhoA [kg/m].

A beam with torsion and shear takes all of a section, see `BeamSection`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np

from ..core.declared import Declared
from ..core.errors import InputError, require_positive, say
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.fields import Density, Length, quantity

if TYPE_CHECKING:
    from .beams.section_shapes import Outline

#: where a beam's line passes, (y, z) [m]
Offset: TypeAlias = Literal["centroid", "shear_centre"] | tuple[float, float] | None
BEAMS_NEED = "a section whose shape is known, or matrices of stiffness and mass (shape: matrices)"
Pieces: TypeAlias = tuple[tuple[int, ...], ...]
DEFINITE = 1e-12  #: least eigenvalue of a matrix with ones in its diagonal


@dataclass(frozen=True)
@checked
class Material:
    """Linear elastic material."""

    young_modulus: Annotated[float, quantity("Pa", "> 0")]
    density: Density
    poisson_ratio: Annotated[float, quantity("", "> -1", "< 0.5")] = 0.3  #: of plates and shells
    yield_strength: Annotated[
        float | None, quantity("Pa", "> 0"), "for outputs of the type `utilisation`"
    ] = None

    def __post_init__(self) -> None:
        require_positive("material", young_modulus=self.young_modulus, density=self.density)
        if self.yield_strength is not None:
            require_positive("material", yield_strength=self.yield_strength)
        if not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(
                say("material.poisson_ratio", "a number above -1 and up to 0.5", self.poisson_ratio)
            )


@dataclass(frozen=True)
class BeamSection:
    """What a section gives a beam with torsion and shear, in the axes of its directors: x along the
    beam, y and z across.
    """

    #: (6, 6) of N, V_y, V_z, T, M_y, M_z by their strains [N, N m, N m2], or (8, 8) with B and W
    stiffness: np.ndarray
    #: (3, 3) int rho (1, y, z)^T (1, y, z) dA, or (4, 4) of (1, x, y, z) [kg/m, kg, kg m]
    mass: np.ndarray
    radius: float = 0.01  #: of the round beam that it is to others, see `section_shapes` [m]
    outline: tuple[np.ndarray, ...] = ()  #: loops (n, 2) of its contour, where it is known [m]
    #: (3, 6, n), or (3, 8, n), at all its points, see `profiles`
    unit_stresses: np.ndarray = field(default_factory=lambda: np.zeros((3, 6, 0)))
    material: Material | None = None  #: of a section with a contour
    reach: float = 0.0  #: from where it is held, within which its warping dies away [m]

    def __post_init__(self) -> None:
        known = any(_symmetric(self.stiffness, size) for size in (6, 8))
        if not (known and _least(self.stiffness) > DEFINITE):
            raise InputError(
                say(
                    "section.stiffness",
                    "a symmetric 6 x 6 matrix that is positive",
                    self.stiffness.tolist(),
                )
            )
        if not (
            (_symmetric(self.mass, 3) or _symmetric(self.mass, 4))
            and self.mass[0, 0] > 0.0
            and _least(self.mass) > -DEFINITE
        ):
            expected = "a symmetric 3 x 3 or 4 x 4 matrix, a positive mass first, without negative directions"
            raise InputError(say("section.mass", expected, self.mass.tolist()))


def _symmetric(matrix: np.ndarray, size: int) -> bool:
    if matrix.shape != (size, size) or not np.isfinite(matrix).all():
        return False
    root = np.sqrt(np.abs(np.diag(matrix)))
    return bool(np.all(np.abs(matrix - matrix.T) <= 1e-9 * np.outer(root, root)))


def _least(matrix: np.ndarray) -> float:
    """The least eigenvalue with rows and columns scaled to ones in the diagonal, so that no unit
    counts; zero rows give 0.
    """
    size = np.sqrt(np.abs(np.diag(matrix)))
    if ((size == 0.0) & matrix.any(axis=1)).any():
        return -math.inf
    size[size == 0.0] = 1.0
    return float(np.linalg.eigvalsh(matrix / size / size[:, None])[0])


class Section(Declared, ABC):
    """A section of a slender body, see `core.declared`: it gives the stiffnesses and the mass per
    length.

    `bends_alike` says whether a cable in space may have it.
    """

    tag: ClassVar[str] = "shape"
    #: whether it is a shape, which has no stiffness without one
    needs_material: ClassVar[bool] = True
    serves_cables: ClassVar[bool] = True  #: whether cables may have it
    serves_beams: ClassVar[bool] = True  #: whether beams with torsion and shear may

    @property
    def stations(self) -> tuple[float, ...]:
        """Fractions of the length, from 0 to 1, between which it changes smoothly; none of a
        section that does not change.
        """
        return ()

    def at(self, fraction: float) -> Section:
        """The section at a fraction of the length."""
        return self

    @abstractmethod
    def of_cable(self, material: Material | None) -> Given:
        """EA [N], EI [N m2] and rhoA [kg/m] of the section made of a material; InputError where it
        needs one and has none.
        """

    @property
    def bends_alike(self) -> bool:
        """Whether it has the same bending stiffness about all axes, as a cable in space needs."""
        return True

    @property
    def is_skew(self) -> bool:
        """Whether it bends sideways where it bends about y: its product moment of area is not
        zero.
        """
        from .beams import section_shapes

        outline = self.outline()
        if outline is None:
            return False
        inertia = section_shapes.moments(outline)[2]
        return bool(abs(inertia[0, 1]) > 1e-6 * np.sqrt(inertia[0, 0] * inertia[1, 1]))

    def has_fibres(self, dim: int) -> bool:
        """Whether the radius of a cable that has it is where its outermost fibres are, however it
        bends: in space of round ones alone.
        """
        from .beams.section_shapes import Ring

        outline = self.outline()
        return isinstance(outline, Ring) or (outline is not None and dim == 2)

    def outline(self) -> Outline | None:
        """Its contour with axes y and z; None where nobody knows it."""
        return None

    def of_beam(
        self,
        material: Material | None,
        offset: Offset = None,
        pieces: Pieces = (),
        warping: bool = False,
    ) -> BeamSection:
        """All that a beam with torsion and shear needs, its line at the centroid or elsewhere;
        InputError where it is not known.

        A point (y, z) is one of the drawing of the outline [m]; a polygon has `pieces` in its
        contour, see `section_shapes`.
        """
        from .beams import section_constants

        outline: Any = self.outline()
        if pieces:
            outline = replace(outline, pieces=pieces)
        if outline is None:
            raise InputError(say("section", BEAMS_NEED, f"{self}"))
        if material is None:
            raise InputError(
                say(
                    "material",
                    "a Material for a solid section",
                    "nothing",
                    "or give matrices of stiffness and mass",
                )
            )
        origin = offset if isinstance(offset, tuple) else None
        found = section_constants.constants(outline, material.poisson_ratio, origin)
        if offset == "shear_centre":
            drawn = section_constants.constants(outline, material.poisson_ratio, (0.0, 0.0))
            found = section_constants.constants(outline, material.poisson_ratio, drawn.shear_centre)
        stiff = section_constants.warped if warping else section_constants.stiffness
        return BeamSection(
            stiff(found, material.young_modulus),
            section_constants.mass(found, material.density),
            outline.round_as,
            found.outline,
            found.warped_stresses if warping else found.unit_stresses,
            material,
            math.sqrt(2.0 * (1.0 + material.poisson_ratio) * found.fibres[3, 3] / found.torsion),
        )


@dataclass(frozen=True)
@checked
class Circular(Section):
    """Solid circular section (round, rod, wire).

        A = pi d^2/4,    I = pi d^4/64

    {shape: circular, diameter: 10 mm}
    """

    diameter: Length

    def __post_init__(self) -> None:
        require_positive("section", diameter=self.diameter)

    def of_cable(self, material: Material | None) -> Given:
        # a product of floats becomes infinite, a power of one raises
        area = math.pi / 4 * self.diameter * self.diameter
        inertia = area * self.diameter * self.diameter / 16
        return solid(area, inertia, self.diameter / 2, material)

    def outline(self) -> Outline:
        from .beams import section_shapes

        return section_shapes.circle(self.diameter)


@dataclass(frozen=True)
@checked
class Rectangular(Section):
    """Solid rectangular section (square, flat, strip).

        A = w h,    I = w h^3/12

    Of a cable the `height` is in the plane of bending; of a beam it is along z, and the `width`
    along y.

    {shape: rectangular, width: 20 mm, height: 3 mm}
    """

    width: Length
    height: Length

    def __post_init__(self) -> None:
        require_positive("section", width=self.width, height=self.height)

    @property
    def bends_alike(self) -> bool:
        return math.isclose(self.width, self.height, rel_tol=1e-9)

    def of_cable(self, material: Material | None) -> Given:
        area = self.width * self.height
        inertia = area * self.height * self.height / 12
        return solid(area, inertia, self.height / 2, material)

    def outline(self) -> Outline:
        from .beams import section_shapes

        return section_shapes.rectangle(self.width, self.height)


@dataclass(frozen=True)
@checked
class Given(Section):
    """Stiffnesses and mass per length of a cable given directly; a material is not needed.

    {shape: given, EA: 20 kN, EI: 5 mN m^2, rhoA: 50 g/m}
    """

    needs_material: ClassVar[bool] = False
    serves_beams: ClassVar[bool] = False

    EA: Annotated[float, quantity("N", "> 0")]
    EI: Annotated[float, quantity("N m^2", "> 0")]
    rhoA: Annotated[float, quantity("kg/m", "> 0")]
    radius: Annotated[float, quantity("m", "> 0"), "as it is drawn, and touches others"] = 0.01

    def __post_init__(self) -> None:
        require_positive("section", EA=self.EA, EI=self.EI, rhoA=self.rhoA, radius=self.radius)

    def of_cable(self, material: Material | None) -> Given:
        return self


def solid(area: float, inertia: float, radius: float, material: Material | None) -> Given:
    """EA, EI and rhoA of an area [m2] with a second moment [m4], made of a material; InputError
    without one.
    """
    if material is None:
        raise InputError(
            say("material", "a Material for a solid section", "nothing", "or give EA, EI and rhoA")
        )
    return Given(
        material.young_modulus * area,
        material.young_modulus * inertia,
        material.density * area,
        radius,
    )
