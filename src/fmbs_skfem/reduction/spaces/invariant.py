r"""Bases that hold with a state every translation and rotation of it: modes of vectors, not of
coordinates.

    space    q = (S (x) I_3) T xi + q0,    S = [1, q0, left singular vectors of the x, y and z columns of all states]
    plane    z = x + i y = U w + z0,       U = [1, z0, left singular vectors of the complex states],    w complex: columns U and i U

Coordinates of all bodies are vectors (positions, slopes, axes of frames), so that the same
functions S act on all their components. A reduced model does not know in which direction it was
trained. Linear constraints inside a component are not in S: T (m c, r) are the coordinates that
keep them, and most of its entries are 0 or 1, because positions that joints read are coordinates of
their own. In the plane a multiplication by complex numbers does what two functions do: U is smaller
than S.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_array, kron

from ...bodies.body import Cells, ShapePoints
from ...core.algebra import ranks
from ...systems.system import Elastic, System, linear_part
from ...systems.terms import shape_points
from . import component, pivots, pod
from .pod import Basis

APART = 1e-3  #: least pivot of the rows that are made coordinates, over the largest
ROUND = 1e-13  #: part of the largest coefficient that is round-off


def basis(
    system: System,
    rows: np.ndarray,
    deviations: np.ndarray,
    tolerance: float | None,
    modes: int | None,
) -> Basis:
    """The basis of coordinates (n,) of a full system from deviations (n, s) of states from the
    initial one; at most `modes` modes.

    eps = `tolerance` refers to the deviations of the components from the field 1.
    """
    A = component.inner_constraints(system, rows)[0]
    count = (
        None
        if modes is None
        else max(2, (modes + ranks.rank(A)) // system.dim if len(A) else modes // system.dim)
    )
    found = make(system, rows, deviations, tolerance, count, A)
    while modes is not None and count is not None and found.modes.shape[1] > modes and count > 2:
        count -= 1
        found = make(system, rows, deviations, tolerance, count, A)
    return found


def make(
    system: System,
    rows: np.ndarray,
    deviations: np.ndarray,
    tolerance: float | None,
    count: int | None,
    A: np.ndarray,
) -> Basis:
    """The same with so many functions, or as many as the tolerance asks for, that keeps rows A (i,
    n).

        A q = A q0
    """
    dim = system.dim
    start = system.lift(system.x0)[rows]
    W = csr_array(component.metric_of(system, rows)[::dim, ::dim])
    one = system.unit[rows[::dim] // dim]
    tolerance = None if count else tolerance
    rigid = (
        np.abs(component.rigid_directions(system, rows, np.zeros((0, len(rows))))).reshape(
            len(one), dim, -1
        )
        > 0.0
    ).any(axis=1)
    rigid = np.unique(rigid.astype(float), axis=1)
    if dim == 2:
        keep = np.column_stack([one, as_complex(start[:, None]), rigid])
        found = pod.of_vectors(as_complex(deviations), keep, tolerance, count, W)
        closed = with_quarter_turns(found.modes)
        return Basis(closed @ keeping(A, closed), start, found.singular_values)
    columns = deviations.reshape(len(one), -1)
    mass = component.mass_of(system, rows)
    second = None if mass is None else csr_array(mass[::dim, ::dim])
    found = pod.of_vectors(
        columns, np.column_stack([one, start.reshape(-1, dim), rigid]), tolerance, count, W, second
    )
    S = with_rows(found.modes, scalar_rows(system, rows))
    return of_functions(S, A, dim, start, found.singular_values)


def of_functions(
    S: np.ndarray, A: np.ndarray, dim: int, start: np.ndarray, singular_values: np.ndarray
) -> Basis:
    """The basis of functions S (b, m), for coordinates that keep A q = A q0, A (i, n).

        modes = (S (x) 1_dim) T

    about the state `start` (n,), n = b dim; T is the identity in some of its rows.
    """
    closed = np.asarray(kron(S, np.eye(dim)).toarray())
    T = keeping(A, closed)
    return Basis(closed @ T, start, singular_values, (S, csr_array(T)))


def as_complex(states: np.ndarray) -> np.ndarray:
    """States in the plane as complex numbers (b, s).

        x + i y

    of states (n, s), b = n / 2 vectors of two components each.
    """
    return np.asarray(states[0::2] + 1j * states[1::2])


def with_quarter_turns(U: np.ndarray) -> np.ndarray:
    """Modes (n, 2 m) of U and i U, U (b, m) complex."""
    pairs = np.stack(
        [np.stack([U.real, U.imag], axis=1), np.stack([-U.imag, U.real], axis=1)], axis=-1
    )
    return np.asarray(pairs.reshape(2 * U.shape[0], 2 * U.shape[1]))


def keeping(A: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Amplitudes of modes (n, k) that keep rows A (i, n).

        A modes T = 0

    with T (k, r), the identity in r of its rows.
    """
    D = A @ modes
    seen = np.abs(D).max(axis=1, initial=0.0) > ranks.EXACT * (np.abs(A) @ np.abs(modes)).max(
        axis=1, initial=0.0
    )
    D = D[seen]
    D[np.abs(D) <= ROUND * np.abs(D).max(initial=0.0)] = 0.0
    D = D[ranks.independent_rows(D)] if len(D) else D
    T = pivots.eliminate(D, np.zeros(len(D)))[0] if len(D) else np.eye(modes.shape[1])
    return rounded(T)


def rounded(T: np.ndarray) -> np.ndarray:
    """Coefficients of coordinates of about one size, with those that are round-off as zeros."""
    return np.where(np.abs(T) <= ROUND * np.abs(T).max(initial=0.0), 0.0, T)


def scalar_rows(system: System, rows: np.ndarray) -> np.ndarray:
    """What linear constraints read of one component of the vectors among the coordinates `rows` (i,
    b).
    """
    A = linear_part(system)[1][:, rows].toarray()
    b = len(rows) // system.dim
    B = A.reshape(len(A), b, system.dim).transpose(0, 2, 1).reshape(-1, b)
    return np.unique(B[np.abs(B).max(axis=1, initial=0.0) > 0.0], axis=0)


def with_rows(S: np.ndarray, B: np.ndarray, sizes: np.ndarray | float = 1.0) -> np.ndarray:
    """The same space as S (b, m) with the values of independent rows B (i, b) as its first
    coordinates; the others vanish there.

        S [B^+, Z],    B S Z = 0

    with the rows B S that are independent, and Z orthonormal. S as it is without rows. Rows are
    held against one another times their `sizes` (i,).
    """
    if not len(B):
        return S
    B = np.asarray(B @ S)
    triangle, order = qr(B.T * sizes, mode="r", pivoting=True)
    pivot = np.abs(np.diag(triangle))
    B = B[np.sort(order[: int((pivot > APART * pivot[0]).sum())])]
    return np.hstack([S @ np.linalg.pinv(B), S @ qr(B.T)[0][:, len(B) :]])


def with_shape_points(
    full: System, reduced: System, components: Sequence[tuple[np.ndarray, Basis]]
) -> System:
    """The reduced system with points in Kronecker form where a component, its coordinates (n,) and
    basis, has functions S.
    """
    made = dict[int, Elastic]()
    first = 0
    for rows, basis in components:
        if basis.factors is not None:
            wide = (reduced.size, first)
            mine = (number for number, one in enumerate(full.elastic) if reads(one.gather, rows))
            made |= {
                number: kronecker(full, full.elastic[number], rows, basis, wide) for number in mine
            }
        first += basis.modes.shape[1]
    return replace(
        reduced, elastic=tuple(made.get(k, one) for k, one in enumerate(reduced.elastic))
    )


def kronecker(
    full: System, elastic: Elastic, rows: np.ndarray, basis: Basis, wide: tuple[int, int]
) -> Elastic:
    """A body with points in Kronecker form, of a component whose unknowns begin at a place among
    all, `wide` = (n, first).
    """
    assert basis.factors is not None
    (S, T) = basis.factors
    dim = full.dim
    values = np.zeros((full.size // dim, S.shape[1]))
    values[rows[::dim] // dim] = S
    spread = elastic.gather.spread
    points = shape_points.of_cells(
        elastic.gather, values if spread is None else csr_array(spread)[::dim, ::dim] @ values
    )
    entries = T.tocoo()
    matrix = csr_array(
        (entries.data, (entries.row, entries.col + wide[1])), shape=(T.shape[0], wide[0])
    )
    z0 = np.linalg.lstsq(S, basis.mean.reshape(-1, dim), rcond=None)[0].ravel()
    return replace(elastic, gather=replace(points, matrix=matrix, offset=z0))


def reads(cells: Cells | ShapePoints, rows: np.ndarray) -> bool:
    """Whether cells read the coordinates `rows` (n,)."""
    if not isinstance(cells, Cells):
        return False
    return bool(
        np.isin(
            int(cells.nodes[0, 0])
            if cells.spread is None
            else int(csr_array(cells.spread).indices[0]),
            rows,
        )
    )
