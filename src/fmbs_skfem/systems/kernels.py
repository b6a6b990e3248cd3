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
SAMPLED, CURVATURE, COMPONENTS, POINTS, CELLS, BASIS, NODES, TABLE, OFFSET, SECTION, FIRST, COUNT, PAIR, TURNED = range(14)


class Csr(NamedTuple):
    """A sparse matrix inside compiled code."""

    indptr: np.ndarray
    indices: np.ndarray
    data: np.ndarray


class Diagonals(NamedTuple):
    """A square matrix by its diagonals: data[k, i] = A[i, i + offsets[k]]."""

    offsets: np.ndarray
    data: np.ndarray


class Groups(NamedTuple):
    """Elastic groups: cells or sampled points, flattened behind each other."""

    table: np.ndarray  #: (g, 14) integers of every group
    beta: np.ndarray  #: (g,) damping times [s]
    integers: np.ndarray  #: node numbers of cells
    numbers: np.ndarray  #: tables, sampled jets, offsets, sections


class Scatter(NamedTuple):
    """Where entries of the cells' matrices go in the flat band."""

    source: np.ndarray
    target: np.ndarray
    factor: np.ndarray


class Terms(NamedTuple):
    """Terms of systems.system.Constraints; `pair` is the probe pair (i, j) of a quadratic term, the next one its mirror."""

    row: np.ndarray
    value: np.ndarray
    signal: np.ndarray
    i: np.ndarray
    j: np.ndarray
    pair: np.ndarray


class Forces(NamedTuple):
    """Loads on probe rows: terms, and laws (l, 5) kind, slope row, position row, signal, first pair, with vectors (l, 3)."""

    row: np.ndarray
    value: np.ndarray
    signal: np.ndarray
    laws: np.ndarray
    vectors: np.ndarray
    dim: int


class Pairs(NamedTuple):
    """Entries of P^T H P: target (h, 3) pair, row, column of W; factor (h,)."""

    target: np.ndarray
    factor: np.ndarray
    size: int


class Arrays(NamedTuple):
    """A system as plain arrays, unknowns in the order of the band. Functions take the parts they need: passing all costs time."""

    groups: Groups
    scatter: Scatter
    lift: Csr  #: (q, n); empty when no group has cells
    lift_offset: np.ndarray  #: (q,)
    mass: Diagonals
    damping: Diagonals
    stiffness: Diagonals
    mass_band: np.ndarray  #: (n, d+1) or (n, n)
    damping_band: np.ndarray
    stiffness_band: np.ndarray
    dense: bool
    probes: Csr  #: (j, n)
    probes_offset: np.ndarray
    terms: Terms
    forces: Forces
    pairs: Pairs
    load: np.ndarray  #: (n,) constant generalised force [N]


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
def add_combination(rows: np.ndarray, factors: np.ndarray, y: np.ndarray) -> None:
    """y (i,) += sum_r factors[r] rows[r, i]; four rows at a time, for sizes where a library call costs more than the sum."""
    full = len(factors) // 4 * 4
    for r in range(0, full, 4):
        a, b, c, d = factors[r], factors[r + 1], factors[r + 2], factors[r + 3]
        row_a, row_b, row_c, row_d = rows[r], rows[r + 1], rows[r + 2], rows[r + 3]
        for i in range(len(y)):
            y[i] += row_a[i] * a + row_b[i] * b + row_c[i] * c + row_d[i] * d
    for r in range(full, len(factors)):
        row_a, a = rows[r], factors[r]
        for i in range(len(y)):
            y[i] += row_a[i] * a


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
def cell_views(groups: Groups, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (b, e) and table (k, p, b, e) of a group of cells."""
    row = groups.table[g]
    cells, basis, points = row[CELLS], row[BASIS], row[POINTS]
    nodes = groups.integers[row[NODES] : row[NODES] + basis * cells].reshape(basis, cells)
    size = 2 * points * basis * cells
    return nodes, groups.numbers[row[TABLE] : row[TABLE] + size].reshape(2, points, basis, cells)


@jit
def sampled_views(groups: Groups, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Jets (2c p, r) and offset (2c p,) of a group of sampled points."""
    row = groups.table[g]
    size, modes = 2 * row[COMPONENTS] * row[POINTS] * row[CELLS], row[COUNT]
    return groups.numbers[row[TABLE] : row[TABLE] + size * modes].reshape(size, modes), groups.numbers[
        row[OFFSET] : row[OFFSET] + size
    ]


@jit
def section_view(groups: Groups, g: int) -> np.ndarray:
    row = groups.table[g]
    size = 4 * row[POINTS] * row[CELLS]
    return groups.numbers[row[SECTION] : row[SECTION] + size].reshape(4, row[POINTS], row[CELLS])


@jit
def gather(groups: Groups, g: int, x: np.ndarray, q: np.ndarray, fixed: float, work: np.ndarray) -> np.ndarray:
    """Jets (2c, p, e) of a group, with `fixed` times the offset: 1 for positions, 0 for rates. Uses the front of `work`."""
    row = groups.table[g]
    shape = (2 * row[COMPONENTS], row[POINTS], row[CELLS])
    size = shape[0] * shape[1] * shape[2]
    flat = work[:size]
    if row[SAMPLED] == 1:
        _, offset = sampled_views(groups, g)
        for i in range(size):
            flat[i] = fixed * offset[i]
        modes = row[COUNT]
        turned = groups.numbers[row[TURNED] : row[TURNED] + size * modes].reshape(modes, size)
        add_combination(turned, x[row[FIRST] : row[FIRST] + modes], flat)
    else:
        nodes, table = cell_views(groups, g)
        local = work[size : size + row[BASIS] * row[COMPONENTS] * row[CELLS]].reshape(row[BASIS], row[COMPONENTS], row[CELLS])
        gather_cells(nodes, table, q, local, flat.reshape(shape))
    return flat.reshape(shape)


@jit
def add_elastic_force(
    groups: Groups, lift: Csr, offset: np.ndarray, x: np.ndarray, v: np.ndarray, body: np.ndarray, work: np.ndarray, f: np.ndarray
) -> None:
    """f += sum_j L_j^T S_j; `body` (3, q) receives q, dq/dt and the force on q, `work` is (3, w)."""
    cells, damped = len(lift.indptr) > 1, False
    for g in range(len(groups.beta)):
        damped = damped or groups.beta[g] > 0.0
    q, qv, fq = body[0], body[1], body[2]
    if cells:
        affine(lift, offset, x, q)
        clear(fq)
        if damped:
            clear(qv)
            add_product(lift, 1.0, v, qv)
    for g in range(len(groups.table)):
        row = groups.table[g]
        u = gather(groups, g, x, q, 1.0, work[0])
        rate = gather(groups, g, v, qv, 0.0, work[1]) if groups.beta[g] > 0.0 else u
        S = work[2][: u.size].reshape(u.shape)
        cable_law.stress(row[CURVATURE], u, rate, groups.beta[g], section_view(groups, g), S)
        if row[SAMPLED] == 1:
            jets, _ = sampled_views(groups, g)
            add_combination(jets, work[2][: u.size], f[row[FIRST] : row[FIRST] + row[COUNT]])
        else:
            nodes, table = cell_views(groups, g)
            local = work[0][: row[BASIS] * row[COMPONENTS] * row[CELLS]].reshape(row[BASIS], row[COMPONENTS], row[CELLS])
            scatter_cells(nodes, table, S, local, fq)
    if cells:
        add_transposed(lift, 1.0, fq, f)


@jit
def elastic_energy(groups: Groups, lift: Csr, offset: np.ndarray, x: np.ndarray, q: np.ndarray, work: np.ndarray) -> float:
    """Strain energy [J]."""
    if len(lift.indptr) > 1:
        affine(lift, offset, x, q)
    total = 0.0
    for g in range(len(groups.table)):
        total += cable_law.energy(groups.table[g, CURVATURE], gather(groups, g, x, q, 1.0, work[0]), section_view(groups, g))
    return total


@jit
def add_loads(A: Forces, y: np.ndarray, signals: np.ndarray, g: np.ndarray) -> None:
    """g += forces on the probe rows (j,)."""
    for k in range(len(A.row)):
        g[A.row[k]] += A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0)
    for k in range(len(A.laws)):
        slope, position = A.laws[k, 1], A.laws[k, 2]
        s = signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0
        a = A.vectors[k]
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
def load_slopes(A: Forces, y: np.ndarray, signals: np.ndarray, factor: float, H: np.ndarray) -> None:
    """H[pair] += factor d force / d slope for the point laws; pairs (c, d) of a law in row order."""
    for k in range(len(A.laws)):
        slope, first = A.laws[k, 1], A.laws[k, 4]
        s = factor * (signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0)
        a, dim = A.vectors[k], A.dim
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
def constrain(A: Terms, y: np.ndarray, signals: np.ndarray, gap: np.ndarray, jacobian: np.ndarray) -> None:
    """gap (m,) = Phi and jacobian (m, j) = dPhi/dy."""
    clear(gap)
    clear(jacobian.reshape(-1))
    for k in range(len(A.row)):
        value = A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0)
        m, i, j = A.row[k], A.i[k], A.j[k]
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
def constraint_slopes(A: Terms, signals: np.ndarray, multipliers: np.ndarray, H: np.ndarray) -> None:
    """H[pair] += d(Phi_y^T lambda)/dy."""
    for k in range(len(A.row)):
        if A.pair[k] >= 0:
            value = A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0) * multipliers[A.row[k]]
            H[A.pair[k]] += value
            H[A.pair[k] + 1] += value


@jit
def add_elastic_tangent(
    groups: Groups,
    scatter: Scatter,
    lift: Csr,
    offset: np.ndarray,
    x: np.ndarray,
    q: np.ndarray,
    gh: float,
    work: np.ndarray,
    W: np.ndarray,
) -> None:
    """W += sum_j L_j^T D_j L_j, lower band or dense, with damping times gh."""
    if len(lift.indptr) > 1:
        affine(lift, offset, x, q)
    flat = W.reshape(-1)
    for g in range(len(groups.table)):
        row = groups.table[g]
        u = gather(groups, g, x, q, 1.0, work[0])
        rows = u.shape[0]
        D = work[1][: rows * u.size].reshape(rows, rows, u.shape[1], u.shape[2])
        cable_law.modulus(row[CURVATURE], u, gh * groups.beta[g], section_view(groups, g), D)
        if row[SAMPLED] == 1:
            add_sampled_tangent(groups, g, D, work[2], W)
        else:
            cell_matrices(groups, g, D, work[2])
            for k in range(row[PAIR], row[PAIR] + row[COUNT]):
                flat[scatter.target[k]] += scatter.factor[k] * work[2][scatter.source[k]]


@jit
def add_sampled_tangent(groups: Groups, g: int, D: np.ndarray, work: np.ndarray, W: np.ndarray) -> None:
    """W[columns, columns] += jets^T D jets."""
    row = groups.table[g]
    jets, _ = sampled_views(groups, g)
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
def cell_matrices(groups: Groups, g: int, D: np.ndarray, work: np.ndarray) -> None:
    """Lower triangles of all cell matrices, work[l (l+1)/2 + m, e] with l = (b, c), from the moduli D (2c, 2c, p, e)."""
    row = groups.table[g]
    _, table = cell_views(groups, g)
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
def add_pairs(A: Pairs, H: np.ndarray, dense: bool, W: np.ndarray) -> None:
    """W += P^T H P for the probe pairs; a lower band takes the symmetric part."""
    for k in range(len(A.factor)):
        i, j = A.target[k, 1], A.target[k, 2]
        value = A.factor[k] * H[A.target[k, 0]]
        if dense:
            W[i, j] += value
        else:
            W[min(i, j), abs(i - j)] += value if i == j else 0.5 * value
