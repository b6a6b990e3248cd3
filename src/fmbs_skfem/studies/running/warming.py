"""Compile ahead what ordinary scenes need: some steps of the examples that travel with the package,
of every kind of model.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from ...core.compiling import compilation, jit
from ...core.errors import FmbsError, MissingFeature
from ...core.notices import Notice
from ...core.storage.records import dataclass
from ...scenes import examples
from .. import job as jobs
from .. import plans, reducing
from ..job import Job, Listener
from ..result import ReportTable, Result
from . import runs

STEPS = 2  #: of every scene that moves
SHORT = 0.02  #: duration of trainings [s]


def reduce(sample: str, job: Job) -> Result:
    """A training with a hyper-reduction."""
    scene = jobs.read_scene(job, plans=False)
    return reducing.reduce_scene(
        job, scene, None, plans.plan_with(scene, "component", None, None, None, sample)
    )


@dataclass(frozen=True)
class Warmed:
    """A kind of model, and what compiles all of it."""

    name: str
    scene: str
    study: Callable[[Job], Any] = runs.run_source
    duration: float | None = None  #: [s]; STEPS steps of a motion


KINDS = (
    Warmed("beams in the plane", "spin_up.yaml"),
    Warmed("beams in space", "double_pendulum.yaml"),
    Warmed("points with mass, dampers", "hanging_mass.yaml"),
    Warmed("drives and mechanisms", "four_bar.yaml"),
    Warmed("plates in the plane", "crank_slider_coarse.yaml"),
    Warmed("shells, statics", "plate.yaml"),
    Warmed("contact with friction", "rolling_hoop.yaml"),
    Warmed("contact of cables", "cable_over_drum.yaml"),
    Warmed("controllers, forces by expressions", "controlled_arm.yaml"),
    Warmed("buckling", "buckling_strip.yaml"),
    Warmed("reduced models, points", "double_pendulum.yaml", partial(reduce, "points"), SHORT),
    Warmed("reduced models, elements", "spin_up.yaml", partial(reduce, "elements"), SHORT),
)


def compile_ahead(job: Job) -> Result:
    """All kinds; what compiles is shown by name, and how long each kind took."""
    rows: list[tuple[str, int, float, str]] = []
    for k, kind in enumerate(KINDS):
        job.listener.progress("compiling " + kind.name, k / len(KINDS))
        names: list[str] = []
        begin = time.perf_counter()
        with compilation.heard_by(names.append), warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            outcome = attempt(kind)
        rows.append((kind.name, len(names), time.perf_counter() - begin, outcome))
        if names:
            job.listener.tell(f"{kind.name}: compiled {', '.join(names)} in {rows[-1][2]:.0f} s")
    total, seconds = sum(row[1] for row in rows), sum(row[2] for row in rows)
    folder = jit.cache_folder()
    text = (
        f"{total} functions compiled in {seconds:.0f} s; they are kept in {folder}"
        if folder
        else "nothing can be kept"
    )
    keys = ("kind", "functions", "wall_s", "outcome")
    report = {
        "status": "ok",
        "functions": total,
        "wall_s": seconds,
        "cache": folder,
        "kinds": [dict(zip(keys, row, strict=True)) for row in rows],
        "notices": job.notices,
    }
    return Result(
        about=text,
        report=report,
        lines=[ReportTable("Compiled", ("kind", "functions", "wall [s]", ""), rows), text],
    )


def attempt(kind: Warmed) -> str:
    """Compile one kind; how it went."""
    from ...scenes import build, read

    scene = read(examples.folder() / kind.scene)
    duration = kind.duration
    if scene.analysis.moves and duration is None:
        analysis = build.dynamic(scene)
        duration = STEPS * analysis.step
        scene = replace(scene, analysis=replace(analysis, every=1))
    try:
        quiet = Listener(tell=jobs.ignore, notice=jobs.ignore)
        with jobs.begin(scene, listener=quiet, duration=duration, plots=False) as job:
            kind.study(job)
    except MissingFeature as missing:
        return f"left out: {missing}"
    except FmbsError as error:
        return f"stopped: {error}"
    return "ok"
