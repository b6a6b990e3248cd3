r"""Loads: probe rows and forces.

    gravity       Q = M (1 x g)                         point force    Q = P^T f s(t)
    moment        Q = P_t^T s(t) m x t / |t|^2          follower       Q = P_r^T s(t) (f_t t + f_n n) / |t|

with the slope t = dr/dS, its normal n (t turned by 90 degrees in the plane), and a history s(t), 1 by default.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from ..core.errors import InputError, say
from .places import At, Draft, Ground, vector
from .system import LoadKind, PointLaw, Signal


@dataclass(frozen=True)
class Gravity:
    """Uniform acceleration of all bodies (c,) [m/s2]."""

    acceleration: Ground


@dataclass(frozen=True)
class PointForce:
    """A force of fixed direction (c,) [N]."""

    name: str
    at: At
    force: Ground
    history: Signal | None = None


@dataclass(frozen=True)
class Follower:
    """A force that turns with the slope: (tangential, normal) in the plane, tangential only in space [N]."""

    name: str
    at: At
    force: Ground
    history: Signal | None = None


@dataclass(frozen=True)
class Moment:
    """A moment [N m]: about z in the plane, a fixed vector (3,) in space (its part along the slope does nothing)."""

    name: str
    at: At
    moment: float | Ground
    history: Signal | None = None


Load = Gravity | PointForce | Follower | Moment
Force = tuple[list[tuple[int, float, int]], list[PointLaw]]  #: terms (probe row, coefficient, signal) and point laws


@singledispatch
def force(load: object, draft: Draft) -> Force:
    """Terms and laws of a load; the rule for every load type. Gravity has none: it is the constant M (1 x g)."""
    raise InputError(say("loads", "a load", type(load).__name__))


def history(draft: Draft, function: Signal | None) -> int:
    return -1 if function is None else draft.signal(function)


@force.register
def _(load: Gravity, draft: Draft) -> Force:
    return [], []


@force.register
def _(load: PointForce, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    first, signal = draft.probes.add(draft.layout.read(where, load.at)), history(draft, load.history)
    return [(first + c, float(f), signal) for c, f in enumerate(vector(where, load.force, draft.layout.dim))], []


@force.register
def _(load: Follower, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    size = 2 if draft.layout.dim == 2 else 1
    parts = np.zeros(3)
    parts[:size] = vector(where, load.force, size)
    position, slope = draft.probes.add(draft.layout.read(where, load.at)), draft.probes.add(draft.layout.read(where, load.at, 1))
    return [], [PointLaw(LoadKind.TANGENTIAL, slope, position, history(draft, load.history), parts)]


@force.register
def _(load: Moment, draft: Draft) -> Force:
    where = f"load '{load.name}'"
    planar = draft.layout.dim == 2
    axis = np.array([0.0, 0.0, float(np.asarray(load.moment))]) if planar else vector(where, load.moment, 3)
    slope = draft.probes.add(draft.layout.read(where, load.at, 1))
    return [], [PointLaw(LoadKind.MOMENT, slope, -1, history(draft, load.history), axis)]
