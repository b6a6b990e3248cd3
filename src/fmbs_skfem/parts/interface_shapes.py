r"""Shapes of a body between its places, by Craig and Bampton: what its joints do to it, and how it
vibrates between them.

    [ K  J^T ] [ u ]   [ 0   ]
    [ J  0   ] [ l ] = [ e_j ]           interface functions: at rest, one motion of a place after the other
    K v = w^2 M v,   J v = 0             fixed-interface modes

Of solids the inertia of rigid accelerations R at rest serves in place of the modes, K u = M R. Rows J
are the displacements of the places, and their rotations where moments act on them: slopes
of cables, directors of beams, axes of rims, p_a -> p_a + axis x p_a. Of combinations of interface
functions the stiff ones, which stretch where others bend, are left out. A basis that holds both, and
the motions of the training for the rest, knows a body under joints of any kind: of a bar, 4
interface functions and 4 modes give the first four modes of all its supports within 0.5 %, where
slow motions in a training have two.

Source: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319, doi 10.2514/3.4741.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from ..bodies import from_matrices
from ..bodies.body import Body, extent, locate, positions, probe
from ..core.algebra import ranks, saddle
from ..core.algebra.linalg import as_dense
from ..core.errors import InputError, say
from ..dynamics.near_state.linear import Linear, linearise
from ..dynamics.near_state.modes import real_modes
from ..shapes.solids.solid import Solid
from ..systems import assemble, free_motions
from .excitation import turns

# clamped, pinned and free bars, modes 1 to 4: 0.4 % with four in the plane, 108 % with two in the
# fourth; 0.4 % with six in space, where two planes of bending share them, and 1.6 % with four
MODES = 2  #: fixed-interface modes for every dimension
# a bar of 1:100 stretches 3e4 times as hard as it bends, and one four times as wide as high bends
# 16 times as hard in that direction, by its ends against one another 15 times as hard; a third cuts
# that off, thrice of it gives a curved blade a quarter more functions, which pushes train as well
CUT = 3e2  #: stiffness of a combination of interface functions, over that of the softest, above which it is left to the training
FEW = 1000  #: unknowns up to which modes are found as those of all systems
FLAT = 1e-9  #: change of the directions of a place by a rotation, over the largest, that is none


def find(part: Body) -> np.ndarray:
    """Soft interface functions and the lowest fixed-interface modes, or the answers to inertia, (j,
    b, c) of a full body, as displacements; none where it has no places, or its reference is limp.

    Rows that keep the axes of rims orthonormal hold in all of them.
    """
    none = np.zeros((0, *part.reference.shape))
    system = assemble([part], pictures=False)
    try:
        free_motions.refuse_limp(part.name, system)
        held = hold(part, linearise(system))
        if held is None or not held.rows:
            return none
        if isinstance(part.space, Solid):
            moved = under_inertia(part, held)
        else:
            moved = vibrations(held, MODES * part.dim)
    except InputError:
        return none
    return as_shapes(part, np.hstack([soft(part, held), moved]))


def of_interfaces(part: Body, count: int) -> np.ndarray:
    """All interface functions and `count` fixed-interface modes (j, b, c) of a body of matrices,
    as displacements.

    InputError where it moves without energy by more than rigid motions.
    """
    assert part.linear is not None
    alone = linearise(assemble([replace(part, linear=None)], pictures=False))
    held = hold(part, replace(alone, stiffness=csr_array(part.linear.stiffness)))
    if held is None:
        remedy = "look for loose nodes, or a mechanism in it"
        where = f"body '{part.name}'"
        raise InputError(say(where, "energy in all motions but rigid ones", "none in some", remedy))
    found = [held.functions, vibrations(held, count)] if count else [held.functions]
    return as_shapes(part, np.hstack(found))


class HeldPlaces(NamedTuple):
    """A body that is held at its places, and what solves its equations at rest."""

    linear: Linear  #: with rows of all places, the last `rows` of them
    rows: int
    inverse: Callable[[np.ndarray], np.ndarray]  #: of its saddle point matrix
    functions: np.ndarray  #: (n, rows) interface functions


def hold(part: Body, linear: Linear) -> HeldPlaces | None:
    """A body held at its places, by rows that do not follow from others, as a point of a rigid rim
    does; None where some motion costs no energy.

    Rigid motions that places do not hold are kept out by their momenta, as of a body that floats.
    """
    rows = np.vstack([linear.rows, rows_of_interfaces(part)])
    first = np.arange(len(rows)) < len(linear.rows)
    kept = ranks.part(rows, ranks.EXACT, first)[0]
    J = rows[kept[~first[kept]]]
    Q = rigid_motions(part)
    floating = (linear.mass @ (Q @ ranks.null_space(J @ Q, ranks.STATED))).T
    held = replace(linear, rows=np.vstack([linear.rows, floating, J]))
    inverse = saddle.inverse(saddle.matrix(held.stiffness, held.rows), held.rows.shape[0])
    if inverse is None:
        return None
    n = len(held.x)
    moved = np.zeros((n + len(held.rows), len(J)))
    moved[len(moved) - len(J) :] = np.eye(len(J))
    functions = inverse(moved)[:n]
    return HeldPlaces(held, len(J), inverse, functions) if np.isfinite(functions).all() else None


def vibrations(held: HeldPlaces, count: int) -> np.ndarray:
    """Fixed-interface modes (n, count), the lowest; of large bodies by the factors that are there."""
    linear = held.linear
    n = len(linear.x)
    if n <= FEW:
        return real_modes(linear, count).shapes
    none = np.zeros(len(linear.rows))
    at_rest = LinearOperator(
        (n, n), matvec=lambda f: held.inverse(np.append(f, none))[:n], dtype=float
    )
    start = at_rest @ (linear.mass @ np.cos(np.arange(n)))
    K, M = linear.stiffness, linear.mass
    return np.asarray(eigsh(K, count, M=M, sigma=0.0, OPinv=at_rest, v0=start)[1])


def under_inertia(part: Body, held: HeldPlaces) -> np.ndarray:
    """What the inertia of rigid accelerations R does to a body that is held at its places, at rest
    (n, r).

        K u = M R,    J u = 0

    Of solids these serve in place of vibrations, which sum up to them slowly: with as many
    functions the stress at a hinged rim errs a fifth as much.
    """
    loads = held.linear.mass @ rigid_motions(part)
    none = np.zeros((len(held.linear.rows), loads.shape[1]))
    return held.inverse(np.vstack([loads, none]))[: len(loads)]


def as_shapes(part: Body, columns: np.ndarray) -> np.ndarray:
    """Displacements (j, b, c) of columns (b c, j)."""
    return np.ascontiguousarray(columns.T.reshape(-1, *part.reference.shape))


def soft(part: Body, held: HeldPlaces) -> np.ndarray:
    """Combinations (n, k) of interface functions R (n, i) that cost little energy, the softest
    first; no rigid motions. Of a solid all of them: stresses at its rims are theirs.

        R^T K R v = l v,    l <= CUT l_1
    """
    R = held.functions
    values, vectors = eigh(R.T @ (held.linear.stiffness @ R))
    rigid = np.linalg.matrix_rank(held.linear.rows[-held.rows :] @ rigid_motions(part))
    elastic = values[rigid:]
    cut = np.inf if isinstance(part.space, Solid) else CUT
    return np.asarray(R @ vectors[:, rigid:][:, elastic <= cut * elastic[:1]])


def rigid_motions(part: Body) -> np.ndarray:
    """Translations and rotations (b c, r) of a body, in units of its size."""
    about = part.reference - np.outer(part.constant, positions(part).mean(axis=0))
    return from_matrices.rigid_motions(about, part.constant, extent(part))


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
