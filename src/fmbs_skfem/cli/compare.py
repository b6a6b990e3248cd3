"""`fmbs compare`: full, reduced, coarser and larger-step models of one scene, the error beside the time.

The tables have the layout of those of doi 10.1016/j.cma.2019.112690; where a scene is one of its examples, the published figures
stand beside ours.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, MissingFeature, say
from . import common, figures, render, reports, screen
from .common import Result, Session
from .figures import cloud as cloud
from .figures import draw as draw
from .figures import figure_names as figure_names
from .tables import tables as tables

if TYPE_CHECKING:
    from ..reduction.comparison import Comparison, Options, Record
    from ..reduction.full_runs import TrainingTask
    from ..reduction.plan import Plan
    from ..scenes import Scene
    from ..systems import System

RECORD = "compare.json"
ETAS = (1e-2, 1e-3, 1e-4)  #: tolerances of the hyper-reduction in the picture of speed and error
SECOND = 1.5  #: smallest observed order in time that counts as second
AS_GOOD = 2.0  #: factor to the smallest error of a hyper-reduced model within which the fastest is chosen


@common.command("compare")
@click.option("--quick", is_flag=True, help="Only the main models, coarser meshes and larger steps; every model runs once.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of the analysis.")
@click.option(
    "--picture/--no-picture", default=True, help="Draw the bodies, moving, and the error of a reduced model (default: yes)."
)
def command(session: Session, quick: bool, duration: float | None, picture: bool) -> Result:
    """Compare reduced models of SCENE with its full model and with cheaper full models.

    Writes compare.json and figures into --out, or into ./fmbs-NAME-compare where NAME.yaml is the scene.
    """
    scene = common.read_scene(session, duration)
    names = (RECORD, *figure_names(scene), figures.ERROR, render.PICTURE, render.ANIMATION)
    out = reports.folder(session, f"fmbs-{common.stem(scene)}-compare", names, reports.fingerprint(scene), RECORD)
    screen.announce_compiling(scene.path)
    with screen.progress("comparing") as advance:
        study = run(scene, quick, session.allow_outside, advance)
    report = report_of(scene, study)
    files, missing = draw(scene, study, out), None
    try:
        files += figures.render(scene, study, out) if picture else []
    except MissingFeature as error:
        missing = error
        report = {**report, **common.failed(error)}
    made = {"fingerprint": reports.fingerprint(scene), "provenance": reports.provenance(scene)}
    found = {**report, **made, "files": [out / RECORD, *files]}
    reports.keep(session, out, found, RECORD)
    return Result(found, [*tables(scene, study), *words(report), "written: " + ", ".join(map(str, found["files"]))], missing)


def run(
    scene: Scene, quick: bool = False, allow_outside: bool = False, progress: Callable[[float], None] | None = None
) -> Comparison:
    """The comparison of a scene, as its sections `reduction` and `compare` say."""
    from ..reduction import comparison
    from ..scenes import build

    raw = build.system(scene, allow_outside=allow_outside)
    wanted = scene.compare.coarse if scene.compare else []
    coarse = {cells: build.system(scene, cells, allow_outside) for cells in wanted}
    settings = options(scene, quick, build.has_large_plates(scene, raw))
    return comparison.run(task(scene, raw, plan(scene)), settings, coarse, progress)


def plan(scene: Scene) -> Plan:
    """How the scene wants its reduced models trained."""
    from ..reduction.hyper_reduction import NONE, named
    from ..reduction.plan import Plan

    wanted = scene.reduction
    if wanted is None or scene.analysis.type != "dynamic":
        got = f"analysis {scene.analysis.type}" if wanted else "none"
        raise InputError(say(f"{scene.path or 'scene'}", "a dynamic analysis and a section 'reduction'", got, "add them"))
    hyper = wanted.hyper_reduction
    return Plan(
        components=wanted.components or {name: [name] for name in scene.bodies},
        tolerance=wanted.tolerance,
        modes=wanted.modes,
        hyper=named(hyper.sample, hyper.tolerance) if hyper else NONE,
        eliminate=wanted.constraints == "eliminate",
    )


def task(scene: Scene, raw: System, plan: Plan) -> TrainingTask:
    """The reduction of one system of a scene, with all multipliers, by a plan."""
    from ..dynamics import GeneralizedAlpha, Newton
    from ..reduction.cases import Case
    from ..reduction.full_runs import task_of
    from ..scenes import build

    analysis = build.dynamic(scene)
    case = Case(raw, GeneralizedAlpha(analysis.step, analysis.rho_inf), analysis.duration, Newton(tolerance=analysis.tolerance))
    return task_of(case, plan, interval(scene), partial(build.chosen_form, scene))


def interval(scene: Scene) -> Any:
    """Time between snapshots [s], or their times where they are listed span by span."""
    from ..scenes import build

    snapshots = scene.reduction.snapshots if scene.reduction else 0.0
    return build.dynamic(scene).step * build.snapshot_steps(scene) if isinstance(snapshots, tuple) else snapshots


def options(scene: Scene, quick: bool = False, expensive: bool = False) -> Options:
    """What the scene wants compared; `quick` leaves out other eps and eta, smaller steps and repetitions.

    An `expensive` full model runs only with those other steps that the scene lists.
    """
    from ..reduction.comparison import Options
    from ..scenes import build

    step, wanted = build.dynamic(scene).step, scene.compare
    return Options(
        tolerances=() if quick or not wanted else tuple(wanted.tolerances),
        hyper_tolerances=() if quick or not wanted else ETAS,
        steps=tuple(other for other in (wanted.steps if wanted else ()) if other > step or not quick),
        ffrf_modes=wanted.ffrf_modes if wanted else None,
        repeat=1 if quick else 2,
        order=not quick,
        expensive=expensive,
        plain=not quick,
    )


def report_of(scene: Scene, study: Comparison) -> dict[str, Any]:
    """The JSON object of a study."""
    from ..results import speed
    from . import solving

    best, chosen = cheapest(study), choice(study)
    return {
        "status": "ok",
        "scene": common.title(scene),
        "models": [dataclasses.asdict(record) for record in study.records],
        "outputs": {name: solving.extremes(values) for name, values in figures.drawn_outputs(study.full).items()},
        "time_error": dataclasses.asdict(study.time_error) if study.time_error else None,
        "front": speed.front_in_words(figures.points(study)),
        "pays_after": best.name if best else None,
        "pays_after_runs": best.pays_after_runs if best else None,
        "choice": chosen.name if chosen else None,
    }


def cheapest(study: Comparison) -> Record | None:
    """The fastest of the main reduced models whose training pays."""
    paying = [record for record in study.records if record.main and record.pays_after_runs is not None]
    return min(paying, key=lambda record: record.cpu_s, default=None)


def choice(study: Comparison) -> Record | None:
    """The fastest hyper-reduced model, ECSW or exact polynomial, of those about as exact as the best of them."""
    found = [r for r in study.records if r.main and r.hyper not in ("", "none") and math.isfinite(r.max_error)]
    best = min((r.max_error for r in found), default=0.0)
    return min((r for r in found if r.max_error <= AS_GOOD * best), key=lambda r: r.cpu_s, default=None)


def words(report: Mapping[str, Any]) -> list[str]:
    """Who is on the front, how large the error of the time step is, and when training pays."""
    pays = report["pays_after_runs"]
    gain = "Training does not pay." if pays is None else f"Training of {report['pays_after']} pays after {math.ceil(pays)} runs."
    note = "Names end in eps, or eps/eta, where these are not the scene's. "
    note += "Errors on the front are the largest distances from the full model [m]; training is not in the CPU times."
    return [report["front"], note, time_words(report["time_error"]), gain, *choice_words(report)]


def time_words(found: Mapping[str, Any] | None) -> str:
    """The error of the time step, beside which errors of reduced models have to be read."""
    if found is None:
        return "The error of the full model's own step is unknown: list half or twice the step under compare.steps."
    order = found["order"]
    text = f"Error of the full model's own step {found['step']:g} s: {found['position']:.2g} m"
    text += "" if order is None else f", observed order {order:.2f}"
    slow = order is not None and order < SECOND
    return f"{text}; below 2, so that a part of the motion is faster than the step resolves." if slow else f"{text}."


def choice_words(report: Mapping[str, Any]) -> list[str]:
    """Exact polynomial or ECSW, and what happens to the gap between the two levels."""
    models = {model["name"]: model for model in report["models"] if model["status"] == "done"}
    chosen, exact = models.get(report["choice"]), models.get("component+exact")
    if chosen is None or exact is None:
        return []
    text = f"Choice: {chosen['name']}, {chosen['cpu_s']:.3g} s CPU at an error of {chosen['max_error']:.1e}; "
    text += f"the exact polynomial by component takes {exact['cpu_s']:.3g} s at {exact['max_error']:.1e}, without training."
    parts = "Seconds for force and tangent, solves and products are the time of one call, measured apart, times the calls counted; "
    parts += "the total also holds mass, joints, predictor and storing."
    return [text, *gap_words(models), parts]


def gap_words(models: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Whether the system level is less exact than the component level at one eps."""
    pair = [models.get(f"{level}+exact") for level in ("system", "component")]
    if pair[0] is None or pair[1] is None:
        return []
    ratio = pair[0]["max_error"] / pair[1]["max_error"]
    modes = [" + ".join(str(count) for count in model["modes"].values()) for model in pair if model]
    text = f"System against component level at one eps: errors {ratio:.2g} to 1, with {modes[0]} and {modes[1]} modes. "
    return [
        text + "Both spaces are cut at the same energy, so neither has to be worse; the source's 40 to 1 is with 46 and 20 + 45."
    ]
