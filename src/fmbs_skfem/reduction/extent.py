"""How far a run of a reduced model leaves its training: a longer duration, another step, values outside of the ranges.

A basis holds the states of the full runs that it was made of. What a reduced model does beyond them may look as sound as before,
and be far from the full model; its predicted error is that of the training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..core.errors import InputError, say
from ..core.notices import notify
from .cases import Case
from .validation import STEPS

ROUND = 1e-9  #: relative difference of times that is round-off


def timed(case: Case, duration: float | None, step: float | None, where: str) -> Case:
    """The case with another duration or step [s]; None keeps its own."""
    step = case.scheme.step if step is None else step
    duration = case.duration if duration is None else duration
    if not 0 < step <= duration <= STEPS * step:
        raise InputError(say(where, f"a positive step, and a duration of 1 to {STEPS} of them", f"{step} s and {duration} s"))
    return replace(case, duration=duration, scheme=replace(case.scheme, step=step))


def departures(trained: Case, case: Case) -> list[str]:
    """Where the times of a case leave those of the training, as texts; a shorter run does not."""
    found = []
    if case.duration > trained.duration * (1.0 + ROUND):
        found.append(f"runs for {case.duration:g} s, trained for {trained.duration:g} s")
    if abs(case.scheme.step - trained.scheme.step) > ROUND * trained.scheme.step:
        found.append(f"a step of {case.scheme.step:g} s, trained with {trained.scheme.step:g} s")
    return found


def warn(found: Sequence[str]) -> None:
    """A notice of departures from the training."""
    if found:
        notify(f"the reduced model runs outside its training: {'; '.join(found)}; check its error against a full run")
