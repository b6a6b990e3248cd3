r"""Joints with axes between rigid frames, places with directions, and the ground.

    revolute       r_a = r_b,  a_a || a_b                        universal      r_a = r_b,  a_a . b_b = 0
    prismatic      n_i . (r_a - r_b) = s_i,  no rotation         cylindrical    n_i . (r_a - r_b) = s_i,  a_a || a_b
    gear           n_a theta_a + n_b theta_b - (n_a + n_b) theta_c = 0

Parallel axes are two rows a_a . n_i = 0 with the normals n_i of a_b. The row of a gear is the
smallest angle by which the teeth are apart, divided by n_a: it is smooth, keeps its branch as long
as a step moves the teeth by less than half a pitch out of mesh, and has the exact second
derivatives of the argument of a plane vector.

Source: A. A. Shabana, Dynamics of Multibody Systems, 4th ed., Cambridge 2013,
doi:10.1017/CBO9781107337213, ch. 3 and 7 (joints); J. Garcia de Jalon, Multibody Syst. Dyn. 18
(2007) 15-33, doi:10.1007/s11044-007-9068-0 (natural coordinates).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import gcd, pi

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from .. import fields
from ..places import Draft
from .constraint_functions import (
    Joint,
    arm,
    carried,
    coincide,
    dot,
    guided,
    locked,
    mark,
    needs_axis,
    parallel,
    point,
    unit,
    where,
)


@dataclass(frozen=True)
class Revolute(Joint):
    """A hinge: about z in the plane, about `axis` (of the reference) in space. Without `to` it
    stays where it is.

    {type: revolute, at: arm.frame, to: base.frame, axis: [0, 0, 1]}
    """

    name: str
    at: fields.Place
    to: fields.End = None
    axis: fields.Axis | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "pin", self.at)
        coincide(self, draft, self.at, self.to)
        if self.axis is not None:
            axis = unit(f"{where(self)}.axis", self.axis, 3)
            parallel(self, draft, self.at, self.to, axis)
            point(where(self), draft, "axis", self.at, axis, self.to, self.at)


@dataclass(frozen=True)
class Universal(Joint):
    """Two places coincide; the axis a on `at` stays normal to `axis_to` b on the other (or the
    ground), in space.

        r_at - r_to = 0,    a . b = 0

    {type: universal, at: shaft.frame, axis: [0, 1, 0], to: fork.frame, axis_to: [0, 0, 1]}
    """

    name: str
    at: fields.Place
    axis: fields.Axis
    axis_to: fields.Axis
    to: fields.End = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "universal", self.at)
        spatial(self, draft, "a spherical joint is a pin there")
        coincide(self, draft, self.at, self.to)
        a, b = (
            unit(f"{where(self)}.axis", self.axis, 3),
            unit(f"{where(self)}.axis_to", self.axis_to, 3),
        )
        if abs(float(a @ b)) > 1e-9:
            raise InputError(
                say(
                    f"{where(self)}.axis_to",
                    "an axis normal to the other",
                    f"an angle of {np.degrees(np.arccos(a @ b)):.6g} deg",
                )
            )
        terms = dot(carried(self, draft, self.at, a), carried(self, draft, self.to, b), 3)
        draft.constraints.row(self.name, "axes", *terms, about=(a, b))


@dataclass(frozen=True)
class Prismatic(Joint):
    """Translation along a direction that `to` (or the ground) carries, without rotation.

    {type: prismatic, at: carriage.frame, direction: [1, 0, 0]}
    """

    name: str
    at: fields.Place
    direction: fields.Direction
    to: fields.Carrier = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "prismatic", self.at)
        direction = unit(f"{where(self)}.direction", self.direction, draft.layout.dim)
        guided(self, draft, self.at, self.to, direction)
        locked(self, draft, self.at, self.to)
        point(where(self), draft, "axis", self.at, direction, self.to)


@dataclass(frozen=True)
class Cylindrical(Joint):
    """Translation along and rotation about an axis a that `to` (or the ground) carries, in space,
    with its normals n_i.

        n_i . (r_at - r_to) = const,    a_at . n_i = 0

    {type: cylindrical, at: piston.frame, to: housing.frame, axis: [0, 0, 1]}
    """

    name: str
    at: fields.Place
    axis: fields.Axis
    to: fields.Carrier = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "cylindrical", self.at)
        spatial(self, draft, "use a slider")
        axis = unit(f"{where(self)}.axis", self.axis, 3)
        guided(self, draft, self.at, self.to, axis)
        parallel(self, draft, self.at, self.to, axis)
        point(where(self), draft, "axis", self.at, axis, self.to)


@dataclass(frozen=True)
class Gear(Joint):
    """Two wheels with numbers of teeth (negative: inside teeth) on the ground or, in the plane, on
    a carrier that turns.

        teeth_1 theta_1 + teeth_2 theta_2 = (teeth_1 + teeth_2) theta_carrier

    In space they turn about `axis` and `axis_b`, which is the same unless given. The joint passes
    moments alone: the force between the teeth, moment over radius, is not among the reactions of
    the bearings.

    {type: gear, at: pinion.frame, to: wheel.frame, teeth: [12, 60]}
    """

    name: str
    at: fields.Place
    to: fields.Place
    teeth: fields.Teeth
    carrier: fields.Carrier = None
    axis: fields.Axis | None = None
    axis_b: fields.Axis | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)
        if dim == 3 and self.carrier is not None:
            yield (
                "carrier",
                Problem("wheels on the ground in space", f"the carrier '{self.carrier.body}'"),
            )

    def constrain(self, draft: Draft) -> None:
        name = where(self)
        mark(self, draft, "gear", self.at, self.to)
        n = [int(k) for k in self.teeth]
        if len(n) != 2 or 0 in n or tuple(n) != tuple(self.teeth):
            raise InputError(
                say(f"{name}.teeth", "two whole numbers that are not zero", self.teeth)
            )
        n = [k // gcd(*n) for k in n]
        wheels = [
            (self.at, n[0], self.axis),
            (self.to, n[1], self.axis if self.axis_b is None else self.axis_b),
        ]
        wheels += [] if self.carrier is None else [(self.carrier, -sum(n), None)]
        arms = [draft.probes.add(arm(name, draft.layout, at, axis)[0]) for at, _, axis in wheels]
        ratios = [teeth / n[0] for _, teeth, _ in wheels]
        rows = [first + c for first in arms for c in range(2)]
        draft.constraints.law(
            self.name, "teeth", f"gear_{len(wheels)}", rows, [*ratios, 2 * pi / abs(n[0])]
        )


def spatial(joint: Joint, draft: Draft, remedy: str) -> None:
    """Refuse a joint of space in the plane."""
    if draft.layout.dim == 2:
        raise InputError(say(where(joint), "a spatial scene", "a planar one", remedy))
