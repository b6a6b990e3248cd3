r"""Shapes that a part lacks: the leading ones of what its shape functions S leave out of the states
of its training.

    T = leading left singular vectors of Y - P Y,   P = S (S^T W S)^-1 S^T W,    d = max_s |c_s - P c_s|_W

d [m] is what the part is known to miss; `dynamics.missing_shapes` estimates what it misses in a
run.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bodies.body import Body, extent, locate, probe
from ..bodies.body import over_space as functions_over
from ..bodies.spare_shapes import MissingShapes
from ..core.algebra.linalg import as_dense, squares
from ..core.errors import InputError
from ..reduction.spaces import pod
from ..systems.terms import shape_points
from . import bodies as parts
from . import structural_shapes

#: least number of functions T of either kind, and of how many of S there is one where these are
#: more
LEAST, PART = (
    6,
    6,
)
MOST = 2_000_000  #: numbers in the tables of a part, up to which it has them
BENT = 1e-4  #: least part of the structural shapes that counts as left out
ROUND = 1e-9  #: least that a part is said to miss, over the size of its body: Newton's iteration leaves as much


def functions(part: Body, S: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """T (b, t) of a full body beside S (b, m), of its structure and of columns (b, j)."""
    rows = rows_of_places(part)[0]
    T = leading(part, S, structural_shapes.columns(part, rows), count_for(S), BENT)
    U, s = pod.left_singular(parts.metric(part), outside(part, np.hstack([S, T]), columns))
    return np.hstack([T, U[:, s > ROUND * extent(part)][:, : count_for(S)]])


def find(part: Body, S: np.ndarray, T: np.ndarray, states: np.ndarray) -> MissingShapes:
    """The functions T (b, t) of a full body beside S (b, m), with d of states (s, b, c)."""
    assert part.cells is not None
    W = parts.metric(part)
    left_out = max(distance(part, S, states), ROUND * extent(part))
    rows, place = rows_of_places(part)
    F = np.hstack([S, T])
    points = shape_points.of_cells(part.cells, parts.over_cells(part, F))
    mass = F.T @ (part.mass @ S) / part.total_mass
    positions = parts.cell_centres(part)[points.cell]
    return MissingShapes(
        points.table,
        positions,
        points.section,
        mass,
        F.T @ (W @ F),
        rows @ F,
        place,
        left_out,
        over_space=T if (read := functions_over(part)) is None else np.asarray(read @ T),
        inertia=T.T @ (part.mass @ T) / part.total_mass,
        axes=parts.frames_of(part, T),
    )


def leading(part: Body, S: np.ndarray, columns: np.ndarray, count: int, least: float) -> np.ndarray:
    """The leading functions (b, t) of what S (b, m) leaves out of columns (b, j), larger than their
    size without affine motions.
    """
    if not columns.shape[1]:
        return columns
    W = parts.metric(part)
    affine, s = pod.left_singular(W, np.column_stack([part.constant, part.reference]))
    size = pod.left_singular(W, outside(part, affine[:, s > ROUND * s[0]], columns))[1].max()
    U, s = pod.left_singular(W, outside(part, S, columns))
    return np.asarray(U[:, s > least * size][:, :count])


def count_for(S: np.ndarray) -> int:
    """Largest number of functions T beside S (b, m): what stretches where many functions bend needs
    many to be seen.
    """
    return max(LEAST, S.shape[1] // PART)


def is_large(part: Body, S: np.ndarray) -> bool:
    """Whether the tables of a part of the functions S (b, m) would be very large."""
    assert part.cells is not None
    K, P, _, E = part.cells.shape
    return K * P * E * (S.shape[1] + 2 * count_for(S)) > MOST


def why_unknown(part: Body, S: np.ndarray) -> str:
    """Why `find` finds nothing.

    A sentence for the notes of the part, of S (b, m).
    """
    if part.stiffness is not None:
        return "unknown: its patches are held together by springs"
    return (
        "unknown: its mesh is very large"
        if is_large(part, S)
        else "unknown: its functions leave nothing out of its training"
    )


def outside(part: Body, S: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Columns (b, j) without what S (b, m) holds of them.

        Y - S (S^T W S)^-1 S^T W Y

    twice, so that what is left is orthogonal to round-off.
    """
    for _ in range(2):
        columns = columns - S @ parts.projected(part, S, columns)
    return columns


def distance(part: Body, S: np.ndarray, states: np.ndarray) -> float:
    """Largest distance in the mass of states (s, b, c) from S (b, m) [m].

        max_s |c_s - P c_s|_W

    over the states s.
    """
    rest = outside(part, S, parts.as_columns(states))
    found = squares(rest, parts.metric(part)).reshape(len(states), -1).sum(axis=1)
    return float(np.sqrt(found.max(initial=0.0)))


def rows_of_places(part: Body) -> tuple[np.ndarray, np.ndarray]:
    """Positions, slopes and axes at the places of a body (j, b), and the numbers of the places
    (j,).
    """
    found = [np.zeros((0, len(part.reference)))]
    place = list[int]()
    for number, name in enumerate([*part.places, *part.frames]):
        for vector in range(1 + part.dim):
            try:
                found.append(as_dense(probe(part, locate(part, name), vector)))
            except InputError:  # a place has no more vectors
                break
            place.append(number)
    return np.vstack(found), np.array(place, dtype=np.int64)


def coarser(
    part: Body, S: np.ndarray, states: np.ndarray, factor: np.ndarray
) -> MissingShapes | None:
    """Those of a part with the functions S (b, m) over its own, for its states (s, b, c) and the
    factor (b, b) of its training.

    What is left out of its own functions comes first, then what they lack themselves.
    """
    assert part.shapes is not None
    known = part.shapes.missing
    if known is None:
        return None
    U, s = pod.left_singular(parts.metric(part), outside(part, S, factor))
    T = U[:, s > ROUND * extent(part)]
    b = len(S)
    own = known.metric.shape[0] - len(S)
    A = np.zeros((b + own, S.shape[1] + T.shape[1] + own))
    A[:b, : S.shape[1]], A[:b, S.shape[1] : -own], A[b:, -own:] = S, T, np.eye(own)
    A = A[:, : S.shape[1] + 2 * count_for(S)]
    return replace(
        known,
        functions=np.ascontiguousarray(known.functions @ A),
        mass=A.T @ known.mass @ S,
        metric=A.T @ known.metric @ A,
        rows=known.rows @ A,
        left_out=max(distance(part, S, states), known.left_out),
        **over_space(part, known, A[:, S.shape[1] :]),
    )


def over_space(part: Body, known: MissingShapes, B: np.ndarray) -> dict[str, np.ndarray]:
    """What a finer body reads of functions B (f, t) over those that a part knows; nothing where it
    knows none.
    """
    if not known.over_space.size:
        return {}
    b = known.mass.shape[1]
    inertia = np.block([[known.mass[:b], known.mass[b:].T], [known.mass[b:], known.inertia]])
    read = functions_over(part)
    assert read is not None
    axes = known.axes if part.axes is None else np.hstack([as_dense(part.axes), known.axes]) @ B
    return {
        "over_space": np.hstack([as_dense(read), known.over_space]) @ B,
        "inertia": B.T @ inertia @ B,
        "axes": axes,
    }
