"""Affine maps of coordinates, with sparse or dense matrices."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Reals

Matrix: TypeAlias = csr_array | np.ndarray


@storable
@dataclass(frozen=True)
class Affine:
    """An affine map of x (j,), with the matrix (i, j), sparse or dense, and the offset (i,).

        x -> matrix @ x + offset

    Either may be that of a change of coordinates.
    """

    matrix: Annotated[Matrix, Reals("i j")]
    offset: Annotated[np.ndarray, Reals("i")]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.matrix @ x) + self.offset
