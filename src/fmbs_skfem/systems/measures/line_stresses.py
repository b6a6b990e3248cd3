r"""Stresses at the contour of a section at places of beams and cables, as outputs.

    beams       Saint-Venant's, linear in the section forces                       (`beam_sections`)
    cables      N/A +- M c/I in the outermost fibres, c away from the line         (`cable_sections`)

A cable in the plane has the fibre farthest from the line on both of its sides; in space it has one
bending stiffness, and stresses where its section is round.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from scipy.sparse import csr_array

from ...bodies.beams.section_constants import von_mises
from ...bodies.body import Body
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...shapes import line
from .. import fields
from ..places import At, Draft
from ..system import Output
from . import beam_sections, cable_sections
from .cable_sections import CableSections
from .probes import Probe, Sensed, Sizes
from .surface_points import counts, recovered, surface_point

OF_BEAM = ("max", "min", "shear", "von_mises")
OF_CABLE = ("max", "min", "von_mises")
OF_POINT = ("normal", "shear", "von_mises")
PLACES = 101  #: of a line among which the highest stress is sought, at most
STATES = 500  #: whose stresses are found at a time


def with_fibres(
    where: str, part: Body, xi: np.ndarray
) -> tuple[csr_array, tuple[float, ...], tuple[str, ...]]:
    """Rows on the functions of a line at parameters (x,), the numbers that make stresses of them,
    and the words of these; InputError where its contour is not known.
    """
    if part.directors is not None:
        profile = beam_sections.contour(where, part)
        unit = profile.at(xi if profile.degree else xi[:1])[2]
        functionals = unit.transpose(0, 1, 3, 2).reshape(len(unit), -1, unit.shape[2])
        own = functionals if profile.degree else functionals[0]
        return *beam_sections.beam_point(part, xi, own), OF_BEAM
    rows, numbers = cable_sections.sections(part, xi)
    if not numbers.fibres.size:
        expected = "a section with a shape and a material" + (", round in space" * (part.dim == 3))
        remedy = "or take type: beam, whose section has its axes" if part.dim == 3 else ""
        raise InputError(say(where, expected, f"that of '{part.name}'", remedy))
    return rows, numbers.numbers, OF_CABLE


def place_on(where: str, part: Body, at: At) -> np.ndarray:
    """The parameter (1,) of a place of a beam or cable; InputError where it knows no stresses
    there.
    """
    of = beam_sections if part.directors is not None else cable_sections
    return np.array([of.place_of(where, part, at)])


def along(where: str, part: Body) -> np.ndarray:
    """Parameters (x,) of the ends and middles of the cells of a line, `PLACES` at most; InputError
    where it knows no stresses there.
    """
    place_on(where, part, At(part.name, 0.0))
    breaks = line.breaks(part.space)
    many = min(2 * len(breaks) - 1, PLACES)
    return np.interp(np.linspace(0, len(breaks) - 1, many), np.arange(len(breaks)), breaks)


def extremes(numbers: tuple[float, ...], u: np.ndarray) -> list[np.ndarray]:
    """Stresses (s, x) of a line by the words of `with_fibres`, of its numbers and rows u (s, r)."""
    of = of_contours if beam_sections.reads_beam(numbers) else of_fibres
    # those of all points at all instants may be many
    blocks = [of(numbers, u[k : k + STATES]) for k in range(0, len(u), STATES)]
    return [np.concatenate(parts) for parts in zip(*blocks, strict=True)]


def of_fibres(numbers: tuple[float, ...], u: np.ndarray) -> list[np.ndarray]:
    """Highest, lowest and von Mises stress (s, x) of a cable."""
    found = CableSections.of(numbers)
    mean, bent = found.stresses(*found.read(u)[:2])
    return [mean + bent, mean - bent, np.abs(mean) + bent]


def of_contours(numbers: tuple[float, ...], u: np.ndarray) -> list[np.ndarray]:
    """Highest and lowest normal stress, largest shear and von Mises stress (s, x), at the contours
    of a beam.
    """
    functionals = beam_sections.read_places(numbers, u)[2]
    normal, along, across = functionals.reshape(3, -1, *functionals.shape[1:])
    # squares, and roots of the largest alone: a third of the time
    shear = along**2 + across**2
    most = (normal**2 + 3.0 * shear).max(axis=0)
    return [normal.max(axis=0), normal.min(axis=0), np.sqrt(shear.max(axis=0)), np.sqrt(most)]


class LineStresses(Probe, ABC):
    """What has stresses of a line."""

    unit: ClassVar[str] = "Pa"
    calls = ()

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        if beam_sections.reads_beam(output.parameters):
            columns = len(output.columns) if len(output.columns) == 3 else 4
            return beam_sections.rows_of(output.parameters, dim), columns, None
        if cable_sections.reads_cable(output.parameters):
            return dim * CableSections.of(output.parameters).rows, len(OF_CABLE), None
        rows, parameters = counts(output.parameters[0], dim)
        return rows, 2, parameters


@dataclass(frozen=True)
class Stress(LineStresses):
    """Stresses [Pa]: of von Mises at a named point of a plate or shell, or at the contour of the
    section of a beam or cable.

    Of plates and shells on the faces at -t/2 and t/2 along the normal, in NAME_bottom and NAME_top.
    Of beams with torsion the highest and the lowest stress along the beam at the contour, NAME_max
    and NAME_min, the largest shear stress NAME_shear and the largest of von Mises, NAME_von_mises;
    with a `point`, its y and z in the section, NAME_normal, NAME_shear and NAME_von_mises there,
    with the shear stress along the contour, anticlockwise about the beam. They are Saint-Venant's,
    of the section forces at the place, with warping free, or with the stress of the bimoment along a
    beam with `warping`, but without the shear stress of its change; corners that point inwards,
    where shear stresses have no bound, have those of their neighbours. Cables have NAME_max, NAME_min and
    NAME_von_mises of N/A +- M c/I, c the distance of the fibre farthest from the line, as both sides
    have it.

    {type: stress, at: plate.corner}
    """

    at: fields.Stressed
    point: Annotated[
        fields.InSection | None, "y and z in the section of a beam, a point of its contour"
    ] = None

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        part = draft.layout.body(where, self.at)
        if part.directors is None and self.point is not None:
            raise InputError(
                say(f"{where}.point", "a place of a beam (type: beam)", f"{self.at}", "delete it")
            )
        if not isinstance(part.space, line.BSpline | line.Hermite):
            point = surface_point(where, draft, self.at)
            return self.output(
                draft, (f"{name}_bottom", f"{name}_top"), [point.rows], **point.facts(self.at.body)
            )
        xi = place_on(where, part, self.at)
        if self.point is None:
            rows, parameters, words = with_fibres(where, part, xi)
        else:
            profile = beam_sections.contour(where, part)
            found = beam_sections.contour_point(where, profile, xi[0], self.point).stresses
            own = np.concatenate([found, 0.0 * found[:1]])
            rows, parameters = beam_sections.beam_point(part, xi, own)
            words = OF_POINT
        columns = tuple(f"{name}_{word}" for word in words)
        return self.output(draft, columns, [draft.layout.spread(part, rows)], parameters=parameters)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        beam = beam_sections.reads_beam(output.parameters)
        if not beam and not cable_sections.reads_cable(output.parameters):
            return list(recovered(output.parameters, sensed.values).von_mises)
        if beam and len(output.columns) == len(OF_POINT):
            stress = beam_sections.read_places(output.parameters, sensed.values)[2][..., 0]
            return [*stress[:2], von_mises(stress)]
        return [one[:, 0] for one in extremes(output.parameters, sensed.values)]


@dataclass(frozen=True)
class HighestStress(LineStresses):
    """Highest and lowest stress [Pa] along a beam or cable, among all places of its line.

    NAME_max, NAME_min, of beams NAME_shear, and NAME_von_mises, as of the output `stress`, each
    wherever it is largest or smallest: at the ends and in the middle of cells, at up to 101 places.

    {type: highest_stress, of: crank}
    """

    of: fields.BodyName

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        part = draft.layout.body(where, At(self.of))
        if not isinstance(part.space, line.BSpline | line.Hermite):
            expected = "a beam or cable"
            raise InputError(
                say(f"{where}.of", expected, f"'{self.of}'", "take `stress` at a place of it")
            )
        xi = along(where, part)
        rows, parameters, words = with_fibres(where, part, xi)
        columns = tuple(f"{name}_{word}" for word in words)
        return self.output(draft, columns, [draft.layout.spread(part, rows)], parameters=parameters)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        highest, lowest, *rest = extremes(output.parameters, sensed.values)
        return [highest.max(axis=1), lowest.min(axis=1), *(one.max(axis=1) for one in rest)]
