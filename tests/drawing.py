"""Pictures by forks of one process that has loaded VTK, which takes most of the time of a small picture.

A fork draws, prints and ends as a process of its own does; what is drawn in another environment, or by another program, gets one.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmbs_skfem.results import pictures

RUN, PYTHON = subprocess.run, sys.executable  #: before any test has others in their place
ROOT = Path(__file__).resolve().parents[1]
PASSING = "PYTEST_CURRENT_TEST"  #: of the environment, which changes with every test


class Drawing:
    """In the place of `subprocess` in `pictures`."""

    DEVNULL, TimeoutExpired = subprocess.DEVNULL, subprocess.TimeoutExpired

    def __init__(self) -> None:
        self.environment, self.lock = known(os.environ), threading.Lock()
        self.process: subprocess.Popen[str] | None = None

    def run(self, call: Sequence[str], **options: Any) -> subprocess.CompletedProcess[str]:
        """As `subprocess.run` of a call of the module that draws."""
        interpreter, *words = call
        usual = interpreter == PYTHON and words[:2] == ["-m", "fmbs_skfem.results.render_child"]
        if not usual or subprocess.run is not RUN or known(os.environ) != self.environment:
            return subprocess.run(call, **options)  # type: ignore[call-overload, no-any-return]
        with self.lock:
            if self.process is None:
                own = [PYTHON, "-m", "tests.drawing"]
                self.process = subprocess.Popen(own, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            assert self.process.stdin is not None
            assert self.process.stdout is not None
            said = Path(words[2], "said.txt")
            self.process.stdin.write(json.dumps([str(said), *words[2:]]) + "\n")
            self.process.stdin.flush()
            code = int(self.process.stdout.readline())
        return subprocess.CompletedProcess(list(call), code, "", said.read_text(errors="replace"))

    def end(self) -> None:
        """Let the process go, if there is one."""
        if self.process is not None:
            self.process.communicate()


def known(environment: Any) -> dict[str, str]:
    return {name: value for name, value in environment.items() if name != PASSING}


def serve() -> None:
    """Draw what the lines of stdin order, each in a fork, and say with which code it ends."""
    from fmbs_skfem.core import imports
    from fmbs_skfem.results import render_child

    imports.prepare()
    import pyvista  # noqa: F401  the forks find it there

    for line in sys.stdin:
        said, *arguments = json.loads(line)
        if (child := os.fork()) == 0:
            draw(render_child.main, said, arguments)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)  # noqa: T201  the answer


def draw(main: Any, said: str, arguments: list[str]) -> None:
    """The fork: its errors go to a file, and it ends where a process of its own would be ended."""
    signal.alarm(int(pictures.TIME_LIMIT))
    os.chdir(arguments[0])
    os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT), 2)
    os.dup2(2, 1)
    code = 1
    try:
        code = main(arguments)
    except BaseException:
        traceback.print_exc()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    serve()
