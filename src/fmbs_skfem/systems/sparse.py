r"""Assembly of large iteration matrices: the pattern and the place of every cell entry are found once.

    K_p = sum_e B_e^T D_e B_e,    K = T^T K_p T,    p = T x

K_p is kept as the lower triangle of a sparse matrix in the coordinates p of the cells; T (elimination, frames) is applied to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array

from ..bodies import laws
from ..bodies.body import Cells
from ..core.jit import jit
from ..core.linalg import is_identity, mirrored
from . import kernels
from .gathers import Collected, cell_coordinates
from .kernels import Groups
from .system import System


@dataclass(frozen=True)
class Plan:
    """Pattern of K_p (lower triangle) and the place of every entry of the cells' lower triangles in its data."""

    groups: Groups
    targets: tuple[np.ndarray, ...]  #: (l (l + 1) / 2, e) of every group
    indices: np.ndarray
    indptr: np.ndarray
    lift: csr_array  #: T
    offset: np.ndarray
    plain: bool  #: T is the identity
    work: int


def plan(collected: Collected, groups: Groups, work: int) -> Plan:
    """Pattern and targets of the cells that are flattened in `groups`; `work` is the length of a work vector."""
    locals_ = [cell_coordinates(part) for part in collected.cells]
    n = len(collected.lift.offset)
    keys = [entries(local, n) for local in locals_]
    unique = np.unique(np.concatenate([np.zeros(0, np.int64), *(np.unique(key) for key in keys)]))
    targets = tuple(np.searchsorted(unique, key).astype(np.int32).reshape(key.shape) for key in keys)
    indptr = np.searchsorted(unique, np.arange(n + 1) * n)
    T = csr_array(collected.lift.matrix)
    return Plan(groups, targets, unique % n, indptr, T, collected.lift.offset, is_identity(T), work)


def entries(local: np.ndarray, n: int) -> np.ndarray:
    """Keys row * n + column (row >= column) of the entries of all lower triangles, (l (l + 1) / 2, e)."""
    low, column = np.tril_indices(len(local))
    i, j = local[low].astype(np.int64), local[column].astype(np.int64)
    return np.maximum(i, j) * n + np.minimum(i, j)


def function_pattern(system: System) -> csr_array:
    """Pattern (b, b) of the iteration matrix over the functions of all bodies, each the place of a vector of unknowns."""
    dim, count = system.dim, system.lift.matrix.shape[0] // system.dim
    pattern = csr_array(eye_array(count, dtype=np.float32))  # frames without mass and stiffness have entries too
    for matrix in (system.mass, system.stiffness):
        pattern = csr_array(pattern + abs(csr_array(matrix)[::dim, ::dim].astype(np.float32)))
    for part in system.elastic:
        if not isinstance(part.gather, Cells):
            continue
        nodes = part.gather.nodes // dim
        indptr = np.arange(nodes.shape[1] + 1) * len(nodes)
        width = count if part.gather.spread is None else part.gather.spread.shape[0] // dim
        reads = csr_array((np.ones(nodes.size, np.float32), nodes.T.ravel(), indptr), shape=(nodes.shape[1], width))
        if part.gather.spread is not None:
            reads = csr_array(reads @ abs(csr_array(part.gather.spread)[::dim, ::dim].astype(np.float32)))
        pattern = csr_array(pattern + reads.T @ reads)
    return csr_array(pattern, dtype=float)


def tangent(plan: Plan, x: np.ndarray, gh: float = 0.0) -> csr_array:
    """Elastic tangent K + gh C_elastic (n, n), symmetric."""
    n = len(plan.offset)
    q = plan.lift @ x + plan.offset
    data, work = np.zeros(len(plan.indices)), np.zeros((3, plan.work))
    for g, target in enumerate(plan.targets):
        add_group(plan.groups, g, q, gh, work, target, data)
    K = mirrored(csr_array((data, plan.indices, plan.indptr), shape=(n, n)))
    return K if plan.plain else csr_array(plan.lift.T @ K @ plan.lift)


@jit
def add_group(groups: Groups, g: int, q: np.ndarray, gh: float, work: np.ndarray, target: np.ndarray, data: np.ndarray) -> None:
    """data[target] += lower triangles of the matrices of the cells of a group."""
    row = groups.table[g]
    u = kernels.gather(groups, g, q, q, 1.0, work[0])
    size = u.shape[0]
    D = work[1][: size * u.size].reshape(size, size, u.shape[1], u.shape[2])
    laws.call_modulus(groups.laws, row[kernels.LAW], u, gh * groups.beta[g], kernels.section_view(groups, g), D)
    kernels.cell_matrices(groups, g, D, work[2])
    matrices = work[2][: target.size].reshape(target.shape)
    for k in range(target.shape[0]):
        for e in range(target.shape[1]):
            data[target[k, e]] += matrices[k, e]
