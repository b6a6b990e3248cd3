"""Families over parameters: greedy training with a Kriging surrogate, models of a whole range,
sweeps over processes.
"""

from . import calibration, greedy, kriging, parametric_model
from .training import FinishedTraining, train

__all__ = ["FinishedTraining", "calibration", "greedy", "kriging", "parametric_model", "train"]
