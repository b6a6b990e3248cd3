"""What is trained, as a scene and the options of a study say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...core.storage.records import dataclass
from ...families import prediction
from ...families import training as trainings
from .. import models, plans

if TYPE_CHECKING:
    from ...families.greedy import Options
    from ...reduction.full_runs import TrainingTask
    from ...reduction.parameters import Search
    from ...scenes import Scene
    from ...scenes.points import TrainingPoints


@dataclass(frozen=True)
class TrainingOrder:
    """What is trained, and where hold-out runs are made."""

    scene: Scene
    task: TrainingTask
    search: Search
    options: Options
    points: TrainingPoints
    tolerance: float | None  #: wanted error in the measure of the task
    aim: float = 1.0  #: part of it that the model is to keep at hold-out points
    #: whether it ends where no model can be faster than the full one of an accuracy
    must_pay: bool = False
    #: wanted largest errors of outputs, of which `tolerance` 1 is the whole
    allowed: Mapping[str, float] | None = None

    @property
    def proof(self) -> dict[str, Any]:
        """What the training is told of its checks: where hold-out points follow, they show whether
        the model is good enough.
        """
        follow = len(self.points.holdout) >= prediction.PROOFS
        proofs = trainings.CHECKS if follow else 0
        return {
            "checks": trainings.CHECKS,
            "proofs": proofs,
            "aim": self.aim,
            "must_pay": self.must_pay,
        }

    @property
    def measure(self) -> str:
        """What errors are, in words."""
        if self.task.measure is None:
            return "error of the displacements over their size"
        if isinstance(self.task.measure, plans.AccuracyMeasure):
            return "error of the outputs over the accuracy"
        return "error of the outputs over their tolerances" if self.allowed else models.RANGES
