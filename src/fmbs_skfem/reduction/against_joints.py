r"""Directions against joints inside components, so that reduced models know the reactions of these joints.

    (K + s W) D = A^T,   D (A D)^-1,     q = U xi + D w + qbar,     A D w = 0  with multipliers

A linear constraint A q + a = 0 inside a component holds in every mode of its basis: as an equation of the modes it is 0 = 0, and
the multiplier that it has in the full model is lost. One more direction for each such row, with the row as an equation that keeps
it at zero, leaves the motion as it is, and the multiplier is the force that the residual has along that direction. It is the static
displacement which opens the row: an error dq of the motion has no share in its elastic force, A dq = 0. Of free bodies it is the
rigid motion which opens it, and the reaction the balance of forces. Only joints that an output reads have them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ..core import ranks
from ..systems import compiled
from ..systems.compiled import compile_system
from ..systems.system import System, linear_part
from . import pod
from .component import metric_of, rows_of, touched_outside
from .pod import Basis

MANY = 24  #: rows of a component up to which reactions are worth their directions: not those of whole edges
SOFT = 1e-10  #: of K, over its largest rates, that W adds: rigid motions are free, and no motion of the modes is that slow


def rows_read(system: System, rows: np.ndarray) -> np.ndarray:
    """Numbers (i,) of the constraint rows inside a component with coordinates `rows` (n,) whose reactions an output reads."""
    joints = {output.joint for output in system.outputs.values() if output.joint}
    numbers, A, _ = linear_part(system)
    inside = np.setdiff1d(np.arange(A.shape[0]), touched_outside(A, rows))
    found = [number for number in numbers[inside] if system.constraints.names[number][0] in joints]
    return np.array(found if len(found) <= MANY else [], dtype=np.int64)


def add_directions(system: System, components: Mapping[str, Sequence[str]], found: Mapping[str, Basis]) -> dict[str, Basis]:
    """Bases with directions against the rows inside their components that outputs read, behind their own modes."""
    read = {name: rows_read(system, rows_of(system, members)) for name, members in components.items()}
    if not any(map(len, read.values())):
        return dict(found)
    model = compile_system(system)
    K = csr_array(compiled.tangent(model, system.x0, np.zeros(model.constraints), 0.0, 0.0))
    return {name: with_directions(system, K, rows_of(system, components[name]), read[name], found[name]) for name in components}


def with_directions(system: System, K: csr_array, rows: np.ndarray, read: np.ndarray, basis: Basis) -> Basis:
    """A basis of coordinates `rows` (n,) with directions against the constraint rows `read` (i,) of a system of tangent K."""
    if not len(read):
        return basis
    numbers, A, _ = linear_part(system)
    inside = np.setdiff1d(np.arange(A.shape[0]), touched_outside(A, rows))
    inner = A[inside][:, rows].toarray()
    kept = ranks.independent_rows(inner)
    W, mine = metric_of(system, rows), csr_array(K[rows][:, rows])
    soft = SOFT * float(np.max(np.abs(mine.diagonal()) / W.diagonal()))
    static = splu(csr_array(mine + (soft or 1.0) * W).tocsc()).solve(inner[kept].T)
    wanted = np.flatnonzero(np.isin(numbers[inside][kept], read))
    D = static @ np.linalg.inv(inner[kept] @ static)[:, wanted]
    modes = pod.orthonormal(W, np.hstack([basis.modes, D]))
    return replace(basis, modes=modes, against=basis.against + len(wanted))
