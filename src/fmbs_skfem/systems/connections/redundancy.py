r"""Redundant constraint rows: found by rank, and left out.

    rank Phi_x(x) < m  in the start and in all positions near it        redundant rows
    rank Phi_x(x) < m  in the start alone                               a singular position (dead centre): nothing is redundant

Nearby positions are found by a random change along the null space of Phi_x, moved back onto Phi = 0
by Newton steps of least norm. Rows whose distances to the span of others, square roots of the
pivots of the sparse J J^T, are clearly above zero are looked at no further: dense arrays have only
the rows in doubt, and those that share coordinates with them, directly or by others. Linear rows
are found first, by elimination. Rows on which a driven row depends are kept: such joints may
contradict each other later. Ranks are those of rows without units: positions over the size of the
system, axes and slopes as they are.

Source: M. Wojtyra, J. Fraczek, Multibody Syst. Dyn. 30 (2013) 153-171,
doi:10.1007/s11044-013-9352-y (redundant constraints).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ...core.algebra import ranks
from ...core.algebra.linalg import Array, as_dense, distinct, is_sparse, scaled
from ...core.errors import Contradiction, say
from ...core.notices import notify
from ...core.storage.records import dataclass
from .. import kernels
from ..compiled import repeatable, signal_table
from ..prepared import Prepared, alike, prepare, remembered
from ..system import (
    Constraints,
    System,
    driven_rows,
    is_linear,
    keep_constraints,
    linear_rows,
    loose_rows,
    reads,
    sizes,
)
from . import constraint_laws, echelon
from .constraint_laws import LawRows

DIGITS = 1e-12  #: change of a row in a large motion, relative to its summands, that is round-off
SHIFT = 1e-14  #: of J J^T for unit rows, which lets factors of dependent rows exist
AMPLITUDES = (0.05, 0.02, 0.005)  #: change of the coordinates, in units of their root mean square
ITERATIONS = 20
SMALL = 100_000  #: numbers of an array whose rank costs little
FEW = 20_000  #: numbers of an array that is dense in a fraction of the time of a sparse one
CHEAP = 200_000  #: products of a rank that costs less than to see which rows share coordinates
ALONE = 1e-2  #: part of a change within which the joints hold at the start only, where they are singular
MANY = 3  #: rows of one kind up to which each is named
AGREE = 1e-6  #: weight of a driven row in a combination of rows, below which it is not part of it


@dataclass(frozen=True)
class StartRows:
    """Constraints at t = 0 on the coordinates that they read: called with z (u,), Phi (m,) and
    Phi_z (m, u).

        z = x[used]
    """

    terms: kernels.Terms
    laws: tuple[LawRows, ...]
    signals: np.ndarray
    probes: Array  #: (j, u), dense where there are few
    offset: np.ndarray  #: (j,) y at z = 0
    count: int
    used: np.ndarray  #: (u,) coordinates that the constraints read
    scale: np.ndarray  #: (u,) changes of z that count as large

    def reads(self) -> csr_array:
        """Which coordinates every row reads, wherever it is, (m, u)."""
        slopes = [np.ones(own.rows.shape) for own in self.laws]
        return csr_array(
            self.on_probes(np.ones((len(self.terms.row), 2)), slopes) @ abs(self.probes)
        )

    def on_probes(self, slopes: np.ndarray, others: Sequence[np.ndarray]) -> Array:
        """Slopes (t, 2) of the terms in their two probe rows, and (t, r) of every law, as (m, j)."""
        places = np.stack([self.terms.i, self.terms.j], axis=1)
        on = places >= 0
        values = [slopes[on]]
        row = [np.repeat(self.terms.row, 2)[on.ravel()]]
        column = [places[on]]
        for own, part in zip(self.laws, others, strict=True):
            values.append(part.ravel())
            row.append(np.repeat(own.row, own.rows.shape[1]))
            column.append(own.rows.ravel())
        entries = np.concatenate(values)
        spots = (np.concatenate(row), np.concatenate(column))
        shape = self.count, len(self.offset)
        if is_sparse(self.probes):
            return csr_array(coo_array((entries, spots), shape=shape))
        found = np.zeros(shape)
        np.add.at(found, spots, entries)
        return found

    def of_terms(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Phi (m,) of the terms at probe rows y (j,), and their slopes (t, 2) in their two probe
        rows.
        """
        terms = self.terms
        read = np.append(y, 1.0)
        signals = np.append(self.signals, 1.0)  # the number -1 reads 1
        value = terms.value * signals[terms.signal]
        first = read[terms.i]
        second = read[terms.j]
        phi = np.zeros(self.count)
        np.add.at(phi, terms.row, value * first * second)
        return phi, np.stack([value * second, value * first], axis=1)

    def __call__(self, z: np.ndarray) -> tuple[np.ndarray, Array]:
        """Phi (m,) and Phi_z (m, u)."""
        y = self.probes @ z + self.offset
        phi, slopes = self.of_terms(y)
        found = [constraint_laws.evaluate(own, y, self.signals) for own in self.laws]
        for own, (values, _) in zip(self.laws, found, strict=True):
            phi[own.row] += values
        at_probes = self.on_probes(slopes, [part for _, part in found])
        J, summands = at_probes @ self.probes, abs(at_probes) @ np.abs(y)
        # other rows, such as one of a vector that is held, are round-off
        moves = abs(J) @ self.scale > DIGITS * summands
        return phi, scaled(J, moves.astype(float), np.ones(len(z)))


def rows_of(system: System) -> tuple[StartRows, np.ndarray]:
    """The constraints of a system at t = 0, and the values (u,) at the start of the coordinates
    that they read.
    """
    terms = system.constraints
    read = distinct(reads(terms, len(system.probes.offset)).indices)
    place = np.full(len(system.probes.offset), -1)
    place[read] = np.arange(len(read))
    matrix = csr_array(system.probes.matrix[read])
    used = distinct(matrix.indices)
    few = len(read) * len(used) <= FEW
    i, j = (np.where(part >= 0, place[part], -1) for part in (terms.i, terms.j))
    flat = kernels.Terms(terms.row, terms.coefficient, terms.signal, i, j, np.full(len(i), -1))
    signals = signal_table(system, np.zeros(1))[0]
    probes = matrix[:, used].toarray() if few else csr_array(matrix[:, used])
    scale = scale_of(system)[used]
    laws = tuple(replace(own, rows=place[own.rows]) for own in terms.laws)
    return StartRows(
        flat, laws, signals, probes, system.probes.offset[read], len(terms.names), used, scale
    ), system.x0[used]


def scale_of(system: System) -> np.ndarray:
    """Changes (n,) of the unknowns that count as large in ranks.

        1 / max_i |f_i lift_in|,    f_i = 1 / size for positions [1/m], 1 for axes and slopes

    They move positions by the size of the system, or turn axes and slopes by 1, and none more.
    """
    parts = system.lift, system.unit, system.scale, system.dim
    return prepare(system).find("scale", parts, lambda: large_changes(system))


def large_changes(system: System) -> np.ndarray:
    """`scale_of`, found anew."""
    matrix = system.lift.matrix
    factor = np.repeat(np.where(system.unit > 0.5, 1.0 / system.scale, 1.0), system.dim)
    if isinstance(matrix, np.ndarray):
        largest = np.abs(factor[:, None] * matrix).max(axis=0)
    else:
        largest = np.zeros(matrix.shape[1])
        entries = np.abs(matrix.data) * np.repeat(factor, np.diff(matrix.indptr))
        np.maximum.at(largest, matrix.indices, entries)
    return 1.0 / np.where(largest > 0.0, largest, 1.0)


def row_lengths(system: System) -> np.ndarray:
    """Lengths (m,) of the constraint rows at the start for changes of `scale_of`, in the unit of
    their gaps; 1 for zeros.

        |Phi_m,n scale_n|,    the Euclidean norm over n

    Where gaps are over these lengths, units do not matter.
    """
    rows, z = rows_of(system)
    length = lengths(rows, rows(z)[1])
    return np.where(length > 0.0, length, 1.0)


def lengths(rows: StartRows, J: Array) -> np.ndarray:
    """Changes (m,) of the gaps by changes d of z that count as large.

        sqrt(sum_u J_mu^2 d_u^2)

    J (m, u), d (u,).
    """
    return np.asarray(np.sqrt((J * J) @ rows.scale**2))


def doubtful(rows: StartRows, z: np.ndarray) -> np.ndarray:
    """Rows (i,) that may depend on each other at z (u,): those within `ranks.NEAR` of others, and
    what is coupled to them.

    Pivots of a sparse factorisation of J J^T show it; none where the rows are certainly
    independent.
    """
    unit = relative(rows, z)[1]
    if rows.count * len(z) <= FEW and ranks.rank(unit, ranks.NEAR) == rows.count:
        return np.zeros(0, np.int64)
    unit = csr_array(unit)
    shifted = (unit @ unit.T + SHIFT * eye_array(rows.count)).tocsc()
    factors = splu(
        shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    near = factors.U.diagonal()[factors.perm_c] <= ranks.NEAR**2
    reads = rows.reads()
    group = connected_components(csr_array(reads @ reads.T), directed=False)[1]
    return np.flatnonzero(np.isin(group, group[near]))


def nearby(rows: StartRows, z: np.ndarray) -> list[np.ndarray]:
    """Jacobians (m, u), of unit rows and dense, in positions near z (u,) where the joints hold.

    z itself counts where nothing can move. Positions are found by random changes along the null
    space and Newton steps of least norm; there may be fewer than `AMPLITUDES`, or none.
    """
    if not len(z):
        return [np.zeros((rows.count, 0))]
    random = np.random.default_rng(0)
    found = []
    J = as_dense(relative(rows, z)[1])
    far = max(1.0, float(np.abs(z / rows.scale).max()))
    for amplitude in AMPLITUDES:
        change = amplitude * random.normal(size=len(z))
        change -= ranks.least(J, J @ change)
        moved = z + rows.scale * change
        for _ in range(ITERATIONS):
            gap, slopes = relative(rows, moved)
            if np.abs(gap).max() < 1e-13 * far:
                break
            moved = moved - rows.scale * ranks.least(as_dense(slopes), gap)
        gap, slopes = relative(rows, moved)
        back = np.abs(moved - z) / rows.scale
        if np.abs(gap).max() < 1e-11 * far and not back.max() < ALONE * np.abs(change).max():
            found.append(as_dense(slopes))
    return found


def relative(rows: StartRows, z: np.ndarray) -> tuple[np.ndarray, Array]:
    """Phi (m,) and Phi_z (m, u) at z (u,), in units of z and with rows of length 1.

    Units of lengths and equations do not matter so.
    """
    phi, J = rows(z)
    length = lengths(rows, J)
    factor = 1.0 / np.where(length > 0.0, length, 1.0)
    return factor * phi, scaled(J, factor, rows.scale)


def singular_start(system: System) -> bool:
    """Whether rows depend on each other in the start although they do not near it: a dead centre."""
    near = doubtful(*rows_of(system))
    if not len(near):
        return False
    rows, z = rows_of(keep_constraints(system, near))
    return any(ranks.rank(J, ranks.CLOSED) == rows.count for J in nearby(rows, z))


def without_redundant(system: System) -> System:
    """The system without rows that follow from the others in all positions near the start; a notice
    names them.

    Rows that are driven, or that events release or lock, stay. Contradiction where linear rows
    contradict each other. Reactions of rows that are left out are zero; `full` keeps them.

    Source: M. Wojtyra, J. Fraczek, Multibody Syst. Dyn. 30 (2013) 153-171,
    doi:10.1007/s11044-013-9352-y.
    """
    parts = system.constraints, system.probes, system.lift, system.unit, system.scale
    system = left_out(
        system,
        prepare(system).find("redundant linear", parts, lambda: redundant_linear_rows(system)),
    )
    parts = (system.constraints, *parts[1:])
    known = prepare(system) if repeatable(system) or not system.signals else Prepared()
    return left_out(
        system,
        known.find(
            "redundant", (*parts, system.x0, system.signals), lambda: redundant_rows(system)
        ),
    )


def redundant_rows(system: System) -> np.ndarray:
    """Rows (i,), linear ones or others, that follow from the others in all positions near the
    start.
    """
    none = np.zeros(0, np.int64)
    terms = system.constraints
    driven = driven_rows(terms)
    loose = loose_rows(terms)
    candidate = ~is_linear(terms) & ~driven & ~loose
    if not candidate.any():
        return none
    # what follows from a joint that is released later does not follow then
    lasting = np.flatnonzero(~loose)
    near = lasting[doubtful(*rows_of(keep_constraints(system, lasting)))]
    if not len(near):
        return none
    rows, z = rows_of(keep_constraints(system, near))
    if ranks.rank(relative(rows, z)[1], ranks.NEAR) == rows.count:
        return none
    best = max(nearby(rows, z), key=lambda J: ranks.rank(J, ranks.CLOSED), default=None)
    if best is None or ranks.rank(best, ranks.CLOSED) == rows.count:
        return none
    return near[dependent_rows(best, candidate[near], driven[near])]


def redundant_linear_rows(system: System) -> np.ndarray:
    """Rows (i,) that follow from other linear ones; Contradiction where those contradict each
    other.
    """
    none = np.zeros(0, np.int64)
    rows, entries, a = linear_rows(system)
    if not len(rows) or (len(rows) ** 2 * system.size <= CHEAP and apart(entries)):
        return none
    A = csr_array(entries)
    shared = connected_components(csr_array(abs(A) @ abs(A).T), directed=False)[1]
    mine = np.flatnonzero(np.bincount(shared)[shared] > 1)
    if not len(mine) or apart(A[mine]):
        return none
    found = echelon.solve(csr_array(A[mine]), a[mine], units=scale_of(system))
    refuse_gaps(
        [system.constraints.names[k] for k in rows[mine[found.left]]],
        found.gap,
        ranks.EXACT * system.scale,
    )
    return rows[mine[keep_held(system.constraints, rows[mine], A[mine], found.left)]]


def keep_held(constraints: Constraints, rows: np.ndarray, A: Array, left: np.ndarray) -> np.ndarray:
    """Which of `rows` (m,), A (m, n), to leave out where `left` (i,) may be: of two that are alike
    those of held edges stay.

    Which of them elimination takes is a matter of round-off, and so of the processor; what holds an
    edge once more is named.
    """
    if not len(left) or not constraints.edges:
        return left
    held = np.array([constraints.names[k][0] in constraints.edges for k in rows])
    mine = np.flatnonzero(held[left])
    others = np.setdiff1d(np.flatnonzero(~held), left)
    if not len(mine) or not len(others):
        return left
    A = csr_array(A)
    length = np.sqrt(np.asarray(A.multiply(A).sum(axis=1)).ravel())
    unit = csr_array(A.multiply(1.0 / np.maximum(length, np.finfo(float).tiny)[:, None]))
    alike = abs(unit[left[mine]] @ unit[others].T).toarray() > 1.0 - ranks.EXACT
    found = left.copy()
    free = np.ones(len(others), bool)
    for k, row in zip(mine, alike, strict=True):
        same = np.flatnonzero(row & free)
        if len(same):
            found[k], free[same[0]] = others[same[0]], False
    return found


def apart(A: Array) -> bool:
    """Whether rows (i, n) are found to be independent at small cost."""
    return A.shape[0] * A.shape[1] <= SMALL and ranks.rank(A, ranks.NEAR) == A.shape[0]


def refuse_gaps(names: list[tuple[str, str]], gap: np.ndarray, tolerance: float) -> None:
    """Contradiction that names the rows that miss those they follow from by more than a tolerance
    [m].

    `names` are joint and coordinate of the rows (k,), `gap` (k,) is what they miss; nothing where
    all are within the tolerance.
    """
    wrong = sorted(np.flatnonzero(np.abs(gap) > tolerance), key=lambda k: -abs(gap[k]))
    if wrong:
        worst = tuple((".".join(names[k]), abs(float(gap[k]))) for k in wrong)
        listed = ", ".join(f"{name} by {miss:.3g} m" for name, miss in worst)
        raise Contradiction(
            say("joints contradict each other", "rows that agree", listed, "remove or move one"),
            worst,
        )


def left_out(system: System, rows: np.ndarray) -> System:
    """The system without some rows (i,), always the same, which a notice names; their reactions are
    zero.
    """
    if not len(rows):
        return system
    notify_left_out(system.constraints, rows)

    def keep() -> tuple[Constraints, Prepared]:
        return keep_constraints(
            system, np.setdiff1d(np.arange(len(system.constraints.names)), rows)
        ).constraints, Prepared()

    def find() -> System:
        kept, known = prepare(system).find("left out", (system.constraints, rows.tobytes()), keep)
        return alike(known, replace(system, constraints=kept, full=system.full or system))

    return remembered(system, ("left out", *rows), find)


def notify_left_out(constraints: Constraints, rows: np.ndarray) -> None:
    """The notice of rows (i,) that are left out; of many of one kind, as of an edge that is held
    twice, their number.

    Nothing is said of those where held edges meet, which every symmetric model has.
    """
    kinds: dict[str, list[str]] = {}
    meeting = where_edges_meet(constraints, rows)
    for joint, row in sorted({constraints.names[k] for k in rows if int(k) not in meeting}):
        kinds.setdefault(f"{joint}.{row.split()[0]}", []).append(f"{joint}.{row}")
    if not kinds:
        return
    listed = ", ".join(
        ", ".join(rows) if len(rows) <= MANY else f"{kind} ({len(rows)} rows)"
        for kind, rows in kinds.items()
    )
    notify(f"redundant constraint rows are left out (their reactions are not unique): {listed}")


def where_edges_meet(constraints: Constraints, rows: np.ndarray) -> set[int]:
    """Those of `rows` (i,) that are left out where held edges meet: of edges that keep half of
    their rows of a component.
    """
    gone = Counter(kind_of(constraints.names[k]) for k in rows)
    whole = Counter(kind_of(name) for name in constraints.names)
    kinds = {
        kind for kind in gone if kind[0] in constraints.edges and 2 * gone[kind] <= whole[kind]
    }
    return {int(k) for k in rows if kind_of(constraints.names[k]) in kinds}


def kind_of(name: tuple[str, str]) -> tuple[str, str]:
    """Joint and component of a row."""
    return name[0], name[1].split()[0]


def notify_projected(system: System, change: np.ndarray, why: str = "") -> None:
    """Notice by how much initial velocities change (n,) where joints do not let them be, and why.

    The size is the root mean square over the mass [m/s].
    """
    size = float(sizes(system, change)[0])
    text = f"initial velocities are projected onto the joints; that changes them by {size:.3g} m/s, root mean square over the mass"
    notify(f"{text}; {why}" if why else text)


def dependent_rows(J: np.ndarray, candidate: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Candidates that follow from rows of J (m, u) kept before them; none where driven rows or
    others are dependent themselves.
    """
    kept, dropped, weights = ranks.part(J, ranks.CLOSED, ~candidate)
    contradicts = np.abs(weights[:, driven[kept]]).max(initial=0.0) > AGREE
    return dropped[:0] if contradicts or not candidate[dropped].all() else dropped
