"""Steps that are taken one by one, over one packed struct: at a few microseconds beside the
compiled step.

Histories are tabulated ahead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.compiling.structs import Routine
from ...systems.system import System, driven_rows
from ..histories import leading_signals
from ..observers import HistorySource, Looks
from ..scheme import GeneralizedAlpha

if TYPE_CHECKING:
    from ..run import OpenRun

# two histories cost 1.7 us a step, 3.1 at half and 0.9 at twice of it, 6.1 us with 16
AHEAD = 64  #: steps for which functions of time are tabulated at once


class SingleSteps(HistorySource):
    """Takes steps of a run, one at a time, with histories that are known ahead."""

    looks: Looks = "end"
    reads_states = False

    def __init__(self, plain: System, scheme: GeneralizedAlpha) -> None:
        self.plain = self.system = plain
        self.scheme = scheme
        self.ahead = np.zeros((0, 0))
        self.first = 0
        # one memory for the row of all steps, whose address the packed step holds
        self.row = np.zeros(
            (1, len(plain.signals) * (4 if driven_rows(plain.constraints).any() else 1))
        )
        # likewise the row of the trajectory: a step one by one costs some 2.5 us beside the
        # compiled one, and 14 us with an observer for 290 us without this struct
        self.stored = np.array([-1])

    def take(self, run: OpenRun) -> int:
        # inputs may have changed since the last step, so that the row is written anew for each
        self.fill(run.done)
        self.stored[0] = run.row(run.done + 1)
        return run.packed.advance(self.row, self.stored, self.scheme.step * run.done)

    def recorded(self) -> System:
        return self.system

    def fill(self, number: int) -> None:
        """The row of signals at the end of a step."""
        # an empty table, read in every step, would cost more than the rest of this
        if self.row.size:
            self.row[0] = self.tabulated(number)

    def tabulated(self, number: int) -> np.ndarray:
        """Signals at the end of a step; inputs are at their start."""
        k = number - self.first
        if not 0 <= k < len(self.ahead):
            h = self.scheme.step
            self.ahead, broken = leading_signals(self.plain, h * (number + 1 + np.arange(AHEAD)), h)
            self.first = number
            k = 0
            # a history that is no number at a later step of the table stops the run when that step
            # comes
            if broken is not None and not len(self.ahead):
                raise broken
        return self.ahead[k]

    def call(self, run: OpenRun, routine: Routine) -> int:
        """Call a routine of steps on the run."""
        run.packed.give(self.row, self.stored)
        return run.packed.call(routine)


def one_row(system: System, scheme: GeneralizedAlpha, number: float) -> np.ndarray:
    """Signals after so many steps."""
    table, broken = leading_signals(system, np.array([scheme.step * number]), scheme.step)
    if broken is not None:
        raise broken
    return np.asarray(table[0])
