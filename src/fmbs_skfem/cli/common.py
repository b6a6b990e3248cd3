"""What all commands share: a study called with its options, what is printed, exit codes.

stdout is data; warnings, progress and messages go to stderr. Nothing heavy is imported before a
command runs.
"""

from __future__ import annotations

import contextlib
import functools
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

import click

from .. import __version__
from ..core.errors import FmbsError, InputError
from ..core.notices import Notice
from ..core.storage import durable, endings
from ..core.storage.records import dataclass
from ..studies.job import Job, Listener
from ..studies.result import REASONS, Result, describe_error
from . import options, screen

INTERNAL = 1
INTERRUPTED = 130
BAD_INPUT = InputError.exit_code
LIMIT = 6


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


class Study(click.Command):
    """A command that refuses an argument too many by the options that take values."""

    allow_extra_args = True

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As usual, but for what is left."""
        rest = super().parse_args(ctx, args)
        if rest and not ctx.resilient_parsing:
            valued = [
                one for one in self.params if isinstance(one, click.Option) and not one.is_flag
            ]
            taking = [f"{one.opts[0]} {one.metavar or 'VALUE'}" for one in valued]
            ctx.fail(
                f"expected values behind their options ({', '.join(taking)}), got '{' '.join(rest)}'"
            )
        return rest


def command(name: str, study: Callable[..., Result], into: str = "") -> click.Command:
    """The command of a study.

    `into` names the output where --out does not, with the name of the scene or model file for `{}`.
    """
    source = options.source(study)

    def call(**values: Any) -> None:
        how = Call(values.pop("json"), values.pop("debug"))
        if values.pop("allow_extensions"):
            values["extensions"] = "allow"
        if values["out"] is None and into:
            values["out"] = Path(into.format(values[source].stem if source else ""))
        given = [values.pop(source)] if source else []
        with contextlib.closing(screen.Bar()) as bar:
            strict = values.pop("strict")
            listener = Listener(
                bar.progress,
                screen.tell,
                lambda text: screen.tell(f"warning: {text}"),
                how.jobs.append,
                strict,
            )
            code = perform(functools.partial(study, *given, **values, listener=listener), how, bar)
        click.get_current_context().exit(code)

    return Study(
        name,
        callback=call,
        params=options.parameters(study, into.format("NAME")),
        help=options.explain(study),
    )


def perform(function: Callable[[], Result], call: Call, bar: screen.Bar) -> int:
    """Call the body of a command, print what it found, and give its exit code."""
    screen.occupy()
    try:
        found = function()
        bar.close()
        show(call, found.report, found.lines)
        return 0
    except endings.Ended as stop:
        code = 128 + stop.number
        return refuse(call, f"stopped by {stop}", REASONS[code], code)
    except KeyboardInterrupt:
        return refuse(call, "interrupted", "interrupted", INTERRUPTED)
    except screen.Unread as gone:
        return gone.exit_code
    except FmbsError as error:
        bar.close()
        return show_failure(call, error)
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


def show_failure(call: Call, error: FmbsError) -> int:
    """An error of the package, with the result up to there where it has one; its exit code."""
    if error.result is None:
        return refuse(
            call, **{**describe_error(error), "message": str(error)}, code=error.exit_code
        )
    screen.tell(f"error: {error}")
    with contextlib.suppress(screen.Unheard):
        show(call, error.result.report, error.result.lines)
    return error.exit_code


def broken(call: Call, error: Exception) -> int:
    """An internal error: what there is goes to files, where it can; its exit code."""
    from ..studies.running import failures

    written = failures.rescue(call.jobs[-1] if call.jobs else Job(), error)
    text = f"internal error: {type(error).__name__}: {error}\nplease report it to the developers of fmbs_skfem {__version__}, "
    told = (
        f"{written[0]}; written: {', '.join(map(str, written))}"
        if written
        else "the output of --debug"
    )
    return refuse(
        call, f"{text}with the scene and {told}", "internal error", INTERNAL, files=written
    )


def refuse(call: Call, message: str, reason: str, code: int, **more: Any) -> int:
    """An error on stderr, with --json also on stdout; its exit code."""
    if call.debug:
        screen.tell(traceback.format_exc())
    screen.tell(f"error: {message}")
    if call.json:
        with contextlib.suppress(screen.Unheard):
            show(
                call,
                {
                    "status": "error",
                    "reason": reason,
                    **more,
                    "message": message,
                    "notices": call.notices,
                },
                (),
            )
    return code


def show(call: Call, report: Mapping[str, Any], view: Sequence[Any]) -> None:
    """JSON or tables on stdout."""
    from ..studies import reports

    with screen.stdout():
        if call.json:
            click.echo(reports.dumps(report))
        else:
            for item in view:
                click.echo(screen.fold(item, sys.stdout)) if isinstance(item, str) else item.print(
                    sys.stdout
                )
