r"""Joints: probe rows and gap functions.

Every joint states polynomials in its probe rows y (positions r, slopes t = dr/dS); coefficients may depend on time:

    pin, spherical     r_a - r_b = 0                            clamp          r - r0 = 0,  n_i . t = 0  (n_i normal to t0)
    weld               r_a - r_b = 0,  u_a . n_b = 0            slider         n_i . (r_a - r_b) = s     (n_i normal to the line)
    driven angle       m(theta(t)) . u = 0                      distance       (|r_a - r_b|^2 - l^2) / 2 = 0
    driven position    r - p(t) = 0

Clamps fix the direction of the slope and leave the stretch free, as the natural boundary condition asks. Joints with axes are in
`frame_joints`, supports along edges of plates in `edges`; all of them are names of this module.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError, say
from ..shapes import line
from .edges import Edge, RimNodes
from .frame_joints import Cylindrical, Gear, Prismatic, Revolute, Universal
from .gaps import AXES, basis, carried, coincide, dot, fixed, gap, guided, locked, mark, normals, unit, where
from .places import At, Draft, Ground
from .signals import Cosine, Sine

__all__ = [
    "AXES",
    "gap",
    "Joint",
    "Pin",
    "Spherical",
    "Clamp",
    "Weld",
    "Distance",
    "Slider",
    "DrivenAngle",
    "DrivenPosition",
    "Revolute",
    "Universal",
    "Prismatic",
    "Cylindrical",
    "Gear",
    "Edge",
    "RimNodes",
]


@dataclass(frozen=True)
class Pin:
    """Equal positions: a pin in the plane, a spherical joint in space; to a body, a fixed point, or (None) where it is."""

    name: str
    at: At
    to: At | Ground | None = None


@dataclass(frozen=True)
class Clamp:
    """Position and direction of the slope fixed to the ground."""

    name: str
    at: At


@dataclass(frozen=True)
class Weld:
    """Positions and directions of two bodies tied together, or of one to the ground (None).

    Slopes of two lines that are parallel in the reference are tied as vectors; others only by their angle, and only in the plane
    (in space that needs torsion). Frames are held in all directions, slopes against frames in theirs.
    """

    name: str
    at: At
    to: At | None = None


@dataclass(frozen=True)
class Distance:
    """A massless rigid link of constant length [m], by default the reference distance."""

    name: str
    at: At
    to: At | Ground
    length: float | None = None


@dataclass(frozen=True)
class Slider:
    """A point stays on a line through its reference position, fixed to the ground or to a place with axes."""

    name: str
    at: At
    direction: Ground
    to: At | None = None


@dataclass(frozen=True)
class DrivenAngle:
    """The slope or frame is turned by angle(t) [rad] from its reference, about z in the plane, about `axis` in space.

    Against the place `to`, which carries the axis, or the ground (None).
    """

    name: str
    at: At
    angle: Callable[[np.ndarray], np.ndarray]
    axis: Ground | None = None
    to: At | None = None


@dataclass(frozen=True)
class DrivenPosition:
    """The displacement of a point from its reference position is a function of time, (c,) functions [m]."""

    name: str
    at: At
    displacement: tuple[Callable[[np.ndarray], np.ndarray], ...]


Spherical = Pin
Joint = (
    Pin
    | Clamp
    | Weld
    | Distance
    | Slider
    | DrivenAngle
    | DrivenPosition
    | Revolute
    | Universal
    | Prismatic
    | Cylindrical
    | Gear
    | Edge
    | RimNodes
)


def is_line(draft: Draft, name: str, at: At) -> bool:
    """Whether a place belongs to a line and not to a frame."""
    part = draft.layout.body(name, at)
    return isinstance(part.space, line.BSpline | line.Hermite)


@gap.register
def _(joint: Pin, draft: Draft) -> None:
    mark(joint, draft, "spherical" if draft.layout.dim == 3 else "pin", joint.at)
    coincide(joint, draft, joint.at, joint.to)


@gap.register
def _(joint: Clamp, draft: Draft) -> None:
    mark(joint, draft, "clamp", joint.at)
    fixed(joint, draft, joint.at, draft.layout.reference(where(joint), joint.at))
    slope = draft.layout.reference(where(joint), joint.at, 1)
    first = draft.probes.add(draft.layout.read(where(joint), joint.at, 1))
    for k, normal in enumerate(normals(slope)):
        draft.constraints.row(joint.name, f"slope {k + 1}", *dot(first, normal, draft.layout.dim))


@gap.register
def _(joint: Weld, draft: Draft) -> None:
    mark(joint, draft, "clamp", joint.at)
    coincide(joint, draft, joint.at, joint.to)
    layout, name = draft.layout, where(joint)
    if joint.to is None or not (is_line(draft, name, joint.at) and is_line(draft, name, joint.to)):
        return locked(joint, draft, joint.at, joint.to)
    a, b = layout.reference(name, joint.at, 1), layout.reference(name, joint.to, 1)
    parallel = float(a @ b)
    if abs(abs(parallel) - 1.0) < 1e-9:
        first = draft.probes.add(layout.read(name, joint.at, 1) - np.sign(parallel) * layout.read(name, joint.to, 1))
        for c in range(layout.dim):
            draft.constraints.row(joint.name, f"slope {AXES[c]}", (1.0, -1, first + c, -1))
        return
    if layout.dim == 3:
        raise InputError(
            say(
                name, "parallel slopes in space", f"an angle of {np.degrees(np.arccos(parallel)):.4g} deg", "lines carry no torsion"
            )
        )
    i, j = draft.probes.add(layout.read(name, joint.at, 1)), draft.probes.add(layout.read(name, joint.to, 1))
    cosine, sine = parallel, float(a[0] * b[1] - a[1] * b[0])
    draft.constraints.row(
        joint.name, "angle", (cosine, -1, i, j + 1), (-cosine, -1, i + 1, j), (-sine, -1, i, j), (-sine, -1, i + 1, j + 1)
    )


@gap.register
def _(joint: Distance, draft: Draft) -> None:
    layout, name = draft.layout, where(joint)
    mark(joint, draft, "distance", joint.at, *([joint.to] if isinstance(joint.to, At) else []))
    apart = layout.reference(name, joint.at) - layout.reference(name, joint.to)
    length = float(np.linalg.norm(apart)) if joint.length is None else joint.length
    if not length > 0:
        raise InputError(say(f"{name}.length", "a positive length [m]", length, "use a pin for points that coincide"))
    rows = layout.read(name, joint.at)
    if isinstance(joint.to, At):
        first = draft.probes.add(rows - layout.read(name, joint.to))
    else:
        first = draft.probes.add(rows, -layout.fixed(name, joint.to))
    terms = [(0.5, -1, first + c, first + c) for c in range(layout.dim)]
    draft.constraints.row(joint.name, "length", *terms, (-0.5 * length**2, -1, -1, -1))


@gap.register
def _(joint: Slider, draft: Draft) -> None:
    mark(joint, draft, "slider", joint.at)
    direction = unit(f"{where(joint)}.direction", joint.direction, draft.layout.dim)
    guided(joint, draft, joint.at, joint.to, direction)


@gap.register
def _(joint: DrivenAngle, draft: Draft) -> None:
    mark(joint, draft, "driven", joint.at)
    name, dim = where(joint), draft.layout.dim
    slope = basis(name, draft.layout, joint.at)[1]
    if not len(slope):
        raise InputError(say(name, "a place with a direction", f"{joint.at}, a mere point", "name a rigid frame"))
    u = slope[0]
    if dim == 2:
        cosine, sine = np.array([-u[1], u[0]]), -u
    else:
        if joint.axis is None:
            raise InputError(say(f"{name}.axis", "the axis of rotation", "nothing", "give three numbers"))
        axis = unit(f"{name}.axis", joint.axis, 3)
        u = u if len(slope) == 1 else normals(slope @ axis)[0] @ slope
        cosine, sine = np.cross(axis, u), np.cross(axis, np.cross(axis, u))
    first = carried(joint, draft, joint.at, u)
    c, s = draft.signal(Cosine(joint.angle)), draft.signal(Sine(joint.angle))
    terms = dot(first, carried(joint, draft, joint.to, cosine), dim, 1.0, c)
    terms += dot(first, carried(joint, draft, joint.to, sine), dim, 1.0, s)
    draft.constraints.row(joint.name, "angle", *terms)


@gap.register
def _(joint: DrivenPosition, draft: Draft) -> None:
    mark(joint, draft, "driven", joint.at)
    reference = draft.layout.reference(where(joint), joint.at)
    if len(joint.displacement) != draft.layout.dim:
        raise InputError(say(f"{where(joint)}.displacement", f"{draft.layout.dim} functions of time", len(joint.displacement)))
    first = draft.probes.add(draft.layout.read(where(joint), joint.at))
    for k, function in enumerate(joint.displacement):
        terms = ((1.0, -1, first + k, -1), (-float(reference[k]), -1, -1, -1), (-1.0, draft.signal(function), -1, -1))
        draft.constraints.row(joint.name, AXES[k], *terms)
