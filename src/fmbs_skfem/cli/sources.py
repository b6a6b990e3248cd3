"""What a sweep runs: members of a scene or of a saved reduced model, over ranges from files and from the command line."""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, closest, listed, say
from ..core.notices import notify
from . import common, reports, rom
from .common import Session

if TYPE_CHECKING:
    import numpy as np

    from ..reduction.members import Task
    from ..reduction.parameters import Parameter
    from ..reduction.prediction import Predictor
    from ..scenes import Scene


@dataclass(frozen=True)
class Source:
    """What is swept."""

    name: str
    parameters: tuple[Parameter, ...]
    task: Task
    mark: str  #: fingerprint of what the members are made from and of what is kept of them
    predict: Predictor | None = None  #: error of a member, where a model knows it
    fixed: Mapping[str, float] = field(default_factory=dict)  #: parameters that no member changes
    scene: Scene | None = None  #: whose full models are swept; none of a saved model


@dataclass(frozen=True)
class Limits:
    """A range given on the command line; quantities as texts."""

    name: str
    low: str
    high: str
    log: bool = False


def limits(context: click.Context, option: click.Parameter, values: tuple[str, ...]) -> tuple[Limits, ...]:
    """NAME=LOW:HIGH[:log] of --range."""
    found = []
    for text in values:
        match = re.fullmatch(r"\s*(\w+)\s*=([^:]+):([^:]+?)(:\s*(?:log|linear)\s*)?", text)
        if match is None:
            raise click.BadParameter(f"expected NAME=LOW:HIGH or NAME=LOW:HIGH:log, got '{text}'", context, option)
        found.append(Limits(match[1], match[2].strip(), match[3].strip(), "log" in (match[4] or "")))
    return tuple(found)


def scene(session: Session, ranges: Sequence[Limits], duration: float | None, instants: int) -> Source:
    """Full models of a scene."""
    from .. import scenes
    from ..reduction import parameters as boxes
    from ..reduction.members import FamilyTask
    from ..scenes import build

    read = common.read_scene(replace(session, path=session.path.resolve()), duration)
    known, family = scenes.family(read, allow_outside=session.allow_outside, duration=duration)
    given = {own.name: own for own in from_texts(session, ranges, read.parameters)}
    for name in given.keys() - read.used:
        raise InputError(say(f"--range {name}", "a parameter that the scene uses", "one that nothing uses"))
    kept = tuple(own for own in known if own.name not in given and own.name not in session.changes)
    parameters = ranged(f"{session.path}", (*kept, *given.values()))
    nominal = boxes.completed(parameters, {})
    task = FamilyTask(family, nominal, functools.partial(build.chosen_form, read), instants)
    title = read.name or session.path.stem
    return Source(title, parameters, task, f"{reports.fingerprint(read)} {instants}", scene=read)


def from_texts(session: Session, ranges: Sequence[Limits], values: Mapping[str, float]) -> list[Parameter]:
    """Parameters of a scene with ranges from the command line, in the dimension of the scene's."""
    from ..scenes import parameters as texts
    from ..scenes import yamlfile

    raw = dict(yamlfile.plain(yamlfile.read(session.path)).get("parameters") or {})
    entries = {}
    for own in ranges:
        if own.name not in raw:
            known = listed(raw, own.name)
            raise InputError(say(f"--range {own.name}", f"one of the parameters {known}", f"'{own.name}'{closest(own.name, raw)}"))
        entry = raw[own.name]
        value = entry.get("value") if isinstance(entry, dict) else entry
        given = {"range": [own.low, own.high], "scale": "log" if own.log else "linear"}
        entries[own.name] = given if value is None else given | {"value": value}
    return resolved({**raw, **entries}, ranges, texts.resolve, values)


def resolved(raw: Mapping[str, Any], ranges: Sequence[Limits], resolve: Any, values: Mapping[str, float]) -> list[Parameter]:
    """Ranges as parameters; what is wrong with them names the option."""
    from ..reduction.parameters import Parameter, Scale

    known = resolve(raw, {})
    names = [own.name for own in ranges]
    for keys, problem in known.found:
        raise InputError(problem.at(f"--range {keys[1]}" if len(keys) > 1 and keys[1] in names else "parameters"))
    found = []
    for name in names:
        own = known.ranges[name]
        nominal = values.get(name)
        inside = nominal is not None and own.low <= nominal <= own.high
        found.append(
            Parameter(name, own.low, own.high, Scale.LOG if own.log else Scale.LINEAR, own.unit, nominal if inside else None)
        )
    return found


def ranged(place: str, parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """At least one parameter that varies, and columns of the table for all of them."""
    from ..results import sweep_files

    if not parameters:
        remedy = "give one a range in the scene, 'E: {value: 1 GPa, range: [0.7 GPa, 1.3 GPa]}', or by --range 'E=0.7 GPa:1.3 GPa'"
        raise InputError(say(place, "a parameter with a range", "none", remedy))
    sweep_files.check_names(parameters)
    return parameters


def saved(session: Session, ranges: Sequence[Limits], duration: float | None, instants: int) -> Source:
    """A reduced model that was saved."""
    from ..reduction import parameters as boxes
    from ..reduction import parametric_model, prediction
    from ..reduction.members import ProductTask

    if duration is not None:
        raise InputError(say("--duration", "a scene", "a saved reduced model", "it runs over the duration it was trained for"))
    path = session.path.resolve()
    model = parametric_model.load(path)
    trained = model.model.parameters
    boxes.known(trained, [*session.changes, *(own.name for own in ranges)])
    named = {own.name: own for own in trained}
    fixed = {name: number(named[name], text, "--set") for name, text in session.changes.items()}
    given = {own.name: narrowed(own, named[own.name]) for own in ranges}
    kept = tuple(given.get(own.name, own) for own in trained if own.name in given or own.name not in fixed)
    digest = hashlib.sha256(path.read_bytes() + repr(sorted(fixed.items())).encode()).hexdigest()
    task = ProductTask(str(path), fixed, instants)
    parameters = ranged(str(session.path), kept)
    return Source(rom.title(path, model.notes), parameters, task, f"{digest} {instants}", prediction.predictor(model), fixed)


def predicted(source: Source, points: np.ndarray) -> dict[str, np.ndarray]:
    """The error of every member that a model predicts for itself, with its band."""
    import numpy as np

    from ..reduction import parameters as boxes

    if source.predict is None:
        return {}
    found = [source.predict({**source.fixed, **boxes.named(source.parameters, row)}) for row in points]
    return {
        "predicted error": np.array([one.error for one in found]),
        "predicted error low": np.array([one.low for one in found]),
        "predicted error high": np.array([one.high for one in found]),
    }


def number(own: Parameter, text: str, option: str) -> float:
    """The value of a parameter of a saved model, given by `option`; one outside of the training with a notice."""
    found = rom.value(own, text, option)
    if not own.low <= found <= own.high:
        span = f"trained from {own.low:g} to {own.high:g} {own.unit}"
        notify(f"the reduced model runs outside its training: {own.name} = {text}, {span}")
    return found


def narrowed(own: Limits, known: Parameter) -> Parameter:
    """A parameter of a saved model with another range."""
    from ..reduction.parameters import Parameter, Scale

    low, high = (number(known, text, "--range") for text in (own.low, own.high))
    return Parameter(own.name, low, high, Scale.LOG if own.log else Scale.LINEAR, known.unit)


def spread(parameters: Sequence[Parameter], samples: str | None, design: str | None, listed: Path | None, seed: int) -> np.ndarray:
    """The points (k, d) of the sweep."""
    from ..core import units
    from ..reduction import parameters as boxes
    from ..results import sweep_files

    if listed is not None or design == "list":
        if listed is None or samples is not None or design not in (None, "list"):
            raise InputError(say("--list", "a table alone, without --samples and another --design", listed or "no table"))
        size = functools.partial(unit_size, units)
        return boxes.listed(parameters, sweep_files.read_points(listed, [own.name for own in parameters], size))
    counts = re.fullmatch(r"[1-9]\d{0,8}(x[1-9]\d{0,8})*", samples or "")
    if counts is None:
        raise InputError(
            say("--samples", "a number of members, or of values of each parameter of a grid (20x50)", samples or "none")
        )
    each = [int(text) for text in counts[0].split("x")]
    if design == "grid":
        return boxes.grid(parameters, each if len(each) > 1 else root(each[0], len(parameters)))
    if len(each) > 1:
        raise InputError(say("--samples", "one number", samples, "add --design grid"))
    return (boxes.latin_hypercube if design == "lhs" else boxes.sobol)(parameters, each[0], seed)


def unit_size(units: Any, text: str) -> float:
    """The size of a unit in the header of a table."""
    from ..core.problems import Problem

    try:
        return float(units.read(f"1 {text}").value)
    except Problem as problem:
        raise InputError(problem.at(f"unit '{text}'")) from problem


def root(count: int, dimensions: int) -> int:
    """Values a parameter of a grid of `count` points."""
    found = round(count ** (1.0 / dimensions))
    if found**dimensions != count:
        remedy = f"take {found**dimensions}, or write the values of each parameter as 20x50"
        raise InputError(say("--samples", f"the power {dimensions} of a whole number for a grid", count, remedy))
    return found


def fingerprint(source: Source, points: np.ndarray) -> str:
    """Hash of what is computed."""
    names = [own.name for own in source.parameters]
    return hashlib.sha256(f"{source.mark} {names} {points.shape}".encode() + points.tobytes()).hexdigest()
