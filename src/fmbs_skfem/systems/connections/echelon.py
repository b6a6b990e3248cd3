r"""Linear constraints solved for some of their unknowns: A x + a = 0 becomes x_d = S x_rest + s.

Rows that share no unknown are solved apart: an edge of a plate has as many small systems as it has
nodes. Each one is eliminated by Gauss and Jordan with full pivoting, which finds the same pivots as
the elimination of all rows together would. Entries count as zero relative to r_i c_j, the largest
entries of their row and, of rows divided by r_i, of their column: slopes of cells of a nanometre
and positions in kilometres have equal rights. What is ROUND_OFF of its row in units of the
unknowns, changes u_j that count alike, is zero before: a column of nothing else would make a
constraint of it.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import connected_components

from ...core.algebra import ranks
from ...core.algebra.linalg import distinct, entries, others, stacked
from ...core.storage.records import dataclass

# without it 1e-17 became a constraint: a simply supported plate of 8 x 8 cells vibrated 2 % too
# fast and buckled 3.5 % too late
ROUND_OFF = 1e-14  #: of the largest |a_ij| u_j of a row: shape functions at a place that is a node to the last digit


DENSE = 100  #: rows of a block up to which it is solved as a whole


@dataclass(frozen=True)
class Echelon:
    """The solution of A x + a = 0 for some unknowns.

        x[dependent] = solution @ x + fixed

    `solution` has no entries in the columns of dependent unknowns.
    """

    dependent: np.ndarray  #: (i,) unknowns
    solution: csr_array  #: (i, n)
    fixed: np.ndarray  #: (i,)
    left: np.ndarray  #: (k,) rows that are combinations of the others
    gap: np.ndarray  #: (k,) what those rows miss: zero, or they contradict the others


def solve(
    A: csr_array, a: np.ndarray, tolerance: float = ranks.EXACT, units: np.ndarray | None = None
) -> Echelon:
    """Echelon form of linear equations with A (m, n) and a (m,), see the module; unknowns x (n,).

        A x + a = 0

    Pivots are larger than `tolerance` times r_i c_j, entries of S than ROUND_OFF times c_j / c_i, r
    and c the largest entries of rows and columns: a weight of 6e-10 left out moves one end of a
    plate of 1 m by as much, 0.07 N at rest. `units` (n,) are changes of the unknowns that count
    alike, 1 without them. Rows without a pivot are `left`; nothing is raised where they contradict
    the others: their `gap` says it.
    """
    u = np.ones(A.shape[1]) if units is None else units
    # before anything is compared: round-off would join blocks that have nothing in common
    A = without_round_off(A, u)
    # blocks of a few rows, as dense as they like, in place of one of thousands
    labels = labels_of(A)
    alone = (np.bincount(labels)[labels] == 1) & (np.diff(A.indptr) == 1)
    order = np.flatnonzero(~alone)
    order = order[np.argsort(labels[order], kind="stable")]
    blocks = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1) if len(order) else []
    parts = [
        solve_alone(A, a, np.flatnonzero(alone)),
        *(solve_block(A, a, rows, tolerance, u) for rows in blocks),
    ]
    return Echelon(
        np.concatenate([part.dependent for part in parts]),
        stacked([part.solution for part in parts]),
        np.concatenate([part.fixed for part in parts]),
        np.concatenate([part.left for part in parts]),
        np.concatenate([part.gap for part in parts]),
    )


def inverse(A: csr_array, kept: np.ndarray) -> csr_array:
    """The pseudo-inverse C (n, m) of A (m, n), whose rank is the number of rows `kept` (i,) that
    `solve` found independent.

        A^T p = r,    p = C^T r of least norm

    Rows that share no unknown are inverted apart. The rank is not decided here anew: singular
    values of rows that follow from others are round-off, and their inverses would carry all forces.
    """
    labels = labels_of(A)
    independent = np.zeros(A.shape[0], dtype=bool)
    independent[kept] = True
    order = np.argsort(labels, kind="stable")
    blocks = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1) if len(order) else []
    parts = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for rows in blocks:
        used, block = dense(A, rows)
        U, s, V = np.linalg.svd(block, full_matrices=False)
        rank = int(independent[rows].sum())
        found = (V[:rank].T / s[:rank]) @ U[:, :rank].T
        parts.append((np.repeat(used, len(rows)), np.tile(rows, len(used)), found.ravel()))
    row, column, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return csr_array((values, (row, column)), shape=A.shape[::-1])


def labels_of(A: csr_array) -> np.ndarray:
    """Numbers (m,) of the parts of A (m, n) whose rows share no column with other parts, in the
    order of their first rows.
    """
    m, n = A.shape
    # rows and columns are the points of a graph, entries its lines
    indptr = np.append(A.indptr, np.full(n, A.indptr[-1]))
    links = csr_array((np.ones(len(A.indices)), A.indices + m, indptr), shape=(m + n, m + n))
    return np.asarray(connected_components(links, directed=False)[1][:m])


def solve_alone(A: csr_array, a: np.ndarray, rows: np.ndarray) -> Echelon:
    """Rows (i,) of A (m, n) that fix one unknown each, which no other row reads: edges that are
    held, thousands of them.
    """
    # edges that are held: no elimination for thousands of rows of one entry
    at = A.indptr[rows]
    entry = A.data[at]
    unknown = A.indices[at].astype(np.int64)
    good = entry != 0.0
    left = rows[~good]
    solution = csr_array((int(good.sum()), A.shape[1]))
    return Echelon(unknown[good], solution, -a[rows[good]] / entry[good], left, -a[left])


def without_round_off(A: csr_array, units: np.ndarray) -> csr_array:
    """A (m, n) without what is ROUND_OFF of its row in `units` (n,)."""
    row, column, values, size, largest = in_units(A, units)
    kept = size > ROUND_OFF * largest
    found = by_rows(row[kept], column[kept], values[kept], A.shape)
    found.sum_duplicates()
    return found


def in_units(A: csr_array, units: np.ndarray) -> tuple[np.ndarray, ...]:
    """Rows, columns, values and sizes |a_ij| u_j of the entries (z,) of A (m, n), and the largest size
    of the row of each (z,).
    """
    row, column, values = entries(A)
    size = np.abs(values) * units[column]
    largest = np.zeros(A.shape[0])
    np.maximum.at(largest, row, size)
    return row, column, values, size, largest[row]


def by_rows(
    row: np.ndarray, column: np.ndarray, values: np.ndarray, shape: tuple[int, int]
) -> csr_array:
    """Entries (z,) that stand row by row as a sparse array."""
    return csr_array(
        (values, column, np.append(0, np.cumsum(np.bincount(row, minlength=shape[0])))), shape=shape
    )


def solve_block(
    A: csr_array, a: np.ndarray, rows: np.ndarray, tolerance: float, units: np.ndarray
) -> Echelon:
    """Echelon form of some rows (i,) of A (m, n) that share no unknown with the others; arguments
    as of `solve`.
    """
    if len(rows) > DENSE and len(own := own_unknowns(A, rows, units)):
        return solve_sparse(A, a, rows, own, tolerance, units)
    used, work = dense(A, rows)
    columns = sizes(work)[1]
    pivots, left, right = eliminated(work, -a[rows], tolerance, units[used])
    first, mine = np.array(pivots, dtype=np.int64).reshape(-1, 2).T
    rest = others(len(used), mine)
    S = -work[np.ix_(first, rest)]
    S[np.abs(S) * columns[mine, None] <= ROUND_OFF * columns[rest]] = 0.0
    i, j = np.nonzero(S)
    solution = by_rows(i, used[rest[j]], S[i, j], (len(mine), A.shape[1]))
    return Echelon(used[mine], solution, right[first], rows[left], right[left])


def own_unknowns(A: csr_array, rows: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of a row among those (i,) of A (m, n) and an unknown that no other row reads,
    among the largest of its row in `units` (n,).
    """
    row, column, _, size, largest = in_units(csr_array(A[rows]), units)
    alone = np.bincount(column, minlength=A.shape[1])[column] == 1
    good = np.flatnonzero(alone & (size >= 0.5 * largest))
    first = good[np.unique(row[good], return_index=True)[1]]
    return np.column_stack([rows[row[first]], column[first]])


def solve_sparse(
    A: csr_array,
    a: np.ndarray,
    rows: np.ndarray,
    own: np.ndarray,
    tolerance: float,
    units: np.ndarray,
) -> Echelon:
    """As `solve_block`, of rows some of which have an unknown of their `own` (k, 2), pairs of a row
    and an unknown: these are solved for it, into which the solution of the others is put.
    """
    first, mine = own.T
    scale = -1.0 / np.asarray(A[first, mine])
    whole = csr_array(diags_array(scale) @ A[first])
    row, column, values = entries(whole)
    kept = column != mine[row]
    whole = by_rows(row[kept], column[kept], values[kept], whole.shape)
    fixed = scale * a[first]
    rest = np.setdiff1d(rows, first)
    found = solve(csr_array(A[rest]), a[rest], tolerance, units)
    inside = csr_array(whole[:, found.dependent])
    away = np.ones(A.shape[1])
    away[found.dependent] = 0.0
    whole = csr_array(whole @ diags_array(away) + inside @ found.solution)
    return Echelon(
        np.concatenate([mine, found.dependent]),
        stacked([whole, found.solution]),
        np.concatenate([fixed + inside @ found.fixed, found.fixed]),
        rest[found.left],
        found.gap,
    )


def dense(A: csr_array, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The columns (j,) that some rows (i,) of A (m, n) use, and the block (i, j) of those rows and
    columns.
    """
    spans = [slice(A.indptr[row], A.indptr[row + 1]) for row in rows]
    used = distinct(np.concatenate([A.indices[span] for span in spans]))
    block = np.zeros((len(rows), len(used)))
    for k, span in enumerate(spans):
        np.add.at(block[k], np.searchsorted(used, A.indices[span]), A.data[span])
    return used, block


def sizes(work: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r (m,), the largest entry of every row, and c (n,), of every column of the rows divided by
    them; 1 for zeros.
    """
    rows = np.abs(work).max(axis=1, initial=0.0)
    rows[rows == 0.0] = 1.0
    columns = np.abs(work / rows[:, None]).max(axis=0, initial=0.0)
    columns[columns == 0.0] = 1.0
    return rows, columns


def eliminated(
    work: np.ndarray, right: np.ndarray, tolerance: float, units: np.ndarray
) -> tuple[list[tuple[int, int]], list[int], np.ndarray]:
    """Gauss and Jordan's elimination with full pivoting, in place, of a dense block `work` (m, n)
    and `right` (m,).

    It gives pivots (row, column), rows without one, and the right-hand side; `units` (n,) and
    `tolerance` as in `solve`.
    """
    pivots: list[tuple[int, int]] = []
    round_off = ROUND_OFF * np.outer((np.abs(work) * units).max(axis=1, initial=0.0), 1.0 / units)
    left = [*range(len(work))]
    weights = np.maximum(np.outer(*sizes(work)), round_off / tolerance)
    while left and work.size:
        entries = np.abs(work[left])
        shape = (len(left), work.shape[1])
        i, j = np.unravel_index(np.argmax(entries), shape)
        if entries[i, j] <= tolerance * weights[left[i], j]:
            i, j = np.unravel_index(np.argmax(entries / weights[left]), shape)
        row = left[i]
        if entries[i, j] <= tolerance * weights[row, j]:
            break
        left.remove(row)
        pivots.append((row, int(j)))
        right[row] /= work[row, j]
        work[row] /= work[row, j]
        hit = np.flatnonzero(work[:, j])
        hit = hit[hit != row]
        right[hit] -= work[hit, j] * right[row]
        work[hit] -= np.outer(work[hit, j], work[row])
    return pivots, left, right
