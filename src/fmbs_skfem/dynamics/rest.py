"""The start of a motion in the equilibrium of its loads at t = 0.

    f(x) - Q(0) + Phi_x^T lambda = 0,  Phi(x, 0) = 0;    v = u + omega x r at x, by the rigid motion (u, omega) of v0 at x0

Histories and drives have their values at t = 0, inputs and controllers those that they start with,
and forces that depend on rates see none. Velocities are no part of the equilibrium: the initial
motion of the system is put on top of it, turned with every body.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.algebra import ranks
from ..core.errors import InputError, Reason, SolverError, say
from ..core.notices import Notice, Progress, notify
from ..systems import free_motions
from ..systems.compiled import compile_system
from ..systems.connections import hinged_rims, mechanism
from ..systems.system import System, project
from .equilibria.statics import solve_statics
from .near_state import modes
from .scheme import Newton
from .trajectory import Trajectory

LOAD_STEPS = 10  #: to the equilibrium
FREE = "hold them by joints, or start from the reference"


class Rest(NamedTuple):
    """Where a motion starts, in the unknowns of its system."""

    x: np.ndarray  #: (n,)
    v: np.ndarray  #: (n,)
    #: (l,) what forces keep, such as turns of springs; None for what they start with
    memory: np.ndarray | None


def in_equilibrium(system: System, newton: Newton, progress: Progress | None = None) -> Rest:
    """The equilibrium of `solve_statics` at t = 0, and the initial velocities there.

    A warning says that it is unstable. InputError where there is none as bodies are free to move,
    SolverError, without a partial trajectory, where none is found otherwise.
    """
    whole = system.full or system
    if not whole.components and (swings := hinged_rims.pushed(whole, 0.0)):
        raise unheld(swings, "`slopes: true` of the rim clamps it")
    try:
        path = loaded(system, newton, progress)
        if unstable := modes.instability(path):
            notify(
                f"the start of the motion: {unstable}: the smallest disturbance moves the bodies away; use `start: reference`"
            )
    except Notice as notice:
        notice.partial = None
        raise
    except SolverError as error:
        if not whole.components and (free := free_motions.unsupported(whole)[0]):
            raise unheld(free, FREE) from error
        text = "no equilibrium with the loads at t = 0 was found"
        raise SolverError(
            f"{text}: {error}, or use `start: reference`", Reason.NO_EQUILIBRIUM, 0.0, error.worst
        ) from error
    x = path.x[-1]
    return Rest(x, turned(system, x), None if path.memory is None else path.memory[-1])


def has_equilibrium(system: System, newton: Newton) -> bool:
    """Whether an equilibrium of the loads at t = 0 is found from the reference."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        try:
            loaded(system, newton)
        except SolverError:
            return False
    return True


def unheld(free: Sequence[free_motions.FreeMotion], remedy: str) -> InputError:
    """The error of motions that nothing resists."""
    got = f"motions that nothing resists: {'; '.join(map(str, free))}"
    return InputError(say("start: equilibrium", "bodies that joints and springs hold", got, remedy))


def loaded(system: System, newton: Newton, progress: Progress | None = None) -> Trajectory:
    """The path to the equilibrium: in one step from near it, where a state is known, or by load
    steps from x0.

    A hyper-reduction knows the forces of states like those of its training, not of those between
    the reference and the equilibrium. What forces keep, as turns of springs, is known by load steps
    alone.
    """
    if len(system.near) and not len(compile_system(system).memory):
        with contextlib.suppress(SolverError):
            return solve_statics(system, 1, newton, 0.0, begin=system.near)
    return solve_statics(system, LOAD_STEPS, newton, 0.0, progress and (lambda _: progress(0.0)))


def turned(system: System, x: np.ndarray) -> np.ndarray:
    """Velocities (n,) at x (n,) of the rigid motions of all bodies that v0 is at x0; what is none
    of them stays as it is.
    """
    if not system.v0.any():
        return system.v0
    start = system.lift(system.x0)
    now = system.lift(x)
    given = system.lift.matrix @ system.v0
    change = np.zeros(len(start))
    for (_, first, last), B in zip(
        system.coordinates, mechanism.motions(system, start), strict=True
    ):
        rates = ranks.least(B, given[first:last])[system.dim :] / system.scale
        apart = (now - start)[first:last].reshape(-1, system.dim)
        axes = np.eye(3)[2 if system.dim == 2 else 0 :]
        change[first:last] = sum(
            rate * mechanism.turn(apart, axis).ravel()
            for rate, axis in zip(rates, axes, strict=True)
        )
    return system.v0 + project(system.lift.matrix, change)
