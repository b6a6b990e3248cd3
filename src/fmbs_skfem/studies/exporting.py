"""Saved reduced models out of the house: as C."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.errors import InputError, say
from ..core.storage import durable
from ..core.values.units import add_unit
from ..exports import c_files
from ..exports.c_files import CModel
from ..families import parametric_model
from ..reduction import files
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case
from . import models
from .job import Job
from .result import ReportTable, Result, list_files


def written(job: Job, name: str) -> tuple[CModel, str]:
    """A saved model in C, and its title; parameters of a whole range are variables, or have the values that are asked for."""
    case: Case | ParametricCase
    notes: Mapping[str, Any]
    if models.parametric(job.path) and not job.changes:
        rom = parametric_model.load(job.path)
        case, notes = rom.model, rom.notes
    else:
        case, notes, _ = (models.at_values if models.parametric(job.path) else models.alone)(job, None)
    errors = files.read_errors(notes)
    told = [f"{column} {error:.2g}" for column, error in errors.items()]
    text = f"Errors in its training, over the ranges of the outputs: {', '.join(told)}." if told else ""
    title = models.title(job.path, notes)
    return c_files.write(case, name or job.path.stem, title, text), title


def export(job: Job, name: str, folder: Path | None) -> Result:
    """The files of a model in C, in a folder."""
    if folder is None:
        raise InputError(say("rom export", "a folder for the C file, --c DIR", "none"))
    found, title = written(job, name)
    names = [folder / f"{found.name}.c", folder / f"{found.name}.h"]
    if (taken := [str(one) for one in names if one.exists()]) and not job.force:
        raise InputError(
            say(f"--c {folder}", "a folder without these files", ", ".join(taken), "choose another folder, or --force")
        )
    with durable.writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    made = [durable.write(place, text.encode()) for place, text in zip(names, (found.source, found.header), strict=True)]
    return Result(about=f"{job.path}: {title} as C", report=report_of(job, found, made), lines=views(found, made))


def input_ranges(found: CModel) -> dict[str, tuple[str, float, float, float]]:
    """Unit, least and largest value and start of all inputs; of one without a range around its start."""
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
        "inputs": {name: {"unit": unit, "start": start} for name, (unit, start) in found.inputs.items()},
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
    rows += [["input", add_unit(name, unit), f"starts at {start:g}"] for name, (unit, start) in found.inputs.items()]
    rows += [["output", add_unit(one.name, one.unit), ""] for one in found.columns]
    rows += [["left out", name, "has no form in C"] for name in found.left_out]
    table = ReportTable(f"{found.name} in C, with a step of {found.step:g} s", ["port", "name", ""], rows)
    return [table, *list_files({"files": made})]
