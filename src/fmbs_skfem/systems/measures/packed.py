"""Arrays in the numbers that an output keeps, which files hold as one row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def pack(*arrays: np.ndarray) -> tuple[float, ...]:
    """Arrays as one row of numbers: of each how many axes it has, its shape and its entries."""
    return tuple(
        float(number)
        for one in arrays
        for number in (one.ndim, *one.shape, *np.asarray(one, dtype=float).ravel().tolist())
    )


def unpack(numbers: Sequence[float]) -> list[np.ndarray]:
    """The arrays of a row of numbers that `pack` made; LookupError where it made none such."""
    row = np.asarray(numbers, dtype=float)
    found = []
    at = 0
    while at < len(row):
        first = at + 1 + int(row[at])
        shape = row[at + 1 : first].astype(int)
        last = first + int(np.prod(shape))
        if not at < first <= last <= len(row) or (shape < 0).any():
            raise LookupError("numbers of arrays")
        found.append(row[first:last].reshape(shape))
        at = last
    return found
