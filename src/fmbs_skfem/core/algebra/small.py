"""Dense factors and products of small matrices, in place of LAPACK and BLAS: the same arrays as in
`core.compiling.lapack`, to the bit the same numbers on every processor, and in programs in C.
"""

from __future__ import annotations

import numpy as np

from ..compiling import lapack
from ..compiling.jit import jit

# Cholesky's factors take 4.7 us for 7.2 us of LAPACK (46 unknowns), 32 for 30 (100), 220 for 160
# (200)
LARGEST = 100  #: size of matrices up to which they serve in place of LAPACK


@jit
def potrf(addresses: np.ndarray, half: np.ndarray) -> int:
    """Factor a symmetric positive definite matrix in place, A = L L^T, see `lapack.potrf`."""
    n = half.shape[0]
    for j in range(n):
        if not half[j, 0] > 0.0:
            return j + 1
        half[j, 0] = np.sqrt(half[j, 0])
        inverse = 1.0 / half[j, 0]
        for i in range(1, n - j):
            half[j, i] *= inverse
        for k in range(1, n - j):
            # column by column: rows of the half are columns of L
            factor = half[j, k]
            target = half[j + k]
            source = half[j, k:]
            for i in range(n - j - k):
                target[i] -= factor * source[i]
    return 0


@jit
def getrf(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray) -> int:
    """Factor a dense matrix in place with partial pivoting, P A = L U, see `lapack.getrf`."""
    n = matrix.shape[0]
    for j in range(n):
        x = matrix[j]
        substitute_forward(matrix, pivots, j, x)
        best = j
        for i in range(j + 1, n):
            if abs(x[i]) > abs(x[best]):
                best = i
        pivots[j] = best + 1
        # what is no number goes on, as in LAPACK: the residual of the solution says so
        if x[best] == 0.0:
            return j + 1
        if best != j:
            for k in range(j + 1):
                matrix[k, j], matrix[k, best] = matrix[k, best], matrix[k, j]
        inverse = 1.0 / x[j]
        for i in range(j + 1, n):
            x[i] *= inverse
    return 0


@jit
def substitute_forward(LU: np.ndarray, pivots: np.ndarray, count: int, x: np.ndarray) -> None:
    """Solve with the first columns of L, `count` of them.

        x <- L^-1 P x,    P K = L U

    Four columns at a time: the unknowns of a triangle first, then all that they reach.
    """
    full = count // 4 * 4
    # all exchanges first: the triangles then run without a look at the pivots
    for j in range(count):
        other = pivots[j] - 1
        x[j], x[other] = x[other], x[j]
    # x is read and written once for four columns, so that stores are waited for a quarter as often
    for j in range(0, full, 4):
        A, B, C, D = LU[j], LU[j + 1], LU[j + 2], LU[j + 3]
        a = x[j]
        b = x[j + 1] - A[j + 1] * a
        c = x[j + 2] - A[j + 2] * a - B[j + 2] * b
        d = x[j + 3] - A[j + 3] * a - B[j + 3] * b - C[j + 3] * c
        x[j + 1], x[j + 2], x[j + 3] = b, c, d
        rest = x[j + 4 :]
        A, B, C, D = A[j + 4 :], B[j + 4 :], C[j + 4 :], D[j + 4 :]
        for i in range(len(rest)):
            rest[i] -= A[i] * a + B[i] * b + C[i] * c + D[i] * d
    for j in range(full, count):
        for i in range(j + 1, len(x)):
            x[i] -= LU[j, i] * x[j]


@jit
def getrs(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray, rhs: np.ndarray) -> int:
    """Solve in place with a matrix and pivots from `getrf`, see `lapack.getrs`."""
    n = matrix.shape[0]
    for row in range(len(rhs)):
        x = rhs[row]
        substitute_forward(matrix, pivots, n, x)
        for k in range(n - 1, -1, -1):
            x[k] /= matrix[k, k]
            for i in range(k):
                x[i] -= matrix[k, i] * x[k]
    return 0


@jit
def pbtrf(addresses: np.ndarray, band: np.ndarray) -> int:
    """Factor a symmetric positive definite band in place, A = L L^T, see `lapack.pbtrf`."""
    n, width = band.shape
    for j in range(n):
        if not band[j, 0] > 0.0:
            return j + 1
        band[j, 0] = np.sqrt(band[j, 0])
        inverse = 1.0 / band[j, 0]
        reach = min(width, n - j)
        for i in range(1, reach):
            band[j, i] *= inverse
        for k in range(1, reach):
            factor = band[j, k]
            target = band[j + k]
            source = band[j, k:]
            for i in range(reach - k):
                target[i] -= factor * source[i]
    return 0


@jit
def gbtrf(
    addresses: np.ndarray, band: np.ndarray, lower: int, upper: int, pivots: np.ndarray
) -> int:
    """Factor a general band in place with partial pivoting, P A = L U, see `lapack.gbtrf`."""
    n = band.shape[0]
    middle = lower + upper  # band[j, middle + i - j] = A[i, j]
    for j in range(n):
        reach = min(lower, n - 1 - j)
        best = 0
        for i in range(1, reach + 1):
            if abs(band[j, middle + i]) > abs(band[j, middle + best]):
                best = i
        pivots[j] = j + best + 1
        if not abs(band[j, middle + best]) > 0.0:
            return j + 1
        last = min(n - 1, j + middle)
        if best > 0:
            for k in range(j, last + 1):
                a, b = middle + j - k, middle + j + best - k
                band[k, a], band[k, b] = band[k, b], band[k, a]
        inverse = 1.0 / band[j, middle]
        for i in range(1, reach + 1):
            band[j, middle + i] *= inverse
        for k in range(j + 1, last + 1):
            factor = band[k, middle + j - k]
            if factor != 0.0:
                for i in range(1, reach + 1):
                    band[k, middle + j + i - k] -= band[j, middle + i] * factor
    return 0


@jit
def gbtrs(
    addresses: np.ndarray,
    band: np.ndarray,
    lower: int,
    upper: int,
    pivots: np.ndarray,
    rhs: np.ndarray,
) -> int:
    """Solve in place with a band and pivots from `gbtrf`, see `lapack.gbtrs`."""
    n = band.shape[0]
    middle = lower + upper
    for row in range(len(rhs)):
        x = rhs[row]
        for j in range(n):
            other = pivots[j] - 1
            x[j], x[other] = x[other], x[j]
            for i in range(1, min(lower, n - 1 - j) + 1):
                x[j + i] -= band[j, middle + i] * x[j]
        for j in range(n - 1, -1, -1):
            x[j] /= band[j, middle]
            for i in range(max(0, j - middle), j):
                x[i] -= band[j, middle + i - j] * x[j]
    return 0


@jit
def search(values: np.ndarray, x: float, right: bool) -> int:
    """How many of `values` (n,), in order, are below x, or with `right` not above it."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < x or (right and values[middle] == x):
            low = middle + 1
        else:
            high = middle
    return low


@jit
def product(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> None:
    """C = A B."""
    for i in range(len(A)):
        target = C[i]
        for j in range(B.shape[1]):
            target[j] = 0.0
        for k in range(len(B)):
            factor = A[i, k]
            row = B[k]
            for j in range(B.shape[1]):
                target[j] += factor * row[j]


@jit
def turned_product(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> None:
    """C = A^T B."""
    for i in range(A.shape[1]):
        for j in range(B.shape[1]):
            C[i, j] = 0.0
    for k in range(len(A)):
        row = B[k]
        for i in range(A.shape[1]):
            factor = A[k, i]
            target = C[i]
            for j in range(B.shape[1]):
                target[j] += factor * row[j]


#: what they stand for
STANDS = {
    lapack.potrf: potrf,
    lapack.pbtrf: pbtrf,
    lapack.getrf: getrf,
    lapack.getrs: getrs,
    lapack.gbtrf: gbtrf,
    lapack.gbtrs: gbtrs,
    np.searchsorted: search,
}
PRODUCTS = product, turned_product
