"""Dense factors, products and sums of small matrices, in place of LAPACK, BLAS and regrouped sums
where kernels are printed as C: the same arrays as in `core.compiling.lapack`.
"""

from __future__ import annotations

import numpy as np

from ..compiling import lapack
from ..compiling.jit import jit


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
    for k in range(n):
        column = matrix[k]
        best = k
        for i in range(k + 1, n):
            if abs(column[i]) > abs(column[best]):
                best = i
        pivots[k] = best + 1
        if not abs(column[best]) > 0.0:
            return k + 1
        if best != k:
            for j in range(n):
                matrix[j, k], matrix[j, best] = matrix[j, best], matrix[j, k]
        inverse = 1.0 / column[k]
        for i in range(k + 1, n):
            column[i] *= inverse
        for j in range(k + 1, n):
            other = matrix[j]
            factor = other[k]
            if factor != 0.0:
                for i in range(k + 1, n):
                    other[i] -= column[i] * factor
    return 0


@jit
def getrs(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray, rhs: np.ndarray) -> int:
    """Solve in place with a matrix and pivots from `getrf`, see `lapack.getrs`."""
    n = matrix.shape[0]
    for row in range(len(rhs)):
        x = rhs[row]
        for k in range(n):
            other = pivots[k] - 1
            x[k], x[other] = x[other], x[k]
        for k in range(n):
            for i in range(k + 1, n):
                x[i] -= matrix[k, i] * x[k]
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
def dot(x: np.ndarray, y: np.ndarray) -> float:
    """x^T y of x and y (n,); programs in C have their own, of sums side by side."""
    total = 0.0
    for i in range(len(x)):
        total += x[i] * y[i]
    return total


@jit
def add_sums(rows: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Add products with rows, y_r += sum_i rows_ri x_i."""
    for r in range(len(y)):
        y[r] += dot(rows[r], x)


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
