"""The command `fmbs`: every command is a study, whose work is imported when it is called, so that
`--help` answers at once.
"""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from .. import __version__, studies
from ..core import own_words
from ..core.errors import InputError, closest
from ..core.notices import Notice
from ..core.storage import durable
from . import common, screen

DEMO, EXAMPLES = Path("fmbs-demo"), Path("fmbs-examples")


@functools.wraps(studies.check)
def check(source: Path, **options: Any) -> studies.Result:
    """Of a folder its checksums."""
    if source.is_dir():
        return studies.checksums(source, listener=options["listener"])
    return studies.check(source, **options)


@functools.wraps(studies.run)
def run(source: Path, **options: Any) -> studies.Result:
    """Without states that nobody can ask for."""
    return studies.run(source, states=False, **options)


@functools.wraps(studies.resume)
def resume(folder: Path, **options: Any) -> studies.Result:
    """The same of a run that was stopped."""
    return studies.resume(folder, states=False, **options)


@functools.wraps(studies.demo)
def demo(out: Path | None, force: bool, copy: bool, **options: Any) -> studies.Result:
    """Into a folder of its own, whose files are those of an earlier demo; examples, which may have
    been changed, are kept.
    """
    own = EXAMPLES if copy else DEMO
    return studies.demo(
        out=out or own, force=force or (out is None and not copy), copy=copy, **options
    )


def rom() -> click.Group:
    """The commands of saved reduced models."""
    text = "Say what a saved reduced model is, run it at other parameters without meshes and full model, or write it as C."
    made = [
        common.command("info", studies.info),
        common.command("run", studies.run_model, "fmbs-{}"),
    ]
    made.append(common.command("export", studies.export_model))
    return Choice(
        "rom", made, help=text, epilog="All take --json and, for what they write, --out DIR."
    )


def part() -> click.Group:
    """The commands of reduced parts."""
    text = "Reduce a body once, alone, for any mechanism, say what such a part is, or check it in a scene."
    made = [
        common.command("train", studies.train_part, "."),
        common.command("info", studies.describe_part),
    ]
    made.append(common.command("check", studies.check_part))
    return Choice(
        "part", made, help=text, epilog="All take --json and, for what they write, --out PATH."
    )


#: commands with commands of their own
GROUPS: dict[str, Callable[[], click.Group]] = {
    "rom": rom,
    "part": part,
}
#: command -> its study, and the name of its output folder or file where --out gives none
COMMANDS: dict[str, tuple[Callable[..., studies.Result], str] | None] = {
    "new": (studies.new, ""),
    "check": (check, ""),
    "run": (run, "fmbs-{}"),
    "resume": (resume, ""),
    "reduce": (studies.reduce, "{}.h5"),
    "train": (studies.train, "fmbs-{}-train"),
    "rom": None,
    "part": None,
    "compare": (studies.compare, "fmbs-{}-compare"),
    "sweep": (studies.sweep, "fmbs-{}-sweep"),
    "render": (studies.render, "fmbs-{}"),
    "view": (studies.view, ""),
    "report": (studies.report, ""),
    "export": (studies.export, "fmbs-{}"),
    "verify": (studies.verify, ""),
    "demo": (demo, ""),
    "warm": (studies.warm, ""),
    "schema": (studies.describe_scenes, ""),
}


class Choice(click.Group):
    """A group of commands; what is none of them is refused with the call that was probably meant."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        known = self.list_commands(ctx)
        if args and args[0] not in known and not args[0].startswith("-"):
            got = f"got '{args[0]}'"
            place = ""
            if Path(args[0]).suffix or Path(args[0]).exists():
                place = f" before the file, such as '{ctx.command_path} {'run' if 'run' in known else 'info'} {args[0]}'"
            ctx.fail(
                f"expected one of the commands {', '.join(known)}{place}, {got}{closest(args[0], known)}"
            )
        return super().resolve_command(ctx, args)


class Commands(Choice):
    """A group that knows its commands by name, in the order in which they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        found = COMMANDS[name]
        return GROUPS[name]() if found is None else common.command(name, *found)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """As usual; `--help` and `--version` on a full disk end as commands do."""
        try:
            return super().main(*args, **kwargs)
        except OSError as problem:
            screen.drop(sys.stdout)
            screen.tell(f"error: {problem}")
            sys.exit(6 if problem.errno in durable.FULL else 3)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        commands = {name: self.get_command(ctx, name) for name in COMMANDS}
        with formatter.section("Commands"):
            formatter.write_dl(
                [
                    (name, one.get_short_help_str(200))
                    for name, one in commands.items()
                    if one is not None
                ]
            )


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="fmbs")
@click.option(
    "--extension",
    "files",
    multiple=True,
    metavar="FILE",
    help="Run a Python file that declares types of its own.",
)
def main(files: tuple[str, ...]) -> None:
    """Flexible multibody systems: full models, reduced models, and the error beside the speed.

    Every command takes --json (one object on stdout) and --out (a folder).

    Exit codes: 0 done, 2 usage, 3 bad input, 4 solver failed (the partial result is kept) or a
    training has no model, 5 some samples of a sweep failed, 6 the disk or the memory is full, or
    the time is over, 7 an optional feature is missing, 8 a result is corrupt, 130 interrupted, 143
    terminated, 129 its terminal closed, 141 nobody reads stdout. An internal error ends with 1, and
    leaves internal_error.json beside the results that there are.
    """
    if files:
        run_extensions(files)


def run_extensions(files: Sequence[str]) -> None:
    """Run Python files that declare outputs and laws, which saved models may need, and more keys
    for `fmbs schema`.

    Scenes of this call are read as if they listed them.
    """
    from ..scenes import extensions

    for file in files:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Notice)
                extensions.run(path := Path(file).resolve())
            own_words.EVERYWHERE.add(module := extensions.module_of(path))
            click.get_current_context().call_on_close(
                functools.partial(own_words.EVERYWHERE.discard, module)
            )
        except InputError as error:
            screen.tell(f"error: --extension {file}: {error}")
            sys.exit(error.exit_code)
        screen.tell(f"warning: ran the Python file {file}")


if __name__ == "__main__":
    main()
