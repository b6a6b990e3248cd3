"""True errors of models of a scene: against a run with four times the cells and the steps that
accuracies choose.

    e = max_c max_t |y_c - r_c| / range_c      of the columns c of all outputs, r of the reference

An error against the full model of the same mesh and step holds neither that of the mesh nor that of
the step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ...core.errors import InputError, say
from ...reduction.accuracy.comparison import Truth
from ...scenes.accuracy import Accuracy, Bound
from ...scenes.analyses.dynamic import AUTO
from ...scenes.field_kinds import Span
from ...scenes.schema import Scene
from .. import plans
from . import planned
from .pilots import ScenePilots

WANTED = 1e-2, 1e-3, 1e-4  #: accuracies whose choices stand beside the other models
FINER = 4  #: times the cells and the steps of the finest model


def find(scene: Scene, wanted: Sequence[float] = WANTED, allow_outside: bool = False) -> Truth:
    """The reference of a scene whose lines leave their cells open, and what accuracies choose, at
    the instants of its snapshots.

    InputError where the mesh of no line can be chosen.
    """
    analysis, reduction = plans.sections(scene)
    every = (
        reduction.snapshots
        if isinstance(reduction.snapshots, tuple)
        else (Span(reduction.snapshots),)
    )

    def asking(bound: float) -> Scene:
        mine = replace(analysis, step=AUTO, every=every, accuracy=Accuracy({"": Bound(bound)}))
        return replace(scene, analysis=mine, reduction=None)

    pilots = ScenePilots(asking(min(wanted)), allow_outside, pictures=True)
    if not pilots.open:
        raise InputError(
            say(
                "--true",
                "lines whose cells can be chosen",
                "none",
                "leave out their cells and `refine`",
            )
        )
    found = {bound: planned.find(asking(bound), allow_outside) for bound in wanted}
    cells = FINER * max(plan.cells or 0 for plan in found.values())
    most = max(
        analysis.duration / analysis.step,
        *(one["steps"] for plan in found.values() for one in plan.pilots),
    )
    steps = pilots.usual * math.ceil(FINER * most / pilots.usual - 1e-9)
    chosen = {
        f"accuracy {bound:g}": (
            pilots.system(plan.cells),
            plan.step,
            plan.local_error,
            plan.tolerance,
        )
        for bound, plan in found.items()
        if plan.met and plan.cells and plan.step and plan.tolerance
    }
    return Truth(pilots.solve(cells, steps), f"{cells} cells a line and {steps} steps", chosen)
