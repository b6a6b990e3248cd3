r"""Directions against joints inside components, so that reduced models know the reactions of these
joints.

    (K + s W) D = A^T,   D (A D)^-1,     q = U xi + D w + qbar,     A D w = 0  with multipliers

A linear constraint A q + a = 0 inside a component holds in every mode of its basis: as an equation
of the modes it is 0 = 0, and the multiplier that it has in the full model is lost. One more
direction for each such row, with the row as an equation that keeps it at zero, leaves the motion as
it is, and the multiplier is the force that the residual has along that direction. It is the static
displacement which opens the row: an error dq of the motion has no share in its elastic force, A dq
= 0. Of free bodies it is the rigid motion which opens it, and the reaction the balance of forces.
Only joints that an output reads have them.

A nonlinear row stays an equation of the modes, but all these move along it: they open it by no more
than it is curved, and the multiplier takes what the modes miss elsewhere, 1300 times the moment of
a prismatic joint. It has directions against all gradients Phi_q in states of the training; what of
them it leaves free in a state is one more motion of the model, which errs less with it. Driven rows
need none: the motion opens them by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ...core.algebra import ranks
from ...systems import compiled
from ...systems.compiled import Compiled, compile_system
from ...systems.system import System, driven_rows, is_linear, linear_part, loose_rows, reads
from . import pod
from .component import metric_of, rows_of, satisfy, touched_outside
from .pod import Basis

State: TypeAlias = tuple[np.ndarray, float]  #: body coordinates (q,) and time [s]

MANY = 24  #: rows of a component up to which reactions are worth their directions: not those of whole edges
SOFT = 1e-10  #: of K, over its largest rates, that W adds: rigid motions are free, and no motion of the modes is that slow
SLIGHT = 1e-3  #: part of gradients that is none: half or twice of it leaves what they err by, a thousandth of the reaction
KNOWN = 1e-8  #: part of a direction outside the modes, below which they have it: what is left would be round-off


def rows_read(system: System, rows: np.ndarray) -> np.ndarray:
    """Numbers (i,) of the constraint rows inside a component with coordinates `rows` (n,) whose
    reactions an output reads.

    Not those that are driven, nor those of joints that events release: without these a model knows
    no motion.
    """
    joints = {output.joint for output in system.outputs.values() if output.joint}
    probes = csr_array(system.probes.matrix)
    touched = csr_array(reads(system.constraints, probes.shape[0]) @ abs(probes))
    asked = (
        np.array([joint in joints for joint, _ in system.constraints.names], dtype=bool)
        & ~loose_rows(system.constraints)
        & ~driven_rows(system.constraints)
    )
    found = np.setdiff1d(np.flatnonzero(asked), touched_outside(touched, rows))
    return found if len(found) <= MANY else np.zeros(0, dtype=np.int64)


def add_directions(
    system: System,
    components: Mapping[str, Sequence[str]],
    found: Mapping[str, Basis],
    states: Iterable[State],
) -> dict[str, Basis]:
    """Bases with directions against the rows inside their components that outputs read, behind
    their own modes.

    `states`, (q,) and times [s] of the training, are asked for only where such a row is nonlinear.
    """
    read = {
        name: rows_read(system, rows_of(system, members)) for name, members in components.items()
    }
    if not any(map(len, read.values())):
        return dict(found)
    model = compile_system(system)
    linear = is_linear(system.constraints)
    K = csr_array(compiled.tangent(model, system.x0, np.zeros(model.constraints), 0.0, 0.0))
    moving = {name: one[~linear[one]] for name, one in read.items()}
    known = list(states) if any(map(len, moving.values())) else []
    bases = {}
    for name, members in components.items():
        rows = rows_of(system, members)
        turned = gradients(model, moving[name], rows, known)
        bases[name] = with_directions(
            system, K, rows, read[name][linear[read[name]]], turned, found[name]
        )
    return bases


def gradients(
    model: Compiled, mine: np.ndarray, rows: np.ndarray, states: Sequence[State]
) -> np.ndarray:
    """Gradients (i, n) of constraint rows `mine` by coordinates `rows` (n,) in some states, each
    row over its largest length.
    """
    if not len(mine):
        return np.zeros((0, len(rows)))
    probes = csr_array(model.system.probes.matrix)[:, rows]
    jacobians = [
        compiled.constraints_at(model, q[None], np.array([time]))[1][mine] @ probes
        for q, time in states
    ]
    found = np.array(jacobians)
    largest = np.linalg.norm(found, axis=2).max(axis=0)
    return np.asarray(
        (found / np.where(largest > 0.0, largest, 1.0)[:, None]).reshape(-1, len(rows))
    )


def with_directions(
    system: System,
    K: csr_array,
    rows: np.ndarray,
    read: np.ndarray,
    turned: np.ndarray,
    basis: Basis,
) -> Basis:
    """A basis of coordinates `rows` (n,) with directions against some rows of a system of tangent
    K.

    They are the linear constraint rows `read` (i,), and others of gradients `turned` (j, n).
    """
    if not len(read) and not len(turned):
        return basis
    numbers, A, _ = linear_part(system)
    inside = np.setdiff1d(np.arange(A.shape[0]), touched_outside(A, rows))
    inner = A[inside][:, rows].toarray()
    kept = ranks.independent_rows(inner)
    normals = np.vstack([inner[kept], independent_of(inner[kept], turned)])
    W = metric_of(system, rows)
    mine = csr_array(K[rows][:, rows])
    soft = SOFT * float(np.max(np.abs(mine.diagonal()) / W.diagonal()))
    # the static displacement against a row: what bends least for its reaction
    static = splu(csr_array(mine + (soft or 1.0) * W).tocsc()).solve(normals.T)
    wanted = np.isin(numbers[inside][kept], read)
    D = static @ np.linalg.inv(normals @ static)
    count = basis.modes.shape[1] - basis.against
    modes = pod.orthonormal(W, np.hstack([basis.modes, D[:, : len(kept)][:, wanted]]))
    rest, sizes = pod.left_singular(W, pod.outside(W, unit_columns(W, D[:, len(kept) :]), modes))
    rest = satisfy(rest[:, sizes > KNOWN].T, inner[kept], np.zeros(len(kept))).T
    modes = pod.orthonormal(W, np.hstack([modes, rest]))
    return replace(basis, modes=modes, against=modes.shape[1] - count)


def independent_of(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Orthonormal rows (k, n) that with independent `rows` (i, n) span `others` (j, n), without
    what of them is SLIGHT.
    """
    base = np.linalg.qr(rows.T)[0]
    _, sizes, found = np.linalg.svd(others - (others @ base) @ base.T, full_matrices=False)
    return np.asarray(found[sizes > SLIGHT * np.linalg.norm(others, 2)] if len(others) else others)


def unit_columns(W: csr_array, columns: np.ndarray) -> np.ndarray:
    """Columns (n, i) over their lengths in the metric W (n, n)."""
    return np.asarray(columns / np.sqrt(np.sum(columns * (W @ columns), axis=0)))
