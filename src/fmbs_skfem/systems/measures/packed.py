"""Arrays in the numbers that an output keeps, which files hold as one row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

SPARSE = -1.0  #: in place of the number of axes


def pack(*arrays: np.ndarray | csr_array) -> tuple[float, ...]:
    """Arrays as one row of numbers: of each how many axes it has, its shape and its entries; of
    sparse rows `SPARSE`, their number of columns, and three arrays.
    """
    found = list[float]()
    for one in arrays:
        if isinstance(one, csr_array):
            found += [SPARSE, one.shape[1], *pack(one.data, one.indices, one.indptr)]
        else:
            found += [one.ndim, *one.shape, *np.asarray(one, dtype=float).ravel().tolist()]
    return tuple(map(float, found))


def unpack(numbers: Sequence[float]) -> list[Any]:
    """The arrays of a row of numbers that `pack` made; LookupError where it made none such."""
    row = np.asarray(numbers, dtype=float)
    found = list[Any]()
    widths = dict[int, int]()  # columns of sparse rows, by the place of their first array
    at = 0
    while at < len(row):
        if row[at] == SPARSE:
            widths[len(found)] = int(row[at + 1])
            at += 2
        first = at + 1 + int(row[at])
        shape = row[at + 1 : first].astype(int)
        last = first + int(np.prod(shape))
        if not at < first <= last <= len(row) or (shape < 0).any():
            raise LookupError("numbers of arrays")
        found.append(row[first:last].reshape(shape))
        at = last
    for place, width in reversed(widths.items()):
        data, indices, indptr = found[place : place + 3]
        rows = data, indices.astype(np.int64), indptr.astype(np.int64)
        found[place : place + 3] = [csr_array(rows, shape=(len(indptr) - 1, width))]
    return found
