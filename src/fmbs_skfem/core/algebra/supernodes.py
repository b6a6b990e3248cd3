r"""Analysis of a sparse symmetric matrix before it is factored: the compressed graph, its order,
its tree of supernodes.

    unknowns with equal rows    merged to one node of a smaller graph, which is ordered and analysed in place of the matrix
    order                       minimum degree (SuperLU's) or nested dissection, whichever takes less work, or the caller's
    supernode                   consecutive columns of L with one pattern, joined with others where few zeros are stored for it

Sources: J. W. H. Liu, SIAM J. Matrix Anal. Appl. 11, 1990, doi:10.1137/0611010 (elimination trees);
C. Ashcraft, SIAM J. Sci. Comput. 16, 1995, doi:10.1137/0916081 (compressed graphs); C. Ashcraft, R.
Grimes, ACM Trans. Math. Softw. 15, 1989, doi:10.1145/76909.76910 (relaxed supernodes); A. George, J.
W. H. Liu, SIAM J. Numer. Anal. 15, 1978, doi:10.1137/0715069 (nested dissection by levels).
"""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import spilu

from fmbs_skfem.core.compiling.jit import jit
from fmbs_skfem.core.compiling.structs import Integers, Shorts
from fmbs_skfem.core.errors import InputError, say

# a solid of 35 721 nodes: 92 million numbers and 2.3e11 products for 134 and 5.9e11 of minimum degree
DISSECTED = 2000  #: nodes from which nested dissection is tried, too
LEAF = 60  #: nodes of a part that is not divided
UNEVEN = 0.2  #: of a part, the least that a level may leave on either side
SLACK = 6.0  #: zeros stored for each row that need not be read, where supernodes are joined


KEPT = 2  #: trees of `of_pattern`


class Tree(NamedTuple):
    """Supernodes of L, in an order in which children come before their parents.

    Supernode s has the columns first[s]..first[s+1]-1 and, below them, the rows
    rows[start[s]:start[s+1]]: positions in P A P^T.
    """

    order: Integers  #: (n,) unknown at each position
    first: Integers  #: (supernodes + 1,)
    start: Integers  #: (supernodes + 1,)
    rows: Shorts  #: (start[-1],) ascending in each supernode
    children: Integers  #: (supernodes,) number of children


TREES: dict[bytes, Tree] = {}  #: by a digest of the pattern


@jit
def _merge_equal(
    indptr: np.ndarray, indices: np.ndarray, keys: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Node of each unknown, and one unknown of each node: unknowns with equal rows make a node.
    `keys` are random numbers.
    """
    n = indptr.size - 1
    sums = np.zeros(n, np.int64)
    for i in range(n):
        for k in range(indptr[i], indptr[i + 1]):
            sums[i] += keys[indices[k]]
    sequence = np.argsort(sums, kind="mergesort")
    leader = np.arange(n)
    for at in range(1, n):
        i = sequence[at]
        j = leader[sequence[at - 1]]
        size = indptr[i + 1] - indptr[i]
        if sums[i] == sums[j] and size == indptr[j + 1] - indptr[j]:
            same = True
            for k in range(size):
                same = same and indices[indptr[i] + k] == indices[indptr[j] + k]
            if same:
                leader[i] = j
    node = np.full(n, -1)
    leaders = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        if node[leader[i]] < 0:
            node[leader[i]], leaders[count] = count, i
            count += 1
        node[i] = node[leader[i]]
    return node, leaders[:count]


@jit
def _tree(indptr: np.ndarray, indices: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Parent of each position in the elimination tree of the graph, its nodes taken in `order` (-1:
    a root).
    """
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
    result = np.empty(n, np.int64)
    stack = np.empty(n + 1, np.int64)
    top = 0
    done = 0
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
    indptr: np.ndarray,
    indices: np.ndarray,
    order: np.ndarray,
    parent: np.ndarray,
    weights: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, and unknowns in them, of each column of the factor, with the diagonal."""
    n = order.size
    position = np.empty(n, np.int64)
    mark = np.full(n, -1)
    position[order] = np.arange(n)
    nodes = np.ones(n, np.int64)
    unknowns = weights[order].astype(np.int64)
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
def _merge_columns(
    parent: np.ndarray, unknowns: np.ndarray, weights: np.ndarray, slack: float
) -> np.ndarray:
    """First column of each supernode, and the number of columns at the end.

    A supernode joins its parent's where this stores at most `slack` zeros for each row of its
    pattern, which is then not read.
    """
    n = parent.size
    first = np.empty(n + 1, np.int64)
    width = np.empty(n, np.int64)
    height = np.empty(n, np.int64)
    top = 0
    for j in range(n):
        first[top], width[top], height[top] = j, weights[j], unknowns[j]
        while top > 0 and parent[first[top] - 1] == first[top]:
            wide = width[top - 1]
            high = height[top - 1]
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
    indptr: np.ndarray,
    indices: np.ndarray,
    order: np.ndarray,
    parent: np.ndarray,
    first: np.ndarray,
    sizes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows below each supernode of the graph: where they start, the rows, and the number of
    children.
    """
    n = order.size
    count = first.size - 1
    position = np.empty(n, np.int64)
    home = np.empty(n, np.int64)
    mark = np.full(n, -1)
    position[order] = np.arange(n)
    start, children = np.zeros(count + 1, np.int64), np.zeros(count, np.int64)
    for s in range(count):
        home[first[s] : first[s + 1]] = s
        start[s + 1] = start[s] + sizes[first[s + 1] - 1] - 1
    rows = np.empty(start[count], np.int64)
    stack = np.empty(count + 1, np.int64)
    top = 0
    for s in range(count):
        end = first[s + 1]
        at = start[s]
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
    pattern = csr_array(
        (np.ones(matrix.nnz, np.int32), matrix.indices, matrix.indptr), shape=matrix.shape
    )
    turned = pattern.T.tocsr()
    if not (
        np.array_equal(turned.indptr, pattern.indptr)
        and np.array_equal(turned.indices, pattern.indices)
    ):
        # round-off that is zero in one half only is often left out there
        pattern = pattern + turned
    keys = np.random.default_rng(0).integers(np.iinfo(np.int64).max, size=n)
    node, leaders = _merge_equal(pattern.indptr, pattern.indices, keys)
    members = csr_array((np.ones(n, np.int32), node, np.arange(n + 1)), shape=(n, leaders.size))
    return pattern[leaders] @ members, node


def minimum_degree(nodes: csr_array) -> np.ndarray:
    """Nodes of a graph in an order of small fill: SuperLU's multiple minimum degree, reached
    through its cheapest factors.
    """
    n = nodes.shape[0]
    size = np.diff(nodes.indptr)
    columns = csc_array(
        (
            np.where(nodes.indices == np.repeat(np.arange(n), size), float(n), -1.0),
            nodes.indices,
            nodes.indptr,
        )
    )
    options = {
        "permc_spec": "MMD_AT_PLUS_A",
        "diag_pivot_thresh": 0.0,
        "options": {"SymmetricMode": True},
    }
    return np.argsort(spilu(columns, drop_tol=1e30, fill_factor=1, **options).perm_c)


@jit
def _levels(
    indptr: np.ndarray,
    indices: np.ndarray,
    label: np.ndarray,
    start: int,
    queue: np.ndarray,
    level: np.ndarray,
) -> int:
    """Levels of the nodes of the part of a node, by their distance from it; how many it reaches, which
    stand in the queue in that order.
    """
    queue[0], level[start] = start, 0
    count, head = 1, 0
    while head < count:
        i = queue[head]
        head += 1
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if label[j] == label[start] and level[j] < 0:
                queue[count], level[j] = j, level[i] + 1
                count += 1
    return count


@jit
def _cut(sizes: np.ndarray, count: int) -> int:
    """The level of least size, over that of the smaller side it leaves; without an even one that in
    the middle.
    """
    best, least, below, middle = -1, np.inf, 0, 1
    for d in range(1, sizes.size - 1):
        below += sizes[d - 1]
        small = min(below, count - below - sizes[d])
        if 2 * below < count:
            middle = d
        if small >= UNEVEN * count and sizes[d] < least * small:
            best, least = d, sizes[d] / small
    return best if best > 0 else middle


@jit
def nested_dissection(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Nodes of a graph in an order of small fill: both sides of a level of distances from a node at
    its end, each in such an order, then that level.
    """
    n = indptr.size - 1
    order, label = np.arange(n), np.zeros(n, np.int64)
    level, queue, kept = np.full(n, -1), np.empty(n, np.int64), np.empty(n, np.int64)
    parts = [(0, n)]
    number = 0
    while len(parts) > 0:
        a, b = parts.pop()
        if b - a <= LEAF:
            continue
        number += 1
        for k in range(a, b):
            label[order[k]], level[order[k]] = number, -1
        count = _levels(indptr, indices, label, order[a], queue, level)
        if count < b - a:  # in several pieces: this one, then all others
            others = 0
            for k in range(a, b):
                if level[order[k]] < 0:
                    kept[others] = order[k]
                    others += 1
            order[a : a + count], order[a + count : b] = queue[:count], kept[:others]
            parts.append((a, a + count))
            parts.append((a + count, b))
            continue
        for _ in range(2):  # from the far end, so that levels are many and small
            start = queue[count - 1]
            for k in range(a, b):
                level[order[k]] = -1
            _levels(indptr, indices, label, start, queue, level)
        depth = level[queue[count - 1]]
        if depth < 2:
            continue
        sizes = np.zeros(depth + 1, np.int64)
        for k in range(count):
            sizes[level[queue[k]]] += 1
        cut = _cut(sizes, count)
        below, between = 0, 0
        for k in range(count):
            i = queue[k]
            apart = level[i] == cut
            if apart:
                apart = False
                for m in range(indptr[i], indptr[i + 1]):
                    j = indices[m]
                    apart = apart or (label[j] == number and level[j] == cut + 1)
            if apart:
                kept[between] = i
                between += 1
            elif level[i] <= cut:
                order[a + below] = i
                below += 1
        end = a + below
        for k in range(count):
            if level[queue[k]] > cut:
                order[end] = queue[k]
                end += 1
        order[end:b] = kept[:between]
        parts.append((a, a + below))
        parts.append((a + below, end))
    return order


def analyse(matrix: csr_array, order: np.ndarray | None = None) -> Tree:
    """Supernodes of the factors of a symmetric matrix, for the `order` of its unknowns where one is
    given.
    """
    _check(matrix, order)
    nodes, node = graph(matrix)
    if order is not None:
        return _supernodes(
            nodes, node, node[order][np.sort(np.unique(node[order], return_index=True)[1])]
        )
    found = _supernodes(nodes, node, minimum_degree(nodes))
    if nodes.shape[0] < DISSECTED:
        return found
    sequence = nested_dissection(nodes.indptr.astype(np.int64), nodes.indices.astype(np.int64))
    return min(found, _supernodes(nodes, node, sequence), key=products)


def of_pattern(matrix: csr_array) -> Tree:
    """As `analyse`; that of the last patterns is known: tangents of one system have one.

    The rows of the matrix are in order.
    """
    digest = hashlib.blake2b(matrix.indptr.tobytes(), digest_size=16)
    digest.update(matrix.indices.tobytes())
    key = digest.digest()
    if key not in TREES:
        while len(TREES) >= KEPT:
            TREES.pop(next(iter(TREES)))
        TREES[key] = analyse(matrix)
    return TREES[key]


def _supernodes(nodes: csr_array, node: np.ndarray, sequence: np.ndarray) -> Tree:
    """Supernodes of a compressed graph, its nodes in a sequence; `node` (n,) is that of every
    unknown.
    """
    weights = np.bincount(node)
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
        rows=(np.arange(total[-1]) + np.repeat(offset[rows] - total[:-1], np.diff(total))).astype(
            np.int32
        ),
        children=children,
    )


def _check(matrix: csr_array, order: np.ndarray | None) -> None:
    """Refuse what the analysis would misread."""
    n = matrix.shape[0]
    if matrix.format != "csr" or matrix.shape != (n, n) or n == 0 or matrix.dtype != np.float64:
        got = f"{matrix.format} {matrix.shape} of {matrix.dtype}"
        raise InputError(
            say(
                "direct",
                "a square csr_array of float64",
                got,
                "convert it with csr_array(matrix, dtype=float)",
            )
        )
    if not matrix.has_canonical_format:
        raise InputError(
            say(
                "direct",
                "rows with ascending columns",
                "unsorted or repeated ones",
                "call sum_duplicates()",
            )
        )
    stored = np.bincount(
        matrix.indices[matrix.indices == np.repeat(np.arange(n), np.diff(matrix.indptr))],
        minlength=n,
    )
    if not stored.all():
        raise InputError(
            say(
                "direct", "a stored diagonal", f"none in row {stored.argmin()}", "store zeros there"
            )
        )
    if order is not None and not np.array_equal(np.sort(order), np.arange(n)):
        raise InputError(
            say(
                "direct: order",
                f"a permutation of 0..{n - 1}",
                f"an array of shape {np.shape(order)}",
            )
        )


def height(tree: Tree) -> int:
    """Rows of the largest supernode."""
    return int((np.diff(tree.first) + np.diff(tree.start)).max(initial=0))


def entries(tree: Tree) -> int:
    """Numbers that are kept of L below its diagonal, with the zeros of joined supernodes."""
    w, r = np.diff(tree.first), np.diff(tree.start)
    return int((w * (w - 1) // 2 + w * r).sum())


def products(tree: Tree) -> float:
    """Products of numbers in a factorisation, about."""
    w, r = np.diff(tree.first).astype(float), np.diff(tree.start)
    return float((w * (w + r) ** 2).sum())
