r"""Compiled pieces of an evaluation: products of constant matrices, constraints and their
derivatives on probe rows.

Sparse matrices are (indptr, indices, data); y = P x + y0 are the probe rows, which joints and loads
read.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.compiling.jit import deferred, jit
from ..core.compiling.structs import IntegerMatrix, Integers, Matrix, Vector


class Csr(NamedTuple):
    """A sparse matrix (m, n) inside compiled code, the columns of every row in order: indptr (m +
    1,), indices and data (z,).
    """

    indptr: Integers
    indices: Integers
    data: Vector


class Operator(NamedTuple):
    """A constant symmetric matrix in the storage that its product is fastest in; the other storages
    are empty.

        diagonals[k, i] = A[i, i + offsets[k]]

    for bands, `rows` for sparse systems, `store` for dense ones. `rows` holds one row for
    `components` unknowns where A = rows (x) identity, which reads less memory. `store` is also what
    the iteration matrix adds: lower band (n, d+1) or dense (n, n); it has no rows for sparse
    systems.
    """

    offsets: Integers
    diagonals: Matrix
    rows: Csr
    components: int
    store: Matrix
    full: bool  #: the product reads `store`


class Terms(NamedTuple):
    """t terms of `systems.system.Constraints`.

        value s(t) y_i y_j

    `pair` is the first probe pair of a term with second derivatives, -1 of others.
    """

    row: Integers
    value: Vector
    signal: Integers
    i: Integers
    j: Integers
    pair: Integers


class Pairs(NamedTuple):
    """Pairs of probe rows with second derivatives H (h,)."""

    rows: IntegerMatrix  #: (h, 2), none where W is sparse
    size: int  #: h
    skew: bool  #: whether H is not symmetric by far, as of friction


@jit
def clear(x: np.ndarray) -> None:
    """x (n,) = 0, in place."""
    # loops of numbers and no slices, here and below: the compiler makes one instruction of several
    # of them
    for i in range(len(x)):
        x[i] = 0.0


@jit
def clear_rows(A: np.ndarray) -> None:
    """A (m, n) = 0, in place."""
    for i in range(A.shape[0]):
        # the last index is the inner one, along the memory
        for j in range(A.shape[1]):
            A[i, j] = 0.0


@jit
def copy(x: np.ndarray, y: np.ndarray) -> None:
    """y = x (n,), without the check of lengths whose message would be compiled, too."""
    # the message of unequal lengths alone took 1.7 s of the compilation of the survey of energies
    for i in range(len(x)):
        y[i] = x[i]


dot = deferred("fmbs_skfem.core.compiling.intrinsics", "dot")
dot_four = deferred("fmbs_skfem.core.compiling.intrinsics", "dot_four")


@jit
def unbroken(A: Csr, start: int, stop: int) -> bool:
    """Whether entries of a row, in order, stand side by side, and are so many that it pays to know."""
    # fewer do not fill a vector of four numbers
    return stop - start > 3 and A.indices[stop - 1] - A.indices[start] == stop - start - 1


@jit
def row_value(A: Csr, i: int, x: np.ndarray) -> float:
    """(A x)_i of a sparse A (m, n) and x (n,), of one row here and there.

    Called for every row of a product, it would cost a tenth of a step.
    """
    total = 0.0
    start = A.indptr[i]
    stop = A.indptr[i + 1]
    # rows of dense bases are unbroken: no index is read
    if unbroken(A, start, stop):
        first = A.indices[start]
        total = dot(A.data[start:stop], x[first : first + stop - start])
    else:
        for k in range(start, stop):
            total += A.data[k] * x[A.indices[k]]
    return total


@jit
def row_sizes(A: Csr, rows: np.ndarray, first: int, count: int) -> tuple[float, float]:
    """Bounds of products with some rows of A (m, n), `count` of them from place `first` on.

        |A x| / |x|,    |A x| / max |x_n|

    The first is the root of the sum of squares of these rows, the second that of the squares of
    their sums of sizes.
    """
    squares, sums = 0.0, 0.0
    # both bounds, as either may be the sharper one: many unknowns that move a little, or few that
    # move far
    for c in range(first, first + count):
        total = 0.0
        for p in range(A.indptr[rows[c]], A.indptr[rows[c] + 1]):
            squares += A.data[p] * A.data[p]
            total += abs(A.data[p])
        sums += total * total
    return np.sqrt(squares), np.sqrt(sums)


@jit
def add_product(A: Csr, factor: float, x: np.ndarray, y: np.ndarray) -> None:
    """Add a product with a sparse matrix.

        y += factor A x

    A (m, n), x (n,), y (m,).
    """
    # `row_value` written out: called for every row it cost 8 to 10 % of a step (double pendulum,
    # 2000 steps: 0.176 s for 0.166 s)
    for i in range(len(A.indptr) - 1):
        total = 0.0
        start = A.indptr[i]
        stop = A.indptr[i + 1]
        if start == stop:
            continue  # as most probe rows of contacts
        if unbroken(A, start, stop):
            first = A.indices[start]
            total = dot(A.data[start:stop], x[first : first + stop - start])
        else:
            for k in range(start, stop):
                total += A.data[k] * x[A.indices[k]]
        y[i] += factor * total


@jit
def add_pairwise(A: Csr, x: np.ndarray, y: np.ndarray) -> None:
    """Add a product for vectors of two components.

        y += (A (x) I) x

    A (m, n), x (2 n,), y (2 m,).
    """
    # an index and a number are read once for two components: half the memory of all rows
    for i in range(len(A.indptr) - 1):
        first, second = 0.0, 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            j = 2 * A.indices[k]
            value = A.data[k]
            first += value * x[j]
            second += value * x[j + 1]
        y[2 * i] += first
        y[2 * i + 1] += second


@jit
def add_triplewise(A: Csr, x: np.ndarray, y: np.ndarray) -> None:
    """Add a product for vectors of three components.

        y += (A (x) I) x

    A (m, n), x (3 n,), y (3 m,).
    """
    # likewise, a third of it
    for i in range(len(A.indptr) - 1):
        first, second, third = 0.0, 0.0, 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            j = 3 * A.indices[k]
            value = A.data[k]
            first += value * x[j]
            second += value * x[j + 1]
            third += value * x[j + 2]
        y[3 * i] += first
        y[3 * i + 1] += second
        y[3 * i + 2] += third


@jit
def add_operator(A: Operator, x: np.ndarray, y: np.ndarray) -> None:
    """Add a product with a constant matrix in any of its storages.

        y += A x

    A (n, n), x and y (n,).
    """
    # the form was chosen once, when the system was compiled; empty operators fall through loops of
    # no length
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
    # by diagonals: every one is a vector loop over all unknowns, where rows of a band are a dozen
    # numbers
    for k in range(len(A.offsets)):
        shift = A.offsets[k]
        first = max(0, -shift)
        size = n - abs(shift)
        row = A.diagonals[k, first : first + size]
        source = x[first + shift : first + shift + size]
        target = y[first : first + size]
        for i in range(size):
            target[i] += row[i] * source[i]


@jit
def add_transposed(A: Csr, factor: float, y: np.ndarray, x: np.ndarray) -> None:
    """Add a product with the transpose of a sparse matrix.

        x += factor A^T y

    A (m, n), x (n,), y (m,).
    """
    for i in range(len(A.indptr) - 1):
        value = factor * y[i]
        start = A.indptr[i]
        stop = A.indptr[i + 1]
        # forces of contacts that are open, and rows that are off
        if value == 0.0:
            continue
        if unbroken(A, start, stop):
            row = A.data[start:stop]
            part = x[A.indices[start] :]
            for k in range(len(row)):
                part[k] += row[k] * value
        else:
            for k in range(start, stop):
                x[A.indices[k]] += A.data[k] * value


@jit
def affine(A: Csr, offset: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """An affine map by a sparse matrix.

        y = A x + offset

    A (m, n), x (n,), y and offset (m,).
    """
    for i in range(len(y)):
        # the offset first, so that the product adds to it
        y[i] = offset[i]
    add_product(A, 1.0, x, y)


@jit
def distances(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Differences of two vectors, no numbers where one of x or y is none.

        |x - y|,    max |x_i - y_i|

    x and y (n,).
    """
    square, most = 0.0, 0.0
    for i in range(len(x)):
        d = abs(x[i] - y[i])
        square += d * d
        # a maximum that NaN passes by; the square below carries it into both numbers
        most = d if d > most else most
    return np.sqrt(square), most + 0.0 * square


@jit
def add_combination(rows: np.ndarray, factors: np.ndarray, y: np.ndarray) -> None:
    """Add a linear combination of rows; four at a time, for sizes where a library call costs more
    than the sum.

        y_i += sum_r factors_r rows_ri
    """
    # y is read and written once for four rows
    full = len(factors) // 4 * 4
    for r in range(0, full, 4):
        a, b, c, d = factors[r], factors[r + 1], factors[r + 2], factors[r + 3]
        row_a, row_b, row_c, row_d = rows[r], rows[r + 1], rows[r + 2], rows[r + 3]
        for i in range(len(y)):
            y[i] += row_a[i] * a + row_b[i] * b + row_c[i] * c + row_d[i] * d
    for r in range(full, len(factors)):
        row_a = rows[r]
        a = factors[r]
        for i in range(len(y)):
            y[i] += row_a[i] * a


@jit
def add_sums(rows: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Add products with rows.

        y_r += sum_i rows_ri x_i

    x (i,), y (r,).
    """
    # x is read once for four sums, which do not wait for each other: 0.55 us for 0.76 us (23 rows
    # of 324 numbers)
    full = len(y) // 4 * 4
    for r in range(0, full, 4):
        a, b, c, d = dot_four(rows[r], rows[r + 1], rows[r + 2], rows[r + 3], x)
        y[r] += a
        y[r + 1] += b
        y[r + 2] += c
        y[r + 3] += d
    for r in range(full, len(y)):
        y[r] += dot(rows[r], x)


@jit
def factor(signals: np.ndarray, number: int) -> float:
    """The value of a signal of this number among signals (s,); 1 for the number -1."""
    # -1 in place of a signal that is 1: constant terms need no column in every table of a run
    return signals[number] if number >= 0 else 1.0


@jit
def derivative(signals: np.ndarray, number: int, first: int) -> float:
    """A derivative of a signal of this number, which stand from `first` on in signals (4 s,); 0 for
    the number -1.
    """
    # derivatives stand behind the values of all signals, where velocities on driven joints need
    # them
    return signals[first + number] if number >= 0 else 0.0


@jit
def constrain(
    A: Terms, y: np.ndarray, signals: np.ndarray, gap: np.ndarray, jacobian: np.ndarray
) -> None:
    """Constraints and their derivatives of the terms A at probe rows y (j,), with signals (s,).

        gap = Phi,    jacobian = dPhi/dy

    gap (m,) and jacobian (m, j) are overwritten.
    """
    clear(gap)
    clear_rows(jacobian)
    for k in range(len(A.row)):
        a, b = add_term(A, k, y, signals, gap)
        # -1 for a factor that a term does not have; sums, as several terms of a row may read one
        # probe
        if A.i[k] >= 0:
            jacobian[A.row[k], A.i[k]] += a
        if A.j[k] >= 0:
            jacobian[A.row[k], A.j[k]] += b


@jit
def add_term(
    A: Terms, k: int, y: np.ndarray, signals: np.ndarray, gap: np.ndarray
) -> tuple[float, float]:
    """gap (m,) += term k at probe rows y (j,), with signals (s,); its derivatives by y_i and y_j."""
    # value and both derivatives at once: they share their products
    value = A.value[k] * factor(signals, A.signal[k])
    m = A.row[k]
    i = A.i[k]
    j = A.j[k]
    if i < 0:
        gap[m] += value
        return 0.0, 0.0
    if j < 0:
        gap[m] += value * y[i]
        return value, 0.0
    gap[m] += value * y[i] * y[j]
    return value * y[j], value * y[i]


@jit
def drift(
    A: Terms, paths: np.ndarray, signals: np.ndarray, second: float, third: float, out: np.ndarray
) -> None:
    """Rates of constraints, out (m,), with D_k the part of d^k Phi/dt^k without Phi_y times the
    k-th derivative of y.

        out = Phi_y z + D1 + second D2 + third D3

    `paths` (4, j) are y, z, v = dy/dt and a = dv/dt of the probe rows; `signals` holds the values
    of all signals, then their first, second and third derivatives, where a constraint reads one. A
    term s(t) p(y), p = y_i y_j, with the derivatives s1, s2, s3 and p1, p2 by time has

        D1 = s1 p,   D2 = s2 p + 2 s1 p1 + 2 s v_i v_j,   D3 = s3 p + 3 s2 p1 + 3 s1 p2 + 3 s (v_i a_j + a_i v_j)
    """
    clear(out)
    y = paths[0]
    z = paths[1]
    v = paths[2]
    a = paths[3]
    many = len(signals) // 4
    for k in range(len(A.row)):
        m = A.row[k]
        i = A.i[k]
        j = A.j[k]
        signal = A.signal[k]
        # derivatives of signals are read where there are some: systems without drives have no
        # columns for them
        s = A.value[k]
        s1 = 0.0
        s2 = 0.0
        s3 = 0.0
        if signal >= 0:
            s1, s2, s3 = (
                s * signals[many + signal],
                s * signals[2 * many + signal],
                s * signals[3 * many + signal],
            )
            s *= signals[signal]
        # p = 1 of a term without probes, a history by itself
        p, pz, p1, p2, twice, mixed = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if j >= 0:
            p = y[i] * y[j]
            pz = y[i] * z[j] + z[i] * y[j]
            p1 = y[i] * v[j] + v[i] * y[j]
            twice, mixed = 2.0 * v[i] * v[j], 3.0 * (v[i] * a[j] + a[i] * v[j])
            p2 = y[i] * a[j] + a[i] * y[j] + twice
        elif i >= 0:
            p = y[i]
            pz = z[i]
            p1 = v[i]
            p2 = a[i]
        out[m] += s * (pz + second * twice + third * mixed)
        if signal >= 0:
            out[m] += (
                s1 * p
                + second * (s2 * p + 2.0 * s1 * p1)
                + third * (s3 * p + 3.0 * (s2 * p1 + s1 * p2))
            )


@jit
def probe_paths(
    A: Csr,
    offset: np.ndarray,
    x: np.ndarray,
    z: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    paths: np.ndarray,
) -> None:
    """Probe rows and three of their rates, a row of A read once.

        paths = A x + offset,  A z,  A v,  A a

    paths (4, j).
    """
    for i in range(len(offset)):
        # only the first is a place: rates have no offset
        p = offset[i]
        q = 0.0
        r = 0.0
        s = 0.0
        for k in range(A.indptr[i], A.indptr[i + 1]):
            value = A.data[k]
            n = A.indices[k]
            p += value * x[n]
            q += value * z[n]
            r += value * v[n]
            s += value * a[n]
        paths[0, i], paths[1, i], paths[2, i], paths[3, i] = p, q, r, s


@jit
def constraint_slopes(
    A: Terms, y: np.ndarray, signals: np.ndarray, multipliers: np.ndarray, H: np.ndarray
) -> None:
    """Second derivatives of the terms A at probe rows y (j,), with signals (s,) and multipliers
    lambda (m,).

        H[pair] += d(Phi_y^T lambda)/dy

    A term lambda c s y_i y_j has c s lambda in its pairs (i, j) and (j, i).
    """
    for k in range(len(A.row)):
        if A.pair[k] >= 0:
            value = A.value[k] * factor(signals, A.signal[k]) * multipliers[A.row[k]]
            # d2(y_i y_j) at ij and ji; terms of one factor have none
            H[A.pair[k]] += value
            H[A.pair[k] + 1] += value


@jit
def add_pairs(A: Pairs, P: Csr, H: np.ndarray, dense: bool, blocks: Csr, W: np.ndarray) -> None:
    """Add second derivatives of the probe pairs. Most contacts are open: their H is zero.

        W += P^T H P

    A lower band takes the symmetric part, and so does W (1, k) by the rows of its upper triangle
    with the columns of `blocks`.
    """
    for k in range(len(A.rows)):
        # of all pairs only those of joints and of what touches now
        if H[k] == 0.0:
            continue
        a, b = A.rows[k, 0], A.rows[k, 1]
        for p in range(P.indptr[a], P.indptr[a + 1]):
            i = P.indices[p]
            value = H[k] * P.data[p]
            for q in range(P.indptr[b], P.indptr[b + 1]):
                j = P.indices[q]
                if dense:
                    W[i, j] += value * P.data[q]
                    continue
                # pairs come both ways, so that each gives half of an entry off the diagonal
                low = min(i, j)
                part = (1.0 if i == j else 0.5) * value * P.data[q]
                if len(blocks.indptr) > 1:
                    start = blocks.indptr[low]
                    # a search in one short row in place of a table of places for all pairs, most of
                    # which are open
                    W[
                        0,
                        start
                        + np.searchsorted(
                            blocks.indices[start : blocks.indptr[low + 1]], max(i, j)
                        ),
                    ] += part
                else:
                    W[low, abs(i - j)] += part


@jit
def any_of(x: np.ndarray) -> bool:
    """Whether a number of x (n,) is not zero."""
    found = False
    # over all derivatives on pairs: nearly always all of them are zero where contacts are open
    for i in range(len(x)):
        found = found or x[i] != 0.0
    return found


@jit
def add_skew_pairs(A: Pairs, P: Csr, H: np.ndarray, general: np.ndarray) -> None:
    """Add the skew part of second derivatives H (h,) to a general band (n, 3d+1) as LAPACK has it.

        skew(P^T H P)

    with the probe rows P (j, n).
    """
    middle = 2 * ((general.shape[1] - 1) // 3)
    for k in range(len(A.rows)):
        if H[k] == 0.0:
            continue
        a, b = A.rows[k, 0], A.rows[k, 1]
        for p in range(P.indptr[a], P.indptr[a + 1]):
            # the symmetric half is in the band already
            i = P.indices[p]
            value = 0.5 * H[k] * P.data[p]
            for q in range(P.indptr[b], P.indptr[b + 1]):
                j = P.indices[q]
                general[j, middle + i - j] += value * P.data[q]
                general[i, middle + j - i] -= value * P.data[q]
