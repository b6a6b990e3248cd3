"""Sections that are drawn by their outline, see `section_shapes` for the axes and the origin of
each drawing.

A cable in the plane bends about the y axis of its section, z in the plane of bending: EI = E int
z^2 dA about the centroid.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Annotated, ClassVar

import numpy as np

from ...core.storage.records import dataclass
from ...core.values import units
from ...core.values.arguments import checked
from ...core.values.fields import (
    Context,
    Length,
    Takes,
    array_schema,
    number_schema,
    quantity,
    read_quantity,
)
from ...core.values.mappings import list_of
from ...core.values.problems import Problem, shown
from ..sections import Given, Material, Section, solid
from . import section_shapes
from .section_shapes import Outline, Point

ALIKE = 1e-9  #: relative difference of second moments of area that are the same


def read_point(value: object, context: Context) -> Point:
    """A point (y, z) of a drawing [m]."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise Problem("a point [y, z] of the section, two lengths", shown(value))
    y, z = (read_quantity(one, units.LENGTH, context) for one in value)
    return y, z


_POINT = array_schema(number_schema(units.LENGTH), 2, 2) | {
    "description": "a point [y, z] of the section"
}
POINT = Takes(read_point, _POINT)
LOOP = list_of(POINT, tuple)


class Drawn(Section, ABC):
    """A section that is known by its outline."""

    @abstractmethod
    def outline(self) -> Outline:
        """Its contour with axes y and z."""

    def __post_init__(self) -> None:
        self.outline()

    def of_cable(self, material: Material | None) -> Given:
        outline = self.outline()
        area, centroid, inertia = section_shapes.moments(outline)
        points = (
            outline.radii[1] * section_shapes.unit_circle()
            if isinstance(outline, section_shapes.Ring)
            else outline.loops[0]
        )
        return solid(
            area, float(inertia[1, 1]), float(np.abs(points[:, 1] - centroid[1]).max()), material
        )

    @property
    def bends_alike(self) -> bool:
        _, _, inertia = section_shapes.moments(self.outline())
        return bool(np.abs(inertia - inertia[0, 0] * np.eye(2)).max() <= ALIKE * inertia[0, 0])


@dataclass(frozen=True)
@checked
class Tube(Drawn):
    """A tube (pipe, ring, hollow shaft).

    {shape: tube, diameter: 30 mm, wall: 2 mm}
    """

    diameter: Annotated[Length, "outer diameter"]
    wall: Length

    def outline(self) -> Outline:
        return section_shapes.tube(self.diameter, self.wall)


@dataclass(frozen=True)
class Walled(Drawn, ABC):
    """A section of walls along y and z."""

    width: Length
    height: Length
    web: Annotated[Length, "thickness of what stands along z"]
    flange: Annotated[Length, "thickness of what lies along y"]
    #: its outline of width, height, web and flange
    draw: ClassVar[Callable[[float, float, float, float], Outline]]

    def outline(self) -> Outline:
        return type(self).draw(self.width, self.height, self.web, self.flange)


@dataclass(frozen=True)
@checked
class ISection(Walled, word="i_section"):
    """An I (H, i_beam, double tee, IPE, HEA, W): two flanges of a `width` along y at the ends of a
    web along z, centred.

    {shape: i_section, width: 100 mm, height: 200 mm, web: 6 mm, flange: 9 mm}
    """

    draw = section_shapes.i_shape


@dataclass(frozen=True)
@checked
class CSection(Walled, word="c_section"):
    """A C (channel, U, UPN): a web along z with its back at y = 0, two flanges of a `width` along
    y, z = 0 midway.

    {shape: c_section, width: 50 mm, height: 100 mm, web: 5 mm, flange: 8 mm}
    """

    draw = section_shapes.c_shape


@dataclass(frozen=True)
@checked
class LSection(Walled, word="l_section"):
    """An L (angle): a leg of a `width` along y, `flange` thick, and one of a `height` along z,
    `web` thick, from the origin.

    {shape: l_section, width: 40 mm, height: 60 mm, web: 5 mm, flange: 5 mm}
    """

    draw = section_shapes.l_shape


@dataclass(frozen=True)
@checked
class TSection(Walled, word="t_section"):
    """A T (tee): a flange of a `width` along y on top of a web along z, whose foot is the origin.

    {shape: t_section, width: 60 mm, height: 80 mm, web: 6 mm, flange: 8 mm}
    """

    draw = section_shapes.t_shape


@dataclass(frozen=True)
@checked
class ZSection(Walled, word="z_section"):
    """A Z (zed): a web along z with a flange along y at its top and one along -y at its bottom, each
    of a `width` from the outer face of the web, centred.

    {shape: z_section, width: 60 mm, height: 120 mm, web: 5 mm, flange: 5 mm}
    """

    draw = section_shapes.z_shape


@dataclass(frozen=True)
@checked
class BoxSection(Walled, word="box"):
    """A box (rectangular hollow, box girder): two webs along z and two flanges along y, centred.

    {shape: box, width: 60 mm, height: 100 mm, web: 4 mm, flange: 6 mm}
    """

    draw = section_shapes.hollow


@dataclass(frozen=True)
@checked
class Hollow(Drawn):
    """A rectangular tube (hollow section, RHS, SHS) of a `width` along y and a `height` along z,
    centred; its corners have a `radius` outside, less the wall inside.

    {shape: hollow, width: 60 mm, height: 40 mm, wall: 3 mm, radius: 6 mm}
    """

    width: Length
    height: Length
    wall: Length
    radius: Annotated[float, quantity("m", ">= 0"), "of the corners outside"] = 0.0

    def outline(self) -> Outline:
        inner = max(self.radius - self.wall, 0.0)
        sizes = self.width, self.height, self.wall, self.wall
        return section_shapes.hollow(*sizes, self.radius, inner)


@dataclass(frozen=True)
@checked
class PolygonSection(Drawn, word="polygon"):
    """Any polygon (box, T, Z, hexagon, triangle) of points [y, z], in either direction, with holes.

    {shape: polygon, points: [[-20 mm, -10 mm], [20 mm, -10 mm], [20 mm, 10 mm], [-20 mm, 10 mm]]}
    """

    points: Annotated[tuple[Point, ...], LOOP, "three or more points [y, z]"]
    holes: Annotated[
        tuple[tuple[Point, ...], ...], list_of(LOOP, tuple), "each a list of points"
    ] = ()

    def outline(self) -> Outline:
        return section_shapes.Polygon(self.points, self.holes)
