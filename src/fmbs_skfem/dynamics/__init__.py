"""Time integration, statics and vibration modes."""

from .arclength import ArcLength, at_load_factor, follow_path, limit_points
from .diagnosis import Diagnosis, explain
from .integration import integrate
from .many import integrate_many
from .outputs import energies, energy_drift, energy_errors, outputs, reactions
from .scheme import GeneralizedAlpha, Newton, acceleration_noise
from .stability import unstable
from .statics import Modes, solve_equilibria, solve_statics, vibration_modes
from .trajectory import Statistics, Trajectory

__all__ = [
    "GeneralizedAlpha",
    "Newton",
    "Statistics",
    "Trajectory",
    "integrate",
    "integrate_many",
    "solve_statics",
    "solve_equilibria",
    "ArcLength",
    "follow_path",
    "limit_points",
    "at_load_factor",
    "Modes",
    "vibration_modes",
    "outputs",
    "reactions",
    "energies",
    "energy_drift",
    "acceleration_noise",
    "energy_errors",
    "unstable",
    "Diagnosis",
    "explain",
]
