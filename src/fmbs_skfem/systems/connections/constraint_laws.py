"""Constraint functions by a law: phi(y, numbers, histories) of a few probe rows.

Their value, Jacobian, second derivatives, and what velocities are settled with (`kernels.drift`)
follow. Those of this package are `gears`; a user's own are written in symbols (`own_joints`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiling.structs import IntegerMatrix, Integers, Matrix, Routine, opener
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Attributes, Indices
from .. import row_programs
from ..evaluation import space_of
from ..row_laws import Groups, RowLaw, group
from ..terms.elastic import Piece


class ConstraintRoutines(NamedTuple):
    """What a record of constraint rows is acted on by; each takes the table of the evaluation and
    the record.
    """

    constrain: Routine  #: rows of Phi and of dPhi/dy +=
    slopes: Routine  #: H += d(Phi_y^T lambda)/dy on its pairs, from the place it was given on
    drift: Routine  #: rows of Phi += Phi_y z + D1 + second D2 + third D3, see `kernels.drift`


@dataclass(frozen=True)
class ConstraintLaw(RowLaw):
    """A constraint function phi(y, numbers, histories) with its derivatives.

    `pairs` are those of its rows in which it has second derivatives.
    """

    routines: ConstraintRoutines
    kind: ClassVar[str] = "constraint law"
    loops: ClassVar[str] = ".connections.gears"


@storable
@dataclass(frozen=True)
class LawRows(Groups):
    """t constraint rows by one law, each of its own probe rows."""

    law: Annotated[ConstraintLaw, Attributes("r=rows p=numbers h=histories")]
    row: Annotated[np.ndarray, Indices("t", end="m")]

    def kept(self, place: np.ndarray) -> LawRows:
        """Those whose numbers of rows have new ones (m,) that are not -1."""
        mine = place[self.row] >= 0
        return LawRows(
            self.law, self.rows[mine], self.numbers[mine], self.signals[mine], place[self.row[mine]]
        )


def one(
    law: str | ConstraintLaw,
    row: int,
    rows: Sequence[int],
    numbers: ArrayLike = (),
    signals: Sequence[int] = (),
) -> LawRows:
    """One constraint row, number `row`, by a law or its name, of probe rows (r,), numbers (p,) and
    histories (h,).

    InputError where no law has that name.
    """
    return LawRows(*group(ConstraintLaw, law, rows, numbers, signals), np.array([row]))


class ConstraintRecord(NamedTuple):
    """t constraint rows of one law for compiled code: row (t,), rows (t, r), numbers (t, p),
    signals (t, h).
    """

    row: Integers
    rows: IntegerMatrix
    numbers: Matrix
    signals: IntegerMatrix
    pair: int  #: first place in H


opened = opener(ConstraintRecord)


@dataclass(frozen=True)
class Constraint(Piece):
    """Constraint rows of one law for compiled code: a record, and the routines that act on it."""

    routines: ConstraintRoutines
    pairs: np.ndarray  #: (h, 2) probe rows of its second derivatives


def compile_rows(found: LawRows, pair: int) -> Constraint:
    """Constraint rows for compiled code, whose second derivatives begin at the place `pair` in H."""
    parts = (
        np.ascontiguousarray(part) for part in (found.row, found.rows, found.numbers, found.signals)
    )
    row, rows, numbers, signals = parts
    law = found.law
    local = np.array(found.law.pairs, dtype=np.int64).reshape(-1, 2)
    if law.actions:
        groups = {
            "rows": rows,
            "numbers": numbers,
            "signals": signals,
            "row": row,
            "pair": pair,
            "memory": 0,
        }
        record: Any = row_programs.compile_actions(law.actions, groups, len(local), 0)
    else:
        record = ConstraintRecord(row, rows, numbers, signals, pair)
    return Constraint(record, law.routines, found.rows[:, local].reshape(-1, 2))


def evaluate(found: LawRows, y: np.ndarray, signals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """phi (t,) and its derivatives by the rows of each (t, r), at probe rows y (j,) and signals
    (s,).
    """
    count, size = found.rows.shape
    own = LawRows(
        found.law,
        np.arange(count * size).reshape(count, size),
        found.numbers,
        found.signals,
        np.arange(count),
    )
    piece = compile_rows(own, 0)
    rhs, Jy = np.zeros((1, count)), np.zeros((count, count * size))
    space = space_of(
        y=np.ascontiguousarray(y[found.rows.ravel()]),
        signals=signals,
        multipliers=rhs[0],
        rhs=rhs,
        Jy=Jy,
    )
    piece.routines.constrain(space, piece.address)
    return rhs[0], Jy.reshape(count, count, size)[np.arange(count), np.arange(count)]
