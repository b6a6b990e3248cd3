"""The command `fmbs`: subcommands are imported when they are called, so that `fmbs --help` answers at once."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from .. import __version__
from ..core import durable
from ..core.errors import InputError, closest
from ..core.notices import Notice

#: command -> what it does; module `cli.<command>` holds it as `command`
COMMANDS = {
    "check": "Read a scene and its meshes, assemble it, and say what it is.",
    "run": "Solve a scene, or run a saved reduced model.",
    "resume": "Go on with a run that was stopped.",
    "reduce": "Train a reduced model of a scene and save it.",
    "train": "Train a reduced model over the ranges of a scene's parameters.",
    "rom": "Say what a saved reduced model is, or run it at wanted parameters.",
    "compare": "Full and reduced models of a scene: time beside error.",
    "sweep": "Run many members of a scene or of a reduced model, on all cores or on a cluster.",
    "render": "Solve a scene and draw pictures (PNG) and an animation (GIF).",
    "export": "Solve a scene and write a VTK series.",
    "verify": "Hold the solver against published and exact results.",
    "demo": "Example: a flexible double pendulum in full and reduced.",
    "schema": "Print the JSON schema of scene files.",
}


class Commands(click.Group):
    """A group that knows its commands by name and imports the one that is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        found = importlib.import_module(f".{name}", __package__).command
        return found if isinstance(found, click.Command) else None

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"expected one of the commands {', '.join(COMMANDS)}, got '{args[0]}'{closest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """As usual; `--help` and `--version` on a full disk end as commands do."""
        try:
            return super().main(*args, **kwargs)
        except OSError as problem:
            from . import screen

            screen.drop()
            screen.tell(f"error: {problem}")
            sys.exit(6 if problem.errno in durable.FULL else 3)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="fmbs")
@click.option("--extension", "files", multiple=True, metavar="FILE", help="Run a Python file that declares types of its own.")
def main(files: tuple[str, ...]) -> None:
    """Flexible multibody systems: full models, reduced models, and the error beside the speed.

    Every command takes --json (one object on stdout) and --out (a folder).

    Exit codes: 0 done, 2 usage, 3 bad input, 4 solver failed (the partial result is kept) or a training has no model, 5 some
    members of a sweep failed, 6 the disk or the memory is full, or the time is over, 7 an optional feature is missing, 8 a result
    is corrupt, 130 interrupted, 143 terminated. An internal error ends with 1, and leaves internal_error.json beside the results
    that there are.
    """
    if files:
        run_extensions(files)


def run_extensions(files: Sequence[str]) -> None:
    """Run Python files that declare outputs and laws, which saved models may need, and more keys for `fmbs schema`."""
    from ..scenes import extensions
    from . import screen

    for file in files:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Notice)
                extensions.run(Path(file).resolve())
        except InputError as error:
            screen.tell(f"error: --extension {file}: {error}")
            sys.exit(error.exit_code)
        screen.tell(f"notice: ran the Python file {file}")
