"""Reduced models as files: a model that runs again without the meshes and the full model it came
from.

A file is a `container` of the System and of notes. No text of it is executed: functions of time are
postfix programs of expressions. Arrays must fit each other, even where the checksum is right:
`validation`. Other programs read it as HDF5 with a user block of 512 bytes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

import numpy as np

from ..core.errors import CorruptFile, InputError, say
from ..core.storage import container
from ..core.storage.container import FileKind
from ..core.storage.records import dataclass
from ..core.storage.validation import check
from ..core.values.arguments import checked
from ..core.values.problems import shown
from ..dynamics.scheme import GeneralizedAlpha, Newton, Start
from ..dynamics.trajectory import Trajectory
from ..systems.system import System
from . import cases, validation  # noqa: F401  (rules of what is read)
from .accuracy import output_errors
from .cases import Case

T = TypeVar("T")
ANEW = "train and save the model anew"
KIND = FileKind(
    "fmbs_skfem reduced model", "a reduced model", f"copy the file again, or {ANEW}", ANEW
)


@dataclass(frozen=True)
class Saved:
    """What a file holds.

    `notes` are what `save` was given: numbers, texts, arrays, tuples, lists, dicts.
    """

    system: System
    notes: dict[str, Any]


@checked
def save(system: System, path: str | Path, **notes: Any) -> Path:
    """Write a reduced system and notes about it (numbers, texts, arrays, tuples, lists, dicts,
    selections) to a file.

    The form with all multipliers, `system.full`, is left out. The file appears under its name when
    it is complete.
    """
    return container.write(path, KIND, system=replace(system, full=None), notes=notes)


def require_savable(system: System) -> None:
    """InputError where no file can hold what a reduced model has of a full system, as functions of
    Python: before its runs.

    Nothing is written.
    """
    container.encode(replace(system, full=None), [], "system")


@checked
def case_of(
    saved: Saved,
    duration: float | None = None,
    step: float | None = None,
    where: str = "reduced model",
) -> tuple[Case, list[str]]:
    """The case of a model, and where it leaves the training, with a notice; times [s] not given are
    those of the training.

    A notice names the outputs that the model gave wrong in its training.

    InputError where neither the notes nor the arguments have a duration and a step, CorruptFile
    where those of the notes are no numbers.
    """
    times = read_times(saved.notes, where)
    missing = [
        name
        for name, value in (("duration", duration), ("step", step))
        if value is None and name not in times
    ]
    if missing:
        raise InputError(
            say(
                where,
                "a duration and a step",
                f"no {' and no '.join(missing)}",
                "give both in seconds",
            )
        )
    end = duration or times["duration"]
    h = step or times["step"]
    earlier_one = GeneralizedAlpha(
        times.get("step", h), times.get("rho_inf", 0.8), read_start(saved.notes, where)
    )
    scheme = read_note(saved.notes, "scheme", earlier_one, where)
    case = Case(
        saved.system,
        scheme,
        times.get("duration", end),
        read_note(saved.notes, "newton", Newton(), where),
    )
    output_errors.warn_of_wrong(read_errors(saved.notes), read_units(saved.notes))
    return cases.at_times(case, duration, step, where)


@checked
def run(
    saved: Saved,
    every: int | np.ndarray = 1,
    duration: float | None = None,
    step: float | None = None,
) -> Trajectory:
    """The motion of a model over the times of its training, or others [s]; a longer run or another
    step with a notice.

    `every`, a number or steps (s,), and errors are those of `dynamics.integrate` and `case_of`.
    """
    case, _ = case_of(saved, duration, step)
    return cases.run(case, every)


def read_times(notes: Mapping[str, Any], where: str) -> dict[str, float]:
    """Duration, step and spectral radius of the training, as far as the notes of a file have them."""
    known = notes.get("report", {})
    found = {
        key: known[key]
        for key in ("duration", "step", "rho_inf")
        if isinstance(known, Mapping) and key in known
    }
    wrong = [
        key
        for key, value in found.items()
        if type(value) not in (int, float) or not math.isfinite(value)
    ]
    if wrong:
        raise CorruptFile(
            say(
                f"{where}: notes.report.{wrong[0]}", "a number", shown(found[wrong[0]]), KIND.remedy
            )
        )
    return {key: float(value) for key, value in found.items()}


def read_note(notes: Mapping[str, Any], name: str, default: T, where: str) -> T:
    """What the notes of a file have under a name, of the kind of the default, which stands for it
    where there is none.
    """
    found = notes.get(name, default)
    if not isinstance(found, type(default)):
        raise CorruptFile(
            say(f"{where}: notes.{name}", f"a {type(default).__name__}", shown(found), KIND.remedy)
        )
    with container.reading(Path(where), KIND):
        check(found, f"notes.{name}")
    return found


def read_start(notes: Mapping[str, Any], where: str) -> Start:
    """Where the motions of the training start, by the notes of a file."""
    known = notes.get("report", {})
    found = known.get("start", "reference") if isinstance(known, Mapping) else "reference"
    for start in get_args(Start):
        if found == start:
            return cast(Start, start)
    raise CorruptFile(
        say(f"{where}: notes.report.start", " or ".join(get_args(Start)), shown(found), KIND.remedy)
    )


def read_errors(notes: Mapping[str, Any], kind: str = "relative") -> dict[str, float]:
    """Errors of the outputs in the training, by column, as far as the notes of a file have them.

    Over their ranges, or as `error` in their units.
    """
    found = of_outputs(notes, kind)
    return {name: float(error) for name, error in found.items() if isinstance(error, int | float)}


def read_units(notes: Mapping[str, Any]) -> dict[str, str]:
    """Units of the outputs by column, as far as the notes of a file have them with their errors."""
    return {name: unit for name, unit in of_outputs(notes, "unit").items() if isinstance(unit, str)}


def of_outputs(notes: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """What the notes of a file have of a kind beside the errors of the outputs, by column; None
    where it is missing.
    """
    report = notes.get("report", {})
    known = report.get("output_errors", {}) if isinstance(report, Mapping) else {}
    rows = known.items() if isinstance(known, Mapping) else ()
    return {name: one.get(kind) for name, one in rows if isinstance(one, Mapping)}


@checked
def load(path: str | Path) -> System:
    """The reduced system of a file; errors as of `read`.

    The notes are left out; `read` gives both, and `run` moves the model.
    """
    return read(path).system


@checked
def read(path: str | Path) -> Saved:
    """The system of a file and its notes, checked by checksum, types and shapes.

    CorruptFile names what is wrong with a file that is not as it was written, InputError where
    there is none.
    """
    return Saved(**container.read(path, KIND, system=System, notes=dict))
