r"""Screws, and racks with their pinions: travel in proportion to a turn, see `travels`.

screw              n_i . (r_a - r_b) = s_i,  a_a || a_b,  a . (r_a - r_b) = lead / 2 pi theta
rack and pinion    n . (r_a - r_b) = radius theta
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Annotated, Any

import numpy as np
from scipy.sparse import csr_array

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from .. import fields
from ..places import At, Draft, Ground
from . import travels
from .constraint_functions import (
    Joint,
    arm,
    carried,
    guided,
    mark,
    needs_axis,
    parallel,
    point,
    unit,
    where,
)
from .frame_joints import spatial

Length = Annotated[float, fields.quantity("m")]


@dataclass(frozen=True)
class Screw(Joint):
    """Translation along and rotation about one axis that `to` (or the ground) carries, by `lead` a
    turn theta, in space.

        a . (r_at - r_to) = lead / 2 pi theta

    A positive lead is a right-handed thread: `at` turns about the axis and moves along it. The
    screw has no friction of its own, so that a force turns it; its reaction `thrust` is the force
    along the axis, and its moment about it

        - lead / 2 pi thrust

    {type: screw, at: nut.frame, to: frame.frame, axis: [0, 0, 1], lead: 5 mm}
    """

    name: str
    at: fields.Place
    axis: fields.Axis
    lead: Length
    to: fields.Carrier = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.lead == 0.0:
            yield (
                "lead",
                Problem(
                    "a travel a turn that is not zero",
                    "0",
                    "a hinge turns without travel: take `revolute`",
                ),
            )

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "cylindrical", self.at)
        spatial(self, draft, "take `rack_and_pinion`")
        axis = unit(f"{where(self)}.axis", self.axis, 3)
        guided(self, draft, self.at, self.to, axis)
        parallel(self, draft, self.at, self.to, axis)
        travel(self, draft, self.axis, axis, self.lead / (2.0 * pi), "thrust")
        point(where(self), draft, "axis", self.at, axis, self.to)


@dataclass(frozen=True)
class RackAndPinion(Joint):
    """A wheel `at` that rolls on a rack `to`, or on one that is fixed: it moves along `direction` n
    by `radius` times its turn theta.

        n . (r_at - r_to) = radius theta

    Both are measured against the rack, which carries the direction and the axis (z in the plane)
    and may move itself; other joints guide wheel and rack. Teeth are on the side axis x direction
    of the wheel, on the other one where the radius is negative. The reaction `thrust` is the force
    along the direction between the teeth.

    {type: rack_and_pinion, at: pinion.frame, to: rack.frame, direction: [1, 0], radius: 20 mm}
    """

    name: str
    at: fields.Place
    direction: fields.Direction
    radius: Length
    to: fields.Carrier = None
    axis: fields.Axis | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)
        if self.radius == 0.0:
            yield "radius", Problem("a radius that is not zero", "0")

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "gear", self.at)
        name = where(self)
        direction = unit(f"{name}.direction", self.direction, draft.layout.dim)
        if self.axis is not None:
            axis = unit(f"{name}.axis", self.axis, 3)
            if abs(float(axis @ direction)) > 1e-9:
                got = f"an angle of {np.degrees(np.arccos(axis @ direction)):.6g} deg"
                raise InputError(say(f"{name}.direction", "a direction normal to the axis", got))
        travel(self, draft, self.axis, direction, self.radius, "thrust")
        point(name, draft, "axis", self.at, direction, self.to)


def travel(
    joint: Any, draft: Draft, axis: Ground | None, direction: np.ndarray, rate: float, label: str
) -> None:
    """The row by which `at` moves against `to` along a direction n (c,) by `rate` [m/rad] times its
    turn theta about an axis.

        n . (r_at - r_to) = rate theta

    `to` carries the direction and the axis, z in the plane; both turn and travel count from the
    reference.
    """
    name = where(joint)
    layout = draft.layout
    rows = layout.read(name, joint.at)
    apart = layout.reference(name, joint.at)
    offset = -apart if joint.to is None else 0.0 * apart
    if joint.to is not None:
        rows, apart = rows - layout.read(name, joint.to), apart - layout.reference(name, joint.to)
    _, u, normal = arm(name, layout, joint.at, axis)
    carriers = (joint.to, direction), (joint.at, u), (joint.to, u), (joint.to, normal)
    first = [
        draft.probes.add(csr_array(rows), offset),
        *(vector(joint, draft, end, one) for end, one in carriers),
    ]
    known = [row + c for row in first for c in range(layout.dim)]
    rest = 0.0 if joint.to is None else float(direction @ apart)
    draft.constraints.law(
        joint.name, label, travels.travel(f"{travels.WORD}|{layout.dim}"), known, [rest, rate]
    )
    draft.constraints.directions[joint.name, label] = direction


def vector(joint: Any, draft: Draft, end: At | None, direction: np.ndarray) -> int:
    """The first of c probe rows of a vector (c,) that an end carries along, the ground as it is."""
    found = carried(joint, draft, end, direction)
    return (
        found
        if isinstance(found, int)
        else draft.probes.add(csr_array((len(found), draft.layout.size)), found)
    )
