r"""Motions whose energy balance rises: how far a computed motion can be believed, and the error
where it explodes.

    rise = (T + U + V - W)(t) - (T + U + V - W)(0),    known = T(0) + U(0) + max |V| + max |W| up to t

T, U kinetic and strain energy, V the potential of constant loads from the start, W the work of
loads, drives and damping. A method that dissipates lets the balance fall, and what does work is in
W: a rise beyond what is known is the step's own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import Reason, SolverError
from ...core.values.arguments import checked
from ...core.values.fields import Time
from ..instants import SAME
from ..outputs import balance_of
from ..tracing import SOUND, Rise
from ..trajectory import Trajectory

TENFOLD = 9.0  #: rise over the known energy at which the energy is ten times what it can be


def rises(trajectory: Trajectory) -> np.ndarray:
    """Rise of the energy balance over the known energy (s,), less than zero where it falls; 0 where
    it cannot be judged.

    Where forces do work between states that are not stored, and no step has summed it, the balance
    says nothing.
    """
    count = len(trajectory.times)
    if count < 2 or (
        trajectory.work is None and count <= trajectory.statistics.steps and not passive(trajectory)
    ):
        return np.zeros(count)
    stored, work, doubt, balance, rest = balance_of(trajectory)
    return Rise().over_known(stored, work, balance, rest, doubt)


def passive(trajectory: Trajectory) -> bool:
    """Whether nothing but constant loads and damping does work."""
    system = trajectory.system
    return not system.signals and not any(map(len, system.loads.forces))


def last_sound(trajectory: Trajectory) -> int:
    """Number of the last stored state before the energy balance rises.

    The state before the first one whose rise is above 5 % of the known energy; the last one where
    there is none.
    """
    return before_rise(rises(trajectory))


def before_rise(rise: np.ndarray) -> int:
    """The same of the rises of all states (s,)."""
    wrong = np.flatnonzero(rise > SOUND)
    return max(int(wrong[0]) - 1, 0) if len(wrong) else len(rise) - 1


@checked
def unstable(trajectory: Trajectory, step: Time) -> SolverError | None:
    """The error of a motion in steps of `step` [s] whose energy balance rises tenfold, with its
    sound part; else None.

    `step` is that of the method. States within steps are not judged: between the first two of a
    plate under a torque that begins, energies of the polynomial are 7e4 times what is known of the
    motion until then. The error has the reason UNSTABLE, and as `partial` the motion up
    to the last sound state. It is returned, not raised; None also where the balance cannot be
    judged.
    """
    steps = trajectory.times / step
    rise = np.where(np.abs(steps - np.round(steps)) <= SAME, rises(trajectory), 0.0)
    wrong = np.flatnonzero(rise > TENFOLD)
    if not len(wrong):
        return None
    good = before_rise(rise)
    at = int(wrong[0])
    done = round(float(trajectory.times[good]) / step)
    partial = replace(
        trajectory.part(slice(good + 1)), statistics=replace(trajectory.statistics, steps=done)
    )
    text = f"{Reason.UNSTABLE.value}: at t = {trajectory.times[at]:.6g} s it is {1 + rise[at]:.3g} times what start, loads and drives "
    text += f"can give, and it rises from t = {trajectory.times[good]:.6g} s on; try a smaller step, or a smaller rho_inf"
    return SolverError(text, Reason.UNSTABLE, float(trajectory.times[good]) + step, (), partial)
