r"""Forces and torques by expressions of the state: controllers, motors, springs of any law.

    control_force      f n          on `at`, along a fixed direction n                 and - f n on `to`
    control_torque     f a          on `at`, about an axis a                           and - f a on `to`, which carries the axis
    actuator           f u          pulls `at` and `to` together along the line u between them
    motor              torque-speed line, f = stall_torque (1 - rate / no_load_speed)

f is an expression of outputs of the scene, of what the load measures itself, of t and parameters
(`responses`), compiled with its derivatives.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, ClassVar

from scipy.sparse import csr_array

from ...core.storage.records import dataclass
from ...core.values.problems import Problem
from ...core.values.responses import OfState, of_state
from .. import fields
from ..connections.constraint_functions import needs_axis, unit
from ..places import At, Draft, Gauge, vector
from . import responses
from .loads import Load, where
from .springs import Between, Length, along, need_direction

Force = Annotated[OfState, fields.response("N")]
Torque = Annotated[OfState, fields.response("N m")]


@dataclass(frozen=True)
class ControlForce(Load):
    """A force on a place along a fixed direction, and its opposite on `to`; `stretch` and `rate`
    are theirs along it.

    {type: control_force, at: cart, direction: [1, 0], force: -20 N/m * stretch}
    """

    name: str
    at: fields.Place
    direction: fields.Direction
    force: Force
    to: fields.End = None
    drives: ClassVar[bool] = True
    own: ClassVar[Mapping[str, str]] = responses.LENGTHS

    def push(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        normal = unit(
            f"{name}.direction", vector(f"{name}.direction", self.direction, layout.dim), layout.dim
        )
        rows = layout.read(name, self.at)
        offset = -layout.reference(name, self.at if self.to is None else self.to)
        if isinstance(self.to, At):
            rows = rows - layout.read(name, self.to)
            offset = 0.0 * offset
        row = draft.probes.add(csr_array(normal[None, :] @ rows), normal[None, :] @ offset)
        gauge = draft.gauges[self.name] = Gauge("push", (row,), 0.0)
        responses.act(draft, name, gauge, "push", self.force)


@dataclass(frozen=True)
class AngularLoad(Load, ABC):
    """A torque about z or, in space, about `axis`, and its opposite on `to`; `angle` and `rate` are
    between the two.
    """

    name: str
    at: fields.Place
    to: fields.Carrier = None
    axis: fields.Axis | None = None
    drives: ClassVar[bool] = True
    own: ClassVar[Mapping[str, str]] = responses.ANGLES

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)

    def push(self, draft: Draft) -> None:
        gauge, coordinate = responses.angle_between(draft, where(self), self.at, self.to, self.axis)
        draft.gauges[self.name] = gauge
        responses.act(draft, where(self), gauge, coordinate, self.law())

    @abstractmethod
    def law(self) -> OfState:
        """The torque."""


@dataclass(frozen=True)
class ControlTorque(AngularLoad):
    """A torque about z or, in space, about `axis`, and its opposite on `to`.

    The torque is an expression, in which `angle` (since the reference, its turns counted) and
    `rate` are those between the places.

    {type: control_torque, at: arm.left, torque: -60 N m * angle - 8 N m s * rate}
    """

    torque: Torque = field(kw_only=True)

    def law(self) -> OfState:
        return self.torque


@dataclass(frozen=True)
class Motor(AngularLoad):
    """A torque that falls in a straight line from `stall_torque` at rest to zero at
    `no_load_speed`, and brakes beyond that.

    {type: motor, at: crank.left, stall_torque: 2 N m, no_load_speed: 3000 rpm}
    """

    stall_torque: Annotated[float, fields.quantity("N m")] = 0.0
    no_load_speed: Annotated[float, fields.quantity("rad/s", "> 0")] = 1.0
    strengths: ClassVar[tuple[str, ...]] = ("stall_torque",)

    def law(self) -> OfState:
        numbers = {"stall": self.stall_torque, "speed": self.no_load_speed}
        return of_state("stall * (1 - rate / speed)", "N m", numbers)


@dataclass(frozen=True)
class Actuator(Between):
    """Pulls two places together with a force, an expression in which `stretch` counts from
    `length`, and `rate` is that of it.

    {type: actuator, at: boom.left, to: base.right, force: 2 kN/m * stretch + 10 N s/m * rate}
    """

    force: Force
    length: Length | None = None
    drives: ClassVar[bool] = True
    resists: ClassVar[bool] = False
    own: ClassVar[Mapping[str, str]] = responses.LENGTHS

    def act(self, draft: Draft) -> None:
        need_direction(self, draft)
        along(self, draft, self.length)
        responses.act(draft, where(self), draft.gauges[self.name], "pull", self.force)
