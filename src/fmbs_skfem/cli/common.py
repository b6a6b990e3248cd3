"""What all commands share: options, what is printed, exit codes.

    @common.command("check")
    @click.option("--duration", ...)
    def command(path: Path, **options: Any) -> Result        a study, called with the options

stdout is data; notices, progress and messages go to stderr. Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

import contextlib
import functools
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from .. import __version__
from ..core import durable
from ..core.errors import FmbsError, InputError
from ..core.notices import Notice
from ..studies.job import Job, Listener
from ..studies.result import REASONS, Result, describe_error
from . import screen

INTERNAL, INTERRUPTED, BAD_INPUT, LIMIT = 1, 130, InputError.exit_code, 6

Body = Callable[..., Result]


@dataclass(frozen=True)
class Call:
    """How one call of a command prints, and the study that it began."""

    json: bool
    debug: bool
    jobs: list[Job] = field(default_factory=list)

    @property
    def notices(self) -> list[str]:
        """Those given so far."""
        return self.jobs[-1].notices if self.jobs else []


def command(name: str, scene: bool = True, into: str = "") -> Callable[[Body], click.Command]:
    """Make a function of options the command `name`; `scene`: it takes a SCENE argument.

    `into` names the output where --out does not, with the name of the scene or model file for `{}`.
    """

    def decorate(function: Body) -> click.Command:
        @functools.wraps(function)
        def guarded(**values: Any) -> None:
            call = Call(values.pop("json"), values.pop("debug"))
            if "changes" in values:
                values["parameters"] = dict(values.pop("changes"))
            if values["out"] is None and into:
                values["out"] = Path(into.format(values["path"].stem if "path" in values else ""))
            with contextlib.closing(screen.Bar()) as bar:
                strict = values.pop("strict")
                listener = Listener(
                    bar.progress, screen.tell, lambda text: screen.tell(f"notice: {text}"), call.jobs.append, strict
                )
                code = perform(functools.partial(function, **values, listener=listener), call, bar)
            click.get_current_context().exit(code)

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


PATH = click.Path(path_type=Path)
FILE = click.argument("path", metavar="FILE", type=PATH)
DURATION = click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a dynamic analysis.")
PLOTS = click.option("--plots/--no-plots", default=True, help="Draw the outputs into outputs.png (default: yes).")
TIME_LIMIT = click.option(
    "--time-limit",
    type=click.FloatRange(0.0, min_open=True),
    default=float("inf"),
    metavar="SECONDS",
    help="Stop a motion after so many seconds of integration, with a checkpoint and exit code 6.",
)
SET = functools.partial(click.option, "--set", "changes", metavar="NAME=VALUE", multiple=True, callback=changed)
SCENE_OPTIONS = (
    click.argument("path", metavar="SCENE", type=PATH),
    SET(help="Replace a parameter of the scene."),
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


def perform(function: Callable[[], Result], call: Call, bar: screen.Bar) -> int:
    """Call the body of a command, print what it found, and give its exit code."""
    screen.occupy()
    try:
        found = function()
        bar.close()
        show(call, found.report, found.view)
        return 0
    except KeyboardInterrupt:
        return refuse(call, "interrupted", "interrupted", INTERRUPTED)
    except FmbsError as error:
        bar.close()
        if error.result is None:
            return refuse(call, **{**describe_error(error), "message": str(error)}, code=error.exit_code)
        screen.tell(f"error: {error}")
        with contextlib.suppress(screen.Unheard):
            show(call, error.result.report, error.result.view)
        return error.exit_code
    except Notice as notice:
        return refuse(call, f"{notice} (an error by --strict)", "notice", BAD_INPUT)
    except OSError as error:
        code = LIMIT if error.errno in durable.FULL else BAD_INPUT
        return refuse(call, str(error), REASONS[LIMIT] if code == LIMIT else "file", code)
    except MemoryError as error:
        text = f"memory: expected room for all that is computed at a time, got {error or 'none'}; "
        return refuse(call, text + "store fewer states, or take fewer cells", REASONS[LIMIT], LIMIT)
    except click.ClickException:
        raise
    except Exception as error:
        return broken(call, error)


def broken(call: Call, error: Exception) -> int:
    """An internal error: what there is goes to files, where it can; its exit code."""
    from ..studies import rescue

    written = rescue.write(call.jobs[-1] if call.jobs else Job(), error)
    text = f"internal error: {type(error).__name__}: {error}\nplease report it to the developers of fmbs_skfem {__version__}, "
    told = f"{written[0]}; written: {', '.join(map(str, written))}" if written else "the output of --debug"
    return refuse(call, f"{text}with the scene and {told}", "internal error", INTERNAL, files=written)


def refuse(call: Call, message: str, reason: str, code: int, **more: Any) -> int:
    """An error on stderr, with --json also on stdout; its exit code."""
    if call.debug:
        screen.tell(traceback.format_exc())
    screen.tell(f"error: {message}")
    if call.json:
        with contextlib.suppress(screen.Unheard):
            show(call, {"status": "error", "reason": reason, **more, "message": message, "notices": call.notices}, ())
    return code


def show(call: Call, report: Mapping[str, Any], view: Sequence[Any]) -> None:
    """JSON or tables on stdout."""
    from ..studies import reports
    from ..studies.result import console

    with screen.stdout():
        if call.json:
            click.echo(reports.dumps(report))
        else:
            terminal = console(sys.stdout)
            for item in view:
                click.echo(item) if isinstance(item, str) else terminal.print(item)
