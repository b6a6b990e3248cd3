"""Time integration, statics, vibration modes, stability and buckling."""

from typing import TYPE_CHECKING

from ..core.beside import load, names_of
from .diagnoses import (  # which offer observers  # noqa: F401
    far_turns,
    fast_wheels,
    free_warping,
    linear_bodies,
    step_size,
)
from .outputs import energies, energy_drift, energy_errors, outputs, reactions

if TYPE_CHECKING:
    from .diagnoses.diagnosis import Diagnosis, explain
    from .diagnoses.stability import unstable
    from .equilibria.arclength import ArcLength, Branch, at_load_factor, follow_path, limit_points
    from .equilibria.statics import solve_equilibria, solve_statics
    from .integration import integrate
    from .inverse_dynamics import solve_inverse_dynamics
    from .many import integrate_many
    from .near_state.buckling import BucklingModes, buckling
    from .near_state.campbell import CampbellDiagram, campbell
    from .near_state.linear import Linear, Spin, in_rotating_frame, is_symmetric, linearise
    from .near_state.modes import (
        ComplexModes,
        VibrationModes,
        complex_modes,
        real_modes,
        vibration_modes,
    )
    from .near_state.shapes import Shapes, find_free, shares
    from .near_state.statespace import StateSpace, state_space
    from .scheme import GeneralizedAlpha, Newton, acceleration_noise
    from .trajectory import Crossing, Statistics, Trajectory

#: module -> what is taken from it when it is first used: a check of a scene needs few of them
WHERE = {
    "diagnoses.diagnosis": "Diagnosis explain",
    "diagnoses.stability": "unstable",
    "equilibria.arclength": "ArcLength Branch at_load_factor follow_path limit_points",
    "equilibria.statics": "solve_equilibria solve_statics",
    "integration": "integrate",
    "inverse_dynamics": "solve_inverse_dynamics",
    "many": "integrate_many",
    "near_state.buckling": "BucklingModes buckling",
    "near_state.campbell": "CampbellDiagram campbell",
    "near_state.linear": "Linear Spin in_rotating_frame is_symmetric linearise",
    "near_state.modes": "ComplexModes VibrationModes complex_modes real_modes vibration_modes",
    "near_state.shapes": "Shapes find_free shares",
    "near_state.statespace": "StateSpace state_space",
    "scheme": "GeneralizedAlpha Newton acceleration_noise",
    "trajectory": "Crossing Statistics Trajectory",
}

__all__ = [
    "GeneralizedAlpha",
    "Newton",
    "Statistics",
    "Trajectory",
    "Crossing",
    "integrate",
    "integrate_many",
    "solve_statics",
    "solve_equilibria",
    "solve_inverse_dynamics",
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

__getattr__ = names_of(__name__, WHERE)
load()
