r"""Factors of large sparse symmetric matrices, made once and applied many times.

    P A P^T = L D L^T,    x = P^T L^-T D^-1 L^-1 P b

without pivoting: for positive definite matrices, and for indefinite ones whose leading minors stay
away from zero. L has a unit diagonal and is kept in supernodes, sets of consecutive columns with
one pattern, which the analysis finds (`supernodes`). A solution reads L twice and little else, so
its time is the size of L divided by the bandwidth of the memory; in float32 it is half as long and
good to about six digits.

    numbers                     multifrontal: a dense front a supernode, its remainder added into the front of the parent
    supernode, w columns        the columns below the diagonal one after the other: column c holds rows c+1..w-1, then `rows`

Source: J. W. H. Liu, SIAM Review 34, 1992, doi:10.1137/1034004 (multifrontal method).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from threadpoolctl import ThreadpoolController

from fmbs_skfem.core import processes
from fmbs_skfem.core.algebra.supernodes import Tree, analyse, entries, height, products
from fmbs_skfem.core.compiling.jit import deferred, jit, unlocked
from fmbs_skfem.core.errors import InputError, Reason, SolverError, say
from fmbs_skfem.core.storage.records import dataclass

PANEL = 48  #: columns of a front that are eliminated before the rest of the front is updated
# a front of 4137 rows and 1323 columns reads and writes the rest of itself 7 times, 28 by panels
BLOCK = 192  #: columns, a few panels, after which the rest of a front is updated
LANES = 16  #: rows of a column of a small front that are updated at once: it has some more rows, of zeros
SMALL = 96  #: rows of a front that loops of its own update faster than dense products
STRIP = 128  #: columns of a front that one dense product updates
GONE, ABSENT = -1, -2  #: places of unknowns that are not in a front
#: states of a supernode: to be eliminated, in a subtree that is done, at its root
OPEN, INSIDE, ROOT = 0, 1, 2
SHARED = 1e10  #: products of a factorisation from which its subtrees are shared out, 0.3 s
THREADS = 4  #: at most: what is left for the root grows with them
#: results of a factorisation: a matrix has an entry outside the pattern it was analysed for
DONE, OUTSIDE = (
    -1,
    -2,
)
#: a pivot smaller than this times its diagonal entry has no digit left
LOST = 8.0 * np.finfo(float).eps


@dataclass(frozen=True)
class Factors:
    """Factors of a symmetric matrix A.

        P A P^T = L D L^T

    with the order P of its unknowns.
    """

    tree: Tree
    #: (entries,) L below its diagonal, supernode after supernode, float64 or float32
    lower: np.ndarray
    pivots: np.ndarray  #: (n,) D, float64


_add_product = deferred("fmbs_skfem.core.compiling.intrinsics", "add_product")


@jit
def _take_one(front: np.ndarray, c: int, j: int) -> None:
    """Column j of a front, not yet divided by its pivot, is taken from column c; front[j, i] is row
    i >= j of column j.
    """
    low = c - c % LANES
    factor = front[j, c] / front[j, j]
    target, source = front[c, low:], front[j, low:]
    if factor != 0.0:
        for i in range(target.size):
            target[i] -= factor * source[i]


@jit
def _take_four(front: np.ndarray, c: int, j: int) -> None:
    """The same of the columns j..j+3."""
    low = c - c % LANES
    A = front[j]
    B = front[j + 1]
    C = front[j + 2]
    D = front[j + 3]
    a, b, d, e = A[c] / A[j], B[c] / B[j + 1], C[c] / C[j + 2], D[c] / D[j + 3]
    target = front[c, low:]
    x = A[low:]
    y = B[low:]
    z = C[low:]
    u = D[low:]
    for i in range(target.size):
        target[i] -= a * x[i] + b * y[i] + (d * z[i] + e * u[i])


@jit
def _divide(front: np.ndarray, j: int) -> None:
    """Column j by its pivot, below it."""
    pivot, column = front[j, j], front[j, j + 1 :]
    for i in range(column.size):
        column[i] /= pivot


@jit
def _eliminate_panel(front: np.ndarray, begin: int, end: int, stop: int, least: np.ndarray) -> int:
    """Columns begin..end-1 of a front become L, with D on the diagonal, and are taken from those
    before `stop`, four at a time.

    Returns the first column without a pivot, or -1; `least` holds the smallest pivots allowed.
    """
    four = begin + (end - begin) // 4 * 4
    for j in range(begin, end):
        if not abs(front[j, j]) > least[j]:
            return j
        first = begin + (j - begin) // 4 * 4
        for c in range(j + 1, first + 4 if j < four else stop):
            _take_one(front, c, j)
        if j < four and j == first + 3:
            for c in range(j + 1, stop):
                _take_four(front, c, first)
    for j in range(begin, end):
        _divide(front, j)
    return -1


@jit
def _update(front: np.ndarray, begin: int, end: int, first: int, last: int) -> None:
    """front -= L D L^T in the columns first..last-1, with L and D in the columns begin..end-1."""
    panel = front[begin:end, first:].copy()
    scaled = panel[:, : last - first].copy()
    for j in range(begin, end):
        scaled[j - begin] *= front[j, j]
    for c in range(first, last, STRIP):
        stop = min(c + STRIP, last)
        product = np.dot(
            np.ascontiguousarray(scaled[:, c - first : stop - first]).T,
            np.ascontiguousarray(panel[:, c - first :]),
        )
        for j in range(c, stop):
            target = front[j, j:]
            source = product[j - c, j - c :]
            for i in range(target.size):
                target[i] -= source[i]


@jit
def _eliminate(front: np.ndarray, width: int, least: np.ndarray) -> int:
    """The first `width` columns of a front, panel by panel, the columns behind each BLOCK once;
    returns the first column without a pivot, or -1.
    """
    m = front.shape[0]
    for block in range(0, width, BLOCK):
        last = min(block + BLOCK, width)
        for begin in range(block, last, PANEL):
            end = min(begin + PANEL, last)
            bad = _eliminate_panel(front, begin, end, m if m <= SMALL else end, least)
            if bad >= 0:
                return bad
            if m > SMALL and end < last:
                _update(front, begin, end, end, last)
        if m > SMALL and last < m:
            _update(front, block, last, last, m)
    return -1


@jit
def _room(tree: Tree, begin: int, end: int, state: np.ndarray) -> tuple[int, int]:
    """Rows of the largest front of the supernodes begin..end-1, and numbers in the largest set of
    remainders that wait for their parents; `state` as of `eliminate_range`.
    """
    largest, most, now, top = 0, 0, 0, 0
    waiting = np.zeros(end - begin + 1, np.int64)
    for s in range(begin, end):
        if state[s] == INSIDE:
            continue
        r = tree.start[s + 1] - tree.start[s]
        if state[s] == OPEN:
            largest = max(largest, tree.first[s + 1] - tree.first[s] + r)
            for _ in range(tree.children[s]):
                top -= 1
                now -= waiting[top]
        if r > 0:
            waiting[top] = r * (r + 1) // 2
            now += waiting[top]
            top += 1
        most = max(most, now)
    return largest, most


@jit
def _number_rows(tree: Tree, s: int, place: np.ndarray) -> None:
    """Places of unknowns in the front of a supernode: its columns, then the rows below them."""
    j0, j1 = tree.first[s], tree.first[s + 1]
    below = tree.rows[tree.start[s] : tree.start[s + 1]]
    for j in range(j0, j1):
        place[tree.order[j]] = j - j0
    for i in range(below.size):
        place[tree.order[below[i]]] = j1 - j0 + i


@jit
def _release_rows(tree: Tree, s: int, place: np.ndarray) -> None:
    """The columns of a supernode are eliminated, the rows below them in no front any more."""
    below = tree.rows[tree.start[s] : tree.start[s + 1]]
    for j in range(tree.first[s], tree.first[s + 1]):
        place[tree.order[j]] = GONE
    for i in range(below.size):
        place[tree.order[below[i]]] = ABSENT


@jit
def _load(
    front: np.ndarray,
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
    unknowns: np.ndarray,
    place: np.ndarray,
) -> bool:
    """Rows `unknowns` of the matrix become the first columns of a front; False where an entry lies
    outside its pattern.

    `place` is the row of an unknown in the front, GONE for one eliminated before and ABSENT for one
    that has none.
    """
    front[:] = 0.0
    for j in range(unknowns.size):
        for k in range(indptr[unknowns[j]], indptr[unknowns[j] + 1]):
            i = place[indices[k]]
            if i >= j:
                front[j, i] = data[k]
            elif i == ABSENT:
                return False
    return True


@jit
def _add_remainder(front: np.ndarray, at: np.ndarray, remainder: np.ndarray) -> None:
    """The lower half of a child's remainder, column by column, into the rows and columns `at` of
    the front of its parent.
    """
    put = 0
    for c in range(at.size):
        target = front[at[c]]
        for i in range(c, at.size):
            target[at[i]] += remainder[put]
            put += 1


@jit
def _add_child(
    tree: Tree,
    child: int,
    place: np.ndarray,
    places: np.ndarray,
    waiting: np.ndarray,
    used: int,
    front: np.ndarray,
) -> int:
    """Add the remainder of a child, the last of those that are waiting, into the front of its
    parent; returns how many numbers wait then.
    """
    rows = tree.rows[tree.start[child] : tree.start[child + 1]]
    at = places[: rows.size]
    for i in range(rows.size):
        at[i] = place[tree.order[rows[i]]]
    left = used - at.size * (at.size + 1) // 2
    _add_remainder(front, at, waiting[left:])
    return left


@jit
def _pack(front: np.ndarray, begin: int, end: int, shift: int, target: np.ndarray) -> int:
    """Columns begin..end-1 of a front from `shift` below the diagonal on, one after the other;
    returns their number.
    """
    put = 0
    for j in range(begin, end):
        column = front[j, j + shift :]
        room = target[put:]
        for i in range(column.size):
            room[i] = column[i]
        put += column.size
    return put


@jit
def eliminate(
    tree: Tree,
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
    lower: np.ndarray,
    pivots: np.ndarray,
) -> int:
    """Fill `lower` and `pivots`; returns DONE, OUTSIDE, or the first position without a pivot."""
    count = tree.children.size
    state = np.full(count, OPEN)
    whole, none = (0, count), (np.zeros(0), np.zeros(count, np.int64))
    return eliminate_range(tree, indptr, indices, data, lower, pivots, whole, 0, state, none)[0]


@unlocked
def eliminate_range(
    tree: Tree,
    indptr: np.ndarray,
    indices: np.ndarray,
    data: np.ndarray,
    lower: np.ndarray,
    pivots: np.ndarray,
    span: tuple[int, int],
    put: int,
    state: np.ndarray,
    done: tuple[np.ndarray, np.ndarray],
) -> tuple[int, np.ndarray]:
    """Fill `lower` and `pivots` for the supernodes of a `span` (begin, end), the numbers of the first
    from `put` on; DONE, OUTSIDE, or the first position without a pivot, and what remains for parents
    behind the span.

    Supernodes whose `state` is INSIDE or ROOT belong to subtrees that are `done`: remainders one
    after the other, and where that of a ROOT begins.
    """
    begin, end = span
    largest, most = _room(tree, begin, end, state)
    room = np.empty(largest * (largest + LANES))
    waiting = np.empty(most)
    place = np.full(tree.order.size, ABSENT)
    least, places = np.empty(largest), np.empty(largest, np.int64)
    stack = np.empty(end - begin + 1, np.int64)
    top = 0
    used = 0
    for s in range(begin, end):
        j0, j1 = tree.first[s], tree.first[s + 1]
        w = j1 - j0
        r = tree.start[s + 1] - tree.start[s]
        m = w + r
        if state[s] != OPEN:
            put += w * (w - 1) // 2 + w * r
            for j in range(j0, j1):
                place[tree.order[j]] = GONE
            if state[s] == ROOT and r > 0:
                size = r * (r + 1) // 2
                first = done[1][s]
                waiting[used : used + size] = done[0][first : first + size]
                used += size
                stack[top] = s
                top += 1
            continue
        _number_rows(tree, s, place)
        wide = (m + LANES - 1) // LANES * LANES if m <= SMALL else m
        front = room[: m * wide].reshape(m, wide)
        if not _load(front, indptr, indices, data, tree.order[j0:j1], place):
            return OUTSIDE, waiting[:0]
        for j in range(w):
            least[j] = LOST * abs(front[j, j])
        for _ in range(tree.children[s]):
            top -= 1
            used = _add_child(tree, stack[top], place, places, waiting, used, front)
        bad = _eliminate(front, w, least)
        if bad >= 0:
            return j0 + bad, waiting[:0]
        for j in range(w):
            pivots[j0 + j] = front[j, j]
        put += _pack(front[:, :m], 0, w, 1, lower[put:])
        if r > 0:
            used += _pack(front[:, :m], w, m, 0, waiting[used:])
            stack[top] = s
            top += 1
        _release_rows(tree, s, place)
    return DONE, waiting[:used]


def eliminate_side_by_side(
    tree: Tree,
    A: tuple[np.ndarray, np.ndarray, np.ndarray],
    lower: np.ndarray,
    pivots: np.ndarray,
    threads: int,
) -> int:
    """As `eliminate` of A = (indptr, indices, data), subtrees in threads of their own."""
    ranges = subtrees(tree, threads)
    w, r = np.diff(tree.first), np.diff(tree.start)
    offsets = np.concatenate([[0], np.cumsum(w * (w - 1) // 2 + w * r)])
    count = len(w)
    state, none = np.full(count, OPEN), (np.zeros(0), np.zeros(count, np.int64))

    def one(span: tuple[int, int]) -> tuple[int, np.ndarray]:
        found = eliminate_range(
            tree, *A, lower, pivots, span, int(offsets[span[0]]), np.full(count, OPEN), none
        )
        return found[0], found[1]

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(one, ranges))
    for bad, _ in parts:
        if bad != DONE:
            return bad
    places = np.zeros(count, np.int64)
    at = 0
    for (begin, end), (_, rest) in zip(ranges, parts, strict=True):
        state[begin:end] = INSIDE
        state[end - 1] = ROOT
        places[end - 1] = at
        at += len(rest)
    remainders = np.concatenate([np.zeros(0), *(rest for _, rest in parts)])
    del parts  # each rest is a view of all that its thread had waiting
    return int(
        eliminate_range(tree, *A, lower, pivots, (0, count), 0, state, (remainders, places))[0]
    )


def subtrees(tree: Tree, threads: int) -> list[tuple[int, int]]:
    """Spans (begin, end) of subtrees whose work is small enough to share it out evenly."""
    w, r = np.diff(tree.first).astype(float), np.diff(tree.start)
    work = w * (w + r) ** 2
    sizes, total = np.ones(len(w), np.int64), work.copy()
    stack: list[int] = []
    below: list[list[int]] = []
    for s in range(len(w)):
        mine = [stack.pop() for _ in range(int(tree.children[s]))]
        sizes[s] += sizes[mine].sum()
        total[s] += total[mine].sum()
        below.append(mine)
        if r[s] > 0:
            stack.append(s)
    roots = [s for s in range(len(w)) if r[s] == 0]
    found = list(roots)
    while found:
        heavy = max(found, key=lambda s: total[s])
        if total[heavy] <= total[roots].sum() / threads or not below[heavy]:
            break
        found.remove(heavy)
        found += below[heavy]
    found.sort(key=lambda s: -total[s])
    return [(int(s - sizes[s] + 1), int(s + 1)) for s in found]


# --- solution ------------------------------------------------------------------------------------------------------------------


@jit
def _down(lower: np.ndarray, y: np.ndarray, w: int) -> None:
    """y <- L^-1 y in one supernode of w columns."""
    m = y.size
    at = 0
    c = 0
    while c + 4 <= w:
        t = m - c - 4
        a, b = lower[at : at + t + 3], lower[at + t + 3 : at + 2 * t + 5]
        d, e = lower[at + 2 * t + 5 : at + 3 * t + 6], lower[at + 3 * t + 6 : at + 4 * t + 6]
        y0 = y[c]
        y1 = y[c + 1] - a[0] * y0
        y2 = y[c + 2] - a[1] * y0 - b[0] * y1
        y3 = y[c + 3] - a[2] * y0 - b[1] * y1 - d[0] * y2
        y[c + 1], y[c + 2], y[c + 3] = y1, y2, y3
        a = a[3:]
        b = b[2:]
        d = d[1:]
        rest = y[c + 4 :]
        for i in range(t):
            rest[i] -= a[i] * y0 + b[i] * y1 + (d[i] * y2 + e[i] * y3)
        at += 4 * t + 6
        c += 4
    for j in range(c, w):
        rest = y[j + 1 :]
        a = lower[at : at + m - j - 1]
        y0 = y[j]
        for i in range(a.size):
            rest[i] -= a[i] * y0
        at += a.size


@jit
def _up(lower: np.ndarray, y: np.ndarray, w: int) -> None:
    """y <- L^-T y in one supernode of w columns."""
    m = y.size
    at = lower.size
    zero = lower.dtype.type(0.0)
    for j in range(w - 1, w - w % 4 - 1, -1):
        rest = y[j + 1 :]
        a = lower[at - m + j + 1 : at]
        s0 = zero
        for i in range(a.size):
            s0 = _add_product(s0, a[i], rest[i])
        y[j] -= s0
        at -= a.size
    for c in range(w - w % 4 - 4, -1, -4):
        t = m - c - 4
        at -= 4 * t + 6
        a, b = lower[at : at + t + 3], lower[at + t + 3 : at + 2 * t + 5]
        d, e = lower[at + 2 * t + 5 : at + 3 * t + 6], lower[at + 3 * t + 6 : at + 4 * t + 6]
        u = a[3:]
        v = b[2:]
        x = d[1:]
        rest = y[c + 4 :]
        s0, s1, s2, s3 = zero, zero, zero, zero
        for i in range(t):
            s0 = _add_product(s0, u[i], rest[i])
            s1 = _add_product(s1, v[i], rest[i])
            s2 = _add_product(s2, x[i], rest[i])
            s3 = _add_product(s3, e[i], rest[i])
        y3 = y[c + 3] - s3
        y2 = y[c + 2] - s2 - d[0] * y3
        y1 = y[c + 1] - s1 - b[0] * y2 - b[1] * y3
        y[c] -= s0 + a[0] * y1 + a[1] * y2 + a[2] * y3
        y[c + 1], y[c + 2], y[c + 3] = y1, y2, y3


@jit
def _forward(tree: Tree, lower: np.ndarray, x: np.ndarray, buffer: np.ndarray) -> None:
    """x <- L^-1 x for every row of x (k, n)."""
    at = 0
    for s in range(tree.children.size):
        begin = tree.first[s]
        end = tree.first[s + 1]
        below = tree.rows[tree.start[s] : tree.start[s + 1]]
        w = end - begin
        y = buffer[: end - begin + below.size]
        size = w * (w - 1) // 2 + w * below.size
        for q in range(x.shape[0]):
            z = x[q]
            for i in range(w):
                y[i] = z[begin + i]
            for i in range(w, y.size):
                y[i] = 0.0
            _down(lower[at : at + size], y, w)
            for i in range(w):
                z[begin + i] = y[i]
            for i in range(below.size):
                z[below[i]] += y[w + i]
        at += size


@jit
def _backward(tree: Tree, lower: np.ndarray, x: np.ndarray, buffer: np.ndarray) -> None:
    """x <- L^-T x for every row of x (k, n)."""
    at = lower.size
    for s in range(tree.children.size - 1, -1, -1):
        begin = tree.first[s]
        end = tree.first[s + 1]
        below = tree.rows[tree.start[s] : tree.start[s + 1]]
        w = end - begin
        y = buffer[: end - begin + below.size]
        size = w * (w - 1) // 2 + w * below.size
        for q in range(x.shape[0]):
            z = x[q]
            for i in range(w):
                y[i] = z[begin + i]
            for i in range(below.size):
                y[w + i] = z[below[i]]
            _up(lower[at - size : at], y, w)
            for i in range(w):
                z[begin + i] = y[i]
        at -= size


@jit
def substitute(
    tree: Tree,
    lower: np.ndarray,
    pivots: np.ndarray,
    rhs: np.ndarray,
    x: np.ndarray,
    buffer: np.ndarray,
) -> None:
    """Solve for every row of `rhs` (k, n) in place; `x` (k, n) or more rows, and `buffer` have the
    precision of `lower`.

    Rows are scaled to 1 on the way, and pivots by a power of two, which keeps both away from the
    ends of single precision: a correction of zero would count as convergence.
    """
    n = tree.order.size
    many = rhs.shape[0]
    x = x[:many]
    size = 2.0 ** np.floor(np.log2(np.abs(pivots).max()))
    largest = np.ones(many)
    for q in range(many):
        norm = 0.0
        for i in range(n):
            norm = max(norm, abs(rhs[q, i]))
        if norm > 0.0:
            largest[q] = norm
        for i in range(n):
            x[q, i] = rhs[q, tree.order[i]] / largest[q]
    _forward(tree, lower, x, buffer)
    for q in range(many):
        for i in range(n):
            x[q, i] /= pivots[i] / size
    _backward(tree, lower, x, buffer)
    for q in range(many):
        for i in range(n):
            rhs[q, tree.order[i]] = x[q, i] * (largest[q] / size)


# --- what others call ----------------------------------------------------------------------------------------------------------


def factor(
    matrix: csr_array, precision: type[np.floating[Any]] = np.float64, tree: Tree | None = None
) -> Factors:
    """Factors of a symmetric matrix, its L kept in `precision`; `tree` saves the analysis for a
    matrix of a known pattern.

    The factorisation itself is in float64 and reads one half of the matrix, P A P^T above its
    diagonal. A pivot without a digit left raises SolverError (SINGULAR_TANGENT).
    """
    if np.dtype(precision) not in (np.dtype(np.float64), np.dtype(np.float32)):
        raise InputError(say("direct: precision", "float64 or float32", precision))
    tree = analyse(matrix) if tree is None else tree
    lower, pivots = np.empty(entries(tree), precision), np.empty(matrix.shape[0])
    with libraries().limit(
        limits=1, user_api="blas"
    ):  # the products of small fronts lose more by threads than they gain
        A = matrix.indptr, matrix.indices, matrix.data
        threads = min(processes.cores(), THREADS) if products(tree) > SHARED else 1
        bad = (
            eliminate_side_by_side(tree, A, lower, pivots, threads)
            if threads > 1
            else eliminate(tree, *A, lower, pivots)
        )
    if bad == OUTSIDE:
        raise InputError(
            say(
                "direct: tree",
                "the analysis of this pattern",
                "an entry outside of it",
                "analyse this matrix",
            )
        )
    if bad >= 0:
        text = f"no pivot is left for unknown {tree.order[bad]}, place {bad + 1} of {pivots.size} in the order of elimination"
        raise SolverError(
            f"direct: {text}", Reason.SINGULAR_TANGENT, worst=((f"unknown {tree.order[bad]}", 0.0),)
        )
    return Factors(tree, lower, pivots)


@cache
def libraries() -> ThreadpoolController:
    """The libraries of threads that are loaded; to look for them takes as long as the factors of a
    thousand unknowns.
    """
    import scipy.linalg  # noqa: F401  (its own is among them)

    return ThreadpoolController()


def solve(factors: Factors, b: np.ndarray) -> np.ndarray:
    """Solve in place with the factors of A.

        A x = b

    for one b (n,) or for every row of b (k, n), C-contiguous float64; returns b.
    """
    n = factors.pivots.size
    kind = factors.lower.dtype
    if (
        b.dtype != np.float64
        or not b.flags.c_contiguous
        or b.ndim not in (1, 2)
        or b.shape[-1] != n
    ):
        expected = f"a C-contiguous array of float64, ({n},) or (k, {n})"
        raise InputError(
            say(
                "direct: right-hand side",
                expected,
                f"{b.dtype} {b.shape}",
                "copy it with np.ascontiguousarray",
            )
        )
    rows = b.reshape(-1, n)
    room = np.empty(rows.shape, kind), np.empty(height(factors.tree), kind)
    substitute(factors.tree, factors.lower, factors.pivots, rows, *room)
    return b


def residual(matrix: csr_array, x: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Residual for one x (n,) or for every row of x (k, n).

        b - A x

    b as x, A (n, n).
    """
    return b - (matrix @ x.T).T
