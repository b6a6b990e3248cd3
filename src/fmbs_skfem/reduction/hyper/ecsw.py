"""Energy-conserving sampling and weighting: few cells (or points) whose weighted forces stand for
all.

    G[(s,i), e] = (U_e^T F_e(q_s))_i,   b = G 1:   find w >= 0 with few non-zeros and ||G w - b|| <= eta ||b||

Non-negative least squares by active sets, stopped as soon as the residual allows it. The columns P
chosen so far are kept as a factor G_P = Q T; a column is appended by one triangular solve and
removed by plane rotations. Two forms of the data serve:

    Gram        A = G^T G (e,e), c = G^T b (e,), formed once; T is the Cholesky factor of A_PP and Q is not needed
    compressed  R (k,e), y (k,) with ||R w - y|| = ||G w - b|| for all w, k <= e + 1, from a blockwise QR of [G b]

The Gram form loses residuals below about 1e-7 ||b|| to round-off, the compressed form does not.
Arrays: G (i,e) with one row a training snapshot and mode, b (i,), w (e,).

Sources: C. Farhat, P. Avery, T. Chapman, J. Cortial, Int. J. Numer. Meth. Engng 98 (2014) 625-662,
doi 10.1002/nme.4668; C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, chapter 23, doi
10.1137/1.9781611971217.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.compiling.jit import jit
from ...core.compiling.structs import Integers, Matrix, Vector, opener, routine
from ...core.errors import InputError, Reason, SolverError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.values.arrays import finite

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Blocks = ArrayLike | Iterable[ArrayLike]  #: a matrix, or its rows in blocks

# A^T A has the square of the condition: it is good down to tolerances of about 1e-7, a tenth of
# this; below a thin QR comes first
GRAM_FLOOR = 1e-6  #: smallest tolerance for which the Gram form is used
# a hundredth and a hundred times of it select the same cells of a double pendulum, as does 1e-6
DEPENDENT = 1e-12  #: a column with less than this outside the span, relative (in the Gram form: of its square), is passed over


@storable
@dataclass(frozen=True)
class Sample:
    """The cells kept and their weights; all other weights are zero.

    w (e,) has `weights` at `indices` and 0 elsewhere.
    """

    indices: Indices  #: (j,), rising
    weights: Array  #: (j,), positive
    residual: float  #: ||G w - b|| / ||b||
    iterations: int  #: columns appended


@storable
class Level(Enum):
    """What is sampled.

    ELEMENTS: whole cells get one weight each; POINTS: every quadrature point has its own.
    """

    ELEMENTS = "elements"
    POINTS = "points"


@storable
@dataclass(frozen=True)
class Selection:
    """Sampled cells or points of one component, numbered through all its bodies.

    The weights w > 0 of (44) multiply quadrature weights: `sample.indices` (j,) count the cells or
    points of all bodies of the component in their order, all others have no weight.
    """

    component: str
    level: Level
    sample: Sample
    total: int  #: number of candidates
    training_s: float  #: CPU time of the training forces and their normal equations [s]
    snnls_s: float  #: CPU time of the sparse non-negative least squares [s]


@dataclass(frozen=True)
class Gram:
    """Normal equations of the training matrix.

        ||G w - b||^2 = w^T A w - 2 c^T w + b^T b

    which is all that the search reads; G (i, e), b (i,).
    """

    A: Array  #: (e,e) G^T G
    c: Array  #: (e,) G^T b
    bb: float  #: b^T b


class NotReached(SolverError):
    """No selection reaches the tolerance.

    Attributes: `best`, the selection with the least residual, of the cells or points that were
    searched.
    """

    def __init__(self, where: str, tolerance: float, best: Sample) -> None:
        remedy = "a larger tolerance; with b = G 1 only round-off is in the way, another b may be no non-negative combination of columns"
        got = f"{best.residual:.3g} with {best.indices.size} columns, the least that was found"
        super().__init__(
            say(where, f"a relative residual of {tolerance:.3g}", got, remedy), Reason.NOT_CONVERGED
        )
        self.best = best


def weights(G: ArrayLike, tolerance: float, b: ArrayLike | None = None) -> Sample:
    """Sparse weights w (e,) of the columns of G (i, e); b (i,) is their sum unless given.

        ||G w - b|| <= tolerance ||b||,    w >= 0

    Below a tolerance of 1e-6 the search runs on the compressed form. A G that is stored in blocks
    is searched as `weights_from_gram(gram(blocks), tolerance)` or, `R, y = compress(blocks)`,
    `weights(R, tolerance, b=y)`.

        >>> import numpy as np
        >>> from fmbs_skfem.reduction import ecsw
        >>> G = np.array([[1.0, 2.0, 3.0], [1.0, 1.0, 1.0]])  # two equations, three cells
        >>> found = ecsw.weights(G, 1e-10)
        >>> found.indices.tolist(), found.weights.round(6).tolist()
        ([0, 2], [1.5, 1.5])
    """
    where = "ecsw.weights"
    _check_tolerance(tolerance, where)
    matrix = _checked(G, where)
    target = matrix.sum(axis=1) if b is None else _target(b, matrix.shape[0], where)
    # one matrix of as many rows as cells, however many states: it is made once, and the search
    # never reads G again
    if tolerance >= GRAM_FLOOR:
        active, w, _, iterations = _search_gram(gram(matrix, target), tolerance)
        achieved = _residual(matrix, target, active, w)
        if achieved <= tolerance:
            return _sample(active, w, achieved, iterations)
    active, w, iterations = _search_columns(*compress(matrix, target), tolerance)
    found = _sample(active, w, _residual(matrix, target, active, w), iterations)
    if not found.residual <= tolerance:
        raise NotReached(where, tolerance, found)
    return found


def weights_from_gram(normal: Gram, tolerance: float) -> Sample:
    """The same from the Gram form alone; `residual` then carries its round-off, about 1e-8.

    InputError for a tolerance below 1e-6 or not below 1, and for b = 0; NotReached where the
    residual stays above the tolerance.
    """
    where = "ecsw.weights_from_gram"
    _check_tolerance(tolerance, where)
    if tolerance < GRAM_FLOOR:
        remedy = "below it search the compressed form: R, y = compress(blocks); weights(R, tolerance, b=y)"
        raise InputError(say(where, f"a tolerance of at least {GRAM_FLOOR}", tolerance, remedy))
    found = _sample(*_search_gram(normal, tolerance))
    if not found.residual <= tolerance:
        raise NotReached(where, tolerance, found)
    return found


def gram(blocks: Blocks, b: ArrayLike | None = None) -> Gram:
    """Normal equations of a training matrix that comes whole or in blocks of rows; b (i,) is G 1
    unless given.

        A = G^T G,    c = G^T b,    b^T b

    InputError for blocks of different widths, or another number of entries of b than of rows.
    """
    A = np.zeros((0, 0))
    c = np.zeros(0)
    bb = 0.0
    for number, (block, part) in enumerate(_blocks(blocks, b, "ecsw.gram")):
        if number == 0:
            A, c = np.zeros((block.shape[1], block.shape[1])), np.zeros(block.shape[1])
        A += block.T @ block
        c += block.T @ part
        bb += float(part @ part)
    return Gram(A, c, bb)


def compress(blocks: Blocks, b: ArrayLike | None = None) -> tuple[Array, Array]:
    """R (k, e) and y (k,), k <= e + 1, by the triangle of a blockwise QR of [G b].

        ||R w - y|| = ||G w - b||    for every w

    Rows of blocks are appended one block after the other, so that G never stands in memory as a
    whole. InputError as of `gram`.
    """
    triangle = np.zeros((0, 0))
    for number, (block, part) in enumerate(_blocks(blocks, b, "ecsw.compress")):
        rows = np.column_stack([block, part])
        # block after block, so that G is never whole in the memory
        triangle = np.asarray(
            np.linalg.qr(rows if number == 0 else np.vstack([triangle, rows]), mode="r")
        )
    return np.ascontiguousarray(triangle[:, :-1]), np.ascontiguousarray(triangle[:, -1])


def _blocks(blocks: Blocks, b: ArrayLike | None, where: str) -> Iterator[tuple[Array, Array]]:
    """Checked pairs (block of G, block of b)."""
    start = 0
    columns = -1
    total = None if b is None else np.asarray(b, dtype=np.float64)
    for item in [blocks] if isinstance(blocks, np.ndarray) and blocks.ndim == 2 else blocks:  # type: ignore[union-attr]
        block = _checked(item, where)
        if columns not in (-1, block.shape[1]):
            raise InputError(
                say(where, f"blocks of {columns} columns", f"{block.shape[1]} columns")
            )
        columns = block.shape[1]
        stop = start + block.shape[0]
        yield (
            block,
            block.sum(axis=1)
            if total is None
            else _target(total[start:stop], block.shape[0], where),
        )
        start = stop
    if columns == -1 or (total is not None and total.size != start):
        got = (
            "no block"
            if columns == -1 or total is None
            else f"{start} rows of G and {total.size} entries of b"
        )
        raise InputError(
            say(where, "at least one block of G and as many rows as b has entries", got)
        )


class _Search(NamedTuple):
    """An active-set search; Gram form: rows = A, R empty; compressed form: rows = R^T, c unused."""

    rows: Matrix  #: (e, i)
    c: Vector  #: (e,)
    R: Matrix  #: (k, e)
    y: Vector  #: (k,)
    bb: float
    tolerance: float
    active: Integers  #: (e,) columns in use, the first of them
    w: Vector  #: (e,) their weights
    squared: Vector  #: (1,) of the residual
    counts: Integers  #: (2,) columns in use, iterations
    free: Integers  #: (e,) 1 for columns that are not in use
    passed: Integers  #: (e,) 1 for those that do not help beside the present ones
    T: Matrix  #: (e, e) factor of the active columns
    z: Vector  #: (e,)
    Q: Matrix  #: (e, k) orthonormal columns as rows
    trial: Vector  #: (e,)
    slope: Vector  #: (e,)
    column: Vector  #: (i,) one that is appended
    gap: Vector  #: (k,)


_opened = opener(_Search)


def _run_search(
    rows: Array, c: Array, bb: float, R: Array, y: Array, tolerance: float
) -> tuple[Indices, Array, float, int]:
    """Active columns, their weights, the squared residual and the iterations."""
    e, k = len(rows), len(y)
    w, z, trial, slope = (np.zeros(e) for _ in range(4))
    active = np.zeros(e, np.int64)
    squared = np.array([bb])
    counts = np.zeros(2, np.int64)
    flags = (np.ones(e, np.int64), np.zeros(e, np.int64))
    work = (np.empty((e, e)), z, np.empty((e, k)), trial, slope)
    columns, right = np.ascontiguousarray(rows, np.float64), np.ascontiguousarray(R, np.float64)
    spare = np.zeros(columns.shape[1]), np.zeros(k)
    _search(
        _Search(
            columns,
            c,
            right,
            y,
            float(bb),
            float(tolerance),
            active,
            w,
            squared,
            counts,
            *flags,
            *work,
            *spare,
        )
    )
    count, iterations = counts.tolist()
    return active[:count], w[:count], float(squared[0]), iterations


def _search_gram(normal: Gram, tolerance: float) -> tuple[Indices, Array, float, int]:
    """Active columns, their weights, the relative residual and the iterations, from the Gram form."""
    _check_target(normal.bb)
    empty = np.zeros((0, normal.c.size))
    active, w, squared, iterations = _run_search(
        normal.A, normal.c, normal.bb, empty, np.zeros(0), tolerance
    )
    return active, w, float(np.sqrt(squared / normal.bb)), iterations


def _search_columns(R: Array, y: Array, tolerance: float) -> tuple[Indices, Array, int]:
    """Active columns, their weights and the iterations, from the compressed form."""
    bb = float(y @ y)
    _check_target(bb)
    active, w, _, iterations = _run_search(R.T, np.zeros(R.shape[1]), bb, R, y, tolerance)
    return active, w, iterations


# a routine, which allocates nothing: a function that Python calls by numba takes 0.3 s to load, as
# long as a small training
@routine
def _search(table: Any, _: Any) -> int:
    """Active-set search."""
    S = _opened(table)
    e = S.c.size
    orthogonal = S.y.size > 0
    count = 0
    iterations = 0
    squared = S.bb
    while iterations < 3 * e:
        squared = _slope_columns(S, count) if orthogonal else _slope_gram(S, count)
        # as soon as the tolerance is met: each further column would be a cell more in every step of
        # every run
        if squared <= S.tolerance * S.tolerance * S.bb:
            break
        chosen = -1
        for candidate in range(e):
            eligible = (
                S.free[candidate] == 1 and S.passed[candidate] == 0 and S.slope[candidate] > 0.0
            )
            # the steepest one, as Lawson and Hanson's
            if eligible and (chosen < 0 or S.slope[candidate] > S.slope[chosen]):
                chosen = candidate
        if chosen < 0:
            break
        # factors of the active columns are kept, and grow by a row: k^2 operations a column, and
        # not k^3
        accepted = (
            _append_column(S, chosen, count) if orthogonal else _append_gram(S, chosen, count)
        )
        if not accepted:
            S.passed[chosen] = 1
            continue
        S.active[count], S.w[count], S.free[chosen] = chosen, 0.0, 0
        # a column that did not help may do so beside another one
        for candidate in range(e):
            S.passed[candidate] = 0
        count = _descend(S.T, S.z, S.Q, S.w, S.trial, S.active, S.free, count + 1)
        iterations += 1
    S.squared[0], S.counts[0], S.counts[1] = squared, count, iterations
    return 0


@jit
def _slope_gram(S: Any, count: int) -> float:
    """||G w - b||^2 = b.b - w.(c + slope) and slope = c - A w."""
    product = 0.0
    for i in range(S.c.size):
        S.slope[i] = S.c[i]
    for j in range(count):
        row = S.rows[S.active[j]]
        for i in range(S.c.size):
            S.slope[i] -= row[i] * S.w[j]
    for j in range(count):
        product += S.w[j] * (S.c[S.active[j]] + S.slope[S.active[j]])
    return max(S.bb - product, 0.0)


@jit
def _slope_columns(S: Any, count: int) -> float:
    """||y - R w||^2 and slope = R^T (y - R w)."""
    squared = 0.0
    for i in range(S.y.size):
        S.gap[i] = S.y[i]
    for j in range(S.c.size):
        S.slope[j] = 0.0
    for j in range(count):
        column = S.rows[S.active[j]]
        for i in range(S.y.size):
            S.gap[i] -= column[i] * S.w[j]
    for i in range(S.y.size):
        squared += S.gap[i] * S.gap[i]
        for j in range(S.c.size):
            S.slope[j] += S.R[i, j] * S.gap[i]
    return squared


@jit
def _append_gram(S: Any, chosen: int, count: int) -> bool:
    """Next column of the Cholesky factor T of A_PP and entry of z = T^-T c_P; False where the
    column cannot help.
    """
    row = S.rows[chosen]
    T = S.T
    column = S.column
    left = row[chosen]
    gain = S.c[chosen]
    for i in range(count):
        column[i] = row[S.active[i]]
    for i in range(count):
        part = column[i] / T[i, i]
        for j in range(i + 1, count):
            column[j] -= T[i, j] * part
        left -= part * part
        gain -= part * S.z[i]
        T[i, count] = part
    if left <= DEPENDENT * row[chosen] or gain <= 0.0:
        return False
    T[count, count] = np.sqrt(left)
    S.z[count] = gain / T[count, count]
    return True


@jit
def _append_column(S: Any, chosen: int, count: int) -> bool:
    """Next column of T and row of Q (orthonormal columns as rows) and entry of z = Q^T y; False
    where the column cannot help.
    """
    T, Q, rest = S.T, S.Q, S.column
    whole, left, gain = 0.0, 0.0, 0.0
    for i in range(rest.size):
        rest[i] = S.rows[chosen, i]
        whole += rest[i] * rest[i]
    for i in range(count):
        T[i, count] = 0.0
    # Gram and Schmidt twice: once leaves round-off over the part outside, twice leaves round-off
    for _ in range(2):
        for i in range(count):
            part = 0.0
            for k in range(rest.size):
                part += Q[i, k] * rest[k]
            for k in range(rest.size):
                rest[k] -= Q[i, k] * part
            T[i, count] += part
    for k in range(rest.size):
        left += rest[k] * rest[k]
        gain += rest[k] * S.y[k]
    if left <= DEPENDENT * DEPENDENT * whole or gain <= 0.0:
        return False
    T[count, count] = np.sqrt(left)
    for k in range(rest.size):
        Q[count, k] = rest[k] / T[count, count]
    S.z[count] = gain / T[count, count]
    return True


@jit
def _descend(
    T: Array, z: Array, Q: Array, w: Array, trial: Array, active: Indices, free: Indices, count: int
) -> int:
    """Least squares over the active columns; those whose weight would not be positive leave.
    Returns how many stay.
    """
    while count > 0:
        _solve_triangle(T, z, trial, count)
        share, worst = _find_first_zero(w, trial, count)
        for i in range(count):
            w[i] = trial[i] if worst < 0 else w[i] + share * (trial[i] - w[i])
        if worst < 0:
            break
        w[worst] = 0.0
        for i in range(count - 1, -1, -1):
            if w[i] <= 0.0 and trial[i] <= 0.0:
                free[active[i]] = 1
                _remove(T, z, Q, w, active, count, i)
                count -= 1
    return count


@jit
def _solve_triangle(T: Array, z: Array, trial: Array, count: int) -> None:
    """Weights of the least squares over the active columns: T trial = z."""
    for i in range(count - 1, -1, -1):
        trial[i] = z[i]
        for j in range(i + 1, count):
            trial[i] -= T[i, j] * trial[j]
        trial[i] /= T[i, i]


@jit
def _find_first_zero(w: Array, trial: Array, count: int) -> tuple[float, int]:
    """Which weight is zero first on the way from w to trial, after which share of it; the whole way
    and -1 where none is.
    """
    share = 1.0
    first = -1
    for i in range(count):
        if trial[i] <= 0.0:
            fraction = w[i] / (w[i] - trial[i]) if w[i] > 0.0 else 0.0
            if first < 0 or fraction < share:
                share, first = fraction, i
    return share, first


@jit
def _remove(T: Array, z: Array, Q: Array, w: Array, active: Indices, count: int, at: int) -> None:
    """Take column `at` out of the factor; plane rotations make T triangular again."""
    for j in range(at, count - 1):
        active[j], w[j] = active[j + 1], w[j + 1]
        for i in range(j + 2):
            T[i, j] = T[i, j + 1]
    for i in range(at, count - 1):
        # plane rotations in place of new factors: no column is read again
        length = np.hypot(T[i, i], T[i + 1, i])
        cosine, sine = T[i, i] / length, T[i + 1, i] / length
        for j in range(i, count - 1):
            upper, lower = T[i, j], T[i + 1, j]
            T[i, j], T[i + 1, j] = cosine * upper + sine * lower, cosine * lower - sine * upper
        upper, lower = z[i], z[i + 1]
        z[i], z[i + 1] = cosine * upper + sine * lower, cosine * lower - sine * upper
        for k in range(Q.shape[1]):
            upper, lower = Q[i, k], Q[i + 1, k]
            Q[i, k], Q[i + 1, k] = cosine * upper + sine * lower, cosine * lower - sine * upper


def _sample(active: Indices, w: Array, residual: float, iterations: int) -> Sample:
    order = np.argsort(active)
    return Sample(active[order], w[order], residual, int(iterations))


def _residual(G: Array, b: Array, active: Indices, w: Array) -> float:
    return float(np.linalg.norm(G[:, active] @ w - b) / np.linalg.norm(b))


def _check_tolerance(tolerance: float, where: str) -> None:
    if not 0.0 < tolerance < 1.0:
        raise InputError(
            say(
                where, "0 < tolerance < 1", tolerance, "1e-3 keeps the error of most reduced models"
            )
        )


def _check_target(bb: float) -> None:
    if not bb > 0.0:
        remedy = "the training snapshots carry no force: add some that deform the body"
        raise InputError(say("ecsw", "a right-hand side that is not zero", "all zero", remedy))


def _checked(G: ArrayLike, where: str) -> Array:
    wanted = "finite training forces as a matrix (snapshots times modes, cells)"
    return np.ascontiguousarray(
        finite(G, where, wanted, None, None, remedy="leave out the snapshots of a failed run")
    )


def _target(b: ArrayLike, rows: int, where: str) -> Array:
    return finite(b, where, f"b as {rows} finite numbers, one a row of G", rows)
