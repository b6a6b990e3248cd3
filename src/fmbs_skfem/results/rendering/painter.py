"""The process that draws: it loads VTK, probes whether anything can be drawn, then draws one order after the other.

An order is a folder (see `job`), a line on its input; a line on its output says that it is drawn. Whatever goes wrong ends the
process: its exit code and the last line on its stderr say why.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from ...core import extras

TIME_LIMIT = 900.0  #: for one picture [s]


class Painter:
    """A process that draws, started when it is wanted; `command` replaces the interpreter and module that draw."""

    def __init__(self, command: Sequence[str] | None = None) -> None:
        self.command = list(command or usual_command())
        self.folder = tempfile.TemporaryDirectory(prefix="fmbs-")
        self.lock = threading.Lock()
        self.process: subprocess.Popen[str] | None = None
        self.said: IO[bytes] | None = None  #: stderr of the process

    def begin(self) -> subprocess.Popen[str]:
        """The process, started where there is none; OSError where it cannot be started."""
        if self.process is None or self.process.poll() is not None:
            self.leave()
            root = str(Path(__file__).resolve().parents[3])
            paths = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH", "")]))
            self.said, pipe = tempfile.TemporaryFile(), subprocess.PIPE  # noqa: SIM115  closed in `leave`
            environment, cwd = {**os.environ, "PYTHONPATH": paths}, self.folder.name  # no module of the user's folder is imported
            self.process = subprocess.Popen(
                self.command, stdin=pipe, stdout=pipe, stderr=self.said, env=environment, cwd=cwd, text=True, errors="replace"
            )
        return self.process

    def draw(self, folder: Path | None) -> tuple[int, str]:
        """Draw the order in a folder, or only probe; 0, or the exit code of the process and its last words.

        TimeoutError where a picture takes too long.
        """
        with self.lock:
            process, late = self.begin(), threading.Event()
            assert process.stdin is not None
            assert process.stdout is not None

            def end_late() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(TIME_LIMIT, end_late)
            timer.daemon = True
            timer.start()
            try:
                with contextlib.suppress(OSError):  # it has ended
                    process.stdin.write(f"{folder or ''}\n")
                    process.stdin.flush()
                if process.stdout.readline():
                    return 0, ""
                code = process.wait()
            except BaseException:
                process.kill()
                raise
            finally:
                timer.cancel()
            if late.is_set():
                raise TimeoutError
            return code, self.last_words()

    def last_words(self) -> str:
        """The last line on the stderr of the process."""
        assert self.said is not None
        self.said.seek(0)
        return (self.said.read().decode(errors="replace").strip().splitlines() or ["no message"])[-1]

    def leave(self) -> None:
        """End the process, which may still be loading."""
        if self.process is not None and self.said is not None:
            self.process.kill()
            with contextlib.suppress(OSError):  # what was not written to one that has ended
                self.process.communicate()
            self.said.close()
            self.process = None

    def end(self) -> None:
        """End the process and remove what it worked in."""
        self.leave()
        self.folder.cleanup()


_AT_HAND: list[Painter] = []  #: the one of `at_hand`


def usual_command() -> tuple[str, ...]:
    """The interpreter and the module that draw."""
    return sys.executable, "-m", f"{__package__}.render_child"


@contextlib.contextmanager
def at_hand(wanted: bool = True, soon: bool = True) -> Iterator[None]:
    """Where it is `wanted`, one process for all pictures that are drawn inside.

    It loads VTK while other work goes on, or, if not `soon`, with the first picture.
    """
    if not wanted or _AT_HAND or extras.missing("viz"):
        yield
        return
    painter = Painter()
    _AT_HAND.append(painter)
    try:
        if soon:
            with contextlib.suppress(OSError):  # said where something is drawn
                painter.begin()
        yield
    finally:
        _AT_HAND.remove(painter)
        painter.end()


@contextlib.contextmanager
def hired(command: Sequence[str] | None) -> Iterator[Painter]:
    """The process at hand where it is of this command, else one of its own."""
    if _AT_HAND and _AT_HAND[0].command == list(command or usual_command()):
        yield _AT_HAND[0]
        return
    painter = Painter(command)
    try:
        yield painter
    finally:
        painter.end()
