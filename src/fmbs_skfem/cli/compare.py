"""`fmbs compare`: full, reduced, coarser and larger-step models of one scene, the error beside the time.

The tables have the layout of Tables 1 to 3 of doi 10.1016/j.cma.2019.112690; where a scene is one of its examples, the published
figures stand beside ours.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, MissingFeature, say
from . import common, figures
from .common import Result, Session
from .figures import cloud as cloud
from .figures import draw as draw
from .figures import figure_names as figure_names

if TYPE_CHECKING:
    from rich.table import Table

    from ..reduction.study import Options, Record, Study
    from ..reduction.training import Plan
    from ..scenes import Scene

RECORD = "compare.json"
ETAS = (1e-2, 1e-3, 1e-4)  #: tolerances of the hyper-reduction in the picture of speed and error


@common.command("compare")
@click.option("--quick", is_flag=True, help="Only the main models, coarser meshes and larger steps; every model runs once.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of the analysis.")
@click.option("--picture/--no-picture", default=True, help="Draw the error of a reduced model on the bodies (default: yes).")
def command(session: Session, quick: bool, duration: float | None, picture: bool) -> Result:
    """Compare reduced models of SCENE with its full model and with cheaper full models.

    Writes compare.json and figures into --out, or into ./fmbs-NAME-compare where NAME.yaml is the scene.
    """
    scene = common.read_scene(session, duration)
    stem = scene.path.stem if scene.path else "scene"
    names = (RECORD, *figure_names(scene), figures.PICTURE)
    out = common.folder(session, f"fmbs-{stem}-compare", names, common.fingerprint(scene), RECORD)
    common.announce_compiling()
    with common.progress("comparing") as advance:
        study = run(scene, quick, session.allow_outside, advance)
    report = report_of(scene, study)
    files, missing = draw(scene, study, out), None
    try:
        files += figures.render(scene, study, out) if picture else []
    except MissingFeature as error:
        missing = error
        report = {**report, **common.failed(error)}
    found = {**report, "fingerprint": common.fingerprint(scene), "versions": common.versions(), "files": [out / RECORD, *files]}
    common.write_json(out / RECORD, {**found, "notices": session.notices})
    return Result(found, [*tables(scene, study), *words(report), "written: " + ", ".join(map(str, found["files"]))], missing)


def run(scene: Scene, quick: bool = False, allow_outside: bool = False, progress: Callable[[float], None] | None = None) -> Study:
    """The study of a scene, as its sections `reduction` and `compare` say."""
    from ..reduction import study
    from ..scenes import build

    raw = build.system(scene, allow_outside=allow_outside)
    settings = options(scene, plan(scene), quick)
    wanted = scene.compare.coarse if scene.compare else []
    coarse = {cells: build.system(scene, cells, allow_outside) for cells in wanted}
    return study.run(raw, settings, coarse, progress)


def plan(scene: Scene) -> Plan:
    """How the scene wants its reduced models trained."""
    from ..reduction.hyper import Level
    from ..reduction.training import Plan

    wanted = scene.reduction
    if wanted is None or scene.analysis.type != "dynamic":
        got = f"analysis {scene.analysis.type}" if wanted else "none"
        raise InputError(say(f"{scene.path or 'scene'}", "a dynamic analysis and a section 'reduction'", got, "add them"))
    hyper = wanted.hyper_reduction
    return Plan(
        components=wanted.components or {name: [name] for name in scene.bodies},
        tolerance=wanted.tolerance,
        modes=wanted.modes,
        hyper_tolerance=hyper.tolerance if hyper else None,
        level=Level(hyper.sample) if hyper else Level.ELEMENTS,
        eliminate=wanted.constraints == "eliminate",
    )


def options(scene: Scene, plan: Plan, quick: bool = False) -> Options:
    """What the scene wants compared; `quick` leaves out other eps and eta, smaller steps and repetitions.

    All models iterate as sharply as the snapshots need, so that no error is that of Newton's iteration.
    """
    from ..dynamics import GeneralizedAlpha, Newton
    from ..reduction.study import Options

    analysis, reduction, wanted = scene.analysis, scene.reduction, scene.compare
    if analysis.type != "dynamic" or reduction is None:
        raise InputError(say(f"{scene.path or 'scene'}", "a dynamic analysis and a section 'reduction'", analysis.type))
    steps = tuple(wanted.steps) if wanted else ()
    return Options(
        scheme=GeneralizedAlpha(analysis.step, analysis.rho_inf),
        duration=analysis.duration,
        interval=reduction.snapshots,
        plan=plan,
        newton=Newton(tolerance=analysis.tolerance),
        tolerances=() if quick or not wanted else tuple(wanted.tolerances),
        hyper_tolerances=() if quick else ETAS,
        steps=tuple(step for step in steps if step > analysis.step or not quick),
        ffrf_modes=wanted.ffrf_modes if wanted else None,
        repeat=1 if quick else 2,
        order=not quick,
    )


def report_of(scene: Scene, study: Study) -> dict[str, Any]:
    """The JSON object of a study."""
    from ..results import speed

    best = cheapest(study)
    return {
        "status": "ok",
        "scene": scene.name or (scene.path.stem if scene.path else ""),
        "models": [dataclasses.asdict(record) for record in study.records],
        "time_error": dataclasses.asdict(study.time_error),
        "front": speed.front_in_words(figures.points(study)),
        "pays_after": best.name if best else None,
        "pays_after_runs": best.pays_after_runs if best else None,
    }


def cheapest(study: Study) -> Record | None:
    """The fastest of the main reduced models whose training pays."""
    paying = [record for record in study.records if record.name == record.family and record.pays_after_runs is not None]
    return min(paying, key=lambda record: record.cpu_s, default=None)


def words(report: Mapping[str, Any]) -> list[str]:
    """Who is on the front, how large the error of the time step is, and when training pays."""
    time_error, order = report["time_error"], report["time_error"]["order"]
    observed = "" if order is None else f", observed order {order:.2f}"
    text = f"Error of the full model's own step {time_error['step']:g} s: {time_error['position']:.2g} m{observed}."
    pays = report["pays_after_runs"]
    gain = "Training does not pay." if pays is None else f"Training of {report['pays_after']} pays after {math.ceil(pays)} runs."
    note = "Names end in eps, or eps/eta, where these are not the scene's. "
    note += "Errors are the largest distances of centre lines from the full model [m]; training is not in the CPU times."
    return [report["front"], note, text, gain]


@cache
def published() -> dict[str, Any]:
    """Figures of the literature, by name of the scene."""
    text = resources.files(__package__).joinpath("published.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def tables(scene: Scene, study: Study) -> list[Any]:
    """An overview, then products, reduced tangents and training as in Tables 1 to 3 of the source."""
    paper = published().get(scene.name, {})
    known = paper.get("models", {})
    shown = [overview(study), products(study, known), tangents(study, known)]
    if any(record.snnls_s for record in main(study)):
        shown.append(searches(study, known))
    return [*shown, f"paper: {paper['source']}"] if paper else shown


def main(study: Study) -> list[Record]:
    """The reduced models of the scene's own eps and eta."""
    return [record for record in study.records if record.name == record.family and record.modes]


def overview(study: Study) -> Table:
    """Time beside error, without the other eps and eta (they are in the figure and in the JSON object)."""
    rows = []
    full = study["full"].cpu_s
    for record in study.records:
        if record.name != record.family and record.family not in ("coarse", "step"):
            continue
        if record.status != "done":
            rows.append((record.name, record.dofs, *[""] * 6, record.status))
            continue
        pays = "" if record.pays_after_runs is None else str(math.ceil(record.pays_after_runs))
        error = (tell(record.max_error), tell(record.mean_error), tell(record.position_error))
        rows.append((record.name, record.dofs, f"{record.cpu_s:.3g}", f"{full / record.cpu_s:.1f}", *error, pays, ""))
    columns = ("model", "dofs", "CPU [s]", "speed-up", "max error", "mean error", "position error [m]", "pays after runs", "")
    return named(common.table("Time beside error", columns, rows))


def named(table: Table) -> Table:
    """The table with the names in its first column on one line each."""
    table.columns[0].no_wrap = True
    return table


def tell(error: float) -> str:
    return f"{error:.2e}" if error else "reference"


def products(study: Study, known: Mapping[str, Any]) -> Table:
    """Table 1: scalar multiplications in the reduced tangent."""
    rows = []
    for record in main(study):
        paper = known.get(record.name, {})
        kept = record.points if record.family.endswith("points") else record.elements
        pairs = (
            (joined(record.modes.values()), joined(paper.get("r", ()))),
            (joined(kept.values()), joined(paper.get("elements", ()))),
            (joined(record.dofs_kept.values()), joined(paper.get("dofs", ()))),
            (str(record.bandwidth), str(paper.get("w", ""))),
            (f"{1e-6 * record.multiplications:.3f}", f"{1e-6 * paper['p']:.3f}" if paper else ""),
            (f"{record.speed_up:.2f}", f"{paper['s']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known)))
    heads = headed(("r modes", "kept", "dofs", "w", "p [1e6]", "s"), known)
    return named(common.table("Table 1: scalar multiplications for the reduced tangent K_r", ("model", *heads), rows))


def tangents(study: Study, known: Mapping[str, Any]) -> Table:
    """Table 2: CPU time of the reduced tangent."""
    first, rows = study["system"].kr_us, []
    for record in main(study):
        paper = known.get(record.name, {})
        pairs = (
            (f"{1e-6 * record.kr_us:.3e}", f"{paper['kr_s']:.3e}" if paper else ""),
            (f"{first / record.kr_us:.2f}", f"{paper['kr_ratio']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known)))
    return named(common.table("Table 2: time of one reduced tangent", ("model", *headed(("K_r [s]", "ratio"), known)), rows))


def searches(study: Study, known: Mapping[str, Any]) -> Table:
    """Table 3: CPU time of the sparse non-negative least squares, and of the whole training."""
    trained = [record for record in main(study) if record.snnls_s]
    first, rows = sum(trained[0].snnls_s.values()), []
    for record in trained:
        paper, own = known.get(record.name, {}), list(record.snnls_s.values())
        total = f"={sum(own):.3g}" if len(own) > 1 else ""
        published_total = f"={sum(paper['snnls_s']):.4g}" if len(paper.get("snnls_s", ())) > 1 else ""
        pairs = (
            (joined(own, ".2g") + total, joined(paper.get("snnls_s", ())) + published_total),
            (f"{first / sum(own):.2f}", f"{paper['snnls_ratio']:.2f}" if paper else ""),
        )
        rows.append((record.name, *pick(pairs, known), f"{record.training_s:.3g}"))
    heads = headed(("sNNLS [s]", "ratio"), known)
    return named(
        common.table("Table 3: time of the sparse non-negative least squares", ("model", *heads, "whole training [s]"), rows)
    )


def joined(values: Any, form: str = "") -> str:
    return "+".join(format(value, form) for value in values)


def headed(names: Sequence[str], known: Mapping[str, Any]) -> list[str]:
    """Every heading, followed by that of the paper's column where there is one."""
    return [text for name in names for text in ((name, "paper") if known else (name,))]


def pick(pairs: Sequence[tuple[str, str]], known: Mapping[str, Any]) -> list[str]:
    return [text for pair in pairs for text in (pair if known else pair[:1])]
