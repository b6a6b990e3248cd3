"""Programs of expressions (`graphs`) in compiled code: one loop runs them all, and nothing is
compiled for an expression.

room = constants, what is read, results of operations room[first + i] = operation_i(room[a_i],
room[b_i], room[c_i])
"""

from __future__ import annotations

import math

import numpy as np

from .angles import continued
from .curves import beyond, lookup, lookup_slope
from .jit import jit

#: operations of several numbers, and `CONTINUE`: an angle known but for whole turns, the one
#: nearest to its last value
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, ATAN2, LESS, NOT_MORE, EQUAL, CHOOSE, CONTINUE = range(11)
#: of one number
NEGATE, SQRT, EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH = (
    range(11, 27)
)
ABS, SIGN, FLOOR, ERF = range(27, 31)
#: of a number and a curve, whose numbers are those from one place to another
LOOKUP, LOOKUP_SLOPE, BEYOND = range(31, 34)


@jit
def elementary(operation: int, x: float) -> float:
    """An operation of one number."""
    # functions of NumPy, which give NaN and infinity where those of `math` raise errors in Python
    if operation == SQRT:
        return np.sqrt(x)
    if operation == SIN:
        return np.sin(x)
    if operation == COS:
        return np.cos(x)
    if operation == EXP:
        return np.exp(x)
    if operation == LOG:
        return np.log(x)
    if operation == TANH:
        return np.tanh(x)
    if operation == ABS:
        return abs(x)
    if operation == SIGN:
        return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0
    if operation == FLOOR:
        return np.floor(x)
    if operation == TAN:
        return np.tan(x)
    if operation == ASIN:
        return np.arcsin(x)
    if operation == ACOS:
        return np.arccos(x)
    if operation == ATAN:
        return np.arctan(x)
    if operation == SINH:
        return np.sinh(x)
    if operation == COSH:
        return np.cosh(x)
    if operation == ASINH:
        return np.arcsinh(x)
    if operation == ACOSH:
        return np.arccosh(x)
    if operation == ATANH:
        return np.arctanh(x)
    if operation == ERF:
        return math.erf(x)
    return np.nan


@jit
def run(operations: np.ndarray, first: int, room: np.ndarray, numbers: np.ndarray) -> None:
    """room[first + i] = operation i, for all operations (o, 4); `numbers` are those among which
    curves are.
    """
    for i in range(len(operations)):
        operation, a, b, c = operations[i, 0], operations[i, 1], operations[i, 2], operations[i, 3]
        x = room[a]
        # the most frequent ones first
        if operation == MULTIPLY:
            value = x * room[b]
        elif operation == ADD:
            value = x + room[b]
        elif operation == SUBTRACT:
            value = x - room[b]
        elif operation == DIVIDE:
            value = x / room[b]
        elif operation == NEGATE:
            value = -x
        elif operation == ATAN2:
            value = np.arctan2(x, room[b])
        elif operation == POWER:
            value = x ** room[b]
        elif operation == LESS:
            value = 1.0 if x < room[b] else 0.0
        elif operation == NOT_MORE:
            value = 1.0 if x <= room[b] else 0.0
        elif operation == EQUAL:
            value = 1.0 if x == room[b] else 0.0
        elif operation == CHOOSE:
            # both sides of a choice are computed, one of them counts
            value = room[b] if x != 0.0 else room[c]
        elif operation == CONTINUE:
            value = continued(x, room[b])
        elif operation == LOOKUP:
            value = lookup(x, numbers[b:c])
        elif operation == LOOKUP_SLOPE:
            value = lookup_slope(x, numbers[b:c])
        elif operation == BEYOND:
            value = beyond(x, numbers[b:c])
        else:
            value = elementary(operation, x)
        room[first + i] = value
