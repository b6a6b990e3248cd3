"""Proper orthogonal decomposition of snapshots.

    q ~ mean + U xi,   X - mean = U S Z^T,   U^T W U = 1,   keep the smallest r with   eps >= sum_{i>r} s_i^2 / sum_i s_i^2

Arrays: snapshots X (n,s), modes U (n,r), singular values s (i,), metric W (n,n), symmetric and
positive definite, by default the identity. With the mass as the metric singular values are
displacements, the same on every mesh, and the reduced mass is the identity. The decomposition is a
thin QR followed by the SVD of a triangular factor; a Gram matrix of the snapshots would lose the
singular values below 1e-8 of the largest, one of the orthonormal columns Q, with rows scaled by the
diagonal of W, loses none:

    X = Q R,   Q^T W Q = C C^T,   C^T R = Y S Z^T,   U = Q C^-T Y

Where eps is to hold in a second metric V too, mode i counts there with s_i |u_i|_V, since the
columns of Z are orthonormal.

Source: Y. Hou, C. Liu, H. Hu, Comput. Methods Appl. Mech. Engrg. 361 (2020) 112690, equations (9),
(13), (14), (18), (50), doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array, diags_array, eye_array

from ...core.errors import InputError, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from ...core.values.arrays import finite

Array = NDArray[np.float64]
Singular: TypeAlias = tuple[Array, Array]  #: U (n,i) and s (i,)

EPS = float(np.finfo(np.float64).eps)
# the kept start is far from the mean, or the mean itself: 1e-14 and 1e-8 give the same 42 modes
SAME = 1e-12  #: a kept state that differs from the mean by less than this, relative to their size, is the mean


@dataclass(frozen=True)
class Basis:
    """A basis of states; `singular_values` are those of all deviations from the mean, also beyond
    the truncation.

        q = mean + modes @ xi,    eps = sum_{i>r} s_i^2 / sum_i s_i^2

    U^T W U = 1 for the metric W that it was made in. `modes` (n, r) may be fewer than the singular
    values (i,): eps is the error of truncation.
    """

    modes: Array  #: (n,r), columns orthonormal in the metric: a kept state first, then the largest singular value first
    mean: Array  #: (n,)
    singular_values: Array  #: (i,), falling
    #: S (b,m) and T (m c,r) of modes = (S (x) I_c) T that act on every component of vectors alike,
    #: see `invariant`
    factors: tuple[Array, csr_array] | None = None
    #: of the modes, the last, that open joints inside the component, see `against_joints`
    against: int = 0


def basis(
    snapshots: ArrayLike,
    tolerance: float | None = None,
    modes: int | None = None,
    keep: ArrayLike | None = None,
    mean: ArrayLike | None = None,
    metric: csr_array | None = None,
    second: csr_array | None = None,
) -> Basis:
    """POD basis U of the snapshots X (n,s), truncated by `tolerance` (the eps of equation (14)) or
    to a number of `modes`.

    The snapshots are centred at their mean, or at the state `mean` (n,) where one is given. The
    state `keep` (n,), as a rule the initial one, is represented exactly: its deviation is the first
    mode, the others are those of what remains. `tolerance` refers to the energy of all deviations,
    `modes` counts the kept state. Modes are orthonormal in the `metric` (n,n), symmetric and
    positive definite; `tolerance` holds in a `second` one as well, which may be semidefinite.
    InputError for snapshots that are not finite or do not move, and without exactly one of the two
    limits.

        >>> import numpy as np
        >>> from fmbs_skfem.reduction import pod
        >>> t = np.linspace(0.0, 1.0, 9)
        >>> states = np.outer([3.0, 4.0], np.sin(t))  # (n, s), all along one direction
        >>> pod.basis(states, tolerance=1e-12).modes.T.round(3).tolist()
        [[0.6, 0.8]]
    """
    x = _states(snapshots, "snapshots")
    centre = x.mean(axis=1) if mean is None else _state(mean, "mean", x.shape[0])
    W = _metric(metric, x.shape[0])
    return _decompose(
        W, x - centre[:, None], centre, EPS * _size(W, x), tolerance, modes, keep, second
    )


def update(
    factors: Sequence[tuple[ArrayLike, ArrayLike]],
    mean: ArrayLike,
    tolerance: float | None = None,
    modes: int | None = None,
    keep: ArrayLike | None = None,
    metric: csr_array | None = None,
    second: csr_array | None = None,
) -> Basis:
    """Basis of several runs from their truncated factors: the left singular vectors of them side by
    side.

        [U_1 S_1, U_2 S_2, ...]    (50)

    A factor is (U (n,r), s (r,)) of deviations from the one state `mean` (n,), without a kept
    state: `(b.modes, b.singular_values[: b.modes.shape[1]])` of a basis `b`; metrics as those of
    `basis`.
    """
    if not factors:
        raise InputError(say("pod.update", "at least one factor (U, s)", "none"))
    columns = []
    for number, (u, s) in enumerate(factors):
        left = _states(u, f"U of factor {number}")
        values = np.asarray(s, dtype=np.float64)
        if values.shape != left.shape[1:] or not np.all(values >= 0.0):
            expected = f"{left.shape[1]} non-negative singular values in factor {number}, one a column of U"
            raise InputError(
                say(
                    "pod.update",
                    expected,
                    f"shape {values.shape}",
                    "cut the singular values to the kept modes",
                )
            )
        columns.append(left * values)
    if len({block.shape[0] for block in columns}) > 1:
        sizes = [block.shape[0] for block in columns]
        raise InputError(
            say("pod.update", "factors of one component, with equally many rows", f"{sizes} rows")
        )
    weighted = np.hstack(columns)
    centre = _state(mean, "mean", weighted.shape[0])
    W = _metric(metric, weighted.shape[0])
    return _decompose(W, weighted, centre, EPS * _size(W, weighted), tolerance, modes, keep, second)


def of_vectors(
    snapshots: ArrayLike,
    keep: ArrayLike,
    tolerance: float | None = None,
    modes: int | None = None,
    metric: csr_array | None = None,
    second: csr_array | None = None,
) -> Basis:
    """Basis of coordinates that are vectors in space, from their components (n,s), as many columns
    as snapshots times components.

        U (x) I_c

    holds the states turned in any way if U holds their components. Vectors in the plane may be
    complex numbers, x + iy, one column a snapshot: then U and i U hold all turned states. The first
    of the columns `keep` (n,k) is the field 1: the tolerance refers to the deviations from it. All
    of them are represented exactly, in the first columns of U. Metrics as those of `basis`.
    """
    x, kept = _states(snapshots, "snapshots"), _states(keep, "fields to be kept")
    W = _metric(metric, x.shape[0])
    one = kept[:, :1] / _size(W, kept[:, :1])
    others, sizes = (
        left_singular(W, outside(W, kept[:, 1:], one))
        if kept.shape[1] > 1
        else (kept[:, :0], np.zeros(0))
    )
    first = np.hstack([one, others[:, sizes > SAME * _size(W, kept)]])
    all_left, s = left_singular(W, outside(W, x, one))
    left, rest = left_singular(W, outside(W, x, first))
    sizes_of = _in_metrics(second, (left, rest), (all_left, s))
    count = _count(
        sizes_of, int(np.sum(rest > EPS * _size(W, x))), tolerance, modes, first.shape[1]
    )
    return Basis(
        np.ascontiguousarray(np.hstack([first, outside(W, left[:, :count], first)])),
        np.zeros(len(x)),
        s,
    )


def truncation(singular_values: ArrayLike, tolerance: float) -> int:
    """Smallest number r of modes that a tolerance allows; the tails are summed from the small end.

        tolerance >= sum_{i>r} s_i^2 / sum_i s_i^2    (14)

    `singular_values` are (i,). InputError where they are not finite or all zero, and for a
    tolerance outside of 0 to 1.

        >>> from fmbs_skfem.reduction import pod
        >>> pod.truncation([1.0, 0.1, 0.01], 1e-3)  # 0.01^2 / 1.0101 is left out
        2
    """
    s = np.asarray(singular_values, dtype=np.float64)
    if s.ndim != 1 or s.size == 0 or not np.all(np.isfinite(s)) or not np.max(s) > 0.0:
        raise InputError(say("pod.truncation", "finite singular values that are not all zero", s))
    return _tail_count(s, tolerance, s)


def _tail_count(s: Array, tolerance: float, every: Array) -> int:
    """Smallest r with sum_{i>r} s_i^2 <= tolerance sum(every^2), where `every` has a positive
    maximum.
    """
    if not 0.0 < tolerance < 1.0:
        raise InputError(
            say("pod", "0 < tolerance < 1", tolerance, "1e-12 means a relative error of 1e-6")
        )
    unit = float(np.max(every))
    # from the small end: a sum from the large one would lose the tail in its round-off
    tails = np.append(np.cumsum(np.square(s / unit)[::-1])[::-1], 0.0)
    return int(np.argmax(tails <= tolerance * np.sum(np.square(every / unit))))


def _decompose(
    W: csr_array,
    x: Array,
    mean: Array,
    floor: float,
    tolerance: float | None,
    modes: int | None,
    keep: ArrayLike | None,
    second: csr_array | None,
) -> Basis:
    """Basis of the deviations x (n,s); singular values up to `floor` are round-off.

    A kept state is the first direction, and the decomposition is that of the rest: it costs at most
    one more mode, as a rule none.
    """
    left, s = left_singular(W, x)
    if not np.any(s > floor):
        remedy = "give it loads or an initial motion, or leave this component out of the reduction"
        raise InputError(
            say(
                "pod",
                "a component that moves in the training run",
                "one that stays where it is",
                remedy,
            )
        )
    first = (
        np.zeros((len(mean), 0))
        if keep is None
        else _direction(W, _state(keep, "keep", x.shape[0]), mean)
    )
    every = rest = left, s
    # the start is kept: without it slender beams begin with membrane strain that they do not have,
    # and indefinite tangents
    if first.shape[1]:
        rest = left_singular(W, outside(W, x, first))
    left = rest[0]
    count = _count(
        _in_metrics(second, rest, every),
        int(np.sum(rest[1] > floor)),
        tolerance,
        modes,
        first.shape[1],
    )
    return Basis(
        np.ascontiguousarray(np.hstack([first, outside(W, left[:, :count], first)])), mean, s
    )


def _direction(W: csr_array, state: Array, mean: Array) -> Array:
    """The deviation of a state as a unit column (n,1), or no column when it is round-off."""
    deviation = state - mean
    length = _size(W, deviation)
    if length <= SAME * max(_size(W, state), _size(W, mean)):
        return np.zeros((len(mean), 0))
    return (deviation / length)[:, None]


def _metric(metric: csr_array | None, n: int) -> csr_array:
    """The metric, the identity where there is none."""
    return csr_array(eye_array(n)) if metric is None else metric


def _size(W: csr_array, x: Array) -> float:
    """Norm of all entries in the metric, also where their squares overflow or vanish."""
    unit = float(np.max(np.abs(x)))
    return (
        unit * float(np.sqrt(np.sum((x.conj() / unit) * (W @ (x / unit))).real))
        if unit > 0.0
        else 0.0
    )


def outside(W: csr_array, x: Array, first: Array) -> Array:
    """x (n,) or (n, k) without its part along the orthonormal columns `first` (n, r) in the metric
    W (n, n).

        x - U U^T W x

    twice, so that what is left is orthogonal to round-off; conjugate where `first` is complex.
    """
    # twice, as what round-off leaves of the first time is as large as small modes
    for _ in range(2):
        x = x - first @ (first.conj().T @ (W @ x))
    return x


def orthonormal(W: csr_array, columns: Array) -> Array:
    """Columns (n,r) made orthonormal in the metric W (n,n), each a combination of itself and those
    before it.

        U = X C^-T

    with the Cholesky factor C of X^T W X; LinAlgError where that is not positive definite.
    """
    C = np.linalg.cholesky(columns.T @ (W @ columns))
    return np.ascontiguousarray(solve_triangular(C, columns.T, lower=True).T)


def left_singular(W: csr_array, x: Array) -> tuple[Array, Array]:
    """U (n,i), orthonormal in the metric W (n,n), and s (i,) of x (n,s).

        x = U diag(s) Z^T,    U^T W U = 1

    with i = min(n, s), s falling; x may be complex. W is symmetric and positive definite.
    """
    # positions and slopes in one size, so that QR loses no digits of either
    scale = np.sqrt(W.diagonal())
    # QR and SVD: a Gram matrix squares singular values, and knows nothing below eps of 1e-16 where
    # 1e-18 is asked for
    q, r = np.linalg.qr(scale[:, None] * x)
    C = np.linalg.cholesky(
        q.conj().T @ (diags_array(1.0 / scale) @ W @ diags_array(1.0 / scale) @ q)
    )
    u, s, _ = np.linalg.svd(C.conj().T @ r, full_matrices=False)
    return np.asarray(q @ solve_triangular(C, u, lower=True, trans="C") / scale[:, None]), s


def _lengths(metric: csr_array, u: Array) -> Array:
    """Lengths (i,) of columns (n,i) in a metric (n,n), which may be semidefinite."""
    return np.asarray(np.sqrt(np.maximum(np.sum(u.conj() * (metric @ u), axis=0).real, 0.0)))


def _in_metrics(
    second: csr_array | None, rest: Singular, every: Singular
) -> list[tuple[Array, Array]]:
    """What counts with each mode of `rest`, and with each of all deviations: in the metric of the
    modes, and in the second one.
    """
    found = [(rest[1], every[1])]
    return (
        found
        if second is None
        else [*found, (rest[1] * _lengths(second, rest[0]), every[1] * _lengths(second, every[0]))]
    )


def _count(
    sizes: list[tuple[Array, Array]],
    rank: int,
    tolerance: float | None,
    modes: int | None,
    kept: int,
) -> int:
    """Number of modes asked for beside those `kept`, at most the numerical rank.

    The tolerance refers to the sizes of all deviations, in every metric in which they have one; see
    `_in_metrics`.
    """
    if tolerance is not None and modes is None:
        return min(
            max(_tail_count(rest, tolerance, every) for rest, every in sizes if every.any()), rank
        )
    if modes is None or tolerance is not None:
        got = "neither" if modes is None else f"tolerance {tolerance} and {modes} modes"
        raise InputError(say("pod", "either a tolerance or a number of modes", got))
    if modes < max(1, kept):
        wanted = (
            "at least one mode"
            if kept < 2
            else f"at least {kept} modes, which hold the fields that are kept"
        )
        raise InputError(say("pod", wanted, modes))
    if modes > rank + kept:
        notify(
            f"pod: {modes} modes asked for, but the snapshots span only {rank + kept}; {rank + kept} are used"
        )
    return min(modes - kept, rank)


def _states(x: ArrayLike, name: str) -> Array:
    """x as a finite, non-empty matrix (n,s), of real or complex numbers."""
    wanted = f"finite {name} as a matrix (unknowns, samples)"
    remedy = "leave out what a failed run left"
    if np.iscomplexobj(x):
        return np.asarray(_states(np.real(x), name) + 1j * _states(np.imag(x), name))
    return finite(x, "pod", wanted, None, None, remedy=remedy)


def _state(x: ArrayLike, name: str, n: int) -> Array:
    """x as a finite vector (n,)."""
    return finite(x, "pod", f"{name} as {n} finite numbers", n)
