"""A live run beside another one that says how good it is: with finer parts (`finer_parts`), or with
steps twice as long.

    e = |y_h - y_2h| / (2^p - 1),    the error of the outputs by a step h, p = 2, or 1 where inputs are held in steps          (1)

A held input counts from the middle of its step on, half a step after it was given: an error of
first order. Outputs are read at FEW to 2 FEW instants of both runs, and compared when their number
has doubled. Inputs that are a feedback of outputs hold an unstable plant in one run alone: where
linear equations about the present state grow, nothing is said. In a step of 2 h held inputs have
their mean, those that drive joints their last value.

Source of (1): E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
Springer 1993, II.4 (extrapolation).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..core.errors import FmbsError
from ..core.notices import CoarseStep, notify, remark
from ..dynamics import output_errors, trajectory
from ..dynamics.measuring import motion_of
from ..dynamics.near_state.linear import linearise
from ..dynamics.near_state.modes import complex_modes
from ..dynamics.observers import Texts
from ..dynamics.trajectory import Trajectory
from ..parts import finer_parts
from .feed import Feed

if TYPE_CHECKING:
    from ..dynamics.run import OpenRun

FEW = 100  #: instants that are read at least
GROWS = 1.0  #: growth of linear motions over the time of the run, from which feedback is taken to hold them
TWICE = 2  #: steps of a run that are one of the run beside it
SMALLER = "find it by runs with smaller steps"

#: what a motion and the reference beside it show, under inputs from outside or none: warnings, none
#: where they agree
Verdict = Callable[[Trajectory, Trajectory, bool], Texts]


class Other(NamedTuple):
    """The other run, and how it takes a step with inputs by name."""

    run: OpenRun
    step: Callable[[Mapping[str, float]], object]


class Beside:
    """The other run, and what both have shown.

    Outputs are compared when 200 instants are known, of which every other one stays. Once they are
    apart, or its step fails, the other run ends.
    """

    def __init__(
        self, other: Other, verdict: Verdict, what: str, remedy: str, stride: int = 1
    ) -> None:
        self.other: Other | None = other
        self.verdict, self.what, self.remedy, self.stride = verdict, what, remedy, stride
        self.seen: list[tuple[Trajectory, Trajectory]] = []
        #: inputs of the steps since the last one of the other run
        self.given: list[dict[str, float]] = []
        self.every = stride
        self.fed = False

    def step(self, run: OpenRun, inputs: Mapping[str, float]) -> None:
        """The step that a run has taken with its inputs; a warning where the outputs of both are
        apart.
        """
        if self.other is None:
            return
        self.fed |= bool(inputs)
        feed = run.find(Feed)
        self.given.append({name: feed.given[name].values[-1] for name in feed.free})
        if len(self.given) < self.stride:
            return
        told = {
            name: last if feed.given[name].smooth else self.mean(name)
            for name, last in self.given[-1].items()
        }
        self.given = []
        try:
            with finer_parts.quietly():
                self.other.step(told)
        except FmbsError as error:
            self.other = None
            ended = f"the run beside {self.what} ends ({str(error).partition(';')[0]})"
            remark(f"{ended}: nothing more can be said of it; {self.remedy}")
            return
        if run.done % self.every == 0:
            other = self.other.run
            self.seen.append((motion_of(run, run.time), motion_of(other, other.time)))
            if len(self.seen) == 2 * FEW:
                self.compare(run)
                self.seen = self.seen[1::2]
                self.every = 2 * self.every

    def mean(self, name: str) -> float:
        """Of an input over the steps that are one of the other run."""
        return float(np.mean([one[name] for one in self.given]))

    def compare(self, run: OpenRun) -> None:
        """Warn once where outputs are apart."""
        motion, reference = (
            reduce(trajectory.joined, states) for states in zip(*self.seen, strict=True)
        )
        if not (found := list(self.verdict(motion, reference, self.fed))):
            return
        self.other = None
        if self.fed and growth(run) * run.time > GROWS:
            why = f"the run beside {self.what} has no feedback of its own and is unstable"
            remark(f"the error of {self.what} is unknown: {why}; {self.remedy}")
        else:
            notify(*found)


def parts_beside(other: Other) -> Beside:
    """A run with finer parts."""

    def verdict(motion: Trajectory, reference: Trajectory, fed: bool) -> Texts:
        return finer_parts.find_doubts(finer_parts.errors(reference, motion), motion)

    return Beside(other, verdict, "parts", finer_parts.HOLD)


def step_beside(other: Other, accuracy: Mapping[str, float] | float) -> Beside:
    """A run with steps twice as long, for errors that outputs may have: parts of their ranges so
    far, of all or by output.
    """

    def verdict(motion: Trajectory, reference: Trajectory, fed: bool) -> Texts:
        found = output_errors.between(
            output_errors.columns(motion), output_errors.columns(reference), motion.system.outputs
        )
        part = 1.0 if fed else 1.0 / 3.0  # (1)
        step = other.run.scheme.step / TWICE
        over = {
            column: part * one.relative / wanted
            for column, one in found.items()
            if (wanted := bound(accuracy, one.output))
        }
        worst = max(over, key=lambda column: over[column], default="")
        if not over.get(worst, 0.0) > 1.0:
            return
        text = f"the step of {step:g} s errs by {part * found[worst].relative:.2g} of the range of {worst} so far"
        yield CoarseStep(f"{text}, {over[worst]:.2g} times what is wanted; take a smaller step")

    return Beside(other, verdict, "the step", SMALLER, TWICE)


def bound(accuracy: Mapping[str, float] | float, output: str) -> float | None:
    """What is wanted of an output."""
    return accuracy.get(output) if isinstance(accuracy, Mapping) else accuracy


def growth(run: OpenRun) -> float:
    """Largest growth [1/s] of linear motions about the present state.

        max Re s

    of all their eigenvalues s.
    """
    now = motion_of(run, run.time)
    linear = linearise(now.system, now.x[0], now.multipliers[0], run.time)
    return float(complex_modes(linear, len(linear.x)).eigenvalues.real.max(initial=0.0))
