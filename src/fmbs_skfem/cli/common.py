"""What all commands share: options, output folders, progress, notices, errors, exit codes.

    @common.command("check")
    @click.option(...)
    def command(session: Session, ...) -> Result        Result -> tables, or with --json one object on stdout

stdout is data; notices, progress and messages go to stderr. Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import math
import os
import platform
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from .. import __version__
from ..core.errors import FmbsError, InputError, SolverError, say
from ..core.notices import Notice

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from ..scenes import Scene

INTERRUPTED = 130
INTERNAL = 1
BAD_INPUT = InputError.exit_code
REASONS = {
    3: "bad input",
    5: "failed members",
    6: "disk full",
    7: "missing feature",
    8: "corrupt file",
    INTERRUPTED: "interrupted",
    143: "terminated",
}
SHARED = ("out", "json", "force", "allow_outside", "repair", "strict", "debug")  #: options that many commands have
PATIENCE = 2.0  #: work that takes longer shows its progress [s]
REPORT = "report.json"
VERSIONS = ("numpy", "scipy", "numba", "scikit-fem")


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
        click.echo(dumps({"status": "error", "reason": reason, "message": message, **more, "notices": session.notices}))
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
        click.echo(dumps(report))
    else:
        screen = console(sys.stdout)
        for item in result.view:
            click.echo(item) if isinstance(item, str) else screen.print(item)
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


@contextlib.contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """A function that takes the finished fraction; on a terminal a bar on stderr after two seconds."""
    from rich.progress import Progress

    begin, visible = time.perf_counter(), sys.stderr.isatty()
    with contextlib.ExitStack() as stack:
        bars: list[Progress] = []

        def advance(fraction: float) -> None:
            if not visible or (not bars and time.perf_counter() - begin < PATIENCE):
                return
            if not bars:
                bars.append(stack.enter_context(Progress(console=console(sys.stderr), transient=True)))
                bars[0].add_task(label, total=1.0)
            bars[0].update(bars[0].task_ids[0], completed=fraction)

        yield advance


def announce_compiling(scene: Path | None = None) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said on stderr.

    What a run of `scene` needs after its time steps is compiled by a process beside it.
    """
    from ..core import jit

    folder = jit.cache_folder()
    cold = folder is None or not any(folder.rglob("stepping.advance-*.nbc"))
    if cold:
        click.echo("compiling (first run only)", err=True)
    if cold and folder is not None and scene is not None:
        command = [sys.executable, "-m", "fmbs_skfem.cli.warm", str(scene)]
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return cold


def console(file: IO[str]) -> Console:
    """A rich console; as wide as the house's lines where there is no terminal."""
    from rich.console import Console

    return Console(file=file, width=None if file.isatty() else 132, highlight=False, soft_wrap=False)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> Table:
    """A table whose first column is text and whose other columns are numbers."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    found = Table(title=escape(title), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for number, column in enumerate(columns):
        found.add_column(escape(column), justify="right" if number else "left")
    for row in rows:
        found.add_row(*(escape(number_text(value)) for value in row))
    return found


def number_text(value: object) -> str:
    """Numbers with six digits, everything else as it is."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def plain(value: Any) -> Any:
    """A value that JSON can hold: arrays as lists, numbers that are not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def dumps(value: Any) -> str:
    """JSON text."""
    return json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False)


def versions() -> dict[str, str]:
    """Versions that a result depends on."""
    from importlib import metadata

    return {"fmbs_skfem": __version__, "python": sys.version.split()[0], **{name: metadata.version(name) for name in VERSIONS}}


def provenance(scene: Scene) -> dict[str, Any]:
    """All that the numbers of a result depend on: values of the scene, contents of files, libraries, machine, threads, seeds.

    On one machine with one thread, the same provenance gives the same bits.
    """
    from threadpoolctl import threadpool_info

    files = {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in scene_files(scene)}
    return {
        "scene": scene.model_dump(by_alias=True, exclude_none=True, warnings=False),
        "file": str(scene.path.absolute()) if scene.path else None,
        "files": files,
        "versions": versions(),
        "machine": {"system": platform.platform(), "processor": processor(), "cores": os.cpu_count()},
        "threads": {"blas": max((info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"), default=1)},
        "seeds": {"solver": 0, **({"training": scene.training.seed} if scene.training else {})},
    }


def scene_files(scene: Scene) -> list[Path]:
    """The file of a scene and the mesh and surface files it reads, each once."""
    from ..shapes import meshes

    names = {getattr(body, key) for body in scene.bodies.values() for key in ("mesh", "nurbs") if getattr(body, key, None)}
    read = [meshes.path(name, scene.folder, allow_outside=True) for name in sorted(names)]
    return [path.absolute() for path in ([scene.path] if scene.path else []) + read]


def processor() -> str:
    """The name of the processor."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return platform.machine()


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


def fingerprint(scene: Scene) -> str:
    """Hash of the scene with its parameters and of the mesh files it reads; equal for runs that compute the same."""
    digest = hashlib.sha256(repr((sorted(scene.parameters.items()), scene.analysis)).encode())
    for path in scene_files(scene):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def folder(session: Session, default: str | Path, names: Iterable[str], mark: str, record: str = REPORT) -> Path:
    """The output folder, made; `names` are the files to be written, `mark` the fingerprint of this run.

    Files of another run (whose JSON file `record` has another `fingerprint`, or none) are kept unless --force is given.
    """
    out = session.out or Path(default)
    if out.exists() and not out.is_dir():
        raise InputError(say(f"--out {out}", "a folder", "a file", "choose another name"))
    taken = [name for name in names if (out / name).exists()]
    if taken and not session.force and recorded(out / record) != mark:
        got = f"another run's {', '.join(taken)}"
        raise InputError(say(f"--out {out}", "an empty folder or one of the same run", got, "choose another folder, or --force"))
    out.mkdir(parents=True, exist_ok=True)
    return out


def recorded(path: Path) -> str:
    """The fingerprint in a JSON file of a run; empty where there is none."""
    try:
        return str(json.loads(path.read_text(encoding="utf-8"))["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def write_json(path: Path, report: Mapping[str, Any]) -> Path:
    """Write a report, complete or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(dumps(report) + "\n", encoding="utf-8")
    part.replace(path)
    return path
