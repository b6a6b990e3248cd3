r"""Shapes of a body between its places, by Craig and Bampton: what its joints do to it, and how it
vibrates between them.

    [ K  J^T ] [ u ]   [ 0   ]
    [ J  0   ] [ l ] = [ e_j ]           interface functions: at rest, one motion of a place after the other
    K v = w^2 M v,   J v = 0             fixed-interface modes

Rows J are the displacements of the places, and their rotations where moments act on them: slopes
of cables, directors of beams, axes of rims, p_a -> p_a + axis x p_a. Of combinations of interface
functions the stiff ones, which stretch where others bend, are left out. A basis that holds both, and
the motions of the training for the rest, knows a body under joints of any kind: of a bar, 4
interface functions and 4 modes give the first four modes of all its supports within 0.5 %, where
slow motions in a training have two.

Source: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319, doi 10.2514/3.4741.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from ..bodies.body import Body, extent, locate, positions, probe
from ..core.algebra import ranks, saddle
from ..core.algebra.linalg import Array, as_dense
from ..core.errors import InputError, say
from ..dynamics.near_state.linear import Linear, linearise
from ..dynamics.near_state.modes import real_modes
from ..systems import assemble, free_motions
from .excitation import turns

# clamped, pinned and free bars, modes 1 to 4: 0.4 % with four in the plane, 108 % with two in the
# fourth; 0.4 % with six in space, where two planes of bending share them, and 1.6 % with four
MODES = 2  #: fixed-interface modes for every dimension
# a bar of 1:100 stretches 3e4 times as hard as it bends, and one four times as wide as high bends
# 16 times as hard in that direction, by its ends against one another 15 times as hard; a third cuts
# that off, thrice of it gives a curved blade a quarter more functions, which pushes train as well
CUT = 3e2  #: stiffness of a combination of interface functions, over that of the softest, above which it is left to the training
FLAT = 1e-9  #: change of the directions of a place by a rotation, over the largest, that is none


def find(part: Body) -> np.ndarray:
    """Interface functions and the lowest fixed-interface modes (j, b, c) of a full body, as
    displacements; none where it has no places, or its reference is limp.

    Rows that keep the axes of rims orthonormal hold in all of them.
    """
    system = assemble([part], pictures=False)
    try:
        free_motions.refuse_limp(part.name, system)
        held, J = hold(linearise(system), rows_of_interfaces(part))
        modes = real_modes(held, MODES * part.dim).shapes
    except InputError:
        return np.zeros((0, *part.reference.shape))
    functions = at_rest(held, len(J))
    if functions is None or not len(J):
        return np.zeros((0, *part.reference.shape))
    return as_shapes(part, np.hstack([soft(part, held.stiffness, J, functions), modes]))


def of_interfaces(part: Body, count: int) -> np.ndarray:
    """All interface functions and `count` fixed-interface modes (j, b, c) of a body of matrices,
    as displacements.

    InputError where it moves without energy by more than rigid motions.
    """
    assert part.linear is not None
    alone = linearise(assemble([replace(part, linear=None)], pictures=False))
    whole = replace(alone, stiffness=csr_array(part.linear.stiffness))
    held, J = hold(whole, rows_of_interfaces(part))
    functions = at_rest(held, len(J))
    if functions is None:
        remedy = "look for loose nodes, or a mechanism in it"
        where = f"body '{part.name}'"
        raise InputError(say(where, "energy in all motions but rigid ones", "none in some", remedy))
    found = [functions, real_modes(held, count).shapes] if count else [functions]
    return as_shapes(part, np.hstack(found))


def hold(linear: Linear, J: np.ndarray) -> tuple[Linear, np.ndarray]:
    """Linear equations of a body in which rows J (i, n) hold, too, and those that do not follow
    from others: a point of a rigid rim moves with it.
    """
    rows = np.vstack([linear.rows, J])
    first = np.arange(len(rows)) < len(linear.rows)
    kept = ranks.part(rows, ranks.EXACT, first)[0]
    J = rows[kept[~first[kept]]]
    return replace(linear, rows=np.vstack([linear.rows, J])), J


def at_rest(held: Linear, count: int) -> np.ndarray | None:
    """Interface functions (n, count), of the last rows that are held; None where some motion costs
    no energy.
    """
    inverse = saddle.inverse(saddle.matrix(held.stiffness, held.rows))
    if inverse is None:
        return None
    n = len(held.x)
    moved = np.zeros((n + len(held.rows), count))
    moved[n + len(held.rows) - count :] = np.eye(count)
    found = inverse(moved)[:n]
    return found if np.isfinite(found).all() else None


def as_shapes(part: Body, columns: np.ndarray) -> np.ndarray:
    """Displacements (j, b, c) of columns (b c, j)."""
    return np.ascontiguousarray(columns.T.reshape(-1, *part.reference.shape))


def soft(part: Body, K: Array, J: np.ndarray, functions: np.ndarray) -> np.ndarray:
    """Combinations (n, k) of interface functions R (n, i) that cost little energy, the softest
    first; no rigid motions.

        R^T K R v = l v,    l <= CUT l_1
    """
    values, vectors = eigh(functions.T @ (K @ functions))
    rigid = np.linalg.matrix_rank(J @ rigid_motions(part))
    elastic = values[rigid:]
    return functions @ vectors[:, rigid:][:, elastic <= CUT * elastic[:1]]


def rigid_motions(part: Body) -> np.ndarray:
    """Translations and rotations (b c, r) of a body, in units of its size."""
    moves = np.kron(part.constant[:, None], np.eye(part.dim))
    about = part.reference - np.outer(part.constant, positions(part).mean(axis=0))
    if part.dim == 2:
        turns = np.column_stack([-about[:, 1], about[:, 0]])[None]
    else:
        turns = np.cross(np.eye(3)[:, None], about)
    return np.column_stack([moves, turns.reshape(len(turns), -1).T / extent(part)])


def rows_of_interfaces(part: Body) -> np.ndarray:
    """Rows J (i, b c) of the displacements of all places, and of the rotations of those on which
    moments act, by the displacement that these make at the distance of the body's size.
    """
    found = [np.zeros((0, part.reference.size))]
    for name in [*part.places, *part.frames]:
        position, *vectors = vectors_at(part, name)
        found.append(np.kron(position, np.eye(part.dim)))
        if vectors and turns(part, name):
            p = np.vstack(vectors)
            turned = extent(part) * rotations(p @ part.reference).T
            found.append(turned @ np.kron(p, np.eye(part.dim)))
    return np.vstack(found)


def vectors_at(part: Body, name: str) -> list[np.ndarray]:
    """Rows (1, b) of the position at a place, and of the vectors that it has."""
    found = []
    for vector in range(1 + part.dim):
        try:
            found.append(as_dense(probe(part, locate(part, name), vector)))
        except InputError:  # a place has no more vectors
            break
    return found


def rotations(axes: np.ndarray) -> np.ndarray:
    """Changes of vectors (k, c) by rotations, as orthonormal columns (k c, r)."""
    if axes.shape[1] == 2:
        turned = np.column_stack([-axes[:, 1], axes[:, 0]])[None]
    else:
        turned = np.cross(np.eye(3)[:, None], axes)
    left, sizes, _ = np.linalg.svd(turned.reshape(len(turned), -1).T, full_matrices=False)
    return np.asarray(left[:, sizes > FLAT * sizes[0]])
