"""Speed against error: which models are on the Pareto front.

    a is beaten by b  <=>  cpu_b <= cpu_a and error_b <= error_a, one of them strictly

The front holds the models that nobody beats. The honest competitors of a reduced model are coarser
meshes and larger steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..core.errors import InputError, say
from ..core.storage.records import dataclass

#: families that are full models: the reference, coarser meshes, larger steps, what accuracies
#: choose
FULL = frozenset({"full", "coarse", "step", "chosen"})


@dataclass(frozen=True)
class Point:
    """One model in the plane of cost and error; a failed run has a NaN or infinite error."""

    name: str
    family: str  #: "full", "coarse", "step", "system", "component", "component+ecsw", ...
    cpu_s: float  #: CPU time of the run without training [s]
    error: float  #: against the reference, >= 0

    def __post_init__(self) -> None:
        if not self.cpu_s > 0 or math.isinf(self.cpu_s):
            raise InputError(say(f"speed: model '{self.name}'", "a CPU time above 0 s", self.cpu_s))
        if self.error < 0:
            raise InputError(
                say(f"speed: model '{self.name}'", "an error of at least 0", self.error)
            )


def front(points: Iterable[Point]) -> tuple[Point, ...]:
    """The models that no other beats, fastest first; of equal ones the first; failed runs are never
    among them.
    """
    best: list[Point] = []
    for point in sorted(
        (p for p in points if math.isfinite(p.error)), key=lambda p: (p.cpu_s, p.error)
    ):
        if not best or point.error < best[-1].error:
            best.append(point)
    return tuple(best)


def cheapest(points: Iterable[Point], error: float) -> Point | None:
    """The fastest of the models that err by no more than `error`, of equal ones the most exact;
    None where there is none.
    """
    good = (point for point in points if point.error <= error)
    return min(good, key=lambda point: (point.cpu_s, point.error), default=None)


def accuracy(point: Point) -> str:
    """The error as text; no error at all is the reference itself."""
    return f"error {point.error:.1e}" if point.error > 0 else "the reference"


def front_in_words(points: Iterable[Point]) -> str:
    """Who is on the Pareto front, fastest first, how many of them are reduced models, and what
    failed.
    """
    everyone = tuple(points)
    best = front(everyone)
    if not best:
        return "No model finished, so there is no Pareto front."
    reduced = [point for point in best if point.family not in FULL]
    who = ", ".join(f"{point.name} ({point.cpu_s:.2g} s, {accuracy(point)})" for point in best)
    share = (
        "none of them reduced"
        if not reduced
        else "all of them reduced"
        if len(reduced) == len(best)
        else f"{len(reduced)} of them reduced"
    )
    verb = "is" if len(best) == 1 else "are"
    text = f"Of {len(everyone)} models {len(best)} {verb} on the Pareto front, {share}; fastest first: {who}."
    if reduced:
        errors_ = [point.error for point in reduced]
        text += (
            f" Reduced models are on it at errors from {min(errors_):.1e} to {max(errors_):.1e}."
        )
    failed = [point.name for point in everyone if not math.isfinite(point.error)]
    return text + (f" Failed: {', '.join(failed)}." if failed else "")
