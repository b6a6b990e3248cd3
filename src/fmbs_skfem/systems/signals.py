"""Functions of time of a system: cosines and sines of driven angles [rad], and what reads inputs.

s(t) = f(t, u(t))           `bound` gives the function of time that it is with the inputs u as functions of time
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import singledispatch
from typing import Any

import numpy as np

from ..core.errors import InputError, closest, listed, say
from ..core.notices import notify
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values import jets, tables
from ..core.values.expressions import Expression
from ..core.values.inputs import Held, Input
from ..core.values.tables import Table
from . import finer_systems
from .system import Signal, System, driving

# with steps of 1 ms round-off is 2e-8 of accelerations, and falls with their square
#: of the time that says a side, between instants of the differences of functions of Python
FAR = 1e5
# of the fourth order for rates, of the third one for accelerations
#: first derivative at the first of five instants, times 12 d
RATE = np.array([-25.0, 48.0, -36.0, 16.0, -3.0])
BEND = np.array([35.0, -104.0, 114.0, -56.0, 11.0])  #: second, times 12 d^2


@storable
@dataclass(frozen=True)
class Cosine:
    """The function of time cos(angle(t)), (s,) at times (s,) [s], of an angle [rad]; files can hold
    it where `angle` is data.
    """

    angle: Callable[[np.ndarray], np.ndarray]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(self.angle(t)))


@storable
@dataclass(frozen=True)
class Sine:
    """The function of time sin(angle(t)), (s,) at times (s,) [s], of an angle [rad]; files can hold
    it where `angle` is data.
    """

    angle: Callable[[np.ndarray], np.ndarray]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(self.angle(t)))


@dataclass(frozen=True)
class BoundExpression:
    """An expression of inputs that are functions of time, by name."""

    of: Expression
    functions: Mapping[str, Signal]

    def __call__(self, t: np.ndarray) -> np.ndarray:
        return self.of.at(t, {name: function(t) for name, function in self.functions.items()})


@singledispatch
def as_drive(signal: Any) -> Signal:
    """The function of time as joints are driven by it: with continuous second derivatives, as far
    as it has a choice.

    Types that read tables register; others stay.
    """
    driven: Signal = signal
    return driven


@singledispatch
def read_inputs(signal: Any) -> Sequence[Input]:
    """The inputs that a function of time reads; none of most functions. Types that read some
    register.
    """
    return ()


@singledispatch
def bound(signal: Any, told: Mapping[str, Signal]) -> Signal:
    """The function of time with inputs as functions of time, by their names in `told`.

    Other inputs stay. Types of functions that read inputs register here.
    """
    return signal


@singledispatch
def jet(signal: Any, t: np.ndarray, near: float) -> jets.Jet:
    """The function of time with its first two derivatives (3, s) at times (s,) [s], on the side of
    a corner that the sign of a short time `near` [s] says.

    Types that are data register; those of other functions are differences over FAR times that time.
    """
    d = FAR * near
    table = np.stack([signal(t + k * d) + 0.0 * t for k in range(5)])
    return np.stack([table[0], RATE @ table / (12.0 * d), BEND @ table / (12.0 * d**2)])


@jet.register
def _(signal: Expression, t: np.ndarray, near: float) -> jets.Jet:
    return jets.of_expression(signal, t, near)


@jet.register
def _(signal: Table, t: np.ndarray, near: float) -> jets.Jet:
    clock = np.stack([t, np.ones(len(t)), np.zeros(len(t))])
    return jets.of_table(signal, clock, near)


@jet.register
def _(signal: Cosine | Sine, t: np.ndarray, near: float) -> jets.Jet:
    angle = jet(signal.angle, t, near)
    rule = jets.RULES["cos" if isinstance(signal, Cosine) else "sin"]
    return jets.chain(angle, *rule(angle[0]))


def exact_path(signal: Any) -> Expression | Table | None:
    """The text or table of a function of time, or of the angle in it, whose jets are exact; None of
    functions of Python, and of what is given step by step.
    """
    path = signal.angle if isinstance(signal, Cosine | Sine) else signal
    return path if isinstance(path, Expression | Table) and not read_inputs(path) else None


@read_inputs.register
def _(signal: Input) -> Sequence[Input]:
    return (signal,)


@bound.register
def _(signal: Input, told: Mapping[str, Signal]) -> Signal:
    return told.get(signal.name, signal)


@read_inputs.register
def _(signal: Expression) -> Sequence[Input]:
    return [each for one in signal.inputs for each in read_inputs(one)]


@bound.register
def _(signal: Expression, told: Mapping[str, Signal]) -> Signal:
    if not read_inputs(signal):
        return signal
    return BoundExpression(signal, {one.name: bound(one, told) for one in signal.inputs})


@as_drive.register
def of_drive(signal: Table) -> Table:
    """The spline of a smooth table; what speaks against it is a warning."""
    if not signal.smooth or signal.drives:
        return signal
    driven = replace(signal, drives=True)
    warn_of_spline(driven)
    return driven


@as_drive.register
def _(signal: Expression) -> Signal:
    if not any(isinstance(one, Table) for one in signal.inputs):
        return signal
    return replace(
        signal,
        inputs=tuple(of_drive(one) if isinstance(one, Table) else one for one in signal.inputs),
    )


@as_drive.register
def _(signal: Cosine | Sine) -> Signal:
    return replace(signal, angle=as_drive(signal.angle))


def warn_of_spline(table: Table) -> None:
    """Warnings of a spline that drives a joint: where it leaves its points, and of noise in them."""
    name = f"table '{table.call[:-2]}', whose curve drives a joint"
    per = f"{table.of}^2"
    beyond, place = tables.overshoot(table)
    span = float(np.ptp(table.values))
    if beyond > tables.OVERSHOT * span:
        size = f"{beyond:.3g} {table.unit}".rstrip()
        text = f"{name}: at {place:.4g} {table.of} it goes beyond the points beside it by {size}, {beyond / span:.2g} of their range"
        notify(f"{text}; give it more points where it bends, or other `ends`")
    rough, smooth = tables.noise(table)
    if rough:
        unit = f"{table.unit or '1'}/{per}"
        text = f"{name}: its points are noisy, its second derivative reaches {rough:.3g} {unit} by their noise"
        notify(
            f"{text}, {smooth:.3g} through every {tables.EIGHTH}th point: smooth them before, forces follow it"
        )


@read_inputs.register
def _(signal: Cosine | Sine) -> Sequence[Input]:
    return read_inputs(signal.angle)


@bound.register
def _(signal: Cosine | Sine, told: Mapping[str, Signal]) -> Signal:
    return replace(signal, angle=bound(signal.angle, told))


def given_by_name(system: System) -> dict[str, Input]:
    """All that a system is given by name: inputs, those of controllers at the end of its signals,
    and numbers of locks.
    """
    return {one.name: one for signal in system.signals for one in read_inputs(signal)}


def inputs_of(system: System) -> dict[str, Input]:
    """The inputs of a system by name, those of controllers among them, without the numbers that
    locks hold.
    """
    return {name: one for name, one in given_by_name(system).items() if not isinstance(one, Held)}


def driving_inputs(system: System) -> set[str]:
    """Names of the inputs that drive joints: constraint rows read them."""
    inputs = (one for _, k in driving(system.constraints) for one in read_inputs(system.signals[k]))
    return {one.name for one in inputs if not isinstance(one, Held)}


def with_inputs(system: System, told: Mapping[str, Signal]) -> System:
    """The system with functions of time in place of inputs, by name, in `full` and in its finer one
    as well; other inputs stay.

    A function takes times (s,) [s] and gives values (s,). InputError for an input that the system
    does not have, with the nearest one.
    """
    known = given_by_name(system)
    for name in told:
        if name not in known:
            expected = f"one of the inputs {listed(known, name, 'of which there are none')}"
            raise InputError(say("inputs", expected, f"'{name}'") + closest(name, known))
    return with_signals(system, told, full_with(system, told))


def with_signals(system: System, told: Mapping[str, Signal], full: System | None) -> System:
    """The same with a form `full`, and in the finer system of one with parts."""
    driven = {k for _, k in driving(system.constraints)}
    drives = driving_inputs(system)
    smooth = {
        name: as_drive(function) if name in drives else function for name, function in told.items()
    }
    signals = (
        bound(signal, smooth if k in driven else told) for k, signal in enumerate(system.signals)
    )
    found = replace(system, signals=tuple(signals), full=full)
    return finer_systems.carry(system, found, lambda finer: with_inputs(finer, told))


def full_with(system: System, told: Mapping[str, Signal]) -> System | None:
    """The same of the form with all multipliers."""
    if system.full is None or system.full is system:
        return system.full
    return with_signals(system.full, told, system.full.full)
