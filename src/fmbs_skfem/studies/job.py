"""One study while it runs: what it is asked for, who listens, what there is of it, and the folder
of its results.

with job.begin("scene.yaml", parameters={"E": 2e9}, out="results") as work:
    scene = job.read_scene(work)
    out = job.settle_folder(work, names, reports.fingerprint(scene))
"""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, field, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from ..core import consents
from ..core.compiling import compilation
from ..core.errors import Contradiction, FmbsError, InputError, MissingFeature, Warned, say
from ..core.notices import Labelled, Notice, Progress, Remark, notify
from ..core.storage import durable
from ..core.storage.records import dataclass
from . import notebooks, reports
from .result import Figures, describe_error

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..scenes import Scene
    from ..scenes.accuracy import Accuracy
    from ..systems import System
    from .options import JobOptions
    from .planning.planned import Planned

    Source = str | Path | Scene  #: a scene, or the file of a scene or of a saved reduced model


TYPICAL = 25  #: functions that a first model compiles
PLACES = 6  #: of contradictions, with which a message begins
MODELS = (".h5", ".hdf5")  #: endings of files of reduced models


def ignore(*_: object) -> None:
    """Nobody listens."""


def nothing(out: Path) -> Iterable[Path]:
    """No file."""
    return ()


@dataclass(frozen=True)
class Listener:
    """Who hears of a study while it runs.

    Warnings that nobody takes here are Python warnings of the class `Notice`; `strict` raises them.
    """

    #: what is being done, and the finished part of it, 0 to 1
    progress: Callable[[str, float], None] = ignore
    #: that it compiles, waits, or what a failed start is due to
    tell: Callable[[str], None] = compilation.log
    notice: Callable[[str], None] | None = None
    begin: Callable[[Job], None] = ignore
    strict: bool = False


@dataclass
class Job:
    """The options of one study, the warnings given so far, and what there is of its results."""

    path: Path = field(default_factory=Path)  #: scene or model file
    scene: Scene | None = None  #: given as such
    read: Scene | None = None  #: the scene, once it is read
    changes: Mapping[str, str] = field(default_factory=dict)  #: parameters replaced
    out: Path | None = None
    force: bool = False
    allow_outside: bool = False
    repair: bool = False
    listener: Listener = field(default_factory=Listener)
    notices: list[str] = field(default_factory=list)
    duration: float | None = None  #: instead of that of a scene or of a training [s]
    plots: bool = True  #: whether figures are drawn
    units: bool = False  #: whether the heads of outputs.csv have units
    #: wall time between two checkpoints of a motion, where it is given [s]
    checkpoint: float | None = None
    time_limit: float = inf  #: of the integration of a motion [s]
    check: bool = False  #: whether a motion is run again in half the steps
    states: bool = True  #: whether all states of a motion are kept, for `Run.trajectory`
    made: Path | None = None  #: the output folder, once it is there
    #: the folders that were made for it, the innermost first
    new: list[Path] = field(default_factory=list)
    trajectory: Trajectory | None = None  #: the motion, once there is one
    compiled: list[str] = field(default_factory=list)  #: functions whose compilation has begun
    #: errors that outputs may have, in place of those of the scene
    accuracy: str | float | None = None
    #: the accuracy of the scene that was read, its own or the one in its place
    wanted: Accuracy | None = None
    plan: Planned | None = None  #: what was found for it
    pilots_cpu_s: float = 0.0  #: CPU time of its pilot runs, with all they need [s]
    warned: str = ""  #: the first warning about a result, where warnings are to be errors

    def hear_compilation(self, name: str) -> None:
        """Say once that this model compiles, and show how far it is."""
        if text := compilation.news(name, self.compiled):
            self.listener.tell(text)
        self.compiled.append(name)
        self.listener.progress("compiling", min(len(self.compiled) / TYPICAL, 0.99))

    def progress(self, label: str) -> Progress:
        """A function that takes the finished part of the work `label`."""
        self.listener.progress(label, 0.0)
        return Labelled(self.listener.progress, label)


@contextlib.contextmanager
def begin(source: Source = "", **options: Unpack[JobOptions]) -> Iterator[Job]:
    """A study of a source, with one BLAS thread: small systems are faster, and times comparable."""
    import scipy.linalg  # noqa: F401  (limits reach only libraries that are loaded)
    from threadpoolctl import threadpool_limits

    from ..core.values import arguments

    given: dict[str, Any] = dict(options)
    consent = consents.given(given.pop("extensions", None))
    given["changes"] = {
        name: str(value).strip() for name, value in (given.pop("parameters", None) or {}).items()
    }
    given["out"] = None if given.get("out") is None else Path(given["out"])
    if "listener" in given:
        arguments.check_fields(given["listener"])
    if isinstance(source, str | Path):
        arguments.require("source", source, str | Path)
        job = Job(Path(source), **given)
        require_letters(job.path, job.out)
    else:
        from ..scenes import Scene

        arguments.require("source", source, str | Path | Scene)
        job = Job(source.path or Path("scene"), source, **given)
        if job.changes:
            raise InputError(
                say(
                    "parameters",
                    "the file of a scene",
                    "a scene",
                    "read it with them: scenes.read(path, changes)",
                )
            )
    job.listener.begin(job)
    listening = compilation.heard_by(job.hear_compilation)
    with (
        consent,
        threadpool_limits(limits=1, user_api="blas"),
        hear(job),
        listening,
        notebooks.progress() as shown,
    ):
        if shown is not None and "listener" not in given:
            job.listener = Listener(progress=shown, tell=ignore)
        try:
            with blamed_on_extensions():
                yield job
        except BaseException as error:
            find_place(job, error)
            for folder in job.new:
                with contextlib.suppress(OSError):  # what is in it stays
                    folder.rmdir()
            raise


def require_letters(*paths: Path | None) -> None:
    """InputError for files and folders in whose names there are bytes that are no letters of UTF-8:
    no report, page or saved model could name them.
    """
    for path in filter(None, paths):
        name = str(path.absolute())
        shown = name.encode(errors="backslashreplace").decode()
        if shown != name:
            raise InputError(
                say(shown, "a name and folders of letters in UTF-8", "other bytes", "rename them")
            )


def find_place(job: Job, error: BaseException) -> None:
    """Where the scene of a job has the joints and bodies that a contradiction names: files, lines
    and keys for its message.
    """
    if isinstance(error, Contradiction) and (scene := job.read) is not None:
        from ..scenes import where

        known = [(group, name) for group in ("joints", "bodies") for name in getattr(scene, group)]
        found = [
            keys for keys in known if any(f"{row}.".startswith(f"{keys[1]}.") for row in error.rows)
        ]
        error.place = ", ".join(where(scene, *keys) for keys in found[:PLACES])


@contextlib.contextmanager
def blamed_on_extensions() -> Iterator[None]:
    """An exception of a Python file of the user's own, or over what it returned, is an InputError
    with its file and line or class.

    Also its call of `sys.exit`, which would end a run without a word.
    """
    try:
        yield
    except (FmbsError, Notice, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        from ..scenes import extensions

        got = f"{type(error).__name__}: {error}"
        if place := extensions.place_of(error):
            raise InputError(
                say(
                    place, "a Python file that runs", got, "correct it; --debug shows the traceback"
                )
            ) from error
        if place := extensions.class_of(error):
            remedy = "correct what it returns (docs/extensions.md); where it is right, report the output of --debug"
            raise InputError(
                say(place, "values of the kind that its base asks for", got, remedy)
            ) from error
        raise


@contextlib.contextmanager
def hear(job: Job) -> Iterator[None]:
    """Warnings go to the listener and into the job, each once, and of those about one thing the
    first.
    """
    known = set[str]()
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if not issubclass(category, Notice):
                usual(message, category, *place, **more)
                return
            if job.listener.strict and not issubclass(category, Remark):
                job.warned = job.warned or str(message)
            about = (message.about if isinstance(message, Notice) else "") or str(message)
            if about not in known and str(message) not in job.notices:
                known.add(about)
                job.notices.append(str(message))
                if job.listener.notice is None:
                    usual(message, category, *place, **more)
                else:
                    job.listener.notice(str(message))

        warnings.simplefilter("error" if job.listener.strict else "always", Notice)
        warnings.simplefilter("always", Remark)
        warnings.showwarning = show
        yield


@contextlib.contextmanager
def keep_results() -> Iterator[None]:
    """Warnings about a result that there is already are shown, also where they are to be errors;
    see `refused`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("always", Notice)
        yield


def refused(job: Job, warning: str = "") -> Warned | None:
    """The error of a `warning`, or of the first one about a result, where warnings are to be
    errors; None without one.
    """
    found = warning or job.warned
    return Warned(f"{found} (an error by --strict)") if found else None


def read_scene(job: Job, plans: bool = True, within: bool = False) -> Scene:
    """The scene of a job with its parameters and the duration of a dynamic analysis replaced.

    What its accuracy leaves open is found by pilot runs; without `plans` it has some step and the
    cells of its meshes. Where states may lie `within` steps, their times do not count for the step.
    """
    from .. import scenes
    from ..scenes import build
    from ..scenes.analyses.analysis import History

    scene = job.scene or scenes.read(job.path, job.changes, job.repair)
    duration = job.duration
    job.read = scene
    build.check_files(scene, job.allow_outside)
    for option, value, fits, wanted in (
        ("--duration", duration, scene.analysis.moves, "a dynamic analysis"),
        (
            "--accuracy",
            job.accuracy,
            isinstance(scene.analysis, History),
            "a dynamic or static analysis",
        ),
    ):
        if value is not None and not fits:
            raise InputError(
                say(option, f"a scene with {wanted}", scene.analysis.word, "leave the option out")
            )
    if duration is not None:
        scene = with_duration(scene, duration)
    if job.accuracy is not None:
        scene = with_accuracy(scene, job.accuracy)
    scene = fit_step(scene) if scene.analysis.moves else scene
    return plan(job, scene, plans, within) if isinstance(scene.analysis, History) else scene


def with_duration(scene: Scene, duration: float) -> Scene:
    """The scene over a time [s] of its own."""
    from ..scenes import build, times

    analysis = build.dynamic(scene)
    step = analysis.counted().step
    if not step <= duration <= times.STEPS * step:
        raise InputError(
            say("--duration", f"1 to {times.STEPS} steps of {step:g} s", f"{duration:g} s")
        )
    return replace(scene, analysis=replace(analysis, duration=duration))


def with_accuracy(scene: Scene, text: str | float) -> Scene:
    """The scene with an accuracy of its own: `1e-3`, `1 mm`, or errors by output,
    `C=1 mm, motor=2 %`.
    """
    from ..core.values.fields import Context
    from ..core.values.problems import Problem
    from ..scenes import accuracy, build

    value = errors_by_output(text) if isinstance(text, str) and "=" in text else text
    try:
        analysis: Any = build.history(scene)
        found = replace(
            scene, analysis=replace(analysis, accuracy=accuracy.accuracy(value, Context()))
        )
        for _, problem in found.analysis.problems_in(found):
            raise Problem(problem.expected, problem.got, problem.remedy)
    except Problem as problem:
        raise InputError(
            say("--accuracy", problem.expected, problem.got, problem.remedy)
        ) from problem
    return found


def errors_by_output(text: str) -> dict[str, str]:
    """The errors in `C=1 mm, motor=2 %`, by output; InputError for another form, and for an output
    that is there twice.
    """
    found: dict[str, str] = {}
    for part in text.split(","):
        name, equals, error = map(str.strip, part.partition("="))
        if not (name and equals):
            raise InputError(
                say(
                    "--accuracy",
                    "errors by output, C=1 mm, motor=2 %",
                    f"'{part.strip()}' among them",
                )
            )
        if name in found:
            raise InputError(
                say("--accuracy", "every output once", f"'{name}' twice", "delete one")
            )
        found[name] = error
    return found


def plan(job: Job, scene: Scene, plans: bool, within: bool = False) -> Scene:
    """The scene with what its accuracy leaves open found, or with some step."""
    from ..scenes import build, where

    analysis = build.history(scene)
    job.wanted = analysis.accuracy
    if analysis.accuracy is None and not analysis.open:
        return scene
    if analysis.accuracy is None and plans:
        expected, remedy = (
            "an accuracy, for which the step is found",
            "add accuracy: 1e-3, or --accuracy 1e-3",
        )
        raise InputError(
            say(f"{where(scene, 'analysis')}: accuracy", expected, "none beside step: auto", remedy)
        )
    if not plans:
        return scene.chosen(None, None)
    from .planning import planned

    begun = time.process_time()
    job.plan = planned.find(
        scene, job.allow_outside, job.progress("choosing step and mesh"), within
    )
    job.pilots_cpu_s = time.process_time() - begun
    return job.plan.scene(scene)


def planned_report(job: Job) -> dict[str, Any]:
    """What was found for an accuracy, and the CPU time that it took [s]; nothing without one."""
    if job.plan is None:
        return {}
    return {"accuracy": asdict(job.plan), "pilots_cpu_s": job.pilots_cpu_s}


def planned_lines(job: Job) -> list[str]:
    """The same in words."""
    if job.plan is None:
        return []
    return [f"{job.plan.words}; the pilot runs took {job.pilots_cpu_s:.2g} s of CPU"]


def fit_step(scene: Scene) -> Scene:
    """The scene with a step that divides its duration, with a warning where that is a smaller one
    than the scene's.

    Scenes with parameters that have a range keep theirs, which may depend on them, and so do those
    whose other times it divides.
    """
    from ..scenes import build, times

    if not scene.analysis.moves or scene.ranges:
        return scene
    analysis = build.dynamic(scene)
    if analysis.open:
        return scene
    spans = [
        every
        for every in (analysis.every, scene.reduction and scene.reduction.snapshots)
        if isinstance(every, tuple)
    ]
    counted = [
        time
        for parts in spans
        for span in parts
        for time in (span.every, span.until)
        if time is not None
    ]
    if scene.reduction is not None and isinstance(scene.reduction.snapshots, float):
        counted.append(scene.reduction.snapshots)
    step = times.fit(analysis.step, analysis.duration, counted)
    if step == analysis.step:
        return scene
    asked = f"{analysis.step:.6g} s"
    taken = f"{step:.6g} s"
    notify(
        f"the duration of {analysis.duration:.6g} s is no whole number of steps of {asked}: steps of {taken} are taken"
    )
    return replace(scene, analysis=replace(analysis, step=step))


def title(scene: Scene) -> str:
    """The name of a scene, or that of its file; "scene" for one without both."""
    return scene.name or (scene.path.stem if scene.path else "scene")


def facts(scene: Scene, raw: System, reduced: System) -> dict[str, Any]:
    """What every report of a scene begins with: which one it is, its sizes with all multipliers and
    as it is solved, provenance.
    """
    return {
        "scene": title(scene),
        "file": scene.path,
        "parameters": dict(scene.parameters),
        "parameter_units": dict(scene.parameter_units),
        "analysis": scene.analysis.word,
        "dofs": raw.size,
        "constraints": len(raw.constraints.names),
        "unknowns": reduced.size,
        "multipliers": len(reduced.constraints.names),
        "fingerprint": reports.fingerprint(scene),
        "provenance": reports.provenance(scene),
        **scene.display.note,
    }


def settle_file(job: Job, name: str) -> Path | None:
    """The file to write: `name` in a folder, or the output itself where it ends in .h5; one that
    exists is kept without --force.
    """
    if job.out is None:
        return None
    path = job.out if job.out.suffix in MODELS else job.out / name
    if path.exists() and not job.force:
        raise InputError(
            say(f"--out {path}", "a new file", "one that exists", "choose another name, or --force")
        )
    make_folder(job, path.parent)
    return path


def make_folder(job: Job, out: Path) -> None:
    """The output folder: made before anything is solved, and gone again where the study is refused
    and has written nothing.
    """
    job.new = [folder for folder in (out, *out.parents) if not folder.exists()]
    job.made = reports.make_folder(out)


def settle_folder(
    job: Job, names: Iterable[str], mark: str, record: str = reports.REPORT
) -> Path | None:
    """The output folder, made; `names` are the files to be written, `mark` the fingerprint of this
    run; None without --out.

    Files of another run (whose JSON file `record` has another `fingerprint`, or none) are kept
    unless --force is given.
    """
    out = job.out
    if out is None:
        return None
    taken = [name for name in names if (out / name).exists()]
    if taken and not job.force and reports.read_fingerprint(out / record) != mark:
        got = f"another run's {', '.join(taken)}"
        raise InputError(
            say(
                f"--out {out}",
                "an empty folder or one of the same run",
                got,
                "choose another folder, or --force",
            )
        )
    make_folder(job, out)
    return out


def deliver(
    job: Job,
    report: dict[str, Any],
    write: Callable[[Path], Iterable[Path]] = nothing,
    figures: Figures | None = None,
    orders: Callable[[Path], Iterable[Callable[[], Path]]] | None = None,
    record: str = reports.REPORT,
) -> MissingFeature | None:
    """`write` the files of a study into its folder, its figures, its report, and what `orders`
    draw; nothing without a folder.

    What cannot be drawn is an error, beside which the report is complete.
    """
    from ..results import segments

    out = job.made
    missing = None
    if out is None:
        return None
    with durable.room(out, segments.remedy(out)):
        report["files"] = [
            *write(out),
            out / record,
            *(figures.save(out) if figures and job.plots else []),
        ]
        reports.write_report(out, report, record)
        if orders is not None:
            try:
                for order in orders(out):
                    report["files"].append(order())
            except MissingFeature as problem:
                missing = problem
                report |= describe_error(problem) if report["status"] == "ok" else {}
            reports.write_report(out, report, record)
    return missing
