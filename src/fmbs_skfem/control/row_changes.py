"""What events do to rows of joints: which hold from then on, and numbers that locks keep.

It is in the subset that is printed, as the search for events is (`crossings`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..core.compiling import structs
from ..dynamics.vanishing import rows_of_locks
from ..systems.system import Lock, System
from .crossings import EventSearch

AS_IT_IS = -1  #: of a row that an event leaves


class RowChanges(NamedTuple):
    """Of t events and m rows: what locks hold are l numbers, sums of q products of probe rows j."""

    #: (m,) whether rows are to hold, though others may make them hold already
    closed: structs.Integers
    #: (t, m) 1 of rows that hold from an event on, 0 of those that do not
    rows: structs.IntegerMatrix
    event: structs.Integers  #: (q,) the event that reads a product
    number: structs.Integers  #: (q,) the number that it is a part of
    factor: structs.Vector  #: (q,)
    left: structs.Integers  #: (q,) probe rows
    right: structs.Integers  #: (q,)
    numbers: structs.Vector  #: (l,)
    probes: structs.Vector  #: (j + 1,) in the present state, 1 behind them


def changes_of(system: System) -> RowChanges:
    """What all events of a system do to its rows."""
    joints = np.array([joint for joint, _ in system.constraints.names], dtype=object)
    own = rows_of_locks(system)
    locks = {one.joint: one for one in system.locks}
    parks = {one.parks: one for one in system.locks if one.parks}
    first = first_numbers(system)
    rows = np.full((len(system.triggers), len(own)), AS_IT_IS, np.int64)
    parts: list[tuple[np.ndarray, ...]] = []
    count = len(system.probes.offset)
    for k, one in enumerate(system.triggers):
        closing = [parks[name] for name in one.release if name in parks]
        for name in (*one.release, *one.lock):
            rows[k, joints == name] = 0
        for lock in (*closing, *(locks[name] for name in one.lock)):
            rows[k, (joints == lock.joint) & own] = 1
            terms = lock.numbers
            places = (np.where(part < 0, count, part) for part in (terms.i, terms.j))
            event = np.full(len(terms.row), k)
            parts.append((event, terms.row + first[lock.joint], terms.coefficient, *places))
    event, number, factor, left, right = (
        (np.concatenate(part) if parts else np.zeros(0) for part in zip(*parts, strict=True))
        if parts
        else (np.zeros(0),) * 5
    )
    whole = (one.astype(np.int64) for one in (event, number, left, right))
    event, number, left, right = whole
    size = sum(len(one.signals) for one in system.locks)
    return RowChanges(
        closed=(~own).astype(np.int64),
        rows=rows,
        event=event,
        number=number,
        factor=factor,
        left=left,
        right=right,
        numbers=np.zeros(size),
        probes=np.ones(count + 1),
    )


def first_numbers(system: System) -> Mapping[str, int]:
    """Where the numbers of each lock begin."""
    found = {}
    total = 0
    for one in system.locks:
        found[one.joint] = total
        total += len(one.signals)
    return found


def signals_of(locks: Sequence[Lock]) -> list[int]:
    """The signals (l,) whose values all numbers are."""
    return [int(signal) for one in locks for signal in one.signals]


def change_rows(W: EventSearch, C: RowChanges) -> None:
    """Do what the events ask for that are due, in their order."""
    for k in range(len(W.due)):
        if W.due[k] == 1:
            change(C, k)


def change(C: RowChanges, k: int) -> None:
    """Rows that hold from an event on, and what locks hold, in the present state."""
    for m in range(len(C.closed)):
        if C.rows[k, m] != AS_IT_IS:
            C.closed[m] = C.rows[k, m]
    for q in range(len(C.event)):
        if C.event[q] == k:
            C.numbers[C.number[q]] = 0.0
    for q in range(len(C.event)):
        if C.event[q] == k:
            C.numbers[C.number[q]] += C.factor[q] * C.probes[C.left[q]] * C.probes[C.right[q]]
