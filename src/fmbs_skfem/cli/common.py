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
from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import Notice
from . import reports, screen

if TYPE_CHECKING:
    from ..scenes import Scene

INTERRUPTED = 130
INTERNAL = 1
BAD_INPUT = InputError.exit_code
REASONS = {
    3: "bad input",
    5: "failed members",
    6: "limit reached",
    7: "missing feature",
    8: "corrupt file",
    INTERRUPTED: "interrupted",
    143: "terminated",
}
SHARED = ("out", "json", "force", "allow_outside", "repair", "strict", "debug")  #: options that many commands have


@dataclass(frozen=True)
class Session:
    """The shared options of one call, and the notices given so far."""

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
        return refuse(session, str(error), "file", BAD_INPUT)
    except click.ClickException:
        raise
    except Exception as error:
        text = f"internal error: {type(error).__name__}: {error}\nplease report it to the developers of fmbs_skfem {__version__}, "
        return refuse(session, text + "with the scene and the output of --debug", "internal error", INTERNAL)
    return 0 if result.error is None else result.error.exit_code


def refuse(session: Session, message: str, reason: str, code: int, **more: Any) -> int:
    """An error on stderr, with --json also on stdout; its exit code."""
    if session.debug:
        traceback.print_exc()
    click.echo(f"error: {message}", err=True)
    if session.json:
        click.echo(reports.dumps({"status": "error", "reason": reason, "message": message, **more, "notices": session.notices}))
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
    if session.json:
        report = {**result.report, "notices": session.notices} if "status" in result.report else result.report
        click.echo(reports.dumps(report))
    else:
        terminal = screen.console(sys.stdout)
        for item in result.view:
            click.echo(item) if isinstance(item, str) else terminal.print(item)
    if result.error is not None:
        click.echo(f"error: {result.error}", err=True)


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
                click.echo(f"notice: {message}", err=True)

        warnings.simplefilter("error" if session.strict else "always", Notice)
        warnings.showwarning = hear
        yield


def read_scene(session: Session, duration: float | None = None) -> Scene:
    """The scene of the session with its parameters replaced; `duration` [s] replaces that of a dynamic analysis."""
    from .. import scenes

    scene = scenes.read(session.path, session.changes, session.repair)
    if duration is None:
        return scene
    if scene.analysis.type != "dynamic":
        raise InputError(say("--duration", "a scene with a dynamic analysis", scene.analysis.type, "leave the option out"))
    if not duration >= scene.analysis.step:
        raise InputError(say("--duration", f"at least one step of {scene.analysis.step:g} s", f"{duration:g} s"))
    return scene.model_copy(update={"analysis": scene.analysis.model_copy(update={"duration": duration})})


def stem(scene: Scene) -> str:
    """The name of the file of a scene, for the files made from it."""
    return scene.path.stem if scene.path else "scene"


def title(scene: Scene) -> str:
    """The name of a scene, or that of its file."""
    return scene.name or (scene.path.stem if scene.path else "")
