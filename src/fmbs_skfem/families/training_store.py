"""The folder of a training: closed files that a later session reads, so that nothing in it is computed again.

    training.json        what is trained, as a fingerprint
    run-001.h5           factors of the first full run
    model-001.h5         the reduced model of one run, as a file of `parametric_model`; there is none where a file cannot hold it
    notes-001.json       pairs of indicator and error known with this model, the choice of eps and eta
    indicators-001.json  its indicators, as far as they are known
    iteration-001.h5     the first iteration of the greedy loop, complete
    check-00007.h5       full run of a check at candidate 7

Every file is written under another name, flushed to the disk and renamed into its place: it is there completely or not at all.
A folder of another training is refused. A fingerprint is made of the numbers of the family at both corners of the box, to nine
digits, of plan, snapshots, candidates and options.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import itertools
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies.laws import Law
from ..core.algebra.linalg import is_sparse
from ..core.compiling.structs import Routine
from ..core.errors import InputError, Reason, SolverError, say
from ..core.storage import container, durable, validation
from ..core.storage.container import FileKind
from ..core.storage.records import dataclass
from ..reduction.accuracy.error_budget import BudgetChoice
from ..reduction.cases import Case
from ..reduction.full_runs import FullRun, TrainingTask
from ..reduction.reduced_models import ReducedModel
from ..systems.row_laws import RowLaw
from ..systems.system import Signal, System
from . import greedy, parametric_model
from .parametric_model import ParametricModel

KIND = FileKind("fmbs_skfem training", "a part of a training", "delete the file; what it held is made again")
TITLE = "training.json"
DIGITS = 9  #: of numbers in a fingerprint
TIMES = np.linspace(0.0, 1.0, 17)  #: where functions of time are sampled for a fingerprint [s]
PARTS = 0.5 * (math.sqrt(5.0) - 1.0) * np.arange(1, 1025) % 1.0  #: of a duration, the same, in no rhythm that a function may have


@dataclass(frozen=True)
class Pair:
    """A reduced run beside its full run.

    What `calibration.fit` learns from: indicator I and error e of one reduced model at the parameters of one full run.
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


@dataclass(frozen=True)
class Stored:
    """What a folder holds.

    Numbers follow each other from 1; what stands behind a gap is not read.
    """

    runs: tuple[StoredRun, ...]
    iterations: tuple[greedy.Iteration, ...]
    indicators: dict[int, float]  #: of the model of all runs


def open_folder(folder: Path | str, fingerprint: str) -> Path:
    """The folder, made where there is none; that of another training is refused."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    if (title := take(place / TITLE, dict[str, Any])) is not None:
        if title.get("fingerprint") != fingerprint:
            remedy = "take an empty folder, or train with the family, plan, candidates and options of this one"
            raise InputError(say(str(place), "a folder of this training", "one of another training", remedy))
    elif any(place.glob("*-[0-9][0-9][0-9].*")):
        raise InputError(say(str(place), "an empty folder or one of this training", f"one without {TITLE}", "take an empty folder"))
    else:
        keep(place / TITLE, {"fingerprint": fingerprint})
    return place


def file_of(folder: Path | None, name: str, number: int, ending: str = "h5") -> Path | None:
    """The file of the run, model, ... of this number; None without a folder, where nothing is stored."""
    return None if folder is None else folder / f"{name}-{number:03d}.{ending}"


def keep(path: Path | None, content: Any) -> None:
    """Store a struct or plain values, as the JSON text or the numbers that the name of the file says."""
    if path is None:
        return
    tree = asdict(content) if is_dataclass(content) and not isinstance(content, type) else content
    if path.suffix == ".json":
        durable.write(path, json.dumps(tree, indent=2).encode() + b"\n")
    else:
        container.write(path, KIND, tree=tree)


def take(path: Path | None, kind: Any) -> Any:
    """What `keep` has stored, as a type; None where there is no file."""
    if path is None or not path.is_file():
        return None
    with container.reading(path, KIND):
        tree = json.loads(path.read_bytes()) if path.suffix == ".json" else container.read(path, KIND, tree=dict)["tree"]
        return validation.build(kind, tree, "content")


def numbered(folder: Path | None, kind: Any, name: str) -> tuple[Any, ...]:
    """The structs of the files with this name, from number 1 to the first that is not there."""
    each = (take(file_of(folder, name, number), kind) for number in itertools.count(1))
    return tuple(itertools.takewhile(lambda found: found is not None, each))


def read(folder: Path | None) -> Stored:
    """All that is complete in a folder, less the models."""
    runs = numbered(folder, StoredRun, "run")
    known = take(file_of(folder, "indicators", len(runs), "json"), list[tuple[int, float]])
    return Stored(runs, numbered(folder, greedy.Iteration, "iteration"), dict(known or ()))


def keep_model(folder: Path | None, number: int, model: ReducedModel, notes: Notes) -> None:
    """Store the reduced model of the first `number` runs; one that a file cannot hold is made again when training goes on."""
    if (path := file_of(folder, "model", number)) is None:
        return
    parts = {"modes": dict(model.modes), "selections": model.selections, "training_s": model.training_s}
    parts |= {"left_out": dict(model.left_out)}
    path.unlink(missing_ok=True)
    with contextlib.suppress(InputError):
        parametric_model.save(ParametricModel(model.parametric, {"model": parts}), path)
    keep(file_of(folder, "notes", number, "json"), notes)


def notes_of(folder: Path | None, number: int) -> Notes | None:
    """What was known when the model of the first `number` runs was made; None where it was not."""
    found: Notes | None = take(file_of(folder, "notes", number, "json"), Notes)
    return found


def read_model(folder: Path | None, number: int) -> ReducedModel | None:
    """The stored reduced model of the first `number` runs."""
    path = file_of(folder, "model", number)
    if path is None or not path.is_file():
        return None
    found = parametric_model.load(path)
    return ReducedModel(found.model, **found.notes["model"])


def forget(folder: Path | None, number: int) -> None:
    """Remove the iteration and the indicators of a model that is made again."""
    for path in (file_of(folder, "iteration", number), file_of(folder, "indicators", number, "json")):
        if path is not None:
            path.unlink(missing_ok=True)


def keep_indicators(folder: Path | None, number: int, indicators: Mapping[int, float]) -> None:
    """Store the indicators of the model of the first `number` runs."""
    keep(file_of(folder, "indicators", number, "json"), list(indicators.items()))


def keep_iteration(folder: Path | None, iteration: greedy.Iteration) -> None:
    """Store a complete iteration."""
    keep(file_of(folder, "iteration", iteration.number), iteration)


def read_or_make(path: Path | None, make: Callable[[], FullRun]) -> FullRun:
    """The full run of a file, or one that is made and kept there; one that has failed fails again without being run."""
    known: FullRun | FailedRun | None = take(path, FullRun | FailedRun)
    if isinstance(known, FailedRun):
        raise SolverError(known.failed, known.reason, known.time)
    if known is not None:
        return known
    try:
        run = make()
    except SolverError as error:
        keep(path, {"failed": str(error), "reason": error.reason.value, "time": error.time})
        raise
    keep(path, run)
    return run


def read_checks(folder: Path | None) -> dict[int, FullRun]:
    """The checks that have succeeded, by candidate."""
    files = sorted(folder.glob("check-*.h5")) if folder else ()
    found = {int(path.stem.split("-")[1]): take(path, FullRun | FailedRun) for path in files}
    return {point: run for point, run in found.items() if isinstance(run, FullRun)}


def fingerprint(task: TrainingTask, *others: Any) -> str:
    """What a training is, as a text: the family at both corners of the box, parameters, plan and snapshots, and `others`.

    Laws of one's own stand in it by name, and by the `code` of the task.
    """
    corners = [{p.name: end(p) for p in task.parameters} for end in (lambda p: p.low, lambda p: p.high)]
    digest = hashlib.sha256()
    families = (task.family(corner) for corner in corners)
    further = (one for one in (task.measure, task.code, task.signals) if one)
    for value in (*families, task.parameters, task.plan, task.interval, *further, *others):
        add_to_digest(value, digest)
    return digest.hexdigest()


def add_to_digest(value: Any, digest: Any) -> None:
    """Add a value to a fingerprint; numbers to some digits, so that another processor gives the same."""
    if is_sparse(value):
        value = [value.data, value.indices, value.indptr]
    if isinstance(value, np.ndarray):
        return digest.update(f"{value.shape}{value.dtype.kind}{summarise_array(value)}".encode())
    if isinstance(value, Enum):
        value = f"{type(value).__name__}.{value.name}"
    if isinstance(value, Routine):
        value = value.__name__
    if isinstance(value, functools.partial):
        value = [value.func, value.args, value.keywords]
    if isinstance(value, Law | RowLaw):
        value = [type(value).__name__, value.name]
    if isinstance(value, float | np.floating):
        return digest.update(f"{value:.{DIGITS}g};".encode())
    if is_dataclass(value):
        parts = {field.name: getattr(value, field.name) for field in fields(value)}
        if isinstance(value, System):
            parts["signals"] = tuple(one if is_dataclass(one) else sample(one, TIMES) for one in value.signals)
        if isinstance(value, Case) and (functions := [one for one in value.system.signals if not is_dataclass(one)]):
            parts["functions"] = [sample(one, PARTS * value.duration) for one in functions]
        value = {"type": type(value).__name__} | parts
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


def sample(signal: Signal, times: np.ndarray) -> np.ndarray:
    """A function of time by its values (s,) at times (s,) [s]."""
    return np.broadcast_to(np.asarray(signal(times), dtype=float), times.shape)


def describe_function(value: Any) -> list[Any]:
    """A function by its name and the values that it has taken along; other objects by their type and attributes."""
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
