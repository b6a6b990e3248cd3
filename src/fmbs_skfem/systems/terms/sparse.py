r"""Assembly of large iteration matrices: the pattern and the place of every cell entry are found
once.

    K_p = sum_e B_e^T D_e B_e,    K = T^T K_p T,    p = T x + d

K_p is kept as the lower triangle of a sparse matrix in the coordinates p of the cells; T
(elimination, frames) is applied to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array, eye_array

from ...core.algebra.linalg import distinct, is_identity, mirrored
from ...core.storage.records import dataclass
from ..system import System
from .elastic import Targets, functions_read

NONE = np.zeros(0, np.int32)


@dataclass(frozen=True)
class Pattern:
    """Pattern of K_p (p, p), of which the lower triangle has z entries, and T of the matrix in
    unknowns (n, n).

        K = T^T K_p T
    """

    keys: np.ndarray  #: (z,) row * n + column of every entry
    indices: np.ndarray
    indptr: np.ndarray
    lift: csr_array | None  #: T, none for the identity

    def targets(self, local: np.ndarray) -> Targets:
        """The places of all entries of cells with coordinates (l, e) among the z entries of K_p.

        They are the lower triangles of the matrices of cells, l (l + 1) / 2 entries each.
        """
        # the place of every entry is found once: an assembly is one pass over cells
        found = np.searchsorted(self.keys, entries(local, len(self.indptr) - 1)).astype(np.int32)
        return Targets(NONE, found.ravel(), np.zeros(0))

    def assembled(self, data: np.ndarray) -> csr_array:
        """K (n, n), symmetric, from the entries (z,) of K_p."""
        n = len(self.indptr) - 1
        # half of the entries in the assembly, both for products and factors
        K = mirrored(csr_array((data, self.indices, self.indptr), shape=(n, n)))
        return K if self.lift is None else csr_array(self.lift.T @ K @ self.lift)


def pattern(n: int, locals_: Sequence[np.ndarray], T: csr_array | None = None) -> Pattern:
    """Pattern of the cells of several storages, each with its coordinates (l, e), numbers below n.

    T (n, i) gives the n coordinates from i unknowns; it is left out where it is the identity.
    """
    # sorted and not hashed: four million keys take 0.25 s in place of 1.9 s
    keys = distinct(
        np.concatenate([np.zeros(0, np.int64), *(distinct(entries(local, n)) for local in locals_)])
    )
    return Pattern(
        keys,
        keys % n,
        np.searchsorted(keys, np.arange(n + 1) * n),
        None if T is None or is_identity(T) else T,
    )


def entries(local: np.ndarray, n: int) -> np.ndarray:
    """Keys of the entries of all lower triangles of cells.

        row * n + column,    row >= column

    (l (l + 1) / 2, e).
    """
    low, column = np.tril_indices(len(local))
    # one integer an entry, row times n plus column, so that sorting sorts rows and columns at once
    i = local[low].astype(np.int64)
    j = local[column].astype(np.int64)
    return np.maximum(i, j) * n + np.minimum(i, j)


def function_pattern(system: System) -> csr_array:
    """Pattern (b, b) of the iteration matrix over the functions of all bodies, each the place of a
    vector of unknowns.

    What mass, springs and cells couple, without joints and forces on probe rows.
    """
    dim = system.dim
    count = system.lift.matrix.shape[0] // system.dim
    # frames without mass and stiffness have entries too
    pattern = csr_array(eye_array(count, dtype=np.float32))
    for matrix in (system.mass, system.stiffness):
        pattern = csr_array(pattern + abs(csr_array(matrix)[::dim, ::dim].astype(np.float32)))
    for part in system.elastic:
        reads = functions_read(part.gather, count)
        pattern = csr_array(pattern + reads.T @ reads)
    return csr_array(pattern, dtype=float)
