"""Time integration, statics, vibration modes, stability and buckling."""

from . import fast_wheels, feed, finer_parts, step_size  # which offer observers  # noqa: F401
from .arclength import ArcLength, Branch, at_load_factor, follow_path, limit_points
from .buckling import BucklingModes, buckling
from .campbell import CampbellDiagram, campbell
from .diagnosis import Diagnosis, explain
from .integration import integrate
from .linear import Linear, Spin, in_rotating_frame, is_symmetric, linearise
from .live import LiveRun, start
from .many import integrate_many
from .modes import ComplexModes, VibrationModes, complex_modes, real_modes, vibration_modes
from .outputs import energies, energy_drift, energy_errors, outputs, reactions
from .scheme import GeneralizedAlpha, Newton, acceleration_noise
from .shapes import Shapes, find_free, shares
from .stability import unstable
from .statespace import StateSpace, state_space
from .statics import solve_equilibria, solve_statics
from .trajectory import Crossing, Statistics, Trajectory

__all__ = [
    "GeneralizedAlpha",
    "Newton",
    "Statistics",
    "Trajectory",
    "Crossing",
    "integrate",
    "integrate_many",
    "start",
    "LiveRun",
    "solve_statics",
    "solve_equilibria",
    "ArcLength",
    "Branch",
    "follow_path",
    "limit_points",
    "at_load_factor",
    "VibrationModes",
    "vibration_modes",
    "real_modes",
    "Spin",
    "in_rotating_frame",
    "Linear",
    "linearise",
    "is_symmetric",
    "StateSpace",
    "state_space",
    "ComplexModes",
    "complex_modes",
    "Shapes",
    "shares",
    "find_free",
    "CampbellDiagram",
    "campbell",
    "BucklingModes",
    "buckling",
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
