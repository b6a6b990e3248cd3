"""Saved reduced models: what one is, and what is run of it at wanted parameters.

Two kinds of files: models at one set of parameters (`reduce`), and models of a whole box of
parameters (`train`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import dynamics
from ..core.errors import InputError, say
from ..core.notices import Progress
from ..core.storage import container, durable
from ..core.values import display, quantities, units
from ..core.values.display import DisplayUnits
from ..core.values.problems import Problem
from ..core.values.units import add_unit
from ..families import parametric_model, prediction
from ..reduction import cases, files
from ..reduction import parameters as boxes
from ..results.rendering import painter
from . import job as jobs
from . import reports
from .job import Job
from .result import ReportTable, Result, format_value
from .running import judging, pictures, solving, webpages
from .running.outcome import Run

if TYPE_CHECKING:
    from ..core.values.ranges import Parameter
    from ..families.parametric_model import ParametricModel
    from ..reduction.cases import Case

INFO = "info.json"
#: notes of a model at one set of parameters that are not listed as they are
OWN = "training", "provenance", "scheme", "newton", "choice", display.KEY
SHORT = 12  #: entries of a list that a table shows
SCENES = ".yaml", ".yml"  #: endings of what is no model
RANGES = "error of the outputs over their ranges"  #: a measure of a training


def is_model(job: Job) -> bool:
    """Whether a job is about a saved reduced model."""
    return job.scene is None and job.path.suffix in jobs.MODELS


def task(job: Job, step: float | None = None) -> solving.RunTask:
    """The run of a saved model, with what is known of its error."""
    case, notes, facts = (at_values if parametric(job.path) else alone)(job, step)
    identity = f"{mark(job.path)} {facts.get('parameters', '')} {case.duration} {case.scheme.step}"
    system = case.system
    read = DisplayUnits.of(notes)
    named = facts.get("parameter_units", {})
    point = "".join(
        f"{read.text(name, value, named[name])}, "
        for name, value in facts.get("parameters", {}).items()
    )
    facts = {
        "model": job.path,
        **facts,
        "dofs": system.size,
        "constraints": len(system.constraints.names),
    }
    facts |= {
        "fingerprint": identity,
        "provenance": reports.provenance(files=[job.path]),
        **read.note,
    }

    def integrate(advance: Any, *_: object) -> dynamics.Trajectory:
        return cases.run(case, progress=advance)

    return solving.RunTask(
        title(job.path, notes),
        facts,
        f"{job.path}: {point}{system.size} unknowns",
        system,
        integrate,
        judging.energy_of_reduced,
        case.scheme,
        halved=partial(run_halved, case),
        label="reduced model",
        remarks=remarks(facts),
    )


def run_halved(case: Case, progress: Progress) -> dynamics.Trajectory:
    """The motion of a case in half the steps."""
    return cases.run(cases.with_step(case, 0.5 * case.scheme.step), 2, progress)


def require_own_accuracy(job: Job) -> None:
    """InputError where a saved model is asked for an accuracy of its own."""
    if job.accuracy is not None:
        remedy = "a reduced model has the accuracy of its training; fmbs run asks the full model for another one"
        raise InputError(say("--accuracy", "a scene", f"{job.path}", remedy))


def run_saved(job: Job, step: float | None, picture: bool, html: bool = False) -> Run:
    """The run of a saved model, with a picture and a page for the browser where they are wanted."""
    made = task(job, step)
    wanted: dict[str, webpages.Draw] = (
        {pictures.PICTURE: partial(pictures.model, made.title, made.display)} if picture else {}
    )
    wanted |= {webpages.PAGE: webpages.drawing(made.title, made.display)} if html else {}
    with painter.at_hand(picture and job.out is not None):
        return solving.solve(
            job,
            made.facts["fingerprint"],
            lambda: made,
            webpages.together(*wanted.values()),
            list(wanted),
        )


def at_values(job: Job, step: float | None) -> tuple[Case, Mapping[str, Any], dict[str, Any]]:
    """The case of a parametric model at the wanted values, its notes, and the error predicted
    there.
    """
    rom = parametric_model.load(job.path)
    known = rom.model.parameters
    boxes.known(known, job.changes)
    point = boxes.completed(
        known,
        {
            own.name: read_value(own, job.changes[own.name])
            for own in known
            if own.name in job.changes
        },
    )
    case, beyond = parametric_model.case_of(rom, point, job.duration, step)
    facts = {
        "parameters": point,
        "parameter_units": {own.name: own.unit for own in known},
        "outside": list(boxes.outside(known, point)),
        "beyond_training": beyond,
        "predicted_error": None if beyond else predict_error(rom, point),
        **training_facts(rom),
    }
    return case, rom.notes, facts


def training_facts(rom: ParametricModel) -> dict[str, Any]:
    """What the training of a model says of the error that is predicted: what speaks against it, and
    its measure.
    """
    measure = str(rom.notes.get(prediction.KEY, {}).get("measure", "relative error (48)"))
    return {
        "doubts": list(rom.notes.get(prediction.DOUBTS, ())),
        "measure": measure + signalled(rom),
    }


def largest_error(notes: Mapping[str, Any]) -> dict[str, float] | None:
    """The largest error that a training has predicted for its ranges, with its band; None where
    that is not known.
    """
    found = notes.get("training", {}).get("predicted_error") or {}
    known = all(
        isinstance(found.get(end), float) and math.isfinite(found[end])
        for end in ("error", "low", "high")
    )
    return found if known else None


def say_largest_error(rom: ParametricModel) -> list[str]:
    """The largest error that is predicted anywhere in the ranges of a family, with its band;
    nothing where that is not known.
    """
    if (found := largest_error(rom.notes)) is None:
        return []
    band = f"with the band {found['low']:.2g} to {found['high']:.2g}"
    return [f"At most, anywhere in its ranges: {found['error']:.2g}, {band}."]


def alone(job: Job, step: float | None) -> tuple[Case, Mapping[str, Any], dict[str, Any]]:
    """The case of a model at one set of parameters, and its notes; times not given are those of its
    training.
    """
    if job.changes:
        remedy = "train one with fmbs train, or another one with fmbs reduce --set"
        raise InputError(
            say(
                "--set",
                "a model of a whole range of parameters",
                f"'{job.path}', which has none",
                remedy,
            )
        )
    saved = files.read(job.path)
    case, beyond = files.case_of(saved, job.duration, step, str(job.path))
    return case, saved.notes, {"beyond_training": beyond}


def describe(job: Job) -> Result:
    """What a saved reduced model is: parameters with their ranges, sizes, training, errors; in a
    folder also as info.json.
    """
    facts = {
        "model": job.path,
        **(describe_box if parametric(job.path) else describe_point)(job.path),
    }
    return Result(
        about=f"{job.path}: {facts['kind']}", report=write_info(job, facts), lines=views(facts)
    )


def write_info(job: Job, facts: Mapping[str, Any]) -> dict[str, Any]:
    """The report of what a file holds; in a folder also, with its provenance, as info.json."""
    report = {"status": "ok", **facts, "notices": job.notices}
    out = jobs.settle_folder(job, [INFO], mark(job.path), INFO)
    reports.write_report(
        out,
        {
            **report,
            "fingerprint": mark(job.path),
            "provenance": reports.provenance(files=[job.path]),
        },
        INFO,
    )
    return report


def describe_box(path: Path) -> dict[str, Any]:
    """A model of a box of parameters."""
    rom = parametric_model.load(path)
    found = parametric_model.summary(rom)
    notes = {
        key: value
        for key, value in found.pop("notes").items()
        if key not in (prediction.KEY, "provenance", display.KEY)
    }
    return {
        "kind": "a box of parameters",
        **found,
        **DisplayUnits.of(rom.notes).note,
        "predicted_error": predict_error(rom, {}),
        "notes": notes,
    }


def describe_point(path: Path) -> dict[str, Any]:
    """A model at one set of parameters."""
    saved = files.read(path)
    system = saved.system
    return {
        "kind": "one set of parameters",
        "parameters": saved.notes.get("training", {}),
        "unknowns": system.size,
        "components": system.modes,
        "constraints": len(system.constraints.names),
        "outputs": list(system.outputs),
        **DisplayUnits.of(saved.notes).note,
        "notes": {key: value for key, value in saved.notes.items() if key not in OWN},
    }


def views(found: Mapping[str, Any]) -> list[ReportTable]:
    """A model as tables: its parameters, then its facts, then the notes on its training."""
    known = {name: facts for name, facts in found["parameters"].items() if isinstance(facts, dict)}
    columns = ("parameter", "from", "to", "nominal", "scale", "degree")
    keys = ("low", "high", "nominal", "scale", "degree")
    rows: list[tuple[object, ...]] = []
    read = DisplayUnits.of(found)
    for name, own in known.items():
        head, ends = read.row(add_unit(name, own["unit"]), [own[key] for key in keys[:3]])
        rows.append((head, *ends, *(own[key] for key in keys[3:])))
    rows = rows or [(name, "", "", value, "", "") for name, value in found["parameters"].items()]
    facts = [
        (key, format_value(found[key]))
        for key in found
        if key not in ("status", "parameters", "notes", display.KEY)
    ]
    notes = [(key, format_value(value)) for key, value in flatten(found["notes"])]
    tables = [ReportTable("Parameters", columns, rows), ReportTable("Model", ("", "value"), facts)]
    return [*tables, *([ReportTable("Training", ("", "value"), notes)] if notes else [])]


def flatten(notes: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    """Notes with nested names joined, `training full_runs`; long lists are left to --json."""
    found: list[tuple[str, Any]] = []
    for key, item in notes.items():
        name = f"{before} {key}".strip()
        if isinstance(item, Mapping):
            found += flatten(item, name)
        elif not hasattr(item, "__len__") or isinstance(item, str) or len(item) <= SHORT:
            found.append((name, item))
    return found


def parametric(path: Path) -> bool:
    """Whether a file holds a model of a whole box of parameters; its first line says so."""
    container.require_file(
        path, parametric_model.KIND.name, "make one with fmbs reduce or fmbs train"
    )
    if path.suffix in SCENES:
        raise InputError(
            say(
                f"{path}",
                "a saved reduced model",
                "a scene",
                "run it with fmbs run, or make a model with fmbs reduce",
            )
        )
    return container.title(path) == parametric_model.KIND.title


def mark(path: Path) -> str:
    """The identity of a file."""
    return durable.sha256(path)


def title(path: Path, notes: Mapping[str, Any]) -> str:
    """The name of the scene that a model is of, or that of its file."""
    return str(notes.get("scene") or path.stem)


def predict_error(rom: ParametricModel, point: Mapping[str, float]) -> dict[str, float] | None:
    """The error that the model predicts for itself; none outside of its trained ranges."""
    found = prediction.predicted_error(rom, **point)
    return None if found is None or math.isnan(found.error) else found._asdict()


def signalled(rom: ParametricModel) -> str:
    """What is to be said of errors of a plant, which are parts of ranges under the signals of its
    training.
    """
    return (
        " under the signals of its training"
        if "training_signals" in rom.notes.get("training", {})
        else ""
    )


def errors_of(path: Path, outputs: Mapping[str, np.ndarray]) -> tuple[dict[str, float], str]:
    """What is known of the errors of a saved model's outputs (s,), by column in their units, and a
    sentence on it.

    Of a model at one point those in its training; of a box the largest one that is predicted, with
    its band, over the ranges of these outputs. Ranges of a plant are those under the signals of its
    training, of which a box tells nothing.
    """
    if not parametric(path):
        found = files.read_errors(files.read(path).notes, "error")
        return found, "Bands of the outputs are the errors of its training." if found else ""
    record = parametric_model.load(path).notes.get("training", {})
    largest = record.get("predicted_error", {}).get("high")
    if (
        record.get("measure") != RANGES
        or largest is None
        or not math.isfinite(largest)
        or "training_signals" in record
    ):
        return {}, ""
    bands = {name: largest * float(np.ptp(values)) for name, values in outputs.items()}
    return (
        bands,
        f"Bands of the outputs are the largest error that is predicted, {largest:.2g} of their ranges.",
    )


def read_value(parameter: Parameter, given: str, option: str = "--set") -> float:
    """A number in SI units, or a quantity of the parameter's dimension, given by `option`."""
    try:
        value = quantities.convert(given, units.find_dimension(parameter.unit))
    except Problem as problem:
        raise InputError(problem.at(f"{option} {parameter.name}")) from problem
    boxes.require_sign(parameter, value, f"{option} {parameter.name}")
    return value


def remarks(facts: Mapping[str, Any]) -> Sequence[str]:
    """Where a run leaves the training, or its predicted error with its band and what speaks against
    it.
    """
    found = (
        [f"No error is known: {'; '.join(facts['beyond_training'])}."]
        if facts["beyond_training"]
        else []
    )
    if (error := facts.get("predicted_error")) is not None:
        band = f"with the band {error['low']:.2g} to {error['high']:.2g}"
        found.append(f"Predicted {facts['measure']}: {error['error']:.2g}, {band}.")
        found += say_doubts(facts["doubts"])
    return found


def say_doubts(doubts: Sequence[str]) -> list[str]:
    """What speaks against a predicted error, in a sentence; nothing where nothing does."""
    return (
        [f"This error estimate is not reliable: {'; '.join(doubts)}; check with full runs."]
        if doubts
        else []
    )
