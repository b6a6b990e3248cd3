"""Figures of `fmbs compare`: histories, errors over time, norms of the residual, singular values, CPU time against error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..reduction.comparison import Comparison
    from ..reduction.pod import Basis
    from ..results.speed import Point
    from ..scenes import Scene

WRONG = 1.0  #: error over the size of the motion above which a model has nothing in common with the full one
ERROR = "error.png"
SLIDER = "slider.png"
PICTURED = ("component+ecsw", "component", "component+exact")  #: the reduced model that is pictured: the first of these that ran


def figure_names(scene: Scene) -> list[str]:
    """Files that `draw` writes."""
    drawn = [f"history_{name}.png" for name, output in scene.outputs.items() if output.known_to_all]
    drawn += [SLIDER] if slider_columns(scene) else []
    return [*drawn, "errors.png", "norms.png", "singular_values.png", "speed_error.png"]


def draw(scene: Scene, study: Comparison, out: Path) -> list[Path]:
    """Histories of the outputs, errors over time, norms of the residual, singular values, and CPU time against error."""
    from ..results import plots

    files = histories(scene, study, out)
    if study.errors:
        times = next(iter(study.errors.values())).times
        curves = {name: readable(error.distance, float(error.motion.max())) for name, error in study.errors.items()}
        floor = study.time_error.distance if study.time_error else None
        files.append(plots.errors(out / "errors.png", times, curves, floor, "error, root mean square [m]"))
    files += spectra(scene, study, out)
    return [*files, cloud(scene, study, out)]


def cloud(scene: Scene, study: Comparison, out: Path, name: str = "speed_error.png") -> Path:
    """CPU time against error; models that are wrong altogether are named in the title, not drawn."""
    from ..results import plots

    wrong = [record.name for record in study.records if record.max_error > WRONG]
    shown = [point for point in points(study) if point.name not in wrong]
    title = scene.name + (f" (not drawn, since wrong altogether: {', '.join(wrong)})" if wrong else "")
    floor = study.time_error.position if study.time_error else None
    return plots.speed_error(out / name, shown, floor, "largest position error [m]", title)


def histories(scene: Scene, study: Comparison, out: Path) -> list[Path]:
    """One figure an output, all models in it; of a planar crank-slider also displacement and speed together."""
    from ..results import plots
    from ..results.sweep_files import headed
    from ..systems import probes

    models = {"full": study.full, **study.motions}
    columns = {name: drawn_outputs(motion) for name, motion in models.items()}
    files, times = [], study.full.times

    def curves(column: str) -> dict[str, np.ndarray]:
        return inside({name: columns[name][column] for name in models})

    for name, output in study.full.system.outputs.items():
        if probes.kind_of(output).known_to_all:
            units = probes.units(name, output)
            grid = {headed(column, unit): curves(column) for column, unit in zip(output.columns, units, strict=True)}
            files.append(plots.history_grid(out / f"history_{name}.png", times, grid, title=scene.name))
    if (known := slider_columns(scene)) is not None:
        axis, position, speed = known
        files.append(plots.slider(out / SLIDER, times, curves(position), curves(speed), axis, scene.name))
    return files


def slider_columns(scene: Scene) -> tuple[str, str, str] | None:
    """Axis of the guide of a planar crank-slider, position along it of what slides, and a speed of rotation; None without them."""
    from ..systems.joints import Pin, Revolute, Slider
    from ..systems.probes import AngularVelocity, Position

    guide = next((joint for joint in scene.joints.values() if isinstance(joint, Slider)), None)
    if guide is None or scene.dimension != 2:
        return None
    axis = "xy"[int(np.argmax(np.abs(guide.direction[:2])))]
    hinges = [{joint.at, joint.to} for joint in scene.joints.values() if isinstance(joint, Pin | Revolute)]
    there = {guide.at}.union(*(hinge for hinge in hinges if guide.at in hinge))
    position = next(
        (
            name if output.component else f"{name}_{axis}"
            for name, output in scene.outputs.items()
            if isinstance(output, Position) and output.component in (axis, None) and output.at in there
        ),
        None,
    )
    speed = next((name for name, output in scene.outputs.items() if isinstance(output, AngularVelocity)), None)
    return None if position is None or speed is None else (axis, position, speed)


def drawn_outputs(motion: Trajectory) -> dict[str, np.ndarray]:
    """Outputs that every model knows."""
    from .. import dynamics
    from ..systems import probes

    wanted = {name: output for name, output in motion.system.outputs.items() if probes.kind_of(output).known_to_all}
    return dynamics.outputs(dataclasses.replace(motion, system=dataclasses.replace(motion.system, outputs=wanted)))


def inside(curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Curves without what lies farther from the first one's range than its span: a wrong model must not hide the others."""
    first = next(iter(curves.values()))
    low, high, span = first.min(), first.max(), float(np.ptp(first))
    return {name: np.where((values < low - span) | (values > high + span), np.nan, values) for name, values in curves.items()}


def readable(error: np.ndarray, size: float) -> np.ndarray:
    """Errors (s,) [m] of a motion of some size [m], without the start, where they are round-off, and what is wrong altogether."""
    return np.where((error > 10 * WRONG * size) | (error < 1e-4 * np.median(error)), np.nan, error)


def spectra(scene: Scene, study: Comparison, out: Path) -> list[Path]:
    """Norms of the full residual on the motion of a reduced model, and singular values of all bases."""
    from ..dynamics import GeneralizedAlpha
    from ..reduction import residual_norms
    from ..results import plots

    files, step = [], study["full"].step
    if (motion := study.motions.get("component")) is not None and study.full.system.full is not None:
        norms = residual_norms(study.full.system.full, motion, GeneralizedAlpha(step, getattr(scene.analysis, "rho_inf", 0.8)))
        curves = {"two-norm": norms.plain, "constraint forces": norms.constraint, "gappy norm": norms.gappy}
        files.append(plots.norms(out / "norms.png", norms.times, curves, "norm of the full model's residual"))
    found = {
        name if level == "component" else level: basis
        for level in ("system", "component")
        for name, basis in bases(study, level).items()
        if basis.singular_values.any()  # a rigid component may stay where it is
    }
    if found:
        kept = {name: basis.modes.shape[1] for name, basis in found.items()}
        values = {name: basis.singular_values[basis.singular_values > 0][: 3 * max(kept.values())] for name, basis in found.items()}
        eps = scene.reduction.tolerance if scene.reduction and scene.reduction.modes is None else None
        files.append(plots.singular_values(out / "singular_values.png", values, kept, eps))
    return files


def bases(study: Comparison, level: str) -> Mapping[str, Basis]:
    """The bases of a level, which all its models share; none where none of them ran."""
    return next((model.bases for name, model in study.models.items() if study[name].level == level), {})


def points(study: Comparison) -> list[Point]:
    """CPU time against position error, of all models that were run; failed ones have an infinite error."""
    from ..results.speed import Point

    return [
        Point(record.name, record.family, record.cpu_s if record.cpu_s > 0 else 1.0, finite(record.position_error))
        for record in study.records
    ]


def finite(error: float) -> float:
    return error if math.isfinite(error) else math.inf


def render(scene: Scene, study: Comparison, out: Path) -> list[Path]:
    """The full model at the scene's instants and moving, and a reduced one coloured by its distance from it."""
    from ..results import pictures
    from ..results.pictures import Look
    from . import picture
    from . import render as rendering

    files = rendering.draw(scene, study.full, out, rendering.FRAMES)
    name = next((name for name in PICTURED if name in study.motions), None)
    if name is None:
        return files
    wanted = picture.instants(scene, study.full)
    look = Look("error", title=f"{scene.name}, {name}: error")
    return [*files, pictures.render(picture.errors(study.full, study.motions[name], wanted), out / ERROR, wanted, look)]
