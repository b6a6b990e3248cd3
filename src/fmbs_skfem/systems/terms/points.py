"""Sampled points of reduced bodies as terms: gather and modes multiplied out to one dense array.

u = L x[columns] + offset,    f = L^T phi(u),    W += L^T phi' L
"""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...bodies import laws
from ...bodies.laws import Law
from ...core.algebra.linalg import as_dense, support
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import Cube, Integers, Vector, opener, routine
from ...core.compiling.structs import Matrix as Rows
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Attributes, Indices, Range, Reals
from ..affine import Affine, Matrix
from ..evaluation import evaluation
from ..kernels import add_combination, add_sums, clear
from . import elastic as terms
from .elastic import Lifts, Setting, Term

# 3600 gradients by 40 modes: 62 us a force; 63 to 79 at half, 65 at twice of it, 70 all in one
ROOM = 20_000  #: numbers of gradients that stay in the cache from gather to scatter


@storable
@dataclass(frozen=True)
class Sampled:
    """Gather multiplied out at chosen points p of a reduced body: gradients u (k c, p) = L @
    x[columns] + offset.

        f = L^T phi(u),    W += L^T phi' L

    Rows of L (k c p, r) are in the order (k, c, p).
    """

    law: Annotated[Law, Attributes("k=vectors i=rows")]
    rows: Annotated[np.ndarray, Reals("kcp r")]  #: L
    offset: Annotated[np.ndarray, Reals("kcp")]
    #: rows of the law, the last one the weight of a point
    section: Annotated[np.ndarray, Reals("i 1 p")]
    columns: Annotated[slice, Range("r", end="n")]
    cell: Annotated[np.ndarray, Indices("p")]  #: number of the cell of every point


class PointsRecord(NamedTuple):
    """A block of points for compiled code."""

    calls: Integers  #: addresses of the law's functions, see `laws.addresses`
    beta: float  #: stiffness-proportional damping time [s]
    first: int  #: of the unknowns
    transposed: Rows  #: L^T (r, k c p), long rows
    offset: Vector  #: (k c p,)
    section: Cube  #: (i, 1, p)
    kept: int  #: first place in the gradients of a space, see `elastic.first_kept`


opened = opener(PointsRecord)


@jit
def place(P: Any, target: np.ndarray, at: int) -> np.ndarray:
    """An array (k c, 1, p) from a place of `target` on."""
    points = P.section.shape[2]
    # a view: no array is made in a step
    return view(target, at, (P.transposed.shape[1] // points, 1, points))


@jit
def read(s: Any, P: Any, order: int, target: np.ndarray, at: int) -> np.ndarray:
    """Gradients (k c, 1, p) from the unknowns with the offset, or from their rates without."""
    modes, size = P.transposed.shape
    flat = view(target, at, (size,))
    for i in range(size):
        # the offset stands still, so that rates have none
        flat[i] = P.offset[i] if order == 0 else 0.0
    # by modes, a few dozen long rows: every loop runs over all gradients of the block
    add_combination(P.transposed, view(s.x if order == 0 else s.v, P.first, (modes,)), flat)
    return place(P, target, at)


@jit
def scatter(s: Any, P: Any, S: np.ndarray) -> None:
    """Add forces on the unknowns of points.

        f += L^T S

    of stresses S (k c, 1, p).
    """
    # the same rows as the gather, which are in the cache still
    add_sums(P.transposed, view(S, 0, (S.size,)), view(s.f, P.first, (len(P.transposed),)))


@jit
def add_tangent(s: Any, P: Any, D: np.ndarray) -> None:
    """Add the matrix of points.

        W[columns, columns] += L^T D L

    of moduli D (k c, k c, 1, p).
    """
    # moduli are in the second row of the room already
    add_product(P, s.work, s.W)


@jit
def add_product(P: Any, work: np.ndarray, W: np.ndarray) -> None:
    """Add the product of rows of points with stresses: a half of it, which is symmetric.

        W[columns, columns] += L^T D L

    with D in the second row of `work`.
    """
    # mode by mode from the rows that forces read: 232 us for 416 us of BLAS with D L first (60
    # modes, 150 points of a cable), 19 for 20 (23 modes, 54 points)
    modes, size = P.transposed.shape
    points = P.section.shape[2]
    rows = size // points
    D, stress = view(work[1], 0, (rows, rows, points)), view(work[2], 0, (rows, points))
    found = np.empty(modes)
    for r in range(modes):
        mode = view(P.transposed[r], 0, (rows, points))
        for i in range(rows):
            target = stress[i]
            modulus = D[i]
            for p in range(points):
                target[p] = modulus[0, p] * mode[0, p]
            for j in range(1, rows):
                for p in range(points):
                    target[p] += modulus[j, p] * mode[j, p]
        half = found[: r + 1]
        clear(half)
        add_sums(P.transposed[: r + 1], view(stress, 0, (size,)), half)
        for s in range(r):
            W[P.first + r, P.first + s] += half[s]
            W[P.first + s, P.first + r] += half[s]
        W[P.first + r, P.first + r] += half[r]


@routine
def gather_alone(table: Any, record: Any) -> int:
    """The gradients, for reports of time."""
    s = evaluation(table).space
    # as in a force, without its law: reports subtract nothing
    read(s, opened(record), 0, s.work[0], 0)
    return 0


@routine
def scatter_alone(table: Any, record: Any) -> int:
    """The scatter, of gradients that are there in place of stresses, for reports of time."""
    s = evaluation(table).space
    P = opened(record)
    scatter(s, P, place(P, s.work[0], 0))
    return 0


@routine
def product_alone(table: Any, record: Any) -> int:
    """The product of a tangent with a modulus that is there, for reports of time."""
    s = evaluation(table).space
    add_product(opened(record), s.work, s.W)
    return 0


PRODUCTS = {"force_products": (gather_alone, scatter_alone), "tangent_products": (product_alone,)}
ROUTINES = terms.at_points(__name__, opened, place, read, scatter, add_tangent, **PRODUCTS)


@terms.carry.register(Sampled)
def carry(points: Sampled, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Sampled:
    """Rows times modes; columns that are zero are left out."""
    part = as_dense(V)[points.columns]
    # a body whose component has few modes keeps few columns, whatever the size of the model
    columns = support(part)
    offset = points.offset + points.rows @ d[points.columns]
    return replace(points, rows=points.rows @ part[:, columns], offset=offset, columns=columns)


@terms.split.register(Sampled)
def split(points: Sampled, lifts: Lifts) -> list[Sampled]:
    """Blocks of about ROOM gradients, all in one where they are few."""
    count = points.section.shape[2]
    modes = points.rows.shape[1]
    gradients = points.rows.reshape(-1, count, modes)
    offset = points.offset.reshape(-1, count)
    # by numbers and not by points: what has to stay in the cache is L, whose rows are as long as
    # there are modes
    parts = max(1, round(points.rows.size / ROOM))
    if parts == 1:
        return [points]
    return [
        replace(
            points,
            rows=np.ascontiguousarray(gradients[:, k]).reshape(-1, modes),
            offset=np.ascontiguousarray(offset[:, k]).ravel(),
            section=np.ascontiguousarray(points.section[..., k]),
            cell=points.cell[k],
        )
        for k in np.array_split(np.arange(count), parts)
    ]


@terms.compile_term.register(Sampled)
def compile_term(points: Sampled, setting: Setting) -> Term:
    """Its numbers behind each other."""
    calls = laws.addresses(points.law, setting.dim, setting.beta > 0.0)
    transposed, offset, section = (
        np.ascontiguousarray(part) for part in (points.rows.T, points.offset, points.section)
    )
    first = terms.first_kept(points.law, setting)
    record = PointsRecord(
        calls, setting.beta, points.columns.start, transposed, offset, section, first
    )
    rows = points.law.vectors * setting.dim
    kept = terms.count_kept(points.law, len(points.rows), setting)
    return Term(
        record,
        ROUTINES,
        max(rows**2 * section.shape[2], 1),
        setting.beta > 0.0,
        kept,
    )


@terms.position_gradients.register(Sampled)
def position_gradients(points: Sampled, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of all points, (k c, 1, p)."""
    u = np.asarray(points.rows @ x[points.columns] + points.offset)
    return u.reshape(-1, *points.section.shape[1:])


@terms.cells_of_points.register(Sampled)
def cells_of_points(points: Sampled) -> np.ndarray:
    """Of all points."""
    return points.cell


@singledispatch
def dense_rows(storage: Any) -> Sampled | None:
    """The points of a reduced body as dense rows on the unknowns, with rows (k c p, r); None of
    other storages.
    """
    return None


@dense_rows.register(Sampled)
def _(points: Sampled) -> Sampled:
    return points


@terms.unknowns.register(Sampled)
def unknowns(points: Sampled) -> slice:
    """Its columns."""
    return points.columns


@terms.choose_points.register(Sampled)
def choose_points(points: Sampled, kept: np.ndarray, factors: np.ndarray) -> Sampled:
    """Rows, offset and section of these points."""
    count = len(points.cell)
    rows = points.rows.reshape(-1, count, points.rows.shape[1])[:, kept]
    offset = points.offset.reshape(-1, count)[:, kept]
    rows = np.ascontiguousarray(rows).reshape(-1, points.rows.shape[1])
    offset = np.ascontiguousarray(offset).ravel()
    return replace(
        points,
        rows=rows,
        offset=offset,
        section=weigh(points.section, kept, factors),
        cell=points.cell[kept],
    )


def weigh(section: np.ndarray, kept: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Rows of a section (i, 1, p) at some points `kept` (j,), the last one, the weight, times
    factors (j,): (i, 1, j).
    """
    few = np.ascontiguousarray(section[:, :, kept])
    # weights of the sample multiply those of the quadrature: the law's energy is scaled, so that
    # its force keeps a potential
    few[-1] *= factors
    return few
