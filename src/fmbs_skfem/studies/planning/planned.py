"""A scene with an accuracy becomes one with the cells and the step that meet it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, field, replace
from typing import Any

import numpy as np

from ...core.errors import Reason, SolverError, listed
from ...core.notices import Progress, notify
from ...core.storage.records import dataclass
from ...dynamics.compiled_step.parts import FINEST
from ...scenes import build, times
from ...scenes.schema import Scene
from .levels import with_levels
from .pilots import ScenePilots
from .planner import (
    LEAST,
    NOTHING,
    ROACHE,
    SHARE,
    AccuracyPlan,
    Limits,
    Pilot,
    Unresolved,
    plan,
    size,
)
from .reduced_pilots import ReducedPilots, reduce_pilots

USUAL = 6  #: pilot runs of a plan
#: of an equilibrium whose meshes are all given, and whose parts are judged
UNPLANNED = AccuracyPlan(0, 1, NOTHING, NOTHING, ())
TRAIN = "train its parts on such states, or take more of their shape functions"


@dataclass(frozen=True)
class Planned:
    """What was found for an accuracy, in plain values: a part of reports, from which the same scene
    is made again.
    """

    wanted: str
    met: bool
    why_not: str  #: sensitive, steps, cells, parts, doubt; nothing where it is met
    steps: int | None  #: of a motion
    step: float | None  #: [s]
    cells: int | None  #: of every line that has none of its own; None where all have
    of_step: float  #: largest error of the step, over what is wanted
    of_mesh: float | None  #: of the mesh; None where no mesh is judged
    driven_by: str  #: the column whose error is largest beside what is wanted of it
    #: time up to which a motion can be trusted that more steps do not settle [s]
    trusted_until: float | None
    errors: dict[str, float]  #: of columns, in their units
    #: all runs: cells, steps, whether resolved, difference over wanted
    pilots: list[dict[str, Any]] = field(default_factory=list)
    local_error: float = 0.0  #: of a step over the size of the mechanism, above which it is divided; 0 for equal steps
    tolerance: float | None = None  #: of Newton's iteration, over that size, in a motion
    #: largest error of parts, over what is wanted; None where none knows more shapes than it has
    of_parts: float | None = None

    @property
    def words(self) -> str:
        """What was chosen and what it errs by, in a sentence."""
        cells = [f"{self.cells} cells a line"] if self.cells else []
        levels = (
            f", in up to {2**FINEST} parts where one errs by {self.local_error:.2g} of the size"
            if self.local_error
            else ""
        )
        newton = f", Newton's tolerance {self.tolerance:.2g}" if self.tolerance else ""
        steps = [f"{self.steps} steps of {self.step:.4g} s{levels}{newton}"] if self.step else []
        chosen = f"accuracy {self.wanted}: {', '.join([*cells, *steps, f'found by {len(self.pilots)} pilot runs'])}"
        mesh = "unknown" if self.of_mesh is None else f"{self.of_mesh:.2g}"
        step = f"step {self.of_step:.2g}, " if self.step else ""
        parts = "" if self.of_parts is None else f", parts {self.of_parts:.2g}"
        shares = f"error over what is wanted: {step}mesh {mesh}{parts}" + (
            f", largest in {self.driven_by}" if self.driven_by else ""
        )
        return f"{chosen}; {shares}"

    def scene(self, scene: Scene) -> Scene:
        """The scene with what was found for it."""
        return scene.chosen(self.cells, self.step, self.local_error, self.tolerance)


def find(
    scene: Scene,
    allow_outside: bool = False,
    progress: Progress | None = None,
    within: bool = False,
) -> Planned:
    """Cells and step for the accuracy of a scene; warnings of what is not met, or not judged.
    States may lie `within` steps.

    SolverError where no number of steps resolves the motion, InputError for an accuracy that no
    output has the unit of.
    """
    analysis = build.history(scene)
    pilots = ScenePilots(scene, allow_outside, within)
    fewest = pilots.fewest if pilots.open else 1
    cells = 2 * fewest if pilots.open else 1 if pilots.refined else 0
    motion = build.dynamic(scene) if analysis.moves else None
    if motion is None and not cells and pilots.with_finer_parts(0) is None:
        return nothing_to_find(pilots)
    given = not analysis.open
    unit = pilots.unit
    limits = (
        Limits(
            times.STEPS // unit * unit,
            unit=unit,
            whole=pilots.grid,
            fewest=fewest,
            usual=pilots.usual,
        )
        if motion
        else Limits(1, fewest=fewest)
    )
    steps = 0 if motion is None else round(motion.duration / motion.step) if given else pilots.usual
    made = 0

    def see(pilot: Pilot) -> None:
        nonlocal made
        made += 1
        if progress:
            progress(made / (made + USUAL))  # nobody knows how many there will be

    large = reduce_pilots(pilots) if motion and not given and not pilots.open else None
    try:
        found = (
            plan_of_large(pilots, large, limits, see)
            if large
            else plan(pilots, cells, steps, bool(pilots.open), not given, limits, see)
            if steps or cells
            else UNPLANNED
        )
    except Unresolved as error:
        assert motion is not None  # equilibria say themselves why they are not found
        text = f"{error.steps} steps of {motion.duration / error.steps:.3g} s do not resolve the motion"
        raise SolverError(
            f"analysis.accuracy: {text}; look at loads and joints, or give a step",
            Reason.NOT_CONVERGED,
        ) from error
    if motion and not given and pilots.rough and found.met and not motion.local_error:
        found = with_levels(pilots, found, limits, pilots.usual, see)
    if pilots.open and pilots.refined:
        found = with_given_meshes(pilots, found, see, pilots.usual)
    found = with_parts(pilots, found, see)
    errors = dict(zip(pilots.titles, found.errors.T.tolist(), strict=True))
    result = Planned(
        str(pilots.accuracy),
        found.met,
        found.why or ("" if found.met else short_of(found, given and motion is not None)),
        found.steps if motion else None,
        motion.duration / found.steps if motion else None,
        found.cells if pilots.open else None,
        size(found.time),
        size(found.mesh) if cells else None if pilots.unjudged else 0.0,
        max(errors, key=lambda name: errors[name][0]),
        min(pilots.trusted(*pair) for pair in found.pairs) if found.pairs else None,
        {name: own for name, (_, own) in errors.items()},
        [asdict(one) for one in found.pilots],
        found.local_error,
        pilots.tolerance(found.steps, found.local_error) if motion else None,
        None if found.parts is None else size(found.parts),
    )
    warn(result, given, pilots, found.apart)
    return result


def plan_of_large(
    pilots: ScenePilots, reduced: ReducedPilots, limits: Limits, see: Callable[[Pilot], None]
) -> AccuracyPlan:
    """A plan whose steps are found by a reduced model, and whose meshes are judged by full ones."""
    limits = replace(limits, share=SHARE)
    found = plan(reduced.pilots, 0, reduced.steps, limits=limits, see=see)
    found = replace(found, time=found.time + reduced.apart)
    return with_given_meshes(pilots, found, see, reduced.steps) if pilots.refined else found


def nothing_to_find(pilots: ScenePilots) -> Planned:
    """What an accuracy of an equilibrium finds where no mesh can be chosen or refined: rigid bodies
    and springs are exact.
    """
    result = Planned(
        str(pilots.accuracy), not pilots.unjudged, "", None, None, None, 0.0, None, "", None, {}
    )
    tell_unjudged(pilots)
    return result


def short_of(found: AccuracyPlan, given: bool) -> str:
    """What keeps a plan from its accuracy: parts, or the mesh where the step is not `given`."""
    if found.parts is not None and size(found.time + found.mesh) <= 1.0:
        return "parts"
    return "steps" if given else "cells"


def with_given_meshes(
    pilots: ScenePilots, found: AccuracyPlan, see: Callable[[Pilot], None], least: int
) -> AccuracyPlan:
    """A plan whose steps, and cells of lines, were chosen, with the errors of the meshes that are
    given, from a run with these once finer in so many steps at least.
    """
    finer = ScenePilots(pilots.refined_by(2), pilots.allow_outside)
    told = beside(pilots, finer, found, see, least)
    if told is None:
        pilots.unjudged += pilots.refined
        return found
    difference, pilot = told
    return replace(
        found, mesh=found.mesh + LEAST / (LEAST - 1.0) * difference, pilots=(*found.pilots, pilot)
    )


def with_parts(
    pilots: ScenePilots, found: AccuracyPlan, see: Callable[[Pilot], None]
) -> AccuracyPlan:
    """A plan with the errors of parts, from a run with all shapes that these know, which errs by a
    small part of that.
    """
    finer = pilots.with_finer_parts(found.cells)
    told = None if finer is None else beside(pilots, finer, found, see, pilots.usual)
    if told is None:
        return found
    difference, pilot = told
    return replace(found, parts=ROACHE * difference, pilots=(*found.pilots, pilot))


def beside(
    pilots: ScenePilots,
    finer: ScenePilots,
    found: AccuracyPlan,
    see: Callable[[Pilot], None],
    least: int,
) -> tuple[np.ndarray, Pilot] | None:
    """Differences (2, k) of the runs of a plan from those of a finer system, with the fewest of its
    steps, but the `least`, that resolve both.
    """
    resolved = (one.steps for one in found.pilots if one.resolved and one.steps >= least)
    steps = min(resolved, default=found.steps)
    one = pilots.run(found.cells, steps)
    other = finer.run(found.cells, steps)
    while (one is None or other is None) and steps < found.steps:
        steps = min(2 * steps, found.steps)
        one = pilots.run(found.cells, steps)
        other = finer.run(found.cells, steps)
    if one is None or other is None:
        return None
    difference = pilots.differ(one, other)
    see(pilot := Pilot(found.cells, steps, True, size(difference)))
    return difference, pilot


def warn(found: Planned, given: bool, pilots: ScenePilots, apart: str) -> None:
    """Warnings of an accuracy that is not met, and of what nobody has judged; runs that are `apart`
    do not settle.
    """
    if found.trusted_until is not None:
        text = f"more {apart.split()[-1]} do not settle {found.driven_by}: runs of {apart} agree within the accuracy"
        notify(f"{text} up to t = {found.trusted_until:.4g} s only")
    elif not found.met:
        parts = {
            "step": found.of_step,
            "mesh": found.of_mesh or 0.0,
            "parts": found.of_parts or 0.0,
        }
        what = max(parts, key=lambda name: parts[name])
        remedies = {
            "step": "leave the step out to have that found" if given else "",
            "mesh": pilots.remedy,
            "parts": TRAIN,
        }
        about = f"the error is about {sum(parts.values()):.2g} times what is wanted, mostly by the {what}"
        notify(
            f"the accuracy {found.wanted} is not met: {about}; {remedies[what] or 'ask for less'}"
        )
    tell_unjudged(pilots)


def tell_unjudged(pilots: ScenePilots) -> None:
    """A warning of meshes that stay as they are."""
    if pilots.unjudged:
        notify(
            f"errors are without those of the meshes of {listed(pilots.unjudged)}, which are as they are given"
        )
