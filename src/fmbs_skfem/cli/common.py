"""What all commands share: options, notices, errors, exit codes, the scene that is read.

    @common.command("check")
    @click.option(...)
    def command(session: Session, ...) -> Result        Result -> tables, or with --json one object on stdout

stdout is data; notices, progress and messages go to stderr. Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

import contextlib
import functools
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import __version__
from ..core import durable
from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import Notice, Remark, notify
from . import reports, screen

if TYPE_CHECKING:
    from ..dynamics import Trajectory
    from ..scenes import Scene

INTERRUPTED = 130
INTERNAL = 1
BAD_INPUT = InputError.exit_code
LIMIT = 6
REASONS = {
    3: "bad input",
    4: "no reduced model",
    5: "failed members",
    LIMIT: "limit reached",
    7: "missing feature",
    8: "corrupt file",
    INTERRUPTED: "interrupted",
    143: "terminated",
}
SHARED = ("out", "json", "force", "allow_outside", "repair", "strict", "debug")  #: options that many commands have


@dataclass
class Work:
    """What a command has so far, kept for the case that it ends in an internal error."""

    out: Path | None = None  #: its output folder
    trajectory: Trajectory | None = None  #: the motion that it has computed


@dataclass(frozen=True)
class Session:
    """The shared options of one call, the notices given so far, and what there is of its results."""

    path: Path = field(default_factory=Path)  #: scene or model file
    out: Path | None = None
    json: bool = False
    changes: Mapping[str, str] = field(default_factory=dict)  #: parameters replaced by --set
    force: bool = False
    allow_outside: bool = False
    repair: bool = False
    strict: bool = False
    debug: bool = False
    notices: list[str] = field(default_factory=list)
    work: Work = field(default_factory=Work)


@dataclass(frozen=True)
class Result:
    """What a command found: one JSON object, the same as rich renderables or texts, and where it failed what is wrong."""

    report: dict[str, Any]
    view: Sequence[Any] = ()
    error: FmbsError | None = None


Body = Callable[..., Result]


def command(name: str, scene: bool = True) -> Callable[[Body], click.Command]:
    """Make a function `(session, **own options) -> Result` the command `name`; `scene`: it takes a SCENE argument."""

    def decorate(function: Body) -> click.Command:
        @functools.wraps(function)
        def guarded(**values: Any) -> None:
            session = Session(
                path=values.pop("path", Path()),
                changes=dict(values.pop("changes", ())),
                **{key: values.pop(key) for key in SHARED if key in values},
            )
            click.get_current_context().exit(perform(function, session, values))

        wrapped: Callable[..., Any] = guarded
        for option in reversed((*SCENE_OPTIONS, *OPTIONS) if scene else OPTIONS):
            wrapped = option(wrapped)
        return click.command(name)(wrapped)

    return decorate


def changed(context: click.Context, option: click.Parameter, values: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """NAME=VALUE pairs of --set."""
    for text in values:
        if "=" not in text:
            raise click.BadParameter(f"expected NAME=VALUE, got '{text}'", context, option)
    return tuple((key.strip(), value.strip()) for key, _, value in (text.partition("=") for text in values))


TIME_LIMIT = click.option(
    "--time-limit",
    "limit",
    type=click.FloatRange(0.0, min_open=True),
    default=float("inf"),
    metavar="SECONDS",
    help="Stop a motion after so many seconds of integration, with a checkpoint and exit code 6.",
)
SCENE_OPTIONS = (
    click.argument("path", metavar="SCENE", type=click.Path(path_type=Path)),
    click.option(
        "--set", "changes", metavar="NAME=VALUE", multiple=True, callback=changed, help="Replace a parameter of the scene."
    ),
    click.option("--allow-outside", is_flag=True, help="Permit meshes outside the scene's project folder."),
    click.option("--repair", is_flag=True, help="Merge nodes of meshes that are at one place."),
)
OPTIONS = (
    click.option("--out", metavar="DIR", type=click.Path(path_type=Path, file_okay=True), help="Folder for the results."),
    click.option("--json", is_flag=True, help="Print one JSON object on stdout."),
    click.option("--force", is_flag=True, help="Overwrite the results of another run in the folder."),
    click.option("--strict", is_flag=True, help="Take notices for errors."),
    click.option("--debug", is_flag=True, help="Show the Python traceback of an error."),
)


def perform(function: Body, session: Session, values: Mapping[str, Any]) -> int:
    """Call the body of a command with one BLAS thread, print its result, and give its exit code."""
    screen.occupy()
    try:
        with one_thread(), listening(session):
            result = function(session, **values)
        show(session, result)
    except KeyboardInterrupt:
        return refuse(session, "interrupted", "interrupted", INTERRUPTED)
    except FmbsError as error:
        return refuse(session, str(error), reason(error), error.exit_code, **details(error))
    except Notice as notice:
        return refuse(session, f"{notice} (an error by --strict)", "notice", BAD_INPUT)
    except OSError as error:
        code = LIMIT if error.errno in durable.FULL else BAD_INPUT
        return refuse(session, str(error), REASONS[LIMIT] if code == LIMIT else "file", code)
    except MemoryError as error:
        text = f"memory: expected room for all that is computed at a time, got {error or 'none'}; "
        return refuse(session, text + "store fewer states, or take fewer cells", REASONS[LIMIT], LIMIT)
    except click.ClickException:
        raise
    except Exception as error:
        return broken(session, error)
    return 0 if result.error is None else result.error.exit_code


def broken(session: Session, error: Exception) -> int:
    """An internal error: what there is goes to files, where it can; its exit code."""
    from . import rescue

    written = rescue.write(session, error)
    text = f"internal error: {type(error).__name__}: {error}\nplease report it to the developers of fmbs_skfem {__version__}, "
    told = f"{written[0]}; written: {', '.join(map(str, written))}" if written else "the output of --debug"
    text += f"with the scene and {told}"
    return refuse(session, text, "internal error", INTERNAL, files=written)


def refuse(session: Session, message: str, reason: str, code: int, **more: Any) -> int:
    """An error on stderr, with --json also on stdout; its exit code."""
    if session.debug:
        screen.tell(traceback.format_exc())
    screen.tell(f"error: {message}")
    if session.json:
        found = {"status": "error", "reason": reason, "message": message, **more, "notices": session.notices}
        with contextlib.suppress(screen.Unheard), screen.stdout():
            click.echo(reports.dumps(found))
    return code


def reason(error: FmbsError) -> str:
    """What kind of error, as one short text."""
    if isinstance(error, SolverError):
        return error.reason.value
    return REASONS.get(error.exit_code, "error")


def details(error: FmbsError) -> dict[str, Any]:
    """What a failed solve knows beyond its message."""
    if not isinstance(error, SolverError):
        return {}
    return {"time": error.time, "worst": [{"name": name, "residual": value} for name, value in error.worst]}


def failed(error: FmbsError) -> dict[str, Any]:
    """Keys of a report whose work failed but whose results so far are kept."""
    return {"status": "error", "reason": reason(error), "message": str(error), **details(error)}


def show(session: Session, result: Result) -> None:
    """JSON or tables on stdout, the error of a partial result on stderr."""
    if result.error is not None:
        screen.tell(f"error: {result.error}")
    with contextlib.suppress(screen.Unheard) if result.error is not None else contextlib.nullcontext(), screen.stdout():
        if session.json:
            report = {**result.report, "notices": session.notices} if "status" in result.report else result.report
            click.echo(reports.dumps(report))
        else:
            terminal = screen.console(sys.stdout)
            for item in result.view:
                click.echo(item) if isinstance(item, str) else terminal.print(item)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """One BLAS thread: small systems are faster, and times comparable."""
    import scipy.linalg  # noqa: F401  (limits reach only libraries that are loaded)
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


@contextlib.contextmanager
def listening(session: Session) -> Iterator[None]:
    """Notices go to stderr and into the session, each once; with --strict they are raised."""
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def hear(
            message: Warning | str, category: type[Warning], filename: str, lineno: int, file: Any = None, line: str | None = None
        ) -> None:
            if not issubclass(category, Notice):
                usual(message, category, filename, lineno, file, line)
            elif str(message) not in session.notices:
                session.notices.append(str(message))
                screen.tell(f"notice: {message}")

        warnings.simplefilter("error" if session.strict else "always", Notice)
        warnings.simplefilter("always", Remark)
        warnings.showwarning = hear
        yield


def read_scene(session: Session, duration: float | None = None) -> Scene:
    """The scene of the session with its parameters replaced; `duration` [s] replaces that of a dynamic analysis."""
    from .. import scenes
    from ..scenes import build, times

    scene = scenes.read(session.path, session.changes, session.repair)
    build.check_files(scene, session.allow_outside)
    if duration is None:
        return fitted(scene)
    if scene.analysis.type != "dynamic":
        raise InputError(say("--duration", "a scene with a dynamic analysis", scene.analysis.type, "leave the option out"))
    step = scene.analysis.step
    if not step <= duration <= times.STEPS * step:
        raise InputError(say("--duration", f"1 to {times.STEPS} steps of {step:g} s", f"{duration:g} s"))
    return fitted(scene.model_copy(update={"analysis": scene.analysis.model_copy(update={"duration": duration})}))


def fitted(scene: Scene) -> Scene:
    """The scene with a step that divides its duration, with a notice where that is a smaller one than the scene's.

    Scenes with parameters that have a range keep theirs, which may depend on them, and so do those whose other times it divides.
    """
    from ..scenes import times

    analysis = scene.analysis
    if analysis.type != "dynamic" or scene.ranges:
        return scene
    spans = [every for every in (analysis.every, scene.reduction and scene.reduction.snapshots) if isinstance(every, tuple)]
    counted = [time for parts in spans for span in parts for time in (span.every, span.until) if time is not None]
    if scene.reduction is not None and isinstance(scene.reduction.snapshots, float):
        counted.append(scene.reduction.snapshots)
    step = times.fitted(analysis.step, analysis.duration, counted)
    if step == analysis.step:
        return scene
    asked, taken = f"{analysis.step:.6g} s", f"{step:.6g} s"
    notify(f"the duration of {analysis.duration:.6g} s is no whole number of steps of {asked}: steps of {taken} are taken")
    return scene.model_copy(update={"analysis": analysis.model_copy(update={"step": step})})


def stem(scene: Scene) -> str:
    """The name of the file of a scene, for the files made from it."""
    return scene.path.stem if scene.path else "scene"


def title(scene: Scene) -> str:
    """The name of a scene, or that of its file."""
    return scene.name or (scene.path.stem if scene.path else "")
