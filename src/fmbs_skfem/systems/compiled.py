"""A System as the arrays that compiled code reads, with the unknowns in an order of small bandwidth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_array, coo_array, csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from ..bodies.body import Cells
from ..core.linalg import as_dense, is_sparse
from . import kernels
from .kernels import Arrays, Csr, Diagonals, Forces, Groups, Pairs, Scatter, Terms
from .system import System

DENSE = 48  #: systems of at most this size are always treated as dense


@dataclass(frozen=True)
class Compiled:
    """Arrays of a system with its unknowns permuted: compiled x = x[order]."""

    system: System
    arrays: Arrays
    order: np.ndarray  #: (n,)
    work: int  #: length of a work vector

    @property
    def constraints(self) -> int:
        return len(self.system.constraints.names)

    def buffers(self) -> tuple[np.ndarray, np.ndarray]:
        """Work space of the kernels: body (3, q) and work (3, w)."""
        return np.zeros((3, len(self.arrays.lift_offset))), np.zeros((3, self.work))


def compile_system(system: System) -> Compiled:
    """Choose order and storage, and flatten a system."""
    pattern = coupling(system)
    dense = not is_sparse(system.lift.matrix) or system.size <= DENSE
    order, width = band_order(pattern) if not dense else (np.arange(system.size), system.size - 1)
    dense = dense or 3 * width > system.size
    order = np.arange(system.size) if dense else order
    place = np.argsort(order)
    groups, integers, numbers, scatter, work = flatten(system, place, dense, width)
    terms, loads = system.constraints, system.loads
    term_pair, law_pair, pairs = pair_table(system)
    probes = permuted(system.probes.matrix, order)
    target, factor = pair_targets(probes, pairs)
    has_cells = any(isinstance(e.gather, Cells) for e in system.elastic)
    lift = permuted(system.lift.matrix, order) if has_cells else csr_array((0, system.size))
    store = dense_of if dense else lower_band
    laws = [[int(law.kind), law.slope, law.position, law.signal, first] for law, first in zip(loads.laws, law_pair, strict=True)]
    arrays = Arrays(
        groups=Groups(groups, np.array([e.beta for e in system.elastic] or [0.0]), integers, numbers),
        scatter=Scatter(*scatter),
        lift=triple(lift),
        lift_offset=np.ascontiguousarray(system.lift.offset) if has_cells else np.zeros(0),
        mass=diagonals(permuted(system.mass, order, True)),
        damping=diagonals(permuted(system.damping, order, True)),
        stiffness=diagonals(permuted(system.stiffness, order, True)),
        mass_band=store(system.mass, place, width),
        damping_band=store(system.damping, place, width),
        stiffness_band=store(system.stiffness, place, width),
        dense=dense,
        probes=triple(probes),
        probes_offset=np.ascontiguousarray(system.probes.offset),
        terms=Terms(terms.row, terms.coefficient, terms.signal, terms.i, terms.j, term_pair),
        forces=Forces(
            loads.row,
            loads.coefficient,
            loads.signal,
            np.array(laws, dtype=np.int64).reshape(-1, 5),
            np.array([law.vector for law in loads.laws], dtype=float).reshape(-1, 3),
            system.dim,
        ),
        pairs=Pairs(target, factor, len(pairs)),
        load=np.ascontiguousarray(loads.constant[order]),
    )
    return Compiled(system, arrays, order, work)


def triple(A: csr_array) -> Csr:
    A = csr_array(A)
    return Csr(A.indptr.astype(np.int64), A.indices.astype(np.int64), A.data.astype(float))


def diagonals(A: csr_array) -> Diagonals:
    entries = coo_array(A)
    used = entries.data != 0.0
    i, j = entries.row[used], entries.col[used]
    offsets, k = np.unique(j.astype(np.int64) - i, return_inverse=True)
    data = np.zeros((len(offsets), A.shape[0]))
    np.add.at(data, (k, i), entries.data[used])
    return Diagonals(offsets, data)


def permuted(A: csr_array | np.ndarray, order: np.ndarray, rows: bool = False) -> csr_array:
    """Columns (and rows) of A in the new order."""
    A = csr_array(A)[:, order]
    return csr_array(A[order] if rows else A)


def coupling(system: System) -> csr_array:
    """Pattern of the iteration matrix (n, n)."""
    touched = [abs(csr_array(A)) for A in (system.mass, system.damping, system.stiffness)]
    pattern = touched[0] + touched[1] + touched[2]
    lift = abs(csr_array(system.lift.matrix))
    for elastic in system.elastic:
        if isinstance(elastic.gather, Cells):
            local = cell_coordinates(elastic.gather)
            rows = np.repeat(np.arange(local.shape[1])[None, :], local.shape[0], axis=0)
            incidence = (
                csr_array((np.ones(local.size), (rows.ravel(), local.ravel())), shape=(local.shape[1], lift.shape[0])) @ lift
            )
            pattern = pattern + incidence.T @ incidence
    probes = abs(csr_array(system.probes.matrix))
    for i, j in pair_table(system)[2]:
        pattern = pattern + probes[[i]].T @ probes[[j]]
    pattern = csr_array(pattern + pattern.T)
    pattern.eliminate_zeros()
    return pattern


def cell_coordinates(cells: Cells) -> np.ndarray:
    """Coordinates q of every cell, (b c, e)."""
    return (cells.nodes[:, None, :] + np.arange(cells.dim)[None, :, None]).reshape(-1, cells.nodes.shape[1])


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


def dense_of(A: csr_array | np.ndarray, place: np.ndarray, width: int) -> np.ndarray:
    return np.ascontiguousarray(as_dense(A))


def flatten(
    system: System, place: np.ndarray, dense: bool, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray], int]:
    """Tables of all elastic groups behind each other: groups (g, 14), integers, numbers, scatter, length of the work vector."""
    rows, integers, numbers = [], [np.zeros(0, np.int64)], [np.zeros(0)]
    scatters = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    at_integer = at_number = at_scatter = 0
    work = 1
    for elastic in system.elastic:
        part, section = elastic.gather, elastic.gather.section
        points, count = section.shape[1], section.shape[2]
        dim = system.dim
        row = dict.fromkeys(range(14), 0)
        row |= {kernels.CURVATURE: int(part.curvature), kernels.COMPONENTS: dim, kernels.POINTS: points, kernels.CELLS: count}
        jets = 2 * dim * points * count
        if isinstance(part, Cells):
            scatter = scatter_map(part, system, place, dense, width)
            row |= {kernels.BASIS: part.nodes.shape[0], kernels.NODES: at_integer, kernels.TABLE: at_number}
            row |= {kernels.PAIR: at_scatter, kernels.COUNT: len(scatter[0])}
            integers.append(part.nodes.ravel())
            at_integer += part.nodes.size
            tables = [part.table.ravel()]
            size = part.nodes.shape[0] * dim
            work = max(work, 2 * dim * jets, jets + size * count, (size * (size + 1) // 2 + 2) * count)
            scatters.append(scatter)
            at_scatter += len(scatter[0])
        else:
            row |= {kernels.SAMPLED: 1, kernels.FIRST: part.columns.start, kernels.COUNT: part.columns.stop - part.columns.start}
            row |= {kernels.TABLE: at_number, kernels.OFFSET: at_number + part.jets.size}
            row[kernels.TURNED] = at_number + part.jets.size + part.offset.size
            tables = [part.jets.ravel(), part.offset, part.jets.T.ravel()]
            work = max(work, 2 * dim * jets, part.jets.size)
        at_number += sum(len(t) for t in tables)
        row[kernels.SECTION] = at_number
        at_number += section.size
        numbers += [*tables, section.ravel()]
        rows.append([row[k] for k in range(14)])
    source, target, factor = (np.concatenate(part) for part in zip(*scatters, strict=True))
    groups = np.array(rows, dtype=np.int64).reshape(-1, 14)
    return groups, np.concatenate(integers).astype(np.int64), np.concatenate(numbers), (source, target, factor), work


def scatter_map(
    cells: Cells, system: System, place: np.ndarray, dense: bool, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where entries of the cells' lower triangles go in the flat band or dense matrix, W += T^T K_e T."""
    local = cell_coordinates(cells)
    size, count = local.shape
    T = csr_array(system.lift.matrix)
    deep = int(np.diff(T.indptr).max(initial=1))
    target, factor = np.full((T.shape[0], deep), -1), np.zeros((T.shape[0], deep))
    for k in range(deep):
        has = np.diff(T.indptr) > k
        target[has, k], factor[has, k] = place[T.indices[T.indptr[:-1][has] + k]], T.data[T.indptr[:-1][has] + k]
    low, column = np.tril_indices(size)
    sources, targets, factors = [], [], []
    for k in range(deep):
        for m in range(deep):
            i, j = target[local[low], k], target[local[column], m]
            value = factor[local[low], k] * factor[local[column], m]
            source = (low * (low + 1) // 2 + column)[:, None] * count + np.arange(count)[None, :]
            for a, b, on in ((i, j, np.ones(len(low), bool)), (j, i, low != column)):
                valid = (i >= 0) & (j >= 0) & on[:, None] & (dense | (a >= b))
                sources.append(source[valid])
                flat = a * len(place) + b if dense else b * (width + 1) + a - b
                targets.append(flat[valid])
                factors.append(value[valid])
    source, flat, value = np.concatenate(sources), np.concatenate(targets), np.concatenate(factors)
    order = np.argsort(source, kind="stable")
    return source[order].astype(np.int64), flat[order].astype(np.int64), value[order]


def pair_table(system: System) -> tuple[np.ndarray, list[int], list[tuple[int, int]]]:
    """Pairs of probe rows with second derivatives: pair of every constraint term, first pair of every law, the pairs."""
    pairs: list[tuple[int, int]] = []
    terms = system.constraints
    term_pair = np.full(len(terms.row), -1, dtype=np.int64)
    for k in np.flatnonzero(terms.j >= 0):
        term_pair[k] = len(pairs)
        pairs += [(int(terms.i[k]), int(terms.j[k])), (int(terms.j[k]), int(terms.i[k]))]
    law_pair = []
    for law in system.loads.laws:
        law_pair.append(len(pairs))
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


def forces(model: Compiled, x: np.ndarray, v: np.ndarray, t: float = 0.0) -> np.ndarray:
    """C v + K x + elastic and damping forces minus loads, (n,), without inertia and constraints."""
    A = model.arrays
    body, work = model.buffers()
    f = np.zeros(len(x))
    y, g = np.zeros(len(A.probes_offset)), np.zeros(len(A.probes_offset))
    xc, vc = np.ascontiguousarray(x[model.order]), np.ascontiguousarray(v[model.order])
    kernels.add_elastic_force(A.groups, A.lift, A.lift_offset, xc, vc, body, work, f)
    kernels.add_diagonals(A.damping, vc, f)
    kernels.add_diagonals(A.stiffness, xc, f)
    kernels.affine(A.probes, A.probes_offset, xc, y)
    kernels.add_loads(A.forces, y, signal_table(model.system, np.array([t]))[0], g)
    kernels.add_transposed(A.probes, -1.0, g, f)
    f -= A.load
    out = np.zeros_like(f)
    out[model.order] = f
    return out


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


def tangent(model: Compiled, x: np.ndarray, multipliers: np.ndarray, t: float = 0.0, gh: float = 0.0) -> csr_array:
    """d(forces + Phi_x^T lambda)/dx + gh d forces/dv as a sparse array, exact (n, n)."""
    A = model.arrays
    body, work = model.buffers()
    W = np.zeros_like(A.mass_band)
    kernels.add_elastic_tangent(
        A.groups, A.scatter, A.lift, A.lift_offset, np.ascontiguousarray(x[model.order]), body[0], gh, work, W
    )
    signals = signal_table(model.system, np.array([t]))[0]
    H = np.zeros(A.pairs.size)
    kernels.constraint_slopes(A.terms, signals, multipliers, H)
    kernels.load_slopes(A.forces, np.asarray(model.system.probes(x)), signals, -1.0, H)
    inverse = np.argsort(model.order)
    K = csr_array(W if A.dense else from_lower_band(W))[inverse][:, inverse]
    K = K + csr_array(model.system.stiffness) + gh * csr_array(model.system.damping)
    if A.pairs.size:
        pairs = np.array(pair_table(model.system)[2])
        P = csr_array(model.system.probes.matrix)
        K = K + P.T @ csr_array((H, (pairs[:, 0], pairs[:, 1])), shape=(P.shape[0], P.shape[0])) @ P
    return csr_array(K)


def from_lower_band(band: np.ndarray) -> csr_array:
    """The symmetric sparse array of a lower band."""
    n, width = band.shape
    j = np.repeat(np.arange(n), width)
    i = j + np.tile(np.arange(width), n)
    inside = i < n
    low = csr_array((band.ravel()[inside], (i[inside], j[inside])), shape=(n, n))
    upper = low.T.tocsr()
    upper.setdiag(0.0)
    return csr_array(low + upper)


def kkt(K: csr_array, jacobian: np.ndarray) -> csr_array:
    """[[K, J^T], [J, 0]]."""
    J = csr_array(jacobian)
    return csr_array(block_array([[K, J.T], [J, None]])) if J.shape[0] else csr_array(K)
