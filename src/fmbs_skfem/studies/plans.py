"""How a scene wants its reduced models trained and compared, with what options of a study replace."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from ..core import own_words
from ..core.errors import InputError, closest, say
from ..core.notices import remark
from ..core.storage.records import dataclass
from ..reduction import NONE, Elements
from ..reduction.accuracy.comparison import ComparisonOptions
from ..reduction.cases import Case
from ..reduction.full_runs import (
    FullRun,
    Measure,
    OutputMeasure,
    TrainingTask,
    errors_of_outputs,
    task_of,
)
from ..reduction.hyper import hyper_reduction
from ..reduction.plan import USUAL, Components, Plan, with_components
from ..scenes import build, extensions
from ..scenes.accuracy import ALL

if TYPE_CHECKING:
    import numpy as np

    from ..dynamics import Trajectory
    from ..scenes import Scene
    from ..scenes.accuracy import Accuracy
    from ..scenes.analyses.dynamic import Dynamic
    from ..scenes.schema import Reduction
    from ..systems import System
    from .planning.planned import Planned

ETAS = (1e-2, 1e-3, 1e-4)  #: tolerances of the hyper-reduction in the picture of speed and error
SHARE = 0.3  #: of the accuracy of a scene that a reduced model may use up: step and mesh of the full model use most of it


@dataclass(frozen=True)
class Goal:
    """The accuracy that a reduced model is trained for, and which tolerances follow from it."""

    accuracy: Accuracy
    eps: bool
    eta: bool


@dataclass(frozen=True)
class AccuracyMeasure:
    """e(mu) of the outputs: the largest error over what the accuracy allows; NaN where it bounds no
    output that is known.
    """

    accuracy: Accuracy

    def __call__(self, raw: System, run: FullRun, motion: Trajectory) -> float:
        return max(
            self.accuracy.parts(errors_of_outputs(raw, run, motion)).values(), default=math.nan
        )


def sections(scene: Scene) -> tuple[Dynamic, Reduction]:
    """The analysis of a scene and its section `reduction`, without which nothing is trained."""
    if scene.reduction is None or not scene.analysis.moves:
        got = f"analysis {scene.analysis.word}" if scene.reduction else "none"
        raise InputError(
            say(
                f"{scene.path or 'scene'}",
                "a dynamic analysis and a section 'reduction'",
                got,
                "add them",
            )
        )
    return build.stepped(scene), scene.reduction


def interval(scene: Scene) -> float | np.ndarray:
    """Between snapshots, or their times [s]."""
    analysis, wanted = sections(scene)
    return (
        analysis.step * build.snapshot_steps(scene)
        if isinstance(wanted.snapshots, tuple)
        else wanted.snapshots
    )


def components(scene: Scene, bodies: Components | None = None) -> Components:
    """Components of a scene: those of its bodies that are given, by default each by itself but for
    bodies whose joints want one basis, and one of every coordinate of a joint.
    """
    joints = scene.joints.values()
    of_joints = {name: [name] for joint in joints for name in joint.coordinates}
    if bodies:
        return {**bodies, **of_joints}
    alone: dict[str, list[str]] = {name: [name] for name in scene.bodies}
    for joint in joints:
        first, *more = [alone[name] for name in joint.share_basis] or [[]]
        for other in more:
            if other is not first:
                first += other
                alone |= dict.fromkeys(other, first)
    return {members[0]: members for members in alone.values()} | of_joints


def plan(scene: Scene) -> Plan:
    """How the scene wants its reduced models trained."""
    wanted = sections(scene)[1]
    hyper = wanted.hyper_reduction
    return Plan(
        components=components(scene, wanted.components),
        tolerance=USUAL if wanted.tolerance is None else wanted.tolerance,
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
        raise InputError(
            say("--tolerance", "0 < eps < 1", tolerance, "1e-12 means a relative error of 1e-6")
        )
    if hyper is not None and not 0 <= hyper < 1:
        raise InputError(
            say("--hyper", "0 <= eta < 1", hyper, "1e-3 is usual, 0 means no hyper-reduction")
        )
    found = plan(scene)
    chosen = None if sample is None else sampling_named(scene, sample)
    if level == "system":
        alone = {name for joint in scene.joints.values() for name in joint.coordinates}
        found = with_components(
            found, {"system": tuple(scene.bodies)} | {name: [name] for name in sorted(alone)}
        )
    if basis is not None:
        found = replace(found, invariant=basis == "invariant")
    if tolerance is not None:
        found = replace(found, tolerance=tolerance, modes=None)
    if modes is not None:
        found = replace(found, modes=modes)
    own = found.hyper if found.hyper.tolerance else Elements()
    if hyper is not None:
        found = replace(found, hyper=replace(own, tolerance=hyper) if hyper else NONE)
    return (
        found
        if chosen is None
        else replace(found, hyper=hyper_reduction.named(chosen, found.hyper.tolerance))
    )


def sampling_named(scene: Scene, name: str) -> str:
    """The name of a hyper-reduction, which files of a scene may declare: they have been run when it
    was read.
    """
    known = hyper_reduction.KNOWN
    found = own_words.meant(name, known, extensions.modules(scene.extensions, scene.folder))
    if found not in known:
        raise InputError(
            say("--sample", f"one of {', '.join(known)}", f"'{name}'") + closest(name, known)
        )
    if found != name:
        remark(
            f"--sample: '{name}' is '{found}' of a file that the scene lists, not that of the package"
        )
    return found


def goal(
    scene: Scene,
    accuracy: Accuracy | None,
    tolerance: float | None,
    modes: int | None,
    hyper: float | None,
) -> Goal | None:
    """What a reduced model is trained for, where there is an accuracy: tolerances that neither
    scene nor options give follow.
    """
    if accuracy is None:
        return None
    own = sections(scene)[1]
    sampling = own.hyper_reduction
    eps = all(given is None for given in (tolerance, modes, own.tolerance, own.modes))
    return Goal(accuracy, eps, hyper is None and (sampling is None or sampling.tolerance is None))


def tolerance_for(accuracy: Accuracy) -> tuple[float, Measure]:
    """The wanted error of a training for an accuracy, and the measure that it is in."""
    every = accuracy.bounds.get(ALL)
    if every is None or every.unit or len(accuracy.bounds) > 1:
        return SHARE, AccuracyMeasure(accuracy)
    return SHARE * every.value, OutputMeasure()


def budget(found: Planned | None, reduction: float) -> dict[str, float]:
    """Errors over what is wanted by what makes them: step and mesh of the full model as far as
    these are known, the reduction.
    """
    full = {} if found is None else {"step": found.of_step, "mesh": found.of_mesh}
    parts = {name: part for name, part in full.items() if part is not None} | {
        "reduction": reduction
    }
    return parts | {"together": sum(parts.values())}


def budget_words(parts: dict[str, float]) -> str:
    """A budget in a line."""
    return f"error over what is wanted: {', '.join(f'{name} {part:.2g}' for name, part in parts.items())}"


def task(
    scene: Scene, raw: System, plan: Plan, snapshots: float | np.ndarray | None = None
) -> TrainingTask:
    """The reduction of one system of a scene, with all multipliers, by a plan; without `snapshots`
    [s] with those of the scene.
    """
    analysis = build.stepped(scene)
    case = Case(raw, analysis.scheme, analysis.duration, analysis.newton)
    return task_of(
        case,
        plan,
        interval(scene) if snapshots is None else snapshots,
        partial(build.chosen_form, scene),
    )


def options(scene: Scene, quick: bool = False, expensive: bool = False) -> ComparisonOptions:
    """What the scene wants compared; `quick` leaves out other eps and eta, smaller steps and
    repetitions.

    An `expensive` full model runs only with those other steps that the scene lists.
    """
    step = build.dynamic(scene).step
    wanted = scene.compare
    return ComparisonOptions(
        tolerances=() if quick or not wanted else tuple(wanted.tolerances),
        hyper_tolerances=() if quick or not wanted else ETAS,
        steps=tuple(
            other for other in (wanted.steps if wanted else ()) if other > step or not quick
        ),
        ffrf_modes=wanted.ffrf_modes if wanted else None,
        repeat=1 if quick else 2,
        order=not quick,
        expensive=expensive,
        plain=not quick,
    )
