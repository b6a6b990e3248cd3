"""How a scene wants its reduced models trained and compared, with what options of a study replace."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from ..core.errors import InputError, say
from ..reduction import NONE, Elements
from ..reduction.accuracy.comparison import ComparisonOptions
from ..reduction.cases import Case
from ..reduction.full_runs import TrainingTask, task_of
from ..reduction.hyper import hyper_reduction
from ..reduction.plan import Plan, with_components
from ..scenes import build

if TYPE_CHECKING:
    import numpy as np

    from ..scenes import Scene
    from ..scenes.analyses.dynamic import Dynamic
    from ..scenes.schema import Reduction
    from ..systems import System

ETAS = (1e-2, 1e-3, 1e-4)  #: tolerances of the hyper-reduction in the picture of speed and error


def sections(scene: Scene) -> tuple[Dynamic, Reduction]:
    """The analysis of a scene and its section `reduction`, without which nothing is trained."""
    if scene.reduction is None or not scene.analysis.moves:
        got = f"analysis {scene.analysis.word}" if scene.reduction else "none"
        raise InputError(say(f"{scene.path or 'scene'}", "a dynamic analysis and a section 'reduction'", got, "add them"))
    return build.stepped(scene), scene.reduction


def interval(scene: Scene) -> float | np.ndarray:
    """Between snapshots, or their times [s]."""
    analysis, wanted = sections(scene)
    return analysis.step * build.snapshot_steps(scene) if isinstance(wanted.snapshots, tuple) else wanted.snapshots


def plan(scene: Scene) -> Plan:
    """How the scene wants its reduced models trained."""
    wanted = sections(scene)[1]
    hyper = wanted.hyper_reduction
    return Plan(
        components=wanted.components or {name: [name] for name in scene.bodies},
        tolerance=wanted.tolerance,
        modes=wanted.modes,
        hyper=hyper_reduction.named(hyper.sample, hyper.tolerance) if hyper else NONE,
        eliminate=wanted.constraints == "eliminate",
        invariant=wanted.basis == "invariant",
    )


def plan_with(
    scene: Scene,
    level: str,
    tolerance: float | None,
    modes: int | None,
    hyper: float | None,
    sample: str | None,
    basis: str | None = None,
) -> Plan:
    """The scene's plan with what the options replace."""
    if tolerance is not None and modes is not None:
        raise InputError(say("--tolerance and --modes", "one of them", "both"))
    if tolerance is not None and not 0 < tolerance < 1:
        raise InputError(say("--tolerance", "0 < eps < 1", tolerance, "1e-12 means a relative error of 1e-6"))
    if hyper is not None and not 0 <= hyper < 1:
        raise InputError(say("--hyper", "0 <= eta < 1", hyper, "1e-3 is usual, 0 means no hyper-reduction"))
    found = plan(scene)
    if level == "system":
        found = with_components(found, {"system": tuple(scene.bodies)})
    if basis is not None:
        found = replace(found, invariant=basis == "invariant")
    if tolerance is not None:
        found = replace(found, tolerance=tolerance, modes=None)
    if modes is not None:
        found = replace(found, modes=modes)
    own = found.hyper if found.hyper.tolerance else Elements()
    if hyper is not None:
        found = replace(found, hyper=replace(own, tolerance=hyper) if hyper else NONE)
    return found if sample is None else replace(found, hyper=hyper_reduction.named(sample, found.hyper.tolerance))


def task(scene: Scene, raw: System, plan: Plan) -> TrainingTask:
    """The reduction of one system of a scene, with all multipliers, by a plan."""
    analysis = build.stepped(scene)
    case = Case(raw, analysis.scheme, analysis.duration, analysis.newton)
    return task_of(case, plan, interval(scene), partial(build.chosen_form, scene))


def options(scene: Scene, quick: bool = False, expensive: bool = False) -> ComparisonOptions:
    """What the scene wants compared; `quick` leaves out other eps and eta, smaller steps and repetitions.

    An `expensive` full model runs only with those other steps that the scene lists.
    """
    step, wanted = build.dynamic(scene).step, scene.compare
    return ComparisonOptions(
        tolerances=() if quick or not wanted else tuple(wanted.tolerances),
        hyper_tolerances=() if quick or not wanted else ETAS,
        steps=tuple(other for other in (wanted.steps if wanted else ()) if other > step or not quick),
        ffrf_modes=wanted.ffrf_modes if wanted else None,
        repeat=1 if quick else 2,
        order=not quick,
        expensive=expensive,
        plain=not quick,
    )
