"""Constraint functions by a law: phi(y, numbers, histories) of a few probe rows, written in symbols.

Their value, Jacobian, second derivatives, and what velocities are settled with (`kernels.drift`) follow. Laws of this package are
in `constraint_loops`, which `constraint_symbols` writes; a user's own are made by `own_joints`. A law is known by its name; its
routines are compiled when a model uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.container import ENUMS, Arrays, encode, storable
from ..core.errors import InputError, closest, listed, say
from ..core.structs import IntegerMatrix, Integers, Matrix, Routine, opener
from ..core.validation import Attributes, Indices, Reals
from .evaluation import Space
from .terms import Piece

MAKERS: dict[str, Callable[[str], ConstraintLaw]] = {}  #: of laws of one's own, by the first word of their names


class Routines(NamedTuple):
    """What a record is acted on by; each is told the table of the evaluation and the record."""

    constrain: Routine  #: rows of Phi and of dPhi/dy +=
    slopes: Routine  #: H += d(Phi_y^T lambda)/dy on its pairs, from the place it was given on
    drift: Routine  #: rows of Phi += Phi_y z + D1 + second D2 + third D3, see `kernels.drift`


@dataclass(frozen=True)
class ConstraintLaw:
    """A law, known by its name; `find` gives it back."""

    name: str
    rows: int  #: probe rows that it reads
    numbers: int
    histories: int  #: functions of time
    pairs: tuple[tuple[int, int], ...]  #: of its rows, in which it has second derivatives
    routines: Routines
    maker: Any = None  #: makes one of one's own of its name

    def __reduce__(self) -> Any:
        return self.maker or find, (self.name,)


def find(name: str) -> ConstraintLaw:
    """The law of this name; those of one's own from the classes that have been declared."""
    from .constraint_loops import LAWS

    if name in LAWS:
        return LAWS[name]
    word = name.split("|")[0]
    if word not in MAKERS:
        expected, remedy = f"one of {listed([*LAWS, *MAKERS], word)}", "import the file that declares it first"
        raise InputError(say("constraint law", expected, f"'{word}'", remedy) + closest(word, MAKERS))
    return MAKERS[word](name)


@encode.register
def _(law: ConstraintLaw, arrays: Arrays, where: str) -> Any:
    return {"enum": "ConstraintLaw", "value": law.name}


ENUMS["ConstraintLaw"] = find


@storable
@dataclass(frozen=True)
class LawRows:
    """t constraint rows by one law, each of its own probe rows."""

    law: Annotated[ConstraintLaw, Attributes("r=rows p=numbers h=histories")]
    row: Annotated[np.ndarray, Indices("t", end="m")]
    rows: Annotated[np.ndarray, Indices("t r", end="y")]
    numbers: Annotated[np.ndarray, Reals("t p")]
    signals: Annotated[np.ndarray, Indices("t h", end="k", low=-1)]  #: histories, -1 for the constant 1

    def __len__(self) -> int:
        return len(self.row)

    def kept(self, place: np.ndarray) -> LawRows:
        """Those whose numbers of rows have new ones (m,) that are not -1."""
        mine = place[self.row] >= 0
        return LawRows(self.law, place[self.row[mine]], self.rows[mine], self.numbers[mine], self.signals[mine])


def one(law: str | ConstraintLaw, row: int, rows: Sequence[int], numbers: ArrayLike = (), signals: Sequence[int] = ()) -> LawRows:
    """One constraint row by a law or its name, of probe rows (r,), numbers (p,) and histories (h,)."""
    known = find(law) if isinstance(law, str) else law
    integers = (np.array([part], np.int64).reshape(1, -1) for part in (rows, signals))
    return LawRows(known, np.array([row]), next(integers), np.asarray(numbers, float).reshape(1, -1), next(integers))


def join(found: Sequence[LawRows]) -> tuple[LawRows, ...]:
    """One for every law."""

    def column(same: Sequence[LawRows], name: str) -> np.ndarray:
        return np.concatenate([getattr(one, name) for one in same])

    laws: dict[str, list[LawRows]] = {}
    for item in found:
        laws.setdefault(item.law.name, []).append(item)
    names = ("row", "rows", "numbers", "signals")
    return tuple(LawRows(same[0].law, *(column(same, name) for name in names)) for same in laws.values())


class Record(NamedTuple):
    """Constraint rows for compiled code."""

    row: Integers
    rows: IntegerMatrix
    numbers: Matrix
    signals: IntegerMatrix
    pair: int  #: first place in H


opened = opener(Record)


@dataclass(frozen=True)
class Constraint(Piece):
    """Constraint rows for compiled code."""

    routines: Routines
    pairs: np.ndarray  #: (h, 2) probe rows of its second derivatives


def compile_rows(found: LawRows, pair: int) -> Constraint:
    """Constraint rows whose second derivatives begin at a place in H."""
    parts = (np.ascontiguousarray(part) for part in (found.row, found.rows, found.numbers, found.signals))
    row, rows, numbers, signals = parts
    local = np.array(found.law.pairs, dtype=np.int64).reshape(-1, 2)
    return Constraint(Record(row, rows, numbers, signals, pair), found.law.routines, found.rows[:, local].reshape(-1, 2))


def evaluate(found: LawRows, y: np.ndarray, signals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """phi (t,) and its derivatives by the rows of each (t, r) at probe rows y (j,)."""
    count, size = found.rows.shape
    own = LawRows(found.law, np.arange(count), np.arange(count * size).reshape(count, size), found.numbers, found.signals)
    piece, none, empty = compile_rows(own, 0), np.zeros(0), np.zeros((0, 0))
    rhs, Jy = np.zeros((1, count)), np.zeros((count, count * size))
    parts: dict[str, Any] = dict.fromkeys(Space._fields, none) | dict.fromkeys(("W", "body", "work", "paths"), empty)
    parts |= {"y": np.ascontiguousarray(y[found.rows.ravel()]), "signals": signals, "multipliers": rhs[0], "rhs": rhs, "Jy": Jy}
    piece.routines.constrain(Space(**parts), piece.address)
    return rhs[0], Jy.reshape(count, count, size)[np.arange(count), np.arange(count)]
