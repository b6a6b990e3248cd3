"""What studies draw of bodies: configurations, animations, errors of reduced models.

An `Order` draws one file, by the process at hand (`rendering.painter`) or one of its own, so that
other work can go on beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...bodies.solids import solid_law
from ...core.errors import FmbsError
from ...core.notices import notify
from ...core.values.display import DisplayUnits
from ...results import colour_scales, motion, pictures, stress_errors
from ...results import frames as frames_
from ...results.pictures import PictureOptions
from .. import job as jobs

if TYPE_CHECKING:
    from ...dynamics import Trajectory
    from ...reduction.accuracy.comparison import Comparison
    from ...scenes import Scene
    from ...systems import System

Order = Callable[[], Path]

PICTURE, ANIMATION, ERROR = "picture.png", "animation.gif", "error.png"
FRAMES, INSTANTS = 60, 6  #: of the animation and of the picture
CONFIGURATIONS = 7  #: in a picture of a saved model
#: the reduced model that is pictured: the first of these that ran
PICTURED = (
    "component+ecsw",
    "component",
    "component+exact",
)


def scene(
    scene: Scene,
    trajectory: Trajectory,
    out: Path,
    count: int = FRAMES,
    names: tuple[str, str] = (PICTURE, ANIMATION),
    rate: float = 15.0,
    scale: float = 1.0,
) -> list[Order]:
    """The picture of a trajectory at the instants of its scene, and its animation with `count`
    frames (none for 0).

    Displacements are drawn `scale` times as large, which the title says.
    """
    shade = color(scene, trajectory.system)
    rows = frames_.spread(trajectory.times, max(count, INSTANTS))
    fields = (shade,) if shade else ()
    moving = motion.frames(trajectory, rows, fields)
    wanted = instants(scene, trajectory)
    chosen = (
        moving
        if wanted is None
        else motion.frames(trajectory, frames_.nearest(trajectory.times, wanted), fields)
    )
    clock = "s" if scene.analysis.clock else "load factor"
    heading = jobs.title(scene)
    if scale != 1.0:
        start = motion.frames(trajectory, np.array([0]), ())
        moving, chosen = (frames_.magnify(one, start, scale) for one in (moving, chosen))
        heading = f"{heading} (displacements x {scale:g})"
    label = label_of(trajectory, shade)
    options = PictureOptions(shade, label, title=heading, clock=clock, display=scene.display)
    found: list[Order] = [partial(pictures.render, chosen, out / names[0], wanted, options)]
    options = replace(options, size=(800, 600))
    return (
        [*found, partial(pictures.animate, moving, out / names[1], count, rate, options)]
        if count
        else found
    )


def error(scene: Scene, study: Comparison, path: Path) -> list[Order]:
    """A reduced model coloured by its distance from the full one; none where no such model ran."""
    name = next((name for name in PICTURED if name in study.motions), None)
    if name is None:
        return []
    wanted = instants(scene, study.full)
    options = PictureOptions(
        "error", title=f"{jobs.title(scene)}, {name}: error", display=scene.display
    )
    return [
        partial(
            pictures.render,
            motion.errors(study.full, study.motions[name], wanted),
            path,
            wanted,
            options,
        )
    ]


def model(title: str, display: DisplayUnits, trajectory: Trajectory, out: Path) -> list[Order]:
    """Configurations of a saved reduced model, coloured by stress or curvature."""
    chosen = motion.frames(trajectory, frames_.spread(trajectory.times, CONFIGURATIONS))
    options = PictureOptions(motion.usual_color(trajectory.system), title=title, display=display)
    return [partial(pictures.render, chosen, out / PICTURE, None, options)]


def last(trajectory: Trajectory, path: Path, clock: str) -> list[Path]:
    """The last state, bodies in their colours; nothing where no picture can be drawn. `clock` as in
    `PictureOptions`.
    """
    trajectory = trajectory.states
    end = len(trajectory.times) - 1
    try:
        frames = motion.frames(trajectory, np.array([end]), ())
        return [
            pictures.render(
                frames, path, options=PictureOptions(title="last good state", clock=clock)
            )
        ]
    except FmbsError as error:
        notify(f"no picture of the last good state: {error}")
        return []


def instants(scene: Scene, trajectory: Trajectory) -> list[float] | None:
    """The scene's instants that the trajectory reaches; None where there are none."""
    wanted = list(scene.pictures.instants) if scene.pictures else []
    end = float(np.max(trajectory.times))
    reached = [float(time) for time in wanted if time <= end * (1 + 1e-9)]
    if len(reached) < len(wanted):
        notify(
            f"pictures: {len(wanted) - len(reached)} instants after the end at {end:g} are left out"
        )
    return reached or None


def label_of(trajectory: Trajectory, shade: str | None) -> str:
    """Text beside the colour scale: of stresses with their mean error at the end, others as usual."""
    if shade not in ("von_mises", motion.RECOVERED) or not np.isfinite(trajectory.x[-1]).all():
        return ""
    part = stress_errors.of_picture(trajectory)
    return f"{colour_scales.LABELS[shade]}, error about {100.0 * part:.2g} %" if part > 0.0 else ""


def color(scene: Scene, system: System) -> str | None:
    """The field that colours the bodies of a full model, None where all are rigid."""
    if motion.usual_color(system) is None:
        return None
    wanted = scene.pictures.color if scene.pictures else "curvature"
    wanted = "curvature" if wanted == "error" else wanted
    # which solids do not have, and is what a scene has that says nothing
    solid = wanted == "curvature" and any(solid_law.is_solid(one.law) for one in system.skins)
    return "von_mises" if solid else wanted
