"""Clocks that tests wind themselves: what they say depends on no machine, timer or load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from fmbs_skfem.dynamics.compiled_step import factors
from fmbs_skfem.dynamics.compiled_step.large import Large
from fmbs_skfem.reduction.accuracy import costs
from fmbs_skfem.systems import evaluation
from fmbs_skfem.systems.layouts import Storage

#: seconds that one call of a piece of the time step is said to take
PRICES = {"force": 400.0, "tangent": 1000.0, "product": 1.0, "factor": 3000.0, "solution": 7.0}


@dataclass
class Clock:
    """Stands in for the module `time`: every look at it takes `tick` seconds; work takes what is
    added to `now`.
    """

    tick: float = 1.0
    now: float = 0.0  #: [s]

    def process_time(self) -> float:
        self.now += self.tick
        return self.now

    perf_counter = monotonic = thread_time = process_time


def wind(patch: pytest.MonkeyPatch, *modules: Any, tick: float = 1.0) -> Clock:
    """One clock for modules that read theirs as `clock`."""
    clock = Clock(tick)
    for module in modules:
        patch.setattr(module, "clock", clock)
    return clock


def set_prices(patch: pytest.MonkeyPatch) -> None:
    """Calls that `reduction.accuracy.costs` measures take the seconds of PRICES."""
    clock, spent, burst, repeat_calls = (
        wind(patch, costs, tick=0.0),
        [0.0],
        costs.Burst,
        costs.repeat_calls,
    )
    prices = {
        evaluation.elastic_forces.address: PRICES["force"],
        evaluation.sum_tangents.address: PRICES["tangent"],
    }
    for form in Storage:
        factorise, solve, _ = factors.doors(form)
        prices |= {factorise.address: PRICES["factor"], solve.address: PRICES["solution"]}

    def priced(step: Any, routine: int, more: int, times: int) -> costs.Burst:
        spent[0] = times * prices.get(routine, PRICES["product"])
        return burst(step, routine, more, times)

    def repeated(table: Any) -> None:
        repeat_calls(table)
        clock.now += spent[0]

    class PricedLarge(Large):
        def factorise(self, *given: Any) -> Any:
            clock.now += PRICES["factor"]
            return super().factorise(*given)

        def solve(self, *given: Any) -> Any:
            clock.now += PRICES["solution"]
            return super().solve(*given)

    patch.setattr(costs, "Burst", priced)
    patch.setattr(costs, "repeat_calls", repeated)
    patch.setattr(costs, "Large", PricedLarge)
