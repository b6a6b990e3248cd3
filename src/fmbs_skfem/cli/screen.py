"""The terminal of a command: what goes to stdout arrives, messages and progress go to stderr."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, TextIO

import click

from ..core.errors import FmbsError, InputError, say
from ..core.storage import durable
from ..core.values.problems import printable
from ..studies import text_tables
from ..studies.result import width_of

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE = 2.0  #: work that takes longer shows its progress [s]
PACE = 30.0  #: between two lines of progress where there is no terminal [s]


class Unheard(FmbsError):
    """What was to be printed on stdout did not arrive."""

    def __init__(self, text: str, full: bool = False) -> None:
        super().__init__(text)
        self.exit_code = 6 if full else InputError.exit_code


class Unread(Unheard):
    """Whoever read stdout has gone, as `head` does when it has its lines: nothing is said, as of a
    process that SIGPIPE ends.
    """

    def __init__(self) -> None:
        super().__init__("stdout")
        self.exit_code = 141


def tell(text: str) -> None:
    """A line on stderr. Nothing is lost where that is closed or full: what is said there is also in
    the reports.
    """
    try:
        click.echo(fold(text, sys.stderr), err=True)
    except (OSError, ValueError):
        drop(sys.stderr)


def fold(text: str, stream: TextIO | None) -> str:
    """A text whose lines end between words where a terminal would end them inside of one, and whose
    control characters, as in names of files, are written out.
    """
    text = "\n".join(printable(line) for line in text.split("\n"))
    return (
        "\n".join(text_tables.fill(text, width_of(stream)))
        if stream is not None and stream.isatty()
        else text
    )


def drop(stream: TextIO | None) -> None:
    """What waits in the buffer of a stream is not tried again at the end of the process, which
    would end with code 120.
    """
    with contextlib.suppress(OSError, ValueError):
        if stream is not None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def occupy() -> None:
    """Take the numbers of standard streams that are closed: a file of results that had one would
    get what libraries print.
    """
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
        drop(sys.stdout)
        if problem.errno == errno.EPIPE:
            raise Unread from problem
        got = os.strerror(problem.errno or errno.EIO).lower()
        remedy = "files of results are not concerned"
        raise Unheard(
            say("stdout", "an output that takes what is printed", got, remedy),
            problem.errno in durable.FULL,
        ) from problem


class Bar:
    """Progress on stderr: a bar on a terminal for work that takes longer than PATIENCE, elsewhere a
    line every PACE seconds.
    """

    def __init__(self) -> None:
        self.label = ""
        self.begin = 0.0
        self.line = 0.0
        self.bar: Progress | None = None
        self.visible = sys.stderr is not None and sys.stderr.isatty()

    def progress(self, label: str, fraction: float) -> None:
        """The finished part of the work `label`."""
        if label != self.label:
            self.close()
            self.label, self.begin = label, time.perf_counter()
            self.line = self.begin
        now = time.perf_counter()
        if not self.visible:
            if now - self.line >= PACE:
                self.line = now
                tell(f"{label}: {fraction:.0%} after {now - self.begin:.0f} s")
            return
        if self.bar is None and now - self.begin < PATIENCE:
            return
        if self.bar is None:
            from rich.console import Console
            from rich.progress import Progress

            self.bar = Progress(console=Console(file=sys.stderr, highlight=False), transient=True)
            self.bar.start()
            self.bar.add_task(label, total=1.0)
        self.bar.update(self.bar.task_ids[0], completed=fraction)
        if fraction >= 1.0:
            self.close()

    def close(self) -> None:
        """The bar goes; another one may come."""
        if self.bar is not None:
            self.bar.stop()
        self.label = ""
        self.bar = None
