"""Compile in a process beside a first run what that run needs last, the end of its time step first.

    python -m fmbs_skfem.studies.running.beside [reduction]        ends with its input, which is its parent's end

The parent compiles from the beginning of a step meanwhile; each finds in the cache what the other has compiled.
"""

from __future__ import annotations

import os
import sys
import threading

import numpy as np

from ...dynamics.compiled_step import factors, parts, settling, stepping
from ...reduction.accuracy import costs
from ...reduction.hyper import ecsw
from ...systems import evaluation, work
from ...systems.layouts import Storage
from ...systems.terms import points


def main(reduces: bool) -> None:
    """Compile routines from the last to the first."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    factorise, solve, apply = factors.doors(Storage.BAND)
    first = evaluation.take_over, work.forces  #: what a run asks for before its first step, when all of the step is compiled
    steps = stepping.advance, parts.divide, stepping.take
    for one in (*steps, work.survey, settling.settle, solve, apply, *first, factorise, evaluation.residuals):
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
    main("reduction" in sys.argv[1:])
