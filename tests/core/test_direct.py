"""Sparse factors against dense LAPACK, SuperLU and the known eigenvalues of the Laplacian."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from fmbs_skfem.core.algebra import direct, supernodes
from fmbs_skfem.core.errors import InputError, Reason, SolverError


def laplacian(nx: int, ny: int) -> csr_array:
    """The 5-point Laplacian with zero values around; eigenvalues 4 sin^2(i pi / 2(nx+1)) + 4
    sin^2(j pi / 2(ny+1)).
    """
    lines = [
        sparse.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
        for n in (nx, ny)
    ]
    return csr_array(
        sparse.kron(lines[0], sparse.eye_array(ny)) + sparse.kron(sparse.eye_array(nx), lines[1])
    )


def eigenvalues(nx: int, ny: int) -> np.ndarray:
    """Those of `laplacian`, ascending."""
    i, j = np.arange(1, nx + 1), np.arange(1, ny + 1)
    x, y = 4.0 * np.sin(i * np.pi / (2 * nx + 2)) ** 2, 4.0 * np.sin(j * np.pi / (2 * ny + 2)) ** 2
    return np.sort((x[:, None] + y).ravel())


def plate(nx: int, ny: int, unknowns: int = 6) -> csr_array:
    """Positive definite, like a plate's: every two neighbours of a grid, diagonal ones too, coupled
    by dense blocks.
    """
    rng = np.random.default_rng(0)
    block = rng.normal(size=(unknowns, unknowns))
    graph = laplacian(nx, ny) @ laplacian(nx, ny)
    matrix = csr_array(sparse.kron(graph, block @ block.T + np.eye(unknowns)))
    matrix.sort_indices()
    return matrix


def frame(n: int = 30, m: int = 3) -> csr_array:
    """A chain of pairs whose ends also hang on m unknowns that reach all of them: rows of many
    kinds, an arrow.
    """
    rng = np.random.default_rng(1)
    chain = sparse.kron(laplacian(n, 1) + sparse.eye_array(n), np.array([[2.0, 0.5], [0.5, 1.0]]))
    arms = csr_array(rng.normal(size=(m, 2 * n)))
    return csr_array(
        sparse.block_array([[chain + arms.T @ arms, arms.T], [arms, np.eye(m) * 40.0]])
    )


MATRICES = {
    "plate": plate(12, 9),
    "planar": plate(7, 15, 2),
    "scattered": plate(9, 9, 3)[(p := np.random.default_rng(3).permutation(243))][:, p].tocsr(),
    "laplacian": laplacian(20, 13),
    "frame": frame(),
    "dense": csr_array(np.linalg.inv(np.eye(130) + np.ones((130, 130)))),
    "diagonal": csr_array(np.diag([2.0, 3.0, 5.0])),
    "one": csr_array([[4.0]]),
    "parts": csr_array(sparse.block_diag([plate(4, 4, 3), laplacian(5, 5), np.eye(3)])),
}
for _matrix in MATRICES.values():
    _matrix.sum_duplicates()


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
def test_solution(matrix: csr_array) -> None:
    n, dense = matrix.shape[0], matrix.toarray()
    rhs = np.random.default_rng(2).normal(size=(3, n))
    exact = np.linalg.solve(dense, rhs.T).T
    factors, bound = direct.factor(matrix), 1e-15 * np.linalg.cond(dense) * max(n, 10)
    x = rhs.copy()
    assert direct.solve(factors, x) is x
    assert abs(x - exact).max() <= bound * abs(exact).max()
    np.testing.assert_array_equal(direct.solve(factors, rhs[1].copy()), x[1])
    assert (
        abs(direct.residual(matrix, x, rhs)).max()
        <= 1e-14 * n * abs(dense).sum(1).max() * abs(exact).max()
    )


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
def test_factors_multiply_to_the_matrix(matrix: csr_array) -> None:
    factors, n = direct.factor(matrix), matrix.shape[0]
    tree, lower, at = factors.tree, np.eye(n), 0
    for s in range(tree.children.size):
        rows = np.concatenate(
            [
                np.arange(tree.first[s], tree.first[s + 1]),
                tree.rows[tree.start[s] : tree.start[s + 1]],
            ]
        )
        for c in range(tree.first[s + 1] - tree.first[s]):
            lower[rows[c + 1 :], rows[c]] = factors.lower[at : at + rows.size - c - 1]
            at += rows.size - c - 1
    permuted = matrix.toarray()[np.ix_(tree.order, tree.order)]
    assert (
        at
        == factors.lower.size
        == supernodes.entries(tree)
        == supernodes.entries(supernodes.analyse(matrix))
    )
    np.testing.assert_allclose(
        lower * factors.pivots @ lower.T, permuted, rtol=0, atol=1e-14 * n * abs(permuted).max()
    )


def test_single_precision_is_refined_to_double() -> None:
    matrix = plate(30, 22)
    exact = np.random.default_rng(4).normal(size=matrix.shape[0])
    b = matrix @ exact
    factors = direct.factor(matrix, np.float32)
    x, errors = np.zeros_like(b), []
    for _ in range(6):
        x += direct.solve(factors, direct.residual(matrix, x, b))
        errors.append(np.linalg.norm(matrix @ (x - exact)) / np.linalg.norm(b))
    assert factors.lower.dtype == np.float32
    assert errors[0] < 1e-5
    assert errors[-1] < 1e-14


@pytest.mark.parametrize("scale", [1e-200, 1e-60, 1e60])
def test_single_precision_of_any_scale(scale: float) -> None:
    """Factors of the LDL^T form and scaled right-hand sides know no smallest number."""
    matrix = plate(6, 6)
    factors = direct.factor(csr_array(matrix * 1e30), np.float32)
    b = np.random.default_rng(5).normal(size=matrix.shape[0])
    x = direct.solve(factors, b * scale) / scale * 1e30
    np.testing.assert_allclose(
        x, direct.solve(direct.factor(matrix), b.copy()), rtol=0, atol=1e-3 * abs(x).max()
    )


def test_the_fill_is_that_of_superlu() -> None:
    """At most 10 % above SuperLU's L with the same kind of order, zeros of joined supernodes
    included.
    """
    matrix = plate(40, 33)
    options = {
        "permc_spec": "MMD_AT_PLUS_A",
        "diag_pivot_thresh": 0.0,
        "options": {"SymmetricMode": True},
    }
    assert (
        supernodes.entries(supernodes.analyse(matrix)) + matrix.shape[0]
        <= 1.1 * splu(matrix.tocsc(), **options).L.nnz
    )


@pytest.mark.parametrize("shift", [0.31, 1.7, 4.013])
def test_inertia_counts_the_eigenvalues_below_a_shift(shift: float) -> None:
    """Sylvester's law: A - s I has as many negative pivots as A has eigenvalues below s."""
    matrix = csr_array(laplacian(14, 11) - shift * sparse.eye_array(154))
    factors, b = direct.factor(matrix), np.random.default_rng(6).normal(size=154)
    assert np.count_nonzero(factors.pivots < 0.0) == np.count_nonzero(eigenvalues(14, 11) < shift)
    np.testing.assert_allclose(matrix @ direct.solve(factors, b.copy()), b, rtol=0, atol=1e-9)


def test_an_order_of_the_caller() -> None:
    """It is followed as far as unknowns with equal rows stay together, and a bad one costs entries."""
    matrix = plate(10, 8, 2)
    order = np.random.default_rng(7).permutation(160)
    tree = supernodes.analyse(matrix, order)
    exact = np.random.default_rng(8).normal(size=160)
    x = direct.solve(direct.factor(matrix, tree=tree), matrix @ exact)
    np.testing.assert_allclose(x, exact, rtol=0, atol=1e-11)
    assert supernodes.entries(tree) > supernodes.entries(supernodes.analyse(matrix))
    assert sorted(tree.order) == list(range(160))
    np.testing.assert_array_equal(tree.order[::2] // 2, tree.order[1::2] // 2)


def test_an_analysis_serves_every_matrix_of_its_pattern() -> None:
    matrix = plate(10, 8)
    other = matrix.copy()
    other.data *= 3.0
    tree = supernodes.analyse(matrix)
    x = direct.solve(direct.factor(other, tree=tree), np.ones(480))
    np.testing.assert_allclose(
        3.0 * x, direct.solve(direct.factor(matrix, tree=tree), np.ones(480)), rtol=1e-12
    )


def test_another_pattern_is_refused() -> None:
    """Entries without a place in the factors would be lost in silence."""
    tree = supernodes.analyse(laplacian(6, 6))
    with pytest.raises(InputError, match="an entry outside"):
        direct.factor(csr_array(np.eye(36) * 40.0 + np.ones((36, 36))), tree=tree)


def test_a_pattern_with_one_half_of_an_entry() -> None:
    """Assembled matrices drop zeros, and round-off makes them drop A[i, j] but keep A[j, i]."""
    matrix = plate(9, 8, 2)
    coupled = matrix.tocoo()
    rng = np.random.default_rng(9)
    i, j = rng.integers(144, size=(2, 60))
    data = np.concatenate([coupled.data, np.full(60, 1e-17)])
    uneven = csr_array(
        (data, (np.concatenate([coupled.row, i]), np.concatenate([coupled.col, j]))),
        shape=(144, 144),
    )
    uneven.sum_duplicates()
    assert (uneven.astype(bool) != uneven.T.astype(bool)).nnz > 0
    b = rng.normal(size=144)
    x = direct.solve(direct.factor(uneven), b.copy())
    np.testing.assert_allclose(matrix @ x, b, rtol=0, atol=1e-11)


def test_a_singular_matrix_is_reported() -> None:
    """A free string: the last pivot of the chain of 1, 2, 2, ..., 1 vanishes exactly."""
    string = csr_array(
        sparse.diags_array(
            [-np.ones(8), np.array([1.0] + [2.0] * 7 + [1.0]), -np.ones(8)], offsets=[-1, 0, 1]
        )
    )
    with pytest.raises(SolverError, match="no pivot is left for unknown") as caught:
        direct.factor(string)
    assert caught.value.reason is Reason.SINGULAR_TANGENT


def test_not_a_number_survives() -> None:
    matrix = plate(6, 6)
    b = np.ones(216)
    b[17] = np.nan
    assert np.isnan(direct.solve(direct.factor(matrix), b)).all()
    matrix.data[100] = np.nan
    with pytest.raises(SolverError):
        direct.factor(matrix)


BAD = {
    "columns": (laplacian(3, 3).tocsc(), "square csr_array"),
    "oblong": (csr_array(np.ones((2, 3))), "square csr_array"),
    "single": (laplacian(3, 3).astype(np.float32), "square csr_array"),
    "hole": (csr_array(np.array([[1.0, 2.0], [2.0, 0.0]])), "none in row 1"),
    "unsorted": (
        csr_array((np.ones(4), [1, 0, 0, 1], [0, 2, 4]), shape=(2, 2)),
        "ascending columns",
    ),
}


@pytest.mark.parametrize(("matrix", "message"), BAD.values(), ids=BAD.keys())
def test_matrices_that_would_be_misread_are_refused(matrix: csr_array, message: str) -> None:
    with pytest.raises(InputError, match=message):
        direct.factor(matrix)


def test_other_wrong_arguments_are_refused() -> None:
    matrix = laplacian(3, 3)
    with pytest.raises(InputError, match="permutation of"):
        supernodes.analyse(matrix, np.zeros(9, int))
    with pytest.raises(InputError, match="float64 or float32"):
        direct.factor(matrix, np.float16)
    factors = direct.factor(matrix)
    for wrong in (
        np.ones(8),
        np.ones((9, 2)).T[:, ::-1],
        np.ones(9, np.float32),
        np.ones((2, 2, 9)),
    ):
        with pytest.raises(InputError, match="C-contiguous array of float64"):
            direct.solve(factors, wrong)
