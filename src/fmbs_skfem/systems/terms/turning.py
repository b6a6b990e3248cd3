r"""How the bodies of a planar reduced system turn, and their tangents at the angles that
`corotation` needs.

The turn is that of the best fit of a body's coordinates q to its reference shape q0; translations
drop out.

    c ~ q0 . q,    s ~ (R q0) . q,    R a turn by 90 degrees
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.algebra.linalg import as_dense, support
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ..evaluation import evaluation, part_tangent
from ..prepared import prepare
from ..system import System
from .corotation import CorotationalTangent, nothing

# a spin-up differs by 1e-5 in 4 to 10 modes
ALIKE = 0.05  #: largest relative difference from the exact tangent at a fifth angle
# a spin-up misses 1e-3 in 4 modes, 7e-5 in 6 and 2e-6 in 10
REACH = 1e-2  #: largest part of the turned reference shape that the space may miss
# no multiple of 45 degrees: at those K_a, K_b and K_c are right by the way they are made
PROOF = 2.0  #: that angle [rad]


class Turning(NamedTuple):
    """How the t bodies of a reduced system turn, whatever their tangents are.

        (c, s) ~ rows @ x + offset,    theta = atan2(s, c)

    for the unknowns x (n,); lengths of (c, s) drop out.
    """

    table: np.ndarray  #: of `CorotationalTangent`, as are
    rows: np.ndarray
    offset: np.ndarray
    places: np.ndarray


def turning_of(system: System) -> Turning | None:
    """How all elastic parts of a reduced system turn; None where one of them does not, or its space
    does not hold it turned.

    None in space too, and of full systems. Up to `REACH` of the turned reference shape may be
    missed.
    """
    # in space a rotation is no polynomial of degree two in two numbers
    if system.dim != 2 or not isinstance(system.lift.matrix, np.ndarray) or not system.elastic:
        return None
    names = "\n".join(elastic.name for elastic in system.elastic)
    parts = system.lift, system.x0, system.unit, system.coordinates, names
    return prepare(system).find("turning", parts, lambda: find_turning(system))


def find_turning(system: System) -> Turning | None:
    """`turning_of` a planar system."""
    spans = {name: slice(first, last) for name, first, last in system.coordinates}
    table = []
    rows = []
    offsets = []
    places = []
    first = 0
    for elastic in system.elastic:
        if elastic.name not in spans:
            return None
        row, offset, place, miss = fit(system, spans[elastic.name])
        # all parts or none: W is assembled or turned as a whole
        if miss > REACH:
            return None
        # modes of this body alone, so that its three tangents are small
        on = support(as_dense(system.lift.matrix[spans[elastic.name]]))
        count = on.stop - on.start
        table.append((on.start, count, first))
        rows.append(row)
        offsets.append(offset)
        places.append(place)
        first += 3 * count * count
    return Turning(
        np.array(table, dtype=np.int64), np.array(rows), np.array(offsets), np.array(places)
    )


def room(system: System, turning: Turning | None) -> CorotationalTangent:
    """What `fill` puts the tangents into; nothing where bodies do not turn.

    Numbers are zero until then.
    """
    if turning is None:
        return nothing(system.size)
    # damping in proportion to the stiffness turns with it, by one factor
    beta = np.array([elastic.beta for elastic in system.elastic])
    return CorotationalTangent(*turning, beta, np.zeros(3 * int((turning.table[:, 1] ** 2).sum())))


@routine
def fill(table: Any, _: int = 0) -> int:
    """Put K_a, K_b and K_c of all parts in; 0 where there is none, or one does not turn so, else 1.

    K(theta) is compared with the tangent at a fourth angle `PROOF` [rad], from which it may differ
    by `ALIKE` of its norm. x and W of the space are overwritten.
    """
    T = evaluation(table).arrays.corotation
    alike = len(T.table) > 0
    for part in range(len(T.table)):
        first, count, at = T.table[part]
        # side by side, so that a tangent reads its three matrices in one sweep
        Ka, Kb, Kc = (
            view(T.numbers, at, (count, count)),
            view(T.numbers, at + count * count, (count, count)),
            view(T.numbers, at + 2 * count * count, (count, count)),
        )
        # a quadratic form in c and s has three coefficients; the fourth angle is none of theirs,
        # and tries them
        turn(table, part, 0.0, first, Ka)
        turn(table, part, 0.5 * np.pi, first, Kb)
        turn(table, part, 0.25 * np.pi, first, Kc)
        for i in range(count):
            for j in range(count):
                Kc[i, j] = 2.0 * Kc[i, j] - Ka[i, j] - Kb[i, j]
        if not is_proved(table, part, first, Ka, Kb, Kc):
            alike = False
    return 1 if alike else 0


@jit
def turn(table: Any, part: int, theta: float, first: int, K: np.ndarray) -> None:
    """K (r, r) = the tangent of a part that is turned by an angle [rad], of its r unknowns from
    `first` on.
    """
    place(table, part, theta)
    W = evaluation(table).space.W
    for i in range(K.shape[0]):
        for j in range(K.shape[1]):
            K[i, j] = W[first + i, first + j]


@jit
def place(table: Any, part: int, theta: float) -> None:
    """W = the tangent of a part that is turned by an angle [rad]."""
    E = evaluation(table)
    x = E.space.x
    places = E.arrays.corotation.places
    c = np.cos(theta)
    s = np.sin(theta)
    for i in range(len(x)):
        x[i] = places[part, i, 0] * c + places[part, i, 1] * s + places[part, i, 2]
    # no damping: the rotated tangent takes it as a factor 1 + gh beta
    E.space.gh[0] = 0.0
    part_tangent(table, part)


@jit
def is_proved(
    table: Any, part: int, first: int, Ka: np.ndarray, Kb: np.ndarray, Kc: np.ndarray
) -> bool:
    """Whether the tangent of a part at the angle `PROOF` is the one that follows from K_a, K_b and
    K_c (r, r), those of its r unknowns from `first` on.
    """
    place(table, part, PROOF)
    W = evaluation(table).space.W
    c = np.cos(PROOF)
    s = np.sin(PROOF)
    off, whole = 0.0, 0.0
    for i in range(Ka.shape[0]):
        for j in range(Ka.shape[1]):
            value = W[first + i, first + j]
            d = c * c * Ka[i, j] + s * s * Kb[i, j] + c * s * Kc[i, j] - value
            off += d * d
            whole += value * value
    return off <= ALIKE * ALIKE * whole


def fit(system: System, span: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Rows (2, n) and offset (2,) that show the turn of a body, the unknowns (n, 3) that turn it by
    an angle, and what they miss of it.

    These are multiples of the cosine of the angle, its sine, and 1.
    """
    V = np.asarray(system.lift.matrix[span])
    offset = system.lift.offset[span]
    unit = system.unit[span.start // 2 : span.stop // 2]
    q = (V @ system.x0 + offset).reshape(-1, 2)
    # translations drop out of the fit, since they drop out of the tangent
    q = q - np.outer(unit, unit @ q) / (unit @ unit)
    shapes = np.stack([q.ravel(), np.stack([-q[:, 1], q[:, 0]], axis=1).ravel()])
    moves = np.stack(
        [np.stack([unit, 0.0 * unit], axis=1).ravel(), np.stack([0.0 * unit, unit], axis=1).ravel()]
    )
    A = np.concatenate([V, moves.T], axis=1)
    # a space with translations holds `moves` twice: least squares of a rank that is not full
    inverse = np.linalg.pinv(A.T @ A, rcond=1e-12, hermitian=True) @ A.T
    found = inverse @ shapes.T
    miss = float(np.linalg.norm(A @ found - shapes.T) / np.linalg.norm(shapes))
    images = found[: V.shape[1]]
    start = (inverse @ offset)[: V.shape[1]]
    return shapes @ V, shapes @ offset, np.column_stack([images, -start]), miss
