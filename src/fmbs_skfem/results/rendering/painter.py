"""The process that draws: it loads VTK, probes whether anything can be drawn, then draws one order
after the other.

Orders are pickles of `PictureJob` on its input, None for the probe alone. A line on its output
answers each: an exit code, 0 for what is drawn, and why it is not. Where VTK finds no OpenGL at
all, a signal ends the process without an answer.
"""

from __future__ import annotations

import contextlib
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path

from ...core import extras
from .job import PictureJob

TIME_LIMIT = 900.0  #: for one picture [s]
_START = "import sys; sys.path.append(sys.argv[1]); from fmbs_skfem.results.rendering import render_child; render_child.main()"
#: the interpreter and what it runs; no module of the user's folder is imported
COMMAND = (sys.executable, "-P", "-c", _START, str(Path(__file__).resolve().parents[3]))


class Painter:
    """A process that draws, started when it is wanted."""

    def __init__(self) -> None:
        self.command = COMMAND
        self.lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def begin(self) -> subprocess.Popen[bytes]:
        """The process, started where there is none; OSError where it cannot be started."""
        if self.process is None or self.process.poll() is not None:
            self.close()
            pipe = subprocess.PIPE
            self.process = subprocess.Popen(
                self.command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL
            )
        return self.process

    def draw(self, job: PictureJob | None) -> tuple[int, str]:
        """Draw an order, or only probe; 0, or the exit code and the reason where there is one.

        TimeoutError where a picture takes too long.
        """
        with self.lock:
            process = self.begin()
            begin = time.monotonic()
            assert process.stdin is not None
            assert process.stdout is not None
            timer = threading.Timer(TIME_LIMIT, process.kill)
            timer.daemon = True
            timer.start()
            try:
                with contextlib.suppress(OSError):  # it has ended
                    process.stdin.write(pickle.dumps(job))
                    process.stdin.flush()
                code, _, reason = (
                    process.stdout.readline().decode(errors="replace").strip().partition(" ")
                )
                found = int(code or process.wait() or 1), reason
            except BaseException:
                process.kill()
                raise
            finally:
                timer.cancel()
            if not code and time.monotonic() - begin >= TIME_LIMIT:
                raise TimeoutError
            return found

    def close(self) -> None:
        """End the process, which may still be loading."""
        if self.process is not None:
            self.process.kill()
            with contextlib.suppress(OSError):  # what was not written to one that has ended
                self.process.communicate()
            self.process = None


AT_HAND: list[Painter] = []  #: the one that draws all pictures now, if there is one


@contextlib.contextmanager
def at_hand(wanted: bool = True) -> Iterator[None]:
    """Where it is `wanted`, one process for all pictures that are drawn inside; it loads VTK while
    other work goes on.
    """
    if not wanted or AT_HAND or extras.missing("viz"):
        yield
        return
    with closing(Painter()) as painter:
        AT_HAND.append(painter)
        try:
            with contextlib.suppress(OSError):  # said where something is drawn
                painter.begin()
            yield
        finally:
            AT_HAND.remove(painter)


def hired() -> AbstractContextManager[Painter]:
    """The process at hand, else one of its own."""
    return nullcontext(AT_HAND[0]) if AT_HAND else closing(Painter())
