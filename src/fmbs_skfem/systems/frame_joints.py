r"""Joints with axes between rigid frames, places with directions, and the ground.

    revolute       r_a = r_b,  a_a || a_b                        universal      r_a = r_b,  a_a . b_b = 0
    prismatic      n_i . (r_a - r_b) = s_i,  no rotation         cylindrical    n_i . (r_a - r_b) = s_i,  a_a || a_b
    gear           n_a theta_a + n_b theta_b - (n_a + n_b) theta_c = 0

Parallel axes are two rows a_a . n_i = 0 with the normals n_i of a_b. The row of a gear is the smallest angle by which the teeth are
apart, divided by n_a: it is smooth, keeps its branch as long as a step moves the teeth by less than half a pitch out of mesh, and
has the exact second derivatives of the argument of a plane vector.

Source: A. A. Shabana, Dynamics of Multibody Systems, 4th ed., Cambridge 2013, doi:10.1017/CBO9781107337213, ch. 3 and 7 (joints);
J. Garcia de Jalon, Multibody Syst. Dyn. 18 (2007) 15-33, doi:10.1007/s11044-007-9068-0 (natural coordinates).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, pi

import numpy as np

from ..core.errors import InputError, say
from .gaps import Term, arm, carried, coincide, dot, gap, guided, locked, mark, parallel, unit, where
from .places import At, Draft, Ground
from .springs import ANGLE


@dataclass(frozen=True)
class Revolute:
    """A hinge to a body, a fixed point, or (None) where it is: about z in the plane, about `axis` (of the reference) in space."""

    name: str
    at: At
    to: At | Ground | None = None
    axis: Ground | None = None


@dataclass(frozen=True)
class Universal:
    """Equal positions, and the axis on `at` stays normal to `axis_to` on the other end (None: the ground)."""

    name: str
    at: At
    to: At | Ground | None
    axis: Ground
    axis_to: Ground


@dataclass(frozen=True)
class Prismatic:
    """Translation along a direction that `to` carries (None: the ground), without rotation."""

    name: str
    at: At
    direction: Ground
    to: At | None = None


@dataclass(frozen=True)
class Cylindrical:
    """Translation along and rotation about an axis that `to` carries (None: the ground), in space."""

    name: str
    at: At
    axis: Ground
    to: At | None = None


@dataclass(frozen=True)
class Gear:
    """Two wheels of n_a and n_b teeth (negative: inside teeth) on a carrier that turns (in the plane), or on the ground (None).

    In space both wheels turn about axes fixed to the ground: `axis` and `axis_b`, which is the same where it is not given.
    """

    name: str
    at: At
    to: At
    teeth: tuple[int, int]
    carrier: At | None = None
    axis: Ground | None = None
    axis_b: Ground | None = None


@gap.register
def _(joint: Revolute, draft: Draft) -> None:
    mark(joint, draft, "pin", joint.at)
    coincide(joint, draft, joint.at, joint.to)
    if draft.layout.dim == 3:
        axis = unit(f"{where(joint)}.axis", (0.0, 0.0, 0.0) if joint.axis is None else joint.axis, 3)
        parallel(joint, draft, joint.at, joint.to, axis)


@gap.register
def _(joint: Universal, draft: Draft) -> None:
    mark(joint, draft, "spherical", joint.at)
    spatial(joint, draft, "a spherical joint is a pin there")
    coincide(joint, draft, joint.at, joint.to)
    a, b = unit(f"{where(joint)}.axis", joint.axis, 3), unit(f"{where(joint)}.axis_to", joint.axis_to, 3)
    if abs(float(a @ b)) > 1e-9:
        raise InputError(
            say(f"{where(joint)}.axis_to", "an axis normal to the other", f"an angle of {np.degrees(np.arccos(a @ b)):.6g} deg")
        )
    terms = dot(carried(joint, draft, joint.at, a), carried(joint, draft, joint.to, b), 3)
    draft.constraints.row(joint.name, "axes", *terms)


@gap.register
def _(joint: Prismatic, draft: Draft) -> None:
    mark(joint, draft, "slider", joint.at)
    direction = unit(f"{where(joint)}.direction", joint.direction, draft.layout.dim)
    guided(joint, draft, joint.at, joint.to, direction)
    locked(joint, draft, joint.at, joint.to)


@gap.register
def _(joint: Cylindrical, draft: Draft) -> None:
    mark(joint, draft, "slider", joint.at)
    spatial(joint, draft, "use a slider")
    axis = unit(f"{where(joint)}.axis", joint.axis, 3)
    guided(joint, draft, joint.at, joint.to, axis)
    parallel(joint, draft, joint.at, joint.to, axis)


def spatial(joint: Universal | Cylindrical, draft: Draft, remedy: str) -> None:
    """Refuse a joint of space in the plane."""
    if draft.layout.dim == 2:
        raise InputError(say(where(joint), "a spatial scene", "a planar one", remedy))


@gap.register
def _(joint: Gear, draft: Draft) -> None:
    name = where(joint)
    mark(joint, draft, "pin", joint.at, joint.to)
    n = [int(k) for k in joint.teeth]
    if len(n) != 2 or 0 in n or tuple(n) != tuple(joint.teeth):
        raise InputError(say(f"{name}.teeth", "two whole numbers that are not zero", joint.teeth))
    if joint.carrier is not None and draft.layout.dim == 3:
        raise InputError(say(f"{name}.carrier", "a carrier on the ground in space", joint.carrier))
    n = [k // gcd(*n) for k in n]
    wheels = [(joint.at, n[0], joint.axis), (joint.to, n[1], joint.axis if joint.axis_b is None else joint.axis_b)]
    wheels += [] if joint.carrier is None else [(joint.carrier, -sum(n), None)]
    terms: list[Term] = []
    for at, teeth, axis in wheels:
        first = draft.probes.add(arm(name, draft.layout, at, axis)[0])
        terms.append((teeth / n[0], ANGLE, first, first + 1))
    draft.constraints.row(joint.name, "teeth", *terms, (2 * pi / abs(n[0]), ANGLE, -1, -1))
