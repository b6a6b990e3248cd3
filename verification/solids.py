"""Solids of ten-node tetrahedra as matrices, by the elasticity of scikit-fem alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_array
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshHex, MeshTet2
from skfem.helpers import ddot, dot, sym_grad, trace


def bar(
    cells: tuple[int, int, int] = (6, 1, 1),
    size: tuple[float, float, float] = (1.0, 0.05, 0.05),
    E: float = 70e9,
    nu: float = 0.3,
    density: float = 2700.0,
) -> tuple[np.ndarray, csr_array, csr_array]:
    """Nodes (n, 3) [m], K and M (3 n, 3 n) node by node of a bar along x, centred in y and z."""
    (L, b, h) = size
    axes = [np.linspace(0.0, L, cells[0] + 1)]
    axes += [np.linspace(-w / 2, w / 2, k + 1) for w, k in ((b, cells[1]), (h, cells[2]))]
    mesh = MeshTet2.from_mesh(MeshHex.init_tensor(*axes).to_meshtet())
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=4)
    lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)

    @BilinearForm
    def stiffness(u: Any, v: Any, _: Any) -> Any:
        e, d = sym_grad(u), sym_grad(v)
        return lame * trace(e) * trace(d) + 2 * mu * ddot(e, d)

    @BilinearForm
    def mass(u: Any, v: Any, _: Any) -> Any:
        return density * dot(u, v)

    unknowns = np.concatenate([basis.nodal_dofs.T, basis.edge_dofs.T])
    order = unknowns.ravel()
    K, M = (csr_array(form.assemble(basis).tocsr())[order][:, order] for form in (stiffness, mass))
    K, M = (csr_array(0.5 * (A + A.T)) for A in (K, M))
    return np.ascontiguousarray(basis.doflocs[:, unknowns[:, 0]].T), K, M


def at(nodes: np.ndarray, x: float) -> tuple[int, ...]:
    """Numbers of the nodes of a face across x [m]."""
    return tuple(np.flatnonzero(np.abs(nodes[:, 0] - x) < 1e-9).tolist())
