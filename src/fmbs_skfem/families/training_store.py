"""The folder of a training: closed files that a later session reads, so that nothing in it is
computed again.

    training.h5          what is trained, as a fingerprint
    run-001.h5           factors of the first full run
    model-001.h5         the reduced model of one run, as a file of `parametric_model`; there is none where a file cannot hold it
    notes-001.h5         pairs of indicator and error known with this model, the choice of eps and eta
    indicators-001.h5    its indicators, as far as they are known
    iteration-001.h5     the first iteration of the greedy loop, complete
    check-007.h5         full run of a check at candidate 7

A folder of another training is refused. A fingerprint is made of the numbers of the family at both
corners of the box, to nine digits, of plan, snapshots, candidates and options.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.laws import Law
from ..core.algebra.linalg import is_sparse
from ..core.compiling.structs import Routine
from ..core.errors import InputError, Reason, SolverError, say
from ..core.storage.container import FileKind
from ..core.storage.records import dataclass
from ..core.storage.store import Store
from ..reduction.accuracy.error_budget import BudgetChoice
from ..reduction.cases import Case
from ..reduction.full_runs import FullRun, TrainingTask
from ..reduction.reduced_models import ReducedModel
from ..systems.row_laws import RowLaw
from ..systems.system import Signal, System
from . import parametric_model
from .parametric_model import ParametricModel

KIND = FileKind(
    "fmbs_skfem training", "a part of a training", "delete the file; what it held is made again"
)
TITLE, RUN, MODEL, NOTES = "training", "run-", "model-", "notes-"
INDICATORS, ITERATION, CHECK = "indicators-", "iteration-", "check-"
DIGITS = 9  #: of numbers in a fingerprint
TIMES = np.linspace(0.0, 1.0, 17)  #: where functions of time are sampled for a fingerprint [s]
#: of a duration, the same, in no rhythm that a function may have
PARTS = 0.5 * (math.sqrt(5.0) - 1.0) * np.arange(1, 1025) % 1.0


@dataclass(frozen=True)
class Pair:
    """A reduced run beside its full run.

    What `calibration.fit` learns from: indicator I and error e of one reduced model at the
    parameters of one full run.
    """

    run: int  #: number of the full run, from 0; -1 of a check
    bases: int  #: number of full runs in the bases of the reduced model
    indicator: float
    error: float  #: in the measure of the task


@dataclass(frozen=True)
class Notes:
    """What is known of a training beside its runs, models and iterations."""

    pairs: tuple[Pair, ...] = ()
    choice: BudgetChoice | None = None
    lowered: int = 0
    discarded: int = 0


@dataclass(frozen=True)
class Indicators:
    """Indicators of a model as they are stored."""

    values: dict[int, float]  #: by candidate


@dataclass(frozen=True)
class StoredRun:
    """A full run of a folder."""

    run: FullRun
    point: int  #: its candidate


@dataclass(frozen=True)
class FailedRun:
    """A check that has failed."""

    failed: str
    reason: Reason
    time: float  #: [s]


def store_of(folder: Path | None) -> Store:
    """The files of a training; without a folder nothing is stored."""
    return Store(folder, KIND, 3)


def open_folder(folder: Path | str, fingerprint: str) -> Store:
    """The files in a folder, made where there is none; that of another training is refused."""
    files = store_of(Path(folder))
    title = files.read(TITLE, None)
    if title is None and any(Path(folder).glob("*-[0-9][0-9][0-9].*")):
        got = f"one without {files.path(TITLE, None).name}"
        expected = "an empty folder or one of this training"
        raise InputError(say(f"{folder}", expected, got, "take an empty folder"))
    if title is None:
        files.append(TITLE, None, {"fingerprint": fingerprint})
    elif title.get("fingerprint") != fingerprint:
        remedy = "take an empty folder, or train with the family, plan, candidates and options of this one"
        raise InputError(
            say(f"{folder}", "a folder of this training", "one of another training", remedy)
        )
    return files


def keep_model(files: Store, number: int, model: ReducedModel, notes: Notes) -> None:
    """Store the reduced model of the first `number` runs; one that a file cannot hold is made again
    when training goes on.
    """
    if files.folder is None:
        return
    parts = {
        "modes": dict(model.modes),
        "selections": model.selections,
        "training_s": model.training_s,
    }
    parts |= {"left_out": dict(model.left_out)}
    files.forget(MODEL, number)
    with contextlib.suppress(InputError):
        parametric_model.save(
            ParametricModel(model.parametric, {"model": parts}), files.path(MODEL, number)
        )
    files.append(NOTES, number, notes)


def read_model(files: Store, number: int) -> ReducedModel | None:
    """The stored reduced model of the first `number` runs."""
    if not files.there(MODEL, number):
        return None
    found = parametric_model.load(files.path(MODEL, number))
    return ReducedModel(found.model, **found.notes["model"])


def read_or_make(files: Store, name: str, number: int, make: Callable[[], FullRun]) -> FullRun:
    """The full run of a file, or one that is made and kept there; one that has failed fails again
    without being run.
    """
    known: FullRun | FailedRun | None = files.read(name, number, FullRun | FailedRun)
    if isinstance(known, FailedRun):
        raise SolverError(known.failed, known.reason, known.time)
    if known is not None:
        return known
    try:
        run = make()
    except SolverError as error:
        files.append(name, number, FailedRun(str(error), error.reason, error.time))
        raise
    files.append(name, number, run)
    return run


def read_checks(files: Store) -> dict[int, FullRun]:
    """The checks that have succeeded, by candidate."""
    found = {
        number: files.read(CHECK, number, FullRun | FailedRun) for number in files.numbers(CHECK)
    }
    return {point: run for point, run in found.items() if isinstance(run, FullRun)}


#: fields that structs have got since trainings were kept, and the values that leave these as they are
LATER: dict[str, dict[str, Any]] = {"Output": {"law": None}, "Skin": {"points": 0}}


def fingerprint(task: TrainingTask, *others: Any) -> str:
    """What a training is, as a text: the family at both corners of the box, parameters, plan and
    snapshots, and `others`.

    Laws of one's own stand in it by name, and by the `code` of the task.
    """
    corners = [
        {p.name: end(p) for p in task.parameters} for end in (lambda p: p.low, lambda p: p.high)
    ]
    digest = hashlib.sha256()
    families = (task.family(corner) for corner in corners)
    further = (one for one in (task.measure, task.code, task.signals) if one)
    for value in (*families, task.parameters, task.plan, task.interval, *further, *others):
        add_to_digest(value, digest)
    return digest.hexdigest()


def add_to_digest(value: Any, digest: Any) -> None:
    """Add a value to a fingerprint; numbers to some digits, so that another processor gives the
    same.
    """
    value = simplify(value)
    if isinstance(value, np.ndarray):
        return digest.update(f"{value.shape}{value.dtype.kind}{summarise_array(value)}".encode())
    if isinstance(value, float | np.floating):
        return digest.update(f"{value:.{DIGITS}g};".encode())
    if isinstance(value, Mapping):
        value = [item for pair in value.items() for item in pair]
    if isinstance(value, list | tuple):
        digest.update(f"[{len(value)}".encode())
        for item in value:
            add_to_digest(item, digest)
        return None
    if callable(value):
        return add_to_digest(describe_function(value), digest)
    return digest.update(f"{value!r};".encode())


@functools.singledispatch
def simplify(value: Any) -> Any:
    """What stands for a value in a fingerprint: for structs and sparse arrays what is in them, for
    laws, routines and enumerations their names; anything else as it is.
    """
    if is_sparse(value):
        return [value.data, value.indices, value.indptr]
    return list_fields(value) if is_dataclass(value) else value


@simplify.register
def _(value: Enum) -> str:
    return f"{type(value).__name__}.{value.name}"


@simplify.register
def _(value: Routine) -> str:
    return value.__name__


@simplify.register
def _(value: functools.partial) -> list[Any]:
    return [value.func, value.args, value.keywords]


@simplify.register
def _(value: Law | RowLaw) -> list[str]:
    return [type(value).__name__, value.name]


@simplify.register
def _(value: System) -> dict[str, Any]:
    signals = tuple(one if is_dataclass(one) else sample(one, TIMES) for one in value.signals)
    return list_fields(value) | {"signals": signals}


@simplify.register
def _(value: Case) -> dict[str, Any]:
    times = PARTS * value.duration
    functions = [sample(one, times) for one in value.system.signals if not is_dataclass(one)]
    return list_fields(value) | ({"functions": functions} if functions else {})


def list_fields(value: Any) -> dict[str, Any]:
    """The type and the fields of a struct, by name; without later ones that stand for nothing."""
    parts = {field.name: getattr(value, field.name) for field in fields(value)}
    for name, nothing in LATER.get(type(value).__name__, {}).items():
        if parts[name] == nothing:
            del parts[name]
    return {"type": type(value).__name__} | parts


def sample(signal: Signal, times: np.ndarray) -> np.ndarray:
    """A function of time by its values (s,) at times (s,) [s]."""
    return np.broadcast_to(np.asarray(signal(times), dtype=float), times.shape)


def describe_function(value: Any) -> list[Any]:
    """A function by its name and the values that it has taken along; other objects by their type
    and attributes.
    """
    if not hasattr(value, "__qualname__"):
        return [type(value).__qualname__, vars(value)]
    cells = getattr(value, "__closure__", None) or ()
    return [f"{value.__module__}.{value.__qualname__}", *(cell.cell_contents for cell in cells)]


def summarise_array(array: np.ndarray) -> str:
    """A few numbers that tell arrays apart: the size, and a weighted sum relative to it."""
    if array.dtype.kind not in "biuf":
        return repr(array.tolist())
    values = array.ravel().astype(float)
    unit = float(np.abs(values).max(initial=0.0))
    if unit == 0.0 or not math.isfinite(unit):
        return f"{unit}"
    weights = np.cos(np.arange(len(values)) * math.sqrt(2.0))
    return f"{unit:.{DIGITS}g};{np.linalg.norm(values / unit):.{DIGITS}g};{weights @ (values / unit) / len(values):.{DIGITS}f}"
