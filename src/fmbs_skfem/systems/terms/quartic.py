r"""Quartic energies: the strain energy of planar membranes in reduced coordinates as one
polynomial, every monomial stored once.

    W(x) = sum_{a<=b<=c<=d} T_abcd z_a z_b z_c z_d,    z = (1, x),    f = dW/dx,    K = d2W/dx2

With the products y_ab = z_a z_b a monomial is y_ab y_cd, the pair (a, b) of the two smaller indices
always before (c, d). In the order y = (y_00, y_01, y_11, y_02, ...) the pairs with b <= c are the
first (c + 1)(c + 2)/2, so that the coefficients of one c are a dense block, a row for every d >= c,
without gaps:

    blocks       B_c (d, ab), c = 0..r, behind each other; rows are padded with zeros to a multiple of 8 numbers
    gradient     g = dW/dy:   g_cd += B_c[d] y,   g_ab += sum_d z_c z_d B_c[d];   each coefficient is read once and used twice
    force        f_a = sum_b (1 + delta_ab) g_ab z_b
    energy       W = g y / 2, since W is homogeneous of degree two in y
    tangent      K_ab = (1 + delta_ab) g_ab + sum over rows (c, d) of h e^T + e h^T,   h = d(B_c[d] y)/dz,   e = d y_cd/dz

There are C(r + 4, 4) coefficients, a third of those of the symmetric matrix in y W = y^T P y / 2
for large r; the force takes two multiplications each. Coefficients that start at a multiple of 64
bytes are read fastest: `aligned`.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from ...bodies.laws import Law
from ...core.compiling.entries import view
from ...core.compiling.jit import jit, regrouped
from ...core.compiling.structs import Vector, opener, routine
from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Range, Reals, Sizes, also, require
from ..affine import Affine, Matrix
from ..evaluation import evaluation
from . import elastic as terms
from .elastic import Lifts, Setting, Term, TermRoutines

# 64 bytes, what a processor reads from memory at once: aligned rows begin a line each
LANES = 8  #: numbers of a cache line, to which rows are padded


@storable
@dataclass(frozen=True)
class Quartic:
    """Strain energy [J] of one body as a polynomial of degree 4 in its r unknowns x[columns].

        W(x) = sum_{a<=b<=c<=d} T_abcd z_a z_b z_c z_d,    z = (1, x)

    Coefficients are in the order of the module, t = `length(r)` of them.
    """

    law: ClassVar[Law] = Law.MEMBRANE
    coefficients: Annotated[np.ndarray, Reals("t")]  #: blocks B_c behind each other [J]
    columns: Annotated[slice, Range("r", end="n")]  #: the body's unknowns among all

    @property
    def modes(self) -> int:
        """Number r of its unknowns."""
        return self.columns.stop - self.columns.start


@jit
def padded(count: int) -> int:
    """The least multiple of 8 that is not below `count`: numbers of a row with padding."""
    # zeros at the end of rows, so that every row begins at a multiple of 64 bytes, and no loop has
    # a rest
    return (count + LANES - 1) // LANES * LANES


@jit
def length(modes: int) -> int:
    """Number of stored coefficients of a polynomial in r = `modes` unknowns, padding included.

        sum_c (r + 1 - c) padded((c + 1)(c + 2)/2),    c = 0 ... r

    Without padding there are C(r + 4, 4).
    """
    total = 0
    for c in range(modes + 1):
        total += (modes + 1 - c) * padded((c + 1) * (c + 2) // 2)
    return total


@jit
def work_length(modes: int) -> int:
    """Length of the work vector of `add_force`, `add_tangent` and `energy` in `modes` unknowns."""
    return 4 * padded(modes + 1) + 2 * padded((modes + 1) * (modes + 2) // 2)


@also.register
def _(part: Quartic, name: str, sizes: Sizes) -> None:
    wanted = length(sizes["r"])
    require(
        sizes["t"] == wanted,
        f"{name}.coefficients",
        f"an array ({wanted},) of float64",
        f"{sizes['t']} numbers",
    )


def aligned(size: int) -> np.ndarray:
    """Zeros (size,) that start at a multiple of 64 bytes, from where coefficients are read fastest."""
    room = np.zeros(size + LANES)
    # arrays of numpy may begin anywhere in a line of the cache
    first = -room.ctypes.data // room.itemsize % LANES
    return room[first : first + size]


@regrouped
def add_row(a: np.ndarray, weight: float, y: np.ndarray, g: np.ndarray) -> float:
    """a y, and g += weight a."""
    # both uses of a row while it is in the registers: reading it is what costs
    total = 0.0
    for i in range(len(a)):
        total += a[i] * y[i]
        g[i] += weight * a[i]
    return total


@regrouped
def add_two_rows(
    B: np.ndarray, weights: np.ndarray, y: np.ndarray, g: np.ndarray, products: np.ndarray
) -> None:
    """Products with two rows.

        products = B y,    g += weights B

    B (2, m), y and g (m,).
    """
    a, b = B[0], B[1]
    wa, wb = weights[0], weights[1]
    sa, sb = 0.0, 0.0
    # as eight below, for what is left of a block
    for i in range(len(a)):
        sa += a[i] * y[i]
        sb += b[i] * y[i]
        g[i] += wa * a[i] + wb * b[i]
    products[0], products[1] = sa, sb


@regrouped
def add_eight_rows(
    B: np.ndarray, weights: np.ndarray, y: np.ndarray, g: np.ndarray, products: np.ndarray
) -> None:
    """Products with eight rows.

        products = B y,    g += weights B

    y and g pass through the registers once for all of them.
    """
    a, b, c, d, e, p, q, r = B[0], B[1], B[2], B[3], B[4], B[5], B[6], B[7]
    wa, wb, wc, wd, we, wp, wq, wr = (
        *(weights[0], weights[1], weights[2], weights[3]),
        *(weights[4], weights[5], weights[6], weights[7]),
    )
    sa, sb, sc, sd, se, sp, sq, sr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    # y and g pass through the registers once for eight rows, which they would else for each
    for i in range(len(a)):
        yi = y[i]
        sa += a[i] * yi
        sb += b[i] * yi
        sc += c[i] * yi
        sd += d[i] * yi
        se += e[i] * yi
        sp += p[i] * yi
        sq += q[i] * yi
        sr += r[i] * yi
        g[i] += (
            wa * a[i]
            + wb * b[i]
            + wc * c[i]
            + wd * d[i]
            + we * e[i]
            + wp * p[i]
            + wq * q[i]
            + wr * r[i]
        )
    products[0], products[1], products[2], products[3] = sa, sb, sc, sd
    products[4], products[5], products[6], products[7] = se, sp, sq, sr


@jit
def add_block(
    B: np.ndarray, weights: np.ndarray, y: np.ndarray, g: np.ndarray, products: np.ndarray
) -> None:
    """Products with a block B (d, m), which is read once.

        products = B y,    g += weights B

    y and g (m,), products and weights (d,).
    """
    rows = B.shape[0]
    d = 0
    # eight, two, one: rows of a block are n - c, of any number
    while d + 8 <= rows:
        add_eight_rows(B[d : d + 8], weights[d : d + 8], y, g, products[d : d + 8])
        d += 8
    while d + 2 <= rows:
        add_two_rows(B[d : d + 2], weights[d : d + 2], y, g, products[d : d + 2])
        d += 2
    if d < rows:
        products[d] = add_row(B[d], weights[d], y, g)


@jit
def views(modes: int, work: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """z (n,), y (m,) and g (m,) at the front of the work vector, y and g padded."""
    n = modes + 1
    first, pairs = padded(n), padded(n * (n + 1) // 2)
    # one vector for all terms of a model, whose front they take
    return work[:n], work[first : first + pairs], work[first + pairs : first + 2 * pairs]


@jit
def pair_gradient(T: np.ndarray, x: np.ndarray, work: np.ndarray) -> None:
    """z (r + 1,), y and g = dW/dy of coefficients T (t,) at x (r,), in their places in `work`, see
    `views`.
    """
    n = len(x) + 1
    z, y, g = views(len(x), work)
    spare = work[padded(n) + 2 * len(y) :]
    weights, products = spare[:n], spare[padded(n) : padded(n) + n]
    z[0] = 1.0
    z[1:] = x
    y[:], g[:] = 0.0, 0.0
    k = 0
    for b in range(n):
        for a in range(b + 1):
            # pairs in the order of the blocks, so that each block reads the front of y
            y[k] = z[a] * z[b]
            k += 1
    at = 0
    for c in range(n):
        size = padded((c + 1) * (c + 2) // 2)
        B = T[at : at + (n - c) * size].reshape(n - c, size)
        at += B.size
        for d in range(c, n):
            weights[d - c] = z[c] * z[d]
        add_block(B, weights, y[:size], g[:size], products)
        # the other half of the derivative: what the products say of the pairs (c, d)
        for d in range(c, n):
            g[d * (d + 1) // 2 + c] += products[d - c]


@jit
def energy(T: np.ndarray, x: np.ndarray, work: np.ndarray) -> float:
    """Strain energy W [J] of coefficients T (t,) at x (r,).

        W = g . y / 2,    g = dW/dy of the products y_ab = z_a z_b

    `work` is room for `work_length(r)` numbers.
    """
    # homogeneous of degree two in y: no second sum over coefficients
    pair_gradient(T, x, work)
    _, y, g = views(len(x), work)
    total = 0.0
    for k in range(len(y)):
        total += 0.5 * g[k] * y[k]
    return total


@jit
def pair_slope(row: np.ndarray, z: np.ndarray, c: int, h: np.ndarray) -> None:
    """Derivative of a row of y by the unknowns.

        h = d(row y)/dz

    h (c + 1,).
    """
    k = 0
    for b in range(c + 1):
        total = 0.0
        # a row of the triangle, used for both of its unknowns
        part = row[k : k + b]
        for a in range(b):
            total += part[a] * z[a]
            h[a] += part[a] * z[b]
        h[b] = total + 2.0 * row[k + b] * z[b]
        k += b + 1


@jit
def add_force(T: np.ndarray, x: np.ndarray, work: np.ndarray, f: np.ndarray) -> None:
    """f (r,) += dW/dx of coefficients T (t,) at x (r,).

        f_a = sum_b (1 + delta_ab) g_ab z_b,    g = dW/dy

    `work` is room for `work_length(r)` numbers.
    """
    pair_gradient(T, x, work)
    n = len(x) + 1
    z, y, g = views(len(x), work)
    # the products have been used: their place takes the slope
    slope = work[padded(n) + 2 * len(y) :][:n]
    pair_slope(g, z, len(x), slope)
    for i in range(len(x)):
        f[i] += slope[i + 1]


@jit
def add_pair(W: np.ndarray, i: int, h: np.ndarray, factor: float, count: int) -> None:
    """Add a product of rank two.

        W += factor (e_i h^T + h e_i^T)

    over the unknowns, of which z_0 = 1 is none.
    """
    # z_0 = 1 is no unknown
    if i > 0:
        for a in range(1, count):
            W[i - 1, a - 1] += factor * h[a]
            W[a - 1, i - 1] += factor * h[a]


@jit
def add_tangent(T: np.ndarray, x: np.ndarray, work: np.ndarray, W: np.ndarray) -> None:
    """W (r, r) += d2W/dx2, both triangles, of coefficients T (t,) at x (r,).

        K_ab = (1 + delta_ab) g_ab + sum over rows (c, d) of h e^T + e h^T,   h = d(B_c[d] y)/dz,   e = d y_cd/dz

    `work` is room for `work_length(r)` numbers.
    """
    pair_gradient(T, x, work)
    n = len(x) + 1
    z, y, g = views(len(x), work)
    h = work[padded(n) + 2 * len(y) :][:n]
    at = 0
    for c in range(n):
        size = padded((c + 1) * (c + 2) // 2)
        for d in range(c, n):
            # by rows again, which come from memory in order: the tangent reads coefficients once,
            # as the force does
            pair_slope(T[at : at + size], z, c, h)
            add_pair(W, c, h, z[d], c + 1)
            add_pair(W, d, h, z[c], c + 1)
            at += size
    for b in range(1, n):
        k = b * (b + 1) // 2
        for a in range(1, b):
            W[b - 1, a - 1] += g[k + a]
            W[a - 1, b - 1] += g[k + a]
        W[b - 1, b - 1] += 2.0 * g[k + b]


class QuarticRecord(NamedTuple):
    """A polynomial for compiled code."""

    coefficients: Vector
    first: int  #: of the unknowns
    modes: int


opened = opener(QuarticRecord)


@routine
def call_energy(table: Any, record: Any) -> int:
    """`energy` as a term."""
    s = evaluation(table).space
    Q = opened(record)
    # coefficients are all that is read: no points, no law, no training
    s.energy[0] += energy(Q.coefficients, view(s.x, Q.first, (Q.modes,)), s.work[0])
    return 0


@routine
def call_force(table: Any, record: Any) -> int:
    """`add_force` as a term."""
    s = evaluation(table).space
    Q = opened(record)
    add_force(
        Q.coefficients, view(s.x, Q.first, (Q.modes,)), s.work[0], view(s.f, Q.first, (Q.modes,))
    )
    return 0


@routine
def call_tangent(table: Any, record: Any) -> int:
    """`add_tangent` as a term."""
    s = evaluation(table).space
    Q = opened(record)
    last = Q.first + Q.modes
    add_tangent(
        Q.coefficients,
        view(s.x, Q.first, (Q.modes,)),
        s.work[0],
        s.W[Q.first : last, Q.first : last],
    )
    return 0


ROUTINES = TermRoutines(call_force, call_tangent, call_energy)


@terms.carry.register(Quartic)
def carry(polynomial: Quartic, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Quartic:
    """Refused: its coefficients are those of its unknowns."""
    remedy = "reduce the system before its polynomials are made"
    raise InputError(say(f"body '{name}'", "cells or sampled points", "a polynomial", remedy))


@terms.split.register(Quartic)
def split(polynomial: Quartic, lifts: Lifts) -> list[Quartic]:
    """One piece."""
    return [polynomial]


@terms.compile_term.register(Quartic)
def compile_term(polynomial: Quartic, setting: Setting) -> Term:
    """Its coefficients where they are read fastest."""
    coefficients = aligned(polynomial.coefficients.size)
    coefficients[:] = polynomial.coefficients
    modes = polynomial.modes
    return Term(
        QuarticRecord(coefficients, polynomial.columns.start, modes),
        ROUTINES,
        int(work_length(modes)),
    )
