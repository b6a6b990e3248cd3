"""How far a run of a reduced model leaves its training: a longer duration, another step, values outside of the ranges.

A basis holds the states of the full runs that it was made of. What a reduced model does beyond them may look as sound as before,
and be far from the full model; its predicted error is that of the training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..core.errors import InputError, say
from ..core.notices import notify
from . import cases
from .cases import Case
from .validation import STEPS

ROUND = 1e-9  #: relative difference of times that is round-off


def at_times(
    trained: Case, duration: float | None, step: float | None, where: str, beyond: Sequence[str] = ()
) -> tuple[Case, list[str]]:
    """A trained case with another duration or step [s], None for its own, and in words where it leaves the training.

    A shorter run does not. A notice lists these places behind those in `beyond`, which are known already.
    """
    step = trained.scheme.step if step is None else step
    duration = trained.duration if duration is None else duration
    if not 0 < step <= duration <= STEPS * step:
        raise InputError(say(where, f"a positive step, and a duration of 1 to {STEPS} of them", f"{step} s and {duration} s"))
    found = [*beyond]
    if duration > trained.duration * (1.0 + ROUND):
        found.append(f"runs for {duration:g} s, trained for {trained.duration:g} s")
    if abs(step - trained.scheme.step) > ROUND * trained.scheme.step:
        found.append(f"a step of {step:g} s, trained with {trained.scheme.step:g} s")
    if found:
        notify(f"the reduced model runs outside its training: {'; '.join(found)}; check its error against a full run")
    return cases.with_step(replace(trained, duration=duration), step), found
