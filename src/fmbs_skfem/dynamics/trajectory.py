"""What a run gives: the motion at stored times, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from ..core.storage.records import dataclass
from ..systems.system import System

# a hyper-reduced beam whose 250 steps were divided 140 times ended 89 % off; a first step that is
# divided is no doubt
OFTEN = 0.1  #: failures of the iteration over steps, from which a motion is doubted
ONE_STEP = 6  #: failures of a single step that is divided by 64
COLUMNS = ("times", "x", "v", "a", "multipliers")  #: of a motion, a row a state
STORED = ("memory", "work", "negative")  #: columns that not every motion has
#: those with a row for every state that is kept
OF_STATES = (
    "x",
    "v",
    "a",
    "multipliers",
    "memory",
)


@dataclass(frozen=True)
class Statistics:
    """What a run cost."""

    steps: int = 0
    iterations: int = 0
    factorisations: int = 0
    halved: int = 0
    cpu_s: float = 0.0
    wall_s: float = 0.0
    solver: str = ""  #: of the linear systems

    @property
    def unresolved(self) -> bool:
        """Whether the iteration failed so often that the motion is hardly resolved and may have
        left its path.
        """
        return self.halved > max(ONE_STEP, OFTEN * self.steps)


@dataclass(frozen=True)
class Gap:
    """How far apart the two places of a joint are where it is locked, which stays so; None where
    there is no second place.
    """

    joint: str
    distance: float | None  #: [m]
    angle: float | None  #: between frames, or directions in the plane [rad]


@dataclass(frozen=True)
class Happening:
    """An event that has happened in a run."""

    name: str
    time: float  #: [s]
    stop: bool
    release: tuple[str, ...]  #: joints
    lock: tuple[str, ...]
    loss: float  #: of kinetic energy by locks; of events at one instant the first one's [J]
    gaps: tuple[Gap, ...] = ()  #: of the joints that it locks


@dataclass(frozen=True)
class Crossing:
    """What lies between two equilibria that follow one another on a path of them, or in one of its
    points.
    """

    kind: Literal["leap", "branch point", "limit point"]
    before: float  #: load factor, or time [s]
    after: float
    distance: float  #: the longest way of a point from one to the other [m]
    place: str  #: which point that is
    negative: tuple[int | None, int | None]  #: negative pivots before and after
    sign: str  #: by what it is known


@dataclass(frozen=True)
class Way:
    """What sensors read on the whole way along a path of equilibria, of which not all are kept."""

    values: np.ndarray  #: (p, i) sensor rows
    kept: np.ndarray  #: (s,) which of them the kept equilibria are


@dataclass(frozen=True)
class Trace:
    """What was read of the states of a motion while it ran, at all of its times, of which not all
    keep their states.
    """

    values: np.ndarray  #: (s, i) sensor rows that outputs read, see `outputs.rows_read`
    rates: np.ndarray  #: (s, i)
    accelerations: np.ndarray  #: (s, i)
    survey: np.ndarray  #: (s, 4) energies [J] and power [W], see `outputs.survey`
    sizes: np.ndarray  #: (s, 3) see `outputs.sizes_of`
    reactions: np.ndarray  #: (s, r) as of `outputs.reactions`, (s, 0) where no output reads them
    pushes: np.ndarray  #: (s, j) as of `outputs.pushes`, (s, 0) likewise

    def part(self, states: slice | np.ndarray) -> Trace:
        """That at some of the times."""
        return Trace(**{name: column[states] for name, column in vars(self).items()})


def joined_traces(parts: Sequence[Trace]) -> Trace:
    """Parts of a trace behind each other."""
    return Trace(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
    )


@dataclass(frozen=True, repr=False)
class Trajectory:
    """Motion of a system at stored times."""

    system: System
    times: np.ndarray  #: (s,) [s]
    x: np.ndarray  #: (s, n)
    v: np.ndarray  #: (s, n)
    a: np.ndarray  #: (s, n), accelerations q''
    multipliers: np.ndarray  #: (s, m), physical
    statistics: Statistics = Statistics()  #: zeros of states that no run has made
    memory: np.ndarray | None = None  #: (s, l) what forces keep of the states, where it was stored
    events: tuple[Happening, ...] = ()
    #: (s,) of all that has no potential, summed over all steps [J], where that was done
    work: np.ndarray | None = None
    heat: float = 0.0  #: what elastic damping has taken of it, in all [J]
    #: (s,) negative pivots of equilibria, nan where there is no such number
    negative: np.ndarray | None = None
    crossings: tuple[Crossing, ...] = ()  #: of a path of equilibria
    way: Way | None = None  #: of a path of equilibria
    #: errors of outputs by column, over their ranges, that parts make, see `finer_parts`; None
    #: where they are not known
    part_errors: Mapping[str, float] | None = None
    #: what finding these took: `unknowns`, `cpu_s` and `wall_s` [s]
    part_check: Mapping[str, float] | None = None
    trace: Trace | None = None  #: what was read of the states while it ran
    #: (k,) which of the times have states, where not all do: then x, v, a, multipliers and memory
    #: have k rows
    kept: np.ndarray | None = None

    def part(self, states: slice | np.ndarray) -> Trajectory:
        """The motion at some of its times, ascending."""
        own = {
            name: column
            for name in (*COLUMNS, *STORED)
            if (column := getattr(self, name)) is not None
        }
        kept = self.kept
        found = dict.fromkeys(own, states)
        if kept is not None:
            _, new, old = np.intersect1d(
                np.arange(len(self.times))[states], kept, return_indices=True
            )
            kept = new
            found = found | dict.fromkeys(own.keys() & set(OF_STATES), old)
        way = None if self.way is None else replace(self.way, kept=self.way.kept[states])
        trace = None if self.trace is None else self.trace.part(states)
        return replace(
            self,
            way=way,
            trace=trace,
            kept=kept,
            **{name: column[found[name]] for name, column in own.items()},
        )

    @property
    def states(self) -> Trajectory:
        """The motion at those of its times that have states, all by default."""
        return self if self.kept is None else replace(self.part(self.kept), kept=None, trace=None)

    def __repr__(self) -> str:
        first, last = self.times[[0, -1]]
        states = "" if self.kept is None else f", {len(self.kept)} of them with states"
        return f"<Trajectory {len(self.times)} instants from {first:g} to {last:g}{states}, {self.x.shape[1]} unknowns>"


def joined(one: Trajectory, other: Trajectory) -> Trajectory:
    """A motion and its continuation, with what both have stored."""
    found: dict[str, Any] = {}
    for name in (*COLUMNS, *STORED):
        a, b = getattr(one, name), getattr(other, name)
        found[name] = None if a is None or b is None else np.concatenate([a, b])
    return replace(other, way=None, trace=None, **found)
