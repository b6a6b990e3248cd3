r"""Contact of a beam with another beam, or with itself, at their closest points, as `contact_pairs`
has it.

    crossing: {type: contact_beam, body: lower, other: upper, friction: 0.3}
    folds: {type: contact_beam, body: cable, other: cable}

Nodes are the ends of the cells of both beams, or so many `points` along each, between which center
lines are cubics; the radius is that of the sections, or `radius` of both: of beams with torsion
that of the circle with the area of the convex hull of the section, about the line. Where nothing is
said of the law, it is that of `contacts`, with the mass

    m = m_A m_B / (m_A + m_B),    and the size of both beams together           (with itself: those of its halves)

Beams that cross touch at their closest points; such as lie `along` one another, and all in the
plane, touch at the nodes of `body`, so many that no part of `other` passes between two: what
overlaps by 13 % of the radii of both together is found. Where beams that crossed become parallel,
closest points jump, and the energy balance shows it.

Of one beam, places less than `apart` from one another along the line do not touch: a line that is
nowhere bent more sharply than by its radius R touches itself, at a distance of 2 R, after pi R at
the earliest. Where it crosses itself, nodes have to stand closer than `apart`, or a loop takes at
least CELLS pieces. Lines whose ends are one place, as of a hoop, are closed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, kron, vstack

from ..bodies.body import Body, arc_lengths, own
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.fields import whole
from ..core.values.problems import Problem
from ..shapes import line
from ..systems import fields
from ..systems.connections.constraint_functions import size_of
from ..systems.forces.loads import where
from ..systems.places import At, Draft
from . import pair_forces as pair_forces  # which says how these contacts are compiled
from .contacts import CLEAR, ContactGauge, Length, Touch
from .pair_states import gaps_of, measures
from .pairs import BeamContacts, whole_line
from .points import LIMIT, MOST, enough, line_shares
from .states import ContactColumns, find_columns, rows_of

CELLS = 2.0  #: pieces between places of one beam that may cross, at least
#: angle between the ends of beams up to which they lie along one another, by default [rad]
FLAT = 0.2


@dataclass(frozen=True)
class ContactBeam(Touch):
    """Contact of a beam with another one, or with itself, at their closest points.

    {type: contact_beam, body: upper, other: lower, friction: 0.2}
    """

    body: fields.BodyName = field(kw_only=True)
    other: fields.BodyName = field(kw_only=True)
    points: Annotated[
        int | None,
        whole(2, 10_000),
        "nodes along each beam, by default the ends of its cells; of beams along one another as radii need",
    ] = None
    radius: Annotated[
        float | None, fields.quantity("m", "> 0"), "of both, by default those of the sections"
    ] = None

    along: Annotated[
        bool | None,
        "whether nodes touch, of beams that lie along one another; by default the closest points of those that cross",
    ] = None
    apart: Annotated[
        Length | None,
        "along a beam that touches itself, of places that may; by default pi times the radius",
    ] = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.apart is not None and self.body != self.other:
            yield (
                "apart",
                Problem(
                    "a length for a beam that touches itself",
                    "two beams",
                    f"'{self.body}' and '{self.other}'",
                ),
            )

    def push(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        beams = [layout.body(name, At(one)) for one in (self.body, self.other)]
        radii = np.array([part.radius if self.radius is None else self.radius for part in beams])
        require_beams(name, beams)
        for part in beams if self.radius is None else ():
            if part.profile is not None and part.profile.degree:
                text = f"'{part.name}' tapers, and touches with its largest radius, {part.radius:.4g} m, all along"
                notify(f"{name}: {text}; give a `radius`, or divide it where that matters")
        along = self.lies_along(beams)
        reach = float(radii.sum())
        found = [
            node_rows(name, part, self.points, reach if along and part is beams[0] else np.inf)
            for part in beams
        ]
        rows = [one for one, _ in found]
        (nodes, _) = (xi for _, xi in found)
        (spans, others) = (np.diff(xi) for _, xi in found)
        wide = [
            layout.widen(part.name, own_rows) for part, own_rows in zip(beams, rows, strict=True)
        ]
        first = draft.probes.add(csr_array(vstack(wide)))
        reference = np.concatenate(
            [one @ part.reference.ravel() for part, one in zip(beams, rows, strict=True)]
        )
        a, b = (part.total_mass for part in beams)
        mass = a * b / (a + b)
        size = size_of(layout, {self.body, self.other})
        itself = 0
        limits = whole_line(len(spans) + 1, len(others))
        if self.body == self.other:
            mass = mass / 2
            (itself, limits) = self.own_limits(beams[0], reference, spans, radii[0], along)
        term = BeamContacts(
            layout.dim,
            int(along),
            np.arange(first, first + len(reference)),
            spans,
            others,
            radii,
            self.law(size, mass, len(spans) + 1),
            self.share(mass),
            self.power(size),
            itself,
            limits,
            self.weights(line_shares(beams[0], nodes) if along else np.zeros(0), len(spans) + 1),
        )
        self.tell_overlaps(gaps_of(term, reference), size, f"'{self.other}'", "move the beams")
        draft.forces.terms.append(term)
        draft.gauges[self.name] = ContactGauge("contact", (), 0.0, (term,))

    def lies_along(self, beams: list[Body]) -> bool:
        """Whether nodes touch, of two beams in the reference: all in the plane, and the parallel."""
        dim = beams[0].dim
        a, b = (
            np.diff(
                own(part, line.sample(part.space, line.breaks(part.space)[[0, -1]], 0))
                @ part.reference,
                axis=0,
            )[0]
            for part in beams
        )
        alike = bool(abs(a @ b) >= np.cos(FLAT) * np.linalg.norm(a) * np.linalg.norm(b) > 0.0)
        flat = dim == 2 or (alike and self.body != self.other)
        if flat and self.along is False:
            expected = f"beams that cross in space, at {FLAT} rad or more from end to end"
            raise InputError(say(f"{where(self)}.along", expected, "parallel ones", "leave it out"))
        return flat or bool(self.along)

    def own_limits(
        self, part: Body, rows: np.ndarray, spans: np.ndarray, radius: float, along: bool
    ) -> tuple[int, np.ndarray]:
        """Of a beam with rows (f,) of its nodes, spans (t - 1,): 1, or 2 if it is closed, and
        `BeamContacts.limits` (t, 2).
        """
        fine, arc = arc_lengths(part)
        s = np.interp(np.append(0.0, np.cumsum(spans)), fine - fine[0], arc)
        count = np.arange(len(spans) + 1)
        apart = np.pi * radius if self.apart is None else self.apart
        whole = s[-1]
        if not apart < whole / 2:
            expected = (
                f"less than half of the beam, {whole / 2:.6g} m, between places that may touch"
            )
            raise InputError(
                say(
                    f"{where(self)}.apart",
                    expected,
                    f"{apart:.6g} m",
                    "a stocky beam does not touch itself",
                )
            )
        nodes = rows.reshape(2, len(s), 2, -1)[0, :, 0]
        closed = bool(np.linalg.norm(nodes[-1] - nodes[0]) < CLEAR * whole)
        away = 0.0 if along else CELLS
        begin = np.maximum(np.interp(s + apart, s, count), count + away)
        end = (
            np.minimum(np.interp(s + whole - apart, s, count), count + count[-1] - away)
            if closed
            else 0.0 * s + count[-1]
        )
        return 1 + closed, np.minimum(
            np.column_stack([begin, np.minimum(end, count[-1])]), count[-1]
        )


def require_beams(name: str, parts: list[Body]) -> None:
    """Refuse bodies without a line."""
    for part in parts:
        if not isinstance(part.space, line.BSpline | line.Hermite):
            raise InputError(
                say(name, "beams", f"'{part.name}', which is none", "name a body with a line")
            )


def node_rows(
    name: str, part: Body, count: int | None, reach: float
) -> tuple[csr_array, np.ndarray]:
    """Rows (2 c x, b c) of position and slope by xi of x nodes of a beam, and their xi (x,).

    Nothing that touches at a distance `reach` [m] passes between two nodes, as `enough` has it;
    infinite where all is met.
    """
    assert isinstance(part.space, line.BSpline | line.Hermite)
    breaks = line.breaks(part.space)
    xi = (
        breaks
        if count is None and len(breaks) <= MOST
        else np.linspace(breaks[0], breaks[-1], count or MOST)
    )
    longest = float(np.diff(np.interp(xi, *arc_lengths(part))).max())
    pieces = len(xi) - 1
    parts = enough(
        name,
        None if count is None else pieces,
        pieces,
        0.5 * pieces * longest,
        (np.inf, reach),
        (0, LIMIT),
    )
    xi = np.interp(np.linspace(0.0, pieces, parts + 1), np.arange(pieces + 1), xi)
    rows = [own(part, line.sample(part.space, xi, k)) for k in range(2)]
    both = csr_array(vstack(rows))[np.arange(2 * len(xi)).reshape(2, -1).T.ravel()]
    return csr_array(kron(both, np.eye(part.dim))), xi


@rows_of.register
def _(term: BeamContacts) -> list[int]:
    return [int(row) for row in term.rows]


@find_columns.register
def _(term: BeamContacts, y: np.ndarray, rate: np.ndarray, pushes: np.ndarray) -> ContactColumns:
    found = measures(term, y, rate)
    gap, force, slip, normal = found[..., 0], found[..., 1], found[..., 2], found[..., 3:]
    own_nodes = term.rows[: 2 * term.dim * (len(term.spans) + 1)].reshape(-1, 2, term.dim)[:, 0]
    friction = pushes[:, own_nodes].sum(axis=1) - np.einsum("st,stc->sc", force, normal)
    s = np.arange(len(y))
    k = np.argmax(force, axis=1)
    sliding = np.where(force[s, k] > 0.0, slip[s, k], 0.0)
    return ContactColumns(force.sum(axis=1), friction, gap.min(axis=1), force[s, k], sliding)
