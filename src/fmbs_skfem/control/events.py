r"""Events: an expression of outputs that crosses zero stops a run, releases joints, or locks them.

    g(outputs, t) = 0        release    no row of the joint holds from then on
                             lock       its places `at` and `to` move as one from then on, in whatever position they are then:

    d = r_a - r_b = sum_k s_k e_k,     e_i . (sum_k Q_jk f_k) = 0  (i < j),     s_k = d . e_k,  Q_jk = e_j . f_k  at the event

with axes e of `at` and f of `to`. In the plane a direction u of each does: c (w x u) - s (w . u) =
0, c = w . u, s = w x u at the event. The ground has axes. A place without a direction is held at
its position alone, in the axes of the other one. The rows of a lock take the place of those of the
joint itself; they stand beside the system until a run has an event (`with_locks`).

The gap between two places, which a lock keeps, is the distance |d| and the angle atan2(|a|, c) of
two frames or directions: a = sum_k f_k x e_k / 2, c = (sum_k f_k . e_k - 1) / 2 in space, a = w x
u, c = w . u in the plane.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, Literal

import numpy as np
from scipy.sparse import csr_array

from ..core.errors import InputError, closest, listed, say
from ..core.storage.records import dataclass
from ..core.values import conditions
from ..core.values.fields import AXES, NAMED
from ..core.values.inputs import Held
from ..core.values.problems import Problem
from ..core.values.responses import OfState
from ..systems import fields
from ..systems.additions import Addition, adds
from ..systems.connections.constraint_functions import Joint, Term, basis, mark, where
from ..systems.places import QUARTER, At, Draft, TermCollector
from ..systems.prepared import remembered
from ..systems.system import Constraints, Lock, System, Trigger

CYCLES = (1, 2), (2, 0), (0, 1)  #: components of the parts of a cross product
DIRECTIONS = {"rising": 1, "falling": -1, "both": 0}
Names = Annotated[tuple[str, ...], NAMED, "of joints"]


@dataclass(frozen=True, kw_only=True)
class Event:
    """What happens where `when`, an expression of outputs, crosses zero: in one direction, or in
    both.

    The run stops there, joints named in `release` hold no longer, and the two places of joints
    named in `lock` move as one. It happens every time that `when` crosses zero, or the first time
    alone: `once: true`. A comparison rises where it becomes true.
    """

    when: Annotated[OfState, fields.response("")]
    direction: Literal["rising", "falling", "both"] = "both"
    once: bool = False
    stop: bool = False
    release: Names = ()
    lock: Names = ()

    def problems(self) -> Iterator[tuple[str, Problem]]:
        """What is wrong with it by itself: names of fields, and problems."""
        if not (self.stop or self.release or self.lock):
            yield (
                "",
                Problem(
                    "something that happens",
                    "nothing",
                    "say 'stop: true', or which joints to release or to lock",
                ),
            )
        if not (self.when.outputs or self.when.clocked):
            yield (
                "when",
                Problem(
                    "an expression of outputs or t, which crosses zero",
                    f"'{self.when.text}', which never changes",
                ),
            )
        for name in self.release:
            if name in self.lock:
                yield (
                    "lock",
                    Problem(
                        "a joint to be released or to be locked",
                        f"'{name}' for both",
                        "locking releases it first",
                    ),
                )


@dataclass(frozen=True)
class Latch(Joint):
    """Holds nothing until an event locks it: its two places then move as one, in whatever position
    they are.

    A distance between them then stays. Where it is more than a fiftieth of the size of the
    mechanism, a warning says so.

    {type: latch, at: gripper.frame, to: part.frame}
    """

    name: str
    at: fields.Place
    to: fields.Carrier = None

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "latch", self.at)


@dataclass
class Holding:
    """Rows of a lock while they are collected."""

    joint: Any
    draft: Draft
    rows: TermCollector = field(default_factory=TermCollector)
    numbers: TermCollector = field(default_factory=TermCollector)
    gap: TermCollector = field(default_factory=TermCollector)
    signals: list[int] = field(default_factory=list)

    def number(self, *terms: Term) -> int:
        """The signal of a number that is a polynomial in probe rows when the event happens."""
        label = f"number {len(self.signals) + 1} of the lock '{self.joint.name}'"
        self.numbers.row(self.joint.name, label, *terms)
        self.signals.append(self.draft.signal(Held(label)))
        return self.signals[-1]

    def row(
        self, label: str, *terms: Term, about: tuple[np.ndarray, np.ndarray] | None = None
    ) -> None:
        self.rows.row(self.joint.name, f"{label} locked", *terms, about=about)


@adds("events")
class Events(Addition):
    """Events by name."""

    def __init__(self, given: Mapping[str, Event], draft: Draft) -> None:
        self.events = given
        for name, event in given.items():
            if not isinstance(event, Event):
                raise InputError(say(f"event '{name}'", "an event", type(event).__name__))

    def reads(self) -> Iterator[tuple[str, OfState]]:
        """Expressions that cross zero, behind each that is a condition its margin."""
        for name, event in self.events.items():
            yield f"event '{name}'", event.when
            if (margin := conditions.margin_of(event.when)) is not None:
                yield f"event '{name}'", margin

    def add(
        self, draft: Draft, joints: Sequence[Joint], numbers: Sequence[int]
    ) -> Mapping[str, Any]:
        """Triggers and locks; joints that are let loose."""
        known = {joint.name: joint for joint in joints}
        triggers = list[Trigger]()
        told = iter(numbers)
        for name, event in self.events.items():
            require_joints(name, event, known)
            number = next(told)
            margin = next(told) if conditions.margin_of(event.when) is not None else None
            acts = event.stop, event.release, event.lock, event.once
            compares = event.when.program[-1] in conditions.COMPARISONS
            triggers.append(
                Trigger(name, number, DIRECTIONS[event.direction], *acts, margin, compares)
            )
        locked = dict.fromkeys(name for one in triggers for name in one.lock)
        for joint in joints:
            if self.events and isinstance(joint, Latch) and joint.name not in locked:
                raise InputError(
                    say(
                        where(joint),
                        "an event that locks it",
                        "none",
                        "name it in 'lock' of an event, or remove it",
                    )
                )
        released = dict.fromkeys(name for one in triggers for name in one.release)
        parked = [park_of(draft, name, one) for name in released for one in known[name].coordinates]
        draft.locks = (*(lock_of(draft, known[name]) for name in locked), *parked)
        draft.loose = tuple(dict.fromkeys([*locked, *released]))
        return {"triggers": tuple(triggers), "locks": draft.locks}


def require_joints(name: str, event: Event, known: Collection[str]) -> None:
    """InputError for an event with problems, or with a joint that is none of those known.

    `known` are the names of the joints of the system.
    """
    place = f"event '{name}'"
    for key, problem in event.problems():
        raise InputError(problem.at(f"{place}.{key}" if key else place))
    for key, names in (("release", event.release), ("lock", event.lock)):
        for one in names:
            if one not in known:
                raise InputError(
                    say(f"{place}.{key}", f"one of the joints {listed(known, one)}", f"'{one}'")
                    + closest(one, known)
                )


def park_of(draft: Draft, joint: str, coordinate: str) -> Lock:
    """The row that holds a coordinate of a joint where it is, once the joint is released: nothing
    else determines it then.
    """
    park = Latch(f"{coordinate} parked", At(coordinate))
    found = Holding(park, draft)
    row = draft.probes.add(csr_array(draft.layout.read(where(park), park.at)[[0]]))
    found.row("place", (1.0, -1, row, -1), (-1.0, found.number((1.0, -1, row, -1)), -1, -1))
    signals = np.array(found.signals, dtype=np.int64)
    return Lock(
        park.name, found.rows.arrays(), found.numbers.arrays(), signals, found.gap.arrays(), joint
    )


def lock_of(draft: Draft, joint: Joint) -> Lock:
    """The rows that hold the two places of a joint together.

    InputError for a joint that is not between two places, or a place and the ground.
    """
    at, to = getattr(joint, "at", None), getattr(joint, "to", None)
    if not isinstance(at, At) or joint.coordinates:
        remedy = "lock a latch between two places"
        raise InputError(
            say(
                where(joint),
                "a joint between two places, or a place and the ground",
                joint.word,
                remedy,
            )
        )
    found = Holding(joint, draft)
    other = to if isinstance(to, At) else None
    axes = vectors(found, other)
    hold_position(found, at, other, axes)
    hold_direction(found, vectors(found, at) or [], axes)
    draft.constraints.axes |= found.rows.axes
    signals = np.array(found.signals, dtype=np.int64)
    return Lock(
        joint.name, found.rows.arrays(), found.numbers.arrays(), signals, found.gap.arrays()
    )


def vectors(found: Holding, end: At | None) -> list[int] | None:
    """First probe rows of all vectors that a place carries; None for the ground, which has axes."""
    if end is None:
        return None
    rows, _ = basis(where(found.joint), found.draft.layout, end)
    if found.draft.layout.dim == 2 and rows:
        rows = [rows[0], csr_array(QUARTER @ rows[0])]
    return [found.draft.probes.add(one) for one in rows]


def hold_position(found: Holding, at: At, to: At | None, axes: list[int] | None) -> None:
    """d keeps its components along axes: those of the ground, of a frame, or of a slope and its
    normal in the plane.
    """
    layout = found.draft.layout
    name = where(found.joint)
    dim = layout.dim
    apart = layout.read(name, at)
    d = found.draft.probes.add(csr_array(apart if to is None else apart - layout.read(name, to)))
    for c in range(dim if to is not None else 0):
        found.gap.row(found.joint.name, AXES[c], (1.0, -1, d + c, -1))
    if axes is None or len(axes) < dim:
        for c in range(dim):
            found.row(
                AXES[c], (1.0, -1, d + c, -1), (-1.0, found.number((1.0, -1, d + c, -1)), -1, -1)
            )
        return
    size = found.number(*dots(axes[0], axes[0], dim)) if dim == 2 else -1  # of a slope
    parts = [found.number(*dots(d, axis, dim)) for axis in axes]
    for c in range(dim):
        found.row(
            AXES[c],
            (1.0, size, d + c, -1),
            *((-1.0, part, axis + c, -1) for part, axis in zip(parts, axes, strict=True)),
        )


def dots(u: int, w: int, dim: int, factor: float = 1.0) -> list[Term]:
    """Terms of u . w for vectors in probe rows from these on."""
    return [(factor, -1, u + c, w + c) for c in range(dim)]


def cross(u: int, w: int, i: int, j: int, factor: float = 1.0) -> list[Term]:
    """Terms of u_i w_j - u_j w_i for vectors in probe rows from these on."""
    return [(factor, -1, u + i, w + j), (-factor, -1, u + j, w + i)]


def hold_direction(found: Holding, u: list[int], w: list[int] | None) -> None:
    """The directions u of `at` keep their components along those of `to`; nothing where one of the
    places is a mere point.
    """
    if not u or w == []:
        return
    if found.draft.layout.dim == 2:
        return hold_angle(found, u[0], None if w is None else w[0])
    if w is not None and len(w) < 3:
        u, w = w, u
    if len(u) == 2 or (w is not None and len(w) < 3):
        got = f"{found.joint.at} and {getattr(found.joint, 'to', None) or 'the ground'}"
        raise InputError(
            say(
                where(found.joint),
                "a rigid frame or the ground at one end, and a frame or a slope at the other",
                got,
            )
        )
    s = [[found.number(*component(one, w, k)) for k in range(3)] for one in u]
    if len(u) == 3:
        if w is not None:
            found.gap.row(
                found.joint.name,
                "cosine",
                *(t for k in range(3) for t in dots(u[k], w[k], 3, 0.5)),
                (-0.5, -1, -1, -1),
            )
            for i, j in CYCLES:
                found.gap.row(
                    found.joint.name,
                    "sine",
                    *(t for k in range(3) for t in cross(w[k], u[k], i, j, 0.5)),
                )
        own = basis(where(found.joint), found.draft.layout, found.joint.at)[1]
        for i, j in ((0, 1), (0, 2), (1, 2)):
            terms = [term for k in range(3) for term in component(u[i], w, k, s[j][k])]
            found.row(f"angle {i + j}", *terms, about=(own[i], own[j]))
        return
    for k, (i, j) in enumerate(CYCLES):  # u . (s x f_k) = 0, one of which follows from the others
        found.row(
            f"angle {k + 1}", *component(u[0], w, i, s[0][j]), *component(u[0], w, j, s[0][i], -1.0)
        )


def component(
    u: int, w: list[int] | None, k: int, signal: int = -1, factor: float = 1.0
) -> list[Term]:
    """Terms of factor s(t) u . f_k, f_k an axis of a frame or of the ground."""
    return (
        [(factor, signal, u + k, -1)]
        if w is None
        else [(factor, signal, u + c, w[k] + c) for c in range(3)]
    )


def hold_angle(found: Holding, u: int, w: int | None) -> None:
    """An angle is held in the plane.

        c (w x u) - s (w . u) = 0

    On the ground w is the axis x.
    """
    plane = np.eye(2)
    if w is None:
        c, s = found.number((1.0, -1, u, -1)), found.number((1.0, -1, u + 1, -1))
        return found.row("angle", (1.0, c, u + 1, -1), (-1.0, s, u, -1), about=(plane[0], plane[1]))
    cosine = dots(w, u, 2)
    sine = cross(w, u, 0, 1)
    found.gap.row(found.joint.name, "cosine", *cosine)
    found.gap.row(found.joint.name, "sine", *sine)
    c, s = found.number(*cosine), found.number(*sine)
    turned = [(factor, c, i, j) for factor, _, i, j in sine]
    return found.row(
        "angle", *turned, *((-1.0, s, w + k, u + k) for k in range(2)), about=(plane[0], plane[1])
    )


def with_locks(system: System) -> System:
    """The system with the rows of its locks behind those of its joints, always the same, so that it
    is compiled once.

    As it is where there are none, or where it has them. Rows of locks hold nothing until an event
    closes them.
    """
    known = system.constraints
    more = [one.rows for one in system.locks if not set(one.rows.names) & set(known.names)]
    if not more:
        return system

    def find() -> System:
        full = None if system.full is None else with_locks(system.full)
        return replace(system, constraints=appended(known, more), full=full)

    return remembered(system, "locks", find)


def appended(known: Constraints, more: Sequence[Constraints]) -> Constraints:
    """Rows behind others; those of locks have no laws."""
    parts = [known, *more]
    first = np.cumsum([0, *(len(one.names) for one in parts)])
    row = np.concatenate([one.row + start for one, start in zip(parts, first, strict=False)])
    names = tuple(name for one in parts for name in one.names)
    value, signal, i, j = (
        np.concatenate([getattr(one, key) for one in parts])
        for key in ("coefficient", "signal", "i", "j")
    )
    return Constraints(names, row, value, signal, i, j, known.laws, known.loose, known.edges)


def gap_of(lock: Lock, y: np.ndarray) -> tuple[float | None, float | None]:
    """Distance [m] and angle [rad] of the two places of a lock where probe rows are y (j,); None
    for what it lacks.

        |d|,    atan2(|a|, c)
    """
    found = polynomials(lock.gap, y)
    apart = np.array([label in AXES for _, label in lock.gap.names], dtype=bool)
    turned = found[~apart]
    distance = float(np.linalg.norm(found[apart])) if apart.any() else None
    return distance, float(np.arctan2(np.linalg.norm(turned[1:]), turned[0])) if len(
        turned
    ) else None


def polynomials(terms: Constraints, y: np.ndarray) -> np.ndarray:
    """Polynomials (m,) without signals where probe rows are y (j,)."""
    read = np.append(y, 1.0)
    found = np.zeros(len(terms.names))  # the number -1 reads 1
    np.add.at(found, terms.row, terms.coefficient * read[terms.i] * read[terms.j])
    return found
