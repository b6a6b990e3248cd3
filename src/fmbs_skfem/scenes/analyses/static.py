"""Equilibria."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from ... import dynamics
from ...core.errors import SolverError
from ...core.notices import Progress, notify, remark
from ...core.storage.records import dataclass
from ...core.values.fields import Count, Time
from ...core.values.problems import Found, Problem
from ...dynamics import Newton, Trajectory, initial
from ...dynamics.equilibria import loading
from ...dynamics.near_state import modes
from ...systems.free_motions import unsupported
from .. import field_kinds as fields
from ..accuracy import Wanted, of_outputs
from ..yamlfile import Oddity
from .analysis import Form, History, Work, motion_only, refuse_swings, refuse_unsupported

if TYPE_CHECKING:
    from ...systems import System
    from ..schema import Scene

ITERATIONS = 6.0  #: of a load step, usually


@dataclass(frozen=True, kw_only=True)
class Static(History):
    """Equilibrium by load steps, or by arc length along a path through limit points, its first step
    1/load_steps.

    The load factor s goes from 0 to 1 and stands for t = s `time`: histories and drives are taken
    there. Loads without a history, and displacements, angles and histories that are constant, grow
    with s. At branch points of its path arc length goes straight on, or takes the other branch.

    For an `accuracy` (a part of the range of every output, 1e-3, an error, 1 mm, or errors by
    output) the cells of lines that have none are found by pilot runs, and every number comes with
    its error.

    {type: static, load_steps: 20}
    """

    method: Literal["load_steps", "arc_length"] = "load_steps"
    branch: dynamics.Branch = "straight"
    constraints: Form = None
    load_steps: Count = 10
    time: Time = 1.0
    accuracy: Wanted | None = None
    tolerance: fields.NewtonTolerance = 1e-10
    clock: ClassVar[bool] = False
    masses: ClassVar[bool] = False
    floats: ClassVar[bool] = False
    label: ClassVar[str] = "loading"

    def instants(self) -> np.ndarray:
        return self.time * np.linspace(0.0, 1.0, self.load_steps + 1)

    def work(self) -> Work:
        iterations = self.load_steps * ITERATIONS
        return Work(4 * iterations, iterations, counts={"load_steps": self.load_steps})

    def solve(
        self, system: System, advance: Progress | None = None, watch: Any = None, resume: Any = None
    ) -> Trajectory:
        newton = Newton(tolerance=self.tolerance)
        arc = self.method == "arc_length"
        control = dynamics.ArcLength(1.0 / self.load_steps, branch=self.branch)
        try:
            if arc:
                found = dynamics.follow_path(system, control, newton, self.time, advance)
            else:
                found = dynamics.solve_statics(system, self.load_steps, newton, self.time, advance)
        except SolverError as error:
            if not system.components and (free := unsupported(system.full or system)[0]):
                motions = "; ".join(map(str, free))
                error.args = (f"nothing resists that {motions}: hold this by joints; {error}",)
            raise
        if unstable := modes.instability(found):
            text = f"analysis: {unstable}: the structure does not stay there"
            way = (
                "`branch: other` takes the other branch"
                if arc
                else "give it a small load to the side and `method: arc_length`"
            )
            notify(f"{text}; {way}, and see `type: buckling`")
        if arc and self.branch == "straight":
            for one in found.crossings:
                if one.kind == "branch point":
                    text = f"analysis: a branch point lies at load factor {one.after:.4g}, where the path goes straight on"
                    remark(f"{text}; `branch: other` takes the other")
        return found

    def problems_in(self, scene: Scene) -> Iterator[Found]:
        if self.accuracy is not None:
            yield from of_outputs(self.accuracy, scene.outputs, ("analysis", "accuracy"))
            if self.method == "arc_length":
                got = "arc_length, whose steps lie elsewhere on every mesh"
                yield (
                    ("analysis", "accuracy"),
                    Problem(
                        "load steps, which all meshes have in common", got, "leave the accuracy out"
                    ),
                )

    def require_joints(self, system: System) -> None:
        initial.jacobian_at_start(loading.ramp(system, self.time))

    def examine(self, scene: Scene, raw: System) -> None:
        """Rigid motions that nothing resists; weight may hold one, as of a chain."""
        refuse_unsupported(scene, raw)
        self.require(scene, raw)

    def require(self, scene: Scene, raw: System) -> None:
        refuse_swings(scene, raw, self.time)

    def idle(self, scene: Scene) -> Iterator[Oddity]:
        yield from motion_only(scene, "an equilibrium")
        if self.branch == "other" and self.method != "arc_length":
            yield ("analysis", "branch"), "load steps take no branch; `method: arc_length` does"
