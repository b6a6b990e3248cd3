"""The first run compiles: a process beside it compiles what that run needs last, the end of its
time step first.

    python -m fmbs_skfem.studies.running.compiling [reduction]        ends with its input, which is its parent's end

The parent compiles from the beginning of a step meanwhile; each finds in the cache what the other
has compiled.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...core.compiling import jit
from ...core.compiling.machine_code import SUFFIX

if TYPE_CHECKING:
    from ..job import Job

#: processes that end with this one, whose end of their input they see
_BESIDE: list[subprocess.Popen[bytes]] = []


def announce(job: Job, reduces: bool = False) -> bool:
    """Whether no compiled step is cached; then the first run compiles, which is said.

    What it needs last, and what reductions need, is compiled by a process beside it, one for all
    runs that begin meanwhile. Each function is compiled by one process (`jit.alone`), the others
    wait for it.
    """
    folder = jit.cache_folder()
    new = folder is None or cold(folder)
    if new:
        job.hear_compilation("the time step")
    if new and folder is not None and first(folder):
        command = [sys.executable, "-P", "-m", __name__, *(["reduction"] if reduces else [])]
        nowhere = subprocess.DEVNULL
        _BESIDE.append(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere)
        )
    return new


def cold(folder: Path) -> bool:
    """Whether no compiled step is cached in a folder."""
    return not any(folder.glob(f"stepping.advance-*{SUFFIX}"))


def first(folder: Path) -> bool:
    """Whether no other process has begun to compile into the folder."""
    with contextlib.suppress(OSError):
        (folder / "begun").touch(exist_ok=False)
        return True
    return False


def compile_from_the_end(reduces: bool) -> None:
    """Compile routines from the last to the first, in a process that ends with its parent."""
    from ...dynamics.compiled_step import factors, stepping
    from ...reduction.accuracy import costs
    from ...reduction.hyper import ecsw
    from ...systems import evaluation, work
    from ...systems.layouts import Storage
    from ...systems.terms import points

    threading.Thread(target=end_with_parent, daemon=True).start()
    factorise, solve, apply = factors.doors(Storage.BAND)
    #: what a run asks for before its first step, when all of the step is compiled
    first = (
        evaluation.take_over,
        work.forces,
    )
    steps = stepping.advance, stepping.take
    for one in (
        *steps,
        work.survey,
        solve,
        apply,
        *first,
        factors.assemble,
        factorise,
        evaluation.residuals,
    ):
        int(one.address)
    if reduces:
        ecsw.weights_from_gram(ecsw.gram(np.ones((1, 1))), 0.5)
        ecsw.weights(np.eye(2), 0.5)
        for more in (*factors.doors(Storage.DENSE), *points.ROUTINES[:3], costs.repeat_calls):
            int(more.address)


def end_with_parent() -> None:
    """Wait for the end of the input, and end."""
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    compile_from_the_end("reduction" in sys.argv[1:])
