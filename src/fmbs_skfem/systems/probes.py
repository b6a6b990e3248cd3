"""Outputs by name: what a scene wants to know over time. Vector outputs B have the columns B_x, B_y (, B_z)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

import numpy as np
from scipy.sparse import csr_array, kron

from ..bodies import laws
from ..bodies.body import locate
from ..bodies.plate import local_table
from ..core.errors import InputError, closest, say
from ..shapes import surface
from . import edges
from .gaps import AXES, arm
from .places import At, Draft, Ground
from .system import Output


@dataclass(frozen=True)
class Position:
    """Position of a point [m]."""

    at: At


@dataclass(frozen=True)
class Velocity:
    """Velocity of a point [m/s]."""

    at: At


@dataclass(frozen=True)
class Slope:
    """Slope dr/dS of a line at a point [-]."""

    at: At


@dataclass(frozen=True)
class Angle:
    """Angle [rad] turned since the reference, about z or, in space, about `axis`: continuous over the stored samples."""

    at: At
    axis: Ground | None = None


@dataclass(frozen=True)
class AngularVelocity:
    """Rate [rad/s] of that angle."""

    at: At
    axis: Ground | None = None


@dataclass(frozen=True)
class Stress:
    """Von Mises stress [Pa] at a named point of a plate or shell: on the faces at -t/2 and t/2 along its normal."""

    at: At


@dataclass(frozen=True)
class Deflection:
    """Position of `tip` relative to `root`, normal to the root's slope [m]: with its sign in the plane, as a distance in space."""

    tip: At
    root: At


@dataclass(frozen=True)
class Energy:
    """Kinetic, strain, potential energy and balance [J]; the balance is kinetic + strain - work of all loads and drives."""


@dataclass(frozen=True)
class Reaction:
    """Force of a joint on the body it holds [N] (and moments of its slope rows [N m])."""

    joint: str


Probe = Position | Velocity | Slope | Angle | AngularVelocity | Stress | Deflection | Energy | Reaction


@singledispatch
def sense(probe: object, name: str, draft: Draft) -> Output:
    """Sensor rows and column names of an output; the rule for every probe type."""
    raise InputError(say(f"output '{name}'", "a probe", type(probe).__name__))


def rows(draft: Draft, name: str, at: At, derivative: int = 0) -> tuple[int, ...]:
    first = draft.sensors.add(draft.layout.read(f"output '{name}'", at, derivative))
    return tuple(range(first, first + draft.layout.dim))


def columns(name: str, dim: int) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}" for axis in AXES[:dim])


@sense.register
def _(probe: Position, name: str, draft: Draft) -> Output:
    return Output("position", rows(draft, name, probe.at), columns(name, draft.layout.dim))


@sense.register
def _(probe: Velocity, name: str, draft: Draft) -> Output:
    return Output("velocity", rows(draft, name, probe.at), columns(name, draft.layout.dim))


@sense.register
def _(probe: Slope, name: str, draft: Draft) -> Output:
    return Output("slope", rows(draft, name, probe.at, 1), columns(name, draft.layout.dim))


@sense.register
def _(probe: Angle, name: str, draft: Draft) -> Output:
    return Output("angle", angle_rows(probe, name, draft), (name,))


@sense.register
def _(probe: AngularVelocity, name: str, draft: Draft) -> Output:
    return Output("angular velocity", angle_rows(probe, name, draft), (name,))


def angle_rows(probe: Angle | AngularVelocity, name: str, draft: Draft) -> tuple[int, int]:
    """Sensor rows whose argument is the angle."""
    first = draft.sensors.add(arm(f"output '{name}'", draft.layout, probe.at, probe.axis)[0])
    return first, first + 1


@sense.register
def _(probe: Stress, name: str, draft: Draft) -> Output:
    where, at = f"output '{name}'", probe.at
    part, shape = edges.shape_of(where, draft, at.body)
    place = locate(part, at.place)
    if not isinstance(place, tuple) or part.cells is None:
        raise InputError(say(where, "a named point of a plate", at))
    cell = int(place[0])
    values = surface.basis(shape.space, np.array([cell]), np.array([place[1:]]))[None]
    reference = part.reference if part.spread is None else np.asarray(part.spread @ part.reference)
    local, _, curved = local_table(values, np.ones((1, 1)), reference[shape.nodes[[cell]]])
    vectors, dim = laws.vectors(part.cells.law), part.dim
    indptr = np.arange(vectors + 1) * values.shape[3]
    jets = csr_array((local[0, 0, :vectors].ravel(), np.tile(shape.nodes[cell], vectors), indptr), shape=(vectors, shape.count))
    first = draft.sensors.add(draft.layout.widen(where, at.body, kron(edges.own(part, jets), np.eye(dim))))
    section = part.cells.section[:, 0, cell].copy()
    if dim == 3:
        section[3:6] = curved[0, 0]
    thickness = np.broadcast_to(part.thickness, len(shape.nodes))[cell]
    parameters = (float(part.cells.law), float(thickness), *(float(value) for value in section))
    return Output("stress", tuple(range(first, first + vectors * dim)), (f"{name}_bottom", f"{name}_top"), parameters=parameters)


@sense.register
def _(probe: Deflection, name: str, draft: Draft) -> Output:
    read = rows(draft, name, probe.tip) + rows(draft, name, probe.root) + rows(draft, name, probe.root, 1)
    return Output("deflection", read, (name,))


@sense.register
def _(probe: Energy, name: str, draft: Draft) -> Output:
    return Output("energy", (), tuple(f"{name}_{part}" for part in ("kinetic", "strain", "potential", "balance")))


@sense.register
def _(probe: Reaction, name: str, draft: Draft) -> Output:
    held = [label for joint, label in draft.constraints.names if joint == probe.joint]
    if not held:
        known = sorted({joint for joint, _ in draft.constraints.names})
        raise InputError(
            say(f"output '{name}'", f"one of the joints {', '.join(known)}", f"'{probe.joint}'") + closest(probe.joint, known)
        )
    return Output("reaction", (), tuple(f"{name}_{label.replace(' ', '_')}" for label in held), probe.joint)
