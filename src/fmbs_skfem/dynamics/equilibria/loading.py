r"""Loads and prescribed motions of statics over the load factor s, which stands for the time t = s
T.

    f(x) - Q(s) + Phi_x^T lambda = 0,  Phi(x, s) = 0
    loads without a history, and what is constant over time: times s;    histories and drives that vary: their values at s T

So a load of history t / T is a load without one, a constant displacement is reached in load steps,
and a drive goes its way.
"""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch
from typing import Any

import numpy as np
from scipy.sparse import csr_array, vstack

from ...core.algebra.linalg import is_sparse
from ...core.storage.records import dataclass
from ...systems.affine import Affine
from ...systems.forces import force_laws
from ...systems.forces import on_rows as forces
from ...systems.signals import Cosine, Sine
from ...systems.system import Signal, System
from ..histories import finite_signals

INSTANTS = 129  #: load factors from 0 to 1 at which a function of time is looked at
# a drive of 40 rad over three load steps came out as 2.3 rad; half turns are lost at pi, so that
# there is room for what else turns
RADIAN = 1.0  #: most that a driven angle turns between two equilibria [rad]: it is known but for half turns


@dataclass(frozen=True)
class Grown:
    """A function of the load factor s that grows with it.

        factor s + constant

    in the unit of a load or a displacement.
    """

    factor: float
    constant: float = 0.0

    def __call__(self, s: np.ndarray) -> np.ndarray:
        return np.asarray(self.factor * s + self.constant)


ADDED = Grown(1.0, -1.0)  #: history of what is added to constant loads over the load factor


@dataclass(frozen=True)
class Stretched:
    """A function of time at t = s T."""

    function: Signal
    end: float  #: T [s]

    def __call__(self, s: np.ndarray) -> np.ndarray:
        return np.asarray(self.function(self.end * np.asarray(s)))


@singledispatch
def over_factor(function: Any, end: float) -> Signal:
    """A function of time as one of the load factor: a constant grows, anything else is read at s T."""
    values = np.broadcast_to(
        np.asarray(function(end * np.linspace(0.0, 1.0, INSTANTS)), dtype=float), INSTANTS
    )
    return Grown(float(values[0])) if np.ptp(values) == 0.0 else Stretched(function, end)


@over_factor.register(Cosine)
@over_factor.register(Sine)
def _(function: Cosine | Sine, end: float) -> Signal:
    return replace(function, angle=over_factor(function.angle, end))


def ramp(system: System, end: float) -> System:
    """The system over the load factor in place of time; linear springs and torsion springs do not
    grow.

    The constant part of the force is that without the springs' part of a change of coordinates, as
    they are at rest in the reference. It stays, and what grows is added to it:

        Q0 (s - 1),    Q0 = constant - K x0
    """
    finite_signals(system, end * np.linspace(0.0, 1.0, INSTANTS))
    signals: tuple[Signal, ...] = (
        *(over_factor(function, end) for function in system.signals),
        Grown(1.0),
        ADDED,
    )
    loads = system.loads
    grow = len(system.signals)
    own = loads.constant - system.stiffness @ system.x0
    last, added = np.array([len(system.probes.offset)]), np.array([grow + 1])
    grown = (
        *(forces.grow(force, grow) for force in loads.forces),
        force_laws.dead(last, np.ones(1), added),
    )
    P = system.probes.matrix
    rows = (
        csr_array(vstack([P, csr_array(own[None, :])]))
        if is_sparse(P)
        else np.concatenate([P, own[None, :]])
    )
    return replace(
        system,
        probes=Affine(rows, np.append(system.probes.offset, 0.0)),
        loads=replace(loads, forces=grown),
        signals=signals,
        full=None if system.full is None else ramp(replace(system.full, full=None), end),
    )


def share(system: System, at: float) -> float:
    """The part of the constant loads that acts at a load factor, all of them in systems over time."""
    return at if system.signals and system.signals[-1] == ADDED else 1.0


def parts(system: System, before: float, after: float) -> int:
    """In how many parts a load step is taken so that no driven angle turns by more than RADIAN in
    one.

    Looked at are angles of histories that are cosines, at 129 load factors from `before` to
    `after`; 1 where nothing turns.
    """
    s = np.linspace(before, after, INSTANTS)
    angles = [function.angle(s) for function in system.signals if isinstance(function, Cosine)]
    turned = max((float(np.ptp(angle)) for angle in angles), default=0.0)
    return max(1, int(np.ceil(turned / RADIAN)))
