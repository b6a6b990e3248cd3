"""`fmbs rom`: what a saved reduced model is, and its motion at wanted parameters; `fmbs run` of such a file is the same.

Two kinds of files: models at one set of parameters (`fmbs reduce`), and models of a whole box of parameters (`fmbs train`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core import durable
from ..core.errors import InputError, SolverError, say
from ..core.problems import Problem, shown
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    import numpy as np

    from ..dynamics import Trajectory
    from ..reduction.cases import Case
    from ..reduction.parameters import Parameter
    from ..reduction.parametric_model import ParametricModel

PICTURE, PLOT = "picture.png", "outputs.png"
INSTANTS = 7  #: configurations in a picture
SHORT = 12  #: entries of a list that a table shows

FILE = click.argument("path", metavar="FILE", type=click.Path(path_type=Path))
SET = click.option(
    "--set",
    "changes",
    metavar="NAME=VALUE",
    multiple=True,
    callback=common.changed,
    help="Value of a parameter, in SI units or with its unit; without it the nominal one.",
)


@dataclass(frozen=True)
class Chosen:
    """What is run of a file, and what is known of it."""

    case: Case
    facts: dict[str, Any]
    title: str


@click.group("rom", epilog="Both take --json and, for what they write, --out DIR.")
def command() -> None:
    """Saved reduced models: what one is, and its motion at wanted parameters, without meshes and full model."""


@common.command("info", scene=False)
@FILE
def info(session: Session) -> Result:
    """Say what the reduced model in FILE is: parameters with their ranges, sizes, training, errors; --out writes info.json."""
    found = {
        "status": "ok",
        "model": session.path,
        **(described(session.path) if parametric(session.path) else noted(session.path)),
    }
    if session.out is not None:
        out = reports.folder(session, session.out, ["info.json"], mark(session.path), record="info.json")
        made = {"fingerprint": mark(session.path), "provenance": reports.provenance(files=[session.path])}
        reports.keep(session, out, {**found, **made}, record="info.json")
    return Result(found, views(found))


@common.command("run", scene=False)
@FILE
@SET
@click.option("--duration", type=float, metavar="SECONDS", help="Instead of the duration of the training.")
@click.option("--step", type=float, metavar="SECONDS", help="Instead of the step of the training.")
@click.option("--plots/--no-plots", default=True, help="Draw the outputs into outputs.png (default: yes).")
@click.option("--picture", is_flag=True, help="Draw the bodies into picture.png, lifted to their centre lines and surfaces.")
def run(session: Session, duration: float | None, step: float | None, plots: bool, picture: bool) -> Result:
    """Run the reduced model in FILE at values of its parameters and state the error predicted there.

    Writes outputs.csv (time in column t), report.json and outputs.png into --out, or into ./fmbs-NAME where NAME.h5 is the file.
    """
    return solve(session, duration, step, plots, picture)


command.add_command(info)
command.add_command(run)


def described(path: Path) -> dict[str, Any]:
    """A model of a box of parameters."""
    from ..reduction import parametric_model, prediction

    rom = parametric_model.load(path)
    found = parametric_model.summary(rom)
    notes = {key: value for key, value in found.pop("notes").items() if key not in (prediction.KEY, "provenance")}
    return {"kind": "a box of parameters", **found, "predicted_error": predicted(rom, {}), "notes": notes}


def noted(path: Path) -> dict[str, Any]:
    """A model at one set of parameters."""
    from ..reduction import files

    saved = files.read(path)
    system = saved.system
    return {
        "kind": "one set of parameters",
        "parameters": saved.notes.get("training", {}),
        "unknowns": system.size,
        "components": {name: last - first for name, first, last in system.components},
        "constraints": len(system.constraints.names),
        "outputs": list(system.outputs),
        "notes": {key: value for key, value in saved.notes.items() if key not in ("training", "provenance")},
    }


def views(found: Mapping[str, Any]) -> list[Any]:
    """A model as tables: its parameters, then its facts, then the notes on its training."""
    from ..results import sweep_files

    ranged = {name: facts for name, facts in found["parameters"].items() if isinstance(facts, dict)}
    columns = ("parameter", "from", "to", "nominal", "scale", "degree")
    rows = [
        (
            sweep_files.headed(name, facts["unit"]),
            *(facts[key] for key in ("low", "high", "nominal", "scale", "degree")),
        )
        for name, facts in ranged.items()
    ] or [(name, "", "", value, "", "") for name, value in found["parameters"].items()]
    facts = [(key, told(found[key])) for key in found if key not in ("status", "parameters", "notes")]
    notes = [(key, told(value)) for key, value in flat(found["notes"])]
    tables = [screen.table("Parameters", columns, rows), screen.table("Model", ("", "value"), facts)]
    return [*tables, *([screen.table("Training", ("", "value"), notes)] if notes else [])]


def flat(notes: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    """Notes with nested names joined, `training full_runs`; long lists are left to --json."""
    found: list[tuple[str, Any]] = []
    for key, value in notes.items():
        name = f"{before} {key}".strip()
        if isinstance(value, Mapping):
            found += flat(value, name)
        elif not hasattr(value, "__len__") or isinstance(value, str) or len(value) <= SHORT:
            found.append((name, value))
    return found


def told(value: Any) -> str:
    """A value of a table as text."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {screen.number_text(item)}" for name, item in value.items()) or "-"
    if isinstance(value, list | tuple):
        return "; ".join(told(item) for item in value) or "-"
    return "-" if value is None else screen.number_text(value)


def solve(session: Session, duration: float | None, step: float | None, plots: bool, picture: bool) -> Result:
    """Run a saved reduced model: outputs.csv, report.json and, if wanted, outputs.png and picture.png.

    A solve that fails keeps what it reached and is explained.
    """
    from .. import dynamics
    from . import failure_report, solving

    chosen = (at_values if parametric(session.path) else alone)(session, duration, step)
    identity = f"{mark(session.path)} {chosen.facts.get('parameters', '')} {chosen.case.duration} {chosen.case.scheme.step}"
    out = reports.folder(session, f"fmbs-{session.path.stem}", written(plots, picture), identity)
    try:
        motion, error = attempt(chosen.case)
    except SolverError as failed:
        failure_report.keep_start(out, failed, reports.provenance(files=[session.path]))
        raise
    session.work.trajectory = motion
    columns = dynamics.outputs(motion)
    plots = plots and solving.plottable(motion, columns)
    solving.write_outputs(out, motion.times, columns)
    if plots:
        plot(out, motion.times, columns, chosen.title)
    if picture:
        draw(motion, out, chosen.title)
    found = {**report(session, chosen, motion, columns, error), "fingerprint": identity}
    found["files"] = [out / name for name in written(plots, picture)]
    found = failure_report.keep(out, found, error, plots)
    reports.keep(session, out, found)
    tables = [*([solving.table_of_outputs(columns)] if columns else []), *failure_report.views(found)]
    return Result(found, [*words(found), *tables, "written: " + ", ".join(map(str, found["files"]))], error)


def written(plots: bool, picture: bool) -> list[str]:
    """Names of the files that a run leaves."""
    from . import solving

    return [solving.OUTPUTS, reports.REPORT, *([PLOT] if plots else []), *([PICTURE] if picture else [])]


def attempt(case: Case) -> tuple[Trajectory, SolverError | None]:
    """The motion of a case, or the part of it up to a failure with its error."""
    from .. import dynamics
    from ..reduction import cases

    screen.announce_compiling()
    try:
        with screen.progress("reduced model") as advance:
            motion = cases.run(case, progress=advance)
        broken = dynamics.unstable(motion, case.scheme.step)
        if broken is None:
            return motion, None
        raise broken
    except SolverError as error:
        if error.partial is None:
            raise
        return error.partial, error


def report(
    session: Session, chosen: Chosen, motion: Trajectory, columns: Mapping[str, np.ndarray], error: SolverError | None
) -> dict[str, Any]:
    """The JSON object of a run."""
    from . import solving

    cost = motion.statistics
    return {
        **({"status": "ok"} if error is None else common.failed(error)),
        "model": session.path,
        **chosen.facts,
        "dofs": motion.system.size,
        "constraints": len(motion.system.constraints.names),
        "end": float(motion.times[-1]),
        "steps": cost.steps,
        "newton_iterations": cost.iterations,
        "cpu_s": cost.cpu_s,
        "wall_s": cost.wall_s,
        **solving.energy_of_reduced(motion),
        "outputs": {name: solving.extremes(values) for name, values in columns.items()},
        "provenance": reports.provenance(files=[session.path]),
    }


def parametric(path: Path) -> bool:
    """Whether a file holds a model of a whole box of parameters; its first line says so."""
    from ..reduction import parametric_model

    if not path.is_file():
        raise InputError(say(f"{path}", "a file of a reduced model", "no file", "make one with fmbs reduce or fmbs train"))
    with path.open("rb") as file:
        return file.readline(100).decode("ascii", "replace").rstrip("\n") == parametric_model.KIND.title


def mark(path: Path) -> str:
    """The identity of a file."""
    return durable.sha256(path)


def at_values(session: Session, duration: float | None, step: float | None) -> Chosen:
    """The case of a parametric model at the wanted values, with the error predicted there."""
    from ..reduction import parameters, parametric_model, prediction

    rom = parametric_model.load(session.path)
    known = rom.model.parameters
    point = parameters.completed(known, values(known, session.changes))
    case, beyond = parametric_model.case_of(rom, point, duration, step)
    facts = {
        "parameters": point,
        "outside": list(parameters.outside(known, point)),
        "beyond_training": beyond,
        "predicted_error": None if beyond else predicted(rom, point),
        "doubts": list(rom.notes.get(prediction.DOUBTS, ())),
        "measure": measure(rom),
    }
    return Chosen(case, facts, title(session.path, rom.notes))


def predicted(rom: ParametricModel, point: Mapping[str, float]) -> dict[str, float] | None:
    """The error that the model predicts for itself; none outside of its trained ranges."""
    from ..reduction import prediction

    found = prediction.predicted_error(rom, **point)
    return None if found is None or math.isnan(found.error) else asdict(found)


def alone(session: Session, duration: float | None, step: float | None) -> Chosen:
    """The case of a model at one set of parameters; times not given are those of its training."""
    from ..reduction import files

    if session.changes:
        remedy = "train one with fmbs train, or another one with fmbs reduce --set"
        raise InputError(say("--set", "a model of a whole range of parameters", f"'{session.path}', which has none", remedy))
    saved = files.read(session.path)
    case, beyond = files.case_of(saved, duration, step, str(session.path))
    return Chosen(case, {"beyond_training": beyond}, title(session.path, saved.notes))


def title(path: Path, notes: Mapping[str, Any]) -> str:
    """The name of the scene that a model is of, or that of its file."""
    return str(notes.get("scene") or path.stem)


def values(known: Sequence[Parameter], changes: Mapping[str, str]) -> dict[str, float]:
    """Values of --set in SI units; names that are no parameters are refused, and units of another dimension."""
    from ..reduction import parameters

    parameters.known(known, changes)
    return {parameter.name: value(parameter, changes[parameter.name]) for parameter in known if parameter.name in changes}


def value(parameter: Parameter, text: str, option: str = "--set") -> float:
    """A number in SI units, or a quantity of the parameter's dimension, given by `option`."""
    from ..core import units

    try:
        found = units.read(text)
        own = units.read(f"1 {parameter.unit}".strip()).exponents
        if found.exponents not in (own, units.NUMBER.exponents):
            got = f"{shown(text)} ({units.describe(found.exponents)})"
            raise Problem(f"a value of the dimension of the parameter ({units.describe(own)})", got)
    except Problem as problem:
        raise InputError(problem.at(f"{option} {parameter.name}")) from problem
    return found.value


def words(found: Mapping[str, Any]) -> list[str]:
    """The run and the error predicted for it, in a line each."""
    point = ", ".join(f"{name} = {value:.6g}" for name, value in found.get("parameters", {}).items())
    text = f"{found['model']}: {point + ', ' if point else ''}{found['dofs']} unknowns, {found['steps']} steps, "
    text += f"{found['newton_iterations']} Newton iterations, {found['cpu_s']:.3g} s CPU, {found['wall_s']:.3g} s wall, "
    text += f"energy drift {found['energy_drift']:.3g} J"
    beyond = [f"No error is known: {'; '.join(found['beyond_training'])}."] if found["beyond_training"] else []
    return [text, *beyond, *(error_words(found) if found.get("predicted_error") else [])]


def measure(rom: ParametricModel) -> str:
    """What the predicted error of a model is; that of files that do not say it is one of states."""
    from ..reduction import prediction

    return str(rom.notes.get(prediction.KEY, {}).get("measure", "relative error (48)"))


def error_words(found: Mapping[str, Any]) -> list[str]:
    """A predicted error with its band, and what speaks against it."""
    predicted = found["predicted_error"]
    spread = f"with its spread {predicted['low']:.2g} to {predicted['high']:.2g}"
    doubts = [f"Its training cannot promise that: {'; '.join(found['doubts'])}."] if found["doubts"] else []
    return [f"Predicted {found['measure']}: {predicted['error']:.2g}, {spread}.", *doubts]


def plot(out: Path, times: np.ndarray, columns: Mapping[str, np.ndarray], title: str) -> Path:
    """outputs.png: all outputs over time."""
    import numpy as np

    from ..results import plots

    found = {name: {title: values} for name, values in columns.items() if np.isfinite(values).all()}
    return plots.history_grid(out / PLOT, times, found, columns=2 if len(found) > 3 else 1, title=title)


def draw(motion: Trajectory, out: Path, title: str) -> Path:
    """Configurations of a reduced model, coloured by stress or curvature."""
    from ..results import pictures
    from . import picture

    chosen = picture.frames(motion, picture.spread(motion, INSTANTS))
    return pictures.render(chosen, out / PICTURE, None, pictures.Look(picture.usual_color(motion.system), title=title))
