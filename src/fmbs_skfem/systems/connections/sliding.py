r"""Joints that slide along a line that deforms: a point on the centre line of a cable or beam, with
or without its directions.

    r_at - r_line(s) = 0,        u_i . n_j(s) = 0                                                                      (1)

s, the place on the line, is a coordinate of the joint, without mass: Phi_s^T lambda = F_s says that
nothing pushes along r' but what acts on s, such as friction. u_i are directions that `at` carries;
n_j are normal to them at the start: the slope r'(s), about which the body may turn, or directors of
a beam, whose section takes the body along.

Sources: H. Sugiyama, J. L. Escalona, A. A. Shabana, Nonlinear Dynamics 31 (2003) 167-195,
doi:10.1023/A:1022082826627; D. Hong, G. Ren, A modeling of sliding joint on one-dimensional
flexible medium, Multibody Syst. Dyn. 26 (2011) 91-106, doi:10.1007/s11044-010-9242-7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from scipy.sparse import csr_array, eye_array

from ...bodies.body import Body, arc_lengths, director, own
from ...core.errors import InputError, closest, listed, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.fields import AXES, WAY
from ...core.values.problems import Problem
from ...shapes import line
from .. import fields
from ..places import At, Coordinates, Draft
from ..system import Signal
from . import along_lines
from .constraint_functions import CLOSE, FINE, Joint, carried, mark, normals, size_of, where

PLACE = "s"  #: of the coordinates of a joint, after its name
# half of it finds the same place on an arc of 60 degrees a cell, twice costs twice as much of a
# start
FINER = 8  #: places a cell from which the nearest one is searched
STEPS = 20  #: of Newton's iteration for it
UNEVEN = 1e-3  #: part of the length of a line by which s may differ from the arc length without a warning

Length = Annotated[float, fields.quantity("m", ">= 0")]


@dataclass(frozen=True)
class Sliding(Joint):
    """A point on the centre line of a cable or beam, along which it slides while the line deforms.

    `at` is a place of a body, or a fixed point through which the line runs. It has to be on the
    line at the start; where a line comes back to itself, `start` is the arc length near which.
    `rotation` says how the body may turn: `free`; `about_line` in space, so that a direction of it
    stays along the line; or `none`, with the section of a beam or, in the plane, the slope. Nothing
    acts along the line but what loads say: `sliding_friction`, `sliding_force`, `sliding_stop`. A
    run stops where the joint leaves its line, unless an event has released it, or a stop holds it.

    {type: sliding, at: trolley.frame, line: girder, rotation: none}
    """

    name: str
    at: fields.OtherEnd
    line: fields.BodyName
    rotation: Literal["free", "about_line", "none"] = "free"
    start: Length | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.rotation != "free" and not isinstance(self.at, At):
            yield (
                "rotation",
                Problem("free at a fixed point", f"'{self.rotation}'", "name a place of a body"),
            )
        if self.rotation == "about_line" and dim == 2:
            yield "rotation", Problem("free or none in the plane", "'about_line'")

    @property
    def coordinates(self) -> tuple[str, ...]:
        return (coordinate_of(self.name),)

    def unknowns(self, layout: Coordinates) -> Iterator[Body]:
        track = track_of(self, layout)
        s = track.nearest(layout.reference(where(self), self.at), self.start)
        yield Body(
            coordinate_of(self.name),
            np.eye(1, layout.dim) * s,
            csr_array((1, 1)),
            np.zeros(1),
            {"center": 0.0},
        )

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        dim = draft.layout.dim
        mark(self, draft, "slider", self.at)
        track = track_of(self, layout)
        place = At(coordinate_of(self.name))
        s = float(layout.reference(name, place)[0])
        check_start(self, layout, track, s)
        along = draft.probes.add(layout.read(name, place))
        for c in range(
            1, dim
        ):  # the other components stay zero; the rows are the coordinate's own, as those of frames
            draft.constraints.row(place.body, f"e1.e{c + 1}", (1.0, -1, along + c, -1))
        nowhere = csr_array((dim, layout.size))
        rows, offset = (
            (layout.read(name, self.at), None)
            if isinstance(self.at, At)
            else (nowhere, layout.reference(name, self.at))
        )
        point, minus = (
            draft.probes.add(csr_array(rows), offset),
            draft.probes.add(nowhere[[0]], np.array([-1.0])),
        )
        line_rows = own(track.part, csr_array(eye_array(track.space.count)))
        held = draft.probes.add(layout.spread(track.part, line_rows))
        for c in range(dim):
            coefficients = range(held + c, held + dim * track.space.count, dim)
            law = along_lines.law_on(track.space, 1)
            numbers = along_lines.numbers_of(track.space, track.length, 1, 0)
            draft.constraints.law(
                self.name, AXES[c], law, [along, point + c, minus, *coefficients], numbers
            )
        if isinstance(self.at, At) and self.rotation != "free":
            hold_directions(self, draft, track, self.at, (along, held, s))


@dataclass(frozen=True)
class DrivenSlide(Joint):
    """What slides by the joint `along` is displaced along its line by a function of t [m] from
    where it begins, s0.

        s - s0 = displacement(t)

    {type: driven_slide, along: trolley, displacement: 2 * t}
    """

    name: str
    along: fields.JointName
    displacement: Annotated[Signal, WAY]

    def constrain(self, draft: Draft) -> None:
        place = coordinate_in(f"{where(self)}.along", draft, self.along)
        first = draft.probes.add(csr_array(draft.layout.read(where(self), place)[[0]]))
        s = float(draft.layout.reference(where(self), place)[0])
        terms = (
            (1.0, -1, first, -1),
            (-s, -1, -1, -1),
            (-1.0, draft.signal(self.displacement), -1, -1),
        )
        draft.constraints.row(self.name, "thrust", *terms)


@dataclass(frozen=True)
class Track:
    """A line on which joints slide. s is its parameter from the start on, as a part of the length
    [m].
    """

    part: Body
    space: line.BSpline | line.Hermite

    @property
    def length(self) -> float:
        """Arc length of the line in the reference [m]."""
        return float(arc_lengths(self.part)[1][-1])

    @property
    def ends(self) -> np.ndarray:
        """Parameters (2,) of its ends."""
        return line.breaks(self.space)[[0, -1]]

    def position(self, xi: float, derivative: int = 0) -> np.ndarray:
        """r (c,) in the reference [m], or a derivative by the parameter, at a parameter."""
        return np.asarray(
            own(self.part, line.sample(self.space, np.array([xi]), derivative))
            @ self.part.reference
        )[0]

    def parameter(self, s: float) -> float:
        """The parameter of a place s [m]."""
        return float(np.interp(s, [0.0, self.length], self.ends))

    def nearest(self, point: np.ndarray, start: float | None) -> float:
        """The place s [m] that is nearest to a point (c,) in the reference, or near to it from the
        arc length `start` on.
        """
        if start is None:
            xi = np.linspace(
                0, len(breaks := line.breaks(self.space)) - 1, FINER * (len(breaks) - 1) + 1
            )
            xi = np.interp(xi, np.arange(len(breaks)), breaks)
            r = own(self.part, line.sample(self.space, xi)) @ self.part.reference
            at = float(xi[np.linalg.norm(r - point, axis=1).argmin()])
        else:
            at = float(np.interp(start, *arc_lengths(self.part)[::-1]))
        for _ in range(STEPS):
            r0, r1, r2 = (self.position(at, k) for k in range(3))
            bend = max(float(r1 @ r1 + (r0 - point) @ r2), 0.5 * float(r1 @ r1))
            at = float(np.clip(at - (r0 - point) @ r1 / bend, *self.ends))
        return float(np.interp(at, self.ends, [0.0, self.length]))


def track_of(joint: Any, layout: Coordinates) -> Track:
    """The line of a joint that slides; InputError where it is none, a warning where s is no arc
    length.
    """
    name = f"{where(joint)}.line"
    part = layout.body(name, At(joint.line))
    if (
        not isinstance(part.space, line.BSpline | line.Hermite)
        or getattr(part.space, "weights", None) is not None
    ):
        raise InputError(
            say(
                name,
                "a cable or a beam",
                f"'{joint.line}', which is none",
                "name a body with a line",
            )
        )
    return Track(part, part.space)


def check_start(joint: Sliding, layout: Coordinates, track: Track, s: float) -> None:
    """InputError where the point is not on the line, a warning where it is nearly, and where s is
    not quite the arc length.
    """
    name = where(joint)
    xi = track.parameter(s)
    there = track.position(xi)
    at = str(joint.at) if isinstance(joint.at, At) else f"the fixed point {joint.at}"
    away = float(np.linalg.norm(there - layout.reference(name, joint.at)))
    size = size_of(layout, {joint.line})
    if away > CLOSE * size:
        shown = ", ".join(f"{x:.6g}" for x in there + layout.origin)
        got = f"{away:.6g} m away from it: the nearest point is ({shown}), at s = {s:.6g} m"
        raise InputError(
            say(
                name, f"{at} on the line of '{joint.line}'", got, "move the body there, or the line"
            )
        )
    if away > FINE * size:
        notify(
            f"{name} closes a gap of {away:.3g} m between {at} and '{joint.line}': give their coordinates more digits"
        )
    fine, arc = arc_lengths(track.part)
    uneven = float(np.abs(np.interp(fine, track.ends, [0.0, track.length]) - arc).max())
    if uneven > UNEVEN * track.length:
        notify(
            f"{name}: s differs from the arc length of '{joint.line}' by up to {uneven:.3g} m; cut the line into even cells"
        )


def coordinate_of(joint: str) -> str:
    """What the coordinate of a joint is called among the bodies."""
    return f"{joint}.{PLACE}"


def coordinate_in(name: str, draft: Draft, joint: str) -> At:
    """The place of the coordinate of a joint that slides; InputError, after `name`, where no joint
    of that name does.
    """
    known = [
        one.removesuffix(f".{PLACE}")
        for one, part in draft.layout.bodies.items()
        if not part.constant.any()
    ]
    if joint not in known:
        expected = f"one of the joints that slide ({listed(known, joint, 'none')})"
        raise InputError(say(name, expected, f"'{joint}'") + closest(joint, known))
    return At(coordinate_of(joint))


def hold_directions(
    joint: Sliding, draft: Draft, track: Track, at: At, here: tuple[int, int, float]
) -> None:
    """Rows by which `at` turns with the slope of the line, or with the section of a beam.

    `here` are the first probe rows of s and of the coefficients of the line, and s [m] at the
    start.
    """
    dim = draft.layout.dim
    part = track.part
    (along, held, s) = here
    tangent = track.position(track.parameter(s), 1)
    tangent = tangent / np.linalg.norm(tangent)
    if joint.rotation == "about_line" or dim == 2:
        found = [
            (f"angle {k + 1}" if dim == 3 else "angle", normal, tangent, held, 1)
            for k, normal in enumerate(normals(tangent))
        ]
    elif part.directors is None:
        got, remedy = "'none'", "take `rotation: about_line`, or `type: beam`"
        raise InputError(
            say(
                f"{where(joint)}.rotation",
                "free or about_line on a cable, which has no torsion",
                got,
                remedy,
            )
        )
    else:
        here_rows = line.sample(track.space, np.array([track.parameter(s)]))
        d = [np.asarray(here_rows @ director(part, k + 1) @ part.reference)[0] for k in range(3)]
        rows = [
            draft.probes.add(draft.layout.spread(part, director(part, k + 1))) for k in range(3)
        ]
        found = [(f"angle {i + j}", d[i], d[j], rows[j], 0) for i, j in ((0, 1), (0, 2), (1, 2))]
    zero = draft.probes.add(csr_array((1, draft.layout.size)))
    law = along_lines.law_on(track.space, dim)
    for label, u, n, first, derivative in found:
        vector = carried(joint, draft, at, u)
        assert isinstance(vector, int)
        read: Sequence[int] = [
            along,
            zero,
            *range(vector, vector + dim),
            *range(first, first + dim * track.space.count),
        ]
        draft.constraints.law(
            joint.name,
            label,
            law,
            read,
            along_lines.numbers_of(track.space, track.length, dim, derivative),
        )
        draft.constraints.axes[joint.name, label] = np.cross(
            np.pad(u, (0, 3 - dim)), np.pad(n, (0, 3 - dim))
        )
