"""Time integration, statics and vibration modes."""

from .integration import GeneralizedAlpha, Newton, Statistics, Trajectory, integrate
from .outputs import energies, energy_drift, outputs, reactions
from .statics import Modes, solve_equilibria, solve_statics, vibration_modes

__all__ = [
    "GeneralizedAlpha",
    "Newton",
    "Statistics",
    "Trajectory",
    "integrate",
    "solve_statics",
    "solve_equilibria",
    "Modes",
    "vibration_modes",
    "outputs",
    "reactions",
    "energies",
    "energy_drift",
]
