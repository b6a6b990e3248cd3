"""A System as the arrays that compiled code reads, with the unknowns in an order of small bandwidth."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np
from scipy.sparse import coo_array, csr_array, kron
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from ..bodies import laws as elastic_laws
from ..bodies.body import Cells
from ..core.linalg import as_dense, is_sparse, mirrored
from . import gathers, kernels, quartic, sparse, springs, turning
from .kernels import Arrays, Csr, Forces, Groups, Operator, Pairs, Scatter, Terms
from .lengths import LIGHT
from .quartic import Quartic
from .springs import ANGLE
from .system import LoadKind, System

DENSE = 48  #: systems of at most this size are always treated as dense
WIDE = 20_000  #: systems from this size on are sparse without looking for a band
BAND = 96  #: widest band that is factored as a band


class Storage(Enum):
    """How the iteration matrix is stored."""

    DENSE = "dense"
    BAND = "band"
    SPARSE = "sparse"


@dataclass(frozen=True)
class Compiled:
    """Arrays of a system with its unknowns permuted: compiled x = x[order]."""

    system: System
    arrays: Arrays
    order: np.ndarray  #: (n,)
    work: int  #: length of a work vector
    laws: tuple[elastic_laws.Law, ...]  #: in use, by their numbers
    plan: sparse.Plan | None  #: where the iteration matrix is sparse

    @property
    def constraints(self) -> int:
        return len(self.system.constraints.names)

    def buffers(self) -> tuple[np.ndarray, np.ndarray]:
        """Work space of the kernels: body (3, q) and work (3, w)."""
        return np.zeros((3, len(self.arrays.lift_offset))), np.zeros((3, self.work))


def compile_system(system: System) -> Compiled:
    """Choose order and storage, and flatten a system."""
    cells = gathers.collect(system)
    form, order, width = chosen_storage(system, cells)
    dense, large, place = form is Storage.DENSE, form is Storage.SPARSE, np.argsort(order)

    def scatter_map(part: Cells) -> gathers.Map:
        return gathers.scatter_map(part, csr_array(cells.lift.matrix), place, dense, width)

    flat = gathers.flatten(system.dim, cells, gathers.nowhere if large else scatter_map)
    beta = np.array([e.beta for e in system.elastic])[cells.owners] if len(cells.groups) else np.zeros(1)
    in_use = elastic_laws.addresses(flat.laws, system.dim, bool(np.any(beta > 0.0)))
    polynomials = quartic.addresses(any(isinstance(part, Quartic) for _, part in cells.groups))
    groups = Groups(flat.table, beta, flat.integers, flat.numbers, in_use, polynomials)
    terms, forces, pairs = laws_of(system)
    probes = permuted(system.probes.matrix, order)
    target, factor = pair_targets(probes, [] if large else pairs)
    store = no_store if large else dense_of if dense else lower_band

    def operator(A: csr_array | np.ndarray) -> Operator:
        return constant(permuted(A, order, True), store(A, place, width), dense, large, system.dim)

    arrays = Arrays(
        groups=groups,
        scatter=Scatter(*flat.scatter),
        lift=triple(permuted(cells.lift.matrix, order)),
        lift_offset=cells.lift.offset,
        mass=operator(system.mass),
        damping=operator(system.damping),
        stiffness=operator(system.stiffness),
        dense=dense,
        probes=triple(probes),
        probes_offset=np.ascontiguousarray(system.probes.offset),
        terms=terms,
        forces=forces,
        pairs=Pairs(target, factor, len(pairs)),
        load=np.ascontiguousarray(system.loads.constant[order]),
        turning=turning.nothing(system.size),
        norm=np.ascontiguousarray(system.metric.diagonal()[order] / system.weight),
    )
    if dense and not cells.cells:
        arrays = arrays._replace(turning=turning.turning(system, partial(part_tangent, arrays, flat.work, cells.owners)))
    return Compiled(system, arrays, order, flat.work, flat.laws, sparse.plan(cells, groups, flat.work) if large else None)


def chosen_storage(system: System, cells: gathers.Collected) -> tuple[Storage, np.ndarray, int]:
    """How the iteration matrix is stored, the order of the unknowns, and the half bandwidth of a band."""
    natural = np.arange(system.size)
    dense = not is_sparse(system.lift.matrix) or system.size <= DENSE
    if not dense and system.size >= WIDE:
        return Storage.SPARSE, natural, system.size - 1
    order, width = (natural, system.size - 1) if dense else band_order(coupling(system, cells))
    dense = dense or (3 * width > system.size and system.size <= 4 * BAND)
    loose = not dense and massless(system, cells)
    if dense or (loose and system.size <= 8 * DENSE):
        return Storage.DENSE, natural, width
    return (Storage.SPARSE, natural, width) if loose or width > BAND else (Storage.BAND, order, width)


def storage(system: System) -> tuple[Storage, int]:
    """How the iteration matrix of a system is stored, and the half bandwidth of a band; nothing is made of wide systems."""
    if is_sparse(system.lift.matrix) and system.size >= WIDE:
        return Storage.SPARSE, system.size - 1
    form, _, width = chosen_storage(system, gathers.collect(system))
    return form, width


def laws_of(system: System) -> tuple[Terms, Forces, list[tuple[int, int]]]:
    """Constraints and loads of a system for the kernels, and the pairs of probe rows in which they have second derivatives."""
    terms, loads = system.constraints, system.loads
    term_pair, law_pair, pairs = pair_table(system)
    laws = [[int(law.kind), law.slope, law.position, law.signal, first] for law, first in zip(loads.laws, law_pair, strict=True)]
    forces = Forces(
        loads.row,
        loads.coefficient,
        loads.signal,
        np.array(laws, dtype=np.int64).reshape(-1, 5),
        np.array([law.vector for law in loads.laws], dtype=float).reshape(-1, 3),
        system.dim,
    )
    return Terms(terms.row, terms.coefficient, terms.signal, terms.i, terms.j, term_pair), forces, pairs


def size(model: Compiled, displacement: np.ndarray) -> float:
    """Root mean square of a displacement (n,) [m], with the diagonal of the metric."""
    return float(np.sqrt(model.system.metric.diagonal() @ displacement**2 / model.system.weight))


def part_tangent(A: Arrays, work: int, owners: np.ndarray, number: int, x: np.ndarray) -> np.ndarray:
    """Tangent of one elastic part of a dense system (n, n) at x, from all its groups."""
    mine = owners == number
    groups, W = A.groups._replace(table=A.groups.table[mine], beta=A.groups.beta[mine]), np.zeros((len(x), len(x)))
    kernels.add_elastic_tangent(groups, A.scatter, A.lift, A.lift_offset, x, np.zeros(0), 0.0, np.zeros((3, work)), W)
    return W


def massless(system: System, cells: gathers.Collected) -> bool:
    """Whether unknowns have neither mass nor elastic energy, as axes of thin rigid parts: only joints determine them."""
    rows = [gathers.cell_coordinates(part).ravel() for _, part in cells.groups if isinstance(part, Cells)]
    used = coo_array(csr_array(cells.lift.matrix)[np.unique(np.concatenate(rows))]) if rows else coo_array((0, system.size))
    held = np.unique(used.col[used.data != 0.0])
    free = np.setdiff1d(np.arange(system.size), held)
    mass = csr_array(system.mass)
    least = LIGHT * mass.diagonal().max(initial=0.0)
    try:
        pivots = splu(mass[free][:, free].tocsc()).U.diagonal() if len(free) else np.array([np.inf])
    except RuntimeError:  # SuperLU: exactly singular
        return True
    return bool(np.abs(pivots).min() <= least)


def constant(A: csr_array, store: np.ndarray, dense: bool, large: bool, dim: int) -> Operator:
    """A constant matrix in the storage of its product."""
    entries = coo_array(A)
    used = entries.data != 0.0
    none = triple(csr_array((0, A.shape[1])))
    alone = bool((entries.row[used] == entries.col[used]).all())
    if large or (dense and not alone) or not used.any():
        rows, components = vectorwise(A, dim) if large and used.any() else (none, 1)
        return Operator(np.zeros(0, np.int64), np.zeros((0, len(store))), rows, components, store, bool(dense and used.any()))
    i, j = entries.row[used], entries.col[used]
    offsets, k = np.unique(j.astype(np.int64) - i, return_inverse=True)
    data = np.zeros((len(offsets), A.shape[0]))
    np.add.at(data, (k, i), entries.data[used])
    return Operator(offsets, data, none, 1, store, False)


def vectorwise(A: csr_array, dim: int) -> tuple[Csr, int]:
    """A, or B with A = B (x) I over vectors of `dim` components where it has that form, and the number of components of a row."""
    if A.shape[0] % dim == 0:
        B = csr_array(A[::dim, ::dim])
        if abs(A - csr_array(kron(B, np.eye(dim)))).max() == 0.0:
            return triple(B), dim
    return triple(A), 1


def triple(A: csr_array) -> Csr:
    A = csr_array(A)
    A.sum_duplicates()
    return Csr(A.indptr.astype(np.int64), A.indices.astype(np.int64), A.data.astype(float))


def permuted(A: csr_array | np.ndarray, order: np.ndarray, rows: bool = False) -> csr_array:
    """Columns (and rows) of A in the new order."""
    if (np.diff(order) == 1).all():
        return csr_array(A)
    A = csr_array(A)[:, order]
    return csr_array(A[order] if rows else A)


def coupling(system: System, cells: gathers.Collected) -> csr_array:
    """Pattern of the iteration matrix (n, n)."""
    touched = [abs(csr_array(A)) for A in (system.mass, system.damping, system.stiffness)]
    pattern = touched[0] + touched[1] + touched[2]
    lift = abs(csr_array(cells.lift.matrix))
    for part in cells.cells:
        local = gathers.cell_coordinates(part)
        rows = np.repeat(np.arange(local.shape[1])[None, :], local.shape[0], axis=0)
        shape = (local.shape[1], lift.shape[0])
        incidence = csr_array((np.ones(local.size), (rows.ravel(), local.ravel())), shape=shape) @ lift
        pattern = pattern + incidence.T @ incidence
    probes = abs(csr_array(system.probes.matrix))
    for i, j in pair_table(system)[2]:
        pattern = pattern + probes[[i]].T @ probes[[j]]
    pattern = csr_array(pattern + pattern.T)
    pattern.eliminate_zeros()
    return pattern


def band_order(pattern: csr_array) -> tuple[np.ndarray, int]:
    """The better of the natural and the reverse Cuthill-McKee order, and its half bandwidth."""

    def width(order: np.ndarray) -> int:
        place = np.argsort(order)
        entries = pattern.tocoo()
        return int(np.abs(place[entries.row] - place[entries.col]).max(initial=0))

    natural, packed = np.arange(pattern.shape[0]), reverse_cuthill_mckee(pattern, symmetric_mode=True)
    return (natural, width(natural)) if width(natural) <= width(packed) else (packed, width(packed))


def lower_band(A: csr_array | np.ndarray, place: np.ndarray, width: int) -> np.ndarray:
    """band[j, i - j] = A[i, j] for i >= j."""
    entries = coo_array(A)
    i, j = place[entries.row], place[entries.col]
    band, low = np.zeros((len(place), width + 1)), (i >= j) & (entries.data != 0.0)
    np.add.at(band, (j[low], (i - j)[low]), entries.data[low])
    return band


def no_store(A: csr_array | np.ndarray, place: np.ndarray, width: int) -> np.ndarray:
    return np.zeros((0, 1))


def dense_of(A: csr_array | np.ndarray, place: np.ndarray, width: int) -> np.ndarray:
    return np.ascontiguousarray(as_dense(A))


def pair_table(system: System) -> tuple[np.ndarray, list[int], list[tuple[int, int]]]:
    """Pairs of probe rows with second derivatives: pair of every constraint term, first pair of every law, the pairs."""
    pairs: list[tuple[int, int]] = []
    terms = system.constraints
    term_pair = np.full(len(terms.row), -1, dtype=np.int64)
    for k in np.flatnonzero(terms.j >= 0):
        term_pair[k] = len(pairs)
        i, j = int(terms.i[k]), int(terms.j[k])
        pairs += [(i, i), (i, j), (j, i), (j, j)] if terms.signal[k] == ANGLE else [(i, j), (j, i)]
    law_pair = []
    for law in system.loads.laws:
        law_pair.append(len(pairs))
        if law.kind is LoadKind.SPRING:
            arms = [first + c for first in (law.slope, law.position) if first >= 0 for c in range(2)]
            pairs += [(a, b) for a in arms for b in arms]
            continue
        first = law.slope if law.position < 0 else law.position
        pairs += [(first + c, law.slope + d) for c in range(system.dim) for d in range(system.dim)]
    return term_pair, law_pair, pairs


def pair_targets(probes: csr_array, pairs: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Entries of P^T H P: (h, 3) pair, row, column; factor (h,)."""
    target, factor = [np.zeros((0, 3), np.int64)], [np.zeros(0)]
    for number, (a, b) in enumerate(pairs):
        product = coo_array(probes[[a]].T @ probes[[b]])
        target.append(np.stack([np.full(product.nnz, number), product.row, product.col], axis=1).astype(np.int64))
        factor.append(product.data)
    return np.concatenate(target), np.concatenate(factor)


def signal_table(system: System, times: np.ndarray) -> np.ndarray:
    """Values of all signals, (s, k)."""
    return (
        np.array([np.broadcast_to(np.asarray(f(times), dtype=float), times.shape) for f in system.signals])
        .T.reshape(len(times), -1)
        .copy()
    )


def forces(model: Compiled, x: np.ndarray, v: np.ndarray, t: float = 0.0, angles: np.ndarray | None = None) -> np.ndarray:
    """C v + K x + elastic and damping forces minus loads, (n,), without inertia and constraints.

    `angles` (l,) are those of springs before (`followed`); without them springs have turned by less than half a turn.
    """
    A = model.arrays
    body, work = model.buffers()
    f = np.zeros(len(x))
    y, g = np.zeros(len(A.probes_offset)), np.zeros(len(A.probes_offset))
    xc, vc = np.ascontiguousarray(x[model.order]), np.ascontiguousarray(v[model.order])
    kernels.add_elastic_force(A.groups, A.lift, A.lift_offset, xc, vc, body, work, f)
    kernels.add_operator(A.damping, vc, f)
    kernels.add_operator(A.stiffness, xc, f)
    kernels.affine(A.probes, A.probes_offset, xc, y)
    kernels.add_loads(A.forces, A.probes, y, vc, signal_table(model.system, np.array([t]))[0], last_angles(model.system, angles), g)
    kernels.add_transposed(A.probes, -1.0, g, f)
    f -= A.load
    out = np.zeros_like(f)
    out[model.order] = f
    return out


def last_angles(system: System, angles: np.ndarray | None = None) -> np.ndarray:
    """The given angles of the load laws of a system, (l,), those of the reference without them."""
    return np.zeros(len(system.loads.laws)) if angles is None else angles


def followed(model: Compiled, x: np.ndarray, angles: np.ndarray | None = None) -> np.ndarray:
    """Angles of all springs at x that are nearest to those before, (l,)."""
    A, found = model.arrays, last_angles(model.system, angles).copy()
    springs.follow(A.forces.laws, A.probes, A.probes_offset, np.ascontiguousarray(x[model.order]), found)
    return found


def strain_energy(model: Compiled, x: np.ndarray) -> float:
    """Strain energy of all bodies [J], without linear springs."""
    A = model.arrays
    body, work = model.buffers()
    return float(kernels.elastic_energy(A.groups, A.lift, A.lift_offset, np.ascontiguousarray(x[model.order]), body[0], work))


def gap(model: Compiled, x: np.ndarray, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Phi (m,) and Phi_x (m, n)."""
    A, m = model.arrays, model.constraints
    y = np.asarray(model.system.probes(x))
    phi, jacobian = np.zeros(m), np.zeros((m, len(y)))
    kernels.constrain(A.terms, y, signal_table(model.system, np.array([t]))[0], phi, jacobian)
    return phi, np.asarray(jacobian @ model.system.probes.matrix)


def tangent(
    model: Compiled, x: np.ndarray, multipliers: np.ndarray, t: float = 0.0, gh: float = 0.0, angles: np.ndarray | None = None
) -> csr_array:
    """d(forces + Phi_x^T lambda)/dx + gh d forces/dv as a sparse array, exact (n, n)."""
    K = sparse.tangent(model.plan, x, gh) if model.plan else stored_tangent(model, x, gh)
    return csr_array(K + attached(model.system, x, multipliers, t, gh, angles) + gh * csr_array(model.system.damping))


def attached(
    system: System, x: np.ndarray, multipliers: np.ndarray, t: float = 0.0, gh: float = 0.0, angles: np.ndarray | None = None
) -> csr_array:
    """What constant springs, joints and loads add to the tangent (n, n)."""
    K, (terms, forces, pairs) = csr_array(system.stiffness), laws_of(system)
    if not pairs:
        return K
    H, y, P = np.zeros(len(pairs)), np.asarray(system.probes(x)), csr_array(system.probes.matrix)
    signals, still = signal_table(system, np.array([t]))[0], np.zeros_like(x)
    kernels.constraint_slopes(terms, y, signals, multipliers, H)
    kernels.load_slopes(forces, triple(P), y, still, signals, last_angles(system, angles), -1.0, gh, H)
    i, j = np.array(pairs).T
    return csr_array(K + P.T @ csr_array((H, (i, j)), shape=(P.shape[0], P.shape[0])) @ P)


def stored_tangent(model: Compiled, x: np.ndarray, gh: float) -> csr_array:
    """Elastic tangent of a band or dense system (n, n)."""
    A = model.arrays
    body, work = model.buffers()
    W = np.zeros_like(A.mass.store)
    at = np.ascontiguousarray(x[model.order])
    kernels.add_elastic_tangent(A.groups, A.scatter, A.lift, A.lift_offset, at, body[0], gh, work, W)
    inverse = np.argsort(model.order)
    return csr_array(W if A.dense else from_lower_band(W))[inverse][:, inverse]


def from_lower_band(band: np.ndarray) -> csr_array:
    """The symmetric sparse array of a lower band."""
    n, width = band.shape
    j = np.repeat(np.arange(n), width)
    i = j + np.tile(np.arange(width), n)
    inside = i < n
    return mirrored(csr_array((band.ravel()[inside], (i[inside], j[inside])), shape=(n, n)))
