r"""Factors of large sparse symmetric matrices, made once and applied many times.

    P A P^T = L D L^T,    x = P^T L^-T D^-1 L^-1 P b

without pivoting: for positive definite matrices, and for indefinite ones whose leading minors stay away from zero. L has a unit
diagonal and is kept in supernodes, sets of consecutive columns with one pattern. A solution reads L twice and little else, so its
time is the size of L divided by the bandwidth of the memory; in float32 it is half as long and good to about six digits.

    unknowns with equal rows    merged to one node of a smaller graph, which is ordered and analysed in place of the matrix
    order                       minimum degree (SuperLU's), or the caller's
    numbers                     multifrontal: a dense front a supernode, its remainder added into the front of the parent
    supernode, w columns        the columns below the diagonal one after the other: column c holds rows c+1..w-1, then `rows`

Sources: J. W. H. Liu, SIAM Review 34, 1992, doi:10.1137/1034004 (multifrontal method); SIAM J. Matrix Anal. Appl. 11, 1990,
doi:10.1137/0611010 (elimination trees); C. Ashcraft, SIAM J. Sci. Comput. 16, 1995, doi:10.1137/0916081 (compressed graphs);
C. Ashcraft, R. Grimes, ACM Trans. Math. Softw. 15, 1989, doi:10.1145/76909.76910 (relaxed supernodes).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import spilu
from threadpoolctl import threadpool_limits

from fmbs_skfem.core.errors import InputError, Reason, SolverError, say
from fmbs_skfem.core.jit import deferred, jit
from fmbs_skfem.core.structs import Integers, Shorts

PANEL = 48  #: columns of a front that are eliminated before the rest of the front is updated
STRIP = 128  #: columns of a front that one dense product updates
SLACK = 6.0  #: zeros stored for each row that need not be read, where supernodes are joined
GONE, ABSENT = -1, -2  #: places of unknowns that are not in a front
DONE, OUTSIDE = -1, -2  #: results of a factorisation: a matrix has an entry outside the pattern it was analysed for
LOST = 8.0 * np.finfo(float).eps  #: a pivot smaller than this times its diagonal entry has no digit left


class Tree(NamedTuple):
    """Supernodes of L, in an order in which children come before their parents.

    Supernode s has the columns first[s]..first[s+1]-1 and, below them, the rows rows[start[s]:start[s+1]]: positions in P A P^T.
    """

    order: Integers  #: (n,) unknown at each position
    first: Integers  #: (supernodes + 1,)
    start: Integers  #: (supernodes + 1,)
    rows: Shorts  #: (start[-1],) ascending in each supernode
    children: Integers  #: (supernodes,) number of children


@dataclass(frozen=True)
class Factors:
    """L and D of P A P^T = L D L^T."""

    tree: Tree
    lower: np.ndarray  #: (entries,) L below its diagonal, supernode after supernode, float64 or float32
    pivots: np.ndarray  #: (n,) D, float64


_add_product = deferred("fmbs_skfem.core.intrinsics", "add_product")


# --- analysis: the compressed graph, its order, its tree -----------------------------------------------------------------------


@jit
def _merge_equal(indptr: np.ndarray, indices: np.ndarray, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Node of each unknown, and one unknown of each node: unknowns with equal rows make a node. `keys` are random numbers."""
    n = indptr.size - 1
    sums = np.zeros(n, np.int64)
    for i in range(n):
        for k in range(indptr[i], indptr[i + 1]):
            sums[i] += keys[indices[k]]
    sequence = np.argsort(sums, kind="mergesort")
    leader = np.arange(n)
    for at in range(1, n):
        i, j = sequence[at], leader[sequence[at - 1]]
        size = indptr[i + 1] - indptr[i]
        if sums[i] == sums[j] and size == indptr[j + 1] - indptr[j]:
            same = True
            for k in range(size):
                same = same and indices[indptr[i] + k] == indices[indptr[j] + k]
            if same:
                leader[i] = j
    node, leaders, count = np.full(n, -1), np.empty(n, np.int64), 0
    for i in range(n):
        if node[leader[i]] < 0:
            node[leader[i]], leaders[count] = count, i
            count += 1
        node[i] = node[leader[i]]
    return node, leaders[:count]


@jit
def _tree(indptr: np.ndarray, indices: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Parent of each position in the elimination tree of the graph, its nodes taken in `order` (-1: a root)."""
    n = order.size
    position = np.empty(n, np.int64)
    position[order] = np.arange(n)
    parent, ancestor = np.full(n, -1), np.full(n, -1)
    for i in range(n):
        for k in range(indptr[order[i]], indptr[order[i] + 1]):
            j = position[indices[k]]
            while j < i and ancestor[j] != i:
                above = ancestor[j]
                ancestor[j] = i
                if above < 0:
                    parent[j] = i
                    break
                j = above
    return parent


@jit
def _postorder(parent: np.ndarray) -> np.ndarray:
    """Positions of a tree, every subtree in one piece and before its root."""
    n = parent.size
    head, after = np.full(n + 1, -1), np.full(n, -1)
    for j in range(n - 1, -1, -1):
        after[j] = head[parent[j]]
        head[parent[j]] = j
    result, stack, top, done = np.empty(n, np.int64), np.empty(n + 1, np.int64), 0, 0
    stack[0] = -1
    while top >= 0:
        child = head[stack[top]]
        if child >= 0:
            head[stack[top]] = after[child]
            top += 1
            stack[top] = child
        else:
            if stack[top] >= 0:
                result[done] = stack[top]
                done += 1
            top -= 1
    return result


@jit
def _counts(
    indptr: np.ndarray, indices: np.ndarray, order: np.ndarray, parent: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, and unknowns in them, of each column of the factor, with the diagonal."""
    n = order.size
    position, mark = np.empty(n, np.int64), np.full(n, -1)
    position[order] = np.arange(n)
    nodes, unknowns = np.ones(n, np.int64), weights[order].astype(np.int64)
    for i in range(n):
        mark[i] = i
        for k in range(indptr[order[i]], indptr[order[i] + 1]):
            j = position[indices[k]]
            while j < i and mark[j] != i:
                mark[j] = i
                nodes[j] += 1
                unknowns[j] += weights[order[i]]
                j = parent[j]
    return nodes, unknowns


@jit
def _merge_columns(parent: np.ndarray, unknowns: np.ndarray, weights: np.ndarray, slack: float) -> np.ndarray:
    """First column of each supernode, and the number of columns at the end.

    A supernode joins its parent's where this stores at most `slack` zeros for each row of its pattern, which is then not read.
    """
    n = parent.size
    first, width, height, top = np.empty(n + 1, np.int64), np.empty(n, np.int64), np.empty(n, np.int64), 0
    for j in range(n):
        first[top], width[top], height[top] = j, weights[j], unknowns[j]
        while top > 0 and parent[first[top] - 1] == first[top]:
            wide, high = width[top - 1], height[top - 1]
            if wide * (wide + height[top] - high) > slack * (high - wide + 8):
                break
            width[top - 1] += width[top]
            height[top - 1] = wide + height[top]
            top -= 1
        top += 1
    first[top] = n
    return first[: top + 1]


@jit
def _patterns(
    indptr: np.ndarray, indices: np.ndarray, order: np.ndarray, parent: np.ndarray, first: np.ndarray, sizes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows below each supernode of the graph: where they start, the rows, and the number of children."""
    n, count = order.size, first.size - 1
    position, home, mark = np.empty(n, np.int64), np.empty(n, np.int64), np.full(n, -1)
    position[order] = np.arange(n)
    start, children = np.zeros(count + 1, np.int64), np.zeros(count, np.int64)
    for s in range(count):
        home[first[s] : first[s + 1]] = s
        start[s + 1] = start[s] + sizes[first[s + 1] - 1] - 1
    rows, stack, top = np.empty(start[count], np.int64), np.empty(count + 1, np.int64), 0
    for s in range(count):
        end, at = first[s + 1], start[s]
        for j in range(first[s], end):
            for k in range(indptr[order[j]], indptr[order[j] + 1]):
                i = position[indices[k]]
                if i >= end and mark[i] != s:
                    mark[i], rows[at] = s, i
                    at += 1
        for _ in range(children[s]):
            top -= 1
            for k in range(start[stack[top]], start[stack[top] + 1]):
                i = rows[k]
                if i >= end and mark[i] != s:
                    mark[i], rows[at] = s, i
                    at += 1
        rows[start[s] : at].sort()
        stack[top] = s
        top += 1
        if parent[end - 1] >= 0:
            children[home[parent[end - 1]]] += 1
        else:
            top -= 1
    return start, rows, children


def graph(matrix: csr_array) -> tuple[csr_array, np.ndarray]:
    """The compressed graph of a symmetric matrix, with the diagonal, and the node of each unknown."""
    n = matrix.shape[0]
    pattern = csr_array((np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape)
    turned = pattern.T.tocsr()
    if not (np.array_equal(turned.indptr, pattern.indptr) and np.array_equal(turned.indices, pattern.indices)):
        pattern = pattern + turned  # round-off that is zero in one half only is often left out there
    keys = np.random.default_rng(0).integers(np.iinfo(np.int64).max, size=n)
    node, leaders = _merge_equal(pattern.indptr, pattern.indices, keys)
    members = csr_array((np.ones(n, np.int32), node, np.arange(n + 1)), shape=(n, leaders.size))
    return pattern[leaders] @ members, node


def minimum_degree(nodes: csr_array) -> np.ndarray:
    """Nodes of a graph in an order of small fill: SuperLU's multiple minimum degree, reached through its cheapest factors."""
    n = nodes.shape[0]
    size = np.diff(nodes.indptr)
    columns = csc_array((np.where(nodes.indices == np.repeat(np.arange(n), size), float(n), -1.0), nodes.indices, nodes.indptr))
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return np.argsort(spilu(columns, drop_tol=1e30, fill_factor=1, **options).perm_c)


def analyse(matrix: csr_array, order: np.ndarray | None = None) -> Tree:
    """Supernodes of the factors of a symmetric matrix, for the `order` of its unknowns where one is given."""
    _check(matrix, order)
    nodes, node = graph(matrix)
    weights = np.bincount(node)
    if order is None:
        sequence = minimum_degree(nodes)
    else:
        sequence = node[order][np.sort(np.unique(node[order], return_index=True)[1])]
    sequence = sequence[_postorder(_tree(nodes.indptr, nodes.indices, sequence))]
    parent = _tree(nodes.indptr, nodes.indices, sequence)
    sizes, unknowns = _counts(nodes.indptr, nodes.indices, sequence, parent, weights)
    first = _merge_columns(parent, unknowns, weights[sequence], SLACK)
    start, rows, children = _patterns(nodes.indptr, nodes.indices, sequence, parent, first, sizes)
    offset = np.concatenate([[0], np.cumsum(weights[sequence])])
    total = np.concatenate([[0], np.cumsum(weights[sequence][rows])])
    return Tree(
        order=np.argsort(np.argsort(sequence)[node], kind="stable"),
        first=offset[first],
        start=total[start],
        rows=(np.arange(total[-1]) + np.repeat(offset[rows] - total[:-1], np.diff(total))).astype(np.int32),
        children=children,
    )


# --- numbers: one dense front a supernode --------------------------------------------------------------------------------------


@jit
def _eliminate_panel(front: np.ndarray, begin: int, end: int, least: np.ndarray) -> int:
    """Columns begin..end-1 of a front become L, with D on the diagonal; returns the first column without a pivot, or -1.

    front[j, i] is row i >= j of column j; `least` holds the smallest pivots allowed.
    """
    for j in range(begin, end):
        column = front[j, j:]
        pivot = column[0]
        if not abs(pivot) > least[j]:
            return j
        for c in range(j + 1, end):
            factor = front[j, c] / pivot
            if factor != 0.0:
                target, source = front[c, c:], front[j, c:]
                for i in range(target.size):
                    target[i] -= factor * source[i]
        for i in range(1, column.size):
            column[i] /= pivot
    return -1


@jit
def _update_rest(front: np.ndarray, begin: int, end: int) -> None:
    """front -= L D L^T in the columns after `end`, with L and D in the columns begin..end-1."""
    m = front.shape[0]
    panel = front[begin:end, end:].copy()
    scaled = panel.copy()
    for j in range(begin, end):
        scaled[j - begin] *= front[j, j]
    for c in range(end, m, STRIP):
        stop = min(c + STRIP, m)
        product = np.dot(np.ascontiguousarray(scaled[:, c - end : stop - end]).T, np.ascontiguousarray(panel[:, c - end :]))
        for j in range(c, stop):
            target, source = front[j, j:], product[j - c, j - c :]
            for i in range(target.size):
                target[i] -= source[i]


@jit
def _eliminate(front: np.ndarray, width: int, least: np.ndarray) -> int:
    """The first `width` columns of a front, panel by panel; returns the first column without a pivot, or -1."""
    for begin in range(0, width, PANEL):
        end = min(begin + PANEL, width)
        bad = _eliminate_panel(front, begin, end, least)
        if bad >= 0:
            return bad
        if end < front.shape[0]:
            _update_rest(front, begin, end)
    return -1


@jit
def _room(tree: Tree) -> tuple[int, int]:
    """Rows of the largest front, and numbers in the largest set of remainders that wait for their parents."""
    largest, most, now, top = 0, 0, 0, 0
    waiting = np.zeros(tree.children.size + 1, np.int64)
    for s in range(tree.children.size):
        r = tree.start[s + 1] - tree.start[s]
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
def _load(
    front: np.ndarray, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, unknowns: np.ndarray, place: np.ndarray
) -> bool:
    """Rows `unknowns` of the matrix become the first columns of a front; False where an entry lies outside its pattern.

    `place` is the row of an unknown in the front, GONE for one eliminated before and ABSENT for one that has none.
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
    """The lower half of a child's remainder, column by column, into the rows and columns `at` of the front of its parent."""
    put = 0
    for c in range(at.size):
        target = front[at[c]]
        for i in range(c, at.size):
            target[at[i]] += remainder[put]
            put += 1


@jit
def _pack(front: np.ndarray, begin: int, end: int, shift: int, target: np.ndarray) -> int:
    """Columns begin..end-1 of a front from `shift` below the diagonal on, one after the other; returns their number."""
    put = 0
    for j in range(begin, end):
        column = front[j, j + shift :]
        target[put : put + column.size] = column
        put += column.size
    return put


@jit
def eliminate(tree: Tree, indptr: np.ndarray, indices: np.ndarray, data: np.ndarray, lower: np.ndarray, pivots: np.ndarray) -> int:
    """Fill `lower` and `pivots`; returns DONE, OUTSIDE, or the first position without a pivot."""
    largest, most = _room(tree)
    room, waiting, place = np.empty(largest * largest), np.empty(most), np.full(tree.order.size, ABSENT)
    stack, top, used, put = np.empty(tree.children.size + 1, np.int64), 0, 0, 0
    for s in range(tree.children.size):
        j0, j1 = tree.first[s], tree.first[s + 1]
        w, below = j1 - j0, tree.order[tree.rows[tree.start[s] : tree.start[s + 1]]]
        m = w + below.size
        place[tree.order[j0:j1]] = np.arange(w)
        place[below] = np.arange(w, m)
        front, least = room[: m * m].reshape(m, m), np.empty(w)
        if not _load(front, indptr, indices, data, tree.order[j0:j1], place):
            return OUTSIDE
        for j in range(w):
            least[j] = LOST * abs(front[j, j])
        for _ in range(tree.children[s]):
            top -= 1
            at = place[tree.order[tree.rows[tree.start[stack[top]] : tree.start[stack[top] + 1]]]]
            used -= at.size * (at.size + 1) // 2
            _add_remainder(front, at, waiting[used:])
        bad = _eliminate(front, w, least)
        if bad >= 0:
            return j0 + bad
        for j in range(w):
            pivots[j0 + j] = front[j, j]
        put += _pack(front, 0, w, 1, lower[put:])
        if m > w:
            used += _pack(front, w, m, 0, waiting[used:])
            stack[top] = s
            top += 1
        place[tree.order[j0:j1]] = GONE
        place[below] = ABSENT
    return DONE


# --- solution ------------------------------------------------------------------------------------------------------------------


@jit
def _down(lower: np.ndarray, y: np.ndarray, w: int) -> None:
    """y <- L^-1 y in one supernode of w columns."""
    m, at, c = y.size, 0, 0
    while c + 4 <= w:
        t = m - c - 4
        a, b = lower[at : at + t + 3], lower[at + t + 3 : at + 2 * t + 5]
        d, e = lower[at + 2 * t + 5 : at + 3 * t + 6], lower[at + 3 * t + 6 : at + 4 * t + 6]
        y0 = y[c]
        y1 = y[c + 1] - a[0] * y0
        y2 = y[c + 2] - a[1] * y0 - b[0] * y1
        y3 = y[c + 3] - a[2] * y0 - b[1] * y1 - d[0] * y2
        y[c + 1], y[c + 2], y[c + 3] = y1, y2, y3
        a, b, d, rest = a[3:], b[2:], d[1:], y[c + 4 :]
        for i in range(t):
            rest[i] -= a[i] * y0 + b[i] * y1 + (d[i] * y2 + e[i] * y3)
        at += 4 * t + 6
        c += 4
    for j in range(c, w):
        rest, a, y0 = y[j + 1 :], lower[at : at + m - j - 1], y[j]
        for i in range(a.size):
            rest[i] -= a[i] * y0
        at += a.size


@jit
def _up(lower: np.ndarray, y: np.ndarray, w: int) -> None:
    """y <- L^-T y in one supernode of w columns."""
    m, at, zero = y.size, lower.size, lower.dtype.type(0.0)
    for j in range(w - 1, w - w % 4 - 1, -1):
        rest, a, s0 = y[j + 1 :], lower[at - m + j + 1 : at], zero
        for i in range(a.size):
            s0 = _add_product(s0, a[i], rest[i])
        y[j] -= s0
        at -= a.size
    for c in range(w - w % 4 - 4, -1, -4):
        t = m - c - 4
        at -= 4 * t + 6
        a, b = lower[at : at + t + 3], lower[at + t + 3 : at + 2 * t + 5]
        d, e = lower[at + 2 * t + 5 : at + 3 * t + 6], lower[at + 3 * t + 6 : at + 4 * t + 6]
        u, v, x, rest = a[3:], b[2:], d[1:], y[c + 4 :]
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
        begin, end, below = tree.first[s], tree.first[s + 1], tree.rows[tree.start[s] : tree.start[s + 1]]
        w, y = end - begin, buffer[: end - begin + below.size]
        size = w * (w - 1) // 2 + w * below.size
        for q in range(x.shape[0]):
            z = x[q]
            y[:w] = z[begin:end]
            y[w:] = 0.0
            _down(lower[at : at + size], y, w)
            z[begin:end] = y[:w]
            for i in range(below.size):
                z[below[i]] += y[w + i]
        at += size


@jit
def _backward(tree: Tree, lower: np.ndarray, x: np.ndarray, buffer: np.ndarray) -> None:
    """x <- L^-T x for every row of x (k, n)."""
    at = lower.size
    for s in range(tree.children.size - 1, -1, -1):
        begin, end, below = tree.first[s], tree.first[s + 1], tree.rows[tree.start[s] : tree.start[s + 1]]
        w, y = end - begin, buffer[: end - begin + below.size]
        size = w * (w - 1) // 2 + w * below.size
        for q in range(x.shape[0]):
            z = x[q]
            y[:w] = z[begin:end]
            for i in range(below.size):
                y[w + i] = z[below[i]]
            _up(lower[at - size : at], y, w)
            z[begin:end] = y[:w]
        at -= size


@jit
def substitute(tree: Tree, lower: np.ndarray, pivots: np.ndarray, rhs: np.ndarray, x: np.ndarray, buffer: np.ndarray) -> None:
    """Solve for every row of `rhs` (k, n) in place; `x` (k, n) or more rows, and `buffer` have the precision of `lower`.

    Rows are scaled to 1 on the way, and pivots by a power of two, which keeps both away from the ends of single precision: a
    correction of zero would count as convergence.
    """
    n, many = tree.order.size, rhs.shape[0]
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


def _check(matrix: csr_array, order: np.ndarray | None) -> None:
    """Refuse what the analysis would misread."""
    n = matrix.shape[0]
    if matrix.format != "csr" or matrix.shape != (n, n) or n == 0 or matrix.dtype != np.float64:
        got = f"{matrix.format} {matrix.shape} of {matrix.dtype}"
        raise InputError(say("direct", "a square csr_array of float64", got, "convert it with csr_array(matrix, dtype=float)"))
    if not matrix.has_canonical_format:
        raise InputError(say("direct", "rows with ascending columns", "unsorted or repeated ones", "call sum_duplicates()"))
    stored = np.bincount(matrix.indices[matrix.indices == np.repeat(np.arange(n), np.diff(matrix.indptr))], minlength=n)
    if not stored.all():
        raise InputError(say("direct", "a stored diagonal", f"none in row {stored.argmin()}", "store zeros there"))
    if order is not None and not np.array_equal(np.sort(order), np.arange(n)):
        raise InputError(say("direct: order", f"a permutation of 0..{n - 1}", f"an array of shape {np.shape(order)}"))


def factor(matrix: csr_array, precision: type[np.floating[Any]] = np.float64, tree: Tree | None = None) -> Factors:
    """Factors of a symmetric matrix, its L kept in `precision`; `tree` saves the analysis for a matrix of a known pattern.

    The factorisation itself is in float64 and reads one half of the matrix, P A P^T above its diagonal. A pivot without a digit
    left raises SolverError (SINGULAR_TANGENT).
    """
    if np.dtype(precision) not in (np.dtype(np.float64), np.dtype(np.float32)):
        raise InputError(say("direct: precision", "float64 or float32", precision))
    tree = analyse(matrix) if tree is None else tree
    lower, pivots = np.empty(entries(tree), precision), np.empty(matrix.shape[0])
    with threadpool_limits(limits=1, user_api="blas"):  # the products of small fronts lose more by threads than they gain
        bad = eliminate(tree, matrix.indptr, matrix.indices, matrix.data, lower, pivots)
    if bad == OUTSIDE:
        raise InputError(say("direct: tree", "the analysis of this pattern", "an entry outside of it", "analyse this matrix"))
    if bad >= 0:
        text = f"no pivot is left for unknown {tree.order[bad]}, place {bad + 1} of {pivots.size} in the order of elimination"
        raise SolverError(f"direct: {text}", Reason.SINGULAR_TANGENT, worst=((f"unknown {tree.order[bad]}", 0.0),))
    return Factors(tree, lower, pivots)


def solve(factors: Factors, b: np.ndarray) -> np.ndarray:
    """Solve A x = b in place, for one b (n,) or for every row of b (k, n), C-contiguous float64; returns b."""
    n, kind = factors.pivots.size, factors.lower.dtype
    if b.dtype != np.float64 or not b.flags.c_contiguous or b.ndim not in (1, 2) or b.shape[-1] != n:
        expected = f"a C-contiguous array of float64, ({n},) or (k, {n})"
        raise InputError(say("direct: right-hand side", expected, f"{b.dtype} {b.shape}", "copy it with np.ascontiguousarray"))
    rows = b.reshape(-1, n)
    room = np.empty(rows.shape, kind), np.empty(height(factors.tree), kind)
    substitute(factors.tree, factors.lower, factors.pivots, rows, *room)
    return b


def residual(matrix: csr_array, x: np.ndarray, b: np.ndarray) -> np.ndarray:
    """b - A x, for one x (n,) or for every row of x (k, n)."""
    return b - (matrix @ x.T).T


def inertia(factors: Factors) -> int:
    """Number of negative eigenvalues of A: that of its negative pivots (Sylvester's law)."""
    return int(np.count_nonzero(factors.pivots < 0.0))


def height(tree: Tree) -> int:
    """Rows of the largest supernode."""
    return int((np.diff(tree.first) + np.diff(tree.start)).max(initial=0))


def entries(tree: Tree) -> int:
    """Numbers that are kept of L below its diagonal, with the zeros of joined supernodes."""
    w, r = np.diff(tree.first), np.diff(tree.start)
    return int((w * (w - 1) // 2 + w * r).sum())


def fill(matrix: csr_array) -> int:
    """Numbers that the factors of `matrix` would have, without factorising."""
    return entries(analyse(matrix)) + matrix.shape[0]
