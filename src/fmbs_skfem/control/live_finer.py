"""A live run with parts beside one with finer parts, which takes the same steps with the same inputs; see `finer_parts`.

Outputs are read at FEW to 2 FEW instants of the run, and compared when their number has doubled. Inputs that are a feedback of
outputs hold an unstable plant in one run alone: where linear equations about the present state grow, nothing is said.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import TYPE_CHECKING

from ..core.errors import FmbsError
from ..core.notices import remark
from ..dynamics import trajectory
from ..dynamics.measuring import motion_of
from ..dynamics.near_state.linear import linearise
from ..dynamics.near_state.modes import complex_modes
from ..dynamics.output_errors import largest
from ..dynamics.trajectory import Trajectory
from ..parts import departures, finer_parts

if TYPE_CHECKING:
    from .live import LiveRun

FEW = 100  #: instants that are read at least
GROWS = 1.0  #: growth of linear motions over the time of the run, from which feedback is taken to hold them


class Beside:
    """The finer run, and what both have shown.

    Outputs are compared when 200 instants are known, of which every other one stays. Once they are apart, or its step fails, the
    finer run ends.
    """

    def __init__(self, finer: LiveRun) -> None:
        self.finer: LiveRun | None = finer
        self.seen: list[tuple[Trajectory, Trajectory]] = []
        self.every, self.fed = 1, False

    def step(self, run: LiveRun, inputs: Mapping[str, float]) -> None:
        """The step that a run has taken with its inputs; a warning where the outputs of both are apart."""
        if self.finer is None:
            return
        self.fed |= bool(inputs)
        try:
            with finer_parts.quietly():
                self.finer.step(inputs)
        except FmbsError as error:
            self.finer = None
            ended = f"the run beside finer parts ends ({str(error).partition(';')[0]})"
            remark(f"{ended}: nothing more can be said of parts; {finer_parts.HOLD}")
            return
        if run.run.done % self.every == 0:
            self.seen.append((motion_of(run.run, run.time), motion_of(self.finer.run, self.finer.time)))
            if len(self.seen) == 2 * FEW:
                self.compare(run)
                self.seen, self.every = self.seen[1::2], 2 * self.every

    def compare(self, run: LiveRun) -> None:
        """Warn once where outputs are apart."""
        motion, reference = (reduce(trajectory.joined, parts) for parts in zip(*self.seen, strict=True))
        found = finer_parts.errors(reference, motion)
        if largest(found):
            self.finer = None
            if self.fed and growth(run) * run.time > GROWS:
                remark(
                    f"the error of parts is unknown: the run that checks them has no feedback and is unstable; {finer_parts.HOLD}"
                )
            else:
                finer_parts.warn(found, motion, departures.find(motion))


def growth(run: LiveRun) -> float:
    """Largest growth [1/s] of linear motions about the present state."""
    now = motion_of(run.run, run.time)
    linear = linearise(now.system, now.x[0], now.multipliers[0], run.time)
    return float(complex_modes(linear, len(linear.x)).eigenvalues.real.max(initial=0.0))
