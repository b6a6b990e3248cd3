"""How good a motion is: the error of its energy balance, and the noise of its accelerations by
round-off.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import dynamics
from ...control import sampled_loops
from ...core.notices import notify
from ...dynamics import GeneralizedAlpha, Trajectory
from ...dynamics.diagnoses.step_size import drives_that_jump
from ...dynamics.outputs import sizes_of
from ...dynamics.tracing import CLEAR

#: noise of accelerations, relative to the largest, above which a warning is shown
NOISE = 1.0 / CLEAR
JUMP = 0.01  #: of the largest velocity, by which those at the start differ from the given ones where joints change them
STILL = 1e-10  #: displacement, over the size of the system, up to which it rests: what Newton leaves of an equilibrium is less
GAIN = 0.05  #: rise of the energy balance, relative to the largest energy, above which a warning is shown
LOSS = 0.01  #: fall of the energy balance, likewise: by damping of the method that motions in small steps hardly feel


def balances(scheme: GeneralizedAlpha | None, trajectory: Trajectory) -> dict[str, Any]:
    """Energy error [J] of a full motion, and noise of its accelerations [m/s2]; None of equilibria."""
    if scheme is None:
        return {"energy_drift": None, "acceleration_noise": None}
    steps = round(float(trajectory.times[-1]) / scheme.step)
    cause = f"a step of {scheme.step:g} s is too large for this motion"
    remedy = "halve it and compare, or take a larger rho_inf"
    if drives_that_jump(
        trajectory.system, scheme.step, steps
    ):  # an impulse, which no step and no damping makes right
        cause, remedy = "a drive jumps within one step", "let it change over many steps"
    elif (
        np.abs(trajectory.v[0] - trajectory.system.v0).max(initial=0.0)
        > JUMP * sizes_of(trajectory)[:, 0].max()
    ):
        cause, remedy = (
            "velocities jump at the start",
            "give bodies those of their joints and drives, or let drives begin gently",
        )
    elif cycle := limit_cycle(trajectory):
        cause = (
            f"{cycle}, which excites vibrations that a step of {scheme.step:g} s does not resolve"
        )
        remedy = "lower its gains, or give the bodies more damping; halve the step to see what hangs on them"
    drift = energy_drift(trajectory, cause, remedy)
    return {"energy_drift": drift, "acceleration_noise": acceleration_noise(scheme, trajectory)}


def limit_cycle(motion: Trajectory) -> str:
    """The limit cycle of a controller whose jumps excite bodies that bend; beside a rise the step
    is wrong, whatever else is.
    """
    told = sampled_loops.tell_limit_cycle(motion.system) if motion.system.elastic else ""
    return told if told and dynamics.energy_errors(motion).rise <= GAIN else ""


def energy_drift(trajectory: Trajectory, cause: str, remedy: str) -> float:
    """Largest change of the energy balance [J], with a warning where it rises or falls, its cause,
    and a remedy.
    """
    errors = dynamics.energy_errors(trajectory)
    said = list[str]()
    if errors.rise > GAIN:
        said.append(f"rises by {errors.rise:.0%}")
        remedy = remedy.replace("larger rho_inf", "smaller rho_inf")
    if errors.fall > LOSS:
        said.append(f"falls by {errors.fall:.1%}")
    if said:
        # a rise and a fall ask for opposite schemes
        todo = remedy.partition(", or")[0] if len(said) == 2 else remedy
        notify(
            f"the energy balance {' and '.join(said)} of the largest energy or work: {cause}; {todo}"
        )
    return errors.drift


def energy_of_reduced(motion: Trajectory) -> dict[str, Any]:
    """Largest change of the energy balance of a reduced model [J], and that over the largest change
    of an energy.

    A full run loses energy to its step alone, a reduced one also where its basis does not hold the
    motion.
    """
    drift = energy_drift(
        motion,
        "the step, or the distance from the training, is too large for this motion",
        "compare with a full run",
    )
    kinds = dynamics.energies(motion)
    scale = float(np.ptp(kinds[:, :3], axis=0).max())
    change = float(np.abs(kinds[:, 3] - kinds[0, 3]).max()) / scale if scale > 0.0 else 0.0
    return {"energy_drift": drift, "energy_change": change}


def acceleration_noise(scheme: GeneralizedAlpha, trajectory: Trajectory) -> float:
    """Noise of accelerations by round-off [m/s2], with a warning where reactions show it."""
    noise = dynamics.acceleration_noise(scheme, trajectory.system)
    # changes of velocities, which noise hardly reaches
    _, largest, moved = sizes_of(trajectory).max(axis=0).tolist()
    if 0.0 < NOISE * largest < noise and moved > STILL * trajectory.system.scale:
        share = (
            f"{noise / largest:.1%} of the largest"
            if noise < largest
            else "more than the motion has"
        )
        text = f"round-off makes about {noise:.2g} m/s2 of noise in accelerations and reactions, {share}"
        notify(f"{text}: take a larger step, or a smaller rho_inf")
    return noise
