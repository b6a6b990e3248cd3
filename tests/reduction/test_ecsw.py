"""Sparse non-negative least squares: exact solutions, tolerance, comparison with scipy, and a
hyper-reduced string of bars.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.reduction.hyper import ecsw
from fmbs_skfem.reduction.spaces import pod


def dense(sample: ecsw.Sample, e: int) -> np.ndarray:
    w = np.zeros(e)
    w[sample.indices] = sample.weights
    return w


def relative(G: np.ndarray, w: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(G @ w - b) / np.linalg.norm(b))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    i=st.integers(3, 60),
    e=st.integers(1, 40),
    exponent=st.integers(1, 10),
)
def test_tolerance_and_signs(seed: int, i: int, e: int, exponent: int) -> None:
    rng = np.random.default_rng(seed)
    G = rng.standard_normal((i, e)) + rng.uniform(0.0, 2.0)
    b, tolerance = G.sum(axis=1), 10.0**-exponent
    sample = ecsw.weights(G, tolerance)
    achieved = relative(G, dense(sample, e), b)
    assert achieved <= tolerance
    assert sample.residual == pytest.approx(achieved, rel=1e-6, abs=1e-14)
    assert np.all(sample.weights > 0.0)
    assert np.all(np.diff(sample.indices) > 0)
    assert sample.iterations >= sample.indices.size


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), i=st.integers(2, 20), e=st.integers(1, 12))
def test_the_least_residual_is_that_of_scipy(seed: int, i: int, e: int) -> None:
    # a right-hand side outside the cone: both must end at the same (unique) residual
    rng = np.random.default_rng(seed)
    G, b = rng.standard_normal((i, e)), rng.standard_normal(i)
    _, norm = nnls(G, b)
    least = norm / np.linalg.norm(b)
    if least < 1e-3 or least > 0.999:
        return
    above = ecsw.weights(G, least * (1.0 + 1e-9), b=b)
    assert relative(G, dense(above, e), b) == pytest.approx(least, rel=1e-8)
    for tolerance in (least * 0.99, 1e-9):
        with pytest.raises(ecsw.NotReached, match="relative residual") as caught:
            ecsw.weights(G, tolerance, b=b)
        best = caught.value.best
        assert caught.value.reason is Reason.NOT_CONVERGED
        assert f"{least:.3g} with {len(best.indices)} columns" in str(caught.value)
        assert (
            relative(G, dense(best, e), b)
            == pytest.approx(best.residual)
            == pytest.approx(least, rel=1e-8)
        )


@pytest.mark.parametrize("tolerance", [1e-5, 1e-11])
def test_a_sparse_solution_is_found_exactly(tolerance: float) -> None:
    # b from 6 of 40 columns that are linearly independent: the minimiser is unique, so the exact
    # weights come back
    rng = np.random.default_rng(3)
    G = rng.uniform(-1.0, 1.0, (200, 40))
    expected = np.zeros(40)
    expected[[2, 7, 11, 23, 31, 39]] = [1.0, 12.5, 0.25, 3.0, 40.0, 2.0]
    sample = ecsw.weights(G, tolerance, b=G @ expected)
    assert sample.indices.tolist() == [2, 7, 11, 23, 31, 39]
    assert np.allclose(sample.weights, expected[sample.indices], rtol=1e-9)


def test_a_column_that_must_leave_again_leaves() -> None:
    # the third column is the steepest first, but b = column 0 + column 1 exactly
    G = np.array([[1.0, 0.0, 0.8], [0.0, 1.0, 0.8], [0.0, 0.0, 0.3]])
    sample = ecsw.weights(G, 1e-10, b=np.array([1.0, 1.0, 0.0]))
    assert sample.indices.tolist() == [0, 1]
    assert np.allclose(sample.weights, 1.0, rtol=1e-12)
    assert sample.iterations == 3


def test_quadrature_points_are_found() -> None:
    # moments of 41 equidistant points up to degree 5: six equations at most, so at most six points
    # are kept
    x = np.linspace(-1.0, 1.0, 41)
    G = np.polynomial.legendre.legvander(x, 5).T
    sample = ecsw.weights(G, 1e-12)
    assert sample.indices.size <= 6
    assert np.sum(sample.weights) == pytest.approx(41.0, rel=1e-11)
    assert sample.weights @ x[sample.indices] ** 4 == pytest.approx(np.sum(x**4), rel=1e-11)


@pytest.mark.parametrize("i, e", [(100, 30), (1, 30), (30, 1), (5, 5)])
def test_compress_keeps_every_residual(i: int, e: int) -> None:
    rng = np.random.default_rng(i + e)
    G, b = rng.standard_normal((i, e)), rng.standard_normal(i)
    R, y = ecsw.compress(G, b)
    assert R.shape == (min(i, e + 1), e)
    for _ in range(5):
        w = rng.standard_normal(e)
        assert np.linalg.norm(R @ w - y) == pytest.approx(np.linalg.norm(G @ w - b), rel=1e-12)


def test_blocks_of_any_size_give_the_same_as_the_whole() -> None:
    rng = np.random.default_rng(8)
    G, b = rng.standard_normal((97, 12)) + 0.5, rng.standard_normal(97)

    def blocks() -> Iterator[np.ndarray]:
        yield from (G[:1], G[1:50], G[50:])

    whole, parts = ecsw.gram(G), ecsw.gram(blocks())
    assert np.allclose(parts.A, whole.A, rtol=1e-13)
    assert np.allclose(parts.c, G.T @ G.sum(axis=1), rtol=1e-12)
    assert parts.bb == pytest.approx(np.sum(G.sum(axis=1) ** 2), rel=1e-13)
    assert np.allclose(ecsw.gram(blocks(), b).c, G.T @ b, rtol=1e-11, atol=1e-11)
    R, y = ecsw.compress(blocks(), b)
    assert np.allclose(R.T @ R, G.T @ G, rtol=1e-12)
    assert np.allclose(R.T @ y, G.T @ b, atol=1e-11)
    direct = ecsw.weights(G, 1e-4)
    other = ecsw.weights_from_gram(parts, 1e-4)
    assert other.indices.tolist() == direct.indices.tolist()
    assert np.allclose(other.weights, direct.weights, rtol=1e-8)


def test_small_tolerances_survive_bad_conditioning() -> None:
    # columns whose Gram matrix has lost half of the digits
    rng = np.random.default_rng(12)
    u, v = (
        np.linalg.qr(rng.standard_normal((400, 30)))[0],
        np.linalg.qr(rng.standard_normal((30, 30)))[0],
    )
    G = (u * 10.0 ** -np.linspace(0.0, 7.0, 30)) @ v.T
    b = G.sum(axis=1)
    kept = []
    for tolerance in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11):
        sample = ecsw.weights(G, tolerance)
        assert relative(G, dense(sample, 30), b) <= tolerance
        kept.append(sample.indices.size)
    assert kept == sorted(kept)
    assert kept[0] < 25


def test_copies_and_empty_columns_do_no_harm() -> None:
    rng = np.random.default_rng(14)
    column = rng.uniform(0.5, 1.0, (50, 4))
    G = np.hstack([column, column, np.zeros((50, 3)), column])
    for tolerance in (1e-5, 1e-10):
        sample = ecsw.weights(G, tolerance)
        assert sample.indices.size <= 4
        assert sample.residual <= tolerance
        assert np.sum(sample.weights) == pytest.approx(12.0, rel=1e-2)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9])
def test_copies_do_not_spoil_a_search_to_the_end(tolerance: float) -> None:
    # b lies outside the cone, so that every column is tried; nearly equal ones must not be taken
    # together
    rng = np.random.default_rng(21)
    for _ in range(20):
        column, b = rng.standard_normal((30, 8)), rng.standard_normal(30)
        G = np.hstack([column, column, column + 1e-9 * rng.standard_normal((30, 8))])
        least = nnls(column, b)[1] / np.linalg.norm(b)
        with pytest.raises(SolverError, match=rf"got {least:.3g} with [1-8] columns"):
            ecsw.weights(G, tolerance, b=b)
        normal = ecsw.gram(G, b)
        sample = ecsw.weights_from_gram(normal, least * (1.0 + 1e-6))
        assert relative(G, dense(sample, 24), b) == pytest.approx(least, rel=1e-5)
        with pytest.raises(SolverError, match=rf"got {least:.3g} with [1-8] columns"):
            ecsw.weights_from_gram(normal, 1e-4)


@pytest.mark.parametrize("factor", [1e-9, 1e9])
def test_the_unit_of_force_does_not_matter(factor: float) -> None:
    G = np.random.default_rng(15).uniform(-0.2, 1.0, (80, 25))
    for tolerance in (1e-2, 1e-8):
        one, other = ecsw.weights(G, tolerance), ecsw.weights(factor * G, tolerance)
        assert one.indices.tolist() == other.indices.tolist()
        assert np.allclose(one.weights, other.weights, rtol=1e-7)


def bar_forces(q: np.ndarray) -> np.ndarray:
    """End forces (s,e,4) of a string of bars with energy (|r'|^2 - 1)^2 / 4 for node positions q
    (s, nodes, 2).
    """
    slope = np.diff(q, axis=1) * (q.shape[1] - 1)
    stress = (np.sum(slope**2, axis=2) - 1.0)[:, :, None] * slope
    return np.concatenate([-stress, stress], axis=2)


def string(cells: int, times: np.ndarray) -> np.ndarray:
    """Node positions (s, nodes, 2) of a string that is swept by a growing wave."""
    xi, t = np.linspace(0.0, 1.0, cells + 1)[None, :], times[:, None]
    return np.stack(
        [xi * (1.0 - 0.3 * t**2), 0.2 * t * xi * np.sin(2.0 * np.pi * (1.5 * xi - 2.0 * t))], axis=2
    )


def test_a_hyper_reduced_string_reproduces_the_reduced_force() -> None:
    cells = 60
    training, unseen = (
        string(cells, t)
        for t in (np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41)[:-1] + 0.0125)
    )
    basis = pod.basis(training.reshape(41, -1).T, tolerance=1e-10)
    local = np.stack([basis.modes[2 * e : 2 * e + 4] for e in range(cells)])
    G, check = (
        np.einsum("ebr,seb->sre", local, bar_forces(q)).reshape(-1, cells)
        for q in (training, unseen)
    )
    sizes = []
    for tolerance in (1e-1, 1e-2, 1e-3):
        sample = ecsw.weights(G, tolerance)
        assert relative(G, dense(sample, cells), G.sum(axis=1)) <= tolerance
        assert relative(check, dense(sample, cells), check.sum(axis=1)) <= 2.0 * tolerance
        sizes.append(sample.indices.size)
    assert sizes == sorted(sizes)
    assert sizes[-1] < cells / 2


@pytest.mark.parametrize(
    "G, tolerance, b, message",
    [
        (np.zeros((4, 3)), 1e-3, None, "not zero, got all zero"),
        (np.zeros((4, 3)), 1e-9, None, "not zero, got all zero"),
        (np.array([[1.0, 2.0], [np.nan, 1.0]]), 1e-3, None, "column 0"),
        (np.array([[1.0, np.inf], [1.0, 1.0]]), 1e-3, None, "column 1"),
        (np.zeros((0, 3)), 1e-3, None, "a matrix"),
        (np.ones(3), 1e-3, None, "a matrix"),
        (np.eye(3), 0.0, None, "0 < tolerance < 1"),
        (np.eye(3), 1.0, None, "0 < tolerance < 1"),
        (np.eye(3), np.nan, None, "0 < tolerance < 1"),
        (np.eye(3), 1e-3, np.ones(2), "b as 3 finite numbers"),
        (np.eye(3), 1e-3, np.array([1.0, np.nan, 0.0]), "b as 3 finite numbers"),
    ],
)
def test_bad_input_is_refused(
    G: np.ndarray, tolerance: float, b: np.ndarray | None, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        ecsw.weights(G, tolerance, b=b)


def test_bad_blocks_are_refused() -> None:
    with pytest.raises(InputError, match="at least one block"):
        ecsw.gram(iter([]))
    with pytest.raises(InputError, match="blocks of 3 columns, got 2"):
        ecsw.compress([np.eye(3), np.eye(2)])
    with pytest.raises(InputError, match="3 rows of G and 5 entries of b"):
        ecsw.gram([np.eye(3)], np.ones(5))
    with pytest.raises(InputError, match="compressed form"):
        ecsw.weights_from_gram(ecsw.gram(np.eye(3)), 1e-9)
    with pytest.raises(
        ecsw.NotReached, match=r"relative residual of 0\.001, got 0\.707 with 1 columns"
    ) as caught:
        ecsw.weights_from_gram(ecsw.gram(np.eye(2), np.array([1.0, -1.0])), 1e-3)
    assert (caught.value.best.indices.tolist(), caught.value.best.weights.tolist()) == ([0], [1.0])
