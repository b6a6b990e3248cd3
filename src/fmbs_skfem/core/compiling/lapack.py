"""LAPACK inside compiled functions: A = L L^T and P A = L U, dense and banded, in place on
preallocated arrays.

The addresses of the routines differ from process to process, so they are values and never constants
of the compiled code: the caller passes `ADDRESSES` as the first argument, from Python down to the
call. A compiled function that uses `ADDRESSES` as a global is refused, since its cached code would
jump to addresses of another process.

LAPACK counts along columns, numpy along rows, hence a row of an array is a column of LAPACK's
matrix:

    right-hand sides    (i, n)            row i is one right-hand side, replaced by its solution
    symmetric band      (n, d+1)          band[j, i-j] = A[i, j] for i = j..j+d, lower half, d sub-diagonals
    symmetric, dense    (n, m+1), m >= n  half[j, i-j] = A[i, j], a band of all sub-diagonals: the lower half of an (m, m)
    general band        (n, 2l+u+1)       band[j, l+u+i-j] = A[i, j] for i = j-u..j+l; the first l columns are room to pivot
    dense               (n, n)            matrix[j, i] = A[i, j], the transpose
    pivots              (n,) int32

All arrays are C-contiguous, numbers are float64. Every function returns LAPACK's `info`: 0 done; i
> 0 the i-th pivot is zero or the i-th leading minor is not positive (positions count from 1); -1
the shapes do not fit together, and nothing was done. Source: E. Anderson et al., LAPACK Users'
Guide, 3rd ed., SIAM 1999, doi:10.1137/1.9780898719604.
"""

from __future__ import annotations

import ctypes

import numpy as np

from fmbs_skfem.core.compiling.jit import deferred, jit

_ROUTINES = ("dpbtrf", "dpotrf", "dgbtrf", "dgbtrs", "dgetrf", "dgetrs")
_PBTRF, _POTRF, _GBTRF, _GBTRS, _GETRF, _GETRS = range(len(_ROUTINES))

#: the half of a symmetric band, and A x = b instead of A^T x = b
_LOWER, _PLAIN = (
    ord("L"),
    ord("N"),
)

ADDRESSES: np.ndarray  #: of the routines in this process, in the order of `_ROUTINES`


def __getattr__(name: str) -> np.ndarray:
    """ADDRESSES, found when they are first asked for."""
    if name != "ADDRESSES":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from scipy.linalg import cython_lapack

    found = [_address(cython_lapack.__pyx_capi__[routine]) for routine in _ROUTINES]
    globals()[name] = np.array(found, dtype=np.int64)
    addresses: np.ndarray = globals()[name]
    return addresses


def _address(capsule: object) -> int:
    """Where the function of a capsule is."""
    name, pointer = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name.restype = ctypes.c_char_p
    name.argtypes = [ctypes.py_object]
    pointer.restype = ctypes.c_void_p
    pointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return int(pointer(capsule, name(capsule)))


_call = deferred("fmbs_skfem.core.compiling.intrinsics", "call_lapack")


@jit
def pbtrf(addresses: np.ndarray, band: np.ndarray) -> int:
    """Factor a symmetric positive definite band in place.

        A = L L^T

    `band` (n, d+1).
    """
    n, width = band.shape
    return _call(addresses, _PBTRF, (np.int8(_LOWER), n, width - 1, band, width))


@jit
def potrf(addresses: np.ndarray, half: np.ndarray) -> int:
    """Factor a symmetric positive definite dense matrix in place.

        A = L L^T

    `half` (n, m+1) holds a half of it.
    """
    n, rows = half.shape
    if rows <= n:
        return -1
    return _call(addresses, _POTRF, (np.int8(_LOWER), n, half, rows - 1))


@jit
def gbtrf(
    addresses: np.ndarray, band: np.ndarray, lower: int, upper: int, pivots: np.ndarray
) -> int:
    """Factor a general band in place with partial pivoting.

        P A = L U

    `band` (n, 2l+u+1); fills `pivots` (n,).
    """
    n, width = band.shape
    if width != 2 * lower + upper + 1 or pivots.size != n:
        return -1
    return _call(addresses, _GBTRF, (n, n, lower, upper, band, width, pivots))


@jit
def gbtrs(
    addresses: np.ndarray,
    band: np.ndarray,
    lower: int,
    upper: int,
    pivots: np.ndarray,
    rhs: np.ndarray,
) -> int:
    """Solve in place with a band and pivots from `gbtrf`.

        A x = b

    for every row of `rhs` (i, n).
    """
    n, width = band.shape
    if width != 2 * lower + upper + 1 or pivots.size != n or rhs.shape[1] != n:
        return -1
    return _call(
        addresses,
        _GBTRS,
        (np.int8(_PLAIN), n, lower, upper, rhs.shape[0], band, width, pivots, rhs, max(n, 1)),
    )


@jit
def getrf(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray) -> int:
    """Factor a dense matrix in place with partial pivoting.

        P A = L U

    `matrix` (n, n) is A^T; fills `pivots` (n,).
    """
    n = matrix.shape[0]
    if matrix.shape[1] != n or pivots.size != n:
        return -1
    return _call(addresses, _GETRF, (n, n, matrix, max(n, 1), pivots))


@jit
def getrs(addresses: np.ndarray, matrix: np.ndarray, pivots: np.ndarray, rhs: np.ndarray) -> int:
    """Solve in place with a matrix and pivots from `getrf`.

        A x = b

    for every row of `rhs` (i, n).
    """
    n = matrix.shape[0]
    if matrix.shape[1] != n or pivots.size != n or rhs.shape[1] != n:
        return -1
    return _call(
        addresses,
        _GETRS,
        (np.int8(_PLAIN), n, rhs.shape[0], matrix, max(n, 1), pivots, rhs, max(n, 1)),
    )
