r"""Forces of linear joints that were eliminated, from the residual of the full system.

    A^T lambda = - r,    - lambda = C^T r of least norm,    r = M q'' + f - Q

Rows that follow from others, such as those of two edges that meet, share what they carry, in
whichever order they come. The rank of A is what elimination found (`assembly.kept_rows`), and is
not decided anew: singular values of rows that follow from others are round-off, and their inverses
would make forces of nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ..core.algebra.linalg import as_csr
from ..core.errors import Contradiction, say
from ..systems.assembly import kept_rows
from ..systems.compiled import compile_system, elastic_tangent
from ..systems.connections import echelon, redundancy
from ..systems.prepared import remembered
from ..systems.system import System, linear_part

#: force of a row, over stiffness times size, that is round-off: 1e-16 of sums of some hundred
#: terms. Rows that differ by 1e-4 rad reach a tenth of it, ranks decided at round-off 1e4 times
NOTHING = 1e-12


def of_rows(full: System, known: frozenset[tuple[str, str]]) -> tuple[np.ndarray, csr_array]:
    """Linear rows (k,) of a full system but for `known` ones, and C (n, k), by which their forces
    follow from a residual r.

        C^T r

    Contradiction names edges whose rows make forces of nothing, see `require_none_without_load`.
    """

    def find() -> tuple[np.ndarray, csr_array]:
        rows, A, _ = linear_part(full)
        mine = np.array(
            [k for k, row in enumerate(rows) if full.constraints.names[row] not in known],
            dtype=np.int64,
        )
        A = csr_array(A[mine])
        C = echelon.inverse(A, np.flatnonzero(np.isin(mine, kept_rows(full))))
        require_none_without_load(full, rows[mine], A, C)
        return rows[mine], C

    return remembered(full, ("recovery", known), find)


def require_none_without_load(full: System, rows: np.ndarray, A: csr_array, C: csr_array) -> None:
    """Contradiction with the held edges that carry more than round-off where the body is where it
    is, moved as a whole.

        |C^T K t| < 1e-12 max(s . |K| s) / (|A| s),      K t = 0

    t is a translation by the size s of the system, K the elastic tangent at the start. `rows` (k,)
    are those of A (k, n), C (n, k).
    """
    joints = [full.constraints.names[row][0] for row in rows]
    if not set(joints) & set(full.constraints.edges):
        return
    scale = redundancy.scale_of(full)
    K = as_csr(elastic_tangent(compile_system(full), full.x0, 0.0))
    whole = np.zeros((full.size, full.dim))
    unit = np.kron(full.unit[:, None], np.eye(full.dim))
    whole[: len(unit)] = full.scale * unit
    energy = float((scale * (abs(K) @ scale)).max(initial=0.0))
    force = np.abs(C.T @ (K @ whole)).max(axis=1) * (abs(A) @ scale)
    wrong = dict[str, float]()
    for joint, value in zip(joints, force, strict=True):
        if joint in full.constraints.edges and value > NOTHING * energy:
            wrong[joint] = max(wrong.get(joint, 0.0), float(value) / energy)
    if wrong:
        listed = ", ".join(f"'{joint}'" for joint in wrong)
        got = f"{max(wrong.values()):.1g} of stiffness times size"
        why = "they nearly contradict each other where they meet"
        raise Contradiction(
            say(f"held edges {listed}", "no forces without a load", got, why), tuple(wrong.items())
        )
