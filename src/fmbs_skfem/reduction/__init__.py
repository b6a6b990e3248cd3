"""Model reduction: snapshots, bases, Galerkin projection, hyper-reduction, comparators, errors and indicators, files; families."""

from ..core.ranges import Parameter, Scale
from . import (
    affine,
    calibration,
    ecsw,
    errors,
    excitation,
    ffrf,
    files,
    galerkin,
    greedy,
    hyper_reduction,
    kriging,
    parameters,
    parametric_model,
    part_files,
    parts,
    pivots,
    pod,
    sampling,
)
from .cases import Case, Family
from .component import body_level, system_level
from .errors import Errors, Norms, compare, residual_norms
from .ffrf import reduce_floating
from .full_runs import TrainingTask, task_of
from .galerkin import Snapshots, bases, reduce_system, snapshots
from .hyper_reduction import NONE, HyperReduction
from .parameters import Search, search
from .plan import Plan
from .polynomial import Exact
from .sampling import Elements, Level, Points
from .training import FinishedTraining, train

__all__ = [
    "Snapshots",
    "snapshots",
    "pod",
    "system_level",
    "body_level",
    "bases",
    "galerkin",
    "pivots",
    "reduce_system",
    "ecsw",
    "hyper_reduction",
    "HyperReduction",
    "NONE",
    "sampling",
    "Level",
    "Elements",
    "Points",
    "Exact",
    "parts",
    "excitation",
    "part_files",
    "ffrf",
    "reduce_floating",
    "errors",
    "Errors",
    "compare",
    "Norms",
    "residual_norms",
    "files",
    "Plan",
    "TrainingTask",
    "task_of",
    "Search",
    "search",
    "FinishedTraining",
    "train",
    "Parameter",
    "Scale",
    "parameters",
    "Case",
    "Family",
    "affine",
    "kriging",
    "greedy",
    "calibration",
    "parametric_model",
]
