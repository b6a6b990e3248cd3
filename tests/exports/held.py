"""Inputs that are held over steps, in Python: set by a controller at the begin of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fmbs_skfem.control.controllers import Controlled
from fmbs_skfem.systems import System, signals


@dataclass(frozen=True)
class Told:
    """A law of a controller that reads nothing but the time."""

    value: Callable[[float], float]
    memory: tuple[float, ...] = ()

    def __call__(self, t: float, reads: Sequence[float], memory: list[float]) -> float:
        return self.value(t)


def held(system: System, step: float, inputs: Mapping[str, Callable[[float], float]]) -> System:
    """The system with inputs that are functions of the begin of a step [s]."""
    known = signals.inputs_of(system)
    return signals.with_inputs(
        system,
        {
            name: Controlled(
                name, known[name].unit, known[name].start, sample=step, law=Told(value)
            )
            for name, value in inputs.items()
        },
    )
