"""What a sweep runs: members of a scene or of a saved reduced model, over ranges from files and
from options.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import scenes
from ..core.errors import InputError, closest, listed, say
from ..core.notices import notify
from ..core.storage import container
from ..core.storage.records import dataclass
from ..core.values.display import SI, DisplayUnits
from ..core.values.ranges import Parameter, Scale
from ..families import parametric_model, prediction, sensitivity
from ..families.members import FamilyTask, ModelTask, PathTask
from ..reduction import files
from ..reduction import parameters as boxes
from ..results import sweep_files
from ..scenes import build, yamlfile
from ..scenes import parameters as texts
from ..scenes.family import equilibria, with_value
from . import job as jobs
from . import models, reports
from .job import Job

if TYPE_CHECKING:
    from ..families.members import Task
    from ..families.prediction import Predictor
    from ..scenes import Scene
    from .options import Amount, Ranges


SALTELLI = "saltelli"  #: the design that gives Sobol indices


@dataclass(frozen=True)
class Members:
    """What is swept."""

    name: str
    parameters: tuple[Parameter, ...]
    task: Task
    mark: str  #: fingerprint of what the members are made from and of what is kept of them
    predict: Predictor | None = None  #: error of a member, where a model knows it
    fixed: Mapping[str, float] = field(default_factory=dict)  #: parameters that no member changes
    scene: Scene | None = None  #: whose full models are swept; none of a saved model
    #: `parameters` with the ranges of the training of a saved model
    trained: tuple[Parameter, ...] = ()
    display: DisplayUnits = SI  #: units in which people read its numbers


def members(job: Job, ranges: Ranges, instants: int) -> Members:
    """What a job sweeps: full models of a scene, or a saved model."""
    return (of_model if models.is_model(job) else of_scene)(job, ranges, instants)


def of_scene(job: Job, ranges: Ranges, instants: int) -> Members:
    """Full models of a scene."""
    job.path = job.path.resolve()
    read = jobs.read_scene(job, within=True)  # samples have instants of their own
    known, cases = scenes.family(read, allow_outside=job.allow_outside, duration=job.duration)
    given = {own.name: own for own in from_texts(job, ranges, read.parameters)}
    for name in given.keys() - read.used:
        raise InputError(
            say(f"--range {name}", "a parameter that the scene uses", "one that nothing uses")
        )
    kept = tuple(own for own in known if own.name not in given and own.name not in job.changes)
    parameters = check_ranges(f"{job.path}", (*kept, *given.values()))
    nominal = boxes.completed(parameters, {})
    task: Task
    if build.history(read).moves:
        task = FamilyTask(cases, nominal, functools.partial(build.chosen_form, read), instants)
    else:
        task = PathTask(
            functools.partial(equilibria, scene=read, allow_outside=job.allow_outside), nominal
        )
    title = read.name or job.path.stem
    return Members(
        title,
        parameters,
        task,
        mark_of(reports.fingerprint(read), instants),
        scene=read,
        display=read.display,
    )


def from_texts(job: Job, ranges: Ranges, values: Mapping[str, float]) -> list[Parameter]:
    """Parameters of a scene with ranges from options, in the dimension of the scene's."""
    raw = dict(yamlfile.plain(yamlfile.read(job.path)).get("parameters") or {}) if ranges else {}
    entries = {}
    for name, (low, high, *log) in ranges.items():
        if name not in raw:
            got = f"'{name}'{closest(name, raw)}"
            raise InputError(
                say(f"--range {name}", f"one of the parameters {listed(raw, name)}", got)
            )
        entry = raw[name]
        value = entry.get("value") if isinstance(entry, dict) else entry
        given = {"range": [low, high], "scale": "log" if "log" in log else "linear"}
        entries[name] = given if value is None else given | {"value": value}
    known = texts.resolve({**raw, **entries}, {})
    for keys, problem in known.found:
        raise InputError(
            problem.at(
                f"--range {keys[1]}" if len(keys) > 1 and keys[1] in ranges else "parameters"
            )
        )
    return [with_value(known.ranges[name], values.get(name)) for name in ranges]


def check_ranges(place: str, parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """At least one parameter that varies, and columns of the table for all of them."""
    if not parameters:
        remedy = "give one a range in the scene, 'E: {value: 1 GPa, range: [0.7 GPa, 1.3 GPa]}', or by --range 'E=0.7 GPa:1.3 GPa'"
        raise InputError(say(place, "a parameter with a range", "none", remedy))
    sweep_files.check_names(parameters)
    return parameters


def of_model(job: Job, ranges: Ranges, instants: int) -> Members:
    """A reduced model that was saved."""
    if job.duration is not None:
        raise InputError(
            say(
                "--duration",
                "a scene",
                "a saved reduced model",
                "it runs over the duration it was trained for",
            )
        )
    path = job.path.resolve()
    if not models.parametric(path) and container.title(path) == files.KIND.title:
        raise InputError(
            say(
                str(job.path),
                "a model over ranges of parameters",
                "one of a single scene",
                "make one with fmbs train",
            )
        )
    model = parametric_model.load(path)
    trained = model.model.parameters
    boxes.known(trained, [*job.changes, *ranges])
    named = {own.name: own for own in trained}
    fixed = {name: read_value(named[name], text) for name, text in job.changes.items()}
    given = {name: narrow(named[name], *limits) for name, limits in ranges.items()}
    kept = tuple(
        given.get(own.name, own) for own in trained if own.name in given or own.name not in fixed
    )
    digest = hashlib.sha256(path.read_bytes() + repr(sorted(fixed.items())).encode()).hexdigest()
    task = ModelTask(str(path), fixed, instants)
    parameters = check_ranges(str(job.path), kept)
    title = models.title(path, model.notes)
    if doubts := model.notes.get(prediction.DOUBTS, ()):
        notify(
            f"the error estimate of the model is not reliable: {'; '.join(doubts)}; check with full runs"
        )
    ranges_of_training = tuple(named[own.name] for own in parameters)
    mark = mark_of(digest, instants)
    more = ranges_of_training, DisplayUnits.of(model.notes)
    return Members(title, parameters, task, mark, prediction.predictor(model), fixed, None, *more)


def mark_of(digest: str, instants: int) -> str:
    """The fingerprint of members made of what has this one, with what is kept of them."""
    return f"{digest} {instants} {sweep_files.KIND.version}"


def predict_errors(members: Members, points: np.ndarray) -> dict[str, np.ndarray]:
    """The error of every member that a model predicts for itself, with its band."""
    if members.predict is None:
        return {}
    found = [
        members.predict({**members.fixed, **boxes.named(members.parameters, row)}) for row in points
    ]
    return {
        "predicted error": np.array([one.error for one in found]),
        "predicted error low": np.array([one.low for one in found]),
        "predicted error high": np.array([one.high for one in found]),
    }


def read_value(own: Parameter, given: Amount) -> float:
    """The value of a parameter of a saved model that is set; one outside of the training with a
    warning.
    """
    found = models.read_value(own, str(given), "--set")
    if not own.low <= found <= own.high:
        span = f"trained from {own.low:g} to {own.high:g} {own.unit}"
        notify(f"the reduced model runs outside its training: {own.name} = {given}, {span}")
    return found


def narrow(known: Parameter, low: Amount, high: Amount, scale: str = "") -> Parameter:
    """A parameter of a saved model with another range."""
    first, last = (models.read_value(known, str(end), "--range") for end in (low, high))
    return Parameter(
        known.name, first, last, Scale.LOG if scale == "log" else Scale.LINEAR, known.unit
    )


def spread(
    parameters: Sequence[Parameter],
    samples: int | str | None,
    design: str | None,
    table: str | Path | None,
    seed: int,
) -> np.ndarray:
    """The points (k, d) of the sweep."""
    if table is not None or design == "list":
        if table is None or samples is not None or design not in (None, "list"):
            raise InputError(
                say(
                    "--list",
                    "a table alone, without --samples and another --design",
                    table or "no table",
                )
            )
        return boxes.listed(parameters, sweep_files.read_points(Path(table), parameters))
    counts = re.fullmatch(r"[1-9]\d{0,8}(x[1-9]\d{0,8})*", str(samples or ""))
    if counts is None:
        raise InputError(
            say(
                "--samples",
                "a number of samples, or of values of each parameter of a grid (20x50)",
                samples or "none",
            )
        )
    each = [int(text) for text in counts[0].split("x")]
    if design == "grid":
        return boxes.grid(parameters, each if len(each) > 1 else root(each[0], len(parameters)))
    if len(each) > 1:
        raise InputError(say("--samples", "one number", samples, "add --design grid"))
    if design == SALTELLI:
        if each[0] < sensitivity.LEAST:
            expected = f"at least {sensitivity.LEAST} with --design {SALTELLI}, of which each is {len(parameters) + 2} runs"
            raise InputError(say("--samples", expected, each[0], "take more samples"))
        return sensitivity.design(parameters, each[0], seed)
    return (boxes.latin_hypercube if design == "lhs" else boxes.sobol)(parameters, each[0], seed)


def warn_outside(members: Members, points: np.ndarray) -> None:
    """A warning where points (k, d) of a saved model, as those of a table, lie beyond its training."""
    if not members.trained:
        return
    low, high = (
        np.array([getattr(own, end) for own in members.trained]) for end in ("low", "high")
    )
    beyond = np.maximum(low - points, points - high) > boxes.NEAR * (high - low)
    if beyond.any():
        spans = [
            f"{own.name} from {column.min():g} to {column.max():g}, trained from {own}"
            for own, column, far in zip(members.trained, points.T, beyond.T, strict=True)
            if far.any()
        ]
        where = f"in {beyond.any(axis=1).sum()} of {len(points)} samples: {'; '.join(spans)}"
        notify(
            f"the reduced model runs outside its training {where}; no error is predicted there, check it against full runs"
        )


def root(count: int, dimensions: int) -> int:
    """Values a parameter of a grid of `count` points."""
    found = round(count ** (1.0 / dimensions))
    if found**dimensions != count:
        remedy = f"take {found**dimensions}, or write the values of each parameter as 20x50"
        raise InputError(
            say("--samples", f"the power {dimensions} of a whole number for a grid", count, remedy)
        )
    return found


def fingerprint(members: Members, points: np.ndarray) -> str:
    """Hash of what is computed."""
    names = [own.name for own in members.parameters]
    return hashlib.sha256(
        f"{members.mark} {names} {points.shape}".encode() + points.tobytes()
    ).hexdigest()
