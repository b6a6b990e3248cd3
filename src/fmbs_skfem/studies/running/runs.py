"""Run a scene or a saved reduced model, with pictures or a VTK series where they are wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import InputError, say
from ...dynamics import Trajectory
from ...results import frames as frames_
from ...results import motion, series, stress_errors, temporal
from ...results.rendering import painter
from ...scenes import build
from ...scenes.analyses.analysis import Analysis, History, States
from .. import job as jobs
from .. import models, reports
from ..job import Job
from . import diagrams, judging, near_states, pictures, webpages
from .outcome import SERIES, Run
from .solving import RunTask, solve

if TYPE_CHECKING:
    from ...scenes import Scene


def run_source(
    job: Job, step: float | None = None, picture: bool = False, html: bool = False
) -> Run:
    """A scene or a saved model, as its file says; options that are not for it are refused."""
    limits = {"--checkpoint": job.checkpoint is not None, "--time-limit": isfinite(job.time_limit)}
    given = " and ".join(name for name, used in limits.items() if used)
    if models.is_model(job):
        if given:
            raise InputError(
                say(given, "a scene", f"{job.path}", "a reduced model runs anew in seconds")
            )
        models.require_own_accuracy(job)
        return models.run_saved(job, step, picture, html)
    if picture:
        raise InputError(
            say(
                "--picture",
                "a saved reduced model (.h5)",
                f"{job.path}",
                "draw a scene with fmbs render",
            )
        )
    if step is not None:
        raise InputError(
            say(
                "--step",
                "a saved reduced model (.h5)",
                f"{job.path}",
                "a scene has its own step: analysis.step",
            )
        )
    scene = jobs.read_scene(job, within=True)
    if job.check and (job.plan or not scene.analysis.moves):
        remedy = "an accuracy proves its errors itself" if job.plan else "leave the option out"
        expected = "a scene with a dynamic analysis and a step of its own"
        raise InputError(say("--check", expected, scene.analysis.word, remedy))
    if given and not scene.analysis.moves:
        raise InputError(
            say(
                given,
                "a scene with a dynamic analysis",
                scene.analysis.word,
                "leave the option out",
            )
        )
    if given and job.out is None:
        raise InputError(say(given, "a folder for the results", "none", "give one: out"))
    if not html:
        return solve_scene(job, scene)
    require_motion(scene, "draw modes with fmbs render")
    job.states = True
    return solve_scene(
        job, scene, webpages.drawing(jobs.title(scene), scene.display, scene), [webpages.PAGE]
    )


def require_motion(scene: Scene, remedy: str) -> None:
    """InputError where a page is wanted of something else than a motion or an equilibrium."""
    if isinstance(scene.analysis, States):
        raise InputError(say("--html", "a motion or an equilibrium", scene.analysis.word, remedy))


def render_scene(
    job: Job,
    frames: int,
    ending: str,
    scale: float,
    html: bool = False,
    diagram: bool = False,
    at: float | None = None,
) -> Run:
    """A scene, with its picture and its animation of `frames` instants (none for 0), `.gif` or
    `.mp4`, its page (`html`) and the `diagram` of its section forces `at` an instant.
    """
    scene = jobs.read_scene(job, within=True)
    diagrams.require(scene, diagram, at)
    draw: webpages.Draw | near_states.Draw | None
    if isinstance(scene.analysis, States):
        if html:
            require_motion(scene, "leave it out: modes get pictures and animations")
        if scale != 1.0:
            raise InputError(
                say(
                    "--scale",
                    "a motion or an equilibrium",
                    scene.analysis.word,
                    "shapes have a size of their own",
                )
            )
        names = [near_states.PICTURE]
        draw = partial(near_states.pictures, jobs.title(scene), frames, ending, scene.display)
    else:
        names = [pictures.PICTURE, *([Path(pictures.ANIMATION).stem + ending] if frames else [])]
        drawn = partial(
            pictures.scene, scene, count=frames, names=(names[0], names[-1]), scale=scale
        )
        draw = webpages.together(
            partial(diagrams.order, job, scene, at) if diagram else None,
            drawn,
            webpages.drawing(jobs.title(scene), scene.display, scene) if html else None,
        )
        names += [webpages.PAGE] if html else []
        names += diagrams.NAMES if diagram else []
    with painter.at_hand(job.out is not None):
        return solve_scene(job, scene, draw, names)


def export_scene(job: Job, frames: int) -> Run:
    """A scene, with its VTK series."""
    scene = jobs.read_scene(job, within=True)
    if isinstance(scene.analysis, States):
        return solve_scene(job, scene, near_states.write_series, [f"{near_states.SERIES}.pvd"])
    return solve_scene(
        job, scene, partial(write_series, frames), [f"{SERIES}.pvd", f"{SERIES}{temporal.SUFFIX}"]
    )


def write_series(frames: int, trajectory: Trajectory, out: Path) -> Sequence[Callable[[], Path]]:
    """The bodies at `frames` instants of a motion, one file an instant and one file of all."""
    rows = frames_.spread(trajectory.times, frames)
    one = out / f"{SERIES}{temporal.SUFFIX}"
    return [
        partial(series.write_each, motion.pieces(trajectory, rows), out, SERIES),
        partial(temporal.write, motion.pieces(trajectory, rows), one),
    ]


def solve_scene(
    job: Job,
    scene: Scene,
    draw: Callable[..., Sequence[Callable[[], Path]]] | None = None,
    names: Sequence[str] = (),
) -> Run:
    """What the analysis of a scene asks for; `draw` orders the files `names` of what is found, as
    `solving.Draw`.
    """
    if isinstance(scene.analysis, States):
        return near_states.solve_states(job, scene, scene.analysis, draw, names)
    return solve(job, reports.fingerprint(scene), partial(scene_task, job, scene), draw, names)


def scene_task(job: Job, scene: Scene) -> RunTask:
    """The full model of a scene, over time or at rest."""
    analysis = scene.analysis
    if not isinstance(analysis, History):
        known = " or ".join(
            sorted(word for word, kind in Analysis.known.items() if issubclass(kind, History))
        )
        raise InputError(
            say("analysis.type", known, analysis.word, f"use fmbs run for {analysis.word}")
        )
    raw = build.system(scene, allow_outside=job.allow_outside)
    analysis.require(scene, raw)
    reduced = build.chosen_form(scene, raw)
    facts = jobs.facts(scene, raw, reduced)
    words = f"{facts['scene']}: {facts['dofs']} dofs, {facts['constraints']} constraints ({facts['unknowns']} unknowns, "
    request = {
        "scene": str(job.path.absolute()),
        "changes": dict(job.changes),
        "duration": job.duration,
        "allow_outside": job.allow_outside,
        "repair": job.repair,
        "checkpoint": job.checkpoint,
        "plan": None if job.plan is None else asdict(job.plan),
        "fingerprint": facts["fingerprint"],
        "provenance": reports.plain(facts["provenance"]),
    }
    asked = job.states or job.checkpoint is not None or bool(stress_errors.recovered_at(reduced))
    solution = analysis.solve if asked else analysis.solve_for_outputs
    return RunTask(
        facts["scene"],
        facts,
        f"{words}{facts['multipliers']} multipliers)",
        reduced,
        partial(solution, reduced),
        partial(judging.balances, analysis.scheme),
        analysis.scheme,
        request if analysis.moves and job.scene is None else None,
        partial(build.dynamic(scene).halved().solve_for_outputs, reduced)
        if analysis.moves
        else None,
        analysis.label,
        "time [s]" if analysis.clock else "load factor",
    )
