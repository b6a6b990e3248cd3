r"""Discrete controllers: what they read of the state at every sample instant becomes an input,
which is held to the next one.

    pid              u_k = limited(kp e_k + I_k + kd e'_k),    I_k = I_k-1 + ki T e_k,    e'_k = (e_k - e_k-1) / T or given
    state_feedback   u_k = limited(u_0 - sum_i K_i x_i)
    table            u_k = straight lines through points of x_k, constant beyond them
    measurement      u_k = x_k
    program          u_k = f(t_k, x_1, x_2, ...), a function of Python

T is the sample time, e and x_i are expressions of outputs, inputs, t and parameters (`responses`).
The integral of a PID stands still while u is at a limit and e drives it further (anti-windup by
clamping). Forces and histories read u by the name of the controller; the first sample is taken at t
= 0, statics and modes have `start` in its place.

Source: Astrom and Hagglund, Advanced PID Control, ISA 2006, sections 3.5 (windup) and 13.2
(discretisation).
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, TypeAlias

import numpy as np

from ..core.declared import Declared, require_sound
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.values import quantities, units
from ..core.values.fields import ANY, Context, Takes, array_schema
from ..core.values.inputs import Input
from ..core.values.problems import Problem, shown
from ..core.values.responses import OfState, of_state
from ..core.values.units import Quantity
from ..systems import fields
from ..systems.additions import Addition, adds
from ..systems.connections.constraint_functions import Joint
from ..systems.places import Draft
from .laws import FeedbackLaw, MeasurementLaw, PidLaw, TableLaw


def read_unit(value: object, context: Context) -> str:
    """The SI unit of a unit as `kN m`, or an empty text."""
    if not isinstance(value, str):
        raise Problem("a unit such as 'N m'", shown(value))
    return units.unit(units.find_dimension(value).exponents) if value else ""


UNIT = Takes(read_unit, {"type": "string", "description": "a unit such as N m, none for a number"})
#: SI, or a quantity
Gain: TypeAlias = Annotated[
    Any, Takes(lambda value, context: quantities.read(value, context.parameters), ANY.schema)
]
Read: TypeAlias = Annotated[OfState, fields.response("")]


def read_pair(value: object, context: Context) -> tuple[Any, ...]:
    """Two quantities."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise Problem("a list of two quantities", shown(value))
    return tuple(quantities.read(one, context.parameters) for one in value)


Pair: TypeAlias = Annotated[tuple[Any, ...], Takes(read_pair, array_schema(ANY.schema, 2, 2))]


def number(value: Any) -> float:
    """A gain in SI units."""
    return float(value.value if isinstance(value, Quantity) else value)


def product(name: str, gain: Quantity, value: OfState, unit: str, more: str = "") -> OfState:
    """A gain times an expression, whose dimension has to be that of a unit."""
    known = dict(value.parameters)
    name = f"_{name}" if name in known else name
    return of_state(f"{name} * ({value.text}){more}", unit or "1", known | {name: gain})


def ratio(x: Quantity, value: OfState) -> OfState:
    """An expression over x, a plain number where both have the same dimension."""
    known = dict(value.parameters)
    name = "_point" if "point" in known else "point"
    return of_state(f"({value.text}) / {name}", "1", known | {name: x})


@dataclass(frozen=True, kw_only=True)
class Controller(Declared, ABC):
    """An input by a rule of what it reads at every sample instant: a frozen dataclass, see
    `core.declared`.

    `unit` is the SI unit of the input, `sample` T [s], `start` its value in statics and modes.
    Derive a frozen dataclass with `reads`, what it reads, and `law`, which may change the list
    `memory` and is called at t = 0, T, 2 T, ...:

        u = law(t, values, memory)
    """

    name: str
    unit: Annotated[str, UNIT] = ""
    sample: Annotated[
        float, fields.quantity("s", "> 0"), "between two samples, a whole number of steps"
    ]
    start: Gain = 0.0

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        found = {
            (key, one.exponents)
            for key, one in self.outputs()
            if isinstance(one, Quantity) and any(one.exponents)
        }
        for key, exponents in sorted(found):
            if self.unit != units.unit(exponents):
                yield (
                    key,
                    Problem(f"{key} in {self.unit or 'plain numbers'}", units.describe(exponents)),
                )

    def outputs(self) -> Iterator[tuple[str, Any]]:
        """Names of fields, and numbers in them that are values of the output."""
        yield "start", self.start

    @property
    @abstractmethod
    def reads(self) -> Sequence[OfState]:
        """Expressions of the state that it reads."""

    @abstractmethod
    def law(self) -> Any:
        """What it does: a storable struct with `memory`, numbers at the start, and a call of t,
        values read, and the memory; a `laws.NumberLaw` where models in C are to have it.
        """

    def products(self) -> Iterator[tuple[str, OfState]]:
        """Names of fields, and expressions with a dimension that they have to have."""
        return iter(())


@dataclass(frozen=True, kw_only=True)
class Limited(Controller, ABC):
    """What stays between two limits.

    `limits` [low, high] in the unit of the output; a problem where low is not below high.
    """

    limits: Pair | None = None

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        if self.limits and not number(self.limits[0]) < number(self.limits[1]):
            yield (
                "limits",
                Problem(
                    "the smaller limit first",
                    f"{number(self.limits[0]):g} and {number(self.limits[1]):g}",
                ),
            )

    def outputs(self) -> Iterator[tuple[str, Any]]:
        yield from super().outputs()
        yield from (("limits", one) for one in self.limits or ())

    @property
    def ends(self) -> tuple[float, float]:
        """The limits in SI units."""
        return (
            (-math.inf, math.inf)
            if self.limits is None
            else (number(self.limits[0]), number(self.limits[1]))
        )


@dataclass(frozen=True, kw_only=True)
class Pid(Limited):
    """PID controller, between limits; the integral of ki e stands still while a limit holds and e
    drives it further.

        u = kp e + I + kd e'

    e' is `rate`, or the difference of the last two samples of e over the sample time.

    {type: pid, unit: N m, sample: 2 ms, error: 0.5 rad - hinge.angle, kp: 30 N m, ki: 40 N m/s, limits: [-9 N m, 9 N m]}
    """

    error: Read
    rate: Read | None = None
    kp: Gain = 0.0
    ki: Gain = 0.0
    kd: Gain = 0.0

    @property
    def reads(self) -> Sequence[OfState]:
        return [self.error] if self.rate is None else [self.error, self.rate]

    def law(self) -> PidLaw:
        return PidLaw(number(self.kp), number(self.ki), number(self.kd), *self.ends, self.sample)

    def products(self) -> Iterator[tuple[str, OfState]]:
        change = self.error if self.rate is None else self.rate
        for key, gain, value in (
            ("kp", self.kp, self.error),
            ("ki", self.ki, self.error),
            ("kd", self.kd, change),
        ):
            if isinstance(gain, Quantity):
                time = {"ki": " * 1 s", "kd": " / 1 s" if self.rate is None else ""}.get(key, "")
                yield key, product(key, gain, value, self.unit, time)


@dataclass(frozen=True, kw_only=True)
class StateFeedback(Limited):
    """Feedback of expressions x_i, such as deviations from a goal, between limits.

        u = u0 - sum_i K_i x_i

    {type: state_feedback, unit: N, sample: 1 ms, states: [tip.y, tip.vy], gains: [40 N/m, 3 N s/m]}
    """

    states: Sequence[Read]
    gains: Sequence[Gain]
    offset: Gain = 0.0

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        if len(self.gains) != len(self.states):
            yield (
                "gains",
                Problem(f"one for each of the {len(self.states)} states", str(len(self.gains))),
            )

    def outputs(self) -> Iterator[tuple[str, Any]]:
        yield from super().outputs()
        yield "offset", self.offset

    @property
    def reads(self) -> Sequence[OfState]:
        return self.states

    def law(self) -> FeedbackLaw:
        return FeedbackLaw(number(self.offset), tuple(map(number, self.gains)), *self.ends)

    def products(self) -> Iterator[tuple[str, OfState]]:
        for gain, value in zip(self.gains, self.states, strict=False):
            if isinstance(gain, Quantity):
                yield "gains", product("gain", gain, value, self.unit)


@dataclass(frozen=True, kw_only=True)
class Measurement(Controller):
    """The value of an expression `of`, held to the next sample: so forces read reactions and
    energies, one step late at least.

    {type: measurement, unit: N, sample: 1 ms, of: hinge.x}
    """

    of: Read

    @property
    def reads(self) -> Sequence[OfState]:
        return [self.of]

    def law(self) -> MeasurementLaw:
        return MeasurementLaw()

    def products(self) -> Iterator[tuple[str, OfState]]:
        yield "of", of_state(self.of.text, self.unit or "1", dict(self.of.parameters))


@dataclass(frozen=True, kw_only=True)
class LookupTable(Controller, word="table"):
    """Straight lines through points [x, u] of an expression `of`, constant beyond them.

    {type: table, unit: N, sample: 1 ms, of: tip.y, points: [[0 m, 0 N], [0.1 m, 5 N]]}
    """

    of: Read
    points: Sequence[Pair]

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from super().problems(dim)
        x = [number(one) for one, _ in self.points]
        if len(x) < 2 or any(b <= a for a, b in itertools.pairwise(x)):
            yield (
                "points",
                Problem(
                    "two points at least, of growing x",
                    ", ".join(f"{one:g}" for one in x) or "none",
                ),
            )

    @property
    def reads(self) -> Sequence[OfState]:
        return [self.of]

    def outputs(self) -> Iterator[tuple[str, Any]]:
        yield from super().outputs()
        yield from (("points", u) for _, u in self.points)

    def products(self) -> Iterator[tuple[str, OfState]]:
        kinds = {
            x.exponents: x for x, _ in self.points if isinstance(x, Quantity) and any(x.exponents)
        }
        yield from (("points", ratio(x, self.of)) for x in kinds.values())

    def law(self) -> TableLaw:
        x, u = (np.array([number(point[k]) for point in self.points]) for k in range(2))
        return TableLaw(x, u)


@storable
@dataclass(frozen=True)
class ProgramLaw:
    """A function of Python, which files cannot hold."""

    function: Callable[..., float]
    memory: tuple[float, ...] = ()

    def __call__(self, t: float, values: Sequence[float], memory: list[float]) -> float:
        return float(self.function(t, *values))


@dataclass(frozen=True, kw_only=True)
class Program(Controller, word=None):
    """f(t, x_1, x_2, ...) of expressions, a function of Python: a sample costs 3 us beside its own
    time.

    `function` gets the time [s] and the values in SI units, and gives the output in `unit`. It has
    no word in scenes, as files hold no Python.
    """

    function: Callable[..., float]
    states: Sequence[OfState] = ()

    @property
    def reads(self) -> Sequence[OfState]:
        return self.states

    def law(self) -> ProgramLaw:
        return ProgramLaw(self.function)


@storable
@dataclass(frozen=True)
class Controlled(Input):
    """An input that a controller sets.

    `law` is what `Controller.law` gave; the value is held from one sample to the next.
    """

    sample: float = 0.0  #: [s]
    law: Any = None
    reads: tuple[int, ...] = ()  #: numbers of the values that it reads, see `readings`


@adds("controllers")
class Controllers(Addition):
    """All controllers; what they set are inputs."""

    def __init__(self, given: Iterable[Controller], draft: Draft) -> None:
        self.controllers, self.inputs = list(given), list[Controlled]()
        for one in self.controllers:
            require_sound("controller", getattr(one, "name", ""), one, Controller, draft.layout.dim)

    def reads(self) -> Iterator[tuple[str, OfState]]:
        return (
            (f"controller '{one.name}'", value) for one in self.controllers for value in one.reads
        )

    def sources(self, numbers: Sequence[int]) -> Sequence[Controlled]:
        counted = iter(numbers)
        for one in self.controllers:
            reads = tuple(itertools.islice(counted, len(one.reads)))
            self.inputs.append(
                Controlled(one.name, one.unit, number(one.start), one.sample, one.law(), reads)
            )
        return self.inputs

    def add(
        self, draft: Draft, joints: Sequence[Joint], numbers: Sequence[int]
    ) -> Mapping[str, Any]:
        draft.signals += self.inputs
        return {}

    def gains(self) -> Iterator[tuple[str, OfState]]:
        return (
            (f"controller '{one.name}'.{key}", value)
            for one in self.controllers
            for key, value in one.products()
        )
