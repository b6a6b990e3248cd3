"""How good a motion is: the error of its energy balance, and the noise of its accelerations by round-off."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import dynamics
from ..core.notices import notify
from ..dynamics import GeneralizedAlpha, Trajectory
from ..systems.system import sizes

NOISE = 1e-3  #: noise of accelerations, relative to the largest, above which a warning is shown
GAIN = 0.05  #: rise of the energy balance, relative to the largest energy, above which a warning is shown


def balances(scheme: GeneralizedAlpha | None, trajectory: Trajectory) -> dict[str, Any]:
    """Energy error [J] of a full motion, and noise of its accelerations [m/s2]; None of equilibria."""
    if scheme is None:
        return {"energy_drift": None, "acceleration_noise": None}
    drift = energy_drift(trajectory, f"a step of {scheme.step:g} s")
    return {"energy_drift": drift, "acceleration_noise": acceleration_noise(scheme, trajectory)}


def energy_drift(trajectory: Trajectory, step: str) -> float:
    """Largest change of the energy balance [J], with a warning where the motion gains energy that nothing puts in."""
    drift, gain = dynamics.energy_errors(trajectory)
    if gain > GAIN:
        remedy = "halve it and compare, or take a smaller rho_inf"
        notify(f"the energy balance rises by {gain:.0%} of the largest energy: {step} is too large for this motion; {remedy}")
    return drift


def energy_of_reduced(motion: Trajectory) -> dict[str, Any]:
    """Largest change of the energy balance of a reduced model [J], and that over the largest change of an energy.

    A warning is shown where it rises, as of a full run, and where it falls: a full run loses energy to its step alone, a reduced
    one also where its basis does not hold the motion.
    """
    drift = energy_drift(motion, "the step, or the distance from the training,")
    kinds = dynamics.energies(motion)
    balance, scale = kinds[:, 3] - kinds[0, 3], float(np.ptp(kinds[:, :3], axis=0).max())
    change = float(np.abs(balance).max()) / scale if scale > 0.0 else 0.0
    fall = float(-balance.min()) / scale if scale > 0.0 else 0.0
    if fall > GAIN:
        cause = "the step, or the distance from the training, is too large"
        notify(f"the energy balance falls by {fall:.0%} of the largest energy: {cause}; compare with a full run")
    return {"energy_drift": drift, "energy_change": change}


def acceleration_noise(scheme: GeneralizedAlpha, trajectory: Trajectory) -> float:
    """Noise of accelerations by round-off [m/s2], with a warning where reactions show it."""
    noise = dynamics.acceleration_noise(scheme, trajectory.system)
    changes = np.diff(trajectory.v, axis=0) / np.diff(trajectory.times)[:, None]  # what noise hardly reaches
    largest = float(sizes(trajectory.system, changes).max(initial=0.0))
    if 0.0 < NOISE * largest < noise:
        share = f"{noise / largest:.1%} of the largest"
        text = f"round-off makes about {noise:.2g} m/s2 of noise in accelerations and reactions, {share}"
        notify(f"{text}: take a larger step, or a smaller rho_inf")
    return noise
