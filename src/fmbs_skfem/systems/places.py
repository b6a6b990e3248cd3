"""Places that joints, loads and outputs refer to, and the rows that read them from the coordinates."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from ..bodies.body import Body, Cells, directors, locate, probe
from ..core.algebra.linalg import as_csr, stacked
from ..core.errors import InputError, closest, listed, say
from ..core.storage.records import dataclass
from ..core.values import arrays, mappings
from ..core.values.arguments import checked
from ..core.values.inputs import Source
from ..shapes.solids.solid import Solid
from ..shapes.surface import Surface
from ..shapes.table import Nodes
from . import row_laws
from .affine import Affine
from .connections import constraint_laws
from .connections.constraint_laws import ConstraintLaw, LawRows
from .forces import force_laws
from .forces.force_laws import ForceLaw
from .system import Constraints, Lock, Signal

if TYPE_CHECKING:
    from .measures.resultants import Resultant

QUARTER = csr_array(np.array([[0.0, -1.0], [1.0, 0.0]]))  #: turns plane vectors by 90 degrees


@dataclass(frozen=True)
@checked
class At:
    """A point of a body: the name of a frame or of a point group of its mesh, or an arc length from
    its start [m].

    A point mass or a rigid body is a place by itself, at its centre of mass.

        >>> from fmbs_skfem.systems import At
        >>> str(At("arm", "left")), str(At("arm", 0.25))
        ('arm.left', 'arm at 0.25 m')
    """

    body: str
    place: str | float = ""

    def __str__(self) -> str:
        if not self.place and isinstance(self.place, str):
            return self.body
        return (
            f"{self.body}.{self.place}"
            if isinstance(self.place, str)
            else f"{self.body} at {self.place} m"
        )


@mappings.plain.register
def _(value: At) -> dict[str, Any]:
    place = (
        {"s" if isinstance(value.place, float) else "group": value.place}
        if value.place != ""
        else {}
    )
    return {"body": value.body, **place}


Ground = Sequence[float]  #: coordinates of a fixed point [m]


@dataclass
class ProbeRows:
    """Probe rows collected while a system is assembled, P (j, q) as blocks one below the other.

        y = P q + y0

    with y0 (j,).
    """

    size: int
    rows: list[csr_array] = field(default_factory=list)
    offsets: list[np.ndarray] = field(default_factory=list)
    count: int = 0

    def add(self, block: csr_array, offset: np.ndarray | None = None) -> int:
        """Append rows (j, q) with constants (j,), 0 by default.

            y = block @ q + offset

        The number of the first one.
        """
        self.rows.append(block)
        self.offsets.append(np.zeros(block.shape[0]) if offset is None else offset)
        first = self.count
        self.count = self.count + block.shape[0]
        return first

    def rows_of(self, numbers: Sequence[int]) -> tuple[csr_array, np.ndarray]:
        """Some of the rows (j, q) and their constants (j,)."""
        whole = self.affine()
        return as_csr(as_csr(whole.matrix)[list(numbers)]), whole.offset[list(numbers)]

    def affine(self) -> Affine:
        """All rows as one affine map.

            y = matrix @ q + offset

        matrix (j, q), offset (j,).
        """
        matrix = stacked(self.rows) if self.rows else csr_array((0, self.size))
        return Affine(matrix, np.concatenate([np.zeros(0), *self.offsets]))


@dataclass(frozen=True)
class Coordinates:
    """Where each body's coordinates stand in q: those of the body `name` begin at first[name], b c
    of them, function by function.

    Its methods give rows on all coordinates q (q,), of places that joints, loads and outputs name;
    InputError where a body or a place does not exist names them, after `where`, the place in
    messages.
    """

    dim: int
    bodies: dict[str, Body]
    first: dict[str, int]
    size: int
    origin: np.ndarray  #: (c,) from which coordinates count [m]
    known: dict[Hashable, csr_array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def shift(self) -> np.ndarray:
        """Coordinates (q,) of the displacement of all bodies by the origin."""
        return np.concatenate(
            [np.kron(part.constant, self.origin) for part in self.bodies.values()]
        )

    def body(self, where: str, at: At) -> Body:
        """The body of a place; InputError where there is none of that name."""
        if at.body not in self.bodies:
            raise InputError(
                say(where, f"one of the bodies {listed(self.bodies, at.body)}", f"'{at.body}'")
                + closest(at.body, self.bodies)
            )
        return self.bodies[at.body]

    def read(self, where: str, at: At, derivative: int = 0) -> csr_array:
        """Rows (c, q) of the position (derivative 0) [m] or of a vector (1, 2, 3) at a place, see
        `bodies.body.probe`.

        InputError where the place has no such vector.
        """
        part = self.body(where, at)
        known = "read", at, derivative
        if known not in self.known:
            self.known[known] = self.spread(part, self.row(part, at.place, derivative))
        return self.known[known]

    def row(self, part: Body, place: str | float, derivative: int = 0) -> csr_array:
        """Row (1, b) of the position or a vector at a place of a body, see `bodies.body.probe`; it
        is found once.

        `place` is as of `bodies.body.locate`, which raises InputError.
        """
        # lengths along a body count from where it stands
        own = derivative or not isinstance(place, str)
        known = (place, derivative, part.name if own else "")
        return self.remember(part, known, lambda: probe(part, locate(part, place), derivative))

    def remember(self, part: Body, key: Hashable, find: Callable[[], csr_array]) -> csr_array:
        """Rows of a body that are found once for all copies of a part, wherever these stand."""
        alike = (
            key,
            *(
                id(one)
                for one in (part.space, part.spread, part.mass, part.axes, part.places, part.frames)
            ),
        )
        if alike not in self.known:
            self.known[alike] = find()
        return self.known[alike]

    def vectors(self, where: str, at: At) -> list[csr_array]:
        """Rows (c, q) of all vectors that a place carries; in the plane a slope also carries its
        normal.

        One array a vector; none of a mere point.
        """
        found = [
            self.read(where, at, k + 1) for k in range(directions(self.body(where, at), at.place))
        ]
        if len(found) == 1 and self.dim == 2:
            if ("normal", at) not in self.known:
                self.known["normal", at] = csr_array(QUARTER @ found[0])
            found.append(self.known["normal", at])
        return found

    def spread(self, part: Body, rows: csr_array) -> csr_array:
        """Rows A (x, b) on the functions of one body as rows (x c, q), at the place of the body.

            A (x) I

        Row x c + k reads component k.
        """
        found = as_csr(rows)
        dim = self.dim
        of = np.repeat(np.arange(found.shape[0]), dim)
        axis = np.tile(np.arange(dim), found.shape[0])
        lengths = np.diff(found.indptr)[of]
        starts = np.append(0, np.cumsum(lengths))
        entry = np.arange(starts[-1]) + np.repeat(found.indptr[of] - starts[:-1], lengths)
        columns = self.first[part.name] + dim * found.indices[entry] + np.repeat(axis, lengths)
        return csr_array((found.data[entry], columns, starts), shape=(len(of), self.size))

    def widen(self, name: str, rows: csr_array) -> csr_array:
        """Rows (x, b c) on the coordinates of one body as rows (x, q)."""
        block = csr_array(rows).tocoo()
        return csr_array(
            (block.data, (block.row, block.col + self.first[name])),
            shape=(block.shape[0], self.size),
        )

    def fixed(self, where: str, point: Ground) -> np.ndarray:
        """A fixed point (c,) of the scene [m] from the origin of the coordinates; InputError where
        it has not c finite numbers.
        """
        return vector(where, point, self.dim) - self.origin

    def apart(self, where: str, at: At, to: At | Ground) -> tuple[csr_array, np.ndarray]:
        """Rows (c, q) and constants (c,) of r_at - r_to [m], where `to` is another place or a fixed
        point of the scene.
        """
        rows = self.read(where, at)
        if isinstance(to, At):
            return as_csr(rows - self.read(where, to)), np.zeros(self.dim)
        return rows, -self.fixed(where, to)

    def reference(self, where: str, at: At | Ground, derivative: int = 0) -> np.ndarray:
        """Reference position [m] or vector (c,) of a place, or position of a fixed point, from the
        origin of the coordinates.
        """
        if not isinstance(at, At):
            return self.fixed(where, at)
        part = self.body(where, at)
        return np.asarray(self.row(part, at.place, derivative) @ part.reference)[0]


def directions(part: Body, place: str | float) -> int:
    """Number of vectors at a place: c axes of a frame or rigid body, 2 tangents of a surface, 1
    slope of a line, 0 of a point.
    """
    if place in part.frames or (part.space is None and part.frames):
        return part.dim
    if part.directors is not None:
        return directors(part)
    if part.space is None or isinstance(part.space, Nodes | Solid):
        return 0
    return 2 if isinstance(part.space, Surface) else 1


def vector(where: str, values: Any, size: int) -> np.ndarray:
    """A finite vector (size,) of values; InputError, after the place `where`, for another length or
    values that are not finite.
    """
    return arrays.finite(values, where, f"{size} finite numbers", size)


@dataclass
class TermCollector:
    """Constraint terms collected while a system is assembled: `row` adds a polynomial, `law` a row
    by a law.

    Rows are numbered from 0 in the order in which they come; a row is known by its joint and the
    name of its coordinate.
    """

    names: list[tuple[str, str]] = field(default_factory=list)
    terms: list[tuple[int, float, int, int, int]] = field(default_factory=list)
    #: (3,) of the rows whose multipliers are moments
    axes: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)
    #: (c,) of those that are forces, in the reference
    directions: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)
    laws: list[LawRows] = field(default_factory=list)
    #: of joints with many rows, by name
    resultants: dict[str, Resultant] = field(default_factory=dict)
    edges: list[str] = field(default_factory=list)  #: joints that hold edges

    def row(
        self,
        joint: str,
        coordinate: str,
        *terms: tuple[float, int, int, int],
        about: tuple[np.ndarray, np.ndarray] | None = None,
        along: np.ndarray | None = None,
    ) -> None:
        """One constraint by terms (coefficient, signal, i, j).

            sum coefficient s(t) y_i y_j = 0

        Numbers -1 stand for a factor 1. `about` is (u, n) of u . n = 0, vectors (c,), a moment
        about u x n; `along` (c,) is the direction of a force that is along no axis. InputError
        where a coefficient is no finite number, or a signal, i or j is no whole number from -1 on.
        """
        given: tuple[Any, ...] = terms
        for factor, *places in given:
            known = (
                isinstance(factor, int | float | np.number)
                and np.isfinite(factor)
                and len(places) == 3
            )
            if not known or not all(
                isinstance(one, int | np.integer) and one >= -1 for one in places
            ):
                expected = (
                    "terms of a finite coefficient, and numbers of a signal and of rows i, j, or -1"
                )
                raise InputError(say(f"joint '{joint}'.{coordinate}", expected, (factor, *places)))
        self.names.append((joint, coordinate))
        if along is not None:
            self.directions[joint, coordinate] = along
        if about is not None:
            u, n = (np.pad(vector, (0, 3 - len(vector))) for vector in about)
            self.axes[joint, coordinate] = np.cross(u, n)
        self.terms += [(len(self.names) - 1, *term) for term in terms if term[0] != 0.0]

    def law(
        self,
        joint: str,
        coordinate: str,
        law: str | ConstraintLaw,
        rows: Sequence[int],
        numbers: ArrayLike = (),
        signals: Sequence[int] = (),
    ) -> None:
        """One constraint phi = 0 by a law or its name, of probe rows (r,), with its numbers (p,)
        and functions of time (h,).

        InputError where no law has that name.
        """
        self.names.append((joint, coordinate))
        self.laws.append(constraint_laws.one(law, len(self.names) - 1, rows, numbers, signals))

    def arrays(self) -> Constraints:
        """The rows as arrays."""
        columns = list(zip(*self.terms, strict=True)) or [(), (), (), (), ()]
        row, signal, i, j = (np.array(columns[k], dtype=np.int64) for k in (0, 2, 3, 4))
        laws = row_laws.join(self.laws)
        return Constraints(
            tuple(self.names),
            row,
            np.array(columns[1], dtype=float),
            signal,
            i,
            j,
            laws,
            edges=tuple(self.edges),
        )


@dataclass
class Forces:
    """Loads collected while a system is assembled: forces on probe rows, cells of pressures that
    follow, and gravity.
    """

    terms: list[Any] = field(default_factory=list)  #: forces on probe rows, see `forces`
    #: name, body and cells of what follows a surface
    cells: list[tuple[str, Body, Cells]] = field(default_factory=list)
    #: accelerations of all bodies (c,) [m/s2]
    field: list[np.ndarray] = field(default_factory=list)

    def dead(self, rows: Sequence[int], coefficients: ArrayLike, signal: int = -1) -> None:
        """Forces coefficient s(t) on probe rows [N per unit of the row], s the function of time of
        this number or 1 (-1).

        One coefficient a row. InputError where a coefficient is not finite.
        """
        if not np.isfinite(np.asarray(coefficients, dtype=float)).all():
            raise InputError(say("dead forces", "finite coefficients", coefficients))
        self.terms.append(
            force_laws.dead(
                np.array(rows, dtype=np.int64), coefficients, np.full(len(rows), signal)
            )
        )

    def act(
        self,
        law: str | ForceLaw,
        rows: Sequence[int],
        numbers: ArrayLike = (),
        signals: Sequence[int] = (),
    ) -> None:
        """A force by a law or its name on probe rows (r,), with its numbers (p,) and functions of
        time (h,).

        InputError where no law has that name.
        """
        self.terms.append(force_laws.one(law, rows, numbers, signals))


@dataclass(frozen=True)
class Gauge:
    """What a load measures, for outputs: a vector between places, a coordinate or an angle on its
    probe rows (r,).
    """

    kind: str  #: see `gauges`
    rows: tuple[int, ...]
    free: float  #: length or angle from which its stretch counts [m, rad]


class Origin(NamedTuple):
    """What a joint or a load has put into a system: its forces, before those of one kind were
    joined, and its functions of time.
    """

    subject: str  #: as messages name it, such as "load 'floor'"
    forces: tuple[Any, ...]
    signals: range


@dataclass
class Draft:
    """A system while it is assembled: joints and loads add their probe rows, constraint rows,
    forces and signals to it.

    Numbers of rows and signals that its parts give out are those of the finished system.
    """

    layout: Coordinates
    probes: ProbeRows
    sensors: ProbeRows
    constraints: TermCollector = field(default_factory=TermCollector)
    forces: Forces = field(default_factory=Forces)
    signals: list[Signal] = field(default_factory=list)
    markers: list[tuple[str, str, tuple[int, ...]]] = field(default_factory=list)
    gauges: dict[str, Gauge] = field(default_factory=dict)  #: of loads by name
    pushed: dict[str, range] = field(default_factory=dict)  #: probe rows of loads by name
    #: of forces and signals, by joints and loads
    origins: list[Origin] = field(default_factory=list)
    #: by name, for expressions of the state
    outputs: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Source] = field(default_factory=dict)  #: by name, for the same
    locks: Sequence[Lock] = ()  #: of joints that events lock
    loose: tuple[str, ...] = ()  #: joints that may be let loose in a motion
    #: joints and loads, as messages name them, and the places that they act on
    acting: Sequence[tuple[str, At]] = ()
    pictured: bool = True  #: whether joints and loads show themselves in pictures

    @contextmanager
    def origin(self, subject: str) -> Iterator[None]:
        """What a joint or a load, as messages name it, puts into the draft within is noted as its
        own.
        """
        forces, signals = len(self.forces.terms), len(self.signals)
        yield
        self.origins.append(
            Origin(subject, tuple(self.forces.terms[forces:]), range(signals, len(self.signals)))
        )

    def require_rows(self) -> None:
        """InputError where joints or loads have rows or functions that there are none of: compiled
        code reads them unasked.
        """
        rows = self.probes.count
        signals = len(self.signals)
        for k, _, signal, i, j in self.constraints.terms:
            if max(i, j) >= rows or signal >= signals:
                joint, coordinate = self.constraints.names[k]
                got = f"signal {signal}, rows {i} and {j}"
                raise InputError(
                    say(
                        f"joint '{joint}'.{coordinate}",
                        f"numbers of the {signals} signals and {rows} rows",
                        got,
                    )
                )
        for one in (*self.forces.terms, *self.constraints.laws):
            if isinstance(one, row_laws.Groups):
                for what, numbers, least, count in (
                    ("rows", one.rows, 0, rows),
                    ("signals", one.signals, -1, signals),
                ):
                    if numbers.size and not least <= numbers.min() <= numbers.max() < count:
                        got = f"{what} {numbers.ravel().tolist()[:9]}"
                        raise InputError(
                            say(
                                f"law '{one.law.name}'",
                                f"numbers of the {count} {what} that there are",
                                got,
                            )
                        )

    def signal(self, function: Signal | None) -> int:
        """The number of a function of time, which is added to the system; -1 for None, the constant
        1.

        It takes times (s,) [s] and gives values (s,). InputError where it is no function.
        """
        if function is None:
            return -1
        given: object = function
        if not callable(given):
            remedy = "make one of a number or a text: expressions.of_time(2.0)"
            raise InputError(say("signal", "a function of time", repr(function), remedy))
        self.signals.append(function)
        return len(self.signals) - 1
