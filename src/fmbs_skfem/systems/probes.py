"""Outputs by name: what a scene wants to know over time. Vector outputs B have the columns B_x, B_y (, B_z)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

from ..core.errors import InputError, closest, say
from .joints import AXES
from .places import At, Draft
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


Probe = Position | Velocity | Slope | Deflection | Energy | Reaction


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
    return Output("position", rows(draft, name, probe.at, 1), columns(name, draft.layout.dim))


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
