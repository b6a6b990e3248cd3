"""Motions of studies as pages for the browser: what colours them, what stands below their title,
their outputs beside them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import __version__, dynamics
from ...core.storage import durable
from ...core.values.display import SI, DisplayUnits
from ...dynamics import Trajectory
from ...pages import content, writing
from ...pages.content import Film
from ...pages.writing import Page
from ...results import motion as motions
from ...results.plots import Panel
from .. import job as jobs
from . import panels, pictures

if TYPE_CHECKING:
    from ...reduction.accuracy.comparison import Comparison
    from ...scenes import Scene

PAGE = "page.html"
Draw = Callable[[Trajectory, Path], Sequence[Callable[[], Path]]]


def film_of(
    name: str,
    trajectory: Trajectory,
    instants: int = content.INSTANTS,
    full: Trajectory | None = None,
    errors: Callable[[Mapping[str, np.ndarray]], Mapping[str, float]] | None = None,
) -> Film:
    """A motion with the panels of its outputs, and bands of what is known of their `errors`, by
    column in their units.
    """
    outputs = dynamics.outputs(trajectory)
    several = outputs and len(trajectory.times) > 1
    bands = errors(outputs) if errors and several else {}
    shown: list[Panel] = (
        panels.arrange(trajectory.system.outputs, outputs, errors=bands) if several else []
    )
    return content.film(name, trajectory, shown, instants, full)


def look(scene: Scene | None, trajectory: Trajectory) -> tuple[str | None, str]:
    """The field that colours bodies, and the unit of times or `load factor`."""
    if scene is None:
        return motions.usual_color(trajectory.system), "s"
    return pictures.color(scene, trajectory.system), "s" if scene.analysis.clock else "load factor"


def about(trajectory: Trajectory, remarks: Sequence[object] = ()) -> list[str]:
    """Sentences below the title."""
    kind = "reduced model" if trajectory.system.components else "full model"
    words = f"{kind}, {trajectory.system.size} unknowns, {len(trajectory.times)} instants; fmbs_skfem {__version__}"
    return [words, *(one for one in remarks if isinstance(one, str))]


def write(
    path: Path,
    title: str,
    films: Sequence[Film],
    shade: str | None,
    clock: str,
    words: Sequence[str] = (),
    display: DisplayUnits = SI,
) -> Path:
    """The page of one or several motions."""
    return durable.write(
        path,
        writing.text(
            Page(title, *content.describe(title, films, shade, clock, words, display))
        ).encode(),
    )


def drawing(title: str, display: DisplayUnits, scene: Scene | None = None) -> Draw:
    """What orders the page of a motion beside the files of its run."""

    def order(trajectory: Trajectory, out: Path) -> Path:
        return write(
            out / PAGE,
            title,
            [film_of(title, trajectory)],
            *look(scene, trajectory),
            about(trajectory),
            display,
        )

    return lambda trajectory, out: [partial(order, trajectory, out)]


def compared(scene: Scene, study: Comparison, path: Path) -> Path:
    """The page of a full motion beside that of a reduced model, with the distance between the two."""
    title = jobs.title(scene)
    films = [film_of("full model", study.full)]
    name = next((name for name in pictures.PICTURED if name in study.motions), None)
    if name is not None:
        films.append(film_of(name, study.motions[name], full=study.full))
    return write(
        path,
        title,
        films,
        pictures.color(scene, study.full.system),
        "s",
        about(study.full),
        scene.display,
    )


def together(*draws: Draw | None) -> Draw | None:
    """What several of them order."""
    wanted = [draw for draw in draws if draw is not None]
    if len(wanted) < 2:
        return wanted[0] if wanted else None
    return lambda trajectory, out: [order for draw in wanted for order in draw(trajectory, out)]
