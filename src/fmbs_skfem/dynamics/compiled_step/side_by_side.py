r"""Sensor rows of the state of a run, and steps of many runs in one call.

    y = S x + s,    y' = S v,    y'' = S q''

Runs know nothing of each other, so that every thread takes the steps of a share of them, without
the interpreter lock: a call of Python for each of 64 plants would take as long as their steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import (
    Integers,
    Matrix,
    Vector,
    address_of,
    invoke,
    opener,
    packed,
    routine,
)
from ...systems import kernels


class SensorReading(NamedTuple):
    """Sensor rows i that read k of the unknowns of a state, whose arrays stay where they are."""

    x: Vector  #: (n,)
    v: Vector
    acceleration: Vector  #: q''
    used: Integers  #: (k,) unknowns that are read
    matrix: Matrix  #: (i, k) their columns of S
    offset: Vector  #: (i,) s
    part: Vector  #: (k,) room
    found: Matrix  #: (3, i) y, y' and y''


class Runs(NamedTuple):
    """Runs p, of which some take steps."""

    repeat: int  #: `stepping.repeat`
    read: int  #: `read`
    steps: Integers  #: (p,) addresses of packed steps
    readings: Integers  #: (p,) addresses of what is read of them afterwards, 0 for nothing
    chosen: Integers  #: (p,) numbers of those that take steps, in front
    ends: Integers  #: (t + 1,) of the shares of threads among these
    many: Integers  #: (1,) steps of each
    status: Integers  #: (p,) of those that took some


opened_reading = opener(SensorReading)
opened_runs = opener(Runs)


def placed(record: SensorReading | Runs) -> tuple[np.ndarray, int]:
    """The integers of a record and their address; the caller keeps both and the record."""
    table = packed(record)
    return table, address_of(table)


@routine
def read(table: Any, _: Any) -> int:
    """The sensor rows of a reading."""
    R = opened_reading(table)
    multiply(R.matrix, R.used, R.x, R.part, R.found[0])
    multiply(R.matrix, R.used, R.v, R.part, R.found[1])
    multiply(R.matrix, R.used, R.acceleration, R.part, R.found[2])
    for i in range(len(R.offset)):
        R.found[0, i] += R.offset[i]
    return 0


@jit
def multiply(
    matrix: np.ndarray, used: np.ndarray, x: np.ndarray, part: np.ndarray, found: np.ndarray
) -> None:
    """A product with some unknowns.

    found_i = sum_k matrix_ik x_used_k
    """
    # side by side first, so that every row is one sum in lanes
    for k in range(len(used)):
        part[k] = x[used[k]]
    for i in range(len(found)):
        found[i] = kernels.dot(matrix[i], part)


@routine
def take_share(table: Any, share: Any) -> int:
    """Take the steps of a share of the runs, and read what they have reached."""
    R = opened_runs(table)
    for k in range(R.ends[share], R.ends[share + 1]):
        one = R.chosen[k]
        R.status[one] = invoke(R.repeat, R.steps[one], R.many[0])
        if R.readings[one] != 0:
            invoke(R.read, R.readings[one], 0)
    return 0
