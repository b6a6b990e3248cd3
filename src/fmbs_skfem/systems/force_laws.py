"""Forces by a law: F(y, y', numbers, histories, memory) of a few probe rows, written in symbols.

Laws of this package are in `force_loops`, which `force_symbols` writes; a user's own are made by `own_forces`. A law is known by
its name; its routines are compiled when a model uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.container import ENUMS, Arrays, encode, storable
from ..core.errors import InputError, closest, listed, say
from ..core.jit import jit
from ..core.structs import IntegerMatrix, Matrix, Routine, opener
from ..core.validation import Attributes, Indices, Reals
from . import forces
from .forces import Force, Place, Routines
from .kernels import remainder

MAKERS: dict[str, Callable[[str], ForceLaw]] = {}  #: of laws of one's own, by the first word of their names


@dataclass(frozen=True)
class ForceLaw:
    """A law, known by its name; `find` gives it back."""

    name: str
    rows: int  #: probe rows that it reads and pushes
    numbers: int
    histories: int  #: functions of time
    pairs: tuple[tuple[int, int], ...]  #: of its rows, F and y, in which it has derivatives
    memory: int  #: angles whose turns it counts
    damped: bool  #: whether it reads the rates y'
    force: Routine
    slopes: Routine
    accept: Routine | None = None
    energy: Routine | None = None
    maker: Any = None  #: makes one of one's own of its name

    def __reduce__(self) -> Any:
        return self.maker or find, (self.name,)


def find(name: str) -> ForceLaw:
    """The law of this name; those of one's own from the classes that have been declared."""
    from .force_loops import LAWS

    if name in LAWS:
        return LAWS[name]
    word = name.split("|")[0]
    if word not in MAKERS:
        expected, remedy = f"one of {listed([*LAWS, *MAKERS], word)}", "import the file that declares it first"
        raise InputError(say("force law", expected, f"'{word}'", remedy) + closest(word, MAKERS))
    return MAKERS[word](name)


def named(law: ForceLaw, name: str, maker: Callable[[str], ForceLaw]) -> ForceLaw:
    """A law of one's own by its name."""
    return replace(law, name=name, maker=maker)


@encode.register
def _(law: ForceLaw, arrays: Arrays, where: str) -> Any:
    return {"enum": "ForceLaw", "value": law.name}


ENUMS["ForceLaw"] = find


@storable
@dataclass(frozen=True)
class LawForces:
    """Forces of t groups of probe rows by one law."""

    law: Annotated[ForceLaw, Attributes("r=rows p=numbers h=histories")]
    rows: Annotated[np.ndarray, Indices("t r", end="y")]
    numbers: Annotated[np.ndarray, Reals("t p")]
    signals: Annotated[np.ndarray, Indices("t h", end="k", low=-1)]  #: histories, -1 for the constant 1

    def __len__(self) -> int:
        return len(self.rows)


def one(law: str | ForceLaw, rows: Sequence[int], numbers: ArrayLike = (), signals: Sequence[int] = ()) -> LawForces:
    """One force by a law or its name, of probe rows (r,), numbers (p,) and histories (h,)."""
    known = find(law) if isinstance(law, str) else law
    integers = (np.array([part], np.int64).reshape(1, -1) for part in (rows, signals))
    return LawForces(known, next(integers), np.asarray(numbers, float).reshape(1, -1), next(integers))


class Record(NamedTuple):
    """Forces for compiled code."""

    rows: IntegerMatrix
    numbers: Matrix
    signals: IntegerMatrix
    pair: int  #: first place in H
    memory: int  #: first place in the memory


opened = opener(Record)


@jit
def continued(value: float, last: float) -> float:
    """An angle known but for whole turns, nearest to its last value."""
    return last + remainder(value - last, 2.0 * np.pi)


@forces.compile_force.register
def _(found: LawForces, place: Place) -> Force:
    law, count = found.law, len(found)
    rows, numbers, signals = (np.ascontiguousarray(part) for part in (found.rows, found.numbers, found.signals))
    local = np.array(law.pairs, dtype=np.int64).reshape(-1, 2)
    pairs = found.rows[:, local].reshape(-1, 2)
    routines = Routines(law.force, law.slopes if len(local) else None, law.accept, law.energy)
    name = law.name.partition("|")[0].replace("_", " ")
    return Force(
        Record(rows, numbers, signals, place.pair, place.memory),
        routines,
        name,
        pairs,
        np.zeros(count * law.memory),
        bool(law.memory),
        law.damped,
    )


@forces.histories.register
def _(found: LawForces) -> Sequence[tuple[int, int]]:
    return [(int(k), int(rows[0])) for rows, own in zip(found.rows, found.signals, strict=True) for k in own if k >= 0]


@forces.grow.register
def _(found: LawForces, signal: int) -> LawForces:
    return replace(found, signals=np.where(found.signals < 0, signal, found.signals))


@forces.join.register
def _(found: LawForces, others: Sequence[LawForces]) -> Sequence[LawForces]:
    """One for every law."""
    laws: dict[str, list[LawForces]] = {}
    for item in (found, *others):
        laws.setdefault(item.law.name, []).append(item)
    names = ("rows", "numbers", "signals")
    return [LawForces(same[0].law, *(np.concatenate([getattr(k, name) for k in same]) for name in names)) for same in laws.values()]
