"""What a command shows: tables, progress on stderr, and that the first run compiles."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING

import click

from ..core import durable
from ..core.errors import FmbsError, InputError, say

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

PATIENCE = 2.0  #: work that takes longer shows its progress [s]


class Unheard(FmbsError):
    """What was to be printed on stdout did not arrive."""

    def __init__(self, text: str, full: bool = False) -> None:
        super().__init__(text)
        self.exit_code = 6 if full else InputError.exit_code


def tell(text: str) -> None:
    """A line on stderr. Nothing is lost where that is closed or full: what is said there is also in the reports."""
    with contextlib.suppress(OSError, ValueError):
        click.echo(text, err=True)


def drop() -> None:
    """What waits in the buffer of stdout is not tried again at the end of the process, when nobody could tell of it."""
    with contextlib.suppress(OSError, ValueError):
        if sys.stdout is not None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def occupy() -> None:
    """Take the numbers of standard streams that are closed: a file of results that had one would get what libraries print."""
    while (number := os.open(os.devnull, os.O_RDWR)) < 3:
        pass
    os.close(number)


@contextlib.contextmanager
def stdout() -> Iterator[None]:
    """Whatever is printed inside has arrived when it ends; `Unheard` where nobody takes it."""
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        yield
        sys.stdout.flush()
    except OSError as problem:
        drop()
        got = os.strerror(problem.errno or errno.EIO).lower()
        remedy = "files of results are not concerned"
        raise Unheard(
            say("stdout", "an output that takes what is printed", got, remedy), problem.errno in durable.FULL
        ) from problem


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

    begin, visible = time.perf_counter(), sys.stderr is not None and sys.stderr.isatty()
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


@contextlib.contextmanager
def compiling(scene: Path | None) -> Iterator[bool]:
    """Whether what is done inside compiles the time step, which the cache has not: one process at a time.

    First runs that begin together would compile the same in each other's way; those that wait find it in the cache.
    """
    from ..core import jit

    folder = jit.cache_folder()
    if folder is None or not cold(folder):
        yield announce_compiling(scene)
        return
    with (folder / "compiling").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            tell("waiting for another process that compiles (first runs only)")
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(file, fcntl.LOCK_EX)
        yield announce_compiling(scene)


def cold(folder: Path) -> bool:
    """Whether no compiled step is cached in a folder."""
    return not any(folder.rglob("stepping.advance-*.nbc"))


def announce_compiling(scene: Path | None = None) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said on stderr.

    What a run of `scene` needs after its time steps is compiled by a process beside it, one for all runs that begin meanwhile.
    """
    from ..core import jit

    folder = jit.cache_folder()
    new = folder is None or cold(folder)
    if new:
        tell("compiling (first run only)")
    if new and folder is not None and scene is not None and first(folder):
        command = [sys.executable, "-m", "fmbs_skfem.cli.warm", str(scene)]
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return new
