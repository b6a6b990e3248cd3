r"""Laws of probe rows by programs: what a program reads of a state, and where its results go.

    room <- y, y', numbers, histories, memory ... of group k,     run,     g, H, energy, Phi, dPhi/dy ... of group k <- room

A law has up to four programs, each behind a routine of its own (`ROUTINES`); all of them run in one
routine, which is compiled once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core.compiling import programs
from ..core.compiling.graphs import GraphProgram
from ..core.compiling.jit import jit
from ..core.compiling.structs import (
    IntegerMatrix,
    Integers,
    Matrix,
    Routine,
    Vector,
    invoke,
    opener,
    place_of,
    routine,
)
from .evaluation import Space, evaluation
from .kernels import copy, derivative, factor

#: what is read: a probe row of the group, its vector z, rate, second derivative (rows of
#: `Space.paths`); a number, a history, its derivatives, a number that is kept; gh, the factors of
#: D2 and D3 of `kernels.drift`
(
    ROW,
    RATE,
    PATH,
    STEP,
    VELOCITY,
    ACCELERATION,
    NUMBER,
    HISTORY,
    FIRST,
    SECOND,
    THIRD,
    MEMORY,
    DAMPING,
    LEAD,
) = range(14)

#: where results go: a force on a row, - c times its derivative on a pair, what is kept, the largest
#: of what is kept, a potential, a constraint function, its derivative by a row, multiplier times
#: its second derivative on a pair
PUSH, SLOPE, KEEP, FURTHEST, ENERGY, GAP, JACOBIAN, CURVATURE = range(8)


class Action(NamedTuple):
    """A program with what it reads and where its results go, each a kind with a number: one of a
    row, of a pair, ...
    """

    program: GraphProgram  #: whose symbols are what it reads: a kind and a number
    targets: tuple[tuple[int, int], ...]


class ActionRecord(NamedTuple):
    """An action on t groups for compiled code: rows (t, r), numbers (t, p), signals (t, h), row
    (t,) of a constraint.
    """

    rows: IntegerMatrix
    numbers: Matrix
    signals: IntegerMatrix
    row: Integers
    pair: int  #: first place in H
    memory: int
    pairs: int  #: of a group
    kept: int  #: numbers that a group keeps
    reads: IntegerMatrix  #: (i, 3) kind, number and place in the room
    operations: IntegerMatrix  #: (o, 4)
    targets: IntegerMatrix  #: (w, 3) kind, number and place in the room
    constants: Vector


class ActionRecords(NamedTuple):
    """The actions of a law, and the routine that runs each of them."""

    act: int
    first: ActionRecord
    second: ActionRecord
    third: ActionRecord
    fourth: ActionRecord


action_of, actions_of = opener(ActionRecord), opener(ActionRecords)


@jit
def read(s: Space, P: ActionRecord, k: int, kind: int, number: int) -> float:
    """What a program of group k reads."""
    if kind == ROW:
        return s.y[P.rows[k, number]]
    if kind == RATE:
        return s.rates[P.rows[k, number]]
    if kind == NUMBER:
        return P.numbers[k, number]
    if kind == HISTORY:
        return factor(s.signals, P.signals[k, number])
    if kind == MEMORY:
        return s.memory[P.memory + P.kept * k + number]
    if kind == DAMPING:
        return s.gh[0]
    if kind == LEAD:
        return s.leads[number]
    if kind <= ACCELERATION:
        return s.paths[kind - PATH, P.rows[k, number]]
    # derivatives stand behind the values of all signals
    return derivative(s.signals, P.signals[k, number], (kind - HISTORY) * (len(s.signals) // 4))


@jit
def write(s: Space, P: ActionRecord, k: int, kind: int, number: int, value: float) -> None:
    """Give a result of group k to its place."""
    if kind == PUSH:
        s.g[P.rows[k, number]] += value
    elif kind == SLOPE:
        s.H[P.pair + P.pairs * k + number] -= s.c[0] * value
    elif kind == KEEP:
        s.memory[P.memory + P.kept * k + number] = value
    elif kind == FURTHEST:
        place = P.memory + P.kept * k + number
        s.memory[place] = max(s.memory[place], value)
    elif kind == ENERGY:
        s.energy[0] += value
    elif kind == GAP:
        s.rhs[0, len(s.rhs[0]) - len(s.multipliers) + P.row[k]] += value
    elif kind == JACOBIAN:
        s.Jy[P.row[k], P.rows[k, number]] += value
    else:
        s.H[P.pair + P.pairs * k + number] += s.multipliers[P.row[k]] * value


@routine
def act(table: Any, record: Any) -> int:
    """Run a program for all groups of rows."""
    s = evaluation(table).space
    P = action_of(record)
    first = len(P.constants) + len(P.reads)
    # of a call: threads share the records of joints
    room = np.empty(first + len(P.operations))
    copy(P.constants, room)
    for k in range(len(P.rows)):
        for i in range(len(P.reads)):
            room[P.reads[i, 2]] = read(s, P, k, P.reads[i, 0], P.reads[i, 1])
        programs.run(P.operations, first, room, P.numbers[k])
        for i in range(len(P.targets)):
            write(s, P, k, P.targets[i, 0], P.targets[i, 1], room[P.targets[i, 2]])
    return 0


#: bytes
AT = {name: 8 * place_of(ActionRecords, name) for name in ("first", "second", "third", "fourth")}
FIRST_AT, SECOND_AT, THIRD_AT, FOURTH_AT = AT.values()


@routine
def first(table: Any, record: Any) -> int:
    """Run the first program of a law."""
    return invoke(actions_of(record).act, table, record + FIRST_AT)


@routine
def second(table: Any, record: Any) -> int:
    """Run the second program of a law."""
    return invoke(actions_of(record).act, table, record + SECOND_AT)


@routine
def third(table: Any, record: Any) -> int:
    """Run the third program of a law."""
    return invoke(actions_of(record).act, table, record + THIRD_AT)


@routine
def fourth(table: Any, record: Any) -> int:
    """Run the fourth program of a law."""
    return invoke(actions_of(record).act, table, record + FOURTH_AT)


ROUTINES: Sequence[Routine] = (first, second, third, fourth)
NOTHING = Action(GraphProgram((), (), (), ()), ())


def compile_actions(
    actions: Sequence[Action], groups: Mapping[str, Any], pairs: int, kept: int
) -> ActionRecords:
    """The actions of a law for compiled code, on `groups`: the fields of `ActionRecord` from `rows`
    to `memory`.
    """

    def matrix(rows: Sequence[Sequence[int]], columns: int) -> np.ndarray:
        return np.array(rows, dtype=np.int64).reshape(-1, columns)

    def part(action: Action) -> ActionRecord:
        program = action.program
        constants = len(program.constants)
        reads = [(kind, number, constants + k) for k, (kind, number) in enumerate(program.symbols)]
        targets = [
            (*target, place) for target, place in zip(action.targets, program.results, strict=True)
        ]
        return ActionRecord(
            **groups,
            pairs=pairs,
            kept=kept,
            reads=matrix(reads, 3),
            operations=matrix(program.operations, 4),
            targets=matrix(targets, 3),
            constants=np.array(program.constants, dtype=float),
        )

    return ActionRecords(
        act.address,
        *(part(action) for action in (*actions, *[NOTHING] * len(ROUTINES))[: len(ROUTINES)]),
    )
