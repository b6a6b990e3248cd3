"""Forces and torques of drives for motions that are given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ... import dynamics
from ...core.errors import InputError
from ...core.notices import Progress
from ...core.storage.records import dataclass
from ...core.values.fields import Time
from ...core.values.mappings import HIDDEN
from ...core.values.problems import Found, Problem
from ...dynamics import Trajectory, inverse_dynamics
from .. import times
from ..accuracy import Accuracy
from ..yamlfile import Oddity, where
from .analysis import Form, History, Work

if TYPE_CHECKING:
    from ...systems import System
    from ..schema import Scene

ITERATIONS = 3.0  #: of a position, usually


@dataclass(frozen=True, kw_only=True)
class InverseDynamics(History):
    """Torques and forces of drives for the motion that they prescribe, of rigid bodies whose motions
    are all driven: outputs `reaction` and `power` of the drives over time.

    Positions, velocities, accelerations and reactions follow at every instant from joints and
    drives, without time integration and its error; `step` is the time between instants. Where
    bodies bend, or a motion is left free, `type: dynamic` has the same outputs.

    {type: inverse_dynamics, duration: 2 s, step: 10 ms}
    """

    constraints: Form = None
    duration: Time
    step: Time
    tolerance: float | None = field(default=None, metadata=HIDDEN)
    accuracy: Accuracy | None = field(default=None, metadata=HIDDEN)
    floats: ClassVar[bool] = False
    label: ClassVar[str] = "solving"

    def instants(self) -> np.ndarray:
        return np.linspace(0.0, self.duration, max(round(self.duration / self.step), 1) + 1)

    def work(self) -> Work:
        count = len(self.instants())
        each = (ITERATIONS + 1) * count
        return Work(count, each, each, counts={"stored_states": count})

    def solve(
        self, system: System, advance: Progress | None = None, watch: Any = None, resume: Any = None
    ) -> Trajectory:
        return dynamics.solve_inverse_dynamics(system, self.instants(), advance)

    def examine(self, scene: Scene, raw: System) -> None:
        self.require(scene, raw)

    def require(self, scene: Scene, raw: System) -> None:
        try:
            inverse_dynamics.refuse_free(raw)
        except InputError as error:
            raise InputError(f"{where(scene, 'analysis')}: {error}") from error

    def problems_in(self, scene: Scene) -> Iterator[Found]:
        if self.accuracy is not None:
            expected = "an analysis with an error of steps or cells"
            remedy = "leave the accuracy out: results are exact at every instant"
            yield ("analysis", "accuracy"), Problem(expected, self.word, remedy)
        if not self.step <= self.duration <= times.STEPS * self.step:
            expected = (
                f"a step of at most the duration {self.duration:g} s, {times.STEPS} steps at most"
            )
            yield ("analysis", "step"), Problem(expected, f"{self.step:g} s")

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        if scene.initial.bodies:
            yield ("initial",), "does nothing, drives give the motion from the start on"
