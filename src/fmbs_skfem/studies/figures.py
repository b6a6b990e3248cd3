"""Figures of a comparison: histories, errors over time, norms of the residual, singular values, CPU
time against error.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from .. import dynamics
from ..core.values.display import DisplayUnits
from ..core.values.units import add_unit
from ..reduction import residual_norms
from ..results import plots
from ..results.speed import Point
from ..scenes import build
from ..systems.connections.joints import Pin, Revolute, Slider
from ..systems.measures import probes
from ..systems.measures.probes import AngularVelocity, Position
from . import job as jobs
from . import plans
from .result import Figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..dynamics import Trajectory
    from ..reduction.accuracy.comparison import Comparison
    from ..reduction.spaces.pod import Basis
    from ..scenes import Scene

WRONG = 1.0  #: error over the size of the motion above which a model is not drawn: it has nothing in common with the full one


def names(scene: Scene) -> list[str]:
    """Names of the figures of a comparison."""
    drawn = [f"history_{name}" for name, output in scene.outputs.items() if output.known_to_all]
    drawn += ["slider"] if slider_columns(scene) else []
    return [*drawn, "errors", "norms", "singular_values", "speed_error"]


def draw(scene: Scene, study: Comparison) -> Figures:
    """Histories of the outputs, errors over time, norms of the residual, singular values, and CPU
    time against error.
    """
    rules = histories(scene, study)
    if study.errors:
        rules["errors"] = functools.partial(errors, study, scene.display)
    if "component" in study.motions and study.full.system.full is not None:
        rules["norms"] = functools.partial(norms, scene, study)
    if any(spectra(study)):
        rules["singular_values"] = functools.partial(singular_values, scene, study)
    return Figures({**rules, "speed_error": functools.partial(cloud, scene, study)})


def errors(study: Comparison, display: DisplayUnits) -> Figure:
    """Errors of all models over time, beside that of the full model's own step."""
    times = next(iter(study.errors.values())).times
    curves = {
        name: readable(error.distance, float(error.motion.max()))
        for name, error in study.errors.items()
    }
    floor = study.time_error.distance if study.time_error else None
    return plots.errors(times, curves, "error, root mean square [m]", level=floor, display=display)


def cloud(scene: Scene, study: Comparison) -> Figure:
    """CPU time against error; models whose error is above WRONG are named in the title, not drawn."""
    wrong = [record.name for record in study.records if record.max_error > WRONG]
    shown = [point for point in points(study) if point.name not in wrong]
    heading = jobs.title(scene) + (
        f"; off the chart (error > {100.0 * WRONG:g} %): {', '.join(wrong)}" if wrong else ""
    )
    if study.truth:
        return plots.speed_error(
            shown, None, f"true error, part of an output's range\n(against {study.truth})", heading
        )
    return plots.speed_error(
        shown,
        study.time_error.position if study.time_error else None,
        "largest position error [m]",
        heading,
    )


def histories(scene: Scene, study: Comparison) -> dict[str, Callable[[], Figure]]:
    """One figure an output, all models in it; of a planar crank-slider also displacement and speed
    together.
    """
    columns = {
        name: drawn_outputs(motion)
        for name, motion in {"full": study.full, **study.motions}.items()
    }
    rules: dict[str, Callable[[], Figure]] = {}
    times = study.full.times

    def curves(column: str) -> dict[str, np.ndarray]:
        return inside({name: found[column] for name, found in columns.items()})

    for name, output in study.full.system.outputs.items():
        if probes.kind_of(output).known_to_all:
            units = probes.units(name, output)
            grid = {
                add_unit(column, unit): curves(column)
                for column, unit in zip(output.columns, units, strict=True)
            }
            rules[f"history_{name}"] = functools.partial(
                plots.history_grid, times, grid, jobs.title(scene), display=scene.display
            )
    if (known := slider_columns(scene)) is not None:
        axis, position, speed = known
        shown = curves(position), curves(speed), axis, jobs.title(scene), scene.display
        rules["slider"] = functools.partial(plots.slider, times, *shown)
    return rules


def slider_columns(scene: Scene) -> tuple[str, str, str] | None:
    """Axis of the guide of a planar crank-slider, position along it of what slides, and a speed of
    rotation; None without them.
    """
    guide = next((joint for joint in scene.joints.values() if isinstance(joint, Slider)), None)
    if guide is None or scene.dimension != 2:
        return None
    axis = "xy"[int(np.argmax(np.abs(guide.direction[:2])))]
    hinges = [
        {joint.at, joint.to} for joint in scene.joints.values() if isinstance(joint, Pin | Revolute)
    ]
    there = {guide.at}.union(*(hinge for hinge in hinges if guide.at in hinge))
    position = next(
        (
            name if output.component else f"{name}_{axis}"
            for name, output in scene.outputs.items()
            if isinstance(output, Position)
            and output.component in (axis, None)
            and output.at in there
        ),
        None,
    )
    speed = next(
        (name for name, output in scene.outputs.items() if isinstance(output, AngularVelocity)),
        None,
    )
    return None if position is None or speed is None else (axis, position, speed)


def drawn_outputs(motion: Trajectory) -> dict[str, np.ndarray]:
    """Outputs that every model knows."""
    wanted = {
        name: output
        for name, output in motion.system.outputs.items()
        if probes.kind_of(output).known_to_all
    }
    return dynamics.outputs(
        dataclasses.replace(motion, system=dataclasses.replace(motion.system, outputs=wanted))
    )


def inside(curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Curves without what lies farther from the first one's range than its span: a wrong model must
    not hide the others.
    """
    first = next(iter(curves.values()))
    low = first.min()
    high = first.max()
    span = float(np.ptp(first))
    return {
        name: np.where((values < low - span) | (values > high + span), np.nan, values)
        for name, values in curves.items()
    }


def readable(error: np.ndarray, size: float) -> np.ndarray:
    """Errors (s,) [m] of a motion of some size [m], without the start, where they are round-off,
    and what is wrong altogether.
    """
    return np.where((error > 10 * WRONG * size) | (error < 1e-4 * np.median(error)), np.nan, error)


def norms(scene: Scene, study: Comparison) -> Figure:
    """Norms of the full residual on the motion of the reduced model by component."""
    assert study.full.system.full is not None
    scheme = dataclasses.replace(build.dynamic(scene).scheme, step=study["full"].step)
    found = residual_norms(study.full.system.full, study.motions["component"], scheme)
    curves = {
        "two-norm": found.plain,
        "constraint forces": found.constraint,
        "gappy norm": found.gappy,
    }
    return plots.errors(
        found.times, curves, "norm of the full model's residual", display=scene.display
    )


def spectra(study: Comparison) -> dict[str, Basis]:
    """The bases of all components and of the system, but for rigid components that stay where they
    are.
    """
    levels = {level: bases(study, level) for level in ("system", "component")}
    found = {
        name if level == "component" else level: basis
        for level, known in levels.items()
        for name, basis in known.items()
    }
    return {name: basis for name, basis in found.items() if basis.singular_values.any()}


def singular_values(scene: Scene, study: Comparison) -> Figure:
    """Singular values of all bases, and where they are cut."""
    found = spectra(study)
    kept = {name: basis.modes.shape[1] for name, basis in found.items()}
    values = {
        name: basis.singular_values[basis.singular_values > 0][: 3 * max(kept.values())]
        for name, basis in found.items()
    }
    eps = plans.plan(scene).tolerance if scene.reduction and scene.reduction.modes is None else None
    return plots.singular_values(values, kept, eps)


def bases(study: Comparison, level: str) -> Mapping[str, Basis]:
    """The bases of a level, which all its models share; none where none of them ran."""
    return next(
        (model.bases for name, model in study.models.items() if study[name].level == level), {}
    )


def points(study: Comparison) -> list[Point]:
    """CPU time against true error or, without one, position error, of all models that were run;
    infinite of failed ones.

    Without a true error, models finer than the full one have none: what they differ by is the error
    of that.
    """
    ranked = [record for record in study.records if study.truth or not record.finer]
    found = [
        (record, record.true_error if study.truth else record.position_error) for record in ranked
    ]
    return [
        Point(
            record.name,
            record.family,
            record.cpu_s if record.cpu_s > 0 else 1.0,
            error if math.isfinite(error) else math.inf,
        )
        for record, error in found
    ]
