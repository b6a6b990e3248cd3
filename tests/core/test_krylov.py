"""Multigrid against the direct solver: membranes and plates whose iterations do not grow with the
mesh.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array, eye_array
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad1,
    ElementQuad2,
    ElementQuadBFS,
    ElementVector,
    MeshQuad,
)
from skfem.element import Element
from skfem.helpers import dd, ddot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fmbs_skfem.core.algebra import direct, krylov
from fmbs_skfem.core.errors import InputError, Reason, SolverError


def clamped(matrix: object, motions: np.ndarray, held: np.ndarray) -> tuple[csr_array, np.ndarray]:
    """Matrix and motions without the unknowns that are held."""
    free = np.setdiff1d(np.arange(motions.shape[0]), held)
    left = csr_array(matrix)[free][:, free]
    left.sort_indices()
    return left, motions[free]


def membrane(n: int, element: Element) -> tuple[csr_array, np.ndarray]:
    """Plane strain, E = 1, nu = 0.3, a strip of 4 x 1 with 4n x n cells clamped at x = 0; two
    translations and a rotation.
    """
    basis = Basis(
        MeshQuad.init_tensor(np.linspace(0, 4, 4 * n + 1), np.linspace(0, 1, n + 1)),
        ElementVector(element),
    )
    stiffness = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    (x, y), along_y = basis.doflocs, np.zeros(basis.N, bool)
    for unknowns in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        along_y[unknowns[1::2].ravel()] = True
    motions = np.stack([~along_y, along_y, np.where(along_y, x, -y)], axis=1).astype(float)
    assert abs(stiffness @ motions).max() < 1e-12
    return clamped(stiffness, motions, np.flatnonzero(x == 0.0))


def plate(n: int) -> tuple[csr_array, np.ndarray]:
    """A unit square that bends, nu = 0, n x n cells clamped at x = 0, four unknowns of unequal
    units (w, w_x, w_y, w_xy) a node.
    """
    line = np.linspace(0, 1, n + 1)
    basis = Basis(MeshQuad.init_tensor(line, line), ElementQuadBFS())
    stiffness = BilinearForm(lambda u, v, _: ddot(dd(u), dd(v))).assemble(basis)
    (w, w_x, w_y, _), (x, y), motions = basis.nodal_dofs, basis.mesh.p, np.zeros((basis.N, 3))
    motions[w], motions[w_x, 1], motions[w_y, 2] = (
        np.stack([np.ones_like(x), x, y], axis=1),
        1.0,
        1.0,
    )
    return clamped(stiffness, motions, basis.nodal_dofs[:, x == 0.0].ravel())


CASES = {
    "membrane 8": (lambda: membrane(8, ElementQuad1()), 2),
    "membrane 24": (lambda: membrane(24, ElementQuad1()), 2),
    "quadratic 6": (lambda: membrane(6, ElementQuad2()), 1),
    "quadratic 20": (lambda: membrane(20, ElementQuad2()), 1),
    "bending 20": (lambda: plate(20), 4),
    "bending 60": (lambda: plate(60), 4),
}


@pytest.mark.parametrize(("build", "block"), CASES.values(), ids=CASES.keys())
def test_iterations_do_not_grow_with_the_mesh(
    build: Callable[[], tuple[csr_array, np.ndarray]], block: int
) -> None:
    """Fewer than 30 at two sizes, to 1e-8 of the direct solution."""
    matrix, motions = build()
    preconditioned = krylov.multigrid(matrix, motions, block)
    b = np.random.default_rng(0).normal(size=matrix.shape[0])
    x, iterations = krylov.solve(preconditioned, b, 1e-10)
    exact = direct.solve(direct.factor(matrix), b.copy())
    assert iterations < 30
    assert abs(x - exact).max() < 1e-8 * abs(exact).max()
    report = preconditioned.report
    assert report.unknowns[0] == matrix.shape[0] > 4 * report.unknowns[1]
    assert 1.0 < report.complexity < 2.0
    assert matrix.data.nbytes < report.memory < 2 * (matrix.data.nbytes + matrix.indices.nbytes)


def test_a_good_start_saves_iterations() -> None:
    matrix, motions = membrane(10, ElementQuad1())
    preconditioned = krylov.multigrid(matrix, motions, 2)
    b = np.random.default_rng(1).normal(size=matrix.shape[0])
    x, cold = krylov.solve(preconditioned, b, 1e-10)
    _, warm = krylov.solve(preconditioned, b, 1e-10, start=x * (1.0 + 1e-6))
    _, none = krylov.solve(preconditioned, b, 1e-9, start=x)
    assert none == 0 < warm < cold


def test_units_of_the_unknowns_do_not_matter() -> None:
    """Diagonal scaling gives the same iterations when every second unknown is counted in
    thousandths.
    """
    matrix, motions = membrane(10, ElementQuad1())
    units = np.where(np.arange(matrix.shape[0]) % 2, 1.0, 1e3)
    scaled = csr_array(diags_array(units) @ matrix @ diags_array(units))
    b = np.random.default_rng(2).normal(size=matrix.shape[0])
    x, iterations = krylov.solve(krylov.multigrid(matrix, motions, 2), b, 1e-10)
    y, others = krylov.solve(
        krylov.multigrid(scaled, motions / units[:, None], 2), units * b, 1e-10
    )
    assert others == iterations
    np.testing.assert_allclose(units * y, x, rtol=0, atol=1e-9 * abs(x).max())


def test_no_load_no_motion() -> None:
    matrix, motions = membrane(4, ElementQuad1())
    x, iterations = krylov.solve(
        krylov.multigrid(matrix, motions, 2), np.zeros(matrix.shape[0]), 1e-10
    )
    assert iterations == 0
    assert not x.any()


def test_too_few_iterations_are_reported() -> None:
    matrix, motions = membrane(8, ElementQuad2())
    with pytest.raises(SolverError, match="after 2 iterations") as caught:
        krylov.solve(krylov.multigrid(matrix, motions), np.ones(matrix.shape[0]), 1e-10, most=2)
    assert caught.value.reason is Reason.NOT_CONVERGED


BAD = {
    "columns": (eye_array(6, format="csc"), np.ones((6, 1)), 1, "square csr_array"),
    "motions": (eye_array(6, format="csr"), np.ones((5, 1)), 1, r"finite columns \(6, k\)"),
    "block": (eye_array(6, format="csr"), np.ones((6, 1)), 4, "a divisor of 6"),
    "sign": (
        diags_array([1.0, -2.0, 1.0], format="csr"),
        np.ones((3, 1)),
        1,
        r"-2.0 on the diagonal, row 1",
    ),
}


@pytest.mark.parametrize(("matrix", "motions", "block", "message"), BAD.values(), ids=BAD.keys())
def test_wrong_input_is_refused(
    matrix: csr_array, motions: np.ndarray, block: int, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        krylov.multigrid(csr_array(matrix) if matrix.format == "csr" else matrix, motions, block)


def test_wrong_right_hand_sides_are_refused() -> None:
    matrix, motions = membrane(4, ElementQuad1())
    preconditioned = krylov.multigrid(matrix, motions, 2)
    for wrong in (np.ones(3), np.full(matrix.shape[0], np.nan)):
        with pytest.raises(InputError, match="finite numbers"):
            krylov.solve(preconditioned, wrong, 1e-8)


def test_memory_decides() -> None:
    """10^6 unknowns with 2.8 10^8 numbers: 3.1 GB in double and 1.7 GB in single precision."""
    assert krylov.choose(1_000_000, 2.8e8, 16e9) == "direct"
    assert krylov.choose(1_000_000, 2.8e8, 3e9) == "krylov"
    assert krylov.choose(1_000_000, 2.8e8, 3e9, number=4.0) == "direct"
