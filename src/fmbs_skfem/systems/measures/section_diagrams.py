r"""Section forces all along the cables and beams of a state, as their diagrams show them.

    in the plane            N = F.t,  Q = -F.n = dM/ds,  M          t along the line, n to its left
    cables in space         N,  |F - N t|,  |M|
    beams with torsion      N, Vy, Vz, T, My, Mz along and about the axes of the section

Values are those of the output `section_forces` at every place, by its own rows and laws:
`cable_sections` and `beam_sections`. Every value has a direction across the line in the reference,
in which a diagram is drawn: shear forces in their own, moments to the side that they stretch, which
is where frames are drawn by hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...bodies.body import Body, arc_lengths, own
from ...core.storage.records import dataclass
from ...shapes import line
from ..system import System
from . import beam_sections, cable_sections

#: evenly along a line, beside its named places and the ends of its cells, where forces act: the
#: top of a parabola between them errs by 6e-4 of its height
PLACES = 41
UPRIGHT = 1e-6  #: sine of the angle to the vertical, up to which a line is upright
NEAR = 1e-9  #: of the length of a line, by which places differ
UNITS = {"N": "N", "Q": "N", "M": "N m", **beam_sections.FORCES}


@dataclass(frozen=True)
class Diagram:
    """One section force along one line."""

    values: np.ndarray  #: (x,) [N, N m]
    directions: np.ndarray  #: (x, 3) of length 1 across the reference line, where it has one


@dataclass(frozen=True)
class LineForces:
    """The section forces of a line at x places."""

    arcs: np.ndarray  #: (x,) arc lengths from its start in the reference [m]
    points: np.ndarray  #: (x, 3) places in the reference [m]
    diagrams: Mapping[str, Diagram]  #: by their names in `UNITS`


def along_lines(system: System, parts: Sequence[Body], x: np.ndarray) -> dict[str, LineForces]:
    """Section forces of all cables and beams among the `parts` of a system, at unknowns x (n,)."""
    q = system.lift(x)
    where = {name: slice(first, last) for name, first, last in system.coordinates}
    return {
        part.name: forces_along(part, q[where[part.name]].reshape(-1, part.dim))
        for part in parts
        if isinstance(part.space, line.BSpline | line.Hermite) and part.cells is not None
    }


def forces_along(part: Body, q: np.ndarray) -> LineForces:
    """Section forces of a cable or beam at coordinates q (b, c) [m]."""
    fine, arc = arc_lengths(part)
    named = [float(at) for at in part.places.values()]
    known = np.interp([*line.breaks(part.space), *named], fine, arc)
    arcs = np.unique(np.concatenate([np.linspace(0.0, arc[-1], PLACES), known]))
    arcs = arcs[np.append(True, np.diff(arcs) > NEAR * arc[-1])]
    xi = np.interp(arcs, arc, fine)
    points = np.asarray(own(part, line.sample(part.space, xi)) @ part.reference)
    found = (cable if part.directors is None else beam)(part, q, xi)
    return LineForces(arcs, spatial(points), found)


def beam(part: Body, q: np.ndarray, xi: np.ndarray) -> dict[str, Diagram]:
    """Section forces of a beam at parameters xi (x,)."""
    full = part if part.shapes is None else beam_sections.with_all_points(part)
    rows, numbers = beam_sections.sections(full, xi)
    u, start = (np.asarray(rows @ one).reshape(1, -1) for one in (q, part.reference))
    forces = numbers.all_forces(u)[1][:, 0]
    axes = beam_sections.gradients(numbers, start)[0][2:4, 0]
    y, z = axes / np.linalg.norm(axes, axis=2, keepdims=True)
    if part.dim == 2:
        sides = {"N": z, "Q": z, "M": -z}
        N, V, M = beam_sections.in_plane(forces)
        forces = np.stack([N, -V, M])
    else:
        # My > 0 stretches z > 0, Mz > 0 stretches y < 0
        sides = {"N": z, "Vy": y, "Vz": z, "T": z, "My": z, "Mz": -y}
    return {
        name: Diagram(values, side)
        for (name, side), values in zip(sides.items(), forces, strict=False)
    }


def cable(part: Body, q: np.ndarray, xi: np.ndarray) -> dict[str, Diagram]:
    """N, Q, M of a cable at parameters xi (x,); of a trained part, whose functions move nothing
    alone, without Q.
    """
    rows, numbers = cable_sections.sections(part, xi)
    u = np.asarray(rows @ q).reshape(1, -1)
    N, *moments = (one[0] for one in cable_sections.forces(numbers, u))
    F = spatial(numbers.carried(u)[0])
    slopes = (spatial(np.asarray(rows[: len(xi)] @ one)) for one in (q, part.reference))
    now, before = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in slopes)
    up = np.array([0.0, 0.0, 1.0])
    left = np.cross(up, before)
    if part.dim == 2:
        Q = -np.einsum("xc,xc->x", F, np.cross(up, now))
        found = {"N": Diagram(N, left), "Q": Diagram(Q, left), "M": Diagram(moments[0], -left)}
    else:
        # N is drawn upwards as far as the line lets it, at a vertical one along y
        size = np.linalg.norm(left, axis=1, keepdims=True)
        level = np.where(size > UPRIGHT, left / np.maximum(size, UPRIGHT), [1.0, 0.0, 0.0])
        Q = F - np.einsum("xc,xc->x", F, now)[:, None] * now
        found = {
            "N": Diagram(N, np.cross(before, level)),
            "Q": magnitude(Q),
            "M": magnitude(np.cross(before, np.stack(moments[1:], axis=1))),
        }
    return {name: one for name, one in found.items() if np.isfinite(one.values).all()}


def magnitude(vectors: np.ndarray) -> Diagram:
    """Sizes of vectors (x, 3), drawn along them."""
    size = np.linalg.norm(vectors, axis=1)
    return Diagram(size, vectors / np.maximum(size, 1e-300)[:, None])


def spatial(points: np.ndarray) -> np.ndarray:
    """Points (x, c) with three components."""
    return np.pad(points, [(0, 0), (0, 3 - points.shape[1])])
