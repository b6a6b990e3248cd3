r"""Whether a reduced model can be worth its training: known from the first full runs, before
anything is sampled or searched for.

    gain = t_full / t_reduced of one instance;    it does not pay where gain < FAST, or where r > LARGEST n

Models only grow: the one that a training ends with has at least as many modes r as that of its
first full run, and where a run is not followed as many as one that knows it. So a model that is no
faster, or a basis that is too large beside the n coordinates of the full model, ends a training
long before its end. Seconds decide, since they are what is saved; the fastest of some runs of
either count, as the first one of a process loads what the others find.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.errors import NoModel, SolverError
from ..reduction import full_runs, reduced_models
from ..reduction.accuracy.costs import FAST
from ..reduction.accuracy.runs import PATIENCE
from ..reduction.cases import Case
from ..reduction.full_runs import FullRun, TrainingTask
from ..reduction.reduced_models import Bases

LARGEST = 0.5  #: modes over coordinates of the full model, whose matrices are sparse: from there on a model is at most as fast
# gains of 1.05 (spin-up), 1.1 (double pendulum), 1.4 (four-bar), 1.7 (shell of 147 coordinates) at
# half of them
REPEAT = 3  #: runs of either model of which the fastest counts, as long as the reduced one is not surely faster
# a frame in torsion over two parameters: 31 modes and a gain of 1.8 by one full run, 51 and 1.2 by
# four, 53 and 1.1 by six; eps, which is lowered where proofs fail, makes a model of three runs
# another 1.4 to 1.6 times slower
SURELY = 4.0  #: gain of the model of one full run, from which those of several pay
GROWTH = 1.5  #: gain of the model of three far runs over that of the one that a training ends with, at least


class DoesNotPay(NoModel):
    """No reduced model of the wanted error is faster than the full one; seconds of a run of both,
    NaN where there is none.
    """

    def __init__(self, reason: str, full_s: float, run_s: float = math.nan) -> None:
        super().__init__(f"does not pay: {reason}")
        self.reason, self.full_s, self.run_s = reason, full_s, run_s


def coordinates(run: FullRun) -> int:
    """Coordinates of all components of the full model."""
    return sum(len(factor.modes) for factor in run.factors.values())


def count_modes(bases: Bases) -> int:
    """Modes of all components."""
    return sum(basis.modes.shape[1] for basis in bases.values())


def require_small(task: TrainingTask, runs: Sequence[FullRun]) -> None:
    """DoesNotPay where the basis of some runs has too many modes: their singular values say so
    without any reduced run.
    """
    found = reduced_models.bases(task, task.family(runs[0].values).system, runs)
    modes = count_modes(found)
    full = coordinates(runs[0])
    if modes > LARGEST * full:
        many = f"{len(runs)} full runs" if len(runs) > 1 else "one full run"
        reason = f"the wanted error takes {modes} modes for {many}, where the full model has {full} coordinates"
        raise DoesNotPay(reason, float(np.mean([run.cpu_s for run in runs])))


def require_gain(full_s: float, run_s: float, least: float = FAST) -> None:
    """DoesNotPay where a reduced run takes nearly as long as the full one; `least` is larger where
    models still grow.
    """
    if full_s < least * run_s:
        gain = f"{full_s / run_s:.3g} times as fast as the full model"
        raise DoesNotPay(
            gain if full_s < FAST * run_s else f"{gain}, and slower with more full runs",
            full_s,
            run_s,
        )


def require_fast(
    task: TrainingTask, run: FullRun, reduced: Case, least: float = FAST, run_s: float = math.inf
) -> tuple[float, float]:
    """Seconds of the full model at a run of it, in its own tolerance, and of the reduced case
    there.

    DoesNotPay where the gain is below `least`. The fastest of some runs of either count, until it
    is not: what else a computer does makes runs slower by halves, and the first one of a process
    loads what the others find. A reduced run that fails takes no time. One that took `run_s` is not
    repeated where that is SURELY fast.
    """
    if run.cpu_s >= SURELY * run_s:
        return run.cpu_s, run_s
    case = task.family(run.values)
    full_s = run.cpu_s
    full = replace(case, system=task.form(case.system)) if full_s <= PATIENCE else None
    for _ in range(REPEAT):
        try:
            run_s = min(run_s, full_runs.run_formed(task, reduced).statistics.cpu_s)
        except SolverError:  # asks for others
            return full_s, 0.0
        if full is not None:
            full_s = min(full_s, full_runs.run_formed(task, full).statistics.cpu_s)
        if full is None or full_s >= least * run_s:
            break
    require_gain(full_s, run_s, least)
    return full_s, run_s
