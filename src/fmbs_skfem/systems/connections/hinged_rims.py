r"""Plates and shells that swing about a rim: motions of a body beside the frame of its own rim.

    K U w = 0:    U = (w x e_1, w x e_2, w x e_3) of the frame alone moves nothing of the body
    hinged motions:  z, w with  Phi_q (B z + U w) = 0,   count  rank A + rank E - rank [A E],   A = Phi_q B,  E = Phi_q U

The points of a rim without slopes lie still when its frame turns about the line on which they all
lie: what holds the frame does not hold the body there. K is the elastic tangent in the reference, B
are the rigid motions of the bodies with their frames. A frame that turns alone, as on a hinge along
the rim, is no motion of the mechanism and is left out.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_diag, csr_array

from ...core.algebra import ranks
from ...core.algebra.linalg import as_dense
from ..compiled import compile_system, elastic_tangent, residual
from ..free_motions import FreeMotion, motion, sparse_basis
from ..system import System, reads
from .mechanism import FRAME, balanced, motions, on_motions, turn
from .redundancy import rows_of

FREE = 1e-9  #: force on a frame that turns, over the stiffness of what it moves, that is round-off


def find(system: System) -> np.ndarray:
    """Motions (z, k) of the bodies, in columns, that swing about rims that joints hold; the frames
    of the rims stay behind.

        Phi_q (B z + U w) = 0,    k = rank A + rank E - rank [A E],    A = Phi_q B,    E = Phi_q U

    z as in `mechanism.motions`; of a system with all multipliers, at its start.
    """
    U = loose_frames(system)
    if not U.shape[1] or not system.constraints.names:
        return np.zeros((sum(B.shape[1] for B in motions(system, system.x0)), 0))
    rows = rows_of(system)[0]
    A = on_motions(system, rows, system.x0)
    E = as_dense(rows(system.x0[rows.used])[1] @ csr_array(U[rows.used]))
    both = np.concatenate([A, E], axis=1)
    units = 1.0 / ranks.lengths(both.T)
    Z = units[:, None] * ranks.null_space(both * units, ranks.STATED)
    swings = Z[: A.shape[1]]
    alone = units[: A.shape[1]]
    if (idle := alone[:, None] * ranks.null_space(A * alone, ranks.STATED)).shape[
        1
    ]:  # frames that move with their bodies
        base = np.linalg.qr(idle)[0]
        swings = swings - base @ (base.T @ swings)
    count = rank(A) + rank(E) - rank(both)
    left, sizes, _ = np.linalg.svd(swings, full_matrices=False)
    return np.asarray(left[:, :count] * (sizes[:count] > 0.0))


def named(system: System) -> list[str]:
    """The motions of `find` in words, such as which body turns about which axis."""
    return [str(motion(system, z)) for z in sparse_basis(find(system))]


def rank(A: np.ndarray) -> int:
    return ranks.rank(balanced(A), ranks.STATED)


def pushed(system: System, time: float) -> tuple[FreeMotion, ...]:
    """Those of the motions of `find` that loads at a time [s] push, so that there is no equilibrium
    near the reference.
    """
    Z = find(system)
    if not Z.shape[1]:
        return ()
    held = np.zeros(len(system.constraints.names))
    force = residual(compile_system(system), system.x0, held, time)[: system.size]
    along = np.abs(force) @ np.abs(csr_array(block_diag(motions(system, system.x0)))) @ np.abs(Z)
    push = (force @ csr_array(block_diag(motions(system, system.x0)))) @ Z
    if not along.any():
        return ()
    moving = Z[:, np.abs(push) > ranks.STATED * np.maximum(along, 1e-300)]
    return tuple(motion(system, z) for z in sparse_basis(moving))


def loose_frames(system: System) -> np.ndarray:
    """Turns U (q, k) of frames of rims of elastic bodies, each alone, that move nothing of the
    body.
    """
    elastic = {one.name for one in system.elastic}
    found = list[np.ndarray]()
    axes = dict[str, list[int]]()
    for row, (owner, label) in enumerate(system.constraints.names):
        body, _, rim = owner.partition(".")
        if rim and body in elastic and FRAME.fullmatch(label) and label[:2] == label[3:]:
            axes.setdefault(owner, []).append(row)
    frames = {owner: own for owner, own in axes.items() if len(own) == 3}
    if system.dim != 3 or not frames:
        return np.zeros((system.size, 0))
    probes = csr_array(system.probes.matrix)
    read = csr_array(reads(system.constraints, probes.shape[0]) @ abs(probes))
    K = csr_array(elastic_tangent(compile_system(system), system.x0, 0.0))
    for own in frames.values():
        places = [np.sort(read[[row]].indices) for row in own]
        if any(len(place) != 3 for place in places):
            continue
        U = np.zeros((system.size, 3))
        for place in places:
            for k, axis in enumerate(np.eye(3)):
                U[place, k] = turn(system.x0[place][None], axis)[0]
        force = K @ U
        size = float((abs(K) @ np.abs(U)).max())
        w = np.eye(3) if size == 0.0 else null_of(force / size)
        found += list((U @ w).T)
    return np.array(found).T if found else np.zeros((system.size, 0))


def null_of(A: np.ndarray) -> np.ndarray:
    """Directions (3, k) that A (n, 3) takes to round-off."""
    sizes, right = np.linalg.svd(A, full_matrices=False)[1:]
    return np.asarray(right[sizes <= FREE].T)
