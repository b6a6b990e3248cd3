r"""The reduced model of a whole parameter range as one file.

    rom = parametric_model.load("crank_slider.rom")
    motion = parametric_model.run(rom, E=55e9)
    table = dynamics.outputs(motion)

The file holds the polynomials of `affine` and notes on how they came about: name and hashes of the
scene and its meshes, versions, training, calibration. It runs without mesh and full model, and is
written and checked as all files of `reduction.files`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import installed
from ..core.errors import InputError, say
from ..core.storage import container, durable
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.ranges import Parameter
from ..dynamics.trajectory import Trajectory
from ..reduction import affine, cases, files
from ..reduction import parameters as boxes
from ..reduction.affine import ParametricCase
from ..reduction.cases import Case

KIND = replace(files.KIND, title="fmbs_skfem parametric model")
LIBRARIES = ("fmbs_skfem", "numpy", "scipy", "numba")


@dataclass(frozen=True)
class ParametricModel:
    """A parametric model and what is known of it.

    `model(values)` is the reduced case at values of the parameters; `notes` say how it was trained
    and what was found.
    """

    model: ParametricCase
    notes: dict[str, Any] = field(default_factory=dict)


@checked
def save(rom: ParametricModel, path: str | Path) -> Path:
    """Write a parametric model; versions of the libraries are noted, the form with all multipliers
    is left out.

    The file appears under its name when it is complete. InputError names what a file cannot hold,
    such as a function of Python.
    """
    model = rom.model
    nominal = replace(model.nominal, system=replace(model.nominal.system, full=None))
    varying = tuple(part for part in model.varying if part.place[:2] != ("system", "full"))
    notes = {"versions": {name: installed.version(name) for name in LIBRARIES}} | rom.notes
    return container.write(
        path, KIND, model=replace(model, nominal=nominal, varying=varying), notes=notes
    )


@checked
def load(path: str | Path) -> ParametricModel:
    """The parametric model of a file, made once at nominal values; CorruptFile where it is not as
    it was written.

    InputError where there is no file, as of `reduction.files.read`.
    """
    rom = ParametricModel(**container.read(path, KIND, model=ParametricCase, notes=dict))
    with container.reading(Path(path), KIND):
        rom.model(boxes.completed(rom.model.parameters, {}))
    return rom


def run(
    rom: ParametricModel,
    every: int | np.ndarray = 1,
    duration: float | None = None,
    step: float | None = None,
    /,
    **values: float,
) -> Trajectory:
    """The motion at values of the parameters, nominal where none is given; `every` as in
    `dynamics.integrate`, or steps (s,).

    `duration` and `step` [s] replace those of the training. A name that is no parameter is refused;
    a run outside of the training, by its values, a longer duration or another step, is made with a
    notice.
    """
    case, _ = case_of(rom, values, duration, step)
    return cases.run(case, every)


@checked
def case_of(
    rom: ParametricModel,
    values: Mapping[str, float],
    duration: float | None = None,
    step: float | None = None,
) -> tuple[Case, list[str]]:
    """The case at values of the parameters, nominal where none is given, and where it leaves the
    training, with a notice.

    `values` by name [SI]; `duration` and `step` [s] are those of the training by default.
    InputError for a name that is no parameter, and for a value of another sign than all of its
    range has.
    """
    model = rom.model
    point = boxes.completed(model.parameters, values)
    for parameter in model.parameters:
        boxes.require_sign(parameter, point[parameter.name], f"parameter '{parameter.name}'")
    far = boxes.outside(model.parameters, point)
    beyond = [
        f"{p.name} = {point[p.name]:g}, {describe_distance(p, point[p.name])}"
        for p in model.parameters
        if p.name in far
    ]
    return cases.at_times(model(point), duration, step, "reduced model", beyond)


def describe_distance(parameter: Parameter, value: float) -> str:
    """How far a value lies outside of its range, in parts of the range on its scale."""
    u = float(boxes.to_box((parameter,), [[value]])[0, 0])
    return f"trained from {parameter.low:g} to {parameter.high:g}, {max(-u, u - 1.0):.0%} of that range outside"


def hashes(paths: Iterable[str | Path]) -> dict[str, str]:
    """SHA-256 of files by their names, for the notes.

    InputError for a file that cannot be read.
    """
    found = {}
    for path in map(Path, paths):
        try:
            found[path.name] = durable.sha256(path)
        except OSError as problem:
            raise InputError(say(str(path), "a file that can be read", problem)) from problem
    return found


@checked
def summary(rom: ParametricModel) -> dict[str, Any]:
    """What a model is, as plain numbers and texts: parameters, sizes, polynomials, notes.

    `varying_numbers` counts the numbers that depend on parameters, `interpolation_error` is the
    largest at the hold-out points of `affine.fit`.
    """
    model = rom.model
    degree = affine.degrees(rom.model)
    system = model.nominal.system
    return {
        "parameters": {
            name: {**own, "degree": degree[name]}
            for name, own in boxes.described(model.parameters).items()
        },
        "unknowns": system.size,
        "components": system.modes,
        "constraints": len(system.constraints.names),
        "outputs": list(system.outputs),
        "steps": math.floor(model.nominal.duration / model.nominal.scheme.step + 0.5),
        "varying_numbers": sum(len(part.positions) for part in model.varying),
        "interpolation_error": model.error,
        "notes": rom.notes,
    }
