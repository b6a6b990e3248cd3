"""Models of joints and loads in a scene, in SI units once read."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, StrictBool, ValidationInfo, field_validator

from ..core.problems import Problem
from . import fields, plate_fields
from .models import BodyName, Model


class Pin(Model):
    """Two points coincide; `spherical` is the word in space. Without `to` the point stays where it is."""

    type: Literal["pin", "spherical"]
    at: fields.At
    to: fields.To = None


class Clamp(Model):
    """Position and slope direction fixed."""

    type: Literal["clamp"]
    at: fields.At


class Weld(Model):
    """Position and directions of two bodies tied together, or of one to the ground."""

    type: Literal["weld"]
    at: fields.At
    to: fields.Carrier


class DrivenAngle(Model):
    """The slope or frame turns by angle(t) [rad] from its reference, about z in the plane, about `axis` in space.

    Against the place `to`, which carries the axis, or the ground.
    """

    type: Literal["driven_angle"]
    at: fields.At
    angle: fields.Angle
    axis: fields.Axis | None = None
    to: fields.Carrier = None


class DrivenPosition(Model):
    """A point is displaced from its reference position by functions of t [m]."""

    type: Literal["driven_position"]
    at: fields.At
    displacement: fields.Motion


class Distance(Model):
    """A massless rigid link; its length is that of the reference unless given."""

    type: Literal["distance"]
    at: fields.At
    to: fields.To
    length: fields.Length | None = None


class Slider(Model):
    """A point stays on a line through its reference position, fixed to the ground or to the place `to`."""

    type: Literal["slider"]
    at: fields.At
    direction: fields.Direction
    to: fields.Carrier = None


class Revolute(Model):
    """A hinge: about z in the plane, about `axis` in space."""

    type: Literal["revolute"]
    at: fields.At
    to: fields.To = None
    axis: fields.Axis | None = None


class Universal(Model):
    """Two places coincide; the axis on `at` stays normal to `axis_to` on the other, in space."""

    type: Literal["universal"]
    at: fields.At
    to: fields.To = None
    axis: fields.Axis
    axis_to: fields.Axis


class Prismatic(Model):
    """Translation along a direction that `to` (or the ground) carries, without rotation."""

    type: Literal["prismatic"]
    at: fields.At
    direction: fields.Direction
    to: fields.Carrier = None


class Cylindrical(Model):
    """Translation along and rotation about an axis that `to` (or the ground) carries, in space."""

    type: Literal["cylindrical"]
    at: fields.At
    axis: fields.Axis
    to: fields.Carrier = None


class Gear(Model):
    """Two wheels with numbers of teeth (negative: inside teeth) on the ground or, in the plane, on a carrier that turns.

    In space they turn about `axis` and `axis_b`, which is the same unless given.
    """

    type: Literal["gear"]
    at: fields.At
    to: fields.At
    teeth: plate_fields.Teeth
    carrier: fields.Carrier = None
    axis: fields.Axis | None = None
    axis_b: fields.Axis | None = None


class Edge(Model):
    """Edges of a plate held to the ground: components of the displacement (`fixed`, all by default), and of its derivative across.

    For a plate in x, y with an edge along y: clamped is slope `z`, hinged none, a plane of symmetry is fixed `x`, slope `yz`.
    """

    type: Literal["edge"]
    body: BodyName
    edges: plate_fields.Names
    fixed: plate_fields.Letters | None = None
    slope: plate_fields.Letters = ""


class RimNodes(Model):
    """Every node on edges of a plate keeps its distance to a place or a fixed point, so that the rim itself may deform."""

    type: Literal["rim_nodes"]
    body: BodyName
    edges: plate_fields.Names
    to: fields.To


Joint: TypeAlias = Annotated[
    Pin
    | Clamp
    | Weld
    | DrivenAngle
    | DrivenPosition
    | Distance
    | Slider
    | Revolute
    | Universal
    | Prismatic
    | Cylindrical
    | Gear
    | Edge
    | RimNodes,
    Field(discriminator="type"),
]


class Gravity(Model):
    """Uniform acceleration of all bodies."""

    type: Literal["gravity"]
    acceleration: fields.Acceleration


class PointForce(Model):
    """A force of fixed direction at a point, times `history`."""

    type: Literal["point_force"]
    at: fields.At
    force: fields.Force
    history: fields.History | None = None


class Follower(Model):
    """A force that turns with a slope, [tangential, normal] in the plane, tangential in space; or with a frame, along its axes."""

    type: Literal["follower"]
    at: fields.At
    force: fields.FollowerForce
    history: fields.History | None = None


class Moment(Model):
    """A moment on a slope: about z in the plane, a vector in space."""

    type: Literal["moment"]
    at: fields.At
    moment: fields.Moment
    history: fields.History | None = None


class Torque(Model):
    """A moment on a rigid frame: about z in the plane, a vector in space."""

    type: Literal["torque"]
    at: fields.At
    torque: fields.Moment
    history: fields.History | None = None


class TorsionSpring(Model):
    """Torque - stiffness (theta - rest_angle) - damping dtheta/dt about z, in space about `axis`, against `to` or the ground.

    theta is the angle turned since the reference, its turns counted: of less than half a turn a step.
    """

    type: Literal["torsion_spring"]
    at: fields.At
    to: fields.Carrier = None
    stiffness: fields.TorsionalStiffness = 0.0
    damping: fields.TorsionalDamping = 0.0
    rest_angle: fields.FixedAngle = 0.0
    axis: fields.Axis | None = None


class SurfaceLoad(Model):
    """A force per area of the reference surface [N/m2] on a plate or shell, or on named faces of it."""

    type: Literal["surface_load"]
    body: BodyName
    force: fields.Traction
    faces: plate_fields.Names = ()
    history: fields.History | None = None


class PressureLoad(Model):
    """A pressure along the normal of the reference surface on a plate or shell in space, or on named faces of it.

    With `follower` it is constant, and keeps the direction and the area of the deformed surface.
    """

    type: Literal["pressure"]
    body: BodyName
    pressure: fields.SignedPressure
    faces: plate_fields.Names = ()
    history: fields.History | None = None
    follower: StrictBool = False

    @field_validator("follower")
    @classmethod
    def _constant(cls, value: bool, info: ValidationInfo) -> bool:
        if value and info.data.get("history") is not None:
            raise Problem("a constant pressure", "a history", "a pressure that follows has none: take out one of the two")
        return value


class NormalEdgeLoad(Model):
    """A constant force per length [N/m] of named edges of a planar plate along their outward normal, which turns with them."""

    type: Literal["normal_edge_load"]
    body: BodyName
    edges: plate_fields.Names
    force: fields.LineForce


class EdgeLoad(Model):
    """A force per length of named edges of a plate or shell in the reference [N/m]."""

    type: Literal["edge_load"]
    body: BodyName
    edges: plate_fields.Names
    force: fields.EdgeForce
    history: fields.History | None = None


Load: TypeAlias = Annotated[
    Gravity | PointForce | Follower | Moment | Torque | TorsionSpring | SurfaceLoad | PressureLoad | EdgeLoad | NormalEdgeLoad,
    Field(discriminator="type"),
]
