"""Reduced parts: train one body, alone or in a scene, save it, say what it is, and hold it against
the full body in a scene.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..bodies.body import Body, reference_at
from ..core.algebra.rotations import nearest
from ..core.errors import FmbsError, InputError, closest, listed, say
from ..core.notices import Notice, notify
from ..core.storage.records import dataclass
from ..dynamics import Newton, Trajectory, integrate
from ..parts import bodies as parts
from ..parts import departures, excitation, rescaling, static_states
from ..parts import files as part_files
from ..parts.excitation import Excitation
from ..parts.files import Part
from ..reduction import snapshots
from ..reduction.accuracy import error_budget, output_errors
from ..reduction.hyper.hyper_reduction import NONE
from ..reduction.hyper.sampling import Points
from ..reduction.plan import Plan
from ..scenes import build
from ..shapes.solids.solid import Solid
from ..systems import finer_systems
from . import job as jobs
from . import kinds, models, plans, reports
from .job import Job
from .result import ReportTable, Result, conclude, describe_error, format_value
from .running import compiling

if TYPE_CHECKING:
    from ..scenes import Scene

KEPT = 600  #: states of a run of a scene that a part is trained on, at least where it has as many steps
SHARP = Newton(tolerance=1e-12)
MEETS = 1e-6  #: distance of places of a part from those of its full body, over the size of the body
NOTHING = 1e-12  #: a coordinate of a place that is round-off, over the largest one
ALIKE = 1e-2  #: the same of second moments, which the mesh of a curved body changes a little
#: rows of sections that are numbers of a body, by what they are
NUMBERS = {
    "nu": "Poisson's ratio",
    "A": "membrane stiffness",
    "B": "bending stiffness",
    "EA": "EA",
    "EI": "EI",
    "mass": "mass",
}


@dataclass(frozen=True, repr=False, kw_only=True)
class PartResult(Result):
    """A part, trained or read."""

    part: Part


def train(
    job: Job,
    scene: Scene,
    body: str,
    alone: Excitation | None,
    tolerance: float | None,
    modes: int | None,
    hyper: float | None,
    before: Path | None = None,
    small_strains: bool = False,
) -> PartResult:
    """The part of a body of a scene, moved alone by an excitation or by the motion of the scene,
    saved in a file.

    With the part in a file of `before` its training goes on. eps = `tolerance` and eta = `hyper` (0
    for all points) are found for the accuracy of the job where they are None.
    """
    path = jobs.settle_file(job, f"{body}.part.h5")
    part, others = body_of(job, scene, body)
    known = None if before is None else part_files.resume(before)
    if known is not None:
        part_files.recall(known, part)
    compiling.announce(job)
    begun = time.process_time()
    told = None
    if alone is None:
        states = moved(job, scene, others, body)
    else:
        run = static_states.find if isinstance(part.space, Solid) else excitation.run
        states, told = run(part, alone, job.progress(f"{body} alone"))
    spent = time.process_time() - begun
    origin = reports.provenance(scene)
    kept = reports.provenance_to_keep(origin, scene)
    record = {
        "alone": None if told is None else reports.plain(asdict(told)),
        "motions_s": spent,
        "scene": jobs.title(scene),
    }
    if known is not None:
        record["before"] = {
            key: known.notes.get(key) for key in ("alone", "scene", "states", "strains", "before")
        }

    def make(plan: Plan) -> Part:
        """The part to the tolerances of a plan."""
        more: dict[str, Any] = {"body": body, **record, "provenance": kept}
        more["small_strains"] = small_strains
        return part_files.train(
            part, states, plan.tolerance, modes, plan.hyper.tolerance, known, **more
        )

    eta = part_files.ETA if hyper is None else hyper
    plan = Plan(
        {}, part_files.USUAL if tolerance is None else tolerance, hyper=Points(eta) if eta else NONE
    )
    reached = None
    if job.wanted is not None:
        free = tolerance is None and modes is None, hyper is None
        plan, reached = plan_for(job, scene, others, body, make, plan, free)
    found = make(plan)
    view: list[ReportTable | str] = [described(f"Part {body}", found)]
    view += (
        []
        if reached is None
        else [f"{reached:.2g} of the accuracy {job.wanted} in the outputs of {jobs.title(scene)}"]
    )
    if path is not None:
        part_files.save(found, path)
        view.append(f"written: {path}")
    promise = (
        {} if reached is None else {"accuracy": str(job.wanted), "error_over_accuracy": reached}
    )
    report = {
        "status": "ok",
        "file": path,
        **facts(found),
        **promise,
        "provenance": origin,
        "notices": job.notices,
    }
    about = (
        f"{body}: {found.notes['functions']} shape functions for {found.notes['functions_full']}"
    )
    return PartResult(about=about, report=report, lines=view, part=found)


def plan_for(
    job: Job,
    scene: Scene,
    bodies: list[Body],
    name: str,
    make: Callable[[Plan], Part],
    plan: Plan,
    free: tuple[bool, bool],
) -> tuple[Plan, float]:
    """The coarsest plan with whose part the outputs of a scene keep their share of the accuracy,
    and their error over the accuracy.

    eps and eta of the `plan` are found where they are `free`; a warning is shown where none keeps
    it.
    """
    accuracy = job.wanted
    known = dict[tuple[float, float | None], float]()
    assert accuracy is not None
    full = job.trajectory or solve(job, scene, bodies, "full model")
    whole = next(one for one in bodies if one.name == name)
    columns = output_errors.columns(full)

    def error(plan: Plan) -> float:
        """The largest error over what is wanted; what is told of a trial would be of a part that
        nobody gets.
        """
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            try:
                own = at_place(make(plan).body, whole)
                motion = solve(
                    job,
                    scene,
                    [own if one.name == name else one for one in bodies],
                    "with the part",
                    checked=False,
                )
            except FmbsError:
                return math.inf
        return max(
            accuracy.parts(output_errors.compare(full, motion, columns)).values(), default=0.0
        )

    def remembered(plan: Plan) -> float:
        key = plan.tolerance, plan.hyper.tolerance
        known[key] = known[key] if key in known else error(plan)
        return known[key]

    found = error_budget.coarsest(plan, remembered, plans.SHARE, *free)
    if (reached := remembered(found)) > plans.SHARE:
        text = f"with the part the outputs err by {reached:.2g} times the accuracy {accuracy}, where {plans.SHARE:g} of it is aimed at"
        notify(
            f"{text}; train it on such motions, or leave out --tolerance, --modes and --hyper to have them found"
        )
    return found, reached


def body_of(job: Job, scene: Scene, name: str, option: str = "--body") -> tuple[Body, list[Body]]:
    """A full elastic body of a scene, which an option names, and all its bodies."""
    if name not in scene.bodies:
        expected = f"one of the bodies {listed(scene.bodies, name)}"
        raise InputError(say(option, expected, f"'{name}'") + closest(name, scene.bodies))
    found = build.parts(scene, allow_outside=job.allow_outside)
    part = next(one for one in found if one.name == name)
    if part.cells is None or part.shapes is not None:
        elastic = [one.name for one in found if one.cells is not None and one.shapes is None]
        kind = scene.bodies[name].word
        remedy = (
            "give the scene that has the full body in place of the part"
            if part.shapes is not None
            else ""
        )
        raise InputError(
            say(
                option,
                f"a full elastic body ({', '.join(elastic) or 'none here'})",
                f"'{name}', a {kind}",
                remedy,
            )
        )
    return part, found


def solve(
    job: Job, scene: Scene, bodies: list[Body], label: str, kept: int = KEPT, checked: bool = True
) -> Trajectory:
    """The motion of a scene with its bodies made, sharp enough for training; errors of parts in it
    are found where `checked`.
    """
    analysis = build.dynamic(scene)
    system = build.of_parts(scene, bodies, pictures=False)
    every = max(1, round(analysis.duration / analysis.step / kept))
    form = build.chosen_form(scene, system)
    form = form if checked else finer_systems.unchecked(form)
    return integrate(form, analysis.scheme, analysis.duration, SHARP, every, job.progress(label))


def moved(job: Job, scene: Scene, bodies: list[Body], name: str) -> np.ndarray:
    """States (s, b, c) of one body in the motion of a scene."""
    motion = job.trajectory = solve(job, scene, bodies, "full model")
    first, last = next(
        (first, last) for one, first, last in motion.system.coordinates if one == name
    )
    return snapshots(motion).q[:, first:last].reshape(len(motion.times), -1, scene.dimension)


def facts(part: Part) -> dict[str, Any]:
    """What a part is, without its provenance."""
    numbers = {name: value.number for name, value in part.body.values.items()}
    notes = {key: value for key, value in part.notes.items() if key != "provenance"}
    return {
        **notes,
        "values": numbers,
        "places": sorted(places(part.body)),
        "stands_at": stands_at(part.body),
    }


def places(body: Body) -> list[str]:
    """Names of the places of a body."""
    return [*body.frames, *body.places]


def stands_at(body: Body) -> dict[str, list[float]]:
    """Positions [m] of the places of a body in the reference, by their names."""
    found = {f"{name} [m]": reference_at(body, name) for name in places(body)}
    size = max((float(np.abs(place).max()) for place in found.values()), default=0.0)
    return {
        name: np.where(np.abs(place) < NOTHING * size, 0.0, place).tolist()
        for name, place in found.items()
    }


def described(title: str, part: Part) -> ReportTable:
    """A part as a table."""
    flat = models.flatten(
        {key: value for key, value in facts(part).items() if not isinstance(value, list)}
    )
    return ReportTable(title, ("", "value"), [(key, format_value(value)) for key, value in flat])


def describe(job: Job) -> PartResult:
    """What the part in a file is: sizes, training, strains of its training, places; in a folder
    also as info.json.
    """
    found = part_files.load(job.path)
    report = models.write_info(job, {"part": job.path, "dimension": found.body.dim, **facts(found)})
    return PartResult(
        about=f"{job.path}: a part",
        report=report,
        lines=[described(str(job.path), found)],
        part=found,
    )


def check(job: Job, scene: Scene, found: Part, path: Path, body: str) -> PartResult:
    """A part of a file in place of the full body of a scene: errors of the outputs, and CPU times
    of both motions.
    """
    full, bodies = body_of(job, scene, body)
    if not scene.outputs:
        remedy = (
            f"add one, such as `tip: {{type: position, at: {body}.{places(full)[-1]}}}`"
            if places(full)
            else ""
        )
        raise InputError(say(jobs.title(scene), "outputs, whose errors are found", "none", remedy))
    if found.body.dim != full.dim:
        raise InputError(say(f"{path}", f"a part of dimension {full.dim}", found.body.dim))
    own = at_place(found.body, full)
    compiling.announce(job)
    with jobs.keep_results():
        wanted = solve(job, scene, bodies, "full model")
        reduced = solve(
            job, scene, [own if one.name == body else one for one in bodies], "with the part"
        )
    error = jobs.refused(job)
    beyond = departures.find(reduced)
    errors = {column: asdict(one) for column, one in output_errors.compare(wanted, reduced).items()}
    cpu = {"cpu_s_full": wanted.statistics.cpu_s, "cpu_s": reduced.statistics.cpu_s}
    sizes = {key: found.notes[key] for key in ("functions", "points")}
    report = {
        **describe_error(error),
        "part": path,
        "body": body,
        **sizes,
        **cpu,
        "output_errors": errors,
    }
    report |= {"beyond_training": [asdict(one) for one in beyond], "notices": job.notices}
    rows = [(key, format_value(value)) for key, value in (sizes | cpu).items()]
    times = ReportTable(f"'{body}' in {jobs.title(scene)}", ("", "value"), rows)
    about = f"{path} in {jobs.title(scene)}"
    lines = [times, *kinds.views(report, scene.display)]
    return conclude(PartResult(about=about, report=report, lines=lines, part=found, error=error))


def at_place(part: Body, full: Body) -> Body:
    """The part where a full body stands, of its numbers: the rigid motion that brings the places of
    both together.
    """
    names = [name for name in places(full) if name in places(part)]
    missing = sorted(set(places(full)) - set(names))
    if missing or not names:
        wanted = f"a part with the places {', '.join(missing or names)} of the body it stands for"
        got = f"one with {', '.join(places(part)) or 'none'}"
        raise InputError(
            say(f"part for '{full.name}'", wanted, got, "name them alike in both scenes")
        )
    there, here = (points_of(body, names) for body in (part, full))
    start = there.mean(axis=0)
    end = here.mean(axis=0)
    size = float(np.sqrt(np.trace(second_moment(full))))
    if apart(there - start, here - end) > MEETS * size:
        image = np.append(np.ones(there.shape[1] - 1), -1.0) * (there - start)
        mirrored = apart(image, here - end) <= MEETS * size
        got = "those of its mirror image, which is another part" if mirrored else "others"
        raise InputError(
            say(
                f"part for '{full.name}'",
                "places as far apart as those of the full body",
                got,
                "train it anew",
            )
        )
    R = rotation_onto(there - start, here - end)
    own = parts.placed(part, full.name, end - R @ start, R)
    if np.abs(second_moment(own) - second_moment(full)).max() > ALIKE * size**2:
        got = f"{', '.join(names)} on one line, about which it may be rotated"
        remedy = "name a third place off that line, and train it anew"
        raise InputError(
            say(
                f"part for '{full.name}'",
                "places that determine the orientation of the body",
                got,
                remedy,
            )
        )
    own = rescaling.rescale(
        own, {name: value.number for name, value in full.values.items() if name in own.values}
    )
    if others := other_numbers(own, full):
        remedy = "train it anew with the material and section of the full body"
        raise InputError(
            say(
                f"part for '{full.name}'", "the numbers of the full body", ", ".join(others), remedy
            )
        )
    return own


def other_numbers(part: Body, full: Body) -> list[str]:
    """Numbers of a part that are not those of its full body: of its section, on the mean of its
    cells, and its mass.
    """
    assert part.cells is not None
    assert full.cells is not None
    a = part.cells
    b = full.cells
    if a.law is not b.law:
        return [f"the law {a.law.name} in place of {b.law.name}"]
    near = MEETS if a.section.shape[2] == b.section.shape[2] else ALIKE
    rows = {
        row: (x.mean(), y.mean())
        for row, x, y in zip(a.law.section, a.section, parts.one_point(b).section, strict=True)
    }
    rows["mass"] = part.total_mass, full.total_mass
    known = ((name, *rows[row]) for row, name in NUMBERS.items() if row in rows)
    return [
        f"{name} {x:.4g} in place of {y:.4g}" for name, x, y in known if abs(x - y) > near * abs(y)
    ]


def rotation_onto(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation R (c, c) that takes points a to b (x, c) about their means; the smallest one
    where they are on a line.

        b = R a
    """
    U, s, V = np.linalg.svd(a.T @ b)
    if a.shape[1] == 3 and s[1] <= MEETS**2 * s[0]:
        from scipy.spatial.transform import Rotation

        return (
            np.asarray(Rotation.align_vectors(V[:1], U[:, :1].T)[0].as_matrix())
            if s[0] > 0.0
            else np.eye(3)
        )
    return nearest(b.T @ a)


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """How far points (x, c) about their means are from others at most, after the rotation onto
    them.
    """
    return float(np.abs(a @ rotation_onto(a, b).T - b).max())


def second_moment(body: Body) -> np.ndarray:
    """Second moment (c, c) [m2] of the reference about its centre of mass c.

        int rho (r - c)(r - c)^T dV / m

    for any density.
    """
    moved = body.mass @ body.constant
    total = float(body.constant @ moved)
    x = body.reference - np.outer(body.constant, moved @ body.reference / total)
    return np.asarray(x.T @ (body.mass @ x)) / total


def points_of(body: Body, names: list[str]) -> np.ndarray:
    """Reference positions (x, c) of places."""
    return np.array([reference_at(body, name) for name in names])
