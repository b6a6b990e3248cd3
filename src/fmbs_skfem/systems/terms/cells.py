"""Cells of full bodies as terms: gather from the coordinates p of the cells, law at the points,
scatter.

    u = B p[nodes],    p = S (lift x),    f = lift^T S^T B^T phi(u),    W += lift^T S^T B^T phi' B S lift

p are the coordinates of the bodies, or their images S q where a body slaves functions to a frame.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...bodies import laws
from ...bodies.body import Cells
from ...core.algebra.linalg import distinct, is_sparse, support
from ...core.compiling.entries import view
from ...core.compiling.jit import inlined, jit
from ...core.compiling.structs import Cube, IntegerMatrix, Integers, Tensor, opener
from ..affine import Affine, Matrix
from ..kernels import clear, clear_rows
from . import elastic as terms
from .elastic import Lifts, Setting, Targets, Term
from .points import Sampled

if TYPE_CHECKING:
    from ..layouts import Layout

# cubic beams of 200 cells: points are taken up to 12 modes, where both cost alike (26 and 25 us a
# force); half and twice of it 6 and 24 modes, where the wrong one costs 10 us more
FEW = 2  #: modes per function of a cell below which gradients are multiplied out, the cost of tangents with it
# 1024 cubic cells in space, force and tangent in us: 160 and 780; 180 and 900 at half, 150 and 750
# at twice; 240 and 1250 with 16 cells, 174 and 864 all in one
BLOCK = 64  #: cells that a kernel handles at once, so that their gradients stay in the cache
# matrices of 4, 16, 32 and 64 beam cells of 12 components, in us: 73, 250, 490, 1760 one by one,
# 320, 600, 950, 1020 side by side; of cubic cables in space 4.4, 9.4 and 16.7 one by one for 8.2,
# 9.6 and 11 side by side with 4, 8 and 16
SHORT = 3  #: cells per component up to which matrices of beams are made one by one, with long loops over components


class CellsRecord(NamedTuple):
    """A block of cells for compiled code."""

    calls: Integers  #: addresses of the law's functions, see `laws.addresses`
    beta: float  #: stiffness-proportional damping time [s]
    nodes: IntegerMatrix  #: (b, e)
    table: Tensor  #: (k, p, b, e)
    section: Cube  #: (i, p, e)
    targets: Targets
    kept: int  #: first place in the gradients of a space, see `elastic.first_kept`


opened = opener(CellsRecord)


@jit
def gather_cells(
    nodes: np.ndarray, table: np.ndarray, q: np.ndarray, local: np.ndarray, u: np.ndarray
) -> None:
    """Gradients of cells from the coordinates that they read.

        u[(k, c), p, e] = sum_b table[k, p, b, e] q[nodes[b, e] + c]

    `local` is room.
    """
    derivatives, points, basis, cells = table.shape
    dim = u.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            # coordinates of the cells first, so that each is gathered once and not once for every
            # derivative and point
            for e in range(cells):
                local[b, c, e] = q[nodes[b, e] + c]
    for k in range(derivatives):
        for c in range(dim):
            for p in range(points):
                interpolate(table, local, k, p, c, u[k * dim + c, p])


# contained in its callers, as the others here: by calls blocks of 4 cells in space take 1.0 us for
# 0.6, of 16 beam cells 3.0 for 2.2
@inlined
def interpolate(
    table: np.ndarray, local: np.ndarray, k: int, p: int, c: int, target: np.ndarray
) -> None:
    """One derivative of one component at one point, of all cells.

    target[e] = sum_b table[k, p, b, e] local[b, c, e]
    """
    basis, cells = table.shape[2:]
    # four functions at once: cubics have four, so that u is written once and never read
    full = basis // 4 * 4
    # else the first four write u without reading it
    if full == 0:
        clear(target)
    for b in range(0, full, 4):
        N0, N1, N2, N3 = table[k, p, b], table[k, p, b + 1], table[k, p, b + 2], table[k, p, b + 3]
        q0, q1, q2, q3 = local[b, c], local[b + 1, c], local[b + 2, c], local[b + 3, c]
        if b == 0:
            for e in range(cells):
                target[e] = N0[e] * q0[e] + N1[e] * q1[e] + N2[e] * q2[e] + N3[e] * q3[e]
        else:
            for e in range(cells):
                target[e] += N0[e] * q0[e] + N1[e] * q1[e] + N2[e] * q2[e] + N3[e] * q3[e]
    for b in range(full, basis):
        N0 = table[k, p, b]
        q0 = local[b, c]
        for e in range(cells):
            target[e] += N0[e] * q0[e]


@jit
def scatter_cells(
    nodes: np.ndarray, table: np.ndarray, S: np.ndarray, local: np.ndarray, f: np.ndarray
) -> None:
    """Forces of stresses of cells on the coordinates that they read.

        f[nodes[b, e] + c] += sum_kp table[k, p, b, e] S[(k, c), p, e]

    `local` is room.
    """
    derivatives, _, basis, cells = table.shape
    dim = S.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            sum_stresses(table, S, b, c, local[b, c])
    # cells last and one by one: two of them write to one coordinate
    for e in range(cells):
        for b in range(basis):
            for c in range(dim):
                f[nodes[b, e] + c] += local[b, c, e]


@inlined
def sum_stresses(table: np.ndarray, S: np.ndarray, b: int, c: int, target: np.ndarray) -> None:
    """Forces on one component of one function, of all cells.

    target[e] = sum_kp table[k, p, b, e] S[(k, c), p, e]
    """
    derivatives, points, _, cells = table.shape
    dim = S.shape[0] // derivatives
    clear(target)
    for p in range(points):
        # lines have two derivatives: both at once halve what is read and written of f
        if derivatives == 2:
            N0 = table[0, p, b]
            N1 = table[1, p, b]
            S0 = S[c, p]
            S1 = S[dim + c, p]
            for e in range(cells):
                target[e] += N0[e] * S0[e] + N1[e] * S1[e]
        else:
            for k in range(derivatives):
                N0 = table[k, p, b]
                S0 = S[k * dim + c, p]
                for e in range(cells):
                    target[e] += N0[e] * S0[e]


@jit
def cell_matrices(table: np.ndarray, D: np.ndarray, work: np.ndarray) -> None:
    """Lower triangles of all cell matrices.

        work[l (l+1)/2 + m, e],    l = (b, c) >= m

    from the moduli D (k c, k c, p, e).
    """
    vectors, points, basis, cells = table.shape
    dim = len(D) // vectors
    size = basis * dim
    count = size * (size + 1) // 2
    if vectors == 2 and dim > 3 and cells <= SHORT * dim:
        single_matrices(table, D, work)
        return
    # cells are the last axis everywhere: a loop over them runs as vectors, in matrices of any size
    matrices, DB = view(work, 0, (count, cells)), view(work, count * cells, (vectors, cells))
    # sums over points: one matrix a cell, no matter how many points
    clear_rows(matrices)
    for p in range(points):
        for m in range(size):
            b = m // dim
            c = m % dim
            for ci in range(dim):
                # D B of one column, which all rows of it share
                modulus_times_basis(D, table, p, b, c, ci, DB)
                for bi in range(b, basis):
                    line = bi * dim + ci
                    # the lower triangle alone: tangents of elastic laws are symmetric
                    if line >= m:
                        target = matrices[line * (line + 1) // 2 + m]
                        N0 = table[0, p, bi]
                        N1 = table[1, p, bi]
                        first = DB[0]
                        second = DB[1]
                        for e in range(cells):
                            target[e] += N0[e] * first[e] + N1[e] * second[e]
                        for k in range(2, vectors):
                            N0 = table[k, p, bi]
                            first = DB[k]
                            for e in range(cells):
                                target[e] += N0[e] * first[e]


@jit
def single_matrices(table: np.ndarray, D: np.ndarray, work: np.ndarray) -> None:
    """The same of lines, cell by cell, with all components at once."""
    _, points, basis, cells = table.shape
    dim = len(D) // 2
    block = dim * dim
    pairs = basis * (basis + 1) // 2
    count = basis * dim * (basis * dim + 1) // 2
    matrices, moduli = view(work, 0, (count, cells)), view(work, count * cells, (4, block))
    blocks = view(work, count * cells + 4 * block, (pairs, block))
    for e in range(cells):
        clear_rows(blocks)
        for p in range(points):
            copy_moduli(D, p, e, moduli)
            add_to_blocks(table, moduli, p, e, blocks)
        copy_lower_triangle(blocks, basis, dim, e, matrices)


@inlined
def copy_moduli(D: np.ndarray, p: int, e: int, moduli: np.ndarray) -> None:
    """Moduli of one point of a line.

    moduli[(k, l), (i, j)] = D[(k, i), (l, j), p, e]
    """
    dim = len(D) // 2
    for k in range(4):
        for i in range(dim):
            for j in range(dim):
                moduli[k, i * dim + j] = D[k // 2 * dim + i, k % 2 * dim + j, p, e]


@inlined
def add_to_blocks(
    table: np.ndarray, moduli: np.ndarray, p: int, e: int, blocks: np.ndarray
) -> None:
    """What one point of a line adds to the blocks of pairs of functions b >= c.

    blocks[(b, c), (i, j)] += sum_kl table[k, p, b, e] table[l, p, c, e] moduli[(k, l), (i, j)]
    """
    first = moduli[0]
    second = moduli[1]
    third = moduli[2]
    fourth = moduli[3]
    pair = 0
    for b in range(table.shape[2]):
        for c in range(b + 1):
            target = blocks[pair]
            N = table[:, p, b, e]
            M = table[:, p, c, e]
            f, g, h, s = N[0] * M[0], N[0] * M[1], N[1] * M[0], N[1] * M[1]
            for i in range(target.size):
                target[i] += f * first[i] + g * second[i] + h * third[i] + s * fourth[i]
            pair += 1


@jit
def copy_lower_triangle(
    blocks: np.ndarray, basis: int, dim: int, e: int, matrices: np.ndarray
) -> None:
    """The lower triangle of the matrix of a cell, as of `cell_matrices`, from its blocks of pairs
    of functions b >= c.
    """
    pair = 0
    for b in range(basis):
        for c in range(b + 1):
            for i in range(dim):
                line = b * dim + i
                at = line * (line + 1) // 2 + c * dim
                for j in range(dim if c < b else i + 1):
                    matrices[at + j, e] = blocks[pair, i * dim + j]
            pair += 1


@jit
def modulus_times_basis(
    D: np.ndarray, table: np.ndarray, p: int, b: int, c: int, ci: int, DB: np.ndarray
) -> None:
    """Products of moduli with functions.

        DB[k, e] = sum_l D[(k, ci), (l, c), p, e] table[l, p, b, e]

    Two terms at once: every law reads at least two vectors.
    """
    vectors = len(DB)
    dim = len(D) // len(DB)
    cells = DB.shape[1]
    for k in range(vectors):
        target = DB[k]
        row = k * dim + ci
        first = D[row, c, p]
        second = D[row, dim + c, p]
        N0 = table[0, p, b]
        N1 = table[1, p, b]
        for e in range(cells):
            # the first two write DB, so that it is not cleared
            target[e] = first[e] * N0[e] + second[e] * N1[e]
        for l in range(2, vectors):
            first = D[row, l * dim + c, p]
            N0 = table[l, p, b]
            for e in range(cells):
                target[e] += first[e] * N0[e]


@jit
def place(C: Any, target: np.ndarray, at: int) -> np.ndarray:
    """An array (k c, p, e) from the place `at` of `target` on, for the gradients of a block of
    cells.
    """
    # views of one room: no array is made in a step
    vectors, points, _, cells = C.table.shape
    return view(target, at, (vectors * laws.components(C.calls), points, cells))


@jit
def read(s: Any, C: Any, order: int, target: np.ndarray, at: int) -> np.ndarray:
    """Gradients (k c, p, e) from the coordinates of the cells, or their rates."""
    u = place(C, target, at)
    (_, _, basis, cells) = C.table.shape
    # behind the gradients, in the same room
    local = view(s.work[0], u.size, (basis, laws.components(C.calls), cells))
    gather_cells(C.nodes, C.table, s.cell_x if order == 0 else s.cell_v, local, u)
    return u


@jit
def scatter(s: Any, C: Any, S: np.ndarray) -> None:
    """Add forces on the coordinates of the cells.

        f += B^T S

    of stresses S (k c, p, e).
    """
    # gradients are not needed any more: their room takes the forces of the cells
    basis, cells = C.nodes.shape
    scatter_cells(
        C.nodes, C.table, S, view(s.work[0], 0, (basis, laws.components(C.calls), cells)), s.cell_f
    )


@jit
def add_tangent(s: Any, C: Any, D: np.ndarray) -> None:
    """Add the matrices of the cells in the places of `targets`.

        W += B^T D B

    of moduli D (k c, k c, p, e).
    """
    # matrices of a block before any goes into W: loops over cells stay vectors, only the last one
    # jumps in memory
    cell_matrices(C.table, D, s.work[2])
    put(C.targets, s.work[2], s.entries)


@jit
def put(T: Targets, entries: np.ndarray, W: np.ndarray) -> None:
    """W += the entries (l (l + 1) / 2, e) of the lower triangles of cell matrices, each in its
    place.
    """
    # where every coordinate is an unknown, a place an entry is all: no source, no factor, in the
    # order of the entries
    if len(T.source) == 0:
        for k in range(len(T.target)):
            if T.target[k] >= 0:
                W[T.target[k]] += entries[k]
    else:
        for k in range(len(T.source)):
            W[T.target[k]] += T.factor[k] * entries[T.source[k]]


ROUTINES = terms.at_points(__name__, opened, place, read, scatter, add_tangent)


@terms.carry.register(Cells)
def carry(cells: Cells, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Cells | Sampled:
    """Cells stay in body coordinates; where few modes move them, multiplied out they cost less.

    A force costs r g numbers multiplied out to g gradients, and r p + b g by way of p coordinates
    and b functions a cell.
    """
    # full bodies: coordinates are unknowns
    if is_sparse(lift.matrix):
        return cells
    vectors, points, functions, count = cells.shape
    # a frame that functions are slaved to stands for all of them
    used = (
        distinct(cells.nodes)
        if cells.spread is None
        else distinct(csr_array(cells.spread[distinct(cells.nodes)]).indices)
    )
    modes = support(lift.matrix[used])
    gradients = vectors * cells.dim * points * count
    # of cubic beams with 200 cells a force by points takes 11 us for 23 us by cells with 4 modes,
    # the same with 12 to 16, 62 for 43 us with 40
    few = (modes.stop - modes.start) * (
        gradients - cells.dim * len(used)
    ) < FEW * functions * gradients
    return multiply_out(cells, lift) if few else cells


@terms.multiply_out.register(Cells)
def multiply_out(cells: Cells, lift: Affine) -> Cells | Sampled:
    """Points with rows (derivative, component, point) by modes, of a reduced body; a full one keeps
    its cells.
    """
    if is_sparse(lift.matrix):
        return cells
    rows = gradient_rows(cells, len(lift.offset))
    gradients = np.asarray(rows @ lift.matrix)
    # modes of other bodies are zero here, and are no columns
    columns = support(gradients)
    section = cells.section.reshape(len(cells.section), 1, -1)
    return Sampled(
        cells.law,
        np.ascontiguousarray(gradients[:, columns]),
        rows @ lift.offset,
        section,
        columns,
        cells_of_points(cells),
    )


@terms.split.register(Cells)
def split(cells: Cells, lifts: Lifts) -> list[Cells]:
    """Blocks of about BLOCK cells, all in one where they are few."""
    start = lifts.place(cells.spread)
    count = cells.nodes.shape[1]
    # short bodies in one: a call of a block costs as much as some cells
    parts = max(1, round(count / BLOCK)) if count > 4 * BLOCK else 1
    return [
        replace(
            cells,
            table=cells.table[..., k],
            nodes=cells.nodes[:, k] + start,
            section=cells.section[..., k],
            spread=None,
        )
        for k in np.array_split(np.arange(count), parts)
    ]


@terms.couplings.register(Cells)
def couplings(cells: Cells) -> np.ndarray:
    """Coordinates of every cell, (b c, e)."""
    return (cells.nodes[:, None, :] + np.arange(cells.dim)[None, :, None]).reshape(
        -1, cells.nodes.shape[1]
    )


@terms.compile_term.register(Cells)
def compile_term(cells: Cells, setting: Setting) -> Term:
    """Its numbers behind each other, and the places of its matrices."""
    (basis, count) = cells.nodes.shape
    dim = cells.dim
    vectors = cells.law.orders
    # the largest of what modulus, scatter and matrices need, one after the other
    size = basis * dim
    gradients = vectors * dim
    points = cells.section.shape[1]
    matrices = size * (size + 1) // 2 * count + max(
        vectors * count, (4 + basis * (basis + 1) // 2) * dim**2
    )
    work = max(gradients**2 * points * count, gradients * points * count + size * count, matrices)
    calls = laws.addresses(cells.law, dim, setting.beta > 0.0)
    nodes, table, section = (
        np.ascontiguousarray(part) for part in (cells.nodes, cells.table, cells.section)
    )
    targets = setting.targets(couplings(cells))
    first = terms.first_kept(cells.law, setting)
    record = CellsRecord(calls, setting.beta, nodes, table, section, targets, first)
    kept = terms.count_kept(cells.law, gradients * points * count, setting)
    return Term(record, ROUTINES, work, setting.beta > 0.0, kept)


@terms.position_gradients.register(Cells)
def position_gradients(cells: Cells, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of all cells, (k c, p, e)."""
    return np.asarray(gradient_rows(cells, len(q)) @ q).reshape(-1, *cells.section.shape[1:])


@terms.rotation_weights.register(Cells)
def rotation_weights(cells: Cells, q: np.ndarray) -> np.ndarray:
    """By tables of cells."""
    dim = cells.dim
    p = q if cells.spread is None else cells.spread @ q
    nodes = cells.nodes // dim
    G = np.zeros((len(p) // dim, dim))
    for N in cells.table[: cells.law.tangents]:
        tangent = np.einsum("pbe,bec->cpe", N, p.reshape(-1, dim)[nodes])
        np.add.at(
            G, nodes, np.einsum("pbe,pe,cpe->bec", N, cells.section[-1], tangent, optimize=True)
        )
    return G if cells.spread is None else np.asarray(csr_array(cells.spread)[::dim, ::dim].T @ G)


@terms.functions_read.register(Cells)
def functions_read(cells: Cells, size: int) -> csr_array:
    """The functions of every cell, or those that they are slaved to."""
    spread = cells.spread
    fields = cells.law.fields
    dim = cells.dim // fields
    functions = (cells.nodes.T[:, :, None] // dim + np.arange(fields)).reshape(
        cells.nodes.shape[1], -1
    )
    indptr = np.arange(len(functions) + 1) * functions.shape[1]
    width = size if spread is None else spread.shape[0] // dim
    reads = csr_array(
        (np.ones(functions.size, np.float32), functions.ravel(), indptr),
        shape=(len(functions), width),
    )
    return (
        reads
        if spread is None
        else csr_array(reads @ abs(csr_array(spread)[::dim, ::dim].astype(np.float32)))
    )


@terms.cells_of_points.register(Cells)
def cells_of_points(cells: Cells) -> np.ndarray:
    """Of all points."""
    return np.tile(np.arange(cells.section.shape[2]), cells.section.shape[1])


@terms.numbers_read.register(Cells)
def numbers_read(cells: Cells) -> float:
    """Of all cells."""
    return float(math.prod(cells.shape) * cells.dim**2)


def gradient_rows(cells: Cells, size: int) -> csr_array:
    """Gather of cells as a sparse array, in the order (k, c, p, e).

        u = rows @ q

    rows (k c p e, q), q (size,).
    """
    K, P, B, E = cells.table.shape
    dim = cells.dim
    # written as rows, without a loop over cells
    values = np.broadcast_to(cells.table[:, None, :, :, :], (K, dim, P, B, E)).transpose(
        0, 1, 2, 4, 3
    )
    columns = np.broadcast_to(
        cells.nodes.T[None, None, None] + np.arange(dim)[None, :, None, None, None],
        (K, dim, P, E, B),
    )
    indptr = np.arange(K * dim * P * E + 1) * B
    width = size if cells.spread is None else cells.spread.shape[0]
    rows = csr_array((values.ravel(), columns.ravel(), indptr), shape=(K * dim * P * E, width))
    return rows if cells.spread is None else csr_array(rows @ cells.spread)


def targets(local: np.ndarray, T: csr_array, layout: Layout) -> Targets:
    """Where entries of the lower triangles of cells go in the flat storage of a matrix.

        W += T^T K_e T,    p = T x

    `local` (l, e) are the coordinates p that cells read, T (p, n) is sparse, `layout` says how W
    (n, n) is stored.
    """
    (size, count) = local.shape
    place = layout.place
    dense = layout.dense
    # unknowns that a coordinate is slaved to: 1 of free ones, 3 of those on the rim of a frame
    deep = int(np.diff(T.indptr).max(initial=1))
    target = np.full((T.shape[0], deep), -1)
    factor = np.zeros((T.shape[0], deep))
    for k in range(deep):
        has = np.diff(T.indptr) > k
        target[has, k], factor[has, k] = (
            place[T.indices[T.indptr[:-1][has] + k]],
            T.data[T.indptr[:-1][has] + k],
        )
    low, column = np.tril_indices(size)
    sources, targets, factors = [], [], []
    for k in range(deep):
        for m in range(deep):
            i, j = target[local[low], k], target[local[column], m]
            value = factor[local[low], k] * factor[local[column], m]
            source = (low * (low + 1) // 2 + column)[:, None] * count + np.arange(count)[None, :]
            for a, b, on in ((i, j, np.ones(len(low), bool)), (j, i, low != column)):
                valid = (i >= 0) & (j >= 0) & on[:, None] & (dense | (a >= b))
                sources.append(source[valid])
                targets.append(layout.flat(a[valid], b[valid]))
                factors.append(value[valid])
    source, flat, value = np.concatenate(sources), np.concatenate(targets), np.concatenate(factors)
    # nearly all full models: a quarter of the memory, and no product
    if deep == 1 and not dense and (value == 1.0).all():
        places = np.full(len(low) * count, -1, np.int32)
        places[source] = flat
        # not where two coordinates of a cell are one unknown, whose entry K_ij has two places
        if (places >= 0).sum() == len(source):
            return Targets(np.zeros(0, np.int32), places, np.zeros(0))
    # in the order of the cell matrices, which are read once from front to back
    order = np.argsort(source, kind="stable")
    return Targets(source[order].astype(np.int32), flat[order].astype(np.int32), value[order])
