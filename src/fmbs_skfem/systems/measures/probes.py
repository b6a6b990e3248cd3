"""Outputs by name: what a scene wants to know over time. Vector outputs B have the columns B_x, B_y
(, B_z).

Every column has a name of its own, and none is called `t`, which is the first one of every table.
An output of one's own is a frozen dataclass of the family `Probe`, with what it reads (`sense`),
what it makes of that on a motion (`evaluate`), and its unit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ...core.declared import Declared
from ...core.errors import InputError, closest, listed, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.fields import AXES
from ...core.values.problems import Problem
from .. import fields
from ..affine import Matrix
from ..connections.constraint_functions import arm, needs_axis, needs_other_side, rows_of, unit
from ..own_symbols import norm, turned
from ..places import Draft
from ..system import Output, System
from . import resultants
from .angles import Parts, angle_and_rates, continuous

TIME = "t"  #: the first column of every table
#: part of the largest moment of vectors about an axis below which they are parallel to it
PARALLEL = 1e-9
#: first words of the coordinates of a joint along which reactions are forces
FORCES = "x", "y", "z", "normal", "length", "node", "thrust"
#: and about which they are moments
MOMENTS = (
    "angle",
    "torque",
    "axis",
    "axes",
    "slope",
    "teeth",
    "mx",
    "my",
    "mz",
)
#: an angle (s,) and its first and second derivative
Argument: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
#: columns by components of rows and their two derivatives
Formula: TypeAlias = Callable[[Parts, Parts, Parts], Sequence[Any]]
#: numbers of rows, columns and parameters; None for any
Sizes: TypeAlias = tuple[int | None, int | None, int | None]


@dataclass(frozen=True)
class Sensed:
    """What the output `name` reads of a motion of s states: its i sensor rows over time, and what
    they cannot say.
    """

    name: str
    dim: int
    times: np.ndarray  #: (s,) [s]
    values: np.ndarray  #: (s, i) of its rows
    rates: np.ndarray  #: (s, i)
    accelerations: np.ndarray  #: (s, i)
    energies: Callable[[], np.ndarray]  #: kinetic, strain, potential and balance (s, 4) [J]
    #: forces of constraint rows (s,) by joint and coordinate
    reactions: Callable[[], dict[tuple[str, str], np.ndarray]]
    pushes: Callable[[], np.ndarray]  #: forces (s, j) on the probe rows of the system
    forces: tuple[Any, ...]  #: what makes these, see `forces`
    signals: Callable[[], np.ndarray]  #: functions of time of the system (s, k)
    #: rows (p, i) on the way between equilibria, and where these are (s,)
    way: tuple[np.ndarray, np.ndarray] | None = None


class Probe(Declared, ABC):
    """An output, see `core.declared`: sensor rows, and what is made of them on a motion.

    Files of reduced models hold what it has sensed, so that they know it by its word.
    """

    unit: ClassVar[str] = ""  #: SI unit of its columns
    #: whether every reduced model knows it, so that their histories are drawn together
    known_to_all: ClassVar[bool] = True
    #: whether errors of columns count relative to the largest of them
    on_largest: ClassVar[bool] = False
    #: parts that a whole motion has, and no instant of it
    of_motions: ClassVar[tuple[str, ...]] = ()
    #: numbers of columns that are 0 where nothing is to be said, and jump there: errors count where
    #: both motions have them
    pausing: ClassVar[tuple[int, ...]] = ()
    #: numbers of columns that count from the first state of a motion: turns, energies
    counted: ClassVar[tuple[int, ...]] = ()
    #: what it may call of `Sensed` beside `energies`: while a run goes, nothing else is found of
    #: states that are not kept
    calls: ClassVar[tuple[Literal["reactions", "pushes"], ...]] = ("reactions", "pushes")
    #: whether its columns balance forces of the model, whose round-off they carry
    balances: ClassVar[bool] = False

    @abstractmethod
    def sense(self, name: str, draft: Draft) -> Output:
        """Its sensor rows, columns and numbers, as an `Output` that is called `name`; see `output`.

        InputError where its fields do not fit the bodies.
        """

    @staticmethod
    @abstractmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        """Values (s,) of its columns on a motion of s states, in the units of `units`.

        `sensed` has its rows over time.
        """

    def variables(self, dim: int) -> Mapping[str, str]:
        """What forces read of it, `output.x` or by "" the output itself: parts with their SI units.

        Without any, its columns are known of accepted states, for controllers and events alone.
        """
        return {}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        """What `variables` names, in symbols of its rows (i,), their rates and its parameters, in
        the same order.

        y, v and numbers are matrices of symbols; forces are differentiated through it.
        """
        return ()

    @classmethod
    def angle(
        cls, output: Output, y: np.ndarray, rate: np.ndarray, change: np.ndarray
    ) -> Argument | None:
        """The angle (s,) [rad] of its rows (s, i), but for whole turns, and its two derivatives;
        None of outputs without one.

        Its turns are counted then. `rate` and `change` are the first and the second derivative of
        the rows y (s, i).
        """
        return None

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula | None:
        """Its columns as a function of its rows, their rates and accelerations in one state; None
        where there is more to them.

        An angle that counts its turns is given but for these, with its two derivatives behind it.
        """
        return None

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        """SI units of its columns."""
        return (cls.unit,) * len(output.columns)

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        """How many rows, columns and parameters it has in a file; LookupError where a parameter is
        wrong.
        """
        return None, None, None

    def output(
        self, draft: Draft, columns: tuple[str, ...], rows: Sequence[Matrix] = (), **more: Any
    ) -> Output:
        """The output with sensor rows (i, q) of its own, which are added to the draft.

        `columns` are names of its columns, `rows` blocks of rows on the body coordinates, `more`
        other fields of `Output`.
        """
        first = draft.sensors.count
        for block in rows:
            draft.sensors.add(csr_array(block))
        return Output(self.word, tuple(range(first, draft.sensors.count)), columns, **more)


def kind_of(output: Output) -> type[Probe]:
    """The class of an output, by its word.

    InputError where none is known, as of an extension that is not imported.
    """
    for kind in Probe.known.values():
        if output.kind in kind.words:
            return kind
    expected = f"one of {listed(Probe.known, output.kind)}"
    raise InputError(
        say(f"outputs {', '.join(output.columns)}", expected, f"'{output.kind}'", "define it first")
    )


def formula_of(output: Output, dim: int) -> Formula | None:
    """The formula of an output; None where it has none, and where its class evaluates itself
    otherwise than the formula says.
    """
    kind = kind_of(output)
    family = type.mro(kind_of(output))
    by, written = (
        next(k for k, one in enumerate(family) if name in vars(one))
        for name in ("evaluate", "formula")
    )
    return kind.formula(output, dim) if written <= by else None


def calls_of(outputs: Mapping[str, Output]) -> set[str]:
    """What outputs ask of a motion beside sensor rows and energies."""
    return {call for one in outputs.values() for call in kind_of(one).calls}


def counted_angle(
    kind: type[Probe], output: Output, sensed: Sensed
) -> tuple[np.ndarray, np.ndarray]:
    """The angle (s,) [rad] of an output with its whole turns, and its rate (s,) [rad/s].

    Turns are counted on the way between equilibria, where that is known, or by the rates of a
    motion, see `angles.continuous`.
    """
    found = kind.angle(output, sensed.values, sensed.rates, sensed.accelerations)
    assert found is not None
    angle, speed, acceleration = found
    if sensed.way is None:
        return continuous(
            f"output '{sensed.name}'", sensed.times, angle, speed, acceleration
        ), speed
    y, kept = sensed.way
    passed = kind.angle(output, y, still := np.zeros_like(y), still)
    assert passed is not None
    return angle + 2 * np.pi * np.round((np.unwrap(passed[0])[kept] - angle) / (2 * np.pi)), speed


def largest_turn(system: System, before: np.ndarray, after: np.ndarray) -> float:
    """Most that an angle of the outputs turns from one state (n,) to another (n,), up to half a
    turn [rad].

    0 without outputs that count turns.
    """
    sensors = system.sensors
    largest = 0.0
    counted = [(one, kind) for one in system.outputs.values() if (kind := kind_of(one)).counted]
    if not counted:
        return largest
    y = np.array([sensors.matrix @ x + sensors.offset for x in (before, after)])
    for one, kind in counted:
        rows = y[:, list(one.rows)]
        found = kind.angle(one, rows, still := np.zeros_like(rows), still)
        if found is not None:
            largest = max(largest, float(np.abs(np.diff(np.unwrap(found[0])))[0]))
    return largest


def units(name: str, output: Output) -> tuple[str, ...]:
    """SI units of the columns of an output called `name`.

    A unit is empty where a number has none, or that of a multiplier has no name.
    """
    return kind_of(output).units(name, output)


def column_units(outputs: Mapping[str, Output]) -> dict[str, str]:
    """The SI unit of every column of outputs, by the name of the column; empty where it has none."""
    return {
        column: unit
        for name, one in outputs.items()
        for column, unit in zip(one.columns, units(name, one), strict=True)
    }


def column_labels(outputs: Mapping[str, Output]) -> dict[str, str]:
    """What columns are, by name, whose names do not say it, such as the axis of a moment; other
    columns are left out.
    """
    return {
        column: label
        for one in outputs.values()
        for column, label in zip(one.columns, one.labels, strict=False)
        if label
    }


def require_distinct_columns(outputs: Mapping[str, Output]) -> None:
    """InputError that names the outputs where two columns have the same name, or one that of the
    time.
    """
    owner = {TIME: ""}
    for name, output in outputs.items():
        for column in output.columns:
            if column in owner:
                of = f"one of '{owner[column]}'" if owner[column] else "the time in every table"
                raise InputError(
                    say(
                        f"output '{name}'",
                        "columns of its own",
                        f"'{column}', which is also {of}",
                        "rename one",
                    )
                )
            owner[column] = name


Component: TypeAlias = Literal["x", "y", "z"]


def columns_of(values: np.ndarray) -> list[np.ndarray]:
    """Columns (s,) of values (s, i), one for each of i rows."""
    return list(values.T)


@dataclass(frozen=True)
class PointProbe(Probe, ABC):
    """A vector at a point: one column a coordinate, or one `component` alone in a column of the
    output's own name.
    """

    at: fields.Place
    component: Component | None = None
    derivative: ClassVar[int] = 0  #: 1 for the slope
    order: ClassVar[int] = 0  #: of the derivative by time that it is
    calls = ()

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if dim == 2 and self.component == "z":
            yield "component", Problem("x or y in the plane", "'z'")

    def sense(self, name: str, draft: Draft) -> Output:
        rows = draft.layout.read(f"output '{name}'", self.at, self.derivative)
        axes = AXES[: draft.layout.dim]
        if self.component is None:
            return self.output(draft, tuple(f"{name}_{axis}" for axis in axes), [rows])
        if self.component not in tuple(axes):
            raise InputError(
                say(f"output '{name}'", f"one of the components {', '.join(axes)}", self.component)
            )
        return self.output(draft, (name,), [rows[[axes.index(self.component)]]])

    def variables(self, dim: int) -> Mapping[str, str]:
        rate = f"{self.unit}/s" if self.unit else "1/s"
        if self.component is not None:
            return {"": self.unit, "rate": rate}
        return dict.fromkeys(AXES[:dim], self.unit) | {f"v{axis}": rate for axis in AXES[:dim]}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return [*y, *v]

    @classmethod
    def evaluate(cls, output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        return columns_of((sensed.values, sensed.rates, sensed.accelerations)[cls.order])

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula:
        return lambda *parts: parts[cls.order]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return None, len(output.rows), 0


@dataclass(frozen=True)
class Position(PointProbe):
    """Position of a point [m], one column a coordinate; one `component` has the output's own name.

    {type: position, at: beam.right, component: y}
    """

    unit: ClassVar[str] = "m"


@dataclass(frozen=True)
class Displacement(PointProbe):
    """Displacement of a point from its reference [m], one column a coordinate; one `component` has
    the output's own name.

        r - r0

    {type: displacement, at: bracket.hole}
    """

    unit: ClassVar[str] = "m"

    def sense(self, name: str, draft: Draft) -> Output:
        found = super().sense(name, draft)
        place = draft.layout.reference(f"output '{name}'", self.at) + draft.layout.origin
        chosen = place if self.component is None else place[[AXES.index(self.component)]]
        return replace(found, parameters=tuple(chosen.tolist()))

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return [*(y - numbers), *v]

    @classmethod
    def evaluate(cls, output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        return columns_of(sensed.values - np.array(output.parameters))

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula:
        return lambda *parts: [
            one - first for one, first in zip(parts[0], output.parameters, strict=True)
        ]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        count = len(output.rows)
        return None, count, count


@dataclass(frozen=True)
class Velocity(PointProbe):
    """Velocity of a point [m/s], one column a coordinate; one `component` has the output's own
    name.

    {type: velocity, at: beam.right}
    """

    unit: ClassVar[str] = "m/s"
    order = 1

    def variables(self, dim: int) -> Mapping[str, str]:
        return dict.fromkeys(AXES[:dim] if self.component is None else [""], self.unit)

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return list(v)


@dataclass(frozen=True)
class Slope(PointProbe):
    """Slope dr/dS of a line at a point, one column a coordinate; one `component` has the output's
    own name.

    {type: slope, at: beam.right}
    """

    derivative: ClassVar[int] = 1


@dataclass(frozen=True)
class Angle(Probe):
    """Angle [rad] turned since the reference about z or, in space, about `axis`; its turns are
    counted along the motion.

    With `to` it is that against another place, which carries the axis, and its rate [rad/s] stands
    in NAME_rate.

    {type: angle, at: crank.left}
    """

    at: fields.Place
    axis: fields.Axis | None = None
    to: Annotated[fields.Carrier, "the ground by default"] = None
    unit: ClassVar[str] = "rad"
    counted: ClassVar[tuple[int, ...]] = (0,)
    calls = ()

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_axis(self.axis, dim)
        if self.to == self.at:
            yield "to", Problem("another place than `at`", "the same")

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        layout = draft.layout
        rows, u, normal = arm(where, layout, self.at, self.axis)
        if self.to is None:
            return self.output(draft, (name,), [rows])
        columns = name, f"{name}_rate"
        if layout.dim == 2:
            return self.output(draft, columns, [rows, arm(where, layout, self.to, None)[0]])
        carried = ((self.at, u), (self.to, u), (self.to, normal))
        return self.output(
            draft, columns, [rows_of(where, layout, end, vector) for end, vector in carried]
        )

    def variables(self, dim: int) -> Mapping[str, str]:
        return {"": "rad", "angle": "rad", "rate": "rad/s"}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        from sympy import Matrix, atan2

        z, dz = y, v
        if len(y) > 2:  # as in `plane_vectors`
            (a, b, c), (da, db, dc) = ((w[:2, :], w[2:4, :], Matrix([-w[3], w[2]])) for w in (y, v))
            if len(y) == 9:
                (a, b, c), (da, db, dc) = ((w[:3, :], w[3:6, :], w[6:, :]) for w in (y, v))
            z = Matrix([a.dot(b), a.dot(c)])
            dz = Matrix([da.dot(b) + a.dot(db), da.dot(c) + a.dot(dc)])
        angle = turned(atan2(z[1], z[0]))
        return [angle, angle, (z[0] * dz[1] - z[1] * dz[0]) / z.dot(z)]

    @classmethod
    def angle(cls, output: Output, y: np.ndarray, rate: np.ndarray, change: np.ndarray) -> Argument:
        return angle_and_rates(y.T, rate.T, change.T)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        return list(counted_angle(Angle, output, sensed)[: len(output.columns)])

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula:
        return angle_and_rates

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return ("rad", "rad/s")[: len(output.columns)]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        relative = len(output.columns) == 2
        return (4 if dim == 2 else 9) if relative else 2, 1 + relative, 0


@dataclass(frozen=True)
class AngularVelocity(Probe):
    """Angular velocity [rad/s]: about z or, in space, its component along `axis`, or all three as
    NAME_x, NAME_y, NAME_z.

    In space that of the vectors e_k of the place, e_k' = w x e_k, by least squares:

        sum_k (|e_k|^2 1 - e_k e_k^T) w = sum_k e_k x e_k'

    One vector alone has no rate about itself.

    {type: angular_velocity, at: rotor.frame, axis: [0, 0, 1]}
    """

    at: fields.Place
    axis: fields.Axis | None = None
    unit: ClassVar[str] = "rad/s"
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        layout = draft.layout
        vectors = layout.vectors(where, self.at)
        if layout.dim == 3 and self.axis is None and vectors:
            return self.output(draft, tuple(f"{name}_{axis}" for axis in AXES), vectors)
        rows = arm(where, layout, self.at, self.axis)[0]
        if layout.dim == 2:
            return self.output(draft, (name,), [rows])
        axis = unit(f"{where}, axis", self.axis, 3)
        return self.output(draft, (name,), vectors, parameters=tuple(float(a) for a in axis))

    def variables(self, dim: int) -> Mapping[str, str]:
        return dict.fromkeys(AXES if dim == 3 and self.axis is None else [""], self.unit)

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        if len(y) == 2:
            return [(y[0] * v[1] - y[1] * v[0]) / y.dot(y)]
        from sympy import eye, zeros

        e = [(y[k : k + 3, :], v[k : k + 3, :]) for k in range(0, len(y), 3)]
        A = sum((one.dot(one) * eye(3) - one * one.T for one, _ in e), zeros(3, 3))
        moment = sum((one.cross(change) for one, change in e), zeros(3, 1))
        if len(e) == 1:  # nothing is known of its rate about itself
            w = moment / e[0][0].dot(e[0][0])
        else:
            w = moment / 2 if len(e) == 3 else A.adjugate() * moment / A.det()
        return [w.dot(numbers)] if len(numbers) else list(w)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        if sensed.dim == 2:
            return [angle_and_rates(sensed.values.T, sensed.rates.T, sensed.accelerations.T)[1]]
        e, change = (part.reshape(len(part), -1, 3) for part in (sensed.values, sensed.rates))
        A = np.einsum("ske,ske->s", e, e)[:, None, None] * np.eye(3) - np.einsum(
            "ski,skj->sij", e, e
        )
        w = np.einsum(
            "sij,sj->si",
            np.linalg.pinv(A, rcond=PARALLEL, hermitian=True),
            np.cross(e, change).sum(axis=1),
        )
        return [w @ np.array(output.parameters)] if output.parameters else columns_of(w)

    @classmethod
    def formula(cls, output: Output, dim: int) -> Formula | None:
        return (lambda y, rate, change: angle_and_rates(y, rate, change)[1:2]) if dim == 2 else None

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        rows = max(3, 3 * min(len(output.rows) // 3, 3))
        return (2, 1, 0) if dim == 2 else (rows, 1, 3) if output.parameters else (rows, 3, 0)


@dataclass(frozen=True)
class Deflection(Probe):
    """Position of `tip` relative to `root`, normal to the root's unit slope t [m]: with its sign in
    the plane, as a distance in space.

        t x (r_tip - r_root)    in space    |t x (r_tip - r_root)|

    {type: deflection, tip: beam.right, root: beam.left}
    """

    tip: fields.Place
    root: fields.Place
    unit: ClassVar[str] = "m"
    calls = ()

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.tip == self.root:
            yield "root", Problem("another point than the tip", "the same")

    def sense(self, name: str, draft: Draft) -> Output:
        places = ((self.tip, 0), (self.root, 0), (self.root, 1))
        return self.output(
            draft, (name,), [draft.layout.read(f"output '{name}'", at, k) for at, k in places]
        )

    def variables(self, dim: int) -> Mapping[str, str]:
        return {"": self.unit}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        tip, root, slope = (y[k * len(y) // 3 : (k + 1) * len(y) // 3, :] for k in range(3))
        unit = slope / norm(slope)
        apart = tip - root
        return [
            unit[0] * apart[1] - unit[1] * apart[0] if len(unit) == 2 else norm(unit.cross(apart))
        ]

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        tip, root, slope = np.split(sensed.values, 3, axis=1)
        unit = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        apart = tip - root
        if sensed.dim == 2:
            return [unit[:, 0] * apart[:, 1] - unit[:, 1] * apart[:, 0]]
        return [np.linalg.norm(np.cross(unit, apart), axis=1)]

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return 3 * dim, 1, 0


@dataclass(frozen=True)
class Distance(Probe):
    """Distance d [m] between two places, or a place and a fixed point, and its rate [m/s], in the
    columns NAME and NAME_rate.

        d = |r_at - r_to|,    d' = (r_at - r_to) . (r_at - r_to)' / d

    At a distance of 0 it has no direction, and its rate is 0.

    {type: distance, at: beam.right, to: [1 m, 0.3 m]}
    """

    at: fields.Place
    to: fields.OtherEnd
    calls = ()

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        yield from needs_other_side(self.to)
        if self.to == self.at:
            yield "to", Problem("another place than `at`", "the same")

    def sense(self, name: str, draft: Draft) -> Output:
        rows, offset = draft.layout.apart(f"output '{name}'", self.at, self.to)
        # sensors count from the origin of the scene
        first = draft.sensors.add(rows, offset - rows @ draft.layout.shift)
        return Output(self.word, tuple(range(first, first + len(offset))), (name, f"{name}_rate"))

    def variables(self, dim: int) -> Mapping[str, str]:
        return {"": "m", "rate": "m/s"}

    @staticmethod
    def write(y: Any, v: Any, numbers: Any) -> Sequence[Any]:
        return [norm(y), y.dot(v) / norm(y)]

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        length = np.linalg.norm(sensed.values, axis=1)
        along = sensed.values / np.maximum(length, np.finfo(float).tiny)[:, None]
        return [length, np.sum(along * sensed.rates, axis=1)]

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        return "m", "m/s"

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return dim, 2, 0


@dataclass(frozen=True)
class Energy(Probe):
    """Kinetic, strain, potential energy and balance [J].

        balance = kinetic + strain - work of all loads and drives

    Equilibria have no balance (NaN): nothing moves from one to the next.

    {type: energy}
    """

    unit: ClassVar[str] = "J"
    known_to_all: ClassVar[bool] = False
    on_largest: ClassVar[bool] = True
    of_motions: ClassVar[tuple[str, ...]] = ("balance",)
    counted: ClassVar[tuple[int, ...]] = (2, 3)
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        return self.output(
            draft, tuple(f"{name}_{part}" for part in ("kinetic", "strain", "potential", "balance"))
        )

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        return columns_of(sensed.energies())

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return 0, 4, 0


ANGLES = {"angle": "torque"}  #: what a joint that drives or holds an angle gives: a torque


@dataclass(frozen=True)
class Reaction(Probe):
    """Force of a joint on the body it holds [N], and its moments [N m] about axes that stand beside
    their columns.

    Axes are given in the reference: those of a joint between two bodies, along which sliders push
    as well, turn with `to`; that of a universal joint stays normal to both of its own. The moment
    of a driven angle, in the column `NAME_torque`, is the torque of the drive, in `inverse_dynamics`
    and in any motion. Of a held edge it is
    the resultant: the force NAME_x, ... and the moment NAME_mx, ... about the middle of the edge in
    the reference, about the axes of the scene. Moments on the slope of a line are those on one of
    length 1: where the line is stretched there, by 1 % say, they are 1 % too small, and the moments
    of `section_forces` are not.

    {type: reaction, joint: hinge}
    """

    joint: fields.JointName
    unit: ClassVar[str] = "N"
    known_to_all: ClassVar[bool] = False
    balances: ClassVar[bool] = True
    calls = ("reactions",)

    def sense(self, name: str, draft: Draft) -> Output:
        rows = [*draft.constraints.names, *(row for one in draft.locks for row in one.rows.names)]
        held = [label for joint, label in rows if joint == self.joint]
        if not held:
            known = sorted({joint for joint, _ in rows})
            expected = f"one of the joints {listed(known, self.joint)}"
            raise InputError(
                say(f"output '{name}'", expected, f"'{self.joint}'") + closest(self.joint, known)
            )
        if self.joint in draft.constraints.resultants:
            one = draft.constraints.resultants[self.joint]
            dim = draft.layout.dim
            more = {
                "joint": self.joint,
                "parameters": one.numbers,
                "labels": resultants.labels(one.place),
            }
            return self.output(draft, resultants.columns(name, dim), [one.arms], **more)
        columns = tuple(f"{name}_{ANGLES.get(label, label).replace(' ', '_')}" for label in held)
        labels = tuple(described(self.joint, label, draft) for label in held)
        return self.output(draft, columns, joint=self.joint, labels=labels)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> list[np.ndarray]:
        mine = [
            values for (joint, _), values in sensed.reactions().items() if joint == output.joint
        ]
        if output.rows and len(mine) * sensed.dim == len(output.rows):
            return resultants.evaluate(
                output.parameters, sensed.dim, sensed.values, np.stack(mine, axis=1)
            )
        if (
            not output.rows
            and len(mine) == len(output.columns)
            and not any(np.isnan(part).all() for part in mine)
        ):
            return mine
        notify_unknown(f"the reaction of joint '{output.joint}'")
        return (
            mine
            if not output.rows and len(mine) == len(output.columns)
            else [np.full(len(sensed.times), np.nan)] * len(output.columns)
        )

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        words = [column.removeprefix(f"{name}_").split("_")[0] for column in output.columns]
        kinds = dict.fromkeys(FORCES, cls.unit) | dict.fromkeys(MOMENTS, "N m")
        return tuple(kinds.get(word, "") for word in words)

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        if not output.rows:
            return 0, None, 0
        return None, 3 * dim - 3, dim + 2 * len(output.rows) // dim


def notify_unknown(what: str) -> None:
    """Say that nobody knows a column, because no multipliers are left."""
    notify(
        f"{what} is given as NaN: a reduced model that has dropped the joint's constraint does not know it"
    )


def described(joint: str, label: str, draft: Draft) -> str:
    """What the reaction of a row of a joint is, in words.

    `force along x`, `moment about (0, 0, 1)`, with axes in the reference; empty where nothing is
    known of the row.
    """
    row = (joint, label)
    dim = draft.layout.dim
    if (axis := draft.constraints.axes.get(row)) is not None:
        return f"moment about {named(axis, dim)}"
    if (direction := draft.constraints.directions.get(row)) is not None:
        whole = [k for k in range(dim) if abs(direction[k]) > 1.0 - 1e-6]
        alone = (
            f"{'-' if direction[whole[0]] < 0.0 else ''}{AXES[whole[0]]}"
            if whole
            else components(direction)
        )
        return f"force along {alone}"
    if label in tuple(f"slope {axis}" for axis in AXES[:dim]):
        return f"{label[-1]} component of a vector m, of the moment slope x m"
    if label == "teeth":
        return "moment on the first wheel"
    if label == "length" or label.startswith("node "):
        return "force along the link, a push being positive"
    return f"force along {label[0]}" if label.removesuffix(" locked") in tuple(AXES[:dim]) else ""


def named(axis: np.ndarray, dim: int) -> str:
    """The axis (3,) of a moment: `z` or `-z` in the plane, components in space."""
    return components(axis) if dim == 3 else "z" if axis[2] > 0.0 else "-z"


def components(direction: np.ndarray) -> str:
    """Those of a direction as text: `(0, 0.6, 0.8)`."""
    unit = np.round(direction / np.linalg.norm(direction), 6)
    return "(" + ", ".join(f"{value + 0.0:.4g}" for value in unit) + ")"
