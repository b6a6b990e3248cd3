"""Forces by a law: F(y, y', numbers, histories, memory) of a few probe rows.

Laws of this package are in `built_in_forces`; a user's own, and expressions of the state, are
written in symbols (`force_symbols`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiling.structs import IntegerMatrix, Matrix, Routine, address_of, opener, packed
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Attributes
from .. import row_laws, row_programs
from ..evaluation import space_of
from ..row_laws import Groups, RowLaw, group
from . import on_rows as forces
from .on_rows import Force, ForceRoutines, Place

IMPACT = 2  #: numbers that a law keeps of accepted states that judges impacts


@dataclass(frozen=True)
class ForceLaw(RowLaw):
    """A force F(y, y', numbers, histories, memory) on the rows that it reads; pairs are of a force
    and a row.

    Routines and the numbers that it keeps of accepted states are those of one group of rows.
    """

    memory: int  #: angles whose turns it counts
    damped: bool  #: whether it reads the rates y'
    force: Routine
    slopes: Routine | None = None
    accept: Routine | None = None
    energy: Routine | None = None
    #: of impacts, for which it keeps its last force, and 1 where there was none, behind these
    #: angles
    judge: Routine | None = None
    kept: int = 0  #: values of accepted states that it keeps behind these angles
    #: curves that it reads, behind which it keeps how far it has been beyond their ends
    tables: tuple[str, ...] = ()
    smooth: bool = False  #: whether its derivatives jump nowhere
    reacts: bool = False  #: whether it depends on the multipliers of joints, as friction in them
    kind: ClassVar[str] = "force law"
    loops: ClassVar[str] = ".forces.built_in_forces"


@storable
@dataclass(frozen=True)
class LawForces(Groups):
    """Forces of t groups of r probe rows by one law, with p numbers and h histories each."""

    law: Annotated[ForceLaw, Attributes("r=rows p=numbers h=histories")]


def one(
    law: str | ForceLaw, rows: Sequence[int], numbers: ArrayLike = (), signals: Sequence[int] = ()
) -> LawForces:
    """One force by a law or its name, of probe rows (r,), numbers (p,) and histories (h,).

    InputError where no law has that name.
    """
    return LawForces(*group(ForceLaw, law, rows, numbers, signals))


def dead(rows: np.ndarray, coefficients: ArrayLike, signals: np.ndarray) -> LawForces:
    """Forces coefficient s(t) on probe rows (t,) [N per unit of the row], whatever the state is.

    Coefficients (t,); `signals` (t,) are the numbers of the histories s, or -1 for 1.
    """
    return LawForces(
        ForceLaw.find("dead"),
        rows[:, None],
        np.array(coefficients, dtype=float)[:, None],
        signals[:, None],
    )


class ForceRecord(NamedTuple):
    """t forces of one law for compiled code: rows (t, r), numbers (t, p), signals (t, h)."""

    rows: IntegerMatrix
    numbers: Matrix
    signals: IntegerMatrix
    pair: int  #: first place in H
    memory: int  #: first place in the memory


opened = opener(ForceRecord)


def memory_of(law: ForceLaw) -> int:
    """Numbers that a force keeps of accepted states."""
    return law.memory + (IMPACT if law.judge else 0) + law.kept + len(law.tables)


def record_of(
    law: ForceLaw,
    rows: np.ndarray,
    numbers: np.ndarray,
    signals: np.ndarray,
    pair: int,
    memory: int,
) -> Any:
    """What the routines of a law act on: rows (t, r), numbers (t, p), signals (t, h), first places
    in H and in the memory.
    """
    if not law.actions:
        return ForceRecord(rows, numbers, signals, pair, memory)
    groups = {
        "rows": rows,
        "numbers": numbers,
        "signals": signals,
        "row": np.zeros(0, np.int64),
        "pair": pair,
        "memory": memory,
    }
    return row_programs.compile_actions(law.actions, groups, len(law.pairs), memory_of(law))


@forces.compile_force.register
def _(found: LawForces, place: Place) -> Force:
    law = found.law
    count = len(found)
    rows, numbers, signals = (
        np.ascontiguousarray(part) for part in (found.rows, found.numbers, found.signals)
    )
    local = np.array(law.pairs, dtype=np.int64).reshape(-1, 2)
    pairs = found.rows[:, local].reshape(-1, 2)
    size = memory_of(law)
    routines = ForceRoutines(
        law.force, law.slopes if len(local) else None, law.accept, law.energy, law.judge
    )
    name = law.name.partition("|")[0].replace("_", " ")
    return Force(
        record_of(law, rows, numbers, signals, place.pair, place.memory),
        routines,
        name,
        pairs,
        np.zeros(count * size),
        np.tile(np.arange(size) < law.memory, count),
        law.damped,
        smooth=law.smooth,
        reacts=law.reacts,
        places=count if law.judge else 0,
    )


def evaluate(
    law: ForceLaw, y: np.ndarray, rates: np.ndarray, numbers: np.ndarray, histories: np.ndarray
) -> np.ndarray:
    """F (s, r) on its rows at s states: y, y' (s, r), numbers (s, p), histories (s, h).

    Every state is one of its own, with the memory of the start: angles count no turns.
    """
    count = len(y)
    rows = np.arange(y.size).reshape(y.shape)
    signals = np.arange(histories.size).reshape(histories.shape)
    memory = np.zeros(count * memory_of(law))
    parts = {
        "y": y.ravel(),
        "rates": rates.ravel(),
        "signals": histories.ravel(),
        "memory": memory,
        "g": np.zeros(y.size),
    }
    record = record_of(law, rows, np.ascontiguousarray(numbers), signals, 0, 0)
    integers = packed(record)
    law.force(found := space_of(**parts), address_of(integers))
    return found.g.reshape(count, -1)


@forces.histories.register
def _(found: LawForces) -> Sequence[tuple[int, int]]:
    return [
        (int(k), int(rows[0]))
        for rows, own in zip(found.rows, found.signals, strict=True)
        for k in own
        if k >= 0 and len(rows)
    ]


@forces.grow.register
def _(found: LawForces, signal: int) -> LawForces:
    return replace(found, signals=np.where(found.signals < 0, signal, found.signals))


@forces.join.register
def _(found: LawForces, others: Sequence[LawForces]) -> Sequence[LawForces]:
    return row_laws.join((found, *others))
