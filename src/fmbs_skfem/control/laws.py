r"""Laws of controllers in numbers: kernels that runs call as functions of Python, and that are
printed for models in C.

    u = kernel(numbers, values, memory)

`numbers` (p,) are those of the law, `values` (r,) what it reads at a sample instant, `memory` (k,)
what it keeps from one to the next; u is in SI units.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ..core.compiling.jit import jit
from ..core.storage.container import storable
from ..core.storage.records import dataclass


@jit
def pid(numbers: np.ndarray, values: np.ndarray, memory: np.ndarray) -> float:
    """u of a `PidLaw`."""
    kp, ki, kd = numbers[0], numbers[1], numbers[2]
    low, high, sample = numbers[3], numbers[4], numbers[5]
    error = values[0]
    last = memory[1]
    change = 0.0
    if len(values) > 1:
        change = values[1]
    elif last == last:
        # nan before the first sample
        change = (error - last) / sample
    summed = memory[0] + ki * sample * error
    u = kp * error + summed + kd * change
    # nan stays what it is
    found = low if u < low else high if u > high else u
    if u == found or (u > found) != (ki * error > 0.0):
        memory[0] = summed
    memory[1] = error
    return found


@jit
def feedback(numbers: np.ndarray, values: np.ndarray, memory: np.ndarray) -> float:
    """u of a `FeedbackLaw`."""
    low, high = numbers[1], numbers[2]
    total = 0.0
    for k in range(len(values)):
        total += numbers[3 + k] * values[k]
    u = numbers[0] - total
    return low if u < low else high if u > high else u


@jit
def measurement(numbers: np.ndarray, values: np.ndarray, memory: np.ndarray) -> float:
    """u of a `MeasurementLaw`."""
    return values[0]


@jit
def table(numbers: np.ndarray, values: np.ndarray, memory: np.ndarray) -> float:
    """u of a `TableLaw`."""
    n = len(numbers) // 2
    x = values[0]
    if x <= numbers[0]:
        return numbers[n]
    if x >= numbers[n - 1]:
        return numbers[2 * n - 1]
    low = 0
    high = n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x < numbers[middle]:
            high = middle
        else:
            low = middle
    slope = (numbers[n + low + 1] - numbers[n + low]) / (numbers[low + 1] - numbers[low])
    return numbers[n + low] + slope * (x - numbers[low])


@dataclass(frozen=True)
class NumberLaw(ABC):
    """A law of numbers: a call of t [s], the values that are read (r,) and the memory (k,), which it
    changes.
    """

    kernel: ClassVar[Any]  #: see the module

    @property
    @abstractmethod
    def memory(self) -> Sequence[float]:
        """What it keeps, at the start."""

    @abstractmethod
    def listed(self) -> Sequence[float]:
        """Its numbers (p,) in the order in which the kernel reads them."""

    @cached_property
    def numbers(self) -> list[float]:
        """The same, found once."""
        return list(map(float, self.listed()))

    @cached_property
    def run(self) -> Callable[..., float]:
        """The kernel as a function of Python: beside a step of compiled code it costs a microsecond,
        and a wrapper would load numba.
        """
        found: Callable[..., float] = getattr(type(self).kernel, "py_func", type(self).kernel)
        return found

    def __call__(self, t: float, values: Sequence[float], memory: list[float]) -> float:
        return float(self.run(self.numbers, values, memory))


@storable
@dataclass(frozen=True)
class PidLaw(NumberLaw):
    """The rule of `Pid`; its memory are the integral and the last error, nan before the first.

        u = kp e + I + kd e',    I = sum_k ki T e_k,    e' = (e_k - e_k-1) / T

    values = (e,) or (e, e'); e' is 0 at the first sample where it is not read.
    """

    kp: float
    ki: float
    kd: float
    low: float
    high: float
    sample: float
    memory: tuple[float, ...] = (0.0, float("nan"))
    kernel = pid

    def listed(self) -> Sequence[float]:
        return self.kp, self.ki, self.kd, self.low, self.high, self.sample


@storable
@dataclass(frozen=True)
class FeedbackLaw(NumberLaw):
    """The rule of `StateFeedback`.

        u = limited(u0 - sum_i K_i x_i)

    all in SI units.
    """

    offset: float
    gains: tuple[float, ...]
    low: float
    high: float
    memory: tuple[float, ...] = ()
    kernel = feedback

    def listed(self) -> Sequence[float]:
        return self.offset, self.low, self.high, *self.gains


@storable
@dataclass(frozen=True)
class MeasurementLaw(NumberLaw):
    """The rule of `Measurement`: what is read."""

    memory: tuple[float, ...] = ()
    kernel = measurement

    def listed(self) -> Sequence[float]:
        return ()


@storable
@dataclass(frozen=True)
class TableLaw(NumberLaw):
    """The rule of `LookupTable`.

    u(x) by straight lines, u[0] below x[0] and u[-1] above x[-1].
    """

    x: np.ndarray  #: (s,)
    u: np.ndarray  #: (s,)
    memory: tuple[float, ...] = ()
    kernel = table

    def listed(self) -> Sequence[float]:
        return *self.x.tolist(), *self.u.tolist()
