"""Factors of large symmetric matrices: their order, on several cores, and beside constraints."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import csr_array, diags_array, eye_array, kron

from fmbs_skfem import dynamics
from fmbs_skfem.core.algebra import direct, inertia, saddle, supernodes
from fmbs_skfem.dynamics.near_state import modes
from fmbs_skfem.dynamics.near_state.linear import linearise
from fmbs_skfem.systems import assemble, free_motions

from ..solids import bar, box


def grid(n: int) -> csr_array:
    """The Laplacian of a cube of n^3 nodes with 26 neighbours each, and a little more."""
    line = diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n))
    neighbours = csr_array(kron(kron(line, line), line))
    degrees = np.asarray(neighbours.sum(axis=1)).ravel()
    return csr_array(diags_array(degrees + 0.01) - neighbours)


def test_dissection_is_an_order_with_less_work() -> None:
    A = grid(14)
    order = supernodes.nested_dissection(A.indptr.astype(np.int64), A.indices.astype(np.int64))
    assert_array_equal(np.sort(order), np.arange(A.shape[0]))
    chosen, degree = (
        supernodes.analyse(A),
        supernodes.analyse(A, supernodes.minimum_degree(csr_array(A))),
    )
    assert supernodes.products(chosen) <= supernodes.products(degree)


def test_a_graph_in_pieces_is_dissected() -> None:
    A = csr_array(kron(eye_array(3), grid(6)))
    order = supernodes.nested_dissection(A.indptr.astype(np.int64), A.indices.astype(np.int64))
    assert_array_equal(np.sort(order), np.arange(A.shape[0]))


@pytest.mark.parametrize("threads", [2, 3])
def test_subtrees_side_by_side_give_the_same_factors(threads: int) -> None:
    A = grid(12)
    tree = supernodes.analyse(A)
    found = []
    for count in (1, threads):
        lower, pivots = np.empty(supernodes.entries(tree)), np.empty(A.shape[0])
        parts = A.indptr, A.indices, A.data
        if count == 1:
            assert direct.eliminate(tree, *parts, lower, pivots) == direct.DONE
        else:
            done = direct.eliminate_side_by_side(tree, parts, lower, pivots, count)
            assert done == direct.DONE
        found.append((lower, pivots))
    assert_array_equal(found[0][0], found[1][0])
    assert_array_equal(found[0][1], found[1][1])


@pytest.mark.parametrize("shift", [0.0, -0.5])
def test_a_saddle_point_by_supernodes(monkeypatch: pytest.MonkeyPatch, shift: float) -> None:
    """A stiffness that is singular without its rows, or has negative directions."""
    monkeypatch.setattr(saddle, "LARGE", 100)
    n = 10
    K = csr_array(grid(n) - (0.01 - shift) * eye_array(n**3))
    J = np.zeros((3, n**3))
    J[0, :5], J[1, 7], J[2, -4:] = 1.0, 2.0, [1.0, -1.0, 2.0, 0.5]
    A = saddle.matrix(K, J)
    found = saddle.factor(A, rows=len(J))
    assert found is not None
    assert isinstance(found.factors, saddle.Bordered)
    b = np.random.default_rng(1).standard_normal((n**3 + 3, 2))
    assert_allclose(saddle.solve(found, b), np.linalg.solve(A.toarray(), b), atol=1e-9)
    null = np.linalg.svd(J)[2][3:].T
    negative = int((np.linalg.eigvalsh(null.T @ K.toarray() @ null) < 0.0).sum())
    assert inertia.count_negative(K, J, found) == negative
    assert (negative > 0) == (shift < 0.0)


def test_modes_by_conjugate_gradients_are_those_by_factors() -> None:
    system = assemble([bar(box((6, 2, 2), (1.0, 0.2, 0.2)))], pictures=False)
    linear = linearise(system)
    wanted = dynamics.vibration_modes(system, 10)
    found = modes.huge_modes(linear, free_motions.rigid_motions(system), 10)
    assert_allclose(found.squares[:6], 0.0, atol=1e-12)
    assert_allclose(found.angular_frequencies[6:], wanted.angular_frequencies[6:], rtol=1e-5)
    gram = found.shapes.T @ (linear.mass @ found.shapes)
    assert_allclose(gram, np.eye(10), atol=1e-6)
