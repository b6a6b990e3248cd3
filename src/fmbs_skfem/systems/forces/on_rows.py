"""Forces on probe rows as terms: what joints' and loads' rows y = P x + y0 are pushed by, whichever
force it is.

    g += F(y, y', signals, memory),     H += - c (dF/dy + gh dF/dy'),     memory <- what the accepted state leaves behind

A force is a struct of arrays; for its type it registers `compile_force`: a record and routines that
act on it, with the pairs of rows in which it has derivatives. It may keep numbers from step to
step, such as the turns of an angle: they belong to accepted states alone. Where it has a potential,
that is stored energy in the balance, and the rest of it works. Where a history drives it,
`histories` says so and `grow` lets a constant one grow with the load factor of statics. Nothing
else asks which force it is. Most are laws (`force_laws`); `OfPython` is any function.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import field
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from ...core.compiling.structs import Callback, Routine, unpacked
from ...core.storage.records import dataclass
from ..evaluation import Evaluation, ForceTerms
from ..terms.elastic import Nothing, Piece
from .low_rank import NONE, Size


class ForceRoutines(NamedTuple):
    """What a record of forces is acted on by; each takes the table of the evaluation and the
    record.

    None stands for a routine that it does not need.
    """

    force: Routine | Callback  #: g += F
    #: H += - c (dF/dy + gh dF/dy') on its pairs, from the place it was given on
    slopes: Routine | Callback | None = None
    #: its memory in the state of the space, which is accepted
    accept: Routine | Callback | None = None
    #: energy += E and g += dE/dy, where a potential E makes F or a part of it
    energy: Routine | Callback | None = None
    #: impulse += how much too fast it changes in a step, before the state is accepted
    judge: Routine | Callback | None = None


#: where `ForceTerms` has the records that each of these routines acts on
RECORDS = {
    "force": "records",
    "slopes": "sloped",
    "accept": "accepted",
    "energy": "stored",
    "judge": "judged",
}


class Place(NamedTuple):
    """The first of the places of a force: in the derivatives H, in the memory of accepted states,
    and in the room of the space.
    """

    pair: int  #: in H
    memory: int
    room: int


@dataclass
class Cost:
    """What functions of Python cost so far."""

    calls: int = 0
    seconds: float = 0.0  #: of the process


@dataclass(frozen=True)
class Force(Piece):
    """A force for compiled code: a record, and routines that act on it; h pairs of rows, l numbers
    of memory.
    """

    routines: ForceRoutines
    name: str = "force"  #: in messages
    #: (h, 2) probe rows of its derivatives
    pairs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    memory: np.ndarray = field(default_factory=lambda: np.zeros(0))  #: (l,) at the start
    #: (l,) which numbers of its memory are angles, whose turns follow from their rates where states
    #: are far apart
    turns: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    damped: bool = False  #: whether it reads the rates y'
    #: numbers that it finds out about accepted states, on which nothing but time depends
    room: int = 0
    #: rows that it alone reads, by itself
    alone: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    skew: bool = False  #: whether its derivatives on pairs are far from symmetric
    #: of its derivatives on rows that are others in every state, which it alone reads
    low: Size = NONE
    cost: Cost | None = None  #: of a function of Python
    smooth: bool = False  #: whether its derivatives jump nowhere
    reacts: bool = False  #: whether it depends on the multipliers of joints, as friction in them
    places: int = 0  #: where it begins and ends, each place by itself; 0 for lines and faces, and bodies of many points


@singledispatch
def compile_force(force: Any, place: Place) -> Force:
    """A force for compiled code, whose numbers in H, memory and room begin at a place.

    Types of forces register here; TypeError for a type that has not.
    """
    raise TypeError(type(force))


@singledispatch
def histories(force: Any) -> Sequence[tuple[int, int]]:
    """The signals that drive a force, each with a probe row that it pushes.

    Types of forces register here; others have none.
    """
    return ()


@singledispatch
def grow(force: Any, signal: int) -> Any:
    """The force with the signal of a load factor where it has a constant in place of a history.

    Types of forces register here; others stay as they are.
    """
    return force


@singledispatch
def join(force: Any, others: Sequence[Any]) -> Sequence[Any]:
    """Forces of one type as few as they can be, the first one and the others: all of them where the
    type does not register.
    """
    return [force, *others]


def is_force(value: Any) -> bool:
    """Whether a force can be made of a value: whether its type has registered with `compile_force`."""
    return compile_force.dispatch(type(value)) is not compile_force.dispatch(object)


def joined(found: Sequence[Any]) -> tuple[Any, ...]:
    """Forces collected one by one as few as they can be, in the order of their first ones: those of
    each type as `join` says.
    """
    kinds: dict[type, list[Any]] = {}
    for one in found:
        kinds.setdefault(type(one), []).append(one)
    return tuple(force for first, *others in kinds.values() for force in join(first, others))


@dataclass(frozen=True)
class OfPython:
    """F(y, y', h) of probe rows, their rates and histories, a function of Python: about 0.1 ms a
    call beside its own time.

    Without `slopes` its derivatives are differences. A file cannot hold it.
    """

    rows: np.ndarray  #: (r,) that it reads and pushes
    #: y (r,), y' (r,), h (i,) -> F (r,)
    function: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    signals: tuple[int, ...] = ()  #: (i,) numbers of its histories
    #: y, y', h -> dF/dy, dF/dy' (r, r)
    slopes: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = (
        None
    )
    #: (r,) of rows, and of rates in a second, that differences are small beside
    sizes: np.ndarray | float = 1.0

    def __len__(self) -> int:
        return 1


# relative, as 1e-5 m is longer than a soft spring of 1 um, which then loses all of its stiffness
STEP = 1e-5  #: of differences, relative to the size of the rows and rates


def difference(
    function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, sizes: np.ndarray | float
) -> np.ndarray:
    """Derivative (i, r) of a function of x (r,) by central differences of fourth order, small
    beside sizes (r,) and x.
    """
    columns = []
    steps = STEP * np.maximum(sizes, np.abs(x))
    for direction, h in zip(np.diag(steps), steps, strict=True):
        near, far = (function(x + k * direction) - function(x - k * direction) for k in (1, 2))
        columns.append((8 * near - far) / (12 * h))
    return np.array(columns).T


@compile_force.register
def _(force: OfPython, place: Place) -> Force:
    rows = np.asarray(force.rows, np.int64)
    count = len(force.rows)
    cost = Cost()

    def called(
        y: np.ndarray,
        rates: np.ndarray,
        signals: np.ndarray,
        function: Callable[..., Any] = force.function,
    ) -> Any:
        begin = clock.process_time()
        found = function(y, rates, signals)
        cost.calls, cost.seconds = cost.calls + 1, cost.seconds + clock.process_time() - begin
        return found

    def read(table: int) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray]:
        s = unpacked(Evaluation, table).space
        return s, s.y[rows], s.rates[rows], s.signals[list(force.signals)]

    def push(table: int, _: int) -> None:
        s, y, rates, signals = read(table)
        np.add.at(s.g, rows, called(y, rates, signals))

    def slopes(table: int, _: int) -> None:
        s, y, rates, signals = read(table)
        if force.slopes is not None:
            by_row, by_rate = called(y, rates, signals, force.slopes)
        else:
            by_row = difference(lambda z: called(z, rates, signals), y, force.sizes)
            by_rate = difference(lambda z: called(y, z, signals), rates, force.sizes)
        s.H[place.pair : place.pair + count**2] -= s.c[0] * (by_row + s.gh[0] * by_rate).ravel()

    pairs = np.stack([np.repeat(rows, count), np.tile(rows, count)], axis=1)
    return Force(
        Nothing(),
        ForceRoutines(Callback(push), Callback(slopes)),
        "force of Python",
        pairs,
        damped=True,
        cost=cost,
    )


@histories.register
def _(force: OfPython) -> Sequence[tuple[int, int]]:
    return [(signal, int(force.rows[0])) for signal in force.signals]


def cost_of(found: Sequence[Force]) -> Cost:
    """What functions of Python among forces cost so far: the sum of their calls and of their time
    [s].
    """
    known = [one.cost for one in found if one.cost is not None]
    return Cost(sum(one.calls for one in known), sum(one.seconds for one in known))


def addressed(found: Sequence[Force]) -> ForceTerms:
    """Forces by address for compiled code; the caller keeps them, as the addresses point to their
    memory.
    """

    def column(values: list[int]) -> np.ndarray:
        return np.array(values, dtype=np.int64)

    columns = dict[str, Any]()
    for name, records in RECORDS.items():
        having = [one for one in found if getattr(one.routines, name) is not None]
        columns[name] = column([getattr(one.routines, name).address for one in having])
        columns[records] = column([one.address for one in having])
    return ForceTerms(
        **columns, damped=any(one.damped for one in found), smooth=all(one.smooth for one in found)
    )
