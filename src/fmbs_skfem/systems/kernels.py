r"""Compiled evaluation of a system: forces, constraints and the iteration matrix, for cells and sampled points alike.

    f(x, v) = C v + K x + sum L^T phi(L x) - Q,    Phi(y),  y = P x + y0,    W = bh M + gh C + K + sum L^T phi' L

`Arrays` is one fixed type for full, reduced and hyper-reduced systems, so that everything is compiled once. Sparse matrices are
(indptr, indices, data). The matrix W is kept as lower band (n, d + 1), band[j, i - j] = W[i, j], or dense (n, n). Vectors `work`
are overwritten.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..bodies import laws
from ..core.entries import view
from ..core.jit import jit, summing
from . import quartic, springs
from .springs import ANGLE, SPRING
from .turning import Turning

# columns of `groups`
SAMPLED, LAW, VECTORS, ROWS, POINTS, CELLS, BASIS, COMPONENTS, NODES, TABLE, OFFSET, SECTION, FIRST, COUNT, PAIR, TURNED = range(16)
SAMPLE, QUARTIC = 1, 2  #: values of SAMPLED: points multiplied out, a polynomial; 0 for cells


class Csr(NamedTuple):
    """A sparse matrix inside compiled code, the columns of every row in order."""

    indptr: np.ndarray
    indices: np.ndarray
    data: np.ndarray


class Operator(NamedTuple):
    """A constant symmetric matrix in the storage that its product is fastest in; the other storages are empty.

    diagonals[k, i] = A[i, i + offsets[k]] for bands, `rows` for sparse systems, `store` for dense ones. `rows` holds one row for
    `components` unknowns where A = rows (x) identity, which reads less memory. `store` is also what the
    iteration matrix adds: lower band (n, d+1) or dense (n, n); it has no rows for sparse systems.
    """

    offsets: np.ndarray
    diagonals: np.ndarray
    rows: Csr
    components: int
    store: np.ndarray
    full: bool  #: the product reads `store`


class Groups(NamedTuple):
    """Elastic groups: cells, sampled points or polynomials, flattened behind each other."""

    table: np.ndarray  #: (g, 16) integers of every group
    beta: np.ndarray  #: (g,) damping times [s]
    integers: np.ndarray  #: node numbers of cells
    numbers: np.ndarray  #: tables, sampled jets, offsets, sections
    laws: np.ndarray  #: addresses of the elastic laws in use
    quartics: np.ndarray  #: addresses of the functions of polynomials


class Scatter(NamedTuple):
    """Where entries of the cells' matrices go in the flat band."""

    source: np.ndarray
    target: np.ndarray
    factor: np.ndarray


class Terms(NamedTuple):
    """Terms of systems.system.Constraints; `pair` is the first probe pair of a term with second derivatives."""

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
    lift: Csr  #: coordinates of the cells from the unknowns; empty when no group has cells
    lift_offset: np.ndarray
    mass: Operator
    damping: Operator
    stiffness: Operator
    dense: bool
    probes: Csr  #: (j, n)
    probes_offset: np.ndarray
    terms: Terms
    forces: Forces
    pairs: Pairs
    load: np.ndarray  #: (n,) constant generalised force [N]
    turning: Turning  #: of reduced bodies in the plane
    norm: np.ndarray  #: (n,) weights of the unknowns in the norm of a displacement, sqrt(sum norm_n x_n^2) [m]


@jit
def clear(x: np.ndarray) -> None:
    """x = 0."""
    for i in range(len(x)):
        x[i] = 0.0


@summing
def add_product(A: Csr, factor: float, x: np.ndarray, y: np.ndarray) -> None:
    """y += factor A x."""
    for i in range(len(A.indptr) - 1):
        total, start, stop = 0.0, A.indptr[i], A.indptr[i + 1]
        if unbroken(A, start, stop):
            row, part = A.data[start:stop], x[A.indices[start] :]
            for k in range(len(row)):
                total += row[k] * part[k]
        else:
            for k in range(start, stop):
                total += A.data[k] * x[A.indices[k]]
        y[i] += factor * total


@jit
def unbroken(A: Csr, start: int, stop: int) -> bool:
    """Whether entries of a row, in order, stand side by side, and are so many that it pays to know."""
    return stop - start > 8 and A.indices[stop - 1] - A.indices[start] == stop - start - 1


@jit
def add_pairwise(A: Csr, x: np.ndarray, y: np.ndarray) -> None:
    """y += (A (x) I) x for vectors of two components."""
    for i in range(len(A.indptr) - 1):
        first, second = 0.0, 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            j, value = 2 * A.indices[k], A.data[k]
            first += value * x[j]
            second += value * x[j + 1]
        y[2 * i] += first
        y[2 * i + 1] += second


@jit
def add_triplewise(A: Csr, x: np.ndarray, y: np.ndarray) -> None:
    """y += (A (x) I) x for vectors of three components."""
    for i in range(len(A.indptr) - 1):
        first, second, third = 0.0, 0.0, 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            j, value = 3 * A.indices[k], A.data[k]
            first += value * x[j]
            second += value * x[j + 1]
            third += value * x[j + 2]
        y[3 * i] += first
        y[3 * i + 1] += second
        y[3 * i + 2] += third


@jit
def add_operator(A: Operator, x: np.ndarray, y: np.ndarray) -> None:
    """y += A x."""
    if A.full:
        add_combination(A.store, x, y)
        return
    if len(A.rows.indptr) > 1:
        if A.components == 2:
            add_pairwise(A.rows, x, y)
        elif A.components == 3:
            add_triplewise(A.rows, x, y)
        else:
            add_product(A.rows, 1.0, x, y)
        return
    n = len(x)
    for k in range(len(A.offsets)):
        shift = A.offsets[k]
        first = max(0, -shift)
        size = n - abs(shift)
        row, source = A.diagonals[k, first : first + size], x[first + shift : first + shift + size]
        target = y[first : first + size]
        for i in range(size):
            target[i] += row[i] * source[i]


@jit
def add_transposed(A: Csr, factor: float, y: np.ndarray, x: np.ndarray) -> None:
    """x += factor A^T y."""
    for i in range(len(A.indptr) - 1):
        value, start, stop = factor * y[i], A.indptr[i], A.indptr[i + 1]
        if value == 0.0:
            continue
        if unbroken(A, start, stop):
            row, part = A.data[start:stop], x[A.indices[start] :]
            for k in range(len(row)):
                part[k] += row[k] * value
        else:
            for k in range(start, stop):
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


@summing
def add_sums(rows: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """y (r,) += sum_i rows[r, i] x[i]; four rows at a time."""
    full = len(y) // 4 * 4
    for r in range(0, full, 4):
        row_a, row_b, row_c, row_d = rows[r], rows[r + 1], rows[r + 2], rows[r + 3]
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for i in range(len(x)):
            a += row_a[i] * x[i]
            b += row_b[i] * x[i]
            c += row_c[i] * x[i]
            d += row_d[i] * x[i]
        y[r] += a
        y[r + 1] += b
        y[r + 2] += c
        y[r + 3] += d
    for r in range(full, len(y)):
        row_a, a = rows[r], 0.0
        for i in range(len(x)):
            a += row_a[i] * x[i]
        y[r] += a


@jit
def gather_cells(nodes: np.ndarray, table: np.ndarray, q: np.ndarray, local: np.ndarray, u: np.ndarray) -> None:
    """u[(k, c), p, e] = sum_b table[k, p, b, e] q[nodes[b, e] + c]."""
    derivatives, points, basis, cells = table.shape
    dim = u.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            for e in range(cells):
                local[b, c, e] = q[nodes[b, e] + c]
    full = basis // 4 * 4
    for k in range(derivatives):
        for c in range(dim):
            for p in range(points):
                target = u[k * dim + c, p]
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
                    N0, q0 = table[k, p, b], local[b, c]
                    for e in range(cells):
                        target[e] += N0[e] * q0[e]


@jit
def scatter_cells(nodes: np.ndarray, table: np.ndarray, S: np.ndarray, local: np.ndarray, f: np.ndarray) -> None:
    """f[nodes[b, e] + c] += sum_kp table[k, p, b, e] S[(k, c), p, e]."""
    derivatives, points, basis, cells = table.shape
    dim = S.shape[0] // derivatives
    for b in range(basis):
        for c in range(dim):
            for e in range(cells):
                local[b, c, e] = 0.0
            target = local[b, c]
            for p in range(points):
                if derivatives == 2:
                    N0, N1, S0, S1 = table[0, p, b], table[1, p, b], S[c, p], S[dim + c, p]
                    for e in range(cells):
                        target[e] += N0[e] * S0[e] + N1[e] * S1[e]
                else:
                    for k in range(derivatives):
                        N0, S0 = table[k, p, b], S[k * dim + c, p]
                        for e in range(cells):
                            target[e] += N0[e] * S0[e]
    for e in range(cells):
        for b in range(basis):
            for c in range(dim):
                f[nodes[b, e] + c] += local[b, c, e]


@jit
def cell_views(groups: Groups, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (b, e) and table (k, p, b, e) of a group of cells."""
    row = groups.table[g]
    cells, basis, points = row[CELLS], row[BASIS], row[POINTS]
    nodes = view(groups.integers, row[NODES], (basis, cells))
    return nodes, view(groups.numbers, row[TABLE], (row[VECTORS], points, basis, cells))


@jit
def sampled_views(groups: Groups, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Jets (k c p, r) and offset (k c p,) of a group of sampled points."""
    row = groups.table[g]
    size, modes = row[VECTORS] * row[COMPONENTS] * row[POINTS] * row[CELLS], row[COUNT]
    return view(groups.numbers, row[TABLE], (size, modes)), view(groups.numbers, row[OFFSET], (size,))


@jit
def turned_view(groups: Groups, g: int) -> np.ndarray:
    """Jets mode by mode (r, k c p): forces read these alone, so that they stay in the cache from gather to scatter."""
    row = groups.table[g]
    return view(groups.numbers, row[TURNED], (row[COUNT], row[VECTORS] * row[COMPONENTS] * row[POINTS] * row[CELLS]))


@jit
def coefficients(groups: Groups, g: int) -> np.ndarray:
    """Coefficients of a group that is a quartic polynomial, with all that is behind them."""
    return groups.numbers[groups.table[g, TABLE] :]


@jit
def section_view(groups: Groups, g: int) -> np.ndarray:
    row = groups.table[g]
    return view(groups.numbers, row[SECTION], (row[ROWS], row[POINTS], row[CELLS]))


@jit
def gather(groups: Groups, g: int, x: np.ndarray, q: np.ndarray, fixed: float, work: np.ndarray) -> np.ndarray:
    """Jets (k c, p, e) of a group, with `fixed` times the offset: 1 for positions, 0 for rates. Uses the front of `work`."""
    row = groups.table[g]
    shape = (row[VECTORS] * row[COMPONENTS], row[POINTS], row[CELLS])
    size = shape[0] * shape[1] * shape[2]
    flat = view(work, 0, (size,))
    if row[SAMPLED] == SAMPLE:
        _, offset = sampled_views(groups, g)
        for i in range(size):
            flat[i] = fixed * offset[i]
        add_combination(turned_view(groups, g), view(x, row[FIRST], (row[COUNT],)), flat)
    else:
        nodes, table = cell_views(groups, g)
        local = view(work, size, (row[BASIS], row[COMPONENTS], row[CELLS]))
        gather_cells(nodes, table, q, local, view(work, 0, shape))
    return view(work, 0, shape)


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
        if row[SAMPLED] == QUARTIC:
            modes = slice(row[FIRST], row[FIRST] + row[COUNT])
            quartic.call_force(groups.quartics, coefficients(groups, g), x[modes], work[0], f[modes])
            continue
        u = gather(groups, g, x, q, 1.0, work[0])
        rate = gather(groups, g, v, qv, 0.0, work[1]) if groups.beta[g] > 0.0 else u
        S = view(work[2], 0, u.shape)
        laws.call_stress(groups.laws, row[LAW], u, rate, groups.beta[g], section_view(groups, g), S)
        if row[SAMPLED] == SAMPLE:
            add_sums(turned_view(groups, g), view(work[2], 0, (u.size,)), view(f, row[FIRST], (row[COUNT],)))
        else:
            nodes, table = cell_views(groups, g)
            local = view(work[0], 0, (row[BASIS], row[COMPONENTS], row[CELLS]))
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
        row = groups.table[g]
        if row[SAMPLED] == QUARTIC:
            total += quartic.call_energy(groups.quartics, coefficients(groups, g), x[row[FIRST] : row[FIRST] + row[COUNT]], work[0])
            continue
        total += laws.call_energy(groups.laws, groups.table[g, LAW], gather(groups, g, x, q, 1.0, work[0]), section_view(groups, g))
    return total


@jit
def add_loads(A: Forces, probes: Csr, y: np.ndarray, v: np.ndarray, signals: np.ndarray, angles: np.ndarray, g: np.ndarray) -> None:
    """g += forces on the probe rows (j,); only dampers read the velocities v (n,), only springs their last angles (l,)."""
    for k in range(len(A.row)):
        g[A.row[k]] += A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0)
    for k in range(len(A.laws)):
        slope, position = A.laws[k, 1], A.laws[k, 2]
        s = signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0
        a = A.vectors[k]
        if A.laws[k, 0] == SPRING:
            springs.add_spring(probes, A.laws[k], a, y, v, angles[k], s, g)
            continue
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
def load_slopes(
    A: Forces,
    probes: Csr,
    y: np.ndarray,
    v: np.ndarray,
    signals: np.ndarray,
    angles: np.ndarray,
    factor: float,
    gh: float,
    H: np.ndarray,
) -> None:
    """H[pair] += factor (d force / dy + gh d force / dy') for the point laws; pairs (c, d) of a law in row order."""
    for k in range(len(A.laws)):
        slope, first = A.laws[k, 1], A.laws[k, 4]
        s = factor * (signals[A.laws[k, 3]] if A.laws[k, 3] >= 0 else 1.0)
        a, dim = A.vectors[k], A.dim
        if A.laws[k, 0] == SPRING:
            springs.spring_slopes(probes, A.laws[k], a, y, v, angles[k], s, gh, H)
            continue
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
        a, b = add_term(A, k, y, signals, gap)
        if A.i[k] >= 0:
            jacobian[A.row[k], A.i[k]] += a
        if A.j[k] >= 0:
            jacobian[A.row[k], A.j[k]] += b


@jit
def constrain_sparse(A: Terms, y: np.ndarray, signals: np.ndarray, gap: np.ndarray, slopes: np.ndarray) -> None:
    """gap (m,) = Phi and slopes (k, 2), the derivatives of every term by y_i and y_j."""
    clear(gap)
    for k in range(len(A.row)):
        slopes[k] = add_term(A, k, y, signals, gap)


@jit
def add_term(A: Terms, k: int, y: np.ndarray, signals: np.ndarray, gap: np.ndarray) -> tuple[float, float]:
    """gap += term k; its derivatives by y_i and y_j."""
    value = A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0)
    m, i, j = A.row[k], A.i[k], A.j[k]
    if A.signal[k] == ANGLE:
        if i < 0:
            gap[m] = springs.remainder(gap[m], value)
            return 0.0, 0.0
        gap[m] += value * springs.angle(y, i, j)
        square = y[i] ** 2 + y[j] ** 2
        return -value * y[j] / square, value * y[i] / square
    if i < 0:
        gap[m] += value
        return 0.0, 0.0
    if j < 0:
        gap[m] += value * y[i]
        return value, 0.0
    gap[m] += value * y[i] * y[j]
    return value * y[j], value * y[i]


@jit
def steady(A: Terms) -> bool:
    """Whether the constraints are linear in the unknowns and independent of time: their directions stay as they are."""
    return bool(np.all(A.j < 0) and np.all(A.signal == -1))


@jit
def drift(A: Terms, paths: np.ndarray, signals: np.ndarray, second: float, third: float, out: np.ndarray) -> None:
    """out (m,) = Phi_y z + D1 + second D2 + third D3, D_k the part of d^k Phi/dt^k without Phi_y times the k-th derivative of y.

    `paths` (4, j) are y, z, v = dy/dt and a = dv/dt of the probe rows; `signals` holds the values of all signals, then their first,
    second and third derivatives, where a constraint reads one. A term s(t) p(y), p = y_i y_j, with the derivatives s1, s2, s3 and
    p1, p2 by time has

        D1 = s1 p,   D2 = s2 p + 2 s1 p1 + 2 s v_i v_j,   D3 = s3 p + 3 s2 p1 + 3 s1 p2 + 3 s (v_i a_j + a_i v_j)
    """
    clear(out)
    y, z, v, a, many = paths[0], paths[1], paths[2], paths[3], len(signals) // 4
    for k in range(len(A.row)):
        m, i, j, signal = A.row[k], A.i[k], A.j[k], A.signal[k]
        if signal == ANGLE:
            if i >= 0:
                out[m] += A.value[k] * springs.angle_drift(paths, i, j, second, third)
            continue
        s, s1, s2, s3 = A.value[k], 0.0, 0.0, 0.0
        if signal >= 0:
            s1, s2, s3 = s * signals[many + signal], s * signals[2 * many + signal], s * signals[3 * many + signal]
            s *= signals[signal]
        p, pz, p1, p2, twice, mixed = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if j >= 0:
            p, pz, p1 = y[i] * y[j], y[i] * z[j] + z[i] * y[j], y[i] * v[j] + v[i] * y[j]
            twice, mixed = 2.0 * v[i] * v[j], 3.0 * (v[i] * a[j] + a[i] * v[j])
            p2 = y[i] * a[j] + a[i] * y[j] + twice
        elif i >= 0:
            p, pz, p1, p2 = y[i], z[i], v[i], a[i]
        out[m] += s * (pz + second * twice + third * mixed)
        if signal >= 0:
            out[m] += s1 * p + second * (s2 * p + 2.0 * s1 * p1) + third * (s3 * p + 3.0 * (s2 * p1 + s1 * p2))


@summing
def probe_paths(A: Csr, offset: np.ndarray, x: np.ndarray, z: np.ndarray, v: np.ndarray, a: np.ndarray, paths: np.ndarray) -> None:
    """paths (4, j) = A x + offset, A z, A v, A a; a row of A is read once."""
    for i in range(len(offset)):
        p, q, r, s = offset[i], 0.0, 0.0, 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            value, n = A.data[k], A.indices[k]
            p += value * x[n]
            q += value * z[n]
            r += value * v[n]
            s += value * a[n]
        paths[0, i], paths[1, i], paths[2, i], paths[3, i] = p, q, r, s


@jit
def constraint_slopes(A: Terms, y: np.ndarray, signals: np.ndarray, multipliers: np.ndarray, H: np.ndarray) -> None:
    """H[pair] += d(Phi_y^T lambda)/dy."""
    for k in range(len(A.row)):
        if A.pair[k] >= 0:
            value = A.value[k] * (signals[A.signal[k]] if A.signal[k] >= 0 else 1.0) * multipliers[A.row[k]]
            if A.signal[k] == ANGLE:
                springs.add_angle_slopes(y, A.i[k], A.j[k], value, H, A.pair[k])
                continue
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
        if row[SAMPLED] == QUARTIC:
            modes = slice(row[FIRST], row[FIRST] + row[COUNT])
            quartic.call_tangent(groups.quartics, coefficients(groups, g), x[modes], work[0], row[FIRST], W)
            continue
        u = gather(groups, g, x, q, 1.0, work[0])
        rows = u.shape[0]
        D = view(work[1], 0, (rows, rows, u.shape[1], u.shape[2]))
        laws.call_modulus(groups.laws, row[LAW], u, gh * groups.beta[g], section_view(groups, g), D)
        if row[SAMPLED] == SAMPLE:
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
    modulus_times_jets(D.reshape(rows, rows, points), jets.reshape(rows, points, modes), view(work, 0, (rows, points, modes)))
    product = np.dot(jets.T, view(work, 0, (rows * points, modes)))
    first = row[FIRST]
    for i in range(modes):
        for j in range(modes):
            W[first + i, first + j] += product[i, j]


@jit
def modulus_times_jets(D: np.ndarray, jets: np.ndarray, stress: np.ndarray) -> None:
    """stress[i, p, r] = sum_j D[i, j, p] jets[j, p, r]; four terms, then two at a time: every law has at least four rows."""
    rows, points, modes = jets.shape
    for i in range(rows):
        for p in range(points):
            target = stress[i, p]
            a, b, c, d = D[i, 0, p], D[i, 1, p], D[i, 2, p], D[i, 3, p]
            row_a, row_b, row_c, row_d = jets[0, p], jets[1, p], jets[2, p], jets[3, p]
            for r in range(modes):
                target[r] = a * row_a[r] + b * row_b[r] + c * row_c[r] + d * row_d[r]
            for j in range(4, rows - 1, 2):
                a, b, row_a, row_b = D[i, j, p], D[i, j + 1, p], jets[j, p], jets[j + 1, p]
                for r in range(modes):
                    target[r] += a * row_a[r] + b * row_b[r]
            if rows % 2 == 1:
                a, row_a = D[i, rows - 1, p], jets[rows - 1, p]
                for r in range(modes):
                    target[r] += a * row_a[r]


@jit
def cell_matrices(groups: Groups, g: int, D: np.ndarray, work: np.ndarray) -> None:
    """Lower triangles of all cell matrices, work[l (l+1)/2 + m, e] with l = (b, c), from the moduli D (k c, k c, p, e)."""
    row = groups.table[g]
    _, table = cell_views(groups, g)
    dim, basis, cells, points = row[COMPONENTS], row[BASIS], row[CELLS], row[POINTS]
    size = basis * dim
    count = size * (size + 1) // 2
    matrices = work[: count * cells].reshape(count, cells)
    vectors = row[VECTORS]
    DB = work[count * cells : count * cells + vectors * cells].reshape(vectors, cells)
    clear(work[: count * cells])
    for p in range(points):
        for m in range(size):
            b, c = m // dim, m % dim
            for ci in range(dim):
                modulus_times_basis(D, table, p, b, c, ci, DB)
                for bi in range(b, basis):
                    line = bi * dim + ci
                    if line >= m:
                        target = matrices[line * (line + 1) // 2 + m]
                        N0, N1, first, second = table[0, p, bi], table[1, p, bi], DB[0], DB[1]
                        for e in range(cells):
                            target[e] += N0[e] * first[e] + N1[e] * second[e]
                        for k in range(2, vectors):
                            N0, first = table[k, p, bi], DB[k]
                            for e in range(cells):
                                target[e] += N0[e] * first[e]


@jit
def modulus_times_basis(D: np.ndarray, table: np.ndarray, p: int, b: int, c: int, ci: int, DB: np.ndarray) -> None:
    """DB[k, e] = sum_l D[(k, ci), (l, c), p, e] table[l, p, b, e]; two terms at once: every law reads at least two vectors."""
    vectors, dim, cells = len(DB), len(D) // len(DB), DB.shape[1]
    for k in range(vectors):
        target, row = DB[k], k * dim + ci
        first, second, N0, N1 = D[row, c, p], D[row, dim + c, p], table[0, p, b], table[1, p, b]
        for e in range(cells):
            target[e] = first[e] * N0[e] + second[e] * N1[e]
        for l in range(2, vectors):
            first, N0 = D[row, l * dim + c, p], table[l, p, b]
            for e in range(cells):
                target[e] += first[e] * N0[e]


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
