"""What a command shows: tables, progress on stderr, and that the first run compiles."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

PATIENCE = 2.0  #: work that takes longer shows its progress [s]


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


def first(folder: Path) -> bool:
    """Whether no other process has begun to compile into the folder."""
    try:
        (folder / "begun").touch(exist_ok=False)
    except OSError:
        return False
    return True


def announce_compiling(scene: Path | None = None) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said on stderr.

    What a run of `scene` needs after its time steps is compiled by a process beside it, one for all runs that begin meanwhile.
    """
    from ..core import jit

    folder = jit.cache_folder()
    cold = folder is None or not any(folder.rglob("stepping.advance-*.nbc"))
    if cold:
        click.echo("compiling (first run only)", err=True)
    if cold and folder is not None and scene is not None and first(folder):
        command = [sys.executable, "-m", "fmbs_skfem.cli.warm", str(scene)]
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return cold
