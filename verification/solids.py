"""Solids of ten-node tetrahedra as matrices, by the elasticity of scikit-fem alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_array
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshHex, MeshTet2
from skfem.helpers import ddot, dot, sym_grad, trace


def basis_of(cells: tuple[int, int, int], size: tuple[float, float, float], order: int) -> Basis:
    """Ten-node tetrahedra of a bar along x, centred in y and z."""
    (L, b, h) = size
    axes = [np.linspace(0.0, L, cells[0] + 1)]
    axes += [np.linspace(-w / 2, w / 2, k + 1) for w, k in ((b, cells[1]), (h, cells[2]))]
    mesh = MeshTet2.from_mesh(MeshHex.init_tensor(*axes).to_meshtet())
    return Basis(mesh, ElementVector(ElementTetP2()), intorder=order)


def by_nodes(basis: Basis) -> np.ndarray:
    """Unknowns (n, 3) of scikit-fem node by node."""
    return np.concatenate([basis.nodal_dofs.T, basis.edge_dofs.T])


def bar(
    cells: tuple[int, int, int] = (6, 1, 1),
    size: tuple[float, float, float] = (1.0, 0.05, 0.05),
    E: float = 70e9,
    nu: float = 0.3,
    density: float = 2700.0,
) -> tuple[np.ndarray, csr_array, csr_array]:
    """Nodes (n, 3) [m], K and M (3 n, 3 n) node by node of a bar along x, centred in y and z."""
    basis = basis_of(cells, size, 4)
    lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)

    @BilinearForm
    def stiffness(u: Any, v: Any, _: Any) -> Any:
        e, d = sym_grad(u), sym_grad(v)
        return lame * trace(e) * trace(d) + 2 * mu * ddot(e, d)

    @BilinearForm
    def mass(u: Any, v: Any, _: Any) -> Any:
        return density * dot(u, v)

    unknowns = by_nodes(basis)
    order = unknowns.ravel()
    K, M = (csr_array(form.assemble(basis).tocsr())[order][:, order] for form in (stiffness, mass))
    K, M = (csr_array(0.5 * (A + A.T)) for A in (K, M))
    return np.ascontiguousarray(basis.doflocs[:, unknowns[:, 0]].T), K, M


def stresses(
    cells: tuple[int, int, int] = (6, 1, 1),
    size: tuple[float, float, float] = (1.0, 0.05, 0.05),
    E: float = 70e9,
    nu: float = 0.3,
) -> tuple[np.ndarray, np.ndarray]:
    """Centroids (e, 3) [m] of the cells of `bar`, and rows (e, 6, 3 n) of the stresses xx, yy, zz,
    xy, yz, zx there by its unknowns [Pa/m].
    """
    basis = basis_of(cells, size, 1)
    unknowns = by_nodes(basis)
    place = np.empty(unknowns.size, dtype=np.int64)
    place[unknowns.ravel()] = np.arange(unknowns.size)
    lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
    count = basis.mesh.t.shape[1]
    rows = np.zeros((count, 6, unknowns.size))
    for k, dofs in enumerate(basis.element_dofs):
        g = np.asarray(basis.basis[k][0].grad)[..., 0]  # (3, 3, e)
        strain = 0.5 * (g + g.transpose(1, 0, 2))
        stress = lame * np.trace(g) * np.eye(3)[:, :, None] + 2 * mu * strain
        for row, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
            rows[np.arange(count), row, place[dofs]] += stress[i, j]
    return np.asarray(basis.mesh.p[:, basis.mesh.t].mean(axis=1).T), rows


def at(nodes: np.ndarray, x: float) -> tuple[int, ...]:
    """Numbers of the nodes of a face across x [m]."""
    return tuple(np.flatnonzero(np.abs(nodes[:, 0] - x) < 1e-9).tolist())
