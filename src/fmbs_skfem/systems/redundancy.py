r"""Redundant nonlinear constraint rows: found by rank, and left out.

    rank Phi_x(x) < m  in the start and in all positions near it        redundant rows
    rank Phi_x(x) < m  in the start alone                               a singular position (dead centre): nothing is redundant

Nearby positions are found by a random change along the null space of Phi_x, moved back onto Phi = 0 by Newton steps of least norm.
Linear rows are kept (elimination drops redundant ones), and so are rows on which a driven row depends: those joints may contradict
each other later.

Source: M. Wojtyra, J. Fraczek, Multibody Syst. Dyn. 30 (2013) 153-171, doi:10.1007/s11044-013-9352-y (redundant constraints).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_array

from ..core.linalg import rank
from ..core.notices import notify
from . import kernels
from .compiled import signal_table
from .system import System, is_linear, keep_constraints

START = 1e-5  #: smallest pivot of unit rows at the start, which may miss the joints a little, that needs no closer look
RANK = 1e-8  #: smallest pivot of unit rows that counts as independent in a position where the joints hold
AMPLITUDES = (0.05, 0.02, 0.005)  #: change of the coordinates, in units of their root mean square
ITERATIONS = 20


@dataclass(frozen=True)
class Rows:
    """Constraints at t = 0 on the coordinates z = x[used] that they read."""

    terms: kernels.Terms
    signals: np.ndarray
    probes: np.ndarray  #: (j, u)
    offset: np.ndarray  #: (j,) y at z = 0
    count: int

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Phi (m,) and Phi_z (m, u)."""
        y = self.probes @ z + self.offset
        phi, slopes = np.zeros(self.count), np.zeros((self.count, len(y)))
        kernels.constrain(self.terms, y, self.signals, phi, slopes)
        return phi, slopes @ self.probes


def rows_of(system: System) -> tuple[Rows, np.ndarray]:
    """The constraints of a system, and the values (u,) at the start of the coordinates that they read."""
    terms = system.constraints
    read = np.unique(np.concatenate([terms.i[terms.i >= 0], terms.j[terms.j >= 0]]))
    place = np.full(len(system.probes.offset), -1)
    place[read] = np.arange(len(read))
    matrix = csr_array(system.probes.matrix)[read]
    used = np.unique(matrix.indices)
    i, j = (np.where(part >= 0, place[part], -1) for part in (terms.i, terms.j))
    flat = kernels.Terms(terms.row, terms.coefficient, terms.signal, i, j, np.full(len(i), -1))
    signals = signal_table(system, np.zeros(1))[0]
    dense = np.ascontiguousarray(matrix[:, used].toarray())
    return Rows(flat, signals, dense, system.probes.offset[read], len(terms.names)), system.x0[used]


def units(J: np.ndarray) -> np.ndarray:
    """Rows scaled to length 1; rows of zeros stay."""
    length = np.linalg.norm(J, axis=1, keepdims=True)
    return J / np.where(length > 0.0, length, 1.0)


def nearby(rows: Rows, z: np.ndarray) -> list[np.ndarray]:
    """Jacobians in positions near z where the joints hold."""
    random, size, found = np.random.default_rng(0), float(np.sqrt(np.mean(z**2))) or 1.0, []
    J = rows(z)[1]
    for amplitude in AMPLITUDES:
        change = amplitude * size * random.normal(size=len(z))
        moved = z + change - np.linalg.lstsq(J, J @ change, rcond=1e-9)[0]
        for _ in range(ITERATIONS):
            phi, slopes = rows(moved)
            if np.abs(phi).max() < 1e-13 * max(1.0, float(np.abs(z).max())):
                break
            moved = moved - np.linalg.lstsq(slopes, phi, rcond=1e-9)[0]
        if np.abs(rows(moved)[0]).max() < 1e-11 * max(1.0, float(np.abs(z).max())):
            found.append(rows(moved)[1])
    return found


def singular_start(system: System) -> bool:
    """Whether rows depend on each other in the start although they do not near it."""
    rows, z = rows_of(system)
    return any(rank(J, RANK) == rows.count for J in nearby(rows, z))


def without_redundant(system: System) -> System:
    """The system without nonlinear rows that follow from the others in all positions near the start; a notice names them."""
    terms = system.constraints
    candidate = ~is_linear(terms)
    driven = np.zeros(len(terms.names), dtype=bool)
    driven[terms.row[terms.signal >= 0]] = True
    candidate &= ~driven
    if not candidate.any():
        return system
    rows, z = rows_of(system)
    if rank(rows(z)[1], START) == rows.count:
        return system
    near = nearby(rows, z)
    best = max(near, key=lambda J: rank(J, RANK), default=None)
    if best is None or rank(best, RANK) == rows.count:
        return system
    dropped = dependent_rows(units(best), candidate, driven)
    if not len(dropped):
        return system
    listed = ", ".join(".".join(terms.names[k]) for k in dropped)
    notify(f"redundant constraint rows are left out (their reactions are not unique): {listed}")
    kept = keep_constraints(system, np.setdiff1d(np.arange(rows.count), dropped))
    return replace(kept, full=system.full or system)


def dependent_rows(J: np.ndarray, candidate: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Candidates that follow from rows of J (m, u) kept before them; none where driven rows or others are dependent themselves."""
    rest, mine = np.flatnonzero(~candidate), np.flatnonzero(candidate)
    if rank(J[rest], RANK) < len(rest):
        return mine[:0]
    Q = qr(J[rest].T, mode="economic")[0] if len(rest) else np.zeros((J.shape[1], 0))
    left = J[mine] - (J[mine] @ Q) @ Q.T
    triangle, order = qr(left.T, mode="r", pivoting=True)
    count = int((np.abs(np.diag(triangle)) > RANK).sum())
    kept, dropped = np.concatenate([rest, mine[order[:count]]]), np.sort(mine[order[count:]])
    weights = np.linalg.lstsq(J[kept].T, J[dropped].T, rcond=None)[0]
    contradicts = np.abs(weights[driven[kept]]).max(initial=0.0) > 1e-6
    return mine[:0] if contradicts else dropped
