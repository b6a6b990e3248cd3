"""Outputs by name: what a scene wants to know over time. Vector outputs B have the columns B_x, B_y (, B_z).

Every column has a name of its own, and none is called `t`, which is the first one of every table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import singledispatch

import numpy as np
from scipy.sparse import csr_array, kron

from ..bodies import laws
from ..bodies.body import locate
from ..bodies.plate import local_table
from ..core.errors import InputError, closest, listed, say
from ..shapes import surface
from . import edges
from .gaps import AXES, arm, unit
from .places import At, Draft, Ground
from .system import Output

TIME = "t"  #: the first column of every table


@dataclass(frozen=True)
class Position:
    """Position of a point [m]; of one `component` alone in a column of the output's own name."""

    at: At
    component: str | None = None


@dataclass(frozen=True)
class Velocity:
    """Velocity of a point [m/s]; of one `component` alone in a column of the output's own name."""

    at: At
    component: str | None = None


@dataclass(frozen=True)
class Slope:
    """Slope dr/dS of a line at a point [-]; of one `component` alone in a column of the output's own name."""

    at: At
    component: str | None = None


@dataclass(frozen=True)
class Angle:
    """Angle [rad] turned since the reference, about z or, in space, about `axis`; its turns are counted between stored samples."""

    at: At
    axis: Ground | None = None


@dataclass(frozen=True)
class AngularVelocity:
    """Angular velocity [rad/s]: about z or, in space, its component along `axis`."""

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


def vector_output(kind: str, name: str, draft: Draft, probe: Position | Velocity | Slope, derivative: int = 0) -> Output:
    """The output of a vector at a point, or of one component of it."""
    read, axes = rows(draft, name, probe.at, derivative), AXES[: draft.layout.dim]
    if probe.component is None:
        return Output(kind, read, tuple(f"{name}_{axis}" for axis in axes))
    if probe.component not in tuple(axes):
        raise InputError(say(f"output '{name}'", f"one of the components {', '.join(axes)}", probe.component))
    return Output(kind, (read[axes.index(probe.component)],), (name,))


def require_distinct_columns(outputs: Mapping[str, Output]) -> None:
    """Raises an InputError that names the outputs where two columns, or one and the time, have the same name."""
    owner = {TIME: ""}
    for name, output in outputs.items():
        for column in output.columns:
            if column in owner:
                of = f"one of '{owner[column]}'" if owner[column] else "the time in every table"
                raise InputError(say(f"output '{name}'", "columns of its own", f"'{column}', which is also {of}", "rename one"))
            owner[column] = name


@sense.register
def _(probe: Position, name: str, draft: Draft) -> Output:
    return vector_output("position", name, draft, probe)


@sense.register
def _(probe: Velocity, name: str, draft: Draft) -> Output:
    return vector_output("velocity", name, draft, probe)


@sense.register
def _(probe: Slope, name: str, draft: Draft) -> Output:
    return vector_output("slope", name, draft, probe, 1)


@sense.register
def _(probe: Angle, name: str, draft: Draft) -> Output:
    return Output("angle", angle_rows(probe, name, draft), (name,))


@sense.register
def _(probe: AngularVelocity, name: str, draft: Draft) -> Output:
    if draft.layout.dim == 2:
        return Output("angular velocity", angle_rows(probe, name, draft), (name,))
    where = f"output '{name}'"
    arm(where, draft.layout, probe.at, probe.axis)
    axis, first = unit(f"{where}, axis", probe.axis, 3), draft.sensors.count
    for vector in draft.layout.vectors(where, probe.at):
        draft.sensors.add(vector)
    return Output("spin", tuple(range(first, draft.sensors.count)), (name,), parameters=tuple(float(a) for a in axis))


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
    vectors, dim = part.cells.law.vectors, part.dim
    indptr = np.arange(vectors + 1) * values.shape[3]
    jets = csr_array((local[0, 0, :vectors].ravel(), np.tile(shape.nodes[cell], vectors), indptr), shape=(vectors, shape.count))
    first = draft.sensors.add(draft.layout.widen(where, at.body, kron(edges.own(part, jets), np.eye(dim))))
    section = part.cells.section[:, 0, cell].copy()
    if dim == 3:
        section[3:6] = curved[0, 0]
    thickness = np.broadcast_to(part.thickness, len(shape.nodes))[cell]
    parameters = (float(laws.number(part.cells.law)), float(thickness), *(float(value) for value in section))
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
        expected = f"one of the joints {listed(known, probe.joint)}"
        raise InputError(say(f"output '{name}'", expected, f"'{probe.joint}'") + closest(probe.joint, known))
    return Output("reaction", (), tuple(f"{name}_{label.replace(' ', '_')}" for label in held), probe.joint)
