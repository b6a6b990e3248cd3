"""Inputs: numbers by name that a run is given from step to step, held at their start where it is
given none.

torque: "u - 0.1 N m s * hinge.rate"            u(t) = u_n+1 in the step from t_n to t_n+1
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import field

import numpy as np

from ..storage.container import storable
from ..storage.records import dataclass

ROUND = 1e-9  #: part of a step by which its end may be missed


@dataclass(frozen=True)
class Source(ABC):
    """A function of time that expressions know by a name, or one of anything that they call."""

    name: str
    unit: str = ""  #: SI unit

    @property
    def call(self) -> str:
        """How programs call it as a function of anything, `goal()`; empty where they cannot."""
        return ""

    @property
    def units_of_call(self) -> tuple[str, str]:
        """SI units of the argument of such a call, and of its value."""
        return "s", self.unit

    @abstractmethod
    def __call__(self, t: np.ndarray) -> np.ndarray:
        """Its values at times (s,) [s]."""


def calls_of(sources: Iterable[Source]) -> dict[str, tuple[str, str]]:
    """Units of the argument and of the value of what can be called."""
    return {one.call: one.units_of_call for one in sources if one.call}


def timed(sources: Iterable[Source]) -> dict[str, str]:
    """Units of what is a function of time, by name."""
    return {one.name: one.unit for one in sources if one.units_of_call[0] == "s"}


@storable
@dataclass(frozen=True)
class Input(Source):
    """A number that a run is given; as a function of time it is its start."""

    start: float = 0.0
    #: low and high, within which trainings of reduced models excite it; None where nothing is said
    range: tuple[float, float] | None = field(default=None, kw_only=True)

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return np.full(np.shape(t), self.start)


@storable
@dataclass(frozen=True)
class Held(Input):
    """A number that is read of the state when an event happens, and holds from then on."""


PAST = 4  #: values through which a smooth input goes
#: that are read of steps that are taken one by one: those of its begin are values of the step
#: before
KEPT = PAST + 1


@dataclass(eq=False)
class GivenInput:
    """Values of an input at the end of every step; before the first value it was that one."""

    step: float  #: h [s]
    values: list[float]  #: (s,) after `first` steps, and after one more each
    first: int = 0
    smooth: bool = False  #: whether it is the cubic through the last four values, for drives, and not the last one alone
    controller: str = ""  #: that gave them

    def __call__(self, t: np.ndarray) -> np.ndarray:
        values = np.asarray(self.values)
        place = np.asarray(t) / self.step
        n = np.ceil(place - ROUND).astype(np.int64)
        if not self.smooth:
            return np.asarray(values[np.clip(n - self.first, 0, len(values) - 1)])
        s = place - n
        found = np.zeros(np.shape(t))
        for k in range(PAST):
            weight = np.prod([(s + j) / (j - k) for j in range(PAST) if j != k], axis=0)
            found = found + weight * values[np.clip(n - k - self.first, 0, len(values) - 1)]
        return found
