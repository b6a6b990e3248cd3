"""Diagrams of the section forces of a scene, as a picture and as a table.

diagram.png     N, Q, M, T along all cables and beams at one instant
diagram.csv     body, s [m], and the forces there [N, N m]; empty where a line has none of a kind
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import InputError, say
from ...core.storage import durable
from ...core.values.units import add_unit
from ...results import force_diagrams, frames, plots
from ...scenes import build
from ...scenes.analyses.analysis import States
from ...scenes.bodies import OfLine, PlacedPart
from ...systems.measures.section_diagrams import UNITS, LineForces, along_lines
from ...systems.measures.stresses import tell_coarse
from .. import job as jobs
from ..job import Job

if TYPE_CHECKING:
    from ...dynamics import Trajectory
    from ...scenes import Scene

PICTURE, TABLE = "diagram.png", "diagram.csv"
NAMES = (PICTURE, TABLE)


def require(scene: Scene, wanted: bool, at: float | None) -> None:
    """InputError for a diagram of modes, of a scene without lines, and for an instant without a
    diagram.
    """
    if at is not None and not wanted:
        raise InputError(say("--at", "the option --diagram beside it", "none", "add it"))
    expected = "a motion or an equilibrium of cables or beams"
    if wanted and isinstance(scene.analysis, States):
        raise InputError(say("--diagram", expected, scene.analysis.word, "leave the option out"))
    if wanted and not any(isinstance(one, OfLine | PlacedPart) for one in scene.bodies.values()):
        raise InputError(say("--diagram", expected, "other bodies", "leave the option out"))


def order(
    job: Job, scene: Scene, at: float | None, trajectory: Trajectory, out: Path
) -> Sequence[Callable[[], Path]]:
    """The diagrams of a motion at the stored instant nearest to `at`, by default its last one."""
    states = trajectory.states
    row = int(frames.choose(states.times, [at])[0]) if at is not None else len(states.times) - 1
    bodies = build.parts(scene, None, job.allow_outside)
    forces = along_lines(states.system, bodies, states.x[row])
    for part in bodies:
        if part.name in forces:
            tell_coarse("--diagram", part)
    instant = float(states.times[row])
    time = f"t = {scene.display.quantity(instant, 's')}"
    title = f"{jobs.title(scene)}, {time if scene.analysis.clock else f'load factor {instant:.6g}'}"

    def draw() -> Path:
        return plots.save(force_diagrams.figure(forces, title, scene.display), out / PICTURE)

    return [draw, partial(write_table, forces, out / TABLE)]


def write_table(forces: Mapping[str, LineForces], path: Path) -> Path:
    """The section forces of lines by name, a row for each place."""
    names = [name for name in UNITS if any(name in one.diagrams for one in forces.values())]
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["body", "s [m]", *(add_unit(name, UNITS[name]) for name in names)])
    for body, one in forces.items():
        known = [one.diagrams[name].values if name in one.diagrams else None for name in names]
        for k, arc in enumerate(one.arcs):
            cells = ["" if values is None else f"{values[k]:.9g}" for values in known]
            rows.writerow([body, f"{arc:.9g}", *cells])
    return durable.write(path, text.getvalue().encode())
