"""Points of reduced bodies as terms, in Kronecker form: shape functions N (b) act on every
component of vectors alike.

    u[(k, c), p] = sum_b N[k, p, b] z[b, c],     z = (lift x)[columns] or A x + a,     f = A^T N^T phi(u)
    W[(b, c), (d, g)] += sum_p,k,l N[k, p, b] phi'[(k, c), (l, g), p] N[l, p, d]

A reduced body of m functions has m c unknowns. Gather and scatter cost c times less, the tangent
more than twice less, than rows of as many dense modes: only the lower half of the (c, g) is there,
and each product is one of m columns.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...bodies import laws
from ...bodies.body import Cells, ShapePoints
from ...bodies.laws import Law
from ...core.algebra.linalg import as_dense, is_sparse, support
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import Cube, Integers, opener, routine
from ...core.compiling.structs import Matrix as Rows
from ..affine import Affine, Matrix
from ..evaluation import evaluation
from ..kernels import add_combination, add_sums, clear
from . import elastic as terms
from . import turned_tangents
from .cells import put
from .elastic import Lifts, Setting, Targets, Term
from .points import Sampled, dense_rows, weigh

ROUND = 1e-12  #: values of a function, over those of the largest, that are round-off


class ShapePointsRecord(NamedTuple):
    """Points of a body for compiled code."""

    calls: Integers  #: addresses of the law's functions, see `laws.addresses`
    beta: float  #: stiffness-proportional damping time [s]
    first: int  #: of the coordinates
    table: Rows  #: (k p, b)
    transposed: Rows  #: (b, k p)
    section: Cube  #: (i, 1, p)
    targets: Targets
    kept: int  #: first place in the gradients of a space, see `elastic.first_kept`
    gram: Rows  #: (b, b) of first derivatives where its tangent turns with the body, else (0, 0)
    turned: int  #: first place in what a space keeps of turned tangents


opened = opener(ShapePointsRecord)


@jit
def place(P: Any, target: np.ndarray, at: int) -> np.ndarray:
    """An array (k c, 1, p) from a place of `target` on."""
    points = P.section.shape[2]
    # a view: no array is made in a step
    return view(target, at, (P.transposed.shape[1] // points * laws.components(P.calls), 1, points))


@jit
def read(s: Any, P: Any, order: int, target: np.ndarray, at: int) -> np.ndarray:
    """Gradients (k c, 1, p) from the coordinates of all cells, or their rates."""
    (functions, size) = P.transposed.shape
    points = P.section.shape[2]
    dim = laws.components(P.calls)
    vectors = size // points
    u = place(P, target, at)
    q = s.cell_x if order == 0 else s.cell_v
    part, values = view(s.work[0], u.size, (size,)), view(s.work[0], u.size + size, (functions,))
    for c in range(dim):
        clear(part)
        for b in range(functions):
            # one component after the other: N serves all of them, so that it is read with a third
            # of the unknowns at a time
            values[b] = q[P.first + b * dim + c]
        add_combination(P.transposed, values, part)
        for k in range(vectors):
            for p in range(points):
                # into the order of laws, component by component
                u[k * dim + c, 0, p] = part[k * points + p]
    return u


@jit
def scatter(s: Any, P: Any, S: np.ndarray) -> None:
    """Add forces on the coordinates of the cells.

        f[b, c] += sum_kp N[k, p, b] S[(k, c), p]

    of stresses S (k c, p).
    """
    (functions, size) = P.transposed.shape
    points = S.shape[2]
    dim = laws.components(P.calls)
    f = s.cell_f
    part, values = view(s.work[0], 0, (size,)), view(s.work[0], size, (functions,))
    for c in range(dim):
        for k in range(size // points):
            for p in range(points):
                # out of the order of laws, as `read` put it in
                part[k * points + p] = S[k * dim + c, 0, p]
        clear(values)
        add_sums(P.transposed, part, values)
        for b in range(functions):
            f[P.first + b * dim + c] += values[b]


@jit
def add_tangent(s: Any, P: Any, D: np.ndarray) -> None:
    """Add the matrix of points in the places of `targets`.

        W += N^T D N

    of moduli D (k c, k c, 1, p).
    """
    dim = laws.components(P.calls)
    (functions, size) = P.transposed.shape
    (rows, _, _, points) = D.shape
    DN = view(s.work[2], 0, (size, dim * (dim + 1) // 2, functions))
    modulus_times_functions(
        view(D, 0, (rows, rows, points)),
        P.table.reshape(size // points, points, functions),
        dim,
        DN,
    )
    # one product for all pairs (c, g) of components, six in space in place of nine
    product = np.dot(P.transposed, view(s.work[2], 0, (size, DN.shape[1] * functions)))
    entries = packed(product, functions, dim, s.work[0])
    if len(P.gram) > 0:
        # before it is put into W, where other terms are, too
        turned_tangents.keep(s, P, entries)
    put(P.targets, entries, s.entries)


@jit
def modulus_times_functions(D: np.ndarray, table: np.ndarray, dim: int, DN: np.ndarray) -> None:
    """Products of moduli with functions.

        DN[(k, p), (c, g), d] = sum_l D[(k, c), (l, g), p] table[l, p, d]

    for g <= c.
    """
    vectors, points, functions = table.shape
    for k in range(vectors):
        for p in range(points):
            at = 0
            for c in range(dim):
                for g in range(c + 1):
                    target = DN[k * points + p, at]
                    a = D[k * dim + c, g, p]
                    b = D[k * dim + c, dim + g, p]
                    first, second = table[0, p], table[1, p]
                    for d in range(functions):
                        # the first two write, so that DN is not cleared
                        target[d] = a * first[d] + b * second[d]
                    for l in range(2, vectors):
                        a = D[k * dim + c, l * dim + g, p]
                        first = table[l, p]
                        for d in range(functions):
                            target[d] += a * first[d]
                    at += 1


@jit
def packed(product: np.ndarray, functions: int, dim: int, room: np.ndarray) -> np.ndarray:
    """Lower triangle of the matrix (b c, b c) in the front of `room`, row by row, from its blocks
    product[b, (c, g), d], g <= c.
    """
    at = 0
    for b in range(functions):
        for c in range(dim):
            for d in range(b + 1):
                for g in range(c + 1 if d == b else dim):
                    # the other half by symmetry, from the block of (d, b)
                    if g <= c:
                        room[at] = product[b, (c * (c + 1) // 2 + g) * functions + d]
                    else:
                        room[at] = product[d, (g * (g + 1) // 2 + c) * functions + b]
                    at += 1
    return room


ASSEMBLED = terms.at_points(__name__, opened, place, read, scatter, add_tangent)
assemble_tangent: Any = ASSEMBLED.tangent


@routine
def tangent(table: Any, record: Any) -> int:
    """Tangent of points.

        W += N^T phi' N

    or what was kept of it when it was assembled last, turned with the body.
    """
    s = evaluation(table).space
    P = opened(record)
    # a tenth of an assembly: a plate thrown round at a corner takes 0.6 of the time
    if len(P.gram) > 0 and s.turning[0] == 1:
        put(P.targets, turned_tangents.turned(s, P), s.entries)
        return 0
    return assemble_tangent(table, record)


ROUTINES = ASSEMBLED._replace(tangent=tangent)


@terms.carry.register(ShapePoints)
def carry(
    points: ShapePoints, name: str, lift: Affine, V: Matrix, d: np.ndarray
) -> ShapePoints | Sampled:
    """Sparse V leaves points in coordinates of the body; dense V multiplies them out to rows by
    modes.
    """
    if points.matrix is None:
        return (
            points
            if is_sparse(V)
            else rows_by_modes(points, lift.matrix[points.columns], lift.offset[points.columns])
        )
    matrix = points.matrix @ V
    offset = points.offset + points.matrix @ d
    return (
        replace(points, matrix=csr_array(matrix), offset=offset)
        if is_sparse(V)
        else rows_by_modes(points, matrix, offset)
    )


def rows_by_modes(points: ShapePoints, matrix: Matrix, offset: np.ndarray) -> Sampled:
    """Rows (derivative, component, point) by modes, for coordinates matrix (b c, n) @ x + offset of
    the body.
    """
    rows = component_rows(points)
    columns = support(as_dense(matrix))
    gradients = np.ascontiguousarray(rows @ as_dense(matrix[:, columns]))
    return Sampled(points.law, gradients, rows @ offset, points.section, columns, points.cell)


def component_rows(points: ShapePoints) -> np.ndarray:
    """Rows (k c p, b c) of the gradients on all coordinates of the body."""
    K, P, B = points.table.shape
    rows = np.einsum("kpb,cg->kcpbg", points.table, np.eye(points.dim))
    return np.asarray(rows.reshape(K * points.dim * P, B * points.dim))


@dense_rows.register(ShapePoints)
def _(points: ShapePoints) -> Sampled:
    """On the unknowns, or on the coordinates of the body where those of all bodies are the
    unknowns.
    """
    n = points.table.shape[2] * points.dim
    if points.matrix is None:
        return replace(rows_by_modes(points, np.eye(n), np.zeros(n)), columns=points.columns)
    return rows_by_modes(points, points.matrix, points.offset)


@terms.unknowns.register(ShapePoints)
def unknowns(points: ShapePoints) -> slice:
    """Those of its matrix."""
    return points.columns if points.matrix is None else support(as_dense(points.matrix))


@terms.choose_points.register(ShapePoints)
def choose_points(points: ShapePoints, kept: np.ndarray, factors: np.ndarray) -> ShapePoints:
    """Table and section of these points."""
    table = np.ascontiguousarray(points.table[:, kept])
    section = weigh(points.section, kept, factors)
    positions = points.positions[kept] if points.positions.size else points.positions
    return replace(
        points, table=table, section=section, cell=points.cell[kept], positions=positions
    )


def of_cells(cells: Cells, functions: np.ndarray) -> ShapePoints:
    """All quadrature points of cells, p e of them, for shape functions (b, m) over the functions b
    that the cells read.

        N[(k, f), (p, e), m] = sum_b table[k, p, b, e] functions[field f of node b in e, m]

    Points are in the order (p, e); they read the coordinates 0 ... m c - 1 of their body.
    """
    (_, P, _, E) = cells.table.shape
    fields = cells.law.fields
    dim = cells.dim // fields
    read = cells.nodes // dim + np.arange(fields)[:, None, None]
    # tables multiplied out once: a step reads b functions of the body, and no cells
    table = np.einsum("kpbe,fbea->kfpea", cells.table, functions[read], optimize=True)
    return ShapePoints(
        cells.law,
        np.ascontiguousarray(table.reshape(cells.law.vectors, P * E, -1)),
        slice(0, functions.shape[1] * dim),
        dim,
        cells.section.reshape(len(cells.section), 1, P * E),
        np.tile(np.arange(E), P),
    )


@terms.split.register(ShapePoints)
def split(points: ShapePoints, lifts: Lifts) -> list[ShapePoints]:
    """One piece."""
    if points.matrix is None:
        start = lifts.place(None) + points.columns.start
    else:
        start = lifts.add(points.matrix, points.offset)
    return [
        replace(points, columns=slice(start, start + points.columns.stop - points.columns.start))
    ]


@terms.couplings.register(ShapePoints)
def couplings(points: ShapePoints) -> np.ndarray:
    """All coordinates of the body, (b c, 1)."""
    return np.arange(points.columns.start, points.columns.stop)[:, None]


@terms.stiffened.register(ShapePoints)
def stiffened(points: ShapePoints) -> np.ndarray:
    """Those of functions that are not zero at all points, as third axes of hinged rims are."""
    size = np.abs(points.table).max(axis=(0, 1))
    read = np.repeat(size > ROUND * size.max(), points.dim)
    return np.arange(points.columns.start, points.columns.stop)[read]


@terms.compile_term.register(ShapePoints)
def compile_term(points: ShapePoints, setting: Setting) -> Term:
    """Its numbers by rows and by columns, and the places of its matrix."""
    calls = laws.addresses(points.law, setting.dim, setting.beta > 0.0)
    K, P, B = points.table.shape
    table = np.ascontiguousarray(points.table.reshape(K * P, B))
    dim = setting.dim
    damped = setting.beta > 0.0
    # only shells are far stiffer in their plane than across, so that a small rotation asks for a
    # new tangent
    turns = points.law is Law.SHELL
    record = ShapePointsRecord(
        calls=calls,
        beta=setting.beta,
        first=points.columns.start,
        table=table,
        transposed=np.ascontiguousarray(table.T),
        section=np.ascontiguousarray(points.section),
        targets=setting.targets(couplings(points)),
        kept=terms.first_kept(points.law, setting),
        gram=gram_of(points) if turns else np.zeros((0, 0)),
        turned=setting.turned,
    )
    work = max(
        (K * dim) ** 2 * P,
        K * dim * P + K * P + B,
        K * P * B * dim * (dim + 1) // 2,
        B * dim * (B * dim + 1) // 2,
    )
    kept = turned_tangents.room(B) if turns else 0
    return Term(
        record,
        ROUTINES,
        work,
        damped,
        terms.count_kept(points.law, K * P * dim, setting),
        turned=kept,
    )


def gram_of(points: ShapePoints) -> np.ndarray:
    """Gram matrix (b, b) of a surface.

        G = sum_p w (N,1 N,1^T + N,2 N,2^T)

    so that the turn of a body shows in z'^T G z.
    """
    weight = points.section[-1, 0]
    return np.ascontiguousarray(sum(N.T @ (weight[:, None] * N) for N in points.table[:2]))


@terms.rotation_weights.register(ShapePoints)
def rotation_weights(points: ShapePoints, q: np.ndarray) -> np.ndarray:
    """By tables of the body; zeros for others."""
    G = np.zeros(len(q))
    G[points.columns] = (gram_of(points) @ q[points.columns].reshape(-1, points.dim)).ravel()
    return G.reshape(-1, points.dim)


@terms.functions_read.register(ShapePoints)
def functions_read(points: ShapePoints, size: int) -> csr_array:
    """All functions of the body, in one row; no rows where it reads the unknowns of a reduced
    model.
    """
    if points.matrix is not None:
        return csr_array((0, size), dtype=np.float32)
    first, last = points.columns.start // points.dim, points.columns.stop // points.dim
    return csr_array(
        (np.ones(last - first, np.float32), np.arange(first, last), [0, last - first]),
        shape=(1, size),
    )


@terms.cells_of_points.register(ShapePoints)
def cells_of_points(points: ShapePoints) -> np.ndarray:
    """Of all points."""
    return points.cell


@terms.position_gradients.register(ShapePoints)
def position_gradients(points: ShapePoints, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of all points, (k c, 1, p)."""
    z = q[points.columns] if points.matrix is None else points.matrix @ x + points.offset
    u = np.einsum("kpb,bc->kcp", points.table, z.reshape(-1, points.dim))
    return u.reshape(-1, *points.section.shape[1:])
