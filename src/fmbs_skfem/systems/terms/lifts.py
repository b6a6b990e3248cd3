r"""Coordinates p of the cells from the unknowns, as a term around the terms that read them.

    p = V x + d,    u = B p,    f = V^T B^T phi(u),    W += V^T K V,    K = sum_e B_e^T phi' B_e

Of full systems V is sparse, and cells put their tangents into W at once. Of reduced ones it is
dense, and both factors of the gather are kept: B V has a row for every gradient at every point, V
one for every coordinate, several times fewer, of plates some twenty times. The lower triangle of K
is sparse then; with half of its diagonal it is A, K = A + A^T, and V^T K V = Z + Z^T with Z = V^T
(A V).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core.algebra.linalg import support
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import IntegerMatrix, Integers, Routine, Vector, opener, routine
from ..evaluation import LiftTerm, evaluation
from ..kernels import Csr, add_combination, add_product, add_sums, add_transposed, affine, clear
from .elastic import Piece
from .sparse import Pattern


class LiftRoutines(NamedTuple):
    """What a lift does around the terms of cells."""

    place: Routine  #: coordinates of the cells and, where a term reads them, their rates; no forces yet
    scatter: Routine  #: f += V^T of the forces on these coordinates
    tangent: Routine  #: W += V^T K V, where cells have not put K into W
    force_products: tuple[Routine, ...] = ()  #: as in `terms.TermRoutines`
    tangent_products: tuple[Routine, ...] = ()


class SparseLift(NamedTuple):
    """V of a full system, in the order of the band."""

    matrix: Csr
    offset: Vector


class DenseLift(NamedTuple):
    """V of a reduced system in blocks, one a body, and the pattern of K."""

    blocks: IntegerMatrix  #: (b, 5) first coordinate and their number, first unknown and their number, place in the numbers
    rows: Vector  #: (p, r) of all blocks
    transposed: Vector  #: (r, p) of all blocks
    offset: Vector  #: d (p,)
    indptr: Integers  #: of the lower triangle of K, columns in order
    indices: Integers


sparse_lift = opener(SparseLift)
dense_lift = opener(DenseLift)


@routine
def place_sparse(table: Any, record: Any) -> int:
    """Coordinates of the cells and their rates.

        p = V x + d,    p' = V v

    with a sparse V.
    """
    E = evaluation(table)
    L = sparse_lift(record)
    s = E.space
    # sparse V: most rows have one entry, frames of rims three
    affine(L.matrix, L.offset, s.x, s.cell_x)
    # here, as cells only add: terms come in any order
    clear(s.cell_f)
    # a second product for rates, where a term reads them
    if E.arrays.elastic.damped:
        clear(s.cell_v)
        add_product(L.matrix, 1.0, s.v, s.cell_v)
    return 0


@routine
def scatter_sparse(table: Any, record: Any) -> int:
    """f += V^T times the forces on p."""
    s = evaluation(table).space
    # all cells of all bodies in one product
    add_transposed(sparse_lift(record).matrix, 1.0, s.cell_f, s.f)
    return 0


@routine
def no_tangent(table: Any, record: Any) -> int:
    """Cells have put it where it belongs."""
    # full systems have no second matrix to multiply: targets of cells are places in W
    return 0


@routine
def place_dense(table: Any, record: Any) -> int:
    """Coordinates of the cells and their rates.

        p = V x + d,    p' = V v

    with a dense V, in blocks.
    """
    E = evaluation(table)
    L = dense_lift(record)
    s = E.space
    # V has one row a coordinate where B V has one for every gradient at every point, of plates
    # twenty times as many
    combine(L, 1.0, s.x, s.cell_x)
    clear(s.cell_f)
    if E.arrays.elastic.damped:
        combine(L, 0.0, s.v, s.cell_v)
    return 0


@jit
def combine(L: Any, fixed: float, x: np.ndarray, p: np.ndarray) -> None:
    """Coordinates of the cells by a dense V.

        p = V x + fixed d

    `fixed` is 1 for positions, 0 for rates.
    """
    for i in range(len(p)):
        p[i] = fixed * L.offset[i]
    # a block a body: V is zero where a mode moves others, and is not multiplied there
    for k in range(len(L.blocks)):
        first, count, start, modes, at = L.blocks[k]
        add_combination(
            view(L.transposed, at, (modes, count)),
            view(x, start, (modes,)),
            view(p, first, (count,)),
        )


@routine
def scatter_dense(table: Any, record: Any) -> int:
    """f += V^T times the forces on p."""
    s = evaluation(table).space
    L = dense_lift(record)
    for k in range(len(L.blocks)):
        first, count, start, modes, at = L.blocks[k]
        # the same numbers as `place_dense` reads, in the order in which it does
        add_sums(
            view(L.transposed, at, (modes, count)),
            view(s.cell_f, first, (count,)),
            view(s.f, start, (modes,)),
        )
    return 0


@routine
def tangent_dense(table: Any, record: Any) -> int:
    """Add the tangent of the cells in reduced unknowns, from the entries of K, which are zero
    afterwards.

        W += V^T K V
    """
    s = evaluation(table).space
    L = dense_lift(record)
    for i in range(len(L.indptr) - 1):
        if L.indptr[i + 1] > L.indptr[i]:
            # half of the diagonal, so that K = A + A^T and one product with A serves both halves
            s.entries[L.indptr[i + 1] - 1] *= 0.5
    for k in range(len(L.blocks)):
        first, count, start, modes, at = L.blocks[k]
        AV = view(s.work[2], 0, (count, modes))
        for i in range(count):
            # A sparse, V dense: K is never made dense, of which most would be zeros
            multiply_row(L, s.entries, first + i, first, view(L.rows, at, (count, modes)), AV[i])
        Z = np.dot(view(L.transposed, at, (modes, count)), AV)
        for i in range(modes):
            for j in range(modes):
                # symmetric to the last digit
                s.W[start + i, start + j] += Z[i, j] + Z[j, i]
    # cells add to entries: the next assembly begins with none
    clear(s.entries)
    return 0


@jit
def multiply_row(
    L: Any, entries: np.ndarray, i: int, first: int, V: np.ndarray, target: np.ndarray
) -> None:
    """target (r,) = row i of A V; four rows of V at a time."""
    clear(target)
    start, stop = L.indptr[i], L.indptr[i + 1]
    # the target is read and written once for four rows
    full = start + (stop - start) // 4 * 4
    for k in range(start, full, 4):
        a, b, c, d = entries[k], entries[k + 1], entries[k + 2], entries[k + 3]
        row_a, row_b = V[L.indices[k] - first], V[L.indices[k + 1] - first]
        row_c, row_d = V[L.indices[k + 2] - first], V[L.indices[k + 3] - first]
        for r in range(len(target)):
            target[r] += a * row_a[r] + b * row_b[r] + c * row_c[r] + d * row_d[r]
    for k in range(full, stop):
        a = entries[k]
        row_a = V[L.indices[k] - first]
        for r in range(len(target)):
            target[r] += a * row_a[r]


SPARSE = LiftRoutines(place_sparse, scatter_sparse, no_tangent)
DENSE = LiftRoutines(
    place_dense, scatter_dense, tangent_dense, (place_dense, scatter_dense), (tangent_dense,)
)


def piece(
    V: Csr | np.ndarray, offset: np.ndarray, locals_: Sequence[np.ndarray], pattern: Pattern | None
) -> Piece | None:
    """The lift V (p, n) of a system with its offset d (p,); None where nothing reads p.

        p = V x + d

    A sparse V is given as `Csr`, a dense one as an array, which is kept in blocks of the
    coordinates that cells read. `locals_` are the coordinates (l, e) of the cells of each storage,
    `pattern` is that of K for a dense lift.
    """
    if not len(offset):
        return None
    if isinstance(V, Csr):
        return Piece(SparseLift(V, offset), SPARSE)
    assert pattern is not None
    table = list[tuple[int, ...]]()
    rows = list[np.ndarray]()
    turned = list[np.ndarray]()
    at = 0
    for first, last in spans(locals_):
        # modes of this body alone
        columns = support(V[first:last])
        block = V[first:last, columns]
        table.append((first, last - first, columns.start, block.shape[1], at))
        rows.append(block.ravel())
        turned.append(block.T.ravel())
        at += block.size
    blocks = np.array(table, dtype=np.int64)
    return Piece(
        DenseLift(
            blocks,
            np.concatenate(rows),
            np.concatenate(turned),
            offset,
            pattern.indptr,
            pattern.indices,
        ),
        DENSE,
    )


def spans(locals_: Sequence[np.ndarray]) -> list[tuple[int, int]]:
    """Ranges of coordinates that cells read, those that overlap as one."""
    found: list[tuple[int, int]] = []
    for first, last in sorted(
        (int(local.min()), int(local.max()) + 1) for local in locals_ if local.size
    ):
        # bodies that share coordinates, as patches with a common edge, are one block: K couples
        # them
        if found and first < found[-1][1]:
            first = found[-1][0]
            last = max(last, found.pop()[1])
        found.append((first, last))
    return found


def addressed(lift: Piece | None) -> LiftTerm:
    """A lift by address, zeros for none; the caller keeps it, as the addresses point to its memory."""
    if lift is None:
        return LiftTerm(0, 0, 0, 0)
    return LiftTerm(
        lift.routines.place.address,
        lift.routines.scatter.address,
        lift.routines.tangent.address,
        lift.address,
    )


def needs(lift: Piece | None) -> tuple[int, int | None, int]:
    """What a lift needs of a space: coordinates of the cells, entries of K where W does not hold
    them, numbers of a work vector.

    None in place of the entries where W holds them.
    """
    # W itself takes the tangents of cells where V is sparse
    if lift is None or isinstance(lift.record, SparseLift):
        return len(lift.record.offset) if lift else 0, None, 0
    L: DenseLift = lift.record
    return len(L.offset), len(L.indices), int((L.blocks[:, 1] * L.blocks[:, 3]).max())
