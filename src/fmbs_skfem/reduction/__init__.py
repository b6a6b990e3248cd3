"""Model reduction: snapshots, bases, Galerkin projection, hyper-reduction, errors and indicators,
files.
"""

from typing import TYPE_CHECKING

from ..core.beside import names_of
from ..core.values.ranges import Parameter, Scale

if TYPE_CHECKING:
    from . import affine, files, parameters
    from .accuracy import errors
    from .accuracy.errors import Errors, Norms, compare, residual_norms
    from .cases import Case, Family
    from .full_runs import TrainingTask, task_of
    from .hyper import ecsw, hyper_reduction, sampling
    from .hyper.ecsw import Level
    from .hyper.hyper_reduction import NONE, HyperReduction
    from .hyper.polynomial import Exact
    from .hyper.sampling import Elements, Points
    from .parameters import Search, search
    from .plan import Plan
    from .spaces import ffrf, galerkin, pivots, pod
    from .spaces.component import body_level, system_level
    from .spaces.ffrf import reduce_floating
    from .spaces.galerkin import Snapshots, bases, reduce_system, snapshots

#: module -> what is taken from it when it is first used: a check of a scene needs few of them
WHERE = {
    "": "affine files parameters",
    "accuracy": "errors",
    "accuracy.errors": "Errors Norms compare residual_norms",
    "cases": "Case Family",
    "full_runs": "TrainingTask task_of",
    "hyper": "ecsw hyper_reduction sampling",
    "hyper.ecsw": "Level",
    "hyper.hyper_reduction": "NONE HyperReduction",
    "hyper.polynomial": "Exact",
    "hyper.sampling": "Elements Points",
    "parameters": "Search search",
    "plan": "Plan",
    "spaces": "ffrf galerkin pivots pod",
    "spaces.component": "body_level system_level",
    "spaces.ffrf": "reduce_floating",
    "spaces.galerkin": "Snapshots bases reduce_system snapshots",
}

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
    "Parameter",
    "Scale",
    "parameters",
    "Case",
    "Family",
    "affine",
]

__getattr__ = names_of(__name__, WHERE)
