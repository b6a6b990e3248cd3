"""Pages for the browser: the motion of a scene, of a saved reduced model, or of a folder of
results, as one file of HTML.
"""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core import extras
from ...core.errors import InputError, SolverError, say
from ...core.notices import notify
from ...core.storage import container
from ...dynamics import Trajectory
from ...families import parametric_model
from ...pages import content
from ...pages.live import LiveModel, PageParameter
from ...results import segments
from ...scenes.analyses.analysis import States
from .. import job as jobs
from .. import models, reports
from ..job import Job
from ..planning.planned import Planned
from ..result import Result
from . import runs, webpages
from .solving import RunTask, attempt

GENERATOR = b'name="generator" content="fmbs_skfem"'  #: in the head of every page
IN_TERMINALS = "www-browser", "links", "elinks", "lynx", "w3m"  #: browsers that run no scripts

#: kinds of what a scene is run with again, see `reports.RECORD`
PLAN = {
    **dict.fromkeys(("steps", "step", "cells", "local_error", "tolerance"), float),
    "wanted": str,
}

if TYPE_CHECKING:
    from ...scenes import Scene


def view(job: Job, html: Path | None, instants: int, opens: bool) -> Result:
    """The motion of a scene, a saved model or a folder as a page, shown to who is at the screen
    unless it is written to `html`.

    A file that exists is kept without --force, but for a page of this program at the usual place.
    """
    if job.out is not None and html is not None:
        raise InputError(
            say("--out", "no folder beside --html", f"{job.out}", "give one of the two")
        )
    folder = job.path.is_dir()
    usual = job.path / webpages.PAGE if folder else Path(f"{job.path.stem}.html")
    path = html or (job.out / webpages.PAGE if job.out else usual)
    if path.exists() and not job.force and (html is not None or not is_page(path)):
        raise InputError(
            say(
                f"--html {path}", "a new file", "one that exists", "choose another name, or --force"
            )
        )
    title = draw(job, path, instants)
    size = path.stat().st_size
    report = {
        "status": "ok",
        "source": job.path,
        "files": [path],
        "bytes": size,
        "notices": job.notices,
    }
    shown = opens and html is None and show(path)
    where = "is open in your browser" if shown else "opens in any browser"
    told = f"written: {path} ({size / 1e6:.2g} MB); it {where} and needs no network"
    return Result(about=f"{title}: {path}", report=report, lines=[told])


def is_page(path: Path) -> bool:
    """Whether a file is a page of this program."""
    with path.open("rb") as file:
        return GENERATOR in file.read(2000)


def show(path: Path) -> bool:
    """Open a page in the browser of the person at the screen; False where there is no terminal, no
    display or no browser.
    """
    display = sys.platform in ("darwin", "win32") or any(
        map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))
    )
    if sys.stdout is None or not sys.stdout.isatty() or not display:
        return False
    try:
        found = webbrowser.get()
        return getattr(found, "name", "") not in IN_TERMINALS and found.open(
            path.resolve().as_uri()
        )
    except (webbrowser.Error, OSError):
        return False


def draw(job: Job, path: Path, instants: int = content.INSTANTS) -> str:
    """The page of a scene, a saved model or a folder; returns its title."""
    scene, task, trajectory = motion(job)
    reports.make_folder(path.parent)
    words = webpages.about(trajectory, task.remarks)

    def errors(outputs: Mapping[str, np.ndarray]) -> Mapping[str, float]:
        bands, said = models.errors_of(job.path, outputs)
        words.extend([said] if said else [])
        return bands

    known = models.is_model(job)
    if known and not job.changes and models.parametric(job.path):  # sliders go through its ranges
        words += models.say_largest_error(parametric_model.load(job.path))
    film = webpages.film_of(task.title, trajectory, instants, errors=errors if known else None)
    film = replace(film, live=live_model(job, trajectory) if known else None)
    webpages.write(path, task.title, [film], *webpages.look(scene, trajectory), words, task.display)
    return task.title


def of_model(job: Job, name: str, folder: Path) -> Iterator[Callable[[], Path]]:
    """The page of a model that a study has saved in its folder; a warning, and nothing, where its
    motion fails.
    """
    page = folder / webpages.PAGE
    try:
        draw(Job(folder / name, listener=job.listener, notices=job.notices), page)
    except (InputError, SolverError) as problem:
        notify(f"there is no page of the model: {problem}")
        return
    yield lambda: page


def live_model(job: Job, trajectory: Trajectory) -> LiveModel | None:
    """A saved model as it runs in a page; None, with a notice, where it has no C or there is no
    compiler.
    """
    try:
        if not extras.there("symbols"):
            raise InputError(f"C is written of symbols, {extras.install('symbols')}")
        from ...exports import wasm
        from .. import exporting

        made, *_ = exporting.written(job, "model")
        module = wasm.module(made)
    except (InputError, SolverError) as problem:
        notify(f"the page shows the run alone: {problem}")
        return None
    parameters = tuple(PageParameter(name, *one) for name, one in made.parameters.items())
    inputs = tuple(PageParameter(name, *one) for name, one in exporting.input_ranges(made).items())
    columns = tuple(one.name for one in made.columns)
    return LiveModel(module, made.step, trajectory.system.size, columns, parameters, inputs)


def motion(job: Job) -> tuple[Scene | None, RunTask, Trajectory]:
    """The scene and the motion of the source of a job, stored or run now, with the task that says
    what it is of.
    """
    scene, task, trajectory = of_folder(job) if job.path.is_dir() else of_source(job)
    if trajectory is None:
        trajectory, error = attempt(job, task)
        if error is not None:
            raise error
    return scene, task, trajectory


def of_source(job: Job) -> tuple[Scene | None, RunTask, Trajectory | None]:
    """What a scene or a saved model is run for."""
    if models.is_model(job):
        models.require_own_accuracy(job)
        return None, models.task(job), None
    scene = jobs.read_scene(job, within=True)
    if isinstance(scene.analysis, States):
        raise InputError(
            say(
                "analysis.type",
                "a motion or an equilibrium",
                scene.analysis.word,
                "draw modes with fmbs render",
            )
        )
    return scene, runs.scene_task(job, scene), None


def of_folder(job: Job) -> tuple[Scene | None, RunTask, Trajectory | None]:
    """What the results in a folder are of, and their motion where it is stored there; else they are
    run again.

    A run that takes seconds stores no states. What is run again is what the report names:
    InputError where that has changed.
    """
    folder = job.path
    reports.verify_checksums(folder)
    if job.changes:
        raise InputError(
            say(
                "--set",
                "none beside a folder of results",
                ", ".join(job.changes),
                "name the scene instead",
            )
        )
    if segments.exists(folder):
        asked = segments.manifest(folder).job
        same = {name: asked[name] for name in ("changes", "allow_outside", "repair", "duration")}
        own = replace(job, path=Path(asked["scene"]), **same)
        own.plan = read_plan(folder / segments.FOLDER, asked["plan"]) if asked.get("plan") else None
        scene, task = planned(own)
        require_same(folder, asked["fingerprint"], task)
        rows = segments.read(folder).rows
        found = Trajectory(
            task.system,
            rows.times,
            rows.x,
            rows.v,
            rows.a,
            rows.multipliers,
            memory=rows.memory,
            work=rows.work,
        )
        return scene, task, replace(found, trace=rows.trace, kept=rows.kept)
    report = read_report(folder)
    values = {name: str(value) for name, value in report.get("parameters", {}).items()}
    if report.get("model"):
        path = Path(report["model"])
        container.require_file(path, "a saved reduced model", "name the model itself")
        own = replace(
            job,
            path=path,
            changes=values if models.parametric(path) else {},
            duration=report["end"],
        )
        task = models.task(own)
        require_same(folder, mark_of(report), task, mark_of(task.facts))
        return None, task, None
    if not report.get("file"):
        raise InputError(
            say(
                f"{folder}",
                "the results of a scene in a file",
                "those of another",
                "give the scene instead",
            )
        )
    own = replace(job, path=Path(report["file"]), changes=values)
    made = report.get("provenance", {}).get("scene") or {}
    analysis = made.get("analysis", {})
    own.duration = analysis.get("duration")
    plan = report.get("accuracy")
    own.plan = read_plan(folder / reports.REPORT, plan) if plan else None
    scene, task = planned(own)
    require_same(folder, str(report.get("fingerprint")), task)
    return scene, task, None


def read_plan(path: Path, found: Any) -> Planned:
    """What was found for an accuracy, of a file at a path."""
    reports.require_shape(path, found, PLAN, "accuracy")
    try:
        return Planned(**found)
    except TypeError as problem:
        raise reports.corrupt(path, "what was found for an accuracy", problem) from problem


def planned(own: Job) -> tuple[Scene, RunTask]:
    """A scene with what was found for its accuracy."""
    plan = own.plan
    scene = jobs.read_scene(own, plans=plan is None)
    own.plan = plan
    scene = plan.scene(scene) if plan else scene
    return scene, runs.scene_task(own, scene)


def read_report(folder: Path) -> dict[str, Any]:
    """The report of a run in a folder."""
    path = folder / reports.REPORT
    if not path.is_file():
        raise InputError(
            say(
                f"{folder}",
                f"a folder of fmbs run, with {reports.REPORT}",
                "none",
                "give the scene instead",
            )
        )
    found = reports.read_record(path)
    if found is None or found.get("end") is None:
        raise InputError(
            say(f"{path}", "the report of a motion", "another one", "give the scene instead")
        )
    return found


def mark_of(facts: Any) -> str:
    """The identity of a saved model that was run."""
    return str(facts.get("fingerprint")).partition(" ")[0]


def require_same(folder: Path, then: str, task: RunTask, now: str = "") -> None:
    """InputError where what a folder has results of is another one now."""
    if then != (now or task.facts["fingerprint"]):
        got = f"{task.title} with other values, files or times"
        raise InputError(
            say(
                f"{folder}",
                "the scene or model as it was run",
                got,
                "run it anew, or show the scene itself",
            )
        )
