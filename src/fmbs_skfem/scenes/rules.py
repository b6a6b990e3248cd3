"""Joints, loads and outputs of a scene become those of a system; a rule for every type of the schema."""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch

from ..core.errors import InputError, say
from ..systems import joints, loads, probes
from ..systems.places import At
from . import schema
from .fields import Place, Vector


@singledispatch
def joint(model: object, name: str) -> joints.Joint:
    """The joint of a model; a rule for every joint type."""
    raise InputError(say(f"joint '{name}'", "a joint", type(model).__name__))


@joint.register
def _(model: schema.Pin, name: str) -> joints.Pin:
    return joints.Pin(name, at(model.at), other(model.to))


@joint.register
def _(model: schema.Clamp, name: str) -> joints.Clamp:
    return joints.Clamp(name, at(model.at))


@joint.register
def _(model: schema.Weld, name: str) -> joints.Weld:
    return joints.Weld(name, at(model.at), carrier(model.to))


@joint.register
def _(model: schema.DrivenAngle, name: str) -> joints.DrivenAngle:
    return joints.DrivenAngle(name, at(model.at), model.angle, model.axis, carrier(model.to))


@joint.register
def _(model: schema.DrivenPosition, name: str) -> joints.DrivenPosition:
    return joints.DrivenPosition(name, at(model.at), model.displacement)


@joint.register
def _(model: schema.Distance, name: str) -> joints.Distance:
    to = other(model.to)
    if to is None:
        raise InputError(say(f"joint '{name}'", "a place or a fixed point in 'to'", "ground"))
    return joints.Distance(name, at(model.at), to, model.length)


@joint.register
def _(model: schema.Slider, name: str) -> joints.Slider:
    return joints.Slider(name, at(model.at), model.direction, carrier(model.to))


@joint.register
def _(model: schema.Revolute, name: str) -> joints.Revolute:
    return joints.Revolute(name, at(model.at), other(model.to), model.axis)


@joint.register
def _(model: schema.Universal, name: str) -> joints.Universal:
    return joints.Universal(name, at(model.at), other(model.to), model.axis, model.axis_to)


@joint.register
def _(model: schema.Prismatic, name: str) -> joints.Prismatic:
    return joints.Prismatic(name, at(model.at), model.direction, carrier(model.to))


@joint.register
def _(model: schema.Cylindrical, name: str) -> joints.Cylindrical:
    return joints.Cylindrical(name, at(model.at), model.axis, carrier(model.to))


@joint.register
def _(model: schema.Gear, name: str) -> joints.Gear:
    return joints.Gear(name, at(model.at), at(model.to), model.teeth, carrier(model.carrier), model.axis, model.axis_b)


@joint.register
def _(model: schema.Edge, name: str) -> joints.Edge:
    return joints.Edge(name, model.body, model.edges, model.fixed, model.slope)


@joint.register
def _(model: schema.RimNodes, name: str) -> joints.RimNodes:
    to = other(model.to)
    if to is None:
        raise InputError(say(f"joint '{name}'", "a place or a fixed point in 'to'", "ground"))
    return joints.RimNodes(name, model.body, model.edges, to)


@singledispatch
def load(model: object, name: str) -> loads.Load:
    """The load of a model; a rule for every load type."""
    raise InputError(say(f"load '{name}'", "a load", type(model).__name__))


@load.register
def _(model: schema.Gravity, name: str) -> loads.Gravity:
    return loads.Gravity(model.acceleration)


@load.register
def _(model: schema.PointForce, name: str) -> loads.PointForce:
    return loads.PointForce(name, at(model.at), model.force, model.history)


@load.register
def _(model: schema.Follower, name: str) -> loads.Follower:
    return loads.Follower(name, at(model.at), model.force, model.history)


@load.register
def _(model: schema.Moment, name: str) -> loads.Moment:
    return loads.Moment(name, at(model.at), model.moment, model.history)


@load.register
def _(model: schema.Torque, name: str) -> loads.Moment:
    return loads.Moment(name, at(model.at), model.torque, model.history)


@load.register
def _(model: schema.TorsionSpring, name: str) -> loads.TorsionSpring:
    to = carrier(model.to)
    return loads.TorsionSpring(name, at(model.at), to, model.stiffness, model.damping, model.rest_angle, model.axis)


@load.register
def _(model: schema.SurfaceLoad, name: str) -> loads.SurfaceLoad:
    return loads.SurfaceLoad(name, model.body, model.force, model.history, model.faces)


@load.register
def _(model: schema.PressureLoad, name: str) -> loads.NormalPressure | loads.FollowerPressure:
    if model.follower:
        return loads.FollowerPressure(name, model.body, model.pressure, model.faces)
    return loads.NormalPressure(name, model.body, model.pressure, model.history, model.faces)


@load.register
def _(model: schema.EdgeLoad, name: str) -> loads.EdgeLoad:
    return loads.EdgeLoad(name, model.body, model.edges, model.force, model.history)


@load.register
def _(model: schema.NormalEdgeLoad, name: str) -> loads.FollowerEdgeLoad:
    return loads.FollowerEdgeLoad(name, model.body, model.edges, model.force)


@singledispatch
def probe(model: object) -> probes.Probe:
    """The probe of a model; a rule for every output type."""
    raise InputError(say("outputs", "an output", type(model).__name__))


@probe.register
def _(model: schema.PointOutput) -> probes.Probe:
    kinds: dict[str, Callable[[At, str | None], probes.Probe]] = {
        "position": probes.Position, "velocity": probes.Velocity, "slope": probes.Slope,
    }  # fmt: skip
    return kinds[model.type](at(model.at), model.component)


@probe.register
def _(model: schema.DeflectionOutput) -> probes.Deflection:
    return probes.Deflection(at(model.tip), at(model.root))


@probe.register
def _(model: schema.EnergyOutput) -> probes.Energy:
    return probes.Energy()


@probe.register
def _(model: schema.ReactionOutput) -> probes.Reaction:
    return probes.Reaction(model.joint)


@probe.register
def _(model: schema.AngleOutput) -> probes.Probe:
    kind = probes.Angle if model.type == "angle" else probes.AngularVelocity
    return kind(at(model.at), model.axis)


@probe.register
def _(model: schema.StressOutput) -> probes.Stress:
    return probes.Stress(at(model.at))


def at(place: Place) -> At:
    """A place of the scene as a place of the system; a point mass has the one place `center`, a rigid body has it too."""
    if place.s is not None:
        return At(place.body, place.s)
    return At(place.body, place.group or "center")


def other(to: Place | Vector | None) -> At | Vector | None:
    """The other side of a joint."""
    return at(to) if isinstance(to, Place) else to


def carrier(to: Place | None) -> At | None:
    """The other side of a joint that has directions; None is the ground."""
    return None if to is None else at(to)
