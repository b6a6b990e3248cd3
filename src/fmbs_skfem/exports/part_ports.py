"""A reduced part with its places as ports: what joints do at them comes in, where they are and how
fast they move goes out.

    M z'' + f(z) = M (1 x g) + sum_p P_p^T F_p + sum_p Q_p^T T_p,     y_p = P_p z, P_p z', ...

The part flies freely: what holds it is a force F_p [N] or a torque T_p [N m] that another program
gives at a place p. Each torque has the angular velocity of its place beside it, so that F . v + T .
w is the power that goes in.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

from ..bodies.body import Body
from ..core.errors import InputError, say
from ..core.notices import Notice
from ..core.values.fields import AXES
from ..core.values.inputs import Input
from ..dynamics import GeneralizedAlpha
from ..parts.excitation import turns
from ..reduction import cases
from ..reduction.cases import Case
from ..systems import At, System, assemble, change_coordinates, eliminate
from ..systems.forces import loads
from ..systems.forces.loads import Load
from ..systems.measures import orientations, probes
from ..systems.measures.probes import Probe
from ..systems.places import directions, vector


def case_of(
    part: Body, scheme: GeneralizedAlpha, duration: float, gravity: tuple[float, ...] = ()
) -> Case:
    """The motion of a part alone, at rest in its reference at the start, with inputs and outputs at
    all its places.

    `gravity` (c,) [m/s2] acts on it, none by default. InputError for a part without places.
    """
    return cases.unchecked(Case(system_of(part, gravity), scheme, duration))


def system_of(part: Body, gravity: tuple[float, ...] = ()) -> System:
    """The same as a reduced system: the coordinates of the part are its modes."""
    names = [*part.frames, *part.places]
    if not names:
        raise InputError(
            say(
                f"part '{part.name}'",
                "named places, which are its ports",
                "none",
                "train it with named places",
            )
        )
    weight = [loads.Gravity(tuple(vector("gravity", gravity, part.dim)))] if len(gravity) else []
    given = [load for name in names for load in inputs_at(part, name)]
    read = {
        f"{name}.{word}": probe for name in names for word, probe in outputs_at(part, name).items()
    }
    with warnings.catch_warnings():  # a torque about a line acts as soon as the line has turned
        warnings.filterwarnings("ignore", ".* are about the line itself", Notice)
        system = eliminate(assemble([part], [], [*weight, *given], outputs=read, pictures=False))
    return change_coordinates(system, np.eye(system.size), np.zeros(system.size))


def inputs_at(part: Body, name: str) -> Iterator[Load]:
    """A force at a place along every axis, and where it turns a torque about every axis; inputs are
    zero until they are given.
    """
    at = At(part.name, name)
    for axis, unit in zip(AXES, np.eye(part.dim), strict=False):
        word = f"{name}.force_{axis}"
        yield loads.PointForce(word, at, tuple(unit), Input(word, "N"))
    if turns(part, name) and part.dim == 2:
        yield loads.Moment(f"{name}.torque", at, 1.0, Input(f"{name}.torque", "N m"))
    elif turns(part, name):
        for axis, unit in zip(AXES, np.eye(3), strict=True):
            word = f"{name}.torque_{axis}"
            yield loads.Moment(word, at, tuple(unit), Input(word, "N m"))


def outputs_at(part: Body, name: str) -> dict[str, Probe]:
    """Position and velocity of a place and, where it turns, how: an angle in the plane, a rotation
    or a slope in space.
    """
    at = At(part.name, name)
    found: dict[str, Probe] = {"position": probes.Position(at), "velocity": probes.Velocity(at)}
    if not turns(part, name):
        return found
    if part.dim == 2:
        return found | {"angle": probes.Angle(at), "angular_velocity": probes.AngularVelocity(at)}
    turned = orientations.Rotation(at) if directions(part, name) == 3 else probes.Slope(at)
    return found | {
        "rotation" if directions(part, name) == 3 else "slope": turned,
        "angular_velocity": probes.AngularVelocity(at),
    }
