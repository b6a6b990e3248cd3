r"""Joints: probe rows and gap functions.

Every joint states polynomials in its probe rows y (positions r, slopes t = dr/dS); coefficients may
depend on time:

    pin, spherical     r_a - r_b = 0                            clamp          r - r0 = 0,  n_i . t = 0  (n_i normal to t0)
    weld               r_a - r_b = 0,  u_a . n_b = 0            slider         n_i . (r_a - r_b) = s     (n_i normal to the line)
    driven angle       m(theta(t)) . u = 0                      distance       (|r_a - r_b|^2 - l^2) / 2 = 0
    driven position    r - p(t) = 0

Clamps fix the direction of the slope and leave the stretch free, as the natural boundary condition
asks. Joints with axes are in `frame_joints`, screws and racks in `screws`, supports along edges of
plates in `edges`; all of them are names of this module.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from ...bodies.body import Body, directors, locate
from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.fields import ANGLE, AXES, MOTION, Length
from ...core.values.problems import Problem
from ...shapes import line
from .. import fields
from ..places import At, Draft
from ..signals import Cosine, Sine
from ..system import Signal
from .constraint_functions import (
    Joint,
    basis,
    carried,
    coincide,
    dot,
    far,
    fixed,
    guided,
    locked,
    mark,
    needs_axis,
    needs_other_side,
    normals,
    point,
    tied,
    unit,
    where,
)
from .edges import Edge, RimNodes
from .faces import HeldFace
from .frame_joints import Cylindrical, Gear, Prismatic, Revolute, Universal
from .screws import RackAndPinion, Screw
from .sliding import DrivenSlide, Sliding
from .ties import Tie
from .warping import Warping, restrain_warping

# slopes that are tied have one stretch: with EA of 1 and 4 the axial forces beside a weld are 0.4
# and 1.6 times the load; at a tenth they are 5 % off
JUMP = 0.1  #: part of the axial stiffness by which lines differ that is worth a notice

__all__ = [
    "AXES",
    "Joint",
    "Pin",
    "Spherical",
    "Clamp",
    "Weld",
    "RigidLink",
    "Slider",
    "DrivenAngle",
    "DrivenPosition",
    "Revolute",
    "Universal",
    "Prismatic",
    "Cylindrical",
    "Gear",
    "Screw",
    "RackAndPinion",
    "Sliding",
    "DrivenSlide",
    "Edge",
    "RimNodes",
    "HeldFace",
    "Tie",
]


@dataclass(frozen=True)
class Pin(Joint, word=("pin", "spherical")):
    """Two points coincide; `spherical` is the word in space. Without `to` the point stays where it
    is.

        r_at - r_to = 0

    {type: pin, at: crank.right, to: coupler.left}
    """

    name: str
    at: fields.Place
    to: fields.End = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "spherical" if draft.layout.dim == 3 else "pin", self.at)
        coincide(self, draft, self.at, self.to)


@dataclass(frozen=True)
class Clamp(Joint):
    """Position and directions fixed: the slope of a beam, all axes of a rigid body or rim, the
    tangent plane of a plate or shell.

    The stretch at the end of a beam, |dr/dS|, stays free, and so do strains and curvatures at a
    point of a plate; hold whole edges with `edge`.

    {type: clamp, at: beam.left}
    """

    name: str
    at: fields.Place
    warping: Warping = "held"

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "clamp", self.at)
        if on_beam(draft, where(self), self.at):
            tied(self, draft, self.at, None)
            return restrain_warping(self, draft, self.at, None)
        fixed(self, draft, self.at, draft.layout.reference(where(self), self.at))
        slope = draft.layout.reference(where(self), self.at, 1)
        first = draft.probes.add(draft.layout.read(where(self), self.at, 1))
        for k, normal in enumerate(normals(slope)):
            draft.constraints.row(
                self.name,
                f"slope {k + 1}",
                *dot(first, normal, draft.layout.dim),
                about=(slope, normal),
            )
        vectors, reference = basis(where(self), draft.layout, self.at)
        if draft.layout.dim == 3 and len(vectors) > 1:  # which may still turn about the first
            normal = np.cross(reference[0], reference[1])
            second = draft.probes.add(vectors[1])
            draft.constraints.row(
                self.name, "slope 3", *dot(second, normal, 3), about=(reference[1], normal)
            )


@dataclass(frozen=True)
class Weld(Joint):
    """Position and directions of two bodies tied together, or of one to the ground.

    Slopes of two lines that are parallel in the reference are tied as vectors, which lines of one
    axial stiffness want; others only by their angle, and only in the plane (in space that needs
    torsion). Frames are held in all directions, slopes against frames in theirs. Beams that warp pass
    it on where they go straight on, and are held else.

    {type: weld, at: hub.frame, to: blade.left}
    """

    name: str
    at: fields.Place
    to: fields.Carrier = None
    warping: Warping = "held"

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "weld", self.at)
        layout = draft.layout
        name = where(self)
        ends = [end for end in (self.at, self.to) if end is not None]
        if any(on_beam(draft, name, end) for end in ends) and all(
            len(layout.vectors(name, end)) == 3 for end in ends
        ):
            tied(self, draft, self.at, self.to)
            return restrain_warping(self, draft, self.at, self.to)
        coincide(self, draft, self.at, self.to)
        if self.to is None or not (is_line(draft, name, self.at) and is_line(draft, name, self.to)):
            return locked(self, draft, self.at, self.to)
        a, b = layout.reference(name, self.at, 1), layout.reference(name, self.to, 1)
        parallel = float(a @ b)
        if abs(abs(parallel) - 1.0) < 1e-9:
            warn_of_stiffness(name, *((layout.body(name, at), at) for at in (self.at, self.to)))
            first = draft.probes.add(
                layout.read(name, self.at, 1) - np.sign(parallel) * layout.read(name, self.to, 1)
            )
            for c in range(layout.dim):
                draft.constraints.row(self.name, f"slope {AXES[c]}", (1.0, -1, first + c, -1))
            return
        if layout.dim == 3:
            raise InputError(
                say(
                    name,
                    "parallel slopes in space",
                    f"an angle of {np.degrees(np.arccos(parallel)):.4g} deg",
                    "cables carry no torsion: take `type: beam`",
                )
            )
        i, j = (
            draft.probes.add(layout.read(name, self.at, 1)),
            draft.probes.add(layout.read(name, self.to, 1)),
        )
        cosine = parallel
        sine = float(a[0] * b[1] - a[1] * b[0])
        terms = (
            (cosine, -1, i, j + 1),
            (-cosine, -1, i + 1, j),
            (-sine, -1, i, j),
            (-sine, -1, i + 1, j + 1),
        )
        draft.constraints.row(self.name, "angle", *terms, about=(normals(a)[0], a))


@dataclass(frozen=True)
class RigidLink(Joint, word="distance"):
    """A massless rigid link; its length l [m] is that of the reference unless given.

        |r_at - r_to| = l

    {type: distance, at: beam.right, to: [1 m, 0.5 m, 0], length: 0.4 m}
    """

    name: str
    at: fields.Place
    to: fields.OtherEnd
    length: Length | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_other_side(self.to)

    def constrain(self, draft: Draft) -> None:
        layout = draft.layout
        name = where(self)
        mark(self, draft, "distance", self.at, *([self.to] if isinstance(self.to, At) else []))
        mark(self, draft, "line", self.at, self.to)
        apart = layout.reference(name, self.at) - layout.reference(name, self.to)
        length = float(np.linalg.norm(apart)) if self.length is None else self.length
        if not length > 0:
            raise InputError(
                say(
                    f"{name}.length",
                    "a positive length [m]",
                    length,
                    "use a pin for points that coincide",
                )
            )
        first = draft.probes.add(*layout.apart(name, self.at, self.to))
        draft.constraints.row(self.name, "length", *far(first, layout.dim, length))


@dataclass(frozen=True)
class Slider(Joint):
    """A point stays on a line through its reference position, fixed to the ground or to the place
    `to`, with its normals n_i.

        n_i . (r_at - r_to) = const

    {type: slider, at: rod.right, direction: [1, 0]}
    """

    name: str
    at: fields.Place
    direction: fields.Direction
    to: fields.Carrier = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "slider", self.at)
        direction = unit(f"{where(self)}.direction", self.direction, draft.layout.dim)
        guided(self, draft, self.at, self.to, direction)
        point(where(self), draft, "axis", self.at, direction, self.to)


@dataclass(frozen=True)
class DrivenAngle(Joint):
    """The slope or frame turns by an angle [rad] from its reference, about z in the plane, about
    `axis` in space.

        theta = angle(t)

    Against the place `to`, which carries the axis, or the ground.

    {type: driven_angle, at: crank.left, angle: 2 * pi * t}
    """

    name: str
    at: fields.Place
    angle: Annotated[Signal, ANGLE]
    axis: fields.Axis | None = None
    to: fields.Carrier = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "driven", self.at)
        name = where(self)
        dim = draft.layout.dim
        slope = basis(name, draft.layout, self.at)[1]
        if not len(slope):
            raise InputError(
                say(
                    name,
                    "a place with a direction",
                    f"{self.at}, a mere point",
                    "name a rigid frame",
                )
            )
        u = slope[0]
        if dim == 2:
            cosine = np.array([-u[1], u[0]])
            sine = -u
        else:
            axis = unit(f"{name}.axis", self.axis, 3)
            u = u if len(slope) == 1 else normals(slope @ axis)[0] @ slope
            cosine, sine = np.cross(axis, u), np.cross(axis, np.cross(axis, u))
        first = carried(self, draft, self.at, u)
        c, s = draft.signal(Cosine(self.angle)), draft.signal(Sine(self.angle))
        terms = dot(first, carried(self, draft, self.to, cosine), dim, 1.0, c)
        terms += dot(first, carried(self, draft, self.to, sine), dim, 1.0, s)
        draft.constraints.row(self.name, "angle", *terms, about=(u, cosine))


@dataclass(frozen=True)
class DrivenPosition(Joint):
    """A point is displaced from its reference position r0 by functions of t [m], one a coordinate.

        r - r0 = displacement(t)

    {type: driven_position, at: cable.left, displacement: [0.1 * sin(t), 0, 0]}
    """

    name: str
    at: fields.Place
    displacement: Annotated[tuple[Signal, ...], MOTION]

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "driven", self.at)
        reference = draft.layout.reference(where(self), self.at)
        if len(self.displacement) != draft.layout.dim:
            raise InputError(
                say(
                    f"{where(self)}.displacement",
                    f"{draft.layout.dim} functions of time",
                    len(self.displacement),
                )
            )
        first = draft.probes.add(draft.layout.read(where(self), self.at))
        for k, function in enumerate(self.displacement):
            terms = (
                (1.0, -1, first + k, -1),
                (-float(reference[k]), -1, -1, -1),
                (-1.0, draft.signal(function), -1, -1),
            )
            draft.constraints.row(self.name, AXES[k], *terms)


Spherical = Pin


def warn_of_stiffness(name: str, *lines: tuple[Body, At]) -> None:
    """A notice of two lines with one slope at their weld whose axial stiffness [N] differs: so
    would their stretch there.
    """

    def axial(part: Body, at: At) -> float:
        if part.profile is not None:
            return float(part.profile.at(np.array([locate(part, at.place)]))[0][0, 0, 0])
        rows = () if part.cells is None else part.cells.law.section
        return (
            float(part.cells.section[rows.index("EA")].flat[0])
            if part.cells is not None and "EA" in rows
            else 0.0
        )

    low, high = sorted(axial(part, at) for part, at in lines)
    if 0.0 < low < (1.0 - JUMP) * high:
        text = f"ties slopes, with their stretch, of lines whose EA is {low:.4g} N and {high:.4g} N: their strains beside it are wrong"
        notify(
            f"{name} {text}, and errors fall in proportion to their cells; weld both to a small rigid body where that matters"
        )


def on_beam(draft: Draft, name: str, at: At) -> bool:
    """Whether a place belongs to a beam in space, with three directors."""
    return directors(draft.layout.body(name, at)) == 3


def is_line(draft: Draft, name: str, at: At) -> bool:
    """Whether a place belongs to a line and not to a frame."""
    part = draft.layout.body(name, at)
    return isinstance(part.space, line.BSpline | line.Hermite) and part.directors is None
