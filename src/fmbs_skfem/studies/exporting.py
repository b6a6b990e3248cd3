"""Saved reduced models and parts out of the house: as C, and as FMUs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from .. import dynamics
from ..bodies.body import Body
from ..core import extras
from ..core.errors import InputError, MissingFeature, SolverError, say
from ..core.notices import Notice, notify
from ..core.storage import container, durable
from ..core.values import quantities, units
from ..core.values.display import SI, DisplayUnits
from ..core.values.fields import AXES
from ..core.values.problems import Problem
from ..core.values.units import add_unit
from ..dynamics import GeneralizedAlpha
from ..dynamics.scheme import steps_in
from ..exports import binaries, c_files, fmu, part_ports, shapes
from ..exports.binaries import Built
from ..exports.c_files import CModel
from ..exports.fmu import FMU
from ..exports.reference import TrainingMotion
from ..exports.shapes import ShownPoints
from ..families import parametric_model
from ..parts import files as part_files
from ..parts import rescaling
from ..reduction import cases, files
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case
from . import models
from .job import Job
from .result import ReportTable, Result, conclude, describe_error, list_files

ROWS = 1000  #: of a motion in an FMU, at most
UNITS = {"young_modulus": "Pa", "density": "kg/m^3"}  #: of numbers of a part that are no lengths


class ExportedModel(NamedTuple):
    """A model in C."""

    model: CModel
    title: str
    text: str  #: of its errors, or of what acts on it
    display: DisplayUnits  #: in which people read its numbers
    case: Case | ParametricCase | None = None  #: None of a part
    notes: Mapping[str, Any] = {}  #: of the training


def written(job: Job, name: str, step: float | None = None, gravity: str = "") -> ExportedModel:
    """A saved model in C; parameters of a whole range are variables, or have given values.

    A part has its places as ports; `step` [s] and `gravity` are for it alone.
    """
    container.require_file(
        job.path,
        "a saved model or a part",
        "make one with fmbs reduce, fmbs train or fmbs part train",
    )
    if container.title(job.path) == part_files.KIND.title:
        return written_part(job, name, step, gravity)
    if step is not None or gravity:
        option = "--step" if step is not None else "--gravity"
        raise InputError(
            say(
                option,
                "a part",
                f"{job.path}, a model with its own",
                "train the model with another one",
            )
        )
    case: Case | ParametricCase
    notes: Mapping[str, Any]
    if models.parametric(job.path) and not job.changes:
        rom = parametric_model.load(job.path)
        case, notes = rom.model, rom.notes
        facts = models.training_facts(rom) | {
            "predicted_error": models.largest_error(notes),
            "beyond_training": (),
        }
    else:
        case, notes, facts = (models.at_values if models.parametric(job.path) else models.alone)(
            job, None
        )
    text = error_text(notes, facts)
    notify(*models.say_doubts(facts.get("doubts", ())))
    title = models.title(job.path, notes)
    model = c_files.write(case, name or job.path.stem, title, text)
    return ExportedModel(model, title, text, DisplayUnits.of(notes), case, notes)


def error_text(notes: Mapping[str, Any], facts: Mapping[str, Any]) -> str:
    """What a model errs by: outputs in its training, or of a family what is predicted in its
    ranges, and what speaks against it.
    """
    known = [f"{column} {error:.2g}" for column, error in files.read_errors(notes).items()]
    lines = (
        [f"Errors in its training, over the ranges of the outputs: {', '.join(known)}."]
        if known
        else []
    )
    return " ".join([*lines, *models.remarks(facts)])


def written_part(job: Job, name: str, step: float | None, gravity: str) -> ExportedModel:
    """A part in C with its places as ports, its title and what acts on it."""
    part = part_files.load(job.path)
    known = part.body.values  # of other names `changed` says which there are
    given = {
        key: read_number(key, text) if key in known else 1.0 for key, text in job.changes.items()
    }
    body = rescaling.rescale(part.body, given)
    alone = part.notes.get("alone") or {}
    if step is None and not alone:
        remedy = "take a part in some sixty of the shortest period that matters"
        raise InputError(
            say("--step", "a step for a part that was trained in a scene", "none", remedy)
        )
    acceleration = read_gravity(gravity, body)
    scheme = GeneralizedAlpha(float(alone["step"]) if step is None else step)
    duration = scheme.step * (round(float(alone["duration"]) / scheme.step) if alone else 1000)
    weight = f"gravity {list(acceleration)} m/s^2" if acceleration else "no gravity"
    text = f"Its places are ports: forces and torques come in, positions, velocities and rotations go out; {weight} acts on it."
    title = f"part {body.name}"
    stem = job.path.name.partition(".")[0]
    case = part_ports.case_of(body, scheme, duration, acceleration)
    return ExportedModel(c_files.write(case, name or stem, title, text), title, text, SI)


def read_number(name: str, text: str) -> float:
    """A number of a part [SI], given by --set."""
    try:
        return quantities.convert(text, units.find_dimension(UNITS.get(name, "m")))
    except Problem as problem:
        raise InputError(problem.at(f"--set {name}")) from problem


def read_gravity(text: str, body: Body) -> tuple[float, ...]:
    """The acceleration (c,) [m/s2] of a text such as "0, 0, -9.81"; empty of no text."""
    parts = [one.strip() for one in text.strip(" []()").split(",")] if text else []
    if parts and len(parts) != body.dim:
        axes = ", ".join(AXES[: body.dim])
        raise InputError(say("--gravity", f"{body.dim} accelerations, {axes}", f"'{text}'"))
    try:
        return tuple(quantities.convert(one, units.find_dimension("m/s^2")) for one in parts)
    except Problem as problem:
        raise InputError(problem.at("--gravity")) from problem


def export(
    job: Job,
    name: str,
    folder: Path | None,
    fmu_file: Path | None = None,
    fmi: int = 2,
    step: float | None = None,
    gravity: str = "",
    shape: bool = False,
) -> Result:
    """A model or a part in C, as files in a folder or as an FMU, which may show points of a `shape`."""
    if (folder is None) == (fmu_file is None):
        got = "none" if folder is None else "both"
        raise InputError(
            say(
                "rom export",
                "a folder for the C file, --c DIR, or a file for an FMU, --fmu FILE",
                got,
            )
        )
    if shape and (fmu_file is None or fmi == 2):
        got = "C files" if fmu_file is None else "one of FMI 2"
        expected = "an FMU of FMI 3, which has arrays"
        raise InputError(say("--shape", expected, got, "take --fmu FILE --fmi 3, or leave it out"))
    made = written(job, name, step, gravity)
    found, title = made.model, made.title
    if fmu_file is not None:
        unit = fmu.write(
            found,
            fmi,
            title,
            made.text,
            made.display,
            reference_of(made),
            shape_of(made, shape),
        )
        return export_fmu(job, found, title, unit, fmu_file)
    assert folder is not None
    names = [folder / f"{found.name}.c", folder / f"{found.name}.h"]
    refuse_taken(job, f"--c {folder}", names)
    with durable.writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    places = [
        durable.write(place, text.encode())
        for place, text in zip(names, (found.source, found.header), strict=True)
    ]
    return Result(
        about=f"{job.path}: {title} as C",
        report=report_of(job, found, places),
        lines=views(found, places),
    )


def shape_of(made: ExportedModel, wanted: bool) -> ShownPoints | None:
    """Points of bodies, where they are wanted; InputError for a part."""
    if not wanted:
        return None
    if made.case is None:
        remedy = "export a model with the part, or leave it out"
        raise InputError(say("--shape", "an FMU of a model", "one of a part", remedy))
    return shapes.find_shape(made.case, made.model.system, "--shape")


def reference_of(made: ExportedModel) -> TrainingMotion | None:
    """The motion of a training with its errors; None of a part, and where it cannot be taken."""
    if made.case is None:
        return None
    case = made.case if isinstance(made.case, Case) else made.case.nominal
    steps = steps_in(case.scheme, case.duration)
    try:
        # what speaks against the motion was said by the training
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            motion = cases.run(case, -(-steps // ROWS))
            columns = dynamics.outputs(motion)
    except SolverError:
        return None
    absolute, relative = (files.read_errors(made.notes, kind) for kind in ("error", "relative"))
    # what counts events, and what controllers give, is no output of the motion
    names = [one.name for one in made.model.columns if one.name in columns]
    errors = {
        one.name: (one.unit, absolute.get(one.name), relative.get(one.name))
        for one in made.model.columns
        if one.name in absolute or one.name in relative
    }
    found = {name: columns[name] for name in names}
    return TrainingMotion(case.scheme.step, motion.times, found, errors)


def refuse_taken(job: Job, where: str, places: list[Path]) -> None:
    """InputError where files are there already."""
    if (taken := [str(one) for one in places if one.exists()]) and not job.force:
        raise InputError(
            say(
                where,
                "a place without these files",
                ", ".join(taken),
                "choose another one, or --force",
            )
        )


def export_fmu(job: Job, model: CModel, title: str, unit: FMU, place: Path) -> Result:
    """A model as an FMU, with binaries where there is a compiler; MissingFeature, with the result,
    where it could not make one.
    """
    refuse_taken(job, f"--fmu {place}", [place])
    built = binaries.build(unit.files, unit.version)
    version = unit.version
    with durable.writing(place.parent):
        place.parent.mkdir(parents=True, exist_ok=True)
    made = [durable.write(place, fmu.pack(unit, built.binaries))]
    folders = [one.folder for one in built.binaries]
    report = report_of(job, model, made) | {
        "fmi": version,
        "compiler": built.compiler,
        "binaries": folders,
        "failed": built.failed,
    }
    about = f"{job.path}: {title} as an FMU of FMI {version}.0"
    error = None
    if built.failed:
        expected = f"binaries of {built.compiler} for all its machines"
        text = say(
            f"--fmu {place}",
            expected,
            f"none for {', '.join(built.failed)}",
            "compile its sources there",
        )
        error = MissingFeature(text)
        report |= describe_error(error)
    return conclude(
        Result(about=about, report=report, lines=[*views(model, made), *told(built)], error=error)
    )


def told(built: Built) -> list[str]:
    """For which machines there are binaries, and what would give more."""
    folders = ", ".join(one.folder for one in built.binaries)
    lines = [f"binaries by {built.compiler}: {folders}" if folders else "sources only: no binaries"]
    if built.compiler != "zig":
        lines.append(f"for all machines: {extras.install('fmu')}")
    return lines + [
        f"no binary for {machine}: {text.strip()}" for machine, text in built.failed.items()
    ]


def input_ranges(found: CModel) -> dict[str, tuple[str, float, float, float]]:
    """Unit, least and largest value and start of all inputs; of one without a range around its
    start.
    """
    shown = {}
    for name, (unit, start) in found.inputs.items():
        shown[name] = unit, *found.ranges.get(name, (start - 1.0, start + 1.0)), start
    return shown


def report_of(job: Job, found: CModel, made: list[Path]) -> dict[str, object]:
    """What was written, for programs."""
    return {
        "status": "ok",
        "model": job.path,
        "name": found.name,
        "step": found.step,
        "parameters": {
            name: {"unit": unit, "range": [low, high], "value": value}
            for name, (unit, low, high, value) in found.parameters.items()
        },
        "inputs": {
            name: {"unit": unit, "start": start} for name, (unit, start) in found.inputs.items()
        },
        "outputs": {one.name: one.unit for one in found.columns},
        "left_out": list(found.left_out),
        "files": made,
        "notices": job.notices,
    }


def views(found: CModel, made: list[Path]) -> list[ReportTable | str]:
    """The same for people."""
    rows = [
        ["parameter", add_unit(name, unit), f"{low:g} to {high:g}, {value:g}"]
        for name, (unit, low, high, value) in found.parameters.items()
    ]
    rows += [
        ["input", add_unit(name, unit), f"starts at {start:g}"]
        for name, (unit, start) in found.inputs.items()
    ]
    rows += [["output", add_unit(one.name, one.unit), ""] for one in found.columns]
    rows += [["left out", name, "has no form in C"] for name in found.left_out]
    table = ReportTable(
        f"{found.name} in C, with a step of {found.step:g} s", ["port", "name", ""], rows
    )
    return [table, *list_files({"files": made})]
