"""Times of a scene as numbers of steps: states that are kept and states that are snapshots."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core.errors import InputError, say
from .field_kinds import Spans

STEPS = 10_000_000  #: most steps of an analysis
NEAR = 1e-6  #: difference from a whole number of steps, relative to the time, that is round-off


def count_steps(time: float, step: float) -> int | None:
    """The number of steps that a time lasts; None where it is not a whole number of them."""
    count = round(min(time / step, 1.0 / NEAR**2))
    return count if count >= 1 and abs(count * step - time) <= NEAR * time else None


def numbers(spans: Spans, step: float, duration: float) -> np.ndarray:
    """Numbers of the steps, 0 first, at which spans of time ask for a state; the last span lasts to
    the end.
    """
    end = round(duration / step)
    parts = [np.zeros(1, np.int64)]
    begin = 0
    for k, span in enumerate(spans):
        stride = count_steps(span.every, step)
        if stride is None:
            raise InputError(
                say("every", f"a multiple of the step {step:g} s", f"{span.every:g} s")
            )
        until = (
            end if span.until is None or k == len(spans) - 1 else min(end, round(span.until / step))
        )
        parts.append(np.arange(begin + stride, until + 1, stride))
        begin = max(begin, until)
    return np.concatenate(parts)


def instants(spans: Spans, step: float, duration: float) -> np.ndarray | None:
    """Times (s,) [s], 0 first, at which spans of time ask for a state, and the end; None where all
    are whole numbers of steps.
    """
    counted = [time for span in spans for time in (span.every, span.until) if time is not None]
    if all(count_steps(time, step) is not None for time in counted):
        return None
    parts = [np.array([0.0])]
    begin = 0.0
    for k, span in enumerate(spans):
        until = duration if span.until is None or k == len(spans) - 1 else min(duration, span.until)
        count = int((until - begin) / span.every * (1.0 + NEAR))
        parts.append(begin + span.every * np.arange(1.0, count + 1.0))
        begin = max(begin, until)
    found = np.concatenate(parts)
    return np.append(found[found < duration * (1.0 - NEAR)], duration)


def kept(every: int | Spans, step: float, duration: float) -> int | np.ndarray:
    """What `dynamics.integrate` takes as `every`; with spans the last step is always kept."""
    return (
        every
        if isinstance(every, int)
        else np.union1d(numbers(every, step, duration), round(duration / step))
    )


def fit(step: float, duration: float, counted: Iterable[float] = ()) -> float:
    """The largest step, not above `step`, that divides a duration; `step` itself where it would not
    divide the times `counted`.
    """
    found = duration / np.ceil(duration / step * (1.0 - NEAR))
    if count_steps(duration, step) is not None or any(
        count_steps(time, found) is None for time in counted
    ):
        return step
    return float(found)


def snapshots(interval: float | Spans, step: float, duration: float) -> np.ndarray:
    """Numbers of the steps, 0 first, whose states are snapshots."""
    if not isinstance(interval, tuple):
        stride = count_steps(interval, step)
        if stride is None:
            raise InputError(
                say("reduction.snapshots", f"a multiple of the step {step:g} s", f"{interval:g} s")
            )
        return np.arange(0, round(duration / step) + 1, stride)
    return numbers(interval, step, duration)
