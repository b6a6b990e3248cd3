r"""Compiled evaluation of a system: forces, constraints and the iteration matrix, for cells and sampled points alike.

    f(x, v) = C v + K x + sum L^T phi(L x) - Q,    Phi(y),  y = P x + y0,    W = bh M + gh C + K + sum L^T phi' L

`Arrays` is one fixed type for full, reduced and hyper-reduced systems, so that everything is compiled once. Sparse matrices are
(indptr, indices, data). The matrix W is kept as lower band (n, d + 1), band[j, i - j] = W[i, j], or dense (n, n). Vectors `work`
are overwritten.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..bodies import cable_law
from ..core.jit import jit

# columns of `groups`
SAMPLED, CURVATURE, COMPONENTS, POINTS, CELLS, BASIS, NODES, TABLE, OFFSET, SECTION, FIRST, COUNT, PAIR = range(13)


class Csr(NamedTuple):
    """A sparse matrix inside compiled code."""

    indptr: np.ndarray
    indices: np.ndarray
    data: np.ndarray


class Diagonals(NamedTuple):
    """A square matrix by its diagonals: data[k, i] = A[i, i + offsets[k]]."""

    offsets: np.ndarray
    data: np.ndarray


class Arrays(NamedTuple):
    """A system as plain arrays, unknowns in the order of the band."""

    lift: Csr  #: (q, n); empty when no group has cells
    lift_offset: np.ndarray  #: (q,)
    mass: Diagonals
    damping: Diagonals
    stiffness: Diagonals
    mass_band: np.ndarray  #: (n, d+1) or (n, n)
    damping_band: np.ndarray
    stiffness_band: np.ndarray
    dense: bool
    groups: np.ndarray  #: (g, 13) integers of every elastic group
    beta: np.ndarray  #: (g,) damping times [s]
    integers: np.ndarray  #: node numbers of cells
    numbers: np.ndarray  #: tables, sampled jets, offsets, sections
    scatter_source: np.ndarray  #: positions in the cells' matrices ...
    scatter_target: np.ndarray  #: ... and in the flat band
    scatter_factor: np.ndarray
    probes: Csr  #: (j, n)
    probes_offset: np.ndarray
    term_row: np.ndarray  #: constraints, see systems.system.Constraints
    term_value: np.ndarray
    term_signal: np.ndarray
    term_i: np.ndarray
    term_j: np.ndarray
    term_pair: np.ndarray  #: number of the probe pair (i, j) of a quadratic term, its mirror next to it
    load: np.ndarray  #: (n,) constant generalised force [N]
    force_row: np.ndarray
    force_value: np.ndarray
    force_signal: np.ndarray
    laws: np.ndarray  #: (l, 5) kind, slope row, position row, signal, first pair
    law_vector: np.ndarray  #: (l, 3)
    pair_target: np.ndarray  #: (h, 3) pair, row, column of W
    pair_factor: np.ndarray
    pairs: int
    dim: int


@jit
def clear(x: np.ndarray) -> None:
    """x = 0."""
    for i in range(len(x)):
        x[i] = 0.0


@jit
def add_product(A: Csr, factor: float, x: np.ndarray, y: np.ndarray) -> None:
    """y += factor A x."""
    for i in range(len(A.indptr) - 1):
        total = 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            total += A.data[k] * x[A.indices[k]]
        y[i] += factor * total


@jit
def add_diagonals(A: Diagonals, x: np.ndarray, y: np.ndarray) -> None:
    """y += A x."""
    n = len(x)
    for k in range(len(A.offsets)):
        shift = A.offsets[k]
        first = max(0, -shift)
        size = n - abs(shift)
        row, source, target = A.data[k, first : first + size], x[first + shift : first + shift + size], y[first : first + size]
        for i in range(size):
            target[i] += row[i] * source[i]


@jit
def add_transposed(A: Csr, factor: float, y: np.ndarray, x: np.ndarray) -> None:
    """x += factor A^T y."""
    for i in range(len(A.indptr) - 1):
        value = factor * y[i]
        if value != 0.0:
            for k in range(A.indptr[i], A.indptr[i + 1]):
                x[A.indices[k]] += A.data[k] * value


@jit
def affine(A: Csr, offset: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """y = A x + offset."""
    for i in range(len(y)):
        y[i] = offset[i]
    add_product(A, 1.0, x, y)


@jit
def gather_cells(nodes: np.ndarray, table: np.ndarray, q: np.ndarray, local: np.ndarray, u: np.ndarray) -> None:
    """u[(k, c), p, e] = sum_b table[k, p, b, e] q[nodes[b, e] + c]."""
    derivatives, points, basis, cells = table.shape
    dim = u.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            for e in range(cells):
                local[b, c, e] = q[nodes[b, e] + c]
    for k in range(derivatives):
        for c in range(dim):
            for p in range(points):
                if basis == 4:
                    for e in range(cells):
                        u[k * dim + c, p, e] = (
                            table[k, p, 0, e] * local[0, c, e]
                            + table[k, p, 1, e] * local[1, c, e]
                            + table[k, p, 2, e] * local[2, c, e]
                            + table[k, p, 3, e] * local[3, c, e]
                        )
                else:
                    for e in range(cells):
                        u[k * dim + c, p, e] = 0.0
                    for b in range(basis):
                        for e in range(cells):
                            u[k * dim + c, p, e] += table[k, p, b, e] * local[b, c, e]


@jit
def scatter_cells(nodes: np.ndarray, table: np.ndarray, S: np.ndarray, local: np.ndarray, f: np.ndarray) -> None:
    """f[nodes[b, e] + c] += sum_kp table[k, p, b, e] S[(k, c), p, e]."""
    derivatives, points, basis, cells = table.shape
    dim = S.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            for e in range(cells):
                local[b, c, e] = 0.0
            for p in range(points):
                if derivatives == 2:
                    for e in range(cells):
                        local[b, c, e] += table[0, p, b, e] * S[c, p, e] + table[1, p, b, e] * S[dim + c, p, e]
                else:
                    for k in range(derivatives):
                        for e in range(cells):
                            local[b, c, e] += table[k, p, b, e] * S[k * dim + c, p, e]
    for e in range(cells):
        for b in range(basis):
            for c in range(dim):
                f[nodes[b, e] + c] += local[b, c, e]


@jit
def cell_views(A: Arrays, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (b, e) and table (k, p, b, e) of a group of cells."""
    row = A.groups[g]
    cells, basis, points = row[CELLS], row[BASIS], row[POINTS]
    nodes = A.integers[row[NODES] : row[NODES] + basis * cells].reshape(basis, cells)
    size = 2 * points * basis * cells
    return nodes, A.numbers[row[TABLE] : row[TABLE] + size].reshape(2, points, basis, cells)


@jit
def sampled_views(A: Arrays, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Jets (2c p, r) and offset (2c p,) of a group of sampled points."""
    row = A.groups[g]
    size, modes = 2 * row[COMPONENTS] * row[POINTS] * row[CELLS], row[COUNT]
    return A.numbers[row[TABLE] : row[TABLE] + size * modes].reshape(size, modes), A.numbers[row[OFFSET] : row[OFFSET] + size]


@jit
def section_view(A: Arrays, g: int) -> np.ndarray:
    row = A.groups[g]
    size = 4 * row[POINTS] * row[CELLS]
    return A.numbers[row[SECTION] : row[SECTION] + size].reshape(4, row[POINTS], row[CELLS])


@jit
def gather(A: Arrays, g: int, x: np.ndarray, q: np.ndarray, fixed: bool, work: np.ndarray) -> np.ndarray:
    """Jets (2c, p, e) of a group; without the offset (rates) unless `fixed`. Uses the front of `work`."""
    row = A.groups[g]
    shape = (2 * row[COMPONENTS], row[POINTS], row[CELLS])
    size = shape[0] * shape[1] * shape[2]
    flat = work[:size]
    if row[SAMPLED] == 1:
        jets, offset = sampled_views(A, g)
        np.dot(jets, x[row[FIRST] : row[FIRST] + row[COUNT]], flat)
        if fixed:
            for i in range(size):
                flat[i] += offset[i]
    else:
        nodes, table = cell_views(A, g)
        local = work[size : size + row[BASIS] * row[COMPONENTS] * row[CELLS]].reshape(row[BASIS], row[COMPONENTS], row[CELLS])
        gather_cells(nodes, table, q, local, flat.reshape(shape))
    return flat.reshape(shape)


@jit
def add_elastic_force(A: Arrays, x: np.ndarray, v: np.ndarray, body: np.ndarray, work: np.ndarray, f: np.ndarray) -> None:
    """f += sum_j L_j^T S_j; `body` (3, q) receives q, dq/dt and the force on q, `work` is (3, w)."""
    cells, damped = len(A.lift.indptr) > 1, False
    for g in range(len(A.beta)):
        damped = damped or A.beta[g] > 0.0
    q, qv, fq = body[0], body[1], body[2]
    if cells:
        affine(A.lift, A.lift_offset, x, q)
        clear(fq)
        if damped:
            clear(qv)
            add_product(A.lift, 1.0, v, qv)
    for g in range(len(A.groups)):
        row = A.groups[g]
        u = gather(A, g, x, q, True, work[0])
        rate = gather(A, g, v, qv, False, work[1]) if A.beta[g] > 0.0 else u
        S = work[2][: u.size].reshape(u.shape)
        cable_law.stress(row[CURVATURE], u, rate, A.beta[g], section_view(A, g), S)
        if row[SAMPLED] == 1:
            jets, _ = sampled_views(A, g)
            part = work[0][: row[COUNT]]
            np.dot(jets.T, work[2][: u.size], part)
            for r in range(row[COUNT]):
                f[row[FIRST] + r] += part[r]
        else:
            nodes, table = cell_views(A, g)
            local = work[0][: row[BASIS] * row[COMPONENTS] * row[CELLS]].reshape(row[BASIS], row[COMPONENTS], row[CELLS])
            scatter_cells(nodes, table, S, local, fq)
    if cells:
        add_transposed(A.lift, 1.0, fq, f)


@jit
def elastic_energy(A: Arrays, x: np.ndarray, q: np.ndarray, work: np.ndarray) -> float:
    """Strain energy [J]."""
    if len(A.lift.indptr) > 1:
        affine(A.lift, A.lift_offset, x, q)
    total = 0.0
    for g in range(len(A.groups)):
        total += cable_law.energy(A.groups[g, CURVATURE], gather(A, g, x, q, True, work[0]), section_view(A, g))
    return total


@jit
def add_loads(A: Arrays, y: np.ndarray, signals: np.ndarray, g: np.ndarray) -> None:
    """g += forces on the probe rows (j,)."""
    for k in range(len(A.force_row)):
        g[A.force_row[k]] += A.force_value[k] * (signals[A.force_signal[k]] if A.force_signal[k] >= 0 else 1.0)
    for k in range(len(A.laws)):
        slope, position = A.laws[k, 1], A.laws[k, 2]
        s = signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0
        a = A.law_vector[k]
        square = 0.0
        for c in range(A.dim):
            square += y[slope + c] ** 2
        if A.laws[k, 0] == 0:
            s /= square
            if A.dim == 2:
                g[slope] -= s * a[2] * y[slope + 1]
                g[slope + 1] += s * a[2] * y[slope]
            else:
                g[slope] += s * (a[1] * y[slope + 2] - a[2] * y[slope + 1])
                g[slope + 1] += s * (a[2] * y[slope] - a[0] * y[slope + 2])
                g[slope + 2] += s * (a[0] * y[slope + 1] - a[1] * y[slope])
        else:
            s /= np.sqrt(square)
            for c in range(A.dim):
                g[position + c] += s * a[0] * y[slope + c]
            if A.dim == 2:
                g[position] -= s * a[1] * y[slope + 1]
                g[position + 1] += s * a[1] * y[slope]


@jit
def load_slopes(A: Arrays, y: np.ndarray, signals: np.ndarray, factor: float, H: np.ndarray) -> None:
    """H[pair] += factor d force / d slope for the point laws; pairs (c, d) of a law in row order."""
    for k in range(len(A.laws)):
        slope, first = A.laws[k, 1], A.laws[k, 4]
        s = factor * (signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0)
        a, dim = A.law_vector[k], A.dim
        square = 0.0
        for c in range(dim):
            square += y[slope + c] ** 2
        B = np.zeros((3, 3))
        if A.laws[k, 0] == 0:
            B[0, 1], B[1, 0] = -a[2], a[2]
            if dim == 3:
                B[0, 2], B[1, 2], B[2, 0], B[2, 1] = a[1], -a[0], -a[1], a[0]
            power, scale = 2.0, 1.0 / square
        else:
            B[0, 0] = B[1, 1] = B[2, 2] = a[0]
            if dim == 2:
                B[0, 1], B[1, 0] = -a[1], a[1]
            power, scale = 1.0, 1.0 / np.sqrt(square)
        for c in range(dim):
            value = 0.0
            for d in range(dim):
                value += B[c, d] * y[slope + d]
            for d in range(dim):
                H[first + c * dim + d] += s * scale * (B[c, d] - power * value * y[slope + d] / square)


@jit
def constrain(A: Arrays, y: np.ndarray, signals: np.ndarray, gap: np.ndarray, jacobian: np.ndarray) -> None:
    """gap (m,) = Phi and jacobian (m, j) = dPhi/dy."""
    clear(gap)
    clear(jacobian.reshape(-1))
    for k in range(len(A.term_row)):
        value = A.term_value[k] * (signals[A.term_signal[k]] if A.term_signal[k] >= 0 else 1.0)
        m, i, j = A.term_row[k], A.term_i[k], A.term_j[k]
        if i < 0:
            gap[m] += value
        elif j < 0:
            gap[m] += value * y[i]
            jacobian[m, i] += value
        else:
            gap[m] += value * y[i] * y[j]
            jacobian[m, i] += value * y[j]
            jacobian[m, j] += value * y[i]


@jit
def constraint_slopes(A: Arrays, signals: np.ndarray, multipliers: np.ndarray, H: np.ndarray) -> None:
    """H[pair] += d(Phi_y^T lambda)/dy."""
    for k in range(len(A.term_row)):
        if A.term_pair[k] >= 0:
            value = A.term_value[k] * (signals[A.term_signal[k]] if A.term_signal[k] >= 0 else 1.0) * multipliers[A.term_row[k]]
            H[A.term_pair[k]] += value
            H[A.term_pair[k] + 1] += value


@jit
def add_elastic_tangent(A: Arrays, x: np.ndarray, q: np.ndarray, gh: float, work: np.ndarray, W: np.ndarray) -> None:
    """W += sum_j L_j^T D_j L_j, lower band or dense, with damping times gh."""
    if len(A.lift.indptr) > 1:
        affine(A.lift, A.lift_offset, x, q)
    flat = W.reshape(-1)
    for g in range(len(A.groups)):
        row = A.groups[g]
        u = gather(A, g, x, q, True, work[0])
        rows = u.shape[0]
        D = work[1][: rows * u.size].reshape(rows, rows, u.shape[1], u.shape[2])
        cable_law.modulus(row[CURVATURE], u, gh * A.beta[g], section_view(A, g), D)
        if row[SAMPLED] == 1:
            add_sampled_tangent(A, g, D, work[2], W)
        else:
            cell_matrices(A, g, D, work[2])
            for k in range(row[PAIR], row[PAIR] + row[COUNT]):
                flat[A.scatter_target[k]] += A.scatter_factor[k] * work[2][A.scatter_source[k]]


@jit
def add_sampled_tangent(A: Arrays, g: int, D: np.ndarray, work: np.ndarray, W: np.ndarray) -> None:
    """W[columns, columns] += jets^T D jets."""
    row = A.groups[g]
    jets, _ = sampled_views(A, g)
    rows, points, modes = D.shape[0], D.shape[2] * D.shape[3], row[COUNT]
    DG = work[: jets.size].reshape(rows, points, modes)
    G = jets.reshape(rows, points, modes)
    flat = D.reshape(rows, rows, points)
    for i in range(rows):
        for p in range(points):
            for r in range(modes):
                DG[i, p, r] = 0.0
            for j in range(rows):
                value = flat[i, j, p]
                for r in range(modes):
                    DG[i, p, r] += value * G[j, p, r]
    first = row[FIRST]
    product = np.dot(jets.T, DG.reshape(rows * points, modes))
    for i in range(modes):
        for j in range(modes):
            W[first + i, first + j] += product[i, j]


@jit
def cell_matrices(A: Arrays, g: int, D: np.ndarray, work: np.ndarray) -> None:
    """Lower triangles of all cell matrices, work[l (l+1)/2 + m, e] with l = (b, c), from the moduli D (2c, 2c, p, e)."""
    row = A.groups[g]
    _, table = cell_views(A, g)
    dim, basis, cells, points = row[COMPONENTS], row[BASIS], row[CELLS], row[POINTS]
    size = basis * dim
    count = size * (size + 1) // 2
    matrices = work[: count * cells].reshape(count, cells)
    DB = work[count * cells : count * cells + 2 * cells].reshape(2, cells)
    clear(work[: count * cells])
    for p in range(points):
        for m in range(size):
            b, c = m // dim, m % dim
            for ci in range(dim):
                for e in range(cells):
                    DB[0, e] = D[ci, c, p, e] * table[0, p, b, e] + D[ci, dim + c, p, e] * table[1, p, b, e]
                    DB[1, e] = D[dim + ci, c, p, e] * table[0, p, b, e] + D[dim + ci, dim + c, p, e] * table[1, p, b, e]
                for bi in range(b, basis):
                    line = bi * dim + ci
                    if line >= m:
                        target = line * (line + 1) // 2 + m
                        for e in range(cells):
                            matrices[target, e] += table[0, p, bi, e] * DB[0, e] + table[1, p, bi, e] * DB[1, e]


@jit
def add_pairs(A: Arrays, H: np.ndarray, W: np.ndarray) -> None:
    """W += P^T H P for the probe pairs; a lower band takes the symmetric part."""
    for k in range(len(A.pair_factor)):
        i, j = A.pair_target[k, 1], A.pair_target[k, 2]
        value = A.pair_factor[k] * H[A.pair_target[k, 0]]
        if A.dense:
            W[i, j] += value
        else:
            W[min(i, j), abs(i - j)] += value if i == j else 0.5 * value
