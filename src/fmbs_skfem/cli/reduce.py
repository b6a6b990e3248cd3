"""`fmbs reduce`: train a reduced model of a scene and save it to a file that runs without mesh and full model."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, say
from . import common, reports, screen, tables
from .common import Result, Session

if TYPE_CHECKING:
    from ..reduction.plan import Plan
    from ..scenes import Scene

SUFFIXES = (".h5", ".hdf5")


def known(context: click.Context, option: click.Parameter, name: str | None) -> str | None:
    """A name of a hyper-reduction."""
    from ..reduction import hyper_reduction

    if name is not None and name not in hyper_reduction.KNOWN:
        raise click.BadParameter(f"expected one of {', '.join(hyper_reduction.KNOWN)}, got '{name}'", context, option)
    return name


@common.command("reduce")
@click.option(
    "--level", type=click.Choice(["component", "system"]), default="component", help="A basis a component, or one for all."
)
@click.option("--tolerance", type=float, metavar="EPS", help="Truncation of the bases, instead of the scene's.")
@click.option("--modes", type=click.IntRange(1), metavar="R", help="Number of modes a component, instead of a tolerance.")
@click.option("--hyper", type=float, metavar="ETA", help="Tolerance of the hyper-reduction, instead of the scene's; 0 for none.")
@click.option(
    "--sample",
    metavar="NAME",
    callback=known,
    help="Hyper-reduction instead of the scene's: elements, points, none, or exact, the polynomial of planar plates.",
)
@click.option("--duration", type=float, metavar="SECONDS", help="Train on a run of this duration.")
def command(
    session: Session,
    level: str,
    tolerance: float | None,
    modes: int | None,
    hyper: float | None,
    sample: str | None,
    duration: float | None,
) -> Result:
    """Train a reduced model of SCENE and save it.

    --out is a file ending in .h5, or a folder for NAME.h5 where NAME.yaml is the scene. The reduced model is run over the training
    time, and its error against the full model is printed and saved with it.
    """
    from ..reduction import files

    scene = common.read_scene(session, duration)
    path = target(session, scene)
    screen.announce_compiling(scene.path)
    system, found = train(session, scene, chosen(scene, level, tolerance, modes, hyper, sample))
    training = dict(scene.parameters)
    origin = reports.plain(reports.provenance(scene))
    files.save(system, path, scene=found["scene"], training=training, report=reports.plain(found), provenance=origin)
    facts = [(key, told(value)) for key, value in found.items() if key != "output_errors"]
    view = screen.table(f"Reduced model of {found['scene']}", ("", "value"), facts)
    outputs = tables.output_errors(found["output_errors"])
    return Result({**found, "file": path, "provenance": origin}, [view, *outputs, f"written: {path}"])


def target(session: Session, scene: Scene) -> Path:
    """The file to write; one that exists is kept unless --force is given."""
    stem = common.stem(scene)
    given = session.out or Path(f"{stem}.h5")
    path = given if given.suffix in SUFFIXES else given / f"{stem}.h5"
    if path.exists() and not session.force:
        raise InputError(say(f"--out {path}", "a new file", "one that exists", "choose another name, or --force"))
    session.work.out = reports.made(path.parent)
    return path


def chosen(scene: Scene, level: str, tolerance: float | None, modes: int | None, hyper: float | None, sample: str | None) -> Plan:
    """The scene's plan with what the options replace."""
    from ..reduction import NONE, Elements, hyper_reduction
    from . import compare

    if tolerance is not None and modes is not None:
        raise InputError(say("--tolerance and --modes", "one of them", "both"))
    if tolerance is not None and not 0 < tolerance < 1:
        raise InputError(say("--tolerance", "0 < eps < 1", tolerance, "1e-12 means a relative error of 1e-6"))
    if hyper is not None and not 0 <= hyper < 1:
        raise InputError(say("--hyper", "0 <= eta < 1", hyper, "1e-3 is usual, 0 means no hyper-reduction"))
    plan = compare.plan(scene)
    if level == "system":
        counts = None if isinstance(plan.modes, dict) else plan.modes
        plan = replace(plan, components={"system": tuple(scene.bodies)}, modes=counts)
    if tolerance is not None:
        plan = replace(plan, tolerance=tolerance, modes=None)
    if modes is not None:
        plan = replace(plan, modes=modes)
    own = plan.hyper if plan.hyper.tolerance else Elements()
    if hyper is not None:
        plan = replace(plan, hyper=replace(own, tolerance=hyper) if hyper else NONE)
    return plan if sample is None else replace(plan, hyper=hyper_reduction.named(sample, plan.hyper.tolerance))


def train(session: Session, scene: Scene, plan: Plan) -> tuple[Any, dict[str, Any]]:
    """The reduced system, and its sizes, cost and errors against the full model over the training time."""
    from .. import reduction
    from ..reduction import cases, costs, output_errors, reduced_models, runs
    from ..reduction.plan import newton_for
    from ..scenes import build
    from . import compare

    raw = build.system(scene, allow_outside=session.allow_outside)
    task = compare.task(scene, raw, plan)
    own = task.family({})
    kept = runs.kept_steps(own, task.interval)
    with screen.progress("full model") as advance:
        sharp = replace(own, system=task.form(raw), newton=newton_for(own.newton, plan.tolerance))
        full = cases.run(sharp, kept, advance)
    session.work.trajectory = full
    model = reduction.train(task, motion=full).model
    with screen.progress("reduced model") as advance:
        motion = cases.run(reduced_models.case_at(model, {}), kept, advance)
    errors = reduction.compare(full, motion)
    cells = {name: len(numbers) for name, numbers in costs.kept_cells(model.system).items()}
    return model.system, {
        "status": "ok",
        "scene": common.title(scene),
        "dofs_full": raw.size,
        "dofs": model.system.size,
        "modes": dict(model.modes),
        "elements": costs.by_component(cells, model.components),
        "points": costs.by_component(costs.kept_points(model.system), model.components),
        "tolerance": plan.tolerance if plan.modes is None else None,
        "hyper_tolerance": plan.hyper.tolerance,
        "hyper_reduction": plan.hyper.name,
        "max_error": errors.maximum,
        "median_error": errors.median,
        "mean_error": errors.mean,
        "position_error": errors.position_maximum,
        "output_errors": {column: asdict(one) for column, one in output_errors.compare(full, motion).items()},
        "distance_error": errors.distance_maximum,
        "coordinates_error": errors.coordinates_maximum,
        "coordinates_mean": errors.coordinates_mean,
        "cpu_s_full": full.statistics.cpu_s,
        "cpu_s": motion.statistics.cpu_s,
        "training_s": model.training_s,
        "snnls_s": {selection.component: selection.snnls_s for selection in model.selections},
        "step": own.scheme.step,
        "rho_inf": own.scheme.rho_inf,
        "duration": own.duration,
    }


def told(value: object) -> str:
    """A value of the report as text; per-component values as `I 24 + II 23`."""
    if isinstance(value, dict):
        return " + ".join(f"{name} {screen.number_text(item)}" for name, item in value.items()) or "-"
    return "-" if value is None else screen.number_text(value)
