r"""Joints: probe rows and gap functions.

Every joint states polynomials in its probe rows y (positions r, slopes t = dr/dS); coefficients may depend on time:

    pin, spherical     r_a - r_b = 0                            clamp          r - r0 = 0,  n_i . t = 0  (n_i normal to t0)
    weld               r_a - r_b = 0,  t_a - R t_b = 0          slider         n_i . (r - r0) = 0        (n_i normal to the line)
    driven angle       m(theta(t)) . t = 0                      distance       (|r_a - r_b|^2 - l^2) / 2 = 0
    driven position    r - p(t) = 0

Clamps fix the direction of the slope and leave the stretch free, as the natural boundary condition asks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from ..core.errors import InputError, say
from .places import At, Draft, Ground, vector
from .signals import Cosine, Sine

AXES = "xyz"


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
    """Positions and slopes of two bodies tied together.

    Slopes that are parallel in the reference are tied as vectors; others only by their angle, and only in the plane (in space that
    needs torsion).
    """

    name: str
    at: At
    to: At


@dataclass(frozen=True)
class Distance:
    """A massless rigid link of constant length [m], by default the reference distance."""

    name: str
    at: At
    to: At | Ground
    length: float | None = None


@dataclass(frozen=True)
class Slider:
    """A point stays on a fixed line through its reference position."""

    name: str
    at: At
    direction: Ground


@dataclass(frozen=True)
class DrivenAngle:
    """The slope is turned by angle(t) [rad] from its reference direction, about z in the plane, about `axis` in space."""

    name: str
    at: At
    angle: Callable[[np.ndarray], np.ndarray]
    axis: Ground | None = None


@dataclass(frozen=True)
class DrivenPosition:
    """The displacement of a point from its reference position is a function of time, (c,) functions [m]."""

    name: str
    at: At
    displacement: tuple[Callable[[np.ndarray], np.ndarray], ...]


Joint = Pin | Clamp | Weld | Distance | Slider | DrivenAngle | DrivenPosition


@singledispatch
def gap(joint: object, draft: Draft) -> None:
    """Add the joint's probe rows and constraint terms to the draft; the rule for every joint type."""
    raise InputError(say("joints", "a joint", type(joint).__name__))


def where(joint: Joint) -> str:
    return f"joint '{joint.name}'"


def mark(joint: Joint, draft: Draft, kind: str, *ends: At) -> None:
    """Let pictures show the joint at the given points."""
    rows: list[int] = []
    for end in ends:
        first = draft.sensors.add(draft.layout.read(where(joint), end))
        rows += range(first, first + draft.layout.dim)
    draft.markers.append((joint.name, kind, tuple(rows)))


def fixed(joint: Joint, draft: Draft, at: At, target: np.ndarray) -> None:
    """Rows r - target = 0."""
    first = draft.probes.add(draft.layout.read(where(joint), at))
    for c in range(draft.layout.dim):
        draft.constraints.row(joint.name, AXES[c], (1.0, -1, first + c, -1), (-float(target[c]), -1, -1, -1))


def joined(joint: Joint, draft: Draft, at: At, to: At) -> None:
    """Rows r_a - r_b = 0; the places must coincide in the reference."""
    layout = draft.layout
    apart = float(np.linalg.norm(layout.reference(where(joint), at) - layout.reference(where(joint), to)))
    if apart > 1e-8 * max(1.0, float(np.abs(layout.reference(where(joint), at)).max())):
        raise InputError(
            say(where(joint), f"{at} and {to} at one point", f"a gap of {apart:.6g} m", "move a body, or use a distance")
        )
    first = draft.probes.add(layout.read(where(joint), at) - layout.read(where(joint), to))
    for c in range(layout.dim):
        draft.constraints.row(joint.name, AXES[c], (1.0, -1, first + c, -1))


def normals(direction: np.ndarray) -> np.ndarray:
    """Unit vectors normal to a direction, (c - 1, c)."""
    return np.asarray(np.linalg.svd(direction[None, :])[2][1:])


def transverse(joint: Joint, draft: Draft, at: At, derivative: int, direction: np.ndarray, value: np.ndarray) -> None:
    """Rows n_i . (y - value) = 0 for the normals n_i of a direction."""
    first = draft.probes.add(draft.layout.read(where(joint), at, derivative))
    for k, normal in enumerate(normals(direction)):
        terms = [(float(n), -1, first + c, -1) for c, n in enumerate(normal)]
        kind = "slope" if derivative else "normal"
        draft.constraints.row(joint.name, f"{kind} {k + 1}", *terms, (-float(normal @ value), -1, -1, -1))


@gap.register
def _(joint: Pin, draft: Draft) -> None:
    mark(joint, draft, "spherical" if draft.layout.dim == 3 else "pin", joint.at)
    if isinstance(joint.to, At):
        return joined(joint, draft, joint.at, joint.to)
    reference = draft.layout.reference(where(joint), joint.at)
    fixed(joint, draft, joint.at, reference if joint.to is None else vector(where(joint), joint.to, draft.layout.dim))


@gap.register
def _(joint: Clamp, draft: Draft) -> None:
    mark(joint, draft, "clamp", joint.at)
    fixed(joint, draft, joint.at, draft.layout.reference(where(joint), joint.at))
    slope = draft.layout.reference(where(joint), joint.at, 1)
    transverse(joint, draft, joint.at, 1, slope, np.zeros_like(slope))


@gap.register
def _(joint: Weld, draft: Draft) -> None:
    mark(joint, draft, "clamp", joint.at)
    joined(joint, draft, joint.at, joint.to)
    layout, name = draft.layout, where(joint)
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
    rows = layout.read(name, joint.at) - (
        layout.read(name, joint.to) if isinstance(joint.to, At) else 0 * layout.read(name, joint.at)
    )
    first, ground = draft.probes.add(rows), np.zeros(layout.dim) if isinstance(joint.to, At) else vector(name, joint.to, layout.dim)
    terms = [(0.5, -1, first + c, first + c) for c in range(layout.dim)]
    terms += [(-float(g), -1, first + c, -1) for c, g in enumerate(ground)]
    draft.constraints.row(joint.name, "length", *terms, (0.5 * float(ground @ ground - length**2), -1, -1, -1))


@gap.register
def _(joint: Slider, draft: Draft) -> None:
    mark(joint, draft, "slider", joint.at)
    direction = vector(where(joint), joint.direction, draft.layout.dim)
    if not np.linalg.norm(direction) > 0:
        raise InputError(say(f"{where(joint)}.direction", "a non-zero vector", joint.direction))
    transverse(joint, draft, joint.at, 0, direction, draft.layout.reference(where(joint), joint.at))


@gap.register
def _(joint: DrivenAngle, draft: Draft) -> None:
    mark(joint, draft, "driven", joint.at)
    slope = draft.layout.reference(where(joint), joint.at, 1)
    if draft.layout.dim == 2:
        cosine, sine = np.array([-slope[1], slope[0]]), -slope
    else:
        if joint.axis is None:
            raise InputError(say(f"{where(joint)}.axis", "the axis of rotation", "nothing", "give three numbers"))
        axis = vector(where(joint), joint.axis, 3)
        axis = axis / np.linalg.norm(axis)
        cosine, sine = np.cross(axis, slope), np.cross(axis, np.cross(axis, slope))
    first = draft.probes.add(draft.layout.read(where(joint), joint.at, 1))
    c, s = draft.signal(Cosine(joint.angle)), draft.signal(Sine(joint.angle))
    terms = [(float(v), c, first + k, -1) for k, v in enumerate(cosine)] + [
        (float(v), s, first + k, -1) for k, v in enumerate(sine)
    ]
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
