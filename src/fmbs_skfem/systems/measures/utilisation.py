r"""How much of the yield strength R of a material its stresses take.

    u = max sigma_v / R,    sigma_v^2 = ((xx - yy)^2 + (yy - zz)^2 + (zz - xx)^2)/2 + 3 (xy^2 + yz^2 + zx^2)

R. von Mises, Nachr. Ges. Wiss. Goettingen (1913) 582-592.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...bodies import laws
from ...bodies.body import Body
from ...bodies.stress_recovery import recover
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from ...shapes import line
from ...shapes.solids.solid import Solid
from ...shapes.surface import VERTICES
from .. import fields
from ..connections import edges
from ..places import At, Draft
from ..system import Output
from . import beam_sections, cable_sections, line_stresses, solid_points, surface_points
from .probes import Probe, Sensed


@dataclass(frozen=True)
class Utilisation(Probe):
    """Largest von Mises stress over the yield strength of the material [-], `at` a place or `of` a
    body: from 1 on it yields, which the motion does not know.

    At a place it is the largest of both faces of a plate or shell, of the contour of the section of a
    beam or cable, or of nodes of a solid: faces, a set or a point. Of a body it is the largest at the
    ends and middles of the cells of a beam or cable, at the corners of those of a plate or shell, at all
    nodes of a solid. It grows with every refinement where stresses have no bound, as at corners
    that point inwards and at edges of rims.

    {type: utilisation, of: arm}
    """

    at: fields.Stressed | None = None
    of: fields.BodyName | None = None
    calls = ()

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if (self.at is None) == (self.of is None):
            yield "of", Problem("a place `at`, or `of` a body", "both" if self.at else "neither")

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        at = At(self.of or "") if self.at is None else self.at
        part = draft.layout.body(where, at)
        if isinstance(part.space, line.BSpline | line.Hermite):
            facts = self.on_line(where, draft, part)
        elif isinstance(part.space, Solid):
            nodes = np.arange(part.space.count)
            if self.at is not None:
                nodes = solid_points.group(where, part, str(self.at.place))
            facts = solid_points.facts(where, draft, part, nodes)
        else:
            facts = self.on_surface(where, draft, at)
        if not part.yield_strength:
            expected = "a body whose material has a known yield strength"
            remedy = f"write yield_strength: 235 MPa in the material of '{part.name}'"
            raise InputError(say(where, expected, f"'{part.name}'", remedy))
        facts["parameters"] = (part.yield_strength, *facts["parameters"])
        return self.output(draft, (name,), **facts)

    def on_line(self, where: str, draft: Draft, part: Body) -> dict[str, Any]:
        """Rows and numbers of a place of a beam or cable, or of the ends and middles of its cells."""
        xi = (
            line_stresses.along(where, part)
            if self.at is None
            else line_stresses.place_on(where, part, self.at)
        )
        rows, parameters, _ = line_stresses.with_fibres(where, part, xi)
        return {"rows": [draft.layout.spread(part, rows)], "parameters": parameters}

    def on_surface(self, where: str, draft: Draft, at: At) -> dict[str, Any]:
        """Rows and numbers of a point of a plate or shell, or of the corners of all cells."""
        if self.at is not None:
            point = surface_points.surface_point(where, draft, at)
            return {"rows": [point.rows], **point.facts(at.body)}
        part, shape = edges.shape_of(where, draft, at.body)
        corners = VERTICES[shape.parent]
        cells = np.repeat(np.arange(len(shape.nodes)), len(corners))
        xi = np.tile(corners, (len(shape.nodes), 1))
        found = surface_points.vectors_at(where, part, shape, cells, xi)
        rows = draft.layout.spread(part, found.rows)
        return {"rows": [rows], "parameters": tuple(found.parameters.ravel().tolist())}

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        strength, *numbers = output.parameters
        own = tuple(numbers)
        u = sensed.values
        if output.law is not None:
            known = replace(output, parameters=own)
            stress = solid_points.stresses(known, solid_points.gradients(sensed))
            return [solid_points.largest(stress)[0] / strength]
        if beam_sections.reads_beam(own) or cable_sections.reads_cable(own):
            return [line_stresses.extremes(own, u)[-1].max(axis=1) / strength]
        points = np.reshape(own, (-1, surface_points.counts(own[0], sensed.dim)[1]))
        data = np.repeat(points[:, 2:].T[:, None], len(u), axis=1)
        vectors = u.reshape(len(u), len(points), -1).transpose(2, 0, 1)
        found = recover(laws.NUMBERS[int(own[0])], vectors, data, points[:, 1])
        return [found.von_mises.max(axis=(0, 2)) / strength]


def beyond_yield(outputs: Mapping[str, Output], columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """What is said of outputs whose columns (s,) reach the yield strength."""
    for name, output in outputs.items():
        if (
            output.kind == Utilisation.word
            and (most := np.nanmax(columns[name], initial=0.0)) > 1.0
        ):
            text = f"output '{name}' reaches {most:.3g}: the material yields, and what is found is that of an elastic one"
            yield f"{text}; take a larger section, a stronger material, or smaller loads"
